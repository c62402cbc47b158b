# SPDX-License-Identifier: GPL-3.0-or-later
"""Depth cues and means of drawing: each is rendered and held against what its pixels should be."""

import bpy
import numpy as np
from check_passes import dense_scene
from check_points import pixel
from harness import add_light, add_points, check, check_close, linear, new_scene, render, reports, set_world, sphere
from mathutils import Matrix
from patina import native, sync
from patina.description.settings import Effects

POINT = (0.01, 0.01, -3.0)
SHOWN = native.abi.OWN_EFFECTS


def one_point(color=(200, 120, 60)):
    scene = new_scene()
    add_points([POINT], np.array([(*color, 255)], np.uint8))
    return scene


def shown(scene):
    return render()["Combined"][pixel(scene, POINT)]


def before_and_after(scene, *switches):
    """The picture without and with effects."""
    plain = render()
    for name in switches:
        setattr(scene.patina.effects, name, True)
    changed = render()
    check((plain["Depth"] == changed["Depth"]).all() and (plain["Normal"] == changed["Normal"]).all(),
          "depth or normal changed")
    check_close(plain["Combined"][..., 3], changed["Combined"][..., 3], 1e-6, "alpha")
    return plain["Combined"][..., :3], changed["Combined"][..., :3]


def test_off_is_nothing():
    scene = dense_scene()
    first = render()["Combined"]
    effects = scene.patina.effects
    effects.edl_strength, effects.fog_start, effects.hatch_spacing, effects.paper_grain = 3.0, 1.0, 20.0, 0.9
    check((render()["Combined"] == first).all(), "what is switched off drew something")


def test_each_does_something():
    """As it is switched on first, every effect of the table changes the picture, and switched off nothing is left of it."""
    scene = dense_scene()
    scene.patina.effects.fog_start, scene.patina.effects.fog_end = 1.0, 5.0
    bpy.data.objects["points"].patina.lighting = 'LIT'
    add_light('SUN', 3.0, direction=(-0.5, -0.4, -1))
    first = render()["Combined"]
    for effect in SHOWN:
        setattr(scene.patina.effects, f"use_{effect['name']}", True)
        check((render()["Combined"] != first).any(), f"{effect['name']} changes nothing")
        setattr(scene.patina.effects, f"use_{effect['name']}", False)
        check((render()["Combined"] == first).all(), f"{effect['name']} is not wholly off")


def test_fields_are_the_library_s():
    described = list(Effects.__dataclass_fields__)
    check(described == [name for name, *_ in native.abi.Effects._fields_[1:]], f"{described}")


def test_edl():
    """A sphere is darker at its rim than in the middle, and darker still with more strength; in both projections."""
    for kind in ('PERSP', 'ORTHO'):
        scene = dense_scene()
        scene.camera.data.type = kind
        scene.camera.data.ortho_scale = 3.0
        scene.patina.antialias = 'OFF'
        plain, dark = before_and_after(scene, "use_edl")
        alpha = render()["Combined"][..., 3] > 0
        ratio = np.where(alpha, dark.sum(axis=2) / np.maximum(plain.sum(axis=2), 1e-6), np.nan)
        height, width = alpha.shape
        middle = np.nanmean(ratio[height // 2 - 3:height // 2 + 3, width // 2 - 3:width // 2 + 3])
        inner = alpha.copy()
        for axis, step in ((0, 1), (0, -1), (1, 1), (1, -1)):
            inner &= np.roll(alpha, step, axis)
        rim = np.nanmean(ratio[alpha & ~inner])
        check(middle > 0.8 and rim < 0.7, f"{kind}: middle {middle:.2f}, rim {rim:.2f}")
        scene.patina.effects.edl_strength = 3.0
        stronger = render()["Combined"][..., :3]
        check(stronger[alpha].sum() < 0.8 * dark[alpha].sum(), f"{kind}: no darker at three times the strength")


def test_obscurance():
    """Where a wall stands on a floor both are dark; away from it neither is."""
    scene = new_scene(96, 96)
    for name in ("fill", "smooth", "antialias"):
        scene.patina.property_unset(name)
    x, y = np.meshgrid(np.linspace(-2, 2, 220), np.linspace(-2, 2, 220))
    floor = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], 1)
    add_points(floor, np.full((x.size, 4), 255, np.uint8), np.tile((0.0, 0.0, 1.0), (x.size, 1)), "floor")
    add_points(floor[:, (0, 2, 1)] + (0, 0, 2), np.full((x.size, 4), 255, np.uint8), np.tile((0.0, -1.0, 0.0), (x.size, 1)), "wall")
    scene.camera.matrix_world = Matrix.Translation((0, -4, 2.5)) @ Matrix.Rotation(1.05, 4, 'X')
    scene.patina.effects.obscurance_radius = 0.4
    plain, dark = before_and_after(scene, "use_obscurance")
    ratio = dark.sum(axis=2) / np.maximum(plain.sum(axis=2), 1e-6)
    corner = [ratio[pixel(scene, place)] for place in ((0, -0.06, 0), (0.5, 0, 0.06))]
    away = [ratio[pixel(scene, place)] for place in ((0.2, -1.0, 0), (0.2, 0, 1.0))]
    check(max(corner) < 0.85 and min(away) > 0.97, f"corner {corner}, away {away}")


