// SPDX-License-Identifier: GPL-3.0-or-later
// Picking: which points of an instance an outline on the picture holds, which of them is the nearest to a place, and pixels that show
// selected ones. Decided in float64, point by point, in chunks that may have any; a row of pixels knows which edges of the outline
// cross it.
#include "scene/clouds/paged.h"
#include "run/frame.h"
#include "base/descriptor.h"
#include "base/progress.h"
#include "scene/clip.h"
#include "scene/mask.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_CORNERS = 1 << 14 };

#define BORDER 0.01 // pixels

// The edges by the rows of pixels that they pass: those of row y are edges[first[y]] to edges[first[y + 1] - 1].
struct outline {
    const double *corners;
    uint32_t count, rows;
    uint64_t *first;
    uint32_t *edges;
    double lower[2], upper[2];
};

// A point, and the square of its distance from a place in the image; found 0: none.
struct nearest {
    uint64_t number;
    double position[3], squared;
    int found;
};

struct pick {
    const struct patina_scene *scene;
    const struct pt_instance *instance; // of a cloud in parts the part at hand
    uint32_t parts;
    const patina_pick *desc;
    struct pt_sieve sieve;
    struct outline outline;
    double linear[9], translation[3];    // world from object
    double axes[9], eye[3], rotation[9]; // view from world; view from object
    double scale;                        // longest of the object's axes in the world
    double pixel;                        // width of one, at distance 1 in perspective
    const uint64_t *keys;                // of the frame, or NULL
    uint32_t region[4];
    int by_class;
    uint8_t *bits;       // or NULL: only the nearest point to `place` is wanted
    const double *place; // pixels
    struct nearest nearest;
    struct pt_mutex lock; // of `nearest`
    struct patina_progress *progress;
    _Atomic uint32_t done; // chunks
};

// ---- the outline ---------------------------------------------------------------------------------------------------------

// Rows that edge e passes, cut to the picture; 0: none.
static int rows_of(const struct outline *outline, uint32_t e, uint32_t rows[2])
{
    const double a = outline->corners[2 * e + 1], b = outline->corners[2 * ((e + 1) % outline->count) + 1];
    const double low = fmax(fmin(a, b), 0.0), high = fmin(fmax(a, b), (double)outline->rows - 0.5);
    if (a == b || low > high)
        return 0;
    rows[0] = (uint32_t)low;
    rows[1] = (uint32_t)high;
    return rows[0] < outline->rows;
}

static int list_edges(struct outline *outline)
{
    uint32_t rows[2];
    outline->first = calloc(outline->rows + 2, sizeof *outline->first);
    for (uint32_t e = 0; outline->first && e < outline->count; e++)
        if (rows_of(outline, e, rows))
            for (uint32_t y = rows[0]; y <= rows[1]; y++)
                outline->first[y + 2]++;
    for (uint32_t y = 0; outline->first && y < outline->rows; y++)
        outline->first[y + 2] += outline->first[y + 1];
    outline->edges = outline->first ? malloc((outline->first[outline->rows + 1] + 1) * sizeof *outline->edges) : NULL;
    if (!outline->edges)
        return PATINA_ERROR_MEMORY;
    for (uint32_t e = 0; e < outline->count; e++)
        if (rows_of(outline, e, rows))
            for (uint32_t y = rows[0]; y <= rows[1]; y++)
                outline->edges[outline->first[y + 1]++] = e;
    return PATINA_OK;
}

static int make_outline(const patina_pick *desc, uint32_t rows, struct outline *outline)
{
    *outline = (struct outline){.corners = desc->polygon,
                                .count = desc->corners,
                                .rows = rows,
                                .lower = {INFINITY, INFINITY},
                                .upper = {-INFINITY, -INFINITY}};
    for (uint32_t i = 0; i < 2 * outline->count; i++) {
        outline->lower[i % 2] = fmin(outline->lower[i % 2], outline->corners[i]);
        outline->upper[i % 2] = fmax(outline->upper[i % 2], outline->corners[i]);
    }
    return outline->count ? list_edges(outline) : PATINA_OK;
}

