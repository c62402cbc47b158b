// SPDX-License-Identifier: GPL-3.0-or-later
// magnify: faces between cells -> pixels of the picture that show them [K II.D]; twin of shaders/kernels/magnify.comp
//
// The twin looks from each pixel at the 3 x 3 cells around. Here a row of pixels is walked face by face, from those below to those above, left to
// right, so that each pixel meets its faces in the same order: what cells say is then one number for all lanes, and what two passes over a face
// would find anew is found once a cell. Pixels that no face covers look around as the twin does.
#include "device_cpu/kernels/ranges.h"
#include "shared/ranges.h"

#include <math.h>

enum { AROUND = 9 }; // cells that may be corners of a face over a pixel: 3 x 3, row by row

struct corners {
    vf x[AROUND], y[AROUND];      // from the pixel's centre, in cells
    vf z[AROUND], factor[AROUND]; // 1 / z, or 1 in orthographic views
    vm some[AROUND];
    vi cell[AROUND];
};

struct found {       // the nearest face
    vm some, loose;  // loose: it is none
    vf z, weight[3]; // shares
    vi cell[3];      // of its corners
};

// Of the faces between a cell, the lower left one, and those right of it, above and across.
enum {
    FITS = 1,
    WHOLE = 1 << 4,
    FALLING = 1 << 5,
    THERE = 1 << 6
}; // FITS << triangle; FALLING: divided from right to above; THERE: the cell

// The four triangles: a b below, d e above.
static const int triples[4][3] = {{0, 1, 2}, {1, 3, 2}, {0, 1, 3}, {0, 3, 2}};

struct row { // of pixels, a thread's
    float *z, *weight[3];
    uint32_t *cell[3];
};

struct walk {
    const struct pt_cpu_call *call;
    const struct magnify_args *args;
    const struct view_args *cells;
    const float *places;
    const uint8_t *faces;   // a byte a cell
    const float *across;    // of each column of pixels: where in its cell
    const uint32_t *column; // and which cell
    const uint32_t *first;  // of each column of cells, and two behind: the first column of pixels
    char *memory;           // of rows, per thread
    size_t thread_bytes;
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

// Takes a triangle that is not joined where it is nearer. edges: opposite each corner. Corners that are not joined to the farthest weigh
// nothing.
static void take(const struct walk *walk, const struct corners *c, const int k[3], const vf edges[3], vm used,
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
        const vf step = pt_range_step(walk->cells, walk->args->gamma, walk->args->gamma_cells, c->z[k[i]]);
        weight[i] = vf_select(vf_le(farthest - c->z[k[i]], step), vf_abs(edges[i]) * c->factor[k[i]], zero);
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
        best->cell[i] = vi_select(some, c->cell[k[i]], best->cell[i]);
    }
}

// Of `open` pixels the triangles between 2 x 2 cells, `a` the lower left one, that are not joined.
static void take_loose(const struct walk *walk, const struct corners *c, int a, vm open, struct found *best)
{
    const int b = a + 1, d = a + 3, e = a + 4;
    const int corners[4][3] = {{a, b, d}, {b, e, d}, {a, b, e}, {a, e, d}};
    vm fits[4], any = vm_of_bits(0);
    for (int t = 0; t < 4; t++) {
        fits[t] = vm_and(vm_and(all_there(c, corners[t]), vm_not(joined(walk, c, corners[t]))), open);
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
        take(walk, c, corners[t], edges[t], vm_and(fits[t], vm_or(vm_not(whole), divided)), best);
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
            best->cell[i] = vi_select(some, c->cell[k], best->cell[i]);
        }
    }
}

// ---- faces -------------------------------------------------------------------------------------------------------------------------

static inline float lesser_of(float a, float b) { return a < b ? a : b; }
static inline float greater_of(float a, float b) { return a > b ? a : b; }

// As pt_range_step has it.
static float step_from(const struct walk *walk, float z)
{
    const struct view_args *cells = walk->cells;
    const float width = cells->footprint * (float)(1u << cells->level), footprint = cells->perspective ? width * z : width;
    const float gamma = greater_of(walk->args->gamma, walk->args->gamma_cells * footprint);
    return greater_of(gamma, PT_RANGE_STEEP * footprint);
}

