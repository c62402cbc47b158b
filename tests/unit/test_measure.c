// SPDX-License-Identifier: GPL-3.0-or-later
// The distance between clouds against closed forms: planes with noise, spheres; where it is not known; the same bits for any number of
// threads; cancel.
#include "scenes/clouds.h"
#include "scenes/support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 100, PLANE = SIDE * SIDE, BALL = 20000 };

static double gauss(struct pcg *random)
{
    double sum = 0;
    for (int i = 0; i < 12; i++)
        sum += pcg_between(random, -0.5, 0.5);
    return sum;
}

// Points of a tilted plane, 1 by 1, `above` along its normal.
static double (*plane(double above, double noise, uint32_t seed, const double origin[3]))[3]
{
    double(*points)[3] = malloc(PLANE * sizeof *points);
    struct pcg random = pcg_seed(seed);
    const double slope = 0.3, length = sqrt(1 + slope * slope);
    for (int i = 0; i < PLANE; i++) {
        const double x = pcg_between(&random, 0, 1), y = pcg_between(&random, 0, 1), h = above + noise * gauss(&random);
        points[i][0] = origin[0] + x - slope / length * h;
        points[i][1] = origin[1] + y;
        points[i][2] = origin[2] + slope * x + h / length;
    }
    return points;
}

static patina_distance_desc describe(double (*one)[3], uint64_t count, double (*other)[3], uint64_t other_count)
{
    return (patina_distance_desc){.struct_size = sizeof(patina_distance_desc),
                                  .count = count,
                                  .other_count = other_count,
                                  .position = {one, PATINA_FLOAT64, 3, 0},
                                  .other = {other, PATINA_FLOAT64, 3, 0}};
}

static const double zero[3] = {0, 0, 0}, far[3] = {5e6, 5e6, 300};

static void check_planes(const double origin[3])
{
    const double above = 0.05, noise = 0.004;
    double(*one)[3] = plane(0, noise, 1, origin), (*other)[3] = plane(above, noise, 2, origin);
    float *distance = malloc(PLANE * sizeof *distance), *interval = malloc(PLANE * sizeof *interval);
    patina_distance_desc desc = describe(one, PLANE, other, PLANE);
    desc.cylinder = 0.06;
    desc.normal_scale = 0.24; // normals are worth 1/16 of the noise then
    CHECK(patina_cloud_distance(&desc, NULL, distance, interval), NULL);
    double sum = 0, width = 0;
    int within = 0, count = 0;
    for (int i = 0; i < PLANE; i++) {
        assert_true(isfinite(distance[i]) == isfinite(interval[i]));
        const double x = one[i][0] - origin[0], y = one[i][1] - origin[1];
        if (x < 0.15 || x > 0.85 || y < 0.15 || y > 0.85)
            continue;
        assert_true(isfinite(distance[i]));
        sum += (double)distance[i] - above;
        width += (double)interval[i];
        within += fabs((double)distance[i] - above) <= (double)interval[i];
        count++;
    }
    print_message("  planes: mean error %.2e, mean interval %.2e, %.1f %% within it\n", sum / count, width / count,
                  100.0 * within / count);
    assert_true(fabs(sum / count) < 2.5e-4); // three standard errors of 170 cylinders
    assert_true(width / count < 1.96 * noise * sqrt(2.0 / 24) && width / count > 1.96 * noise * sqrt(2.0 / 34));
    assert_true(within > 0.92 * count && within < 0.98 * count);
    free(one);
    free(other);
    free(distance);
    free(interval);
}

static void test_planes(void **state)
{
    (void)state;
    check_planes(zero);
    check_planes(far);
}

// The same from float32 around an origin.
static void test_origins(void **state)
{
    (void)state;
    double(*one)[3] = plane(0, 0, 1, zero), (*other)[3] = plane(0.05, 0, 2, zero);
    float(*narrow)[3] = malloc(PLANE * sizeof *narrow), *found = malloc(4 * PLANE * sizeof *found);
    double(*moved)[3] = plane(0.05, 0, 2, far);
    for (int i = 0; i < PLANE; i++)
        for (int k = 0; k < 3; k++)
            narrow[i][k] = (float)one[i][k];
    patina_distance_desc desc = describe(NULL, PLANE, moved, PLANE);
    desc.position = (patina_array){narrow, PATINA_FLOAT32, 3, 0};
    memcpy(desc.origin, far, sizeof far);
    CHECK(patina_cloud_distance(&desc, NULL, found, found + PLANE), NULL);
    int count = 0;
    for (int i = 0; i < PLANE; i++)
        if (one[i][0] > 0.2 && one[i][0] < 0.8 && one[i][1] > 0.2 && one[i][1] < 0.8) {
            assert_true(fabs((double)found[i] - 0.05) < 1e-6);
            count++;
        }
    assert_true(count > PLANE / 4);
    free(one);
    free(other);
    free(narrow);
    free(moved);
    free(found);
}

