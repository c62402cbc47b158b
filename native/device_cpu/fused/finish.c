// SPDX-License-Identifier: GPL-3.0-or-later
// finish: shade, smooth, antialias, then peel or compose and extract as one walk over rows. The planes between them stay
// in rings of rows that the second-level cache holds: nothing but the picture, or what peeling hands on, is written. Same
// functions, same numbers as the kernels.
// Where nothing is peeled the scene is opaque: alpha is 1 but for edges.
#include "device_cpu/kernels/antialias.h"
#include "device_cpu/kernels/compose.h"
#include "device_cpu/kernels/extract.h"
#include "device_cpu/kernels/peel.h"
#include "device_cpu/kernels/shade.h"
#include "device_cpu/kernels/smooth.h"

enum { UNIT = PT_TILE, RING = 4, CHANNELS_SEEN = 6, CHANNELS_COLOR = 13 }; // shaded 4, smoothed 4, shown 5
// Row s is shaded when s + reach has been seen, s - 1 is smoothed then, s - 2 finished: anti-aliasing reads s - 3 too.
enum { SEEN_MOST = 2 * PT_BLEND_MOST + 1 };

struct finish {
    const struct pt_cpu_pass *shades;
    uint32_t shade_count;
    const struct smooth_args *smooth;         // NULL: off
    const struct antialias_args *antialias;   // NULL: off
    const struct compose_args *compose;
    const struct extract_args *extract;       // NULL: nothing beside the colour
    float *combined, *depth, *normals, *source, *shadow;
    const struct peel_args *peel;             // NULL: the picture is composed
    const float *through;                     // of the layers before; NULL before the first
    const float *line;                        // lines, which anti-aliasing leaves to ink; NULL: none
    struct pt_peeled peeled;
    struct pt_tile_value *tiles;
    int channels;                             // of colours: 3, or 4 with alpha
    int32_t base, end;                        // rows that are finished
    struct pt_planes planes;
    int32_t reach;
    int with_normals;
    float weights[2 * PT_BLEND_MOST * PT_BLEND_MOST + 1];
    float *memory; // per thread
    size_t stride, thread_floats;
    uint32_t ring; // of rows seen
    struct walk *walks; // per thread
};

// Where a thread is: it goes on where it stopped when its next rows follow.
struct walk {
    int32_t first, next;            // row of the picture that it began with; that comes next
    struct pt_seen_row seen[SEEN_MOST];
    struct pt_color_row shaded[RING], smoothed[RING];
    float *shown[RING][5];          // normals, opacities, what arrives of the lights
    float *blended[3];              // sums of normals of the row at hand, where it is flat
    struct pt_tile_sum *tiles;      // of the row of tiles at hand
};

static struct pt_seen_row *seen_row(const struct finish *finish, struct walk *walk, int32_t y)
{
    return &walk->seen[(uint32_t)(y + 4 * SEEN_MOST) % finish->ring];
}

static uint32_t slot(int32_t y) { return (uint32_t)(y + RING) % RING; }

static void lay_out(const struct finish *finish, uint32_t thread, struct walk *walk)
{
    float *at = finish->memory + thread * finish->thread_floats + PT_ROW_PAD;
    const size_t s = finish->stride;
    for (uint32_t i = 0; i < finish->ring; i++, at += CHANNELS_SEEN * s)
        walk->seen[i] = (struct pt_seen_row){ at, at + s, { at + 2 * s, at + 3 * s, at + 4 * s }, (uint8_t *)(at + 5 * s), 0, 0 };
    for (uint32_t i = 0; i < RING; i++, at += CHANNELS_COLOR * s) {
        walk->shaded[i] = (struct pt_color_row){ NULL, { at, at + s, at + 2 * s, at + 3 * s } };
        walk->smoothed[i] = (struct pt_color_row){ NULL, { at + 4 * s, at + 5 * s, at + 6 * s, at + 7 * s } };
        for (uint32_t k = 0; k < 5; k++)
            walk->shown[i][k] = at + (8 + k) * s;
    }
    for (uint32_t k = 0; k < 3; k++)
        walk->blended[k] = at + k * s;
}

// ---- 1. colours and normals -------------------------------------------------------------------------------------------------