static uint32_t look_at(const struct walk *walk, const float *const corner[4])
{
    uint32_t found = 0.0f < corner[0][3] ? THERE : 0;
    for (int t = 0; t < 4; t++) {
        const float *const p = corner[triples[t][0]], *const q = corner[triples[t][1]], *const r = corner[triples[t][2]];
        if (!(0.0f < p[3]) || !(0.0f < q[3]) || !(0.0f < r[3]))
            continue;
        const float nearest = lesser_of(lesser_of(p[2], q[2]), r[2]), farthest = greater_of(greater_of(p[2], q[2]), r[2]);
        found |= farthest - nearest <= step_from(walk, nearest) ? (uint32_t)FITS << t : 0;
    }
    if ((found & 15u * FITS) != 15u * FITS)
        return found;
    const float nearest = lesser_of(lesser_of(corner[0][2], corner[1][2]), lesser_of(corner[2][2], corner[3][2]));
    const float farthest = greater_of(greater_of(corner[0][2], corner[1][2]), greater_of(corner[2][2], corner[3][2]));
    found |= farthest - nearest <= step_from(walk, nearest) ? WHOLE : 0;
    return found | (fabsf(corner[1][2] - corner[2][2]) <= fabsf(corner[0][2] - corner[3][2]) ? FALLING : 0);
}

// The bytes of a row of cells.
static void look_at_cells(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    static const float none[4] = {0};
    const struct walk *walk = context;
    const uint32_t *rect = walk->cells->rect, width = walk->cells->width;
    (void)thread;
    for (uint32_t y = begin + rect[1]; y < end + rect[1]; y++)
        for (uint32_t x = rect[0]; x < rect[2]; x++) {
            const size_t at = (size_t)y * width + x;
            const float *place = walk->places + 4 * at;
            const int right = x + 1 < rect[2], above = y + 1 < rect[3];
            const float *const corner[4] = {place, right ? place + 4 : none, above ? place + 4 * (size_t)width : none,
                                            right && above ? place + 4 * (size_t)width + 4 : none};
            ((uint8_t *)walk->faces)[at] = (uint8_t)look_at(walk, corner);
        }
}

// Takes one where it is nearer, of the pixels from x on. edges: opposite each corner.
static inline void take_face(const struct row *row, uint32_t x, vm lanes, const vf edges[3], const float z[3],
                             const vf factor[3], const uint32_t cells[3])
{
    const vf zero = vf_zero();
    const vm left = vm_and(vm_and(vf_le(zero, edges[0]), vf_le(zero, edges[1])), vf_le(zero, edges[2]));
    const vm right = vm_and(vm_and(vf_le(edges[0], zero), vf_le(edges[1], zero)), vf_le(edges[2], zero));
    vm some = vm_and(lanes, vm_or(left, right));
    if (!vm_bits(some))
        return;
    vf weight[3];
    for (int i = 0; i < 3; i++)
        weight[i] = vf_abs(edges[i]) * factor[i];
    const vf sum = (weight[0] + weight[1]) + weight[2];
    some = vm_and(some, vf_lt(vf_set(1e-30f), sum));
    const vf share = vf_rcp(vf_select(some, sum, vf_set(1.0f))), best = vf_load(row->z + x);
    vf depth = ((weight[0] * vf_set(z[0]) + weight[1] * vf_set(z[1])) + weight[2] * vf_set(z[2])) * share;
    depth = vf_min(vf_max(depth, vf_set(lesser_of(lesser_of(z[0], z[1]), z[2]))),
                   vf_set(greater_of(greater_of(z[0], z[1]), z[2])));
    some = vm_and(some, vf_lt(depth, best));
    vf_store(row->z + x, vf_select(some, depth, best));
    for (int i = 0; i < 3; i++) {
        vf_store(row->weight[i] + x, vf_select(some, weight[i] * share, vf_load(row->weight[i] + x)));
        vi_store(row->cell[i] + x, vi_select(some, vi_set(cells[i]), vi_load(row->cell[i] + x)));
    }
}

