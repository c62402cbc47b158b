// SPDX-License-Identifier: GPL-3.0-or-later
// Points without a color among colored ones (SPEC 11, Colors): they get the mean of their trusted colored neighbors, and a bit in their
// shape word says so.
#ifndef PT_UNCOLORED_H
#define PT_UNCOLORED_H

#include "neighbours.h"
#include "shared/words.h"

struct pt_uncolored {
    const struct patina_cloud *cloud; // whose points with PT_SHAPE_UNCOLORED have no color either
    const struct pt_neighbours *tree; // of all its points; NULL: one is made where it is needed
    uint32_t *shapes;                 // slots, with trust; the bit is set and cleared here
    int keep;                         // lend nothing, and take back what was lent
    uint32_t least_level;             // of trust: points below are nobody's neighbors
    struct pt_store *store;           // for the arrays
    struct patina_progress *progress;
    void *colors;   // found: slots, in the cloud's format, to be freed from the store; NULL: all stay as they are
    uint64_t count; // found: points that got a color
};

// 0, PATINA_ERROR_MEMORY or PATINA_ERROR_CANCELLED; then no color is found.
int pt_uncolored_find(struct pt_uncolored *job, struct pt_pool *pool);

#endif
