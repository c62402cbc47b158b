// SPDX-License-Identifier: GPL-3.0-or-later
// Damaged pages of a cloud's file: the picture is that of all other points, one line names them, and nothing else changes. Files of the
// version before, which have no sums of pages, still open.
#include "clouds.h"
#include "support.h"

#include "folder.h" // behind cmocka.h

#include "base/platform.h"
#include "run/page_check.h"
#include "run/pager.h"
#include "scene/clouds/cloud.h"
#include "scene/clouds/fingerprint.h"
#include "scene/clouds/page_sums.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { POINTS = 120000, WIDTH = 200, HEIGHT = 160, SECTION = 1 << 16 };
enum { VERSION_AT = 8, SIZE_AT = 32, BYTES_OF_CHUNKS_AT = 12, CHUNKS_AT = 20, SUM_AT = 504 }; // in the head

enum { PARTS = 2, CAP = 400000, MANY = 600000, CAP_OF_MANY = 2 << 20, BESIDE = 512 << 10 };

static char good[80], bad[80], other[80], keys[PARTS][80];

static void write_bytes(const char *path, const void *data, size_t size)
{
    FILE *stream = fopen(path, "wb");
    assert_non_null(stream);
    assert_int_equal(fwrite(data, 1, size, stream), size);
    fclose(stream);
}

static uint32_t word_at(const unsigned char *data, size_t at)
{
    uint32_t word;
    memcpy(&word, data + at, sizeof word);
    return word;
}

static size_t rounded(size_t size) { return (size + SECTION - 1) / SECTION * SECTION; }

// Where the positions begin.
static size_t positions_at(const unsigned char *data)
{
    return SECTION + rounded((size_t)word_at(data, CHUNKS_AT) * word_at(data, BYTES_OF_CHUNKS_AT));
}

static patina_cloud *open_cloud(const char *path)
{
    patina_cloud *cloud = NULL;
    CHECK(patina_cloud_open(path, &cloud), NULL);
    return cloud;
}

static const patina_camera *camera_of(void)
{
    static patina_camera camera;
    const double eye[3] = {4, -3, 3}, target[3] = {0, 0, 0};
    camera = camera_perspective(eye, target, 45, WIDTH, HEIGHT, 0.1, 100);
    return &camera;
}

static struct picture render_with(patina_device *device, const patina_cloud *cloud, const patina_settings *settings)
{
    patina_scene *scene = scene_of(cloud, NULL);
    struct picture picture = picture_render(device, scene, camera_of(), settings);
    patina_scene_destroy(scene);
    return picture;
}

static void save(uint64_t count, const char *path)
{
    struct points points = points_torus(count, 2.0, 0.7, POINTS_ALL, 7);
    const patina_cloud_desc desc = points_desc(&points);
    patina_cloud *cloud = NULL;
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    CHECK(patina_cloud_save(cloud, path), cloud);
    patina_cloud_destroy(cloud);
    points_free(&points);
}

static int make_files(void **state)
{
    (void)state;
    snprintf(good, sizeof good, "patina-pages-%ld.good.cloud", (long)getpid());
    snprintf(bad, sizeof bad, "patina-pages-%ld.bad.cloud", (long)getpid());
    snprintf(other, sizeof other, "patina-pages-%ld.other.cloud", (long)getpid());
    for (int i = 0; i < PARTS; i++)
        snprintf(keys[i], sizeof keys[i], "patina-pages-%ld.%d.keys", (long)getpid(), i);
    save(POINTS, good);
    return 0;
}

static int remove_files(void **state)
{
    (void)state;
    remove(good);
    remove(bad);
    remove(other);
    for (int i = 0; i < PARTS; i++)
        remove(keys[i]);
    return 0;
}

