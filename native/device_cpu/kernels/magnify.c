// SPDX-License-Identifier: GPL-3.0-or-later
// magnify: faces between cells -> pixels of the picture that show them [K II.D]; twin of shaders/kernels/magnify.comp
#include "device_cpu/kernels/ranges.h"

enum { AROUND = 9 }; // cells that may be corners of a face over a pixel: 3 x 3, row by row

struct corners {
    vf x[AROUND], y[AROUND];      // from the pixel's centre, in cells
    vf z[AROUND], factor[AROUND]; // 1 / z, or 1 in orthographic views
    vm some[AROUND];
    vi cell[AROUND];
};

struct found {       // the nearest face
    vm some, loose;  // loose: it is none
    vf z, weight[3]; // not yet shares of their sum
    vi corner[3];    // of those around
};

struct walk {
    const struct pt_cpu_call *call;
    const struct magnify_args *args;
    const struct view_args *cells;
};

static void look_around(const struct walk *walk, vi x, uint32_t y, vm lanes, struct corners *out)
{
    const struct magnify_args *args = walk->args;
    const struct view_args *view = &args->view, *cells = walk->cells;
    const vf half = vf_set(0.5f), inverse = vf_set(args->inverse), one = vf_set(1.0f);
    const vf px = (vi_convert(vi_add(x, vi_set((uint32_t)view->origin_x))) + half) * inverse;
    const vf py = (vf_set((float)(view->origin_y + (int32_t)y)) + half) * inverse;
    const vf column = vf_floor(px), row = vf_floor(py), across = px - column, up = py - row;
    const vi cx = vi_sub(vf_int(column), vi_set((uint32_t)cells->origin_x)),
             cy = vi_sub(vf_int(row), vi_set((uint32_t)cells->origin_y));
    const float *places = PT_DATA(walk->call, magnify, place);
    for (int k = 0; k < AROUND; k++) {
        const int dx = k % 3 - 1, dy = k / 3 - 1;
        const vi ox = vi_add(cx, vi_set((uint32_t)dx)), oy = vi_add(cy, vi_set((uint32_t)dy));
        const vm inside = vm_and(lanes, pt_range_inside(cells, ox, oy));
        vf place[4];
        out->cell[k] = vi_add(vi_mul(oy, vi_set(cells->width)), ox);
        vf_gather4(places, out->cell[k], inside, place);
        out->some[k] = vm_and(inside, vf_lt(vf_zero(), place[3]));
        out->x[k] = (vf_set((float)dx) + place[0]) - across;
        out->y[k] = (vf_set((float)dy) + place[1]) - up;
        out->z[k] = vf_select(out->some[k], place[2], one);
        out->factor[k] = view->perspective ? vf_rcp(out->z[k]) : one;
    }
}

static inline vf lesser(vf a, vf b) { return vf_min(a, b); }

static vm all_there(const struct corners *c, const int k[3])
{
    return vm_and(vm_and(c->some[k[0]], c->some[k[1]]), c->some[k[2]]);
}

// Whether three corners are there and within a step.
static vm joined(const struct walk *walk, const struct corners *c, const int k[3])
{
    const vf nearest = lesser(lesser(c->z[k[0]], c->z[k[1]]), c->z[k[2]]);
    const vf farthest = vf_max(vf_max(c->z[k[0]], c->z[k[1]]), c->z[k[2]]);
    const vf step = pt_range_step(walk->cells, walk->args->gamma, walk->args->gamma_cells, nearest);
    return vm_and(all_there(c, k), vf_le(farthest - nearest, step));
}

// Twice the area between the pixel's centre and two corners: a swap turns its sign, exactly.
static inline vf edge(const struct corners *c, int a, int b) { return c->x[a] * c->y[b] - c->y[a] * c->x[b]; }

