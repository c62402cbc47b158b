// SPDX-License-Identifier: GPL-3.0-or-later
// Survey drawings: which planes are refused, the tree of places, simplified and clipped lines, and drawings of a box: the same by any number of
// threads, and files that are there whole or not at all.
#include "draw/contour.h"
#include "draw/marching.h"
#include "draw/near.h"
#include "scenes/clouds.h"
#include "scenes/support.h"

#include "folder.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

static const patina_drawing_desc PLAN = {.struct_size = sizeof PLAN,
                                         .origin = {0, 0, 0.1},
                                         .right = {2, 0, 0},
                                         .up = {0.5, 1, 0},
                                         .extent = {3, 2},
                                         .back = 1,
                                         .scale = 20};

static void refuse(patina_drawing_desc desc, const char *said)
{
    patina_drawing *drawing = NULL;
    assert_int_equal(patina_drawing_create(&desc, &drawing), PATINA_ERROR_ARGUMENT);
    assert_null(drawing);
    assert_non_null(strstr(support_message(NULL), said));
}

static void test_planes(void **state)
{
    (void)state;
    patina_drawing_desc desc = PLAN;
    desc.origin[1] = NAN;
    refuse(desc, "must be finite");
    desc = PLAN;
    desc.up[0] = 4;
    desc.up[1] = 0;
    refuse(desc, "parallel");
    desc = PLAN;
    memset(desc.right, 0, sizeof desc.right);
    refuse(desc, "zero");
    desc = PLAN;
    desc.extent[1] = 0;
    refuse(desc, "extent");
    desc = PLAN;
    desc.front = -1;
    refuse(desc, "front");
    desc = PLAN;
    desc.scale = INFINITY;
    refuse(desc, "scale");
    assert_int_equal(patina_drawing_create(NULL, NULL), PATINA_ERROR_ARGUMENT);
    patina_drawing_destroy(NULL);
}

// The tree finds what a loop over all places finds.
static void test_near(void **state)
{
    (void)state;
    enum { COUNT = 3000 };
    static double at[COUNT][2];
    static uint32_t found[COUNT];
    struct pcg random = pcg_seed(3);
    struct pt_near tree;
    for (int i = 0; i < COUNT; i++)
        for (int k = 0; k < 2; k++)
            at[i][k] = i % 7 ? pcg_unit(&random) : 0.25 * (double)(pcg_u32(&random) % 5); // some at one place
    assert_int_equal(pt_near_create(&tree, at, sizeof at[0], COUNT), PATINA_OK);
    for (int i = 0; i < 300; i++) {
        const double place[2] = {pcg_between(&random, -0.2, 1.2), pcg_between(&random, -0.2, 1.2)};
        const double radius = pcg_between(&random, 0.0, 0.3);
        uint32_t wanted = 0;
        for (int k = 0; k < COUNT; k++) {
            const double x = at[k][0] - place[0], y = at[k][1] - place[1];
            wanted += x * x + y * y <= radius * radius;
        }
        const uint32_t count = pt_near_find(&tree, place, radius, found, COUNT);
        assert_int_equal(count, wanted);
        uint64_t seen[(COUNT + 63) / 64] = {0};
        for (uint32_t k = 0; k < count; k++) {
            assert_false(seen[found[k] / 64] >> found[k] % 64 & 1u);
            seen[found[k] / 64] |= (uint64_t)1 << found[k] % 64;
            assert_true(hypot(at[found[k]][0] - place[0], at[found[k]][1] - place[1]) <= radius * (1 + 1e-12));
        }
    }
    pt_near_destroy(&tree);
}

