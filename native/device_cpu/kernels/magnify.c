// SPDX-License-Identifier: GPL-3.0-or-later
// magnify: faces between cells -> pixels of the picture that show them [K II.D]; twin of shaders/kernels/magnify.comp
//
// The twin looks from each pixel at the 3 x 3 cells around. Here PT_LANES pixels do, and what cells say is found once: of each row of cells, in
// vectors of cells, their numbers and how the faces above and right of them are divided; of the pixels of several rows that lie in one row of
// cells, whatever does not depend on their row. Which face covers a pixel is asked of two triangles between 2 x 2 cells; what it is like
// there, of the one that does alone. Face by face along each row of pixels took half as long again.
#include "device_cpu/kernels/ranges.h"
#include "device_cpu/simd/near.h"
#include "shared/ranges.h"

#include <math.h>

// AROUND: cells that may be corners of a face over a pixel: 3 x 3, row by row. QUADS: of them, what lies between 2 x 2.
enum { AROUND = 9, QUADS = 4, PAD = 2, BATCH = 16 }; // PAD: cells left and right of a row's; BATCH: rows of pixels

struct corners {                  // of PT_LANES pixels
    vf x[AROUND], y[AROUND];      // from the pixel's centre, in cells
    vf z[AROUND], factor[AROUND]; // 1 / z, or 1 in orthographic views
    vm some[AROUND];
    vi cell[AROUND];
    vf height[AROUND]; // of the place over the pixels' row of cells; y is that less where in it the pixels lie
    vi quad[QUADS];    // words of what lies between
    uint32_t all;      // bits that some of them have
    vm falling[QUADS];
    // of whole ones: the ends of what divides them, the lower triangle's third corner and the upper one's first
    vf end_x[QUADS][2], end_height[QUADS][2], end_z[QUADS][2], end_factor[QUADS][2];
    vi end_cell[QUADS][2];
};

struct found {       // the nearest face
    vm some, loose;  // loose: it is none
    vf z, weight[3]; // shares
    vi cell[3];      // of its corners
};

struct face { // that covers pixels
    vm some;
    vf edge[3], z[3], factor[3]; // edge: twice the area opposite each corner
    vi cell[3];
};

// A word of the faces between a cell, the lower left one, and those right of it, above and across.
enum {
    FITS = 1,         // << triangle
    WHOLE = 1 << 4,   // all fit: two are taken
    FALLING = 1 << 5, // those divided from right to above
    LOOSE = 1 << 6,   // three are there that are not joined
    ODD = 1 << 7      // some fit, and are taken
};

// The four triangles: a b below, d e above.
static const int triples[4][3] = {{0, 1, 2}, {1, 3, 2}, {0, 1, 3}, {0, 3, 2}};

struct cell_row {       // of cells, number PAD + column
    int32_t y, divided; // whose; the same where `quads` holds
    float *x, *y_of, *z, *factor;
    float *least; // of finer ones: the z of the nearest, of a cell, the one before and the one behind
    uint32_t *there, *quads;
};

struct walk {
    const struct pt_cpu_call *call;
    const struct magnify_args *args;
    const struct view_args *cells;
    const float *places;
    const float *across;    // of each column of pixels: where in its cell
    const uint32_t *column; // and which cell
    char *memory;           // of rows of cells, per thread
    size_t thread_bytes, row_values;
};

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

// ---- rows of cells -----------------------------------------------------------------------------------------------------------------

