// SPDX-License-Identifier: GPL-3.0-or-later
// Smoothing of PT_LANES pixels: 3 x 3 low-pass over the neighbours of the same layer. [D 3.4, Table 1]
#ifndef PT_SMOOTH_H
#define PT_SMOOTH_H

#include "device_cpu/picture_rows.h"
#include "shared/colors.h"

// A row's z and colour; colours of empty pixels may be anything, NaN too.
struct pt_color_row {
    float *z, *color[4]; // the fourth where something is translucent
};

// 1 / the sum of all weights.
static inline float pt_smooth_scale(const struct smooth_args *args)
{
    return pt_rcp((args->center + 4.0f * args->edge) + 4.0f * args->corner);
}

static inline struct pt_nine pt_smooth_weights(const struct smooth_args *args)
{
    return (struct pt_nine){args->center, args->edge, args->corner};
}

// rows: y - 1, y, y + 1. limit: d_eff of the pixels from x on. `some` are not empty. channels: 3, or 4 with alpha.
static inline void pt_smooth_pixels(const struct smooth_args *args, const struct pt_color_row *const rows[3], int channels,
                                    uint32_t x, vf limit, vm some, vf out[4])
{
    const float *const z[3] = {rows[0]->z + x, rows[1]->z + x, rows[2]->z + x};
    const struct pt_nine weights = pt_smooth_weights(args);
    const vf one = vf_set(1.0f);
    vf edges = vf_zero(), corners = vf_zero(); // how many there are
    vm same[3][3];
    pt_same_layer(z, limit, some, same);
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            edges = vf_add_where((r + c) % 2 ? same[r][c] : vm_of_bits(0), edges, one);
            corners = vf_add_where(r != 1 && c != 1 ? same[r][c] : vm_of_bits(0), corners, one);
        }
    const vf scale = vf_rcp((vf_set(weights.center) + edges * vf_set(weights.edge)) + corners * vf_set(weights.corner));
    for (int k = 0; k < channels; k++) {
        const float *const row[3] = {rows[0]->color[k] + x, rows[1]->color[k] + x, rows[2]->color[k] + x};
        out[k] = pt_nine_pixels(&weights, row, same) * scale;
    }
    out[3] = channels == 4 ? vf_min(out[3], one) : one; // the reciprocal is off by an ulp or two
}

#endif
