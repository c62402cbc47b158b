// SPDX-License-Identifier: GPL-3.0-or-later
// What a plan makes of its view: what is culled, where chunks may fall, what the spacing on screen chooses, and that a region decides as the
// whole picture does (SPEC 8, 13).
#include "plan/passes.h"
#include "plan/ranges.h"
#include "scenes/support.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "square.h" // behind cmocka.h

static void test_spacing_chooses_levels(void **state)
{
    (void)state;
    static const struct {
        double width; // of the window, 1024 pixels: points are 0.01 apart
        uint32_t least_levels, most_levels;
    } cases[] = {{20.0, 0, 0}, {10.0, 0, 0}, {3.0, 1, 2}, {1.0, 3, 4}, {0.1, 5, 5}};
    patina_cloud *cloud = square(1);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        patina_scene *scene = scene_above(cloud, cases[i].width, 1, 0);
        struct pt_plan plan = plan_of(scene);
        double spacing = 0.01 * 1024 / cases[i].width;
        assert_true(fabs(plan.spacing_px / spacing - 1.0) < 0.1);
        assert_in_range(plan.levels, cases[i].least_levels, cases[i].most_levels);
        assert_int_equal(passes_of(&plan, PT_KERNEL_push), plan.levels);
        assert_int_equal(passes_of(&plan, PT_KERNEL_fill), plan.levels + 1);
        pt_plan_destroy(&plan);
        patina_scene_destroy(scene);
    }
    patina_cloud_destroy(cloud);
}

enum { WIDTH = 2048, HEIGHT = 1536 };

// A camera among the points.
static patina_camera look(patina_scene *scene, const double at[3], const double to[3])
{
    patina_camera camera = camera_perspective(at, to, 46.8, WIDTH, HEIGHT, 0.001, 10.0);
    patina_settings settings = {.struct_size = sizeof settings, .width = WIDTH, .height = HEIGHT};
    assert_int_equal(patina_scene_set_camera(scene, &camera), PATINA_OK);
    assert_int_equal(patina_scene_set_settings(scene, &settings), PATINA_OK);
    return camera;
}

static int shows(const patina_camera *camera, const float point[3])
{
    const double world[3] = {(double)point[0], (double)point[1], (double)point[2]};
    double x, y, z;
    camera_project(camera, WIDTH, HEIGHT, world, &x, &y, &z);
    return z > camera->near_clip && x > 0.0 && x < WIDTH && y > 0.0 && y < HEIGHT;
}

