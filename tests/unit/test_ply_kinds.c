// SPDX-License-Identifier: GPL-3.0-or-later
// What PLY files hold beside plain points: odd types, splats, bytes too many or too few, faces, grids of a scanner.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "files.h"

#include <stdlib.h>

// ---- types and colours ---------------------------------------------------------------------------------------------

static void test_bool(void **state)
{
    (void)state;
    patina_file *file = open_text(ASCII "element vertex 2\n" XYZ "property bool seen\nend_header\n1 2 3 1\n4 5 6 0\n");
    float seen[2];
    assert_int_equal(patina_file_read_attribute(file, 0, seen, sizeof seen), PATINA_OK);
    assert_true(seen[0] == 1 && seen[1] == 0);
    patina_file_destroy(file);
    struct blob b = blob(LITTLE "element vertex 1\nproperty bool a\nproperty char x\nproperty char y\nproperty char z\n"
                                "end_header\n",
                         "\1\2\3\4", 4);
    file = open_bytes(b.bytes, b.size);
    expect_positions(file, (float[]){2, 3, 4}, 3);
    patina_file_destroy(file);
}

// 0.5 + 0.28209479 f of each band, in bytes; colours of their own come before it.
static void test_splat_colors(void **state)
{
    (void)state;
#define BASE "property float f_dc_0\nproperty float f_dc_1\nproperty float f_dc_2\n"
    patina_file *file = open_text(ASCII "element vertex 2\n" XYZ BASE "property float opacity\nend_header\n"
                                        "1 2 3 0 1 -1 0.5\n4 5 6 -9 9 nan 0\n");
    assert_int_equal(info_of(file).color_type, PATINA_UINT8);
    assert_int_equal(info_of(file).attributes, 1); // opacity
    expect_bytes(file, (uint8_t[]){128, 199, 56, 255, 0, 255, 0, 255}, 8);
    patina_file_destroy(file);
    file = open_text(ASCII "element vertex 1\n" XYZ BASE "property uchar red\nproperty uchar green\nproperty uchar blue\n"
                           "end_header\n1 2 3 0 1 -1 7 8 9\n");
    expect_bytes(file, (uint8_t[]){7, 8, 9, 255}, 4);
    assert_int_equal(info_of(file).attributes, 3);
    patina_file_destroy(file);
}

