// SPDX-License-Identifier: GPL-3.0-or-later
// What a mesh's image shows at PT_LANES pixels of a row: see struct texture_args; twin of shaders/lib/texture.glsl
#ifndef PT_TEXTURE_KERNELS_H
#define PT_TEXTURE_KERNELS_H

#include "device_cpu/tables.h"
#include "triangle.h"

static const float pt_side_most = 1e15f; // of the image, to the next pixel

// Of pixels: where on the image they lie, and how far the next ones to the right and above do from there, in widths and heights.
struct pt_on_image {
    vf at[2], side[2][2];
};

// Where the weights f of the three corners, whose sum is positive, lie on the image, from `at`.
static inline void pt_image_side(const vf f[3], const vf corner[3][2], const vf at[2], vf side[2])
{
    const vf most = vf_set(pt_side_most), sum = (f[0] + f[1]) + f[2];
    const vm good = vm_and(vf_le(vf_set(1e-30f), sum), vf_le(sum, vf_set(1e30f)));
    const vf scale = vf_rcp(vf_select(good, sum, vf_set(1.0f)));
    for (int k = 0; k < 2; k++) {
        vf there = ((f[0] * scale) * corner[0][k] + (f[1] * scale) * corner[1][k]) + (f[2] * scale) * corner[2][k];
        side[k] = there - at[k];
        side[k] = vf_select(vm_and(good, vf_le(vf_abs(side[k]), most)), side[k], most);
    }
}

// 1. of the triangles t.
static inline void pt_place_on_image(const struct pt_triangle *t, const struct texture_args *image, const float *vertices,
                                     vm lanes, struct pt_on_image *out)
{
    vf corner[3][2];
    for (uint32_t i = 0; i < 3; i++)
        for (uint32_t k = 0; k < 2; k++)
            corner[i][k] = vf_gather(vertices, vi_add(t->corner[i], vi_set(image->uv + k)), lanes);
    for (int k = 0; k < 2; k++)
        out->at[k] = (t->share[0] * corner[0][k] + t->share[1] * corner[1][k]) + t->share[2] * corner[2][k];
    for (int next = 0; next < 2; next++) {
        vf u[3], v[3], f[3];
        for (int i = 0; i < 3; i++) {
            u[i] = t->away[i][0];
            v[i] = t->away[i][1];
            if (next)
                v[i] = v[i] - t->depth[i];
            else
                u[i] = u[i] - t->depth[i];
        }
        for (int i = 0; i < 3; i++) {
            f[i] = u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3];
            f[i] = vf_select(t->turned, vf_zero() - f[i], f[i]);
        }
        pt_image_side(f, corner, out->at, out->side[next]);
    }
}

// Adds texels, colour by opacity, times a weight.
static inline void pt_add_texel(const struct texture_args *image, const uint32_t *texels, vi index, vf weight, vm lanes,
                                vf sum[4])
{
    vf c[4];
    if (image->format == PT_TEXELS_FLOAT) {
        for (uint32_t k = 0; k < 4; k++)
            c[k] = vf_gather((const float *)texels, vi_add(vi_mul(index, vi_set(4)), vi_set(k)), lanes);
    } else {
        const vi word = vi_gather(texels, index, lanes);
        for (uint32_t k = 0; k < 4; k++) {
            const vi byte = vi_and(vi_shr(word, 8 * k), vi_set(255));
            c[k] = vi_convert(byte) * vf_set(1.0f / 255.0f);
            if (k < 3 && image->format == PT_TEXELS_SRGB)
                c[k] = vf_look_up(pt_srgb_table, 256, byte);
        }
    }
    const vf share = vf_select(lanes, c[3] * weight, vf_zero());
    for (int k = 0; k < 3; k++)
        sum[k] = sum[k] + vf_select(lanes, c[k] * share, vf_zero());
    sum[3] = sum[3] + share;
}

// A column or row of the image next to another: into the image.
static inline vi pt_wrap_texel(const struct texture_args *image, vi x, vi size)
{
    const vi last = vi_sub(size, vi_set(1));
    const vm before = vi_eq(x, vi_set(0xFFFFFFFFu)), inside = vi_lt_unsigned(x, size);
    const int repeats = image->wrap == PT_WRAP_REPEAT;
    return vi_select(inside, x, vi_select(before, repeats ? last : vi_set(0), repeats ? vi_set(0) : last));
}

// 3. of one level.
static inline void pt_add_level(const struct texture_args *image, const uint32_t *texels, vi level, const vf at[2], vf weight,
                                vm lanes, vf sum[4])
{
    const vi three = vi_mul(level, vi_set(3)), first = vi_gather(image->sizes, vi_add(three, vi_set(2)), lanes);
    vi near[2], far[2], size[2], base[2];
    vf toward[2];
    for (uint32_t k = 0; k < 2; k++) {
        size[k] = vi_gather(image->sizes, vi_add(three, vi_set(k)), lanes);
        const vf x = at[k] * vi_convert(size[k]) - vf_set(0.5f), whole = vf_floor(x);
        toward[k] = x - whole;
        base[k] = vf_int(whole);
        near[k] = pt_wrap_texel(image, base[k], size[k]);
        far[k] = pt_wrap_texel(image, vi_add(base[k], vi_set(1)), size[k]);
    }
    vm ends[4] = {lanes, lanes, lanes, lanes}; // left, right, low, high: whether they are on the image
    if (image->wrap == PT_WRAP_CLIP)
        for (uint32_t k = 0; k < 4; k++)
            ends[k] = vm_and(lanes, vi_lt_unsigned(vi_add(base[k / 2], vi_set(k % 2)), size[k / 2]));
    const vf one = vf_set(1.0f), below = (one - toward[1]) * weight, above = toward[1] * weight;
    const vi low = vi_add(first, vi_mul(near[1], size[0])), high = vi_add(first, vi_mul(far[1], size[0]));
    pt_add_texel(image, texels, vi_add(low, near[0]), (one - toward[0]) * below, vm_and(ends[0], ends[2]), sum);
    pt_add_texel(image, texels, vi_add(low, far[0]), toward[0] * below, vm_and(ends[1], ends[2]), sum);
    pt_add_texel(image, texels, vi_add(high, near[0]), (one - toward[0]) * above, vm_and(ends[0], ends[3]), sum);
    pt_add_texel(image, texels, vi_add(high, far[0]), toward[0] * above, vm_and(ends[1], ends[3]), sum);
}

