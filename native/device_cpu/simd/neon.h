// SPDX-License-Identifier: GPL-3.0-or-later
// NEON of 64-bit ARM: 4 lanes. Where its operations answer otherwise than x86's, the latter's answer is given: the second of two of
// which one is not a number, 0x80000000 for what no integer holds (tests/unit/test_simd.c, which holds one instruction set of each processor to it).
#ifndef PT_SIMD_NEON_H
#define PT_SIMD_NEON_H

#include <arm_neon.h>

#define PT_LANES 4
typedef float32x4_t vf;
typedef uint32x4_t vi;
typedef uint32x4_t vm;
static inline vf vf_load(const float *p) { return vld1q_f32(p); }
static inline vf vf_set(float x) { return vdupq_n_f32(x); }
static inline vf vf_max(vf a, vf b) { return vbslq_f32(vcgtq_f32(a, b), a, b); } // vmaxq: what is not a number, and 0 before -0
static inline vf vf_min(vf a, vf b) { return vbslq_f32(vcltq_f32(a, b), a, b); }
static inline vm vf_lt(vf a, vf b) { return vcltq_f32(a, b); }
static inline vm vf_le(vf a, vf b) { return vcleq_f32(a, b); }
static inline vf vf_select(vm m, vf a, vf b) { return vbslq_f32(m, a, b); }
static inline vi vf_bits(vf a) { return vreinterpretq_u32_f32(a); }
static inline vf vi_float(vi a) { return vreinterpretq_f32_u32(a); }
static inline vi vf_int(vf a) // vcvtq: the nearest integer, 0 for what is not a number
{
    const vm within = vandq_u32(vcgeq_f32(a, vf_set(-0x1p31f)), vcltq_f32(a, vf_set(0x1p31f)));
    return vbslq_u32(within, vreinterpretq_u32_s32(vcvtq_s32_f32(a)), vdupq_n_u32(0x80000000u));
}
static inline vf vf_floor(vf a) { return vrndmq_f32(a); }
static inline vf vi_convert(vi a) { return vcvtq_f32_s32(vreinterpretq_s32_u32(a)); }
static inline vi vi_load(const void *p) { return vreinterpretq_u32_u8(vld1q_u8(p)); }
static inline void vf_store(float *p, vf a) { vst1q_f32(p, a); }
static inline void vi_store(void *p, vi a) { vst1q_u8(p, vreinterpretq_u8_u32(a)); }
static inline vi vi_set(uint32_t x) { return vdupq_n_u32(x); }
static inline vi vi_lanes(void) { return (vi){0, 1, 2, 3}; }
static inline vi vi_add(vi a, vi b) { return vaddq_u32(a, b); }
static inline vi vi_sub(vi a, vi b) { return vsubq_u32(a, b); }
static inline vi vi_mul(vi a, vi b) { return vmulq_u32(a, b); }
static inline vi vi_and(vi a, vi b) { return vandq_u32(a, b); }
static inline vi vi_or(vi a, vi b) { return vorrq_u32(a, b); }
static inline vi vi_shr(vi a, int n) { return vshlq_u32(a, vdupq_n_s32(-n)); }
static inline vm vi_eq(vi a, vi b) { return vceqq_u32(a, b); }
static inline vm vi_lt_unsigned(vi a, vi b) { return vcltq_u32(a, b); }
static inline uint32_t vm_bits(vm m) { return vaddvq_u32(vandq_u32(m, (vi){1, 2, 4, 8})); }
static inline vi vi_evens(vi a, vi b) { return vuzp1q_u32(a, b); }
static inline vi vi_odds(vi a, vi b) { return vuzp2q_u32(a, b); }
static inline void vi_zip(vi a, vi b, vi out[2])
{
    out[0] = vzip1q_u32(a, b);
    out[1] = vzip2q_u32(a, b);
}
static inline vm vm_first(uint32_t n) { return vcltq_u32(vi_lanes(), vdupq_n_u32(n)); }
static inline vm vm_of_bits(uint32_t bits) { return vtstq_u32(vdupq_n_u32(bits), (vi){1, 2, 4, 8}); }
static inline vm vm_and(vm a, vm b) { return vandq_u32(a, b); }
static inline vm vm_or(vm a, vm b) { return vorrq_u32(a, b); }
static inline vm vm_not(vm a) { return vmvnq_u32(a); }
static inline vf vf_mul_where(vm m, vf a, vf b) { return vi_float(vandq_u32(vf_bits(a * b), m)); }
static inline vf vf_add_where(vm m, vf a, vf b) { return a + vi_float(vandq_u32(vf_bits(b), m)); }
static inline vi vi_west(vi before, vi own) { return vextq_u32(before, own, 3); }
static inline vi vi_east(vi own, vi behind) { return vextq_u32(own, behind, 1); }
static inline vi vi_pick_bytes(vi a, const void *from)
{
    return vreinterpretq_u32_u8(vqtbl1q_u8(vreinterpretq_u8_u32(a), vreinterpretq_u8_u32(vi_load(from))));
}
static inline void vf_stream(float *p, vf a) { vst1q_f32(p, a); } // there is no store past the caches of a vector alone
static inline vf vf_pixel(const float *p, const float *fourth, uint32_t twice)
{
    const vf pixel = vf_load(p + 2 * (size_t)twice);
    return fourth ? vld1q_lane_f32((const float *)(const void *)((const char *)fourth + 2 * (size_t)twice), pixel, 3) : pixel;
}
static inline void vf_transpose(vf r[4])
{
    const float32x4x2_t a = vtrnq_f32(r[0], r[1]), b = vtrnq_f32(r[2], r[3]);
    for (int k = 0; k < 2; k++) {
        r[k] = vcombine_f32(vget_low_f32(a.val[k]), vget_low_f32(b.val[k]));
        r[2 + k] = vcombine_f32(vget_high_f32(a.val[k]), vget_high_f32(b.val[k]));
    }
}
static inline vi vi_least_pairs(vi a, vi b) // of 64 bits each, signed
{
    return vbslq_u32(vreinterpretq_u32_u64(vcgtq_s64(vreinterpretq_s64_u32(a), vreinterpretq_s64_u32(b))), b, a);
}
static inline vi vi_pick(const char *base, size_t scale, const uint32_t at[PT_LANES])
{
    uint32_t words[4];
    for (int i = 0; i < 4; i++)
        memcpy(&words[i], base + scale * at[i], 4);
    return vi_load(words);
}
static inline void vf_columns(const float *row, const uint32_t at[PT_LANES], vf out[PT_LANES])
{
    for (int i = 0; i < 4; i++)
        out[i] = vf_load(row + at[i]);
    vf_transpose(out);
}
#include "four.h"

#endif