// Colours and shadows of points are fetched at random. Of large clouds each is a miss of all caches: those of a row that is
// shaded later are asked for (10M points: 4.4 ms in place of 6.3). Of others, so many bytes, none is far (1M: 2% slower).
static int lies_far(const struct instance_args *instance, size_t size) { return size * instance->id_count > 6u << 20; }

static void ask_for_colors(const struct finish *finish, const struct pt_seen_row *seen, int32_t y)
{
    const struct view_args *view = finish->planes.view;
    for (uint32_t i = 0; i < finish->shade_count; i++) {
        const struct shade_args *args = finish->shades[i].call.arguments;
        const char *colors = pt_cpu_data(&finish->shades[i].call, 4);
        const size_t bytes = pt_color_bytes[args->instance.color_format], size = lies_far(&args->instance, bytes) ? bytes : 0;
        const uint32_t *words[PT_MAX_LIGHTS];
        uint32_t casting = 0;
        for (uint32_t l = 0; l < args->light_count; l++)
            if (args->lights[l].shadow)
                words[casting++] = (const uint32_t *)pt_cpu_data(&finish->shades[i].call, 8) +
                                   (size_t)(args->lights[l].shadow - 1) * args->instance.id_count;
        for (uint32_t x = seen->first; (size || casting) && x < seen->end; x += PT_LANES) {
            size_t at = (size_t)y * view->width + x;
            vi id;
            vm ours = pt_of_instance(finish->planes.keys + at, &args->instance, pt_lanes_left(x, view->width), &id);
            if (!vm_bits(ours))
                continue;
            uint32_t points[PT_LANES]; // all of them, the first point where there is none: no branch depends on the pixels
            vi_store(points, vi_select(ours, id, vi_set(0)), vm_first(PT_LANES));
            for (uint32_t k = 0; k < PT_LANES && size; k++)
                __builtin_prefetch(colors + size * points[k], 0, 1); // into the second level
            for (uint32_t l = 0; l < casting; l++)
                for (uint32_t k = 0; k < PT_LANES; k++)
                    __builtin_prefetch(words[l] + points[k], 0, 1);
        }
    }
}

static void see(const struct finish *finish, struct walk *walk, int32_t y)
{
    struct pt_seen_row *row = seen_row(finish, walk, y);
    pt_see_row(&finish->planes, y, finish->reach ? PT_BLEND_FILLED : 1.0f, finish->with_normals, row);
    ask_for_colors(finish, row, y);
}

static void find_flat(const struct finish *finish, struct walk *walk, int32_t y)
{
    const struct pt_seen_row *const rows[3] = { seen_row(finish, walk, y - 1), seen_row(finish, walk, y),
                                                seen_row(finish, walk, y + 1) };
    if (rows[1]->end)
        pt_find_flat(rows, finish->planes.view->width);
}

// Opacity into the row's colours.
static void make_translucent(const struct finish *finish, const struct pt_cpu_call *call, const struct pt_seen_row *seen,
                             const struct pt_color_row *row, float *opacities, int32_t y)
{
    const struct shade_args *args = call->arguments;
    const uint32_t width = finish->planes.view->width;
    for (uint32_t x = seen->first; x < seen->end; x += PT_LANES) {
        vi id;
        vm ours = pt_of_instance(finish->planes.keys + (size_t)y * width + x, &args->instance, pt_lanes_left(x, width), &id);
        if (!vm_bits(ours))
            continue;
        vf opacity = pt_opacity(&args->instance, pt_cpu_data(call, 4), pt_cpu_data(call, 7), id, (size_t)y * width + x, ours);
        for (uint32_t k = 0; k < 3; k++)
            vf_store(row->color[k] + x, vf_load(row->color[k] + x) * opacity, ours);
        vf_store(row->color[3] + x, opacity, ours);
        vf_store(opacities + x, opacity, ours);
    }
}

