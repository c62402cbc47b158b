# SPDX-License-Identifier: GPL-3.0-or-later
"""Cryptomatte passes beside Cycles' own: names, shares, and what Blender's node makes of a file of them."""

import json

import bpy
import numpy as np
from harness import SCRATCH, Skip, add_points, check, check_close, compositor, end_compositor, new_scene, render, sphere
from patina.draw import cryptomatte
from patina.draw import render as drawing

SIZE = 64


def places():
    """Two balls, one before the other, a plate behind both: (name, place, radius)."""
    return (("near", (-0.45, 0.0, -3.4), 0.7), ("far", (0.45, 0.2, -4.6), 0.8))


def points_scene(samples=1, fill='CLOSED'):
    scene = new_scene(SIZE, SIZE)
    for name, place, radius in places():
        positions, colors, normals = sphere(60000, radius, (0, 0, 0))
        add_points(positions, colors, normals, name).location = place
    scene.patina.fill, scene.patina.antialias, scene.patina.samples = fill, 'LAYERS', samples
    layer = scene.view_layers[0]
    layer.use_pass_cryptomatte_object = layer.use_pass_cryptomatte_asset = True
    return scene


def meshes_instead(scene):
    """The same balls for Cycles, the points hidden from it."""
    made = []
    for name, place, radius in places():
        scene.objects[name].name = f"{name} of points"
        bpy.ops.mesh.primitive_uv_sphere_add(segments=96, ring_count=48, radius=radius, location=place)
        bpy.context.object.name = name
        scene.objects[f"{name} of points"].hide_render = True
        made.append(bpy.context.object)
    return made


def ranks_of(picture, kind="Object"):
    """[(hash as float32 bits, share)] planes."""
    found = []
    for number in range(8):
        plane = picture.get(f"Crypto{kind}{number:02d}")
        if plane is not None:
            for at in (0, 2):
                found.append((np.ascontiguousarray(plane[..., at]).view(np.uint32), plane[..., at + 1]))
    return found


def share_of(picture, name, kind="Object"):
    wanted = cryptomatte.as_floats(np.array([cryptomatte.hash_of(name)], np.uint32)).view(np.uint32)[0]
    return sum(np.where(hashes == wanted, share, 0) for hashes, share in ranks_of(picture, kind))


def test_hashes():
    """Known values of MurmurHash3, and the bits that are kept off."""
    for text, wanted in (("", 0), ("hello", 0x248BFA47), ("hello, world", 0x149BBB7F), ("The quick brown fox jumps over the lazy dog", 0x2E4FF723)):
        check(cryptomatte.hash_of(text) == wanted, f"{text!r}: {cryptomatte.hash_of(text):08x}")
    odd = np.array([0x00000001, 0x7F800000, 0xFFFFFFFF, 0x12345678], np.uint32)
    bits = cryptomatte.as_floats(odd).view(np.uint32)
    check(bits.tolist() == [0x00800001, 0x7F000000, 0xFF7FFFFF, 0x12345678], f"{[f'{one:08x}' for one in bits]}")


def test_shares():
    """They add up to alpha, rank by rank, whatever the samples; the number of passes is that of the levels."""
    for samples in (1, 9):
        scene = points_scene(samples)
        picture = render()
        found = ranks_of(picture)
        check(len(found) == 6 and len(ranks_of(picture, "Asset")) == 6, f"{len(found)} ranks")
        shares = [share for _, share in found]
        check(all((a >= b).all() for a, b in zip(shares, shares[1:])), "the greatest come first")
        check_close(sum(shares), picture["Combined"][..., 3], 2e-3, f"{samples} samples: all of alpha")
        near, far = share_of(picture, "near"), share_of(picture, "far")
        check_close(near + far, picture["Combined"][..., 3], 2e-3, f"{samples} samples: of the two")
        check(((near > 0.05) & (near < 0.95)).sum() > 40, "edges are parts")
        check(((near > 0.05) & (far > 0.05)).sum() > 5, "some pixels have both")
        check_close(share_of(picture, "near", "Asset"), near, 0, "an asset of its own")
    scene.view_layers[0].pass_cryptomatte_depth = 2
    check(len(ranks_of(render())) == 2, "as many as are asked for")


def test_assets_and_instances():
    """An asset is what stands atop its parents; instances have their object's name."""
    scene = points_scene()
    top = bpy.data.objects.new("statue", None)
    scene.collection.objects.link(top)
    for name in ("near", "far"):
        scene.objects[name].parent = top
    picture = render()
    check_close(share_of(picture, "statue", "Asset"), picture["Combined"][..., 3], 2e-3, "the whole statue")
    check(share_of(picture, "near").max() > 0.99 and not share_of(picture, "near", "Asset").any(), "objects by themselves")


def test_glass_and_holdouts():
    """Through half a ball half of what lies behind; what is held out has no share."""
    scene = points_scene()
    scene.objects["near"].patina.opacity = 0.5
    picture = render()
    near, far = share_of(picture, "near"), share_of(picture, "far")
    both = (near > 0.01) & (far > 0.01)
    check(abs(np.median(near[both]) - 0.5) < 0.26 and far[both].min() >= 0, f"{np.median(near[both])}, {np.median(far[both])}")
    check_close(near + far, picture["Combined"][..., 3], 2e-3, "all of alpha")
    scene.objects["near"].patina.opacity = 1.0
    scene.objects["near"].is_holdout = True
    held = render()
    check(not share_of(held, "near").any(), "held out")
    check(share_of(held, "far").sum() < share_of(picture, "far").sum(), "and hides what lies behind")


