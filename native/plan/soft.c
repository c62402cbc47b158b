// SPDX-License-Identifier: GPL-3.0-or-later
// Soft points [S]: gathered into records, lit, and drawn over the picture in parts whose records fit. SPEC 5, soft.
//
// A part is a slab of depth and rows of the picture. Slabs follow from what the whole picture sees, so that a region is drawn in the
// same; a ball that reaches into several is in each of them, and each draws what of it lies within. Rows change nothing of a pixel.
#include "eye.h"
#include "pages.h"
#include "passes.h"

#include "scene/clip.h"
#include "scene/mask.h"
#include "scene/clouds/paged.h"
#include "scene/soft.h"
#include "shared/balls.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// Records of a part, where its balls can be told apart: 64 MB of them, and 96 MB of bins. Software's blocks end at 128 MB.
enum { PART_RECORDS = 1 << 21 };
enum { LEAST_ROWS = PT_SOFT_TILE, MOST_SLABS = 256 };

struct depths {
    float before, beyond; // of a chunk's balls
    uint32_t records;
};

struct placing {
    const struct patina_scene *scene;
    struct pt_plan *plan;
    const struct pt_eye *eye;
    struct pt_plan_instance *whole; // soft instances in view
    struct depths **depths;         // of their chunks
    struct depths *seen;            // of all that the whole picture shows
    uint32_t seen_count;
    uint32_t entries; // of plan->instances, behind the whole ones
    int filling;      // parts are written, and not only counted
};

// ---- what is in view -----------------------------------------------------------------------------------------------------

static int place_chunk(struct placing *p, struct pt_plan_instance *out, struct depths *depths, const struct pt_sieve *sieve,
                       const struct pt_object *object, const double rows[9], const struct pt_chunk *chunk)
{
    struct pt_plan *plan = p->plan;
    struct pt_extent extent;
    double translation[3];
    const struct pt_to_place what = {p->scene, out->instance, object};
    if (pt_sieve_chunk(sieve, chunk, NULL, NULL) == PT_CUT_AWAY) {
        plan->chunks_clipped += (uint64_t)pt_all_soft(out->instance);
        return PATINA_OK;
    }
    pt_chunk_translation(p->eye, object, chunk, translation);
    if (!pt_kind_bounds(p->eye, PT_AS_SOFT, &what, chunk, rows, translation, &extent))
        return PATINA_OK;
    const struct patina_cloud *cloud = out->instance->cloud;
    const uint32_t c = (uint32_t)(chunk - cloud->chunks);
    pt_paged_look(cloud, c);
    const double pixel = (double)plan->view.footprint * (plan->view.perspective ? fabs(extent.z_beyond) : 1.0) *
                         (double)PT_SOFT_LEAST;
    const struct depths own = {nextafterf((float)(extent.z_before - pixel), -INFINITY),
                               nextafterf((float)(extent.z_beyond + pixel), INFINITY), chunk->padded};
    p->seen[p->seen_count++] = own;
    struct pt_bounds *bounds = &out->bounds[out->chunk_count];
    struct chunk_view *view = &out->chunks[out->chunk_count];
    if (!pt_plan_is_sound(p->scene, cloud, c) || !pt_rect_in_window(&plan->view, extent.rect, 0, bounds->rect))
        return PATINA_OK;
    bounds->z_far = own.beyond;
    depths[out->chunk_count++] = own;
    pt_set_chunk(p->eye, object, rows, out->instance, chunk, pt_drawn_points(p->scene, chunk), 0, view);
    view->id_base = out->args.id_base;
    pt_join_rect(out->rect, bounds->rect);
    out->points += view->count;
    plan->chunks_culled -= (uint64_t)pt_all_soft(out->instance); // others may count as solid ones
    return pt_plan_divide(plan, out, sieve, chunk, view);
}

