// SPDX-License-Identifier: GPL-3.0-or-later
// What a pixel shows of the triangle in front: normals, layer distance (SPEC 1), colour.
#include "reference.h"
#include "tolerances.h"
#include "shared/meshes.h"

#include <math.h>

static struct ref_vec cross(struct ref_vec a, struct ref_vec b)
{
    return ref_vec(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

// Object normal to view space; *error: how far off float32 may be, given that n itself is off by `before`.
static struct ref_vec turn(const float m[9], struct ref_vec n, double before, double *error)
{
    struct ref_vec out = ref_vec(m[0] * n.x + m[1] * n.y + m[2] * n.z, m[3] * n.x + m[4] * n.y + m[5] * n.z,
                                 m[6] * n.x + m[7] * n.y + m[8] * n.z);
    double largest = 0.0, length = ref_length(out);
    for (int i = 0; i < 9; i++)
        largest = fmax(largest, fabs((double)m[i]));
    *error = length > 0.0 ? TOL_NORMAL + 3.0 * largest * (before + TOL_NORMAL * ref_length(n)) / length : 2.0;
    return ref_unit(out);
}

struct ref_cover ref_cover(const struct cover_args *args, const float *vertices, const uint32_t *indices, uint64_t key,
                           uint64_t mesh_key, float limit, int x, int y)
{
    const struct view_args *view = &args->view;
    const struct mesh_args *mesh = &args->mesh;
    struct ref_cover out = {0};
    uint32_t triangle = ref_key_id(mesh_key) - mesh->id_base;
    int open = args->behind && ref_key_z(key) <= (double)limit;
    out.front = triangle < mesh->id_count && isfinite(ref_key_z(mesh_key)) && (mesh_key < key || open);
    if (!out.front)
        return out;
    const float *v[3];
    double at[3][3], share[3], sum = 0.0, moved = 0.0;
    double cx = view->origin_x + x + 0.5, cy = view->origin_y + y + 0.5, away[3][2];
    for (int i = 0; i < 3; i++) {
        v[i] = vertices + (size_t)mesh->stride * indices[3 * (size_t)triangle + (size_t)i];
        double terms = 0.0;
        for (int k = 0; k < 3; k++) {
            at[i][k] = (double)mesh->lo[k] + (double)mesh->hi[k];
            for (int c = 0; c < 3; c++)
                at[i][k] += (double)mesh->row[3 * k + c] * v[i][c];
            terms += fabs(at[i][k]) + fabs((double)mesh->hi[k]);
        }
        double w = view->perspective ? at[i][2] : 1.0;
        away[i][0] = at[i][0] - cx * w;
        away[i][1] = at[i][1] - cy * w;
        moved = fmax(moved, 8.0 * TOL_UNIT * (terms + (cx + cy) * fabs(w)));
    }
    double reach = 0.0;
    for (int i = 0; i < 3; i++) {
        const double *a = away[(i + 1) % 3], *b = away[(i + 2) % 3];
        share[i] = a[0] * b[1] - b[0] * a[1];
        sum += share[i];
        reach = fmax(reach, hypot(away[i][0], away[i][1]));
    }
    double turned = sum < 0.0 ? -1.0 : 1.0, total = 0.0;
    for (int i = 0; i < 3; i++) {
        share[i] = fmax(turned * share[i], 0.0); // outside of a corner's cell by rounding alone
        total += share[i];
    }
    // how far a share may be off: float32 in the corners, over the triangle's size
    double share_error = total > 0.0 ? fmin(1.0, 16.0 * moved * (reach + moved) / total + 16.0 * TOL_UNIT) : 1.0;
    for (int i = 0; i < 3; i++)
        share[i] = total > 0.0 ? share[i] / total : 1.0 / 3.0;

    struct ref_vec p[3], edge[2], viewer = ref_viewer(view, ref_ray(view, x, y));
    for (int i = 0; i < 3; i++)
        p[i] = ref_vec_of(v[i]);
    edge[0] = ref_add(p[1], ref_scale(p[0], -1.0));
    edge[1] = ref_add(p[2], ref_scale(p[0], -1.0));
    double sides = ref_length(edge[0]) * ref_length(edge[1]);
    out.n = turn(mesh->normal_matrix, cross(edge[0], edge[1]), 8.0 * TOL_UNIT * sides, &out.plane_error);
    out.smooth = out.n;
    out.smooth_error = out.plane_error;
    if (mesh->has_normals) {
        struct ref_vec n = {0.0, 0.0, 0.0};
        double size = 0.0;
        for (int i = 0; i < 3; i++) {
            n = ref_add(n, ref_scale(ref_vec_of(v[i] + 3), share[i]));
            size += ref_length(ref_vec_of(v[i] + 3));
        }
        out.smooth = turn(mesh->normal_matrix, n, (share_error + 8.0 * TOL_UNIT) * size, &out.smooth_error);
    }
    for (int k = 0; k < 3; k++) {
        out.albedo[k] = (double)mesh->color[k];
        double size = 0.0;
        for (int i = 0; i < 3 && mesh->has_colors; i++) {
            double c = (double)v[i][3 + 3 * mesh->has_normals + (uint32_t)k];
            out.albedo[k] = i ? out.albedo[k] + share[i] * c : share[i] * c;
            size += fabs(c);
        }
        out.albedo_error = fmax(out.albedo_error, (share_error + 8.0 * TOL_UNIT) * size);
    }
    double cosine = fabs(ref_dot(out.n, viewer)), floored = fmax(cosine, (double)PT_COSINE_FLOOR);
    double turn_error = out.plane_error * (fabs(viewer.x) + fabs(viewer.y) + fabs(viewer.z));
    double off = TOL_LAYER + (cosine + turn_error > (double)PT_COSINE_FLOOR ? turn_error / floored : 0.0);
    out.inverse = 1.0 / floored;
    out.inverse_error = out.inverse * off;
    out.deff = ref_layer_minimum(view, 0.0, ref_footprint(view, ref_key_z(mesh_key)), ref_key_z(mesh_key)) * out.inverse;
    out.deff_error = out.deff * off;
    return out;
}
