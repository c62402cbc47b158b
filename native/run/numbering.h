// SPDX-License-Identifier: GPL-3.0-or-later
// Numbers of points. Inside, a point is a slot of its cloud, and its id that of a plan's window (plan.h); triangles follow; callers know
// their own order. What goes out (keys, shadows) is renumbered here, and only here.
#ifndef PT_NUMBERING_H
#define PT_NUMBERING_H

#include "plan/plan.h"

struct pt_numbered {
    const struct patina_cloud *cloud; // may be gone: see alive
    struct pt_alive *alive;
    uint32_t number; // that callers have for the cloud, parts of one have the same
    struct pt_window window;
    uint64_t first_point; // where the caller's begin
    int keeps_black;      // its grade leaves uncolored points black
};

// The instances of a scene, and the ids that a plan gave them.
struct pt_numbering {
    struct pt_numbered *clouds;
    uint32_t count;
    uint64_t ids, points, triangles; // ids of points; points as callers count them: where triangles begin
    uint64_t discs; // first of the ids that points have as discs (plan.h); where there are none, greater than any
};

// Replaces what was there; plan: NULL for no ids. 0 or PATINA_ERROR_MEMORY (then it is as it was).
int pt_numbering_take(struct pt_numbering *numbering, const struct patina_scene *scene, const struct pt_plan *plan);
void pt_numbering_release(struct pt_numbering *numbering);
// Whether it is of the scene's clouds.
int pt_numbering_is_of(const struct pt_numbering *numbering, const struct patina_scene *scene);
// The instances that callers have this number for: how many, from *first on.
uint32_t pt_numbering_parts(const struct pt_numbering *numbering, uint32_t number, uint32_t *first);
// The cloud of an instance, or NULL when it was destroyed since.
const struct patina_cloud *pt_numbering_cloud(const struct pt_numbering *numbering, uint32_t instance);
// The instance and slot of an id, of a disc's too; 0: it is none of a point. *instance: where to look first; any that there is.
int pt_numbering_find(const struct pt_numbering *numbering, uint32_t id, uint32_t *instance, uint32_t *slot);
// Gives the points of keys the caller's numbers, in place. PATINA_ERROR_EMPTY when a cloud that they show was destroyed,
// PATINA_ERROR_TOO_MANY_POINTS where the scene's numbers have more than 32 bits.
int pt_numbering_keys(const struct pt_numbering *numbering, uint64_t *keys, size_t count);
// Makes keys the numbers alone; UINT64_MAX of empty ones. PATINA_ERROR_EMPTY likewise.
int pt_numbering_numbers(const struct pt_numbering *numbering, uint64_t *keys, size_t count);

#endif
