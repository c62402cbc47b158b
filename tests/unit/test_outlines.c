// SPDX-License-Identifier: GPL-3.0-or-later
// Outlines of planes of distances that are known in closed form: what is an outline and what is not, the depth of its vertices, and how it is
// written.
#include "scenes/support.h"

#include "folder.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 200, HEIGHT = 150 };
#define PIXEL 0.005
#define SPACING 0.006

static const patina_drawing_desc ELEVATION = {.struct_size = sizeof ELEVATION,
                                              .origin = {100, 200, 5},
                                              .right = {1, 0, 0},
                                              .up = {0, 0, 1},
                                              .extent = {WIDTH * PIXEL, HEIGHT *PIXEL},
                                              .back = 2,
                                              .scale = 20};

static float depths[WIDTH * HEIGHT];

static patina_outline_desc describe(void)
{
    return (patina_outline_desc){.struct_size = sizeof(patina_outline_desc),
                                 .depth = depths,
                                 .width = WIDTH,
                                 .height = HEIGHT,
                                 .pixel = PIXEL,
                                 .spacing = SPACING};
}

static patina_drawing *outline(patina_drawing_info *info)
{
    const patina_outline_desc desc = describe();
    patina_drawing *drawing = NULL;
    *info = (patina_drawing_info){.struct_size = sizeof *info};
    CHECK(patina_drawing_create(&ELEVATION, &drawing), NULL);
    CHECK(patina_drawing_outline(drawing, &desc), drawing);
    CHECK(patina_drawing_get_info(drawing, info), drawing);
    return drawing;
}

// A board from pixel (50, 40) to (130, 110), one meter before the plane of the wall at its middle; slope: how it leans, per meter of height.
static void set_board(double slope)
{
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            const int on = x >= 50 && x < 130 && y >= 40 && y < 110;
            depths[y * WIDTH + x] = (float)(on ? -0.5 + slope * PIXEL * (y + 0.5 - 75) : -1.5);
        }
}

// The whole rectangle, and nothing else; the depth of the nearer surface at each vertex.
static void test_board(void **state)
{
    (void)state;
    for (int lean = 0; lean < 2; lean++) {
        const double slope = 0.6 * lean;
        patina_drawing_info info;
        set_board(slope);
        patina_drawing *drawing = outline(&info);
        assert_int_equal(info.lines, 1);
        assert_true(fabs(info.layer_lengths[PATINA_DRAWING_OUTLINE] - 2 * (80 + 70) * PIXEL) < 4 * PIXEL);
        patina_drawing_line line = {.struct_size = sizeof line};
        CHECK(patina_drawing_get_line(drawing, 0, &line), drawing);
        assert_true(line.closed && line.layer == PATINA_DRAWING_OUTLINE);
        double places[64][2], away[64];
        assert_in_range(line.vertices, 4, 64);
        CHECK(patina_drawing_read_line(drawing, 0, places[0], line.vertices * sizeof *places), drawing);
        CHECK(patina_drawing_read_depths(drawing, 0, away, line.vertices * sizeof *away), drawing);
        assert_int_equal(patina_drawing_read_depths(drawing, 0, away, 1), PATINA_ERROR_ARGUMENT);
        assert_int_equal(patina_drawing_read_depths(drawing, 1, away, sizeof away), PATINA_ERROR_ARGUMENT);
        for (uint32_t i = 0; i < line.vertices; i++) {
            const double x = fabs(places[i][0] + 10 * PIXEL) - 40 * PIXEL, y = fabs(places[i][1]) - 35 * PIXEL;
            assert_true(fabs(fmax(x, y)) <= PIXEL);
            assert_true(fabs(away[i] - (-0.5 + slope * places[i][1])) <= SPACING + slope * PIXEL);
        }
        patina_drawing_destroy(drawing);
    }
}

// Steps that a steep surface explains are no outlines, nor are those of noise, of single wrong pixels, or of the image's border.
static void test_nothing(void **state)
{
    (void)state;
    patina_drawing_info info;
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            const int stray = x % 20 == 7 && y % 20 == 7;
            depths[y * WIDTH + x] = (float)(-0.03 * (x - x % 3) + 0.002 * ((x * 7 + y * 13) % 5 - 2) + 0.3 * stray);
        }
    patina_drawing_destroy(outline(&info));
    assert_int_equal(info.lines, 0);
}

