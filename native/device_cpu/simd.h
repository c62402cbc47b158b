// SPDX-License-Identifier: GPL-3.0-or-later
// One vector vocabulary for every CPU level. Compilers do not vectorise a gather-test-scatter by themselves, so kernels are
// written with these types; PT_LANES is 16, 8, 4 or 1. vf: floats, vi: 32-bit integers, vm: a mask of lanes.
// Every operation gives the same bits at every width; there is no fused multiply-add and no reciprocal estimate.
#ifndef PT_SIMD_H
#define PT_SIMD_H

#include "math.h"
#include "tables.h"

#if !defined(PT_ISA_SCALAR)
#include <immintrin.h>
#endif

#define PT_CONCAT_(a, b) a##b
#define PT_CONCAT(a, b) PT_CONCAT_(a, b)
// The name of this level's variant of a kernel's entry: pt_kernel_scatter_avx2.
#define PT_KERNEL_ENTRY(name) PT_CONCAT(pt_kernel_##name##_, PT_ISA)

#if !defined(PT_ISA_SCALAR)
// The float4 pixel of half this number; fourth: where its last float comes from, NULL for its own.
static inline __m128 sse_pixel(const float *p, const float *fourth, uint32_t twice)
{
    __m128 pixel = _mm_loadu_ps(p + 2 * (size_t)twice);
    if (!fourth)
        return pixel;
    return _mm_insert_ps(pixel, _mm_load_ss((const float *)(const void *)((const char *)fourth + 2 * (size_t)twice)), 0x30);
}
#endif

