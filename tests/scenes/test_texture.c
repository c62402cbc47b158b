// SPDX-License-Identifier: GPL-3.0-or-later
// Images on meshes in whole pictures: texel by texel, small on screen, cut out, blended, in regions, in shadow, refused.
#include "clouds.h"
#include "meshes.h"
#include "support.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SIZE = 128 };

static const double above[3] = {0.0, 0.0, 5.0}, below[3] = {0.0, 0.0, 0.0};

// A square of half a side `half` at height z; its corners lie at 0 and `turns` on the image.
static patina_mesh *square(double half, double z, double turns)
{
    const float h = (float)half, t = (float)turns, at = (float)z;
    const float positions[] = {-h, -h, at, h, -h, at, h, h, at, -h, h, at}, uv[] = {0, 0, t, 0, t, t, 0, t};
    const uint32_t indices[] = {0, 1, 2, 0, 2, 3};
    const patina_mesh_desc desc = {.struct_size = sizeof desc,
                                   .vertex_count = 4,
                                   .position = {.data = positions, .type = PATINA_FLOAT32, .components = 3},
                                   .uv = {.data = uv, .type = PATINA_FLOAT32, .components = 2},
                                   .triangle_count = 2,
                                   .indices = indices};
    patina_mesh *mesh = NULL;
    CHECK(patina_mesh_create(&desc, &mesh), NULL);
    return mesh;
}

static patina_texture *image(uint32_t width, uint32_t height, const uint8_t *rgba, uint32_t nearest, uint32_t wrap)
{
    const patina_texture_desc desc = {.struct_size = sizeof desc,
                                      .width = width,
                                      .height = height,
                                      .pixels = {.data = rgba, .type = PATINA_UINT8, .components = 4},
                                      .raw = 1,
                                      .nearest = nearest,
                                      .wrap = wrap};
    patina_texture *texture = NULL;
    CHECK(patina_texture_create(&desc, &texture), NULL);
    return texture;
}

static void add(patina_scene *scene, const patina_mesh *mesh, const patina_texture *texture, uint32_t alpha, uint32_t unlit)
{
    const patina_mesh_style style = {.struct_size = sizeof style, .texture = texture, .alpha = alpha, .unlit = unlit};
    CHECK(patina_scene_add_mesh(scene, mesh, &style), scene);
}

static struct picture draw(patina_device *device, patina_scene *scene, const patina_camera *camera, patina_settings *settings)
{
    settings->film_transparent = 1;
    return picture_render(device, scene, camera, settings);
}

// Every texel of an image whose size is no power of two is a square of its colour, on every device.
static void texel_by_texel(void **state)
{
    enum { COLUMNS = 7, ROWS = 5 };
    uint8_t rgba[COLUMNS * ROWS * 4];
    (void)state;
    for (int i = 0; i < COLUMNS * ROWS * 4; i++)
        rgba[i] = (uint8_t)(i % 4 == 3 ? 255 : (i * 37) % 251);
    for (uint32_t d = 0; d < support_device_count(); d++) {
        patina_device *device = support_device_open(support_device_name(d), 0, 0);
        if (!device)
            continue;
        patina_mesh *mesh = square(1.0, 0.0, 1.0);
        patina_texture *texture = image(COLUMNS, ROWS, rgba, 1, PATINA_WRAP_REPEAT);
        patina_scene *scene = NULL;
        CHECK(patina_scene_create(&scene), NULL);
        add(scene, mesh, texture, PATINA_ALPHA_NONE, 1);
        const patina_camera camera = camera_orthographic(above, below, 2.0, SIZE, SIZE, 0.1, 10.0);
        patina_settings settings = settings_default(SIZE, SIZE);
        settings.antialias = PATINA_ANTIALIAS_OFF;
        settings.smooth = PATINA_SMOOTH_OFF;
        struct picture picture = draw(device, scene, &camera, &settings);
        double worst = 0.0;
        for (uint32_t i = 0; i < SIZE * SIZE; i++) {
            uint32_t x = (i % SIZE * 2 + 1) * COLUMNS / (2 * SIZE), y = (i / SIZE * 2 + 1) * ROWS / (2 * SIZE);
            for (uint32_t k = 0; k < 3; k++)
                worst = fmax(worst, fabs((double)picture.combined[4 * i + k] - rgba[4 * (y * COLUMNS + x) + k] / 255.0));
        }
        printf("%s: texels are off by %.2g at most\n", support_device_name(d), worst);
        assert_true(worst < 1e-5);
        picture_free(&picture);
        patina_scene_destroy(scene);
        patina_mesh_destroy(mesh);
        patina_texture_destroy(texture);
        patina_device_destroy(device);
    }
}

