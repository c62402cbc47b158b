// SPDX-License-Identifier: GPL-3.0-or-later
// Files whose points come in windows: together they are what the file is when it is read whole, and a cloud built of them has the bytes of
// one made in memory. What is wrong with a file is told as there.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "files.h"
#include "folder.h"

#include <stdlib.h>
#include <unistd.h>

enum { COUNT = 10007 };

static char name[64], made[80], other[80];

static void write_file(const void *data, size_t size)
{
    FILE *stream = fopen(name, "wb");
    assert_non_null(stream);
    assert_int_equal(fwrite(data, 1, size, stream), size);
    fclose(stream);
}

// ---- files of many kinds -------------------------------------------------------------------------------------------------

struct column {
    const char *type, *name;
};

struct kind {
    const char *what, *format, *before, *behind; // elements
    struct column columns[20];
    double far; // added to positions
    int list;   // a row begins with one, of 0 to 2 items
};

static const struct kind kinds[] = {
    {"floats", "binary_little_endian", "", "", {{"float", "x"}, {"float", "y"}, {"float", "z"}, {"float", "heat"}}, 0, 0},
    {"a survey",
     "binary_little_endian",
     "",
     "",
     {{"double", "x"},
      {"double", "y"},
      {"double", "z"},
      {"float", "nx"},
      {"float", "ny"},
      {"float", "nz"},
      {"uchar", "red"},
      {"uchar", "green"},
      {"uchar", "blue"},
      {"uchar", "classification"},
      {"float", "heat"}},
     5e6,
     0},
    {"the other order",
     "binary_big_endian",
     "",
     "",
     {{"double", "x"}, {"double", "y"}, {"double", "z"}, {"ushort", "red"}, {"ushort", "green"}, {"ushort", "blue"}},
     4e5,
     0},
    {"text",
     "ascii",
     "",
     "",
     {{"float", "x"},
      {"double", "y"},
      {"float", "z"},
      {"float", "red"},
      {"float", "green"},
      {"float", "blue"},
      {"int", "heat"}},
     5e6,
     0},
    {"lists",
     "binary_little_endian",
     "element camera 2\nproperty float f\n",
     "element note 3\nproperty uchar code\n",
     {{"float", "x"}, {"float", "y"}, {"float", "z"}, {"short", "scalar_Class"}},
     0,
     1},
    {"faces beside normals",
     "binary_little_endian",
     "",
     "element face 1\nproperty list uchar int vertex_indices\n",
     {{"float", "x"}, {"float", "y"}, {"float", "z"}, {"float", "nx"}, {"float", "ny"}, {"float", "nz"}},
     0,
     0},
    {"splats",
     "binary_little_endian",
     "",
     "",
     {{"float", "x"},
      {"float", "y"},
      {"float", "z"},
      {"float", "f_dc_0"},
      {"float", "f_dc_1"},
      {"float", "f_dc_2"},
      {"float", "opacity"},
      {"float", "scale_0"},
      {"float", "scale_1"},
      {"float", "scale_2"},
      {"float", "rot_0"},
      {"float", "rot_1"},
      {"float", "rot_2"},
      {"float", "rot_3"}},
     0,
     0},
};
enum { KINDS = sizeof kinds / sizeof *kinds };

static double value_of(const struct kind *kind, const char *column, uint64_t i)
{
    const double t = fmod((double)(i * 2654435761u % 1000003u) / 1000.0, 7.0), u = (double)i * 0.01;
    if (!strcmp(column, "x"))
        return i % 997 == 5 ? (double)NAN : kind->far + cos(u) * (2.0 + cos(t));
    if (!strcmp(column, "y"))
        return kind->far + sin(u) * (2.0 + cos(t));
    if (!strcmp(column, "z"))
        return sin(t);
    if (column[0] == 'n')
        return column[1] == 'x' ? cos(t) : column[1] == 'y' ? sin(t) : 0.25;
    if (!strcmp(column, "red") || !strcmp(column, "green") || !strcmp(column, "blue"))
        return kind->format[0] == 'a' ? t / 8.0 : floor(30.0 * t);
    return !strncmp(column, "scale", 5) ? -3.0 + 0.1 * t : floor(3.0 * t);
}

