// SPDX-License-Identifier: GPL-3.0-or-later
// Depth peeling and transparency against exact truth [D 4, 5], SPEC 3: three nested tori whose layers are known ray by ray,
// parallel planes, opacities of exactly 0 and 1, and chunks that are left out for nothing to be missed.
#include "clouds.h"
#include "run/frame.h"
#include "run/layers.h"
#include "run/residency.h"
#include "support.h"
#include "shared/points.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// ---- tori, ray by ray ------------------------------------------------------------------------------------------------

enum { TORI = 3, MOST_HITS = 4 * TORI, CUT = 6, SIZE = 1024 };

static const double ring = 1.0, tube[TORI] = {0.2, 0.32, 0.44}; // innermost first
static const float transparency[TORI] = {0.0f, 0.5f, 0.7f};
static const float tint[TORI][3] = {{0.6f, 0.3f, 0.1f}, {0.1f, 0.6f, 0.2f}, {0.1f, 0.2f, 0.8f}};

struct hit {
    double z, cosine; // |n.v|
    int torus;
};

static double polynomial(const double *c, int degree, double t)
{
    double value = c[degree];
    for (int i = degree; i > 0; i--)
        value = value * t + c[i - 1];
    return value;
}

// Real roots of c[0] + c[1] t + ... between low and high, ascending: one lies between two turning points of other signs.
static int real_roots(const double *c, int degree, double low, double high, double *roots)
{
    double turns[8], slope[8];
    int turn_count = 0, count = 0;
    for (int i = 0; i < degree; i++)
        slope[i] = (i + 1) * c[i + 1];
    if (degree > 1)
        turn_count = real_roots(slope, degree - 1, low, high, turns);
    for (int i = 0; i <= turn_count; i++) {
        double a = i ? turns[i - 1] : low, b = i < turn_count ? turns[i] : high;
        double fa = polynomial(c, degree, a), fb = polynomial(c, degree, b);
        if (fa * fb > 0.0 || fa == 0.0)
            continue;
        for (int k = 0; k < 100 && b - a > 0.0; k++) {
            double middle = 0.5 * (a + b), f = polynomial(c, degree, middle);
            if ((f < 0.0) == (fa < 0.0))
                a = middle;
            else
                b = middle;
        }
        roots[count++] = 0.5 * (a + b);
    }
    return count;
}

// (|p|^2 + R^2 - r^2)^2 = 4 R^2 (x^2 + y^2) along p = o + t d.
static int cast_torus(const double o[3], const double d[3], double r, double *roots)
{
    double dd = d[0] * d[0] + d[1] * d[1] + d[2] * d[2], od = o[0] * d[0] + o[1] * d[1] + o[2] * d[2];
    double k = o[0] * o[0] + o[1] * o[1] + o[2] * o[2] + ring * ring - r * r, f = 4.0 * ring * ring;
    const double c[5] = {k * k - f * (o[0] * o[0] + o[1] * o[1]), 4.0 * od * k - 2.0 * f * (o[0] * d[0] + o[1] * d[1]),
                         2.0 * dd * k + 4.0 * od * od - f * (d[0] * d[0] + d[1] * d[1]), 4.0 * dd * od, dd * dd};
    return real_roots(c, 4, 0.1, 20.0, roots);
}

static double cosine_at(const double o[3], const double d[3], double t)
{
    double p[3] = {o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]}, across = sqrt(p[0] * p[0] + p[1] * p[1]);
    double n[3] = {p[0] * (1.0 - ring / across), p[1] * (1.0 - ring / across), p[2]};
    double nn = n[0] * n[0] + n[1] * n[1] + n[2] * n[2], dd = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    return fabs(n[0] * d[0] + n[1] * d[1] + n[2] * d[2]) / sqrt(nn * dd);
}

static int by_depth(const void *a, const void *b)
{
    double x = ((const struct hit *)a)->z, y = ((const struct hit *)b)->z;
    return (x > y) - (x < y);
}

