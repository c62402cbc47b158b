// SPDX-License-Identifier: GPL-3.0-or-later
// merge: points of an image buffer's cells -> their mean place, colour and opacity [K II.B]; twin of shaders/kernels/merge.comp
#include "device_cpu/kernels/cells.h"
#include "shared/ranges.h"

#include <math.h>

typedef int32_t vi_four __attribute__((vector_size(16), aligned(4), may_alias));
typedef int64_t vl_four __attribute__((vector_size(32), aligned(8), may_alias));

// Of a cell: weight, place across and up, share of the depth, colour 3, opacity.

// Sums of 32 bits are widened from this weight on: a block more does not fill them, and no other sum of a cell is greater.
#define FILLED (1 << 30)

// Terms of the lanes that `left` names go to the sums of their cells, which begin at `first`.
static void put_wide(int64_t *sums, const uint32_t *cell, size_t first, uint32_t left, const int32_t terms[2][PT_LANES][4])
{
    for (; left; left &= left - 1) {
        const uint32_t lane = (uint32_t)__builtin_ctz(left);
        vl_four *own = (vl_four *)(void *)(sums + PT_SUMS * (cell[lane] - first));
        for (int k = 0; k < 2; k++)
            own[k] += __builtin_convertvector(*(const vi_four *)(const void *)terms[k][lane], vl_four);
    }
}

// The greatest bits of the weights that have come about.
static int32_t put_narrow(int32_t *sums, const uint32_t *cell, size_t first, uint32_t left, const int32_t terms[2][PT_LANES][4])
{
    int32_t bits = 0;
    for (; left; left &= left - 1) {
        const uint32_t lane = (uint32_t)__builtin_ctz(left);
        vi_four *own = (vi_four *)(void *)(sums + PT_SUMS * (cell[lane] - first));
        for (int k = 0; k < 2; k++)
            own[k] += *(const vi_four *)(const void *)terms[k][lane];
        bits |= own[0][0];
    }
    return bits;
}

// To the sums of their cells.
static void add(const struct pt_cells *cells, struct pt_cell_band *band, const struct pt_cell_block *block)
{
    const struct merge_args *args = cells->call->arguments;
    const struct view_args *view = &args->view;
    const uint64_t *keys = PT_DATA(cells->call, merge, keys);
    const void *colors = PT_DATA(cells->call, merge, colors), *opacities = PT_DATA(cells->call, merge, opacities);
    const vf zero = vf_zero(), one = vf_set(1.0f), scale = vf_set(PT_SUM_SCALE), most = vf_set(PT_SUM_BRIGHTEST);
    const size_t origin = (size_t)band->first * view->width;
    int32_t terms[2][PT_LANES][4], filled = 0;
    for (uint32_t i = 0; i < block->count; i += PT_LANES) {
        const vm lanes = vm_first(pt_lanes_left(i, block->count));
        const vi at = vi_load(block->cell + i), id = vi_load(block->id + i);
        const vf z = vf_load(block->z + i), nearest = vf_select(lanes, vi_float(vi_gather_z(keys, at, lanes)), one);
        const vf gamma = pt_range_gamma(view, args->gamma, args->gamma_cells, nearest), behind = z - nearest;
        const vm some = vm_and(lanes, vm_and(vf_le(zero, behind), vf_le(behind, gamma)));
        if (!vm_bits(some))
            continue;
        const vf weight = vf_max(one - behind * vf_rcp(gamma), zero) * scale;
        const vf share = vf_min(behind * vf_rcp(pt_cell_reach(view, gamma, nearest)), one);
        const vf x = vf_load(block->x + i), y = vf_load(block->y + i);
        vf color[4], place[4] = {weight, weight * (x - vf_floor(x)), weight * (y - vf_floor(y)), weight * share};
        pt_albedo(&args->instance, colors, id, id, some, color);
        color[3] = pt_opacity(&args->instance, colors, opacities, id, id, some) * weight;
        for (int k = 0; k < 3; k++)
            color[k] = vf_max(vf_min(color[k], most), zero - most) * color[3];
        for (int k = 0; k < 4; k++) {
            place[k] = vi_float(vf_int(place[k]));
            color[k] = vi_float(vf_int(color[k]));
        }
        vf_store4((float *)(void *)terms[0][0], place, PT_ALL);
        vf_store4((float *)(void *)terms[1][0], color, PT_ALL);
        if (band->wide)
            put_wide(band->sums, block->cell + i, origin, vm_bits(some), (const int32_t(*)[PT_LANES][4])terms);
        else
            filled |= put_narrow((int32_t *)(void *)band->sums, block->cell + i, origin, vm_bits(some),
                                 (const int32_t(*)[PT_LANES][4])terms);
    }
    if (filled >= FILLED)
        pt_cells_widen(cells, band);
}

