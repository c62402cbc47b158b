// SPDX-License-Identifier: GPL-3.0-or-later
// What scanners' grids tell: normals that neighbours in space would mix, and borders exactly where depth steps or nothing came back.
#include "shared/words.h"
#include "scene/analysis/analysis.h"
#include "scenes/support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { COLUMNS = 90, ROWS = 60, MOST = 2 * COLUMNS * ROWS };

// A scan of a board before a wall that leans back; station: of a scanner, or of beams along +y.
struct scan {
    double position[MOST][3];
    uint16_t row[MOST], column[MOST];
    uint8_t board[MOST], of[MOST];
    uint32_t count;
};

enum { FIRST = 30, LAST = 59, LOW = 20, HIGH = 39 }; // cells of the board, both included
static const double station[3] = {2.0, -1.0, 0.5}, step = 0.004, lean = 0.6;

static int on_board(int column, int row) { return column >= FIRST && column <= LAST && row >= LOW && row <= HIGH; }

static double noise_of(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (*state >> 8) / 16777216.0 - 0.5;
}

// hole: a cell that did not come back; gap: so many columns of the wall from column 70 on did not.
static struct scan *take(int parallel, double noise, int gap)
{
    struct scan *scan = calloc(1, sizeof *scan);
    uint32_t state = 7;
    assert_non_null(scan);
    for (int column = 0; column < COLUMNS; column++)
        for (int row = 0; row < ROWS; row++) {
            const double a = step * (column - COLUMNS / 2), e = step * (row - ROWS / 2), range = 5.0;
            const int board = on_board(column, row);
            double way[3] = {sin(a) * cos(e), cos(a) * cos(e), sin(e)}, from[3] = {station[0], station[1], station[2]};
            if (parallel) {
                from[0] += range * a;
                from[2] += range * e;
                way[0] = way[2] = 0.0;
                way[1] = 1.0;
            }
            if ((column >= 70 && column < 70 + gap) || (column == 10 && row == 30))
                continue;
            // the board: y = 3; the wall: y + lean x = 6
            double t = board ? (3.0 - from[1]) / way[1] : (6.0 - from[1] - lean * from[0]) / (way[1] + lean * way[0]);
            t += noise * noise_of(&state);
            for (int k = 0; k < 3; k++)
                scan->position[scan->count][k] = from[k] + t * way[k];
            scan->column[scan->count] = (uint16_t)column;
            scan->row[scan->count] = (uint16_t)row;
            scan->board[scan->count++] = (uint8_t)board;
        }
    return scan;
}

struct known {
    float normal[3 * MOST], half_axes[2 * MOST];
    uint8_t kind[MOST];
};

static void analyse(const struct scan *scan, const patina_analysis_desc *how, struct known *out)
{
    patina_cloud *cloud = NULL;
    const patina_cloud_desc desc = {
        .struct_size = sizeof desc, .count = scan->count, .position = {scan->position, PATINA_FLOAT64, 3, 0}};
    const patina_neighbourhoods wanted = {
        .struct_size = sizeof wanted, .normal = out->normal, .half_axes = out->half_axes, .kind = out->kind};
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    CHECK(patina_cloud_analyse(cloud, how, NULL), cloud);
    CHECK(patina_cloud_neighbourhoods(cloud, &wanted, NULL), cloud);
    patina_cloud_destroy(cloud);
}

static patina_analysis_desc by_grid(const struct scan *scan, int parallel)
{
    static const double ways[3] = {0.0, 2.0, 0.0};
    return (patina_analysis_desc){.struct_size = sizeof(patina_analysis_desc),
                                  .grid = 1,
                                  .row = {scan->row, PATINA_UINT16, 1, 0},
                                  .column = {scan->column, PATINA_UINT16, 1, 0},
                                  .station_count = !parallel,
                                  .stations = parallel ? NULL : station,
                                  .direction_count = (uint32_t)parallel,
                                  .directions = parallel ? ways : NULL};
}