// A chequered floor far away and oblique is grey, wherever the camera stands: nothing shimmers.
static void small_is_even(void **state)
{
    uint8_t rgba[64 * 64 * 4];
    double before = -1.0, most = 0.0, contrast = 0.0;
    (void)state;
    for (int i = 0; i < 64 * 64; i++)
        for (int k = 0; k < 4; k++)
            rgba[4 * i + k] = k == 3 || ((i % 64) ^ (i / 64)) & 1 ? 255 : 0;
    patina_device *device = support_device_first();
    patina_mesh *mesh = square(40.0, 0.0, 40.0); // texels a 32nd of a unit wide
    patina_texture *texture = image(64, 64, rgba, 0, PATINA_WRAP_REPEAT);
    patina_scene *scene = NULL;
    CHECK(patina_scene_create(&scene), NULL);
    add(scene, mesh, texture, PATINA_ALPHA_NONE, 1);
    for (int step = 0; step < 4; step++) {
        const double eye[3] = {0.03 * step, -30.0, 6.0}, target[3] = {0.03 * step, 0.0, 0.0};
        const patina_camera camera = camera_perspective(eye, target, 40.0, SIZE, SIZE, 0.1, 1000.0);
        patina_settings settings = settings_default(SIZE, SIZE);
        struct picture picture = draw(device, scene, &camera, &settings);
        double sum = 0.0, low = 1.0, high = 0.0;
        uint32_t count = 0;
        for (uint32_t y = SIZE / 3; y < SIZE * 5 / 8; y++)
            for (uint32_t x = 16; x < SIZE - 16; x++, count++) {
                double value = (double)picture.combined[4 * (y * SIZE + x)];
                sum += value;
                low = fmin(low, value);
                high = fmax(high, value);
            }
        contrast = fmax(contrast, high - low);
        most = before < 0.0 ? most : fmax(most, fabs(sum / count - before));
        before = sum / count;
        picture_free(&picture);
    }
    printf("chequered floor: mean %.4f, changes by %.5f from step to step, pixels differ by %.4f at most\n", before, most,
           contrast);
    assert_true(fabs(before - 0.5) < 0.01 && most < 0.002 && contrast < 0.02);
    patina_scene_destroy(scene);
    patina_mesh_destroy(mesh);
    patina_texture_destroy(texture);
    patina_device_destroy(device);
}

// Larger than its texels an image is bilinear: a ramp of two texels is straight between their middles.
static void linear_between(void **state)
{
    const uint8_t rgba[8] = {0, 0, 0, 255, 255, 255, 255, 255};
    (void)state;
    patina_device *device = support_device_first();
    patina_mesh *mesh = square(1.0, 0.0, 1.0);
    patina_texture *texture = image(2, 1, rgba, 0, PATINA_WRAP_EXTEND);
    patina_scene *scene = NULL;
    CHECK(patina_scene_create(&scene), NULL);
    add(scene, mesh, texture, PATINA_ALPHA_NONE, 1);
    const patina_camera camera = camera_orthographic(above, below, 2.0, SIZE, SIZE, 0.1, 10.0);
    patina_settings settings = settings_default(SIZE, SIZE);
    settings.smooth = PATINA_SMOOTH_OFF;
    struct picture picture = draw(device, scene, &camera, &settings);
    double worst = 0.0;
    for (uint32_t x = 1; x + 1 < SIZE; x++) {
        double expected = fmin(fmax(((x + 0.5) / SIZE - 0.25) / 0.5, 0.0), 1.0);
        worst = fmax(worst, fabs((double)picture.combined[4 * (SIZE / 2 * SIZE + x)] - expected));
    }
    printf("two texels: off the straight line by %.2g\n", worst);
    assert_true(worst < 1e-4);
    picture_free(&picture);
    patina_scene_destroy(scene);
    patina_mesh_destroy(mesh);
    patina_texture_destroy(texture);
    patina_device_destroy(device);
}

