// SPDX-License-Identifier: GPL-3.0-or-later
// average: points about the surface -> mean colour and normal of the pixels that show it; twin of
// native/device_cpu/kernels/average.c
//
// Over a band of rows, as many as the sums have room for. STEP 0: points are added up; STEP 1: means.
#version 430 core
#include "shared/means.h"
#include "shared/words.h"
#include "lib/planes.glsl"
#include "lib/points.glsl"
#include "lib/positions.glsl"
#include "lib/by_pixel.glsl"
#include "lib/srgb.glsl"

#if STEP == 0
layout(local_size_x = 64) in;
#else
layout(local_size_x = 32, local_size_y = 8) in;
#endif

#define SUMS 8u // colour 3, weight, normal 3, nothing: two words each, the low one first

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { average_args args; };
layout(std430, binding = BIND_sums) buffer sums_block { uint sums[]; };
layout(std430, binding = BIND_chunks) readonly buffer chunks_block { chunk_view chunks[]; };
layout(std430, binding = BIND_surfels) readonly buffer surfels_block { uint surfels[]; };
layout(std430, binding = BIND_drawn) readonly buffer drawn_block { uint drawn[]; };
layout(std430, binding = BIND_colors) readonly buffer colors_block { uint point_colors[]; };
layout(std430, binding = BIND_normal) buffer normal_block { vec4 normal[]; };
layout(std430, binding = BIND_albedo) writeonly buffer albedo_block { vec4 albedo[]; };

layout(location = 0) uniform uint first_chunk; // of this dispatch
layout(location = 1) uniform uint first_slot;  // where the bound part of what points have begins
layout(location = 3) uniform int band_first;
layout(location = 4) uniform int band_end;

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

bool is_ours(uvec2 key) { return key.y != PT_KEY_EMPTY_Z && (key.x - args.instance.id_base) - args.instance.id_first < args.instance.id_count; }

#if STEP == 0

// The point's unit normal, towards the viewer; 0 where it has none.
vec3 turned_normal(view_args view, uint word, float x, float y)
{
    if (args.normals == 0u || (word & PT_NORMAL_BITS) == PT_NORMAL_NONE)
        return vec3(0.0);
    vec3 object = pt_decode_normal(word);
    precise vec3 n;
    for (int k = 0; k < 3; k++) {
        precise float row = (args.instance.normal_matrix[3 * k] * object.x + args.instance.normal_matrix[3 * k + 1] * object.y) +
                            args.instance.normal_matrix[3 * k + 2] * object.z;
        n[k] = row;
    }
    float square = pt_dot(n, n);
    if (!(1e-20 < square))
        return vec3(0.0);
    float scale = pt_rsqrt(square);
    precise float facing = 0.0 - n.z;
    if (view.perspective != 0u) {
        precise float u = view.ray_x0 + view.ray_xs * x;
        precise float v = view.ray_y0 + view.ray_ys * y;
        facing = (n.x * u + n.y * v) - n.z;
    }
    precise vec3 unit = n * scale;
    return 0.0 < facing ? vec3(pt_negate(unit.x), pt_negate(unit.y), pt_negate(unit.z)) : unit;
}

float clamped(float c) { return pt_max(pt_min(c, PT_SUM_BRIGHTEST), -PT_SUM_BRIGHTEST); }

void add(uint at, float weight, float term)
{
    precise float product = term * weight;
    int value = int(product);
    if (value == 0)
        return;
    uint before = atomicAdd(sums[at], uint(value));
    uint high = (value < 0 ? 0xFFFFFFFFu : 0u) + (before + uint(value) < before ? 1u : 0u);
    if (high != 0u)
        atomicAdd(sums[at + 1u], high);
}

