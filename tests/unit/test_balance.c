// SPDX-License-Identifier: GPL-3.0-or-later
// Balancing scans: known gains come back from noisy colors with wrong ones among them; what overlaps nothing, has no light or one color
// stays; the same bits for any number of threads.
#include "base/color.h"
#include "scenes/clouds.h"
#include "scenes/support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STRIP = 6000, SCANS = 6, POINTS = STRIP * SCANS };

struct scanned {
    double position[POINTS][3];
    uint8_t bytes[POINTS][3];
    float floats[POINTS][3];
    uint16_t scan[POINTS];
};

// Strips of a wall, each half over the next, in light that its scan multiplied by gains. `wrong` of the points have any color.
static struct scanned *strips(const double gains[SCANS][3], double apart, double wrong, uint32_t seed)
{
    struct scanned *s = calloc(1, sizeof *s);
    struct pcg random = pcg_seed(seed);
    for (uint32_t i = 0; i < POINTS; i++) {
        const uint32_t scan = i / STRIP;
        const double x = scan * apart + pcg_between(&random, 0, 2), y = pcg_between(&random, 0, 2);
        const int off = pcg_between(&random, 0, 1) < wrong;
        s->position[i][0] = x;
        s->position[i][1] = y;
        s->scan[i] = (uint16_t)scan;
        for (int k = 0; k < 3; k++) {
            const double light = 0.18 + 0.1 * sin(5 * x + k) * cos(4 * y) + pcg_between(&random, -0.02, 0.02);
            const double seen = off ? pcg_between(&random, 0, 1) : fmin(1, light * gains[scan][k]);
            s->bytes[i][k] = (uint8_t)(255 * srgb_of_linear(seen) + 0.5);
            s->floats[i][k] = (float)seen;
        }
    }
    return s;
}

static patina_cloud *cloud_of(const struct scanned *s, int floats, uint32_t threads)
{
    return floats ? cloud_of_colors(POINTS, s->position, s->floats, PATINA_FLOAT32, threads)
                  : cloud_of_colors(POINTS, s->position, s->bytes, PATINA_UINT8, threads);
}

// The worst factor between gains * found, of each scan in parts of that of the first.
static double spread(const double gains[SCANS][3], const float found[SCANS][3])
{
    double worst = 0;
    for (int scan = 1; scan < SCANS; scan++)
        for (int k = 0; k < 3; k++)
            worst = fmax(worst, fabs(log(gains[scan][k] * (double)found[scan][k] / (gains[0][k] * (double)found[0][k]))));
    return worst;
}

static const double exposures[SCANS][3] = {{1, 1, 1},     {0.6, 0.6, 0.6}, {1.5, 1.4, 1.2},
                                           {1, 0.8, 0.7}, {0.7, 0.9, 1.3}, {1.8, 1.8, 1.8}};

static void test_known_gains(void **state)
{
    (void)state;
    for (int floats = 0; floats < 2; floats++) {
        struct scanned *s = strips(exposures, 1.0, 0.1, 3);
        patina_cloud *cloud = cloud_of(s, floats, 1), *wide = cloud_of(s, floats, 5);
        float found[SCANS][3], again[SCANS][3];
        CHECK(patina_cloud_balance(cloud, s->scan, SCANS, NULL, &found[0][0]), cloud);
        CHECK(patina_cloud_balance(wide, s->scan, SCANS, NULL, &again[0][0]), wide);
        assert_memory_equal(found, again, sizeof found);
        const double worst = spread(exposures, (const float(*)[3])found);
        print_message(
            "  %s: scans were up to %.2f apart, and are %.3f now\n", floats ? "floats" : "bytes",
            spread(exposures, (const float[SCANS][3]){{1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}}),
            worst);
        assert_true(worst < 0.05);
        for (int k = 0; k < 3; k++) {
            double sum = 0;
            for (int scan = 0; scan < SCANS; scan++)
                sum += (double)found[scan][k];
            assert_true(fabs(sum / SCANS - 1) < 1e-5);
        }
        patina_cloud_destroy(cloud);
        patina_cloud_destroy(wide);
        free(s);
    }
}

static void expect_ones(const struct scanned *s, const patina_cloud *cloud, uint32_t count)
{
    float *found = malloc(3 * (size_t)count * sizeof *found);
    CHECK(patina_cloud_balance(cloud, s->scan, count, NULL, found), cloud);
    for (size_t i = 0; i < 3 * (size_t)count; i++)
        assert_true(found[i] == 1.0f);
    free(found);
}

