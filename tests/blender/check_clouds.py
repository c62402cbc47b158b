# SPDX-License-Identifier: GPL-3.0-or-later
"""PointCloud objects and meshes of points: imports make the one or the other, conversion goes both ways without loss, everything works on
both, and odd ones cause one clear message or none."""

import bpy
import numpy as np
from harness import SCRATCH, Skip, add_points, check, check_close, drawn, new_scene, points_of, render, reports, saved, set_world, sphere
from patina import point_data
from patina.operators import convert_points
from patina.read.importers import PointFile
from patina.sync.points import attributes, made

CLOUDS = point_data.HAS_CLOUDS


def needs_clouds():
    if not CLOUDS:
        raise Skip("point clouds are made of points from Blender 4.5 on")


def given(count=3000, **more):
    positions, colors, normals = sphere(count)
    return PointFile("scan", positions.astype(np.float32), normals.astype(np.float32), colors, {"intensity": np.linspace(0, 1, count, dtype=np.float32), **more},
                     (0.0, 0.0, 0.0), 0, {"crs": "EPSG:1"})


def added(points, cloud):
    obj = bpy.data.objects.new("scan", made.to_data(points, cloud))
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.update()
    for other in bpy.context.view_layer.objects:
        other.select_set(other == obj)
    bpy.context.view_layer.objects.active = obj
    return obj


def same(before, after, what):
    check(before.keys() == after.keys() and after, f"{what}: {list(after)}")
    for name, pixels in before.items():
        check(np.array_equal(pixels, after[name]), f"{what}: {name} differs")


def written(count=200):
    path = SCRATCH / "few.xyz"
    positions, colors, _ = sphere(count)
    np.savetxt(path, np.concatenate([positions, colors[:, :3]], 1), fmt="%.5f %.5f %.5f %d %d %d")
    return path


def test_imports_make_what_is_asked_for():
    new_scene()
    path = written()
    for kind, wanted in (('AUTO', 'POINTCLOUD' if CLOUDS else 'MESH'), ('POINTCLOUD', 'POINTCLOUD' if CLOUDS else 'MESH'), ('MESH', 'MESH')):
        bpy.ops.import_scene.patina_points(filepath=str(path), kind=kind)
        obj = bpy.context.object
        check(obj.type == wanted and obj.select_get(), f"{kind}: {obj.type}")
        check(len(points_of(obj)) == 200 and "Col" in obj.data.attributes, f"{kind}: {obj.data.attributes.keys()}")
        check(not any(name in obj.data.attributes for name in point_data.SELECTION), f"{kind}: {obj.data.attributes.keys()}")
        check([item.name for item in bpy.data.objects if item.name.endswith("mesh")] == [], "a helper object stays")
        bpy.ops.object.patina_frame_points()
        drawn_one = render()["Combined"]
        check((drawn_one[..., 3] > 0).sum() > 50, f"{kind}: {(drawn_one[..., 3] > 0).sum()} pixels of points at {points_of(obj)[0]}, {reports}")
        bpy.data.objects.remove(obj)


def test_many_points_are_shown_as_a_box():
    """By Blender, which else draws a sphere for each in every redraw. The image is the same; what the artist chose stays."""
    needs_clouds()
    new_scene()
    most, point_data.MOST_SPHERES = point_data.MOST_SPHERES, 199
    try:
        for kind, shown in (('AUTO', 'BOUNDS'), ('MESH', 'TEXTURED')):
            bpy.ops.import_scene.patina_points(filepath=str(written()), kind=kind)
            obj = bpy.context.object
            check(obj.display_type == shown, f"{kind}: {obj.display_type}")
            if kind == 'AUTO':
                bpy.ops.object.patina_frame_points()
                boxed = render()
                obj.display_type = 'TEXTURED'
                same(boxed, render(), "a box")
                bpy.data.objects.remove(obj)
        bpy.ops.object.patina_to_point_cloud()
        check(obj.type == 'POINTCLOUD' and obj.display_type == 'BOUNDS', f"converted: {obj.display_type}")
        bpy.ops.object.patina_to_mesh()
        obj.display_type = 'SOLID'
        bpy.ops.object.patina_to_point_cloud()
        check(obj.display_type == 'SOLID', f"the artist's choice became {obj.display_type}")
    finally:
        point_data.MOST_SPHERES = most


def test_pictures_are_the_same():
    needs_clouds()
    pictures = []
    for cloud in (False, True):
        new_scene()
        obj = added(given(), cloud)
        check(obj.type == ('POINTCLOUD' if cloud else 'MESH'), obj.type)
        pictures.append(render())
    same(*pictures, "mesh and point cloud")


