// SPDX-License-Identifier: GPL-3.0-or-later
// push: empty or occluded pixels take the key of their coarse parent, where two of the three coarse cells on their side
// are covered too (else every edge would grow by a coarse pixel). SPEC 2.2; twin of shaders/kernels/push.comp
//
// Vectors walk along coarse cells: what the cells' surfaces give is fetched once for the four pixels of each.
#include "device_cpu/rows.h"
#include "shared/filling.h"

struct push {
    const struct pt_cpu_call *call;
    const struct push_args *args;
    struct view_args coarse;
};

// 1 in the lanes where z < t.
static vi nearer(vf z, vf t) { return vi_select(vf_lt(z, t), vi_set(1), vi_set(0)); }

struct pixels { // PT_LANES of the fine level from (x, y) on
    uint32_t x, y;
    vf z, parent; // its z
};

// 1. Which of them, within view.rect, their parents may cover: by the least d_eff there can be.
static uint32_t asked(const struct push *push, uint32_t x, uint32_t y, vf parent, struct pixels *p)
{
    const uint32_t *rect = push->args->view.rect;
    if (x >= rect[2] || y < rect[1] || y >= rect[3])
        return 0;
    const vm lanes = vm_first(pt_lanes_left(x, rect[2]));
    const vf z = vi_float(
        vi_load_z((const uint64_t *)PT_DATA(push->call, push, keys) + (size_t)y * push->args->view.width + x));
    *p = (struct pixels){x, y, z, parent};
    vm some = vf_lt(z, vf_set(pt_float(PT_KEY_EMPTY_Z)));
    vf t = vf_select(some, z - pt_least_distance(&push->args->view, push->args->least, push->args->least_share, z),
                     z); // what is nearer covers it
    uint32_t bits = vm_bits(vm_and(lanes, vf_lt(parent, t)));
    if (push->args->background)
        bits &= ~vm_bits(some);
    return x < rect[0] ? bits & ~((1u << (rect[0] - x)) - 1u) : bits;
}

// 3. Which of those that `bits` names are covered by their parent and by two of the three coarse cells on their side.
static uint32_t covered(const struct push *push, const struct pixels *p, vf beside, vf above, vf corner, uint32_t bits)
{
    if (!bits)
        return 0;
    const size_t at = (size_t)p->y * push->args->view.width + p->x;
    vm lanes = vm_of_bits(bits), some = vm_and(lanes, vf_lt(p->z, vf_set(pt_float(PT_KEY_EMPTY_Z))));
    vf t = p->z;
    if (vm_bits(some)) {
        t = vf_select(some,
                      t - pt_own_distance(&push->args->view, PT_DATA(push->call, push, deff), PT_DATA(push->call, push, normal),
                                          PT_DATA(push->call, push, from), at, t, some),
                      t);
        lanes = vm_and(lanes, vf_lt(p->parent, t));
        if (!vm_bits(lanes))
            return 0;
    }
    vi sides = vi_add(vi_add(nearer(beside, t), nearer(above, t)), nearer(corner, t));
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
    vf z, n[3], ray[2], limit, farthest;
    vf dot, across[2]; // n . ray; n[0] times the ray's x of the pixels of either column
    uint32_t give;     // cells whose surface is not dense at the fine level
};

// Rays of the cells' pixels of column 0 or 1, row y.
static inline void pixel_ray(const struct push *push, const struct parents *p, uint32_t column, uint32_t y, vf ray[2])
{
    const vi cell = vi_add(vi_set(p->x), vi_lanes());
    vf_ray_of(&push->args->view, vi_add(vi_add(cell, cell), vi_set(column)), vi_set(y), ray);
}

