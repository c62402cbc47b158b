// SPDX-License-Identifier: GPL-3.0-or-later
// blend: means of the discs on each pixel's nearest surface, over keys that splat made.
#include "discs.h"
#include "marks.h"
#include "shared/measured.h"

#include <math.h>
#include <string.h>

static const uint32_t sizes[] = {1, 15, 16, 17, 300, 500, 31, 2};
enum {
    SIZES = sizeof sizes / sizeof sizes[0],
    PLANES = 8,
    LIGHTS = PT_BLEND_LIGHTS + 2,
    SAMPLES = 8,
    BARE = 1
}; // BARE: an instance without shadows

struct planes {
    uint64_t *keys;
    float *deff, *normal, *albedo, *away, *offset;
    size_t marked; // points
};

// What blend reads of the points beside their discs.
struct paint {
    void *colors[MOST_INSTANCES];
    uint8_t *opacities[MOST_INSTANCES];
    size_t color_bytes[MOST_INSTANCES];
};

// Bytes, floats (brighter than blends take among them) or the style's colour, by instance.
static struct paint paint(struct harness *h, struct rng *rng, struct disc_scene *scene)
{
    struct paint out = {.colors = {NULL}};
    for (uint32_t i = 0; i < scene->points.count; i++) {
        struct instance_args *args = &scene->discs[i].instance;
        const size_t count = scene->points.clouds[i].slots;
        args->color_format = (i + 1) % 3;
        args->opacity = i ? 0.7f : 1.0f;
        args->has_opacities = i == 2;
        for (int k = 0; k < 3; k++)
            args->color[k] = (float)rng_unit(rng);
        out.color_bytes[i] = count * (args->color_format == 2 ? 12 : 3) + 4;
        out.colors[i] = harness_alloc(h, out.color_bytes[i]);
        for (size_t k = 0; k < 3 * count; k++)
            if (args->color_format == 2)
                ((float *)out.colors[i])[k] = (float)(rng_below(rng, 50) ? rng_range(rng, -0.5, 1.5) : 60000.0);
            else
                ((uint8_t *)out.colors[i])[k] = (uint8_t)rng_below(rng, 256);
        out.opacities[i] = harness_alloc(h, count + 4);
        for (size_t k = 0; k < count; k++)
            out.opacities[i][k] = (uint8_t)rng_below(rng, 256);
    }
    return out;
}

static struct ref_look look_of(const struct disc_scene *scene, const struct paint *paint, uint32_t id)
{
    struct ref_look look = {.opacity = 0};
    for (uint32_t i = 0; i < scene->points.count; i++) {
        const struct instance_args *args = &scene->discs[i].instance;
        const uint32_t at = id - args->id_base;
        if (at >= args->id_count)
            continue;
        look.opacity = (double)args->opacity * (args->has_opacities ? paint->opacities[i][at] / 255.0 : 1.0);
        for (int k = 0; k < 3; k++)
            look.color[k] = args->color_format == 0   ? (double)args->color[k]
                            : args->color_format == 1 ? ref_srgb(((const uint8_t *)paint->colors[i])[3 * at + (uint32_t)k])
                                                      : (double)((const float *)paint->colors[i])[3 * at + (uint32_t)k];
    }
    return look;
}

// What the parts of blend are run on, and what is known of it.
struct scenery {
    const struct disc_scene *scene;
    const struct paint *paint;
    const struct planes *planes;
    const struct ref_disc *discs;
    uint32_t count;
    struct pt_buffer *buffers[PLANES + PT_EACH_blend * MOST_INSTANCES];
    uint32_t buffer_count;
    double open;
};

static const struct ref_disc *nearest_of(const struct scenery *s, size_t p)
{
    return s->planes->keys[p] == REF_EMPTY_KEY ? NULL : discs_find(s->discs, s->count, ref_key_id(s->planes->keys[p]));
}