// Chunks of which a bit of an array is another one; `each`: bytes of a point, at `at`.
static void damage(const uint32_t *chunks, uint32_t count, size_t at, size_t each)
{
    size_t size;
    unsigned char *data = bytes_of(good, &size);
    patina_cloud *cloud = open_cloud(good);
    for (uint32_t i = 0; i < count; i++)
        data[at + cloud->chunks[chunks[i]].first * each + 100 * each / 2] ^= 4;
    patina_cloud_destroy(cloud);
    write_bytes(bad, data, size);
    free(data);
}

static int is_of(const patina_cloud *cloud, const uint32_t *chunks, uint32_t count, uint64_t number)
{
    for (uint32_t i = 0; i < count; i++) {
        const struct pt_chunk *chunk = &cloud->chunks[chunks[i]];
        for (uint32_t k = 0; k < chunk->count; k++)
            if (cloud->order[chunk->first + k] == number)
                return 1;
    }
    return 0;
}

// Pixels that showed other points show them still; those of the damaged pages show what lies behind, or nothing.
static void expect_without(const patina_cloud *whole, const struct picture *before, const struct picture *after,
                           const uint32_t *chunks, uint32_t count)
{
    uint32_t lost = 0;
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
        if (before->keys[i] != KEY_EMPTY && is_of(whole, chunks, count, key_id(before->keys[i]))) {
            lost++;
            assert_true(after->keys[i] > before->keys[i]);
        } else {
            assert_true(after->keys[i] == before->keys[i]);
        }
        assert_true(after->keys[i] == KEY_EMPTY || !is_of(whole, chunks, count, key_id(after->keys[i])));
    }
    print_message("%u pixels showed a damaged page\n", lost);
    assert_true(lost > 20);
}

static patina_settings plain_settings(void)
{
    patina_settings settings = settings_default(WIDTH, HEIGHT);
    settings.fill = PATINA_FILL_OFF;
    return settings;
}

// One page, some pages: of positions, and of what belongs to them.
static void left_out(patina_device *device, const char *name)
{
    print_message("%s\n", name);
    patina_cloud *whole = open_cloud(good);
    const uint32_t some[] = {whole->chunk_count / 2, whole->chunk_count / 3, whole->chunk_count - 1, 0, whole->chunk_count / 5};
    size_t size, at;
    char log[2048], wanted[128];
    unsigned char *data = bytes_of(good, &size);
    const patina_settings settings = plain_settings();
    struct picture before = render_with(device, whole, &settings);
    support_drain_log(log, sizeof log);
    for (int round = 0; round < 3; round++) {
        const uint32_t count = round == 1 ? 5 : 1;
        at = positions_at(data);
        if (round == 2) // surfels: behind positions and numbers
            at += rounded((size_t)whole->slots * 12) + rounded((size_t)whole->slots * 4);
        damage(some, count, at, round == 2 ? 4 : 12);
        patina_cloud *damaged = open_cloud(bad);
        assert_int_equal(support_drain_log(log, sizeof log), 0); // nobody has read it
        struct picture after = render_with(device, damaged, &settings);
        assert_int_equal(support_drain_log(log, sizeof log), 1);
        snprintf(wanted, sizeof wanted, count > 1 ? "%s: 5 of %u pages are damaged" : "%s: page %u of", bad,
                 count > 1 ? whole->chunk_count : some[0] + 1);
        if (!strstr(log, wanted) || !strstr(log, "left out"))
            support_die("'%s' should hold '%s'", log, wanted);
        expect_without(whole, &before, &after, some, count);
        struct picture again = render_with(device, damaged, &settings); // and tells it once
        if (support_drain_log(log, sizeof log))
            support_die("told again: %s", log);
        assert_memory_equal(again.keys, after.keys, WIDTH * HEIGHT * sizeof *after.keys);
        patina_cloud_destroy(damaged);
        picture_free(&after);
        picture_free(&again);
        assert_int_equal(patina_cloud_verify(bad, NULL), PATINA_ERROR_FORMAT);
        support_drain_log(log, sizeof log);
    }
    free(data);
    picture_free(&before);
    patina_cloud_destroy(whole);
}

