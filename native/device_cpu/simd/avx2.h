// SPDX-License-Identifier: GPL-3.0-or-later
// AVX2: 8 lanes.
#ifndef PT_SIMD_AVX2_H
#define PT_SIMD_AVX2_H

#include "sse.h"

#define PT_LANES 8
typedef __m256 vf;
typedef __m256i vi;
typedef __m256i vm;
static inline vf vf_load(const float *p) { return _mm256_loadu_ps(p); }
static inline vf vf_set(float x) { return _mm256_set1_ps(x); }
static inline vf vf_max(vf a, vf b) { return _mm256_max_ps(a, b); }
static inline vf vf_min(vf a, vf b) { return _mm256_min_ps(a, b); }
static inline vm vf_lt(vf a, vf b) { return _mm256_castps_si256(_mm256_cmp_ps(a, b, _CMP_LT_OQ)); }
static inline vm vf_le(vf a, vf b) { return _mm256_castps_si256(_mm256_cmp_ps(a, b, _CMP_LE_OQ)); }
static inline vf vf_select(vm m, vf a, vf b) { return _mm256_blendv_ps(b, a, _mm256_castsi256_ps(m)); }
static inline vi vf_bits(vf a) { return _mm256_castps_si256(a); }
static inline vf vi_float(vi a) { return _mm256_castsi256_ps(a); }
static inline vi vf_int(vf a) { return _mm256_cvttps_epi32(a); }
static inline vf vf_floor(vf a) { return _mm256_floor_ps(a); }
static inline vf vi_convert(vi a) { return _mm256_cvtepi32_ps(a); }
static inline vi vi_load(const void *p) { return _mm256_loadu_si256(p); }
static inline void vf_store(float *p, vf a) { _mm256_storeu_ps(p, a); }
static inline void vi_store(void *p, vi a) { _mm256_storeu_si256(p, a); }
static inline vi vi_set(uint32_t x) { return _mm256_set1_epi32((int)x); }
static inline vi vi_lanes(void) { return _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7); }
static inline vi vi_add(vi a, vi b) { return _mm256_add_epi32(a, b); }
static inline vi vi_sub(vi a, vi b) { return _mm256_sub_epi32(a, b); }
static inline vi vi_mul(vi a, vi b) { return _mm256_mullo_epi32(a, b); }
static inline vi vi_and(vi a, vi b) { return _mm256_and_si256(a, b); }
static inline vi vi_or(vi a, vi b) { return _mm256_or_si256(a, b); }
static inline vi vi_shr(vi a, int n) { return _mm256_srl_epi32(a, _mm_cvtsi32_si128(n)); }
static inline vm vi_eq(vi a, vi b) { return _mm256_cmpeq_epi32(a, b); }
static inline vm vi_lt_unsigned(vi a, vi b)
{
    const vi flip = _mm256_set1_epi32(INT32_MIN);
    return _mm256_cmpgt_epi32(_mm256_xor_si256(b, flip), _mm256_xor_si256(a, flip));
}
static inline uint32_t vm_bits(vm m) { return (uint32_t)_mm256_movemask_ps(_mm256_castsi256_ps(m)); }
static inline vi vi_evens(vi a, vi b)
{
    __m256 mixed = _mm256_shuffle_ps(_mm256_castsi256_ps(a), _mm256_castsi256_ps(b), 0x88);
    return _mm256_permute4x64_epi64(_mm256_castps_si256(mixed), 0xD8);
}
static inline vi vi_odds(vi a, vi b)
{
    __m256 mixed = _mm256_shuffle_ps(_mm256_castsi256_ps(a), _mm256_castsi256_ps(b), 0xDD);
    return _mm256_permute4x64_epi64(_mm256_castps_si256(mixed), 0xD8);
}
static inline void vi_zip(vi a, vi b, vi out[2])
{
    vi low = _mm256_unpacklo_epi32(a, b), high = _mm256_unpackhi_epi32(a, b);
    out[0] = _mm256_permute2x128_si256(low, high, 0x20);
    out[1] = _mm256_permute2x128_si256(low, high, 0x31);
}
static inline void vi_store_keys(uint64_t *keys, vi z, vi id, uint32_t lanes)
{
    const vi each = _mm256_setr_epi64x(1, 2, 4, 8), low = _mm256_set1_epi64x(lanes), high = _mm256_set1_epi64x(lanes >> 4);
    vi words[2];
    vi_zip(id, z, words);
    if (lanes == 255u) {
        vi_store(keys, words[0]);
        vi_store(keys + 4, words[1]);
        return;
    }
    _mm256_maskstore_epi64((long long *)keys, _mm256_cmpeq_epi64(_mm256_and_si256(low, each), each), words[0]);
    _mm256_maskstore_epi64((long long *)keys + 4, _mm256_cmpeq_epi64(_mm256_and_si256(high, each), each), words[1]);
}
static inline vm vm_first(uint32_t n) { return _mm256_cmpgt_epi32(_mm256_set1_epi32((int)n), vi_lanes()); }
static inline vm vm_of_bits(uint32_t bits)
{
    const vi each = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
    return _mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32((int)bits), each), each);
}
static inline vm vm_and(vm a, vm b) { return _mm256_and_si256(a, b); }
static inline vm vm_or(vm a, vm b) { return _mm256_or_si256(a, b); }
static inline vm vm_not(vm a) { return _mm256_xor_si256(a, _mm256_set1_epi32(-1)); }
static inline void vi_store_where(void *p, vi a, vm m) // AMD's processors take 40 operations for a store of some lanes
{
    if (vm_bits(m) == 255u)
        vi_store(p, a);
    else
        _mm256_maskstore_epi32(p, m, a);
}
static inline void vf_load_pixels(const float *p, vf r[4]) // float4 pixels; vector k: pixels k, 4 + k
{
    for (int k = 0; k < 4; k++)
        r[k] = _mm256_set_m128(_mm_loadu_ps(p + 16 + 4 * k), _mm_loadu_ps(p + 4 * k));
}
static inline void vf_pick_pixels(const float *p, const float *fourth, const uint32_t i[8], vf r[4])
{
    for (int k = 0; k < 4; k++)
        r[k] = _mm256_set_m128(sse_pixel(p, fourth, i[4 + k]), sse_pixel(p, fourth, i[k]));
}
static inline void vf_store_pixels(float *p, vf r[4], uint32_t lanes)
{
    for (int k = 0; k < 4; k++) {
        if (lanes >> k & 1u)
            _mm_storeu_ps(p + 4 * k, _mm256_castps256_ps128(r[k]));
        if (lanes >> (4 + k) & 1u)
            _mm_storeu_ps(p + 16 + 4 * k, _mm256_extractf128_ps(r[k], 1));
    }
}
static inline void vf_stream_pixels(float *p, vf r[4])
{
    for (int k = 0; k < 2; k++) {
        _mm256_stream_ps(p + 8 * k, _mm256_permute2f128_ps(r[2 * k], r[2 * k + 1], 0x20));
        _mm256_stream_ps(p + 16 + 8 * k, _mm256_permute2f128_ps(r[2 * k], r[2 * k + 1], 0x31));
    }
}
static inline vf vf_mul_where(vm m, vf a, vf b) { return _mm256_and_ps(a * b, _mm256_castsi256_ps(m)); }
static inline vf vf_add_where(vm m, vf a, vf b) { return a + _mm256_and_ps(b, _mm256_castsi256_ps(m)); }
static inline void vi_pack(uint32_t *p, vi a, uint32_t lanes)
{
    const vi from = _mm256_cvtepu8_epi32(_mm_loadl_epi64((const __m128i *)&pt_pack_table[lanes]));
    vi_store(p, _mm256_permutevar8x32_epi32(a, from));
}
static inline vi vi_west(vi before, vi own)
{
    return _mm256_alignr_epi8(own, _mm256_permute2x128_si256(before, own, 0x21), 12);
}
static inline vi vi_east(vi own, vi behind) { return _mm256_alignr_epi8(_mm256_permute2x128_si256(own, behind, 0x21), own, 4); }
#define PT_VECTOR(name) _mm256_##name
static inline __attribute__((always_inline)) vi vi_pick(const char *base, size_t scale, const uint32_t at[PT_LANES])
{
    return _mm256_setr_epi32(sse_word(base, scale * at[0]), sse_word(base, scale * at[1]), sse_word(base, scale * at[2]),
                             sse_word(base, scale * at[3]), sse_word(base, scale * at[4]), sse_word(base, scale * at[5]),
                             sse_word(base, scale * at[6]), sse_word(base, scale * at[7]));
}
static inline void vf_columns(const float *row, const uint32_t at[PT_LANES], vf out[PT_LANES]) { avx_columns(row, at, out); }

#endif
