// SPDX-License-Identifier: GPL-3.0-or-later
#include "tables.h"
#include "base/color.h"

float pt_srgb_table[256];
uint64_t pt_pack_table[256];

void pt_cpu_tables_fill(void)
{
    for (int i = 0; i < 256; i++) {
        pt_srgb_table[i] = (float)pt_linear_of_srgb(i / 255.0);
        for (uint64_t lane = 0, count = 0; lane < 8; lane++)
            if (i >> lane & 1)
                pt_pack_table[i] |= lane << 8 * count++;
    }
}
