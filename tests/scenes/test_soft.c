// SPDX-License-Identifier: GPL-3.0-or-later
// Soft points through whole frames: against numerical quadrature of their density and the references of tests/reference/soft.c, on every
// device; what is refused and what is sifted out. SPEC 5.
#include "clouds.h"
#include "soft.h"

#include "reference.h"
#include "shared/balls.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { BALLS = 12 };

struct ball {
    double center[3], r, a;
    float color[3];
};

struct scene {
    const char *name;
    uint32_t count;
    double eye[3];
    struct ball balls[BALLS];
};

static struct scene scene_at(int which)
{
    const struct ball one = {{0.0, 0.0, 0.0}, 1.0, 0.902, {1.0f, 0.5f, 0.1f}};
    struct scene scene = {.name = "one", .count = 1, .eye = {0.3, -4.0, 0.7}, .balls = {one}};
    if (which == 1) {
        scene.name = "two";
        scene.count = 2;
        scene.balls[1] = (struct ball){{0.5, 0.8, 0.25}, 1.25, 0.6, {0.0f, 0.2f, 1.0f}};
    } else if (which == 2 || which == 4) {
        scene.name = which == 2 ? "ten" : "ten of a field, its radii 1e-3 to 1e3";
        scene.count = which == 2 ? 10 : 12;
        for (int i = 0; i < 10; i++)
            scene.balls[i] = (struct ball){{0.4 * sin(i), -1.6 + 0.4 * i, 0.4 * cos(2.0 * i)},
                                           0.5 + 0.0631 * i,
                                           0.05 + 0.09 * i,
                                           {(float)(i % 2), 0.5f * (float)(i % 3), 0.25f * (float)(i % 5)}};
        for (int i = 10; i < 12; i++) // what is not there widens the field's steps
            scene.balls[i] = (struct ball){.r = i == 10 ? 1e-3 : 1e3};
    } else if (which == 3) {
        scene.name = "the eye inside";
        scene.eye[1] = -0.4;
    }
    return scene;
}

static void scale_scene(struct scene *scene, double s)
{
    for (int k = 0; k < 3; k++) {
        scene->eye[k] *= s;
        for (uint32_t i = 0; i < scene->count; i++)
            scene->balls[i].center[k] *= s;
    }
    for (uint32_t i = 0; i < scene->count; i++)
        scene->balls[i].r *= s;
}

static patina_cloud *upload(const struct ball *balls, uint32_t count)
{
    double position[3 * BALLS], opacity[BALLS];
    float color[3 * BALLS], radius[BALLS];
    for (uint32_t i = 0; i < count; i++) {
        memcpy(position + 3 * i, balls[i].center, sizeof balls[i].center);
        memcpy(color + 3 * i, balls[i].color, sizeof balls[i].color);
        radius[i] = (float)balls[i].r;
        opacity[i] = balls[i].a;
    }
    patina_cloud_desc desc = {.struct_size = sizeof desc, .count = count};
    desc.position = (patina_array){.data = position, .type = PATINA_FLOAT64, .components = 3};
    desc.color = (patina_array){.data = color, .type = PATINA_FLOAT32, .components = 3};
    desc.opacity = (patina_array){.data = opacity, .type = PATINA_FLOAT64, .components = 1};
    desc.radius = (patina_array){.data = radius, .type = PATINA_FLOAT32, .components = 1};
    patina_cloud *cloud = NULL;
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    return cloud;
}

static double kept_opacity(double a) { return round(a * 255.0) / 255.0; } // clouds keep a byte of it

