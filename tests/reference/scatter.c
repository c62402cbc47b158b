// SPDX-License-Identifier: GPL-3.0-or-later
// [D 3.1], SPEC 1: where a point may fall, and how deep, whatever float32 makes of it.
#include "reference.h"
#include "tolerances.h"

#include <math.h>

// lo + R p + hi with a bound of what float32 adds to it.
static double project(const struct chunk_view *chunk, int row, const double p[3], double *error)
{
    const float *r = chunk->row + 3 * row;
    double terms = fabs((double)chunk->lo[row]) + fabs(r[0] * p[0]) + fabs(r[1] * p[1]) + fabs(r[2] * p[2]);
    double value = chunk->lo[row] + r[0] * p[0] + r[1] * p[1] + r[2] * p[2] + chunk->hi[row];
    *error = TOL_PROJECT * terms + TOL_SUM * fabs(value);
    return value;
}

static struct ref_range divide(double a, double error_a, struct ref_range z)
{
    double corner[4] = {(a - error_a) / z.lo, (a - error_a) / z.hi, (a + error_a) / z.lo, (a + error_a) / z.hi};
    struct ref_range range = {corner[0], corner[0]};
    for (int i = 1; i < 4; i++) {
        range.lo = fmin(range.lo, corner[i]);
        range.hi = fmax(range.hi, corner[i]);
    }
    range.lo -= TOL_SCREEN * fabs(range.lo);
    range.hi += TOL_SCREEN * fabs(range.hi);
    return range;
}

enum ref_truth ref_culled(const struct chunk_view *chunk, const double p[3], uint32_t word)
{
    struct ref_vec n;
    if (!chunk->cull || !ref_decode_normal(word, &n))
        return REF_NO;
    double normal[3] = {n.x, n.y, n.z}, side = 0.0, terms = 0.0;
    for (int i = 0; i < 3; i++) {
        side += normal[i] * (chunk->eye[i] - chunk->eye[3] * p[i]);
        terms += fabs(normal[i]) * (fabs((double)chunk->eye[i]) + fabs(chunk->eye[3] * p[i]));
        // A component near zero comes from a sum that cancels: its error is a share of 1.
        terms += fabs(chunk->eye[i] - chunk->eye[3] * p[i]) * (normal[i] != 0.0);
    }
    struct ref_range range = {side - TOL_CULL * terms, side + TOL_CULL * terms};
    return ref_less_equal(range, ref_exactly(0.0));
}

// Pixels of one axis; 0 when none of them lies in the plane.
static int pixels(struct ref_range screen, int origin, uint32_t size, int *first, int *last)
{
    double a = floor(screen.lo) - origin, b = floor(screen.hi) - origin;
    if (!(b >= 0.0 && a < size))
        return 0;
    *first = (int)fmax(a, 0.0);
    *last = (int)fmin(b, size - 1.0);
    return 1;
}

struct ref_place ref_place(const struct view_args *view, const struct chunk_view *chunk, const float *positions, uint32_t slot)
{
    const float *base = positions + 3 * (size_t)chunk->first;
    double p[3] = {base[slot], base[chunk->padded + slot], base[2 * (size_t)chunk->padded + slot]}, error[3];
    struct ref_place place = {.known = 1};
    double x = project(chunk, 0, p, &error[0]), y = project(chunk, 1, p, &error[1]), z = project(chunk, 2, p, &error[2]);
    place.z = (struct ref_range){z - error[2], z + error[2]};
    place.x = (struct ref_range){x - error[0], x + error[0]};
    place.y = (struct ref_range){y - error[1], y + error[1]};
    if (view->perspective && place.z.lo > 0.0) {
        place.x = divide(x, error[0], place.z);
        place.y = divide(y, error[1], place.z);
    } else if (view->perspective) {
        place.known = 0;
    }
    place.known &= isfinite(x) && isfinite(y) && isfinite(z);
    return place;
}

struct ref_splat ref_scatter(const struct view_args *view, const struct chunk_view *chunk, const float *positions,
                             const uint32_t *surfels, uint32_t slot)
{
    const float *base = positions + 3 * (size_t)chunk->first;
    double p[3] = {base[slot], base[chunk->padded + slot], base[2 * (size_t)chunk->padded + slot]};
    uint32_t id = chunk->first + slot;
    struct ref_splat splat = {.id = chunk->id_base + id};
    double ex, ey, ez;
    double x = project(chunk, 0, p, &ex), y = project(chunk, 1, p, &ey), z = project(chunk, 2, p, &ez);
    if (!isfinite(x) || !isfinite(y) || !isfinite(z))
        return splat;

    struct ref_range depth = {z - ez, z + ez}, drawn = {view->z_near, view->z_far};
    if (depth.hi < drawn.lo || depth.lo > drawn.hi)
        return splat;
    splat.definite = depth.lo >= drawn.lo && depth.hi <= drawn.hi;
    splat.z.lo = fmax(depth.lo, drawn.lo);
    splat.z.hi = fmin(depth.hi, drawn.hi);

    struct ref_range sx = {x - ex, x + ex}, sy = {y - ey, y + ey};
    if (view->perspective) {
        sx = divide(x, ex, splat.z);
        sy = divide(y, ey, splat.z);
    }
    if (!pixels(sx, view->origin_x, view->width, &splat.x0, &splat.x1) ||
        !pixels(sy, view->origin_y, view->height, &splat.y0, &splat.y1))
        return splat;
    if (floor(sx.lo) != floor(sx.hi) || floor(sy.lo) != floor(sy.hi))
        splat.definite = 0;

    enum ref_truth culled = ref_culled(chunk, p, chunk->cull ? surfels[id] : 0);
    splat.possible = culled != REF_YES;
    if (culled != REF_NO)
        splat.definite = 0;
    return splat;
}
