// SPDX-License-Identifier: GPL-3.0-or-later
// What is refused, or fails half-way, through the public API: one clear message, and the last good picture stays.
#include <patina/patina.h>

#include <locale.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { POINTS = 2000, SIDE = 512 };

struct stage {
    patina_device *device;
    patina_cloud *cloud;
    patina_scene *scene;
    patina_frame *frame;
};

static void set_size(patina_scene *scene, uint32_t width, uint32_t height)
{
    patina_settings settings = {.struct_size = sizeof settings, .width = width, .height = height};
    assert_int_equal(patina_scene_set_settings(scene, &settings), PATINA_OK);
}

static struct stage set_stage(uint64_t memory_cap)
{
    static float points[POINTS][3];
    struct stage stage;
    for (int i = 0; i < POINTS; i++)
        for (int k = 0; k < 3; k++)
            points[i][k] = (float)((i * (7 + 6 * k)) % 97) / 97.0f;
    patina_device_desc device = {.struct_size = sizeof device, .name = "cpu", .memory_cap = memory_cap};
    patina_cloud_desc cloud = {.struct_size = sizeof cloud, .count = POINTS, .position = {points, PATINA_FLOAT32, 3, 0}};
    patina_camera camera = {.struct_size = sizeof camera};
    assert_int_equal(patina_device_create(&device, &stage.device), PATINA_OK);
    assert_int_equal(patina_cloud_create(&cloud, NULL, &stage.cloud), PATINA_OK);
    assert_int_equal(patina_scene_create(&stage.scene), PATINA_OK);
    assert_int_equal(patina_scene_add_cloud(stage.scene, stage.cloud, NULL), PATINA_OK);
    assert_int_equal(patina_frame_create(stage.device, &stage.frame), PATINA_OK);
    set_size(stage.scene, SIDE, SIDE);
    assert_int_equal(patina_scene_frame_camera(stage.scene, 30, 40, 0, &camera), PATINA_OK);
    assert_int_equal(patina_scene_set_camera(stage.scene, &camera), PATINA_OK);
    return stage;
}

static void clear_stage(struct stage *stage)
{
    patina_frame_destroy(stage->frame);
    patina_scene_destroy(stage->scene);
    patina_cloud_destroy(stage->cloud);
    patina_device_destroy(stage->device);
}

static void assert_message(const void *handle, const char *part)
{
    char text[512];
    assert_true(patina_message(handle, text, sizeof text) > 0);
    assert_non_null(strstr(text, part));
}

static float *read_picture(const struct stage *stage)
{
    size_t size = (size_t)SIDE * SIDE * 4 * sizeof(float);
    float *pixels = malloc(size);
    assert_non_null(pixels);
    assert_int_equal(patina_frame_read(stage->frame, PATINA_PASS_COMBINED, pixels, size), PATINA_OK);
    return pixels;
}

static void test_picture_survives_memory_cap(void **state)
{
    (void)state;
    struct stage probe = set_stage(0); // what a picture of this size takes
    patina_frame_stats stats = {.struct_size = sizeof stats};
    assert_int_equal(patina_frame_render(probe.frame, probe.scene), PATINA_OK);
    assert_int_equal(patina_frame_get_stats(probe.frame, &stats), PATINA_OK);
    clear_stage(&probe);
    struct stage stage = set_stage(stats.plane_bytes);
    assert_int_equal(patina_frame_render(stage.frame, stage.scene), PATINA_OK);
    float *before = read_picture(&stage);
    assert_int_equal(patina_frame_check(stage.frame, stage.scene), PATINA_OK);
    static const uint32_t sizes[] = {SIDE + 1, SIDE + 60, 700, 2000};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        set_size(stage.scene, sizes[i], sizes[i]);
        assert_int_equal(patina_frame_check(stage.frame, stage.scene), PATINA_ERROR_TOO_LARGE);
        assert_int_equal(patina_frame_render(stage.frame, stage.scene), PATINA_ERROR_TOO_LARGE);
        assert_message(stage.frame, "MB allowed");
        float *after = read_picture(&stage);
        assert_memory_equal(before, after, (size_t)SIDE * SIDE * 16);
        free(after);
    }
    free(before);
    clear_stage(&stage);
}

