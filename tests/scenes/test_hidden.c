// SPDX-License-Identifier: GPL-3.0-or-later
// What nearer points hide: below a cap less is read, and pictures have the bytes that they have where all fits; a damaged page that is hidden
// changes nothing, whether somebody looked at it or not (SPEC 13).
#include "clouds.h"
#include "support.h"

#include "folder.h" // behind cmocka.h

#include "scene/clouds/cloud.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { WALL = 500000, BEHIND = 1200000, WIDTH = 200, HEIGHT = 160, SECTION = 1 << 16, CAP = 8 << 20 };
enum { BYTES_OF_CHUNKS_AT = 12, CHUNKS_AT = 20 }; // in the head

static char good[80], bad[80], keys[2][80];

static void write_bytes(const char *path, const void *data, size_t size)
{
    FILE *stream = fopen(path, "wb");
    assert_non_null(stream);
    assert_int_equal(fwrite(data, 1, size, stream), size);
    fclose(stream);
}

// A wall before a cloud of dust that is sparser and reaches beyond the wall's right side.
static int make_files(void **state)
{
    (void)state;
    snprintf(good, sizeof good, "patina-hidden-%ld.good.cloud", (long)getpid());
    snprintf(bad, sizeof bad, "patina-hidden-%ld.bad.cloud", (long)getpid());
    for (int i = 0; i < 2; i++)
        snprintf(keys[i], sizeof keys[i], "patina-hidden-%ld.%d.keys", (long)getpid(), i);
    struct points points = points_create(WALL + BEHIND, POINTS_ALL);
    struct pcg random = pcg_seed(3);
    for (uint64_t i = 0; i < points.count; i++) {
        const int wall = i < WALL;
        points.position[3 * i] = (float)pcg_between(&random, wall ? -5.0 : -2.5, wall ? 2.0 : 4.5);
        points.position[3 * i + 1] = (float)pcg_between(&random, wall ? -4.0 : -2.5, wall ? 4.0 : 2.5);
        points.position[3 * i + 2] = wall ? 0.0f : (float)pcg_between(&random, -7.0, -2.0);
        points.normal[3 * i + 2] = i % 4 || wall ? 1.0f : -1.0f;
        for (int k = 0; k < 3; k++)
            points.color[3 * i + k] = (uint8_t)(pcg_u32(&random) >> 24);
    }
    patina_cloud *cloud = points_upload(&points);
    CHECK(patina_cloud_save(cloud, good), cloud);
    patina_cloud_destroy(cloud);
    points_free(&points);
    return 0;
}

static int remove_files(void **state)
{
    (void)state;
    remove(good);
    remove(bad);
    remove(keys[0]);
    remove(keys[1]);
    return 0;
}

static patina_cloud *open_cloud(const char *path)
{
    patina_cloud *cloud = NULL;
    CHECK(patina_cloud_open(path, &cloud), NULL);
    return cloud;
}

static patina_device *open_device(const char *name, uint32_t threads, uint64_t cap)
{
    patina_device *device = NULL;
    const patina_device_desc desc = {.struct_size = sizeof desc, .name = name, .threads = threads, .mapped_cap = cap};
    CHECK(patina_device_create(&desc, &device), NULL);
    return device;
}

enum what { FILLED, CULLED, ORTHOGRAPHIC, TWO, WIDE, LAYERS, SHADOWS, LAZY, RANGES, PICTURES };