def test_fog():
    scene = one_point()
    effects = scene.patina.effects
    effects.use_fog, effects.fog_start, effects.fog_end, effects.fog_density = True, 2.0, 4.0, 0.8
    effects.fog_use_color, effects.fog_color = True, (0.1, 0.2, 0.9)
    own = linear((200, 120, 60))
    check_close(shown(scene)[:3], 0.6 * own + 0.4 * np.array((0.1, 0.2, 0.9)), 2e-3, "half way")
    check(shown(scene)[3] == 1.0, "alpha")
    effects.fog_use_color = False
    set_world((0.4, 0.5, 0.6))
    check_close(shown(scene)[:3], 0.6 * own + 0.4 * np.array((0.4, 0.5, 0.6)), 2e-3, "into the world")
    effects.fog_start = 5.0
    effects.fog_end = 5.0
    check_close(shown(scene)[:3], own, 2e-3, "no range, no fog")
    check(any("fog" in text for _, text in reports), f"nothing said: {reports}")


def test_toon():
    """Light comes in as many bands as asked for, and each point keeps its colour."""
    scene = dense_scene()
    scene.patina.smooth = scene.patina.antialias = 'OFF'
    bpy.data.objects["points"].patina.lighting = 'LIT'
    set_world((0.05, 0.05, 0.05))
    add_light('SUN', 3.0, direction=(-0.5, -0.4, -1))
    obj = bpy.data.objects["points"]
    effects = scene.patina.effects
    effects.use_toon, effects.toon_bands, effects.toon_softness = True, 3, 0.0
    banded = render()["Combined"]
    obj.patina.lighting = 'UNLIT'
    effects.use_toon = False
    own = render()["Combined"]
    some = own[..., 3] > 0
    ratio = banded[some][:, :3] / np.maximum(own[some][:, :3], 1e-4)
    check_close(ratio.max(axis=1), ratio.min(axis=1), 1e-3 * ratio.max(), "a colour changed its hue")
    levels = np.sqrt(ratio[:, 1]) * 2.5  # in the middle of bands: 1/2, 3/2, 5/2
    near = np.abs(levels - np.floor(levels) - 0.5) < 0.02
    check(near.mean() > 0.85, f"{near.mean():.2f} of the pixels lie in a band")
    check(len(set(np.floor(levels[near]).astype(int))) >= 3, "fewer than three bands")


def test_hatching():
    """Black ink on white ground: white where it is bright, strokes where it is dark."""
    scene = dense_scene(192, 144)
    effects = scene.patina.effects
    effects.use_hatch, effects.hatch_ground, effects.hatch_color, effects.hatch_levels = True, 1.0, (0, 0, 0), 1
    for byte, least, most in ((20, 0.3, 0.8), (250, 0.0, 0.1)):
        for obj in list(bpy.data.objects):
            if obj.name.startswith("points"):
                bpy.data.objects.remove(obj)
        positions, colors, normals = sphere(30000)
        add_points(positions, np.full_like(colors, (byte, byte, byte, 255)), normals)
        picture = render()["Combined"]
        inside = picture[picture[..., 3] > 0.99][:, 0]
        ink = 1.0 - inside.mean()
        check(least <= ink <= most, f"colour {byte}: {ink:.2f} of the surface is ink")
        check(inside.min() > -1e-6 and inside.max() < 1.0 + 1e-5, f"{inside.min()} to {inside.max()}")


def slope_scene(slope):
    """White points on z = -3 + slope x, seen from above; 24 pixels a unit."""
    scene = new_scene(96, 48)
    x, y = np.meshgrid(np.linspace(-2.5, 2.5, 400), np.linspace(-1.5, 1.5, 240))
    normal = np.array((-slope, 0.0, 1.0)) / np.hypot(slope, 1.0)
    add_points(np.stack([x.ravel(), y.ravel(), -3.0 + slope * x.ravel()], 1), np.full((x.size, 4), 255, np.uint8),
               np.tile(normal, (x.size, 1)))
    scene.camera.data.type, scene.camera.data.ortho_scale = 'ORTHO', 4.0
    effects = scene.patina.effects
    effects.use_contour, effects.contour_color, effects.contour_every = True, (0, 0, 0), 1
    effects.contour_width = 2.0
    return scene


