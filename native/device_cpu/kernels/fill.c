// SPDX-License-Identifier: GPL-3.0-or-later
// fill: hole filling, of background pixels, then of occluded ones. [D 3.2, 3.3] with the rule of SPEC 2.2; twin of
// shaders/kernels/fill.comp
//
// The planes are read once: that gives a bit a pixel that is covered, and one that may be occluded. Background pixels are
// decided from bits alone. A step first decides from the state before it, then applies: what changes is listed by bands of
// rows, so the planes are never copied. 64 pixels are decided at once: eight masks of dark neighbours, four bit operations a
// mask find the runs. Entries stay listed with the pixel's state before the phase: un-filling walks the lists alone.
// A step looks only where the one before it changed something.
#include "device_cpu/rows.h"

enum { BAND_ROWS = 16, RING = 8, PAD = 64 };

// The ring, anticlockwise from east.
static const int8_t ring_x[RING] = { 1, 1, 0, -1, -1, -1, 0, 1 };
static const int8_t ring_y[RING] = { 0, 1, 1, 1, 0, -1, -1, -1 };

// The entries of a band, as columns.
struct entries {
    uint64_t *key, *old_key; // after this step; before the phase
    uint32_t *x, *y, *from, *old_from;
    float *threshold; // before the phase: a neighbour nearer than this is dark
};

struct fill {
    const struct pt_cpu_call *call;
    const struct fill_args *args;
    const struct view_args *view;
    uint64_t *keys;
    uint32_t *from;
    const float *normals, *deff;
    // planes of bits, a word 64 pixels of a row
    uint64_t *covered, *suspect; // not empty; maybe occluded, as the planes were before
    uint64_t *filled, *before;   // in this phase; in the phase before it
    uint64_t *dirty, *touched;   // changed by the last step; by this one
    size_t words;                // in a row
    struct entries entries;      // of all bands
    size_t band_entries;
    uint32_t *kept, *listed; // per band: entries of earlier steps; with those of this step
    float *rows;             // per thread: three rows of z and one of their minima, padded by PAD on both sides
    size_t row_stride;       // floats
    int occluded;            // the phase
    int first;               // its first step looks everywhere
    atomic_uint changed;
};

enum { ROWS = 4 };

static uint32_t bands(const struct fill *fill)
{
    return (fill->view->rect[3] - fill->view->rect[1] + BAND_ROWS - 1) / BAND_ROWS;
}

static void band_rows(const struct fill *fill, uint32_t band, uint32_t *first, uint32_t *last)
{
    *first = fill->view->rect[1] + band * BAND_ROWS;
    *last = *first + BAND_ROWS < fill->view->rect[3] ? *first + BAND_ROWS : fill->view->rect[3];
}

// ---- planes of bits --------------------------------------------------------------------------------------------------------

// Whether rows first - 1 .. last have any bit. Nothing beyond view.rect ever changes.
static int any_near(const struct fill *fill, const uint64_t *plane, uint32_t first, uint32_t last)
{
    size_t begin = first > fill->view->rect[1] ? first - 1 : first, end = last < fill->view->rect[3] ? last + 1 : last;
    uint64_t any = 0;
    for (size_t i = begin * fill->words; i < end * fill->words; i++)
        any |= plane[i];
    return any != 0;
}

struct trio { // of 64 pixels: the bits of those to the west of them, their own, those to the east
    uint64_t west, own, east;
};

static struct trio trio_of(const struct fill *fill, const uint64_t *row, size_t word)
{
    uint64_t own = row[word], before = word ? row[word - 1] : 0, behind = word + 1 < fill->words ? row[word + 1] : 0;
    return (struct trio){ own << 1 | before >> 63, own, own >> 1 | behind << 63 };
}

// Which of 64 pixels have a bit, or one beside them.
static uint64_t near(const struct fill *fill, const uint64_t *plane, size_t word, uint32_t y)
{
    uint32_t begin = y > fill->view->rect[1] ? y - 1 : y, end = y + 1 < fill->view->rect[3] ? y + 1 : y;
    uint64_t any = 0;
    for (size_t row = begin; row <= end; row++) {
        struct trio trio = trio_of(fill, plane + row * fill->words, word);
        any |= trio.west | trio.own | trio.east;
    }
    return any;
}