def test_many_objects_in_few_pictures():
    """A crowd is told apart by few colors; each share is that of the object alone."""
    scene = new_scene(SIZE, SIZE)
    generator = np.random.default_rng(4)
    centers = []
    for number in range(40):
        place = (*generator.uniform(-1.2, 1.2, 2), generator.uniform(-5.0, -3.5))
        centers.append(place)
        positions, colors, normals = sphere(4000, 0.2, (0, 0, 0))
        add_points(positions, colors, normals, f"ball {number}").location = place
    scene.patina.fill, scene.patina.antialias = 'CLOSED', 'LAYERS'
    scene.view_layers[0].use_pass_cryptomatte_object = True
    made = []
    original = cryptomatte.plan
    cryptomatte.plan = lambda *arguments: made.append(original(*arguments)) or made[-1]
    try:
        picture = render()
    finally:
        cryptomatte.plan = original
    check(len(made[0].scenes) <= 4, f"{len(made[0].scenes)} pictures")
    check_close(sum(share_of(picture, f"ball {number}") for number in range(40)), picture["Combined"][..., 3], 0.01, "all of alpha")
    hard, drawing._is_hard = drawing._is_hard, lambda description: False
    try:
        one_by_one = render()
    finally:
        drawing._is_hard = hard
    for number in range(40):
        off = np.abs(share_of(picture, f"ball {number}") - share_of(one_by_one, f"ball {number}"))
        check(off.max() < 0.01, f"ball {number}: off by {off.max():.3f}")


def test_motion():
    """A moving object's share is that of the shutter's time."""
    scene = points_scene()
    bpy.data.objects.remove(scene.objects["far"])
    near = scene.objects["near"]
    for frame, x in ((0, -1.0), (2, 1.0)):
        near.location.x = x
        near.keyframe_insert("location", frame=frame)
    scene.frame_set(1)
    scene.render.use_motion_blur, scene.render.motion_blur_shutter, scene.patina.motion_steps = True, 1.0, 8
    picture = render()
    share = share_of(picture, "near")
    check_close(share, picture["Combined"][..., 3], 0.01, "alpha's")
    check(((share > 0.2) & (share < 0.8)).mean() > 0.02, "blurred")


def header_of(path):
    """The cryptomatte attributes of an EXR file's header."""
    data, at, found = path.read_bytes(), 8, {}
    while data[at]:
        name = data[at:data.index(b"\0", at)].decode()
        at += len(name) + 1
        kind = data[at:data.index(b"\0", at)].decode()
        at += len(kind) + 1
        size = int.from_bytes(data[at:at + 4], "little")
        if kind == "string" and name.startswith("cryptomatte/"):
            found[name] = data[at + 4:at + 4 + size].decode()
        at += 4 + size
    return found


def multilayer(scene, name):
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = 'MULTI_LAYER_IMAGE'
    settings.file_format, settings.color_depth, settings.exr_codec = 'OPEN_EXR_MULTILAYER', '32', 'ZIP'
    scene.render.filepath = str(SCRATCH / name)
    bpy.ops.render.render(write_still=True)
    return next(SCRATCH.glob(f"{name}*.exr"))


def cycles(scene):
    try:
        scene.render.engine = 'CYCLES'
        scene.cycles.samples, scene.cycles.device, scene.cycles.use_denoising = 64, 'CPU', False
        scene.cycles.pixel_filter_type, scene.cycles.max_bounces = 'BOX', 0
    except (TypeError, AttributeError):
        raise Skip("this Blender has no Cycles") from None


def matte(path, name):
    """What the compositor's node takes out of a file by an object's name."""
    scene = bpy.context.scene
    image = bpy.data.images.load(str(path))
    tree, out = compositor(scene)
    node = tree.nodes.new('CompositorNodeCryptomatteV2')
    node.source, node.image = 'IMAGE', image
    node.layer_name, node.matte_id = "ViewLayer.CryptoObject", name
    tree.links.new(node.outputs["Matte"], out.inputs[0])
    scene.render.engine = 'PATINA'
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = 'IMAGE'
    settings.file_format, settings.color_mode, settings.color_depth = 'OPEN_EXR', 'RGB', '32'
    scene.render.filepath = str(SCRATCH / f"matte-{path.stem}-{name}")
    bpy.ops.render.render(write_still=True)
    end_compositor(scene)
    written = bpy.data.images.load(str(next(SCRATCH.glob(f"matte-{path.stem}-{name}*.exr"))))
    pixels = np.empty(SIZE * SIZE * 4, np.float32)
    written.pixels.foreach_get(pixels)
    return pixels.reshape(SIZE, SIZE, 4)[..., 0]


def test_node_like_cycles():
    """Files of both engines: the same attributes, the same names, and mattes that agree."""
    scene = points_scene(16)
    own = multilayer(scene, "own")
    made = meshes_instead(scene)
    cycles(scene)
    theirs = multilayer(scene, "theirs")
    mine, other = header_of(own), header_of(theirs)
    check(set(mine) == set(other), f"{sorted(mine)} and {sorted(other)}")
    for key, value in other.items():
        if key.endswith("/manifest"):
            known, wanted = json.loads(mine[key]), json.loads(value)
            check(all(known[name] == wanted[name] for name in ("near", "far")), f"{known} and {wanted}")
        else:
            check(mine[key] == value, f"{key}: {mine[key]} and {value}")
    for obj in made:
        obj.hide_render = True
    for name in ("near", "far"):
        a, b = matte(own, name), matte(theirs, name)
        off = np.abs(a - b)
        print(f"    {name}: {off.mean():.5f}, {off.max():.3f} at most; {a.sum():.1f} and {b.sum():.1f} pixels")
        check(a.sum() > 100 and off.mean() < 0.003 and abs(a.sum() / b.sum() - 1) < 0.02, f"{name}: off by {off.mean():.5f}")
