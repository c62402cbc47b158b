// SPDX-License-Identifier: GPL-3.0-or-later
// The walk over all points that gives each its surface and shape words. Computing leaves the cloud as it is, so that it may
// be drawn meanwhile; applying swaps arrays.
#ifndef PT_ANALYSIS_H
#define PT_ANALYSIS_H

#include "neighbourhood.h"
#include "sights.h"
#include "shared/words.h"

struct pt_analysis {
    struct pt_store *store;     // where these arrays lie
    uint32_t *surfels, *shapes; // slots
    struct pt_chunk *chunks;
    uint64_t slots;
    double spacing_base;
    uint64_t estimated, kinds[6], seen_through, trusts[PT_TRUST_LEVELS];
    int oriented;
    void *colors; // slots, of uncolored points their neighbors'; NULL: as the cloud's
    size_t color_bytes;
    int keeps_colors;
    uint64_t uncolored;
    struct pt_sights sights; // where free space is asked for
};

int pt_analysis_check(const patina_cloud *cloud, const patina_analysis_desc *desc);
// 0 or an error with its message at the thread. Arrays of the descriptor are read. store: for what memory has no room for, NULL: it has;
// it outlives `out`. The same bytes with and without.
int pt_analysis_compute(const patina_cloud *cloud, const patina_analysis_desc *desc, struct pt_store *store,
                        patina_progress *progress, struct pt_analysis *out);
int pt_analysis_apply(patina_cloud *cloud, struct pt_analysis *analysis); // takes its arrays
// What it takes at most beside the cloud, bytes; without grids and free space.
uint64_t pt_analysis_memory(const patina_cloud *cloud);
void pt_analysis_free(struct pt_analysis *analysis);

// Bit of shape words that no kernel reads: another surface lies beside the point's own, not farther than its neighbours reach.
#define PT_SHAPE_BESIDE (1u << 30)

// Whether some of a cloud's points, one in a hundred, have another surface beside theirs. One slot in 16 is asked, of large clouds in
// some 512 chunks that lie evenly among all.
int pt_shapes_beside(const struct patina_cloud *cloud);

// The trust that each of the PT_TRUST_LEVELS stands for, and the nearest level.
double pt_trust_of_level(uint32_t level);
uint32_t pt_level_of_trust(double trust);
// The least level that is drawn by default, of a cloud with so many points of each level: from PATINA_TRUST_DEFAULT to PATINA_TRUST_MOST, as
// high as it can be while at most 1 % of the points that are probably right are below. Trust is calibrated, so a level's points are right
// in that share. PATINA_TRUST_DEFAULT of a clean cloud: less than 0.05 % of its points are below that.
uint32_t pt_default_level(const uint64_t counts[PT_TRUST_LEVELS]);

// Shape words. base: the cloud's spacing_base.
uint32_t pt_pack_shape(const struct pt_neighbourhood *hood, uint32_t normal_bits, double base);
// Half axes, sigma and trust of a word; out->axis where normal_bits are a normal.
void pt_unpack_shape(uint32_t shape, uint32_t normal_bits, double base, struct pt_neighbourhood *out);

// What else is known of the point in a place of the tree may shrink its footprint.
typedef void pt_limit(void *context, uint32_t place, const struct pt_sample *sample, struct pt_neighbourhood *hood);

// The lanes of a leaf described: neighbours, plane, kind; then limited, where limit is not NULL. found is room to work in.
void pt_describe_leaf(const struct pt_neighbours *tree, const struct pt_neighbours *coarse, uint32_t leaf, uint32_t lanes,
                      uint32_t k, struct pt_found *found, struct pt_neighbourhood hoods[PT_LEAF], pt_limit *limit,
                      void *context);

#endif
