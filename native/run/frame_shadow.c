// SPDX-License-Identifier: GPL-3.0-or-later
// Computes shadow textures: for each sample of a light its maps are drawn, as any picture up to filling, and every point is
// tested against them [D 6].
#include "frame.h"

#include "residency.h"
#include "scene/mask.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FAINT_LAYERS = 8 }; // of a caster whose points have opacities of their own, at most
enum { FIRST_COMPARED = 4 }; // samples after which a light may stop, because all agree or enough is known; then at every doubling

// ---- what is at hand ---------------------------------------------------------------------------------------------------

static void forget_lights(struct pt_shadows *shadows)
{
    for (uint32_t i = 0; i < shadows->light_count; i++)
        free(shadows->lights[i].key);
    memset(shadows->lights, 0, sizeof shadows->lights);
    shadows->light_count = 0;
}

static void forget_instances(struct patina_frame *frame)
{
    struct pt_shadows *shadows = &frame->shadows;
    for (uint32_t i = 0; i < shadows->instance_count; i++) {
        frame->device->ops->buffer_destroy(frame->device, &shadows->words[i]);
        frame->device->ops->buffer_destroy(frame->device, &shadows->marks[i]);
    }
    free(shadows->words);
    free(shadows->marks);
    free(shadows->fingerprints);
    shadows->words = shadows->marks = NULL;
    shadows->fingerprints = NULL;
    shadows->instance_count = 0;
}

void pt_shadows_release(struct patina_frame *frame)
{
    struct pt_shadows *shadows = &frame->shadows;
    forget_lights(shadows);
    forget_instances(frame);
    for (int p = 0; p < PT_PLANE_COUNT; p++)
        for (int level = 0; level < PT_SLOTS; level++)
            frame->device->ops->buffer_destroy(frame->device, &shadows->planes[p][level]);
    frame->device->ops->buffer_destroy(frame->device, &shadows->differs);
    frame->device->ops->buffer_destroy(frame->device, &shadows->some);
    pt_clip_buffers_release(frame->device, &shadows->clips);
    pt_pixels_release(frame);
}

struct pt_buffer *pt_shadows_buffer(struct patina_frame *frame, uint32_t which, uint32_t instance)
{
    static struct pt_buffer none; // never written: kernels that bind it do not touch it
    struct pt_shadows *shadows = &frame->shadows;
    if (instance == PT_PIXELS && which == PT_SHADOWS)
        return &shadows->pixels.words;
    if (instance >= shadows->instance_count)
        return &none;
    return which == PT_MARKS ? &shadows->marks[instance] : &shadows->words[instance];
}

uint64_t pt_shadows_identity(const struct pt_instance *instance)
{
    return pt_receives(instance) ? pt_cloud_fingerprint(instance->cloud) : 0;
}

// The words are for these instances and so many lights.
static int same_places(const struct pt_shadows *shadows, const struct patina_scene *scene, const struct pt_plan *plan)
{
    int same = shadows->light_count == plan->light_count && shadows->instance_count == scene->instance_count;
    for (uint32_t i = 0; same && i < scene->instance_count; i++)
        same = shadows->fingerprints[i] == pt_shadows_identity(&scene->instances[i]);
    return same;
}

int pt_shadows_make_places(struct patina_frame *frame, const struct patina_scene *scene, uint32_t light_count)
{
    struct pt_shadows *shadows = &frame->shadows;
    const struct pt_device_ops *ops = frame->device->ops;
    forget_lights(shadows);
    forget_instances(frame);
    shadows->words = calloc((size_t)scene->instance_count + 1, sizeof *shadows->words);
    shadows->marks = calloc((size_t)scene->instance_count + 1, sizeof *shadows->marks);
    shadows->fingerprints = calloc((size_t)scene->instance_count + 1, sizeof *shadows->fingerprints);
    if (!shadows->words || !shadows->marks || !shadows->fingerprints) {
        forget_instances(frame);
        return pt_fail(&frame->handle, PATINA_ERROR_MEMORY, "shadow textures: out of memory");
    }
    shadows->instance_count = scene->instance_count;
    shadows->light_count = light_count;
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        uint64_t points = scene->instances[i].cloud->slots;
        shadows->fingerprints[i] = pt_shadows_identity(&scene->instances[i]);
        if (!shadows->fingerprints[i])
            continue;
        int error = light_count * points > UINT32_MAX
                        ? pt_fail(&frame->device->handle, PATINA_ERROR_TOO_MANY_POINTS,
                                  "shadows of %u lights on %llu points: their product must stay below 4294967296",
                                  light_count, (unsigned long long)points)
                        : ops->buffer_create(frame->device, light_count * points * 4, NULL, 0, &shadows->words[i]);
        if (error) {
            forget_lights(shadows);
            forget_instances(frame);
            return pt_fail_again(&frame->handle, error);
        }
    }
    return PATINA_OK;
}

