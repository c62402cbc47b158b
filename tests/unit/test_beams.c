// SPDX-License-Identifier: GPL-3.0-or-later
// Beams: a station's interval is found from its samples; footprints end at its cells, and at half of them beside bars.
#include "scene/analysis/analysis.h"
#include "scene/analysis/beams.h"
#include "scenes/support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 1 << 16 };
static const double step = 0.25 * 3.14159265358979323846 / 180.0;
static const double station[3] = {1.0, -2.0, 0.5};

// Of a wall at y = 6 with bars at y = 5 before it, 24 mm wide and 0.15 m apart from x = 2 on, as the station sees them.
struct scan {
    double position[MOST][3];
    uint8_t bar[MOST];
    uint64_t count;
};

static void add(struct scan *scan, const double way[3], double depth, int bar)
{
    const double t = (depth - station[1]) / way[1];
    for (int k = 0; k < 3; k++)
        scan->position[scan->count][k] = station[k] + t * way[k];
    scan->bar[scan->count++] = (uint8_t)bar;
}

static struct scan *make_scan(void)
{
    struct scan *scan = calloc(1, sizeof *scan);
    for (int row = -80; row < 80; row++)
        for (int column = -120; column < 120; column++) {
            const double e = (row + 0.5) * step, a = 1.5707963267948966 + column * step;
            const double way[3] = {cos(e) * cos(a), cos(e) * sin(a), sin(e)};
            const double x = station[0] + (5.0 - station[1]) / way[1] * way[0];
            const int bar = x > 2.0 && fmod(x, 0.15) < 0.024;
            add(scan, way, bar ? 5.0 : 6.0, bar);
        }
    return scan;
}

static patina_cloud *cloud_of(const struct scan *scan)
{
    patina_cloud *cloud = NULL;
    const patina_cloud_desc desc = {
        .struct_size = sizeof desc, .count = scan->count, .position = {scan->position, PATINA_FLOAT64, 3, 0}};
    assert_int_equal(patina_cloud_create(&desc, NULL, &cloud), PATINA_OK);
    return cloud;
}

static void test_interval(void **state)
{
    (void)state;
    struct scan *scan = make_scan();
    patina_cloud *cloud = cloud_of(scan);
    const patina_analysis_desc desc = {.struct_size = sizeof desc, .station_count = 1, .stations = station};
    struct pt_beams beams;
    assert_int_equal(pt_beams_create(cloud, &desc, NULL, &beams), PATINA_OK);
    assert_int_equal(beams.count, 1);
    assert_true(fabs(beams.each[0].interval.elevation / step - 1.0) < 0.06);
    pt_beams_destroy(&beams);
    patina_cloud_destroy(cloud);
    free(scan);
}

// From 60 degrees below the horizon to 60 above it: the steeper, the nearer together columns lie.
static void test_steep(void **state)
{
    (void)state;
    struct scan *scan = calloc(1, sizeof *scan);
    for (int row = -240; row < 240; row++)
        for (int column = 0; column < 120; column++) { // a twelfth of the turn
            double *p = scan->position[scan->count++];
            const double e = (row + 0.5) * step, a = (column + 0.5) * step;
            p[0] = station[0] + 5.0 * cos(e) * cos(a);
            p[1] = station[1] + 5.0 * cos(e) * sin(a);
            p[2] = station[2] + 5.0 * sin(e);
        }
    patina_cloud *cloud = cloud_of(scan);
    const patina_analysis_desc desc = {.struct_size = sizeof desc, .station_count = 1, .stations = station};
    struct pt_beams beams;
    assert_int_equal(pt_beams_create(cloud, &desc, NULL, &beams), PATINA_OK);
    assert_true(fabs(beams.each[0].interval.elevation / step - 1.0) < 0.04);
    assert_int_equal(beams.each[0].interval.even, 0);
    pt_beams_destroy(&beams);
    patina_cloud_destroy(cloud);
    free(scan);
}

// A depth camera has an even grid, wherever it looks: along z its columns lie no nearer together. A wall before it is closed.
static void test_camera(void **state)
{
    enum { WIDTH = 200, HEIGHT = 150 };
    static const double focal = 180.0; // pixels
    (void)state;
    for (int axis = 0; axis < 3; axis++) {
        struct scan *scan = calloc(1, sizeof *scan);
        for (int row = 0; row < HEIGHT; row++)
            for (int column = 0; column < WIDTH; column++) {
                double *p = scan->position[scan->count++];
                p[axis] = station[axis] + 3.0;
                p[(axis + 1) % 3] = station[(axis + 1) % 3] + 3.0 * (column + 0.5 - WIDTH / 2) / focal;
                p[(axis + 2) % 3] = station[(axis + 2) % 3] + 3.0 * (row + 0.5 - HEIGHT / 2) / focal;
            }
        patina_cloud *cloud = cloud_of(scan);
        const patina_analysis_desc desc = {.struct_size = sizeof desc, .station_count = 1, .stations = station};
        struct pt_beams beams;
        assert_int_equal(pt_beams_create(cloud, &desc, NULL, &beams), PATINA_OK);
        assert_true(beams.each[0].interval.elevation * focal > 0.7 && beams.each[0].interval.elevation * focal < 1.1);
        pt_beams_destroy(&beams);
        assert_int_equal(patina_cloud_analyse(cloud, &desc, NULL), PATINA_OK);
        float *axes = calloc(scan->count, 2 * sizeof *axes);
        const patina_neighbourhoods wanted = {.struct_size = sizeof wanted, .half_axes = axes};
        assert_int_equal(patina_cloud_neighbourhoods(cloud, &wanted, NULL), PATINA_OK);
        uint64_t closed = 0, inner = 0;
        for (int row = 5; row < HEIGHT - 5; row++)
            for (int column = 5; column < WIDTH - 5; column++, inner++)
                closed += (double)axes[2 * (row * WIDTH + column) + 1] > 0.7 * 3.0 / focal; // reaches the cell's corners
        assert_true(closed > 0.98 * (double)inner);
        free(axes);
        patina_cloud_destroy(cloud);
        free(scan);
    }
}

