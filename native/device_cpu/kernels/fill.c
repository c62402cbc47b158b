// SPDX-License-Identifier: GPL-3.0-or-later
// fill: hole filling, of background pixels, then of occluded ones. [D 3.2, 3.3] with the rule of SPEC 2.2; twin of
// shaders/kernels/fill.comp
//
// The planes are read once: that gives a bit a pixel that is covered, and one that may be occluded. Background pixels are
// filled and un-filled by bits alone, 64 at once: eight masks of dark neighbours, four bit operations a mask find the runs.
// A step first decides from the state before it, then applies: what changes is listed by bands of rows, so the planes are
// never copied. Entries stay listed with the pixel's state before the phase, for un-filling.
// A step looks only where the one before it changed something.
#include "device_cpu/rows.h"

enum { BAND_ROWS = 16, RING = 8, PAD = 64 };

// The ring, anticlockwise from east.
static const int8_t ring_x[RING] = { 1, 1, 0, -1, -1, -1, 0, 1 };
static const int8_t ring_y[RING] = { 0, 1, 1, 1, 0, -1, -1, -1 };

// The entries of a band, as columns.
struct entries {
    uint64_t *key, *old_key; // after this step; before the phase
    uint32_t *x, *y, *qx, *qy, *from, *old_from; // q: the neighbour that it takes the key of
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
    uint64_t *covered, *suspect; // not empty; maybe occluded: as the planes were before, or filled since
    uint64_t *filled;            // in this phase
    uint64_t *dirty, *touched;   // changed by the last step; by this one
    size_t words;                // in a row
    struct entries entries;      // of all bands
    size_t band_entries;
    uint32_t *kept, *listed; // per band: entries of earlier steps; with those of this step
    float *rows;             // per thread: three rows of z, padded by PAD on both sides, and one of farthest runs
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

// Calls work for the words of a band that have bits of the plane, or pixels beside them: where to look. Passes on the count.
typedef size_t word_work(struct fill *fill, size_t word, uint32_t y, uint64_t look, size_t count);

static inline size_t over_asked(struct fill *fill, uint32_t band, const uint64_t *plane, size_t count, word_work *work)
{
    const uint32_t *rect = fill->view->rect;
    const size_t words = fill->words, word_end = (rect[2] + 63) / 64;
    uint32_t first, last;
    band_rows(fill, band, &first, &last);
    memset(fill->touched + first * words, 0, (last - first) * words * 8);
    if (!any_near(fill, plane, first, last))
        return count;
    for (uint32_t y = first; y < last; y++) {
        const uint64_t *own = plane + y * words, *below = y > rect[1] ? own - words : own;
        const uint64_t *above = y + 1 < rect[3] ? own + words : own;
        size_t word = rect[0] / 64;
        uint64_t west = word ? below[word - 1] | own[word - 1] | above[word - 1] : 0;
        uint64_t here = below[word] | own[word] | above[word], east;
        for (; word < word_end; word++, west = here, here = east) {
            east = word + 1 < words ? below[word + 1] | own[word + 1] | above[word + 1] : 0;
            uint64_t look = west >> 63 | here << 1 | here | here >> 1 | east << 63;
            if (look)
                count = work(fill, word, y, look, count);
        }
    }
    return count;
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

// 2. A neighbour is dark if it is nearer than a threshold. A pixel has no run of five white ones where its threshold lies
// beyond *farthest, the farthest of the eight runs' nearest. Which of `some` have none, even by the least d_eff? rows: z from
// the first of PT_LANES pixels on.
static inline vm suspects(const struct fill *fill, const float *const rows[3], vm some, vf *farthest)
{
    const vf own = vf_load(rows[1]), most = own - pt_least_distance(fill->view, fill->args->least, own);
    vf z[RING], pair[RING];
    for (int d = 0; d < RING; d++)
        z[d] = vf_load(rows[1 + ring_y[d]] + ring_x[d]);
    // the runs above and below: most pixels have one of these
    vf above = vf_min(vf_min(z[1], z[2]), z[3]), below = vf_min(vf_min(z[5], z[6]), z[7]);
    *farthest = vf_min(vf_min(z[0], z[4]), vf_max(above, below));
    some = vm_and(some, vf_lt(*farthest, most));
    if (!vm_bits(some))
        return some;
    for (int d = 0; d < RING; d++)
        pair[d] = vf_min(z[d], z[(d + 1) % RING]);
    for (int d = 0; d < RING; d++)
        *farthest = vf_max(*farthest, vf_min(vf_min(pair[d], pair[(d + 2) % RING]), z[(d + 4) % RING]));
    return vm_and(some, vf_lt(*farthest, most));
}

// Which of them have none by their own d_eff. There *threshold = z - d_eff.
static inline vm occluded(const struct fill *fill, size_t at, vf z, vf farthest, vm some, vf *threshold)
{
    vf distance;
    if (fill->view->level) { // d_eff at level 0 spares most a look at the normals
        vi source = pt_source_of(fill->from, at);
        distance = vf_gather(fill->deff, source, some);
        some = vm_and(some, vf_lt(farthest, z - distance));
        if (vm_bits(some))
            distance = vf_level_distance(fill->view, distance, vf_gather_inverse(fill->normals, source, some), z);
    } else {
        distance = pt_own_distance(fill->view, fill->deff, fill->normals, fill->from, at, z, some);
    }
    *threshold = z - distance;
    return vm_and(some, vf_lt(farthest, *threshold));
}

// Pixels that are covered, and those that nearer ones may hide: all but a few parts of a surface show a white run.
static void scan_row(const struct fill *fill, const float *const rows[3], float *farthest, uint32_t y)
{
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z));
    uint64_t *covered = fill->covered + y * fill->words, *suspect = fill->suspect + y * fill->words;
    for (size_t word = 0; word < fill->words; word++) {
        covered[word] = suspect[word] = 0;
        for (uint32_t i = 0; i < 64; i += PT_LANES) {
            const size_t x = 64 * word + i;
            const float *const around[3] = { rows[0] + PAD + x, rows[1] + PAD + x, rows[2] + PAD + x };
            vm some = vf_lt(vf_load(around[1]), empty);
            if (!vm_bits(some))
                continue;
            covered[word] |= (uint64_t)vm_bits(some) << i;
            vf run;
            some = suspects(fill, around, some, &run);
            if (!vm_bits(some))
                continue;
            suspect[word] |= (uint64_t)vm_bits(some) << i;
            vf_store(farthest + x, run, vm_first(PT_LANES));
        }
    }
}