// Whether a place in the picture lies inside: edges to its right are counted.
static int in_outline(const struct outline *outline, double x, double y)
{
    const uint32_t row = (uint32_t)y;
    int inside = 0;
    for (uint64_t i = outline->first[row]; i < outline->first[row + 1]; i++) {
        const double *a = outline->corners + 2 * outline->edges[i];
        const double *b = outline->corners + 2 * ((outline->edges[i] + 1) % outline->count);
        if ((a[1] > y) != (b[1] > y))
            inside ^= x < a[0] + (y - a[1]) * (b[0] - a[0]) / (b[1] - a[1]);
    }
    return inside;
}

// ---- points --------------------------------------------------------------------------------------------------------------

// Of a divided chunk: whether clips, classes, shapes, mask and field leave the point at `slot`, in the world at p.
static int is_drawn(const struct pick *pick, const struct pt_division *division, uint64_t slot, const double p[3])
{
    const struct patina_cloud *cloud = pick->instance->cloud;
    int kept = !pick->sieve.keeping;
    if (division->by_mask && pick->sieve.mask->words[slot / PT_SLOTS_A_WORD] >> slot % PT_SLOTS_A_WORD & 1u)
        return 0;
    if (division->by_class && pick->instance->style.hidden_classes[cloud->classes[slot] / 32] >> cloud->classes[slot] % 32 & 1u)
        return 0;
    if (division->by_field && pick->sieve.field->steps[slot] > pick->sieve.threshold)
        return 0;
    const uint32_t sight = division->by_shape ? cloud->shapes[slot] >> PT_SHAPE_SIGHT_SHIFT & 255u : 0;
    if (division->by_shape && pick->sieve.hidden_shapes[sight / 32] >> sight % 32 & 1u)
        return 0;
    for (uint32_t i = 0; i < pick->sieve.count; i++) {
        const struct pt_inverse_clip *clip = &pick->sieve.clips[i];
        double from[3], q[3];
        for (int k = 0; k < 3; k++)
            from[k] = p[k] - clip->center[k];
        pt_apply(clip->inverse, from, q);
        if (clip->shape == PT_CLIP_PLANE ? q[2] > 0.0 : 0)
            return 0;
        const int inside = fabs(q[0]) <= 1.0 && fabs(q[1]) <= 1.0 && fabs(q[2]) <= 1.0;
        kept |= clip->shape == PT_CLIP_KEEP && inside;
        if (clip->shape == PT_CLIP_CUT && inside)
            return 0;
    }
    return kept;
}

// Where a place in view space falls, in pixels of the full picture, and its linear z; 0: outside of the picture.
static int project(const struct pick *pick, const double v[3], double out[3])
{
    const patina_camera *camera = &pick->scene->camera;
    const patina_settings *settings = &pick->scene->settings;
    const double depth = -v[2], over = camera->orthographic ? 1.0 : depth;
    if (!(depth >= camera->near_clip) || !(depth <= camera->far_clip))
        return 0;
    out[0] = (v[0] / over - camera->left) / (camera->right - camera->left) * settings->width;
    out[1] = (v[1] / over - camera->bottom) / (camera->top - camera->bottom) * settings->height;
    out[2] = camera->orthographic ? depth - camera->near_clip : depth;
    return out[0] >= 0.0 && out[1] >= 0.0 && out[0] < settings->width && out[1] < settings->height;
}

// By the frame's key at a pixel. spacing: of the point's chunk.
static int is_shown_at(const struct pick *pick, double spacing, const double place[3], double px, double py)
{
    const uint32_t *region = pick->region;
    if (px < region[0] || py < region[1] || px >= region[2] || py >= region[3])
        return 0;
    const uint32_t x = (uint32_t)px, y = (uint32_t)py;
    const uint32_t word = (uint32_t)(pick->keys[(size_t)(y - region[1]) * (region[2] - region[0]) + x - region[0]] >> 32);
    float z;
    memcpy(&z, &word, sizeof z);
    const double footprint = pick->pixel * (pick->scene->camera.orthographic ? 1.0 : place[2]);
    return word != PT_KEY_EMPTY_Z && place[2] <= (double)z + fmax(2.0 * spacing * pick->scale, 4.0 * footprint);
}

