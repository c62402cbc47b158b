// SPDX-License-Identifier: GPL-3.0-or-later
#include "binder.h"

#include "plan/ranges.h"
#include "scene/mask.h"
#include "scene/clouds/page_sums.h"
#include "scene/scans.h"

#include <stdlib.h>
#include <string.h>

int pt_binder_open(struct pt_binder *binder)
{
    const struct pt_plan *plan = binder->plan;
    binder->instances = calloc((size_t)plan->instance_count + plan->soft.entries + 1, sizeof *binder->instances);
    binder->receivers = calloc((size_t)plan->receiver_count + 1, sizeof *binder->receivers);
    binder->meshes = calloc((size_t)plan->mesh.count + 1, sizeof *binder->meshes);
    if (!binder->instances || !binder->receivers || !binder->meshes)
        return pt_fail(&binder->device->handle, PATINA_ERROR_MEMORY, "a frame: out of memory");
    return pt_plan_buffers_fill(binder->device, plan, binder->own);
}

void pt_binder_close(struct pt_binder *binder)
{
    const struct pt_plan *plan = binder->plan;
    for (uint32_t i = 0; i < plan->instance_count + plan->soft.entries && binder->instances; i++) {
        binder->device->ops->buffer_destroy(binder->device, &binder->instances[i].chunks);
        free(binder->instances[i].sound);
        for (int k = 0; k < PT_RANGE_FINER; k++)
            binder->device->ops->buffer_destroy(binder->device, &binder->instances[i].fine[k]);
    }
    for (uint32_t i = 0; i < plan->receiver_count && binder->receivers; i++)
        binder->device->ops->buffer_destroy(binder->device, &binder->receivers[i].chunks);
    free(binder->instances);
    free(binder->receivers);
    free(binder->meshes);
}

// Those that are not known to be damaged.
static uint32_t take_sound(const struct patina_cloud *cloud, const struct chunk_view *chunks, uint32_t count,
                           struct chunk_view *out)
{
    uint32_t some = 0;
    for (uint32_t i = 0; i < count; i++)
        if (!pt_page_is_damaged(cloud, pt_page_at(cloud, chunks[i].first)))
            out[some++] = chunks[i];
    return some;
}

int pt_bind_chunks(struct pt_binder *binder, uint32_t instance, const struct chunk_view *chunks, uint32_t count)
{
    struct pt_bound_instance *bound = &binder->instances[instance];
    const struct patina_cloud *cloud = binder->plan->instances[instance].instance->cloud;
    binder->device->ops->buffer_destroy(binder->device, &bound->chunks);
    bound->placed = 1;
    free(bound->sound);
    bound->sound = NULL;
    if (binder->in_parts && pt_pages_are_damaged(cloud)) { // the plan has them all
        if (!(bound->sound = malloc((count + (size_t)1) * sizeof *bound->sound)))
            return pt_fail(&binder->device->handle, PATINA_ERROR_MEMORY, "a frame: out of memory");
        count = take_sound(cloud, chunks, count, bound->sound);
        chunks = bound->sound;
    }
    return binder->device->ops->buffer_create(binder->device, count * sizeof *chunks, chunks, 1, &bound->chunks);
}

static int take_cloud(struct pt_binder *binder, struct pt_bound_instance *bound, const struct patina_cloud *cloud)
{
    return bound->cloud ? PATINA_OK : pt_residency_take(binder->residency, binder->device, cloud, &bound->cloud);
}

static int take_mask(struct pt_binder *binder, struct pt_bound_instance *bound, const struct patina_mask *mask)
{
    return bound->mask ? PATINA_OK
                       : pt_residency_take_bytes(binder->residency, binder->device, mask->alive, mask->words,
                                                 mask->word_count * sizeof *mask->words, &bound->mask);
}

static int take_grade(struct pt_binder *binder, struct pt_bound_instance *bound, const struct patina_grade *grade)
{
    return bound->grade ? PATINA_OK
                        : pt_residency_take_points(binder->residency, binder->device, grade->alive, grade->colors, grade->size,
                                                   &bound->grade);
}

static int take_scans(struct pt_binder *binder, struct pt_bound_instance *bound, const struct patina_scans *scans)
{
    return bound->scans ? PATINA_OK
                        : pt_residency_take_points(binder->residency, binder->device, scans->alive, scans->scan,
                                                   (scans->slots + 2) * sizeof *scans->scan, &bound->scans);
}

// Where all points are soft, the words are the cloud's.
static int bind_field(struct pt_binder *binder, const struct pt_instance *instance, struct pt_bound_instance *bound, int one,
                      struct pt_buffer **out)
{
    const struct patina_field *field = pt_has_field(&instance->style) ? instance->style.field : NULL;
    int error = PATINA_OK;
    if (field && !bound->field)
        error = pt_residency_take_bytes(binder->residency, binder->device, field->alive, NULL, 0, &bound->field);
    if (error)
        return error;
    struct pt_resident *holder = field ? bound->field : bound->cloud;
    *out = &holder->fields[one];
    return pt_residency_field(binder->device, instance->cloud, field, holder, one);
}

// Colours: the cloud's own, with what stations saw through in magenta, or graded.
static int bind_colors(struct pt_binder *binder, const struct pt_plan_instance *planned, struct pt_bound_instance *bound,
                       struct pt_buffer **out)
{
    const struct pt_instance *instance = planned->instance;
    int error = PATINA_OK;
    if (planned->marked) {
        error = pt_residency_mark(binder->device, instance->cloud, bound->cloud);
        *out = &bound->cloud->marked;
    } else if (instance->style.grade) {
        error = take_grade(binder, bound, instance->style.grade);
        *out = error ? NULL : &bound->grade->buffers[0];
    } else {
        *out = &bound->cloud->buffers[PT_COLORS];
    }
    return error;
}