// A circle loses most of its vertices and none of its size; corners stay where they are.
static void test_simplify(void **state)
{
    (void)state;
    const double tolerance = 0.0025;
    struct pt_line circle = {.closed = 1}, corner = {0};
    for (int i = 0; i < 1000; i++)
        assert_int_equal(pt_line_add(&circle, (const double[2]){0.5 * cos(2 * PI * i / 1000), 0.5 * sin(2 * PI * i / 1000)}, 0),
                         0);
    assert_int_equal(pt_line_simplify(&circle, tolerance), PATINA_OK);
    assert_in_range(circle.count, 12, 40);
    double sum = 0, most = 0;
    for (uint32_t i = 0; i < circle.count; i++)
        for (int k = 0; k < 100; k++) {
            const double *a = circle.at[i], *b = circle.at[(i + 1) % circle.count], t = (k + 0.5) / 100;
            const double off = hypot(a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])) - 0.5;
            sum += off;
            most = fmax(most, fabs(off));
        }
    assert_true(most <= tolerance);
    assert_true(fabs(sum / (100 * circle.count)) < 0.05 * tolerance); // chords alone: two thirds of the tolerance
    for (int i = 0; i <= 200; i++) {
        const double at[2] = {i <= 100 ? 0.01 * i : 1, i <= 100 ? 0.0005 * (i % 3) : 0.01 * (i - 100)};
        assert_int_equal(pt_line_add(&corner, at, i == 100), 0);
    }
    assert_int_equal(pt_line_simplify(&corner, tolerance), PATINA_OK);
    assert_int_equal(corner.count, 3);
    assert_true(corner.at[1][0] == 1 && corner.at[1][1] == 0.0005 && corner.fixed[1]);
    pt_line_free(&circle);
    pt_line_free(&corner);
}

static void test_clip(void **state)
{
    (void)state;
    const double half[2] = {1, 0.5}, square[4][2] = {{-2, -0.25}, {2, -0.25}, {2, 0.25}, {-2, 0.25}};
    struct pt_lines lines = {0};
    struct pt_line line = {.closed = 1, .layer = 4}, inside = {0}, outside = {0};
    for (int i = 0; i < 4; i++)
        assert_int_equal(pt_line_add(&line, square[i], 1), 0);
    for (int i = 0; i < 2; i++) {
        assert_int_equal(pt_line_add(&inside, (const double[2]){0.5 * i, 0.1}, 0), 0);
        assert_int_equal(pt_line_add(&outside, (const double[2]){0.5 * i, 0.7}, 0), 0);
    }
    assert_int_equal(pt_lines_add(&lines, &line), 0);
    assert_int_equal(pt_lines_add(&lines, &inside), 0);
    assert_int_equal(pt_lines_add(&lines, &outside), 0);
    assert_int_equal(pt_lines_clip(&lines, half), PATINA_OK);
    assert_int_equal(lines.count, 3);
    double length = 0;
    for (uint32_t i = 0; i < 2; i++) {
        assert_int_equal(lines.at[i].layer, 4);
        assert_false(lines.at[i].closed);
        length += pt_line_length(&lines.at[i]);
    }
    assert_true(fabs(length - 4) < 1e-12);
    pt_lines_free(&lines);
}

// ---- drawings --------------------------------------------------------------------------------------------------------------

static patina_cloud *box_cloud(int analyzed)
{
    struct points points = points_box(40000, (const double[3]){0.5, 0.3, 0.4}, POINTS_PLAIN, 5);
    patina_cloud *cloud = points_upload(&points);
    points_free(&points);
    if (analyzed)
        CHECK(patina_cloud_analyse(cloud, NULL, NULL), cloud);
    return cloud;
}

static double *vertices_of(const patina_drawing *drawing, uint32_t line, patina_drawing_line *about)
{
    *about = (patina_drawing_line){.struct_size = sizeof *about};
    CHECK(patina_drawing_get_line(drawing, line, about), drawing);
    const size_t size = about->vertices * 2 * sizeof(double);
    double *places = malloc(size);
    CHECK(patina_drawing_read_line(drawing, line, places, size), drawing);
    assert_int_equal(patina_drawing_read_line(drawing, line, places, size - 8), PATINA_ERROR_ARGUMENT);
    return places;
}