static int cast_tori(const double o[3], const double d[3], struct hit hits[MOST_HITS])
{
    int count = 0;
    for (int k = 0; k < TORI; k++) {
        double roots[4];
        int found = cast_torus(o, d, tube[k], roots);
        for (int i = 0; i < found; i++)
            hits[count++] = (struct hit){roots[i], cosine_at(o, d, roots[i]), k};
    }
    qsort(hits, (size_t)count, sizeof *hits, by_depth);
    return count;
}

struct truth {
    struct hit hits[MOST_HITS];
    int count;
    uint32_t order; // which tori, in which order: equal where no contour lies between
};

static struct truth *tori_truth(const patina_camera *camera)
{
    struct truth *truth = malloc((size_t)SIZE * SIZE * sizeof *truth);
    assert_non_null(truth);
    for (uint32_t i = 0; i < SIZE * SIZE; i++) {
        double origin[3], direction[3];
        camera_ray(camera, SIZE, SIZE, i % SIZE + 0.5, i / SIZE + 0.5, origin, direction);
        truth[i].count = cast_tori(origin, direction, truth[i].hits);
        truth[i].order = 1;
        for (int k = 0; k < truth[i].count; k++)
            truth[i].order = truth[i].order << 2 | (uint32_t)truth[i].hits[k].torus;
    }
    return truth;
}

// At least 3 pixels from every layer's contour, and no surface of the first six seen flatter than |n.v| = 0.2.
static int is_interior(const struct truth *truth, uint32_t x, uint32_t y)
{
    const struct truth *own = &truth[y * SIZE + x];
    if (!own->count || x < 3 || y < 3 || x + 3 >= SIZE || y + 3 >= SIZE)
        return 0;
    for (int k = 0; k < own->count && k < CUT; k++)
        if (own->hits[k].cosine < 0.2)
            return 0;
    for (int dy = -3; dy <= 3; dy++)
        for (int dx = -3; dx <= 3; dx++)
            if (dx * dx + dy * dy <= 9 && truth[(int)(y * SIZE + x) + dy * SIZE + dx].order != own->order)
                return 0;
    return 1;
}

static double true_transmittance(const struct truth *truth, int cut)
{
    double through = 1.0;
    for (int k = 0; k < truth->count && k < cut; k++)
        through *= (double)transparency[truth->hits[k].torus];
    return through;
}

// ---- the picture -------------------------------------------------------------------------------------------------------

static patina_scene *tori_scene(uint64_t points, patina_cloud *clouds[TORI])
{
    patina_scene *scene = NULL;
    CHECK(patina_scene_create(&scene), NULL);
    for (int k = 0; k < TORI; k++) {
        struct points torus = points_torus(points, ring, tube[k], POINTS_NORMALS, 40 + (uint64_t)k);
        clouds[k] = points_upload(&torus);
        points_free(&torus);
        patina_cloud_style style = {.struct_size = sizeof style, .lighting = PATINA_LIGHTING_UNLIT};
        style.transparency = transparency[k];
        memcpy(style.color, tint[k], sizeof style.color);
        CHECK(patina_scene_add_cloud(scene, clouds[k], &style), scene);
    }
    return scene;
}

struct tally {
    uint64_t interior, good, all, all_good, glassy, glassy_good; // glassy: light comes through
    double worst;
};

static struct tally compare_transmittance(const struct truth *truth, const struct picture *picture)
{
    struct tally tally = {0};
    for (uint32_t i = 0; i < SIZE * SIZE; i++) {
        double expected = true_transmittance(&truth[i], CUT);
        double error = fabs(1.0 - (double)picture->combined[4 * i + 3] - expected);
        int good = error <= 1.0 / 255.0;
        if (truth[i].count || picture->combined[4 * i + 3] > 0.0f) {
            tally.all++;
            tally.all_good += good;
        }
        if (!is_interior(truth, i % SIZE, i / SIZE))
            continue;
        tally.interior++;
        tally.good += good;
        tally.glassy += expected > 0.0;
        tally.glassy_good += expected > 0.0 && good;
        tally.worst = fmax(tally.worst, error);
    }
    return tally;
}

