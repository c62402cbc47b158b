// SPDX-License-Identifier: GPL-3.0-or-later
#include "staging.h"

#include "meshes.h"

#include <math.h>
#include <stdlib.h>

enum { REFINED = PATINA_QUALITY_REFINED, PAPERLY = PATINA_QUALITY_PAPER };
enum { CLOSED = PATINA_FILL_CLOSED, PAPER = PATINA_FILL_PAPER, OPEN = PATINA_FILL_OFF, DISCS, KNOWN, RANGES, BESIDE };
// DISCS: nothing is filled, points are PATINA_SURFACE_SPLATS. KNOWN: the cloud is analysed, PATINA_SURFACE_AUTO. RANGES: they are range
// images; BESIDE: those of every other instance, the others are filled
enum { LAYER_PASSES = 1 << PATINA_PASS_COMBINED | 1 << PATINA_PASS_DEPTH | 1 << PATINA_PASS_NORMAL };
enum { LIT = PATINA_LIGHTING_LIT, UNLIT = PATINA_LIGHTING_UNLIT, AUTO = PATINA_LIGHTING_AUTO };

// glass: transparency, points' own opacity, layers, their passes.
// The torus covers about a third of a picture: points / (0.6 width height) is its density a pixel, both sides counted.
#define OPAQUE                                                                                                                 \
    {                                                                                                                          \
        0.0f, 0, 0, 0                                                                                                          \
    }