static int bind_instance(struct pt_binder *binder, const struct pt_ref *ref, struct pt_buffer **out)
{
    const struct pt_plan_instance *planned = &binder->plan->instances[ref->index];
    struct pt_bound_instance *bound = &binder->instances[ref->index];
    int error = PATINA_OK;
    if (ref->which == PT_CHUNKS) {
        *out = &bound->chunks;
        return bound->placed ? PATINA_OK : pt_bind_chunks(binder, ref->index, planned->chunks, planned->chunk_count);
    }
    if (ref->which == PT_MASK) {
        error = take_mask(binder, bound, pt_mask_of(planned->instance));
        *out = error ? NULL : &bound->mask->buffers[0];
        return error;
    }
    if (ref->which >= PT_FINE_CHUNKS && ref->which < PT_FINE_CHUNKS + PT_RANGE_FINER) {
        const uint32_t level = ref->which - PT_FINE_CHUNKS;
        const struct pt_range *fine = pt_range_of(planned, 1 + level);
        *out = &bound->fine[level];
        return bound->fine[level].size
                   ? PATINA_OK
                   : binder->device->ops->buffer_create(binder->device, fine->chunk_count * sizeof *fine->chunks, fine->chunks,
                                                        1, &bound->fine[level]);
    }
    if (ref->which == PT_SCANS) {
        error = take_scans(binder, bound, planned->instance->style.scans);
        *out = error ? NULL : &bound->scans->buffers[0];
        return error;
    }
    if ((error = take_cloud(binder, bound, planned->instance->cloud)))
        return error;
    if (ref->which == PT_COLORS)
        return bind_colors(binder, planned, bound, out);
    if (ref->which == PT_FIELD || ref->which == PT_FIELD_ONE)
        return bind_field(binder, planned->instance, bound, ref->which == PT_FIELD_ONE, out);
    *out = &bound->cloud->buffers[ref->which];
    return ref->which == PT_SIGHTS ? pt_residency_see(binder->device, planned->instance->cloud, bound->cloud) : PATINA_OK;
}

static int bind_receiver(struct pt_binder *binder, const struct pt_ref *ref, struct pt_buffer **out)
{
    const struct pt_receiver *receiver = &binder->plan->receivers[ref->index];
    struct pt_bound_instance *bound = &binder->receivers[ref->index];
    if (ref->which == PT_CHUNKS) {
        *out = &bound->chunks;
        return bound->chunks.size
                   ? PATINA_OK
                   : binder->device->ops->buffer_create(binder->device, receiver->chunk_count * sizeof *receiver->chunks,
                                                        receiver->chunks, 1, &bound->chunks);
    }
    int error = take_cloud(binder, bound, receiver->cloud);
    *out = error ? NULL : &bound->cloud->buffers[ref->which];
    return error;
}

static int bind_mesh(struct pt_binder *binder, const struct pt_ref *ref, struct pt_buffer **out)
{
    const struct pt_instance *instance = binder->plan->mesh.list[ref->index].instance;
    struct pt_bound_mesh *bound = &binder->meshes[ref->index];
    int error = PATINA_OK;
    *out = &binder->none;
    if (ref->which != PT_MESH_TEXELS) {
        if (!bound->mesh)
            error = pt_residency_take_mesh(binder->residency, binder->device, instance->mesh, &bound->mesh);
        if (!error)
            *out = &bound->mesh->buffers[ref->which];
    } else if (instance->mesh_style.texture) {
        if (!bound->texture)
            error = pt_residency_take_texture(binder->residency, binder->device, instance->mesh_style.texture, &bound->texture);
        if (!error)
            *out = &bound->texture->buffers[0];
    }
    return error;
}

int pt_bind(struct pt_binder *binder, const struct pt_ref *ref, struct pt_buffer **out)
{
    switch (ref->of) {
    case PT_OF_FRAME:
        *out = &binder->planes->at[ref->which][ref->index];
        return pt_planes_ensure(binder->device, binder->planes, binder->plan, ref->which, ref->index);
    case PT_OF_LEFT: *out = &binder->planes->at[ref->which][ref->index]; return PATINA_OK;
    case PT_OF_PICTURE: *out = &binder->picture->at[ref->which][ref->index]; return PATINA_OK;
    case PT_OF_MESH: return bind_mesh(binder, ref, out);
    case PT_OF_RECEIVER: return bind_receiver(binder, ref, out);
    case PT_OF_FLAG: *out = &binder->shadows->flags[ref->which]; return PATINA_OK;
    case PT_OF_PLAN: *out = &binder->own->shared[ref->which]; return PATINA_OK;
    case PT_OF_NOTHING: *out = &binder->none; return PATINA_OK;
    case PT_OF_INSTANCE: break;
    }
    if (ref->which == PT_MARKS || ref->which == PT_SHADOWS)
        *out = pt_shadows_buffer(binder->shadows, ref->which, ref->index);
    else if (ref->which == PT_CLIPS || ref->which == PT_DRAWN)
        *out = pt_clip_buffer(binder->own, ref->which);
    else
        return bind_instance(binder, ref, out);
    return PATINA_OK;
}