struct layer_tally {
    uint64_t pixels, right, missing, other; // other: another torus, or not at its depth
    double depth_rms;                       // of the right ones, in world units
};

static struct layer_tally compare_layer(const struct truth *truth, const struct picture *picture, int layer, double near)
{
    const float *depth = picture->layer_depth + (size_t)layer * SIZE * SIZE;
    const float *color = picture->layer_combined + 4 * (size_t)layer * SIZE * SIZE;
    struct layer_tally tally = {0};
    for (uint32_t i = 0; i < SIZE * SIZE; i++) {
        if (!is_interior(truth, i % SIZE, i / SIZE))
            continue;
        if (truth[i].count <= layer) { // no surface there
            tally.other += depth[i] < HUGE_VALF;
            continue;
        }
        const struct hit *hit = &truth[i].hits[layer];
        tally.pixels++;
        if (depth[i] == HUGE_VALF) {
            tally.missing++;
            continue;
        }
        int right = fabs((double)depth[i] - hit->z) <= near / hit->cosine;
        for (int c = 0; c < 3; c++)
            right &= fabs((double)color[4 * i + (uint32_t)c] -
                          (double)tint[hit->torus][c] * (1.0 - (double)transparency[hit->torus])) < 1e-3;
        tally.right += (uint64_t)right;
        tally.other += (uint64_t)!right;
        if (right)
            tally.depth_rms += ((double)depth[i] - hit->z) * ((double)depth[i] - hit->z);
    }
    tally.depth_rms = sqrt(tally.depth_rms / fmax((double)tally.right, 1.0));
    return tally;
}

static double percent(uint64_t part, uint64_t whole) { return whole ? 100.0 * (double)part / (double)whole : 100.0; }

// Six million points, six layers.
static void test_nested_tori(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    patina_cloud *clouds[TORI];
    patina_scene *scene = tori_scene(2000000, clouds);
    const double eye[3] = {0.0, -3.3, 2.8}, target[3] = {0.0, 0.0, 0.0};
    patina_camera camera = camera_perspective(eye, target, 36.0, SIZE, SIZE, 0.5, 10.0);
    struct truth *truth = tori_truth(&camera);
    patina_settings settings = settings_default(SIZE, SIZE);
    settings.film_transparent = 1;
    settings.layers = CUT;
    struct picture picture = picture_render(device, scene, &camera, &settings);
    struct tally t = compare_transmittance(truth, &picture);
    printf("  transmittance within 1/255: %.3f%% of %llu interior pixels (worst %.3f), %.3f%% of the %llu that let light\n"
           "  through, %.3f%% of all %llu pixels that show something\n",
           percent(t.good, t.interior), (unsigned long long)t.interior, t.worst, percent(t.glassy_good, t.glassy),
           (unsigned long long)t.glassy, percent(t.all_good, t.all), (unsigned long long)t.all);
    assert_true(t.interior > 100000 && t.glassy > 30000);
    assert_true(percent(t.good, t.interior) >= 99.9 && percent(t.glassy_good, t.glassy) >= 99.9);
    picture_free(&picture);

    settings.layer_passes = 1u << PATINA_PASS_COMBINED | 1u << PATINA_PASS_DEPTH | 1u << PATINA_PASS_NORMAL;
    picture = picture_render(device, scene, &camera, &settings);
    for (int layer = 0; layer < CUT; layer++) {
        double spacing = sqrt(area_torus(ring, tube[TORI - 1]) / 2e6);
        struct layer_tally l = compare_layer(truth, &picture, layer, 2.0 * spacing);
        printf("  layer %d: %.3f%% of %llu interior pixels show its surface, %.3f%% nothing, %.3f%% another; depth rms %.2f "
               "spacings\n",
               layer + 1, percent(l.right, l.pixels), (unsigned long long)l.pixels, percent(l.missing, l.pixels),
               percent(l.other, l.pixels), l.depth_rms / spacing);
        assert_true(percent(l.right, l.pixels) >= 99.9);
    }
    picture_free(&picture);
    free(truth);
    patina_scene_destroy(scene);
    for (int k = 0; k < TORI; k++)
        patina_cloud_destroy(clouds[k]);
    patina_device_destroy(device);
}