// What is there of the row y, in columns from `left` to before `right`.
static void read_cells(const struct walk *walk, struct cell_row *row, int32_t y, int32_t left, int32_t right)
{
    const struct view_args *cells = walk->cells;
    const int here = y >= (int32_t)cells->rect[1] && y < (int32_t)cells->rect[3];
    const vf zero = vf_zero(), one = vf_set(1.0f);
    row->y = y;
    row->divided = INT32_MIN;
    for (int32_t x = left; x < right; x += PT_LANES) {
        const vi column = vi_add(vi_set((uint32_t)x), vi_lanes());
        const vm inside = here ? pt_range_inside(cells, column, vi_set((uint32_t)y)) : vm_of_bits(0);
        const int32_t at = y * (int32_t)cells->width + x;
        vf place[4] = {zero, zero, zero, zero};
        if (vm_bits(inside) == PT_ALL)
            vf_load4(walk->places + 4 * (ptrdiff_t)at, place);
        else if (vm_bits(inside))
            vf_gather4(walk->places, vi_add(vi_set((uint32_t)at), vi_lanes()), inside, place);
        const vm some = vm_and(inside, vf_lt(zero, place[3]));
        const vf z = vf_select(some, place[2], one);
        vf_store(row->x + PAD + x, place[0]);
        vf_store(row->y_of + PAD + x, place[1]);
        vf_store(row->z + PAD + x, z);
        vf_store(row->factor + PAD + x, walk->args->view.perspective ? vf_rcp(z) : one);
        vi_store(row->there + PAD + x, vi_select(some, vi_set(1), vi_set(0)));
    }
}

static vm is_there(const uint32_t *there) { return vi_eq(vi_load(there), vi_set(1)); }

// The nearest of three in a row.
static void find_nearest(struct cell_row *row, int32_t left, int32_t right)
{
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z));
    for (int32_t x = left + PAD; x + 2 < right + PAD; x += PT_LANES) {
        vf least = empty;
        for (int k = 0; k < 3; k++)
            least = vf_min(vf_select(is_there(row->there + x + k), vf_load(row->z + x + k), empty), least);
        vf_store(row->least + x + 1, least);
    }
}

static vi bit_where(vm some, uint32_t bit) { return vi_select(some, vi_set(bit), vi_set(0)); }

// How PT_LANES faces are divided, from their corners.
static vi divided(const struct walk *walk, const vf z[4], const vm there[4])
{
    const struct magnify_args *args = walk->args;
    vm all = vm_first(PT_LANES), any = vm_of_bits(0), loose = any;
    vi word = vi_set(0);
    for (int t = 0; t < 4; t++) {
        const int *k = triples[t];
        const vm three = vm_and(vm_and(there[k[0]], there[k[1]]), there[k[2]]);
        const vf nearest = lesser(lesser(z[k[0]], z[k[1]]), z[k[2]]), farthest = vf_max(vf_max(z[k[0]], z[k[1]]), z[k[2]]);
        const vm joint = vf_le(farthest - nearest, pt_range_step(walk->cells, args->gamma, args->gamma_cells, nearest));
        const vm fit = vm_and(three, joint);
        word = vi_or(word, bit_where(fit, (uint32_t)FITS << t));
        all = vm_and(all, fit);
        any = vm_or(any, fit);
        loose = vm_or(loose, vm_and(three, vm_not(joint)));
    }
    const vf nearest = lesser(lesser(z[0], z[1]), lesser(z[2], z[3])),
             farthest = vf_max(vf_max(z[0], z[1]), vf_max(z[2], z[3]));
    const vm whole = vm_and(all,
                            vf_le(farthest - nearest, pt_range_step(walk->cells, args->gamma, args->gamma_cells, nearest)));
    const vm falling = vm_and(whole, vf_le(vf_abs(z[1] - z[2]), vf_abs(z[0] - z[3])));
    word = vi_or(word, vi_or(bit_where(whole, WHOLE), bit_where(falling, FALLING)));
    return vi_or(word, vi_or(bit_where(loose, LOOSE), bit_where(vm_and(any, vm_not(whole)), ODD)));
}

static void divide(const struct walk *walk, struct cell_row *row, const struct cell_row *above, int32_t left, int32_t right)
{
    row->divided = row->y;
    for (int32_t x = left + PAD; x + 1 < right + PAD; x += PT_LANES) {
        const vf z[4] = {vf_load(row->z + x), vf_load(row->z + x + 1), vf_load(above->z + x), vf_load(above->z + x + 1)};
        const vm there[4] = {is_there(row->there + x), is_there(row->there + x + 1), is_there(above->there + x),
                             is_there(above->there + x + 1)};
        vi_store(row->quads + x, divided(walk, z, there));
    }
}

