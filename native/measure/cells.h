// SPDX-License-Identifier: GPL-3.0-or-later
// A uniform grid over points: the points of a cell lie one behind the other, in the caller's order. Cells without points take no memory.
// Places are float64 in the caller's frame; offsets within a cell are float32, exact to 2^-24 of its edge.
#ifndef PT_CELLS_H
#define PT_CELLS_H

#include "places.h"

struct pt_pool;
struct patina_progress;

struct pt_cell { // of the hash table
    uint64_t key;
    uint32_t first, count; // count 0: a free place
};

struct pt_cells {
    double low[3]; // corner of cell 0 0 0
    double edge;
    int64_t size[3];  // cells along each axis
    uint32_t count;   // points; those that are not finite, or farther than 2^20 edges from the middle, are left out
    uint32_t *number; // the caller's, of each point
    float *offset;    // 3 a point, from the lower corner of its cell
    struct pt_cell *table;
    uint64_t table_mask;
};

// edge: above 0. progress runs from `begin` to `end`. A patina_error without a message: MEMORY or CANCELLED; then nothing is left.
int pt_cells_create(struct pt_cells *cells, const struct pt_places *places, double edge, struct pt_pool *pool,
                    struct patina_progress *progress, double begin, double end);
void pt_cells_destroy(struct pt_cells *cells); // zeros are fine

static inline uint64_t pt_cells_hash(uint64_t key) { return (key * 0x9E3779B97F4A7C15ull) >> 20; }

// NULL: no point lies there.
static inline const struct pt_cell *pt_cells_at(const struct pt_cells *cells, int64_t x, int64_t y, int64_t z)
{
    if (x < 0 || y < 0 || z < 0 || x >= cells->size[0] || y >= cells->size[1] || z >= cells->size[2])
        return NULL;
    const uint64_t key = (uint64_t)(x + cells->size[0] * (y + cells->size[1] * z));
    for (uint64_t at = pt_cells_hash(key) & cells->table_mask;; at = (at + 1) & cells->table_mask) {
        const struct pt_cell *cell = &cells->table[at];
        if (!cell->count)
            return NULL;
        if (cell->key == key)
            return cell;
    }
}

// The cell that a coordinate lies in, along one axis; within int64 whatever the coordinate.
static inline int64_t pt_cells_along(const struct pt_cells *cells, double coordinate, int axis)
{
    const double at = floor((coordinate - cells->low[axis]) / cells->edge);
    return at < -1.0 ? -1 : at > (double)cells->size[axis] ? cells->size[axis] : (int64_t)at;
}

#endif
