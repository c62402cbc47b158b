// SPDX-License-Identifier: GPL-3.0-or-later
// 10,000 renders in one process, all options varied: what the process holds does not grow, and the first image and the last are equal.
// PATINA_SOAK: percent of them.
#include "hard/random_scenes.h"
#include "scenes/support.h"
#include "usage.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { RENDERS = 10000, ROUNDS = 10 }; // all scenes are drawn once in each round: afterwards the process holds the same

struct image {
    float *pixels;
    uint64_t *keys;
};

static struct image image(void)
{
    return (struct image){calloc(RANDOM_FLOATS, sizeof(float)), calloc(RANDOM_KEYS, sizeof(uint64_t))};
}

static void image_free(struct image image)
{
    free(image.pixels);
    free(image.keys);
}

// One image; the frame is used for several, and then another.
static int draw(patina_frame *frame, uint32_t seed, struct image out)
{
    patina_scene *scene = random_scene(seed);
    const int code = patina_frame_render(frame, scene);
    memset(out.pixels, 0, RANDOM_FLOATS * sizeof(float));
    memset(out.keys, 0, RANDOM_KEYS * sizeof(uint64_t));
    if (code == PATINA_OK)
        random_read(frame, out.pixels, out.keys);
    patina_scene_destroy(scene);
    return code;
}

static void round_of(patina_device *device, uint32_t count, struct image out, struct image first)
{
    enum { A_FRAME = 16 };
    patina_frame *frame = NULL;
    uint32_t drawn = 0;
    char text[4096];
    for (uint32_t i = 0; i < count; i++) {
        if (i % A_FRAME == 0) {
            patina_frame_destroy(frame);
            CHECK(patina_frame_create(device, &frame), device);
        }
        drawn += draw(frame, 1 + i, i ? out : first) == PATINA_OK;
        support_drain_log(text, sizeof text);
    }
    patina_frame_destroy(frame);
    assert_true(drawn >= count / 2);
}

static void soak(patina_device *device, const char *name)
{
    const uint32_t count = soak_count(RENDERS) / ROUNDS + 1;
    struct image out = image(), first = image(), last = image();
    struct usage before = {0};
    if (support_is_gl(name))
        usage_watch(device);
    for (int i = 0; i < ROUNDS; i++) {
        round_of(device, count, out, i ? last : first);
        if (i == 1)
            before = usage_now();
        assert_memory_equal(i ? last.pixels : first.pixels, first.pixels, RANDOM_FLOATS * sizeof(float));
        assert_memory_equal(i ? last.keys : first.keys, first.keys, RANDOM_KEYS * sizeof(uint64_t));
    }
    const struct usage after = usage_now();
    printf("  %s: %u renders\n", name, count * ROUNDS);
    usage_compare(name, &before, &after);
    image_free(out);
    image_free(first);
    image_free(last);
}

static void test_renders(void **state)
{
    (void)state;
    random_scenes_begin();
    for (uint32_t i = 0; i < support_device_count(); i++) {
        const char *name = support_device_name(i);
        patina_device *device = support_device_open(name, 2, 0);
        if (device)
            soak(device, name);
        patina_device_destroy(device);
    }
    random_scenes_end();
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    usage_begin();
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_renders)};
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    usage_end();
    return failed;
}
