// SPDX-License-Identifier: GPL-3.0-or-later
// Points near a drawing's plane, in coordinates of the plane. Section lines are traced through them.
#ifndef PT_DRAW_SAMPLES_H
#define PT_DRAW_SAMPLES_H

#include "plane.h"

#include "patina/patina.h"

#include <stdint.h>

#define PT_SCALE_SIGMAS 1.8 // a fit reaches as far as if the spacing were at least so many sigmas

// All lengths in meters, or whatever the cloud's unit is.
struct pt_cut_sample {
    double place[2];  // where the surface around the point meets the plane, as far as the point's normal says
    double raw[2];    // the point, projected onto the plane
    double normal[2]; // of the surface, projected onto the plane, unit, on either side; 0 0: unknown
    float out;        // signed distance from the plane
    float slope;      // how far along `normal` the surface moves per unit of distance from the plane; NaN: unknown
    float spacing;    // of points on the surface
    float sigma;      // noise across the section line: that of the surface, larger where it is steep
    float scale;      // the length that tells how far a fit reaches: the spacing, or more where noise is wider
    float reach;      // half axis of the footprint along the section line
    float quality;    // 0..1, of the line through its neighbors; set by the tracer
    uint32_t owner;   // the line that the sample belongs to, from 1 on; 0: none yet
    uint32_t stamp;   // how many steps that line had
};

struct pt_cut_samples {
    struct pt_cut_sample *at;
    uint32_t count, room;
    uint64_t untrusted; // points of the slab that were left out for their trust
    double thickness;   // of the slab: the given one, or the median of all points
};

struct pt_cut_source {
    const patina_cloud *cloud; // analyzed
    const double *place;       // row-major matrix, as patina_cut_desc has it; NULL: none
    const uint8_t *shown;      // bits of the points to use; NULL: all
};

// Appends the trusted points of a cloud that are near the plane and within its extent, or a few spacings beside it. thickness: 0 takes three
// spacings around each point, or as much as its footprint reaches. Returns 0 or PATINA_ERROR_ARGUMENT for the place, _MEMORY, _CANCELLED,
// or _TOO_MANY_POINTS.
int pt_cut_gather(const struct pt_draw_plane *plane, double thickness, const struct pt_cut_source *source,
                  patina_progress *progress, struct pt_cut_samples *samples);
void pt_cut_free(struct pt_cut_samples *samples);

#endif
