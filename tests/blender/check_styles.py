# SPDX-License-Identifier: GPL-3.0-or-later
"""Styles: shipped ones, applying, saving, sharing, and what is wrong with a file."""

import functools
import json
import os

import bpy
import numpy as np
from harness import SCRATCH, add_light, add_points, check, check_close, new_scene, render, reports, set_world, sphere
from mathutils import Matrix
from patina.draw import sample, thumbnails
from patina.styles import styles

OWN = SCRATCH / "scripts"  # not the user's
OWN.mkdir(exist_ok=True)
os.environ["BLENDER_USER_SCRIPTS"] = str(OWN)
POINTS = 40_000
SIDE = 96
sample.points, sample.classes = functools.cache(sample.points), functools.cache(sample.classes)  # by rule, the same every time, and a second each


def stage(side=SIDE):
    """The urn of the thumbnails, as they see it, by the scene's settings as Blender starts."""
    scene = new_scene(side, side)
    scene.render.film_transparent = False
    for name in ("fill", "smooth", "antialias"):
        scene.patina.property_unset(name)
    camera = thumbnails._camera()
    scene.camera.matrix_world = Matrix(np.reshape(camera.world_from_camera, (4, 4)).tolist())
    scene.camera.data.angle = 2 * np.arctan(camera.right)
    points, normals, colors = sample.points(POINTS)
    obj = add_points(points, colors, normals)
    obj.data.attributes.new("classification", 'INT', 'POINT').data.foreach_set("value", sample.classes(POINTS).astype(np.int32))
    obj.data.attributes.new("height_above_ground", 'FLOAT', 'POINT').data.foreach_set("value", np.ascontiguousarray(points[:, 2]))
    bpy.context.view_layer.objects.active = obj
    set_world((0.2, 0.2, 0.2))
    return scene, obj


def shipped():
    return [path.stem for path in sorted(styles.SHIPPED.glob("*.json"))]


def apply(key):
    """The warnings that it gave."""
    check(bpy.ops.patina.apply_style(style=key) == {'FINISHED'}, key)
    return bpy.context.scene.patina.style.notice


def own(name, text):
    """A file among the artist's styles."""
    path = styles.own_folder(create=True) / name
    path.write_text(text if isinstance(text, str) else json.dumps(text), encoding="utf-8")
    return path


def refusal(call):
    try:
        call()
    except RuntimeError as error:
        return str(error)
    raise AssertionError("it was not refused")


def look(scene, obj):
    """All properties of the look, by section."""
    style = styles.taken("", scene, obj)
    return style.scene, style.points, style.transform


def test_folder_is_a_throwaway_one():
    check(str(styles.own_folder()).startswith(str(SCRATCH)), styles.own_folder())


def test_shipped_styles_differ():
    scene, _ = stage()
    pictures = {}
    for key in shipped():
        check(apply(key) == "", f"{key}: {scene.patina.style.notice}")
        check(scene.patina.style.chosen == key, f"{key} is chosen")
        pictures[key] = render()["Combined"][..., :3]
        check(not reports, f"{key}: {reports}")
        check(np.isfinite(pictures[key]).all(), key)
    for one in pictures:
        for other in pictures:
            if one < other:
                apart = np.abs(pictures[one] - pictures[other]).mean()
                check(apart > 0.015, f"{one} and {other} differ by {apart:.4f}")


def test_shipped_files_say_just_what_differs():
    """Reading a file and writing it gives the same keys: none unknown, none at its default, colours by their value."""
    for key in shipped():
        style = styles.read(styles.SHIPPED / f"{key}.json")
        check(not style.unknown, f"{key}: {style.unknown}")
        scene, obj = stage()
        apply(key)
        check(look(scene, obj) == (style.scene, style.points, style.transform), f"{key}: {look(scene, obj)}")


def test_thumbnails_are_of_today():
    for key in shipped():
        scene, obj = stage()
        apply(key)
        drawn = thumbnails.of_sample(bpy.context.evaluated_depsgraph_get(), obj)[..., :3]
        image = bpy.data.images.load(str(styles.SHIPPED / f"{key}.png"))
        kept = np.empty(thumbnails.SIZE ** 2 * 4, np.float32)
        image.pixels.foreach_get(kept)
        bpy.data.images.remove(image)
        kept = kept.reshape(thumbnails.SIZE, thumbnails.SIZE, 4)[::-1, :, :3] * 255
        apart = np.abs(kept - drawn)
        check((apart > 8).mean() < 0.01, f"{key}: {(apart > 8).mean():.2%} of the thumbnail is another picture: build/styles "
                                         "--thumbnails makes it anew")


