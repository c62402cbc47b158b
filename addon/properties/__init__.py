# SPDX-License-Identifier: GPL-3.0-or-later
"""What the artist sets: on the scene, on objects, on view layers.

Enum items are numbered as the library's enumerations, and so keep their meaning in old files.
"""

from __future__ import annotations

import bpy
from bpy.types import Context, Object, PropertyGroup, Scene, ViewLayer, Volume, WindowManager, World

from .. import styles
from ..native import MOST_LAYERS
from ..native.abi import TRUST_DEFAULT
from .automatic import switch
from .brush import PatinaBrushProperties
from .clips import PatinaClipProperties
from .colors import PatinaColorProperties
from .effects import PatinaEffectsProperties
from .heard import BoolProperty, EnumProperty, FloatProperty, FloatVectorProperty, IntProperty, PointerProperty, StringProperty
from .lines import PatinaLinesProperties
from .numbers import attribute_names
from .points import PatinaPointsProperties, PatinaScanProperties
from .ranges import PatinaRangeProperties
from .sequence import PatinaSequenceProperties
from .soft import PatinaSoftProperties
from .studio import PatinaStudioProperties
from .style import PatinaStyleProperties
from .world import PatinaWorldProperties

_OVERRIDE = {'LIBRARY_OVERRIDABLE'}
_PATH = {'ANIMATABLE', *({'PATH_SUPPORTS_BLEND_RELATIVE'} if bpy.app.version >= (4, 5, 0) else ())}  # which warns without


def enum_number(group: PropertyGroup, name: str) -> int:
    """The number of the chosen item, which is the library's."""
    return group.bl_rna.properties[name].enum_items[getattr(group, name)].value


