// SPDX-License-Identifier: GPL-3.0-or-later
// A frame walks its plan: planes and buffers are bound, kernels run, the picture is kept for reading.
#include "frame.h"

#include "frame_samples.h"
#include "layers.h"
#include "residency.h"
#include "scene/mask.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static const uint32_t plane_bytes[PT_PLANE_COUNT] = {
#define PT_X(name, bytes, levels) bytes,
    PT_PLANES(PT_X)
#undef PT_X
};

static const char *const plane_names[PT_PLANE_COUNT] = {
#define PT_X(name, bytes, levels) #name,
    PT_PLANES(PT_X)
#undef PT_X
};

double pt_milliseconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return 1e3 * (double)now.tv_sec + 1e-6 * (double)now.tv_nsec;
}

// ---- planes ------------------------------------------------------------------------------------------------------------

static uint64_t plane_total(const struct patina_frame *frame)
{
    uint64_t total = 0;
    for (int p = 0; p < PT_PLANE_COUNT; p++)
        for (int level = 0; level < PT_SLOTS; level++)
            total += frame->planes[p][level].room + frame->shadows.planes[p][level].room;
    return total;
}

static size_t size_of(const struct pt_plan *plan, enum pt_plane which, uint32_t level)
{
    uint32_t size[2];
    pt_plan_plane_size(plan, which, level, size);
    return (size_t)size[0] * size[1] * plane_bytes[which];
}

static int check_cap(const struct patina_frame *frame, const struct pt_plan *plan, uint64_t total)
{
    uint64_t cap = frame->device->memory_cap;
    if (!cap || total <= cap)
        return PATINA_OK;
    return pt_fail(&frame->handle, PATINA_ERROR_MEMORY,
                   "the planes of a %u x %u picture take more than the %llu MB allowed: render it in regions",
                   plan->crop[2], plan->crop[3], (unsigned long long)(cap >> 20));
}

// Frames of a moving camera differ by some pixels of margin, maps of one light by a texel or two: that is not worth new memory
// each time, so who asks again for more gets an eighth above. Near the cap memory counts for more.
static size_t room_for(const struct patina_frame *frame, size_t bytes)
{
    const uint64_t cap = frame->device->memory_cap, total = plane_total(frame);
    return cap && total + total / 4 > cap ? bytes : bytes + bytes / 8;
}

int pt_frame_ensure_plane(struct patina_frame *frame, struct pt_buffer (*planes)[PT_SLOTS], const struct pt_plan *plan,
                          enum pt_plane which, uint32_t level)
{
    struct pt_buffer *plane = &planes[which][level];
    const size_t bytes = size_of(plan, which, level);
    if (plane->room < bytes || plane->room >= 2 * bytes) {
        const int varies = planes != frame->planes || plane->room;
        const size_t room = varies ? room_for(frame, bytes) : bytes;
        frame->device->ops->buffer_destroy(frame->device, plane);
        int error = check_cap(frame, plan, plane_total(frame) + room);
        if (!error)
            error = frame->device->ops->buffer_create(frame->device, room, NULL, 0, plane);
        if (error)
            return pt_fail_again(&frame->handle, error);
    }
    plane->size = bytes;
    return PATINA_OK;
}

// Makes room for the whole picture before any of it is written: what cannot be had leaves the last picture as it is.
static int ensure_picture(struct patina_frame *frame, const struct pt_plan *plan)
{
    const struct pt_device_ops *ops = frame->device->ops;
    struct pt_buffer made[PT_PLANE_COUNT] = { 0 };
    uint64_t total = plane_total(frame);
    int error = PATINA_OK;
    for (int p = PT_PLANE_COMBINED; p < PT_PLANE_LAYER_COMBINED && !error; p++) {
        size_t bytes = size_of(plan, (enum pt_plane)p, 0);
        const int unused = (p == PT_PLANE_SHADOW && !plan->light_count) || (p == PT_PLANE_LINES && !(plan->line_radius > 0.0f)) ||
                           (p == PT_PLANE_CERTAINTY && !(plan->assessed >> PATINA_PASS_CERTAINTY & 1u)) ||
                           (p == PT_PLANE_THICKNESS && !(plan->assessed >> PATINA_PASS_THICKNESS & 1u));
        if (frame->planes[p][0].size == bytes || unused)
            continue;
        total += bytes - frame->planes[p][0].size;
        error = check_cap(frame, plan, total);
        if (!error)
            error = ops->buffer_create(frame->device, bytes, NULL, 0, &made[p]);
    }
    for (int p = PT_PLANE_COMBINED; p < PT_PLANE_LAYER_COMBINED; p++) {
        if (!made[p].size)
            continue;
        ops->buffer_destroy(frame->device, error ? &made[p] : &frame->planes[p][0]);
        if (!error)
            frame->planes[p][0] = made[p];
    }
    return error ? pt_fail_again(&frame->handle, error) : PATINA_OK;
}

