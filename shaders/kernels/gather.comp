// SPDX-License-Identifier: GPL-3.0-or-later
// gather: soft points of an instance -> records, lit: what their balls on screen are made of. SPEC 5, soft; twin of
// native/device_cpu/kernels/gather.c
//
// A workgroup takes a chunk (or every gl_NumWorkGroups.y-th part of it). COLOR_FORMAT, OPACITY, LIT, CASTING and DIRECTED are as in
// shade.comp.
#version 430 core
#include "shared/balls.h"
#include "lib/math.glsl"
#include "lib/positions.glsl"
#include "lib/srgb.glsl"

layout(local_size_x = 64) in;

layout(std430, binding = BIND_arguments) readonly buffer arguments_block {
    shade_args args; // struct gather_args
    uint threshold;
    float weight, radius_scale, opacity_scale;
    uint within, sifted, whole, radius_base, radius_step;
};
layout(std430, binding = BIND_points) writeonly buffer points_block { vec4 records[]; };
layout(std430, binding = BIND_chunks) readonly buffer chunks_block { chunk_view chunks[]; };
layout(std430, binding = BIND_surfels) readonly buffer surfels_block { uint surfels[]; };
layout(std430, binding = BIND_field) readonly buffer field_block { uint field[]; };
layout(std430, binding = BIND_colors) readonly buffer colors_block { uint point_colors[]; };
layout(std430, binding = BIND_opacities) readonly buffer opacities_block { uint opacities[]; }; // four bytes a word
layout(std430, binding = BIND_shadows) readonly buffer shadows_block { uint shadows[]; };
layout(std430, binding = BIND_drawn) readonly buffer drawn_block { uint drawn[]; };

layout(location = 0) uniform uint first_chunk; // of this dispatch
layout(location = 1) uniform uint first_slot;  // where the bound part of what points have begins

#define POINT_COLOR(i) point_colors[i]
#define LIGHTS args.light_count
#define PLAIN 0
#include "lib/albedo.glsl"
#include "lib/phong.glsl"
#include "lib/recolor.glsl"

struct point {
    float x, y, z, radius; // as in a record; before it has a place, the point's own
    float opacity;
    uint f, id, slot; // slot: of the bound part
};

// What its word holds; whether it is soft.
bool read_word(uint word, inout point p)
{
    uint steps = whole != 0u ? word : word & PT_FIELD_RADIUS;
    p.f = whole != 0u ? uint(PT_FIELD_MOST) : word >> PT_FIELD_SHIFT;
    p.radius = pt_float(steps == 0u ? 0u : radius_base + steps * radius_step);
    return threshold < p.f;
}

// 1. Where it lies, and whether it is soft, drawn and in view.
bool place(chunk_view chunk, uint i, inout point p)
{
    view_args view = args.view;
    vec3 q = pt_position(chunk.first - first_slot, chunk.padded, chunk.step, i);
    precise float x = (((chunk.lo[0] + chunk.row[0] * q.x) + chunk.row[1] * q.y) + chunk.row[2] * q.z) + chunk.hi[0];
    precise float y = (((chunk.lo[1] + chunk.row[3] * q.x) + chunk.row[4] * q.y) + chunk.row[5] * q.z) + chunk.hi[1];
    precise float z = (((chunk.lo[2] + chunk.row[6] * q.x) + chunk.row[7] * q.y) + chunk.row[8] * q.z) + chunk.hi[2];
    precise float own = p.radius * radius_scale;
    own = pt_min(own, PT_SOFT_WIDEST);
    precise float least = pt_footprint(view, z) * PT_SOFT_LEAST;
    float radius = pt_max(own, least), reach = within != 0u ? radius : 0.0;
    precise float farther = z + reach, nearer = z - reach;
    bool some = view.z_near <= farther && nearer <= view.z_far && pt_abs(x) <= PT_SOFT_FARTHEST && pt_abs(y) <= PT_SOFT_FARTHEST &&
                0.0 < radius;
    if (sifted != 0u && chunk.sifted != 0u)
        some = some && (drawn[chunk.sifted - 1u + i / PT_SLOTS_A_WORD] >> i % PT_SLOTS_A_WORD & 1u) != 0u;
    precise float share = own * pt_rcp(some ? radius : 1.0);
    precise float opacity = opacity_scale * (share * share);
    p.x = x;
    p.y = y;
    p.z = z;
    p.radius = radius;
    p.opacity = opacity;
    return some;
}

