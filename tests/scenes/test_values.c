// SPDX-License-Identifier: GPL-3.0-or-later
// Contour lines along an attribute: where the values say, as wide as asked for, on every surface, with few points and many, on layers
// and whole numbers far from 0; none on what has no values. Regions are crops, threads change nothing, devices agree.
#include "clouds.h"
#include "meshes.h"
#include "support.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 192, HEIGHT = 96 };
#define PIXEL (1.0 / 48.0) // world units: the picture shows 4 x 2
#define WIDE 2.0f          // of a line

struct stage {
    struct points points;
    float *values;
    patina_cloud *cloud;
    patina_camera camera;
    patina_settings settings;
};

// A white square z = slope x, larger than the picture, seen from above; f(x, y) at each point.
static struct stage set_stage(double density, double slope, double (*f)(double x, double y))
{
    static const double eye[3] = {0.0, 0.0, 10.0}, target[3] = {0.0, 0.0, 0.0};
    const uint64_t count = (uint64_t)(density * 5.0 * 3.0 / (PIXEL * PIXEL));
    struct stage stage = {.points = points_rectangle(count, 5.0, 3.0, POINTS_ALL, 7), .values = malloc(count * sizeof(float))};
    const double length = sqrt(1.0 + slope * slope);
    for (uint64_t i = 0; i < count; i++) {
        float *p = stage.points.position + 3 * i;
        stage.values[i] = (float)f((double)p[0], (double)p[1]);
        p[2] = (float)(slope * (double)p[0]);
        stage.points.normal[3 * i] = (float)(-slope / length);
        stage.points.normal[3 * i + 2] = (float)(1.0 / length);
        memset(stage.points.color + 3 * i, 255, 3);
    }
    patina_cloud_desc desc = points_desc(&stage.points);
    desc.scalar = (patina_array){stage.values, PATINA_FLOAT32, 1, 0};
    CHECK(patina_cloud_create(&desc, NULL, &stage.cloud), NULL);
    stage.camera = camera_orthographic(eye, target, HEIGHT * PIXEL, WIDTH, HEIGHT, 0.1, 100.0);
    stage.settings = settings_default(WIDTH, HEIGHT);
    return stage;
}

static void clear_stage(struct stage *stage)
{
    points_free(&stage->points);
    free(stage->values);
    patina_cloud_destroy(stage->cloud);
}

static patina_effects lines_of(double interval)
{
    return (patina_effects){.struct_size = sizeof(patina_effects),
                            .contour_source = PATINA_CONTOUR_ATTRIBUTE,
                            .contour_interval = (float)interval,
                            .contour_width = WIDE,
                            .contour_every = 1,
                            .contour_opacity = 1.0f};
}

static struct picture draw(patina_device *device, const struct stage *stage, const patina_cloud_style *style,
                           const patina_effects *effects)
{
    patina_scene *scene = scene_of(stage->cloud, style);
    CHECK(patina_scene_set_effects(scene, effects), scene);
    struct picture picture = picture_render(device, scene, &stage->camera, &stage->settings);
    patina_scene_destroy(scene);
    return picture;
}

// Beside the picture without lines, which may have holes.
static double ink_at(const struct picture *picture, const struct picture *without, uint32_t x, uint32_t y)
{
    const size_t at = 4 * ((size_t)y * picture->width + x);
    return (double)without->combined[at] - (double)picture->combined[at];
}

static double world_x(uint32_t x) { return (x + 0.5 - WIDTH / 2.0) * PIXEL; }
static double world_y(uint32_t y) { return (y + 0.5 - HEIGHT / 2.0) * PIXEL; }

struct found {
    double width; // of a line in the mean, pixels
    double away;  // share of the ink that lies farther than `reach` from any line
};

// f grows by `rate` a world unit where `away(x, y)` is how far a place lies from the next line, world units.
static struct found measure(const struct picture *picture, const struct picture *without, double (*away)(double x, double y),
                            double length, double reach)
{
    struct found found = {0};
    double sum = 0.0;
    for (uint32_t y = 0; y < HEIGHT; y++)
        for (uint32_t x = 0; x < WIDTH; x++) {
            const double ink = ink_at(picture, without, x, y);
            sum += ink;
            found.away += away(world_x(x), world_y(y)) / PIXEL > reach ? ink : 0.0;
        }
    found.width = sum / length;
    found.away /= sum;
    return found;
}

