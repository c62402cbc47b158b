// SPDX-License-Identifier: GPL-3.0-or-later
// Closed surface that a station looked through: taken back where free space is used, magenta where it is shown; equal on every
// device, for any threads, and in regions; kept in saved clouds.
#include "plan/plan.h"
#include "scene/clouds/cloud.h"
#include "scenes/support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// A coarse scan of a board with a slit, from the origin, and a fine one through the slit, of a wall far behind.
enum { WIDTH = 160, HEIGHT = 120, MOST = 1 << 19 };
static const double stations[6] = {0, 0, 0, 0.01, 2.2, 0.05};
static const double coarse = 0.6 * 3.14159265358979323846 / 180.0, fine = 0.1 * 3.14159265358979323846 / 180.0;
#define BOARD 5.0
#define WALL 9.0
#define SLIT 0.025 // half of its width: less than the coarse samples are apart, which close it

struct scan {
    double *position;
    uint8_t *station;
    uint64_t count;
};

static void add(struct scan *scan, const double eye[3], const double way[3], uint8_t station)
{
    const double board = (BOARD - eye[1]) / way[1], x = eye[0] + board * way[0], z = eye[2] + board * way[2];
    const double t = fabs(x) > SLIT && fabs(x) < 2.0 && fabs(z) < 1.5 ? board : (WALL - eye[1]) / way[1];
    if (station && t == board)
        return; // finer samples of the board would say how far its own reach
    for (int k = 0; k < 3; k++)
        scan->position[3 * scan->count + (uint64_t)k] = eye[k] + t * way[k];
    scan->station[scan->count++] = station;
}

static struct scan make_scan(void)
{
    struct scan scan = {malloc(3 * MOST * sizeof(double)), malloc(MOST), 0};
    for (uint8_t s = 0; s < 2; s++) {
        const double step = s ? fine : coarse;
        for (int row = (int)(-0.5 / step); row * step < 0.5; row++)
            for (int column = (int)(-0.7 / step); column * step < 0.7; column++) {
                const double e = (row + 0.3) * step, a = (column + 0.5) * step;
                const double way[3] = {cos(e) * sin(a), cos(e) * cos(a), sin(e)};
                add(&scan, stations + 3 * s, way, s);
            }
    }
    assert_true(scan.count < MOST);
    return scan;
}

static void scan_free(struct scan *scan)
{
    free(scan->position);
    free(scan->station);
}

static patina_cloud *make_cloud(const struct scan *scan, int free_space)
{
    uint8_t *color = malloc(3 * scan->count);
    for (uint64_t i = 0; i < scan->count; i++)
        memset(color + 3 * i, scan->position[3 * i + 1] < BOARD + 0.1 ? 200 : 90, 3);
    const patina_cloud_desc desc = {.struct_size = sizeof desc,
                                    .count = scan->count,
                                    .position = {scan->position, PATINA_FLOAT64, 3, 0},
                                    .color = {color, PATINA_UINT8, 3, 0}};
    const patina_analysis_desc analysis = {.struct_size = sizeof analysis,
                                           .station_count = 2,
                                           .stations = stations,
                                           .station = {scan->station, PATINA_UINT8, 1, 0},
                                           .free_space = (uint32_t)free_space};
    patina_cloud *cloud = NULL;
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    CHECK(patina_cloud_analyse(cloud, &analysis, NULL), cloud);
    free(color);
    return cloud;
}

static patina_cloud *asked; // about its stations; all tests look at it

static int make_asked(void **state)
{
    (void)state;
    struct scan scan = make_scan();
    asked = make_cloud(&scan, 1);
    scan_free(&scan);
    return 0;
}

static int free_asked(void **state)
{
    (void)state;
    patina_cloud_destroy(asked);
    return 0;
}

static patina_camera camera_at(int way)
{
    static const double eyes[3][3] = {{0.01, 3.0, 0.05}, {0.04, 2.6, -0.02}, {0.0, 3.5, 0.0}}, target[3] = {0.0, 5.0, 0.0};
    patina_camera camera = camera_perspective(eyes[way], target, 15, WIDTH, HEIGHT, 0.05, 50);
    if (way == 2) {
        camera.orthographic = 1;
        camera.left = -0.24, camera.right = 0.24, camera.bottom = -0.18, camera.top = 0.18;
    }
    return camera;
}

