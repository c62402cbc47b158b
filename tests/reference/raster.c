// SPDX-License-Identifier: GPL-3.0-or-later
// Which triangle a pixel's centre lies on, and how deep, whatever float32 and the rounding of corners to 1/256 pixel make of it.
#include "reference.h"
#include "tolerances.h"
#include "shared/meshes.h"

#include <math.h>

// A corner (X, Y, w) whose screen position is (X / w, Y / w), its z, and what float32 adds to them.
struct corner {
    double x, y, w, z, error;
};

static int corners(const struct view_args *view, const struct mesh_args *mesh, const float *vertices, const uint32_t *indices,
                   uint32_t triangle, struct corner out[3])
{
    for (int i = 0; i < 3; i++) {
        const float *p = vertices + (size_t)mesh->stride * indices[3 * (size_t)triangle + (size_t)i];
        double at[3], worst = 0.0;
        for (int k = 0; k < 3; k++) {
            const float *r = mesh->row + 3 * k;
            double terms = fabs((double)mesh->lo[k]) + fabs((double)mesh->hi[k]);
            at[k] = (double)mesh->lo[k] + (double)mesh->hi[k];
            for (int c = 0; c < 3; c++) {
                at[k] += (double)r[c] * p[c];
                terms += fabs((double)r[c] * p[c]);
            }
            if (!(fabs(at[k]) <= (double)PT_MESH_FARTHEST))
                return 0;
            worst = fmax(worst, TOL_PROJECT * terms);
        }
        out[i] = (struct corner){at[0], at[1], view->perspective ? at[2] : 1.0, at[2], worst};
    }
    return 1;
}

// Twice the area of the triangle that the centre (cx, cy) makes with two corners, times their w.
static double area_of(const struct corner *a, const struct corner *b, double cx, double cy)
{
    return (a->x - cx * a->w) * (b->y - cy * b->w) - (b->x - cx * b->w) * (a->y - cy * a->w);
}

// How far the centre (cx, cy) lies inside of the edge from a to b, in pixels; turned: clockwise triangles.
static double inside(const struct corner *a, const struct corner *b, double cx, double cy, double turned)
{
    double line[2] = {a->y * b->w - a->w * b->y, a->w * b->x - a->x * b->w};
    double length = sqrt(line[0] * line[0] + line[1] * line[1]);
    return length > 0.0 ? turned * area_of(a, b, cx, cy) / length : INFINITY;
}

