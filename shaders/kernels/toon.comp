// SPDX-License-Identifier: GPL-3.0-or-later
// toon: bands of light; twin of native/device_cpu/kernels/toon.c
#version 430 core
#include "lib/math.glsl"
#include "lib/planes.glsl"
#include "lib/tiles.glsl"

layout(std430, binding = 0) readonly buffer arguments_block { toon_args args; };
layout(std430, binding = 3) buffer color_block { vec4 color[]; };

float luminance(vec3 c)
{
    precise float sum = (0.2126 * c.x + 0.7152 * c.y) + 0.0722 * c.z;
    return sum;
}

// The light of a band, given the light.
float band_of(float light, float bands, float steepness, float inverse)
{
    precise float root = light * pt_rsqrt(pt_max(light, PT_TOON_DARK)); // as the eye has it
    precise float at = root * bands + 0.5;
    float whole = floor(at);
    precise float edge = pt_min(pt_max((at - whole - 0.5) * steepness + 0.5, 0.0), 1.0);
    edge = (edge * edge) * (3.0 - 2.0 * edge);
    precise float level = pt_max((whole - 0.5) + edge, 0.5) * inverse;
    precise float square = level * level;
    return square;
}

void main()
{
    view_args view = args.view;
    float bands = args.bands, steepness = args.steepness, inverse = args.inverse;
    uvec2 here = pt_tile_line(view);
    for (uint left = pt_tile_steps(view, here); left != 0u; left--, here += PT_STEP) {
        uint at = here.y * view.width + here.x;
        if (read_z_bits(at) == PT_KEY_EMPTY_Z)
            continue;
        vec3 albedo = read_float4(at).xyz;
        vec4 c = color[at];
        float own = luminance(albedo);
        if (!(own > PT_TOON_DARK)) // black has no light to be seen by
            continue;
        precise float light = luminance(c.xyz) * pt_rcp(own);
        float band = band_of(light, bands, steepness, inverse);
        precise vec3 banded = albedo * band;
        if (light > PT_TOON_DARK) {
            precise float ratio = band * pt_rcp(light);
            banded = c.xyz * ratio;
        }
        color[at] = vec4(banded, c.w);
    }
}
