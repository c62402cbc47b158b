// SPDX-License-Identifier: GPL-3.0-or-later
// 1,000 cancels at random moments of renders, refinements, shadows, uploads, analyses, saving and tasks: each call returns "cancelled" or
// finishes, the next image is equal to the first, and what the process holds does not grow. PATINA_SOAK: percent of them.
#include "scenes/clouds.h"
#include "scenes/support.h"
#include "usage.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { CANCELS = 1000, SIDE = 160, POINTS = 30000, WARM = 24 };

struct stage {
    struct points points;
    patina_cloud *cloud;
    patina_scene *scene;
    patina_frame *frame;
    char path[64];
};

// Another thread cancels after so many microseconds.
struct later {
    pthread_t thread;
    patina_frame *frame;
    patina_progress *progress;
    uint32_t microseconds;
};

static void *cancel(void *argument)
{
    const struct later *later = argument;
    nanosleep(&(struct timespec){0, (long)later->microseconds * 1000}, NULL);
    if (later->frame)
        patina_frame_cancel(later->frame);
    else
        patina_progress_cancel(later->progress);
    return NULL;
}

static int render(struct stage *s, patina_progress *progress)
{
    (void)progress;
    return patina_frame_render(s->frame, s->scene);
}

static int bake(struct stage *s, patina_progress *progress)
{
    (void)progress;
    return patina_frame_bake_shadows(s->frame, s->scene);
}

static int upload(struct stage *s, patina_progress *progress)
{
    patina_cloud *cloud = NULL;
    const patina_cloud_desc desc = points_desc(&s->points);
    const int code = patina_cloud_create(&desc, progress, &cloud);
    patina_cloud_destroy(cloud);
    return code;
}

static int analyse(struct stage *s, patina_progress *progress)
{
    patina_cloud *cloud = points_upload(&s->points);
    const int code = patina_cloud_analyse(cloud, NULL, progress);
    patina_cloud_destroy(cloud);
    return code;
}

static int task(struct stage *s, patina_progress *progress)
{
    patina_task *made = NULL;
    const patina_cloud_desc desc = points_desc(&s->points);
    CHECK(patina_task_build(&desc, progress, &made), NULL);
    const int code = patina_task_wait(made);
    patina_task_destroy(made);
    return code;
}

static int verify(struct stage *s, patina_progress *progress) { return patina_cloud_verify(s->path, progress); }

static int analyse_file(struct stage *s, patina_progress *progress)
{
    patina_task *made = NULL;
    char to[80];
    snprintf(to, sizeof to, "%s.analysed", s->path);
    CHECK(patina_task_analyse_file(s->path, NULL, 0, to, progress, &made), NULL);
    const int code = patina_task_wait(made);
    patina_task_destroy(made);
    unlink(to);
    return code;
}

// What is cancelled, and by which handle; most: microseconds, about as long as it takes.
static const struct work {
    int (*run)(struct stage *, patina_progress *);
    int by_frame;
    uint32_t most;
} works[] = {{render, 1, 30000}, {bake, 1, 20000},  {upload, 0, 30000},        {analyse, 0, 200000},
             {task, 0, 30000},   {verify, 0, 1000}, {analyse_file, 0, 300000}, {render, 1, 5000}};
enum { WORKS = sizeof works / sizeof *works };

// Whether it was cancelled.
static int try_one(struct stage *s, const struct work *work, struct pcg *random)
{
    struct later later = {.frame = work->by_frame ? s->frame : NULL, .microseconds = pcg_u32(random) % work->most};
    if (!work->by_frame)
        CHECK(patina_progress_create(&later.progress), NULL);
    assert_int_equal(pthread_create(&later.thread, NULL, cancel, &later), 0);
    const int code = work->run(s, later.progress);
    pthread_join(later.thread, NULL);
    if (code != PATINA_OK && code != PATINA_ERROR_CANCELLED)
        fail_msg("%s: %s", patina_error_text(code), support_message(NULL));
    patina_progress_destroy(later.progress);
    return code == PATINA_ERROR_CANCELLED;
}

static void draw(struct stage *s, float *pixels)
{
    const int code = patina_frame_render(s->frame, s->scene); // a cancel that came behind a render's end ends the next one
    if (code == PATINA_ERROR_CANCELLED)
        CHECK(patina_frame_render(s->frame, s->scene), s->frame);
    CHECK(patina_frame_read(s->frame, PATINA_PASS_COMBINED, pixels, SIDE * SIDE * 4 * sizeof *pixels), s->frame);
}

static void stage_begin(struct stage *s, patina_device *device)
{
    const double eye[3] = {0, -4, 1}, target[3] = {0, 0, 0};
    const patina_camera camera = camera_perspective(eye, target, 40.0, SIDE, SIDE, 0.1, 20.0);
    const patina_settings settings = {.struct_size = sizeof settings, .width = SIDE, .height = SIDE, .shadow_samples = 4};
    const patina_light_desc light = {.struct_size = sizeof light,
                                     .type = PATINA_LIGHT_SUN,
                                     .power = 3,
                                     .direction = {1, 1, -1},
                                     .angle = 0.1f,
                                     .shadows = 1};
    *s = (struct stage){.points = points_torus(POINTS, 1.0, 0.4, POINTS_ALL, 1)};
    s->cloud = points_upload(&s->points);
    snprintf(s->path, sizeof s->path, "%s/good.cloud", getenv("TMPDIR"));
    CHECK(patina_cloud_save(s->cloud, s->path), s->cloud);
    CHECK(patina_scene_create(&s->scene), NULL);
    CHECK(patina_scene_add_cloud(s->scene, s->cloud, NULL), s->scene);
    CHECK(patina_scene_add_light(s->scene, &light), s->scene);
    CHECK(patina_scene_set_camera(s->scene, &camera), s->scene);
    CHECK(patina_scene_set_settings(s->scene, &settings), s->scene);
    CHECK(patina_frame_create(device, &s->frame), device);
}

static void stage_end(struct stage *s)
{
    patina_frame_destroy(s->frame);
    patina_scene_destroy(s->scene);
    patina_cloud_destroy(s->cloud);
    points_free(&s->points);
    unlink(s->path);
}

static void soak(patina_device *device, const char *name)
{
    const uint32_t count = soak_count(CANCELS) + 2 * WARM;
    struct stage s;
    struct usage before = {0};
    struct pcg random = pcg_seed(49);
    uint32_t cancelled = 0;
    char text[4096];
    float *first = calloc(SIDE * SIDE * 4, sizeof *first), *other = calloc(SIDE * SIDE * 4, sizeof *other);
    stage_begin(&s, device);
    if (support_is_gl(name))
        usage_watch(device);
    draw(&s, first);
    for (uint32_t i = 0; i < count; i++) {
        cancelled += (uint32_t)try_one(&s, &works[i % WORKS], &random);
        draw(&s, other);
        assert_memory_equal(first, other, SIDE * SIDE * 4 * sizeof *first);
        support_drain_log(text, sizeof text);
        if (i == WARM)
            before = usage_now();
    }
    const struct usage after = usage_now();
    printf("  %s: %u of %u calls were cancelled\n", name, cancelled, count);
    assert_true(cancelled >= count / 10);
    usage_compare(name, &before, &after);
    stage_end(&s);
    free(first);
    free(other);
}

static void test_cancels(void **state)
{
    (void)state;
    support_each_device(soak);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    usage_begin();
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_cancels)};
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    usage_end();
    return failed;
}