static void destroy_planes(struct patina_frame *frame)
{
    for (int p = 0; p < PT_PLANE_COUNT; p++)
        for (int level = 0; level < PT_SLOTS; level++)
            frame->device->ops->buffer_destroy(frame->device, &frame->planes[p][level]);
}

// ---- rendering -----------------------------------------------------------------------------------------------------------

struct render {
    struct patina_frame *frame;
    const struct patina_scene *scene;
    struct pt_plan *plan;
    struct pt_resident **clouds; // per instance
    struct pt_resident **meshes; // per mesh
    struct pt_resident **textures; // likewise; NULL: it has none
    struct pt_resident **masks, **grades; // per instance, or NULL
    struct pt_buffer *chunks;    // per instance, of the layer at hand
    struct pt_buffer **bound;    // scratch for one pass
    struct chunk_view **behind;  // per instance: those of the layer at hand, behind the first
    struct pt_tile *tiles;       // what the last layer left
    uint32_t layer;              // at hand
};

static int upload(struct render *render)
{
    const struct pt_plan *plan = render->plan;
    struct patina_device *device = render->frame->device;
    uint32_t most = 16;
    for (uint32_t i = 0; i < plan->pass_count; i++)
        most = plan->passes[i].ref_count > most ? plan->passes[i].ref_count : most;
    render->clouds = calloc(plan->instance_count + 1, sizeof *render->clouds);
    render->meshes = calloc(plan->mesh_count + 1, sizeof *render->meshes);
    render->textures = calloc(plan->mesh_count + 1, sizeof *render->textures);
    render->masks = calloc(plan->instance_count + 1, sizeof *render->masks);
    render->grades = calloc(plan->instance_count + 1, sizeof *render->grades);
    render->chunks = calloc(plan->instance_count + 1, sizeof *render->chunks);
    render->bound = calloc(most, sizeof *render->bound);
    render->behind = calloc(plan->instance_count + 1, sizeof *render->behind);
    if (!render->clouds || !render->meshes || !render->textures || !render->masks || !render->grades || !render->chunks ||
        !render->bound || !render->behind)
        return pt_fail(&render->frame->handle, PATINA_ERROR_MEMORY, "a frame: out of memory");
    for (uint32_t i = 0; i < plan->instance_count; i++) {
        const struct pt_plan_instance *instance = &plan->instances[i];
        if (!instance->chunk_count)
            continue;
        int error = pt_residency_take(&render->frame->residency, device, instance->instance->cloud, &render->clouds[i]);
        if (!error)
            error = device->ops->buffer_create(device, instance->chunk_count * sizeof *instance->chunks,
                                               instance->chunks, 1, &render->chunks[i]);
        if (!error && pt_reopen_asked(instance->instance))
            error = pt_residency_see(device, instance->instance->cloud, render->clouds[i]);
        if (!error && instance->marked)
            error = pt_residency_mark(device, instance->instance->cloud, render->clouds[i]);
        const struct patina_mask *mask = pt_mask_of(instance->instance);
        const struct patina_grade *grade = instance->instance->style.grade;
        if (!error && mask)
            error = pt_residency_take_bytes(&render->frame->residency, device, mask->alive, mask->words,
                                            mask->word_count * sizeof *mask->words, &render->masks[i]);
        if (!error && grade)
            error = pt_residency_take_bytes(&render->frame->residency, device, grade->alive, grade->colors, grade->size,
                                            &render->grades[i]);
        if (error)
            return pt_fail_again(&render->frame->handle, error);
    }
    int error = PATINA_OK;
    for (uint32_t i = 0; i < plan->mesh_count && plan->triangles && !error; i++) {
        const struct pt_mesh_instance *instance = plan->meshes[i].instance;
        error = pt_residency_take_mesh(&render->frame->residency, device, instance->mesh, &render->meshes[i]);
        if (!error && instance->style.texture)
            error = pt_residency_take_texture(&render->frame->residency, device, instance->style.texture, &render->textures[i]);
    }
    if (!error)
        error = pt_clip_buffers_fill(device, plan, &render->frame->clips);
    return error ? pt_fail_again(&render->frame->handle, error) : PATINA_OK;
}

static struct pt_buffer *buffer_of(struct render *render, const struct pt_ref *ref)
{
    static struct pt_buffer none; // never written: kernels that bind it do not touch it
    if (ref->of == PT_OF_FRAME)
        return &render->frame->planes[ref->which][ref->index];
    if (ref->of == PT_OF_MESH && ref->which == PT_MESH_TEXELS)
        return render->textures[ref->index] ? &render->textures[ref->index]->buffers[0] : &none;
    if (ref->of == PT_OF_MESH)
        return &render->meshes[ref->index]->buffers[ref->which];
    if (ref->which == PT_MARKS || ref->which == PT_SHADOWS)
        return pt_shadows_buffer(render->frame, ref->which, ref->index);
    if (ref->which == PT_CLIPS || ref->which == PT_DRAWN)
        return pt_clip_buffer(&render->frame->clips, ref->which);
    if (ref->which == PT_COLORS && render->plan->instances[ref->index].marked)
        return &render->clouds[ref->index]->marked;
    if (ref->which == PT_COLORS && render->grades[ref->index])
        return &render->grades[ref->index]->buffers[0];
    if (ref->which == PT_MASK)
        return &render->masks[ref->index]->buffers[0];
    return ref->which == PT_CHUNKS ? &render->chunks[ref->index] : &render->clouds[ref->index]->buffers[ref->which];
}

