// SPDX-License-Identifier: GPL-3.0-or-later
// Collected are the nearest ranges; kept is, of each cell, the nearest of the 3 x 3 around it: whatever lies clearly before that
// was looked through, for the beam beside it went on.
#include "sights.h"
#include "base/error.h"
#include "base/platform.h"
#include "shared/words.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

enum { FACES = 6, LEAST = 8, FILLED_LEAST = 5 }; // FILLED_LEAST: of 3 x 3; beside what did not return, nothing is known

#define WIDEST 1.2 // tangent: beyond 1.29, bent() turns round

static double bent(double u) { return u * ((double)PT_SIGHT_BEND - ((double)PT_SIGHT_BEND - 1.0) * u * u); }

static uint32_t bits_of(double range)
{
    const float value = (float)range;
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

uint32_t pt_sight_across(double interval, uint32_t stations)
{
    const double fit = sqrt((double)PT_SIGHT_BYTES / (2.0 * FACES) / stations), wanted = ceil(0.5 * PI / interval);
    const double across = fmin(fmin(wanted, PT_SIGHT_MOST), floor(fit));
    return across >= LEAST ? (uint32_t)across : LEAST;
}

static size_t wide(const struct pt_sight_builder *builder) { return (size_t)builder->sight.across + 2; }

int pt_sight_begin(struct pt_sight_builder *builder, const double place[3], uint32_t across, double share)
{
    builder->sight = (struct pt_sight){.across = across, .share = (float)share};
    memcpy(builder->sight.place, place, sizeof builder->sight.place);
    const size_t cells = FACES * wide(builder) * wide(builder);
    builder->nearest = pt_pages_alloc(cells * sizeof *builder->nearest);
    for (size_t i = 0; builder->nearest && i < cells; i++)
        atomic_init(&builder->nearest[i], PT_KEY_EMPTY_Z);
    return builder->nearest ? PATINA_OK : PATINA_ERROR_MEMORY;
}

static void least(_Atomic uint32_t *word, uint32_t bits)
{
    uint32_t seen = atomic_load_explicit(word, memory_order_relaxed);
    while (bits < seen && !atomic_compare_exchange_weak_explicit(word, &seen, bits, memory_order_relaxed, memory_order_relaxed))
        ;
}

void pt_sight_add(struct pt_sight_builder *builder, const double v[3], double range)
{
    const double half = 0.5 * builder->sight.across, size = (double)wide(builder);
    for (int face = 0; face < FACES && isfinite(range); face++) {
        const int axis = face / 2;
        const double along = face % 2 ? -v[axis] : v[axis], a = v[(axis + 1) % 3], b = v[(axis + 2) % 3];
        if (!(along * WIDEST > fmax(fabs(a), fabs(b))))
            continue;
        const double x = floor((bent(a / along) + 1.0) * half) + 1.0, y = floor((bent(b / along) + 1.0) * half) + 1.0;
        if (x >= 0.0 && y >= 0.0 && x < size && y < size)
            least(&builder->nearest[((size_t)face * wide(builder) + (size_t)y) * wide(builder) + (size_t)x], bits_of(range));
    }
}

// The nearest of the 3 x 3 from `at` on, float bits; 0 where too few are filled.
static uint32_t nearest_around(const struct pt_sight_builder *builder, size_t at)
{
    uint32_t nearest = PT_KEY_EMPTY_Z, filled = 0;
    for (int row = 0; row < 3; row++, at += wide(builder))
        for (int k = 0; k < 3; k++) {
            const uint32_t bits = atomic_load_explicit(&builder->nearest[at + (size_t)k], memory_order_relaxed);
            filled += bits != PT_KEY_EMPTY_Z;
            nearest = bits < nearest ? bits : nearest;
        }
    return filled >= FILLED_LEAST ? nearest : 0;
}

void pt_sight_end(struct pt_sight_builder *builder, double farthest, struct pt_sights *sights)
{
    enum { OCTAVES = 32 };
    struct pt_sight *sight = &builder->sight;
    const uint32_t top = bits_of(farthest) & 0xFF800000u, across = sight->across;
    sight->base = top >= OCTAVES << 23 ? top - ((OCTAVES - 1) << 23) : 0;
    sight->first = sights->count ? sights->each[sights->count - 1].first + FACES * across * across : 0;
    for (uint32_t face = 0; face < FACES; face++)
        for (uint32_t y = 0; y < across; y++)
            for (uint32_t x = 0; x < across; x++) {
                const size_t at = ((size_t)face * wide(builder) + y) * wide(builder) + x;
                const uint32_t bits = nearest_around(builder, at), to = sight->first + (face * across + y) * across + x;
                if (bits > sight->base)
                    sights->words[to / 2] |= ((bits - sight->base) >> PT_SIGHT_SHIFT) << to % 2 * 16;
            }
    sights->each[sights->count++] = *sight;
    pt_pages_free(builder->nearest, FACES * wide(builder) * wide(builder) * sizeof *builder->nearest);
    builder->nearest = NULL;
}

int pt_sights_reserve(struct pt_sights *sights, uint32_t stations, uint32_t across)
{
    sights->bytes = ((size_t)stations * FACES * across * across + 1) / 2 * 4;
    sights->each = pt_pages_alloc(stations * sizeof *sights->each);
    sights->words = pt_pages_alloc(sights->bytes);
    if (sights->each && sights->words) {
        sights->room = stations;
        return PATINA_OK;
    }
    pt_pages_free(sights->each, stations * sizeof *sights->each);
    pt_pages_free(sights->words, sights->bytes);
    *sights = (struct pt_sights){0};
    return PATINA_ERROR_MEMORY;
}

int pt_sights_good(const struct pt_sights *sights)
{
    int good = sights->count <= sights->room;
    for (uint32_t i = 0; i < sights->room && good; i++) {
        const struct pt_sight *sight = &sights->each[i];
        const uint64_t end = sight->first + (uint64_t)FACES * sight->across * sight->across;
        good = i >= sights->count ||
               (sight->across && sight->across <= PT_SIGHT_MOST && end <= sights->bytes / 2 && isfinite(sight->share) &&
                sight->base <= 0xE0000000u && isfinite(sight->place[0] + sight->place[1] + sight->place[2]));
    }
    return good;
}

void pt_sights_free(struct pt_sights *sights)
{
    pt_pages_free(sights->each, sights->room * sizeof *sights->each);
    pt_pages_free(sights->words, sights->bytes);
    *sights = (struct pt_sights){0};
}
