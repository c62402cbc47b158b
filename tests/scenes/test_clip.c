// SPDX-License-Identifier: GPL-3.0-or-later
// Clips and hidden classes in whole pictures: every pixel shows the nearest point that is left, by float64; what is whole
// or gone as chunks is told from what is divided; shadows follow; every device agrees.
#include "clouds.h"
#include "support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { COUNT = 60000, WIDTH = 200, HEIGHT = 150, MOST_CLIPS = 4 };

struct stage {
    struct points points;
    uint8_t *classes;
    float *scalars;
    patina_cloud *cloud;
    patina_camera camera;
    patina_settings settings;
};

static struct stage set_stage(void)
{
    static const double eye[3] = {0.5, -4.0, 1.5}, target[3] = {0.0, 0.0, 0.0};
    struct stage stage = {.points = points_torus(COUNT, 1.0, 0.45, POINTS_ALL, 5),
                          .classes = malloc(COUNT),
                          .scalars = malloc(COUNT * sizeof(float))};
    for (int i = 0; i < COUNT; i++) {
        const float *p = stage.points.position + 3 * i;
        stage.classes[i] = p[0] > 0.3f ? 5 : i % 3 ? 2 : 200; // a side of its own, and two mixed
        stage.scalars[i] = p[2];
    }
    patina_cloud_desc desc = points_desc(&stage.points);
    desc.classes = (patina_array){stage.classes, PATINA_UINT8, 1, 0};
    desc.scalar = (patina_array){stage.scalars, PATINA_FLOAT32, 1, 0};
    CHECK(patina_cloud_create(&desc, NULL, &stage.cloud), NULL);
    stage.camera = camera_perspective(eye, target, 40.0, WIDTH, HEIGHT, 0.1, 100.0);
    stage.settings = settings_default(WIDTH, HEIGHT);
    stage.settings.fill = PATINA_FILL_OFF;
    return stage;
}

static void clear_stage(struct stage *stage)
{
    points_free(&stage->points);
    free(stage->classes);
    free(stage->scalars);
    patina_cloud_destroy(stage->cloud);
}

// x, y, z axes as rows of `axes`, each times its half size; around `middle`.
static patina_clip clip_at(uint32_t shape, uint32_t cut, double mx, double my, double mz, double hx, double hy, double hz,
                           double turn)
{
    const double c = cos(turn), s = sin(turn);
    return (patina_clip){.struct_size = sizeof(patina_clip),
                         .world_from_clip = {hx * c, -hy * s, 0, mx, hx * s, hy * c, 0, my, 0, 0, hz, mz, 0, 0, 0, 1},
                         .shape = shape,
                         .cut = cut};
}

// -1: too close to the cut to tell.
static int is_left(const patina_clip *clips, uint32_t count, const float p[3])
{
    int keeping = 0, kept = 0, near = 0;
    for (uint32_t i = 0; i < count; i++) {
        const double *m = clips[i].world_from_clip;
        double d[3] = {p[0] - m[3], p[1] - m[7], p[2] - m[11]}, out = -INFINITY;
        for (int k = 0; k < 3; k++) { // columns are at right angles
            double square = m[k] * m[k] + m[4 + k] * m[4 + k] + m[8 + k] * m[8 + k];
            double q = (d[0] * m[k] + d[1] * m[4 + k] + d[2] * m[8 + k]) / square;
            if (clips[i].shape == PATINA_CLIP_PLANE)
                out = q; // the last
            else
                out = fmax(out, square > 0.0 ? fabs(q) - 1.0 : INFINITY);
        }
        near |= fabs(out) < 1e-5;
        if (clips[i].shape == PATINA_CLIP_BOX && !clips[i].cut) {
            keeping = 1;
            kept |= out <= 0.0;
        } else if (clips[i].shape == PATINA_CLIP_PLANE ? (clips[i].cut ? out < 0.0 : out > 0.0) : out <= 0.0) {
            return near ? -1 : 0;
        }
    }
    return near ? -1 : kept || !keeping;
}

static patina_scene *scene_with(const struct stage *stage, const patina_clip *clips, uint32_t count,
                                const patina_cloud_style *style)
{
    patina_scene *scene = scene_of(stage->cloud, style);
    for (uint32_t i = 0; i < count; i++)
        CHECK(patina_scene_add_clip(scene, &clips[i]), scene);
    return scene;
}