static void put(FILE *out, const char *type, double value, int swap)
{
    unsigned char bytes[8];
    size_t size;
    if (!strcmp(type, "double")) {
        memcpy(bytes, &value, size = 8);
    } else if (strstr(type, "short")) {
        const int16_t whole = (int16_t)value;
        memcpy(bytes, &whole, size = 2);
    } else if (!strcmp(type, "uchar")) {
        bytes[0] = (unsigned char)value;
        size = 1;
    } else {
        const float narrow = (float)value;
        memcpy(bytes, &narrow, size = 4);
    }
    for (size_t k = 0; k < size; k++)
        fputc(bytes[swap ? size - 1 - k : k], out);
}

static void write_kind(const struct kind *kind, uint64_t rows)
{
    FILE *out = fopen(name, "wb");
    assert_non_null(out);
    const int text = kind->format[0] == 'a', swap = strstr(kind->format, "big") != NULL;
    fprintf(out, "ply\nformat %s 1.0\n%selement vertex %d\n%s", kind->format, kind->before, COUNT,
            kind->list ? "property list uchar float extra\n" : "");
    for (const struct column *c = kind->columns; c->name; c++)
        fprintf(out, "property %s %s\n", c->type, c->name);
    fprintf(out, "%send_header\n", kind->behind);
    for (int i = 0; kind->before[0] && i < 2; i++)
        put(out, "float", 35.0, swap);
    for (uint64_t i = 0; i < rows; i++) {
        for (uint64_t k = 0; kind->list && k <= i % 3; k++)
            put(out, k ? "float" : "uchar", k ? 0.5 : (double)(i % 3), swap);
        for (const struct column *c = kind->columns; c->name; c++)
            if (text)
                fprintf(out, "%.15g%s", value_of(kind, c->name, i), c[1].name ? " " : i % 100 ? "\n" : "\r\n\n");
            else
                put(out, c->type, value_of(kind, c->name, i), swap);
    }
    if (kind->behind[0]) // three notes, or one face of no corners
        fwrite("\0\0\0", 1, strstr(kind->behind, "note") ? 3 : 1, out);
    fclose(out);
}

static patina_rows *open_rows(void)
{
    patina_rows *rows = NULL;
    char message[512] = "";
    if (patina_rows_open(name, NULL, &rows)) {
        patina_message(NULL, message, sizeof message);
        fail_msg("%s", message);
    }
    return rows;
}

// ---- the same points -----------------------------------------------------------------------------------------------------

static void expect_window(const patina_file *window, const patina_file *whole, uint64_t first)
{
    const patina_file_info part = info_of(window), all = info_of(whole);
    const size_t count = (size_t)part.count, total = (size_t)all.count;
    assert_true(first + part.count <= all.count);
    assert_string_equal(part.format, all.format);
    assert_memory_equal(part.origin, all.origin, sizeof all.origin);
    assert_true(part.has_normals == all.has_normals && part.color_type == all.color_type && part.attributes == all.attributes &&
                part.position_type == all.position_type && part.splats == all.splats);
    float *a = malloc(count * 16), *b = malloc(total * 16);
    assert_true(a && b);
    assert_int_equal(patina_file_read_positions(window, a, count * 12), PATINA_OK);
    assert_int_equal(patina_file_read_positions(whole, b, total * 12), PATINA_OK);
    assert_memory_equal(a, b + 3 * first, count * 12);
    if (all.has_normals) {
        assert_int_equal(patina_file_read_normals(window, a, count * 12), PATINA_OK);
        assert_int_equal(patina_file_read_normals(whole, b, total * 12), PATINA_OK);
        assert_memory_equal(a, b + 3 * first, count * 12);
    }
    if (all.color_type) {
        assert_int_equal(patina_file_read_colors_f32(window, a, count * 16), PATINA_OK);
        assert_int_equal(patina_file_read_colors_f32(whole, b, total * 16), PATINA_OK);
        assert_memory_equal(a, b + 4 * first, count * 16);
    }
    for (uint32_t k = 0; k < all.attributes; k++) {
        assert_int_equal(patina_file_read_attribute(window, k, a, count * 4), PATINA_OK);
        assert_int_equal(patina_file_read_attribute(whole, k, b, total * 4), PATINA_OK);
        assert_memory_equal(a, b + first, count * 4);
    }
    free(a);
    free(b);
}

