// SPDX-License-Identifier: GPL-3.0-or-later
// extract: the passes beside the colour, into the crop: z, world-space normal, source, shadow (SPEC 2.2: scholars must see what
// is scan and what is invention); twin of shaders/kernels/extract.comp
#include "extract.h"
#include "shared/colors.h"

// away: where discs were drawn, the row's.
static void extract_source(const struct extract_args *args, const uint64_t *keys, const uint32_t *from, const float *away,
                           uint32_t y, float *out)
{
    const struct view_args *view = &args->view;
    for (uint32_t x = 0; x < args->crop_width; x += PT_LANES) {
        vm lanes = vm_first(pt_lanes_left(x, args->crop_width));
        vm some = vm_and(lanes, vm_not(vi_eq(vi_load_z(keys + x), vi_set(PT_KEY_EMPTY_Z))));
        if (!vm_bits(some)) {
            vf_store_where(out + x, vf_zero(), lanes);
            continue;
        }
        vi word = vi_load(from + x), source = vi_and(word, vi_set(~PT_FROM_MIXED));
        vm mixed = vm_not(vi_eq(word, source));
        const uint32_t px = args->crop_x + x, py = args->crop_y + y;
        vf value = away ? pt_source_among_discs(args, keys + x, away + x, source, mixed, some, px, py)
                        : pt_source_value(view->width, source, mixed, some, px, py);
        vf_store_where(out + x, value, lanes);
    }
}

static void extract_normal(const struct extract_args *args, const uint64_t *keys, const float *shading, float *out)
{
    for (uint32_t x = 0; x < args->crop_width; x += PT_LANES) {
        uint32_t count = pt_lanes_left(x, args->crop_width);
        vm some = vm_and(vm_first(count), vm_not(vi_eq(vi_load_z(keys + x), vi_set(PT_KEY_EMPTY_Z))));
        vf n[4], world[3];
        if (!vm_bits(some)) {
            memset(out + 3 * (size_t)x, 0, 12 * count);
            continue;
        }
        vf_load4(shading + 4 * (size_t)x, n);
        pt_world_normal(args->world_from_view, n, some, world);
        vf_put3(out + 3 * (size_t)x, world, count);
    }
}

// The mean share of the casting lights that arrives; 1 where nothing is.
static void extract_shadow(const struct extract_args *args, const uint64_t *keys, const float *arrived, float *out)
{
    for (uint32_t x = 0; x < args->crop_width; x += PT_LANES) {
        vm lanes = vm_first(pt_lanes_left(x, args->crop_width));
        vm some = vm_not(vi_eq(vi_load_z(keys + x), vi_set(PT_KEY_EMPTY_Z)));
        vf_store_where(out + x, vf_select(some, vf_load(arrived + x), vf_set(1.0f)), lanes);
    }
}

static void extract_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct extract_args *args = call->arguments;
    size_t row = (size_t)(args->crop_y + y) * args->view.width + args->crop_x, out = (size_t)y * args->crop_width;
    const uint64_t *keys = (const uint64_t *)PT_DATA(call, extract, keys) + row;
    float *depth = args->depth ? (float *)PT_DATA(call, extract, depth) + out : NULL;
    for (uint32_t x = 0; args->depth && x < args->crop_width; x += PT_LANES) {
        const vm lanes = vm_first(pt_lanes_left(x, args->crop_width));
        vf z = vi_float(vi_load_z(keys + x));
        if (args->centered)
            z = pt_centered_depth(args, keys + x, PT_DATA(call, extract, offset),
                                  pt_source_of(PT_DATA(call, extract, from), row + x), lanes);
        vf_store_where(depth + x, z, lanes);
    }
    if (args->normal)
        extract_normal(args, keys, (const float *)PT_DATA(call, extract, shading) + 4 * row,
                       (float *)PT_DATA(call, extract, normal) + 3 * out);
    if (args->source)
        extract_source(args, keys, (const uint32_t *)PT_DATA(call, extract, from) + row,
                       args->discs_count ? (const float *)PT_DATA(call, extract, away) + row : NULL, y,
                       (float *)PT_DATA(call, extract, source) + out);
    if (args->shadow)
        extract_shadow(args, keys, (const float *)PT_DATA(call, extract, arrived) + row,
                       (float *)PT_DATA(call, extract, shadow) + out);
}

int PT_KERNEL_ENTRY(extract)(const struct pt_cpu_call *call)
{
    const struct extract_args *args = call->arguments;
    return pt_crop_rows(call, &args->view, args->crop_width, args->crop_height, extract_row);
}
