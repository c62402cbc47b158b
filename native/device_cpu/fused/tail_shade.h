// SPDX-License-Identifier: GPL-3.0-or-later
// The walk's first steps: rows are seen, their points' colours fetched, their normals blended, and all is lit.
#ifndef PT_TAIL_SHADE_H
#define PT_TAIL_SHADE_H

#include "tail.h"

// Colours and shadows of points are fetched at random. Of large clouds each is a miss of all caches: those of a row that is
// shaded later are asked for (10M points: 4.4 ms in place of 6.3). Of others, so many bytes, none is far (1M: 2% slower).
static int lies_far(const struct instance_args *instance, size_t size) { return size * instance->slots > 6u << 20; }

static void ask_for_colors(const struct tail *tail, const struct pt_seen_row *seen, int32_t y)
{
    const struct view_args *view = tail->planes.view;
    for (uint32_t i = 0; i < tail->shade_count; i++) {
        const struct shade_args *args = tail->passes[i].call.arguments;
        const char *colors = PT_DATA(&tail->passes[i].call, shade, colors);
        const size_t bytes = pt_color_bytes[args->instance.color_format], size = lies_far(&args->instance, bytes) ? bytes : 0;
        const uint32_t *words = PT_DATA(&tail->passes[i].call, shade, shadows),
                       *marks = PT_DATA(&tail->passes[i].call, shade, marks);
        const uint32_t casting = args->of_pixels || args->marked ? 0
                                                                 : args->casting; // those lie as the pixels do, or side by side
        const int marked = args->casting && args->marked;
        for (uint32_t x = seen->first; (size || casting || marked) && x < seen->end; x += PT_LANES) {
            size_t at = (size_t)y * view->width + x;
            vi id;
            vm ours = pt_of_instance(tail->planes.keys + at, &args->instance, pt_lanes_left(x, view->width), &id);
            if (!vm_bits(ours))
                continue;
            uint32_t points[PT_LANES]; // all of them, the first point where there is none: no branch depends on the pixels
            vi_store(points, vi_select(ours, id, vi_set(0)));
            for (uint32_t k = 0; k < PT_LANES && size; k++)
                __builtin_prefetch(colors + size * points[k], 0, 1); // into the second level
            for (uint32_t k = 0; k < PT_LANES && marked; k++)
                __builtin_prefetch(marks + 2 * (size_t)(points[k] / PT_MARK_SLOTS), 0, 1);
            for (uint32_t l = 0; l < casting; l++)
                for (uint32_t k = 0; k < PT_LANES; k++)
                    __builtin_prefetch(words + (size_t)l * args->instance.slots + points[k], 0, 1);
        }
    }
}

static void see(const struct tail *tail, struct walk *walk, int32_t y)
{
    struct pt_seen_row *row = seen_row(tail, walk, y);
    pt_see_row(&tail->planes, y, tail->reach ? PT_BLEND_FILLED : 1.0f, tail->with_normals, row);
    ask_for_colors(tail, row, y);
}

static void find_flat(const struct tail *tail, struct walk *walk, int32_t y)
{
    const struct pt_seen_row *const rows[3] = {seen_row(tail, walk, y - 1), seen_row(tail, walk, y),
                                               seen_row(tail, walk, y + 1)};
    if (rows[1]->end)
        pt_find_flat(rows, tail->planes.view->width);
}

// Opacity into the row's colours.
static void make_translucent(const struct tail *tail, const struct pt_cpu_call *call, const struct pt_seen_row *seen,
                             const struct pt_color_row *row, float *opacities, int32_t y)
{
    const struct shade_args *args = call->arguments;
    const uint32_t width = tail->planes.view->width;
    for (uint32_t x = seen->first; x < seen->end; x += PT_LANES) {
        vi id;
        vm ours = pt_of_instance(tail->planes.keys + (size_t)y * width + x, &args->instance, pt_lanes_left(x, width), &id);
        if (!vm_bits(ours))
            continue;
        const size_t at = (size_t)y * width + x;
        const vi source = pt_color_pixels(&args->instance, pt_source(&tail->planes, at), at);
        vf opacity = pt_opacity(&args->instance, PT_DATA(call, shade, colors), PT_DATA(call, shade, opacities), id, source,
                                ours);
        for (uint32_t k = 0; k < 3; k++)
            vf_store_where(row->color[k] + x, vf_load(row->color[k] + x) * opacity, ours);
        vf_store_where(row->color[3] + x, opacity, ours);
        vf_store_where(opacities + x, opacity, ours);
    }
}

