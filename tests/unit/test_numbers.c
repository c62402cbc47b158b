// SPDX-License-Identifier: GPL-3.0-or-later
// Ids of points follow what a picture sees, and callers' numbers what the scene holds (SPEC 1): of clouds that claim more points than any
// memory has, which no plan looks for.
#include "run/numbering.h"
#include "scenes/support.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "square.h" // behind cmocka.h

enum { ACROSS = 16, CHUNKS = ACROSS * ACROSS };
// Of each chunk of a cloud of CHUNKS, which so has just below 2^31 slots; a slot in sixteen repeats a point.
#define CLAIMED ((uint32_t)(0x7FFFFFFFu / CHUNKS / PT_CHUNK_ALIGN * PT_CHUNK_ALIGN))
#define CLAIMED_POINTS (CLAIMED - CLAIMED / 16)

// A square of 16 x 16 chunks, 2 x 2 units, of so many slots each and no array.
static struct patina_cloud *claimed(uint32_t slots)
{
    struct patina_cloud *cloud = pt_cloud_new();
    assert_non_null(cloud);
    cloud->chunks = calloc(CHUNKS, sizeof *cloud->chunks);
    cloud->begins = calloc(CHUNKS + 1, sizeof *cloud->begins);
    assert_non_null(cloud->chunks);
    assert_non_null(cloud->begins);
    cloud->chunk_count = CHUNKS;
    cloud->slots = (uint64_t)slots * CHUNKS;
    cloud->unordered = 1;
    cloud->spacing_base = cloud->built = 1e-5;
    for (uint32_t c = 0; c < CHUNKS; c++) {
        struct pt_chunk *chunk = &cloud->chunks[c];
        chunk->origin[0] = -1.0 + (c % ACROSS + 0.5) * 2.0 / ACROSS;
        chunk->origin[1] = -1.0 + (c / ACROSS + 0.5) * 2.0 / ACROSS;
        for (int k = 0; k < 2; k++) {
            chunk->box_min[k] = -0.9f / ACROSS;
            chunk->box_max[k] = 0.9f / ACROSS;
        }
        chunk->cone_cosine = -2.0f;
        chunk->spacing = chunk->built = 1e-5f;
        chunk->first = c * slots;
        chunk->padded = slots;
        chunk->count = slots - slots / 16;
        cloud->begins[c + 1] = cloud->begins[c] + chunk->count;
    }
    cloud->info.count = cloud->info.drawn = cloud->begins[CHUNKS];
    return cloud;
}

static void see(patina_scene *scene, double x, double y, double width)
{
    const patina_camera camera = {.struct_size = sizeof camera,
                                  .orthographic = 1,
                                  .world_from_camera = {1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, 5, 0, 0, 0, 1},
                                  .left = -width / 2,
                                  .right = width / 2,
                                  .bottom = -width / 2,
                                  .top = width / 2,
                                  .near_clip = 0.1,
                                  .far_clip = 10};
    assert_int_equal(patina_scene_set_camera(scene, &camera), PATINA_OK);
}

