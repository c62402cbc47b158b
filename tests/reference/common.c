// SPDX-License-Identifier: GPL-3.0-or-later
// SPEC 1 in float64: rays, d_eff, normals, keys, tangent planes.
#include "reference.h"
#include "tolerances.h"
#include "shared/clips.h"
#include "shared/words.h"

#include <math.h>
#include <string.h>

struct ref_vec ref_vec(double x, double y, double z)
{
    struct ref_vec v = {x, y, z};
    return v;
}

struct ref_vec ref_vec_of(const float v[3]) { return ref_vec(v[0], v[1], v[2]); }

struct ref_vec ref_scale(struct ref_vec a, double s) { return ref_vec(a.x * s, a.y * s, a.z * s); }

struct ref_vec ref_add(struct ref_vec a, struct ref_vec b) { return ref_vec(a.x + b.x, a.y + b.y, a.z + b.z); }

double ref_dot(struct ref_vec a, struct ref_vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

double ref_length(struct ref_vec a) { return sqrt(ref_dot(a, a)); }

struct ref_vec ref_unit(struct ref_vec a)
{
    double length = ref_length(a);
    return length > 0.0 ? ref_scale(a, 1.0 / length) : ref_vec(0.0, 0.0, 0.0);
}

double ref_key_z(uint64_t key)
{
    uint32_t bits = (uint32_t)(key >> 32);
    float z;
    memcpy(&z, &bits, 4);
    return z;
}

uint32_t ref_key_id(uint64_t key) { return (uint32_t)key; }

uint64_t ref_key(float z, uint32_t id)
{
    uint32_t bits;
    memcpy(&bits, &z, 4);
    return (uint64_t)bits << 32 | id;
}

int ref_is_of(const struct instance_args *instance, uint64_t key)
{
    return key != REF_EMPTY_KEY && ref_key_id(key) - instance->id_base - instance->id_first < instance->id_count;
}

struct ref_range ref_exactly(double value)
{
    struct ref_range range = {value, value};
    return range;
}

enum ref_truth ref_less(struct ref_range a, struct ref_range b)
{
    return a.hi < b.lo ? REF_YES : a.lo >= b.hi ? REF_NO : REF_UNSURE;
}

enum ref_truth ref_less_equal(struct ref_range a, struct ref_range b)
{
    return a.hi <= b.lo ? REF_YES : a.lo > b.hi ? REF_NO : REF_UNSURE;
}

struct ref_range ref_rounded(struct ref_range exact)
{
    // What float32 holds needs no rounding.
    if (exact.lo != (double)(float)exact.lo)
        exact.lo -= TOL_SUM * fabs(exact.lo);
    if (exact.hi != (double)(float)exact.hi)
        exact.hi += TOL_SUM * fabs(exact.hi);
    return exact;
}

struct ref_range ref_difference(struct ref_range a, struct ref_range b)
{
    struct ref_range exact = {a.lo - b.hi, a.hi - b.lo};
    return ref_rounded(exact);
}

struct ref_ray ref_ray(const struct view_args *view, int x, int y)
{
    double scale = ldexp(1.0, (int)view->level);
    double px = (floor(view->origin_x / scale) + x + 0.5) * scale;
    double py = (floor(view->origin_y / scale) + y + 0.5) * scale;
    struct ref_ray ray;
    ray.u = view->ray_x0 + view->ray_xs * px;
    ray.v = view->ray_y0 + view->ray_ys * py;
    ray.error_u = TOL_RAY * (fabs(view->ray_x0) + fabs(view->ray_xs * px));
    ray.error_v = TOL_RAY * (fabs(view->ray_y0) + fabs(view->ray_ys * py));
    return ray;
}

struct ref_vec ref_viewer(const struct view_args *view, struct ref_ray ray)
{
    return view->perspective ? ref_unit(ref_vec(-ray.u, -ray.v, 1.0)) : ref_vec(0.0, 0.0, 1.0);
}

double ref_footprint(const struct view_args *view, double z)
{
    double width = ldexp(view->footprint, (int)view->level);
    return view->perspective ? width * z : width;
}

double ref_ulp4(double z)
{
    if (!(z >= 0x1p-126)) // below lie 0 and the denormals, whose ulp is nothing to anybody
        return 0.0;
    int exponent;
    frexp(z, &exponent); // z = f 2^exponent, f in [1/2, 1)
    return 4.0 * ldexp(1.0, exponent - 24);
}

double ref_layer_minimum(const struct view_args *view, double d_min, double spacing, double z)
{
    double d = fmax(d_min, (double)PT_SPACING_FACTOR * spacing);
    return fmax(fmax(d, ref_footprint(view, z)), ref_ulp4(z));
}

double ref_sure_minimum(const struct view_args *view, double d_min, double sigma, double spacing, double z)
{
    const double thick = fmin(fmax((double)PT_SIGMAS * sigma, (double)PT_SPACING_SURE * spacing),
                              (double)PT_SPACING_FACTOR * spacing);
    return fmax(fmax(fmax(d_min, thick), (double)PT_FOOTPRINT_SURE * ref_footprint(view, z)), ref_ulp4(z));
}

struct ref_range ref_level_distance(const struct view_args *view, const float *normal, const float *deff, uint32_t from,
                                    struct ref_range z)
{
    struct ref_range d = ref_exactly(deff[from]);
    if (view->level) {
        double inverse = normal[4 * (size_t)from + 3];
        d.lo = fmax(d.lo, ref_footprint(view, z.lo) * inverse * (1.0 - TOL_LEVEL));
        d.hi = fmax(d.hi, ref_footprint(view, z.hi) * inverse * (1.0 + TOL_LEVEL));
    }
    return d;
}

int ref_decode_normal(uint32_t word, struct ref_vec *normal)
{
    if ((word & PT_NORMAL_BITS) == PT_NORMAL_NONE)
        return 0;
    // An octahedron unfolded to the square [-1, 1]^2, 4095 steps from the centre to a side.
    double x = ((double)(word & 8191) - 4095.0) / 4095.0;
    double y = ((double)(word >> 13 & 8191) - 4095.0) / 4095.0;
    double z = 1.0 - fabs(x) - fabs(y);
    if (z < 0.0) { // lower half: the corners are folded inwards
        double inwards = -z;
        x += x >= 0.0 ? -inwards : inwards;
        y += y >= 0.0 ? -inwards : inwards;
    }
    *normal = ref_unit(ref_vec(x, y, z));
    return 1;
}

double ref_srgb(uint8_t value)
{
    double c = value / 255.0;
    return c <= 0.04045 ? c / 12.92 : pow((c + 0.055) / 1.055, 2.4);
}

static struct ref_range quotient(double a, double error_a, double b, double error_b)
{
    double q = a / b;
    double error = (error_a + fabs(q) * error_b) / (fabs(b) - error_b);
    struct ref_range range = {q - error, q + error};
    return range;
}

static struct ref_range perspective_plane(const float n[3], struct ref_ray q, struct ref_range z, struct ref_ray p, int *open)
{
    double dq = n[0] * q.u + n[1] * q.v - n[2], dp = n[0] * p.u + n[1] * p.v - n[2];
    double eq = TOL_DOT * (fabs(n[0] * q.u) + fabs(n[1] * q.v) + fabs((double)n[2])) + fabs(n[0] * q.error_u) +
                fabs(n[1] * q.error_v);
    double ep = TOL_DOT * (fabs(n[0] * p.u) + fabs(n[1] * p.v) + fabs((double)n[2])) + fabs(n[0] * p.error_u) +
                fabs(n[1] * p.error_v);
    if (fabs(dp) <= fmax(2.0 * ep, TOL_PARALLEL)) {
        *open = 1;
        return z;
    }
    struct ref_range ratio = quotient(dq, eq, dp, ep);
    struct ref_range depth = {fmin(z.lo * ratio.lo, z.hi * ratio.lo), fmax(z.lo * ratio.hi, z.hi * ratio.hi)};
    return depth;
}

static struct ref_range orthographic_plane(const float n[3], struct ref_ray q, struct ref_range z, struct ref_ray p, int *open)
{
    double du = p.u - q.u, dv = p.v - q.v;
    double error = 2.0 * TOL_DOT * (fabs(n[0] * du) + fabs(n[1] * dv)) + fabs((double)n[0]) * (p.error_u + q.error_u) +
                   fabs((double)n[1]) * (p.error_v + q.error_v);
    if (fabs((double)n[2]) <= TOL_PARALLEL) {
        *open = 1;
        return z;
    }
    struct ref_range step = quotient(n[0] * du + n[1] * dv, error, n[2], 0.0);
    step.lo -= TOL_QUOTIENT * fabs(step.lo);
    step.hi += TOL_QUOTIENT * fabs(step.hi);
    struct ref_range depth = {z.lo + step.lo, z.hi + step.hi};
    return depth;
}

size_t ref_cell_of(uint32_t pixel, uint32_t from_width, uint32_t level, uint32_t width)
{
    return (size_t)(pixel / from_width >> level) * width + (pixel % from_width >> level);
}

struct ref_range ref_farthest(struct ref_range measured, double span, double inverse)
{
    const double way = span / inverse, error = TOL_LEVEL * way;
    return (struct ref_range){(measured.lo + way - error) * (1.0 - TOL_SUM), (measured.hi + way + error) * (1.0 + TOL_SUM)};
}

struct ref_range ref_plane_depth(const struct view_args *view, const float normal[3], struct ref_ray q, struct ref_range z,
                                 struct ref_ray p, struct ref_range limit)
{
    int open = 0;
    struct ref_range depth = view->perspective ? perspective_plane(normal, q, z, p, &open)
                                               : orthographic_plane(normal, q, z, p, &open);
    double far_lo = (z.lo + limit.lo) * (1.0 - TOL_SUM), far_hi = (z.hi + limit.hi) * (1.0 + TOL_SUM);
    if (open) {
        struct ref_range any = {z.lo, far_hi};
        return any;
    }
    double rounding = view->perspective ? TOL_QUOTIENT : TOL_SUM;
    if (depth.lo != z.lo || depth.hi != z.hi) { // adding 0 is exact
        depth.lo -= rounding * fabs(depth.lo);
        depth.hi += rounding * fabs(depth.hi);
    }
    // A depth on the near side is the source's own, to the bit.
    struct ref_range kept = {fmin(fmax(depth.lo, z.lo), far_lo), fmin(fmax(depth.hi, z.hi), far_hi)};
    if (kept.lo < z.lo) // z + limit rounds to z or above
        kept.lo = z.lo;
    return kept;
}

struct ref_range ref_within(struct ref_range z, struct ref_range plane, struct ref_range farthest,
                            const struct ref_range *beside, int count)
{
    const double least = (2.0 * plane.lo - z.hi) * (1.0 - 2.0 * TOL_SUM),
                 most = (2.0 * plane.hi - z.lo) * (1.0 + 2.0 * TOL_SUM);
    for (int i = 0; i < count; i++) {
        if (beside[i].hi <= least)
            farthest.lo = fmax(farthest.lo, beside[i].lo);
        if (beside[i].lo <= most)
            farthest.hi = fmax(farthest.hi, beside[i].hi);
    }
    return (struct ref_range){fmax(fmin(plane.lo, farthest.lo), z.lo), fmax(fmin(plane.hi, farthest.hi), z.hi)};
}

double ref_clip_row(const struct clip_view *clip, int k, const double p[3], double *error)
{
    const float *r = clip->row + 3 * k;
    double value = (double)clip->lo[k] + clip->hi[k], terms = fabs((double)clip->lo[k]) + fabs((double)clip->hi[k]);
    for (int i = 0; i < 3; i++) {
        value += r[i] * p[i];
        terms += fabs(r[i] * p[i]);
    }
    *error = TOL_PROJECT * terms;
    return value;
}
