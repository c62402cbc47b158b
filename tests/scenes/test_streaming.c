// SPDX-License-Identifier: GPL-3.0-or-later
// Clouds in files under a cap so small that every picture takes ten rounds or more: bytes equal to those without one (SPEC 13); and
// graphics memory that is smaller than clouds.
#include "clouds.h"
#include "packed.h"
#include "support.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { POINTS = 120000, WIDTH = 200, HEIGHT = 150, LEAST_ROUNDS = 10, SHARE = 60 };
enum { CAP_OF_COPIES = 360000 }; // two ranges of at least a chunk

static char path[] = "/tmp/patina-streaming-XXXXXX", path_of_glass[] = "/tmp/patina-streaming-XXXXXX";
// The same with positions that are packed, and with floats where these lie.
static char packed[2][32] = {"/tmp/patina-streaming-XXXXXX", "/tmp/patina-streaming-XXXXXX"};
static char rounded[2][32] = {"/tmp/patina-streaming-XXXXXX", "/tmp/patina-streaming-XXXXXX"};

// What a picture is of; everything zero: one torus, as settings have it.
struct look {
    const char *name;
    uint32_t surface, fill, quality, orthographic, glass, lit, lights, samples, lazy, layers, average, depth;
    uint32_t soft, model, by_field, cull, pair, pixel_samples, region;
    float sharpness, line;
    uint32_t clip, classes, kinds, ramp;
    uint32_t thin; // soft points a quarter as wide: OpenGL in software takes minutes for others
};

static const struct look looks[] = {
    {.name = "as it comes"},
    {.name = "filled as in the paper", .fill = PATINA_FILL_PAPER, .quality = PATINA_QUALITY_PAPER},
    {.name = "discs", .surface = PATINA_SURFACE_SPLATS},
    {.name = "range images", .surface = PATINA_SURFACE_RANGES},
    {.name = "range images in two passes", .surface = PATINA_SURFACE_RANGES, .sharpness = 0.7f},
    {.name = "orthographic, not filled", .orthographic = 1, .fill = PATINA_FILL_OFF},
    {.name = "culled", .cull = 1},
    {.name = "sharp shadows", .lit = 1, .lights = 1},
    {.name = "shadows of two lights, of what shows", .lit = 1, .lights = 2, .samples = 3, .lazy = 1},
    {.name = "discs in shadows", .surface = PATINA_SURFACE_SPLATS, .lit = 1, .lights = 1, .samples = 2, .lazy = 1},
    {.name = "layers", .glass = 1, .layers = 4},
    {.name = "layers of discs", .glass = 1, .layers = 3, .surface = PATINA_SURFACE_SPLATS},
    {.name = "shadows through faint points", .glass = 2, .layers = 2, .lit = 1, .lights = 1},
    {.name = "lines", .line = 2.0f},
    {.name = "lines on discs", .line = 1.5f, .surface = PATINA_SURFACE_SPLATS},
    {.name = "soft points", .soft = 1, .model = PATINA_SOFT_BASE},
    {.name = "soft points by a field", .soft = 1, .model = PATINA_SOFT_CONCENTRIC, .by_field = 1},
    {.name = "soft points and their shadows", .soft = 1, .model = PATINA_SOFT_EXPRESS, .by_field = 1, .lit = 1, .lights = 1},
    {.name = "means of points", .average = 1, .depth = PATINA_DEPTH_SURFACE},
    {.name = "clipped", .clip = 1},
    {.name = "hidden classes and kinds", .classes = 1, .kinds = 1},
    {.name = "a ramp of scalars, two of it", .ramp = 1, .pair = 1},
    {.name = "samples of pixels", .pixel_samples = 5},
    {.name = "a region", .region = 1},
};

// ---- the clouds ----------------------------------------------------------------------------------------------------------

