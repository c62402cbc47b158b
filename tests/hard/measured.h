// SPDX-License-Identifier: GPL-3.0-or-later
// Measured pixels (no filling) against float64: does every pixel hold the nearest point that falls into it?
#ifndef TEST_MEASURED_H
#define TEST_MEASURED_H

#include "scenes/support.h"

struct measured {
    uint64_t pixels;     // not empty
    double z_error;      // worst |z - truth of the pixel's id|, world units
    double z_share;      // the same, as a share of z
    double stray;        // worst distance of an id's true position from its pixel's square, pixels
    double z_late;       // worst (true z of the pixel's id - nearest true z that surely falls into the pixel), units
    uint64_t missed;     // empty pixels into which a point surely falls
    uint64_t impossible; // ids out of range, or z not a finite non-negative number
};

// world: 3 doubles a point, ids count from 0. margin: a point nearer than this to a pixel's border (pixels), or to a
// clipping plane (share of z), may fall on either side.
struct measured measured_compare(const struct picture *picture, const double *world, uint64_t count,
                                 const patina_camera *camera, double margin);

// No NaN anywhere, depth > 0 or +inf, alpha within 0..1, normals unit or zero, source consistent with the keys.
void measured_assert_sane(const struct picture *picture, const char *what);

#endif