static struct picture draw(patina_device *device, const patina_cloud *cloud, uint32_t free_space, int way,
                           const patina_settings *settings, const double *placed)
{
    patina_cloud_style style = {.struct_size = sizeof style, .lighting = PATINA_LIGHTING_UNLIT, .free_space = free_space};
    patina_camera camera = camera_at(way);
    if (placed) { // object and camera move alike
        double turned[16];
        memcpy(style.world_from_object, placed, sizeof style.world_from_object);
        for (int r = 0; r < 4; r++)
            for (int c = 0; c < 4; c++) {
                turned[4 * r + c] = 0.0;
                for (int k = 0; k < 4; k++)
                    turned[4 * r + c] += placed[4 * r + k] * camera.world_from_camera[4 * k + c];
            }
        memcpy(camera.world_from_camera, turned, sizeof turned);
    }
    patina_scene *scene = scene_of(cloud, &style);
    struct picture picture = picture_render(device, scene, &camera, settings);
    patina_scene_destroy(scene);
    return picture;
}

struct seen { // of the pixels where the slit is, a third of its width from its edges
    uint32_t board, wall, empty, magenta;
};

static struct seen look(const struct picture *picture, int way)
{
    const patina_camera camera = camera_at(way);
    const double *m = camera.world_from_camera;
    struct seen seen = {0};
    for (uint32_t y = 0; y < HEIGHT; y++)
        for (uint32_t x = 0; x < WIDTH; x++) {
            const double u = camera.left + (camera.right - camera.left) * (x + 0.5) / WIDTH;
            const double v = camera.bottom + (camera.top - camera.bottom) * (y + 0.5) / HEIGHT;
            double eye[3], ray[3];
            for (int k = 0; k < 3; k++) {
                ray[k] = camera.orthographic ? -m[4 * k + 2] : m[4 * k] * u + m[4 * k + 1] * v - m[4 * k + 2];
                eye[k] = m[4 * k + 3] + (camera.orthographic ? m[4 * k] * u + m[4 * k + 1] * v : 0.0);
            }
            const double t = (BOARD - eye[1]) / ray[1];
            if (fabs(eye[0] + t * ray[0]) > SLIT / 3 || fabs(eye[2] + t * ray[2]) > 0.4)
                continue;
            const uint32_t at = y * WIDTH + x;
            const float *color = picture->combined + 4 * at;
            seen.empty += picture->keys[at] == KEY_EMPTY;
            const double z = picture->keys[at] == KEY_EMPTY ? 0.0 : (double)key_z(picture->keys[at]),
                         there = eye[1] + z * ray[1];
            seen.board += z > 0.0 && there < BOARD + 0.5;
            seen.wall += there > WALL - 0.5;
            seen.magenta += color[0] > 0.5f && color[1] < 0.2f && color[2] > 0.5f;
        }
    return seen;
}

static patina_settings settings_of(void)
{
    patina_settings settings = settings_default(WIDTH, HEIGHT);
    settings.smooth = PATINA_SMOOTH_OFF;
    settings.antialias = PATINA_ANTIALIAS_OFF;
    return settings;
}

static void test_slit(void **state)
{
    static const double placed[16] = {0, -2, 0, 40, 2, 0, 0, -7, 0, 0, 2, 3, 0, 0, 0, 1};
    (void)state;
    const patina_settings settings = settings_of();
    for (uint32_t k = 0; k < support_device_count(); k++) {
        patina_device *device = support_device_open(support_device_name(k), 0, 0);
        for (int way = 0; device && way < 3; way++) {
            struct picture off = draw(device, asked, PATINA_FREE_SPACE_OFF, way, &settings, NULL);
            struct picture used = draw(device, asked, PATINA_FREE_SPACE_USE, way, &settings, NULL);
            struct picture shown = draw(device, asked, PATINA_FREE_SPACE_SHOW, way, &settings, NULL);
            const struct seen before = look(&off, way), after = look(&used, way), marked = look(&shown, way);
            assert_true(before.board > 50 && before.magenta == 0);
            // from beside, the wall ends where the slit hid it from the scanner, and some of the slit lies near the board's points
            assert_true(after.board * (way == 1 ? 5 : 50) < before.board);
            assert_true(after.wall * (way == 1 ? 8 : 50) > before.board * (way == 1 ? 5 : 48));
            assert_true(marked.board == before.board &&
                        marked.magenta * (way == 1 ? 8 : 50) > before.board * (way == 1 ? 6 : 48));
            struct picture turned = draw(device, asked, PATINA_FREE_SPACE_USE, way, &settings, way < 2 ? placed : NULL);
            const uint64_t pixels = WIDTH * HEIGHT;
            uint64_t differ = 0; // the object is placed twice as large
            for (uint64_t i = 0; i < pixels; i++)
                differ += (turned.keys[i] == KEY_EMPTY) != (used.keys[i] == KEY_EMPTY) ||
                          key_id(turned.keys[i]) != key_id(used.keys[i]);
            assert_true(differ * 100 < pixels);
            picture_free(&turned);
            picture_free(&off);
            picture_free(&used);
            picture_free(&shown);
        }
        patina_device_destroy(device);
    }
}

