// SPDX-License-Identifier: GPL-3.0-or-later
// Where lights are: their axes, and the points that samples of them and shading are gathered from.
#include "light_points.h"
#include "base/elementary.h"

#include <math.h>

#define PI 3.14159265358979323846

// Rows x, y, z with z against `direction` (unit) and x along `side` as far as it goes.
void pt_light_frame(const double direction[3], const double side[3], double axes[9])
{
    double *x = axes, *y = axes + 3, *z = axes + 6, along, length;
    const double poles[3][3] = {{side[0], side[1], side[2]}, {0, 0, 1}, {1, 0, 0}};
    for (int k = 0; k < 3; k++)
        z[k] = -direction[k];
    for (int pole = 0; pole < 3; pole++) {
        const double *p = poles[pole];
        along = pt_dot(p, z);
        for (int k = 0; k < 3; k++) // of the poles: across, so that y goes up
            x[k] = pole ? p[(k + 1) % 3] * z[(k + 2) % 3] - p[(k + 2) % 3] * z[(k + 1) % 3] : p[k] - along * z[k];
        length = sqrt(pt_dot(x, x));
        if (length > 1e-3 * sqrt(pt_dot(p, p)) && isfinite(length))
            break;
    }
    for (int k = 0; k < 3; k++)
        x[k] /= length;
    for (int k = 0; k < 3; k++)
        y[k] = z[(k + 1) % 3] * x[(k + 2) % 3] - z[(k + 2) % 3] * x[(k + 1) % 3];
}

// Two numbers in [0, 1): the additive recurrence of the plastic number, even in every prefix; the first is the middle.
void pt_light_sample(uint32_t sample, double p[2])
{
    static const double steps[2] = {0.75487766624669276, 0.56984029099805327};
    for (int k = 0; k < 2; k++) {
        double x = 0.5 + sample * steps[k];
        p[k] = x - floor(x);
    }
}

// The square onto the disc, areas kept, the middle onto the middle.
void pt_light_disc(double p[2])
{
    double a = 2.0 * p[0] - 1.0, b = 2.0 * p[1] - 1.0;
    double r = fabs(a) > fabs(b) ? a : b;
    double turn = fabs(a) > fabs(b) ? PI / 4.0 * (b / a) : b != 0.0 ? PI / 2.0 - PI / 4.0 * (a / b) : 0.0;
    p[0] = r * pt_cos(turn);
    p[1] = r * pt_sin(turn);
}

void pt_area_point(const patina_light_desc *light, double p[2])
{
    if (light->shape == PATINA_AREA_ELLIPSE)
        pt_light_disc(p);
    else
        for (int k = 0; k < 2; k++)
            p[k] = 2.0 * p[k] - 1.0;
    for (int k = 0; k < 2; k++)
        p[k] *= 0.5 * (double)light->size[k];
}

void pt_area_points(const patina_light_desc *light, double points[3 * PT_AREA_POINTS])
{
    double axes[9];
    pt_light_frame(light->direction, light->side, axes);
    for (int i = 0; i < PT_AREA_POINTS; i++) { // the middles of 4 x 4 fields
        double p[2] = {(i % 4 + 0.5) / 4.0, (i / 4 + 0.5) / 4.0};
        pt_area_point(light, p);
        for (int k = 0; k < 3; k++)
            points[3 * i + k] = light->position[k] + p[0] * axes[k] + p[1] * axes[3 + k];
    }
}
