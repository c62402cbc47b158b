// SPDX-License-Identifier: GPL-3.0-or-later
// blend: normal and colour of the discs that lie on the nearest surface of each pixel, or which they are, or the light that arrives at
// them. SPEC 5, solid; twin of native/device_cpu/kernels/blend.c
//
// Over a band of rows, as many as the sums have room for. STEP 0: discs are added up; STEP 1: means. PART: see PT_BLEND_*; of
// marks there are no means.
#version 430 core

#include "shared/measured.h"

#if STEP == 0
layout(local_size_x = 64) in;
#else
layout(local_size_x = 32, local_size_y = 8) in;
#endif

// Colour 3, opacity, normal 3, weight: two words each, the low one first; with depths, weight and share of the reach. Of light: what
// PT_BLEND_LIGHTS lights lose, and opacity.
#define SUMS (args.depths != 0u ? 10u : 8u)

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { blend_args args; disc_args discs[]; };
layout(std430, binding = BIND_sums) buffer sums_block { uint sums[]; };
#if PART == PT_BLEND_COLORS
layout(std430, binding = BIND_colors) readonly buffer colors_block { uint point_colors[]; };
#elif PART == PT_BLEND_MARKS
layout(std430, binding = BIND_colors) buffer colors_block { uint marks[]; };
#else
layout(std430, binding = BIND_colors) readonly buffer colors_block { uint words[]; };
#if STEP == 0
layout(std430, binding = BIND_marks) readonly buffer marks_block { uint marks[]; };
#include "lib/marks.glsl"
#endif
#endif
layout(std430, binding = BIND_opacities) readonly buffer opacities_block { uint opacities[]; }; // four bytes a word
#if PART == PT_BLEND_LIGHT
layout(std430, binding = BIND_albedo) writeonly buffer albedo_block { uint lost[]; }; // of each light, a plane
#else
layout(std430, binding = BIND_albedo) writeonly buffer albedo_block { vec4 albedo[]; };
#endif
layout(std430, binding = BIND_away) writeonly buffer away_block { float away_from[]; }; // how many pixels the key's point fell away

#if STEP == 1
layout(std430, binding = BIND_normal) buffer normal_block { vec4 normal[]; };
layout(std430, binding = BIND_offset) writeonly buffer offset_block { float offset_of[]; };
#endif

layout(location = 3) uniform int band_first;
layout(location = 4) uniform int band_end;

#include "lib/math.glsl"
#include "lib/planes.glsl"
#if STEP == 0
#include "lib/disc.glsl"
#include "lib/srgb.glsl"
#endif

// How far behind the nearest disc depths are averaged.
float reach_of(uint pixel)
{
    precise float reach = read_deff(pixel) * PT_DISC_DEPTHS;
    return pt_max(pt_min(reach, PT_DISC_MOST), PT_DISC_LEAST);
}

#if STEP == 0

#if PART == PT_BLEND_COLORS
vec3 albedo_of(uint id)
{
    uint format = discs[instance].instance.color_format;
    if (format == 2u)
        return vec3(uintBitsToFloat(point_colors[3u * id]), uintBitsToFloat(point_colors[3u * id + 1u]),
                    uintBitsToFloat(point_colors[3u * id + 2u]));
    if (format == 1u) { // three bytes from byte 3 id on: they lie in one word or two
        uint first = 3u * id, shift = 8u * (first & 3u);
        uint low = point_colors[first >> 2], high = point_colors[(first + 2u) >> 2];
        uint bytes = low >> shift | (shift > 8u ? high << (32u - shift) : 0u);
        return vec3(pt_srgb(bytes & 255u), pt_srgb((bytes >> 8) & 255u), pt_srgb((bytes >> 16) & 255u));
    }
    return vec3(discs[instance].instance.color[0], discs[instance].instance.color[1], discs[instance].instance.color[2]);
}
#endif

float opacity_of(uint id)
{
    float opacity = discs[instance].instance.opacity;
    if (discs[instance].instance.has_opacities == 0u)
        return opacity;
    uint byte_value = (opacities[id >> 2] >> (8u * (id & 3u))) & 255u;
    precise float product = opacity * (float(byte_value) * 0.00392156885936856); // 1 / 255
    return product;
}