static int place_instance(struct placing *p, uint32_t i)
{
    const struct pt_instance *instance = &p->scene->instances[i];
    const struct patina_cloud *cloud = instance->cloud;
    struct pt_arena **arena = &p->plan->arena;
    struct pt_plan_instance *out = &p->whole[p->plan->soft.count];
    struct pt_object object;
    double rows[9];
    int error = PATINA_OK;
    *out = (struct pt_plan_instance){.kind = PT_AS_SOFT, .instance = instance, .of = i, .marked = pt_is_marked(instance)};
    out->chunks = pt_arena_take(arena, (pt_chunks_there(cloud) + 1) * sizeof *out->chunks);
    out->bounds = pt_arena_take(arena, (pt_chunks_there(cloud) + 1) * sizeof *out->bounds);
    struct depths *depths = p->depths[p->plan->soft.count] = pt_arena_take(arena,
                                                                           (pt_chunks_there(cloud) + 1) * sizeof *depths);
    struct pt_inverse_clip *clips = pt_arena_take(arena, (p->scene->clip_count + 1) * sizeof *clips);
    if (!out->chunks || !out->bounds || !depths || !clips)
        return PATINA_ERROR_MEMORY;
    const struct pt_sieve sieve = pt_sieve_make(p->scene, instance, PT_SOFT_POINTS, clips);
    pt_object_of(p->eye, instance->style.world_from_object, &object);
    pt_object_rows(p->eye, &object, rows);
    pt_set_instance(p->eye, &object, instance, pt_thinning(p->scene), &out->args);
    pt_set_ids(p->plan, i, 0, &out->args);
    out->as.balls = pt_balls_of(&(struct pt_to_place){p->scene, instance, &object});
    const struct pt_to_place what = {p->scene, instance, &object};
    const struct pt_looking looking = {p->eye, PT_AS_SOFT, &what, rows, &sieve, NULL};
    const uint32_t end = instance->style.transparency < 1.0f ? cloud->chunk_count : 0;
    const uint64_t taken = end ? pt_plan_absent(&looking) : 0;
    p->plan->chunks_clipped += pt_all_soft(instance) ? taken : 0;
    for (uint32_t c = 0; (c = pt_chunk_from(cloud, c)) < end && !error; c++)
        error = place_chunk(p, out, depths, &sieve, &object, rows, &cloud->chunks[c]);
    p->plan->soft.count += out->chunk_count > 0;
    return error;
}

// ---- parts ---------------------------------------------------------------------------------------------------------------

static int by_middle(const void *a, const void *b)
{
    const struct depths *x = a, *y = b;
    const float p = 0.5f * x->before + 0.5f * x->beyond, q = 0.5f * y->before + 0.5f * y->beyond;
    return p != q ? (p > q) - (p < q) : (x->records > y->records) - (x->records < y->records);
}

// Where slabs end, rising; returns how many ends there are, one less than slabs.
static uint32_t slab_ends(struct placing *p, float ends[MOST_SLABS])
{
    uint64_t total = 0, sum = 0;
    uint32_t count = 0;
    for (uint32_t i = 0; i < p->seen_count; i++)
        total += p->seen[i].records;
    if (p->plan->soft.count && p->whole[0].instance->style.soft_model >= PATINA_SOFT_SPLATS)
        return 0; // each slab would have a nearest surface
    const uint64_t wanted = total <= PART_RECORDS ? 1 : 2 * total / PART_RECORDS + 1,
                   slabs = wanted < MOST_SLABS ? wanted : MOST_SLABS;
    qsort(p->seen, p->seen_count, sizeof *p->seen, by_middle);
    for (uint32_t i = 0; i < p->seen_count && slabs > 1; i++) {
        const float middle = 0.5f * p->seen[i].before + 0.5f * p->seen[i].beyond;
        if (sum >= total / slabs * (count + 1) && count + 1 < slabs && (!count || middle > ends[count - 1]))
            ends[count++] = middle;
        sum += p->seen[i].records;
    }
    return count;
}

// The pixels that soft points are drawn on: a light's map is read between its texels' middles.
static void drawn_rect(const struct pt_plan *plan, uint32_t rect[4])
{
    const uint32_t *crop = plan->crop, around = plan->soft.veils > 0;
    for (int k = 0; k < 2; k++) {
        rect[k] = crop[k] - around; // there is a guard
        rect[2 + k] = crop[k] + crop[2 + k] + around;
    }
}

static int takes_part(const struct placing *p, uint32_t instance, uint32_t chunk, const struct pt_soft_part *part)
{
    const struct depths *depths = &p->depths[instance][chunk];
    const uint32_t *rect = p->whole[instance].bounds[chunk].rect;
    uint32_t drawn[4];
    drawn_rect(p->plan, drawn);
    return depths->before < part->z_to && depths->beyond > part->z_from && rect[1] < part->rows[1] && rect[3] > part->rows[0] &&
           rect[0] < drawn[2] && rect[2] > drawn[0];
}

