// SPDX-License-Identifier: GPL-3.0-or-later
// Points behind the soft points of a light's view, SPEC 5: between the middles of texels, and between the ends of slabs.
#include "reference.h"
#include "tolerances.h"
#include "shared/shadows.h"
#include "shared/words.h"

#include <math.h>

static double between(double x, double low, double high) { return fmin(fmax(x, low), high); }

// -ln of the light that comes through to z.
static double texel_at(const struct dim_args *args, const float *veil, double column, double row, double z)
{
    const struct view_args *view = &args->view;
    const double x = between(column, 0.0, view->width - 1.0), y = between(row, 0.0, view->height - 1.0);
    const float *slabs = veil + (size_t)(y * view->width + x) * args->veils;
    const double deep = between((z - (double)args->veil_from) * (double)args->veil_scale, 0.0, args->veils),
                 slab = fmin(floor(deep), args->veils - 1.0);
    const double before = slab > 0.0 ? (double)slabs[(size_t)slab - 1] : 0.0;
    return before + (deep - slab) * ((double)slabs[(size_t)slab] - before);
}

double ref_dim_at(const struct dim_args *args, const float *veil, double x, double y, double z)
{
    const double px = x - 0.5 - args->view.origin_x, py = y - 0.5 - args->view.origin_y, column = floor(px), row = floor(py);
    double lost = 0.0;
    for (int k = 0; k < 4; k++) {
        const double across = k & 1 ? px - column : 1.0 - (px - column), up = k & 2 ? py - row : 1.0 - (py - row);
        lost += across * up * texel_at(args, veil, column + (k & 1), row + (k >> 1), z);
    }
    return lost;
}

enum ref_truth ref_dim(const struct dim_args *args, const float *veil, const struct chunk_view *chunk, const float *positions,
                       uint32_t slot, double loss[2])
{
    const struct view_args *view = &args->view;
    const struct ref_place place = ref_place(view, chunk, positions, slot);
    loss[0] = loss[1] = 0.0;
    if (!place.known || place.z.hi < (double)view->z_near)
        return REF_NO;
    const int inside = place.x.lo >= (double)args->window[0] && place.x.hi < (double)args->window[2] &&
                       place.y.lo >= (double)args->window[1] && place.y.hi < (double)args->window[3] &&
                       place.z.lo >= (double)view->z_near;
    const int outside = place.x.hi < (double)args->window[0] || place.x.lo >= (double)args->window[2] ||
                        place.y.hi < (double)args->window[1] || place.y.lo >= (double)args->window[3];
    if (outside)
        return REF_NO;
    double low = INFINITY, high = -INFINITY;
    for (int k = 0; k < 8; k++) { // between texels' middles and slabs' ends nothing is steeper than from corner to corner
        const double lost = ref_dim_at(args, veil, k & 1 ? place.x.hi : place.x.lo, k & 2 ? place.y.hi : place.y.lo,
                                       k & 4 ? place.z.hi : place.z.lo);
        low = fmin(low, lost);
        high = fmax(high, lost);
    }
    loss[0] = -255.0 * expm1(-low);
    loss[1] = -255.0 * expm1(-high);
    return inside ? REF_YES : REF_UNSURE;
}