// Straight lines, a world unit apart, that x = 0.3 is one of.
static double ramp(double x, double y)
{
    (void)y;
    return 7.0 * (x - 0.3);
}
static double from_ramp(double x, double y)
{
    (void)y;
    return fabs(x - 0.3 - floor(x - 0.3 + 0.5));
}
// Circles, whose values grow the faster the farther out they lie.
static double bowl(double x, double y) { return x * x + y * y; }
static double from_bowl(double x, double y)
{
    const double r = hypot(x, y);
    double best = INFINITY;
    for (int k = 1; k < 9; k++)
        best = fmin(best, fabs(r - sqrt(k)));
    return best;
}

// In pixels; of circles what lies in the picture, by counting.
static double length_of_circles(void)
{
    double sum = 0.0;
    for (int k = 1; k < 9; k++)
        for (int i = 0; i < 20000; i++) {
            const double r = sqrt(k), angle = 6.283185307179586 * i / 20000.0;
            const double x = r * cos(angle), y = r * sin(angle);
            sum += fabs(x) < WIDTH * PIXEL / 2.0 && fabs(y) < HEIGHT * PIXEL / 2.0 ? r / PIXEL * 6.283185307179586 / 20000.0
                                                                                   : 0.0;
        }
    return sum;
}

static const struct way {
    const char *name;
    double density, slope;
    uint32_t surface, fill, analysed;
    double reach, error; // pixels that a line may lie off, half of its width among them; of its width, as a share
} ways[] = {
    {"as many points as pixels need", 12.0, 0.0, PATINA_SURFACE_FILL, PATINA_FILL_OFF, 0, 2.5, 0.1},
    {"filled", 1.0, 0.0, PATINA_SURFACE_FILL, PATINA_FILL_CLOSED, 0, 2.5, 0.1},
    {"filled, steep", 1.0, 1.5, PATINA_SURFACE_FILL, PATINA_FILL_CLOSED, 0, 2.5, 0.1},
    {"filled, few points", 0.1, 0.3, PATINA_SURFACE_FILL, PATINA_FILL_CLOSED, 0, 4.0, 0.15},
    {"discs", 0.5, 0.3, PATINA_SURFACE_SPLATS, PATINA_FILL_CLOSED, 1, 3.0, 0.15},
    {"discs and filling", 0.5, 0.3, PATINA_SURFACE_AUTO, PATINA_FILL_CLOSED, 1, 3.0, 0.15},
    {"discs, few points", 0.05, 0.0, PATINA_SURFACE_SPLATS, PATINA_FILL_CLOSED, 1, 5.0, 0.2},
    {"range images", 0.5, 0.3, PATINA_SURFACE_RANGES, PATINA_FILL_CLOSED, 0, 3.5, 0.15},
};
enum { WAYS = sizeof ways / sizeof *ways };

static struct stage stage_of(const struct way *way, double (*f)(double x, double y))
{
    struct stage stage = set_stage(way->density, way->slope, f);
    stage.settings.surface = way->surface;
    stage.settings.fill = way->fill;
    if (way->analysed)
        CHECK(patina_cloud_analyse(stage.cloud, NULL, NULL), stage.cloud);
    return stage;
}

static void test_surfaces(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    const patina_effects straight = lines_of(7.0), round = lines_of(1.0), none = {.struct_size = sizeof none};
    printf("  surface                       straight: width, off | circles: width, off\n");
    for (uint32_t w = 0; w < WAYS; w++) {
        struct stage stage = stage_of(&ways[w], ramp), other = stage_of(&ways[w], bowl);
        struct picture lines = draw(device, &stage, NULL, &straight), circles = draw(device, &other, NULL, &round);
        struct picture without = draw(device, &stage, NULL, &none);
        const struct found a = measure(&lines, &without, from_ramp, 4.0 * HEIGHT, ways[w].reach),
                           b = measure(&circles, &without, from_bowl, length_of_circles(), ways[w].reach);
        printf("  %-28s  %.3f, %.4f | %.3f, %.4f\n", ways[w].name, a.width, a.away, b.width, b.away);
        if (fabs(a.width / (double)WIDE - 1.0) > ways[w].error || a.away > 0.01)
            support_die("%s: straight lines are %.3f pixels wide, %.3f of them off", ways[w].name, a.width, a.away);
        if (fabs(b.width / (double)WIDE - 1.0) > 0.05 + ways[w].error || b.away > 0.02)
            support_die("%s: circles are %.3f pixels wide, %.3f of them off", ways[w].name, b.width, b.away);
        picture_free(&lines);
        picture_free(&circles);
        picture_free(&without);
        clear_stage(&stage);
        clear_stage(&other);
    }
    patina_device_destroy(device);
}