static void test_nothing_to_balance(void **state)
{
    (void)state;
    struct scanned *s = strips(exposures, 3.0, 0.0, 4); // a meter between strips
    patina_cloud *cloud = cloud_of(s, 0, 0);
    expect_ones(s, cloud, SCANS);
    expect_ones(s, cloud, 1);
    patina_cloud_destroy(cloud);
    free(s);
    s = strips(exposures, 1.0, 0.0, 5);
    memset(s->bytes, 0, sizeof s->bytes); // all black
    cloud = cloud_of(s, 0, 0);
    expect_ones(s, cloud, SCANS);
    patina_cloud_destroy(cloud);
    memset(s->bytes, 90, sizeof s->bytes); // one color
    cloud = cloud_of(s, 0, 0);
    expect_ones(s, cloud, SCANS);
    patina_cloud_destroy(cloud);
    for (uint32_t i = 0; i < POINTS; i++)
        s->floats[i][i % 3] = i % 2 ? NAN : INFINITY;
    cloud = cloud_of(s, 1, 0);
    expect_ones(s, cloud, SCANS);
    patina_cloud_destroy(cloud);
    memset(s->position, 0, sizeof s->position); // all at one place
    memset(s->bytes, 90, sizeof s->bytes);
    cloud = cloud_of(s, 0, 0);
    expect_ones(s, cloud, SCANS);
    patina_cloud_destroy(cloud);
    free(s);
}

// A wrong color on nearly half of the overlap, and a factor beyond the bound.
static void test_bounds(void **state)
{
    (void)state;
    static const double far[SCANS][3] = {{1, 1, 1}, {0.02, 0.02, 0.02}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}};
    struct scanned *s = strips(far, 1.0, 0.0, 6);
    patina_cloud *cloud = cloud_of(s, 1, 0);
    float found[SCANS][3];
    CHECK(patina_cloud_balance(cloud, s->scan, SCANS, NULL, &found[0][0]), cloud);
    for (int scan = 0; scan < SCANS; scan++)
        for (int k = 0; k < 3; k++)
            assert_true(found[scan][k] >= 0.25f && found[scan][k] <= 4.0f);
    assert_true(found[1][0] == 4.0f);
    patina_cloud_destroy(cloud);
    free(s);
}

static void test_many_scans(void **state)
{
    (void)state;
    enum { MANY = 10000, EACH = 40 };
    double *position = calloc(3 * MANY * EACH, sizeof *position);
    uint8_t *color = calloc(3 * MANY * EACH, 1);
    uint16_t *scan = calloc(MANY * EACH, sizeof *scan);
    struct pcg random = pcg_seed(7);
    for (uint32_t i = 0; i < MANY * EACH; i++) { // squares of two by two on a lattice of one by one
        const uint32_t of = i / EACH;
        position[3 * i] = of % 100 + pcg_between(&random, 0, 2);
        position[3 * i + 1] = of / 100 + pcg_between(&random, 0, 2); // NOLINT: rows
        scan[i] = (uint16_t)of;
        memset(color + 3 * i, of % 2 ? 120 : 150, 3);
    }
    patina_cloud *cloud = cloud_of_colors(MANY * EACH, position, color, PATINA_UINT8, 0);
    float *found = malloc(3 * MANY * sizeof *found);
    CHECK(patina_cloud_balance(cloud, scan, MANY, NULL, found), cloud);
    uint32_t near = 0;
    const double wanted = pt_linear_of_srgb(150 / 255.0) / pt_linear_of_srgb(120 / 255.0);
    for (uint32_t i = 0; i + 1 < MANY; i += 2)
        near += fabs(log((double)(found[3 * (i + 1)] / found[3 * i]) / wanted)) < 0.1;
    print_message("  10,000 scans: %u of 5,000 neighbors within 10 %%\n", near);
    assert_true(near > 4500);
    patina_grade *grade = NULL;
    patina_scan_grade *grades = calloc(MANY, sizeof *grades);
    for (uint32_t i = 0; i < MANY; i++)
        grades[i] = (patina_scan_grade){1, 1, 1, 0};
    CHECK(patina_grade_create_balanced(cloud, scan, grades, found, MANY, 0, &grade), cloud);
    patina_grade_destroy(grade);
    free(grades);
    free(found);
    free(position);
    free(color);
    free(scan);
    patina_cloud_destroy(cloud);
}

static void test_refusals(void **state)
{
    (void)state;
    struct scanned *s = strips(exposures, 1.0, 0.0, 8);
    patina_cloud *cloud = cloud_of(s, 0, 0);
    float found[SCANS][3];
    const patina_array none = {0};
    patina_progress *progress = NULL;
    assert_int_equal(patina_cloud_balance(NULL, s->scan, SCANS, NULL, &found[0][0]), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_cloud_balance(cloud, NULL, SCANS, NULL, &found[0][0]), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_cloud_balance(cloud, s->scan, 0, NULL, &found[0][0]), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_cloud_balance(cloud, s->scan, 65536, NULL, &found[0][0]), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_cloud_balance(cloud, s->scan, SCANS, NULL, NULL), PATINA_ERROR_ARGUMENT);
    CHECK(patina_progress_create(&progress), NULL);
    patina_progress_cancel(progress);
    assert_int_equal(patina_cloud_balance(cloud, s->scan, SCANS, progress, &found[0][0]), PATINA_ERROR_CANCELLED);
    patina_progress_destroy(progress);
    CHECK(patina_cloud_set_colors(cloud, &none), cloud);
    assert_int_equal(patina_cloud_balance(cloud, s->scan, SCANS, NULL, &found[0][0]), PATINA_ERROR_EMPTY);
    patina_cloud_destroy(cloud);
    free(s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_known_gains), cmocka_unit_test(test_nothing_to_balance), cmocka_unit_test(test_bounds),
        cmocka_unit_test(test_many_scans),  cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