def test_the_plain_style_is_the_defaults():
    scene, obj = stage()
    before = render()["Combined"]
    for key in shipped():
        apply(key)
    apply(styles.PLAIN)
    check_close(render()["Combined"], before, 0, "back to the scan")
    check(look(scene, obj)[:2] == ({}, {}), f"{look(scene, obj)}")


def test_lights_camera_and_world_stay():
    scene, _ = stage()
    add_light('SUN', 2.0)
    render()

    def others():
        return ([item.name for item in (*bpy.data.objects, *bpy.data.worlds, *bpy.data.collections)], scene.world.name,
                tuple(scene.world.color), bpy.data.lights[0].energy, list(map(tuple, scene.camera.matrix_world)),
                scene.render.film_transparent)

    before = others()
    for key in shipped():
        apply(key)
        check(others() == before, f"{key} changed more than properties of Patina")


def test_save_and_load():
    scene, obj = stage()
    scene.patina.smooth = 'BOX'
    scene.patina.studio.use_light, scene.patina.studio.azimuth, scene.patina.studio.ambient = True, 0.7, (0.1, 0.2, 0.3)
    obj.patina.lighting, obj.patina.specular, obj.patina.color = 'LIT', 0.3, (0.5, 0.25, 0.125)
    kept, picture = look(scene, obj), render()["Combined"]
    check(bpy.ops.patina.save_style(name="Round Trip", thumbnail='SAMPLE') == {'FINISHED'}, "saved")
    path = styles.own_folder() / "round_trip.json"
    check(path.is_file() and path.with_suffix(".png").stat().st_size > 1000, "file and thumbnail")
    check(scene.patina.style.chosen == "round_trip", scene.patina.style.chosen)
    shared = SCRATCH / "shared.json"
    shared.write_bytes(path.read_bytes())
    check(bpy.ops.patina.delete_style() == {'FINISHED'} and not path.exists() and not path.with_suffix(".png").exists(),
          "deleted")
    check(look(scene, obj) == kept, "deleting changed the look")

    scene, obj = stage()
    check(bpy.ops.patina.load_style(filepath=str(shared)) == {'FINISHED'}, "loaded")
    check(look(scene, obj) == kept, f"{look(scene, obj)} is not {kept}")
    check_close(render()["Combined"], picture, 0, "the picture of the loaded style")
    check((styles.own_folder() / "shared.png").is_file(), "a thumbnail of a file that came without")
    bpy.ops.patina.delete_style()


