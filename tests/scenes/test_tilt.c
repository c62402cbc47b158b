// SPDX-License-Identifier: GPL-3.0-or-later
// A plane tilted by 5 to 85 degrees loses no measured pixel to the occlusion filter: d_eff grows with the slope as the
// depth steps of one surface do (SPEC 1, effective layer distance).
#include "clouds.h"
#include "support.h"

#include <math.h>
#include <stdio.h>

enum { SIZE = 256 };

struct loss {
    uint64_t measured, lost, moved; // pixels; moved: measured in both, with another key
};

static struct loss measure(patina_device *device, double degrees, double density, int orthographic, unsigned columns,
                           uint32_t fill, uint32_t quality)
{
    double tilt = degrees * M_PI / 180.0, ct = cos(tilt), st = sin(tilt);
    double pixel = 2.0 / SIZE, width = 2.4, height = 2.4 / ct;
    const double eye[3] = {0.0, 0.0, 40.0}, target[3] = {0.0, 0.0, 0.0};
    patina_camera camera;
    if (orthographic) {
        camera = camera_orthographic(eye, target, 2.0, SIZE, SIZE, -100.0, 100.0);
    } else { // a long lens, so that even the steepest plane fills the picture
        camera = camera_perspective(eye, target, 2.0 * atan(1.0 / 40.0) * 180.0 / M_PI, SIZE, SIZE, 0.1, 1000.0);
        height *= 1.5;
    }
    uint64_t count = (uint64_t)(density * width * height * ct / (pixel * pixel));
    struct points points = points_rectangle(count, width, height, columns, 5 + (uint64_t)degrees);
    patina_cloud *cloud = points_upload(&points);
    points_free(&points);
    patina_cloud_style style = {.struct_size = sizeof style};
    const double m[16] = {1, 0, 0, 0, 0, ct, -st, 0, 0, st, ct, 0, 0, 0, 0, 1};
    for (int k = 0; k < 16; k++)
        style.world_from_object[k] = m[k];
    patina_scene *scene = scene_of(cloud, &style);
    patina_settings settings = settings_default(SIZE, SIZE);
    settings.antialias = PATINA_ANTIALIAS_OFF; // its mark on the source pass is not what is measured
    settings.quality = quality;
    settings.fill = PATINA_FILL_OFF;
    struct picture open = picture_render(device, scene, &camera, &settings);
    settings.fill = fill;
    struct picture filled = picture_render(device, scene, &camera, &settings);
    struct loss loss = {0};
    for (uint32_t i = 0; i < SIZE * SIZE; i++) {
        if (open.source[i] != 1.0f)
            continue;
        loss.measured++;
        loss.lost += filled.source[i] != 1.0f;
        loss.moved += filled.source[i] == 1.0f && filled.keys[i] != open.keys[i];
    }
    picture_free(&open);
    picture_free(&filled);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    return loss;
}

static double percent(struct loss loss)
{
    return loss.measured ? 100.0 * (double)loss.lost / (double)loss.measured : 0.0;
}

static void test_tilted_planes(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    static const double densities[] = {0.3, 1.0, 3.0, 10.0};
    uint64_t lost = 0, moved = 0;
    printf("  measured pixels that filling took for occluded, %%\n"
           "  tilt view  points/px |  closed  closed, paper's depth  paper | closed without normals\n");
    for (double degrees = 5.0; degrees < 90.0; degrees += 10.0)
        for (int orthographic = 1; orthographic >= 0; orthographic--)
            for (uint32_t d = 0; d < 4; d++) {
                double density = densities[d];
                struct loss closed = measure(device, degrees, density, orthographic, POINTS_NORMALS, PATINA_FILL_CLOSED,
                                             0);
                struct loss rough = measure(device, degrees, density, orthographic, POINTS_NORMALS, PATINA_FILL_CLOSED,
                                            PATINA_QUALITY_PAPER);
                struct loss paper = measure(device, degrees, density, orthographic, POINTS_NORMALS, PATINA_FILL_PAPER,
                                            PATINA_QUALITY_PAPER);
                struct loss plain = measure(device, degrees, density, orthographic, POINTS_PLAIN, PATINA_FILL_CLOSED,
                                            0);
                printf("  %4.0f %-5s %9g | %7.4f %21.4f %7.4f | %7.4f\n", degrees, orthographic ? "ortho" : "persp",
                       density, percent(closed), percent(rough), percent(paper), percent(plain));
                assert_true((double)closed.measured > 0.5 * (1.0 - exp(-density)) * SIZE * SIZE);
                lost += closed.lost + rough.lost + paper.lost;
                moved += closed.moved + rough.moved + paper.moved;
            }
    assert_int_equal(moved, 0); // filling never changes what was measured
    if (lost)
        support_die("%llu measured pixels of tilted planes were lost", (unsigned long long)lost);
    patina_device_destroy(device);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_tilted_planes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