// Takes a triangle where it is nearer. edges: opposite each corner. apart: corners that are not joined to the farthest weigh nothing.
static void take(const struct walk *walk, const struct corners *c, const int k[3], const vf edges[3], vm used, int apart,
                 struct found *best)
{
    const vf zero = vf_zero();
    const vm left = vm_and(vm_and(vf_le(zero, edges[0]), vf_le(zero, edges[1])), vf_le(zero, edges[2]));
    const vm right = vm_and(vm_and(vf_le(edges[0], zero), vf_le(edges[1], zero)), vf_le(edges[2], zero));
    vm some = vm_and(used, vm_or(left, right));
    if (!vm_bits(some))
        return;
    const vf nearest = lesser(lesser(c->z[k[0]], c->z[k[1]]), c->z[k[2]]);
    const vf farthest = vf_max(vf_max(c->z[k[0]], c->z[k[1]]), c->z[k[2]]);
    vf weight[3];
    for (int i = 0; i < 3; i++) {
        weight[i] = vf_abs(edges[i]) * c->factor[k[i]];
        if (apart) {
            const vf step = pt_range_step(walk->cells, walk->args->gamma, walk->args->gamma_cells, c->z[k[i]]);
            weight[i] = vf_select(vf_le(farthest - c->z[k[i]], step), weight[i], zero);
        }
    }
    const vf sum = (weight[0] + weight[1]) + weight[2];
    some = vm_and(some, vf_lt(vf_set(1e-30f), sum));
    const vf share = vf_rcp(vf_select(some, sum, vf_set(1.0f)));
    vf z = ((weight[0] * c->z[k[0]] + weight[1] * c->z[k[1]]) + weight[2] * c->z[k[2]]) * share;
    z = vf_min(vf_max(z, nearest), farthest);
    some = vm_and(some, vf_lt(z, best->z));
    best->some = vm_or(best->some, some);
    best->z = vf_select(some, z, best->z);
    for (int i = 0; i < 3; i++) {
        best->weight[i] = vf_select(some, weight[i] * share, best->weight[i]);
        best->corner[i] = vi_select(some, vi_set((uint32_t)k[i]), best->corner[i]);
    }
}

// The faces between 2 x 2 cells, `a` the lower left one; apart: of `open` pixels, between cells that are not joined.
static void take_faces(const struct walk *walk, const struct corners *c, int a, vm open, int apart, struct found *best)
{
    const int b = a + 1, d = a + 3, e = a + 4; // a b below, d e above
    const int triples[4][3] = {{a, b, d}, {b, e, d}, {a, b, e}, {a, e, d}};
    vm fits[4], any = vm_of_bits(0);
    for (int t = 0; t < 4; t++) {
        fits[t] = joined(walk, c, triples[t]);
        if (apart)
            fits[t] = vm_and(all_there(c, triples[t]), vm_not(fits[t]));
        fits[t] = vm_and(fits[t], open);
        any = vm_or(any, fits[t]);
    }
    if (!vm_bits(any))
        return;
    const vf nearest = lesser(lesser(c->z[a], c->z[b]), lesser(c->z[d], c->z[e]));
    const vf farthest = vf_max(vf_max(c->z[a], c->z[b]), vf_max(c->z[d], c->z[e]));
    const vf step = pt_range_step(walk->cells, walk->args->gamma, walk->args->gamma_cells, nearest);
    const vm whole = vm_and(vm_and(vm_and(fits[0], fits[1]), vm_and(fits[2], fits[3])), vf_le(farthest - nearest, step));
    const vm falling = vf_le(vf_abs(c->z[b] - c->z[d]), vf_abs(c->z[a] - c->z[e])); // divided from b to d
    const vf ab = edge(c, a, b), be = edge(c, b, e), ed = edge(c, e, d), da = edge(c, d, a), bd = edge(c, b, d),
             ae = edge(c, a, e);
    const vf zero = vf_zero(), db = zero - bd, ea = zero - ae;
    const vf edges[4][3] = {{bd, da, ab}, {ed, db, be}, {be, ea, ab}, {ed, da, ae}};
    for (int t = 0; t < 4; t++) {
        const vm divided = t < 2 ? falling : vm_not(falling);
        take(walk, c, triples[t], edges[t], vm_and(fits[t], vm_or(vm_not(whole), divided)), apart, best);
    }
}

// Where no face is: the nearest cell whose place lies in the pixel.
static void take_places(const struct walk *walk, const struct corners *c, vm lanes, struct found *best)
{
    const vf half = vf_set(0.5f), minus = vf_set(-0.5f), pixel = vf_set(walk->args->pixel), one = vf_set(1.0f),
             zero = vf_zero();
    const vm open = vm_and(lanes, vm_not(best->some));
    if (!vm_bits(open))
        return;
    for (int k = 0; k < AROUND; k++) {
        const vf x = c->x[k] * pixel, y = c->y[k] * pixel;
        vm some = vm_and(vm_and(open, c->some[k]),
                         vm_and(vm_and(vf_le(minus, x), vf_lt(x, half)), vm_and(vf_le(minus, y), vf_lt(y, half))));
        some = vm_and(some, vf_lt(c->z[k], best->z));
        best->some = vm_or(best->some, some);
        best->z = vf_select(some, c->z[k], best->z);
        for (int i = 0; i < 3; i++) {
            best->weight[i] = vf_select(some, i ? zero : one, best->weight[i]);
            best->corner[i] = vi_select(some, vi_set((uint32_t)k), best->corner[i]);
        }
    }
}

// What of a corner stands in a row of nine.
static vf pick(const vf values[AROUND], vi which)
{
    vf out = values[0];
    for (uint32_t k = 1; k < AROUND; k++)
        out = vf_select(vi_eq(which, vi_set(k)), values[k], out);
    return out;
}

