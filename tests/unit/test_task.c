// SPDX-License-Identifier: GPL-3.0-or-later
// Tasks: the work of a call on a thread of its own, with its code and message; waiting, cancelling, letting go meanwhile.
#include "scene/analysis/analysis.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "folder.h"

enum { POINTS = 400000, SIDE = 64 };

static float points[POINTS][3];
static uint8_t colors[POINTS][3];

static patina_cloud_desc describe(uint64_t count)
{
    for (int i = 0; i < POINTS; i++)
        for (int k = 0; k < 3; k++) {
            points[i][k] = (float)((i * (7 + 6 * k)) % 9973) / 9973.0f;
            colors[i][k] = (uint8_t)(i + k);
        }
    return (patina_cloud_desc){.struct_size = sizeof(patina_cloud_desc),
                               .count = count,
                               .position = {points, PATINA_FLOAT32, 3, 0},
                               .color = {colors, PATINA_UINT8, 3, 0}};
}

static const char *message(const void *handle)
{
    static char text[512];
    patina_message(handle, text, sizeof text);
    return text;
}

static void wait_until_done(const patina_task *task)
{
    for (int i = 0; i < 30000 && !patina_task_done(task); i++)
        usleep(1000);
    assert_true(patina_task_done(task));
}

static void test_builds_and_renders(void **state)
{
    (void)state;
    patina_cloud_desc desc = describe(POINTS);
    patina_cloud *built = NULL, *again = NULL, *direct = NULL;
    patina_task *task = NULL;
    assert_int_equal(patina_task_build(&desc, NULL, &task), PATINA_OK);
    memset(&desc, 0, sizeof desc); // descriptors are copied
    wait_until_done(task);
    assert_int_equal(patina_task_wait(task), PATINA_OK);
    assert_int_equal(patina_task_wait(task), PATINA_OK);
    assert_int_equal(patina_task_take_cloud(task, &built), PATINA_OK);
    assert_int_equal(patina_task_take_cloud(task, &again), PATINA_ERROR_EMPTY);
    assert_null(again);
    patina_task_destroy(task);
    desc = describe(POINTS);
    assert_int_equal(patina_cloud_create(&desc, NULL, &direct), PATINA_OK);

    static float pixels[2][SIDE * SIDE * 4];
    patina_cloud *clouds[2] = {built, direct};
    patina_device *device;
    patina_device_desc cpu = {.struct_size = sizeof cpu, .name = "cpu"};
    assert_int_equal(patina_device_create(&cpu, &device), PATINA_OK);
    for (int i = 0; i < 2; i++) {
        patina_scene *scene;
        patina_frame *frame;
        patina_camera camera = {.struct_size = sizeof camera};
        patina_settings settings = {.struct_size = sizeof settings, .width = SIDE, .height = SIDE};
        assert_int_equal(patina_scene_create(&scene), PATINA_OK);
        assert_int_equal(patina_scene_add_cloud(scene, clouds[i], NULL), PATINA_OK);
        assert_int_equal(patina_scene_set_settings(scene, &settings), PATINA_OK);
        assert_int_equal(patina_scene_frame_camera(scene, 30, 40, 0, &camera), PATINA_OK);
        assert_int_equal(patina_scene_set_camera(scene, &camera), PATINA_OK);
        assert_int_equal(patina_frame_create(device, &frame), PATINA_OK);
        if (i == 0) {
            patina_read read = {PATINA_PASS_COMBINED, pixels[i], sizeof pixels[i] - 1};
            assert_int_equal(patina_task_render(frame, scene, &read, 1, &task), PATINA_OK);
            assert_int_equal(patina_task_wait(task), PATINA_ERROR_ARGUMENT);
            assert_non_null(strstr(message(task), "patina_frame_read"));
            patina_task_destroy(task);
            read.size = sizeof pixels[i];
            assert_int_equal(patina_task_render(frame, scene, &read, 1, &task), PATINA_OK);
            assert_int_equal(patina_task_wait(task), PATINA_OK);
        } else {
            assert_int_equal(patina_frame_render(frame, scene), PATINA_OK);
            assert_int_equal(patina_frame_read(frame, PATINA_PASS_COMBINED, pixels[i], sizeof pixels[i]), PATINA_OK);
        }
        patina_task_destroy(i == 0 ? task : NULL); // waits
        patina_frame_destroy(frame);
        patina_scene_destroy(scene);
        patina_cloud_destroy(clouds[i]);
    }
    patina_device_destroy(device);
    double sum = 0;
    for (int i = 0; i < SIDE * SIDE * 4; i++)
        sum += (double)pixels[0][i];
    assert_true(sum > 100);
    assert_memory_equal(pixels[0], pixels[1], sizeof pixels[0]);
}

