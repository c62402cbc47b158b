// SPDX-License-Identifier: GPL-3.0-or-later
// Single points: masks in pictures and shadows on every device, picking against brute force in float64, grades of scans.
#include "scene/clouds/cloud.h"
#include "scenes/clouds.h"
#include "scenes/support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { TORUS = 40000, SIZE = 160, BYTES = (TORUS + 7) / 8 };

static int bit_of(const uint8_t *bits, uint32_t i) { return bits[i / 8] >> i % 8 & 1; }

// A torus with classes 0 to 3 by turns and, in bits, every third point of one half.
struct stage {
    struct points points;
    uint8_t classes[TORUS], hidden[BYTES], selected[BYTES];
    patina_cloud *cloud;
    patina_camera camera;
    patina_settings settings;
    double matrix[16];
};

static struct stage *make(int orthographic)
{
    struct stage *s = calloc(1, sizeof *s);
    static const double eye[3] = {3, -4, 3}, target[3] = {0.5, 0, 0.2};
    const double matrix[16] = {1.1, 0.2, 0, 0.5, -0.1, 0.8, 0.3, 0, 0, -0.2, 1.4, 0.2, 0, 0, 0, 1};
    memcpy(s->matrix, matrix, sizeof matrix);
    s->points = points_torus(TORUS, 1.0, 0.4, POINTS_ALL, 5);
    for (uint32_t i = 0; i < TORUS; i++) {
        s->classes[i] = i % 4;
        s->hidden[i / 8] |= (uint8_t)((i % 3 == 0 && s->points.position[3 * i] > 0) << i % 8);
        s->selected[i / 8] |= (uint8_t)((s->points.position[3 * i + 1] < 0) << i % 8);
    }
    patina_cloud_desc desc = points_desc(&s->points);
    desc.classes = (patina_array){s->classes, PATINA_UINT8, 1, 0};
    CHECK(patina_cloud_create(&desc, NULL, &s->cloud), NULL);
    s->camera = orthographic ? camera_orthographic(eye, target, 3.0, SIZE, SIZE, 0.5, 40)
                             : camera_perspective(eye, target, 40, SIZE, SIZE, 0.5, 40);
    s->settings = settings_default(SIZE, SIZE);
    return s;
}

static void clear(struct stage *s)
{
    patina_cloud_destroy(s->cloud);
    points_free(&s->points);
    free(s);
}

static patina_scene *scene_with(const struct stage *s, patina_cloud_style *style)
{
    patina_scene *scene = NULL;
    memcpy(style->world_from_object, s->matrix, sizeof s->matrix);
    style->struct_size = sizeof *style;
    CHECK(patina_scene_create(&scene), NULL);
    CHECK(patina_scene_add_cloud(scene, s->cloud, style), scene);
    CHECK(patina_scene_set_camera(scene, &s->camera), scene);
    CHECK(patina_scene_set_settings(scene, &s->settings), scene);
    return scene;
}

// ---- masks in pictures ----------------------------------------------------------------------------------------------------

