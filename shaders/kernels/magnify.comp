// SPDX-License-Identifier: GPL-3.0-or-later
// magnify: faces between cells -> pixels of the picture that show them [K II.D]; twin of
// native/device_cpu/kernels/magnify.c
#version 430 core
#include "shared/ranges.h"
#include "lib/ranges.glsl"
#include "lib/planes.glsl"

layout(local_size_x = 32, local_size_y = 8) in;

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { magnify_args args; };
layout(std430, binding = BIND_inclined) readonly buffer inclined_block { vec4 inclined[]; };
layout(std430, binding = BIND_keys) buffer keys_block { uvec2 keys[]; };
layout(std430, binding = BIND_from) writeonly buffer from_block { uint from[]; };
layout(std430, binding = BIND_normal) writeonly buffer normal_block { vec4 normals[]; };
layout(std430, binding = BIND_deff) writeonly buffer deff_block { float deff[]; };
layout(std430, binding = BIND_albedo) writeonly buffer albedo_block { vec4 albedo[]; };
layout(std430, binding = BIND_away) buffer away_block { float away_from[]; };
layout(std430, binding = BIND_span) writeonly buffer span_block { float span[]; };
layout(std430, binding = BIND_limit) readonly buffer limit_block { float limit[]; };

layout(std430, binding = BIND_most) readonly buffer most_block { float most_of[]; };
layout(std430, binding = BIND_apart) writeonly buffer apart_block { float apart_of[]; };

// Cells that may be corners of a face over a pixel: 3 x 3, row by row.
vec2 corner[9]; // from the pixel's centre, in cells
float depth[9], factor[9]; // 1 / z, or 1 in orthographic views
uint there = 0u; // bits: some drivers over Vulkan take no arrays of bool
uint cell_of[9];

// The nearest face.
bool found = false;
float best_z = 0.0;
vec3 best_weight = vec3(0.0); // shares
ivec3 best = ivec3(0);        // of those around

float step_from(float z) { return pt_range_step(args.cells, args.gamma, args.gamma_cells, z); }

void look_around(uint x, uint y)
{
    view_args view = args.view;
    precise float px = (float(int(x) + view.origin_x) + 0.5) * args.inverse, py = (float(int(y) + view.origin_y) + 0.5) * args.inverse;
    float column = floor(px), row = floor(py);
    precise float across = px - column, up = py - row;
    int cx = int(column) - args.cells.origin_x, cy = int(row) - args.cells.origin_y;
    for (int k = 0; k < 9; k++) {
        int dx = k % 3 - 1, dy = k / 3 - 1;
        cell_of[k] = uint(cy + dy) * args.cells.width + uint(cx + dx);
        vec4 place = vec4(0.0);
        if (pt_range_inside(args.cells, cx + dx, cy + dy))
            place = read_float4(cell_of[k]);
        bool here = 0.0 < place.w;
        there |= here ? 1u << k : 0u;
        precise vec2 at = vec2((float(dx) + place.x) - across, (float(dy) + place.y) - up);
        corner[k] = at;
        depth[k] = here ? place.z : 1.0;
        factor[k] = view.perspective != 0u ? pt_rcp(depth[k]) : 1.0;
    }
}

bool is_there(int k) { return (there >> k & 1u) != 0u; }
bool all_there(ivec3 k) { return is_there(k.x) && is_there(k.y) && is_there(k.z); }
float nearest_of(ivec3 k) { return pt_min(pt_min(depth[k.x], depth[k.y]), depth[k.z]); }
float farthest_of(ivec3 k) { return pt_max(pt_max(depth[k.x], depth[k.y]), depth[k.z]); }

// Whether three corners are there and within a step.
bool joined(ivec3 k)
{
    precise float deep = farthest_of(k) - nearest_of(k);
    return all_there(k) && deep <= step_from(nearest_of(k));
}

