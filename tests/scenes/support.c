// SPDX-License-Identifier: GPL-3.0-or-later
#include "support.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#if defined(__aarch64__)
static const char *const all_devices[] = {"cpu", "cpu-scalar", "cpu-neon", "gl-egl", "gl-osmesa"};
#elif defined(_WIN32)
static const char *const all_devices[] = {"cpu", "cpu-scalar", "cpu-sse42", "cpu-avx2", "cpu-avx512", "gl-wgl"};
#else
static const char *const all_devices[] = {"cpu", "cpu-scalar", "cpu-sse42", "cpu-avx2", "cpu-avx512", "gl-egl", "gl-osmesa"};
#endif
enum { ALL_DEVICES = sizeof all_devices / sizeof all_devices[0], MAX_DEVICES = 16 };

static const char *chosen[MAX_DEVICES];
static uint32_t chosen_count;
static int quick;

void support_die(const char *format, ...)
{
    char text[1024];
    va_list list;
    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    fail_msg("%s", text);
    abort(); // not reached: fail_msg leaves the test
}

const char *support_message(const void *handle)
{
    static char text[512];
    if (!patina_message(handle, text, sizeof text))
        snprintf(text, sizeof text, "(no message)");
    return text;
}

void support_check(int code, const void *handle, const char *file, int line)
{
    if (code != PATINA_OK)
        support_die("%s:%d: %s: %s", file, line, patina_error_text(code), support_message(handle));
}

// ---- devices ---------------------------------------------------------------------------------------------------

void support_arguments(int argc, char **argv)
{
    chosen_count = 0;
    for (int i = 1; i < argc; i++) {
        if (!strcmp(argv[i], "--quick")) {
            quick = 1;
            continue;
        }
        if (strcmp(argv[i], "--device") || i + 1 == argc) {
            fprintf(stderr, "usage: %s [--quick] [--device NAME|all]...\n", argv[0]);
            exit(2);
        }
        const char *name = argv[++i];
        if (!strcmp(name, "all")) {
            chosen_count = 0;
            break;
        }
        if (chosen_count < MAX_DEVICES)
            chosen[chosen_count++] = name;
    }
    if (!chosen_count) {
        memcpy(chosen, all_devices, sizeof all_devices);
        chosen_count = ALL_DEVICES;
    }
}

int support_is_quick(const char *left_out)
{
    if (quick)
        print_message("skipped: --quick leaves out %s\n0 passed, 0 failed, 1 skipped\n", left_out);
    return quick;
}

uint32_t support_device_count(void) { return chosen_count; }
const char *support_device_name(uint32_t i) { return chosen[i]; }
int support_is_gl(const char *name) { return !strncmp(name, "gl", 2); }

double support_processor_seconds(void)
{
    struct timespec time;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

double support_cancel(support_start *start, void *context)
{
    int code = PATINA_OK;
    double late = 0.0;
    for (int again = 0; again < 20 && code == PATINA_OK; again++) { // a busy machine may wake this thread too late
        patina_progress *progress = NULL;
        patina_task *task = NULL;
        CHECK(patina_progress_create(&progress), NULL);
        CHECK(start(context, progress, &task), NULL);
        while (!patina_task_done(task) && !(patina_progress_value(progress) > 0.02f))
            usleep(500);
        const double begin = support_processor_seconds();
        patina_progress_cancel(progress);
        code = patina_task_wait(task);
        late = support_processor_seconds() - begin;
        patina_task_destroy(task);
        patina_progress_destroy(progress);
    }
    assert_int_equal(code, PATINA_ERROR_CANCELLED);
    return late;
}

patina_device *support_device_open(const char *name, uint32_t threads, uint32_t batch)
{
    patina_device_desc desc = {.struct_size = sizeof desc, .name = name, .threads = threads, .batch = batch};
    patina_device *device = NULL;
    int code = patina_device_create(&desc, &device);
    if (code == PATINA_OK)
        return device;
    if (code != PATINA_ERROR_UNSUPPORTED)
        support_die("device %s: %s: %s", name, patina_error_text(code), support_message(NULL));
    print_message("skip %s: %s\n", name, support_message(NULL));
    return NULL;
}

void support_each_device(void (*work)(patina_device *device, const char *name))
{
    for (uint32_t k = 0; k < support_device_count(); k++) {
        patina_device *device = support_device_open(support_device_name(k), 0, 0);
        if (device)
            work(device, support_device_name(k));
        patina_device_destroy(device);
    }
}

patina_device *support_device_first(void)
{
    patina_device *device = support_device_open(chosen[0], 0, 0);
    if (!device)
        skip();
    return device;
}

// ---- cameras ---------------------------------------------------------------------------------------------------

static void normalise(double v[3])
{
    double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int k = 0; k < 3; k++)
        v[k] /= length;
}

