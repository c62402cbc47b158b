// SPDX-License-Identifier: GPL-3.0-or-later
// Clouds that are built on the disk, piece by piece, beside those built in memory: the same bytes where there is one level and all fits; else
// the same points in the picture. What goes wrong leaves no file, and what a kill leaves does no harm.
#include "clouds.h"
#include "support.h"

#include "folder.h" // behind cmocka.h

#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>
#ifndef _WIN32
#include <sys/resource.h>
#include <sys/wait.h>
#endif

enum { FEW = 150000, MANY = 1300000, MIDDLE = 500000, LITTLE = 16 << 20, KILLS = 20, WIDTH = 240, HEIGHT = 180 };

#ifdef _WIN32
static char folder[] = "patina-builder-XXXXXX"; // where the test runs
#else
static char folder[] = "/tmp/patina-builder-XXXXXX";
#endif

static const char *at(const char *name)
{
    static char path[2][256];
    static int turn;
    turn = !turn;
    snprintf(path[turn], sizeof path[turn], "%s/%s", folder, name);
    return path[turn];
}

// ---- the clouds ----------------------------------------------------------------------------------------------------------

struct columns {
    struct points points;
    double *position;
    float *opacity, *radius, *scalar;
    uint8_t *classes;
    patina_cloud_desc desc;
};

// With all that a cloud has; `at` is added to every position.
static struct columns columns_of(uint64_t count, double offset)
{
    struct columns all = {.points = points_torus(count, 2.0, 0.7, POINTS_ALL, 7)};
    struct pcg random = pcg_seed(3);
    all.position = malloc((count + 1) * 3 * sizeof *all.position);
    all.opacity = malloc((count + 1) * sizeof *all.opacity);
    all.radius = malloc((count + 1) * sizeof *all.radius);
    all.scalar = malloc((count + 1) * sizeof *all.scalar);
    all.classes = malloc(count + 1);
    for (uint64_t i = 0; i < count; i++) {
        for (uint64_t k = 0; k < 3; k++)
            all.position[3 * i + k] = offset + (double)all.points.position[3 * i + k];
        all.opacity[i] = i % 97 ? 1.0f : (float)(i % 3) / 2.0f;
        all.radius[i] = (float)pcg_between(&random, 0.001, 0.004);
        all.scalar[i] = i % 1009 ? (float)pcg_between(&random, -5, 5) : NAN;
        all.classes[i] = (uint8_t)(pcg_u32(&random) % 7);
        if (i % 5003 == 17)
            all.position[3 * i + i % 3] = i % 2 ? (double)NAN : (double)INFINITY;
    }
    all.desc = points_desc(&all.points);
    all.desc.position = (patina_array){all.position, PATINA_FLOAT64, 3, 0};
    all.desc.opacity = (patina_array){all.opacity, PATINA_FLOAT32, 1, 0};
    all.desc.radius = (patina_array){all.radius, PATINA_FLOAT32, 1, 0};
    all.desc.scalar = (patina_array){all.scalar, PATINA_FLOAT32, 1, 0};
    all.desc.classes = (patina_array){all.classes, PATINA_UINT8, 1, 0};
    return all;
}

static void columns_free(struct columns *all)
{
    points_free(&all->points);
    free(all->position);
    free(all->opacity);
    free(all->radius);
    free(all->scalar);
    free(all->classes);
}

static void move_on(patina_array *array, uint64_t count)
{
    static const uint32_t sizes[] = {0, 4, 8, 1, 2, 4, 1, 2, 4};
    if (array->data)
        array->data = (const char *)array->data + count * array->components * sizes[array->type];
}

// Adds the points in pieces of so many.
static int add(patina_builder *builder, const patina_cloud_desc *desc, uint64_t piece)
{
    patina_cloud_desc part = *desc;
    int code = PATINA_OK;
    for (uint64_t done = 0; done < desc->count && !code; done += piece) {
        part.count = desc->count - done < piece ? desc->count - done : piece;
        code = patina_builder_add(builder, &part);
        move_on(&part.position, piece);
        move_on(&part.normal, piece);
        move_on(&part.color, piece);
        move_on(&part.opacity, piece);
        move_on(&part.radius, piece);
        move_on(&part.scalar, piece);
        move_on(&part.classes, piece);
    }
    return code;
}

static int build(const char *path, const patina_cloud_desc *desc, const patina_builder_desc *how, uint64_t piece)
{
    patina_builder *builder = NULL;
    int code = patina_builder_begin(path, how, &builder);
    if (!code)
        code = add(builder, desc, piece);
    if (!code)
        code = patina_builder_end(builder, NULL);
    patina_builder_destroy(builder);
    return code;
}