// Samples that the light has after this render.
static uint32_t samples_wanted(const struct patina_scene *scene, const struct pt_plan *plan, uint32_t i,
                               const struct pt_shadow_light *light)
{
    const struct pt_plan_light *planned = &plan->lights[i];
    if (light->settled)
        return light->samples;
    if (!scene->settings.shadow_progressive || pt_plan_lazy(scene, plan))
        return planned->samples;
    uint32_t next = light->samples ? 2 * light->samples : 1;
    return next < planned->samples ? next : planned->samples;
}

int pt_shadows_stale(const struct patina_frame *frame, const struct patina_scene *scene, const struct pt_plan *plan)
{
    for (uint32_t i = 0; i < plan->light_count; i++)
        if (frame->shadows.lights[i].samples != samples_wanted(scene, plan, i, &frame->shadows.lights[i]))
            return 1;
    return 0;
}

int pt_shadows_open(struct patina_frame *frame, const struct patina_scene *scene, const struct pt_plan *plan)
{
    struct pt_shadows *shadows = &frame->shadows;
    int error = PATINA_OK, changed = 0;
    if (!plan->light_count)
        return PATINA_OK;
    if (!same_places(shadows, scene, plan)) {
        error = pt_shadows_make_places(frame, scene, plan->light_count);
        changed = 1;
    }
    for (uint32_t i = 0; i < plan->light_count && !error; i++) {
        struct pt_shadow_light *light = &shadows->lights[i];
        size_t count = pt_light_key(scene, &plan->lights[i], NULL, 0);
        double *key = malloc(count * sizeof *key);
        if (!key)
            return pt_fail(&frame->handle, PATINA_ERROR_MEMORY, "shadow textures: out of memory");
        pt_light_key(scene, &plan->lights[i], key, count);
        int known = light->key && light->key_count == count && pt_same_key(light->key, key, count);
        changed |= !known;
        if (!known || light->partial || (light->samples > plan->lights[i].samples && !light->settled))
            light->samples = light->settled = 0;
        free(light->key);
        light->key = key;
        light->key_count = count;
    }
    if (!error)
        error = pt_pixels_open(frame, scene, plan, changed);
    if (error || !pt_plan_lazy(scene, plan) || !pt_shadows_stale(frame, scene, plan))
        return error;
    for (uint32_t i = 0; i < shadows->instance_count && !error; i++) {
        const struct pt_device_ops *ops = frame->device->ops;
        if (shadows->fingerprints[i] && !shadows->marks[i].size)
            error = ops->buffer_create(frame->device, (scene->instances[i].cloud->slots + 3) / 4 * 4, NULL, 0,
                                       &shadows->marks[i]);
        if (!error && shadows->marks[i].size)
            error = ops->buffer_fill(frame->device, &shadows->marks[i], 0, shadows->marks[i].size, 0, 4);
    }
    return error ? pt_fail_again(&frame->handle, error) : PATINA_OK;
}

// ---- computing ---------------------------------------------------------------------------------------------------------

struct update {
    struct patina_frame *frame;
    const struct patina_scene *scene;
    struct pt_plan *plan;
    struct pt_shadow_group *groups;
    uint32_t group_count;
    struct pt_instance *instances; // scratch: casters
    struct pt_mesh_instance *meshes; // likewise
    const struct pt_buffer *opacities; // of the group's caster
    const struct pt_instance *pixels;  // that show meshes; NULL: none do
    int points_too; // points are tested, not these pixels alone
    int pixels_too;
};

// Whether an instance, or PT_PIXELS, is tested against the group's maps.
static int receives(const struct update *update, const struct pt_shadow_group *group, uint32_t instance)
{
    if (instance == PT_PIXELS)
        return update->pixels_too && group->without == PT_NO_INSTANCE;
    return update->points_too && pt_group_receives(update->scene, group, instance);
}

// How many maps of a sample the instance is tested against.
static uint32_t maps_of(const struct update *update, const struct pt_plan_light *planned, uint32_t instance)
{
    uint32_t count = 0;
    for (uint32_t g = 0; g < update->group_count; g++)
        if (receives(update, &update->groups[g], instance))
            count += update->groups[g].faint ? FAINT_LAYERS : 1;
    return planned->cube ? 6 * count : count;
}