// Leaves the suspects that their own d_eff does not clear. Within view.rect alone: beyond it `from` may be anything.
static void confirm_row(const struct fill *fill, const float *z, const float *farthest, uint32_t y)
{
    uint64_t *suspect = fill->suspect + y * fill->words;
    for (size_t word = fill->view->rect[0] / 64; word < (fill->view->rect[2] + 63) / 64; word++) {
        const uint64_t asked = suspect[word];
        for (uint32_t i = 0; asked && i < 64; i += PT_LANES) {
            const size_t x = 64 * word + i;
            vm some = vm_of_bits((uint32_t)(asked >> i));
            vf threshold;
            if (!vm_bits(some))
                continue;
            vm left = occluded(fill, (size_t)y * fill->view->width + x, vf_load(z + PAD + x), vf_load(farthest + x), some,
                               &threshold);
            suspect[word] ^= (uint64_t)vm_bits(vm_and(some, vm_not(left))) << i;
        }
    }
}

static void scan_band(const struct fill *fill, uint32_t band, uint32_t thread)
{
    float *rows = fill->rows + thread * ROWS * fill->row_stride;
    int32_t held[3] = { INT32_MIN, INT32_MIN, INT32_MIN }; // which row each slot of the ring holds
    uint32_t first, last;
    band_rows(fill, band, &first, &last);
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
        float *farthest = rows + 3 * fill->row_stride;
        scan_row(fill, around, farthest, y);
        if (y >= first && y < last)
            confirm_row(fill, around[1], farthest, y);
    }
}

