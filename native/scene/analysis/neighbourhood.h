// SPDX-License-Identifier: GPL-3.0-or-later
// What a point's neighbours say about it (SPEC 11): a plane, its kind, its footprint. No cloud here: offsets in, numbers out.
#ifndef PT_NEIGHBOURHOOD_H
#define PT_NEIGHBOURHOOD_H

#include "neighbours.h"
#include "scene/clouds/shape_word.h"

struct pt_sample { // offsets from the point to its neighbours, nearest first
    uint32_t count;
    double offset[PT_NEIGHBOURS_MOST][3], square[PT_NEIGHBOURS_MOST];
};

struct pt_plane { // of the point and those of its neighbours that `inside` marks, about their mean
    uint64_t inside;
    uint32_t count;    // of them, the point included
    double mean[3];    // relative to the point
    double value[3];   // variances along the axes, least first
    double axis[3][3]; // orthonormal; axis[0] is the normal
};

#define PT_UNEVEN_ROWS 3.5 // pt_neighbourhood.uneven of rows: nine in ten random points show less

// The plane through the marked neighbours and the point.
void pt_plane_fit(const struct pt_sample *sample, uint64_t inside, struct pt_plane *plane);
// Does this plane say all, or would more neighbours say more? Of a neighbourhood likewise.
int pt_plane_is_doubtful(const struct pt_plane *plane);
int pt_neighbourhood_is_doubtful(const struct pt_neighbourhood *hood);
// The better of two planes, through few and through more neighbours.
int pt_plane_prefers_wide(const struct pt_plane *narrow, const struct pt_plane *wide);
// A plane through the point that more of its neighbours lie on than on `plane`: on one side of a crease, of a thin wall.
// 0 where there is none.
int pt_plane_through_most(const struct pt_sample *sample, const struct pt_plane *plane, double within, struct pt_plane *out);
// RMS distance of the marked neighbours from the plane, or from the quadric where that explains more; of all where the others
// are sheets beside it, nearer than surfaces are told apart; beside: they are farther.
double pt_plane_sigma(const struct pt_sample *sample, const struct pt_plane *plane, int *beside);

// From a sample of every `thinning`-th point, where the point's nearest make it a volume: noise that is wider than they reach
// apart is flat from farther off. 1: out is a surface now.
int pt_neighbourhood_from_afar(const struct pt_sample *sample, const struct pt_plane *plane, double thinning,
                               struct pt_neighbourhood *out);

// Bounds the footprint of a point by how far its neighbours lie from each other. If gaps divide the neighbours and the point's own part
// is thin or small (a bar, a leaf), that part alone describes the point. Rows of a scan on a surface stay whole.
void pt_neighbourhood_bound(const struct pt_sample *sample, struct pt_neighbourhood *hood);
// The axes of the ellipse that has a and b for conjugate half diameters; the greater's direction in `axis`.
void pt_ellipse_of(const double a[3], const double b[3], double axis[3], double *major, double *minor);
void pt_neighbourhood_of(const struct pt_sample *sample, const struct pt_plane *plane, struct pt_neighbourhood *out);

#endif