// One closed line of 1 m by 0.6 m, by any number of threads.
static void test_box(void **state)
{
    (void)state;
    patina_cloud *cloud = box_cloud(1);
    double *first = NULL;
    uint32_t vertices = 0;
    for (uint32_t threads = 1; threads < 4; threads++) {
        const patina_cut_desc cut = {.struct_size = sizeof cut, .threads = threads};
        patina_drawing_info info = {.struct_size = sizeof info};
        patina_drawing_line about;
        patina_drawing *drawing = NULL;
        CHECK(patina_drawing_create(&PLAN, &drawing), NULL);
        for (int twice = 0; twice < 2; twice++) // replaces its lines
            CHECK(patina_drawing_cut(drawing, (const patina_cloud *const *)&cloud, 1, &cut, NULL), drawing);
        CHECK(patina_drawing_get_info(drawing, &info), drawing);
        assert_int_equal(info.lines, 1);
        assert_int_equal(info.layer_lines[PATINA_DRAWING_CUT], 1);
        assert_true(fabs(info.layer_lengths[PATINA_DRAWING_CUT] - 3.2) < 0.01);
        assert_true(info.samples > 1000 && info.spacing > 0.005 && info.spacing < 0.015);
        double *places = vertices_of(drawing, 0, &about);
        assert_true(about.closed && about.layer == PATINA_DRAWING_CUT);
        assert_int_equal(patina_drawing_get_line(drawing, 1, &about), PATINA_ERROR_ARGUMENT);
        if (first) {
            assert_int_equal(about.vertices, vertices);
            assert_memory_equal(places, first, vertices * 2 * sizeof *places);
            free(places);
        } else {
            first = places;
            vertices = about.vertices;
        }
        patina_drawing_destroy(drawing);
    }
    for (uint32_t i = 0; i < vertices; i++) // on the box's sides
        assert_true(fmin(fabs(fabs(first[2 * i]) - 0.5), fabs(fabs(first[2 * i + 1]) - 0.3)) < 0.002);
    free(first);
    patina_cloud_destroy(cloud);
}

static void test_nothing_there(void **state)
{
    (void)state;
    patina_cloud *cloud = box_cloud(1), *raw = box_cloud(0);
    patina_drawing_info info = {.struct_size = sizeof info};
    patina_drawing *drawing = NULL, *above = NULL;
    patina_drawing_desc desc = PLAN;
    desc.origin[2] = 2;
    CHECK(patina_drawing_create(&PLAN, &drawing), NULL);
    CHECK(patina_drawing_create(&desc, &above), NULL);
    CHECK(patina_drawing_cut(drawing, (const patina_cloud *const *)&cloud, 1, NULL, NULL), drawing);
    assert_int_equal(patina_drawing_cut(drawing, (const patina_cloud *const *)&raw, 1, NULL, NULL), PATINA_ERROR_EMPTY);
    assert_non_null(strstr(support_message(drawing), "not analyzed"));
    assert_int_equal(patina_drawing_cut(drawing, NULL, 0, NULL, NULL), PATINA_ERROR_EMPTY);
    assert_int_equal(patina_drawing_cut(drawing, NULL, 1, NULL, NULL), PATINA_ERROR_ARGUMENT);
    CHECK(patina_drawing_get_info(drawing, &info), drawing); // lines stay as they were
    assert_int_equal(info.lines, 1);
    assert_int_equal(patina_drawing_cut(above, (const patina_cloud *const *)&cloud, 1, NULL, NULL), PATINA_ERROR_EMPTY);
    assert_non_null(strstr(support_message(above), "meets no surface"));
    const patina_cut_desc bad = {.struct_size = sizeof bad, .thickness = NAN};
    assert_int_equal(patina_drawing_cut(drawing, (const patina_cloud *const *)&cloud, 1, &bad, NULL), PATINA_ERROR_ARGUMENT);
    patina_drawing_destroy(drawing);
    patina_drawing_destroy(above);
    patina_cloud_destroy(cloud);
    patina_cloud_destroy(raw);
}

