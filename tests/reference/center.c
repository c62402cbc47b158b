// SPDX-License-Identifier: GPL-3.0-or-later
// The tangent plane n . (p - q) = 0 of a point q, met by the ray through the middle of its pixel.
#include "reference.h"
#include "tolerances.h"

#include <math.h>

struct ref_center ref_center(const struct view_args *view, const float normal[3], double deff, const struct ref_place *place,
                             int x, int y)
{
    const struct ref_ray ray = ref_ray(view, x, y);
    const struct ref_vec n = ref_vec_of(normal);
    const double px = 0.5 * (place->x.lo + place->x.hi), py = 0.5 * (place->y.lo + place->y.hi);
    const double z = 0.5 * (place->z.lo + place->z.hi), scale = view->perspective ? z : 1.0;
    const double dx = view->origin_x + x + 0.5 - px, dy = view->origin_y + y + 0.5 - py;
    const double facing = view->perspective ? n.x * ray.u + n.y * ray.v - n.z : -n.z;
    const double rise = scale * (n.x * view->ray_xs * dx + n.y * view->ray_ys * dy);
    // where float32 has the point, and the roundings of what it is multiplied by
    const double off_x = 0.5 * (place->x.hi - place->x.lo) + TOL_SUM * (fabs(px) + fabs(dx));
    const double off_y = 0.5 * (place->y.hi - place->y.lo) + TOL_SUM * (fabs(py) + fabs(dy));
    const double wide_x = fabs(n.x * (double)view->ray_xs), wide_y = fabs(n.y * (double)view->ray_ys);
    const double off_rise = scale * (wide_x * off_x + wide_y * off_y + TOL_DOT * 2.0 * (wide_x * fabs(dx) + wide_y * fabs(dy)));
    const double off_facing = view->perspective ? TOL_DOT * (fabs(n.x * ray.u) + fabs(n.y * ray.v) + fabs(n.z)) +
                                                      fabs(n.x) * ray.error_u + fabs(n.y) * ray.error_v
                                                : 0.0;
    const double least = -fmin(deff, 0.5 * z);
    struct ref_center out = {.low = least, .high = deff};
    if (fabs(facing) < TOL_PARALLEL) { // any step within the bounds, or none
        out.low = fmin(least, 0.0);
        return out;
    }
    const double offset = -rise / facing;
    const double error = off_rise / fabs(facing) + fabs(offset) * (TOL_QUOTIENT + 2.0 * off_facing / fabs(facing));
    const double slack = TOL_UNIT * fmax(deff, z);
    out.low = fmin(fmax(offset - error, least - slack), deff);
    out.high = fmax(fmin(offset + error, deff), least);
    return out;
}
