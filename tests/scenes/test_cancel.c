// SPDX-License-Identifier: GPL-3.0-or-later
// A render stops soon wherever it is cancelled. What follows a cancel is counted as work, not as time: steps of the processor's
// threads, dispatches of OpenGL, rows of the image.
#include "device.h"
#include "run/frame.h"
#include "staging.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    WIDTH = 512,
    HEIGHT = 384,
    PLACES = 24,    // where a render is cancelled, evenly over its looks
    MOST_STEPS = 1, // of the processor after a cancel, beside the one that runs
};

// What a device calls while it works. It cancels the frame at look `at`, or at the first look with this progress (0: never).
struct watch {
    patina_device *device;
    patina_frame *frame;
    uint32_t at;
    float from;
    atomic_uint looks;
    atomic_int cancelled;
    uint32_t looks_at_cancel;
    uint64_t steps_at_cancel;
    float last; // the greatest progress below 1 that was seen
};

static uint64_t steps_of(patina_device *device)
{
    struct pt_counts counts = {0};
    if (!device->ops->run_groups) // OpenGL counts at the end of a call
        assert_int_equal(device->ops->counts(device, &counts), 0);
    return counts.steps;
}

static void look(void *context)
{
    struct watch *watch = context;
    const uint32_t looks = atomic_fetch_add(&watch->looks, 1) + 1;
    const float progress = patina_frame_progress(watch->frame);
    if (!watch->at && watch->from <= 0.0f && progress < 1.0f && progress > watch->last)
        watch->last = progress; // one writes: a render that nobody cancels has one thread
    const int due = watch->at ? looks >= watch->at : watch->from > 0.0f && progress >= watch->from;
    if (!due || atomic_exchange(&watch->cancelled, 1))
        return;
    patina_frame_cancel(watch->frame);
    watch->looks_at_cancel = looks;
    watch->steps_at_cancel = steps_of(watch->device);
}

static int render(struct watch *watch, patina_scene *scene)
{
    watch->device->ops->watch(watch->device, look, watch);
    const int code = patina_frame_render(watch->frame, scene);
    watch->device->ops->watch(watch->device, NULL, NULL);
    return code;
}

// Soft shadows, and as many layers.
static patina_scene *scene_build(uint32_t layers, patina_cloud **cloud)
{
    const double eye[3] = {0, -3.2, 1.4}, target[3] = {0, 0, 0};
    const patina_camera camera = camera_perspective(eye, target, 40.0, WIDTH, HEIGHT, 0.1, 20.0);
    const patina_cloud_style style = {.struct_size = sizeof style, .transparency = layers > 1 ? 0.5f : 0.0f};
    const patina_settings settings = {
        .struct_size = sizeof settings, .width = WIDTH, .height = HEIGHT, .layers = layers, .shadow_samples = 4};
    const patina_light_desc light = {.struct_size = sizeof light,
                                     .type = PATINA_LIGHT_SUN,
                                     .power = 3,
                                     .direction = {1, 1, -1},
                                     .angle = 0.1f,
                                     .shadows = 1};
    struct points points = points_torus(60000, 1.0, 0.4, POINTS_ALL, 47);
    *cloud = points_upload(&points);
    points_free(&points);
    patina_scene *scene = scene_of(*cloud, &style);
    CHECK(patina_scene_add_light(scene, &light), scene);
    CHECK(patina_scene_set_camera(scene, &camera), scene);
    CHECK(patina_scene_set_settings(scene, &settings), scene);
    return scene;
}

static void read_color(const patina_frame *frame, float *pixels)
{
    CHECK(patina_frame_read(frame, PATINA_PASS_COMBINED, pixels, (size_t)WIDTH * HEIGHT * 4 * sizeof *pixels), frame);
}

