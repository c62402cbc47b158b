// SPDX-License-Identifier: GPL-3.0-or-later
// sRGB byte -> linear, IEC 61966-2-1. The values are those of the formula in float64, cut to float32, filled at start.
#ifndef PT_SRGB_H
#define PT_SRGB_H

extern float pt_srgb_table[256];

#endif
