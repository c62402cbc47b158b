// SPDX-License-Identifier: GPL-3.0-or-later
// How the camera sees the scene: matrices in float64 up to the chunk-to-screen product (DESIGN rule 6), chunks culled by
// box and normal cone, local spacing on screen, and from it the window of pixels that the planes hold.
//
// Planes reach a guard G beyond the picture, so that holes at its border fill as elsewhere. All pixel coordinates in kernels
// are of this padded picture. A region's planes reach as far beyond it as filters can carry anything, at most to the padded
// picture's edge: a region is a crop of the whole, to the bit (SPEC 2.5).
#include "plan.h"

#include "detail.h"
#include "expected.h"
#include "eye.h"
#include "lines.h"
#include "pages.h"
#include "ranges.h"
#include "scene/clip.h"
#include "scene/clouds/clusters.h"
#include "scene/clouds/paged.h"
#include "base/elementary.h"
#include "base/pool.h"
#include "shared/discs.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// Half an axis of a footprint, pixels, from which on points are discs: narrower ones are closed by filling as well, in a third of
// the time. Nine of ten random points 2.3 pixels apart stay below. At 1.9 a million points on a torus take three times as long,
// virtual scans 1.5 times, and these show 20.7 dB in place of 20.0.
#define WIDE_FOOTPRINT 4.0
// Spacing on screen, pixels, from which on they are discs whatever their footprints: farther apart, four iterations leave gaps that
// show what lies behind, in 6 % of a patch of a carved relief whose points lie 2.6 pixels apart.
#define SPARSE 2.1

// One chunk in view, before it is known which window the planes get.
struct seen {
    uint32_t chunk;
    uint32_t cull, away;     // test each point's normal; every point faces away
    struct pt_extent extent; // on screen in pixels of the picture without its padding
    double spacing_px, area_px;
    uint32_t wide; // its points are discs
    double tiles;  // that one of these touches, PT_DISC_LARGE at most
};

// ---- culling -----------------------------------------------------------------------------------------------------------

enum facing { FACES_AWAY, FACES_BOTH, FACES_US };

// How the chunk's normals lie towards the eye, by their cone: the angle between its axis and the direction to the eye, and
// how far any normal and direction may be from these; a thousandth of a radian of caution. 0 when nothing is known.
static int chunk_angles(const struct pt_chunk *chunk, const double eye[4], double *angle, double *spread)
{
    double towards[3], radius = 0.0, axis[3];
    if (chunk->cone_cosine < -1.0f)
        return 0; // a point has no normal
    for (int k = 0; k < 3; k++) {
        double half = 0.5 * ((double)chunk->box_max[k] - (double)chunk->box_min[k]);
        double middle = 0.5 * ((double)chunk->box_max[k] + (double)chunk->box_min[k]);
        towards[k] = eye[k] - eye[3] * middle;
        radius += half * half;
        axis[k] = (double)chunk->cone_axis[k];
    }
    double distance = sqrt(pt_dot(towards, towards));
    radius = eye[3] > 0.0 ? sqrt(radius) : 0.0;
    if (!(distance > radius))
        return 0;
    *angle = pt_acos(pt_most(pt_least(pt_dot(axis, towards) / distance, 1.0), -1.0));
    *spread = pt_acos(pt_most((double)chunk->cone_cosine, -1.0)) + pt_asin(radius / distance) + 1e-3;
    return 1;
}

static const double right_angle = 1.57079632679489661923;

static enum facing chunk_facing(int known, double angle, double spread)
{
    return !known                         ? FACES_BOTH
           : angle + spread < right_angle ? FACES_US
           : angle - spread > right_angle ? FACES_AWAY
                                          : FACES_BOTH;
}

// The largest |n.v| that the chunk may show: a tilted surface has more points a pixel by 1 / |n.v|.
static double chunk_cosine(int known, double angle, double spread)
{
    if (!known)
        return 1.0;
    angle = angle > right_angle ? 2.0 * right_angle - angle : angle;
    return pt_most(pt_cos(pt_most(angle - spread, 0.0)), (double)PT_COSINE_FLOOR);
}

// ---- the chunks in view ------------------------------------------------------------------------------------------------

struct cells { // of an instance that is drawn as range images; count 0: it is not
    struct pt_spread spread;
    double pixels[PT_RANGE_FINER + 1];
    uint32_t count;
};

// Chunks of a cloud that one thread looks at; what it finds of them.
enum { CHUNKS_AT_ONCE = 8 * PT_CLUSTER };

struct looked {
    int last;          // it is none
    struct seen *list; // the survey's own; NULL: none is in view
    uint32_t count;
    uint64_t first, end; // slots of those in view
    uint64_t clipped;
    int points, discs; // as of a survey
    struct pt_detail detail;
    int error;
};