def test_thumbnail_of_the_scene():
    _, obj = stage()
    obj.patina.lighting = 'UNLIT'
    bpy.ops.patina.save_style(name="scene", thumbnail='SCENE')
    image = bpy.data.images.load(str(styles.own_folder() / "scene.png"))
    check(tuple(image.size) == (thumbnails.SIZE, thumbnails.SIZE), tuple(image.size))
    small = np.empty(thumbnails.SIZE ** 2 * 4, np.float32)
    image.pixels.foreach_get(small)
    bpy.data.images.remove(image)
    clay = small.reshape(thumbnails.SIZE, thumbnails.SIZE, 4)[thumbnails.SIZE // 2, thumbnails.SIZE // 2]
    check(clay[0] > clay[2] + 0.1, f"the urn is in the middle: {clay}")
    bpy.ops.patina.delete_style()


def test_own_styles_replace_shipped_ones():
    scene, _ = stage()
    about = {entry.key: entry.about for entry in styles.entries()}["plaster"]
    own("plaster.json", {"patina_style": 1, "about": "mine"})
    check({entry.key: entry.about for entry in styles.entries()}["plaster"] == "mine", "the artist's comes first")
    apply("plaster")
    bpy.ops.patina.delete_style()
    check({entry.key: entry.about for entry in styles.entries()}["plaster"] == about, "the shipped one is back")
    check("context is incorrect" in refusal(bpy.ops.patina.delete_style), "a shipped one is not deleted")


def test_unknown_keys():
    scene, obj = stage()
    own("later.json", {"patina_style": 1, "sound": 3, "scene": {"smooth": "BOX", "lines.glitter": 2, "device": "GL"},
                       "points": {"smell": 1, "opacity": 0.5}, "view": {"angle": 3}})
    said = apply("later")
    check(said == "unknown keys ignored: sound, scene.lines.glitter, scene.device, points.smell, view.angle", said)
    check(scene.patina.smooth == 'BOX' and obj.patina.opacity == 0.5, "the others were applied")


def test_bad_files():
    scene, obj = stage()
    before = look(scene, obj)
    head = '{"patina_style": 1, '
    for text, wanted in (
            ("", "bad.json, line 1: no valid JSON"),
            ('{\n"patina_style": 1,\n"scene": }', "bad.json, line 3: no valid JSON"),
            ("[" * 100_000, "bad.json: no valid JSON"),
            ("[1]", "is no style: it has no key 'patina_style'"),
            ('{"name": "x"}', "is no style: it has no key 'patina_style'"),
            ('{"patina_style": 2}', "version 2, this Patina reads 1"),
            (head + '"scene": 3}', "'scene' holds no keys"),
            (head + '"scene": {"smooth": "SOFT"}}', 'scene.smooth is "SOFT"; one of ALLEVIATED, GAUSSIAN, BOX, OFF was'),
            (head + '"scene": {"smooth": ["BOX"]}}', "scene.smooth is [\"BOX\"]; one of"),
            (head + '"points": {"opacity": 1.5}}', "points.opacity is 1.5; a number from 0 to 1 was expected"),
            (head + '"points": {"opacity": NaN}}', "points.opacity is NaN; a number from 0 to 1"),
            (head + '"points": {"opacity": true}}', "points.opacity is true; a number"),
            (head + '"points": {"shininess": 2.5}}', "points.shininess is 2.5; a whole number from 1 on"),
            (head + '"points": {"color": [1, 2]}}', 'points.color is [1, 2]; 3 numbers or "#rrggbb" was expected'),
            (head + '"points": {"color": "#12345"}}', 'points.color is "#12345"; 3 numbers or "#rrggbb"'),
            (head + '"scene": {"studio.azimuth": 200}}', "studio.azimuth is 200; a number from -180 to 180"),
            (head + '"scene": {"studio.use_light": 1}}', "studio.use_light is 1; true or false"),
            (head + '"points": {"lighting": "LIT"}, "view": {"transform": 3}}', "view.transform is 3; a name"),
            ("\udcff", "bad.json is no text in UTF-8")):
        path = styles.own_folder(create=True) / "bad.json"
        path.write_bytes(text.encode("utf-8", "surrogateescape"))
        for call in (lambda: bpy.ops.patina.apply_style(style="bad"),
                     lambda: bpy.ops.patina.load_style(filepath=str(path))):
            said = refusal(call)
            check(wanted in said and said.strip().count("\n") == 0, f"{text[:60]}: {said}")
        check(any(entry.key == "bad" for entry in styles.entries()), "listed all the same")
        scene.patina.style.chosen = "bad"
        check(wanted in scene.patina.style.notice, f"the panel says: {scene.patina.style.notice}")
        check(look(scene, obj) == before, f"{text[:60]} changed something")
    os.unlink(path)
    check("there is no style 'bad'" in refusal(lambda: bpy.ops.patina.apply_style(style="bad")), "no such style")
    check("No such file" in refusal(lambda: bpy.ops.patina.load_style(filepath=str(path))), "no such file")
    check(scene.patina.style.chosen == styles.PLAIN, "a style that is gone shows as none")


def test_styles_by_their_shown_names():
    """As menus show them; who names none of them is told which there are."""
    stage()
    for name, key in (("Ink Line", "ink"), ("museum", "museum"), ("x-ray", "xray"), ("Watercolor", "watercolour")):
        check(bpy.ops.patina.apply_style(style=name) == {'FINISHED'} and bpy.context.scene.patina.style.applied == key, name)
    said = refusal(lambda: bpy.ops.patina.apply_style(style="rust"))
    check("there is no style 'rust', only " in said and "museum" in said and "xray" in said, said)


def test_unwritable():
    stage()
    wanted = styles.own_folder(create=True) / "in_the_way.json"
    wanted.mkdir()
    check("in_the_way.json" in refusal(lambda: bpy.ops.patina.save_style(name="in the way")), "a folder is in the way")
    wanted.rmdir()
    check("needs a name" in refusal(lambda: bpy.ops.patina.save_style(name="  ")), "no name")


def test_animated_properties_stay():
    scene, obj = stage()
    obj.patina.opacity = 0.9
    obj.patina.keyframe_insert("opacity", frame=1)
    scene.patina.studio.driver_add("strength")
    for key in shipped():
        said = apply(key)
        check("opacity" in said and "studio.strength" in said and "left to their animation" in said, said)
        check_close(obj.patina.opacity, 0.9, 1e-6, key)


def test_selected_points_only():
    scene, obj = stage()
    other = add_points(*sphere(100), name="other")
    other.select_set(False)
    obj.select_set(True)
    scene.patina.style.objects = 'SELECTED'
    apply("plaster")
    check(obj.patina.lighting == 'LIT' and other.patina.lighting == 'AUTO', "selected")
    scene.patina.style.objects = 'ALL'
    apply("plaster")
    check(other.patina.lighting == 'LIT', "all")


def test_styles_say_what_is_missing():
    """On the tile and in the tooltip, if no cloud of the scene has the data; not once one has them."""
    from patina.properties import style as chooser
    scene, obj = stage()

    def shown():
        return {key: (label, about) for key, label, about, *_ in chooser._list(scene.patina.style, bpy.context)}

    plain = shown()
    check(not any("(No" in label for label, _ in plain.values()), f"{plain}")
    obj.data.attributes.remove(obj.data.attributes["classification"])
    found = shown()
    check(found["vegetation"][0] == "Vegetation (No Classes)", f"{found['vegetation']}")
    check(found["vegetation"][1] == f"{plain['vegetation'][1]}. No points of this scene have classes", f"{found['vegetation']}")
    check([key for key in found if found[key] != plain[key]] == ["vegetation"], f"{found}")
    scene.patina.style.chosen = "vegetation"
    check(scene.patina.style.chosen == "vegetation", "it can still be chosen")
    other = add_points([(0, 0, 0)], name="other")
    other.data.attributes.new("plants", 'INT', 'POINT')
    other.patina.colors.class_attribute = "plants"
    check(shown() == plain, "another cloud has classes")
    obj.data.attributes.remove(obj.data.attributes["height_above_ground"])
    found = shown()
    check({key: found[key][0] for key in found if found[key] != plain[key]} == {"above_ground": "Above Ground (No Ground)"}, f"{found}")
    other.data.attributes.new("height_above_ground", 'FLOAT', 'POINT')
    check(shown() == plain, "another cloud has heights")
    obj.patina.analysis = other.patina.analysis = 'OFF'
    found = shown()
    check({key: found[key][0] for key in found if found[key] != plain[key]} ==
          {"trust": "Trust (No Analysis)", "uncertainty": "Uncertainty (No Analysis)"}, f"{found}")


def test_imported_points_wear_the_style():
    scene, _ = stage()
    apply("museum")
    path = SCRATCH / "points.xyz"
    path.write_text("0 0 0\n1 0 0\n0 1 0\n")
    bpy.ops.import_scene.patina_points(filepath=str(path))
    check(bpy.context.view_layer.objects.active.patina.lighting == 'LIT', "points that come later")
    scene.patina.style.applied = "gone"
    bpy.ops.import_scene.patina_points(filepath=str(path))
    check(bpy.context.view_layer.objects.active.patina.lighting == 'AUTO', "a style that is gone")


def test_studio_light():
    """A sphere: bright where the light stands, by its strength; it turns with the camera unless told."""
    scene = new_scene(64, 64)
    obj = add_points(*sphere(60000, center=(0, 0, 0)))
    obj.patina.lighting, obj.patina.color = 'LIT', (1, 1, 1)
    obj.data.attributes.remove(obj.data.attributes["Col"])
    studio = scene.patina.studio
    studio.use_light, studio.fill, studio.ambient, studio.height = True, 0.0, (0, 0, 0), 0.0
    studio.strength, scene.patina.use_shadows = np.pi, False
    for turn, follow, azimuth, wanted in ((0.0, True, 90, 1), (0.0, True, -90, -1), (180.0, True, 90, 1),
                                          (180.0, False, 90, -1)):
        studio.follow_camera, studio.azimuth = follow, np.radians(azimuth)
        scene.camera.matrix_world = Matrix.Rotation(np.radians(turn), 4, 'Z') @ Matrix.Translation((0, -4, 0)) @ \
            Matrix.Rotation(np.radians(90), 4, 'X')
        row = render()["Combined"][32, :, 0]
        side = np.sign(row[32:].sum() - row[:32].sum())
        check(side == wanted, f"{turn} {follow} {azimuth}: brighter on {side}")
        check(0.85 < row.max() <= 1.0, f"strength pi shows the colour itself: {row.max()}")


def test_background():
    scene, _ = stage()
    set_world((0.1, 0.2, 0.3))
    studio = scene.patina.studio
    check_close(render()["Combined"][-1, 0], (0.1, 0.2, 0.3, 1), 1e-6, "the world")
    studio.use_light, studio.ambient = True, (1, 1, 1)
    check_close(render()["Combined"][-1, 0], (0.1, 0.2, 0.3, 1), 1e-6, "ambient light is not the background")
    studio.use_background, studio.background = True, (0.5, 0.25, 0.125)
    check_close(render()["Combined"][-1, 0], (0.5, 0.25, 0.125, 1), 1e-6, "its own")
    scene.render.film_transparent = True
    check_close(render()["Combined"][-1, 0], (0, 0, 0, 0), 0, "transparent film")
