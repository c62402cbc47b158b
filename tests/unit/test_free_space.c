// SPDX-License-Identifier: GPL-3.0-or-later
// Free space: what a station saw through is marked, and nothing else; hidden and shown in pictures.
#include "scene/analysis/analysis.h"
#include "scene/analysis/free_space.h"
#include "scene/clouds/shape_word.h"
#include "scenes/support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// Three stations before a wall with a window that nothing returns from, and a pane that stands free before it.
enum { MOST = 1 << 17, STATIONS = 3, BY_HAND = 8 };
static const double stations[3 * STATIONS] = {0, 0, 0, 4, 0, 0.3, -7, -2, 0.1};
static const double step = 0.5 * 3.14159265358979323846 / 180.0;

struct scan {
    double *position;
    uint8_t *station;
    uint16_t *row, *column;
    uint64_t count;
};

// What stands where a ray meets y = depth: between bounds of x and z.
static int meets(const double eye[3], const double way[3], double depth, const double bounds[4], double *t)
{
    *t = (depth - eye[1]) / way[1];
    const double x = eye[0] + *t * way[0], z = eye[2] + *t * way[2];
    return *t > 0 && x >= bounds[0] && x <= bounds[1] && z >= bounds[2] && z <= bounds[3];
}

static void add_point(struct scan *scan, const double p[3], uint32_t station, uint32_t row, uint32_t column)
{
    memcpy(scan->position + 3 * scan->count, p, 3 * sizeof *p);
    scan->station[scan->count] = (uint8_t)station;
    scan->row[scan->count] = (uint16_t)row;
    scan->column[scan->count] = (uint16_t)column;
    scan->count++;
}

// By hand, of scan 0 but for the last: between wall and station; before the window, as stations 1 and 2 see it; behind the pane,
// for station 1, and below; on the wall beside what the pane hides from station 1; 0.5 % before the wall; far behind all; a
// wire that station 1 misses and station 2 meets.
static const double by_hand[BY_HAND][3] = {{0.5, 5, 0},   {3.2, 4, 0.2}, {-1.2, 6.6, 0}, {-6.02, 10, 0},
                                           {-4, 9.95, 0}, {6, 30, 1},    {-5, 7, 0},     {-5, 7, 0}};

static struct scan make_scan(double turn)
{
    struct scan scan = {malloc(3 * MOST * sizeof(double)), malloc(MOST), malloc(2 * MOST), malloc(2 * MOST), 0};
    static const double wall[4] = {-12, 12, -4, 4}, window[4] = {1, 3, -1, 2}, pane[4] = {-2, 0, -1, 1};
    for (uint32_t s = 0; s < STATIONS; s++)
        for (uint32_t row = 0; row < 160; row++)
            for (uint32_t column = 0; column < 360; column++) {
                const double e = (row - 80.0 + 0.3) * step, a = (column + 0.4 + 0.2 * s) * step, *eye = stations + 3 * s;
                const double way[3] = {cos(e) * cos(a), cos(e) * sin(a), sin(e)};
                double t, nearest = INFINITY, p[3];
                if (meets(eye, way, 10, wall, &t) && !meets(eye, way, 10, window, &t))
                    nearest = t;
                if (meets(eye, way, 6, pane, &t))
                    nearest = t;
                for (int k = 0; k < 3; k++)
                    p[k] = eye[k] + nearest * way[k];
                if (isfinite(nearest))
                    add_point(&scan, p, s, row, column);
            }
    for (int i = 0; i < BY_HAND; i++)
        add_point(&scan, by_hand[i], i + 1 < BY_HAND ? 0 : 2, 0, 0);
    for (uint64_t i = 0; i < scan.count; i++) { // about the vertical: azimuths wrap elsewhere
        double *p = scan.position + 3 * i, x = p[0];
        p[0] = cos(turn) * x - sin(turn) * p[1];
        p[1] = sin(turn) * x + cos(turn) * p[1];
    }
    return scan;
}

static void turn_stations(double turn, double turned[3 * STATIONS])
{
    memcpy(turned, stations, sizeof stations);
    for (int s = 0; s < STATIONS; s++) {
        turned[3 * s] = cos(turn) * stations[3 * s] - sin(turn) * stations[3 * s + 1];
        turned[3 * s + 1] = sin(turn) * stations[3 * s] + cos(turn) * stations[3 * s + 1];
    }
}

static void free_scan(struct scan *scan)
{
    free(scan->position);
    free(scan->station);
    free(scan->row);
    free(scan->column);
}