// Devices and threads alike; regions as the whole; through a file; and as ever for a cloud whose stations nobody asked.
static void test_alike(void **state)
{
    (void)state;
    struct scan scan = make_scan();
    patina_cloud *plain = make_cloud(&scan, 0), *opened = NULL;
    scan_free(&scan);
    patina_settings settings = settings_of();
    struct picture first = {0};
    char path[] = "/tmp/reopened-XXXXXX";
    const int descriptor = mkstemp(path);
    assert_true(descriptor >= 0);
    close(descriptor); // Windows replaces no file that is open
    CHECK(patina_cloud_save(asked, path), asked);
    CHECK(patina_cloud_open(path, &opened), NULL);
    for (uint32_t k = 0; k < 2 * support_device_count(); k++) {
        patina_device *device = support_device_open(support_device_name(k / 2), k % 2 ? 1 : 3, 0);
        if (!device)
            continue;
        struct picture picture = draw(device, k % 2 ? opened : asked, PATINA_FREE_SPACE_USE, 1, &settings, NULL);
        if (!first.keys)
            first = picture;
        else
            assert_memory_equal(picture.keys, first.keys, 8 * WIDTH * HEIGHT);
        patina_settings part = settings;
        const uint32_t region[4] = {61, 40, 104, 77};
        memcpy(part.region, region, sizeof region);
        struct picture crop = draw(device, asked, PATINA_FREE_SPACE_USE, 1, &part, NULL);
        picture_assert_identical(&crop, &picture, region[0], region[1], "what was looked through, in a region");
        struct picture unasked = draw(device, plain, PATINA_FREE_SPACE_USE, 1, &settings, NULL);
        struct picture off = draw(device, plain, PATINA_FREE_SPACE_OFF, 1, &settings, NULL);
        picture_assert_identical(&unasked, &off, 0, 0, "a cloud whose stations are not known");
        settings.layer_passes = 7; // of several layers nothing is taken back: behind what is empty none is looked for
        struct picture layers = draw(device, asked, PATINA_FREE_SPACE_USE, 1, &settings, NULL);
        settings.layer_passes = 0;
        assert_true(look(&layers, 1).empty == 0);
        picture_free(&layers);
        picture_free(&unasked);
        picture_free(&off);
        picture_free(&crop);
        if (picture.keys != first.keys)
            picture_free(&picture);
        patina_device_destroy(device);
    }
    picture_free(&first);
    patina_cloud_destroy(opened);
    patina_cloud_destroy(plain);
    unlink(path);
}

