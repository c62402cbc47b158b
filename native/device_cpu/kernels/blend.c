// SPDX-License-Identifier: GPL-3.0-or-later
// blend: normal and colour of the discs that lie on the nearest surface of each pixel. SPEC 5, solid; twin of
// shaders/kernels/blend.comp
//
// Tile by tile. The sums of a pixel lie side by side: discs cover some five pixels of a tile's row, which leaves vectors of
// pixels half empty. They are 32 bits wide and emptied into 64 before they could overflow.
#include "bins.h"
#include "shade.h"

enum { TILE_PIXELS = PT_DISC_TILE * PT_DISC_TILE, SUMS = 8 }; // colour 3, opacity, normal 3, weight

struct tile {
    const struct pt_bins *bins;
    struct pt_disc_tile at;
    float nearest[PT_DISC_TILE * PT_DISC_STRIDE], farthest[PT_DISC_TILE * PT_DISC_STRIDE];
    uint32_t id[PT_DISC_TILE * PT_DISC_STRIDE];
    float away[PT_DISC_TILE * PT_DISC_STRIDE]; // squared distance of the nearest disc's own pixel
    int32_t left; // that the sums can take
    int emptied;
    int32_t sums[TILE_PIXELS][SUMS];
    int64_t wide[TILE_PIXELS][SUMS];
};

struct look {
    float terms[SUMS];
    int32_t most; // of their sizes
};

static inline uint32_t row_of(const struct tile *tile, int32_t x, int32_t y)
{
    return (uint32_t)(y - tile->at.y) * PT_DISC_STRIDE + (uint32_t)(x - tile->at.x);
}

// ---- discs ---------------------------------------------------------------------------------------------------------------

static inline void look_at(const struct pt_bins *bins, uint32_t instance, vi id, const struct pt_discs *discs, void *looks)
{
    const struct instance_args *args = &bins->discs[instance].instance;
    const uint32_t at = bins->first + instance * bins->stride;
    const vf scale = vf_set(PT_SUM_SCALE), most = vf_set(PT_SUM_BRIGHTEST);
    const void *colors = pt_cpu_data(bins->call, at + 5);
    struct look *out = looks;
    vf terms[SUMS];
    pt_albedo(args, colors, id, 0, discs->drawn, terms);
    terms[3] = pt_opacity(args, colors, pt_cpu_data(bins->call, at + 6), id, 0, discs->drawn) * scale;
    vf largest = scale;
    for (int k = 0; k < 3; k++) {
        terms[k] = vf_max(vf_min(terms[k], most), vf_zero() - most) * terms[3];
        largest = vf_max(largest, vf_abs(terms[k]));
        terms[4 + k] = discs->n[k] * scale;
    }
    terms[7] = scale;
    float lanes[PT_LANES];
    for (int k = 0; k < SUMS; k++) {
        vf_store(lanes, terms[k], vm_first(PT_LANES));
        for (uint32_t i = 0; i < PT_LANES; i++)
            out[i].terms[k] = lanes[i];
    }
    vf_store(lanes, largest, vm_first(PT_LANES));
    for (uint32_t i = 0; i < PT_LANES; i++)
        out[i].most = (int32_t)lanes[i] + 1;
}

static void empty_sums(struct tile *tile)
{
    for (int i = 0; i < TILE_PIXELS; i++)
        for (int k = 0; k < SUMS; k++) {
            tile->wide[i][k] = (tile->emptied ? tile->wide[i][k] : 0) + tile->sums[i][k];
            tile->sums[i][k] = 0;
        }
    tile->emptied = 1;
    tile->left = INT32_MAX;
}

