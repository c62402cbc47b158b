// SPDX-License-Identifier: GPL-3.0-or-later
// How far scans lie apart where range images show them: as far as they were put apart, along the normal, on slopes and in perspective; 0
// where one scan is alone, or nothing is known; the same on every device and for any number of threads, whole and in parts.
#include "clouds.h"
#include "support.h"

#include <math.h>
#include <stdlib.h>

enum { SIDE = 150, POINTS = 2 * SIDE * SIDE, SIZE = 128 };

static const double step = 0.02, apart = 0.03;

// Of a plane through the origin, turned by `lean` about the vertical: two scans `apart` along the normal, the second where u > 0.
struct sheets {
    float place[POINTS][3];
    uint16_t scan[POINTS];
    uint64_t count;
};

static struct sheets *make_sheets(double lean, double noise)
{
    struct sheets *sheets = calloc(1, sizeof *sheets);
    struct pcg random = pcg_seed(11);
    const double along[3] = {cos(lean), sin(lean), 0.0}, normal[3] = {sin(lean), -cos(lean), 0.0};
    assert_non_null(sheets);
    for (int scan = 0; scan < 2; scan++)
        for (int i = 0; i < SIDE * SIDE; i++) {
            const double u = step * (i % SIDE - SIDE / 2 + pcg_unit(&random) - 0.5),
                         v = step * (i / SIDE - SIDE / 2 + pcg_unit(&random) - 0.5);
            const double off = (scan ? apart : 0.0) + noise * (pcg_unit(&random) + pcg_unit(&random) - 1.0);
            if (scan && u < 0.0)
                continue;
            for (int k = 0; k < 3; k++)
                sheets->place[sheets->count][k] = (float)(u * along[k] + off * normal[k] + (k == 2 ? v : 0.0));
            sheets->scan[sheets->count++] = (uint16_t)(scan ? 6 : 1); // counted in two turns
        }
    return sheets;
}

static patina_scene *scene_with(const struct sheets *sheets, patina_cloud **cloud, patina_scans **scans, float gamma,
                                float sharpness)
{
    const patina_cloud_desc desc = {
        .struct_size = sizeof desc, .count = sheets->count, .position = {sheets->place, PATINA_FLOAT32, 3, 0}};
    const patina_scan unknown = {.interval = 0.0};
    patina_cloud_style style = PATINA_CLOUD_STYLE_INIT;
    CHECK(patina_cloud_create(&desc, NULL, cloud), NULL);
    CHECK(patina_scans_create(*cloud, sheets->scan, &unknown, 1, scans), *cloud);
    style.surface = PATINA_SURFACE_RANGES;
    style.range_gamma = gamma;
    style.range_sharpness = sharpness;
    style.scans = *scans;
    return scene_of(*cloud, &style);
}

static patina_camera look(int perspective)
{
    const double eye[3] = {0.1, -4.0, 0.3}, target[3] = {0.0, 0.0, 0.0};
    return perspective ? camera_perspective(eye, target, 30.0, SIZE, SIZE, 0.1, 100.0)
                       : camera_orthographic(eye, target, 2.0, SIZE, SIZE, 0.1, 100.0);
}

static patina_settings ask(void)
{
    patina_settings settings = settings_default(SIZE, SIZE);
    settings.passes = 1u << PATINA_PASS_COMBINED | 1u << PATINA_PASS_DEPTH | 1u << PATINA_PASS_DISAGREEMENT;
    return settings;
}

static void render(patina_device *device, patina_scene *scene, const patina_camera *camera, const patina_settings *settings,
                   float *depth, float *told)
{
    patina_frame *frame = NULL;
    const uint32_t *region = settings->region;
    const size_t size = 4 * (size_t)(region[2] ? region[2] - region[0] : SIZE) * (region[3] ? region[3] - region[1] : SIZE);
    CHECK(patina_scene_set_camera(scene, camera), scene);
    CHECK(patina_scene_set_settings(scene, settings), scene);
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_frame_render(frame, scene), frame);
    CHECK(patina_frame_read(frame, PATINA_PASS_DEPTH, depth, size), frame);
    CHECK(patina_frame_read(frame, PATINA_PASS_DISAGREEMENT, told, size), frame);
    patina_frame_destroy(frame);
}

// Where a pixel's ray meets the first scan's plane, along it.
static double along_plane(const patina_camera *camera, double lean, uint32_t x, uint32_t y)
{
    double origin[3], way[3];
    const double normal[3] = {sin(lean), -cos(lean), 0.0}, along[3] = {cos(lean), sin(lean), 0.0};
    camera_ray(camera, SIZE, SIZE, x + 0.5, y + 0.5, origin, way);
    const double t = -(origin[0] * normal[0] + origin[1] * normal[1]) / (way[0] * normal[0] + way[1] * normal[1]);
    return (origin[0] + t * way[0]) * along[0] + (origin[1] + t * way[1]) * along[1];
}

