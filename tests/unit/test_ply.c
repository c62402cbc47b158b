// SPDX-License-Identifier: GPL-3.0-or-later
// The PLY reader and writer through the public header: hand-made files in memory, then the shared collection where
// there is one (folder PATINA_SHARED, else ../shared).
#include "base/platform.h"
#include "../../native/io/number.h"
#include "../../native/base/progress.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "files.h"

#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// ---- text ----------------------------------------------------------------------------------------------------------

static void test_ascii(void **state)
{
    (void)state;
    patina_file *file = open_text(ASCII "comment a\nobj_info b\nelement vertex 2\n" XYZ "end_header\n1 2 3\n4 5 6");
    expect_positions(file, (float[]){1, 2, 3, 4, 5, 6}, 6);
    patina_file_info info = info_of(file);
    assert_string_equal(info.format, "PLY ascii");
    assert_int_equal(info.position_type, PATINA_FLOAT32);
    assert_int_equal(info.color_type, PATINA_NONE);
    assert_true(info.box_min[0] == 1 && info.box_max[2] == 6 && info.origin[0] == 0);
    patina_file_destroy(file);
}

static void test_line_ends(void **state)
{
    (void)state;
    expect_one("ply\r\nformat ascii 1.0\r\nelement vertex 1\r\nproperty float x\r\nproperty float y\r\n"
               "property float z\r\nend_header\r\n1 2 3\r\n",
               1, 2, 3);
    expect_one("ply\rformat ascii 1.0\relement vertex 1\rproperty float x\rproperty float y\rproperty float "
               "z\rend_header\r1 2 3\r",
               1, 2, 3);
    expect_one("\xef\xbb\xbf\n\nply \nformat  ascii\t1.0 \n\nelement vertex 1\n" XYZ "end_header\n\n \n 1\t2  3 \n", 1, 2, 3);
}

static void test_numbers(void **state)
{
    (void)state;
    expect_one(ASCII "element vertex 1\n" XYZ "end_header\n+1.5e1 -.25 3.\n", 15, -0.25f, 3);
    patina_file *file = open_text(ASCII "element vertex 4\n" XYZ "end_header\nnan 0 0\n-inf 1 2\n0 1.#QNAN Infinity\n1 1 1");
    patina_file_info info = info_of(file);
    assert_int_equal(info.invalid_positions, 3);
    assert_true(info.box_min[0] == 1 && info.box_max[0] == 1);
    expect_positions(file, (float[]){NAN, 0, 0, -INFINITY, 1, 2, 0, NAN, INFINITY, 1, 1, 1}, 12);
    patina_file_destroy(file);
    expect_one(ASCII "element vertex 1\n" XYZ "end_header\n1e39 1e400 0\n", INFINITY, INFINITY, 0);
}

// Numbers come out correctly rounded by each way of the parser, and under a locale whose decimal sign is a comma.
static void test_exact_numbers(void **state)
{
    (void)state;
    uint64_t random = 88172645463325252u;
    setlocale(LC_ALL, "de_DE.UTF-8"); // where it is not installed the test is only weaker
    for (int i = 0; i < 200000; i++) {
        double value, got = 0;
        char text[256];
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        memcpy(&value, &random, sizeof value);
        if (i % 2)
            value = (double)(random >> (i % 64)) * pow(10, -(i / 2) % 20);
        if (!isfinite(value))
            continue;
        snprintf(text, sizeof text, "%.*g", 14 + i % 8, value);
        char *comma = strchr(text, ',');
        if (comma)
            *comma = '.';
        double wanted = pt_decimal(text);
        const uint8_t *end = (const uint8_t *)text + strlen(text);
        const uint8_t *behind = pt_parse_number((const uint8_t *)text, end, &got);
        if (behind != end || memcmp(&got, &wanted, sizeof got))
            fail_msg("%s was read as %.17g", text, got);
    }
    setlocale(LC_ALL, "C");
}

static void test_text_lists(void **state)
{
    (void)state;
    patina_file *file = open_text(ASCII "element face 2\nproperty list uchar int i\nelement vertex 2\nproperty float z\n"
                                        "property list uchar float junk\nproperty float y\nproperty float x\n"
                                        "element range_grid 9\nproperty list uchar int v\nend_header\n"
                                        "3 0 1 2\n0\n3 2 9 9 2 1\n6 0 5 4\n1 0\n");
    expect_positions(file, (float[]){1, 2, 3, 4, 5, 6}, 6);
    assert_int_equal(info_of(file).attributes, 0);
    patina_file_destroy(file);
}