#if defined(PT_ISA_AVX512)

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
    return _mm512_mask_i32gather_epi32(_mm512_setzero_si512(), m, i, (const char *)keys + 4, 8);
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
static inline vf vf_mul_where(vm m, vf a, vf b) { return _mm512_maskz_mul_ps(m, a, b); } // else 0
static inline void vf_pack3(const vf n[3], vf out[3]) // x, y, z of 16 points -> x y z x y z ...
{
    static const int32_t first[3][16] = { { 0, 16, 0, 1, 17, 0, 2, 18, 0, 3, 19, 0, 4, 20, 0, 5 },
                                          { 21, 0, 6, 22, 0, 7, 23, 0, 8, 24, 0, 9, 25, 0, 10, 26 },
                                          { 0, 11, 27, 0, 12, 28, 0, 13, 29, 0, 14, 30, 0, 15, 31, 0 } };
    static const int32_t then[3][16] = { { 0, 1, 16, 3, 4, 17, 6, 7, 18, 9, 10, 19, 12, 13, 20, 15 },
                                         { 0, 21, 2, 3, 22, 5, 6, 23, 8, 9, 24, 11, 12, 25, 14, 15 },
                                         { 26, 1, 2, 27, 4, 5, 28, 7, 8, 29, 10, 11, 30, 13, 14, 31 } };
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

#elif defined(PT_ISA_AVX2)

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
static inline vi vi_west(vi before, vi own) { return _mm256_alignr_epi8(own, _mm256_permute2x128_si256(before, own, 0x21), 12); }
static inline vi vi_east(vi own, vi behind) { return _mm256_alignr_epi8(_mm256_permute2x128_si256(own, behind, 0x21), own, 4); }
#define PT_VECTOR(name) _mm256_##name

#elif defined(PT_ISA_SSE42)

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
static inline void vi_store_keys(uint64_t *keys, vi z, vi id, uint32_t lanes)
{
    uint64_t words[4];
    _mm_storeu_si128((__m128i *)words, _mm_unpacklo_epi32(id, z));
    _mm_storeu_si128((__m128i *)(words + 2), _mm_unpackhi_epi32(id, z));
    for (int k = 0; k < 4; k++)
        if (lanes >> k & 1u)
            keys[k] = words[k];
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
static inline void vi_store_where(void *p, vi a, vm m)
{
    uint32_t lanes = vm_bits(m), value[4];
    if (lanes == 15u) {
        vi_store(p, a);
        return;
    }
    vi_store(value, a);
    for (int k = 0; k < 4; k++)
        if (lanes >> k & 1u)
            memcpy((char *)p + 4 * k, &value[k], 4);
}
static inline void vf_load_pixels(const float *p, vf r[4]) // float4 pixels; vector k: pixel k
{
    for (int k = 0; k < 4; k++)
        r[k] = _mm_loadu_ps(p + 4 * k);
}
static inline void vf_pick_pixels(const float *p, const float *fourth, const uint32_t i[4], vf r[4])
{
    for (int k = 0; k < 4; k++)
        r[k] = sse_pixel(p, fourth, i[k]);
}
static inline void vf_store_pixels(float *p, vf r[4], uint32_t lanes)
{
    for (int k = 0; k < 4; k++)
        if (lanes >> k & 1u)
            _mm_storeu_ps(p + 4 * k, r[k]);
}
static inline void vf_stream_pixels(float *p, vf r[4])
{
    for (int k = 0; k < 4; k++)
        _mm_stream_ps(p + 4 * k, r[k]);
}
static inline vf vf_mul_where(vm m, vf a, vf b) { return _mm_and_ps(a * b, _mm_castsi128_ps(m)); }
static inline vf vf_add_where(vm m, vf a, vf b) { return a + _mm_and_ps(b, _mm_castsi128_ps(m)); }
static inline void vi_pack(uint32_t *p, vi a, uint32_t lanes)
{
#define FROM(i, j, k, l) { 0x03020100 + i * 0x04040404, 0x03020100 + j * 0x04040404, 0x03020100 + k * 0x04040404, \
                           0x03020100 + l * 0x04040404 }
    static const int32_t from[16][4] = { FROM(0, 0, 0, 0), FROM(0, 0, 0, 0), FROM(1, 0, 0, 0), FROM(0, 1, 0, 0),
                                         FROM(2, 0, 0, 0), FROM(0, 2, 0, 0), FROM(1, 2, 0, 0), FROM(0, 1, 2, 0),
                                         FROM(3, 0, 0, 0), FROM(0, 3, 0, 0), FROM(1, 3, 0, 0), FROM(0, 1, 3, 0),
                                         FROM(2, 3, 0, 0), FROM(0, 2, 3, 0), FROM(1, 2, 3, 0), FROM(0, 1, 2, 3) };
#undef FROM
    _mm_storeu_si128((__m128i *)p, _mm_shuffle_epi8(a, _mm_loadu_si128((const __m128i *)from[lanes])));
}
static inline vi vi_west(vi before, vi own) { return _mm_alignr_epi8(own, before, 12); }
static inline vi vi_east(vi own, vi behind) { return _mm_alignr_epi8(behind, own, 4); }
#define PT_VECTOR(name) _mm_##name

#else // scalar: the same kernels, a lane at a time

#define PT_LANES 1
typedef float vf;
typedef uint32_t vi;
typedef uint32_t vm;
static inline vf vf_load(const float *p) { return *p; }
static inline vf vf_set(float x) { return x; }
static inline vf vf_max(vf a, vf b) { return pt_max(a, b); }
static inline vf vf_min(vf a, vf b) { return pt_min(a, b); }
static inline vm vf_lt(vf a, vf b) { return a < b; }
static inline vm vf_le(vf a, vf b) { return a <= b; }
static inline vf vf_select(vm m, vf a, vf b) { return m ? a : b; }
static inline vi vf_bits(vf a) { return pt_bits(a); }
static inline vf vi_float(vi a) { return pt_float(a); }
static inline vi vf_int(vf a) { return a >= -2147483648.0f && a < 2147483648.0f ? (uint32_t)(int32_t)a : 0x80000000u; }
static inline vf vi_convert(vi a) { return (float)(int32_t)a; }
static inline vf vf_floor(vf a)
{
    float whole = (float)(int32_t)vf_int(a); // within int32, as pixels are
    return a < whole ? whole - 1.0f : whole;
}
static inline vi vi_load(const void *p)
{
    vi x;
    memcpy(&x, p, 4);
    return x;
}
static inline vi vi_set(uint32_t x) { return x; }
static inline vi vi_lanes(void) { return 0; }
static inline vi vi_add(vi a, vi b) { return a + b; }
static inline vi vi_sub(vi a, vi b) { return a - b; }
static inline vi vi_mul(vi a, vi b) { return a * b; }
static inline vi vi_and(vi a, vi b) { return a & b; }
static inline vi vi_or(vi a, vi b) { return a | b; }
static inline vi vi_shr(vi a, int n) { return a >> n; }
static inline vm vi_eq(vi a, vi b) { return a == b; }
static inline vm vi_lt_unsigned(vi a, vi b) { return a < b; }
static inline vi vi_gather(const void *base, vi i, vm m) { return m ? vi_load((const char *)base + (size_t)i * 4) : 0; }
static inline vi vi_gather_z(const uint64_t *keys, vi i, vm m)
{
    return m ? vi_load((const char *)keys + 8 * (size_t)i + 4) : 0;
}
static inline vi vi_load_z(const uint64_t *keys) { return (uint32_t)(*keys >> 32); }
static inline vi vi_load_id(const uint64_t *keys) { return (uint32_t)*keys; }
static inline uint32_t vm_bits(vm m) { return m; }
static inline vm vm_first(uint32_t n) { return n > 0; }
static inline vm vm_of_bits(uint32_t bits) { return bits & 1u; }
static inline vm vm_and(vm a, vm b) { return a & b; }
static inline vm vm_or(vm a, vm b) { return a | b; }
static inline vm vm_not(vm a) { return !a; }
static inline void vf_store(float *p, vf a) { *p = a; }
static inline void vi_store(void *p, vi a) { memcpy(p, &a, 4); }
static inline void vi_store_where(void *p, vi a, vm m)
{
    if (m)
        memcpy(p, &a, 4);
}

#endif

#if PT_LANES > 1 // the words of PT_LANES keys
static inline vi vi_load_z(const uint64_t *keys) { return vi_odds(vi_load(keys), vi_load(keys + PT_LANES / 2)); }
static inline vi vi_load_id(const uint64_t *keys) { return vi_evens(vi_load(keys), vi_load(keys + PT_LANES / 2)); }
#endif

#if PT_LANES == 1
static inline void vi_pack(uint32_t *p, vi a, uint32_t lanes) { *p = ((void)lanes, a); }
static inline vi vi_west(vi before, vi own) { return ((void)own, before); }
static inline vi vi_east(vi own, vi behind) { return ((void)own, behind); }
static inline vi vi_evens(vi a, vi b) { return ((void)b, a); }
static inline vi vi_odds(vi a, vi b) { return ((void)a, b); }
static inline void vi_zip(vi a, vi b, vi out[2])
{
    out[0] = a;
    out[1] = b;
}
static inline void vi_store_keys(uint64_t *keys, vi z, vi id, uint32_t lanes)
{
    if (lanes)
        *keys = (uint64_t)z << 32 | id;
}
enum { PT_KEYS_AT_ONCE = 1 };
static inline void vi_least_keys(uint64_t *keys, size_t apart, vi z, vi id)
{
    const uint64_t key = (uint64_t)z << 32 | id;
    *keys = ((void)apart, key < *keys ? key : *keys);
}
static inline vf vf_mul_where(vm m, vf a, vf b) { return m ? a * b : 0.0f; }
static inline vf vf_add_where(vm m, vf a, vf b) { return m ? a + b : a; }
#endif

#if defined(PT_ISA_AVX2) || defined(PT_ISA_SSE42)
static inline int sse_word(const char *base, size_t at)
{
    int word;
    memcpy(&word, base + at, 4);
    return word;
}
// Loads of a word each: AVX2's own gather is 40 operations and more on AMD's processors, and on Intel's that hide what it reads
// ahead. Lanes that are not asked for read the first word.
static inline vi sse_gather(const void *base, vi i, vm m, size_t scale)
{
    uint32_t at[PT_LANES];
    if (!vm_bits(m)) // there may be no first word
        return vi_set(0);
    vi_store(at, vi_and(i, m));
#if defined(PT_ISA_AVX2)
    vi words = _mm256_setr_epi32(sse_word(base, scale * at[0]), sse_word(base, scale * at[1]), sse_word(base, scale * at[2]),
                                 sse_word(base, scale * at[3]), sse_word(base, scale * at[4]), sse_word(base, scale * at[5]),
                                 sse_word(base, scale * at[6]), sse_word(base, scale * at[7]));
#else
    vi words = _mm_setr_epi32(sse_word(base, scale * at[0]), sse_word(base, scale * at[1]), sse_word(base, scale * at[2]),
                              sse_word(base, scale * at[3]));
#endif
    return vi_and(words, m);
}
static inline vi vi_gather(const void *base, vi i, vm m) { return sse_gather(base, i, m, 4); }
static inline vi vi_gather_z(const uint64_t *keys, vi i, vm m) { return sse_gather((const char *)keys + 4, i, m, 8); }
#endif

// Bytes at base + i: the word that starts there (three bytes beyond the last may be read).
#if defined(PT_ISA_AVX512)
static inline vi vi_gather_bytes(const uint8_t *base, vi i, vm m)
{
    return _mm512_mask_i32gather_epi32(_mm512_setzero_si512(), m, i, base, 1);
}
#elif defined(PT_ISA_SCALAR)
static inline vi vi_gather_bytes(const uint8_t *base, vi i, vm m) { return m ? vi_load(base + i) : 0; }
#else
static inline vi vi_gather_bytes(const uint8_t *base, vi i, vm m) { return sse_gather(base, i, m, 1); }
#endif

#define PT_ALL ((1u << PT_LANES) - 1u) // bits of all lanes
static inline vi vi_select(vm m, vi a, vi b) { return vf_bits(vf_select(m, vi_float(a), vi_float(b))); }
static inline void vf_store_where(float *p, vf a, vm m) { vi_store_where(p, vf_bits(a), m); }
// The same where nobody else writes the other lanes meanwhile: what they hold may be written again.
static inline void vi_merge(void *p, vi a, vm m)
{
#if defined(PT_ISA_AVX512)
    vi_store_where(p, a, m);
#else
    vi_store(p, vi_select(m, a, vi_load(p)));
#endif
}
static inline void vi_merge_keys(uint64_t *keys, vi z, vi id, vm m)
{
#if defined(PT_ISA_AVX512)
    vi_store_keys(keys, z, id, vm_bits(m));
#else
    vi_store_keys(keys, vi_select(m, z, vi_load_z(keys)), vi_select(m, id, vi_load_id(keys)), PT_ALL);
#endif
}

// PT_LANES float4 pixels <-> four vectors; bit i of lanes: pixel i is written.
#if PT_LANES > 1
static inline void vf_transpose(vf r[4]) // 4 x 4 within each quarter
{
    vf a = PT_VECTOR(unpacklo_ps)(r[0], r[1]), b = PT_VECTOR(unpacklo_ps)(r[2], r[3]);
    vf c = PT_VECTOR(unpackhi_ps)(r[0], r[1]), d = PT_VECTOR(unpackhi_ps)(r[2], r[3]);
    r[0] = PT_VECTOR(shuffle_ps)(a, b, 0x44);
    r[1] = PT_VECTOR(shuffle_ps)(a, b, 0xEE);
    r[2] = PT_VECTOR(shuffle_ps)(c, d, 0x44);
    r[3] = PT_VECTOR(shuffle_ps)(c, d, 0xEE);
}
static inline void vf_load4(const float *pixels, vf out[4])
{
    vf_load_pixels(pixels, out);
    vf_transpose(out);
}
// Float4 pixels of any numbers, the first pixel's where a lane is not asked for, their last float from `fourth` unless NULL.
// A pixel is one load: half the time of a gather for each of its numbers.
static inline void vf_gather3_1(const float *pixels, const float *fourth, vi i, vm lanes, vf out[4])
{
    uint32_t twice[PT_LANES];
    vi_store(twice, vi_select(lanes, vi_add(i, i), vi_set(0)));
    vf_pick_pixels(pixels, fourth, twice, out);
    vf_transpose(out);
}
static inline void vf_store4(float *pixels, const vf in[4], uint32_t lanes)
{
    vf r[4] = { in[0], in[1], in[2], in[3] };
    vf_transpose(r);
    vf_store_pixels(pixels, r, lanes);
}
#else
static inline void vf_load4(const float *pixels, vf out[4]) { memcpy(out, pixels, 16); }
static inline void vf_gather3_1(const float *pixels, const float *fourth, vi i, vm lanes, vf out[4])
{
    size_t at = lanes ? i : 0;
    vf_load4(pixels + 4 * at, out);
    out[3] = fourth ? fourth[at] : out[3];
}
static inline void vf_store4(float *pixels, const vf in[4], uint32_t lanes)
{
    if (lanes)
        memcpy(pixels, in, 16);
}
#endif

// Upper words of keys i and i + 1.
static inline void vi_gather_two_z(const uint64_t *keys, vi i, vm m, vi z[2])
{
#if defined(PT_ISA_AVX2) || defined(PT_ISA_SSE42) // one load for both
    uint32_t at[PT_LANES];
    vf words[4];
    vi_store(at, vi_select(m, i, vi_set(0)));
    vf_pick_pixels((const float *)(const void *)keys, NULL, at, words);
    vf_transpose(words);
    z[0] = vf_bits(words[1]);
    z[1] = vf_bits(words[3]);
#else
    z[0] = vi_gather_z(keys, i, m);
    z[1] = vi_gather_z(keys, vi_add(i, vi_set(1)), m);
#endif
}

static inline void vf_gather4(const float *pixels, vi i, vm lanes, vf out[4]) { vf_gather3_1(pixels, NULL, i, lanes, out); }

// Writes to the picture, which is read later and by others. count <= PT_LANES pixels of one, four or three floats. Past the
// caches where whole lines of theirs are at hand: a line of which some is stored and some streamed costs a trip to memory
// for each (finish took 35 ms with AVX2 in place of 10.5).
static inline void vf_put(float *p, vf a, uint32_t count)
{
#if defined(PT_ISA_AVX512)
    if (count == PT_LANES && (uintptr_t)p % 64 == 0) {
        vf_stream(p, a);
        return;
    }
#endif
    vf_store_where(p, a, vm_first(count));
}

static inline void vf_put4(float *p, const vf pixels[4], uint32_t count)
{
#if PT_LANES > 1
    if (count == PT_LANES && (uintptr_t)p % 64 == 0) {
        vf r[4] = { pixels[0], pixels[1], pixels[2], pixels[3] };
        vf_transpose(r);
        vf_stream_pixels(p, r);
        return;
    }
#endif
    vf_store4(p, pixels, vm_bits(vm_first(count)));
}

static inline void vf_put3(float *p, const vf n[3], uint32_t count)
{
#if defined(PT_ISA_AVX512)
    vf packed[3];
    vf_pack3(n, packed);
    for (uint32_t k = 0; k < 3; k++) {
        uint32_t floats = 3 * count <= 16 * k ? 0 : 3 * count - 16 * k;
        vf_put(p + 16 * k, packed[k], floats < 16 ? floats : 16);
    }
#else
    float pixels[4 * PT_LANES];
    const vf four[4] = { n[0], n[1], n[2], vf_set(0.0f) };
    vf_store4(pixels, four, PT_ALL);
    for (uint32_t i = 0; i + 1 < count; i++) // each store's fourth float is overwritten by the next point's first
        memcpy(p + 3 * i, pixels + 4 * i, 16);
    memcpy(p + 3 * (count - 1), pixels + 4 * (count - 1), 12);
#endif
}

// ---- the rest is the same for every level ---------------------------------------------------------------------------

// Eight floats or integers side by side at every level: what is summed for a pixel. Not a vector of lanes.
typedef float vf_eight __attribute__((vector_size(32), aligned(4), may_alias));
typedef int32_t vi_eight __attribute__((vector_size(32), aligned(4), may_alias));
// Words of bits side by side, four at every level: what planes of bits are worked on by.
typedef uint64_t vi_words __attribute__((vector_size(32), aligned(8), may_alias));

static inline vi vi_gather_id(const uint64_t *keys, vi i, vm m) // lower words of keys
{
    return vi_gather_z((const uint64_t *)(const void *)((const char *)keys - 4), i, m);
}
static inline vf vf_gather(const float *base, vi i, vm m) { return vi_float(vi_gather(base, i, m)); }
static inline vf vf_west(vf before, vf own) { return vi_float(vi_west(vf_bits(before), vf_bits(own))); }
static inline vf vf_east(vf own, vf behind) { return vi_float(vi_east(vf_bits(own), vf_bits(behind))); }
// vi_least_keys: keys[i] = min(keys[i], z << 32 | id), of the first half of the lanes; of the others at keys + apart. No key's
// first bit is set. PT_KEYS_AT_ONCE lie in one vector: where they begin at its multiples, what is written is read again soon.
#if defined(PT_ISA_AVX2) || defined(PT_ISA_SSE42)
enum { PT_KEYS_AT_ONCE = PT_LANES / 2 };
static inline void vi_least_keys(uint64_t *keys, size_t apart, vi z, vi id)
{
    vi words[2];
    vi_zip(id, z, words);
    for (size_t k = 0; k < 2; k++) {
        vi old = vi_load(keys + k * apart);
        vi least = PT_VECTOR(blendv_epi8)(old, words[k], PT_VECTOR(cmpgt_epi64)(old, words[k]));
        memcpy(keys + k * apart, &least, sizeof least);
    }
}
#endif

#if !defined(PT_ISA_AVX512)
static inline vf vf_look_up(const float *table, int size, vi i)
{
    (void)size;
    return vf_gather(table, i, vm_first(PT_LANES));
}
#endif
static inline vf vf_abs(vf a) { return vi_float(vi_and(vf_bits(a), vi_set(0x7FFFFFFFu))); }
static inline vf vf_zero(void) { return vf_set(0.0f); }

#if PT_LANES >= 8
static inline void avx_columns(const float *row, const uint32_t at[8], __m256 out[8])
{
    __m256 a[8], b[8];
    for (int i = 0; i < 8; i++)
        a[i] = _mm256_loadu_ps(row + at[i]);
    for (int i = 0; i < 8; i += 2) {
        b[i] = _mm256_unpacklo_ps(a[i], a[i + 1]);
        b[i + 1] = _mm256_unpackhi_ps(a[i], a[i + 1]);
    }
    for (int i = 0; i < 8; i += 4)
        for (int k = 0; k < 2; k++) {
            a[i + 2 * k] = _mm256_shuffle_ps(b[i + k], b[i + k + 2], 0x44);
            a[i + 2 * k + 1] = _mm256_shuffle_ps(b[i + k], b[i + k + 2], 0xEE);
        }
    for (int k = 0; k < 4; k++) {
        out[k] = _mm256_permute2f128_ps(a[k], a[k + 4], 0x20);
        out[k + 4] = _mm256_permute2f128_ps(a[k], a[k + 4], 0x31);
    }
}
#endif

// Lane i of out[k] is row[at[i] + k]: PT_LANES columns from PT_LANES places of a row. A load a lane and 3 operations a vector;
// AVX2's gather takes 24, and AVX-512's 81.
static inline void vf_columns(const float *row, const uint32_t at[PT_LANES], vf out[PT_LANES])
{
#if PT_LANES == 16
    for (int k = 0; k < 16; k += 8) {
        __m256 low[8], high[8];
        avx_columns(row + k, at, low);
        avx_columns(row + k, at + 8, high);
        for (int i = 0; i < 8; i++)
            out[k + i] = _mm512_insertf32x8(_mm512_castps256_ps512(low[i]), high[i], 1);
    }
#elif PT_LANES == 8
    avx_columns(row, at, out);
#elif PT_LANES == 4
    for (int i = 0; i < 4; i++)
        out[i] = vf_load(row + at[i]);
    _MM_TRANSPOSE4_PS(out[0], out[1], out[2], out[3]);
#else
    out[0] = row[at[0]];
#endif
}

#endif
