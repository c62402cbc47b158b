// SPDX-License-Identifier: GPL-3.0-or-later
// Marks of points that a picture shows, and where their shadow words lie (PT_MARK_SLOTS), for all that reads them point by point. Twin of
// shaders/lib/marks.glsl; device_cpu/kernels/marks.h has what kernels ask of several at once.
#ifndef PT_SHOWN_H
#define PT_SHOWN_H

#include "shared/words.h"

#include <stddef.h>
#include <stdint.h>

// Bytes of the marks of so many slots.
static inline size_t pt_marks_size(uint64_t slots) { return (size_t)((slots + PT_MARK_SLOTS - 1) / PT_MARK_SLOTS * 8); }

// Which of the shown points it is; 0, which is nobody's place: none of them.
static inline uint32_t pt_shown_place(const uint32_t *marks, uint32_t slot)
{
    const uint32_t *pair = marks + 2 * (size_t)(slot / PT_MARK_SLOTS), own = 1u << slot % PT_MARK_SLOTS;
    return pair[0] & own && pair[1] ? pair[1] + (uint32_t)__builtin_popcount(pair[0] & (own - 1)) : 0;
}

#endif
