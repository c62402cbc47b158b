# SPDX-License-Identifier: GPL-3.0-or-later
"""After the first import into Blender's start scene: engine, camera and light are offered, and do what they say."""

import ctypes
import os
import sys
from contextlib import contextmanager

import bpy
import check_linked  # noqa: F401  no test leaves files with the user
import numpy as np
from check_import import columns, import_ply, write_ply
from check_places import las_file
from harness import SCRATCH, check, new_scene, render, sphere
from patina.operators import set_up, stations


def start_scene():
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=False, app_template="")
    return bpy.context.scene


def gray(name, scale):
    points, _, _ = sphere(20000, scale, (0, 0, 0))
    return write_ply(name, [(axis, "f4", points[:, i]) for i, axis in enumerate("xyz")])


def test_set_up_after_the_first_import():
    """A survey without colours, 200 m wide: one click to a picture, where F12 was blank."""
    scene = start_scene()
    check(set_up.untouched(scene), "the start scene is untouched")
    obj, = import_ply(gray("survey_gray.ply", 100.0))
    check(set_up.untouched(scene), "points are no touch")
    check(set_up.unlit(scene, [obj]), "a lamp of a kilowatt does not reach")
    check(bpy.ops.scene.patina_set_up() == {'FINISHED'}, "set up")
    check(scene.render.engine == 'PATINA' and "Cube" not in bpy.data.objects, "engine and cube")
    check(scene.patina.style.chosen == "plaster" and scene.patina.studio.use_light, "points without colors are lit as plaster")
    scene.render.resolution_x, scene.render.resolution_y, scene.patina.device = 160, 90, 'CPU'
    picture = render()["Combined"][..., :3].max(axis=2)
    check((picture > 0.2).mean() > 0.1, f"{(picture > 0.2).mean():.0%} of the picture is bright")
    # the key light comes from the upper left
    rows, columns = np.nonzero(picture > 0.5)
    height, width = picture.shape
    check(columns.mean() < 0.5 * width and rows.mean() > 0.5 * height, f"bright about {columns.mean():.0f}, {rows.mean():.0f} of {width} x {height}")


def test_set_up_lights_linked_scans():
    """The same survey, linked: its box says nothing of colours, the file does."""
    scene = start_scene()
    obj, = import_ply(gray("linked_gray.ply", 100.0), link=True)
    check(set_up.unlit(scene, [obj]), "a lamp of a kilowatt does not reach")
    check(bpy.ops.scene.patina_set_up() == {'FINISHED'} and scene.patina.style.chosen == "plaster", "no plaster")
    scene.render.resolution_x, scene.render.resolution_y, scene.patina.device = 160, 90, 'CPU'
    picture = render()["Combined"][..., :3].max(axis=2)
    check((picture > 0.2).mean() > 0.1, f"{(picture > 0.2).mean():.0%} of the picture is bright")


def test_set_up_leaves_what_is_lit():
    scene = start_scene()
    obj, = import_ply(gray("small_gray.ply", 1.0))
    check(not set_up.unlit(scene, [obj]), "the start scene's lamp lights a small thing")
    bpy.ops.scene.patina_set_up()
    check(not scene.patina.studio.use_headlight, "a headlight that nobody needs")


def test_strays_keep_no_light_away():
    """A ball beside the start scene's lamp, and one point at a hundred radii: the lamp reaches what is there, linked or not."""
    for count, link in ((300, False), (2000, True)):
        scene = start_scene()
        points, _, _ = sphere(count, 1.0, (0, 0, 0))
        points = np.concatenate([points, [(70.0, 50.0, 50.0)]])
        rows = [(axis, "f4", points[:, i]) for i, axis in enumerate("xyz")]
        obj, = import_ply(write_ply(f"stray_{count}.ply", rows), link=link)
        check(not set_up.unlit(scene, [obj]), f"{count} points: the lamp reaches them")
        bpy.ops.scene.patina_set_up()
        check(not scene.patina.studio.use_headlight, f"{count} points: a headlight that nobody needs")
        scene.patina.studio.use_light = False  # of the style Plaster, which Set Up chose
        obj.matrix_world.translation = (400, 0, 0)
        bpy.context.view_layer.update()
        check(set_up.unlit(scene, [obj]), "far from the lamp")