static double angle_of(const struct scan *scan, const struct known *known, uint32_t i)
{
    const double wall = sqrt(1.0 + lean * lean);
    const double truth[3] = {scan->board[i] ? 0.0 : -lean / wall, scan->board[i] ? -1.0 : -1.0 / wall, 0.0};
    double cosine = 0.0;
    for (uint32_t k = 0; k < 3; k++)
        cosine += truth[k] * (double)known->normal[3 * i + k]; // towards the scanner, too
    return acos(fmax(fmin(cosine, 1.0), -1.0)) * 57.29577951308232;
}

// Cells beside which the surface ends: the board's rim, and the wall's beside the gap. Behind the board, and at the grid's edge, nobody
// knows.
static int ends_at(int column, int row, int gap)
{
    if (on_board(column, row))
        return column == FIRST || column == LAST || row == LOW || row == HIGH;
    return gap > 1 && (column == 69 || column == 70 + gap);
}

static void test_normals_and_borders(void **state)
{
    static struct known known;
    (void)state;
    for (int k = 0; k < 8; k++) {
        const int parallel = k & 1, gap = k & 2 ? 3 : 1; // one column that did not come back is no border
        const double noise = k & 4 ? 0.004 : 0.0;        // of a cell of 0.016 to 0.03
        struct scan *scan = take(parallel, noise, gap);
        const patina_analysis_desc how = by_grid(scan, parallel);
        analyse(scan, &how, &known);
        double most = 0.0, sum = 0.0;
        uint32_t wrong = 0, borders = 0;
        for (uint32_t i = 0; i < scan->count; i++) {
            const int column = scan->column[i], row = scan->row[i];
            const double angle = angle_of(scan, &known, i);
            most = fmax(most, angle);
            sum += angle;
            if (column < 2 || column > COLUMNS - 3 || row < 2 || row > ROWS - 3)
                continue;
            const int behind = !on_board(column, row) && on_board(column < FIRST  ? column + 1
                                                                  : column > LAST ? column - 1
                                                                                  : column,
                                                                  row < LOW    ? row + 1
                                                                  : row > HIGH ? row - 1
                                                                               : row);
            const int border = known.kind[i] == PATINA_KIND_BORDER, wanted = ends_at(column, row, gap);
            borders += wanted != 0;
            wrong += !behind && border != wanted;
        }
        print_message("  %s, noise %.3f, gap of %d: normals %.2f degrees off in the mean, %.2f at most; %u borders, %u wrong\n",
                      parallel ? "parallel" : "station", noise, gap, sum / scan->count, most, borders, wrong);
        assert_true(borders > 90 && wrong == 0);
        assert_true(noise > 0.0 ? sum / scan->count < 4.0 : most < 0.5);
        free(scan);
    }
}

// A second scan of the same wall closes in space what the first saw past: footprints of the first end all the same. Without the grid
// they do not.
static void test_two_scans(void **state)
{
    static struct known with, without;
    (void)state;
    struct scan *scan = take(0, 0.0, 3), *other = take(0, 0.0, 0);
    static const double places[6] = {2.0, -1.0, 0.5, 2.0, -1.0, 0.5};
    for (uint32_t i = 0; i < other->count; i++) {
        for (int k = 0; k < 3; k++)
            scan->position[scan->count][k] = other->position[i][k] + (k == 0 ? 0.003 : 0.0);
        scan->row[scan->count] = other->row[i];
        scan->column[scan->count] = other->column[i];
        scan->board[scan->count] = other->board[i];
        scan->of[scan->count++] = 1;
    }
    patina_analysis_desc how = by_grid(scan, 0);
    how.scan = (patina_array){scan->of, PATINA_UINT8, 1, 0};
    how.station = how.scan;
    how.station_count = 2;
    how.stations = places;
    analyse(scan, &how, &with);
    how.grid = 0;
    analyse(scan, &how, &without);
    uint32_t here = 0, there = 0, all = 0;
    for (uint32_t i = 0; i < scan->count; i++) {
        const int column = scan->column[i], row = scan->row[i];
        if (scan->of[i] || row < 2 || row > ROWS - 3 || (column != 69 && column != 73) || on_board(column, row))
            continue;
        all++;
        here += with.kind[i] == PATINA_KIND_BORDER;
        there += without.kind[i] == PATINA_KIND_BORDER;
    }
    assert_true(all > 100 && here == all && there < all / 10);
    free(scan);
    free(other);
}

