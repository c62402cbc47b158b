// SPDX-License-Identifier: GPL-3.0-or-later
// tail: shade, obscure, edl, smooth, antialias, then peel or compose and extract as one walk over rows, with the pointwise kernels
// that the plan has between and behind them. The planes between them stay in rings of rows that the second-level cache holds: nothing
// but the picture, what peeling hands on, or the colours that depth of field looks around in is written. Same functions, same numbers
// as the kernels. It begins with shading, or behind a kernel that is none of these with the colours that this left.
// Where nothing is peeled the scene is opaque: alpha is 1 but for edges.
#include "tail_shade.h"
#include "device_cpu/pointwise/bodies.h"

static uint32_t edl_rows(const struct tail *tail) { return tail->edl ? 2 * tail->edl->reach + 1 : 0; }

static size_t thread_floats(const struct tail *tail)
{
    const uint32_t rows = tail->ring_mask + 1;
    return (tail->ring * CHANNELS_SEEN + rows * CHANNELS_COLOR + 4 + (tail->obscure ? rows : 0)) * tail->stride +
           edl_rows(tail) * pt_edl_stride(tail->planes.view->width);
}

static void lay_out(const struct tail *tail, uint32_t thread, struct walk *walk)
{
    float *at = tail->memory + thread * tail->thread_floats + PT_ROW_PAD;
    const size_t s = tail->stride;
    for (uint32_t i = 0; i < tail->ring; i++, at += CHANNELS_SEEN * s)
        walk->seen[i] = (struct pt_seen_row){at, at + s, {at + 2 * s, at + 3 * s, at + 4 * s}, (uint8_t *)(at + 5 * s), 0, 0};
    for (uint32_t i = 0; i <= tail->ring_mask; i++, at += CHANNELS_COLOR * s) {
        walk->shaded[i] = (struct pt_color_row){NULL, {at, at + s, at + 2 * s, at + 3 * s}};
        walk->smoothed[i] = (struct pt_color_row){NULL, {at + 4 * s, at + 5 * s, at + 6 * s, at + 7 * s}};
        for (uint32_t k = 0; k < 5; k++)
            walk->shown[i][k] = at + (8 + k) * s;
        for (uint32_t k = 0; k < 3; k++)
            walk->albedo[i][k] = at + (13 + k) * s;
    }
    for (uint32_t k = 0; k < 3; k++)
        walk->blended[k] = at + k * s;
    walk->wide = (uint8_t *)(at + 3 * s);
    at += 4 * s;
    for (uint32_t i = 0; i <= tail->ring_mask && tail->obscure; i++, at += s)
        walk->obscured[i] = at;
    walk->edl = (struct pt_edl_ring){at - PT_ROW_PAD, pt_edl_stride(tail->planes.view->width), edl_rows(tail)};
}

// ---- smoothing -------------------------------------------------------------------------------------------------------------

static void smooth(const struct tail *tail, struct walk *walk, int32_t y)
{
    const struct pt_color_row *const rows[3] = {&walk->shaded[slot(tail, y - 1)], &walk->shaded[slot(tail, y)],
                                                &walk->shaded[slot(tail, y + 1)]};
    struct pt_color_row *out = &walk->smoothed[slot(tail, y)];
    const struct pt_seen_row *seen = seen_row(tail, walk, y);
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z));
    out->z = rows[1]->z;
    const vf scale = vf_set(pt_smooth_scale(tail->smooth));
    const struct pt_nine nine = pt_smooth_weights(tail->smooth);
    for (uint32_t x = seen->first, end; x < seen->end; x = end) {
        const int flat = pt_flat(seen, x);
        end = flat ? end_of_part(seen, x) : x + PT_LANES;
        for (int k = 0; k < tail->channels && flat; k++) {
            const float *const colors[3] = {rows[0]->color[k], rows[1]->color[k], rows[2]->color[k]};
            pt_nine_flat(&nine, colors, (int32_t)x, (int32_t)end, scale, vf_set(k < 3 ? pt_float(PT_KEY_EMPTY_Z) : 1.0f),
                         out->color[k]);
        }
        vm some = vf_lt(vf_load(out->z + x), empty); // +inf behind the row's end
        vf color[4];
        if (flat || !vm_bits(some))
            continue;
        if (tail->channels == 3)
            pt_smooth_pixels(tail->smooth, rows, 3, x, vf_load(seen->limit + x), some, color);
        else
            pt_smooth_pixels(tail->smooth, rows, 4, x, vf_load(seen->limit + x), some, color);
        for (int k = 0; k < tail->channels; k++)
            vf_store(out->color[k] + x, color[k]);
    }
}