def test_ramps_of_coloured_surveys_are_lit():
    """Colours of their own are shown without light; colours by height are not, and were nearly black."""
    scene = start_scene()
    points, _, _ = sphere(20000, 100.0, (0, 0, 0))
    rows = [(axis, "f4", points[:, i]) for i, axis in enumerate("xyz")]
    shade = np.where(np.arange(len(points)) % 1000, 180, 181)  # one alone would be no color
    obj, = import_ply(write_ply("colored_survey.ply", rows + [(name, "u1", shade) for name in ("red", "green", "blue")]))
    check(set_up.unlit(scene, [obj]), "a lamp of a kilowatt does not reach")
    check(bpy.ops.scene.patina_set_up() == {'FINISHED'} and scene.patina.studio.use_headlight, "no headlight")
    scene.render.resolution_x, scene.render.resolution_y, scene.patina.device = 160, 90, 'CPU'
    own = render()["Combined"][..., :3]
    shown = own.max(axis=2) > 0.2
    # 180 of sRGB, whatever the light; the rest is the world and outlines
    check(shown.mean() > 0.1 and abs(np.median(own[shown]) - 0.456) < 0.01, f"{shown.mean():.0%} show {np.median(own[shown]):.3f}")
    obj.patina.colors.source = 'HEIGHT'
    ramp = render()["Combined"][..., :3].max(axis=2)
    check((ramp[shown] > 0.1).mean() > 0.8, f"{(ramp[shown] > 0.1).mean():.0%} of the points are bright")


@contextmanager
def printed():
    """Within: Blender's standard output, which reports of operators go to, as a list with one text."""
    texts, path, before = [], SCRATCH / "printed.txt", os.dup(1)
    file = os.open(path, os.O_CREAT | os.O_WRONLY | os.O_TRUNC)
    sys.stdout.flush()
    os.dup2(file, 1)
    try:
        yield texts
    finally:
        sys.stdout.flush()
        ctypes.CDLL(None).fflush(None)
        os.dup2(before, 1)
        os.close(before)
        os.close(file)
        texts.append(path.read_text())


def small_picture(scene):
    """Linear gray of the points, and whether a pixel shows one: Set Up framed them."""
    scene.render.resolution_x, scene.render.resolution_y, scene.patina.device = 160, 90, 'CPU'
    scene.render.film_transparent, scene.patina.samples = True, 1
    scene.patina.studio.use_background = False
    picture = render()["Combined"]
    shown = picture[..., 3] > 0.99
    check(shown.mean() > 0.1, f"{shown.mean():.0%} of the image shows points")
    return picture[..., :3], shown


def test_set_up_reports_the_clip_distances_once():
    """What the camera has afterward, in one line."""
    scene = start_scene()
    import_ply(gray("reported_clips.ply", 100.0))
    with printed() as texts:
        bpy.ops.scene.patina_set_up()
    lines = [line for line in texts[0].splitlines() if "Clip" in line]
    camera = scene.camera.data
    check(len(lines) == 1 and f"Clip Start to {camera.clip_start:.6g} and Clip End to {camera.clip_end:.6g}" in lines[0], f"{camera.clip_end}: {lines}")
    with printed() as texts:
        bpy.ops.scene.patina_set_up()
    check("Clip" not in texts[0], f"nothing changed: {texts[0]}")


def test_set_up_says_whom_the_headlight_lights():
    """Points with colors of their own need none, and nobody says that they have none."""
    points, colors, _ = sphere(5000, 100.0, (0, 0, 0))
    rows = [(axis, "f4", points[:, i]) for i, axis in enumerate("xyz")]
    colored = write_ply("headlight.ply", rows + [(name, "u1", colors[:, i]) for i, name in enumerate(("red", "green", "blue"))])
    for link in (False, True):
        scene = start_scene()
        obj, = import_ply(colored, link=link)
        said = set_up.apply(bpy.context, [obj])
        lines = [text for text in said if "headlight" in text]
        check(scene.patina.studio.use_headlight and lines == ["Enabled the headlight for color ramps and lit styles. The points' own colors are "
                                                              "shown without light"], f"linked {link}: {said}")
    scene = start_scene()
    obj, = import_ply(colored)
    obj.patina.lighting = 'LIT'
    said = set_up.apply(bpy.context, [obj])
    check("No light reaches the points. Enabled the headlight" in said, f"lit: {said}")