static inline void draw(void *context, const struct pt_disc *disc, const void *looks, uint32_t lane)
{
    struct tile *tile = context;
    const struct view_args *view = tile->bins->view;
    const struct look *look = (const struct look *)looks + lane;
    vf_eight terms;
    int32_t box[4];
    if (!pt_disc_in_tile(disc, &tile->at, box))
        return;
    if (tile->left < look->most)
        empty_sums(tile);
    tile->left -= look->most;
    memcpy(&terms, look->terms, sizeof terms);
    for (int32_t y = box[1]; y < box[3]; y++)
        for (int32_t x = box[0]; x < box[2]; x += PT_LANES) {
            const uint32_t at = row_of(tile, x, y);
            vf z, square;
            vm beside;
            vm covered =
                pt_disc_pixels(view, disc, x, y, vm_first(pt_lanes_left((uint32_t)x, (uint32_t)box[2])), &z, &square, &beside);
            covered = vm_and(covered, vm_and(vf_le(vf_load(tile->nearest + at), z), vf_le(z, vf_load(tile->farthest + at))));
            uint32_t bits = vm_bits(covered);
            if (!bits)
                continue;
            vm shown = vm_and(covered, vi_eq(vi_load(tile->id + at), vi_set(disc->id)));
            if (vm_bits(shown)) {
                vf dx = vi_convert(vi_sub(vi_add(vi_set((uint32_t)x), vi_lanes()), vi_set((uint32_t)disc->column)));
                vf dy = vf_set((float)(y - disc->row));
                vf_store(tile->away + at, dx * dx + dy * dy, shown);
            }
            float weights[PT_LANES];
            vf_store(weights, pt_disc_weights(view, disc, x, y, square, beside), vm_first(PT_LANES));
            int32_t(*sums)[SUMS] = tile->sums + (y - tile->at.y) * PT_DISC_TILE + (x - tile->at.x);
            for (; bits; bits &= bits - 1) {
                const int k = __builtin_ctz(bits);
                vi_eight *sum = (vi_eight *)(void *)sums[k];
                *sum += __builtin_convertvector(terms * weights[k], vi_eight);
            }
        }
}

// ---- tiles ---------------------------------------------------------------------------------------------------------------

static int load(struct tile *tile, const uint64_t *keys, const float *deff)
{
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z));
    int any = 0;
    for (int32_t y = 0; y < tile->at.height; y++) {
        const size_t from = (size_t)(tile->at.y + y) * tile->bins->view->width + (size_t)tile->at.x;
        const uint32_t to = (uint32_t)y * PT_DISC_STRIDE;
        for (uint32_t x = 0; x < (uint32_t)tile->at.width; x += PT_LANES) {
            vf z = vi_float(vi_load_z(keys + from + x));
            any |= vm_bits(vf_lt(z, empty)) != 0;
            vf_store(tile->nearest + to + x, z, vm_first(PT_LANES));
            vf_store(tile->farthest + to + x, z + vf_load(deff + from + x), vm_first(PT_LANES));
            vi_store(tile->id + to + x, vi_load_id(keys + from + x), vm_first(PT_LANES));
            vf_store(tile->away + to + x, vf_zero(), vm_first(PT_LANES));
        }
    }
    return any;
}

// A sum as a float, in steps that are the same everywhere.
static float wide_sum(int64_t sum)
{
    uint64_t size = sum < 0 ? 0 - (uint64_t)sum : (uint64_t)sum;
    float value = (float)(uint32_t)(size >> 32) * 4294967296.0f + (float)(uint32_t)size;
    return sum < 0 ? -value : value;
}

static void sums_of(const struct tile *tile, uint32_t pixel, uint32_t count, float sums[SUMS][PT_LANES])
{
    for (uint32_t i = 0; i < count; i++)
        for (int k = 0; k < SUMS; k++)
            sums[k][i] = tile->emptied ? wide_sum(tile->wide[pixel + i][k] + tile->sums[pixel + i][k])
                                       : (float)tile->sums[pixel + i][k];
}

// Those of `some` whose points have normals.
static vm with_normals(const struct pt_bins *bins, vi id, vm some)
{
    vm with = vm_of_bits(0);
    for (uint32_t i = 0; i < bins->instances; i++) {
        const struct instance_args *args = &bins->discs[i].instance;
        if (args->has_normals)
            with = vm_or(with, vi_lt_unsigned(vi_sub(id, vi_set(args->id_base)), vi_set(args->id_count)));
    }
    return vm_and(with, some);
}

// Mean normals, on the side that the nearest disc's lies on.
static void mean_normal(const struct view_args *view, const vf sums[SUMS], uint32_t x, uint32_t y, vm with, vf n[4])
{
    const vf zero = vf_zero();
    vf ray[2], square = (sums[4] * sums[4] + sums[5] * sums[5]) + sums[6] * sums[6], facing = zero - n[2];
    vm good = vm_and(with, vf_le(vf_set(1.0f), square));
    vf scale = vf_rsqrt(vf_select(good, square, vf_set(1.0f)));
    if (view->perspective) {
        vf_ray(view, x, y, ray);
        facing = (n[0] * ray[0] + n[1] * ray[1]) - n[2];
    }
    vm away = vf_lt(zero, facing);
    for (int k = 0; k < 3; k++) {
        vf mean = sums[4 + k] * scale;
        n[k] = vf_select(good, vf_select(away, zero - mean, mean), n[k]);
    }
}