struct survey {
    struct pt_eye camera;
    struct pt_sieve *sieves; // per instance
    struct pt_object *objects;
    struct looked **looked; // per instance: its blocks, in order, and one behind them
    uint32_t *seen_count;
    int points, discs;   // some chunk's points are drawn as such
    struct cells *cells; // per instance
    struct pt_detail *details;
    double *thinned; // per instance: how much farther apart than its cloud's the points that are drawn lie
};

static int is_transparent(const struct pt_instance *instance)
{
    return instance->style.transparency > 0.0f || instance->cloud->info.has_opacities;
}

// Of views up to 90 degrees: they are as they were measured, a million points on a torus are filled and not discs.
#define USUAL_STRETCH 1.5

// How much wider than usual the view draws outward what it sees away from its middle, 1 / cosine of the angle to it, at the place of the
// box that is farthest out and in the picture; depth: the z there, of a place as far from the eye as the box's middle.
static double stretch_of(const struct pt_eye *camera, const struct pt_extent *extent, double *depth)
{
    double middle = 1.0, out = 1.0;
    for (int k = 0; k < 2; k++) {
        const double size = k ? camera->height : camera->width, start = k ? camera->bottom : camera->left,
                     step = k ? camera->ys : camera->xs;
        const double low = start + step * pt_least(pt_most(extent->rect[k], 0.0), size);
        const double high = start + step * pt_least(pt_most(extent->rect[2 + k], 0.0), size);
        const double farther = pt_most(fabs(low), fabs(high));
        middle += 0.25 * (low + high) * (low + high);
        out += farther * farther;
    }
    *depth = camera->orthographic ? 1.0 : extent->z_middle * pt_least(USUAL_STRETCH * sqrt(middle / out), 1.0);
    return camera->orthographic ? 1.0 : pt_most(sqrt(out) / USUAL_STRETCH, 1.0);
}

// Pixels beyond the picture that are looked at: whatever the guard will be, the same is seen. It is seldom more.
enum { AROUND = 160, FARTHEST_FACE = 96 };

struct look {
    const struct patina_scene *scene;
    const struct pt_plan *plan;
    const struct survey *survey;
    const struct pt_instance *instance;
    struct pt_looking looking; // but for the detail, of which each has its own
    int cull, layered;
    uint32_t of; // the instance's number
};

// Whether it is in view; what of it is clipped is counted.
static int look_at_chunk(const struct look *look, struct looked *block, const struct pt_chunk *chunk, struct seen *seen)
{
    const struct pt_eye *camera = look->looking.camera;
    const struct pt_object *object = &look->survey->objects[look->of];
    const int ranges = look->looking.kind == PT_AS_RANGES, discs = look->looking.kind == PT_AS_DISCS;
    double translation[3], eye[4], angle = 0.0, spread = 0.0;
    if (pt_sieve_chunk(look->looking.sieve, chunk, NULL, NULL) == PT_CUT_AWAY) {
        block->clipped++;
        return 0;
    }
    pt_chunk_eye(object, chunk, eye);
    int known = !object->singular && chunk_angles(chunk, eye, &angle, &spread);
    enum facing facing = chunk_facing(known, angle, spread);
    if (look->cull && facing == FACES_AWAY)
        return 0;
    pt_chunk_translation(camera, object, chunk, translation);
    if (!pt_kind_bounds(camera, look->looking.kind, look->looking.what, chunk, look->looking.rows, translation, &seen->extent))
        return 0;
    const double pixel = pt_most(camera->xs, camera->ys), middle = seen->extent.z_middle;
    const double before = camera->orthographic ? 1.0 : pt_most(seen->extent.z_before, 0.0);
    double left_out, rim;
    if (!pt_detail_draws(&block->detail, chunk, pixel * before / object->scale, &left_out))
        return 0;
    pt_paged_look(look->instance->cloud, seen->chunk);
    const double stretch = stretch_of(camera, &seen->extent, &rim);
    for (int k = 0; k < 4; k++)
        seen->extent.rect[k] -= AROUND;
    seen->cull = look->cull && facing == FACES_BOTH;
    seen->away = facing == FACES_AWAY && !look->layered && !ranges;
    double footprint = pixel * (camera->orthographic ? 1.0 : middle);
    // a lamp sees a plate before a floor in one chunk: light leaks where the nearer of both has holes
    double nearest = look->plan->map && !camera->orthographic
                         ? pixel * pt_most(2.0 * middle - seen->extent.z_beyond, 0.5 * middle)
                         : footprint;
    uint32_t count = pt_drawn_points(look->scene, chunk);
    double thinned = left_out * sqrt((double)chunk->count / count);
    // range images need no analysis, so that none may change them: nor may the normals that it finds
    seen->spacing_px = ranges ? thinned * (double)chunk->built * object->scale / nearest
                              : thinned * (double)chunk->spacing * object->scale / nearest *
                                    sqrt(chunk_cosine(known, angle, spread));
    // of a chunk around the camera the most lies elsewhere, and none covers more than the picture
    seen->area_px = pt_least(seen->extent.share * count * seen->spacing_px * seen->spacing_px, camera->width * camera->height);
    const double reach = discs ? pt_usual_disc(look->looking.what, chunk) * stretch : 0.0;
    const double finer = pt_finer(look->scene); // samples show the same surface
    seen->wide = ranges || look->scene->settings.surface == PATINA_SURFACE_SPLATS ||
                 reach > WIDE_FOOTPRINT * finer * pixel * rim ||
                 (reach > 0.0 && seen->spacing_px > left_out * SPARSE * finer);     // the same as of all points
    const double across = 1.0 + (2.0 * reach / (pixel * rim) + 2.0) / PT_DISC_TILE; // few are wider than reach
    seen->tiles = pt_least(across * across, PT_DISC_LARGE);
    return 1;
}

