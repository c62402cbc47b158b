// SPDX-License-Identifier: GPL-3.0-or-later
// Functions that decide pixels, twins of native/device_cpu/vector_math.h: correctly rounded +, -, x only, in one written
// order. `precise` forbids contraction and reassociation, so that CPU widths and GL devices agree to the bit (SPEC 1).
#ifndef PT_MATH_GLSL
#define PT_MATH_GLSL

#include "shared/view.h"


uint pt_bits(float x) { return floatBitsToUint(x); }
float pt_float(uint u) { return uintBitsToFloat(u); }

float pt_max(float a, float b) { return a > b ? a : b; }
float pt_min(float a, float b) { return a < b ? a : b; }
float pt_abs(float x) { return pt_float(pt_bits(x) & 0x7FFFFFFFu); }

// 0 - x, whose zero is +0. Written out: Mesa makes -x of the difference, precise or not.
float pt_negate(float x) { return x == 0.0 ? 0.0 : -x; }

// 1 / x for normal x > 0, within 2 ulp: an integer seed (5% off) and three Newton steps.
float pt_rcp(float x)
{
    precise float r = pt_float(0x7EF311C7u - pt_bits(x));
    r = r * (2.0 - x * r);
    r = r * (2.0 - x * r);
    r = r * (2.0 - x * r);
    return r;
}

// 1 / sqrt(x) for normal x > 0, within 2 ulp: an integer seed (3.5% off) and three Newton steps.
float pt_rsqrt(float x)
{
    precise float h = 0.5 * x;
    precise float r = pt_float(0x5F375A86u - (pt_bits(x) >> 1));
    r = r * (1.5 - (h * r) * r);
    r = r * (1.5 - (h * r) * r);
    r = r * (1.5 - (h * r) * r);
    return r;
}

// log2(x) for normal x > 0, within 2e-7 and a rounding: the exponent, and a polynomial in the mantissa less 1, which lies
// between sqrt(1/2) and sqrt(2).
float pt_log2(float x)
{
    uint word = pt_bits(x) + (0x3F800000u - 0x3F3504F3u);
    precise float whole = float(int(word >> 23) - 127);
    precise float t = pt_float((word & 0x007FFFFFu) + 0x3F3504F3u) - 1.0;
    precise float p = t * -0.14973319 + 0.23570961;
    p = p * t + -0.24832283;
    p = p * t + 0.28686887;
    p = p * t + -0.36026347;
    p = p * t + 0.48093116;
    p = p * t + -0.72135246;
    p = p * t + 1.4426949;
    precise float sum = whole + p * t;
    return sum;
}

// 2^x for x within +-126, within 4e-7 of it.
float pt_exp2(float x)
{
    precise float whole = floor(x + 0.5);
    precise float t = x - whole;
    precise float p = t * 0.0013410005 + 0.009676036;
    p = p * t + 0.055502973;
    p = p * t + 0.24022107;
    p = p * t + 0.69314724;
    p = p * t + 1.0000001;
    precise float scaled = p * pt_float(uint(int(whole) + 127) << 23);
    return scaled;
}

// 4 ulp(z) for z >= 0 (0 at 0): the exponent alone, times 2^-21.
float pt_ulp4(float z)
{
    precise float u = pt_float(pt_bits(z) & 0x7F800000u) * 4.76837158203125e-7;
    return u;
}

// (a.x b.x + a.y b.y) + a.z b.z in this order.
float pt_dot(vec3 a, vec3 b)
{
    precise float d = (a.x * b.x + a.y * b.y) + a.z * b.z;
    return d;
}

// The octahedral normal of a surfel, not yet unit. The caller has excluded PT_NORMAL_NONE.
vec3 pt_decode_normal(uint word)
{
    const float step_size = 1.0 / 4095.0;
    precise float x = float(int(word & 0x1FFFu) - 4095) * step_size;
    precise float y = float(int((word >> 13) & 0x1FFFu) - 4095) * step_size;
    precise float z = (1.0 - pt_abs(x)) - pt_abs(y);
    precise float fold = pt_max(0.0 - z, 0.0); // the lower half is folded over the corners
    precise vec3 n = vec3(x >= 0.0 ? x - fold : x + fold, y >= 0.0 ? y - fold : y + fold, z);
    return n;
}

// Ray of the pixel (x, y) of this view's level: see struct view_args.
vec2 pt_ray(view_args view, int x, int y)
{
    precise float scale = float(1u << view.level);
    precise float px = (float((view.origin_x >> view.level) + x) + 0.5) * scale;
    precise float py = (float((view.origin_y >> view.level) + y) + 0.5) * scale;
    precise vec2 ray = vec2(view.ray_x0 + view.ray_xs * px, view.ray_y0 + view.ray_ys * py);
    return ray;
}

// 1 / length of the ray (u, v, -1).
float pt_ray_rsqrt(vec2 ray)
{
    precise float square = (ray.x * ray.x + ray.y * ray.y) + 1.0;
    return pt_rsqrt(square);
}

