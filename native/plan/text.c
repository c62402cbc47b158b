// SPDX-License-Identifier: GPL-3.0-or-later
// What a plan says of itself: its planes' sizes, which of them readers see, and all of it in words.
#include "passes.h"
#include "rounds.h"
#include "scene/clip.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

int pt_plan_writes(const struct pt_plan *plan, enum pt_plane plane)
{
    for (uint32_t i = 0; i < plan->pass_count; i++)
        for (uint32_t k = 0; k < plan->passes[i].ref_count && plan->passes[i].output; k++)
            if (plan->passes[i].refs[k].of == PT_OF_FRAME && plan->passes[i].refs[k].which == (uint32_t)plane)
                return 1;
    return 0;
}

void pt_plan_plane_size(const struct pt_plan *plan, enum pt_plane which, uint32_t level, uint32_t size[2])
{
    const struct pt_plane_row *row = &pt_plane_rows[which];
    if (row->size == PT_SIZE_CROP) {
        size[0] = plan->crop[2];
        size[1] = plan->crop[3];
        return;
    }
    if (row->size == PT_SIZE_RECORDS || row->size == PT_SIZE_BINS) {
        size[0] = row->size == PT_SIZE_RECORDS ? plan->soft.records
                                               : PT_SOFT_BINS_HEAD + PT_SOFT_BINS_EACH * plan->soft.records;
        size[1] = 1;
        return;
    }
    if (row->size == PT_SIZE_CELLS || row->size == PT_SIZE_DISCS) {
        size[0] = row->size == PT_SIZE_CELLS ? plan->ranges.cells : plan->discs.bins;
        size[1] = 1;
        return;
    }
    struct view_args view = pt_view_at(plan, row->slots == PT_SLOTS_LEVELS || row->size == PT_SIZE_TILES ? level : 0);
    size[0] = view.width * (row->size == PT_SIZE_VEILS ? plan->soft.veils : 1);
    size[1] = view.height * (row->size == PT_SIZE_LIGHTS ? plan->light_count : 1);
}

// ---- in words ------------------------------------------------------------------------------------------------------------

struct text {
    char *to; // NULL: is only measured
    size_t size, length;
};

__attribute__((format(printf, 3, 4))) static void put_line(struct text *text, uint32_t depth, const char *format, ...)
{
    const size_t left = text->to && text->length < text->size ? text->size - text->length : 0;
    char line[256];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    text->length += (size_t)snprintf(left ? text->to + text->length : NULL, left, "%*s%s\n", (int)(2 * depth), "", line);
}

// ", in 3 rounds of 2.1 MB": of a pass that reads more of mapped files than a round may.
static const char *rounds_of(const struct pt_plan *plan, const struct pt_pass *pass, char *buffer, size_t size)
{
    const int divided = plan->round_bytes && (plan->copied || pt_pass_divides(pass));
    struct pt_chunk_list *lists = divided ? calloc(pass->ref_count + 1u, sizeof *lists) : NULL;
    const uint32_t count = lists ? pt_pass_lists(plan, pass, lists) : 0;
    uint64_t bytes = 0;
    uint32_t rounds = plan->copied ? pt_count_copies(lists, count, plan->round_bytes, &bytes)
                                   : pt_count_ranges(lists, count, plan->round_bytes, &bytes);
    free(lists);
    snprintf(buffer, size, ", in %u rounds for %.1f MB", rounds, 1e-6 * (double)bytes);
    return rounds > 1 ? buffer : "";
}

static void put_passes(struct text *text, const struct pt_plan *plan, uint32_t first, uint32_t count, uint32_t depth)
{
    char rounds[64];
    for (uint32_t i = first; i < first + count; i++)
        put_line(text, depth, "run  %-10s %s%s", pt_kernels[plan->passes[i].kernel].name, plan->passes[i].reason,
                 rounds_of(plan, &plan->passes[i], rounds, sizeof rounds));
}

// "at most 5, until a layer is empty: reason"
static void put_loop(struct text *text, const char *name, const struct pt_step *step, const char *reason, uint32_t depth)
{
    static const char *const ends[] = {"a layer is empty", "no light is left", "nothing changes", "the error is met"};
    char when[128] = "";
    for (uint32_t k = 0, length = 0; k < 4 && length < sizeof when; k++)
        if (step->ends >> k & 1u)
            length += (uint32_t)snprintf(when + length, sizeof when - length, "%s%s", length ? " or " : ", until ", ends[k]);
    if (step->most)
        put_line(text, depth, "loop %-10s at most %u%s: %s", name, step->most, when, reason);
    else
        put_line(text, depth, "loop %-10s %s", name, reason);
}

static void put_steps(struct text *text, const struct patina_scene *scene, const struct pt_plan *plan,
                      const struct pt_step *step, const struct pt_step *end, uint32_t depth);

// The first of the maps that the step stands for; where the light sees nothing there, the next face's.
static void put_map(struct text *text, const struct patina_scene *scene, const struct pt_plan *plan, const struct pt_step *step,
                    uint32_t depth)
{
    struct pt_round round = {.light = step->light, .group = step->group, .points = 1, .pixels = plan->mesh.shadows};
    struct pt_plan map;
    put_line(text, depth, "plan %-10s %s%s", "map", step->reason, step->layer > 1 ? ", as of layer 1" : "");
    if (step->layer > 1)
        return;
    for (int some = 0; !some && round.face < pt_light_faces(plan, step->light); round.face++) {
        if (!pt_plan_tested(scene, plan, &round, step->group) || pt_plan_map(scene, plan, &round, &map))
            return; // without memory it stays untold
        if ((some = map.step_count > 0)) {
            map.round_bytes = plan->round_bytes;
            map.copied = plan->copied;
            put_line(text, depth + 1, "planes %u x %u, %u coarse levels, %llu points, %llu triangles", map.view.width,
                     map.view.height, map.levels, (unsigned long long)map.points_scattered,
                     (unsigned long long)map.mesh.triangles);
            put_steps(text, scene, &map, map.steps, map.steps + map.step_count, depth + 1);
        }
        pt_plan_destroy(&map);
    }
}

