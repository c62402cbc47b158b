// SPDX-License-Identifier: GPL-3.0-or-later
// Shadows on triangles against exact rays, SPEC 4: a ball of points over a plane of triangles, one of triangles over points and over
// triangles, under suns, points, spots and panels, hard and soft. What is a border's width away from a shadow's edge must be right,
// and penumbras as deep as the light's area says.
#include "clouds.h"
#include "meshes.h"
#include "support.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

enum { SIZE = 240, SAMPLES = 64, GRID = 24 };
static const double radius = 0.5, half_side = 2.0;
static const double middle[3] = {0.0, 0.0, 0.9};

enum who { POINTS_ON_MESH, MESH_ON_MESH, MESH_ON_POINTS };
static const char *const whose[] = {"points on triangles", "triangles on triangles", "triangles on points"};

struct setup {
    patina_scene *scene;
    patina_mesh *plane, *ball;
    patina_cloud *cloud;
    uint32_t first, end; // ids of the plane
};

static patina_mesh *flat(void)
{
    const double center[3] = {0.0, 0.0, -0.05}, half[3] = {half_side, half_side, 0.05};
    return mesh_box(center, half);
}

static struct setup make(enum who who)
{
    static const double unit[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    struct setup s = {0};
    struct points points = {0};
    CHECK(patina_scene_create(&s.scene), NULL);
    if (who != MESH_ON_MESH) {
        points = who == POINTS_ON_MESH ? points_sphere(80000, radius, POINTS_NORMALS, 12)
                                       : points_rectangle(160000, 2 * half_side, 2 * half_side, POINTS_NORMALS, 11);
        if (who == POINTS_ON_MESH)
            points_transform(&points, unit, middle);
        s.cloud = points_upload(&points);
        points_free(&points);
        const patina_cloud_style style = {.struct_size = sizeof style};
        CHECK(patina_scene_add_cloud(s.scene, s.cloud, &style), s.scene);
    }
    patina_cloud_info info = {.struct_size = sizeof info};
    if (s.cloud)
        CHECK(patina_cloud_get_info(s.cloud, &info), s.cloud);
    if (who != MESH_ON_POINTS) {
        s.plane = flat();
        mesh_add(s.scene, s.plane, 0.8f, 0.8f, 0.8f);
    }
    if (who != POINTS_ON_MESH) {
        s.ball = mesh_sphere(middle, radius, 96, 1);
        mesh_add(s.scene, s.ball, 0.8f, 0.8f, 0.8f);
    }
    s.first = who == MESH_ON_POINTS ? 0 : (uint32_t)info.count;
    s.end = who == MESH_ON_POINTS ? (uint32_t)info.count : s.first + 12;
    return s;
}

static void destroy(struct setup *s)
{
    patina_scene_destroy(s->scene);
    patina_mesh_destroy(s->plane);
    patina_mesh_destroy(s->ball);
    patina_cloud_destroy(s->cloud);
}

// Whether the way from p to the end (a direction where `far`) is free of the ball.
static int is_free(const double p[3], const double end[3], int far)
{
    double d[3], length = 0.0, along = 0.0, square = 0.0;
    for (int k = 0; k < 3; k++) {
        d[k] = far ? end[k] : end[k] - p[k];
        length += d[k] * d[k];
    }
    length = sqrt(length);
    for (int k = 0; k < 3; k++) {
        along += (middle[k] - p[k]) * d[k] / length;
        square += (middle[k] - p[k]) * (middle[k] - p[k]);
    }
    return along <= 0.0 || square - along * along > radius * radius || (!far && along > length);
}

static void frame_of(const double z[3], double x[3], double y[3])
{
    const double pole[3] = {fabs(z[0]) < 0.9, fabs(z[0]) >= 0.9, 0};
    double length = 0.0;
    for (int k = 0; k < 3; k++)
        x[k] = pole[(k + 1) % 3] * z[(k + 2) % 3] - pole[(k + 2) % 3] * z[(k + 1) % 3];
    length = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
    for (int k = 0; k < 3; k++)
        x[k] /= length;
    for (int k = 0; k < 3; k++)
        y[k] = z[(k + 1) % 3] * x[(k + 2) % 3] - z[(k + 2) % 3] * x[(k + 1) % 3];
}

// What arrives at p of a light, by GRID x GRID rays over its area; grown: the area as if wider by so much on each side.
static double arrives(const patina_light_desc *light, const double p[3], double *least, double *most, double border)
{
    const int sun = light->type == PATINA_LIGHT_SUN, area = light->type == PATINA_LIGHT_AREA;
    double z[3], x[3], y[3], length = 0.0, lit = 0.0, all = 0.0;
    for (int k = 0; k < 3; k++) {
        z[k] = sun || area ? -light->direction[k] : light->position[k] - p[k];
        length += z[k] * z[k];
    }
    for (int k = 0; k < 3; k++)
        z[k] /= sqrt(length);
    frame_of(z, x, y);
    double size = sun ? tan(0.5 * (double)light->angle) : area ? 0.5 * (double)light->size[0] : (double)light->radius;
    *least = 1.0;
    *most = 0.0;
    for (int i = 0; i < GRID; i++)
        for (int j = 0; j < GRID; j++) {
            double a = 2.0 * (i + 0.5) / GRID - 1.0, b = 2.0 * (j + 0.5) / GRID - 1.0, end[3];
            if (!area && a * a + b * b > 1.0)
                continue;
            for (int k = 0; k < 3; k++)
                end[k] = (sun ? z[k] : light->position[k]) + size * (a * x[k] + b * y[k]);
            lit += is_free(p, end, sun);
            all += 1.0;
        }
    // how the border's width changes it
    for (int i = 0; i < 8; i++) {
        double q[3] = {p[0] + border * cos(i * PI / 4), p[1] + border * sin(i * PI / 4), p[2]}, end[3], one;
        for (int k = 0; k < 3; k++)
            end[k] = sun ? z[k] : light->position[k];
        one = is_free(q, end, sun);
        *least = fmin(*least, one);
        *most = fmax(*most, one);
    }
    return lit / all;
}

struct outcome {
    uint32_t tested, wrong, dark, between;
    double error, bias; // of penumbras: root mean square, mean
};

// border: as wide as a map's texel and the points' spacing leave open.
static struct outcome measure(patina_device *device, struct setup *s, const patina_light_desc *light, double border)
{
    static const double eye[3] = {1.6, -3.2, 4.0}, target[3] = {0.0, 0.3, 0.0};
    const patina_camera camera = camera_perspective(eye, target, 50.0, SIZE, SIZE, 0.1, 100.0);
    patina_settings settings = settings_default(SIZE, SIZE);
    const int soft = light->angle > 0.0f || light->radius > 0.0f || light->type == PATINA_LIGHT_AREA;
    settings.shadow_samples = soft ? SAMPLES : 1;
    settings.antialias = PATINA_ANTIALIAS_OFF;
    patina_frame *frame = NULL;
    float *shadow = malloc(SIZE * SIZE * sizeof *shadow);
    struct outcome out = {0};
    CHECK(patina_scene_add_light(s->scene, light), s->scene);
    CHECK(patina_scene_set_camera(s->scene, &camera), s->scene);
    CHECK(patina_scene_set_settings(s->scene, &settings), s->scene);
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_frame_render(frame, s->scene), frame);
    struct picture picture = picture_read(frame);
    CHECK(patina_frame_read(frame, PATINA_PASS_SHADOW, shadow, SIZE * SIZE * sizeof *shadow), frame);
    for (uint32_t i = 0; i < SIZE * SIZE; i++) {
        double origin[3], way[3], p[3], least, most;
        uint32_t id = key_id(picture.keys[i]);
        if (id < s->first || id >= s->end)
            continue;
        camera_ray(&camera, SIZE, SIZE, i % SIZE + 0.5, i / SIZE + 0.5, origin, way);
        for (int k = 0; k < 3; k++)
            p[k] = origin[k] - origin[2] / way[2] * way[k];
        if (fabs(p[0]) > half_side - 0.05 || fabs(p[1]) > half_side - 0.05)
            continue;
        double truth = arrives(light, p, &least, &most, border), off = (double)shadow[i] - truth;
        out.dark += truth < 0.5;
        if (soft && truth > 0.02 && truth < 0.98) {
            out.between++;
            out.error += off * off;
            out.bias += off;
            continue;
        }
        if (soft ? fabs(truth - round(truth)) > 0.0 : least != most)
            continue;
        out.tested++;
        out.wrong += fabs(off) > (soft ? 0.1 : 0.5);
    }
    out.error = out.between ? sqrt(out.error / out.between) : 0.0;
    out.bias = out.between ? out.bias / out.between : 0.0;
    picture_free(&picture);
    patina_frame_destroy(frame);
    free(shadow);
    return out;
}

