// SPDX-License-Identifier: GPL-3.0-or-later
// Effects on whole pictures: regions and tiles equal crops, threads and batches change nothing, devices agree within the
// table; depth, normals, source and keys stay as they are without effects; off is as it was. Effects that no row shows are shown as
// the table of effects begins them.
#include "scene/scene.h"
#include "staging.h"
#include "tolerances.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

struct show {
    const char *name;
    patina_effects effects;
    float noise; // largest difference of colours between devices; 0: TOL_COLOR of the brightest
};

static const struct show rows[] = {
    {"eye-dome lighting", {.edl_strength = 1.0f}, 0.0f},
    {"eye-dome lighting, wide", {.edl_strength = 0.7f, .edl_radius = 16.0f}, 0.0f},
    {"obscurance", {.obscurance_strength = 1.0f}, 0.0f},
    {"obscurance and eye-dome lighting", {.obscurance_strength = 2.0f, .obscurance_radius = 0.5f, .edl_strength = 0.5f}, 0.0f},
    {"toon", {.toon_bands = 3, .toon_softness = 0.4f, .edl_strength = 1.0f}, 0.01f}, // an edge is 1/0.4 as steep as the light
    {"hatching", {.hatch_levels = 3, .hatch_ground = 0.5f}, 0.05f},                  // strokes' edges are a pixel wide
    {"fog", {.fog_start = 2.0f, .fog_end = 4.0f, .fog_density = 0.9f, .fog_fixed = 1, .fog_color = {0.2f, 0.5f, 1.0f}}, 0.0f},
    {"depth of field", {.focus_aperture = 1.2f, .focus_distance = 2.2f}, 1e-3f}, // circles' rims are a pixel wide
    {"depth of field, wide", {.focus_aperture = 3.0f, .focus_distance = 2.4f}, 1e-3f},
    {"paper", {.paper_color = {0.9f, 0.8f, 0.6f}, .paper_grain = 0.5f}, 0.0f},
    {"contour lines",
     {.contour_width = 1.0f,
      .contour_every = 5,
      .contour_bold = 2.0f,
      .contour_color = {0.09f, 0.03f, 0.01f},
      .contour_opacity = 1.0f},
     0.05f}, // lines' edges are a pixel wide
    {"all",
     {.edl_strength = 0.5f,
      .obscurance_strength = 1.0f,
      .toon_bands = 5,
      .hatch_levels = 1,
      .contour_opacity = 0.5f,
      .contour_interval = 0.3f,
      .fog_start = 1.0f,
      .fog_end = 9.0f,
      .fog_density = 0.5f,
      .focus_aperture = 0.05f,
      .focus_distance = 3.0f,
      .paper_grain = 0.1f},
     0.05f},
};
enum { ROWS = sizeof rows / sizeof rows[0], MOST = 64, FOG = 6, ALL = ROWS - 1 };

static struct show shows[MOST];
static uint32_t show_count;

// A field as Blender begins it: of (start, low, usual, high) the first.
#define FIRST(start, ...) start
#define RED(r, g, b) (r)
#define GREEN(r, g, b) (g)
#define BLUE(r, g, b) (b)

// Whether some row but the last, which has all, gives the field at this place a value.
static int is_shown(size_t offset)
{
    static const char zero[4];
    int shown = 0;
    for (uint32_t i = 0; i + 1 < ROWS; i++)
        shown |= memcmp((const char *)&rows[i].effects + offset, zero, sizeof zero) != 0;
    return shown;
}

static void add_show(const struct show *show)
{
    assert_true(show_count < MOST);
    shows[show_count++] = *show;
}

