// SPDX-License-Identifier: GPL-3.0-or-later
// merge: points of an image buffer's cells -> their mean place, colour and opacity [K II.B]; twin of shaders/kernels/merge.comp
//
// Band of rows by band, as in average: its sums stay in the cache, and nobody else adds to them.
#include "device_cpu/kernels/ranges.h"
#include "device_cpu/kernels/shade.h"
#include "device_cpu/kernels/sums.h"

enum {
    BLOCK = 256,          // points
    SUMS = PT_SUMS,       // weight, place across and up, share of the depth, colour 3, opacity
    BAND_CELLS = 1 << 13, // about
    BAND_LEAST = 8,
    BAND_MOST = 64, // rows
};

typedef int64_t vl_eight __attribute__((vector_size(64), aligned(8), may_alias));

struct merge {
    const struct pt_cpu_call *call;
    const struct merge_args *args;
    uint32_t rows; // of a band
    char *memory;  // per thread
    size_t thread_bytes;
};

struct band {
    uint32_t first, end; // rows of the plane
    int64_t *sums;       // SUMS a cell
};

struct block { // of a chunk: its points in view that do not face away and fall into the band, packed
    uint32_t count;
    uint32_t cell[BLOCK + PT_LANES], id[BLOCK + PT_LANES]; // cell: in the plane
    float x[BLOCK + PT_LANES], y[BLOCK + PT_LANES], z[BLOCK + PT_LANES];
};

// 1. Where points [first, last) lie.
static void project(const struct merge *merge, const struct band *band, const struct chunk_view *chunk, uint32_t first,
                    uint32_t last, struct block *block)
{
    const struct view_args *view = &merge->args->view;
    const float *positions = (const float *)PT_DATA(merge->call, merge, positions) + 3 * (size_t)chunk->first;
    const uint32_t *surface = (const uint32_t *)PT_DATA(merge->call, merge, surface) + chunk->first;
    const uint32_t *drawn = merge->args->sifted ? PT_DATA(merge->call, merge, drawn) : NULL;
    const vf left = vf_set((float)view->origin_x), right = vf_set((float)(view->origin_x + (int32_t)view->width));
    const vf low = vf_set((float)(view->origin_y + (int32_t)band->first)),
             high = vf_set((float)(view->origin_y + (int32_t)band->end));
    uint32_t count = 0;
    for (uint32_t i = first; i < last; i += PT_LANES) {
        const vf p[3] = {vf_load(positions + i), vf_load(positions + chunk->padded + i),
                         vf_load(positions + 2 * (size_t)chunk->padded + i)};
        const vf z = vf_transform(chunk, 2, p[0], p[1], p[2]);
        vf x = vf_transform(chunk, 0, p[0], p[1], p[2]), y = vf_transform(chunk, 1, p[0], p[1], p[2]);
        if (view->perspective) {
            const vf r = vf_rcp(z);
            x = x * r;
            y = y * r;
        }
        vm some = vm_and(vm_and(vf_le(vf_set(view->z_near), z), vf_le(z, vf_set(view->z_far))),
                         vm_and(vm_and(vf_le(left, x), vf_lt(x, right)), vm_and(vf_le(low, y), vf_lt(y, high))));
        some = vm_and(some, vm_first(pt_lanes_left(i, last)));
        if (chunk->sifted)
            some = vm_and(some, vm_of_bits(drawn[chunk->sifted - 1 + i / PT_SLOTS_A_WORD] >> i % PT_SLOTS_A_WORD));
        if (!vm_bits(some))
            continue;
        if (chunk->cull)
            some = vm_and(some, vm_not(pt_faces_away(chunk, vi_load(surface + i), p)));
        const vf column = vf_floor(x), row = vf_floor(y);
        const vi at = vi_add(vi_mul(vi_sub(vf_int(row), vi_set((uint32_t)view->origin_y)), vi_set(view->width)),
                             vi_sub(vf_int(column), vi_set((uint32_t)view->origin_x)));
        const uint32_t lanes = vm_bits(some);
        vi_pack(block->cell + count, at, lanes);
        vi_pack(block->id + count, vi_add(vi_set(chunk->first + i), vi_lanes()), lanes);
        vi_pack((uint32_t *)(void *)(block->x + count), vf_bits(x - column), lanes);
        vi_pack((uint32_t *)(void *)(block->y + count), vf_bits(y - row), lanes);
        vi_pack((uint32_t *)(void *)(block->z + count), vi_and(vf_bits(z), vi_set(0x7FFFFFFFu)), lanes);
        count += (uint32_t)__builtin_popcount(lanes);
    }
    block->count = count;
}