static patina_cloud *build(const struct scan *scan)
{
    const patina_cloud_desc desc = {
        .struct_size = sizeof desc, .count = scan->count, .position = {scan->position, PATINA_FLOAT64, 3, 0}};
    patina_cloud *cloud = NULL;
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    return cloud;
}

static patina_analysis_desc describe(const struct scan *scan, const double *places, int grid)
{
    patina_analysis_desc desc = {.struct_size = sizeof desc,
                                 .station_count = STATIONS,
                                 .stations = places,
                                 .free_space = 1,
                                 .station = {scan->station, PATINA_UINT8, 1, 0}};
    if (grid) {
        desc.row = (patina_array){scan->row, PATINA_UINT16, 1, 0};
        desc.column = (patina_array){scan->column, PATINA_UINT16, 1, 0};
    }
    return desc;
}

static uint64_t read_marks(patina_cloud *cloud, uint8_t *marks)
{
    patina_cloud_info info = {.struct_size = sizeof info};
    const patina_neighbourhoods wanted = {.struct_size = sizeof wanted, .seen_through = marks};
    CHECK(patina_cloud_neighbourhoods(cloud, &wanted, NULL), cloud);
    CHECK(patina_cloud_get_info(cloud, &info), cloud);
    return info.seen_through;
}

// Slots whose point has another surface beside its own.
static uint64_t count_beside(const patina_cloud *cloud)
{
    uint64_t count = 0;
    for (uint64_t i = 0; i < cloud->slots; i++)
        count += (cloud->shapes[i] & PT_SHAPE_BESIDE) != 0;
    return count;
}

static void test_marks(void **state)
{
    static uint8_t marks[MOST], again[MOST];
    (void)state;
    for (int k = 0; k < 4; k++) {
        const double turn = k % 2 ? 1.7 : 0.0;
        double places[3 * STATIONS];
        struct scan scan = make_scan(turn);
        turn_stations(turn, places);
        patina_cloud *cloud = build(&scan);
        patina_analysis_desc desc = describe(&scan, places, k / 2);
        desc.threads = 1;
        CHECK(patina_cloud_analyse(cloud, &desc, NULL), cloud);
        const uint64_t count = read_marks(cloud, marks);
        uint64_t sum = 0;
        for (uint64_t i = 0; i < scan.count; i++)
            sum += marks[i];
        assert_int_equal(sum, count);
        for (uint64_t i = 0; i < scan.count - BY_HAND; i++)
            assert_int_equal(marks[i], 0);
        assert_int_equal(marks[scan.count - BY_HAND], 1);
        for (uint64_t i = 1; i < BY_HAND; i++)
            assert_int_equal(marks[scan.count - BY_HAND + i], 0);
        desc.threads = 2; // anew, from what it knows
        CHECK(patina_cloud_analyse(cloud, &desc, NULL), cloud);
        assert_int_equal(read_marks(cloud, again), count);
        assert_memory_equal(marks, again, scan.count);
        uint64_t beside = count_beside(cloud);
        desc.free_space = 0; // forgets
        CHECK(patina_cloud_analyse(cloud, &desc, NULL), cloud);
        assert_int_equal(read_marks(cloud, again), 0);
        assert_int_equal(count_beside(cloud), beside); // looking through leaves no bit of its own behind
        patina_cloud_destroy(cloud);
        free_scan(&scan);
    }
}

static void test_interval(void **state)
{
    (void)state;
    struct scan scan = make_scan(0.0);
    patina_cloud *cloud = build(&scan);
    for (int grid = 0; grid < 2; grid++) {
        patina_analysis_desc desc = describe(&scan, stations, grid);
        desc.station.stride = 1;
        desc.row.stride = desc.column.stride = 2;
        struct pt_beams beams; // footprints and free space ask the same
        assert_int_equal(pt_beams_create(cloud, &desc, NULL, &beams), PATINA_OK);
        for (uint32_t s = 0; s < STATIONS; s++) {
            const struct pt_interval *interval = &beams.each[s].interval;
            const double slack = grid ? 0.001 : 0.05;
            assert_true(fabs(interval->azimuth / step - 1) < slack && fabs(interval->elevation / step - 1) < slack);
        }
        pt_beams_destroy(&beams);
    }
    patina_cloud_destroy(cloud);
    free_scan(&scan);
}

// ---- pictures --------------------------------------------------------------------------------------------------------------

struct looked { // what a picture says of the one marked point and of the others
    uint32_t marked, others, wrong;
    float color[3]; // of the marked one
};