def columns_of(scale, **scalars):
    points, _, _ = sphere(5000, scale, (0, 0, 0))
    return [(axis, "f4", points[:, i]) for i, axis in enumerate("xyz")] + [(name, "f4", values(points)) for name, values in scalars.items()]


def test_first_look_of_intensity():
    """Points with intensity alone: gray, stretched between the 1st and 99th percentile, so that strays do not flatten it."""
    scene = start_scene()
    obj, = import_ply(write_ply("first_intensity.ply", columns_of(1.0, intensity=lambda points: np.where(np.arange(len(points)) % 500, 1000 + 100 * points[:, 2], 60000))))
    check(bpy.ops.scene.patina_set_up() == {'FINISHED'}, "set up")
    colors = obj.patina.colors
    check((colors.source, colors.scalar, colors.ramp, obj.patina.lighting) == ('SCALAR', "intensity", 'GREY', 'UNLIT'), f"{colors.source} {colors.ramp}")
    check(900 <= colors.range_min < 905 and 1095 < colors.range_max <= 1100 and colors.use_range, f"{colors.range_min} to {colors.range_max}")
    check(scene.view_settings.view_transform == 'Standard', scene.view_settings.view_transform)
    scene.render.resolution_x, scene.render.resolution_y, scene.patina.device = 160, 90, 'CPU'
    picture = render()["Combined"]
    shown = picture[..., 3] > 0.99
    check(np.ptp(picture[..., 0][shown]) > 0.8, f"gray from {picture[..., 0][shown].min():.2f} to {picture[..., 0][shown].max():.2f}")


def test_brightness_of_text_files():
    """A column Grey, Gray, Intensity or Reflectance colors the points, stretched, whatever its case and its range: after Set Up, and where
    Patina is the engine already. Other columns do not, nor does brightness where the file has colors."""
    points, _, _ = sphere(4000, 1.0, (0, 0, 0))

    def imported(column, engine, values, more=("",)):
        scene = start_scene()
        scene.render.engine = engine
        rows = "\n".join(f"{x:.4f},{y:.4f},{z:.4f},{value:g}{more[number % len(more)]}" for number, ((x, y, z), value) in enumerate(zip(points, values, strict=True)))
        path = SCRATCH / f"brightness {column.split(',')[0]}.csv"
        path.write_text(f"x,y,z,{column}\n{rows}\n")
        bpy.ops.import_scene.patina_points(filepath=str(path))
        obj = bpy.context.view_layer.objects.active
        if engine != 'PATINA':
            check(bpy.ops.scene.patina_set_up() == {'FINISHED'}, "set up")
        return scene, obj

    wide, bytes_ = np.rint(2000 + 1500 * points[:, 2]), np.rint(100 + 50 * points[:, 2])
    given = [("Grey", wide), ("GRAY", wide), ("Intensity", wide), ("reflectance", wide), ("Gray", bytes_)]
    for engine, those in (('BLENDER_WORKBENCH', given[:1]), ('PATINA', given)):
        for column, values in those:
            scene, obj = imported(column, engine, values)
            colors = obj.patina.colors
            said = f"{column} with {engine}: {colors.source}, {colors.scalar}, {colors.range_min} to {colors.range_max}"
            check((colors.source, colors.scalar.lower(), colors.ramp) == ('SCALAR', column.lower(), 'GREY'), said)
            low, high = np.quantile(values, (0.01, 0.99))
            check(abs(colors.range_min - low) < 20 and abs(colors.range_max - high) < 20 and colors.use_range, said)
            if engine == 'PATINA':
                bpy.ops.object.patina_frame_points()
            scene.view_settings.view_transform = 'Standard'
            scene.render.resolution_x, scene.render.resolution_y, scene.patina.device = 160, 90, 'CPU'
            scene.patina.samples = 1
            picture = render()["Combined"]
            gray = picture[..., :3][picture[..., 3] > 0.99]
            check(np.ptp(gray[:, 0]) > 0.8 and np.ptp(gray, axis=1).max() < 0.2, f"{said}: {gray.min(axis=0)} to {gray.max(axis=0)}")
    _, obj = imported("amount", 'PATINA', wide)
    check(obj.patina.colors.source == 'OWN', "another column")
    _, obj = imported("Grey,red,green,blue", 'PATINA', wide, (",200,100,50", ",100,50,200"))
    check(obj.patina.colors.source == 'OWN', "the file has colors")