// Which of 64 pixels this step looks at.
static uint64_t asked(const struct fill *fill, size_t word, uint32_t y)
{
    if (!fill->first)
        return near(fill, fill->dirty, word, y);
    return fill->occluded ? fill->suspect[y * fill->words + word] | near(fill, fill->before, word, y) : UINT64_MAX;
}

// ---- deciding ------------------------------------------------------------------------------------------------------------

// 1. z of row y, +inf beyond its ends and beyond the plane.
static void load_z(const struct fill *fill, int32_t y, float *row)
{
    uint32_t width = fill->view->width;
    const float empty = pt_float(PT_KEY_EMPTY_Z);
    if (y < 0 || y >= (int32_t)fill->view->height) {
        for (uint32_t x = 0; x < width + 2 * PAD; x++)
            row[x] = empty;
        return;
    }
    const uint64_t *keys = fill->keys + (size_t)y * width;
    for (uint32_t x = 0; x < width; x += PT_LANES)
        vf_store(row + PAD + x, vi_float(vi_load_z(keys + x)), vm_first(PT_LANES));
    for (uint32_t x = 0; x < PAD; x++)
        row[x] = row[PAD + width + x] = empty;
}

// 2. Which of PT_LANES pixels may have a neighbour that is nearer by more than d_eff: `nearest` is the nearest of the 3 x 3
// around them.
static inline vm maybe_hidden(const struct fill *fill, vf z, vf nearest, vm asked)
{
    return vm_and(asked, vf_lt(nearest, z - pt_least_distance(fill->view, fill->args->least, z)));
}

// Which of them have. There *threshold = z - d_eff.
static inline vm hidden(const struct fill *fill, size_t at, vf z, vf nearest, vm asked, vf *threshold)
{
    asked = maybe_hidden(fill, z, nearest, asked);
    if (vm_bits(asked) && fill->view->level) // d_eff at level 0 spares most a look at the normals
        asked = vm_and(asked, vf_lt(nearest, z - vf_gather(fill->deff, pt_source_of(fill->from, at), asked)));
    if (!vm_bits(asked))
        return asked;
    *threshold = z - pt_own_distance(fill->view, fill->deff, fill->normals, fill->from, at, z, asked);
    return vm_and(asked, vf_lt(nearest, *threshold));
}

// Pixels that are covered, and those that a nearer one may hide.
static void scan_row(const struct fill *fill, const float *const rows[3], float *least, uint32_t y)
{
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z));
    const uint32_t width = fill->view->width;
    uint64_t *covered = fill->covered + y * fill->words, *suspect = fill->suspect + y * fill->words;
    for (uint32_t x = PAD - PT_LANES; x < PAD + width + PT_LANES; x += PT_LANES)
        vf_store(least + x, vf_min(vf_min(vf_load(rows[0] + x), vf_load(rows[2] + x)), vf_load(rows[1] + x)),
                 vm_first(PT_LANES));
    for (size_t word = 0; word < fill->words; word++) {
        covered[word] = suspect[word] = 0;
        for (uint32_t i = 0; i < 64; i += PT_LANES) {
            const size_t x = 64 * word + i;
            const float *at = least + PAD + x;
            vf z = vf_load(rows[1] + PAD + x);
            vm some = vf_lt(z, empty);
            if (!vm_bits(some))
                continue;
            vf nearest = vf_min(vf_min(vf_load(at - 1), vf_load(at + 1)), vf_load(at));
            covered[word] |= (uint64_t)vm_bits(some) << i;
            suspect[word] |= (uint64_t)vm_bits(maybe_hidden(fill, z, nearest, some)) << i;
        }
    }
}

static void scan_band(const struct fill *fill, uint32_t band, uint32_t thread)
{
    float *rows = fill->rows + thread * ROWS * fill->row_stride;
    int32_t held[3] = { INT32_MIN, INT32_MIN, INT32_MIN }; // which row each slot of the ring holds
    uint32_t first, last;
    band_rows(fill, band, &first, &last);
    memset(fill->filled + first * fill->words, 0, (last - first) * fill->words * 8);
    memset(fill->before + first * fill->words, 0, (last - first) * fill->words * 8);
    // a row beyond the rectangle is looked at, never changed
    uint32_t begin = first && !band ? first - 1 : first;
    uint32_t end = last == fill->view->rect[3] && last < fill->view->height ? last + 1 : last;
    for (uint32_t y = begin; y < end; y++) {
        const float *around[3];
        for (int32_t k = 0; k < 3; k++) {
            int32_t row = (int32_t)y - 1 + k, slot = (row + 3) % 3;
            float *at = rows + (size_t)slot * fill->row_stride;
            if (held[slot] != row)
                load_z(fill, row, at);
            held[slot] = row;
            around[k] = at;
        }
        scan_row(fill, around, rows + 3 * fill->row_stride, y);
    }
}

