// SPDX-License-Identifier: GPL-3.0-or-later
// Image-space normals: a plane n.P = const is exactly linear on screen in 1/z (perspective) or z (orthographic), so the
// plane fitted by least squares over a window gives it.
#include "reference.h"
#include "tolerances.h"
#include "shared/measured.h"

#include <math.h>
#include <stdlib.h>

enum { MOST = 33 * 33 };

// The pixels that take part, as offsets from the centre, f = 1/z or z relative to the centre's.
struct samples {
    int count;
    int dx[MOST], dy[MOST];
    double f[MOST];
    double centre, greatest; // f at the centre; greatest |f| of all
};

static double linear(const struct view_args *view, double z) { return view->perspective ? 1.0 / z : z; }

static double depth_at(const struct view_args *view, const struct ref_planes *planes, int x, int y)
{
    int inside = x >= 0 && y >= 0 && x < (int)view->width && y < (int)view->height;
    return inside ? ref_key_z(planes->keys[(size_t)y * view->width + (size_t)x]) : INFINITY;
}

// What depth changes by a pixel towards the next of (dx, dy) that is not empty; NaN where all are.
static double change_towards(const struct normals_args *args, const struct ref_planes *planes, int x, int y, int dx, int dy)
{
    double z = depth_at(&args->view, planes, x, y);
    for (int k = 1; k <= PT_STEP_REACH && k <= (int)args->radius; k++) {
        double q = depth_at(&args->view, planes, x + k * dx, y + k * dy);
        if (isfinite(q))
            return (q - z) / k;
    }
    return NAN;
}

// What depth changes by along an axis, where both sides rise or both fall: the gentler side's.
static double step_along(const struct normals_args *args, const struct ref_planes *planes, int x, int y, int dx, int dy)
{
    double into = -change_towards(args, planes, x, y, -dx, -dy), out = change_towards(args, planes, x, y, dx, dy);
    into = isnan(into) ? out : into;
    out = isnan(out) ? into : out;
    if (isnan(into) || !((into > 0.0 && out > 0.0) || (into < 0.0 && out < 0.0)))
        return 0.0;
    return fabs(into) < fabs(out) ? into : out;
}

// Radius of a window that reaches two spacings, `spacings` in pixels.
static int window_radius(double spacings, uint32_t most)
{
    return (int)fmin(fmax(ceil(spacings), (double)PT_ESTIMATE_LEAST), most);
}

static enum ref_truth gather(const struct normals_args *args, const struct ref_planes *planes, int x, int y,
                             struct samples *out)
{
    const struct view_args *view = &args->view;
    const struct instance_args *instance = &args->instance;
    uint64_t key = planes->keys[(size_t)y * view->width + (size_t)x];
    double z = ref_key_z(key);
    uint32_t word = planes->surfels[ref_key_id(key) - instance->id_base];
    double m = ref_layer_minimum(view, instance->d_min, instance->spacing[word >> PT_SPACING_SHIFT], z);
    double spacings = m / ref_footprint(view, z), off = TOL_QUOTIENT * spacings;
    int radius = window_radius(spacings, args->radius);
    double steps[2] = {0.0, 0.0};
    if (args->steep) {
        steps[0] = step_along(args, planes, x, y, 1, 0);
        steps[1] = step_along(args, planes, x, y, 0, 1);
    }
    if (window_radius(spacings - off, args->radius) != window_radius(spacings + off, args->radius))
        return REF_UNSURE;
    out->count = 0;
    out->centre = linear(view, z);
    out->greatest = 0.0;
    for (int dy = -radius; dy <= radius; dy++) {
        for (int dx = -radius; dx <= radius; dx++) {
            int qx = x + dx, qy = y + dy;
            if (qx < 0 || qy < 0 || qx >= (int)view->width || qy >= (int)view->height)
                continue;
            uint64_t neighbour = planes->keys[(size_t)qy * view->width + (size_t)qx];
            if (neighbour == REF_EMPTY_KEY)
                continue;
            // The same surface: within a layer distance, or no steeper than four pixels' width a pixel; from where the
            // pixel's own steps lead, give or take half as far.
            double along = steps[0] * dx, up = steps[1] * dy, far = fabs(along) + fabs(up);
            double apart = fabs(ref_key_z(neighbour) - z - along - up);
            double most = fmax(fmax(m, 4.0 * ref_footprint(view, z) * fmax(abs(dx), abs(dy))), (double)PT_STEEP * far);
            double error = most * TOL_WINDOW + TOL_WINDOW * (far + fabs(ref_key_z(neighbour) - z)) * (far > 0.0);
            struct ref_range threshold = {most - error, most + error};
            enum ref_truth taken = ref_less_equal(ref_exactly(apart), threshold);
            if (taken == REF_UNSURE)
                return REF_UNSURE;
            if (taken == REF_NO)
                continue;
            double f = linear(view, ref_key_z(neighbour));
            out->dx[out->count] = dx;
            out->dy[out->count] = dy;
            out->f[out->count++] = f - out->centre;
            out->greatest = fmax(out->greatest, fabs(f));
        }
    }
    return REF_YES;
}