// Three of four axes' lengths, turned: the disc lies across the least, as large as the Gaussian there is heavy.
static void test_splats(void **state)
{
    (void)state;
#define TURN "property float rot_0\nproperty float rot_1\nproperty float rot_2\nproperty float rot_3\n"
#define REST "property float f_rest_0\nproperty float f_rest_1\nproperty float opacity\n"
#define FLAT "property float scale_0\nproperty float scale_1\n"
    patina_file *file = open_text(ASCII "element vertex 4\n" XYZ
                                        "property float nx\nproperty float ny\nproperty float nz\n" BASE REST FLAT
                                        "property float scale_2\n" TURN "end_header\n"
                                        "0 0 0 0 0 0 0 1 -1 9 9 0 0 0.6931472 -5 1 0 0 0\n" // least along z, not turned
                                        "1 0 0 0 0 0 0 1 -1 9 9 2 -9 1 1 2 0 0 2\n"    // least along x, a quarter turn about z
                                        "2 0 0 0 0 0 0 1 -1 9 9 -800 0 -1 0 0 3 0 0\n" // least along y, half a turn about x
                                        "3 0 0 0 0 0 0 1 -1 9 9 nan 900 nan 900 0 0 0 0\n"); // not numbers
    patina_file_info info = info_of(file);
    assert_true(info.splats == 1 && info.has_normals && info.color_type == PATINA_UINT8 && info.attributes == 2);
    float normals[12], opacity[4], radius[4];
    patina_file_attribute names[2] = {{.struct_size = sizeof names[0]}, {.struct_size = sizeof names[1]}};
    for (uint32_t k = 0; k < 2; k++)
        assert_int_equal(patina_file_get_attribute(file, k, &names[k]), PATINA_OK);
    assert_string_equal(names[0].name, "opacity");
    assert_string_equal(names[1].name, "radius");
    patina_file_read_normals(file, normals, sizeof normals);
    patina_file_read_attribute(file, 0, opacity, sizeof opacity);
    patina_file_read_attribute(file, 1, radius, sizeof radius);
    const double wanted[4][5] = {
        {0, 0, 1, 0.5, 2}, {0, 1, 0, 0.8807970779778823, sqrt(2) * exp(1)}, {0, -1, 0, 0, sqrt(2)}, {0, 0, 0, 1, 0}};
    for (int i = 0; i < 4; i++) {
        for (int k = 0; k < 3; k++)
            assert_float_equal(normals[3 * i + k], wanted[i][k], 1e-6);
        assert_float_equal(opacity[i], wanted[i][3], 1e-6);
        assert_float_equal(radius[i], wanted[i][4], 1e-5);
    }
    expect_log("Gaussian splats, taken as discs");
    patina_cloud *cloud = NULL;
    assert_int_equal(patina_file_cloud(file, 1, NULL, &cloud), PATINA_OK);
    patina_cloud_info built = {.struct_size = sizeof built};
    patina_cloud_get_info(cloud, &built);
    assert_true(built.has_radii && built.has_opacities && built.has_normals && built.drawn == 3); // one is quite clear
    assert_float_equal(built.radius_most, sqrt(2) * exp(1), 1e-5);
    patina_cloud_destroy(cloud);
    patina_file_destroy(file);
    file = open_text(ASCII "element vertex 1\n" XYZ BASE "property float opacity\n" FLAT TURN "end_header\n"
                           "0 0 0 0 1 -1 0 0.6931472 0 0.5 0.5 0.5 0.5\n"); // flat: across the third axis, here x
    patina_file_read_normals(file, normals, 12);
    patina_file_read_attribute(file, 1, radius, 4);
    assert_true(normals[0] == 1 && normals[1] == 0 && normals[2] == 0);
    assert_float_equal(radius[0], 2, 1e-6);
    patina_file_destroy(file);
    file = open_text(ASCII "element vertex 1\n" XYZ BASE "property float opacity\n" FLAT "end_header\n0 0 0 0 1 -1 0 0.7 0\n");
    assert_true(!info_of(file).splats && info_of(file).attributes == 3); // without a turn they stay numbers
    patina_file_destroy(file);
    refuse(ASCII "element chunk 1\nproperty float min_x\nelement vertex 1\nproperty uint packed_position\nend_header\n0\n0\n",
           "packed as SuperSplat does");
}

// ---- bytes too many, too few, or other ones -------------------------------------------------------------------------

// What a copy as text makes of bytes. unix2dos leaves carriage returns with their line feeds alone.
static struct blob as_text(const struct blob *b, int leaves_pairs)
{
    struct blob out = {.size = 0};
    for (size_t i = 0; i < b->size; i++) {
        if (b->bytes[i] == '\n' && !(leaves_pairs && i && b->bytes[i - 1] == '\r'))
            out.bytes[out.size++] = '\r';
        out.bytes[out.size++] = b->bytes[i];
    }
    return out;
}