// The picture with clips against the one without: a point that was in front and is left stays, bit for bit; another gives way
// to one farther off that is left. Keys are equal on all devices. Returns the pixels covered.
static uint64_t check_clips(const struct stage *stage, const patina_clip *clips, uint32_t count, const char *what)
{
    uint64_t *first = NULL, covered = 0;
    for (uint32_t k = 0; k < support_device_count(); k++) {
        patina_device *device = support_device_open(support_device_name(k), 0, 0);
        if (!device)
            continue;
        patina_scene *whole = scene_with(stage, NULL, 0, NULL), *cut = scene_with(stage, clips, count, NULL);
        struct picture before = picture_render(device, whole, &stage->camera, &stage->settings);
        struct picture after = picture_render(device, cut, &stage->camera, &stage->settings);
        covered = picture_count(&after);
        for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
            uint64_t a = before.keys[i], b = after.keys[i];
            int stays = a == KEY_EMPTY ? 0 : is_left(clips, count, stage->points.position + 3 * key_id(a));
            int shown = b == KEY_EMPTY ? 1 : is_left(clips, count, stage->points.position + 3 * key_id(b));
            if ((stays == 1 && a != b) || (stays == 0 && a != KEY_EMPTY && b <= a) || shown == 0)
                support_die("%s, %s: pixel %u: key %016llx became %016llx", what, support_device_name(k), i,
                            (unsigned long long)a, (unsigned long long)b);
            if (first && first[i] != b)
                support_die("%s, %s: pixel %u: key %016llx, the first device has %016llx", what, support_device_name(k), i,
                            (unsigned long long)b, (unsigned long long)first[i]);
        }
        if (!first) {
            first = malloc(sizeof *first * WIDTH * HEIGHT);
            memcpy(first, after.keys, sizeof *first * WIDTH * HEIGHT);
        }
        picture_free(&before);
        picture_free(&after);
        patina_scene_destroy(whole);
        patina_scene_destroy(cut);
        patina_device_destroy(device);
    }
    free(first);
    return covered;
}

static void test_shapes(void **state)
{
    struct stage stage = set_stage();
    const patina_clip box = clip_at(0, 0, 0.6, 0, 0, 0.7, 0.8, 0.3, 0.4),
                      other = clip_at(0, 0, -0.9, -0.5, 0, 0.4, 0.5, 1, -0.3);
    const patina_clip hole = clip_at(0, 1, 0.5, -0.9, 0.2, 0.3, 0.4, 0.5, 0.9), plane = clip_at(1, 0, 0, 0, 0.1, 2, 3, 1, 0);
    const patina_clip above = clip_at(1, 1, 0, 0, 0.1, 2, 3, 1, 0), mirrored = clip_at(0, 0, 0.6, 0, 0, -0.7, 0.8, -0.3, 0.4);
    const patina_clip sets[][MOST_CLIPS] = {{box},        {hole},     {plane},     {above},
                                            {box, other}, {mirrored}, {box, hole}, {box, other, hole, plane}};
    static const uint32_t counts[] = {1, 1, 1, 1, 2, 1, 2, 4};
    static const char *const names[] = {"box",       "hole",         "plane",        "turned plane",
                                        "two boxes", "mirrored box", "box and hole", "all"};
    (void)state;
    uint64_t pixels[8];
    for (int i = 0; i < 8; i++)
        pixels[i] = check_clips(&stage, sets[i], counts[i], names[i]);
    assert_true(pixels[0] > 500 && pixels[4] > pixels[0]); // another box keeps more
    assert_true(pixels[5] == pixels[0]);                   // mirrored about its own axes: the same box
    assert_true(pixels[6] < pixels[0]);
    stage.settings.surface = PATINA_SURFACE_SPLATS;
    assert_true(check_clips(&stage, sets[7], counts[7], "discs") > pixels[7]);
    clear_stage(&stage);
}