const struct staging stagings[] = {
    {"one pixel", 1, 1, 5000, POINTS_ALL, STAGE_ONE, 0, 0, LIT, REFINED, CLOSED, 0, 0, 0, 0, OPAQUE},
    {"small, 0.1 points a pixel", 67, 45, 180, POINTS_ALL, STAGE_ONE, 0, 0, LIT, REFINED, CLOSED, 0, 0, 1, 0, OPAQUE},
    {"small, 1 point a pixel", 67, 45, 1800, POINTS_ALL, STAGE_ONE, 0, 1, LIT, REFINED, CLOSED, 0, 0, 0, 0, OPAQUE},
    {"small, 30 points a pixel", 67, 45, 54000, POINTS_ALL, STAGE_ONE, 0, 1, LIT, PAPERLY, CLOSED, 0, 0, 0, 0, OPAQUE},
    {"orthographic, paper's filters", 203, 151, 30000, POINTS_ALL, STAGE_ONE, 1, 0, LIT, PAPERLY, PAPER, 1, 1, 0, 0, OPAQUE},
    {"orthographic, refined", 203, 151, 6000, POINTS_NORMALS, STAGE_ONE, 1, 1, LIT, REFINED, CLOSED, 2, 0, 1, 0, OPAQUE},
    {"paper's filling, refined depth", 203, 151, 30000, POINTS_ALL, STAGE_ONE, 0, 0, LIT, REFINED, PAPER, 0, 0, 0, 0, OPAQUE},
    {"no filling, no filters", 203, 151, 20000, POINTS_ALL, STAGE_ONE, 0, 1, UNLIT, PAPERLY, OPEN, 3, 2, 0, 0, OPAQUE},
    {"unlit colours", 203, 151, 9000, POINTS_COLORS, STAGE_ONE, 0, 0, AUTO, REFINED, CLOSED, 0, 0, 0, 0, OPAQUE},
    {"normals estimated", 203, 151, 20000, POINTS_PLAIN, STAGE_ONE, 0, 0, LIT, REFINED, CLOSED, 0, 0, 0, 0, OPAQUE},
    {"normals estimated, sparse, orthographic", 203, 151, 2500, POINTS_COLORS, STAGE_ONE, 1, 0, LIT, REFINED, CLOSED, 0, 0, 0,
     0, OPAQUE},
    {"many instances", 203, 151, 15000, POINTS_ALL, STAGE_MANY, 0, 0, LIT, REFINED, CLOSED, 0, 0, 0, 0, OPAQUE},
    {"many instances, culled, orthographic", 203, 151, 15000, POINTS_ALL, STAGE_MANY, 1, 1, LIT, REFINED, CLOSED, 0, 0, 1, 0,
     OPAQUE},
    {"many instances without normals", 203, 151, 15000, POINTS_COLORS, STAGE_MANY, 0, 1, LIT, PAPERLY, CLOSED, 0, 1, 0, 0,
     OPAQUE},
    {"density 0.1 to 30 in one cloud", 203, 151, 40000, POINTS_ALL, STAGE_ONE, 0, 1, LIT, REFINED, CLOSED, 0, 0, 0, 1, OPAQUE},
    {"large", 1024, 768, 400000, POINTS_ALL, STAGE_MANY, 0, 1, LIT, REFINED, CLOSED, 0, 0, 0, 0, OPAQUE},
    {"large, sparse", 1024, 768, 40000, POINTS_ALL, STAGE_ONE, 0, 1, LIT, REFINED, CLOSED, 0, 0, 1, 0, OPAQUE},
    {"transparent", 203, 151, 30000, POINTS_ALL, STAGE_ONE, 0, 1, LIT, REFINED, CLOSED, 0, 0, 0, 0, {0.6f, 0, 0, 0}},
    {"transparent, as in the paper, orthographic",
     203,
     151,
     60000,
     POINTS_ALL,
     STAGE_ONE,
     1,
     0,
     LIT,
     PAPERLY,
     PAPER,
     1,
     1,
     1,
     0,
     {0.3f, 0, 3, 0}},
    {"transparent, sparse, normals estimated",
     203,
     151,
     4000,
     POINTS_COLORS,
     STAGE_ONE,
     0,
     0,
     LIT,
     REFINED,
     CLOSED,
     0,
     0,
     1,
     0,
     {0.8f, 0, 0, LAYER_PASSES}},
    {"transparent and opaque instances",
     203,
     151,
     15000,
     POINTS_ALL,
     STAGE_MANY,
     0,
     0,
     LIT,
     REFINED,
     CLOSED,
     0,
     0,
     0,
     0,
     {0.7f, 0, 16, 0}},
    {"points with opacities",
     203,
     151,
     20000,
     POINTS_ALL,
     STAGE_MANY,
     0,
     0,
     UNLIT,
     PAPERLY,
     CLOSED,
     0,
     0,
     1,
     0,
     {0.0f, 1, 5, LAYER_PASSES}},
    {"layers of what is opaque, one asked for",
     67,
     45,
     3000,
     POINTS_ALL,
     STAGE_ONE,
     0,
     0,
     LIT,
     REFINED,
     CLOSED,
     0,
     0,
     0,
     0,
     {0.0f, 0, 1, LAYER_PASSES}},
    {"layers of what is opaque",
     203,
     151,
     20000,
     POINTS_ALL,
     STAGE_ONE,
     0,
     0,
     LIT,
     REFINED,
     CLOSED,
     3,
     2,
     0,
     0,
     {0.0f, 0, 4, LAYER_PASSES}},
    {"large, transparent", 1024, 768, 400000, POINTS_ALL, STAGE_MANY, 0, 0, LIT, REFINED, CLOSED, 0, 0, 0, 0, {0.5f, 0, 6, 0}},
    {"meshes", 203, 151, 20000, POINTS_ALL, STAGE_MESHES, 0, 1, LIT, REFINED, CLOSED, 0, 0, 0, 0, OPAQUE},
    {"meshes, orthographic, sparse points", 203, 151, 3000, POINTS_COLORS, STAGE_MESHES, 1, 0, LIT, REFINED, CLOSED, 0, 0, 1, 0,
     OPAQUE},
    {"meshes and transparent points",
     203,
     151,
     20000,
     POINTS_ALL,
     STAGE_MESHES,
     0,
     0,
     LIT,
     REFINED,
     CLOSED,
     0,
     0,
     0,
     0,
     {0.5f, 0, 6, LAYER_PASSES}},
    {"discs, one pixel", 1, 1, 5000, POINTS_ALL, STAGE_ONE, 0, 0, LIT, REFINED, DISCS, 0, 0, 0, 0, OPAQUE},
    {"discs, 30 points a pixel", 67, 45, 54000, POINTS_ALL, STAGE_ONE, 0, 1, LIT, REFINED, DISCS, 0, 0, 0, 0, OPAQUE},
    {"discs, density 0.1 to 30", 203, 151, 40000, POINTS_ALL, STAGE_ONE, 0, 1, LIT, REFINED, DISCS, 0, 0, 0, 1, OPAQUE},
    {"discs, many instances, orthographic", 203, 151, 9000, POINTS_ALL, STAGE_MANY, 1, 1, LIT, REFINED, DISCS, 0, 0, 1, 0,
     OPAQUE},
    {"discs without normals", 203, 151, 9000, POINTS_COLORS, STAGE_MANY, 0, 0, LIT, REFINED, DISCS, 3, 2, 0, 0, OPAQUE},
    {"discs with opacities",
     203,
     151,
     20000,
     POINTS_ALL,
     STAGE_MANY,
     0,
     0,
     LIT,
     REFINED,
     DISCS,
     0,
     0,
     1,
     0,
     {0.6f, 1, 5, LAYER_PASSES}},
    {"discs among meshes", 203, 151, 9000, POINTS_ALL, STAGE_MESHES, 0, 1, LIT, REFINED, DISCS, 0, 0, 0, 0, OPAQUE},
    {"footprints, one pixel", 1, 1, 5000, POINTS_ALL, STAGE_ONE, 0, 0, LIT, REFINED, KNOWN, 0, 0, 0, 0, OPAQUE},
    {"footprints, density 0.1 to 30", 203, 151, 40000, POINTS_ALL, STAGE_ONE, 0, 1, LIT, REFINED, KNOWN, 0, 0, 0, 1, OPAQUE},
    {"footprints without normals, orthographic", 203, 151, 30000, POINTS_COLORS, STAGE_MANY, 1, 0, LIT, REFINED, KNOWN, 0, 0, 1,
     1, OPAQUE},
    {"footprints with opacities",
     203,
     151,
     20000,
     POINTS_ALL,
     STAGE_MANY,
     0,
     0,
     LIT,
     REFINED,
     KNOWN,
     0,
     0,
     1,
     1,
     {0.6f, 1, 5, LAYER_PASSES}},
    {"footprints among meshes", 203, 151, 9000, POINTS_ALL, STAGE_MESHES, 0, 1, LIT, REFINED, KNOWN, 0, 0, 0, 1, OPAQUE},
    {"meshes and points under a sky", 203, 151, 20000, POINTS_ALL, STAGE_SKY, 0, 1, LIT, REFINED, CLOSED, 0, 0, 0, 0, OPAQUE},
    {"discs under a sky, orthographic", 203, 151, 9000, POINTS_COLORS, STAGE_SKY, 1, 0, LIT, REFINED, DISCS, 0, 0, 1, 0,
     OPAQUE},
    {"range images, one pixel", 1, 1, 5000, POINTS_ALL, STAGE_ONE, 0, 0, LIT, REFINED, RANGES, 0, 0, 0, 0, OPAQUE},
    {"range images", 203, 151, 60000, POINTS_ALL, STAGE_ONE, 0, 1, LIT, REFINED, RANGES, 0, 0, 0, 0, OPAQUE},
    {"range images, sparse, orthographic", 203, 151, 4000, POINTS_COLORS, STAGE_MANY, 1, 0, AUTO, REFINED, RANGES, 3, 0, 1, 1,
     OPAQUE},
    {"range images, transparent",
     203,
     151,
     30000,
     POINTS_ALL,
     STAGE_MANY,
     0,
     0,
     LIT,
     REFINED,
     RANGES,
     0,
     0,
     1,
     0,
     {0.6f, 1, 4, LAYER_PASSES}},
    {"range images beside filled points", 203, 151, 15000, POINTS_ALL, STAGE_MANY, 0, 0, LIT, REFINED, BESIDE, 0, 0, 0, 0,
     OPAQUE},
    {"range images among meshes", 203, 151, 30000, POINTS_PLAIN, STAGE_MESHES, 0, 0, LIT, REFINED, RANGES, 0, 0, 0, 0, OPAQUE},
};
const uint32_t staging_count = sizeof stagings / sizeof stagings[0];

