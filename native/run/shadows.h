// SPDX-License-Identifier: GPL-3.0-or-later
// Shadow textures of a frame [D 6]: kept from render to render until something that they depend on changes.
#ifndef PT_SHADOWS_H
#define PT_SHADOWS_H

#include "plan_buffers.h"
#include "planes.h"

// What is known of a light's texture.
struct pt_shadow_light {
    double *key; // pt_light_key
    size_t key_count;
    uint32_t samples; // in the words; 0: the words say nothing
    uint32_t settled; // no more are wanted: every point's samples agree, or the error target is met
    float error;      // expected, as pt_shadow_error has it; 0: not measured, or there is none
    uint32_t partial; // lazy: only points that one picture showed; the next tests anew
};

// Pixels that show meshes: shadow words of theirs, light by light, as of a cloud's points.
struct pt_shadow_pixels {
    struct pt_buffer words;
    uint32_t samples[PT_MAX_LIGHTS]; // of each of the plan's lights, in this picture
    uint32_t pending;                // lights that further renders still refine
    uint64_t view;                   // of what picture that is
};

struct pt_shadows {
    struct pt_planes planes;         // of the maps
    struct pt_buffer *words, *marks; // per instance of the scene; empty where it receives none
    struct pt_buffer shown;          // words of marked points, of all instances, in place of theirs
    uint32_t of_marked;              // 1: those are meant
    uint32_t next;                   // samples that they get, where these come by and by: more at each picture of one view
    uint32_t reached;                // so many has the last picture, and wants more; 0: it has all
    uint64_t view;                   // of what picture that is
    uint32_t placed;                 // they have room, and no samples yet
    uint64_t *fingerprints;          // per instance: of whose points the words are; 0: none
    uint32_t instance_count;
    struct pt_shadow_light lights[PT_MAX_LIGHTS]; // in the plan's order
    uint32_t light_count;
    struct pt_buffer flags[PT_FLAGS]; // one word each
    struct pt_plan_buffers own;       // of the map at hand
    struct pt_shadow_pixels pixels;
    struct pt_buffer none; // never written: kernels that bind it do not touch it
};

// Messages are at the device, of all that fails here.

// Compares what the plan asks for with what is at hand and makes room. Afterwards pt_shadows_stale says whether any light
// is to be tested in this render: with shadow_lazy marked points alone.
int pt_shadows_open(struct patina_device *device, struct pt_shadows *shadows, const struct patina_scene *scene,
                    const struct pt_plan *plan);
int pt_shadows_stale(const struct pt_shadows *shadows, const struct patina_scene *scene, const struct pt_plan *plan);
// Samples that the light has after this render.
uint32_t pt_samples_wanted(const struct pt_shadows *shadows, const struct patina_scene *scene, const struct pt_plan *plan,
                           uint32_t light);
// A light's words at zero: no sample yet. Other lights' lie in the same buffers. Of marked points, which have their ranks by now: all of
// them, with the first light.
int pt_shadows_clear(struct patina_device *device, struct pt_shadows *shadows, uint32_t light);
int pt_flag_write(struct patina_device *device, struct pt_shadows *shadows, enum pt_flag flag, uint32_t word);
int pt_flag_read(struct patina_device *device, const struct pt_shadows *shadows, enum pt_flag flag, uint32_t *word);
// Of whose points words are; 0: the instance receives no shadows.
uint64_t pt_shadows_identity(const struct pt_instance *instance);
// Room for the words of these instances and lights, all forgotten; of_marked: for marks, in place of those.
int pt_shadows_make_places(struct patina_device *device, struct pt_shadows *shadows, const struct patina_scene *scene,
                           uint32_t light_count, int of_marked);
// An instance's marks or words; an empty buffer where there are none.
struct pt_buffer *pt_shadows_buffer(struct pt_shadows *shadows, uint32_t which, uint32_t instance);
void pt_shadows_release(struct patina_device *device, struct pt_shadows *shadows);

// ---- map_check.c ---------------------------------------------------------------------------------------------------------

// PATINA_ERROR_TOO_LARGE, with a message at the device, where a light's map does not fit into the device's buffers, the memory cap, or the
// memory that is free. After pt_plan_share_planes. all: of every light; else of those that this render tests. planes: the picture's.
int pt_maps_check(const struct patina_device *device, const struct pt_planes *planes, const struct pt_shadows *shadows, int all,
                  const struct patina_scene *scene, struct pt_plan *plan);

// ---- shadow_pixels.c -----------------------------------------------------------------------------------------------------

// Of all that what a picture shows depends on but the lights: where the camera is, what the planes hold, where meshes are.
uint64_t pt_pixels_view(const struct patina_scene *scene, const struct pt_plan *plan);
// Room for the picture's words and how many samples they get; changed: some light is not as it was.
int pt_pixels_open(struct patina_device *device, struct pt_shadow_pixels *pixels, const struct patina_scene *scene,
                   const struct pt_plan *plan, int changed);
// Of a layer whose pixels are covered: all words at zero. *some: a mesh shows somewhere.
int pt_pixels_begin(struct patina_device *device, struct pt_shadow_pixels *pixels, const struct pt_planes *picture,
                    const struct pt_plan *plan, int *some);

// ---- shadow_error.c ------------------------------------------------------------------------------------------------------

// What a light's samples took from each point, instance after instance; all zero before the first reading.
struct pt_shadow_sums {
    uint32_t *words;
    size_t count;
    uint32_t samples;
};
int pt_shadow_sums_read(struct patina_device *device, const struct pt_shadows *shadows, uint32_t light,
                        struct pt_shadow_sums *sums);
void pt_shadow_sums_free(struct pt_shadow_sums *sums);
// Expected error of `after`, root mean square over the points in the penumbra, from `before` with some of its samples.
float pt_shadow_error(const struct pt_shadow_sums *before, const struct pt_shadow_sums *after);

#endif
