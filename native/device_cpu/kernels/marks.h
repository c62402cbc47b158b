// SPDX-License-Identifier: GPL-3.0-or-later
// Marks of points that a picture shows, several at once, and setting them.
#ifndef PT_MARKS_H
#define PT_MARKS_H

#include "device_cpu/vector_math.h"
#include "shown.h"

// Those of `lanes` whose points, from `slot` on, are shown and have a place. Slots of a vector share a word.
static inline vm pt_are_shown(const uint32_t *marks, uint32_t slot, vm lanes)
{
    const uint32_t *pair = marks + 2 * (size_t)(slot / PT_MARK_SLOTS);
    return vm_and(lanes, vm_of_bits(pair[1] ? pair[0] >> slot % PT_MARK_SLOTS : 0));
}

// Of `lanes`, times step.
static inline vi pt_shown_words(const uint32_t *marks, uint32_t step, vi slots, vm lanes)
{
    uint32_t at[PT_LANES];
    vi_store(at, vi_select(lanes, slots, vi_set(0)));
    for (uint32_t some = vm_bits(lanes); some; some &= some - 1) {
        const uint32_t k = (uint32_t)__builtin_ctz(some);
        at[k] = step * pt_shown_place(marks, at[k]);
    }
    return vi_load(at);
}

// Two threads, or a point and another in its word, may mark at once.
static inline void pt_mark(uint32_t *marks, uint32_t slot)
{
    uint32_t *word = marks + 2 * (size_t)(slot / PT_MARK_SLOTS);
    const uint32_t bit = 1u << slot % PT_MARK_SLOTS;
    if (!(__atomic_load_n(word, __ATOMIC_RELAXED) & bit))
        __atomic_fetch_or(word, bit, __ATOMIC_RELAXED);
}

#endif