static void add(struct stage *stage, const struct staging *staging, const double matrix[16], float transparency)
{
    patina_cloud_style style = {.struct_size = sizeof style, .lighting = staging->lighting};
    style.cull_back = staging->cull_back;
    if (staging->fill == BESIDE && stage->range_images++ % 2 == 0)
        style.surface = PATINA_SURFACE_RANGES;
    style.range_sharpness = staging->smooth == 3 || staging->fill == BESIDE ? 0.75f : 0.0f;
    style.ambient = 0.6f;
    style.diffuse = 0.9f;
    style.specular = 0.4f;
    style.shininess = 20;
    style.transparency = staging->glass.transparency > 0.0f ? transparency : 0.0f;
    for (int k = 0; k < 16; k++)
        style.world_from_object[k] = matrix[k];
    CHECK(patina_scene_add_cloud(stage->scene, stage->cloud, &style), stage->scene);
}

static void add_lights(patina_scene *scene)
{
    patina_light_desc sun = {.struct_size = sizeof sun, .type = PATINA_LIGHT_SUN, .power = 2.5f};
    sun.direction[0] = -0.4;
    sun.direction[1] = 0.7;
    sun.direction[2] = -0.6;
    CHECK(patina_scene_add_light(scene, &sun), scene);
    patina_light_desc lamp = {.struct_size = sizeof lamp, .type = PATINA_LIGHT_POINT, .power = 90.0f};
    lamp.color[0] = 1.0f;
    lamp.color[1] = 0.7f;
    lamp.color[2] = 0.3f;
    lamp.position[0] = 1.5;
    lamp.position[1] = -1.0;
    lamp.position[2] = 1.8;
    CHECK(patina_scene_add_light(scene, &lamp), scene);
}