static void add_shows(void)
{
    struct show own = {0};
    int shown = 1;
    for (uint32_t i = 0; i < ROWS; i++)
        add_show(&rows[i]);
#define STRENGTH_OF(field, when) shown |= !strcmp(#when, "STRENGTH") && is_shown(offsetof(patina_effects, field));
#define PATINA_EFFECT(id, label, panel, ...)                                                                                   \
    if (!shown)                                                                                                                \
        add_show(&own);                                                                                                        \
    own = (struct show){.name = label};                                                                                        \
    shown = 0;
#define PATINA_EFFECT_NUMBER(field, when, least, most, zero, unit, begun, ...)                                                 \
    own.effects.field = (float)(FIRST begun);                                                                                  \
    STRENGTH_OF(field, when)
#define PATINA_EFFECT_COUNT(field, when, least, most, zero, unit, begun, ...)                                                  \
    own.effects.field = (uint32_t)(FIRST begun);                                                                               \
    STRENGTH_OF(field, when)
#define PATINA_EFFECT_COLOR(field, when, zero, begun, ...)                                                                     \
    memcpy(own.effects.field, (const float[]){(float)RED begun, (float)GREEN begun, (float)BLUE begun}, 12);                   \
    STRENGTH_OF(field, when)
#include "patina/effects.def"
    if (!shown)
        add_show(&own);
}

// A few of each kind: perspective, orthographic, lit, unlit, without normals, many clouds, glass, layers as passes.
static const uint32_t chosen[] = {2, 5, 8, 10, 11, 18, 19, 20, 21};
enum { CHOSEN = sizeof chosen / sizeof chosen[0], ONE_LAYERED = 5 };

// Every show in the two smallest scenes, then a third of them, and all at once everywhere.
static int pairs(uint32_t stage, uint32_t show) { return stage < 2 || show == ALL || (stage + show) % 3 == 0; }

static struct stage build(uint32_t stage, uint32_t show)
{
    struct stage built = stage_build(&stagings[chosen[stage]]);
    patina_effects effects = shows[show].effects;
    effects.struct_size = sizeof effects;
    CHECK(patina_scene_set_effects(built.scene, &effects), built.scene);
    return built;
}

static void compare_region(patina_device *device, const struct stage *stage, const struct picture *whole,
                           const uint32_t region[4], const char *name)
{
    char what[160];
    patina_settings settings = stage->settings;
    memcpy(settings.region, region, sizeof settings.region);
    struct picture part = picture_render(device, stage->scene, &stage->camera, &settings);
    snprintf(what, sizeof what, "%s, region %u %u %u %u", name, region[0], region[1], region[2], region[3]);
    picture_assert_identical(&part, whole, region[0], region[1], what);
    picture_free(&part);
}

static void test_regions(void **state)
{
    (void)state;
    for (uint32_t k = 0; k < support_device_count(); k++) {
        const char *device_name = support_device_name(k);
        if (!strncmp(device_name, "cpu-", 4))
            continue; // levels differ in kernels only
        patina_device *device = support_device_open(device_name, 0, 0);
        for (uint32_t s = 0; s < CHOSEN * show_count && device; s++) {
            const uint32_t show = s % show_count, at = s / show_count;
            if (!pairs(at, show) || (support_is_gl(device_name) && at))
                continue;
            struct stage stage = build(at, show);
            uint32_t w = stage.settings.width, h = stage.settings.height;
            struct picture whole = picture_render(device, stage.scene, &stage.camera, &stage.settings);
            const uint32_t regions[][4] = {{0, 0, w / 2, h / 2},
                                           {w / 2, h / 3, w, h},
                                           {w / 3, h / 3, w / 3 + 1, h / 3 + 1},
                                           {1, h / 2, w - 1, h / 2 + 1},
                                           {w / 2 - 9, 3, w / 2 + 8, h - 2}};
            for (uint32_t r = 0; r < sizeof regions / sizeof regions[0]; r++)
                compare_region(device, &stage, &whole, regions[r], shows[show].name);
            picture_free(&whole);
            stage_free(&stage);
        }
        patina_device_destroy(device);
    }
}

static void test_threads(void **state)
{
    (void)state;
    static const uint32_t ways[][2] = {{1, 0}, {2, 0}, {3, 1}, {7, 2}};
    for (uint32_t s = 0; s < CHOSEN * show_count; s++) {
        if (!pairs(s / show_count, s % show_count))
            continue;
        struct stage stage = build(s / show_count, s % show_count);
        struct picture truth = {0};
        for (uint32_t k = 0; k < sizeof ways / sizeof ways[0]; k++) {
            patina_device *device = support_device_open("cpu", ways[k][0], ways[k][1]);
            struct picture picture = picture_render(device, stage.scene, &stage.camera, &stage.settings);
            if (k) {
                picture_assert_identical(&picture, &truth, 0, 0, shows[s % show_count].name);
                picture_free(&picture);
            } else {
                truth = picture;
            }
            patina_device_destroy(device);
        }
        picture_free(&truth);
        stage_free(&stage);
    }
}