// Where a pass of a map finds its buffer.
static int map_buffer(struct update *update, const struct pt_plan *map, struct pt_buffer *chunks, const struct pt_ref *ref,
                      struct pt_buffer **out)
{
    struct patina_frame *frame = update->frame;
    struct pt_resident *resident = NULL;
    int error = PATINA_OK;
    if (ref->of == PT_OF_FRAME) {
        *out = &frame->shadows.planes[ref->which][ref->index];
        return pt_frame_ensure_plane(frame, frame->shadows.planes, map, ref->which, ref->index);
    }
    if (ref->of == PT_OF_INSTANCE && ref->which == PT_CHUNKS)
        *out = &chunks[ref->index];
    else if (ref->of == PT_OF_INSTANCE && (ref->which == PT_CLIPS || ref->which == PT_DRAWN))
        *out = pt_clip_buffer(&frame->shadows.clips, ref->which);
    else if (ref->of == PT_OF_INSTANCE && ref->which == PT_MASK) {
        const struct patina_mask *mask = pt_mask_of(map->instances[ref->index].instance);
        error = pt_residency_take_bytes(&frame->residency, frame->device, mask->alive, mask->words,
                                        mask->word_count * sizeof *mask->words, &resident);
    } else if (ref->of == PT_OF_MESH)
        error = pt_residency_mesh_buffer(&frame->residency, frame->device, map->meshes[ref->index].instance, ref->which, out);
    else
        error = pt_residency_take(&frame->residency, frame->device, map->instances[ref->index].instance->cloud, &resident);
    if (!error && resident)
        *out = &resident->buffers[ref->of == PT_OF_INSTANCE && ref->which == PT_MASK ? 0 : ref->which];
    return error;
}

static int run_map_pass(struct update *update, const struct pt_plan *map, struct pt_buffer *chunks, struct pt_buffer **bound,
                        const struct pt_pass *pass)
{
    struct patina_frame *frame = update->frame;
    for (uint32_t i = 0; i < pass->ref_count; i++) {
        int error = map_buffer(update, map, chunks, &pass->refs[i], &bound[i]);
        if (error)
            return error;
    }
    return frame->device->ops->run(frame->device, pass->kernel, pass->arguments, pass->argument_size, bound,
                                   pass->ref_count, &frame->cancel);
}

// Draws a map into the planes of the shadows.
static int draw_map(struct update *update, const struct pt_plan *map)
{
    struct patina_frame *frame = update->frame;
    struct patina_device *device = frame->device;
    uint32_t most = 16;
    for (uint32_t i = 0; i < map->pass_count; i++)
        most = map->passes[i].ref_count > most ? map->passes[i].ref_count : most;
    struct pt_buffer *chunks = calloc(map->instance_count + 1, sizeof *chunks), **bound = calloc(most, sizeof *bound);
    int error = chunks && bound ? PATINA_OK
                                : pt_fail(&frame->handle, PATINA_ERROR_MEMORY, "a light's map: out of memory");
    for (uint32_t i = 0; i < map->instance_count && !error; i++)
        if (map->instances[i].chunk_count)
            error = device->ops->buffer_create(device, map->instances[i].chunk_count * sizeof *map->instances[i].chunks,
                                               map->instances[i].chunks, 1, &chunks[i]);
    if (!error)
        error = pt_clip_buffers_fill(device, map, &frame->shadows.clips);
    if (!error)
        error = pt_frame_clear_keys(frame, frame->shadows.planes, map, PT_PLANE_KEYS);
    if (!error && map->triangles)
        error = pt_frame_clear_keys(frame, frame->shadows.planes, map, PT_PLANE_MESH_KEYS);
    for (uint32_t i = 0; i < map->pass_count && !error; i++)
        error = run_map_pass(update, map, chunks, bound, &map->passes[i]);
    if (!error)
        error = device->ops->finish(device);
    for (uint32_t i = 0; i < map->instance_count && chunks; i++)
        device->ops->buffer_destroy(device, &chunks[i]);
    free(chunks);
    free(bound);
    return error;
}

static void set_window(const struct pt_plan *map, const double window[4], float out[4])
{
    for (int k = 0; k < 4; k++) { // window units -> pixels of the padded picture
        double first = k & 1 ? (double)map->view.ray_y0 : (double)map->view.ray_x0;
        double step = k & 1 ? (double)map->view.ray_ys : (double)map->view.ray_xs;
        out[k] = (float)((window[k] - first) / step);
    }
}

// Of all chunks of instance i those that the picture drew, as points or as discs: points of the others have no mark. Returns
// how many.
static uint32_t keep_seen(const struct pt_plan *plan, uint32_t i, struct chunk_view *chunks, uint32_t count)
{
    const struct pt_plan_instance *seen[2] = { NULL, NULL };
    uint32_t ways = 0, kept = 0, next[2] = { 0, 0 };
    for (uint32_t k = 0; k < plan->instance_count && ways < 2; k++)
        if (plan->instances[k].of == i)
            seen[ways++] = &plan->instances[k];
    for (uint32_t c = 0; c < count; c++) // all in the cloud's order, and a chunk is drawn in one way
        for (uint32_t k = 0; k < ways; k++)
            if (next[k] < seen[k]->chunk_count && chunks[c].first == seen[k]->chunks[next[k]].first) {
                chunks[kept++] = chunks[c];
                next[k]++;
                break;
            }
    return kept;
}

