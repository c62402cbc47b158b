// SPDX-License-Identifier: GPL-3.0-or-later
// The camera and objects in float64, up to the chunk-to-screen product (DESIGN rule 6), and where chunks lie on screen: for
// view.c and soft.c.
#ifndef PT_EYE_H
#define PT_EYE_H

#include "plan.h"
#include "scene/clip.h"

struct pt_eye {
    double axes[9], position[3];
    double xs, ys; // window units a pixel
    double near_clip, far_clip;
    double left, bottom; // of the padded picture
    int orthographic;
    double width, height; // padded picture, pixels
};

// Where a box lies.
struct pt_extent {
    double rect[4];            // on screen, pixels
    double z_middle, z_beyond; // of its part before the eye; nothing lies beyond
    double z_before;           // nothing lies before
    double share;              // how much of it lies before the eye
    int beside;                // it is bounded by some of the screen, but lies beside it
};

struct pt_object {
    double linear[9], translation[3]; // world from object
    double view[9];                   // camera axes x linear
    double inverse[9];                // object from world, linear part; valid when !singular
    double eye[4];                    // in its coordinates: xyz and 1, or the direction towards the viewer and 0
    double scale;                     // largest stretch
    int singular;
};

// As fmin and fmax, which are calls; the second where one is not a number.
static inline double pt_least(double a, double b) { return a < b ? a : b; }
static inline double pt_most(double a, double b) { return a > b ? a : b; }

// PATINA_ERROR_ARGUMENT where the camera is singular, with a message at the scene.
int pt_eye_of(const struct patina_scene *scene, struct pt_eye *camera);

// A picture that is so many pixels wider on each side.
void pt_pad_eye(struct pt_eye *camera, uint32_t guard);

void pt_object_of(const struct pt_eye *camera, const double world_from_object[16], struct pt_object *object);

// Normals are covectors: the inverse transposed, which also keeps "outward" under mirroring. Scaled to about 1.
void pt_normal_matrix(const struct pt_eye *camera, const struct pt_object *object, float out[9]);

// The product's rows, the same for every chunk of an object: screen X, Y (perspective: times z) and z.
void pt_object_rows(const struct pt_eye *camera, const struct pt_object *object, double rows[9]);

// The product's translation: of the chunk's origin.
void pt_chunk_translation(const struct pt_eye *camera, const struct pt_object *object, const struct pt_chunk *chunk,
                          double translation[3]);

// Extent on screen of what is drawn in one way, as its kind's row says, a pixel wider than exact. Returns 0 when it is outside the view.
// box: of a chunk, or of a mesh.
int pt_kind_bounds(const struct pt_eye *camera, enum pt_kind kind, const struct pt_to_place *what, const struct pt_chunk *box,
                   const double rows[9], const double translation[3], struct pt_extent *out);
// kinds.c: what nine of ten of the chunk's discs stay below, world units.
double pt_usual_disc(const struct pt_to_place *what, const struct pt_chunk *chunk);
// thinned: how much farther apart than its cloud's the points that are drawn lie.
struct pt_drawn_discs pt_discs_of(const struct pt_to_place *what, double thinned);
struct pt_drawn_balls pt_balls_of(const struct pt_to_place *what);

// The object's eye, in the chunk's coordinates.
void pt_chunk_eye(const struct pt_object *object, const struct pt_chunk *chunk, double eye[4]);

// Rounded to what points are multiplied with; the translation in two parts, for where it is large beside the sum.
void pt_set_product(const double rows[9], const double translation[3], float row[9], float hi[3], float lo[3]);

void pt_set_chunk(const struct pt_eye *camera, const struct pt_object *object, const double rows[9],
                  const struct pt_instance *instance, const struct pt_chunk *chunk, uint32_t count, uint32_t cull,
                  struct chunk_view *out);

void pt_set_instance(const struct pt_eye *camera, const struct pt_object *object, const struct pt_instance *instance,
                     double thinned, struct instance_args *args);

void pt_join_rect(uint32_t rect[4], const uint32_t other[4]);

// The part of bounds, in a picture padded by `pad` less than the planes' one, that the planes hold; 0 when none.
int pt_rect_in_window(const struct view_args *view, const double bounds[4], uint32_t pad, uint32_t rect[4]);

// How many of a chunk's points the settings ask for: whole vectors, for the processor draws no part of one.
uint32_t pt_drawn_points(const struct patina_scene *scene, const struct pt_chunk *chunk);

// pages.c: whether chunk c is not known to be damaged: else it is not drawn. What is decided by all that is in view counts it, so that nothing depends on
// who found the damage, and when: what is hidden is not looked at.
int pt_plan_is_sound(const struct patina_scene *scene, const struct patina_cloud *cloud, uint32_t c);

#endif