// Marches along the ray: no closed form, no pieces.
static struct ref_soft march(const struct scene *scene, const double origin[3], const double ray[3], double from, double to)
{
    enum { STEPS = 20000 };
    struct ref_soft out = {.through = 1.0};
    const double length = sqrt(ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2]), step = (to - from) / STEPS;
    for (int k = 0; k < STEPS; k++) {
        const double s = (from + (k + 0.5) * step) / length;
        double lost = 0.0, weights = 0.0, color[3] = {0.0};
        for (uint32_t i = 0; i < scene->count; i++) {
            const struct ball *b = &scene->balls[i];
            double square = 0.0, along = 0.0, apart = 0.0;
            for (int c = 0; c < 3; c++) {
                const double off = origin[c] + s * ray[c] - b->center[c], to_center = b->center[c] - origin[c];
                square += off * off;
                along += ray[c] * to_center / length;
                apart += to_center * to_center;
            }
            if (square >= b->r * b->r)
                continue;
            const double a = fmin(kept_opacity(b->a), (double)PT_SOFT_FULLEST),
                         weight = (1.0 - sqrt(fmax(apart - along * along, 0.0)) / b->r) * a;
            lost += -log1p(-a) * (1.0 - sqrt(square) / b->r) * step / b->r;
            weights += weight;
            for (int c = 0; c < 3; c++)
                color[c] += weight * (double)b->color[c];
        }
        for (int c = 0; c < 3 && weights > 0.0; c++)
            out.color[c] += out.through * -expm1(-lost) * color[c] / weights;
        out.through *= exp(-lost);
    }
    return out;
}

// As the references take the balls.
static struct ref_soft exactly(const struct scene *scene, const patina_camera *camera, const double origin[3],
                               const double ray[3], uint32_t model, uint32_t shells, double w, double to)
{
    struct ref_ball balls[BALLS] = {{0}};
    const double *m = camera->world_from_camera, length = sqrt(ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2]);
    for (uint32_t i = 0; i < scene->count; i++) {
        const struct ball *b = &scene->balls[i];
        double along = 0.0, apart = 0.0, z = 0.0, on_disc = 0.0, own = 0.0, place[3];
        for (int c = 0; c < 3; c++) {
            place[c] = b->center[c] - origin[c];
            along += ray[c] * place[c] / length;
            apart += place[c] * place[c];
            z -= m[4 * c + 2] * place[c];
            balls[i].color[c] = (double)b->color[c];
        }
        // Express: where the ray meets the plane at the centre's z, seen across the ray to the centre
        for (int c = 0; c < 3; c++) {
            const double off = ray[c] * z - place[c], towards = camera->orthographic ? ray[c] : place[c] / sqrt(apart);
            on_disc += off * off;
            own += off * towards;
        }
        balls[i].square = (on_disc - own * own) / (b->r * b->r);
        balls[i].z = z;
        balls[i].r = b->r;
        balls[i].along = along;
        balls[i].d = sqrt(fmax(apart - along * along, 0.0)) / b->r;
        balls[i].a = kept_opacity(b->a);
        balls[i].w = w;
        balls[i].shells = shells;
        balls[i].record = i;
    }
    if (model == PATINA_SOFT_EXPRESS)
        return ref_soft_discs(balls, scene->count, camera->orthographic ? 0.0 : camera->near_clip, to / length);
    const struct ref_soft_model as = {model == PATINA_SOFT_BASE ? PT_SOFT_BASE : PT_SOFT_CONCENTRIC, PT_SOFT_EVEN};
    return ref_soft_ray(balls, scene->count, &as, camera->orthographic ? 0.0 : length * camera->near_clip, to);
}

static double check_pixel(const struct ref_soft *expected, const float got[4], const float behind[4])
{
    double worst = fabs((double)got[3] - (1.0 - expected->through + expected->through * (double)behind[3]));
    for (int c = 0; c < 3; c++)
        worst = fmax(worst, fabs((double)got[c] - (expected->color[c] + expected->through * (double)behind[c])));
    return worst;
}

static patina_camera camera_of(const struct scene *scene, int parallel, double s)
{
    const double target[3] = {0.0, 0.2 * s, 0.1 * s};
    return parallel ? camera_orthographic(scene->eye, target, 4.0 * s, WIDTH, HEIGHT, 0.01 * s, 50.0 * s)
                    : camera_perspective(scene->eye, target, 50.0, WIDTH, HEIGHT, 0.01 * s, 50.0 * s);
}