// A hole in an image: what lies behind shows, and the sun falls through.
static void cut_out(void **state)
{
    uint8_t rgba[16 * 16 * 4];
    (void)state;
    for (int i = 0; i < 16 * 16; i++) {
        int hole = i % 16 >= 4 && i % 16 < 12 && i / 16 >= 4 && i / 16 < 12;
        const uint8_t c[4] = {255, 0, 0, (uint8_t)(hole ? 0 : 255)};
        memcpy(rgba + 4 * i, c, 4);
    }
    patina_device *device = support_device_first();
    patina_mesh *sheet = square(0.5, 1.0, 1.0), *floor = square(2.0, 0.0, 1.0);
    patina_texture *texture = image(16, 16, rgba, 1, PATINA_WRAP_REPEAT);
    patina_scene *scene = NULL;
    patina_frame *frame = NULL;
    float *shadow = malloc(SIZE * SIZE * sizeof *shadow);
    CHECK(patina_scene_create(&scene), NULL);
    add(scene, sheet, texture, PATINA_ALPHA_CLIP, 0);
    mesh_add(scene, floor, 0.0f, 0.0f, 1.0f);
    const patina_light_desc sun = {
        .struct_size = sizeof sun, .type = PATINA_LIGHT_SUN, .power = 3.0f, .direction = {0.7, 0, -0.7}, .shadows = 1};
    CHECK(patina_scene_add_light(scene, &sun), scene);
    const patina_camera camera = camera_orthographic(above, below, 4.0, SIZE, SIZE, 0.1, 10.0); // 32 pixels a unit
    patina_settings settings = settings_default(SIZE, SIZE);
    CHECK(patina_scene_set_camera(scene, &camera), scene);
    CHECK(patina_scene_set_settings(scene, &settings), scene);
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_frame_render(frame, scene), frame);
    struct picture picture = picture_read(frame);
    CHECK(patina_frame_read(frame, PATINA_PASS_SHADOW, shadow, SIZE * SIZE * sizeof *shadow), frame);
    const uint32_t row = SIZE / 2 * SIZE, hole = row + SIZE / 2, rim = row + SIZE / 2 + 12; // of the sheet, 0.375 aside
    printf("cut out: depth %.3f in the hole, %.3f on the rim; shadow %.2f under the rim, %.2f under the hole\n",
           (double)picture.depth[hole], (double)picture.depth[rim], (double)shadow[rim + 32], (double)shadow[hole + 32]);
    assert_true(fabs((double)picture.depth[hole] - 4.9) < 1e-4 && fabs((double)picture.depth[rim] - 3.9) < 1e-4);
    assert_true(shadow[rim + 32] == 0.0f && shadow[hole + 32] == 1.0f); // the sun moves it by its height
    picture_free(&picture);
    free(shadow);
    patina_frame_destroy(frame);
    patina_scene_destroy(scene);
    patina_mesh_destroy(sheet);
    patina_mesh_destroy(floor);
    patina_texture_destroy(texture);
    patina_device_destroy(device);
}

