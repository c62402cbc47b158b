// SPDX-License-Identifier: GPL-3.0-or-later
// AVX-512: 16 lanes, stores by mask.
#ifndef PT_SIMD_AVX512_H
#define PT_SIMD_AVX512_H

#include "sse.h"

#define PT_LANES 16
typedef __m512 vf;
typedef __m512i vi;
typedef __mmask16 vm;
static inline vf vf_load(const float *p) { return _mm512_loadu_ps(p); }
static inline vf vf_set(float x) { return _mm512_set1_ps(x); }
static inline vf vf_max(vf a, vf b) { return _mm512_max_ps(a, b); }
static inline vf vf_min(vf a, vf b) { return _mm512_min_ps(a, b); }
static inline vm vf_lt(vf a, vf b) { return _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ); }
static inline vm vf_le(vf a, vf b) { return _mm512_cmp_ps_mask(a, b, _CMP_LE_OQ); }
static inline vf vf_select(vm m, vf a, vf b) { return _mm512_mask_blend_ps(m, b, a); }
static inline vi vf_bits(vf a) { return _mm512_castps_si512(a); }
static inline vf vi_float(vi a) { return _mm512_castsi512_ps(a); }
static inline vi vf_int(vf a) { return _mm512_cvttps_epi32(a); }
static inline vf vf_floor(vf a) { return _mm512_roundscale_ps(a, 9); }
static inline vf vi_convert(vi a) { return _mm512_cvtepi32_ps(a); }
static inline vi vi_load(const void *p) { return _mm512_loadu_si512(p); }
static inline void vf_store(float *p, vf a) { _mm512_storeu_ps(p, a); }
static inline void vi_store(void *p, vi a) { _mm512_storeu_si512(p, a); }
static inline vi vi_set(uint32_t x) { return _mm512_set1_epi32((int)x); }
static inline vi vi_lanes(void) { return _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15); }
static inline vi vi_add(vi a, vi b) { return _mm512_add_epi32(a, b); }
static inline vi vi_sub(vi a, vi b) { return _mm512_sub_epi32(a, b); }
static inline vi vi_mul(vi a, vi b) { return _mm512_mullo_epi32(a, b); }
static inline vi vi_and(vi a, vi b) { return _mm512_and_si512(a, b); }
static inline vi vi_or(vi a, vi b) { return _mm512_or_si512(a, b); }
static inline vi vi_shr(vi a, int n) { return _mm512_srl_epi32(a, _mm_cvtsi32_si128(n)); }
static inline vm vi_eq(vi a, vi b) { return _mm512_cmpeq_epi32_mask(a, b); }
static inline vm vi_lt_unsigned(vi a, vi b) { return _mm512_cmplt_epu32_mask(a, b); }
static inline vi vi_gather(const void *base, vi i, vm m)
{
    return _mm512_mask_i32gather_epi32(_mm512_setzero_si512(), m, i, base, 4);
}
static inline vi vi_gather_z(const uint64_t *keys, vi i, vm m) // upper words of keys
{
    return _mm512_mask_i32gather_epi32(_mm512_setzero_si512(), m, i, pt_moved(keys, 4), 8);
}
static inline uint32_t vm_bits(vm m) { return m; }
static inline vm vm_first(uint32_t n) { return (vm)((1u << n) - 1u); }
static inline vm vm_of_bits(uint32_t bits) { return (vm)bits; }
static inline vm vm_and(vm a, vm b) { return a & b; }
static inline vm vm_or(vm a, vm b) { return a | b; }
static inline vm vm_not(vm a) { return (vm)~a; }
static inline void vi_store_where(void *p, vi a, vm m) { _mm512_mask_storeu_epi32(p, m, a); }
static inline void vf_swap_quarters(vf r[4]) // quarter j of vector k <-> quarter k of vector j
{
    vf a = _mm512_shuffle_f32x4(r[0], r[1], 0x44), b = _mm512_shuffle_f32x4(r[2], r[3], 0x44);
    vf c = _mm512_shuffle_f32x4(r[0], r[1], 0xEE), d = _mm512_shuffle_f32x4(r[2], r[3], 0xEE);
    r[0] = _mm512_shuffle_f32x4(a, b, 0x88);
    r[1] = _mm512_shuffle_f32x4(a, b, 0xDD);
    r[2] = _mm512_shuffle_f32x4(c, d, 0x88);
    r[3] = _mm512_shuffle_f32x4(c, d, 0xDD);
}
static inline void vf_load_pixels(const float *p, vf r[4]) // float4 pixels; vector k: pixels k, 4 + k, 8 + k, 12 + k
{
    for (int j = 0; j < 4; j++)
        r[j] = _mm512_loadu_ps(p + 16 * j);
    vf_swap_quarters(r);
}
static inline void vf_pick_pixels(const float *p, const float *fourth, const uint32_t i[16], vf r[4]) // arranged as above
{
    for (int k = 0; k < 4; k++) {
        __m256 low = _mm256_set_m128(sse_pixel(p, fourth, i[4 + k]), sse_pixel(p, fourth, i[k]));
        __m256 high = _mm256_set_m128(sse_pixel(p, fourth, i[12 + k]), sse_pixel(p, fourth, i[8 + k]));
        r[k] = _mm512_insertf32x8(_mm512_castps256_ps512(low), high, 1);
    }
}
static inline void vf_store_pixels(float *p, vf r[4], uint32_t lanes)
{
    vf_swap_quarters(r);
    for (int j = 0; j < 4; j++)
        _mm512_mask_storeu_ps(p + 16 * j, (__mmask16)(_pdep_u32(lanes >> 4 * j, 0x1111u) * 15u), r[j]);
}
static inline void vf_stream_pixels(float *p, vf r[4]) // p: a multiple of 64 bytes, all lanes
{
    vf_swap_quarters(r);
    for (int j = 0; j < 4; j++)
        _mm512_stream_ps(p + 16 * j, r[j]);
}
static inline void vf_stream(float *p, vf a) { _mm512_stream_ps(p, a); }
static inline vf vf_add_where(vm m, vf a, vf b) { return _mm512_mask_add_ps(a, m, a, b); } // else a; a is never -0
static inline vf vf_mul_where(vm m, vf a, vf b) { return _mm512_maskz_mul_ps(m, a, b); }   // else 0
static inline void vf_pack3(const vf n[3], vf out[3]) // x, y, z of 16 points -> x y z x y z ...
{
    static const int32_t first[3][16] = {{0, 16, 0, 1, 17, 0, 2, 18, 0, 3, 19, 0, 4, 20, 0, 5},
                                         {21, 0, 6, 22, 0, 7, 23, 0, 8, 24, 0, 9, 25, 0, 10, 26},
                                         {0, 11, 27, 0, 12, 28, 0, 13, 29, 0, 14, 30, 0, 15, 31, 0}};
    static const int32_t then[3][16] = {{0, 1, 16, 3, 4, 17, 6, 7, 18, 9, 10, 19, 12, 13, 20, 15},
                                        {0, 21, 2, 3, 22, 5, 6, 23, 8, 9, 24, 11, 12, 25, 14, 15},
                                        {26, 1, 2, 27, 4, 5, 28, 7, 8, 29, 10, 11, 30, 13, 14, 31}};
    for (int k = 0; k < 3; k++)
        out[k] = _mm512_permutex2var_ps(_mm512_permutex2var_ps(n[0], vi_load(first[k]), n[1]), vi_load(then[k]), n[2]);
}
static inline vi vi_west(vi before, vi own) // of each lane of own the one before it
{
    return _mm512_alignr_epi32(own, before, 15);
}
static inline vi vi_east(vi own, vi behind) { return _mm512_alignr_epi32(behind, own, 1); }
static inline vi vi_evens(vi a, vi b) // lanes 0, 2, 4 ... of both
{
    const vi even = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
    return _mm512_permutex2var_epi32(a, even, b);
}
static inline vi vi_odds(vi a, vi b)
{
    const vi odd = _mm512_setr_epi32(1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
    return _mm512_permutex2var_epi32(a, odd, b);
}
static inline void vi_zip(vi a, vi b, vi out[2]) // a0 b0 a1 b1 ...
{
    const vi low = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
    const vi high = _mm512_setr_epi32(8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31);
    out[0] = _mm512_permutex2var_epi32(a, low, b);
    out[1] = _mm512_permutex2var_epi32(a, high, b);
}
static inline void vi_store_keys(uint64_t *keys, vi z, vi id, uint32_t lanes)
{
    vi words[2];
    vi_zip(id, z, words);
    _mm512_mask_storeu_epi64(keys, (__mmask8)lanes, words[0]);
    _mm512_mask_storeu_epi64(keys + 8, (__mmask8)(lanes >> 8), words[1]);
}
enum { PT_KEYS_AT_ONCE = 4 };
static inline void avx_least_keys(uint64_t *keys, __m256i key)
{
    _mm256_storeu_si256((__m256i *)keys, _mm256_min_epu64(key, _mm256_loadu_si256((const __m256i *)keys)));
}
static inline void vi_least_keys(uint64_t *keys, size_t apart, vi z, vi id)
{
    vi words[2];
    vi_zip(id, z, words);
    avx_least_keys(keys, _mm512_castsi512_si256(words[0]));
    avx_least_keys(keys + 4, _mm512_extracti64x4_epi64(words[0], 1));
    avx_least_keys(keys + apart, _mm512_castsi512_si256(words[1]));
    avx_least_keys(keys + apart + 4, _mm512_extracti64x4_epi64(words[1], 1));
}
static inline void vi_pack(uint32_t *p, vi a, uint32_t lanes) // those lanes, one behind another; room for all
{
    _mm512_storeu_si512(p, _mm512_maskz_compress_epi32((vm)lanes, a));
}
static inline vf vf_look_up(const float *table, int size, vi i) // i < size, 64 or 256; a third of a gather's time
{
    vf parts[8];
    for (int k = 0; k < size / 32; k++)
        parts[k] = _mm512_permutex2var_ps(vf_load(table + 32 * k), i, vf_load(table + 32 * k + 16));
    for (int bit = 32; bit < size; bit *= 2)
        for (int k = 0; k < size / bit / 2; k++)
            parts[k] = _mm512_mask_blend_ps(_mm512_test_epi32_mask(i, vi_set((uint32_t)bit)), parts[2 * k], parts[2 * k + 1]);
    return parts[0];
}
#define PT_VECTOR(name) _mm512_##name

static inline vi vi_gather_bytes(const uint8_t *base, vi i, vm m)
{
    return _mm512_mask_i32gather_epi32(_mm512_setzero_si512(), m, i, base, 1);
}
static inline void vi_gather_two_z(const uint64_t *keys, vi i, vm m, vi z[2])
{
    z[0] = vi_gather_z(keys, i, m);
    z[1] = vi_gather_z(keys, vi_add(i, vi_set(1)), m);
}
static inline void vi_merge(void *p, vi a, vm m) { vi_store_where(p, a, m); }
static inline void vi_merge_keys(uint64_t *keys, vi z, vi id, vm m) { vi_store_keys(keys, z, id, vm_bits(m)); }
static inline void vf_put(float *p, vf a, uint32_t count)
{
    if (count == PT_LANES && (uintptr_t)p % 64 == 0)
        vf_stream(p, a);
    else
        vi_store_where(p, vf_bits(a), vm_first(count));
}
static inline void vf_put3(float *p, const vf n[3], uint32_t count)
{
    vf packed[3];
    vf_pack3(n, packed);
    for (uint32_t k = 0; k < 3; k++) {
        uint32_t floats = 3 * count <= 16 * k ? 0 : 3 * count - 16 * k;
        vf_put(p + 16 * k, packed[k], floats < 16 ? floats : 16);
    }
}
static inline void vf_columns(const float *row, const uint32_t at[PT_LANES], vf out[PT_LANES])
{
    for (int k = 0; k < 16; k += 8) {
        __m256 low[8], high[8];
        avx_columns(row + k, at, low);
        avx_columns(row + k, at + 8, high);
        for (int i = 0; i < 8; i++)
            out[k + i] = _mm512_insertf32x8(_mm512_castps256_ps512(low[i]), high[i], 1);
    }
}

#endif