// ---- the same bytes ------------------------------------------------------------------------------------------------------

static void test_same_bytes(void **state)
{
    (void)state;
    static const uint64_t pieces[] = {FEW, 1000, 40001};
    const uint32_t drops[] = {0, 1, 2, 3, 4, 5, 6};
    for (uint32_t round = 0; round < sizeof drops / sizeof *drops; round++) {
        struct columns all = columns_of(FEW, round == 2 ? 5e6 : 0.0);
        patina_array *arrays[] = {
            NULL, &all.desc.normal, &all.desc.color, &all.desc.opacity, &all.desc.radius, &all.desc.scalar, &all.desc.classes};
        if (arrays[drops[round]])
            *arrays[drops[round]] = (patina_array){0};
        const patina_builder_desc how = {.struct_size = sizeof how, .memory = 1 << 28, .count = FEW};
        patina_cloud *cloud = NULL;
        CHECK(patina_cloud_create(&all.desc, NULL, &cloud), NULL);
        CHECK(patina_cloud_save(cloud, at("wanted")), cloud);
        patina_cloud_destroy(cloud);
        CHECK(build(at("built"), &all.desc, &how, pieces[round % 3]), NULL);
        CHECK(patina_cloud_verify(at("built"), NULL), NULL);
        assert_same_file(at("built"), at("wanted"));
        columns_free(&all);
    }
}

// Opening forgets nothing that a file says: the size in memory aside, the head of a cloud that is opened and saved again is the same.
static void test_opened_and_saved(void **state)
{
    (void)state;
    enum { BYTES_AT = 128, SUM_AT = 504 }; // in the head
    struct columns all = columns_of(FEW, 0.0);
    patina_cloud *cloud = NULL;
    size_t size, other_size;
    CHECK(build(at("built"), &all.desc, NULL, FEW), NULL);
    CHECK(patina_cloud_open(at("built"), &cloud), NULL);
    CHECK(patina_cloud_save(cloud, at("again")), cloud);
    patina_cloud_destroy(cloud);
    char *data = bytes_of(at("built"), &size), *again = bytes_of(at("again"), &other_size);
    assert_int_equal(size, other_size);
    for (size_t i = 0; i < size; i++)
        if (data[i] != again[i] && i / 8 != BYTES_AT / 8 && i / 8 != SUM_AT / 8)
            support_die("byte %zu of %zu differs", i, size);
    free(data);
    free(again);
    columns_free(&all);
}

static void test_narrow_colors(void **state)
{
    (void)state;
    static const uint32_t factors[] = {1, 256, 257}; // of the bytes, as files have them
    struct columns all = columns_of(FEW, 0.0);
    uint16_t *wide = malloc(FEW * 3 * sizeof *wide);
    const patina_builder_desc how = {.struct_size = sizeof how, .memory = 1 << 28, .narrow_colors = 1};
    CHECK(build(at("wanted"), &all.desc, &how, FEW), NULL);
    for (int i = 0; i < 3; i++) {
        for (uint32_t k = 0; k < 3 * FEW; k++)
            wide[k] = (uint16_t)(all.points.color[k] * factors[i]);
        patina_cloud_desc desc = all.desc;
        desc.color = (patina_array){wide, PATINA_UINT16, 3, 0};
        CHECK(build(at("built"), &desc, &how, 30000), NULL);
        assert_same_file(at("built"), at("wanted"));
    }
    free(wide);
    columns_free(&all);
}

// What is zero everywhere is as if it were not there; one value that is not, in the last piece, and it stays.
static void test_dropped_zeros(void **state)
{
    (void)state;
    struct columns all = columns_of(FEW, 0.0);
    const patina_builder_desc how = {.struct_size = sizeof how, .memory = 1 << 28, .narrow_colors = 1};
    float *normal = calloc(FEW * 3, sizeof *normal), *scalar = calloc(FEW, sizeof *scalar);
    uint16_t *color = calloc(FEW * 3, sizeof *color);
    uint8_t *classes = calloc(FEW, 1);
    patina_cloud_desc zeros = all.desc, none = all.desc;
    zeros.normal.data = normal;
    zeros.color = (patina_array){color, PATINA_UINT16, 3, 0};
    zeros.scalar.data = scalar;
    zeros.classes.data = classes;
    none.normal = none.color = none.scalar = none.classes = (patina_array){0};
    CHECK(build(at("wanted"), &none, &how, FEW), NULL);
    CHECK(build(at("built"), &zeros, &how, 30000), NULL);
    assert_same_file(at("built"), at("wanted"));
    color[3 * (FEW - 1) + 1] = 77;
    classes[FEW - 1] = 2;
    none.color = zeros.color;
    none.classes = zeros.classes;
    CHECK(build(at("wanted"), &none, &how, FEW), NULL);
    CHECK(build(at("built"), &zeros, &how, 30000), NULL);
    assert_same_file(at("built"), at("wanted"));
    patina_cloud *cloud = NULL;
    patina_cloud_info info = {.struct_size = sizeof info};
    CHECK(patina_cloud_open(at("built"), &cloud), NULL);
    CHECK(patina_cloud_get_info(cloud, &info), cloud);
    assert_true(info.has_colors && info.has_classes && !info.has_normals && !info.has_scalars);
    patina_cloud_destroy(cloud);
    free(normal);
    free(scalar);
    free(color);
    free(classes);
    columns_free(&all);
}

