// SPDX-License-Identifier: GPL-3.0-or-later
// What instruction sets of 4 lanes do alike, once their vectors are known: SSE4.2 and NEON.
#ifndef PT_SIMD_FOUR_H
#define PT_SIMD_FOUR_H

static inline void vi_store_keys(uint64_t *keys, vi z, vi id, uint32_t lanes)
{
    uint64_t words[4];
    vi two[2];
    vi_zip(id, z, two);
    vi_store(words, two[0]);
    vi_store(words + 2, two[1]);
    for (int k = 0; k < 4; k++)
        if (lanes >> k & 1u)
            keys[k] = words[k];
}
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
        r[k] = vf_load(p + 4 * k);
}
static inline void vf_pick_pixels(const float *p, const float *fourth, const uint32_t i[4], vf r[4])
{
    for (int k = 0; k < 4; k++)
        r[k] = vf_pixel(p, fourth, i[k]);
}
static inline void vf_store_pixels(float *p, vf r[4], uint32_t lanes)
{
    for (int k = 0; k < 4; k++)
        if (lanes >> k & 1u)
            vf_store(p + 4 * k, r[k]);
}
static inline void vf_stream_pixels(float *p, vf r[4])
{
    for (int k = 0; k < 4; k++)
        vf_stream(p + 4 * k, r[k]);
}
static inline void vi_pack(uint32_t *p, vi a, uint32_t lanes)
{
#define FROM(i, j, k, l)                                                                                                       \
    {                                                                                                                          \
        0x03020100 + i * 0x04040404, 0x03020100 + j * 0x04040404, 0x03020100 + k * 0x04040404, 0x03020100 + l * 0x04040404     \
    }
    static const int32_t from[16][4] = {FROM(0, 0, 0, 0), FROM(0, 0, 0, 0), FROM(1, 0, 0, 0), FROM(0, 1, 0, 0),
                                        FROM(2, 0, 0, 0), FROM(0, 2, 0, 0), FROM(1, 2, 0, 0), FROM(0, 1, 2, 0),
                                        FROM(3, 0, 0, 0), FROM(0, 3, 0, 0), FROM(1, 3, 0, 0), FROM(0, 1, 3, 0),
                                        FROM(2, 3, 0, 0), FROM(0, 2, 3, 0), FROM(1, 2, 3, 0), FROM(0, 1, 2, 3)};
#undef FROM
    vi_store(p, vi_pick_bytes(a, from[lanes]));
}

#endif
