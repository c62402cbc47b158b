// SPDX-License-Identifier: GPL-3.0-or-later
// A square of points, a camera above it, and what is asked of plans. Behind cmocka.h.
#ifndef PT_TEST_SQUARE_H
#define PT_TEST_SQUARE_H

#include "plan/plan.h"

#include <string.h>

enum { SIDE = 200, COUNT = SIDE * SIDE };

static float positions[COUNT][3], normals[COUNT][3];

// A square of 2 x 2 in the xy plane, its normals up.
static inline patina_cloud *square(int with_normals)
{
    for (int i = 0; i < COUNT; i++) {
        positions[i][0] = (float)(i % SIDE) / (SIDE / 2) - 1.0f;
        positions[i][1] = (float)(i / SIDE) / (SIDE / 2) - 1.0f;
        positions[i][2] = 0.0f;
        normals[i][2] = 1.0f;
    }
    patina_cloud_desc desc = {.struct_size = sizeof desc,
                              .count = COUNT,
                              .position = {positions, PATINA_FLOAT32, 3, 0},
                              .normal = {with_normals ? normals : NULL, PATINA_FLOAT32, 3, 0}};
    patina_cloud *cloud = NULL;
    assert_int_equal(patina_cloud_create(&desc, NULL, &cloud), PATINA_OK);
    return cloud;
}

// An orthographic camera above (or with up = -1 below) the square, `width` units wide.
static inline patina_scene *scene_above(const patina_cloud *cloud, double width, double up, int cull_back)
{
    patina_scene *scene = NULL;
    patina_cloud_style style = {.struct_size = sizeof style, .cull_back = (uint32_t)cull_back};
    patina_camera camera = {.struct_size = sizeof camera,
                            .orthographic = 1,
                            .world_from_camera = {up, 0, 0, 0, 0, 1, 0, 0, 0, 0, up, 5 * up, 0, 0, 0, 1},
                            .left = -width / 2,
                            .right = width / 2,
                            .bottom = -width / 2,
                            .top = width / 2,
                            .near_clip = 0.1,
                            .far_clip = 10};
    assert_int_equal(patina_scene_create(&scene), PATINA_OK);
    if (cloud)
        assert_int_equal(patina_scene_add_cloud(scene, cloud, &style), PATINA_OK);
    assert_int_equal(patina_scene_set_camera(scene, &camera), PATINA_OK);
    return scene;
}

static inline struct pt_plan plan_of(const patina_scene *scene)
{
    struct pt_plan plan;
    assert_int_equal(pt_plan_create(scene, NULL, &plan), PATINA_OK);
    return plan;
}

static inline uint32_t passes_of(const struct pt_plan *plan, enum pt_kernel kernel)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < plan->pass_count; i++)
        count += plan->passes[i].kernel == kernel;
    return count;
}

static inline const char *skipped(const struct pt_plan *plan, const char *name)
{
    for (uint32_t i = 0; i < plan->skipped_count; i++)
        if (!strcmp(plan->skipped[i].name, name))
            return plan->skipped[i].reason;
    return NULL;
}

#endif