struct ref_hit ref_raster(const struct view_args *view, const struct mesh_args *mesh, const float *vertices,
                          const uint32_t *indices, uint32_t triangle, int x, int y)
{
    struct ref_hit hit = {0};
    struct corner c[3];
    double cx = view->origin_x + x + 0.5, cy = view->origin_y + y + 0.5;
    if (!corners(view, mesh, vertices, indices, triangle, c))
        return hit;
    // 1. margins: corners move by up to 1/512 pixel a side. Where an edge is cut, the new corner's x, y and z are rounded at the
    // size of the old ones', beside a z as small as the near plane's; PT_MESH_REACH pixels away float32 is 1/16 pixel.
    double margin = 1.5 / 256.0, z_least = INFINITY, z_most = -INFINITY, widest = 0.0, least_w = INFINITY, far = 0.0;
    for (int i = 0; i < 3; i++) {
        double w = fmax(c[i].w, view->perspective ? (double)view->z_near : 1.0);
        far = fmax(far, hypot(c[i].x / w, c[i].y / w));
        widest = fmax(widest, fabs(c[i].x) + fabs(c[i].y) + (fabs(cx) + fabs(cy)) * fabs(c[i].w));
        least_w = fmin(least_w, w);
        margin = fmax(margin, 1.5 / 256.0 + (far * TOL_SCREEN + 2.0 * c[i].error / w));
        z_least = fmin(z_least, c[i].z);
        z_most = fmax(z_most, c[i].z);
    }
    if (z_least < (double)view->z_near)
        margin += 8.0 * TOL_UNIT * widest / least_w;
    if (far > 0.99 * (double)PT_MESH_REACH)
        margin = fmin(margin, 0.5 + 8.0 * TOL_UNIT * widest / least_w);
    // 2. coverage
    double f[3] = {area_of(&c[1], &c[2], cx, cy), area_of(&c[2], &c[0], cx, cy), area_of(&c[0], &c[1], cx, cy)};
    double sum = f[0] + f[1] + f[2], turned = sum < 0.0 ? -1.0 : 1.0, least = INFINITY;
    least = fmin(inside(&c[1], &c[2], cx, cy, turned),
                 fmin(inside(&c[2], &c[0], cx, cy, turned), inside(&c[0], &c[1], cx, cy, turned)));
    double volume = f[0] * c[0].z + f[1] * c[1].z + f[2] * c[2].z; // perspective: the same at every centre
    double z = sum != 0.0 ? volume / sum : z_least;
    hit.z = (struct ref_range){z_least, z_most}; // of thin triangles no more is known
    if (isinf(least))                            // a single place
        return hit;
    hit.definite = least > margin;
    hit.possible = !(least < -margin);
    if (!hit.possible)
        return hit;
    // 3. depth: moved by as much as the corners move, along the plane's slope
    double value = view->perspective ? 1.0 / z : z, slope[2] = {0.0, 0.0};
    for (int k = 0; k < 2; k++) {
        double sx = cx + (k == 0), sy = cy + (k == 1);
        double g[3] = {area_of(&c[1], &c[2], sx, sy), area_of(&c[2], &c[0], sx, sy), area_of(&c[0], &c[1], sx, sy)};
        double other = (g[0] + g[1] + g[2]) / (g[0] * c[0].z + g[1] * c[1].z + g[2] * c[2].z);
        slope[k] = (view->perspective ? other : 1.0 / other) - value;
    }
    double size = 0.0, steep = sqrt(slope[0] * slope[0] + slope[1] * slope[1]);
    for (int i = 0; i < 3; i++)
        size = fmax(size, fmin(hypot(c[i].x / c[i].w - cx, c[i].y / c[i].w - cy), 2.0 * (double)PT_MESH_REACH));
    double thin = 2.0 * size > 0.0 ? fabs(sum) / (2.0 * size) : 0.0; // about the height, in pixels (times w^3)
    for (int i = 0; i < 3 && view->perspective; i++)
        thin /= fabs(c[i].w);
    double slack = 16.0 * TOL_UNIT * fabs(z_most);
    for (int i = 0; i < 3; i++)
        slack = fmax(slack, 2.0 * c[i].error);
    if (isfinite(steep) && thin > 32.0 * margin) {
        double error = 2.0 * margin * steep + 16.0 * TOL_UNIT * (fabs(value) + steep * 4.0 * size * fmax(1.0, size / thin));
        struct ref_range moved = {value - error, value + error};
        if (view->perspective) // beyond 1/z = 0 everything is open
            moved = moved.lo > 0.0   ? (struct ref_range){1.0 / moved.hi, 1.0 / moved.lo}
                    : moved.hi < 0.0 ? (struct ref_range){-INFINITY, -1.0}
                                     : (struct ref_range){z_least, z_most};
        hit.z.lo = fmin(fmax(moved.lo, hit.z.lo), hit.z.hi);
        hit.z.hi = fmin(moved.hi, hit.z.hi);
    }
    hit.z.lo -= slack;
    hit.z.hi += slack;
    // 4. near and far: what is cut off ends at the near plane
    if (hit.z.lo < (double)view->z_near || hit.z.hi > (double)view->z_far)
        hit.definite = 0;
    if (hit.z.hi < (double)view->z_near || hit.z.lo > (double)view->z_far)
        hit.possible = hit.definite = 0;
    hit.z.lo = fmax(hit.z.lo, (double)view->z_near);
    return hit;
}