// lists: of each instance, in place of its colours. plane: in place of albedo, or NULL.
static void run_part(struct harness *h, const struct scenery *s, struct blend_args blend, struct pt_buffer *const *lists,
                     struct pt_buffer *const *marks, struct pt_buffer *plane)
{
    char args[sizeof(struct blend_args) + sizeof s->scene->discs];
    struct pt_buffer *buffers[PLANES + PT_EACH_blend * MOST_INSTANCES];
    struct disc_args discs[MOST_INSTANCES];
    const uint32_t instances = s->scene->points.count;
    memcpy(buffers, s->buffers, sizeof buffers);
    for (uint32_t k = PT_BUF_blend_normal; k <= PT_BUF_blend_offset; k++)
        buffers[k] = k == PT_BUF_blend_albedo ? plane : NULL;
    memcpy(discs, s->scene->discs, sizeof discs);
    for (uint32_t i = 0; i < instances; i++) {
        buffers[PT_BUF_blend_colors + PT_EACH_blend * i] = lists[i];
        buffers[PT_BUF_blend_marks + PT_EACH_blend * i] = marks ? marks[i] : NULL;
        discs[i].shadowed = i != BARE;
    }
    blend.view = s->scene->points.view;
    blend.instances = instances;
    memcpy(args, &blend, sizeof blend);
    memcpy(args + sizeof blend, discs, instances * sizeof *discs);
    harness_run(h, PT_KERNEL_blend, args, sizeof blend + instances * sizeof *discs, buffers, s->buffer_count);
}

// Every point is marked whose disc counts somewhere, of instances that receive shadows; of others none. Returns how many are.
static size_t check_marks(struct harness *h, const struct scenery *s)
{
    const struct scene *points = &s->scene->points;
    struct pt_buffer *marks[MOST_INSTANCES];
    uint8_t *counts = harness_alloc(h, s->count + 1);
    size_t marked = 0;
    for (uint32_t i = 0; i < points->count; i++)
        marks[i] = harness_buffer(h, harness_alloc(h, marks_size(points->clouds[i].slots)),
                                  marks_size(points->clouds[i].slots));
    run_part(h, s, (struct blend_args){.part = PT_BLEND_MARKS}, marks, NULL, NULL);
    const void *kept = harness_kept(h);
    if (kept)
        memcpy(counts, kept, s->count + 1);
    struct around around = {.strip = -1};
    for (size_t p = 0; p < (size_t)points->view.width * points->view.height && !kept; p++) {
        const struct ref_disc *nearest = nearest_of(s, p);
        const int x = (int)(p % points->view.width), y = (int)(p / points->view.width);
        discs_around(h, &around, &points->view, s->discs, s->count, x, y);
        for (uint32_t i = 0; i < around.count && nearest; i++) {
            const uint32_t k = around.places[i];
            const struct ref_met cover = ref_disc_at(&points->view, &s->discs[k], x, y);
            counts[k] |= ref_blend_takes(&s->discs[k], &cover, nearest == &s->discs[k], ref_key_z(s->planes->keys[p]),
                                         (double)s->planes->deff[p]) == REF_YES;
        }
    }
    harness_keep(h, counts, s->count + 1);
    for (uint32_t i = 0; i < points->count; i++) {
        const uint32_t *got = harness_read(h, marks[i]);
        const struct instance_args *args = &s->scene->discs[i].instance;
        for (uint32_t k = 0; k < s->count; k++) {
            const uint32_t at = s->discs[k].id - args->id_base;
            if (at >= args->id_count)
                continue;
            const int shown = ref_shown(got, at);
            marked += (size_t)shown;
            if (shown > (i != BARE) || shown < (i != BARE && counts[k]))
                harness_fail(h, "marks", (int)at, (int)i, "got %d where %u counts", shown, counts[k]);
        }
    }
    return marked;
}

// Of three of the lights, what arrives is a mean that is weighted as colours are: share of light that a point's disc loses of each.
static struct ref_look light_of(const struct scenery *s, uint32_t *const *words, const uint32_t lights[3], uint32_t id)
{
    struct ref_look look = look_of(s->scene, s->paint, id);
    for (uint32_t i = 0; i < s->scene->points.count; i++) {
        const uint32_t at = id - s->scene->discs[i].instance.id_base, slots = s->scene->points.clouds[i].slots;
        for (uint32_t k = 0; k < 3 && at < slots; k++)
            look.color[k] = i == BARE ? 0.0 : (words[i][lights[k] * (size_t)slots + at] & PT_SHADOW_SUM) / (255.0 * SAMPLES);
    }
    return look;
}