static void test_bad_text(void **state)
{
    (void)state;
    static const char head[] = ASCII "element vertex 2\n" XYZ "end_header\n";
    char text[512];
    snprintf(text, sizeof text, "%s1.0 2 3\n4.0 5\n", head);
    refuse(text, "line 9 ends before property z");
    snprintf(text, sizeof text, "%s1 2 3 4\n4 5 6\n", head);
    refuse(text, "line 8 goes on with '4'");
    snprintf(text, sizeof text, "%s1 2 3\n4 0x5 6\n", head);
    refuse(text, "line 9: '0x5' is not a number");
    snprintf(text, sizeof text, "%s1 2 3\n4 5,5 6\n", head);
    refuse(text, "'5,5' is not a number");
    snprintf(text, sizeof text, "%s1 2 3\n \n           \n", head);
    refuse(text, "behind 1 of the 2 rows of element vertex");
    snprintf(text, sizeof text, "%s1 2 3", head);
    refuse(text, "declares 2 rows of at least 6 bytes, but only 5 bytes follow from byte");
    refuse(ASCII "element vertex 1\n" XYZ "property uchar q\nend_header\n1 2 3 300\n", "'300' does not fit property q");
    refuse(ASCII "element vertex 1\n" XYZ "property int q\nend_header\n1 2 3 1.5\n", "does not fit property q of type int");
    refuse(ASCII "element vertex 1\n" XYZ "property int q\nend_header\n1 2 3 nan\n", "does not fit");
    refuse(ASCII "element vertex 1\nproperty list char int l\n" XYZ "end_header\n-1 1 2 3\n", "has the count -1");
    refuse(ASCII "element vertex 1\nproperty list uint int l\n" XYZ "end_header\n4000000000 1 2 3\n", "ends before property l");
}

// ---- header --------------------------------------------------------------------------------------------------------

static void test_bad_headers(void **state)
{
    (void)state;
    refuse("", "the file is empty");
    refuse("ply 1\nformat ascii 1.0\n", "line 1: expected 'ply' alone, found 'ply 1'");
    refuse("plx\nformat ascii 1.0\n", "not a PLY file, it begins with 'plx?format a'");
    refuse("ply\n", "without end_header");
    refuse("ply", "not a PLY file");
    refuse("\x1f\x8b\x08\x01", "gzip");
    refuse(ASCII "element vertex 1\n" XYZ, "without end_header");
    refuse("ply\nelement vertex 1\n" XYZ "end_header\n1 2 3\n", "no format line");
    refuse(ASCII "end_header\n", "no element vertex");
    refuse("ply\nformat ascii 2.0\nend_header\n", "line 2: the format's version is not 1.0 but '2.0'");
    refuse("ply\nformat binary 1.0\nend_header\n", "line 2: the format is none of");
    refuse("ply\nformat ascii\nend_header\n", "line 2: expected 'format <name> 1.0'");
    refuse(ASCII "format ascii 1.0\nend_header\n", "line 3: a second format line");
    refuse(ASCII "property float x\nend_header\n", "line 3: a property before the first element");
    refuse(ASCII "element vertex\nend_header\n", "line 3: expected 'element <name> <count>'");
    refuse(ASCII "element vertex -1\nend_header\n", "not '-1'");
    refuse(ASCII "element vertex 99999999999999999999\nend_header\n", "whole number");
    refuse(ASCII "element vertex 1\nelement vertex 1\n" XYZ "end_header\n", "line 4: a second element 'vertex'");
    refuse(ASCII "element vertex 1\nproperty half x\nend_header\n", "line 4: unknown type 'half'");
    refuse(ASCII "element vertex 1\nproperty float\nend_header\n", "line 4: expected 'property");
    refuse(ASCII "element vertex 1\nproperty list float int x\nend_header\n", "count cannot be of type 'float'");
    refuse(ASCII "element vertex 1\nproperty list uchar x\nend_header\n", "expected 'property");
    refuse(ASCII "element vertex 1\nproprety float x\nend_header\n", "line 4: unknown keyword 'proprety'");
    refuse(ASCII "element vertex 1\n" XYZ "property int x\nend_header\n", "line 7: the element has two properties 'x'");
    refuse(ASCII "element vertex 1\nproperty float x\nproperty float y\nend_header\n1 2\n", "no scalar property z");
    refuse(ASCII "element vertex 1\nproperty list uchar float x\nproperty float y\nproperty float z\nend_header\n1 1 2 3\n",
           "no scalar property x");
    refuse(ASCII "comment patina origin 1 2 zero\nend_header\n", "line 3: an origin must be three numbers");
    refuse(ASCII "element vertex 1\n" XYZ "property uchar red\nproperty float green\nproperty uchar blue\nend_header\n"
                 "1 2 3 4 5 6\n",
           "mix the types uchar, float and uchar");
    refuse(ASCII "element vertex 1\nproperty float "
                 "a234567890123456789012345678901234567890123456789012345678901234\nend_header\n",
           "a name of more than 63 bytes");
}

