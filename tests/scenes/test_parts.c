// SPDX-License-Identifier: GPL-3.0-or-later
// Pictures whose points are scattered in parts and merged equal those of one frame, all passes, bit for bit (SPEC 12): every staging, on
// every device; parts of one device merge on another. What no part can do is refused by name.
#include "staging.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { PARTS = 3, ROUNDS = PATINA_MAX_LAYERS + 1 };

static char folder[] = "/tmp/patina-parts-XXXXXX", paths[PARTS * ROUNDS][64], next[64];

static void set_paths(void)
{
    if (!mkdtemp(folder))
        support_die("no temporary folder");
    for (int i = 0; i < PARTS * ROUNDS; i++)
        snprintf(paths[i], sizeof paths[i], "%s/%d.keys", folder, i);
    snprintf(next, sizeof next, "%s/next", folder);
}

static void remove_files(void)
{
    for (int i = 0; i < PARTS * ROUNDS; i++)
        remove(paths[i]);
    remove(next);
}

// 0, or what refused it. Rounds until the picture is done, in `frame`.
static int draw_in_parts(patina_device *scatters, patina_frame *frame, patina_scene *scene, uint32_t *rounds)
{
    const char *list[PARTS * ROUNDS];
    uint32_t round = 1, count = 0;
    for (*rounds = 0; round; ++*rounds) {
        for (uint32_t k = 1; k <= PARTS; k++, count++) {
            patina_frame *own = NULL; // as on a machine of its own
            CHECK(patina_frame_create(scatters, &own), scatters);
            const patina_part part = {.struct_size = sizeof part, .part = k, .of = PARTS, .behind = round > 1 ? next : NULL};
            list[count] = paths[count];
            const int code = patina_frame_scatter(own, scene, &part, paths[count]);
            if (code && code != PATINA_ERROR_UNSUPPORTED)
                CHECK(code, own);
            patina_frame_destroy(own);
            if (code)
                return code;
        }
        assert_true(count <= PARTS * ROUNDS);
        CHECK(patina_frame_merge(frame, scene, list, count, next, &round), frame);
        assert_true(!round || round == count / PARTS + 1);
    }
    return 0;
}

static uint32_t compare(patina_device *scatters, patina_device *merges, const struct staging *staging)
{
    struct stage stage = stage_build(staging);
    struct picture whole = picture_render(merges, stage.scene, &stage.camera, &stage.settings);
    patina_frame *frame = NULL;
    uint32_t rounds = 0;
    CHECK(patina_frame_create(merges, &frame), merges);
    const int code = draw_in_parts(scatters, frame, stage.scene, &rounds);
    if (!code) {
        struct picture parts = picture_read(frame);
        picture_read_layers(&parts, frame, &stage.settings);
        picture_assert_identical(&parts, &whole, 0, 0, staging->name);
        picture_free(&parts);
    }
    remove_files();
    patina_frame_destroy(frame);
    picture_free(&whole);
    stage_free(&stage);
    return code ? 0 : rounds;
}

static void test_parts(void **state)
{
    (void)state;
    for (uint32_t k = 0; k < support_device_count(); k++) {
        const char *name = support_device_name(k);
        if (!strncmp(name, "cpu-", 4))
            continue;
        patina_device *device = support_device_open(name, 0, 0), *plain = support_device_open("cpu-scalar", 2, 0);
        uint32_t done = 0, most = 0;
        for (uint32_t i = 0; i < staging_count && device && plain; i++) {
            if (support_is_gl(name) && stagings[i].width > 500)
                continue;
            const uint32_t rounds = compare(i % 2 ? plain : device, device, &stagings[i]);
            done += rounds > 0;
            most = rounds > most ? rounds : most;
        }
        if (device)
            assert_true(done > staging_count / 2 && most > 2);
        patina_device_destroy(plain);
        patina_device_destroy(device);
    }
}

static void test_refusals(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    struct stage stage = stage_build(&stagings[0]);
    CHECK(patina_scene_set_camera(stage.scene, &stage.camera), stage.scene);
    CHECK(patina_scene_set_settings(stage.scene, &stage.settings), stage.scene);
    patina_frame *frame = NULL;
    CHECK(patina_frame_create(device, &frame), device);
    const patina_part none = {.struct_size = sizeof none, .part = 0, .of = 2},
                      beyond = {.struct_size = sizeof none, .part = 3, .of = 2},
                      good = {.struct_size = sizeof good, .part = 1, .of = 2}, unset = {.part = 1, .of = 1};
    uint32_t round = 9;
    assert_int_equal(patina_frame_scatter(frame, stage.scene, &none, paths[0]), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_frame_scatter(frame, stage.scene, &beyond, paths[0]), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_frame_scatter(frame, stage.scene, &unset, paths[0]), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_frame_scatter(frame, stage.scene, &good, NULL), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_frame_scatter(frame, stage.scene, &good, "no/such/folder/x.keys"), PATINA_ERROR_FILE);
    assert_int_equal(patina_frame_merge(frame, stage.scene, NULL, 0, NULL, &round), PATINA_ERROR_EMPTY);
    patina_frame_cancel(frame);
    assert_int_equal(patina_frame_scatter(frame, stage.scene, &good, paths[0]), PATINA_ERROR_CANCELLED);
    patina_keys_info info = {.struct_size = sizeof info};
    assert_int_equal(patina_keys_get_info(paths[0], &info), PATINA_ERROR_FILE); // nothing was left
    CHECK(patina_frame_scatter(frame, stage.scene, &good, paths[0]), frame);
    CHECK(patina_keys_get_info(paths[0], &info), NULL);
    assert_true(info.kind == PATINA_KEYS_PART && info.part == 1 && info.of == 2 && info.round == 1 && !info.note_size);
    remove_files();

    // light through points of different opacity, layer behind layer
    float positions[300], opacity[100];
    for (int i = 0; i < 300; i++)
        positions[i] = (float)(i % 7) - (float)(i % 3);
    for (int i = 0; i < 100; i++)
        opacity[i] = (float)(i % 10) * 0.1f;
    const patina_cloud_desc desc = {.struct_size = sizeof desc,
                                    .count = 100,
                                    .position = {.data = positions, .type = PATINA_FLOAT32, .components = 3},
                                    .opacity = {.data = opacity, .type = PATINA_FLOAT32, .components = 1}};
    const patina_light_desc sun = {
        .struct_size = sizeof sun, .type = PATINA_LIGHT_SUN, .power = 1, .direction = {0, 1, -1}, .shadows = 1};
    patina_cloud_style style = PATINA_CLOUD_STYLE_INIT;
    patina_cloud *cloud = NULL;
    patina_camera camera = {.struct_size = sizeof camera};
    char message[256];
    style.lighting = PATINA_LIGHTING_LIT;
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    patina_scene *scene = scene_of(cloud, &style);
    CHECK(patina_scene_set_settings(scene, &stage.settings), scene);
    CHECK(patina_scene_frame_camera(scene, 30, 40, 0, &camera), scene);
    CHECK(patina_scene_set_camera(scene, &camera), scene);
    CHECK(patina_scene_add_light(scene, &sun), scene);
    assert_int_equal(patina_frame_scatter(frame, scene, &good, paths[0]), PATINA_ERROR_UNSUPPORTED);
    assert_true(patina_message(frame, message, sizeof message) && strstr(message, "opacities of their own"));
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    patina_frame_destroy(frame);
    stage_free(&stage);
    patina_device_destroy(device);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    set_paths();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_parts),
        cmocka_unit_test(test_refusals),
    };
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    rmdir(folder);
    return failed;
}
