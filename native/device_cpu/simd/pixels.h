// SPDX-License-Identifier: GPL-3.0-or-later
// Pixels of four floats and keys, for every instruction set of more than a lane.
#ifndef PT_SIMD_PIXELS_H
#define PT_SIMD_PIXELS_H

static inline vi vi_load_z(const uint64_t *keys) { return vi_odds(vi_load(keys), vi_load(keys + PT_LANES / 2)); }
static inline vi vi_load_id(const uint64_t *keys) { return vi_evens(vi_load(keys), vi_load(keys + PT_LANES / 2)); }

#ifdef PT_VECTOR
static inline void vf_transpose(vf r[4]) // 4 x 4 within each quarter
{
    vf a = PT_VECTOR(unpacklo_ps)(r[0], r[1]), b = PT_VECTOR(unpacklo_ps)(r[2], r[3]);
    vf c = PT_VECTOR(unpackhi_ps)(r[0], r[1]), d = PT_VECTOR(unpackhi_ps)(r[2], r[3]);
    r[0] = PT_VECTOR(shuffle_ps)(a, b, 0x44);
    r[1] = PT_VECTOR(shuffle_ps)(a, b, 0xEE);
    r[2] = PT_VECTOR(shuffle_ps)(c, d, 0x44);
    r[3] = PT_VECTOR(shuffle_ps)(c, d, 0xEE);
}
#endif
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
    vf r[4] = {in[0], in[1], in[2], in[3]};
    vf_transpose(r);
    vf_store_pixels(pixels, r, lanes);
}
static inline void vf_put4(float *p, const vf pixels[4], uint32_t count)
{
    if (count == PT_LANES && (uintptr_t)p % 64 == 0) {
        vf r[4] = {pixels[0], pixels[1], pixels[2], pixels[3]};
        vf_transpose(r);
        vf_stream_pixels(p, r);
    } else
        vf_store4(p, pixels, vm_bits(vm_first(count)));
}

#endif