static void test_copied_as_text(void **state)
{
    (void)state;
    const char *faces = "element face 2\nproperty list uchar uchar vertex_indices\n";
    uint8_t body[44] = {1, 10, 0, 13, 10, 7, 10, 10};
    char header[256];
    for (int kind = 0; kind < 4; kind++) { // a face of 10 corners has a line feed for its count
        snprintf(header, sizeof header, LITTLE "element vertex 2\n" XYZ "%send_header\n", kind & 1 ? faces : "");
        body[24] = 10;
        body[35] = 2;
        struct blob b = blob(header, body, kind & 1 ? 38 : 24), mangled = as_text(&b, kind & 2);
        patina_file_destroy(open_bytes(b.bytes, b.size));
        refuse_bytes(mangled.bytes, mangled.size, PATINA_ERROR_FORMAT, "damaged by being copied as text: each of the");
    }
    snprintf(header, sizeof header,
             "ply\r\nformat binary_little_endian 1.0\r\nelement vertex 2\r\nproperty float x\r\n"
             "property float y\r\nproperty float z\r\nend_header\r\n");
    uint8_t honest[26] = {1, 13, 10, 0, 13, 10};
    struct blob b = blob(header, honest, 24);
    patina_file_destroy(open_bytes(b.bytes, b.size)); // its rows end where it does
    honest[24] = 13, honest[25] = 10;
    b = blob(header, (uint8_t[24]){1}, 24);
    memcpy(b.bytes + b.size, honest + 24, 2); // an editor's last line end
    patina_file_destroy(open_bytes(b.bytes, b.size + 2));
}

static void test_too_many_bytes(void **state)
{
    (void)state;
    uint8_t body[24] = {0};
    struct blob b = blob(LITTLE "element vertex 1\n" XYZ "end_header\n", body, 24);
    empty_log();
    patina_file_destroy(open_bytes(b.bytes, b.size - 12));
    expect_log(NULL);
    patina_file_destroy(open_bytes(b.bytes, b.size));
    char words[96];
    snprintf(words, sizeof words, "1 (memory): 12 bytes follow behind byte %zu, where the header's rows end", b.size - 12);
    expect_log(words);
}

// The points are whole: they open, and the log says what is not.
static void test_faces_cut_short(void **state)
{
    (void)state;
    static const uint8_t body[] = {1, 2, 3, 4, 5, 6, 2, 0, 1, 3, 0, 1};
    struct blob b = blob(LITTLE "element vertex 2\nproperty char x\nproperty char y\nproperty char z\n"
                                "element face 2\nproperty list uchar uchar vertex_indices\nend_header\n",
                         body, sizeof body);
    char words[96];
    empty_log();
    patina_file *file = open_bytes(b.bytes, b.size);
    snprintf(words, sizeof words, "1 (memory): the file ends at byte %zu, inside row 1 of the 2 of element face", b.size);
    expect_log(words);
    expect_positions(file, (float[]){1, 2, 3, 4, 5, 6}, 6);
    patina_file_destroy(file);
}

// ---- faces ---------------------------------------------------------------------------------------------------------

static void expect_normals(const patina_file *file, const float *wanted, size_t values)
{
    float got[64];
    assert_int_equal(info_of(file).has_normals, 1);
    assert_int_equal(patina_file_read_normals(file, got, sizeof got), PATINA_OK);
    for (size_t i = 0; i < values; i++)
        if (fabs((double)got[i] - (double)wanted[i]) > 1e-6)
            fail_msg("value %zu is %.9g, wanted %.9g", i, (double)got[i], (double)wanted[i]);
}

#define CUBE "0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n"
#define CUBE_HEAD(faces) "element vertex 8\n" XYZ "element face " faces "\nproperty list uchar int vertex_indices\nend_header\n"

// A cube's corners point away from its middle, whichever way its squares were cut, and whether faces stand first or not.
static void test_normals_of_faces(void **state)
{
    (void)state;
    static const char *const files[] = {
        ASCII CUBE_HEAD("6") CUBE "4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n",
        ASCII CUBE_HEAD("12") CUBE "3 0 3 2\n3 0 2 1\n3 4 5 6\n3 4 6 7\n3 0 1 5\n3 0 5 4\n3 1 2 6\n3 1 6 5\n3 2 3 7\n3 2 7 6\n"
                                   "3 3 0 4\n3 3 4 7\n",
        ASCII "element face 6\nproperty list uchar int vertex_index\nelement vertex 8\n" XYZ
              "end_header\n4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n" CUBE,
    };
    const float r = sqrtf(1.0f / 3);
    const float wanted[24] = {-r, -r, -r, r, -r, -r, r, r, -r, -r, r, -r, -r, -r, r, r, -r, r, r, r, r, -r, r, r};
    for (int i = 0; i < 3; i++) {
        patina_file *file = open_text(files[i]);
        expect_normals(file, wanted, 24);
        patina_file_destroy(file);
    }
}

