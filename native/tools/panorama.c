// SPDX-License-Identifier: GPL-3.0-or-later
// patina render FILE... --panorama WIDTHxHEIGHT --eye X,Y,Z
#include "view.h"

#include "base/platform.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void tool_panorama(const struct tool_options *options, const struct tool_box *box, patina_panorama *panorama)
{
    double far2 = 0;
    for (int i = 0; i < 3 && box->min[0] <= box->max[0]; i++) {
        const double away = fmax(fabs(box->min[i] - options->eye[i]), fabs(box->max[i] - options->eye[i]));
        far2 += away * away;
    }
    const double far = far2 > 0 ? 1.01 * sqrt(far2) : 1;
    const double *eye = options->eye; // the middle of the picture looks along y, its upper border along z
    *panorama = (patina_panorama){.struct_size = sizeof *panorama,
                                  .width = options->panorama[0],
                                  .height = options->panorama[1],
                                  .world_from_camera = {1, 0, 0, eye[0], 0, 0, -1, eye[1], 0, 1, 0, eye[2], 0, 0, 0, 1},
                                  .near_clip = 1e-4 * far,
                                  .far_clip = far};
    memcpy(panorama->region, options->settings.region, sizeof panorama->region);
}

int tool_panorama_fits(const patina_panorama *panorama)
{
    patina_camera camera = {.struct_size = sizeof camera};
    uint32_t side = 0;
    if (patina_panorama_camera(panorama, 0, &camera, &side))
        return 1; // drawing it tells why
    const uint32_t *r = panorama->region;
    const uint64_t width = r[2] ? r[2] - r[0] : panorama->width, height = r[3] ? r[3] - r[1] : panorama->height;
    const uint64_t bytes = (6 * (uint64_t)side * side + width * height) * 4 * sizeof(float), room = pt_free_memory();
    if (!room || bytes <= room)
        return 1;
    tool_say("panorama: six faces of %u x %u pixels need %llu MB of memory, and %llu MB are free: make the panorama smaller",
             side, side, (unsigned long long)(bytes >> 20), (unsigned long long)(room >> 20));
    return 0;
}

// Renders the face that the scene's camera looks at.
static int draw_face(patina_scene *scene, patina_frame *frame, const patina_camera *camera, float *pixels, size_t size,
                     patina_frame_stats *stats)
{
    patina_frame_stats face = {.struct_size = sizeof face};
    int code = patina_scene_set_camera(scene, camera);
    if (!code)
        code = patina_frame_render(frame, scene);
    if (!code)
        code = patina_frame_read(frame, PATINA_PASS_COMBINED, pixels, size);
    if (!code)
        code = patina_frame_get_stats(frame, &face);
    stats->points = face.points;
    stats->points_lost = face.points_lost > stats->points_lost ? face.points_lost : stats->points_lost;
    return code;
}

int tool_draw_panorama(const struct tool_options *options, const patina_panorama *panorama, patina_scene *scene,
                       patina_frame *frame, float **pixels, patina_frame_stats *stats)
{
    patina_settings settings = options->settings;
    patina_camera camera = {.struct_size = sizeof camera};
    float *faces[6] = {0};
    uint32_t side = 0;
    int code = patina_panorama_camera(panorama, 0, &camera, &side);
    settings.width = settings.height = side;
    memset(settings.region, 0, sizeof settings.region);
    if (!code)
        code = patina_scene_set_settings(scene, &settings);
    const size_t size = (size_t)side * side * 4 * sizeof(float);
    for (uint32_t face = 0; face < 6 && !code; face++) {
        faces[face] = malloc(size);
        code = faces[face] ? patina_panorama_camera(panorama, face, &camera, &side) : PATINA_ERROR_MEMORY;
        if (!code)
            code = draw_face(scene, frame, &camera, faces[face], size, stats);
    }
    const uint32_t *r = panorama->region;
    stats->width = r[2] ? r[2] - r[0] : panorama->width;
    stats->height = r[3] ? r[3] - r[1] : panorama->height;
    const size_t bytes = (size_t)stats->width * stats->height * 4 * sizeof(float);
    if (!code) {
        *pixels = malloc(bytes);
        const float *const read[6] = {faces[0], faces[1], faces[2], faces[3], faces[4], faces[5]};
        code = *pixels ? patina_panorama_join(panorama, PATINA_PASS_COMBINED, read, *pixels, bytes) : PATINA_ERROR_MEMORY;
    }
    for (int face = 0; face < 6; face++)
        free(faces[face]);
    return code;
}
