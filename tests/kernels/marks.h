// SPDX-License-Identifier: GPL-3.0-or-later
// Marks of points for the kernels that read them: PT_MARK_SLOTS.
#ifndef PT_TEST_MARKS_H
#define PT_TEST_MARKS_H

#include "harness.h"
#include "shared/words.h"

static inline size_t marks_size(uint32_t slots) { return (size_t)(slots + PT_MARK_SLOTS - 1) / PT_MARK_SLOTS * 8; }

// Of slots with a 1 in `shown`, with ranks from `rank` on that do not follow the slots. *words: how many places there are up to their end.
static inline uint32_t *marks_of(struct harness *h, const uint8_t *shown, uint32_t slots, uint32_t rank, uint32_t *words)
{
    uint32_t *marks = harness_alloc(h, marks_size(slots) + 8);
    const uint32_t groups = (uint32_t)(marks_size(slots) / 8);
    for (uint32_t i = 0; i < slots; i++)
        marks[2 * (size_t)(i / PT_MARK_SLOTS)] |= (uint32_t)(shown[i] != 0) << i % PT_MARK_SLOTS;
    for (uint32_t odd = 2; odd--;) // odd groups first
        for (uint32_t i = odd; i < groups; i += 2) {
            marks[2 * (size_t)i + 1] = marks[2 * (size_t)i] ? rank : 0;
            for (uint32_t bits = marks[2 * (size_t)i]; bits; bits &= bits - 1)
                rank++;
        }
    *words = rank;
    return marks;
}

#endif