int pt_frame_clear_keys(struct patina_frame *frame, struct pt_buffer (*planes)[PT_SLOTS], const struct pt_plan *plan,
                        enum pt_plane which)
{
    struct pt_buffer *plane = &planes[which][0];
    int error = pt_frame_ensure_plane(frame, planes, plan, which, 0);
    if (!error)
        error = frame->device->ops->buffer_fill(frame->device, plane, plane->clean[0],
                                                plane->room - plane->clean[0] - plane->clean[1],
                                                (uint64_t)PT_KEY_EMPTY_Z << 32 | PT_KEY_EMPTY_ID, 8);
    if (error)
        return error;
    plane->clean[0] = 8 * (size_t)plan->view.width * plan->view.rect[1]; // no pass writes beyond the rectangle
    plane->clean[1] = plane->room - 8 * (size_t)plan->view.width * plan->view.rect[3];
    return PATINA_OK;
}

enum { NOWHERE = 0x7FC00000 }; // the bits of a NaN

static int fill_plane(struct patina_frame *frame, enum pt_plane which, uint32_t word)
{
    struct pt_buffer *plane = &frame->planes[which][0];
    return frame->device->ops->buffer_fill(frame->device, plane, 0, plane->size, word, 4);
}

// Before a layer: `which` are its keys.
static int clear_keys(struct patina_frame *frame, const struct pt_plan *plan, enum pt_plane which)
{
    int error = pt_frame_clear_keys(frame, frame->planes, plan, which);
    if (!error && plan->triangles)
        error = pt_frame_clear_keys(frame, frame->planes, plan, PT_PLANE_MESH_KEYS);
    if (!error && plan->triangles)
        error = pt_frame_clear_keys(frame, frame->planes, plan, PT_PLANE_MESH_SHOWN);
    if (!error && plan->mesh_shadows) // pixels without a mesh lie nowhere
        error = pt_frame_ensure_plane(frame, frame->planes, plan, PT_PLANE_MESH_PLACES, 0);
    if (!error && plan->mesh_shadows)
        error = fill_plane(frame, PT_PLANE_MESH_PLACES, NOWHERE);
    return error;
}

// ---- layers --------------------------------------------------------------------------------------------------------------

// Before the first layer: all light comes through, outside the points' rectangle too, and lines find nothing before them.
static int begin_peeling(struct render *render)
{
    struct patina_frame *frame = render->frame;
    const size_t tiles = size_of(render->plan, PT_PLANE_TILES, PT_TILE_LEVEL);
    int error = pt_frame_ensure_plane(frame, frame->planes, render->plan, PT_PLANE_THROUGH, 0);
    if (!error && render->plan->line_radius > 0.0f)
        error = pt_frame_ensure_plane(frame, frame->planes, render->plan, PT_PLANE_OVER, 0);
    if (!error && render->plan->line_radius > 0.0f)
        error = fill_plane(frame, PT_PLANE_OVER, 0);
    render->tiles = malloc(tiles);
    if (!error && !render->tiles)
        error = pt_fail(&frame->handle, PATINA_ERROR_MEMORY, "a frame: out of memory");
    return error ? error : fill_plane(frame, PT_PLANE_THROUGH, 0x3F800000u);
}

// Reads what a peeled layer left.
static int end_layer(struct render *render)
{
    struct patina_frame *frame = render->frame;
    const struct pt_buffer *tiles = &frame->planes[PT_PLANE_TILES][PT_TILE_LEVEL];
    int error = frame->device->ops->buffer_read(frame->device, tiles, 0, render->tiles, tiles->size);
    if (!error)
        frame->layers[render->layer - 1].pixels = pt_layer_pixels(render->plan, render->tiles);
    return error;
}

