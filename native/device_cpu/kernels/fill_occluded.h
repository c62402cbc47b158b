// SPDX-License-Identifier: GPL-3.0-or-later
// Which covered pixels nearer ones hide: no run of five of their neighbours is white. SPEC 2.2
//
// z of neighbours lies in vectors beside those of the pixels. Few pixels are left when the least d_eff there can be has been
// tried: they are listed, so that their own is looked up for whole vectors of them.
#ifndef PT_FILL_OCCLUDED_H
#define PT_FILL_OCCLUDED_H

#include "fill.h"

// z of PT_LANES pixels from (x, y) on, +inf beyond the plane. x: a multiple of PT_LANES.
static inline vf load_z(const struct fill *fill, uint32_t x, uint32_t y)
{
    const uint32_t width = fill->view->width;
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z));
    if (x >= width || y >= fill->view->height)
        return empty;
    vf z = vi_float(vi_load_z(fill->keys + (size_t)y * width + x));
    return width - x >= PT_LANES ? z : vf_select(vm_first(width - x), z, empty);
}

struct column { // z of rows y - 1, y, y + 1
    vf z[3];
};

static inline struct column load_column(const struct fill *fill, uint32_t x, uint32_t y)
{
    return (struct column){ { load_z(fill, x, y - 1), load_z(fill, x, y), load_z(fill, x, y + 1) } };
}

// A neighbour is dark if it is nearer than a threshold. A pixel has no run of five white ones where its threshold lies
// beyond *farthest, the farthest of the eight runs' nearest. Which of `some` have none, even by the least d_eff?
static inline vm suspects(const struct fill *fill, const struct column *before, const struct column *own,
                          const struct column *behind, vm some, vf *farthest)
{
    const vf most = own->z[1] - pt_least_distance(fill->view, fill->args->least, own->z[1]);
    vf west[3], east[3], pair[RING];
    for (int k = 0; k < 3; k++) {
        west[k] = vf_west(before->z[k], own->z[k]);
        east[k] = vf_east(own->z[k], behind->z[k]);
    }
    const vf z[RING] = { east[1], east[2], own->z[2], west[2], west[1], west[0], own->z[0], east[0] };
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

// Lists those of PT_LANES pixels (x, y) that `some` names.
static inline size_t list(const struct entries *e, size_t count, vi x, vi y, vf threshold, vm some)
{
    const uint32_t bits = vm_bits(some);
    vi_pack(e->x + count, x, bits);
    vi_pack(e->y + count, y, bits);
    vi_pack((uint32_t *)e->threshold + count, vf_bits(threshold), bits);
    return count + (size_t)__builtin_popcount(bits);
}

static inline vm entry_lanes(size_t at, size_t end) { return vm_first(end - at < PT_LANES ? (uint32_t)(end - at) : PT_LANES); }

// Of the entries from `at` to `end`, suspects with their farthest runs, those stay that are hidden by their own d_eff as well:
// with z - d_eff for a threshold.
static size_t keep_occluded(const struct fill *fill, size_t at, size_t end)
{
    const struct entries *e = &fill->entries;
    size_t count = at;
    for (; at < end; at += PT_LANES) {
        const vi x = vi_load(e->x + at), y = vi_load(e->y + at), pixel = vi_add(vi_mul(y, vi_set(fill->view->width)), x);
        const vf farthest = vf_load(e->threshold + at);
        vm some = entry_lanes(at, end);
        const vf z = vi_float(vi_gather_z(fill->keys, pixel, some));
        const vi source = pt_source_gather(fill->from, pixel, some);
        vf distance = vf_gather(fill->deff, source, some); // d_eff at level 0 spares most a look at the normals
        some = vm_and(some, vf_lt(farthest, z - distance));
        if (fill->view->level && vm_bits(some)) {
            distance = vf_level_distance(fill->view, distance, vf_gather_inverse(fill->normals, source, some), z);
            some = vm_and(some, vf_lt(farthest, z - distance));
        }
        count = list(e, count, x, y, z - distance, some);
    }
    return count;
}

// The same by themselves.
static inline vm suspects_at(const struct fill *fill, uint32_t x, uint32_t y, vm some, vf *farthest)
{
    const struct column before = load_column(fill, x - PT_LANES, y), own = load_column(fill, x, y);
    const struct column behind = load_column(fill, x + PT_LANES, y);
    return suspects(fill, &before, &own, &behind, some, farthest);
}

// Which pixels are covered; lists suspects within view.rect: all but a few parts of a surface show a white run.
static size_t scan_row(const struct fill *fill, uint32_t y, size_t count)
{
    const uint32_t *rect = fill->view->rect;
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z));
    uint64_t *covered = fill->covered + y * fill->words;
    struct column before, own = load_column(fill, 0u - PT_LANES, y), behind = load_column(fill, 0, y);
    for (uint32_t word = 0; word < fill->words; word++) {
        covered[word] = 0;
        for (uint32_t i = 0; i < 64; i += 8) // two rows ahead: 0.7 ms of one thread in place of 0.92 at 1024 x 1024
            __builtin_prefetch(fill->keys + (size_t)(y + 2) * fill->view->width + 64 * word + i);
        for (uint32_t i = 0; i < 64; i += PT_LANES) {
            const uint32_t x = 64 * word + i;
            before = own;
            own = behind;
            behind = load_column(fill, x + PT_LANES, y);
            vm some = vf_lt(own.z[1], empty);
            if (!vm_bits(some))
                continue;
            covered[word] |= (uint64_t)vm_bits(some) << i;
            vf farthest;
            some = suspects(fill, &before, &own, &behind, some, &farthest);
            if (!vm_bits(some))
                continue;
            const size_t at = (size_t)y * fill->view->width + x;
            const vi column = vi_add(vi_set(x), vi_lanes());
            __builtin_prefetch(fill->from + at);
            __builtin_prefetch(fill->deff + at);
            some = vm_and(some, vi_lt_unsigned(vi_sub(column, vi_set(rect[0])), vi_set(rect[2] - rect[0])));
            count = list(&fill->entries, count, column, vi_set(y), farthest, some);
        }
    }
    return count;
}

static void scan_band(const struct fill *fill, uint32_t band)
{
    const struct entries *e = &fill->entries;
    const size_t base = band * fill->band_entries;
    uint32_t first, last;
    band_rows(fill, band, &first, &last);
    // a row beyond the rectangle is looked at, never changed
    if (first && !band)
        scan_row(fill, first - 1, base);
    if (last == fill->view->rect[3] && last < fill->view->height)
        scan_row(fill, last, base);
    memset(fill->suspect + first * fill->words, 0, (last - first) * fill->words * 8);
    size_t count = base;
    for (uint32_t y = first; y < last; y++)
        count = scan_row(fill, y, count);
    count = keep_occluded(fill, base, count);
    for (size_t i = base; i < count; i++)
        fill->suspect[e->y[i] * fill->words + e->x[i] / 64] |= 1ull << e->x[i] % 64;
}

#endif
