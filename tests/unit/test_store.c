// SPDX-License-Identifier: GPL-3.0-or-later
// Analyses whose arrays lie on the disk, held so little of that everything is given back many times over: the bytes of those in memory,
// whatever the points are. Files of saved clouds likewise; what is cancelled, killed or has no room on the disk leaves no file.
#include "base/platform.h"
#include "scene/analysis/analysis.h"
#include "scene/clouds/page_sums.h"
#include "scenes/clouds.h"
#include "scenes/support.h"

#include "folder.h" // behind cmocka.h

#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#ifndef _WIN32
#include <sys/resource.h>
#include <sys/wait.h>
#endif

enum {
    LITTLE = 16 << 20, // the least that an analysis of a file takes
    MANY = 302000,     // points, which are just too much for that
    SOME = 30000,
    FEW = 4, // neighbours, where it is no matter what is found
    KILLS = 8,
    TIMES = 10
};

#ifdef _WIN32
static char folder[] = "patina-store-XXXXXX";
#else
static char folder[] = "/tmp/patina-store-XXXXXX";
#endif

static const char *at(const char *name)
{
    static char path[3][256];
    static int turn;
    turn = (turn + 1) % 3;
    snprintf(path[turn], sizeof path[turn], "%s/%s", folder, name);
    return path[turn];
}

// ---- points ----------------------------------------------------------------------------------------------------------------

struct scan { // float64 places, and what an analysis may be told of each point
    double *p;
    float *normal;
    uint8_t *station;
    uint16_t *row, *column;
    uint64_t count;
};

static struct scan scan_of(uint64_t room)
{
    struct scan scan = {malloc(3 * room * sizeof *scan.p), calloc(3 * room, sizeof *scan.normal), calloc(room, 1),
                        calloc(room, sizeof *scan.row),    calloc(room, sizeof *scan.column),     0};
    assert_non_null(scan.p);
    return scan;
}

static void scan_free(struct scan *scan)
{
    free(scan->p);
    free(scan->normal);
    free(scan->station);
    free(scan->row);
    free(scan->column);
}

static void add(struct scan *scan, double x, double y, double z)
{
    double *p = scan->p + 3 * scan->count++;
    p[0] = x;
    p[1] = y;
    p[2] = z;
}

// A sphere with ornaments, noise, and half of its normals.
static struct scan statue(uint64_t count)
{
    struct scan scan = scan_of(count);
    struct pcg random = pcg_seed(1);
    while (scan.count < count) {
        double v[3], square = 0.0;
        for (int k = 0; k < 3; k++) {
            v[k] = pcg_between(&random, -1, 1);
            square += v[k] * v[k];
        }
        if (square > 1.0 || square < 1e-4)
            continue;
        const double size = (1.0 + 0.05 * sin(9.0 * v[0]) * sin(11.0 * v[1]) + pcg_between(&random, -1e-3, 1e-3)) /
                            sqrt(square);
        for (int k = 0; k < 3 && scan.count % 2; k++)
            scan.normal[3 * scan.count + (uint64_t)k] = (float)v[k];
        add(&scan, v[0] * size, v[1] * size, v[2] * size);
    }
    return scan;
}

// A wall with bars before it, far from the origin, and strays up to a thousand times as far away; one lonely point farther still.
static struct scan facade(uint64_t count)
{
    struct scan scan = scan_of(count);
    struct pcg random = pcg_seed(2);
    for (uint64_t i = 0; i + 1 < count; i++) {
        const double x = pcg_between(&random, 0, 20), z = pcg_between(&random, 0, 8);
        if (i % 997 == 5)
            add(&scan, 5e5 + pcg_between(&random, -2e4, 2e4), pcg_between(&random, -2e4, 2e4), pcg_between(&random, -2e4, 2e4));
        else if (i % 5 == 2)
            add(&scan, 5e5 + floor(x / 0.12) * 0.12 + pcg_between(&random, 0, 0.02), -0.3, 0.1 * z);
        else
            add(&scan, 5e5 + x, x > 8 && x < 9 && z < 3 ? 0.4 : 0.0, z);
    }
    add(&scan, 5e7, 0, 0);
    return scan;
}

