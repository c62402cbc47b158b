// SPDX-License-Identifier: GPL-3.0-or-later
// Which side of its surface a point's normal is on, where nobody told: the side that is seen from outside.
#ifndef PT_ORIENT_H
#define PT_ORIENT_H

#include "neighbours.h"

// Turns the normals in `surface` of the slots that `told` does not mark (bits; NULL: none is told), and the axes in `shapes`
// with them. Chunks bring the points' spacing. What it needs lies where the tree does. 0 or an error; the same bytes for any threads.
int pt_orient(const struct pt_neighbours *tree, const struct pt_chunk *chunks, const uint32_t *told, uint32_t *surfels,
              uint32_t *shapes, struct pt_pool *pool, struct patina_progress *progress, double begin, double end);

#endif