// f = a dx + b dy + c, and how far float32 may be off.
struct plane {
    double a, b, c;
    double error_a, error_b, error_c;
};

// 0 when the samples do not span a plane; offsets are integers, so that this is exact.
static int fit(const struct samples *s, struct plane *plane)
{
    int64_t n = s->count, sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0;
    for (int i = 0; i < s->count; i++) {
        sx += s->dx[i];
        sy += s->dy[i];
        sxx += s->dx[i] * s->dx[i];
        sxy += s->dx[i] * s->dy[i];
        syy += s->dy[i] * s->dy[i];
    }
    int64_t det = n * (sxx * syy - sxy * sxy) - sx * (sx * syy - sxy * sy) + sy * (sx * sxy - sxx * sy);
    if (s->count < 3 || det == 0)
        return 0;
    // The inverse of the symmetric 3 x 3 system, by cofactors.
    double aa = (double)(n * syy - sy * sy), ab = (double)(sx * sy - n * sxy), ac = (double)(sxy * sy - sx * syy);
    double bb = (double)(n * sxx - sx * sx), bc = (double)(sx * sxy - sxx * sy), cc = (double)(sxx * syy - sxy * sxy);
    double d = (double)det, noise = TOL_FIT * s->greatest, xf = 0.0, yf = 0.0, abs_f = 0.0;
    *plane = (struct plane){.c = s->centre, .error_c = noise};
    for (int i = 0; i < s->count; i++) {
        double wa = (aa * s->dx[i] + ab * s->dy[i] + ac) / d;
        double wb = (ab * s->dx[i] + bb * s->dy[i] + bc) / d;
        double wc = (ac * s->dx[i] + bc * s->dy[i] + cc) / d;
        plane->a += wa * s->f[i];
        plane->b += wb * s->f[i];
        plane->c += wc * s->f[i];
        plane->error_a += fabs(wa) * noise;
        plane->error_b += fabs(wb) * noise;
        plane->error_c += fabs(wc) * noise;
        xf += fabs(s->dx[i] * s->f[i]);
        yf += fabs(s->dy[i] * s->f[i]);
        abs_f += fabs(s->f[i]);
    }
    // Normal equations about the mean: what cancels in them, in a window that is nearly a line, is lost.
    double size = n * d, lost_x = n * xf + fabs((double)sx) * abs_f, lost_y = n * yf + fabs((double)sy) * abs_f;
    double narrow = TOL_SOLVE * (aa * bb + ab * ab) / size;
    plane->error_a += TOL_SOLVE * (aa * lost_x + fabs(ab) * lost_y) / size + narrow * fabs(plane->a);
    plane->error_b += TOL_SOLVE * (bb * lost_y + fabs(ab) * lost_x) / size + narrow * fabs(plane->b);
    plane->error_c += (plane->error_a * fabs((double)sx) + plane->error_b * fabs((double)sy)) / n;
    return 1;
}

struct ref_normal ref_normals(const struct normals_args *args, const struct ref_planes *planes, int x, int y)
{
    const struct view_args *view = &args->view;
    struct samples samples;
    struct plane plane;
    struct ref_normal out = {.decided = gather(args, planes, x, y, &samples)};
    if (out.decided == REF_UNSURE || !fit(&samples, &plane))
        return out;
    struct ref_ray ray = ref_ray(view, x, y);
    double slope_u = plane.a / view->ray_xs, slope_v = plane.b / view->ray_ys;
    double error_u = plane.error_a / fabs((double)view->ray_xs), error_v = plane.error_b / fabs((double)view->ray_ys);
    struct ref_vec n, error = {error_u, error_v, 0.0};
    if (view->perspective) { // 1/z = (n.r) / const at every ray r = (u, v, -1)
        n = ref_vec(slope_u, slope_v, slope_u * ray.u + slope_v * ray.v - plane.c);
        error.z = plane.error_c + error_u * fabs(ray.u) + error_v * fabs(ray.v) +
                  TOL_FIT * (fabs(slope_u * ray.u) + fabs(slope_v * ray.v));
    } else { // z = (n.x u + n.y v - const) / n.z
        n = ref_vec(slope_u, slope_v, 1.0);
    }
    double length = ref_length(n);
    out.error = TOL_NORMAL + ref_length(error) / length;
    out.n = ref_scale(n, 1.0 / length);
    double cosine = ref_dot(out.n, ref_viewer(view, ray));
    if (cosine < 0.0)
        out.n = ref_scale(out.n, -1.0);
    out.either_side = fabs(cosine) <= 2.0 * out.error;
    return out;
}
