// SPDX-License-Identifier: GPL-3.0-or-later
// Chunks that scatter need not look at: keys only become less, so that one whose nearest point lies behind what every pixel of its
// rectangle holds already changes nothing (SPEC 13).
#ifndef PT_HIDDEN_H
#define PT_HIDDEN_H

#include "shared/view.h"

#include <string.h>

enum { PT_DEPTHS = 1 << 9, PT_DEPTH_SHIFT = 22, PT_TILE = 16, PT_TILE_POINTS = 4 };

// Bits of the least z: of floats >= 0 they have the order of their values, and z_least has no sign.
static inline uint32_t pt_chunk_depth(const struct chunk_view *chunk)
{
    uint32_t word;
    memcpy(&word, &chunk->z_least, sizeof word);
    return word;
}

// Below PT_DEPTHS; each step of z is 4/3 or 3/2 times the one before. Nearer ones are drawn first; within a step chunks beside each
// other stay so.
static inline uint32_t pt_depth_step(const struct chunk_view *chunk) { return pt_chunk_depth(chunk) >> PT_DEPTH_SHIFT; }

// Tiles of the plane and, of each, what z no key of it lies beyond, as its bits: found when it is first asked for, and true from then on, for
// keys only become less. So a large rectangle is a few numbers, and not all of its pixels.
struct pt_tiles {
    const uint64_t *keys;
    uint32_t width, height, columns, *farthest;
};

static inline size_t pt_tile_count(uint32_t width, uint32_t height)
{
    return (size_t)((width + PT_TILE - 1) / PT_TILE) * ((height + PT_TILE - 1) / PT_TILE);
}

// farthest: room for as many words; nothing is known of any.
static inline void pt_tiles_begin(const uint64_t *keys, uint32_t width, uint32_t height, uint32_t *farthest,
                                  struct pt_tiles *out)
{
    memset(farthest, 0xFF, pt_tile_count(width, height) * sizeof *farthest);
    *out = (struct pt_tiles){keys, width, height, (width + PT_TILE - 1) / PT_TILE, farthest};
}

// Of the bits of z of these pixels the greatest, or one that is not below `depth`. Others may store less meanwhile.
static inline uint32_t pt_farthest_key(const struct pt_tiles *tiles, const uint32_t rect[4], uint32_t depth)
{
    uint64_t most = 0;
    for (uint32_t y = rect[1]; y < rect[3] && most >> 32 < depth; y++) {
        const uint64_t *row = tiles->keys + (size_t)y * tiles->width;
        for (uint32_t x = rect[0]; x < rect[2]; x++) {
            const uint64_t key = __atomic_load_n(row + x, __ATOMIC_RELAXED);
            most = key > most ? key : most;
        }
    }
    return (uint32_t)(most >> 32);
}

static inline uint32_t pt_less(uint32_t a, uint32_t b) { return a < b ? a : b; }

// What a rectangle has of a tile lies nearer than `depth`.
static inline int pt_tile_hides(const struct pt_tiles *tiles, uint32_t column, uint32_t row, const uint32_t rect[4],
                                uint32_t depth)
{
    uint32_t *farthest = tiles->farthest + (size_t)row * tiles->columns + column;
    if (__atomic_load_n(farthest, __ATOMIC_RELAXED) < depth)
        return 1;
    const uint32_t x = column * PT_TILE, y = row * PT_TILE;
    const uint32_t tile[4] = {x, y, pt_less(x + PT_TILE, tiles->width), pt_less(y + PT_TILE, tiles->height)};
    const uint32_t own[4] = {rect[0] > x ? rect[0] : x, rect[1] > y ? rect[1] : y, pt_less(rect[2], tile[2]),
                             pt_less(rect[3], tile[3])};
    const uint32_t most = pt_farthest_key(tiles, own, depth);
    if (most < depth && !memcmp(own, tile, sizeof own))
        __atomic_store_n(farthest, most, __ATOMIC_RELAXED); // a greater one that comes late is true, too
    return most < depth;
}

// Where there are more tiles than so many points, to look takes as long as to draw them.
static inline int pt_is_hidden(const struct chunk_view *chunk, const struct pt_tiles *tiles)
{
    const uint32_t rect[4] = {chunk->column_first, chunk->row_first, chunk->column_end, chunk->row_end};
    const uint32_t depth = pt_chunk_depth(chunk);
    if (!depth || rect[0] >= rect[2] || rect[1] >= rect[3])
        return 0;
    const uint32_t left = rect[0] / PT_TILE, right = (rect[2] - 1) / PT_TILE, low = rect[1] / PT_TILE,
                   high = (rect[3] - 1) / PT_TILE;
    if ((uint64_t)(right - left + 1) * (high - low + 1) > chunk->count / PT_TILE_POINTS + 1)
        return 0;
    for (uint32_t row = low; row <= high; row++)
        for (uint32_t column = left; column <= right; column++)
            if (!pt_tile_hides(tiles, column, row, rect, depth))
                return 0;
    return 1;
}

#endif
