// SPDX-License-Identifier: GPL-3.0-or-later
// Smoothing of PT_LANES pixels: 3 x 3 low-pass over the neighbours of the same layer. [D 3.4, Table 1]
#ifndef PT_SMOOTH_H
#define PT_SMOOTH_H

#include "device_cpu/picture_rows.h"

// A row's z and colour; colours of empty pixels may be anything, NaN too.
struct pt_color_row {
    float *z, *color[4]; // the fourth where something is translucent
};

// 1 / the sum of all weights.
static inline float pt_smooth_scale(const struct smooth_args *args)
{
    return pt_rcp((args->center + 4.0f * args->edge) + 4.0f * args->corner);
}

// rows: y - 1, y, y + 1. limit: d_eff of the pixels from x on. `some` are not empty. channels: 3, or 4 with alpha. whole:
// where all of them and those around are one layer pt_smooth_scale, else NULL.
static inline void pt_smooth_pixels(const struct smooth_args *args, const struct pt_color_row *const rows[3], int channels,
                                    const vf *whole, uint32_t x, vf limit, vm some, vf out[4])
{
    const vf zero = vf_zero(), one = vf_set(1.0f), z = vf_load(rows[1]->z + x);
    vf edges[5] = { zero, zero, zero, zero, zero }, corners[5] = { zero, zero, zero, zero, zero }; // the last counts
    for (int dy = -1; dy <= 1; dy++)
        for (int dx = -1; dx <= 1; dx++) {
            if (!dx && !dy)
                continue;
            const struct pt_color_row *row = rows[1 + dy];
            vf *sum = dx && dy ? corners : edges;
            for (int k = 0; k < channels && whole; k++)
                sum[k] = sum[k] + vf_load(row->color[k] + x + dx);
            if (whole)
                continue;
            vm same = vm_and(some, vf_le(vf_abs(vf_load(row->z + x + dx) - z), limit)); // else another layer, or nothing
            for (int k = 0; k < channels; k++)
                sum[k] = vf_add_where(same, sum[k], vf_load(row->color[k] + x + dx));
            sum[4] = vf_add_where(same, sum[4], one);
        }
    const vf center = vf_set(args->center), edge = vf_set(args->edge), corner = vf_set(args->corner);
    vf scale = whole ? *whole : vf_rcp((center + edges[4] * edge) + corners[4] * corner);
    for (int k = 0; k < channels; k++) {
        vf own = vf_load(rows[1]->color[k] + x) * center;
        out[k] = ((own + edges[k] * edge) + corners[k] * corner) * scale;
    }
    out[3] = channels == 4 ? vf_min(out[3], one) : one; // the reciprocal is off by an ulp or two
}

#endif
