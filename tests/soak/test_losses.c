// SPDX-License-Identifier: GPL-3.0-or-later
// 1,000 times a device of OpenGL loses its context while it draws, at any moment: the render returns an error with a sentence, another
// device draws the same image as the first, and nothing of the lost one stays. PATINA_SOAK: percent of them.
#include "scenes/clouds.h"
#include "scenes/support.h"
#include "usage.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LOSSES = 1000, SIDE = 96, MOST_CHECKS = 60, A_WATCH = 50 };

static patina_scene *lit_scene(const patina_cloud *cloud)
{
    const double eye[3] = {0, -4, 1}, target[3] = {0, 0, 0};
    const patina_camera camera = camera_perspective(eye, target, 40.0, SIDE, SIDE, 0.1, 20.0);
    const patina_settings settings = {.struct_size = sizeof settings, .width = SIDE, .height = SIDE};
    const patina_light_desc light = {
        .struct_size = sizeof light, .type = PATINA_LIGHT_SUN, .power = 3, .direction = {1, 1, -1}, .shadows = 1};
    patina_scene *scene = NULL;
    CHECK(patina_scene_create(&scene), NULL);
    CHECK(patina_scene_add_cloud(scene, cloud, NULL), scene);
    CHECK(patina_scene_add_light(scene, &light), scene);
    CHECK(patina_scene_set_camera(scene, &camera), scene);
    CHECK(patina_scene_set_settings(scene, &settings), scene);
    return scene;
}

// Whether the image came. lose_after: checks of OpenGL until the context is lost; 0: it is not.
static int draw(const char *name, const patina_scene *scene, uint32_t lose_after, float *pixels)
{
    patina_device *device = support_device_open(name, 1, 0);
    patina_frame *frame = NULL;
    if (!device)
        skip();
    CHECK(patina_frame_create(device, &frame), device);
    if (lose_after)
        usage_lose_after(device, lose_after);
    const int code = patina_frame_render(frame, scene);
    if (code == PATINA_OK) {
        CHECK(patina_frame_read(frame, PATINA_PASS_COMBINED, pixels, SIDE * SIDE * 4 * sizeof *pixels), frame);
    } else {
        assert_int_equal(code, PATINA_ERROR_DEVICE);
        assert_non_null(strstr(support_message(frame), "context was lost while"));
        assert_int_equal(patina_frame_render(frame, scene), PATINA_ERROR_DEVICE); // it stays lost
        assert_int_not_equal(patina_frame_read(frame, PATINA_PASS_COMBINED, pixels, SIDE * SIDE * 4 * sizeof *pixels),
                             PATINA_OK);
    }
    patina_frame_destroy(frame);
    patina_device_destroy(device);
    return code == PATINA_OK;
}

static void test_losses(void **state)
{
    (void)state;
    enum { WARM = 8 };
    const uint32_t count = soak_count(LOSSES) + 2 * WARM;
    struct points points = points_torus(4000, 1.0, 0.4, POINTS_ALL, 1);
    patina_cloud *cloud = points_upload(&points);
    patina_scene *scene = lit_scene(cloud);
    float *first = calloc(SIDE * SIDE * 4, sizeof *first), *other = calloc(SIDE * SIDE * 4, sizeof *other);
    struct usage before = {0};
    struct pcg random = pcg_seed(49);
    uint32_t lost = 0, tried = 0;
    char text[4096];
    for (uint32_t k = 0; k < support_device_count(); k++) {
        const char *name = support_device_name(k);
        if (!support_is_gl(name))
            continue;
        lost = 0;
        tried++;
        assert_true(draw(name, scene, 0, first));
        for (uint32_t i = 0; i < count; i++) {
            lost += !draw(name, scene, 1 + pcg_u32(&random) % MOST_CHECKS, other);
            support_drain_log(text, sizeof text);
            if (i % A_WATCH == 0) {
                assert_true(draw(name, scene, 0, other));
                assert_memory_equal(first, other, SIDE * SIDE * 4 * sizeof *first);
            }
            if (i == WARM)
                before = usage_now();
        }
        assert_true(draw(name, scene, 0, other));
        assert_memory_equal(first, other, SIDE * SIDE * 4 * sizeof *first);
        const struct usage after = usage_now();
        printf("  %s: lost %u times of %u\n", name, lost, count);
        assert_true(lost >= count / 2);
        usage_compare(name, &before, &after);
    }
    free(first);
    free(other);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    points_free(&points);
    if (!tried) {
        print_message("skip test_losses: no device of OpenGL was asked for\n");
        skip();
    }
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    usage_begin();
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_losses)};
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    usage_end();
    return failed;
}