// Two plates of points a tenth of a thousandth apart: a light's map is as large as it may be.
static patina_cloud *plates(void)
{
    enum { ACROSS = 60 };
    static float points[2 * ACROSS * ACROSS][3];
    for (int i = 0; i < 2 * ACROSS * ACROSS; i++) {
        const int k = i / 2;
        points[i][0] = (float)(k % ACROSS) * 1e-4f + (float)(i % 2);
        points[i][1] = (float)(k / ACROSS) * 1e-4f + (float)(i % 2);
        points[i][2] = 0.2f * (float)(i % 2);
    }
    const patina_cloud_desc desc = {
        .struct_size = sizeof desc, .count = sizeof points / sizeof *points, .position = {points, PATINA_FLOAT32, 3, 0}};
    patina_cloud *cloud = NULL;
    assert_int_equal(patina_cloud_create(&desc, NULL, &cloud), PATINA_OK);
    return cloud;
}

static void set_resolution(patina_scene *scene, uint32_t resolution)
{
    patina_settings settings = {.struct_size = sizeof settings, .width = 64, .height = 64, .shadow_resolution = resolution};
    assert_int_equal(patina_scene_set_settings(scene, &settings), PATINA_OK);
}

static void test_light_map_above_memory_cap(void **state)
{
    (void)state;
    struct stage stage = set_stage(32 << 20);
    patina_cloud *cloud = plates();
    const patina_light_desc sun = {
        .struct_size = sizeof sun, .type = PATINA_LIGHT_SUN, .direction = {0.1, 0.2, -1}, .color = {1, 1, 1}, .shadows = 1};
    patina_scene_clear(stage.scene);
    assert_int_equal(patina_scene_add_cloud(stage.scene, cloud, NULL), PATINA_OK);
    assert_int_equal(patina_scene_add_light(stage.scene, &sun), PATINA_OK);
    patina_camera camera = {.struct_size = sizeof camera};
    assert_int_equal(patina_scene_frame_camera(stage.scene, 30, 40, 0, &camera), PATINA_OK);
    assert_int_equal(patina_scene_set_camera(stage.scene, &camera), PATINA_OK);
    for (int i = 0; i < 2; i++) {
        set_resolution(stage.scene, 256);
        assert_int_equal(patina_frame_check(stage.frame, stage.scene), PATINA_OK);
        assert_int_equal(patina_frame_render(stage.frame, stage.scene), PATINA_OK);
        patina_frame_stats stats = {.struct_size = sizeof stats};
        assert_int_equal(patina_frame_get_stats(stage.frame, &stats), PATINA_OK);
        assert_true(stats.shadow_height > 200);
        set_resolution(stage.scene, 16384);
        assert_int_equal(patina_frame_check(stage.frame, stage.scene), PATINA_ERROR_TOO_LARGE);
        assert_message(stage.frame, "lower the shadow resolution");
        assert_int_equal(patina_frame_render(stage.frame, stage.scene), PATINA_ERROR_TOO_LARGE);
        assert_message(stage.frame, "lower the shadow resolution");
        assert_true(patina_frame_progress(stage.frame) == 0.0f); // nothing was drawn
    }
    clear_stage(&stage);
    patina_cloud_destroy(cloud);
}

static void test_cancel_ends_with_its_render(void **state)
{
    (void)state;
    struct stage stage = set_stage(0);
    patina_scene *blind = NULL;
    assert_int_equal(patina_scene_create(&blind), PATINA_OK);
    patina_frame_cancel(stage.frame);
    assert_int_equal(patina_frame_render(stage.frame, blind), PATINA_ERROR_ARGUMENT); // no camera
    assert_int_equal(patina_frame_render(stage.frame, stage.scene), PATINA_OK);
    patina_scene_destroy(blind);
    clear_stage(&stage);
}

static void test_lights_end_at_32(void **state)
{
    (void)state;
    struct stage stage = set_stage(0);
    patina_light_desc light = {.struct_size = sizeof light, .type = PATINA_LIGHT_SUN, .power = 1.0f};
    for (int i = 0; i < 32; i++)
        assert_int_equal(patina_scene_add_light(stage.scene, &light), PATINA_OK);
    assert_int_equal(patina_scene_add_light(stage.scene, &light), PATINA_ERROR_ARGUMENT);
    assert_message(stage.scene, "32 lights");
    clear_stage(&stage);
}

