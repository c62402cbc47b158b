// SPDX-License-Identifier: GPL-3.0-or-later
// merge: points of an image buffer's cells -> their mean place, colour and opacity [K II.B]; twin of
// native/device_cpu/kernels/merge.c
//
// Over a band of rows, as many as the sums have room for. STEP 0: points are added up; STEP 1: means.
#version 430 core
#include "lib/ranges.glsl"
#include "lib/planes.glsl"
#include "lib/srgb.glsl"

#if STEP == 0
layout(local_size_x = 64) in;
#else
layout(local_size_x = 32, local_size_y = 8) in;
#endif

#define SUMS 8u // weight, place across and up, share of the depth, colour 3, opacity: two words each, the low one first

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { merge_args args; };
layout(std430, binding = BIND_sums) buffer sums_block { uint sums[]; };
layout(std430, binding = BIND_chunks) readonly buffer chunks_block { chunk_view chunks[]; };
layout(std430, binding = BIND_positions) readonly buffer positions_block { float positions[]; };
layout(std430, binding = BIND_surface) readonly buffer surface_block { uint surface[]; };
layout(std430, binding = BIND_drawn) readonly buffer drawn_block { uint drawn[]; };
layout(std430, binding = BIND_colors) readonly buffer colors_block { uint point_colors[]; };
layout(std430, binding = BIND_opacities) readonly buffer opacities_block { uint opacities[]; }; // four bytes a word
layout(std430, binding = BIND_place) writeonly buffer place_block { vec4 place[]; };
layout(std430, binding = BIND_merged) writeonly buffer merged_block { vec4 merged[]; };

layout(location = 0) uniform uint first_chunk; // of this dispatch
layout(location = 1) uniform uint first_slot;  // where the bound part of positions begins
layout(location = 3) uniform int band_first;
layout(location = 4) uniform int band_end;

float gamma_of(view_args view, float z) { return pt_range_gamma(view, args.gamma, args.gamma_cells, z); }

// What depths of a cell's points are told in parts of.
float reach_of(view_args view, float gamma, float z)
{
    precise float deepest = PT_RANGE_DEEPEST * pt_footprint(view, z);
    return pt_min(gamma, pt_max(deepest, PT_RANGE_LEAST));
}

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

bool faces_away(uint word, vec4 eye, vec3 p)
{
    if ((word & PT_NORMAL_BITS) == PT_NORMAL_NONE)
        return false;
    precise vec3 v = eye.xyz - eye.w * p;
    return pt_dot(pt_decode_normal(word), v) <= 0.0;
}

void add(uint at, float term)
{
    int value = int(term);
    if (value == 0)
        return;
    uint before = atomicAdd(sums[at], uint(value));
    uint high = (value < 0 ? 0xFFFFFFFFu : 0u) + (before + uint(value) < before ? 1u : 0u);
    if (high != 0u)
        atomicAdd(sums[at + 1u], high);
}

float clamped(float c) { return pt_max(pt_min(c, PT_SUM_BRIGHTEST), -PT_SUM_BRIGHTEST); }

void main()
{
    chunk_view chunk = chunks[first_chunk + gl_WorkGroupID.x];
    view_args view = args.view;
    vec3 row_x = vec3(chunk.row[0], chunk.row[1], chunk.row[2]);
    vec3 row_y = vec3(chunk.row[3], chunk.row[4], chunk.row[5]);
    vec3 row_z = vec3(chunk.row[6], chunk.row[7], chunk.row[8]);
    vec4 eye = vec4(chunk.eye[0], chunk.eye[1], chunk.eye[2], chunk.eye[3]);
    float left = float(view.origin_x), right = float(view.origin_x + int(view.width));
    float bottom = float(view.origin_y + band_first), top = float(view.origin_y + band_end);
    uint base = 3u * (chunk.first - first_slot);
    uint stride = gl_WorkGroupSize.x * gl_NumWorkGroups.y;

    for (uint i = gl_WorkGroupID.y * gl_WorkGroupSize.x + gl_LocalInvocationID.x; i < chunk.count; i += stride) {
        // 1. where the point lies
        uint at = base + i;
        vec3 p = vec3(positions[at], positions[at + chunk.padded], positions[at + 2u * chunk.padded]);
        precise float z = (((chunk.lo[2] + row_z.x * p.x) + row_z.y * p.y) + row_z.z * p.z) + chunk.hi[2];
        precise float x = (((chunk.lo[0] + row_x.x * p.x) + row_x.y * p.y) + row_x.z * p.z) + chunk.hi[0];
        precise float y = (((chunk.lo[1] + row_y.x * p.x) + row_y.y * p.y) + row_y.z * p.z) + chunk.hi[1];
        if (view.perspective != 0u) {
            float r = pt_rcp(z);
            x = x * r;
            y = y * r;
        }
        if (!(view.z_near <= z && z <= view.z_far && left <= x && x < right && bottom <= y && y < top))
            continue;
        if (args.sifted != 0u && chunk.sifted != 0u &&
            (drawn[chunk.sifted - 1u + i / PT_SLOTS_A_WORD] >> i % PT_SLOTS_A_WORD & 1u) == 0u)
            continue;
        uint id = chunk.first + i;
        if (chunk.cull != 0u && faces_away(surface[id], eye, p))
            continue;
        // 2. on the nearest surface of its cell
        float column = floor(x), row = floor(y);
        uint cell = uint(int(row) - view.origin_y) * view.width + uint(int(column) - view.origin_x);
        float nearest = read_z(cell), gamma = gamma_of(view, nearest);
        precise float behind = pt_abs(z) - nearest;
        if (!(0.0 <= behind && behind <= gamma))
            continue;
        // 3. what it adds
        precise float weight = pt_max(1.0 - behind * pt_rcp(gamma), 0.0) * PT_SUM_SCALE;
        precise float share = pt_min(behind * pt_rcp(reach_of(view, gamma, nearest)), 1.0);
        precise float opaque = opacity_of(id) * weight;
        vec3 color = albedo_of(id);
        precise vec3 shown = vec3(clamped(color.x), clamped(color.y), clamped(color.z)) * opaque;
        precise float across = weight * (x - column), up = weight * (y - row), deep = weight * share;
        uint to = 2u * SUMS * (cell - uint(band_first) * view.width);
        add(to, weight);
        add(to + 2u, across);
        add(to + 4u, up);
        add(to + 6u, deep);
        add(to + 8u, shown.x);
        add(to + 10u, shown.y);
        add(to + 12u, shown.z);
        add(to + 14u, opaque);
    }
}

#else

// A sum as a float, in steps that are the same everywhere.
float sum_of(uint at)
{
    uint low = sums[at], high = sums[at + 1u];
    bool negative = (high & 0x80000000u) != 0u;
    if (negative) {
        high = ~high + (low == 0u ? 1u : 0u);
        low = 0u - low;
    }
    precise float value = float(high) * 4294967296.0 + float(low);
    return negative ? -value : value;
}

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
