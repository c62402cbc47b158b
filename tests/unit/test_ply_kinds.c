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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bool),
        cmocka_unit_test(test_splat_colors),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