static void test_bad_lights_and_shadows(void **state)
{
    (void)state;
    struct stage stage = set_stage(0);
    const patina_light_desc good = {.struct_size = sizeof good, .type = PATINA_LIGHT_AREA, .power = 1.0f};
    patina_light_desc bad[9];
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        bad[i] = good;
    bad[0].type = 5;
    bad[1].shape = 2;
    bad[2].angle = 3.2f;
    bad[3].cone = -0.1f;
    bad[4].blend = 1.5f;
    bad[5].radius = (float)NAN;
    bad[6].size[1] = -1.0f;
    bad[7].side[0] = (double)INFINITY;
    bad[8].power = (float)INFINITY;
    assert_int_equal(patina_scene_add_light(stage.scene, &good), PATINA_OK);
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        assert_int_equal(patina_scene_add_light(stage.scene, &bad[i]), PATINA_ERROR_ARGUMENT);
        assert_message(stage.scene, "light: ");
    }
    patina_settings settings = {.struct_size = sizeof settings, .shadow_samples = 4097};
    assert_int_equal(patina_scene_set_settings(stage.scene, &settings), PATINA_ERROR_ARGUMENT);
    settings = (patina_settings){.struct_size = sizeof settings, .shadow_error = -0.1f};
    assert_int_equal(patina_scene_set_settings(stage.scene, &settings), PATINA_ERROR_ARGUMENT);
    assert_message(stage.scene, "shadow_error is negative");
    settings = (patina_settings){.struct_size = sizeof settings, .world_directed = 2};
    assert_int_equal(patina_scene_set_settings(stage.scene, &settings), PATINA_ERROR_ARGUMENT);
    settings = (patina_settings){.struct_size = sizeof settings, .world_light = {[2] = {[8] = NAN}}};
    assert_int_equal(patina_scene_set_settings(stage.scene, &settings), PATINA_ERROR_ARGUMENT);
    settings = (patina_settings){.struct_size = sizeof settings, .shadow_resolution = 16385};
    assert_int_equal(patina_scene_set_settings(stage.scene, &settings), PATINA_ERROR_ARGUMENT);
    assert_message(stage.scene, "shadow samples");
    float value;
    assert_int_equal(patina_frame_read_shadows(stage.frame, 0, 0, &value, sizeof value), PATINA_ERROR_EMPTY);
    assert_int_equal(patina_frame_bake_shadows(stage.frame, stage.scene), PATINA_ERROR_EMPTY);
    assert_int_equal(patina_frame_save_shadows(stage.frame, "unused"), PATINA_ERROR_EMPTY);
    clear_stage(&stage);
}

// A plane has fewer than 2^29 pixels. A larger one has the code of images that memory lacks for, so that callers draw regions.
static void test_planes_too_large(void **state)
{
    (void)state;
    struct stage stage = set_stage(0);
    static const uint32_t sizes[][2] = {{65536, 8300}, {32768, 32768}, {65536, 65536}};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        set_size(stage.scene, sizes[i][0], sizes[i][1]);
        assert_int_equal(patina_frame_check(stage.frame, stage.scene), PATINA_ERROR_TOO_LARGE);
        assert_message(stage.frame, "pixels are too large: render in regions");
        assert_int_equal(patina_frame_render(stage.frame, stage.scene), PATINA_ERROR_TOO_LARGE);
        assert_message(stage.frame, "pixels are too large: render in regions");
        set_size(stage.scene, SIDE, SIDE);
        assert_int_equal(patina_frame_check(stage.frame, stage.scene), PATINA_OK);
    }
    patina_settings part = {.struct_size = sizeof part, .width = 65536, .height = 8300, .region = {32000, 4000, 32100, 4100}};
    assert_int_equal(patina_scene_set_settings(stage.scene, &part), PATINA_OK);
    assert_int_equal(patina_frame_render(stage.frame, stage.scene), PATINA_OK);
    clear_stage(&stage);
}

static void test_cameras(void **state)
{
    (void)state;
    struct stage stage = set_stage(0);
    patina_camera camera = {.struct_size = sizeof camera};
    assert_int_equal(patina_scene_frame_camera(stage.scene, 30, 40, 0, &camera), PATINA_OK);
    patina_camera flat = camera, narrow = camera, endless = camera;
    for (int row = 0; row < 3; row++) // two parallel axes
        flat.world_from_camera[4 * row] = flat.world_from_camera[4 * row + 1];
    assert_int_equal(patina_scene_set_camera(stage.scene, &flat), PATINA_ERROR_ARGUMENT);
    assert_message(stage.scene, "singular");
    narrow.near_clip = 1e-50;
    assert_int_equal(patina_scene_set_camera(stage.scene, &narrow), PATINA_ERROR_ARGUMENT);
    endless.far_clip = 1e300;
    assert_int_equal(patina_scene_set_camera(stage.scene, &endless), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_scene_set_camera(stage.scene, &camera), PATINA_OK);
    clear_stage(&stage);
}

