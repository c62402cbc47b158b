# SPDX-License-Identifier: GPL-3.0-or-later
"""The world behind a 3D view's picture, drawn by Blender's own graphics: each pixel looks up what lies in its direction."""

from __future__ import annotations

import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader
from mathutils import Matrix

from ..description.view import Camera
from ..sync import World
from ..sync.lighting.world_nodes import Picture
from . import graphics

_VERTEX = """
void main()
{
    place = pos;
    vec2 share = (pos - window.xy) / (window.zw - window.xy);
    gl_Position = vec4(corners.xy + share * (corners.zw - corners.xy), 0.0, 1.0);
}
"""

# As sync/lighting/world_image.py does it.
_FRAGMENT = """
const float pi = 3.14159265358979;

vec4 pixel(ivec2 at, ivec2 size) { return texelFetch(picture, ivec2(mod(vec2(at), vec2(size)) + 0.5), 0); }

void main()
{
    vec3 look = kinds.x > 0.5 ? vec3(0.0, 0.0, -1.0) : normalize(vec3(place, -1.0));
    vec3 d = (turn * vec4(look, 1.0)).xyz;
    vec2 uv = vec2(0.5 - atan(d.y, d.x) / (2.0 * pi), atan(d.z, length(d.xy)) / pi + 0.5);
    if (kinds.y > 0.5) {
        d = normalize(d);
        uv = 0.5 * (d.xz / (2.0 * sqrt(max(0.5 - 0.5 * d.y, 1e-20))) + 1.0);
    }
    ivec2 size = textureSize(picture, 0);
    vec2 at = uv * vec2(size) - (kinds.z > 0.5 ? 0.0 : 0.5);
    ivec2 low = ivec2(floor(at));
    vec2 share = kinds.z > 0.5 ? vec2(0.0) : at - vec2(low);
    vec4 below = mix(pixel(low, size), pixel(low + ivec2(1, 0), size), share.x);
    vec4 above = mix(pixel(low + ivec2(0, 1), size), pixel(low + ivec2(1, 1), size), share.x);
    color = vec4(min(mix(below, above, share.y).rgb * gain.rgb, vec3(65000.0)), 1.0);
}
"""

_compiled = graphics.Shaders()


def forget() -> None:
    _compiled.forget()


class Sky:
    """Holds the texture of the last world that it drew."""

    def __init__(self) -> None:
        self._known: tuple[World, Picture, gpu.types.GPUTexture] | None = None

    def draw(self, world: World, camera: Camera, place: tuple[float, float, float, float]) -> None:
        """What camera sees of world, within x0, y0, x1, y1 of the view, 0..1. Over what is there."""
        if self._known is None or self._known[0] is not world:
            picture = world.picture()
            self._known = (world, picture, _texture(picture.image.pixels))
        _, picture, texture = self._known
        axes = np.array(camera.world_from_camera).reshape(4, 4)[:3, :3]
        turn = np.eye(4)
        turn[:3, :3] = picture.turn @ (axes / np.linalg.norm(axes, axis=0))
        turn[:3, 3] = picture.move
        x0, y0, x1, y1 = place
        across, up = camera.right - camera.left, camera.top - camera.bottom
        window = (camera.left + x0 * across, camera.bottom + y0 * up, camera.left + x1 * across, camera.bottom + y1 * up)
        shader = _compiled.get("sky", _create)
        left, low, right, high = window
        batch = batch_for_shader(shader, 'TRI_STRIP', {"pos": ((left, low), (right, low), (left, high), (right, high))})
        shader.bind()
        shader.uniform_sampler("picture", texture)
        shader.uniform_float("turn", Matrix(turn.tolist()))
        shader.uniform_float("window", window)
        shader.uniform_float("corners", tuple(2.0 * share - 1.0 for share in place))
        shader.uniform_float("gain", (*picture.gain.tolist(), 0.0))
        shader.uniform_float("kinds", (float(camera.orthographic), float(picture.ball), float(picture.closest), 0.0))
        batch.draw(shader)


def _texture(pixels: np.ndarray) -> gpu.types.GPUTexture:
    height, width = pixels.shape[:2]
    whole = np.ones((height, width, 4), np.float32)
    np.minimum(pixels, 65000.0, out=whole[..., :3])  # half floats end at 65504
    return graphics.texture(whole, 'RGBA16F')


def _create() -> gpu.types.GPUShader:
    interface = gpu.types.GPUStageInterfaceInfo("patina_sky")
    interface.smooth('VEC2', "place")
    info = gpu.types.GPUShaderCreateInfo()
    info.push_constant('MAT4', "turn")
    for name in ("window", "corners", "gain", "kinds"):
        info.push_constant('VEC4', name)
    info.sampler(0, 'FLOAT_2D', "picture")
    info.vertex_in(0, 'VEC2', "pos")
    info.vertex_out(interface)
    info.fragment_out(0, 'VEC4', "color")
    info.vertex_source(_VERTEX)
    info.fragment_source(_FRAGMENT)
    return gpu.shader.create_from_info(info)