static void draw(const struct tail *tail, struct walk *walk, int32_t y)
{
    if (tail->smooth)
        smooth(tail, walk, y);
    else
        walk->smoothed[slot(tail, y)] = walk->shaded[slot(tail, y)];
    take_steps(tail, walk, &tail->after, &walk->smoothed[slot(tail, y)], y);
}

// ---- the picture ----------------------------------------------------------------------------------------------------------

struct around { // rows y - 1, y, y + 1
    const struct pt_color_row *row[3];
};

// Mixes the colours of those of PT_LANES pixels that are edges; returns which.
static vm mix_edges(const struct tail *tail, const struct around *around, const float *limits, uint32_t x, uint32_t y, vm some,
                    vf color[4])
{
    const struct view_args *view = tail->planes.view;
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z)), one = vf_set(1.0f);
    vf limit = empty, sum[4] = {vf_zero(), vf_zero(), vf_zero(), vf_zero()}, count = vf_zero();
    if (tail->line)
        some = vm_and(some, vm_not(vf_lt(vf_zero(), vf_load(tail->line + (size_t)y * view->width + x))));
    if (tail->antialias->layers)
        limit = vf_load(around->row[1]->z + x) + vf_load(limits + x);
    for (int d = 0; d < 4; d++) {
        const struct pt_color_row *row = around->row[1 + pt_cross[d][1]];
        const uint32_t qx = x + (uint32_t)pt_cross[d][0];
        vf z = vf_load(row->z + (int32_t)qx);
        vm far = vm_and(some, vm_or(vf_lt(limit, z), vf_le(empty, z)));
        if (y + (uint32_t)pt_cross[d][1] >= view->height || !vm_bits(far))
            continue; // beyond the plane all is unknown: no edge
        far = vm_and(far, vi_lt_unsigned(vi_add(vi_set(qx), vi_lanes()), vi_set(view->width)));
        if (tail->through) { // where no pixel shows, peeling leaves what comes through as it is
            vi at = vi_add(vi_set((y + (uint32_t)pt_cross[d][1]) * view->width + qx), vi_lanes());
            vm open = vm_and(far, vf_le(empty, z)); // of other pixels another thread writes it now
            far = vm_and(far, vm_not(vm_and(open, vf_lt(vf_gather(tail->through, at, open), vf_set(PT_SPENT)))));
        }
        count = vf_add_where(far, count, one);
        far = vm_and(far, vf_lt(z, empty));
        for (uint32_t k = 0; k < 3; k++)
            sum[k] = vf_add_where(far, sum[k], vf_load(row->color[k] + (int32_t)qx));
        sum[3] = vf_add_where(far, sum[3], tail->channels == 4 ? vf_load(row->color[3] + (int32_t)qx) : one);
    }
    vm edges = vf_lt(vf_zero(), count);
    if (!vm_bits(edges))
        return edges;
    vf mixed[4];
    pt_mix_edges(color, sum, vf_select(edges, count, one), mixed);
    for (uint32_t k = 0; k < 4; k++)
        color[k] = vf_select(edges, mixed[k], color[k]);
    return edges;
}

// The passes beside the colour. (x, y): of the picture.
static void put_passes(const struct tail *tail, const struct walk *walk, vf z, vm some, vm mixed, uint32_t x, uint32_t y,
                       uint32_t count)
{
    const struct extract_args *args = tail->extract;
    const uint32_t width = tail->planes.view->width, px = args->crop_x + x, py = args->crop_y + y;
    size_t out = (size_t)y * args->crop_width + x;
    if (args->depth && args->centered) {
        const size_t at = (size_t)py * width + px;
        vf_put(tail->depth + out,
               pt_centered_depth(args, tail->planes.keys + at, tail->offsets, pt_source_of(tail->planes.from, at), some),
               count);
    } else if (args->depth) {
        vf_put(tail->depth + out, z, count);
    }
    if (args->normal) {
        vf normal[3], world[3] = {vf_zero(), vf_zero(), vf_zero()};
        if (vm_bits(some)) {
            for (uint32_t k = 0; k < 3; k++)
                normal[k] = vf_load(walk->shown[slot(tail, (int32_t)py)][k] + px);
            pt_world_normal(args->world_from_view, normal, some, world);
        }
        vf_put3(tail->normals + 3 * out, world, count);
    }
    if (args->source) {
        vf value = vf_zero();
        const size_t at = (size_t)py * width + px;
        const vi source = vm_bits(some) ? pt_source(&tail->planes, at) : vi_set(0);
        if (vm_bits(some) && args->discs_count)
            value = pt_source_among_discs(args, tail->planes.keys + at, tail->away + at, source, mixed, some, px, py);
        else if (vm_bits(some))
            value = pt_source_value(width, source, mixed, some, px, py);
        vf_put(tail->source + out, value, count);
    }
    if (args->shadow) {
        vf value = vf_set(1.0f);
        if ((tail->with_normals || tail->arrived) && vm_bits(some))
            value = vf_select(some, vf_load(walk->shown[slot(tail, (int32_t)py)][4] + px), value);
        vf_put(tail->shadow + out, value, count);
    }
}