static struct scan plane(uint64_t count)
{
    struct scan scan = scan_of(count);
    struct pcg random = pcg_seed(3);
    for (uint64_t i = 0; i < count; i++)
        add(&scan, pcg_unit(&random), pcg_unit(&random), 0);
    return scan;
}

// Every distance is one of many equal ones: neighbours go by their numbers.
static struct scan lattice(uint64_t count)
{
    struct scan scan = scan_of(count);
    const uint64_t side = (uint64_t)floor(cbrt((double)count));
    for (uint64_t i = 0; i < side * side * side; i++) {
        const uint64_t j = i * 7919 % (side * side * side); // in no order of places
        add(&scan, (double)(j % side), (double)(j / side % side), (double)(j / side / side));
    }
    return scan;
}

// More at one place than neighbours are asked for, here and there on a plane.
static struct scan duplicates(uint64_t count)
{
    struct scan scan = scan_of(count);
    struct pcg random = pcg_seed(4);
    double p[3] = {0};
    for (uint64_t i = 0; i < count; i++) {
        if (i % 1000 > 200 || i % 1000 == 0)
            for (int k = 0; k < 2; k++)
                p[k] = pcg_unit(&random);
        add(&scan, p[0], p[1], p[2]);
    }
    return scan;
}

// Two stations' grids over a room with a column in its middle.
static const double stations[6] = {-2, -1, 1.5, 2, 1, 1.5};
static struct scan room(uint64_t count)
{
    struct scan scan = scan_of(count);
    const uint64_t columns = (uint64_t)sqrt((double)count), rows = count / 2 / columns;
    for (uint64_t i = 0; i < 2 * rows * columns; i++) {
        const uint64_t s = i / (rows * columns), row = i / columns % rows, column = i % columns;
        const double *o = stations + 3 * s, turn = 6.28318 * ((double)column + 0.5) / (double)columns,
                     up = 2.4 * ((double)row + 0.5) / (double)rows - 1.2;
        const double v[3] = {cos(up) * cos(turn), cos(up) * sin(turn), sin(up)};
        double range = 1e9;
        for (int k = 0; k < 3; k++) {
            const double low = k == 2 ? 0.0 : -5.0, high = k == 2 ? 3.0 : 5.0;
            range = fmin(range, v[k] > 0 ? (high - o[k]) / v[k] : v[k] < 0 ? (low - o[k]) / v[k] : 1e9);
        }
        const double a = v[0] * v[0] + v[1] * v[1], b = o[0] * v[0] + o[1] * v[1], c = o[0] * o[0] + o[1] * o[1] - 0.25;
        if (b * b > a * c && b < 0)
            range = fmin(range, (-b - sqrt(b * b - a * c)) / a);
        if (i % 3001 == 7)
            range *= 0.5; // what somebody saw who walked by
        scan.station[scan.count] = (uint8_t)s;
        scan.row[scan.count] = (uint16_t)row;
        scan.column[scan.count] = (uint16_t)column;
        add(&scan, o[0] + range * v[0], o[1] + range * v[1], o[2] + range * v[2]);
    }
    return scan;
}

static struct scan (*const makers[])(uint64_t count) = {statue, facade, plane, lattice, duplicates, room};
static const char *const names[] = {"statue", "facade", "plane", "lattice", "duplicates", "room"};
enum { STATUE, FACADE, PLANE, LATTICE, DUPLICATES, ROOM, SCANS };

static patina_cloud *cloud_of(const struct scan *scan, int with_normals)
{
    patina_cloud_desc desc = {.struct_size = sizeof desc, .count = scan->count, .position = {scan->p, PATINA_FLOAT64, 3, 0}};
    patina_cloud *cloud = NULL;
    if (with_normals)
        desc.normal = (patina_array){scan->normal, PATINA_FLOAT32, 3, 0};
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    return cloud;
}

static patina_analysis_desc told(const struct scan *scan, int which, uint32_t threads)
{
    patina_analysis_desc desc = {.struct_size = sizeof desc, .threads = threads};
    if (which == ROOM) {
        desc.station_count = 2;
        desc.stations = stations;
        desc.station = (patina_array){scan->station, PATINA_UINT8, 1, 0};
        desc.row = (patina_array){scan->row, PATINA_UINT16, 1, 0};
        desc.column = (patina_array){scan->column, PATINA_UINT16, 1, 0};
        desc.free_space = desc.grid = 1;
    }
    return desc;
}

