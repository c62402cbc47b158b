// SPDX-License-Identifier: GPL-3.0-or-later
// Expected errors: the table is whole, what lies between its points lies between their values, and a target gets the
// cheapest means that meets it.
#include "plan/expected.h"
#include "plan/plan.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static void test_every_means_is_measured(void **state)
{
    (void)state;
    for (int means = 0; means < PT_MEANS_COUNT; means++) {
        uint32_t quality, fill;
        patina_expected_error dense = pt_expected_error(means, 0.01), sparse = pt_expected_error(means, 50.0);
        assert_true(dense.color > 0.0f && dense.coverage > 0.0f && dense.depth > 0.0f && dense.normal > 0.0f);
        assert_true(sparse.color > dense.color && sparse.coverage > dense.coverage);
        pt_means_settings(means, &quality, &fill);
        assert_int_equal(pt_means_of(quality, fill), means);
        assert_true(dense.doubt >= 1.0f && sparse.doubt == dense.doubt);
    }
}

// Wider apart than was measured errors grow on; where nothing is known they are infinite, and a target still gets the best means.
static void test_beyond_the_curve(void **state)
{
    (void)state;
    for (int means = 0; means <= PT_MEANS_SPLATS; means++) {
        for (double s = 4.6; s < 32.0; s *= 1.1) {
            const patina_expected_error a = pt_expected_error(means, s), b = pt_expected_error(means, 2.0 * s);
            assert_true(b.color > a.color && b.color <= 1.0f && b.coverage <= 1.0f && b.depth > a.depth && b.normal <= 90.0f);
            assert_true(b.color >= fminf(1.4f * a.color, 1.0f));
        }
        static const double unknown[] = {65.0, 120.0, 1e30, 0.0, -1.0, NAN, INFINITY};
        for (size_t i = 0; i < sizeof unknown / sizeof *unknown; i++) {
            const patina_expected_error none = pt_expected_error(means, unknown[i]);
            assert_true(isinf(none.color) && isinf(none.coverage) && isinf(none.depth) && isinf(none.normal) &&
                        none.doubt >= 1.0f);
        }
    }
    assert_true(pt_expected_error(PT_MEANS_REFINED, 60.0).color > 0.1f);
    assert_int_equal(pt_means_for(0.01, 120.0), PT_MEANS_REFINED);
    assert_int_equal(pt_means_for(0.01, 0.0), PT_MEANS_UNFILLED);
}

// The curve has no jumps: a step of a hundredth in spacing changes little.
static void test_between_points(void **state)
{
    (void)state;
    for (int means = 0; means <= PT_MEANS_SPLATS; means++)
        for (double s = 0.1; s < 10.0; s *= 1.01) {
            patina_expected_error a = pt_expected_error(means, s), b = pt_expected_error(means, s * 1.01);
            assert_true(fabsf(b.color - a.color) < 0.01f);
            assert_true(fabsf(b.depth - a.depth) < 0.06f);
        }
}

static void test_cheapest_that_meets(void **state)
{
    (void)state;
    for (double s = 0.1; s < 10.0; s *= 1.1)
        for (double target = 0.001; target < 1.0; target *= 1.3) {
            enum pt_means chosen = pt_means_for(target, s);
            double error = (double)pt_expected_error(chosen, s).color;
            for (int means = 0; means < PT_MEANS_COUNT; means++) {
                double other = (double)pt_expected_error((enum pt_means)means, s).color;
                if (error > target)
                    assert_true(other >= error); // none meets it: the best
                else if (means < (int)chosen)
                    assert_true(other > target);
            }
        }
    // dense points need no filling, sparse ones all of it
    assert_int_equal(pt_means_for(0.01, 0.3), PT_MEANS_UNFILLED);
    assert_int_equal(pt_means_for(1e-6, 4.0), PT_MEANS_REFINED);
}

// A plan follows the target: filling is left out where it is met without, and the reason says so.
static void test_plan(void **state)
{
    (void)state;
    enum { SIDE = 100 };
    static float positions[SIDE * SIDE][3];
    for (int i = 0; i < SIDE * SIDE; i++) {
        positions[i][0] = (float)(i % SIDE) / (SIDE / 2) - 1.0f;
        positions[i][1] = (float)(i / SIDE) / (SIDE / 2) - 1.0f;
    }
    patina_cloud_desc desc = {.struct_size = sizeof desc, .count = SIDE * SIDE, .position = {positions, PATINA_FLOAT32, 3, 0}};
    patina_camera camera = {.struct_size = sizeof camera,
                            .orthographic = 1,
                            .world_from_camera = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 5, 0, 0, 0, 1},
                            .left = -1,
                            .right = 1,
                            .bottom = -1,
                            .top = 1,
                            .near_clip = 0.1,
                            .far_clip = 10};
    patina_cloud *cloud = NULL;
    patina_scene *scene = NULL;
    assert_int_equal(patina_cloud_create(&desc, NULL, &cloud), PATINA_OK);
    assert_int_equal(patina_scene_create(&scene), PATINA_OK);
    assert_int_equal(patina_scene_add_cloud(scene, cloud, NULL), PATINA_OK);
    assert_int_equal(patina_scene_set_camera(scene, &camera), PATINA_OK);
    const struct {
        uint32_t size;
        float target;
        enum pt_means means;
    } cases[] = {{30, 0.02f, PT_MEANS_UNFILLED}, {400, 1e-6f, PT_MEANS_REFINED}, {400, 0.0f, PT_MEANS_REFINED}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        patina_settings settings = {.struct_size = sizeof settings,
                                    .width = cases[i].size,
                                    .height = cases[i].size,
                                    .fill_iterations = 2,
                                    .error_target = cases[i].target};
        struct pt_plan plan;
        uint32_t fills = 0;
        assert_int_equal(patina_scene_set_settings(scene, &settings), PATINA_OK);
        assert_int_equal(pt_plan_create(scene, NULL, &plan), PATINA_OK);
        assert_int_equal(pt_means_of(plan.quality, plan.fill), cases[i].means);
        for (uint32_t k = 0; k < plan.pass_count; k++)
            fills += plan.passes[k].kernel == PT_KERNEL_fill;
        assert_int_equal(fills > 0, cases[i].means != PT_MEANS_UNFILLED);
        assert_float_equal(plan.expected.color, pt_expected_error(cases[i].means, plan.spacing_px).color, 0.0f);
        pt_plan_destroy(&plan);
    }
    patina_settings bad = {.struct_size = sizeof bad, .error_target = -1.0f};
    assert_int_equal(patina_scene_set_settings(scene, &bad), PATINA_ERROR_ARGUMENT);
    bad.error_target = NAN;
    assert_int_equal(patina_scene_set_settings(scene, &bad), PATINA_ERROR_ARGUMENT);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_every_means_is_measured), cmocka_unit_test(test_beyond_the_curve),
                                       cmocka_unit_test(test_between_points), cmocka_unit_test(test_cheapest_that_meets),
                                       cmocka_unit_test(test_plan)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
