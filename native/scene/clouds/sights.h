// SPDX-License-Identifier: GPL-3.0-or-later
// What a cloud's stations saw, kept for pictures (SPEC 11): how far each looked in every direction, on the six faces of a cube
// around it. shared/filling.h says how a place is looked up.
#ifndef PT_SIGHTS_H
#define PT_SIGHTS_H

#include <stddef.h>
#include <stdint.h>

enum {
    PT_SIGHT_MOST = 1024,     // cells along an edge of a face: 0.09 degrees
    PT_SIGHT_BYTES = 1 << 26, // of all stations together, at most
};

struct pt_sight {
    double place[3]; // of the station, object units
    uint32_t first;  // of its cells, 6 x across x across: that cell is in the upper half of words[first / 2] where it is odd
    uint32_t across;
    uint32_t
        base; // cell << PT_SIGHT_SHIFT, and this added: bits of the range up to which it looked; a cell of 0: nothing is known
    float share; // of the range, by which what was seen must lie behind a place
};

struct pt_sights {
    uint32_t count, room;
    struct pt_sight *each; // pages, room of them
    uint32_t *words;       // pages
    size_t bytes;          // of the words
};

void pt_sights_free(struct pt_sights *sights);

// Of one station's range in every direction, while they are collected.
struct pt_sight_builder {
    struct pt_sight sight;
    _Atomic uint32_t *nearest; // float bits; cells of faces that are a cell wider on each side
};

// How many cells along an edge `stations` of directions `interval` radians apart get.
uint32_t pt_sight_across(double interval, uint32_t stations);
// 0 or PATINA_ERROR_MEMORY.
int pt_sight_begin(struct pt_sight_builder *builder, const double place[3], uint32_t across, double share);
// A sample at v from the station, `range` away. Any thread; any order gives the same.
void pt_sight_add(struct pt_sight_builder *builder, const double v[3], double range);
// Adds it to the sights, which have room, and frees the builder. farthest: range of any sample.
void pt_sight_end(struct pt_sight_builder *builder, double farthest, struct pt_sights *sights);

// Room for so many stations with so many cells along an edge. 0 or PATINA_ERROR_MEMORY.
int pt_sights_reserve(struct pt_sights *sights, uint32_t stations, uint32_t across);
// Whether what was read from a file may be looked up.
int pt_sights_good(const struct pt_sights *sights);

#endif