// Chooses the chunks of the next layer. *some: 0 when there is nothing behind.
static int begin_layer(struct render *render, uint32_t layer, int *some)
{
    const struct pt_plan *plan = render->plan;
    struct patina_device *device = render->frame->device;
    struct pt_layer *out = &render->frame->layers[layer - 1];
    int error = PATINA_OK;
    *out = (struct pt_layer){ 0 };
    *some = 0;
    if (!render->frame->layers[layer - 2].pixels)
        return PATINA_OK;
    for (uint32_t i = 0; i < plan->instance_count && !error; i++) {
        uint32_t count, most = plan->instances[i].chunk_count;
        if (!most)
            continue;
        if (!render->behind[i] && !(render->behind[i] = malloc(most * sizeof **render->behind)))
            return pt_fail(&render->frame->handle, PATINA_ERROR_MEMORY, "a frame: out of memory");
        count = pt_layer_chunks(plan, i, render->tiles, render->behind[i], &out->points);
        device->ops->buffer_destroy(device, &render->chunks[i]);
        error = device->ops->buffer_create(device, count * sizeof **render->behind, render->behind[i], 1, &render->chunks[i]);
    }
    *some = out->points > 0 || plan->triangles;
    return error || !*some ? error : clear_keys(render->frame, plan, PT_PLANE_KEYS_BEHIND);
}

// Turns to the pass's layer. *run: 0 when that layer does not exist.
static int turn_to_layer(struct render *render, const struct pt_pass *pass, uint32_t *ended, int *run)
{
    *run = !*ended || pass->layer < *ended;
    if (!*run || pass->layer <= render->layer)
        return PATINA_OK;
    int error = PATINA_OK;
    if (pass->layer > 1)
        error = begin_layer(render, pass->layer, run);
    if (!error && !*run) {
        *ended = pass->layer;
        return PATINA_OK;
    }
    render->layer = render->frame->layer_count = pass->layer;
    return error;
}

// ---- passes --------------------------------------------------------------------------------------------------------------

void pt_frame_note_time(struct patina_frame *frame, const char *name, double ms)
{
    uint32_t i = 0;
    while (i < frame->timing_count && strcmp(frame->timings[i].name, name) != 0)
        i++;
    if (i == PT_TIMINGS)
        return;
    if (i == frame->timing_count)
        frame->timings[frame->timing_count++] = (struct pt_timing){ .name = name };
    frame->timings[i].ms += ms;
}

static int is_output(const struct pt_pass *pass) { return !pass->layer; }

static int run_pass(struct render *render, const struct pt_pass *pass)
{
    struct patina_frame *frame = render->frame;
    for (uint32_t i = 0; i < pass->ref_count; i++) {
        const struct pt_ref *ref = &pass->refs[i];
        if (ref->of == PT_OF_FRAME) {
            int error = pt_frame_ensure_plane(frame, frame->planes, render->plan, ref->which, ref->index);
            if (error)
                return error;
        }
        render->bound[i] = buffer_of(render, ref);
    }
    // the picture is written last and at one go: a cancelled frame leaves the one before it
    int error = frame->device->ops->run(frame->device, pass->kernel, pass->arguments, pass->argument_size, render->bound,
                                        pass->ref_count, is_output(pass) ? NULL : &frame->cancel);
    if (!error)
        error = frame->device->ops->finish(frame->device);
    return error;
}

// Planes that pass from layer to layer.
static int peeled(enum pt_plane plane) { return plane >= PT_PLANE_LIMIT && plane <= PT_PLANE_TILES; }

// How many passes from here on the device runs as one; 0: none.
static uint32_t together(const struct patina_device *device, const struct pt_pass *passes)
{
    struct pt_bound_pass some[64]; // not bound yet
    if (!device->ops->finish_picture || (device->ops->finishes && passes->together > sizeof some / sizeof *some))
        return 0;
    if (!device->ops->finishes)
        return passes->together;
    for (uint32_t i = 0; i < passes->together; i++)
        some[i] = (struct pt_bound_pass){ .kernel = passes[i].kernel, .arguments = passes[i].arguments };
    return device->ops->finishes(some, passes->together);
}

// Passes as one: the planes between them are neither made nor written.
static int run_together(struct render *render, const struct pt_pass *passes, uint32_t count)
{
    uint32_t refs = 0;
    for (uint32_t i = 0; i < count; i++)
        refs += passes[i].ref_count;
    struct pt_bound_pass *bound = calloc(count, sizeof *bound);
    struct pt_buffer **buffers = calloc(refs, sizeof *buffers), **next = buffers;
    int error = bound && buffers ? PATINA_OK : pt_fail(&render->frame->handle, PATINA_ERROR_MEMORY, "a frame: out of memory");
    for (uint32_t i = 0; i < count && !error; i++) {
        bound[i] = (struct pt_bound_pass){ passes[i].kernel, passes[i].arguments, next, passes[i].ref_count };
        for (uint32_t k = 0; k < passes[i].ref_count && !error; k++) {
            const struct pt_ref *ref = &passes[i].refs[k];
            if (ref->of == PT_OF_FRAME && peeled(ref->which))
                error = pt_frame_ensure_plane(render->frame, render->frame->planes, render->plan, ref->which, ref->index);
            *next++ = buffer_of(render, ref);
        }
    }
    if (!error)
        error = render->frame->device->ops->finish_picture(render->frame->device, bound, count);
    if (!error) // as after any pass: its time is that of its work
        error = render->frame->device->ops->finish(render->frame->device);
    free(bound);
    free(buffers);
    return error;
}

