// SPDX-License-Identifier: GPL-3.0-or-later
// A border render equals the crop of the whole, all passes, bit for bit (SPEC 2.5).
#include "device.h"
#include "staging.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void set_region(patina_settings *settings, uint32_t x0, uint32_t y0, uint32_t x1, uint32_t y1)
{
    const uint32_t region[4] = {x0, y0, x1, y1};
    memcpy(settings->region, region, sizeof region);
}

static void compare_region(patina_device *device, const struct stage *stage, const struct picture *whole, uint32_t x0,
                           uint32_t y0, uint32_t x1, uint32_t y1, const char *name)
{
    patina_settings settings = stage->settings;
    set_region(&settings, x0, y0, x1, y1);
    struct picture part = picture_render(device, stage->scene, &stage->camera, &settings);
    assert_int_equal(part.width, x1 - x0);
    assert_int_equal(part.height, y1 - y0);
    char what[128];
    snprintf(what, sizeof what, "%s, region %u %u %u %u", name, x0, y0, x1, y1);
    picture_assert_identical(&part, whole, x0, y0, what);
    picture_free(&part);
}

// Odd places and sizes, all borders and corners, single pixels, rows and columns.
static void compare_places(patina_device *device, const struct stage *stage, const char *name, uint32_t random_count)
{
    uint32_t w = stage->settings.width, h = stage->settings.height;
    struct picture whole = picture_render(device, stage->scene, &stage->camera, &stage->settings);
    compare_region(device, stage, &whole, 0, 0, w, h, name);
    if (w > 1) {
        compare_region(device, stage, &whole, 0, 0, w / 2, h / 2, name);
        compare_region(device, stage, &whole, w / 2, h / 2, w, h, name);
        compare_region(device, stage, &whole, w - 1, 0, w, h, name);
        compare_region(device, stage, &whole, 0, h - 1, w, h, name);
        compare_region(device, stage, &whole, 0, h / 3, w, h / 3 + 1, name);
        compare_region(device, stage, &whole, w / 3, 0, w / 3 + 1, h, name);
        compare_region(device, stage, &whole, 1, 1, w - 1, h - 1, name);
    }
    struct pcg random = pcg_seed(w + h + stage->settings.fill);
    for (uint32_t i = 0; i < random_count; i++) {
        uint32_t x0 = pcg_u32(&random) % w, y0 = pcg_u32(&random) % h;
        uint32_t x1 = x0 + 1 + pcg_u32(&random) % (w - x0), y1 = y0 + 1 + pcg_u32(&random) % (h - y0);
        compare_region(device, stage, &whole, x0, y0, x1, y1, name);
    }
    picture_free(&whole);
}

static void test_regions(void **state)
{
    (void)state;
    const int quick = support_is_quick("large scenes, and 21 of 24 random regions of the others");
    for (uint32_t k = 0; k < support_device_count(); k++) {
        const char *name = support_device_name(k);
        if (!strncmp(name, "cpu-", 4))
            continue; // levels differ in kernels only, which parity compares
        patina_device *device = support_device_open(name, 0, 0);
        if (!device)
            continue;
        for (uint32_t i = 0; i < staging_count; i++) {
            if ((quick || support_is_gl(name)) && stagings[i].width > 500)
                continue;
            struct stage stage = stage_build(&stagings[i]);
            compare_places(device, &stage, stagings[i].name,
                           stagings[i].width > 500 ? 4
                           : support_is_gl(name)   ? 2
                           : quick                 ? 3
                                                   : 24);
            stage_free(&stage);
        }
        patina_device_destroy(device);
    }
}

// Tiles of 17 x 13 put together.
static void test_tiles(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    static const uint32_t chosen[] = {19, 1, 5, 9, 13, 14};
    const uint32_t count = support_is_quick("tiles of all scenes but one") ? 1 : sizeof chosen / sizeof chosen[0];
    for (uint32_t i = 0; i < count; i++) {
        struct stage stage = stage_build(&stagings[chosen[i]]);
        struct picture whole = picture_render(device, stage.scene, &stage.camera, &stage.settings);
        for (uint32_t y = 0; y < whole.height; y += 13)
            for (uint32_t x = 0; x < whole.width; x += 17)
                compare_region(device, &stage, &whole, x, y, x + 17 < whole.width ? x + 17 : whole.width,
                               y + 13 < whole.height ? y + 13 : whole.height, stagings[chosen[i]].name);
        picture_free(&whole);
        stage_free(&stage);
    }
    patina_device_destroy(device);
}

// An OpenGL device is asked for all rows of keys at once: each call waits for it.
static void read_at_once(patina_device *device, const char *name)
{
    struct stage stage = stage_build(&stagings[19]);
    patina_settings settings = stage.settings;
    set_region(&settings, 3, 1, settings.width - 2, settings.height - 1);
    patina_frame *frame = NULL;
    CHECK(patina_scene_set_camera(stage.scene, &stage.camera), stage.scene);
    CHECK(patina_scene_set_settings(stage.scene, &settings), stage.scene);
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_frame_render(frame, stage.scene), frame);
    struct pt_counts before = {0}, after = {0};
    const uint32_t width = settings.width - 5, height = settings.height - 2;
    const size_t size = (size_t)width * height * sizeof(uint64_t);
    uint64_t *keys = malloc(size);
    assert_non_null(keys);
    CHECK(device->ops->counts(device, &before), device);
    CHECK(patina_frame_read_keys(frame, keys, size), frame);
    CHECK(device->ops->counts(device, &after), device);
    const uint64_t calls = after.calls - before.calls;
    printf("  %s: %u rows of keys by %llu calls\n", name, height, (unsigned long long)calls);
    assert_true(height > 20 && calls < 20);
    free(keys);
    patina_frame_destroy(frame);
    stage_free(&stage);
}

static void test_keys_are_read_at_once(void **state)
{
    (void)state;
    support_each_device(read_at_once);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_regions),
        cmocka_unit_test(test_tiles),
        cmocka_unit_test(test_keys_are_read_at_once),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
