// SPDX-License-Identifier: GPL-3.0-or-later
// Points are told apart by what a picture sees of them (SPEC 1): what lies out of view, before or behind in the scene, changes no byte, and
// whoever asks gets the caller's numbers all the same: keys, numbers, picks, highlights.
#include "clouds.h"
#include "support.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TORUS = 60000, SIZE = 128, BYTES = (TORUS + 7) / 8 };

enum kind { FILLED, SPLATS, DISCS, RANGES, GLASS, SOFT, DIVIDED, LINES, KINDS };
static const char *const names[KINDS] = {"filled", "splats", "discs", "range images", "glass", "soft", "a field", "lines"};

struct stage {
    struct points points;
    patina_cloud *cloud;
    patina_field *field;
    uint8_t selected[BYTES];
    patina_mask *mask;
    patina_mesh *mesh;
};

static int is_selected(const struct stage *s, uint64_t i) { return s->selected[i / 8] >> i % 8 & 1; }

static struct stage *make(enum kind kind)
{
    struct stage *s = calloc(1, sizeof *s);
    float *values = malloc(TORUS * sizeof *values);
    uint8_t *opacities = malloc(TORUS);
    assert_true(s && values && opacities);
    s->points = points_torus(TORUS, 1.0, 0.4, POINTS_ALL, 5);
    for (uint32_t i = 0; i < TORUS; i++) {
        values[i] = (float)(i % 97) / 97;
        opacities[i] = (uint8_t)(100 + i % 150);
        s->selected[i / 8] |= (uint8_t)((s->points.position[3 * i + 2] < 0.1f) << i % 8);
    }
    const patina_field_desc of_field = {.struct_size = sizeof of_field, .count = TORUS, .values = values, .range = {0, 1}};
    patina_cloud_desc desc = points_desc(&s->points);
    if (kind == GLASS)
        desc.opacity = (patina_array){opacities, PATINA_UINT8, 1, 0};
    CHECK(patina_cloud_create(&desc, NULL, &s->cloud), NULL);
    if (kind == DISCS)
        CHECK(patina_cloud_analyse(s->cloud, NULL, NULL), s->cloud);
    if (kind == DIVIDED)
        CHECK(patina_field_create(s->cloud, &of_field, NULL, &s->field), s->cloud);
    CHECK(patina_mask_create(s->cloud, NULL, s->selected, BYTES, &s->mask), s->cloud);
    const float corners[] = {-0.6f, -1.6f, -0.6f, 0.6f, -1.6f, -0.6f, 0, -1.2f, 0.5f};
    const uint32_t triangle[] = {0, 1, 2};
    const patina_mesh_desc of_mesh = {.struct_size = sizeof of_mesh,
                                      .vertex_count = 3,
                                      .triangle_count = 1,
                                      .position = {corners, PATINA_FLOAT32, 3, 0},
                                      .indices = triangle};
    CHECK(patina_mesh_create(&of_mesh, &s->mesh), NULL);
    free(values);
    free(opacities);
    return s;
}

static void clear(struct stage *s)
{
    patina_mask_destroy(s->mask);
    patina_field_destroy(s->field);
    patina_cloud_destroy(s->cloud);
    patina_mesh_destroy(s->mesh);
    points_free(&s->points);
    free(s);
}