static void cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static patina_camera look(const double eye[3], const double target[3], double half_height, uint32_t width, uint32_t height,
                          double near_clip, double far_clip)
{
    double back[3] = {eye[0] - target[0], eye[1] - target[1], eye[2] - target[2]}, right[3], up[3];
    normalise(back);
    const double z_up[3] = {0.0, 0.0, 1.0}, y_up[3] = {0.0, 1.0, 0.0};
    cross(fabs(back[2]) > 0.9999 ? y_up : z_up, back, right);
    normalise(right);
    cross(back, right, up);
    patina_camera camera = {.struct_size = sizeof camera, .near_clip = near_clip, .far_clip = far_clip};
    for (int k = 0; k < 3; k++) {
        double *row = camera.world_from_camera + 4 * k;
        row[0] = right[k];
        row[1] = up[k];
        row[2] = back[k];
        row[3] = eye[k];
    }
    camera.world_from_camera[15] = 1.0;
    double half_width = half_height * width / height;
    camera.left = -half_width;
    camera.right = half_width;
    camera.bottom = -half_height;
    camera.top = half_height;
    return camera;
}

patina_camera camera_perspective(const double eye[3], const double target[3], double fov_degrees, uint32_t width,
                                 uint32_t height, double near_clip, double far_clip)
{
    return look(eye, target, tan(fov_degrees * M_PI / 360.0), width, height, near_clip, far_clip);
}

patina_camera camera_orthographic(const double eye[3], const double target[3], double window_height, uint32_t width,
                                  uint32_t height, double near_clip, double far_clip)
{
    patina_camera camera = look(eye, target, 0.5 * window_height, width, height, near_clip, far_clip);
    camera.orthographic = 1;
    return camera;
}

void camera_project(const patina_camera *camera, uint32_t width, uint32_t height, const double world[3], double *x, double *y,
                    double *z)
{
    const double *m = camera->world_from_camera;
    double d[3] = {world[0] - m[3], world[1] - m[7], world[2] - m[11]}, v[3];
    for (int k = 0; k < 3; k++)
        v[k] = m[k] * d[0] + m[4 + k] * d[1] + m[8 + k] * d[2];
    double scale = camera->orthographic ? 1.0 : 1.0 / -v[2];
    *x = (v[0] * scale - camera->left) / (camera->right - camera->left) * width;
    *y = (v[1] * scale - camera->bottom) / (camera->top - camera->bottom) * height;
    *z = camera->orthographic ? -v[2] - camera->near_clip : -v[2];
}

void camera_ray(const patina_camera *camera, uint32_t width, uint32_t height, double x, double y, double origin[3],
                double direction[3])
{
    const double *m = camera->world_from_camera;
    double u = camera->left + (camera->right - camera->left) * x / width;
    double v = camera->bottom + (camera->top - camera->bottom) * y / height;
    for (int k = 0; k < 3; k++) {
        const double *row = m + 4 * k;
        if (camera->orthographic) {
            origin[k] = row[3] + row[0] * u + row[1] * v - row[2] * camera->near_clip;
            direction[k] = -row[2];
        } else {
            origin[k] = row[3];
            direction[k] = row[0] * u + row[1] * v - row[2];
        }
    }
}

// ---- pictures --------------------------------------------------------------------------------------------------

float key_z(uint64_t key)
{
    uint32_t bits = (uint32_t)(key >> 32);
    float z;
    memcpy(&z, &bits, sizeof z);
    return z;
}