// A cloud that is turned, mirrored, doubled and far away has the lines of the same cloud at zero, at their place; one that hides its points has none.
static void test_placed(void **state)
{
    (void)state;
    const double far[3] = {5432100.25, 4987654.5, 321.5};
    const double places[16] = {0, -2, 0, far[0], 2, 0, 0, far[1], 0, 0, -2, far[2], 0, 0, 0, 1};
    patina_cloud *cloud = box_cloud(1);
    patina_cloud_info of = {.struct_size = sizeof of};
    patina_drawing *here = NULL, *there = NULL;
    patina_drawing_desc desc = PLAN;
    for (int i = 0; i < 3; i++) { // what the matrix makes of the plane
        double right = 0, up = 0, origin = far[i];
        for (int k = 0; k < 3; k++) {
            right += places[4 * i + k] * PLAN.right[k];
            up += places[4 * i + k] * PLAN.up[k];
            origin += places[4 * i + k] * PLAN.origin[k];
        }
        desc.right[i] = right;
        desc.up[i] = up;
        desc.origin[i] = origin;
    }
    desc.extent[0] *= 2;
    desc.extent[1] *= 2;
    desc.scale = 2 * PLAN.scale;
    patina_cut_desc cut = {.struct_size = sizeof cut, .places = places};
    CHECK(patina_cloud_get_info(cloud, &of), cloud);
    CHECK(patina_drawing_create(&PLAN, &here), NULL);
    CHECK(patina_drawing_create(&desc, &there), NULL);
    CHECK(patina_drawing_cut(here, (const patina_cloud *const *)&cloud, 1, NULL, NULL), here);
    CHECK(patina_drawing_cut(there, (const patina_cloud *const *)&cloud, 1, &cut, NULL), there);
    patina_drawing_info a = {.struct_size = sizeof a}, b = {.struct_size = sizeof b};
    CHECK(patina_drawing_get_info(here, &a), here);
    CHECK(patina_drawing_get_info(there, &b), there);
    assert_true(a.samples == b.samples && a.lines == 1 && b.lines == 1);
    assert_float_equal(b.spacing, 2 * a.spacing, 1e-7);
    assert_float_equal(b.layer_lengths[0], 2 * a.layer_lengths[0], 1e-5);
    uint8_t *bits = calloc(1, (size_t)(of.count + 7) / 8);
    assert_non_null(bits);
    const uint8_t *const shown[] = {bits};
    cut.shown = shown;
    assert_int_equal(patina_drawing_cut(there, (const patina_cloud *const *)&cloud, 1, &cut, NULL), PATINA_ERROR_EMPTY);
    const double flat[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 1};
    cut.places = flat;
    assert_int_equal(patina_drawing_cut(there, (const patina_cloud *const *)&cloud, 1, &cut, NULL), PATINA_ERROR_ARGUMENT);
    assert_non_null(strstr(support_message(there), "scale all axes alike"));
    free(bits);
    patina_drawing_destroy(here);
    patina_drawing_destroy(there);
    patina_cloud_destroy(cloud);
}

