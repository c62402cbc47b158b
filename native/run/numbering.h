// SPDX-License-Identifier: GPL-3.0-or-later
// Numbers of points. Inside, a point is a slot of its cloud, instance after instance, and triangles follow; callers know
// their own order. What goes out (keys, shadows) is renumbered here, and only here.
#ifndef PT_NUMBERING_H
#define PT_NUMBERING_H

#include "scene/scene.h"

struct pt_numbered {
    const struct patina_cloud *cloud; // may be gone: see alive
    struct pt_alive *alive;
    uint32_t first_slot, slots, first_point; // its ids inside, and where the caller's begin
};

// The instances of a frame's last scene.
struct pt_numbering {
    struct pt_numbered *clouds;
    uint32_t count;
    uint32_t slots, points; // of all: where triangles begin
    uint64_t discs;         // first of the ids that points have as discs (plan.h)
};

// Replaces what was there. 0 or PATINA_ERROR_MEMORY (then it is as it was).
int pt_numbering_take(struct pt_numbering *numbering, const struct patina_scene *scene);
void pt_numbering_release(struct pt_numbering *numbering);
// The cloud of an instance, or NULL when it was destroyed since.
const struct patina_cloud *pt_numbering_cloud(const struct pt_numbering *numbering, uint32_t instance);
// Gives the points of keys the caller's numbers, in place. PATINA_ERROR_EMPTY when a cloud that they show was destroyed.
int pt_numbering_keys(const struct pt_numbering *numbering, uint64_t *keys, size_t count);

#endif
