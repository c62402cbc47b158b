# SPDX-License-Identifier: GPL-3.0-or-later
"""Combine by Depth: Cycles or EEVEE renders the scene, Patina its points, and the compositor puts them together by who is nearer."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty
from bpy.types import Context, Node, NodeSocket, NodeTree, Operator, Scene, TOPBAR_MT_render

from .. import pairs
from ..pairs import MARK

NODE = "Patina Combine"
_BELOW = 1 if bpy.app.version < (5, 0, 0) else 0  # input of Alpha Over; before it was the factor, 1


class PATINA_OT_combine(Operator):
    """Let Cycles or EEVEE render this scene, and put Patina's points into its picture: a second scene with the same objects \
draws them, and the compositor takes what is nearer. That scene follows this one's camera, size, border and frames"""

    bl_idname = "scene.patina_combine"
    bl_label = "Combine with Points by Depth"
    bl_options = {'REGISTER', 'UNDO'}

    engine: EnumProperty(
        name="Engine", default='CYCLES', description="What renders everything but the points",
        items=(('CYCLES', "Cycles", "Cycles", 0), ('EEVEE', "EEVEE", "EEVEE", 1)))

    @classmethod
    def poll(cls, context: Context) -> bool:
        return context.scene is not None and pairs.first_of(context.scene) is None

    def execute(self, context: Context) -> set[str]:
        scene, layer = context.scene, context.view_layer.name
        if scene.camera is None:
            self.report({'ERROR'}, "Patina: the scene has no camera")
            return {'CANCELLED'}
        eevee = 'BLENDER_EEVEE_NEXT' if (4, 2, 0) <= bpy.app.version < (5, 0, 0) else 'BLENDER_EEVEE'
        try:
            scene.render.engine = 'CYCLES' if self.engine == 'CYCLES' else eevee
        except TypeError:
            self.report({'ERROR'}, f"Patina: this Blender has no {self.engine}: its add-on is switched off")
            return {'CANCELLED'}
        if self.engine == 'CYCLES' and scene.cycles.use_denoising and not _denoises():
            scene.cycles.use_denoising = False  # else F12 ends with an error and no picture
            self.report({'WARNING'}, "Denoise is off now: this Blender's Cycles was built without it")
        points = _points_scene(scene)
        for one in (scene, points):
            one.view_layers[layer].use_pass_z = True
        _link_nodes(scene, points, layer)
        self.report({'INFO'}, f"F12 renders '{scene.name}' with points now; Patina's settings are in scene '{points.name}'")
        return {'FINISHED'}


def _denoises() -> bool:
    """Whether Cycles was built with its denoiser: Debian's was not, though its new scenes ask for it."""
    try:
        import _cycles
    except ImportError:
        return True
    return getattr(_cycles, "with_openimagedenoise", True)


class PATINA_OT_other_scene(Operator):
    """Show the other scene of the two that are combined in this window"""

    bl_idname = "scene.patina_other"
    bl_label = "Go to Other Scene"

    @classmethod
    def poll(cls, context: Context) -> bool:
        return context.scene is not None and _other(context.scene) is not None

    def execute(self, context: Context) -> set[str]:
        context.window.scene = _other(context.scene)
        return {'FINISHED'}


def _other(scene: Scene) -> Scene | None:
    return pairs.first_of(scene) or pairs.points_of(scene)


def _points_scene(scene: Scene) -> Scene:
    """A scene of the same objects that Patina draws, without faces and without background. The one from last time goes."""
    old = pairs.points_of(scene)
    points = scene.copy()  # collections and objects are the same
    if old:  # what was set there stays
        for name in old.patina.keys():
            points.patina[name] = old.patina[name]
        bpy.data.scenes.remove(old)
    points.name = f"{scene.name} Points"
    points[MARK] = scene
    pairs.follow(points, scene)
    points.render.engine = 'PATINA'
    points.render.film_transparent = True
    points.patina.meshes = 'OFF'
    if bpy.app.version < (5, 0, 0):
        points.use_nodes = False
    else:
        points.compositing_node_group = None
    return points


