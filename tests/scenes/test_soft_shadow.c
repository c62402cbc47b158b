// SPDX-License-Identifier: GPL-3.0-or-later
// Shadows of soft points and on them: what comes through up to each point, against the integral of the density in float64 along the
// light's ray; on every device. SPEC 5.
#include "clouds.h"
#include "meshes.h"
#include "support.h"

#include "reference.h"
#include "shared/balls.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 64, HEIGHT = 48, TORUS = 3000, PROBES = 6000 };

static const float opacity = 0.25f, radius = 0.12f;

static patina_cloud_style soft_style(uint32_t model)
{
    patina_cloud_style style = PATINA_CLOUD_STYLE_INIT;
    style.soft = PATINA_SOFT_ALL;
    style.soft_model = model;
    style.soft_opacity = opacity;
    style.soft_radius = radius;
    style.soft_shells = model == PATINA_SOFT_CONCENTRIC ? 12 : 0;
    style.lighting = PATINA_LIGHTING_LIT;
    return style;
}

static patina_light_desc light_of(int which)
{
    patina_light_desc light = {.struct_size = sizeof light, .type = PATINA_LIGHT_SUN, .power = 3.0f, .shadows = 1};
    const double sun[3] = {0.4, 0.3, -1.0}, lamp[3] = {1.5, -1.0, 2.5}, inside[3] = {0.9, 0.1, 0.05};
    memcpy(light.direction, sun, sizeof sun);
    if (which) {
        light.type = PATINA_LIGHT_POINT;
        memcpy(light.position, which == 1 ? lamp : inside, sizeof lamp);
    }
    return light;
}

// A soft torus, or one ball; probes: points everywhere about it, or before and behind that ball, which take shadows and cast none.
struct stage {
    struct points torus, probe;
    patina_cloud *soft, *probes;
    patina_scene *scene;
};

static void strew(struct points *probe)
{
    struct pcg random = pcg_seed(3);
    for (uint64_t i = 0; i < PROBES; i++) {
        for (int k = 0; k < 2; k++)
            probe->position[3 * i + (uint64_t)k] = (float)pcg_between(&random, -1.8, 1.8);
        probe->position[3 * i + 2] = (float)pcg_between(&random, -0.9, 0.7);
        probe->normal[3 * i + 2] = 1.0f;
    }
}

// Along the light's ray through the ball's middle, from two radii before it to eight behind it.
static void strew_along(struct points *probe, const float *ball, const patina_light_desc *light)
{
    struct pcg random = pcg_seed(3);
    double ray[3], length = 0.0;
    for (int k = 0; k < 3; k++) {
        ray[k] = light->type == PATINA_LIGHT_SUN ? light->direction[k] : (double)ball[k] - light->position[k];
        length += ray[k] * ray[k];
    }
    for (uint64_t i = 0; i < PROBES; i++) {
        const double along = pcg_between(&random, -2.0, 8.0) * (double)radius / sqrt(length);
        for (uint64_t k = 0; k < 3; k++)
            probe->position[3 * i + k] = (float)((double)ball[k] + along * ray[k] +
                                                 pcg_between(&random, -1.0, 1.0) * (double)radius);
        probe->normal[3 * i + 2] = 1.0f;
    }
}

static struct stage set_of(uint32_t model, const patina_light_desc *light, uint64_t balls)
{
    struct stage stage = {points_torus(balls, 1.0, 0.4, POINTS_ALL, 6), points_create(PROBES, POINTS_NORMALS), NULL, NULL,
                          NULL};
    if (balls > 1)
        strew(&stage.probe);
    else
        strew_along(&stage.probe, stage.torus.position, light);
    stage.soft = points_upload(&stage.torus);
    stage.probes = points_upload(&stage.probe);
    patina_cloud_style style = soft_style(model), bare = PATINA_CLOUD_STYLE_INIT;
    bare.lighting = PATINA_LIGHTING_LIT;
    bare.shadow_off = PATINA_SHADOW_NO_CAST;
    stage.scene = scene_of(stage.probes, &bare);
    CHECK(patina_scene_add_cloud(stage.scene, stage.soft, &style), stage.scene);
    CHECK(patina_scene_add_light(stage.scene, light), stage.scene);
    return stage;
}

static struct stage set(uint32_t model, const patina_light_desc *light) { return set_of(model, light, TORUS); }

static void strike(struct stage *stage)
{
    patina_scene_destroy(stage->scene);
    patina_cloud_destroy(stage->soft);
    patina_cloud_destroy(stage->probes);
    points_free(&stage->torus);
    points_free(&stage->probe);
}

