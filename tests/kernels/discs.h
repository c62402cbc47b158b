// SPDX-License-Identifier: GPL-3.0-or-later
// Random clouds as discs, for the tests of splat and blend.
#ifndef PT_DISCS_H
#define PT_DISCS_H

#include "points.h"
#include "shared/discs.h"

struct disc_scene {
    struct scene points;
    struct disc_args discs[MOST_INSTANCES];
    void *radii[MOST_INSTANCES]; // floats, or shape words after discs_shape
    struct pt_buffer *bins;      // what discs_splat leaves to blend
};

// After the points' positions: args of every instance. radius: of all points, 0: radii of their own between none and
// `largest`. Normals turn with the camera.
void discs_describe(struct harness *h, struct rng *rng, struct disc_scene *scene, uint32_t instance,
                    const struct camera *camera, float radius, double largest, int has_normals);
// Gives the points of an instance shapes in place of radii, half axes between none and what discs_describe took as largest.
// stretch: object units -> view space along the object's axes, before the camera turns them; NULL: as they are.
void discs_shape(struct harness *h, struct rng *rng, struct disc_scene *scene, uint32_t instance, const struct camera *camera,
                 const double stretch[3]);
// points_window with the rays of the camera.
struct view_args discs_window(uint32_t width, uint32_t height, int perspective, double focal);
// A cloud in a window of any shape, its discs of radii up to `largest`.
struct disc_scene discs_in_window(struct harness *h, struct rng *rng, uint32_t width, uint32_t height, double largest);
// Adds an instance of 400 discs of this radius (0: of up to 0.25), far beside the view and hardly before the camera's plane, on
// planes that pass the eye by millimetres.
void discs_beside(struct harness *h, struct rng *rng, struct disc_scene *scene, double focal, float radius);
// Runs splat; returns the key plane.
struct pt_buffer *discs_splat(struct harness *h, struct disc_scene *scene);
// Every point of the scene, by rising id; count is the number of points.
struct ref_disc *discs_reference(struct harness *h, const struct disc_scene *scene, uint32_t *count);
// Of the reference's discs those near a pixel, by their places in the list: of a strip of pixels, while those that are asked for lie in
// it. Begin with {.strip = -1}.
struct around {
    int strip, y;
    uint32_t count, *places;
};
void discs_around(struct harness *h, struct around *around, const struct view_args *view, const struct ref_disc *discs,
                  uint32_t count, int x, int y);
const struct ref_disc *discs_find(const struct ref_disc *discs, uint32_t count, uint32_t id); // NULL: none

#endif
