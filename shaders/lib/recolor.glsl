// SPDX-License-Identifier: GPL-3.0-or-later
// Colours of points from a ramp, exposure and contrast: a step of shade and gather; twin of native/device_cpu/kernels/recolor.h.
// Include it behind args, a struct shade_args.
#ifndef PT_RECOLOR_GLSL
#define PT_RECOLOR_GLSL

#include "shared/colors.h"

layout(std430, binding = BIND_ramps) readonly buffer ramps_block { float ramps[]; };

// Where a pixel lies on the ramp.
float place_on_ramp(view_args view, float eye_z, vec2 ray, float z, float scalar)
{
    float zero = args.recolor.zero, slope = args.recolor.along[0];
    precise float depth = z + eye_z;
    if (args.recolor.source == PT_RAMP_SCALAR || args.recolor.source == PT_RAMP_TRUST) {
        precise float t = (scalar - zero) * slope;
        return t;
    }
    if (args.recolor.source == PT_RAMP_DISTANCE) {
        precise float square = (ray.x * ray.x + ray.y * ray.y) + 1.0;
        precise float slant = z * (square * pt_rsqrt(square));
        precise float t = ((view.perspective != 0u ? slant : depth) - zero) * slope;
        return t;
    }
    precise vec2 across = view.perspective != 0u ? z * ray : ray;
    precise float along = slope * across.x + args.recolor.along[1] * across.y;
    precise float t = (along - args.recolor.along[2] * depth) + zero;
    return t;
}

// Of a word of shapes.
float trust_of_word(uint word)
{
    precise float doubt = float(15u - (word >> PT_SHAPE_TRUST_SHIFT & 15u));
    precise float trust = (225.0 - doubt * doubt) * PT_TRUST_STEP;
    return trust;
}

vec3 ramp_entry(uint i)
{
    uint at = 3u * (args.recolor.first + i);
    return vec3(ramps[at], ramps[at + 1u], ramps[at + 2u]);
}

vec3 ramp_color(float t)
{
    precise float at = pt_min(pt_max(t, 0.0), 1.0) * float(args.recolor.entries - 1u);
    float low = pt_min(floor(at), float(args.recolor.entries - 2u));
    precise float share = at - low;
    vec3 from = ramp_entry(uint(low)), to = ramp_entry(uint(low) + 1u);
    precise vec3 color = from + share * (to - from);
    return color;
}

float graded(float color)
{
    precise float c = color * args.recolor.gain;
    if (args.recolor.contrast != 1.0) {
        precise float stops = pt_log2(pt_max(c, 1e-30) * (1.0 / PT_MID_GREY)) * args.recolor.contrast;
        precise float power = pt_exp2(pt_min(pt_max(stops, -126.0), 126.0)) * PT_MID_GREY;
        c = 1e-30 < c ? power : 0.0;
    }
    return pt_max(pt_min(c, PT_BRIGHTEST), -PT_BRIGHTEST);
}

// In: the point's own colour; where scalars or words of shapes are the ramp's source, this in x.
vec3 recolor(view_args view, float eye_z, vec2 ray, float z, vec3 style, vec3 color)
{
    if (args.recolor.source != 0u) {
        if (args.recolor.source == PT_RAMP_TRUST)
            color.x = trust_of_word(pt_bits(color.x));
        bool nothing = args.recolor.source == PT_RAMP_SCALAR && (pt_bits(color.x) & 0x7FFFFFFFu) > 0x7F800000u;
        color = nothing ? style : ramp_color(place_on_ramp(view, eye_z, ray, z, color.x));
    }
    if (args.recolor.graded != 0u)
        color = vec3(graded(color.x), graded(color.y), graded(color.z));
    return color;
}

#endif