// What lies around the camera, partly behind it, is culled where none of it shows, and never where some does.
static void test_chunks_around_the_camera(void **state)
{
    (void)state;
    uint32_t seed = 1, kept = 0, culled = 0;
    patina_cloud *cloud = square(1);
    patina_scene *scene = scene_above(cloud, 2.5, 1, 0);
    uint8_t *drawn = malloc(cloud->slots);
    assert_non_null(drawn);
    for (int i = 0; i < 300; i++) {
        double at[2][3];
        for (int k = 0; k < 6; k++) {
            seed = seed * 1664525u + 1013904223u;
            at[k / 3][k % 3] = (double)(seed >> 8) / (1 << 24) * (k % 3 == 2 ? 0.3 : 2.0) - (k % 3 == 2 ? -0.01 : 1.0);
        }
        const patina_camera camera = look(scene, at[0], at[1]);
        struct pt_plan plan = plan_of(scene);
        memset(drawn, 0, cloud->slots);
        for (uint32_t c = 0; c < plan.instances[0].chunk_count; c++)
            memset(drawn + plan.instances[0].chunks[c].first, 1, plan.instances[0].chunks[c].count);
        for (uint32_t c = 0; c < cloud->chunk_count; c++) {
            const struct pt_chunk *chunk = &cloud->chunks[c];
            for (uint32_t slot = chunk->first; slot < chunk->first + chunk->count; slot++)
                assert_true(drawn[slot] || !shows(&camera, positions[cloud->order[slot]]));
            kept += drawn[chunk->first];
            culled += !drawn[chunk->first];
        }
        pt_plan_destroy(&plan);
    }
    assert_true(4 * culled > 3 * kept); // 2213 and 2587; by bounds on screen alone 1254 and 3546
    free(drawn);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

// A product's translation is in two parts: what float32 leaves over of it is there, in X, in Y and in depth (SPEC 1).
static void test_low_parts(void **state)
{
    (void)state;
    patina_cloud *cloud = square(1);
    patina_scene *scene = scene_above(cloud, 2.5, 1, 0);
    look(scene, (const double[]){0.1, -0.5, 0.6}, (const double[]){0.1, 0.4, 0.0});
    struct pt_plan plan = plan_of(scene);
    const uint32_t count = plan.instances[0].chunk_count;
    uint32_t left_over[3] = {0};
    for (uint32_t c = 0; c < count; c++)
        for (int k = 0; k < 3; k++) {
            const struct chunk_view *view = &plan.instances[0].chunks[c];
            assert_true(fabsf(view->lo[k]) <= 0x1p-24f * fabsf(view->hi[k]));
            left_over[k] += view->lo[k] != 0.0f;
        }
    assert_true(count > 5);
    for (int k = 0; k < 3; k++)
        assert_true(10 * left_over[k] >= 9 * count);
    pt_plan_destroy(&plan);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

// What is hidden is left out by where chunks may fall and how near they may lie: of every point that kernels would draw both hold, as
// kernels reckon in float32.
static void test_places_hold_points(void **state)
{
    (void)state;
    patina_cloud *cloud = square(1);
    patina_scene *scene = scene_above(cloud, 2.5, 1, 0);
    uint32_t seed = 7, drawn = 0, known = 0, straddle = 0;
    for (int i = 0; i < 100; i++) {
        double at[2][3];
        for (int k = 0; k < 6; k++) {
            seed = seed * 1664525u + 1013904223u;
            at[k / 3][k % 3] = (double)(seed >> 8) / (1 << 24) * (k % 3 == 2 ? 0.3 : 2.0) - (k % 3 == 2 ? -0.01 : 1.0);
        }
        look(scene, at[0], at[1]);
        scene->camera.orthographic = i % 4 == 0;
        struct pt_plan plan = plan_of(scene);
        for (uint32_t n = 0; n < plan.instance_count; n++)
            for (uint32_t c = 0; c < plan.instances[n].chunk_count; c++) {
                const struct chunk_view *chunk = &plan.instances[n].chunks[c];
                const float *p = (const float *)cloud->positions + 3 * (size_t)chunk->first;
                assert_true(chunk->column_first < chunk->column_end && chunk->column_end <= plan.view.width);
                assert_true(chunk->row_first < chunk->row_end && chunk->row_end <= plan.view.height);
                known += chunk->z_least > 0.0f;
                straddle += !(chunk->z_least > 0.0f);
                for (uint32_t s = 0; s < chunk->count; s++) {
                    float q[3];
                    for (int k = 0; k < 3; k++) {
                        const float *r = chunk->row + 3 * k;
                        q[k] = (((chunk->lo[k] + r[0] * p[s]) + r[1] * p[chunk->padded + s]) +
                                r[2] * p[2 * chunk->padded + s]) +
                               chunk->hi[k];
                    }
                    if (!(q[2] >= plan.view.z_near && q[2] <= plan.view.z_far && q[2] > 0.0f))
                        continue;
                    const float x = floorf(plan.view.perspective ? q[0] / q[2] : q[0]) - (float)plan.view.origin_x,
                                y = floorf(plan.view.perspective ? q[1] / q[2] : q[1]) - (float)plan.view.origin_y;
                    if (!(x >= 0.0f && x < (float)plan.view.width && y >= 0.0f && y < (float)plan.view.height))
                        continue;
                    drawn++;
                    assert_true(q[2] > chunk->z_least);
                    assert_true(x >= (float)chunk->column_first && x < (float)chunk->column_end);
                    assert_true(y >= (float)chunk->row_first && y < (float)chunk->row_end);
                }
            }
        pt_plan_destroy(&plan);
    }
    assert_true(drawn > 10000 && known > 100 && straddle > 10);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

// Chunks of range images that lie beside the picture: in the finer cells, too, each lies within the plane, or it is not known where.
static void test_places_in_finer_cells(void **state)
{
    (void)state;
    patina_cloud *cloud = square(1);
    uint32_t beside = 0, fine_chunks = 0;
    for (int i = 0; i < 400; i++) {
        patina_scene *scene = scene_above(NULL, 2.5, 1, 0);
        const patina_cloud_style style = {
            .struct_size = sizeof style, .surface = PATINA_SURFACE_RANGES, .range_pixel = 32.0f, .range_sharpness = 0.5f};
        const double turn = 0.1 * i, at[3] = {cos(turn), sin(turn), 0.02 + 0.001 * i},
                     to[3] = {0.4 * cos(turn), 0.4 * sin(turn), i % 3 ? 0.0 : 0.05};
        assert_int_equal(patina_scene_add_cloud(scene, cloud, &style), PATINA_OK);
        look(scene, at, to);
        struct pt_plan plan = plan_of(scene);
        for (uint32_t n = 0; n < plan.instance_count; n++) {
            const struct pt_range *range = plan.instances[n].as.range;
            const struct chunk_view *chunks = plan.instances[n].chunks;
            for (uint32_t count = plan.instances[n].chunk_count; range;
                 range = range->fine, chunks = range ? range->chunks : NULL, count = range ? range->chunk_count : 0)
                for (uint32_t c = 0; c < count; c++) {
                    const struct chunk_view *chunk = &chunks[c];
                    const int known = chunk->row_end > 0;
                    beside += !known;
                    fine_chunks += chunks != plan.instances[n].chunks;
                    assert_true(known ? chunk->row_first < chunk->row_end && chunk->row_end <= range->cells.height
                                      : !chunk->row_first);
                    assert_true(known ? chunk->column_first < chunk->column_end && chunk->column_end <= range->cells.width
                                      : !chunk->column_first && !chunk->column_end);
                }
        }
        pt_plan_destroy(&plan);
        patina_scene_destroy(scene);
    }
    assert_true(fine_chunks > 100 && beside > 10);
    patina_cloud_destroy(cloud);
}

// The ground below and behind a camera does not show: what is filled is chosen by what does, 12 to 28 pixels apart.
static void test_spacing_is_of_what_shows(void **state)
{
    (void)state;
    patina_cloud *cloud = square(1);
    patina_scene *scene = scene_above(cloud, 2.5, 1, 0);
    look(scene, (const double[]){0.1, -0.5, 0.6}, (const double[]){0.1, 0.4, 0.0});
    struct pt_plan plan = plan_of(scene);
    assert_true(plan.spacing_px > 12.0 && plan.spacing_px < 40.0); // 112 with what lies behind the eye
    pt_plan_destroy(&plan);
    // in the middle of it: as much as the nearest ground that shows, not what lies at the lens
    look(scene, (const double[]){0.0, 0.0, 0.1}, (const double[]){1.0, 0.0, 0.1});
    plan = plan_of(scene);
    assert_true(plan.spacing_px > 12.0 && plan.spacing_px < 80.0);
    pt_plan_destroy(&plan);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

static void test_region_decides_as_the_whole(void **state)
{
    (void)state;
    patina_cloud *cloud = square(1);
    patina_scene *scene = scene_above(cloud, 1.5, 1, 0);
    struct pt_plan whole = plan_of(scene);
    patina_settings settings = {.struct_size = sizeof settings, .region = {700, 650, 750, 660}};
    assert_int_equal(patina_scene_set_settings(scene, &settings), PATINA_OK);
    struct pt_plan region = plan_of(scene);
    assert_int_equal(region.levels, whole.levels);
    assert_int_equal(region.iterations, whole.iterations);
    assert_true(region.view.ray_x0 == whole.view.ray_x0 && region.view.ray_ys == whole.view.ray_ys);
    assert_true(region.view.width < whole.view.width && region.chunks_culled > whole.chunks_culled);
    assert_int_equal((uint32_t)region.view.origin_x + region.crop[0], (uint32_t)whole.view.origin_x + whole.crop[0] + 700);
    assert_int_equal((uint32_t)region.view.origin_y + region.crop[1], (uint32_t)whole.view.origin_y + whole.crop[1] + 650);
    assert_int_equal(region.view.origin_x & ((1 << region.levels) - 1), 0);
    pt_plan_destroy(&whole);
    pt_plan_destroy(&region);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_spacing_chooses_levels),      cmocka_unit_test(test_low_parts),
        cmocka_unit_test(test_places_hold_points),          cmocka_unit_test(test_places_in_finer_cells),
        cmocka_unit_test(test_chunks_around_the_camera),    cmocka_unit_test(test_spacing_is_of_what_shows),
        cmocka_unit_test(test_region_decides_as_the_whole),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