static void look_at_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct look *look = context;
    const struct patina_cloud *cloud = look->instance->cloud;
    const struct pt_cluster *clusters = pt_sieves(look->looking.sieve) ? NULL : cloud->clusters; // what clips take is counted
    (void)thread;
    for (uint32_t i = begin; i < end; i++) {
        struct looked *block = &look->survey->looked[look->of][i];
        struct pt_looking looking = look->looking;
        looking.detail = &block->detail;
        const uint64_t last = (uint64_t)(i + 1) * CHUNKS_AT_ONCE;
        const uint32_t stop = last < cloud->chunk_count ? (uint32_t)last : cloud->chunk_count;
        for (uint32_t c = i * CHUNKS_AT_ONCE; (c = pt_chunk_from(cloud, c)) < stop; c++) {
            const struct pt_cluster *cluster = clusters && c % PT_CLUSTER == 0 ? &clusters[c / PT_CLUSTER] : NULL;
            struct seen seen = {.chunk = c};
            if (cluster && cluster->known && pt_is_out(&looking, &cluster->around)) {
                c += PT_CLUSTER - 1;
                continue;
            }
            if (!look_at_chunk(look, block, &cloud->chunks[c], &seen))
                continue;
            if (!block->list && !(block->list = malloc((stop - c) * sizeof seen))) {
                block->error = PATINA_ERROR_MEMORY;
                break;
            }
            const uint64_t first = cloud->chunks[c].first, after = first + cloud->chunks[c].padded;
            block->first = !block->count || first < block->first ? first : block->first;
            block->end = after > block->end ? after : block->end;
            block->points |= !seen.wide;
            block->discs |= seen.wide && looking.kind != PT_AS_RANGES;
            block->list[block->count++] = seen;
        }
    }
}

// Chunks in view, in their order. at: {0} at first. NULL: there are no more.
struct place {
    uint32_t block, seen;
};

static const struct seen *next_seen(const struct survey *survey, uint32_t i, struct place *at)
{
    const struct looked *block = &survey->looked[i][at->block];
    while (!block->last && at->seen == block->count) {
        *at = (struct place){at->block + 1, 0};
        block++;
    }
    return block->last ? NULL : &block->list[at->seen++];
}

static void survey_free(struct survey *survey, uint32_t instances)
{
    for (uint32_t i = 0; i < instances && survey->looked; i++)
        for (struct looked *block = survey->looked[i]; block && !block->last; block++)
            free(block->list);
}

static int look_at_instance(const struct patina_scene *scene, struct pt_plan *plan, struct survey *survey, uint32_t i)
{
    const struct pt_instance *instance = &scene->instances[i];
    const struct patina_cloud *cloud = instance->cloud;
    const struct pt_eye *camera = &survey->camera;
    struct pt_object *object = &survey->objects[i];
    int transparent = is_transparent(instance);
    pt_object_of(camera, instance->style.world_from_object, object);
    struct pt_inverse_clip *clips = pt_arena_take(&plan->arena, (scene->clip_count + 1) * sizeof *clips);
    const uint32_t chunks = instance->style.transparency < 1.0f && !pt_all_soft(instance) ? cloud->chunk_count : 0;
    const uint32_t count = chunks / CHUNKS_AT_ONCE + (chunks % CHUNKS_AT_ONCE > 0);
    struct looked *blocks = survey->looked[i] = pt_arena_take(&plan->arena, (count + 1) * sizeof *blocks);
    if (blocks)
        blocks[count].last = 1;
    if (!clips || !blocks)
        return PATINA_ERROR_MEMORY;
    survey->sieves[i] = pt_sieve_make(scene, instance, PT_SOLID_POINTS, clips);
    const struct pt_to_place what = {scene, instance, object};
    double rows[9];
    pt_object_rows(camera, object, rows);
    pt_detail_begin(scene, plan, instance, &survey->details[i]);
    struct look look = {.scene = scene,
                        .plan = plan,
                        .survey = survey,
                        .instance = instance,
                        .looking = {camera,
                                    pt_draws_ranges(scene, plan, instance)  ? PT_AS_RANGES
                                    : pt_knows_discs(scene, plan, instance) ? PT_AS_DISCS
                                                                            : PT_AS_POINTS, // that reaches farthest
                                    &what, rows, &survey->sieves[i], &survey->details[i]},
                        .cull = instance->style.cull_back && cloud->info.normals_oriented && !object->singular && !transparent,
                        .layered = transparent || scene->settings.layer_passes,
                        .of = i};
    plan->chunks_clipped += chunks ? pt_plan_absent(&look.looking) : 0;
    for (uint32_t k = 0; k < count; k++)
        blocks[k].detail = survey->details[i];
    pt_parallel(count > 1 ? plan->pool : NULL, count, 1, look_at_chunks, &look);
    int error = PATINA_OK;
    for (const struct looked *block = blocks; !block->last; block++) {
        error = block->error ? block->error : error;
        survey->seen_count[i] += block->count;
        survey->points |= block->points;
        survey->discs |= block->discs;
        plan->chunks_clipped += block->clipped;
        pt_detail_join(&survey->details[i], &block->detail);
    }
    plan->transparent |= transparent && survey->seen_count[i] > 0;
    return error;
}

