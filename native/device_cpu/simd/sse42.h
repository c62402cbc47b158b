// SPDX-License-Identifier: GPL-3.0-or-later
// SSE4.2: 4 lanes.
#ifndef PT_SIMD_SSE42_H
#define PT_SIMD_SSE42_H

#include "sse.h"

#define PT_LANES 4
typedef __m128 vf;
typedef __m128i vi;
typedef __m128i vm;
static inline vf vf_load(const float *p) { return _mm_loadu_ps(p); }
static inline vf vf_set(float x) { return _mm_set1_ps(x); }
static inline vf vf_max(vf a, vf b) { return _mm_max_ps(a, b); }
static inline vf vf_min(vf a, vf b) { return _mm_min_ps(a, b); }
static inline vm vf_lt(vf a, vf b) { return _mm_castps_si128(_mm_cmplt_ps(a, b)); }
static inline vm vf_le(vf a, vf b) { return _mm_castps_si128(_mm_cmple_ps(a, b)); }
static inline vf vf_select(vm m, vf a, vf b) { return _mm_blendv_ps(b, a, _mm_castsi128_ps(m)); }
static inline vi vf_bits(vf a) { return _mm_castps_si128(a); }
static inline vf vi_float(vi a) { return _mm_castsi128_ps(a); }
static inline vi vf_int(vf a) { return _mm_cvttps_epi32(a); }
static inline vf vf_floor(vf a) { return _mm_floor_ps(a); }
static inline vf vi_convert(vi a) { return _mm_cvtepi32_ps(a); }
static inline vi vi_load(const void *p) { return _mm_loadu_si128(p); }
static inline void vf_store(float *p, vf a) { _mm_storeu_ps(p, a); }
static inline void vi_store(void *p, vi a) { _mm_storeu_si128(p, a); }
static inline vi vi_set(uint32_t x) { return _mm_set1_epi32((int)x); }
static inline vi vi_lanes(void) { return _mm_setr_epi32(0, 1, 2, 3); }
static inline vi vi_add(vi a, vi b) { return _mm_add_epi32(a, b); }
static inline vi vi_sub(vi a, vi b) { return _mm_sub_epi32(a, b); }
static inline vi vi_mul(vi a, vi b) { return _mm_mullo_epi32(a, b); }
static inline vi vi_and(vi a, vi b) { return _mm_and_si128(a, b); }
static inline vi vi_or(vi a, vi b) { return _mm_or_si128(a, b); }
static inline vi vi_shr(vi a, int n) { return _mm_srl_epi32(a, _mm_cvtsi32_si128(n)); }
static inline vm vi_eq(vi a, vi b) { return _mm_cmpeq_epi32(a, b); }
static inline vm vi_lt_unsigned(vi a, vi b)
{
    const vi flip = _mm_set1_epi32(INT32_MIN);
    return _mm_cmplt_epi32(_mm_xor_si128(a, flip), _mm_xor_si128(b, flip));
}
static inline uint32_t vm_bits(vm m) { return (uint32_t)_mm_movemask_ps(_mm_castsi128_ps(m)); }
static inline vi vi_evens(vi a, vi b)
{
    return _mm_castps_si128(_mm_shuffle_ps(_mm_castsi128_ps(a), _mm_castsi128_ps(b), 0x88));
}
static inline vi vi_odds(vi a, vi b)
{
    return _mm_castps_si128(_mm_shuffle_ps(_mm_castsi128_ps(a), _mm_castsi128_ps(b), 0xDD));
}
static inline void vi_zip(vi a, vi b, vi out[2])
{
    out[0] = _mm_unpacklo_epi32(a, b);
    out[1] = _mm_unpackhi_epi32(a, b);
}
static inline vm vm_first(uint32_t n) { return _mm_cmpgt_epi32(_mm_set1_epi32((int)n), vi_lanes()); }
static inline vm vm_of_bits(uint32_t bits)
{
    const vi each = _mm_setr_epi32(1, 2, 4, 8);
    return _mm_cmpeq_epi32(_mm_and_si128(_mm_set1_epi32((int)bits), each), each);
}
static inline vm vm_and(vm a, vm b) { return _mm_and_si128(a, b); }
static inline vm vm_or(vm a, vm b) { return _mm_or_si128(a, b); }
static inline vm vm_not(vm a) { return _mm_xor_si128(a, _mm_set1_epi32(-1)); }
static inline vf vf_mul_where(vm m, vf a, vf b) { return _mm_and_ps(a * b, _mm_castsi128_ps(m)); }
static inline vf vf_add_where(vm m, vf a, vf b) { return a + _mm_and_ps(b, _mm_castsi128_ps(m)); }
static inline vi vi_west(vi before, vi own) { return _mm_alignr_epi8(own, before, 12); }
static inline vi vi_east(vi own, vi behind) { return _mm_alignr_epi8(behind, own, 4); }
static inline vi vi_pick_bytes(vi a, const void *from) { return _mm_shuffle_epi8(a, vi_load(from)); }
static inline void vf_stream(float *p, vf a) { _mm_stream_ps(p, a); }
static inline vf vf_pixel(const float *p, const float *fourth, uint32_t twice) { return sse_pixel(p, fourth, twice); }
#define PT_VECTOR(name) _mm_##name
static inline __attribute__((always_inline)) vi vi_pick(const char *base, size_t scale, const uint32_t at[PT_LANES])
{
    return _mm_setr_epi32(sse_word(base, scale * at[0]), sse_word(base, scale * at[1]), sse_word(base, scale * at[2]),
                          sse_word(base, scale * at[3]));
}
static inline void vf_columns(const float *row, const uint32_t at[PT_LANES], vf out[PT_LANES])
{
    for (int i = 0; i < 4; i++)
        out[i] = vf_load(row + at[i]);
    _MM_TRANSPOSE4_PS(out[0], out[1], out[2], out[3]);
}
#include "four.h"

#endif
