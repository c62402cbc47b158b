// SPDX-License-Identifier: GPL-3.0-or-later
// SPEC 5, solid: which pixels a flat disc covers, by the ray through the pixel's centre and the disc's plane.
#include "reference.h"
#include "tolerances.h"
#include "shared/discs.h"
#include "shared/words.h"

#include <math.h>

static double middle(struct ref_range r) { return 0.5 * (r.lo + r.hi); }
static double half_width(struct ref_range r) { return 0.5 * (r.hi - r.lo); }

// In view space, rays (u, v, -1); orthographic: places (u, v), looking along (0, 0, -1).
static struct ref_vec ray_of(const struct view_args *view, double x, double y)
{
    struct ref_vec ray = {view->ray_x0 + (double)view->ray_xs * x, view->ray_y0 + (double)view->ray_ys * y, -1.0};
    if (!view->perspective)
        ray.x = ray.y = 0.0;
    return ray;
}

static int is_shaped(const struct disc_args *args) { return args->has_radii == PT_RADII_SHAPES && !(args->radius > 0.0f); }

// The major half axis, before it is cut off.
static double radius_of(const struct disc_args *args, const void *radii, uint32_t id, uint32_t word)
{
    if (args->radius > 0.0f)
        return args->radius;
    if (is_shaped(args)) {
        const uint32_t shape = ((const uint32_t *)radii)[id];
        const double scale = (shape >> PT_SHAPE_KIND_SHIFT & 7u) == PT_KIND_SURFACE ? (double)args->surface_scale : 1.0;
        return scale * (double)args->instance.spacing[shape & PT_SHAPE_CLASS_BITS];
    }
    if (args->has_radii)
        return fmin((double)((const float *)radii)[id] * args->radius_scale, PT_DISC_MOST);
    return args->instance.spacing[word >> PT_SPACING_SHIFT] * (double)PT_DISC_SPACINGS;
}

// n: of the object, unit.
static void set_axes(const struct disc_args *args, uint32_t shape, double radius, struct ref_vec n, struct ref_disc *disc)
{
    const double s = n.z >= (double)PT_SHAPE_UP ? 1.0 : -1.0, q = -1.0 / (s + n.z), b = n.x * n.y * q;
    const struct ref_vec t1 = {1.0 + s * n.x * n.x * q, s * b, -s * n.x}, t2 = {b, s + n.y * n.y * q, -n.y};
    const double angle = (shape >> PT_SHAPE_ANGLE_SHIFT & 63u) * 3.14159265358979323846 / 64.0;
    const double minor = radius * pow(2.0, -0.25 * (shape >> PT_SHAPE_RATIO_SHIFT & 15u));
    const float *m = args->instance.normal_matrix;
    struct ref_vec object[2] = {ref_add(ref_scale(t1, cos(angle)), ref_scale(t2, sin(angle))),
                                ref_add(ref_scale(t2, cos(angle)), ref_scale(t1, -sin(angle)))};
    disc->shaped = 1;
    for (int k = 0; k < 2; k++) {
        const struct ref_vec t = object[k];
        // minor is cut off where the major is
        const double share = k ? disc->radius / (args->radius_most > 0.0f ? fmin(minor, args->radius_most) : minor) : 1.0;
        disc->axes[k] = ref_scale(ref_vec(m[0] * t.x + m[1] * t.y + m[2] * t.z, m[3] * t.x + m[4] * t.y + m[5] * t.z,
                                          m[6] * t.x + m[7] * t.y + m[8] * t.z),
                                  args->instance.axis_scale * share);
    }
}

