// SPDX-License-Identifier: GPL-3.0-or-later
// Stage means: colours and normals in the mean of what points lie about a pixel's surface.
#ifndef PT_SHARED_MEANS_H
#define PT_SHARED_MEANS_H

#include "shared/discs.h"

// average: what the points of an instance within d_eff of the surface that a pixel shows have there, filled or not, weighted by
// the tent w = (1 - |dx| / h) (1 - |dy| / h) about its centre. h: PT_AVERAGE_TENT times the point's spacing in pixels, 1 to
// PT_AVERAGE_WIDEST: points nearer together than 1.4 pixels add to four pixels each. The sums are integers, PT_SUM_SCALE a unit, so
// that no order shows.
//   albedo: mean colour, and 1; where no point reaches, that of the pixel's own point.
//   normal.xyz, of pixels that were measured and with `normals`: unit mean, on the side that it was on.
// PT_AVERAGE_TENT: on a sphere of 1 point a pixel 1.04 levels off, on one of 0.2 1.57; of 1, 1.01 and 1.61, in 1.4 times the time.
#define PT_AVERAGE_WIDEST 4.0f
#define PT_AVERAGE_TENT 0.7f
struct average_args {
    struct view_args view;
    struct instance_args instance;
    uint32_t normals; // 1: means of normals too; the instance has them
    uint32_t sifted;  // as in scatter_args
};

#endif
