# SPDX-License-Identifier: GPL-3.0-or-later
"""What the artist sets: on the scene, on objects, on view layers.

Enum items are numbered as the library's enumerations, and so keep their meaning in old files.
"""

from __future__ import annotations

import bpy
from bpy.types import Context, Object, PropertyGroup, Scene, ViewLayer, Volume, WindowManager, World

from ..native import MOST_LAYERS
from ..styles import styles
from . import answers
from .automatic import switch
from .brush import PatinaBrushProperties
from .clips import PatinaClipProperties
from .colors import PatinaColorProperties
from .drawings import PatinaDrawingProperties
from .effects import PatinaEffectsProperties
from .heard import BoolProperty, EnumProperty, FloatProperty, FloatVectorProperty, IntProperty, PointerProperty, StringProperty
from .lines import PatinaLinesProperties
from .marks import PatinaMarksProperties
from .measures import PatinaMeasure, PatinaMeasuresProperties
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
    marks: PointerProperty(type=PatinaMarksProperties, override=_OVERRIDE)
    surface: EnumProperty(
        name="Surface", override=_OVERRIDE, default='AUTO',
        description="How the points become a surface",
        items=(
            ('AUTO', "Automatic", "Points that are far apart on screen are drawn as discs, the others are filled", 0),
            ('FILL', "Filled", "Gaps between points are filled in image space. Fast at any spacing", 2),
            ('SPLATS', "Discs", "Each point is a disc across its normal, and overlapping discs are blended. Smoother and slower. Gaps wider than the "
                                "discs stay open", 1),
            ('RANGES', "Range Images", "Points are merged in a coarser image whose pixels are joined. Merges scans that do not fit exactly. Needs no "
                                       "normals and no analysis", 3)))
    error_target: FloatProperty(
        name="Error Target", override=_OVERRIDE, default=0.0, min=0.0, soft_max=10.0, max=100.0, subtype='PERCENTAGE',
        precision=1,
        description="Largest expected color error, in percent of white. Patina chooses the fastest quality and hole filling that stays below it")
    use_error_target: switch("error_target", 1.0, "Choose quality and hole filling by an expected error. Disabled: use the settings below")
    quality: EnumProperty(
        name="Quality", override=_OVERRIDE, default='REFINED',
        description="How filled pixels get their depth and normal",
        items=(
            ('REFINED', "Refined", "Filled pixels are placed on the tangent plane of the point that fills them", 0),
            ('PAPER', "As in the Paper", "Filled pixels take the depth and normal of the point that fills them", 1)))
    fill: EnumProperty(
        name="Hole Filling", override=_OVERRIDE, default='CLOSED',
        description="How gaps between points are closed",
        items=(
            ('CLOSED', "Closed", "Gaps are closed, and outlines do not grow", 0),
            ('PAPER', "As in the Paper", "A fixed number of iterations. Outlines grow slightly", 1),
            ('OFF', "Off", "Draw only measured points", 2)))
    fill_iterations: IntProperty(
        name="Iterations", override=_OVERRIDE, default=0, min=0, max=64,
        description="Number of iterations of hole filling")
    use_fill_iterations: switch("fill_iterations", 4, "Use a fixed number of iterations. Disabled: it follows the spacing of the points on screen")
    smooth: EnumProperty(
        name="Smoothing", override=_OVERRIDE, default='ALLEVIATED',
        description="Smooth the colors of neighboring pixels on the same surface",
        items=(
            ('ALLEVIATED', "Alleviated Gaussian", "Weights 16, 2 and 1. Reduces noise and keeps detail", 0),
            ('GAUSSIAN', "Gaussian", "3 × 3 Gaussian", 1),
            ('BOX', "Box", "Mean of 3 × 3 pixels", 2),
            ('OFF', "Off", "Colors are not changed", 3)))
    antialias: EnumProperty(
        name="Anti-Aliasing", override=_OVERRIDE, default='LAYERS',
        description="Which edges are anti-aliased",
        items=(
            ('LAYERS', "All Edges", "Edges against the background and between layers", 0),
            ('BACKGROUND', "Background Edges", "Edges against the background only", 1),
            ('OFF', "Off", "No anti-aliasing", 2)))
    soft_model: EnumProperty(
        name="Model", override=_OVERRIDE, default='EXPRESS',
        description="How the soft points of all objects are combined along a view ray",
        items=(
            ('BASE', "Base", "Exact, also where balls intersect", 0),
            ('CONCENTRIC', "Concentric", "Shells of constant density. Close to Base", 1),
            ('EXPRESS', "Express", "One disc per ball. About ten times faster", 2),
            ('SPLATS', "Splats", "For comparison: only the nearest discs, opaque", 3),
            ('ONE_LAYER', "One Layer", "For comparison: only the nearest discs, transparent", 4)))
    layers: IntProperty(
        name="Layers", override=_OVERRIDE, default=8, min=1, max=MOST_LAYERS,
        description="Largest number of surface layers to draw where something is transparent. Opaque scenes need one layer only")
    use_shadows: BoolProperty(
        name="Shadows", override=_OVERRIDE, default=True,
        description="Points cast shadows on each other, from lights that cast shadows")
    shadow_samples: IntProperty(
        name="Samples", override=_OVERRIDE, default=16, min=1, max=4096, soft_max=256,
        description="Number of shadow samples per light. Lights without a size need one")
    shadow_error: FloatProperty(
        name="Error Target", override=_OVERRIDE, default=0.0, min=0.0, soft_max=10.0, max=100.0, subtype='PERCENTAGE',
        precision=1,
        description="Largest expected error of soft shadows, in percent of their light. Each light takes as many samples as needed, up to 256")
    use_shadow_error: switch("shadow_error", 1.0, "Choose each light's samples by an expected error. Disabled: use the number below")
    shadow_resolution: IntProperty(
        name="Resolution", override=_OVERRIDE, default=4096, min=16, max=16384, subtype='PIXEL',
        description="Largest width of a shadow map, in texels. Sparse points need fewer")
    shadow_uncut: BoolProperty(
        name="Cut Parts Cast Shadows", override=_OVERRIDE, default=False,
        description="Clipped points still cast shadows")
    shadow_file: StringProperty(
        name="Baked", override=_OVERRIDE, subtype='FILE_PATH', options=_PATH,
        description="File of baked shadows to use instead of computing them. Empty: compute them")
    device: EnumProperty(
        name="Device", override=_OVERRIDE, default='AUTO',
        description="Device that computes the image",
        items=(
            ('AUTO', "Automatic", "The GPU if there is one, otherwise the processor", 0),
            ('CPU', "Processor", "SIMD code on the processor. Gives the same pixels on each machine", 1),
            ('CPU_SCALAR', "Processor, Plain", "No vector instructions. Slow, for comparison", 2),
            ('GL', "OpenGL", "OpenGL 4.3 compute shaders", 3),
            ('GL_SOFTWARE', "OpenGL in Software", "OpenGL on the processor. Slow, for comparison", 4)))
    threads: IntProperty(
        name="Threads", override=_OVERRIDE, default=0, min=0, max=1024,
        description="Number of processor threads. Does not change the image")
    use_threads: switch("threads", 4, "Use a fixed number of threads. Disabled: Blender's own setting")

    meshes: EnumProperty(
        name="Meshes", override=_OVERRIDE, default='TRIANGLES',
        description="How meshes with faces are rendered",
        items=(
            ('TRIANGLES', "As They Are", "Render the faces with the material's base color, lit. Meshes and points hide each other", 2),
            ('OFF', "Not Drawn", "Render only points. A warning names the meshes", 0),
            ('POINTS', "As Points", "Scatter points over the faces, and render them like other points", 1)))
    mesh_points: IntProperty(
        name="Points per Mesh", override=_OVERRIDE, default=500000, min=100, soft_max=5000000,
        description="Number of points to scatter over each mesh")
    depth: EnumProperty(
        name="Depth", override=_OVERRIDE, default='POINT',
        description="What the Depth pass contains where points are filled",
        items=(
            ('POINT', "Of Points", "Depth of the nearest point in the pixel, as measured", 0),
            ('SURFACE', "Of the Surface", "Depth of the surface at the center of the pixel. More accurate on dense points and steep slopes", 1)))
    average: BoolProperty(
        name="Average Points", override=_OVERRIDE, default=False,
        description="Show the mean color of all points on a pixel's surface, instead of the nearest point's color. Reduces noise and flicker where "
                    "several points share a pixel. Takes two to three times as long, and mixes surfaces closer than two spacings. Has no effect on "
                    "color ramps and on points with their own opacity")
    samples: IntProperty(
        name="Samples", override=_OVERRIDE, default=4, min=1, soft_max=64, max=1024,
        description="Samples per pixel of a final render. Esc keeps the samples rendered so far. Data passes use one sample")
    noise: FloatProperty(
        name="Noise Threshold", override=_OVERRIDE, default=0.0, min=0.0, soft_max=0.1, max=1.0, step=0.1, precision=4,
        description="Stop sampling once the expected color error is below this share of white. Takes at most Samples (256 if Samples is 1 or "
                    "was never changed)")
    use_noise: switch("noise", 0.01, "Stop sampling once the image is good enough. Disabled: take all samples")
    viewport_samples: IntProperty(
        name="Viewport Samples", override=_OVERRIDE, default=1, min=1, soft_max=64, max=1024,
        description="Samples per pixel in the viewport. They accumulate while the view is still")
    viewport_noise: FloatProperty(
        name="Viewport Noise Threshold", override=_OVERRIDE, default=0.0, min=0.0, soft_max=0.1, max=1.0, step=0.1, precision=4,
        description="Stop sampling in the viewport once the expected color error is below this share of white. Takes at most Viewport Samples (256 "
                    "if it is 1)")
    use_viewport_noise: switch("viewport_noise", 0.02, "Stop sampling once the image is good enough. Disabled: take all samples")
    motion_steps: IntProperty(
        name="Steps", override=_OVERRIDE, default=8, min=1, soft_max=64, max=1024,
        description="Number of moments for motion blur while the shutter is open. The render samples are distributed over them, at least one each")
    tile_size: IntProperty(
        name="Tile Size", override=_OVERRIDE, default=0, min=0, max=16384, subtype='PIXEL',
        description="Width of the tiles of large renders, in pixels. Saves memory, gives the same pixels")
    use_tile_size: switch("tile_size", 2048, "Use tiles of a fixed size. Disabled: as large as the free memory allows, at most 4096")
    navigation_ms: IntProperty(
        name="Navigation", override=_OVERRIDE, default=60, min=5, soft_max=200, max=1000,
        description="Time per viewport frame while the view moves, in milliseconds. Patina draws fewer points and pixels to meet it. All points are "
                    "drawn once the view is still")


