// SPDX-License-Identifier: GPL-3.0-or-later
// What fill knows of its planes: a bit a pixel, and lists of what changes.
#ifndef PT_FILL_H
#define PT_FILL_H

#include "device_cpu/rows.h"

enum { BAND_ROWS = 16, RING = 8 };

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
    int occluded;            // the phase
    int first;               // its first step looks everywhere
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

// ---- planes of bits --------------------------------------------------------------------------------------------------------

struct trio { // of 64 pixels: the bits of those to the west of them, their own, those to the east
    uint64_t west, own, east;
};

static struct trio trio_of(const struct fill *fill, const uint64_t *row, size_t word)
{
    uint64_t own = row[word], before = word ? row[word - 1] : 0, behind = word + 1 < fill->words ? row[word + 1] : 0;
    return (struct trio){ own << 1 | before >> 63, own, own >> 1 | behind << 63 };
}

// Calls work for the words of a band that have bits of the plane, or pixels beside them: where to look. Passes on the count.
// Clears what is touched. Within view.rect: nothing beyond it ever changes, and no pixel does with all that is dark on one side.
typedef size_t word_work(struct fill *fill, size_t word, uint32_t y, uint64_t look, size_t count);

static inline size_t over_asked(struct fill *fill, uint32_t band, const uint64_t *plane, size_t count, word_work *work)
{
    const uint32_t *rect = fill->view->rect;
    const size_t begin = rect[0] / 64, end = (rect[2] + 63) / 64;
    uint32_t first, last;
    band_rows(fill, band, &first, &last);
    for (uint32_t y = first; y < last; y++) {
        const uint64_t *own = plane + y * fill->words, *below = y > rect[1] ? own - fill->words : own;
        const uint64_t *above = y + 1 < rect[3] ? own + fill->words : own;
        uint64_t *near = fill->touched + y * fill->words, any = 0;
        for (size_t word = begin; word < end; word++)
            any |= near[word] = below[word] | own[word] | above[word];
        if (!any)
            continue;
        uint64_t west = 0, here = near[begin], east;
        for (size_t word = begin; word < end; word++, west = here, here = east) {
            east = word + 1 < end ? near[word + 1] : 0;
            near[word] = 0;
            uint64_t look = west >> 63 | here << 1 | here | here >> 1 | east << 63;
            if (look)
                count = work(fill, word, y, look, count);
        }
    }
    return count;
}

// Which of 64 pixels have `length` consecutive white ring neighbours.
static inline uint64_t white_run(const uint64_t dark[RING], int length)
{
    uint64_t pair[RING], none = UINT64_MAX;
    for (int d = 0; d < RING; d++)
        pair[d] = dark[d] | dark[(d + 1) % RING];
    for (int d = 0; d < RING; d++)
        none &= pair[d] | pair[(d + 2) % RING] | (length == 5 ? dark[(d + 4) % RING] : 0);
    return ~none;
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

#endif