// Twice the area between the pixel's centre and two corners: a swap turns its sign, exactly.
float edge(int a, int b)
{
    precise float area = corner[a].x * corner[b].y - corner[a].y * corner[b].x;
    return area;
}

// Takes a triangle where it is nearer. edges: opposite each corner. apart: corners that are not joined to the farthest weigh nothing.
void take(ivec3 k, vec3 edges, bool apart)
{
    bool left = 0.0 <= edges.x && 0.0 <= edges.y && 0.0 <= edges.z, right = edges.x <= 0.0 && edges.y <= 0.0 && edges.z <= 0.0;
    if (!left && !right)
        return;
    float nearest = nearest_of(k), farthest = farthest_of(k);
    precise vec3 weight;
    for (int i = 0; i < 3; i++) {
        precise float w = pt_abs(edges[i]) * factor[k[i]];
        precise float deep = farthest - depth[k[i]];
        weight[i] = apart && !(deep <= step_from(depth[k[i]])) ? 0.0 : w;
    }
    precise float sum = (weight.x + weight.y) + weight.z;
    if (!(1e-30 < sum))
        return;
    float share = pt_rcp(sum);
    precise float z = ((weight.x * depth[k.x] + weight.y * depth[k.y]) + weight.z * depth[k.z]) * share;
    z = pt_min(pt_max(z, nearest), farthest);
    if (found && !(z < best_z))
        return;
    found = true;
    best_z = z;
    precise vec3 shares = weight * share;
    best_weight = shares;
    best = k;
}

// The faces between 2 x 2 cells, `a` the lower left one; apart: between cells that are not joined.
void take_faces(int a, bool apart)
{
    int b = a + 1, d = a + 3, e = a + 4; // a b below, d e above
    ivec3 triples[4] = ivec3[](ivec3(a, b, d), ivec3(b, e, d), ivec3(a, b, e), ivec3(a, e, d));
    uint fits = 0u; // bits
    for (int t = 0; t < 4; t++) {
        bool fit = joined(triples[t]);
        if (apart)
            fit = all_there(triples[t]) && !fit;
        fits |= fit ? 1u << t : 0u;
    }
    if (fits == 0u)
        return;
    float nearest = pt_min(pt_min(depth[a], depth[b]), pt_min(depth[d], depth[e]));
    precise float deep = pt_max(pt_max(depth[a], depth[b]), pt_max(depth[d], depth[e])) - nearest;
    bool whole = fits == 15u && deep <= step_from(nearest);
    precise float falls = depth[b] - depth[d], rises = depth[a] - depth[e];
    bool falling = pt_abs(falls) <= pt_abs(rises); // divided from b to d
    float ab = edge(a, b), be = edge(b, e), ed = edge(e, d), da = edge(d, a), bd = edge(b, d), ae = edge(a, e);
    float db = pt_negate(bd), ea = pt_negate(ae);
    vec3 edges[4] = vec3[](vec3(bd, da, ab), vec3(ed, db, be), vec3(be, ea, ab), vec3(ed, da, ae));
    for (int t = 0; t < 4; t++)
        if ((fits >> t & 1u) != 0u && (!whole || (t < 2) == falling))
            take(triples[t], edges[t], apart);
}

bool in_pixel(int k)
{
    precise vec2 at = corner[k] * args.pixel;
    return -0.5 <= at.x && at.x < 0.5 && -0.5 <= at.y && at.y < 0.5;
}

// Where no face is: the nearest cell whose place lies in the pixel.
void take_places()
{
    for (int k = 0; k < 9; k++)
        if (is_there(k) && in_pixel(k) && (!found || depth[k] < best_z)) {
            found = true;
            best_z = depth[k];
            best_weight = vec3(1.0, 0.0, 0.0);
            best = ivec3(k);
        }
}

// Of the first of two passes.
bool unsharp(int k, bool loose, uint x, uint y)
{
    vec4 normal = inclined[cell_of[k]];
    return loose || normal.w < 8.0 || args.most < read_float4(cell_of[k]).w ||
           pt_cosine(args.view, normal.xyz, pt_ray(args.view, int(x), int(y))) < args.cosine;
}