// Tests the points of one instance against the map in the planes.
static int test_instance(struct update *update, const struct patina_scene *view, struct pt_plan *map, uint32_t i,
                         struct lit_args *args)
{
    struct patina_frame *frame = update->frame;
    struct patina_device *device = frame->device;
    const struct pt_instance *instance = &update->scene->instances[i];
    struct pt_buffer(*planes)[PT_SLOTS] = frame->shadows.planes;
    struct pt_buffer chunk_buffer = { 0 };
    struct chunk_view *chunks;
    struct pt_resident *resident;
    uint32_t light = args->base, count = instance->cloud->chunk_count;
    int error = pt_plan_chunks(view, map, instance, &args->instance, &chunks);
    if (!error && args->marked)
        count = keep_seen(update->plan, i, chunks, count);
    if (!error && !count)
        return PATINA_OK;
    if (!error)
        error = pt_residency_take(&frame->residency, device, instance->cloud, &resident);
    if (!error)
        error = device->ops->buffer_create(device, count * sizeof *chunks, chunks, 1, &chunk_buffer);
    if (error)
        return error;
    struct pt_buffer *const bound[] = { &planes[PT_PLANE_KEYS][0], &planes[PT_PLANE_FROM][0], &planes[PT_PLANE_DEFF][0],
                                        &chunk_buffer, &resident->buffers[PT_POSITIONS], &resident->buffers[PT_SURFACE],
                                        pt_shadows_buffer(frame, PT_MARKS, i),
                                        pt_shadows_buffer(frame, PT_SHADOWS, i), &frame->shadows.differs,
                                        (struct pt_buffer *)update->opacities };
    args->base = light * (uint32_t)instance->cloud->slots;
    error = device->ops->run(device, PT_KERNEL_lit, args, sizeof *args, bound, sizeof bound / sizeof *bound, &frame->cancel);
    args->base = light;
    device->ops->buffer_destroy(device, &chunk_buffer);
    return error ? error : device->ops->finish(device);
}

// The same of pixels that show meshes.
static int test_pixels(struct update *update, const struct patina_scene *view, struct pt_plan *map, const struct lit_args *given)
{
    struct patina_frame *frame = update->frame;
    struct patina_device *device = frame->device;
    const struct patina_cloud *cloud = update->pixels->cloud;
    struct pt_buffer(*planes)[PT_SLOTS] = frame->shadows.planes, chunk_buffer = { 0 };
    struct chunk_view *chunks;
    struct lit_args args = *given;
    int error = pt_plan_chunks(view, map, update->pixels, &args.instance, &chunks);
    if (!error)
        error = device->ops->buffer_create(device, cloud->chunk_count * sizeof *chunks, chunks, 1, &chunk_buffer);
    if (error)
        return error;
    struct pt_buffer *const bound[] = { &planes[PT_PLANE_KEYS][0], &planes[PT_PLANE_FROM][0], &planes[PT_PLANE_DEFF][0],
                                        &chunk_buffer, &frame->planes[PT_PLANE_MESH_PLACES][0],
                                        &frame->planes[PT_PLANE_MESH_WORDS][0], pt_shadows_buffer(frame, PT_MARKS, PT_PIXELS),
                                        &frame->shadows.pixels.words, &frame->shadows.differs,
                                        (struct pt_buffer *)update->opacities };
    args.base = given->base * (uint32_t)cloud->slots;
    args.marked = args.compare = 0;
    error = device->ops->run(device, PT_KERNEL_lit, &args, sizeof args, bound, sizeof bound / sizeof *bound, &frame->cancel);
    device->ops->buffer_destroy(device, &chunk_buffer);
    return error ? error : device->ops->finish(device);
}

// The group's caster, as kernels need it where its points have opacities of their own.
static int take_caster(struct update *update, const struct pt_shadow_group *group, struct lit_args *args)
{
    struct patina_frame *frame = update->frame;
    struct pt_resident *resident;
    update->opacities = pt_shadows_buffer(frame, PT_MARKS, UINT32_MAX); // none
    args->loss = group->loss;
    args->faint = (uint32_t)group->faint;
    if (!group->faint)
        return PATINA_OK;
    const struct pt_instance *caster = &update->scene->instances[group->only];
    int error = pt_residency_take(&frame->residency, frame->device, caster->cloud, &resident);
    if (!error)
        update->opacities = &resident->buffers[PT_OPACITIES];
    args->caster = caster->id_base;
    return error;
}