// Rows of cells around the row `cy`, of which three lie in `rows`, by their number.
static void hold(const struct walk *walk, struct cell_row rows[3], int32_t cy, struct cell_row *around[3])
{
    const uint32_t *rect = walk->args->view.rect;
    const int32_t left = (int32_t)walk->column[rect[0]] - 1, right = (int32_t)walk->column[rect[2] - 1] + 2;
    for (int32_t k = 0; k < 3; k++) {
        around[k] = &rows[(uint32_t)(cy + 2 + k) % 3];
        if (around[k]->y == cy - 1 + k)
            continue;
        read_cells(walk, around[k], cy - 1 + k, left, right);
        if (walk->args->pass & PT_RANGE_FINE)
            find_nearest(around[k], left, right);
    }
    for (int k = 0; k < 2; k++)
        if (around[k]->divided != around[k]->y)
            divide(walk, around[k], around[k + 1], left, right);
}

// ---- faces -------------------------------------------------------------------------------------------------------------------------

static inline __attribute__((always_inline)) vi pick(const void *row, vi at, int near)
{
    return near ? vi_near(row, at) : vi_gather(row, at, vm_first(PT_LANES));
}
static inline __attribute__((always_inline)) vf pick_float(const float *row, vi at, int near)
{
    return vi_float(pick(row, at, near));
}

// Ends of what divides whole ones, and what else depends on which: of b to d, or of a to e.
static inline __attribute__((always_inline)) void take_ends(struct corners *out, int q, int a)
{
    const vm falling = out->falling[q];
    const int ends[2][2] = {{a + 1, a + 4}, {a + 3, a}}; // where falling, and where not
    const int others[2][2] = {{a + 3, a + 4}, {a + 1, a}};
    for (int i = 0; i < 2; i++) {
        out->end_x[q][i] = vf_select(falling, out->x[ends[i][0]], out->x[ends[i][1]]);
        out->end_height[q][i] = vf_select(falling, out->height[ends[i][0]], out->height[ends[i][1]]);
        out->end_z[q][i] = vf_select(falling, out->z[others[i][0]], out->z[others[i][1]]);
        out->end_factor[q][i] = vf_select(falling, out->factor[others[i][0]], out->factor[others[i][1]]);
        out->end_cell[q][i] = vi_select(falling, out->cell[others[i][0]], out->cell[others[i][1]]);
    }
}

// near: the pixels' cells lie among PT_LANES. Whether there is any.
static inline __attribute__((always_inline)) int look_among(const struct walk *walk, struct cell_row *const rows[3], uint32_t x,
                                                            vm lanes, struct corners *out, int near)
{
    const int32_t first = (int32_t)walk->column[x], base = first - 1 + PAD;
    const vi at = vi_select(lanes, vi_sub(vi_load(walk->column + x), vi_set((uint32_t)first)), vi_set(0));
    const vf across = vf_load(walk->across + x);
    vm any = vm_of_bits(0);
    for (int k = 0; k < AROUND; k++) {
        out->some[k] = vi_eq(pick(rows[k / 3]->there + base + k % 3, at, near), vi_set(1));
        any = vm_or(any, out->some[k]);
    }
    if (!vm_bits(vm_and(any, lanes)))
        return 0;
    for (int k = 0; k < AROUND; k++) {
        const struct cell_row *row = rows[k / 3];
        const int32_t from = base + k % 3;
        const float dx = (float)(k % 3 - 1), dy = (float)(k / 3 - 1);
        out->x[k] = (vf_set(dx) + pick_float(row->x + from, at, near)) - across;
        out->height[k] = vf_set(dy) + pick_float(row->y_of + from, at, near);
        out->z[k] = pick_float(row->z + from, at, near);
        out->factor[k] = pick_float(row->factor + from, at, near);
        out->cell[k] = vi_add(vi_set((uint32_t)(row->y * (int32_t)walk->cells->width + first + k % 3 - 1)), at);
    }
    vi all = vi_set(0);
    for (int q = 0; q < QUADS; q++) {
        out->quad[q] = vi_select(lanes, pick(rows[q / 2]->quads + base + q % 2, at, near), vi_set(0));
        out->falling[q] = vi_eq(vi_and(out->quad[q], vi_set(FALLING)), vi_set(FALLING));
        all = vi_or(all, out->quad[q]);
        take_ends(out, q, q % 2 + 3 * (q / 2));
    }
    out->all = 0;
    for (uint32_t bit = WHOLE; bit <= ODD; bit <<= 1)
        out->all |= vm_bits(vm_not(vi_eq(vi_and(all, vi_set(bit)), vi_set(0)))) ? bit : 0;
    return 1;
}