static void test_left_out(void **state)
{
    (void)state;
    support_each_device(left_out);
}

// Below a cap, in rounds; light maps, and filled layers: nothing crashes, and the picture does not depend on the cap.
static void test_rounds(void **state)
{
    (void)state;
    patina_cloud *whole = open_cloud(good);
    const uint32_t some[] = {whole->chunk_count / 2, whole->chunk_count / 3};
    size_t size;
    char log[2048];
    unsigned char *data = bytes_of(good, &size);
    damage(some, 2, positions_at(data), 12);
    free(data);
    const patina_settings settings = settings_default(WIDTH, HEIGHT);
    struct picture pictures[2];
    for (int capped = 0; capped < 2; capped++) {
        const patina_device_desc desc = {.struct_size = sizeof desc, .name = "cpu", .mapped_cap = capped ? 400000 : 0};
        patina_device *device = NULL;
        CHECK(patina_device_create(&desc, &device), NULL);
        patina_cloud *damaged = open_cloud(bad);
        pictures[capped] = render_with(device, damaged, &settings);
        const int lines = support_drain_log(log, sizeof log);
        assert_int_equal(lines, 1);
        patina_cloud_destroy(damaged);
        patina_device_destroy(device);
    }
    assert_memory_equal(pictures[0].keys, pictures[1].keys, WIDTH * HEIGHT * sizeof *pictures[0].keys);
    assert_memory_equal(pictures[0].combined, pictures[1].combined, WIDTH * HEIGHT * 4 * sizeof *pictures[0].combined);
    picture_free(&pictures[0]);
    picture_free(&pictures[1]);
    patina_cloud_destroy(whole);
}

// ---- in parts ----------------------------------------------------------------------------------------------------------

// Of the first pages, all of the first part, a position each, and all colours: whoever draws them shows it.
static void damage_first(void)
{
    size_t size;
    unsigned char *data = bytes_of(good, &size);
    patina_cloud *cloud = open_cloud(good);
    const size_t slots = cloud->slots, each = pt_color_size(cloud->color_format);
    const size_t colors = positions_at(data) + rounded(slots * 12) + 2 * rounded(slots * 4);
    assert_memory_equal(data + colors, cloud->colors, slots * each);
    const struct pt_chunk *end = &cloud->chunks[cloud->chunk_count / 4];
    for (const struct pt_chunk *chunk = cloud->chunks; chunk < end; chunk++)
        data[positions_at(data) + (size_t)chunk->first * 12] ^= 4;
    for (size_t i = 0; i < end->first * each; i++)
        data[colors + i] = (unsigned char)~data[colors + i];
    patina_cloud_destroy(cloud);
    write_bytes(bad, data, size);
    free(data);
}

static patina_scene *scene_with(const patina_cloud *cloud, const patina_settings *settings, int lit)
{
    const patina_light_desc sun = {
        .struct_size = sizeof sun, .type = PATINA_LIGHT_SUN, .power = 1, .direction = {0, 1, -1}, .shadows = 1};
    patina_cloud_style style = PATINA_CLOUD_STYLE_INIT;
    style.lighting = lit ? PATINA_LIGHTING_LIT : PATINA_LIGHTING_AUTO;
    patina_scene *scene = scene_of(cloud, &style);
    if (lit)
        CHECK(patina_scene_add_light(scene, &sun), scene);
    CHECK(patina_scene_set_camera(scene, camera_of()), scene);
    CHECK(patina_scene_set_settings(scene, settings), scene);
    return scene;
}

