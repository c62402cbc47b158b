// SPDX-License-Identifier: GPL-3.0-or-later
// The loops of shadow textures [D 6]: for each sample of a light its maps are drawn, as any picture up to filling, and every point is
// tested against them.
#include "execute.h"

#include <stdlib.h>
#include <string.h>

enum {
    FIRST_COMPARED = 4
}; // samples after which a light may stop, because all agree or enough is known; then at every doubling

// ---- maps ----------------------------------------------------------------------------------------------------------------

// Runs a sub-plan on the planes of the maps.
static int run_plan(struct pt_execution *e, struct pt_plan *plan)
{
    struct pt_shadows *shadows = e->binder.shadows;
    struct pt_execution inner = {.device = e->device,
                                 .scene = e->scene,
                                 .plan = plan,
                                 .merge = e->merge,
                                 .pager = e->pager,
                                 .round = e->round,
                                 .times = e->times,
                                 .cancel = e->cancel,
                                 .binder = {.device = e->device,
                                            .plan = plan,
                                            .residency = e->binder.residency,
                                            .planes = &shadows->planes,
                                            .picture = e->binder.planes,
                                            .in_parts = e->binder.in_parts,
                                            .own = &shadows->own,
                                            .shadows = shadows}};
    const int error = pt_execute(&inner);
    pt_execution_close(&inner);
    return error;
}

int pt_run_map(struct pt_execution *e, const struct pt_step *step)
{
    struct pt_plan map;
    const double start = pt_milliseconds();
    e->round.group = step->group;
    int error = pt_plan_map(e->scene, e->plan, &e->round, &map);
    pt_note_time(e->times, "light map", pt_milliseconds() - start);
    if (error)
        return error;
    if (map.pass_count) {
        e->maps++;
        e->map_size[0] = map.crop[2] > e->map_size[0] ? map.crop[2] : e->map_size[0];
        e->map_size[1] = map.crop[3] > e->map_size[1] ? map.crop[3] : e->map_size[1];
        error = run_plan(e, &map);
    }
    pt_plan_destroy(&map);
    return error;
}

int pt_run_close(struct pt_execution *e, const struct pt_step *step)
{
    struct pt_plan close;
    (void)step;
    int error = pt_plan_close(e->scene, e->plan, &e->round, &close);
    if (error)
        return error;
    error = run_plan(e, &close);
    pt_plan_destroy(&close);
    return error;
}

int pt_run_faint(struct pt_execution *e, const struct pt_step *step)
{
    uint32_t some = 0;
    int error = PATINA_OK;
    for (uint32_t layer = 0; layer < step->most && !error && (some || !layer); layer++) {
        const uint32_t none = 0;
        e->round.layer = layer;
        error = pt_flag_write(e->device, e->binder.shadows, PT_FLAG_SOME, none); // a map that shows nothing leaves it so
        if (!error)
            error = pt_walk(e, step + 1, pt_step_after(step));
        if (!error)
            error = pt_flag_read(e->device, e->binder.shadows, PT_FLAG_SOME, &some);
    }
    e->round.layer = 0;
    return error;
}

int pt_run_faces(struct pt_execution *e, const struct pt_step *step)
{
    const uint32_t faces = pt_light_faces(e->plan, e->round.light);
    int error = PATINA_OK;
    for (uint32_t face = 0; face < faces && !error && pt_plan_tested(e->scene, e->plan, &e->round, step->group); face++) {
        e->round.face = face;
        error = pt_walk(e, step + 1, pt_step_after(step));
    }
    e->round.face = 0;
    return error;
}

// ---- samples -------------------------------------------------------------------------------------------------------------

// points: they are tested; pixels are, as far as they want so many samples.
static int take_sample(struct pt_execution *e, const struct pt_step *step, uint32_t sample, int points, int compare)
{
    e->round = (struct pt_round){.light = step->light,
                                 .sample = sample,
                                 .points = points,
                                 .pixels = e->shown && sample < e->binder.shadows->pixels.samples[step->light],
                                 .compare = compare};
    return e->round.points || e->round.pixels ? pt_walk(e, step + 1, pt_step_after(step)) : PATINA_OK;
}

// Whether the error after so many samples is compared with that after half of them, or the last stop before the end.
static int measures_at(const struct pt_step *step, uint32_t samples)
{
    return (step->ends & PT_END_ERROR_MET) &&
           ((samples >= FIRST_COMPARED / 2 && !(samples & (samples - 1))) || samples == step->most);
}

// before: the sums of the last stop, in and out.
static int measure_error(struct pt_execution *e, uint32_t index, struct pt_shadow_sums *before)
{
    struct pt_shadow_light *light = &e->binder.shadows->lights[index];
    struct pt_shadow_sums now = {0};
    int error = pt_shadow_sums_read(e->device, e->binder.shadows, index, &now);
    if (!error && before->words && before->samples < now.samples) {
        light->error = pt_shadow_error(before, &now);
        light->settled |= light->error <= e->scene->settings.shadow_error;
    }
    pt_shadow_sums_free(before);
    *before = now;
    return error;
}

