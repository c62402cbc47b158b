# SPDX-License-Identifier: GPL-3.0-or-later
"""Images on meshes, beside Cycles' own Diffuse Color pass of the same scene; shadows on meshes."""

import bpy
import numpy as np
from harness import SCRATCH, Skip, add_light, add_points, check, check_close, linear, new_scene, render, reports, saved, set_world, sphere
from patina import sync
from patina.draw import viewport
from patina.sync.objects import images
from patina.sync.points import clouds, taking

SIZE = 96


def scene_with(material=None, half=0.9, turns=1.0, uv_maps=("UVMap",)):
    """A square before an orthographic camera that sees from -1 to 1; its corners lie at 0 and `turns` on the image."""
    scene = new_scene(SIZE, SIZE)
    scene.camera.data.type, scene.camera.data.ortho_scale = 'ORTHO', 2.0
    scene.patina.meshes = 'TRIANGLES'
    set_world((1, 1, 1))
    mesh = bpy.data.meshes.new("square")
    mesh.from_pydata([(-half, -half, -2), (half, -half, -2), (half, half, -2), (-half, half, -2)], [], [(0, 1, 2, 3)])
    for name in uv_maps:
        layer = mesh.uv_layers.new(name=name)
        for loop, place in zip(layer.data, ((0, 0), (turns, 0), (turns, turns), (0, turns))):
            loop.uv = place
    if material:
        mesh.materials.append(material)
    obj = bpy.data.objects.new("square", mesh)
    scene.collection.objects.link(obj)
    return scene, obj


def picture(width=16, height=12, floats=False, name="image", space='sRGB', alpha=None, seed=1):
    """A generated image of smooth random colours; alpha: (height, width)."""
    image = bpy.data.images.new(name, width, height, alpha=True, float_buffer=floats)
    image.colorspace_settings.name = space
    pixels = np.random.default_rng(seed).random((height, width, 4)).astype(np.float32)
    pixels[..., 3] = 1.0 if alpha is None else alpha
    image.pixels.foreach_set(pixels.reshape(-1))
    image.update()
    return image


def material_of(image, shader='ShaderNodeBsdfPrincipled', name="material", alpha=False, blend='BLEND', **settings):
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    output, node, texture = (tree.nodes.new(kind) for kind in ('ShaderNodeOutputMaterial', shader, 'ShaderNodeTexImage'))
    texture.image = image
    for key, value in settings.items():
        setattr(texture, key, value)
    color = node.inputs["Base Color" if "Base Color" in node.inputs else "Color"]
    if "Specular IOR Level" in node.inputs:  # from 4.0 on what shines takes its share of Cycles' diffuse color
        node.inputs["Specular IOR Level"].default_value = 0.0
    tree.links.new(texture.outputs["Color"], color)
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    if alpha:
        tree.links.new(texture.outputs["Alpha"], node.inputs["Alpha"])
        if bpy.app.version < (4, 2, 0):
            material.blend_method = blend
    return material


def cycles(what, samples=1):
    """A pass of Cycles, (height, width, 4): "Combined" or "DiffCol", samples in each pixel's middle."""
    if bpy.app.version >= (5, 0, 0):
        raise Skip("this Blender's compositor is another")
    scene = bpy.context.scene
    try:
        scene.render.engine = 'CYCLES'
    except TypeError:
        raise Skip("this Blender has no Cycles") from None
    scene.cycles.device, scene.cycles.samples, scene.cycles.use_denoising = 'CPU', samples, False
    scene.cycles.max_bounces, scene.cycles.transparent_max_bounces = 0, 8
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = 'BLACKMAN_HARRIS', 0.01
    scene.view_layers[0].use_pass_diffuse_color = True
    scene.use_nodes = True
    tree = scene.node_tree
    tree.nodes.clear()
    layers, output = tree.nodes.new('CompositorNodeRLayers'), tree.nodes.new('CompositorNodeComposite')
    tree.links.new(layers.outputs["Image" if what == "Combined" else what], output.inputs["Image"])
    bpy.ops.render.render()
    scene.render.engine, scene.use_nodes = 'PATINA', False
    return saved()


