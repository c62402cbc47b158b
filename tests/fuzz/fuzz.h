// SPDX-License-Identifier: GPL-3.0-or-later
// What the fuzzers share: a file of points is read in full, and a small scene.
#ifndef PT_FUZZ_H
#define PT_FUZZ_H

#include "patina/patina.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#define REQUIRE(condition) ((condition) ? (void)0 : abort())

static inline void fuzz_read_columns(const patina_file *file, const patina_file_info *info)
{
    size_t count = (size_t)info->count;
    float *floats = malloc((count ? count : 1) * 4 * sizeof *floats);
    double *stations = malloc((info->stations + 1) * 3 * sizeof *stations);
    REQUIRE(floats && stations);
    REQUIRE(patina_file_read_positions(file, floats, count * 3 * sizeof *floats) == PATINA_OK);
    REQUIRE((patina_file_read_normals(file, floats, count * 3 * sizeof *floats) == PATINA_OK) == (info->has_normals != 0));
    int code = patina_file_read_colors_f32(file, floats, count * 4 * sizeof *floats);
    REQUIRE((code == PATINA_OK) == (info->color_type != PATINA_NONE));
    REQUIRE(patina_file_read_colors_u8(file, (uint8_t *)floats, count * 4) == code);
    for (uint32_t i = 0; i < info->attributes; i++) {
        patina_file_attribute attribute = {.struct_size = sizeof attribute};
        REQUIRE(patina_file_get_attribute(file, i, &attribute) == PATINA_OK);
        REQUIRE(patina_file_read_attribute(file, i, floats, count * sizeof *floats) == PATINA_OK);
        // a PLY may have points of no scan, with any other number; the other readers number their scans
        const int numbered = info->stations && strncmp(info->format, "PLY", 3) != 0 && !strcmp(attribute.name, "scan");
        for (size_t k = 0; numbered && k < count; k++)
            REQUIRE(floats[k] < (float)info->stations);
    }
    REQUIRE((patina_file_read_stations(file, stations, (info->stations + 1) * 3 * sizeof *stations) == PATINA_OK) ==
            (info->stations != 0));
    free(stations);
    free(floats);
}

// Any bytes as a file of points. Returns how many points it has, -1 when it was refused.
static inline int64_t fuzz_open_points(const uint8_t *data, size_t size)
{
    patina_file *file = NULL;
    char message[512];
    if (patina_file_open_memory(data, size, &file) != PATINA_OK) {
        REQUIRE(!file && patina_message(NULL, message, sizeof message) > 0);
        return -1;
    }
    patina_file_info info = {.struct_size = sizeof info};
    REQUIRE(patina_file_get_info(file, &info) == PATINA_OK);
    REQUIRE(info.count <= size && info.invalid_positions <= info.count); // a point takes three bytes at least
    fuzz_read_columns(file, &info);
    patina_file_destroy(file);
    return (int64_t)info.count;
}

// A file that has a name only for this process.
struct fuzz_file {
    int descriptor;
    char path[64];
};

static inline struct fuzz_file fuzz_file(void)
{
    struct fuzz_file file = {.descriptor = memfd_create("fuzz", MFD_CLOEXEC)};
    REQUIRE(file.descriptor >= 0);
    snprintf(file.path, sizeof file.path, "/proc/self/fd/%d", file.descriptor);
    return file;
}

static inline void fuzz_fill(const struct fuzz_file *file, const uint8_t *data, size_t size)
{
    REQUIRE(!ftruncate(file->descriptor, 0) && pwrite(file->descriptor, data, size, 0) == (ssize_t)size);
}

// A ball of points with all that a point can have.
enum { FUZZ_POINTS = 300 };

static inline patina_cloud *fuzz_cloud(int with_opacities)
{
    static float position[FUZZ_POINTS][3], value[FUZZ_POINTS];
    static uint8_t byte[FUZZ_POINTS][4];
    for (int i = 0; i < FUZZ_POINTS; i++) {
        float z = 1 - 2 * ((float)i + 0.5f) / FUZZ_POINTS;
        uint32_t random = (uint32_t)i * 2654435761u;
        float side = 1 - z * z > 0 ? 1 - z * z : 0;
        position[i][0] = side * ((float)(random >> 16) / 32768 - 1),
        position[i][1] = side * ((float)(random & 0xFFFF) / 32768 - 1);
        position[i][2] = z;
        value[i] = 0.05f + (float)(i % 7) / 50;
        memcpy(byte[i], &random, 4);
    }
    patina_cloud_desc desc = {.struct_size = sizeof desc,
                              .count = FUZZ_POINTS,
                              .position = {position, PATINA_FLOAT32, 3, 0},
                              .normal = {position, PATINA_FLOAT32, 3, 0},
                              .color = {byte, PATINA_UINT8, 3, 4},
                              .opacity = {byte, PATINA_UINT8, 1, 4},
                              .scalar = {value, PATINA_FLOAT32, 1, 0},
                              .classes = {byte, PATINA_UINT8, 1, 4},
                              .radius = {value, PATINA_FLOAT32, 1, 0},
                              .threads = 1};
    if (!with_opacities)
        desc.opacity.data = NULL;
    patina_cloud *cloud = NULL;
    REQUIRE(patina_cloud_create(&desc, NULL, &cloud) == PATINA_OK);
    return cloud;
}

// Its frames' planes hold what no pass wrote: poison, so that who reads it ends.
static inline patina_device *fuzz_device(void)
{
    patina_device *device = NULL;
    setenv("PATINA_POISON_PLANES", "1", 1);
    patina_device_desc desc = {.struct_size = sizeof desc, .name = "cpu", .threads = 1};
    REQUIRE(patina_device_create(&desc, &device) == PATINA_OK);
    return device;
}

// The cloud, seen from the front; a sun that casts shadows.
static inline patina_scene *fuzz_scene(patina_cloud *cloud, const patina_cloud_style *style, uint32_t surface)
{
    patina_scene *scene = NULL;
    patina_settings settings = {.struct_size = sizeof settings,
                                .width = 24,
                                .height = 24,
                                .surface = surface,
                                .shadow_resolution = 32,
                                .film_transparent = 1};
    patina_camera camera = {.struct_size = sizeof camera,
                            .world_from_camera = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 4, 0, 0, 0, 1},
                            .left = -0.4,
                            .right = 0.4,
                            .bottom = -0.4,
                            .top = 0.4,
                            .near_clip = 0.1,
                            .far_clip = 100};
    patina_light_desc light = {
        .struct_size = sizeof light, .type = PATINA_LIGHT_SUN, .power = 3, .direction = {1, 0, -1}, .shadows = 1};
    REQUIRE(patina_scene_create(&scene) == PATINA_OK && patina_scene_add_cloud(scene, cloud, style) == PATINA_OK &&
            patina_scene_add_light(scene, &light) == PATINA_OK && patina_scene_set_camera(scene, &camera) == PATINA_OK &&
            patina_scene_set_settings(scene, &settings) == PATINA_OK);
    return scene;
}

#endif