static void add(const struct stage *s, patina_scene *scene, enum kind kind, double x, int masked)
{
    patina_cloud_style style = {.struct_size = sizeof style,
                                .world_from_object = {1, 0, 0, x, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
                                .lighting = PATINA_LIGHTING_LIT,
                                .mask = masked ? s->mask : NULL};
    style.surface = kind == RANGES ? PATINA_SURFACE_RANGES : 0;
    style.transparency = kind == GLASS ? 0.25f : 0.0f;
    style.soft = kind == SOFT ? PATINA_SOFT_ALL : kind == DIVIDED ? PATINA_SOFT_FIELD : PATINA_SOFT_OFF;
    style.soft_radius = kind == SOFT ? 0.03f : 0.0f;
    style.soft_threshold = kind == DIVIDED ? 0.5f : 0.0f;
    style.field = kind == DIVIDED ? s->field : NULL;
    style.shadow_off = fabs(x) > 10 ? PATINA_SHADOW_NO_CAST | PATINA_SHADOW_NO_RECEIVE : 0;
    CHECK(patina_scene_add_cloud(scene, s->cloud, &style), scene);
}

// What is in view: the end of a torus, the same once more, whose points lie in the same places, and one aside. `others` lie out of view before
// and between these.
static patina_scene *scene_with(const struct stage *s, enum kind kind, int others)
{
    static const double eye[3] = {0.3, -3.2, 1.6}, target[3] = {0.2, -1.0, 0};
    patina_scene *scene = NULL;
    CHECK(patina_scene_create(&scene), NULL);
    if (others)
        add(s, scene, kind, 1000, 0);
    add(s, scene, kind, 0, 1);
    if (others) {
        add(s, scene, kind, -1000, 0);
        add(s, scene, kind, 2000, 0);
    }
    add(s, scene, kind, 0, 0);
    add(s, scene, kind, 0.7, 1);
    if (others)
        add(s, scene, kind, 3000, 0);
    CHECK(patina_scene_add_mesh(scene, s->mesh, NULL), scene);
    const patina_light_desc sun = {.struct_size = sizeof sun,
                                   .type = PATINA_LIGHT_SUN,
                                   .power = 3,
                                   .direction = {0.3, 0.5, -1},
                                   .shadows = kind != RANGES};
    CHECK(patina_scene_add_light(scene, &sun), scene);
    const patina_camera camera = camera_perspective(eye, target, 24, SIZE, SIZE, 0.5, 40);
    CHECK(patina_scene_set_camera(scene, &camera), scene);
    patina_settings settings = settings_default(SIZE, SIZE);
    settings.surface = kind == SPLATS ? PATINA_SURFACE_SPLATS : PATINA_SURFACE_AUTO;
    settings.layers = kind == GLASS ? 3 : 1;
    settings.passes = 0xFFFFFFFFu >> (32 - PATINA_PASS_COUNT);
    CHECK(patina_scene_set_settings(scene, &settings), scene);
    const patina_lines lines = {.struct_size = sizeof lines, .width = 2, .source = PATINA_LINE_POINT};
    if (kind == LINES)
        CHECK(patina_scene_set_lines(scene, &lines), scene);
    return scene;
}

// The number of a point or triangle as the scene with others counts them.
static uint64_t among_others(uint64_t number)
{
    static const uint64_t before[] = {1, 4, 5, 7}; // clouds, of those without the others
    const uint64_t cloud = number / TORUS < 3 ? number / TORUS : 3;
    return before[cloud] * TORUS + (number - cloud * TORUS);
}

struct seen {
    struct picture picture;
    uint64_t *numbers;
    float *lit; // highlighted
    uint8_t picked[3][BYTES];
};

static struct seen look(patina_device *device, patina_scene *scene, const uint32_t instances[3])
{
    const size_t pixels = SIZE * SIZE;
    const double outline[] = {20, 20, 100, 30, 90, 110, 30, 80};
    const float color[3] = {1, 0.5f, 0};
    struct seen seen = {.numbers = malloc(pixels * 8), .lit = malloc(pixels * 16)};
    patina_frame *frame = NULL;
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_frame_render(frame, scene), frame);
    seen.picture = picture_read(frame);
    CHECK(patina_frame_read_numbers(frame, seen.numbers, pixels * 8), frame);
    assert_int_equal(patina_frame_read_numbers(frame, seen.numbers, 8), PATINA_ERROR_ARGUMENT);
    for (size_t i = 0; i < pixels; i++) // the same as keys have
        if (seen.picture.keys[i] == KEY_EMPTY ? seen.numbers[i] != UINT64_MAX : seen.numbers[i] != key_id(seen.picture.keys[i]))
            support_die("pixel %zu: number %llu, id %u", i, (unsigned long long)seen.numbers[i], key_id(seen.picture.keys[i]));
    memcpy(seen.lit, seen.picture.combined, pixels * 16);
    CHECK(patina_frame_highlight(frame, scene, color, 0.5f, seen.lit, pixels * 16), frame);
    for (int k = 0; k < 3; k++) {
        const patina_pick pick = {.struct_size = sizeof pick, .instance = instances[k], .polygon = outline, .corners = 4};
        CHECK(patina_scene_pick(scene, frame, &pick, NULL, seen.picked[k], BYTES), scene);
    }
    patina_frame_destroy(frame);
    return seen;
}

static void forget(struct seen *seen)
{
    picture_free(&seen->picture);
    free(seen->numbers);
    free(seen->lit);
}