def ink_of(scene):
    """Pixels' worth of ink on each column of the picture, (width,)."""
    picture = render()["Combined"]
    check((picture[..., 3] > 0.99).all(), "holes")
    return 1.0 - picture[..., :3].mean(axis=(0, 2))


def test_contour():
    """Lines lie where the height is a multiple of the interval, equally wide at any slope; a level floor has none."""
    for slope in (0.1, 0.5, 1.2):
        scene = slope_scene(slope)
        scene.patina.effects.contour_interval = slope  # a line a unit, at whole x less what -3 is off
        ink = ink_of(scene)
        first = (-(-3.0) / slope) % 1.0
        at = (np.arange(96) + 0.5) / 24.0 - 2.0
        away = np.abs((at - first + 0.5) % 1.0 - 0.5) * 24.0  # pixels from the next line
        check(ink[away > 2.6].max() < 0.01, f"slope {slope}: ink {ink[away > 2.6].max():.3f} between lines")
        middle = [ink[np.abs(at - line) * 24.0 < 2.6].sum() for line in (first - 1.0, first)]
        check(max(np.abs(np.array(middle) - 2.0)) < 0.3, f"slope {slope}: {middle} pixels of ink about lines")
        check(abs(ink.sum() / 4.0 - 2.0) < 0.3, f"slope {slope}: a line is {ink.sum() / 4.0:.2f} pixels wide")
    effects = scene.patina.effects
    effects.contour_every, effects.contour_bold = 2, 6.0
    check(abs(ink_of(scene).sum() / 4.0 - 4.0) < 0.5, "every second line is not bold")
    effects.contour_every, effects.contour_interval = 1, slope / 1000.0
    ink = ink_of(scene)
    check(0.4 < ink.min() and ink.max() - ink.min() < 1e-3, f"too fine lines: {ink.min():.3f} to {ink.max():.3f}")
    effects.contour_interval = 0.0
    check(0.0 < ink_of(scene).mean() < 0.4, "Automatic draws none, or all")
    effects.contour_source, effects.contour_axis, effects.contour_interval = 'PLANE', (1.0, 0.0, 0.0), 0.5
    ink = ink_of(scene)  # eight lines, across x
    check(abs(ink.sum() / 8.0 - 2.0) < 0.3, f"from a plane: {ink.sum() / 8.0:.2f} pixels wide")
    effects.contour_axis = (0.0, 0.0, 0.0)  # means z
    level = slope_scene(0.0)
    level.patina.effects.contour_interval = 1.0
    check(ink_of(level).max() == 0.0, "a level floor at a line's height is inked")


def test_contour_along_attribute():
    """Lines follow the attribute that the points' Color panel names, or their ramp's, on a level floor too; a mesh has none; what lacks
    the attribute is told of."""
    scene = slope_scene(0.0)
    scene.patina.effects.contour_source, scene.patina.effects.contour_interval = 'ATTRIBUTE', 0.5
    obj = next(obj for obj in bpy.data.objects if obj.name.startswith("points"))
    places = np.empty(3 * len(obj.data.vertices), np.float32)
    obj.data.vertices.foreach_get("co", places)
    obj.data.attributes.new("along", 'FLOAT', 'POINT').data.foreach_set("value", 2.0 * places[0::3] + 0.25)
    check(ink_of(scene).max() == 0.0, "lines along no attribute")
    obj.patina.colors.contour = "along"
    ink = ink_of(scene)  # a line a quarter of a unit
    check(abs(ink.sum() / 16.0 - 2.0) < 0.3, f"a line is {ink.sum() / 16.0:.2f} pixels wide")
    scene.patina.effects.contour_interval = 1.0
    ink = ink_of(scene)
    away = np.abs(((np.arange(96) + 0.5) / 24.0 - 2.0 + 0.125 + 0.25) % 0.5 - 0.25) * 24.0
    check(ink[away > 2.6].max() < 0.01, f"ink {ink[away > 2.6].max():.3f} between lines")
    check(abs(ink.sum() / 8.0 - 2.0) < 0.3, f"a line is {ink.sum() / 8.0:.2f} pixels wide")
    obj.patina.colors.contour = "nowhere"
    check(ink_of(scene).max() == 0.0, "lines along an attribute that is not there")
    obj.patina.colors.contour, obj.patina.colors.source, obj.patina.colors.scalar = "", 'SCALAR', "along"
    obj.patina.lighting, obj.patina.colors.ramp, obj.patina.colors.use_range = 'UNLIT', 'GREY', True
    obj.patina.colors.range_min, obj.patina.colors.range_max = -101.0, -100.0  # white
    check_close(ink_of(scene), ink, 1e-5, "along the ramp's attribute")
    bpy.ops.mesh.primitive_plane_add(size=10.0, location=(0.0, 0.0, -2.0))
    picture = render()["Combined"]
    check((picture[..., 3] > 0.99).all() and np.ptp(picture[..., :3]) < 1e-3, "lines on a mesh")


