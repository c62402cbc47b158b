// SPDX-License-Identifier: GPL-3.0-or-later
// Vectors answer as the header says where processors differ: minimum and maximum of what is not a number and of two zeros,
// conversion of what no integer holds, shifts, packing. Compiled for each instruction set with vectors that the compiler has: test_simd for
// the first, test_simd_LEVEL for the others.
#include "base/platform.h"
#include "device_cpu/cpu.h"
#include "device_cpu/simd.h"
#include "device_cpu/tables.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

// Numbers that processors treat each in their way; the first four bits of a NaN's payload tell two apart.
static const uint32_t odd[] = {
    0x00000000u, 0x80000000u, 0x3F800000u, 0xBF800000u, 0x3FC00000u, 0xBFC00000u,
    0x00000001u, 0x80000001u,                                                     // 0, 1, 1.5, the least
    0x4EFFFFFFu, 0x4F000000u, 0xCF000000u, 0xCF000001u, 0x4F800000u, 0x7F7FFFFFu, // about 2^31, -2^31, 2^32, the largest
    0x7F800000u, 0xFF800000u, 0x7FC00000u, 0xFFC00000u, 0x7FC12345u, 0x4B000001u,
    0x3EFFFFFFu, 0xC2C80001u,
};
enum { ODD = sizeof odd / sizeof odd[0] };

static float number(uint32_t bits)
{
    float x;
    memcpy(&x, &bits, 4);
    return x;
}

static uint32_t bits_of(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, 4);
    return bits;
}

static vf spread(float x, int lane) // 7 in all other lanes
{
    float all[PT_LANES];
    for (int k = 0; k < PT_LANES; k++)
        all[k] = k == lane ? x : 7.0f;
    return vf_load(all);
}

static float at(vf v, int lane)
{
    float all[PT_LANES];
    vf_store(all, v);
    return all[lane];
}

static uint32_t word_at(vi v, int lane)
{
    uint32_t all[PT_LANES];
    vi_store(all, v);
    return all[lane];
}

static void test_pairs_of_odd_numbers(void **state)
{
    (void)state;
    for (int i = 0; i < ODD; i++)
        for (int k = 0; k < ODD; k++) {
            const int lane = (i + k) % PT_LANES;
            const float a = number(odd[i]), b = number(odd[k]);
            const vf va = spread(a, lane), vb = spread(b, lane);
            assert_int_equal(bits_of(at(vf_max(va, vb), lane)), a > b ? odd[i] : odd[k]); // else the second
            assert_int_equal(bits_of(at(vf_min(va, vb), lane)), a < b ? odd[i] : odd[k]);
            assert_int_equal(vm_bits(vf_lt(va, vb)) >> lane & 1u, a < b);
            assert_int_equal(vm_bits(vf_le(va, vb)) >> lane & 1u, a <= b);
            assert_int_equal(vm_bits(vi_lt_unsigned(vf_bits(va), vf_bits(vb))) >> lane & 1u, odd[i] < odd[k]);
            assert_int_equal(bits_of(at(vf_select(vf_lt(va, vb), va, vb), lane)), a < b ? odd[i] : odd[k]);
            assert_int_equal(bits_of(at(vf_mul_where(vf_lt(va, vb), vf_set(1.0f), va), lane)) & (a < b ? 0u : ~0u), 0);
        }
}

static void test_conversions(void **state)
{
    (void)state;
    for (int i = 0; i < ODD; i++) {
        const int lane = i % PT_LANES;
        const float a = number(odd[i]);
        const int held = a >= -0x1p31f && a < 0x1p31f;
        assert_int_equal(word_at(vf_int(spread(a, lane)), lane), held ? (uint32_t)(int32_t)a : 0x80000000u);
        if (held) // of pixels
            assert_true(at(vf_floor(spread(a, lane)), lane) == floorf(a));
        assert_true(at(vi_convert(vi_set(odd[i])), lane) == (float)(int32_t)odd[i]);
        for (int n = 0; n < 32; n++)
            assert_int_equal(word_at(vi_shr(vi_set(odd[i]), n), lane), odd[i] >> n);
    }
}

