// SPDX-License-Identifier: GPL-3.0-or-later
#include "mesh.h"
#include "base/descriptor.h"

#include "scene/clouds/fingerprint.h"
#include "base/vector.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static int fail(const char *what) { return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_mesh_create: %s", what); }

static int check_desc(patina_mesh_desc *desc)
{
    const uint32_t floats = 1u << PATINA_FLOAT32 | 1u << PATINA_FLOAT64;
    int error;
    if (desc->vertex_count && !desc->position.data)
        return fail("position has no data");
    if (desc->vertex_count > 1u << 27 || desc->triangle_count > 1u << 29)
        return fail("more than 2^27 vertices or 2^29 triangles: split the mesh");
    if ((error = pt_check_array(&desc->position, "position", floats, 3, 3)) ||
        (error = pt_check_array(&desc->normal, "normal", floats, 3, 3)) ||
        (error = pt_check_array(&desc->color, "color", 1u << PATINA_FLOAT32, 3, 4)) ||
        (error = pt_check_array(&desc->uv, "uv", floats, 2, 2)))
        return error;
    if (!desc->indices && 3 * desc->triangle_count > desc->vertex_count)
        return fail("fewer vertices than three a triangle, and no indices");
    for (uint64_t i = 0; desc->indices && i < 3 * desc->triangle_count; i++)
        if (desc->indices[i] >= desc->vertex_count)
            return pt_fail(NULL, PATINA_ERROR_ARGUMENT,
                           "patina_mesh_create: index %u of triangle %llu is not below %llu vertices", desc->indices[i],
                           (unsigned long long)(i / 3), (unsigned long long)desc->vertex_count);
    return PATINA_OK;
}

static void find_box(const patina_mesh_desc *desc, struct patina_mesh *mesh)
{
    double *low = mesh->info.box_min, *high = mesh->info.box_max;
    for (int k = 0; k < 3; k++) {
        low[k] = INFINITY;
        high[k] = -INFINITY;
    }
    for (uint64_t i = 0; i < desc->vertex_count; i++) {
        double p[3];
        pt_read_vector(&desc->position, i, p);
        for (int k = 0; k < 3 && pt_finite3(p); k++) {
            low[k] = fmin(low[k], p[k]);
            high[k] = fmax(high[k], p[k]);
        }
    }
    for (int k = 0; k < 3 && low[0] <= high[0]; k++) {
        mesh->box.origin[k] = 0.5 * low[k] + 0.5 * high[k];
        mesh->box.box_min[k] = (float)(low[k] - mesh->box.origin[k]);
        mesh->box.box_max[k] = (float)(high[k] - mesh->box.origin[k]);
    }
}

// What is not finite becomes 0.
static void put3(const patina_array *array, uint64_t index, float *out)
{
    double v[3];
    pt_read_vector(array, index, v);
    for (int k = 0; k < 3; k++)
        out[k] = pt_finite3(v) ? (float)v[k] : 0.0f;
}

static void put_uv(const patina_array *array, uint64_t index, float *out)
{
    const char *from = (const char *)array->data + index * array->stride;
    for (int k = 0; k < 2; k++) {
        double v;
        float f;
        memcpy(&v, from + 8 * k * (array->type == PATINA_FLOAT64), array->type == PATINA_FLOAT64 ? 8 : 4);
        memcpy(&f, from + 4 * k, 4);
        f = array->type == PATINA_FLOAT64 ? (float)v : f;
        out[k] = isfinite(f) ? f : 0.0f;
    }
}

static void take_vertices(const patina_mesh_desc *desc, struct patina_mesh *mesh)
{
    for (uint64_t i = 0; i < desc->vertex_count; i++) {
        float *out = mesh->vertices + i * mesh->stride;
        double p[3];
        pt_read_vector(&desc->position, i, p);
        for (int k = 0; k < 3; k++)
            out[k] = pt_finite3(p) ? (float)(p[k] - mesh->box.origin[k]) : NAN;
        if (mesh->has_normals)
            put3(&desc->normal, i, out + 3);
        if (mesh->has_colors)
            put3(&desc->color, i, out + 3 + 3 * mesh->has_normals);
        if (mesh->has_uv)
            put_uv(&desc->uv, i, out + mesh->stride - 2);
    }
    for (uint64_t i = 0; i < 3 * desc->triangle_count; i++)
        mesh->indices[i] = desc->indices ? desc->indices[i] : (uint32_t)i;
}

static int build(const patina_mesh_desc *desc, struct patina_mesh *mesh)
{
    mesh->has_normals = desc->normal.data != NULL;
    mesh->has_colors = desc->color.data != NULL;
    mesh->has_uv = desc->uv.data != NULL;
    mesh->stride = 3 + 3 * mesh->has_normals + 3 * mesh->has_colors + 2 * mesh->has_uv;
    size_t vertex_bytes = desc->vertex_count * mesh->stride * sizeof *mesh->vertices;
    size_t index_bytes = 3 * desc->triangle_count * sizeof *mesh->indices;
    mesh->alive = calloc(1, sizeof *mesh->alive);
    mesh->vertices = malloc(vertex_bytes + 1);
    mesh->indices = malloc(index_bytes + 1);
    if (!mesh->alive || !mesh->vertices || !mesh->indices)
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "a mesh of %llu vertices and %llu triangles: out of memory",
                       (unsigned long long)desc->vertex_count, (unsigned long long)desc->triangle_count);
    mesh->info = (patina_mesh_info){.struct_size = sizeof mesh->info,
                                    .vertex_count = desc->vertex_count,
                                    .triangle_count = desc->triangle_count,
                                    .bytes = vertex_bytes + index_bytes};
    find_box(desc, mesh);
    take_vertices(desc, mesh);
    atomic_init(&mesh->alive->references, 1);
    atomic_init(&mesh->alive->alive, 1);
    uint64_t words = pt_fingerprint(pt_fingerprint(mesh->stride, mesh->vertices, vertex_bytes), mesh->indices, index_bytes);
    atomic_init(&mesh->alive->fingerprint, pt_fingerprint(words, mesh->box.origin, sizeof mesh->box.origin));
    return PATINA_OK;
}

static void release(struct patina_mesh *mesh)
{
    pt_alive_end(mesh->alive);
    free(mesh->vertices);
    free(mesh->indices);
    free(mesh);
}

int patina_mesh_create(const patina_mesh_desc *desc, patina_mesh **out)
{
    patina_mesh_desc checked;
    if (!desc || !out)
        return fail("desc or out is NULL");
    *out = NULL;
    int error = pt_take(NULL, "patina_mesh_create", desc, &checked, sizeof checked);
    error = error ? error : check_desc(&checked);
    if (error)
        return error;
    struct patina_mesh *mesh = calloc(1, sizeof *mesh);
    error = mesh ? build(&checked, mesh) : pt_fail(NULL, PATINA_ERROR_MEMORY, "a mesh: out of memory");
    if (error) {
        if (mesh) {
            free(mesh->alive); // nobody else knows it
            mesh->alive = NULL;
            release(mesh);
        }
        return error;
    }
    pt_handle_init(&mesh->handle);
    *out = mesh;
    return PATINA_OK;
}

void patina_mesh_destroy(patina_mesh *mesh)
{
    if (!mesh)
        return;
    pt_handle_destroy(&mesh->handle);
    release(mesh);
}

int patina_mesh_get_info(const patina_mesh *mesh, patina_mesh_info *info)
{
    if (!mesh)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_mesh_get_info: mesh is NULL");
    return pt_give(&mesh->handle, "patina_mesh_get_info", &mesh->info, sizeof mesh->info, info);
}
