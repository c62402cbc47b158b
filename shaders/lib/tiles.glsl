// SPDX-License-Identifier: GPL-3.0-or-later
// Filters walk tiles, 8 x 8 pixels each, counted from view.rect's corner. In software they walk a list of those that hold something, which
// pt_gl_tiles makes: llvmpipe runs masked lanes to the end, so that only the list skips background. On a GPU they walk all tiles, since a
// list takes longer than the tiles that it saves. A workgroup takes four tiles and an invocation a line of one, so that what is read once
// a kernel is read once for eight pixels.
#ifndef PT_TILES_GLSL
#define PT_TILES_GLSL

#include "lib/math.glsl"
#include "lib/planes.glsl"

#define PT_TILE 8u
#define PT_TILES_IN_GROUP 4u

#ifdef PT_TILE_COLUMNS // of finer pixels
layout(local_size_x = 64) in;
#else
layout(local_size_x = 32) in; // four tiles' lines
#endif

#ifdef PT_SOFTWARE
layout(std430, binding = BIND_tile_list) readonly buffer tile_list_block {
    uint tile_groups[3], tile_count; // the list's head
    uint tile_list[];
};
layout(location = 13) uniform uint first_group;  // of this dispatch, where a long list takes several
layout(location = 15) uniform uint tile_columns; // tiles in a row of the rectangle
#else
const uint first_group = 0u;
#endif

// Column and row of the tile that comes at `index`. False: there are no more.
bool pt_tile_at(uvec4 rect, uint index, out uvec2 tile)
{
#ifdef PT_SOFTWARE
    tile = pt_pixel(tile_list[min(index, tile_count - 1u)], tile_columns);
    return index < tile_count;
#else
    uvec2 tiles = (rect.zw - rect.xy + (PT_TILE - 1u)) / PT_TILE;
    tile = pt_pixel(index, tiles.x);
    return index < tiles.x * tiles.y;
#endif
}

uint pt_tile_group() { return (first_group + gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * PT_TILES_IN_GROUP; }

// The first pixel of this invocation's line; the others follow PT_STEP apart.
uvec2 pt_tile_line(view_args view)
{
    uint lane = gl_LocalInvocationID.x;
    uvec2 tile;
    bool there = pt_tile_at(uvec4(view.rect[0], view.rect[1], view.rect[2], view.rect[3]), pt_tile_group() + lane / PT_TILE, tile);
    uvec2 line = uvec2(view.rect[0], view.rect[1]) + tile * PT_TILE + lane % PT_TILE * PT_ACROSS;
    return there ? line : uvec2(view.rect[2], view.rect[3]); // beyond the last: an empty line
}

// How many pixels of the line lie in the rectangle.
uint pt_tile_steps(view_args view, uvec2 line)
{
    uvec2 left = uvec2(view.rect[2], view.rect[3]) - min(line, uvec2(view.rect[2], view.rect[3]));
    return left.x != 0u && left.y != 0u ? min(PT_TILE, left.x * PT_STEP.x + left.y * PT_STEP.y) : 0u;
}

#endif