static uint64_t records_of(const struct placing *p, uint32_t instance, const struct pt_soft_part *part)
{
    uint64_t records = 0;
    for (uint32_t c = 0; c < p->whole[instance].chunk_count; c++)
        records += takes_part(p, instance, c, part) ? p->depths[instance][c].records : 0;
    return records;
}

// What of an instance the part draws, as an entry of its own; its records lie behind `records` others.
static int fill_entry(struct placing *p, uint32_t instance, const struct pt_soft_part *part, uint32_t records)
{
    const struct pt_plan_instance *whole = &p->whole[instance];
    struct pt_plan_instance *out = &p->plan->instances[p->entries];
    uint32_t count = 0;
    for (uint32_t c = 0; c < whole->chunk_count; c++)
        count += (uint32_t)takes_part(p, instance, c, part);
    *out = *whole;
    out->chunk_count = 0;
    out->points = 0;
    out->chunks = pt_arena_take(&p->plan->arena, (count + 1) * sizeof *out->chunks);
    if (!out->chunks)
        return PATINA_ERROR_MEMORY;
    for (uint32_t c = 0; c < whole->chunk_count; c++) {
        if (!takes_part(p, instance, c, part))
            continue;
        struct chunk_view *view = &out->chunks[out->chunk_count++];
        *view = whole->chunks[c];
        view->record = records;
        records += view->padded;
        out->points += view->count;
    }
    return PATINA_OK;
}

static int place_part(struct placing *p, struct pt_soft_part part)
{
    struct pt_plan *plan = p->plan;
    uint64_t records = 0;
    part.first = p->entries;
    for (uint32_t i = 0; i < plan->soft.count; i++)
        records += records_of(p, i, &part);
    if (records > PART_RECORDS && part.rows[1] - part.rows[0] > LEAST_ROWS) {
        struct pt_soft_part half[2] = {part, part};
        half[0].rows[1] = half[1].rows[0] = part.rows[0] + pt_round_up((part.rows[1] - part.rows[0]) / 2, LEAST_ROWS);
        const int error = place_part(p, half[0]);
        return error || half[1].rows[0] >= half[1].rows[1] ? error : place_part(p, half[1]);
    }
    if (records >= 1u << 26) // bins are counted by 16 bytes, and lists by 32 bits
        return pt_fail(&p->scene->handle, PATINA_ERROR_MEMORY,
                       "%llu soft points lie behind one another in %u rows: render in regions", (unsigned long long)records,
                       part.rows[1] - part.rows[0]);
    uint32_t placed = 0;
    for (uint32_t i = 0; i < plan->soft.count && records; i++) {
        const uint64_t own = records_of(p, i, &part);
        if (own && p->filling && fill_entry(p, i, &part, placed))
            return PATINA_ERROR_MEMORY;
        placed += (uint32_t)own;
        p->entries += own > 0;
    }
    part.count = p->entries - part.first;
    part.records = placed;
    if (placed && p->filling)
        plan->soft.parts[plan->soft.part_count] = part;
    plan->soft.part_count += placed > 0;
    plan->soft.records = placed > plan->soft.records ? placed : plan->soft.records;
    return PATINA_OK;
}

static int place_parts(struct placing *p, const float *ends, uint32_t count)
{
    uint32_t drawn[4];
    int error = PATINA_OK;
    drawn_rect(p->plan, drawn);
    p->entries = p->plan->instance_count + p->plan->soft.count;
    p->plan->soft.part_count = 0;
    for (uint32_t k = count + 1; k-- > 0 && !error;) // the farthest first
        error = place_part(p, (struct pt_soft_part){.rows = {drawn[1], drawn[3]},
                                                    .z_from = k ? ends[k - 1] : -1.0f,
                                                    .z_to = k < count ? ends[k] : INFINITY});
    return error;
}