// A hole in a surface is open; what no measured pixel supports is no part of the surface.
static void test_support(void **state)
{
    (void)state;
    static uint8_t measured[WIDTH * HEIGHT];
    patina_outline_desc desc = describe();
    patina_drawing *drawing = NULL;
    patina_drawing_info info = {.struct_size = sizeof info};
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            depths[y * WIDTH + x] = x >= 50 && x < 130 ? -0.5f : NAN;
            measured[y * WIDTH + x] = x >= 53 && x < 128;
        }
    desc.measured = measured;
    CHECK(patina_drawing_create(&ELEVATION, &drawing), NULL);
    CHECK(patina_drawing_outline(drawing, &desc), drawing);
    CHECK(patina_drawing_get_info(drawing, &info), drawing);
    assert_int_equal(info.lines, 2);
    for (uint32_t i = 0; i < 2; i++) {
        double places[2][2];
        CHECK(patina_drawing_read_line(drawing, i, places[0], sizeof places), drawing);
        const double x = places[0][0] / PIXEL + 100; // one pixel supports its neighbors
        assert_true(fabs(x - 52) < 0.01 || fabs(x - 129) < 0.01);
        assert_true(fabs(places[1][0] - places[0][0]) < 1e-9 && fabs(places[1][1] - places[0][1]) > (HEIGHT - 2) * PIXEL);
    }
    patina_drawing_destroy(drawing);
}

static uint32_t count(const char *text, const char *word)
{
    uint32_t found = 0;
    for (const char *at = text; (at = strstr(at, word)); at += strlen(word))
        found++;
    return found;
}

// DXF: one distance makes a LWPOLYLINE, several a POLYLINE; flat drawings have LWPOLYLINE entities only.
static void test_files(void **state)
{
    (void)state;
    char folder[] = "/tmp/patina_outlines_XXXXXX";
    assert_int_equal(make_folder_of(folder), 0);
    for (int kind = 0; kind < 3; kind++) { // upright, leaning, leaning and flat
        char path[64];
        size_t size;
        patina_drawing_info info;
        set_board(kind ? 0.6 : 0.0);
        patina_drawing *drawing = outline(&info);
        patina_drawing_line line = {.struct_size = sizeof line};
        CHECK(patina_drawing_get_line(drawing, 0, &line), drawing);
        snprintf(path, sizeof path, "%s/outlines.dxf", folder);
        CHECK(patina_drawing_write(drawing, path, kind == 2), drawing);
        char *text = bytes_of(path, &size);
        text[size] = 0;
        assert_int_equal(remove(path), 0);
        assert_int_equal(count(text, "\nLWPOLYLINE\n"), kind != 1);
        assert_int_equal(count(text, "\nPOLYLINE\n"), kind == 1);
        assert_int_equal(count(text, "\nVERTEX\n"), kind == 1 ? line.vertices : 0);
        assert_int_equal(count(text, "\nSEQEND\n"), kind == 1);
        free(text);
        patina_drawing_destroy(drawing);
    }
    assert_int_equal(rmdir(folder), 0);
}

static void test_refused(void **state)
{
    (void)state;
    patina_drawing *drawing = NULL;
    patina_outline_desc desc = describe();
    CHECK(patina_drawing_create(&ELEVATION, &drawing), NULL);
    assert_int_equal(patina_drawing_outline(NULL, &desc), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_drawing_outline(drawing, NULL), PATINA_ERROR_ARGUMENT);
    desc.width = PATINA_OUTLINE_SIZE + 1;
    assert_int_equal(patina_drawing_outline(drawing, &desc), PATINA_ERROR_ARGUMENT);
    assert_non_null(strstr(support_message(drawing), "width and height"));
    desc = describe();
    desc.spacing = NAN;
    assert_int_equal(patina_drawing_outline(drawing, &desc), PATINA_ERROR_ARGUMENT);
    assert_non_null(strstr(support_message(drawing), "spacing must be above 0"));
    patina_drawing_destroy(drawing);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_board), cmocka_unit_test(test_nothing),
                                       cmocka_unit_test(test_support), cmocka_unit_test(test_files),
                                       cmocka_unit_test(test_refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
