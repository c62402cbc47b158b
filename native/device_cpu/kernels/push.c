// SPDX-License-Identifier: GPL-3.0-or-later
// push: empty or occluded pixels take the key of their coarse parent, where two of the three coarse cells on their side
// are covered too (else every edge would grow by a coarse pixel). SPEC 2.2; twin of shaders/kernels/push.comp
//
// Vectors look for the pixels whose parent is nearer; those that take its key go on one by one.
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

// 1 in the lanes where z < t.
static vi nearer(vf z, vf t) { return vi_select(vf_lt(z, t), vi_set(1), vi_set(0)); }

// 1. Threshold: what is nearer than it covers the pixel.
static vf threshold(const struct push *push, vf z, vi source, vm some)
{
    const struct view_args *view = &push->args->view;
    vf d = vf_gather(pt_cpu_data(push->call, 5), source, some);
    if (view->level) {
        vi word = vi_add(vi_mul(source, vi_set(4)), vi_set(3));
        d = vf_max(d, vf_footprint(view, z) * vf_gather(pt_cpu_data(push->call, 4), word, some));
    }
    return vf_select(some, z - d, z);
}

// 2. Which of PT_LANES pixels are covered by their parent and by two of the three coarse cells on their side.
static uint32_t covered(const struct push *push, uint32_t x, uint32_t y, uint32_t lanes)
{
    size_t at = (size_t)y * push->args->view.width + x;
    vf z = vi_float(vi_load_z((const uint64_t *)pt_cpu_data(push->call, 2) + at));
    vi column = vi_add(vi_set(x), vi_lanes()), px = vi_shr(column, 1), py = vi_set(y >> 1);
    vf parent = coarse_z(push, px, py, vm_first(lanes));
    vm asked = vm_and(vm_first(lanes), vf_lt(parent, z)); // d_eff is never below 0
    if (!vm_bits(asked))
        return 0;
    vm some = vm_and(asked, vf_lt(z, vf_set(pt_float(PT_KEY_EMPTY_Z))));
    vf t = threshold(push, z, vi_load((const uint32_t *)pt_cpu_data(push->call, 3) + at), some);
    // towards the pixel's side: -1 for even, 1 for odd
    vi nx = vi_sub(vi_add(px, vi_mul(vi_and(column, vi_set(1)), vi_set(2))), vi_set(1));
    vi ny = vi_set((y >> 1) + 2 * (y & 1) - 1);
    vi sides = vi_add(vi_add(nearer(coarse_z(push, nx, py, asked), t), nearer(coarse_z(push, px, ny, asked), t)),
                      nearer(coarse_z(push, nx, ny, asked), t));
    return vm_bits(vm_and(vm_and(asked, vf_lt(parent, t)), vi_lt_unsigned(vi_set(1), sides)));
}

// 3. The parent's key; refined: its surface's tangent plane here.
static void take(const struct push *push, uint32_t x, uint32_t y)
{
    const struct view_args *view = &push->args->view;
    const float *normals = pt_cpu_data(push->call, 4), *deff = pt_cpu_data(push->call, 5);
    size_t at = (size_t)y * view->width + x, parent = (size_t)(y >> 1) * push->args->coarse_width + (x >> 1);
    uint64_t key = ((const uint64_t *)pt_cpu_data(push->call, 0))[parent];
    uint32_t source = ((const uint32_t *)pt_cpu_data(push->call, 1))[parent];
    const float *normal = normals + 4 * (size_t)source;
    float z = pt_float((uint32_t)(key >> 32));
    if (push->args->refined) {
        float ray_p[2], ray_q[2];
        pt_ray(view, (int32_t)x, (int32_t)y, ray_p);
        pt_ray(&push->coarse, (int32_t)(x >> 1), (int32_t)(y >> 1), ray_q);
        float limit = pt_level_distance(&push->coarse, deff[source], normal[3], z);
        z = pt_plane_depth(view, normal, ray_q, z, ray_p, limit);
    }
    ((uint64_t *)pt_cpu_data(push->call, 2))[at] = (uint64_t)pt_bits(z) << 32 | (uint32_t)key;
    ((uint32_t *)pt_cpu_data(push->call, 3))[at] = source;
}

static void push_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct push_args *args = call->arguments;
    struct push push = { .call = call, .args = args, .coarse = args->view };
    push.coarse.level++;
    for (uint32_t x = args->view.rect[0]; x < args->view.rect[2]; x += PT_LANES) {
        uint32_t bits = covered(&push, x, y, pt_lanes_left(x, args->view.rect[2]));
        for (; bits; bits &= bits - 1)
            take(&push, x + (uint32_t)__builtin_ctz(bits), y);
    }
}

int PT_KERNEL_ENTRY(push)(const struct pt_cpu_call *call)
{
    const struct push_args *args = call->arguments;
    return pt_rows(call, &args->view, push_row);
}
