// SPDX-License-Identifier: GPL-3.0-or-later
// Ranges of a list of chunks, each a run of slots of what the cloud's points have: what a device that copies clouds has in its memory at a
// time, and what a plan counts on.
#ifndef PT_SLOTS_H
#define PT_SLOTS_H

#include "shared/view.h"

#include <stdint.h>

struct pt_slots {
    uint32_t first_chunk, chunk_count; // of the list
    uint64_t first, count;             // slots
};

// The next range from a chunk on: of at most so many slots, but of one chunk at least, from a multiple of `alignment` on.
static inline struct pt_slots pt_next_slots(const struct chunk_view *chunks, uint32_t count, uint32_t first_chunk,
                                            uint64_t most, uint64_t alignment)
{
    struct pt_slots slots = {.first_chunk = first_chunk};
    uint64_t begin = UINT64_MAX, end = 0;
    for (uint32_t c = first_chunk; c < count; c++) {
        const uint64_t slot = chunks[c].first - chunks[c].first % alignment;
        const uint64_t new_begin = slot < begin ? slot : begin, chunk_end = (uint64_t)chunks[c].first + chunks[c].padded;
        const uint64_t new_end = chunk_end > end ? chunk_end : end;
        if (new_end - new_begin > most && c > first_chunk)
            break;
        begin = new_begin;
        end = new_end;
        slots.chunk_count++;
    }
    slots.first = begin;
    slots.count = end - begin;
    return slots;
}

#endif