static void test_long_headers(void **state)
{
    (void)state;
    size_t size = 2u << 20;
    char *text = malloc(size);
    assert_non_null(text);
    memset(text, 'a', size);
    memcpy(text, "ply\ncomment ", 12);
    refuse_bytes(text, size, PATINA_ERROR_FORMAT, "no end_header in the first 1048576 bytes");
    int at = snprintf(text, size, ASCII "element vertex 1\n");
    for (int i = 0; i < 1025; i++)
        at += snprintf(text + at, size - (size_t)at, "property float p%d\n", i);
    refuse(text, "more than 1024 properties");
    at = snprintf(text, size, ASCII);
    for (int i = 0; i < 65; i++)
        at += snprintf(text + at, size - (size_t)at, "element e%d 0\n", i);
    refuse(text, "more than 64 elements");
    free(text);
}

// Counts that the bytes cannot hold are refused before anything is allocated or walked.
static void test_lying_counts(void **state)
{
    (void)state;
    refuse(ASCII "element vertex 1000000000000000000\n" XYZ "end_header\n1 2 3\n",
           "element vertex declares 1000000000000000000 rows of at least 6 bytes, but only 6 bytes follow from byte");
    refuse(LITTLE "element vertex 1000000000000000000\n" XYZ "end_header\n1234", "rows of at least 12 bytes, but only 4");
    refuse(LITTLE "element vertex 9999999999999999999\nproperty list uchar int l\n" XYZ "end_header\n1234",
           "rows of at least 13 bytes");
    refuse(LITTLE "element face 999999999999999999\nproperty list uchar int l\nelement vertex 1\n" XYZ
                  "end_header\n1234567890123456",
           "element face declares 999999999999999999 rows");
    refuse(ASCII "element face 999999999999999999\nproperty list uchar int l\nelement vertex 1\n" XYZ "end_header\n1 2 3\n",
           "element face declares 999999999999999999 rows");
    const char *empty = LITTLE "element odd 999999999999999999\nelement vertex 0\n" XYZ "end_header\n";
    patina_file *file = open_text(empty); // rows of no bytes: nothing to pass over
    patina_file_info info = info_of(file);
    assert_true(info.count == 0 && info.box_min[0] > info.box_max[0]);
    patina_file_destroy(file);
    const char *none = LITTLE "element vertex 999999999999999999\nend_header\n";
    refuse_bytes(none, strlen(none), PATINA_ERROR_TOO_MANY_POINTS, "2^32 - 2");
}

// ---- bytes ---------------------------------------------------------------------------------------------------------

static void test_binary_orders(void **state)
{
    (void)state;
    static const uint8_t little[] = {0, 0, 0x80, 0x3f, 0, 0, 0, 0x40, 0, 0, 0x40, 0x40};
    static const uint8_t big[] = {0x3f, 0x80, 0, 0, 0x40, 0, 0, 0, 0x40, 0x40, 0, 0};
    struct blob b = blob(LITTLE "element vertex 1\n" XYZ "end_header\n", little, sizeof little);
    patina_file *file = open_bytes(b.bytes, b.size);
    expect_positions(file, (float[]){1, 2, 3}, 3);
    assert_string_equal(info_of(file).format, "PLY binary_little_endian");
    patina_file_destroy(file);
    b = blob(BIG "element vertex 1\n" XYZ "end_header\n", big, sizeof big);
    file = open_bytes(b.bytes, b.size);
    expect_positions(file, (float[]){1, 2, 3}, 3);
    patina_file_destroy(file);
}

// A body that begins with the byte of a line feed keeps it, behind LF, CR LF and CR headers.
static void test_body_begins_with_line_feed(void **state)
{
    (void)state;
    static const uint8_t body[] = {10, 0, 0, 13, 0, 0};
    static const char *const ends[] = {"\n", "\r\n", "\r"};
    for (int i = 0; i < 3; i++) {
        const char *e = ends[i];
        char header[256];
        snprintf(header, sizeof header,
                 "ply%sformat binary_little_endian 1.0%selement vertex 2%sproperty uchar x%sproperty uchar y%sproperty "
                 "uchar z%send_header%s",
                 e, e, e, e, e, e, e);
        struct blob b = blob(header, body, sizeof body);
        patina_file *file = open_bytes(b.bytes, b.size);
        expect_positions(file, (float[]){10, 0, 0, 13, 0, 0}, 6);
        assert_int_equal(info_of(file).position_type, PATINA_UINT8);
        patina_file_destroy(file);
    }
}