// As on machines of their own, each of which opens the file; of the first part, the others and the merge.
static struct picture draw_in_parts(patina_device *device, const patina_settings *settings, int lit, const char *first,
                                    const char *others, const char *merged)
{
    const char *list[PARTS];
    struct picture picture = {0};
    for (uint32_t k = 0; k <= PARTS; k++) {
        const patina_part part = {.struct_size = sizeof part, .part = k + 1, .of = PARTS};
        patina_cloud *cloud = open_cloud(k == 0 ? first : k < PARTS ? others : merged);
        patina_scene *scene = scene_with(cloud, settings, lit);
        patina_frame *frame = NULL;
        uint32_t round = 9;
        CHECK(patina_frame_create(device, &frame), device);
        if (k < PARTS) {
            list[k] = keys[k];
            CHECK(patina_frame_scatter(frame, scene, &part, keys[k]), frame);
        } else {
            CHECK(patina_frame_merge(frame, scene, list, PARTS, NULL, &round), frame);
            assert_int_equal(round, 0);
            picture = picture_read(frame);
        }
        patina_frame_destroy(frame);
        patina_scene_destroy(scene);
        patina_cloud_destroy(cloud);
    }
    return picture;
}

static struct picture render_lit(patina_device *device, const patina_cloud *cloud, const patina_settings *settings, int lit)
{
    patina_scene *scene = scene_with(cloud, settings, lit);
    struct picture picture = picture_render(device, scene, camera_of(), settings);
    patina_scene_destroy(scene);
    return picture;
}

static patina_device *open_capped(const char *name, uint64_t cap)
{
    patina_device *device = NULL;
    const patina_device_desc desc = {.struct_size = sizeof desc, .name = name, .mapped_cap = cap};
    CHECK(patina_device_create(&desc, &device), NULL);
    return device;
}

// All parts agree on what the picture is, whoever of them reads the damage; it is that of one machine, of points, discs and shadows. Whoever
// merges may have a good file or not: the keys have no point of the page, and what is drawn once more leaves it out.
static void in_parts(patina_device *plain, const char *name)
{
    print_message("%s\n", name);
    damage_first();
    for (int capped = 0; capped < 2; capped++)
        for (int what = 0; what < 3; what++) {
            char log[4096];
            const int discs = what == 1, lit = what == 2;
            patina_device *own = capped ? open_capped(name, CAP) : NULL, *device = own ? own : plain;
            patina_settings settings = plain_settings();
            settings.surface = discs ? PATINA_SURFACE_SPLATS : PATINA_SURFACE_FILL;
            patina_cloud *whole = open_cloud(good), *damaged = open_cloud(bad);
            struct picture before = render_lit(device, whole, &settings, lit),
                           alone = render_lit(device, damaged, &settings, lit);
            assert_true(memcmp(before.keys, alone.keys, WIDTH * HEIGHT * sizeof *alone.keys) != 0);
            support_drain_log(log, sizeof log);
            struct picture parts = draw_in_parts(device, &settings, lit, bad, bad, bad);
            const int lines = support_drain_log(log, sizeof log);
            assert_true(lines >= 1 && lines <= PARTS + 1); // each machine tells its own
            assert_memory_equal(parts.keys, alone.keys, WIDTH * HEIGHT * sizeof *parts.keys);
            assert_memory_equal(parts.combined, alone.combined, 4 * WIDTH * HEIGHT * sizeof *parts.combined);
            struct picture mixed = draw_in_parts(device, &settings, lit, bad, good, bad);
            assert_memory_equal(mixed.combined, alone.combined, 4 * WIDTH * HEIGHT * sizeof *mixed.combined);
            picture_free(&mixed);
            mixed = draw_in_parts(device, &settings, lit, good, good, bad);
            assert_memory_equal(mixed.keys, before.keys, WIDTH * HEIGHT * sizeof *mixed.keys); // as who read them has them
            for (size_t i = 0; i < 4u * WIDTH * HEIGHT; i++)
                assert_true(isfinite(mixed.combined[i]));
            support_drain_log(log, sizeof log);
            picture_free(&before);
            picture_free(&alone);
            picture_free(&parts);
            picture_free(&mixed);
            patina_cloud_destroy(whole);
            patina_cloud_destroy(damaged);
            patina_device_destroy(own);
        }
}

static void test_in_parts(void **state)
{
    (void)state;
    support_each_device(in_parts);
}

