// SPDX-License-Identifier: GPL-3.0-or-later
// A few points of a cloud: each one of the cloud's, with its own values, evenly chosen, of clouds of several chunks and small ones.
#include "scenes/clouds.h"
#include "scenes/support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { POINTS = 20000 };

static const uint64_t rooms[] = {0, 1, 7, 500, 3333, POINTS - 1, POINTS, 3 * POINTS};

// A torus whose scalar is the point's number.
static patina_cloud *make(struct points *points, float *numbers)
{
    patina_cloud *cloud = NULL;
    *points = points_torus(POINTS, 1.0, 0.4, POINTS_ALL, 5);
    patina_cloud_desc desc = points_desc(points);
    for (uint32_t i = 0; i < POINTS; i++)
        numbers[i] = (float)i;
    desc.scalar = (patina_array){numbers, PATINA_FLOAT32, 1, 0};
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    return cloud;
}

static void test_thin(void **state)
{
    (void)state;
    struct points points;
    float *numbers = malloc(POINTS * sizeof *numbers), *found = malloc(3 * 4 * (size_t)POINTS * 10 * sizeof *found);
    uint8_t *taken = malloc(POINTS);
    assert_true(numbers && found && taken);
    patina_cloud *cloud = make(&points, numbers);
    for (size_t r = 0; r < sizeof rooms / sizeof *rooms; r++) {
        const uint64_t room = rooms[r], wanted = room < POINTS ? room : POINTS;
        float *positions = found, *colors = positions + 3 * room, *normals = colors + 3 * room, *scalars = normals + 3 * room;
        uint64_t count = 12345, right = 0;
        memset(taken, 0, POINTS);
        CHECK(patina_cloud_thin(cloud, NULL, 0, room, positions, colors, normals, scalars, &count), cloud);
        assert_int_equal(count, wanted);
        for (uint64_t i = 0; i < count; i++) {
            const uint32_t number = (uint32_t)scalars[i];
            double off = 0.0, dot = 0.0;
            assert_true(number < POINTS && !taken[number]);
            taken[number] = 1;
            for (int k = 0; k < 3; k++) {
                off = fmax(off,
                           fabs((double)positions[3 * i + (uint64_t)k] - (double)points.position[3 * number + (uint32_t)k]));
                dot += (double)normals[3 * i + (uint64_t)k] * (double)points.normal[3 * number + (uint32_t)k];
            }
            assert_true(off < 1e-5 && dot > 0.999);
            assert_true(colors[3 * i] >= 0.0f && colors[3 * i] <= 1.0f);
            right += positions[3 * i] > 0.0f;
        }
        if (room == 500) // half of the torus, within four deviations of a binomial
            assert_true(right > 205 && right < 295);
    }
    free(found);
    free(taken);
    free(numbers);
    points_free(&points);
    patina_cloud_destroy(cloud);
}

// Points that are hidden never come; of the others as many as there is room for, within four deviations, and all if they have room.
static void test_hidden(void **state)
{
    (void)state;
    struct points points;
    float *numbers = malloc(POINTS * sizeof *numbers), *positions = malloc(4 * (size_t)POINTS * sizeof *positions);
    float *scalars = positions + 3 * (size_t)POINTS;
    uint8_t *hidden = calloc(1, POINTS / 8);
    assert_true(numbers && positions && hidden);
    patina_cloud *cloud = make(&points, numbers);
    uint32_t shown = 0;
    for (uint32_t i = 0; i < POINTS; i++) {
        const int hides = points.position[3 * i] < 0.6f;
        hidden[i / 8] |= (uint8_t)(hides << i % 8);
        shown += !hides;
    }
    assert_true(shown > POINTS / 10 && shown < POINTS / 2);
    for (uint64_t room = 500; room <= POINTS; room += POINTS - 500) {
        uint64_t count = 0;
        CHECK(patina_cloud_thin(cloud, hidden, POINTS / 8, room, positions, NULL, NULL, scalars, &count), cloud);
        if (room == POINTS)
            assert_int_equal(count, shown);
        else
            assert_true(count <= room && count > room - 90);
        for (uint64_t i = 0; i < count; i++)
            assert_true(points.position[3 * (uint32_t)scalars[i]] >= 0.6f);
    }
    uint64_t count = 0;
    assert_int_equal(patina_cloud_thin(cloud, hidden, POINTS / 8 - 1, 1, positions, NULL, NULL, NULL, &count),
                     PATINA_ERROR_ARGUMENT);
    memset(hidden, 255, POINTS / 8);
    CHECK(patina_cloud_thin(cloud, hidden, POINTS / 8, 500, positions, NULL, NULL, NULL, &count), cloud);
    assert_int_equal(count, 0);
    free(numbers);
    free(positions);
    free(hidden);
    points_free(&points);
    patina_cloud_destroy(cloud);
}

static void test_refusals(void **state)
{
    (void)state;
    struct points points;
    float *numbers = malloc(POINTS * sizeof *numbers), place[3];
    const double offset[3] = {0};
    uint64_t count = 0;
    patina_task *task = NULL;
    assert_non_null(numbers);
    patina_cloud *cloud = make(&points, numbers);
    assert_int_equal(patina_cloud_thin(NULL, NULL, 0, 1, place, NULL, NULL, NULL, &count), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_cloud_thin(cloud, NULL, 0, 1, NULL, NULL, NULL, NULL, &count), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_cloud_thin(cloud, NULL, 0, 1, place, NULL, NULL, NULL, NULL), PATINA_ERROR_ARGUMENT);
    CHECK(patina_cloud_thin(cloud, NULL, 0, 1, place, NULL, NULL, NULL, &count), cloud);
    assert_int_equal(count, 1);
    assert_int_equal(patina_task_thin("there/is/none.cloud", NULL, NULL, 0, 1, place, NULL, NULL, NULL, &count, &task),
                     PATINA_ERROR_ARGUMENT);
    CHECK(patina_task_thin("there/is/none.cloud", offset, NULL, 0, 1, place, NULL, NULL, NULL, &count, &task), NULL);
    assert_int_equal(patina_task_wait(task), PATINA_ERROR_FILE);
    patina_task_destroy(task);
    free(numbers);
    points_free(&points);
    patina_cloud_destroy(cloud);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_thin), cmocka_unit_test(test_hidden),
                                       cmocka_unit_test(test_refusals)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