static void test_windows(void **state)
{
    (void)state;
    static const uint64_t sizes[] = {COUNT, 4096, 999, 1};
    for (int k = 0; k < KINDS; k++) {
        patina_file *whole = NULL;
        write_kind(&kinds[k], COUNT);
        assert_int_equal(patina_file_open(name, NULL, &whole), PATINA_OK);
        for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
            patina_rows *rows = open_rows();
            patina_rows_info info = {.struct_size = sizeof info};
            assert_int_equal(patina_rows_get_info(rows, &info), PATINA_OK);
            assert_true(info.count == COUNT && !info.whole[0]);
            uint64_t done = 0;
            for (patina_file *window; done < (s < 3 ? COUNT : 50);) {
                assert_int_equal(patina_rows_next(rows, sizes[s], &window), PATINA_OK);
                if (!window)
                    fail_msg("%s: ends after %d", kinds[k].what, (int)done);
                expect_window(window, whole, done);
                done += info_of(window).count;
                patina_file_destroy(window);
            }
            patina_file *none;
            assert_true(s == 3 || (!patina_rows_next(rows, 10, &none) && !none));
            assert_true(s == 3 || (!patina_rows_next(rows, 10, &none) && !none));
            patina_rows_destroy(rows);
        }
        patina_file_destroy(whole);
    }
}

// ---- the same cloud ------------------------------------------------------------------------------------------------------

static int build(uint64_t size, const char *scalar, char *message, size_t room)
{
    patina_builder *builder = NULL;
    patina_rows *rows = NULL;
    const patina_builder_desc desc = {.struct_size = sizeof desc, .memory = 1 << 28};
    patina_file *window;
    int code = patina_rows_open(name, NULL, &rows);
    message[0] = 0;
    if (code)
        patina_message(NULL, message, room);
    if (!code)
        code = patina_builder_begin(made, &desc, &builder);
    while (!code && !(code = patina_rows_next(rows, size, &window)) && window) {
        code = patina_builder_add_file(builder, window, scalar);
        if (code)
            patina_message(builder, message, room);
        patina_file_destroy(window);
    }
    if (code && !message[0])
        patina_message(rows, message, room);
    patina_rows_destroy(rows);
    if (!code)
        code = patina_builder_end(builder, NULL);
    patina_builder_destroy(builder);
    return code;
}

static void test_built(void **state)
{
    (void)state;
    char message[512];
    for (int k = 0; k < KINDS; k++) {
        patina_cloud *cloud = NULL;
        patina_file *file = NULL;
        write_kind(&kinds[k], COUNT);
        const int heated = k < 2 || k == 3;
        assert_int_equal(patina_file_open(name, NULL, &file), PATINA_OK);
        assert_int_equal(patina_file_cloud(file, 0, NULL, &cloud), PATINA_OK);
        for (uint32_t i = 0; heated && i < info_of(file).attributes; i++) {
            patina_file_attribute attribute = {.struct_size = sizeof attribute};
            assert_int_equal(patina_file_get_attribute(file, i, &attribute), PATINA_OK);
            if (strcmp(attribute.name, "heat") != 0)
                continue;
            float *heat = malloc(COUNT * sizeof *heat);
            assert_int_equal(patina_file_read_attribute(file, i, heat, COUNT * sizeof *heat), PATINA_OK);
            const patina_array scalars = {.data = heat, .type = PATINA_FLOAT32, .components = 1};
            assert_int_equal(patina_cloud_set_scalars(cloud, &scalars), PATINA_OK);
            free(heat);
        }
        patina_file_destroy(file);
        assert_int_equal(patina_cloud_save(cloud, other), PATINA_OK);
        patina_cloud_destroy(cloud);
        if (build(777, heated ? "heat" : NULL, message, sizeof message))
            fail_msg("%s: %s", kinds[k].what, message);
        assert_same_file(made, other);
    }
}

// ---- files that are read whole, or not at all ----------------------------------------------------------------------------