def test_display_radii_are_no_radii():
    """Solid shading takes them; discs and exports do not, until the artist sets them."""
    needs_clouds()
    scene = new_scene()
    scene.patina.surface = 'SPLATS'
    obj = added(given(), False)
    plain = render()
    bpy.data.objects.remove(obj)
    obj = added(given(), True)
    radii = attributes.scalars(obj.data, 3000, "radius")[:, 0]
    spacing = np.sqrt(4 * np.pi / 3000)
    check(0.5 * spacing < np.median(radii) < 3 * spacing, f"{np.median(radii)} where points lie {spacing} apart")
    check(point_data.are_for_display(obj.data), "not told from an artist's")
    same(plain, render(), "display radii")
    path = SCRATCH / "radii.ply"
    bpy.ops.export_scene.patina_points(filepath=str(path), kind='PLY')
    check(b"radius" not in path.read_bytes()[:1000], "display radii are exported")
    obj.data.attributes["radius"].data.foreach_set("value", 0.5 * radii)
    obj.data.update_tag()
    check(not point_data.are_for_display(obj.data), "an artist's radii count as such")
    check(any(not np.array_equal(plain[name], pixels) for name, pixels in render().items()), "an artist's radii draw nothing else")


def test_conversion_loses_nothing():
    needs_clouds()
    new_scene()
    obj = added(given(flag=np.arange(3000, dtype=np.uint8) % 3), False)
    obj.data.attributes.new("pick", 'INT', 'POINT').data.foreach_set("value", np.arange(3000, dtype=np.int32))
    obj.data["patina_scanners"] = [0.0, 0.0, 5.0]
    obj["own"] = 3
    obj.patina.opacity, obj.patina.lighting = 0.75, 'UNLIT'
    obj.patina.points.scans.add().gain = 1.5
    obj.driver_add("location", 2).driver.expression = "0.25"
    material = bpy.data.materials.new("own")
    obj.data.materials.append(material)
    nodes = obj.modifiers.new("nodes", 'NODES')
    nodes.node_group = group()
    pointer = bpy.data.objects.new("child", None)
    pointer.parent = obj
    kept = {item.name: (item.data_type, attributes.numbers(obj.data, 3000, item.name, width(item))) for item in obj.data.attributes}
    before = render()
    for operator, kind in ((bpy.ops.object.patina_to_point_cloud, 'POINTCLOUD'), (bpy.ops.object.patina_to_mesh, 'MESH')):
        check(operator() == {'FINISHED'} and obj.type == kind and obj.data.name == "scan", f"{obj.type} {obj.data.name}")
        same(before, render(), kind)
        for name, (data_type, values) in kept.items():
            found = obj.data.attributes.get(name)
            check(found is not None and found.data_type == data_type, f"{kind}: {name}")
            check_close(attributes.numbers(obj.data, 3000, name, width(found)), values, 0, f"{kind}: {name}")
        check(list(obj.data["patina_scanners"]) == [0.0, 0.0, 5.0] and obj.data["patina_crs"] == "EPSG:1", f"{kind}: properties of the data")
        check(obj["own"] == 3 and abs(obj.patina.opacity - 0.75) < 1e-6 and obj.patina.points.scans[0].gain == 1.5, f"{kind}: properties")
        check([curve.data_path for curve in obj.animation_data.drivers] == ["location"], f"{kind}: drivers")
        check(list(obj.data.materials) == [material] and pointer.parent == obj, f"{kind}: materials or children")
        check([(item.name, item.node_group, item.show_viewport) for item in obj.modifiers] == [("nodes", nodes_of(), True)], f"{kind}: modifiers")
    check(obj.data.color_attributes.active_color.name == "Col", "the active color")
    check("radius" not in obj.data.attributes, "display radii stay on a mesh")
    check(len(bpy.data.meshes) == 1 and not bpy.data.pointclouds and len(bpy.data.objects) == 3, "something is left over")


def width(attribute):
    return {'FLOAT_VECTOR': 3, 'FLOAT_COLOR': 4, 'BYTE_COLOR': 4}.get(attribute.data_type, 1)


def nodes_of():
    return bpy.data.node_groups["moves nothing"]


def group():
    found = bpy.data.node_groups.new("moves nothing", 'GeometryNodeTree')
    for side in ('INPUT', 'OUTPUT'):
        found.interface.new_socket("Geometry", in_out=side, socket_type='NodeSocketGeometry')
    found.links.new(found.nodes.new('NodeGroupInput').outputs[0], found.nodes.new('NodeGroupOutput').inputs[0])
    return found


def test_what_would_be_lost_is_refused():
    needs_clouds()
    new_scene()
    obj = added(given(50), False)
    obj.modifiers.new("twice", 'ARRAY')
    try:
        bpy.ops.object.patina_to_point_cloud()
        said = ""
    except RuntimeError as error:
        said = str(error)
    check("modifier 'twice'" in said and obj.type == 'MESH' and len(obj.modifiers) == 1, f"{obj.type}: {said}")
    obj.modifiers.clear()
    obj.data.edges.add(1)
    check("edges or faces" in convert_points.why_not(obj, 'POINTCLOUD'), "edges are lost")


