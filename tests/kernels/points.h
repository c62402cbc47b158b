// SPDX-License-Identifier: GPL-3.0-or-later
// Random clouds in chunks before a camera, for the tests of kernels that walk points.
#ifndef PT_POINTS_H
#define PT_POINTS_H

#include "harness.h"

enum { MOST_INSTANCES = 4, POINTS_LANES = 16 };

struct cloud {
    struct chunk_view *chunks;
    uint32_t chunk_count, slots;
    float *positions;
    uint32_t *surfels;
};

struct scene {
    struct view_args view;
    struct cloud clouds[MOST_INSTANCES];
    uint32_t count;
    const float *limit; // by pixel: only points beyond it count; NULL: all
    uint32_t *drawn;    // of sifted chunks; NULL: there are none
    uint32_t words;
};

// A camera: view = rotation * object + shift, screen in pixels.
struct camera {
    double rotation[9], shift[3];
    double focal, center_x, center_y; // pixels at z = 1, or pixels per unit (orthographic)
    double near_clip;                 // orthographic: z = -view.z - near
};

// A window whose pixels are 1 / focal wide at z = 1 (orthographic: anywhere).
struct view_args points_window(uint32_t width, uint32_t height, int perspective, double focal);
// Looks at the middle of the objects from this distance, turned at random.
struct camera points_look(struct rng *rng, const struct view_args *view, double focal, double distance);

// Chunks of the given sizes, all seen by one camera; positions come from the caller afterwards.
struct cloud *points_add_cloud(struct harness *h, struct rng *rng, struct scene *scene, const struct camera *camera,
                               const uint32_t *sizes, uint32_t count, int cull, uint32_t id_base);
float *points_coordinate(struct cloud *cloud, uint32_t chunk, uint32_t slot, int axis);
// Points anywhere in the cube [-size, size]^3.
void points_scatter_about(struct rng *rng, struct cloud *cloud, double size);
void points_pad(struct cloud *cloud); // padding repeats the last point; then they are packed, where a case says so

// Runs a case once more with all its points packed: they are rounded in place where points_pad, or points_settle, is called.
void points_packed(struct harness *h, void (*run)(struct harness *h));
void points_settle(struct chunk_view *chunks, uint32_t count, float *positions);
// The buffer of positions, packed where the chunks are.
struct pt_buffer *points_positions(struct harness *h, const struct chunk_view *chunks, uint32_t count, const float *positions,
                                   uint32_t slots);

#endif
