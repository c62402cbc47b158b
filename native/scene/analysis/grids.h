// SPDX-License-Identifier: GPL-3.0-or-later
// What a scanner's own grid says of a point (SPEC 11): its neighbours are those of the next rows and columns, whatever else lies near
// in space, and where depth steps between them the nearer surface ends.
#ifndef PT_GRIDS_H
#define PT_GRIDS_H

#include "interval.h"
#include "neighbourhood.h"

struct pt_grids {
    uint32_t count; // of scans; 0: nobody asked for their grids
    struct pt_grid_of *each;
    float *position; // 3 a slot, from its scan's origin
    uint32_t *cells; // of all scans
    uint64_t slots, cell_count;
    struct pt_store *store; // where these lie, and the cells
};

// Of the descriptor, whose strides are explicit. 0, PATINA_ERROR_MEMORY or PATINA_ERROR_CANCELLED. pool: as pt_parallel takes it.
int pt_grids_create(const struct patina_cloud *cloud, const patina_analysis_desc *desc, struct pt_store *store,
                    struct pt_pool *pool, struct patina_progress *progress, struct pt_grids *out);
void pt_grids_destroy(struct pt_grids *grids);

// What the grid tells of the point in a slot, by its number in the caller's order, goes into hood, which its neighbours in space
// described. 0: it lies in no grid, or nothing is told.
int pt_grids_describe(const struct pt_grids *grids, const patina_analysis_desc *desc, uint32_t slot, uint32_t number,
                      struct pt_neighbourhood *hood);

#endif