static int run_plan(struct render *render)
{
    struct patina_frame *frame = render->frame;
    const struct pt_plan *plan = render->plan;
    double before = pt_milliseconds();
    frame->keys_valid = 0;
    frame->layer_count = 0;
    frame->layers[0] = (struct pt_layer){ .points = plan->points_scattered };
    int error = clear_keys(frame, plan, PT_PLANE_KEYS);
    if (!error && plan->layers > 1)
        error = begin_peeling(render);
    uint32_t ended = 0; // from this layer on there are none
    int writing = 0;    // the picture: from then on nothing stops it
    uint32_t shadows = 0; // layer whose shadows are known
    int marking = pt_shadows_stale(frame, render->scene, plan);
    for (uint32_t i = 0; i < plan->pass_count && !error; i++) {
        int run;
        if ((error = turn_to_layer(render, &plan->passes[i], &ended, &run)))
            return error;
        if (!run)
            continue;
        if (plan->passes[i].kernel == PT_KERNEL_mark && !marking)
            continue; // every texture is at hand
        if (plan->passes[i].kernel == PT_KERNEL_shade && shadows < plan->passes[i].layer) {
            error = shadows ? pt_shadows_behind(frame, render->scene, render->plan)
                            : pt_shadows_update(frame, render->scene, render->plan);
            if (error)
                return error;
            shadows = plan->passes[i].layer;
            before = pt_milliseconds();
        }
        if (!writing && atomic_load(&frame->cancel))
            return PATINA_ERROR_CANCELLED;
        const struct pt_pass *pass = &plan->passes[i], *last = pass;
        const uint32_t count = together(frame->device, pass);
        if (count)
            last += count - 1;
        if (!writing && is_output(last)) {
            if ((error = ensure_picture(frame, plan)))
                return error;
            writing = 1;
        }
        if ((error = last > pass ? run_together(render, pass, count) : run_pass(render, pass))) {
            frame->shown.picture_valid &= !writing; // half a picture is none: the device failed
            return error;
        }
        if (last->kernel == PT_KERNEL_peel)
            error = end_layer(render);
        double now = pt_milliseconds();
        pt_frame_note_time(frame, last > pass ? "finish" : pass->name, now - before);
        before = now;
        i = (uint32_t)(last - plan->passes);
        atomic_store(&frame->progress,
                     frame->progress_done + frame->progress_share * (float)(i + 1) / (float)plan->pass_count);
    }
    return error;
}

static void keep_statistics(struct patina_frame *frame, const struct patina_scene *scene, const struct pt_plan *plan,
                            double ms)
{
    struct pt_shown *shown = &frame->shown;
    shown->stats = (patina_frame_stats){ .struct_size = sizeof shown->stats,
                                         .width = plan->crop[2],
                                         .height = plan->crop[3],
                                         .points = plan->points,
                                         .points_scattered = plan->points_scattered,
                                         .triangles = plan->triangles,
                                         .chunks = plan->chunks,
                                         .chunks_culled = plan->chunks_culled,
                                         .chunks_clipped = plan->chunks_clipped,
                                         .chunks_cut = plan->chunks_cut,
                                         .pixel_samples = 1,
                                         .ms = ms };
    shown->stats.plane_bytes = plane_total(frame);
    shown->stats.spacing_px = (float)plan->spacing_px;
    shown->stats.expected = plan->expected;
    shown->stats.layers = frame->layer_count && plan->layers == 1;
    for (uint32_t i = 0; i < frame->layer_count; i++)
        shown->stats.layers += frame->layers[i].pixels > 0;
    shown->layer_most = plan->layers;
    shown->layer_passes = scene->settings.layer_passes;
    shown->stats.shadow_maps = frame->shadow_maps;
    shown->stats.shadow_width = frame->shadow_size[0];
    shown->stats.shadow_height = frame->shadow_size[1];
    for (uint32_t i = 0; i < frame->shadows.instance_count; i++)
        shown->stats.shadow_bytes += frame->shadows.words[i].size;
    frame->light_count = plan->light_count;
    for (uint32_t i = 0; i < plan->light_count; i++) {
        const struct pt_shadow_light *light = &frame->shadows.lights[i];
        const int refined = plan->mesh_shadows && frame->shadows.pixels.pending; // at once with the points
        shown->stats.shadow_pending += (light->samples < plan->lights[i].samples && !light->settled) || refined;
        const uint32_t of_pixels = plan->mesh_shadows ? frame->shadows.pixels.samples[i] : 0;
        const uint32_t samples = light->samples > of_pixels ? light->samples : of_pixels;
        shown->stats.shadow_samples = samples > shown->stats.shadow_samples ? samples : shown->stats.shadow_samples;
        shown->stats.shadow_error = fmaxf(shown->stats.shadow_error, light->error);
    }
    memcpy(frame->skipped, plan->skipped, sizeof frame->skipped);
    frame->skipped_count = plan->skipped_count;
    shown->passes = scene->settings.passes | 1u << PATINA_PASS_COMBINED;
    shown->all_lit = !plan->light_count;
    shown->has_lines = plan->line_radius > 0.0f;
    shown->assessed = plan->assessed;
    memcpy(shown->crop, plan->crop, sizeof shown->crop);
    shown->plane_width = plan->view.width;
    frame->keys_valid = 1;
    shown->picture_valid = 1;
}

