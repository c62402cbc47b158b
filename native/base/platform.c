// SPDX-License-Identifier: GPL-3.0-or-later
// Of platform.h, what is the same on every system.
#include "platform.h"

#if defined(__x86_64__)
#include <cpuid.h>
#endif

#if defined(__x86_64__)
// Which registers the system keeps when it changes threads: XCR0, Intel SDM 1, 13.3. By its bytes: XGETBV is no instruction of the
// processors that this file is compiled for.
static uint32_t kept_registers(void)
{
    uint32_t low, high;
    __asm__ volatile(".byte 0x0f, 0x01, 0xd0" : "=a"(low), "=d"(high) : "c"(0));
    return low;
}

// Not the compiler's own way: its run-time library lacks that where it is not the system's.
enum pt_vectors pt_processor_vectors(void)
{
    enum { // Intel SDM 2A, CPUID
        SSE42 = 1 << 20,
        POPCNT = 1 << 23,
        XSAVE = 1 << 27,
        BMI = 1 << 3,
        AVX2 = 1 << 5,
        BMI2 = 1 << 8,
        AVX512F = 1 << 16,
        AVX512DQ = 1 << 17,
        AVX512CD = 1 << 28,
        AVX512BW = 1 << 30,
        LZCNT = 1 << 5,
        WIDE = 0x6,   // of XCR0: xmm and ymm
        WIDEST = 0xe6 // and masks, and zmm's halves
    };
    const uint32_t vl = 1u << 31;
    uint32_t a, b = 0, c = 0, d, wide = 0, more = 0;
    if (!__get_cpuid(1, &a, &b, &c, &d) || (c & (SSE42 | POPCNT)) != (SSE42 | POPCNT))
        return PT_VECTORS_NONE;
    if (!(c & XSAVE))
        return PT_VECTORS_SSE42;
    const uint32_t kept = kept_registers();
    if (__get_cpuid_count(7, 0, &a, &b, &c, &d))
        wide = b;
    if (__get_cpuid(0x80000001, &a, &b, &c, &d))
        more = c;
    const uint32_t avx2 = BMI | AVX2 | BMI2, avx512 = AVX512F | AVX512DQ | AVX512CD | AVX512BW | vl;
    if ((kept & WIDE) != WIDE || (wide & avx2) != avx2 || !(more & LZCNT))
        return PT_VECTORS_SSE42;
    return (kept & WIDEST) == WIDEST && (wide & avx512) == avx512 ? PT_VECTORS_AVX512 : PT_VECTORS_AVX2;
}
#elif defined(__aarch64__)
enum pt_vectors pt_processor_vectors(void) { return PT_VECTORS_NEON; } // of every one with 64 bits
#else
enum pt_vectors pt_processor_vectors(void) { return PT_VECTORS_NONE; }
#endif
