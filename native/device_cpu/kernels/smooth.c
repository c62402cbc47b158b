// SPDX-License-Identifier: GPL-3.0-or-later
// smooth: 3 x 3 low-pass over the neighbours of the same layer. [D 3.4, Table 1]; twin of shaders/kernels/smooth.comp
#include "smooth.h"
#include "shared/colors.h"

enum { BAND_ROWS = 32, CHANNELS = 5 };

struct smooth {
    const struct pt_cpu_call *call;
    const struct smooth_args *args;
    struct pt_planes planes;
    float *rows;   // per thread: a ring of 3 rows of CHANNELS channels
    size_t stride; // floats of one channel of a row
};

static void load_row(const struct smooth *smooth, int32_t y, const struct pt_color_row *row)
{
    const uint32_t width = smooth->args->view.width;
    const float *colors = (const float *)PT_DATA(smooth->call, smooth, color) + 4 * (ptrdiff_t)y * width;
    pt_empty_row(row->z, width);
    if (y < 0 || y >= (int32_t)smooth->args->view.height)
        return;
    for (uint32_t x = 0; x < width; x += PT_LANES) {
        vf z = vi_float(vi_load_z(smooth->planes.keys + (size_t)y * width + x)), color[4];
        vm lanes = vm_first(pt_lanes_left(x, width));
        vf_store_where(row->z + x, z, lanes);
        if (!vm_bits(vm_and(lanes, vf_lt(z, vf_set(pt_float(PT_KEY_EMPTY_Z))))))
            continue;
        vf_load4(colors + 4 * (size_t)x, color);
        for (uint32_t k = 0; k < 3 + smooth->args->translucent; k++)
            vf_store(row->color[k] + x, color[k]);
    }
}

static void smooth_row(const struct smooth *smooth, const struct pt_color_row *const rows[3], uint32_t y)
{
    const uint32_t *rect = smooth->args->view.rect;
    float *out = PT_DATA(smooth->call, smooth, result);
    for (uint32_t x = rect[0]; x < rect[2]; x += PT_LANES) {
        size_t at = (size_t)y * smooth->args->view.width + x;
        vm some = vm_and(vm_first(pt_lanes_left(x, rect[2])), vf_lt(vf_load(rows[1]->z + x), vf_set(pt_float(PT_KEY_EMPTY_Z))));
        if (!vm_bits(some))
            continue; // nothing reads the colour of an empty pixel
        vf color[4], limit = vf_gather(smooth->planes.deff, pt_source(&smooth->planes, at), some);
        pt_smooth_pixels(smooth->args, rows, smooth->args->translucent ? 4 : 3, x, limit, some, color);
        vf_store4(out + 4 * at, color, vm_bits(some));
    }
}

static void smooth_bands(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct smooth *smooth = context;
    const uint32_t *rect = smooth->args->view.rect;
    struct pt_color_row ring[3];
    for (uint32_t k = 0; k < 3; k++) {
        float *row = smooth->rows + ((size_t)thread * 3 + k) * CHANNELS * smooth->stride + PT_ROW_PAD;
        const size_t s = smooth->stride;
        ring[k] = (struct pt_color_row){row, {row + s, row + 2 * s, row + 3 * s, row + 4 * s}};
    }
    for (uint32_t band = begin; band < end && !pt_cpu_cancelled(smooth->call); band++) {
        uint32_t first = rect[1] + band * BAND_ROWS, last = first + BAND_ROWS < rect[3] ? first + BAND_ROWS : rect[3];
        load_row(smooth, (int32_t)first - 1, &ring[(first + 2) % 3]);
        load_row(smooth, (int32_t)first, &ring[first % 3]);
        for (uint32_t y = first; y < last; y++) {
            const struct pt_color_row *const rows[3] = {&ring[(y + 2) % 3], &ring[y % 3], &ring[(y + 1) % 3]};
            load_row(smooth, (int32_t)y + 1, rows[2]);
            smooth_row(smooth, rows, y);
        }
    }
}

int PT_KERNEL_ENTRY(smooth)(const struct pt_cpu_call *call)
{
    const struct smooth_args *args = call->arguments;
    const uint32_t *rect = args->view.rect;
    struct smooth smooth = {.call = call,
                            .args = args,
                            .planes = {.view = &args->view,
                                       .keys = PT_DATA(call, smooth, keys),
                                       .from = PT_DATA(call, smooth, from),
                                       .deff = PT_DATA(call, smooth, deff)},
                            .stride = pt_row_stride(args->view.width)};
    if (rect[0] >= rect[2] || rect[1] >= rect[3])
        return PATINA_OK;
    smooth.rows = pt_cpu_scratch(call, 0, pt_pool_threads(call->pool) * 3 * CHANNELS * smooth.stride * sizeof(float));
    if (!smooth.rows)
        return PATINA_ERROR_MEMORY;
    pt_parallel(call->pool, (rect[3] - rect[1] + BAND_ROWS - 1) / BAND_ROWS, 1, smooth_bands, &smooth);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