int pt_frame_draw(struct patina_frame *frame, const struct patina_scene *scene)
{
    struct pt_plan plan;
    struct render render = { .frame = frame, .scene = scene, .plan = &plan };
    double start = pt_milliseconds();
    int error = pt_plan_create(scene, &plan);
    if (!error && (error = pt_frame_number(frame, scene)))
        pt_plan_destroy(&plan);
    if (error)
        return pt_fail_again(&frame->handle, error);
    pt_frame_note_time(frame, "plan", pt_milliseconds() - start);
    error = upload(&render);
    if (!error)
        error = pt_shadows_open(frame, scene, &plan);
    if (!error)
        error = run_plan(&render);
    if (!error)
        keep_statistics(frame, scene, &plan, pt_milliseconds() - start);
    for (uint32_t i = 0; i < plan.instance_count && render.chunks; i++)
        frame->device->ops->buffer_destroy(frame->device, &render.chunks[i]);
    free(render.clouds);
    free(render.meshes);
    free(render.textures);
    free(render.masks);
    free(render.grades);
    free(render.chunks);
    free(render.bound);
    for (uint32_t i = 0; i < plan.instance_count && render.behind; i++)
        free(render.behind[i]);
    free(render.behind);
    free(render.tiles);
    pt_plan_destroy(&plan);
    if (error == PATINA_ERROR_CANCELLED)
        return pt_fail(&frame->handle, error, "rendering was cancelled");
    return error ? pt_fail_again(&frame->handle, error) : PATINA_OK;
}

int pt_frame_render(struct patina_frame *frame, const struct patina_scene *scene)
{
    double start = pt_milliseconds();
    atomic_store(&frame->progress, 0.0f);
    frame->progress_done = 0.0f;
    frame->progress_share = 1.0f;
    frame->timing_count = 0;
    frame->shadow_maps = frame->shadow_size[0] = frame->shadow_size[1] = 0;
    frame->sampling[0] = frame->sampling[1] = 1;
    pt_mean_destroy(frame);
    int error = scene->settings.pixel_samples > 1 ? pt_frame_sample(frame, scene) : pt_frame_draw(frame, scene);
    if (!error)
        frame->shown.stats.ms = pt_milliseconds() - start;
    atomic_store(&frame->cancel, 0);
    return error;
}

// ---- reading -------------------------------------------------------------------------------------------------------------

static const struct {
    enum pt_plane plane;
    uint32_t channels;
    const char *name;
} pass_table[PATINA_PASS_COUNT] = {
    [PATINA_PASS_COMBINED] = { PT_PLANE_COMBINED, 4, "COMBINED" },
    [PATINA_PASS_DEPTH] = { PT_PLANE_DEPTH, 1, "DEPTH" },
    [PATINA_PASS_NORMAL] = { PT_PLANE_NORMALS, 3, "NORMAL" },
    [PATINA_PASS_SOURCE] = { PT_PLANE_SOURCE, 1, "SOURCE" },
    [PATINA_PASS_SHADOW] = { PT_PLANE_SHADOW, 1, "SHADOW" },
    [PATINA_PASS_LINE] = { PT_PLANE_LINES, 1, "LINE" },
    [PATINA_PASS_CERTAINTY] = { PT_PLANE_CERTAINTY, 1, "CERTAINTY" },
    [PATINA_PASS_THICKNESS] = { PT_PLANE_THICKNESS, 1, "THICKNESS" },
};

int pt_frame_read(const struct patina_frame *frame, uint32_t pass, float *pixels, size_t size)
{
    if (pass >= PATINA_PASS_COUNT)
        return pt_fail(&frame->handle, PATINA_ERROR_ARGUMENT, "patina_frame_read: no pass %u", pass);
    if (!frame->shown.picture_valid || !(frame->shown.passes >> pass & 1u))
        return pt_fail(&frame->handle, PATINA_ERROR_EMPTY, "patina_frame_read: no %s pass was rendered",
                       pass_table[pass].name);
    size_t expected = (size_t)frame->shown.stats.width * frame->shown.stats.height * pass_table[pass].channels * sizeof *pixels;
    if (size != expected)
        return pt_fail(&frame->handle, PATINA_ERROR_ARGUMENT, "patina_frame_read: %s is %u x %u x %u floats, %zu bytes; got %zu",
                       pass_table[pass].name, frame->shown.stats.width, frame->shown.stats.height, pass_table[pass].channels, expected,
                       size);
    const uint32_t known = 1u << PATINA_PASS_CERTAINTY | 1u << PATINA_PASS_THICKNESS;
    if ((pass == PATINA_PASS_SHADOW && frame->shown.all_lit) || (pass == PATINA_PASS_LINE && !frame->shown.has_lines) ||
        (known & ~frame->shown.assessed) >> pass & 1u) { // no plane
        for (size_t i = 0; i < size / sizeof *pixels; i++)
            pixels[i] = pass == PATINA_PASS_SHADOW ? 1.0f : 0.0f;
        return PATINA_OK;
    }
    int error = frame->device->ops->buffer_read(frame->device, &frame->planes[pass_table[pass].plane][0], 0, pixels, size);
    return error ? pt_fail_again(&frame->handle, error) : PATINA_OK;
}

