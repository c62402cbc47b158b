// SPDX-License-Identifier: GPL-3.0-or-later
// Sums of pixels in whole numbers, so that no order of adding matters: PT_SUMS side by side a pixel, 32 bits wide, emptied into 64.
#ifndef PT_SUMS_H
#define PT_SUMS_H

#include "device_cpu/rows.h"

enum { PT_SUMS = 8 };

// A sum as a float, in steps that are the same everywhere.
static inline float pt_wide_sum(int64_t sum)
{
    const uint64_t size = sum < 0 ? 0 - (uint64_t)sum : (uint64_t)sum;
    const float value = (float)(uint32_t)(size >> 32) * 4294967296.0f + (float)(uint32_t)size;
    return sum < 0 ? -value : value;
}

// Those of PT_LANES pixels from the one on whose sums begin at `narrow`. wide: what was emptied from there on; NULL: nothing was,
// and sums of pixels that `some` leaves out are anything.
static inline void pt_take_sums(const int32_t *narrow, const int64_t *wide, vm some, vf sums[PT_SUMS])
{
    float lanes[PT_LANES];
    if (!wide) { // halves of pixels
        vf low[4], high[4];
        vf_load4((const float *)(const void *)narrow, low);
        vf_load4((const float *)(const void *)narrow + 4 * PT_LANES, high);
        for (uint32_t k = 0; k < 4; k++) {
            sums[k] = vi_convert(vi_evens(vf_bits(low[k]), vf_bits(high[k])));
            sums[4 + k] = vi_convert(vi_odds(vf_bits(low[k]), vf_bits(high[k])));
        }
        return;
    }
    for (uint32_t k = 0; k < PT_SUMS; k++) {
        for (uint32_t i = 0; i < PT_LANES; i++)
            lanes[i] = vm_bits(some) >> i & 1u ? pt_wide_sum(wide[PT_SUMS * i + k] + narrow[PT_SUMS * i + k]) : 0.0f;
        sums[k] = vf_load(lanes);
    }
}

#endif
