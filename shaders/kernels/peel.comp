// SPDX-License-Identifier: GPL-3.0-or-later
// peel: a finished layer is blended behind those before it, and says what may show behind it. [D 4, 5], SPEC 3; twin of
// native/device_cpu/kernels/peel.c. A workgroup is a tile.
#version 430 core
#include "shared/colors.h"
#include "lib/math.glsl"
#include "lib/planes.glsl"

layout(local_size_x = 16, local_size_y = 16) in; // 2^PT_TILE_LEVEL

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { peel_args args; };
layout(std430, binding = BIND_keys) buffer keys_block { uvec2 keys[]; };
layout(std430, binding = BIND_limit) buffer limit_block { float limit[]; };
layout(std430, binding = BIND_through) buffer through_block { float through[]; };
layout(std430, binding = BIND_over) buffer over_block { vec4 over[]; };
layout(std430, binding = BIND_tiles) writeonly buffer tiles_block { uvec2 tiles[]; };

shared uint least; // bits of a float >= 0 order as the float does
shared uint covered;

void peel_pixel(uint at, bool first, bool stop)
{
    const float finished = pt_float(PT_KEY_EMPTY_Z);
    uvec2 key = read_key(at);
    float z = pt_float(key.y), before = first ? -1.0 : limit[at], beyond = before;
    bool some = key.y != PT_KEY_EMPTY_Z, behind = some && before < z;
    // 1. filled across a layer already taken
    if (some && !behind)
        keys[at] = uvec2(PT_KEY_EMPTY_ID, PT_KEY_EMPTY_Z);
    // 2. behind what was blended before
    vec4 sum = first && args.inked == 0u ? vec4(0.0) : over[at];
    if (behind) {
        precise vec4 more = sum + (1.0 - sum.w) * texelFetch(other_float4_plane, int(at));
        sum = more;
    }
    if (behind || first)
        over[at] = sum;
    // 3. what comes through, and from where on
    float light = first ? 1.0 : through[at];
    if (behind) {
        precise float less = light * (1.0 - read_float4(at).w);
        precise float next = z + read_deff(read_from(at));
        light = less;
        beyond = stop && light < PT_SPENT ? finished : next;
    }
    beyond = some ? beyond : finished;
    through[at] = light;
    limit[at] = beyond;
    // 4. of the tile
    if (beyond < finished)
        atomicMin(least, pt_bits(beyond));
    if (behind)
        atomicAdd(covered, 1u);
}

void main()
{
    uint width = args.view.width;
    uvec4 rect = uvec4(args.view.rect[0], args.view.rect[1], args.view.rect[2], args.view.rect[3]);
    bool first = args.first != 0u, stop = args.stop != 0u;
    uvec2 tile = (rect.xy >> PT_TILE_LEVEL) + gl_WorkGroupID.xy;
    uvec2 pixel = (tile << PT_TILE_LEVEL) + gl_LocalInvocationID.xy;
    if (gl_LocalInvocationIndex == 0u) {
        least = PT_KEY_EMPTY_Z;
        covered = 0u;
    }
    barrier();
    if (pixel.x >= rect.x && pixel.x < rect.z && pixel.y >= rect.y && pixel.y < rect.w)
        peel_pixel(pixel.y * width + pixel.x, first, stop);
    barrier();
    uint columns = (width + (1u << PT_TILE_LEVEL) - 1u) >> PT_TILE_LEVEL;
    if (gl_LocalInvocationIndex == 0u)
        tiles[tile.y * columns + tile.x] = uvec2(least, covered);
}
