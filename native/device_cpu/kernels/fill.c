// SPDX-License-Identifier: GPL-3.0-or-later
// fill: hole filling, of background pixels, then of occluded ones. [D 3.2, 3.3] with the rule of SPEC 2.2; twin of
// shaders/kernels/fill.comp
//
// The planes are read once: that gives a bit a pixel that is covered, and one that may be occluded. Background pixels are
// filled and un-filled by bits alone, 64 at once: eight masks of dark neighbours, three bit operations a mask find the runs.
// A step first decides from the state before it, then applies: what changes is listed by bands of rows, so the planes are
// never copied. Occluded pixels' entries stay listed with the pixel's state before the phase, for un-filling, and a step looks
// for such only where the one before it changed something. What is listed is worked on by whole vectors.
#include "fill_background.h"
#include "fill_occluded.h"
#include "shared/filling.h"

// ---- deciding ------------------------------------------------------------------------------------------------------------

struct pixels { // PT_LANES pixels
    vi x, y, at;
    vm inside; // the plane
};

// Neighbours on side d of the pixels (x, y) that `lanes` names.
static inline struct pixels neighbours(const struct fill *fill, vi x, vi y, int d, vm lanes)
{
    const vi width = vi_set(fill->view->width), height = vi_set(fill->view->height);
    const vi qx = vi_add(x, vi_set((uint32_t)(int32_t)ring_x[d])), qy = vi_add(y, vi_set((uint32_t)(int32_t)ring_y[d]));
    return (struct pixels){qx, qy, vi_add(vi_mul(qy, width), qx),
                           vm_and(lanes, vm_and(vi_lt_unsigned(qx, width), vi_lt_unsigned(qy, height)))};
}

// 1. PT_LANES entries from `at` on, as far as `end`, take the least key among their neighbours.
static void take_least(const struct fill *fill, size_t at, size_t end)
{
    const struct entries *e = &fill->entries;
    const vi x = vi_load(e->x + at), y = vi_load(e->y + at);
    const vm lanes = entry_lanes(at, end);
    vi z = vi_set(UINT32_MAX), id = z, from = vi_add(vi_mul(y, vi_set(fill->view->width)), x), qx = x, qy = y;
    for (int d = 0; d < RING; d++) {
        const struct pixels q = neighbours(fill, x, y, d, lanes);
        vi other_z = vi_gather_z(fill->keys, q.at, q.inside), other_id = vi_gather_id(fill->keys, q.at, q.inside);
        vm less = vm_and(q.inside, pt_less(other_z, other_id, z, id));
        z = vi_select(less, other_z, z);
        id = vi_select(less, other_id, id);
        from = vi_select(less, q.at, from);
        qx = vi_select(less, q.x, qx);
        qy = vi_select(less, q.y, qy);
    }
    vi_store_where(e->qx + at, qx, lanes);
    vi_store_where(e->qy + at, qy, lanes);
    vi_store_where(e->from + at, vi_gather(fill->from, from, lanes), lanes);
    vi_store_keys(e->key + at, z, id, vm_bits(lanes));
    for (size_t i = at; i < end && i < at + PT_LANES; i++) {
        __builtin_prefetch(fill->normals + 4 * (size_t)e->from[i]);
        __builtin_prefetch(fill->span + e->from[i]);
    }
}

// How far z of the entries' surfaces, now z, goes at most, given how far it goes by itself.
static vf farthest_beside(const struct fill *fill, size_t at, vf farthest, vf z_q, vf z, vm lanes)
{
    const vi x = vi_load(fill->entries.x + at), y = vi_load(fill->entries.y + at);
    for (int d = 0; d < RING; d++) {
        const struct pixels q = neighbours(fill, x, y, d, lanes);
        const vf beside = vi_float(vi_gather_z(fill->keys, q.at, q.inside));
        farthest = vf_select(q.inside, vf_farther(farthest, beside, z_q, z), farthest);
    }
    return farthest;
}

