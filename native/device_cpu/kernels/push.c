// SPDX-License-Identifier: GPL-3.0-or-later
// push: empty or occluded pixels take the key of their coarse parent, where two of the three coarse cells on their side
// are covered too (else every edge would grow by a coarse pixel). SPEC 2.2; twin of shaders/kernels/push.comp
//
// Vectors walk along coarse cells: what the cells' surfaces give is fetched once for the four pixels of each.
#include "device_cpu/rows.h"

struct push {
    const struct pt_cpu_call *call;
    const struct push_args *args;
    struct view_args coarse;
};

// z of the coarse cells (x, y); beyond the plane +inf.
static vf coarse_z(const struct push *push, vi x, vi y, vm lanes)
{
    vm inside = vm_and(lanes, vm_and(vi_lt_unsigned(x, vi_set(push->args->coarse_width)),
                                     vi_lt_unsigned(y, vi_set(push->args->coarse_height))));
    vi cell = vi_add(vi_mul(y, vi_set(push->args->coarse_width)), x);
    vf z = vi_float(vi_gather_z(pt_cpu_data(push->call, 0), cell, inside));
    return vf_select(inside, z, vf_set(pt_float(PT_KEY_EMPTY_Z)));
}

struct around { // of PT_LANES pixels: z of the three coarse cells on the pixel's side
    vf beside, above, corner;
};

// By plain loads: x even, and no cell that is asked for beyond the plane.
static const uint64_t *coarse_row(const struct push *push, uint32_t x, uint32_t y)
{
    return (const uint64_t *)pt_cpu_data(push->call, 0) + (size_t)(y >> 1) * push->args->coarse_width + (x >> 1);
}

static struct around load_inside(const struct push *push, uint32_t x, uint32_t y)
{
    const uint64_t *row = coarse_row(push, x, y);
    const uint64_t *next = y & 1 ? row + push->args->coarse_width : row - push->args->coarse_width;
    return (struct around){ vi_float(vi_sides(vi_load_z(row - 1))), vi_float(vi_pairs(vi_load_z(next))),
                            vi_float(vi_sides(vi_load_z(next - 1))) };
}

static struct around load_anywhere(const struct push *push, uint32_t x, uint32_t y, vm lanes)
{
    vi column = vi_add(vi_set(x), vi_lanes()), px = vi_shr(column, 1), py = vi_set(y >> 1);
    // towards the pixel's side: -1 for even, 1 for odd
    vi nx = vi_sub(vi_add(px, vi_mul(vi_and(column, vi_set(1)), vi_set(2))), vi_set(1));
    vi ny = vi_set((y >> 1) + 2 * (y & 1) - 1);
    return (struct around){ coarse_z(push, nx, py, lanes), coarse_z(push, px, ny, lanes), coarse_z(push, nx, ny, lanes) };
}

static vf load_parent(const struct push *push, uint32_t x, uint32_t y, int inside, vm lanes)
{
    if (inside)
        return vi_float(vi_pairs(vi_load_z(coarse_row(push, x, y))));
    return coarse_z(push, vi_shr(vi_add(vi_set(x), vi_lanes()), 1), vi_set(y >> 1), lanes);
}

static int is_inside(const struct push *push, uint32_t x, uint32_t y)
{
    return PT_LANES > 1 && !(x & 1) && x >= 2 && (x >> 1) + PT_LANES / 2 < push->args->coarse_width && y >= 2 &&
           (y >> 1) + 1 < push->args->coarse_height;
}

// 1 in the lanes where z < t.
static vi nearer(vf z, vf t) { return vi_select(vf_lt(z, t), vi_set(1), vi_set(0)); }

struct pixels { // PT_LANES of the fine level from (x, y) on
    uint32_t x, y;
    int inside;
    vf z, parent; // its z
};

// 1. Which of them, within view.rect, their parents may cover: by the least d_eff there can be.
static uint32_t asked(const struct push *push, uint32_t x, uint32_t y, struct pixels *p)
{
    const uint32_t *rect = push->args->view.rect;
    if (x >= rect[2] || y < rect[1] || y >= rect[3])
        return 0;
    const vm lanes = vm_first(pt_lanes_left(x, rect[2]));
    const vf z = vi_float(vi_load_z((const uint64_t *)pt_cpu_data(push->call, 2) + (size_t)y * push->args->view.width + x));
    const int inside = is_inside(push, x, y);
    *p = (struct pixels){ x, y, inside, z, load_parent(push, x, y, inside, lanes) };
    vm some = vf_lt(z, vf_set(pt_float(PT_KEY_EMPTY_Z)));
    vf t = vf_select(some, z - pt_least_distance(&push->args->view, push->args->least, z), z); // what is nearer covers the pixel
    uint32_t bits = vm_bits(vm_and(lanes, vf_lt(p->parent, t)));
    return x < rect[0] ? bits & ~((1u << (rect[0] - x)) - 1u) : bits;
}

