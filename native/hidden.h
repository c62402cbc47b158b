// SPDX-License-Identifier: GPL-3.0-or-later
// Chunks that scatter need not look at: keys only become less, so that one whose nearest point lies behind what every pixel of its
// rectangle holds already changes nothing (SPEC 13).
#ifndef PT_HIDDEN_H
#define PT_HIDDEN_H

#include "shared/view.h"

#include <string.h>

enum { PT_DEPTHS = 1 << 9, PT_DEPTH_SHIFT = 22, PT_HIDDEN_AT_ONCE = 8 };

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

// Where there are more pixels than points, to look takes as long as to draw them. keys: of planes so wide; others may store less
// meanwhile.
static inline int pt_is_hidden(const struct chunk_view *chunk, const uint64_t *keys, uint32_t width)
{
    const uint32_t columns = chunk->column_end - chunk->column_first, rows = chunk->row_end - chunk->row_first;
    const uint64_t nearer = (uint64_t)pt_chunk_depth(chunk) << 32; // than all of it
    if (!nearer || !columns || (uint64_t)columns * rows > chunk->count)
        return 0;
    for (uint32_t y = chunk->row_first; y < chunk->row_end; y++) {
        const uint64_t *row = keys + (size_t)y * width + chunk->column_first;
        for (uint32_t x = 0; x < columns;) {
            const uint32_t end = columns - x < PT_HIDDEN_AT_ONCE ? columns : x + PT_HIDDEN_AT_ONCE;
            uint64_t open = 0; // its first bit: some key is no less. None has that bit
            for (; x < end; x++)
                open |= nearer - 1 - __atomic_load_n(row + x, __ATOMIC_RELAXED);
            if (open >> 63)
                return 0;
        }
    }
    return rows > 0;
}

#endif
