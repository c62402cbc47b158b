// SPDX-License-Identifier: GPL-3.0-or-later
// Stanford's .conf through the public header: scans in files beside it, each in its place; what is wrong with one is told, the others
// are there.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "files.h"

#include <dirent.h>
#include <sys/stat.h>
#include <unistd.h>

static char folder[] = "/tmp/patina-conf-XXXXXX";

static char *path_of(const char *name)
{
    static char path[512];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static void put(const char *name, const char *text)
{
    FILE *file = fopen(path_of(name), "wb");
    assert_non_null(file);
    assert_true(fputs(text, file) >= 0 && fclose(file) == 0);
}

// 3 x 2 points, 0.1 apart, in a plane across z; colour: of all, "" for none.
static void put_grid(const char *name, double z, const char *color)
{
    char text[2048];
    int at = snprintf(text, sizeof text,
                      ASCII "obj_info num_cols 3\nobj_info num_rows 2\nelement vertex 6\n" XYZ "%s"
                            "element range_grid 6\nproperty list uchar int vertex_indices\nend_header\n",
                      *color ? "property uchar red\nproperty uchar green\nproperty uchar blue\n" : "");
    for (int i = 0; i < 6; i++)
        at += snprintf(text + at, sizeof text - (size_t)at, "%g %g %g %s\n", i % 3 * 0.1, i / 3 * 0.1, z, color);
    for (int i = 0; i < 6; i++)
        at += snprintf(text + at, sizeof text - (size_t)at, "1 %d\n", i);
    put(name, text);
}

static patina_file *open_conf(const char *text)
{
    patina_file *file = NULL;
    char message[512] = "";
    put("a.conf", text);
    empty_log();
    if (patina_file_open(path_of("a.conf"), NULL, &file)) {
        patina_message(NULL, message, sizeof message);
        fail_msg("%s", message);
    }
    return file;
}

static void refuse_conf(const char *text, const char *words)
{
    patina_file *file = NULL;
    char message[512] = "";
    put("a.conf", text);
    assert_int_equal(patina_file_open(path_of("a.conf"), NULL, &file), PATINA_ERROR_FORMAT);
    patina_message(NULL, message, sizeof message);
    if (!strstr(message, words) || !strstr(message, "a.conf"))
        fail_msg("'%s' is not in '%s'", words, message);
}

static void expect_place(const patina_file *file, uint64_t point, double x, double y, double z)
{
    float xyz[3 * 64];
    const double wanted[3] = {x, y, z};
    assert_int_equal(patina_file_read_positions(file, xyz, sizeof xyz), PATINA_OK);
    for (int k = 0; k < 3; k++)
        assert_true(fabs((double)xyz[3 * point + (uint64_t)k] + info_of(file).origin[k] - wanted[k]) < 1e-5);
}

static float attribute(const patina_file *file, const char *name, uint64_t point)
{
    float values[64];
    for (uint32_t i = 0; i < info_of(file).attributes; i++) {
        patina_file_attribute found = {.struct_size = sizeof found};
        assert_int_equal(patina_file_get_attribute(file, i, &found), PATINA_OK);
        if (!strcmp(found.name, name)) {
            assert_int_equal(patina_file_read_attribute(file, i, values, sizeof values), PATINA_OK);
            return values[point];
        }
    }
    fail_msg("there is no attribute %s", name);
    return 0;
}

// Positions, normals, directions and intervals turn with the conjugate of the quaternion; colours, rows, columns and scans go along.
static void test_places(void **state)
{
    (void)state;
    put_grid("one.ply", 2, "255 128 0");
    put_grid("two.ply", 2, "");
    patina_file *file = open_conf("camera 0 0 -1 0 0 0 1\r\nbmesh one.ply 0 0 0 0 0 0 1\r\n"
                                  "bmesh two.ply 10 20 30 0 0.70710678 0 0.70710678\r\n");
    patina_file_info info = info_of(file);
    float n[3 * 12];
    uint8_t rgba[4 * 12];
    assert_string_equal(info.format, "conf, 2 scans");
    assert_true(info.count == 12 && info.scans == 2 && info.has_normals && info.color_type == PATINA_UINT8 && !info.stations);
    expect_place(file, 2, 0.2, 0, 2);
    expect_place(file, 8, 10 - 2, 20, 30 + 0.2); // x becomes z, z becomes -x
    assert_int_equal(patina_file_read_normals(file, n, sizeof n), PATINA_OK);
    assert_true(fabsf(n[2] - 1) < 1e-5f && fabsf(n[3 * 6] + 1) < 1e-5f);
    assert_int_equal(patina_file_read_colors_u8(file, rgba, sizeof rgba), PATINA_OK);
    assert_true(rgba[0] == 255 && rgba[1] == 128 && rgba[4 * 6] == 0 && rgba[4 * 6 + 3] == 255);
    assert_true(attribute(file, "scan", 5) == 0 && attribute(file, "scan", 6) == 1);
    assert_true(attribute(file, "column", 8) == 2 && attribute(file, "row", 8) == 0 && attribute(file, "row", 11) == 1);
    patina_file_scan scan = {.struct_size = sizeof scan};
    assert_int_equal(patina_file_get_scan(file, 1, &scan), PATINA_OK);
    assert_string_equal(scan.name, "two.ply");
    assert_true(scan.first == 6 && scan.count == 6 && scan.columns == 3 && scan.rows == 2 && !scan.has_station);
    assert_true(fabs(scan.direction[0] - 1) < 1e-6 && fabs(scan.interval - 0.1) < 1e-6);
    assert_true(scan.pose[3] == 10 && scan.pose[7] == 20 && scan.pose[11] == 30 && fabs(scan.pose[2] + 1) < 1e-6);
    expect_log(NULL);
    patina_file_destroy(file);
}

// Each line's fault is told with its scan; the first scan is there.
static void test_bad_scans(void **state)
{
    (void)state;
    static const struct {
        const char *line, *words;
    } bad[] = {
        {"mesh all_cybcyl 0 0 0 0 0 0 1", "mesh all_cybcyl is left out: it is a model and no scan"},
        {"bmesh none.ply 0 0 0 0 0 0 1", "line 2: scan none.ply is left out: "},
        {"bmesh one.ply 0 0 0 0 0 0 0", "line 2: scan one.ply is left out: its quaternion 0 0 0 0"},
        {"bmesh one.ply 0 0 0 nan 0 0 1", "line 2: scan one.ply is left out: its quaternion"},
        {"bmesh one.ply 0 inf 0 0 0 0 1", "line 2: scan one.ply is left out: its quaternion"},
        {"bmesh one.ply 0 0 0 0 0 1", "line 2: scan one.ply is left out: a name and seven numbers were expected"},
        {"bmesh one.ply 0 0 0 0 0 x 1", "line 2: scan one.ply is left out: a name and seven numbers were expected"},
        {"bmesh one.ply 0 0 0 0 0 0 1 9", "line 2: scan one.ply is left out: a name and seven numbers were expected"},
        {"bmesh", "line 2: scan  is left out: a name and seven numbers were expected"},
        {"bmesh empty.ply 0 0 0 0 0 0 1", "line 2: scan empty.ply is left out: it has no points"},
        {"bmesh broken.ply 0 0 0 0 0 0 1", "line 2: scan broken.ply is left out: "},
        {"bmesh a.conf 0 0 0 0 0 0 1", "line 2: scan a.conf is left out: "},
    };
    put_grid("one.ply", 2, "");
    put("empty.ply", ASCII "element vertex 0\n" XYZ "end_header\n");
    put("broken.ply", ASCII "element vertex 9\n" XYZ "end_header\n1 2 3\n");
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        char text[256];
        snprintf(text, sizeof text, "bmesh one.ply 1 0 0 0 0 0 1\n%s\n", bad[i].line);
        patina_file *file = open_conf(text);
        assert_true(info_of(file).count == 6 && info_of(file).scans == 1);
        expect_place(file, 0, 1, 0, 2);
        expect_log(bad[i].words);
        patina_file_destroy(file);
    }
    refuse_conf("camera 0 0 0 0 0 0 1\n", "no line begins with 'bmesh'");
    refuse_conf("bmesh x.ply 0 0 0 0 0 0 1\nbmesh y.ply 0 0 0 0 0 0 1\n", "none of the 2 scans that it names can be read");
    patina_file *file = NULL;
    assert_int_equal(patina_file_open_memory("bmesh a 0 0 0 0 0 0 1\n", 22, &file), PATINA_ERROR_FORMAT);
}