struct ref_disc ref_disc(const struct view_args *view, const struct disc_args *args, const struct chunk_view *chunk,
                         const float *positions, const uint32_t *surfels, const void *radii, uint32_t slot)
{
    const float *base = positions + 3 * (size_t)chunk->first;
    const double p[3] = {base[slot], base[chunk->padded + slot], base[2 * (size_t)chunk->padded + slot]};
    const uint32_t id = chunk->first + slot, word = surfels[id];
    struct ref_disc disc = {.id = chunk->id_base + id, .place = ref_place(view, chunk, positions, slot), .n = {0, 0, 1}};
    disc.has_normals = args->instance.has_normals != 0;
    const struct ref_place *at = &disc.place;
    if (!at->known || at->z.hi < view->z_near || at->z.lo > view->z_far || fabs(middle(at->x)) > PT_DISC_FAR ||
        fabs(middle(at->y)) > PT_DISC_FAR)
        return disc;
    enum ref_truth culled = ref_culled(chunk, p, word);
    disc.possible = culled != REF_YES;
    disc.definite = culled == REF_NO && at->z.lo >= view->z_near && at->z.hi <= view->z_far;
    const double uncut = radius_of(args, radii, id, word);
    disc.radius = args->radius_most > 0.0f ? fmin(uncut, args->radius_most) : uncut;
    if (!(disc.radius >= PT_DISC_LEAST) || disc.radius * PT_DISC_FINE < (view->perspective ? middle(at->z) : 1.0))
        disc.radius = 0.0;
    disc.normal_error = TOL_NORMAL;
    struct ref_vec own;
    if (args->instance.has_normals && ref_decode_normal(word, &own)) {
        const float *m = args->instance.normal_matrix;
        struct ref_vec n = {m[0] * own.x + m[1] * own.y + m[2] * own.z, m[3] * own.x + m[4] * own.y + m[5] * own.z,
                            m[6] * own.x + m[7] * own.y + m[8] * own.z};
        double terms = 0.0;
        for (int i = 0; i < 9; i++)
            terms += fabs((double)m[i]);
        disc.has_normal = ref_length(n) > 0.0;
        if (disc.has_normal) {
            disc.normal_error *= terms / ref_length(n);
            disc.n = ref_unit(n);
            if (is_shaped(args) && disc.radius > 0.0)
                set_axes(args, ((const uint32_t *)radii)[id], uncut, ref_unit(own), &disc);
        }
    }
    struct ref_vec ray = ray_of(view, middle(at->x), middle(at->y));
    double facing = ref_dot(disc.n, ray);
    if (facing > 0.0)
        disc.n = ref_scale(disc.n, -1.0);
    disc.edge_on = fabs(facing) / ref_length(ray) < 1e-3;
    return disc;
}

// Is the point within this pixel?
static enum ref_truth falls_into(const struct view_args *view, const struct ref_disc *disc, int x, int y)
{
    const struct ref_range range[2] = {disc->place.x, disc->place.y};
    const double pixel[2] = {x + (double)view->origin_x, y + (double)view->origin_y};
    enum ref_truth in = REF_YES;
    for (int k = 0; k < 2; k++) {
        if (floor(range[k].hi) < pixel[k] || floor(range[k].lo) > pixel[k])
            return REF_NO;
        if (floor(range[k].lo) != floor(range[k].hi))
            in = REF_UNSURE;
    }
    return in;
}

// The ray against the disc itself.
static struct ref_met meet(const struct view_args *view, const struct ref_disc *disc, int x, int y)
{
    const double z = middle(disc->place.z), px = middle(disc->place.x), py = middle(disc->place.y);
    const struct ref_ray pixel = ref_ray(view, x, y);
    const struct ref_vec own = ray_of(view, px, py);
    const double du = pixel.u - (view->ray_x0 + (double)view->ray_xs * px),
                 dv = pixel.v - (view->ray_y0 + (double)view->ray_ys * py);
    struct ref_vec ray = view->perspective ? ref_vec(pixel.u, pixel.v, -1.0) : own, offset = {du, dv, 0.0};
    double depth, scale = view->perspective ? z : 1.0;
    struct ref_met out = {.covered = REF_NO, .square = {2.0, 2.0}};
    if (!(disc->radius > 0.0))
        return out;
    // a ray that passes the disc's ball meets no disc, however its plane lies
    const struct ref_vec middle_of = ref_add(ref_scale(own, scale),
                                             view->perspective ? ref_vec(0, 0, 0) : ref_vec(-du, -dv, 1.0));
    const double along = view->perspective ? ref_dot(middle_of, ray) / ref_dot(ray, ray) : 0.0;
    if (ref_length(ref_add(middle_of, ref_scale(ray, -along))) > 1.001 * disc->radius + 1e-5 * z)
        return out;
    if (view->perspective) {
        depth = z * ref_dot(disc->n, own) / ref_dot(disc->n, ray);
        offset = ref_add(ref_scale(ray, depth), ref_scale(own, -z));
    } else {
        depth = z + (disc->n.x * du + disc->n.y * dv) / disc->n.z;
        offset.z = z - depth;
    }
    const double cosine = fmin(fabs(ref_dot(disc->n, own)) / ref_length(own), fabs(ref_dot(disc->n, ray)) / ref_length(ray));
    const double distance = ref_length(offset);
    // what float32 may move the middle and the ray by, carried along the plane; the ellipse's own cancellation
    double error = half_width(disc->place.z) +
                   scale * (view->ray_xs * half_width(disc->place.x) + view->ray_ys * half_width(disc->place.y)) +
                   scale * (pixel.error_u + pixel.error_v) + 4.0 * TOL_UNIT * z;
    error = 2.0 * (error + distance * disc->normal_error) / cosine + distance * 32.0 * TOL_UNIT / (cosine * cosine) +
            4.0 * TOL_UNIT * disc->radius;
    if (disc->edge_on || !isfinite(error) || !isfinite(distance)) {
        out.covered = REF_UNSURE;
        out.z = (struct ref_range){z - disc->radius * 1.001, z + disc->radius * 1.001};
        out.square = (struct ref_range){0.0, 1.0};
        return out;
    }
    if (depth <= 0.0 && view->perspective)
        return out;
    out.z = (struct ref_range){depth - error - TOL_QUOTIENT * fabs(depth), depth + error + TOL_QUOTIENT * fabs(depth)};
    double share = distance / disc->radius, share_error = error / disc->radius;
    if (disc->shaped) { // what moves a place moves its share by the axes' lengths; they are rounded as normals are
        const double major = ref_dot(offset, disc->axes[0]), minor = ref_dot(offset, disc->axes[1]);
        const double longest = fmax(ref_length(disc->axes[0]), ref_length(disc->axes[1]));
        share = hypot(major, minor) / disc->radius;
        share_error = longest * (error + 2.0 * TOL_NORMAL * distance / cosine) / disc->radius;
    }
    out.covered = share + share_error <= 1.0 ? REF_YES : share - share_error > 1.0 ? REF_NO : REF_UNSURE;
    double lo = fmax(share - share_error, 0.0), hi = share + share_error;
    out.square = (struct ref_range){lo * lo, hi * hi};
    return out;
}