static void check_kind(patina_device *device, const char *name, enum kind kind)
{
    struct stage *s = make(kind);
    patina_scene *few = scene_with(s, kind, 0), *many = scene_with(s, kind, 1);
    struct seen a = look(device, few, (const uint32_t[]){0, 1, 2}), b = look(device, many, (const uint32_t[]){1, 4, 5});
    uint32_t of[4] = {0}, lit = 0;
    char what[64];
    snprintf(what, sizeof what, "%s on %s", names[kind], name);
    for (size_t i = 0; i < SIZE * SIZE; i++) {
        const uint64_t number = a.numbers[i];
        if (number == UINT64_MAX ? b.numbers[i] != UINT64_MAX : b.numbers[i] != among_others(number))
            support_die("%s: pixel %zu: %llu, among others %llu", what, i, (unsigned long long)number,
                        (unsigned long long)b.numbers[i]);
        const uint64_t instance = number == UINT64_MAX ? 4 : number / TORUS < 3 ? number / TORUS : 3;
        if (instance < 4)
            of[instance]++;
        const int changed = memcmp(a.lit + 4 * i, a.picture.combined + 4 * i, 16) != 0;
        const int chosen = (instance == 0 || instance == 2) && is_selected(s, number % TORUS);
        if (changed > chosen || (chosen > changed && a.picture.combined[4 * i + 3] > 0 && a.picture.combined[4 * i] != 1))
            support_die("%s: pixel %zu of %llu is lit wrongly", what, i, (unsigned long long)number);
        lit += (uint32_t)changed;
    }
    printf("  %s: pixels of the instances %u, %u, %u, of the mesh %u; lit %u\n", what, of[0], of[1], of[2], of[3], lit);
    assert_true(kind == SOFT || (of[0] > 500 && of[2] > 500 && lit > 300)); // of soft ones alone no key tells
    assert_int_equal(of[1], 0);                                             // of equal places the lower instance
    assert_true(of[3] > 20);
    assert_memory_equal(a.lit, b.lit, SIZE * SIZE * 16);
    assert_memory_equal(a.picked, b.picked, sizeof a.picked);
    free(a.picture.keys);
    free(b.picture.keys);
    a.picture.keys = b.picture.keys = NULL;
    picture_assert_identical(&b.picture, &a.picture, 0, 0, what);
    forget(&a);
    forget(&b);
    patina_scene_destroy(few);
    patina_scene_destroy(many);
    clear(s);
}

static void each_kind(patina_device *device, const char *name)
{
    const int slow = !strncmp(name, "gl", 2); // its plans are the same: a kind of each sort
    for (int kind = 0; kind < KINDS; kind++)
        if (!slow || kind == FILLED || kind == DISCS || kind == RANGES || kind == SOFT)
            check_kind(device, name, (enum kind)kind);
}

static void test_others_change_nothing(void **state)
{
    (void)state;
    support_each_device(each_kind);
}

// Keys stay those of the picture that they are of: while samples are drawn, whose pictures are others, and when shadows of another scene
// were computed.
static void test_keys_outlive_samples(void **state)
{
    (void)state;
    struct stage *s = make(FILLED);
    patina_device *device = support_device_first();
    patina_scene *few = scene_with(s, FILLED, 0), *many = scene_with(s, FILLED, 1);
    const size_t size = SIZE * SIZE * 8;
    uint64_t *plain = malloc(size), *now = malloc(size);
    patina_frame *frame = NULL;
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_frame_render(frame, many), frame);
    CHECK(patina_frame_read_numbers(frame, plain, size), frame);
    CHECK(patina_frame_bake_shadows(frame, few), frame);
    CHECK(patina_frame_read_numbers(frame, now, size), frame);
    assert_memory_equal(plain, now, size);
    patina_settings settings = settings_default(SIZE, SIZE);
    settings.pixel_samples = 16;
    for (int progressive = 0; progressive < 2; progressive++) {
        settings.pixel_progressive = (uint32_t)progressive;
        CHECK(patina_scene_set_settings(many, &settings), many);
        CHECK(patina_frame_render(frame, many), frame);
        for (int step = 0; step < 3 && progressive; step++)
            CHECK(patina_frame_refine(frame, many, 0), frame);
        CHECK(patina_frame_read_numbers(frame, now, size), frame);
        assert_memory_equal(plain, now, size);
    }
    patina_frame_destroy(frame);
    patina_scene_destroy(few);
    patina_scene_destroy(many);
    patina_device_destroy(device);
    free(plain);
    free(now);
    clear(s);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_others_change_nothing),
        cmocka_unit_test(test_keys_outlive_samples),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
