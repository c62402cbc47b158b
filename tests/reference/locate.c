// SPDX-License-Identifier: GPL-3.0-or-later
// Where a pixel that shows a mesh lies: on its ray at the key's depth.
#include "reference.h"
#include "tolerances.h"
#include "shared/meshes.h"

#include <math.h>

struct ref_locate ref_locate(const struct locate_args *args, const float *vertices, const uint32_t *indices, uint64_t shown,
                             uint64_t mesh_key, int x, int y)
{
    const struct view_args *view = &args->view;
    struct ref_locate out = {0};
    uint32_t triangle = ref_key_id(mesh_key) - args->mesh.id_base;
    double z = ref_key_z(shown), cx = view->origin_x + x + 0.5, cy = view->origin_y + y + 0.5;
    out.ours = triangle < args->mesh.id_count && isfinite(z);
    if (!out.ours)
        return out;
    double far = view->perspective ? z : 1.0;
    double u = (double)view->ray_x0 + (double)view->ray_xs * cx, v = (double)view->ray_y0 + (double)view->ray_ys * cy;
    out.p = ref_vec(u * far, v * far, -(z + (double)args->eye_z));
    double size = fabs((double)view->ray_x0) + fabs((double)view->ray_xs * cx) + fabs((double)view->ray_y0) +
                  fabs((double)view->ray_ys * cy);
    out.error = 8.0 * TOL_UNIT * (size * far + fabs(z) + fabs((double)args->eye_z));
    // the plane is that of cover
    struct cover_args cover = {.view = *view, .mesh = args->mesh};
    struct ref_cover shows = ref_cover(&cover, vertices, indices, ~0ull, mesh_key, 0.0f, x, y);
    out.n = shows.n;
    out.normal_error = shows.plane_error + 1.5 / 4095.0; // a step is 1 / 4095 along each side of the octahedron
    return out;
}
