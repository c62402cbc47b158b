// SPDX-License-Identifier: GPL-3.0-or-later
#include "plane.h"
#include "base/vector.h"

#include <math.h>

static int normalize(const double v[3], double out[3])
{
    const double most = fmax(fabs(v[0]), fmax(fabs(v[1]), fabs(v[2])));
    if (!isfinite(v[0]) || !isfinite(v[1]) || !isfinite(v[2]) || !(most > 0.0))
        return -1;
    const double scaled[3] = {v[0] / most, v[1] / most, v[2] / most}, length = sqrt(pt_dot(scaled, scaled));
    for (int k = 0; k < 3; k++)
        out[k] = scaled[k] / length;
    return 0;
}

int pt_draw_plane_frame(struct pt_draw_plane *plane, const double origin[3], const double right[3], const double up[3])
{
    double r[3], u[3], n[3];
    if (!isfinite(origin[0]) || !isfinite(origin[1]) || !isfinite(origin[2]) || normalize(right, r) || normalize(up, u))
        return -1;
    pt_cross(r, u, n);
    if (!(pt_dot(n, n) > 1e-12) || normalize(n, plane->normal))
        return -1;
    for (int k = 0; k < 3; k++) {
        plane->origin[k] = origin[k];
        plane->right[k] = r[k];
    }
    pt_cross(plane->normal, plane->right, plane->up);
    return 0;
}

#define ALIKE 1e-4 // of the squared scale: axes of a float32 matrix differ by less

int pt_draw_plane_inside(const struct pt_draw_plane *plane, const double place[16], struct pt_draw_plane *inside, double *scale)
{
    double columns[3][3], away[3], square = 0.0;
    for (int i = 0; i < 3; i++) {
        away[i] = plane->origin[i] - place[4 * i + 3];
        if (!isfinite(away[i]))
            return -1;
        for (int k = 0; k < 3; k++) {
            columns[k][i] = place[4 * i + k];
            square += columns[k][i] * columns[k][i] / 3.0;
        }
    }
    if (!isfinite(square) || !(square > 0.0))
        return -1;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k <= i; k++)
            if (fabs(pt_dot(columns[i], columns[k]) - (i == k ? square : 0.0)) > ALIKE * square)
                return -1;
    *scale = sqrt(square);
    *inside = (struct pt_draw_plane){.half = {plane->half[0] / *scale, plane->half[1] / *scale},
                                     .front = plane->front / *scale,
                                     .back = plane->back / *scale};
    double side[3];
    for (int k = 0; k < 3; k++) { // directions by the transposed matrix, the origin by the inverse one: distances are exact
        inside->right[k] = pt_dot(columns[k], plane->right) / *scale;
        inside->up[k] = pt_dot(columns[k], plane->up) / *scale;
        inside->normal[k] = pt_dot(columns[k], plane->normal) / *scale;
        pt_cross(columns[(k + 1) % 3], columns[(k + 2) % 3], side);
        inside->origin[k] = pt_dot(side, away) / pt_dot(side, columns[k]);
    }
    return 0;
}

void pt_draw_plane_range(const struct pt_draw_plane *plane, const double box_min[3], const double box_max[3], double low[3],
                         double high[3])
{
    const double *const axes[3] = {plane->right, plane->up, plane->normal};
    for (int i = 0; i < 3; i++) {
        low[i] = high[i] = 0.0;
        for (int k = 0; k < 3; k++) {
            const double a = axes[i][k] * (box_min[k] - plane->origin[k]), b = axes[i][k] * (box_max[k] - plane->origin[k]);
            low[i] += fmin(a, b);
            high[i] += fmax(a, b);
        }
    }
}

void pt_draw_plane_world(const struct pt_draw_plane *plane, const double place[2], double depth, double world[3])
{
    for (int k = 0; k < 3; k++)
        world[k] = plane->origin[k] + place[0] * plane->right[k] + place[1] * plane->up[k] + depth * plane->normal[k];
}