// 2. Refined: the depth of that surface's tangent plane at the entries' pixels.
static void refine(const struct fill *fill, size_t at, size_t end)
{
    const struct view_args *view = fill->view;
    const struct entries *e = &fill->entries;
    const vm lanes = entry_lanes(at, end);
    vi source = vi_load(e->from + at);
    vf z_q = vi_float(vi_load_z(e->key + at)), n[4], ray_p[2], ray_q[2];
    vf_gather4(fill->normals, source, lanes, n);
    vf_ray_of(view, vi_load(e->x + at), vi_load(e->y + at), ray_p);
    vf_ray_of(view, vi_load(e->qx + at), vi_load(e->qy + at), ray_q);
    const vf span = vf_gather(fill->span, source, lanes), limit = vf_level_distance(view, span, n[3], z_q);
    const vi cell = vi_cell_of(source, fill->args->from_width, view->level, view->width);
    const vf z = vf_plane_depth(view, n, ray_q, z_q, ray_p, limit);
    vf farthest = vf_farthest(fill->keys, fill->from, cell, source, lanes, z_q, span, n[3]);
    const vm beyond = vm_and(lanes, vf_lt(farthest, z));
    if (vm_bits(beyond))
        farthest = farthest_beside(fill, at, farthest, z_q, z, beyond);
    vi_store_keys(e->key + at, vf_bits(vf_max(vf_min(z, farthest), z_q)), vi_load_id(e->key + at), vm_bits(lanes));
}

// ---- reach -----------------------------------------------------------------------------------------------------------------

// How much wider than in the middle a picture shows what faces the eye there; at least, and no less than 1.
static float stretch(const struct view_args *view, uint32_t x, uint32_t y)
{
    const float scale = (float)(1u << view->level);
    const float px = ((float)((view->origin_x >> view->level) + (int32_t)x) + 0.5f) * scale;
    const float py = ((float)((view->origin_y >> view->level) + (int32_t)y) + 0.5f) * scale;
    const float u = view->ray_x0 + view->ray_xs * px, v = view->ray_y0 + view->ray_ys * py;
    return view->perspective ? pt_max(pt_max(u < 0.0f ? -u : u, v < 0.0f ? -v : v), 1.0f) : 1.0f;
}

// Whether the surface that a neighbour shows reaches the pixel (x, y).
static int reaches(const struct fill *fill, uint32_t x, uint32_t y, uint64_t key, uint32_t source)
{
    const struct fill_args *args = fill->args;
    const struct view_args *view = fill->view;
    const float scale = (float)(1u << view->level), z = pt_float((uint32_t)(key >> 32));
    const float width = view->perspective ? view->footprint * z : view->footprint;
    const float share = (uint32_t)key >= args->discs_first ? args->disc_reach : args->reach;
    const float way = (fill->span[source] * share) * pt_rcp(width * fill->normals[4 * (size_t)source + 3]);
    const float most = way * stretch(view, x, y) + PT_FILL_SLACK * scale;
    const float dx = ((float)x + 0.5f) * scale - ((float)(source % args->from_width) + 0.5f);
    const float dy = ((float)y + 0.5f) * scale - ((float)(source / args->from_width) + 0.5f);
    return dx * dx + dy * dy <= most * most;
}

// The least key of those neighbours that reach the pixel; 0: there is none.
static int take_reaching(const struct fill *fill, size_t i)
{
    const struct entries *e = &fill->entries;
    const uint32_t x = e->x[i], y = e->y[i], width = fill->view->width;
    const float threshold = fill->occluded ? e->threshold[i] : pt_float(PT_KEY_EMPTY_Z);
    uint64_t best = UINT64_MAX;
    for (int d = 0; d < RING; d++) {
        const uint32_t qx = x + (uint32_t)(int32_t)ring_x[d], qy = y + (uint32_t)(int32_t)ring_y[d];
        if (qx >= width || qy >= fill->view->height)
            continue;
        const size_t at = (size_t)qy * width + qx;
        const uint64_t key = fill->keys[at];
        if (key >= best || !(pt_float((uint32_t)(key >> 32)) < threshold))
            continue;
        if (!reaches(fill, x, y, key, fill->from[at]))
            continue;
        best = key;
        e->qx[i] = qx;
        e->qy[i] = qy;
        e->from[i] = fill->from[at];
    }
    e->key[i] = best;
    return best != UINT64_MAX;
}

