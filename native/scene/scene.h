// SPDX-License-Identifier: GPL-3.0-or-later
// A scene: instances of clouds, lights, a camera, settings. Knows no device.
#ifndef PT_SCENE_H
#define PT_SCENE_H

#include "scene/clouds/cloud.h"
#include "mesh.h"
#include "texture.h"
#include "base/vector.h"

#include <math.h>

static inline int pt_is_zero(const float v[3]) { return v[0] == 0.0f && v[1] == 0.0f && v[2] == 0.0f; }

// What an instance is of.
enum pt_source { PT_SOURCE_CLOUD, PT_SOURCE_MESH };

struct pt_instance {
    enum pt_source source;
    union {
        uint32_t id_base; // of a mesh's first triangle among triangles
        uint32_t number;  // of a cloud, as callers count them: its parts (parts.h) are instances of one number
    };
    union {
        const struct patina_cloud *cloud;
        const struct patina_mesh *mesh;
    };
    const struct patina_cloud *whole; // that `cloud` is a part of, or itself
    union {                           // defaults made explicit
        patina_cloud_style style;     // its ramp is the scene's
        patina_mesh_style mesh_style;
    };
};

struct patina_scene {
    struct pt_handle handle;
    struct pt_instance *instances; // those of clouds, whose numbers callers know; behind them those of meshes: so do ids
    uint32_t cloud_count, mesh_count, instance_room; // parts of clouds counted
    uint32_t given;                                  // clouds, as callers count them
    patina_light_desc *lights;
    uint32_t light_count, light_room;
    uint64_t triangles; // of all meshes
    patina_clip *clips; // defaults made explicit
    uint32_t clip_count, clip_room;
    patina_camera camera;
    int has_camera;
    patina_settings settings; // defaults made explicit
    patina_effects effects;   // likewise
    patina_lines lines;       // defaults made explicit
    int has_lines;
    uint32_t finer; // pixels on each side of one that the caller asked for: of its samples. 0 or 1: it is one
    int in_parts;   // drawn so: plans leave no damaged page out, for all parts must agree on them; binding does
};

// Returns the largest grid of finer pixels, at most `most`, with which each pixel of the image may be sampled. Finer pixels must
// not change the look of the effects, see PATINA_EFFECT_GRID in patina/effects.def. Takes effects with explicit defaults.
uint32_t pt_effects_grid(const patina_effects *effects, uint32_t most);

// Lengths in pixels, of a picture of so many times finer ones.
void pt_effects_scale(patina_effects *effects, float factor);

static inline struct pt_instance *pt_mesh_at(const struct patina_scene *scene, uint32_t i)
{
    return &scene->instances[scene->cloud_count + i];
}

static inline int pt_same_cloud(const struct patina_scene *scene, uint32_t a, uint32_t b)
{
    return scene->instances[a].number == scene->instances[b].number;
}
static inline int pt_is_first_part(const struct patina_scene *scene, uint32_t i)
{
    return !i || !pt_same_cloud(scene, i, i - 1);
}
// The instances that a caller's number is of: how many, from *first on; 0: there is no such number.
uint32_t pt_scene_parts(const struct patina_scene *scene, uint32_t number, uint32_t *first);

// How much farther apart points lie when only some strata are drawn: with half of them, by the root of 2.
static inline double pt_thinning(const struct patina_scene *scene)
{
    const uint32_t strata = scene->settings.strata;
    return strata ? sqrt((double)(1u << (PT_STRATA - strata))) : 1.0;
}

static inline uint32_t pt_finer(const struct patina_scene *scene) { return scene->finer > 1 ? scene->finer : 1; }

// Small 3 x 3 algebra in float64, row-major.
double pt_determinant(const double m[9]);
void pt_cofactors(const double m[9], double out[9]); // inverse transposed = cofactors / determinant
double pt_invert(const double m[9], double out[9]);  // returns the determinant; out is anything where that is 0
void pt_multiply(const double a[9], const double b[9], double out[9]);
static inline void pt_apply(const double m[9], const double v[3], double out[3])
{
    for (int r = 0; r < 3; r++)
        out[r] = pt_dot(m + 3 * r, v);
}

// The camera's axes (unit, rows x, y, z) and position from world_from_camera. PATINA_ERROR_ARGUMENT when singular.
int pt_camera_axes(const patina_camera *camera, double axes[9], double position[3]);
// A 4 x 4 matrix of the caller's: all zero becomes the identity. Whether it is finite.
int pt_take_matrix(double matrix[16]);
// The linear part (row-major 3 x 3) and translation of a 4 x 4 matrix.
void pt_split_matrix(const double matrix[16], double linear[9], double translation[3]);

// Calls back with the eight world-space corners of every chunk's box, closer to the points than the cloud's own, and of every
// mesh's box; of chunks that clips cut away, nothing. PATINA_ERROR_MEMORY when there is none; without points, nothing is
// called back.
typedef void pt_corner_work(void *context, const double corner[3]);
// The eight of a box, moved by a matrix.
void pt_box_corners(const double lower[3], const double upper[3], const double matrix[16], pt_corner_work *work, void *context);
int pt_each_corner(const struct patina_scene *scene, pt_corner_work *work, void *context);
void pt_mesh_corners(const struct pt_instance *instance, pt_corner_work *work, void *context);

// Whether some points may be balls, and whether a field divides the points.
static inline int pt_has_balls(const patina_cloud_style *style)
{
    return style->soft == PATINA_SOFT_ALL || style->soft == PATINA_SOFT_FIELD;
}
static inline int pt_has_field(const patina_cloud_style *style)
{
    return style->soft == PATINA_SOFT_FIELD || style->soft == PATINA_SOFT_HIDDEN;
}
// None of its points is drawn as a point or disc.
static inline int pt_all_soft(const struct pt_instance *instance) { return instance->style.soft == PATINA_SOFT_ALL; }

#endif