// The same words by rank, every point's lights together, give the same.
static void check_ranked(struct harness *h, const struct scenery *s, struct blend_args args, uint32_t *const *words,
                         const uint32_t *expected)
{
    const struct scene *points = &s->scene->points;
    const size_t pixels = (size_t)points->view.width * points->view.height, size = LIGHTS * pixels * 4;
    struct pt_buffer *marks[MOST_INSTANCES], *lists[MOST_INSTANCES], *plane = harness_buffer(h, harness_alloc(h, size), size);
    uint32_t slots = 0, places = 1;
    for (uint32_t i = 0; i < points->count; i++)
        slots += points->clouds[i].slots;
    uint8_t *all = memset(harness_alloc(h, slots + 1), 1, slots);
    uint32_t *ranked = harness_alloc(h, LIGHTS * (slots + (size_t)1) * 4);
    for (uint32_t i = 0; i < points->count; i++) {
        const uint32_t own = points->clouds[i].slots, *each = marks_of(h, all, own, places, &places);
        marks[i] = harness_buffer(h, each, marks_size(own));
        for (size_t k = 0; k < LIGHTS * (size_t)own; k++)
            ranked[LIGHTS * (size_t)ref_shown_place(each, (uint32_t)(k % own)) + k / own] = words[i][k];
    }
    lists[0] = harness_buffer(h, ranked, LIGHTS * (slots + (size_t)1) * 4);
    for (uint32_t i = 1; i < points->count; i++)
        lists[i] = lists[0];
    args.marked = 1;
    args.step = LIGHTS;
    for (args.first = 0; args.first < LIGHTS; args.first += args.lights) {
        args.lights = LIGHTS - args.first < PT_BLEND_LIGHTS ? LIGHTS - args.first : PT_BLEND_LIGHTS;
        run_part(h, s, args, lists, marks, plane);
    }
    HARNESS_CHECK(h, !memcmp(harness_read(h, plane), expected, size));
}

static void check_light(struct harness *h, const struct scenery *s)
{
    enum { EVERY = 3 }; // pixel is looked at
    static const uint32_t lights[3] = {0, PT_BLEND_LIGHTS - 1, LIGHTS - 1};
    const struct scene *points = &s->scene->points;
    const size_t pixels = (size_t)points->view.width * points->view.height, size = LIGHTS * pixels * 4;
    struct rng rng = {pixels};
    uint32_t *words[MOST_INSTANCES];
    struct pt_buffer *lists[MOST_INSTANCES], *plane = harness_buffer(h, harness_alloc(h, size), size);
    struct ref_look *looks = harness_alloc(h, (s->count + 1) * sizeof *looks);
    for (uint32_t i = 0; i < points->count; i++) {
        const size_t count = LIGHTS * (size_t)points->clouds[i].slots;
        words[i] = harness_alloc(h, count * 4);
        for (size_t k = 0; k < count; k++)
            words[i][k] = (rng_below(&rng, 3) ? rng_below(&rng, 255 * SAMPLES + 1) : k % 2 * 255 * SAMPLES) |
                          (uint32_t)rng_next(&rng) << PT_SHADOW_SHIFT;
        lists[i] = harness_buffer(h, words[i], count * 4);
    }
    struct blend_args args = {.part = PT_BLEND_LIGHT};
    for (uint32_t k = 0; k < PT_BLEND_LIGHTS; k++)
        args.scales[k] = 1.0f / (255.0f * SAMPLES);
    for (; args.first < LIGHTS; args.first += args.lights) {
        args.lights = LIGHTS - args.first < PT_BLEND_LIGHTS ? LIGHTS - args.first : PT_BLEND_LIGHTS;
        run_part(h, s, args, lists, NULL, plane);
    }
    const uint32_t *got = harness_read(h, plane);
    check_ranked(h, s, args, words, got);
    harness_same(h, "light", got, LIGHTS * pixels, 4, 1, points->view.width);
    if (harness_settled(h))
        return;
    for (uint32_t d = 0; d < s->count; d++)
        looks[d] = light_of(s, words, lights, s->discs[d].id);
    size_t unsure = 0, shown = 0;
    struct around around = {.strip = -1};
    for (size_t p = 0; p < pixels; p += EVERY) {
        const struct ref_disc *nearest = nearest_of(s, p);
        const int x = (int)(p % points->view.width), y = (int)(p / points->view.width);
        const float n[3] = {0.0f, 0.0f, 1.0f};
        if (!nearest)
            continue;
        discs_around(h, &around, &points->view, s->discs, s->count, x, y);
        const struct ref_blend expected = ref_blend(&points->view, s->discs, looks, around.places, around.count,
                                                    (uint32_t)(nearest - s->discs), (float)ref_key_z(s->planes->keys[p]),
                                                    s->planes->deff[p], n, x, y);
        shown++;
        unsure += expected.unsure != 0;
        for (uint32_t k = 0; k < 3; k++) {
            const double lost = got[lights[k] * pixels + p] / (double)PT_SHADOW_SUM;
            const double error = expected.color_error[k] + 1.0 / (double)PT_SHADOW_SUM;
            if (!(lost <= 1.0) || (!expected.unsure && !harness_near(lost, expected.color[k], error)))
                harness_fail(h, "light", x, y, "light %u: got %.9g, expected %.9g +- %.2g", lights[k], lost, expected.color[k],
                             error);
        }
    }
    harness_unsure(h, unsure, shown, s->open);
}