uint32_t key_id(uint64_t key) { return (uint32_t)key; }

patina_settings settings_default(uint32_t width, uint32_t height)
{
    return (patina_settings){.struct_size = sizeof(patina_settings), .width = width, .height = height};
}

static float *read_pass(const patina_frame *frame, uint32_t pass, uint64_t pixels, uint32_t channels)
{
    size_t size = pixels * channels * sizeof(float);
    float *values = malloc(size);
    if (!values)
        support_die("out of memory");
    CHECK(patina_frame_read(frame, pass, values, size), frame);
    return values;
}

struct picture picture_read_passes(const patina_frame *frame)
{
    patina_frame_stats stats = {.struct_size = sizeof stats};
    CHECK(patina_frame_get_stats(frame, &stats), frame);
    struct picture picture = {.width = stats.width, .height = stats.height};
    uint64_t pixels = (uint64_t)stats.width * stats.height;
    assert_true(pixels > 0);
    picture.combined = read_pass(frame, PATINA_PASS_COMBINED, pixels, 4);
    picture.depth = read_pass(frame, PATINA_PASS_DEPTH, pixels, 1);
    picture.normal = read_pass(frame, PATINA_PASS_NORMAL, pixels, 3);
    picture.source = read_pass(frame, PATINA_PASS_SOURCE, pixels, 1);
    picture.trust = read_pass(frame, PATINA_PASS_TRUST, pixels, 1);
    picture.thickness = read_pass(frame, PATINA_PASS_THICKNESS, pixels, 1);
    picture.density = read_pass(frame, PATINA_PASS_DENSITY, pixels, 1);
    return picture;
}

struct picture picture_read(const patina_frame *frame)
{
    struct picture picture = picture_read_passes(frame);
    size_t size = (size_t)picture.width * picture.height * sizeof *picture.keys;
    picture.keys = malloc(size);
    if (!picture.keys)
        support_die("out of memory");
    CHECK(patina_frame_read_keys(frame, picture.keys, size), frame);
    return picture;
}

void picture_read_layers(struct picture *picture, const patina_frame *frame, const patina_settings *settings)
{
    if (!settings->layer_passes)
        return;
    size_t pixels = (size_t)picture->width * picture->height;
    picture->layers = settings->layers ? settings->layers : 8;
    picture->layer_combined = malloc(picture->layers * pixels * 16);
    picture->layer_depth = malloc(picture->layers * pixels * 4);
    picture->layer_normal = malloc(picture->layers * pixels * 12);
    if (!picture->layer_combined || !picture->layer_depth || !picture->layer_normal)
        support_die("out of memory");
    for (uint32_t k = 0; k < picture->layers; k++) {
        CHECK(
            patina_frame_read_layer(frame, k + 1, PATINA_PASS_COMBINED, picture->layer_combined + 4 * k * pixels, pixels * 16),
            frame);
        CHECK(patina_frame_read_layer(frame, k + 1, PATINA_PASS_DEPTH, picture->layer_depth + k * pixels, pixels * 4), frame);
        CHECK(patina_frame_read_layer(frame, k + 1, PATINA_PASS_NORMAL, picture->layer_normal + 3 * k * pixels, pixels * 12),
              frame);
    }
}

struct picture picture_render(patina_device *device, patina_scene *scene, const patina_camera *camera,
                              const patina_settings *settings)
{
    CHECK(patina_scene_set_camera(scene, camera), scene);
    CHECK(patina_scene_set_settings(scene, settings), scene);
    patina_frame *frame = NULL;
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_frame_render(frame, scene), frame);
    struct picture picture = picture_read(frame);
    picture_read_layers(&picture, frame, settings);
    patina_frame_destroy(frame);
    return picture;
}

void picture_free(struct picture *picture)
{
    free(picture->keys);
    free(picture->combined);
    free(picture->depth);
    free(picture->normal);
    free(picture->source);
    free(picture->trust);
    free(picture->thickness);
    free(picture->density);
    free(picture->layer_combined);
    free(picture->layer_depth);
    free(picture->layer_normal);
    *picture = (struct picture){0};
}

