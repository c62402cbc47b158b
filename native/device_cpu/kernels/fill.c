// SPDX-License-Identifier: GPL-3.0-or-later
// fill: one phase of hole filling. [D 3.2, 3.3] with the rule of SPEC 2.2; twin of shaders/kernels/fill.comp
//
// A step first decides from the state before it, then applies: what changes is listed by bands of rows, so the planes are
// never copied. 64 pixels are decided at once: vector compares give eight masks of dark neighbours, five bit operations
// a mask find the runs. Entries stay listed with the pixel's state before the phase: un-filling walks the lists alone.
#include "device_cpu/cpu.h"
#include "device_cpu/simd.h"

enum { BAND_ROWS = 16, RING = 8, PAD = 64 };

// The ring, anticlockwise from east.
static const int8_t ring_x[RING] = { 1, 1, 0, -1, -1, -1, 0, 1 };
static const int8_t ring_y[RING] = { 0, 1, 1, 1, 0, -1, -1, -1 };

struct entry {
    uint64_t key, old_key; // after this step; before the phase
    uint32_t pixel, from, old_from;
    float threshold; // before the phase: a neighbour nearer than this is dark
};

struct fill {
    const struct pt_cpu_call *call;
    const struct fill_args *args;
    const struct view_args *view;
    uint64_t *keys;
    uint32_t *from;
    const float *normals, *deff;
    uint64_t *filled;  // a bit a pixel: filled in this phase
    size_t words;      // of `filled` in a row
    struct entry *entries;
    uint32_t *kept, *listed; // per band: entries of earlier steps; with those of this step
    size_t band_entries;
    float *rows;       // per thread: three rows of z and one of thresholds, padded by PAD on both sides
    size_t row_stride; // floats
    atomic_uint changed;
};

static struct entry *band_list(const struct fill *fill, uint32_t band)
{
    return fill->entries + band * fill->band_entries;
}

static uint32_t bands(const struct fill *fill)
{
    return (fill->view->rect[3] - fill->view->rect[1] + BAND_ROWS - 1) / BAND_ROWS;
}

static float z_at(const struct fill *fill, int32_t x, int32_t y) // outside the plane: nothing
{
    if (x < 0 || y < 0 || x >= (int32_t)fill->view->width || y >= (int32_t)fill->view->height)
        return pt_float(PT_KEY_EMPTY_Z);
    return pt_float((uint32_t)(fill->keys[(size_t)y * fill->view->width + (size_t)x] >> 32));
}

static float own_distance(const struct fill *fill, uint32_t from, float z)
{
    return pt_level_distance(fill->view, fill->deff[from], fill->normals[4 * (size_t)from + 3], z);
}

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

// 2. Thresholds of 64 pixels from x on, and which of them are candidates.
static uint64_t load_thresholds(const struct fill *fill, uint32_t x, uint32_t y, const float *z_row, float *thresholds)
{
    const struct view_args *view = fill->view;
    uint64_t candidates = 0;
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z));
    const uint32_t *from = fill->from + (size_t)y * view->width + x;
    for (uint32_t i = 0; i < 64; i += PT_LANES) {
        vf z = vf_load(z_row + PAD + x + i);
        vm some = vf_lt(z, empty);
        if (!fill->args->occluded) {
            candidates |= (uint64_t)vm_bits(vm_not(some)) << i;
            vf_store(thresholds + i, empty, vm_first(PT_LANES));
            continue;
        }
        vf t = z;
        if (vm_bits(some)) {
            vi source = vi_load(from + i);
            vf d = vf_gather(fill->deff, source, some);
            if (view->level) {
                vi w = vi_add(vi_mul(source, vi_set(4)), vi_set(3));
                d = vf_max(d, vf_footprint(view, z) * vf_gather(fill->normals, w, some));
            }
            t = z - d;
        }
        vf_store(thresholds + i, t, vm_first(PT_LANES));
        candidates |= (uint64_t)vm_bits(some) << i;
    }
    return candidates;
}

