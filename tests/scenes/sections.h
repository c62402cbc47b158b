// SPDX-License-Identifier: GPL-3.0-or-later
// Virtual scans of surfaces whose section with a plane is known in closed form, and what separates a drawing from that section.
#ifndef TEST_SECTIONS_H
#define TEST_SECTIONS_H

#include "clouds.h"

// A piece of a section on the plane: a straight line, or an arc if radius > 0.
struct section_piece {
    double a[2], b[2];        // ends of a straight line; its surface's front is on the left of a -> b
    double center[2], radius; // of an arc
    double from, to;          // angles, radians, counterclockwise
    double slope;             // how far the surface moves to the left per unit of distance from the plane
};

enum { SECTION_PIECES = 16 };

struct section {
    struct section_piece piece[SECTION_PIECES];
    uint32_t pieces;
    double corner[SECTION_PIECES][2];
    uint32_t corners;
};

void section_line(struct section *section, double ax, double ay, double bx, double by, double slope);
void section_arc(struct section *section, double x, double y, double radius, double from, double to);
// Lines around a polygon; all of its vertices are corners.
void section_polygon(struct section *section, const double (*at)[2], uint32_t count);
double section_length(const struct section *section);

// How points are taken of a section's surfaces, which reach `height` before and behind the plane.
struct section_scan {
    double spacing, sigma, height;
    double wrong; // share of wrong samples, 2 cm to 50 cm from the surface
    int regular;  // 1: rows along the section
    uint64_t seed;
    patina_drawing_desc plane; // maps them into the world
};

// Points in the world; the cloud is built and analyzed. The test fails on errors.
patina_cloud *section_cloud(const struct section *section, const struct section_scan *scan);

struct section_error {
    double bias, rms, p95;    // signed mean, of what is drawn near the truth; 95th percentile of all that is drawn
    double farthest, missing; // Hausdorff distances: of what is drawn from the truth, and of the truth from what is drawn
    double missed, wrong;     // shares: of the truth without a line within `within`, of the drawn length farther than that
    double corner;            // greatest distance of a corner from a vertex
    uint32_t lines, closed, bridged;
    double length, bridged_length;
};

struct section_error section_compare(const struct section *section, const patina_drawing *drawing, double within);

#endif
