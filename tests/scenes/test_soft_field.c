// SPDX-License-Identifier: GPL-3.0-or-later
// Soft points by a field: what lies above the threshold is soft, the rest as it would be alone, whatever the threshold, with shadows,
// kept ones too, on every device. SPEC 5.
#include "clouds.h"
#include "support.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 64, HEIGHT = 48, POINTS = 6400, BINS = 256 };

struct room {
    patina_cloud *torus, *floor;
    patina_field *field;
    patina_mask *solid, *soft; // what the field leaves with the threshold: masks hide the others
    float threshold;
    patina_camera camera;
    patina_settings settings;
};

static int field_of(const patina_cloud *cloud, const float *values, uint64_t count, patina_field **out)
{
    const patina_field_desc desc = {.struct_size = sizeof desc, .values = values, .count = count, .range = {0.0, 1.0}};
    return patina_field_create(cloud, &desc, NULL, out);
}

// F rises along x, with noise: some chunks lie on one side, others on both.
static struct room room_make(float threshold)
{
    struct room room = {.threshold = threshold, .settings = settings_default(WIDTH, HEIGHT)};
    struct points torus = points_torus(POINTS, 1.0, 0.4, POINTS_ALL, 6),
                  floor = points_rectangle(10000, 4.0, 4.0, POINTS_ALL, 5);
    const double same[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, below[3] = {0.0, 0.0, -0.6};
    float *values = calloc(POINTS, sizeof *values);
    uint8_t *bits[2] = {calloc(POINTS / 8, 1), calloc(POINTS / 8, 1)};
    assert_true(values && bits[0] && bits[1]);
    for (uint32_t i = 0; i < POINTS; i++) {
        const double f = 0.5 + 0.4 * (double)torus.position[3 * i] + 0.02 * (i % 7);
        values[i] = (float)(round(fmin(fmax(f, 0.0), 1.0) * 255.0) / 255.0); // far from where steps are rounded
        bits[values[i] > threshold][i / 8] |= (uint8_t)(1u << i % 8);
    }
    values[5] = NAN; // is 0
    bits[1][0] &= (uint8_t) ~(1u << 5);
    bits[0][0] |= 1u << 5;
    points_transform(&floor, same, below);
    room.torus = points_upload(&torus);
    room.floor = points_upload(&floor);
    CHECK(field_of(room.torus, values, POINTS, &room.field), NULL);
    CHECK(patina_mask_create(room.torus, bits[1], NULL, POINTS / 8, &room.solid), NULL);
    CHECK(patina_mask_create(room.torus, bits[0], NULL, POINTS / 8, &room.soft), NULL);
    const double eye[3] = {0.2, -4.0, 2.0}, target[3] = {0};
    room.camera = camera_perspective(eye, target, 45.0, WIDTH, HEIGHT, 0.1, 100.0);
    free(values);
    free(bits[0]);
    free(bits[1]);
    points_free(&torus);
    points_free(&floor);
    return room;
}

static void room_free(struct room *room)
{
    patina_field_destroy(room->field);
    patina_mask_destroy(room->solid);
    patina_mask_destroy(room->soft);
    patina_cloud_destroy(room->torus);
    patina_cloud_destroy(room->floor);
}

static patina_cloud_style style_of(uint32_t soft, uint32_t model)
{
    patina_cloud_style style = PATINA_CLOUD_STYLE_INIT;
    style.soft = soft;
    style.soft_model = model;
    style.soft_opacity = 0.3f;
    style.soft_radius = 0.05f;
    style.lighting = PATINA_LIGHTING_LIT;
    return style;
}

static patina_cloud_style field_style(const struct room *room, uint32_t model)
{
    patina_cloud_style style = style_of(PATINA_SOFT_FIELD, model);
    style.field = room->field;
    style.soft_threshold = room->threshold;
    return style;
}

// The floor, the styles of the torus that are given, and a sun.
static patina_scene *scene_with(const struct room *room, const patina_cloud_style *first, const patina_cloud_style *second)
{
    const patina_light_desc sun = {
        .struct_size = sizeof sun, .type = PATINA_LIGHT_SUN, .power = 3.0f, .direction = {0.4, 0.5, -1.0}, .shadows = 1};
    patina_cloud_style lit = PATINA_CLOUD_STYLE_INIT;
    lit.lighting = PATINA_LIGHTING_LIT;
    patina_scene *scene = scene_of(room->torus, first);
    if (second)
        CHECK(patina_scene_add_cloud(scene, room->torus, second), scene);
    CHECK(patina_scene_add_cloud(scene, room->floor, &lit), scene);
    CHECK(patina_scene_add_light(scene, &sun), scene);
    return scene;
}

static struct picture draw(patina_device *device, const struct room *room, const patina_cloud_style *first,
                           const patina_cloud_style *second)
{
    patina_scene *scene = scene_with(room, first, second);
    struct picture picture = picture_render(device, scene, &room->camera, &room->settings);
    patina_scene_destroy(scene);
    return picture;
}

static void assert_same(const struct picture *a, const struct picture *b, const char *what)
{
    if (memcmp(a->combined, b->combined, (size_t)WIDTH * HEIGHT * 16) ||
        memcmp(a->depth, b->depth, (size_t)WIDTH * HEIGHT * 4) || memcmp(a->normal, b->normal, (size_t)WIDTH * HEIGHT * 12))
        fail_msg("%s: another picture", what);
}

static uint32_t differing(const struct picture *a, const struct picture *b)
{
    uint32_t count = 0;
    for (size_t i = 0; i < WIDTH * HEIGHT; i++)
        count += memcmp(a->combined + 4 * i, b->combined + 4 * i, 16) != 0;
    return count;
}

// One cloud by its field is two of its points, masked: those drawn as ever, whose shadows fall, and those all soft. Byte for byte.
static void divide(patina_device *device, const char *name)
{
    static const float thresholds[] = {0.5f, 0.3f, 0.9f};
    for (uint32_t model = 0; model < 3; model++) {
        struct room room = room_make(thresholds[model]);
        patina_cloud_style style = field_style(&room, model), solid = style_of(PATINA_SOFT_OFF, 0),
                           soft = style_of(PATINA_SOFT_ALL, model);
        solid.mask = room.solid;
        soft.mask = room.soft;
        if (model == 1) // the points' own radii
            style.soft_radius = soft.soft_radius = 0.0f;
        struct picture got = draw(device, &room, &style, NULL), expected = draw(device, &room, &solid, &soft);
        struct picture alone = draw(device, &room, &solid, NULL);
        const uint32_t changed = differing(&got, &alone);
        printf("  %s, model %u, threshold %g: soft points change %u pixels\n", name, model, (double)thresholds[model], changed);
        assert_true(changed > 100 && changed < WIDTH * HEIGHT / 2);
        assert_same(&got, &expected, name);
        picture_free(&got);
        picture_free(&expected);
        picture_free(&alone);
        room_free(&room);
    }
}

static void test_divide(void **state)
{
    (void)state;
    support_each_device(divide);
}

// Hidden by its field is the same as hidden by a mask, with shadows, and when points are picked. Byte for byte.
static void hide(patina_device *device, const char *name)
{
    static const float thresholds[] = {0.5f, 0.1f, 1.0f};
    for (size_t k = 0; k < sizeof thresholds / sizeof thresholds[0]; k++) {
        struct room room = room_make(thresholds[k]);
        patina_cloud_style style = field_style(&room, PATINA_SOFT_EXPRESS), solid = style_of(PATINA_SOFT_OFF, 0);
        style.soft = PATINA_SOFT_HIDDEN;
        solid.mask = room.solid;
        struct picture got = draw(device, &room, &style, NULL), expected = draw(device, &room, &solid, NULL);
        style.soft = PATINA_SOFT_OFF;
        struct picture whole = draw(device, &room, &style, NULL);
        const uint32_t changed = differing(&got, &whole);
        printf("  %s, threshold %g: hiding changes %u pixels\n", name, (double)thresholds[k], changed);
        assert_true(thresholds[k] < 1.0f ? changed > 100 : changed == 0);
        assert_same(&got, &expected, name);
        uint8_t picked[2][POINTS / 8];
        for (int by_mask = 0; by_mask < 2; by_mask++) {
            style.soft = PATINA_SOFT_HIDDEN;
            patina_scene *scene = scene_with(&room, by_mask ? &solid : &style, NULL);
            const patina_pick pick = {.struct_size = sizeof pick};
            CHECK(patina_scene_set_camera(scene, &room.camera), scene);
            CHECK(patina_scene_set_settings(scene, &room.settings), scene);
            CHECK(patina_scene_pick(scene, NULL, &pick, NULL, picked[by_mask], sizeof picked[0]), scene);
            patina_scene_destroy(scene);
        }
        assert_memory_equal(picked[0], picked[1], sizeof picked[0]);
        picture_free(&got);
        picture_free(&expected);
        picture_free(&whole);
        room_free(&room);
    }
}

static void test_hidden(void **state)
{
    (void)state;
    support_each_device(hide);
}

// One field serves every threshold, in one frame that keeps its shadows: as if drawn anew. At 1 nothing is soft.
static void move(patina_device *device, const char *name)
{
    static const float thresholds[] = {0.5f, 1.0f, 0.2f, 0.5f};
    struct room room = room_make(0.5f);
    patina_frame *frame = NULL;
    float *combined = malloc((size_t)WIDTH * HEIGHT * 16);
    assert_non_null(combined);
    CHECK(patina_frame_create(device, &frame), device);
    for (size_t k = 0; k < sizeof thresholds / sizeof thresholds[0]; k++) {
        patina_cloud_style style = field_style(&room, PATINA_SOFT_EXPRESS), off = style_of(PATINA_SOFT_OFF, 0);
        style.soft_threshold = thresholds[k];
        patina_scene *scene = scene_with(&room, &style, NULL);
        CHECK(patina_scene_set_camera(scene, &room.camera), scene);
        CHECK(patina_scene_set_settings(scene, &room.settings), scene);
        CHECK(patina_frame_render(frame, scene), frame);
        CHECK(patina_frame_read(frame, PATINA_PASS_COMBINED, combined, (size_t)WIDTH * HEIGHT * 16), frame);
        struct picture fresh = draw(device, &room, thresholds[k] < 1.0f ? &style : &off, NULL);
        if (memcmp(combined, fresh.combined, (size_t)WIDTH * HEIGHT * 16))
            fail_msg("%s: threshold %g is another picture in a frame that drew others", name, (double)thresholds[k]);
        picture_free(&fresh);
        patina_scene_destroy(scene);
    }
    free(combined);
    patina_frame_destroy(frame);
    room_free(&room);
}

static void test_threshold(void **state)
{
    (void)state;
    support_each_device(move);
}

// Where every F lies as far above the threshold, W of [S Eq. 22] is that of modulation; at l_m and beyond, none is.
static void modulate(patina_device *device, const char *name)
{
    struct room room = room_make(0.0f);
    float *values = malloc(POINTS * sizeof *values);
    assert_non_null(values);
    for (uint32_t i = 0; i < POINTS; i++)
        values[i] = 0.45f;
    patina_field *even = NULL;
    CHECK(field_of(room.torus, values, POINTS, &even), NULL);
    for (int k = 0; k < 2; k++) {
        patina_cloud_style style = field_style(&room, PATINA_SOFT_EXPRESS),
                           all = style_of(PATINA_SOFT_ALL, PATINA_SOFT_EXPRESS);
        style.field = even;
        style.soft_threshold = 0.25f;
        style.soft_modulation = k ? 0.1f : 0.4f;
        all.soft_modulation = k ? 0.0f : 0.5f;
        struct picture got = draw(device, &room, &style, NULL), expected = draw(device, &room, &all, NULL);
        all.soft_modulation = 0.9f;
        struct picture other = draw(device, &room, &all, NULL);
        double worst = 0.0, apart = 0.0;
        for (uint32_t i = 0; i < 4 * WIDTH * HEIGHT; i++) {
            worst = fmax(worst, fabs((double)got.combined[i] - (double)expected.combined[i]));
            apart = fmax(apart, fabs((double)got.combined[i] - (double)other.combined[i]));
        }
        printf("  %s, l_m - t %g: %.2g; from another %.2g\n", name, (double)style.soft_modulation, worst, apart);
        assert_true(worst <= 4e-3 && apart > 0.02); // W is a byte, whose steps many balls add up
        picture_free(&got);
        picture_free(&expected);
        picture_free(&other);
    }
    patina_field_destroy(even);
    free(values);
    room_free(&room);
}

static void test_modulation(void **state)
{
    (void)state;
    support_each_device(modulate);
}

// Numbers that the library finds are those that a caller would.
static void test_sources(void **state)
{
    (void)state;
    static const char *const names[] = {"from a point", "from a plane", "from an axis",
                                        "luminance",    "uncertainty",  "any range"};
    patina_device *device = support_device_first();
    struct room room = room_make(0.5f);
    struct points torus = points_torus(POINTS, 1.0, 0.4, POINTS_ALL, 6);
    float *values = calloc(POINTS, sizeof *values);
    assert_non_null(values);
    for (uint32_t k = 0; k < 6; k++) {
        patina_field_desc desc = {.struct_size = sizeof desc, .range = {0.3, 1.7}};
        const double at[3] = {0.4, -0.3, 0.2}, twice[16] = {2, 0, 0, 0.1, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1};
        const double tilted[16] = {3, 0,   0,   at[0], 0, 1.2, -1.6, at[1],
                                   0, 1.6, 1.2, at[2], 0, 0,   0,    1}; // z of 2 along (0, -0.8, 0.6)
        patina_field *found = NULL, *given = NULL;
        desc.source = k < 3    ? PATINA_FIELD_DISTANCE
                      : k == 3 ? PATINA_FIELD_LUMINANCE
                      : k == 4 ? PATINA_FIELD_UNCERTAINTY
                               : PATINA_FIELD_VALUES;
        desc.shape = k < 3 ? k : 0;
        memcpy(desc.world_from_object, twice, sizeof twice);
        memcpy(desc.world_from_shape, tilted, sizeof tilted);
        desc.invert = k == 1;
        if (k > 2)
            desc.range[0] = desc.range[1] = 0.0;
        const patina_neighbourhoods walk = {.struct_size = sizeof walk, .neighbours = 16, .uncertainty = values};
        if (k == 4)
            CHECK(patina_cloud_neighbourhoods(room.torus, &walk, NULL), NULL);
        for (uint32_t i = 0; i < POINTS; i++) {
            double off[3], square = 0.0;
            for (int c = 0; c < 3; c++) {
                off[c] = 2.0 * (double)torus.position[3 * i + c] + (c == 0 ? 0.1 : 0.0) - at[c];
                square += off[c] * off[c];
            }
            const double along = -0.8 * off[1] + 0.6 * off[2];
            const double number = k == 0 ? sqrt(square) : k == 1 ? along : sqrt(fmax(square - along * along, 0.0));
            const uint8_t *color = torus.color + 3 * i;
            values[i] = k == 1   ? (float)(1.0 - (number - 0.3) / 1.4)
                        : k < 3  ? (float)((number - 0.3) / 1.4)
                        : k == 3 ? (float)((0.2126 * color[0] + 0.7152 * color[1] + 0.0722 * color[2]) / 255.0)
                        : k == 4 ? values[i]
                                 : (float)i / POINTS;
        }
        float *wide = malloc(POINTS * sizeof *wide);
        assert_non_null(wide);
        for (uint32_t i = 0; i < POINTS; i++) // 1 of a hundred lies beyond either end
            wide[i] = k == 5 ? 500.0f - 1000.0f * (values[i] * 0.98f + 0.01f) : 0.0f;
        if (k == 5) {
            desc.values = wide;
            desc.count = POINTS;
            for (uint32_t i = 0; i < POINTS; i++)
                values[i] = 1.0f - values[i];
        }
        CHECK(patina_field_create(room.torus, &desc, NULL, &found), NULL);
        CHECK(field_of(room.torus, values, POINTS, &given), NULL);
        patina_cloud_style style = field_style(&room, PATINA_SOFT_EXPRESS);
        style.soft_threshold = k == 4 ? 0.5f : 0.437f;
        style.field = found;
        struct picture got = draw(device, &room, &style, NULL);
        style.field = given;
        struct picture expected = draw(device, &room, &style, NULL);
        style.soft_threshold = k == 4 ? 0.9f : 0.55f;
        struct picture other = draw(device, &room, &style, NULL);
        const uint32_t wrong = differing(&got, &expected), moved = differing(&got, &other);
        printf("  %s: %u pixels differ from the caller's field, %u from another threshold's\n", names[k], wrong, moved);
        assert_true(moved > 40 && wrong <= (k == 5 ? moved / 4 : 0)); // the range's ends are a sample's
        picture_free(&got);
        picture_free(&expected);
        picture_free(&other);
        patina_field_destroy(found);
        patina_field_destroy(given);
        free(wide);
    }
    patina_field_desc desc = {.struct_size = sizeof desc, .source = PATINA_FIELD_SCALAR};
    patina_field *none = NULL;
    assert_int_equal(patina_field_create(room.torus, &desc, NULL, &none), PATINA_ERROR_EMPTY);
    desc.source = PATINA_FIELD_CLASSES;
    assert_int_equal(patina_field_create(room.torus, &desc, NULL, &none), PATINA_ERROR_EMPTY);
    desc.source = PATINA_FIELD_DISTANCE;
    desc.world_from_shape[15] = 1.0;
    desc.shape = PATINA_FIELD_FROM_PLANE;
    assert_int_equal(patina_field_create(room.torus, &desc, NULL, &none), PATINA_ERROR_ARGUMENT);
    free(values);
    points_free(&torus);
    room_free(&room);
    patina_device_destroy(device);
}

// The histogram counts every point once, where its number lies, and its ends are the range's.
static void test_histogram(void **state)
{
    (void)state;
    struct room room = room_make(0.5f);
    patina_field_info info = {.struct_size = sizeof info};
    for (uint32_t inverted = 0; inverted < 2; inverted++) {
        float *values = malloc(POINTS * sizeof *values);
        uint64_t expected[BINS] = {0};
        assert_non_null(values);
        for (uint32_t i = 0; i < POINTS; i++) {
            const uint32_t bin = i * 7 % 256 * (i % 3) / 2; // uneven, and bin 255 too
            values[i] = 10.0f + 2.0f * ((float)(inverted ? 255 - bin : bin) + 0.5f) / 256.0f;
            expected[bin]++;
        }
        expected[inverted ? 255 : 0]++; // beyond an end
        expected[(uint32_t)(7 * 5 % 256) * (5 % 3) / 2]--;
        values[5] = -1e9f;
        expected[0]++; // a NaN is 0, inverted too
        expected[(uint32_t)(7 * 8 % 256) * (8 % 3) / 2]--;
        values[8] = NAN;
        const patina_field_desc desc = {
            .struct_size = sizeof desc, .values = values, .count = POINTS, .range = {10.0, 12.0}, .invert = inverted};
        patina_field *field = NULL;
        CHECK(patina_field_create(room.torus, &desc, NULL, &field), NULL);
        CHECK(patina_field_get_info(field, &info), NULL);
        assert_memory_equal(info.histogram, expected, sizeof expected);
        assert_true(info.range[inverted] == 10.0 && info.range[!inverted] == 12.0);
        patina_field_destroy(field);
        free(values);
    }
    const patina_field_desc found = {.struct_size = sizeof found, .source = PATINA_FIELD_LUMINANCE};
    patina_field *field = NULL;
    CHECK(patina_field_create(room.torus, &found, NULL, &field), NULL);
    CHECK(patina_field_get_info(field, &info), NULL);
    uint64_t sum = 0;
    for (int bin = 0; bin < BINS; bin++)
        sum += info.histogram[bin];
    assert_true(sum == POINTS && info.range[0] == 0.0 && info.range[1] == 1.0);
    patina_field_destroy(field);
    assert_int_equal(patina_field_get_info(NULL, &info), PATINA_ERROR_ARGUMENT);
    room_free(&room);
}

static void refuse(patina_scene *scene, const patina_cloud *cloud, const patina_cloud_style *style, const char *word)
{
    assert_int_equal(patina_scene_add_cloud(scene, cloud, style), PATINA_ERROR_ARGUMENT);
    assert_non_null(strstr(support_message(scene), word));
}

static void test_refusals(void **state)
{
    (void)state;
    struct room room = room_make(0.5f);
    patina_scene *scene = scene_of(room.floor, NULL);
    patina_cloud_style style = field_style(&room, 0);
    refuse(scene, room.floor, &style, "another cloud");
    style.field = NULL;
    refuse(scene, room.torus, &style, "missing");
    for (int k = 0; k < 3; k++) {
        style = field_style(&room, 0);
        style.soft_threshold = k == 0 ? -0.1f : k == 1 ? 1.1f : NAN;
        refuse(scene, room.torus, &style, "soft_threshold");
    }
    patina_field *field = NULL;
    float value = 0.5f;
    assert_int_equal(field_of(room.torus, &value, 1, &field), PATINA_ERROR_ARGUMENT);
    assert_int_equal(field_of(room.torus, NULL, POINTS, &field), PATINA_ERROR_ARGUMENT);
    assert_null(field);
    patina_scene_destroy(scene);
    room_free(&room);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_divide),     cmocka_unit_test(test_hidden),  cmocka_unit_test(test_threshold),
        cmocka_unit_test(test_modulation), cmocka_unit_test(test_sources), cmocka_unit_test(test_histogram),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