static void save(char *to, int faint)
{
    struct points points = points_torus(POINTS, 2.0, 0.7, POINTS_ALL, 7);
    float *scalar = malloc(POINTS * sizeof *scalar), *opacity = malloc(POINTS * sizeof *opacity);
    uint8_t *classes = malloc(POINTS);
    patina_cloud *cloud = NULL;
    for (int i = 0; i < POINTS; i++) {
        scalar[i] = points.position[3 * i] * points.position[3 * i + 1];
        opacity[i] = 0.3f + 0.6f * (float)(i % 5) / 4.0f;
        classes[i] = (uint8_t)(points.position[3 * i + 2] > 0.3f ? 5 : i % 4);
    }
    patina_cloud_desc desc = points_desc(&points);
    desc.scalar = (patina_array){scalar, PATINA_FLOAT32, 1, 0};
    desc.classes = (patina_array){classes, PATINA_UINT8, 1, 0};
    if (faint)
        desc.opacity = (patina_array){opacity, PATINA_FLOAT32, 1, 0};
    const patina_analysis_desc analysis = {.struct_size = sizeof analysis, .keep_normals = 1};
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    CHECK(patina_cloud_analyse(cloud, &analysis, NULL), cloud);
    if (close(mkstemp(to)))
        support_die("no temporary file");
    CHECK(patina_cloud_save(cloud, to), cloud);
    patina_cloud_destroy(cloud);
    points_free(&points);
    free(scalar);
    free(opacity);
    free(classes);
}

static void pack(const char *from, char *to, char *to_floats)
{
    if (close(mkstemp(to)) || close(mkstemp(to_floats)))
        support_die("no temporary file");
    packed_write(from, to, to_floats);
}

static int make_files(void **state)
{
    (void)state;
    save(path, 0);
    save(path_of_glass, 1);
    pack(path, packed[0], rounded[0]);
    pack(path_of_glass, packed[1], rounded[1]);
    return 0;
}

static int remove_files(void **state)
{
    (void)state;
    return remove(path) | remove(path_of_glass) | remove(packed[0]) | remove(packed[1]) | remove(rounded[0]) |
           remove(rounded[1]);
}

// ---- the pictures --------------------------------------------------------------------------------------------------------

struct stage {
    patina_cloud *cloud;
    patina_field *field;
    patina_scene *scene;
    patina_settings settings;
};

static void add_lights(patina_scene *scene, uint32_t count)
{
    const patina_light_desc lights[2] = {
        {.struct_size = sizeof *lights, .type = PATINA_LIGHT_SUN, .power = 2, .direction = {-1, 0.5, -2}, .angle = 0.1f},
        {.struct_size = sizeof *lights, .type = PATINA_LIGHT_POINT, .power = 300, .position = {0, 0, 0.5}, .radius = 0.2f}};
    for (uint32_t i = 0; i < count; i++) {
        patina_light_desc light = lights[i];
        light.shadows = 1;
        CHECK(patina_scene_add_light(scene, &light), scene);
    }
}