static vi pick_cell(const struct corners *c, vi which)
{
    vi out = c->cell[0];
    for (uint32_t k = 1; k < AROUND; k++)
        out = vi_select(vi_eq(which, vi_set(k)), c->cell[k], out);
    return out;
}

// Normal and colour between the corners.
static void mix(const struct walk *walk, const struct found *best, const vi cells[3], vm some, vf normal[4], vf color[4])
{
    const float *inclined = PT_DATA(walk->call, magnify, inclined), *merged = PT_DATA(walk->call, magnify, merged);
    vf first[4];
    for (int i = 0; i < 3; i++) {
        vf n[4], c[4];
        vf_gather4(inclined, cells[i], some, n);
        vf_gather4(merged, cells[i], some, c);
        for (int k = 0; k < 4; k++) {
            first[k] = i ? first[k] : n[k];
            normal[k] = i ? normal[k] + n[k] * best->weight[i] : n[k] * best->weight[i];
            color[k] = i ? color[k] + c[k] * best->weight[i] : c[k] * best->weight[i];
        }
    }
    const vf square = (normal[0] * normal[0] + normal[1] * normal[1]) + normal[2] * normal[2];
    const vm good = vf_lt(vf_set(1e-6f), square);
    const vf scale = vf_rsqrt(vf_select(good, square, vf_set(1.0f)));
    for (int k = 0; k < 3; k++)
        normal[k] = vf_select(good, normal[k] * scale, first[k]);
    color[3] = vf_min(color[3], vf_set(1.0f));
}

// Of the first of two passes: what is not sharp. cell: of the corner that weighs most.
static vm unsharp(const struct walk *walk, const struct found *best, vi cell, const vf ray[2])
{
    const struct magnify_args *args = walk->args;
    vf inclined[4], place[4];
    vf_gather4(PT_DATA(walk->call, magnify, inclined), cell, best->some, inclined);
    vf_gather4(PT_DATA(walk->call, magnify, place), cell, best->some, place);
    const vm grazed = vf_lt(vf_cosine(&args->view, inclined, ray), vf_set(args->cosine));
    const vm edge = vf_lt(inclined[3], vf_set(8.0f)), many = vf_lt(vf_set(args->most), place[3]);
    return vm_or(vm_or(grazed, edge), vm_or(many, best->loose));
}

// Of the second: what may take the place of what is there, whose marks are taken away.
static vm replaces(const struct walk *walk, size_t at, const struct found *best, vm lanes)
{
    const struct magnify_args *args = walk->args;
    const uint64_t *keys = (const uint64_t *)PT_DATA(walk->call, magnify, keys) + at;
    float *away = (float *)PT_DATA(walk->call, magnify, away) + at;
    const vf z = vi_float(vi_load_z(keys)), zero = vf_zero(), marks = vf_load(away);
    const vm own = vm_and(vm_and(lanes, vf_lt(z, vf_set(pt_float(PT_KEY_EMPTY_Z)))),
                          vi_lt_unsigned(vi_sub(vi_load_id(keys), vi_set(args->id_base)), vi_set(args->id_count)));
    const vm marked = vm_and(own, vf_lt(marks, zero));
    vf_store_where(away, vf_set(-1.0f) - marks, marked);
    const vf depth = vf_select(own, z, vf_set(1.0f));
    const vf step = pt_range_step(walk->cells, args->gamma, args->gamma_cells, depth);
    const vm nearer = vf_lt(best->z, depth - step), near = vf_le(best->z, depth + step);
    return vm_and(best->some, vm_or(vm_not(own), vm_or(nearer, vm_and(marked, near))));
}