// ---- parallel planes ---------------------------------------------------------------------------------------------------

enum { SIDE = 24, PLANES = 3 };

struct sheet {
    double height; // z in the world; the camera looks down from 4
    float transparency, color[3];
    const float *opacities; // of SIDE x SIDE points, or NULL
};

// Sheets of a point a pixel, seen from above; d~ is 0.5.
static patina_scene *sheets(const struct sheet *sheet, int count, patina_cloud **clouds)
{
    patina_scene *scene = NULL;
    CHECK(patina_scene_create(&scene), NULL);
    for (int k = 0; k < count; k++) {
        struct points points = points_grid(SIDE, SIDE, 1.0 / 16.0, POINTS_NORMALS);
        for (uint64_t i = 0; i < points.count; i++)
            points.position[3 * i + 2] = (float)sheet[k].height;
        patina_cloud_desc desc = points_desc(&points);
        desc.opacity = (patina_array){.data = sheet[k].opacities, .type = PATINA_FLOAT32, .components = 1};
        CHECK(patina_cloud_create(&desc, NULL, &clouds[k]), NULL);
        points_free(&points);
        patina_cloud_style style = {.struct_size = sizeof style, .lighting = PATINA_LIGHTING_UNLIT, .d_min = 0.5f};
        style.transparency = sheet[k].transparency;
        memcpy(style.color, sheet[k].color, sizeof style.color);
        CHECK(patina_scene_add_cloud(scene, clouds[k], &style), scene);
    }
    return scene;
}

static struct picture draw_sheets(patina_device *device, const struct sheet *sheet, int count, uint32_t layers,
                                  patina_frame_stats *stats)
{
    const double eye[3] = {0.0, 0.0, 4.0}, target[3] = {0.0, 0.0, 0.0};
    patina_camera camera = camera_orthographic(eye, target, SIDE / 16.0, SIDE, SIDE, 0.0, 8.0);
    patina_settings settings = settings_default(SIDE, SIDE);
    patina_cloud *clouds[8];
    patina_scene *scene = sheets(sheet, count, clouds);
    patina_frame *frame = NULL;
    settings.film_transparent = 1;
    settings.layers = layers;
    CHECK(patina_scene_set_camera(scene, &camera), scene);
    CHECK(patina_scene_set_settings(scene, &settings), scene);
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_frame_render(frame, scene), frame);
    struct picture picture = picture_read(frame);
    if (stats)
        CHECK(patina_frame_get_stats(frame, stats), frame);
    patina_frame_destroy(frame);
    patina_scene_destroy(scene);
    for (int k = 0; k < count; k++)
        patina_cloud_destroy(clouds[k]);
    return picture;
}

static const float *middle(const struct picture *picture) { return picture->combined + 4 * (SIDE / 2 * SIDE + SIDE / 2); }

