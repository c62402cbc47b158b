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

// ---- strays ----------------------------------------------------------------------------------------------------------------

// Whether points of what the pixel shows lie closer than a pixel of this level or so.
static int is_dense(const struct fill *fill, uint32_t x, uint32_t y)
{
    const struct view_args *view = fill->view;
    const size_t at = (size_t)y * view->width + x;
    const float z = pt_float((uint32_t)(fill->keys[at] >> 32)), width = view->footprint * (float)(1u << view->level);
    const uint32_t source = fill->from[at];
    return fill->span[source] < (PT_DENSE * (view->perspective ? width * z : width)) * fill->normals[4 * (size_t)source + 3];
}

// Finds what stands alone.
static void find_strays(struct fill *fill, uint32_t band)
{
    const struct span span = band_words(fill, band);
    const uint32_t *rect = fill->view->rect;
    vi_words any = {0};
    for (size_t i = span.begin; i < span.end; i += WORDS) {
        vi_words beside;
        ring_of(fill->covered + i, fill->words, &beside);
        any |= *words_at(fill->strays + i) = *words_at(fill->covered + i) & ~beside;
    }
    if (!(any[0] | any[1] | any[2] | any[3]))
        return;
    uint32_t first, last, count = 0;
    band_rows(fill, band, &first, &last);
    for (uint32_t y = first; y < last; y++)
        for (uint32_t word = 0; word < fill->words; word++) {
            uint64_t *strays = fill->strays + y * fill->words + word;
            for (uint64_t some = *strays; some; some &= some - 1) {
                const uint32_t x = 64 * word + (uint32_t)__builtin_ctzll(some);
                if (x < rect[0] || x >= rect[2] || !is_dense(fill, x, y))
                    *strays &= ~bit_of(x);
                else
                    count++;
            }
        }
    if (count)
        atomic_store_explicit(&fill->alone, 1, memory_order_relaxed);
}

// What is covered, without them; `still`: without those that still stand alone.
static void leave_strays(const struct fill *fill, uint32_t band, int still)
{
    uint32_t first, last;
    band_rows(fill, band, &first, &last);
    const size_t begin = (first - (first && !band)) * fill->words;
    const size_t end = (last + (last == fill->view->rect[3] && last < fill->view->height)) * fill->words;
    const struct span span = band_words(fill, band);
    for (size_t i = begin; i < end; i += WORDS) {
        vi_words beside = {0}, own = *words_at(fill->covered + i);
        if (i >= span.begin && i < span.end) {
            if (still)
                ring_of(fill->covered + i, fill->words, &beside);
            own &= ~(*words_at(fill->strays + i) & ~beside);
        }
        *words_at(fill->closing + i) = own;
    }
}

// ---- filling ---------------------------------------------------------------------------------------------------------------

// Lists what is to be filled.
static size_t list_empty(const struct fill *fill, uint32_t band, size_t count)
{
    const struct span span = band_words(fill, band);
    const struct entries *e = &fill->entries;
    uint32_t first, last;
    for (size_t i = span.begin; i < span.end; i += WORDS) {
        vi_words run;
        white_run(fill->closing + i, fill->words, 5, &run);
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
        white_run(fill->closing + i, fill->words, 4, &run);
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