static void show(const struct walk *walk, uint32_t x, uint32_t y, const struct corners *c, const struct found *best, vm lanes)
{
    const struct magnify_args *args = walk->args;
    const struct view_args *view = &args->view;
    const size_t at = (size_t)y * view->width + x;
    uint64_t *keys = (uint64_t *)PT_DATA(walk->call, magnify, keys) + at;
    const vf one = vf_set(1.0f), zero = vf_zero();
    // 1. the corner that weighs most, whose point the pixel is of
    vf most = best->weight[0], ray[2], normal[4], color[4];
    vi which = best->corner[0], cells[3];
    for (int i = 1; i < 3; i++) {
        const vm more = vf_lt(most, best->weight[i]);
        most = vf_select(more, best->weight[i], most);
        which = vi_select(more, best->corner[i], which);
    }
    const vi z = vf_bits(best->z), id = vi_gather_id(PT_DATA(walk->call, magnify, cells), pick_cell(c, which), best->some);
    // 2. before what is there
    vm some = vm_and(best->some, pt_less(z, id, vi_load_z(keys), vi_load_id(keys)));
    if (args->pass == PT_RANGE_FINE) {
        const vm own = vi_lt_unsigned(vi_sub(vi_load_id(keys), vi_set(args->id_base)), vi_set(args->id_count));
        some = vm_and(vm_or(some, own), replaces(walk, at, best, lanes));
    }
    if (args->behind)
        some = vm_and(some, vf_lt(vf_load((const float *)PT_DATA(walk->call, magnify, limit) + at), best->z));
    if (!vm_bits(some))
        return;
    // 3. what it shows
    for (int i = 0; i < 3; i++)
        cells[i] = pick_cell(c, best->corner[i]);
    mix(walk, best, cells, some, normal, color);
    vf_ray(view, x, y, ray);
    normal[3] = vf_rcp(vf_max(vf_cosine(view, normal, ray), vf_set(PT_COSINE_FLOOR)));
    const vf depth = vf_select(some, best->z, one);
    const vf thick = vf_max(pt_range_gamma(walk->cells, args->gamma, args->gamma_cells, depth),
                            vf_set(2.0f) * vf_footprint(walk->cells, depth));
    const vf distance = vf_distance_of(args->d_min, thick, vf_footprint(view, depth), depth, normal[3]);
    const vf pixel = vf_set(args->pixel), half = vf_set(0.5f), minus = vf_set(-0.5f);
    const vf dx = pick(c->x, which) * pixel, dy = pick(c->y, which) * pixel, square = dx * dx + dy * dy;
    const vm within = vm_and(vm_and(vf_le(minus, dx), vf_lt(dx, half)), vm_and(vf_le(minus, dy), vf_lt(dy, half)));
    vf away = vf_select(within, zero, square * vf_rsqrt(vf_max(square, vf_set(1e-12f))));
    if (args->pass == PT_RANGE_COARSE)
        away = vf_select(unsharp(walk, best, pick_cell(c, which), ray), vf_set(-1.0f) - away, away);
    const vi own = vi_add(vi_set((uint32_t)at), vi_lanes());
    vi_store_keys(keys, z, id, vm_bits(some));
    vi_store_where((uint32_t *)PT_DATA(walk->call, magnify, from) + at, own, some);
    vf_store4((float *)PT_DATA(walk->call, magnify, normal) + 4 * at, normal, vm_bits(some));
    vf_store4((float *)PT_DATA(walk->call, magnify, albedo) + 4 * at, color, vm_bits(some));
    vf_store_where((float *)PT_DATA(walk->call, magnify, deff) + at, distance, some);
    vf_store_where((float *)PT_DATA(walk->call, magnify, away) + at, away, some);
    if (args->with_span)
        vf_store_where((float *)PT_DATA(walk->call, magnify, span) + at, distance, some);
    if (args->with_apart) {
        const vi cell = pick_cell(c, which);
        const vf apart = vf_gather(PT_DATA(walk->call, magnify, most), cell, some) -
                         vf_gather(PT_DATA(walk->call, magnify, least), cell, some);
        vf_store_where((float *)PT_DATA(walk->call, magnify, apart) + at, vf_max(apart, zero), some);
    }
}

static void magnify_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct magnify_args *args = call->arguments;
    const struct walk walk = {call, args, &args->cells};
    const uint32_t *rect = args->view.rect;
    for (uint32_t x = rect[0]; x < rect[2]; x += PT_LANES) {
        const vm lanes = vm_first(pt_lanes_left(x, rect[2]));
        struct found best = {.some = vm_of_bits(0), .loose = vm_of_bits(0), .z = vf_set(pt_float(PT_KEY_EMPTY_Z))};
        struct corners corners;
        uint32_t any = 0;
        look_around(&walk, vi_add(vi_set(x), vi_lanes()), y, lanes, &corners);
        for (int k = 0; k < AROUND; k++)
            any |= vm_bits(corners.some[k]);
        if (!any && args->pass != PT_RANGE_FINE)
            continue;
        for (int i = 0; i < 3; i++) {
            best.weight[i] = vf_zero();
            best.corner[i] = vi_set(0);
        }
        for (int k = 0; k < 4; k++)
            take_faces(&walk, &corners, k % 2 + 3 * (k / 2), lanes, 0, &best);
        const vm faces = best.some;
        if (args->pass != PT_RANGE_FINE)
            take_places(&walk, &corners, lanes, &best);
        const vm open = vm_and(lanes, vm_not(best.some));
        for (int k = 0; k < 4 && vm_bits(open); k++)
            take_faces(&walk, &corners, k % 2 + 3 * (k / 2), open, 1, &best);
        best.loose = vm_not(faces);
        if (vm_bits(best.some) || args->pass == PT_RANGE_FINE)
            show(&walk, x, y, &corners, &best, lanes);
    }
}

int PT_KERNEL_ENTRY(magnify)(const struct pt_cpu_call *call)
{
    const struct magnify_args *args = call->arguments;
    return pt_rows(call, &args->view, magnify_row);
}