// A part of a picture looks at its own points alone, which may agree where others do not: it would stop at other samples than the whole.
static int may_settle(const struct pt_execution *e)
{
    const patina_settings *s = &e->scene->settings;
    const uint32_t whole[4] = {0, 0, s->width, s->height};
    return !e->binder.shadows->of_marked || !memcmp(s->region, whole, sizeof whole);
}

// One sample of points; compare: light->settled where all agree.
static int test_sample(struct pt_execution *e, const struct pt_step *step, uint32_t sample, int compare)
{
    struct pt_shadows *shadows = e->binder.shadows;
    struct pt_shadow_light *light = &shadows->lights[step->light];
    uint32_t differs = 0;
    int error = e->cancel && atomic_load(e->cancel) ? PATINA_ERROR_CANCELLED : PATINA_OK;
    light->samples = 0; // half a sample is none
    if (!error && compare)
        error = pt_flag_write(e->device, shadows, PT_FLAG_DIFFERS, differs);
    if (!error)
        error = take_sample(e, step, sample, 1, compare);
    if (!error && compare)
        error = pt_flag_read(e->device, shadows, PT_FLAG_DIFFERS, &differs);
    if (error)
        return error;
    light->samples = sample + 1;
    light->settled = compare && !differs && may_settle(e);
    light->partial = (uint32_t)pt_plan_lazy(e->scene, e->plan);
    return PATINA_OK;
}

// Samples of a light's points from `done` on, as many as are wanted; *end: where they stopped.
static int test_points(struct pt_execution *e, const struct pt_step *step, uint32_t done, uint32_t wanted, uint32_t *end)
{
    struct pt_shadow_light *light = &e->binder.shadows->lights[step->light];
    struct pt_shadow_sums before = {0};
    int error = done ? PATINA_OK : pt_shadows_clear(e->device, e->binder.shadows, step->light);
    if (!error && measures_at(step, done))
        error = measure_error(e, step->light, &before);
    if (!done)
        light->error = 0.0f;
    for (uint32_t stop = FIRST_COMPARED; done < wanted && !error && !light->settled; done++) {
        while (stop < done + 1)
            stop *= 2;
        error = test_sample(e, step, done, stop == done + 1);
        if (!error && measures_at(step, done + 1))
            error = measure_error(e, step->light, &before);
    }
    pt_shadow_sums_free(&before);
    *end = done;
    return error;
}

static int some_receives(const struct patina_scene *scene)
{
    for (uint32_t i = 0; i < scene->cloud_count; i++)
        if (pt_receives(&scene->instances[i]))
            return 1;
    return 0;
}

// points: they are brought up to the samples that they want; pixels that show meshes get theirs in any case.
static int test_light(struct pt_execution *e, const struct pt_step *step, int points)
{
    struct pt_shadows *shadows = e->binder.shadows;
    struct pt_shadow_light *light = &shadows->lights[step->light];
    const uint32_t first = light->samples, wanted = points ? pt_samples_wanted(shadows, e->scene, e->plan, step->light) : first;
    const uint32_t of_pixels = e->shown ? shadows->pixels.samples[step->light] : 0;
    uint32_t end = first;
    const double start = pt_milliseconds();
    if (first < wanted && !some_receives(e->scene))
        light->samples = end = wanted;
    if (end == wanted && !of_pixels)
        return PATINA_OK;
    int error = pt_plan_light_map(e->scene, e->plan, step->light);
    pt_note_time(e->times, "light map", pt_milliseconds() - start);
    if (!error && end < wanted)
        error = test_points(e, step, first, wanted, &end);
    for (uint32_t sample = 0; sample < of_pixels && !error; sample++) {
        if (e->cancel && atomic_load(e->cancel))
            error = PATINA_ERROR_CANCELLED;
        else if (sample < first || sample >= end || !some_receives(e->scene)) // else with the points
            error = take_sample(e, step, sample, 0, 0);
    }
    return error;
}

int pt_run_light(struct pt_execution *e, const struct pt_step *step)
{
    int error = PATINA_OK;
    if (step->layer <= 1)
        pt_note_time(e->times, "shadows", 0.0); // also where every texture is at hand
    if (e->plan->mesh.shadows && e->begun != 1 + (int)step->layer)
        error = pt_pixels_begin(e->device, &e->binder.shadows->pixels, e->binder.planes, e->plan, &e->shown);
    e->begun = 1 + (int)step->layer;
    if (error)
        return error;
    error = pt_planes_poison_slabs(e->device, e->binder.planes, step->idle);
    pt_planes_borrow(&e->binder.shadows->planes, step->idle);
    if (!error)
        error = test_light(e, step, step->layer <= 1 && e->stale);
    pt_planes_borrow(&e->binder.shadows->planes, 0);
    if (!error)
        error = pt_planes_poison_slabs(e->device, e->binder.planes, step->idle);
    return error;
}