static float *bake(patina_device *device, patina_scene *scene, uint32_t instance, uint64_t count, uint32_t samples)
{
    patina_settings settings = settings_default(WIDTH, HEIGHT);
    patina_frame *frame = NULL;
    float *values = malloc(count * sizeof *values);
    settings.shadow_samples = samples;
    assert_non_null(values);
    CHECK(patina_scene_set_settings(scene, &settings), scene);
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_frame_bake_shadows(frame, scene), frame);
    CHECK(patina_frame_read_shadows(frame, instance, 0, values, count * sizeof *values), frame);
    patina_frame_destroy(frame);
    return values;
}

// What comes from the light to a point through all balls of the torus: no map, no slabs.
static double arrives(const struct points *torus, const patina_light_desc *light, const float *to, uint32_t model)
{
    double from[3], ray[3], length = 0.0, sum = 0.0;
    for (int k = 0; k < 3; k++) {
        from[k] = light->type == PATINA_LIGHT_SUN ? (double)to[k] - 50.0 * light->direction[k] : light->position[k];
        ray[k] = (double)to[k] - from[k];
        length += ray[k] * ray[k];
    }
    length = sqrt(length);
    for (uint64_t i = 0; i < torus->count; i++) {
        double along = 0.0, apart = 0.0;
        for (int k = 0; k < 3; k++) {
            const double off = (double)torus->position[3 * i + (uint64_t)k] - from[k];
            along += off * ray[k] / length;
            apart += off * off;
        }
        const double d = sqrt(fmax(apart - along * along, 0.0)) / (double)radius;
        if (d >= 1.0 || along + (double)radius < 0.0 || along - (double)radius > length)
            continue;
        if (model == PATINA_SOFT_EXPRESS) { // evenly over its depth
            const double share = fmin(fmax((length - along) / (2.0 * (double)radius) + 0.5, 0.0), 1.0) -
                                 fmin(fmax((0.0 - along) / (2.0 * (double)radius) + 0.5, 0.0), 1.0);
            sum -= share * log1p(-ref_soft_disc(d * d, (double)opacity, 1.0));
            continue;
        }
        const struct ref_soft_model as = {model == PATINA_SOFT_BASE ? PT_SOFT_BASE : PT_SOFT_CONCENTRIC, PT_SOFT_EVEN};
        const struct ref_ball ball = {
            .d = d, .along = along, .r = (double)radius, .a = (double)opacity, .w = 1.0, .shells = 12};
        sum -= log(ref_soft_ray(&ball, 1, &as, 0.0, length).through);
    }
    return exp(-sum);
}

struct errors {
    double worst, mean, dark; // dark: share of points that lose a tenth or more
};

static struct errors compare(const struct stage *stage, const patina_light_desc *light, uint32_t model, const float *got,
                             const struct points *points)
{
    struct errors errors = {0};
    uint64_t count = 0;
    for (uint64_t i = 0; i < points->count; i += 3) {
        const double is = arrives(&stage->torus, light, points->position + 3 * i, model), off = fabs((double)got[i] - is);
        errors.worst = fmax(errors.worst, off);
        errors.mean += off;
        errors.dark += is < 0.9;
        count++;
    }
    errors.mean /= (double)count;
    errors.dark /= (double)count;
    return errors;
}

static void hold(patina_device *device, const char *name)
{
    static const char *const lights[] = {"sun", "lamp", "lamp inside"};
    for (uint32_t model = 0; model < 3; model++)
        for (int which = 0; which < 3; which++) {
            const patina_light_desc light = light_of(which);
            struct stage stage = set(model, &light);
            for (uint32_t instance = 0; instance < 2; instance++) {
                const struct points *points = instance ? &stage.torus : &stage.probe;
                float *got = bake(device, stage.scene, instance, points->count, 1);
                const struct errors errors = compare(&stage, &light, model, got, points);
                printf("  %s, %s, model %u, on %s: %.3f at most, %.4f in the mean; %.0f%% of the points in shadow\n", name,
                       lights[which], model, instance == 1 ? "soft points" : "solid points", errors.worst, errors.mean,
                       100.0 * errors.dark);
                assert_true(errors.dark > 0.2);
                assert_true(errors.mean <= 0.01 && errors.worst <= 0.2);
                free(got);
            }
            strike(&stage);
        }
}

static void test_truth(void **state)
{
    (void)state;
    support_each_device(hold);
}

