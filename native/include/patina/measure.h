// SPDX-License-Identifier: GPL-3.0-or-later
// What is measured between clouds and above the ground, a part of patina.h, which includes it. Its conventions and thread rules hold
// here too. Arrays in, arrays out: no cloud is built. Any thread, several calls at once.
#ifndef PATINA_MEASURE_H
#define PATINA_MEASURE_H

#ifndef PATINA_H
#error "include patina/patina.h"
#endif

#ifdef __cplusplus
extern "C" {
#endif

// ---- the distance between two clouds ---------------------------------------------------------------------------------

// M3C2: D. Lague, N. Brodu, J. Leroux, Accurate 3D comparison of complex topography with terrestrial laser scanner, ISPRS Journal of
// Photogrammetry and Remote Sensing 82, 2013, section 3. Lengths in the unit of the positions.
typedef struct patina_distance_desc {
    size_t struct_size;
    uint64_t count, other_count; // points of the cloud and of the other one, at most 2^31 - 1 each
    patina_array position;       // of the cloud: 3 x FLOAT32 or FLOAT64. NaN/Inf rows take no part
    patina_array normal;       // of the cloud: 3 x FLOAT32 or FLOAT64, any length; zero or NaN = that point has none. Optional
    patina_array other;        // positions of the other cloud, as `position`
    double origin[3];          // added to `position`, in float64
    double other_origin[3];    // added to `other`
    double normal_scale;       // diameter of the balls whose points give the normals; 0 = the given ones, or twice the cylinder
    double cylinder;           // diameter; 0 = six spacings: about 30 points
    double depth;              // the cylinder reaches so far to both sides, at most; 0 = ten diameters
    double registration_error; // of the two clouds to each other, one standard deviation
    uint32_t threads;          // 0 = one per core. The result does not depend on it
    uint32_t unused;           // says nothing
} patina_distance_desc;

// Sets cylinder, depth and normal_scale (if there are no normals) where they are 0. The spacing is that of the coarser cloud, from a
// sample: about 10 ms. PATINA_ERROR_EMPTY where none can be told: fewer than two finite points.
PATINA_API int patina_distance_defaults(patina_distance_desc *desc);
// For each point of the cloud (count floats each): the distance to the other cloud along the point's normal, positive on the normal's
// side, and the 95 % confidence interval of that distance, its level of detection: 1.96 (sqrt(s1^2 / n1 + s2^2 / n2) + registration_error).
// s: standard deviation of the n points of a cloud in the cylinder around the normal. The cylinder grows until its points lie well
// within, so that a farther surface (the back of a wall) does not mix in. Both are NaN where either cloud has fewer than 4 points in it,
// and where there is no normal. Normals that are found are on the side of the given ones; without these they point up (z), or, on
// vertical surfaces, away from the cloud's middle. Points farther than a million diameters from the cloud's middle take no part.
// distance and interval are written only on success; progress may be NULL. PATINA_ERROR_CANCELLED after patina_progress_cancel.
// 6 us a point of one core with 30 points in a cylinder; 40 bytes a point of both clouds meanwhile.
PATINA_API int patina_cloud_distance(const patina_distance_desc *desc, patina_progress *progress, float *distance,
                                     float *interval);
PATINA_API int patina_task_cloud_distance(const patina_distance_desc *desc, patina_progress *progress, float *distance,
                                          float *interval, patina_task **out); // on a thread of its own: tasks.h

// ---- the ground ------------------------------------------------------------------------------------------------------

// Progressive densification on grids from coarse to fine, after P. Axelsson, DEM generation from laser scanner data using adaptive TIN
// models, International Archives of Photogrammetry and Remote Sensing 33, 2000. z is up. Lengths in the unit of the positions.
typedef struct patina_ground_desc {
    size_t struct_size;
    uint64_t count;        // at most 2^31 - 1
    patina_array position; // 3 x FLOAT32 or FLOAT64. NaN/Inf rows take no part
    double cell;           // width of the finest grid's cells; 0 = by extent and spacing, 0.5 for terrain in meters
    double threshold;      // points nearer to the ground than this are ground; 0 = one cell
    double largest;        // width of the largest object on the ground, such as a building; 0 = 100 cells
    uint32_t threads;      // 0 = one per core. The result does not depend on it
    uint32_t unused;       // says nothing
} patina_ground_desc;

// Sets cell, threshold and largest where they are 0. PATINA_ERROR_EMPTY where none can be told: fewer than two finite points.
PATINA_API int patina_ground_defaults(patina_ground_desc *desc);
// For each point: its height above the ground (count floats; NaN where the position is not finite, or lies far beside all others), and
// whether it is ground (count bytes, 1 or 0; may be NULL). Isolated points below the ground do not count as ground. Where an object
// covers the ground, the ground is interpolated. Written only on success; progress may be NULL. PATINA_ERROR_CANCELLED after
// patina_progress_cancel. PATINA_ERROR_ARGUMENT where the grid would have more than 2^26 cells: the message names the least cell.
PATINA_API int patina_ground(const patina_ground_desc *desc, patina_progress *progress, float *height, uint8_t *ground);
PATINA_API int patina_task_ground(const patina_ground_desc *desc, patina_progress *progress, float *height, uint8_t *ground,
                                  patina_task **out); // on a thread of its own: tasks.h

#ifdef __cplusplus
}
#endif
#endif
