// SPDX-License-Identifier: GPL-3.0-or-later
// A cloud that is made of parts (scene/clouds/parts.h) is one cloud to whoever draws it, picks of it or reads its shadows: the bytes are those of the
// same cloud in one piece.
#include "clouds.h"
#include "scene/clouds/parts.h"
#include "support.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TORUS = 60000, SIZE = 128, BYTES = (TORUS + 7) / 8 };

enum kind { FILLED, SPLATS, DISCS, GLASS, SOFT, LINES, SELFLESS, HEIGHTS, DISTANCES, MASKED, GRADED, KINDS };
static const char *const names[KINDS] = {
    "filled",    "splats",      "discs",  "glass", "soft", "lines", "without its own shadow",
    "by height", "by distance", "masked", "graded"};

static patina_cloud *make(const struct points *points, enum kind kind, int in_parts)
{
    patina_cloud *cloud = points_upload(points);
    if (kind == DISCS)
        CHECK(patina_cloud_analyse(cloud, NULL, NULL), cloud);
    if (in_parts) {
        assert_int_equal(pt_parts_make(cloud, 5 * PT_CHUNK_POINTS), PATINA_OK);
        assert_true(cloud->part_count >= 3);
    }
    return cloud;
}

// What somebody did with its points: every third band of numbers is hidden, others are selected; and graded as of three scans.
struct edits {
    patina_mask *mask;
    patina_grade *grade;
};

static struct edits edit(const patina_cloud *cloud, enum kind kind)
{
    static uint8_t hidden[BYTES], selected[BYTES];
    static uint16_t scans[TORUS];
    const patina_scan_grade grades[3] = {{.gain = 1, .gamma = 1, .saturation = 1},
                                         {.gain = 1.5f, .gamma = 1.2f, .saturation = 0.5f, .temperature = 0.3f},
                                         {.gain = 0.4f, .gamma = 0.8f, .saturation = 2}};
    struct edits edits = {0};
    for (uint32_t i = 0; i < TORUS; i++)
        scans[i] = (uint16_t)(i % 3);
    for (uint32_t i = 0; i < BYTES; i++) {
        hidden[i] = i % 97 < 30 ? 0xFF : 0x10;
        selected[i] = i % 97 > 60 ? 0xFF : 0x02;
    }
    if (kind == MASKED)
        CHECK(patina_mask_create(cloud, hidden, selected, BYTES, &edits.mask), cloud);
    if (kind == GRADED)
        CHECK(patina_grade_create(cloud, scans, grades, 3, &edits.grade), cloud);
    return edits;
}

static void forget(struct edits *edits)
{
    patina_mask_destroy(edits->mask);
    patina_grade_destroy(edits->grade);
}