def test_first_look_of_intensity_says_the_range():
    from patina.operators import first_look
    start_scene()
    obj, = import_ply(write_ply("first_range.ply", columns_of(1.0, intensity=lambda points: 30000 + 20000 * points[:, 2])))
    said, = (text for text in first_look.choose(bpy.context.scene, first_look.found_in(bpy.context.scene, [obj])) if "intensity" in text)
    group = obj.patina.colors
    check(said == f"'first_range' is colored by 'intensity', stretched from {group.range_min:,.6g} to {group.range_max:,.6g}", said)


def test_first_look_of_cut_off_intensity():
    """Most intensities are the greatest that the scanner knows, as of the Stanford bunny: no stretch tells them apart, light does. Intensities
    that are nearly all the least would be black: such points look as points without."""
    def image(name, intensity, engine='BLENDER_EEVEE'):
        scene = start_scene()
        if engine == 'PATINA':
            scene.render.engine = engine
        obj, = import_ply(write_ply(name, columns_of(1.0, intensity=intensity)))
        state = obj.patina.colors.source, obj.patina.lighting
        bpy.ops.scene.patina_set_up()
        return scene, obj, state

    def upper(points):
        return np.where(np.arange(len(points)) % 8, 0.5, 0.27 + 0.2 * np.abs(points[:, 2]))

    scene, obj, _ = image("cut_off.ply", upper)
    colors = obj.patina.colors
    check((colors.source, colors.scalar, colors.ramp) == ('SCALAR', "intensity", 'GREY'), f"{colors.source} {colors.ramp}")
    picture, shown = small_picture(scene)
    low, middle, high = np.quantile(picture.mean(axis=2)[shown], (0.2, 0.5, 0.8))
    check(high - low > 0.2 and middle < 0.9, f"gray of {low:.2f}, {middle:.2f}, {high:.2f}")
    check(obj.patina.lighting == 'LIT' and scene.patina.style.chosen == "plaster", f"{obj.patina.lighting} {scene.patina.style.chosen}")
    _, _, state = image("cut_off_again.ply", upper, 'PATINA')
    check(state == ('SCALAR', 'LIT'), f"imported where Patina is the engine: {state}")
    for name, values in (("lower.ply", lambda points: np.where(np.arange(len(points)) % 4, 0.0, 300 * np.abs(points[:, 2]))),
                         ("same.ply", lambda points: np.full(len(points), 7.0))):
        scene, obj, _ = image(name, values)
        check((obj.patina.colors.source, scene.patina.style.chosen) == ('FIXED', "plaster"), f"{name}: {obj.patina.colors.source}")
        picture, shown = small_picture(scene)
        check(np.median(picture[shown]) > 0.2, f"{name}: gray of {np.median(picture[shown]):.2f}")


def one_color(name, color, count=8000, **scalars):
    """A ball whose points all have one color."""
    points, _, normals = sphere(count, 1.0, (0, 0, 0))
    rows = [(axis, "f4", points[:, i]) for i, axis in enumerate("xyz")] + [(f"n{axis}", "f4", normals[:, i]) for i, axis in enumerate("xyz")]
    rows += [(channel, "u1", np.full(count, value)) for channel, value in zip(("red", "green", "blue"), color, strict=True)]
    return write_ply(name, rows + [(scalar, "f4", values(points)) for scalar, values in scalars.items()])