static void put_row(const struct tail *tail, struct walk *walk, int32_t y)
{
    const struct compose_args *args = tail->compose;
    const struct pt_seen_row *seen = seen_row(tail, walk, y);
    const struct around around = {
        {&walk->smoothed[slot(tail, y - 1)], &walk->smoothed[slot(tail, y)], &walk->smoothed[slot(tail, y + 1)]}};
    const uint32_t row = (uint32_t)y - args->crop_y;
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z));
    float *combined = tail->combined + 4 * (size_t)row * args->crop_width;
    vf background[4];
    for (int k = 0; k < 4; k++)
        background[k] = vf_set(args->background[k]);
    for (uint32_t x = 0; x < args->crop_width; x += PT_LANES) {
        uint32_t px = args->crop_x + x, count = pt_lanes_left(x, args->crop_width);
        vf z = vf_load(seen->z + px), color[4] = {background[0], background[1], background[2], background[3]};
        vm some = vm_and(vm_first(count), vf_lt(z, empty)), mixed = vm_of_bits(0);
        if (vm_bits(some)) {
            vf shown[4] = {vf_load(around.row[1]->color[0] + px), vf_load(around.row[1]->color[1] + px),
                           vf_load(around.row[1]->color[2] + px), vf_set(1.0f)};
            if (pt_flat(seen, px)) { // opaque, and no edge
                memcpy(color, shown, sizeof color);
            } else {
                if (tail->antialias)
                    mixed = mix_edges(tail, &around, seen->limit, px, (uint32_t)y, some, shown);
                const struct pt_here here = {.some = some};
                pt_compose(args, &here, shown);
                memcpy(color, shown, sizeof color);
            }
        }
        vf_put4(combined + 4 * (size_t)x, color, count);
        if (tail->extract)
            put_passes(tail, walk, z, some, mixed, x, row, count);
    }
    for (uint32_t i = tail->last.first; i < tail->last.first + tail->last.count; i++)
        PT_POINTWISE_KERNELS[tail->passes[i].kernel].step(&(struct pt_walk_row){
            .args = tail->passes[i].call.arguments, .y = row, .end = args->crop_width, .color = combined});
}

// ---- or what is peeled ---------------------------------------------------------------------------------------------------

static void peel_row(const struct tail *tail, struct walk *walk, int32_t y)
{
    const struct pt_seen_row *seen = seen_row(tail, walk, y);
    const struct around around = {
        {&walk->smoothed[slot(tail, y - 1)], &walk->smoothed[slot(tail, y)], &walk->smoothed[slot(tail, y + 1)]}};
    const uint32_t *rect = tail->peel->view.rect, first = rect[0] / PT_TILE, width = tail->planes.view->width;
    const uint32_t columns = (width + PT_TILE - 1) / PT_TILE, last = (rect[2] + PT_TILE - 1) / PT_TILE;
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z));
    for (uint32_t tx = first; tx < last && y % PT_TILE == 0; tx++)
        walk->tiles[tx] = pt_tile_begin();
    for (uint32_t x = first * PT_TILE; x < rect[2]; x += PT_LANES) {
        vm lanes = vm_first(pt_lanes_left(x, rect[2]));
        vf z = vf_load(seen->z + x), color[4] = {empty, empty, empty, empty};
        vm some = vm_and(lanes, vf_lt(z, empty));
        if (vm_bits(some)) {
            for (uint32_t k = 0; k < 4; k++)
                color[k] = vf_load(around.row[1]->color[k] + x);
            if (tail->antialias && !pt_flat(seen, x))
                mix_edges(tail, &around, seen->limit, x, (uint32_t)y, some, color);
        }
        // keys of what was filled across a layer already taken stay: nothing reads them any more
        pt_peel_pixels(tail->peel, &tail->peeled, (size_t)y * width + x, lanes, some, z, color,
                       vf_load(walk->shown[slot(tail, y)][3] + x), vf_load(seen->limit + x), &walk->tiles[x / PT_TILE]);
    }
    if (y % PT_TILE != PT_TILE - 1 && y != tail->end - 1)
        return;
    for (uint32_t tx = first; tx < last; tx++)
        tail->tiles[(size_t)(y / PT_TILE) * columns + tx] = pt_tile_end(&walk->tiles[tx]);
}