// 3. Which of 64 pixels have `length` consecutive white ring neighbours.
static inline uint64_t white_run(const uint64_t dark[RING], int length)
{
    uint64_t any = 0;
    for (int d = 0; d < RING; d++) {
        uint64_t run = ~dark[d];
        for (int k = 1; k < length; k++)
            run &= ~dark[(d + k) % RING];
        any |= run;
    }
    return any;
}

// The same where what is covered is dark.
static inline uint64_t empty_run(const struct fill *fill, size_t word, uint32_t y, int length)
{
    const uint64_t *row = fill->covered + y * fill->words;
    const struct trio none = { 0, 0, 0 }, own = trio_of(fill, row, word);
    const struct trio below = y ? trio_of(fill, row - fill->words, word) : none;
    const struct trio above = y + 1 < fill->view->height ? trio_of(fill, row + fill->words, word) : none;
    return white_run((const uint64_t[RING]){ own.east, above.east, above.own, above.west, own.west, below.west, below.own,
                                             below.east }, length);
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
    uint64_t fills = 0;
    float patch[3][PATCH];
    load_patch(fill, word, y, patch);
    for (uint32_t i = 0; i < 64; i += PT_LANES) {
        const float *const rows[3] = { patch[0] + PT_LANES + i, patch[1] + PT_LANES + i, patch[2] + PT_LANES + i };
        vf z = vf_load(rows[1]);
        vm some = vm_and(vf_lt(z, empty), vm_of_bits((uint32_t)(look >> i)));
        if (!vm_bits(some))
            continue;
        vf farthest, threshold;
        some = suspects(fill, rows, some, &farthest);
        if (!vm_bits(some))
            continue;
        some = occluded(fill, (size_t)y * fill->view->width + 64 * word + i, z, farthest, some, &threshold);
        fills |= (uint64_t)vm_bits(some) << i;
        vf_store(thresholds + i, threshold, vm_first(PT_LANES));
    }
    return fills;
}

// 4. Lists the pixel (x, y): it takes the least key among its neighbours.
static void list_pixel(const struct fill *fill, size_t at, uint32_t x, uint32_t y, float threshold)
{
    const struct entries *e = &fill->entries;
    const uint32_t width = fill->view->width, height = fill->view->height;
    const size_t pixel = (size_t)y * width + x;
    uint64_t least = UINT64_MAX, from = pixel, side = 0; // no branch: any neighbour may be it
    for (uint32_t d = 0; d < RING; d++) {
        if (x + (uint32_t)(int32_t)ring_x[d] >= width || y + (uint32_t)(int32_t)ring_y[d] >= height)
            continue;
        uint64_t q = pixel + (uint64_t)(int64_t)(ring_y[d] * (int32_t)width + ring_x[d]);
        uint64_t less = 0 - (uint64_t)(fill->keys[q] < least);
        least ^= (least ^ fill->keys[q]) & less;
        from ^= (from ^ q) & less;
        side ^= (side ^ d) & less;
    }
    e->x[at] = x;
    e->y[at] = y;
    e->qx[at] = x + (uint32_t)(int32_t)ring_x[side];
    e->qy[at] = y + (uint32_t)(int32_t)ring_y[side];
    e->threshold[at] = threshold;
    e->key[at] = least;
    e->from[at] = fill->from[from];
    __builtin_prefetch(fill->normals + 4 * (size_t)e->from[at]);
    __builtin_prefetch(fill->deff + e->from[at]);
}

