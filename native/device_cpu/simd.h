// SPDX-License-Identifier: GPL-3.0-or-later
// One vector vocabulary for every instruction set of the processor. Compilers do not vectorise a gather-test-scatter by themselves, so kernels are
// written with these types; PT_LANES is 16, 8, 4 or 1. vf: floats, vi: 32-bit integers, vm: a mask of lanes.
// Every operation gives the same bits at every width; there is no fused multiply-add and no reciprocal estimate.
#ifndef PT_SIMD_H
#define PT_SIMD_H

#include "math.h"
#include "tables.h"

// base moved by some bytes; NULL is allowed, where no lane reads: C knows no sum of that.
static inline const void *pt_moved(const void *base, intptr_t bytes)
{
    return (const void *)((uintptr_t)base + (uintptr_t)bytes);
}

#if defined(PT_ISA_AVX512)
#include "simd/avx512.h"
#elif defined(PT_ISA_AVX2)
#include "simd/avx2.h"
#elif defined(PT_ISA_SSE42)
#include "simd/sse42.h"
#elif defined(PT_ISA_NEON)
#include "simd/neon.h"
#else
#include "simd/scalar.h"
#endif

#define PT_ALL ((1u << PT_LANES) - 1u) // bits of all lanes
static inline vi vi_select(vm m, vi a, vi b) { return vf_bits(vf_select(m, vi_float(a), vi_float(b))); }
static inline void vf_store_where(float *p, vf a, vm m) { vi_store_where(p, vf_bits(a), m); }
static inline vf vf_abs(vf a) { return vi_float(vi_and(vf_bits(a), vi_set(0x7FFFFFFFu))); }
static inline vf vf_zero(void) { return vf_set(0.0f); }

#if PT_LANES > 1
#include "simd/pixels.h"
#endif
#if defined(PT_ISA_AVX2) || defined(PT_ISA_SSE42) || defined(PT_ISA_NEON)
#include "simd/unmasked.h"
#endif

// ---- the same for every one -----------------------------------------------------------------------------------------
// Those that instruction sets have by themselves:
//   vi_gather_bytes: bytes at base + i: the word that starts there (three bytes beyond the last may be read).
//   vi_gather_two_z: upper words of keys i and i + 1.
//   vf_load4, vf_store4: PT_LANES float4 pixels <-> four vectors; bit i of lanes: pixel i is written.
//   vf_columns: lane i of out[k] is row[at[i] + k]: PT_LANES columns from PT_LANES places of a row. A load a lane and 3 operations a
//     vector; AVX2's gather takes 24, and AVX-512's 81.
//   vi_least_keys: keys[i] = min(keys[i], z << 32 | id), of the first half of the lanes; of the others at keys + apart. No key's first
//     bit is set. PT_KEYS_AT_ONCE lie in one vector: where they begin at its multiples, what is written is read again soon.

// Eight floats or integers side by side whatever the instruction set: what is summed for a pixel. Not a vector of lanes.
typedef float vf_eight __attribute__((vector_size(32), aligned(4), may_alias));
typedef int32_t vi_eight __attribute__((vector_size(32), aligned(4), may_alias));
// Words of bits side by side, four at every one: what planes of bits are worked on by.
typedef uint64_t vi_words __attribute__((vector_size(32), aligned(8), may_alias));

static inline vi vi_gather_id(const uint64_t *keys, vi i, vm m) // lower words of keys
{
    return vi_gather_z(pt_moved(keys, -4), i, m);
}
static inline vf vf_gather(const float *base, vi i, vm m) { return vi_float(vi_gather(base, i, m)); }
static inline vf vf_west(vf before, vf own) { return vi_float(vi_west(vf_bits(before), vf_bits(own))); }
static inline vf vf_east(vf own, vf behind) { return vi_float(vi_east(vf_bits(own), vf_bits(behind))); }
static inline void vf_gather4(const float *pixels, vi i, vm lanes, vf out[4]) { vf_gather3_1(pixels, NULL, i, lanes, out); }

#if !defined(PT_ISA_AVX512)
static inline vf vf_look_up(const float *table, int size, vi i)
{
    (void)size;
    return vf_gather(table, i, vm_first(PT_LANES));
}
// Stores of some lanes, where nobody else writes the others meanwhile: what they hold may be written again.
static inline void vi_merge(void *p, vi a, vm m) { vi_store(p, vi_select(m, a, vi_load(p))); }
static inline void vi_merge_keys(uint64_t *keys, vi z, vi id, vm m)
{
    vi_store_keys(keys, vi_select(m, z, vi_load_z(keys)), vi_select(m, id, vi_load_id(keys)), PT_ALL);
}
// vf_put, vf_put4, vf_put3: writes to the picture, which is read later and by others. count <= PT_LANES pixels of one, four or three
// floats. Past the caches where whole lines of theirs are at hand: a line of which some is stored and some streamed costs a trip
// to memory for each (the fused tail took 35 ms with AVX2 in place of 10.5).
static inline void vf_put(float *p, vf a, uint32_t count) { vf_store_where(p, a, vm_first(count)); }
static inline void vf_put3(float *p, const vf n[3], uint32_t count)
{
    float pixels[4 * PT_LANES];
    const vf four[4] = {n[0], n[1], n[2], vf_set(0.0f)};
    vf_store4(pixels, four, PT_ALL);
    for (uint32_t i = 0; i + 1 < count; i++) // each store's fourth float is overwritten by the next point's first
        memcpy(p + 3 * i, pixels + 4 * i, 16);
    memcpy(p + 3 * (count - 1), pixels + 4 * (count - 1), 12);
}
#endif

#endif