static void add_clouds(struct stage *stage, const struct look *look)
{
    static const float ramp[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    patina_cloud_style style = PATINA_CLOUD_STYLE_INIT;
    style.lighting = look->lit ? PATINA_LIGHTING_LIT : PATINA_LIGHTING_AUTO;
    style.cull_back = look->cull;
    style.transparency = look->glass ? 0.5f : 0.0f;
    style.range_sharpness = look->sharpness;
    style.hidden_classes[0] = look->classes ? 1u << 2 : 0;
    style.hidden_kinds = look->kinds ? 1u << PATINA_KIND_BORDER | 1u << PATINA_KIND_STRAY : 0;
    if (look->ramp) {
        style.color_source = PATINA_COLOR_SCALAR;
        style.ramp = ramp[0];
        style.ramp_count = 3;
    }
    if (look->soft) {
        style.soft = look->by_field ? PATINA_SOFT_FIELD : PATINA_SOFT_ALL;
        style.soft_model = look->model;
        style.soft_radius = (look->by_field ? 0.02f : 0.015f) * (look->thin ? 0.25f : 1.0f);
    }
    if (look->by_field) {
        const patina_field_desc field = {
            .struct_size = sizeof field, .source = PATINA_FIELD_DISTANCE, .shape = PATINA_FIELD_FROM_AXIS, .range = {2.0, 2.4}};
        CHECK(patina_field_create(stage->cloud, &field, NULL, &stage->field), stage->cloud);
        style.field = stage->field;
        style.soft_threshold = 0.5f;
    }
    CHECK(patina_scene_add_cloud(stage->scene, stage->cloud, &style), stage->scene);
    if (look->pair) {
        const double beside[16] = {0.5, 0, 0, 2.5, 0, 0, -0.5, 0, 0, 0.5, 0, 1, 0, 0, 0, 1};
        memcpy(style.world_from_object, beside, sizeof beside);
        CHECK(patina_scene_add_cloud(stage->scene, stage->cloud, &style), stage->scene);
    }
}

static struct stage build_of(const struct look *look, const char *file)
{
    struct stage stage = {.settings = settings_default(WIDTH, HEIGHT)};
    const double eye[3] = {3.5, -4.5, 3.5}, target[3] = {0, 0, 0};
    CHECK(patina_cloud_open(file, &stage.cloud), NULL);
    CHECK(patina_scene_create(&stage.scene), NULL);
    add_clouds(&stage, look);
    add_lights(stage.scene, look->lights);
    if (look->clip) {
        const patina_clip clip = {.struct_size = sizeof clip,
                                  .world_from_clip = {1, 0, 0, 0.2, 0, 0.8, 0.6, 0, 0, -0.6, 0.8, 0, 0, 0, 0, 1},
                                  .shape = PATINA_CLIP_PLANE,
                                  .tint = {1, 0.2f, 0.1f},
                                  .tint_strength = 0.8f,
                                  .tint_width = 0.2f};
        CHECK(patina_scene_add_clip(stage.scene, &clip), stage.scene);
    }
    if (look->line > 0.0f) {
        patina_lines lines = PATINA_LINES_INIT;
        lines.width = look->line;
        CHECK(patina_scene_set_lines(stage.scene, &lines), stage.scene);
    }
    const patina_camera camera = look->orthographic ? camera_orthographic(eye, target, 5.5, WIDTH, HEIGHT, 0.1, 100)
                                                    : camera_perspective(eye, target, 45, WIDTH, HEIGHT, 0.1, 100);
    CHECK(patina_scene_set_camera(stage.scene, &camera), stage.scene);
    patina_settings *s = &stage.settings;
    s->surface = look->surface;
    s->fill = look->fill;
    s->quality = look->quality;
    s->layers = look->layers;
    s->shadow_samples = look->samples;
    s->shadow_lazy = look->lazy;
    s->average = look->average;
    s->depth = look->depth;
    s->pixel_samples = look->pixel_samples;
    if (look->region)
        memcpy(s->region, (uint32_t[]){40, 30, 140, 110}, sizeof s->region);
    CHECK(patina_scene_set_settings(stage.scene, s), stage.scene);
    return stage;
}

static struct stage build(const struct look *look) { return build_of(look, look->glass == 2 ? path_of_glass : path); }

static void destroy(struct stage *stage)
{
    patina_scene_destroy(stage->scene);
    patina_field_destroy(stage->field);
    patina_cloud_destroy(stage->cloud);
}

static patina_device *open_device(const char *name, uint64_t cap, uint32_t threads)
{
    patina_device *device = NULL;
    const patina_device_desc desc = {.struct_size = sizeof desc, .name = name, .threads = threads, .mapped_cap = cap};
    return patina_device_create(&desc, &device) ? NULL : device;
}

static struct picture draw(patina_device *device, const struct stage *stage, patina_frame_stats *stats)
{
    patina_frame *frame = NULL;
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_frame_render(frame, stage->scene), frame);
    *stats = (patina_frame_stats){.struct_size = sizeof *stats};
    CHECK(patina_frame_get_stats(frame, stats), frame);
    struct picture picture = picture_read(frame);
    patina_frame_destroy(frame);
    return picture;
}