static void test_files(void **state)
{
    (void)state;
    char folder[] = "/tmp/patina_drawing_XXXXXX", path[64], other[64];
    patina_cloud *cloud = box_cloud(1);
    patina_drawing *drawing = NULL;
    assert_int_equal(make_folder_of(folder), 0);
    CHECK(patina_drawing_create(&PLAN, &drawing), NULL);
    CHECK(patina_drawing_cut(drawing, (const patina_cloud *const *)&cloud, 1, NULL, NULL), drawing);
    static const char *const names[] = {"a.dxf", "b.SVG"};
    for (int i = 0; i < 2; i++) {
        snprintf(path, sizeof path, "%s/%s", folder, names[i]);
        CHECK(patina_drawing_write(drawing, path, 1), drawing);
        size_t size;
        char *text = bytes_of(path, &size);
        text[size] = 0;
        assert_non_null(strstr(text, i ? "</svg>\n" : "  0\nEOF\n"));
        assert_non_null(strstr(text, i ? "width=\"150mm\" height=\"100mm\" viewBox=\"0 0 150 100\"" : "  1\nAC1032\n"));
        free(text);
    }
    snprintf(path, sizeof path, "%s/c.pdf", folder);
    assert_int_equal(patina_drawing_write(drawing, path, 0), PATINA_ERROR_UNSUPPORTED);
    assert_non_null(strstr(support_message(drawing), ".dxf, .svg or .geojson"));
    snprintf(path, sizeof path, "%s/c.geojson", folder);
    assert_int_equal(patina_drawing_write(drawing, path, 0), PATINA_ERROR_UNSUPPORTED);
    assert_non_null(strstr(support_message(drawing), "needs the coordinate system"));
    snprintf(other, sizeof other, "%s/no/c.dxf", folder);
    assert_int_equal(patina_drawing_write(drawing, other, 0), PATINA_ERROR_FILE);
    assert_non_null(strstr(support_message(drawing), "cannot be written"));
    assert_false(is_there(path));
    for (int i = 0; i < 2; i++) {
        snprintf(path, sizeof path, "%s/%s", folder, names[i]);
        assert_int_equal(pt_file_remove(path), 0);
    }
    assert_int_equal(rmdir(folder), 0); // nothing was left beside the files
    patina_drawing_destroy(drawing);
    patina_cloud_destroy(cloud);
}

// ---- contours --------------------------------------------------------------------------------------------------------------

// The contours of a cone on a grid are circles; where heights are not known, they are open.
static void test_grid(void **state)
{
    (void)state;
    enum { SIDE = 101 };
    static double values[SIDE * SIDE];
    for (int hole = 0; hole < 2; hole++) {
        struct pt_lines lines = {0};
        for (int i = 0; i < SIDE * SIDE; i++) {
            const double x = 0.1 * (i % SIDE - 50), y = 0.1 * (i / SIDE - 50);
            values[i] = hole && fabs(y) < 0.15 && x > 0 ? NAN : 4 - sqrt(x * x + y * y);
        }
        const struct pt_height_grid grid = {.width = SIDE, .height = SIDE, .low = {-5, -5}, .cell = 0.1, .values = values};
        assert_int_equal(pt_contour_grid(&grid, 1.5, 7, &lines), PATINA_OK);
        assert_int_equal(lines.count, 1);
        const struct pt_line *line = &lines.at[0];
        assert_int_equal(line->closed, !hole);
        assert_int_equal(line->layer, 7);
        double area = 0;
        for (uint32_t i = 0; i < line->count; i++) {
            const double *a = line->at[i], *b = line->at[(i + 1) % line->count];
            area += 0.5 * (a[0] * b[1] - a[1] * b[0]);
            assert_true(fabs(hypot(a[0], a[1]) - 2.5) < 0.002);
        }
        assert_true(hole || fabs(area - PI * 2.5 * 2.5) < 0.02); // counterclockwise: greater heights on the left
        pt_lines_free(&lines);
    }
}