def test_first_look_of_one_color():
    """Points that all have the same color look as points without colors: as plaster, or by their intensity. Beside a colored cloud they are
    lit in their color. Linked ones too."""
    for link in (False, True):
        for color in ((200, 200, 200), (0, 0, 0)):
            scene = start_scene()
            obj, = import_ply(one_color(f"one_color_{link}_{color[0]}.ply", color), link=link)
            bpy.ops.scene.patina_set_up()
            picture, shown = small_picture(scene)
            low, high = np.quantile(picture[..., 1][shown], (0.2, 0.8))
            check(high - low > 0.2, f"linked {link}, {color}: from {low:.2f} to {high:.2f}")
            check(scene.patina.style.chosen == "plaster", scene.patina.style.chosen)
        scene = start_scene()
        obj, = import_ply(one_color(f"one_color_{link}.ply", (90, 90, 90)), link=link)
        said = set_up.apply(bpy.context, [obj])
        check("The points have only one color: the style Plaster lights them" in said, f"{said}")
        scene = start_scene()
        one, = import_ply(one_color("one_of_two.ply", (220, 40, 40)), link=link)
        import_ply(write_ply("two_of_two.ply", columns((0, 0, 3))))
        bpy.ops.scene.patina_set_up()
        check((one.patina.colors.source, one.patina.lighting, scene.patina.style.chosen) == ('OWN', 'LIT', "scan"), f"linked {link}: {one.patina.lighting}")
    scene = start_scene()
    obj, = import_ply(one_color("one_color_intensity.ply", (255, 255, 255), intensity=lambda points: 100 + 50 * points[:, 2]))
    bpy.ops.scene.patina_set_up()
    check((obj.patina.colors.source, obj.patina.colors.scalar, obj.patina.lighting) == ('SCALAR', "intensity", 'UNLIT'), obj.patina.colors.source)
    picture, shown = small_picture(scene)
    check(np.ptp(picture[..., 0][shown]) > 0.8, "gray by intensity")


def test_imports_of_one_color_are_lit():
    """Where Patina is the engine already: no flat silhouette, linked or not. One point of another color is a color."""
    for link in (False, True):
        scene = start_scene()
        scene.render.engine, bpy.data.lights["Light"].use_shadow = 'PATINA', False  # soft shadows take seconds
        obj, = import_ply(one_color(f"imported_one_{link}.ply", (200, 200, 200)), link=link)
        check((obj.patina.colors.source, obj.patina.lighting) == ('OWN', 'LIT'), f"linked {link}: {obj.patina.colors.source} {obj.patina.lighting}")
        bpy.ops.object.patina_frame_points()
        picture, shown = small_picture(scene)
        low, high = np.quantile(picture[..., 1][shown], (0.1, 0.9))
        check(high - low > 0.05, f"linked {link}: from {low:.2f} to {high:.2f}")
        scene.objects["Light"].hide_render, world, scene.world = True, scene.world, None
        obj, = import_ply(one_color(f"imported_dark_{link}.ply", (200, 200, 200)), link=link)
        check(obj.patina.lighting == 'AUTO', f"no light, linked {link}: {obj.patina.lighting}")
        scene.world = world
        obj, = import_ply(one_color(f"imported_black_{link}.ply", (0, 0, 0)), link=link)
        check(obj.patina.colors.source == 'FIXED', f"black, linked {link}: {obj.patina.colors.source}")
        points, colors, _ = sphere(3000, 1.0, (0, 0, 0))
        colors[:], colors[1234, 1] = 200, 210
        rows = [(axis, "f4", points[:, i]) for i, axis in enumerate("xyz")] + [(name, "u1", colors[:, i]) for i, name in enumerate(("red", "green", "blue"))]
        obj, = import_ply(write_ply(f"imported_two_{link}.ply", rows), link=link)
        check(obj.patina.lighting == 'AUTO', f"two colors, linked {link}: {obj.patina.lighting}")


def test_first_look_of_classes():
    start_scene()
    obj, = import_ply(write_ply("first_classes.ply", columns_of(1.0, classification=lambda points: np.where(points[:, 2] > 0, 5, 2))))
    check(bpy.ops.scene.patina_set_up() == {'FINISHED'}, "set up")
    colors = obj.patina.colors
    check((colors.source, colors.scalar, colors.ramp) == ('SCALAR', "classification", 'CLASSES'), f"{colors.source} {colors.scalar} {colors.ramp}")


