// SPDX-License-Identifier: GPL-3.0-or-later
// Heights of the ground over a drawing's plane, on a grid.
#ifndef PT_DRAW_TERRAIN_H
#define PT_DRAW_TERRAIN_H

#include "marching.h"
#include "plane.h"

#include "patina/patina.h"

struct pt_terrain {
    struct pt_height_grid grid;
    double *values;   // of the grid: distances from the plane, along its normal
    double low, high; // of these; low > high: there are none
    double spacing;   // of the points
};

// Heights of the lowest surface that trusted points of the analyzed clouds form, by planes that are fitted to the points around each node.
// Nothing is known where no points lie around a node. cell: 0 takes two spacings, and a quarter of a millimeter on paper at least.
// 0, or PATINA_ERROR_MEMORY, _CANCELLED or _EMPTY.
int pt_terrain_create(const struct pt_draw_plane *plane, double scale, const patina_cloud *const *clouds, uint32_t count,
                      double cell, uint32_t threads, patina_progress *progress, struct pt_terrain *terrain);
void pt_terrain_destroy(struct pt_terrain *terrain);

#endif
