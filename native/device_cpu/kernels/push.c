// SPDX-License-Identifier: GPL-3.0-or-later
// push: empty or occluded pixels take the key of their coarse parent, where two of the three coarse cells on their side
// are covered too (else every edge would grow by a coarse pixel). SPEC 2.2; twin of shaders/kernels/push.comp
#include "device_cpu/rows.h"

struct push {
    const struct push_args *args;
    struct view_args coarse;
    const uint64_t *coarse_keys;
    const uint32_t *coarse_from;
    const float *normals, *deff;
};

static float coarse_z(const struct push *push, int32_t x, int32_t y)
{
    if (x < 0 || y < 0 || x >= (int32_t)push->args->coarse_width || y >= (int32_t)push->args->coarse_height)
        return pt_float(PT_KEY_EMPTY_Z);
    return pt_float((uint32_t)(push->coarse_keys[(size_t)y * push->args->coarse_width + (size_t)x] >> 32));
}

static void push_pixel(const struct push *push, uint32_t x, uint32_t y, uint64_t *key, uint32_t *from)
{
    const struct view_args *view = &push->args->view;
    // 1. threshold: what is nearer than it covers this pixel
    float t = pt_float((uint32_t)(*key >> 32));
    if (t < pt_float(PT_KEY_EMPTY_Z))
        t = t - pt_level_distance(view, push->deff[*from], push->normals[4 * (size_t)*from + 3], t);
    // 2. the parent and the three coarse cells on this pixel's side
    int32_t px = (int32_t)(x >> 1), py = (int32_t)(y >> 1), sx = x & 1 ? 1 : -1, sy = y & 1 ? 1 : -1;
    float z = coarse_z(push, px, py);
    if (!(z < t))
        return;
    int covered = (coarse_z(push, px + sx, py) < t) + (coarse_z(push, px, py + sy) < t) +
                  (coarse_z(push, px + sx, py + sy) < t);
    if (covered < 2)
        return;
    // 3. its key; refined: its surface's tangent plane here
    size_t parent = (size_t)py * push->args->coarse_width + (size_t)px;
    uint32_t source = push->coarse_from[parent];
    if (push->args->refined) {
        float ray_p[2], ray_q[2];
        pt_ray(view, (int32_t)x, (int32_t)y, ray_p);
        pt_ray(&push->coarse, px, py, ray_q);
        float limit = pt_level_distance(&push->coarse, push->deff[source], push->normals[4 * (size_t)source + 3], z);
        z = pt_plane_depth(view, push->normals + 4 * (size_t)source, ray_q, z, ray_p, limit);
    }
    *key = (uint64_t)pt_bits(z) << 32 | (uint32_t)push->coarse_keys[parent];
    *from = source;
}

static void push_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct push_args *args = call->arguments;
    struct push push = { .args = args,
                         .coarse = args->view,
                         .coarse_keys = pt_cpu_data(call, 0),
                         .coarse_from = pt_cpu_data(call, 1),
                         .normals = pt_cpu_data(call, 4),
                         .deff = pt_cpu_data(call, 5) };
    push.coarse.level++;
    uint64_t *keys = pt_cpu_data(call, 2);
    uint32_t *from = pt_cpu_data(call, 3);
    for (uint32_t x = args->view.rect[0]; x < args->view.rect[2]; x++) {
        size_t at = (size_t)y * args->view.width + x;
        push_pixel(&push, x, y, &keys[at], &from[at]);
    }
}

int PT_KERNEL_ENTRY(push)(const struct pt_cpu_call *call)
{
    const struct push_args *args = call->arguments;
    return pt_rows(call, &args->view, push_row);
}