// Whether no point's term is greater than its weight.
static int are_dim(const struct instance_args *instance)
{
    const float *color = instance->color;
    if (instance->color_format == 1)
        return instance->opacity <= 1.0f;
    return instance->color_format == 0 && instance->opacity <= 1.0f && fabsf(color[0]) <= 1.0f && fabsf(color[1]) <= 1.0f &&
           fabsf(color[2]) <= 1.0f;
}

// The sums of PT_LANES cells, of which `count` there are. Most fit 32 bits.
static void take(const int64_t *from, uint32_t count, vf sums[PT_SUMS])
{
    int32_t narrow[PT_LANES][PT_SUMS];
    float lanes[PT_LANES];
    pt_vl_eight wide = {0};
    if (count < PT_LANES)
        memset(narrow, 0, sizeof narrow);
    for (uint32_t i = 0; i < count; i++) {
        const pt_vl_eight sum = *(const pt_vl_eight *)(const void *)(from + PT_SUMS * i);
        const vi_eight low = __builtin_convertvector(sum, vi_eight);
        memcpy(narrow[i], &low, sizeof low);
        wide |= sum ^ __builtin_convertvector(low, pt_vl_eight);
    }
    if (!(wide[0] | wide[1] | wide[2] | wide[3] | wide[4] | wide[5] | wide[6] | wide[7])) {
        pt_take_sums(narrow[0], NULL, vm_first(count), sums);
        return;
    }
    for (uint32_t k = 0; k < PT_SUMS; k++) {
        for (uint32_t i = 0; i < PT_LANES; i++)
            lanes[i] = i < count ? pt_wide_sum(from[PT_SUMS * i + k]) : 0.0f;
        sums[k] = vf_load(lanes);
    }
}

// Means of PT_LANES cells from the one at `at` on.
static void save(const struct pt_cells *cells, const struct pt_cell_band *band, size_t at, uint32_t count)
{
    const struct merge_args *args = cells->call->arguments;
    const struct view_args *view = &args->view;
    const vf z = vi_float(vi_load_z((const uint64_t *)PT_DATA(cells->call, merge, keys) + at)), one = vf_set(1.0f),
             zero = vf_zero();
    const vm lanes = vm_first(count), some = vm_and(lanes, vf_lt(z, vf_set(pt_float(PT_KEY_EMPTY_Z))));
    const int64_t *from = band->sums + PT_SUMS * (at - (size_t)band->first * view->width);
    float *place_of = (float *)PT_DATA(cells->call, merge, place) + 4 * at,
          *merged_of = (float *)PT_DATA(cells->call, merge, merged) + 4 * at;
    vf sums[PT_SUMS], place[4] = {zero, zero, one, zero}, color[4] = {zero, zero, zero, zero};
    if (!vm_bits(some)) { // as below
        vf_store4(place_of, place, vm_bits(lanes));
        vf_store4(merged_of, color, vm_bits(lanes));
        return;
    }
    if (band->wide)
        take(from, count, sums);
    else
        pt_take_sums((const int32_t *)(const void *)band->sums + PT_SUMS * (at - (size_t)band->first * view->width), NULL,
                     lanes, sums);
    const vf nearest = vf_select(some, z, one), weight = vf_max(sums[0], one), inverse = vf_rcp(weight);
    const vf reach = pt_cell_reach(view, pt_range_gamma(view, args->gamma, args->gamma_cells, nearest), nearest);
    place[0] = sums[1] * inverse;
    place[1] = sums[2] * inverse;
    place[2] = nearest + (sums[3] * inverse) * reach;
    place[3] = vf_select(some, sums[0] * vf_set(1.0f / PT_SUM_SCALE), zero);
    const vm colored = vf_le(one, sums[7]);
    const vf share = vf_rcp(vf_select(colored, sums[7], one));
    for (int k = 0; k < 3; k++)
        color[k] = vf_select(colored, sums[4 + k] * share, zero);
    color[3] = vf_select(vf_lt(sums[7], weight), vf_min(sums[7] * inverse, one), one); // opaque: 1 exactly
    vf_store4(place_of, place, vm_bits(lanes));
    vf_store4(merged_of, color, vm_bits(lanes));
}

int PT_KERNEL_ENTRY(merge)(const struct pt_cpu_call *call)
{
    const struct merge_args *args = call->arguments;
    struct pt_cells cells = {.call = call,
                             .view = &args->view,
                             .positions = PT_DATA(call, merge, positions),
                             .surfels = PT_DATA(call, merge, surfels),
                             .drawn = args->sifted ? PT_DATA(call, merge, drawn) : NULL,
                             .chunks = PT_DATA(call, merge, chunks),
                             .chunk_count = (uint32_t)(call->buffers[PT_BUF_merge_chunks]->size / sizeof(struct chunk_view)),
                             .narrow = are_dim(&args->instance),
                             .add = add,
                             .save = save};
    return pt_cells_run(&cells);
}
