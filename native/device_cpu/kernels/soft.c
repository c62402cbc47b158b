// SPDX-License-Identifier: GPL-3.0-or-later
// soft: the balls of soft points before each pixel, front to back [S]. SPEC 5, soft; twin of shaders/kernels/soft.comp
#include "soft_veil.h"
#include "shared/balls.h"

struct soft {
    struct pt_soft_bins bins;
    char *memory;  // of each thread
    size_t own;    // bytes of it
    uint32_t room; // balls in the longest list
    _Atomic uint64_t fragments;
};

static void load(struct pt_soft_tile *tile)
{
    const struct soft_args *args = tile->bins->args;
    const uint64_t *keys = PT_DATA(tile->bins->call, soft, keys);
    const float *reached = PT_DATA(tile->bins->call, soft, reached);
    memset(tile->color, 0, sizeof tile->color);
    memset(tile->density, 0, sizeof tile->density);
    memset(tile->from, 0, sizeof tile->from);
    memset(tile->to, 0, sizeof tile->to);
    for (uint32_t i = 0; i < PT_SOFT_PIXELS; i++)
        tile->through[i] = 1.0f;
    for (uint32_t y = 0; y < tile->height; y++)
        for (uint32_t x = 0; x < tile->width; x++) {
            const size_t at = ((size_t)tile->y + y) * args->view.width + (size_t)tile->x + x;
            const uint32_t i = pt_soft_at(x, y);
            tile->from[i] = args->layered ? pt_max(reached[at], args->z_from) : args->z_from;
            tile->to[i] = args->layered == 2 ? args->z_to : pt_min(pt_float((uint32_t)(keys[at] >> 32)), args->z_to);
        }
}

static void save_pixel(const struct pt_soft_tile *tile, uint32_t i, uint32_t x, uint32_t y)
{
    const struct soft_args *args = tile->bins->args;
    const struct pt_cpu_call *call = tile->bins->call;
    const size_t at = (size_t)y * args->view.width + x,
                 crop = ((size_t)y - args->crop_y) * args->crop_width + (x - args->crop_x);
    float *target = (float *)PT_DATA(call, soft, target) + 4 * (args->layered ? at : crop);
    const float own[4] = {tile->color[0][i], tile->color[1][i], tile->color[2][i], 1.0f - tile->through[i]},
                left = 1.0f - target[3];
    for (int k = 0; k < 4; k++)
        target[k] = args->layered ? target[k] + left * own[k] : own[k] + tile->through[i] * target[k];
    if (args->density == 1)
        ((float *)PT_DATA(call, soft, density))[crop] = tile->density[i];
    else if (args->density)
        ((float *)PT_DATA(call, soft, density))[crop] += tile->density[i];
    if (args->layered && args->last) {
        float *reached = (float *)PT_DATA(call, soft, reached) + at;
        *reached = pt_max(*reached, pt_float((uint32_t)(((const uint64_t *)PT_DATA(call, soft, keys))[at] >> 32)));
    }
}

static void draw_tiles(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct soft *soft = context;
    const struct pt_soft_bins *bins = &soft->bins;
    const uint32_t *rect = bins->args->view.rect;
    for (uint32_t t = begin + bins->first; t < end + bins->first && !pt_cpu_cancelled(bins->call); t++) {
        const uint32_t x = rect[0] + t % bins->columns * PT_SOFT_TILE, y = rect[1] + t / bins->columns * PT_SOFT_TILE;
        const uint32_t count = bins->begins[t + 1] - bins->begins[t];
        if (!count && !bins->args->layered && !bins->args->veils && bins->args->density != 1)
            continue; // nothing would change
        struct pt_soft_tile tile;
        struct pt_soft_order order;
        char *memory = soft->memory + thread * soft->own;
        tile.bins = bins;
        tile.x = (int32_t)x;
        tile.y = (int32_t)y;
        tile.width = rect[2] - x < PT_SOFT_TILE ? rect[2] - x : PT_SOFT_TILE;
        tile.height = rect[3] - y < PT_SOFT_TILE ? rect[3] - y : PT_SOFT_TILE;
        tile.fragments = 0;
        if (count)
            pt_soft_order_open(&order, bins->lists + bins->begins[t], (uint64_t *)(void *)memory, count);
        if (bins->args->veils) {
            pt_soft_veils(&tile, count ? pt_soft_order_all(&order) : NULL, count);
            continue;
        }
        load(&tile);
        if (count && PT_SOFT_DISCS(bins->args->model))
            pt_soft_tile_discs(&tile, &order);
        else if (count)
            pt_soft_balls(&tile, pt_soft_order_all(&order), count, memory + soft->room * sizeof *bins->lists, soft->room);
        for (uint32_t k = 0; k < tile.height; k++)
            for (uint32_t i = 0; i < tile.width; i++)
                save_pixel(&tile, pt_soft_at(i, k), x + i, y + k);
        atomic_fetch_add_explicit(&soft->fragments, tile.fragments, memory_order_relaxed);
    }
}

static int draw_batch(struct soft *soft)
{
    const struct pt_soft_bins *bins = &soft->bins;
    soft->room = 0;
    for (uint32_t t = bins->first; t < bins->end; t++) {
        const uint32_t count = bins->begins[t + 1] - bins->begins[t];
        soft->room = count > soft->room ? count : soft->room;
    }
    soft->room = (soft->room + 31) / 16 * 16;
    soft->own = soft->room * sizeof *bins->lists;
    if (!PT_SOFT_DISCS(bins->args->model) && !bins->args->veils)
        soft->own += pt_soft_hit_bytes(soft->room);
    if (!(soft->memory = pt_cpu_scratch(bins->call, 1, pt_pool_threads(bins->call->pool) * soft->own)))
        return PATINA_ERROR_MEMORY;
    pt_parallel(bins->call->pool, bins->end - bins->first, 1, draw_tiles, soft);
    return pt_cpu_cancelled(bins->call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}

int PT_KERNEL_ENTRY(soft)(const struct pt_cpu_call *call)
{
    struct soft soft = {.bins = {.call = call, .args = call->arguments, .points = PT_DATA(call, soft, points)}};
    const uint32_t *rect = soft.bins.args->view.rect;
    if (rect[0] >= rect[2] || rect[1] >= rect[3])
        return PATINA_OK;
    int error = pt_soft_bins_open(&soft.bins);
    while (!error && pt_soft_batch(&soft.bins))
        error = draw_batch(&soft);
    const uint64_t told[2] = {atomic_load(&soft.fragments), soft.bins.drawn};
    memcpy(PT_DATA(call, soft, bins), told, sizeof told);
    return error;
}