// Refined: the depth of that surface's tangent plane at these `count` entries' pixels.
static void refine(const struct fill *fill, size_t at, uint32_t count)
{
    const struct view_args *view = fill->view;
    const struct entries *e = &fill->entries;
    const vm lanes = vm_first(count);
    vi source = vi_load(e->from + at);
    vf z = vi_float(vi_load_z(e->key + at)), n[4], ray_p[2], ray_q[2];
    vf_gather4(fill->normals, source, lanes, n);
    vf_ray_of(view, vi_load(e->x + at), vi_load(e->y + at), ray_p);
    vf_ray_of(view, vi_load(e->qx + at), vi_load(e->qy + at), ray_q);
    z = vf_plane_depth(view, n, ray_q, z, ray_p, vf_level_distance(view, vf_gather(fill->deff, source, lanes), n[3], z));
    vi_store_keys(e->key + at, vf_bits(z), vi_load_id(e->key + at), vm_bits(lanes));
}

static size_t list_word(struct fill *fill, size_t word, uint32_t y, uint64_t look, size_t count)
{
    const uint64_t left = fill->view->width - word * 64;
    float thresholds[64];
    if (left < 64)
        look &= (1ull << left) - 1;
    if (!fill->occluded)
        look &= ~fill->covered[y * fill->words + word];
    if (look)
        look = fill->occluded ? occluded_to_fill(fill, word, y, look, thresholds) : look & ~empty_run(fill, word, y, 5);
    for (; look; look &= look - 1, count++) {
        uint32_t i = (uint32_t)__builtin_ctzll(look);
        list_pixel(fill, count, (uint32_t)word * 64 + i, y, fill->occluded ? thresholds[i] : pt_float(PT_KEY_EMPTY_Z));
    }
    return count;
}

static void decide_band(struct fill *fill, uint32_t band)
{
    const size_t base = band * fill->band_entries, kept = base + fill->kept[band];
    // no pixel is filled without something dark in its row or above, and in its row or below: rows within view.rect suffice
    const uint64_t *first = fill->occluded ? fill->suspect : fill->covered;
    size_t listed = over_asked(fill, band, fill->first ? first : fill->dirty, kept, list_word);
    fill->listed[band] = (uint32_t)(listed - base);
    if (fill->first) {
        uint32_t begin, end;
        band_rows(fill, band, &begin, &end);
        memset(fill->filled + begin * fill->words, 0, (end - begin) * fill->words * 8);
    }
    // only now: the surfaces are under way, and a vector load waits for the scalar stores that it covers
    for (size_t i = kept; fill->args->refined && i < listed; i += PT_LANES)
        refine(fill, i, listed - i < PT_LANES ? (uint32_t)(listed - i) : PT_LANES);
}

static void move_entry(const struct entries *e, size_t to, size_t from)
{
    e->x[to] = e->x[from];
    e->y[to] = e->y[from];
    e->threshold[to] = e->threshold[from];
    e->old_key[to] = e->old_key[from];
    e->old_from[to] = e->old_from[from];
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
        fill->suspect[word] |= bit;
        fill->keys[pixel] = e->key[i];
        fill->from[pixel] = e->from[i];
        if (fill->filled[word] & bit)
            continue; // filled before in this phase: that entry knows the state before it
        fill->filled[word] |= bit;
        e->old_key[i] = old_key;
        e->old_from[i] = old_from;
        move_entry(e, keep++, i);
    }
    fill->kept[band] = (uint32_t)(keep - base);
}

// ---- un-filling ----------------------------------------------------------------------------------------------------------

// A filled pixel that shows four consecutive white cells is marked ...
static size_t mark_word(struct fill *fill, size_t word, uint32_t y, uint64_t look, size_t count)
{
    look &= fill->filled[y * fill->words + word];
    if (look && !fill->occluded)
        look &= empty_run(fill, word, y, 4);
    fill->touched[y * fill->words + word] = look;
    return count + (look != 0);
}

