# SPDX-License-Identifier: GPL-3.0-or-later
"""After the first import into Blender's start scene: engine, camera and light are offered, and do what they say."""

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
    obj, = import_ply(write_ply("colored_survey.ply", rows + [(name, "u1", np.full(len(points), 180)) for name in ("red", "green", "blue")]))
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

    def imported(column, engine, values, more=""):
        scene = start_scene()
        scene.render.engine = engine
        rows = "\n".join(f"{x:.4f},{y:.4f},{z:.4f},{value:g}{more}" for (x, y, z), value in zip(points, values, strict=True))
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
    _, obj = imported("Grey,red,green,blue", 'PATINA', wide, ",200,100,50")
    check(obj.patina.colors.source == 'OWN', "the file has colors")


def test_first_look_of_intensity_says_the_range():
    from patina.operators import first_look
    start_scene()
    obj, = import_ply(write_ply("first_range.ply", columns_of(1.0, intensity=lambda points: 30000 + 20000 * points[:, 2])))
    said, = (text for text in first_look.choose(bpy.context.scene, [obj]) if "intensity" in text)
    group = obj.patina.colors
    check(said == f"'first_range' is colored by 'intensity', stretched from {group.range_min:,.6g} to {group.range_max:,.6g}", said)


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
