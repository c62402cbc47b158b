// SPDX-License-Identifier: GPL-3.0-or-later
// Which covered pixels nearer ones hide: no run of five of their neighbours is white. SPEC 2.2
//
// A neighbour is dark if it is nearer than a threshold. No run of five is white where two dark ones are three or four steps of
// the ring apart: where the threshold lies beyond the least, over all such two, of the farther. z of neighbours lies in vectors
// beside those of the pixels. Few pixels are left when the least d_eff there can be has been tried: they are listed, so that
// their own is looked up for whole vectors of them.
#ifndef PT_FILL_OCCLUDED_H
#define PT_FILL_OCCLUDED_H

#include "fill.h"

struct row {
    vf west, own, east, beside, all; // z; the least of west and east, and of the three
};

static inline struct row load_row(const uint64_t *keys, const struct view_args *view, uint32_t x, uint32_t y, int edge)
{
    const struct pt_row_z z = pt_load_row_z(keys, view->width, view->height, x, y, edge);
    const vf beside = vf_min(z.west, z.east);
    return (struct row){z.west, z.own, z.east, beside, vf_min(beside, z.own)};
}

// The least, over all two that are apart, of the farther.
static inline vf nearest_two(const struct row *below, const struct row *row, const struct row *above)
{
    const vf west = vf_min(vf_min(below->west, row->west), above->west);
    const vf east = vf_min(vf_min(below->east, row->east), above->east);
    const vf sides = vf_min(vf_max(row->east, west), vf_max(row->west, east));
    const vf rows = vf_min(vf_max(above->own, below->all), vf_max(below->own, above->all));
    return vf_min(vf_min(sides, rows), vf_min(vf_max(above->west, below->east), vf_max(above->east, below->west)));
}

// Lists those of PT_LANES pixels (x, y) that `bits` names.
static inline size_t list(const struct entries *e, size_t count, vi x, vi y, vf threshold, uint32_t bits)
{
    vi_pack(e->x + count, x, bits);
    vi_pack(e->y + count, y, bits);
    vi_pack((uint32_t *)e->threshold + count, vf_bits(threshold), bits);
    return count + (size_t)__builtin_popcount(bits);
}

// Of PT_LANES columns from x on and some rows from y on, lists what may be hidden of the pixels that `asked` names, a word a
// row: bit x % 64 is the first column's.
static inline __attribute__((always_inline)) size_t list_columns(const struct fill *fill, uint32_t x, uint32_t y, uint32_t rows,
                                                                 const uint64_t *asked, uint64_t within, int edge, size_t count)
{
    const struct view_args view = *fill->view; // of our own: what is listed does not change it
    const uint64_t *keys = fill->keys;
    const float least = fill->args->least, share = fill->args->least_share;
    const size_t words = fill->words;
    struct row below = load_row(keys, &view, x, y - 1, edge), row = load_row(keys, &view, x, y, edge), above;
    for (uint32_t k = 0; k < rows; k++, below = row, row = above) {
        above = load_row(keys, &view, x, y + k + 1, edge);
        // one of the two is beside, or one is above and one is below: not so of most pixels
        const vf most = row.own - pt_least_distance(&view, least, share, row.own);
        uint32_t bits = (uint32_t)((asked[k * words] & within) >> x % 64);
        bits &= vm_bits(vf_lt(vf_min(row.beside, vf_max(below.all, above.all)), most));
        if (!bits)
            continue;
        const vf nearest = nearest_two(&below, &row, &above);
        bits &= vm_bits(vf_lt(nearest, most));
        const size_t at = (size_t)(y + k) * view.width + x;
        __builtin_prefetch(fill->from + at);
        __builtin_prefetch(fill->deff + at);
        count = list(&fill->entries, count, vi_add(vi_set(x), vi_lanes()), vi_set(y + k), nearest, bits);
    }
    return count;
}

static inline vm entry_lanes(size_t at, size_t end) { return vm_first(end - at < PT_LANES ? (uint32_t)(end - at) : PT_LANES); }