static void test_hard_shapes(void **state)
{
    struct stage stage = set_stage();
    const double eye_x = stage.camera.world_from_camera[3], eye_y = stage.camera.world_from_camera[7];
    const double eye_z = stage.camera.world_from_camera[11];
    const patina_clip flat = clip_at(0, 0, 0, 0, 0, 1, 1, 0, 0), flat_hole = clip_at(0, 1, 0, 0, 0, 1, 1, 0, 0);
    const patina_clip point = clip_at(0, 0, 0, 0, 0, 0, 0, 0, 0), flat_plane = clip_at(1, 0, 0, 0, 0, 1, 1, 0, 0);
    const patina_clip no_plane = clip_at(1, 0, 0, 0, 0, 1, 0, 1, 0), huge = clip_at(0, 0, 1e7, 0, 0, 1e7, 1e7, 1e7, 0.1);
    const patina_clip camera = clip_at(0, 1, eye_x, eye_y, eye_z, 2, 4, 2, 0), far = clip_at(0, 0, 5e6, 5e6, 5e6, 1, 1, 1, 0);
    (void)state;
    assert_int_equal(check_clips(&stage, &flat, 1, "flat box"), 0);
    assert_int_equal(check_clips(&stage, &point, 1, "box of no size"), 0);
    assert_int_equal(check_clips(&stage, &far, 1, "far box"), 0);
    assert_true(check_clips(&stage, &flat_hole, 1, "flat hole") > 3000);
    assert_true(check_clips(&stage, &camera, 1, "box around the camera") > 100);
    assert_true(check_clips(&stage, &huge, 1, "huge box") > 1000);
    // flat along its normal, it still has one: as the same plane of unit scale
    const patina_clip plane = clip_at(1, 0, 0, 0, 0, 1, 1, 1, 0);
    patina_device *device = support_device_first();
    patina_scene *a = scene_with(&stage, &flat_plane, 1, NULL), *b = scene_with(&stage, &plane, 1, NULL);
    struct picture first = picture_render(device, a, &stage.camera, &stage.settings);
    struct picture second = picture_render(device, b, &stage.camera, &stage.settings);
    picture_assert_identical(&first, &second, 0, 0, "a flat plane");
    picture_free(&first);
    picture_free(&second);
    patina_scene *c = scene_with(&stage, &no_plane, 1, NULL), *d = scene_with(&stage, NULL, 0, NULL);
    first = picture_render(device, c, &stage.camera, &stage.settings);
    second = picture_render(device, d, &stage.camera, &stage.settings);
    picture_assert_identical(&first, &second, 0, 0, "a plane without an axis");
    picture_free(&first);
    picture_free(&second);
    patina_scene_destroy(c);
    patina_scene_destroy(d);
    patina_scene_destroy(a);
    patina_scene_destroy(b);
    patina_device_destroy(device);
    clear_stage(&stage);
}

static void test_refusals(void **state)
{
    patina_scene *scene;
    (void)state;
    CHECK(patina_scene_create(&scene), NULL);
    patina_clip clip = clip_at(0, 0, NAN, 0, 0, 1, 1, 1, 0);
    assert_int_equal(patina_scene_add_clip(scene, &clip), PATINA_ERROR_ARGUMENT);
    assert_non_null(strstr(support_message(scene), "not finite"));
    clip = clip_at(2, 0, 0, 0, 0, 1, 1, 1, 0);
    assert_int_equal(patina_scene_add_clip(scene, &clip), PATINA_ERROR_ARGUMENT);
    clip = clip_at(0, 0, 0, 0, 0, 1, 1, 1, 0);
    clip.tint_width = -1.0f;
    assert_int_equal(patina_scene_add_clip(scene, &clip), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_scene_add_clip(scene, NULL), PATINA_ERROR_ARGUMENT);
    patina_scene_destroy(scene);
}

