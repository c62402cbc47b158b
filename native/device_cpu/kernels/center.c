// SPDX-License-Identifier: GPL-3.0-or-later
// center: measured point -> how far behind it its tangent plane lies in the middle of its pixel; twin of
// shaders/kernels/center.comp
//
// Points are projected anew, as scatter does: those whose key their pixel holds are few, and lie side by side.
#include "device_cpu/cpu.h"
#include "device_cpu/vector_math.h"

struct center {
    const struct pt_cpu_call *call;
    const struct center_args *args;
    const uint64_t *keys;
    const float *normals, *deff, *positions;
    float *offsets;
};

struct seen { // of PT_LANES points
    vf x, y, z;
    vi column, row, pixel;
};

// Those of the points that may be what their pixels hold.
static inline vm look(const struct center *center, const struct chunk_view *chunk, const float *positions, uint32_t i, vm lanes,
                      struct seen *out)
{
    const struct view_args *view = &center->args->view;
    const vf p[3] = { vf_load(positions + i), vf_load(positions + chunk->padded + i),
                      vf_load(positions + 2 * (size_t)chunk->padded + i) };
    out->z = vf_transform(chunk, 2, p[0], p[1], p[2]);
    out->x = vf_transform(chunk, 0, p[0], p[1], p[2]);
    out->y = vf_transform(chunk, 1, p[0], p[1], p[2]);
    if (view->perspective) {
        const vf r = vf_rcp(out->z);
        out->x = out->x * r;
        out->y = out->y * r;
    }
    const float left = (float)view->origin_x, right = (float)(view->origin_x + (int32_t)view->width);
    const float bottom = (float)view->origin_y, top = (float)(view->origin_y + (int32_t)view->height);
    vm inside = vm_and(vm_and(vf_le(vf_set(view->z_near), out->z), vf_le(out->z, vf_set(view->z_far))),
                       vm_and(vm_and(vf_le(vf_set(left), out->x), vf_lt(out->x, vf_set(right))),
                              vm_and(vf_le(vf_set(bottom), out->y), vf_lt(out->y, vf_set(top)))));
    inside = vm_and(inside, lanes);
    if (!vm_bits(inside))
        return inside;
    out->column = vi_sub(vf_int(vf_floor(out->x)), vi_set((uint32_t)view->origin_x));
    out->row = vi_sub(vf_int(vf_floor(out->y)), vi_set((uint32_t)view->origin_y));
    out->pixel = vi_select(inside, vi_add(vi_mul(out->row, vi_set(view->width)), out->column), vi_set(0));
    const vi z = vi_and(vf_bits(out->z), vi_set(0x7FFFFFFFu));
    return vm_and(inside, vi_eq(vi_gather_z(center->keys, out->pixel, inside), z));
}

static inline void save(const struct center *center, const struct seen *seen, uint32_t first_id, vm some)
{
    const struct view_args *view = &center->args->view;
    const vf zero = vf_zero(), half = vf_set(0.5f);
    vf n[4], ray[2];
    vf_gather4(center->normals, seen->pixel, some, n);
    vf_ray_of(view, seen->column, seen->row, ray);
    // 1. to the middle of the pixel, in the view's units (perspective: at z = 1), and how n leans that way
    const vf dx = (vi_convert(vi_add(vi_set((uint32_t)view->origin_x), seen->column)) + half) - seen->x;
    const vf dy = (vi_convert(vi_add(vi_set((uint32_t)view->origin_y), seen->row)) + half) - seen->y;
    vf rise = n[0] * (vf_set(view->ray_xs) * dx) + n[1] * (vf_set(view->ray_ys) * dy), facing = zero - n[2];
    if (view->perspective) {
        rise = rise * seen->z;
        facing = (n[0] * ray[0] + n[1] * ray[1]) - n[2];
    }
    // 2. the plane's step, no farther than the surface is known to go on
    const vf size = vf_abs(facing);
    const vm good = vf_lt(vf_set(1e-6f), size);
    const vf step = rise * vf_rcp(vf_select(good, size, vf_set(1.0f)));
    const vf most = vf_gather(center->deff, seen->pixel, some);
    vf offset = vf_select(vf_lt(facing, zero), step, zero - step);
    offset = vf_min(vf_max(offset, zero - vf_min(most, half * seen->z)), most);
    offset = vf_select(good, offset, zero);
    float offsets[PT_LANES];
    uint32_t pixels[PT_LANES];
    vf_store(offsets, offset);
    vi_store(pixels, seen->pixel);
    for (uint32_t bits = vm_bits(some); bits; bits &= bits - 1) {
        const uint32_t k = (uint32_t)__builtin_ctz(bits);
        if ((uint32_t)center->keys[pixels[k]] == first_id + k)
            center->offsets[pixels[k]] = offsets[k];
    }
}

static void center_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct center *center = context;
    const struct chunk_view *chunks = pt_cpu_data(center->call, 4);
    (void)thread;
    for (uint32_t c = begin; c < end && !pt_cpu_cancelled(center->call); c++) {
        const struct chunk_view *chunk = &chunks[c];
        const float *positions = center->positions + 3 * (size_t)chunk->first;
        for (uint32_t i = 0; i < chunk->count; i += PT_LANES) {
            struct seen seen;
            const uint32_t left = chunk->count - i;
            const vm some = look(center, chunk, positions, i, vm_first(left < PT_LANES ? left : PT_LANES), &seen);
            if (vm_bits(some))
                save(center, &seen, chunk->id_base + chunk->first + i, some);
        }
    }
}

int PT_KERNEL_ENTRY(center)(const struct pt_cpu_call *call)
{
    const struct center center = { .call = call,
                                   .args = call->arguments,
                                   .keys = pt_cpu_data(call, 0),
                                   .normals = pt_cpu_data(call, 1),
                                   .deff = pt_cpu_data(call, 2),
                                   .offsets = pt_cpu_data(call, 3),
                                   .positions = pt_cpu_data(call, 5) };
    pt_parallel(call->pool, (uint32_t)(call->buffers[4]->size / sizeof(struct chunk_view)), 4, center_chunks, (void *)&center);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
