// SPDX-License-Identifier: GPL-3.0-or-later
// surface: key -> view-space normal, 1 / max(|n.v|, C), d_eff (SPEC 1); twin of shaders/kernels/surface.comp
#include "device_cpu/cpu.h"
#include "device_cpu/rows.h"
#include "device_cpu/vector_math.h"

// word: the surface words of those of PT_LANES pixels from (x, y) on that are the instance's.
static void surface_pixels(const struct surface_args *args, const struct pt_cpu_call *call, uint32_t x, uint32_t y, vm ours,
                           vi word)
{
    const struct view_args *view = &args->view;
    const struct instance_args *instance = &args->instance;
    const uint64_t *keys = pt_cpu_data(call, 0);
    float *normals = pt_cpu_data(call, 2), *deff = pt_cpu_data(call, 3);
    uint32_t *from = pt_cpu_data(call, 4);
    size_t at = (size_t)y * view->width + x;

    // 1. the point
    vf z = vi_float(vi_load_z(keys + at)), ray[2], n[4];
    vf_ray(view, x, y, ray);
    vf spacing = vf_look_up(instance->spacing, PT_SPACINGS, vi_shr(word, PT_SPACING_SHIFT));
    // 2. its normal, in view space: the cloud's, or the estimate that the normal plane holds
    vm none = vm_not(ours);
    if (instance->has_normals) {
        vf_view_normal(instance, word, n);
        none = vm_or(none, vi_eq(vi_and(word, vi_set(PT_NORMAL_BITS)), vi_set(PT_NORMAL_NONE)));
    } else {
        vf_load4(normals + 4 * at, n);
    }
    vf square = (n[0] * n[0] + n[1] * n[1]) + n[2] * n[2];
    none = vm_or(none, vm_not(vf_le(vf_set(1e-30f), square)));
    vf scale = vf_rsqrt(square);
    // 3. without one: towards the viewer
    vf towards[3] = { vf_zero(), vf_zero(), vf_set(1.0f) };
    if (view->perspective) {
        vf r = vf_rsqrt((ray[0] * ray[0] + ray[1] * ray[1]) + vf_set(1.0f));
        towards[0] = (vf_zero() - ray[0]) * r;
        towards[1] = (vf_zero() - ray[1]) * r;
        towards[2] = r;
    }
    for (int k = 0; k < 3; k++)
        n[k] = vf_select(none, towards[k], n[k] * scale);
    // 4. cosine and layer distance
    vf inverse = vf_rcp(vf_max(vf_cosine(view, n, ray), vf_set(PT_COSINE_FLOOR)));
    inverse = vf_select(none, vf_set(1.0f), inverse);
    n[3] = inverse;
    vf_store4(normals + 4 * at, n, vm_bits(ours));
    vf_store(deff + at, vf_layer_distance(view, instance->d_min, spacing, z, inverse), ours);
    vi_store(from + at, vi_add(vi_set((uint32_t)at), vi_lanes()), ours);
}

// Words are fetched at random: a tight loop gathers those of a block, so that many are under way at a time.
enum { BLOCK = 16 };

static void surface_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct surface_args *args = call->arguments;
    const uint32_t *rect = args->view.rect;
    const uint64_t *keys = (const uint64_t *)pt_cpu_data(call, 0) + (size_t)y * args->view.width;
    vi words[BLOCK];
    vm ours[BLOCK];
    for (uint32_t first = rect[0]; first < rect[2]; first += BLOCK * PT_LANES) {
        uint32_t count = (rect[2] - first + PT_LANES - 1) / PT_LANES;
        count = count < BLOCK ? count : BLOCK;
        for (uint32_t i = 0; i < count; i++) {
            uint32_t x = first + i * PT_LANES;
            vi id;
            ours[i] = pt_of_instance(keys + x, &args->instance, pt_lanes_left(x, rect[2]), &id);
            words[i] = vi_gather(pt_cpu_data(call, 1), id, ours[i]);
        }
        for (uint32_t i = 0; i < count; i++)
            if (vm_bits(ours[i]))
                surface_pixels(args, call, first + i * PT_LANES, y, ours[i], words[i]);
    }
}

int PT_KERNEL_ENTRY(surface)(const struct pt_cpu_call *call)
{
    const struct surface_args *args = call->arguments;
    return pt_rows(call, &args->view, surface_row);
}
