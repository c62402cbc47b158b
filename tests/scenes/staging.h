// SPDX-License-Identifier: GPL-3.0-or-later
// Scenes that must look the same whatever draws them: every device, any number of threads, whole or in crops.
#ifndef TEST_STAGING_H
#define TEST_STAGING_H

#include "clouds.h"
#include "support.h"

enum staging_objects { STAGE_ONE, STAGE_MANY, STAGE_MESHES, STAGE_SKY }; // SKY: meshes under a world that differs by direction

struct staging {
    const char *name;
    uint32_t width, height;
    uint64_t points;  // of the torus that the clouds sample
    unsigned columns; // points_columns
    enum staging_objects objects;
    uint32_t orthographic, cull_back, lighting;
    uint32_t quality, fill, smooth, antialias, film_transparent;
    uint32_t stretched; // density falls by 1/300 along x: coarse levels and dense ones in one picture
    struct {
        float transparency;   // of the first object, the third half of it, the second opaque, the fourth not drawn
        uint32_t own_opacity; // of points
        uint32_t layers, layer_passes;
    } glass;
};

extern const struct staging stagings[];
extern const uint32_t staging_count;

struct stage {
    patina_cloud *cloud;
    patina_mesh *meshes[2]; // of STAGE_MESHES and STAGE_SKY
    patina_scene *scene;
    patina_camera camera;
    patina_settings settings;
    uint32_t range_images; // instances added, where every other is
};

struct stage stage_build(const struct staging *staging);
void stage_free(struct stage *stage);

#endif
