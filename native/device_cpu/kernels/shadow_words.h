// SPDX-License-Identifier: GPL-3.0-or-later
// Shadow words: what a sample's maps take of a point's light, for the kernels that test points.
#ifndef PT_SHADOW_WORDS_H
#define PT_SHADOW_WORDS_H

#include "device_cpu/rows.h"

// a b / 255 of a, b up to 255, rounded: exact.
static inline uint32_t pt_shadow_share(uint32_t a, uint32_t b)
{
    uint32_t product = a * b + 128;
    return (product + (product >> 8)) >> 8;
}

// What a map takes goes into the word; whole: it is the sample's last. Returns whether the samples so far differ.
static inline uint32_t pt_shadow_note(uint32_t *word, uint32_t loss, int whole, uint32_t samples)
{
    uint32_t sum = *word & PT_SHADOW_SUM, lost = *word >> PT_SHADOW_SHIFT;
    lost += pt_shadow_share(255 - lost, loss); // of the light that is left
    if (whole) {
        *word = sum + lost;
        return (sum + lost) != samples * lost;
    }
    *word = sum | lost << PT_SHADOW_SHIFT;
    return 0;
}

#endif