static void test_every_type(void **state)
{
    (void)state;
    static const char *const types[] = {"char", "uint8", "short", "uint16", "int", "uint32", "float32", "double"};
    static const uint32_t patina_types[] = {PATINA_INT8,  PATINA_UINT8,  PATINA_INT16,   PATINA_UINT16,
                                            PATINA_INT32, PATINA_UINT32, PATINA_FLOAT32, PATINA_FLOAT64};
    static const uint8_t bodies[8][8] = {
        {0xfe}, {0xfe}, {0xff, 0xfe}, {0xff, 0xfe}, {0xff, 255, 255, 0xfe}, {0xff, 255, 255, 0xfe}, {0xc0, 0}, {0xc0, 0}};
    static const float wanted[] = {-2, 254, -2, 65534, -2, 4294967294.0f, -2, -2};
    static const size_t sizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
    char header[512];
    uint8_t body[64] = {0};
    size_t size = 3;
    int at = snprintf(header, sizeof header, BIG "element vertex 1\nproperty uchar x\nproperty uchar y\nproperty uchar z\n");
    for (int i = 0; i < 8; i++) {
        at += snprintf(header + at, sizeof header - (size_t)at, "property %s a%d\n", types[i], i);
        memcpy(body + size, bodies[i], sizes[i]);
        size += sizes[i];
    }
    snprintf(header + at, sizeof header - (size_t)at, "end_header\n");
    struct blob b = blob(header, body, size);
    patina_file *file = open_bytes(b.bytes, b.size);
    assert_int_equal(info_of(file).attributes, 8);
    for (uint32_t i = 0; i < 8; i++) {
        patina_file_attribute attribute = {.struct_size = sizeof attribute};
        float value;
        assert_int_equal(patina_file_get_attribute(file, i, &attribute), PATINA_OK);
        assert_int_equal(attribute.type, patina_types[i]);
        assert_int_equal(attribute.name[1], '0' + (int)i);
        assert_int_equal(patina_file_read_attribute(file, i, &value, sizeof value), PATINA_OK);
        assert_true(value == wanted[i]);
    }
    patina_file_attribute attribute = {.struct_size = sizeof attribute};
    assert_int_equal(patina_file_get_attribute(file, 8, &attribute), PATINA_ERROR_ARGUMENT);
    patina_file_destroy(file);
}

static void test_binary_lists(void **state)
{
    (void)state;
    static const uint8_t body[] = {2, 0, 1, 0, 2, 0, /* face */ 7, 1, 9, 9, 8, 6, /* first */ 5, 0, 4, 3 /* second */};
    const char *header = LITTLE "element face 1\nproperty list uchar short i\nelement vertex 2\nproperty char x\n"
                                "property list uchar ushort l\nproperty char y\nproperty char z\nend_header\n";
    size_t face = 5; // count and two shorts
    uint8_t rows[sizeof body];
    memcpy(rows, body, face);
    memcpy(rows + face, body + face + 1, sizeof body - face - 1);
    struct blob b = blob(header, rows, sizeof body - 1);
    patina_file *file = open_bytes(b.bytes, b.size);
    expect_positions(file, (float[]){7, 8, 6, 5, 4, 3}, 6);
    patina_file_destroy(file);
    refuse_bytes(b.bytes, b.size - 1, PATINA_ERROR_FORMAT, "inside row 1 of the 2 of element vertex");
    b.bytes[b.size - 3] = 200; // the second list's count
    refuse_bytes(b.bytes, b.size, PATINA_ERROR_FORMAT, "the file ends at byte");
    b = blob(LITTLE "element vertex 1\nproperty list char char l\n" XYZ "end_header\n", "\xff-12345678901", 13);
    refuse_bytes(b.bytes, b.size, PATINA_ERROR_FORMAT, "list l of row 0 has the count -1");
    b = blob(LITTLE "element camera 2\nproperty short a\nelement vertex 1\nproperty char x\nproperty char y\n"
                    "property char z\nproperty ushort r\nproperty ushort g\nproperty ushort b\nend_header\n",
             "----\1\2\3\xff\xff\0\0\0\0", 13);
    file = open_bytes(b.bytes, b.size);
    expect_positions(file, (float[]){1, 2, 3}, 3);
    expect_bytes(file, (uint8_t[]){255, 0, 0, 255}, 4);
    patina_file_destroy(file);
}

static void test_truncated(void **state)
{
    (void)state;
    const char *header = LITTLE "element vertex 4\n" XYZ "property uchar red\nproperty uchar green\n"
                                "property uchar blue\nend_header\n";
    uint8_t body[60] = {0};
    struct blob b = blob(header, body, sizeof body);
    patina_file_destroy(open_bytes(b.bytes, b.size));
    for (size_t size = 0; size < b.size; size++) {
        patina_file *file;
        uint8_t *exact = malloc(size ? size : 1); // so that a sanitizer sees a byte too far
        assert_non_null(exact);
        memcpy(exact, b.bytes, size);
        assert_int_equal(patina_file_open_memory(exact, size, &file), PATINA_ERROR_FORMAT);
        free(exact);
    }
}

// ---- what columns mean ---------------------------------------------------------------------------------------------