// open: share of the pixels that float32 may leave open. depths: means of depth too.
static struct planes run_hard(struct harness *h, struct disc_scene *scene, const struct paint *paint, double open,
                              uint32_t depths)
{
    const struct scene *points = &scene->points;
    const size_t pixels = (size_t)points->view.width * points->view.height, head = sizeof(struct blend_args);
    struct pt_buffer *buffers[PLANES + 6 * MOST_INSTANCES];
    char args[sizeof(struct blend_args) + sizeof scene->discs];
    struct planes out;
    struct pt_buffer *keys = discs_splat(h, scene);
    struct pt_buffer *zero = harness_buffer(h, harness_alloc(h, pixels * 16), pixels * 16);
    struct pt_buffer *albedo = harness_buffer(h, harness_alloc(h, pixels * 16), pixels * 16);
    struct pt_buffer *away = harness_buffer(h, harness_alloc(h, pixels * 4), pixels * 4);
    struct pt_buffer *deff = harness_buffer(h, harness_alloc(h, pixels * 4), pixels * 4);
    struct pt_buffer *from = harness_buffer(h, harness_alloc(h, pixels * 4), pixels * 4);
    struct pt_buffer *offset = depths ? harness_buffer(h, harness_alloc(h, pixels * 4), pixels * 4) : NULL;
    uint32_t n = 0;
    buffers[n++] = keys;
    buffers[n++] = deff;
    buffers[n++] = zero;
    buffers[n++] = albedo;
    buffers[n++] = away;
    buffers[n++] = offset;
    buffers[n++] = scene->bins;
    buffers[n++] = NULL; // drawn
    for (uint32_t i = 0; i < points->count; i++) {
        const struct cloud *cloud = &points->clouds[i];
        struct pt_buffer *surfels = harness_buffer(h, cloud->surfels, 4 * (size_t)cloud->slots);
        const struct resolve_args of_pixels = {.view = points->view, .instance = scene->discs[i].instance};
        HARNESS_RUN(h, resolve, &of_pixels, keys, surfels, zero, deff, from, NULL, NULL);
        buffers[n++] = harness_buffer(h, cloud->chunks, cloud->chunk_count * sizeof *cloud->chunks);
        buffers[n++] = points_positions(h, cloud->chunks, cloud->chunk_count, cloud->positions, cloud->slots);
        buffers[n++] = surfels;
        buffers[n++] = harness_buffer(h, scene->radii[i], 4 * (size_t)cloud->slots);
        buffers[n++] = harness_buffer(h, paint->colors[i], paint->color_bytes[i]);
        buffers[n++] = harness_buffer(h, paint->opacities[i], cloud->slots + 4);
        buffers[n++] = NULL; // marks
    }
    const struct blend_args blend = {.view = points->view, .instances = points->count, .depths = depths};
    memcpy(args, &blend, head);
    memcpy(args + head, scene->discs, points->count * sizeof *scene->discs);
    out.keys = harness_read(h, keys);
    out.deff = harness_read(h, deff);
    out.normal = harness_read(h, zero);
    float *before = harness_alloc(h, pixels * 16);
    memcpy(before, out.normal, pixels * 16);
    harness_run(h, PT_KERNEL_blend, args, head + points->count * sizeof *scene->discs, buffers, n);
    out.normal = harness_read(h, zero);
    out.albedo = harness_read(h, albedo);
    out.away = harness_read(h, away);
    for (size_t p = 0; p < pixels; p++) // undefined there
        if (out.keys[p] == REF_EMPTY_KEY) {
            memset(before + 4 * p, 0, 16);
            out.deff[p] = 0.0f;
        }
    harness_same(h, "keys", out.keys, pixels, 8, 1, points->view.width); // what the reference takes of the device
    harness_same(h, "deff", out.deff, pixels, 4, 1, points->view.width);
    harness_same(h, "normal before", before, pixels * 4, 4, 4, points->view.width);
    harness_same(h, "normal", out.normal, pixels * 4, 4, 4, points->view.width);
    harness_same(h, "albedo", out.albedo, pixels * 4, 4, 4, points->view.width);
    harness_same(h, "away", out.away, pixels, 4, 1, points->view.width);
    out.offset = depths ? harness_read(h, offset) : NULL;
    if (depths)
        harness_same(h, "offset", out.offset, pixels, 4, 1, points->view.width);
    // the reference needs the normals as they were
    uint32_t count;
    const struct ref_disc *discs = discs_reference(h, scene, &count);
    struct ref_look *looks = harness_alloc(h, (count + 1) * sizeof *looks);
    double least[4] = {INFINITY, INFINITY, INFINITY, INFINITY}, most[4] = {-INFINITY, -INFINITY, -INFINITY, -INFINITY};
    for (uint32_t i = 0; i < count; i++) {
        looks[i] = look_of(scene, paint, discs[i].id);
        for (int k = 0; k < 4; k++) {
            const double term = k == 3 ? looks[i].opacity
                                       : fmax(fmin(looks[i].color[k], (double)PT_SUM_BRIGHTEST), -(double)PT_SUM_BRIGHTEST);
            least[k] = fmin(least[k], term);
            most[k] = fmax(most[k], term);
        }
    }
    size_t unsure = 0, unsure_depth = 0, shown = 0;
    struct around around = {.strip = -1};
    for (size_t p = 0; p < pixels && !harness_settled(h); p++) {
        const int x = (int)(p % points->view.width), y = (int)(p / points->view.width);
        if (out.keys[p] == REF_EMPTY_KEY)
            continue;
        const struct ref_disc *nearest = discs_find(discs, count, ref_key_id(out.keys[p]));
        HARNESS_CHECK(h, nearest != NULL);
        if (!nearest)
            continue;
        discs_around(h, &around, &points->view, discs, count, x, y);
        const struct ref_blend expected = ref_blend(&points->view, discs, looks, around.places, around.count,
                                                    (uint32_t)(nearest - discs), (float)ref_key_z(out.keys[p]), out.deff[p],
                                                    before + 4 * p, x, y);
        shown++;
        // whatever float32 cannot decide, a mean lies between what is blended
        for (int k = 0; k < 4; k++) {
            const double got = out.albedo[4 * p + (size_t)k], slack = 1e-3 + 1e-3 * (fabs(least[k]) + fabs(most[k]));
            if (!(got >= fmin(least[k], 0.0) - slack && got <= fmax(most[k], 0.0) + slack))
                harness_fail(h, "albedo", x, y, "channel %d: got %.9g, all there is lies from %.9g to %.9g", k, got, least[k],
                             most[k]);
        }
        const float *mean = out.normal + 4 * p;
        if (!(sqrt((double)mean[0] * mean[0] + (double)mean[1] * mean[1] + (double)mean[2] * mean[2]) < 1.0 + 1e-5))
            harness_fail(h, "normal", x, y, "got %.9g %.9g %.9g", mean[0], mean[1], mean[2]);
        if (depths && !expected.unsure_offset && !harness_near(out.offset[p], expected.offset, expected.offset_error))
            harness_fail(h, "offset", x, y, "got %.9g, expected %.9g +- %.2g", out.offset[p], expected.offset,
                         expected.offset_error);
        unsure_depth += expected.unsure_offset != 0;
        unsure += expected.unsure != 0;
        if (expected.unsure)
            continue;
        for (int k = 0; k < 4; k++)
            if (!harness_near(out.albedo[4 * p + (size_t)k], expected.color[k], expected.color_error[k]))
                harness_fail(h, "albedo", x, y, "channel %d: got %.9g, expected %.9g +- %.2g", k, out.albedo[4 * p + (size_t)k],
                             expected.color[k], expected.color_error[k]);
        const double n_of[3] = {expected.n.x, expected.n.y, expected.n.z};
        for (int k = 0; k < 3; k++)
            if (!harness_near(out.normal[4 * p + (size_t)k], n_of[k], expected.normal_error))
                harness_fail(h, "normal", x, y, "axis %d: got %.9g, expected %.9g +- %.2g", k, out.normal[4 * p + (size_t)k],
                             n_of[k], expected.normal_error);
        if (!harness_near(out.away[p], expected.away, TOL_DISTANCE * expected.away))
            harness_fail(h, "away", x, y, "got %.9g, expected %.9g", out.away[p], expected.away);
        if (out.normal[4 * p + 3] != before[4 * p + 3])
            harness_fail(h, "normal", x, y, "1 / cosine: got %.9g, it was %.9g", out.normal[4 * p + 3], before[4 * p + 3]);
    }
    harness_unsure(h, unsure, shown, open);
    harness_unsure(h, unsure_depth, shown, open);
    struct scenery scenery = {
        .scene = scene, .paint = paint, .planes = &out, .discs = discs, .count = count, .buffer_count = n, .open = open};
    memcpy(scenery.buffers, buffers, n * sizeof *buffers);
    out.marked = check_marks(h, &scenery);
    check_light(h, &scenery);
    return out;
}