class PatinaSceneProperties(PropertyGroup):
    version: IntProperty(  # of the form of these properties: migrate.py
        name="Version", default=0, min=0, options={'HIDDEN'})
    style: PointerProperty(type=PatinaStyleProperties)
    studio: PointerProperty(type=PatinaStudioProperties, override=_OVERRIDE)
    effects: PointerProperty(type=PatinaEffectsProperties, override=_OVERRIDE)
    lines: PointerProperty(type=PatinaLinesProperties, override=_OVERRIDE)
    surface: EnumProperty(
        name="Surface", override=_OVERRIDE, default='AUTO',
        description="How points become a surface",
        items=(
            ('AUTO', "Automatic", "Points that lie wide apart on screen are discs as wide as their neighborhood says, the others "
                                  "are filled", 0),
            ('FILL', "Filled", "Gaps between the points are filled in the picture: fast, whatever the spacing", 2),
            ('SPLATS', "Discs", "Every point is a small disc across its normal, discs that overlap are blended: smoother, "
                                "slower, gaps wider than the discs stay open", 1),
            ('RANGES', "Range Images", "Points are merged in a coarser picture, and its pixels joined: scans that do not quite fit are one "
                                       "surface, which needs neither normals nor an analysis", 3)))
    error_target: FloatProperty(
        name="Error Target", override=_OVERRIDE, default=0.0, min=0.0, soft_max=10.0, max=100.0, subtype='PERCENTAGE',
        precision=1,
        description="Expected error of colors, in percent of white, that the picture may have: the cheapest quality and "
                    "hole filling that keep to it are chosen")
    use_error_target: switch("error_target", 1.0, "Quality and hole filling follow an expected error; else they are as set below")
    quality: EnumProperty(
        name="Quality", override=_OVERRIDE, default='REFINED',
        description="How filled pixels get their depth and normal",
        items=(
            ('REFINED', "Refined", "Filled pixels lie on the tangent plane of the point that fills them", 0),
            ('PAPER', "As in the Paper", "Filled pixels take depth and normal of the point that fills them", 1)))
    fill: EnumProperty(
        name="Hole Filling", override=_OVERRIDE, default='CLOSED',
        description="How gaps between points close",
        items=(
            ('CLOSED', "Closed", "Gaps close, outlines do not grow", 0),
            ('PAPER', "As in the Paper", "A fixed number of fills; outlines grow a little", 1),
            ('OFF', "Off", "Only measured points", 2)))
    fill_iterations: IntProperty(
        name="Iterations", override=_OVERRIDE, default=0, min=0, max=64,
        description="Rounds of hole filling")
    use_fill_iterations: switch("fill_iterations", 4, "A fixed number of rounds; else it follows the spacing of the points on screen")
    smooth: EnumProperty(
        name="Smoothing", override=_OVERRIDE, default='ALLEVIATED',
        description="Smooths colors between neighboring pixels of one surface",
        items=(
            ('ALLEVIATED', "Alleviated Gaussian", "Weights 16, 2 and 1: takes the noise, keeps the detail", 0),
            ('GAUSSIAN', "Gaussian", "3 × 3 Gaussian", 1),
            ('BOX', "Box", "Mean of 3 × 3 pixels", 2),
            ('OFF', "Off", "Colors as they are", 3)))
    antialias: EnumProperty(
        name="Anti-Aliasing", override=_OVERRIDE, default='LAYERS',
        description="Which edges are blended",
        items=(
            ('LAYERS', "All Edges", "Edges before the background and between layers", 0),
            ('BACKGROUND', "Background Edges", "Edges before the background only", 1),
            ('OFF', "Off", "Hard edges", 2)))
    soft_model: EnumProperty(
        name="Model", override=_OVERRIDE, default='EXPRESS',
        description="How soft points of all objects of the scene are summed up along the eye's ray",
        items=(
            ('BASE', "Base", "Exactly, where balls intersect too", 0),
            ('CONCENTRIC', "Concentric", "By shells of even density: close to Base", 1),
            ('EXPRESS', "Express", "A disc a ball: about ten times faster", 2),
            ('SPLATS', "Splats", "To compare with: the nearest discs alone, opaque", 3),
            ('ONE_LAYER', "One Layer", "To compare with: the nearest discs alone, transparent", 4)))
    layers: IntProperty(
        name="Layers", override=_OVERRIDE, default=8, min=1, max=MOST_LAYERS,
        description="At most so many layers of surface are drawn behind one another where something is transparent. "
                    "Fewer when nothing is left to show: opaque scenes have one")
    use_shadows: BoolProperty(
        name="Shadows", override=_OVERRIDE, default=True,
        description="Points in the shadow of others get no light from lights that cast shadows")
    shadow_samples: IntProperty(
        name="Samples", override=_OVERRIDE, default=16, min=1, max=4096, soft_max=256,
        description="Points of a light's area that shadows are gathered from; sharp lights need one")
    shadow_error: FloatProperty(
        name="Error Target", override=_OVERRIDE, default=0.0, min=0.0, soft_max=10.0, max=100.0, subtype='PERCENTAGE',
        precision=1,
        description="Expected error of soft shadows, in percent of their light: each light takes as many samples as it needs, "
                    "at most 256")
    use_shadow_error: switch("shadow_error", 1.0, "Each light's samples follow an expected error; else there are as many as set below")
    shadow_resolution: IntProperty(
        name="Resolution", override=_OVERRIDE, default=4096, min=16, max=16384, subtype='PIXEL',
        description="Most texels along a side of a light's depth map; it has fewer where the points lie wider")
    shadow_uncut: BoolProperty(
        name="Cut Parts Cast Shadows", override=_OVERRIDE, default=False,
        description="What clip boxes and planes cut away still casts shadows")
    shadow_file: StringProperty(
        name="Baked", override=_OVERRIDE, subtype='FILE_PATH', options=_PATH,
        description="Shadow textures to take from a file instead of computing them; empty: none")
    device: EnumProperty(
        name="Device", override=_OVERRIDE, default='AUTO',
        description="What computes the picture",
        items=(
            ('AUTO', "Automatic", "The GPU where there is one, else the processor", 0),
            ('CPU', "Processor", "The same pixels on every machine", 1),
            ('CPU_SCALAR', "Processor, Plain", "Without vector instructions: slow, for comparison", 2),
            ('GL', "OpenGL", "OpenGL 4.3 compute shaders", 3),
            ('GL_SOFTWARE', "OpenGL in Software", "OpenGL on the processor: slow, for comparison", 4)))
    threads: IntProperty(
        name="Threads", override=_OVERRIDE, default=0, min=0, max=1024,
        description="Processor threads. Never changes the picture")
    use_threads: switch("threads", 4, "A fixed number of threads; else Blender's own setting holds")

    meshes: EnumProperty(
        name="Meshes", override=_OVERRIDE, default='TRIANGLES',
        description="How meshes with faces are in the picture",
        items=(
            ('TRIANGLES', "As They Are", "Exactly, with the material's base color and lit: meshes hide points and points hide "
                                         "meshes", 2),
            ('OFF', "Not Drawn", "Only points; a warning names the meshes", 0),
            ('POINTS', "As Points", "Points are spread over the faces, and filled, smoothed and lit as the others are", 1)))
    mesh_points: IntProperty(
        name="Points per Mesh", override=_OVERRIDE, default=500000, min=100, soft_max=5000000,
        description="How many points are spread over each mesh")
    depth: EnumProperty(
        name="Depth", override=_OVERRIDE, default='POINT',
        description="What the Depth pass tells of points that are filled",
        items=(
            ('POINT', "Of Points", "That of the nearest point in the pixel, as it was measured", 0),
            ('SURFACE', "Of the Surface", "That of the surface in the middle of the pixel: no nearer than it is where points lie "
                                          "dense or slopes are steep", 1)))
    average: BoolProperty(
        name="Average Points", override=_OVERRIDE, default=False,
        description="A pixel shows the mean of all points about its surface, in place of the nearest one alone: truer where "
                    "several fall into a pixel, as in far ground, and steadier in animations. A picture takes two to three times as "
                    "long, and surfaces nearer to each other than two spacings mix. Not of color ramps, nor of points with opacities "
                    "of their own")
    samples: IntProperty(
        name="Samples", override=_OVERRIDE, default=1, min=1, soft_max=64, max=1024,
        description="Of each pixel: a final render takes the mean of about so many finer or shifted ones, each anti-aliased as "
                    "set. Esc keeps those that there are. Data passes are those of one sample")
    noise: FloatProperty(
        name="Noise Threshold", override=_OVERRIDE, default=0.0, min=0.0, soft_max=0.1, max=1.0, step=0.1, precision=4,
        description="Samples end once colors are expected to be off by no more than this share of white, at Samples at the latest "
                    "(1: at 256)")
    use_noise: switch("noise", 0.01, "Samples end once the picture is good enough; else all of them are taken")
    viewport_samples: IntProperty(
        name="Viewport Samples", override=_OVERRIDE, default=1, min=1, soft_max=64, max=1024,
        description="Of each pixel of a viewport at rest, one after another: the picture betters until the view moves")
    viewport_noise: FloatProperty(
        name="Viewport Noise Threshold", override=_OVERRIDE, default=0.0, min=0.0, soft_max=0.1, max=1.0, step=0.1, precision=4,
        description="Samples of a viewport at rest end once colors are expected to be off by no more than this share of white, at "
                    "Viewport Samples at the latest (1: at 256)")
    use_viewport_noise: switch("viewport_noise", 0.02, "Samples end once the picture is good enough; else all of them are taken")
    motion_steps: IntProperty(
        name="Steps", override=_OVERRIDE, default=8, min=1, soft_max=64, max=1024,
        description="Moments while the shutter is open that a final render takes the mean of. Samples for anti-aliasing are "
                    "spread over them, at least one each")
    tile_size: IntProperty(
        name="Tile Size", override=_OVERRIDE, default=0, min=0, max=16384, subtype='PIXEL',
        description="Side of the tiles that large pictures are made in: less memory, the same pixels")
    use_tile_size: switch("tile_size", 2048, "Tiles of a fixed size; else they are as large as the memory that is free allows, at most "
                                             "4096")
    navigation_ms: IntProperty(
        name="Navigation", override=_OVERRIDE, default=60, min=5, soft_max=200, max=1000,
        description="Milliseconds until a picture of the viewport is seen while the view moves, with what Blender takes for "
                    "its window; fewer points and pixels are drawn until it fits. At rest the whole picture follows")