static void test_colors(void **state)
{
    (void)state;
    float f[4];
    patina_file *file = open_text(ASCII "element vertex 2\n" XYZ "property uchar red\nproperty uchar green\n"
                                        "property char blue\nend_header\n0 0 0 1 255 200\n1 1 1 0 0 -1\n");
    assert_int_equal(info_of(file).color_type, PATINA_UINT8);
    expect_bytes(file, (uint8_t[]){1, 255, 200, 255, 0, 0, 255, 255}, 8);
    float two[8];
    assert_int_equal(patina_file_read_colors_f32(file, f, sizeof f),
                     PATINA_ERROR_ARGUMENT); // one point's worth
    assert_int_equal(patina_file_read_colors_f32(file, two, sizeof two), PATINA_OK);
    assert_true(fabsf(two[0] - 1 / 255.0f / 12.92f) < 1e-7f && two[1] == 1 && two[3] == 1 && two[4] == 0);
    patina_file_destroy(file);

    file = open_text(ASCII "element vertex 1\n" XYZ "property ushort r\nproperty ushort g\nproperty ushort b\n"
                           "property float a\nend_header\n0 0 0 0 65535 32896 0.5\n");
    assert_int_equal(info_of(file).color_type, PATINA_UINT16);
    expect_bytes(file, (uint8_t[]){0, 255, 128, 128}, 4);
    assert_int_equal(patina_file_read_colors_f32(file, f, sizeof f), PATINA_OK);
    assert_true(f[0] == 0 && f[1] == 1 && fabsf(f[2] - 0.2158605f) < 1e-5f && fabsf(f[3] - 0.5f) < 1e-4f);
    patina_file_destroy(file);

    file = open_text(ASCII "element vertex 1\n" XYZ "property float diffuse_red\nproperty double diffuse_green\n"
                           "property float diffuse_blue\nend_header\n0 0 0 0.2158605 2 nan\n");
    assert_int_equal(info_of(file).color_type, PATINA_FLOAT32);
    expect_bytes(file, (uint8_t[]){128, 255, 0, 255}, 4);
    assert_int_equal(patina_file_read_colors_f32(file, f, sizeof f), PATINA_OK);
    assert_true(f[1] == 2 && isnan(f[2]) && f[3] == 1);
    patina_file_destroy(file);

    file = open_text(ASCII "element vertex 1\n" XYZ "property int red\nproperty int green\nproperty int blue\n"
                           "property int r\nend_header\n0 0 0 300 -5 7 9\n");
    expect_bytes(file, (uint8_t[]){255, 0, 7, 255}, 4);
    assert_int_equal(info_of(file).attributes, 1);
    patina_file_destroy(file);
}

static void test_normals(void **state)
{
    (void)state;
    float n[3];
    patina_file *file = open_text(ASCII "element points 1\nproperty double normal_z\n" XYZ "property float normal_x\n"
                                        "property float normal_y\nproperty float ny\nend_header\n-3 0 0 0 1 2 9\n");
    assert_int_equal(patina_file_read_normals(file, n, sizeof n), PATINA_OK);
    assert_true(n[0] == 1 && n[1] == 2 && n[2] == -3);
    assert_true(info_of(file).has_normals && info_of(file).attributes == 1); // ny alone is no normal
    assert_int_equal(patina_file_read_colors_f32(file, n, sizeof n), PATINA_ERROR_EMPTY);
    char message[512];
    assert_true(patina_message(file, message, sizeof message) > 0 && strstr(message, "no colours"));
    patina_file_destroy(file);
}

// A surveyor's cloud: millimetres at 5,000,000 m, with a stray point at zero.
static void test_origin(void **state)
{
    (void)state;
    char text[4096];
    int at = snprintf(text, sizeof text,
                      ASCII "element vertex 21\nproperty double x\nproperty double y\nproperty double z\n"
                            "end_header\n0 0 0\n");
    for (int i = 0; i < 20; i++)
        at += snprintf(text + at, sizeof text - (size_t)at, "%d.%03d %d.%03d 12.5\n", 5000000 + i, i, 400000 - i, 2 * i);
    patina_file *file = open_text(text);
    patina_file_info info = info_of(file);
    float xyz[63];
    assert_int_equal(patina_file_read_positions(file, xyz, sizeof xyz), PATINA_OK);
    assert_true(info.origin[0] >= 5000000 && info.origin[0] < 5000020 && info.origin[0] == floor(info.origin[0]));
    for (int i = 0; i < 20; i++) {
        assert_true(fabs(info.origin[0] + (double)xyz[3 * i + 3] - (5000000 + i + i / 1000.0)) < 2e-6);
        assert_true(fabs(info.origin[1] + (double)xyz[3 * i + 4] - (400000 - i + i / 500.0)) < 2e-6);
    }
    assert_true(info.box_min[0] == 0 && fabs(info.box_max[0] - 5000019.019) < 2e-6);
    patina_file_destroy(file);

    // Around zero float32 is as good.
    file = open_text(ASCII "element vertex 2\nproperty double x\nproperty double y\nproperty double z\nend_header\n"
                           "-100.1 -50.3 -7.7\n99.9 33.3 1.1\n");
    assert_true(info_of(file).origin[0] == 0 && info_of(file).position_type == PATINA_FLOAT64);
    patina_file_destroy(file);

    file = open_text("ply\nformat ascii 1.0\ncomment patina origin 1000 -2e6 0.5\nelement vertex 1\n" XYZ
                     "end_header\n1 2 3\n");
    expect_positions(file, (float[]){1, 2, 3}, 3);
    info = info_of(file);
    assert_true(info.origin[0] == 1000 && info.origin[1] == -2e6 && info.box_max[2] == 3.5);
    patina_file_destroy(file);
}