static void test_hidden_points_are_not_drawn(void **state)
{
    (void)state;
    struct stage *s = make(0);
    uint64_t *first = NULL;
    patina_mask *mask = NULL, *all = NULL, *none = NULL;
    uint8_t full[BYTES];
    memset(full, 255, sizeof full);
    CHECK(patina_mask_create(s->cloud, s->hidden, s->selected, BYTES, &mask), NULL);
    CHECK(patina_mask_create(s->cloud, full, NULL, BYTES, &all), NULL);
    CHECK(patina_mask_create(s->cloud, NULL, NULL, BYTES, &none), NULL);
    for (uint32_t k = 0; k < support_device_count(); k++) {
        patina_device *device = support_device_open(support_device_name(k), 0, 0);
        if (!device)
            continue;
        patina_cloud_style style = {0};
        s->settings.fill = PATINA_FILL_OFF;
        patina_scene *scene = scene_with(s, &style);
        struct picture whole = picture_render(device, scene, &s->camera, &s->settings);
        patina_scene_destroy(scene);
        style.mask = none;
        scene = scene_with(s, &style);
        struct picture same = picture_render(device, scene, &s->camera, &s->settings);
        assert_memory_equal(whole.keys, same.keys, SIZE * SIZE * sizeof *same.keys);
        assert_memory_equal(whole.combined, same.combined, SIZE * SIZE * 16);
        patina_scene_destroy(scene);
        style.mask = mask;
        scene = scene_with(s, &style);
        struct picture masked = picture_render(device, scene, &s->camera, &s->settings);
        patina_scene_destroy(scene);
        uint32_t lost = 0, shown = 0;
        for (uint32_t i = 0; i < SIZE * SIZE; i++) {
            const int was = whole.keys[i] != KEY_EMPTY, is = masked.keys[i] != KEY_EMPTY;
            if (is)
                assert_false(bit_of(s->hidden, key_id(masked.keys[i])));
            if (was && !bit_of(s->hidden, key_id(whole.keys[i])))
                assert_true(masked.keys[i] == whole.keys[i]);
            lost += was && bit_of(s->hidden, key_id(whole.keys[i]));
            shown += (uint32_t)is;
        }
        assert_true(lost > 300 && shown > 3000);
        style.mask = all;
        scene = scene_with(s, &style);
        struct picture empty = picture_render(device, scene, &s->camera, &s->settings);
        for (uint32_t i = 0; i < SIZE * SIZE; i++)
            assert_true(empty.keys[i] == KEY_EMPTY);
        patina_scene_destroy(scene);
        if (!first) {
            first = malloc(SIZE * SIZE * sizeof *first);
            memcpy(first, masked.keys, SIZE * SIZE * sizeof *first);
        }
        assert_memory_equal(first, masked.keys, SIZE * SIZE * sizeof *first); // on every device
        picture_free(&whole);
        picture_free(&same);
        picture_free(&masked);
        picture_free(&empty);
        patina_device_destroy(device);
    }
    free(first);
    patina_mask_destroy(mask);
    patina_mask_destroy(all);
    patina_mask_destroy(none);
    clear(s);
}

