// SPDX-License-Identifier: GPL-3.0-or-later
// extract: the passes beside the colour, into the crop: z, world-space normal, source (SPEC 2.2: scholars must see what
// is scan and what is invention); twin of shaders/kernels/extract.comp
#include "device_cpu/rows.h"

// Row and column of pixels of a plane: a float quotient is at most one row off, also where the index has more than 24 bits.
static void place_of(vi index, uint32_t width, vi *x, vi *y)
{
    const vf inverse = vf_set(1.0f / (float)width);
    vi row = vf_int(vi_convert(index) * inverse), column = vi_sub(index, vi_mul(row, vi_set(width)));
    vm under = vi_lt_unsigned(vi_set(0x7FFFFFFFu), column); // negative
    row = vi_select(under, vi_sub(row, vi_set(1)), row);
    column = vi_select(under, vi_add(column, vi_set(width)), column);
    vm over = vm_not(vi_lt_unsigned(column, vi_set(width)));
    *y = vi_select(over, vi_add(row, vi_set(1)), row);
    *x = vi_select(over, vi_sub(column, vi_set(width)), column);
}

// 1 measured, 1 + distance filled, negative when anti-aliasing mixed the colour.
static void extract_source(const struct extract_args *args, const uint64_t *keys, const uint32_t *from, uint32_t y,
                           float *out)
{
    const struct view_args *view = &args->view;
    const vf one = vf_set(1.0f);
    uint32_t row = (args->crop_y + y) * view->width + args->crop_x;
    for (uint32_t x = 0; x < args->crop_width; x += PT_LANES) {
        vm lanes = vm_first(pt_lanes_left(x, args->crop_width));
        vm some = vm_and(lanes, vm_not(vi_eq(vi_load_z(keys + x), vi_set(PT_KEY_EMPTY_Z))));
        if (!vm_bits(some)) {
            vf_store(out + x, vf_zero(), lanes);
            continue;
        }
        vi word = vi_load(from + x), source = vi_and(word, vi_set(~PT_FROM_MIXED));
        vm filled = vm_and(some, vm_not(vi_eq(source, vi_add(vi_set(row + x), vi_lanes()))));
        vf value = one;
        if (vm_bits(filled)) {
            vi sx, sy;
            place_of(source, view->width, &sx, &sy);
            vf dx = vi_convert(vi_sub(sx, vi_add(vi_set(args->crop_x + x), vi_lanes())));
            vf dy = vi_convert(vi_sub(sy, vi_set(args->crop_y + y)));
            vf square = vf_select(filled, dx * dx + dy * dy, one);
            value = vf_select(filled, one + square * vf_rsqrt(square), one);
        }
        value = vf_select(vi_eq(word, source), value, vf_zero() - value);
        vf_store(out + x, vf_select(some, value, vf_zero()), lanes);
    }
}

// Pixels of three floats: each store's fourth float is overwritten by the next pixel's first; the last is stored apart.
static void store_normals(const vf n[4], float *out, uint32_t count)
{
    float pixels[4 * PT_LANES];
    vf_store4(pixels, n, vm_bits(vm_first(PT_LANES)));
    for (uint32_t i = 0; i + 1 < count; i++)
        memcpy(out + 3 * i, pixels + 4 * i, 16);
    memcpy(out + 3 * (count - 1), pixels + 4 * (count - 1), 12);
}

static void extract_normal(const struct extract_args *args, const uint64_t *keys, const float *shading, float *out)
{
    const float *m = args->world_from_view;
    for (uint32_t x = 0; x < args->crop_width; x += PT_LANES) {
        uint32_t count = pt_lanes_left(x, args->crop_width);
        vm some = vm_and(vm_first(count), vm_not(vi_eq(vi_load_z(keys + x), vi_set(PT_KEY_EMPTY_Z))));
        vf n[4], world[4];
        if (!vm_bits(some)) {
            memset(out + 3 * (size_t)x, 0, 12 * count);
            continue;
        }
        vf_load4(shading + 4 * (size_t)x, n);
        for (int k = 0; k < 3; k++) {
            vf sum = (vf_set(m[3 * k]) * n[0] + vf_set(m[3 * k + 1]) * n[1]) + vf_set(m[3 * k + 2]) * n[2];
            world[k] = vf_select(some, sum, vf_zero());
        }
        world[3] = vf_zero();
        store_normals(world, out + 3 * (size_t)x, count);
    }
}

static void extract_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct extract_args *args = call->arguments;
    size_t row = (size_t)(args->crop_y + y) * args->view.width + args->crop_x, out = (size_t)y * args->crop_width;
    const uint64_t *keys = (const uint64_t *)pt_cpu_data(call, 0) + row;
    float *depth = (float *)pt_cpu_data(call, 3) + out;
    for (uint32_t x = 0; args->depth && x < args->crop_width; x += PT_LANES)
        vf_store(depth + x, vi_float(vi_load_z(keys + x)), vm_first(pt_lanes_left(x, args->crop_width)));
    if (args->normal)
        extract_normal(args, keys, (const float *)pt_cpu_data(call, 2) + 4 * row,
                       (float *)pt_cpu_data(call, 4) + 3 * out);
    if (args->source)
        extract_source(args, keys, (const uint32_t *)pt_cpu_data(call, 1) + row, y,
                       (float *)pt_cpu_data(call, 5) + out);
}

int PT_KERNEL_ENTRY(extract)(const struct pt_cpu_call *call)
{
    const struct extract_args *args = call->arguments;
    struct view_args crop = args->view;
    crop.rect[0] = crop.rect[1] = 0;
    crop.rect[2] = args->crop_width;
    crop.rect[3] = args->crop_height;
    return pt_rows(call, &crop, extract_row);
}