// What all pixels of the row share is copied first: stores to rows and planes may change it where it lies, for all that the compiler
// knows, and it would be read, and computed from, once more for each vector.
static inline __attribute__((always_inline)) void light_row(const struct tail *tail, struct walk *walk,
                                                            const struct pt_cpu_call *call, int32_t y, int plain)
{
    const struct shade_args args = *(const struct shade_args *)call->arguments;
    const struct pt_lights lights = pt_lights_of(&args, PT_DATA(call, shade, lights), PT_DATA(call, shade, shadows),
                                                 PT_DATA(call, shade, marks));
    const struct pt_planes planes = tail->planes;
    const struct pt_color_row out = walk->shaded[slot(tail, y)];
    const int shows_normals = tail->shows_normals, shows_shadow = tail->extract && tail->extract->shadow;
    float *shown[5];
    const struct pt_seen_row *around[2 * PT_BLEND_MOST + 1];
    const int reach = (int)args.blend;
    for (uint32_t k = 0; k < 5; k++)
        shown[k] = walk->shown[slot(tail, y)][k];
    for (int32_t k = -reach; k <= reach; k++)
        around[reach + k] = seen_row(tail, walk, y + k);
    const struct pt_seen_row own = *around[reach];
    const uint8_t *one_layer = reach == 1 ? own.flat : walk->wide;
    for (uint32_t x = own.first; x < own.end; x += PT_LANES) {
        vf color[3] = {vf_load(out.color[0] + x), vf_load(out.color[1] + x), vf_load(out.color[2] + x)}, normal[3];
        const size_t at = (size_t)y * planes.view->width + x;
        vi id;
        vm ours = pt_of_instance(planes.keys + at, &args.instance, pt_lanes_left(x, args.view.width), &id);
        if (!vm_bits(ours))
            continue;
        float *const *blended = reach && reach == tail->reach && one_layer[x / PT_LANES] ? walk->blended : NULL;
        vf share = pt_shade_pixels(&args, &planes, around, tail->weights, blended, &lights, x, (uint32_t)y, id, ours, plain,
                                   color, normal);
        for (uint32_t k = 0; k < 3; k++)
            vf_store_where(out.color[k] + x, color[k], ours);
        for (uint32_t k = 0; k < 3 && shows_normals; k++)
            vf_store_where(shown[k] + x, normal[k], ours);
        if (shows_shadow)
            vf_store_where(shown[4] + x, share, ours);
    }
}

static void shade_lit(const struct tail *tail, struct walk *walk, const struct pt_cpu_call *call, int32_t y)
{
    if (pt_plain(call->arguments))
        light_row(tail, walk, call, y, 1);
    else
        light_row(tail, walk, call, y, 0);
}

// Colours of three bytes a point, fetched at random: a loop of plain loads does nothing else, so that many are under way at a
// time.
static void fetch_bytes(const struct tail *tail, const struct pt_cpu_call *call, const struct pt_seen_row *seen,
                        const struct pt_color_row *out, int32_t y)
{
    enum { BLOCK = 16 };
    const struct shade_args *args = call->arguments;
    const uint32_t width = tail->planes.view->width;
    const uint8_t *colors = PT_DATA(call, shade, colors);
    for (uint32_t first = seen->first; first < seen->end; first += BLOCK * PT_LANES) {
        uint32_t words[BLOCK * PT_LANES];
        vm ours[BLOCK];
        uint32_t count = (seen->end - first) / PT_LANES;
        count = count < BLOCK ? count : BLOCK;
        for (uint32_t i = 0; i < count; i++) {
            vi id;
            uint32_t x = first + i * PT_LANES;
            ours[i] = pt_of_instance(tail->planes.keys + (size_t)y * width + x, &args->instance, pt_lanes_left(x, width), &id);
            vi_store(words + i * PT_LANES, vi_select(ours[i], id, vi_set(0)));
        }
        for (uint32_t i = 0; i < count * PT_LANES; i++)
            memcpy(&words[i], colors + 3 * (size_t)words[i], sizeof words[i]);
        for (uint32_t i = 0; i < count; i++) {
            vf albedo[3];
            if (!vm_bits(ours[i]))
                continue;
            pt_decode_srgb(vi_load(words + i * PT_LANES), albedo);
            for (uint32_t k = 0; k < 3; k++)
                vf_store_where(out->color[k] + first + i * PT_LANES, albedo[k], ours[i]);
        }
    }
}