def inner(array, border=8):
    return array[border:-border, border:-border, :3]


def test_beside_cycles():
    """Filters, extensions, color spaces, floats and a Mapping node: the same colors as Cycles' to a thousandth."""
    cases = {
        "closest": ({}, {"interpolation": 'Closest'}), "data": ({"space": 'Non-Color'}, {}),
        "extend": ({"space": 'Non-Color'}, {"extension": 'EXTEND'}), "clip": ({"space": 'Non-Color'}, {"extension": 'CLIP'}),
        "floats": ({"floats": True, "space": 'Non-Color'}, {}),
        "opacity not asked for": ({"alpha": np.linspace(0, 1, 16)[None, :].repeat(12, 0)}, {"interpolation": 'Closest'}),
    }
    for name, (how, settings) in cases.items():
        scene, obj = scene_with(turns=1.6)
        obj.data.materials.append(material_of(picture(**how), **settings))
        ours = inner(render()["Combined"])
        off = np.abs(ours - inner(cycles("DiffCol")))
        print(f"    {name}: off by {off.max():.5f}, {off.mean():.6f} on average")
        # closest: an edge between texels through the middle of a pixel is either's
        most = 0.01 if "opacity" in name else 1e-3  # a step of a byte, for Cycles cuts the product with the opacity where we round
        check(np.quantile(off, 0.99) < most and off.mean() < 1e-3, f"{name}: off by {off.max()}, {off.mean()} on average")
        check(ours.std() > 0.1, f"{name}: no image")


def test_light_is_shared_out():
    """Between texels of an sRGB image light goes over evenly, as in Cycles with the same image in floats; of bytes Cycles mixes the
    codes, which is darker between bright and dark."""
    scene, obj = scene_with()
    image = picture()
    material = material_of(image)
    obj.data.materials.append(material)
    ours = inner(render()["Combined"])
    codes = inner(cycles("DiffCol"))
    pixels = np.empty(16 * 12 * 4, np.float32)
    image.pixels.foreach_get(pixels)
    floats = bpy.data.images.new("floats", 16, 12, float_buffer=True)
    floats.colorspace_settings.name = 'Non-Color'
    pixels = pixels.reshape(-1, 4)
    pixels[:, :3] = linear(pixels[:, :3] * 255)
    floats.pixels.foreach_set(pixels.reshape(-1))
    next(node for node in material.node_tree.nodes if node.type == 'TEX_IMAGE').image = floats
    off = np.abs(ours - inner(cycles("DiffCol")))
    print(f"    sRGB bytes: off by {off.max():.5f}; Cycles' own bytes differ by {np.abs(ours - codes).max():.3f} at most, "
          f"{(codes - ours).mean():+.4f} on average")
    check(off.max() < 2e-3, f"off by {off.max()}")