def _known_distance(group: PropertyGroup) -> float:
    """The layer distance that the last picture took for the object, to begin with."""
    from ..sync import estimates  # which needs these properties
    return estimates.layer_distance(group.id_data.name_full) or 0.01


def _known_gap(group: PropertyGroup) -> float:
    return 2.0 * _known_distance(group)


def _linked_file(group: PropertyGroup) -> str:
    from ..sync import files  # which needs these properties
    return files.told(files.text_of(group.id_data))  # Blender takes no other text from Python


def _link_file(group: PropertyGroup, path: str) -> None:
    from ..sync import files
    files.assign(group.id_data, path)


class PatinaObjectProperties(PropertyGroup):
    colors: PointerProperty(type=PatinaColorProperties, override=_OVERRIDE)
    soft: PointerProperty(type=PatinaSoftProperties, override=_OVERRIDE)
    ranges: PointerProperty(type=PatinaRangeProperties, override=_OVERRIDE)
    clip: PointerProperty(type=PatinaClipProperties, override=_OVERRIDE)
    lighting: EnumProperty(
        name="Lighting", override=_OVERRIDE, default='AUTO',
        description="Whether the scene's lights shade the points",
        items=(
            ('AUTO', "Automatic", "Points with colors are unlit (a scan's colors hold the light of its day), "
                                  "others lit", 0),
            ('UNLIT', "Unlit", "Colors as they are", 1),
            ('LIT', "Lit", "Shaded by lights and world", 2)))
    cull_back: BoolProperty(
        name="Backface Culling", override=_OVERRIDE, default=False,
        description="Leave out points that face away; only where the points have normals")
    analysis: EnumProperty(
        name="Analysis", override=_OVERRIDE, default='AUTO',
        description="Whether Patina finds out from each point's neighbors how wide, how thick and which way the surface is there",
        items=(
            ('AUTO', "Automatic", "In the background, once; not for sequences and points that move, which would be analyzed in "
                                  "every frame, nor for range images, which need none", 0),
            ('ALWAYS', "Always", "Sequences and points that move too, in every frame", 1),
            ('OFF', "Off", "Nothing is computed ahead: one spacing holds for many points", 2)))
    analysis_grid: BoolProperty(
        name="By Scan Grid", override=_OVERRIDE, default=False,
        description="Neighbors in the rows and columns of each scan tell normals and footprints, and that a surface ends where the "
                    "scanner saw past it: true outlines, and nothing closed across a step in depth")
    d_min: FloatProperty(
        name="Layer Distance", override=_OVERRIDE, default=0.0, min=0.0, soft_max=1.0, subtype='DISTANCE',
        unit='LENGTH', precision=4,
        description="Least distance between two surfaces that are told apart")
    use_d_min: switch("d_min", _known_distance, "A fixed distance; else it follows the spacing of the points", "Set Layer Distance")
    radius: FloatProperty(
        name="Disc Radius", override=_OVERRIDE, default=0.0, min=0.0, soft_max=1.0, subtype='DISTANCE', unit='LENGTH',
        precision=4,
        description="Of the discs that points are drawn as, see Render Properties > Surface")
    use_radius: switch("radius", _known_distance, "One radius for all points; else each point's own where an attribute says so, else what "
                                                  "its neighbors or 1.75 times the spacing of the points say. Where what lies behind shows through gaps, tick it: it "
                                                  "begins at two spacings", "Set Disc Radius")
    radius_attribute: StringProperty(
        name="Disc Radius Attribute", override=_OVERRIDE, search=attribute_names, search_options={'SUGGESTION'},
        description="Point attribute of numbers, or vertex group: the radius of each point's disc; empty: where all points are "
                    "discs, the own radius of point clouds")
    largest_gap: FloatProperty(
        name="Largest Gap", override=_OVERRIDE, default=0.0, min=0.0, soft_max=1.0, subtype='DISTANCE', unit='LENGTH',
        precision=4,
        description="Where points are discs none is wider than this, so that wider gaps stay open")
    use_largest_gap: switch("largest_gap", _known_gap,
                            "Discs have a greatest width; else they are as wide as the neighbors of each point say")
    free_space: EnumProperty(
        name="Free Space", override=_OVERRIDE, default='OFF',
        description="Points that another scan of the same file saw through: what passed by, reflections, edges that are not there; "
                    "and surface closed between points where a scanner looked through. For clouds that know where their scanners stood",
        items=(
            ('OFF', "Off", "They are points as all others", 0),
            ('SHOW', "Show", "They are magenta, where the points have their own colors", 1),
            ('USE', "Hide", "They are not drawn and cast no shadow, and what lies behind closed surface is seen again. A picture takes "
             "twice as long", 2)))
    hide_stray: BoolProperty(
        name="Stray", override=_OVERRIDE, default=False,
        description="Points that are far from what their neighbors are part of are not drawn and cast no shadow")
    hide_uncolored: BoolProperty(
        name="Uncolored", override=_OVERRIDE, default=False,
        description="Of points with colors, those that are quite black or have none are left out; of a cloud that is black everywhere nobody")
    hide_unclassified: BoolProperty(
        name="Unclassified", override=_OVERRIDE, default=False,
        description="Points of the classes 0, never classified, and 1, unassigned, are not drawn and cast no shadow")
    least_trust: FloatProperty(
        name="Trust", override=_OVERRIDE, default=TRUST_DEFAULT, min=0.0, max=1.0, subtype='FACTOR',
        description="Points of less trust are not drawn and cast no shadow. Trust is the probability that a point lies on a surface, "
                    "and is no mixed pixel or stray. At its default Patina raises it for each cloud, up to 0.84. At zero, all points are drawn")
    opacity: FloatProperty(
        name="Opacity", override=_OVERRIDE, default=1.0, min=0.0, max=1.0, subtype='FACTOR',
        description="How much the surface hides of what lies behind it")
    opacity_attribute: StringProperty(
        name="Opacity Attribute", override=_OVERRIDE, search=attribute_names, search_options={'SUGGESTION'},
        description="Point attribute or vertex group that opacity is multiplied by: numbers from 0 to 1, weights, yes or no, or "
                    "the alpha of a color attribute; empty: none")
    color: FloatVectorProperty(
        name="Color", override=_OVERRIDE, default=(0.8, 0.8, 0.8), min=0.0, max=1.0, subtype='COLOR', size=3,
        description="Color of points that have none. Until it is set: the base color of their material, if they have one")
    linked_data: PointerProperty(  # where the file's path is kept: sync/files.py
        type=Volume, name="Linked Data", override=_OVERRIDE, options={'HIDDEN'})
    linked_file: StringProperty(
        name="Linked File", subtype='FILE_PATH', options=_PATH, get=_linked_file, set=_link_file,
        description="Point file that is drawn in place of the object's own vertices; its points never become Blender's. "
                    "Number signs in its name stand for digits: scan_####.ply shows a file a frame")
    address: StringProperty(name="Address", override=_OVERRIDE, options={'HIDDEN'}, description="Of a COPC or an EPT on a server, in place of a file")
    stream: EnumProperty(
        name="Read", override=_OVERRIDE, default='AUTO',
        description="When a linked COPC is read. As needed: at once seen, without conversion, analysis or stations; a picture fetches "
                    "the points that it shows",
        items=(
            ('AUTO', "Automatic", "COPC files of 20 million points or more as needed, others whole", 0),
            ('ON', "As Needed", "COPC files without conversion, others whole", 1),
            ('OFF', "Whole", "Converted at the first time, analyzed, and kept", 2)))
    sequence: PointerProperty(type=PatinaSequenceProperties, override=_OVERRIDE)
    points: PointerProperty(type=PatinaPointsProperties, override=_OVERRIDE)
    cast_shadows: BoolProperty(
        name="Cast", override=_OVERRIDE, default=True, description="These points throw shadows")
    receive_shadows: BoolProperty(
        name="Receive", override=_OVERRIDE, default=True, description="Shadows fall on these points")
    self_shadows: BoolProperty(
        name="On Itself", override=_OVERRIDE, default=True, description="These points' shadows fall on themselves")
    color_attribute: StringProperty(
        name="Color Attribute", override=_OVERRIDE,
        description="Point attribute to take colors from; empty: the active color attribute, or a usual name")
    normal_attribute: StringProperty(
        name="Normal Attribute", override=_OVERRIDE,
        description="Point attribute to take normals from; empty: the first of normal, Normal, nor, N")
    ambient: FloatProperty(
        name="Ambient", override=_OVERRIDE, default=1.0, min=0.0, soft_max=1.0, subtype='FACTOR',
        description="Share of the world's light")
    diffuse: FloatProperty(
        name="Diffuse", override=_OVERRIDE, default=1.0, min=0.0, soft_max=1.0, subtype='FACTOR',
        description="Share of matt reflection")
    specular: FloatProperty(
        name="Specular", override=_OVERRIDE, default=0.0, min=0.0, soft_max=1.0, subtype='FACTOR',
        description="Share of shiny reflection")
    shininess: IntProperty(
        name="Shininess", override=_OVERRIDE, default=32, min=1, soft_max=256,
        description="Phong exponent: the higher, the smaller the highlight")