// 3. Which of those that `bits` names are covered by their parent and by two of the three coarse cells on their side.
static uint32_t covered(const struct push *push, const struct pixels *p, uint32_t bits)
{
    if (!bits)
        return 0;
    const size_t at = (size_t)p->y * push->args->view.width + p->x;
    vm lanes = vm_of_bits(bits), some = vm_and(lanes, vf_lt(p->z, vf_set(pt_float(PT_KEY_EMPTY_Z))));
    vf t = p->z;
    if (vm_bits(some)) {
        t = vf_select(some, t - pt_own_distance(&push->args->view, pt_cpu_data(push->call, 5), pt_cpu_data(push->call, 4),
                                                pt_cpu_data(push->call, 3), at, t, some), t);
        lanes = vm_and(lanes, vf_lt(p->parent, t));
        if (!vm_bits(lanes))
            return 0;
    }
    struct around around = p->inside ? load_inside(push, p->x, p->y) : load_anywhere(push, p->x, p->y, lanes);
    vi sides = vi_add(vi_add(nearer(around.beside, t), nearer(around.above, t)), nearer(around.corner, t));
    return vm_bits(vm_and(lanes, vi_lt_unsigned(vi_set(1), sides)));
}

// Bit i becomes bits 2 i and 2 i + 1.
static uint32_t twice(uint32_t bits)
{
    bits = (bits | bits << 8) & 0x00FF00FFu;
    bits = (bits | bits << 4) & 0x0F0F0F0Fu;
    bits = (bits | bits << 2) & 0x33333333u;
    bits = (bits | bits << 1) & 0x55555555u;
    return bits * 3u;
}

struct parents { // PT_LANES coarse cells from (x, y) on, and their surfaces
    uint32_t x, y;
    vi id, source;
    vf z, n[3], ray[2], limit;
    uint32_t give; // cells whose surface is not dense at the fine level
};

// 2. Asked before the pixels' own surfaces: where no parent gives, none is looked up.
static void load_parents(const struct push *push, uint32_t x, uint32_t y, struct parents *p)
{
    const struct view_args *view = &push->args->view;
    const float *normals = pt_cpu_data(push->call, 4);
    const size_t at = (size_t)y * push->args->coarse_width + x;
    const uint64_t *keys = (const uint64_t *)pt_cpu_data(push->call, 0) + at;
    p->x = x;
    p->y = y;
    p->z = vi_float(vi_load_z(keys));
    p->id = vi_load_id(keys);
    p->source = vi_load((const uint32_t *)pt_cpu_data(push->call, 1) + at);
    vm some = vm_and(vm_first(pt_lanes_left(x, push->args->coarse_width)), vf_lt(p->z, vf_set(pt_float(PT_KEY_EMPTY_Z))));
    vf normal[4];
    vf_gather4(normals, p->source, some, normal);
    vf inverse = normal[3];
    vf distance = vf_gather(pt_cpu_data(push->call, 5), p->source, some); // at level 0
    p->give = vm_bits(vm_and(some, vm_not(vf_lt(distance, (vf_set(PT_DENSE) * vf_footprint(view, p->z)) * inverse))));
    if (!p->give || !push->args->refined)
        return;
    for (uint32_t k = 0; k < 3; k++)
        p->n[k] = normal[k];
    vf_ray(&push->coarse, x, y, p->ray);
    p->limit = vf_max(distance, vf_footprint(&push->coarse, p->z) * inverse);
}

// z of the cells' pixels of column 0 or 1, row y: refined, of the surface's tangent plane there.
static vi pixel_z(const struct push *push, const struct parents *p, uint32_t column, uint32_t y)
{
    if (!push->args->refined)
        return vf_bits(p->z);
    vi cell = vi_add(vi_set(p->x), vi_lanes());
    vf ray[2];
    vf_ray_of(&push->args->view, vi_add(vi_add(cell, cell), vi_set(column)), vi_set(y), ray);
    return vf_bits(vf_plane_depth(&push->args->view, p->n, p->ray, p->z, ray, p->limit));
}

