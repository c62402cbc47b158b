// SPDX-License-Identifier: GPL-3.0-or-later
// The points of a built cloud, dealt to levels of detail (pt_chunk.gap).
#ifndef TEST_LEVELS_H
#define TEST_LEVELS_H

#include <patina/patina.h>
#include <stdint.h>

enum { LEVELS_MOST = 9 };

struct level {
    uint32_t chunk, chunk_end;
    uint64_t slot, slot_end;
};

// Sorts chunks and slots of an analysed cloud with sRGB colours anew: coarse levels first, each with four times the points of the one
// before, which a hash of their numbers deals. Fails the test on error.
void levels_make(patina_cloud *cloud, uint32_t levels, struct level *out);

#endif