static struct looked look(patina_device *device, const patina_cloud *cloud, const patina_cloud_style *style,
                          int (*may_be_drawn)(uint32_t), uint32_t marked)
{
    enum { SIZE = 128 };
    struct looked out = {0};
    patina_scene *scene = NULL;
    const double eye[3] = {0.5, -2, 0.02}, target[3] = {0.5, 5, 0.02};
    const patina_camera camera = camera_perspective(eye, target, 60, SIZE, SIZE, 0.1, 100);
    patina_settings settings = settings_default(SIZE, SIZE);
    settings.fill = PATINA_FILL_OFF;
    settings.smooth = PATINA_SMOOTH_OFF;
    settings.antialias = PATINA_ANTIALIAS_OFF;
    CHECK(patina_scene_create(&scene), NULL);
    CHECK(patina_scene_add_cloud(scene, cloud, style), scene);
    struct picture picture = picture_render(device, scene, &camera, &settings);
    for (uint32_t i = 0; i < SIZE * SIZE; i++) {
        if (picture.keys[i] == KEY_EMPTY)
            continue;
        const uint32_t id = key_id(picture.keys[i]);
        out.wrong += may_be_drawn && !may_be_drawn(id);
        out.others += id != marked;
        out.marked += id == marked;
        for (int k = 0; k < 3 && id == marked; k++)
            out.color[k] = picture.combined[4 * i + (uint32_t)k];
    }
    picture_free(&picture);
    patina_scene_destroy(scene);
    return out;
}

static uint8_t kinds[MOST];
static float trusts[MOST];
static int is_no_surface(uint32_t id) { return kinds[id] != PATINA_KIND_SURFACE; }
static int is_trusted(uint32_t id) { return trusts[id] >= 1.0f; }

static void test_pictures(void **state)
{
    (void)state;
    struct scan scan = make_scan(0.0);
    float *radii = calloc(scan.count, sizeof *radii);
    const uint32_t marked = (uint32_t)scan.count - BY_HAND;
    for (int own = 0; own < 2; own++) { // radii of its own lie where shapes would
        patina_cloud_desc cloud_desc = {
            .struct_size = sizeof cloud_desc, .count = scan.count, .position = {scan.position, PATINA_FLOAT64, 3, 0}};
        if (own)
            cloud_desc.radius = (patina_array){radii, PATINA_FLOAT32, 1, 0};
        patina_cloud *cloud = NULL;
        CHECK(patina_cloud_create(&cloud_desc, NULL, &cloud), NULL);
        const patina_analysis_desc desc = describe(&scan, stations, 0);
        CHECK(patina_cloud_analyse(cloud, &desc, NULL), cloud);
        const patina_neighbourhoods wanted = {.struct_size = sizeof wanted, .kind = kinds, .trust = trusts};
        CHECK(patina_cloud_neighbourhoods(cloud, &wanted, NULL), cloud);
        for (uint32_t k = 0; k < support_device_count(); k++) {
            patina_device *device = support_device_open(support_device_name(k), 0, 0);
            if (!device)
                continue;
            patina_cloud_style style = {.struct_size = sizeof style, .lighting = PATINA_LIGHTING_UNLIT, .least_trust = -1.0f};
            const struct looked off = look(device, cloud, &style, NULL, marked);
            style.free_space = PATINA_FREE_SPACE_SHOW;
            const struct looked shown = look(device, cloud, &style, NULL, marked);
            style.free_space = PATINA_FREE_SPACE_USE;
            const struct looked used = look(device, cloud, &style, NULL, marked);
            assert_true(off.marked == 1 && off.others > 1000 && off.color[0] == off.color[1]);
            assert_true(shown.marked == 1 && shown.others == off.others);
            assert_true(shown.color[0] > 0.9f && shown.color[1] < 0.1f && shown.color[2] > 0.9f);
            assert_true(used.marked == 0 && used.others >= off.others);
            style.free_space = PATINA_FREE_SPACE_OFF;
            style.hidden_kinds = 1u << PATINA_KIND_SURFACE;
            const struct looked bare = look(device, cloud, &style, is_no_surface, marked);
            assert_true(bare.wrong == 0 && bare.others > 0 && bare.others < off.others / 2);
            style.hidden_kinds = 0;
            style.least_trust = 1.0f;
            const struct looked trusted = look(device, cloud, &style, is_trusted, marked);
            assert_true(trusts[marked] < 1.0f);
            assert_true(trusted.wrong == 0 && trusted.others > 0 && trusted.marked == 0);
            style.hidden_kinds = 63;
            assert_int_equal(look(device, cloud, &style, NULL, marked).others, 0);
            patina_device_destroy(device);
        }
        patina_cloud_destroy(cloud);
    }
    free(radii);
    free_scan(&scan);
}