// Lanes move where they should: packed, zipped, taken from neighbours, of keys the least.
static void test_lanes(void **state)
{
    (void)state;
    uint32_t a[PT_LANES], b[PT_LANES], out[2 * PT_LANES];
    for (uint32_t k = 0; k < PT_LANES; k++) {
        a[k] = 100 + k;
        b[k] = 0x80000000u + k;
    }
    for (uint32_t lanes = 0; lanes < 1u << PT_LANES; lanes++) {
        vi_pack(out, vi_load(a), lanes);
        for (uint32_t k = 0, n = 0; k < PT_LANES; k++)
            if (lanes >> k & 1u)
                assert_int_equal(out[n++], a[k]);
        assert_int_equal(vm_bits(vm_of_bits(lanes)), lanes);
        uint64_t keys[PT_LANES] = {0};
        vi_store_keys(keys, vi_load(b), vi_load(a), lanes);
        for (uint32_t k = 0; k < PT_LANES; k++)
            assert_true(keys[k] == (lanes >> k & 1u ? (uint64_t)b[k] << 32 | a[k] : 0));
    }
    for (uint32_t n = 0; n <= PT_LANES; n++)
        assert_int_equal(vm_bits(vm_first(n)), (1u << n) - 1u);
#if PT_LANES > 1
    vi zipped[2];
    vi_zip(vi_load(a), vi_load(b), zipped);
    vi_store(out, zipped[0]);
    vi_store(out + PT_LANES, zipped[1]);
    for (uint32_t k = 0; k < 2 * PT_LANES; k++)
        assert_int_equal(out[k], k & 1u ? b[k / 2] : a[k / 2]);
    for (uint32_t k = 0; k < PT_LANES; k++) {
        assert_int_equal(word_at(vi_evens(zipped[0], zipped[1]), (int)k), a[k]);
        assert_int_equal(word_at(vi_odds(zipped[0], zipped[1]), (int)k), b[k]);
        assert_int_equal(word_at(vi_west(vi_load(b), vi_load(a)), (int)k), k ? a[k - 1] : b[PT_LANES - 1]);
        assert_int_equal(word_at(vi_east(vi_load(a), vi_load(b)), (int)k), k + 1 < PT_LANES ? a[k + 1] : b[0]);
    }
    uint64_t keys[PT_LANES];
    for (uint32_t k = 0; k < PT_LANES; k++)
        keys[k] = (uint64_t)50 << 32 | (k & 1u ? 7u : 0xFFFFFFF0u);
    vi_least_keys(keys, PT_LANES / 2, vi_set(50), vi_set(9));
    for (uint32_t k = 0; k < PT_LANES; k++)
        assert_true(keys[k] == ((uint64_t)50 << 32 | (k & 1u ? 7u : 9u)));
#endif
}

// A kernel whose map has no pixels has no keys, either, and asks for none.
static void test_no_lanes(void **state)
{
    (void)state;
    const vi at = vi_lanes();
    const vm none = vm_of_bits(0);
    for (int k = 0; k < PT_LANES; k++) {
        assert_int_equal(word_at(vi_gather(NULL, at, none), k), 0);
        assert_int_equal(word_at(vi_gather_z(NULL, at, none), k), 0);
        assert_int_equal(word_at(vi_gather_id(NULL, at, none), k), 0);
    }
}

// Of this build.
static enum pt_vectors level(void)
{
#if defined(PT_ISA_AVX512)
    return PT_VECTORS_AVX512;
#elif defined(PT_ISA_AVX2)
    return PT_VECTORS_AVX2;
#else
    return PT_VECTORS_NONE;
#endif
}

int main(void)
{
    if (level() > pt_processor_vectors()) {
        puts("skip all: this processor lacks the instruction set\n0 passed, 0 failed, 4 skipped");
        return 0;
    }
    pt_cpu_tables_fill(); // which vi_pack looks up; a device does so
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pairs_of_odd_numbers),
        cmocka_unit_test(test_conversions),
        cmocka_unit_test(test_lanes),
        cmocka_unit_test(test_no_lanes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