// A point within BORDER of its pixel's border may have fallen into the pixel beyond it: scattering is float32.
static int is_shown(const struct pick *pick, double spacing, const double place[3])
{
    for (int k = 0; k < 4; k++) {
        const double x = place[0] + (k & 1 ? BORDER : -BORDER), y = place[1] + (k & 2 ? BORDER : -BORDER);
        if (is_shown_at(pick, spacing, place, x, y))
            return 1;
    }
    return 0;
}

static int of_class(const struct pick *pick, uint64_t slot)
{
    const uint8_t class = pick->instance->cloud->classes[slot];
    return pick->desc->classes[class / 32] >> class % 32 & 1u;
}

// How a chunk's places come into view space: rotation p + offset.
static void chunk_offset(const struct pick *pick, const struct pt_chunk *chunk, double world[3], double offset[3])
{
    double away[3];
    pt_apply(pick->linear, chunk->origin, world);
    for (int k = 0; k < 3; k++) {
        world[k] += pick->translation[k];
        away[k] = world[k] - pick->eye[k];
    }
    pt_apply(pick->axes, away, offset);
}

// Whether some of the chunk's box may fall into the outline's.
static int may_have(const struct pick *pick, const struct pt_chunk *chunk, const double offset[3])
{
    const patina_camera *camera = &pick->scene->camera;
    double lower[2] = {INFINITY, INFINITY}, upper[2] = {-INFINITY, -INFINITY}, near = INFINITY, far = -INFINITY;
    for (int corner = 0; corner < 8; corner++) {
        double p[3], v[3];
        for (int k = 0; k < 3; k++)
            p[k] = (double)(corner >> k & 1 ? chunk->box_max[k] : chunk->box_min[k]);
        pt_apply(pick->rotation, p, v);
        const double depth = -(v[2] + offset[2]), over = camera->orthographic ? 1.0 : depth;
        near = fmin(near, depth);
        far = fmax(far, depth);
        const double x = ((v[0] + offset[0]) / over - camera->left) / (camera->right - camera->left) *
                         pick->scene->settings.width;
        const double y = ((v[1] + offset[1]) / over - camera->bottom) / (camera->top - camera->bottom) *
                         pick->scene->settings.height;
        lower[0] = fmin(lower[0], x);
        lower[1] = fmin(lower[1], y);
        upper[0] = fmax(upper[0], x);
        upper[1] = fmax(upper[1], y);
    }
    const double slack = 1e-6 * (fabs(near) + fabs(far));
    if (far < camera->near_clip - slack || near > camera->far_clip + slack)
        return 0;
    if (!camera->orthographic && !(near > 1e-9 * fabs(far))) // the box reaches behind the eye
        return 1;
    for (int k = 0; k < 2; k++)
        if (lower[k] > pick->outline.upper[k] + 1e-3 || upper[k] < pick->outline.lower[k] - 1e-3)
            return 0;
    return 1;
}

static void set_bit(uint8_t *bits, uint64_t index) // from several threads
{
    __atomic_fetch_or(&bits[index / 8], (uint8_t)(1u << index % 8), __ATOMIC_RELAXED);
}

// Replaces `kept` by a nearer point, or by one as near with a smaller number: whatever the order in which threads find them.
static void keep_nearer(struct nearest *kept, const struct nearest *other)
{
    if (other->found &&
        (!kept->found || other->squared < kept->squared || (other->squared == kept->squared && other->number < kept->number)))
        *kept = *other;
}

// Of a point of a chunk, p from its origin, that falls on a place in the image.
static struct nearest near_to(const struct pick *pick, const struct pt_chunk *chunk, uint64_t number, const double p[3],
                              const double place[3])
{
    const double x = place[0] - pick->place[0], y = place[1] - pick->place[1];
    return (struct nearest){.number = number,
                            .position = {chunk->origin[0] + p[0], chunk->origin[1] + p[1], chunk->origin[2] + p[2]},
                            .squared = x * x + y * y,
                            .found = 1};
}