static void add_at(patina_scene *scene, const struct patina_cloud *cloud, double x)
{
    const patina_cloud_style style = {.struct_size = sizeof style,
                                      .world_from_object = {1, 0, 0, x, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};
    assert_int_equal(patina_scene_add_cloud(scene, cloud, &style), PATINA_OK);
}

// Windows follow each other in the order of the instances, hold what is in view and hardly more, and ids lie in them.
static void check_windows(const patina_scene *scene, const struct pt_plan *plan)
{
    uint64_t ids = 0;
    for (uint32_t i = 0; i < scene->cloud_count; i++) {
        const struct pt_window *window = &plan->ids.windows[i];
        assert_int_equal(window->id, ids);
        ids += window->count;
    }
    assert_true(ids == plan->ids.points);
    for (uint32_t k = 0; k < plan->instance_count; k++) {
        const struct pt_plan_instance *instance = &plan->instances[k];
        const struct pt_window *window = &plan->ids.windows[instance->of];
        const uint32_t moved = instance->kind == PT_AS_DISCS ? plan->discs.first : 0;
        assert_int_equal(instance->args.id_base, window->id - window->first + moved);
        assert_int_equal(instance->args.id_first, window->first);
        assert_int_equal(instance->args.id_count, window->count);
        assert_int_equal(instance->args.slots, instance->instance->cloud->slots);
        for (uint32_t c = 0; c < instance->chunk_count; c++) {
            const struct chunk_view *chunk = &instance->chunks[c];
            const uint32_t id = chunk->id_base + chunk->first - moved;
            assert_true(id >= window->id && (uint64_t)id + chunk->padded <= (uint64_t)window->id + window->count);
        }
    }
}

// 6.4 billion points in three clouds, of which the picture sees a corner of two: a few chunks each.
static void test_a_scene_of_any_size(void **state)
{
    (void)state;
    struct patina_cloud *cloud = claimed(CLAIMED);
    patina_scene *scene = scene_above(NULL, 1, 1, 0);
    const float corners[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    const patina_mesh_desc triangle = {
        .struct_size = sizeof triangle, .vertex_count = 3, .triangle_count = 1, .position = {corners, PATINA_FLOAT32, 3, 0}};
    patina_mesh *mesh = NULL;
    assert_int_equal(patina_mesh_create(&triangle, &mesh), PATINA_OK);
    assert_int_equal(patina_scene_add_mesh(scene, mesh, NULL), PATINA_OK);
    for (int i = 0; i < 3; i++)
        add_at(scene, cloud, 2.0 * i);
    see(scene, 3.0, -0.95, 0.1); // where the second ends and the third begins
    struct pt_plan plan = plan_of(scene);
    assert_true(plan.points == 3ull * CHUNKS * CLAIMED_POINTS && plan.points > UINT32_MAX);
    assert_int_equal(plan.ids.windows[0].count, 0);
    assert_true(plan.ids.windows[1].count >= CLAIMED && plan.ids.windows[1].count < 40 * CLAIMED);
    assert_true(plan.ids.windows[2].count >= CLAIMED && plan.ids.windows[2].count < 40 * CLAIMED);
    check_windows(scene, &plan);
    assert_false(plan.ids.filled);

    // what callers get
    struct pt_numbering numbering = {0};
    assert_int_equal(pt_numbering_take(&numbering, scene, &plan), PATINA_OK);
    const uint64_t of_cloud = (uint64_t)CHUNKS * CLAIMED_POINTS, z = 0x40000000ull << 32;
    const uint32_t last = plan.ids.windows[1].id + plan.ids.windows[1].count -
                          CLAIMED; // the last chunk of the second cloud's window
    const uint32_t chunk = plan.ids.windows[1].first / CLAIMED + plan.ids.windows[1].count / CLAIMED - 1;
    const uint32_t first = plan.ids.windows[2].first / CLAIMED;
    uint64_t keys[] = {z | (last + 7), z | plan.ids.windows[2].id, (uint64_t)PT_KEY_EMPTY_Z << 32 | PT_KEY_EMPTY_ID,
                       z | (plan.ids.discs + last + 7), z | plan.ids.points};
    uint64_t kept[5];
    memcpy(kept, keys, sizeof keys);
    assert_int_equal(pt_numbering_keys(&numbering, kept, 5), PATINA_ERROR_TOO_MANY_POINTS);
    assert_int_equal(pt_numbering_numbers(&numbering, keys, 5), PATINA_OK);
    assert_true(keys[0] == of_cloud + (uint64_t)chunk * CLAIMED_POINTS + 7);
    assert_true(keys[1] == 2 * of_cloud + (uint64_t)first * CLAIMED_POINTS);
    assert_true(keys[2] == UINT64_MAX);
    assert_true(keys[3] == keys[0]);      // as a disc
    assert_true(keys[4] == 3 * of_cloud); // the triangle
    pt_numbering_release(&numbering);
    pt_plan_destroy(&plan);
    patina_scene_destroy(scene);
    patina_mesh_destroy(mesh);
    patina_cloud_destroy(cloud);
}

// All of it in one picture is more than keys tell apart: said at once, and the scene stays as it is.
static void test_a_picture_of_too_many(void **state)
{
    (void)state;
    struct patina_cloud *cloud = claimed(CLAIMED);
    patina_scene *scene = scene_above(NULL, 1, 1, 0);
    for (int i = 0; i < 3; i++)
        add_at(scene, cloud, 2.0 * i);
    see(scene, 2.0, 0.0, 8.0);
    struct pt_plan plan;
    assert_int_equal(pt_plan_create(scene, NULL, &plan), PATINA_ERROR_TOO_MANY_POINTS);
    const char *message = support_message(scene);
    printf("  message: %s\n", message);
    char count[32];
    snprintf(count, sizeof count, " %llu points", 3ull * CHUNKS * CLAIMED);
    assert_non_null(strstr(message, count));
    assert_non_null(strstr(message, "settings.detail"));
    see(scene, 3.0, -0.95, 0.1);
    plan = plan_of(scene);
    pt_plan_destroy(&plan);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

// Points that fit once and not twice are filled, wherever discs would be drawn; a smaller part of them has its discs.
static void test_no_room_for_discs(void **state)
{
    (void)state;
    struct patina_cloud *cloud = claimed(CLAIMED);
    cloud->shapes = calloc(1, 4); // analysed; no plan looks into it
    for (uint32_t c = 0; c < CHUNKS; c++)
        cloud->chunks[c].reach = cloud->chunks[c].footprint = 0.1f;
    patina_scene *scene = scene_above(NULL, 1, 1, 0);
    add_at(scene, cloud, 0.0);
    add_at(scene, cloud, 2.0);
    static const double wide[3] = {1.0, 0.0, 4.5}, narrow[3] = {0.0, -0.95, 0.1};
    for (int k = 0; k < 2; k++) {
        const double *of = k ? narrow : wide;
        see(scene, of[0], of[1], of[2]);
        struct pt_plan plan = plan_of(scene);
        check_windows(scene, &plan);
        assert_int_equal(plan.ids.filled, !k);
        assert_int_equal(plan.ids.discs > 0, k);
        assert_int_equal(plan.discs.first, plan.ids.discs);
        assert_int_equal(plan.discs.count > 0, k);
        assert_int_equal(pt_plan_draws(&plan, PT_AS_DISCS), k);
        pt_plan_destroy(&plan);
    }
    patina_scene_destroy(scene);
    free(cloud->shapes);
    cloud->shapes = NULL;
    patina_cloud_destroy(cloud);
}

// A region, and any sample of a pixel, has the ids of the whole picture, or their order.
static void test_regions_have_the_same(void **state)
{
    (void)state;
    struct patina_cloud *cloud = claimed(4096);
    patina_scene *scene = scene_above(NULL, 1, 1, 0);
    for (int i = 0; i < 3; i++)
        add_at(scene, cloud, 2.0 * i);
    see(scene, 3.0, 0.0, 1.0);
    patina_settings settings = {.struct_size = sizeof settings, .width = 512, .height = 512};
    assert_int_equal(patina_scene_set_settings(scene, &settings), PATINA_OK);
    struct pt_plan whole = plan_of(scene);
    const uint32_t region[4] = {100, 200, 140, 230};
    memcpy(settings.region, region, sizeof region);
    assert_int_equal(patina_scene_set_settings(scene, &settings), PATINA_OK);
    struct pt_plan part = plan_of(scene);
    assert_true(part.points_scattered < whole.points_scattered);
    assert_memory_equal(part.ids.windows, whole.ids.windows, 3 * sizeof *whole.ids.windows);
    check_windows(scene, &part);
    pt_plan_destroy(&whole);
    pt_plan_destroy(&part);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_scene_of_any_size),
        cmocka_unit_test(test_a_picture_of_too_many),
        cmocka_unit_test(test_no_room_for_discs),
        cmocka_unit_test(test_regions_have_the_same),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
