// SPDX-License-Identifier: GPL-3.0-or-later
// A terraced town with trees, of any size: its quarters are alike but for their height and colour, so that the file of a billion points is
// written from one quarter's, without the town ever being in memory.
#ifndef TEST_TOWN_H
#define TEST_TOWN_H

#include <stdint.h>

enum { TOWN_QUARTER = 40 }; // metres on a side

// A file of across x across quarters, each of so many points, analysed; positions are packed, and points numbered as they lie: 19 bytes
// each. Fails the test on error. Returns its bytes.
// levels: 0 or 1, or in how many the points lie: coarse ones first in the file, each level with four times the points of the one before.
// plain: without colours and footprints, 12 bytes each.
uint64_t town_write(const char *path, uint32_t across, uint32_t points, uint32_t levels, int plain);

#endif