// Opened with an offset, and placed back by it: the same points, and what the stations saw of them.
static void test_opened_elsewhere(void **state)
{
    (void)state;
    static const double offset[3] = {-485432.0, 5428765.0, 312.5}, nowhere[3] = {0.0, NAN, 0.0};
    const patina_settings settings = settings_of();
    const patina_camera camera = camera_at(1);
    patina_cloud *opened = NULL, *moved = NULL;
    char path[] = "/tmp/elsewhere-XXXXXX";
    const int descriptor = mkstemp(path);
    assert_true(descriptor >= 0);
    close(descriptor);
    CHECK(patina_cloud_save(asked, path), asked);
    CHECK(patina_cloud_open(path, &opened), NULL);
    CHECK(patina_cloud_open_at(path, offset, &moved), NULL);
    patina_cloud_info info[2] = {{.struct_size = sizeof *info}, {.struct_size = sizeof *info}};
    patina_cloud_get_info(opened, &info[0]);
    patina_cloud_get_info(moved, &info[1]);
    assert_true(opened->sights.count == 2 && moved->sights.count == 2);
    patina_cloud_style style = {
        .struct_size = sizeof style, .lighting = PATINA_LIGHTING_UNLIT, .free_space = PATINA_FREE_SPACE_USE};
    for (int k = 0; k < 3; k++) {
        assert_true(fabs(info[1].box_min[k] - info[0].box_min[k] - offset[k]) < 1e-9);
        assert_true(fabs(info[1].box_max[k] - info[0].box_max[k] - offset[k]) < 1e-9);
        assert_true(info[1].origin[k] == offset[k]);
        style.world_from_object[5 * k] = 1.0;
        style.world_from_object[4 * k + 3] = -offset[k];
    }
    style.world_from_object[15] = 1.0;
    patina_device *device = support_device_open("cpu", 0, 0);
    patina_scene *scene = scene_of(moved, &style);
    struct picture there = picture_render(device, scene, &camera, &settings),
                   here = draw(device, opened, PATINA_FREE_SPACE_USE, 1, &settings, NULL),
                   unused = draw(device, opened, PATINA_FREE_SPACE_OFF, 1, &settings, NULL);
    uint64_t other = 0, used = 0;
    for (uint64_t i = 0; i < WIDTH * HEIGHT; i++) {
        other += there.keys[i] != here.keys[i] && key_id(there.keys[i]) != key_id(here.keys[i]);
        used += unused.keys[i] != here.keys[i];
    }
    printf("  %llu pixels show another point, %llu what the stations looked through\n", (unsigned long long)other,
           (unsigned long long)used);
    assert_true(other * 1000 < WIDTH * HEIGHT && used > 20 * other);
    assert_int_equal(patina_cloud_open_at(path, nowhere, &moved), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_cloud_open_at(path, NULL, &moved), PATINA_ERROR_ARGUMENT);
    picture_free(&there);
    picture_free(&here);
    picture_free(&unused);
    patina_scene_destroy(scene);
    patina_cloud_destroy(moved);
    patina_cloud_destroy(opened);
    patina_device_destroy(device);
    unlink(path);
}

// What is shown of free space comes behind shading; depth of field then may not be drawn over what the others still read.
static void test_shown_out_of_focus(void **state)
{
    (void)state;
    patina_settings settings = settings_of();
    settings.antialias = PATINA_ANTIALIAS_LAYERS;
    const patina_effects effects = {.struct_size = sizeof effects,
                                    .edl_strength = 1.0f,
                                    .fog_density = 0.5f,
                                    .fog_end = 9.0f,
                                    .focus_distance = 3.0f,
                                    .focus_aperture = 0.05f};
    const patina_cloud_style style = {
        .struct_size = sizeof style, .lighting = PATINA_LIGHTING_UNLIT, .free_space = PATINA_FREE_SPACE_SHOW};
    patina_scene *scene = scene_of(asked, &style);
    CHECK(patina_scene_set_effects(scene, &effects), scene);
    const patina_camera camera = camera_at(0);
    CHECK(patina_scene_set_camera(scene, &camera), scene);
    CHECK(patina_scene_set_settings(scene, &settings), scene);
    struct pt_plan plan;
    assert_int_equal(pt_plan_create(scene, NULL, &plan), PATINA_OK);
    for (uint32_t i = 0; i < plan.pass_count; i++)
        assert_int_equal(plan.passes[i].leaves, 0);
    pt_plan_destroy(&plan);
    struct picture first = {0};
    for (uint32_t threads = 1; threads < 40; threads += 6) {
        patina_device *device = support_device_open("cpu", threads, 1);
        struct picture picture = picture_render(device, scene, &camera, &settings);
        patina_device_destroy(device);
        if (!first.keys) {
            first = picture;
            continue;
        }
        picture_assert_identical(&picture, &first, 0, 0, "whatever the threads");
        picture_free(&picture);
    }
    picture_free(&first);
    patina_scene_destroy(scene);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_slit), cmocka_unit_test(test_alike),
                                       cmocka_unit_test(test_opened_elsewhere), cmocka_unit_test(test_shown_out_of_focus)};
    support_arguments(argc, argv);
    return cmocka_run_group_tests(tests, make_asked, free_asked);
}