static void test_errors_come_through(void **state)
{
    (void)state;
    patina_cloud_desc desc = describe(10);
    desc.color.components = 7;
    patina_task *task = NULL;
    patina_cloud *cloud = NULL;
    assert_int_equal(patina_task_build(&desc, NULL, &task), PATINA_OK);
    assert_int_equal(patina_task_wait(task), PATINA_ERROR_ARGUMENT);
    assert_non_null(strstr(message(task), "color: 7 components"));
    assert_int_equal(patina_task_take_cloud(task, &cloud), PATINA_ERROR_ARGUMENT);
    assert_null(cloud);
    patina_task_destroy(task);
    assert_int_equal(patina_task_render(NULL, NULL, NULL, 1, &task), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_task_render(NULL, NULL, NULL, 0, &task), PATINA_OK);
    assert_int_equal(patina_task_wait(task), PATINA_ERROR_ARGUMENT);
    assert_non_null(strstr(message(task), "patina_frame_render"));
    patina_task_destroy(task);
    assert_int_equal(patina_task_build(NULL, NULL, &task), PATINA_ERROR_ARGUMENT);
    assert_non_null(strstr(message(NULL), "patina_task_build"));
    assert_int_equal(patina_task_wait(NULL), PATINA_ERROR_ARGUMENT);
    patina_task_destroy(NULL);
}

static void test_cancel(void **state)
{
    (void)state;
    patina_cloud_desc desc = describe(POINTS);
    patina_progress *progress;
    patina_task *task;
    assert_int_equal(patina_progress_create(&progress), PATINA_OK);
    patina_progress_cancel(progress);
    assert_int_equal(patina_task_build(&desc, progress, &task), PATINA_OK);
    assert_int_equal(patina_task_wait(task), PATINA_ERROR_CANCELLED);
    assert_non_null(strstr(message(task), "cancelled"));
    patina_task_destroy(task);
    patina_progress_destroy(progress);
}

static void test_destroy_waits(void **state)
{
    (void)state;
    for (int i = 0; i < 4; i++) {
        patina_cloud_desc desc = describe(POINTS);
        patina_progress *progress;
        patina_task *task;
        assert_int_equal(patina_progress_create(&progress), PATINA_OK);
        assert_int_equal(patina_task_build(&desc, progress, &task), PATINA_OK);
        if (i & 1)
            patina_progress_cancel(progress);
        patina_task_destroy(task);
        float reached = patina_progress_value(progress); // nobody writes it any more
        usleep(5000);
        assert_true(patina_progress_value(progress) == reached);
        if (!(i & 1))
            assert_true(reached == 1.0f);
        patina_progress_destroy(progress);
    }
}

static void run_fingerprint(const patina_cloud_desc *desc, uint64_t values[2], int wanted)
{
    patina_task *task;
    assert_int_equal(patina_task_fingerprint(desc, values, &task), PATINA_OK);
    assert_int_equal(patina_task_wait(task), wanted);
    patina_task_destroy(task);
}