// |n . v| for a unit normal.
float pt_cosine(view_args view, vec3 n, vec2 ray)
{
    if (view.perspective == 0u)
        return pt_abs(n.z);
    precise float d = (n.x * ray.x + n.y * ray.y) - n.z;
    precise float c = pt_abs(d) * pt_ray_rsqrt(ray);
    return c;
}

// Width of a pixel of this view's level at z.
float pt_footprint(view_args view, float z)
{
    precise float width = view.footprint * float(1u << view.level);
    precise float scaled = width * z;
    return view.perspective != 0u ? scaled : width;
}

// max(d_min, thick, footprint, 4 ulp(z)) / max(|n.v|, C), given 1 / max(|n.v|, C).
float pt_distance_of(view_args view, float d_min, float thick, float footprint, float z, float inverse)
{
    precise float d = pt_max(d_min, thick);
    d = pt_max(d, footprint);
    d = pt_max(d, pt_ulp4(z));
    precise float scaled = d * inverse;
    return scaled;
}

// SPEC 1, effective layer distance of a point of which the spacing alone is known.
float pt_layer_distance(view_args view, float d_min, float spacing, float z, float inverse)
{
    precise float apart = PT_SPACING_FACTOR * spacing;
    return pt_distance_of(view, d_min, apart, pt_footprint(view, z), z, inverse);
}

// The same where sigma is known.
float pt_sure_distance(view_args view, float d_min, float sigma, float spacing, float z, float inverse)
{
    precise float most = PT_SPACING_FACTOR * spacing, sure = PT_SPACING_SURE * spacing, thick = PT_SIGMAS * sigma;
    precise float footprint = pt_footprint(view, z) * PT_FOOTPRINT_SURE;
    return pt_distance_of(view, d_min, pt_min(pt_max(thick, sure), most), footprint, z, inverse);
}

// What d_eff is not below at z. A cosine may be an ulp above 1.
float pt_least_distance(view_args view, float least, float share, float z)
{
    precise float footprint = pt_footprint(view, z) * share;
    return pt_max(least, footprint);
}

// d_eff at this view's level of the pixel whose surface comes from the measured pixel with these values.
float pt_level_distance(view_args view, float deff, float inverse, float z)
{
    precise float coarse = pt_footprint(view, z) * inverse;
    return view.level != 0u ? pt_max(deff, coarse) : deff;
}

// z at ray p of the plane with normal n through the point at (ray q, z_q), not nearer than z_q, not farther than
// z_q + limit. SPEC 2.2, refined filling.
float pt_plane_depth(view_args view, vec3 n, vec2 ray_q, float z_q, vec2 ray_p, float limit)
{
    precise float z = z_q;
    if (view.perspective != 0u) {
        precise float dot_q = (n.x * ray_q.x + n.y * ray_q.y) - n.z;
        precise float dot_p = (n.x * ray_p.x + n.y * ray_p.y) - n.z;
        float side = dot_p < 0.0 ? -1.0 : 1.0;
        float size = pt_abs(dot_p);
        precise float plane = (z_q * (dot_q * side)) * pt_rcp(size);
        if (size > 1e-6)
            z = plane;
    } else {
        float side = n.z < 0.0 ? -1.0 : 1.0;
        float size = pt_abs(n.z);
        precise float slope = n.x * (ray_p.x - ray_q.x) + n.y * (ray_p.y - ray_q.y);
        precise float plane = z_q + (slope * side) * pt_rcp(size);
        if (size > 1e-6)
            z = plane;
    }
    precise float farthest = z_q + limit;
    return pt_min(pt_max(z, z_q), farthest);
}

// Column and row of a pixel's index in a plane of this width (at most 2^22 rows): integer division costs llvmpipe 20
// times what this does. The float quotient is off by one at most.
uvec2 pt_pixel(uint index, uint width)
{
    uint row = uint(float(index) / float(width));
    int column = int(index - row * width);
    if (column < 0) {
        row--;
        column += int(width);
    } else if (column >= int(width)) {
        row++;
        column -= int(width);
    }
    return uvec2(uint(column), row);
}

// Which cell, of a level whose rows are `width` long, holds a pixel of level 0, whose rows are `from_width` long.
uint pt_cell_of(uint pixel, uint from_width, uint level, uint width)
{
    if (level == 0u)
        return pixel;
    uvec2 at = pt_pixel(pixel, from_width) >> level;
    return at.y * width + at.x;
}

// Bit i of white: ring neighbour i is white, counted anticlockwise. True when five (four) consecutive ones are.
bool pt_five_white(uint white)
{
    uint w = white | white << 8;
    return (w & w >> 1 & w >> 2 & w >> 3 & w >> 4 & 0xFFu) != 0u;
}

bool pt_four_white(uint white)
{
    uint w = white | white << 8;
    return (w & w >> 1 & w >> 2 & w >> 3 & 0xFFu) != 0u;
}

// Keys: x = id, y = bits of z; the lesser of two by z, then by id.
bool pt_key_less(uvec2 a, uvec2 b) { return a.y < b.y || (a.y == b.y && a.x < b.x); }

#endif