// Sets the limit behind which the next layer of a faint caster lies, where the light is not spent. *some: it is not everywhere.
static int limit_map(struct update *update, const struct pt_plan *map, const struct pt_shadow_group *group, uint32_t *some)
{
    struct patina_frame *frame = update->frame;
    const struct pt_device_ops *ops = frame->device->ops;
    struct pt_buffer(*planes)[PT_SLOTS] = frame->shadows.planes;
    struct pt_resident *resident;
    struct limit_args args = { .view = map->view, .caster = update->scene->instances[group->only].id_base, .loss = group->loss };
    const uint32_t whole[4] = { 0, 0, map->view.width, map->view.height };
    memcpy(args.view.rect, whole, sizeof whole);
    int error = pt_frame_ensure_plane(frame, planes, map, PT_PLANE_LIMIT, 0);
    if (!error)
        error = pt_residency_take(&frame->residency, frame->device, update->scene->instances[group->only].cloud, &resident);
    *some = 0;
    if (!error)
        error = ops->buffer_write(frame->device, &frame->shadows.some, 0, some, sizeof *some);
    if (error)
        return error;
    struct pt_buffer *const bound[] = { &planes[PT_PLANE_KEYS][0], &planes[PT_PLANE_FROM][0], &planes[PT_PLANE_DEFF][0],
                                        &resident->buffers[PT_OPACITIES], &planes[PT_PLANE_LIMIT][0], &frame->shadows.some };
    error = ops->run(frame->device, PT_KERNEL_limit, &args, sizeof args, bound, sizeof bound / sizeof *bound, &frame->cancel);
    return error ? error : ops->buffer_read(frame->device, &frame->shadows.some, 0, some, sizeof *some);
}

// One layer of a map: drawn, and everyone tested whom it concerns. args->base: the light's place. *some: there may be one behind.
static int test_layer(struct update *update, const struct pt_plan_light *planned, const struct pt_shadow_group *group,
                      const struct patina_scene *view, const double window[4], uint32_t *some, struct lit_args *args)
{
    struct patina_frame *frame = update->frame;
    struct pt_plan map = { 0 };
    double start = pt_milliseconds(), drawn;
    int error = pt_plan_map(view, &map, *some != 0);
    *some = 0;
    if (!error && pt_plan_shows(&map))
        error = draw_map(update, &map);
    drawn = pt_milliseconds();
    pt_frame_note_time(frame, "light map", drawn - start);
    if (!error && pt_plan_shows(&map)) {
        frame->shadow_maps++;
        frame->shadow_size[0] = map.crop[2] > frame->shadow_size[0] ? map.crop[2] : frame->shadow_size[0];
        frame->shadow_size[1] = map.crop[3] > frame->shadow_size[1] ? map.crop[3] : frame->shadow_size[1];
        args->view = map.view;
        set_window(&map, window, args->window);
        for (uint32_t i = 0; i < update->scene->instance_count && !error; i++)
            if (receives(update, group, i)) {
                args->alone = maps_of(update, planned, i) == 1;
                error = test_instance(update, view, &map, i, args);
            }
        args->alone = maps_of(update, planned, PT_PIXELS) == 1;
        if (!error && receives(update, group, PT_PIXELS))
            error = test_pixels(update, view, &map, args);
        pt_frame_note_time(frame, "lit", pt_milliseconds() - drawn);
        if (!error && group->faint)
            error = limit_map(update, &map, group, some);
    }
    pt_plan_destroy(&map);
    return error;
}

// One map of a sample, with its layers.
static int test_map(struct update *update, const struct pt_plan_light *planned, const struct pt_shadow_group *group,
                    uint32_t sample, uint32_t face, struct lit_args *args)
{
    struct patina_scene view = { 0 };
    double window[4];
    uint32_t some = 0;
    int error = take_caster(update, group, args);
    if (error || !pt_light_scene(update->scene, planned, group, sample, face, update->instances, update->meshes, &view, window))
        return error;
    pt_handle_init(&view.handle);
    for (uint32_t layer = 0; layer < FAINT_LAYERS && !error && (some || !layer); layer++)
        error = test_layer(update, planned, group, &view, window, &some, args);
    pt_handle_destroy(&view.handle);
    return error;
}

