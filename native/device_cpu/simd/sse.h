// SPDX-License-Identifier: GPL-3.0-or-later
// What the instruction sets of x86 load alike, before their vectors are known.
#ifndef PT_SIMD_SSE_H
#define PT_SIMD_SSE_H

#include <immintrin.h>

// The float4 pixel of half this number; fourth: where its last float comes from, NULL for its own.
static inline __m128 sse_pixel(const float *p, const float *fourth, uint32_t twice)
{
    __m128 pixel = _mm_loadu_ps(p + 2 * (size_t)twice);
    if (!fourth)
        return pixel;
    return _mm_insert_ps(pixel, _mm_load_ss((const float *)(const void *)((const char *)fourth + 2 * (size_t)twice)), 0x30);
}
static inline __attribute__((always_inline)) int sse_word(const char *base, size_t at)
{
    int word;
    memcpy(&word, base + at, 4);
    return word;
}

#ifdef __AVX__
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

#endif
