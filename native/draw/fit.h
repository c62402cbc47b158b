// SPDX-License-Identifier: GPL-3.0-or-later
// The section of a surface around a place, as a short curve fitted to noisy samples.
#ifndef PT_DRAW_FIT_H
#define PT_DRAW_FIT_H

#include "near.h"
#include "samples.h"

enum { PT_FIT_MOST = 512 }; // samples that one fit takes at most

// v = offset + slope u + bend u^2, in a frame whose u axis is the given direction and whose v axis is 90 degrees to its left.
struct pt_curve {
    double offset, slope, bend;
    double rms;          // of the inliers' distances
    double band;         // inliers are nearer to the curve than this
    double weight;       // how many samples near the place tell the offset
    double scale, sigma; // their means
};

struct pt_fit {
    const struct pt_cut_samples *samples;
    const struct pt_near *tree;
    uint32_t count;
    uint32_t number[PT_FIT_MOST]; // of the samples around the place that face as the curve does
    double u[PT_FIT_MOST], v[PT_FIT_MOST], out[PT_FIT_MOST], given[PT_FIT_MOST], weight[PT_FIT_MOST];
    double residual[PT_FIT_MOST]; // signed distances from the curve
};

// Fits a curve through the samples around a place. direction: unit, about along the curve. scale: of the samples there. 0, or -1 if too
// few samples lie on a curve. The method is that of moving least squares with robust weights (Fleishman et al. 2005), where samples whose
// surface faces elsewhere have no weight, so that corners stay corners.
int pt_fit_curve(struct pt_fit *fit, const double place[2], const double direction[2], double scale, struct pt_curve *curve);

#endif