// A cloud may opt out; chunks that are gone or whole are not sifted; a region is a crop of the whole.
static void test_chunks(void **state)
{
    struct stage stage = set_stage();
    const patina_clip box = clip_at(0, 0, 0.6, 0, 0, 0.7, 0.8, 0.3, 0.4);
    const patina_cloud_style spared = {.struct_size = sizeof spared, .clip_off = 1};
    (void)state;
    patina_device *device = support_device_first();
    patina_scene *whole = scene_with(&stage, NULL, 0, NULL), *cut = scene_with(&stage, &box, 1, NULL);
    patina_scene *out = scene_with(&stage, &box, 1, &spared);
    struct picture a = picture_render(device, whole, &stage.camera, &stage.settings);
    struct picture b = picture_render(device, out, &stage.camera, &stage.settings);
    picture_assert_identical(&b, &a, 0, 0, "a cloud that clips leave alone");
    patina_frame *frame;
    patina_frame_stats stats = {.struct_size = sizeof stats};
    char text[8192];
    CHECK(patina_scene_set_camera(cut, &stage.camera), cut);
    CHECK(patina_scene_set_settings(cut, &stage.settings), cut);
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_frame_render(frame, cut), frame);
    CHECK(patina_frame_get_stats(frame, &stats), frame);
    assert_true(stats.chunks_clipped > 0 && stats.chunks_cut > 0);
    assert_true(stats.chunks_clipped <= stats.chunks_culled && stats.chunks_clipped + stats.chunks_cut <= stats.chunks);
    assert_true(patina_frame_plan_text(frame, cut, text, sizeof text) < sizeof text);
    assert_non_null(strstr(text, "chunks clipped"));
    assert_non_null(strstr(text, "run  sift"));
    struct picture all = picture_read(frame);
    stage.settings.region[0] = 40;
    stage.settings.region[1] = 30;
    stage.settings.region[2] = 150;
    stage.settings.region[3] = 110;
    struct picture part = picture_render(device, cut, &stage.camera, &stage.settings);
    picture_assert_identical(&part, &all, 40, 30, "a region of a clipped scene");
    picture_free(&a);
    picture_free(&b);
    picture_free(&all);
    picture_free(&part);
    patina_frame_destroy(frame);
    patina_scene_destroy(whole);
    patina_scene_destroy(cut);
    patina_scene_destroy(out);
    patina_device_destroy(device);
    clear_stage(&stage);
}

static void test_classes(void **state)
{
    struct stage stage = set_stage();
    patina_cloud_style style = {.struct_size = sizeof style};
    (void)state;
    style.hidden_classes[0] = 1u << 2;
    style.hidden_classes[200 / 32] = 1u << 200 % 32;
    for (uint32_t k = 0; k < support_device_count(); k++) {
        patina_device *device = support_device_open(support_device_name(k), 0, 0);
        if (!device)
            continue;
        patina_scene *scene = scene_of(stage.cloud, &style), *whole = scene_of(stage.cloud, NULL);
        struct picture picture = picture_render(device, scene, &stage.camera, &stage.settings);
        struct picture before = picture_render(device, whole, &stage.camera, &stage.settings);
        assert_true(picture_count(&picture) > 1000);
        for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
            uint64_t a = before.keys[i], b = picture.keys[i];
            if ((b != KEY_EMPTY && stage.classes[key_id(b)] != 5) ||
                (a != KEY_EMPTY && stage.classes[key_id(a)] == 5 && a != b))
                support_die("%s: pixel %u shows %016llx", support_device_name(k), i, (unsigned long long)b);
        }
        picture_free(&picture);
        picture_free(&before);
        patina_scene_destroy(scene);
        patina_scene_destroy(whole);
        patina_device_destroy(device);
    }
    patina_cloud_info info = {.struct_size = sizeof info};
    CHECK(patina_cloud_get_info(stage.cloud, &info), stage.cloud);
    assert_int_equal(info.class_bits[0], 1u << 2 | 1u << 5);
    assert_int_equal(info.class_bits[6], 1u << 200 % 32);
    clear_stage(&stage);
}