static int look_around(const struct walk *walk, struct cell_row *const rows[3], uint32_t x, uint32_t count, struct corners *out)
{
    const vm lanes = vm_first(count);
    if (walk->column[x + count - 1] - walk->column[x] < PT_LANES)
        return look_among(walk, rows, x, lanes, out, 1);
    return look_among(walk, rows, x, lanes, out, 0);
}

// What a face is like where it is the nearest.
static inline __attribute__((always_inline)) void show_face(const struct face *face, struct found *best)
{
    vf weight[3];
    for (int i = 0; i < 3; i++)
        weight[i] = vf_abs(face->edge[i]) * face->factor[i];
    const vf sum = (weight[0] + weight[1]) + weight[2];
    vm some = vm_and(face->some, vf_lt(vf_set(1e-30f), sum));
    const vf share = vf_rcp(vf_select(some, sum, vf_set(1.0f)));
    vf z = ((weight[0] * face->z[0] + weight[1] * face->z[1]) + weight[2] * face->z[2]) * share;
    z = vf_min(vf_max(z, lesser(lesser(face->z[0], face->z[1]), face->z[2])),
               vf_max(vf_max(face->z[0], face->z[1]), face->z[2]));
    some = vm_and(some, vf_lt(z, best->z));
    best->z = vf_select(some, z, best->z);
    for (int i = 0; i < 3; i++) {
        best->weight[i] = vf_select(some, weight[i] * share, best->weight[i]);
        best->cell[i] = vi_select(some, face->cell[i], best->cell[i]);
    }
}

// Takes a triangle to what waits, of the pixels that it covers. A pixel that waits already has its own shown before.
static inline __attribute__((always_inline)) void take_face(struct face *waits, vm fits, vf edge_a, vf edge_b, vf edge_c,
                                                            const vf *const z[3], const vf *const factor[3],
                                                            const vi *const cell[3], struct found *best)
{
    const vf zero = vf_zero(), least = vf_min(vf_min(edge_a, edge_b), edge_c), most = vf_max(vf_max(edge_a, edge_b), edge_c);
    const vm some = vm_and(fits, vm_or(vf_le(zero, least), vf_le(most, zero)));
    if (!vm_bits(some))
        return;
    if (vm_bits(vm_and(some, waits->some))) {
        show_face(waits, best);
        waits->some = vm_of_bits(0);
    }
    waits->some = vm_or(waits->some, some);
    waits->edge[0] = vf_select(some, edge_a, waits->edge[0]);
    waits->edge[1] = vf_select(some, edge_b, waits->edge[1]);
    waits->edge[2] = vf_select(some, edge_c, waits->edge[2]);
    for (int i = 0; i < 3; i++) {
        waits->z[i] = vf_select(some, *z[i], waits->z[i]);
        waits->factor[i] = vf_select(some, *factor[i], waits->factor[i]);
        waits->cell[i] = vi_select(some, *cell[i], waits->cell[i]);
    }
}