uint64_t picture_count(const struct picture *picture)
{
    uint64_t count = 0;
    for (uint64_t i = 0; i < (uint64_t)picture->width * picture->height; i++)
        count += picture->keys[i] != KEY_EMPTY;
    return count;
}

static void assert_same_bytes(const void *part, const void *whole, size_t pixel_size, const struct picture *crop,
                              const struct picture *full, uint32_t x0, uint32_t y0, const char *pass, const char *what)
{
    for (uint32_t y = 0; y < crop->height; y++) {
        const unsigned char *a = (const unsigned char *)part + (size_t)y * crop->width * pixel_size;
        const unsigned char *b = (const unsigned char *)whole + ((size_t)(y + y0) * full->width + x0) * pixel_size;
        if (!memcmp(a, b, crop->width * pixel_size))
            continue;
        uint32_t x = 0;
        while (!memcmp(a + x * pixel_size, b + x * pixel_size, pixel_size))
            x++;
        size_t at = (size_t)y * crop->width + x, from = (size_t)(y + y0) * full->width + x0 + x;
        support_die("%s: %s differs at (%u, %u) of %ux%u: source %g against %g, depth %.9g against %.9g, ids %u and %u", what,
                    pass, x, y, crop->width, crop->height, (double)crop->source[at], (double)full->source[from],
                    (double)crop->depth[at], (double)full->depth[from], crop->keys ? key_id(crop->keys[at]) : 0,
                    full->keys ? key_id(full->keys[from]) : 0);
    }
}

void picture_assert_identical(const struct picture *part, const struct picture *whole, uint32_t x, uint32_t y, const char *what)
{
    assert_true(x + part->width <= whole->width && y + part->height <= whole->height);
    if (part->keys && whole->keys)
        assert_same_bytes(part->keys, whole->keys, 8, part, whole, x, y, "keys", what);
    assert_same_bytes(part->depth, whole->depth, 4, part, whole, x, y, "depth", what);
    assert_same_bytes(part->source, whole->source, 4, part, whole, x, y, "source", what);
    assert_same_bytes(part->trust, whole->trust, 4, part, whole, x, y, "trust", what);
    assert_same_bytes(part->thickness, whole->thickness, 4, part, whole, x, y, "thickness", what);
    assert_same_bytes(part->density, whole->density, 4, part, whole, x, y, "density", what);
    assert_same_bytes(part->normal, whole->normal, 12, part, whole, x, y, "normal", what);
    assert_same_bytes(part->combined, whole->combined, 16, part, whole, x, y, "combined", what);
    assert_int_equal(part->layers, whole->layers);
    for (uint32_t k = 0; k < part->layers; k++) {
        size_t p = (size_t)k * part->width * part->height, w = (size_t)k * whole->width * whole->height;
        assert_same_bytes(part->layer_depth + p, whole->layer_depth + w, 4, part, whole, x, y, "a layer's depth", what);
        assert_same_bytes(part->layer_normal + 3 * p, whole->layer_normal + 3 * w, 12, part, whole, x, y, "a layer's normal",
                          what);
        assert_same_bytes(part->layer_combined + 4 * p, whole->layer_combined + 4 * w, 16, part, whole, x, y,
                          "a layer's colour", what);
    }
}

int support_drain_log(char *text, size_t size)
{
    char line[512];
    int level, lines = 0;
    text[0] = 0;
    while (patina_log_next(line, sizeof line, &level)) {
        snprintf(text + strlen(text), size - strlen(text), "%s\n", line);
        lines++;
    }
    return lines;
}

patina_scene *scene_of(const patina_cloud *cloud, const patina_cloud_style *style)
{
    patina_scene *scene = NULL;
    CHECK(patina_scene_create(&scene), NULL);
    CHECK(patina_scene_add_cloud(scene, cloud, style), scene);
    return scene;
}

void support_set_variable(const char *name, const char *value)
{
#ifdef _WIN32
    _putenv_s(name, value ? value : "");
#else
    if (value)
        setenv(name, value, 1);
    else
        unsetenv(name);
#endif
}