static double (*ball(double radius, uint32_t seed))[3]
{
    double(*points)[3] = malloc(BALL * sizeof *points);
    struct pcg random = pcg_seed(seed);
    for (int i = 0; i < BALL; i++) {
        const double z = pcg_between(&random, -1, 1), angle = pcg_between(&random, 0, 2 * 3.14159265358979);
        points[i][0] = radius * sqrt(1 - z * z) * cos(angle);
        points[i][1] = radius * sqrt(1 - z * z) * sin(angle);
        points[i][2] = radius * z;
    }
    return points;
}

// Shells: a cap of radius a on a sphere lies a^2 / 4 R below its tangent plane in the mean. The far side of the sphere does not mix in, though
// the cylinder may be as long.
static void test_spheres(void **state)
{
    (void)state;
    double(*one)[3] = ball(1.0, 3), (*other)[3] = ball(1.1, 4);
    float *distance = malloc(2 * BALL * sizeof *distance);
    const double cylinder = 0.2, flat = cylinder * cylinder / 16, cap = BALL * cylinder * cylinder / 16;
    patina_distance_desc desc = describe(one, BALL, other, BALL);
    desc.cylinder = cylinder;
    desc.depth = 5;
    desc.normal = (patina_array){one, PATINA_FLOAT64, 3, 0}; // outwards
    double sum = 0, worst = 0;
    CHECK(patina_cloud_distance(&desc, NULL, distance, distance + BALL), NULL);
    for (int i = 0; i < BALL; i++) {
        const double wanted = 0.1 + flat * (1 - 1 / 1.1) - flat / cap; // the point itself is always in its cap
        assert_true(isfinite(distance[i]));
        sum += (double)distance[i] - wanted;
        worst = fmax(worst, fabs((double)distance[i] - wanted));
    }
    print_message("  spheres: mean error %.2e, worst %.2e\n", sum / BALL, worst);
    assert_true(fabs(sum / BALL) < 4.5e-5 && worst < 2e-3);
    desc.normal_scale = 0.2; // found: on the side of the given ones
    CHECK(patina_cloud_distance(&desc, NULL, distance, distance + BALL), NULL);
    for (int i = 0; i < BALL; i++)
        assert_true(distance[i] > 0.09f && distance[i] < 0.12f);
    desc.normal = (patina_array){0}; // outwards in the upper half
    CHECK(patina_cloud_distance(&desc, NULL, distance, distance + BALL), NULL);
    for (int i = 0; i < BALL; i++)
        assert_true(one[i][2] < 0 || distance[i] > 0.09f);
    free(one);
    free(other);
    free(distance);
}

// A wall of two faces, 0.3 apart: each face is compared with its own.
static void test_back_faces(void **state)
{
    (void)state;
    double(*one)[3] = malloc(2 * PLANE * sizeof *one), (*other)[3] = malloc(2 * PLANE * sizeof *other);
    float *found = malloc(4 * PLANE * sizeof *found);
    struct pcg random = pcg_seed(8);
    for (int i = 0; i < 2 * PLANE; i++)
        for (int which = 0; which < 2; which++) {
            double *p = (which ? other : one)[i];
            p[0] = pcg_between(&random, 0, 1);
            p[1] = (i < PLANE ? 0 : 0.3) + 0.002 * gauss(&random) + (which ? 0.01 : 0);
            p[2] = pcg_between(&random, 0, 1);
        }
    patina_distance_desc desc = describe(one, 2 * PLANE, other, 2 * PLANE);
    desc.depth = 2;
    CHECK(patina_cloud_distance(&desc, NULL, found, found + 2 * PLANE), NULL);
    for (int i = 0; i < 2 * PLANE; i++)
        if (one[i][0] > 0.2 && one[i][0] < 0.8 && one[i][2] > 0.2 && one[i][2] < 0.8) // outwards: y grows on the second face
            assert_true(fabs((double)found[i] - (i < PLANE ? -0.01 : 0.01)) < 0.003);
    free(one);
    free(other);
    free(found);
}