static void hold(patina_device *device, const char *device_name, int which, int parallel, uint32_t model, double s,
                 float modulation)
{
    struct scene scene = scene_at(which);
    const float behind[4] = {background[0], background[1], background[2], 1.0f};
    scale_scene(&scene, s);
    patina_cloud *cloud = upload(scene.balls, scene.count);
    patina_cloud_style style = soft_style(model);
    style.soft_shells = model == PATINA_SOFT_CONCENTRIC ? 12 : 0;
    style.soft_modulation = modulation;
    patina_field *field = NULL;
    if (which == 4) {
        static const float one[] = {1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1};
        const patina_field_desc desc = {.struct_size = sizeof desc, .values = one, .count = 12, .range = {0.0, 1.0}};
        CHECK(patina_field_create(cloud, &desc, NULL, &field), NULL);
        style.soft = PATINA_SOFT_FIELD;
        style.field = field;
        style.soft_threshold = 0.5f;
    }
    patina_scene *drawn = scene_of(cloud, &style);
    const patina_camera camera = camera_of(&scene, parallel, s);
    const patina_settings settings = plain_settings();
    struct picture picture = picture_render(device, drawn, &camera, &settings);
    double worst = 0.0, marched = 0.0, density_off = 0.0, densest = 0.0;
    const double w = round((1.0 - (double)modulation) * 255.0) / 255.0;
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
        double origin[3], ray[3];
        camera_ray(&camera, WIDTH, HEIGHT, i % WIDTH + 0.5, i / WIDTH + 0.5, origin, ray);
        const double length = sqrt(ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2]);
        const struct ref_soft expected = exactly(&scene, &camera, origin, ray, model, 12, w, 50.0 * s * length);
        worst = fmax(worst, check_pixel(&expected, picture.combined + 4 * i, behind));
        density_off = fmax(density_off, fabs((double)picture.density[i] - expected.density));
        densest = fmax(densest, expected.density);
        if (i % 211 || model != PATINA_SOFT_BASE || modulation > 0.0f)
            continue;
        const struct ref_soft sum = march(&scene, origin, ray, (parallel ? 0.0 : 0.01 * s) * length, 8.0 * s * length);
        marched = fmax(marched, check_pixel(&sum, picture.combined + 4 * i, behind));
    }
    printf(
        "  %s, %s%s, model %u, scale %g, modulation %g: %.2g from the reference, %.2g from quadrature, density %.2g of %.4g\n",
        device_name, scene.name, parallel ? ", parallel" : "", model, s, (double)modulation, worst, marched, density_off,
        densest);
    assert_true(densest > 0.0 && density_off <= 1e-4 * densest);
    assert_true(worst <= 1e-4);
    assert_true(marched <= 1e-4);
    assert_int_equal(picture_count(&picture), 0); // keys tell of what is opaque
    picture_free(&picture);
    patina_scene_destroy(drawn);
    patina_field_destroy(field);
    patina_cloud_destroy(cloud);
}

static void hold_all(patina_device *device, const char *name)
{
    static const double scales[] = {1.0, 1e-3, 1e3};
    for (int which = 0; which < 4; which++)
        for (uint32_t model = 0; model < 3; model++) {
            hold(device, name, which, 0, model, 1.0, 0.0f);
            hold(device, name, which, 1, model, 1.0, 0.0f);
        }
    for (int k = 1; k < 3; k++)
        hold(device, name, 2, 0, PATINA_SOFT_BASE, scales[k], 0.0f);
    hold(device, name, 4, 0, PATINA_SOFT_BASE, 1.0, 0.0f);
    hold(device, name, 1, 0, PATINA_SOFT_BASE, 1.0, 0.6f);
    hold(device, name, 1, 0, PATINA_SOFT_EXPRESS, 1.0, 1.0f);
}