// 2. Its light.
vec3 light(point p)
{
    view_args view = args.view;
    vec3 style = vec3(args.instance.color[0], args.instance.color[1], args.instance.color[2]);
    vec3 color = pt_gather_albedo(style, p.slot, 0u);
    bool before = PT_SOFT_BEFORE < p.z;
    precise vec2 ray = vec2(p.x, p.y);
    if (view.perspective != 0u)
        ray = ray * pt_rcp(before ? p.z : 1.0);
    ray = vec2(view.ray_x0 + view.ray_xs * ray.x, view.ray_y0 + view.ray_ys * ray.y);
    if (view.perspective != 0u && !before)
        ray = vec2(0.0);
    if (args.recolor.source != 0u || args.recolor.graded != 0u)
        color = recolor(view, args.eye_z, ray, p.z, style, color);
#if LIT
    uint word = surfels[p.slot];
    vec3 object = pt_decode_normal(word), n;
    for (int k = 0; k < 3; k++)
        n[k] = pt_dot(vec3(args.instance.normal_matrix[3 * k], args.instance.normal_matrix[3 * k + 1],
                           args.instance.normal_matrix[3 * k + 2]), object);
    float square = pt_dot(n, n);
    bool known = (word & PT_NORMAL_BITS) != PT_NORMAL_NONE && 1e-20 < square;
    precise vec3 unit = n * pt_rsqrt(known ? square : 1.0);
    float shadow;
    color = phong(view, args.eye_z, vec3(args.instance.ambient, args.instance.diffuse, args.instance.specular), args.instance.shininess,
                  p.id, args.instance.slots, pixel(p.z, ray, known ? unit : vec3(0.0, 0.0, 1.0), color), shadow);
#endif
    return color;
}

float opacity_of(uint slot)
{
#if OPACITY
    uint value = (opacities[slot >> 2] >> (8u * (slot & 3u))) & 255u;
    precise float opacity = args.instance.opacity * (float(value) * 0.00392156885936856); // 1 / 255
    return opacity;
#else
    return args.instance.opacity;
#endif
}

// 3. W of [S Eq. 22] in the lowest byte, and opacity above it.
uint amount(uint f, float opacity)
{
    precise float share = 1.0;
    if (weight > 0.0) {
        precise float above = float(f - threshold) * weight;
        share = pt_min(pt_max(above, 0.0), 1.0);
    }
    precise float low = share * 255.0 + 0.5;
    precise float steps = pt_min(pt_max(opacity, 0.0), 1.0) * PT_SOFT_STEPS + 0.5;
    return uint(pt_min(steps, PT_SOFT_STEPS)) << PT_SOFT_SHIFT | uint(low);
}

void main()
{
    chunk_view chunk = chunks[first_chunk + gl_WorkGroupID.x];
    float none = pt_float(PT_KEY_EMPTY_Z);
    uint stride = gl_WorkGroupSize.x * gl_NumWorkGroups.y;
    for (uint i = gl_WorkGroupID.y * gl_WorkGroupSize.x + gl_LocalInvocationID.x; i < chunk.padded; i += stride) {
        vec4 first = vec4(none), second = vec4(none);
        point p;
        p.id = chunk.first + i;
        p.slot = p.id - first_slot;
        if (i < chunk.count && read_word(field[p.slot], p) && place(chunk, i, p)) {
            precise float opacity = p.opacity * opacity_of(p.slot);
            uint word = amount(p.f, opacity);
            if (word >> PT_SOFT_SHIFT != 0u) {
                first = vec4(p.x, p.y, p.z, p.radius);
                second = vec4(light(p), pt_float(word));
            }
        }
        uint to = (PT_SOFT_WORDS / 4u) * (chunk.record + i);
        records[to] = first;
        records[to + 1u] = second;
    }
}