static void test_unknown(void **state)
{
    (void)state;
    double(*one)[3] = plane(0, 0.001, 1, zero), (*other)[3] = plane(0.05, 0.001, 2, zero);
    float *found = malloc(2 * PLANE * sizeof *found);
    patina_distance_desc desc = describe(one, PLANE, other, PLANE);
    one[7][0] = NAN;
    one[8][2] = INFINITY;
    one[9][1] = 1e30;
    for (int i = 0; i < PLANE; i++)
        other[i][0] = i % 5 ? other[i][0] : NAN;
    CHECK(patina_cloud_distance(&desc, NULL, found, found + PLANE), NULL);
    for (int i = 0; i < PLANE; i++)
        assert_true((i < 7 || i > 9) || (isnan(found[i]) && isnan(found[PLANE + i])));
    desc.depth = 0.02; // the other cloud is farther
    CHECK(patina_cloud_distance(&desc, NULL, found, found + PLANE), NULL);
    for (int i = 0; i < PLANE; i++)
        assert_true(isnan(found[i]) && isnan(found[PLANE + i]));
    desc.other_count = 0;
    CHECK(patina_cloud_distance(&desc, NULL, found, found + PLANE), NULL);
    assert_true(isnan(found[0]));
    desc = describe(one, 1, other, PLANE); // one point has no normal
    CHECK(patina_cloud_distance(&desc, NULL, found, found + PLANE), NULL);
    assert_true(isnan(found[0]) && isnan(found[PLANE]));
    for (int i = 0; i < PLANE; i++)
        memcpy(one[i], zero, sizeof zero); // all at one place
    desc = describe(one, PLANE, other, PLANE);
    CHECK(patina_cloud_distance(&desc, NULL, found, found + PLANE), NULL);
    assert_true(isnan(found[0]));
    desc.normal = (patina_array){&far, PATINA_FLOAT64, 3, 0};
    desc = describe(one, PLANE, one, PLANE);
    assert_int_equal(patina_cloud_distance(&desc, NULL, found, found + PLANE), PATINA_ERROR_EMPTY);
    assert_int_equal(patina_distance_defaults(&desc), PATINA_ERROR_EMPTY);
    free(one);
    free(other);
    free(found);
}

static void test_refusals(void **state)
{
    (void)state;
    double(*one)[3] = plane(0, 0.001, 1, zero);
    float found[2] = {5, 5};
    patina_distance_desc desc = describe(one, PLANE, one, PLANE);
    assert_int_equal(patina_cloud_distance(NULL, NULL, found, found), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_cloud_distance(&desc, NULL, NULL, found), PATINA_ERROR_ARGUMENT);
    desc.cylinder = NAN;
    assert_int_equal(patina_cloud_distance(&desc, NULL, found, found), PATINA_ERROR_ARGUMENT);
    desc.cylinder = -1;
    assert_int_equal(patina_cloud_distance(&desc, NULL, found, found), PATINA_ERROR_ARGUMENT);
    desc.cylinder = 0;
    desc.position.type = PATINA_INT32;
    assert_int_equal(patina_cloud_distance(&desc, NULL, found, found), PATINA_ERROR_ARGUMENT);
    desc = describe(one, 1ull << 31, one, PLANE);
    assert_int_equal(patina_cloud_distance(&desc, NULL, found, found), PATINA_ERROR_TOO_MANY_POINTS);
    desc = describe(one, 0, NULL, 0);
    assert_int_equal(patina_cloud_distance(&desc, NULL, NULL, NULL), PATINA_OK);
    assert_true(found[0] == 5 && found[1] == 5);
    free(one);
}

static void test_threads(void **state)
{
    (void)state;
    double(*one)[3] = plane(0, 0.004, 1, zero), (*other)[3] = plane(0.05, 0.004, 2, zero);
    float *found = malloc(4 * PLANE * sizeof *found);
    patina_distance_desc desc = describe(one, PLANE, other, PLANE);
    CHECK(patina_distance_defaults(&desc), NULL);
    assert_true(desc.cylinder > 0.05 && desc.cylinder < 0.08 && desc.normal_scale > desc.cylinder &&
                desc.depth > desc.cylinder);
    desc.threads = 1;
    CHECK(patina_cloud_distance(&desc, NULL, found, found + PLANE), NULL);
    desc.threads = 4;
    CHECK(patina_cloud_distance(&desc, NULL, found + 2 * PLANE, found + 3 * PLANE), NULL);
    assert_memory_equal(found, found + 2 * PLANE, 2 * PLANE * sizeof *found);
    free(one);
    free(other);
    free(found);
}

struct run {
    const patina_distance_desc *desc;
    float *found;
};

static int start(void *context, patina_progress *progress, patina_task **task)
{
    const struct run *run = context;
    run->found[0] = 7;
    return patina_task_cloud_distance(run->desc, progress, run->found, run->found + PLANE, task);
}

static void test_cancel(void **state)
{
    (void)state;
    double(*one)[3] = plane(0, 0.004, 1, zero);
    float *found = malloc(2 * PLANE * sizeof *found);
    patina_distance_desc desc = describe(one, PLANE, one, PLANE);
    desc.normal_scale = 0.5; // many points for each
    const double start_of_whole = support_processor_seconds();
    CHECK(patina_cloud_distance(&desc, NULL, found, found + PLANE), NULL);
    const double whole = support_processor_seconds() - start_of_whole;
    const double late = support_cancel(start, &(struct run){&desc, found});
    print_message("  %.2f s of work; %.0f %% of it came after the cancel\n", whole, 100.0 * late / whole);
    assert_true(found[0] == 7);
    assert_true(late < 0.25 * whole);
    free(one);
    free(found);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_planes),  cmocka_unit_test(test_origins),
                                       cmocka_unit_test(test_spheres), cmocka_unit_test(test_back_faces),
                                       cmocka_unit_test(test_unknown), cmocka_unit_test(test_refusals),
                                       cmocka_unit_test(test_threads), cmocka_unit_test(test_cancel)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