// Three sheets of glass blend as the sum says, down to the cap.
static void blend_sheets(patina_device *device, const char *name)
{
    (void)name;
    static const struct sheet sheet[PLANES] = {
        {0.0, 0.25f, {0.1f, 0.2f, 0.9f}, NULL}, {2.0, 0.5f, {0.9f, 0.4f, 0.1f}, NULL}, {1.0, 0.7f, {0.2f, 0.8f, 0.3f}, NULL}};
    static const int order[PLANES] = {1, 2, 0}; // from the eye
    for (uint32_t layers = 0; layers <= PLANES + 1; layers++) {
        patina_frame_stats stats = {.struct_size = sizeof stats};
        struct picture picture = draw_sheets(device, sheet, PLANES, layers, &stats);
        double through = 1.0, expected[4] = {0.0};
        int most = layers && layers < PLANES ? (int)layers : PLANES;
        for (int k = 0; k < most; k++) {
            const struct sheet *s = &sheet[order[k]];
            double opacity = 1.0 - (double)s->transparency;
            for (int c = 0; c < 4; c++)
                expected[c] += through * opacity * (c < 3 ? (double)s->color[c] : 1.0);
            through *= (double)s->transparency;
        }
        for (int c = 0; c < 4; c++)
            assert_true(fabs((double)middle(&picture)[c] - expected[c]) < 1e-6);
        assert_int_equal(stats.layers, most);
        picture_free(&picture);
    }
}

static void test_sheets(void **state)
{
    (void)state;
    support_each_device(blend_sheets);
}

// d_eff is 0.5 and z about 2.5, where 8 ulp are 2^-19: a sheet that much nearer belongs to the first layer.
static void part_sheets(patina_device *device, const char *name)
{
    (void)name;
    for (int side = -1; side <= 1; side += 2) {
        const struct sheet sheet[2] = {{2.0, 0.5f, {1.0f, 0.0f, 0.0f}, NULL},
                                       {1.5 - side * 0x1p-19, 0.5f, {0.0f, 1.0f, 0.0f}, NULL}};
        patina_frame_stats stats = {.struct_size = sizeof stats};
        struct picture picture = draw_sheets(device, sheet, 2, 4, &stats);
        assert_int_equal(stats.layers, side > 0 ? 2 : 1);
        assert_true(fabs((double)middle(&picture)[3] - (side > 0 ? 0.75 : 0.5)) < 1e-6);
        assert_true(fabs((double)middle(&picture)[1] - (side > 0 ? 0.25 : 0.0)) < 1e-6);
        picture_free(&picture);
    }
}

static void test_layer_distance(void **state)
{
    (void)state;
    support_each_device(part_sheets);
}

// Exactly 0: objects and points are not there. Exactly 1: one layer, the picture of opaque things.
static void exact_opacities(patina_device *device, const char *name)
{
    (void)name;
    static float none[SIDE * SIDE], all[SIDE * SIDE], odd[SIDE * SIDE];
    for (int i = 0; i < SIDE * SIDE; i++) {
        all[i] = 1.0f + (float)(i % 3); // clamped
        odd[i] = i % 2 ? NAN : 7.0f;
    }
    const struct sheet back = {1.0, 0.0f, {0.3f, 0.6f, 0.2f}, NULL};
    struct sheet pair[2] = {back, {2.0, 1.0f, {0.9f, 0.1f, 0.1f}, NULL}};
    patina_frame_stats stats = {.struct_size = sizeof stats};
    struct picture alone = draw_sheets(device, &back, 1, 0, &stats);
    assert_int_equal(stats.layers, 1);
    struct picture picture = draw_sheets(device, pair, 2, 0, &stats);
    picture_assert_identical(&picture, &alone, 0, 0, "an object of opacity 0");
    assert_int_equal(stats.layers, 1);
    picture_free(&picture);

    pair[1].transparency = 0.0f;
    pair[1].opacities = none;
    picture = draw_sheets(device, pair, 2, 0, &stats);
    picture_assert_identical(&picture, &alone, 0, 0, "points of opacity 0");
    assert_int_equal(stats.layers, 1);
    picture_free(&picture);
    picture_free(&alone);

    pair[1].opacities = NULL;
    alone = draw_sheets(device, pair, 2, 0, NULL);
    for (int way = 0; way < 2; way++) {
        pair[1].opacities = way ? odd : all;
        picture = draw_sheets(device, pair, 2, 0, &stats);
        picture_assert_identical(&picture, &alone, 0, 0, "points of opacity 1");
        assert_int_equal(stats.layers, 1);
        picture_free(&picture);
    }
    picture_free(&alone);

    pair[1].opacities = NULL; // opaque in a scene of glass: nothing behind it is peeled
    pair[0].transparency = 0.5f;
    picture = draw_sheets(device, pair, 2, 0, &stats);
    assert_int_equal(stats.layers, 1);
    assert_true(fabsf(middle(&picture)[3] - 1.0f) < 1e-6f && fabsf(middle(&picture)[0] - 0.9f) < 1e-6f);
    picture_free(&picture);
}