void add(uint at, float weight, float term)
{
    precise float product = term * weight;
    int value = int(product);
    uint before = atomicAdd(sums[at], uint(value));
    uint high = (value < 0 ? 0xFFFFFFFFu : 0u) + (before + uint(value) < before ? 1u : 0u);
    if (high != 0u)
        atomicAdd(sums[at + 1u], high);
}

// What a point's disc adds at weight 1.
#if PART == PT_BLEND_COLORS
struct look {
    vec4 color; // w: opacity
    vec3 n;
};
#elif PART == PT_BLEND_MARKS
struct look {
    uint mark; // of its point, in its word
};
#else
struct look {
    float lost[PT_BLEND_LIGHTS], opaque;
};
#endif

void add_depth(view_args view, disc d, uint pixel, int x, int y, float nearest, float z, float square, bool beside)
{
    float reach = reach_of(pixel);
    precise float farthest = nearest + reach;
    if (!(nearest <= z && z <= farthest))
        return;
    float weight = disc_weight(view, d, x, y, square, beside);
    uint at = 2u * SUMS * (pixel - uint(band_first) * view.width) + 16u;
    precise float share = ((z - nearest) * pt_rcp(reach)) * weight;
    add(at, weight, PT_SUM_SCALE);
    add(at + 2u, share, PT_SUM_SCALE);
}

#if PART == PT_BLEND_COLORS
void add_look(uint at, float weight, look l)
{
    add(at, weight, l.color.x);
    add(at + 2u, weight, l.color.y);
    add(at + 4u, weight, l.color.z);
    add(at + 6u, weight, l.color.w);
    add(at + 8u, weight, l.n.x);
    add(at + 10u, weight, l.n.y);
    add(at + 12u, weight, l.n.z);
    add(at + 14u, weight, PT_SUM_SCALE);
}
#elif PART == PT_BLEND_LIGHT
void add_look(uint at, float weight, look l)
{
    for (uint k = 0u; k < args.lights; k++)
        add(at + 2u * k, weight, l.lost[k]);
    add(at + 14u, weight, l.opaque);
}
#endif

void add_pixel(view_args view, disc d, uint id, int x, int y, look l)
{
    float z, square;
    bool beside;
    uint pixel = uint(y) * view.width + uint(x);
    uvec2 key = read_key(pixel);
    if (!disc_pixel(view, d, x, y, z, square, beside))
        return;
    precise float farthest = pt_float(key.y) + read_deff(pixel);
    if (key.y == PT_KEY_EMPTY_Z)
        return;
    if (args.depths != 0u)
        add_depth(view, d, pixel, x, y, pt_float(key.y), z, square, beside);
    if (!(pt_float(key.y) <= z && z <= farthest))
        return;
#if PART == PT_BLEND_MARKS
    atomicOr(marks[2u * (d.id / PT_MARK_SLOTS)], l.mark);
#else
#if PART == PT_BLEND_COLORS
    if (key.x == id) {
        precise float dx = float(x - d.own.x), dy = float(y - d.own.y);
        precise float away = dx * dx + dy * dy;
        precise float distance_to = away * pt_rsqrt(pt_max(away, 1.0));
        away_from[pixel] = distance_to;
    }
#endif
    float weight = disc_weight(view, d, x, y, square, beside);
    add_look(2u * SUMS * (pixel - uint(band_first) * view.width), weight, l);
#endif
}

#if PART == PT_BLEND_LIGHT
look look_of(disc d)
{
    look l;
    precise float opaque = opacity_of(d.id - first_slot) * PT_SUM_SCALE;
    l.opaque = opaque;
    bool shadowed = discs[instance].shadowed != 0u;
    uint stride = discs[instance].instance.slots, word = d.id;
    if (shadowed && args.marked != 0u) {
        stride = 1u;
        word = args.step * pt_shown_place(d.id);
    }
    for (uint k = 0u; k < PT_BLEND_LIGHTS; k++) {
        bool known = k < args.lights && shadowed;
        uint at = (args.first + k) * stride + word;
        precise float share = known ? float(words[at] & PT_SHADOW_SUM) * args.scales[k] : 0.0;
        precise float lost = pt_min(share, 1.0) * opaque;
        l.lost[k] = lost;
    }
    return l;
}
#elif PART == PT_BLEND_MARKS
look look_of(disc d) { return look(discs[instance].shadowed << d.id % PT_MARK_SLOTS); }
#else
look look_of(disc d)
{
    vec3 rgb = albedo_of(d.id - first_slot);
    precise float opacity = opacity_of(d.id - first_slot) * PT_SUM_SCALE;
    precise vec4 color = vec4(pt_max(pt_min(rgb.x, PT_SUM_BRIGHTEST), -PT_SUM_BRIGHTEST) * opacity,
                              pt_max(pt_min(rgb.y, PT_SUM_BRIGHTEST), -PT_SUM_BRIGHTEST) * opacity,
                              pt_max(pt_min(rgb.z, PT_SUM_BRIGHTEST), -PT_SUM_BRIGHTEST) * opacity, opacity);
    precise vec3 n = d.n * PT_SUM_SCALE;
    return look(color, n);
}
#endif