// ---- in memory -------------------------------------------------------------------------------------------------------------

static void assert_same_analysis(const patina_cloud *cloud, const struct pt_analysis *a, const struct pt_analysis *b)
{
    assert_memory_equal(a->surfels, b->surfels, cloud->slots * 4);
    assert_memory_equal(a->shapes, b->shapes, cloud->slots * 4);
    assert_memory_equal(a->chunks, b->chunks, cloud->chunk_count * sizeof *a->chunks);
    assert_memory_equal(a->kinds, b->kinds, sizeof a->kinds);
    assert_int_equal(a->estimated, b->estimated);
    assert_int_equal(a->oriented, b->oriented);
    assert_int_equal(a->seen_through, b->seen_through);
    assert_int_equal(a->sights.bytes, b->sights.bytes);
    if (a->sights.bytes)
        assert_memory_equal(a->sights.words, b->sights.words, a->sights.bytes);
}

static void test_same(void **state)
{
    (void)state;
    for (int which = 0; which < SCANS; which++)
        for (uint32_t threads = which == STATUE ? 1 : 3; threads <= 3; threads += 2) {
            struct scan scan = makers[which](SOME);
            patina_cloud *cloud = cloud_of(&scan, which == STATUE);
            patina_cloud *mapped = NULL;
            CHECK(patina_cloud_save(cloud, at("one")), cloud);
            CHECK(patina_cloud_open(at("one"), &mapped), NULL);
            const patina_analysis_desc desc = told(&scan, which, threads);
            struct pt_analysis wanted, found;
            struct pt_store store;
            CHECK(pt_analysis_compute(cloud, &desc, NULL, NULL, &wanted), NULL);
            pt_store_open(&store, at("one"), mapped, 1600000); // of 1.8 million; a megabyte is the program's own
            CHECK(pt_analysis_compute(mapped, &desc, &store, NULL, &found), NULL);
            print_message("%s, %u threads: %u points, all given back %u times\n", names[which], threads, (unsigned)scan.count,
                          atomic_load(&store.returned));
            assert_same_analysis(cloud, &wanted, &found);
#ifdef __linux__
            assert_true(atomic_load(&store.returned) >= TIMES);
#endif
            assert_int_equal(store.count, 2); // the words
            pt_analysis_free(&wanted);
            pt_analysis_free(&found);
            assert_int_equal(store.count, 0);
            pt_store_close(&store);
            patina_cloud_destroy(mapped);
            patina_cloud_destroy(cloud);
            scan_free(&scan);
        }
}

#ifdef __linux__
// What was read of a file before its analysis begins counts below the cap.
static void test_read_before(void **state)
{
    (void)state;
    struct scan scan = statue(MANY);
    patina_cloud *cloud = cloud_of(&scan, 1), *mapped = NULL;
    struct pt_store store;
    CHECK(patina_cloud_save(cloud, at("one")), cloud);
    patina_cloud_destroy(cloud);
    CHECK(patina_cloud_open(at("one"), &mapped), NULL);
    const uint64_t before = pt_file_memory(), size = pt_cloud_mapped_bytes(mapped);
    CHECK(pt_pages_refuse(mapped, UINT64_MAX, NULL), mapped);
    const uint64_t read = pt_file_memory();
    pt_store_open(&store, at("one"), mapped, LITTLE);
    print_message("of a file of %.1f MB %.1f MB are held when all was read, %.1f MB when its analysis begins\n",
                  1e-6 * (double)size, 1e-6 * ((double)read - (double)before), 1e-6 * ((double)store.before - (double)before));
    assert_true(read > before + size / 2);
    assert_true(store.before < before + size / 4);
    pt_store_close(&store);
    patina_cloud_destroy(mapped);
    scan_free(&scan);
}
#endif

// ---- files -----------------------------------------------------------------------------------------------------------------

static void save_plain(const struct scan *scan, int which)
{
    patina_cloud *cloud = cloud_of(scan, which == STATUE);
    CHECK(patina_cloud_save(cloud, at("plain")), cloud);
    patina_cloud_destroy(cloud);
}

