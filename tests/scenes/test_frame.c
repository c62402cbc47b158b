// SPDX-License-Identifier: GPL-3.0-or-later
// A frame's life: statistics and plan as data, cancel, the last good picture, arguments that are refused (DESIGN 3, 7).
#include "staging.h"

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static double now(void)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static const struct staging *staging_named(const char *name)
{
    for (uint32_t i = 0; i < staging_count; i++)
        if (!strcmp(stagings[i].name, name))
            return &stagings[i];
    support_die("no scene '%s'", name);
}

static patina_frame *frame_of(patina_device *device, struct stage *stage)
{
    CHECK(patina_scene_set_camera(stage->scene, &stage->camera), stage->scene);
    CHECK(patina_scene_set_settings(stage->scene, &stage->settings), stage->scene);
    patina_frame *frame = NULL;
    CHECK(patina_frame_create(device, &frame), device);
    return frame;
}

static uint64_t plane_bytes_of(patina_frame *frame)
{
    patina_frame_stats stats = {.struct_size = sizeof stats};
    CHECK(patina_frame_get_stats(frame, &stats), frame);
    return stats.plane_bytes;
}

// What a frame keeps from view to view never shows: keys, where it left them empty, planes larger than this view's.
static void test_view_after_view(void **state)
{
    static const struct {
        double shift, zoom; // of the picture's height; a closer view has wider margins around the picture
    } views[] = {{0.0, 1.0}, {0.4, 1.0}, {-0.7, 1.0}, {5.0, 1.0}, {0.3, 1.0}, {0.2, 0.3}, {0.0, 0.1}, {0.1, 0.25}, {0.0, 1.0}};
    (void)state;
    for (uint32_t k = 0; k < support_device_count(); k++) {
        patina_device *device = support_device_open(support_device_name(k), 0, 0);
        if (!device)
            continue;
        struct stage stage = stage_build(staging_named("small, 1 point a pixel"));
        const patina_camera camera = stage.camera;
        const double height = camera.top - camera.bottom;
        patina_frame *kept = frame_of(device, &stage);
        uint32_t wider = 0;
        for (uint32_t i = 0; i < sizeof views / sizeof views[0]; i++) {
            stage.camera.left = camera.left * views[i].zoom;
            stage.camera.right = camera.right * views[i].zoom;
            stage.camera.bottom = camera.bottom * views[i].zoom + views[i].shift * height;
            stage.camera.top = camera.top * views[i].zoom + views[i].shift * height;
            patina_frame *fresh = frame_of(device, &stage);
            CHECK(patina_frame_render(kept, stage.scene), kept);
            CHECK(patina_frame_render(fresh, stage.scene), fresh);
            struct picture got = picture_read(kept), expected = picture_read(fresh);
            picture_assert_identical(&got, &expected, 0, 0, "after another view");
            picture_free(&got);
            picture_free(&expected);
            const uint64_t bytes = plane_bytes_of(kept), least = plane_bytes_of(fresh);
            assert_true(bytes >= least && (bytes <= 2 * least || views[i].shift == 5.0)); // there, no pass needs planes
            wider += bytes > least;
            patina_frame_destroy(fresh);
        }
        assert_true(wider > 0); // else nothing was kept
        patina_frame_destroy(kept);
        stage_free(&stage);
        patina_device_destroy(device);
    }
}

// ---- JSON --------------------------------------------------------------------------------------------------------

static const char *json_value(const char *at);

static const char *json_space(const char *at) { return at + strspn(at, " \t\r\n"); }

static const char *json_string(const char *at)
{
    if (*at++ != '"')
        support_die("JSON: no string at '%.20s'", at - 1);
    while (*at != '"') {
        if (!*at || (unsigned char)*at < 0x20)
            support_die("JSON: a string does not end");
        at += *at == '\\' ? 2 : 1;
    }
    return at + 1;
}

static const char *json_object(const char *at)
{
    at = json_space(at + 1);
    while (*at != '}') {
        at = json_space(json_string(at));
        if (*at != ':')
            support_die("JSON: no colon at '%.20s'", at);
        at = json_space(json_value(json_space(at + 1)));
        if (*at == ',')
            at = json_space(at + 1);
        else if (*at != '}')
            support_die("JSON: no comma at '%.20s'", at);
    }
    return at + 1;
}