// Passes of a layer ask for planes on the way: what runs as one without them runs pass by pass then. Of one layer: with more of them
// edges mix with what lies behind.
static void test_one_by_one(void **state)
{
    (void)state;
    patina_device *device = support_device_open("cpu", 0, 0);
    for (uint32_t s = 0; s < ONE_LAYERED * show_count; s++) {
        struct stage stage = build(s / show_count, s % show_count);
        stage.settings.layers = 1;
        stage.settings.layer_passes = 0;
        struct picture as_one = picture_render(device, stage.scene, &stage.camera, &stage.settings);
        stage.settings.layer_passes = 1u << PATINA_PASS_COMBINED | 1u << PATINA_PASS_DEPTH | 1u << PATINA_PASS_NORMAL;
        struct picture apart = picture_render(device, stage.scene, &stage.camera, &stage.settings);
        apart.layers = 0; // the other has none to compare
        picture_assert_identical(&as_one, &apart, 0, 0, shows[s % show_count].name);
        picture_free(&as_one);
        picture_free(&apart);
        stage_free(&stage);
    }
    patina_device_destroy(device);
}

// Whatever is asked for beside it, the combined picture is the same: what a pass needs is there with and without its neighbours.
static void test_passes_asked_for(void **state)
{
    (void)state;
    static const uint32_t asked[] = {1u << PATINA_PASS_COMBINED, 1u << PATINA_PASS_DEPTH, 1u << PATINA_PASS_NORMAL,
                                     1u << PATINA_PASS_SOURCE, 1u << PATINA_PASS_DEPTH | 1u << PATINA_PASS_SHADOW};
    patina_device *device = support_device_open("cpu", 0, 0);
    for (uint32_t s = 0; s < ONE_LAYERED * show_count; s++) {
        struct stage stage = build(s / show_count, s % show_count);
        stage.settings.layer_passes = 0;
        struct picture all = picture_render(device, stage.scene, &stage.camera, &stage.settings);
        const size_t size = (size_t)all.width * all.height * 4 * sizeof(float);
        float *combined = malloc(size);
        assert_non_null(combined);
        for (uint32_t i = 0; i < sizeof asked / sizeof asked[0]; i++) {
            patina_frame *frame;
            stage.settings.passes = asked[i];
            CHECK(patina_frame_create(device, &frame), device);
            CHECK(patina_scene_set_settings(stage.scene, &stage.settings), stage.scene);
            CHECK(patina_frame_render(frame, stage.scene), frame);
            CHECK(patina_frame_read(frame, PATINA_PASS_COMBINED, combined, size), frame);
            if (memcmp(combined, all.combined, size))
                fail_msg("%s, stage %u: passes %#x alone change the picture", shows[s % show_count].name, s / show_count,
                         asked[i]);
            patina_frame_destroy(frame);
        }
        free(combined);
        picture_free(&all);
        stage_free(&stage);
    }
    patina_device_destroy(device);
}

static double worst(const float *a, const float *b, uint64_t count)
{
    double most = 0.0;
    for (uint64_t i = 0; i < count; i++)
        most = fmax(most, a[i] == b[i] ? 0.0 : fabs((double)a[i] - (double)b[i]));
    return most;
}

static double brightest(const struct picture *picture)
{
    double most = 1.0;
    for (uint64_t i = 0; i < 4 * (uint64_t)picture->width * picture->height; i++)
        most = fmax(most, fabs((double)picture->combined[i]));
    return most;
}