static patina_scene *scene_with(const patina_cloud *cloud, enum what what)
{
    patina_cloud_style style = PATINA_CLOUD_STYLE_INIT;
    patina_settings settings = settings_default(WIDTH, HEIGHT);
    const double eye[3] = {0, 0, 5}, target[3] = {0.3, 0.1, 0};
    const double low[3] = {-1, 2.2, 0.2}, beyond[3] = {0.5, 0, -4}; // before the wall's upper half, and at a slant
    const patina_light_desc sun = {
        .struct_size = sizeof sun, .type = PATINA_LIGHT_SUN, .power = 1, .direction = {0.1, 0.2, -1}, .shadows = 1};
    style.cull_back = what == CULLED;
    style.transparency = what == LAYERS ? 0.5f : 0.0f;
    style.surface = what == RANGES ? PATINA_SURFACE_RANGES : PATINA_SURFACE_AUTO;
    style.lighting = what == SHADOWS || what == LAZY ? PATINA_LIGHTING_LIT : PATINA_LIGHTING_AUTO;
    settings.layers = what == LAYERS ? 3 : 0;
    settings.shadow_lazy = what == LAZY;
    patina_scene *scene = scene_of(cloud, &style);
    if (what == TWO) {
        style.world_from_object[3] = 0.01;
        style.world_from_object[11] = -0.5;
        CHECK(patina_scene_add_cloud(scene, cloud, &style), scene);
    }
    if (what == SHADOWS || what == LAZY)
        CHECK(patina_scene_add_light(scene, &sun), scene);
    const patina_camera camera = what == ORTHOGRAPHIC ? camera_orthographic(eye, target, 8, WIDTH, HEIGHT, 0.1, 100)
                                 : what == WIDE       ? camera_perspective(low, beyond, 100, WIDTH, HEIGHT, 0.01, 100)
                                                      : camera_perspective(eye, target, 45, WIDTH, HEIGHT, 0.1, 100);
    CHECK(patina_scene_set_camera(scene, &camera), scene);
    CHECK(patina_scene_set_settings(scene, &settings), scene);
    return scene;
}

static struct picture draw(patina_device *device, const patina_cloud *cloud, enum what what, patina_frame_stats *stats)
{
    patina_scene *scene = scene_with(cloud, what);
    patina_frame *frame = NULL;
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_frame_render(frame, scene), frame);
    *stats = (patina_frame_stats){.struct_size = sizeof *stats};
    CHECK(patina_frame_get_stats(frame, stats), frame);
    struct picture picture = picture_read(frame);
    patina_frame_destroy(frame);
    patina_scene_destroy(scene);
    return picture;
}

static void test_pictures(void **state)
{
    static const char *const names[PICTURES] = {"filled", "culled",  "orthographic",          "two instances", "close by",
                                                "layers", "shadows", "shadows of what shows", "range images"};
    // Hundredths of what passes would read: scatter alone leaves out what is hidden, and an orthographic picture looks past the wall's side.
    static const uint32_t most[PICTURES] = {67, 67, 80, 67, 67, 80, 85, 67, 90};
    static const struct {
        const char *name;
        uint32_t threads;
    } ways[] = {{"cpu", 1}, {"cpu", 3}, {"cpu-scalar", 2}};
    (void)state;
    patina_device *whole = open_device("cpu", 2, UINT64_MAX);
    patina_cloud *cloud = open_cloud(good);
    for (int what = 0; what < PICTURES; what++) {
        patina_frame_stats fits, told;
        struct picture all = draw(whole, cloud, what, &fits);
        for (size_t i = 0; i < sizeof ways / sizeof *ways; i++) {
            patina_device *capped = open_device(ways[i].name, ways[i].threads, CAP);
            struct picture picture = draw(capped, cloud, what, &told);
            assert_int_equal(told.mapped_cap, CAP);
            picture_assert_identical(&picture, &all, 0, 0, names[what]);
            assert_true(told.mapped_read < fits.mapped_read / 100 * most[what]);
            picture_free(&picture);
            patina_device_destroy(capped);
        }
        print_message("%s: %.1f MB read in place of %.1f\n", names[what], 1e-6 * (double)told.mapped_read,
                      1e-6 * (double)fits.mapped_read);
        picture_free(&all);
    }
    patina_cloud_destroy(cloud);
    patina_device_destroy(whole);
}

// A part hides by its own keys alone.
static void test_in_parts(void **state)
{
    (void)state;
    patina_device *whole = open_device("cpu", 2, UINT64_MAX), *capped = open_device("cpu", 2, CAP);
    patina_cloud *cloud = open_cloud(good);
    patina_frame_stats fits;
    struct picture all = draw(whole, cloud, TWO, &fits);
    assert_true(fits.mapped_read / 2 > 16 << 20); // a part asks for enough that it is taken in steps
    const char *const list[] = {keys[0], keys[1]};
    patina_scene *scene = scene_with(cloud, TWO);
    patina_frame *frame = NULL;
    uint32_t round = 9;
    CHECK(patina_frame_create(capped, &frame), capped);
    for (uint32_t k = 0; k < 2; k++) {
        const patina_part part = {.struct_size = sizeof part, .part = k + 1, .of = 2};
        CHECK(patina_frame_scatter(frame, scene, &part, keys[k]), frame);
    }
    CHECK(patina_frame_merge(frame, scene, list, 2, NULL, &round), frame);
    struct picture merged = picture_read(frame);
    picture_assert_identical(&merged, &all, 0, 0, "parts");
    picture_free(&merged);
    picture_free(&all);
    patina_frame_destroy(frame);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    patina_device_destroy(whole);
    patina_device_destroy(capped);
}

