// SPDX-License-Identifier: GPL-3.0-or-later
// Levels whose gathers are loads of a word each and whose stores know no mask: AVX2, SSE4.2 and NEON.
#ifndef PT_SIMD_UNMASKED_H
#define PT_SIMD_UNMASKED_H

// Loads of a word each: AVX2's own gather is 40 operations and more on AMD's processors, and on Intel's that hide what it reads
// ahead. Lanes that are not asked for read the first word.
static inline vi gather(const void *base, vi i, vm m, size_t scale)
{
    uint32_t at[PT_LANES];
    if (!vm_bits(m)) // there may be no first word
        return vi_set(0);
    vi_store(at, vi_and(i, m));
    const vi words = vi_pick(base, scale, at);
    return vi_and(words, m);
}
static inline vi vi_gather(const void *base, vi i, vm m) { return gather(base, i, m, 4); }
static inline vi vi_gather_z(const uint64_t *keys, vi i, vm m) { return gather(pt_moved(keys, 4), i, m, 8); }
static inline vi vi_gather_bytes(const uint8_t *base, vi i, vm m) { return gather(base, i, m, 1); }
// One load for both.
static inline void vi_gather_two_z(const uint64_t *keys, vi i, vm m, vi z[2])
{
    uint32_t at[PT_LANES];
    vf words[4];
    vi_store(at, vi_select(m, i, vi_set(0)));
    vf_pick_pixels((const float *)(const void *)keys, NULL, at, words);
    vf_transpose(words);
    z[0] = vf_bits(words[1]);
    z[1] = vf_bits(words[3]);
}
#ifdef PT_VECTOR
static inline vi vi_least_pairs(vi a, vi b)
{
    return PT_VECTOR(blendv_epi8)(a, b, PT_VECTOR(cmpgt_epi64)(a, b));
} // of 64 bits each, signed
#endif
enum { PT_KEYS_AT_ONCE = PT_LANES / 2 };
static inline void vi_least_keys(uint64_t *keys, size_t apart, vi z, vi id)
{
    vi words[2];
    vi_zip(id, z, words);
    for (size_t k = 0; k < 2; k++) {
        vi old = vi_load(keys + k * apart);
        vi least = vi_least_pairs(old, words[k]);
        memcpy(keys + k * apart, &least, sizeof least);
    }
}

#endif
