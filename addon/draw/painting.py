# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws the viewport's image and its depths into the framebuffer that Blender has bound."""

from __future__ import annotations

import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from .. import native
from . import graphics

_compiled = graphics.Shaders()  # by what they draw


def forget() -> None:
    _compiled.forget()


def covering(depth: np.ndarray) -> np.ndarray:
    """The nearest of 5 x 5 pixels, for all pixels. Here and not in the shader: a GPU in software takes ten times as long."""
    return native.nearest_depths(depth)


_VERTEX = """
#if defined(CHOSEN)
void main()
{
    gl_Position = transform * vec4(pos, 1.0);
    gl_PointSize = offset.w;
    vec2 at = (gl_Position.xy / gl_Position.w * 0.5 + 0.5 - region.xy) / region.zw;
    ivec2 size = textureSize(picture, 0);
    bool within = all(greaterThanEqual(at, vec2(0.0))) && all(lessThan(at, vec2(1.0)));
    float far = within ? texelFetch(picture, min(ivec2(at * vec2(size)), size - 1), 0).r : 1e30;
    if (0.5 * gl_Position.z / gl_Position.w + 0.5 > depth_of(far))
        gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
}
#else
void main()
{
    place = uv;
    gl_Position = vec4(pos, 0.0, 1.0);
}
#endif
"""

# The depth of Blender's projection that belongs to a linear z.
_DEPTH = """
#if defined(CHOSEN)
#define cover offset.x
#define rounding offset.y
#define away offset.z
#endif
#if !defined(EXACT) && !defined(SMOOTH)
float depth_of(float far)
{
    float z = far - cover * (projection.w > 0.5 ? 1.0 : far);
    float ndc = projection.w > 0.5 ? projection.y - projection.x * (z + projection.z) : projection.y / z - projection.x;
    float steps = rounding * (projection.w > 0.5 ? 1.0 : 1.0 + away / max(far, 1e-6));
    return far < 1e29 ? clamp(0.5 * ndc + 0.5 - steps, 0.0, 1.0) : 1.0;
}
#endif
"""

# One program for each thing to draw: a GPU in software executes both sides of every branch, and looks at depths for each
# program that may write one.
_FRAGMENT = """
const vec4 largest = vec4(65000.0); // Blender's half floats end at 65504; what overflows turns the viewport black

#if !defined(CHOSEN)
vec4 exact()
{
    ivec2 size = textureSize(picture, 0);
    return texelFetch(picture, min(ivec2(place * vec2(size)), size - 1), 0);
}
#endif

void main()
{
#if defined(CHOSEN)
    vec2 off = gl_PointCoord - 0.5;
    if (dot(off, off) > 0.25)
        discard;
    float code = abs(projection.w) - 1.0;
    color = vec4(mod(code, 256.0), mod(floor(code / 256.0), 256.0), floor(code / 65536.0), 255.0) / 255.0;
#elif defined(DEPTH) || defined(ERASE)
    float far = exact().r;
#if defined(ERASE)
    if (far >= 1e29)
        discard;
#endif
    gl_FragDepth = depth_of(far);
    color = vec4(0.0);
#elif defined(EXACT)
    color = min(exact(), largest);
#else
    color = min(texture(picture, place), largest);
#endif
}
"""


def fill_rectangle(corners: list[float], kind: str, texture: gpu.types.GPUTexture,
                   **uniforms: float | tuple[float, ...]) -> None:
    """Draws a texture over x0, y0, x1, y1 of -1..1. kind: EXACT, texel by texel; SMOOTH, between them; DEPTH, linear z as
    depths of Blender's projection, uniforms of which are its third row, the near plane and whether it is orthographic; ERASE, nothing
    at all where something is, at that depth.
    Overlays hide behind a depth two pixels wider than the surface and `cover` nearer: Blender draws the vertices of our points as dots
    over every engine's picture, and these lie just behind it. `rounding` moves it further, in shares of the whole depth, for Blender's
    vertices are rounded before they are projected: the more, the farther the eye is from the world's middle, `away`, measured by the
    distance seen. Raises GraphicsError."""
    program = shader(kind)
    x0, y0, x1, y1 = corners
    batch = batch_for_shader(program, 'TRI_STRIP', {"pos": ((x0, y0), (x1, y0), (x0, y1), (x1, y1)),
                                                   "uv": ((0, 0), (1, 0), (0, 1), (1, 1))})
    program.bind()
    program.uniform_sampler("picture", texture)
    for name, value in uniforms.items():
        program.uniform_float(name, value)
    batch.draw(program)


def shader(kind: str) -> gpu.types.GPUShader:
    """Of a kind of fill_rectangle, or CHOSEN: points at the depths of their places, as discs in one color. Raises GraphicsError."""
    return _compiled.get(kind, lambda: _create(kind))


def _create(kind: str) -> gpu.types.GPUShader:
    info = gpu.types.GPUShaderCreateInfo()
    info.define(kind)
    if kind in {'DEPTH', 'ERASE', 'CHOSEN'}:
        info.push_constant('VEC4', "projection")
        for name in ("cover", "rounding", "away") if kind != 'CHOSEN' else ():
            info.push_constant('FLOAT', name)
        if hasattr(info, "depth_write") and kind != 'CHOSEN':
            info.depth_write('ANY')
    info.sampler(0, 'FLOAT_2D', "picture")
    if kind == 'CHOSEN':
        info.push_constant('MAT4', "transform")  # with the others below the 128 bytes that all devices allow
        for name in ("offset", "region"):
            info.push_constant('VEC4', name)
        info.vertex_in(0, 'VEC3', "pos")
    else:
        interface = gpu.types.GPUStageInterfaceInfo(f"patina_{kind.lower()}")
        interface.smooth('VEC2', "place")
        info.vertex_in(0, 'VEC2', "pos")
        info.vertex_in(1, 'VEC2', "uv")
        info.vertex_out(interface)
    info.fragment_out(0, 'VEC4', "color")
    info.vertex_source(_DEPTH + _VERTEX if kind == 'CHOSEN' else _VERTEX)
    info.fragment_source(_FRAGMENT if kind == 'CHOSEN' else _DEPTH + _FRAGMENT)
    return gpu.shader.create_from_info(info)