// ---- the same picture ----------------------------------------------------------------------------------------------------

static struct picture render(const patina_cloud *cloud, double offset)
{
    patina_device *device = support_device_first();
    const double eye[3] = {offset + 4, offset - 3, offset + 3}, target[3] = {offset, offset, offset};
    const patina_camera camera = camera_perspective(eye, target, 45, WIDTH, HEIGHT, 0.1, 100);
    patina_settings settings = settings_default(WIDTH, HEIGHT);
    settings.fill = PATINA_FILL_OFF;
    patina_scene *scene = scene_of(cloud, NULL);
    struct picture picture = picture_render(device, scene, &camera, &settings);
    patina_scene_destroy(scene);
    patina_device_destroy(device);
    return picture;
}

// Chunks have other origins, so that depths differ by roundings; points so near each other may trade places.
static void assert_same_points(const struct picture *a, const struct picture *b, double within)
{
    uint32_t others = 0, shown = 0;
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
        const uint64_t one = a->keys[i], two = b->keys[i];
        shown += one != KEY_EMPTY;
        if (one == KEY_EMPTY && two == KEY_EMPTY)
            continue;
        const double z = (double)key_z(one), other = (double)key_z(two);
        others += key_id(one) != key_id(two) || !(fabs(z - other) <= within);
    }
    print_message("%u of %u pixels show another point\n", others, shown);
    assert_true(shown > WIDTH * HEIGHT / 5);
    assert_true(others * 500 <= shown); // points within a rounding of a pixel's border
}

static void assert_same_cloud(const char *path, const struct columns *all, double offset, double within)
{
    patina_cloud *cloud = NULL, *built = NULL;
    patina_cloud_info info = {.struct_size = sizeof info}, other = {.struct_size = sizeof other};
    CHECK(patina_cloud_create(&all->desc, NULL, &cloud), NULL);
    CHECK(patina_cloud_verify(path, NULL), NULL);
    CHECK(patina_cloud_open(path, &built), NULL);
    CHECK(patina_cloud_get_info(cloud, &info), cloud);
    CHECK(patina_cloud_get_info(built, &other), built);
    assert_int_equal(info.count, other.count);
    assert_int_equal(info.drawn, other.drawn);
    assert_int_equal(info.invalid_positions, other.invalid_positions);
    assert_int_equal(info.invalid_normals, other.invalid_normals);
    assert_memory_equal(info.box_min, other.box_min, sizeof info.box_min);
    assert_memory_equal(info.box_max, other.box_max, sizeof info.box_max);
    assert_memory_equal(info.scalar_range, other.scalar_range, sizeof info.scalar_range);
    assert_memory_equal(info.class_bits, other.class_bits, sizeof info.class_bits);
    print_message("spacing %g, built on the disk %g; %llu and %llu chunks\n", info.spacing, other.spacing,
                  (unsigned long long)info.chunks, (unsigned long long)other.chunks);
    assert_true(fabs(info.spacing - other.spacing) < 0.1 * info.spacing);
    struct picture wanted = render(cloud, offset), picture = render(built, offset);
    assert_same_points(&picture, &wanted, within);
    picture_free(&wanted);
    picture_free(&picture);
    patina_cloud_destroy(cloud);
    patina_cloud_destroy(built);
}

static void test_spilled(void **state)
{
    (void)state;
    const patina_builder_desc how = {.struct_size = sizeof how, .memory = LITTLE}; // ten parts and more
    for (int round = 0; round < 2; round++) {
        struct columns all = columns_of(round ? MANY : MIDDLE, 0.0);
        CHECK(build(at("built"), &all.desc, &how, 70000), NULL);
        assert_same_cloud(at("built"), &all, 0.0, 4e-6);
        columns_free(&all);
    }
    struct columns all = columns_of(MIDDLE, 5e6);
    CHECK(build(at("built"), &all.desc, &how, 70000), NULL);
    assert_same_cloud(at("built"), &all, 5e6, 4e-6);
    columns_free(&all);
}

