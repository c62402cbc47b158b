// SPDX-License-Identifier: GPL-3.0-or-later
// scatter in rounds that begin with what is near, whichever list it is of: later ones do not read what the keys of those before hide
// (hidden.h, SPEC 13).
#ifndef PT_HIDING_H
#define PT_HIDING_H

#include "hidden.h"
#include "plan/rounds.h"

struct pt_hiding_list {
    uint32_t *order;           // its chunks from near to far
    struct chunk_view *chunks; // those that rounds took, one behind the other: room for all
    uint32_t next, taken;      // of both
};

struct pt_hiding {
    const struct pt_chunk_list *lists;
    struct pt_chunk_list *rounds[2];   // what two rounds have of the lists, by turns
    struct pt_hiding_list *of;         // each list
    uint32_t count, depth, list, turn; // steps nearer than this are done, and of it the lists before this one
    struct pt_tiles tiles;             // of keys as they are by now
    void *memory;
};

// The lists and their chunks stay as they are until it ends. keys: of planes so wide and high. 0: there is no memory for it.
int pt_hiding_begin(struct pt_hiding *hiding, const struct pt_chunk_list *lists, uint32_t count, const uint64_t *keys,
                    uint32_t width, uint32_t height);
void pt_hiding_end(struct pt_hiding *hiding);
// What is next and is not hidden, of all lists: no more bytes than `most`, but one chunk at least; NULL: nothing is. It lasts until the call
// after the next one.
const struct pt_chunk_list *pt_hiding_next(struct pt_hiding *hiding, uint64_t most, uint64_t *bytes);

#endif