def _known_distance(group: PropertyGroup) -> float:
    """The layer distance that the last picture took for the object, to begin with."""
    return answers.layer_distance(group.id_data.name_full) or 0.01


def _known_trust(group: PropertyGroup) -> float:
    """The threshold that the last picture took for the object, to begin with."""
    return answers.automatic_trust(group.id_data.name)


def _known_gap(group: PropertyGroup) -> float:
    return 2.0 * _known_distance(group)


def _linked_file(group: PropertyGroup) -> str:
    return answers.linked_file(group.id_data)


def _link_file(group: PropertyGroup, path: str) -> None:
    answers.link_file(group.id_data, path)


class PatinaObjectProperties(PropertyGroup):
    colors: PointerProperty(type=PatinaColorProperties, override=_OVERRIDE)
    soft: PointerProperty(type=PatinaSoftProperties, override=_OVERRIDE)
    ranges: PointerProperty(type=PatinaRangeProperties, override=_OVERRIDE)
    clip: PointerProperty(type=PatinaClipProperties, override=_OVERRIDE)
    lighting: EnumProperty(
        name="Lighting", override=_OVERRIDE, default='AUTO',
        description="How the points are lit",
        items=(
            ('AUTO', "Automatic", "Points with colors are unlit, since scan colors already contain light. Others are lit", 0),
            ('UNLIT', "Unlit", "Show the points' colors unchanged", 1),
            ('LIT', "Lit", "Shade the points with the lights and the world", 2)))
    cull_back: BoolProperty(
        name="Backface Culling", override=_OVERRIDE, default=False,
        description="Hide points that face away from the camera. Needs normals")
    analysis: EnumProperty(
        name="Analysis", override=_OVERRIDE, default='AUTO',
        description="When to compute the footprint, thickness, normal and trust of each point from its neighbors",
        items=(
            ('AUTO', "Automatic", "Once, in the background. Not for sequences and deforming points, which would need it in each frame, and not for "
                                  "range images, which do not need it", 0),
            ('ALWAYS', "Always", "Also for sequences and deforming points, in each frame", 1),
            ('OFF', "Off", "No analysis. One spacing is used for many points, and there is no trust", 2)))
    analysis_grid: BoolProperty(
        name="By Scan Grid", override=_OVERRIDE, default=False,
        description="Use the rows and columns of each scan for normals and footprints. Gives exact outlines, and closes no gap across a step in "
                    "depth")
    d_min: FloatProperty(
        name="Layer Distance", override=_OVERRIDE, default=0.0, min=0.0, soft_max=1.0, subtype='DISTANCE',
        unit='LENGTH', precision=4,
        description="Smallest distance between two separate surfaces")
    use_d_min: switch("d_min", _known_distance, "Use a fixed distance. Disabled: it follows the spacing of the points", "Set Layer Distance")
    radius: FloatProperty(
        name="Disc Radius", override=_OVERRIDE, default=0.0, min=0.0, soft_max=1.0, subtype='DISTANCE', unit='LENGTH',
        precision=4,
        description="Radius of discs, if Surface in the Render Properties draws discs")
    use_radius: switch("radius", _known_distance, "Use one radius for all points. Disabled: the radius attribute of each point, or what its neighbors or "
                                                  "1.75 times the spacing suggest. Enable it if surfaces behind show through gaps", "Set Disc Radius")
    radius_attribute: StringProperty(
        name="Disc Radius Attribute", override=_OVERRIDE, search=attribute_names, search_options={'SUGGESTION'},
        description="Point attribute or vertex group with the radius of each disc. Empty: the radius of the point cloud, if all points are discs")
    largest_gap: FloatProperty(
        name="Largest Gap", override=_OVERRIDE, default=0.0, min=0.0, soft_max=1.0, subtype='DISTANCE', unit='LENGTH',
        precision=4,
        description="Largest radius of a disc. Wider gaps stay open")
    use_largest_gap: switch("largest_gap", _known_gap,
                            "Discs have a greatest width; else they are as wide as the neighbors of each point say")
    free_space: EnumProperty(
        name="Free Space", override=_OVERRIDE, default='OFF',
        description="Points that another scan of the same file saw through, such as passers-by and reflections, and filled surface that a scanner "
                    "looked through. Needs scanner positions",
        items=(
            ('OFF', "Off", "Draw them like other points", 0),
            ('SHOW', "Show", "Draw them in magenta, if the points have their own colors", 1),
            ('USE', "Hide", "Hide them, and open filled surface that a scanner looked through. Takes twice as long", 2)))
    hide_uncolored: BoolProperty(
        name="Uncolored", override=_OVERRIDE, default=False,
        description="Hide points that are black or have no color, unless the whole cloud is black")
    hide_unclassified: BoolProperty(
        name="Unclassified", override=_OVERRIDE, default=False,
        description="Hide points of the classes 0 (never classified) and 1 (unassigned). They cast no shadow")
    least_trust: FloatProperty(
        name="Trust", override=_OVERRIDE, default=-1.0, min=-1.0, soft_min=0.0, max=1.0, subtype='FACTOR',
        description="Hide points below this trust. They cast no shadow. Trust is the probability that a point is on a surface, not a mixed pixel or "
                    "a stray. At 0, all points are drawn. Below 0, the threshold is automatic")
    use_least_trust: switch("least_trust", _known_trust, "Set the threshold. Otherwise, Patina chooses it per cloud, from 0.64 to 0.84",
                            "Set Trust", automatic=-1)
    trust_styled: BoolProperty(override=_OVERRIDE, default=False, options={'HIDDEN'})  # by a style: the next one undoes it
    opacity: FloatProperty(
        name="Opacity", override=_OVERRIDE, default=1.0, min=0.0, max=1.0, subtype='FACTOR',
        description="Opacity of the surface")
    opacity_attribute: StringProperty(
        name="Opacity Attribute", override=_OVERRIDE, search=attribute_names, search_options={'SUGGESTION'},
        description="Point attribute or vertex group to multiply the opacity by: numbers from 0 to 1, weights, booleans, or the alpha of a color "
                    "attribute. Empty: none")
    color: FloatVectorProperty(
        name="Color", override=_OVERRIDE, default=(0.8, 0.8, 0.8), min=0.0, max=1.0, subtype='COLOR', size=3,
        description="Color of points that have no color. Until it is set, the base color of their material is used, if there is one")
    linked_data: PointerProperty(  # where the file's path is kept: sync/points/files.py
        type=Volume, name="Linked Data", override=_OVERRIDE, options={'HIDDEN'})
    linked_file: StringProperty(
        name="Linked File", subtype='FILE_PATH', options=_PATH, get=_linked_file, set=_link_file,
        description="Point file to draw instead of the object's own vertices. Number signs stand for the frame number: scan_####.ply shows one file "
                    "per frame")
    address: StringProperty(name="Address", override=_OVERRIDE, options={'HIDDEN'}, description="Address of a COPC or EPT cloud on a server, instead "
                                                                                                "of a file")
    stream: EnumProperty(
        name="Read", override=_OVERRIDE, default='AUTO',
        description="How linked COPC files are read. As needed: visible at once, without conversion, analysis or stations",
        items=(
            ('AUTO', "Automatic", "COPC files of 20 million points or more as needed, others whole", 0),
            ('ON', "As Needed", "COPC files without conversion, other files whole", 1),
            ('OFF', "Whole", "Converted on first use, analyzed, and cached", 2)))
    sequence: PointerProperty(type=PatinaSequenceProperties, override=_OVERRIDE)
    points: PointerProperty(type=PatinaPointsProperties, override=_OVERRIDE)
    measures: PointerProperty(type=PatinaMeasuresProperties, override=_OVERRIDE)
    drawing: PointerProperty(type=PatinaDrawingProperties, override=_OVERRIDE)
    cast_shadows: BoolProperty(
        name="Cast", override=_OVERRIDE, default=True, description="The points cast shadows")
    receive_shadows: BoolProperty(
        name="Receive", override=_OVERRIDE, default=True, description="The points receive shadows")
    self_shadows: BoolProperty(
        name="On Itself", override=_OVERRIDE, default=True, description="The points cast shadows on themselves")
    color_attribute: StringProperty(
        name="Color Attribute", override=_OVERRIDE,
        description="Point attribute with colors. Empty: the active color attribute, or a common name")
    normal_attribute: StringProperty(
        name="Normal Attribute", override=_OVERRIDE,
        description="Point attribute with normals. Empty: the first of normal, Normal, nor, N")
    ambient: FloatProperty(
        name="Ambient", override=_OVERRIDE, default=1.0, min=0.0, soft_max=1.0, subtype='FACTOR',
        description="Ambient reflection: share of the world's light")
    diffuse: FloatProperty(
        name="Diffuse", override=_OVERRIDE, default=1.0, min=0.0, soft_max=1.0, subtype='FACTOR',
        description="Diffuse reflection")
    specular: FloatProperty(
        name="Specular", override=_OVERRIDE, default=0.0, min=0.0, soft_max=1.0, subtype='FACTOR',
        description="Specular reflection")
    shininess: IntProperty(
        name="Shininess", override=_OVERRIDE, default=32, min=1, soft_max=256,
        description="Phong exponent. Higher values give smaller highlights")


