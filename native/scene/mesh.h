// SPDX-License-Identifier: GPL-3.0-or-later
// A mesh: triangles over vertices, each its position, normal, colour and uv in one place.
#ifndef PT_MESH_H
#define PT_MESH_H

#include "scene/clouds/cloud.h"

struct patina_mesh {
    struct pt_handle handle;
    patina_mesh_info info;
    struct pt_alive *alive;
    struct pt_chunk box; // origin and box alone: what the vertices are relative to, and span
    uint32_t stride;     // floats a vertex: 3, and 3 more each for normals and colours, 2 for uv
    uint32_t has_normals, has_colors, has_uv;
    float *vertices;
    uint32_t *indices;
};

// Has it anything that can be seen?
static inline int pt_mesh_drawn(const struct patina_mesh *mesh)
{
    return mesh->info.triangle_count && mesh->info.box_min[0] <= mesh->info.box_max[0];
}

#endif
