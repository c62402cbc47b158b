// SPDX-License-Identifier: GPL-3.0-or-later
// The nearest depths around pixels, as a loop over all of them finds them.
#include "patina/patina.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

static float nearest_at(const float *depths, int width, int height, int x, int y)
{
    float nearest = INFINITY;
    for (int b = y - 2; b <= y + 2; b++)
        for (int a = x - 2; a <= x + 2; a++)
            if (a >= 0 && b >= 0 && a < width && b < height)
                nearest = fminf(nearest, depths[b * width + a]);
    return nearest;
}

static void test_nearest(void **state)
{
    static const int sizes[][2] = {{1, 1}, {2, 7}, {7, 2}, {3, 3}, {64, 5}, {101, 67}};
    (void)state;
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        const int width = sizes[i][0], height = sizes[i][1];
        const size_t size = (size_t)width * (size_t)height * sizeof(float);
        float *depths = malloc(size), *found = malloc(size);
        assert_true(depths && found);
        for (int k = 0; k < width * height; k++) {
            const uint32_t random = (uint32_t)k * 2654435761u >> 8;
            depths[k] = random % 3 ? (float)random : INFINITY;
        }
        assert_int_equal(patina_nearest_depths(depths, (uint32_t)width, (uint32_t)height, found, size), PATINA_OK);
        for (int y = 0; y < height; y++)
            for (int x = 0; x < width; x++)
                assert_true(found[y * width + x] == nearest_at(depths, width, height, x, y));
        assert_int_equal(patina_nearest_depths(depths, (uint32_t)width, (uint32_t)height, found, size + 4),
                         PATINA_ERROR_ARGUMENT);
        assert_int_equal(patina_nearest_depths(depths, (uint32_t)width, (uint32_t)height, depths, size), PATINA_ERROR_ARGUMENT);
        free(depths);
        free(found);
    }
    assert_int_equal(patina_nearest_depths(NULL, 0, 0, NULL, 0), PATINA_ERROR_ARGUMENT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_nearest)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