// A scan whose grid lies keeps its points and says what is wrong, by its file's name; the scan beside it is as it was.
static void test_bad_grids(void **state)
{
    (void)state;
    static const struct {
        const char *columns, *cells, *words;
        int has_grid;
    } bad[] = {
        {"4", "1 0\n1 1\n0\n0\n1 2\n0\n", "bad.ply: the range_grid of 6 cells is left out: num_cols and num_rows say 4 x 2", 0},
        {"99999999999", "1 0\n1 1\n0\n0\n1 2\n0\n", "bad.ply: the range_grid of 6 cells is left out", 0},
        {"3", "1 0\n1 7\n0\n0\n1 2\n1 -1\n", "bad.ply: 2 cells of the range_grid name points that are not there, and 0 one", 1},
        {"3", "1 0\n1 0\n1 0\n0\n1 2\n0\n",
         "bad.ply: 0 cells of the range_grid name points that are not there, and 2 one that another cell has", 1},
    };
    put_grid("one.ply", 2, "");
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        char text[1024];
        snprintf(text, sizeof text,
                 ASCII
                 "obj_info num_cols %s\nobj_info num_rows 2\nelement vertex 3\n" XYZ
                 "element range_grid 6\nproperty list uchar int vertex_indices\nend_header\n0 0 1\n0.1 0 1\n0.2 0.1 1\n%s",
                 bad[i].columns, bad[i].cells);
        put("bad.ply", text);
        patina_file *file = open_conf("bmesh bad.ply 0 0 0 0 0 0 1\nbmesh one.ply 5 0 0 0 0 0 1\n");
        patina_file_scan scan = {.struct_size = sizeof scan};
        assert_true(info_of(file).count == 9 && info_of(file).scans == 2);
        expect_place(file, 2, 0.2, 0.1, 1);
        expect_place(file, 3, 5, 0, 2);
        assert_int_equal(patina_file_get_scan(file, 0, &scan), PATINA_OK);
        assert_true(scan.count == 3 && (scan.columns != 0) == bad[i].has_grid);
        assert_int_equal(patina_file_get_scan(file, 1, &scan), PATINA_OK);
        assert_true(scan.count == 6 && scan.columns == 3 && scan.rows == 2 && fabs(scan.interval - 0.1) < 1e-6);
        expect_log(bad[i].words);
        patina_file_destroy(file);
    }
}