// 3. Which of 64 pixels have no five consecutive white ring neighbours.
static uint64_t not_border(const uint64_t dark[RING])
{
    uint64_t white[RING + 4], border = 0;
    for (int d = 0; d < RING + 4; d++)
        white[d] = ~dark[d % RING];
    for (int d = 0; d < RING; d++)
        border |= white[d] & white[d + 1] & white[d + 2] & white[d + 3] & white[d + 4];
    return ~border;
}

static uint64_t empty_to_fill(const struct fill *fill, size_t word, uint32_t y, uint64_t look)
{
    const uint64_t *row = fill->covered + y * fill->words;
    const struct trio none = { 0, 0, 0 }, own = trio_of(fill, row, word);
    look &= ~own.own;
    if (!look)
        return 0;
    const struct trio below = y ? trio_of(fill, row - fill->words, word) : none;
    const struct trio above = y + 1 < fill->view->height ? trio_of(fill, row + fill->words, word) : none;
    return look & not_border((const uint64_t[RING]){ own.east, above.east, above.own, above.west, own.west, below.west,
                                                     below.own, below.east });
}

enum { PATCH = 64 + 2 * PT_LANES };

// z of 64 pixels and of those around them, +inf beyond the plane.
static void load_patch(const struct fill *fill, size_t word, uint32_t y, float patch[3][PATCH])
{
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z));
    const int32_t width = (int32_t)fill->view->width, first = (int32_t)word * 64 - PT_LANES;
    for (int32_t k = 0; k < 3; k++) {
        const int32_t row = (int32_t)y - 1 + k, beyond = row < 0 || row >= (int32_t)fill->view->height;
        const uint64_t *keys = fill->keys + (ptrdiff_t)row * width;
        for (int32_t i = 0; i < PATCH; i += PT_LANES) {
            int32_t x = first + i, left = width - x;
            vm lanes = vm_first(x < 0 || left <= 0 ? 0 : left < PT_LANES ? (uint32_t)left : PT_LANES);
            vf z = beyond || !vm_bits(lanes) ? empty : vf_select(lanes, vi_float(vi_load_z(keys + x)), empty);
            vf_store(patch[k] + i, z, vm_first(PT_LANES));
        }
    }
}

// Thresholds: a neighbour nearer than that is dark.
static uint64_t occluded_to_fill(const struct fill *fill, size_t word, uint32_t y, uint64_t look, float thresholds[64])
{
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z));
    uint64_t dark[RING] = { 0 }, asked = 0;
    float patch[3][PATCH];
    load_patch(fill, word, y, patch);
    for (uint32_t i = 0; i < 64; i += PT_LANES) {
        vf z = vf_load(patch[1] + PT_LANES + i), t = z, neighbour[RING], nearest = z;
        vm some = vm_and(vf_lt(z, empty), vm_of_bits((uint32_t)(look >> i)));
        if (!vm_bits(some))
            continue;
        for (int d = 0; d < RING; d++) {
            neighbour[d] = vf_load(patch[1 + ring_y[d]] + PT_LANES + i + ring_x[d]);
            nearest = vf_min(nearest, neighbour[d]);
        }
        some = hidden(fill, (size_t)y * fill->view->width + 64 * word + i, z, nearest, some, &t);
        if (!vm_bits(some))
            continue;
        asked |= (uint64_t)vm_bits(some) << i;
        vf_store(thresholds + i, t, vm_first(PT_LANES));
        for (int d = 0; d < RING; d++)
            dark[d] |= (uint64_t)vm_bits(vf_lt(neighbour[d], t)) << i;
    }
    return asked & not_border(dark);
}