def _update_passes(_group: PropertyGroup, context: Context) -> None:
    context.view_layer.update_render_passes()


class PatinaViewLayerProperties(PropertyGroup):
    use_pass_shadow: BoolProperty(
        name="Shadow", default=False, update=_update_passes, override=_OVERRIDE,
        description="Share of the light that reaches the surface: 1 is lit, 0 is in shadow")
    use_pass_source: BoolProperty(
        name="Source", default=False, update=_update_passes, override=_OVERRIDE,
        description="Origin of each pixel: 0 nothing, 1 measured, 1 + distance filled from a neighbor at that distance in pixels, negative where "
                    "anti-aliasing mixed")
    use_pass_line: BoolProperty(
        name="Line", default=False, update=_update_passes, override=_OVERRIDE,
        description="Share of each pixel that a line covers, in the nearest layer")
    use_pass_trust: BoolProperty(
        name="Trust", default=False, update=_update_passes, override=_OVERRIDE,
        description="Trust of the nearest point, from 0 to 1. 0 where nothing is drawn or the points were not analyzed")
    use_pass_thickness: BoolProperty(
        name="Thickness", default=False, update=_update_passes, override=_OVERRIDE,
        description="Thickness (sigma) of the nearest point's surface, in scene units: noise and disagreement of scans. 0 where it is unknown")
    use_pass_density: BoolProperty(
        name="Density", default=False, update=_update_passes, override=_OVERRIDE,
        description="Number of soft points in front of the surface, per square scene unit across the view, as in an X-ray image")
    use_pass_disagreement: BoolProperty(
        name="Disagreement", default=False, update=_update_passes, override=_OVERRIDE,
        description="Distance between scans along the surface normal, in scene units, for range images. Shows registration errors. 0 where one scan "
                    "is alone")
    use_pass_overlay: BoolProperty(
        name="Overlay", default=False, update=_update_passes, override=_OVERRIDE,
        description="Legends, scale bar, north arrow and title, with transparency, to lay over the image")
    pass_layers: IntProperty(
        name="Layers", default=0, min=0, max=MOST_LAYERS, update=_update_passes, override=_OVERRIDE,
        description="Number of surface layers whose color, depth and normal become separate passes, nearest first, also behind opaque surfaces")


_CLASSES = (PatinaScanProperties, PatinaPointsProperties, PatinaSequenceProperties, PatinaStyleProperties, PatinaStudioProperties, PatinaEffectsProperties,
            PatinaLinesProperties, PatinaMarksProperties, PatinaMeasure, PatinaMeasuresProperties, PatinaColorProperties, PatinaSoftProperties, PatinaRangeProperties, PatinaClipProperties, PatinaDrawingProperties, PatinaSceneProperties,
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
