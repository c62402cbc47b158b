// SPDX-License-Identifier: GPL-3.0-or-later
#include "analytic.h"

#include <math.h>
#include <stdlib.h>

struct analytic_shape analytic_shape(enum analytic_kind kind, double a, double b)
{
    struct analytic_shape shape = {.kind = kind, .a = a, .b = b};
    shape.world_from_object[0] = shape.world_from_object[5] = shape.world_from_object[10] = 1.0;
    return shape;
}

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// Distance to the torus; its gradient is the normal.
static double torus_distance(const struct analytic_shape *shape, const double p[3], double normal[3])
{
    double across = sqrt(p[0] * p[0] + p[1] * p[1]);
    double out = across - shape->a, length = sqrt(out * out + p[2] * p[2]);
    double scale = across > 0.0 ? out / (across * length) : 0.0;
    normal[0] = p[0] * scale;
    normal[1] = p[1] * scale;
    normal[2] = p[2] / length;
    return length - shape->b;
}

// Walks along the unit ray by the distance to the surface, which never passes the first hit.
static double torus_walk(const struct analytic_shape *shape, const double o[3], const double d[3], double normal[3])
{
    double outer = shape->a + shape->b, along = -dot(o, d), closest = dot(o, o) - along * along;
    if (closest > outer * outer)
        return HUGE_VAL;
    double half = sqrt(outer * outer - closest), t = fmax(along - half, 0.0), end = along + half;
    for (int i = 0; i < 100000 && t <= end; i++) {
        double p[3] = {o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]};
        double step = torus_distance(shape, p, normal);
        if (step < 1e-11 * outer)
            return t;
        t += step;
    }
    return HUGE_VAL;
}

static double cast_unit(const struct analytic_shape *shape, const double o[3], const double d[3], double normal[3])
{
    if (shape->kind == TORUS)
        return torus_walk(shape, o, d, normal);
    if (shape->kind == SPHERE) {
        double along = -dot(o, d), foot[3];
        for (int k = 0; k < 3; k++)
            foot[k] = o[k] + along * d[k];
        double rest = shape->a * shape->a - dot(foot, foot);
        if (rest < 0.0)
            return HUGE_VAL;
        double t = along - sqrt(rest);
        for (int k = 0; k < 3; k++)
            normal[k] = (o[k] + t * d[k]) / shape->a;
        return t > 0.0 ? t : HUGE_VAL;
    }
    double t = -o[2] / d[2];
    if (!(t > 0.0) || fabs(o[0] + t * d[0]) > 0.5 * shape->a || fabs(o[1] + t * d[1]) > 0.5 * shape->b)
        return HUGE_VAL;
    normal[0] = normal[1] = 0.0;
    normal[2] = 1.0;
    return t;
}

struct analytic_hit analytic_cast(const struct analytic_shape *shape, const double origin[3], const double direction[3])
{
    const double *m = shape->world_from_object;
    double length = sqrt(dot(direction, direction)), o[3] = {0}, d[3] = {0}, n[3] = {0};
    for (int k = 0; k < 3; k++)
        for (int j = 0; j < 3; j++) { // the inverse of a rotation is its transpose
            o[k] += m[4 * j + k] * (origin[j] - m[4 * j + 3]);
            d[k] += m[4 * j + k] * direction[j] / length;
        }
    struct analytic_hit hit = {.z = cast_unit(shape, o, d, n) / length};
    for (int k = 0; k < 3; k++)
        hit.normal[k] = dot(m + 4 * k, n);
    return hit;
}

struct analytic_hit *analytic_picture(const struct analytic_shape *shape, const patina_camera *camera, uint32_t width,
                                      uint32_t height)
{
    struct analytic_hit *picture = malloc((size_t)width * height * sizeof *picture);
    if (!picture)
        support_die("out of memory");
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++) {
            double origin[3], direction[3];
            camera_ray(camera, width, height, x + 0.5, y + 0.5, origin, direction);
            picture[(size_t)y * width + x] = analytic_cast(shape, origin, direction);
        }
    return picture;
}

// ---- comparison --------------------------------------------------------------------------------------------------

