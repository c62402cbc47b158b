// SPDX-License-Identifier: GPL-3.0-or-later
// What a plan looks at more than one chunk of at a time: clusters of a file's, and pages that are on their way.
#ifndef PT_PLAN_PAGES_H
#define PT_PLAN_PAGES_H

#include "detail.h"
#include "eye.h"
#include "kinds.h"
#include "scene/clip.h"

// Of an instance that is looked at.
struct pt_looking {
    const struct pt_eye *camera;
    enum pt_kind kind; // that reaches farthest
    const struct pt_to_place *what;
    const double *rows; // of the object
    const struct pt_sieve *sieve;
    struct pt_detail *detail;
};

// Whether each of the chunks that lie within `around`, none of them with a greater gap, would be found out of view, or finer than the picture
// needs. Where it reaches behind the camera and before it, other bounds are looked at than of chunks that do not: nothing follows from these.
int pt_is_out(const struct pt_looking *looking, const struct pt_chunk *around);

// Absent pages of the instance's cloud that are in view and that the picture needs are wanted. Returns how many chunks of pages in view are
// taken by the sieve.
uint64_t pt_plan_absent(const struct pt_looking *looking);

#endif