static void test_devices(void **state)
{
    (void)state;
    for (uint32_t s = 0; s < CHOSEN * show_count; s++) {
        const uint32_t show = s % show_count;
        if (!pairs(s / show_count, show))
            continue;
        struct stage stage = build(s / show_count, show);
        struct picture truth = {0};
        for (uint32_t k = 0; k < support_device_count(); k++) {
            const char *name = support_device_name(k);
            if (support_is_gl(name) && s / show_count % 3 > 0 && show != ALL)
                continue;
            patina_device *device = support_device_open(name, 0, 0);
            if (!device)
                continue;
            struct picture picture = picture_render(device, stage.scene, &stage.camera, &stage.settings);
            patina_device_destroy(device);
            if (!truth.keys) {
                truth = picture;
                continue;
            }
            uint64_t pixels = (uint64_t)truth.width * truth.height;
            double limit = shows[show].noise > 0.0f ? (double)shows[show].noise : TOL_COLOR * brightest(&truth);
            double off = worst(picture.combined, truth.combined, 4 * pixels);
            if (!(off <= limit) || memcmp(picture.keys, truth.keys, 8 * pixels) != 0)
                support_die("%s, %s, %s: colours %.3g off, at most %.3g allowed", name, stagings[chosen[s / show_count]].name,
                            shows[show].name, off, limit);
            picture_free(&picture);
        }
        picture_free(&truth);
        stage_free(&stage);
    }
}

// What is not colour is as it was, the picture is another one, and without effects all is as it was.
static void test_nothing_else_changes(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    for (uint32_t s = 0; s < CHOSEN * show_count; s++) {
        if (!pairs(s / show_count, s % show_count))
            continue;
        struct stage stage = build(s / show_count, s % show_count);
        struct picture with = picture_render(device, stage.scene, &stage.camera, &stage.settings);
        CHECK(patina_scene_set_effects(stage.scene, NULL), stage.scene);
        struct picture without = picture_render(device, stage.scene, &stage.camera, &stage.settings);
        struct stage bare = stage_build(&stagings[chosen[s / show_count]]);
        struct picture never = picture_render(device, bare.scene, &bare.camera, &bare.settings);
        picture_assert_identical(&without, &never, 0, 0, "effects taken away");
        uint64_t pixels = (uint64_t)with.width * with.height;
        assert_memory_equal(with.keys, without.keys, 8 * pixels);
        assert_true(worst(with.depth, without.depth, pixels) == 0.0 && worst(with.normal, without.normal, 3 * pixels) == 0.0);
        assert_true(worst(with.source, without.source, pixels) == 0.0);
        if (!(worst(with.combined, without.combined, 4 * pixels) > 0.01))
            support_die("%s, %s: nothing to be seen", stagings[chosen[s / show_count]].name, shows[s % show_count].name);
        for (uint64_t i = 0; i < 4 * pixels; i++)
            assert_true(isfinite(with.combined[i]));
        picture_free(&with);
        picture_free(&without);
        picture_free(&never);
        stage_free(&stage);
        stage_free(&bare);
    }
    patina_device_destroy(device);
}

// ---- eye-dome lighting of sparse points ---------------------------------------------------------------------------------

enum { SPHERE_SIZE = 192 };

// A white sphere of radius 1, by eye-dome lighting alone. mixed: one half in x has 40 times as many points.
static struct stage sphere_of(uint64_t count, int mixed, int orthographic, uint32_t surface)
{
    struct points points = points_sphere(count, 1.0, POINTS_NORMALS, 5);
    uint64_t kept = 0;
    for (uint64_t i = 0; i < count; i++) {
        if (mixed && points.position[3 * i] > 0.0f && i % 40)
            continue;
        memmove(points.position + 3 * kept, points.position + 3 * i, 3 * sizeof *points.position);
        memmove(points.normal + 3 * kept, points.normal + 3 * i, 3 * sizeof *points.normal);
        kept++;
    }
    points.count = kept;
    patina_cloud_desc desc = points_desc(&points);
    const patina_cloud_style style = {.struct_size = sizeof style, .lighting = PATINA_LIGHTING_UNLIT, .cull_back = 1};
    struct stage stage = {0};
    CHECK(patina_cloud_create(&desc, NULL, &stage.cloud), NULL);
    const double eye[3] = {0, -5, 0}, target[3] = {0, 0, 0};
    stage.scene = scene_of(stage.cloud, &style);
    stage.camera = orthographic ? camera_orthographic(eye, target, 2.5, SPHERE_SIZE, SPHERE_SIZE, 0.1, 100.0)
                                : camera_perspective(eye, target, 28.0, SPHERE_SIZE, SPHERE_SIZE, 0.1, 100.0);
    stage.settings = settings_default(SPHERE_SIZE, SPHERE_SIZE);
    stage.settings.surface = surface;
    points_free(&points);
    return stage;
}

