# SPDX-License-Identifier: GPL-3.0-or-later
"""The compositor's nodes of Combine by Depth: made, handed to another scene of points, and taken out again."""

from __future__ import annotations

import bpy
from bpy.types import Node, NodeSocket, NodeTree, Scene

NODE = "Patina Combine"
_UNDER, _OVER = f"{NODE}: under", f"{NODE}: over"
_BELOW = 1 if bpy.app.version < (5, 0, 0) else 0  # input of Alpha Over; before it was the factor, 1


def trees_of(scene: Scene) -> list[NodeTree]:
    """The compositor trees that the scene uses. From Blender 5.3 on it may have several, one for each effect."""
    if bpy.app.version >= (5, 3, 0):
        return [effect.node_group for effect in scene.compositor_effects if effect.node_group and effect.enable_for_render]
    tree = scene.compositing_node_group if bpy.app.version >= (5, 0, 0) else scene.use_nodes and scene.node_tree
    return [tree] if tree else []


def set_tree(scene: Scene, tree: NodeTree | None) -> None:
    """Makes a node group the scene's only compositor tree, from Blender 5.0 on. None: the scene has no tree then."""
    if bpy.app.version < (5, 3, 0):
        scene.compositing_node_group = tree
        return
    scene.compositor_effects.clear()
    if tree:
        scene.compositor_effects.new(name=tree.name).node_group = tree


def hand_over(scene: Scene, old: Scene, points: Scene) -> None:
    """What came from the old scene of points comes from the new one."""
    for node in (node for tree in trees_of(scene) for node in tree.nodes):
        if node.type == 'R_LAYERS' and node.scene == old:
            node.scene = points


def take_out(scene: Scene) -> bool:
    """Where the scene of points is gone, its nodes go too, and the output gets what went into the combination: else the picture would
    be empty. Whether that was so."""
    tree = next((tree for tree in trees_of(scene) if _UNDER in tree.nodes), None)
    under = tree.nodes[_UNDER] if tree and scene.library is None else None
    if under is None or NODE not in tree.nodes:
        return False
    gone = {link.from_node for link in under.inputs[_BELOW].links}
    if not gone or any(node.type != 'R_LAYERS' or node.scene for node in gone):
        return False
    images = [link.from_socket for link in under.inputs[_BELOW + 1].links]
    for target in [link.to_socket for link in tree.nodes[NODE].outputs[0].links]:
        for image in images:
            tree.links.new(image, target)
    for node in [*gone, *(tree.nodes[name] for name in (NODE, _UNDER, _OVER) if name in tree.nodes)]:
        tree.nodes.remove(node)
    return True


def _made_tree(scene: Scene) -> NodeTree:
    """The scene's compositor tree; a new one shows the scene's layer."""
    if bpy.app.version < (5, 0, 0):
        scene.use_nodes = True
        return scene.node_tree
    trees = trees_of(scene)
    if not trees:
        tree = bpy.data.node_groups.new(f"{scene.name} Compositor", 'CompositorNodeTree')
        tree.interface.new_socket("Image", in_out='OUTPUT', socket_type='NodeSocketColor')
        set_tree(scene, tree)
        return tree
    return trees[-1]


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


def link(scene: Scene, points: Scene, layer: str) -> None:
    """What went into the output goes through the combination: of the picture over the points and the points over the picture,
    each pixel takes the one whose upper half is nearer. (Z Combine's own use of alpha takes premultiplied colours for straight.)
    """
    tree = _made_tree(scene)
    output = _output(tree)
    around, ours = _layers(tree, scene, layer, (0, 300)), _layers(tree, points, layer, (0, -100))
    for node in [node for node in tree.nodes if node.type == 'R_LAYERS' and node.scene is None]:
        tree.nodes.remove(node)  # of the points' scene that went
    known = tree.nodes.get(_UNDER)
    source = known.inputs[_BELOW + 1] if known else output
    image = source.links[0].from_socket if source.is_linked else around.outputs["Image"]
    combine = tree.nodes.get(NODE) or tree.nodes.new('CompositorNodeZcombine')
    combine.name = combine.label = NODE
    combine.location = (500, 200)
    under = _over(tree, _UNDER, (300, 300), ours.outputs["Image"], image)
    over = _over(tree, _OVER, (300, 0), image, ours.outputs["Image"])
    if bpy.app.version < (5, 0, 0):
        combine.use_alpha = combine.use_antialias_z = False
    else:
        combine.inputs["Use Alpha"].default_value = combine.inputs["Anti-Alias"].default_value = False
    for place, socket in enumerate((under, around.outputs["Depth"], over, ours.outputs["Depth"])):
        tree.links.new(socket, combine.inputs[place])
    tree.links.new(combine.outputs[0], output)
