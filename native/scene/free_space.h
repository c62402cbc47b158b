// SPDX-License-Identifier: GPL-3.0-or-later
// Free space (SPEC 11): each station's own depth over directions, made from its own samples, says what it saw through.
#ifndef PT_FREE_SPACE_H
#define PT_FREE_SPACE_H

#include "cloud.h"

struct pt_free_space {
    const patina_cloud *cloud;
    const patina_analysis_desc *desc; // strides made explicit
    double spacing_base;              // that sigmas in the shapes are in
    patina_progress *progress;        // goes from `begin` to `end`
    double begin, end;
    uint32_t *shapes; // slots: PT_SHAPE_SEEN_THROUGH is set and cleared
    uint64_t marked;  // how many points have it
};

// Whether the descriptor says what it takes.
int pt_free_space_check(const patina_analysis_desc *desc);
// 0, PATINA_ERROR_MEMORY or PATINA_ERROR_CANCELLED, without a message. Any number of threads gives the same bits. pool: as
// pt_parallel takes it.
int pt_free_space_mark(struct pt_free_space *free_space, struct pt_pool *pool);

// How far apart a station's directions are, radians.
struct pt_interval {
    double azimuth, elevation;
};
// The intervals of one station's samples. 0 where it has none.
int pt_free_space_interval(const struct pt_free_space *free_space, struct pt_pool *pool, uint32_t station,
                           struct pt_interval *out);

#endif