// ---- arguments, files, progress ------------------------------------------------------------------------------------

static void test_arguments(void **state)
{
    (void)state;
    patina_file *file = NULL;
    float xyz[3];
    assert_int_equal(patina_file_open(NULL, NULL, &file), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_file_open("x", NULL, NULL), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_file_open_memory(NULL, 3, &file), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_file_open_memory("ply", 3, NULL), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_file_open("/", NULL, &file), PATINA_ERROR_FILE);
    assert_int_equal(patina_file_open("/no/such/file.ply", NULL, &file), PATINA_ERROR_FILE);
    char message[512];
    assert_true(patina_message(NULL, message, sizeof message) && strstr(message, "/no/such/file.ply: cannot be read"));
    char long_path[400];
    memset(long_path, 'a', sizeof long_path); // the end of the name and the
                                              // reason must both be there
    memcpy(long_path + sizeof long_path - 9, "/end.ply", 9);
    assert_int_equal(patina_file_open(long_path, NULL, &file), PATINA_ERROR_FILE);
    assert_true(patina_message(NULL, message, sizeof message) && strstr(message, "/end.ply: cannot be read: "));
    patina_file_destroy(NULL);
    assert_int_equal(patina_file_read_positions(NULL, xyz, sizeof xyz), PATINA_ERROR_ARGUMENT);
    file = open_text(ASCII "element vertex 1\n" XYZ "end_header\n1 2 3\n");
    assert_int_equal(patina_file_read_positions(file, xyz, sizeof xyz - 1), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_file_read_positions(file, NULL, sizeof xyz), PATINA_ERROR_ARGUMENT);
    patina_file_info info = {0};
    assert_int_equal(patina_file_get_info(file, &info), PATINA_ERROR_ARGUMENT);
    info.struct_size = offsetof(patina_file_info, attributes); // a caller built against an older header
    info.attributes = 77;
    assert_int_equal(patina_file_get_info(file, &info), PATINA_OK);
    assert_true(info.count == 1 && info.attributes == 77);
    patina_file_destroy(file);
}

static void make_path(char path[64])
{
    snprintf(path, 64, "/tmp/patina-test-XXXXXX");
    int descriptor = mkstemp(path);
    assert_true(descriptor >= 0);
    close(descriptor);
}