// Index of neighbour d of the pixels (x, y), and which of them the plane holds.
static vi neighbour_of(const struct view_args *view, vi x, vi y, int d, vm lanes, vm *inside)
{
    vi qx = vi_add(x, vi_set((uint32_t)(int32_t)ring_x[d])), qy = vi_add(y, vi_set((uint32_t)(int32_t)ring_y[d]));
    *inside = vm_and(lanes, vm_and(vi_lt_unsigned(qx, vi_set(view->width)), vi_lt_unsigned(qy, vi_set(view->height))));
    return vi_add(vi_mul(qy, vi_set(view->width)), qx);
}

// 4. The least key among the neighbours; refined: its surface's tangent plane at this pixel. Completes `count` entries.
static void choose(const struct fill *fill, size_t at, uint32_t count)
{
    const struct view_args *view = fill->view;
    const struct entries *e = &fill->entries;
    vm lanes = vm_first(count);
    vi x = vi_load(e->x + at), y = vi_load(e->y + at);
    vi best_z = vi_set(UINT32_MAX), best_id = vi_set(UINT32_MAX), qx = x, qy = y;
    for (int d = 0; d < RING; d++) {
        vm inside;
        vi q = neighbour_of(view, x, y, d, lanes, &inside);
        vi z = vi_gather_z(fill->keys, q, inside), id = vi_gather_id(fill->keys, q, inside);
        vm less = vm_or(vi_lt_unsigned(z, best_z), vm_and(vi_eq(z, best_z), vi_lt_unsigned(id, best_id)));
        less = vm_and(less, inside);
        best_z = vi_select(less, z, best_z);
        best_id = vi_select(less, id, best_id);
        qx = vi_select(less, vi_add(x, vi_set((uint32_t)(int32_t)ring_x[d])), qx);
        qy = vi_select(less, vi_add(y, vi_set((uint32_t)(int32_t)ring_y[d])), qy);
    }
    vi source = vi_gather(fill->from, vi_add(vi_mul(qy, vi_set(view->width)), qx), lanes);
    vf z = vi_float(best_z);
    if (fill->args->refined) {
        vf n[4], ray_p[2], ray_q[2];
        vf_gather4(fill->normals, source, lanes, n);
        vf_ray_of(view, x, y, ray_p);
        vf_ray_of(view, qx, qy, ray_q);
        z = vf_plane_depth(view, n, ray_q, z, ray_p, vf_level_distance(view, fill->deff, fill->normals, source, z, lanes));
    }
    uint32_t zs[PT_LANES], ids[PT_LANES];
    vi_store(zs, vf_bits(z), vm_first(PT_LANES));
    vi_store(ids, best_id, vm_first(PT_LANES));
    vi_store(e->from + at, source, lanes);
    for (uint32_t i = 0; i < count; i++)
        e->key[at + i] = (uint64_t)zs[i] << 32 | ids[i];
}

static void decide_band(struct fill *fill, uint32_t band)
{
    const struct entries *e = &fill->entries;
    float thresholds[64];
    uint32_t first, last, count = fill->kept[band];
    size_t base = band * fill->band_entries;
    band_rows(fill, band, &first, &last);
    memset(fill->touched + first * fill->words, 0, (last - first) * fill->words * 8);
    fill->listed[band] = count;
    if (!fill->first && !any_near(fill, fill->dirty, first, last))
        return;
    const size_t word_end = (fill->view->rect[2] + 63) / 64;
    for (uint32_t y = first; y < last; y++)
        for (size_t word = fill->view->rect[0] / 64; word < word_end; word++) {
            uint64_t fills = asked(fill, word, y), left = fill->view->width - word * 64;
            if (left < 64)
                fills &= (1ull << left) - 1;
            if (fills)
                fills = fill->occluded ? occluded_to_fill(fill, word, y, fills, thresholds)
                                       : empty_to_fill(fill, word, y, fills);
            for (; fills; fills &= fills - 1, count++) {
                uint32_t i = (uint32_t)__builtin_ctzll(fills);
                e->x[base + count] = (uint32_t)word * 64 + i;
                e->y[base + count] = y;
                e->threshold[base + count] = fill->occluded ? thresholds[i] : pt_float(PT_KEY_EMPTY_Z);
            }
        }
    // only now: a vector load waits for the scalar stores that it covers
    for (uint32_t i = fill->kept[band]; i < count; i += PT_LANES)
        choose(fill, base + i, count - i < PT_LANES ? count - i : PT_LANES);
    fill->listed[band] = count;
}