struct weighted {
    double value, weight;
};

static uint64_t double_bits(double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

enum { DIGIT_BITS = 11, DIGITS = 1 << DIGIT_BITS };

// By values, which are not below 0, so that their bits are in their order; equals stay as they lie, for sums depend on the order. Of tens of
// thousands of chunks in view a comparing sort takes a fourth of the plan. spare: as long as the list. The sorted one of both.
static struct weighted *sort_weighted(struct weighted *list, struct weighted *spare, uint32_t count)
{
    for (uint32_t shift = 0; shift < 64; shift += DIGIT_BITS) {
        uint32_t starts[DIGITS + 1] = {0};
        for (uint32_t k = 0; k < count; k++)
            starts[1 + (double_bits(list[k].value) >> shift & (DIGITS - 1))]++;
        for (uint32_t digit = 0; digit < DIGITS; digit++)
            starts[digit + 1] += starts[digit];
        for (uint32_t k = 0; k < count; k++)
            spare[starts[double_bits(list[k].value) >> shift & (DIGITS - 1)]++] = list[k];
        struct weighted *const sorted = spare;
        spare = list;
        list = sorted;
    }
    return list;
}

// Spacings of the chunks of instances [first, end) with the area that they cover; those that face away only when asked for.
static uint32_t weigh_chunks(const struct survey *survey, uint32_t first, uint32_t end, int away, struct weighted *list,
                             double *area)
{
    uint32_t count = 0;
    const struct seen *seen;
    for (uint32_t i = first; i < end; i++)
        for (struct place at = {0}; (seen = next_seen(survey, i, &at));) {
            if (!(seen->area_px > 0.0) || !isfinite(seen->area_px) || (seen->away && !away))
                continue;
            list[count++] = (struct weighted){seen->spacing_px, seen->area_px};
            *area += seen->area_px;
        }
    return count;
}

// What spacing on screen so much of the covered area stays below; unchanged where nothing is covered. What faces away counts only where nothing faces us: the
// sparse back of a statue is hidden by its front.
static int spacing_on_screen(const struct survey *survey, uint32_t first, uint32_t end, struct pt_spread *out)
{
    uint32_t count = 0, total = 0;
    double area = 0.0, sum = 0.0;
    for (uint32_t i = first; i < end; i++)
        total += survey->seen_count[i];
    struct weighted *const room = malloc((2 * (size_t)total + 1) * sizeof *room);
    if (!room)
        return PATINA_ERROR_MEMORY;
    for (int away = 0; away < 2 && !count; away++)
        count = weigh_chunks(survey, first, end, away, room, &area);
    const struct weighted *list = sort_weighted(room, room + total, count);
    for (uint32_t k = 0; k < count && sum <= 0.95 * area; k++) {
        if (sum <= 0.01 * area)
            out->least = list[k].value;
        if (sum <= 0.5 * area)
            out->middle = list[k].value;
        sum += list[k].weight;
        out->most = list[k].value;
    }
    free(room);
    return PATINA_OK;
}

// The cells of what is drawn as range images.
static int choose_cells(const struct patina_scene *scene, struct pt_plan *plan, struct survey *survey)
{
    survey->cells = pt_arena_take(&plan->arena, (scene->cloud_count + 1) * sizeof *survey->cells);
    int error = survey->cells ? PATINA_OK : PATINA_ERROR_MEMORY;
    for (uint32_t i = 0; i < scene->cloud_count && !error; i++) {
        struct cells *cells = &survey->cells[i];
        *cells = (struct cells){0};
        if (!pt_draws_ranges(scene, plan, &scene->instances[i]))
            continue;
        error = spacing_on_screen(survey, i, i + 1, &cells->spread);
        cells->count = pt_range_pixels(scene, &scene->instances[i], &cells->spread, cells->pixels);
        const uint32_t reach = pt_range_reach(cells->pixels[0]);
        plan->ranges.reach = reach > plan->ranges.reach && survey->seen_count[i] ? reach : plan->ranges.reach;
    }
    return error;
}

static void set_view(const struct pt_eye *camera, struct view_args *view)
{
    view->perspective = !camera->orthographic;
    view->z_near = camera->orthographic ? 0.0f : (float)camera->near_clip;
    view->z_far = (float)(camera->orthographic ? camera->far_clip - camera->near_clip : camera->far_clip);
    view->ray_x0 = (float)camera->left;
    view->ray_xs = (float)camera->xs;
    view->ray_y0 = (float)camera->bottom;
    view->ray_ys = (float)camera->ys;
    view->footprint = (float)fmax(camera->xs, camera->ys);
}

// ---- what kernels get ----------------------------------------------------------------------------------------------------

// The pixels or cells that its points may fall into. What lies beside the finer cells, though not beside the coarser ones around them, has
// none: rows begin at no end of a plane.
static void set_place(struct chunk_view *out, const uint32_t rect[4])
{
    const int some = rect[0] < rect[2] && rect[1] < rect[3];
    out->column_first = some ? rect[0] : 0;
    out->row_first = some ? rect[1] : 0;
    out->column_end = some ? rect[2] : 0;
    out->row_end = some ? rect[3] : 0;
}

// A chunk of instance i, as it was placed for the coarser cells, in the finer ones.
static void place_fine(const struct survey *survey, uint32_t i, const struct pt_chunk *chunk, const double bounds[4],
                       uint32_t guard, struct pt_range *fine, const struct chunk_view *placed)
{
    struct chunk_view *out = &fine->chunks[fine->chunk_count++];
    double rows[9], translation[3];
    uint32_t cells[4];
    *out = *placed;
    pt_object_rows(&fine->eye, &survey->objects[i], rows);
    pt_chunk_translation(&fine->eye, &survey->objects[i], chunk, translation);
    pt_set_product(rows, translation, out->row, out->hi, out->lo);
    pt_range_rect(fine, bounds, guard, cells);
    pt_join_rect(fine->cells.rect, cells);
    set_place(out, cells);
}

// Instance i of the scene, its wide chunks or the others. discs: as pt_set_ids has it. range: its image buffer, in whose cells points
// are projected, or NULL.
static int place_chunks(const struct patina_scene *scene, struct pt_plan *plan, const struct survey *survey, uint32_t i,
                        enum pt_kind kind, uint32_t discs, struct pt_range *range, struct pt_plan_instance *out)
{
    const struct pt_instance *instance = &scene->instances[i];
    const struct pt_eye *eye = range ? &range->eye : &survey->camera;
    const double thinned = survey->thinned[i];
    const int narrow = thinned <= pt_thinning(scene); // no disc is drawn wider than bounds know
    const double faces = range ? (double)pt_range_reach(survey->cells[i].pixels[0]) : 0.0;
    const struct pt_to_place what = {scene, instance, &survey->objects[i]};
    out->instance = instance;
    out->of = i;
    out->thinned = thinned;
    out->kind = kind;
    out->marked = pt_is_marked(instance);
    if (kind == PT_AS_DISCS)
        out->as.discs = pt_discs_of(&what, thinned);
    else
        out->as.range = range;
    pt_set_instance(&survey->camera, &survey->objects[i], instance, thinned, &out->args);
    pt_set_ids(plan, i, discs, &out->args);
    const struct seen *seen;
    uint32_t room = 1;
    for (struct place at = {0}; (seen = next_seen(survey, i, &at));)
        room += seen->wide == (kind != PT_AS_POINTS);
    out->chunks = pt_arena_take(&plan->arena, room * sizeof *out->chunks);
    out->bounds = pt_arena_take(&plan->arena, room * sizeof *out->bounds);
    if (!out->chunks || !out->bounds)
        return PATINA_ERROR_MEMORY;
    double rows[9];
    pt_object_rows(eye, &survey->objects[i], rows);
    for (struct place at = {0}; (seen = next_seen(survey, i, &at));) {
        const struct pt_chunk *chunk = &instance->cloud->chunks[seen->chunk];
        const double *bounds = seen->extent.rect,
                     around[4] = {bounds[0] - faces, bounds[1] - faces, bounds[2] + faces, bounds[3] + faces};
        uint32_t *rect = out->bounds[out->chunk_count].rect, cells[4];
        if (seen->wide != (kind != PT_AS_POINTS) || (seen->extent.beside && !range && narrow) ||
            !pt_plan_is_sound(scene, instance->cloud, seen->chunk) ||
            !pt_rect_in_window(&plan->view, around, plan->guard, rect))
            continue;
        uint32_t count = pt_drawn_points(scene, chunk);
        out->bounds[out->chunk_count].z_far = nextafterf((float)seen->extent.z_beyond, INFINITY);
        pt_set_chunk(eye, &survey->objects[i], rows, instance, chunk, count, seen->cull, &out->chunks[out->chunk_count]);
        out->chunks[out->chunk_count].id_base = out->args.id_base;
        if (range) {
            pt_range_rect(range, bounds, plan->guard, cells);
            pt_join_rect(range->cells.rect, cells);
        }
        const float before = nextafterf((float)seen->extent.z_before, -INFINITY);
        out->chunks[out->chunk_count].z_least = before > 0.0f ? before : 0.0f; // nor what is not a number
        set_place(&out->chunks[out->chunk_count], range ? cells : rect);
        if (pt_plan_divide(plan, out, &survey->sieves[i], chunk, &out->chunks[out->chunk_count++]))
            return PATINA_ERROR_MEMORY;
        for (struct pt_range *fine = range ? range->fine : NULL; fine; fine = fine->fine)
            if (seen->spacing_px <= fine->widest)
                place_fine(survey, i, chunk, bounds, plan->guard, fine, &out->chunks[out->chunk_count - 1]);
        pt_join_rect(out->rect, rect);
        out->points += count;
        plan->points_scattered += count;
        plan->discs.entries += kind == PT_AS_DISCS ? seen->tiles * count : 0.0;
    }
    pt_join_rect(plan->view.rect, out->rect);
    plan->chunks_culled -= out->chunk_count;
    return PATINA_OK;
}

// As range images, in one pass or several.
static int place_range(const struct patina_scene *scene, struct pt_plan *plan, const struct survey *survey, uint32_t i)
{
    const struct pt_instance *instance = &scene->instances[i];
    const struct cells *cells = &survey->cells[i];
    struct pt_range *range = pt_arena_take(&plan->arena, cells->count * sizeof *range);
    if (instance->whole->part_count) // each part would have cells of its own
        return pt_fail(&scene->handle, PATINA_ERROR_UNSUPPORTED,
                       "range images: not of a cloud of %llu points; of up to 2147483647 they can be drawn",
                       (unsigned long long)instance->whole->info.count);
    if (!range)
        return PATINA_ERROR_MEMORY;
    pt_range_place(scene, plan, instance, &survey->camera, survey->objects[i].scale, cells->pixels, cells->count,
                   &cells->spread, range);
    for (struct pt_range *fine = range->fine; fine; fine = fine->fine)
        if (!(fine->chunks = pt_arena_take(&plan->arena, (survey->seen_count[i] + 1) * sizeof *fine->chunks)))
            return PATINA_ERROR_MEMORY;
    return place_chunks(scene, plan, survey, i, PT_AS_RANGES, plan->ids.discs, range, &plan->instances[i]);
}

static int place_instance(const struct patina_scene *scene, struct pt_plan *plan, const struct survey *survey, uint32_t i)
{
    const struct patina_cloud *cloud = scene->instances[i].cloud;
    const uint32_t all = scene->settings.surface == PATINA_SURFACE_SPLATS;
    int wide = 0;
    plan->chunks += cloud->chunk_count;
    plan->chunks_culled += cloud->chunk_count;
    plan->points += pt_is_first_part(scene, i) ? cloud->info.count : 0;
    if (survey->cells[i].count)
        return place_range(scene, plan, survey, i);
    int error = place_chunks(scene, plan, survey, i, all ? PT_AS_DISCS : PT_AS_POINTS, 0, NULL, &plan->instances[i]);
    for (const struct looked *block = survey->looked[i]; !block->last && !all; block++)
        wide |= block->discs;
    if (!error && wide)
        error = place_chunks(scene, plan, survey, i, PT_AS_DISCS, plan->discs.first, NULL,
                             &plan->instances[plan->instance_count++]);
    return error;
}

static const float spent = 1.0f / 512.0f; // less opacity does not show

static void plan_texture(const struct pt_plan *plan, const struct pt_instance *instance, struct texture_args *out)
{
    const struct patina_texture *texture = instance->mesh_style.texture;
    const uint32_t alpha = instance->mesh_style.alpha;
    if (!texture)
        return;
    out->levels = texture->levels;
    out->uv = instance->mesh->stride - 2;
    out->format = texture->format;
    out->nearest = texture->nearest;
    out->wrap = texture->wrap;
    out->blend = alpha == PATINA_ALPHA_BLEND;
    out->cut = alpha == PATINA_ALPHA_CLIP ? instance->mesh_style.alpha_least : !out->blend ? 0.0f : plan->map ? 0.5f : spent;
    memcpy(out->sizes, texture->sizes, sizeof out->sizes);
}

static void place_mesh(struct pt_plan *plan, const struct pt_eye *camera, const struct pt_instance *instance, uint32_t id_base,
                       struct pt_plan_mesh *out)
{
    const struct patina_mesh *mesh = instance->mesh;
    struct pt_object object;
    double rows[9], translation[3];
    struct pt_extent extent;
    *out = (struct pt_plan_mesh){.instance = instance};
    pt_object_of(camera, instance->mesh_style.world_from_object, &object);
    pt_object_rows(camera, &object, rows);
    pt_chunk_translation(camera, &object, &mesh->box, translation);
    const struct pt_to_place what = {.instance = instance, .object = &object};
    if (!pt_mesh_drawn(mesh) || !pt_kind_bounds(camera, PT_AS_MESH, &what, &mesh->box, rows, translation, &extent) ||
        !pt_rect_in_window(&plan->view, extent.rect, 0, out->rect))
        return;
    struct mesh_args *args = &out->args;
    pt_set_product(rows, translation, args->row, args->hi, args->lo);
    pt_normal_matrix(camera, &object, args->normal_matrix);
    args->id_base = id_base;
    args->id_count = (uint32_t)mesh->info.triangle_count;
    args->stride = mesh->stride;
    args->has_normals = mesh->has_normals;
    args->has_colors = mesh->has_colors;
    memcpy(args->color, instance->mesh_style.color, sizeof args->color);
    plan_texture(plan, instance, &args->texture);
    pt_join_rect(plan->view.rect, out->rect);
    plan->mesh.triangles += mesh->info.triangle_count;
}

// Parts of a cloud are thinned out as the whole would be.
static void thin_out(const struct patina_scene *scene, struct survey *survey)
{
    for (uint32_t i = 0, end; i < scene->cloud_count; i = end) {
        struct pt_detail detail = survey->details[i];
        for (end = i + 1; end < scene->cloud_count && pt_same_cloud(scene, i, end); end++)
            pt_detail_join(&detail, &survey->details[end]);
        for (uint32_t part = i; part < end; part++)
            survey->thinned[part] = pt_thinning(scene) * pt_detail_thinning(&detail);
    }
}

// What the whole picture sees decides spacing, levels, guard: a region must decide alike. 160 covers any guard.
static int look_around(const struct patina_scene *scene, struct pt_plan *plan, struct survey *survey)
{
    plan->instance_count = scene->cloud_count;
    survey->objects = pt_arena_take(&plan->arena, (scene->cloud_count + 1) * sizeof *survey->objects);
    survey->looked = pt_arena_take(&plan->arena, (scene->cloud_count + 1) * sizeof *survey->looked);
    survey->seen_count = pt_arena_take(&plan->arena, (scene->cloud_count + 1) * sizeof *survey->seen_count);
    survey->sieves = pt_arena_take(&plan->arena, (scene->cloud_count + 1) * sizeof *survey->sieves);
    survey->thinned = pt_arena_take(&plan->arena, (scene->cloud_count + 1) * sizeof *survey->thinned);
    survey->details = pt_arena_take(&plan->arena, (scene->cloud_count + 1) * sizeof *survey->details);
    if (!survey->details || !survey->thinned || !survey->sieves || !survey->objects || !survey->looked || !survey->seen_count)
        return PATINA_ERROR_MEMORY;
    int error = pt_eye_of(scene, &survey->camera);
    const struct pt_eye bare = survey->camera;
    pt_pad_eye(&survey->camera, AROUND);
    for (uint32_t i = 0; i < scene->cloud_count && !error; i++)
        error = look_at_instance(scene, plan, survey, i);
    if (!error)
        thin_out(scene, survey);
    for (uint32_t i = 0; i < scene->mesh_count && !plan->map; i++)
        plan->transparent |= pt_mesh_at(scene, i)->mesh_style.alpha == PATINA_ALPHA_BLEND &&
                             pt_mesh_drawn(pt_mesh_at(scene, i)->mesh);
    survey->camera = bare;
    struct pt_spread spread = {.middle = plan->spacing_middle, .most = plan->spacing_px};
    if (!error)
        error = spacing_on_screen(survey, 0, plan->instance_count, &spread);
    plan->spacing_middle = spread.middle;
    plan->spacing_px = spread.most;
    return error;
}

// From the first to the last of the slots that are seen.
static struct pt_window window_of(const struct looked *block)
{
    uint64_t first = UINT64_MAX, end = 0;
    for (; !block->last; block++) {
        first = block->count && block->first < first ? block->first : first;
        end = block->end > end ? block->end : end;
    }
    return end ? (struct pt_window){.first = (uint32_t)first, .count = (uint32_t)(end - first)} : (struct pt_window){0};
}

// Ids of what the whole picture sees: a region's are the same.
static int number_seen(const struct patina_scene *scene, struct pt_plan *plan, struct survey *survey)
{
    plan->ids.windows = pt_arena_take(&plan->arena, (scene->cloud_count + 1) * sizeof *plan->ids.windows);
    int error = plan->ids.windows ? look_around(scene, plan, survey) : PATINA_ERROR_MEMORY;
    for (uint32_t i = 0; i < scene->cloud_count && !error; i++)
        plan->ids.windows[i] = window_of(survey->looked[i]);
    return error;
}

static int look_and_number(const struct patina_scene *scene, struct pt_plan *plan, struct survey *survey)
{
    plan->ids.filled = plan->map; // maps have no discs
    const struct pt_plan before = *plan;
    int error = number_seen(scene, plan, survey);
    if (error || pt_plan_number(scene, plan))
        return error;
    if (plan->map)
        return pt_plan_too_many(scene, plan);
    struct pt_arena *arena = plan->arena; // anew: points that are no discs are seen less far
    *plan = before;
    plan->arena = arena;
    plan->ids.filled = 1;
    survey_free(survey, scene->cloud_count);
    *survey = (struct survey){0};
    error = number_seen(scene, plan, survey);
    return error || pt_plan_number(scene, plan) ? error : pt_plan_too_many(scene, plan);
}

int pt_plan_spacing(const struct patina_scene *scene, struct pt_plan *plan)
{
    struct survey survey = {0};
    const int error = look_around(scene, plan, &survey);
    survey_free(&survey, scene->cloud_count);
    return error;
}

static int plan_view(const struct patina_scene *scene, struct pt_plan *plan, struct survey *survey)
{
    plan->instances = pt_arena_take(&plan->arena, (2 * (size_t)scene->cloud_count + 1) * sizeof *plan->instances);
    plan->mesh.count = scene->mesh_count;
    plan->mesh.list = pt_arena_take(&plan->arena, (scene->mesh_count + 1) * sizeof *plan->mesh.list);
    if (!plan->instances || !plan->mesh.list)
        return PATINA_ERROR_MEMORY;
    // 1. Spacings, and ids.
    int error = look_and_number(scene, plan, survey);
    if (error || (error = choose_cells(scene, plan, survey)))
        return error;
    plan->discs.first = scene->settings.surface == PATINA_SURFACE_SPLATS ? 0 : plan->ids.discs;
    plan->discs.count = survey->discs ? (uint32_t)plan->ids.points : 0;
    plan->filled = survey->points;
    plan->reaches = plan->discs.count &&
                    pt_knows_reach(scene, plan); // asking takes a tenth of the frame: not where all points lie close
    plan->sigmas = pt_knows_sigmas(scene);
    pt_choose_filling(scene, plan);
    plan->discs.count = plan->ranges.reach ? (uint32_t)plan->ids.points
                                           : plan->discs.count; // their pixels say how far off a point fell
    pt_choose_layers(&scene->settings, plan);
    plan->reopens = pt_reopen_rounds(scene, plan);
    plan->line_radius = pt_line_radius(scene);
    uint32_t cell = 1u << plan->levels;
    // Effects see no farther beyond the picture: a wider guard would fill holes at its border otherwise than without them. Lines
    // would break off there.
    const uint32_t reach = plan->ranges.reach < FARTHEST_FACE ? plan->ranges.reach : FARTHEST_FACE;
    uint32_t guard = pt_round_up(8 + 4 * cell + pt_line_reach(plan) + reach, cell > 16 ? cell : 16);
    plan->guard = guard;
    // 2. The window, and what of the scene falls into it.
    pt_pad_eye(&survey->camera, guard);
    set_view(&survey->camera, &plan->view);
    pt_choose_window(scene, plan, guard);
    if ((uint64_t)plan->view.width * plan->view.height >= 1u << 29) // float4 words are gathered by signed indices
        return pt_fail(&scene->handle, PATINA_ERROR_TOO_LARGE, "planes of %u x %u pixels are too large: render in regions",
                       plan->view.width, plan->view.height);
    for (uint32_t i = 0; i < scene->cloud_count && !error; i++)
        error = place_instance(scene, plan, survey, i);
    for (uint32_t i = 0; i < scene->mesh_count && !error; i++)
        place_mesh(plan, &survey->camera, pt_mesh_at(scene, i), (uint32_t)plan->ids.points + pt_mesh_at(scene, i)->id_base,
                   &plan->mesh.list[i]);
    return error || (plan->map && !plan->soft.veils) ? error : pt_place_soft(scene, plan, &survey->camera);
}

int pt_plan_view(const struct patina_scene *scene, struct pt_plan *plan)
{
    struct survey survey = {0};
    const int error = plan_view(scene, plan, &survey);
    survey_free(&survey, scene->cloud_count);
    return error;
}

int pt_plan_chunks(const struct patina_scene *scene, struct pt_plan *plan, const struct pt_instance *instance,
                   struct instance_args *args, struct chunk_view **chunks, uint32_t *count)
{
    struct pt_eye camera;
    struct pt_object object;
    int error = pt_eye_of(scene, &camera);
    *chunks = pt_arena_take(&plan->arena, (pt_chunks_there(instance->cloud) + 1) * sizeof **chunks);
    *count = 0;
    if (error || !*chunks)
        return error ? error : PATINA_ERROR_MEMORY;
    pt_pad_eye(&camera, plan->guard);
    pt_object_of(&camera, instance->style.world_from_object, &object);
    pt_set_instance(&camera, &object, instance, 1.0, args);
    double rows[9];
    pt_object_rows(&camera, &object, rows);
    for (uint32_t c = 0; (c = pt_chunk_from(instance->cloud, c)) < instance->cloud->chunk_count; c++)
        pt_set_chunk(&camera, &object, rows, instance, &instance->cloud->chunks[c], instance->cloud->chunks[c].count, 0,
                     &(*chunks)[(*count)++]);
    return PATINA_OK;
}