// 2. Asked before the pixels' own surfaces: where no parent gives, none is looked up.
static void load_parents(const struct push *push, uint32_t x, uint32_t y, vf z, struct parents *p)
{
    const struct view_args *view = &push->args->view;
    const float *normals = PT_DATA(push->call, push, normal);
    const size_t at = (size_t)y * push->args->coarse_width + x;
    p->x = x;
    p->y = y;
    p->z = z;
    p->id = vi_load_id((const uint64_t *)PT_DATA(push->call, push, coarse_keys) + at);
    p->source = vi_load((const uint32_t *)PT_DATA(push->call, push, coarse_from) + at);
    vm some = vf_lt(z, vf_set(pt_float(PT_KEY_EMPTY_Z)));
    vf normal[4], ray[2];
    vf_gather4(normals, p->source, some, normal);
    vf inverse = normal[3];
    vf distance = vf_gather(PT_DATA(push->call, push, span), p->source, some); // at level 0
    p->give = vm_bits(vm_and(some, vm_not(vf_lt(distance, (vf_set(PT_DENSE) * vf_footprint(view, z)) * inverse))));
    for (uint32_t k = 0; k < 3; k++)
        p->n[k] = normal[k];
    vf_ray(&push->coarse, x, y, p->ray);
    p->limit = vf_max(distance, vf_footprint(&push->coarse, z) * inverse);
    p->farthest = z;
    if (push->args->refined && p->give) {
        const vi cell = vi_cell_of(p->source, push->args->from_width, push->coarse.level, push->args->coarse_width);
        p->farthest = vf_farthest(PT_DATA(push->call, push, coarse_keys), PT_DATA(push->call, push, coarse_from), cell,
                                  p->source, vm_of_bits(p->give), z, distance, inverse);
    }
    p->dot = (normal[0] * p->ray[0] + normal[1] * p->ray[1]) - normal[2];
    for (uint32_t column = 0; column < 2; column++) {
        pixel_ray(push, p, column, 0, ray);
        p->across[column] = normal[0] * ray[0];
    }
}

struct sides { // rows of coarse cells: the parents', and the one on the pixels' side
    struct pt_row_z own, next;
};

// z of the cells' pixels of column 0 or 1, row y: refined, of the surface's tangent plane there.
static inline vi pixel_z(const struct push *push, const struct parents *p, const struct sides *sides, uint32_t column,
                         uint32_t y)
{
    if (!push->args->refined)
        return vf_bits(p->z);
    vf ray[2], z, farthest = p->farthest;
    pixel_ray(push, p, column, y, ray);
    if (push->args->view.perspective) { // as vf_plane_depth does
        z = vf_meet(p->z, p->dot, (p->across[column] + p->n[1] * ray[1]) - p->n[2]);
        z = vf_min(vf_max(z, p->z), p->z + p->limit);
    } else {
        z = vf_plane_depth(&push->args->view, p->n, p->ray, p->z, ray, p->limit);
    }
    farthest = vf_farther(farthest, column ? sides->own.east : sides->own.west, p->z, z);
    farthest = vf_farther(farthest, sides->next.own, p->z, z);
    farthest = vf_farther(farthest, column ? sides->next.east : sides->next.west, p->z, z);
    return vf_bits(vf_max(vf_min(z, farthest), p->z));
}

// 4. The pixels of row y that `bits` names, PT_LANES in each half, take their parents' keys.
static void take(const struct push *push, const struct parents *p, const struct sides *sides, uint32_t y,
                 const uint32_t bits[2])
{
    vi z[2], id[2], source[2];
    vi_zip(pixel_z(push, p, sides, 0, y), pixel_z(push, p, sides, 1, y), z);
    vi_zip(p->id, p->id, id);
    vi_zip(p->source, p->source, source);
    const uint32_t width = push->args->view.width;
    uint64_t *keys = (uint64_t *)PT_DATA(push->call, push, keys) + (size_t)y * width;
    uint32_t *from = (uint32_t *)PT_DATA(push->call, push, from) + (size_t)y * width;
    for (uint32_t half = 0; half < 2; half++) {
        const uint32_t x = 2 * p->x + half * PT_LANES;
        if (!bits[half])
            continue;
        pt_row_put_keys(keys, width, x, z[half], id[half], vm_of_bits(bits[half]));
        pt_row_put(from, width, x, source[half], vm_of_bits(bits[half]));
    }
}