// Two panes of half opacity over a floor: a quarter of the floor comes through, and the film where there is none.
static void blended(void **state)
{
    const uint8_t red[4] = {255, 0, 0, 128}, green[4] = {0, 255, 0, 128}, blue[4] = {0, 0, 255, 255};
    (void)state;
    patina_device *device = support_device_first();
    patina_mesh *meshes[3] = {square(1.0, 1.0, 1.0), square(1.0, 0.5, 1.0), square(0.5, 0.0, 1.0)};
    patina_texture *textures[3] = {image(1, 1, red, 0, 0), image(1, 1, green, 0, 0), image(1, 1, blue, 0, 0)};
    patina_scene *scene = NULL;
    CHECK(patina_scene_create(&scene), NULL);
    for (int i = 0; i < 3; i++)
        add(scene, meshes[i], textures[i], PATINA_ALPHA_BLEND, 1);
    const patina_camera camera = camera_orthographic(above, below, 4.0, SIZE, SIZE, 0.1, 10.0);
    patina_settings settings = settings_default(SIZE, SIZE);
    struct picture picture = draw(device, scene, &camera, &settings);
    const double a = 128.0 / 255.0, b = 1.0 - a, expected[2][4] = {{a, b * a, b * b, 1.0}, {a, b * a, 0.0, 1.0 - b * b}};
    const uint32_t at[2] = {SIZE / 2 * SIZE + SIZE / 2, SIZE / 2 * SIZE + SIZE / 2 + 24};
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 4; k++)
            assert_true(fabs((double)picture.combined[4 * at[i] + (uint32_t)k] - expected[i][k]) < 1e-4);
    picture_free(&picture);
    patina_scene_destroy(scene);
    for (int i = 0; i < 3; i++) {
        patina_mesh_destroy(meshes[i]);
        patina_texture_destroy(textures[i]);
    }
    patina_device_destroy(device);
}

// Holes, glass of points and of images, shadows on what lies behind: a region is the picture's crop, and threads change nothing.
static void region_is_a_crop(void **state)
{
    uint8_t rgba[32 * 32 * 4];
    (void)state;
    for (int i = 0; i < 32 * 32 * 4; i++)
        rgba[i] = (uint8_t)((i * 2654435761u) >> 24);
    struct points points = points_sphere(30000, 0.6, POINTS_NORMALS, 3);
    patina_cloud *cloud = points_upload(&points);
    points_free(&points);
    patina_texture *texture = image(32, 32, rgba, 0, PATINA_WRAP_REPEAT);
    patina_mesh *pane = square(0.9, 0.9, 2.0), *floor = square(2.0, -0.7, 3.0);
    const patina_cloud_style style = {.struct_size = sizeof style, .transparency = 0.4f};
    patina_scene *scene = scene_of(cloud, &style);
    add(scene, pane, texture, PATINA_ALPHA_BLEND, 0);
    add(scene, floor, texture, PATINA_ALPHA_NONE, 0);
    const patina_light_desc sun = {.struct_size = sizeof sun,
                                   .type = PATINA_LIGHT_SUN,
                                   .power = 3.0f,
                                   .direction = {-0.5, 0.2, -1.0},
                                   .angle = 0.1f,
                                   .shadows = 1};
    CHECK(patina_scene_add_light(scene, &sun), scene);
    const double eye[3] = {1.5, -4.0, 3.0};
    const patina_camera camera = camera_perspective(eye, below, 45.0, SIZE, SIZE, 0.1, 100.0);
    patina_settings settings = settings_default(SIZE, SIZE);
    settings.shadow_samples = 4;
    patina_device *device = support_device_first(), *alone = support_device_open(support_device_name(0), 1, 3);
    struct picture whole = picture_render(device, scene, &camera, &settings),
                   same = picture_render(alone, scene, &camera, &settings);
    picture_assert_identical(&same, &whole, 0, 0, "one thread");
    settings.region[0] = 31;
    settings.region[1] = 40;
    settings.region[2] = 97;
    settings.region[3] = 88;
    struct picture part = picture_render(device, scene, &camera, &settings);
    picture_assert_identical(&part, &whole, 31, 40, "a region with images");
    picture_free(&part);
    picture_free(&same);
    picture_free(&whole);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    patina_mesh_destroy(pane);
    patina_mesh_destroy(floor);
    patina_texture_destroy(texture);
    patina_device_destroy(alone);
    patina_device_destroy(device);
}