// The two triangles of 2 x 2 cells that are whole.
static inline __attribute__((always_inline)) void take_whole(const struct corners *c, int q, int a, float up,
                                                             struct face *waits, struct found *best)
{
    const int b = a + 1, d = a + 3, e = a + 4;
    const vm whole = vi_eq(vi_and(c->quad[q], vi_set(WHOLE)), vi_set(WHOLE)), falling = c->falling[q];
    if (!vm_bits(whole))
        return;
    const vf zero = vf_zero(), ab = edge(c, a, b), be = edge(c, b, e), ed = edge(c, e, d), da = edge(c, d, a);
    const vf from = c->end_height[q][0] - vf_set(up), to = c->end_height[q][1] - vf_set(up);
    const vf across = c->end_x[q][0] * to - from * c->end_x[q][1], back = zero - across; // bd or ea
    const vf *const lower_z[3] = {&c->z[a], &c->z[b], &c->end_z[q][0]}, *const upper_z[3] = {&c->end_z[q][1], &c->z[e],
                                                                                             &c->z[d]};
    const vf *const lower_factor[3] = {&c->factor[a], &c->factor[b], &c->end_factor[q][0]};
    const vf *const upper_factor[3] = {&c->end_factor[q][1], &c->factor[e], &c->factor[d]};
    const vi *const lower_cell[3] = {&c->cell[a], &c->cell[b], &c->end_cell[q][0]};
    const vi *const upper_cell[3] = {&c->end_cell[q][1], &c->cell[e], &c->cell[d]};
    take_face(waits, whole, vf_select(falling, across, be), vf_select(falling, da, across), ab, lower_z, lower_factor,
              lower_cell, best);
    take_face(waits, whole, ed, vf_select(falling, back, da), vf_select(falling, be, back), upper_z, upper_factor, upper_cell,
              best);
}

// Those that fit of others.
static __attribute__((noinline)) void take_odd(const struct corners *c, int q, int a, struct face *waits, struct found *best)
{
    const int corner[4] = {a, a + 1, a + 3, a + 4};
    const vm odd = vi_eq(vi_and(c->quad[q], vi_set(ODD)), vi_set(ODD));
    if (!vm_bits(odd))
        return;
    for (int t = 0; t < 4; t++) {
        const vi bit = vi_set((uint32_t)FITS << t);
        const vm fits = vm_and(odd, vi_eq(vi_and(c->quad[q], bit), bit));
        if (!vm_bits(fits))
            continue;
        const int k[3] = {corner[triples[t][0]], corner[triples[t][1]], corner[triples[t][2]]};
        const vf *const z[3] = {&c->z[k[0]], &c->z[k[1]], &c->z[k[2]]};
        const vf *const factor[3] = {&c->factor[k[0]], &c->factor[k[1]], &c->factor[k[2]]};
        const vi *const cell[3] = {&c->cell[k[0]], &c->cell[k[1]], &c->cell[k[2]]};
        take_face(waits, fits, edge(c, k[1], k[2]), edge(c, k[2], k[0]), edge(c, k[0], k[1]), z, factor, cell, best);
    }
}

static inline __attribute__((always_inline)) void take_quad(const struct corners *c, int q, int a, float up, struct face *waits,
                                                            struct found *best)
{
    take_whole(c, q, a, up, waits, best);
    if (c->all & ODD)
        take_odd(c, q, a, waits, best);
}