// Instances of several maps a sample: what these took together goes into the sum.
static int close_sample(struct update *update, const struct pt_plan_light *planned, struct lit_args *args)
{
    static const patina_camera anywhere = { .orthographic = 1,
                                            .world_from_camera = { 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1 },
                                            .left = -1, .right = 1, .bottom = -1, .top = 1, .far_clip = 1 };
    const struct patina_scene nothing = { .camera = anywhere, .settings = { .width = 1, .height = 1 } }; // lies in no window
    double start = pt_milliseconds();
    int error = PATINA_OK;
    memset(args->window, 0, sizeof args->window);
    args->alone = args->faint = 0;
    args->close = 1;
    for (uint32_t i = 0; i < update->scene->instance_count && !error; i++) {
        struct pt_plan scratch = { 0 };
        if (pt_receives(&update->scene->instances[i]) && maps_of(update, planned, i) > 1)
            error = test_instance(update, &nothing, &scratch, i, args);
        pt_plan_destroy(&scratch);
    }
    struct pt_plan scratch = { 0 };
    if (!error && maps_of(update, planned, PT_PIXELS) > 1)
        error = test_pixels(update, &nothing, &scratch, args);
    pt_plan_destroy(&scratch);
    pt_frame_note_time(update->frame, "lit", pt_milliseconds() - start);
    return error;
}

static int some_tested(const struct update *update, const struct pt_shadow_group *group)
{
    int some = receives(update, group, PT_PIXELS);
    for (uint32_t i = 0; i < update->scene->instance_count && !some; i++)
        some = receives(update, group, i);
    return some;
}

// points: they are tested; pixels are, as far as they want so many samples.
static int take_sample(struct update *update, uint32_t index, uint32_t sample, int points, int compare)
{
    const struct pt_plan_light *planned = &update->plan->lights[index];
    update->points_too = points;
    update->pixels_too = update->pixels && sample < update->frame->shadows.pixels.samples[index];
    if (!update->points_too && !update->pixels_too)
        return PATINA_OK;
    uint32_t faces = planned->cube ? 6 : 1;
    struct lit_args args = { .base = index, .samples = sample + 1, .compare = (uint32_t)compare };
    args.marked = (uint32_t)pt_plan_lazy(update->scene, update->plan);
    for (uint32_t g = 0; g < update->group_count; g++)
        for (uint32_t face = 0; face < faces && some_tested(update, &update->groups[g]); face++) {
            int error = test_map(update, planned, &update->groups[g], sample, face, &args);
            if (error)
                return error;
        }
    return close_sample(update, planned, &args);
}

// All zero: no sample yet. Other lights' words lie in the same buffers.
static int clear_words(struct update *update, uint32_t index)
{
    struct patina_frame *frame = update->frame;
    const struct pt_device_ops *ops = frame->device->ops;
    if (update->plan->light_count == 1) {
        for (uint32_t i = 0; i < frame->shadows.instance_count; i++)
            if (frame->shadows.words[i].size &&
                ops->buffer_fill(frame->device, &frame->shadows.words[i], 0, frame->shadows.words[i].size, 0, 4))
                return PATINA_ERROR_INTERNAL;
        return PATINA_OK;
    }
    int error = PATINA_OK;
    for (uint32_t i = 0; i < frame->shadows.instance_count && !error; i++) {
        size_t size = (size_t)update->scene->instances[i].cloud->slots * 4;
        if (!frame->shadows.words[i].size)
            continue;
        void *zeros = calloc(size, 1);
        error = zeros ? ops->buffer_write(frame->device, &frame->shadows.words[i], index * size, zeros, size)
                      : pt_fail(&frame->device->handle, PATINA_ERROR_MEMORY, "shadow textures: out of memory");
        free(zeros);
    }
    return error;
}

// Whether the error after so many samples is compared with that after half of them, or the last stop before the end.
static int measures_at(const struct update *update, uint32_t index, uint32_t samples)
{
    uint32_t most = update->plan->lights[index].samples;
    return update->scene->settings.shadow_error > 0.0f && most > 1 &&
           ((samples >= FIRST_COMPARED / 2 && !(samples & (samples - 1))) || samples == most);
}

// before: the sums of the last stop, in and out.
static int measure_error(struct update *update, uint32_t index, struct pt_shadow_sums *before)
{
    struct pt_shadow_light *light = &update->frame->shadows.lights[index];
    struct pt_shadow_sums now = { 0 };
    int error = pt_shadow_sums_read(update->frame, index, &now);
    if (!error && before->words && before->samples < now.samples) {
        light->error = pt_shadow_error(before, &now);
        light->settled |= light->error <= update->scene->settings.shadow_error;
    }
    pt_shadow_sums_free(before);
    *before = now;
    return error;
}

