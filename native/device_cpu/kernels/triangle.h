// SPDX-License-Identifier: GPL-3.0-or-later
// What PT_LANES pixels show of a mesh: which part of a triangle, facing where; twin of shaders/lib/triangle.glsl
#ifndef PT_TRIANGLE_H
#define PT_TRIANGLE_H

#include "device_cpu/rows.h"
#include "shared/meshes.h"

struct pt_triangle {
    vi corner[3];      // first float of each vertex
    vf position[3][3]; // object units
    vf share[3];       // of each vertex at the pixel
    vf away[3][2];     // of each corner from the pixel's centre, times its depth
    vf depth[3];       // 1 in orthographic views
    vm turned;         // its corners run clockwise
};

// Which of PT_LANES pixels from `at` on show the mesh; index: its triangles that they show.
static inline vm pt_pixels_of_mesh(const struct mesh_args *mesh, const uint64_t *shown, const uint64_t *mesh_keys, size_t at,
                                   uint32_t lanes, vi *index)
{
    *index = vi_sub(vi_load_id(mesh_keys + at), vi_set(mesh->id_base));
    const vm ours = vm_and(vm_first(lanes), vi_lt_unsigned(*index, vi_set(mesh->id_count)));
    return vm_and(ours, vm_not(vi_eq(vi_load_z(shown + at), vi_set(PT_KEY_EMPTY_Z))));
}

static inline vf pt_between(const struct pt_triangle *t, const float *vertices, uint32_t offset, vm lanes)
{
    vf v[3];
    for (int i = 0; i < 3; i++)
        v[i] = vf_gather(vertices, vi_add(t->corner[i], vi_set(offset)), lanes);
    return (t->share[0] * v[0] + t->share[1] * v[1]) + t->share[2] * v[2];
}

// The triangle, and where on it the centres of PT_LANES pixels from (x, y) on lie: areas of the triangles that the centre
// makes with two corners each, as seen from the eye.
static inline void pt_find_triangle(const struct view_args *view, const struct mesh_args *mesh, const float *vertices,
                                    const uint32_t *indices, vi index, uint32_t x, uint32_t y, vm lanes, struct pt_triangle *t)
{
    const vf px = vi_convert(vi_add(vi_set((uint32_t)view->origin_x + x), vi_lanes())) + vf_set(0.5f);
    const vf py = vf_set((float)(view->origin_y + (int32_t)y) + 0.5f);
    vf f[3];
    for (uint32_t i = 0; i < 3; i++) {
        vi vertex = vi_gather(indices, vi_add(vi_mul(index, vi_set(3)), vi_set(i)), lanes);
        t->corner[i] = vi_mul(vertex, vi_set(mesh->stride));
        vf *p = t->position[i], at[3];
        for (uint32_t k = 0; k < 3; k++)
            p[k] = vf_gather(vertices, vi_add(t->corner[i], vi_set(k)), lanes);
        for (int row = 0; row < 3; row++) {
            const float *r = mesh->row + 3 * row;
            at[row] = (((vf_set(mesh->lo[row]) + vf_set(r[0]) * p[0]) + vf_set(r[1]) * p[1]) + vf_set(r[2]) * p[2]) +
                      vf_set(mesh->hi[row]);
        }
        t->depth[i] = view->perspective ? at[2] : vf_set(1.0f);
        t->away[i][0] = at[0] - px * t->depth[i];
        t->away[i][1] = at[1] - py * t->depth[i];
    }
    for (int i = 0; i < 3; i++)
        f[i] = t->away[(i + 1) % 3][0] * t->away[(i + 2) % 3][1] - t->away[(i + 2) % 3][0] * t->away[(i + 1) % 3][1];
    vf sum = (f[0] + f[1]) + f[2];
    t->turned = vf_lt(sum, vf_zero());
    for (int i = 0; i < 3; i++)
        f[i] = vf_max(vf_select(t->turned, vf_zero() - f[i], f[i]), vf_zero());
    sum = (f[0] + f[1]) + f[2];
    vm good = vm_and(vf_le(vf_set(1e-30f), sum), vf_le(sum, vf_set(1e30f)));
    vf scale = vf_rcp(vf_select(good, sum, vf_set(1.0f)));
    for (int i = 0; i < 3; i++)
        t->share[i] = vf_select(good, f[i] * scale, i ? vf_zero() : vf_set(1.0f));
}

// In view space and unit; where it is nothing, as n.
static inline void pt_turn_normal(const struct mesh_args *mesh, const vf object[3], vf n[3])
{
    const float *m = mesh->normal_matrix;
    vf turned[3];
    for (int k = 0; k < 3; k++)
        turned[k] = (vf_set(m[3 * k]) * object[0] + vf_set(m[3 * k + 1]) * object[1]) + vf_set(m[3 * k + 2]) * object[2];
    vf square = (turned[0] * turned[0] + turned[1] * turned[1]) + turned[2] * turned[2];
    vm good = vm_and(vf_le(vf_set(1e-30f), square), vf_le(square, vf_set(1e30f)));
    vf scale = vf_rsqrt(vf_select(good, square, vf_set(1.0f)));
    for (int k = 0; k < 3; k++)
        n[k] = vf_select(good, turned[k] * scale, n[k]);
}

// The plane's normal; of a triangle without one, towards the eye.
static inline void pt_plane_normal(const struct view_args *view, const struct mesh_args *mesh, const struct pt_triangle *t,
                                   const vf ray[2], vf n[3])
{
    vf a[3], b[3], across[3];
    for (int k = 0; k < 3; k++) {
        a[k] = t->position[1][k] - t->position[0][k];
        b[k] = t->position[2][k] - t->position[0][k];
    }
    for (int k = 0; k < 3; k++)
        across[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    n[0] = n[1] = vf_zero();
    n[2] = vf_set(1.0f);
    if (view->perspective) {
        vf r = vf_rsqrt((ray[0] * ray[0] + ray[1] * ray[1]) + vf_set(1.0f));
        n[0] = (vf_zero() - ray[0]) * r;
        n[1] = (vf_zero() - ray[1]) * r;
        n[2] = r;
    }
    pt_turn_normal(mesh, across, n);
}

#endif