def test_mapping_and_maps():
    """A Mapping node turns, scales and moves; a UV Map node names another map."""
    scene, obj = scene_with(uv_maps=("first", "second"))
    for loop in obj.data.uv_layers["second"].data:
        loop.uv = loop.uv * 0.5
    material = material_of(picture(space='Non-Color'))
    tree = material.node_tree
    texture = next(node for node in tree.nodes if node.type == 'TEX_IMAGE')
    mapping, uv = tree.nodes.new('ShaderNodeMapping'), tree.nodes.new('ShaderNodeUVMap')
    tree.links.new(uv.outputs["UV"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    obj.data.materials.append(material)
    for name in ("first", "second"):
        uv.uv_map = name
        mapping.inputs["Location"].default_value, mapping.inputs["Scale"].default_value = (0.3, -0.2, 0), (1.5, 0.7, 1)
        mapping.inputs["Rotation"].default_value = (0, 0, 0.6)
        off = np.abs(inner(render()["Combined"]) - inner(cycles("DiffCol")))
        check(off.max() < 2e-3, f"{name}: off by {off.max()}")


def test_small_on_screen():
    """Minified Patina's picture is what Cycles' comes to with many samples, and even."""
    scene, obj = scene_with(turns=40.0)
    obj.data.materials.append(material_of(picture(32, 32)))
    ours = inner(render()["Combined"])
    mean = linear(np.round(np.random.default_rng(1).random((32, 32, 4)).astype(np.float32)[..., :3] * 255)).mean(axis=(0, 1))
    check(ours.std(axis=(0, 1)).max() < 0.02, f"shimmers: {ours.std(axis=(0, 1))}")
    check_close(ours.mean(axis=(0, 1)), mean, 0.01, "mean")


def test_opacity():
    """Clipped, blended and opaque materials: alpha as Cycles has it, or as the material says."""
    alpha = np.zeros((12, 16), np.float32)
    alpha[3:9, 4:12] = 1.0
    for blend, interpolation in (('CLIP', 'Closest'), ('BLEND', 'Closest'), ('BLEND', 'Linear')):
        if blend == 'CLIP' and bpy.app.version >= (4, 2, 0):
            continue  # materials clip no more
        scene, obj = scene_with()
        obj.data.materials.append(material_of(picture(alpha=alpha), alpha=True, blend=blend, interpolation=interpolation))
        ours, theirs = render()["Combined"], cycles("Combined", 64)  # which meets what is half there by chance
        off = np.abs(ours[..., 3] - theirs[..., 3])
        print(f"    {blend}, {interpolation}: alpha off by {off.mean():.4f}, {(ours - theirs)[..., 3].mean():+.5f} on average")
        check((ours[..., 3] == 0).mean() > 0.3 and ours[..., 3].max() > 0.99, f"{blend}: alpha {ours[..., 3].mean()}")
        check(off.mean() < 6e-3 and abs((ours - theirs)[..., 3].mean()) < 2e-3, f"{blend}, {interpolation}: alpha off by {off.mean()}")
    if bpy.app.version < (4, 2, 0):
        obj.data.materials[0].blend_method = 'OPAQUE'
        check(inner(render()["Combined"][..., 3:]).min() > 0.99, "an opaque material is not")


def test_layers_of_leaves():
    """Behind a hole another image shows, and the light falls through the hole onto it."""
    hole = np.ones((16, 16), np.float32)
    hole[4:12, 4:12] = 0.0
    blend = 'CLIP'
    scene, front = scene_with(material_of(picture(16, 16, name="leaf", alpha=hole), alpha=True, blend=blend, interpolation='Closest'))
    back = bpy.data.objects.new("back", front.data.copy())
    back.data.materials[0] = material_of(picture(seed=2, name="ground"), name="ground")
    back.location.z = -1.0
    scene.collection.objects.link(back)
    depth = render()["Depth"][..., 0]
    check_close(depth[SIZE // 2, SIZE // 2], 3.0, 1e-3, "in the hole")
    check_close(depth[12, SIZE // 2], 2.0, 1e-3, "on the rim")
    scene.world = None
    add_light('SUN', 3.0, direction=(0.3, 0, -1)).data.angle = 0.0
    bpy.context.view_layer.patina.use_pass_shadow = True
    shadow = render()["Shadow"][..., 0]
    check(shadow[SIZE // 2, SIZE // 2 + 10] == 1.0, "no light through the hole")
    check(shadow[SIZE // 2, SIZE // 2 - 16] == 0.0, "no shadow of the rim")


def test_shining():
    """An Emission node shows its image as it is, times its strength, without any light."""
    scene, obj = scene_with()
    material = material_of(picture(), shader='ShaderNodeEmission', interpolation='Closest')
    next(node for node in material.node_tree.nodes if node.type == 'EMISSION').inputs["Strength"].default_value = 2.0
    obj.data.materials.append(material)
    scene.world = None
    ours, theirs = render()["Combined"], cycles("Combined")
    off = np.abs(inner(ours) - inner(theirs))
    check(np.quantile(off, 0.98) < 2e-3 and inner(ours).max() > 1.0, f"off by {off.max()}, {off.mean()} on average")


def test_two_materials():
    """Faces of one mesh with an image, with another and with a color: each its own."""
    scene, obj = scene_with()
    mesh = obj.data
    mesh.clear_geometry()
    mesh.from_pydata([(x, y, -2) for y in (-0.9, 0.9) for x in (-0.9, -0.3, 0.3, 0.9)], [], [(i, i + 1, i + 5, i + 4) for i in range(3)])
    layer = mesh.uv_layers.new(name="UVMap")
    for loop in layer.data:
        loop.uv = (0.5, 0.5)
    for name, color in (("red", (1, 0, 0, 1)), ("green", (0, 1, 0, 1))):
        image = bpy.data.images.new(name, 1, 1)
        image.pixels[:] = color
        mesh.materials.append(material_of(image, name=name))
    plain = bpy.data.materials.new("blue")
    plain.diffuse_color = (0, 0, 1, 1)
    if bpy.app.version >= (5, 0, 0):
        plain.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0, 0, 1, 1)
    mesh.materials.append(plain)
    mesh.polygons.foreach_set("material_index", [0, 1, 2])
    row = render()["Combined"][SIZE // 2]
    for x, color in ((18, (1, 0, 0)), (48, (0, 1, 0)), (78, (0, 0, 1))):
        check_close(row[x, :3], color, 1e-5, f"at {x}")
    other = bpy.data.objects.new("other", mesh)  # the same faces, a material of its own
    scene.collection.objects.link(other)
    other.location.z = 1.0
    other.material_slots[1].link = 'OBJECT'
    other.material_slots[1].material = plain
    check_close(render()["Combined"][SIZE // 2, 48, :3], (0, 0, 1), 1e-5, "an object's own material")


def test_missing():
    """An image that is not there is pink, as in Cycles, and told once; so is a node without one."""
    image = bpy.data.images.new("lost", 4, 4)
    image.source, image.filepath = 'FILE', str(SCRATCH / "no such picture.png")
    for chosen, told in ((image, "'lost' is missing"), (None, "no image chosen")):
        scene, obj = scene_with()
        obj.data.materials.append(material_of(chosen))
        other = bpy.data.objects.new("other", obj.data)
        scene.collection.objects.link(other)
        color = render()["Combined"][SIZE // 2, SIZE // 2, :3]
        check_close(color, (1, 0, 1), 1e-5, told)
        said = [text for _, text in reports if "pink" in text]
        check(len(said) == 1 and said[0].count(told) == 1, f"{reports}")
        check_close(cycles("DiffCol")[SIZE // 2, SIZE // 2, :3], (1, 0, 1), 1e-5, "in Cycles")


def test_what_is_not_drawn_is_told():
    scene, obj = scene_with(uv_maps=())
    obj.data.materials.append(material_of(picture()))
    render()
    check(any("has no UV map" in text for _, text in reports), f"{reports}")
    scene, obj = scene_with()
    material = material_of(picture())
    tree = material.node_tree
    texture = next(node for node in tree.nodes if node.type == 'TEX_IMAGE')
    tree.links.new(tree.nodes.new('ShaderNodeTexCoord').outputs["Generated"], texture.inputs["Vector"])
    material.diffuse_color = (0.2, 0.4, 0.6, 1)
    obj.data.materials.append(material)
    check_close(render()["Combined"][SIZE // 2, SIZE // 2, :3], (0.2, 0.4, 0.6), 1e-5, "the viewport's color")
    check(any("UV maps only" in text for _, text in reports), f"{reports}")


def test_files_and_packed():
    """A saved image, the same packed, and the file changed on disk: what is there is drawn."""
    image = picture(name="saved")
    image.filepath_raw, image.file_format = str(SCRATCH / "saved.png"), 'PNG'
    image.save()
    scene, obj = scene_with()
    loaded = bpy.data.images.load(str(SCRATCH / "saved.png"))
    obj.data.materials.append(material_of(loaded, interpolation='Closest'))
    first = render()["Combined"].copy()
    check(inner(first).std() > 0.1, "no image")
    loaded.pack()
    check(np.array_equal(render()["Combined"], first), "packed it is another")
    loaded.unpack(method='REMOVE')
    image.pixels.foreach_set(np.ones(16 * 12 * 4, np.float32))
    image.save()
    loaded.reload()
    check_close(inner(render()["Combined"]), 1.0, 1e-5, "the new file")


def test_final_pictures_see_changed_pixels():
    scene, obj = scene_with()
    image = picture()
    obj.data.materials.append(material_of(image))
    before = render()["Combined"].copy()
    image.pixels.foreach_set(np.full(16 * 12 * 4, 0.5, np.float32))
    after = inner(render()["Combined"])
    check(not np.array_equal(inner(before), after), "the old image")
    image.alpha_mode = 'NONE'
    check_close(inner(render()["Combined"]), linear(128), 1e-3, "gray")


def test_viewport_follows():
    """Between two redraws images are trusted; what Blender says of an image or its material has them read again."""
    scene, obj = scene_with()
    image = picture()
    material = material_of(image)
    obj.data.materials.append(material)
    told = []

    def listen(_scene, depsgraph):
        told.append(taking.changed_owners(depsgraph))

    depsgraph = bpy.context.evaluated_depsgraph_get()
    bpy.app.handlers.depsgraph_update_post.append(listen)
    try:
        trusted = sync.Trusted()

        def shown():
            items = clouds.collect(bpy.context.evaluated_depsgraph_get(), trusted.take([]), [], trusting=True)
            return items[0].texture

        depsgraph.update()
        first = shown()
        check(shown() is first, "made anew although nothing changed")
        for change in (lambda: image.update_tag(), lambda: material.update_tag()):
            image.pixels.foreach_set(np.random.default_rng(len(told)).random(16 * 12 * 4).astype(np.float32))
            check(shown() is first, "read without a reason")
            change()
            bpy.context.view_layer.update()
            second = shown()
            check(second is not first, "the old image")
            first = second
    finally:
        bpy.app.handlers.depsgraph_update_post.remove(listen)
    images.CACHE.clear()
    check(viewport is not None, "viewport")


def test_points_shadow_triangles():
    """A ball of points over a plane of triangles: its shadow lies where rays say."""
    scene, obj = scene_with()
    scene.world, scene.patina.fill = None, 'CLOSED'
    positions, colors, normals = sphere(20000, 0.3, (0, 0, -1.5))
    add_points(positions, colors, normals)
    bpy.context.view_layer.patina.use_pass_shadow = True
    for angle in (0.0, 0.3):
        light = add_light('SUN', 3.0, direction=(1.4, 0, -1))
        light.data.angle = angle
        scene.patina.shadow_samples = 64
        shadow = render()["Shadow"][..., 0]
        y, x = np.mgrid[0:SIZE, 0:SIZE]
        px, py = (x + 0.5) / 48 - 1, (y + 0.5) / 48 - 1
        way = np.array((-1.4, 0, 1)) / np.hypot(1.4, 1)
        to = np.stack([-px, -py, np.full_like(px, 0.5)], -1)
        along = to @ way
        miss = np.sqrt((to ** 2).sum(-1) - along ** 2)
        plane = (np.abs(px) < 0.85) & (np.abs(py) < 0.85) & (np.hypot(px, py) > 0.35)
        border = 0.02 + 0.62 * np.tan(angle / 2) + 0.02
        dark, lit = plane & (miss < 0.3 - border), plane & (miss > 0.3 + border)
        check(dark.sum() > 100 and shadow[dark].max() < 0.02, f"{angle}: {dark.sum()} pixels, {shadow[dark].max()} arrives")
        check(lit.sum() > 3000 and shadow[lit].min() > 0.98, f"{angle}: lit {shadow[lit].min()}")
        bpy.data.objects.remove(light)
    obj.patina.receive_shadows = False
    add_light('SUN', 3.0, direction=(1.4, 0, -1))
    check(render()["Shadow"][..., 0][plane].min() == 1.0, "receives although it must not")