// One ball alone, whose middle is all that the light's map has to see: its depths hold the ball.
static void hold_one(patina_device *device, const char *name)
{
    for (uint32_t model = 0; model < 3; model++)
        for (int which = 0; which < 3; which++) {
            const patina_light_desc light = light_of(which);
            struct stage stage = set_of(model, &light, 1);
            float *got = bake(device, stage.scene, 0, PROBES, 1);
            const struct errors errors = compare(&stage, &light, model, got, &stage.probe);
            printf("  %s, light %d, model %u, one ball: %.3f at most, %.4f in the mean; %.0f%% of the points in shadow\n", name,
                   which, model, errors.worst, errors.mean, 100.0 * errors.dark);
            assert_true(errors.dark > 0.1);
            assert_true(errors.mean <= 0.006 && errors.worst <= 0.03);
            free(got);
            strike(&stage);
        }
}

static void test_one_ball(void **state)
{
    (void)state;
    support_each_device(hold_one);
}

// Devices agree to a step of 255 and how many samples there are of it.
static void test_devices(void **state)
{
    (void)state;
    for (uint32_t model = 0; model < 3; model++) {
        patina_light_desc light = light_of(0);
        light.angle = 0.2f;
        struct stage stage = set(model, &light);
        float *first = NULL;
        for (uint32_t k = 0; k < support_device_count(); k++) {
            patina_device *device = support_device_open(support_device_name(k), 0, 0);
            if (!device)
                continue;
            float *got = bake(device, stage.scene, 0, PROBES, 4);
            double worst = 0.0;
            for (uint64_t i = 0; i < PROBES && first; i++)
                worst = fmax(worst, fabs((double)got[i] - (double)first[i]));
            printf("  model %u, %s: %.5f\n", model, support_device_name(k), worst);
            assert_true(worst <= 1.01 / 255.0);
            free(first);
            first = got;
            patina_device_destroy(device);
        }
        free(first);
        strike(&stage);
    }
}

// The same bytes for any number of threads.
static void test_threads(void **state)
{
    (void)state;
    const patina_light_desc light = light_of(1);
    struct stage stage = set(PATINA_SOFT_BASE, &light);
    float *first = NULL;
    for (uint32_t threads = 1; threads < 6; threads += 2) {
        patina_device *device = support_device_open("cpu", threads, threads % 3);
        float *got = bake(device, stage.scene, 0, PROBES, 1);
        if (first)
            assert_memory_equal(got, first, PROBES * sizeof *got);
        free(first);
        first = got;
        patina_device_destroy(device);
    }
    free(first);
    strike(&stage);
}

static char *plan_text(patina_device *device, patina_scene *scene)
{
    patina_frame *frame = NULL;
    CHECK(patina_frame_create(device, &frame), device);
    const size_t size = patina_frame_plan_text(frame, scene, NULL, 0) + 1;
    char *text = malloc(size);
    assert_non_null(text);
    patina_frame_plan_text(frame, scene, text, size);
    patina_frame_destroy(frame);
    return text;
}

// Soft points that cast nothing change nothing; those that cast nothing to themselves are as light as without.
static void test_switches(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    const patina_light_desc light = light_of(0);
    const double eye[3] = {0.5, -4.0, 2.0}, target[3] = {0};
    const patina_camera camera = camera_perspective(eye, target, 45.0, WIDTH, HEIGHT, 0.1, 100.0);
    struct stage stage = set(PATINA_SOFT_BASE, &light);
    for (int k = 0; k < 3; k++) {
        patina_cloud_style style = soft_style(PATINA_SOFT_BASE), bare = PATINA_CLOUD_STYLE_INIT;
        style.shadow_off = k == 0 ? PATINA_SHADOW_NO_CAST : k == 1 ? PATINA_SHADOW_NO_SELF : 0;
        bare.lighting = PATINA_LIGHTING_LIT;
        bare.shadow_off = PATINA_SHADOW_NO_CAST;
        patina_scene_clear(stage.scene);
        CHECK(patina_scene_add_cloud(stage.scene, stage.probes, &bare), stage.scene);
        CHECK(patina_scene_add_cloud(stage.scene, stage.soft, &style), stage.scene);
        CHECK(patina_scene_add_light(stage.scene, &light), stage.scene);
        float *probes = bake(device, stage.scene, 0, PROBES, 1), *own = bake(device, stage.scene, 1, TORUS, 1);
        CHECK(patina_scene_set_camera(stage.scene, &camera), stage.scene);
        char *text = plan_text(device, stage.scene);
        uint64_t dark[2] = {0};
        for (uint64_t i = 0; i < PROBES; i++)
            dark[0] += probes[i] < 0.95f;
        for (uint64_t i = 0; i < TORUS; i++)
            dark[1] += own[i] < 0.95f;
        printf("  %s: %llu probes and %llu soft points in shadow\n",
               k == 0   ? "no cast"
               : k == 1 ? "no self"
                        : "as ever",
               (unsigned long long)dark[0], (unsigned long long)dark[1]);
        assert_true(k == 0 ? !dark[0] && !strstr(text, "run  dim") : dark[0] > PROBES / 5 && strstr(text, "run  dim"));
        assert_true(k < 2 ? !dark[1] : dark[1] > TORUS / 2);
        free(text);
        free(probes);
        free(own);
    }
    strike(&stage);
    patina_device_destroy(device);
}

