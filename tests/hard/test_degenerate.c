// SPDX-License-Identifier: GPL-3.0-or-later
// Inputs that hold almost nothing or nonsense (SPEC 9): every device stays sane, and all agree to the bit.
#include "measured.h"
#include "scenes/clouds.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double eye[3] = {0.3, -2.75, 2.25}, centre[3] = {0.0, 0.0, 0.0};

static patina_camera usual_camera(uint32_t width, uint32_t height)
{
    return camera_perspective(eye, centre, 45.8, width, height, 0.1, 100.0);
}

// Draws on every device, checks each picture for sanity and all for equal keys; returns the first device's.
static struct picture draw(patina_scene *scene, const patina_camera *camera, const patina_settings *settings, const char *what)
{
    struct picture first = {0};
    for (uint32_t k = 0; k < support_device_count(); k++) {
        patina_device *device = support_device_open(support_device_name(k), 0, 0);
        if (!device)
            continue;
        struct picture picture = picture_render(device, scene, camera, settings);
        char name[128];
        snprintf(name, sizeof name, "%s, %s", what, support_device_name(k));
        measured_assert_sane(&picture, name);
        if (first.keys) {
            if (memcmp(first.keys, picture.keys, (size_t)picture.width * picture.height * 8))
                support_die("%s: keys differ from the first device's", name);
            picture_free(&picture);
        } else {
            first = picture;
        }
        patina_device_destroy(device);
    }
    if (!first.keys)
        skip();
    return first;
}

static struct picture draw_points(const struct points *points, const patina_cloud_style *style, const char *what)
{
    patina_cloud *cloud = points_upload(points);
    patina_scene *scene = scene_of(cloud, style);
    patina_camera camera = usual_camera(67, 45);
    patina_settings settings = settings_default(67, 45);
    struct picture picture = draw(scene, &camera, &settings, what);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    return picture;
}

static void test_not_numbers(void **state)
{
    (void)state;
    uint64_t count = 4000;
    struct points points = points_torus(count, 1.0, 0.4, POINTS_ALL, 71);
    float *color = malloc(count * 4 * sizeof *color);
    assert_non_null(color);
    static const float bad[] = {NAN, INFINITY, -INFINITY, FLT_MAX, -FLT_MAX, 1e30f};
    uint64_t bad_positions = 0, bad_normals = 0, bad_colors = 0;
    for (uint64_t i = 0; i < count; i++) {
        for (int k = 0; k < 4; k++)
            color[4 * i + (uint64_t)k] = 0.5f;
        if (i % 7 == 3) {
            points.position[3 * i + i % 3] = bad[i % 3];
            bad_positions++;
        }
        if (i % 5 == 1) {
            points.normal[3 * i + i % 3] = bad[i % 3];
            bad_normals += i % 7 != 3; // of points that are drawn
        } else if (i % 5 == 2) {
            memset(points.normal + 3 * i, 0, 3 * sizeof(float));
            bad_normals += i % 7 != 3;
        } else if (i % 5 == 3) { // any length is a normal, the longest and the shortest too
            for (int k = 0; k < 3; k++)
                points.normal[3 * i + (uint64_t)k] *= i % 2 ? 1e38f : 1e-38f;
        }
        if (i % 11 == 4) {
            color[4 * i + i % 3] = bad[i % 3];
            bad_colors += i % 7 != 3;
        }
    }
    patina_cloud_desc desc = points_desc(&points);
    desc.color = (patina_array){.data = color, .type = PATINA_FLOAT32, .components = 4};
    patina_cloud *cloud = NULL;
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    patina_cloud_info info = {.struct_size = sizeof info};
    CHECK(patina_cloud_get_info(cloud, &info), cloud);
    assert_int_equal(info.count, count);
    assert_int_equal(info.drawn, count - bad_positions);
    assert_int_equal(info.invalid_positions, bad_positions);
    assert_int_equal(info.invalid_normals, bad_normals);
    assert_int_equal(info.invalid_colors, bad_colors);
    for (int k = 0; k < 3; k++)
        assert_true(info.box_min[k] >= -1.5 && info.box_max[k] <= 1.5);

    patina_cloud_style style = {.struct_size = sizeof style, .lighting = PATINA_LIGHTING_LIT, .cull_back = 1};
    patina_scene *scene = scene_of(cloud, &style);
    patina_light_desc sun = {.struct_size = sizeof sun, .type = PATINA_LIGHT_SUN, .power = 3.0f};
    CHECK(patina_scene_add_light(scene, &sun), scene);
    patina_camera camera = usual_camera(67, 45);
    patina_settings settings = settings_default(67, 45);
    struct picture picture = draw(scene, &camera, &settings, "NaN and Inf");
    assert_true(picture_count(&picture) > 500);
    for (uint32_t i = 0; i < 67 * 45; i++)
        if (picture.keys[i] != KEY_EMPTY)
            assert_true(key_id(picture.keys[i]) < count && key_id(picture.keys[i]) % 7 != 3);
    picture_free(&picture);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    free(color);
    points_free(&points);
}