// Of a file: whether its analysis keeps what it holds of points on the disk, where it may take so little.
static int is_too_much(const char *name)
{
    patina_cloud *cloud = NULL;
    CHECK(patina_cloud_open(at(name), &cloud), NULL);
    const uint64_t held = pt_cloud_mapped_bytes(cloud) + pt_analysis_memory(cloud);
    patina_cloud_destroy(cloud);
    return held > LITTLE;
}

// The scan as "plain", and as memory analyses it as "wanted".
static void save_both(const struct scan *scan, int which)
{
    const patina_analysis_desc desc = told(scan, which, 0);
    patina_cloud *cloud = NULL;
    save_plain(scan, which);
    CHECK(patina_cloud_open(at("plain"), &cloud), NULL);
    CHECK(patina_cloud_analyse(cloud, &desc, NULL), cloud);
    CHECK(patina_cloud_save(cloud, at("wanted")), cloud);
    patina_cloud_destroy(cloud);
}

static void test_files(void **state)
{
    (void)state;
    static const int scans[] = {STATUE, FACADE, ROOM};
    for (int i = 0; i < 3; i++) {
        const int which = scans[i];
        struct scan scan = makers[which](which == ROOM ? MANY : SOME);
        const patina_analysis_desc desc = told(&scan, which, 0);
        patina_progress *progress = NULL;
        save_both(&scan, which);
        assert_int_equal(is_too_much("plain"), which == ROOM);
        CHECK(patina_progress_create(&progress), NULL);
        CHECK(patina_cloud_analyse_file(at("plain"), &desc, LITTLE, at("found"), progress), NULL);
        assert_true(patina_progress_value(progress) == 1.0f);
        assert_same_file(at("found"), at("wanted"));
        CHECK(patina_cloud_verify(at("found"), NULL), NULL);
        if (which == FACADE) { // in its own place, all in memory
            CHECK(patina_cloud_analyse_file(at("plain"), &desc, 0, at("plain"), NULL), NULL);
            assert_same_file(at("plain"), at("wanted"));
        }
        patina_progress_destroy(progress);
        scan_free(&scan);
    }
}

static void test_refused(void **state)
{
    (void)state;
    struct scan scan = plane(SOME);
    patina_progress *progress = NULL;
    save_plain(&scan, PLANE);
    remove(at("found"));
    const patina_analysis_desc wrong = {.struct_size = sizeof wrong, .neighbours = 2};
    assert_int_equal(patina_cloud_analyse_file(at("plain"), &wrong, LITTLE, at("found"), NULL), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_cloud_analyse_file(at("none"), NULL, LITTLE, at("found"), NULL), PATINA_ERROR_FILE);
    assert_int_equal(patina_cloud_analyse_file(at("plain"), NULL, LITTLE, at("no folder/found"), NULL), PATINA_ERROR_FILE);
    assert_int_equal(patina_cloud_analyse_file(NULL, NULL, 0, at("found"), NULL), PATINA_ERROR_ARGUMENT);
    CHECK(patina_progress_create(&progress), NULL);
    patina_progress_cancel(progress);
    assert_int_equal(patina_cloud_analyse_file(at("plain"), NULL, LITTLE, at("found"), progress), PATINA_ERROR_CANCELLED);
    patina_progress_destroy(progress);
    assert_false(is_there(at("found")));
    scan_free(&scan);
}

#ifndef _WIN32

// Files may not grow beyond some size: while arrays are made, and while the file is written. Mapped pages that the disk has no room for
// would end the process; they are asked for before.
static void test_full_disk(void **state)
{
    (void)state;
    struct scan scan = plane(MANY);
    struct rlimit before, less;
    const patina_analysis_desc desc = {.struct_size = sizeof desc, .neighbours = FEW};
    save_plain(&scan, PLANE);
    assert_true(is_too_much("plain"));
    remove(at("found"));
    const uint32_t files = files_in(folder);
    signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    static const rlim_t limits[] = {100000, 3000000, 6000000};
    for (int i = 0; i < 3; i++) {
        less = before;
        less.rlim_cur = limits[i];
        assert_int_equal(setrlimit(RLIMIT_FSIZE, &less), 0);
        const int code = patina_cloud_analyse_file(at("plain"), &desc, LITTLE, at("found"), NULL);
        assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
        assert_int_equal(code, PATINA_ERROR_FILE);
        assert_false(is_there(at("found")));
        assert_int_equal(files_in(folder), files);
    }
    scan_free(&scan);
}