static void note_change(struct fill *fill, uint32_t changed)
{
    if (changed)
        atomic_fetch_add_explicit(&fill->changed, changed, memory_order_relaxed);
}

static void apply_band(struct fill *fill, uint32_t band)
{
    const struct entries *e = &fill->entries;
    size_t base = band * fill->band_entries, keep = base + fill->kept[band], end = base + fill->listed[band];
    note_change(fill, fill->listed[band] - fill->kept[band]);
    for (size_t i = keep; i < end; i++) {
        size_t pixel = (size_t)e->y[i] * fill->view->width + e->x[i], word = e->y[i] * fill->words + e->x[i] / 64;
        uint64_t bit = 1ull << e->x[i] % 64, old_key = fill->keys[pixel];
        uint32_t old_from = fill->from[pixel];
        fill->touched[word] |= bit;
        fill->covered[word] |= bit;
        fill->keys[pixel] = e->key[i];
        fill->from[pixel] = e->from[i];
        if (fill->filled[word] & bit)
            continue; // filled before in this phase: that entry knows the state before it
        fill->filled[word] |= bit;
        e->x[keep] = e->x[i];
        e->y[keep] = e->y[i];
        e->threshold[keep] = e->threshold[i];
        e->old_key[keep] = old_key;
        e->old_from[keep++] = old_from;
    }
    fill->kept[band] = (uint32_t)(keep - base);
}

// ---- un-filling ----------------------------------------------------------------------------------------------------------

// An entry whose pixel shows four consecutive white cells is marked (its `from` has no other use any more) ...
static void mark_band(struct fill *fill, uint32_t band)
{
    const struct entries *e = &fill->entries;
    size_t base = band * fill->band_entries, end = base + fill->kept[band];
    uint32_t first, last;
    band_rows(fill, band, &first, &last);
    memset(fill->touched + first * fill->words, 0, (last - first) * fill->words * 8);
    fill->listed[band] = 0;
    if (!fill->first && !any_near(fill, fill->dirty, first, last))
        return;
    for (size_t i = base; i < end; i += PT_LANES) {
        vm lanes = vm_first(end - i < PT_LANES ? (uint32_t)(end - i) : PT_LANES);
        vi x = vi_load(e->x + i), y = vi_load(e->y + i), white = vi_set(0);
        vf threshold = vf_load(e->threshold + i);
        for (int d = 0; d < RING; d++) {
            vm inside;
            vi q = neighbour_of(fill->view, x, y, d, lanes, &inside);
            vm dark = vm_and(inside, vf_lt(vi_float(vi_gather_z(fill->keys, q, inside)), threshold));
            white = vi_or(white, vi_select(dark, vi_set(0), vi_set(0x101u << d))); // twice: runs wrap round
        }
        vi run = vi_and(vi_and(white, vi_shr(white, 1)), vi_and(vi_shr(white, 2), vi_shr(white, 3)));
        vm marked = vm_and(lanes, vm_not(vi_eq(vi_and(run, vi_set(255)), vi_set(0))));
        vi_store(e->from + i, vi_select(marked, vi_set(1), vi_set(0)), lanes);
        fill->listed[band] |= vm_bits(marked);
    }
}

// ... and gets back what it was before the phase.
static void restore_band(struct fill *fill, uint32_t band)
{
    const struct entries *e = &fill->entries;
    size_t base = band * fill->band_entries, end = base + fill->kept[band], keep = base;
    if (!fill->listed[band])
        return;
    for (size_t i = base; i < end; i++) {
        if (e->from[i]) {
            size_t pixel = (size_t)e->y[i] * fill->view->width + e->x[i], word = e->y[i] * fill->words + e->x[i] / 64;
            uint64_t bit = 1ull << e->x[i] % 64;
            fill->keys[pixel] = e->old_key[i];
            fill->from[pixel] = e->old_from[i];
            fill->touched[word] |= bit;
            if (!fill->occluded) // what was empty before the phase
                fill->covered[word] &= ~bit;
            continue;
        }
        e->x[keep] = e->x[i];
        e->y[keep] = e->y[i];
        e->threshold[keep] = e->threshold[i];
        e->old_key[keep] = e->old_key[i];
        e->old_from[keep++] = e->old_from[i];
    }
    note_change(fill, (uint32_t)(end - keep));
    fill->kept[band] = (uint32_t)(keep - base);
}

// ---- steps -------------------------------------------------------------------------------------------------------------