// All faces over pixels of one row. up: where in the cells' row.
static void take_faces(struct corners *c, float up, struct found *best)
{
    struct face
        waits; // of no pixel. Not zeros: compilers write so many by a string instruction, a quarter of the time taken here
    waits.some = vm_of_bits(0);
    for (int i = 0; i < 3; i++) {
        waits.edge[i] = c->x[i];
        waits.z[i] = c->z[i];
        waits.factor[i] = c->factor[i];
        waits.cell[i] = c->cell[i];
    }
    for (int k = 0; k < AROUND; k++)
        c->y[k] = c->height[k] - vf_set(up);
    take_quad(c, 0, 0, up, &waits, best);
    take_quad(c, 1, 1, up, &waits, best);
    take_quad(c, 2, 3, up, &waits, best);
    take_quad(c, 3, 4, up, &waits, best);
    if (vm_bits(waits.some))
        show_face(&waits, best);
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

// Of the second: what pixels show of the first one.
struct before {
    vm own, marked; // own: of the instance; marked: not sharp
    vf z, step;     // where they are not its own, of no pixel
};

static struct before look_before(const struct walk *walk, size_t at, vm lanes)
{
    const struct magnify_args *args = walk->args;
    const uint64_t *keys = (const uint64_t *)PT_DATA(walk->call, magnify, keys) + at;
    const vf z = vi_float(vi_load_z(keys)), marks = vf_load((const float *)PT_DATA(walk->call, magnify, away) + at);
    struct before before;
    before.own = vm_and(vm_and(lanes, vf_lt(z, vf_set(pt_float(PT_KEY_EMPTY_Z)))),
                        pt_has_ids(vi_sub(vi_load_id(keys), vi_set(args->id_base)), args->id_first, args->id_count));
    before.marked = vm_and(before.own, vf_lt(marks, vf_zero()));
    before.z = vf_select(before.own, z, vf_set(1.0f));
    before.step = pt_range_step(walk->cells, args->gamma, args->gamma_cells, before.z);
    return before;
}

// Whether no face of PT_LANES pixels of a row changes anything: where nothing is marked, and all cells around lie no more than a step before
// what is there. Of scans in two passes that is so for seven of ten that show something.
static int is_settled(const struct walk *walk, struct cell_row *const rows[3], uint32_t x, uint32_t y, vm lanes)
{
    const struct before before = look_before(walk, (size_t)y * walk->args->view.width + x, lanes);
    if (vm_bits(before.marked))
        return 0;
    const vi first = vi_set(walk->column[x]), at = vi_select(lanes, vi_sub(vi_load(walk->column + x), first), vi_set(0));
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z)), least = vf_select(before.own, before.z - before.step, empty);
    vf nearest = empty;
    for (int k = 0; k < 3; k++)
        nearest = vf_min(vf_gather(rows[k]->least + PAD + walk->column[x], at, vm_first(PT_LANES)), nearest);
    return !vm_bits(vm_and(lanes, vf_lt(nearest, least)));
}

// What may take the place of what is there, whose marks are taken away.
static vm replaces(const struct walk *walk, size_t at, const struct found *best, vm lanes)
{
    float *away = (float *)PT_DATA(walk->call, magnify, away) + at;
    const struct before before = look_before(walk, at, lanes);
    vf_store_where(away, vf_set(-1.0f) - vf_load(away), before.marked);
    const vm nearer = vf_lt(best->z, before.z - before.step), near = vf_le(best->z, before.z + before.step);
    return vm_and(best->some, vm_or(vm_not(before.own), vm_or(nearer, vm_and(before.marked, near))));
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
        const vm own = pt_has_ids(vi_sub(vi_load_id(keys), vi_set(args->id_base)), args->id_first, args->id_count);
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

// Of a row of pixels, in cells.
static float row_of(const struct walk *walk, uint32_t y)
{
    return ((float)(walk->args->view.origin_y + (int32_t)y) + 0.5f) * walk->args->inverse;
}

// PT_LANES columns of rows from y to before `end`, all in the row `cy` of cells.
static void magnify_block(const struct walk *walk, struct cell_row *const rows[3], uint32_t x, uint32_t y, uint32_t end,
                          uint32_t cy)
{
    const struct magnify_args *args = walk->args;
    const uint32_t count = pt_lanes_left(x, args->view.rect[2]);
    const vm lanes = vm_first(count);
    const int fine = (args->pass & PT_RANGE_FINE) != 0;
    struct corners corners;
    while (fine && y < end && is_settled(walk, rows, x, y, lanes))
        y++;
    if (y == end)
        return;
    const int near = look_around(walk, rows, x, count, &corners);
    for (; y < end && (near || fine); y++) {
        if (fine && is_settled(walk, rows, x, y, lanes))
            continue;
        const float py = row_of(walk, y), up = py - floorf(py);
        const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z));
        struct found best;
        best.z = empty;
        for (int i = 0; i < 3; i++) {
            best.weight[i] = empty;
            best.cell[i] = vi_set(x);
        }
        if (near)
            take_faces(&corners, up, &best);
        best.some = vm_and(lanes, vf_lt(best.z, empty));
        best.loose = vm_not(best.some);
        if (near && vm_bits(vm_and(lanes, best.loose))) {
            if (!fine)
                take_places(walk, &corners, lanes, &best);
            const vm open = vm_and(lanes, vm_not(best.some));
            for (int k = 0; k < QUADS && corners.all & LOOSE && vm_bits(open); k++)
                take_loose(walk, &corners, k % 2 + 3 * (k / 2), open, &best);
        }
        if (vm_bits(best.some) || fine)
            show(walk, x, y, cy, up, &best, lanes);
    }
}