def _update_passes(_group: PropertyGroup, context: Context) -> None:
    context.view_layer.update_render_passes()


class PatinaViewLayerProperties(PropertyGroup):
    use_pass_shadow: BoolProperty(
        name="Shadow", default=False, update=_update_passes, override=_OVERRIDE,
        description="Share of the shadow-casting lights that arrives: 1 lit, 0 in shadow")
    use_pass_source: BoolProperty(
        name="Source", default=False, update=_update_passes, override=_OVERRIDE,
        description="What is scan and what is invention: 0 nothing, 1 measured, 1 + distance filled from a "
                    "neighbor that many pixels away, negative where anti-aliasing mixed")
    use_pass_line: BoolProperty(
        name="Line", default=False, update=_update_passes, override=_OVERRIDE,
        description="Share of each pixel that a line covers, of the nearest layer; without lines 0")
    use_pass_trust: BoolProperty(
        name="Trust", default=False, update=_update_passes, override=_OVERRIDE,
        description="Probability that the nearest point lies on a surface, 0 to 1; 0 where nothing is, or the points were not analyzed")
    use_pass_thickness: BoolProperty(
        name="Thickness", default=False, update=_update_passes, override=_OVERRIDE,
        description="Sigma of the nearest point's surface, in the scene's units: noise, and how far scans disagree; "
                    "0 where nothing is, or nothing is known")
    use_pass_density: BoolProperty(
        name="Density", default=False, update=_update_passes, override=_OVERRIDE,
        description="How many soft points lie before the surface, for each square of the scene's unit across the view: what an "
                    "X-ray shows. 0 where there are none")
    use_pass_disagreement: BoolProperty(
        name="Disagreement", default=False, update=_update_passes, override=_OVERRIDE,
        description="How far scans lie apart where range images show them, in the scene's units, along the surface's normal: what "
                    "registration is off by. 0 where one scan is alone, or which scan a point is of is not known")
    pass_layers: IntProperty(
        name="Layers", default=0, min=0, max=MOST_LAYERS, update=_update_passes, override=_OVERRIDE,
        description="Color, depth and normal of so many layers of surface, the nearest first, as passes of their own; "
                    "layers behind opaque surfaces too")


_CLASSES = (PatinaScanProperties, PatinaPointsProperties, PatinaSequenceProperties, PatinaStyleProperties, PatinaStudioProperties, PatinaEffectsProperties,
            PatinaLinesProperties, PatinaColorProperties, PatinaSoftProperties, PatinaRangeProperties, PatinaClipProperties, PatinaSceneProperties,
            PatinaObjectProperties, PatinaViewLayerProperties, PatinaWorldProperties, PatinaBrushProperties)
_OWNERS = ((Scene, PatinaSceneProperties), (Object, PatinaObjectProperties), (ViewLayer, PatinaViewLayerProperties),
           (World, PatinaWorldProperties))


def register() -> None:
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    for owner, group in _OWNERS:
        owner.patina = PointerProperty(type=group, name="Patina", override=_OVERRIDE)
    WindowManager.patina_brush = bpy.props.PointerProperty(type=PatinaBrushProperties, name="Patina Brush", options={'SKIP_SAVE'})


def unregister() -> None:
    styles.forget_icons()
    del WindowManager.patina_brush
    for owner, _ in _OWNERS:
        del owner.patina
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
