// SPDX-License-Identifier: GPL-3.0-or-later
// Peeling of PT_LANES pixels: blended behind the layers before, and what may show behind them. [D 4, 5], SPEC 3; twin of
// shaders/kernels/peel.comp
#ifndef PT_PEEL_H
#define PT_PEEL_H

#include "device_cpu/rows.h"
#include "shared/colors.h"

enum { PT_TILE = 1 << PT_TILE_LEVEL }; // a whole number of vectors

struct pt_tile_value { // as the plane holds it
    float least;
    uint32_t covered;
};

struct pt_tile_sum {
    vf least; // of every PT_LANES-th pixel
    uint32_t covered;
};

struct pt_peeled {
    float *limit, *through, *over;
};

// Pixels from `at` on. color: premultiplied, of the layer; opacity: of the pixels' own points; distance: their d_eff. Returns
// those that show the layer: the others of `some` were filled across a layer already taken.
static inline vm pt_peel_pixels(const struct peel_args *args, const struct pt_peeled *planes, size_t at, vm lanes, vm some,
                                vf z, const vf color[4], vf opacity, vf distance, struct pt_tile_sum *tile)
{
    const vf finished = vf_set(pt_float(PT_KEY_EMPTY_Z)), one = vf_set(1.0f);
    const int first = args->first != 0;
    vf before = first ? vf_set(-1.0f) : vf_load(planes->limit + at);
    vm behind = vm_and(some, vf_lt(before, z));
    // 2. behind what was blended before
    if (first || vm_bits(behind)) {
        vf sum[4] = {vf_zero(), vf_zero(), vf_zero(), vf_zero()};
        if (!first || args->inked)
            vf_load4(planes->over + 4 * at, sum);
        vf through = one - sum[3];
        for (int k = 0; k < 4; k++)
            sum[k] = vf_select(behind, sum[k] + through * color[k], sum[k]);
        vf_store4(planes->over + 4 * at, sum, vm_bits(lanes));
    }
    // 3. what comes through, and from where on
    vf light = first ? one : vf_load(planes->through + at), next = z + distance;
    light = vf_select(behind, light * (one - opacity), light);
    if (args->stop)
        next = vf_select(vf_lt(light, vf_set(PT_SPENT)), finished, next);
    vf beyond = vf_select(behind, next, vf_select(some, before, finished));
    vf_store_where(planes->through + at, light, first ? lanes : behind); // others keep theirs, which neighbors' edges read
    vf_store_where(planes->limit + at, beyond, lanes);
    // 4. of the tile
    tile->covered += (uint32_t)__builtin_popcount(vm_bits(behind));
    tile->least = vf_min(tile->least, vf_select(some, beyond, finished));
    return behind;
}

static inline struct pt_tile_sum pt_tile_begin(void) { return (struct pt_tile_sum){.least = vf_set(pt_float(PT_KEY_EMPTY_Z))}; }

static inline struct pt_tile_value pt_tile_end(const struct pt_tile_sum *sum)
{
    float least[PT_LANES];
    vf_store(least, sum->least);
    for (int i = 1; i < PT_LANES; i++)
        least[0] = pt_min(least[0], least[i]);
    return (struct pt_tile_value){least[0], sum->covered};
}

#endif