// The faces above and right of a cell, in the row of pixels: those of pixels whose cell is in its column or the next. y: of its corners,
// from the pixels' centres, in cells.
static void take_cell(const struct walk *walk, const struct row *row, uint32_t column, size_t at, const float y[4])
{
    const uint32_t faces = walk->faces[at], *rect = walk->args->view.rect, width = walk->cells->width;
    const uint32_t cell[4] = {(uint32_t)at, (uint32_t)at + 1, (uint32_t)at + width, (uint32_t)at + width + 1};
    const uint32_t begin = walk->first[column] > rect[0] ? walk->first[column] : rect[0],
                   end = walk->first[column + 2] < rect[2] ? walk->first[column + 2] : rect[2];
    uint32_t taken = faces & 15u * FITS;
    if (faces & WHOLE)
        taken &= (faces & FALLING ? 3u : 12u) * FITS;
    const vf zero = vf_zero(), one = vf_set(1.0f);
    vf factor[4], py[4];
    for (int k = 0; k < 4; k++) {
        factor[k] = walk->args->view.perspective ? vf_rcp(vf_set(walk->places[4 * (size_t)cell[k] + 2])) : one;
        py[k] = vf_set(y[k]);
    }
    for (uint32_t x = begin; x < end; x += PT_LANES) {
        const vm lanes = vm_first(pt_lanes_left(x, end));
        const vf across = vf_load(walk->across + x), own = vi_convert(vi_sub(vi_set(column), vi_load(walk->column + x))),
                 from[2] = {own, own + one};
        vf px[4];
        for (int k = 0; k < 4; k++)
            px[k] = (from[k & 1] + vf_set(walk->places[4 * (size_t)cell[k]])) - across;
        const vf ab = px[0] * py[1] - py[0] * px[1], be = px[1] * py[3] - py[1] * px[3], ed = px[3] * py[2] - py[3] * px[2],
                 da = px[2] * py[0] - py[2] * px[0], bd = px[1] * py[2] - py[1] * px[2], ae = px[0] * py[3] - py[0] * px[3];
        const vf db = zero - bd, ea = zero - ae;
        const vf edges[4][3] = {{bd, da, ab}, {ed, db, be}, {be, ea, ab}, {ed, da, ae}};
        for (int t = 0; t < 4; t++) {
            if (!(taken & (uint32_t)FITS << t))
                continue;
            float z[3];
            vf factors[3];
            uint32_t cells[3];
            for (int i = 0; i < 3; i++) {
                cells[i] = cell[triples[t][i]];
                z[i] = walk->places[4 * (size_t)cells[i] + 2];
                factors[i] = factor[triples[t][i]];
            }
            take_face(row, x, lanes, edges[t], z, factors, cells);
        }
    }
}

// All faces over a row of pixels, whose cells are in the row `cy` of cells; up: where in them.
static void take_row(const struct walk *walk, const struct row *row, uint32_t cy, float up)
{
    const uint32_t *rect = walk->args->view.rect, *cells = walk->cells->rect;
    const uint32_t left = walk->column[rect[0]] - 1, right = walk->column[rect[2] - 1];
    for (uint32_t x = rect[0]; x < rect[2]; x += PT_LANES) {
        vf_store(row->z + x, vf_set(pt_float(PT_KEY_EMPTY_Z)));
        for (int i = 0; i < 3; i++) {
            vf_store(row->weight[i] + x, vf_zero());
            vi_store(row->cell[i] + x, vi_set(0));
        }
    }
    for (int k = 0; k < 2; k++) {
        const uint32_t j = cy - 1 + (uint32_t)k;
        if ((int32_t)j < (int32_t)cells[1] || (int32_t)j + 1 >= (int32_t)cells[3])
            continue;
        const uint32_t begin = (int32_t)left < (int32_t)cells[0] ? cells[0] : left;
        for (uint32_t i = begin; i <= right && i + 1 < cells[2]; i++) {
            const size_t at = (size_t)j * walk->cells->width + i;
            if (!(walk->faces[at] & 15u * FITS))
                continue;
            const float *place = walk->places + 4 * at, *over = place + 4 * (size_t)walk->cells->width;
            const float below = (float)(k - 1), above = (float)k;
            const float y[4] = {(below + place[1]) - up, (below + place[5]) - up, (above + over[1]) - up,
                                (above + over[5]) - up};
            take_cell(walk, row, i, at, y);
        }
    }
}

// Whether there is a cell around those of `count` pixels.
static int is_near(const struct walk *walk, uint32_t x, uint32_t count, uint32_t cy)
{
    const uint32_t *cells = walk->cells->rect;
    const int32_t left = (int32_t)walk->column[x] - 1, right = (int32_t)walk->column[x + count - 1] + 1;
    for (int32_t j = (int32_t)cy - 1; j <= (int32_t)cy + 1; j++)
        for (int32_t i = left < (int32_t)cells[0] ? (int32_t)cells[0] : left; i <= right && i < (int32_t)cells[2]; i++)
            if (j >= (int32_t)cells[1] && j < (int32_t)cells[3] &&
                walk->faces[(size_t)j * walk->cells->width + (size_t)i] & THERE)
                return 1;
    return 0;
}

// ---- pixels ------------------------------------------------------------------------------------------------------------------------