// ---- cancelled ---------------------------------------------------------------------------------------------------------

static int nobody_looked(const patina_cloud *cloud)
{
    for (uint32_t c = 0; c < cloud->chunk_count; c++)
        if (atomic_load(&cloud->page_sums->states[c]))
            return 0;
    return 1;
}

// Before it begins, and a device that copies clouds looks at them first of all: it neither looks on, nor forgets it over the damage.
static void cancelled(patina_device *device, const char *name)
{
    print_message("%s\n", name);
    damage_first();
    char log[2048];
    const patina_settings settings = plain_settings();
    const patina_part part = {.struct_size = sizeof part, .part = 1, .of = PARTS};
    patina_cloud *cloud = open_cloud(bad);
    patina_scene *scene = scene_with(cloud, &settings, 1);
    patina_frame *frame = NULL;
    CHECK(patina_frame_create(device, &frame), device);
    for (int what = 0; what < 3; what++) {
        patina_frame_cancel(frame);
        const int code = what == 0   ? patina_frame_render(frame, scene)
                         : what == 1 ? patina_frame_scatter(frame, scene, &part, keys[0])
                                     : patina_frame_bake_shadows(frame, scene);
        assert_int_equal(code, PATINA_ERROR_CANCELLED);
        assert_true(nobody_looked(cloud));
    }
    CHECK(patina_frame_render(frame, scene), frame);
    assert_true(support_drain_log(log, sizeof log) >= 1);
    patina_frame_destroy(frame);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

static void test_cancelled(void **state)
{
    (void)state;
    support_each_device(cancelled);
}

// ---- below a cap -------------------------------------------------------------------------------------------------------

static int no_run(void *context, struct pt_buffer *const *buffers)
{
    (void)buffers;
    ++*(int *)context;
    return PATINA_OK;
}

// What is held once the pages are looked at that passes of a kernel walk, which themselves read nothing here.
static uint64_t held_after(patina_device *device, const patina_scene *scene, enum pt_kernel kernel, int wanted)
{
    struct pt_pager pager = {0};
    struct pt_plan plan;
    uint64_t held = 0;
    int runs = 0, found = 0;
    CHECK(pt_plan_create(scene, NULL, &plan), NULL);
    CHECK(pt_pager_open(&pager, device, scene), device);
    assert_int_equal(pager.cap, CAP_OF_MANY);
    for (uint32_t i = 0; i < plan.pass_count; i++) {
        const struct pt_pass *pass = &plan.passes[i];
        if (pass->kernel != kernel || found++)
            continue;
        struct pt_buffer *none = calloc(pass->ref_count, sizeof *none), **bound = calloc(pass->ref_count, sizeof *bound);
        for (uint32_t k = 0; k < pass->ref_count; k++) {
            const struct pt_ref *ref = &pass->refs[k];
            bound[k] = &none[k];
            if (ref->of == PT_OF_INSTANCE && ref->which == PT_CHUNKS) {
                none[k].data = plan.instances[ref->index].chunks;
                none[k].size = plan.instances[ref->index].chunk_count * sizeof *plan.instances->chunks;
            }
        }
        assert_int_equal(pt_pager_run(&pager, &plan, pass, bound, no_run, &runs, sizeof runs), wanted);
        held = pt_file_memory() - pager.before;
        free(none);
        free(bound);
    }
    assert_true(found && (runs > 0) == (wanted == PATINA_OK));
    pt_pager_close(&pager);
    pt_plan_destroy(&plan);
    return held;
}

// Discs are no pass in rounds, and where a page is damaged all others are looked at: no more is held than in rounds.
static void test_below_cap(void **state)
{
    (void)state;
    if (!pt_file_memory())
        skip();
    char log[2048];
    save(MANY, other);
    for (int damaged = 0; damaged < 2; damaged++) {
        patina_settings settings = plain_settings();
        settings.surface = damaged ? PATINA_SURFACE_FILL : PATINA_SURFACE_SPLATS;
        if (damaged) {
            size_t size;
            unsigned char *data = bytes_of(other, &size);
            data[positions_at(data) + 600] ^= 4; // of the first page
            write_bytes(other, data, size);
            free(data);
        }
        patina_device *device = open_capped("cpu", CAP_OF_MANY);
        patina_cloud *cloud = open_cloud(other);
        patina_scene *scene = scene_with(cloud, &settings, 0);
        support_drain_log(log, sizeof log);
        const uint64_t held = held_after(device, scene, damaged ? PT_KERNEL_scatter : PT_KERNEL_splat,
                                         damaged ? PT_AGAIN : PATINA_OK);
        print_message("%.2f MB held, with a cap of %.2f\n", 1e-6 * (double)held, 1e-6 * CAP_OF_MANY);
        if (returned_goes_at_once())
            assert_true(held <= CAP_OF_MANY + BESIDE);
        assert_int_equal(support_drain_log(log, sizeof log), damaged);
        patina_scene_destroy(scene);
        patina_cloud_destroy(cloud);
        patina_device_destroy(device);
    }
}

// ---- written -----------------------------------------------------------------------------------------------------------

// Saved or analysed, damage would get sums that say that it is good: it is refused, nothing is written, and pictures still tell of it.
static void test_not_written(void **state)
{
    (void)state;
    char log[2048], wanted[128];
    const uint32_t some[] = {3, 5};
    for (uint32_t count = 1; count <= 2; count++) {
        size_t size;
        unsigned char *data = bytes_of(good, &size);
        damage(some, count, positions_at(data), 12);
        free(data);
        patina_device *device = support_device_first();
        const patina_settings settings = plain_settings();
        patina_cloud *cloud = open_cloud(bad);
        snprintf(wanted, sizeof wanted,
                 count > 1 ? "%s: 2 of %u pages are damaged, the first is page 4" : "%s: page 4 of %u is damaged", bad,
                 cloud->chunk_count);
        remove(other);
        support_drain_log(log, sizeof log);
        assert_int_equal(patina_cloud_save(cloud, other), PATINA_ERROR_FORMAT);
        assert_non_null(strstr(support_message(cloud), wanted));
        assert_int_equal(patina_cloud_save(cloud, bad), PATINA_ERROR_FORMAT); // onto itself
        assert_int_equal(support_drain_log(log, sizeof log), 2);
        struct picture picture = render_with(device, cloud, &settings);
        assert_int_equal(support_drain_log(log, sizeof log), 1);
        assert_non_null(strstr(log, "left out"));
        picture_free(&picture);
        patina_cloud_destroy(cloud);
        const patina_analysis_desc analysis = {.struct_size = sizeof analysis, .keep_normals = 1};
        assert_int_equal(patina_cloud_analyse_file(bad, &analysis, 0, other, NULL), PATINA_ERROR_FORMAT);
        assert_non_null(strstr(support_message(NULL), wanted));
        FILE *stream = fopen(other, "rb");
        assert_null(stream);
        patina_device_destroy(device);
    }
    patina_cloud *cloud = open_cloud(good);
    size_t sizes[2];
    CHECK(patina_cloud_save(cloud, other), cloud); // what is good is as it was
    unsigned char *one = bytes_of(good, &sizes[0]), *two = bytes_of(other, &sizes[1]);
    assert_int_equal(sizes[0], sizes[1]);
    assert_memory_equal(one, two, sizes[0]);
    free(one);
    free(two);
    patina_cloud_destroy(cloud);
}

// What verifying reads: each section's first byte, and what the head says of itself.
static void test_verified(void **state)
{
    (void)state;
    size_t size;
    unsigned char *data = bytes_of(good, &size);
    char log[2048];
    CHECK(patina_cloud_verify(good, NULL), NULL);
    const size_t at[] = {size - SECTION, size - SECTION + 40, SUM_AT, SUM_AT + 8, SECTION, positions_at(data) + 5};
    for (size_t i = 0; i < sizeof at / sizeof *at; i++) {
        data[at[i]] ^= 1;
        write_bytes(bad, data, size);
        data[at[i]] ^= 1;
        if (patina_cloud_verify(bad, NULL) != PATINA_ERROR_FORMAT)
            support_die("byte %zu of %zu is not verified", at[i], size);
        if (i < 2)
            assert_non_null(strstr(support_message(NULL), "check sums of its pages"));
    }
    support_drain_log(log, sizeof log);
    free(data);
}

// ---- the sums ----------------------------------------------------------------------------------------------------------

// The sums themselves, or where they should be.
static void test_damaged_sums(void **state)
{
    (void)state;
    size_t size;
    patina_cloud *cloud = NULL;
    unsigned char *data = bytes_of(good, &size);
    data[size - SECTION] ^= 1; // they lie in the last section
    write_bytes(bad, data, size);
    assert_int_equal(patina_cloud_open(bad, &cloud), PATINA_ERROR_FORMAT);
    assert_null(cloud);
    assert_non_null(strstr(support_message(NULL), "check sums"));
    write_bytes(bad, data, size - SECTION);
    assert_int_equal(patina_cloud_open(bad, &cloud), PATINA_ERROR_FORMAT);
    assert_non_null(strstr(support_message(NULL), "cut short"));
    free(data);
}

// As the version before wrote it: no sums, another number, and a sum of the head that counts on that.
static void test_version_before(void **state)
{
    (void)state;
    size_t size;
    unsigned char *data = bytes_of(good, &size);
    const uint32_t version = 10;
    const uint64_t less = size - SECTION;
    memcpy(data + VERSION_AT, &version, sizeof version);
    memcpy(data + SIZE_AT, &less, sizeof less);
    uint64_t sum = pt_fingerprint(version, data, SUM_AT);
    sum = pt_fingerprint(sum, data + SECTION, (size_t)word_at(data, CHUNKS_AT) * word_at(data, BYTES_OF_CHUNKS_AT));
    memcpy(data + SUM_AT, &sum, sizeof sum);
    memset(data + SUM_AT + 8, 0, 8);
    write_bytes(bad, data, (size_t)less);
    free(data);
    patina_device *device = support_device_first();
    const patina_settings settings = plain_settings();
    patina_cloud *whole = open_cloud(good), *old = open_cloud(bad);
    struct picture before = render_with(device, whole, &settings), after = render_with(device, old, &settings);
    assert_memory_equal(before.keys, after.keys, WIDTH * HEIGHT * sizeof *before.keys);
    picture_free(&before);
    picture_free(&after);
    patina_cloud_destroy(whole);
    patina_cloud_destroy(old);
    patina_device_destroy(device);
}

// In whatever pieces, it is the sum of all.
static void test_sum(void **state)
{
    (void)state;
    unsigned char data[300];
    for (size_t i = 0; i < sizeof data; i++)
        data[i] = (unsigned char)(i * i + 7 * i);
    for (size_t size = 0; size <= sizeof data; size++)
        for (size_t piece = 1; piece < 90; piece += 11) {
            struct pt_sum sum;
            pt_sum_begin(&sum, size);
            for (size_t done = 0; done < size; done += piece)
                pt_sum_add(&sum, data + done, size - done < piece ? size - done : piece);
            assert_true(pt_sum_end(&sum) == pt_fingerprint(size, data, size));
        }
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_sum),          cmocka_unit_test(test_left_out),
                                       cmocka_unit_test(test_rounds),       cmocka_unit_test(test_in_parts),
                                       cmocka_unit_test(test_cancelled),    cmocka_unit_test(test_below_cap),
                                       cmocka_unit_test(test_not_written),  cmocka_unit_test(test_verified),
                                       cmocka_unit_test(test_damaged_sums), cmocka_unit_test(test_version_before)};
    return cmocka_run_group_tests(tests, make_files, remove_files);
}
