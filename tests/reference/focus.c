// SPDX-License-Identifier: GPL-3.0-or-later
// Depth of field: every pixel is spread over its circle of confusion; what lies before a pixel covers it by as much as reaches it,
// what lies behind mixes with it no wider than its own circle.
#include "reference.h"
#include "tolerances.h"
#include "shared/picture.h"

#include <math.h>

static double circle_of(const struct focus_args *args, uint64_t key, double *error)
{
    double z = ref_key_z(key), radius = INFINITY, size = 0.0;
    if (key != REF_EMPTY_KEY && args->view.perspective) {
        radius = fabs(1.0 - args->distance / z) * args->scale;
        size = (1.0 + args->distance / z) * args->scale;
    } else if (key != REF_EMPTY_KEY) {
        radius = fabs(z - args->distance) * args->scale;
        size = radius;
    } else if (args->view.perspective) {
        radius = args->scale;
    }
    *error = radius < args->most ? 8.0 * TOL_UNIT * size : 8.0 * TOL_UNIT * fmin(size, 2.0 * (double)args->most);
    return fmin(radius, args->most);
}

static double density_of(double circle) { return 1.0 / fmax(3.14159265358979 * circle * circle, 1.0); }

struct ref_color ref_focus(const struct focus_args *args, const struct ref_planes *planes, int x, int y)
{
    const struct view_args *view = &args->view;
    const int px = x + (int)args->crop_x, py = y + (int)args->crop_y, reach = (int)args->reach;
    const uint64_t own = planes->keys[(size_t)py * view->width + (size_t)px];
    double near[5] = {0}, far[5] = {0}, near_error = 0.0, far_error = 0.0, brightest = 0.0, own_error;
    double circle = circle_of(args, own, &own_error);
    struct ref_color out = {0};
    for (int dy = -reach; dy <= reach; dy++)
        for (int dx = -reach; dx <= reach; dx++) {
            int qx = px + dx, qy = py + dy;
            if (qx < 0 || qy < 0 || qx >= (int)view->width || qy >= (int)view->height)
                continue;
            size_t q = (size_t)qy * view->width + (size_t)qx;
            int empty = planes->keys[q] == REF_EMPTY_KEY, before = ref_key_z(planes->keys[q]) < ref_key_z(own);
            double error, wide = circle_of(args, planes->keys[q], &error);
            if (!before) {
                wide = fmin(wide, circle);
                error = fmax(error, own_error);
            }
            double cover = fmin(fmax(wide - sqrt((double)(dx * dx + dy * dy)) + 0.5, 0.0), 1.0);
            double weight = cover * density_of(wide);
            if (cover > 0.0 || wide + error + 0.5 > sqrt((double)(dx * dx + dy * dy)))
                *(before ? &near_error : &far_error) += (error + 8.0 * TOL_UNIT * (wide + 1.0)) * density_of(wide) +
                                                        2.0 * error / fmax(wide, 0.5) * weight;
            for (int c = 0; c < 4 && !empty && weight > 0.0; c++) {
                double term = weight * planes->color[4 * q + (size_t)c];
                (before ? near : far)[c] += term;
                brightest = fmax(brightest, fabs((double)planes->color[4 * q + (size_t)c]));
            }
            (before ? near : far)[4] += weight;
        }
    double hidden = fmin(near[4], 1.0), alpha = near[3] / fmax(near[4], 1.0) + far[3] / far[4] * (1.0 - hidden);
    for (int c = 0; c < 4; c++) {
        double own_color = near[c] / fmax(near[4], 1.0) + far[c] / far[4] * (1.0 - hidden);
        out.color[c] = (c == 3 ? fmin(own_color, 1.0) : own_color) + (1.0 - fmin(alpha, 1.0)) * args->background[c];
        out.error[c] = (fmax(brightest, 1.0) + fabs((double)args->background[c])) *
                       (4.0 * near_error + 2.0 * far_error / far[4] + TOL_COLOR);
    }
    return out;
}