static void test_fingerprints(void **state)
{
    (void)state;
    patina_cloud_desc desc = describe(1001);
    uint64_t first[2], second[2];
    run_fingerprint(&desc, first, PATINA_OK);
    run_fingerprint(&desc, second, PATINA_OK);
    assert_memory_equal(first, second, sizeof first);
    colors[1000][2] ^= 1;
    run_fingerprint(&desc, second, PATINA_OK);
    assert_true(first[0] == second[0] && first[1] != second[1]);
    colors[1000][2] ^= 1;
    points[500][1] += 1.0f;
    run_fingerprint(&desc, second, PATINA_OK);
    assert_true(first[0] != second[0] && first[1] == second[1]);
    points[500][1] -= 1.0f;
    desc.normal = (patina_array){points, PATINA_FLOAT32, 3, 0};
    run_fingerprint(&desc, second, PATINA_OK);
    assert_true(first[0] != second[0] && first[1] == second[1]);
    desc.normal.stride = 16;
    run_fingerprint(&desc, second, PATINA_ERROR_ARGUMENT);
}

static void test_colors(void **state)
{
    (void)state;
    patina_cloud_desc desc = describe(1000);
    patina_cloud *cloud;
    patina_task *task;
    patina_cloud_info info = {.struct_size = sizeof info};
    assert_int_equal(patina_cloud_create(&desc, NULL, &cloud), PATINA_OK);
    assert_int_equal(patina_task_set_colors(cloud, &(patina_array){0}, &task), PATINA_OK);
    assert_int_equal(patina_task_wait(task), PATINA_OK);
    patina_task_destroy(task);
    assert_int_equal(patina_cloud_get_info(cloud, &info), PATINA_OK);
    assert_int_equal(info.has_colors, 0);
    patina_cloud_destroy(cloud);
}

// A cloud is written, a file opened: as the calls themselves do it, errors too.
static void test_files(void **state)
{
    (void)state;
    char path[] = "/tmp/patina-task-XXXXXX";
    const int descriptor = mkstemp(path);
    assert_true(descriptor >= 0);
    close(descriptor);
    const patina_cloud_desc desc = describe(1000);
    patina_cloud *cloud = NULL, *back = NULL;
    patina_task *task = NULL;
    patina_file *file = NULL, *again = NULL;
    assert_int_equal(patina_cloud_create(&desc, NULL, &cloud), PATINA_OK);
    assert_int_equal(patina_task_save(cloud, path, &task), PATINA_OK);
    assert_int_equal(patina_task_wait(task), PATINA_OK);
    assert_int_equal(patina_task_take_file(task, &file), PATINA_ERROR_EMPTY);
    patina_task_destroy(task);
    assert_int_equal(patina_cloud_open(path, &back), PATINA_OK);
    patina_cloud_destroy(back);

    assert_int_equal(patina_write_ply(path, &desc), PATINA_OK);
    assert_int_equal(patina_task_open_file(path, NULL, &task), PATINA_OK);
    assert_int_equal(patina_task_take_file(task, &file), PATINA_OK);
    assert_int_equal(patina_task_take_file(task, &again), PATINA_ERROR_EMPTY);
    patina_file_info info = {.struct_size = sizeof info};
    assert_int_equal(patina_file_get_info(file, &info), PATINA_OK);
    assert_int_equal(info.count, 1000);
    patina_file_destroy(file);
    patina_task_destroy(task);

    assert_int_equal(patina_task_open_file(path, NULL, &task), PATINA_OK);
    patina_task_destroy(task); // not taken
    unlink(path);
    assert_int_equal(patina_task_open_file(path, NULL, &task), PATINA_OK);
    assert_int_equal(patina_task_wait(task), PATINA_ERROR_FILE);
    assert_non_null(strstr(message(task), path));
    patina_task_destroy(task);
    assert_int_equal(patina_task_save(cloud, "/no/such/folder/cloud", &task), PATINA_OK);
    assert_int_equal(patina_task_wait(task), PATINA_ERROR_FILE);
    patina_task_destroy(task);
    assert_int_equal(patina_task_open_file(NULL, NULL, &task), PATINA_ERROR_ARGUMENT);
    patina_cloud_destroy(cloud);
}