struct addition {
    struct pt_cloud_writer *writer;
    const patina_cloud *cloud;
};

static void add_positions(void *context)
{
    const struct addition *addition = context;
    pt_cloud_writer_add(addition->writer, PT_ARRAY_POSITIONS, addition->cloud->positions, addition->cloud->slots * 12);
}

// Which thread found the disk full is not who ends the file: what kept it from being written is told all the same.
static void test_full_for_another(void **state)
{
    (void)state;
    struct scan scan = plane(MANY);
    struct pt_thread thread;
    struct rlimit before, less;
    struct addition addition = {NULL, NULL};
    patina_cloud *cloud = NULL;
    save_plain(&scan, PLANE);
    CHECK(patina_cloud_open(at("plain"), &cloud), NULL);
    remove(at("found"));
    CHECK(pt_cloud_writer_begin(at("found"), cloud, &addition.writer), NULL);
    addition.cloud = cloud;
    signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    less = before;
    less.rlim_cur = 100000;
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &less), 0);
    assert_int_equal(pt_thread_start(&thread, add_positions, &addition, 0), 0);
    pt_thread_join(&thread);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
    errno = 0;
    assert_int_equal(pt_cloud_writer_end(addition.writer, cloud), PATINA_ERROR_FILE);
    assert_non_null(strstr(support_message(NULL), strerror(EFBIG)));
    assert_false(is_there(at("found")));
    patina_cloud_destroy(cloud);
    scan_free(&scan);
}

static void test_killed(void **state)
{
    (void)state;
    struct scan scan = plane(MANY);
    struct pcg random = pcg_seed((uint64_t)getpid());
    const patina_analysis_desc desc = {.struct_size = sizeof desc, .threads = 1, .neighbours = FEW};
    save_plain(&scan, PLANE);
    assert_true(is_too_much("plain"));
    const double begin = pt_milliseconds();
    CHECK(patina_cloud_analyse_file(at("plain"), &desc, LITTLE, at("wanted"), NULL), NULL);
    const double takes = 1e3 * (pt_milliseconds() - begin);
    remove(at("found"));
    const uint32_t files = files_in(folder);
    uint32_t finished = 0;
    for (int i = 0; i < KILLS; i++) {
        const pid_t child = fork();
        if (!child)
            _exit(patina_cloud_analyse_file(at("plain"), &desc, LITTLE, at("found"), NULL));
        usleep((useconds_t)pcg_between(&random, 0, 1.1 * takes));
        kill(child, SIGKILL);
        waitpid(child, NULL, 0);
        if (is_there(at("found"))) {
            assert_same_file(at("found"), at("wanted"));
            remove(at("found"));
            finished++;
        }
        assert_true(files_in(folder) <= files + 1); // the half file; what it kept of points went with it
    }
    CHECK(patina_cloud_analyse_file(at("plain"), &desc, LITTLE, at("found"), NULL), NULL); // and anew
    assert_same_file(at("found"), at("wanted"));
    assert_int_equal(files_in(folder), files + 1);
    print_message("%u of %d were done before they were killed\n", finished, KILLS);
    scan_free(&scan);
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
    remove(at("one"));
    remove(at("plain"));
    remove(at("wanted"));
    remove(at("found"));
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_same),        cmocka_unit_test(test_files),
        cmocka_unit_test(test_refused),
#ifdef __linux__
        cmocka_unit_test(test_read_before),
#endif
#ifndef _WIN32
        cmocka_unit_test(test_full_disk),   cmocka_unit_test(test_full_for_another),
        cmocka_unit_test(test_killed),
#endif
    };
#ifdef _WIN32
    puts("skipped: a full disk and kills: they fork, kill, and limit what a process may write, as POSIX has it");
    puts("0 passed, 0 failed, 2 skipped");
#endif
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
