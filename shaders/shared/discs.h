// SPDX-License-Identifier: GPL-3.0-or-later
// What splat and blend know of discs; sums of what is weighted.
#ifndef PT_SHARED_DISCS_H
#define PT_SHARED_DISCS_H

#include "shared/view.h"

// Discs: a point without a radius of its own gets so many spacings. Of random points exp(-pi r^2) stay uncovered: 0.09% at 1.5,
// where colours are off by 0.0091 to 0.0136 at half a pixel to three apart, 0.007% at 1.75: 0.0071 to 0.0113.
#define PT_DISC_SPACINGS 1.75f
#define PT_DISC_LEAST 1e-30f  // a radius below is none: the point stays its pixel
#define PT_DISC_MOST 1e30f
#define PT_DISC_FINE 1e12f    // so is a radius this many times smaller than the depth
#define PT_DISC_TILT 1e-6f    // |n . ray| below: seen edge-on, the point stays its pixel
#define PT_DISC_GENTLE 0.015625f // slopes up to 2^-6: 1 / (1 + s) = (1 - s) (1 + s^2), within 2^-24 of it
#define PT_DISC_FAR 4194304.0f // pixels: centres beyond are not drawn, boxes end there
#define PT_SUM_SCALE 262144.0f // 2^18: weights, and what they weigh, are summed as integers
#define PT_DISC_DEPTHS 2.0f // layer distances behind the nearest disc: whose depths are averaged. Four spacings hold noise of one
#define PT_SUM_BRIGHTEST 4096.0f // colours above blend as this, so that a term fits 31 bits
#define PT_RADII_NONE 0u   // what disc_args.has_radii says of the radii buffer: it is not read
#define PT_RADII_FLOATS 1u // radii, object units
#define PT_RADII_SHAPES 2u // shape words

// A cloud's discs, one of these an instance behind the arguments of splat and blend.
struct disc_args {
    struct instance_args instance;
    uint32_t has_radii; // PT_RADII_*: what the radii buffer holds
    float radius;       // world units, of every point; 0: its own, or its shape's, else PT_DISC_SPACINGS times its spacing
    float radius_scale; // object units -> world, times what strata leave out
    float radius_most;  // world units: no half axis is longer; 0: as long as it is
    float surface_scale; // of half axes of shapes whose kind is PT_KIND_SURFACE, before that
    uint32_t shadowed;   // blend: 1: the instance receives shadows
};

#endif