// Of the entries from `at` to `end`, suspects, those stay that are hidden by their own d_eff as well: with z - d_eff for a
// threshold, and a bit in the plane.
static size_t keep_occluded(const struct fill *fill, uint64_t *plane, size_t at, size_t end)
{
    const struct entries *e = &fill->entries;
    size_t count = at, kept = at;
    for (; at < end; at += PT_LANES) {
        const vi x = vi_load(e->x + at), y = vi_load(e->y + at), pixel = vi_add(vi_mul(y, vi_set(fill->view->width)), x);
        const vf nearest = vf_load(e->threshold + at);
        vm some = entry_lanes(at, end);
        const vf z = vi_float(vi_gather_z(fill->keys, pixel, some));
        const vi source = pt_source_gather(fill->from, pixel, some);
        vf distance = vf_gather(fill->deff, source, some); // d_eff at level 0 spares most a look at the normals
        some = vm_and(some, vf_lt(nearest, z - distance));
        if (fill->view->level && vm_bits(some)) {
            distance = vf_level_distance(fill->view, distance, vf_gather_inverse(fill->normals, source, some), z);
            some = vm_and(some, vf_lt(nearest, z - distance));
        }
        count = list(e, count, x, y, z - distance, vm_bits(some));
    }
    for (; kept < count; kept++)
        plane[word_of(fill, e->x[kept], e->y[kept])] |= bit_of(e->x[kept]);
    return count;
}

// Lists what may be hidden of the pixels of a band that a plane names.
static size_t list_suspects(const struct fill *fill, uint32_t band, const uint64_t *plane, size_t count)
{
    const uint32_t *rect = fill->view->rect;
    uint32_t first, last;
    band_rows(fill, band, &first, &last);
    for (uint32_t word = rect[0] / 64; 64 * word < rect[2]; word++) {
        const uint64_t within = bits_between(64 * word < rect[0] ? rect[0] % 64 : 0, rect[2] - 64 * word);
        uint64_t any = 0;
        uint32_t begin = last, end = first;
        for (uint32_t y = first; y < last; y++)
            if (plane[y * fill->words + word] & within) {
                any |= plane[y * fill->words + word] & within;
                begin = begin < y ? begin : y;
                end = y + 1;
            }
        const uint64_t *asked = plane + begin * fill->words + word;
        for (uint32_t i = 0; i < 64 && any >> i; i += PT_LANES) {
            const uint32_t x = 64 * word + i;
            if (!vm_bits(vm_of_bits((uint32_t)(any >> i))))
                continue;
            if (x && x + PT_LANES < fill->view->width)
                count = list_columns(fill, x, begin, end - begin, asked, within, 0, count);
            else
                count = list_columns(fill, x, begin, end - begin, asked, within, 1, count);
        }
    }
    return count;
}

// Covered pixels that are hidden, with their thresholds.
static size_t list_hidden(const struct fill *fill, uint32_t band, size_t base)
{
    const struct span span = band_words(fill, band);
    vi_words any = {0};
    for (size_t i = span.begin; i < span.end; i += WORDS) {
        vi_words asked;
        wider((fill->first ? fill->suspect : fill->dirty) + i, fill->words, &asked);
        any |= *words_at(fill->touched + i) = asked & *words_at(fill->covered + i);
    }
    const size_t end = any[0] | any[1] | any[2] | any[3] ? list_suspects(fill, band, fill->touched, base) : base;
    clear_band(fill, band, fill->touched);
    return keep_occluded(fill, fill->touched, base, end);
}

// ---- scanning ----------------------------------------------------------------------------------------------------------

// Which pixels of a row are covered.
static void scan_row(const struct fill *fill, uint32_t y)
{
    const uint32_t width = fill->view->width;
    const uint64_t *keys = fill->keys + (size_t)y * width;
    for (uint32_t word = 0; 64 * word < width; word++) {
        uint64_t bits = 0;
        for (uint32_t i = 0; i < 64 && 64 * word + i < width; i += PT_LANES)
            bits |= (uint64_t)vm_bits(vi_lt_unsigned(vi_load_z(keys + 64 * word + i), vi_set(PT_KEY_EMPTY_Z))) << i;
        fill->covered[y * fill->words + word] = bits & bits_between(0, width - 64 * word);
    }
}

// All planes begin. A row beyond the rectangle is looked at, never changed.
static void scan_band(struct fill *fill, uint32_t band)
{
    uint64_t *const planes[] = {fill->covered, fill->suspect, fill->dirty, fill->touched};
    const struct span span = band_words(fill, band);
    uint32_t first, last;
    band_rows(fill, band, &first, &last);
    const size_t before = band ? 0 : fill->words + 1, behind = last < fill->view->rect[3] ? 0 : fill->words + 1;
    for (size_t i = 0; i < sizeof planes / sizeof *planes; i++)
        memset(planes[i] + span.begin - before, 0, (before + span.end - span.begin + behind) * 8);
    for (uint32_t y = first - (first && !band); y < last || (y == fill->view->rect[3] && y < fill->view->height); y++)
        scan_row(fill, y);
    const size_t base = band * fill->band_entries;
    keep_occluded(fill, fill->suspect, base, list_suspects(fill, band, fill->covered, base));
}

#endif