static const char *json_array(const char *at)
{
    at = json_space(at + 1);
    while (*at != ']') {
        at = json_space(json_value(at));
        if (*at == ',')
            at = json_space(at + 1);
        else if (*at != ']')
            support_die("JSON: no comma at '%.20s'", at);
    }
    return at + 1;
}

static const char *json_value(const char *at)
{
    if (*at == '[')
        return json_array(at);
    if (*at == '{')
        return json_object(at);
    if (*at == '"')
        return json_string(at);
    char *end;
    strtod(at, &end);
    if (end == at)
        support_die("JSON: no value at '%.20s'", at);
    return end;
}

// Where the member's value starts in a flat search of {"outer":{"name":..}}; NULL when absent.
static const char *json_member(const char *json, const char *outer, const char *name)
{
    char quoted[64];
    snprintf(quoted, sizeof quoted, "\"%s\"", outer);
    const char *at = strstr(json, quoted);
    if (!at)
        return NULL;
    const char *start = strchr(at, '{'), *end = json_object(start);
    snprintf(quoted, sizeof quoted, "\"%s\"", name);
    at = strstr(start, quoted);
    return at && at < end ? json_space(strchr(at + strlen(quoted), ':') + 1) : NULL;
}

static char *stats_text(const patina_frame *frame)
{
    size_t length = patina_frame_stats_json(frame, NULL, 0);
    assert_true(length > 10);
    char *text = malloc(length + 1), small[8];
    assert_non_null(text);
    assert_int_equal(patina_frame_stats_json(frame, text, length + 1), length);
    assert_int_equal(strlen(text), length);
    assert_int_equal(patina_frame_stats_json(frame, small, sizeof small), length); // truncated, terminated
    assert_int_equal(strlen(small), sizeof small - 1);
    assert_memory_equal(small, text, sizeof small - 1);
    if (*json_space(json_object(text)))
        support_die("JSON: text after the object");
    return text;
}

static void assert_same_pass(const patina_frame *got, const patina_frame *expected, uint32_t pass, size_t size)
{
    float *a = malloc(size), *b = malloc(size);
    assert_true(a && b);
    CHECK(patina_frame_read(got, pass, a, size), got);
    CHECK(patina_frame_read(expected, pass, b, size), expected);
    assert_memory_equal(a, b, size);
    free(a);
    free(b);
}

// What else is asked for decides which passes a device runs as one, never what they give.
static void test_fewer_passes(void **state)
{
    static const uint32_t fewer[] = {0, 1u << PATINA_PASS_DEPTH, 1u << PATINA_PASS_DEPTH | 1u << PATINA_PASS_NORMAL};
    static const uint32_t passes[] = {PATINA_PASS_COMBINED, PATINA_PASS_DEPTH, PATINA_PASS_NORMAL};
    static const size_t channels[] = {4, 1, 3};
    (void)state;
    for (uint32_t k = 0; k < support_device_count(); k++) {
        patina_device *device = support_device_open(support_device_name(k), 0, 0);
        if (!device)
            continue;
        struct stage stage = stage_build(staging_named("small, 1 point a pixel"));
        stage.settings.passes = 1u << PATINA_PASS_DEPTH | 1u << PATINA_PASS_NORMAL | 1u << PATINA_PASS_SOURCE;
        const size_t pixels = (size_t)stage.settings.width * stage.settings.height;
        patina_frame *whole = frame_of(device, &stage);
        CHECK(patina_frame_render(whole, stage.scene), whole);
        for (uint32_t i = 0; i < sizeof fewer / sizeof fewer[0]; i++) {
            stage.settings.passes = fewer[i];
            patina_frame *frame = frame_of(device, &stage);
            CHECK(patina_frame_render(frame, stage.scene), frame);
            for (uint32_t p = 0; p < 3; p++)
                if (!p || fewer[i] >> passes[p] & 1u)
                    assert_same_pass(frame, whole, passes[p], channels[p] * pixels * sizeof(float));
            patina_frame_destroy(frame);
        }
        patina_frame_destroy(whole);
        stage_free(&stage);
        patina_device_destroy(device);
    }
}