// What depths of a cell's points are told in parts of.
static inline vf reach_of(const struct view_args *view, vf gamma, vf z)
{
    return vf_min(gamma, vf_max(vf_set(PT_RANGE_DEEPEST) * vf_footprint(view, z), vf_set(PT_RANGE_LEAST)));
}

// 2. To the sums of their cells.
static void add(const struct merge *merge, const struct band *band, const struct block *block)
{
    const struct merge_args *args = merge->args;
    const struct view_args *view = &args->view;
    const uint64_t *keys = PT_DATA(merge->call, merge, keys);
    const void *colors = PT_DATA(merge->call, merge, colors), *opacities = PT_DATA(merge->call, merge, opacities);
    const vf zero = vf_zero(), one = vf_set(1.0f), scale = vf_set(PT_SUM_SCALE), most = vf_set(PT_SUM_BRIGHTEST);
    float terms[PT_LANES][SUMS], halves[2][PT_LANES][4];
    for (uint32_t i = 0; i < block->count; i += PT_LANES) {
        const vm lanes = vm_first(pt_lanes_left(i, block->count));
        const vi at = vi_load(block->cell + i), id = vi_load(block->id + i);
        const vf z = vf_load(block->z + i), nearest = vf_select(lanes, vi_float(vi_gather_z(keys, at, lanes)), one);
        const vf gamma = pt_range_gamma(view, args->gamma, args->gamma_cells, nearest), behind = z - nearest;
        const vm some = vm_and(lanes, vm_and(vf_le(zero, behind), vf_le(behind, gamma)));
        if (!vm_bits(some))
            continue;
        const vf weight = vf_max(one - behind * vf_rcp(gamma), zero) * scale;
        const vf share = vf_min(behind * vf_rcp(reach_of(view, gamma, nearest)), one);
        vf color[4], place[4] = {weight, weight * vf_load(block->x + i), weight * vf_load(block->y + i), weight * share};
        pt_albedo(&args->instance, colors, id, id, some, color);
        color[3] = pt_opacity(&args->instance, colors, opacities, id, id, some) * weight;
        for (int k = 0; k < 3; k++)
            color[k] = vf_max(vf_min(color[k], most), zero - most) * color[3];
        vf_store4(halves[0][0], place, PT_ALL);
        vf_store4(halves[1][0], color, PT_ALL);
        for (uint32_t lane = 0; lane < PT_LANES; lane++)
            for (uint32_t k = 0; k < 2; k++)
                memcpy(terms[lane] + 4 * k, halves[k][lane], sizeof halves[k][lane]);
        for (uint32_t left = vm_bits(some); left; left &= left - 1) {
            const uint32_t lane = (uint32_t)__builtin_ctz(left);
            const size_t cell = block->cell[i + lane] - (size_t)band->first * view->width;
            const vi_eight whole = __builtin_convertvector(*(const vf_eight *)(const void *)terms[lane], vi_eight);
            *(vl_eight *)(void *)(band->sums + SUMS * cell) += __builtin_convertvector(whole, vl_eight);
        }
    }
}

