// SPDX-License-Identifier: GPL-3.0-or-later
// A cloud of 22 billion points, of which a thousand pages arrive: what it takes of memory and of time before a picture is drawn (SPEC 14).
#include "base/pool.h"
#include "plan/passes.h"
#include "sanitized.h"
#include "scene/clouds/paged.h"
#include "scene/clouds/parts.h"
#include "scenes/support.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

// Ground of 1000 units, a quarter of a page below each: of the first FEW levels the pages arrive.
enum { LEVELS = 10, FEW = 6, POINTS = 256, FINE_POINTS = 64000 };

static const double side = 1000.0;

static uint32_t pages_of(uint32_t levels) { return ((1u << 2 * levels) - 1) / 3; }

static patina_page *make_pages(void)
{
    patina_page *pages = malloc(pages_of(LEVELS) * sizeof *pages), *page = pages;
    for (uint32_t level = 0; level < LEVELS; level++)
        for (uint32_t y = 0; y < 1u << level; y++)
            for (uint32_t x = 0; x < 1u << level; x++, page++) {
                const double wide = side / (1u << level);
                *page = (patina_page){.box_min = {x * wide, y * wide, 0.0},
                                      .box_max = {(x + 1) * wide, (y + 1) * wide, wide},
                                      .gap = side / 31.0 / (1u << level),
                                      .count = level < FEW ? POINTS : FINE_POINTS,
                                      .parent = PATINA_NO_PAGE};
                if (level)
                    page->parent = pages_of(level - 1) + (y >> 1 << (level - 1)) + (x >> 1);
            }
    return pages;
}

static void give(patina_cloud *cloud, const patina_page *page, uint32_t index)
{
    static float positions[3 * POINTS];
    for (int i = 0; i < POINTS; i++) { // along the plastic number's lattice
        const double u = fmod(0.5 + i * 0.75487766624669276, 1.0), v = fmod(0.5 + i * 0.56984029099805327, 1.0);
        positions[3 * i] = (float)(page->box_min[0] + u * (page->box_max[0] - page->box_min[0]));
        positions[3 * i + 1] = (float)(page->box_min[1] + v * (page->box_max[1] - page->box_min[1]));
        positions[3 * i + 2] = 0.0f;
    }
    const patina_cloud_desc desc = {.struct_size = sizeof desc, .count = POINTS, .position = {positions, PATINA_FLOAT32, 3, 0}};
    CHECK(patina_cloud_page_give(cloud, index, &desc), cloud);
}

// Of this process, bytes in memory; 0 where it is not told.
static double held(void)
{
    unsigned long long all = 0, there = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    if (file && fscanf(file, "%llu %llu", &all, &there) != 2)
        there = 0;
    if (file)
        fclose(file);
    return 4096.0 * (double)there;
}

static double spent(void) { return 1e3 * (double)clock() / CLOCKS_PER_SEC; }

static patina_scene *ground(const patina_cloud *cloud, int near_by, float detail)
{
    patina_scene *scene = NULL;
    const double eye[2][3] = {{500, 500, 1500}, {300, 300, 1.5}}, target[2][3] = {{500, 500.1, 0}, {310, 308, 0}};
    const patina_camera camera = camera_perspective(eye[near_by], target[near_by], 45, 1024, 768, 0.1, 5000);
    patina_settings settings = settings_default(1024, 768);
    settings.detail = detail;
    CHECK(patina_scene_create(&scene), NULL);
    CHECK(patina_scene_add_cloud(scene, cloud, NULL), scene);
    CHECK(patina_scene_set_camera(scene, &camera), scene);
    CHECK(patina_scene_set_settings(scene, &settings), scene);
    return scene;
}

static void plan_and_tell(patina_cloud *cloud, const char *when)
{
    static uint32_t wanted[1 << 19];
    for (int look = 0; look < 4; look++) {
        const int near_by = look % 2;
        patina_scene *scene = ground(cloud, near_by, look < 2 ? 0.0f : 4.0f);
        double times[3], start = spent();
        pt_paged_enter(cloud, 1);
        times[0] = spent() - start;
        pt_paged_leave(cloud);
        start = spent();
        struct pt_plan plan;
        CHECK(pt_plan_create(scene, NULL, &plan), scene);
        times[1] = spent() - start;
        pt_plan_destroy(&plan);
        uint32_t count = 0;
        start = spent();
        CHECK(patina_cloud_wanted(cloud, 0.0, wanted, 1 << 19, &count), cloud);
        times[2] = spent() - start;
        printf("  %s, %s%s: renewed in %.1f ms, planned in %.1f, %u pages wanted in %.1f\n", when,
               near_by ? "near" : "overview", look < 2 ? "" : " at 4 pixels", times[0], times[1], count, times[2]);
        assert_true(look >= 2 || count > (near_by ? 0 : 300000));
        patina_scene_destroy(scene);
    }
}