def test_first_look_leaves_what_was_chosen():
    """A color source that the artist chose stays, and colors stay as they were taken."""
    scene = start_scene()
    obj, = import_ply(write_ply("first_chosen.ply", columns_of(1.0, intensity=lambda points: points[:, 2])))
    obj.patina.colors.source = 'HEIGHT'
    check(bpy.ops.scene.patina_set_up() == {'FINISHED'} and obj.patina.colors.source == 'HEIGHT', obj.patina.colors.source)
    scene = start_scene()
    obj, = import_ply(write_ply("first_colored.ply", columns((0, 0, 0))))
    scene.view_settings.view_transform = 'Filmic' if bpy.app.version < (4, 0, 0) else 'AgX'
    check(bpy.ops.scene.patina_set_up() == {'FINISHED'}, "set up")
    check(scene.view_settings.view_transform == 'Standard', scene.view_settings.view_transform)
    check(obj.patina.colors.source == 'OWN' and scene.patina.style.chosen == "scan", f"{obj.patina.colors.source}, {scene.patina.style.chosen}")


def test_stations_are_no_touch():
    """What an import brings with the points leaves the scene untouched: Set Up is offered, and deletes the cube."""
    scene = start_scene()
    obj, = import_ply(gray("with_stations.ply", 10.0))
    empty = bpy.data.objects.new("station", None)
    empty[stations.PROPERTY], empty.parent = 0, obj
    camera = bpy.data.objects.new("panorama", bpy.data.cameras.new("panorama"))
    camera.parent = empty
    for added in (empty, camera):
        scene.collection.objects.link(added)
    check(set_up.untouched(scene), "stations and their cameras are no touch")
    check(bpy.ops.scene.patina_set_up() == {'FINISHED'} and "Cube" not in bpy.data.objects, "the cube is still there")
    scene = start_scene()
    import_ply(gray("with_empty.ply", 10.0))
    scene.collection.objects.link(bpy.data.objects.new("the artist's", None))
    check(not set_up.untouched(scene), "an empty of the artist's is a touch")


def test_set_up_is_not_offered_twice():
    """Only where nobody has begun anything else."""
    for touch in (lambda scene: bpy.ops.mesh.primitive_monkey_add(), lambda scene: setattr(scene.render, "engine", 'PATINA'),
                  lambda scene: setattr(bpy.data.objects["Cube"], "location", (1, 0, 0)),
                  lambda scene: bpy.data.objects["Cube"].modifiers.new("smooth", 'SUBSURF')):
        scene = start_scene()
        touch(scene)
        bpy.context.view_layer.update()
        check(not set_up.untouched(scene), "touched")
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=False, app_template="")
    try:
        bpy.ops.scene.patina_set_up()
    except RuntimeError as error:
        check("no points" in str(error), str(error))
    else:
        check(False, "set up without points")
    check("Cube" in bpy.data.objects and bpy.context.scene.render.engine != 'PATINA', "and the scene is as it was")


def test_import_frames_the_points():
    scene = new_scene()
    path = write_ply("framed.ply", columns((30, 40, 0)))
    place = scene.camera.location.copy()
    import_ply(path)
    check((scene.camera.location - place).length == 0, "the camera moved without a wish")
    import_ply(path, frame=True)
    bpy.context.view_layer.update()
    check((scene.camera.location - place).length > 10, "it did not move")
    picture = render()
    check(picture["Combined"][..., 3].any(), "and sees nothing")


def test_names_without_copc():
    from patina.read.importers import las
    from patina.read.importers.reading import Filter, Progress
    plain = las_file("plain.las", np.random.default_rng(1).uniform(0, 1, (50, 3)))
    path = SCRATCH / "harbor.copc.las"
    path.write_bytes(plain.read_bytes())
    check(las.read(path, Filter(), Progress()).name == "harbor", las.read(path, Filter(), Progress()).name)
    for link in (False, True):
        new_scene()
        obj, = import_ply(path, link=link)
        check(obj.name == "harbor", obj.name)


def test_leaves_an_empty_file():
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    check(not bpy.data.objects, "an empty file")
