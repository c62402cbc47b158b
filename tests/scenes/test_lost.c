// SPDX-License-Identifier: GPL-3.0-or-later
// A cloud's file that is cut short while it is mapped, at any time: what is left is drawn, one line names the file, calls that would
// work with the missing points fail, and nothing ends the process. The host's own handler of such faults still works.
#ifdef _WIN32
#include <stdio.h>

int main(void)
{
    printf("skip: Windows cuts no mapped file short; tests/unit/test_cli.py does it from outside, where wine runs the program\n"
           "0 passed, 0 failed, 1 skipped\n");
    return 0;
}
#else
#include "clouds.h"
#include "support.h"

#include "folder.h" // behind cmocka.h

#include "base/platform.h"
#include "scene/clouds/cloud.h"
#include "scene/clouds/page_sums.h"

#include <math.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

enum { POINTS = 300000, WIDTH = 200, HEIGHT = 160, CAP = 700000 };

static char path[80], other[80], keys_path[80];
static unsigned char *good; // the file's bytes
static size_t good_size;

static void put_back(void)
{
    FILE *stream = fopen(path, "wb");
    assert_non_null(stream);
    assert_int_equal(fwrite(good, 1, good_size, stream), good_size);
    fclose(stream);
}

// Another file takes its place, as saving does: what is mapped stays.
static void renew(void)
{
    remove(path);
    put_back();
}

static void cut(double share) { assert_int_equal(truncate(path, (off_t)(share * (double)good_size)), 0); }

static int make_file(void **state)
{
    (void)state;
    snprintf(path, sizeof path, "patina-lost-%ld.cloud", (long)getpid());
    snprintf(other, sizeof other, "patina-lost-%ld.other", (long)getpid());
    snprintf(keys_path, sizeof keys_path, "patina-lost-%ld.keys", (long)getpid());
    struct points points = points_torus(POINTS, 2.0, 0.7, POINTS_ALL, 7);
    const patina_cloud_desc desc = points_desc(&points);
    patina_cloud *cloud = NULL;
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    CHECK(patina_cloud_save(cloud, path), cloud);
    patina_cloud_destroy(cloud);
    points_free(&points);
    good = bytes_of(path, &good_size);
    return 0;
}

static int remove_files(void **state)
{
    (void)state;
    remove(path);
    remove(other);
    remove(keys_path);
    free(good);
    return 0;
}

static patina_cloud *open_cloud(void)
{
    patina_cloud *cloud = NULL;
    CHECK(patina_cloud_open(path, &cloud), NULL);
    return cloud;
}

enum how { PLAIN, SPLATS, SOFT, LIT, HOW_MANY };

static patina_scene *scene_as(const patina_cloud *cloud, enum how how)
{
    static const double eye[3] = {4, -3, 3}, target[3] = {0, 0, 0};
    const patina_light_desc sun = {
        .struct_size = sizeof sun, .type = PATINA_LIGHT_SUN, .power = 1, .direction = {0, 1, -1}, .shadows = 1};
    patina_cloud_style style = PATINA_CLOUD_STYLE_INIT;
    patina_settings settings = settings_default(WIDTH, HEIGHT);
    const patina_camera camera = camera_perspective(eye, target, 45, WIDTH, HEIGHT, 0.1, 100);
    style.soft = how == SOFT ? PATINA_SOFT_ALL : PATINA_SOFT_OFF;
    style.lighting = how == LIT ? PATINA_LIGHTING_LIT : PATINA_LIGHTING_AUTO;
    settings.surface = how == SPLATS ? PATINA_SURFACE_SPLATS : PATINA_SURFACE_AUTO;
    settings.fill = how == PLAIN ? PATINA_FILL_OFF : PATINA_FILL_CLOSED;
    patina_scene *scene = scene_of(cloud, &style);
    if (how == LIT)
        CHECK(patina_scene_add_light(scene, &sun), scene);
    CHECK(patina_scene_set_camera(scene, &camera), scene);
    CHECK(patina_scene_set_settings(scene, &settings), scene);
    return scene;
}

// Renders, and returns points that are lost. Keys are read unless the file may be cut any moment: their numbers come from it.
static uint64_t draw_some(patina_frame *frame, const patina_scene *scene, int keys, struct picture *picture)
{
    patina_frame_stats stats = {.struct_size = sizeof stats};
    CHECK(patina_frame_render(frame, scene), frame);
    CHECK(patina_frame_get_stats(frame, &stats), frame);
    *picture = keys ? picture_read(frame) : picture_read_passes(frame);
    return stats.points_lost;
}