static void test_exact_opacities(void **state)
{
    (void)state;
    support_each_device(exact_opacities);
}

// Depth, normal, source and keys show the first layer, whatever its opacity.
static void test_first_layer(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    const double eye[3] = {0.3, -2.7, 2.3}, target[3] = {0.0, 0.0, 0.0};
    patina_camera camera = camera_perspective(eye, target, 45.8, 203, 151, 0.1, 100.0);
    patina_settings settings = settings_default(203, 151);
    struct points points = points_torus(30000, 1.0, 0.4, POINTS_ALL, 3);
    patina_cloud *cloud = points_upload(&points);
    points_free(&points);
    patina_cloud_style style = {.struct_size = sizeof style, .cull_back = 0};
    patina_scene *scene = scene_of(cloud, &style);
    struct picture opaque = picture_render(device, scene, &camera, &settings);
    CHECK(patina_scene_clear(scene), scene);
    style.transparency = 0.5f;
    CHECK(patina_scene_add_cloud(scene, cloud, &style), scene);
    struct picture glass = picture_render(device, scene, &camera, &settings);
    size_t pixels = (size_t)203 * 151;
    assert_memory_equal(glass.keys, opaque.keys, pixels * 8);
    assert_memory_equal(glass.depth, opaque.depth, pixels * 4);
    assert_memory_equal(glass.normal, opaque.normal, pixels * 12);
    assert_memory_equal(glass.source, opaque.source, pixels * 4);
    assert_memory_not_equal(glass.combined, opaque.combined, pixels * 16);
    picture_free(&opaque);

    settings.passes = 1u << PATINA_PASS_COMBINED; // passes may then run as one from the first layer on
    patina_frame *frame = NULL;
    float *combined = malloc(pixels * 16);
    CHECK(patina_scene_set_settings(scene, &settings), scene);
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_frame_keep_planes(frame, 1), frame); // they are looked at
    CHECK(patina_frame_render(frame, scene), frame);
    CHECK(patina_frame_read(frame, PATINA_PASS_COMBINED, combined, pixels * 16), frame);
    assert_memory_equal(combined, glass.combined, pixels * 16);
    free(combined);
    patina_frame_destroy(frame);
    settings.passes = 0;

    settings.layers = 16; // peeling has ended by itself before the default's 8
    opaque = picture_render(device, scene, &camera, &settings);
    picture_assert_identical(&opaque, &glass, 0, 0, "16 layers against 8");
    picture_free(&opaque);
    picture_free(&glass);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    patina_device_destroy(device);
}

// ---- chunks left out ---------------------------------------------------------------------------------------------------

static uint64_t *scatter_behind(patina_frame *frame, const struct pt_plan *plan, const struct chunk_view *chunks,
                                uint32_t count, const patina_cloud *cloud)
{
    patina_device *device = frame->device;
    size_t pixels = (size_t)plan->view.width * plan->view.height;
    struct pt_buffer keys = {0}, list = {0};
    struct pt_resident *resident = NULL;
    uint64_t *out = malloc(pixels * 8);
    assert_non_null(out);
    CHECK(device->ops->buffer_create(device, pixels * 8, NULL, 0, &keys), device);
    CHECK(device->ops->buffer_create(device, count * sizeof *chunks, chunks, 0, &list), device);
    CHECK(device->ops->buffer_fill(device, &keys, 0, keys.size, KEY_EMPTY, 8), device);
    CHECK(pt_residency_take(&frame->residency, device, cloud, &resident), device);
    struct scatter_args args = {.view = plan->view, .instances = 1, .behind = 1};
    struct pt_buffer none = {0}, *buffers[] = {&keys, &frame->planes.at[PT_PLANE_LIMIT][0], &none,
                                               &list, &resident->buffers[PT_POSITIONS],     &resident->buffers[PT_SURFELS]};
    CHECK(device->ops->run(device, PT_KERNEL_scatter, &args, sizeof args, buffers, 6, NULL), device);
    CHECK(device->ops->buffer_read(device, &keys, 0, out, pixels * 8), device);
    device->ops->buffer_destroy(device, &keys);
    device->ops->buffer_destroy(device, &list);
    return out;
}

