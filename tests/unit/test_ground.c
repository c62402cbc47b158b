// SPDX-License-Identifier: GPL-3.0-or-later
// Ground and height above it, on an analytic hill with houses, trees, noise and strays below the ground. `test_ground MILLIONS` measures the
// time of so many points in place of the tests.
#include "base/platform.h"
#include "scenes/clouds.h"
#include "scenes/support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { COUNT = 400000, HOUSES = 12, TREES = 60 };

#define EXTENT 160.0

// A ridge whose sides are 30 to 60 degrees steep, a hill of 12 m and a valley.
static double ground_at(double x, double y)
{
    const double a = (x - 50) / 14, b = (y - 60) / 14, ridge = sqrt((x - 125) * (x - 125) + 4);
    return 0.2 * x + 12 * exp(-a * a - b * b) - 4 * exp(-(y - 120) * (y - 120) / 60) + 9 * exp(-ridge / 8) * (0.5 + y / EXTENT);
}

struct site {
    double (*points)[3];
    double *above;      // the ground
    uint8_t *is_ground; // 1: yes, 0: no, 2: either
    uint64_t count;
    double houses[HOUSES][5]; // corner, size, height
    double trees[TREES][3];
};

static double gauss(struct pcg *random)
{
    double sum = 0;
    for (int i = 0; i < 12; i++)
        sum += pcg_between(random, -0.5, 0.5);
    return sum;
}

static void furnish(struct site *site, struct pcg *random)
{
    for (int i = 0; i < HOUSES; i++) {
        double *h = site->houses[i];
        h[0] = 5 + 38.0 * (i % 4);
        h[1] = 5 + 52.0 * (double)(i / 4);
        h[2] = i ? pcg_between(random, 6, 18) : 30; // one is large
        h[3] = i ? pcg_between(random, 6, 18) : 24;
        h[4] = pcg_between(random, 3, 9);
    }
    for (int i = 0; i < TREES; i++) {
        site->trees[i][0] = pcg_between(random, 0, EXTENT);
        site->trees[i][1] = pcg_between(random, 0, EXTENT);
        site->trees[i][2] = pcg_between(random, 1.5, 4);
    }
}

// A point on a roof over the place, as houses have flat roofs over the highest ground of their corners; 0 where there is none.
static double roof_over(const struct site *site, double x, double y)
{
    for (int i = 0; i < HOUSES; i++) {
        const double *h = site->houses[i];
        if (x < h[0] || y < h[1] || x > h[0] + h[2] || y > h[1] + h[3])
            continue;
        double most = -1e9;
        for (int corner = 0; corner < 9; corner++)
            most = fmax(most, ground_at(h[0] + h[2] * (corner % 3) / 2, h[1] + h[3] * (corner / 3) / 2.0));
        return most + h[4];
    }
    return -1e9;
}

static double crown_over(const struct site *site, double x, double y, struct pcg *random)
{
    for (int i = 0; i < TREES; i++) {
        const double *t = site->trees[i], dx = x - t[0], dy = y - t[1], square = t[2] * t[2] - dx * dx - dy * dy;
        if (square > 0 && pcg_between(random, 0, 1) < 0.7) // a third of the beams reach the ground
            return 2 + t[2] + pcg_between(random, -1, 1) * sqrt(square);
    }
    return 0;
}

static struct site make_site(uint64_t count, const double origin[3])
{
    struct site site = {.points = malloc(count * sizeof *site.points),
                        .above = malloc(count * sizeof *site.above),
                        .is_ground = malloc(count),
                        .count = count};
    struct pcg random = pcg_seed(11);
    furnish(&site, &random);
    for (uint64_t i = 0; i < count; i++) {
        const double x = pcg_between(&random, 0, EXTENT), y = pcg_between(&random, 0, EXTENT), z = ground_at(x, y);
        const double roof = roof_over(&site, x, y), crown = crown_over(&site, x, y, &random);
        double above = roof > -1e8 ? roof - z : crown > 0.6 ? crown : 0;
        above += 0.02 * gauss(&random);
        if (i % 20011 == 5)
            above = pcg_between(&random, -30, -3); // a stray
        site.is_ground[i] = fabs(above) < 0.4 ? 1 : fabs(above) > 0.6 ? 0 : 2;
        site.above[i] = above;
        site.points[i][0] = origin[0] + x;
        site.points[i][1] = origin[1] + y;
        site.points[i][2] = origin[2] + z + above;
    }
    return site;
}