static void add(patina_scene *scene, const patina_cloud *cloud, const struct edits *edits, enum kind kind, double x)
{
    patina_cloud_style style = {.struct_size = sizeof style,
                                .world_from_object = {1, 0, 0, x, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
                                .lighting = PATINA_LIGHTING_LIT};
    style.transparency = kind == GLASS ? 0.25f : 0.0f;
    style.soft = kind == SOFT ? PATINA_SOFT_ALL : PATINA_SOFT_OFF;
    style.soft_radius = kind == SOFT ? 0.03f : 0.0f;
    style.color_source = kind == HEIGHTS ? PATINA_COLOR_HEIGHT : kind == DISTANCES ? PATINA_COLOR_DISTANCE : PATINA_COLOR_OWN;
    style.shadow_off = kind == SELFLESS && x > 0 ? PATINA_SHADOW_NO_SELF : 0;
    style.mask = edits->mask;
    style.grade = edits->grade;
    CHECK(patina_scene_add_cloud(scene, cloud, &style), scene);
}

// The cloud, another in one piece, and the cloud once more.
static patina_scene *scene_with(const patina_cloud *cloud, const patina_cloud *whole, const struct edits edits[2],
                                enum kind kind)
{
    static const double eye[3] = {0.3, -4.2, 1.9}, target[3] = {0.4, -0.4, 0};
    patina_scene *scene = NULL;
    CHECK(patina_scene_create(&scene), NULL);
    add(scene, cloud, &edits[0], kind, 0);
    add(scene, whole, &edits[1], kind, 1.5);
    add(scene, cloud, &edits[0], kind, 0.7);
    const patina_light_desc sun = {.struct_size = sizeof sun,
                                   .type = PATINA_LIGHT_SUN,
                                   .power = 3,
                                   .direction = {0.3, 0.5, -1},
                                   .angle = 0.05f,
                                   .shadows = 1};
    CHECK(patina_scene_add_light(scene, &sun), scene);
    const patina_camera camera = camera_perspective(eye, target, 30, SIZE, SIZE, 0.5, 40);
    CHECK(patina_scene_set_camera(scene, &camera), scene);
    patina_settings settings = settings_default(SIZE, SIZE);
    settings.surface = kind == SPLATS ? PATINA_SURFACE_SPLATS : PATINA_SURFACE_AUTO;
    settings.layers = kind == GLASS ? 3 : 1;
    settings.shadow_samples = 2;
    settings.passes = 0xFFFFFFFFu >> (32 - PATINA_PASS_COUNT);
    CHECK(patina_scene_set_settings(scene, &settings), scene);
    const patina_lines lines = {.struct_size = sizeof lines, .width = 2, .source = PATINA_LINE_POINT};
    if (kind == LINES) {
        const patina_effects effects = {.struct_size = sizeof effects, .edl_strength = 1};
        CHECK(patina_scene_set_lines(scene, &lines), scene);
        CHECK(patina_scene_set_effects(scene, &effects), scene);
    }
    return scene;
}

struct seen {
    struct picture picture;
    float *arrives, *lit;
    uint8_t picked[BYTES];
    uint64_t points;
};

static struct seen look(patina_device *device, patina_scene *scene, enum kind kind)
{
    const double outline[] = {20, 20, 100, 30, 90, 110, 30, 80};
    struct seen seen = {.arrives = calloc(TORUS, 4)};
    patina_frame *frame = NULL;
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_frame_render(frame, scene), frame);
    seen.picture = picture_read(frame);
    patina_frame_stats stats = {.struct_size = sizeof stats};
    CHECK(patina_frame_get_stats(frame, &stats), frame);
    seen.points = stats.points;
    const patina_pick pick = {.struct_size = sizeof pick, .instance = 2, .polygon = outline, .corners = 4};
    CHECK(patina_scene_pick(scene, frame, &pick, NULL, seen.picked, BYTES), scene);
    const float orange[3] = {1.0f, 0.5f, 0.0f};
    const size_t size = (size_t)SIZE * SIZE * 4 * sizeof *seen.lit;
    seen.lit = malloc(size);
    memcpy(seen.lit, seen.picture.combined, size);
    CHECK(patina_frame_highlight(frame, scene, orange, 0.5f, seen.lit, size), frame);
    CHECK(patina_frame_bake_shadows(frame, scene), frame);
    CHECK(patina_frame_read_shadows(frame, 2, 0, seen.arrives, 4 * TORUS), frame);
    assert_int_equal(patina_frame_read_shadows(frame, 3, 0, seen.arrives, 4 * TORUS), PATINA_ERROR_EMPTY);
    patina_frame_destroy(frame);
    (void)kind;
    return seen;
}