// What the caller said of the box was wrong: it costs time alone.
static void test_wrong_box(void **state)
{
    (void)state;
    struct columns all = columns_of(MIDDLE, 0.0);
    const patina_builder_desc how = {
        .struct_size = sizeof how, .memory = LITTLE, .count = MIDDLE, .box_min = {100, 100, 100}, .box_max = {101, 101, 102}};
    CHECK(build(at("built"), &all.desc, &how, 100000), NULL);
    assert_same_cloud(at("built"), &all, 0.0, 4e-6);
    columns_free(&all);
}

// ---- hard cases ----------------------------------------------------------------------------------------------------------

static uint64_t drawn_of(const char *path)
{
    patina_cloud *cloud = NULL;
    patina_cloud_info info = {.struct_size = sizeof info};
    CHECK(patina_cloud_verify(path, NULL), NULL);
    CHECK(patina_cloud_open(path, &cloud), NULL);
    CHECK(patina_cloud_get_info(cloud, &info), cloud);
    patina_cloud_destroy(cloud);
    return info.drawn;
}

static void test_hard(void **state)
{
    (void)state;
    const patina_builder_desc how = {.struct_size = sizeof how, .memory = LITTLE};
    struct columns all = columns_of(MIDDLE, 0.0);
    patina_cloud_desc desc = all.desc;
    desc.opacity = (patina_array){0};
    for (desc.count = 0; desc.count < 3; desc.count++) {
        CHECK(build(at("built"), &desc, &how, 1), NULL);
        assert_int_equal(drawn_of(at("built")), desc.count);
    }
    desc.count = MIDDLE;
    for (uint32_t i = 0; i < 3 * MIDDLE; i++)
        all.position[i] = 7.25; // all at one place
    CHECK(build(at("built"), &desc, &how, MIDDLE), NULL);
    assert_int_equal(drawn_of(at("built")), MIDDLE);
    for (uint32_t i = 0; i < 3 * MIDDLE; i++)
        all.position[i] = (double)(i / 3 % 2) * 1e-300; // two, that hardly differ
    CHECK(build(at("built"), &desc, &how, MIDDLE), NULL);
    assert_int_equal(drawn_of(at("built")), MIDDLE);
    all.position[0] = 1e300; // and one beyond all others
    CHECK(build(at("built"), &desc, &how, MIDDLE), NULL);
    for (uint32_t i = 0; i < 3 * MIDDLE; i++)
        all.position[i] = (double)NAN;
    CHECK(build(at("built"), &desc, &how, MIDDLE), NULL);
    assert_int_equal(drawn_of(at("built")), 0);
    columns_free(&all);
}

static void test_refused(void **state)
{
    (void)state;
    struct columns all = columns_of(FEW, 0.0);
    patina_builder_desc how = {.struct_size = sizeof how, .memory = LITTLE, .count = 2000000000};
    patina_builder *builder = NULL;
    const patina_cloud_desc none = {.struct_size = sizeof none};
    remove(at("built"));
    assert_int_equal(patina_builder_begin(at("no folder/built"), &how, &builder), PATINA_ERROR_FILE);
    assert_null(builder);
    how.count = 0;
    CHECK(patina_builder_begin(at("built"), &how, &builder), NULL); // pieces that are unlike
    CHECK(patina_builder_add(builder, &all.desc), builder);
    CHECK(patina_builder_add(builder, &none), builder);
    patina_cloud_desc bare = all.desc;
    bare.normal = (patina_array){0};
    assert_int_equal(patina_builder_add(builder, &bare), PATINA_ERROR_ARGUMENT);
    assert_non_null(strstr(support_message(builder), "normal"));
    patina_progress *progress = NULL; // cancelled
    CHECK(patina_progress_create(&progress), NULL);
    patina_progress_cancel(progress);
    assert_int_equal(patina_builder_end(builder, progress), PATINA_ERROR_CANCELLED);
    assert_int_not_equal(patina_builder_add(builder, &all.desc), PATINA_OK);
    patina_builder_destroy(builder);
    patina_progress_destroy(progress);
    assert_false(is_there(at("built")));
    columns_free(&all);
}

#ifndef _WIN32