static inline __attribute__((always_inline)) void light_row(const struct finish *finish, struct walk *walk,
                                                            const struct pt_cpu_call *call, int32_t y, int plain)
{
    const struct shade_args *args = call->arguments;
    const uint32_t *shadows = pt_cpu_data(call, 8);
    const struct view_args *view = finish->planes.view;
    const struct pt_color_row *out = &walk->shaded[slot(y)];
    const struct pt_seen_row *around[2 * PT_BLEND_MOST + 1];
    const int reach = (int)args->blend;
    for (int32_t k = -reach; k <= reach; k++)
        around[reach + k] = seen_row(finish, walk, y + k);
    for (uint32_t x = around[reach]->first; x < around[reach]->end; x += PT_LANES) {
        vf color[3] = { vf_load(out->color[0] + x), vf_load(out->color[1] + x), vf_load(out->color[2] + x) }, normal[3];
        vi id;
        vm ours = pt_of_instance(finish->planes.keys + (size_t)y * view->width + x, &args->instance,
                                 pt_lanes_left(x, view->width), &id);
        if (!vm_bits(ours))
            continue;
        vf share = pt_shade_pixels(args, &finish->planes, around, finish->weights,
                                   finish->reach == 1 && pt_flat(around[reach], x) ? walk->blended : NULL, shadows, x, (uint32_t)y, id, ours,
                                   plain, color, normal);
        for (uint32_t k = 0; k < 3; k++)
            vf_store(out->color[k] + x, color[k], ours);
        for (uint32_t k = 0; k < 3 && finish->extract && finish->extract->normal; k++)
            vf_store(walk->shown[slot(y)][k] + x, normal[k], ours);
        if (finish->extract && finish->extract->shadow)
            vf_store(walk->shown[slot(y)][4] + x, share, ours);
    }
}

static void shade_lit(const struct finish *finish, struct walk *walk, const struct pt_cpu_call *call, int32_t y)
{
    if (pt_plain(call->arguments))
        light_row(finish, walk, call, y, 1);
    else
        light_row(finish, walk, call, y, 0);
}

// Colours of three bytes a point, fetched at random: a tight loop gathers those of a block, so that many are under way at a
// time. More are when they are asked for first: a gather is 80 operations, of which a processor keeps some 300 in sight.
static void fetch_bytes(const struct finish *finish, const struct pt_cpu_call *call, const struct pt_seen_row *seen,
                        const struct pt_color_row *out, int32_t y)
{
    enum { BLOCK = 16 };
    const struct shade_args *args = call->arguments;
    const uint32_t width = finish->planes.view->width;
    const char *colors = pt_cpu_data(call, 4);
    const int near = !lies_far(&args->instance, 3);
    for (uint32_t first = seen->first; first < seen->end; first += BLOCK * PT_LANES) {
        vi words[BLOCK];
        vm ours[BLOCK];
        uint32_t count = (seen->end - first) / PT_LANES;
        count = count < BLOCK ? count : BLOCK;
        for (uint32_t i = 0; i < count; i++) {
            uint32_t x = first + i * PT_LANES, points[PT_LANES];
            ours[i] = pt_of_instance(finish->planes.keys + (size_t)y * width + x, &args->instance, pt_lanes_left(x, width), &words[i]);
            vi_store(points, vi_select(ours[i], words[i], vi_set(0)), vm_first(PT_LANES));
            for (uint32_t k = 0; near && k < PT_LANES; k++)
                __builtin_prefetch(colors + 3 * (size_t)points[k]);
        }
        for (uint32_t i = 0; i < count; i++)
            if (vm_bits(ours[i]))
                words[i] = pt_gather_rgb(colors, words[i], ours[i]);
        for (uint32_t i = 0; i < count; i++) {
            vf albedo[3];
            if (!vm_bits(ours[i]))
                continue;
            pt_decode_srgb(words[i], albedo);
            for (uint32_t k = 0; k < 3; k++)
                vf_store(out->color[k] + first + i * PT_LANES, albedo[k], ours[i]);
        }
    }
}

// Any others, and those that a ramp or grading changes.
static void fetch_colors(const struct finish *finish, const struct pt_cpu_call *call, const struct pt_seen_row *seen,
                         const struct pt_color_row *out, int32_t y)
{
    const struct shade_args *args = call->arguments;
    const uint32_t width = finish->planes.view->width;
    for (uint32_t x = seen->first; x < seen->end; x += PT_LANES) {
        const size_t at = (size_t)y * width + x;
        vf albedo[3];
        vi id;
        vm ours = pt_of_instance(finish->planes.keys + at, &args->instance, pt_lanes_left(x, width), &id);
        if (!vm_bits(ours))
            continue;
        pt_albedo(&args->instance, pt_cpu_data(call, 4), id, at, ours, albedo);
        if (pt_recolors(args))
            pt_recolor(args, x, (uint32_t)y, vf_load(out->z + x), ours, albedo);
        for (uint32_t k = 0; k < 3; k++)
            vf_store(out->color[k] + x, albedo[k], ours);
    }
}

