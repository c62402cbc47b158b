// SPDX-License-Identifier: GPL-3.0-or-later
// splat: points -> least key of every pixel that their discs cover. SPEC 5, solid; twin of shaders/kernels/splat.comp
//
// Tile by tile, in memory that the first-level cache holds.
#include "bins.h"

struct tile {
    const struct view_args *view;
    struct pt_disc_tile at;
    uint32_t z[PT_DISC_TILE * PT_DISC_STRIDE], id[PT_DISC_TILE * PT_DISC_STRIDE];
    float limit[PT_DISC_TILE * PT_DISC_STRIDE];
    int limited;
};

static inline uint32_t row_of(const struct tile *tile, int32_t x, int32_t y)
{
    return (uint32_t)(y - tile->at.y) * PT_DISC_STRIDE + (uint32_t)(x - tile->at.x);
}

static inline void draw(void *context, const struct pt_disc *disc, const void *looks, uint32_t lane)
{
    struct tile *tile = context;
    const vi id = vi_set(disc->id);
    int32_t box[4];
    (void)looks;
    (void)lane;
    if (!pt_disc_in_tile(disc, &tile->at, box))
        return;
    for (int32_t y = box[1]; y < box[3]; y++)
        for (int32_t x = box[0]; x < box[2]; x += PT_LANES) {
            const uint32_t at = row_of(tile, x, y);
            vf z, square;
            vm beside;
            vm covered = pt_disc_pixels(tile->view, disc, x, y, vm_first(pt_lanes_left((uint32_t)x, (uint32_t)box[2])), &z,
                                        &square, &beside);
            if (tile->limited)
                covered = vm_and(covered, vf_lt(vf_load(tile->limit + at), z));
            vi bits = vi_and(vf_bits(z), vi_set(0x7FFFFFFFu)), seen = vi_load(tile->z + at); // the sign bit of -0 is dropped
            vm nearer = vi_lt_unsigned(bits, seen),
               equal = vm_and(vi_eq(bits, seen), vi_lt_unsigned(id, vi_load(tile->id + at)));
            covered = vm_and(covered, vm_or(nearer, equal));
            vi_store(tile->z + at, bits, covered);
            vi_store(tile->id + at, id, covered);
        }
}

static void load(struct tile *tile, const uint64_t *keys, const float *limit)
{
    for (int32_t y = 0; y < tile->at.height; y++) {
        const size_t from = (size_t)(tile->at.y + y) * tile->view->width + (size_t)tile->at.x;
        const uint32_t to = (uint32_t)y * PT_DISC_STRIDE;
        for (uint32_t x = 0; x < (uint32_t)tile->at.width; x += PT_LANES) {
            vi_store(tile->z + to + x, vi_load_z(keys + from + x), vm_first(PT_LANES));
            vi_store(tile->id + to + x, vi_load_id(keys + from + x), vm_first(PT_LANES));
            if (limit)
                vf_store(tile->limit + to + x, vf_load(limit + from + x), vm_first(PT_LANES));
        }
    }
    tile->limited = limit != NULL;
}

static void save(const struct tile *tile, uint64_t *keys)
{
    for (int32_t y = 0; y < tile->at.height; y++) {
        const size_t to = (size_t)(tile->at.y + y) * tile->view->width + (size_t)tile->at.x;
        const uint32_t from = (uint32_t)y * PT_DISC_STRIDE;
        for (uint32_t x = 0; x < (uint32_t)tile->at.width; x += PT_LANES)
            vi_store_keys(keys + to + x, vi_load(tile->z + from + x), vi_load(tile->id + from + x),
                          vm_bits(vm_first(pt_lanes_left(x, (uint32_t)tile->at.width))));
    }
}

static void draw_tiles(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct pt_bins *bins = context;
    const struct splat_args *args = bins->call->arguments;
    const float *limit = args->behind ? pt_cpu_data(bins->call, 1 + 5 * args->instances) : NULL;
    const uint32_t large = bins->bins - 1;
    struct tile tile;
    (void)thread;
    tile.view = bins->view;
    for (uint32_t t = begin; t < end && !pt_cpu_cancelled(bins->call); t++) {
        if (pt_bin_empty(bins, t) && pt_bin_empty(bins, large))
            continue;
        tile.at = pt_bin_tile(bins, t);
        load(&tile, pt_cpu_data(bins->call, 0), limit);
        pt_bin_walk(bins, t, NULL, NULL, draw, &tile);
        pt_bin_walk(bins, large, NULL, NULL, draw, &tile);
        save(&tile, pt_cpu_data(bins->call, 0));
    }
}

int PT_KERNEL_ENTRY(splat)(const struct pt_cpu_call *call)
{
    const struct splat_args *args = call->arguments;
    struct pt_bins bins = { .call = call,
                            .view = &args->view,
                            .discs = (const struct disc_args *)(args + 1),
                            .drawn = args->sifted ? pt_cpu_data(call, 1 + 5 * args->instances + args->behind) : NULL,
                            .instances = args->instances,
                            .first = 1,
                            .stride = 5 };
    int error = pt_bins_fill(&bins);
    if (error)
        return error;
    pt_parallel(call->pool, bins.bins - 1, 1, draw_tiles, &bins);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