static struct planes run(struct harness *h, struct disc_scene *scene, const struct paint *paint)
{
    return run_hard(h, scene, paint, TOL_UNSURE_SHARE, 1);
}

static void random_discs(struct harness *h, int perspective, uint32_t seed, double largest, int with_normals)
{
    struct rng rng = {seed};
    const double focal = perspective ? 60.0 : 20.0;
    struct disc_scene scene = {.points = {.view = discs_window(67, 45, perspective, focal)}};
    for (uint32_t i = 0; i < 3; i++) {
        struct camera camera = points_look(&rng, &scene.points.view, focal, 4.0);
        points_scatter_about(&rng, points_add_cloud(h, &rng, &scene.points, &camera, sizes, SIZES, i == 1, i * 5000),
                             i == 0 ? 1.0 : 1.8);
        discs_describe(h, &rng, &scene, i, &camera, i == 1 ? 0.1f : 0.0f, largest, with_normals && i != 2);
    }
    const struct paint colors = paint(h, &rng, &scene);
    run(h, &scene, &colors);
}

static void perspective(struct harness *h) { random_discs(h, 1, 1, 0.2, 1); }

static void orthographic(struct harness *h) { random_discs(h, 0, 2, 0.2, 1); }

static void no_normals(struct harness *h) { random_discs(h, 1, 3, 0.2, 0); }