// Where the row's next part that is flat, or is not, ends.
static uint32_t end_of_part(const struct pt_seen_row *seen, uint32_t x)
{
    const int flat = pt_flat(seen, x);
    while (x < seen->end && pt_flat(seen, x) == flat)
        x += PT_LANES;
    return x;
}

static void blend_flat(const struct finish *finish, struct walk *walk, int32_t y)
{
    const struct pt_seen_row *const rows[3] = { seen_row(finish, walk, y - 1), seen_row(finish, walk, y),
                                                seen_row(finish, walk, y + 1) };
    const struct pt_nine nine = pt_blend_nine(finish->weights);
    for (uint32_t x = rows[1]->first, end; x < rows[1]->end; x = end) {
        end = end_of_part(rows[1], x);
        for (uint32_t k = 0; k < 3 && pt_flat(rows[1], x); k++) {
            const float *const normals[3] = { rows[0]->normal[k], rows[1]->normal[k], rows[2]->normal[k] };
            pt_nine_flat(&nine, normals, (int32_t)x, (int32_t)end, vf_set(1.0f), vf_set(pt_float(PT_KEY_EMPTY_Z)), walk->blended[k]);
        }
    }
}

static void shade(const struct finish *finish, struct walk *walk, int32_t y)
{
    const struct pt_seen_row *seen = seen_row(finish, walk, y);
    struct pt_color_row *out = &walk->shaded[slot(y)];
    out->z = seen->z;
    if (finish->reach == 1 && seen->end)
        blend_flat(finish, walk, y);
    for (uint32_t i = 0; i < finish->shade_count && seen->end; i++) {
        const struct pt_cpu_call *call = &finish->shades[i].call;
        const struct shade_args *args = call->arguments;
        if (pt_gathers_bytes(&args->instance) && !pt_recolors(args))
            fetch_bytes(finish, call, seen, out, y);
        else
            fetch_colors(finish, call, seen, out, y);
        if (finish->with_normals)
            shade_lit(finish, walk, call, y);
        if (finish->channels == 4)
            make_translucent(finish, call, seen, out, walk->shown[slot(y)][3], y);
    }
}

// ---- 2. smoothing -------------------------------------------------------------------------------------------------------------

static void smooth(const struct finish *finish, struct walk *walk, int32_t y)
{
    const struct pt_color_row *const rows[3] = { &walk->shaded[slot(y - 1)], &walk->shaded[slot(y)],
                                                 &walk->shaded[slot(y + 1)] };
    struct pt_color_row *out = &walk->smoothed[slot(y)];
    const struct pt_seen_row *seen = seen_row(finish, walk, y);
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z));
    if (!finish->smooth) {
        *out = *rows[1];
        return;
    }
    out->z = rows[1]->z;
    const vf scale = vf_set(pt_smooth_scale(finish->smooth));
    const struct pt_nine nine = pt_smooth_weights(finish->smooth);
    for (uint32_t x = seen->first, end; x < seen->end; x = end) {
        const int flat = pt_flat(seen, x);
        end = flat ? end_of_part(seen, x) : x + PT_LANES;
        for (int k = 0; k < finish->channels && flat; k++) {
            const float *const colors[3] = { rows[0]->color[k], rows[1]->color[k], rows[2]->color[k] };
            pt_nine_flat(&nine, colors, (int32_t)x, (int32_t)end, scale, vf_set(k < 3 ? pt_float(PT_KEY_EMPTY_Z) : 1.0f), out->color[k]);
        }
        vm some = vf_lt(vf_load(out->z + x), empty); // +inf behind the row's end
        vf color[4];
        if (flat || !vm_bits(some))
            continue;
        if (finish->channels == 3)
            pt_smooth_pixels(finish->smooth, rows, 3, x, vf_load(seen->limit + x), some, color);
        else
            pt_smooth_pixels(finish->smooth, rows, 4, x, vf_load(seen->limit + x), some, color);
        for (int k = 0; k < finish->channels; k++)
            vf_store(out->color[k] + x, color[k], vm_first(PT_LANES));
    }
}

// ---- 3. the picture ----------------------------------------------------------------------------------------------------------

struct around { // rows y - 1, y, y + 1
    const struct pt_color_row *row[3];
};

