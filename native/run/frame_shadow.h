// SPDX-License-Identifier: GPL-3.0-or-later
// Shadow textures of a frame [D 6]: kept from render to render until something that they depend on changes.
#ifndef PT_FRAME_SHADOW_H
#define PT_FRAME_SHADOW_H

#include "frame_clip.h"

struct patina_frame;

// What is known of a light's texture.
struct pt_shadow_light {
    double *key; // pt_light_key
    size_t key_count;
    uint32_t samples; // in the words; 0: the words say nothing
    uint32_t settled; // no more are wanted: every point's samples agree, or the error target is met
    float error;      // expected, as pt_shadow_error has it; 0: not measured, or there is none
    uint32_t partial; // lazy: only points that one picture showed; the next tests anew
};

// Pixels that show meshes: shadow words of theirs, light by light, as of a cloud's points. PT_PLANE_MESH_PLACES are its positions.
struct pt_shadow_pixels {
    struct pt_buffer words;
    uint32_t samples[PT_MAX_LIGHTS]; // of each of the plan's lights, in this picture
    uint32_t pending;                // lights that further renders still refine
    uint64_t view;                   // of what picture that is
};

// These pixels as a cloud in view space, for the tests of one layer; chunks NULL: no pixel shows a mesh.
struct pt_pixel_receiver {
    struct patina_cloud cloud;
    struct pt_instance instance;
    struct pt_chunk *chunks;
};

struct pt_shadows {
    struct pt_buffer planes[PT_PLANE_COUNT][PT_SLOTS]; // of the maps
    struct pt_buffer *words, *marks; // per instance of the scene; empty where it receives none
    uint64_t *fingerprints;          // per instance: of whose points the words are; 0: none
    uint32_t instance_count;
    struct pt_shadow_light lights[PT_MAX_LIGHTS]; // in the plan's order
    uint32_t light_count;
    struct pt_buffer differs, some; // one word each: see lit, limit
    struct pt_clip_buffers clips; // of the map at hand
    struct pt_shadow_pixels pixels;
};

// Compares what the plan asks for with what is at hand and makes room. Afterwards pt_shadows_stale says whether any light
// is to be tested in this render.
int pt_shadows_open(struct patina_frame *frame, const struct patina_scene *scene, const struct pt_plan *plan);
int pt_shadows_stale(const struct patina_frame *frame, const struct patina_scene *scene, const struct pt_plan *plan);
// Tests what is to be tested, and tells the plan's shade passes what the words mean. With shadow_lazy the marks are set.
int pt_shadows_update(struct patina_frame *frame, const struct patina_scene *scene, struct pt_plan *plan);
// The same of a layer behind the first, for the meshes that it shows.
int pt_shadows_behind(struct patina_frame *frame, const struct patina_scene *scene, struct pt_plan *plan);
// frame_shadow_pixels.c: room for the picture's words and how many samples they get; changed: some light is not as it was.
int pt_pixels_open(struct patina_frame *frame, const struct patina_scene *scene, const struct pt_plan *plan, int changed);
// Of a layer whose pixels are covered: who is to be tested, all words at zero.
int pt_pixels_begin(struct patina_frame *frame, const struct patina_scene *scene, const struct pt_plan *plan,
                    struct pt_pixel_receiver *out);
void pt_pixels_end(struct pt_pixel_receiver *receiver);
void pt_pixels_release(struct patina_frame *frame);
// What a light's samples took from each point, instance after instance; all zero before the first reading.
struct pt_shadow_sums {
    uint32_t *words;
    size_t count;
    uint32_t samples;
};
// frame_shadow_error.c
int pt_shadow_sums_read(struct patina_frame *frame, uint32_t light, struct pt_shadow_sums *sums);
void pt_shadow_sums_free(struct pt_shadow_sums *sums);
// Expected error of `after`, root mean square over the points in the penumbra, from `before` with some of its samples.
float pt_shadow_error(const struct pt_shadow_sums *before, const struct pt_shadow_sums *after);
// All of the scene's textures, whole, without a picture.
int pt_shadows_bake(struct patina_frame *frame, const struct patina_scene *scene);
// What arrives of the light at each point of the instance.
int pt_shadows_read(const struct patina_frame *frame, uint32_t instance, uint32_t light, float *values, size_t size);
// frame_shadow_file.c
int pt_shadows_save(const struct patina_frame *frame, const char *path);
int pt_shadows_load(struct patina_frame *frame, const struct patina_scene *scene, const char *path);
// Of whose points words are; 0: the instance receives no shadows.
uint64_t pt_shadows_identity(const struct pt_instance *instance);
// Room for the words of these instances and lights, all forgotten.
int pt_shadows_make_places(struct patina_frame *frame, const struct patina_scene *scene, uint32_t light_count);
// An instance's marks or words; an empty buffer where there are none.
struct pt_buffer *pt_shadows_buffer(struct patina_frame *frame, uint32_t which, uint32_t instance);
void pt_shadows_release(struct patina_frame *frame);

#endif
