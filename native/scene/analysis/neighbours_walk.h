// SPDX-License-Identifier: GPL-3.0-or-later
// The walk of neighbours_find.c, once for each set of instructions: LEVEL(name) names it, TARGET is its attribute; the three
// functions that are only declared here are written in those instructions. The same operations in the same order at every level: the same results.

// Lanes whose point lies within its worst distance of the box; places of lanes in the box's frame.
TARGET static inline uint32_t LEVEL(near_box)(const struct walk *walk, const double low[3], const double high[3]);
// Squares of the distances from one place to a leaf's points; returns the lanes that are at most `worst` away.
TARGET static inline uint32_t LEVEL(near_points)(const float *xyz, const double place[3], double worst, double square[PT_LEAF]);

// Takes those that `near` marks into the lane's list.
TARGET static inline void LEVEL(take)(struct walk *walk, uint32_t lane, const double square[PT_LEAF], uint32_t near,
                                      uint32_t first);

TARGET static void LEVEL(walk_leaf)(struct walk *walk, uint32_t leaf, uint32_t lanes)
{
    const struct pt_neighbours *tree = walk->tree;
    const float *xyz = tree->places + (size_t)leaf * 3 * PT_LEAF;
    _Alignas(64) double square[PT_LEAF];
    const uint32_t held = pt_leaf_lanes(tree, leaf);
    for (; lanes; lanes &= lanes - 1) {
        const uint32_t lane = (uint32_t)__builtin_ctz(lanes);
        const double place[3] = {walk->place[0][lane], walk->place[1][lane], walk->place[2][lane]};
        uint32_t near = LEVEL(near_points)(xyz, place, walk->worst[lane], square);
        if (leaf == walk->leaf && tree == walk->from)
            near &= ~(1u << lane);
        near &= held;
        if (near)
            LEVEL(take)(walk, lane, square, near, leaf * PT_LEAF);
    }
}

TARGET static void LEVEL(walk_chunk)(struct walk *walk, uint32_t chunk)
{
    struct {
        uint32_t node, leaf, leaves;
    } stack[32], at = {0, 0, walk->tree->chunk_leaf[chunk + 1] - walk->tree->chunk_leaf[chunk]};
    const uint32_t first = walk->tree->chunk_leaf[chunk];
    const struct pt_box_node *nodes = walk->tree->nodes + 2 * (size_t)first;
    uint32_t depth = 0;
    enter(walk, chunk);
    for (;; at = stack[--depth]) {
        for (;;) {
            const struct pt_box_node *node = &nodes[at.node];
            const double low[3] = {(double)node->low[0], (double)node->low[1], (double)node->low[2]};
            const double high[3] = {(double)node->high[0], (double)node->high[1], (double)node->high[2]};
            const uint32_t lanes = LEVEL(near_box)(walk, low, high);
            if (!lanes)
                break;
            if (at.leaves == 1) {
                LEVEL(walk_leaf)(walk, first + at.leaf, lanes);
                break;
            }
            const uint32_t left = (at.leaves + 1) / 2;
            const struct pt_box_node *l = &nodes[at.node + 1], *r = &nodes[at.node + 2 * left];
            double to_left = 0.0, to_right = 0.0;
            for (int k = 0; k < 3; k++) {
                to_left += outside(walk->middle[k], (double)l->low[k], (double)l->high[k]);
                to_right += outside(walk->middle[k], (double)r->low[k], (double)r->high[k]);
            }
            stack[depth] = at;
            if (to_left <= to_right) {
                stack[depth].node += 2 * left;
                stack[depth].leaf += left;
                stack[depth++].leaves -= left;
                at.node++;
                at.leaves = left;
            } else {
                stack[depth].node++;
                stack[depth++].leaves = left;
                at.node += 2 * left;
                at.leaf += left;
                at.leaves -= left;
            }
        }
        if (!depth)
            return;
    }
}

TARGET static void LEVEL(walk_cloud)(struct walk *walk)
{
    struct {
        uint32_t node, chunk, chunks;
    } stack[48], at = {0, 0, walk->tree->chunk_count};
    const struct pt_chunk_node *nodes = walk->tree->chunk_nodes;
    uint32_t depth = 0;
    LEVEL(walk_chunk)(walk, walk->from->leaf_chunk[walk->leaf]); // its own first: most lanes then need no other
    for (;; at = stack[--depth]) {
        for (;;) {
            const struct pt_chunk_node *node = &nodes[at.node];
            enter_cloud(walk);
            if (!LEVEL(near_box)(walk, node->low, node->high))
                break;
            if (at.chunks == 1) {
                const uint32_t chunk = walk->tree->chunk_order[at.chunk];
                if (chunk != walk->from->leaf_chunk[walk->leaf])
                    LEVEL(walk_chunk)(walk, chunk);
                break;
            }
            const uint32_t left = (at.chunks + 1) / 2;
            const struct pt_chunk_node *l = &nodes[at.node + 1], *r = &nodes[at.node + 2 * left];
            double to_left = 0.0, to_right = 0.0;
            for (int k = 0; k < 3; k++) {
                to_left += outside(walk->middle[k], l->low[k], l->high[k]);
                to_right += outside(walk->middle[k], r->low[k], r->high[k]);
            }
            stack[depth] = at;
            if (to_left <= to_right) {
                stack[depth].node += 2 * left;
                stack[depth].chunk += left;
                stack[depth++].chunks -= left;
                at.node++;
                at.chunks = left;
            } else {
                stack[depth].node++;
                stack[depth++].chunks = left;
                at.node += 2 * left;
                at.chunk += left;
                at.chunks -= left;
            }
        }
        if (!depth)
            return;
    }
}
