// SPDX-License-Identifier: GPL-3.0-or-later
// What fill knows of its planes: a bit a pixel, and lists of what changes.
#ifndef PT_FILL_H
#define PT_FILL_H

#include "device_cpu/rows.h"
#include "shared/filling.h"

enum { BAND_ROWS = 16, RING = 8, WORDS = sizeof(vi_words) / 8 };

// The ring, anticlockwise from east.
static const int8_t ring_x[RING] = {1, 1, 0, -1, -1, -1, 0, 1};
static const int8_t ring_y[RING] = {0, 1, 1, 1, 0, -1, -1, -1};

// The entries of a band, as columns.
struct entries {
    uint64_t *key, *old_key;                     // after this step; before the phase
    uint32_t *x, *y, *qx, *qy, *from, *old_from; // q: the neighbour that it takes the key of
    float *threshold;                            // before the phase: a neighbour nearer than this is dark
};

struct fill {
    const struct pt_cpu_call *call;
    const struct fill_args *args;
    const struct view_args *view;
    uint64_t *keys;
    uint32_t *from;
    const float *normals, *deff, *span;
    // Planes of bits, a word 64 pixels of a row. Two bits or more of a row are to spare and 0, as is a row beyond the rectangle
    // or the plane: words that follow each other are neighbours, whatever the row.
    uint64_t *covered, *suspect; // not empty; maybe occluded: as the planes were before, or filled since
    uint64_t *filled;            // in this phase
    uint64_t *strays,
        *closing; // alone before the phase where the surface is dense; covered, and no stray: the same where there are none
    uint64_t *dirty, *touched; // changed by the last step; by this one
    size_t words;              // in a row; a multiple of WORDS
    struct entries entries;    // of all bands
    size_t band_entries;
    uint32_t *kept, *listed;    // per band: entries of earlier steps, of occluded pixels; with those of this step
    int occluded;               // the phase
    int first;                  // its first step
    atomic_uint changed, alone; // alone: there are strays
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

struct span { // of words
    size_t begin, end;
};

static struct span band_words(const struct fill *fill, uint32_t band)
{
    uint32_t first, last;
    band_rows(fill, band, &first, &last);
    return (struct span){first * fill->words, last * fill->words};
}

static void clear_band(const struct fill *fill, uint32_t band, uint64_t *plane)
{
    const struct span span = band_words(fill, band);
    memset(plane + span.begin, 0, (span.end - span.begin) * 8);
}

static inline vi_words *words_at(uint64_t *plane) { return (vi_words *)(void *)plane; }

static inline uint64_t bits_between(uint32_t begin, uint32_t end) // of a word
{
    return (end < 64 ? (1ull << end) - 1 : UINT64_MAX) & ~((1ull << begin) - 1);
}

static inline size_t word_of(const struct fill *fill, uint32_t x, uint32_t y) { return y * fill->words + x / 64; }
static inline uint64_t bit_of(uint32_t x) { return 1ull << x % 64; }

struct trio { // of 64 WORDS pixels: the bits of those to the west of them, their own, those to the east
    vi_words west, own, east;
};

static inline struct trio trio_of(const uint64_t *at)
{
    vi_words before, own, behind;
    memcpy(&before, at - 1, sizeof before);
    memcpy(&own, at, sizeof own);
    memcpy(&behind, at + 1, sizeof behind);
    return (struct trio){own << 1 | before >> 63, own, own >> 1 | behind << 63};
}

// Which of 64 WORDS pixels have bits, or neighbours that do.
static inline void wider(const uint64_t *at, size_t words, vi_words *out)
{
    const struct trio below = trio_of(at - words), own = trio_of(at), above = trio_of(at + words);
    *out = below.west | below.own | below.east | own.west | own.own | own.east | above.west | above.own | above.east;
}

// Which of 64 WORDS pixels have neighbours with bits.
static inline void ring_of(const uint64_t *at, size_t words, vi_words *out)
{
    const struct trio below = trio_of(at - words), own = trio_of(at), above = trio_of(at + words);
    *out = below.west | below.own | below.east | own.west | own.east | above.west | above.own | above.east;
}

// Which of 64 WORDS pixels have `length` consecutive ring neighbours without bits.
static inline void white_run(const uint64_t *at, size_t words, int length, vi_words *out)
{
    const struct trio below = trio_of(at - words), own = trio_of(at), above = trio_of(at + words);
    const vi_words dark[RING] = {own.east, above.east, above.own, above.west, own.west, below.west, below.own, below.east};
    vi_words pair[RING], none = ~(vi_words){0};
    for (int d = 0; d < RING; d++)
        pair[d] = dark[d] | dark[(d + 1) % RING];
    for (int d = 0; d < RING; d++)
        none &= pair[d] | pair[(d + 2) % RING] | dark[(d + length - 1) % RING];
    *out = ~none;
}

#endif
