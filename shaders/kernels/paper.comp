// SPDX-License-Identifier: GPL-3.0-or-later
// paper: tint and grain over the picture; twin of native/device_cpu/kernels/paper.c
#version 430 core
#include "lib/math.glsl"

layout(local_size_x = 32, local_size_y = 8) in;

layout(std430, binding = 0) readonly buffer arguments_block { paper_args args; };
layout(std430, binding = 1) buffer combined_block { vec4 combined[]; };

// 0..1 of a place.
float hash(uint x, uint y)
{
    uint word = x * 0x9E3779B1u + y * 0x85EBCA77u;
    word = (word ^ word >> 15) * 0x2C1B3C6Du;
    word = (word ^ word >> 12) * 0x297A2D39u;
    return float(int((word ^ word >> 15) >> 8)) * 5.9604644775390625e-8; // 2^-24
}

// Hashes of a lattice 8 pixels wide, blended between its nodes.
float noise(uint x, uint y)
{
    uint cx = x >> 3, cy = y >> 3;
    precise float u = (float(int(x & 7u)) + 0.5) * 0.125, v = (float(int(y & 7u)) + 0.5) * 0.125;
    float a = hash(cx, cy), b = hash(cx + 1u, cy), c = hash(cx, cy + 1u), d = hash(cx + 1u, cy + 1u);
    precise float low = a + u * (b - a), high = c + u * (d - c);
    precise float value = low + v * (high - low);
    return value;
}

void main()
{
    uint x = gl_GlobalInvocationID.x, y = gl_GlobalInvocationID.y;
    if (x >= args.crop_width || y >= args.crop_height)
        return;
    precise float grain = 0.5 * hash(args.x + x, args.y + y) + 0.5 * noise(args.x + x, args.y + y);
    precise float light = 1.0 - args.grain * grain;
    uint at = y * args.crop_width + x;
    vec4 c = combined[at];
    precise vec3 tinted = c.xyz * (vec3(args.color[0], args.color[1], args.color[2]) * light);
    combined[at] = vec4(tinted, c.w);
}