// Any others, and those that a ramp or grading changes.
static void fetch_colors(const struct tail *tail, const struct pt_cpu_call *call, const struct pt_seen_row *seen,
                         const struct pt_color_row *out, int32_t y)
{
    const struct shade_args *args = call->arguments;
    const uint32_t width = tail->planes.view->width;
    for (uint32_t x = seen->first; x < seen->end; x += PT_LANES) {
        const size_t at = (size_t)y * width + x;
        vf albedo[3];
        vi id;
        vm ours = pt_of_instance(tail->planes.keys + at, &args->instance, pt_lanes_left(x, width), &id);
        if (!vm_bits(ours))
            continue;
        const vi source = pt_color_pixels(&args->instance, pt_source(&tail->planes, at), at);
        pt_albedo(&args->instance, PT_DATA(call, shade, colors), id, source, ours, albedo);
        if (pt_recolors(args))
            pt_recolor(args, PT_DATA(call, shade, ramps), x, (uint32_t)y, vf_load(out->z + x), ours, albedo);
        for (uint32_t k = 0; k < 3; k++)
            vf_store_where(out->color[k] + x, albedo[k], ours);
    }
}

static void fetch(const struct tail *tail, const struct pt_cpu_call *call, const struct pt_seen_row *seen,
                  const struct pt_color_row *out, int32_t y)
{
    const struct shade_args *args = call->arguments;
    if (pt_gathers_bytes(&args->instance) && !pt_recolors(args))
        fetch_bytes(tail, call, seen, out, y);
    else
        fetch_colors(tail, call, seen, out, y);
}

// Where the row's next part that is flat, or is not, ends.
static uint32_t end_of_part(const struct pt_seen_row *seen, uint32_t x)
{
    const int flat = pt_flat(seen, x);
    while (x < seen->end && pt_flat(seen, x) == flat)
        x += PT_LANES;
    return x;
}

// Sums of normals wherever the blend's whole window is one layer.
static void blend_nine(const struct tail *tail, struct walk *walk, int32_t y)
{
    const struct pt_seen_row *const rows[3] = {seen_row(tail, walk, y - 1), seen_row(tail, walk, y),
                                               seen_row(tail, walk, y + 1)};
    const struct pt_nine nine = pt_blend_nine(tail->weights);
    for (uint32_t x = rows[1]->first, end; x < rows[1]->end; x = end) {
        end = end_of_part(rows[1], x);
        for (uint32_t k = 0; k < 3 && pt_flat(rows[1], x); k++) {
            const float *const normals[3] = {rows[0]->normal[k], rows[1]->normal[k], rows[2]->normal[k]};
            pt_nine_flat(&nine, normals, (int32_t)x, (int32_t)end, vf_set(1.0f), vf_set(pt_float(PT_KEY_EMPTY_Z)),
                         walk->blended[k]);
        }
    }
}

static void blend_wide(const struct tail *tail, struct walk *walk, int32_t y)
{
    const struct pt_seen_row *around[2 * PT_BLEND_MOST + 1];
    const struct pt_blend blend = {tail->planes.view, tail->reach, tail->weights, around};
    const int32_t end = (int32_t)seen_row(tail, walk, y)->end;
    for (int32_t k = -tail->reach; k <= tail->reach; k++)
        around[tail->reach + k] = seen_row(tail, walk, y + k);
    for (int32_t x = (int32_t)seen_row(tail, walk, y)->first; x < end; x += PT_BLEND_COLUMNS)
        pt_blend_flat(&blend, x, x + PT_BLEND_COLUMNS < end ? x + PT_BLEND_COLUMNS : end, walk->wide, walk->blended);
}

