// SPDX-License-Identifier: GPL-3.0-or-later
#include "random_scenes.h"
#include "scenes/clouds.h"
#include "scenes/support.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { CLOUDS = 8, MESHES = 3, TEXTURES = 2, WIDTH = RANDOM_WIDTH, HEIGHT = RANDOM_HEIGHT };

static struct {
    patina_cloud *clouds[CLOUDS];
    patina_mesh *meshes[MESHES];
    patina_texture *textures[TEXTURES];
} stock;

// ---- chance --------------------------------------------------------------------------------------------------------------

static int once_in(struct pcg *random, uint32_t times) { return pcg_u32(random) % times == 0; }
static uint32_t below(struct pcg *random, uint32_t end) { return pcg_u32(random) % end; }
static float between(struct pcg *random, double low, double high) { return (float)pcg_between(random, low, high); }

static void color(struct pcg *random, float out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = between(random, 0.0, 1.0);
}

static void direction(struct pcg *random, double out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = pcg_between(random, -1.0, 1.0);
}

// Turned around z, scaled, moved; now and then mirrored or flat.
static void place(struct pcg *random, double out[16])
{
    const double turn = pcg_between(random, 0.0, 6.3), size = pcg_between(random, 0.2, 1.5);
    const double up = once_in(random, 8) ? -size : once_in(random, 16) ? 0.0 : size;
    const double rows[16] = {size * cos(turn),
                             -size * sin(turn),
                             0,
                             pcg_between(random, -0.7, 0.7),
                             size * sin(turn),
                             size * cos(turn),
                             0,
                             pcg_between(random, -0.7, 0.7),
                             0,
                             0,
                             up,
                             pcg_between(random, -0.7, 0.7),
                             0,
                             0,
                             0,
                             1};
    memcpy(out, rows, sizeof rows);
}

// ---- what scenes are made of ---------------------------------------------------------------------------------------------

// All that a point may have; `more`: opacities and radii too.
static patina_cloud *full_cloud(struct points points, int more, int analysed)
{
    struct pcg random = pcg_seed(5);
    float *values = malloc(points.count * 3 * sizeof *values);
    uint8_t *classes = malloc(points.count), *stations = malloc(points.count);
    const double places[6] = {0, 0, 3, 3, 0, 1};
    for (uint64_t i = 0; i < points.count; i++) {
        values[3 * i] = once_in(&random, 50) ? NAN : points.position[3 * i];
        values[3 * i + 1] = between(&random, 0.0, 1.2);
        values[3 * i + 2] = between(&random, 0.0, 0.1);
        classes[i] = (uint8_t)(i % 3);
        stations[i] = (uint8_t)(i % 2);
    }
    patina_cloud_desc desc = points_desc(&points);
    desc.scalar = (patina_array){values, PATINA_FLOAT32, 1, 12};
    desc.classes = (patina_array){classes, PATINA_UINT8, 1, 0};
    if (more) {
        desc.opacity = (patina_array){values + 1, PATINA_FLOAT32, 1, 12};
        desc.radius = (patina_array){values + 2, PATINA_FLOAT32, 1, 12};
    }
    patina_cloud *cloud = NULL;
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    const patina_analysis_desc analysis = {.struct_size = sizeof analysis,
                                           .station_count = 2,
                                           .stations = places,
                                           .station = {stations, PATINA_UINT8, 1, 0},
                                           .free_space = 1};
    if (analysed)
        CHECK(patina_cloud_analyse(cloud, &analysis, NULL), cloud);
    points_free(&points);
    free(values);
    free(classes);
    free(stations);
    return cloud;
}

static patina_cloud *bare_cloud(struct points points)
{
    patina_cloud *cloud = points_upload(&points);
    points_free(&points);
    return cloud;
}

