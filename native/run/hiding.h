// SPDX-License-Identifier: GPL-3.0-or-later
// scatter in rounds that begin with what is near: later ones do not read what the keys of those before hide (hidden.h, SPEC 13).
#ifndef PT_HIDING_H
#define PT_HIDING_H

#include "plan/rounds.h"

struct pt_hiding {
    struct pt_chunk_list *lists; // each from near to far
    struct chunk_view *chunks;   // of all lists; what was found to be hidden has no points, nor slots
    uint32_t count;
    const uint64_t *keys; // as they are by now, of planes so wide
    uint32_t width;
};

// Copies the lists and their chunks. 0: there is no memory for it.
int pt_hiding_begin(struct pt_hiding *hiding, const struct pt_chunk_list *lists, uint32_t count);
void pt_hiding_end(struct pt_hiding *hiding);
// As pt_next_range, without what is hidden.
int pt_hiding_next(const struct pt_hiding *hiding, uint64_t most, struct pt_chunk_range *range);

#endif