// The texel of the finest level that a place lies in.
static inline void pt_add_nearest(const struct texture_args *image, const uint32_t *texels, const vf at[2], vm lanes, vf sum[4])
{
    vi x[2];
    for (int k = 0; k < 2; k++) {
        const vf size = vf_set((float)image->sizes[k]);
        x[k] = vf_int(vf_min(vf_floor(at[k] * size), size - vf_set(1.0f)));
    }
    pt_add_texel(image, texels, vi_add(vi_mul(x[1], vi_set(image->sizes[0])), x[0]), vf_set(1.0f), lanes, sum);
}

// Into 0..1; of a clipped image into -1..2, where its border fades out over half a texel.
static inline void pt_wrap_place(const struct texture_args *image, vf at[2])
{
    const int clips = image->wrap == PT_WRAP_CLIP;
    const vf low = vf_set(clips ? -1.0f : 0.0f), high = vf_set(clips ? 2.0f : 1.0f);
    for (int k = 0; k < 2; k++) {
        vf x = at[k];
        if (image->wrap == PT_WRAP_REPEAT)
            x = x - vf_floor(x);
        at[k] = vf_select(vf_lt(low, x), vf_select(vf_lt(x, high), x, high), low);
    }
}

// Which of `lanes` lie on the image.
static inline vm pt_on_it(const vf at[2], vm lanes)
{
    for (int k = 0; k < 2; k++)
        lanes = vm_and(lanes, vm_and(vf_le(vf_zero(), at[k]), vf_le(at[k], vf_set(1.0f))));
    return lanes;
}

// 2. and 3.: colour and opacity.
static inline void pt_image_at(const struct texture_args *image, const uint32_t *texels, const struct pt_on_image *place,
                               vm lanes, vf out[4])
{
    const vf zero = vf_zero(), one = vf_set(1.0f), half = vf_set(0.5f);
    vf square[2], sum[4] = {zero, zero, zero, zero};
    for (int next = 0; next < 2; next++) {
        const vf x = place->side[next][0] * vf_set((float)image->sizes[0]),
                 y = place->side[next][1] * vf_set((float)image->sizes[1]);
        square[next] = x * x + y * y;
    }
    const vm upright = vf_lt(square[0], square[1]);
    const vf major = vf_max(square[0], square[1]), minor = vf_min(square[0], square[1]);
    const vf apart = vf_max(minor, one);
    vf count = one;
    for (uint32_t k = 1; k < PT_PROBES; k++)
        count = vf_select(vf_lt(vf_set((float)(k * k)) * apart, major), vf_set((float)(k + 1)), count);
    const vf share = vf_rcp(count), wide = vf_max(minor, major * vf_set(1.0f / (PT_PROBES * PT_PROBES)));
    vf level = vf_select(vf_lt(one, wide), half * vf_log2(vf_max(wide, one)), zero);
    level = vf_min(level, vf_set((float)(image->levels - 1)));
    const vf whole = vf_floor(level), beyond = level - whole;
    const vi finer = vf_int(whole), coarser = vf_int(vf_min(whole + one, vf_set((float)(image->levels - 1))));
    const vm sharp = image->nearest ? vm_and(lanes, vf_le(major, one)) : vm_first(0);
    for (uint32_t i = 0; i < PT_PROBES; i++) {
        const vm asked = vm_and(lanes, vf_lt(vf_set((float)i), count));
        if (!vm_bits(asked))
            break;
        const vf along = vf_set((float)i + 0.5f) * share - half;
        vf at[2];
        for (int k = 0; k < 2; k++)
            at[k] = place->at[k] +
                    vf_select(vm_and(sharp, asked), zero, along * vf_select(upright, place->side[1][k], place->side[0][k]));
        pt_wrap_place(image, at);
        const vm mixed = vm_and(asked, vm_not(sharp)), square_ones = pt_on_it(at, vm_and(asked, sharp)),
                 between = vm_and(mixed, vf_lt(zero, beyond));
        if (vm_bits(mixed))
            pt_add_level(image, texels, finer, at, (one - beyond) * share, mixed, sum);
        if (vm_bits(between))
            pt_add_level(image, texels, coarser, at, beyond * share, between, sum);
        if (i == 0 && vm_bits(square_ones))
            pt_add_nearest(image, texels, at, square_ones, sum);
    }
    const int straight = image->blend || image->cut > 0.0f;
    const vm some = vf_le(vf_set(straight ? 1e-6f : 0.0f), sum[3]);
    const vf scale = straight ? vf_rcp(vf_select(some, sum[3], one)) : vf_set(1.0f);
    for (int k = 0; k < 3; k++)
        out[k] = vf_select(some, sum[k] * scale, zero);
    out[3] = vf_min(sum[3], one);
}

#endif
