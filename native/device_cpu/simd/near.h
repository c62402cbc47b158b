// SPDX-License-Identifier: GPL-3.0-or-later
// Words of a row, all of whose numbers are less than PT_LANES: one operation where there is one, else a load each.
#ifndef PT_SIMD_NEAR_H
#define PT_SIMD_NEAR_H

#include "device_cpu/simd.h"

static inline vi vi_near(const void *row, vi at)
{
#if defined(PT_ISA_AVX512)
    return _mm512_permutexvar_epi32(at, vi_load(row));
#elif defined(PT_ISA_AVX2)
    return _mm256_permutevar8x32_epi32(vi_load(row), at);
#else
    return vi_gather(row, at, vm_first(PT_LANES));
#endif
}

#endif