static void expect_whole(const char *text, const char *why)
{
    write_file(text, strlen(text));
    patina_rows *rows = open_rows();
    patina_rows_info info = {.struct_size = sizeof info};
    assert_int_equal(patina_rows_get_info(rows, &info), PATINA_OK);
    if (!strstr(info.whole, why))
        fail_msg("'%s' should hold '%s'", info.whole, why);
    patina_file *file = NULL, *whole = open_text(text);
    assert_int_equal(patina_rows_next(rows, 1, &file), PATINA_OK);
    expect_window(file, whole, 0);
    assert_int_equal(info_of(file).count, info_of(whole).count);
    patina_file_destroy(file);
    assert_true(!patina_rows_next(rows, 1, &file) && !file);
    patina_file_destroy(whole);
    patina_rows_destroy(rows);
}

static void test_whole(void **state)
{
    (void)state;
    expect_whole("1 2 3\n4 5 6\n", "columns");
    expect_whole(ASCII "element vertex 3\n" XYZ "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
                       "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
                 "faces");
    expect_whole(ASCII "obj_info num_cols 1\nobj_info num_rows 2\nelement vertex 2\n" XYZ
                       "element range_grid 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 0\n1 1\n",
                 "range_grid");
    expect_whole(ASCII "obj_info patina_scan 0 0 0.5 0 0 -1 at 0 0 1 1 0 0 0 0 1 0 0 0 0 1 0 one\nelement vertex 1\n" XYZ
                       "end_header\n0 0 0\n",
                 "scans");
}

static void expect_refused(const char *words)
{
    char message[512];
    remove(made);
    assert_true(build(1000, NULL, message, sizeof message) < 0);
    if (!strstr(message, words) || !strstr(message, name))
        fail_msg("'%s' should hold '%s' and the file's name", message, words);
    FILE *none = fopen(made, "rb");
    assert_null(none);
}

static void test_refused(void **state)
{
    (void)state;
    patina_rows *rows = (patina_rows *)8;
    assert_int_equal(patina_rows_open("there is no such file.ply", NULL, &rows), PATINA_ERROR_FILE);
    assert_null(rows);
    for (int k = 0; k < KINDS; k++) { // cut short in the middle
        write_kind(&kinds[k], COUNT / 2);
        expect_refused(k == 3 || k == 4 ? "10007 rows of" : "declares 10007 rows");
    }
    write_file("LASF", 4);
    expect_refused("LAS, LAZ or COPC");
    const char *bad = ASCII "element vertex 3\n" XYZ "end_header\n1 2 3\n4 five 6\n7 8 9\n";
    write_file(bad, strlen(bad));
    expect_refused("line 9: 'five'");
    const char *none = ASCII "element vertex 2\nproperty float x\nproperty float y\nend_header\n1 2\n3 4\n";
    write_file(none, strlen(none));
    expect_refused("no scalar property z");
    const char *more = ASCII "element vertex 1\n" XYZ "end_header\n1 2 3\n4 5 6\n"; // more rows than are declared
    write_file(more, strlen(more));
    char message[512];
    empty_log();
    assert_int_equal(build(10, NULL, message, sizeof message), PATINA_OK);
    expect_log("line 9 and what follows is more than the header declares");
    assert_true(build(10, "heat", message, sizeof message) == PATINA_ERROR_ARGUMENT && strstr(message, "no attribute 'heat'"));
}

static void test_cancelled(void **state)
{
    (void)state;
    patina_progress *progress = NULL;
    patina_rows *rows = NULL;
    patina_file *window = NULL;
    write_kind(&kinds[0], COUNT);
    assert_int_equal(patina_progress_create(&progress), PATINA_OK);
    assert_int_equal(patina_rows_open(name, progress, &rows), PATINA_OK);
    patina_progress_cancel(progress);
    assert_int_equal(patina_rows_next(rows, 100, &window), PATINA_ERROR_CANCELLED);
    assert_null(window);
    patina_rows_destroy(rows);
    patina_progress_destroy(progress);
}

static int clear(void **state)
{
    (void)state;
    remove(name);
    remove(made);
    remove(other);
    return 0;
}

int main(void)
{
    snprintf(name, sizeof name, "patina-rows-%ld.ply", (long)getpid());
    snprintf(made, sizeof made, "%s.cloud", name);
    snprintf(other, sizeof other, "%s.other", name);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_windows), cmocka_unit_test(test_built),
                                       cmocka_unit_test(test_whole), cmocka_unit_test(test_refused),
                                       cmocka_unit_test(test_cancelled)};
    return cmocka_run_group_tests(tests, NULL, clear);
}