// Share of the pixels about the sphere's middle at which the light of eye-dome lighting steps by a twelfth from one pixel to the
// next. The sphere itself has no such pixel there: all of them are outlines of discs or cells.
static double outlines(const struct picture *with, const struct picture *without)
{
    uint32_t count = 0, steps = 0;
    for (uint32_t y = 0; y < SPHERE_SIZE; y++)
        for (uint32_t x = 0; x + 1 < SPHERE_SIZE; x++) {
            const double u = 2.5 * (x + 0.5) / SPHERE_SIZE - 1.25, v = 2.5 * (y + 0.5) / SPHERE_SIZE - 1.25;
            const size_t at = 4 * ((size_t)y * SPHERE_SIZE + x);
            if (u * u + v * v > 0.4)
                continue;
            assert_true(without->combined[at] > 0.5f && without->combined[at + 4] > 0.5f);
            const double here = (double)with->combined[at] / (double)without->combined[at],
                         beside = (double)with->combined[at + 4] / (double)without->combined[at + 4];
            count++;
            steps += fabs(here - beside) > 1.0 / 12.0;
        }
    return (double)steps / count;
}

// Largest shares measured, filled or as discs, with one radius for all footprints and with what follows them: sparse 0.33 and
// 0.034, sparser 0.31 and 0, mixed 0.28 and 0.045. Dense: 0.049 and the same, since no footprint there is wider than the radius.
static void test_sparse_points_have_no_outlines(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        uint64_t count;
        int mixed;
        double most;
    } clouds[] = {{"sparse", 1500, 0, 0.04}, {"sparser", 300, 0, 0.01}, {"dense", 200000, 0, 0.055}, {"mixed", 60000, 1, 0.05}};
    const uint32_t surfaces[] = {PATINA_SURFACE_FILL, PATINA_SURFACE_SPLATS};
    patina_device *device = support_device_first();
    for (uint32_t c = 0; c < 16; c++) {
        struct stage stage = sphere_of(clouds[c / 4].count, clouds[c / 4].mixed, c / 2 % 2, surfaces[c % 2]);
        const patina_effects effects = {.struct_size = sizeof effects, .edl_strength = 1.0f};
        const uint32_t regions[][4] = {{0, 0, 96, 96}, {90, 0, 192, 192}, {95, 95, 96, 96}, {20, 97, 180, 98}};
        struct picture without = picture_render(device, stage.scene, &stage.camera, &stage.settings);
        CHECK(patina_scene_set_effects(stage.scene, &effects), stage.scene);
        struct picture with = picture_render(device, stage.scene, &stage.camera, &stage.settings);
        const double share = outlines(&with, &without);
        printf("  %s, %s, %s: light steps at %.4f of the pixels\n", clouds[c / 4].name,
               c / 2 % 2 ? "orthographic" : "perspective", c % 2 ? "discs" : "filled", share);
        assert_true(share <= clouds[c / 4].most);
        for (uint32_t r = 0; r < sizeof regions / sizeof regions[0]; r++)
            compare_region(device, &stage, &with, regions[r], clouds[c / 4].name);
        picture_free(&with);
        picture_free(&without);
        stage_free(&stage);
    }
    patina_device_destroy(device);
}

// ---- panoramas -----------------------------------------------------------------------------------------------------------

enum { AROUND = 384, BLOCK = 12 };