void main()
{
    chunk_view chunk = chunks[first_chunk + gl_WorkGroupID.x];
    view_args view = args.view;
    float left = float(view.origin_x), right = float(view.origin_x + int(view.width));
    float bottom = float(view.origin_y), top = float(view.origin_y + int(view.height));
    uint base = chunk.first - first_slot;
    uint stride = gl_WorkGroupSize.x * gl_NumWorkGroups.y;

    for (uint i = gl_WorkGroupID.y * gl_WorkGroupSize.x + gl_LocalInvocationID.x; i < chunk.count; i += stride) {
        // 1. where the point lies, and how far its tent reaches
        vec3 p = pt_position(base, chunk.padded, chunk.step, i);
        vec3 seen = pt_project(view, chunk, p);
        float x = seen.x, y = seen.y, z = seen.z;
        if (!(view.z_near <= z && z <= view.z_far && left <= x && x < right && bottom <= y && y < top))
            continue;
        if (args.sifted != 0u && chunk.sifted != 0u &&
            (drawn[chunk.sifted - 1u + i / PT_SLOTS_A_WORD] >> i % PT_SLOTS_A_WORD & 1u) == 0u)
            continue;
        uint slot = base + i, word = surfels[slot];
        if (chunk.cull != 0u && pt_faces_away(chunk, word, p))
            continue;
        float footprint = pt_footprint(view, z);
        precise float h = (PT_AVERAGE_TENT * args.instance.spacing[word >> PT_SPACING_SHIFT]) * pt_rcp(footprint);
        h = pt_max(pt_min(h, PT_AVERAGE_WIDEST), 1.0);
        float share = h > 1.0 ? pt_rcp(h) : 1.0;
        precise float across = x - 0.5, up = y - 0.5;
        precise float low_x = across - h, high_x = across + h, low_y = up - h, high_y = up + h;
        int first_x = max(int(floor(low_x)) + 1 - view.origin_x, 0);
        int last_x = min(int(floor(high_x)) - view.origin_x, int(view.width) - 1);
        int first_y = max(int(floor(low_y)) + 1 - view.origin_y, band_first);
        int last_y = min(int(floor(high_y)) - view.origin_y, band_end - 1);
        // 2. what it adds at weight 1
        precise vec3 color = albedo_of(slot);
        color = vec3(clamped(color.x), clamped(color.y), clamped(color.z)) * PT_SUM_SCALE;
        precise vec3 n = turned_normal(view, word, x, y) * PT_SUM_SCALE;
        // 3. to the pixels within whose surface is as deep
        for (int py = first_y; py <= last_y; py++)
            for (int px = first_x; px <= last_x; px++) {
                uint pixel = uint(py) * view.width + uint(px);
                uvec2 key = read_key(pixel);
                if (!is_ours(key))
                    continue;
                float d = read_deff(read_from(pixel)), own = pt_float(key.y);
                precise float nearest = own - d, farthest = own + d;
                if (!(nearest <= z && z <= farthest))
                    continue;
                precise float beside = (float(view.origin_x + px) + 0.5) - x, above = (float(view.origin_y + py) + 0.5) - y;
                precise float wide = 1.0 - pt_abs(beside) * share, tall = 1.0 - pt_abs(above) * share;
                precise float weight = pt_max(tall, 0.0) * pt_max(wide, 0.0);
                uint to = 2u * SUMS * (pixel - uint(band_first) * view.width);
                add(to, weight, color.x);
                add(to + 2u, weight, color.y);
                add(to + 4u, weight, color.z);
                add(to + 6u, weight, PT_SUM_SCALE);
                if (args.normals != 0u) {
                    add(to + 8u, weight, n.x);
                    add(to + 10u, weight, n.y);
                    add(to + 12u, weight, n.z);
                }
            }
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

// On the side that the pixel's own normal lies on.
vec3 mean_normal(view_args view, vec3 sum, int x, int y, vec3 n)
{
    float square = pt_dot(sum, sum);
    if (!(1.0 <= square))
        return n;
    precise vec3 mean = sum * pt_rsqrt(square);
    precise float facing = 0.0 - n.z;
    if (view.perspective != 0u) {
        vec2 ray = pt_ray(view, x, y);
        facing = (n.x * ray.x + n.y * ray.y) - n.z;
    }
    return 0.0 < facing ? vec3(pt_negate(mean.x), pt_negate(mean.y), pt_negate(mean.z)) : mean;
}

void main()
{
    view_args view = args.view;
    int x = int(gl_GlobalInvocationID.x), y = int(gl_GlobalInvocationID.y) + band_first;
    if (uint(x) >= view.width || y >= band_end)
        return;
    uint pixel = uint(y) * view.width + uint(x), at = 2u * SUMS * (pixel - uint(band_first) * view.width);
    uvec2 key = read_key(pixel);
    if (!is_ours(key))
        return;
    float weight = sum_of(at + 6u);
    bool reached = 1.0 <= weight;
    vec3 color = albedo_of(pt_place_of(key.x - args.instance.id_base, pixel));
    if (reached) {
        precise vec3 mean = vec3(sum_of(at), sum_of(at + 2u), sum_of(at + 4u)) * pt_rcp(weight);
        color = mean;
    }
    albedo[pixel] = vec4(color, 1.0);
    if (args.normals != 0u && reached && read_from(pixel) == pixel)
        normal[pixel].xyz = mean_normal(view, vec3(sum_of(at + 8u), sum_of(at + 10u), sum_of(at + 12u)), x, y, normal[pixel].xyz);
}

#endif