// Mixes the colours of those of PT_LANES pixels that are edges; returns which.
static vm mix_edges(const struct finish *finish, const struct around *around, const float *limits, uint32_t x, uint32_t y,
                    vm some, vf color[4])
{
    const struct view_args *view = finish->planes.view;
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z)), one = vf_set(1.0f);
    vf limit = empty, sum[4] = { vf_zero(), vf_zero(), vf_zero(), vf_zero() }, count = vf_zero();
    if (finish->line)
        some = vm_and(some, vm_not(vf_lt(vf_zero(), vf_load(finish->line + (size_t)y * view->width + x))));
    if (finish->antialias->layers)
        limit = vf_load(around->row[1]->z + x) + vf_load(limits + x);
    for (int d = 0; d < 4; d++) {
        const struct pt_color_row *row = around->row[1 + pt_cross[d][1]];
        const uint32_t qx = x + (uint32_t)pt_cross[d][0];
        vf z = vf_load(row->z + (int32_t)qx);
        vm far = vm_and(some, vm_or(vf_lt(limit, z), vf_le(empty, z)));
        if (y + (uint32_t)pt_cross[d][1] >= view->height || !vm_bits(far))
            continue; // beyond the plane all is unknown: no edge
        far = vm_and(far, vi_lt_unsigned(vi_add(vi_set(qx), vi_lanes()), vi_set(view->width)));
        if (finish->through) { // where no pixel shows, peeling leaves what comes through as it is
            vi at = vi_add(vi_set((y + (uint32_t)pt_cross[d][1]) * view->width + qx), vi_lanes());
            vm hidden = vf_lt(vf_gather(finish->through, at, far), vf_set(PT_SPENT));
            far = vm_and(far, vm_not(vm_and(hidden, vf_le(empty, z))));
        }
        count = vf_add_where(far, count, one);
        far = vm_and(far, vf_lt(z, empty));
        for (uint32_t k = 0; k < 3; k++)
            sum[k] = vf_add_where(far, sum[k], vf_load(row->color[k] + (int32_t)qx));
        sum[3] = vf_add_where(far, sum[3], finish->channels == 4 ? vf_load(row->color[3] + (int32_t)qx) : one);
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
static void put_passes(const struct finish *finish, const struct walk *walk, vf z, vm some, vm mixed, uint32_t x, uint32_t y,
                       uint32_t count)
{
    const struct extract_args *args = finish->extract;
    const uint32_t width = finish->planes.view->width, px = args->crop_x + x, py = args->crop_y + y;
    size_t out = (size_t)y * args->crop_width + x;
    if (args->depth)
        vf_put(finish->depth + out, z, count);
    if (args->normal) {
        vf normal[3], world[3] = { vf_zero(), vf_zero(), vf_zero() };
        if (vm_bits(some)) {
            for (uint32_t k = 0; k < 3; k++)
                normal[k] = vf_load(walk->shown[slot((int32_t)py)][k] + px);
            pt_world_normal(args->world_from_view, normal, some, world);
        }
        vf_put3(finish->normals + 3 * out, world, count);
    }
    if (args->source) {
        vf value = vf_zero();
        if (vm_bits(some) && args->discs)
            value = pt_source_of_discs(finish->planes.keys + (size_t)py * width + px,
                                       finish->planes.normals + 4 * ((size_t)py * width + px), args->discs, mixed, some);
        else if (vm_bits(some))
            value = pt_source_value(width, pt_source(&finish->planes, (size_t)py * width + px), mixed, some, px, py);
        vf_put(finish->source + out, value, count);
    }
    if (args->shadow) {
        vf value = vf_set(1.0f);
        if (finish->with_normals && vm_bits(some))
            value = vf_select(some, vf_load(walk->shown[slot((int32_t)py)][4] + px), value);
        vf_put(finish->shadow + out, value, count);
    }
}

static void put_row(const struct finish *finish, struct walk *walk, int32_t y)
{
    const struct compose_args *args = finish->compose;
    const struct pt_seen_row *seen = seen_row(finish, walk, y);
    const struct around around = { { &walk->smoothed[slot(y - 1)], &walk->smoothed[slot(y)], &walk->smoothed[slot(y + 1)] } };
    const uint32_t row = (uint32_t)y - args->crop_y;
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z));
    float *combined = finish->combined + 4 * (size_t)row * args->crop_width;
    vf background[4];
    for (int k = 0; k < 4; k++)
        background[k] = vf_set(args->background[k]);
    for (uint32_t x = 0; x < args->crop_width; x += PT_LANES) {
        uint32_t px = args->crop_x + x, count = pt_lanes_left(x, args->crop_width);
        vf z = vf_load(seen->z + px), color[4] = { background[0], background[1], background[2], background[3] };
        vm some = vm_and(vm_first(count), vf_lt(z, empty)), mixed = vm_of_bits(0);
        if (vm_bits(some)) {
            vf shown[4] = { vf_load(around.row[1]->color[0] + px), vf_load(around.row[1]->color[1] + px),
                            vf_load(around.row[1]->color[2] + px), vf_set(1.0f) };
            if (pt_flat(seen, px)) { // opaque, and no edge
                memcpy(color, shown, sizeof color);
            } else {
                if (finish->antialias)
                    mixed = mix_edges(finish, &around, seen->limit, px, (uint32_t)y, some, shown);
                pt_compose(shown, background, some, color);
            }
        }
        vf_put4(combined + 4 * (size_t)x, color, count);
        if (finish->extract)
            put_passes(finish, walk, z, some, mixed, x, row, count);
    }
}