static uint64_t draw(patina_frame *frame, const patina_scene *scene, struct picture *picture)
{
    return draw_some(frame, scene, 1, picture);
}

// The log's lines, of which `lines` are wanted, each with the file's name.
static void expect_log(int lines)
{
    char log[4096], *at = log;
    const int got = support_drain_log(log, sizeof log);
    int named = 0;
    while ((at = strstr(at, path))) {
        named++;
        at += strlen(path);
    }
    if (got != lines || named != lines)
        support_die("%d lines of the log in place of %d: '%s'", got, lines, log);
}

// Whether the point with a number lies in a chunk that is lost.
static int is_lost(const patina_cloud *cloud, const uint8_t *lost_numbers, uint32_t number)
{
    return number < cloud->info.count && lost_numbers[number];
}

static uint8_t *lost_numbers(const patina_cloud *whole, const patina_cloud *cut_short)
{
    uint8_t *lost = calloc(whole->info.count, 1);
    assert_non_null(lost);
    for (uint32_t c = 0; c < whole->chunk_count; c++)
        for (uint32_t k = 0; k < whole->chunks[c].count && pt_page_is_damaged(cut_short, c); k++)
            lost[whole->order[whole->chunks[c].first + k]] = 1;
    return lost;
}

static patina_device *device_with(const char *name, uint64_t cap)
{
    const patina_device_desc desc = {.struct_size = sizeof desc, .name = name, .mapped_cap = cap};
    patina_device *device = NULL;
    CHECK(patina_device_create(&desc, &device), NULL);
    return device;
}

// Drawn, cut short, and drawn twice more; then the file is back.
static void cut_between(patina_device *plain, const char *name)
{
    (void)plain;
    for (int capped = 0; capped < 2; capped++)
        for (enum how how = PLAIN; how < (support_is_gl(name) ? SPLATS : HOW_MANY);
             how++) // software takes long over the others
            for (int half = 0; half < 2; half++) {
                renew();
                patina_device *device = device_with(name, capped ? CAP : 0);
                patina_cloud *cloud = open_cloud();
                patina_scene *scene = scene_as(cloud, how);
                patina_frame *frame = NULL;
                struct picture before, after, again, back;
                CHECK(patina_frame_create(device, &frame), device);
                char log[4096];
                support_drain_log(log, sizeof log);
                assert_int_equal(draw(frame, scene, &before), 0);
                cut(half ? 0.95 : 0.0);
                patina_scene *other_side = scene_as(cloud, how); // a device that holds copies draws from these
                patina_frame *fresh = NULL;
                patina_device *second = device_with(name, capped ? CAP : 0);
                CHECK(patina_frame_create(second, &fresh), second);
                const uint64_t lost = draw(fresh, other_side, &after);
                printf("  %s%s, how %d: %llu of %d points are lost\n", name, capped ? ", capped" : "", how,
                       (unsigned long long)lost, POINTS);
                assert_true(lost > 0 && lost <= POINTS);
                assert_true(half ? lost < POINTS : lost == POINTS);
                expect_log(1);
                assert_true(draw(fresh, other_side, &again) >= lost);
                expect_log(0); // told once
                assert_memory_equal(again.combined, after.combined, WIDTH * HEIGHT * 4 * sizeof *again.combined);
                renew();
                patina_cloud *whole = open_cloud();
                uint8_t *numbers = lost_numbers(whole, cloud);
                for (uint32_t i = 0; i < WIDTH * HEIGHT && how == PLAIN; i++) {
                    if (before.keys[i] != KEY_EMPTY && !is_lost(whole, numbers, key_id(before.keys[i])))
                        assert_true(after.keys[i] == before.keys[i]);
                    assert_true(after.keys[i] == KEY_EMPTY || !is_lost(whole, numbers, key_id(after.keys[i])));
                }
                free(numbers);
                patina_scene *reloaded = scene_as(whole, how);
                assert_int_equal(draw(frame, reloaded, &back), 0);
                assert_memory_equal(back.combined, before.combined, WIDTH * HEIGHT * 4 * sizeof *back.combined);
                picture_free(&before);
                picture_free(&after);
                picture_free(&again);
                picture_free(&back);
                patina_frame_destroy(frame);
                patina_frame_destroy(fresh);
                patina_scene_destroy(scene);
                patina_scene_destroy(other_side);
                patina_scene_destroy(reloaded);
                patina_cloud_destroy(whole);
                patina_cloud_destroy(cloud);
                patina_device_destroy(device);
                patina_device_destroy(second);
            }
}

static void test_cut_between(void **state)
{
    (void)state;
    support_each_device(cut_between);
}

