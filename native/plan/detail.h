// SPDX-License-Identifier: GPL-3.0-or-later
// Of clouds in levels (pt_chunk.gap), which chunks a picture needs where it need not be exact (settings.detail).
#ifndef PT_DETAIL_H
#define PT_DETAIL_H

#include "plan.h"

// Of an instance; tolerance 0: all its chunks are drawn.
struct pt_detail {
    double tolerance;        // pixels
    double finest, coarsest; // gaps of its cloud, object units
    double least;            // of what was drawn so far; 0: nothing
};

void pt_detail_begin(const struct patina_scene *scene, const struct pt_plan *plan, const struct pt_instance *instance,
                     struct pt_detail *detail);

// Whether a chunk is drawn. pixel: how wide one is at the nearest place of its box, object units. thinned: how much farther apart than
// all of the cloud's the drawn points lie there.
int pt_detail_draws(struct pt_detail *detail, const struct pt_chunk *chunk, double pixel, double *thinned);

// Whether none of a cluster of chunks is drawn, of which none has a greater gap; its pixel is no wider than theirs.
int pt_detail_leaves_out(const struct pt_detail *detail, double gap, double pixel);

// What another part of the cloud drew.
void pt_detail_join(struct pt_detail *detail, const struct pt_detail *other);

// How much farther apart than all of the cloud's lie what is drawn of it anywhere: by this much its footprints are widened.
double pt_detail_thinning(const struct pt_detail *detail);

#endif