// Values far from 0, as GPS times are, show lines as those near it do, as far as their own steps allow; a cloud of one value none;
// where values are NaN none; what has no values is as it is without.
static double far_ramp(double x, double y) { return 4e5 + ramp(x, y); }
static double level(double x, double y)
{
    (void)x;
    (void)y;
    return 14.0;
}
static double half_known(double x, double y) { return y > 0.0 ? ramp(x, y) : (double)NAN; }

static void test_values(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    patina_effects effects = lines_of(7.0), none = {.struct_size = sizeof none};
    effects.contour_start = 4e5f;
    struct stage stage = set_stage(2.0, 0.0, far_ramp);
    struct picture lines = draw(device, &stage, NULL, &effects);
    struct picture without = draw(device, &stage, NULL, &none);
    const struct found found = measure(&lines, &without, from_ramp, 4.0 * HEIGHT, 2.5);
    printf("  400,000 and more: %.3f wide, %.4f off\n", found.width, found.away);
    assert_true(fabs(found.width / (double)WIDE - 1.0) < 0.1 && found.away < 0.01);
    picture_free(&lines);
    clear_stage(&stage);
    effects.contour_start = 0.0f;
    for (int automatic = 0; automatic < 2; automatic++) {
        effects.contour_interval = automatic ? 0.0f : 7.0f;
        stage = set_stage(2.0, 0.3, level);
        struct picture with = draw(device, &stage, NULL, &effects), level_one = draw(device, &stage, NULL, &none);
        picture_assert_identical(&with, &level_one, 0, 0, "a cloud of one value");
        picture_free(&with);
        picture_free(&level_one);
        clear_stage(&stage);
    }
    effects.contour_interval = 7.0f;
    stage = set_stage(2.0, 0.0, half_known);
    lines = draw(device, &stage, NULL, &effects);
    double upper = 0.0, lower = 0.0;
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++)
        *(i / WIDTH < HEIGHT / 2 ? &lower : &upper) += ink_at(&lines, &without, i % WIDTH, i / WIDTH);
    assert_true(lower < 4.0 * (double)WIDE * 3.0 && fabs(upper / (4.0 * 48.0 * (double)WIDE) - 1.0) < 0.12);
    picture_free(&lines);
    picture_free(&without);
    clear_stage(&stage);
    patina_device_destroy(device);
}

// A cloud with values over one without and a mesh: lines on it alone.
static void test_others(void **state)
{
    (void)state;
    static const double middle[3] = {1.2, 0.0, 1.0}, half[3] = {0.5, 0.5, 0.2};
    patina_device *device = support_device_first();
    struct stage stage = set_stage(2.0, 0.0, ramp);
    const patina_effects effects = lines_of(7.0);
    struct points bare = points_rectangle(20000, 1.0, 1.0, POINTS_ALL, 9);
    memset(bare.color, 255, 3 * bare.count);
    for (uint64_t i = 0; i < bare.count; i++) {
        bare.position[3 * i] -= 1.2f;
        bare.position[3 * i + 2] += 1.0f;
    }
    patina_cloud *cloud = points_upload(&bare);
    patina_mesh *box = mesh_box(middle, half);
    patina_scene *scene = scene_of(stage.cloud, NULL);
    CHECK(patina_scene_add_cloud(scene, cloud, NULL), scene);
    mesh_add(scene, box, 1.0f, 1.0f, 1.0f);
    struct picture without = picture_render(device, scene, &stage.camera, &stage.settings);
    CHECK(patina_scene_set_effects(scene, &effects), scene);
    struct picture with = picture_render(device, scene, &stage.camera, &stage.settings);
    uint32_t drawn = 0;
    for (uint32_t y = 0; y < HEIGHT; y++)
        for (uint32_t x = 0; x < WIDTH; x++) {
            const size_t at = 4 * ((size_t)y * WIDTH + x);
            const int other = fabs(fabs(world_x(x)) - 1.2) < 0.5 - PIXEL && fabs(world_y(y)) < 0.5 - PIXEL;
            const int same = !memcmp(with.combined + at, without.combined + at, 16);
            if (other && !same)
                support_die("a line at (%u, %u), where nothing has values", x, y);
            drawn += !same;
        }
    assert_true(drawn > 100);
    picture_free(&with);
    picture_free(&without);
    patina_scene_destroy(scene);
    patina_mesh_destroy(box);
    patina_cloud_destroy(cloud);
    points_free(&bare);
    clear_stage(&stage);
    patina_device_destroy(device);
}