def test_analysis_and_soft_points():
    needs_clouds()
    new_scene()
    obj = added(given(), True)
    bpy.ops.object.patina_analyze()
    check(obj.data.attributes["kind"].data_type == 'INT8' and len(obj.data.attributes["spacing"].data) == 3000, "not analyzed")
    check(not point_data.are_for_display(obj.data), "radii of the analysis count as for display")
    from patina.operators import soft_strokes
    from patina.sync.points import edits
    check(not soft_strokes.why_not(obj), soft_strokes.why_not(obj))
    soft_strokes.write(obj, edits.of_flags(np.arange(3000) < 100), 0.5)
    found = attributes.scalars(obj.data, 3000, "soft")[:, 0]
    check_close(found, np.where(np.arange(3000) < 100, 0.5, 0.0), 1e-6, "painted")
    check(render()["Combined"].any() and not reports, f"{reports}")


def test_odd_point_clouds():
    """No points, one value for all, types that nothing is known of, names that clash: no error, and nothing is lost."""
    needs_clouds()
    new_scene()
    empty = bpy.data.objects.new("empty", bpy.data.pointclouds.new("empty"))
    bpy.context.scene.collection.objects.link(empty)
    obj = added(given(500, radius=np.full(500, 3, np.uint8), position=np.ones(500, np.float32), Col=np.ones(500, np.float32)), True)
    for kind in ('FLOAT2', 'QUATERNION', 'FLOAT4X4', 'BOOLEAN', 'INT16_2D', 'INT32_2D', 'FLOAT4'):
        try:
            obj.data.attributes.new(f"odd {kind}", kind, 'POINT')
        except (TypeError, RuntimeError):
            pass  # not of this Blender, or not for points
    names = obj.data.attributes.keys()
    check({"file_position", "file_Col"} <= set(names), f"clashing names: {names}")
    check_close(attributes.scalars(obj.data, 500, "radius")[:, 0], np.full(500, 3.0), 0, "a file's radii")
    check(not point_data.are_for_display(obj.data), "a file's radii count as for display")
    check(len(drawn(render())) > 100 and not reports, f"{reports}")
    bpy.context.view_layer.objects.active = empty
    check(convert_points.why_not(empty, 'MESH') == "the object has no points", convert_points.why_not(empty, 'MESH'))
    bpy.ops.object.select_all(action='SELECT')
    path = SCRATCH / "odd.ply"
    bpy.ops.export_scene.patina_points(filepath=str(path), kind='PLY')
    check(b"element vertex 500" in path.read_bytes()[:200], "exported")
    bpy.context.view_layer.objects.active = obj
    check(bpy.ops.object.patina_to_mesh() == {'FINISHED'} and set(names) <= set(obj.data.attributes.keys()),
          f"{set(names) - set(obj.data.attributes.keys())} lost")


def test_one_value_for_all():
    """As Blender 5.2 may store an attribute; here as the add-on sees it."""
    needs_clouds()

    class One:
        name, domain, data_type = "value", 'POINT', 'FLOAT'

        class data:  # noqa: N801
            def __len__(self):
                return 1

            def foreach_get(self, _key, out):
                out[:] = 7.0

        data = data()
    check_close(attributes._values(One(), 5), np.full((5, 1), 7.0), 0, "one value")


def test_single_values_of_nodes():
    """What a node stores for all points, Blender 5.2 holds once: colors, opacities, classes of such are drawn, of many points too."""
    needs_clouds()
    values = (("Col", 'BYTE_COLOR', (1.0, 0.0, 0.0, 1.0)), ("faint", 'FLOAT', 0.5), ("classification", 'INT8', 6), ("flag", 'BOOLEAN', True))
    for count in (200, 200_000):
        new_scene()
        points = given(count)
        points.colors = None
        obj = added(points, True)
        obj.patina.opacity_attribute, obj.patina.lighting = "faint", 'UNLIT'
        tree = bpy.data.node_groups.new("stores", 'GeometryNodeTree')
        for side in ('INPUT', 'OUTPUT'):
            tree.interface.new_socket("Geometry", in_out=side, socket_type='NodeSocketGeometry')
        last = tree.nodes.new('NodeGroupInput').outputs[0]
        for name, kind, value in values:
            node = tree.nodes.new('GeometryNodeStoreNamedAttribute')
            node.data_type, node.domain = kind, 'POINT'
            node.inputs["Name"].default_value = name
            next(item for item in node.inputs if item.name == "Value" and item.enabled).default_value = value
            tree.links.new(last, node.inputs[0])
            last = node.outputs[0]
        tree.links.new(last, tree.nodes.new('NodeGroupOutput').inputs[0])
        obj.modifiers.new("stores", 'NODES').node_group = tree
        bpy.context.view_layer.update()
        found = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.attributes["faint"]
        check(getattr(found, "storage_type", 'SINGLE') == 'SINGLE', "Blender 5.2 stores a value for each point")
        seen = render()["Combined"]
        seen = seen[seen[..., 3] > 0]
        check(len(seen) > 50 and (seen[:, 0] > 0).all() and not seen[:, 1:3].any(), f"{count}: not red: {seen[:3]}")
        check(abs(seen[:, 3].min() - 0.5) < 0.01 and not reports, f"{count}: opacities from {seen[:, 3].min()}; {reports}")
        obj.patina.colors.hidden[6] = True
        check(not render()["Combined"].any(), f"{count}: the class that all have is not hidden")


