// SPDX-License-Identifier: GPL-3.0-or-later
// Vectors of three float64.
#ifndef PT_VECTOR_H
#define PT_VECTOR_H

static inline double pt_dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

#endif