// 3. Which of the candidates have no five consecutive white ring neighbours.
static uint64_t decide(const float *const rows[3], const float *thresholds, uint32_t x, uint64_t candidates)
{
    uint64_t white[RING + 4];
    for (int d = 0; d < RING; d++) {
        const float *neighbour = rows[1 + ring_y[d]] + PAD + x + ring_x[d];
        uint64_t dark = 0;
        for (uint32_t i = 0; i < 64; i += PT_LANES)
            dark |= (uint64_t)vm_bits(vf_lt(vf_load(neighbour + i), vf_load(thresholds + i))) << i;
        white[d] = ~dark;
    }
    uint64_t border = 0;
    for (int d = 0; d < 4; d++)
        white[RING + d] = white[d];
    for (int d = 0; d < RING; d++)
        border |= white[d] & white[d + 1] & white[d + 2] & white[d + 3] & white[d + 4];
    return candidates & ~border;
}

// 4. The least key among the neighbours; refined: its surface's tangent plane at this pixel.
static struct entry source_of(const struct fill *fill, uint32_t x, uint32_t y, float threshold)
{
    const struct view_args *view = fill->view;
    uint32_t pixel = y * view->width + x, best = pixel;
    struct entry entry = { .key = UINT64_MAX, .pixel = pixel, .threshold = threshold };
    for (int d = 0; d < RING; d++) {
        int32_t nx = (int32_t)x + ring_x[d], ny = (int32_t)y + ring_y[d];
        if (nx < 0 || ny < 0 || nx >= (int32_t)view->width || ny >= (int32_t)view->height)
            continue;
        uint32_t at = (uint32_t)ny * view->width + (uint32_t)nx;
        if (fill->keys[at] < entry.key) {
            entry.key = fill->keys[at];
            best = at;
        }
    }
    entry.from = fill->from[best];
    if (fill->args->refined) {
        float ray_p[2], ray_q[2], z = pt_float((uint32_t)(entry.key >> 32));
        pt_ray(view, (int32_t)x, (int32_t)y, ray_p);
        pt_ray(view, (int32_t)(best % view->width), (int32_t)(best / view->width), ray_q);
        z = pt_plane_depth(view, fill->normals + 4 * (size_t)entry.from, ray_q, z, ray_p,
                           own_distance(fill, entry.from, z));
        entry.key = (uint64_t)pt_bits(z) << 32 | (uint32_t)entry.key;
    }
    return entry;
}

static void decide_band(struct fill *fill, uint32_t band, uint32_t thread)
{
    const uint32_t *rect = fill->view->rect;
    uint32_t first = rect[1] + band * BAND_ROWS, last = first + BAND_ROWS < rect[3] ? first + BAND_ROWS : rect[3];
    float *rows = fill->rows + thread * 4 * fill->row_stride, *thresholds = rows + 3 * fill->row_stride;
    struct entry *list = band_list(fill, band);
    uint32_t count = fill->kept[band];
    load_z(fill, (int32_t)first - 1, rows);
    load_z(fill, (int32_t)first, rows + fill->row_stride);
    for (uint32_t y = first; y < last; y++) {
        const float *around[3];
        for (uint32_t k = 0; k < 3; k++)
            around[k] = rows + (y - first + k) % 3 * fill->row_stride;
        load_z(fill, (int32_t)y + 1, rows + (y - first + 2) % 3 * fill->row_stride);
        for (uint32_t x = rect[0] & ~63u; x < rect[2]; x += 64) {
            uint64_t candidates = load_thresholds(fill, x, y, around[1], thresholds);
            uint32_t left = fill->view->width - x;
            if (left < 64)
                candidates &= (1ull << left) - 1;
            if (!candidates)
                continue;
            uint64_t fills = decide(around, thresholds, x, candidates);
            for (; fills; fills &= fills - 1) {
                uint32_t i = (uint32_t)__builtin_ctzll(fills);
                list[count++] = source_of(fill, x + i, y, thresholds[i]);
            }
        }
    }
    fill->listed[band] = count;
}