def test_paper():
    """Tint and grain over all of an opaque film, deterministic; a transparent film keeps its alpha."""
    scene = dense_scene()
    scene.render.film_transparent = False
    set_world((1, 1, 1))
    effects = scene.patina.effects
    effects.use_paper, effects.paper_color, effects.paper_grain = True, (0.9, 0.8, 0.6), 0.3
    corner = render()["Combined"][:12, :12]
    check((corner[..., :3] <= np.float32((0.9, 0.8, 0.6)) + 1e-6).all(), "brighter than the paper")
    check((corner[..., :3] >= 0.7 * np.float32((0.9, 0.8, 0.6)) - 1e-6).all(), "darker than the grain")
    check(corner[..., 0].std() > 0.01, "no grain")
    check((render()["Combined"][:12, :12] == corner).all(), "another grain at the second time")
    scene.render.film_transparent = True
    check(not render()["Combined"][0, 0].any(), "paper where nothing is")


def test_depth_of_field():
    """Blender's camera decides what is sharp: by distance or by an object."""
    scene = dense_scene(128, 96)
    sharp = render()["Combined"]
    lens = scene.camera.data.dof
    lens.use_dof, lens.aperture_fstop = True, 0.05  # a lens a metre wide
    lens.focus_distance = 3.4

    def soft(picture):
        alpha = picture[..., 3]
        return int(((alpha > 0.02) & (alpha < 0.98)).sum())

    near = render()["Combined"]
    lens.focus_distance = 1.0
    far = render()["Combined"]
    check(soft(sharp) < soft(near) < soft(far), f"{soft(sharp)}, {soft(near)}, {soft(far)} soft pixels")
    check(soft(far) > 4 * soft(sharp), "hardly blurred")
    # light is kept: the circles of the sphere's pixels add up to it, but for what hides behind the nearer ones
    check(0.9 < far[..., 3].sum() / sharp[..., 3].sum() < 1.15, f"{far[..., 3].sum() / sharp[..., 3].sum():.3f} of the light")
    target = bpy.data.objects.new("target", None)
    scene.collection.objects.link(target)
    target.location = (5.0, 3.0, -3.4)  # the distance counts along the view
    lens.focus_object = target
    bpy.context.view_layer.update()
    check((render()["Combined"] == near).all(), "an object at 3.4 is not the distance 3.4")
    lens.use_dof = False
    check((render()["Combined"] == sharp).all(), "not sharp again")


def test_larger_pixels():
    """While a viewport moves its pixels are larger: strokes stay as wide on screen, down to what can be drawn."""
    scene = dense_scene()
    effects = scene.patina.effects
    effects.use_hatch, effects.hatch_spacing, effects.edl_radius = True, 20.0, 3.0
    bpy.context.view_layer.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    view = sync.final_view(scene.camera, depsgraph)
    read = sync.describe(depsgraph, view, lambda what, progress: False).effects
    check((read.shrunk(2).hatch_spacing, read.shrunk(2).edl_radius) == (10.0, 1.5), f"{read.shrunk(2)}")
    check((read.shrunk(8).hatch_spacing, read.shrunk(8).edl_radius) == (3.0, 1.0), f"{read.shrunk(8)}")
    check(read.shrunk(1) == read, "at rest they change")


def test_tiles_and_layers():
    """Effects in tiles are those of the whole, behind transparent points too."""
    scene = dense_scene(97, 71)
    bpy.data.objects["points"].patina.opacity = 0.5
    effects = scene.patina.effects
    for effect in SHOWN:
        setattr(effects, f"use_{effect['name']}", True)
    scene.camera.data.dof.use_dof, scene.camera.data.dof.aperture_fstop = True, 0.2
    scene.camera.data.dof.focus_distance = 3.0
    whole = render()["Combined"]
    scene.patina.tile_size = 32
    tiled = render()["Combined"]
    check((whole == tiled).all(), f"{np.count_nonzero(whole != tiled)} values differ")