static const struct {
    const char *name;
    patina_light_desc light;
} lights[] = {
    {"sun", {.type = PATINA_LIGHT_SUN, .direction = {-0.6, 0.3, -1.0}}},
    {"low sun", {.type = PATINA_LIGHT_SUN, .direction = {-1.0, 0.2, -0.6}}},
    {"soft sun", {.type = PATINA_LIGHT_SUN, .direction = {-0.6, 0.3, -1.0}, .angle = 0.3f}},
    {"point", {.type = PATINA_LIGHT_POINT, .position = {1.2, -0.5, 3.0}}},
    {"soft point", {.type = PATINA_LIGHT_POINT, .position = {1.2, -0.5, 3.0}, .radius = 0.3f}},
    {"spot", {.type = PATINA_LIGHT_SPOT, .position = {1.2, -0.5, 3.0}, .direction = {-0.4, 0.17, -1.0}, .cone = 2.0f}},
    {"soft spot",
     {.type = PATINA_LIGHT_SPOT, .position = {1.2, -0.5, 3.0}, .direction = {-0.4, 0.17, -1.0}, .cone = 2.0f, .radius = 0.3f}},
    {"panel", {.type = PATINA_LIGHT_AREA, .position = {0.8, -0.4, 3.0}, .direction = {0.0, 0.0, -1.0}, .size = {0.8f, 0.8f}}},
};