// ---- damaged pages -------------------------------------------------------------------------------------------------------

// Of pages that lie far behind the wall, and of one of the wall if `near`, a bit of the positions is another one. Returns how many.
static uint32_t damage(int near)
{
    size_t size;
    unsigned char *data = bytes_of(good, &size);
    uint32_t words[2], count = 0, of_wall = 0;
    memcpy(&words[0], data + BYTES_OF_CHUNKS_AT, sizeof *words);
    memcpy(&words[1], data + CHUNKS_AT, sizeof *words);
    const size_t at = SECTION + ((size_t)words[0] * words[1] + SECTION - 1) / SECTION * SECTION;
    patina_cloud *cloud = open_cloud(good);
    for (uint32_t c = 0; c < cloud->chunk_count; c++) {
        const struct pt_chunk *chunk = &cloud->chunks[c];
        double low[3], high[3];
        for (int k = 0; k < 3; k++) {
            low[k] = chunk->origin[k] + (double)chunk->box_min[k];
            high[k] = chunk->origin[k] + (double)chunk->box_max[k];
        }
        const int behind = high[2] < -3.5 && high[0] < 1.0, wall = near && !of_wall && low[2] > -1.0 && low[0] > 0.0;
        if (!behind && !wall)
            continue;
        of_wall += (uint32_t)wall;
        count++;
        data[at + (size_t)chunk->first * 12 + 600] ^= 4;
    }
    patina_cloud_destroy(cloud);
    assert_int_equal(of_wall, near);
    write_bytes(bad, data, size);
    free(data);
    return count;
}

static void test_damaged(void **state)
{
    (void)state;
    char log[4096], wanted[40];
    patina_device *whole = open_device("cpu", 2, UINT64_MAX), *capped = open_device("cpu", 2, CAP);
    patina_cloud *sound = open_cloud(good);
    patina_frame_stats stats, told;
    struct picture all = draw(whole, sound, FILLED, &stats);
    for (int near = 0; near < 2; near++) {
        const uint32_t pages = damage(near);
        patina_cloud *looked_at = open_cloud(bad), *not_looked_at = open_cloud(bad);
        snprintf(wanted, sizeof wanted, " %u of %u pages are damaged", pages, sound->chunk_count);
        support_drain_log(log, sizeof log);
        struct picture known = draw(whole, looked_at, FILLED, &stats);
        assert_int_equal(support_drain_log(log, sizeof log), 1);
        assert_non_null(strstr(log, wanted));
        struct picture hidden = draw(capped, not_looked_at, FILLED, &told);
        assert_int_equal(support_drain_log(log, sizeof log), near); // and where one is found, it is of all
        assert_true(!near || strstr(log, wanted));
        print_message("%u of %u pages damaged\n", pages, sound->chunk_count);
        assert_true(pages > sound->chunk_count / 10);
        picture_assert_identical(&hidden, &known, 0, 0, "with hidden damage");
        assert_true(stats.spacing_px == told.spacing_px);
        if (!near)
            picture_assert_identical(&hidden, &all, 0, 0, "without a damage that shows");
        picture_free(&known);
        picture_free(&hidden);
        patina_cloud_destroy(looked_at);
        patina_cloud_destroy(not_looked_at);
    }
    picture_free(&all);
    patina_cloud_destroy(sound);
    patina_device_destroy(whole);
    patina_device_destroy(capped);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_pictures), cmocka_unit_test(test_in_parts),
                                       cmocka_unit_test(test_damaged)};
    return cmocka_run_group_tests(tests, make_files, remove_files);
}