static void save(const struct tile *tile, const uint64_t *keys, float *normals, float *albedo)
{
    const struct pt_bins *bins = tile->bins;
    const vf zero = vf_zero(), one = vf_set(1.0f);
    for (int32_t y = 0; y < tile->at.height; y++)
        for (uint32_t x = 0; x < (uint32_t)tile->at.width; x += PT_LANES) {
            const uint32_t px = (uint32_t)tile->at.x + x, py = (uint32_t)(tile->at.y + y);
            const size_t at = (size_t)py * bins->view->width + px;
            const uint32_t row = (uint32_t)y * PT_DISC_STRIDE + x;
            const uint32_t count = pt_lanes_left(x, (uint32_t)tile->at.width);
            vm some = vm_and(vm_first(count), vf_lt(vf_load(tile->nearest + row), vf_set(pt_float(PT_KEY_EMPTY_Z))));
            if (!vm_bits(some))
                continue;
            float lanes[SUMS][PT_LANES];
            vf sums[SUMS], color[4], n[4], away = vf_load(tile->away + row);
            sums_of(tile, (uint32_t)y * PT_DISC_TILE + x, count, lanes);
            for (int k = 0; k < SUMS; k++)
                sums[k] = vf_load(lanes[k]);
            vm colored = vm_and(some, vf_le(one, sums[3]));
            vf share = vf_rcp(vf_select(colored, sums[3], one));
            for (int k = 0; k < 3; k++)
                color[k] = vf_select(colored, sums[k] * share, zero);
            vf weight = vf_max(sums[7], one);
            color[3] = vf_select(vf_lt(sums[3], weight), vf_min(sums[3] * vf_rcp(weight), one), one); // opaque: 1 exactly
            vf_load4(normals + 4 * at, n);
            mean_normal(bins->view, sums, px, py, with_normals(bins, vi_load_id(keys + at), some), n);
            n[3] = vf_select(vf_lt(zero, away), away * vf_rsqrt(vf_max(away, one)), zero);
            vf_store4(normals + 4 * at, n, vm_bits(some));
            vf_store4(albedo + 4 * at, color, vm_bits(some));
        }
}

static void blend_tiles(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct pt_bins *bins = context;
    const uint32_t large = bins->bins - 1;
    struct tile *tile = (struct tile *)bins->call->scratch[1].memory + thread;
    struct look looks[PT_LANES];
    tile->bins = bins;
    for (uint32_t t = begin; t < end && !pt_cpu_cancelled(bins->call); t++) {
        tile->at = pt_bin_tile(bins, t);
        if (!load(tile, pt_cpu_data(bins->call, 0), pt_cpu_data(bins->call, 1)))
            continue;
        memset(tile->sums, 0, sizeof tile->sums);
        tile->left = INT32_MAX;
        tile->emptied = 0;
        pt_bin_walk(bins, t, look_at, looks, draw, tile);
        pt_bin_walk(bins, large, look_at, looks, draw, tile);
        save(tile, pt_cpu_data(bins->call, 0), pt_cpu_data(bins->call, 2), pt_cpu_data(bins->call, 3));
    }
}

int PT_KERNEL_ENTRY(blend)(const struct pt_cpu_call *call)
{
    const struct blend_args *args = call->arguments;
    struct pt_bins bins = { .call = call,
                            .view = &args->view,
                            .discs = (const struct disc_args *)(args + 1),
                            .drawn = args->sifted ? pt_cpu_data(call, 4 + 7 * args->instances) : NULL,
                            .instances = args->instances,
                            .first = 4,
                            .stride = 7 };
    int error = pt_bins_fill(&bins);
    if (error)
        return error;
    if (!pt_cpu_scratch(call, 1, pt_pool_threads(call->pool) * sizeof(struct tile)))
        return PATINA_ERROR_MEMORY;
    pt_parallel(call->pool, bins.bins - 1, 1, blend_tiles, &bins);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
