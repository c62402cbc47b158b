// SPDX-License-Identifier: GPL-3.0-or-later
// The public API from C alone: a ball of points, rendered and looked at. Linked with libpatina.so and nothing else.
#include <math.h>
#include <patina/patina.h>
#include <stdio.h>

#define TRY(call)                                                                                                              \
    if ((call) != PATINA_OK)                                                                                                   \
    return patina_message(NULL, text, sizeof text), fprintf(stderr, "%s: %s\n", #call, text), 1

static float points[20000][3], pixels[64][64][4];

int main(void)
{
    char text[256];
    for (int i = 0; i < 20000; i++) { // a spiral from pole to pole
        float z = 1.0f - (float)i / 10000.0f, r = sqrtf(1.0f - z * z), angle = 2.4f * (float)i;
        points[i][0] = r * cosf(angle), points[i][1] = r * sinf(angle), points[i][2] = z;
    }
    patina_device *device;
    patina_cloud *cloud;
    patina_scene *scene;
    patina_frame *frame;
    patina_cloud_desc desc = {.struct_size = sizeof desc, .count = 20000, .position = {points, PATINA_FLOAT32, 3, 0}};
    patina_settings settings = {.struct_size = sizeof settings, .width = 64, .height = 64, .world_color = {1, 1, 1}};
    patina_camera camera = {.struct_size = sizeof camera};
    TRY(patina_device_create(&(patina_device_desc){.struct_size = sizeof(patina_device_desc), .name = "cpu"}, &device));
    TRY(patina_cloud_create(&desc, NULL, &cloud));
    TRY(patina_scene_create(&scene));
    TRY(patina_scene_add_cloud(scene, cloud, NULL));
    settings.film_transparent = 1;
    TRY(patina_scene_set_settings(scene, &settings));
    TRY(patina_scene_frame_camera(scene, 0, 40, 0, &camera));
    TRY(patina_scene_set_camera(scene, &camera));
    TRY(patina_frame_create(device, &frame));
    TRY(patina_frame_render(frame, scene));
    TRY(patina_frame_read(frame, PATINA_PASS_COMBINED, &pixels[0][0][0], sizeof pixels));
    int good = pixels[32][32][3] == 1 && pixels[32][32][0] > 0.1f && pixels[0][0][3] == 0;
    printf("middle %g, corner %g: %s\n", pixels[32][32][0], pixels[0][0][3], good ? "a ball" : "no ball");
    patina_frame_destroy(frame);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    patina_device_destroy(device);
    return !good;
}
