// SPDX-License-Identifier: GPL-3.0-or-later
// shadow_test: points against the filled map of a light. [D 6], SPEC 4; twin of native/device_cpu/kernels/shadow_test.c
//
// A workgroup takes a chunk (or every gl_NumWorkGroups.y-th part of it). A word belongs to one point, so invocations never meet.
#version 430 core
#include "shared/shadows.h"
#include "shared/words.h"
#include "lib/planes.glsl"
#include "lib/points.glsl"
#include "lib/positions.glsl"
#include "lib/by_pixel.glsl"

layout(local_size_x = 64) in;

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { shadow_test_args args; };
layout(std430, binding = BIND_chunks) readonly buffer chunks_block { chunk_view chunks[]; };
layout(std430, binding = BIND_surfels) readonly buffer surfels_block { uint surfels[]; };
layout(std430, binding = BIND_marks) readonly buffer marks_block { uint marks[]; };
#include "lib/marks.glsl"
#include "lib/shadow_words.glsl"

layout(std430, binding = BIND_shadows) buffer shadows_block { uint words[]; };
layout(std430, binding = BIND_differs) buffer differs_block { uint differs[]; };

layout(std430, binding = BIND_opacities) readonly buffer opacities_block { uint opacities[]; };

layout(location = 0) uniform uint first_chunk; // of this dispatch
layout(location = 1) uniform uint first_slot;  // where the bound part of what points have begins

bool on_map(view_args view, int x, int y) { return x >= 0 && y >= 0 && x < int(view.width) && y < int(view.height); }

// The greatest depth of the 3 x 3 texels that is not beyond `last`: a surface of unknown slope may be as far as its neighbours.
float farthest(view_args view, int column, int row, float last)
{
    float most = 0.0;
    for (int y = row - 1; y <= row + 1; y++)
        for (int x = column - 1; x <= column + 1; x++) {
            float z = on_map(view, x, y) ? read_z(uint(y) * view.width + uint(x)) : pt_float(PT_KEY_EMPTY_Z);
            most = z < pt_float(PT_KEY_EMPTY_Z) && z <= last ? pt_max(most, z) : most;
        }
    return most;
}

// Whether one of the texels around shows nothing.
bool beside_nothing(view_args view, int column, int row)
{
    bool beside = false;
    for (int y = row - 1; y <= row + 1; y++)
        for (int x = column - 1; x <= column + 1; x++)
            beside = beside || ((x != column || y != row) && on_map(view, x, y) &&
                                pt_float(PT_KEY_EMPTY_Z) <= read_z(uint(y) * view.width + uint(x)));
    return beside;
}

// Whether enough of the texels around shadow the point, too.
bool supported(view_args view, int column, int row, float d, float z)
{
    uint count = 0u;
    for (int y = row - 1; y <= row + 1; y++)
        for (int x = column - 1; x <= column + 1; x++) {
            if ((x == column && y == row) || !on_map(view, x, y))
                continue;
            precise float until = read_z(uint(y) * view.width + uint(x)) + d;
            count += until < z ? 1u : 0u;
        }
    return count >= PT_SHADOW_SUPPORT;
}

// 2. d_eff of the point in this view; ray: where it falls.
float layer_distance(view_args view, vec2 ray, float z, uint id, out bool none)
{
    uint word = surfels[id - first_slot];
    vec3 object = pt_decode_normal(word), n;
    for (int k = 0; k < 3; k++)
        n[k] = pt_dot(vec3(args.instance.normal_matrix[3 * k], args.instance.normal_matrix[3 * k + 1],
                           args.instance.normal_matrix[3 * k + 2]), object);
    float square = pt_dot(n, n);
    none = args.instance.has_normals == 0u || (word & PT_NORMAL_BITS) == PT_NORMAL_NONE || !(1e-30 <= square);
    precise vec3 unit = n * pt_rsqrt(square);
    float inverse = pt_rcp(pt_max(pt_cosine(view, unit, ray), PT_COSINE_FLOOR));
    return pt_layer_distance(view, args.instance.d_min, args.instance.spacing[word >> PT_SPACING_SHIFT], z,
                             none ? 1.0 : inverse);
}

// pixel: of the map, where the point is.
bool in_shadow(view_args view, chunk_view chunk, uint i, out uint pixel)
{
    pixel = 0u;
    // 1. project
    uint id = chunk.first + i;
    vec3 p = pt_position(chunk.first - first_slot, chunk.padded, chunk.step, i);
    vec3 seen = pt_project(view, chunk, p);
    float x = seen.x, y = seen.y, z = seen.z;
    if (!(args.window[0] <= x && x < args.window[2] && args.window[1] <= y && y < args.window[3] && view.z_near <= z))
        return false;
    int column = int(floor(x)) - view.origin_x, row = int(floor(y)) - view.origin_y;
    pixel = uint(row) * view.width + uint(column);
    float map = read_z(pixel);
    // no d_eff is less than that of a surface without spacing that faces the light; a thousandth off for rounding
    precise float least = 0.999 * pt_layer_distance(view, args.instance.d_min, 0.0, z, 1.0);
    precise float nearest = map + least;
    if (!(nearest < z))
        return false;
    bool none;
    precise vec2 ray = vec2(view.ray_x0 + view.ray_xs * x, view.ray_y0 + view.ray_ys * y);
    precise float d = layer_distance(view, ray, z, id, none);
    precise float until = map + d;
    if (!(until < z))
        return false;
    if (none) {
        float shown = read_deff(read_from(pixel));
        precise float steep = d * PT_SHADOW_STEEP, last = map + PT_SHADOW_APART * shown;
        d = pt_max(beside_nothing(view, column, row) ? steep : d, shown);
        until = farthest(view, column, row, view.perspective != 0u ? last : pt_float(PT_KEY_EMPTY_Z)) + d;
    }
    return until < z && supported(view, column, row, d, z);
}

// 3. what the map takes of 255 from a point in the shadow of a texel.
uint loss_at(uint texel)
{
    if (args.faint == 0u)
        return args.loss;
    uint id = pt_place_of(read_key(texel).x - args.caster, texel);
    return pt_shadow_share(args.loss, opacities[id >> 2] >> 8u * (id & 3u) & 255u);
}

// 4. what the sample takes goes into the word. Returns whether the samples so far differ.
bool note(uint at, uint loss)
{
    bool differ;
    words[at] = pt_shadow_note(words[at], loss, args.alone != 0u || args.close != 0u, args.samples, differ);
    return differ;
}

void main()
{
    chunk_view chunk = chunks[first_chunk + gl_WorkGroupID.x];
    view_args view = args.view;
    precise float wider = view.footprint * PT_TEXEL_SLACK;
    view.footprint = wider;
    bool all = args.close != 0u || args.compare != 0u; // lit points have to be looked at too
    uint stride = gl_WorkGroupSize.x * gl_NumWorkGroups.y;
    for (uint i = gl_WorkGroupID.y * gl_WorkGroupSize.x + gl_LocalInvocationID.x; i < chunk.count; i += stride) {
        uint id = chunk.first + i;
        if (args.marked != 0u && !pt_is_shown(id))
            continue;
        uint pixel;
        bool shadowed = in_shadow(view, chunk, i, pixel);
        if ((all || shadowed) && note(args.base + pt_word_at(args.marked, args.step, id), shadowed ? loss_at(pixel) : 0u) && args.compare != 0u)
            differs[0] = 1u;
    }
}