static void move_new(const struct entries *e, size_t to, size_t from)
{
    e->x[to] = e->x[from];
    e->y[to] = e->y[from];
    e->qx[to] = e->qx[from];
    e->qy[to] = e->qy[from];
    e->from[to] = e->from[from];
    e->key[to] = e->key[from];
    e->threshold[to] = e->threshold[from];
}

// Drops entries that nothing reaches.
static size_t keep_reached(struct fill *fill, size_t begin, size_t end)
{
    const struct entries *e = &fill->entries;
    size_t kept = begin;
    for (size_t i = begin; i < end; i++) {
        if (reaches(fill, e->x[i], e->y[i], e->key[i], e->from[i]) || take_reaching(fill, i)) {
            if (kept != i)
                move_new(e, kept, i);
            kept++;
        } else {
            fill->touched[word_of(fill, e->x[i], e->y[i])] &= ~bit_of(e->x[i]);
        }
    }
    return kept;
}

static void decide_band(struct fill *fill, uint32_t band)
{
    const size_t base = band * fill->band_entries, kept = base + fill->kept[band];
    size_t listed = fill->occluded ? list_hidden(fill, band, kept) : list_empty(fill, band, kept);
    if (fill->first)
        clear_band(fill, band, fill->filled);
    for (size_t i = kept; i < listed; i += PT_LANES)
        take_least(fill, i, listed);
    if (fill->args->reach > 0.0f)
        listed = keep_reached(fill, kept, listed);
    fill->listed[band] = (uint32_t)(listed - base);
    // only now: the surfaces are under way
    for (size_t i = kept; fill->args->refined && i < listed; i += PT_LANES)
        refine(fill, i, listed);
}

static void move_entry(const struct entries *e, size_t to, size_t from)
{
    e->x[to] = e->x[from];
    e->y[to] = e->y[from];
    e->threshold[to] = e->threshold[from];
    e->old_key[to] = e->old_key[from];
    e->old_from[to] = e->old_from[from];
}

// Written once a step at the most: other threads read what lies beside it.
static void note_change(struct fill *fill, uint32_t changed)
{
    if (changed && !atomic_load_explicit(&fill->changed, memory_order_relaxed))
        atomic_store_explicit(&fill->changed, 1, memory_order_relaxed);
}

static void apply_band(struct fill *fill, uint32_t band)
{
    const struct span span = band_words(fill, band);
    const struct entries *e = &fill->entries;
    size_t base = band * fill->band_entries, keep = base + fill->kept[band], end = base + fill->listed[band];
    if (keep == end)
        return;
    note_change(fill, (uint32_t)(end - keep));
    for (size_t i = keep; i < end; i++) {
        const size_t pixel = (size_t)e->y[i] * fill->view->width + e->x[i];
        // filled before in this phase: that entry knows the state before it
        if (fill->occluded && !(fill->filled[word_of(fill, e->x[i], e->y[i])] & bit_of(e->x[i]))) {
            e->old_key[i] = fill->keys[pixel];
            e->old_from[i] = fill->from[pixel];
            move_entry(e, keep++, i);
        }
        fill->keys[pixel] = e->key[i];
        fill->from[pixel] = e->from[i];
    }
    fill->kept[band] = (uint32_t)(keep - base);
    for (size_t i = span.begin; i < span.end; i += WORDS) {
        const vi_words touched = *words_at(fill->touched + i);
        *words_at(fill->covered + i) |= touched;
        *words_at(fill->suspect + i) |= touched;
        *words_at(fill->filled + i) |= touched;
    }
}

