// SPDX-License-Identifier: GPL-3.0-or-later
// Exact nearest neighbours of a cloud's points among all of them, straight from the chunks: leaves of 16 points that lie
// beside each other, a tree of boxes in each chunk, a tree over the chunks. The points of a leaf look together, so that
// boxes are tested and cache lines fetched once for 16. Distances are float64 throughout: offsets within a chunk are exact,
// origins of chunks are subtracted in float64, so that 1 mm at 5e6 m is 1 mm.
#ifndef PT_NEIGHBOURS_H
#define PT_NEIGHBOURS_H

#include "scene/disk/store.h"

enum { PT_LEAF = 16, PT_NEIGHBOURS_MOST = 64 };

struct pt_box_node { // over leaves, in their chunk's frame
    float low[3], high[3];
};

struct pt_chunk_node { // over chunks, in the cloud's frame; widened by what its rounding may hide
    double low[3], high[3];
};

struct pt_neighbours {
    const struct patina_cloud *cloud;
    struct pt_store *store;                   // where its arrays of points lie
    uint32_t leaf_count, chunk_count, strata; // strata: PT_STRATA, or fewer: of each chunk's first alone
    float *places;             // a leaf: x[16], y[16], z[16], relative to the chunk's origin; +inf where there is no point
    uint32_t *slots;           // of leaf * 16 + lane
    uint32_t *leaf_chunk;      // chunk of each leaf
    uint32_t *chunk_leaf;      // first leaf of each chunk, and one past the last
    struct pt_box_node *nodes; // a chunk of n leaves has 2 n - 1 from 2 first leaves on, in preorder: left half, right half
    struct pt_chunk_node *chunk_nodes; // 2 chunks - 1, in preorder
    uint32_t *chunk_order;             // of the leaves of that tree
    double origin[3];                  // of the cloud's frame
    int any_twins;                     // 1: of more points at one place than are wanted any are found, not the first by number
    int level;                         // of instructions: 0 plain, 1 AVX2, 2 AVX-512. Never changes a result
};

// What the points of one leaf have found. Nearest first, equal distances by the caller's number; the point itself is not
// among them, its duplicates are.
struct pt_found {
    double square[PT_LEAF][PT_NEIGHBOURS_MOST];  // of the distance; infinite where the cloud has no more points
    uint32_t place[PT_LEAF][PT_NEIGHBOURS_MOST]; // leaf * 16 + lane
    uint32_t count[PT_LEAF];
};

// progress runs from `begin` to `end` of it. 0, PATINA_ERROR_MEMORY or PATINA_ERROR_CANCELLED; on failure nothing is left.
// About 20 bytes a point, in the store where there is one; it and the cloud must outlive the tree.
int pt_neighbours_create(struct pt_neighbours *tree, const struct patina_cloud *cloud, uint32_t strata, struct pt_store *store,
                         struct pt_pool *pool, struct patina_progress *progress, double begin, double end);
void pt_neighbours_destroy(struct pt_neighbours *tree);

// Points of the chunk in this tree: its first.
uint32_t pt_neighbours_of_chunk(const struct pt_neighbours *tree, uint32_t chunk);
// Lanes of the leaf that hold points.
uint32_t pt_leaf_lanes(const struct pt_neighbours *tree, uint32_t leaf);
// The k nearest (1..PT_NEIGHBOURS_MOST) in `tree` of the lanes in the mask, which are of `from`: that tree, or one of the same
// cloud with other strata (then the point itself may be among them). Any thread.
void pt_neighbours_find(const struct pt_neighbours *tree, const struct pt_neighbours *from, uint32_t leaf, uint32_t lanes,
                        uint32_t k, struct pt_found *found);
// The same, faster, where the caller knows a bound for each lane: the square of a distance within which it has k neighbors. Infinite
// where it knows none. A lane with fewer neighbors within its bound finds only those.
void pt_neighbours_find_within(const struct pt_neighbours *tree, const struct pt_neighbours *from, uint32_t leaf,
                               uint32_t lanes, uint32_t k, const double squares[PT_LEAF], struct pt_found *found);
// From the point at place `at` of `from` to that at `to` of `tree`.
void pt_neighbours_offset(const struct pt_neighbours *tree, const struct pt_neighbours *from, uint32_t at, uint32_t to,
                          double offset[3]);

#endif