int pt_frame_read_layer(const struct patina_frame *frame, uint32_t layer, uint32_t pass, float *pixels, size_t size)
{
    static const enum pt_plane planes[] = { [PATINA_PASS_COMBINED] = PT_PLANE_LAYER_COMBINED,
                                            [PATINA_PASS_DEPTH] = PT_PLANE_LAYER_DEPTH,
                                            [PATINA_PASS_NORMAL] = PT_PLANE_LAYER_NORMALS };
    if (pass > PATINA_PASS_NORMAL || !layer || layer > PATINA_MAX_LAYERS)
        return pt_fail(&frame->handle, PATINA_ERROR_ARGUMENT, "patina_frame_read_layer: no pass %u of a layer %u", pass, layer);
    if (!frame->keys_valid || !(frame->shown.layer_passes >> pass & 1u) || layer > frame->shown.layer_most)
        return pt_fail(&frame->handle, PATINA_ERROR_EMPTY, "patina_frame_read_layer: no %s pass of layer %u was asked for",
                       pass_table[pass].name, layer);
    size_t count = (size_t)frame->shown.stats.width * frame->shown.stats.height * pass_table[pass].channels;
    if (size != count * sizeof *pixels)
        return pt_fail(&frame->handle, PATINA_ERROR_ARGUMENT, "patina_frame_read_layer: %s is %u x %u x %u floats; got %zu bytes",
                       pass_table[pass].name, frame->shown.stats.width, frame->shown.stats.height, pass_table[pass].channels, size);
    if (layer > frame->layer_count) { // peeling ended before
        for (size_t i = 0; i < count; i++)
            pixels[i] = pass == PATINA_PASS_DEPTH ? INFINITY : 0.0f;
        return PATINA_OK;
    }
    int error = frame->device->ops->buffer_read(frame->device, &frame->planes[planes[pass]][layer - 1], 0, pixels, size);
    return error ? pt_fail_again(&frame->handle, error) : PATINA_OK;
}

// Keys as they lie in the plane, where points have numbers of slots.
static int read_slots(const struct patina_frame *frame, uint64_t *keys, size_t size)
{
    if (!frame->keys_valid)
        return pt_fail(&frame->handle, PATINA_ERROR_EMPTY, "patina_frame_read_keys: no finished render");
    if (size != (size_t)frame->shown.crop[2] * frame->shown.crop[3] * sizeof *keys)
        return pt_fail(&frame->handle, PATINA_ERROR_ARGUMENT, "patina_frame_read_keys: %u x %u keys; got %zu bytes",
                       frame->shown.crop[2], frame->shown.crop[3], size);
    size_t row = (size_t)frame->shown.crop[2] * sizeof *keys;
    for (uint32_t y = 0; y < frame->shown.crop[3]; y++) {
        size_t offset = ((size_t)(frame->shown.crop[1] + y) * frame->shown.plane_width + frame->shown.crop[0]) * sizeof *keys;
        int error = frame->device->ops->buffer_read(frame->device, &frame->planes[PT_PLANE_KEYS][0], offset,
                                                    (char *)keys + y * row, row);
        if (error)
            return pt_fail_again(&frame->handle, error);
    }
    return PATINA_OK;
}

int pt_frame_read_keys(const struct patina_frame *frame, uint64_t *keys, size_t size)
{
    int error = read_slots(frame, keys, size);
    if (error)
        return error;
    return pt_numbering_keys(&frame->numbering, keys, size / sizeof *keys)
               ? pt_fail(&frame->handle, PATINA_ERROR_EMPTY, "patina_frame_read_keys: a cloud in view was destroyed since")
               : PATINA_OK;
}

int pt_frame_read_slots(const struct patina_frame *frame, const struct patina_scene *scene, uint64_t *keys, size_t size)
{
    int same = frame->numbering.count == scene->instance_count;
    for (uint32_t i = 0; same && i < scene->instance_count; i++)
        same = frame->numbering.clouds[i].alive == scene->instances[i].cloud->alive;
    if (!same)
        return pt_fail(&frame->handle, PATINA_ERROR_ARGUMENT, "the frame's last picture is of another scene");
    int error = read_slots(frame, keys, size);
    for (size_t i = 0; i < size / sizeof *keys && !error && frame->numbering.discs < UINT32_MAX; i++)
        if (keys[i] >> 32 != PT_KEY_EMPTY_Z && (uint32_t)keys[i] >= frame->numbering.discs)
            keys[i] -= frame->numbering.discs;
    return error;
}