static void against_rays(enum who who, double border)
{
    patina_device *device = support_device_first();
    for (size_t i = 0; i < sizeof lights / sizeof *lights; i++) {
        struct setup s = make(who);
        patina_light_desc light = lights[i].light;
        double length = 0.0;
        light.struct_size = sizeof light;
        light.power = 3.0f;
        light.shadows = 1;
        for (int k = 0; k < 3; k++)
            length += light.direction[k] * light.direction[k];
        for (int k = 0; k < 3 && length > 0.0; k++)
            light.direction[k] /= sqrt(length);
        struct outcome o = measure(device, &s, &light, border);
        printf("%s, %s: %u of %u wrong, %u dark; %u in the penumbra off by %.4f, %+.4f on average\n", whose[who],
               lights[i].name, o.wrong, o.tested, o.dark, o.between, o.error, o.bias);
        assert_true(o.tested > 10000 && o.dark > 400 && o.wrong <= o.tested / 2000);
        assert_true(o.error < 0.05 && fabs(o.bias) < 0.02);
        destroy(&s);
    }
    patina_device_destroy(device);
}

static void points_on_triangles(void **state)
{
    (void)state;
    against_rays(POINTS_ON_MESH, 0.02);
}

static void triangles_on_triangles(void **state)
{
    (void)state;
    against_rays(MESH_ON_MESH, 0.015);
}

static void triangles_on_points(void **state)
{
    (void)state;
    against_rays(MESH_ON_POINTS, 0.03);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(points_on_triangles),
        cmocka_unit_test(triangles_on_triangles),
        cmocka_unit_test(triangles_on_points),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
