// SPDX-License-Identifier: GPL-3.0-or-later
// push: empty or occluded pixels take the key of their coarse parent, where two of the three coarse cells on their side
// are covered too (else every edge would grow by a coarse pixel). SPEC 2.2; twin of shaders/kernels/push.comp
//
// Vectors look for a row's pixels whose parent is nearer; those that take its key are listed and taken in full vectors.
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

// 1. Which of PT_LANES pixels are covered by their parent and by two of the three coarse cells on their side.
static uint32_t covered(const struct push *push, uint32_t x, uint32_t y, uint32_t lanes)
{
    size_t at = (size_t)y * push->args->view.width + x;
    vf z = vi_float(vi_load_z((const uint64_t *)pt_cpu_data(push->call, 2) + at));
    const int inside = is_inside(push, x, y);
    vf parent = load_parent(push, x, y, inside, vm_first(lanes));
    vm asked = vm_and(vm_first(lanes), vf_lt(parent, z)); // d_eff is never below 0
    if (!vm_bits(asked))
        return 0;
    vm some = vm_and(asked, vf_lt(z, vf_set(pt_float(PT_KEY_EMPTY_Z))));
    vf t = z; // the threshold: what is nearer covers the pixel
    if (vm_bits(some))
        t = vf_select(some, z - pt_own_distance(&push->args->view, pt_cpu_data(push->call, 5), pt_cpu_data(push->call, 4),
                                            pt_cpu_data(push->call, 3), at, z, some), z);
    asked = vm_and(asked, vf_lt(parent, t));
    if (!vm_bits(asked))
        return 0;
    struct around around = inside ? load_inside(push, x, y) : load_anywhere(push, x, y, asked);
    vi sides = vi_add(vi_add(nearer(around.beside, t), nearer(around.above, t)), nearer(around.corner, t));
    return vm_bits(vm_and(asked, vi_lt_unsigned(vi_set(1), sides)));
}

// 2. The parent's key, where its surface is not dense at this level; refined: its surface's tangent plane here. `x`: the
// row's pixels that may take it.
static void take(const struct push *push, const uint32_t *x, uint32_t y, uint32_t count)
{
    const struct view_args *view = &push->args->view;
    const uint64_t *coarse_keys = pt_cpu_data(push->call, 0);
    const float *normals = pt_cpu_data(push->call, 4);
    vm lanes = vm_first(count);
    vi column = vi_load(x), row = vi_set(y), px = vi_shr(column, 1), py = vi_set(y >> 1);
    vi parent = vi_add(vi_mul(py, vi_set(push->args->coarse_width)), px);
    vi source = vi_gather(pt_cpu_data(push->call, 1), parent, lanes), id = vi_gather_id(coarse_keys, parent, lanes);
    vf z = vi_float(vi_gather_z(coarse_keys, parent, lanes));
    vf inverse = vf_gather(normals, vi_add(vi_mul(source, vi_set(4)), vi_set(3)), lanes);
    vf distance = vf_gather(pt_cpu_data(push->call, 5), source, lanes); // at level 0
    vm dense = vf_lt(distance, (vf_set(PT_DENSE) * vf_footprint(view, z)) * inverse);
    uint32_t takes = vm_bits(vm_and(lanes, vm_not(dense)));
    if (!takes)
        return;
    if (push->args->refined) {
        vf n[3], ray_p[2], ray_q[2];
        for (uint32_t k = 0; k < 3; k++)
            n[k] = vf_gather(normals, vi_add(vi_mul(source, vi_set(4)), vi_set(k)), lanes);
        vf_ray_of(view, column, row, ray_p);
        vf_ray_of(&push->coarse, px, py, ray_q);
        vf limit = vf_max(distance, vf_footprint(&push->coarse, z) * inverse);
        z = vf_plane_depth(view, n, ray_q, z, ray_p, limit);
    }
    uint32_t zs[PT_LANES], ids[PT_LANES], sources[PT_LANES];
    vi_store(zs, vf_bits(z), vm_first(PT_LANES));
    vi_store(ids, id, vm_first(PT_LANES));
    vi_store(sources, source, vm_first(PT_LANES));
    for (; takes; takes &= takes - 1) {
        uint32_t i = (uint32_t)__builtin_ctz(takes);
        size_t at = (size_t)y * view->width + x[i];
        ((uint64_t *)pt_cpu_data(push->call, 2))[at] = (uint64_t)zs[i] << 32 | ids[i];
        ((uint32_t *)pt_cpu_data(push->call, 3))[at] = sources[i];
    }
}

static size_t row_room(const uint32_t rect[4]) { return rect[2] - rect[0] + 2 * PT_LANES; }

static void push_rows(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct pt_cpu_call *call = context;
    const struct push_args *args = call->arguments;
    const uint32_t *rect = args->view.rect;
    struct push push = { .call = call, .args = args, .coarse = args->view };
    uint32_t *taken = (uint32_t *)pt_cpu_scratch(call, 0, 0) + (size_t)thread * row_room(rect);
    push.coarse.level++;
    for (uint32_t y = rect[1] + begin; y < rect[1] + end && !pt_cpu_cancelled(call); y++) {
        uint32_t count = 0;
        for (uint32_t x = rect[0] & ~1u; x < rect[2]; x += PT_LANES) {
            uint32_t bits = covered(&push, x, y, pt_lanes_left(x, rect[2]));
            if (x < rect[0])
                bits &= ~1u; // the pairs begin before the rectangle
            for (; bits; bits &= bits - 1)
                taken[count++] = x + (uint32_t)__builtin_ctz(bits);
        }
        // only now: a vector load waits for the scalar stores that it covers
        for (uint32_t i = 0; i < count; i += PT_LANES)
            take(&push, taken + i, y, pt_lanes_left(i, count));
    }
}

int PT_KERNEL_ENTRY(push)(const struct pt_cpu_call *call)
{
    const struct push_args *args = call->arguments;
    const uint32_t *rect = args->view.rect;
    if (rect[0] >= rect[2] || rect[1] >= rect[3])
        return PATINA_OK;
    if (!pt_cpu_scratch(call, 0, pt_pool_threads(call->pool) * row_room(rect) * sizeof(uint32_t)))
        return PATINA_ERROR_MEMORY;
    pt_parallel(call->pool, rect[3] - rect[1], 8, push_rows, (void *)call);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
