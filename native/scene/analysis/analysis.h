// SPDX-License-Identifier: GPL-3.0-or-later
// The walk over all points that gives each its surface and shape words. Computing leaves the cloud as it is, so that it may
// be drawn meanwhile; applying swaps arrays.
#ifndef PT_ANALYSIS_H
#define PT_ANALYSIS_H

#include "neighbourhood.h"
#include "scene/clouds/sights.h"
#include "scene/clouds/shape_word.h"

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

#endif
