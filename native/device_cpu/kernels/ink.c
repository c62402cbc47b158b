// SPDX-License-Identifier: GPL-3.0-or-later
// ink: lines get their colour. [X 3.3]; twin of shaders/kernels/ink.comp
#include "device_cpu/rows.h"
#include "shade.h"
#include "shared/picture.h"

struct ink {
    const struct ink_args *args;
    const uint64_t *keys;
    const float *line;
    const uint32_t *nearest;
    const void *colors;
    float *color, *depth, *mask;
};

static struct ink ink_of(const struct pt_cpu_call *call)
{
    return (struct ink){call->arguments,
                        PT_DATA(call, ink, keys),
                        PT_DATA(call, ink, line),
                        PT_DATA(call, ink, nearest),
                        PT_DATA(call, ink, colors),
                        PT_DATA(call, ink, color),
                        PT_DATA(call, ink, depth),
                        PT_DATA(call, ink, mask)};
}

// Of lines of surfaces at z that show the instance's points `id`, not yet times their share.
static void line_color(const struct ink *ink, vi id, vf z, vm ours, vf color[3])
{
    const struct ink_args *args = ink->args;
    const vf zero = vf_zero(), one = vf_set(1.0f);
    for (int k = 0; k < 3; k++)
        color[k] = vf_set(args->color[k]);
    if (args->source == PATINA_LINE_POINT) {
        vf own[3];
        pt_albedo(&args->instance, ink->colors, id, vi_set(0), ours, own);
        for (int k = 0; k < 3; k++)
            color[k] = color[k] * own[k];
    } else if (args->source == PATINA_LINE_DEPTH) {
        vf far = vf_min(vf_max((z - vf_set(args->start)) * vf_set(args->scale), zero), one);
        for (int k = 0; k < 3; k++)
            color[k] = color[k] * (one - far) + vf_set(args->far_color[k]) * far;
    }
}

// to: of the pixels in the pictures. share: 0 where the lines are not the instance's.
static void blend(const struct ink *ink, size_t to, vi id, vf z, vm ours, vf share)
{
    const struct ink_args *args = ink->args;
    const vf one = vf_set(1.0f);
    vf line[4], under[4], mixed[4], alpha = share * vf_set(args->opacity);
    line_color(ink, id, z, ours, line);
    line[3] = one;
    vf_load4(ink->color + 4 * to, under);
    vf through = args->behind ? one - under[3] : one - alpha;
    for (int k = 0; k < 4; k++)
        mixed[k] = args->behind ? under[k] + through * (line[k] * alpha) : line[k] * alpha + through * under[k];
    vf_store4(ink->color + 4 * to, mixed, vm_bits(ours));
}

static void blank(const struct ink *ink, size_t at, size_t to, uint32_t count)
{
    vf background[4];
    vm some = vm_and(vm_first(count), vm_not(vi_eq(vi_load_z(ink->keys + at), vi_set(PT_KEY_EMPTY_Z))));
    for (int k = 0; k < 4; k++)
        background[k] = vf_set(ink->args->background[k]);
    if (vm_bits(some))
        vf_store4(ink->color + 4 * to, background, vm_bits(some));
}

static void ink_pixels(const struct ink *ink, size_t at, size_t to, vf share, uint32_t count)
{
    const struct ink_args *args = ink->args;
    if (args->blank)
        blank(ink, at, to, count);
    if (args->mask)
        vf_store_where(ink->mask + to, share * vf_set(args->opacity), vm_first(count));
    vm some = vf_lt(vf_zero(), share);
    if (!vm_bits(some) || !(args->color_target || args->depth))
        return;
    vi nearest = vi_load(ink->nearest + at),
       id = vi_sub(vi_gather_id(ink->keys, nearest, some), vi_set(args->instance.id_base));
    vf z = vi_float(vi_gather_z(ink->keys, nearest, some));
    vm ours = vm_and(some, pt_has_ids(id, args->instance.id_first, args->instance.id_count));
    if (!vm_bits(ours))
        return;
    if (args->color_target)
        blend(ink, to, id, z, ours, share);
    if (args->depth)
        vf_store_where(ink->depth + to, z, vm_and(ours, vf_le(vf_set(0.5f), share)));
}

static void ink_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct ink ink = ink_of(call);
    const struct ink_args *args = ink.args;
    const uint32_t *rect = args->view.rect, py = args->crop_y + y;
    for (uint32_t x = 0; x < args->crop_width; x += PT_LANES) {
        uint32_t px = args->crop_x + x, count = pt_lanes_left(x, args->crop_width);
        size_t at = (size_t)py * args->view.width + px;
        vf share = vf_zero();
        if (py >= rect[1] && py < rect[3]) {
            vi column = vi_add(vi_set(px - rect[0]), vi_lanes()); // left of it: beyond all
            vm known = vm_and(vm_first(count), vi_lt_unsigned(column, vi_set(rect[2] - rect[0])));
            share = vf_select(known, vf_load(ink.line + at), share);
        }
        ink_pixels(&ink, at, (size_t)y * args->crop_width + x, share, count);
    }
}

int PT_KERNEL_ENTRY(ink)(const struct pt_cpu_call *call)
{
    const struct ink_args *args = call->arguments;
    return pt_crop_rows(call, &args->view, args->crop_width, args->crop_height, ink_row);
}