// ---- un-filling ----------------------------------------------------------------------------------------------------------

// An occluded pixel that shows four consecutive white cells by its own threshold is marked ...
static void mark_entries(const struct fill *fill, uint32_t band)
{
    const struct entries *e = &fill->entries;
    size_t base = band * fill->band_entries, end = base + fill->kept[band];
    clear_band(fill, band, fill->touched);
    for (size_t i = base; i < end; i += PT_LANES) {
        vm lanes = entry_lanes(i, end);
        vi x = vi_load(e->x + i), y = vi_load(e->y + i), white = vi_set(0);
        vf threshold = vf_load(e->threshold + i);
        for (int d = 0; d < RING; d++) {
            const struct pixels q = neighbours(fill, x, y, d, lanes);
            vm dark = vm_and(q.inside, vf_lt(vi_float(vi_gather_z(fill->keys, q.at, q.inside)), threshold));
            white = vi_or(white, vi_select(dark, vi_set(0), vi_set(0x101u << d))); // twice: runs wrap round
        }
        vi run = vi_and(vi_and(white, vi_shr(white, 1)), vi_and(vi_shr(white, 2), vi_shr(white, 3)));
        uint32_t marked = vm_bits(vm_and(lanes, vi_lt_unsigned(vi_set(0), vi_and(run, vi_set(255)))));
        for (; marked; marked &= marked - 1) {
            const size_t k = i + (uint32_t)__builtin_ctz(marked);
            fill->touched[word_of(fill, e->x[k], e->y[k])] |= bit_of(e->x[k]);
        }
    }
}

// ... and gets back what it was before the phase. Returns how many.
static uint32_t restore_entries(const struct fill *fill, uint32_t band)
{
    const struct entries *e = &fill->entries;
    const size_t base = band * fill->band_entries, kept = fill->kept[band];
    size_t end = base + kept;
    for (size_t i = base; i < end;) {
        const size_t pixel = (size_t)e->y[i] * fill->view->width + e->x[i], word = word_of(fill, e->x[i], e->y[i]);
        if (!(fill->touched[word] & bit_of(e->x[i]))) {
            i++;
            continue;
        }
        fill->keys[pixel] = e->old_key[i];
        fill->from[pixel] = e->old_from[i];
        fill->filled[word] &= ~bit_of(e->x[i]);
        move_entry(e, i, --end);
    }
    fill->kept[band] = (uint32_t)(end - base);
    return (uint32_t)(base + kept - end);
}

static void mark_band(struct fill *fill, uint32_t band)
{
    if (fill->occluded)
        mark_entries(fill, band);
    else
        mark_empty(fill, band);
}

static void restore_band(struct fill *fill, uint32_t band)
{
    note_change(fill, fill->occluded ? restore_entries(fill, band) : restore_empty(fill, band));
}

// ---- steps -------------------------------------------------------------------------------------------------------------

enum step { SCAN, FIND_STRAYS, LEAVE_ALONE, LEAVE_STRAYS, DECIDE, APPLY, MARK, RESTORE };

struct step_job {
    struct fill *fill;
    enum step step;
};

static void step_bands(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct step_job *job = context;
    (void)thread;
    for (uint32_t band = begin; band < end && !pt_cpu_cancelled(job->fill->call); band++)
        switch (job->step) {
        case SCAN: scan_band(job->fill, band); break;
        case FIND_STRAYS: find_strays(job->fill, band); break;
        case LEAVE_ALONE: leave_strays(job->fill, band, 1); break;
        case LEAVE_STRAYS: leave_strays(job->fill, band, 0); break;
        case DECIDE: decide_band(job->fill, band); break;
        case APPLY: apply_band(job->fill, band); break;
        case MARK: mark_band(job->fill, band); break;
        case RESTORE: restore_band(job->fill, band); break;
        }
}

static void run_step(struct fill *fill, enum step step)
{
    struct step_job job = {fill, step};
    pt_parallel(fill->call->pool, bands(fill), 1, step_bands, &job);
}