// Points of an even torus that survive a chance falling from 1 to 1/300 along x.
static void thin_out(struct points *points)
{
    struct pcg random = pcg_seed(99);
    uint64_t kept = 0;
    for (uint64_t i = 0; i < points->count; i++) {
        double along = (points->position[3 * i] + 1.4) / 2.8;
        if (pcg_unit(&random) >= pow(300.0, -along))
            continue;
        for (int k = 0; k < 3; k++) {
            points->position[3 * kept + k] = points->position[3 * i + k];
            if (points->normal)
                points->normal[3 * kept + k] = points->normal[3 * i + k];
            if (points->color)
                points->color[3 * kept + k] = points->color[3 * i + k];
        }
        kept++;
    }
    points->count = kept;
}

// Patches of the surface are opaque, clear, or anything between.
static patina_cloud *upload_with_opacities(const struct points *points)
{
    struct pcg random = pcg_seed(5);
    float *opacity = malloc((points->count + 1) * sizeof *opacity);
    assert_non_null(opacity);
    for (uint64_t i = 0; i < points->count; i++) {
        const float *p = points->position + 3 * i;
        double patch = sin(5.0 * (double)p[0]) * sin(5.0 * (double)p[1]);
        opacity[i] = patch > 0.6 ? 1.0f : patch < -0.6 ? 0.0f : (float)pcg_unit(&random);
    }
    patina_cloud_desc desc = points_desc(points);
    desc.opacity = (patina_array){.data = opacity, .type = PATINA_FLOAT32, .components = 1};
    patina_cloud *cloud = NULL;
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    free(opacity);
    return cloud;
}

struct stage stage_build(const struct staging *staging)
{
    struct stage stage = {0};
    uint64_t count = staging->stretched ? 12 * staging->points : staging->points;
    struct points points = points_torus(count, 1.0, 0.4, staging->columns, 7);
    if (staging->stretched)
        thin_out(&points);
    stage.cloud = staging->glass.own_opacity ? upload_with_opacities(&points) : points_upload(&points);
    points_free(&points);
    if (staging->fill == KNOWN)
        CHECK(patina_cloud_analyse(stage.cloud, NULL, NULL), stage.cloud);

