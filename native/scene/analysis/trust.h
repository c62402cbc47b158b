// SPDX-License-Identifier: GPL-3.0-or-later
// Trust of each point (SPEC 11): the calibrated probability that it is not a wrong sample, found from features of its neighborhood.
#ifndef PT_TRUST_H
#define PT_TRUST_H

#include "beams.h"
#include "neighbourhood.h"
#include "shared/words.h"

enum { PT_TRUST_NEIGHBOURS = 16, PT_TRUST_FEATURES = PATINA_TRUST_FEATURES };

// The first walk stores for each place of the tree how far its neighbors reach; the judgement reads both.
struct pt_trust {
    const struct patina_cloud *cloud;
    struct pt_neighbours *tree, *coarse;
    const patina_analysis_desc *desc;
    const struct pt_beams *beams;
    const struct pt_chunk *chunks;           // with the spacings that the first walk found
    const uint32_t *surfels;                 // slots
    _Atomic uint32_t *shapes;                // slots; the judgement writes PT_SHAPE_TRUST_BITS alone
    uint8_t *reach, *used;                   // a place: distance to the 16th neighbor; to the farthest that described the point
    double base;                             // unit of spacings
    double classes[PT_SHAPE_CLASS_BITS + 1]; // in units
    uint64_t counts[PT_TRUST_LEVELS];        // points of each level, and
    uint32_t least;                          // the level that trusted points have at least: pt_trust_hide finds both
    patina_progress *progress;
    struct pt_hidden *hidden; // untrusted points that are out of the trees, by chunk
    uint32_t *hidden_first;   // a chunk, and one past the last
    uint64_t hidden_count;
    atomic_uint done;
};

// 0 or PATINA_ERROR_MEMORY. The trees must exist.
int pt_trust_create(struct pt_trust *trust);
void pt_trust_destroy(struct pt_trust *trust);

// Stores how far the neighbors of a place reach. sample: nearest first, at least PT_TRUST_NEIGHBOURS where the cloud has these.
void pt_trust_note(struct pt_trust *trust, uint32_t place, const struct pt_sample *sample);
// For walks whose samples hold fewer points than PT_TRUST_NEIGHBOURS: stores the reach of all points.
void pt_trust_measure(struct pt_trust *trust, struct pt_pool *pool);
// Writes the trust of every point into the shape words, and the features into desc->trust_features where wanted.
void pt_trust_judge(struct pt_trust *trust, struct pt_pool *pool);
// Takes untrusted points out of both trees. 0 or PATINA_ERROR_MEMORY. pt_trust_show puts them back.
int pt_trust_hide(struct pt_trust *trust);
void pt_trust_show(struct pt_trust *trust);
// Spacing, reach and footprint of a chunk from the words of its trusted points; repeats the last point's words.
void pt_trust_finish_chunk(const struct pt_trust *trust, struct pt_chunk *chunk, uint32_t *surfels, uint32_t *shapes);
// Lanes of the leaf that are trusted and whose neighbors included an untrusted point.
uint32_t pt_trust_touched(const struct pt_trust *trust, uint32_t leaf);

// The level, 0..15, of features in the order of trust_features.h. Any thread; the same on every machine.
uint32_t pt_trust_level(const float features[PT_TRUST_FEATURES]);

#endif
