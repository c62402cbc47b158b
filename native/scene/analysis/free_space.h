// SPDX-License-Identifier: GPL-3.0-or-later
// Free space (SPEC 11): each station's own depth over directions, made from its own samples, says what it saw through.
#ifndef PT_FREE_SPACE_H
#define PT_FREE_SPACE_H

#include "beams.h"
#include "scene/clouds/sights.h"

struct pt_free_space {
    const patina_cloud *cloud;
    const patina_analysis_desc *desc; // strides made explicit
    const struct pt_beams *beams;     // of the descriptor's stations
    double spacing_base;              // that sigmas in the shapes are in
    patina_progress *progress;        // goes from `begin` to `end`
    double begin, end;
    struct pt_store *store;   // where a grid lies that is no small part of memory; NULL: there
    uint32_t *shapes;         // slots: PT_SHAPE_SEEN_THROUGH is set and cleared
    uint64_t marked;          // how many points have it
    struct pt_sights *sights; // what the stations saw, for pictures: empty before, the caller's in any case. NULL: not wanted
};

// Whether the descriptor says what it takes.
int pt_free_space_check(const patina_analysis_desc *desc);
// 0, PATINA_ERROR_MEMORY or PATINA_ERROR_CANCELLED, without a message. Any number of threads gives the same bits. pool: as
// pt_parallel takes it.
int pt_free_space_mark(struct pt_free_space *free_space, struct pt_pool *pool);

#endif
