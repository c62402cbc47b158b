// SPDX-License-Identifier: GPL-3.0-or-later
// peel: a finished layer is blended behind those before it, and says what may show behind it. [D 4, 5], SPEC 3; twin of
// shaders/kernels/peel.comp. Works on rows of tiles.
#include "peel.h"
#include "shared/colors.h"

struct peel {
    const struct peel_args *args;
    uint64_t *keys;
    const uint32_t *from;
    const float *deff, *shading, *color;
    struct pt_peeled planes;
};

static void empty_keys(uint64_t *keys, uint32_t lanes)
{
    for (; lanes; lanes &= lanes - 1)
        keys[__builtin_ctz(lanes)] = (uint64_t)PT_KEY_EMPTY_Z << 32 | PT_KEY_EMPTY_ID;
}

static void peel_pixels(const struct peel *peel, size_t at, vm lanes, struct pt_tile_sum *tile)
{
    const vf zero = vf_zero();
    vf z = vi_float(vi_load_z(peel->keys + at)), color[4] = {zero, zero, zero, zero}, distance = zero;
    vf shading[4] = {zero, zero, zero, zero};
    vm some = vm_and(lanes, vf_lt(z, vf_set(pt_float(PT_KEY_EMPTY_Z))));
    if (vm_bits(some)) {
        vf_load4(peel->color + 4 * at, color);
        vf_load4(peel->shading + 4 * at, shading);
        vi from = vi_and(vi_load(peel->from + at), vi_set(~PT_FROM_MIXED));
        distance = vf_gather(peel->deff, from, some);
    }
    vm behind = pt_peel_pixels(peel->args, &peel->planes, at, lanes, some, z, color, shading[3], distance, tile);
    empty_keys(peel->keys + at, vm_bits(some) & ~vm_bits(behind)); // 1. filled across a layer already taken
}

static struct pt_tile_value peel_tile(const struct peel *peel, uint32_t tx, uint32_t ty)
{
    const struct view_args *view = &peel->args->view;
    const uint32_t *rect = view->rect, x0 = tx * PT_TILE, y0 = ty * PT_TILE;
    uint32_t left = x0 > rect[0] ? x0 : rect[0], right = x0 + PT_TILE < rect[2] ? x0 + PT_TILE : rect[2];
    uint32_t bottom = y0 > rect[1] ? y0 : rect[1], top = y0 + PT_TILE < rect[3] ? y0 + PT_TILE : rect[3];
    struct pt_tile_sum sum = pt_tile_begin();
    for (uint32_t y = bottom; y < top; y++)
        for (uint32_t x = left; x < right; x += PT_LANES)
            peel_pixels(peel, (size_t)y * view->width + x, vm_first(pt_lanes_left(x, right)), &sum);
    return pt_tile_end(&sum);
}

static void peel_rows(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct pt_cpu_call *call = context;
    const struct peel_args *args = call->arguments;
    const struct peel peel = {.args = args,
                              .keys = PT_DATA(call, peel, keys),
                              .from = PT_DATA(call, peel, from),
                              .deff = PT_DATA(call, peel, deff),
                              .shading = PT_DATA(call, peel, shading),
                              .color = PT_DATA(call, peel, color),
                              .planes = {PT_DATA(call, peel, limit), PT_DATA(call, peel, through), PT_DATA(call, peel, over)}};
    struct pt_tile_value *tiles = PT_DATA(call, peel, tiles);
    uint32_t columns = (args->view.width + PT_TILE - 1) / PT_TILE, first = args->view.rect[1] / PT_TILE;
    (void)thread;
    for (uint32_t ty = first + begin; ty < first + end && !pt_cpu_cancelled(call); ty++)
        for (uint32_t tx = args->view.rect[0] / PT_TILE; tx * PT_TILE < args->view.rect[2]; tx++)
            tiles[(size_t)ty * columns + tx] = peel_tile(&peel, tx, ty);
}

int PT_KERNEL_ENTRY(peel)(const struct pt_cpu_call *call)
{
    const struct peel_args *args = call->arguments;
    const uint32_t *rect = args->view.rect;
    if (rect[0] < rect[2] && rect[1] < rect[3])
        pt_parallel(call->pool, (rect[3] + PT_TILE - 1) / PT_TILE - rect[1] / PT_TILE, 1, peel_rows, (void *)call);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
