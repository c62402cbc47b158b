// SPDX-License-Identifier: GPL-3.0-or-later
// Shadow words: what a sample's maps take of a point's light, for the kernels that test points.
#ifndef PT_SHADOW_WORDS_H
#define PT_SHADOW_WORDS_H

#include "device_cpu/rows.h"
#include "marks.h"

// a b / 255 of a, b up to 255, rounded: exact.
static inline uint32_t pt_shadow_share(uint32_t a, uint32_t b)
{
    uint32_t product = a * b + 128;
    return (product + (product >> 8)) >> 8;
}

// Where the word of a slot lies, behind the light's first.
static inline size_t pt_word_at(const uint32_t *marks, uint32_t marked, uint32_t step, uint32_t slot)
{
    return (size_t)step * (marked ? pt_shown_place(marks, slot) : slot);
}

// Those of `lanes` that fall into the window and do not lie before the map; at: x, y, z.
static inline vm pt_in_window(const struct view_args *view, const float window[4], const vf at[3], vm lanes)
{
    const vm inside = vm_and(vm_and(vf_le(vf_set(window[0]), at[0]), vf_lt(at[0], vf_set(window[2]))),
                             vm_and(vf_le(vf_set(window[1]), at[1]), vf_lt(at[1], vf_set(window[3]))));
    return vm_and(lanes, vm_and(inside, vf_le(vf_set(view->z_near), at[2])));
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