// A hill with noise of 2 cm, and a roof of 20 cm over a part of it: contours are circles of known radii, and go on below the roof.
static void test_hill(void **state)
{
    (void)state;
    enum { GROUND = 60000, ROOF = 3000 };
    static double at[GROUND + ROOF][3];
    struct pcg random = pcg_seed(9);
    for (int i = 0; i < GROUND + ROOF; i++) {
        const double x = i < GROUND ? pcg_between(&random, -10, 10) : pcg_between(&random, 3, 7);
        const double y = i < GROUND ? pcg_between(&random, -10, 10) : pcg_between(&random, -2, 2);
        double noise = 0;
        for (int k = 0; k < 12; k++)
            noise += pcg_between(&random, -0.5, 0.5);
        at[i][0] = 4400000 + x;
        at[i][1] = 5300000 + y;
        at[i][2] = i < GROUND ? 500 + 5 * exp(-(x * x + y * y) / 50) + 0.02 * noise : 508;
    }
    const patina_cloud_desc points = {.struct_size = sizeof points,
                                      .count = GROUND + ROOF,
                                      .position = {.data = at, .type = PATINA_FLOAT64, .components = 3}};
    const patina_drawing_desc plan = {.struct_size = sizeof plan,
                                      .origin = {4400000, 5300000, 520},
                                      .right = {1, 0, 0},
                                      .up = {0, 1, 0},
                                      .extent = {16, 16},
                                      .back = 100,
                                      .scale = 200};
    const patina_contour_desc desc = {.struct_size = sizeof desc, .interval = 0.5}, bad = {.struct_size = sizeof bad};
    patina_drawing_info info = {.struct_size = sizeof info};
    patina_cloud *cloud = NULL;
    patina_drawing *drawing = NULL;
    CHECK(patina_cloud_create(&points, NULL, &cloud), NULL);
    CHECK(patina_cloud_analyse(cloud, NULL, NULL), cloud);
    CHECK(patina_drawing_create(&plan, &drawing), NULL);
    assert_int_equal(patina_drawing_contour(drawing, (const patina_cloud *const *)&cloud, 1, &bad, NULL),
                     PATINA_ERROR_ARGUMENT);
    CHECK(patina_drawing_contour(drawing, (const patina_cloud *const *)&cloud, 1, &desc, NULL), drawing);
    CHECK(patina_drawing_get_info(drawing, &info), drawing);
    double sum = 0, square = 0, most = 0;
    uint32_t count = 0;
    for (uint32_t i = 0; i < info.lines; i++) {
        patina_drawing_line about;
        double *places = vertices_of(drawing, i, &about);
        for (uint32_t k = 0; k < about.vertices; k++) {
            const double r = hypot(places[2 * k], places[2 * k + 1]), h = 5 * exp(-r * r / 50);
            const double off = h - 0.5 * round(h / 0.5); // height from the nearest level
            sum += off;
            square += off * off;
            most = fmax(most, fabs(off));
            count++;
            const int index = fabs(h - 2.5) < 0.2 || h < 0.2 || h > 4.8;
            assert_int_equal(about.layer, index ? PATINA_DRAWING_CONTOUR_INDEX : PATINA_DRAWING_CONTOUR);
        }
        free(places);
    }
    printf("contours: %u lines, %u vertices, heights: bias %.1f mm, rms %.1f mm, at most %.1f mm off\n", info.lines, count,
           1e3 * sum / count, 1e3 * sqrt(square / count), 1e3 * most);
    assert_int_equal(info.layer_lines[PATINA_DRAWING_CONTOUR],
                     14); // six circles, and four arcs each of 500.5 and 501 in the corners
    assert_int_equal(info.layer_lines[PATINA_DRAWING_CONTOUR_INDEX], 1); // 502.5; 505 is the top, and 500 is beyond the extent
    assert_true(fabs(sum / count) < 0.005 && sqrt(square / count) < 0.02 && most < 0.1);
    assert_true(fabs(info.layer_lengths[PATINA_DRAWING_CONTOUR_INDEX] - 2 * PI * sqrt(50 * log(2))) < 0.5);
    patina_drawing_destroy(drawing);
    patina_cloud_destroy(cloud);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_planes), cmocka_unit_test(test_near),          cmocka_unit_test(test_simplify),
        cmocka_unit_test(test_clip),   cmocka_unit_test(test_box),           cmocka_unit_test(test_placed),
        cmocka_unit_test(test_files),  cmocka_unit_test(test_nothing_there), cmocka_unit_test(test_grid),
        cmocka_unit_test(test_hill),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
