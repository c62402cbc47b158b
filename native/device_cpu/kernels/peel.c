// SPDX-License-Identifier: GPL-3.0-or-later
// peel: a finished layer is blended behind those before it, and says what may show behind it. [D 4, 5], SPEC 3; twin of
// shaders/kernels/peel.comp. Works on rows of tiles; a tile is a whole number of vectors wide.
#include "device_cpu/rows.h"

enum { TILE = 1 << PT_TILE_LEVEL };

struct planes {
    const struct peel_args *args;
    uint64_t *keys;
    const uint32_t *from;
    const float *deff, *shading, *color;
    float *limit, *through, *over;
};

struct tile { // as the plane holds it
    float least;
    uint32_t covered;
};

struct tile_sum {
    vf least; // of every PT_LANES-th pixel
    uint32_t covered;
};

static void empty_keys(uint64_t *keys, uint32_t lanes)
{
    for (; lanes; lanes &= lanes - 1)
        keys[__builtin_ctz(lanes)] = (uint64_t)PT_KEY_EMPTY_Z << 32 | PT_KEY_EMPTY_ID;
}

// 2. behind what was blended before
static void blend(const struct planes *p, size_t at, vm behind, vm lanes)
{
    vf color[4], sum[4] = { vf_zero(), vf_zero(), vf_zero(), vf_zero() };
    if (!p->args->first)
        vf_load4(p->over + 4 * at, sum);
    if (vm_bits(behind)) {
        vf_load4(p->color + 4 * at, color);
        vf through = vf_set(1.0f) - sum[3];
        for (int k = 0; k < 4; k++)
            sum[k] = vf_select(behind, sum[k] + through * color[k], sum[k]);
    }
    if (p->args->first || vm_bits(behind))
        vf_store4(p->over + 4 * at, sum, vm_bits(lanes));
}

static void peel_pixels(const struct planes *p, size_t at, vm lanes, struct tile_sum *tile)
{
    const vf finished = vf_set(pt_float(PT_KEY_EMPTY_Z)), one = vf_set(1.0f);
    const int first = p->args->first != 0;
    vf z = vi_float(vi_load_z(p->keys + at)), before = first ? vf_set(-1.0f) : vf_load(p->limit + at);
    vm some = vm_and(lanes, vf_lt(z, finished)), behind = vm_and(some, vf_lt(before, z));
    // 1. filled across a layer already taken
    empty_keys(p->keys + at, vm_bits(some) & ~vm_bits(behind));
    blend(p, at, behind, lanes);
    // 3. what comes through, and from where on
    vf light = first ? one : vf_load(p->through + at), beyond = vf_select(some, before, finished);
    if (vm_bits(behind)) {
        vf shading[4];
        vf_load4(p->shading + 4 * at, shading);
        light = vf_select(behind, light * (one - shading[3]), light);
        vi from = vi_and(vi_load(p->from + at), vi_set(~PT_FROM_MIXED));
        vf next = z + vf_gather(p->deff, from, behind);
        if (p->args->stop)
            next = vf_select(vf_lt(light, vf_set(PT_SPENT)), finished, next);
        beyond = vf_select(behind, next, beyond);
    }
    vf_store(p->through + at, light, lanes);
    vf_store(p->limit + at, beyond, lanes);
    // 4. of the tile
    tile->covered += (uint32_t)__builtin_popcount(vm_bits(behind));
    tile->least = vf_min(tile->least, vf_select(some, beyond, finished));
}

static void peel_tile(const struct planes *p, uint32_t tx, uint32_t ty, struct tile *tile)
{
    const struct view_args *view = &p->args->view;
    const uint32_t *rect = view->rect, x0 = tx * TILE, y0 = ty * TILE;
    uint32_t left = x0 > rect[0] ? x0 : rect[0], right = x0 + TILE < rect[2] ? x0 + TILE : rect[2];
    uint32_t bottom = y0 > rect[1] ? y0 : rect[1], top = y0 + TILE < rect[3] ? y0 + TILE : rect[3];
    struct tile_sum sum = { .least = vf_set(pt_float(PT_KEY_EMPTY_Z)) };
    float least[PT_LANES];
    for (uint32_t y = bottom; y < top; y++)
        for (uint32_t x = left; x < right; x += PT_LANES)
            peel_pixels(p, (size_t)y * view->width + x, vm_first(pt_lanes_left(x, right)), &sum);
    vf_store(least, sum.least, vm_first(PT_LANES));
    for (int i = 1; i < PT_LANES; i++)
        least[0] = pt_min(least[0], least[i]);
    *tile = (struct tile){ least[0], sum.covered };
}

static void peel_rows(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct pt_cpu_call *call = context;
    const struct peel_args *args = call->arguments;
    const struct planes planes = { .args = args,
                                   .keys = pt_cpu_data(call, 0),
                                   .from = pt_cpu_data(call, 1),
                                   .deff = pt_cpu_data(call, 2),
                                   .shading = pt_cpu_data(call, 3),
                                   .color = pt_cpu_data(call, 4),
                                   .limit = pt_cpu_data(call, 5),
                                   .through = pt_cpu_data(call, 6),
                                   .over = pt_cpu_data(call, 7) };
    struct tile *tiles = pt_cpu_data(call, 8);
    uint32_t columns = (args->view.width + TILE - 1) / TILE, first = args->view.rect[1] / TILE;
    (void)thread;
    for (uint32_t ty = first + begin; ty < first + end && !pt_cpu_cancelled(call); ty++)
        for (uint32_t tx = args->view.rect[0] / TILE; tx * TILE < args->view.rect[2]; tx++)
            peel_tile(&planes, tx, ty, &tiles[(size_t)ty * columns + tx]);
}

int PT_KERNEL_ENTRY(peel)(const struct pt_cpu_call *call)
{
    const struct peel_args *args = call->arguments;
    const uint32_t *rect = args->view.rect;
    if (rect[0] < rect[2] && rect[1] < rect[3])
        pt_parallel(call->pool, (rect[3] + TILE - 1) / TILE - rect[1] / TILE, 1, peel_rows, (void *)call);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
