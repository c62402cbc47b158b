// SPDX-License-Identifier: GPL-3.0-or-later
// The thread rules of patina.h, kept by two threads that share a device and a cloud, while the main thread makes every call that is allowed
// at any time. The thread sanitizer sees races; without it, images, messages and codes tell.
#include <patina/patina.h>

#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { POINTS = 4000, ROUNDS = 4, MOST = 96 * 64 };

static float points[POINTS][3];

struct shared {
    patina_device *device;
    patina_cloud *cloud;   // in the scenes of both
    patina_scene *turns;   // used by both, one call at a time
    pthread_mutex_t turn;  // of it
    atomic_int running;    // threads
    atomic_int cancelling; // the main thread cancels frames too
    atomic_uint cancelled, wrong;
    patina_task *_Atomic task; // started by one thread, ended by the other
};

struct worker {
    struct shared *shared;
    uint32_t number, width, height;
    patina_frame *_Atomic frame;
    patina_progress *_Atomic progress;
    patina_task *building;   // NULL: none
    pthread_mutex_t alive;   // held while building changes, and by who asks whether it is done
    float expected[MOST][4]; // drawn before, alone
    float pixels[MOST][4];
};

// cmocka's assertions are for its own thread alone.
#define REQUIRE(worker, what) require(worker, what, #what, __LINE__)
static int require(struct worker *worker, int good, const char *what, int line)
{
    char message[512] = "";
    if (!good) {
        patina_message(NULL, message, sizeof message);
        fprintf(stderr, "thread %u, line %d: not %s (%s)\n", worker->number, line, what, message);
        atomic_fetch_add(&worker->shared->wrong, 1);
    }
    return good;
}

static patina_cloud_desc cloud_of(float (*positions)[3])
{
    return (patina_cloud_desc){
        .struct_size = sizeof(patina_cloud_desc), .count = POINTS, .threads = 2, .position = {positions, PATINA_FLOAT32, 3, 0}};
}

static patina_scene *scene_of(struct worker *worker)
{
    patina_scene *scene = NULL;
    patina_camera camera = {.struct_size = sizeof camera};
    const patina_settings settings = {.struct_size = sizeof settings, .width = worker->width, .height = worker->height};
    REQUIRE(worker, !patina_scene_create(&scene) && !patina_scene_add_cloud(scene, worker->shared->cloud, NULL) &&
                        !patina_scene_set_settings(scene, &settings) &&
                        !patina_scene_frame_camera(scene, 30 + 20 * worker->number, 40, 0, &camera) &&
                        !patina_scene_set_camera(scene, &camera));
    return scene;
}

// Renders until nobody cancels it.
static void draw(struct worker *worker, patina_frame *frame, const patina_scene *scene)
{
    int code;
    while ((code = patina_frame_render(frame, scene)) == PATINA_ERROR_CANCELLED)
        atomic_fetch_add(&worker->shared->cancelled, 1);
    const size_t size = (size_t)worker->width * worker->height * sizeof *worker->pixels;
    REQUIRE(worker, !code && !patina_frame_read(frame, PATINA_PASS_COMBINED, worker->pixels[0], size));
}

// Each thread has messages of its own, and so has each handle.
static void look_at_messages(struct worker *worker, patina_frame *frame)
{
    char message[512] = "", other[512] = "";
    REQUIRE(worker, patina_frame_read(frame, PATINA_PASS_COMBINED, worker->pixels[0], 16 * worker->number + 16) < 0);
    for (int i = 0; i < 50; i++) {
        patina_message(NULL, message, sizeof message);
        patina_message(frame, other, sizeof other);
        if (!REQUIRE(worker, message[0] && !strcmp(message, other)))
            break;
    }
}

// A cloud built by a task that this thread starts, and this or the other one ends.
static void build(struct worker *worker, int hand_over)
{
    static const patina_analysis_desc analysis = {.struct_size = sizeof analysis, .threads = 1};
    const patina_cloud_desc desc = cloud_of(points);
    patina_task *task = NULL;
    patina_cloud *cloud = NULL, *none = NULL;
    if (!REQUIRE(worker, !patina_task_build(&desc, worker->progress, &task)))
        return;
    pthread_mutex_lock(&worker->alive);
    worker->building = task;
    pthread_mutex_unlock(&worker->alive);
    REQUIRE(worker, !patina_task_wait(task) && patina_task_done(task));
    pthread_mutex_lock(&worker->alive);
    worker->building = NULL;
    pthread_mutex_unlock(&worker->alive);
    if (hand_over)
        task = atomic_exchange(&worker->shared->task, task); // that of the other thread, or NULL
    if (!task)
        return;
    REQUIRE(worker, !patina_task_take_cloud(task, &cloud) && patina_task_take_cloud(task, &none) == PATINA_ERROR_EMPTY);
    patina_task_destroy(task);
    REQUIRE(worker, !patina_cloud_analyse(cloud, &analysis, worker->progress));
    patina_cloud_destroy(cloud);
}