def _tree(scene: Scene) -> NodeTree:
    """The scene's compositor tree; a new one shows the scene's layer."""
    if bpy.app.version < (5, 0, 0):
        scene.use_nodes = True
        return scene.node_tree
    if scene.compositing_node_group is None:
        tree = bpy.data.node_groups.new(f"{scene.name} Compositor", 'CompositorNodeTree')
        tree.interface.new_socket("Image", in_out='OUTPUT', socket_type='NodeSocketColor')
        scene.compositing_node_group = tree
    return scene.compositing_node_group


def _output(tree: NodeTree) -> NodeSocket:
    """Where the picture goes."""
    kind = 'COMPOSITE' if bpy.app.version < (5, 0, 0) else 'GROUP_OUTPUT'
    found = [node for node in tree.nodes if node.type == kind]
    node = found[0] if found else tree.nodes.new(
        'CompositorNodeComposite' if kind == 'COMPOSITE' else 'NodeGroupOutput')
    node.location = node.location if found else (700, 300)
    return node.inputs[0]


def _layers(tree: NodeTree, scene: Scene, layer: str, place: tuple[int, int]) -> Node:
    """A Render Layers node of a scene's layer: the one that is there, or a new one."""
    for node in tree.nodes:
        if node.type == 'R_LAYERS' and node.scene == scene and node.layer == layer:
            return node
    node = tree.nodes.new('CompositorNodeRLayers')
    node.scene, node.layer, node.location = scene, layer, place
    return node


def _over(tree: NodeTree, name: str, place: tuple[int, int], below: NodeSocket, above: NodeSocket) -> NodeSocket:
    """One premultiplied picture over another."""
    node = tree.nodes.get(name) or tree.nodes.new('CompositorNodeAlphaOver')
    node.name = node.label = name
    node.location = place
    tree.links.new(below, node.inputs[_BELOW])
    tree.links.new(above, node.inputs[_BELOW + 1])
    return node.outputs[0]


def _link_nodes(scene: Scene, points: Scene, layer: str) -> None:
    """What went into the output goes through the combination: of the picture over the points and the points over the picture,
    each pixel takes the one whose upper half is nearer. (Z Combine's own use of alpha takes premultiplied colours for straight.)
    """
    tree = _tree(scene)
    output = _output(tree)
    around, ours = _layers(tree, scene, layer, (0, 300)), _layers(tree, points, layer, (0, -100))
    for node in [node for node in tree.nodes if node.type == 'R_LAYERS' and node.scene is None]:
        tree.nodes.remove(node)  # of the points' scene that went
    known = tree.nodes.get(f"{NODE}: under")
    source = known.inputs[_BELOW + 1] if known else output
    image = source.links[0].from_socket if source.is_linked else around.outputs["Image"]
    combine = tree.nodes.get(NODE) or tree.nodes.new('CompositorNodeZcombine')
    combine.name = combine.label = NODE
    combine.location = (500, 200)
    under = _over(tree, f"{NODE}: under", (300, 300), ours.outputs["Image"], image)
    over = _over(tree, f"{NODE}: over", (300, 0), image, ours.outputs["Image"])
    if bpy.app.version < (5, 0, 0):
        combine.use_alpha = combine.use_antialias_z = False
    else:
        combine.inputs["Use Alpha"].default_value = combine.inputs["Anti-Alias"].default_value = False
    for place, socket in enumerate((under, around.outputs["Depth"], over, ours.outputs["Depth"])):
        tree.links.new(socket, combine.inputs[place])
    tree.links.new(combine.outputs[0], output)


def _menu(self: bpy.types.Menu, _context: Context) -> None:
    self.layout.operator_menu_enum(PATINA_OT_combine.bl_idname, "engine", text="Combine Points by Depth with")


def register() -> None:
    bpy.utils.register_class(PATINA_OT_combine)
    bpy.utils.register_class(PATINA_OT_other_scene)
    TOPBAR_MT_render.append(_menu)


def unregister() -> None:
    TOPBAR_MT_render.remove(_menu)
    bpy.utils.unregister_class(PATINA_OT_other_scene)
    bpy.utils.unregister_class(PATINA_OT_combine)