// A saved cloud is analysed to another file: as the call itself does it, below a cap and with room, with stations; errors and a cancel
// leave nothing there.
static void test_analyses_files(void **state)
{
    (void)state;
    enum { LITTLE = 16 << 20, JUST_TOO_MANY = 310000, FEW = 4 };
#ifdef _WIN32
    char folder[] = "patina-task-XXXXXX";
#else
    char folder[] = "/tmp/patina-task-XXXXXX";
#endif
    assert_int_equal(make_folder_of(folder), 0);
    char from[64], to[64], wanted[64], none[64];
    static uint8_t station[POINTS];
    static const double stations[2][3] = {{0.5, 0.5, 9.0}, {0.5, 0.5, -9.0}};
    snprintf(from, sizeof from, "%s/plain", folder);
    snprintf(to, sizeof to, "%s/found", folder);
    snprintf(wanted, sizeof wanted, "%s/wanted", folder);
    snprintf(none, sizeof none, "%s/none", folder);
    const patina_cloud_desc desc = describe(JUST_TOO_MANY);
    patina_cloud *cloud = NULL;
    patina_task *task = NULL;
    patina_progress *progress = NULL;
    for (int i = 0; i < JUST_TOO_MANY; i++)
        station[i] = points[i][2] < 0.5f;
    assert_int_equal(patina_cloud_create(&desc, NULL, &cloud), PATINA_OK);
    assert_int_equal(patina_cloud_save(cloud, from), PATINA_OK);
    patina_cloud_destroy(cloud);
    assert_int_equal(patina_cloud_open(from, &cloud), PATINA_OK);
    assert_true(pt_cloud_mapped_bytes(cloud) + pt_analysis_memory(cloud) > LITTLE);
    patina_cloud_destroy(cloud);
    for (int told = 0; told < 2; told++) {
        patina_analysis_desc analysis = {.struct_size = sizeof analysis, .neighbours = FEW};
        if (told) {
            analysis.station_count = 2;
            analysis.stations = &stations[0][0];
            analysis.station = (patina_array){station, PATINA_UINT8, 1, 0};
        }
        assert_int_equal(patina_cloud_analyse_file(from, &analysis, LITTLE, wanted, NULL), PATINA_OK);
        for (int room = 0; room < 2; room++) {
            char first[64], second[64];
            patina_analysis_desc given = analysis;
            memcpy(first, from, sizeof first);
            memcpy(second, to, sizeof second);
            assert_int_equal(patina_progress_create(&progress), PATINA_OK);
            assert_int_equal(patina_task_analyse_file(first, &given, room ? 0 : LITTLE, second, progress, &task), PATINA_OK);
            memset(&given, 255, sizeof given); // descriptors and paths are copied
            memset(first, 'x', sizeof first - 1);
            memset(second, 'x', sizeof second - 1);
            assert_int_equal(patina_task_wait(task), PATINA_OK);
            assert_int_equal(patina_task_apply(task), PATINA_ERROR_EMPTY); // there is nothing to apply
            patina_task_destroy(task);
            assert_true(patina_progress_value(progress) == 1.0f);
            patina_progress_destroy(progress);
            assert_same_file(to, wanted);
            assert_int_equal(unlink(to), 0);
        }
    }
    assert_int_equal(patina_progress_create(&progress), PATINA_OK);
    assert_int_equal(patina_task_analyse_file(from, NULL, LITTLE, to, progress, &task), PATINA_OK); // cancelled while it runs
    while (!patina_task_done(task) && patina_progress_value(progress) < 0.05f)
        usleep(1000);
    patina_progress_cancel(progress);
    assert_int_equal(patina_task_wait(task), PATINA_ERROR_CANCELLED);
    assert_non_null(strstr(message(task), "cancelled"));
    patina_task_destroy(task);
    patina_progress_destroy(progress);
    assert_int_equal(patina_task_analyse_file(none, NULL, LITTLE, to, NULL, &task), PATINA_OK);
    assert_int_equal(patina_task_wait(task), PATINA_ERROR_FILE);
    assert_non_null(strstr(message(task), none));
    patina_task_destroy(task);
    const patina_analysis_desc wrong = {.struct_size = sizeof wrong, .neighbours = 2};
    assert_int_equal(patina_task_analyse_file(from, &wrong, LITTLE, to, NULL, &task), PATINA_OK);
    assert_int_equal(patina_task_wait(task), PATINA_ERROR_ARGUMENT);
    patina_task_destroy(task);
    assert_int_equal(patina_task_analyse_file(NULL, NULL, LITTLE, to, NULL, &task), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_task_analyse_file(from, NULL, LITTLE, NULL, NULL, &task), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_task_analyse_file(from, NULL, LITTLE, to, NULL, NULL), PATINA_ERROR_ARGUMENT);
    unlink(from);
    unlink(wanted);
    assert_int_equal(rmdir(folder), 0); // nothing else was left
}