static void test_faces_of_any_size(void **state)
{
    (void)state;
    static const uint8_t body[] = {0, 0, 0, 4, 0, 0, 4, 4, 0, 1, 1, 0, 0, 4, 0, 9, 9, 9, // the fourth lies inwards
                                   0, 0, 0, 0, 0, 0, 0, 2, 0, 1, 0, 0, 0, 1, 5, 0, 0, 0, 5, 0, 1, 2, 3, 4};
    struct blob b = blob(BIG "element vertex 6\nproperty uchar x\nproperty uchar y\nproperty uchar z\n"
                             "element face 4\nproperty list uint uchar vertex_indices\nend_header\n",
                         body, sizeof body);
    empty_log();
    patina_file *file = open_bytes(b.bytes, b.size);
    expect_normals(file, (float[]){0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 0}, 18);
    patina_file_destroy(file);

    // a strip, and another behind -1: all of it faces upwards
    file = open_text(ASCII "element vertex 5\n" XYZ "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
                           "0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 2 0\n8 0 1 2 3 -1 3 1 4\n");
    float n[15];
    assert_int_equal(patina_file_read_normals(file, n, sizeof n), PATINA_OK);
    for (int i = 0; i < 5; i++)
        assert_true(n[3 * i + 2] == 1);
    patina_file_destroy(file);

    enum { MANY = 100000 }; // a disc of one face
    char *text = malloc(MANY * 64u);
    assert_non_null(text);
    int at = sprintf(text, ASCII "element vertex %d\n" XYZ "element face 1\nproperty list int int vertex_indices\nend_header\n",
                     MANY);
    for (int i = 0; i < MANY; i++)
        at += sprintf(text + at, "%.9g %.9g 3\n", cos(i * 2 * 3.14159265358979 / MANY), sin(i * 2 * 3.14159265358979 / MANY));
    at += sprintf(text + at, "%d", MANY);
    for (int i = 0; i < MANY; i++)
        at += sprintf(text + at, " %d", i);
    file = open_text(text);
    float *normals = malloc(MANY * 3 * sizeof *normals);
    assert_non_null(normals);
    assert_int_equal(patina_file_read_normals(file, normals, MANY * 3 * sizeof *normals), PATINA_OK);
    for (int i = 0; i < MANY; i++)
        assert_true(normals[3 * i + 2] == 1);
    free(normals);
    free(text);
    patina_file_destroy(file);
}

static void test_bad_faces(void **state)
{
    (void)state;
    empty_log();
    patina_file *file = open_text(ASCII "element vertex 3\n" XYZ
                                        "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
                                        "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 3\n3 -1 0 1\n4 0 1 2 99999\n");
    expect_log("1 (memory): 3 faces name points that are not there, and were left out; the first, 1, names 3 of 3");
    expect_normals(file, (float[]){0, 0, 1, 0, 0, 1, 0, 0, 1}, 9);
    patina_file_destroy(file);
    file = open_text(ASCII "element vertex 3\n" XYZ "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
                           "0 0 0\n1 0 0\nnan 1 0\n3 0 1 2\n3 0 0 1\n");
    assert_int_equal(info_of(file).has_normals, 0); // no face has a side
    patina_file_destroy(file);
    file = open_text(ASCII "element vertex 1\n" XYZ "property float nx\nproperty float ny\nproperty float nz\nelement face 1\n"
                           "property list uchar int vertex_indices\nend_header\n0 0 0 1 0 0\n3 0 1 7\n");
    expect_normals(file, (float[]){1, 0, 0}, 3); // its own
    patina_file_destroy(file);
    empty_log();
}