// A quaternion that is not of length 1 turns all the same, and one point is a scan; both are told.
static void test_odd_scans(void **state)
{
    (void)state;
    put_grid("one.ply", 2, "");
    put("point.ply", ASCII "element vertex 1\n" XYZ "end_header\n1 2 3\n");
    patina_file *file = open_conf("bmesh one.ply 0 0 0 0 3 0 3\n");
    expect_place(file, 2, -2, 0, 0.2);
    expect_log("line 1: scan one.ply has a quaternion of length 4.24264");
    patina_file_destroy(file);
    file = open_conf("bmesh one.ply 0 0 0 0 0 0 1\nbmesh point.ply 0 0 9 0 0 0 1");
    patina_file_scan scan = {.struct_size = sizeof scan};
    assert_int_equal(patina_file_get_scan(file, 1, &scan), PATINA_OK);
    assert_true(scan.count == 1 && scan.interval == 0 && scan.direction[0] == 0 && scan.columns == 0);
    assert_true(attribute(file, "row", 6) == 65535);
    expect_place(file, 6, 1, 2, 12);
    expect_log("scan point.ply has one point");
    patina_file_destroy(file);
}

// A scan's file may hold scans itself; its stations move with it.
static void test_ptx_within(void **state)
{
    (void)state;
    put("two.ptx", "1\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n5 0 0 1\n1 2 3 0.5\n1 3 3 0.5\n");
    patina_file *file = open_conf("bmesh two.ptx 0 0 7 0 0 0 1\n");
    patina_file_scan scan = {.struct_size = sizeof scan};
    assert_int_equal(patina_file_get_scan(file, 0, &scan), PATINA_OK);
    assert_true(scan.has_station && scan.station[0] == 5 && scan.station[2] == 7 && info_of(file).stations == 1);
    expect_place(file, 0, 6, 2, 10);
    assert_true(attribute(file, "intensity", 1) == 0.5f);
    patina_file_destroy(file);
}

static void test_cancel(void **state)
{
    (void)state;
    patina_file *file = NULL;
    patina_progress *progress = NULL;
    put_grid("one.ply", 2, "");
    put("a.conf", "bmesh one.ply 0 0 0 0 0 0 1\nbmesh one.ply 0 0 0 0 0 0 1\n");
    assert_int_equal(patina_progress_create(&progress), PATINA_OK);
    assert_int_equal(patina_file_open(path_of("a.conf"), progress, &file), PATINA_OK);
    assert_true(patina_progress_value(progress) == 1.0f);
    patina_file_destroy(file);
    patina_progress_cancel(progress);
    file = NULL;
    assert_int_equal(patina_file_open(path_of("a.conf"), progress, &file), PATINA_ERROR_CANCELLED);
    assert_null(file);
    patina_progress_destroy(progress);
}

static int set_up(void **state)
{
    (void)state;
    return mkdtemp(folder) ? 0 : -1;
}

static int tear_down(void **state)
{
    (void)state;
    DIR *all = opendir(folder);
    for (struct dirent *entry; all && (entry = readdir(all));)
        if (entry->d_name[0] != '.')
            unlink(path_of(entry->d_name));
    if (all)
        closedir(all);
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_places),    cmocka_unit_test(test_bad_scans),  cmocka_unit_test(test_bad_grids),
        cmocka_unit_test(test_odd_scans), cmocka_unit_test(test_ptx_within), cmocka_unit_test(test_cancel),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
