// SPDX-License-Identifier: GPL-3.0-or-later
// What whole-frame tests share: the device list of the command line, cameras, a picture with all passes, comparison.
// Include after cmocka.h's prerequisites; this header brings them.
#ifndef TEST_SUPPORT_H
#define TEST_SUPPORT_H

#include <patina/patina.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#if defined(__GNUC__)
#define SUPPORT_PRINTF __attribute__((format(printf, 1, 2)))
#else
#define SUPPORT_PRINTF
#endif

// Fails the running test with a sentence.
_Noreturn void support_die(const char *format, ...) SUPPORT_PRINTF;

// Fails the test unless code is PATINA_OK; prints the handle's (or with NULL the thread's) message.
#define CHECK(code, handle) support_check((code), (handle), __FILE__, __LINE__)
void support_check(int code, const void *handle, const char *file, int line);
const char *support_message(const void *handle); // static buffer

// ---- work ----------------------------------------------------------------------------------------------------------

// Of all threads of this program, which other programs do not lengthen.
double support_processor_seconds(void);
// Starts a task of the library, whose progress it gets. Returns the task's code.
typedef int support_start(void *context, patina_progress *progress, patina_task **task);
// Cancels tasks after their first steps until one notices before its end. Returns the processor's seconds from that cancel to the task's
// end. The test fails if no task notices.
double support_cancel(support_start *start, void *context);

// ---- devices: `--device NAME` (may be repeated) or `--device all`, the default -------------------------------------

void support_set_variable(const char *name, const char *value); // of the environment; NULL: there is none
void support_arguments(int argc, char **argv);
// Was the program started with `--quick`? Then what is named is left out, and that is said.
int support_is_quick(const char *left_out);
// All that the library's log holds; how many lines.
int support_drain_log(char *text, size_t size);
uint32_t support_device_count(void);
const char *support_device_name(uint32_t i);
// NULL, after printing "skip NAME: reason", when the device cannot be had here.
patina_device *support_device_open(const char *name, uint32_t threads, uint32_t batch);
// The device for tests that measure a picture and need one device only (all give the same): the first asked for.
// Skips the test when it cannot be had.
patina_device *support_device_first(void);
// Does the work on each device that can be had here, one after another.
void support_each_device(void (*work)(patina_device *device, const char *name));
int support_is_gl(const char *name);

// ---- cameras -------------------------------------------------------------------------------------------------------

// At eye, looking at target, z up (y up when looking along z).
patina_camera camera_perspective(const double eye[3], const double target[3], double fov_degrees, uint32_t width,
                                 uint32_t height, double near_clip, double far_clip);
// window_height in world units.
patina_camera camera_orthographic(const double eye[3], const double target[3], double window_height, uint32_t width,
                                  uint32_t height, double near_clip, double far_clip);
// World point -> pixel coordinates (float) and z as the passes have it, in float64.
void camera_project(const patina_camera *camera, uint32_t width, uint32_t height, const double world[3], double *x, double *y,
                    double *z);
// Ray through a point of the picture: origin + z * direction is at pass depth z.
void camera_ray(const patina_camera *camera, uint32_t width, uint32_t height, double x, double y, double origin[3],
                double direction[3]);

// ---- pictures ------------------------------------------------------------------------------------------------------

struct picture {
    uint32_t width, height;
    uint64_t *keys;
    float *combined, *depth, *normal, *source; // 4, 1, 3, 1 channels
    float *trust, *thickness, *density;        // 1 channel each
    uint32_t layers;                           // kept as passes; whole pictures one after another:
    float *layer_combined, *layer_depth, *layer_normal;
};

#define KEY_EMPTY 0x7F800000FFFFFFFFu

float key_z(uint64_t key);
uint32_t key_id(uint64_t key);

patina_settings settings_default(uint32_t width, uint32_t height);
struct picture picture_read(const patina_frame *frame);
struct picture picture_read_passes(const patina_frame *frame); // keys stay NULL
// Sets camera and settings, renders in a fresh frame and reads everything.
struct picture picture_render(patina_device *device, patina_scene *scene, const patina_camera *camera,
                              const patina_settings *settings);
// Where the settings asked for COMBINED, DEPTH and NORMAL of layers.
void picture_read_layers(struct picture *picture, const patina_frame *frame, const patina_settings *settings);
void picture_free(struct picture *picture);
uint64_t picture_count(const struct picture *picture); // pixels that are not empty
// Whole pictures, or a crop of `whole` at (x, y) against `part`; fails with the first pixel that differs. Keys only where
// both have them.
void picture_assert_identical(const struct picture *part, const struct picture *whole, uint32_t x, uint32_t y,
                              const char *what);

// A scene of one cloud.
patina_scene *scene_of(const patina_cloud *cloud, const patina_cloud_style *style);

#endif