static void test_known_offset(void **state)
{
    static float depth[SIZE * SIZE], told[SIZE * SIZE];
    static const double leans[] = {0.0, 0.5, 0.9}, noises[] = {0.0, 0.005};
    (void)state;
    patina_device *device = support_device_first();
    for (int k = 0; k < 12; k++) {
        const double lean = leans[k % 3], noise = noises[k / 3 % 2];
        const patina_camera camera = look(k / 6);
        struct sheets *sheets = make_sheets(lean, noise);
        patina_cloud *cloud = NULL;
        patina_scans *scans = NULL;
        patina_scene *scene = scene_with(sheets, &cloud, &scans, (float)(6.0 * apart), 0.0f);
        const patina_settings settings = ask();
        double both = 0.0, sum = 0.0, most = 0.0, alone = 0.0, lonely = 0.0;
        render(device, scene, &camera, &settings, depth, told);
        for (uint32_t y = 8; y < SIZE - 8; y++)
            for (uint32_t x = 8; x < SIZE - 8; x++) {
                const double u = along_plane(&camera, lean, x, y), value = (double)told[y * SIZE + x];
                if (isinf(depth[y * SIZE + x]) || fabs(u) > 0.9)
                    continue;
                if (u > 0.15) {
                    both++;
                    sum += value;
                    most = fmax(most, fabs(value - apart));
                } else if (u < -0.15) {
                    alone++;
                    lonely = fmax(lonely, value);
                }
            }
        print_message("  %s, leaning by %.1f, noise %.3f: %.5f apart in the mean, told of %.3f; at most %.5f off\n",
                      k / 6 ? "perspective" : "parallel", lean, noise, sum / both, apart, most);
        assert_true(both > 1500.0 && alone > 1500.0 && lonely == 0.0);
        assert_true(fabs(sum / both - apart) < 0.05 * apart + 0.1 * noise);
        assert_true(most < 0.25 * apart + 1.5 * noise);
        patina_scene_destroy(scene);
        patina_scans_destroy(scans);
        patina_cloud_destroy(cloud);
        free(sheets);
    }
    patina_device_destroy(device);
}

// Farther apart than gamma they are two surfaces; and without scans, as another surface and where nobody asks, nothing is told.
static void test_nothing_is_known(void **state)
{
    static float depth[SIZE * SIZE], told[SIZE * SIZE];
    (void)state;
    patina_device *device = support_device_first();
    struct sheets *sheets = make_sheets(0.0, 0.0);
    for (int k = 0; k < 4; k++) {
        patina_cloud *cloud = NULL;
        patina_scans *scans = NULL;
        const patina_camera camera = look(0);
        patina_settings settings = ask();
        patina_cloud_style style = PATINA_CLOUD_STYLE_INIT;
        patina_scene *scene = scene_with(sheets, &cloud, &scans, (float)(0.5 * apart), 0.0f);
        patina_scene_destroy(scene);
        style.range_gamma = k == 3 ? (float)(0.5 * apart) : 0.5f;
        style.surface = k == 1 ? 0 : PATINA_SURFACE_RANGES;
        style.scans = k == 2 ? NULL : scans;
        settings.surface = k == 1 ? PATINA_SURFACE_FILL : PATINA_SURFACE_AUTO;
        scene = scene_of(cloud, &style);
        double most = 0.0;
        render(device, scene, &camera, &settings, depth, told);
        for (int i = 0; i < SIZE * SIZE; i++)
            most = fmax(most, (double)told[i]);
        assert_true(k ? most == 0.0 : most > 0.9 * apart);
        if (!k) { // not asked for
            patina_frame *frame = NULL;
            settings.passes &= ~(1u << PATINA_PASS_DISAGREEMENT);
            CHECK(patina_scene_set_settings(scene, &settings), scene);
            CHECK(patina_frame_create(device, &frame), device);
            CHECK(patina_frame_render(frame, scene), frame);
            assert_int_equal(patina_frame_read(frame, PATINA_PASS_DISAGREEMENT, told, sizeof told), PATINA_ERROR_EMPTY);
            patina_frame_destroy(frame);
        }
        patina_scene_destroy(scene);
        patina_scans_destroy(scans);
        patina_cloud_destroy(cloud);
    }
    free(sheets);
    patina_device_destroy(device);
}

static void test_alike_everywhere(void **state)
{
    static float depth[SIZE * SIZE], told[2][SIZE * SIZE], part[SIZE * SIZE];
    (void)state;
    struct sheets *sheets = make_sheets(0.5, 0.005);
    for (int sharp = 0; sharp < 2; sharp++) {
        patina_cloud *cloud = NULL;
        patina_scans *scans = NULL;
        patina_scene *scene = scene_with(sheets, &cloud, &scans, (float)(6.0 * apart), sharp ? 0.7f : 0.0f);
        const patina_camera camera = look(1);
        int first = 1;
        for (uint32_t i = 0; i < 2 * support_device_count(); i++) {
            patina_device *device = support_device_open(support_device_name(i / 2), i % 2 ? 1 : 0, 0);
            if (!device)
                continue;
            patina_settings settings = ask();
            render(device, scene, &camera, &settings, depth, told[!first]);
            for (int p = 0; p < SIZE * SIZE; p++)
                if (told[0][p] != told[!first][p])
                    support_die("%s: pixel %d, %d: %.9g, not %.9g", support_device_name(i / 2), p % SIZE, p / SIZE,
                                (double)told[!first][p], (double)told[0][p]);
            first = 0;
            const uint32_t region[4] = {37, 29, 91, 100};
            for (int k = 0; k < 4; k++)
                settings.region[k] = region[k];
            render(device, scene, &camera, &settings, depth, part);
            for (uint32_t p = 0; p < 54 * 71; p++)
                assert_true(part[p] == told[0][(p / 54 + 29) * SIZE + p % 54 + 37]);
            patina_device_destroy(device);
        }
        assert_false(first);
        patina_scene_destroy(scene);
        patina_scans_destroy(scans);
        patina_cloud_destroy(cloud);
    }
    free(sheets);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_known_offset),
        cmocka_unit_test(test_nothing_is_known),
        cmocka_unit_test(test_alike_everywhere),
    };
    support_arguments(argc, argv);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
