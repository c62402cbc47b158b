// SPDX-License-Identifier: GPL-3.0-or-later
// Hatching: planes across an axis cut the surface, as far apart as the spacing on screen asks for, in powers of two of the
// world's unit; the darker the wider.
#include "reference.h"
#include "tolerances.h"
#include "shared/effects.h"

#include <math.h>

struct pixel {
    struct ref_vec n, ray, place;
    double xs, ys;
};

// Covered share of the pixel, and by how much float32 may be off.
static double stroke(const struct hatch_args *args, int level, const struct pixel *p, double wide, double wide_error,
                     double *error, int *unsure)
{
    struct ref_vec axis = ref_vec_of(args->axes + 3 * level);
    double offset = args->offsets[level], along = ref_dot(axis, p->place) + offset, facing = ref_dot(p->n, p->ray);
    double along_error = 8.0 * TOL_UNIT * (ref_length(p->place) + fabs(offset));
    double least = fmax(facing * facing, (double)PT_HATCH_GRAZING), turn = ref_dot(axis, p->ray) * facing / least;
    double gx = p->xs * (axis.x - turn * p->n.x), gy = p->ys * (axis.y - turn * p->n.y);
    double rate = sqrt(fmax(gx * gx + gy * gy, 1e-30));
    // each term of the rate is rounded a few times; where they cancel, their sum is off by more
    double rate_error = 24.0 * TOL_UNIT * (fabs(p->xs) + fabs(p->ys)) * (1.0 + fabs(turn)) * (1.0 + ref_length(p->ray)) / rate;
    double wanted = rate * args->spacing, period = exp2(floor(log2(wanted))), fade = wanted / period - 1.0;
    double fade_error = 2.0 * (rate_error + 2.0 * TOL_UNIT);
    double at = along / period, line = floor(at + 0.5), off = fabs(at - line) * period / rate;
    double odd = line - 2.0 * floor(line / 2.0), reach = 0.5 * wide * (1.0 - odd * fade);
    double off_error = along_error / rate + off * (rate_error + 8.0 * TOL_UNIT);
    double reach_error = 0.5 * wide_error + 0.5 * wide * (odd * fade_error + 4.0 * TOL_UNIT);
    if (0.5 * wide + 0.5 > off - off_error) // strokes meet: float32 may take the other one
        *unsure |= fabs(at - floor(at) - 0.5) < 2.0 * along_error / period + 1e-6;
    *unsure |= fade < fade_error || 1.0 - fade < fade_error || rate_error > 0.05;
    *error = 2.0 * (off_error + 3.0 * reach_error) + 4.0 * TOL_UNIT;
    return fmin(fmax(reach - off + 0.5, 0.0), 1.0) * fmin(2.0 * reach, 1.0);
}

struct ref_color ref_hatch(const struct hatch_args *args, const struct ref_planes *planes, int x, int y)
{
    const struct view_args *view = &args->view;
    size_t pixel = (size_t)y * view->width + (size_t)x;
    double z = ref_key_z(planes->keys[pixel]), bare = 1.0, bare_error = 0.0;
    struct ref_ray ray = ref_ray(view, x, y);
    struct pixel p = {.n = ref_vec_of(planes->shading + 4 * pixel), .ray = ref_vec(0.0, 0.0, -1.0)};
    struct ref_color out = {0};
    p.place = ref_vec(ray.u, ray.v, -(z + args->eye_z));
    p.xs = view->ray_xs;
    p.ys = view->ray_ys;
    if (view->perspective) {
        p.ray = ref_vec(ray.u, ray.v, -1.0);
        p.place = ref_vec(ray.u * z, ray.v * z, -z);
        p.xs *= z;
        p.ys *= z;
    }
    const float *c = planes->color + 4 * pixel;
    double alpha = c[3], brightness = (0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]) / fmax(alpha, 1e-6);
    double tone = brightness / sqrt(fmax(brightness, 1e-6));
    for (int level = 0; level < (int)args->levels; level++) {
        double dark = fmin(fmax(1.0 - tone * args->tones[level], 0.0), 1.0), error;
        double dark_error = 24.0 * TOL_UNIT * (1.0 + tone * args->tones[level]);
        double covered = stroke(args, level, &p, args->width * dark, args->width * dark_error, &error, &out.unsure);
        bare *= 1.0 - covered;
        bare_error += error;
    }
    double ink = args->opacity * (1.0 - bare);
    for (int k = 0; k < 3; k++) {
        double under = c[k] * (1.0 - args->ground) + alpha * args->ground, over = args->color[k] * alpha;
        out.color[k] = under * (1.0 - ink) + over * ink;
        out.error[k] = (fabs(under) + fabs(over)) * (args->opacity * bare_error + 8.0 * TOL_UNIT);
    }
    out.color[3] = alpha;
    return out;
}