// A wall of points between a sun and a floor: its shadow goes with what a clip or a hidden class takes, unless it is asked to
// stay. Returns the mean of the shadow pass over the middle of the floor.
static double shade_of_wall(patina_device *device, const patina_clip *clip, uint32_t uncut, uint32_t hide)
{
    enum { FLOOR = 40000, WALL = 20000, SIDE = 128 };
    struct points points = points_create(FLOOR + WALL, POINTS_NORMALS);
    uint8_t *classes = calloc(FLOOR + WALL, 1);
    struct pcg random = pcg_seed(3);
    for (int i = 0; i < FLOOR + WALL; i++) {
        float *p = points.position + 3 * i;
        double size = i < FLOOR ? 2.0 : 0.6;
        p[0] = (float)pcg_between(&random, -size, size);
        p[1] = (float)pcg_between(&random, -size, size);
        p[2] = i < FLOOR ? 0.0f : 1.0f;
        points.normal[3 * i + 2] = 1.0f;
        classes[i] = i < FLOOR ? 2 : 6;
    }
    patina_cloud_desc desc = points_desc(&points);
    desc.classes = (patina_array){classes, PATINA_UINT8, 1, 0};
    patina_cloud *cloud;
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    patina_cloud_style style = {.struct_size = sizeof style, .lighting = PATINA_LIGHTING_LIT};
    style.hidden_classes[0] = hide ? 1u << 6 : 0;
    patina_scene *scene = scene_of(cloud, &style);
    patina_light_desc sun = {.struct_size = sizeof sun, .type = PATINA_LIGHT_SUN, .power = 1.0f, .shadows = 1};
    CHECK(patina_scene_add_light(scene, &sun), scene);
    if (clip)
        CHECK(patina_scene_add_clip(scene, clip), scene);
    static const double eye[3] = {0.0, -5.0, 0.5}, target[3] = {0.0, 0.0, 0.0}; // under the wall
    patina_camera camera = camera_perspective(eye, target, 10.0, SIDE, SIDE, 0.1, 20.0);
    patina_settings settings = settings_default(SIDE, SIDE);
    settings.shadow_uncut = uncut;
    CHECK(patina_scene_set_camera(scene, &camera), scene);
    CHECK(patina_scene_set_settings(scene, &settings), scene);
    patina_frame *frame;
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_frame_render(frame, scene), frame);
    static float shadow[SIDE * SIDE];
    CHECK(patina_frame_read(frame, PATINA_PASS_SHADOW, shadow, sizeof shadow), frame);
    double sum = 0.0;
    for (int y = 60; y < 68; y++)
        for (int x = 54; x < 74; x++)
            sum += (double)shadow[y * SIDE + x] / 160.0;
    patina_frame_destroy(frame);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    points_free(&points);
    free(classes);
    return sum;
}

static void test_shadows(void **state)
{
    const patina_clip half = clip_at(1, 0, 0, 0, 0.5, 1, 1, 1, 0); // what lies above z = 0.5 goes
    patina_device *device = support_device_first();
    (void)state;
    assert_true(shade_of_wall(device, NULL, 0, 0) < 0.02);
    assert_true(shade_of_wall(device, &half, 0, 0) > 0.98);
    assert_true(shade_of_wall(device, &half, 1, 0) < 0.02); // cut from the picture alone
    assert_true(shade_of_wall(device, NULL, 0, 1) > 0.98);
    patina_device_destroy(device);
}

// Red within 0.2 of the cut, nowhere else; the same on all devices but for rounding.
static void test_tint(void **state)
{
    struct stage stage = set_stage();
    patina_clip plane = clip_at(1, 0, 0, 0, 0.1, 2, 3, 1, 0);
    plane.tint[0] = 1.0f;
    plane.tint_strength = 1.0f;
    plane.tint_width = 0.2f;
    stage.settings.fill = PATINA_FILL_CLOSED;
    stage.settings.smooth = PATINA_SMOOTH_OFF;
    stage.settings.antialias = PATINA_ANTIALIAS_OFF;
    (void)state;
    for (uint32_t k = 0; k < support_device_count(); k++) {
        patina_device *device = support_device_open(support_device_name(k), 0, 0);
        if (!device)
            continue;
        patina_scene *scene = scene_with(&stage, &plane, 1, NULL);
        struct picture picture = picture_render(device, scene, &stage.camera, &stage.settings);
        uint64_t tinted = 0, plain = 0;
        for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
            double origin[3], direction[3];
            const float *c = picture.combined + 4 * i;
            if (picture.keys[i] == KEY_EMPTY)
                continue;
            camera_ray(&stage.camera, WIDTH, HEIGHT, i % WIDTH + 0.5, i / WIDTH + 0.5, origin, direction);
            double height = origin[2] + (double)picture.depth[i] * direction[2];
            int red = fabs((double)c[0] - 1.0) < 1e-5 && fabsf(c[1]) < 1e-5f;
            if (height > -0.07 && !red)
                support_die("%s: pixel %u at height %g is not tinted", support_device_name(k), i, height);
            if (height < -0.13 && red)
                support_die("%s: pixel %u at height %g is tinted", support_device_name(k), i, height);
            tinted += red != 0;
            plain += !red;
        }
        assert_true(tinted > 500 && plain > 500);
        picture_free(&picture);
        patina_scene_destroy(scene);
        patina_device_destroy(device);
    }
    clear_stage(&stage);
}