// Of a handle that both use, one call at a time.
static void take_turn(struct worker *worker)
{
    const patina_settings settings = {.struct_size = sizeof settings, .width = worker->width, .height = worker->height};
    pthread_mutex_lock(&worker->shared->turn);
    REQUIRE(worker, !patina_scene_set_settings(worker->shared->turns, &settings));
    pthread_mutex_unlock(&worker->shared->turn);
}

static void *work(void *data)
{
    struct worker *worker = data;
    patina_frame_stats stats = {.struct_size = sizeof stats};
    double box[2][3];
    for (int round = 0; round < ROUNDS; round++) {
        patina_scene *scene = scene_of(worker);
        patina_frame *frame = worker->frame;
        draw(worker, frame, scene);
        REQUIRE(worker,
                !memcmp(worker->pixels, worker->expected, (size_t)worker->width * worker->height * sizeof *worker->pixels));
        REQUIRE(worker, !patina_frame_get_stats(frame, &stats) && stats.width == worker->width && stats.points == POINTS);
        REQUIRE(worker, !patina_frame_check(frame, scene) && patina_frame_plan_text(frame, scene, NULL, 0) > 0);
        REQUIRE(worker, !patina_scene_extent(scene, box[0], box[1]) && box[0][0] < box[1][0]);
        look_at_messages(worker, frame);
        build(worker, round % 2);
        take_turn(worker);
        patina_scene_destroy(scene);
    }
    atomic_fetch_sub(&worker->shared->running, 1);
    return NULL;
}

// What is allowed at any time from any thread.
static void look(struct shared *shared, struct worker *workers)
{
    char text[512];
    int level;
    uint32_t looks = 0;
    while (atomic_load(&shared->running)) {
        for (int i = 0; i < 2; i++) {
            const float drawn = patina_frame_progress(workers[i].frame), built = patina_progress_value(workers[i].progress);
            shared->wrong += !(drawn >= 0.0f && drawn <= 1.0f && built >= 0.0f && built <= 1.0f);
            patina_message(workers[i].frame, text, sizeof text);
            patina_message(shared->device, text, sizeof text);
            pthread_mutex_lock(&workers[i].alive);
            if (workers[i].building)
                patina_task_done(workers[i].building);
            pthread_mutex_unlock(&workers[i].alive);
        }
        while (patina_log_next(text, sizeof text, &level))
            ;
        if (atomic_load(&shared->cancelling) && looks++ % 64 == 0)
            patina_frame_cancel(workers[looks / 64 % 2].frame);
    }
}

static void run(int cancelling)
{
    static struct worker workers[2];
    struct shared shared = {.turn = PTHREAD_MUTEX_INITIALIZER, .running = 2, .cancelling = cancelling};
    const patina_device_desc device = {.struct_size = sizeof device, .name = "cpu", .threads = 2};
    pthread_t threads[2];
    for (int i = 0; i < POINTS; i++)
        for (int k = 0; k < 3; k++)
            points[i][k] = (float)((i * (7 + 6 * k)) % 97) / 97.0f;
    const patina_cloud_desc desc = cloud_of(points);
    assert_int_equal(patina_device_create(&device, &shared.device), PATINA_OK);
    assert_int_equal(patina_cloud_create(&desc, NULL, &shared.cloud), PATINA_OK);
    assert_int_equal(patina_scene_create(&shared.turns), PATINA_OK);
    for (uint32_t i = 0; i < 2; i++) {
        struct worker *worker = &workers[i];
        patina_frame *frame = NULL;
        patina_progress *progress = NULL;
        *worker = (struct worker){
            .shared = &shared, .number = i, .width = i ? 64 : 96, .height = 64, .alive = PTHREAD_MUTEX_INITIALIZER};
        assert_int_equal(patina_frame_create(shared.device, &frame), PATINA_OK);
        assert_int_equal(patina_progress_create(&progress), PATINA_OK);
        worker->frame = frame;
        worker->progress = progress;
        patina_scene *scene = scene_of(worker);
        draw(worker, frame, scene);
        memcpy(worker->expected, worker->pixels, sizeof worker->expected);
        patina_scene_destroy(scene);
    }
    for (int i = 0; i < 2; i++)
        assert_int_equal(pthread_create(&threads[i], NULL, work, &workers[i]), 0);
    look(&shared, workers);
    for (int i = 0; i < 2; i++)
        pthread_join(threads[i], NULL);
    patina_task_destroy(shared.task);
    for (int i = 0; i < 2; i++) {
        patina_frame_destroy(workers[i].frame);
        patina_progress_destroy(workers[i].progress);
    }
    patina_scene_destroy(shared.turns);
    patina_cloud_destroy(shared.cloud);
    patina_device_destroy(shared.device);
    assert_int_equal(shared.wrong, 0);
    printf("  %u renders were cancelled and begun again\n", shared.cancelled);
    assert_true(cancelling || !shared.cancelled);
}

static void test_two_threads(void **state)
{
    (void)state;
    run(0);
}

static void test_two_threads_cancelled_by_a_third(void **state)
{
    (void)state;
    run(1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_two_threads),
        cmocka_unit_test(test_two_threads_cancelled_by_a_third),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