static patina_mesh *mesh(int more, uint64_t triangles)
{
    static const float corners[] = {-1, -1, 0, 1, -1, 0.2f, 1, 1, 0, -1, 1, -0.2f, 0, 0, 1.5f, NAN, 0, 0};
    static const float up[] = {0, 0, 1, 0, 1, 1, 0, 0, 1, 1, 0, 1, 0, 0, 0, 0, 0, 1},
                       uv[] = {0, 0, 3, 0, 3, 2, 0, 2, -4, 0.5f, 0, 0};
    static const uint32_t indices[] = {0, 1, 2, 0, 2, 3, 0, 1, 4, 2, 2, 4, 5, 0, 1}; // one is flat, one nowhere
    patina_mesh_desc desc = {.struct_size = sizeof desc,
                             .vertex_count = 6,
                             .position = {corners, PATINA_FLOAT32, 3, 0},
                             .triangle_count = triangles,
                             .indices = indices};
    if (more) {
        desc.normal = (patina_array){up, PATINA_FLOAT32, 3, 0};
        desc.color = (patina_array){up, PATINA_FLOAT32, 3, 0};
        desc.uv = (patina_array){uv, PATINA_FLOAT32, 2, 0};
    }
    patina_mesh *made = NULL;
    CHECK(patina_mesh_create(&desc, &made), NULL);
    return made;
}

static patina_texture *texture(uint32_t wrap)
{
    static const uint8_t texels[] = {255, 0,   0,   255, 0, 255, 0, 0,   9,  9,  99, 128,
                                     255, 255, 255, 90,  1, 2,   3, 200, 30, 60, 90, 255};
    const patina_texture_desc desc = {.struct_size = sizeof desc,
                                      .width = 3,
                                      .height = 2,
                                      .wrap = wrap,
                                      .nearest = wrap > 0,
                                      .pixels = {texels, PATINA_UINT8, 4, 0}};
    patina_texture *made = NULL;
    CHECK(patina_texture_create(&desc, &made), NULL);
    return made;
}

void random_scenes_begin(void)
{
    struct points one = points_grid(1, 1, 1.0, POINTS_ALL), same = points_create(40, POINTS_PLAIN),
                  none = points_create(0, POINTS_PLAIN);
    stock.clouds[0] = bare_cloud(points_torus(3000, 1.0, 0.4, POINTS_ALL, 1));
    stock.clouds[1] = bare_cloud(points_sphere(700, 0.8, POINTS_PLAIN, 2));
    stock.clouds[2] = full_cloud(points_torus(2000, 0.8, 0.3, POINTS_ALL, 3), 1, 0);
    stock.clouds[3] = full_cloud(points_sphere(2500, 1.0, POINTS_ALL, 4), 0, 1);
    stock.clouds[4] = full_cloud(points_rectangle(1500, 2.0, 1.5, POINTS_COLORS, 5), 0, 1);
    stock.clouds[5] = bare_cloud(one);
    stock.clouds[6] = bare_cloud(same);
    stock.clouds[7] = bare_cloud(none);
    for (uint32_t i = 0; i < MESHES; i++)
        stock.meshes[i] = mesh(i > 0, i == 2 ? 0 : 5);
    for (uint32_t i = 0; i < TEXTURES; i++)
        stock.textures[i] = texture(2 * i);
}

void random_scenes_end(void)
{
    for (uint32_t i = 0; i < CLOUDS; i++)
        patina_cloud_destroy(stock.clouds[i]);
    for (uint32_t i = 0; i < MESHES; i++)
        patina_mesh_destroy(stock.meshes[i]);
    for (uint32_t i = 0; i < TEXTURES; i++)
        patina_texture_destroy(stock.textures[i]);
}

// ---- descriptions --------------------------------------------------------------------------------------------------------