static void magnify_rows(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct walk *walk = context;
    const uint32_t *rect = walk->args->view.rect;
    float *memory = (float *)(void *)(walk->memory + thread * walk->thread_bytes);
    struct cell_row rows[3], *around[3];
    for (int k = 0; k < 3; k++, memory += 7 * walk->row_values)
        rows[k] = (struct cell_row){.y = INT32_MIN,
                                    .divided = INT32_MIN,
                                    .x = memory,
                                    .y_of = memory + walk->row_values,
                                    .z = memory + 2 * walk->row_values,
                                    .factor = memory + 3 * walk->row_values,
                                    .least = memory + 6 * walk->row_values,
                                    .there = (uint32_t *)(void *)(memory + 4 * walk->row_values),
                                    .quads = (uint32_t *)(void *)(memory + 5 * walk->row_values)};
    for (uint32_t y = rect[1] + begin, last; y < rect[1] + end && !pt_cpu_cancelled(walk->call); y = last) {
        const float cells = floorf(row_of(walk, y));
        for (last = y + 1; last < rect[1] + end && floorf(row_of(walk, last)) <= cells;)
            last++;
        const int32_t cy = (int32_t)cells - walk->cells->origin_y;
        hold(walk, rows, cy, around);
        for (uint32_t x = rect[0]; x < rect[2]; x += PT_LANES)
            magnify_block(walk, around, x, y, last, (uint32_t)cy);
    }
}

// Which cells the columns of pixels lie in.
static void place_columns(const struct walk *walk, float *across, uint32_t *column)
{
    const struct view_args *view = &walk->args->view;
    const vf half = vf_set(0.5f), inverse = vf_set(walk->args->inverse);
    for (uint32_t x = 0; x < view->width; x += PT_LANES) {
        const vf px = (vi_convert(vi_add(vi_add(vi_set(x), vi_lanes()), vi_set((uint32_t)view->origin_x))) + half) * inverse;
        const vf floor = vf_floor(px);
        vf_store(across + x, px - floor);
        vi_store(column + x, vi_sub(vf_int(floor), vi_set((uint32_t)walk->cells->origin_x)));
    }
}

int PT_KERNEL_ENTRY(magnify)(const struct pt_cpu_call *call)
{
    const struct magnify_args *args = call->arguments;
    const uint32_t *rect = args->view.rect;
    struct walk walk = {.call = call, .args = args, .cells = &args->cells, .places = PT_DATA(call, magnify, place)};
    if (rect[0] >= rect[2] || rect[1] >= rect[3])
        return PATINA_OK;
    const size_t row = ((size_t)args->view.width + 2 * PT_LANES + 15) / 16 * 16;
    walk.row_values = ((size_t)args->cells.width + 2 * PAD + 3 * PT_LANES + 15) / 16 * 16;
    walk.thread_bytes = 3 * 7 * walk.row_values * sizeof(float);
    char *memory = pt_cpu_scratch(call, 0, pt_pool_threads(call->pool) * walk.thread_bytes + 2 * row * 4);
    if (!memory)
        return PATINA_ERROR_MEMORY;
    float *across = (float *)(void *)(memory + pt_pool_threads(call->pool) * walk.thread_bytes);
    uint32_t *column = (uint32_t *)(void *)(across + row);
    walk.memory = memory;
    walk.across = across;
    walk.column = column;
    place_columns(&walk, across, column);
    pt_parallel(call->pool, rect[3] - rect[1], BATCH, magnify_rows, &walk);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