// Pixels that are not as the corner is: soft points have no keys.
static uint32_t shown(const struct picture *picture)
{
    uint32_t count = 0;
    for (size_t i = 0; i < (size_t)picture->width * picture->height; i++)
        count += memcmp(picture->combined, picture->combined + 4 * i, 4 * sizeof *picture->combined) != 0;
    return count;
}

// devices: without a cap and with one, for all looks, as programs take long to compile; or NULL: for this one
static void compare(const char *name, const struct look *look, uint32_t threads, patina_device *const *devices)
{
    struct stage stage = build(look);
    patina_frame_stats whole_stats, stats;
    patina_device *device = devices ? devices[0] : open_device(name, UINT64_MAX, threads);
    struct picture whole = draw(device, &stage, &whole_stats);
    if (!devices)
        patina_device_destroy(device);
    const uint64_t some = look->soft ? shown(&whole) : picture_count(&whole), least = (uint64_t)whole.width * whole.height / 20;
    if (some <= least)
        support_die("%s shows %llu pixels", look->name, (unsigned long long)some);
    assert_true(whole_stats.mapped_bytes > POINTS * 27 && !whole_stats.mapped_cap && whole_stats.mapped_rounds == 1);
    // positions are read in parts of the whole, and half of the cap a round
    const int copies = support_is_gl(name);
    const uint64_t cap = copies ? CAP_OF_COPIES : whole_stats.mapped_bytes / SHARE;
    device = devices ? devices[1] : open_device(name, cap, threads);
    struct picture capped = draw(device, &stage, &stats);
    if (!devices)
        patina_device_destroy(device);
    picture_assert_identical(&capped, &whole, 0, 0, look->name);
    printf("  %s, %s: %u rounds, given back %u times, %.2f MB read\n", name, look->name, stats.mapped_rounds,
           stats.mapped_returned, 1e-6 * (double)stats.mapped_read);
    assert_int_equal(stats.mapped_cap, cap);
    if (!copies && look->lazy) // chunks that nothing shows of
        assert_true(stats.mapped_read <= whole_stats.mapped_read && 2 * stats.mapped_read > whole_stats.mapped_read);
    else if (!copies &&
             (look->by_field || look->clip || look->classes)) // words that a sieve reads, of chunks that something shows of
        assert_true(stats.mapped_read > 0 && stats.mapped_read <= whole_stats.mapped_read);
    else
        assert_true(copies ? stats.mapped_read > cap : stats.mapped_read == whole_stats.mapped_read);
    // discs alone are no pass in rounds on the processor: what they read is given back whenever it is too much
    assert_true(stats.mapped_rounds >= LEAST_ROUNDS || stats.mapped_returned >= LEAST_ROUNDS);
    assert_true((look->surface == PATINA_SURFACE_SPLATS && !copies) || stats.mapped_rounds >= LEAST_ROUNDS);
    picture_free(&capped);
    picture_free(&whole);
    destroy(&stage);
}

static void test_same_bytes(void **state)
{
    (void)state;
    for (uint32_t k = 0; k < support_device_count(); k++) {
        const char *name = support_device_name(k);
        const int level = !strncmp(name, "cpu-", 4); // two looks of each: what the others have in common is tested above
        patina_device *device = support_device_open(name, 0, 0);
        patina_device *devices[2] = {device, device && support_is_gl(name) ? open_device(name, CAP_OF_COPIES, 0) : NULL};
        for (uint32_t i = 0; i < sizeof looks / sizeof *looks && device; i += level ? 11 : 1) {
            struct look look = looks[i];
            look.thin = devices[1] != NULL;
            compare(name, &look, i % 3, devices[1] ? devices : NULL);
        }
        patina_device_destroy(devices[1]);
        patina_device_destroy(device);
    }
}