static void test_write(void **state)
{
    (void)state;
    struct {
        double xyz[3];
        uint16_t rgba[4];
    } points[] = {{{0.001, 2, 3}, {1, 2, 3, 4}}, {{1, NAN, 6}, {65535, 0, 7, 8}}, {{8, 8, 8}, {0}}};
    float normals[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, got[9];
    char path[64];
    make_path(path);
    patina_cloud_desc desc = {.struct_size = sizeof desc,
                              .count = 3,
                              .position = {points[0].xyz, PATINA_FLOAT64, 3, sizeof *points},
                              .normal = {normals, PATINA_FLOAT32, 3, 0},
                              .color = {points[0].rgba, PATINA_UINT16, 4, sizeof *points},
                              .origin = {5e6, 0, 0}};
    assert_int_equal(patina_write_ply(path, &desc), PATINA_OK);
    patina_file *file = NULL;
    patina_progress progress = {.value = 0};
    assert_int_equal(patina_file_open(path, &progress, &file), PATINA_OK);
    assert_true(atomic_load(&progress.value) == 1);
    patina_file_info info = info_of(file);
    assert_true(info.count == 3 && info.invalid_positions == 1 && info.origin[0] >= 5000000);
    assert_true(fabs(info.box_min[0] - 5000000.001) < 1e-6 && info.color_type == PATINA_UINT16);
    assert_int_equal(patina_file_read_normals(file, got, sizeof got), PATINA_OK);
    assert_memory_equal(got, normals, sizeof normals);
    expect_bytes(file, (uint8_t[]){0, 0, 0, 0, 255, 0, 0, 0}, 8);
    patina_file_destroy(file);

    atomic_store(&progress.cancelled, 1);
    assert_int_equal(patina_file_open(path, &progress, &file), PATINA_ERROR_CANCELLED);
    assert_null(file);

    float f[6] = {1, 2, 3, 4, 5, 6};
    desc = (patina_cloud_desc){.struct_size = sizeof desc, .count = 2, .position = {f, PATINA_FLOAT32, 3, 0}};
    assert_int_equal(patina_write_ply(path, &desc), PATINA_OK);
    assert_int_equal(patina_file_open(path, NULL, &file), PATINA_OK);
    assert_int_equal(info_of(file).position_type, PATINA_FLOAT32);
    expect_positions(file, f, 6);
    patina_file_destroy(file);
    desc.position.components = 2;
    assert_int_equal(patina_write_ply(path, &desc), PATINA_ERROR_ARGUMENT);
    desc.position.components = 3;
    desc.origin[2] = -7; // float32 positions become float64
    assert_int_equal(patina_write_ply(path, &desc), PATINA_OK);
    assert_int_equal(patina_file_open(path, NULL, &file), PATINA_OK);
    expect_positions(file, (float[]){1, 2, -4, 4, 5, -1}, 6);
    assert_int_equal(info_of(file).position_type, PATINA_FLOAT64);
    patina_file_destroy(file);
    desc.origin[0] = NAN;
    assert_int_equal(patina_write_ply(path, &desc), PATINA_ERROR_ARGUMENT);
    desc.origin[0] = 0;
    desc.position.stride = 8;
    assert_int_equal(patina_write_ply(path, &desc), PATINA_ERROR_ARGUMENT);
    desc.position.stride = 0;
    assert_int_equal(patina_write_ply("/no/such/folder/a.ply", &desc), PATINA_ERROR_FILE);
    assert_int_equal(patina_write_ply("/tmp", &desc), PATINA_ERROR_FILE);
    assert_int_equal(patina_write_ply(path, NULL), PATINA_ERROR_ARGUMENT);
    remove(path);
}

// ---- the shared collection -----------------------------------------------------------------------------------------

static const struct {
    const char *path;
    uint64_t count; // points
} readable[] = {
    {"formats/ply/assimp/Wuson.ply", 11184}, // a comment without the word "comment"
    {"formats/ply/assimp/cube.ply", 8},
    {"formats/ply/assimp/cube_binary.ply", 8},
    {"formats/ply/assimp/cube_binary_header_with_RN_newline.ply", 8},
    {"formats/ply/assimp/cube_binary_starts_with_nl.ply", 8},
    {"formats/ply/assimp/cube_uv.ply", 24},
    {"formats/ply/assimp/float-color.ply", 3},
    {"formats/ply/assimp/issue623.ply", 24}, // a vertex list that its rows lack
    {"formats/ply/assimp/points.ply", 4},
    {"formats/ply/happly/platonic_shelf.ply", 50},
    {"formats/ply/happly/platonic_shelf_ascii.ply", 50},
    {"formats/ply/happly/platonic_shelf_big_endian.ply", 50},
    {"formats/ply/pdal/issue_2421.ply", 1},
    {"formats/ply/pdal/mesh.ply", 4},
    {"formats/ply/pdal/mesh_fixed.ply", 4},
    {"formats/ply/pdal/simple_binary.ply", 3},
    {"formats/ply/pdal/simple_text.ply", 3},
    {"formats/ply/pdal/text_extradim.ply", 1},
    {"formats/ply/tinyply/elephant.ply", 19753},
    {"formats/ply/tinyply/icosahedron.ply", 12},
    {"formats/ply/tinyply/icosahedron_ascii.ply", 12},
    {"formats/ply/tinyply/sofa.ply", 12103},
    {"formats/ply/tinyply/sofa_ascii.ply", 12103},
    {"formats/ply/trimesh/BoxTextured.ply", 24},
    {"formats/ply/trimesh/cube_blender_uv.ply", 24},
    {"formats/ply/trimesh/cube_blender_uv_meshlab.ply", 24},
    {"formats/ply/trimesh/empty.ply", 0},
    {"formats/ply/trimesh/fuze.ply", 502},
    {"formats/ply/trimesh/fuze_ascii.ply", 502},
    {"formats/ply/trimesh/metadata.ply", 4},
    {"formats/ply/trimesh/mirror.ply", 143},
    {"formats/ply/trimesh/multi.ply", 4},
    {"formats/ply/trimesh/plane.ply", 4},
    {"formats/ply/trimesh/plane_tri.ply", 4},
    {"formats/ply/trimesh/ply_empty_ascii.ply", 0},
    {"formats/ply/trimesh/ply_empty_bin.ply", 0},
    {"formats/ply/trimesh/ply_points_ascii.ply", 8},
    {"formats/ply/trimesh/ply_points_bin.ply", 8},
    {"formats/ply/trimesh/points_ascii.ply", 5},
    {"formats/ply/trimesh/points_ascii_with_lists.ply", 5},
    {"formats/ply/trimesh/points_bin.ply", 5},
    {"formats/ply/trimesh/points_emptyascii.ply", 12}, // one row more than it declares
    {"formats/ply/trimesh/points_emptyface.ply", 1024},
    {"formats/ply/trimesh/tet.ply", 4},
    {"lidar/lion_takanawa_normals.ply", 341989},
    {"stanford/armadillo_inward_normals.ply", 38294},
    {"stanford/bunny/bun_zipper.ply", 35947},
    {"stanford/bunny_range/bun000.ply", 40256},
    {"stanford/bunny_range/bun045.ply", 40097},
    {"stanford/bunny_range/bun090.ply", 30379},
    {"stanford/bunny_range/bun180.ply", 40251},
    {"stanford/bunny_range/bun270.ply", 31701},
    {"stanford/bunny_range/bun315.ply", 35336},
    {"stanford/bunny_range/chin.ply", 37738},
    {"stanford/bunny_range/ear_back.ply", 32193},
    {"stanford/bunny_range/top2.ply", 38298},
    {"stanford/bunny_range/top3.ply", 36023},
    {"stanford/dragon_range/dragonStandRight_0.ply", 41841},
    {"stanford/dragon_range/dragonStandRight_120.ply", 34436},
    {"stanford/dragon_range/dragonStandRight_144.ply", 43181},
    {"stanford/dragon_range/dragonStandRight_168.ply", 44329},
    {"stanford/dragon_range/dragonStandRight_192.ply", 39526},
    {"stanford/dragon_range/dragonStandRight_216.ply", 30492},
    {"stanford/dragon_range/dragonStandRight_24.ply", 34836},
    {"stanford/dragon_range/dragonStandRight_240.ply", 19318},
    {"stanford/dragon_range/dragonStandRight_264.ply", 15050},
    {"stanford/dragon_range/dragonStandRight_288.ply", 24573},
    {"stanford/dragon_range/dragonStandRight_312.ply", 40528},
    {"stanford/dragon_range/dragonStandRight_336.ply", 43467},
    {"stanford/dragon_range/dragonStandRight_48.ply", 22092},
    {"stanford/dragon_range/dragonStandRight_72.ply", 14879},
    {"stanford/dragon_range/dragonStandRight_96.ply", 20645},
    {"stanford/dragon_range_union/dragon_ranges_registered.ply", 468947},
};

static const struct {
    const char *path, *words; // of the message
} refused[] = {
    {"formats/ply/pdal/no_vertex.ply", "declares no element vertex"},
    {"formats/ply/pdal/sized_dims.ply", "no scalar property z"},
    {"formats/ply/pdal/unsized_dims.ply", "no scalar property z"},
    {"formats/ply/trimesh/ply_empty_header.ply", "declares no element vertex"},
    {"formats/ply_malformed/crash-30d6d0f7c529b3b66b4131700b7a4580cd7082df.ply", "header line 7: unknown type '???"},
    {"formats/ply_malformed/empty.ply", "the file is empty"},
};

// Whether the file is there; its path goes to `path`.
static bool find_shared(const char *name, char path[1024])
{
    const char *shared = getenv("PATINA_SHARED") ? getenv("PATINA_SHARED") : "../shared";
    snprintf(path, 1024, "%s/data/%s", shared, name);
    return access(path, R_OK) == 0;
}

static void test_collection(void **state)
{
    (void)state;
    char path[1024], message[512];
    patina_file *file = NULL;
    int files = 0;
    if (!find_shared("formats/ply", path)) {
        print_message("skipped: no collection of files at %s\n", path);
        skip();
    }
    for (size_t i = 0; i < sizeof readable / sizeof *readable; i++) {
        if (!find_shared(readable[i].path, path))
            continue;
        if (patina_file_open(path, NULL, &file) != PATINA_OK) {
            patina_message(NULL, message, sizeof message);
            fail_msg("%s", message);
        }
        patina_file_info info = info_of(file);
        assert_int_equal(info.count, readable[i].count);
        assert_int_equal(info.invalid_positions, 0);
        patina_file_destroy(file);
        files++;
    }
    for (size_t i = 0; i < sizeof refused / sizeof *refused; i++) {
        if (!find_shared(refused[i].path, path))
            continue;
        assert_int_equal(patina_file_open(path, NULL, &file), PATINA_ERROR_FORMAT);
        patina_message(NULL, message, sizeof message);
        if (!strstr(message, refused[i].words))
            fail_msg("wanted '%s', got '%s'", refused[i].words, message);
        files++;
    }
    print_message("%d files read\n", files);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ascii),
        cmocka_unit_test(test_line_ends),
        cmocka_unit_test(test_numbers),
        cmocka_unit_test(test_exact_numbers),
        cmocka_unit_test(test_text_lists),
        cmocka_unit_test(test_bad_text),
        cmocka_unit_test(test_bad_headers),
        cmocka_unit_test(test_long_headers),
        cmocka_unit_test(test_lying_counts),
        cmocka_unit_test(test_binary_orders),
        cmocka_unit_test(test_body_begins_with_line_feed),
        cmocka_unit_test(test_every_type),
        cmocka_unit_test(test_binary_lists),
        cmocka_unit_test(test_truncated),
        cmocka_unit_test(test_colors),
        cmocka_unit_test(test_normals),
        cmocka_unit_test(test_origin),
        cmocka_unit_test(test_arguments),
        cmocka_unit_test(test_write),
        cmocka_unit_test(test_collection),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