// Points at random on the inside of a room of 8 x 8 x 3, and on five pillars in it.
static patina_cloud *room(void)
{
    enum { WALLS = 90000, PILLARS = 15000, ALL_POINTS = WALLS + PILLARS };
    static const double feet[5][2] = {{2, 1}, {-2, 1.5}, {1, -2.2}, {-1.5, -2}, {2.5, -0.5}};
    float *position = calloc(3 * ALL_POINTS, sizeof *position), *normal = calloc(3 * ALL_POINTS, sizeof *normal);
    struct pcg random = pcg_seed(9);
    for (int i = 0; i < WALLS; i++) {
        const int axis = i % 3, side = i / 3 % 2 ? 1 : -1;
        for (int k = 0; k < 3; k++)
            position[3 * i + k] = (float)((k == 2 ? 1.5 : 4.0) * (k == axis ? side : pcg_between(&random, -1.0, 1.0)));
        normal[3 * i + axis] = (float)-side;
    }
    for (int i = WALLS; i < ALL_POINTS; i++) {
        const double angle = pcg_between(&random, 0.0, 6.28318530718), *foot = feet[i % 5];
        const double at[3] = {foot[0] + 0.2 * cos(angle), foot[1] + 0.2 * sin(angle), pcg_between(&random, -1.5, 1.5)};
        for (int k = 0; k < 3; k++)
            position[3 * i + k] = (float)at[k];
        normal[3 * i] = (float)cos(angle);
        normal[3 * i + 1] = (float)sin(angle);
    }
    const patina_cloud_desc desc = {.struct_size = sizeof desc,
                                    .count = ALL_POINTS,
                                    .position = {position, PATINA_FLOAT32, 3, 0},
                                    .normal = {normal, PATINA_FLOAT32, 3, 0}};
    patina_cloud *cloud = NULL;
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    CHECK(patina_cloud_analyse(cloud, NULL, NULL), cloud);
    free(position);
    free(normal);
    return cloud;
}

// Red of the panorama whose middle looks along `turn`, radians; from the bottom row on.
static float *look_around(patina_device *device, const patina_cloud *cloud, const patina_effects *effects, double turn)
{
    const double c = cos(turn), s = sin(turn);
    const patina_panorama panorama = {.struct_size = sizeof panorama,
                                      .width = AROUND,
                                      .height = AROUND / 2,
                                      .world_from_camera = {c, 0, s, 0, s, 0, -c, 0, 0, 1, 0, 0, 0, 0, 0, 1},
                                      .near_clip = 0.01,
                                      .far_clip = 100};
    const patina_light_desc suns[2] = {{.struct_size = sizeof suns[0],
                                        .type = PATINA_LIGHT_SUN,
                                        .power = 2,
                                        .color = {1, 1, 1},
                                        .direction = {0.3, 0.5, -0.8}},
                                       {.struct_size = sizeof suns[0],
                                        .type = PATINA_LIGHT_SUN,
                                        .power = 2,
                                        .color = {1, 1, 1},
                                        .direction = {-0.6, -0.3, 0.5}}};
    patina_scene *scene = NULL;
    patina_frame *frame = NULL;
    float *faces[6], *joined = malloc((size_t)AROUND * AROUND / 2 * 4 * sizeof *joined);
    CHECK(patina_scene_create(&scene), NULL);
    CHECK(patina_scene_add_cloud(scene, cloud, NULL), scene);
    for (int i = 0; i < 2; i++)
        CHECK(patina_scene_add_light(scene, &suns[i]), scene);
    CHECK(patina_scene_set_effects(scene, effects), scene);
    CHECK(patina_frame_create(device, &frame), device);
    for (uint32_t face = 0; face < 6; face++) {
        patina_camera camera = {.struct_size = sizeof camera};
        uint32_t side = 0;
        CHECK(patina_panorama_camera(&panorama, face, &camera, &side), NULL);
        assert_int_equal(camera.panorama_face, 1);
        const patina_settings settings = {.struct_size = sizeof settings, .width = side, .height = side, .film_transparent = 1};
        CHECK(patina_scene_set_settings(scene, &settings), scene);
        CHECK(patina_scene_set_camera(scene, &camera), scene);
        CHECK(patina_frame_render(frame, scene), frame);
        faces[face] = malloc((size_t)side * side * 16);
        CHECK(patina_frame_read(frame, PATINA_PASS_COMBINED, faces[face], (size_t)side * side * 16), frame);
    }
    const float *const read[6] = {faces[0], faces[1], faces[2], faces[3], faces[4], faces[5]};
    CHECK(patina_panorama_join(&panorama, PATINA_PASS_COMBINED, read, joined, (size_t)AROUND * AROUND / 2 * 16), NULL);
    for (int face = 0; face < 6; face++)
        free(faces[face]);
    patina_frame_destroy(frame);
    patina_scene_destroy(scene);
    return joined;
}