static void pick_chunk(struct pick *pick, const struct pt_chunk *chunk, const struct pt_division *division)
{
    const struct patina_cloud *cloud = pick->instance->cloud;
    float unpacked[3 * PT_CHUNK_POINTS];
    double world[3], offset[3];
    struct nearest nearest = {0};
    chunk_offset(pick, chunk, world, offset);
    if (pick->outline.count && !may_have(pick, chunk, offset))
        return;
    const float *positions = pt_chunk_positions(cloud, chunk, unpacked);
    for (uint32_t i = 0; i < chunk->count; i++) {
        const double p[3] = {(double)positions[i], (double)positions[chunk->padded + i],
                             (double)positions[2 * (size_t)chunk->padded + i]};
        const uint64_t slot = (uint64_t)chunk->first + i;
        double v[3], place[3] = {0};
        if (pick->by_class && !of_class(pick, slot))
            continue;
        if (pick->outline.count) {
            pt_apply(pick->rotation, p, v);
            for (int k = 0; k < 3; k++)
                v[k] += offset[k];
            if (!project(pick, v, place) || !in_outline(&pick->outline, place[0], place[1]) ||
                (pick->keys && !is_shown(pick, (double)chunk->spacing, place)))
                continue;
        }
        if (division) {
            pt_apply(pick->linear, p, v);
            for (int k = 0; k < 3; k++)
                v[k] += world[k];
            if (!is_drawn(pick, division, slot, v))
                continue;
        }
        if (pick->bits) {
            set_bit(pick->bits, pt_number_of(cloud, slot));
        } else {
            const struct nearest found = near_to(pick, chunk, pt_number_of(cloud, slot), p, place);
            keep_nearer(&nearest, &found);
        }
    }
    if (nearest.found) {
        pt_mutex_lock(&pick->lock);
        keep_nearer(&pick->nearest, &nearest);
        pt_mutex_unlock(&pick->lock);
    }
}

static void pick_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct pick *pick = context;
    const struct patina_cloud *cloud = pick->instance->cloud;
    struct clip_view *room = malloc((pick->sieve.count + 1) * sizeof *room);
    (void)thread;
    for (uint32_t c = begin; c < end && room && !pt_progress_cancelled(pick->progress); c++) {
        struct pt_division division;
        const enum pt_side side = pt_sieve_chunk(&pick->sieve, &cloud->chunks[c], room, &division);
        if (side != PT_CUT_AWAY)
            pick_chunk(pick, &cloud->chunks[c], side == PT_DIVIDED ? &division : NULL);
        pt_progress_raise(pick->progress, (double)++pick->done / pick->instance->whole->chunk_count);
    }
    if (!room)
        pick->done = UINT32_MAX / 2; // never so many chunks: memory lacked
    free(room);
}

// ---- what is exported ----------------------------------------------------------------------------------------------------

static uint64_t points_of(const patina_scene *scene, uint32_t instance)
{
    uint32_t first;
    pt_scene_parts(scene, instance, &first);
    return scene->instances[first].cloud->info.count;
}

static int check(const patina_scene *scene, const char *call, const patina_pick *desc)
{
    if (desc->instance >= scene->given)
        return pt_fail(&scene->handle, PATINA_ERROR_ARGUMENT, "%s: the scene has no instance %u", call, desc->instance);
    if (desc->corners > MOST_CORNERS || (desc->corners && (desc->corners < 3 || !desc->polygon)))
        return pt_fail(&scene->handle, PATINA_ERROR_ARGUMENT, "%s: %u corners; 3 to %d", call, desc->corners, MOST_CORNERS);
    for (uint32_t i = 0; i < 2 * desc->corners; i++)
        if (!isfinite(desc->polygon[i]))
            return pt_fail(&scene->handle, PATINA_ERROR_ARGUMENT, "%s: a corner is not finite", call);
    if (desc->corners && !scene->has_camera)
        return pt_fail(&scene->handle, PATINA_ERROR_ARGUMENT, "%s: the scene has no camera", call);
    return PATINA_OK;
}