// Packed positions, whole and in rounds, show what floats at their places do.
static void compare_packed(patina_device *const devices[2], const char *name, const struct look *look)
{
    const int glass = look->glass == 2;
    struct stage floats = build_of(look, rounded[glass]), stage = build_of(look, packed[glass]);
    patina_frame_stats float_stats, stats;
    struct picture wanted = draw(devices[0], &floats, &float_stats), whole = draw(devices[0], &stage, &stats);
    picture_assert_identical(&whole, &wanted, 0, 0, look->name);
    assert_true(stats.mapped_bytes + 4 * POINTS <= float_stats.mapped_bytes);
    struct picture capped = draw(devices[1], &stage, &stats);
    picture_assert_identical(&capped, &wanted, 0, 0, look->name);
    printf("  %s, %s, packed: %u rounds, given back %u times, %.2f MB read\n", name, look->name, stats.mapped_rounds,
           stats.mapped_returned, 1e-6 * (double)stats.mapped_read);
    assert_true(stats.mapped_rounds >= LEAST_ROUNDS / 2 || stats.mapped_returned >= LEAST_ROUNDS / 2);
    picture_free(&capped);
    picture_free(&whole);
    picture_free(&wanted);
    destroy(&stage);
    destroy(&floats);
}

static void test_packed(void **state)
{
    (void)state;
    for (uint32_t k = 0; k < support_device_count(); k++) {
        const char *name = support_device_name(k);
        const uint32_t each = support_is_gl(name)        ? 3
                              : strncmp(name, "cpu-", 4) ? 1
                                                         : 5; // all of them once; what takes long, some
        patina_device *device = support_device_open(name, 0, 0);
        patina_device *devices[2] = {device, device ? open_device(name, support_is_gl(name) ? CAP_OF_COPIES : 50000, 0) : NULL};
        for (uint32_t i = 0; i < sizeof looks / sizeof *looks && device; i += each) {
            struct look look = looks[i];
            look.thin = support_is_gl(name);
            compare_packed(devices, name, &look);
        }
        patina_device_destroy(devices[1]);
        patina_device_destroy(device);
    }
}

// Another picture of the same frame, and the file as it was.
static void test_again(void **state)
{
    (void)state;
    struct stage stage = build(&looks[7]);
    patina_device *device = open_device("cpu", 100000, 2);
    patina_frame *frame = NULL;
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_frame_render(frame, stage.scene), frame);
    struct picture first = picture_read(frame);
    CHECK(patina_frame_render(frame, stage.scene), frame); // its shadows are at hand
    struct picture again = picture_read(frame);
    picture_assert_identical(&again, &first, 0, 0, "drawn again");
    picture_free(&first);
    picture_free(&again);
    patina_frame_destroy(frame);
    patina_device_destroy(device);
    CHECK(patina_cloud_verify(path, NULL), NULL);
    destroy(&stage);
}

// What was set since the file was opened is not the file's: it stays.
static void test_changed_colors(void **state)
{
    (void)state;
    struct stage stage = build(&looks[0]);
    patina_frame_stats stats;
    uint8_t *colors = malloc(3 * POINTS);
    for (int i = 0; i < 3 * POINTS; i++)
        colors[i] = (uint8_t)(i * 7);
    const patina_array array = {colors, PATINA_UINT8, 3, 0};
    CHECK(patina_cloud_set_colors(stage.cloud, &array), stage.cloud);
    patina_device *device = open_device("cpu", UINT64_MAX, 0), *capped = open_device("cpu", 100000, 0);
    struct picture whole = draw(device, &stage, &stats), rounds = draw(capped, &stage, &stats);
    picture_assert_identical(&rounds, &whole, 0, 0, "changed colours");
    picture_free(&whole);
    picture_free(&rounds);
    patina_device_destroy(device);
    patina_device_destroy(capped);
    destroy(&stage);
    free(colors);
}

static patina_device *open_with(const char *name, const char *variable, const char *value)
{
    support_set_variable(variable, value);
    patina_device *device = open_device(name, 0, 0);
    support_set_variable(variable, NULL);
    return device;
}