int pt_place_soft(const struct patina_scene *scene, struct pt_plan *plan, const struct pt_eye *eye)
{
    struct placing p = {.scene = scene, .plan = plan, .eye = eye};
    uint32_t instances = 0;
    uint64_t chunks = 0;
    float ends[MOST_SLABS];
    for (uint32_t i = 0; i < scene->cloud_count; i++) {
        instances += (uint32_t)pt_has_balls(&scene->instances[i].style);
        chunks += pt_has_balls(&scene->instances[i].style) ? pt_chunks_there(scene->instances[i].cloud) : 0;
    }
    if (!instances)
        return PATINA_OK;
    p.whole = pt_arena_take(&plan->arena, (instances + 1) * sizeof *p.whole);
    p.depths = pt_arena_take(&plan->arena, (instances + 1) * sizeof *p.depths);
    p.seen = pt_arena_take(&plan->arena, (chunks + 1) * sizeof *p.seen);
    if (!p.whole || !p.depths || !p.seen)
        return PATINA_ERROR_MEMORY;
    int error = PATINA_OK;
    for (uint32_t i = 0; i < scene->cloud_count && !error; i++)
        if (pt_has_balls(&scene->instances[i].style))
            error = place_instance(&p, i);
    plan->soft.depths[0] = INFINITY;
    plan->soft.depths[1] = -INFINITY;
    for (uint32_t i = 0; i < p.seen_count; i++) {
        plan->soft.depths[0] = fminf(plan->soft.depths[0], p.seen[i].before);
        plan->soft.depths[1] = fmaxf(plan->soft.depths[1], p.seen[i].beyond);
    }
    const uint32_t count = error || !plan->soft.count ? 0 : slab_ends(&p, ends);
    if (error || !plan->soft.count || (error = place_parts(&p, ends, count)))
        return error;
    struct pt_plan_instance *grown = pt_arena_take(&plan->arena, (p.entries + 1) * sizeof *grown);
    plan->soft.parts = pt_arena_take(&plan->arena, (plan->soft.part_count + 1) * sizeof *plan->soft.parts);
    if (!grown || !plan->soft.parts)
        return PATINA_ERROR_MEMORY;
    memcpy(grown, plan->instances, plan->instance_count * sizeof *grown);
    memcpy(grown + plan->instance_count, p.whole, plan->soft.count * sizeof *grown);
    plan->instances = grown;
    p.filling = 1;
    error = place_parts(&p, ends, count);
    plan->soft.entries = p.entries - plan->instance_count;
    return error;
}

// ---- passes --------------------------------------------------------------------------------------------------------------

static const struct {
    const char *name;
    uint32_t model;
} models[] = {[PATINA_SOFT_BASE] = {"Base", PT_SOFT_BASE},
              [PATINA_SOFT_CONCENTRIC] = {"Concentric", PT_SOFT_CONCENTRIC},
              [PATINA_SOFT_EXPRESS] = {"Express", PT_SOFT_EXPRESS},
              [PATINA_SOFT_SPLATS] = {"Splats", PT_SOFT_SPLATS},
              [PATINA_SOFT_ONE_LAYER] = {"One Layer", PT_SOFT_ONE_LAYER}};