// ---- or colours that are left to what follows -----------------------------------------------------------------------------

// Of a row of the crop the passes beside the colour.
static void extract_row(const struct tail *tail, struct walk *walk, const struct around *around, int32_t y)
{
    const struct extract_args *args = tail->extract;
    const struct pt_seen_row *seen = seen_row(tail, walk, y);
    for (uint32_t x = 0; x < args->crop_width; x += PT_LANES) {
        const uint32_t px = args->crop_x + x, count = pt_lanes_left(x, args->crop_width);
        vf z = vf_load(seen->z + px), color[4] = {vf_zero(), vf_zero(), vf_zero(), vf_zero()};
        vm some = vm_and(vm_first(count), vf_lt(z, vf_set(pt_float(PT_KEY_EMPTY_Z)))), mixed = vm_of_bits(0);
        if (args->source && tail->antialias && vm_bits(some) && !pt_flat(seen, px))
            mixed = mix_edges(tail, around, seen->limit, px, (uint32_t)y, some, color);
        put_passes(tail, walk, z, some, mixed, x, (uint32_t)y - args->crop_y, count);
    }
}

static void leave_row(const struct tail *tail, struct walk *walk, int32_t y)
{
    const struct pt_seen_row *seen = seen_row(tail, walk, y);
    const struct around around = {
        {&walk->smoothed[slot(tail, y - 1)], &walk->smoothed[slot(tail, y)], &walk->smoothed[slot(tail, y + 1)]}};
    float *out = tail->left + 4 * (size_t)y * tail->planes.view->width;
    for (uint32_t x = seen->first; x < seen->end; x += PT_LANES) {
        vm some = vf_lt(vf_load(seen->z + x), vf_set(pt_float(PT_KEY_EMPTY_Z)));
        vf color[4] = {vf_load(around.row[1]->color[0] + x), vf_load(around.row[1]->color[1] + x),
                       vf_load(around.row[1]->color[2] + x), vf_set(1.0f)};
        if (!vm_bits(some))
            continue;
        if (tail->antialias && !pt_flat(seen, x))
            mix_edges(tail, &around, seen->limit, x, (uint32_t)y, some, color);
        vf_store4(out + 4 * (size_t)x, color, vm_bits(some));
    }
    if (tail->extract && (uint32_t)y - tail->extract->crop_y < tail->extract->crop_height)
        extract_row(tail, walk, &around, y);
}

// ---- the walk ----------------------------------------------------------------------------------------------------------------

static void tail_rows(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct tail *tail = context;
    struct walk *walk = &tail->walks[thread];
    const int32_t lag = tail->lag, ahead = lag + tail->reach, first = tail->base + (int32_t)(begin * UNIT);
    int32_t last = tail->base + (int32_t)(end * UNIT);
    last = last < tail->end ? last : tail->end;
    int32_t y = first;
    if (first != walk->next) { // not where this thread stopped: begin anew
        walk->first = first;
        y = first - 4 - 2 * ahead;
    }
    for (; y < last && !pt_cpu_cancelled(&tail->passes[0].call); y++) { // y is finished when y + 2 + ahead has been seen
        see(tail, walk, y + 2 + ahead);
        find_flat(tail, walk, y + 1 + ahead);
        if (y + 2 + lag >= walk->first - 2 - lag)
            shade(tail, walk, y + 2 + lag);
        if (tail->obscure && y + 2 >= walk->first - 2)
            obscure(tail, walk, y + 2);
        if (y + 1 >= walk->first - 1)
            draw(tail, walk, y + 1);
        if (y >= walk->first && tail->peel)
            peel_row(tail, walk, y);
        else if (y >= walk->first && tail->compose)
            put_row(tail, walk, y);
        else if (y >= walk->first)
            leave_row(tail, walk, y);
    }
    walk->next = last;
}