static void add_cloud(struct pcg *random, patina_scene *scene)
{
    static const float ramp[] = {0, 0, 1, 0, 1, 0, 1, 0, 0};
    patina_cloud_style style = {.struct_size = sizeof style, .lighting = below(random, 3), .cull_back = below(random, 2)};
    place(random, style.world_from_object);
    style.d_min = once_in(random, 4) ? between(random, 0.0, 0.3) : 0.0f;
    style.transparency = once_in(random, 3) ? between(random, 0.0, 1.0) : 0.0f;
    style.shadow_off = once_in(random, 3) ? below(random, 8) : 0;
    style.radius = once_in(random, 3) ? between(random, 0.0, 0.2) : 0.0f;
    style.color_source = once_in(random, 2) ? below(random, 6) : 0;
    style.ramp = once_in(random, 4) ? NULL : ramp;
    style.ramp_count = style.ramp ? 3 : 0;
    style.specular = style.diffuse = once_in(random, 3) ? between(random, 0.0, 1.0) : 0.0f;
    style.exposure = once_in(random, 4) ? between(random, -3.0, 3.0) : 0.0f;
    style.contrast = once_in(random, 4) ? between(random, 0.0, 3.0) : 0.0f;
    style.hidden_classes[0] = once_in(random, 4) ? below(random, 8) : 0;
    style.clip_off = once_in(random, 4);
    style.free_space = below(random, 3);
    style.hidden_kinds = once_in(random, 4) ? below(random, 64) : 0;
    style.least_trust = once_in(random, 4) ? between(random, 0.0, 1.0) : 0.0f;
    style.largest_gap = once_in(random, 4) ? between(random, 0.0, 0.2) : 0.0f;
    style.surface = once_in(random, 4) ? PATINA_SURFACE_RANGES : 0;
    style.range_gamma = once_in(random, 3) ? (once_in(random, 4) ? INFINITY : between(random, 0.0, 0.5)) : 0.0f;
    style.range_pixel = once_in(random, 3) ? between(random, 1.0, 64.0) : 0.0f;
    style.range_sharpness = once_in(random, 3) ? between(random, 0.5, 0.95) : 0.0f;
    patina_scene_add_cloud(scene, stock.clouds[below(random, CLOUDS)], &style);
}

static void add_mesh(struct pcg *random, patina_scene *scene)
{
    const uint32_t which = below(random, MESHES);
    patina_mesh_style style = {.struct_size = sizeof style,
                               .shadow_off = once_in(random, 3) ? below(random, 4) : 0,
                               .unlit = once_in(random, 4),
                               .alpha = below(random, 3),
                               .alpha_least = between(random, 0.0, 1.0)};
    place(random, style.world_from_object);
    style.texture = which && once_in(random, 2) ? stock.textures[below(random, TEXTURES)] : NULL;
    patina_scene_add_mesh(scene, stock.meshes[which], &style);
}

static void add_light(struct pcg *random, patina_scene *scene)
{
    patina_light_desc light = {.struct_size = sizeof light,
                               .type = 1 + below(random, 4),
                               .power = between(random, 0.0, 30.0),
                               .shape = below(random, 2),
                               .shadows = once_in(random, 2)};
    direction(random, light.direction);
    direction(random, light.position);
    direction(random, light.side);
    color(random, light.color);
    for (int k = 0; k < 3; k++)
        light.position[k] *= 2.5;
    light.angle = once_in(random, 2) ? between(random, 0.0, 0.6) : 0.0f;
    light.radius = once_in(random, 2) ? between(random, 0.0, 0.4) : 0.0f;
    light.size[0] = between(random, 0.1, 1.0);
    light.cone = between(random, 0.1, 3.0);
    light.blend = between(random, 0.0, 1.0);
    patina_scene_add_light(scene, &light);
}

static void add_clip(struct pcg *random, patina_scene *scene)
{
    patina_clip clip = {.struct_size = sizeof clip,
                        .shape = below(random, 2),
                        .cut = below(random, 2),
                        .tint_strength = once_in(random, 2) ? between(random, 0.0, 1.0) : 0.0f,
                        .tint_width = between(random, 0.0, 0.3)};
    place(random, clip.world_from_clip);
    color(random, clip.tint);
    patina_scene_add_clip(scene, &clip);
}