// Each pixel's trust and thickness are those of the point whose number its key holds, times the instance's scale, and 0
// where that is a mesh or nothing. scales: of the instances.
static void check_known(const struct picture *picture, const patina_neighbourhoods *known, uint64_t points, const float *scales,
                        uint32_t instances)
{
    uint64_t sure = 0, thick = 0;
    for (size_t i = 0; i < (size_t)picture->width * picture->height; i++) {
        const uint64_t id = picture->keys[i] == KEY_EMPTY ? UINT64_MAX : key_id(picture->keys[i]);
        const int shown = id < instances * points;
        const float trust = shown ? known->trust[id % points] : 0.0f;
        const float sigma = shown ? known->sigma[id % points] * scales[id / points] : 0.0f;
        assert_float_equal(picture->trust[i], trust, 1e-6f);
        assert_float_equal(picture->thickness[i], sigma, 1e-6f * sigma);
        sure += trust > 0.5f;
        thick += sigma > 0.0f;
    }
    assert_true(sure > 1000 && thick > 1000);
}

static void test_trust_and_thickness(void **state)
{
    static const char *const scenes[] = {"footprints, density 0.1 to 30", "footprints among meshes",
                                         "footprints without normals, orthographic"};
    const float scales[] = {1.0f, 0.6f, sqrtf(1.22f), 0.5f, 0.0f, 1.0f}; // of longest axes, see staging.c
    (void)state;
    for (uint32_t k = 0; k < support_device_count(); k++) {
        patina_device *device = support_device_open(support_device_name(k), 0, 0);
        if (!device)
            continue;
        for (uint32_t s = 0; s < sizeof scenes / sizeof scenes[0]; s++) {
            struct stage stage = stage_build(staging_named(scenes[s]));
            patina_cloud_info info = {.struct_size = sizeof info};
            CHECK(patina_cloud_get_info(stage.cloud, &info), stage.cloud);
            patina_neighbourhoods known = {.struct_size = sizeof known};
            known.trust = calloc(info.count, sizeof *known.trust);
            known.sigma = calloc(info.count, sizeof *known.sigma);
            assert_true(known.trust && known.sigma);
            CHECK(patina_cloud_neighbourhoods(stage.cloud, &known, NULL), stage.cloud);
            for (uint32_t strata = 0; strata < 5; strata += 4) { // what is left out changes what is drawn, not how thick it is
                stage.settings.strata = strata;
                struct picture picture = picture_render(device, stage.scene, &stage.camera, &stage.settings);
                check_known(&picture, &known, info.count, scales, s == 2 ? 6 : 1);
                picture_free(&picture);
            }
            free(known.trust);
            free(known.sigma);
            stage_free(&stage);
        }
        struct stage plain = stage_build(staging_named("small, 1 point a pixel")); // nothing is known of its points
        struct picture picture = picture_render(device, plain.scene, &plain.camera, &plain.settings);
        for (size_t i = 0; i < (size_t)picture.width * picture.height; i++)
            assert_true(picture.trust[i] == 0.0f && picture.thickness[i] == 0.0f);
        picture_free(&picture);
        stage_free(&plain);
        patina_device_destroy(device);
    }
}

// Every pass is either timed or left out with a reason.
static void test_statistics(void **state)
{
    (void)state;
    for (uint32_t k = 0; k < support_device_count(); k++) {
        patina_device *device = support_device_open(support_device_name(k), 0, 0);
        if (!device)
            continue;
        struct stage stage = stage_build(staging_named("small, 1 point a pixel"));
        patina_frame *frame = frame_of(device, &stage);
        CHECK(patina_frame_render(frame, stage.scene), frame);
        char *full = stats_text(frame);
        patina_frame_stats stats = {.struct_size = sizeof stats};
        CHECK(patina_frame_get_stats(frame, &stats), frame);
        assert_true(stats.ms > 0.0 && stats.plane_bytes > 0);
        assert_int_equal(stats.points, 1800);
        assert_true(stats.points_scattered <= stats.points && stats.chunks_culled <= stats.chunks);
        static const char *const always[] = {"scatter", "resolve", "fill", "shade", "smooth", "antialias"};
        const char *together = json_member(full, "passes", "tail"); // the passes from shading on, where they run as one
        double sum = together ? strtod(together, NULL) : 0.0;
        for (uint32_t i = 0; i < (together ? 3 : sizeof always / sizeof always[0]); i++) {
            const char *value = json_member(full, "passes", always[i]);
            if (!value)
                support_die("pass '%s' is not in %s", always[i], full);
            double ms = strtod(value, NULL);
            assert_true(ms >= 0.0 && ms < 1e5);
            sum += ms;
        }
        assert_true(sum <= stats.ms * 1.01 + 0.1);
        assert_true(json_member(full, "skipped", "normals") != NULL); // the cloud has normals
        assert_true(json_member(full, "skipped", "peel") != NULL);    // everything is opaque
        assert_true(strstr(full, "\"layers\":[{\"points\":1800,\"pixels\":0}]") != NULL && stats.layers == 1);
        free(full);

        stage.settings.fill = PATINA_FILL_OFF;
        stage.settings.smooth = PATINA_SMOOTH_OFF;
        stage.settings.antialias = PATINA_ANTIALIAS_OFF;
        CHECK(patina_scene_set_settings(stage.scene, &stage.settings), stage.scene);
        CHECK(patina_frame_render(frame, stage.scene), frame);
        char *bare = stats_text(frame);
        if (k == 0)
            printf("  %s\n", bare);
        static const char *const off[] = {"fill", "smooth", "antialias"};
        for (uint32_t i = 0; i < sizeof off / sizeof off[0]; i++) {
            assert_true(json_member(bare, "passes", off[i]) == NULL);
            const char *reason = json_member(bare, "skipped", off[i]);
            if (!reason || *reason != '"' || reason[1] == '"')
                support_die("no reason why '%s' is left out: %s", off[i], bare);
        }
        free(bare);
        patina_frame_destroy(frame);
        stage_free(&stage);
        patina_device_destroy(device);
    }
}