static void apply_band(struct fill *fill, uint32_t band)
{
    struct entry *list = band_list(fill, band);
    uint32_t keep = fill->kept[band], changed = fill->listed[band] - keep;
    for (uint32_t i = keep; i < fill->listed[band]; i++) {
        struct entry entry = list[i];
        uint32_t x = entry.pixel % fill->view->width, y = entry.pixel / fill->view->width;
        uint64_t *word = &fill->filled[y * fill->words + x / 64], bit = 1ull << x % 64;
        entry.old_key = fill->keys[entry.pixel];
        entry.old_from = fill->from[entry.pixel];
        fill->keys[entry.pixel] = entry.key;
        fill->from[entry.pixel] = entry.from;
        if (*word & bit)
            continue; // filled before in this phase: that entry knows the state before it
        *word |= bit;
        list[keep++] = entry;
    }
    fill->kept[band] = keep;
    if (changed)
        atomic_fetch_add_explicit(&fill->changed, changed, memory_order_relaxed);
}

// 5. Un-filling: an entry whose pixel shows four consecutive white cells is marked ...
static void mark_band(struct fill *fill, uint32_t band)
{
    struct entry *list = band_list(fill, band);
    for (uint32_t i = 0; i < fill->kept[band]; i++) {
        int32_t x = (int32_t)(list[i].pixel % fill->view->width), y = (int32_t)(list[i].pixel / fill->view->width);
        uint32_t white = 0;
        for (int d = 0; d < RING; d++)
            white |= (uint32_t) !(z_at(fill, x + ring_x[d], y + ring_y[d]) < list[i].threshold) << d;
        list[i].key = pt_four_white(white); // of no other use any more
    }
}

// ... and gets back what it was before the phase.
static void restore_band(struct fill *fill, uint32_t band)
{
    struct entry *list = band_list(fill, band);
    uint32_t keep = 0;
    for (uint32_t i = 0; i < fill->kept[band]; i++) {
        if (!list[i].key) {
            list[keep++] = list[i];
            continue;
        }
        fill->keys[list[i].pixel] = list[i].old_key;
        fill->from[list[i].pixel] = list[i].old_from;
    }
    uint32_t changed = fill->kept[band] - keep;
    fill->kept[band] = keep;
    if (changed)
        atomic_fetch_add_explicit(&fill->changed, changed, memory_order_relaxed);
}

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
    for (uint32_t i = 0; i < most && !pt_cpu_cancelled(fill->call); i++) {
        atomic_store_explicit(&fill->changed, 0, memory_order_relaxed);
        run_step(fill, look);
        run_step(fill, act);
        if (!atomic_load_explicit(&fill->changed, memory_order_relaxed))
            return;
    }
}

static int allocate(struct fill *fill)
{
    const struct view_args *view = fill->view;
    size_t threads = pt_pool_threads(fill->call->pool), count = bands(fill);
    fill->words = (view->width + 63) / 64;
    fill->band_entries = (size_t)view->width * BAND_ROWS;
    fill->row_stride = view->width + 2 * PAD;
    size_t filled = fill->words * view->height * 8, rows = threads * 4 * fill->row_stride * 4;
    fill->entries = pt_cpu_scratch(fill->call, 2, count * fill->band_entries * sizeof *fill->entries);
    uint8_t *memory = pt_cpu_scratch(fill->call, 1, filled + rows + count * 8);
    if (!fill->entries || !memory)
        return PATINA_ERROR_MEMORY;
    fill->filled = (uint64_t *)memory;
    fill->rows = (float *)(memory + filled);
    fill->kept = (uint32_t *)(memory + filled + rows);
    fill->listed = fill->kept + count;
    memset(fill->filled, 0, filled);
    memset(fill->kept, 0, count * 8);
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