// The next row of cells finds its pixels and surfaces in the cache: 2.2 ms of one thread at 1024 x 1024, 2.5 without the
// pixels; stores wait for their lines, too. (Not inline, gcc 12 takes these for nothing and drops them.)
static inline __attribute__((always_inline)) void fetch_pixels(const struct push *push, uint32_t x, uint32_t y)
{
    for (uint32_t row = 0; row < 2; row++)
        for (uint32_t i = 0; i < 2 * PT_LANES; i += 16) {
            const size_t at = (size_t)(2 * y + row) * push->args->view.width + 2 * x + i;
            __builtin_prefetch((const uint64_t *)PT_DATA(push->call, push, keys) + at);
            __builtin_prefetch((const uint64_t *)PT_DATA(push->call, push, keys) + at + 8);
            __builtin_prefetch((const uint32_t *)PT_DATA(push->call, push, from) + at);
        }
}

static inline __attribute__((always_inline)) void fetch_surfaces(const struct push *push, uint32_t x, uint32_t y)
{
    const uint32_t *source = (const uint32_t *)PT_DATA(push->call, push, coarse_from) + (size_t)y * push->args->coarse_width +
                             x;
    for (uint32_t i = 0; y < push->args->coarse_height && i < PT_LANES; i++) {
        __builtin_prefetch((const float *)PT_DATA(push->call, push, normal) + 4 * (size_t)source[i]);
        __builtin_prefetch((const float *)PT_DATA(push->call, push, span) + source[i]);
    }
}

static struct pt_row_z load_cells(const struct push *push, uint32_t x, uint32_t y)
{
    const struct push_args *args = push->args;
    return pt_load_row_z(PT_DATA(push->call, push, coarse_keys), args->coarse_width, args->coarse_height, x, y,
                         !x || x + PT_LANES >= args->coarse_width);
}

// What the cells' pixels of columns 0 and 1 take: those of PT_LANES pixels, and of the next ones.
static void for_pixels(vf even, vf odd, vf out[2])
{
    vi zipped[2];
    vi_zip(vf_bits(even), vf_bits(odd), zipped);
    for (uint32_t half = 0; half < 2; half++)
        out[half] = vi_float(zipped[half]);
}

static void push_cells(const struct push *push, uint32_t x, uint32_t y)
{
    const struct pt_row_z own = load_cells(push, x, y);
    struct pixels pixels[2][2];
    uint32_t bits[2][2], any = 0;
    vf parent[2], beside[2], above[2], corner[2]; // z of the parents, and of the three cells on the pixels' sides
    fetch_pixels(push, x, y + 1);
    for_pixels(own.own, own.own, parent);
    for (uint32_t row = 0; row < 2; row++)
        for (uint32_t half = 0; half < 2; half++)
            any |= bits[row][half] = asked(push, 2 * x + half * PT_LANES, 2 * y + row, parent[half], &pixels[row][half]);
    if (!any)
        return;
    fetch_surfaces(push, x, y + 1);
    struct parents parents;
    load_parents(push, x, y, own.own, &parents);
    const uint32_t give = twice(parents.give);
    for_pixels(own.west, own.east, beside);
    for (uint32_t row = 0; give && row < 2; row++) {
        const struct sides sides = {own, load_cells(push, x, row ? y + 1 : y - 1)};
        for_pixels(sides.next.own, sides.next.own, above);
        for_pixels(sides.next.west, sides.next.east, corner);
        for (uint32_t half = 0; half < 2; half++)
            bits[row][half] = covered(push, &pixels[row][half], beside[half], above[half], corner[half],
                                      bits[row][half] & give >> half * PT_LANES);
        if (bits[row][0] | bits[row][1])
            take(push, &parents, &sides, 2 * y + row, bits[row]);
    }
}

static void push_rows(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct pt_cpu_call *call = context;
    const struct push_args *args = call->arguments;
    const uint32_t *rect = args->view.rect;
    struct push push = {.call = call, .args = args, .coarse = args->view};
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