// Half of what lies behind glass shows its lines through it.
static void test_layers(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    struct stage stage = set_stage(2.0, 0.0, ramp);
    stage.settings.layers = 3;
    const patina_effects effects = lines_of(7.0);
    patina_cloud_style glass = PATINA_CLOUD_STYLE_INIT, below = PATINA_CLOUD_STYLE_INIT;
    glass.transparency = 0.5f;
    const double lower[16] = {1, 0, 0, 0.5, 0, 1, 0, 0, 0, 0, 1, -1.0, 0, 0, 0, 1}; // its lines lie between the others'
    memcpy(below.world_from_object, lower, sizeof lower);
    patina_scene *scene = scene_of(stage.cloud, &glass);
    CHECK(patina_scene_add_cloud(scene, stage.cloud, &below), scene);
    struct picture without = picture_render(device, scene, &stage.camera, &stage.settings);
    CHECK(patina_scene_set_effects(scene, &effects), scene);
    struct picture picture = picture_render(device, scene, &stage.camera, &stage.settings);
    double front = 0.0, behind = 0.0;
    for (uint32_t y = 0; y < HEIGHT; y++)
        for (uint32_t x = 0; x < WIDTH; x++) {
            const double away = from_ramp(world_x(x), world_y(y)) / PIXEL;
            *(away < 12.0 ? &front : &behind) += world_x(x) > -1.6 ? ink_at(&picture, &without, x, y) : 0.0;
        }
    front /= HEIGHT * (double)WIDE * 0.5;
    behind /= HEIGHT * (double)WIDE * 0.5;
    printf("  lines of half their ink: %.3f in front, %.3f behind\n", front, behind);
    assert_true(fabs(front - 3.0) < 0.4 && fabs(behind - 4.0) < 0.5);
    picture_free(&picture);
    picture_free(&without);
    patina_scene_destroy(scene);
    clear_stage(&stage);
    patina_device_destroy(device);
}

static void test_regions(void **state)
{
    (void)state;
    static const uint32_t regions[][4] = {{0, 0, 96, 48}, {90, 31, 192, 96}, {64, 32, 65, 33}, {87, 3, 104, 94}};
    const patina_effects effects = lines_of(0.2);
    for (uint32_t k = 0; k < support_device_count(); k++) {
        patina_device *device = support_device_open(support_device_name(k), 0, 0);
        for (uint32_t w = 0; w < WAYS && device; w++) {
            struct stage stage = stage_of(&ways[w], bowl);
            struct picture whole = draw(device, &stage, NULL, &effects);
            for (uint32_t r = 0; r < sizeof regions / sizeof *regions; r++) {
                memcpy(stage.settings.region, regions[r], sizeof regions[r]);
                struct picture part = draw(device, &stage, NULL, &effects);
                picture_assert_identical(&part, &whole, regions[r][0], regions[r][1], ways[w].name);
                picture_free(&part);
            }
            picture_free(&whole);
            clear_stage(&stage);
        }
        patina_device_destroy(device);
    }
}

static void test_same(void **state)
{
    (void)state;
    const patina_effects effects = lines_of(0.2);
    for (uint32_t w = 0; w < WAYS; w++) {
        struct stage stage = stage_of(&ways[w], bowl);
        struct picture truth = {0};
        for (uint32_t k = 0; k < 2 + support_device_count(); k++) {
            const char *name = k < 2 ? "cpu" : support_device_name(k - 2);
            patina_device *device = support_device_open(name, k < 2 ? 1 + 2 * k : 0, 0);
            if (!device)
                continue;
            struct picture picture = draw(device, &stage, NULL, &effects);
            patina_device_destroy(device);
            if (!k) {
                truth = picture;
                continue;
            }
            if (k == 1)
                picture_assert_identical(&picture, &truth, 0, 0, "threads");
            double off = 0.0;
            for (uint32_t i = 0; i < 4 * WIDTH * HEIGHT; i++)
                off = fmax(off, fabs((double)picture.combined[i] - (double)truth.combined[i]));
            if (off > 0.05 || memcmp(picture.keys, truth.keys, sizeof *truth.keys * WIDTH * HEIGHT) != 0) // as test_effects
                support_die("%s, %s: colours %.3g off", name, ways[w].name, off);
            picture_free(&picture);
        }
        picture_free(&truth);
        clear_stage(&stage);
    }
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_surfaces), cmocka_unit_test(test_values),  cmocka_unit_test(test_others),
        cmocka_unit_test(test_layers),   cmocka_unit_test(test_regions), cmocka_unit_test(test_same),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