static void put_step(struct text *text, const struct patina_scene *scene, const struct pt_plan *plan,
                     const struct pt_step *step, uint32_t depth)
{
    switch (step->of) {
    case PT_STEP_CLEAR: put_line(text, depth, "fill %-10s %s", pt_plane_rows[step->plane.which].name, step->reason); break;
    case PT_STEP_PASSES: put_passes(text, plan, step->first, step->count, depth); break;
    case PT_STEP_MARK:
        put_line(text, depth, "only %s", step->reason);
        put_passes(text, plan, step->first, step->count, depth + 1);
        break;
    case PT_STEP_COVERED: put_line(text, depth, "read %-10s %s", pt_plane_rows[PT_PLANE_TILES].name, step->reason); break;
    case PT_STEP_LAYERS: put_loop(text, "layers", step, step->reason, depth); break;
    case PT_STEP_LAYER: put_line(text, depth, "layer %u: %s", step->layer, step->reason); break;
    case PT_STEP_LIGHT:
        put_line(text, depth, "light %u: %s", step->light, plan->lights[step->light].reason);
        put_loop(text, "samples", step, step->reason, depth);
        break;
    case PT_STEP_FACES: put_loop(text, "faces", step, step->reason, depth); break;
    case PT_STEP_FAINT: put_loop(text, "faint", step, step->reason, depth); break;
    case PT_STEP_MAP: put_map(text, scene, plan, step, depth); break;
    case PT_STEP_CLOSE: put_line(text, depth, "plan %-10s %s", "close", step->reason); break;
    }
}

static void put_steps(struct text *text, const struct patina_scene *scene, const struct pt_plan *plan,
                      const struct pt_step *step, const struct pt_step *end, uint32_t depth)
{
    for (; step < end; step = pt_step_after(step)) {
        put_step(text, scene, plan, step, depth);
        put_steps(text, scene, plan, step + 1, pt_step_after(step), depth + 1);
    }
}

// Slabs of memory with the planes that lie in them one after another, from a time to a time.
static void put_memory(struct text *text, const struct pt_plan *plan)
{
    put_line(text, 0, "memory %.1f MB of planes at most: %u of them share %u slabs", 1e-6 * (double)plan->peak,
             plan->life_count, plan->slab_count);
    for (uint32_t s = 0; s < plan->slab_count; s++) {
        char names[512];
        size_t length = 0;
        for (uint32_t i = 0; i < plan->life_count; i++) {
            const struct pt_life *life = &plan->lives[i];
            if (life->slab == s && length + 64 < sizeof names)
                length += (size_t)snprintf(names + length, sizeof names - length, ", %s %u (%u to %u)",
                                           pt_plane_rows[life->plane].name, life->index, life->first, life->last);
        }
        put_line(text, 1, "slab %.1f MB: %s", 1e-6 * (double)plan->slabs[s].bytes, names + 2);
    }
}

size_t pt_plan_text(const struct patina_scene *scene, struct pt_plan *plan, char *buffer, size_t size)
{
    struct text text = {buffer, size, 0};
    uint64_t untrusted = 0, none_trusted = 0;
    for (uint32_t i = 0; i < plan->light_count; i++)
        pt_plan_light_text(scene, plan, i); // without memory it stays untold
    put_line(&text, 0, "planes %u x %u, crop %u x %u at %u, %u, %u coarse levels", plan->view.width, plan->view.height,
             plan->crop[2], plan->crop[3], plan->crop[0], plan->crop[1], plan->levels);
    put_line(&text, 0, "expected error: colour %.4f of white, coverage %.4f, depth %.2f spacings, normals %.2f degrees (%s)",
             (double)plan->expected.color, (double)plan->expected.coverage, (double)plan->expected.depth,
             (double)plan->expected.normal, pt_means_name(plan->means));
    put_line(&text, 0, "points %llu, scattered %llu, chunks %llu, culled %llu", (unsigned long long)plan->points,
             (unsigned long long)plan->points_scattered, (unsigned long long)plan->chunks,
             (unsigned long long)plan->chunks_culled);
    for (uint32_t i = 0; i < scene->cloud_count; i++) {
        untrusted += pt_untrusted(&scene->instances[i]);
        none_trusted += pt_none_trusted(&scene->instances[i]);
    }
    if (untrusted)
        put_line(&text, 0, "untrusted points left out %llu", (unsigned long long)untrusted);
    if (none_trusted)
        put_line(&text, 0, "untrusted points drawn, for no other is in their cloud %llu", (unsigned long long)none_trusted);
    if (plan->chunks_clipped || plan->chunks_cut)
        put_line(&text, 0, "chunks clipped %llu, cut %llu", (unsigned long long)plan->chunks_clipped,
                 (unsigned long long)plan->chunks_cut);
    if (plan->mapped_cap)
        put_line(&text, 0, "rounds of at most %.1f MB: %s are larger than the %.1f MB that may be held of them",
                 1e-6 * (double)plan->round_bytes, plan->copied ? "clouds" : "clouds in files",
                 1e-6 * (double)plan->mapped_cap);
    if (plan->peak)
        put_memory(&text, plan);
    put_steps(&text, scene, plan, plan->steps, plan->steps + plan->step_count, 0);
    for (uint32_t i = 0; i < plan->skipped_count; i++)
        put_line(&text, 0, "skip %-10s %s", plan->skipped[i].name, plan->skipped[i].reason);
    return text.length;
}
