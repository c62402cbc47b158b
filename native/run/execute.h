// SPDX-License-Identifier: GPL-3.0-or-later
// The executor: runs a plan, of a picture or of a light's map, step by step. It decides nothing but by the ends that steps name
// (plan/steps.h), and knows no kernel.
#ifndef PT_EXECUTE_H
#define PT_EXECUTE_H

#include "binder.h"
#include "layers.h"
#include "merge.h"
#include "pager.h"
#include "times.h"

struct pt_execution {
    struct patina_device *device;
    const struct patina_scene *scene;
    struct pt_plan *plan; // the places of its lights' maps are found once a light's turn comes
    struct pt_binder binder;
    struct pt_merge *merge; // NULL: points are scattered here
    struct pt_pager *pager; // of the picture, and of the maps that serve it
    struct pt_times *times;
    const atomic_int *cancel;
    int stops_writing;                   // whether cancel stops the picture too while it is written
    _Atomic float *progress;             // NULL: nobody looks
    float progress_done, progress_share; // before this plan, and by it
    int writing;                         // the picture
    void **late;                         // per pass: its arguments with what is known late; NULL: as planned
    // of layers
    struct pt_layer *layers;    // NULL: of a map
    uint32_t layer_count;       // begun
    struct chunk_view **behind; // per instance: those of the layer at hand, behind the first
    struct pt_tile *tiles;      // what the last layer left
    int ended;                  // there are no further layers
    // of lights
    struct pt_round round;
    int begun;                  // 1 + the layer whose pixels are ready for tests
    int shown, stale;           // some pixel shows a mesh; some texture is to be tested
    double tested;              // when the last light was through
    uint32_t maps, map_size[2]; // drawn; of the largest
};

uint32_t pt_passes_together(const void *device, const struct pt_pass *passes); // pt_together; device: struct patina_device

// binder, times, cancel, scene, plan, device, progress and layers are set by the caller, who keeps them.
int pt_execute(struct pt_execution *execution);
// Frees what the execution holds, the binder too.
void pt_execution_close(struct pt_execution *execution);

// ---- its parts -----------------------------------------------------------------------------------------------------------

int pt_walk(struct pt_execution *execution, const struct pt_step *step, const struct pt_step *end);
// What passes poll now. NULL: nothing stops them.
static inline const atomic_int *pt_polled(const struct pt_execution *e)
{
    return e->writing && !e->stops_writing ? NULL : e->cancel;
}

int pt_run_passes(struct pt_execution *execution, uint32_t first, uint32_t count); // passes.c
int pt_run_layer(struct pt_execution *execution, const struct pt_step *step);      // layers.c
int pt_read_covered(struct pt_execution *execution, const struct pt_step *step);
int pt_run_light(struct pt_execution *execution, const struct pt_step *step); // lights.c
int pt_run_faces(struct pt_execution *execution, const struct pt_step *step);
int pt_run_faint(struct pt_execution *execution, const struct pt_step *step);
int pt_run_map(struct pt_execution *execution, const struct pt_step *step);
int pt_run_close(struct pt_execution *execution, const struct pt_step *step);

#endif