static void ellipses(struct harness *h)
{
    for (int p = 0; p < 2; p++) {
        struct rng rng = {9};
        const double focal = p ? 60.0 : 20.0;
        struct disc_scene scene = {.points = {.view = discs_window(67, 45, p, focal)}};
        for (uint32_t i = 0; i < 2; i++) {
            struct camera camera = points_look(&rng, &scene.points.view, focal, 4.0);
            points_scatter_about(&rng, points_add_cloud(h, &rng, &scene.points, &camera, sizes, SIZES, 0, i * 5000),
                                 i ? 1.8 : 1.0);
            discs_describe(h, &rng, &scene, i, &camera, 0.0f, 0.2, 1);
            discs_shape(h, &rng, &scene, i, &camera, NULL);
        }
        const struct paint colors = paint(h, &rng, &scene);
        run(h, &scene, &colors);
    }
}

// In the midst of leaves, half transparent, larger than they are far; and of discs beside the camera.
static void camera_plane(struct harness *h)
{
    struct rng rng = {10};
    struct disc_scene scene = {.points = {.view = discs_window(67, 45, 1, 60.0)}};
    struct camera camera = points_look(&rng, &scene.points.view, 60.0, 0.0);
    points_scatter_about(&rng, points_add_cloud(h, &rng, &scene.points, &camera, sizes, SIZES, 0, 0), 1.0);
    discs_describe(h, &rng, &scene, 0, &camera, 0.0f, 0.6, 1);
    for (uint32_t i = 0; i < scene.points.clouds[0].slots; i++)
        scene.points.clouds[0].surfels[i] = (uint32_t)rng_next(&rng);
    for (int i = 0; i < 2; i++)
        discs_beside(h, &rng, &scene, 60.0, 0.25f);
    const struct paint colors = paint(h, &rng, &scene);
    scene.discs[0].instance.opacity = 0.5f;
    run_hard(h, &scene, &colors, TOL_UNSURE_HARD, 0);
}

