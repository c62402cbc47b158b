// SPDX-License-Identifier: GPL-3.0-or-later
// What kernels look up, filled before the first of them runs.
#ifndef PT_TABLES_H
#define PT_TABLES_H

#include <stdint.h>

// sRGB byte -> linear, IEC 61966-2-1. The values are those of the formula in float64, cut to float32.
extern float pt_srgb_table[256];
// Of each set of eight lanes, their numbers, a byte each, one behind another.
extern uint64_t pt_pack_table[256];

void pt_cpu_tables_fill(void);

#endif