// A floor behind glass of points lies in shadow where a beam stands over it: the layer behind is tested, too.
static void shadow_behind_glass(void **state)
{
    static const double middle[3] = {0.0, 0.0, 1.5}, half[3] = {0.15, 3.0, 0.05};
    (void)state;
    struct points points = points_rectangle(40000, 3.0, 3.0, POINTS_NORMALS, 5); // z = 0
    patina_cloud *cloud = points_upload(&points);
    points_free(&points);
    patina_mesh *floor = square(2.0, -0.5, 1.0), *beam = mesh_box(middle, half);
    const patina_cloud_style style = {.struct_size = sizeof style,
                                      .transparency = 0.5f,
                                      .lighting = PATINA_LIGHTING_UNLIT,
                                      .exact = 1,
                                      .shadow_off = PATINA_SHADOW_NO_CAST};
    patina_scene *scene = scene_of(cloud, &style);
    mesh_add(scene, floor, 1.0f, 1.0f, 1.0f);
    mesh_add(scene, beam, 1.0f, 1.0f, 1.0f);
    const patina_light_desc sun = {
        .struct_size = sizeof sun, .type = PATINA_LIGHT_SUN, .power = 3.14159265f, .direction = {0.5, 0, -1.0}, .shadows = 1};
    CHECK(patina_scene_add_light(scene, &sun), scene);
    patina_device *device = support_device_first();
    const patina_camera camera = camera_orthographic(above, below, 4.0, SIZE, SIZE, 0.1, 10.0);
    patina_settings settings = settings_default(SIZE, SIZE);
    struct picture picture = draw(device, scene, &camera, &settings);
    const uint32_t row = SIZE / 2 * SIZE + SIZE / 2; // the beam's shadow lies a unit, 32 pixels, to the right of it
    const double dark = (double)picture.combined[4 * (row + 32)], lit = (double)picture.combined[4 * (row - 32)];
    printf("behind glass: %.3f in the shadow, %.3f beside it\n", dark, lit);
    assert_true(dark < 1e-3 && fabs(lit - 0.5 * 2.0 / sqrt(5.0)) < 0.01);
    picture_free(&picture);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    patina_mesh_destroy(floor);
    patina_mesh_destroy(beam);
    patina_device_destroy(device);
}

// In a viewport: one sample after a change, more while nothing does; a mesh may leave shadows out.
static void progressive(void **state)
{
    static const double middle[3] = {0.0, 0.0, 1.0}, half[3] = {0.5, 0.5, 0.05};
    (void)state;
    patina_mesh *floor = square(2.0, 0.0, 1.0), *slab = mesh_box(middle, half);
    patina_scene *scene = NULL;
    CHECK(patina_scene_create(&scene), NULL);
    mesh_add(scene, floor, 1.0f, 1.0f, 1.0f);
    mesh_add(scene, slab, 1.0f, 1.0f, 1.0f);
    const patina_light_desc sun = {.struct_size = sizeof sun,
                                   .type = PATINA_LIGHT_SUN,
                                   .power = 3.0f,
                                   .direction = {0.5, 0, -1.0},
                                   .angle = 0.2f,
                                   .shadows = 1};
    CHECK(patina_scene_add_light(scene, &sun), scene);
    patina_device *device = support_device_first();
    patina_camera camera = camera_orthographic(above, below, 4.0, SIZE, SIZE, 0.1, 10.0);
    patina_settings settings = settings_default(SIZE, SIZE);
    settings.shadow_samples = 8;
    settings.shadow_progressive = 1;
    patina_frame *frame = NULL;
    CHECK(patina_scene_set_camera(scene, &camera), scene);
    CHECK(patina_scene_set_settings(scene, &settings), scene);
    CHECK(patina_frame_create(device, &frame), device);
    const uint32_t expected[] = {1, 2, 4, 8, 8, 1, 2};
    for (int i = 0; i < 7; i++) {
        patina_frame_stats stats = {.struct_size = sizeof stats};
        if (i == 5) {
            camera.left += 0.25;
            camera.right += 0.25;
            CHECK(patina_scene_set_camera(scene, &camera), scene);
        }
        CHECK(patina_frame_render(frame, scene), frame);
        CHECK(patina_frame_get_stats(frame, &stats), frame);
        assert_int_equal(stats.shadow_maps, expected[i]);
        assert_int_equal(stats.shadow_pending != 0, expected[i] < 8);
    }
    patina_frame_destroy(frame);
    patina_scene_destroy(scene);
    patina_mesh_destroy(floor);
    patina_mesh_destroy(slab);
    patina_device_destroy(device);
}

