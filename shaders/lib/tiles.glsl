// SPDX-License-Identifier: GPL-3.0-or-later
// Filters walk a list of tiles, 32 x 8 pixels each, counted from view.rect's corner: pt_gl_tiles lists those that hold
// something. A workgroup takes a tile and an invocation a column of it, so that what is read once a kernel is read once
// for eight pixels. (llvmpipe runs masked lanes to the end: leaving background out of the list is what skips it.)
#ifndef PT_TILES_GLSL
#define PT_TILES_GLSL

#include "lib/math.glsl"

#define PT_TILE_X 32u
#define PT_TILE_Y 8u

layout(local_size_x = 32) in;

layout(std430, binding = 11) readonly buffer tile_list_block { uint tile_list[]; };
layout(location = 14) uniform uint tile_count;   // in the list
layout(location = 15) uniform uint tile_columns; // tiles in a row of the rectangle

// The lowest pixel of this invocation's column; its rows end before pt_tile_end.
uvec2 pt_tile_column(view_args view)
{
    uint index = min(gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x, tile_count - 1u);
    uint tile = tile_list[index];
    uvec2 corner = pt_pixel(tile, tile_columns) * uvec2(PT_TILE_X, PT_TILE_Y);
    return uvec2(view.rect[0], view.rect[1]) + corner + uvec2(gl_LocalInvocationID.x, 0u);
}

// Where the column ends: at y itself for a column outside the rectangle.
uint pt_tile_end(view_args view, uvec2 column)
{
    return column.x < view.rect[2] ? min(column.y + PT_TILE_Y, view.rect[3]) : column.y;
}

#endif