// Puts a pass in its place. color: which of its buffers is the plane of colours.
static void add_step(struct tail *tail, uint32_t i, uint32_t color)
{
    struct steps *steps = tail->compose || tail->peel ? &tail->last
                          : tail->smooth              ? &tail->after
                          : tail->obscure             ? &tail->darkened
                                                      : &tail->before;
    if (!steps->count++)
        steps->first = i;
    if (!tail->shade_count && !tail->colors && steps != &tail->last)
        tail->colors = pt_cpu_data(&tail->passes[i].call, color);
}

// And notes what a pointwise one asks for.
static void add_pointwise(struct tail *tail, uint32_t i)
{
    const struct pt_pointwise *kernel = &PT_POINTWISE_KERNELS[tail->passes[i].kernel];
    tail->shows_normals |= kernel->shading >= 0;
    if (kernel->albedo >= 0)
        tail->albedo = tail->passes[i].call.buffers[kernel->albedo];
    add_step(tail, i, (uint32_t)kernel->color);
}

// Smoothing and anti-aliasing say, where nothing is shaded, what pixels show; and where the walk goes.
_Static_assert((int)PT_BUF_smooth_from == (int)PT_BUF_antialias_from && (int)PT_BUF_smooth_deff == (int)PT_BUF_antialias_deff &&
                   (int)PT_BUF_smooth_color == (int)PT_BUF_antialias_color && !PT_BUF_smooth_keys && !PT_BUF_antialias_keys,
               "smooth and antialias list what they read alike");
static void take_planes(struct tail *tail, const struct pt_cpu_call *call, float *result)
{
    tail->planes.keys = PT_DATA(call, smooth, keys);
    tail->planes.view = call->arguments;
    tail->base = (int32_t)tail->planes.view->rect[1];
    tail->end = (int32_t)tail->planes.view->rect[3];
    tail->left = result;
    if (tail->shade_count)
        return;
    tail->planes.from = PT_DATA(call, smooth, from);
    tail->planes.deff = PT_DATA(call, smooth, deff);
    if (!tail->colors)
        tail->colors = PT_DATA(call, smooth, color);
}

// Where colours are left, passes are the crop's all the same.
static void take_crop(struct tail *tail)
{
    const int32_t first = (int32_t)tail->extract->crop_y, end = first + (int32_t)tail->extract->crop_height;
    if (tail->compose || tail->peel)
        return;
    tail->base = tail->base < first ? tail->base : first;
    tail->end = tail->end > end ? tail->end : end;
}