// Where the place of a cell of the 3 x 3 around lies from the pixels' centres, in pixels.
static void way_to(const struct walk *walk, vi cell, uint32_t x, uint32_t cy, float up, vm lanes, vf way[2])
{
    const uint32_t width = walk->cells->width;
    const vf one = vf_set(1.0f), pixel = vf_set(walk->args->pixel);
    const vi own = vi_add(vi_set((cy - 1) * width), vi_sub(vi_load(walk->column + x), vi_set(1))); // the lower left one
    vi from = vi_sub(cell, own), row = vi_set(0);
    for (int k = 0; k < 2; k++) {
        const vm higher = vm_not(vi_lt_unsigned(from, vi_set(width)));
        from = vi_select(higher, vi_sub(from, vi_set(width)), from);
        row = vi_select(higher, vi_add(row, vi_set(1)), row);
    }
    vf place[4];
    vf_gather4(walk->places, cell, lanes, place);
    way[0] = (((vi_convert(from) - one) + place[0]) - vf_load(walk->across + x)) * pixel;
    way[1] = (((vi_convert(row) - one) + place[1]) - vf_set(up)) * pixel;
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

static void show(const struct walk *walk, uint32_t x, uint32_t y, uint32_t cy, float up, const struct found *best, vm lanes)
{
    const struct magnify_args *args = walk->args;
    const struct view_args *view = &args->view;
    const size_t at = (size_t)y * view->width + x;
    uint64_t *keys = (uint64_t *)PT_DATA(walk->call, magnify, keys) + at;
    const vf one = vf_set(1.0f), zero = vf_zero();
    // 1. the corner that weighs most, whose point the pixel is of
    vf most = best->weight[0], ray[2], normal[4], color[4], way[2];
    vi which = best->cell[0];
    for (int i = 1; i < 3; i++) {
        const vm more = vf_lt(most, best->weight[i]);
        most = vf_select(more, best->weight[i], most);
        which = vi_select(more, best->cell[i], which);
    }
    const vi z = vf_bits(best->z), id = vi_gather_id(PT_DATA(walk->call, magnify, cells), which, best->some);
    // 2. before what is there
    vm some = vm_and(best->some, pt_less(z, id, vi_load_z(keys), vi_load_id(keys)));
    if (args->pass & PT_RANGE_FINE) {
        const vm own = vi_lt_unsigned(vi_sub(vi_load_id(keys), vi_set(args->id_base)), vi_set(args->id_count));
        some = vm_and(vm_or(some, own), replaces(walk, at, best, lanes));
    }
    if (args->behind)
        some = vm_and(some, vf_lt(vf_load((const float *)PT_DATA(walk->call, magnify, limit) + at), best->z));
    if (!vm_bits(some))
        return;
    // 3. what it shows
    mix(walk, best, best->cell, some, normal, color);
    vf_ray(view, x, y, ray);
    normal[3] = vf_rcp(vf_max(vf_cosine(view, normal, ray), vf_set(PT_COSINE_FLOOR)));
    const vf depth = vf_select(some, best->z, one);
    const vf thick = vf_max(pt_range_gamma(walk->cells, args->gamma, args->gamma_cells, depth),
                            vf_set(2.0f) * vf_footprint(walk->cells, depth));
    const vf distance = vf_distance_of(args->d_min, thick, vf_footprint(view, depth), depth, normal[3]);
    const vf half = vf_set(0.5f), minus = vf_set(-0.5f);
    way_to(walk, which, x, cy, up, some, way);
    const vf dx = way[0], dy = way[1], square = dx * dx + dy * dy;
    const vm within = vm_and(vm_and(vf_le(minus, dx), vf_lt(dx, half)), vm_and(vf_le(minus, dy), vf_lt(dy, half)));
    vf away = vf_select(within, zero, square * vf_rsqrt(vf_max(square, vf_set(1e-12f))));
    if (args->pass & PT_RANGE_COARSE)
        away = vf_select(unsharp(walk, best, which, ray), vf_set(-1.0f) - away, away);
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
        const vf apart = vf_gather(PT_DATA(walk->call, magnify, most), which, some) -
                         vf_gather(PT_DATA(walk->call, magnify, least), which, some);
        vf_store_where((float *)PT_DATA(walk->call, magnify, apart) + at, vf_max(apart, zero), some);
    }
}