// ---- 3'. or what is peeled ---------------------------------------------------------------------------------------------------

static void peel_row(const struct finish *finish, struct walk *walk, int32_t y)
{
    const struct pt_seen_row *seen = seen_row(finish, walk, y);
    const struct around around = { { &walk->smoothed[slot(y - 1)], &walk->smoothed[slot(y)], &walk->smoothed[slot(y + 1)] } };
    const uint32_t *rect = finish->peel->view.rect, first = rect[0] / PT_TILE, width = finish->planes.view->width;
    const uint32_t columns = (width + PT_TILE - 1) / PT_TILE, last = (rect[2] + PT_TILE - 1) / PT_TILE;
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z));
    for (uint32_t tx = first; tx < last && y % PT_TILE == 0; tx++)
        walk->tiles[tx] = pt_tile_begin();
    for (uint32_t x = first * PT_TILE; x < rect[2]; x += PT_LANES) {
        vm lanes = vm_first(pt_lanes_left(x, rect[2]));
        vf z = vf_load(seen->z + x), color[4] = { empty, empty, empty, empty };
        vm some = vm_and(lanes, vf_lt(z, empty));
        if (vm_bits(some)) {
            for (uint32_t k = 0; k < 4; k++)
                color[k] = vf_load(around.row[1]->color[k] + x);
            if (finish->antialias && !pt_flat(seen, x))
                mix_edges(finish, &around, seen->limit, x, (uint32_t)y, some, color);
        }
        // keys of what was filled across a layer already taken stay: nothing reads them any more
        pt_peel_pixels(finish->peel, &finish->peeled, (size_t)y * width + x, lanes, some, z, color,
                       vf_load(walk->shown[slot(y)][3] + x), vf_load(seen->limit + x), &walk->tiles[x / PT_TILE]);
    }
    if (y % PT_TILE != PT_TILE - 1 && y != finish->end - 1)
        return;
    for (uint32_t tx = first; tx < last; tx++)
        finish->tiles[(size_t)(y / PT_TILE) * columns + tx] = pt_tile_end(&walk->tiles[tx]);
}

// ---- the walk ----------------------------------------------------------------------------------------------------------------

static void finish_rows(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct finish *finish = context;
    struct walk *walk = &finish->walks[thread];
    const int32_t reach = finish->reach, first = finish->base + (int32_t)(begin * UNIT);
    int32_t last = finish->base + (int32_t)(end * UNIT);
    last = last < finish->end ? last : finish->end;
    int32_t y = first;
    if (first != walk->next) { // not where this thread stopped: begin anew
        walk->first = first;
        y = first - 4 - 2 * reach;
    }
    for (; y < last; y++) { // y is finished when y + 2 + reach has been seen
        see(finish, walk, y + 2 + reach);
        find_flat(finish, walk, y + 1 + reach);
        if (y + 2 >= walk->first - 2)
            shade(finish, walk, y + 2);
        if (y + 1 >= walk->first - 1)
            smooth(finish, walk, y + 1);
        if (y >= walk->first && finish->peel)
            peel_row(finish, walk, y);
        else if (y >= walk->first)
            put_row(finish, walk, y);
    }
    walk->next = last;
}