static void cancel_everywhere(patina_device *device, const char *name)
{
    const size_t size = (size_t)WIDTH * HEIGHT * 4 * sizeof(float);
    float *truth = malloc(size), *pixels = malloc(size);
    patina_cloud *cloud;
    patina_scene *scene = scene_build(3, &cloud);
    struct watch whole = {.device = device};
    uint32_t most = 0;
    for (int i = 0; i < 2; i++) { // the second: programs are compiled, the cloud is uploaded
        whole.looks = 0;
        CHECK(patina_frame_create(device, &whole.frame), device);
        CHECK(render(&whole, scene), whole.frame);
        read_color(whole.frame, truth);
        patina_frame_destroy(whole.frame);
    }
    assert_true(whole.looks > PLACES);
    for (uint32_t i = 0; i < PLACES; i++) {
        struct watch watch = {.device = device, .at = 1 + whole.looks * i / PLACES};
        CHECK(patina_frame_create(device, &watch.frame), device);
        assert_int_equal(render(&watch, scene), PATINA_ERROR_CANCELLED);
        const uint32_t after = device->ops->run_groups ? watch.looks - watch.looks_at_cancel
                                                       : (uint32_t)(steps_of(device) - watch.steps_at_cancel);
        most = after > most ? after : most;
        assert_int_equal(patina_frame_read(watch.frame, PATINA_PASS_COMBINED, pixels, size), PATINA_ERROR_EMPTY);
        CHECK(patina_frame_render(watch.frame, scene), watch.frame);
        read_color(watch.frame, pixels);
        assert_memory_equal(pixels, truth, size);
        patina_frame_destroy(watch.frame);
    }
    printf("  %s: %u looks, at most %u steps after a cancel\n", name, whole.looks, most);
    assert_true(most <= MOST_STEPS);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    free(truth);
    free(pixels);
}

static void test_everywhere(void **state)
{
    (void)state;
    support_each_device(cancel_everywhere);
}

// Writing the image stops between rows, unless the frame holds an earlier image: that one stays.
static void test_while_writing(void **state)
{
    (void)state;
    const uint32_t poison = 0x7FA5A5A5;
    const size_t count = (size_t)WIDTH * HEIGHT * 4;
    patina_cloud *cloud;
    patina_scene *scene = scene_build(1, &cloud);
    patina_device *device = support_device_open("cpu", 2, 0);
    struct watch watch = {.device = device};
    CHECK(patina_frame_create(device, &watch.frame), device);
    CHECK(render(&watch, scene), watch.frame);
    struct patina_frame *frame = watch.frame;
    struct pt_buffer *combined = &frame->planes.at[PT_PLANE_COMBINED][0];
    float *truth = malloc(count * sizeof *truth), *pixels = malloc(count * sizeof *pixels);
    read_color(frame, truth);
    const float writing = watch.last;

    watch = (struct watch){.device = device, .frame = frame, .from = writing};
    const int code = render(&watch, scene);
    assert_int_equal(code, PATINA_OK); // once it is being written, it is finished
    read_color(frame, pixels);
    assert_memory_equal(pixels, truth, count * sizeof *pixels);

    frame->shown.picture_valid = 0; // as if there were none
    assert_int_equal(device->ops->buffer_fill(device, combined, 0, combined->size, poison, 4), 0);
    watch = (struct watch){.device = device, .frame = frame, .from = writing};
    assert_int_equal(render(&watch, scene), PATINA_ERROR_CANCELLED);
    const uint32_t *words = combined->data;
    uint32_t rows = 0;
    for (uint32_t y = 0; y < HEIGHT; y++)
        rows += words[(size_t)4 * WIDTH * y] != poison;
    printf("  %u of %u rows were written\n", rows, HEIGHT);
    assert_true(rows < HEIGHT / 2);
    assert_int_equal(patina_frame_read(frame, PATINA_PASS_COMBINED, pixels, count * sizeof *pixels), PATINA_ERROR_EMPTY);
    patina_frame_destroy(frame);
    patina_device_destroy(device);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    free(truth);
    free(pixels);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_everywhere), cmocka_unit_test(test_while_writing)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