enum step { SCAN, DECIDE, APPLY, MARK, RESTORE };

struct step_job {
    struct fill *fill;
    enum step step;
};

static void step_bands(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct step_job *job = context;
    for (uint32_t band = begin; band < end && !pt_cpu_cancelled(job->fill->call); band++)
        switch (job->step) {
        case SCAN: scan_band(job->fill, band, thread); break;
        case DECIDE: decide_band(job->fill, band); break;
        case APPLY: apply_band(job->fill, band); break;
        case MARK: mark_band(job->fill, band); break;
        case RESTORE: restore_band(job->fill, band); break;
        }
}

static void run_step(struct fill *fill, enum step step)
{
    struct step_job job = { fill, step };
    pt_parallel(fill->call->pool, bands(fill), 1, step_bands, &job);
}

// Repeats the pair of steps until nothing changes, `most` times at the most.
static void repeat(struct fill *fill, enum step look, enum step act, uint32_t most)
{
    fill->first = 1;
    for (uint32_t i = 0; i < most && !pt_cpu_cancelled(fill->call); i++) {
        atomic_store_explicit(&fill->changed, 0, memory_order_relaxed);
        run_step(fill, look);
        run_step(fill, act);
        if (!atomic_load_explicit(&fill->changed, memory_order_relaxed))
            return;
        uint64_t *swap = fill->dirty;
        fill->dirty = fill->touched;
        fill->touched = swap;
        fill->first = 0;
    }
}

static int allocate(struct fill *fill)
{
    const struct view_args *view = fill->view;
    struct entries *e = &fill->entries;
    size_t threads = pt_pool_threads(fill->call->pool), count = bands(fill);
    fill->words = (view->width + 63) / 64;
    fill->band_entries = 2 * (size_t)view->width * BAND_ROWS; // every pixel may be kept, and be filled again in this step
    fill->row_stride = fill->words * 64 + 2 * PAD;
    size_t words = fill->words * view->height, room = count * fill->band_entries + PT_LANES;
    size_t rows = threads * ROWS * fill->row_stride;
    uint8_t *lists = pt_cpu_scratch(fill->call, 1, room * 36);
    fill->rows = pt_cpu_scratch(fill->call, 0, rows * 4 + words * 6 * 8 + count * 8);
    if (!lists || !fill->rows)
        return PATINA_ERROR_MEMORY;
    e->key = (uint64_t *)lists;
    e->old_key = e->key + room;
    e->x = (uint32_t *)(e->old_key + room);
    e->y = e->x + room;
    e->from = e->y + room;
    e->old_from = e->from + room;
    e->threshold = (float *)(e->old_from + room);
    fill->covered = (uint64_t *)(fill->rows + rows);
    fill->suspect = fill->covered + words;
    fill->filled = fill->suspect + words;
    fill->before = fill->filled + words;
    fill->dirty = fill->before + words;
    fill->touched = fill->dirty + words;
    fill->kept = (uint32_t *)(fill->touched + words);
    fill->listed = fill->kept + count;
    return PATINA_OK;
}

static void run_phase(struct fill *fill, int occluded)
{
    fill->occluded = occluded;
    memset(fill->kept, 0, bands(fill) * sizeof *fill->kept);
    repeat(fill, DECIDE, APPLY, fill->args->iterations);
    repeat(fill, MARK, RESTORE, fill->args->unfills);
    uint64_t *swap = fill->before;
    fill->before = fill->filled;
    fill->filled = swap;
}

int PT_KERNEL_ENTRY(fill)(const struct pt_cpu_call *call)
{
    const struct fill_args *args = call->arguments;
    struct fill fill = { .call = call,
                         .args = args,
                         .view = &args->view,
                         .keys = pt_cpu_data(call, 0),
                         .from = pt_cpu_data(call, 1),
                         .normals = pt_cpu_data(call, 2),
                         .deff = pt_cpu_data(call, 3) };
    if (args->view.rect[0] >= args->view.rect[2] || args->view.rect[1] >= args->view.rect[3])
        return PATINA_OK;
    int error = allocate(&fill);
    if (error)
        return error;
    run_step(&fill, SCAN);
    if (args->phases & PT_FILL_BACKGROUND)
        run_phase(&fill, 0);
    if (args->phases & PT_FILL_OCCLUDED)
        run_phase(&fill, 1);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