// One of three strengths is there; lengths as the scenes', which are about one across.
static float effect_number(struct pcg *random, int strength, const char *unit, double least, double most)
{
    double low = fmax(least, 0.0), high = fmin(most, 3.0);
    if (strength && !once_in(random, 3))
        return 0.0f;
    if (!strcmp(unit, "PIXELS")) {
        high = fmin(most, 16.0);
    } else if (!strcmp(unit, "HEIGHT")) {
        low = -1.0;
        high = 1.0;
    } else if (!strcmp(unit, "LENGTH")) {
        low = fmax(least, 0.01);
    }
    return between(random, low, high);
}

static uint32_t effect_count(struct pcg *random, uint32_t least, uint32_t most)
{
    return once_in(random, 3) ? least + below(random, (most < 16 ? most : 16) - least + 1) : 0;
}

// Every field of the table of effects.
static void set_effects(struct pcg *random, patina_scene *scene)
{
    patina_effects effects = {.struct_size = sizeof effects};
#define PATINA_EFFECT_NUMBER(field, when, least, most, zero, unit, ...)                                                        \
    effects.field = effect_number(random, !strcmp(#when, "STRENGTH"), #unit, (double)(least), (double)(most));
#define PATINA_EFFECT_COUNT(field, when, least, most, ...) effects.field = effect_count(random, least, most);
#define PATINA_EFFECT_COLOR(field, ...)                                                                                        \
    if (once_in(random, 2))                                                                                                    \
        color(random, effects.field);
#define PATINA_EFFECT_AXIS(field, ...)                                                                                         \
    for (int k = 0; k < 3; k++)                                                                                                \
        effects.field[k] = between(random, -1.0, 1.0);
#define PATINA_EFFECT_SWITCH(field, ...) effects.field = below(random, 2);
#define PATINA_EFFECT_CHOICE(field, when, count, ...) effects.field = below(random, count);
#include "patina/effects.def"
    effects.fog_end = effects.fog_start + between(random, 0.1, 4.0);
    assert_int_equal(patina_scene_set_effects(scene, &effects), PATINA_OK);
}

static void set_lines(struct pcg *random, patina_scene *scene)
{
    patina_lines lines = {.struct_size = sizeof lines,
                          .width = between(random, 0.1, 16.0),
                          .world = once_in(random, 4),
                          .source = below(random, 3),
                          .transparency = once_in(random, 2) ? between(random, 0.0, 1.0) : 0.0f,
                          .soft = once_in(random, 2) ? between(random, 0.0, 1.0) : 0.0f,
                          .surface = below(random, 3)};
    lines.offset = once_in(random, 2) ? between(random, 0.0, 0.3) : 0.0f;
    color(random, lines.color);
    patina_scene_set_lines(scene, &lines);
}

static void set_settings(struct pcg *random, patina_scene *scene)
{
    patina_settings settings = {.struct_size = sizeof settings,
                                .width = 1 + below(random, WIDTH),
                                .height = 1 + below(random, HEIGHT),
                                .quality = below(random, 2),
                                .fill = below(random, 3),
                                .fill_iterations = once_in(random, 4) ? below(random, 9) : 0,
                                .smooth = below(random, 4),
                                .antialias = below(random, 3),
                                .film_transparent = below(random, 2),
                                .surface = below(random, 4),
                                .depth = below(random, 2),
                                .average = once_in(random, 4)};
    if (once_in(random, 3)) {
        settings.region[0] = below(random, settings.width);
        settings.region[1] = below(random, settings.height);
        settings.region[2] = settings.region[0] + 1 + below(random, settings.width - settings.region[0]);
        settings.region[3] = settings.region[1] + 1 + below(random, settings.height - settings.region[1]);
    }
    color(random, settings.world_color);
    settings.passes = once_in(random, 2) ? 0 : below(random, 1u << PATINA_PASS_COUNT) | 1u;
    settings.layers = below(random, 2) ? 0 : 1 + below(random, PATINA_MAX_LAYERS);
    settings.layer_passes = once_in(random, 4) ? below(random, 8) : 0;
    settings.error_target = once_in(random, 6) ? between(random, 0.0, 0.2) : 0.0f;
    settings.strata = once_in(random, 4) ? 1 + below(random, 6) : 0;
    settings.shadow_samples = below(random, 7);
    settings.shadow_resolution = 16 + below(random, 112);
    settings.shadow_lazy = below(random, 2);
    settings.shadow_uncut = below(random, 2);
    settings.shadow_error = once_in(random, 8) ? between(random, 0.05, 0.3) : 0.0f;
    settings.own_background = below(random, 2);
    settings.pixel_samples = once_in(random, 6) ? below(random, 12) : 0;
    settings.world_directed = once_in(random, 6);
    patina_scene_set_settings(scene, &settings);
}

static void set_camera(struct pcg *random, patina_scene *scene)
{
    double eye[3], target[3];
    direction(random, eye);
    direction(random, target);
    const double far = once_in(random, 4) ? 0.7 : 3.0; // now and then among the points
    for (int k = 0; k < 3; k++) {
        eye[k] *= far;
        target[k] *= 0.3;
    }
    const patina_camera camera = once_in(random, 3) ? camera_orthographic(eye, target, pcg_between(random, 0.5, 4.0), WIDTH,
                                                                          HEIGHT, once_in(random, 2) ? -2.0 : 0.0, 20.0)
                                                    : camera_perspective(eye, target, pcg_between(random, 10.0, 120.0), WIDTH,
                                                                         HEIGHT, once_in(random, 4) ? 1.0 : 0.01, 20.0);
    patina_scene_set_camera(scene, &camera);
}

patina_scene *random_scene(uint32_t seed)
{
    struct pcg chance = pcg_seed(seed), *random = &chance;
    patina_scene *scene = NULL;
    CHECK(patina_scene_create(&scene), NULL);
    for (uint32_t i = below(random, 4); i > 0; i--)
        add_cloud(random, scene);
    for (uint32_t i = once_in(random, 3) ? 1 + below(random, 2) : 0; i > 0; i--)
        add_mesh(random, scene);
    for (uint32_t i = below(random, 4); i > 0; i--)
        add_light(random, scene);
    for (uint32_t i = once_in(random, 4) ? 1 + below(random, 3) : 0; i > 0; i--)
        add_clip(random, scene);
    if (once_in(random, 3))
        set_effects(random, scene);
    if (once_in(random, 4))
        set_lines(random, scene);
    set_settings(random, scene);
    set_camera(random, scene);
    return scene;
}

// ---- pictures ------------------------------------------------------------------------------------------------------------

void random_read(const patina_frame *frame, float *pixels, uint64_t *keys)
{
    static const uint32_t channels[] = {
#define X(name, count, sentence) count,
        PATINA_PASSES(X)
#undef X
    };
    patina_frame_stats stats = {.struct_size = sizeof stats};
    CHECK(patina_frame_get_stats(frame, &stats), frame);
    const size_t size = (size_t)stats.width * stats.height;
    for (uint32_t pass = 0; pass < PATINA_PASS_COUNT; pass++) {
        patina_frame_read(frame, pass, pixels, size * channels[pass] * sizeof *pixels);
        pixels += size * channels[pass];
    }
    for (uint32_t layer = 1; layer <= stats.layers; layer++) {
        patina_frame_read_layer(frame, layer, PATINA_PASS_COMBINED, pixels, size * 4 * sizeof *pixels);
        pixels += size * 4;
    }
    CHECK(patina_frame_read_keys(frame, keys, size * sizeof *keys), frame);
}