static void refuses(void **state)
{
    const uint8_t rgba[4] = {1, 2, 3, 4};
    const float odd[8] = {NAN, INFINITY, -1.0f, NAN, 0.5f, 1e30f, 2.0f, -3.0f};
    patina_texture_desc desc = {.struct_size = sizeof desc, .pixels = {.data = rgba, .type = PATINA_UINT8, .components = 4}};
    patina_texture *texture = NULL;
    (void)state;
    assert_int_equal(patina_texture_create(&desc, &texture), PATINA_ERROR_ARGUMENT);
    assert_non_null(strstr(support_message(NULL), "0 x 0 texels"));
    desc.width = desc.height = 1;
    desc.wrap = 3;
    assert_int_equal(patina_texture_create(&desc, &texture), PATINA_ERROR_ARGUMENT);
    desc.wrap = 0;
    desc.width = 16385;
    assert_int_equal(patina_texture_create(&desc, &texture), PATINA_ERROR_ARGUMENT);
    desc.width = 1;
    desc.pixels.components = 2;
    assert_int_equal(patina_texture_create(&desc, &texture), PATINA_ERROR_ARGUMENT);
    desc.pixels.data = NULL;
    assert_int_equal(patina_texture_create(&desc, &texture), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_texture_create(NULL, &texture), PATINA_ERROR_ARGUMENT);
    assert_null(texture);
    patina_texture_destroy(NULL);
    // numbers that are none are taken; a mesh without uv is not painted
    desc.width = 2;
    desc.pixels = (patina_array){.data = odd, .type = PATINA_FLOAT32, .components = 4};
    CHECK(patina_texture_create(&desc, &texture), NULL);
    static const double middle[3] = {0, 0, 0}, half[3] = {1, 1, 1};
    patina_mesh *box = mesh_box(middle, half), *pane = square(1.0, 0.0, 1.0);
    patina_scene *scene = NULL;
    CHECK(patina_scene_create(&scene), NULL);
    patina_mesh_style style = {.struct_size = sizeof style, .texture = texture};
    assert_int_equal(patina_scene_add_mesh(scene, box, &style), PATINA_ERROR_ARGUMENT);
    assert_non_null(strstr(support_message(scene), "no uv"));
    style.alpha = 3;
    assert_int_equal(patina_scene_add_mesh(scene, pane, &style), PATINA_ERROR_ARGUMENT);
    style.alpha = PATINA_ALPHA_CLIP;
    style.alpha_least = NAN;
    assert_int_equal(patina_scene_add_mesh(scene, pane, &style), PATINA_ERROR_ARGUMENT);
    style.alpha_least = 0.0f;
    CHECK(patina_scene_add_mesh(scene, pane, &style), scene);
    patina_device *device = support_device_first();
    const patina_camera camera = camera_orthographic(above, below, 4.0, SIZE, SIZE, 0.1, 10.0);
    patina_settings settings = settings_default(SIZE, SIZE);
    struct picture picture = draw(device, scene, &camera, &settings);
    for (uint32_t i = 0; i < SIZE * SIZE * 4; i++)
        assert_true(isfinite(picture.combined[i]));
    picture_free(&picture);
    patina_scene_destroy(scene);
    patina_mesh_destroy(box);
    patina_mesh_destroy(pane);
    patina_texture_destroy(texture);
    patina_device_destroy(device);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(texel_by_texel),
        cmocka_unit_test(small_is_even),
        cmocka_unit_test(linear_between),
        cmocka_unit_test(cut_out),
        cmocka_unit_test(blended),
        cmocka_unit_test(region_is_a_crop),
        cmocka_unit_test(shadow_behind_glass),
        cmocka_unit_test(progressive),
        cmocka_unit_test(refuses),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
