// SPDX-License-Identifier: GPL-3.0-or-later
#include "execute.h"

#include <stdlib.h>

static int run_step(struct pt_execution *e, const struct pt_step *step)
{
    switch (step->of) {
    case PT_STEP_CLEAR: return pt_planes_clear(e->device, e->binder.planes, e->plan, step);
    case PT_STEP_PASSES: return pt_run_passes(e, step->first, step->count);
    case PT_STEP_MARK: return e->stale ? pt_run_passes(e, step->first, step->count) : PATINA_OK;
    case PT_STEP_LAYERS: return pt_walk(e, step + 1, pt_step_after(step));
    case PT_STEP_LAYER: return pt_run_layer(e, step);
    case PT_STEP_COVERED: return pt_read_covered(e, step);
    case PT_STEP_LIGHT: return pt_run_light(e, step);
    case PT_STEP_FACES: return pt_run_faces(e, step);
    case PT_STEP_FAINT: return pt_run_faint(e, step);
    case PT_STEP_MAP: return pt_run_map(e, step);
    case PT_STEP_CLOSE: return pt_run_close(e, step);
    }
    return PATINA_ERROR_INTERNAL;
}

int pt_walk(struct pt_execution *e, const struct pt_step *step, const struct pt_step *end)
{
    int error = PATINA_OK;
    for (; step < end && !error; step = pt_step_after(step))
        error = run_step(e, step);
    return error;
}

int pt_execute(struct pt_execution *e)
{
    const struct pt_plan *plan = e->plan;
    int error = pt_binder_open(&e->binder);
    e->late = calloc((size_t)plan->pass_count + 1, sizeof *e->late);
    e->behind = calloc((size_t)plan->instance_count + 1, sizeof *e->behind);
    if (!error && (!e->late || !e->behind))
        error = pt_fail(&e->device->handle, PATINA_ERROR_MEMORY, "a frame: out of memory");
    error = error ? error : pt_pager_begin(e->pager, plan);
    e->stale = plan->light_count && pt_shadows_stale(e->binder.shadows, e->scene, plan);
    return error || !plan->step_count ? error : pt_walk(e, plan->steps, plan->steps + plan->step_count);
}

void pt_execution_close(struct pt_execution *e)
{
    pt_binder_close(&e->binder);
    for (uint32_t i = 0; i < e->plan->pass_count && e->late; i++)
        free(e->late[i]);
    for (uint32_t i = 0; i < e->plan->instance_count && e->behind; i++)
        free(e->behind[i]);
    free(e->late);
    free(e->behind);
    free(e->tiles);
}
