// SPDX-License-Identifier: GPL-3.0-or-later
// Vectors of three float64.
#ifndef PT_VECTOR_H
#define PT_VECTOR_H

#include <math.h>

static inline double pt_dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// out is none of a and b.
static inline void pt_cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static inline int pt_finite3(const double v[3]) { return isfinite(v[0]) && isfinite(v[1]) && isfinite(v[2]); }

#endif
