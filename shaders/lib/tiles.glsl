// SPDX-License-Identifier: GPL-3.0-or-later
// Filters walk a list of tiles, 8 x 8 pixels each, counted from view.rect's corner: pt_gl_tiles lists those that hold
// something. A workgroup takes four tiles and an invocation a column of one, so that what is read once a kernel is read
// once for eight pixels. (llvmpipe runs masked lanes to the end: leaving background out of the list is what skips it.)
#ifndef PT_TILES_GLSL
#define PT_TILES_GLSL

#include "lib/math.glsl"

#define PT_TILE 8u
#define PT_TILES_IN_GROUP 4u

#ifdef PT_TILE_COLUMNS // of finer pixels
layout(local_size_x = 64) in;
#else
layout(local_size_x = 32) in; // four tiles' columns
#endif

layout(std430, binding = 11) readonly buffer tile_list_block { uint tile_list[]; };
layout(location = 14) uniform uint tile_count;   // in the list
layout(location = 15) uniform uint tile_columns; // tiles in a row of the rectangle

// The lowest pixel of this invocation's column; its rows end before pt_tile_end.
uvec2 pt_tile_column(view_args view)
{
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x, lane = gl_LocalInvocationID.x;
    uint index = group * PT_TILES_IN_GROUP + lane / PT_TILE;
    uint tile = tile_list[min(index, tile_count - 1u)];
    uvec2 corner = pt_pixel(tile, tile_columns) * PT_TILE;
    uvec2 column = uvec2(view.rect[0] + corner.x + lane % PT_TILE, view.rect[1] + corner.y);
    return index < tile_count ? column : uvec2(view.rect[2], view.rect[1]); // beyond the list: an empty column
}

// Where the column ends: at y itself for a column outside the rectangle.
uint pt_tile_end(view_args view, uvec2 column)
{
    return column.x < view.rect[2] ? min(column.y + PT_TILE, view.rect[3]) : column.y;
}

#endif