static void set_views(struct pick *pick)
{
    const patina_camera *camera = &pick->scene->camera;
    const patina_settings *settings = &pick->scene->settings;
    pt_split_matrix(pick->instance->style.world_from_object, pick->linear, pick->translation);
    for (int c = 0; c < 3; c++)
        pick->scale = fmax(pick->scale, sqrt(pick->linear[c] * pick->linear[c] + pick->linear[3 + c] * pick->linear[3 + c] +
                                             pick->linear[6 + c] * pick->linear[6 + c]));
    if (!pick->scene->has_camera)
        return;
    pt_camera_axes(camera, pick->axes, pick->eye);
    pt_multiply(pick->axes, pick->linear, pick->rotation);
    pick->pixel = fmax((camera->right - camera->left) / settings->width, (camera->top - camera->bottom) / settings->height);
}

static int take_keys(struct pick *pick, const struct patina_frame *frame, uint64_t **keys)
{
    memcpy(pick->region, pick->scene->settings.region, sizeof pick->region);
    const size_t size = (size_t)(pick->region[2] - pick->region[0]) * (pick->region[3] - pick->region[1]) * sizeof **keys;
    *keys = malloc(size);
    pick->keys = *keys;
    return *keys ? pt_frame_read_ids(frame, pick->scene, *keys, size) : PATINA_ERROR_MEMORY;
}

static int run(struct pick *pick, const struct patina_frame *frame, struct pt_inverse_clip *room)
{
    uint64_t *keys = NULL;
    int error = frame && pick->desc->corners ? take_keys(pick, frame, &keys) : PATINA_OK;
    struct pt_pool *pool = error ? NULL
                                 : pt_pool_create(pt_pool_threads_for(pick->desc->threads, pick->instance->whole->slots), 0);
    if (!error)
        error = pool ? make_outline(pick->desc, pick->scene->settings.height, &pick->outline) : PATINA_ERROR_MEMORY;
    for (uint32_t i = 0; i < pick->parts && !error; i++, pick->instance++) {
        const struct patina_cloud *cloud = pick->instance->cloud;
        pick->sieve = pt_sieve_make(pick->scene, pick->instance, PT_EVERY_POINT, room);
        pt_paged_enter(cloud, 0);
        pt_parallel(pool, cloud->chunk_count, 4, pick_chunks, pick);
        pt_paged_leave(cloud);
        error = pt_progress_cancelled(pick->progress)             ? PATINA_ERROR_CANCELLED
                : pick->done > pick->instance->whole->chunk_count ? PATINA_ERROR_MEMORY
                                                                  : PATINA_OK;
    }
    free(pick->outline.first);
    free(pick->outline.edges);
    free(keys);
    pt_pool_destroy(pool);
    return error;
}

// pick: has bits, which are all 0, or a place; desc, which was checked.
static int pick_points(struct pick *pick, const patina_scene *scene, const patina_frame *frame)
{
    uint32_t first;
    pick->scene = scene;
    pick->parts = pt_scene_parts(scene, pick->desc->instance, &first);
    pick->instance = &scene->instances[first];
    for (int k = 0; k < 8; k++)
        pick->by_class |= pick->desc->classes[k] != 0;
    if (pick->by_class && !pick->instance->cloud->classes) // of such points none has a class
        return PATINA_OK;
    struct pt_inverse_clip *room = malloc((scene->clip_count + 1) * sizeof *room);
    set_views(pick);
    pt_mutex_init(&pick->lock);
    const int error = room ? run(pick, frame, room) : PATINA_ERROR_MEMORY;
    pt_mutex_destroy(&pick->lock);
    free(room);
    return error == PATINA_ERROR_MEMORY      ? pt_fail(&scene->handle, error, "picking points: out of memory")
           : error == PATINA_ERROR_CANCELLED ? pt_fail(&scene->handle, error, "picking points was cancelled")
           : error                           ? pt_fail_again(&scene->handle, error)
                                             : PATINA_OK;
}