static void plan_gather(struct pt_builder *builder, uint32_t i)
{
    const struct pt_plan *plan = builder->plan;
    const struct pt_plan_instance *instance = &plan->instances[i];
    const patina_cloud_style *style = &instance->instance->style;
    struct gather_args args = {.radius_scale = instance->as.balls.radius_scale,
                               .opacity = style->soft_opacity,
                               .within = 1,
                               .sifted = plan->drawn_words > 0};
    pt_shade_lights(builder, pt_receives(instance->instance), &args.shade);
    args.shade.view = plan->view;
    args.shade.instance = instance->args;
    args.shade.arrived = 0;
    if (plan->map) // colours are of no use
        args.shade.instance.lit = 0;
    else
        pt_plan_recolor(builder, instance, &args.shade);
    if (!args.shade.instance.lit)
        pt_without_lights(&args.shade);
    const struct pt_soft_code code = pt_soft_code(
        instance->instance->cloud, style->soft == PATINA_SOFT_FIELD ? style->field : NULL, style->soft_radius > 0.0f);
    args.whole = code.whole;
    args.radius_base = code.base;
    args.radius_step = code.step;
    const enum pt_late late = pt_shade_late(&args.shade, PT_LATE_POINTS);
    args.threshold = style->soft == PATINA_SOFT_FIELD ? pt_field_steps(style->soft_threshold) : 0;
    if (style->soft_modulation > 0.0f) // without a field all is 1
        args.weight = style->soft == PATINA_SOFT_FIELD ? fminf(1.0f / (style->soft_modulation * PT_FIELD_MOST), 1.0f)
                                                       : fmaxf((1.0f - style->soft_modulation) / PT_FIELD_MOST, 1e-12f);
    struct pt_ref refs[8 + PT_KIND_BUFFERS] = {pt_plane_at(PT_PLANE_SOFT_POINTS, 0)};
    uint32_t count = 1 + pt_bind_kind(PT_AS_SOFT, i, refs + 1);
    refs[count++] = pt_field_of(instance, i);
    refs[count++] = pt_colors_of(instance, i, &args.shade.recolor);
    refs[count++] = pt_buffer_of(PT_OPACITIES, i);
    refs[count++] = late ? pt_buffer_of(PT_SHADOWS, instance->of) : pt_nothing();
    refs[count++] = args.sifted ? pt_buffer_of(PT_DRAWN, 0) : pt_nothing();
    refs[count++] = pt_light_of(builder, &args.shade);
    refs[count++] = pt_ramps_of(&args.shade);
    struct pt_pass *pass = pt_add(builder, PT_KERNEL_gather, "gather", &args, sizeof args, refs, count);
    pass->late = late;
    PT_REASON(pass, "%llu soft points of instance %u, %s", (unsigned long long)instance->points, instance->of,
              args.shade.instance.lit ? "lit" : "unlit");
}

// Where what a part draws goes.
enum into {
    BEFORE,  // the picture: what lies before the first layer
    BETWEEN, // what lies over: between the layer before and the one at hand
    BEYOND   // the same, whatever the last one covers
};

static const char *const places[] = {"in front", "between layers", "behind all"};

static struct soft_args part_args(const struct pt_plan *plan, const struct pt_soft_part *part, enum into into)
{
    const patina_cloud_style *style = &plan->instances[part->first].instance->style;
    struct soft_args args = {.view = plan->view,
                             .records = part->records,
                             .model = models[style->soft_model].model,
                             .mu = PT_SOFT_EVEN,
                             .shells = style->soft_shells,
                             .z_from = part->z_from,
                             .z_to = part->z_to,
                             .layered = (uint32_t)into,
                             .crop_x = plan->crop[0],
                             .crop_y = plan->crop[1],
                             .crop_width = plan->crop[2]};
    drawn_rect(plan, args.view.rect);
    args.view.rect[1] = part->rows[0];
    args.view.rect[3] = part->rows[1];
    return args;
}

static void plan_gathers(struct pt_builder *builder, const struct pt_soft_part *part)
{
    for (uint32_t k = 0; k < part->count; k++)
        plan_gather(builder, part->first + k);
}

// counted: for the density's pass.
static void plan_part(struct pt_builder *builder, uint32_t number, enum into into, int counted)
{
    const struct pt_plan *plan = builder->plan;
    const struct pt_soft_part *part = &plan->soft.parts[number];
    struct soft_args args = part_args(plan, part, into);
    args.density = counted ? 2 : 0;
    if (plan->soft.part_count > 1 || (into == BEFORE && plan->layers == 1)) // else they are there since the first layer
        plan_gathers(builder, part);
    PT_REASON(
        PT_ADD(builder, soft, args,
               {into == BETWEEN ? pt_keys_of(builder, 0) : pt_plane_at(PT_PLANE_KEYS, 0), pt_plane_at(PT_PLANE_SOFT_POINTS, 0),
                pt_plane_at(PT_PLANE_SOFT_BINS, 0), pt_plane_if(into != BEFORE, PT_PLANE_SOFT_REACHED, 0),
                pt_plane_at(into == BEFORE ? PT_PLANE_COMBINED : PT_PLANE_OVER, 0), pt_plane_if(counted, PT_PLANE_DENSITY, 0),
                pt_nothing()}),
        "%s %s, part %u of %u, z %.3g to %.3g, rows %u to %u: %u records",
        models[plan->instances[part->first].instance->style.soft_model].name, places[into], number + 1, plan->soft.part_count,
        fmax((double)part->z_from, 0.0), (double)part->z_to, part->rows[0] - plan->crop[1], part->rows[1] - plan->crop[1],
        part->records);
}

