# SPDX-License-Identifier: GPL-3.0-or-later
"""What the viewport draws by Blender's own graphics, into a picture that is read back: the same on OpenGL and Vulkan. In the background
Blender 5.1 and later have graphics; a window has them in each (with --gpu-backend vulkan too)."""

from types import SimpleNamespace

import bpy
import gpu
import numpy as np
from harness import Skip, check, check_close
from mathutils import Matrix
from patina.draw import graphics, painting, sky
from patina.sync.lighting import world_image
from patina.sync.lighting.world_nodes import Picture

WIDTH, HEIGHT = 48, 36


def canvas():
    """An empty picture to draw into; Skip where Blender cannot. Says which graphics they are."""
    if bpy.app.background:
        if not hasattr(gpu, "init"):
            raise Skip("this Blender draws nothing in the background")
        try:
            gpu.init()
        except (RuntimeError, SystemError) as error:
            raise Skip(f"Blender has no graphics here: {error}") from None
    found = f"{gpu.platform.backend_type_get() if hasattr(gpu.platform, 'backend_type_get') else 'OPENGL'}, {gpu.platform.renderer_get()}"
    if found not in _told:
        _told.add(found)
        print(f"graphics: {found}", flush=True)
    return gpu.types.GPUOffScreen(WIDTH, HEIGHT, format='RGBA16F')


_told = set()


def drawn_by(draw):
    """(height, width, 4) of colors and (height, width) of depths, row 0 at the bottom, after draw() on black and the farthest depth."""
    target = canvas()
    color, depth = (gpu.types.Buffer('FLOAT', (HEIGHT, WIDTH, channels)) for channels in (4, 1))
    try:
        with target.bind():
            frame = gpu.state.active_framebuffer_get()
            frame.clear(color=(0.0, 0.0, 0.0, 0.0), depth=1.0)
            gpu.state.blend_set('NONE')
            draw()
            frame.read_color(0, 0, WIDTH, HEIGHT, 4, 0, 'FLOAT', data=color)
            frame.read_depth(0, 0, WIDTH, HEIGHT, data=depth)
    finally:
        gpu.state.color_mask_set(True, True, True, True)
        gpu.state.depth_test_set('NONE')
        gpu.state.depth_mask_set(False)
        target.free()
    return (np.array(buffer.to_list(), np.float32).reshape(HEIGHT, WIDTH, -1) for buffer in (color, depth))


def test_gpu_pictures():
    """Texel by texel, over the part that it is of; what half floats cannot hold is cut; nothing is written into depths."""
    picture = np.random.default_rng(3).uniform(0, 2, (HEIGHT // 2, WIDTH // 2, 4)).astype(np.float32)
    picture[0, 0] = 1e6
    color, depth = drawn_by(lambda: painting.fill_rectangle([-1.0, -1.0, 0.0, 0.0], 'EXACT', graphics.texture(picture, 'RGBA16F')))
    check_close(color[:HEIGHT // 2, :WIDTH // 2], np.minimum(picture, 65000.0).astype(np.float16), 2e-3, "the lower left quarter")
    check(not color[HEIGHT // 2:].any() and not color[:, WIDTH // 2:].any(), "and nothing else")
    check((depth == 1).all(), "depths stay")


def test_gpu_stretched():
    """A coarser picture is drawn between its pixels."""
    ramp = np.zeros((3, 4, 4), np.float32)
    ramp[..., 0], ramp[..., 1] = np.arange(4), np.arange(3)[:, None]
    color, _ = drawn_by(lambda: painting.fill_rectangle([-1.0, -1.0, 1.0, 1.0], 'SMOOTH', graphics.texture(ramp, 'RGBA16F')))
    across, up = np.clip((np.arange(WIDTH) + 0.5) / WIDTH * 4 - 0.5, 0, 3), np.clip((np.arange(HEIGHT) + 0.5) / HEIGHT * 3 - 0.5, 0, 2)
    check_close(color[..., 0], np.broadcast_to(across, (HEIGHT, WIDTH)), 0.02, "from left to right")
    check_close(color[..., 1], np.broadcast_to(up[:, None], (HEIGHT, WIDTH)), 0.02, "from the bottom to the top")


def test_gpu_depths():
    """Depths as Blender's projections write them, of perspective and of a parallel view; what is far leaves what is there."""
    far = np.random.default_rng(4).uniform(1, 50, (HEIGHT, WIDTH, 1)).astype(np.float32)
    far[5, 7] = 1e30
    near, end = 0.1, 100.0
    for what, row, shown in (
            ("perspective", ((near + end) / (near - end), 2 * near * end / (near - end), 0.0, 0.0), lambda z, a, b: (b / z - a)),
            ("parallel", (2 / (near - end), (near + end) / (near - end), 0.0, 1.0), lambda z, a, b: (b - a * z))):
        def draw(row=row):
            gpu.state.color_mask_set(False, False, False, False)
            gpu.state.depth_test_set('LESS_EQUAL')
            gpu.state.depth_mask_set(True)
            painting.fill_rectangle([-1.0, -1.0, 1.0, 1.0], 'DEPTH', graphics.texture(far, 'R32F'), cover=0.0, rounding=0.0, away=0.0,
                                     projection=row)
        color, depth = drawn_by(draw)
        wanted = 0.5 + 0.5 * shown(far.astype(np.float64), *row[:2])
        wanted[5, 7] = 1
        check_close(depth, wanted, 1e-5, what)
        check(not color.any(), f"{what}: colors stay")


def test_gpu_sky():
    """An image of the world as sync.world_image looks it up."""
    pixels = np.random.default_rng(5).uniform(0, 3, (16, 32, 3)).astype(np.float32)
    turn = np.array(Matrix.Rotation(0.7, 3, (0.3, 0.5, 0.8)))
    camera = SimpleNamespace(world_from_camera=np.array(Matrix.Rotation(-1.1, 4, (0.9, 0.1, 0.2))).ravel().tolist(), orthographic=False,
                             left=-0.8, right=0.6, bottom=-0.5, top=0.7)
    x, y = np.meshgrid(camera.left + 1.4 * (np.arange(WIDTH) + 0.5) / WIDTH, camera.bottom + 1.2 * (np.arange(HEIGHT) + 0.5) / HEIGHT)
    looks = np.stack([x, y, -np.ones_like(x)], -1).reshape(-1, 3)
    looks /= np.linalg.norm(looks, axis=1, keepdims=True)
    image = world_image.Image("sky", (), pixels, pixels)
    for ball in (False, True):
        found = Picture(image, turn, np.array([0.1, 0.0, -0.2]), np.array([0.5, 1.0, 2.0]), ball, False)
        color, _ = drawn_by(lambda found=found: sky.Sky().draw(SimpleNamespace(picture=lambda: found), camera, (0.0, 0.0, 1.0, 1.0)))
        ways = (looks @ np.array(camera.world_from_camera).reshape(4, 4)[:3, :3].T @ turn.T + found.move).astype(np.float32)
        wanted = image.look(ways, ball, False, True) * found.gain
        off = np.abs(color[..., :3].reshape(-1, 3) - wanted).max(1)
        check(np.quantile(off, 0.99) < 0.02 and (color[..., 3] == 1).all(), f"{'ball' if ball else 'all around'}: off by {np.quantile(off, 0.99)}")