// Mean red of a block of pixels, whose columns go around.
static double tone(const float *joined, int x, int y, int shift)
{
    double sum = 0.0;
    for (int i = 0; i < BLOCK * BLOCK; i++)
        sum += (double)joined[4 * ((size_t)(y + i / BLOCK) * AROUND + (size_t)(x + i % BLOCK + shift) % AROUND)];
    return sum / (BLOCK * BLOCK);
}

// A panorama that begins an eighth of a turn further has its cube's edges where the other has the middles of faces: tones are the same, as
// no edge shows. Strokes and grain may fall elsewhere, so blocks of pixels are compared, off the poles.
static void test_panoramas_show_no_edges(void **state)
{
    (void)state;
    patina_device *device = support_device_open("cpu", 0, 0);
    patina_cloud *cloud = room();
    for (uint32_t show = 0; show < show_count; show++) {
        patina_effects effects = shows[show].effects;
        effects.struct_size = sizeof effects;
        float *ahead = look_around(device, cloud, &effects, 0.0),
              *turned = look_around(device, cloud, &effects, 0.78539816339744831);
        double worst_tone = 0.0, sum = 0.0;
        int blocks = 0;
        for (int y = AROUND / 8; y < AROUND / 2 - AROUND / 8; y += BLOCK)
            for (int x = 0; x < AROUND; x += BLOCK, blocks++) {
                const double off = fabs(tone(ahead, x, y, 0) - tone(turned, x, y, AROUND / 8));
                worst_tone = fmax(worst_tone, off);
                sum += off;
            }
        if (!(sum / blocks < 0.02) || !(worst_tone < 0.1)) // of depths along the view: 0.098 and 0.31
            fail_msg("%s: blocks differ by %.4f on average, %.4f at most", shows[show].name, sum / blocks, worst_tone);
        free(ahead);
        free(turned);
    }
    patina_cloud_destroy(cloud);
    patina_device_destroy(device);
}

// ---- samples -------------------------------------------------------------------------------------------------------------

// Effects that are measured in pixels of the image limit how many finer pixels one of them may have; others do not.
static void test_finer_pixels(void **state)
{
    (void)state;
    static const struct {
        patina_effects effects;
        uint32_t most;
    } cases[] = {
        {{0}, 40},
        {{.edl_strength = 1.0f}, 11}, // 16 / 1.4
        {{.edl_strength = 1.0f, .edl_radius = 16.0f}, 1},
        {{.edl_radius = 16.0f, .obscurance_radius = 1.0f, .focus_distance = 1.0f}, 40}, // all are off
        {{.obscurance_strength = 1.0f}, 1},
        {{.focus_aperture = 0.1f, .focus_distance = 1.0f}, 1},
        {{.paper_grain = 0.1f}, 1},
        {{.paper_color = {0.9f, 0.8f, 0.6f}}, 40},
        {{.toon_bands = 3, .hatch_levels = 3, .contour_opacity = 1.0f, .fog_density = 1.0f, .fog_end = 1.0f}, 40},
    };
    patina_scene *scene = NULL;
    CHECK(patina_scene_create(&scene), NULL);
    for (uint32_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        patina_effects effects = cases[i].effects;
        effects.struct_size = sizeof effects;
        CHECK(patina_scene_set_effects(scene, &effects), scene);
        assert_int_equal(pt_effects_grid(&scene->effects, 40), cases[i].most);
    }
    patina_scene_destroy(scene);
}

// ---- refusals ------------------------------------------------------------------------------------------------------------

static void refuse(patina_scene *scene, const char *what, const patina_effects *wrong)
{
    patina_effects effects = *wrong;
    assert_int_equal(patina_scene_set_effects(scene, &effects), PATINA_ERROR_ARGUMENT); // no struct_size
    effects.struct_size = sizeof effects;
    if (patina_scene_set_effects(scene, &effects) != PATINA_ERROR_ARGUMENT || !support_message(scene)[0])
        support_die("%s: wrong effects were taken", what);
}

