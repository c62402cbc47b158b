// SPDX-License-Identifier: GPL-3.0-or-later
// Random scenes: whatever a description says within what the header allows, a picture comes or an error, and nothing that is not the
// picture's own is read for it. Each is drawn by a frame that drew the ones before it, whose planes are overwritten outside of their
// lifetimes, and by a fresh frame on one thread: bytes are equal. PATINA_RANDOM_SCENES="FIRST COUNT" draws others.
#include "random_scenes.h"
#include "scenes/support.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SCENES = 400 };

static patina_frame *frame_on(patina_device *device)
{
    patina_frame *frame = NULL;
    CHECK(patina_frame_create(device, &frame), device);
    return frame;
}

// Whether it could be drawn: the same by both frames.
static int draw(patina_frame *used, patina_frame *fresh, const patina_scene *scene, uint32_t seed)
{
    float *pixels[2] = {calloc(RANDOM_FLOATS, sizeof(float)), calloc(RANDOM_FLOATS, sizeof(float))};
    uint64_t *keys[2] = {calloc(RANDOM_KEYS, sizeof(uint64_t)), calloc(RANDOM_KEYS, sizeof(uint64_t))};
    const int codes[2] = {patina_frame_render(used, scene), patina_frame_render(fresh, scene)};
    if (codes[0] != codes[1])
        fail_msg("scene %u: %s, and %s in a fresh frame", seed, patina_error_text(codes[0]), patina_error_text(codes[1]));
    if (codes[0] == PATINA_OK) {
        random_read(used, pixels[0], keys[0]);
        random_read(fresh, pixels[1], keys[1]);
        if (memcmp(pixels[0], pixels[1], RANDOM_FLOATS * sizeof(float)) ||
            memcmp(keys[0], keys[1], RANDOM_KEYS * sizeof(uint64_t)))
            fail_msg("scene %u differs in a fresh frame", seed);
    }
    for (int k = 0; k < 2; k++) {
        free(pixels[k]);
        free(keys[k]);
    }
    return codes[0] == PATINA_OK;
}

static void tell(patina_frame *frame, const patina_scene *scene, uint32_t seed)
{
    const size_t size = patina_frame_plan_text(frame, scene, NULL, 0) + 1;
    char *text = calloc(size, 1);
    patina_frame_plan_text(frame, scene, text, size);
    fprintf(stderr, "scene %u\n%s\n", seed, text);
    free(text);
}

// Of frames that are made from here on.
static void poison_planes(int on)
{
#ifdef _WIN32
    _putenv_s("PATINA_POISON_PLANES", on ? "1" : "");
#else
    if (on)
        setenv("PATINA_POISON_PLANES", "1", 1);
    else
        unsetenv("PATINA_POISON_PLANES");
#endif
}

static void test_random_scenes(void **state)
{
    (void)state;
    uint32_t first = 1, count = SCENES, drawn = 0;
    if (getenv("PATINA_RANDOM_SCENES"))
        assert_int_equal(sscanf(getenv("PATINA_RANDOM_SCENES"), "%u %u", &first, &count), 2);
    const char *name = support_device_name(0);
    patina_device *devices[2] = {support_device_open(name, 3, 0), support_device_open(name, 1, 0)};
    if (!devices[0] || !devices[1])
        skip();
    random_scenes_begin();
    poison_planes(1);
    patina_frame *used = frame_on(devices[0]);
    poison_planes(0);
    for (uint32_t seed = first; seed < first + count; seed++) {
        patina_scene *scene = random_scene(seed);
        patina_frame *fresh = frame_on(devices[1]);
        if (getenv("PATINA_RANDOM_SCENES"))
            tell(used, scene, seed);
        drawn += (uint32_t)draw(used, fresh, scene, seed);
        patina_frame_destroy(fresh);
        patina_scene_destroy(scene);
    }
    printf("  %u of %u scenes were drawn\n", drawn, count);
    assert_true(drawn >= count / 2);
    patina_frame_destroy(used);
    patina_device_destroy(devices[0]);
    patina_device_destroy(devices[1]);
    random_scenes_end();
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_random_scenes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