// Devices that copy clouds: a cap that holds no two chunks is refused with one message, before anything is drawn; without a cap, and where
// the driver does not say how much memory it has, clouds lie there whole.
static void test_too_small(void **state)
{
    (void)state;
    for (uint32_t k = 0; k < support_device_count(); k++) {
        const char *name = support_device_name(k);
        patina_device *device = support_is_gl(name) ? open_device(name, 100000, 0) : NULL;
        if (!device)
            continue;
        struct stage stage = build(&looks[0]);
        patina_frame *frame = NULL;
        patina_frame_stats stats;
        CHECK(patina_frame_create(device, &frame), device);
        assert_int_equal(patina_frame_render(frame, stage.scene), PATINA_ERROR_MEMORY);
        printf("  %s: %s\n", name, support_message(frame));
        assert_non_null(strstr(support_message(frame), "a cap of 0.100 MB is too small for two ranges of points"));
        patina_frame_destroy(frame);
        patina_device_destroy(device);
        device = open_device(name, 0, 0);
        struct picture picture = draw(device, &stage, &stats);
        assert_true(picture_count(&picture) > WIDTH * HEIGHT / 20 && !stats.mapped_cap && stats.mapped_rounds == 1);
        picture_free(&picture);
        patina_device_destroy(device);
        destroy(&stage);
    }
}

// What a driver says that it has, of which planes keep a quarter; and a driver that says nothing and gives nothing either. Clouds in
// memory are drawn in ranges too, and twice from the same frame.
static void test_own_memory(void **state)
{
    (void)state;
    for (uint32_t k = 0; k < support_device_count(); k++) {
        const char *name = support_device_name(k);
        patina_device *devices[3] = {support_is_gl(name) ? support_device_open(name, 0, 0) : NULL};
        if (!devices[0])
            continue;
        devices[1] = open_with(name, "PATINA_GL_MEMORY", "0.6");
        devices[2] = open_with(name, "PATINA_GL_LARGEST", "1");
        struct points points = points_torus(POINTS, 2.0, 0.7, POINTS_ALL, 7);
        const patina_cloud_desc desc = points_desc(&points);
        struct stage stage = build(&looks[0]), in_memory = {.settings = stage.settings};
        const double eye[3] = {3.5, -4.5, 3.5}, target[3] = {0, 0, 0};
        const patina_camera camera = camera_perspective(eye, target, 45, WIDTH, HEIGHT, 0.1, 100);
        CHECK(patina_cloud_create(&desc, NULL, &in_memory.cloud), NULL);
        CHECK(patina_scene_create(&in_memory.scene), NULL);
        CHECK(patina_scene_add_cloud(in_memory.scene, in_memory.cloud, NULL), in_memory.scene);
        CHECK(patina_scene_set_camera(in_memory.scene, &camera), in_memory.scene);
        CHECK(patina_scene_set_settings(in_memory.scene, &in_memory.settings), in_memory.scene);
        for (int which = 0; which < 2; which++) {
            const struct stage *of = which ? &in_memory : &stage;
            patina_frame_stats stats;
            struct picture whole = draw(devices[0], of, &stats);
            for (int d = 1; d < 3; d++)
                for (int again = 0; again < 2; again++) {
                    struct picture some = draw(devices[d], of, &stats);
                    picture_assert_identical(&some, &whole, 0, 0, d == 1 ? "a driver's memory" : "a driver without memory");
                    printf("  %s, %s, %s: %u rounds\n", name, which ? "in memory" : "in a file",
                           d == 1 ? "0.6 MB of its own" : "no memory for 1 MB", stats.mapped_rounds);
                    assert_true(d == 1 ? stats.mapped_cap == 450000 && stats.mapped_rounds > 5 : stats.mapped_rounds == 1);
                    assert_true(stats.mapped_read > 0);
                    picture_free(&some);
                }
            picture_free(&whole);
        }
        destroy(&in_memory);
        destroy(&stage);
        points_free(&points);
        for (int d = 0; d < 3; d++)
            patina_device_destroy(devices[d]);
    }
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_same_bytes), cmocka_unit_test(test_packed),
                                       cmocka_unit_test(test_again),      cmocka_unit_test(test_changed_colors),
                                       cmocka_unit_test(test_too_small),  cmocka_unit_test(test_own_memory)};
    return cmocka_run_group_tests(tests, make_files, remove_files);
}