// A floor under the torus: what is hidden casts no shadow, in a frame that kept the shadows of before too.
static void test_hidden_points_cast_no_shadow(void **state)
{
    (void)state;
    struct stage *s = make(0);
    struct points floor = points_rectangle(20000, 4, 4, POINTS_NORMALS, 4);
    static const double unit[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, down[3] = {0, 0, -1.5};
    points_transform(&floor, unit, down);
    patina_cloud *below = points_upload(&floor);
    patina_mask *half = NULL, *all = NULL;
    uint8_t full[BYTES];
    memset(full, 255, sizeof full);
    CHECK(patina_mask_create(s->cloud, s->selected, NULL, BYTES, &half), NULL);
    CHECK(patina_mask_create(s->cloud, full, NULL, BYTES, &all), NULL);
    patina_device *device = support_device_first();
    patina_frame *frame = NULL;
    CHECK(patina_frame_create(device, &frame), device);
    const patina_mask *masks[] = {NULL, half, all, NULL};
    double dark[4] = {0};
    float *lit = malloc(20000 * sizeof *lit);
    for (int i = 0; i < 4; i++) {
        patina_cloud_style style = {.mask = masks[i]};
        patina_scene *scene = scene_with(s, &style);
        CHECK(patina_scene_add_cloud(scene, below, NULL), scene);
        const patina_light_desc sun = {
            .struct_size = sizeof sun, .type = PATINA_LIGHT_SUN, .power = 2, .direction = {0.1, 0.1, -1}, .shadows = 1};
        CHECK(patina_scene_add_light(scene, &sun), scene);
        CHECK(patina_frame_bake_shadows(frame, scene), frame);
        CHECK(patina_frame_read_shadows(frame, 1, 0, lit, 20000 * sizeof *lit), frame);
        for (int k = 0; k < 20000; k++)
            dark[i] += 1.0 - (double)lit[k];
        patina_scene_destroy(scene);
    }
    assert_true(dark[0] > 2000 && dark[1] > 0.3 * dark[0] && dark[1] < 0.7 * dark[0]);
    assert_true(dark[2] == 0.0 && dark[3] == dark[0]);
    free(lit);
    patina_frame_destroy(frame);
    patina_device_destroy(device);
    patina_mask_destroy(half);
    patina_mask_destroy(all);
    patina_cloud_destroy(below);
    points_free(&floor);
    clear(s);
}

static void test_highlight(void **state)
{
    (void)state;
    struct stage *s = make(0);
    patina_mask *mask = NULL;
    CHECK(patina_mask_create(s->cloud, NULL, s->selected, BYTES, &mask), NULL);
    static const float orange[3] = {1.0f, 0.5f, 0.0f};
    for (uint32_t k = 0; k < support_device_count(); k++) {
        patina_device *device = support_device_open(support_device_name(k), 0, 0);
        if (!device)
            continue;
        for (uint32_t surface = 0; surface < 2; surface++) { // filled, and of discs
            patina_cloud_style style = {.mask = mask};
            s->settings.surface = surface ? PATINA_SURFACE_SPLATS : PATINA_SURFACE_FILL;
            patina_scene *scene = scene_with(s, &style);
            patina_frame *frame = NULL;
            CHECK(patina_frame_create(device, &frame), device);
            static float before[SIZE * SIZE * 4], after[SIZE * SIZE * 4];
            static uint64_t keys[SIZE * SIZE];
            assert_int_equal(patina_frame_highlight(frame, scene, orange, 0.5f, after, sizeof after), PATINA_ERROR_ARGUMENT);
            CHECK(patina_frame_render(frame, scene), frame);
            CHECK(patina_frame_read(frame, PATINA_PASS_COMBINED, before, sizeof before), frame);
            CHECK(patina_frame_read_keys(frame, keys, sizeof keys), frame);
            memcpy(after, before, sizeof after);
            CHECK(patina_frame_highlight(frame, scene, orange, 0.5f, after, sizeof after), frame);
            uint32_t changed = 0, shown = 0;
            for (uint32_t i = 0; i < SIZE * SIZE; i++) {
                const int selected = keys[i] != KEY_EMPTY && bit_of(s->selected, key_id(keys[i]));
                for (int c = 0; c < 3; c++) {
                    const float mixed = before[4 * i + c] + 0.5f * (orange[c] * before[4 * i + 3] - before[4 * i + c]);
                    assert_float_equal(after[4 * i + c], selected ? mixed : before[4 * i + c], 1e-6f);
                }
                changed += (uint32_t)selected;
                shown += keys[i] != KEY_EMPTY;
            }
            assert_true(changed > 2000 && changed < shown - 1000);
            patina_scene_destroy(scene);
            patina_frame_destroy(frame);
        }
        patina_device_destroy(device);
    }
    patina_mask_destroy(mask);
    clear(s);
}

// ---- picking --------------------------------------------------------------------------------------------------------------

// A star that crosses itself, a box that reaches out of the picture, a hook of many corners, a box beyond three borders.
static uint32_t outline(int which, double corners[][2])
{
    static const double boxes[2][4][2] = {{{60, 40}, {1000, 40}, {1000, 120.5}, {60, 120.5}},
                                          {{83, -70}, {400, -70}, {400, 3000}, {83, 3000}}};
    const uint32_t count = which == 0 ? 5 : which % 2 ? 4 : 200;
    for (uint32_t i = 0; i < count; i++) {
        const double turn = which == 0 ? 4 * M_PI * i / 5 : 2 * M_PI * i / 200, r = which == 0 ? 70 : 40 + 25 * sin(7 * turn);
        corners[i][0] = which % 2 ? boxes[which / 2][i][0] : 80 + r * cos(turn);
        corners[i][1] = which % 2 ? boxes[which / 2][i][1] : 82.3 + r * sin(turn);
    }
    return count;
}

// Even and odd, over all edges; -1 where it is closer to an edge than 1e-6 pixels.
static int inside(const double corners[][2], uint32_t count, double x, double y)
{
    int in = 0;
    for (uint32_t i = 0; i < count; i++) {
        const double *a = corners[i], *b = corners[(i + 1) % count];
        const double dx = b[0] - a[0], dy = b[1] - a[1],
                     t = fmin(fmax(((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy), 0), 1);
        if (hypot(x - a[0] - t * dx, y - a[1] - t * dy) < 1e-6)
            return -1;
        in ^= (a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) * dx / dy;
    }
    return in;
}

static double spacing_of(const patina_cloud *cloud, uint32_t id)
{
    for (uint32_t c = 0; c < cloud->chunk_count; c++)
        for (uint32_t i = 0; i < cloud->chunks[c].count; i++)
            if (cloud->order[cloud->chunks[c].first + i] == id)
                return (double)cloud->chunks[c].spacing;
    return NAN;
}

// The same in other words: which points; keys NULL: whatever stands before them. Returns how many lie too close to a border to tell.
static uint32_t brute(const struct stage *s, const double corners[][2], uint32_t count, const uint64_t *keys, double scale,
                      int8_t *expected)
{
    uint32_t open = 0;
    for (uint32_t i = 0; i < TORUS; i++) {
        const float *p = s->points.position + 3 * i;
        double world[3], x, y, z;
        for (int r = 0; r < 3; r++)
            world[r] = s->matrix[4 * r] * (double)p[0] + s->matrix[4 * r + 1] * (double)p[1] +
                       s->matrix[4 * r + 2] * (double)p[2] + s->matrix[4 * r + 3];
        camera_project(&s->camera, SIZE, SIZE, world, &x, &y, &z);
        expected[i] = (int8_t)(x < 0 || y < 0 || x >= SIZE || y >= SIZE ? 0 : inside(corners, count, x, y));
        if (expected[i] == 1 && keys) {
            const double pixel = (s->camera.right - s->camera.left) / SIZE * (s->camera.orthographic ? 1.0 : z);
            const double most = fmax(2 * scale * spacing_of(s->cloud, i), 4 * pixel);
            expected[i] = 0;
            for (int k = 0; k < 4; k++) { // near a border the pixel beyond it counts too
                const double px = x + (k & 1 ? 0.01 : -0.01), py = y + (k & 2 ? 0.01 : -0.01);
                if (px < 0 || py < 0 || px >= SIZE || py >= SIZE)
                    continue;
                const uint64_t key = keys[(uint32_t)py * SIZE + (uint32_t)px];
                const uint32_t word = (uint32_t)(key >> 32);
                float shown;
                memcpy(&shown, &word, 4);
                const double slack = z - (double)shown - most;
                expected[i] = (int8_t)(key == KEY_EMPTY                         ? expected[i]
                                       : fabs(slack) < 1e-5 && expected[i] != 1 ? -1
                                       : slack < 0                              ? 1
                                                                                : expected[i]);
            }
        }
        open += expected[i] < 0;
    }
    return open;
}

static uint32_t compare(const int8_t *expected, const uint8_t *bits, int (*may)(const struct stage *, uint32_t),
                        const struct stage *s)
{
    uint32_t found = 0;
    for (uint32_t i = 0; i < TORUS; i++) {
        const int want = expected[i] > 0 && (!may || may(s, i));
        if (expected[i] >= 0 && bit_of(bits, i) != want)
            support_die("point %u: picked %d, expected %d", i, bit_of(bits, i), want);
        found += (uint32_t)bit_of(bits, i);
    }
    return found;
}

static int not_hidden(const struct stage *s, uint32_t i) { return !bit_of(s->hidden, i); }
static int of_class_2(const struct stage *s, uint32_t i) { return s->classes[i] == 2 && !bit_of(s->hidden, i); }
static int left_half(const struct stage *s, uint32_t i) { return s->points.position[3 * i] <= 0 && s->classes[i] != 1; }

static void test_pick(void **state)
{
    (void)state;
    double corners[200][2];
    uint8_t bits[BYTES], again[BYTES];
    int8_t *expected = malloc(TORUS);
    patina_device *device = support_device_first();
    for (int ortho = 0; ortho < 2; ortho++) {
        struct stage *s = make(ortho);
        const double scale = fmax(fmax(hypot(1.1, -0.1), sqrt(0.04 + 0.64 + 0.04)),
                                  hypot(0.3, 1.4)); // the matrix's longest column
        for (int which = 0; which < 4; which++) {
            const uint32_t count = outline(which, corners);
            patina_pick pick = {.struct_size = sizeof pick, .polygon = &corners[0][0], .corners = count};
            patina_cloud_style style = {0};
            patina_scene *scene = scene_with(s, &style);
            CHECK(patina_scene_pick(scene, NULL, &pick, NULL, bits, BYTES), scene);
            assert_true(brute(s, corners, count, NULL, scale, expected) < 4);
            const uint32_t through = compare(expected, bits, NULL, s);
            for (uint32_t threads = 1; threads < 6; threads += 2) {
                pick.threads = threads;
                CHECK(patina_scene_pick(scene, NULL, &pick, NULL, again, BYTES), scene);
                assert_memory_equal(bits, again, BYTES);
            }
            patina_frame *frame = NULL;
            static uint64_t keys[SIZE * SIZE];
            CHECK(patina_frame_create(device, &frame), device);
            CHECK(patina_frame_render(frame, scene), frame);
            CHECK(patina_frame_read_keys(frame, keys, sizeof keys), frame);
            CHECK(patina_scene_pick(scene, frame, &pick, NULL, bits, BYTES), scene);
            brute(s, corners, count, keys, scale, expected);
            const uint32_t seen = compare(expected, bits, NULL, s);
            assert_true(seen > 500 && seen < 0.75 * through);
            patina_frame_destroy(frame);
            patina_scene_destroy(scene);
            // hidden ones, and classes
            brute(s, corners, count, NULL, scale, expected);
            patina_mask *mask = NULL;
            CHECK(patina_mask_create(s->cloud, s->hidden, NULL, BYTES, &mask), NULL);
            style.mask = mask;
            scene = scene_with(s, &style);
            CHECK(patina_scene_pick(scene, NULL, &pick, NULL, bits, BYTES), scene);
            assert_true(compare(expected, bits, not_hidden, s) > 500);
            pick.classes[0] = 1u << 2;
            CHECK(patina_scene_pick(scene, NULL, &pick, NULL, bits, BYTES), scene);
            assert_true(compare(expected, bits, of_class_2, s) > 100);
            patina_scene_destroy(scene);
            patina_mask_destroy(mask);
            // a clip along the object's x = 0, and a hidden class, everywhere
            style = (patina_cloud_style){.hidden_classes = {1u << 1}};
            scene = scene_with(s, &style);
            patina_clip plane = {.struct_size = sizeof plane, .shape = PATINA_CLIP_PLANE};
            for (int r = 0; r < 3; r++) { // its z is what stands across the object's y and z
                plane.world_from_clip[4 * r] = s->matrix[4 * r + 1];
                plane.world_from_clip[4 * r + 1] = s->matrix[4 * r + 2];
                plane.world_from_clip[4 * r + 2] = s->matrix[4 * r];
                plane.world_from_clip[4 * r + 3] = s->matrix[4 * r + 3];
            }
            plane.world_from_clip[15] = 1;
            CHECK(patina_scene_add_clip(scene, &plane), scene);
            pick = (patina_pick){.struct_size = sizeof pick};
            CHECK(patina_scene_pick(scene, NULL, &pick, NULL, bits, BYTES), scene);
            for (uint32_t i = 0; i < TORUS; i++)
                expected[i] = fabsf(s->points.position[3 * i]) < 1e-5f ? -1 : 1;
            assert_true(compare(expected, bits, left_half, s) > TORUS / 3);
            patina_scene_destroy(scene);
        }
        clear(s);
    }
    patina_device_destroy(device);
    free(expected);
}

// Where a point falls in the image.
static void project_point(const struct stage *s, uint32_t i, double at[2])
{
    const float *p = s->points.position + 3 * i;
    double world[3], z;
    for (int r = 0; r < 3; r++)
        world[r] = s->matrix[4 * r] * (double)p[0] + s->matrix[4 * r + 1] * (double)p[1] + s->matrix[4 * r + 2] * (double)p[2] +
                   s->matrix[4 * r + 3];
    camera_project(&s->camera, SIZE, SIZE, world, &at[0], &at[1], &z);
}

// By brute force: the nearest of the picked points, as patina_scene_pick gives them.
static void check_nearest(const struct stage *s, const patina_scene *scene, const patina_frame *frame, const patina_pick *pick,
                          const double place[2])
{
    uint8_t bits[BYTES];
    CHECK(patina_scene_pick(scene, frame, pick, NULL, bits, BYTES), scene);
    double least = INFINITY;
    uint32_t wanted = TORUS;
    for (uint32_t i = 0; i < TORUS; i++) {
        double at[2];
        if (!bit_of(bits, i))
            continue;
        project_point(s, i, at);
        const double squared = (at[0] - place[0]) * (at[0] - place[0]) + (at[1] - place[1]) * (at[1] - place[1]);
        wanted = squared < least ? i : wanted;
        least = fmin(least, squared);
    }
    patina_picked found = {.struct_size = sizeof found};
    CHECK(patina_scene_pick_nearest(scene, frame, pick, place, NULL, &found), scene);
    assert_int_equal(found.found, wanted < TORUS);
    if (wanted == TORUS)
        return;
    assert_int_equal(found.number, wanted);
    assert_true(fabs(found.distance - sqrt(least)) < 1e-5); // chunks hold positions as float32, 50 pixels a unit
    for (int k = 0; k < 3; k++)
        assert_true(fabs(found.position[k] - (double)s->points.position[3 * wanted + (uint32_t)k]) < 1e-6);
}

static void test_nearest(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    for (int ortho = 0; ortho < 2; ortho++) {
        struct stage *s = make(ortho);
        patina_cloud_style style = {0};
        patina_scene *scene = scene_with(s, &style);
        patina_frame *frame = NULL;
        CHECK(patina_frame_create(device, &frame), device);
        CHECK(patina_frame_render(frame, scene), frame);
        uint32_t some = 0;
        for (int y = 5; y < SIZE; y += SIZE / 6)
            for (int x = 5; x < SIZE; x += SIZE / 6) {
                const double place[2] = {x + 0.3, y + 0.7}, r = 6.0;
                const double around[8] = {place[0] - r, place[1] - r, place[0] + r, place[1] - r,
                                          place[0] + r, place[1] + r, place[0] - r, place[1] + r};
                for (uint32_t threads = 1; threads < 4; threads += 2) {
                    const patina_pick pick = {.struct_size = sizeof pick, .polygon = around, .corners = 4, .threads = threads};
                    check_nearest(s, scene, frame, &pick, place);
                    check_nearest(s, scene, NULL, &pick, place);
                }
                some++;
            }
        assert_true(some >= 36);
        const double place[2] = {NAN, 0}, good[2] = {1, 1};
        const patina_pick none = {.struct_size = sizeof none};
        patina_picked found = {.struct_size = sizeof found};
        assert_int_equal(patina_scene_pick_nearest(scene, NULL, &none, good, NULL, &found), PATINA_ERROR_ARGUMENT);
        const double around[6] = {0, 0, 9, 0, 9, 9};
        const patina_pick pick = {.struct_size = sizeof pick, .polygon = around, .corners = 3};
        assert_int_equal(patina_scene_pick_nearest(scene, NULL, &pick, place, NULL, &found), PATINA_ERROR_ARGUMENT);
        assert_int_equal(patina_scene_pick_nearest(scene, NULL, &pick, NULL, NULL, &found), PATINA_ERROR_ARGUMENT);
        assert_int_equal(patina_scene_pick_nearest(scene, NULL, &pick, good, NULL, NULL), PATINA_ERROR_ARGUMENT);
        patina_frame_destroy(frame);
        patina_scene_destroy(scene);
        clear(s);
    }
    patina_device_destroy(device);
}

// ---- ranges of ramps ------------------------------------------------------------------------------------------------------

// Automatic ends hold all points and are as far apart as they are, but for boxes of chunks; given ones are as given.
static void test_ramp_ranges(void **state)
{
    (void)state;
    struct stage *s = make(0);
    double heights[2] = {INFINITY, -INFINITY}, distances[2] = {INFINITY, -INFINITY}, range[2];
    for (uint32_t i = 0; i < TORUS; i++) {
        double away[3], world[3];
        const float *p = s->points.position + 3 * i;
        for (int r = 0; r < 3; r++) {
            world[r] = s->matrix[4 * r] * (double)p[0] + s->matrix[4 * r + 1] * (double)p[1] +
                       s->matrix[4 * r + 2] * (double)p[2] + s->matrix[4 * r + 3];
            away[r] = world[r] - s->camera.world_from_camera[4 * r + 3];
        }
        const double distance = sqrt(away[0] * away[0] + away[1] * away[1] + away[2] * away[2]);
        heights[0] = fmin(heights[0], world[2]);
        heights[1] = fmax(heights[1], world[2]);
        distances[0] = fmin(distances[0], distance);
        distances[1] = fmax(distances[1], distance);
    }
    for (uint32_t source = PATINA_COLOR_HEIGHT; source <= PATINA_COLOR_TRUST; source++) {
        patina_cloud_style style = {.color_source = source};
        patina_scene *scene = scene_with(s, &style);
        CHECK(patina_scene_ramp_range(scene, 0, range), scene);
        const double *inner = source == PATINA_COLOR_HEIGHT ? heights : source == PATINA_COLOR_DISTANCE ? distances : NULL;
        if (inner) {
            const double slack = 0.25 * (inner[1] - inner[0]);
            assert_true(range[0] <= inner[0] + 1e-6 && range[0] > inner[0] - slack);
            assert_true(range[1] >= inner[1] - 1e-6 && range[1] < inner[1] + slack);
        }
        if (source == PATINA_COLOR_TRUST)
            assert_true(range[0] == 0.0 && range[1] == 1.0);
        patina_scene_destroy(scene);
        style = (patina_cloud_style){.color_source = source, .ramp_range = {-2.0f, 7.0f}};
        scene = scene_with(s, &style);
        CHECK(patina_scene_ramp_range(scene, 0, range), scene);
        assert_true(range[0] == -2.0 && range[1] == 7.0);
        assert_int_equal(patina_scene_ramp_range(scene, 1, range), PATINA_ERROR_ARGUMENT);
        patina_scene_destroy(scene);
    }
    patina_scene *scene = NULL;
    const patina_cloud_style style = {.struct_size = sizeof style, .color_source = PATINA_COLOR_DISTANCE};
    CHECK(patina_scene_create(&scene), NULL);
    CHECK(patina_scene_add_cloud(scene, s->cloud, &style), scene);
    assert_int_equal(patina_scene_ramp_range(scene, 0, range), PATINA_ERROR_ARGUMENT); // no camera
    patina_scene_destroy(scene);
    clear(s);
}

// ---- grades ---------------------------------------------------------------------------------------------------------------

static double linear_of(double srgb) { return srgb <= 0.04045 ? srgb / 12.92 : pow((srgb + 0.055) / 1.055, 2.4); }

static void graded(const patina_scan_grade *g, double c[3])
{
    const double luma[3] = {0.2126, 0.7152, 0.0722},
                 warm[3] = {exp2(0.5 * (double)g->temperature), 1, exp2(-0.5 * (double)g->temperature)};
    double white = 0, grey = 0;
    for (int k = 0; k < 3; k++)
        white += luma[k] * warm[k];
    for (int k = 0; k < 3; k++) {
        c[k] *= (double)g->gain * warm[k] / white;
        grey += luma[k] * c[k];
    }
    for (int k = 0; k < 3; k++)
        c[k] = pow(fmax(grey + (double)g->saturation * (c[k] - grey), 0), 1 / (double)g->gamma);
}

static void test_grades(void **state)
{
    (void)state;
    static const patina_scan_grade grades[] = {{1, 1, 1, 0}, {1.7f, 1, 1, 0}, {0.5f, 2.2f, 0.3f, 1.5f}, {1.2f, 0.6f, 2.5f, -2}};
    struct stage *s = make(0);
    uint16_t *scans = malloc(TORUS * sizeof *scans);
    for (uint32_t i = 0; i < TORUS; i++)
        scans[i] = (uint16_t)(i % 5); // the last of them has no grade
    patina_device *device = support_device_first();
    s->settings.fill = PATINA_FILL_OFF;
    s->settings.smooth = PATINA_SMOOTH_OFF;
    s->settings.antialias = PATINA_ANTIALIAS_OFF;
    for (int floats = 0; floats < 2; floats++) {
        float *colors = malloc(3 * TORUS * sizeof *colors);
        for (uint32_t i = 0; i < 3 * TORUS; i++)
            colors[i] = (float)linear_of(s->points.color[i] / 255.0);
        const patina_array array = {colors, PATINA_FLOAT32, 3, 0};
        if (floats)
            CHECK(patina_cloud_set_colors(s->cloud, &array), s->cloud);
        patina_grade *grade = NULL;
        const float balance[12] = {1, 1, 1, 2, 1, 0.5f, 1, 1, 1, 0.25f, 0.75f, 1.5f};
        CHECK(patina_grade_create_balanced(s->cloud, scans, grades, balance, 4, 0, &grade), NULL);
        patina_cloud_style style = {.lighting = PATINA_LIGHTING_UNLIT, .grade = grade};
        patina_scene *scene = scene_with(s, &style);
        struct picture picture = picture_render(device, scene, &s->camera, &s->settings);
        patina_scene_destroy(scene);
        double worst = 0;
        uint32_t seen[5] = {0};
        for (uint32_t i = 0; i < SIZE * SIZE; i++) {
            if (picture.keys[i] == KEY_EMPTY)
                continue;
            const uint32_t id = key_id(picture.keys[i]);
            double c[3];
            for (int k = 0; k < 3; k++)
                c[k] = (double)colors[3 * id + (uint32_t)k];
            for (int k = 0; k < 3 && scans[id] < 4; k++)
                c[k] *= (double)balance[3 * scans[id] + k];
            if (scans[id] < 4)
                graded(&grades[scans[id]], c);
            seen[scans[id]]++;
            for (int k = 0; k < 3; k++) {
                const double got = (double)picture.combined[4 * i + (uint32_t)k];
                worst = fmax(worst, floats ? fabs(got - c[k]) / fmax(1, c[k])
                                           : fabs(srgb_of_linear(got) - srgb_of_linear(fmin(c[k], 1))));
            }
        }
        for (int k = 0; k < 5; k++)
            assert_true(seen[k] > 500);
        if (worst > (floats ? 1e-4 : 0.8 / 255)) // rounded to 8 bits, in steps of a table
            support_die("%s: off by %g", floats ? "floats" : "8 bits", worst);
        picture_free(&picture);
        patina_grade_destroy(grade);
        free(colors);
    }
    patina_device_destroy(device);
    free(scans);
    clear(s);
}

// ---- refusals --------------------------------------------------------------------------------------------------------------

static void test_refusals(void **state)
{
    (void)state;
    struct stage *s = make(0), *other = make(0);
    patina_mask *mask = NULL;
    patina_grade *grade = NULL;
    const patina_scan_grade good = {1, 1, 1, 0}, bad = {1, 0, 1, 0};
    assert_int_equal(patina_mask_create(s->cloud, s->hidden, NULL, BYTES - 1, &mask), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_mask_create(NULL, s->hidden, NULL, BYTES, &mask), PATINA_ERROR_ARGUMENT);
    assert_null(mask);
    assert_int_equal(patina_grade_create(s->cloud, NULL, &bad, 1, &grade), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_grade_create(s->cloud, NULL, &good, 65536, &grade), PATINA_ERROR_ARGUMENT);
    const float dark[3] = {1, -1, 1};
    assert_int_equal(patina_grade_create_balanced(s->cloud, NULL, &good, dark, 1, 0, &grade), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_grade_create_balanced(s->cloud, NULL, &good, NULL, 1, 2, &grade), PATINA_ERROR_ARGUMENT);
    CHECK(patina_mask_create(other->cloud, s->hidden, NULL, BYTES, &mask), NULL);
    CHECK(patina_grade_create(other->cloud, NULL, &good, 1, &grade), NULL);
    patina_scene *scene = NULL;
    CHECK(patina_scene_create(&scene), NULL);
    patina_cloud_style style = {.struct_size = sizeof style, .mask = mask};
    assert_int_equal(patina_scene_add_cloud(scene, s->cloud, &style), PATINA_ERROR_ARGUMENT);
    assert_non_null(strstr(support_message(scene), "another cloud"));
    style = (patina_cloud_style){.struct_size = sizeof style, .grade = grade};
    assert_int_equal(patina_scene_add_cloud(scene, s->cloud, &style), PATINA_ERROR_ARGUMENT);
    patina_scene_destroy(scene);
    const patina_array none = {0};
    CHECK(patina_cloud_set_colors(s->cloud, &none), s->cloud);
    patina_grade *of_nothing = NULL;
    assert_int_equal(patina_grade_create(s->cloud, NULL, &good, 1, &of_nothing), PATINA_ERROR_EMPTY);
    style = (patina_cloud_style){0};
    scene = scene_with(s, &style);
    uint8_t bits[BYTES];
    const double corners[][2] = {{0, 0}, {10, 0}, {NAN, 5}};
    patina_pick pick = {.struct_size = sizeof pick, .polygon = &corners[0][0], .corners = 2};
    assert_int_equal(patina_scene_pick(scene, NULL, &pick, NULL, bits, BYTES), PATINA_ERROR_ARGUMENT);
    pick.corners = 3;
    assert_int_equal(patina_scene_pick(scene, NULL, &pick, NULL, bits, BYTES), PATINA_ERROR_ARGUMENT);
    pick.corners = 0;
    pick.instance = 1;
    assert_int_equal(patina_scene_pick(scene, NULL, &pick, NULL, bits, BYTES), PATINA_ERROR_ARGUMENT);
    pick.instance = 0;
    assert_int_equal(patina_scene_pick(scene, NULL, &pick, NULL, bits, BYTES + 1), PATINA_ERROR_ARGUMENT);
    patina_progress *progress = NULL;
    CHECK(patina_progress_create(&progress), NULL);
    patina_progress_cancel(progress);
    assert_int_equal(patina_scene_pick(scene, NULL, &pick, progress, bits, BYTES), PATINA_ERROR_CANCELLED);
    patina_progress_destroy(progress);
    patina_scene_destroy(scene);
    patina_mask_destroy(mask);
    patina_mask_destroy(NULL);
    patina_grade_destroy(grade);
    patina_grade_destroy(NULL);
    clear(s);
    clear(other);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_hidden_points_are_not_drawn),
                                       cmocka_unit_test(test_hidden_points_cast_no_shadow),
                                       cmocka_unit_test(test_highlight),
                                       cmocka_unit_test(test_pick),
                                       cmocka_unit_test(test_nearest),
                                       cmocka_unit_test(test_ramp_ranges),
                                       cmocka_unit_test(test_grades),
                                       cmocka_unit_test(test_refusals)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
