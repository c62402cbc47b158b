// SPDX-License-Identifier: GPL-3.0-or-later
// shade: id -> colour and normal, Phong. [D 3.1], deferred: only what the picture shows is lit; twin of
// shaders/kernels/shade.comp
#include "shade.h"
#include "shared/colors.h"

enum { BAND_ROWS = 32, CHANNELS = 5 };

struct shade {
    const struct pt_cpu_call *call;
    const struct shade_args *args;
    struct pt_planes planes;
    float *rows;   // per thread: a ring of `ring` rows of CHANNELS channels
    size_t stride; // floats of one channel of a row
    uint32_t ring; // 2 blend + 1
    float weights[2 * PT_BLEND_MOST * PT_BLEND_MOST + 1];
};

static struct pt_seen_row ring_row(const struct shade *shade, uint32_t thread, uint32_t slot)
{
    float *row = shade->rows + ((size_t)thread * shade->ring + slot) * CHANNELS * shade->stride + PT_ROW_PAD;
    const size_t s = shade->stride;
    return (struct pt_seen_row){row, row + s, {row + 2 * s, row + 3 * s, row + 4 * s}, NULL, 0, 0};
}

static void shade_row(const struct shade *shade, const struct pt_seen_row *const *around, uint32_t y)
{
    const struct shade_args *args = shade->args;
    const uint32_t *rect = args->view.rect;
    float *shading = PT_DATA(shade->call, shade, shading), *colors = PT_DATA(shade->call, shade, color),
          *arrived = PT_DATA(shade->call, shade, arrived);
    const uint64_t *keys = shade->planes.keys + (size_t)y * args->view.width;
    const struct pt_lights lights = pt_lights_of(args, PT_DATA(shade->call, shade, lights),
                                                 PT_DATA(shade->call, shade, shadows), PT_DATA(shade->call, shade, marks));
    for (uint32_t x = rect[0]; x < rect[2]; x += PT_LANES) {
        if (args->instance.color_format)
            pt_fetch_ahead(keys, x + 4 * PT_LANES, rect[2], &args->instance, PT_DATA(shade->call, shade, colors),
                           pt_color_bytes[args->instance.color_format]);
        if (args->instance.has_opacities)
            pt_fetch_ahead(keys, x + 4 * PT_LANES, rect[2], &args->instance, PT_DATA(shade->call, shade, opacities), 1);
        size_t at = (size_t)y * args->view.width + x;
        vf color[4], normal[4] = {vf_zero(), vf_zero(), vf_zero(), vf_zero()};
        vi id;
        vm ours = pt_of_instance(shade->planes.keys + at, &args->instance, pt_lanes_left(x, rect[2]), &id);
        if (!vm_bits(ours))
            continue;
        const vi source = pt_color_pixels(&args->instance, pt_source(&shade->planes, at), at);
        pt_albedo(&args->instance, PT_DATA(shade->call, shade, colors), id, source, ours, color);
        if (pt_recolors(args))
            pt_recolor(args, PT_DATA(shade->call, shade, ramps), x, y, vf_load(around[args->blend]->z + x), ours, color);
        vf share = pt_shade_pixels(args, &shade->planes, around, shade->weights, NULL, &lights, x, y, id, ours, 0, color,
                                   normal);
        normal[3] = color[3] = pt_opacity(&args->instance, PT_DATA(shade->call, shade, colors),
                                          PT_DATA(shade->call, shade, opacities), id, source, ours);
        for (int k = 0; k < 3; k++)
            color[k] = color[k] * color[3];
        vf_store4(shading + 4 * at, normal, vm_bits(ours));
        vf_store4(colors + 4 * at, color, vm_bits(ours));
        if (args->arrived)
            vf_store_where(arrived + at, share, ours);
    }
}

static void shade_bands(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct shade *shade = context;
    const uint32_t *rect = shade->args->view.rect;
    const int32_t reach = (int32_t)shade->args->blend;
    const float share = reach ? PT_BLEND_FILLED : 1.0f;
    struct pt_seen_row rows[2 * PT_BLEND_MOST + 1];
    for (uint32_t k = 0; k < shade->ring; k++)
        rows[k] = ring_row(shade, thread, k);
    for (uint32_t band = begin; band < end && !pt_cpu_cancelled(shade->call); band++) {
        int32_t first = (int32_t)(rect[1] + band * BAND_ROWS);
        int32_t last = first + BAND_ROWS < (int32_t)rect[3] ? first + BAND_ROWS : (int32_t)rect[3];
        for (int32_t y = first - 2 * reach; y < last; y++) { // the last row seen is y + reach
            const struct pt_seen_row *around[2 * PT_BLEND_MOST + 1];
            const uint32_t base = (uint32_t)(y + 4 * PT_BLEND_MOST);
            pt_see_row(&shade->planes, y + reach, share, 1, &rows[(base + (uint32_t)reach) % shade->ring]);
            if (y < first)
                continue;
            for (int32_t k = -reach; k <= reach; k++)
                around[reach + k] = &rows[(base + (uint32_t)k) % shade->ring];
            shade_row(shade, around, (uint32_t)y);
        }
    }
}

int PT_KERNEL_ENTRY(shade)(const struct pt_cpu_call *call)
{
    const struct shade_args *args = call->arguments;
    const uint32_t *rect = args->view.rect;
    struct shade shade = {.call = call,
                          .args = args,
                          .planes = {&args->view,
                                     {0, 0, args->view.width, args->view.height},
                                     PT_DATA(call, shade, keys),
                                     PT_DATA(call, shade, from),
                                     PT_DATA(call, shade, normal),
                                     PT_DATA(call, shade, deff)},
                          .stride = pt_row_stride(args->view.width),
                          .ring = 2 * args->blend + 1};
    if (rect[0] >= rect[2] || rect[1] >= rect[3])
        return PATINA_OK;
    pt_blend_weights(shade.weights);
    shade.rows = pt_cpu_scratch(call, 0, pt_pool_threads(call->pool) * shade.ring * CHANNELS * shade.stride * sizeof(float));
    if (!shade.rows)
        return PATINA_ERROR_MEMORY;
    pt_parallel(call->pool, (rect[3] - rect[1] + BAND_ROWS - 1) / BAND_ROWS, 1, shade_bands, &shade);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
