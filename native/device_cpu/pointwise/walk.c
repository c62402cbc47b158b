// SPDX-License-Identifier: GPL-3.0-or-later
// A walk over rows for every pointwise kernel: reads what its body asks for, runs that, writes colours. All else is in
// shaders/pointwise/NAME.h.
#include "walk.h"
#include "bodies.h"

// Arguments of kernels that walk over the crop begin with these.
struct crop_args {
    struct view_args view;
    uint32_t crop_x, crop_y, crop_width, crop_height;
};

static inline int of_crop(struct pt_pointwise kind) { return kind.result >= 0 || kind.keys < 0; }

typedef void body_of(const void *args, const struct pt_here *here, vf color[4]);

static inline __attribute__((always_inline)) void load3(const float *pixels, const float *const rows[3], uint32_t x, vf out[3])
{
    vf four[4];
    if (pixels) {
        vf_load4(pixels + 4 * (size_t)x, four);
        memcpy(out, four, 3 * sizeof *out);
    } else {
        for (int k = 0; k < 3; k++)
            out[k] = vf_load(rows[k] + x);
    }
}

static inline __attribute__((always_inline)) void walk(const struct pt_walk_row *row, const void *args,
                                                       const struct pt_pointwise kind, int planar, body_of *body)
{
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z)), one = vf_set(1.0f);
    struct pt_here here = {.y = vi_set(row->y), .clips = row->clips};
    for (uint32_t x = row->first; x < row->end; x += PT_LANES) {
        const vm lanes = vm_first(pt_lanes_left(x, row->end));
        vf color[4];
        here.some = lanes;
        if (kind.keys >= 0) {
            vf z = planar ? vf_load(row->z + x) : vi_float(vi_load_z(row->keys + x));
            here.some = vm_and(lanes, vf_lt(z, empty));
            if (kind.result < 0 && !vm_bits(here.some))
                continue;
            here.z = vf_select(here.some, z, one);
        }
        if (kind.clips >= 0)
            here.id = vi_load_id(row->keys + x);
        here.x = vi_add(vi_set(x), vi_lanes());
        if (kind.shading >= 0)
            load3(row->shading, row->normal_rows, x, here.normal);
        if (kind.albedo >= 0)
            load3(row->albedo, row->albedo_rows, x, here.albedo);
        if (kind.slopes >= 0 && row->slopes)
            vf_load4(row->slopes + 4 * (size_t)x, here.slope);
        if (planar) {
            load3(NULL, (const float *const *)row->color_rows, x, color);
            color[3] = row->color_rows[3] ? vf_load(row->color_rows[3] + x) : one;
        } else {
            vf_load4((kind.result < 0 ? row->color : row->from) + 4 * (size_t)x, color);
        }
        body(args, &here, color);
        for (int k = 0; k < 3 && planar; k++) // what is empty may become anything
            vf_store(row->color_rows[k] + x, color[k]);
        if (!planar && kind.result < 0)
            vf_store4(row->color + 4 * (size_t)x, color, vm_bits(here.some));
        else if (!planar)
            vf_put4(row->color + 4 * (size_t)x, color, pt_lanes_left(x, row->end));
    }
}

// In the plane, or in the crop; y: of the rectangle of either.
static inline __attribute__((always_inline)) struct pt_walk_row row_of(const struct pt_cpu_call *call,
                                                                       const struct pt_pointwise kind, uint32_t y)
{
    const struct view_args *view = call->arguments;
    const struct crop_args *crop = call->arguments;
    struct pt_walk_row row = {.args = call->arguments, .y = y, .first = view->rect[0], .end = view->rect[2]};
    size_t at = (size_t)y * view->width;
    if (of_crop(kind)) {
        at = kind.keys < 0 ? (size_t)y * crop->crop_width : at + (size_t)crop->crop_y * view->width + crop->crop_x;
        row.first = 0;
        row.end = crop->crop_width;
    }
    row.keys = kind.keys >= 0 ? (const uint64_t *)pt_cpu_data(call, (uint32_t)kind.keys) + at : NULL;
    row.shading = kind.shading >= 0 ? (const float *)pt_cpu_data(call, (uint32_t)kind.shading) + 4 * at : NULL;
    row.albedo = kind.albedo >= 0 ? (const float *)pt_cpu_data(call, (uint32_t)kind.albedo) + 4 * at : NULL;
    row.slopes = pt_walk_slopes(call, kind.slopes, at);
    row.clips = kind.clips >= 0 ? pt_cpu_data(call, (uint32_t)kind.clips) : NULL;
    row.color = (float *)pt_cpu_data(call, (uint32_t)kind.color) + 4 * at;
    row.from = row.color;
    if (kind.result >= 0)
        row.color = (float *)pt_cpu_data(call, (uint32_t)kind.result) + 4 * (size_t)y * crop->crop_width;
    return row;
}

static inline int run(const struct pt_cpu_call *call, const struct pt_pointwise kind, pt_row_work *work)
{
    const struct crop_args *crop = call->arguments;
    return of_crop(kind) ? pt_crop_rows(call, &crop->view, crop->crop_width, crop->crop_height, work)
                         : pt_rows(call, &crop->view, work);
}

// Arguments are copied: what a row is written to might be them, for all that the compiler knows.
#define PT_POINTWISE(name, ...)                                                                                                \
    static inline __attribute__((always_inline)) void name##_body(const void *args, const struct pt_here *here, vf color[4])   \
    {                                                                                                                          \
        pt_##name(args, here, color);                                                                                          \
    }                                                                                                                          \
    static void name##_step(const struct pt_walk_row *row)                                                                     \
    {                                                                                                                          \
        const struct name##_args args = *(const struct name##_args *)row->args;                                                \
        const struct pt_pointwise kind = {__VA_ARGS__, NULL};                                                                  \
        walk(row, &args, kind, !of_crop(kind), name##_body);                                                                   \
    }                                                                                                                          \
    static void name##_row(void *context, uint32_t y)                                                                          \
    {                                                                                                                          \
        const struct pt_cpu_call *call = context;                                                                              \
        const struct name##_args args = *(const struct name##_args *)call->arguments;                                          \
        const struct pt_pointwise kind = {__VA_ARGS__, NULL};                                                                  \
        const struct pt_walk_row row = row_of(call, kind, y);                                                                  \
        walk(&row, &args, kind, 0, name##_body);                                                                               \
    }                                                                                                                          \
    int PT_KERNEL_ENTRY(name)(const struct pt_cpu_call *call)                                                                  \
    {                                                                                                                          \
        return run(call, (struct pt_pointwise){__VA_ARGS__, NULL}, name##_row);                                                \
    }
#include "pointwise.def"
#undef PT_POINTWISE

const struct pt_pointwise PT_POINTWISE_KERNELS[PT_KERNEL_COUNT] = {
#define PT_POINTWISE(name, ...) [PT_KERNEL_##name] = {__VA_ARGS__, name##_step},
#include "pointwise.def"
#undef PT_POINTWISE
};
