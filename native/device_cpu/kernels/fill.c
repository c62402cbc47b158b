// SPDX-License-Identifier: GPL-3.0-or-later
// fill: one phase of hole filling. [D 3.2, 3.3] with the rule of SPEC 2.2; twin of shaders/kernels/fill.comp
//
// A step first decides from the state before it, then applies: what changes is listed by bands of rows, so the planes are
// never copied. 64 pixels are decided at once: vector compares give eight masks of dark neighbours, four bit operations a
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
    uint64_t *filled;        // a bit a pixel: filled in this phase
    uint8_t *dirty, *touched; // a byte a word of `filled`: changed by the last step; by this one
    size_t words;            // in a row
    struct entries entries;  // of all bands
    size_t band_entries;
    uint32_t *kept, *listed; // per band: entries of earlier steps; with those of this step
    float *rows;             // per thread: three rows of z and one of thresholds, padded by PAD on both sides
    size_t row_stride;       // floats
    int first;               // the phase's first step looks everywhere
    atomic_uint changed;
};

static uint32_t bands(const struct fill *fill)
{
    return (fill->view->rect[3] - fill->view->rect[1] + BAND_ROWS - 1) / BAND_ROWS;
}

static void band_rows(const struct fill *fill, uint32_t band, uint32_t *first, uint32_t *last)
{
    *first = fill->view->rect[1] + band * BAND_ROWS;
    *last = *first + BAND_ROWS < fill->view->rect[3] ? *first + BAND_ROWS : fill->view->rect[3];
}

// Whether the last step changed anything in rows first - 1 .. last, or in the given word and those beside it.
static int rows_dirty(const struct fill *fill, uint32_t first, uint32_t last)
{
    size_t begin = first ? first - 1 : 0, end = last < fill->view->height ? last + 1 : last;
    return memchr(fill->dirty + begin * fill->words, 1, (end - begin) * fill->words) != NULL;
}

static int word_dirty(const struct fill *fill, size_t word, uint32_t y)
{
    uint32_t begin = y ? y - 1 : 0, end = y + 1 < fill->view->height ? y + 1 : y, any = 0;
    for (size_t row = begin; row <= end; row++) {
        const uint8_t *at = fill->dirty + row * fill->words + word;
        any |= at[0] | (word ? at[-1] : 0u) | (word + 1 < fill->words ? at[1] : 0u);
    }
    return any != 0;
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

// The least z of the 3 x 3 around PT_LANES pixels.
static vf least_around(const float *const rows[3], uint32_t x)
{
    vf least[3];
    for (int k = 0; k < 3; k++) {
        const float *at = rows[k] + PAD + x;
        least[k] = vf_min(vf_min(vf_load(at - 1), vf_load(at + 1)), vf_load(at));
    }
    return vf_min(vf_min(least[0], least[1]), least[2]);
}

// 2. Thresholds of 64 pixels from x on, and which of them are candidates: pixels with a dark neighbour, maybe a few others.
static uint64_t load_thresholds(const struct fill *fill, uint32_t x, uint32_t y, const float *const rows[3],
                                float *thresholds)
{
    uint64_t candidates = 0;
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z));
    const size_t at = (size_t)y * fill->view->width + x;
    for (uint32_t i = 0; i < 64; i += PT_LANES) {
        vf t = vf_load(rows[1] + PAD + x + i), nearest = least_around(rows, x + i);
        vm asked;
        if (fill->args->occluded) {
            // no d_eff is below a pixel's footprint: most pixels need not know their own
            asked = vm_and(vf_lt(t, empty), vf_lt(nearest, t - vf_footprint(fill->view, t)));
            if (vm_bits(asked)) {
                t = t - pt_own_distance(fill->view, fill->deff, fill->normals, fill->from, at + i, t, asked);
                asked = vm_and(asked, vf_lt(nearest, t));
            }
        } else {
            asked = vm_and(vf_le(empty, t), vf_lt(nearest, empty));
        }
        vf_store(thresholds + i, t, vm_first(PT_LANES));
        candidates |= (uint64_t)vm_bits(asked) << i;
    }
    uint32_t left = fill->view->width - x;
    return left < 64 ? candidates & ((1ull << left) - 1) : candidates;
}