static void free_site(struct site *site)
{
    free(site->points);
    free(site->above);
    free(site->is_ground);
}

static patina_ground_desc describe(const struct site *site)
{
    return (patina_ground_desc){
        .struct_size = sizeof(patina_ground_desc), .count = site->count, .position = {site->points, PATINA_FLOAT64, 3, 0}};
}

static void check_site(const struct site *site, const float *height, const uint8_t *ground)
{
    uint64_t good = 0, counted = 0, grounds = 0, missed = 0, wrong = 0;
    double sum = 0, worst = 0;
    for (uint64_t i = 0; i < site->count; i++) {
        assert_true(isfinite(height[i]));
        if (site->is_ground[i] == 2)
            continue;
        counted++;
        good += ground[i] == site->is_ground[i];
        missed += site->is_ground[i] && !ground[i];
        wrong += !site->is_ground[i] && ground[i];
        const double error = (double)height[i] - site->above[i];
        sum += error * error;
        worst = fmax(worst, fabs(error));
        grounds += site->is_ground[i];
    }
    print_message(
        "  hill: %.2f %% agree (%.2f %% of the ground missed, %.2f %% of the rest taken for ground), height error %.3f RMS, "
        "%.2f worst\n",
        100.0 * (double)good / (double)counted, 100.0 * (double)missed / (double)grounds,
        100.0 * (double)wrong / (double)(counted - grounds), sqrt(sum / (double)counted), worst);
    assert_true(good > 0.97 * (double)counted);
    assert_true(sqrt(sum / (double)counted) < 0.3);
}

static void test_hill(void **state)
{
    (void)state;
    static const double origins[2][3] = {{0, 0, 0}, {5e6, 5e6, 1000}};
    for (int k = 0; k < 2; k++) {
        struct site site = make_site(COUNT, origins[k]);
        float *height = malloc(COUNT * sizeof *height);
        uint8_t *ground = malloc(COUNT);
        const patina_ground_desc desc = describe(&site);
        CHECK(patina_ground(&desc, NULL, height, ground), NULL);
        check_site(&site, height, ground);
        free(height);
        free(ground);
        free_site(&site);
    }
}

static void test_threads_and_defaults(void **state)
{
    (void)state;
    struct site site = make_site(COUNT / 4, (const double[3]){0, 0, 0});
    float *height = malloc(2 * site.count * sizeof *height);
    uint8_t *ground = malloc(2 * site.count);
    patina_ground_desc desc = describe(&site);
    CHECK(patina_ground_defaults(&desc), NULL);
    assert_true(desc.cell > 0.4 && desc.cell < 2 && desc.threshold == desc.cell && desc.largest == 100 * desc.cell);
    desc.threads = 1;
    CHECK(patina_ground(&desc, NULL, height, ground), NULL);
    desc.threads = 4;
    CHECK(patina_ground(&desc, NULL, height + site.count, ground + site.count), NULL);
    assert_memory_equal(height, height + site.count, site.count * sizeof *height);
    assert_memory_equal(ground, ground + site.count, site.count);
    free(height);
    free(ground);
    free_site(&site);
}

