// SPDX-License-Identifier: GPL-3.0-or-later
// Empty pixels that are filled, and those of them that are emptied again: by bits alone. SPEC 2.2
#ifndef PT_FILL_BACKGROUND_H
#define PT_FILL_BACKGROUND_H

#include "fill.h"

// The first of a row's words from this on with touched pixels; words at the end.
static inline uint32_t next_word(const struct fill *fill, uint32_t y, uint32_t word)
{
    const uint64_t *touched = fill->touched + y * fill->words;
    while (word < fill->words && !touched[word])
        word++;
    return word;
}

// Lists what is to be filled.
static size_t list_empty(const struct fill *fill, uint32_t band, size_t count)
{
    const struct span span = band_words(fill, band);
    const struct entries *e = &fill->entries;
    uint32_t first, last;
    for (size_t i = span.begin; i < span.end; i += WORDS) {
        vi_words run;
        white_run(fill->covered + i, fill->words, 5, &run);
        *words_at(fill->touched + i) = ~(*words_at(fill->covered + i) | run);
    }
    band_rows(fill, band, &first, &last);
    for (uint32_t y = first; y < last; y++)
        for (uint32_t word = next_word(fill, y, 0); word < fill->words; word = next_word(fill, y, word + 1))
            for (uint64_t some = fill->touched[y * fill->words + word]; some; some &= some - 1) {
                e->x[count] = 64 * word + (uint32_t)__builtin_ctzll(some);
                e->y[count++] = y;
            }
    return count;
}

// Marks what has been filled and shows four consecutive white cells ...
static void mark_empty(const struct fill *fill, uint32_t band)
{
    const struct span span = band_words(fill, band);
    for (size_t i = span.begin; i < span.end; i += WORDS) {
        vi_words run;
        white_run(fill->covered + i, fill->words, 4, &run);
        *words_at(fill->touched + i) = *words_at(fill->filled + i) & run;
    }
}

// ... and empties it. Returns how many.
static uint32_t restore_empty(const struct fill *fill, uint32_t band)
{
    uint32_t first, last, count = 0;
    band_rows(fill, band, &first, &last);
    for (uint32_t y = first; y < last; y++)
        for (uint32_t word = next_word(fill, y, 0); word < fill->words; word = next_word(fill, y, word + 1)) {
            const size_t i = y * fill->words + word;
            uint64_t *keys = fill->keys + (size_t)y * fill->view->width + 64 * word;
            count += (uint32_t)__builtin_popcountll(fill->touched[i]);
            fill->filled[i] &= ~fill->touched[i];
            fill->covered[i] &= ~fill->touched[i];
            for (uint64_t some = fill->touched[i]; some; some &= some - 1)
                keys[__builtin_ctzll(some)] = (uint64_t)PT_KEY_EMPTY_Z << 32 | PT_KEY_EMPTY_ID;
        }
    return count;
}

#endif