// ---- at any moment -----------------------------------------------------------------------------------------------------

struct cutting {
    uint32_t microseconds;
    double share;
};

static void cut_later(void *context)
{
    const struct cutting *cutting = context;
    usleep(cutting->microseconds);
    cut(cutting->share);
}

static void cut_meanwhile(patina_device *device, const char *name)
{
    struct pcg random = pcg_seed(49);
    uint32_t lost_some = 0, rounds = support_is_gl(name) ? 10 : 60;
    for (uint32_t round = 0; round < rounds; round++) {
        renew();
        patina_cloud *cloud = open_cloud();
        patina_scene *scene = scene_as(cloud, support_is_gl(name) ? PLAIN : (enum how)(round % HOW_MANY));
        patina_frame *frame = NULL;
        struct picture first, second, third;
        struct pt_thread thread;
        struct cutting cutting = {pcg_u32(&random) % 40000, pcg_unit(&random) * 0.9};
        CHECK(patina_frame_create(device, &frame), device);
        assert_int_equal(pt_thread_start(&thread, cut_later, &cutting, 0), 0);
        const uint64_t at_first = draw_some(frame, scene, 0, &first);
        pt_thread_join(&thread);
        const uint64_t lost = draw_some(frame, scene, 0, &second);
        lost_some += lost > 0;
        const uint64_t more = draw_some(frame, scene, 0, &third); // nothing changes any more
        printf("  %u: after %u us to %.3f: %llu, %llu and %llu are lost\n", round, cutting.microseconds, cutting.share,
               (unsigned long long)at_first, (unsigned long long)lost, (unsigned long long)more);
        assert_memory_equal(third.combined, second.combined, WIDTH * HEIGHT * 4 * sizeof *third.combined);
        char log[4096];
        const int lines = support_drain_log(log, sizeof log);
        if (lines > 1 || (lines == 1) != (lost > 0))
            support_die("%llu points are lost, and the log says: %s", (unsigned long long)lost, log);
        picture_free(&first);
        picture_free(&second);
        picture_free(&third);
        uint64_t keys[WIDTH * HEIGHT];
        const int read = patina_frame_read_keys(frame, keys, sizeof keys);
        assert_true(read == PATINA_OK || read == PATINA_ERROR_FILE);
        support_drain_log(log, sizeof log);
        patina_frame_destroy(frame);
        patina_scene_destroy(scene);
        patina_cloud_destroy(cloud);
    }
    printf("  %s: %u of %u files lost points\n", name, lost_some, rounds);
    assert_true(support_is_gl(name) || lost_some > rounds / 2);
}

static void test_cut_meanwhile(void **state)
{
    (void)state;
    support_each_device(cut_meanwhile);
}

// ---- other calls -------------------------------------------------------------------------------------------------------

static void expect_error(int code, const patina_cloud *cloud)
{
    char message[512];
    patina_message(cloud, message, sizeof message);
    if (code != PATINA_ERROR_FILE || !strstr(message, path))
        support_die("%d: '%s'", code, message);
}

static void test_other_calls(void **state)
{
    (void)state;
    char log[4096];
    patina_device *device = support_device_first();
    const patina_part part = {.struct_size = sizeof part, .part = 1, .of = 2};
    for (int call = 0; call < 6; call++) {
        renew();
        patina_cloud *cloud = open_cloud();
        cut(0.3);
        if (call == 0) {
            expect_error(patina_cloud_analyse(cloud, NULL, NULL), cloud);
        } else if (call == 1) { // the sums of pages find it first
            assert_true(patina_cloud_save(cloud, other) < 0);
            assert_int_not_equal(access(other, F_OK), 0);
        } else if (call == 2) {
            patina_frame *frame = NULL;
            patina_scene *scene = scene_as(cloud, PLAIN);
            CHECK(patina_frame_create(device, &frame), device);
            assert_int_equal(patina_frame_scatter(frame, scene, &part, keys_path), PATINA_ERROR_FILE);
            assert_int_not_equal(access(keys_path, F_OK), 0);
            patina_frame_destroy(frame);
            patina_scene_destroy(scene);
        } else if (call == 3) { // what reads points on its own ends, whatever it says
            double low[3], high[3];
            float range[2];
            patina_field *field = NULL;
            const patina_field_desc desc = {.struct_size = sizeof desc, .source = PATINA_FIELD_LUMINANCE};
            patina_cloud_dense_box(cloud, low, high);
            patina_cloud_scalar_range(cloud, 0.01, range);
            patina_field_create(cloud, &desc, NULL, &field);
            patina_field_destroy(field);
            pt_cloud_fingerprint(cloud);
            assert_true(pt_pages_lose(cloud) > 0);
        } else if (call == 4) {
            assert_int_equal(patina_cloud_verify(path, NULL), PATINA_ERROR_FORMAT);
        } else { // it does not open
            patina_cloud *none = NULL;
            assert_int_equal(patina_cloud_open(path, &none), PATINA_ERROR_FORMAT);
            assert_null(none);
        }
        patina_cloud_destroy(cloud);
        support_drain_log(log, sizeof log);
    }
    patina_device_destroy(device);
}