// Samples of a light's points from `done` on, as many as are wanted; *end: where they stopped.
static int test_points(struct update *update, uint32_t index, uint32_t done, uint32_t wanted, uint32_t *end)
{
    struct patina_frame *frame = update->frame;
    struct pt_shadow_light *light = &frame->shadows.lights[index];
    struct pt_shadow_sums before = { 0 };
    int error = done ? PATINA_OK : clear_words(update, index);
    if (!error && measures_at(update, index, done))
        error = measure_error(update, index, &before);
    if (!done)
        light->error = 0.0f;
    for (uint32_t stop = FIRST_COMPARED; done < wanted && !error && !light->settled; done++) {
        while (stop < done + 1)
            stop *= 2;
        uint32_t differs = 0;
        int compare = stop == done + 1;
        light->samples = 0; // half a sample is none
        if (atomic_load(&frame->cancel))
            error = PATINA_ERROR_CANCELLED;
        if (!error && compare)
            error = frame->device->ops->buffer_write(frame->device, &frame->shadows.differs, 0, &differs, sizeof differs);
        if (!error)
            error = take_sample(update, index, done, 1, compare);
        if (!error && compare)
            error = frame->device->ops->buffer_read(frame->device, &frame->shadows.differs, 0, &differs, sizeof differs);
        if (!error) {
            light->samples = done + 1;
            light->settled = compare && !differs;
            light->partial = (uint32_t)pt_plan_lazy(update->scene, update->plan);
        }
        if (!error && measures_at(update, index, done + 1))
            error = measure_error(update, index, &before);
    }
    pt_shadow_sums_free(&before);
    *end = done;
    return error;
}

static int some_receives(const struct patina_scene *scene)
{
    for (uint32_t i = 0; i < scene->instance_count; i++)
        if (pt_receives(&scene->instances[i]))
            return 1;
    return 0;
}

// points: they are brought up to the samples that they want; pixels that show meshes get theirs in any case.
static int test_light(struct update *update, uint32_t index, int points)
{
    struct patina_frame *frame = update->frame;
    struct pt_shadow_light *light = &frame->shadows.lights[index];
    const uint32_t first = light->samples, wanted = points ? samples_wanted(update->scene, update->plan, index, light) : first;
    const uint32_t of_pixels = update->pixels ? frame->shadows.pixels.samples[index] : 0;
    uint32_t end = first;
    double start = pt_milliseconds();
    if (first < wanted && !some_receives(update->scene))
        light->samples = end = wanted;
    if (end == wanted && !of_pixels)
        return PATINA_OK;
    int error = pt_plan_light_map(update->scene, update->plan, index);
    pt_frame_note_time(frame, "light map", pt_milliseconds() - start);
    if (!error && end < wanted)
        error = test_points(update, index, first, wanted, &end);
    for (uint32_t sample = 0; sample < of_pixels && !error; sample++) {
        if (atomic_load(&frame->cancel))
            error = PATINA_ERROR_CANCELLED;
        else if (sample < first || sample >= end || !some_receives(update->scene)) // else with the points
            error = take_sample(update, index, sample, 0, 0);
    }
    return error;
}

// Tells the shade passes how many samples the words hold.
static void set_scales(const struct pt_shadows *shadows, struct pt_plan *plan)
{
    enum { WORDS = 8 }; // of a shade pass's buffers
    for (uint32_t p = 0; p < plan->pass_count; p++) {
        if (plan->passes[p].kernel != PT_KERNEL_shade)
            continue;
        struct shade_args *args = (struct shade_args *)plan->passes[p].arguments; // the plan's own memory
        const int pixels = plan->passes[p].refs[WORDS].index == PT_PIXELS;
        for (uint32_t i = 0; i < args->light_count; i++)
            if (args->lights[i].shadow) {
                const uint32_t light = args->lights[i].shadow - 1;
                const uint32_t samples = pixels ? shadows->pixels.samples[light] : shadows->lights[light].samples;
                args->lights[i].shadow_scale = 1.0f / (255.0f * (float)samples);
            }
    }
}

// points: all of the plan's lights are brought up to date; else pixels alone.
static int update_lights(struct update *update, int points)
{
    struct patina_frame *frame = update->frame;
    const struct patina_scene *scene = update->scene;
    const struct pt_device_ops *ops = frame->device->ops;
    int error = PATINA_OK;
    update->groups = calloc(2 * (size_t)scene->instance_count + 1, sizeof *update->groups);
    update->instances = calloc((size_t)scene->instance_count + 1, sizeof *update->instances);
    update->meshes = calloc((size_t)scene->mesh_count + 1, sizeof *update->meshes);
    if (!update->groups || !update->instances || !update->meshes)
        error = pt_fail(&frame->device->handle, PATINA_ERROR_MEMORY, "shadow textures: out of memory");
    else
        update->group_count = pt_shadow_groups(scene, update->groups);
    if (!error && !frame->shadows.differs.size)
        error = ops->buffer_create(frame->device, sizeof(uint32_t), NULL, 0, &frame->shadows.differs);
    if (!error && !frame->shadows.some.size)
        error = ops->buffer_create(frame->device, sizeof(uint32_t), NULL, 0, &frame->shadows.some);
    for (uint32_t i = 0; i < update->plan->light_count && !error; i++)
        error = test_light(update, i, points);
    free(update->groups);
    free(update->instances);
    free(update->meshes);
    return error;
}