// ---- refusals --------------------------------------------------------------------------------------------------------------

static void test_refusals(void **state)
{
    (void)state;
    struct scan scan = make_scan(0.0);
    patina_cloud *cloud = build(&scan);
    patina_analysis_desc desc = describe(&scan, stations, 0);
    desc.station_count = 0;
    assert_int_equal(patina_cloud_analyse(cloud, &desc, NULL), PATINA_ERROR_ARGUMENT);
    assert_non_null(strstr(support_message(cloud), "stations"));
    desc = describe(&scan, stations, 0);
    desc.station.data = NULL;
    assert_int_equal(patina_cloud_analyse(cloud, &desc, NULL), PATINA_ERROR_ARGUMENT);
    assert_non_null(strstr(support_message(cloud), "which station"));
    desc = describe(&scan, stations, 1);
    desc.row.type = PATINA_FLOAT32;
    assert_int_equal(patina_cloud_analyse(cloud, &desc, NULL), PATINA_ERROR_ARGUMENT);
    desc = describe(&scan, stations, 0);
    desc.free_space = 2;
    assert_int_equal(patina_cloud_analyse(cloud, &desc, NULL), PATINA_ERROR_ARGUMENT);
    patina_progress *progress = NULL;
    CHECK(patina_progress_create(&progress), NULL);
    patina_progress_cancel(progress);
    desc = describe(&scan, stations, 0);
    assert_int_equal(patina_cloud_analyse(cloud, &desc, progress), PATINA_ERROR_CANCELLED);
    patina_progress_destroy(progress);
    patina_scene *scene = NULL;
    CHECK(patina_scene_create(&scene), NULL);
    patina_cloud_style style = {.struct_size = sizeof style, .free_space = 3};
    assert_int_equal(patina_scene_add_cloud(scene, cloud, &style), PATINA_ERROR_ARGUMENT);
    style = (patina_cloud_style){.struct_size = sizeof style, .hidden_kinds = 64};
    assert_int_equal(patina_scene_add_cloud(scene, cloud, &style), PATINA_ERROR_ARGUMENT);
    style = (patina_cloud_style){.struct_size = sizeof style, .least_trust = NAN};
    assert_int_equal(patina_scene_add_cloud(scene, cloud, &style), PATINA_ERROR_ARGUMENT);
    style.least_trust = 1.5f;
    assert_int_equal(patina_scene_add_cloud(scene, cloud, &style), PATINA_ERROR_ARGUMENT);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    free_scan(&scan);
}

// Stations that saw nothing, points of no station, all at a station's own place, rows beyond all, and an empty cloud.
static void test_hard(void **state)
{
    (void)state;
    const double p[] = {0, 0, 0, 0, 0, 0, 0, 0, 5, 0, 0, -5, 1, 1, 1, -3, 0, 0, -3, -1e-9, 0};
    const uint8_t station[] = {0, 0, 0, 0, 200, 0, 0};
    const int32_t row[] = {-1, 0, 1 << 30, 5, 6, 7, 8};
    for (uint64_t count = 0; count <= 7; count += 7) {
        const patina_cloud_desc cloud_desc = {
            .struct_size = sizeof cloud_desc, .count = count, .position = {p, PATINA_FLOAT64, 3, 0}};
        patina_cloud *cloud = NULL;
        CHECK(patina_cloud_create(&cloud_desc, NULL, &cloud), NULL);
        const patina_analysis_desc desc = {.struct_size = sizeof desc,
                                           .station_count = STATIONS,
                                           .stations = stations,
                                           .free_space = 1,
                                           .station = {station, PATINA_UINT8, 1, 0},
                                           .row = {row, PATINA_INT32, 1, 0},
                                           .column = {row, PATINA_INT32, 1, 0}};
        uint8_t marks[8];
        CHECK(patina_cloud_analyse(cloud, &desc, NULL), cloud);
        assert_int_equal(read_marks(cloud, marks), 0);
        patina_cloud_destroy(cloud);
    }
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_marks), cmocka_unit_test(test_interval),
                                       cmocka_unit_test(test_pictures), cmocka_unit_test(test_refusals),
                                       cmocka_unit_test(test_hard)};
    support_arguments(argc, argv);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
