// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshes.h"

#include "support.h"

#include <math.h>
#include <stdlib.h>

static patina_mesh *make(const float *positions, const float *normals, uint64_t vertices, const uint32_t *indices,
                         uint64_t triangles)
{
    patina_mesh_desc desc = {.struct_size = sizeof desc,
                             .vertex_count = vertices,
                             .position = {.data = positions, .type = PATINA_FLOAT32, .components = 3},
                             .normal = {.data = normals, .type = PATINA_FLOAT32, .components = 3},
                             .triangle_count = triangles,
                             .indices = indices};
    patina_mesh *mesh = NULL;
    CHECK(patina_mesh_create(&desc, &mesh), NULL);
    return mesh;
}

patina_mesh *mesh_box(const double middle[3], const double half[3])
{
    static const uint32_t faces[6][4] = {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}};
    float positions[8][3];
    uint32_t indices[36];
    for (int corner = 0; corner < 8; corner++)
        for (int k = 0; k < 3; k++)
            positions[corner][k] = (float)(middle[k] + (corner >> k & 1 ? half[k] : -half[k]));
    for (int f = 0; f < 6; f++)
        for (int i = 0; i < 6; i++)
            indices[6 * f + i] = faces[f][i < 3 ? i : (i - 1) % 4];
    return make(positions[0], NULL, 8, indices, 12);
}

patina_mesh *mesh_sphere(const double middle[3], double radius, uint32_t rings, int normals)
{
    uint32_t columns = 2 * rings, count = (rings + 1) * (columns + 1), triangles = 0;
    float *positions = calloc(count, 12), *out = calloc(count, 12);
    uint32_t *indices = calloc((size_t)rings * columns * 6, 4);
    for (uint32_t j = 0; j <= rings; j++)
        for (uint32_t i = 0; i <= columns; i++) {
            double down = 3.14159265358979 * j / rings, around = 6.28318530717959 * (i % columns) / columns;
            const double n[3] = {sin(down) * cos(around), sin(down) * sin(around), cos(down)};
            for (uint32_t k = 0; k < 3; k++) {
                out[3 * (j * (columns + 1) + i) + k] = (float)n[k];
                positions[3 * (j * (columns + 1) + i) + k] = (float)(middle[k] + radius * n[k]);
            }
        }
    for (uint32_t j = 0; j < rings; j++)
        for (uint32_t i = 0; i < columns; i++) {
            uint32_t at = j * (columns + 1) + i;
            const uint32_t corners[6] = {at, at + columns + 1, at + 1, at + 1, at + columns + 1, at + columns + 2};
            for (int k = 0; k < 6; k++)
                indices[3 * (size_t)triangles + (size_t)k] = corners[k];
            triangles += 2;
        }
    patina_mesh *mesh = make(positions, normals ? out : NULL, count, indices, triangles);
    free(positions);
    free(out);
    free(indices);
    return mesh;
}

void mesh_add(patina_scene *scene, const patina_mesh *mesh, float red, float green, float blue)
{
    const patina_mesh_style style = {.struct_size = sizeof style, .color = {red, green, blue}};
    CHECK(patina_scene_add_mesh(scene, mesh, &style), scene);
}