// Whether the ray passes the disc's ball by far, which spares what decides it to the last bit. Beside the middle in the plane of its depth
// a ray comes no nearer than by the cosine at which it crosses that plane.
static int is_far(const struct view_args *view, const struct ref_disc *disc, int x, int y)
{
    const double z = middle(disc->place.z), scale = view->perspective ? z : 1.0;
    const double beside_x = view->origin_x + x + 0.5, beside_y = view->origin_y + y + 0.5;
    const double du = scale * view->ray_xs * (beside_x - middle(disc->place.x)),
                 dv = scale * view->ray_ys * (beside_y - middle(disc->place.y));
    const struct ref_vec ray = ray_of(view, beside_x, beside_y);
    const double reach = 1.01 * disc->radius + 1e-4 * z;
    return !view->level && z > 0.0 && du * du + dv * dv > reach * reach * ref_dot(ray, ray);
}

// Whether all rays through these pixels do, and the point lies in none of them.
static int is_far_of_all(const struct view_args *view, const struct ref_disc *disc, int x0, int x1, int y)
{
    const double ends[2] = {view->origin_x + x0 + 0.5, view->origin_x + x1 - 0.5}, beside_y = view->origin_y + y + 0.5;
    const double z = middle(disc->place.z), scale = view->perspective ? z : 1.0, px = middle(disc->place.x);
    const double du = scale * view->ray_xs * fmax(fmax(ends[0] - px, px - ends[1]), 0.0),
                 dv = scale * view->ray_ys * (beside_y - middle(disc->place.y));
    const struct ref_vec first = ray_of(view, ends[0], beside_y), last = ray_of(view, ends[1], beside_y);
    const double reach = 1.01 * disc->radius + 1e-4 * z, longest = fmax(ref_dot(first, first), ref_dot(last, last));
    const double row = y + (double)view->origin_y;
    const int beside = floor(disc->place.x.hi) < x0 + (double)view->origin_x ||
                       floor(disc->place.x.lo) > x1 - 1 + (double)view->origin_x || floor(disc->place.y.hi) < row ||
                       floor(disc->place.y.lo) > row;
    return beside && !view->level && z > 0.0 && du * du + dv * dv > (1.0 + 1e-9) * reach * reach * longest;
}

uint32_t ref_discs_around(const struct view_args *view, const struct ref_disc *discs, uint32_t count, int x0, int x1, int y,
                          uint32_t *around)
{
    uint32_t found = 0;
    for (uint32_t i = 0; i < count; i++)
        if (!is_far_of_all(view, &discs[i], x0, x1, y))
            around[found++] = i;
    return found;
}

struct ref_met ref_disc_at(const struct view_args *view, const struct ref_disc *disc, int x, int y)
{
    const enum ref_truth own = falls_into(view, disc, x, y);
    struct ref_met out = {.covered = REF_NO, .square = {2.0, 2.0}};
    if (own == REF_NO && is_far(view, disc, x, y))
        return out;
    out = meet(view, disc, x, y);
    if (own != REF_NO) { // the pixel of the point is covered anyway, beside the disc at the point's depth
        if (out.covered == REF_NO)
            out.z = disc->place.z;
        if (out.covered == REF_UNSURE) {
            out.z.lo = fmin(out.z.lo, disc->place.z.lo);
            out.z.hi = fmax(out.z.hi, disc->place.z.hi);
        }
        if (out.covered != REF_YES)
            out.covered = own;
    }
    if (out.covered == REF_NO)
        return out;
    if (out.z.hi < view->z_near || out.z.lo > view->z_far)
        out.covered = REF_NO;
    else if (out.z.lo < view->z_near || out.z.hi > view->z_far || !disc->definite)
        out.covered = REF_UNSURE;
    return out;
}