    CHECK(patina_scene_create(&stage.scene), NULL);
    const double identity[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    add(&stage, staging, identity, staging->glass.transparency);
    if (staging->objects == STAGE_MANY) {
        const double mirrored[16] = {-0.6, 0, 0, 0.9, 0, 0.6, 0, 0.8, 0, 0, 0.6, 0.5, 0, 0, 0, 1};
        const double uneven[16] = {0.3, -0.4, 0.1, -0.8, 0.2, 0.7, 0.0, -0.7, -0.3, 0.1, 1.1, 0.3, 0, 0, 0, 1};
        const double flat[16] = {0.5, 0, 0, 0.9, 0, 0.5, 0, -0.9, 0, 0, 0, -0.4, 0, 0, 0, 1};
        const double point[16] = {0, 0, 0, 0.0, 0, 0, 0, -1.2, 0, 0, 0, 0.6, 0, 0, 0, 1};
        const double far_off[16] = {1, 0, 0, 500, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
        add(&stage, staging, mirrored, 0.0f);
        add(&stage, staging, uneven, 0.5f * staging->glass.transparency);
        add(&stage, staging, flat, 1.0f);
        add(&stage, staging, point, 0.9f);
        add(&stage, staging, far_off, 0.5f);
    }
    if (staging->objects == STAGE_MESHES || staging->objects == STAGE_SKY) {
        const double hub[3] = {0.1, 0.0, 0.1}, ball[3] = {0.9, 0.3, 0.1}, half[3] = {0.15, 1.3, 0.2};
        stage.meshes[0] = mesh_box(hub, half);
        stage.meshes[1] = mesh_sphere(ball, 0.45, 40, 1);
        mesh_add(stage.scene, stage.meshes[0], 0.7f, 0.3f, 0.1f);
        mesh_add(stage.scene, stage.meshes[1], 0.1f, 0.6f, 0.3f);
    }
    add_lights(stage.scene);

    const double eye[3] = {0.3, -2.7, 2.3}, target[3] = {0.0, 0.0, 0.0};
    stage.camera = staging->orthographic ? camera_orthographic(eye, target, 3.0, staging->width, staging->height, -20.0, 20.0)
                                         : camera_perspective(eye, target, 45.8, staging->width, staging->height, 0.1, 100.0);
    stage.settings = settings_default(staging->width, staging->height);
    stage.settings.quality = staging->quality;
    stage.settings.fill = staging->fill == DISCS ? OPEN : staging->fill >= KNOWN ? CLOSED : staging->fill;
    stage.settings.surface = staging->fill == DISCS    ? PATINA_SURFACE_SPLATS
                             : staging->fill == KNOWN  ? PATINA_SURFACE_AUTO
                             : staging->fill == RANGES ? PATINA_SURFACE_RANGES
                                                       : PATINA_SURFACE_FILL;
    stage.settings.smooth = staging->smooth;
    stage.settings.antialias = staging->antialias;
    stage.settings.film_transparent = staging->film_transparent;
    stage.settings.layers = staging->glass.layers;
    stage.settings.layer_passes = staging->glass.layer_passes;
    stage.settings.world_color[0] = 0.05f;
    stage.settings.world_color[1] = 0.06f;
    stage.settings.world_color[2] = 0.08f;
    stage.settings.world_directed = staging->objects == STAGE_SKY;
    for (int k = 0; k < 27; k++)
        stage.settings.world_light[k / 9][k % 9] = k % 9 ? 0.3f * (float)sin(1.7 * k) : 0.5f;
    return stage;
}

void stage_free(struct stage *stage)
{
    patina_scene_destroy(stage->scene);
    patina_cloud_destroy(stage->cloud);
    for (int i = 0; i < 2; i++)
        patina_mesh_destroy(stage->meshes[i]);
    *stage = (struct stage){0};
}
