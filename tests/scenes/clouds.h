// SPDX-License-Identifier: GPL-3.0-or-later
// Clouds whose surface is known exactly, sampled area-uniformly at random. Deterministic: own random numbers (PCG32),
// so that every machine draws the same points.
#ifndef TEST_CLOUDS_H
#define TEST_CLOUDS_H

#include <patina/patina.h>

#include <stdint.h>

struct pcg {
    uint64_t state;
};

struct pcg pcg_seed(uint64_t seed);
uint32_t pcg_u32(struct pcg *random);
double pcg_unit(struct pcg *random);                             // [0, 1)
double pcg_between(struct pcg *random, double low, double high); // [low, high)

// Owned arrays; normal and color may be NULL. color is sRGB, 3 bytes a point.
struct points {
    uint64_t count;
    float *position, *normal;
    uint8_t *color;
};

enum points_columns { POINTS_PLAIN = 0, POINTS_NORMALS = 1, POINTS_COLORS = 2, POINTS_ALL = 3 };

struct points points_create(uint64_t count, unsigned columns); // zeroed; columns absent are NULL
void points_free(struct points *points);

struct points points_sphere(uint64_t count, double radius, unsigned columns, uint64_t seed);
struct points points_torus(uint64_t count, double ring, double tube, unsigned columns, uint64_t seed); // around z
struct points points_disc(uint64_t count, double radius, unsigned columns, uint64_t seed);             // z = 0, normal +z
struct points points_rectangle(uint64_t count, double width, double height, unsigned columns, uint64_t seed);
struct points points_triangle(uint64_t count, const double corner[3][2], unsigned columns, uint64_t seed); // z = 0
struct points points_box(uint64_t count, const double half[3], unsigned columns, uint64_t seed);
// A plane z = 0 with one point at the middle of each cell of size `pitch`, columns x rows cells, centred on the origin.
struct points points_grid(uint32_t columns_x, uint32_t rows_y, double pitch, unsigned columns);

// Points per unit area of the generators' surfaces.
double area_sphere(double radius);
double area_torus(double ring, double tube);

// Applies p := M p (row-major 3x3) and moves by t; normals by M, so M must be a rotation (times a scale).
void points_transform(struct points *points, const double matrix[9], const double move[3]);

patina_cloud_desc points_desc(const struct points *points);
patina_cloud *points_upload(const struct points *points); // fails the test on error
// A cloud of float64 positions in which each point has a color: of type PATINA_UINT8 in sRGB, of PATINA_FLOAT32 linear. Fails the test on
// error.
patina_cloud *cloud_of_colors(uint64_t count, const void *position, const void *color, uint32_t type, uint32_t threads);

double srgb_of_linear(double light); // 0..1, by the C library's pow

#endif