// What was occluded has thresholds of its own: entries without such cells lose their mark.
static void unmark_entries(const struct fill *fill, uint32_t band)
{
    const struct entries *e = &fill->entries;
    const vi width = vi_set(fill->view->width), height = vi_set(fill->view->height);
    size_t base = band * fill->band_entries, end = base + fill->kept[band];
    for (size_t i = base; i < end; i += PT_LANES) {
        vm lanes = vm_first(end - i < PT_LANES ? (uint32_t)(end - i) : PT_LANES);
        vi x = vi_load(e->x + i), y = vi_load(e->y + i), white = vi_set(0);
        vf threshold = vf_load(e->threshold + i);
        for (int d = 0; d < RING; d++) {
            vi qx = vi_add(x, vi_set((uint32_t)(int32_t)ring_x[d])), qy = vi_add(y, vi_set((uint32_t)(int32_t)ring_y[d]));
            vm inside = vm_and(lanes, vm_and(vi_lt_unsigned(qx, width), vi_lt_unsigned(qy, height)));
            vf z = vi_float(vi_gather_z(fill->keys, vi_add(vi_mul(qy, width), qx), inside));
            vm dark = vm_and(inside, vf_lt(z, threshold));
            white = vi_or(white, vi_select(dark, vi_set(0), vi_set(0x101u << d))); // twice: runs wrap round
        }
        vi run = vi_and(vi_and(white, vi_shr(white, 1)), vi_and(vi_shr(white, 2), vi_shr(white, 3)));
        uint32_t stay = vm_bits(vm_and(lanes, vi_eq(vi_and(run, vi_set(255)), vi_set(0))));
        for (; stay; stay &= stay - 1) {
            size_t k = i + (uint32_t)__builtin_ctz(stay);
            fill->touched[e->y[k] * fill->words + e->x[k] / 64] &= ~(1ull << e->x[k] % 64);
        }
    }
}

static void mark_band(struct fill *fill, uint32_t band)
{
    const uint64_t *plane = fill->first ? fill->filled : fill->dirty;
    fill->listed[band] = (uint32_t)over_asked(fill, band, plane, 0, mark_word);
    if (fill->listed[band] && fill->occluded)
        unmark_entries(fill, band);
}

// ... and gets back what it was before the phase.
static void restore_band(struct fill *fill, uint32_t band)
{
    const struct entries *e = &fill->entries;
    const size_t base = band * fill->band_entries;
    size_t end = base + fill->kept[band];
    if (!fill->listed[band])
        return;
    for (size_t i = base; i < end;) {
        size_t pixel = (size_t)e->y[i] * fill->view->width + e->x[i], word = e->y[i] * fill->words + e->x[i] / 64;
        uint64_t bit = 1ull << e->x[i] % 64;
        if (!(fill->touched[word] & bit)) {
            i++;
            continue;
        }
        fill->keys[pixel] = e->old_key[i];
        fill->from[pixel] = e->old_from[i];
        fill->filled[word] &= ~bit;
        if (!fill->occluded) // what was empty before the phase
            fill->covered[word] &= ~bit;
        move_entry(e, i, --end);
    }
    note_change(fill, fill->kept[band] - (uint32_t)(end - base));
    fill->kept[band] = (uint32_t)(end - base);
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
    uint8_t *lists = pt_cpu_scratch(fill->call, 1, room * 44);
    fill->rows = pt_cpu_scratch(fill->call, 0, rows * 4 + words * 5 * 8 + count * 8);
    if (!lists || !fill->rows)
        return PATINA_ERROR_MEMORY;
    e->key = (uint64_t *)lists;
    e->old_key = e->key + room;
    e->x = (uint32_t *)(e->old_key + room);
    e->y = e->x + room;
    e->qx = e->y + room;
    e->qy = e->qx + room;
    e->from = e->qy + room;
    e->old_from = e->from + room;
    e->threshold = (float *)(e->old_from + room);
    fill->covered = (uint64_t *)(fill->rows + rows);
    fill->suspect = fill->covered + words;
    fill->filled = fill->suspect + words;
    fill->dirty = fill->filled + words;
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