static void magnify_row(const struct walk *walk, const struct row *row, uint32_t y)
{
    const struct magnify_args *args = walk->args;
    const uint32_t *rect = args->view.rect;
    const float py = ((float)(args->view.origin_y + (int32_t)y) + 0.5f) * args->inverse, up = py - floorf(py);
    const uint32_t cy = (uint32_t)((int32_t)floorf(py) - walk->cells->origin_y);
    take_row(walk, row, cy, up);
    for (uint32_t x = rect[0]; x < rect[2]; x += PT_LANES) {
        const uint32_t count = pt_lanes_left(x, rect[2]);
        const vm lanes = vm_first(count);
        struct found best = {.z = vf_load(row->z + x)};
        for (int i = 0; i < 3; i++) {
            best.weight[i] = vf_load(row->weight[i] + x);
            best.cell[i] = vi_load(row->cell[i] + x);
        }
        const vm faces = best.some = vm_and(lanes, vf_lt(best.z, vf_set(pt_float(PT_KEY_EMPTY_Z))));
        best.loose = vm_not(faces);
        if (vm_bits(vm_and(lanes, best.loose)) && is_near(walk, x, count, cy)) {
            struct corners corners;
            look_around(walk, vi_add(vi_set(x), vi_lanes()), y, lanes, &corners);
            if (!(args->pass & PT_RANGE_FINE))
                take_places(walk, &corners, lanes, &best);
            const vm open = vm_and(lanes, vm_not(best.some));
            for (int k = 0; k < 4 && vm_bits(open); k++)
                take_loose(walk, &corners, k % 2 + 3 * (k / 2), open, &best);
        }
        if (vm_bits(best.some) || args->pass & PT_RANGE_FINE)
            show(walk, x, y, cy, up, &best, lanes);
    }
}

static void magnify_rows(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct walk *walk = context;
    const size_t values = walk->thread_bytes / 7 / sizeof(float);
    float *memory = (float *)(void *)(walk->memory + thread * walk->thread_bytes);
    struct row row = {.z = memory};
    for (uint32_t i = 0; i < 3; i++) {
        row.weight[i] = memory + (1 + i) * values;
        row.cell[i] = (uint32_t *)(void *)(memory + (4 + i) * values);
    }
    for (uint32_t y = begin; y < end && !pt_cpu_cancelled(walk->call); y++)
        magnify_row(walk, &row, y + walk->args->view.rect[1]);
}

// Which cells the columns of pixels lie in.
static void place_columns(const struct walk *walk, float *across, uint32_t *column, uint32_t *first)
{
    const struct view_args *view = &walk->args->view;
    const vf half = vf_set(0.5f), inverse = vf_set(walk->args->inverse);
    for (uint32_t x = 0; x < view->width; x += PT_LANES) {
        const vf px = (vi_convert(vi_add(vi_add(vi_set(x), vi_lanes()), vi_set((uint32_t)view->origin_x))) + half) * inverse;
        const vf floor = vf_floor(px);
        vf_store(across + x, px - floor);
        vi_store(column + x, vi_sub(vf_int(floor), vi_set((uint32_t)walk->cells->origin_x)));
    }
    uint32_t x = 0;
    for (uint32_t c = 0; c < walk->cells->width + 2; c++) {
        while (x < view->width && (int32_t)column[x] < (int32_t)c)
            x++;
        first[c] = x;
    }
}

int PT_KERNEL_ENTRY(magnify)(const struct pt_cpu_call *call)
{
    const struct magnify_args *args = call->arguments;
    const uint32_t *rect = args->view.rect, *cells = args->cells.rect;
    struct walk walk = {.call = call, .args = args, .cells = &args->cells, .places = PT_DATA(call, magnify, place)};
    if (rect[0] >= rect[2] || rect[1] >= rect[3])
        return PATINA_OK;
    const size_t row = ((size_t)args->view.width + 2 * PT_LANES + 15) / 16 * 16, columns = (size_t)args->cells.width + 2,
                 faces = ((size_t)args->cells.width * args->cells.height + 63) / 64 * 64;
    walk.thread_bytes = 7 * row * sizeof(float);
    char *memory = pt_cpu_scratch(call, 0, pt_pool_threads(call->pool) * walk.thread_bytes + (2 * row + columns) * 4 + faces);
    if (!memory)
        return PATINA_ERROR_MEMORY;
    float *across = (float *)(void *)(memory + pt_pool_threads(call->pool) * walk.thread_bytes);
    uint32_t *column = (uint32_t *)(void *)(across + row), *first = column + row;
    walk.memory = memory;
    walk.across = across;
    walk.column = column;
    walk.first = first;
    walk.faces = (uint8_t *)(first + columns);
    place_columns(&walk, across, column, first);
    if (cells[0] < cells[2] && cells[1] < cells[3])
        pt_parallel(call->pool, cells[3] - cells[1], 16, look_at_cells, &walk);
    pt_parallel(call->pool, rect[3] - rect[1], 8, magnify_rows, &walk);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