// Behind every layer the chunks chosen give the keys that all of them give.
static void test_chunks_left_out(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    const double eyes[2][3] = {{0.0, -2.7, 2.3}, {0.0, -0.3, 0.35}}; // the second inside the tube's sweep
    const double target[3] = {0.0, 0.0, 0.0};
    struct points points = points_torus(400000, 1.0, 0.4, POINTS_NORMALS, 3);
    patina_cloud *cloud = points_upload(&points);
    points_free(&points);
    patina_cloud_style style = {.struct_size = sizeof style, .transparency = 0.5f};
    uint64_t all = 0, chosen = 0;
    for (uint32_t way = 0; way < 8; way++) {
        patina_scene *scene = scene_of(cloud, &style);
        patina_settings settings = settings_default(300, 200);
        settings.layers = 1 + way % 4;
        patina_camera camera = way / 4 ? camera_perspective(eyes[1], target, 60.0, 300, 200, 0.01, 100.0)
                                       : camera_orthographic(eyes[0], target, 3.0, 300, 200, -20.0, 20.0);
        CHECK(patina_scene_set_camera(scene, &camera), scene);
        settings.layers = settings.layers < 2 ? 2 : settings.layers;
        CHECK(patina_scene_set_settings(scene, &settings), scene);
        patina_frame *frame = NULL;
        CHECK(patina_frame_create(device, &frame), device);
        CHECK(patina_frame_keep_planes(frame, 1), frame); // they are looked at
        CHECK(patina_frame_render(frame, scene), frame);
        struct pt_plan plan;
        CHECK(pt_plan_create(scene, NULL, &plan), scene);
        const struct pt_buffer *plane = &frame->planes.at[PT_PLANE_TILES][PT_TILE_LEVEL];
        struct pt_tile *tiles = malloc(plane->size);
        struct chunk_view *list = malloc((plan.instances[0].chunk_count + 1) * sizeof *list);
        assert_true(tiles && list);
        CHECK(device->ops->buffer_read(device, plane, 0, tiles, plane->size), device);
        uint64_t kept = 0;
        uint32_t count = pt_layer_chunks(&plan, 0, tiles, list, &kept);
        uint64_t *some = scatter_behind(frame, &plan, list, count, cloud);
        uint64_t *whole = scatter_behind(frame, &plan, plan.instances[0].chunks, plan.instances[0].chunk_count, cloud);
        assert_memory_equal(some, whole, (size_t)plan.view.width * plan.view.height * 8);
        all += plan.points_scattered;
        chosen += kept;
        free(some);
        free(whole);
        free(tiles);
        free(list);
        pt_plan_destroy(&plan);
        patina_frame_destroy(frame);
        patina_scene_destroy(scene);
    }
    printf("  %.1f%% of the points lie in chunks that are scattered again\n", percent(chosen, all));
    assert_true(chosen > 0 && chosen < all);
    patina_cloud_destroy(cloud);
    patina_device_destroy(device);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_nested_tori),     cmocka_unit_test(test_sheets),      cmocka_unit_test(test_layer_distance),
        cmocka_unit_test(test_exact_opacities), cmocka_unit_test(test_first_layer), cmocka_unit_test(test_chunks_left_out),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