// Pieces are added while the caller reads on: the file is that of a builder that was waited for. A piece that is refused says so at its task, and
// a builder may go when its last task has.
static void test_adds_to_builds(void **state)
{
    (void)state;
    enum { PIECE = 90000 };
    char path[2][64] = {"/tmp/patina-task-XXXXXX", "/tmp/patina-task-XXXXXX"};
    const patina_builder_desc how = {.struct_size = sizeof how, .memory = 64 << 20};
    const patina_cloud_desc all = describe(POINTS);
    patina_builder *builder = NULL;
    patina_task *task = NULL;
    for (int beside = 0; beside < 2; beside++) {
        const int descriptor = mkstemp(path[beside]);
        assert_true(descriptor >= 0);
        close(descriptor); // Windows replaces no file that is open
        assert_int_equal(patina_builder_begin(path[beside], &how, &builder), PATINA_OK);
        for (uint64_t first = 0; first < POINTS; first += PIECE) {
            patina_cloud_desc piece = all;
            piece.count = POINTS - first < PIECE ? POINTS - first : PIECE;
            piece.position.data = points[first];
            piece.color.data = colors[first];
            if (!beside) {
                assert_int_equal(patina_builder_add(builder, &piece), PATINA_OK);
                continue;
            }
            assert_int_equal(patina_task_add_to_build(builder, &piece, &task), PATINA_OK);
            memset(&piece, 0, sizeof piece); // descriptors are copied
            assert_int_equal(patina_task_wait(task), PATINA_OK);
            patina_task_destroy(task);
        }
        assert_int_equal(patina_builder_end(builder, NULL), PATINA_OK);
        patina_builder_destroy(builder);
    }
    assert_same_file(path[0], path[1]);
    assert_int_equal(patina_builder_begin(path[1], &how, &builder), PATINA_OK);
    assert_int_equal(patina_builder_add(builder, &all), PATINA_OK);
    patina_cloud_desc elsewhere = all;
    elsewhere.origin[0] = 1.0;
    assert_int_equal(patina_task_add_to_build(builder, &elsewhere, &task), PATINA_OK);
    assert_int_equal(patina_task_wait(task), PATINA_ERROR_ARGUMENT);
    assert_non_null(strstr(message(task), "origin"));
    patina_task_destroy(task);
    assert_int_equal(patina_task_add_to_build(builder, &all, &task), PATINA_OK);
    patina_task_destroy(task); // waits
    patina_builder_destroy(builder);
    assert_int_equal(patina_task_add_to_build(NULL, &all, &task), PATINA_ERROR_ARGUMENT);
    assert_same_file(path[0], path[1]); // it was not ended
    unlink(path[0]);
    unlink(path[1]);
}