// Tables of points that are cut short while they are read.
static void test_tables(void **state)
{
    (void)state;
    char log[4096];
    FILE *stream = fopen(other, "wb");
    enum { ROWS = 400000 };
    fprintf(stream,
            "ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float "
            "z\nend_header\n",
            ROWS);
    for (int i = 0; i < ROWS; i++) {
        const float p[3] = {(float)i, 1.0f, 2.0f};
        fwrite(p, sizeof p, 1, stream);
    }
    fclose(stream);
    patina_rows *rows = NULL;
    patina_file *file = NULL;
    CHECK(patina_rows_open(other, NULL, &rows), NULL);
    CHECK(patina_rows_next(rows, 1000, &file), rows);
    patina_file_destroy(file);
    file = NULL;
    assert_int_equal(truncate(other, 100000), 0);
    int code = PATINA_OK;
    for (int i = 0; i < ROWS / 1000 && !code; i++) {
        code = patina_rows_next(rows, 1000, &file);
        patina_file_destroy(file);
        file = NULL;
    }
    assert_int_equal(code, PATINA_ERROR_FILE);
    patina_message(rows, log, sizeof log);
    assert_non_null(strstr(log, other));
    patina_rows_destroy(rows);
    support_drain_log(log, sizeof log);
    remove(other);
}

// ---- the host's handler --------------------------------------------------------------------------------------------------

static sigjmp_buf back_to_host;
static volatile sig_atomic_t host_faults;

static void host_handler(int signal, siginfo_t *info, void *context)
{
    (void)signal, (void)info, (void)context;
    host_faults++;
    siglongjmp(back_to_host, 1);
}

// The host's own fault: in a mapping that the library has nothing to do with.
static void fault_of_host(void)
{
    struct pt_disk disk;
    FILE *stream = fopen(other, "wb");
    assert_int_equal(pt_stream_resize(stream, 1 << 16), 0);
    fclose(stream);
    assert_int_equal(pt_disk_open(other, &disk), 0);
    volatile char *bytes = mmap(NULL, 1 << 16, PROT_READ, MAP_PRIVATE, (int)disk.handle, 0);
    assert_true(bytes != MAP_FAILED);
    assert_int_equal(truncate(other, 0), 0);
    const sig_atomic_t before = host_faults;
    if (!sigsetjmp(back_to_host, 1)) {
        (void)bytes[100];
        support_die("the host's fault was swallowed");
    }
    assert_int_equal(host_faults, before + 1);
    pt_disk_close(&disk);
    remove(other);
}

static void draw_cut_cloud(patina_device *device)
{
    renew();
    patina_cloud *cloud = open_cloud();
    patina_scene *scene = scene_as(cloud, PLAIN);
    patina_frame *frame = NULL;
    struct picture picture;
    cut(0.4);
    CHECK(patina_frame_create(device, &frame), device);
    assert_true(draw(frame, scene, &picture) > 0);
    picture_free(&picture);
    patina_frame_destroy(frame);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    expect_log(1);
}

static void test_host(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    struct sigaction host = {.sa_flags = SA_SIGINFO}, before;
    host.sa_sigaction = host_handler;
    draw_cut_cloud(device); // the library's stands first
    assert_int_equal(sigaction(SIGBUS, &host, &before), 0);
    draw_cut_cloud(device); // and takes the place of the host's, which came later
    fault_of_host();        // but hands it what is not its own
    assert_int_equal(sigaction(SIGBUS, &host, NULL), 0);
    draw_cut_cloud(device);
    fault_of_host();
    assert_int_equal(host_faults, 2);
    assert_int_equal(sigaction(SIGBUS, &before, NULL), 0);
    patina_device_destroy(device);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cut_between), cmocka_unit_test(test_cut_meanwhile), cmocka_unit_test(test_other_calls),
        cmocka_unit_test(test_tables),      cmocka_unit_test(test_host),
    };
    return cmocka_run_group_tests(tests, make_file, remove_files);
}
#endif
