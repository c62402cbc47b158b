// SPDX-License-Identifier: GPL-3.0-or-later
// Clips, hidden classes, hidden shapes, masks and fields. Chunks that they take whole are culled, chunks that they leave whole cost nothing; the points of
// divided ones are sifted before scatter, into a word of bits for every PT_SLOTS_A_WORD of them. The cut may be tinted.
#include "passes.h"
#include "scene/clip.h"
#include "scene/mask.h"
#include "scene/scans.h"
#include "shared/effects.h"
#include "shared/points.h"

#include <string.h>

// Room for `more` clips behind those there are; NULL without memory.
static struct clip_view *more_clips(struct pt_plan *plan, uint32_t more)
{
    while (plan->clip_room < plan->clip_count + more) {
        struct clip_view *grown = pt_arena_grow(&plan->arena, plan->clips, &plan->clip_room, sizeof *grown);
        if (!grown)
            return NULL;
        plan->clips = grown;
    }
    return plan->clips + plan->clip_count;
}

int pt_plan_divide(struct pt_plan *plan, struct pt_plan_instance *instance, const struct pt_sieve *sieve,
                   const struct pt_chunk *chunk, struct chunk_view *out)
{
    struct pt_division division;
    struct clip_view *entries = more_clips(plan, sieve->count + 1);
    if (!entries)
        return PATINA_ERROR_MEMORY;
    if (pt_sieve_chunk(sieve, chunk, entries, &division) != PT_DIVIDED)
        return PATINA_OK;
    out->clip_first = plan->clip_count;
    out->clip_count = division.count;
    out->clip_keeps = division.keeps;
    out->sifted = 1 + plan->drawn_words;
    plan->clip_count += division.count;
    plan->drawn_words += out->padded / PT_SLOTS_A_WORD;
    plan->chunks_cut++;
    instance->chunks_cut++;
    instance->by_class |= division.by_class;
    instance->by_shape |= division.by_shape;
    instance->by_mask |= division.by_mask;
    instance->by_field |= division.by_field;
    instance->by_scan |= division.by_scan;
    return PATINA_OK;
}

void pt_plan_sift(struct pt_builder *builder)
{
    const struct pt_plan *plan = builder->plan;
    if (!plan->drawn_words) {
        pt_skip(builder, "sift",
                plan->chunks_clipped ? "clips, classes, shapes, masks, fields and scans take chunks whole"
                                     : "no clip, hidden class, hidden shape, mask, field or hidden scan in view");
        return;
    }
    for (uint32_t i = 0; i < plan->instance_count + plan->soft.count && builder->layer <= 1;
         i++) { // the words serve every layer
        const struct pt_plan_instance *instance = &plan->instances[i];
        if (!instance->chunks_cut)
            continue;
        struct sift_args args = {.by_class = instance->by_class != 0,
                                 .by_shape = instance->by_shape != 0,
                                 .by_mask = instance->by_mask != 0,
                                 .by_field = instance->by_field != 0,
                                 .by_scan = instance->by_scan != 0,
                                 .threshold = pt_field_steps(instance->instance->style.soft_threshold)};
        memcpy(args.hidden, instance->instance->style.hidden_classes, sizeof args.hidden);
        pt_hidden_shapes(instance->instance, args.hidden_shapes);
        pt_hidden_scans(builder->scene, instance->instance, args.hidden_scans);
        PT_REASON(PT_ADD(builder, sift, args,
                         {pt_buffer_of(PT_CHUNKS, i), pt_buffer_of(PT_POSITIONS, i),
                          args.by_class ? pt_buffer_of(PT_CLASSES, i) : pt_nothing(), pt_buffer_of(PT_CLIPS, i),
                          pt_buffer_of(PT_DRAWN, i), args.by_shape ? pt_shapes_of(instance, i) : pt_nothing(),
                          args.by_mask ? pt_buffer_of(PT_MASK, i) : pt_nothing(),
                          args.by_field ? pt_field_of(instance, i) : pt_nothing(),
                          args.by_scan ? pt_buffer_of(PT_SCANS, i) : pt_nothing()}),
                  "clips, classes, shapes, a mask, a field or scans divide %u chunks of instance %u", instance->chunks_cut, i);
    }
}

// ---- tint ----------------------------------------------------------------------------------------------------------------

static int tinted(const struct patina_scene *scene)
{
    for (uint32_t i = 0; i < scene->clip_count; i++)
        if (scene->clips[i].tint_strength > 0.0f && scene->clips[i].tint_width > 0.0f)
            return 1;
    return 0;
}

// The instance's clips in view space, behind the others. Returns how many.
static uint32_t clips_in_view(struct pt_builder *builder, const struct pt_instance *instance)
{
    struct pt_plan *plan = builder->plan;
    double axes[9], turned[9], position[3];
    struct pt_inverse_clip *room = pt_arena_take(&plan->arena, (builder->scene->clip_count + 1) * sizeof *room);
    struct clip_view *out = more_clips(plan, builder->scene->clip_count + 1);
    if (!room || !out) {
        builder->failed = PATINA_ERROR_MEMORY;
        return 0;
    }
    struct pt_sieve sieve = pt_sieve_make(builder->scene, instance, PT_EVERY_POINT, room);
    pt_camera_axes(&builder->scene->camera, axes, position);
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            turned[3 * r + c] = axes[3 * c + r];
    for (uint32_t k = 0; k < sieve.count; k++)
        pt_clip_in_frame(&sieve.clips[k], turned, position, &out[k]);
    plan->clip_count += sieve.count;
    return sieve.count;
}

void pt_plan_tint(struct pt_builder *builder, enum pt_plane color)
{
    const struct pt_plan *plan = builder->plan;
    const struct patina_scene *scene = builder->scene;
    if (!tinted(scene)) {
        pt_skip(builder, "tint", scene->clip_count ? "no clip is tinted" : "no clips");
        return;
    }
    for (uint32_t i = 0; i < plan->instance_count; i++) {
        const struct pt_plan_instance *instance = &plan->instances[i];
        if (!instance->chunk_count)
            continue;
        struct tint_args args = {.view = pt_view_filled(plan, instance),
                                 .id_base = instance->args.id_base,
                                 .id_first = instance->args.id_first,
                                 .id_count = instance->args.id_count,
                                 .clip_first = plan->clip_count,
                                 .eye_z = pt_eye_z(scene)};
        args.clip_count = clips_in_view(builder, instance->instance);
        if (args.clip_count)
            PT_REASON(PT_ADD(builder, tint, args, {pt_keys_of(builder, 0), pt_buffer_of(PT_CLIPS, i), pt_plane_at(color, 0)}),
                      "cuts of %u clips through instance %u", args.clip_count, i);
    }
}
