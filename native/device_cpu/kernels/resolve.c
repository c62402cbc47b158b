// SPDX-License-Identifier: GPL-3.0-or-later
// resolve: key -> view-space normal, 1 / max(|n.v|, C), d_eff (SPEC 1); twin of shaders/kernels/resolve.comp
#include "device_cpu/cpu.h"
#include "device_cpu/rows.h"
#include "device_cpu/vector_math.h"
#include "shared/measured.h"

// The instance's pixels of a block of a row, packed: with a point a pixel half the lanes of a vector show another surface or
// none.
enum { BLOCK = 256 };

struct measured {
    uint32_t x[BLOCK + PT_LANES], z[BLOCK + PT_LANES], word[BLOCK + PT_LANES]; // before it, the point
    uint32_t shape[BLOCK + PT_LANES];
};

// count <= PT_LANES pixels from the i-th on.
static void resolve_pixels(const struct resolve_args *args, const struct pt_cpu_call *call, uint32_t y,
                           const struct measured *measured, uint32_t i, uint32_t count)
{
    const struct view_args *view = &args->view;
    const struct instance_args *instance = &args->instance;
    const uint32_t *x = measured->x + i;
    const size_t row = (size_t)y * view->width;
    float *normals = (float *)PT_DATA(call, resolve, normal) + 4 * row, *deff = (float *)PT_DATA(call, resolve, deff) + row;
    float *span = args->with_span ? (float *)PT_DATA(call, resolve, span) + row : NULL;
    const vm some = vm_first(count);
    const vf one = vf_set(1.0f);

    // 1. the point
    vf z = vi_float(vi_load(measured->z + i)), ray[2], n[4];
    vi word = vi_load(measured->word + i);
    vf_ray_of(view, vi_load(x), vi_set(y), ray);
    vf spacing = vf_look_up(instance->spacing, PT_SPACINGS, vi_shr(word, PT_SPACING_SHIFT));
    // 2. its normal, in view space: the cloud's, or the estimate that the normal plane holds
    if (instance->has_normals)
        vf_view_normal(instance, word, n);
    else
        vf_gather4(normals, vi_load(x), some, n);
    vf square = (n[0] * n[0] + n[1] * n[1]) + n[2] * n[2];
    vm none = vm_not(vf_le(vf_set(1e-30f), square));
    if (instance->has_normals)
        none = vm_or(none, vi_eq(vi_and(word, vi_set(PT_NORMAL_BITS)), vi_set(PT_NORMAL_NONE)));
    none = vm_and(none, some);
    vf scale = vf_rsqrt(square);
    for (int k = 0; k < 3; k++)
        n[k] = n[k] * scale;
    // 3. without one: towards the viewer
    if (vm_bits(none)) {
        vf towards[3] = {vf_zero(), vf_zero(), one};
        if (view->perspective) {
            vf r = vf_rsqrt((ray[0] * ray[0] + ray[1] * ray[1]) + one);
            towards[0] = (vf_zero() - ray[0]) * r;
            towards[1] = (vf_zero() - ray[1]) * r;
            towards[2] = r;
        }
        for (int k = 0; k < 3; k++)
            n[k] = vf_select(none, towards[k], n[k]);
    }
    // 4. cosine and layer distance
    n[3] = vf_select(none, one, vf_rcp(vf_max(vf_cosine(view, n, ray), vf_set(PT_COSINE_FLOOR))));
    float pixels[4 * PT_LANES], distances[PT_LANES], spans[PT_LANES];
    const vf by_spacing = vf_layer_distance(view, instance->d_min, spacing, z, n[3]);
    vf distance = by_spacing;
    if (args->sigma_scale > 0.0f) {
        const vi class = vi_and(vi_shr(vi_load(measured->shape + i), PT_SHAPE_SIGMA_SHIFT), vi_set(PT_SHAPE_CLASS_BITS));
        const vf sigma = vf_look_up(instance->spacing, PT_SPACINGS, class) * vf_set(args->sigma_scale);
        const vf sure = vf_sure_distance(view, instance->d_min, sigma, spacing, z, n[3]);
        distance = vf_select(vi_eq(class, vi_set(0)), by_spacing, sure);
    }
    vf_store4(pixels, n, PT_ALL);
    vf_store(distances, distance);
    vf_store(spans, by_spacing);
    for (uint32_t k = 0; k < count; k++) {
        memcpy(normals + 4 * (size_t)x[k], pixels + 4 * k, 16);
        deff[x[k]] = distances[k];
        if (args->with_span)
            span[x[k]] = spans[k];
    }
}

static void resolve_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct resolve_args *args = call->arguments;
    const uint32_t *rect = args->view.rect;
    const size_t row = (size_t)y * args->view.width;
    const uint64_t *keys = (const uint64_t *)PT_DATA(call, resolve, keys) + row;
    uint32_t *from = (uint32_t *)PT_DATA(call, resolve, from) + row;
    const uint32_t *words = PT_DATA(call, resolve, surfels),
                   *shapes = args->sigma_scale > 0.0f ? PT_DATA(call, resolve, shapes) : NULL;
    struct measured measured;
    for (uint32_t first = rect[0]; first < rect[2]; first += BLOCK) {
        const uint32_t end = rect[2] - first < BLOCK ? rect[2] : first + BLOCK;
        uint32_t count = 0;
        for (uint32_t x = first; x < end; x += PT_LANES) {
            vi id, at = vi_add(vi_set(x), vi_lanes());
            vm ours = pt_of_instance(keys + x, &args->instance, pt_lanes_left(x, end), &id);
            uint32_t lanes = vm_bits(ours);
            if (!lanes) // nor touch memory that was never written
                continue;
            vi_pack(measured.x + count, at, lanes);
            vi_pack(measured.z + count, vi_load_z(keys + x), lanes);
            vi_pack(measured.word + count, id, lanes);
            count += (uint32_t)__builtin_popcount(lanes);
            pt_row_put(from, args->view.width, x, vi_add(vi_set((uint32_t)row), at), ours);
        }
        // words are fetched at random: a tight loop gathers those of a block, so that many are under way at a time
        if (args->sigma_scale > 0.0f)
            for (uint32_t i = 0; i < count; i++)
                measured.shape[i] = shapes[measured.word[i]];
        for (uint32_t i = 0; i < count; i++)
            measured.word[i] = words[measured.word[i]];
        for (uint32_t i = 0; i < count; i += PT_LANES)
            resolve_pixels(args, call, y, &measured, i, pt_lanes_left(i, count));
    }
}

int PT_KERNEL_ENTRY(resolve)(const struct pt_cpu_call *call)
{
    const struct resolve_args *args = call->arguments;
    return pt_rows(call, &args->view, resolve_row);
}