// Colours without light, for steps that ask for them.
static void fetch_albedo(const struct tail *tail, struct walk *walk, const struct pt_cpu_call *call, int32_t y)
{
    const struct pt_seen_row *seen = seen_row(tail, walk, y);
    float *const *rows = walk->albedo[slot(tail, y)];
    const struct pt_color_row out = {seen->z, {rows[0], rows[1], rows[2], walk->shaded[slot(tail, y)].color[3]}};
    fetch(tail, call, seen, &out, y);
    if (tail->channels == 4)
        make_translucent(tail, call, seen, &out, walk->shown[slot(tail, y)][3], y);
}

// Of a picture that was shaded before: what others left in planes.
static void load_shaded(const struct tail *tail, struct walk *walk, int32_t y)
{
    const struct pt_seen_row *seen = seen_row(tail, walk, y);
    const struct pt_color_row *out = &walk->shaded[slot(tail, y)];
    float *const *shown = walk->shown[slot(tail, y)];
    for (uint32_t x = seen->first; x < seen->end; x += PT_LANES) {
        const size_t at = (size_t)y * tail->planes.view->width + x;
        vf four[4];
        vf_load4(tail->colors + 4 * at, four);
        for (uint32_t k = 0; k < 4; k++)
            vf_store(out->color[k] + x, four[k]);
        if (tail->shading) {
            vf_load4(tail->shading + 4 * at, four);
            for (uint32_t k = 0; k < 4; k++)
                vf_store(shown[k] + x, four[k]);
        }
        if (tail->arrived)
            vf_store(shown[4] + x, vf_load(tail->arrived + at));
    }
}

// Eye-dome lighting: rows of its ring follow those of the walk, which goes on, leaves out rows or begins anew.
static void darken(const struct tail *tail, struct walk *walk, const struct pt_color_row *colors, int32_t y)
{
    const struct edl_args *args = tail->edl;
    const struct pt_seen_row *seen = seen_row(tail, walk, y);
    const struct pt_edl_ring *ring = &walk->edl;
    const int32_t reach = (int32_t)args->reach, end = y + reach + 1;
    const float *near[PT_EDL_RADII * PT_EDL_NEIGHBOURS], *own = pt_edl_row(ring, y);
    if (walk->edl_next < y - reach || walk->edl_next > end)
        walk->edl_next = y - reach;
    for (; walk->edl_next < end; walk->edl_next++)
        pt_edl_load_row(args, tail->planes.keys, walk->edl_next, pt_edl_row(ring, walk->edl_next));
    pt_edl_near(args, ring, y, near);
    for (uint32_t x = seen->first; x < seen->end; x += PT_LANES) {
        vf depth = vf_load(own + x);
        vm some = vm_and(vm_first(pt_lanes_left(x, args->view.rect[2])), vf_lt(vf_set(PT_EDL_EMPTY), depth));
        if (!vm_bits(some))
            continue;
        vf light = pt_edl_light(args, &tail->edl_planes, near, depth, x, (uint32_t)y, some);
        for (int k = 0; k < 3; k++) // what is empty may become anything
            vf_store(colors->color[k] + x, vf_load(colors->color[k] + x) * light);
    }
}

// Steps on a row of colours.
static void take_steps(const struct tail *tail, struct walk *walk, const struct steps *steps, const struct pt_color_row *colors,
                       int32_t y)
{
    const struct pt_seen_row *seen = seen_row(tail, walk, y);
    for (uint32_t i = steps->first; i < steps->first + steps->count && seen->end; i++) {
        const struct pt_cpu_call *call = &tail->passes[i].call;
        const struct pt_pointwise *kernel = &PT_POINTWISE_KERNELS[tail->passes[i].kernel];
        if (tail->passes[i].kernel == PT_KERNEL_edl) {
            darken(tail, walk, colors, y);
            continue;
        }
        const size_t at = (size_t)y * tail->planes.view->width;
        struct pt_walk_row row = {.args = call->arguments,
                                  .clips = kernel->clips < 0 ? NULL : pt_cpu_data(call, (uint32_t)kernel->clips),
                                  .y = (uint32_t)y,
                                  .first = seen->first,
                                  .end = seen->end,
                                  .keys = tail->planes.keys + at,
                                  .slopes = pt_walk_slopes(call, kernel->slopes, at),
                                  .z = seen->z};
        if (kernel->shading >= 0 && !tail->shade_count)
            row.shading = (const float *)pt_cpu_data(call, (uint32_t)kernel->shading) + 4 * at;
        if (kernel->albedo >= 0 && !tail->shade_count)
            row.albedo = (const float *)pt_cpu_data(call, (uint32_t)kernel->albedo) + 4 * at;
        for (uint32_t k = 0; k < 3; k++) {
            row.normal_rows[k] = walk->shown[slot(tail, y)][k];
            row.albedo_rows[k] = walk->albedo[slot(tail, y)][k];
            row.color_rows[k] = colors->color[k];
        }
        row.color_rows[3] = tail->channels == 4 ? colors->color[3] : NULL;
        kernel->step(&row);
    }
}