static void test_statistics_in_any_locale(void **state)
{
    (void)state;
    char json[4096];
    struct stage stage = set_stage(0);
    const char *comma = setlocale(LC_NUMERIC, "de_DE.UTF-8");
    assert_int_equal(patina_frame_render(stage.frame, stage.scene), PATINA_OK);
    assert_true(patina_frame_stats_json(stage.frame, json, sizeof json) < sizeof json);
    setlocale(LC_NUMERIC, "C");
    if (!comma)
        print_message("skip comma locale: de_DE.UTF-8 is not installed; the C locale was tried\n");
    const char *scatter = strstr(json, "\"scatter\":");
    assert_non_null(scatter);
    scatter += strlen("\"scatter\":");
    assert_int_equal(scatter[strspn(scatter, "0123456789")], '.');
    clear_stage(&stage);
}

static void test_opacities_and_discs(void **state)
{
    (void)state;
    static const float wrong[] = {-0.1f, 1.5f, NAN, INFINITY};
    static float points[4][3] = {{0}, {1}, {0, 1}, {1, 1}};
    static const float opacities[4] = {0.5f, 1.0f, -2.0f, NAN};
    struct stage stage = set_stage(0);
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        patina_cloud_style style = {.struct_size = sizeof style, .transparency = wrong[i]};
        assert_int_equal(patina_scene_add_cloud(stage.scene, stage.cloud, &style), PATINA_ERROR_ARGUMENT);
        assert_message(stage.scene, "transparency");
    }
    patina_cloud_style style = {.struct_size = sizeof style, .radius = -1.0f};
    assert_int_equal(patina_scene_add_cloud(stage.scene, stage.cloud, &style), PATINA_ERROR_ARGUMENT);
    assert_message(stage.scene, "radius");
    patina_settings settings = {.struct_size = sizeof settings, .surface = PATINA_SURFACE_RANGES + 1};
    assert_int_equal(patina_scene_set_settings(stage.scene, &settings), PATINA_ERROR_ARGUMENT);
    assert_message(stage.scene, "surface");
    patina_cloud_desc desc = {.struct_size = sizeof desc,
                              .count = 4,
                              .position = {points, PATINA_FLOAT32, 3, 0},
                              .opacity = {opacities, PATINA_FLOAT32, 3, 0}};
    patina_cloud *cloud = NULL;
    assert_int_equal(patina_cloud_create(&desc, NULL, &cloud), PATINA_ERROR_ARGUMENT);
    assert_message(NULL, "opacity: 3 components; 1 is needed");
    desc.opacity = (patina_array){opacities, PATINA_INT32, 1, 0};
    assert_int_equal(patina_cloud_create(&desc, NULL, &cloud), PATINA_ERROR_ARGUMENT);
    assert_message(NULL, "opacity: element type 8");
    desc.opacity.type = PATINA_FLOAT32;
    desc.radius = (patina_array){opacities, PATINA_UINT8, 1, 0};
    assert_int_equal(patina_cloud_create(&desc, NULL, &cloud), PATINA_ERROR_ARGUMENT);
    assert_message(NULL, "radius: element type 3");
    const float radii[4] = {0.5f, -1.0f, NAN, 2.0f};
    desc.radius = (patina_array){radii, PATINA_FLOAT32, 1, 0};
    patina_cloud_info info = {.struct_size = sizeof info};
    assert_int_equal(patina_cloud_create(&desc, NULL, &cloud), PATINA_OK);
    assert_int_equal(patina_cloud_get_info(cloud, &info), PATINA_OK);
    assert_true(info.has_radii && info.radius_most == 2.0f);
    assert_true(info.has_opacities && info.layer_distance >= 2.0 * info.spacing && info.spacing > 0.0);
    patina_cloud_destroy(cloud);
    clear_stage(&stage);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_picture_survives_memory_cap),
        cmocka_unit_test(test_light_map_above_memory_cap),
        cmocka_unit_test(test_cancel_ends_with_its_render),
        cmocka_unit_test(test_bad_lights_and_shadows),
        cmocka_unit_test(test_lights_end_at_32),
        cmocka_unit_test(test_planes_too_large),
        cmocka_unit_test(test_opacities_and_discs),
        cmocka_unit_test(test_cameras),
        cmocka_unit_test(test_statistics_in_any_locale),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