// A plan that threads make together is that of one thread.
static void plan_by_threads(patina_cloud *cloud)
{
    for (int look = 0; look < 4; look++) {
        patina_scene *scene = ground(cloud, look % 2, look < 2 ? 0.0f : 4.0f);
        struct pt_pool *pool = pt_pool_create(3, 0);
        struct pt_plan alone, together;
        assert_non_null(pool);
        pt_paged_enter(cloud, 1);
        CHECK(pt_plan_create(scene, NULL, &alone), scene);
        CHECK(pt_plan_create(scene, pool, &together), scene);
        pt_paged_leave(cloud);
        uint32_t chunks = 0;
        assert_int_equal(alone.instance_count, together.instance_count);
        for (uint32_t i = 0; i < alone.instance_count; i++) {
            const struct pt_plan_instance *a = &alone.instances[i], *b = &together.instances[i];
            assert_int_equal(a->chunk_count, b->chunk_count);
            assert_memory_equal(a->chunks, b->chunks, a->chunk_count * sizeof *a->chunks);
            assert_memory_equal(&a->args, &b->args, sizeof a->args);
            chunks += a->chunk_count;
        }
        assert_true(chunks > 0 && alone.points_scattered == together.points_scattered);
        assert_true(alone.spacing_px == together.spacing_px && alone.ids.points == together.ids.points);
        pt_plan_destroy(&alone);
        pt_plan_destroy(&together);
        pt_pool_destroy(pool);
        patina_scene_destroy(scene);
    }
}

static void test_billions(void **state)
{
    (void)state;
    patina_page *pages = make_pages();
    const uint32_t count = pages_of(LEVELS), few = pages_of(FEW);
    const patina_pages_desc desc = {.struct_size = sizeof desc, .pages = pages, .page_count = count};
    patina_cloud *cloud = NULL;
    const double before = held(), start = spent();
    CHECK(patina_cloud_pages_begin(&desc, &cloud), NULL);
    patina_pages_info told = {.struct_size = sizeof told};
    CHECK(patina_cloud_get_pages(cloud, &told), cloud);
    printf("  %llu points in %u pages, %u chunks and %u parts: %.0f ms, %.1f MB\n", (unsigned long long)told.points, count,
           cloud->chunk_count, pt_part_count(cloud), spent() - start, 1e-6 * (held() - before));
    assert_true(told.points > 22000000000ull && cloud->part_count > 10);
    assert_true(TEST_SANITIZED || held() - before < 120e6);
    uint64_t slots = 0, points = 0;
    for (uint32_t i = 0; i < cloud->part_count; i++) {
        const struct patina_cloud *part = pt_part(cloud, i);
        assert_true(part->slots <= 0x7FFFFFFF && part->first_slot == slots && part->first_number <= slots);
        slots += part->slots;
        points = part->first_number;
    }
    assert_true(slots == cloud->slots && points < told.points);
    plan_and_tell(cloud, "nothing is there");
    for (uint32_t p = 0; p < few; p++)
        give(cloud, &pages[p], p);
    plan_and_tell(cloud, "a thousand pages arrived");
    plan_and_tell(cloud, "a thousand pages are there");
    plan_by_threads(cloud);
    CHECK(patina_cloud_get_pages(cloud, &told), cloud);
    printf("  %u pages arrived, %.1f MB in all\n", told.pages_arrived, 1e-6 * (held() - before));
    assert_int_equal(told.pages_arrived, few);
    patina_cloud_destroy(cloud);
    free(pages);
}

// What goes over all points asks for all of them: until the last page is there, it says so by the call's name.
static void test_refused(void **state)
{
    (void)state;
    enum { PAGES = 5 };
    patina_page *pages = make_pages();
    const patina_pages_desc desc = {.struct_size = sizeof desc, .pages = pages, .page_count = PAGES};
    static uint8_t hidden[(PAGES * POINTS + 7) / 8];
    static float values[PAGES * POINTS];
    const patina_scan scan = {.interval = 0.0};
    const patina_field_desc field = {
        .struct_size = sizeof field, .source = PATINA_FIELD_VALUES, .count = PAGES * POINTS, .values = values};
    const patina_neighbourhoods neighbourhoods = {.struct_size = sizeof neighbourhoods};
    patina_cloud *cloud = NULL;
    CHECK(patina_cloud_pages_begin(&desc, &cloud), NULL);
    for (uint32_t given = 0; given <= PAGES; given++) {
        const int expected = given < PAGES ? PATINA_ERROR_UNSUPPORTED : PATINA_OK;
        patina_mask *mask = NULL;
        patina_scans *scans = NULL;
        patina_field *made = NULL;
        assert_int_equal(patina_mask_create(cloud, hidden, NULL, sizeof hidden, &mask), expected);
        assert_int_equal(patina_scans_create(cloud, NULL, &scan, 1, &scans), expected);
        assert_int_equal(patina_cloud_neighbourhoods(cloud, &neighbourhoods, NULL), expected);
        assert_int_equal(patina_field_create(cloud, &field, NULL, &made), expected);
        if (expected) {
            char text[256] = "";
            patina_message(cloud, text, sizeof text);
            assert_non_null(strstr(text, "patina_field_create: points of the cloud are still on their way"));
        }
        patina_mask_destroy(mask);
        patina_scans_destroy(scans);
        patina_field_destroy(made);
        if (given < PAGES)
            give(cloud, &pages[given], given);
    }
    patina_cloud_destroy(cloud);
    free(pages);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_billions), cmocka_unit_test(test_refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
