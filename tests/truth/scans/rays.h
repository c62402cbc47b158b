// SPDX-License-Identifier: GPL-3.0-or-later
// Exact rays against triangles, for the truth of virtual scans: float64, no threads of its own unless asked.
#ifndef PT_TRUTH_RAYS_H
#define PT_TRUTH_RAYS_H

#include <stdint.h>

#define RAYS_API __attribute__((visibility("default")))

// What a surface looks like, by material. Colours linear; length: world units of the pattern's largest part.
typedef struct material {
    int32_t pattern, unused;
    double first[3], second[3];
    double length, grain; // grain: share by which fine noise changes the colour
} material;

enum { PATTERN_PLAIN, PATTERN_BRICKS, PATTERN_TILES, PATTERN_WOOD, PATTERN_CLOUDS, PATTERN_CHECKS, PATTERN_COUNT };

typedef struct rays rays;

// corners: nine doubles a triangle; copied. NULL when there is no memory.
RAYS_API rays *rays_create(const double *corners, int64_t count);
RAYS_API void rays_destroy(rays *r);
// The nearest hits at t > 0 of origin + t direction, n of them; shared_origin: one origin for all. t = inf, triangle = -1
// where nothing is met. Returns 0, or -1 when no thread could be started.
RAYS_API int rays_trace(const rays *r, const double *origin, int32_t shared_origin, const double *direction, int64_t n,
                        double *t, int32_t *triangle, int32_t threads);
// Writes the distance of each of n places from the nearest triangle of its own parts, or its `most` if none is nearer: a small
// one makes the search short. part: of each triangle as given to rays_create; parts: `each` numbers a place, negative for none.
// Returns 0, or -1 when no thread could be started.
RAYS_API int rays_nearest(const rays *r, const int32_t *part, const double *place, const int32_t *parts, int32_t each,
                          int64_t n, const double *most, double *distance, int32_t threads);
// Linear colours at places on surfaces with unit normals.
RAYS_API void rays_albedo(const material *materials, const int32_t *which, const double *place, const double *normal, int64_t n,
                          float *rgb);

#endif
