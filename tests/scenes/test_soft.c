// SPDX-License-Identifier: GPL-3.0-or-later
// Soft points through whole frames: against numerical quadrature of their density and the references of tests/reference/soft.c, before
// and behind what is opaque, in parts, regions and with any number of threads, on every device. SPEC 5.
#include "clouds.h"
#include "support.h"

#include "reference.h"
#include "shared/balls.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 96, HEIGHT = 72, BALLS = 10 };

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

static const float background[3] = {0.1f, 0.2f, 0.4f};

static struct scene scene_at(int which)
{
    const struct ball one = {{0.0, 0.0, 0.0}, 1.0, 0.902, {1.0f, 0.5f, 0.1f}};
    struct scene scene = {.name = "one", .count = 1, .eye = {0.3, -4.0, 0.7}, .balls = {one}};
    if (which == 1) {
        scene.name = "two";
        scene.count = 2;
        scene.balls[1] = (struct ball){{0.5, 0.8, 0.25}, 1.25, 0.6, {0.0f, 0.2f, 1.0f}};
    } else if (which == 2) {
        scene.name = "ten";
        scene.count = BALLS;
        for (int i = 0; i < BALLS; i++)
            scene.balls[i] = (struct ball){{0.4 * sin(i), -1.6 + 0.4 * i, 0.4 * cos(2.0 * i)},
                                           0.5 + 0.0625 * i,
                                           0.05 + 0.09 * i,
                                           {(float)(i % 2), 0.5f * (float)(i % 3), 0.25f * (float)(i % 5)}};
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

static patina_cloud_style soft_style(uint32_t model)
{
    patina_cloud_style style = PATINA_CLOUD_STYLE_INIT;
    style.soft = PATINA_SOFT_ALL;
    style.soft_model = model;
    style.soft_opacity = 1.0f;
    style.lighting = PATINA_LIGHTING_UNLIT;
    return style;
}

static patina_settings plain_settings(void)
{
    patina_settings settings = settings_default(WIDTH, HEIGHT);
    settings.own_background = 1;
    memcpy(settings.background, background, sizeof background);
    return settings;
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
    patina_cloud_destroy(cloud);
}

static void hold_all(patina_device *device, const char *name)
{
    static const double scales[] = {1.0, 0x1p-10, 0x1p10}; // radii stay what a field holds
    for (int which = 0; which < 4; which++)
        for (uint32_t model = 0; model < 3; model++) {
            hold(device, name, which, 0, model, 1.0, 0.0f);
            hold(device, name, which, 1, model, 1.0, 0.0f);
        }
    for (int k = 1; k < 3; k++)
        hold(device, name, 2, 0, PATINA_SOFT_BASE, scales[k], 0.0f);
    hold(device, name, 1, 0, PATINA_SOFT_BASE, 1.0, 0.6f);
    hold(device, name, 1, 0, PATINA_SOFT_EXPRESS, 1.0, 1.0f);
}

static void test_quadrature(void **state)
{
    (void)state;
    support_each_device(hold_all);
}

// ---- among others ----------------------------------------------------------------------------------------------------------

struct mixed {
    patina_cloud *wall, *soft;
    patina_scene *scene, *bare;
    patina_camera camera;
    patina_settings settings;
};

// A wall at y = 0.6 that covers the left half of the picture, and a soft torus around it.
static struct mixed mix(uint64_t count, uint32_t model, double move)
{
    struct mixed mixed = {.settings = settings_default(WIDTH, HEIGHT)};
    struct points wall = points_rectangle(60000, 3.0, 6.0, POINTS_ALL, 5), torus = points_torus(count, 1.0, 0.4, POINTS_ALL, 6);
    const double turned[9] = {1, 0, 0, 0, 0, -1, 0, 1, 0}, left[3] = {-1.5, 0.6, 0.0}, moved[3] = {0.0, move, 0.0};
    const double same[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    points_transform(&wall, turned, left);
    points_transform(&torus, same, moved);
    mixed.wall = points_upload(&wall);
    mixed.soft = points_upload(&torus);
    mixed.scene = scene_of(mixed.wall, NULL);
    mixed.bare = scene_of(mixed.wall, NULL);
    patina_cloud_style style = soft_style(model);
    style.soft_opacity = 0.3f;
    style.soft_radius = 0.05f;
    style.lighting = PATINA_LIGHTING_LIT;
    CHECK(patina_scene_add_cloud(mixed.scene, mixed.soft, &style), mixed.scene);
    const patina_light_desc sun = {
        .struct_size = sizeof sun, .type = PATINA_LIGHT_SUN, .power = 3.0f, .direction = {0.4, 0.5, -1.0}, .shadows = 1};
    CHECK(patina_scene_add_light(mixed.scene, &sun), mixed.scene);
    CHECK(patina_scene_add_light(mixed.bare, &sun), mixed.bare);
    const double eye[3] = {0.2, -4.0, 1.0}, target[3] = {0};
    mixed.camera = camera_perspective(eye, target, 45.0, WIDTH, HEIGHT, 0.1, 100.0);
    points_free(&wall);
    points_free(&torus);
    return mixed;
}

static void mixed_free(struct mixed *mixed)
{
    patina_scene_destroy(mixed->scene);
    patina_scene_destroy(mixed->bare);
    patina_cloud_destroy(mixed->wall);
    patina_cloud_destroy(mixed->soft);
}

static struct picture draw(patina_device *device, const struct mixed *mixed, int bare)
{
    return picture_render(device, bare ? mixed->bare : mixed->scene, &mixed->camera, &mixed->settings);
}

static int same_color(const struct picture *a, const struct picture *b, uint32_t i)
{
    return !memcmp(a->combined + 4 * (size_t)i, b->combined + 4 * (size_t)i, 16);
}

// Keys, depth and other passes are those of the wall; what lies behind the wall does not show, what lies before it does.
static void stand(patina_device *device, const char *name)
{
    for (int before = 0; before < 2; before++) {
        struct mixed mixed = mix(3000, PATINA_SOFT_BASE, before ? -1.2 : 2.8);
        struct picture with = draw(device, &mixed, 0), without = draw(device, &mixed, 1);
        uint32_t wall = 0, changed = 0, beside = 0;
        assert_memory_equal(with.keys, without.keys, (size_t)WIDTH * HEIGHT * 8);
        assert_memory_equal(with.depth, without.depth, (size_t)WIDTH * HEIGHT * 4);
        assert_memory_equal(with.normal, without.normal, (size_t)WIDTH * HEIGHT * 12);
        for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
            const int covered = without.keys[i] != KEY_EMPTY, other = !same_color(&with, &without, i);
            wall += (uint32_t)covered;
            changed += (uint32_t)(covered && other);
            beside += (uint32_t)(!covered && other);
        }
        printf("  %s, soft points %s the wall: %u of %u pixels of it changed, %u beside it\n", name,
               before ? "before" : "behind", changed, wall, beside);
        assert_true(wall > WIDTH * HEIGHT / 4 && beside > 150);
        assert_true(before ? changed > 300 : changed == 0);
        picture_free(&with);
        picture_free(&without);
        mixed_free(&mixed);
    }
}

static void test_wall(void **state)
{
    (void)state;
    support_each_device(stand);
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

// ---- one result ----------------------------------------------------------------------------------------------------------

static void test_threads(void **state)
{
    (void)state;
    for (uint32_t model = 0; model < 3; model++) {
        struct mixed mixed = mix(20000, model, 0.0);
        struct picture first = {0};
        for (uint32_t threads = 1; threads <= 7; threads += threads < 3 ? 1 : 4) {
            patina_device *device = support_device_open("cpu", threads, threads % 3);
            struct picture picture = draw(device, &mixed, 0);
            if (first.keys) {
                picture_assert_identical(&picture, &first, 0, 0, "soft points, threads");
                picture_free(&picture);
            } else {
                first = picture;
            }
            patina_device_destroy(device);
        }
        picture_free(&first);
        mixed_free(&mixed);
    }
}

static void compare_regions(patina_device *device, struct mixed *mixed, uint32_t across, uint32_t up, const char *what)
{
    struct picture whole = draw(device, mixed, 0);
    for (uint32_t y = 0; y < HEIGHT; y += up)
        for (uint32_t x = 0; x < WIDTH; x += across) {
            const uint32_t region[4] = {x, y, x + across < WIDTH ? x + across : WIDTH, y + up < HEIGHT ? y + up : HEIGHT};
            memcpy(mixed->settings.region, region, sizeof region);
            struct picture part = draw(device, mixed, 0);
            picture_assert_identical(&part, &whole, x, y, what);
            picture_free(&part);
        }
    memset(mixed->settings.region, 0, sizeof mixed->settings.region);
    picture_free(&whole);
}

static void regions(patina_device *device, const char *name)
{
    for (uint32_t model = 0; model < 3; model++) {
        struct mixed mixed = mix(4000, model, 0.0);
        compare_regions(device, &mixed, support_is_gl(name) ? 61 : 23, support_is_gl(name) ? 40 : 17, name);
        mixed_free(&mixed);
    }
}

static void test_regions(void **state)
{
    (void)state;
    support_each_device(regions);
}

static void test_devices(void **state)
{
    (void)state;
    for (uint32_t model = 0; model < 3; model++) {
        struct mixed mixed = mix(4000, model, 0.0);
        struct picture first = {0};
        for (uint32_t k = 0; k < support_device_count(); k++) {
            patina_device *device = support_device_open(support_device_name(k), 0, 0);
            if (!device)
                continue;
            struct picture picture = draw(device, &mixed, 0);
            double worst = 0.0;
            for (uint32_t i = 0; i < 4 * WIDTH * HEIGHT && first.keys; i++)
                worst = fmax(worst, fabs((double)picture.combined[i] - (double)first.combined[i]));
            printf("  model %u, %s: %.2g\n", model, support_device_name(k), worst);
            assert_true(worst <= 5e-4);
            if (first.keys) {
                assert_memory_equal(picture.keys, first.keys, (size_t)WIDTH * HEIGHT * 8);
                picture_free(&picture);
            } else {
                first = picture;
            }
            patina_device_destroy(device);
        }
        picture_free(&first);
        mixed_free(&mixed);
    }
}

// ---- parts ---------------------------------------------------------------------------------------------------------------

static size_t count_parts(patina_device *device, const struct mixed *mixed)
{
    patina_frame *frame = NULL;
    size_t count = 0;
    CHECK(patina_scene_set_camera(mixed->scene, &mixed->camera), mixed->scene);
    CHECK(patina_scene_set_settings(mixed->scene, &mixed->settings), mixed->scene);
    CHECK(patina_frame_create(device, &frame), device);
    const size_t size = patina_frame_plan_text(frame, mixed->scene, NULL, 0) + 1;
    char *text = malloc(size);
    assert_non_null(text);
    patina_frame_plan_text(frame, mixed->scene, text, size);
    for (const char *at = text; (at = strstr(at, ", part ")); at++)
        count++;
    free(text);
    patina_frame_destroy(frame);
    return count;
}

enum { POINTS = 2500000, SHOWN = 50 }; // one of so many is not hidden

// The number behind the word in the JSON of a frame's statistics.
static uint64_t told(const char *json, const char *word)
{
    const char *at = strstr(json, word);
    assert_non_null(at);
    return strtoull(at + strlen(word), NULL, 10);
}

// Memory stays what a part takes, and is told.
static void check_memory(patina_device *device, const struct mixed *many, size_t parts)
{
    static char json[65536];
    patina_frame *frame = NULL;
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_frame_render(frame, many->scene), frame);
    assert_true(patina_frame_stats_json(frame, json, sizeof json) < sizeof json);
    const uint64_t records = told(json, "\"records\":"), peak = told(json, "\"peak\":");
    printf("  %llu records in the largest part, %llu bytes of planes\n", (unsigned long long)records, (unsigned long long)peak);
    assert_int_equal(told(json, "\"parts\":"), parts);
    assert_true(records >= POINTS / 4 && records <= 1u << 21);
    assert_true(peak >= 80 * records && peak <= 80 * records + 256 * WIDTH * HEIGHT);
    patina_frame_destroy(frame);
}

// More records than a part takes: slabs of depth, which borders share; and what comes through is the product of all.
static void test_parts(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    if (support_is_gl(support_device_name(0)))
        skip();
    for (uint32_t model = PATINA_SOFT_BASE; model <= PATINA_SOFT_EXPRESS; model += 2) {
        struct mixed many = mix(POINTS, model, 0.0);
        patina_mask *mask = NULL;
        uint8_t *hidden = calloc(POINTS / 8, 1);
        assert_non_null(hidden);
        for (uint32_t i = 0; i < POINTS; i++)
            hidden[i / 8] |= (uint8_t)((i % SHOWN != 0) << i % 8);
        CHECK(patina_mask_create(many.soft, hidden, NULL, POINTS / 8, &mask), NULL);
        free(hidden);
        patina_scene_clear(many.scene);
        patina_cloud_style style = soft_style(model);
        style.soft_opacity = 0.05f;
        style.soft_radius = 0.08f;
        style.mask = mask;
        CHECK(patina_scene_add_cloud(many.scene, many.soft, &style), many.scene);
        many.settings.film_transparent = 1;
        const size_t parts = count_parts(device, &many);
        printf("  model %u: %zu parts\n", model, parts);
        assert_true(parts > 1);
        check_memory(device, &many, parts);
        compare_regions(device, &many, 61, 72, "parts");
        struct picture picture = draw(device, &many, 0);
        struct points torus = points_torus(POINTS, 1.0, 0.4, POINTS_ALL, 6);
        const struct ref_soft_model base = {PT_SOFT_BASE, PT_SOFT_EVEN};
        double worst = 0.0, sums_off = 0.0;
        for (uint32_t k = 0; k < 12 && model == PATINA_SOFT_BASE; k++) {
            const uint32_t x = 7 + 7 * k, y = 12 + 4 * k;
            double origin[3], ray[3], through = 1.0, density = 0.0;
            camera_ray(&many.camera, WIDTH, HEIGHT, x + 0.5, y + 0.5, origin, ray);
            const double square = ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2];
            for (uint64_t i = 0; i < torus.count; i += SHOWN) {
                double along = 0.0, apart = 0.0;
                for (int c = 0; c < 3; c++) {
                    const double off = (double)torus.position[3 * i + c] - origin[c];
                    along += ray[c] * off;
                    apart += off * off;
                }
                const double d = sqrt(fmax(apart - along * along / square, 0.0)) / 0.08;
                if (d >= 1.0)
                    continue;
                struct ref_ball ball = {.d = d, .along = 2.0, .r = 0.08, .a = 0.05, .w = 1.0};
                const struct ref_soft alone = ref_soft_ray(&ball, 1, &base, 0.0, 100.0);
                through *= alone.through;
                density += alone.density;
            }
            sums_off = fmax(sums_off, fabs((double)picture.density[y * WIDTH + x] - density) / fmax(density, 1.0));
            worst = fmax(worst, fabs(1.0 - through - (double)picture.combined[4 * (y * WIDTH + x) + 3]));
        }
        printf("  model %u: %.2g from the product, density off by %.2g\n", model, worst, sums_off);
        assert_true(worst <= 3e-4 && sums_off <= 1e-4);
        points_free(&torus);
        picture_free(&picture);
        mixed_free(&many);
        patina_mask_destroy(mask);
    }
    patina_device_destroy(device);
}

// ---- behind glass ---------------------------------------------------------------------------------------------------------

struct glass {
    struct mixed mixed;
    patina_scene *soft; // without the wall
};

static struct glass glaze(uint32_t model, double move, float transparency)
{
    struct glass glass = {mix(3000, model, move), NULL};
    patina_scene *scenes[] = {glass.mixed.scene, glass.mixed.bare};
    patina_cloud_style wall = {.struct_size = sizeof wall, .transparency = transparency, .lighting = PATINA_LIGHTING_UNLIT};
    patina_cloud_style soft = soft_style(model);
    soft.soft_opacity = 0.3f;
    soft.soft_radius = 0.05f;
    soft.lighting = PATINA_LIGHTING_UNLIT;
    for (int k = 0; k < 2; k++) {
        patina_scene_clear(scenes[k]);
        CHECK(patina_scene_add_cloud(scenes[k], glass.mixed.wall, &wall), scenes[k]);
    }
    CHECK(patina_scene_add_cloud(glass.mixed.scene, glass.mixed.soft, &soft), glass.mixed.scene);
    glass.soft = scene_of(glass.mixed.soft, &soft);
    glass.mixed.settings = plain_settings();
    return glass;
}

static void glass_free(struct glass *glass)
{
    mixed_free(&glass->mixed);
    patina_scene_destroy(glass->soft);
}

// Whether pixels beside one are of the wall where it is not, or the reverse: colours are mixed there.
static int is_edge(const struct picture *pane, uint32_t x, uint32_t y)
{
    const int own = pane->keys[y * WIDTH + x] == KEY_EMPTY;
    int edge = 0;
    for (uint32_t k = 0; k < 25; k++)
        edge |= own != (pane->keys[(y + k / 5 - 2) * WIDTH + x + k % 5 - 2] == KEY_EMPTY);
    return edge;
}

// What lies behind a pane changes colours as without the pane, times what the pane lets through.
static void see_through(patina_device *device, const char *name)
{
    for (uint32_t model = 0; model < 3; model++) {
        struct glass glass = glaze(model, 2.8, 0.5f);
        struct picture both = draw(device, &glass.mixed, 0), pane = draw(device, &glass.mixed, 1);
        struct picture soft = picture_render(device, glass.soft, &glass.mixed.camera, &glass.mixed.settings);
        double worst = 0.0;
        uint32_t seen = 0;
        for (uint32_t y = 2; y + 2 < HEIGHT; y++)
            for (uint32_t x = 2; x + 2 < WIDTH; x++) {
                const uint32_t i = y * WIDTH + x;
                const double through = pane.keys[i] == KEY_EMPTY ? 1.0 : 0.5;
                for (int c = 0; c < 3 && !is_edge(&pane, x, y); c++) {
                    const double change = (double)soft.combined[4 * i + c] - (double)background[c];
                    worst = fmax(worst,
                                 fabs((double)pane.combined[4 * i + c] + through * change - (double)both.combined[4 * i + c]));
                    seen += through < 1.0 && fabs(change) > 0.02;
                }
            }
        printf("  %s, model %u behind a pane: off by %.2g at most, %u values seen through it\n", name, model, worst, seen);
        assert_true(seen > 300);
        assert_true(worst <= 2e-3);
        picture_free(&both);
        picture_free(&pane);
        picture_free(&soft);
        glass_free(&glass);
    }
}

// A pane that is hardly there changes nothing, though it divides the balls: none is lost, none counts twice.
static void divide(patina_device *device, const char *name)
{
    for (uint32_t model = 0; model < 3; model++) {
        struct glass glass = glaze(model, 0.6, 0.999f);
        struct picture both = draw(device, &glass.mixed, 0);
        struct picture soft = picture_render(device, glass.soft, &glass.mixed.camera, &glass.mixed.settings);
        double worst = 0.0;
        for (uint32_t i = 0; i < 4 * WIDTH * HEIGHT; i++)
            worst = fmax(worst, fabs((double)both.combined[i] - (double)soft.combined[i]));
        printf("  %s, model %u divided by a pane: off by %.2g at most\n", name, model, worst);
        assert_true(worst <= 4e-3);
        picture_free(&both);
        picture_free(&soft);
        glass_free(&glass);
    }
}

static void test_glass(void **state)
{
    (void)state;
    support_each_device(see_through);
    support_each_device(divide);
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
    style.soft = 3;
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
        cmocka_unit_test(test_quadrature), cmocka_unit_test(test_wall),    cmocka_unit_test(test_glass),
        cmocka_unit_test(test_cut),        cmocka_unit_test(test_threads), cmocka_unit_test(test_regions),
        cmocka_unit_test(test_devices),    cmocka_unit_test(test_parts),   cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_sifted),     cmocka_unit_test(test_units),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