// What lies behind the layer at hand lies behind its keys.
static void plan_reached(struct pt_builder *builder)
{
    const struct pt_plan *plan = builder->plan;
    struct soft_args args = part_args(plan, &plan->soft.parts[0], BETWEEN);
    args.records = 0;
    args.last = 1;
    args.view.rect[1] = plan->crop[1];
    args.view.rect[3] = plan->crop[1] + plan->crop[3];
    PT_REASON(PT_ADD(builder, soft, args,
                     {pt_keys_of(builder, 0), pt_plane_at(PT_PLANE_SOFT_POINTS, 0), pt_plane_at(PT_PLANE_SOFT_BINS, 0),
                      pt_plane_at(PT_PLANE_SOFT_REACHED, 0), pt_plane_at(PT_PLANE_OVER, 0), pt_nothing(), pt_nothing()}),
              "how far layer %u reaches", builder->layer);
}

void pt_plan_soft_layer(struct pt_builder *builder)
{
    const struct pt_plan *plan = builder->plan;
    if (plan->layers == 1 || !plan->soft.part_count)
        return;
    if (builder->layer == 1 && plan->soft.part_count == 1)
        plan_gathers(builder, &plan->soft.parts[0]);
    for (uint32_t k = plan->soft.part_count; k-- > 0 && builder->layer > 1;) // the nearest first
        plan_part(builder, k, BETWEEN, 0);
    plan_reached(builder);
}

void pt_plan_soft_beyond(struct pt_builder *builder)
{
    for (uint32_t k = builder->plan->soft.part_count; k-- > 0 && builder->plan->layers > 1;)
        plan_part(builder, k, BEYOND, 0);
}

void pt_plan_soft(struct pt_builder *builder)
{
    struct pt_plan *plan = builder->plan;
    const int counted = pt_counts_soft(builder);
    uint32_t soft = 0;
    for (uint32_t i = 0; i < builder->scene->cloud_count; i++)
        soft += (uint32_t)pt_has_balls(&builder->scene->instances[i].style);
    if (!plan->soft.part_count) {
        const char *reason = soft ? "no soft cloud is in view" : "no cloud is soft";
        pt_skip(builder, "gather", reason);
        pt_skip(builder, "soft", reason);
    }
    plan->assessed |= (uint32_t)counted << PATINA_PASS_DENSITY;
    for (uint32_t k = 0; k < plan->soft.part_count; k++)
        plan_part(builder, k, BEFORE, counted);
}

// ---- of lights' maps -----------------------------------------------------------------------------------------------------

static void plan_veil(struct pt_builder *builder, const struct pt_soft_part *part, int last)
{
    const struct pt_plan *plan = builder->plan;
    struct soft_args args = part_args(plan, part, BEFORE);
    args.model = args.model >= PT_SOFT_SPLATS ? PT_SOFT_EXPRESS : args.model; // what is nearest says nothing of depth
    args.veils = plan->soft.veils;
    args.veil_from = plan->soft.depths[0];
    args.veil_deep = pt_veil_deep(plan);
    args.last = (uint32_t)last;
    if (last) {
        drawn_rect(plan, args.view.rect);
        args.records = 0;
    }
    struct pt_pass *pass = PT_ADD(builder, soft, args,
                                  {pt_plane_at(PT_PLANE_KEYS, 0), pt_plane_at(PT_PLANE_SOFT_POINTS, 0),
                                   pt_plane_at(PT_PLANE_SOFT_BINS, 0), pt_nothing(), pt_nothing(), pt_nothing(),
                                   pt_plane_at(PT_PLANE_VEIL, 0)});
    if (last)
        PT_REASON(pass, "what comes through up to the end of each slab");
    else
        PT_REASON(pass, "what %u records take of the light in %u slabs", part->records, plan->soft.veils);
}

void pt_plan_veil(struct pt_builder *builder)
{
    const struct pt_plan *plan = builder->plan;
    pt_plan_sift(builder);
    for (uint32_t k = 0; k < plan->soft.part_count; k++) {
        plan_gathers(builder, &plan->soft.parts[k]);
        plan_veil(builder, &plan->soft.parts[k], 0);
    }
    plan_veil(builder, &plan->soft.parts[0], 1);
}
