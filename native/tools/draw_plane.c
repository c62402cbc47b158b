// SPDX-License-Identifier: GPL-3.0-or-later
// Planes of `patina draw`: from its options to a place in the world.
#include "draw.h"
#include "base/elementary.h"
#include "base/vector.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846
#define AIR 0.02 // beside the clouds, in their width

static void set(double v[3], double x, double y, double z)
{
    v[0] = x;
    v[1] = y;
    v[2] = z;
}

// Directions, and a point on the plane. Elevations face where `patina render --camera AZIMUTH` stands.
static void set_frame(const struct draw_options *options, const double middle[3], patina_drawing_desc *desc)
{
    const double *n = options->numbers;
    set(desc->up, 0, 0, 1);
    if (options->plane == DRAW_SECTION) {
        const double length = sqrt((n[2] - n[0]) * (n[2] - n[0]) + (n[3] - n[1]) * (n[3] - n[1]));
        set(desc->right, (n[2] - n[0]) / length, (n[3] - n[1]) / length, 0);
        set(desc->origin, 0.5 * (n[0] + n[2]), 0.5 * (n[1] + n[3]), middle[2]);
    } else if (options->plane == DRAW_ELEVATION) {
        const double azimuth = n[0] * PI / 180, c = pt_cos(azimuth), s = pt_sin(azimuth),
                     away = options->has_distance ? n[1] : 0;
        set(desc->right, c, s, 0);
        set(desc->origin, middle[0] + away * s, middle[1] - away * c, middle[2]);
    } else if (options->plane == DRAW_PLAN) {
        set(desc->right, 1, 0, 0);
        set(desc->up, 0, 1, 0);
        set(desc->origin, middle[0], middle[1], n[0]);
    } else {
        memcpy(desc->origin, n, sizeof desc->origin);
        memcpy(desc->right, n + 3, sizeof desc->right);
        memcpy(desc->up, n + 6, sizeof desc->up);
    }
}

int draw_axes(const patina_drawing_desc *desc, double axes[3][3])
{
    const double a = sqrt(pt_dot(desc->right, desc->right)), b = sqrt(pt_dot(desc->up, desc->up));
    if (!(a > 0) || !(b > 0))
        return -1;
    double r[3], u[3];
    for (int k = 0; k < 3; k++) {
        r[k] = desc->right[k] / a;
        u[k] = desc->up[k] / b;
    }
    set(axes[2], r[1] * u[2] - r[2] * u[1], r[2] * u[0] - r[0] * u[2], r[0] * u[1] - r[1] * u[0]);
    const double length = sqrt(pt_dot(axes[2], axes[2]));
    if (!(length > 1e-6))
        return -1;
    for (int k = 0; k < 3; k++) {
        axes[2][k] /= length;
        axes[0][k] = r[k];
    }
    const double *n = axes[2];
    set(axes[1], n[1] * r[2] - n[2] * r[1], n[2] * r[0] - n[0] * r[2], n[0] * r[1] - n[1] * r[0]);
    return 0;
}

// The range of the box along an axis, from a place.
static void range_along(const double axis[3], const double from[3], const double box_min[3], const double box_max[3],
                        double *low, double *high)
{
    *low = *high = 0;
    for (int k = 0; k < 3; k++) {
        const double a = axis[k] * (box_min[k] - from[k]), b = axis[k] * (box_max[k] - from[k]);
        *low += fmin(a, b);
        *high += fmax(a, b);
    }
}

// The zero of the plane's own coordinates: where the options say that the plane begins. Heights are those of the world.
static void set_zero(const struct draw_options *options, const double axes[3][3], const patina_drawing_desc *desc,
                     double zero[3])
{
    memcpy(zero, desc->origin, 3 * sizeof *zero);
    if (options->plane == DRAW_SECTION)
        set(zero, options->numbers[0], options->numbers[1], zero[2]);
    for (int i = 0; i < 2; i++) {
        const int whole = i ? axes[1][2] > 1 - 1e-12 : options->plane == DRAW_ELEVATION;
        const double away = whole ? pt_dot(axes[i], zero) : 0;
        for (int k = 0; k < 3; k++)
            zero[k] -= away * axes[i][k];
    }
}

int draw_describe(const struct draw_options *options, const double box_min[3], const double box_max[3],
                  patina_drawing_desc *desc, double zero[3])
{
    double middle[3], axes[3][3], low[3], high[3], most = 0;
    *desc = (patina_drawing_desc){.struct_size = sizeof *desc, .scale = options->scale, .epsg = options->epsg};
    for (int k = 0; k < 3; k++)
        middle[k] = 0.5 * (box_min[k] + box_max[k]);
    set_frame(options, middle, desc);
    if (draw_axes(desc, axes))
        return tool_misuse("--plane frame: right and up must not be zero or parallel");
    for (int i = 0; i < 3; i++) {
        range_along(axes[i], desc->origin, box_min, box_max, &low[i], &high[i]);
        most = fmax(most, high[i] - low[i]);
    }
    const double least = fmax(1e-3 * most, 1e-6);                     // of what is flat seen from there
    if (options->plane == DRAW_ELEVATION && !options->has_distance) { // before all there is
        const double away = high[2] + least;
        for (int k = 0; k < 3; k++)
            desc->origin[k] += away * axes[2][k];
        low[2] -= away;
        high[2] -= away;
    }
    set_zero(options, (const double(*)[3])axes, desc, zero);
    for (int i = 0; i < 2; i++) {
        const int given = options->extent[i] > 0;
        desc->extent[i] = given ? options->extent[i] : fmax((1 + AIR) * (high[i] - low[i]), least);
        // The plane's own middle, but for what the options do not say.
        const double shift = given && (options->plane == DRAW_FRAME || i == 0) ? 0 : 0.5 * (low[i] + high[i]);
        for (int k = 0; k < 3; k++)
            desc->origin[k] += shift * axes[i][k];
    }
    const double before = options->contours > 0 ? fmax(high[2], 0) + least : 0; // contours are of all the ground
    desc->front = options->has_depth ? options->depth[0] : before;
    desc->back = options->has_depth ? options->depth[1] : fmax(-low[2], 0) + least;
    return TOOL_OK;
}
