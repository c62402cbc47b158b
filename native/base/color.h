// SPDX-License-Identifier: GPL-3.0-or-later
// The one curve between colours in files and light, in both directions.
#ifndef PT_COLOR_H
#define PT_COLOR_H

#include "elementary.h"

// sRGB, 0..1 -> linear: IEC 61966-2-1. In float64, so that tables made of it are the same everywhere.
static inline double pt_linear_of_srgb(double c) { return c <= 0.04045 ? c / 12.92 : pt_pow((c + 0.055) / 1.055, 2.4); }

// And back.
static inline double pt_srgb_of_linear(double c) { return c <= 0.0031308 ? 12.92 * c : 1.055 * pt_pow(c, 1.0 / 2.4) - 0.055; }

#endif