// Ramps in a whole picture: heights of pixels, scalars of points, the automatic range; automatic lighting is lit.
static void test_ramps(void **state)
{
    struct stage stage = set_stage();
    static const uint32_t sources[] = {PATINA_COLOR_SCALAR, PATINA_COLOR_HEIGHT, PATINA_COLOR_OBJECT_HEIGHT};
    stage.settings.smooth = PATINA_SMOOTH_OFF;
    stage.settings.antialias = PATINA_ANTIALIAS_OFF;
    (void)state;
    float range[2];
    CHECK(patina_cloud_scalar_range(stage.cloud, 0.0, range), stage.cloud);
    assert_true(fabsf(range[0] + 0.45f) < 1e-3f && fabsf(range[1] - 0.45f) < 1e-3f);
    CHECK(patina_cloud_scalar_range(stage.cloud, 0.25, range), stage.cloud);
    assert_true(range[0] > -0.4f && range[0] < -0.2f && range[1] < 0.4f && range[1] > 0.2f);
    for (int i = 0; i < 3; i++) {
        patina_cloud_style style = {.struct_size = sizeof style, .color_source = sources[i], .lighting = PATINA_LIGHTING_UNLIT};
        style.world_from_object[0] = style.world_from_object[5] = style.world_from_object[15] = 1.0;
        style.world_from_object[10] = i ? 2.0 : 1.0;
        style.world_from_object[11] = i ? 0.5 : 0.0;
        patina_device *device = support_device_first();
        patina_scene *scene = scene_of(stage.cloud, &style);
        struct picture picture = picture_render(device, scene, &stage.camera, &stage.settings);
        for (uint32_t at = 0; at < WIDTH * HEIGHT; at++) {
            double origin[3], direction[3];
            if (picture.keys[at] == KEY_EMPTY)
                continue;
            camera_ray(&stage.camera, WIDTH, HEIGHT, at % WIDTH + 0.5, at / WIDTH + 0.5, origin, direction);
            double z = origin[2] + (double)picture.depth[at] * direction[2]; // of the pixel: within half of one of its point
            z = i ? (z - 0.5) / 2.0 : z;
            double expected = fmin(fmax((z + 0.45) / 0.9, 0.0), 1.0), got = (double)picture.combined[4 * at];
            if (fabs(got - expected) > (i ? 2e-4 : 0.03))
                support_die("source %u: pixel %u at height %g is %g, expected %g", sources[i], at, z, got, expected);
        }
        picture_free(&picture);
        patina_scene_destroy(scene);
        patina_device_destroy(device);
    }
    patina_cloud_style wrong = {.struct_size = sizeof wrong, .color_source = 9};
    patina_scene *scene;
    CHECK(patina_scene_create(&scene), NULL);
    assert_int_equal(patina_scene_add_cloud(scene, stage.cloud, &wrong), PATINA_ERROR_ARGUMENT);
    wrong = (patina_cloud_style){.struct_size = sizeof wrong, .color_source = PATINA_COLOR_SCALAR};
    CHECK(patina_cloud_set_scalars(stage.cloud, &(patina_array){0}), stage.cloud);
    assert_int_equal(patina_scene_add_cloud(scene, stage.cloud, &wrong), PATINA_ERROR_ARGUMENT);
    assert_non_null(strstr(support_message(scene), "scalars"));
    assert_int_equal(patina_cloud_scalar_range(stage.cloud, 0.0, range), PATINA_ERROR_EMPTY);
    patina_scene_destroy(scene);
    clear_stage(&stage);
}