def test_files_hold_point_clouds():
    """Saved, appended, linked and overridden: the picture stays."""
    needs_clouds()
    new_scene()
    obj = added(given(), True)
    before = render()
    path = str(SCRATCH / "clouds.blend")
    bpy.data.libraries.write(path, {obj})
    for link in (False, True):
        new_scene()
        with bpy.data.libraries.load(path, link=link) as (there, wanted):
            wanted.objects = list(there.objects)
        found, = wanted.objects
        bpy.context.scene.collection.objects.link(found)
        same(before, render(), f"link {link}")
        bpy.context.view_layer.objects.active = found
        why = convert_points.why_not(found, 'MESH')
        check(why == ("the object belongs to another file" if link else ""), f"link {link}: {why}")
        if link:
            own = found.override_create(remap_local_usages=True)
            same(before, render(), "overridden")
            own.patina.opacity = 0.5
            check(not np.array_equal(render()["Combined"], before["Combined"]), "the override's own opacity changes nothing")
    for library in list(bpy.data.libraries):
        bpy.data.libraries.remove(library)


def test_point_clouds_become_links():
    needs_clouds()
    new_scene()
    obj = added(given(), True)
    path = SCRATCH / "linked.ply"
    check(bpy.ops.object.patina_mesh_to_linked(filepath=str(path)) == {'FINISHED'}, "not linked")
    check(obj.type == 'MESH' and obj.patina.linked_file and len(obj.data.vertices) == 8, f"{obj.type} {obj.patina.linked_file}")
    check(len(drawn(render())) > 500 and not reports, f"{reports}")


def test_material_shows_the_colors():
    """In other engines, as in Material Preview."""
    needs_clouds()
    scene = new_scene()
    for material in list(bpy.data.materials):
        bpy.data.materials.remove(material)
    try:
        scene.render.engine = 'CYCLES'
    except TypeError:
        raise Skip("this Blender has no Cycles") from None
    points = given()
    points.colors = np.tile(np.uint8((250, 10, 10, 255)), (3000, 1))
    obj = added(points, True)
    again = made.to_data(given(), True)
    check(again.materials[0] == obj.data.materials[0], "a material for each import")
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.device = 4, False, 'CPU'
    set_world((1.0, 1.0, 1.0))
    scene.render.resolution_x = scene.render.resolution_y = 16
    bpy.ops.render.render()
    seen = saved().reshape(-1, 4)
    seen = seen[seen[:, 3] > 0.9]
    check(len(seen) > 10 and (seen[:, 0] > 5 * seen[:, 1]).all(), f"{len(seen)} pixels, {seen[:3]}")


def test_local_spacing():
    random = np.random.default_rng(3)
    for count in (1, 2, 1000, 200000):
        flat = random.random((count, 3)).astype(np.float32) * (1, 1, 0)
        found = point_data.local_spacing(flat.astype(np.float32))
        check(len(found) == count and np.isfinite(found).all() and (found > 0).all(), f"{count}: {found[:5]}")
        if count >= 1000:
            check(0.8 < np.median(found) * np.sqrt(count) < 1.25, f"{count}: {np.median(found) * np.sqrt(count)}")
    dense = np.concatenate([flat, flat[:100000] * 0.01 + (5, 0, 0)]).astype(np.float32)
    found = point_data.local_spacing(dense)
    check(np.median(found[-100000:]) < 0.2 * np.median(found[:200000]), "the dense part is as wide as the rest")
    odd = np.full((3, 3), np.nan, np.float32)
    check(np.isfinite(point_data.local_spacing(odd)).all(), "no finite place")


def test_meshes_are_offered_the_conversion():
    new_scene()
    obj = add_points(*sphere(100))
    why = convert_points.why_not(obj, 'POINTCLOUD')
    check(bool(why) != CLOUDS, why)