void main()
{
    view_args view = args.view;
    uint x = view.rect[0] + gl_GlobalInvocationID.x, y = view.rect[1] + gl_GlobalInvocationID.y;
    if (x >= view.rect[2] || y >= view.rect[3])
        return;
    uint at = y * view.width + x;
    look_around(x, y);
    for (int k = 0; k < 4; k++)
        take_faces(k % 2 + 3 * (k / 2), false);
    bool loose = !found;
    if (!found && (args.pass & PT_RANGE_FINE) == 0u)
        take_places();
    if (!found)
        for (int k = 0; k < 4; k++)
            take_faces(k % 2 + 3 * (k / 2), true);
    uvec2 before = keys[at];
    bool own = (args.pass & PT_RANGE_FINE) != 0u && before.y < PT_KEY_EMPTY_Z && (before.x - args.id_base) - args.id_first < args.id_count;
    if (own) { // what may take the place of what is there, whose mark is taken away
        float mark = away_from[at], z = pt_float(before.y), most = step_from(z);
        precise float unmarked = -1.0 - mark, nearer = z - most, near = z + most;
        if (mark < 0.0)
            away_from[at] = unmarked;
        if (!(best_z < nearer) && !(mark < 0.0 && best_z <= near))
            return;
    }
    if (!found)
        return;
    // 1. the corner that weighs most, whose point the pixel is of
    int which = best.x;
    float most = best_weight.x;
    for (int i = 1; i < 3; i++)
        if (most < best_weight[i]) {
            most = best_weight[i];
            which = best[i];
        }
    uvec2 key = uvec2(read_key(cell_of[which]).x, pt_bits(best_z));
    // 2. before what is there
    if (!(own || pt_key_less(key, before)) || (args.behind != 0u && !(limit[at] < best_z)))
        return;
    // 3. what it shows
    precise vec3 n = inclined[cell_of[best.x]].xyz * best_weight.x;
    precise vec4 color = texelFetch(other_float4_plane, int(cell_of[best.x])) * best_weight.x;
    for (int i = 1; i < 3; i++) {
        n = n + inclined[cell_of[best[i]]].xyz * best_weight[i];
        color = color + texelFetch(other_float4_plane, int(cell_of[best[i]])) * best_weight[i];
    }
    float square = pt_dot(n, n);
    precise vec3 unit = inclined[cell_of[best.x]].xyz;
    if (1e-6 < square)
        unit = n * pt_rsqrt(square);
    float inverse = pt_rcp(pt_max(pt_cosine(view, unit, pt_ray(view, int(x), int(y))), PT_COSINE_FLOOR));
    precise float wide = 2.0 * pt_footprint(args.cells, best_z);
    float thick = pt_max(pt_range_gamma(args.cells, args.gamma, args.gamma_cells, best_z), wide);
    float distance = pt_distance_of(view, args.d_min, thick, pt_footprint(view, best_z), best_z, inverse);
    precise vec2 off = corner[which] * args.pixel;
    precise float far = off.x * off.x + off.y * off.y;
    precise float away = far * pt_rsqrt(pt_max(far, 1e-12));
    keys[at] = key;
    from[at] = at;
    normals[at] = vec4(unit, inverse);
    albedo[at] = vec4(color.xyz, pt_min(color.w, 1.0));
    deff[at] = distance;
    away = in_pixel(which) ? 0.0 : away;
    if ((args.pass & PT_RANGE_COARSE) != 0u && unsharp(which, loose, x, y))
        away = -1.0 - away;
    away_from[at] = away;
    if (args.with_span != 0u)
        span[at] = distance;
    if (args.with_apart != 0u) {
        precise float apart = most_of[cell_of[which]] - read_float(cell_of[which]);
        apart_of[at] = pt_max(apart, 0.0);
    }
}