// A roof of points between the sun and soft points: their picture gets dark; and a mesh below soft points does, as much as these let through.
static void pictures(patina_device *device, const char *name)
{
    const double eye[3] = {0.5, -4.0, 2.0}, target[3] = {0}, low[3] = {0, 0, -1.2}, wide[3] = {4, 4, 0.05};
    const patina_camera camera = camera_perspective(eye, target, 45.0, WIDTH, HEIGHT, 0.1, 100.0);
    patina_settings settings = settings_default(WIDTH, HEIGHT);
    patina_light_desc light = light_of(0);
    light.direction[0] = light.direction[1] = 0.0;
    struct points above = points_rectangle(40000, 8.0, 8.0, POINTS_NORMALS, 8);
    for (uint64_t i = 0; i < above.count; i++)
        above.position[3 * i + 2] = 6.0f; // beyond the picture
    patina_cloud *roof = points_upload(&above);
    patina_mesh *floor = mesh_box(low, wide);
    double sums[4] = {0};
    for (int k = 0; k < 4; k++) { // as it is, with a roof; a floor without and with soft points over it
        struct stage stage = set(PATINA_SOFT_EXPRESS, &light);
        const patina_cloud_style style = soft_style(PATINA_SOFT_EXPRESS);
        patina_scene_clear(stage.scene);
        if (k != 2)
            CHECK(patina_scene_add_cloud(stage.scene, stage.soft, &style), stage.scene);
        if (k == 1)
            CHECK(patina_scene_add_cloud(stage.scene, roof, NULL), stage.scene);
        else if (k)
            mesh_add(stage.scene, floor, 0.8f, 0.8f, 0.8f);
        CHECK(patina_scene_add_light(stage.scene, &light), stage.scene);
        settings.passes = 1u << PATINA_PASS_COMBINED | 1u << PATINA_PASS_SHADOW;
        patina_frame *frame = NULL;
        static float combined[4 * WIDTH * HEIGHT], shadow[WIDTH * HEIGHT];
        CHECK(patina_scene_set_camera(stage.scene, &camera), stage.scene);
        CHECK(patina_scene_set_settings(stage.scene, &settings), stage.scene);
        CHECK(patina_frame_create(device, &frame), device);
        CHECK(patina_frame_render(frame, stage.scene), frame);
        CHECK(patina_frame_read(frame, PATINA_PASS_COMBINED, combined, sizeof combined), frame);
        CHECK(patina_frame_read(frame, PATINA_PASS_SHADOW, shadow, sizeof shadow), frame);
        for (uint32_t i = 0; i < WIDTH * HEIGHT; i++)
            sums[k] += k < 2 ? (double)combined[4 * i] : (double)shadow[i] / (WIDTH * HEIGHT);
        patina_frame_destroy(frame);
        strike(&stage);
    }
    printf("  %s: red %.1f in the sun, %.1f below a roof; %.3f of the light on a floor, %.3f below soft points\n", name,
           sums[0], sums[1], sums[2], sums[3]);
    assert_true(sums[1] < 0.7 * sums[0]);
    assert_true(sums[2] > 0.999 && sums[3] < 0.97 && sums[3] > 0.5);
    patina_cloud_destroy(roof);
    points_free(&above);
    patina_mesh_destroy(floor);
}

static void test_pictures(void **state)
{
    (void)state;
    support_each_device(pictures);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_truth),   cmocka_unit_test(test_one_ball), cmocka_unit_test(test_devices),
        cmocka_unit_test(test_threads), cmocka_unit_test(test_switches), cmocka_unit_test(test_pictures),
    };
    support_arguments(argc, argv);
    return cmocka_run_group_tests_name("soft shadows", tests, NULL, NULL);
}