static void test_quadrature(void **state)
{
    (void)state;
    support_each_device(hold_all);
}

// One ball that a wall cuts: what lies before the wall, no more.
static void cut(patina_device *device, const char *name)
{
    struct scene scene = scene_at(0);
    struct points wall = points_rectangle(200000, 8.0, 8.0, POINTS_ALL, 7);
    const double turned[9] = {1, 0, 0, 0, 0, -1, 0, 1, 0}, moved[3] = {0.0, 0.3, 0.0};
    points_transform(&wall, turned, moved);
    patina_cloud *behind = points_upload(&wall), *cloud = upload(scene.balls, 1);
    const patina_cloud_style style = soft_style(PATINA_SOFT_BASE);
    patina_scene *bare = scene_of(behind, NULL), *drawn = scene_of(behind, NULL);
    CHECK(patina_scene_add_cloud(drawn, cloud, &style), drawn);
    const patina_camera camera = camera_of(&scene, 0, 1.0);
    const patina_settings settings = plain_settings();
    struct picture with = picture_render(device, drawn, &camera, &settings),
                   without = picture_render(device, bare, &camera, &settings);
    double worst = 0.0;
    uint32_t checked = 0;
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
        double origin[3], ray[3];
        if (without.keys[i] == KEY_EMPTY)
            continue;
        camera_ray(&camera, WIDTH, HEIGHT, i % WIDTH + 0.5, i / WIDTH + 0.5, origin, ray);
        const double to = (double)key_z(without.keys[i]) * sqrt(ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2]);
        const struct ref_soft expected = exactly(&scene, &camera, origin, ray, PATINA_SOFT_BASE, 0, 1.0, to);
        worst = fmax(worst, check_pixel(&expected, with.combined + 4 * i, without.combined + 4 * i));
        checked++;
    }
    printf("  %s, a ball that a wall cuts: %.2g\n", name, worst);
    assert_true(checked > WIDTH * HEIGHT / 2);
    assert_true(worst <= 1e-4);
    picture_free(&with);
    picture_free(&without);
    patina_scene_destroy(bare);
    patina_scene_destroy(drawn);
    patina_cloud_destroy(behind);
    patina_cloud_destroy(cloud);
    points_free(&wall);
}

static void test_cut(void **state)
{
    (void)state;
    support_each_device(cut);
}

// ---- what is asked for -----------------------------------------------------------------------------------------------------

static void refuse(patina_scene *scene, const patina_cloud *cloud, const patina_cloud_style *style, const char *word)
{
    assert_int_equal(patina_scene_add_cloud(scene, cloud, style), PATINA_ERROR_ARGUMENT);
    assert_non_null(strstr(support_message(scene), word));
}

