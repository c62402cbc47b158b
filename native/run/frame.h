// SPDX-License-Identifier: GPL-3.0-or-later
#ifndef PT_FRAME_H
#define PT_FRAME_H

#include "layers.h"
#include "numbering.h"
#include "pager.h"
#include "residency.h"
#include "shadows.h"
#include "times.h"

struct pt_mean;
struct pt_merge;

// What readers are told of the last finished render. The planes of its picture go with it.
struct pt_shown {
    patina_frame_stats stats;
    uint32_t soft_parts, soft_records; // of soft points; in the largest part
    uint64_t peak;                     // bytes of planes that the plan came to, those of light maps apart
    uint32_t passes;                   // bits of what was rendered
    uint32_t assessed;                 // passes of trust, thickness, density that have planes, bits 1 << PATINA_PASS_*
    uint32_t layer_most;               // that the settings allowed
    uint32_t layer_passes;             // bits of what was kept of each
    uint32_t crop[4], plane_width;
    int picture_valid;
    int has_lines;
    int all_lit; // no light cast a shadow: there is no plane that says so
};

struct patina_frame {
    struct pt_handle handle;
    struct patina_device *device;
    struct pt_residency residency;
    struct pt_numbering numbering; // of the last scene that was rendered, baked or loaded for
    struct pt_numbering key_ids;   // of the picture that the keys are of
    struct pt_planes planes;
    struct pt_shown shown;
    struct pt_shadows shadows;
    struct pt_plan_buffers own;
    uint32_t shadow_maps, shadow_size[2]; // of this render
    atomic_int cancel;
    _Atomic float progress;
    float progress_done, progress_share; // of the render: before the picture at hand, and by it
    uint32_t sampling[2];                // of the last picture: grid and shifts of its samples
    struct pt_mean *mean;                // while samples of the last picture are pending
    struct pt_merge *merge;              // while parts are merged; NULL: points are scattered here
    struct pt_pager pager;               // of this render
    struct pt_times times;
    struct pt_counts counts; // of this render
    int measured;            // renders are: see struct patina_device
    struct pt_skipped skipped[PT_KERNEL_COUNT + 4];
    uint32_t skipped_count;
    struct pt_layer layers[PATINA_MAX_LAYERS];
    uint32_t layer_count; // scattered
    uint32_t light_count; // that cast shadows
    int keys_valid;
};

int pt_frame_render(struct patina_frame *frame, const struct patina_scene *scene);
// One picture, whatever the scene says of samples: what rendering does over and over.
int pt_frame_check(struct patina_frame *frame, const struct patina_scene *scene); // whether that would be refused for its size
int pt_frame_draw(struct patina_frame *frame, const struct patina_scene *scene);  // frame_draw.c
struct pt_plan;
// The plan's planes in memory, as the frame's device and what it drew before have it.
int pt_frame_share_planes(const struct patina_frame *frame, struct pt_plan *plan);
int pt_frame_execute(struct patina_frame *frame, const struct patina_scene *scene,
                     struct pt_plan *plan); // on the frame's planes
// What is begun, over and over while it ends with PT_AGAIN: each time more pages are known to be damaged, and left out. `what` it is, for
// the message of a cancelled one; of others the frame keeps the thread's.
typedef int pt_frame_job(struct patina_frame *frame, const struct patina_scene *scene, const void *of);
int pt_frame_until_sound(struct patina_frame *frame, const struct patina_scene *scene, const char *what, pt_frame_job *once,
                         const void *of);
int pt_frame_read(const struct patina_frame *frame, uint32_t pass, float *pixels, size_t size);
int pt_frame_read_layer(const struct patina_frame *frame, uint32_t layer, uint32_t pass, float *pixels, size_t size);
int pt_frame_read_keys(const struct patina_frame *frame, uint64_t *keys, size_t size);
int pt_frame_read_numbers(const struct patina_frame *frame, uint64_t *numbers, size_t size);
// The same with ids as they are, which frame->key_ids knows. PATINA_ERROR_ARGUMENT where the frame's last picture has not the scene's clouds.
int pt_frame_read_ids(const struct patina_frame *frame, const struct patina_scene *scene, uint64_t *keys, size_t size);
size_t pt_frame_stats_json(const struct patina_frame *frame, char *buffer, size_t size);
int pt_frame_dump(const struct patina_frame *frame, const char *folder);
// All of the scene's shadow textures, whole, without a picture.
int pt_frame_bake(struct patina_frame *frame, const struct patina_scene *scene);
// What arrives of the light at each point of the instance.
int pt_frame_read_shadows(const struct patina_frame *frame, uint32_t instance, uint32_t light, float *values, size_t size);
// frame_part.c: as patina_frame_scatter and patina_frame_merge say.
int pt_frame_scatter(struct patina_frame *frame, const struct patina_scene *scene, const patina_part *part, const char *path);
int pt_frame_merge(struct patina_frame *frame, const struct patina_scene *scene, const char *const *paths, uint32_t count,
                   const char *next, uint32_t *round);
// frame_shadow_file.c
int pt_frame_save_shadows(const struct patina_frame *frame, const char *path);
int pt_frame_load_shadows(struct patina_frame *frame, const struct patina_scene *scene, const char *path);
// Takes the scene's numbering over, and the ids of a plan whose keys follow (or NULL); PATINA_ERROR_MEMORY says so.
int pt_frame_number(struct patina_frame *frame, const struct patina_scene *scene, const struct pt_plan *plan);
void pt_frame_release(struct patina_frame *frame); // planes and resident clouds

#endif