// What is beyond a field's range, as the table has it, and what does not go together.
static void test_refusals(void **state)
{
    (void)state;
    patina_scene *scene = NULL;
    CHECK(patina_scene_create(&scene), NULL);
#define REFUSE(...) refuse(scene, #__VA_ARGS__, &(const patina_effects){__VA_ARGS__});
#define PATINA_EFFECT_NUMBER(field, when, least, most, ...)                                                                    \
    REFUSE(.field = NAN)                                                                                                       \
    REFUSE(.field = INFINITY)                                                                                                  \
    REFUSE(.field = (float)((most) > 0 ? 1.01 * (double)(most) : 1.0))                                                         \
    REFUSE(.field = (float)((double)(least) > 0 ? 0.99 * (double)(least) : 1.01 * (double)(least)-0.01))
#define PATINA_EFFECT_COUNT(field, when, least, most, ...)                                                                     \
    REFUSE(.field = (most) + 1)                                                                                                \
    if ((least) > 1)                                                                                                           \
    REFUSE(.field = (least)-1)
#define PATINA_EFFECT_COLOR(field, ...)                                                                                        \
    REFUSE(.field = {NAN})                                                                                                     \
    REFUSE(.field = {0.0f, -1.0f})                                                                                             \
    REFUSE(.field = {0.0f, 0.0f, 1e5f})
#define PATINA_EFFECT_AXIS(field, ...) REFUSE(.field = {0.0f, INFINITY}) REFUSE(.field = {NAN})
#define PATINA_EFFECT_SWITCH(field, ...) REFUSE(.field = 2)
#define PATINA_EFFECT_CHOICE(field, when, count, ...) REFUSE(.field = count)
#include "patina/effects.def"
    REFUSE(.fog_density = 1.0f) // fog_end is not beyond fog_start
    REFUSE(.focus_aperture = 1.0f)
    REFUSE(.exact = 2)
    patina_scene_destroy(scene);
}

#ifndef _WIN32
static void expect_error(const char *name, const char *wanted)
{
    patina_device *device = support_device_open(name, 0, 0);
    if (!device)
        return;
    struct stage stage = build(0, FOG);
    patina_frame *frame = NULL;
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_scene_set_camera(stage.scene, &stage.camera), stage.scene);
    CHECK(patina_scene_set_settings(stage.scene, &stage.settings), stage.scene);
    assert_int_equal(patina_frame_render(frame, stage.scene), PATINA_ERROR_DEVICE);
    if (!strstr(support_message(frame), wanted))
        support_die("%s: '%s' should hold '%s'", name, support_message(frame), wanted);
    patina_frame_destroy(frame);
    stage_free(&stage);
    patina_device_destroy(device);
}

// What a driver does not understand is told by the file and line where it stands, syntax or not, included or not.
static void test_shader_errors(void **state)
{
    (void)state;
    static const char *const bodies[] = {"\n\nPT_BODY(fog) { color[0] = HERE.nothing; }\n",
                                         "\n\nPT_BODY(fog) { color[0] = ; }\n"};
    char folder[] = "/tmp/patina-shaders-XXXXXX", inner[64], path[80];
    if (!mkdtemp(folder))
        support_die("no folder");
    snprintf(inner, sizeof inner, "%s/pointwise", folder);
    snprintf(path, sizeof path, "%s/fog.h", inner);
    assert_int_equal(mkdir(inner, 0700), 0);
    setenv("PATINA_SHADER_DIR", folder, 1);
    for (uint32_t i = 0; i < 2; i++) {
        FILE *file = fopen(path, "w");
        assert_non_null(file);
        fputs(bodies[i], file);
        fclose(file);
        for (uint32_t k = 0; k < support_device_count(); k++)
            if (support_is_gl(support_device_name(k)))
                expect_error(support_device_name(k), "shaders/pointwise/fog.h:3: ");
    }
    unsetenv("PATINA_SHADER_DIR");
    remove(path);
    rmdir(inner);
    rmdir(folder);
}
#endif

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    add_shows();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_regions),
        cmocka_unit_test(test_threads),
        cmocka_unit_test(test_devices),
        cmocka_unit_test(test_nothing_else_changes),
        cmocka_unit_test(test_finer_pixels),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_one_by_one),
        cmocka_unit_test(test_passes_asked_for),
        cmocka_unit_test(test_sparse_points_have_no_outlines),
        cmocka_unit_test(test_panoramas_show_no_edges),
#ifndef _WIN32
        cmocka_unit_test(test_shader_errors),
#endif
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