static void test_refusals(void **state)
{
    (void)state;
    const struct scene one = scene_at(0);
    patina_cloud *cloud = upload(one.balls, 1);
    patina_cloud_style style = soft_style(PATINA_SOFT_BASE);
    patina_scene *scene = scene_of(cloud, &style);
    style.soft_model = PATINA_SOFT_EXPRESS;
    refuse(scene, cloud, &style, "instance 0");
    style = soft_style(3);
    refuse(scene, cloud, &style, "soft_model");
    style = soft_style(0);
    style.soft = 4;
    refuse(scene, cloud, &style, "soft");
    style = soft_style(0);
    style.soft_shells = 65;
    refuse(scene, cloud, &style, "65 soft_shells");
    for (int k = 0; k < 5; k++) {
        style = soft_style(0);
        style.soft_radius = k == 0 ? -1.0f : k == 1 ? INFINITY : 0.0f;
        style.soft_opacity = k == 2 ? 1.5f : k == 3 ? NAN : 0.0f;
        style.soft_modulation = k == 4 ? -0.1f : 0.0f;
        refuse(scene, cloud, &style, k < 2 ? "soft_radius" : "soft_opacity");
    }
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

// Clips and masks hide soft points too, also where nothing else is in view.
static void sifted(patina_device *device, const char *name)
{
    struct scene scene = scene_at(1);
    patina_cloud *two = upload(scene.balls, 2), *one = upload(scene.balls, 1);
    const uint8_t hidden[1] = {2};
    patina_mask *mask = NULL;
    CHECK(patina_mask_create(two, hidden, NULL, 1, &mask), NULL);
    patina_cloud_style style = soft_style(PATINA_SOFT_BASE), masked = style;
    masked.mask = mask;
    const patina_camera camera = camera_of(&scene, 0, 1.0);
    const patina_settings settings = plain_settings();
    patina_scene *a = scene_of(two, &masked), *b = scene_of(one, &style), *c = scene_of(two, &style);
    patina_clip clip = {.struct_size = sizeof clip, .shape = PATINA_CLIP_BOX};
    for (int k = 0; k < 3; k++)
        clip.world_from_clip[5 * k] = 0.2;
    clip.world_from_clip[15] = 1.0;
    CHECK(patina_scene_add_clip(c, &clip), c);
    struct picture first = picture_render(device, a, &camera, &settings),
                   second = picture_render(device, b, &camera, &settings);
    struct picture third = picture_render(device, c, &camera, &settings);
    double worst = 0.0;
    for (uint32_t i = 0; i < 4 * WIDTH * HEIGHT; i++)
        worst = fmax(worst, fmax(fabs((double)first.combined[i] - (double)second.combined[i]),
                                 fabs((double)third.combined[i] - (double)second.combined[i])));
    printf("  %s, masked and clipped: %.2g\n", name, worst);
    assert_true(worst <= 1e-5);
    picture_free(&first);
    picture_free(&second);
    picture_free(&third);
    patina_scene_destroy(a);
    patina_scene_destroy(b);
    patina_scene_destroy(c);
    patina_mask_destroy(mask);
    patina_cloud_destroy(two);
    patina_cloud_destroy(one);
}

static void test_sifted(void **state)
{
    (void)state;
    support_each_device(sifted);
}

// A radius of the points' own distances: the same picture in millimetres and metres.
static void units(patina_device *device, const char *name)
{
    struct picture pictures[2];
    for (int k = 0; k < 2; k++) {
        const double s = k ? 1000.0 : 1.0, eye[3] = {0.0, -4.0 * s, 1.0 * s}, target[3] = {0};
        struct points torus = points_torus(20000, s, 0.4 * s, POINTS_ALL, 8);
        patina_cloud *cloud = points_upload(&torus);
        patina_cloud_style style = soft_style(PATINA_SOFT_BASE);
        style.soft_opacity = 0.5f;
        patina_scene *scene = scene_of(cloud, &style);
        const patina_camera camera = camera_perspective(eye, target, 45.0, WIDTH, HEIGHT, 0.1 * s, 100.0 * s);
        patina_settings settings = settings_default(WIDTH, HEIGHT);
        settings.film_transparent = 1;
        pictures[k] = picture_render(device, scene, &camera, &settings);
        patina_scene_destroy(scene);
        patina_cloud_destroy(cloud);
        points_free(&torus);
    }
    double sum = 0.0, seen = 0.0;
    for (uint32_t i = 3; i < 4 * WIDTH * HEIGHT; i += 4) { // colours of this torus depend on its size
        sum += fabs((double)pictures[0].combined[i] - (double)pictures[1].combined[i]);
        seen += (double)pictures[0].combined[i];
    }
    printf("  %s, m and mm: %.2g, of %.2g\n", name, sum / (WIDTH * HEIGHT), seen / (WIDTH * HEIGHT));
    assert_true(seen > 0.05 * WIDTH * HEIGHT);
    assert_true(sum <= 1e-3 * seen);
    picture_free(&pictures[0]);
    picture_free(&pictures[1]);
}

static void test_units(void **state)
{
    (void)state;
    support_each_device(units);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_quadrature), cmocka_unit_test(test_cut),   cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_sifted),     cmocka_unit_test(test_units),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
