// SPDX-License-Identifier: GPL-3.0-or-later
// Positions of a caller, and how far apart they lie.
#ifndef PT_PLACES_H
#define PT_PLACES_H

#include "scene/clouds/cloud.h"

#include <math.h>

#define PT_MOST_PLACES 0x7FFFFFFFull

struct pt_places {
    patina_array array; // 3 x FLOAT32 or FLOAT64, its stride explicit
    uint64_t count;
    double shift[3]; // added to each, in float64
};

// Reads a position. Returns whether it is finite.
static inline int pt_place(const struct pt_places *places, uint64_t index, double p[3])
{
    pt_read_vector(&places->array, index, p);
    for (int k = 0; k < 3; k++)
        p[k] += places->shift[k];
    return isfinite(p[0]) && isfinite(p[1]) && isfinite(p[2]);
}

// Checks the array and the count. call: whose message it is. A patina_error.
int pt_places_check(const char *call, const char *what, struct pt_places *places);

// Whether it may be a length that a caller gives; 0 stands for the default.
static inline int pt_is_length(double value) { return value >= 0 && value < 1e30; }

// About how far neighboring points lie apart, within a tenth: the median over 64 points of r_6 sqrt(pi / 6), r_6 the distance to the sixth
// nearest among at most 2^17 points, corrected for those left out. 0: fewer than two finite points, or all at one place.
double pt_places_spacing(const struct pt_places *places);
// The middle of the coordinates that 90 % of at most 1023 points have. Returns 0 where no point is finite.
int pt_places_middle(const struct pt_places *places, double middle[3]);
// Lower and upper corner of all finite points. Returns 0 where there is none.
int pt_places_box(const struct pt_places *places, double low[3], double high[3]);

#endif