// Scalars of every type; a saved cloud has scalars and classes as before; ramps by name.
static void test_values(void **state)
{
    static const float positions[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {NAN, 0, 0}};
    static const float f32[4] = {-1.5f, 7.0f, NAN, INFINITY};
    static const double f64[4] = {-1.5, 7.0, 2.0, 3.0};
    static const uint8_t u8[4] = {1, 255, 3, 200};
    static const uint16_t u16[4] = {1, 65535, 3, 4};
    static const uint32_t u32[4] = {1, 4000000000u, 3, 4};
    static const int8_t i8[4] = {-128, 127, 0, 1};
    static const int16_t i16[4] = {-32768, 32767, 0, 1};
    static const int32_t i32[4] = {-2000000000, 2000000000, 0, 1};
    static const struct {
        patina_array array;
        float least, most;
    } known[] = {{{f32, PATINA_FLOAT32, 1, 0}, -1.5f, 7.0f},       {{f64, PATINA_FLOAT64, 1, 0}, -1.5f, 7.0f},
                 {{u8, PATINA_UINT8, 1, 0}, 1.0f, 255.0f},         {{u16, PATINA_UINT16, 1, 0}, 1.0f, 65535.0f},
                 {{u32, PATINA_UINT32, 1, 0}, 1.0f, 4e9f},         {{i8, PATINA_INT8, 1, 0}, -128.0f, 127.0f},
                 {{i16, PATINA_INT16, 1, 0}, -32768.0f, 32767.0f}, {{i32, PATINA_INT32, 1, 0}, -2e9f, 2e9f}};
    patina_cloud_desc desc = {.struct_size = sizeof desc, .count = 4, .position = {positions, PATINA_FLOAT32, 3, 0}};
    desc.classes = (patina_array){u8, PATINA_UINT8, 1, 0};
    patina_cloud *cloud;
    patina_cloud_info info = {.struct_size = sizeof info};
    char path[] = "/tmp/patina-test-XXXXXX";
    (void)state;
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        desc.scalar = known[i].array;
        CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
        CHECK(patina_cloud_get_info(cloud, &info), cloud);
        assert_true(info.has_scalars && info.scalar_range[0] == known[i].least && info.scalar_range[1] == known[i].most);
        assert_int_equal(info.class_bits[0], 1u << 1 | 1u << 3);
        assert_int_equal(info.class_bits[7], 1u << 31);
        assert_int_equal(info.class_bits[6], 0); // of a point that is not drawn
        patina_cloud_destroy(cloud);
    }
    desc.classes.type = PATINA_FLOAT32;
    assert_int_equal(patina_cloud_create(&desc, NULL, &cloud), PATINA_ERROR_ARGUMENT);
    assert_non_null(strstr(support_message(NULL), "classes"));
    struct stage stage = set_stage();
    patina_cloud *opened;
    int file = mkstemp(path);
    assert_true(file >= 0);
    close(file);
    CHECK(patina_cloud_save(stage.cloud, path), stage.cloud);
    CHECK(patina_cloud_open(path, &opened), NULL);
    unlink(path);
    patina_cloud_style style = {.struct_size = sizeof style, .color_source = PATINA_COLOR_SCALAR, .hidden_classes = {1u << 2}};
    patina_device *device = support_device_first();
    patina_scene *a = scene_of(stage.cloud, &style), *b = scene_of(opened, &style);
    struct picture first = picture_render(device, a, &stage.camera, &stage.settings);
    struct picture second = picture_render(device, b, &stage.camera, &stage.settings);
    picture_assert_identical(&second, &first, 0, 0, "a cloud that was saved and opened");
    picture_free(&first);
    picture_free(&second);
    patina_scene_destroy(a);
    patina_scene_destroy(b);
    patina_cloud_destroy(opened);
    patina_device_destroy(device);
    clear_stage(&stage);
    static const char *const names[] = {"grey", "viridis", "heat", "spectrum", "relief", "diverging", "classes"};
    static float ramp[PATINA_MAX_RAMP][3];
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        CHECK(patina_ramp(names[i], ramp), NULL);
        for (int k = 0; k < PATINA_MAX_RAMP; k++)
            for (int c = 0; c < 3; c++)
                assert_true(ramp[k][c] >= 0.0f && ramp[k][c] <= 1.0f);
    }
    assert_int_equal(patina_ramp("plaid", ramp), PATINA_ERROR_ARGUMENT);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_shapes), cmocka_unit_test(test_hard_shapes), cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_chunks), cmocka_unit_test(test_classes),     cmocka_unit_test(test_shadows),
        cmocka_unit_test(test_tint),   cmocka_unit_test(test_ramps),       cmocka_unit_test(test_values)};
    support_arguments(argc, argv);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