// How much of each pixel is obscured, before the mean.
static void find_obscured(const struct tail *tail, struct walk *walk, int32_t y)
{
    const struct pt_seen_row *seen = seen_row(tail, walk, y);
    float *const *shown = walk->shown[slot(tail, y)], *out = walk->obscured[slot(tail, y)];
    for (uint32_t x = seen->first; x < seen->end; x += PT_LANES) {
        vf z = vf_load(seen->z + x);
        vm some = vf_lt(z, vf_set(pt_float(PT_KEY_EMPTY_Z)));
        const vf normal[3] = {vf_load(shown[0] + x), vf_load(shown[1] + x), vf_load(shown[2] + x)};
        if (vm_bits(some))
            vf_store(out + x, pt_obscured(tail->obscure, tail->planes.keys, z, normal, x, (uint32_t)y, some));
    }
}

// The mean of that, when the two rows before y and behind it are known; and the steps that follow.
static void obscure(const struct tail *tail, struct walk *walk, int32_t y)
{
    const struct pt_seen_row *seen = seen_row(tail, walk, y);
    const struct pt_color_row *colors = &walk->shaded[slot(tail, y)];
    const float *z[PT_OBSCURE_ROWS], *obscured[PT_OBSCURE_ROWS];
    for (int32_t k = 0; k < PT_OBSCURE_ROWS; k++) {
        z[k] = seen_row(tail, walk, y + k - PT_OBSCURE_BLUR)->z;
        obscured[k] = walk->obscured[slot(tail, y + k - PT_OBSCURE_BLUR)];
    }
    for (uint32_t x = seen->first; x < seen->end; x += PT_LANES) {
        vm some = vf_lt(vf_load(seen->z + x), vf_set(pt_float(PT_KEY_EMPTY_Z)));
        if (!vm_bits(some))
            continue;
        vf light = pt_obscure_light(tail->obscure, z, obscured, vf_load(seen->limit + x), x, some);
        for (int k = 0; k < 3; k++)
            vf_store(colors->color[k] + x, vf_load(colors->color[k] + x) * light);
    }
    take_steps(tail, walk, &tail->darkened, colors, y);
}

static void shade(const struct tail *tail, struct walk *walk, int32_t y)
{
    const struct pt_seen_row *seen = seen_row(tail, walk, y);
    struct pt_color_row *out = &walk->shaded[slot(tail, y)];
    out->z = seen->z;
    if (tail->with_normals && tail->reach == 1 && seen->end)
        blend_nine(tail, walk, y);
    else if (tail->with_normals && tail->reach && seen->end)
        blend_wide(tail, walk, y);
    for (uint32_t i = 0; i < tail->shade_count && seen->end; i++) {
        const struct pt_cpu_call *call = &tail->passes[i].call;
        if (shades_albedo(tail, i)) {
            fetch_albedo(tail, walk, call, y);
            continue;
        }
        fetch(tail, call, seen, out, y);
        if (tail->with_normals)
            shade_lit(tail, walk, call, y);
        if (tail->channels == 4)
            make_translucent(tail, call, seen, out, walk->shown[slot(tail, y)][3], y);
    }
    if (tail->colors && seen->end)
        load_shaded(tail, walk, y);
    take_steps(tail, walk, &tail->before, out, y);
    if (tail->obscure)
        find_obscured(tail, walk, y);
}

#endif