// 3. Which of the candidates have no five consecutive white ring neighbours.
static uint64_t not_border(const float *const rows[3], const float *thresholds, uint32_t x, uint64_t candidates)
{
    uint64_t white[RING + 4], border = 0;
    for (int d = 0; d < RING; d++) {
        const float *neighbour = rows[1 + ring_y[d]] + PAD + x + ring_x[d];
        uint64_t dark = 0;
        for (uint32_t i = 0; i < 64; i += PT_LANES)
            dark |= (uint64_t)vm_bits(vf_lt(vf_load(neighbour + i), vf_load(thresholds + i))) << i;
        white[d] = ~dark;
    }
    for (int d = 0; d < 4; d++)
        white[RING + d] = white[d];
    for (int d = 0; d < RING; d++)
        border |= white[d] & white[d + 1] & white[d + 2] & white[d + 3] & white[d + 4];
    return candidates & ~border;
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

static void decide_band(struct fill *fill, uint32_t band, uint32_t thread)
{
    const struct entries *e = &fill->entries;
    float *rows = fill->rows + thread * 4 * fill->row_stride, *thresholds = rows + 3 * fill->row_stride;
    uint32_t first, last, count = fill->kept[band];
    size_t base = band * fill->band_entries;
    int32_t held[3] = { INT32_MIN, INT32_MIN, INT32_MIN }; // which row each slot of the ring holds
    band_rows(fill, band, &first, &last);
    memset(fill->touched + first * fill->words, 0, (last - first) * fill->words);
    fill->listed[band] = count;
    if (!fill->first && !rows_dirty(fill, first, last))
        return;
    for (uint32_t y = first; y < last; y++) {
        const float *around[3];
        if (!fill->first && !rows_dirty(fill, y, y + 1))
            continue;
        for (int32_t k = 0; k < 3; k++) {
            int32_t row = (int32_t)y - 1 + k, slot = (row + 3) % 3;
            around[k] = rows + (size_t)slot * fill->row_stride;
            if (held[slot] != row)
                load_z(fill, row, rows + (size_t)slot * fill->row_stride);
            held[slot] = row;
        }
        for (uint32_t x = fill->view->rect[0] & ~63u; x < fill->view->rect[2]; x += 64) {
            if (!fill->first && !word_dirty(fill, x / 64, y))
                continue;
            uint64_t fills = load_thresholds(fill, x, y, around, thresholds);
            if (fills)
                fills = not_border(around, thresholds, x, fills);
            for (; fills; fills &= fills - 1, count++) {
                uint32_t i = (uint32_t)__builtin_ctzll(fills);
                e->x[base + count] = x + i;
                e->y[base + count] = y;
                e->threshold[base + count] = thresholds[i];
            }
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
        fill->touched[word] = 1;
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
    memset(fill->touched + first * fill->words, 0, (last - first) * fill->words);
    fill->listed[band] = 0;
    if (!fill->first && !rows_dirty(fill, first, last))
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
            size_t pixel = (size_t)e->y[i] * fill->view->width + e->x[i];
            fill->keys[pixel] = e->old_key[i];
            fill->from[pixel] = e->old_from[i];
            fill->touched[e->y[i] * fill->words + e->x[i] / 64] = 1;
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

enum step { DECIDE, APPLY, MARK, RESTORE };

struct step_job {
    struct fill *fill;
    enum step step;
};

static void step_bands(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct step_job *job = context;
    for (uint32_t band = begin; band < end && !pt_cpu_cancelled(job->fill->call); band++)
        switch (job->step) {
        case DECIDE: decide_band(job->fill, band, thread); break;
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
        uint8_t *swap = fill->dirty;
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
    fill->row_stride = view->width + 2 * PAD;
    size_t words = fill->words * view->height, room = count * fill->band_entries + PT_LANES;
    size_t rows = threads * 4 * fill->row_stride;
    uint8_t *lists = pt_cpu_scratch(fill->call, 1, room * 36);
    uint8_t *memory = pt_cpu_scratch(fill->call, 0, words * 10 + rows * 4 + count * 8);
    if (!lists || !memory)
        return PATINA_ERROR_MEMORY;
    e->key = (uint64_t *)lists;
    e->old_key = e->key + room;
    e->x = (uint32_t *)(e->old_key + room);
    e->y = e->x + room;
    e->from = e->y + room;
    e->old_from = e->from + room;
    e->threshold = (float *)(e->old_from + room);
    fill->filled = (uint64_t *)memory;
    fill->rows = (float *)(fill->filled + words);
    fill->kept = (uint32_t *)(fill->rows + rows);
    fill->listed = fill->kept + count;
    fill->dirty = (uint8_t *)(fill->listed + count);
    fill->touched = fill->dirty + words;
    memset(fill->filled, 0, words * 8);
    memset(fill->kept, 0, count * 8 + words * 2);
    return PATINA_OK;
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
    repeat(&fill, DECIDE, APPLY, args->iterations);
    repeat(&fill, MARK, RESTORE, args->unfills);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
