// SPDX-License-Identifier: GPL-3.0-or-later
// Cameras and lights of `patina render`.
#include "view.h"
#include "base/elementary.h"
#include "base/vector.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846

static void normalize(double v[3])
{
    const double length = sqrt(pt_dot(v, v));
    for (int i = 0; i < 3; i++)
        v[i] /= length;
}

static void rotate_z(double v[3], const double pivot[3], double degrees)
{
    const double c = pt_cos(degrees * PI / 180), s = pt_sin(degrees * PI / 180);
    const double x = v[0] - pivot[0], y = v[1] - pivot[1];
    v[0] = pivot[0] + c * x - s * y;
    v[1] = pivot[1] + s * x + c * y;
}

// Distances along the view that hold the whole box, with a little air.
static void set_clip(patina_camera *camera, const struct tool_box *box)
{
    const double *m = camera->world_from_camera;
    double least = INFINITY, most = -INFINITY, diagonal = 0;
    for (int corner = 0; corner < 8; corner++) {
        double distance = 0;
        for (int i = 0; i < 3; i++) {
            const double p = corner >> i & 1 ? box->max[i] : box->min[i];
            distance -= (p - m[4 * i + 3]) * m[4 * i + 2];
        }
        least = fmin(least, distance);
        most = fmax(most, distance);
    }
    for (int i = 0; i < 3; i++)
        diagonal += (box->max[i] - box->min[i]) * (box->max[i] - box->min[i]);
    const double air = fmax(0.01 * sqrt(diagonal), 1e-6);
    camera->near_clip = least - air;
    camera->far_clip = most + air;
    if (camera->orthographic)
        return;
    camera->near_clip = fmax(camera->near_clip, 1e-4 * fmax(most, air)); // the eye is within the cloud
    camera->far_clip = fmax(camera->far_clip, 2 * camera->near_clip);
}

static void look(const struct tool_options *options, double turn, patina_camera *camera)
{
    double eye[3], back[3], right[3], up[3], pole[3] = {0, 0, 1};
    memcpy(eye, options->eye, sizeof eye);
    rotate_z(eye, options->target, turn);
    for (int i = 0; i < 3; i++)
        back[i] = eye[i] - options->target[i];
    normalize(back);
    if (fabs(back[2]) > 0.999999) { // straight down or up: the picture's top is y
        pole[1] = 1;
        pole[2] = 0;
    }
    pt_cross(pole, back, right);
    normalize(right);
    pt_cross(back, right, up);
    for (int i = 0; i < 3; i++) {
        double *row = camera->world_from_camera + 4 * i;
        row[0] = right[i];
        row[1] = up[i];
        row[2] = back[i];
        row[3] = eye[i];
    }
    camera->world_from_camera[15] = 1;
    const double aspect = (double)options->settings.width / options->settings.height;
    const double half = pt_tan((options->fov > 0 ? options->fov : 45.8) * PI / 360);
    camera->top = half;
    camera->bottom = -half;
    camera->right = half * aspect;
    camera->left = -half * aspect;
}

int tool_camera(const struct tool_options *options, const patina_scene *scene, const struct tool_box *box, double turn,
                patina_camera *camera)
{
    *camera = (patina_camera){.struct_size = sizeof *camera};
    if (options->view == VIEW_LOOK) {
        look(options, turn, camera);
    } else {
        const int code = patina_scene_frame_camera(scene, options->azimuth + turn, options->elevation, options->fov, camera);
        if (code)
            return code;
    }
    if (options->ortho_width > 0) {
        const double half = options->ortho_width / 2;
        const double aspect = (double)options->settings.width / options->settings.height;
        camera->orthographic = 1;
        camera->right = half;
        camera->left = -half;
        camera->top = half / aspect;
        camera->bottom = -half / aspect;
    }
    if ((options->view == VIEW_LOOK || options->ortho_width > 0) && box->min[0] <= box->max[0])
        set_clip(camera, box);
    else if (options->view == VIEW_LOOK)
        camera->far_clip = 2 * (camera->near_clip = 1);
    return PATINA_OK;
}

// A light that shines from `from`, in camera space, of so much power.
static patina_light_desc sun_from(const patina_camera *camera, const double from[3], const float color[3], float power)
{
    patina_light_desc light = {.struct_size = sizeof light, .type = PATINA_LIGHT_SUN, .power = power};
    memcpy(light.color, color, sizeof light.color);
    for (int i = 0; i < 3; i++)
        light.direction[i] = -pt_dot(camera->world_from_camera + 4 * i, from);
    return light;
}

int tool_lights(patina_scene *scene, const struct tool_options *options, const patina_camera *camera)
{
    // From over the left shoulder, flat enough that reliefs show; a cool, weak one from the right opens the shadows.
    const double key[3] = {-0.8, 0.75, 0.45}, fill[3] = {0.9, 0.1, 0.6};
    const float white[3] = {1.0f, 1.0f, 1.0f}, warm[3] = {1.0f, 0.97f, 0.92f}, cool[3] = {0.8f, 0.9f, 1.0f};
    patina_light_desc sun = sun_from(camera, key, warm, 2.8f), sky = sun_from(camera, fill, cool, 0.6f);
    if (options->headlight) {
        const double from[3] = {0, 0, 1};
        const patina_light_desc lamp = sun_from(camera, from, white, 3.0f);
        return patina_scene_add_light(scene, &lamp);
    }
    if (options->sun) {
        const double azimuth = options->sun_at[0] * PI / 180, height = options->sun_at[1] * PI / 180;
        sun.direction[0] = -pt_sin(azimuth) * pt_cos(height);
        sun.direction[1] = pt_cos(azimuth) * pt_cos(height);
        sun.direction[2] = -pt_sin(height);
        sun.angle = (float)(options->sun_at[2] * PI / 180);
    }
    sun.shadows = options->shadows ? 1 : 0;
    const int code = patina_scene_add_light(scene, &sun);
    return code ? code : patina_scene_add_light(scene, &sky);
}
