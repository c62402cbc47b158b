// SPDX-License-Identifier: GPL-3.0-or-later
// merge: points of an image buffer's cells -> their mean place, colour and opacity [K II.B]; twin of
// native/device_cpu/kernels/merge.c
#version 430 core
#include "shared/ranges.h"
#include "shared/words.h"
#include "lib/math.glsl"
#include "lib/srgb.glsl"

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { merge_args args; };
layout(std430, binding = BIND_colors) readonly buffer colors_block { uint point_colors[]; };
layout(std430, binding = BIND_opacities) readonly buffer opacities_block { uint opacities[]; }; // four bytes a word
layout(std430, binding = BIND_place) writeonly buffer place_block { vec4 place[]; };
layout(std430, binding = BIND_merged) writeonly buffer merged_block { vec4 merged[]; };

#include "lib/cells.glsl"

// Of a cell: weight, place across and up, share of the depth, colour 3, opacity.
#if STEP == 0

vec3 albedo_of(uint id)
{
    uint format = args.instance.color_format;
    if (format == 2u)
        return vec3(uintBitsToFloat(point_colors[3u * id]), uintBitsToFloat(point_colors[3u * id + 1u]),
                    uintBitsToFloat(point_colors[3u * id + 2u]));
    if (format == 1u) { // three bytes from byte 3 id on: they lie in one word or two
        uint first = 3u * id, shift = 8u * (first & 3u);
        uint low = point_colors[first >> 2], high = point_colors[(first + 2u) >> 2];
        uint bytes = low >> shift | (shift > 8u ? high << (32u - shift) : 0u);
        return vec3(pt_srgb(bytes & 255u), pt_srgb((bytes >> 8) & 255u), pt_srgb((bytes >> 16) & 255u));
    }
    return vec3(args.instance.color[0], args.instance.color[1], args.instance.color[2]);
}

float opacity_of(uint id)
{
    if (args.instance.has_opacities == 0u)
        return args.instance.opacity;
    uint byte_value = opacities[id >> 2] >> (8u * (id & 3u)) & 255u;
    precise float product = args.instance.opacity * (float(byte_value) * 0.00392156885936856); // 1 / 255
    return product;
}

float clamped(float c) { return pt_max(pt_min(c, PT_SUM_BRIGHTEST), -PT_SUM_BRIGHTEST); }

void main()
{
    chunk_view chunk = chunks[first_chunk + gl_WorkGroupID.x];
    uint stride = gl_WorkGroupSize.x * gl_NumWorkGroups.y;
    pt_cell_point point;

    for (uint i = gl_WorkGroupID.y * gl_WorkGroupSize.x + gl_LocalInvocationID.x; i < chunk.count; i += stride) {
        if (!pt_point_of(chunk, i, point))
            continue;
        precise float weight = pt_max(1.0 - point.behind * pt_rcp(point.gamma), 0.0) * PT_SUM_SCALE;
        precise float share = pt_min(point.behind * pt_rcp(reach_of(args.view, point.gamma, point.nearest)), 1.0);
        precise float opaque = opacity_of(point.slot) * weight;
        vec3 color = albedo_of(point.slot);
        precise vec3 shown = vec3(clamped(color.x), clamped(color.y), clamped(color.z)) * opaque;
        precise float across = weight * (point.x - floor(point.x)), up = weight * (point.y - floor(point.y)), deep = weight * share;
        add(point.at, weight);
        add(point.at + 2u, across);
        add(point.at + 4u, up);
        add(point.at + 6u, deep);
        add(point.at + 8u, shown.x);
        add(point.at + 10u, shown.y);
        add(point.at + 12u, shown.z);
        add(point.at + 14u, opaque);
    }
}

#else

void main()
{
    view_args view = args.view;
    uint x = view.rect[0] + gl_GlobalInvocationID.x;
    int y = int(gl_GlobalInvocationID.y) + band_first;
    if (x >= view.rect[2] || y >= band_end)
        return;
    uint cell = uint(y) * view.width + x, at = 2u * SUMS * (cell - uint(band_first) * view.width);
    uint bits = read_z_bits(cell);
    bool some = bits < PT_KEY_EMPTY_Z;
    float nearest = some ? pt_float(bits) : 1.0, total = sum_of(at), opaque = sum_of(at + 14u);
    float weight = pt_max(total, 1.0), inverse = pt_rcp(weight);
    float reach = reach_of(view, gamma_of(view, nearest), nearest);
    precise float across = sum_of(at + 2u) * inverse, up = sum_of(at + 4u) * inverse;
    precise float z = nearest + (sum_of(at + 6u) * inverse) * reach, points = total * (1.0 / PT_SUM_SCALE);
    place[cell] = vec4(across, up, z, some ? points : 0.0);
    precise vec3 color = vec3(0.0);
    if (1.0 <= opaque)
        color = vec3(sum_of(at + 8u), sum_of(at + 10u), sum_of(at + 12u)) * pt_rcp(opaque);
    precise float share = opaque * inverse;
    merged[cell] = vec4(color, opaque < weight ? pt_min(share, 1.0) : 1.0); // opaque: 1 exactly
}

#endif