static void under_a_pixel(struct harness *h)
{
    random_discs(h, 1, 4, 1e-3, 1);
    random_discs(h, 0, 5, 0.0, 1);
}

// A flat sheet of many discs of one colour gives that colour and that normal, exactly opaque.
static void sheet(struct harness *h)
{
    static const uint32_t many[] = {4000, 4000, 4000};
    struct rng rng = {6};
    struct disc_scene scene = {.points = {.view = discs_window(67, 45, 0, 20.0)}};
    struct camera camera = {.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}, .shift = {0, 0, -4}, .focal = 20.0};
    camera.center_x = scene.points.view.origin_x + 33.5;
    camera.center_y = scene.points.view.origin_y + 22.5;
    struct cloud *cloud = points_add_cloud(h, &rng, &scene.points, &camera, many, 3, 0, 0);
    for (uint32_t c = 0; c < 3; c++)
        for (uint32_t i = 0; i < many[c]; i++) {
            *points_coordinate(cloud, c, i, 0) = (float)rng_range(&rng, -2.0, 2.0);
            *points_coordinate(cloud, c, i, 1) = (float)rng_range(&rng, -2.0, 2.0);
        }
    for (uint32_t i = 0; i < cloud->slots; i++)
        cloud->surfels[i] = 4095u | 4095u << 13;
    discs_describe(h, &rng, &scene, 0, &camera, 0.2f, 0.0, 1);
    struct paint colors = paint(h, &rng, &scene);
    memset(colors.colors[0], 128, colors.color_bytes[0]);
    const struct planes planes = run(h, &scene, &colors);
    for (size_t p = 0; p < (size_t)67 * 45; p++) {
        if (planes.keys[p] == REF_EMPTY_KEY)
            continue;
        if (!harness_near(planes.albedo[4 * p], ref_srgb(128), 1e-5) || planes.albedo[4 * p + 3] != 1.0f)
            harness_fail(h, "albedo", (int)(p % 67), (int)(p / 67), "got %.9g, opacity %.9g", planes.albedo[4 * p],
                         planes.albedo[4 * p + 3]);
        HARNESS_CHECK(h, harness_near(planes.normal[4 * p + 2], 1.0, 1e-6));
    }
}

// Of two sheets that lie one unit apart, points of the nearer alone are marked, as far as they are in view: 0.6 of 3000.
static void hidden(struct harness *h)
{
    static const uint32_t many[] = {3000, 3000};
    struct rng rng = {11};
    struct disc_scene scene = {.points = {.view = discs_window(67, 45, 0, 20.0)}};
    struct camera camera = {.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}, .shift = {0, 0, -4}, .focal = 20.0};
    camera.center_x = scene.points.view.origin_x + 33.5;
    camera.center_y = scene.points.view.origin_y + 22.5;
    struct cloud *cloud = points_add_cloud(h, &rng, &scene.points, &camera, many, 2, 0, 0);
    for (uint32_t c = 0; c < 2; c++)
        for (uint32_t i = 0; i < many[c]; i++) {
            *points_coordinate(cloud, c, i, 0) = (float)rng_range(&rng, -2.0, 2.0);
            *points_coordinate(cloud, c, i, 1) = (float)rng_range(&rng, -2.0, 2.0);
            *points_coordinate(cloud, c, i, 2) -= c ? 1.0f : 0.0f;
        }
    for (uint32_t i = 0; i < cloud->slots; i++)
        cloud->surfels[i] = 4095u | 4095u << 13;
    discs_describe(h, &rng, &scene, 0, &camera, 0.2f, 0.0, 1);
    const struct paint colors = paint(h, &rng, &scene);
    const size_t marked = run(h, &scene, &colors).marked;
    HARNESS_CHECK(h, marked > 1600 && marked < 2000);
}