// How many of the 3 x 3 centres around lie in the truth; outside the picture counts as the pixel itself does.
static uint32_t covered_around(const struct analytic_hit *truth, uint32_t width, uint32_t height, uint32_t x, uint32_t y)
{
    uint32_t covered = 0;
    for (int dy = -1; dy <= 1; dy++)
        for (int dx = -1; dx <= 1; dx++) {
            int64_t i = (int64_t)x + dx, j = (int64_t)y + dy;
            if (i < 0 || j < 0 || i >= width || j >= height) {
                i = x;
                j = y;
            }
            covered += truth[(size_t)j * width + (size_t)i].z < HUGE_VAL;
        }
    return covered;
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double quantile(double *values, size_t count, double share)
{
    if (!count)
        return 0.0;
    qsort(values, count, sizeof *values, ascending);
    return values[(size_t)(share * (double)(count - 1))];
}

static double root_mean_square(const double *values, size_t count)
{
    double sum = 0.0;
    for (size_t i = 0; i < count; i++)
        sum += values[i] * values[i];
    return count ? sqrt(sum / (double)count) : 0.0;
}

static double normal_angle(const float shown[3], const double truth[3])
{
    double n[3] = {shown[0], shown[1], shown[2]}, length = sqrt(dot(n, n));
    if (!(length > 0.0))
        return 90.0;
    double cosine = dot(n, truth) / length;
    return acos(fmin(fmax(cosine, -1.0), 1.0)) * 180.0 / M_PI;
}

struct analytic_error analytic_compare(const struct picture *picture, const struct analytic_hit *truth, double spacing,
                                       const double sun[3], double white)
{
    uint32_t width = picture->width, height = picture->height;
    size_t pixels = (size_t)width * height, both = 0, either = 0, area = 0, inner = 0;
    size_t holes = 0, growth = 0, inner_holes = 0, outer_growth = 0;
    double *depth = malloc(3 * pixels * sizeof *depth), *angle = depth + pixels, *color = angle + pixels;
    if (!depth)
        support_die("out of memory");
    double angle_sum = 0.0;
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++) {
            size_t i = (size_t)y * width + x;
            int expected = truth[i].z < HUGE_VAL, shown = picture->keys[i] != KEY_EMPTY;
            uint32_t around = covered_around(truth, width, height, x, y);
            area += (size_t)expected;
            both += (size_t)(expected && shown);
            either += (size_t)(expected || shown);
            holes += (size_t)(expected && !shown);
            growth += (size_t)(!expected && shown);
            inner_holes += (size_t)(around == 9 && !shown);
            outer_growth += (size_t)(around == 0 && shown);
            if (around < 9 || !shown)
                continue;
            depth[inner] = fabs((double)picture->depth[i] - truth[i].z) / spacing;
            angle[inner] = normal_angle(picture->normal + 3 * i, truth[i].normal);
            angle_sum += angle[inner];
            double light = white > 0.0 ? fmax(dot(truth[i].normal, sun), 0.0) : 0.0, alpha = picture->combined[4 * i + 3];
            color[inner] = white > 0.0 ? fabs((double)picture->combined[4 * i] / (alpha > 0.0 ? alpha : 1.0) / white - light)
                                       : 0.0;
            inner++;
        }
    double scale = area ? 1.0 / (double)area : 0.0;
    struct analytic_error error = {
        .iou = either ? (double)both / (double)either : 1.0,
        .holes = (double)holes * scale,
        .growth = (double)growth * scale,
        .inner_holes = (double)inner_holes * scale,
        .outer_growth = (double)outer_growth * scale,
        .depth_rms = root_mean_square(depth, inner),
        .depth_p999 = quantile(depth, inner, 0.999),
        .normal_mean = inner ? angle_sum / (double)inner : 0.0,
        .normal_p99 = quantile(angle, inner, 0.99),
        .color_rms = root_mean_square(color, inner),
        .color_p99 = quantile(color, inner, 0.99),
    };
    free(depth);
    return error;
}

// ---- flat convex shapes --------------------------------------------------------------------------------------------

struct polygon polygon_project(const double (*world)[3], uint32_t count, const patina_camera *camera, uint32_t width,
                               uint32_t height)
{
    struct polygon polygon = {.count = count, .corner = malloc(count * sizeof *polygon.corner)};
    if (!polygon.corner)
        support_die("out of memory");
    for (uint32_t i = 0; i < count; i++) {
        double z;
        camera_project(camera, width, height, world[i], &polygon.corner[i][0], &polygon.corner[i][1], &z);
    }
    return polygon;
}

void polygon_free(struct polygon *polygon)
{
    free(polygon->corner);
    *polygon = (struct polygon){0};
}

double polygon_area(const struct polygon *polygon)
{
    double twice = 0.0;
    for (uint32_t i = 0; i < polygon->count; i++) {
        const double *a = polygon->corner[i], *b = polygon->corner[(i + 1) % polygon->count];
        twice += a[0] * b[1] - a[1] * b[0];
    }
    return 0.5 * fabs(twice);
}

struct span {
    double low, high; // empty when low > high
};

// Extent in x of the polygon within low <= y <= high.
static struct span band(const struct polygon *polygon, double low, double high)
{
    struct span span = {HUGE_VAL, -HUGE_VAL};
    for (uint32_t i = 0; i < polygon->count; i++) {
        const double *a = polygon->corner[i], *b = polygon->corner[(i + 1) % polygon->count];
        double y0 = fmin(a[1], b[1]), y1 = fmax(a[1], b[1]);
        if (y1 < low || y0 > high)
            continue;
        double cut[2] = {fmax(y0, low), fmin(y1, high)};
        for (int k = 0; k < 2; k++) {
            double t = a[1] == b[1] ? (double)k : (cut[k] - a[1]) / (b[1] - a[1]);
            double x = a[0] + t * (b[0] - a[0]);
            span.low = fmin(span.low, x);
            span.high = fmax(span.high, x);
        }
    }
    return span;
}

struct silhouette polygon_compare(const struct polygon *polygon, const struct picture *picture)
{
    struct silhouette result = {.area = polygon_area(polygon)};
    for (uint32_t y = 0; y < picture->height; y++) {
        // A convex shape: the squares it touches are one run, those within it another.
        struct span touched = band(polygon, y, y + 1.0), low = band(polygon, y, y), high = band(polygon, y + 1.0, y + 1.0);
        double left = fmax(low.low, high.low), right = fmin(low.high, high.high);
        for (uint32_t x = 0; x < picture->width; x++) {
            int shown = picture->keys[(size_t)y * picture->width + x] != KEY_EMPTY;
            int touches = x + 1.0 >= touched.low && x <= touched.high, within = x >= left && x + 1.0 <= right;
            result.inside += (uint64_t)within;
            result.grown += (uint64_t)(shown && !touches);
            result.missing += (uint64_t)(!shown && within);
        }
    }
    return result;
}
