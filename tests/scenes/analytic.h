// SPDX-License-Identifier: GPL-3.0-or-later
// The exact picture of surfaces that need no points, by float64 ray casting; and what separates a picture from it.
#ifndef TEST_ANALYTIC_H
#define TEST_ANALYTIC_H

#include "support.h"

enum analytic_kind { SPHERE, TORUS, PLANE };

// Placed in the world by world_from_object (row-major 3x4, rotation and move only).
struct analytic_shape {
    enum analytic_kind kind;
    double a, b; // sphere: radius; torus around z: ring, tube radius; plane z = 0: width, height
    double world_from_object[12];
};

struct analytic_hit {
    double z;         // pass depth; HUGE_VAL where nothing is
    double normal[3]; // world, unit, outwards (plane: +z of the object)
};

struct analytic_shape analytic_shape(enum analytic_kind kind, double a, double b);
// First hit of the ray origin + z direction, z > 0.
struct analytic_hit analytic_cast(const struct analytic_shape *shape, const double origin[3], const double direction[3]);
// One hit per pixel centre, row 0 at the bottom; the caller frees.
struct analytic_hit *analytic_picture(const struct analytic_shape *shape, const patina_camera *camera, uint32_t width,
                                      uint32_t height);

// What separates a picture from the truth. Shares are of the truth's area.
struct analytic_error {
    double iou;                     // of the covered pixels, truth taken at pixel centres
    double holes, growth;           // share of pixels that should (not) show the surface and do not (do)
    double inner_holes;             // the same where all 3x3 centres lie in the truth: no border pixel
    double outer_growth;            // ... where none of the 3x3 centres does
    double depth_rms, depth_p999;   // in spacings, over pixels whose 3x3 centres lie in the truth
    double normal_mean, normal_p99; // degrees, same pixels
    double color_rms, color_p99;    // of the expected Lambert colour's maximum, same pixels
};

// spacing: 1 / sqrt(points per area). sun (towards the light, unit) and white (colour of a surface that faces the sun)
// give the Lambert truth; white <= 0: no colour is measured. The film must be transparent.
struct analytic_error analytic_compare(const struct picture *picture, const struct analytic_hit *truth, double spacing,
                                       const double sun[3], double white);

// ---- flat convex shapes, exactly ---------------------------------------------------------------------------------

// A convex polygon in pixel coordinates, any orientation.
struct polygon {
    uint32_t count;
    double (*corner)[2]; // owned
};

struct polygon polygon_project(const double (*world)[3], uint32_t count, const patina_camera *camera, uint32_t width,
                               uint32_t height);
void polygon_free(struct polygon *polygon);
double polygon_area(const struct polygon *polygon);

struct silhouette {
    uint64_t grown;   // pixels that are not empty and whose square does not touch the shape
    uint64_t missing; // empty pixels whose square lies in the shape
    uint64_t inside;  // pixels whose square lies in the shape
    double area;      // of the shape, pixels
};

struct silhouette polygon_compare(const struct polygon *polygon, const struct picture *picture);

#endif