static void test_plan(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    struct stage stage = stage_build(staging_named("small, 1 point a pixel"));
    patina_frame *frame = frame_of(device, &stage);
    char text[4096], small[16];
    size_t length = patina_frame_plan_text(frame, stage.scene, text, sizeof text);
    assert_true(length > 50 && length < sizeof text);
    assert_true(strstr(text, "scatter") && strstr(text, "fill"));
    assert_int_equal(patina_frame_plan_text(frame, stage.scene, small, sizeof small), length);
    assert_memory_equal(small, text, sizeof small - 1);
    printf("%s", text);
    uint64_t key;
    assert_int_equal(patina_frame_read_keys(frame, &key, sizeof key), PATINA_ERROR_EMPTY); // a plan renders nothing
    patina_frame_destroy(frame);
    stage_free(&stage);
    patina_device_destroy(device);
}

// ---- numbers of points ---------------------------------------------------------------------------------------------

enum { NUMBERED = 5000, GRID = 64 };

// A cloud whose point i lies in the pixel i of a grid, row by row, given in a shuffled order; every seventh is no point.
static patina_cloud *numbered_cloud(uint32_t *given, uint64_t seed)
{
    struct points points = points_create(NUMBERED, POINTS_PLAIN);
    struct pcg random = pcg_seed(seed);
    for (uint32_t i = 0; i < NUMBERED; i++) {
        const uint32_t j = pcg_u32(&random) % (i + 1);
        given[i] = given[j];
        given[j] = i;
    }
    for (uint32_t i = 0; i < NUMBERED; i++) { // points beyond the grid's 4096 pixels are out of view
        points.position[3 * i] = given[i] % 7 == 3 ? NAN : (float)(given[i] % GRID) + 0.5f;
        points.position[3 * i + 1] = (float)(given[i] / GRID) + 0.5f;
    }
    patina_cloud *cloud = points_upload(&points);
    points_free(&points);
    return cloud;
}

