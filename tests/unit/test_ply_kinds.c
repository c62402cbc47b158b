// SPDX-License-Identifier: GPL-3.0-or-later
// What PLY files hold beside plain points: odd types, splats, bytes too many or too few, faces, grids of a scanner.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "files.h"

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
    expect_positions(file, (float[]){ 2, 3, 4 }, 3);
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
    expect_bytes(file, (uint8_t[]){ 128, 199, 56, 255, 0, 255, 0, 255 }, 8);
    patina_file_destroy(file);
    file = open_text(ASCII "element vertex 1\n" XYZ BASE "property uchar red\nproperty uchar green\nproperty uchar blue\n"
                           "end_header\n1 2 3 0 1 -1 7 8 9\n");
    expect_bytes(file, (uint8_t[]){ 7, 8, 9, 255 }, 4);
    assert_int_equal(info_of(file).attributes, 3);
    patina_file_destroy(file);
}

// ---- bytes too many, too few, or other ones -------------------------------------------------------------------------

// What a copy as text makes of bytes. unix2dos leaves carriage returns with their line feeds alone.
static struct blob as_text(const struct blob *b, int leaves_pairs)
{
    struct blob out = { .size = 0 };
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
    uint8_t body[44] = { 1, 10, 0, 13, 10, 7, 10, 10 };
    char header[256];
    for (int kind = 0; kind < 4; kind++) { // a face of 10 corners has a line feed for its count
        snprintf(header, sizeof header, LITTLE "element vertex 2\n" XYZ "%send_header\n", kind & 1 ? faces : "");
        body[24] = 10;
        body[35] = 2;
        struct blob b = blob(header, body, kind & 1 ? 38 : 24), mangled = as_text(&b, kind & 2);
        patina_file_destroy(open_bytes(b.bytes, b.size));
        refuse_bytes(mangled.bytes, mangled.size, PATINA_ERROR_FORMAT, "damaged by being copied as text: each of the");
    }
    snprintf(header, sizeof header, "ply\r\nformat binary_little_endian 1.0\r\nelement vertex 2\r\nproperty float x\r\n"
                                    "property float y\r\nproperty float z\r\nend_header\r\n");
    uint8_t honest[26] = { 1, 13, 10, 0, 13, 10 };
    struct blob b = blob(header, honest, 24);
    patina_file_destroy(open_bytes(b.bytes, b.size)); // its rows end where it does
    honest[24] = 13, honest[25] = 10;
    b = blob(header, (uint8_t[24]){ 1 }, 24);
    memcpy(b.bytes + b.size, honest + 24, 2); // an editor's last line end
    patina_file_destroy(open_bytes(b.bytes, b.size + 2));
}

static void test_too_many_bytes(void **state)
{
    (void)state;
    uint8_t body[24] = { 0 };
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
    static const uint8_t body[] = { 1, 2, 3, 4, 5, 6, 2, 0, 1, 3, 0, 1 };
    struct blob b = blob(LITTLE "element vertex 2\nproperty char x\nproperty char y\nproperty char z\n"
                                "element face 2\nproperty list uchar uchar vertex_indices\nend_header\n",
                         body, sizeof body);
    char words[96];
    empty_log();
    patina_file *file = open_bytes(b.bytes, b.size);
    snprintf(words, sizeof words, "1 (memory): the file ends at byte %zu, inside row 1 of the 2 of element face", b.size);
    expect_log(words);
    expect_positions(file, (float[]){ 1, 2, 3, 4, 5, 6 }, 6);
    patina_file_destroy(file);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bool),
        cmocka_unit_test(test_splat_colors),
        cmocka_unit_test(test_copied_as_text),
        cmocka_unit_test(test_too_many_bytes),
        cmocka_unit_test(test_faces_cut_short),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