// 4. The pixels of row y that `bits` names, PT_LANES in each half, take their parents' keys.
static void take(const struct push *push, const struct parents *p, uint32_t y, const uint32_t bits[2])
{
    vi z[2], id[2], source[2];
    vi_zip(pixel_z(push, p, 0, y), pixel_z(push, p, 1, y), z);
    vi_zip(p->id, p->id, id);
    vi_zip(p->source, p->source, source);
    for (uint32_t half = 0; half < 2; half++) {
        if (!bits[half])
            continue;
        size_t at = (size_t)y * push->args->view.width + 2 * p->x + half * PT_LANES;
        vi_store_keys((uint64_t *)pt_cpu_data(push->call, 2) + at, z[half], id[half], bits[half]);
        vi_store((uint32_t *)pt_cpu_data(push->call, 3) + at, source[half], vm_of_bits(bits[half]));
    }
}

// The next row of cells finds its pixels and surfaces in the cache: 2.2 ms of one thread at 1024 x 1024, 2.5 without the
// pixels; stores wait for their lines, too. (Not inline, gcc 12 takes these for nothing and drops them.)
static inline __attribute__((always_inline)) void fetch_pixels(const struct push *push, uint32_t x, uint32_t y)
{
    for (uint32_t row = 0; row < 2; row++)
        for (uint32_t i = 0; i < 2 * PT_LANES; i += 16) {
            const size_t at = (size_t)(2 * y + row) * push->args->view.width + 2 * x + i;
            __builtin_prefetch((const uint64_t *)pt_cpu_data(push->call, 2) + at);
            __builtin_prefetch((const uint64_t *)pt_cpu_data(push->call, 2) + at + 8);
            __builtin_prefetch((const uint32_t *)pt_cpu_data(push->call, 3) + at);
        }
}

static inline __attribute__((always_inline)) void fetch_surfaces(const struct push *push, uint32_t x, uint32_t y)
{
    const uint32_t *source = (const uint32_t *)pt_cpu_data(push->call, 1) + (size_t)y * push->args->coarse_width + x;
    for (uint32_t i = 0; y < push->args->coarse_height && i < PT_LANES; i++) {
        __builtin_prefetch((const float *)pt_cpu_data(push->call, 4) + 4 * (size_t)source[i]);
        __builtin_prefetch((const float *)pt_cpu_data(push->call, 5) + source[i]);
    }
}

static void push_cells(const struct push *push, uint32_t x, uint32_t y)
{
    struct pixels pixels[2][2];
    uint32_t bits[2][2], any = 0;
    fetch_pixels(push, x, y + 1);
    for (uint32_t row = 0; row < 2; row++)
        for (uint32_t half = 0; half < 2; half++)
            any |= bits[row][half] = asked(push, 2 * x + half * PT_LANES, 2 * y + row, &pixels[row][half]);
    if (!any)
        return;
    fetch_surfaces(push, x, y + 1);
    struct parents parents;
    load_parents(push, x, y, &parents);
    const uint32_t give = twice(parents.give);
    for (uint32_t row = 0; give && row < 2; row++) {
        for (uint32_t half = 0; half < 2; half++)
            bits[row][half] = covered(push, &pixels[row][half], bits[row][half] & give >> half * PT_LANES);
        if (bits[row][0] | bits[row][1])
            take(push, &parents, 2 * y + row, bits[row]);
    }
}

static void push_rows(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct pt_cpu_call *call = context;
    const struct push_args *args = call->arguments;
    const uint32_t *rect = args->view.rect;
    struct push push = { .call = call, .args = args, .coarse = args->view };
    (void)thread;
    push.coarse.level++;
    for (uint32_t y = begin; y < end && !pt_cpu_cancelled(call); y++)
        for (uint32_t x = rect[0] / 2; 2 * x < rect[2]; x += PT_LANES)
            push_cells(&push, x, rect[1] / 2 + y);
}

int PT_KERNEL_ENTRY(push)(const struct pt_cpu_call *call)
{
    const struct push_args *args = call->arguments;
    const uint32_t *rect = args->view.rect;
    if (rect[0] >= rect[2] || rect[1] >= rect[3])
        return PATINA_OK;
    pt_parallel(call->pool, (rect[3] + 1) / 2 - rect[1] / 2, 4, push_rows, (void *)call);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
