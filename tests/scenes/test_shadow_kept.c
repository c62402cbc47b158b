// SPDX-License-Identifier: GPL-3.0-or-later
// Shadow textures beside their content: one result whatever computes it, lazy or whole, kept, refined, saved and loaded; what
// switches leave out; and lights in places where nothing good can come of them.
#include "clouds.h"
#include "support.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { TORUS = 30000, FLOOR = 20000, SIZE = 160 };

struct stage {
    patina_cloud *torus, *floor;
    patina_scene *scene;
    patina_camera camera;
    patina_settings settings;
};

static patina_light_desc light_of(uint32_t type, uint32_t shadows)
{
    patina_light_desc light = {.struct_size = sizeof light,
                               .type = type,
                               .power = type == PATINA_LIGHT_SUN ? 2.0f : 60.0f,
                               .position = {0.7, -0.9, 1.9},
                               .direction = {-0.4, 0.3, -0.8},
                               .angle = 0.2f,
                               .radius = 0.2f,
                               .size = {0.5f, 0.3f},
                               .cone = 1.8f,
                               .blend = 0.3f,
                               .shadows = shadows};
    return light;
}

// A torus over a floor; styles may be NULL. Lights: a sun, a point within reach of the floor (a cube), a panel.
static struct stage stage_of(const patina_cloud_style *torus_style, const patina_cloud_style *floor_style)
{
    struct stage stage = {.settings = settings_default(SIZE, SIZE)};
    struct points torus = points_torus(TORUS, 0.6, 0.25, POINTS_NORMALS, 3),
                  floor = points_rectangle(FLOOR, 4, 4, POINTS_NORMALS, 4);
    static const double unit[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, up[3] = {0, 0, 0.6}, eye[3] = {1.5, -3.0, 2.5},
                        target[3] = {0, 0, 0.2};
    points_transform(&torus, unit, up);
    stage.torus = points_upload(&torus);
    stage.floor = points_upload(&floor);
    points_free(&torus);
    points_free(&floor);
    stage.scene = scene_of(stage.torus, torus_style);
    CHECK(patina_scene_add_cloud(stage.scene, stage.floor, floor_style), stage.scene);
    stage.camera = camera_perspective(eye, target, 45, SIZE, SIZE, 0.1, 50);
    CHECK(patina_scene_set_camera(stage.scene, &stage.camera), stage.scene);
    stage.settings.shadow_samples = 3;
    return stage;
}

static void stage_light(struct stage *stage, uint32_t type)
{
    patina_light_desc light = light_of(type, 1);
    CHECK(patina_scene_add_light(stage->scene, &light), stage->scene);
}

static struct stage stage_lit(void)
{
    struct stage stage = stage_of(NULL, NULL);
    stage_light(&stage, PATINA_LIGHT_SUN);
    stage_light(&stage, PATINA_LIGHT_POINT);
    stage_light(&stage, PATINA_LIGHT_AREA);
    return stage;
}

static void stage_end(struct stage *stage)
{
    patina_scene_destroy(stage->scene);
    patina_cloud_destroy(stage->torus);
    patina_cloud_destroy(stage->floor);
}

static patina_frame *frame_on(patina_device *device)
{
    patina_frame *frame = NULL;
    CHECK(patina_frame_create(device, &frame), device);
    return frame;
}

static patina_frame_stats render(patina_frame *frame, struct stage *stage)
{
    patina_frame_stats stats = {.struct_size = sizeof stats};
    CHECK(patina_scene_set_settings(stage->scene, &stage->settings), stage->scene);
    CHECK(patina_frame_render(frame, stage->scene), frame);
    CHECK(patina_frame_get_stats(frame, &stats), frame);
    return stats;
}

// Shares of both clouds and all lights, one after the other.
static float *read_all(const patina_frame *frame, uint32_t lights)
{
    float *values = malloc((size_t)lights * (TORUS + FLOOR) * sizeof *values), *at = values;
    for (uint32_t light = 0; light < lights; light++) {
        CHECK(patina_frame_read_shadows(frame, 0, light, at, TORUS * 4), frame);
        CHECK(patina_frame_read_shadows(frame, 1, light, at + TORUS, FLOOR * 4), frame);
        at += TORUS + FLOOR;
    }
    return values;
}

static void test_devices_and_threads_agree(void **state)
{
    (void)state;
    static const uint32_t ways[][2] = {{1, 0}, {2, 1}, {3, 2}, {7, 64}};
    struct stage stage = stage_lit();
    float *truth = NULL;
    for (uint32_t d = 0; d < support_device_count(); d++)
        for (uint32_t w = 0; w < (support_is_gl(support_device_name(d)) ? 1u : 4u); w++) {
            patina_device *device = support_device_open(support_device_name(d), ways[w][0], ways[w][1]);
            if (!device)
                continue;
            patina_frame *frame = frame_on(device);
            CHECK(patina_scene_set_settings(stage.scene, &stage.settings), stage.scene);
            CHECK(patina_frame_bake_shadows(frame, stage.scene), frame);
            float *values = read_all(frame, 3);
            if (truth && memcmp(truth, values, 3 * (TORUS + FLOOR) * sizeof *values))
                support_die("%s with %u threads: other shadows than %s", support_device_name(d), ways[w][0],
                            support_device_name(0));
            if (truth)
                free(values);
            else
                truth = values;
            patina_frame_destroy(frame);
            patina_device_destroy(device);
        }
    free(truth);
    stage_end(&stage);
}

// Lazy: the same picture to the bit, the next frame tests anew; whole: the next frame tests nothing.
static void test_lazy_is_whole(void **state)
{
    (void)state;
    for (uint32_t d = 0; d < support_device_count(); d++) {
        patina_device *device = support_device_open(support_device_name(d), 0, 0);
        if (!device)
            continue;
        struct stage stage = stage_lit();
        patina_frame *frame = frame_on(device), *lazy = frame_on(device);
        patina_frame_stats stats = render(frame, &stage);
        assert_true(stats.shadow_maps > 3 * 3 && stats.shadow_width > 16);
        assert_in_range(stats.shadow_bytes, 3 * 4 * (TORUS + FLOOR),
                        3 * 4 * 1.01 * (TORUS + FLOOR)); // chunks end with a vector
        struct picture first = picture_read(frame);
        assert_int_equal(render(frame, &stage).shadow_maps, 0);
        struct picture kept = picture_read(frame);
        picture_assert_identical(&kept, &first, 0, 0, "kept shadows");
        stage.settings.shadow_lazy = 1;
        for (int again = 0; again < 2; again++) {
            assert_int_equal(render(lazy, &stage).shadow_maps, stats.shadow_maps);
            struct picture picture = picture_read(lazy);
            picture_assert_identical(&picture, &first, 0, 0, "lazy shadows");
            picture_free(&picture);
            patina_frame_stats of_shown = {.struct_size = sizeof of_shown}; // by what shows, and two bits a point
            CHECK(patina_frame_get_stats(lazy, &of_shown), lazy);
            assert_in_range(of_shown.shadow_bytes, 4 * 3, 3 * 4 * SIZE * SIZE + (TORUS + FLOOR) / 3);
        }
        assert_int_equal(render(frame, &stage).shadow_maps, 0); // whole ones are at hand
        picture_free(&first);
        picture_free(&kept);
        patina_frame_destroy(frame);
        patina_frame_destroy(lazy);
        stage_end(&stage);
        patina_device_destroy(device);
    }
}

static void move_light(struct stage *stage, double x, float power)
{
    CHECK(patina_scene_clear(stage->scene), stage->scene);
    CHECK(patina_scene_add_cloud(stage->scene, stage->torus, NULL), stage->scene);
    CHECK(patina_scene_add_cloud(stage->scene, stage->floor, NULL), stage->scene);
    patina_light_desc light = light_of(PATINA_LIGHT_POINT, 1);
    light.position[0] += x;
    light.power = power;
    CHECK(patina_scene_add_light(stage->scene, &light), stage->scene);
}

static void test_what_a_texture_depends_on(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    struct stage stage = stage_of(NULL, NULL);
    patina_frame *frame = frame_on(device);
    move_light(&stage, 0.0, 60.0f);
    assert_true(render(frame, &stage).shadow_maps > 0);
    move_light(&stage, 0.0, 10.0f); // dimmer
    assert_int_equal(render(frame, &stage).shadow_maps, 0);
    stage.camera.world_from_camera[3] += 0.1;
    CHECK(patina_scene_set_camera(stage.scene, &stage.camera), stage.scene);
    assert_int_equal(render(frame, &stage).shadow_maps, 0);
    move_light(&stage, 0.01, 10.0f);
    assert_true(render(frame, &stage).shadow_maps > 0);
    stage.settings.shadow_samples = 5;
    assert_true(render(frame, &stage).shadow_maps > 0);
    float *kept = read_all(frame, 1);
    patina_frame *fresh = frame_on(device);
    render(fresh, &stage);
    float *anew = read_all(fresh, 1);
    assert_memory_equal(kept, anew, (TORUS + FLOOR) * sizeof *kept);
    free(kept);
    free(anew);
    patina_frame_destroy(frame);
    patina_frame_destroy(fresh);
    stage_end(&stage);
    patina_device_destroy(device);
}

// 1, 2, 4 and 5 samples, then rest; the end is what 5 at once give.
static void test_progressive(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    struct stage stage = stage_lit();
    patina_frame *frame = frame_on(device), *direct = frame_on(device);
    stage.settings.shadow_samples = 5;
    render(direct, &stage);
    stage.settings.shadow_progressive = 1;
    for (int k = 0; k < 4; k++) {
        patina_frame_stats stats = render(frame, &stage);
        assert_true(stats.shadow_maps > 0);
        assert_int_equal(stats.shadow_pending, k < 3 ? 3 : 0);
    }
    assert_int_equal(render(frame, &stage).shadow_maps, 0);
    float *slow = read_all(frame, 3), *fast = read_all(direct, 3);
    assert_memory_equal(slow, fast, 3 * (TORUS + FLOOR) * sizeof *slow);
    free(slow);
    free(fast);
    patina_frame_destroy(frame);
    patina_frame_destroy(direct);
    stage_end(&stage);
    patina_device_destroy(device);
}

// Whole textures that would be too large: of what shows alone, to the same picture; by and by while the view stays as it is.
static void test_large_textures(void **state)
{
    (void)state;
    for (uint32_t d = 0; d < support_device_count(); d++) {
        patina_device *device = support_device_open(support_device_name(d), 0, 0);
        if (!device)
            continue;
        struct stage stage = stage_lit();
        patina_frame *whole = frame_on(device), *frame = frame_on(device);
        stage.settings.shadow_samples = 5;
        stage.settings.shadow_progressive = 1;
        support_set_variable("PATINA_SHADOW_WORDS", "1000");
        for (int view = 0; view < 2; view++) {
            static const uint32_t samples[] = {1, 2, 4, 5};
            stage.camera.world_from_camera[3] += 0.1;
            CHECK(patina_scene_set_camera(stage.scene, &stage.camera), stage.scene);
            for (int k = 0; k < 4; k++) {
                if (k == 2) { // what is cancelled counts as no picture
                    patina_frame_cancel(frame);
                    assert_int_equal(patina_frame_render(frame, stage.scene), PATINA_ERROR_CANCELLED);
                }
                const patina_frame_stats stats = render(frame, &stage);
                assert_int_equal(stats.shadow_samples, samples[k]);
                assert_int_equal(stats.shadow_pending, k < 3 ? 3 : 0);
                assert_in_range(stats.shadow_bytes, 4 * 3, 3 * 4 * SIZE * SIZE + (TORUS + FLOOR) / 3);
            }
        }
        struct picture picture = picture_read(frame);
        assert_int_equal(patina_frame_save_shadows(frame, "nowhere"), PATINA_ERROR_EMPTY);
        assert_int_equal(render(frame, &stage).shadow_samples, 1);   // anew
        CHECK(patina_frame_bake_shadows(frame, stage.scene), frame); // however large, where they are asked for
        assert_int_equal(render(frame, &stage).shadow_maps, 0);      // and they stay
        support_set_variable("PATINA_SHADOW_WORDS", NULL);
        stage.settings.shadow_progressive = 0;
        render(whole, &stage);
        struct picture expected = picture_read(whole);
        picture_assert_identical(&picture, &expected, 0, 0, "shadows of what shows, by and by");
        picture_free(&picture);
        picture_free(&expected);
        patina_frame_destroy(whole);
        patina_frame_destroy(frame);
        stage_end(&stage);
        patina_device_destroy(device);
    }
}

// What shows in a part of a picture may agree after a few samples, where the whole goes on: a part does not stop.
static void test_parts_take_all_samples(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    struct stage stage = stage_of(NULL, NULL);
    patina_light_desc sun = light_of(PATINA_LIGHT_SUN, 1);
    sun.angle = 1e-12f; // all agree
    CHECK(patina_scene_add_light(stage.scene, &sun), stage.scene);
    stage.settings.shadow_samples = 12;
    stage.settings.shadow_lazy = 1;
    patina_frame *frame = frame_on(device);
    assert_int_equal(render(frame, &stage).shadow_maps, 4);
    struct picture whole = picture_read(frame);
    const uint32_t region[4] = {0, 0, SIZE, SIZE / 2};
    memcpy(stage.settings.region, region, sizeof region);
    assert_int_equal(render(frame, &stage).shadow_maps, 12);
    struct picture part = picture_read(frame);
    for (size_t i = 0; i < 4 * SIZE * SIZE / 2; i++) // shares of 4 and of 12 samples are rounded otherwise
        assert_true(fabsf(part.combined[i] - whole.combined[i]) < 1e-5f);
    picture_free(&part);
    picture_free(&whole);
    patina_frame_destroy(frame);
    stage_end(&stage);
    patina_device_destroy(device);
}

// With an error target every device stops at the same samples; so do refining step by step and asking for a lazy picture;
// another target starts anew, and a file keeps to its own.
static void test_error_target(void **state)
{
    (void)state;
    char path[] = "/tmp/patina_shadow_XXXXXX";
    close(mkstemp(path));
    struct stage stage = stage_lit();
    stage.settings.shadow_samples = 32;
    stage.settings.shadow_error = 0.25f;
    float *truth = NULL;
    uint32_t maps = 0;
    for (uint32_t d = 0; d < support_device_count(); d++) {
        patina_device *device = support_device_open(support_device_name(d), 3, 2);
        if (!device)
            continue;
        patina_frame *frame = frame_on(device), *slow = frame_on(device);
        stage.settings.shadow_lazy = d % 2;
        patina_frame_stats stats = render(frame, &stage), last = {0};
        assert_true(stats.shadow_samples >= 4 && stats.shadow_samples < 32 && stats.shadow_error > 0.0f &&
                    stats.shadow_error <= 0.25f);
        stage.settings.shadow_lazy = 0;
        stage.settings.shadow_progressive = 1;
        for (last.shadow_pending = 1; last.shadow_pending;)
            last = render(slow, &stage);
        stage.settings.shadow_progressive = 0;
        float *values = read_all(frame, 3), *steps = read_all(slow, 3);
        assert_memory_equal(values, steps, 3 * (TORUS + FLOOR) * sizeof *values);
        assert_true(stats.shadow_error == last.shadow_error && stats.shadow_samples == last.shadow_samples);
        free(steps);
        if (truth && (memcmp(truth, values, 3 * (TORUS + FLOOR) * sizeof *values) || stats.shadow_maps != maps))
            support_die("%s: other shadows to an error target than %s", support_device_name(d), support_device_name(0));
        if (truth)
            free(values);
        else
            truth = values;
        maps = stats.shadow_maps;
        assert_int_equal(render(frame, &stage).shadow_maps, 0);
        CHECK(patina_frame_save_shadows(frame, path), frame);
        CHECK(patina_frame_load_shadows(slow, stage.scene, path), slow);
        last = render(slow, &stage);
        assert_true(!last.shadow_maps && last.shadow_error == stats.shadow_error &&
                    last.shadow_samples == stats.shadow_samples);
        stage.settings.shadow_error = 0.4f;
        assert_true(render(frame, &stage).shadow_maps > 0);
        assert_int_equal(patina_frame_load_shadows(slow, stage.scene, path), PATINA_ERROR_FORMAT);
        stage.settings.shadow_error = 0.25f;
        patina_frame_destroy(frame);
        patina_frame_destroy(slow);
        patina_device_destroy(device);
    }
    unlink(path);
    free(truth);
    stage_end(&stage);
}

// A sun as good as a point stops when all points agree; one with a disc does not.
static void test_early_stop(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    for (int wide = 0; wide < 2; wide++) {
        struct stage stage = stage_of(NULL, NULL);
        patina_light_desc light = light_of(PATINA_LIGHT_SUN, 1);
        light.angle = wide ? 0.2f : 1e-12f;
        CHECK(patina_scene_add_light(stage.scene, &light), stage.scene);
        stage.settings.shadow_samples = 12;
        patina_frame *frame = frame_on(device);
        patina_frame_stats stats = render(frame, &stage);
        assert_int_equal(stats.shadow_maps, wide ? 12 : 4);
        assert_int_equal(stats.shadow_pending, 0);
        assert_int_equal(render(frame, &stage).shadow_maps, 0);
        patina_frame_destroy(frame);
        stage_end(&stage);
    }
    patina_device_destroy(device);
}

static double mean(const float *values, uint32_t count)
{
    double sum = 0;
    for (uint32_t i = 0; i < count; i++)
        sum += (double)values[i];
    return sum / count;
}

static float glass; // transparency of the torus

// Mean shares on torus and floor under a sun.
static void shares(patina_device *device, uint32_t torus_off, uint32_t floor_off, double out[2])
{
    patina_cloud_style torus = {.struct_size = sizeof torus, .shadow_off = torus_off, .transparency = glass};
    patina_cloud_style floor = {.struct_size = sizeof floor, .shadow_off = floor_off};
    struct stage stage = stage_of(&torus, &floor);
    stage_light(&stage, PATINA_LIGHT_SUN);
    stage.settings.shadow_samples = 1;
    patina_frame *frame = frame_on(device);
    render(frame, &stage);
    float *values = malloc(TORUS * sizeof *values);
    const uint32_t counts[2] = {TORUS, FLOOR};
    for (uint32_t i = 0; i < 2; i++) {
        int code = patina_frame_read_shadows(frame, i, 0, values, counts[i] * 4);
        out[i] = code ? 1.0 : mean(values, counts[i]);
    }
    free(values);
    patina_frame_destroy(frame);
    stage_end(&stage);
}

static void test_switches(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    double all[2], share[2];
    shares(device, 0, 0, all);
    assert_true(all[0] > 0.3 && all[0] < 0.7 && all[1] > 0.6 && all[1] < 0.95);
    shares(device, PATINA_SHADOW_NO_CAST, 0, share); // only the floor casts: nothing of the torus lies under it
    assert_true(share[0] == 1.0 && share[1] == 1.0);
    shares(device, PATINA_SHADOW_NO_RECEIVE, 0, share);
    assert_true(share[0] == 1.0 && share[1] == all[1]);
    shares(device, PATINA_SHADOW_NO_SELF, 0, share);
    assert_true(share[0] == 1.0 && share[1] == all[1]);
    shares(device, 0, PATINA_SHADOW_NO_SELF, share); // a plane never shadows itself, and still gets the torus's
    assert_true(share[0] == all[0] && share[1] >= all[1] && share[1] - all[1] < 0.02); // borders are filled without the floor
    glass = 0.75f; // a quarter of the light is lost where the torus stands before it, once though it has two sides
    shares(device, 0, 0, share);
    glass = 0.0f;
    assert_true(fabs((1.0 - share[0]) - 0.25 * (1.0 - all[0])) < 2e-3 && fabs((1.0 - share[1]) - 0.25 * (1.0 - all[1])) < 5e-3);
    shares(device, 7, 7, share);
    assert_true(share[0] == 1.0 && share[1] == 1.0);
    patina_device_destroy(device);
}

// A sheet over the floor, a quarter opaque where x < 0 and opaque beside it, and under its half with y > 0 an opaque sheet of the
// same cloud. Under a sun from above.
static void test_opacities_of_points(void **state)
{
    (void)state;
    enum { SHEET = 20000, BELOW = 10000 };
    static const double unit[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, top[3] = {0, 0, 1}, middle[3] = {0, 0.5, 0.5};
    struct points sheet = points_rectangle(SHEET, 2, 2, POINTS_NORMALS, 8),
                  below = points_rectangle(BELOW, 2, 1, POINTS_NORMALS, 9);
    struct points both = points_create(SHEET + BELOW, POINTS_NORMALS),
                  ground = points_rectangle(FLOOR, 2, 2, POINTS_NORMALS, 4);
    uint8_t *opacity = malloc(SHEET + BELOW);
    points_transform(&sheet, unit, top);
    points_transform(&below, unit, middle);
    memcpy(both.position, sheet.position, SHEET * 12);
    memcpy(both.position + 3 * SHEET, below.position, BELOW * 12);
    memcpy(both.normal, sheet.normal, SHEET * 12);
    memcpy(both.normal + 3 * SHEET, below.normal, BELOW * 12);
    for (uint32_t i = 0; i < SHEET + BELOW; i++)
        opacity[i] = i < SHEET && both.position[3 * i] < 0.0f ? 64 : 255;
    patina_cloud_desc desc = points_desc(&both);
    desc.opacity = (patina_array){.data = opacity, .type = PATINA_UINT8, .components = 1};
    patina_cloud *glass_cloud = NULL, *ground_cloud = points_upload(&ground);
    CHECK(patina_cloud_create(&desc, NULL, &glass_cloud), NULL);
    patina_scene *scene = scene_of(glass_cloud, NULL);
    CHECK(patina_scene_add_cloud(scene, ground_cloud, NULL), scene);
    patina_light_desc sun = {
        .struct_size = sizeof sun, .type = PATINA_LIGHT_SUN, .power = 1, .direction = {0, 0, -1}, .shadows = 1};
    CHECK(patina_scene_add_light(scene, &sun), scene);
    float *truth = NULL, *values = malloc((SHEET + BELOW + FLOOR) * sizeof *values), *under = values + SHEET + BELOW;
    for (uint32_t d = 0; d < support_device_count(); d++) {
        patina_device *device = support_device_open(support_device_name(d), 0, 0);
        if (!device)
            continue;
        patina_frame *frame = frame_on(device);
        CHECK(patina_frame_bake_shadows(frame, scene), frame);
        CHECK(patina_frame_read_shadows(frame, 0, 0, values, (SHEET + BELOW) * 4), frame);
        CHECK(patina_frame_read_shadows(frame, 1, 0, under, FLOOR * 4), frame);
        if (truth)
            assert_memory_equal(values, truth, (SHEET + BELOW + FLOOR) * 4);
        else {
            truth = malloc((SHEET + BELOW + FLOOR) * 4);
            memcpy(truth, values, (SHEET + BELOW + FLOOR) * 4);
        }
        patina_frame_destroy(frame);
        patina_device_destroy(device);
    }
    const float through = 1.0f - 64.0f / 255.0f;
    uint32_t wrong = 0, seen = 0;
    for (uint32_t i = 0; i < SHEET + BELOW + FLOOR; i++) {
        const float *p = i < SHEET + BELOW ? both.position + 3 * i : ground.position + 3 * (i - SHEET - BELOW);
        if (fabsf(p[0]) < 0.06f || fabsf(p[1]) < 0.06f || fabsf(p[0]) > 0.94f || fabsf(p[1]) > 0.94f)
            continue; // borders
        float expected = i < SHEET ? 1.0f : p[0] >= 0.0f ? 0.0f : i < SHEET + BELOW || p[1] < 0.0f ? through : 0.0f;
        seen++;
        wrong += fabsf(values[i] - expected) > 1e-6f;
    }
    printf("  %u of %u points away from borders are wrong\n", wrong, seen);
    assert_true(seen > 30000 && wrong * 1000 < seen);
    free(truth);
    free(values);
    free(opacity);
    patina_scene_destroy(scene);
    patina_cloud_destroy(glass_cloud);
    patina_cloud_destroy(ground_cloud);
    points_free(&sheet);
    points_free(&below);
    points_free(&both);
    points_free(&ground);
}

// ---- files ---------------------------------------------------------------------------------------------------------

static void refuse(patina_frame *frame, struct stage *stage, const char *path, const char *why)
{
    assert_int_equal(patina_frame_load_shadows(frame, stage->scene, path), PATINA_ERROR_FORMAT);
    if (!strstr(support_message(frame), why))
        support_die("expected \"%s\" in \"%s\"", why, support_message(frame));
}

// The file with one byte changed, or cut.
static void spoil(const char *from, const char *to, long at, int cut)
{
    FILE *in = fopen(from, "rb"), *out = fopen(to, "wb");
    assert_true(in && out);
    for (long i = 0; !(cut && i == at); i++) {
        int c = fgetc(in);
        if (c == EOF)
            break;
        fputc(i == at ? c ^ 1 : c, out);
    }
    fclose(in);
    fclose(out);
}

static void test_files(void **state)
{
    (void)state;
    char path[] = "/tmp/patina_shadow_XXXXXX", bad[64];
    int descriptor = mkstemp(path);
    assert_true(descriptor >= 0);
    close(descriptor);
    snprintf(bad, sizeof bad, "%s.bad", path);
    patina_device *device = support_device_first();
    struct stage stage = stage_lit();
    patina_frame *frame = frame_on(device), *other = frame_on(device);
    assert_int_equal(patina_frame_save_shadows(frame, path), PATINA_ERROR_EMPTY);
    render(frame, &stage);
    CHECK(patina_frame_save_shadows(frame, path), frame);
    CHECK(patina_frame_load_shadows(other, stage.scene, path), other);
    float *saved = read_all(frame, 3), *loaded = read_all(other, 3);
    assert_memory_equal(saved, loaded, 3 * (TORUS + FLOOR) * sizeof *saved);
    assert_int_equal(render(other, &stage).shadow_maps, 0);
    free(saved);
    free(loaded);

    assert_int_equal(patina_frame_load_shadows(other, stage.scene, "/nonexistent/file"), PATINA_ERROR_FILE);
    spoil(path, bad, 100000, 0);
    refuse(other, &stage, bad, "checksum");
    spoil(path, bad, 100000, 1);
    refuse(other, &stage, bad, "checksum");
    spoil(path, bad, 20, 1);
    refuse(other, &stage, bad, "no file of shadow");
    spoil(path, bad, 0, 0);
    refuse(other, &stage, bad, "no file of shadow");
    spoil(path, bad, 8, 0);
    refuse(other, &stage, bad, "of version 2");
    stage.settings.shadow_samples = 4;
    CHECK(patina_scene_set_settings(stage.scene, &stage.settings), stage.scene);
    refuse(other, &stage, path, "baked with 3 samples, the scene asks for 4");
    stage.settings.shadow_samples = 3;
    CHECK(patina_scene_set_settings(stage.scene, &stage.settings), stage.scene);
    assert_int_equal(render(other, &stage).shadow_maps, 0); // what was refused left the frame as it was
    move_light(&stage, 0.0, 60.0f);
    refuse(other, &stage, path, "baked with 3 casting lights, the scene has 1");
    CHECK(patina_frame_bake_shadows(frame, stage.scene), frame);
    CHECK(patina_frame_save_shadows(frame, path), frame);
    move_light(&stage, 0.01, 60.0f);
    refuse(other, &stage, path, "stale: light 0");
    stage_end(&stage);

    stage = stage_of(NULL, NULL);
    patina_scene_clear(stage.scene);
    CHECK(patina_scene_add_cloud(stage.scene, stage.floor, NULL), stage.scene);
    stage_light(&stage, PATINA_LIGHT_POINT);
    refuse(other, &stage, path, "baked for 2 clouds, the scene has 1");
    stage_end(&stage);
    patina_frame_destroy(frame);
    patina_frame_destroy(other);
    patina_device_destroy(device);
    unlink(path);
    unlink(bad);
}

// ---- hard lights and clouds ------------------------------------------------------------------------------------------

static void check_shares(patina_device *device, const patina_cloud *cloud, const patina_light_desc *light, uint32_t count)
{
    patina_scene *scene = scene_of(cloud, NULL);
    patina_settings settings = settings_default(64, 64);
    patina_camera camera = {.struct_size = sizeof camera};
    settings.shadow_samples = 2;
    CHECK(patina_scene_add_light(scene, light), scene);
    CHECK(patina_scene_frame_camera(scene, 20, 30, 0, &camera), scene);
    CHECK(patina_scene_set_camera(scene, &camera), scene);
    CHECK(patina_scene_set_settings(scene, &settings), scene);
    patina_frame *frame = frame_on(device);
    CHECK(patina_frame_render(frame, scene), frame);
    float *values = calloc(count + 1, sizeof *values);
    if (count)
        CHECK(patina_frame_read_shadows(frame, 0, 0, values, count * sizeof *values), frame);
    for (uint32_t i = 0; i < count; i++)
        assert_true(values[i] >= 0.0f && values[i] <= 1.0f);
    struct picture picture = picture_read(frame);
    for (size_t i = 0; i < 64 * 64 * 4; i++)
        assert_true(isfinite(picture.combined[i]));
    picture_free(&picture);
    free(values);
    patina_frame_destroy(frame);
    patina_scene_destroy(scene);
}

static void test_hard_lights(void **state)
{
    (void)state;
    static const double places[][3] = {{0, 0, 0}, {0.6, 0, 0}, {0, 0, 1e-9}, {0, 0, -50}, {1e7, 0, 0}, {0.6, 0, 0.2500001}};
    static const double ways[][3] = {{1, 0, 0}, {1, 0, -1e-9}, {0, 0, 1}, {1e-200, 0, 0}, {0, 1, -1e-3}};
    patina_device *device = support_device_first();
    struct points torus = points_torus(5000, 0.6, 0.25, POINTS_NORMALS, 3),
                  flat = points_rectangle(5000, 2, 2, POINTS_PLAIN, 4);
    struct points one = points_rectangle(1, 2, 2, POINTS_NORMALS, 5), same = points_create(100, POINTS_PLAIN);
    const struct points *all[] = {&torus, &flat, &one, &same};
    for (size_t c = 0; c < 4; c++) {
        patina_cloud *cloud = points_upload(all[c]);
        for (uint32_t type = 1; type <= 4; type++)
            for (size_t p = 0; p < 6; p++) {
                patina_light_desc light = light_of(type, 1);
                memcpy(light.position, places[p], sizeof light.position);
                memcpy(light.direction, ways[p % 5], sizeof light.direction);
                if (c < 2) // exactly at a point
                    for (int k = 0; k < 3 && p == 5; k++)
                        light.position[k] = (double)all[c]->position[3 * 77 + k];
                light.radius = p % 2 ? 0.1f : 0.0f;
                light.angle = p % 2 ? 3.1f : 0.0f;
                check_shares(device, cloud, &light, (uint32_t)all[c]->count);
            }
        patina_cloud_destroy(cloud);
    }
    points_free(&torus);
    points_free(&flat);
    points_free(&one);
    points_free(&same);
    patina_device_destroy(device);
}

// What is not needed is not done, and the plan says why.
static void test_reasons(void **state)
{
    (void)state;
    char text[8192];
    patina_device *device = support_device_first();
    struct stage stage = stage_of(NULL, NULL);
    patina_light_desc light = light_of(PATINA_LIGHT_SUN, 0);
    CHECK(patina_scene_add_light(stage.scene, &light), stage.scene);
    patina_frame *frame = frame_on(device);
    assert_int_equal(render(frame, &stage).shadow_maps, 0);
    patina_frame_plan_text(frame, stage.scene, text, sizeof text);
    assert_non_null(strstr(text, "skip shadow_test no light casts shadows"));
    assert_int_equal(patina_frame_bake_shadows(frame, stage.scene), PATINA_ERROR_EMPTY);
    stage_light(&stage, PATINA_LIGHT_POINT);
    patina_frame_plan_text(frame, stage.scene, text, sizeof text);
    assert_non_null(strstr(text, "loop samples    at most 3, until nothing changes"));
    assert_non_null(strstr(text, "run  shadow_test points of instance 0 are tested"));
    assert_non_null(strstr(text, "light 0: point light, 3 samples, six maps of"));
    render(frame, &stage);
    render(frame, &stage);
    patina_frame_stats_json(frame, text, sizeof text);
    assert_non_null(strstr(text, "\"shadows\":0.0000"));
    assert_null(strstr(text, "light map"));
    patina_frame_destroy(frame);
    stage_end(&stage);
    patina_device_destroy(device);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_devices_and_threads_agree),
        cmocka_unit_test(test_lazy_is_whole),
        cmocka_unit_test(test_what_a_texture_depends_on),
        cmocka_unit_test(test_progressive),
        cmocka_unit_test(test_large_textures),
        cmocka_unit_test(test_parts_take_all_samples),
        cmocka_unit_test(test_error_target),
        cmocka_unit_test(test_early_stop),
        cmocka_unit_test(test_switches),
        cmocka_unit_test(test_opacities_of_points),
        cmocka_unit_test(test_files),
        cmocka_unit_test(test_hard_lights),
        cmocka_unit_test(test_reasons),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