// Coordinates up to the end of float32, and as far as float64 goes: no crash, nothing that is not a number.
static void test_huge_positions(void **state)
{
    (void)state;
    struct points points = points_sphere(2000, 1.0, POINTS_ALL, 72);
    for (uint64_t i = 0; i < points.count; i += 50)
        for (int k = 0; k < 3; k++)
            points.position[3 * i + (uint64_t)k] *= i % 100 ? 3e38f : 1e25f;
    struct picture picture = draw_points(&points, NULL, "huge float32 positions");
    printf("  a sphere of 2000 points, 2%% of them at 10^25 and 3 10^38: %llu pixels\n",
           (unsigned long long)picture_count(&picture));
    picture_free(&picture);
    points_free(&points);

    double huge[3 * 9] = {0};
    for (int i = 1; i < 9; i++)
        huge[3 * i + i % 3] = i < 4 ? 1e300 : i < 7 ? -DBL_MAX : 1e-300;
    patina_cloud_desc desc = {.struct_size = sizeof desc, .count = 9};
    desc.position = (patina_array){.data = huge, .type = PATINA_FLOAT64, .components = 3};
    patina_cloud *cloud = NULL;
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    patina_scene *scene = scene_of(cloud, NULL);
    patina_camera camera = usual_camera(67, 45);
    patina_settings settings = settings_default(67, 45);
    picture = draw(scene, &camera, &settings, "huge float64 positions");
    printf("  one point at the origin among eight at 10^300: %llu pixels\n", (unsigned long long)picture_count(&picture));
    picture_free(&picture);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

static void test_coincident_and_single(void **state)
{
    (void)state;
    static const uint64_t counts[] = {1, 2, 3, 15, 16, 17, 5000};
    for (uint32_t c = 0; c < sizeof counts / sizeof counts[0]; c++)
        for (unsigned columns = POINTS_PLAIN; columns <= POINTS_ALL; columns += POINTS_ALL) {
            struct points points = points_create(counts[c], columns);
            for (uint64_t i = 0; i < points.count; i++) {
                points.position[3 * i] = 0.125f;
                if (points.normal)
                    points.normal[3 * i + 2] = 1.0f;
            }
            struct picture picture = draw_points(&points, NULL, "coincident points");
            // One pixel, of the least id; nothing is known around it that filling could continue.
            assert_int_equal(picture_count(&picture), 1);
            for (uint32_t i = 0; i < 67 * 45; i++)
                if (picture.keys[i] != KEY_EMPTY)
                    assert_int_equal(key_id(picture.keys[i]), 0);
            picture_free(&picture);
            points_free(&points);
        }
}

static void assert_nothing(struct picture *picture)
{
    assert_int_equal(picture_count(picture), 0);
    for (uint32_t i = 0; i < picture->width * picture->height; i++) {
        assert_true(picture->source[i] == 0.0f);
        assert_true(picture->depth[i] == HUGE_VALF);
        assert_true(picture->combined[4 * i + 1] == 0.25f && picture->combined[4 * i + 3] == 1.0f);
    }
    picture_free(picture);
}

static void test_nothing(void **state)
{
    (void)state;
    patina_camera camera = usual_camera(67, 45);
    patina_settings settings = settings_default(67, 45);
    settings.world_color[1] = 0.25f;

    patina_scene *scene = NULL;
    CHECK(patina_scene_create(&scene), NULL);
    struct picture picture = draw(scene, &camera, &settings, "empty scene");
    assert_nothing(&picture);

    patina_cloud_desc desc = {.struct_size = sizeof desc};
    desc.position = (patina_array){.type = PATINA_FLOAT32, .components = 3};
    patina_cloud *empty = NULL;
    CHECK(patina_cloud_create(&desc, NULL, &empty), NULL);
    patina_cloud_info info = {.struct_size = sizeof info};
    CHECK(patina_cloud_get_info(empty, &info), empty);
    assert_int_equal(info.count, 0);
    assert_true(info.box_min[0] > info.box_max[0]);
    CHECK(patina_scene_add_cloud(scene, empty, NULL), scene);
    picture = draw(scene, &camera, &settings, "a cloud of no points");
    assert_nothing(&picture);

    float rows[9];
    for (int k = 0; k < 9; k++)
        rows[k] = NAN;
    desc.count = 3;
    desc.position.data = rows;
    patina_cloud *nothing = NULL;
    CHECK(patina_cloud_create(&desc, NULL, &nothing), NULL);
    CHECK(patina_scene_add_cloud(scene, nothing, NULL), scene);
    picture = draw(scene, &camera, &settings, "a cloud of NaN");
    assert_nothing(&picture);

    // Behind an empty and an unreal cloud, a true one: its ids start after theirs.
    struct points points = points_sphere(500, 1.0, POINTS_ALL, 73);
    patina_cloud *cloud = points_upload(&points);
    CHECK(patina_scene_add_cloud(scene, cloud, NULL), scene);
    picture = draw(scene, &camera, &settings, "a sphere after two empty clouds");
    for (uint32_t i = 0; i < 67 * 45; i++)
        if (picture.keys[i] != KEY_EMPTY)
            assert_in_range(key_id(picture.keys[i]), 3, 502);
    assert_true(picture_count(&picture) > 100);
    picture_free(&picture);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    patina_cloud_destroy(nothing);
    patina_cloud_destroy(empty);
    points_free(&points);
}

static void test_sizes(void **state)
{
    (void)state;
    static const uint32_t sizes[][2] = {{1, 1}, {1, 2}, {2, 1}, {3, 3}, {16384, 1}, {1, 16384}, {63, 65}, {4097, 3}};
    struct points points = points_torus(40000, 1.0, 0.4, POINTS_ALL, 74);
    patina_cloud *cloud = points_upload(&points);
    patina_cloud_style style = {.struct_size = sizeof style, .lighting = PATINA_LIGHTING_LIT};
    patina_scene *scene = scene_of(cloud, &style);
    for (uint32_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        uint32_t w = sizes[i][0], h = sizes[i][1];
        patina_camera camera = usual_camera(w, h);
        double half = 0.45; // the whole torus in the window, whatever its shape
        camera.left = camera.bottom = -half;
        camera.right = camera.top = half;
        patina_settings settings = settings_default(w, h);
        char what[64];
        snprintf(what, sizeof what, "%ux%u", w, h);
        struct picture picture = draw(scene, &camera, &settings, what);
        assert_true(picture_count(&picture) * 5 > (uint64_t)w * h);
        picture_free(&picture);
    }
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    points_free(&points);
}

static void test_matrices(void **state)
{
    (void)state;
    struct points points = points_torus(6000, 1.0, 0.4, POINTS_ALL, 75);
    static const double matrices[][16] = {
        {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},            // mirrored
        {-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1},          // mirrored through the origin
        {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1},             // flat
        {1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1},             // a line
        {0, 0, 0, 0.5, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1},           // a point
        {1e-12, 0, 0, 0, 0, 1e-12, 0, 0, 0, 0, 1e-12, 0, 0, 0, 0, 1}, // next to nothing
        {1e12, 0, 0, 0, 0, 1e12, 0, 0, 0, 0, 1e12, 0, 0, 0, 0, 1},    // the camera deep inside
        {1e-30, 0, 0, 0, 0, 1e30, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},      // as uneven as can be
        {1, 1, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},             // singular, not on an axis
    };
    for (int cull = 0; cull < 2; cull++)
        for (uint32_t i = 0; i < sizeof matrices / sizeof matrices[0]; i++) {
            patina_cloud_style style = {.struct_size = sizeof style, .lighting = PATINA_LIGHTING_LIT};
            style.cull_back = (uint32_t)cull;
            memcpy(style.world_from_object, matrices[i], sizeof style.world_from_object);
            char what[64];
            snprintf(what, sizeof what, "matrix %u, culling %d", i, cull);
            struct picture picture = draw_points(&points, &style, what);
            if (i < 2) // mirrored tori are tori: culling takes the far side only
                assert_true(picture_count(&picture) > 700);
            if (i == 4 && !cull)
                assert_true(picture_count(&picture) >= 1);
            picture_free(&picture);
        }
    // Not a number: refused, or drawn as nothing; never a crash.
    patina_cloud_style style = {.struct_size = sizeof style};
    for (int k = 0; k < 16; k++)
        style.world_from_object[k] = NAN;
    patina_cloud *cloud = points_upload(&points);
    patina_scene *scene = NULL;
    CHECK(patina_scene_create(&scene), NULL);
    assert_int_equal(patina_scene_add_cloud(scene, cloud, &style), PATINA_ERROR_ARGUMENT);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    points_free(&points);
}

// A mirrored object culls the same side as its image in a mirror: counts agree within the rim's pixels.
static void test_mirrored_culling(void **state)
{
    (void)state;
    struct points points = points_sphere(60000, 1.0, POINTS_NORMALS, 76);
    uint64_t counts[2];
    for (int mirrored = 0; mirrored < 2; mirrored++) {
        patina_cloud_style style = {.struct_size = sizeof style, .cull_back = 1};
        for (int k = 0; k < 4; k++)
            style.world_from_object[5 * k] = k == 0 && mirrored ? -1.0 : 1.0;
        struct picture picture = draw_points(&points, &style, "mirrored culling");
        counts[mirrored] = picture_count(&picture);
        for (uint32_t i = 0; i < 67 * 45; i++) // the near side: nearer than the centre
            if (picture.source[i] == 1.0f)
                assert_true(picture.depth[i] < 3.6f);
        picture_free(&picture);
    }
    assert_true(llabs((long long)counts[0] - (long long)counts[1]) <= 8);
    points_free(&points);
}

static void test_odd_lights(void **state)
{
    (void)state;
    struct points points = points_sphere(8000, 1.0, POINTS_ALL, 77);
    patina_cloud *cloud = points_upload(&points);
    patina_cloud_style style = {.struct_size = sizeof style, .lighting = PATINA_LIGHTING_LIT};
    style.specular = 1.0f;
    style.diffuse = 1.0f;
    style.shininess = 1000;
    patina_scene *scene = scene_of(cloud, &style);
    for (int i = 0; i < 8; i++) {
        patina_light_desc light = {.struct_size = sizeof light, .type = PATINA_LIGHT_POINT, .power = 10.0f};
        if (i == 1) // at a point of the cloud, exactly
            for (int k = 0; k < 3; k++)
                light.position[k] = points.position[3 * 4000 + k];
        if (i == 2)
            light.position[2] = 1e9;
        if (i == 3) // grazing
            light = (patina_light_desc){
                .struct_size = sizeof light, .type = PATINA_LIGHT_SUN, .power = 1.0f, .direction = {1.0, 0.0, -1e-9}};
        if (i == 4)
            light.type = PATINA_LIGHT_SUN; // no direction: straight down
        if (i == 5)
            light.power = 0.0f;
        if (i == 6) // at the eye
            memcpy(light.position, eye, sizeof eye);
        CHECK(patina_scene_add_light(scene, &light), scene);
    }
    patina_camera camera = usual_camera(67, 45);
    patina_settings settings = settings_default(67, 45);
    struct picture picture = draw(scene, &camera, &settings, "odd lights");
    assert_true(picture_count(&picture) > 500);
    picture_free(&picture);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    points_free(&points);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_not_numbers),
        cmocka_unit_test(test_huge_positions),
        cmocka_unit_test(test_coincident_and_single),
        cmocka_unit_test(test_nothing),
        cmocka_unit_test(test_sizes),
        cmocka_unit_test(test_matrices),
        cmocka_unit_test(test_mirrored_culling),
        cmocka_unit_test(test_odd_lights),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
