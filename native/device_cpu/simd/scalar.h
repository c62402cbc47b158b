// SPDX-License-Identifier: GPL-3.0-or-later
// No vectors: the same kernels, a lane at a time.
#ifndef PT_SIMD_SCALAR_H
#define PT_SIMD_SCALAR_H

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
// Reads four bytes, since vi_gather_id begins four bytes before the keys. Another thread may lower the key meanwhile.
static inline vi vi_gather_z(const uint64_t *keys, vi i, vm m)
{
    typedef uint32_t __attribute__((may_alias)) half;
    return m ? __atomic_load_n((const half *)(const void *)((const char *)keys + 8 * (size_t)i + 4), __ATOMIC_RELAXED) : 0;
}
// Another thread may lower the key meanwhile, here too: raster reads before it writes.
static inline vi vi_load_z(const uint64_t *keys) { return (uint32_t)(__atomic_load_n(keys, __ATOMIC_RELAXED) >> 32); }
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
static inline void vi_pack(uint32_t *p, vi a, uint32_t lanes) { vi_store(p, ((void)lanes, a)); } // of floats too
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
static inline vi vi_gather_bytes(const uint8_t *base, vi i, vm m) { return m ? vi_load(base + i) : 0; }
static inline void vi_gather_two_z(const uint64_t *keys, vi i, vm m, vi z[2])
{
    z[0] = vi_gather_z(keys, i, m);
    z[1] = vi_gather_z(keys, i + 1, m);
}
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
static inline void vf_put4(float *p, const vf pixels[4], uint32_t count) { vf_store4(p, pixels, count > 0); }
static inline void vf_columns(const float *row, const uint32_t at[PT_LANES], vf out[PT_LANES]) { out[0] = row[at[0]]; }

#endif