int pt_frame_number(struct patina_frame *frame, const struct patina_scene *scene)
{
    return pt_numbering_take(&frame->numbering, scene)
               ? pt_fail(NULL, PATINA_ERROR_MEMORY, "numbering %u instances: out of memory", scene->instance_count)
               : PATINA_OK;
}

size_t pt_frame_stats_json(const struct patina_frame *frame, char *buffer, size_t size)
{
    size_t length = 0;
#define PUT(...)                                                                                                  \
    length += (size_t)snprintf(buffer && length < size ? buffer + length : NULL, buffer && length < size ? size - length : 0, \
                               __VA_ARGS__)
    PUT("{\"passes\":{");
    for (uint32_t i = 0; i < frame->timing_count; i++) { // whole numbers: a locale may write 0,5 for 0.5
        unsigned long long parts = (unsigned long long)(frame->timings[i].ms * 1e4 + 0.5);
        PUT("%s\"%s\":%llu.%04llu", i ? "," : "", frame->timings[i].name, parts / 10000, parts % 10000);
    }
    PUT("},\"skipped\":{");
    for (uint32_t i = 0; i < frame->skipped_count; i++) // reasons are our own words: no quotes, no backslashes
        PUT("%s\"%s\":\"%s\"", i ? "," : "", frame->skipped[i].name, frame->skipped[i].reason);
    PUT("},\"layers\":[");
    for (uint32_t i = 0; i < frame->layer_count; i++)
        PUT("%s{\"points\":%llu,\"pixels\":%llu}", i ? "," : "", (unsigned long long)frame->layers[i].points,
            (unsigned long long)frame->layers[i].pixels);
    PUT("],\"lights\":[");
    for (uint32_t i = 0; i < frame->light_count; i++) {
        const struct pt_shadow_light *light = &frame->shadows.lights[i];
        unsigned long long parts = (unsigned long long)((double)light->error * 1e6 + 0.5);
        PUT("%s{\"samples\":%u,\"error\":%llu.%06llu}", i ? "," : "", light->samples, parts / 1000000, parts % 1000000);
    }
    PUT("],\"samples\":{\"grid\":%u,\"shifts\":%u}}", frame->sampling[0], frame->sampling[1]);
#undef PUT
    return length;
}

int pt_frame_dump(const struct patina_frame *frame, const char *folder)
{
    const int sampled = frame->sampling[0] * frame->sampling[1] > 1; // what lies between is of the last finer picture
    for (int p = 0; p < PT_PLANE_COUNT; p++)
        for (int level = 0; level < PT_SLOTS; level++) {
            const struct pt_buffer *plane = &frame->planes[p][level];
            char path[4096];
            if (!plane->size || (sampled && p != PT_PLANE_KEYS && p < PT_PLANE_COMBINED))
                continue;
            void *copy = malloc(plane->size);
            if (!copy)
                return pt_fail(&frame->handle, PATINA_ERROR_MEMORY, "dumping planes: out of memory");
            int error = frame->device->ops->buffer_read(frame->device, plane, 0, copy, plane->size);
            snprintf(path, sizeof path, "%s/%s_%d.raw", folder, plane_names[p], level);
            FILE *file = error ? NULL : fopen(path, "wb");
            size_t written = file ? fwrite(copy, 1, plane->size, file) : 0;
            free(copy);
            if (error || !file || fclose(file) || written != plane->size)
                return pt_fail(&frame->handle, PATINA_ERROR_FILE, "%s: cannot be written", path);
            uint32_t width = p >= PT_PLANE_COMBINED ? frame->shown.crop[2] : (frame->shown.plane_width + (1u << level) - 1) >> level;
            snprintf(path, sizeof path, "%s/%s_%d.txt", folder, plane_names[p], level);
            file = fopen(path, "w");
            if (!file || fprintf(file, "%s level %d: %u pixels wide, %zu rows, %u bytes a pixel, row 0 at the bottom\n",
                                 plane_names[p], level, width, width ? plane->size / plane_bytes[p] / width : 0,
                                 plane_bytes[p]) < 0 || fclose(file))
                return pt_fail(&frame->handle, PATINA_ERROR_FILE, "%s: cannot be written", path);
        }
    return PATINA_OK;
}

void pt_frame_release(struct patina_frame *frame)
{
    pt_mean_destroy(frame);
    destroy_planes(frame);
    pt_shadows_release(frame);
    pt_clip_buffers_release(frame->device, &frame->clips);
    pt_residency_release(&frame->residency, frame->device);
    pt_numbering_release(&frame->numbering);
}
