// SPDX-License-Identifier: GPL-3.0-or-later
// Makes the lists of tiles that filters walk (lib/tiles.glsl, native/device_gl/tiles.c).
//   STEP 0: what each tile holds;   STEP 1: the lists; an invocation a tile
#version 430 core

#include "shared/view.h"

#define HOLDS_POINTS 1u
#define HOLDS_NOTHING 2u
#define TILE 8u

layout(local_size_x = 32) in;

layout(binding = UNIT_key) uniform usamplerBuffer key_plane;
layout(std430, binding = BIND_tiles) buffer tiles_block { uint tiles[]; };
layout(std430, binding = BIND_lists) buffer lists_block { uint lists[]; }; // with points; `stride` on, with a hole's rim

#define HEAD 4u // words of a list before its entries; its length is the last

layout(location = 0) uniform uvec4 rect;
layout(location = 1) uniform uint width;
layout(location = 2) uniform uvec2 size; // in tiles
layout(location = 3) uniform uint stride;

#if STEP == 0

void main()
{
    uvec2 tile = uvec2(gl_GlobalInvocationID.x, gl_WorkGroupID.y);
    uvec2 first = rect.xy + tile * TILE, last = min(first + TILE, rect.zw) - 1u;
    uint holds = 0u, y = first.y;
    if (tile.x >= size.x)
        return;
    do {
        for (uint i = 0u; i < TILE; i++)
            holds |= texelFetch(key_plane, int(y * width + min(first.x + i, last.x))).y != PT_KEY_EMPTY_Z ? HOLDS_POINTS
                                                                                                        : HOLDS_NOTHING;
    } while (++y <= last.y);
    tiles[tile.y * size.x + tile.x] = holds;
}

#else

void main()
{
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    uint tile = group * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
    if (tile >= size.x * size.y)
        return;
    int tx = int(tile % size.x), ty = int(tile / size.x);
    uint holds = tiles[tile], around = 0u;
    for (int y = ty - 1; y <= ty + 1; y++)
        for (int x = tx - 1; x <= tx + 1; x++) // beyond the rectangle: unknown
            around |= x < 0 || y < 0 || x >= int(size.x) || y >= int(size.y) ? HOLDS_POINTS
                                                                            : tiles[uint(y) * size.x + uint(x)];
    if ((holds & HOLDS_POINTS) != 0u)
        lists[HEAD + atomicAdd(lists[HEAD - 1u], 1u)] = tile;
    if ((holds & HOLDS_NOTHING) != 0u && (around & HOLDS_POINTS) != 0u)
        lists[stride + HEAD + atomicAdd(lists[stride + HEAD - 1u], 1u)] = tile;
}

#endif