// Tests the pixels of the layer at hand that show meshes, and with `points` what else is to be tested.
static int update_layer(struct patina_frame *frame, const struct patina_scene *scene, struct pt_plan *plan, int points)
{
    struct update update = { .frame = frame, .scene = scene, .plan = plan };
    struct pt_pixel_receiver receiver;
    int error = pt_pixels_begin(frame, scene, plan, &receiver);
    if (receiver.chunks)
        update.pixels = &receiver.instance;
    if (!error && (update.pixels || (points && pt_shadows_stale(frame, scene, plan))))
        error = update_lights(&update, points);
    pt_pixels_end(&receiver);
    return error;
}

int pt_shadows_update(struct patina_frame *frame, const struct patina_scene *scene, struct pt_plan *plan)
{
    int error = PATINA_OK;
    if (!plan->light_count)
        return PATINA_OK;
    pt_frame_note_time(frame, "lit", 0.0); // also where every texture is at hand
    error = update_layer(frame, scene, plan, 1);
    if (!error)
        set_scales(&frame->shadows, plan);
    return error;
}

int pt_shadows_behind(struct patina_frame *frame, const struct patina_scene *scene, struct pt_plan *plan)
{
    return plan->light_count && plan->mesh_shadows ? update_layer(frame, scene, plan, 0) : PATINA_OK;
}

int pt_shadows_bake(struct patina_frame *frame, const struct patina_scene *scene)
{
    struct patina_scene whole = *scene; // its handle is not touched
    struct pt_plan plan = { 0 };
    whole.settings.shadow_lazy = whole.settings.shadow_progressive = 0;
    int error = PATINA_OK;
    pt_plan_lights(&whole, &plan);
    frame->timing_count = 0;
    frame->shadow_maps = 0;
    if (!plan.light_count || !scene->instance_count)
        error = pt_fail(&frame->handle, PATINA_ERROR_EMPTY, "shadows: no light of the scene casts any, or there is no cloud");
    if (!error)
        error = pt_frame_number(frame, scene);
    if (!error)
        error = pt_shadows_open(frame, &whole, &plan);
    if (!error)
        error = pt_shadows_update(frame, &whole, &plan);
    pt_plan_destroy(&plan);
    atomic_store(&frame->cancel, 0);
    if (error == PATINA_ERROR_CANCELLED)
        return pt_fail(&frame->handle, error, "baking shadows was cancelled");
    return error ? pt_fail_again(&frame->handle, error) : PATINA_OK;
}

int pt_shadows_read(const struct patina_frame *frame, uint32_t instance, uint32_t light, float *values, size_t size)
{
    const struct pt_shadows *shadows = &frame->shadows;
    if (instance >= shadows->instance_count || light >= shadows->light_count || !shadows->words[instance].size ||
        !shadows->lights[light].samples)
        return pt_fail(&frame->handle, PATINA_ERROR_EMPTY, "patina_frame_read_shadows: no texture of light %u on instance %u",
                       light, instance);
    const struct patina_cloud *cloud = pt_numbering_cloud(&frame->numbering, instance);
    if (!cloud)
        return pt_fail(&frame->handle, PATINA_ERROR_EMPTY, "patina_frame_read_shadows: cloud %u was destroyed since", instance);
    size_t count = (size_t)cloud->info.count, bytes = shadows->words[instance].size / shadows->light_count;
    if (size != count * sizeof *values)
        return pt_fail(&frame->handle, PATINA_ERROR_ARGUMENT, "patina_frame_read_shadows: %zu points; got %zu bytes", count,
                       size);
    uint32_t *words = malloc(bytes + 1);
    if (!words)
        return pt_fail(&frame->handle, PATINA_ERROR_MEMORY, "patina_frame_read_shadows: out of memory");
    int error = frame->device->ops->buffer_read(frame->device, &shadows->words[instance], light * bytes, words, bytes);
    float scale = 1.0f / (255.0f * (float)shadows->lights[light].samples);
    for (size_t i = 0; i < count && !error; i++)
        values[i] = 1.0f; // of points that are not drawn
    for (uint32_t c = 0; c < cloud->chunk_count && !error; c++) {
        const struct pt_chunk *chunk = &cloud->chunks[c];
        for (uint32_t slot = chunk->first; slot < chunk->first + chunk->count; slot++)
            values[cloud->order[slot]] = 1.0f - (float)(words[slot] & PT_SHADOW_SUM) * scale;
    }
    free(words);
    return error ? pt_fail_again(&frame->handle, error) : PATINA_OK;
}