// Points beyond the grid, two in a cell, a grid that is nearly empty, scans that nobody stands at: as without a grid, to the bit.
static void test_no_grid(void **state)
{
    static struct known plain, known;
    (void)state;
    struct scan *scan = take(0, 0.002, 0);
    patina_analysis_desc how = by_grid(scan, 0);
    how.grid = 0;
    analyse(scan, &how, &plain);
    static const double nowhere[6] = {0.0};
    for (int k = 0; k < 3; k++) {
        struct scan *bad = take(0, 0.002, 0);
        how = by_grid(bad, 0);
        for (uint32_t i = 0; i < bad->count; i++) {
            bad->row[i] = k == 0 ? 5 : k == 1 ? (uint16_t)(11 * i) : bad->row[i];
            bad->column[i] = k == 0 ? 5 : k == 1 ? (uint16_t)(7919u * i) : bad->column[i];
        }
        if (k == 2) {
            how.station_count = 0;
            how.direction_count = 2;
            how.directions = nowhere;
        }
        patina_analysis_desc same = how;
        same.grid = 0;
        analyse(bad, &same, &plain);
        analyse(bad, &how, &known);
        uint32_t differ = 0;
        for (uint32_t i = 0; i < bad->count; i++)
            differ += known.kind[i] != plain.kind[i] || known.half_axes[2 * i] != plain.half_axes[2 * i];
        assert_true(differ <= (k == 0)); // the one that has the cell
        free(bad);
    }
    free(scan);
}

static void test_threads_do_not_show(void **state)
{
    static struct known one, many;
    (void)state;
    struct scan *scan = take(1, 0.004, 3);
    patina_analysis_desc how = by_grid(scan, 1);
    how.threads = 1;
    analyse(scan, &how, &one);
    how.threads = 5;
    analyse(scan, &how, &many);
    assert_memory_equal(&one, &many, sizeof one);
    free(scan);
}

static void refuse(const patina_analysis_desc *how, const char *says)
{
    const double place[3] = {0};
    patina_cloud *cloud = NULL;
    const patina_cloud_desc desc = {.struct_size = sizeof desc, .count = 1, .position = {place, PATINA_FLOAT64, 3, 0}};
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    assert_int_equal(patina_cloud_analyse(cloud, how, NULL), PATINA_ERROR_ARGUMENT);
    assert_non_null(strstr(support_message(cloud), says));
    patina_cloud_destroy(cloud);
}

static void test_refused(void **state)
{
    (void)state;
    struct scan *scan = take(0, 0.0, 0);
    const double wrong[3] = {0.0, NAN, 0.0};
    patina_analysis_desc how = by_grid(scan, 0);
    how.row.data = NULL;
    refuse(&how, "row and column");
    how = by_grid(scan, 0);
    how.station_count = 0;
    refuse(&how, "stations, or directions");
    how = by_grid(scan, 0);
    how.direction_count = 1;
    refuse(&how, "no directions");
    how.directions = wrong;
    refuse(&how, "direction of scan 0");
    how = by_grid(scan, 0);
    how.scan = (patina_array){scan->row, PATINA_FLOAT32, 1, 0};
    refuse(&how, "scan");
    free(scan);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_normals_and_borders), cmocka_unit_test(test_two_scans), cmocka_unit_test(test_no_grid),
        cmocka_unit_test(test_threads_do_not_show), cmocka_unit_test(test_refused),
    };
    support_arguments(argc, argv);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