// Keys name points as their callers count them, through every instance, whatever order the library keeps them in.
static void test_callers_numbers(void **state)
{
    (void)state;
    static uint32_t given[2][NUMBERED];
    const double eye[3] = {GRID, 0.5 * GRID, 5.0}, target[3] = {GRID, 0.5 * GRID, 0.0};
    const double beside[16] = {1, 0, 0, GRID, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    patina_camera camera = camera_orthographic(eye, target, GRID, 2 * GRID, GRID, 0.1, 10.0);
    patina_settings settings = settings_default(2 * GRID, GRID);
    settings.fill = PATINA_FILL_OFF;
    for (uint32_t k = 0; k < support_device_count(); k++) {
        patina_device *device = support_device_open(support_device_name(k), 0, 0);
        if (!device)
            continue;
        patina_cloud *clouds[2] = {numbered_cloud(given[0], 1), numbered_cloud(given[1], 2)};
        patina_scene *scene = scene_of(clouds[0], NULL);
        patina_cloud_style style = {.struct_size = sizeof style};
        memcpy(style.world_from_object, beside, sizeof beside);
        CHECK(patina_scene_add_cloud(scene, clouds[1], &style), scene);
        struct picture picture = picture_render(device, scene, &camera, &settings);
        uint64_t seen = 0;
        for (uint32_t i = 0; i < 2 * GRID * GRID; i++) {
            if (picture.keys[i] == KEY_EMPTY)
                continue;
            const uint32_t x = i % (2 * GRID), y = i / (2 * GRID), id = key_id(picture.keys[i]), second = x >= GRID;
            assert_in_range(id, second * NUMBERED, second * NUMBERED + NUMBERED - 1);
            assert_int_equal(given[second][id % NUMBERED], y * GRID + x % GRID);
            seen++;
        }
        assert_in_range(seen, 2 * GRID * GRID * 5 / 7, 2 * GRID * GRID);
        picture_free(&picture);

        patina_frame *frame = NULL;
        CHECK(patina_frame_create(device, &frame), device);
        CHECK(patina_frame_render(frame, scene), frame);
        patina_scene_destroy(scene);
        patina_cloud_destroy(clouds[0]);
        uint64_t *keys = malloc(2 * GRID * GRID * sizeof *keys);
        assert_non_null(keys);
        assert_int_equal(patina_frame_read_keys(frame, keys, 2 * GRID * GRID * sizeof *keys), PATINA_ERROR_EMPTY);
        assert_non_null(strstr(support_message(frame), "destroyed"));
        free(keys);
        patina_frame_destroy(frame);
        patina_cloud_destroy(clouds[1]);
        patina_device_destroy(device);
    }
}

// ---- cancel and failure --------------------------------------------------------------------------------------------

static void test_cancel_keeps_the_picture(void **state)
{
    (void)state;
    for (uint32_t k = 0; k < support_device_count(); k++) {
        patina_device *device = support_device_open(support_device_name(k), 0, 0);
        if (!device)
            continue;
        struct stage stage = stage_build(staging_named("small, 30 points a pixel"));
        patina_frame *frame = frame_of(device, &stage);
        CHECK(patina_frame_render(frame, stage.scene), frame);
        struct picture before = picture_read(frame);

        stage.settings.width = 101; // another size, so that a half-made picture would show
        CHECK(patina_scene_set_settings(stage.scene, &stage.settings), stage.scene);
        patina_frame_cancel(frame);
        assert_int_equal(patina_frame_render(frame, stage.scene), PATINA_ERROR_CANCELLED);
        assert_true(strlen(support_message(frame)) > 3);
        struct picture after = picture_read_passes(frame);
        assert_int_equal(after.width, before.width);
        picture_assert_identical(&after, &before, 0, 0, "after a cancelled render");
        // Keys are a render's own working plane: gone with it, or still the old picture's; never half-made ones.
        uint64_t *keys = malloc((size_t)before.width * before.height * sizeof *keys);
        assert_non_null(keys);
        int code = patina_frame_read_keys(frame, keys, (size_t)before.width * before.height * sizeof *keys);
        assert_true(code == PATINA_ERROR_EMPTY ||
                    (code == PATINA_OK && !memcmp(keys, before.keys, (size_t)before.width * before.height * sizeof *keys)));
        free(keys);

        CHECK(patina_frame_render(frame, stage.scene), frame); // the cancel is spent
        struct picture next = picture_read(frame);
        assert_int_equal(next.width, 101);
        assert_true(patina_frame_progress(frame) >= 0.0f && patina_frame_progress(frame) <= 1.0f);
        picture_free(&before);
        picture_free(&after);
        picture_free(&next);
        patina_frame_destroy(frame);
        stage_free(&stage);
        patina_device_destroy(device);
    }
}

struct watcher {
    patina_frame *frame;
    double delay, cancelled_at;
};

static void *cancel_later(void *data)
{
    struct watcher *watcher = data;
    double start = now();
    while (now() - start < watcher->delay)
        if (patina_frame_progress(watcher->frame) > 1.0f)
            return NULL;
    watcher->cancelled_at = now();
    patina_frame_cancel(watcher->frame);
    return NULL;
}

// Cancelled from another thread at many moments: either cancelled soon, or finished; never a broken frame.
static void test_cancel_while_running(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    struct stage stage = stage_build(staging_named("large"));
    patina_frame *frame = frame_of(device, &stage);
    CHECK(patina_frame_render(frame, stage.scene), frame);
    struct picture truth = picture_read(frame);
    double start = now();
    CHECK(patina_frame_render(frame, stage.scene), frame);
    double whole = now() - start, latest = 0.0;
    uint32_t cancelled = 0;
    for (int i = 0; i < 40; i++) {
        struct watcher watcher = {.frame = frame, .delay = whole * i / 40.0};
        pthread_t thread;
        assert_int_equal(pthread_create(&thread, NULL, cancel_later, &watcher), 0);
        int code = patina_frame_render(frame, stage.scene);
        double end = now();
        pthread_join(thread, NULL);
        assert_true(code == PATINA_OK || code == PATINA_ERROR_CANCELLED);
        if (code == PATINA_ERROR_CANCELLED) {
            cancelled++;
            if (end - watcher.cancelled_at > latest)
                latest = end - watcher.cancelled_at;
        }
        struct picture picture = picture_read_passes(frame);
        picture_assert_identical(&picture, &truth, 0, 0, "after a cancel from another thread");
        picture_free(&picture);
        // A cancel that came after the end is for the next render: spend it.
        int rest = patina_frame_render(frame, stage.scene);
        assert_true(rest == PATINA_OK || rest == PATINA_ERROR_CANCELLED);
    }
    printf("  %.1f ms a frame; %u of 40 cancelled, at most %.1f ms late\n", 1e3 * whole, cancelled, 1e3 * latest);
    assert_true(cancelled > 0);
    picture_free(&truth);
    patina_frame_destroy(frame);
    stage_free(&stage);
    patina_device_destroy(device);
}

// A cap on memory refuses what does not fit and says so; what fits is the same picture.
static void test_memory_cap(void **state)
{
    (void)state;
    struct stage stage = stage_build(staging_named("orthographic, refined"));
    uint64_t needed = 0;
    struct picture truth = {0};
    for (int capped = 0; capped < 3; capped++) {
        patina_device_desc desc = {.struct_size = sizeof desc, .name = "cpu"};
        desc.memory_cap = capped == 0 ? 0 : capped == 1 ? needed : needed / 2;
        patina_device *device = NULL;
        CHECK(patina_device_create(&desc, &device), NULL);
        patina_frame *frame = frame_of(device, &stage);
        int code = patina_frame_render(frame, stage.scene);
        if (capped == 2) {
            assert_int_equal(code, PATINA_ERROR_TOO_LARGE);
            printf("  message: %s\n", support_message(frame));
        } else {
            CHECK(code, frame);
            struct picture picture = picture_read(frame);
            if (capped) {
                picture_assert_identical(&picture, &truth, 0, 0, "under a memory cap");
                picture_free(&picture);
            } else {
                truth = picture;
            }
            needed = plane_bytes_of(frame);
        }
        patina_frame_destroy(frame);
        patina_device_destroy(device);
    }
    picture_free(&truth);
    stage_free(&stage);
}

static void test_refused_arguments(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    struct stage stage = stage_build(staging_named("small, 1 point a pixel"));
    patina_frame *frame = frame_of(device, &stage);
    float pixels[64];
    assert_int_equal(patina_frame_read(frame, PATINA_PASS_DEPTH, pixels, sizeof pixels), PATINA_ERROR_EMPTY);
    CHECK(patina_frame_render(frame, stage.scene), frame);
    assert_int_equal(patina_frame_read(frame, PATINA_PASS_DEPTH, pixels, sizeof pixels), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_frame_read(frame, PATINA_PASS_COUNT, pixels, sizeof pixels), PATINA_ERROR_ARGUMENT);

    // Whatever is refused leaves the scene as it was, at setting or at rendering.
    patina_settings wrong[8];
    for (int i = 0; i < 8; i++)
        wrong[i] = stage.settings;
    wrong[0].region[2] = 68; // beyond the picture
    wrong[0].region[3] = 45;
    wrong[1].region[0] = wrong[1].region[2] = 5; // no area
    wrong[1].region[3] = 45;
    wrong[2].fill = 77;
    wrong[3].quality = 77;
    wrong[4].smooth = 77;
    wrong[5].antialias = 77;
    wrong[6].layers = PATINA_MAX_LAYERS + 1;
    wrong[7].layer_passes = 1u << PATINA_PASS_SOURCE;
    for (int i = 0; i < 8; i++) {
        int code = patina_scene_set_settings(stage.scene, &wrong[i]);
        if (code == PATINA_OK)
            code = patina_frame_render(frame, stage.scene);
        if (code != PATINA_ERROR_ARGUMENT)
            support_die("wrong settings %d gave %d", i, code);
        CHECK(patina_scene_set_settings(stage.scene, &stage.settings), stage.scene);
        CHECK(patina_frame_render(frame, stage.scene), frame);
    }
    patina_camera cameras[4];
    for (int i = 0; i < 4; i++)
        cameras[i] = stage.camera;
    cameras[0].left = cameras[0].right; // no window
    cameras[1].far_clip = 0.5 * cameras[1].near_clip;
    cameras[2].near_clip = 0.0; // perspective needs a distance
    for (int k = 0; k < 16; k++)
        cameras[3].world_from_camera[k] = 0.0; // no direction
    cameras[3].world_from_camera[15] = 1.0;
    for (int i = 0; i < 4; i++) {
        int code = patina_scene_set_camera(stage.scene, &cameras[i]);
        if (code == PATINA_OK)
            code = patina_frame_render(frame, stage.scene);
        if (code != PATINA_ERROR_ARGUMENT)
            support_die("wrong camera %d gave %d", i, code);
        CHECK(patina_scene_set_camera(stage.scene, &stage.camera), stage.scene);
        CHECK(patina_frame_render(frame, stage.scene), frame);
    }
    patina_frame_destroy(frame);
    stage_free(&stage);
    patina_device_destroy(device);
}

// Layers can be read that were asked for; those that do not exist are empty.
static void test_reading_layers(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    struct stage stage = stage_build(staging_named("small, 1 point a pixel"));
    enum { PIXELS = 67 * 45 };
    static float depth[PIXELS], color[4 * PIXELS];
    patina_frame *frame = frame_of(device, &stage);
    assert_int_equal(patina_frame_read_layer(frame, 1, PATINA_PASS_DEPTH, depth, sizeof depth), PATINA_ERROR_EMPTY);
    CHECK(patina_frame_render(frame, stage.scene), frame);
    assert_int_equal(patina_frame_read_layer(frame, 1, PATINA_PASS_DEPTH, depth, sizeof depth), PATINA_ERROR_EMPTY);
    stage.settings.layer_passes = 1u << PATINA_PASS_DEPTH;
    CHECK(patina_scene_set_settings(stage.scene, &stage.settings), stage.scene);
    CHECK(patina_frame_render(frame, stage.scene), frame);
    patina_frame_stats stats = {.struct_size = sizeof stats};
    CHECK(patina_frame_get_stats(frame, &stats), frame);
    assert_in_range(stats.layers, 1, 4); // culled: the tube's near halves
    uint32_t covered[9] = {0};
    for (uint32_t layer = 1; layer <= 8; layer++) {
        CHECK(patina_frame_read_layer(frame, layer, PATINA_PASS_DEPTH, depth, sizeof depth), frame);
        for (int i = 0; i < PIXELS; i++)
            covered[layer] += isfinite(depth[i]);
        assert_true((covered[layer] > 0) == (layer <= stats.layers));
    }
    assert_int_equal(patina_frame_read_layer(frame, 1, PATINA_PASS_COMBINED, color, sizeof color), PATINA_ERROR_EMPTY);
    assert_int_equal(patina_frame_read_layer(frame, 9, PATINA_PASS_DEPTH, depth, sizeof depth), PATINA_ERROR_EMPTY);
    assert_int_equal(patina_frame_read_layer(frame, 0, PATINA_PASS_DEPTH, depth, sizeof depth), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_frame_read_layer(frame, 17, PATINA_PASS_DEPTH, depth, sizeof depth), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_frame_read_layer(frame, 1, PATINA_PASS_SOURCE, depth, sizeof depth), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_frame_read_layer(frame, 1, PATINA_PASS_DEPTH, depth, sizeof depth - 4), PATINA_ERROR_ARGUMENT);
    patina_frame_destroy(frame);
    stage_free(&stage);
    patina_device_destroy(device);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_view_after_view),
        cmocka_unit_test(test_fewer_passes),
        cmocka_unit_test(test_trust_and_thickness),
        cmocka_unit_test(test_statistics),
        cmocka_unit_test(test_plan),
        cmocka_unit_test(test_callers_numbers),
        cmocka_unit_test(test_cancel_keeps_the_picture),
        cmocka_unit_test(test_cancel_while_running),
        cmocka_unit_test(test_memory_cap),
        cmocka_unit_test(test_refused_arguments),
        cmocka_unit_test(test_reading_layers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
