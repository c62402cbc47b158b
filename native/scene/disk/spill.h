// SPDX-License-Identifier: GPL-3.0-or-later
// Tapes: rows of bytes that grow at their ends, many side by side in one nameless file, for what memory has no room for.
#ifndef PT_SPILL_H
#define PT_SPILL_H

#include "base/platform.h"

struct pt_spill {
    struct pt_disk disk;
    uint32_t block;  // bytes
    uint32_t blocks; // that the file has
    uint32_t *idle;  // of them, those that no tape has any more
    uint32_t idle_count, idle_room;
    int open;
    int error; // of the system: the first; nothing more is written then
};

// Zero: empty.
struct pt_tape {
    uint32_t *blocks;
    uint32_t count, room;
    char *buffer; // the last block while it grows
    uint64_t size;
};

// Errors are the system's. beside: the file that it lies on the same disk with.
int pt_spill_open(struct pt_spill *spill, const char *beside, uint32_t block);
void pt_spill_close(struct pt_spill *spill); // its tapes are dropped before
int pt_tape_write(struct pt_spill *spill, struct pt_tape *tape, const void *data, uint64_t size);
int pt_tape_rest(struct pt_spill *spill, struct pt_tape *tape); // needs no memory from now on, and grows no longer
int pt_tape_read(const struct pt_spill *spill, const struct pt_tape *tape, uint64_t offset, void *data, uint64_t size);
void pt_tape_drop(struct pt_spill *spill, struct pt_tape *tape); // its blocks are written anew

#endif