// So many bright discs in one place that sums pass 32 bits.
static void overflow(struct harness *h)
{
    static const uint32_t many[] = {4096, 4096, 4096, 100};
    struct rng rng = {7};
    struct disc_scene scene = {.points = {.view = discs_window(17, 9, 1, 60.0)}};
    struct camera camera = points_look(&rng, &scene.points.view, 60.0, 4.0);
    camera.shift[0] = camera.shift[1] = 0.0;
    struct cloud *cloud = points_add_cloud(h, &rng, &scene.points, &camera, many, 4, 0, 0);
    for (uint32_t i = 0; i < cloud->slots; i++)
        cloud->surfels[i] = PT_NORMAL_NONE;
    discs_describe(h, &rng, &scene, 0, &camera, 0.05f, 0.0, 0);
    scene.discs[0].instance.color_format = 2;
    struct paint colors = {.color_bytes = {12 * (size_t)cloud->slots + 4}};
    colors.colors[0] = harness_alloc(h, colors.color_bytes[0]);
    colors.opacities[0] = harness_alloc(h, cloud->slots + 4);
    for (uint32_t i = 0; i < cloud->slots; i++) {
        float *rgb = (float *)colors.colors[0] + 3 * (size_t)i;
        rgb[0] = 4000.0f;
        rgb[1] = i % 2 ? -3000.0f : 1000.0f;
        rgb[2] = 1e-3f;
    }
    const struct planes planes = run(h, &scene, &colors);
    size_t shown = 0;
    for (size_t p = 0; p < (size_t)17 * 9; p++) {
        if (planes.keys[p] == REF_EMPTY_KEY)
            continue;
        shown++;
        const float *got = planes.albedo + 4 * p;
        HARNESS_CHECK(h, harness_near(got[0], 4000.0, 0.01) && harness_near(got[1], -1000.0, 0.01) &&
                             harness_near(got[2], 1e-3, 1e-5));
    }
    HARNESS_CHECK(h, shown > 0);
}

static void plane_sizes(struct harness *h)
{
    static const uint32_t shapes[][2] = {{1, 1}, {16384, 1}, {1, 333}};
    struct rng rng = {8};
    for (size_t i = 0; i < sizeof shapes / sizeof shapes[0]; i++) {
        struct disc_scene scene = discs_in_window(h, &rng, shapes[i][0], shapes[i][1], 0.01);
        const struct paint colors = paint(h, &rng, &scene);
        run(h, &scene, &colors);
    }
}

// Reference alone: two discs in one pixel, at the middle and at the rim of a third's.
static void sanity(struct harness *h)
{
    const struct view_args view = discs_window(64, 64, 0, 10.0);
    struct ref_disc discs[2] = {
        {.id = 0, .possible = 1, .definite = 1, .n = {0, 0, 1}, .has_normal = 1, .has_normals = 1, .radius = 1.0}};
    discs[0].place = (struct ref_place){1, {48.5, 48.5}, {40.5, 40.5}, {2.0, 2.0}};
    discs[1] = discs[0];
    discs[1].id = 1;
    discs[1].place.x = (struct ref_range){53.5, 53.5}; // half a radius off
    const struct ref_look looks[2] = {{{1.0, 0.0, 0.0}, 1.0}, {{0.0, 1.0, 0.0}, 1.0}};
    const float n[3] = {0.0f, 0.0f, 1.0f};
    const uint32_t around[2] = {0, 1};
    const struct ref_blend both = ref_blend(&view, discs, looks, around, 2, 0, 2.0f, 0.5f, n, 32, 32);
    HARNESS_CHECK(h, !both.unsure && harness_near(both.color[0], 1.0 / (1.0 + exp(-0.5)), 1e-3));
    HARNESS_CHECK(h, both.away == 0.0 && both.color[3] == 1.0 && both.n.z > 0.999);
    discs[1].place.z = (struct ref_range){3.0, 3.0};
    HARNESS_CHECK(h, ref_blend(&view, discs, looks, around, 2, 0, 2.0f, 0.5f, n, 32, 32).color[0] == 1.0);
}

static void packed(struct harness *h)
{
    points_packed(h, perspective);
    points_packed(h, orthographic);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"packed positions", packed, 0},
        {"sanity", sanity, 1},
        {"random discs, perspective", perspective, 0},
        {"random discs, orthographic", orthographic, 0},
        {"without normals", no_normals, 0},
        {"ellipses", ellipses, 0},
        {"leaves around the camera", camera_plane, 0},
        {"discs under a pixel", under_a_pixel, 0},
        {"a sheet of one colour", sheet, 0},
        {"a sheet behind another", hidden, 0},
        {"sums beyond 32 bits", overflow, 0},
        {"plane sizes", plane_sizes, 0},
    };
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
