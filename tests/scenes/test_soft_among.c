// SPDX-License-Identifier: GPL-3.0-or-later
// Soft points among what is opaque and behind glass; one result in parts, in regions and with any number of threads, on every device.
// SPEC 5.
#include "clouds.h"
#include "soft.h"

#include "reference.h"
#include "shared/balls.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_wall),    cmocka_unit_test(test_glass),   cmocka_unit_test(test_threads),
        cmocka_unit_test(test_regions), cmocka_unit_test(test_devices), cmocka_unit_test(test_parts),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