int patina_scene_pick(const patina_scene *scene, const patina_frame *frame, const patina_pick *given, patina_progress *progress,
                      uint8_t *bits, size_t size)
{
    patina_pick desc;
    if (!scene || !given)
        return pt_fail(scene ? &scene->handle : NULL, PATINA_ERROR_ARGUMENT,
                       "patina_scene_pick: scene or what to pick is NULL");
    int error = pt_take(&scene->handle, "patina_scene_pick", given, &desc, sizeof desc);
    error = error ? error : check(scene, "patina_scene_pick", &desc);
    if (error)
        return error;
    const uint64_t count = points_of(scene, desc.instance);
    if (!bits || size != (count + 7) / 8)
        return pt_fail(&scene->handle, PATINA_ERROR_ARGUMENT, "patina_scene_pick: bits is NULL, or %zu bytes for %llu points",
                       size, (unsigned long long)count);
    memset(bits, 0, size);
    struct pick pick = {.desc = &desc, .bits = bits, .progress = progress};
    return pick_points(&pick, scene, frame);
}

int patina_scene_pick_nearest(const patina_scene *scene, const patina_frame *frame, const patina_pick *given,
                              const double place[2], patina_progress *progress, patina_picked *picked)
{
    static const char call[] = "patina_scene_pick_nearest";
    patina_pick desc;
    if (!scene || !given)
        return pt_fail(scene ? &scene->handle : NULL, PATINA_ERROR_ARGUMENT, "%s: scene or what to pick is NULL", call);
    int error = pt_take(&scene->handle, call, given, &desc, sizeof desc);
    error = error ? error : check(scene, call, &desc);
    if (error)
        return error;
    if (!desc.corners || !place || !isfinite(place[0]) || !isfinite(place[1]))
        return pt_fail(&scene->handle, PATINA_ERROR_ARGUMENT, "%s: no polygon, or the place is NULL or not finite", call);
    struct pick pick = {.desc = &desc, .place = place, .progress = progress};
    error = pick_points(&pick, scene, frame);
    if (error)
        return error;
    const struct nearest *found = &pick.nearest;
    const patina_picked told = {.struct_size = sizeof told,
                                .found = (uint32_t)found->found,
                                .number = found->number,
                                .position = {found->position[0], found->position[1], found->position[2]},
                                .distance = sqrt(found->squared)};
    return pt_give(&scene->handle, call, &told, sizeof told, picked);
}

// Whether the mask of the instance that an id is of selects it. instance: of the id before.
static int is_selected(const struct patina_frame *frame, const struct patina_scene *scene, uint32_t id, uint32_t *instance)
{
    uint32_t slot;
    if (!pt_numbering_find(&frame->key_ids, id, instance, &slot))
        return 0;
    const struct patina_mask *mask = scene->instances[*instance].style.mask;
    return mask && (mask->words[slot / PT_SLOTS_A_WORD] >> (PT_SLOTS_A_WORD + slot % PT_SLOTS_A_WORD) & 1u);
}

int patina_frame_highlight(const patina_frame *frame, const patina_scene *scene, const float color[3], float strength,
                           float *pixels, size_t size)
{
    if (!frame || !scene || !color || !pixels || !(strength >= 0.0f && strength <= 1.0f))
        return pt_fail(frame ? &frame->handle : NULL, PATINA_ERROR_ARGUMENT, "patina_frame_highlight: bad arguments");
    const size_t count = size / (4 * sizeof *pixels);
    uint64_t *keys = malloc((count + 1) * sizeof *keys);
    if (!keys)
        return pt_fail(&frame->handle, PATINA_ERROR_MEMORY, "patina_frame_highlight: out of memory");
    int error = pt_frame_read_ids(frame, scene, keys, count * sizeof *keys);
    uint32_t last = 0;
    for (size_t i = 0; i < count && !error && scene->cloud_count; i++) {
        if (keys[i] >> 32 == PT_KEY_EMPTY_Z || !is_selected(frame, scene, (uint32_t)keys[i], &last))
            continue;
        for (int k = 0; k < 3; k++)
            pixels[4 * i + k] += strength * (color[k] * pixels[4 * i + 3] - pixels[4 * i + k]);
    }
    free(keys);
    return error ? pt_fail_again(&frame->handle, error) : PATINA_OK;
}
