// SPDX-License-Identifier: GPL-3.0-or-later
// coarsen: an image buffer without points, and what lies behind the layers taken so far, cell by cell; twin of
// shaders/kernels/coarsen.comp
#include "device_cpu/rows.h"
#include "shared/ranges.h"

static inline int32_t floor_of(float a) { return (int32_t)a - (a < (float)(int32_t)a); }

// Which of `count` pixels from `origin` on a cell has a part of.
static void part_of(int32_t cell, float pixel, int32_t origin, uint32_t count, int32_t out[2])
{
    out[0] = floor_of((float)cell * pixel) - origin;
    out[1] = -floor_of(0.0f - (float)(cell + 1) * pixel) - origin;
    out[0] = out[0] < 0 ? 0 : out[0];
    out[1] = out[1] > (int32_t)count ? (int32_t)count : out[1];
}

static float least_of(const struct coarsen_args *args, const float *limits, const int32_t columns[2], const int32_t rows[2])
{
    float least = pt_float(PT_KEY_EMPTY_Z);
    for (int32_t y = rows[0]; y < rows[1]; y++)
        for (int32_t x = columns[0]; x < columns[1]; x++)
            least = pt_min(limits[(size_t)y * args->width + (size_t)x], least);
    return least;
}

static void coarsen_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct coarsen_args *args = call->arguments;
    const struct view_args *view = &args->view;
    const size_t row = (size_t)y * view->width;
    uint64_t *keys = (uint64_t *)PT_DATA(call, coarsen, keys) + row;
    int32_t columns[2], rows[2];
    for (uint32_t x = view->rect[0]; x < view->rect[2]; x++)
        keys[x] = (uint64_t)PT_KEY_EMPTY_Z << 32 | PT_KEY_EMPTY_ID;
    part_of(view->origin_y + (int32_t)y, args->pixel, args->origin_y, args->height, rows);
    for (uint32_t x = view->rect[0]; x < view->rect[2] && args->behind; x++) {
        float *beyond = (float *)PT_DATA(call, coarsen, beyond) + row;
        part_of(view->origin_x + (int32_t)x, args->pixel, args->origin_x, args->width, columns);
        beyond[x] = least_of(args, PT_DATA(call, coarsen, limit), columns, rows);
    }
}

int PT_KERNEL_ENTRY(coarsen)(const struct pt_cpu_call *call)
{
    const struct coarsen_args *args = call->arguments;
    return pt_rows(call, &args->view, coarsen_row);
}