// ---- a scanner's grid ----------------------------------------------------------------------------------------------

// 8 columns, 5 rows, taken along -z: on the left z = x / 2, on the right the same 10 higher; cell 9 is empty. The slope is
// found on both sides of the step, and faces the scanner.
static void test_range_grid(void **state)
{
    (void)state;
    char text[4096];
    int at = snprintf(text, sizeof text,
                      ASCII "obj_info num_cols 8\nobj_info num_rows 5\nobj_info is_mesh 0\nelement vertex 39\n" XYZ
                            "element range_grid 40\nproperty list uchar int vertex_indices\nend_header\n");
    for (int i = 0; i < 40; i++)
        if (i != 9)
            at += snprintf(text + at, sizeof text - (size_t)at, "%d %d %g\n", i % 8, i / 8, i % 8 / 2.0 + (i % 8 > 3 ? 10 : 0));
    for (int i = 0, point = 0; i < 40; i++)
        at += i == 9 ? snprintf(text + at, sizeof text - (size_t)at, "0\n")
                     : snprintf(text + at, sizeof text - (size_t)at, "1 %d\n", point++);
    patina_file *file = open_text(text);
    patina_file_info info = info_of(file);
    float columns[39], rows[39], n[3 * 39];
    assert_true(info.count == 39 && info.attributes == 2 && info.has_normals && info.stations == 0);
    assert_int_equal(patina_file_read_attribute(file, 0, columns, sizeof columns), PATINA_OK);
    assert_int_equal(patina_file_read_attribute(file, 1, rows, sizeof rows), PATINA_OK);
    assert_int_equal(patina_file_read_normals(file, n, sizeof n), PATINA_OK);
    for (int i = 0; i < 39; i++) {
        int cell = i < 9 ? i : i + 1;
        assert_true(columns[i] == (float)(cell % 8) && rows[i] == (float)(cell / 8));
        assert_true(fabsf(n[3 * i] + sqrtf(0.2f)) < 1e-5f && fabsf(n[3 * i + 1]) < 1e-5f &&
                    fabsf(n[3 * i + 2] - sqrtf(0.8f)) < 1e-5f);
    }
    patina_file_scan scan = {.struct_size = sizeof scan};
    assert_true(info.scans == 1 && !patina_file_get_scan(file, 0, &scan) && !scan.has_station && scan.count == 39);
    assert_true(scan.direction[2] == -1 && scan.columns == 8 && scan.rows == 5 && scan.interval >= 1 && scan.interval < 1.2);
    patina_file_destroy(file);
    expect_log(NULL);
    char *last = strstr(text, "\n1 38\n"), *before = strstr(text, "\n1 37\n");
    last[4] = '9';   // no such point
    before[4] = '6'; // in two cells
    file = open_text(text);
    assert_int_equal(patina_file_read_attribute(file, 0, columns, sizeof columns), PATINA_OK);
    assert_true(columns[36] == 5 && columns[37] == 65535 && columns[38] == 65535);
    expect_log("1 cells of the range_grid name points that are not there, and 1 one that another cell has");
    patina_file_destroy(file);
    strstr(text, "num_rows 5")[9] = '6'; // not as many cells as the grid should have
    file = open_text(text);
    assert_true(info_of(file).attributes == 0 && !info_of(file).has_normals && !info_of(file).scans);
    expect_log("the range_grid of 40 cells is left out: num_cols and num_rows say 8 x 6");
    patina_file_destroy(file);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bool),
        cmocka_unit_test(test_splat_colors),
        cmocka_unit_test(test_splats),
        cmocka_unit_test(test_copied_as_text),
        cmocka_unit_test(test_too_many_bytes),
        cmocka_unit_test(test_faces_cut_short),
        cmocka_unit_test(test_normals_of_faces),
        cmocka_unit_test(test_faces_of_any_size),
        cmocka_unit_test(test_bad_faces),
        cmocka_unit_test(test_range_grid),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