int PT_KERNEL_ENTRY(tail)(const struct pt_cpu_pass *passes, uint32_t count)
{
    struct tail tail = {.passes = passes};
    const struct pt_cpu_call *shared = &passes[0].call;
    for (uint32_t i = 0; i < count; i++) {
        const struct pt_cpu_call *call = &passes[i].call;
        switch (passes[i].kernel) {
        case PT_KERNEL_shade:
            tail.shade_count++;
            tail.with_normals |= (int)((const struct shade_args *)call->arguments)->instance.lit;
            if (tail.reach < (int32_t)((const struct shade_args *)call->arguments)->blend)
                tail.reach = (int32_t)((const struct shade_args *)call->arguments)->blend;
            tail.planes.normals = PT_DATA(call, shade, normal);
            tail.planes.deff = PT_DATA(call, shade, deff);
            break;
        case PT_KERNEL_obscure:
            tail.obscure = call->arguments;
            tail.shows_normals = 1;
            if (!tail.shade_count) {
                tail.shading = PT_DATA(call, obscure, shading);
                tail.colors = tail.colors ? tail.colors : PT_DATA(call, obscure, color);
            }
            break;
        case PT_KERNEL_edl:
            tail.edl = call->arguments;
            tail.edl_planes = PT_EDL_PLANES(call);
            add_step(&tail, i, PT_BUF_edl_color);
            break;
        case PT_KERNEL_smooth:
            take_planes(&tail, call, PT_DATA(call, smooth, result));
            tail.smooth = call->arguments;
            break;
        case PT_KERNEL_antialias:
            take_planes(&tail, call, PT_DATA(call, antialias, color));
            tail.antialias = call->arguments;
            tail.through = tail.antialias->behind ? PT_DATA(call, antialias, through) : NULL;
            tail.line = tail.antialias->inked ? PT_DATA(call, antialias, line) : NULL;
            break;
        case PT_KERNEL_peel:
            tail.peel = call->arguments;
            tail.shading = PT_DATA(call, peel, shading);
            tail.planes.keys = PT_DATA(call, peel, keys);
            tail.planes.view = &tail.peel->view;
            tail.peeled = (struct pt_peeled){PT_DATA(call, peel, limit), PT_DATA(call, peel, through),
                                             PT_DATA(call, peel, over)};
            tail.tiles = PT_DATA(call, peel, tiles);
            tail.base = (int32_t)(tail.peel->view.rect[1] / PT_TILE * PT_TILE);
            tail.end = (int32_t)tail.peel->view.rect[3];
            break;
        case PT_KERNEL_compose:
            tail.compose = call->arguments;
            tail.planes.keys = PT_DATA(call, compose, keys);
            tail.combined = PT_DATA(call, compose, combined);
            tail.planes.view = &tail.compose->view;
            tail.base = (int32_t)tail.compose->crop_y;
            tail.end = tail.base + (int32_t)tail.compose->crop_height;
            break;
        case PT_KERNEL_extract:
            tail.extract = call->arguments;
            tail.shows_normals |= (int)tail.extract->normal;
            tail.shading = tail.extract->normal ? PT_DATA(call, extract, shading) : tail.shading;
            tail.arrived = tail.extract->shadow ? PT_DATA(call, extract, arrived) : NULL;
            if (!tail.planes.from) // smoothing's, where nothing is shaded: extract has it for some passes alone
                tail.planes.from = PT_DATA(call, extract, from);
            tail.depth = PT_DATA(call, extract, depth);
            tail.normals = PT_DATA(call, extract, normal);
            tail.source = PT_DATA(call, extract, source);
            tail.shadow = PT_DATA(call, extract, shadow);
            tail.away = PT_DATA(call, extract, away);
            tail.offsets = PT_DATA(call, extract, offset);
            take_crop(&tail);
            break;
        default: add_pointwise(&tail, i);
        }
    }
    if (tail.shade_count) {
        tail.planes.from = PT_DATA(shared, shade, from);
        tail.with_normals |= tail.shows_normals;
        tail.shading = tail.arrived = NULL; // both are shaded here
    }
    memcpy(tail.planes.rect, tail.planes.view->rect, sizeof tail.planes.rect);
    tail.channels = tail.peel ? 4 : 3;
    tail.stride = pt_row_stride(tail.planes.view->width);
    tail.lag = tail.obscure ? LAG : 0;
    tail.ring_mask = tail.lag ? RING_MOST - 1 : RING - 1;
    const int32_t ring = tail.reach + tail.lag + 3;
    tail.ring = (uint32_t)(2 * tail.reach > ring ? 2 * tail.reach : ring) + 1;
    tail.thread_floats = thread_floats(&tail);
    pt_blend_weights(tail.weights);
    uint32_t threads = pt_pool_threads(shared->pool);
    tail.memory = pt_cpu_scratch(shared, 0, threads * tail.thread_floats * sizeof(float));
    // sums of tiles behind the walks, on a cache line
    size_t columns = (tail.planes.view->width + PT_TILE - 1) / PT_TILE;
    size_t walks = (threads * sizeof *tail.walks + 63) / 64 * 64;
    tail.walks = pt_cpu_scratch(shared, 1, walks + threads * columns * sizeof(struct pt_tile_sum));
    if (!tail.memory || !tail.walks)
        return PATINA_ERROR_MEMORY;
    for (uint32_t i = 0; i < threads; i++) {
        lay_out(&tail, i, &tail.walks[i]);
        tail.walks[i].next = tail.walks[i].edl_next = INT32_MIN;
        tail.walks[i].tiles = (struct pt_tile_sum *)(void *)((char *)tail.walks + walks) + i * columns;
    }
    if (tail.end > tail.base)
        pt_parallel(shared->pool, (uint32_t)(tail.end - tail.base + UNIT - 1) / UNIT, 1, tail_rows, &tail);
    return pt_cpu_cancelled(shared) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