int PT_KERNEL_ENTRY(finish)(const struct pt_cpu_pass *passes, uint32_t count)
{
    struct finish finish = { .shades = passes };
    const struct pt_cpu_call *shared = &passes[0].call;
    for (uint32_t i = 0; i < count; i++) {
        const struct pt_cpu_call *call = &passes[i].call;
        switch (passes[i].kernel) {
        case PT_KERNEL_shade:
            finish.shade_count++;
            finish.with_normals |= (int)((const struct shade_args *)call->arguments)->instance.lit;
            if (finish.reach < (int32_t)((const struct shade_args *)call->arguments)->blend)
                finish.reach = (int32_t)((const struct shade_args *)call->arguments)->blend;
            finish.planes.normals = pt_cpu_data(call, 2);
            finish.planes.deff = pt_cpu_data(call, 3);
            break;
        case PT_KERNEL_smooth: finish.smooth = call->arguments; break;
        case PT_KERNEL_antialias:
            finish.antialias = call->arguments;
            finish.through = finish.antialias->behind ? pt_cpu_data(call, 4) : NULL;
            finish.line = finish.antialias->inked ? pt_cpu_data(call, 5) : NULL;
            break;
        case PT_KERNEL_peel:
            finish.peel = call->arguments;
            finish.planes.keys = pt_cpu_data(call, 0);
            finish.planes.view = &finish.peel->view;
            finish.peeled = (struct pt_peeled){ pt_cpu_data(call, 5), pt_cpu_data(call, 6), pt_cpu_data(call, 7) };
            finish.tiles = pt_cpu_data(call, 8);
            finish.base = (int32_t)(finish.peel->view.rect[1] / PT_TILE * PT_TILE);
            finish.end = (int32_t)finish.peel->view.rect[3];
            break;
        case PT_KERNEL_compose:
            finish.compose = call->arguments;
            finish.planes.keys = pt_cpu_data(call, 0);
            finish.combined = pt_cpu_data(call, 2);
            finish.planes.view = &finish.compose->view;
            finish.base = (int32_t)finish.compose->crop_y;
            finish.end = finish.base + (int32_t)finish.compose->crop_height;
            break;
        default: // extract
            finish.extract = call->arguments;
            finish.with_normals |= (int)finish.extract->normal;
            finish.planes.from = pt_cpu_data(call, 1);
            finish.depth = pt_cpu_data(call, 3);
            finish.normals = pt_cpu_data(call, 4);
            finish.source = pt_cpu_data(call, 5);
            finish.shadow = pt_cpu_data(call, 7);
        }
    }
    if (finish.shade_count)
        finish.planes.from = pt_cpu_data(shared, 1);
    memcpy(finish.planes.rect, finish.planes.view->rect, sizeof finish.planes.rect);
    finish.channels = finish.peel ? 4 : 3;
    finish.stride = pt_row_stride(finish.planes.view->width);
    finish.ring = (uint32_t)(2 * finish.reach > finish.reach + 3 ? 2 * finish.reach : finish.reach + 3) + 1;
    finish.thread_floats = (finish.ring * CHANNELS_SEEN + RING * CHANNELS_COLOR + 3) * finish.stride;
    pt_blend_weights(finish.weights);
    uint32_t threads = pt_pool_threads(shared->pool);
    finish.memory = pt_cpu_scratch(shared, 0, threads * finish.thread_floats * sizeof(float));
    // sums of tiles behind the walks, on a cache line
    size_t columns = (finish.planes.view->width + PT_TILE - 1) / PT_TILE;
    size_t walks = (threads * sizeof *finish.walks + 63) / 64 * 64;
    finish.walks = pt_cpu_scratch(shared, 1, walks + threads * columns * sizeof(struct pt_tile_sum));
    if (!finish.memory || !finish.walks)
        return PATINA_ERROR_MEMORY;
    for (uint32_t i = 0; i < threads; i++) {
        lay_out(&finish, i, &finish.walks[i]);
        finish.walks[i].next = INT32_MIN;
        finish.walks[i].tiles = (struct pt_tile_sum *)(void *)((char *)finish.walks + walks) + i * columns;
    }
    if (finish.end > finish.base)
        pt_parallel(shared->pool, (uint32_t)(finish.end - finish.base + UNIT - 1) / UNIT, 1, finish_rows, &finish);
    return PATINA_OK;
}