static void check_kind(patina_device *device, const char *name, enum kind kind)
{
    struct points points = points_torus(TORUS, 1.0, 0.4, POINTS_ALL, 5);
    patina_cloud *whole = make(&points, kind, 0), *divided = make(&points, kind, 1);
    struct edits edits[3] = {edit(whole, kind), edit(whole, kind), edit(divided, kind)};
    const struct edits of_parts[2] = {edits[2], edits[0]};
    patina_scene *as_whole = scene_with(whole, whole, edits, kind), *in_parts = scene_with(divided, whole, of_parts, kind);
    struct seen a = look(device, as_whole, kind), b = look(device, in_parts, kind);
    char what[64];
    uint32_t lost = 0, bits = 0;
    snprintf(what, sizeof what, "%s on %s", names[kind], name);
    for (uint32_t i = 0; i < TORUS; i++) {
        lost += a.arrives[i] < 1.0f;
        bits += a.picked[i / 8] >> i % 8 & 1;
    }
    printf("  %s: %u parts, %llu pixels, %u points in shadow, %u picked\n", what, divided->part_count,
           (unsigned long long)picture_count(&a.picture), lost, bits);
    assert_true(lost > 1000 && (kind == SOFT || bits > 500)); // soft points have no key
    assert_true(a.points == b.points);
    assert_memory_equal(a.picked, b.picked, BYTES);
    assert_memory_equal(a.arrives, b.arrives, 4 * TORUS);
    picture_assert_identical(&b.picture, &a.picture, 0, 0, what);
    assert_memory_equal(a.lit, b.lit, (size_t)SIZE * SIZE * 16);
    assert_true((kind == MASKED) == (memcmp(a.lit, a.picture.combined, (size_t)SIZE * SIZE * 16) != 0));
    picture_free(&a.picture);
    picture_free(&b.picture);
    free(a.arrives);
    free(b.arrives);
    free(a.lit);
    free(b.lit);
    patina_scene_destroy(as_whole);
    patina_scene_destroy(in_parts);
    for (int k = 0; k < 3; k++)
        forget(&edits[k]);
    patina_cloud_destroy(whole);
    patina_cloud_destroy(divided);
    points_free(&points);
}

static void each_kind(patina_device *device, const char *name)
{
    const int slow = !strncmp(name, "gl", 2); // its plans are the same: a kind of each sort
    for (int kind = 0; kind < KINDS; kind++)
        if (!slow || kind == FILLED || kind == DISCS || kind == SOFT || kind >= MASKED)
            check_kind(device, name, (enum kind)kind);
}

static void test_parts_are_one_cloud(void **state)
{
    (void)state;
    support_each_device(each_kind);
}

// What is not divided yet is refused by name.
static void test_refusals(void **state)
{
    (void)state;
    struct points points = points_torus(TORUS, 1.0, 0.4, POINTS_ALL, 5);
    patina_cloud *cloud = make(&points, FILLED, 1);
    patina_scene *scene = NULL;
    CHECK(patina_scene_create(&scene), NULL);
    const patina_cloud_style imaged = {.struct_size = sizeof imaged, .surface = PATINA_SURFACE_RANGES};
    assert_int_equal(patina_scene_add_cloud(scene, cloud, &imaged), PATINA_ERROR_UNSUPPORTED);
    assert_non_null(strstr(support_message(scene), "range images"));
    CHECK(patina_scene_add_cloud(scene, cloud, NULL), scene);
    const patina_camera camera = camera_perspective((const double[]){0, -5, 2}, (const double[]){0, 0, 0}, 40, SIZE, SIZE, 0.5,
                                                    40);
    patina_device *device = support_device_first();
    patina_frame *frame = NULL;
    CHECK(patina_scene_set_camera(scene, &camera), scene);
    CHECK(patina_frame_create(device, &frame), device);
    for (int k = 0; k < 3; k++) {
        patina_settings settings = settings_default(SIZE, SIZE);
        settings.average = k == 1;
        settings.surface = k == 2 ? PATINA_SURFACE_RANGES : PATINA_SURFACE_AUTO;
        CHECK(patina_scene_set_settings(scene, &settings), scene);
        assert_int_equal(patina_frame_render(frame, scene), k ? PATINA_ERROR_UNSUPPORTED : PATINA_OK);
        if (k)
            assert_non_null(strstr(support_message(frame), k == 1 ? "settings.average" : "range images"));
    }
    patina_frame_destroy(frame);
    patina_device_destroy(device);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    points_free(&points);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_parts_are_one_cloud),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