// 3. Means of PT_LANES cells from the one at `at` on.
static void save(const struct merge *merge, const struct band *band, size_t at, uint32_t count)
{
    const struct merge_args *args = merge->args;
    const struct view_args *view = &args->view;
    const vf z = vi_float(vi_load_z((const uint64_t *)PT_DATA(merge->call, merge, keys) + at)), one = vf_set(1.0f),
             zero = vf_zero();
    const vm lanes = vm_first(count), some = vm_and(lanes, vf_lt(z, vf_set(pt_float(PT_KEY_EMPTY_Z))));
    const int64_t *from = band->sums + SUMS * (at - (size_t)band->first * view->width);
    float lane_sums[SUMS][PT_LANES];
    vf sums[SUMS], place[4], color[4];
    for (uint32_t k = 0; k < SUMS; k++) {
        for (uint32_t i = 0; i < PT_LANES; i++)
            lane_sums[k][i] = i < count ? pt_wide_sum(from[SUMS * i + k]) : 0.0f;
        sums[k] = vf_load(lane_sums[k]);
    }
    const vf nearest = vf_select(some, z, one), weight = vf_max(sums[0], one), inverse = vf_rcp(weight);
    const vf reach = reach_of(view, pt_range_gamma(view, args->gamma, args->gamma_cells, nearest), nearest);
    place[0] = sums[1] * inverse;
    place[1] = sums[2] * inverse;
    place[2] = nearest + (sums[3] * inverse) * reach;
    place[3] = vf_select(some, sums[0] * vf_set(1.0f / PT_SUM_SCALE), zero);
    const vm colored = vf_le(one, sums[7]);
    const vf share = vf_rcp(vf_select(colored, sums[7], one));
    for (int k = 0; k < 3; k++)
        color[k] = vf_select(colored, sums[4 + k] * share, zero);
    color[3] = vf_select(vf_lt(sums[7], weight), vf_min(sums[7] * inverse, one), one); // opaque: 1 exactly
    vf_store4((float *)PT_DATA(merge->call, merge, place) + 4 * at, place, vm_bits(lanes));
    vf_store4((float *)PT_DATA(merge->call, merge, merged) + 4 * at, color, vm_bits(lanes));
}

static int may_reach(const struct view_args *view, const struct chunk_view *chunk, const struct band *band)
{
    const uint32_t end = chunk->row_end ? chunk->row_end : view->height;
    return chunk->row_first < band->end && band->first < end;
}

static void merge_bands(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct merge *merge = context;
    const struct view_args *view = &merge->args->view;
    const struct chunk_view *chunks = PT_DATA(merge->call, merge, chunks);
    const uint32_t *rect = view->rect;
    const uint32_t count = (uint32_t)(merge->call->buffers[PT_BUF_merge_chunks]->size / sizeof *chunks);
    struct block block;
    struct band band = {.sums = (int64_t *)(void *)(merge->memory + thread * merge->thread_bytes)};
    for (uint32_t b = begin; b < end && !pt_cpu_cancelled(merge->call); b++) {
        band.first = rect[1] + b * merge->rows;
        band.end = band.first + merge->rows < rect[3] ? band.first + merge->rows : rect[3];
        memset(band.sums, 0, (size_t)(band.end - band.first) * view->width * SUMS * sizeof *band.sums);
        for (uint32_t c = 0; c < count; c++)
            for (uint32_t first = 0; may_reach(view, &chunks[c], &band) && first < chunks[c].count; first += BLOCK) {
                project(merge, &band, &chunks[c], first, chunks[c].count - first < BLOCK ? chunks[c].count : first + BLOCK,
                        &block);
                add(merge, &band, &block);
            }
        for (uint32_t y = band.first; y < band.end; y++)
            for (uint32_t x = rect[0]; x < rect[2]; x += PT_LANES)
                save(merge, &band, (size_t)y * view->width + x, pt_lanes_left(x, rect[2]));
    }
}

int PT_KERNEL_ENTRY(merge)(const struct pt_cpu_call *call)
{
    struct merge merge = {.call = call, .args = call->arguments};
    const struct view_args *view = &merge.args->view;
    if (view->rect[0] >= view->rect[2] || view->rect[1] >= view->rect[3])
        return PATINA_OK;
    const uint32_t fit = BAND_CELLS / view->width;
    merge.rows = fit < BAND_LEAST ? BAND_LEAST : fit < BAND_MOST ? fit : BAND_MOST;
    merge.thread_bytes = ((size_t)merge.rows * view->width * SUMS * sizeof(int64_t) + 63) / 64 * 64;
    merge.memory = pt_cpu_scratch(call, 0, pt_pool_threads(call->pool) * merge.thread_bytes);
    if (!merge.memory)
        return PATINA_ERROR_MEMORY;
    pt_parallel(call->pool, (view->rect[3] - view->rect[1] + merge.rows - 1) / merge.rows, 1, merge_bands, &merge);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