// No footprint is wider than its cell allows; bars stay narrow, and the wall is closed.
static void test_footprints(void **state)
{
    (void)state;
    struct scan *scan = make_scan();
    patina_cloud *cloud = cloud_of(scan);
    const patina_analysis_desc desc = {.struct_size = sizeof desc, .station_count = 1, .stations = station};
    assert_int_equal(patina_cloud_analyse(cloud, &desc, NULL), PATINA_OK);
    float *axes = calloc(scan->count, 2 * sizeof *axes);
    const patina_neighbourhoods wanted = {.struct_size = sizeof wanted, .half_axes = axes};
    assert_int_equal(patina_cloud_neighbourhoods(cloud, &wanted, NULL), PATINA_OK);
    uint64_t bars = 0, narrow = 0, walls = 0, closed = 0;
    for (uint64_t i = 0; i < scan->count; i++) {
        double square = 0.0;
        for (int k = 0; k < 3; k++)
            square += (scan->position[i][k] - station[k]) * (scan->position[i][k] - station[k]);
        const double interval = sqrt(square) * step, facing = (scan->position[i][1] - station[1]) / sqrt(square);
        assert_true((double)axes[2 * i] < 1.3 * interval / facing * 1.3); // classes are 1.19 apart
        bars += scan->bar[i];
        narrow += scan->bar[i] && (double)axes[2 * i + 1] < 0.75 * interval;
        if (fabs(scan->position[i][2] - station[2]) < 1.5 && scan->position[i][0] < 1.5 && scan->position[i][0] > -1.0) {
            walls++;
            closed += (double)axes[2 * i + 1] > 0.72 * interval;
        }
    }
    assert_true(bars > 500 && walls > 3000);
    assert_true(narrow >= 0.95 * bars);
    assert_true(closed >= 0.995 * walls);
    free(axes);
    patina_cloud_destroy(cloud);
    free(scan);
}

// Few samples, or a station where the point is, say nothing.
static void test_unknown(void **state)
{
    (void)state;
    const double p[3] = {0.0, 0.0, 0.0};
    const struct pt_sample none = {.count = 0};
    struct pt_beam beam = {.place = {0.0, 0.0, 0.0}, .interval = {step, step, 0}};
    struct pt_neighbourhood hood = {
        .has_normal = 1, .normal = {0, 0, 1}, .axis = {1, 0, 0}, .major = 2.0, .minor = 1.0, .certainty = 1.0};
    pt_beam_limit(&beam, p, &none, &hood);
    assert_true(hood.major == 2.0 && hood.minor == 1.0);
    beam.place[0] = 10.0;
    beam.interval.azimuth = beam.interval.elevation = 0.0;
    pt_beam_limit(&beam, p, &none, &hood);
    assert_true(hood.major == 2.0 && hood.minor == 1.0);
    beam.interval.azimuth = beam.interval.elevation = step; // seen edge-on: finite, and along the beam
    pt_beam_limit(&beam, p, &none, &hood);
    assert_true(isfinite(hood.major) && hood.major < 2.1 && hood.minor > 0.0);
}

// Five strays far above an even plane, with no station, stay dots that do not touch.
static void test_strays(void **state)
{
    (void)state;
    enum { SIDE = 120, STRAYS = 5, COUNT = SIDE * SIDE + STRAYS };
    static double p[COUNT][3];
    static float axes[COUNT][2];
    static const double stray[STRAYS][3] = {{20, 30, 70}, {31, 38, 76}, {26, 49, 64}, {42, 33, 72}, {37, 55, 81}};
    for (int i = 0; i < SIDE * SIDE; i++) {
        p[i][0] = i % SIDE + 0.2 * sin(12.9 * i);
        p[i][1] = i / SIDE + 0.2 * sin(78.2 * i);
    }
    memcpy(p + SIDE * SIDE, stray, sizeof stray);
    patina_cloud *cloud = NULL;
    const patina_cloud_desc desc = {.struct_size = sizeof desc, .count = COUNT, .position = {p, PATINA_FLOAT64, 3, 0}};
    assert_int_equal(patina_cloud_create(&desc, NULL, &cloud), PATINA_OK);
    assert_int_equal(patina_cloud_analyse(cloud, NULL, NULL), PATINA_OK);
    const patina_neighbourhoods wanted = {.struct_size = sizeof wanted, .half_axes = &axes[0][0]};
    assert_int_equal(patina_cloud_neighbourhoods(cloud, &wanted, NULL), PATINA_OK);
    for (int i = SIDE * SIDE; i < COUNT; i++)
        assert_true(axes[i][0] < 6.5f); // half the distance to the next
    patina_cloud_destroy(cloud);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_interval),   cmocka_unit_test(test_steep),   cmocka_unit_test(test_camera),
        cmocka_unit_test(test_footprints), cmocka_unit_test(test_unknown), cmocka_unit_test(test_strays),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