// Repeats the pair of steps until nothing changes, `most` times at the most.
static void repeat(struct fill *fill, enum step look, enum step act, uint32_t most)
{
    fill->first = 1;
    for (uint32_t i = 0; i < most && !pt_cpu_cancelled(fill->call); i++) {
        atomic_store_explicit(&fill->changed, 0, memory_order_relaxed);
        if (!fill->occluded && fill->closing != fill->covered)
            run_step(fill, look == DECIDE ? LEAVE_ALONE : LEAVE_STRAYS);
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
    size_t count = bands(fill);
    uint64_t **const planes[] = {&fill->covered, &fill->suspect, &fill->filled, &fill->dirty,
                                 &fill->touched, &fill->strays,  &fill->closing};
    enum { PLANES = sizeof planes / sizeof *planes };
    fill->words = ((view->width + 65) / 64 + WORDS - 1) / WORDS * WORDS;
    // every pixel may be kept, and be filled again in this step
    fill->band_entries = 2 * (size_t)view->width * BAND_ROWS + PT_LANES;
    size_t words = fill->words * (view->height + 2) + 2, room = count * fill->band_entries + PT_LANES;
    uint8_t *lists = pt_cpu_scratch(fill->call, PT_CPU_SPARSE, room * 44); // few pixels change
    uint64_t *bits = pt_cpu_scratch(fill->call, 0, words * PLANES * 8 + count * 8);
    if (!lists || !bits)
        return PATINA_ERROR_MEMORY;
    for (size_t i = 0; i < PLANES; i++)
        *planes[i] = bits + i * words + fill->words + 1;
    fill->kept = (uint32_t *)(bits + PLANES * words);
    fill->listed = fill->kept + count;
    e->key = (uint64_t *)lists;
    e->old_key = e->key + room;
    e->x = (uint32_t *)(e->old_key + room);
    e->y = e->x + room;
    e->qx = e->y + room;
    e->qy = e->qx + room;
    e->from = e->qy + room;
    e->old_from = e->from + room;
    e->threshold = (float *)(e->old_from + room);
    return PATINA_OK;
}

// The background is closed by what is no stray.
static void tell_strays(struct fill *fill, const size_t words)
{
    uint64_t *const own = fill->closing;
    atomic_store_explicit(&fill->alone, 0, memory_order_relaxed);
    if (fill->args->alone)
        run_step(fill, FIND_STRAYS);
    fill->closing = fill->covered;
    if (!atomic_load_explicit(&fill->alone, memory_order_relaxed))
        return;
    fill->closing = own;
    memset(own - fill->words - 1, 0, words * 8); // beyond the rectangle
}

static void run_phase(struct fill *fill, int occluded)
{
    fill->occluded = occluded;
    memset(fill->kept, 0, bands(fill) * sizeof *fill->kept);
    repeat(fill, DECIDE, APPLY, fill->args->iterations);
    repeat(fill, MARK, RESTORE, fill->args->unfills);
}

int PT_KERNEL_ENTRY(fill)(const struct pt_cpu_call *call)
{
    const struct fill_args *args = call->arguments;
    struct fill fill = {.call = call,
                        .args = args,
                        .view = &args->view,
                        .keys = PT_DATA(call, fill, keys),
                        .from = PT_DATA(call, fill, from),
                        .normals = PT_DATA(call, fill, normal),
                        .deff = PT_DATA(call, fill, deff),
                        .span = PT_DATA(call, fill, span)};
    if (args->view.rect[0] >= args->view.rect[2] || args->view.rect[1] >= args->view.rect[3])
        return PATINA_OK;
    int error = allocate(&fill);
    if (error)
        return error;
    run_step(&fill, SCAN);
    if (args->phases & PT_FILL_BACKGROUND) {
        tell_strays(&fill, fill.words * (args->view.height + 2) + 2);
        run_phase(&fill, 0);
    }
    if (args->phases & PT_FILL_OCCLUDED)
        run_phase(&fill, 1);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