// Its box in the band.
ivec4 box_of(disc d) { return ivec4(d.box.x, max(d.box.y, band_first), d.box.z, min(d.box.w, band_end - 1)); }

#if LARGE == 0

void main()
{
    uint at = first_chunk + gl_WorkGroupID.x;
    chunk_view chunk = chunks[at];
    view_args view = args.view;
    uint stride = gl_WorkGroupSize.x * gl_NumWorkGroups.y;
    for (uint i = gl_WorkGroupID.y * gl_WorkGroupSize.x + gl_LocalInvocationID.x; i < chunk.count; i += stride) {
        disc d;
        if (!disc_of(view, chunk, i, d))
            continue;
        ivec4 box = box_of(d);
        if (disc_listed(box, at, i))
            continue;
        look l = look_of(d);
        for (int y = box.y; y <= box.w; y++)
            for (int x = box.x; x <= box.z; x++)
                add_pixel(view, d, chunk.id_base + d.id, x, y, l);
    }
}

#else

void main()
{
    uint at, part;
    if (!disc_large(at, part))
        return;
    chunk_view chunk = chunks[large[2u * at]];
    view_args view = args.view;
    disc d;
    if (!disc_of(view, chunk, large[2u * at + 1u], d))
        return;
    ivec4 box = box_of(d);
    look l = look_of(d);
    ivec2 own = ivec2(gl_LocalInvocationID.x & 7u, 8u * part + (gl_LocalInvocationID.x >> 3));
    for (int y = box.y + own.y; y <= box.w; y += 8 * int(parts))
        for (int x = box.x + own.x; x <= box.z; x += 8)
            add_pixel(view, d, chunk.id_base + d.id, x, y, l);
}

#endif

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

// The instance that a point is a disc of, or args.instances. No return from within the loop: llvmpipe loses lanes that do not.
uint instance_of(uint id)
{
    uint at = args.instances;
    for (uint i = 0u; i < args.instances; i++)
        at = (id - discs[i].instance.id_base) - discs[i].instance.id_first < discs[i].instance.id_count ? i : at;
    return at;
}

// The mean normal, on the side that the nearest disc's lies on.
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
    uint of = instance_of(key.x);
    if (key.y == PT_KEY_EMPTY_Z || of == args.instances)
        return;
#if PART == PT_BLEND_LIGHT
    precise float inverse = pt_rcp(pt_max(sum_of(at + 14u), 1.0));
    for (uint k = 0u; k < args.lights; k++) {
        precise float mean = pt_min(sum_of(at + 2u * k) * inverse, 1.0) * float(PT_SHADOW_SUM) + 0.5;
        lost[(args.first + k) * view.width * view.height + pixel] = uint(mean);
    }
#else
    if (args.depths != 0u) {
        float weights = sum_of(at + 16u);
        precise float mean = (sum_of(at + 18u) * pt_rcp(pt_max(weights, 1.0))) * reach_of(pixel);
        offset_of[pixel] = weights < 1.0 ? 0.0 : mean;
    }
    float opacity = sum_of(at + 6u), weight = pt_max(sum_of(at + 14u), 1.0);
    vec3 color = vec3(0.0);
    if (1.0 <= opacity) {
        precise vec3 mean = vec3(sum_of(at), sum_of(at + 2u), sum_of(at + 4u)) * pt_rcp(opacity);
        color = mean;
    }
    precise float share = opacity * pt_rcp(weight);
    albedo[pixel] = vec4(color, opacity < weight ? pt_min(share, 1.0) : 1.0); // opaque: 1 exactly
    if (discs[of].instance.has_normals != 0u)
        normal[pixel].xyz = mean_normal(view, vec3(sum_of(at + 8u), sum_of(at + 10u), sum_of(at + 12u)), x, y, normal[pixel].xyz);
#endif
}

#endif