// A disk that is full, as far as one process can have it: files may not grow beyond some size.
static void test_full_disk(void **state)
{
    (void)state;
    struct columns all = columns_of(FEW, 0.0);
    const patina_builder_desc how = {.struct_size = sizeof how, .memory = 1 << 28};
    remove(at("built"));
    const uint32_t files = files_in(folder);
    signal(SIGXFSZ, SIG_IGN);
    struct rlimit before, less;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    const rlim_t limits[] = {100000, 3000000, 9000000}; // while points come, while chunks are made, while the file is written
    for (int i = 0; i < 3; i++) {
        less = before;
        less.rlim_cur = limits[i];
        assert_int_equal(setrlimit(RLIMIT_FSIZE, &less), 0);
        const int code = build(at("built"), &all.desc, &how, 50000);
        assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
        assert_int_equal(code, PATINA_ERROR_FILE);
        assert_non_null(strstr(support_message(NULL), "cannot be written"));
        assert_false(is_there(at("built")));
        assert_int_equal(files_in(folder), files);
    }
    columns_free(&all);
}

// ---- kills ---------------------------------------------------------------------------------------------------------------

static void test_killed(void **state)
{
    (void)state;
    struct columns all = columns_of(MIDDLE, 0.0);
    const patina_builder_desc how = {.struct_size = sizeof how, .memory = LITTLE, .threads = 1};
    struct pcg random = pcg_seed((uint64_t)getpid());
    struct timespec begin, end;
    clock_gettime(CLOCK_MONOTONIC, &begin);
    CHECK(build(at("wanted"), &all.desc, &how, 70000), NULL);
    clock_gettime(CLOCK_MONOTONIC, &end);
    const double takes = (double)(end.tv_sec - begin.tv_sec) * 1e6 + (double)(end.tv_nsec - begin.tv_nsec) / 1e3;
    const uint32_t files = files_in(folder);
    uint32_t finished = 0;
    for (int i = 0; i < KILLS; i++) {
        remove(at("built")); // what the one before left beside stays
        const pid_t child = fork();
        if (!child)
            _exit(build(at("built"), &all.desc, &how, 70000));
        usleep((useconds_t)pcg_between(&random, 0, 1.1 * takes));
        kill(child, SIGKILL);
        waitpid(child, NULL, 0);
        if (is_there(at("built"))) { // it was faster
            assert_same_file(at("built"), at("wanted"));
            finished++;
        }
        assert_true(files_in(folder) <= files + 1 + (uint32_t)is_there(at("built")));
        if (i % 4 == 0) { // and anew: nothing of the killed one is left or does harm
            CHECK(build(at("built"), &all.desc, &how, 50000), NULL);
            assert_same_file(at("built"), at("wanted"));
            assert_int_equal(files_in(folder), files + 1);
        }
    }
    print_message("%u of %d were done before they were killed\n", finished, KILLS);
    columns_free(&all);
}

// Three processes build one file at a time: it is whole at any moment.
static void test_at_once(void **state)
{
    (void)state;
    struct columns all = columns_of(MIDDLE, 0.0);
    const patina_builder_desc how = {.struct_size = sizeof how, .memory = LITTLE, .threads = 1};
    pid_t children[3];
    CHECK(build(at("wanted"), &all.desc, &how, 70000), NULL);
    CHECK(build(at("built"), &all.desc, &how, 70000), NULL); // takes away what a killed one has left
    remove(at("built"));
    const uint32_t files = files_in(folder);
    for (int i = 0; i < 3; i++)
        if (!(children[i] = fork()))
            _exit(build(at("built"), &all.desc, &how, 70000));
    for (int i = 0; i < 3; i++) {
        int status = 1;
        waitpid(children[i], &status, 0);
        assert_int_equal(status, 0);
        assert_same_file(at("built"), at("wanted"));
    }
    assert_int_equal(files_in(folder), files + 1);
    columns_free(&all);
}

#endif

static int make_folder(void **state)
{
    (void)state;
    return make_folder_of(folder);
}

static int remove_folder(void **state)
{
    (void)state;
    remove(at("built"));
    remove(at("wanted"));
    remove(at("again"));
    return rmdir(folder);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_same_bytes),    cmocka_unit_test(test_opened_and_saved), cmocka_unit_test(test_narrow_colors),
        cmocka_unit_test(test_dropped_zeros), cmocka_unit_test(test_spilled),          cmocka_unit_test(test_wrong_box),
        cmocka_unit_test(test_hard),          cmocka_unit_test(test_refused),
#ifndef _WIN32
        cmocka_unit_test(test_full_disk),     cmocka_unit_test(test_killed),           cmocka_unit_test(test_at_once),
#endif
    };
#ifdef _WIN32
    puts("skipped: a full disk, kills and three at once: they fork, kill, and limit what a process may write, as POSIX has it");
    puts("0 passed, 0 failed, 3 skipped");
#endif
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