static void test_odd_clouds(void **state)
{
    (void)state;
    double points[40][3];
    float height[40];
    uint8_t ground[40];
    for (int i = 0; i < 40; i++)
        for (int k = 0; k < 3; k++)
            points[i][k] = k < 2 ? (k ? i / 8 : i % 8) : 3;
    patina_ground_desc desc = {.struct_size = sizeof desc, .count = 40, .position = {points, PATINA_FLOAT64, 3, 0}};
    points[5][0] = NAN;
    points[6][2] = INFINITY;
    points[7][0] = 1e9; // beside all others
    CHECK(patina_ground(&desc, NULL, height, ground), NULL);
    for (int i = 0; i < 40; i++) {
        const int beside = i >= 5 && i <= 7;
        assert_true(beside ? isnan(height[i]) && !ground[i] : fabsf(height[i]) < 1e-6f && ground[i]);
    }
    desc.cell = 0.5;
    desc.count = 1;
    CHECK(patina_ground(&desc, NULL, height, NULL), NULL);
    assert_true(height[0] == 0);
    desc.cell = 0;
    assert_int_equal(patina_ground(&desc, NULL, height, ground), PATINA_ERROR_EMPTY);
    desc.count = 0;
    CHECK(patina_ground(&desc, NULL, NULL, NULL), NULL);
    desc.count = 40;
    desc.cell = 1e-5;
    height[0] = 9;
    assert_int_equal(patina_ground(&desc, NULL, height, ground), PATINA_ERROR_ARGUMENT);
    assert_true(height[0] == 9);
    desc.cell = -1;
    assert_int_equal(patina_ground(&desc, NULL, height, ground), PATINA_ERROR_ARGUMENT);
    for (int i = 0; i < 40; i++)
        points[i][1] = NAN;
    desc.cell = 0;
    CHECK(patina_ground(&desc, NULL, height, ground), NULL);
    assert_true(isnan(height[0]));
}

struct run {
    const patina_ground_desc *desc;
    float *height;
};

static int start(void *context, patina_progress *progress, patina_task **task)
{
    const struct run *run = context;
    run->height[0] = 7;
    return patina_task_ground(run->desc, progress, run->height, NULL, task);
}

static void test_cancel(void **state)
{
    (void)state;
    struct site site = make_site(COUNT, (const double[3]){0, 0, 0});
    float *height = malloc(COUNT * sizeof *height);
    patina_ground_desc desc = describe(&site);
    desc.cell = 0.05; // 10 million cells
    const double start_of_whole = support_processor_seconds();
    CHECK(patina_ground(&desc, NULL, height, NULL), NULL);
    const double whole = support_processor_seconds() - start_of_whole;
    const double late = support_cancel(start, &(struct run){&desc, height});
    print_message("  %.0f %% of the work came after the cancel\n", 100.0 * late / whole);
    assert_true(height[0] == 7);
    assert_true(late < 0.25 * whole);
    free(height);
    free_site(&site);
}

static int measure(uint64_t count)
{
    struct site site = make_site(count, (const double[3]){0, 0, 0});
    float *height = malloc(count * sizeof *height);
    uint8_t *ground = malloc(count);
    for (uint64_t i = 0; i < count; i++) // as wide as terrain
        for (int k = 0; k < 2; k++)
            site.points[i][k] *= 6;
    const patina_ground_desc desc = describe(&site);
    const double begin = pt_milliseconds();
    const clock_t work = clock();
    const int code = patina_ground(&desc, NULL, height, ground);
    print_message("%llu points: %.2f s, %.2f s of processors\n", (unsigned long long)count, 1e-3 * (pt_milliseconds() - begin),
                  (double)(clock() - work) / CLOCKS_PER_SEC);
    free(height);
    free(ground);
    free_site(&site);
    return code != 0;
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_hill), cmocka_unit_test(test_threads_and_defaults),
                                       cmocka_unit_test(test_odd_clouds), cmocka_unit_test(test_cancel)};
    if (argc > 1 && argv[1][0] >= '1' && argv[1][0] <= '9')
        return measure(1000000ull * strtoull(argv[1], NULL, 10));
    return cmocka_run_group_tests(tests, NULL, NULL);
}