// Whatever is written over what a section of a saved cloud holds is found, and nothing is where nothing was.
static void test_damaged_clouds(void **state)
{
    (void)state;
    enum { SECTION = 1 << 16, TRIES = 150 };
    char path[] = "/tmp/patina-task-XXXXXX";
    const int descriptor = mkstemp(path);
    assert_true(descriptor >= 0);
    close(descriptor); // Windows replaces no file that is open
    const patina_cloud_desc desc = describe(400000);
    patina_cloud *cloud = NULL;
    patina_task *task = NULL;
    assert_int_equal(patina_cloud_create(&desc, NULL, &cloud), PATINA_OK);
    assert_int_equal(patina_cloud_save(cloud, path), PATINA_OK);
    patina_cloud_destroy(cloud);
    assert_int_equal(patina_cloud_verify(path, NULL), PATINA_OK);
    FILE *file = fopen(path, "r+b");
    assert_non_null(file);
    assert_int_equal(fseeko(file, 0, SEEK_END), 0);
    const uint64_t size = (uint64_t)ftello(file);
    uint32_t random = 1;
    int found = 0, changed = 0;
    for (int i = 0; i < TRIES; i++) {
        random = random * 1664525u + 1013904223u;
        // not in the padding behind a section, which is zero and read by nobody
        const off_t at = (off_t)(SECTION + ((uint64_t)random << 8) % (size - SECTION));
        unsigned char old = 0, none[64] = {0}, around[64] = {0};
        assert_int_equal(fseeko(file, at, SEEK_SET), 0);
        const size_t got = fread(around, 1, sizeof around, file);
        if (!memcmp(around, none, got))
            continue;
        old = around[0];
        assert_int_equal(fseeko(file, at, SEEK_SET), 0);
        assert_int_equal(fputc(old ^ 1 << random % 8, file), old ^ 1 << random % 8);
        assert_int_equal(fflush(file), 0);
        changed++;
        assert_int_equal(patina_task_verify(path, NULL, &task), PATINA_OK);
        found += patina_task_wait(task) == PATINA_ERROR_FORMAT;
        patina_task_destroy(task);
        assert_int_equal(fseeko(file, at, SEEK_SET), 0);
        assert_int_equal(fputc(old, file), old);
        assert_int_equal(fflush(file), 0);
    }
    fclose(file);
    assert_true(changed > TRIES / 2);
    assert_int_equal(found, changed);
    assert_int_equal(patina_cloud_verify(path, NULL), PATINA_OK);
    patina_progress *progress = NULL;
    assert_int_equal(patina_progress_create(&progress), PATINA_OK);
    patina_progress_cancel(progress);
    assert_int_equal(patina_cloud_verify(path, progress), PATINA_ERROR_CANCELLED);
    patina_progress_destroy(progress);
    assert_int_equal(truncate(path, (off_t)(size - SECTION)), 0);
    assert_int_equal(patina_cloud_verify(path, NULL), PATINA_ERROR_FORMAT);
    unlink(path);
    assert_int_equal(patina_cloud_verify(path, NULL), PATINA_ERROR_FILE);
    assert_int_equal(patina_cloud_verify(NULL, NULL), PATINA_ERROR_ARGUMENT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_builds_and_renders),
        cmocka_unit_test(test_errors_come_through),
        cmocka_unit_test(test_cancel),
        cmocka_unit_test(test_destroy_waits),
        cmocka_unit_test(test_fingerprints),
        cmocka_unit_test(test_colors),
        cmocka_unit_test(test_files),
        cmocka_unit_test(test_analyses_files),
        cmocka_unit_test(test_adds_to_builds),
        cmocka_unit_test(test_damaged_clouds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
