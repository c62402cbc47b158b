// SPDX-License-Identifier: GPL-3.0-or-later
// M3C2: Lague, Brodu, Leroux, Accurate 3D comparison of complex topography with terrestrial laser scanner, 2013, section 3. Normals at
// scale D, then the mean of each cloud along the normal in a cylinder of diameter d.
#include "cells.h"
#include "base/descriptor.h"
#include "base/error.h"
#include "base/pool.h"
#include "base/progress.h"
#include "base/symmetric.h"
#include "base/vector.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LEAST = 4, GRAIN = 256 }; // points in a cylinder; points that a thread takes at once

#define SPACINGS 6.2      // of a cylinder's diameter: 30 points on a surface
#define BALLS 2.0         // diameters of a ball's
#define DEPTHS 10.0       // diameters of a cylinder's depth
#define WITHIN 3.0        // standard deviations that have to lie within the cylinder, or it grows
#define OUTWARD 0.25      // how much the way from the middle counts beside the way up
#define NORMAL_SHARE 0.35 // of the progress

struct job {
    const patina_distance_desc *desc;
    struct pt_places places, others;
    struct pt_cells own, other, balls; // balls: of the cloud, for normals, with wider cells
    double middle[3];
    float *normals; // 3 a point; NaN: none
    float *distance, *interval;
    patina_progress *progress;
    double begin, share; // of the progress, what the loop under way does
    atomic_uint done;
};

static void corner_of(const struct pt_cells *cells, int64_t x, int64_t y, int64_t z, double corner[3])
{
    const int64_t at[3] = {x, y, z};
    for (int k = 0; k < 3; k++)
        corner[k] = cells->low[k] + (double)at[k] * cells->edge;
}

static void raise(struct job *job, const struct pt_cells *cells, uint32_t count)
{
    const uint32_t done = atomic_fetch_add_explicit(&job->done, count, memory_order_relaxed) + count;
    pt_progress_raise(job->progress, job->begin + job->share * done / (cells->count + 1.0));
}

// ---- normals -----------------------------------------------------------------------------------------------------------

struct moments {
    double count, sum[3], product[3][3];
};

// Adds the points of a cell that lie in the ball around p.
static void add_in_ball(const struct pt_cells *cells, const struct pt_cell *cell, const double shift[3], double square,
                        struct moments *m)
{
    const float *offset = cells->offset + 3 * (size_t)cell->first;
    for (uint32_t i = 0; i < cell->count; i++, offset += 3) {
        const double d[3] = {shift[0] + (double)offset[0], shift[1] + (double)offset[1], shift[2] + (double)offset[2]};
        if (pt_dot(d, d) > square)
            continue;
        m->count += 1.0;
        for (int k = 0; k < 3; k++) {
            m->sum[k] += d[k];
            for (int l = 0; l <= k; l++)
                m->product[k][l] += d[k] * d[l];
        }
    }
}

// The normal of the plane through the points of the ball. Returns 0 where they lie on a line, or are fewer than 4.
static int fit_normal(const struct job *job, const double p[3], double normal[3])
{
    const struct pt_cells *cells = &job->balls;
    const double radius = 0.5 * job->desc->normal_scale;
    struct moments m = {0};
    int64_t low[3], high[3];
    for (int k = 0; k < 3; k++) {
        low[k] = pt_cells_along(cells, p[k] - radius, k);
        high[k] = pt_cells_along(cells, p[k] + radius, k);
    }
    for (int64_t z = low[2]; z <= high[2]; z++)
        for (int64_t y = low[1]; y <= high[1]; y++)
            for (int64_t x = low[0]; x <= high[0]; x++) {
                const struct pt_cell *cell = pt_cells_at(cells, x, y, z);
                double shift[3];
                corner_of(cells, x, y, z, shift);
                for (int k = 0; k < 3; k++)
                    shift[k] -= p[k];
                if (cell)
                    add_in_ball(cells, cell, shift, radius * radius, &m);
            }
    if (m.count < LEAST)
        return 0;
    double a[3][3], value[3], axis[3][3];
    for (int k = 0; k < 3; k++)
        for (int l = 0; l <= k; l++)
            a[k][l] = a[l][k] = (m.product[k][l] - m.sum[k] * m.sum[l] / m.count) / (m.count * radius * radius);
    pt_solve_symmetric(a, value, axis);
    memcpy(normal, axis[0], sizeof axis[0]);
    return value[1] > 1e-9 * value[2] && value[1] > 0;
}

// The given normal of a point, of length 1. Returns 0 where it has none.
static int given_normal(const struct job *job, uint32_t number, double normal[3])
{
    if (!job->desc->normal.data)
        return 0;
    pt_read_vector(&job->desc->normal, number, normal);
    const double most = fmax(fmax(fabs(normal[0]), fabs(normal[1])), fabs(normal[2]));
    if (!(most > 0) || !isfinite(most) || !isfinite(normal[0] + normal[1] + normal[2]))
        return 0;
    for (int k = 0; k < 3; k++)
        normal[k] /= most;
    const double length = sqrt(pt_dot(normal, normal));
    for (int k = 0; k < 3; k++)
        normal[k] /= length;
    return 1;
}

// Where a normal that was found has to face: to the side of the given one; else up, and away from the middle.
static void side_of(const struct job *job, uint32_t number, const double p[3], double side[3])
{
    if (given_normal(job, number, side))
        return;
    const double x = p[0] - job->middle[0], y = p[1] - job->middle[1], length = sqrt(x * x + y * y);
    side[0] = length > 0 ? OUTWARD * x / length : 0;
    side[1] = length > 0 ? OUTWARD * y / length : 0;
    side[2] = 1;
}

static void place_of(const struct pt_cells *cells, const struct pt_places *places, uint32_t i, double p[3])
{
    pt_place(places, cells->number[i], p);
}

static void find_normals(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct job *job = context;
    (void)thread;
    for (uint32_t i = begin; i < end && !pt_progress_cancelled(job->progress); i++) {
        const uint32_t number = job->balls.number[i];
        double p[3], normal[3] = {0}, side[3];
        place_of(&job->balls, &job->places, i, p);
        int has = fit_normal(job, p, normal);
        side_of(job, number, p, side);
        const double sign = pt_dot(normal, side) < 0 ? -1.0 : 1.0;
        for (int k = 0; k < 3; k++)
            job->normals[3 * (size_t)number + (size_t)k] = has ? (float)(sign * normal[k]) : NAN;
    }
    raise(job, &job->balls, end - begin);
}

static void take_normals(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct job *job = context;
    (void)thread;
    for (uint32_t i = begin; i < end && !pt_progress_cancelled(job->progress); i++) {
        const uint32_t number = job->own.number[i];
        double normal[3];
        const int has = given_normal(job, number, normal);
        for (int k = 0; k < 3; k++)
            job->normals[3 * (size_t)number + (size_t)k] = has ? (float)normal[k] : NAN;
    }
}

// ---- cylinders ---------------------------------------------------------------------------------------------------------

struct cylinder {
    double p[3], normal[3];
    double radius, half; // reaches from -half to half along the normal
    double across[3];    // how far its rim reaches along each axis
};

struct sums {
    double count, sum, squares; // of the places along the normal
};

static void add_in_cylinder(const struct pt_cells *cells, const struct pt_cell *cell, const double shift[3],
                            const struct cylinder *c, struct sums *sums)
{
    const float *offset = cells->offset + 3 * (size_t)cell->first;
    const double square = c->radius * c->radius;
    for (uint32_t i = 0; i < cell->count; i++, offset += 3) {
        const double d[3] = {shift[0] + (double)offset[0], shift[1] + (double)offset[1], shift[2] + (double)offset[2]};
        const double t = pt_dot(d, c->normal);
        if (fabs(t) > c->half || pt_dot(d, d) - t * t > square)
            continue;
        sums->count += 1.0;
        sums->sum += t;
        sums->squares += t * t;
    }
}

// The cells of one layer across the axis that the cylinder mostly runs along.
static void add_layer(const struct pt_cells *cells, const struct cylinder *c, int axis, int64_t layer, struct sums *sums)
{
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const double below = cells->low[axis] + (double)layer * cells->edge - c->p[axis];
    double from = (below - c->across[axis]) / c->normal[axis];
    double to = (below + cells->edge + c->across[axis]) / c->normal[axis];
    if (from > to) {
        const double kept = from;
        from = to;
        to = kept;
    }
    from = fmax(from, -c->half);
    to = fmin(to, c->half);
    int64_t low[3], high[3], at[3];
    for (int k = 0; k < 3; k++) {
        const double a = c->normal[k] * from, b = c->normal[k] * to;
        low[k] = pt_cells_along(cells, c->p[k] + fmin(a, b) - c->across[k], k);
        high[k] = pt_cells_along(cells, c->p[k] + fmax(a, b) + c->across[k], k);
    }
    at[axis] = layer;
    for (at[u] = low[u]; at[u] <= high[u]; at[u]++)
        for (at[v] = low[v]; at[v] <= high[v]; at[v]++) {
            const struct pt_cell *cell = pt_cells_at(cells, at[0], at[1], at[2]);
            double shift[3];
            if (!cell)
                continue;
            corner_of(cells, at[0], at[1], at[2], shift);
            for (int k = 0; k < 3; k++)
                shift[k] -= c->p[k];
            add_in_cylinder(cells, cell, shift, c, sums);
        }
}

static struct sums sums_of(const struct job *job, const struct pt_cells *cells, const struct cylinder *c)
{
    struct sums sums = {0};
    int axis = fabs(c->normal[1]) > fabs(c->normal[0]);
    axis = fabs(c->normal[2]) > fabs(c->normal[axis]) ? 2 : axis;
    const double reach = c->half * fabs(c->normal[axis]) + c->across[axis];
    const int64_t last = pt_cells_along(cells, c->p[axis] + reach, axis);
    for (int64_t layer = pt_cells_along(cells, c->p[axis] - reach, axis); layer <= last; layer++) {
        if (pt_progress_cancelled(job->progress))
            break;
        add_layer(cells, c, axis, layer, &sums);
    }
    return sums;
}

// Mean and variance along the normal. The cylinder doubles until its points lie well within. Returns their count; 0: fewer than LEAST.
static double look(const struct job *job, const struct pt_cells *cells, struct cylinder *c, double *mean, double *variance)
{
    const double depth = job->desc->depth;
    for (c->half = fmin(c->radius, depth);; c->half = fmin(2 * c->half, depth)) {
        const struct sums sums = sums_of(job, cells, c);
        if (sums.count >= LEAST) {
            *mean = sums.sum / sums.count;
            *variance = fmax(sums.squares - sums.sum * *mean, 0) / (sums.count - 1);
            if (c->half >= depth || fabs(*mean) + WITHIN * sqrt(*variance) <= c->half)
                return sums.count;
        }
        if (c->half >= depth || pt_progress_cancelled(job->progress))
            return 0;
    }
}

static void find_distances(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct job *job = context;
    struct cylinder c = {.radius = 0.5 * job->desc->cylinder};
    (void)thread;
    for (uint32_t i = begin; i < end && !pt_progress_cancelled(job->progress); i++) {
        const uint32_t number = job->own.number[i];
        const float *normal = job->normals + 3 * (size_t)number;
        double mean[2], variance[2], count[2] = {0, 0};
        place_of(&job->own, &job->places, i, c.p);
        for (int k = 0; k < 3; k++) {
            c.normal[k] = (double)normal[k];
            c.across[k] = c.radius * sqrt(fmax(1 - c.normal[k] * c.normal[k], 0));
        }
        if (!isfinite(normal[0]))
            continue;
        count[0] = look(job, &job->own, &c, &mean[0], &variance[0]);
        if (count[0] > 0)
            count[1] = look(job, &job->other, &c, &mean[1], &variance[1]);
        if (!(count[1] > 0))
            continue;
        const double error = sqrt(variance[0] / count[0] + variance[1] / count[1]) + job->desc->registration_error;
        job->distance[number] = (float)(mean[1] - mean[0]);
        job->interval[number] = (float)(1.96 * error);
    }
    raise(job, &job->own, end - begin);
}

// ---- the call ----------------------------------------------------------------------------------------------------------

static int measure(struct job *job, struct pt_pool *pool)
{
    const patina_distance_desc *desc = job->desc;
    int error = pt_cells_create(&job->own, &job->places, desc->cylinder, pool, job->progress, 0, 0.05);
    if (!error)
        error = pt_cells_create(&job->other, &job->others, desc->cylinder, pool, job->progress, 0.05, 0.1);
    if (!error && desc->normal_scale > 0)
        error = pt_cells_create(&job->balls, &job->places, 0.5 * desc->normal_scale, pool, job->progress, 0.1, 0.15);
    if (error)
        return error;
    job->begin = 0.15;
    job->share = NORMAL_SHARE;
    if (desc->normal_scale > 0)
        pt_parallel(pool, job->balls.count, GRAIN, find_normals, job);
    else
        pt_parallel(pool, job->own.count, GRAIN, take_normals, job);
    pt_cells_destroy(&job->balls);
    job->begin += job->share;
    job->share = 1 - job->begin;
    atomic_store(&job->done, 0);
    pt_parallel(pool, job->own.count, GRAIN, find_distances, job);
    return pt_progress_cancelled(job->progress) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}

// Takes the arrays and lengths of a descriptor, as far as they hold.
static int check(const char *call, patina_distance_desc *desc, struct pt_places *places, struct pt_places *others)
{
    *places = (struct pt_places){.array = desc->position, .count = desc->count};
    *others = (struct pt_places){.array = desc->other, .count = desc->other_count};
    for (int k = 0; k < 3; k++) {
        if (!isfinite(desc->origin[k]) || !isfinite(desc->other_origin[k]))
            return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "%s: an origin is not finite", call);
        others->shift[k] = desc->other_origin[k] - desc->origin[k];
    }
    int error = pt_places_check(call, "the cloud", places);
    if (!error)
        error = pt_places_check(call, "the other cloud", others);
    if (!error)
        error = pt_check_array(&desc->normal, "normal", 1u << PATINA_FLOAT32 | 1u << PATINA_FLOAT64, 3, 3);
    if (!error && !(pt_is_length(desc->normal_scale) && pt_is_length(desc->cylinder) && pt_is_length(desc->depth) &&
                    pt_is_length(desc->registration_error)))
        error = pt_fail(NULL, PATINA_ERROR_ARGUMENT,
                        "%s: normal_scale, cylinder, depth and registration_error have to be 0 or more, and finite", call);
    return error;
}

static int set_defaults(const char *call, patina_distance_desc *desc, const struct pt_places *places,
                        const struct pt_places *others)
{
    if (!(desc->cylinder > 0))
        desc->cylinder = SPACINGS * fmax(pt_places_spacing(places), pt_places_spacing(others));
    if (!(desc->cylinder > 0) || !pt_is_length(desc->cylinder))
        return pt_fail(NULL, PATINA_ERROR_EMPTY, "%s: the clouds have no spacing to choose the cylinder by: give its diameter",
                       call);
    if (!(desc->depth > 0))
        desc->depth = DEPTHS * desc->cylinder;
    if (!(desc->normal_scale > 0) && !desc->normal.data)
        desc->normal_scale = BALLS * desc->cylinder;
    return PATINA_OK;
}

int patina_distance_defaults(patina_distance_desc *desc)
{
    static const char call[] = "patina_distance_defaults";
    patina_distance_desc taken;
    struct pt_places places, others;
    if (!desc)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "%s: desc is NULL", call);
    int error = pt_take(NULL, call, desc, &taken, sizeof taken);
    if (!error)
        error = check(call, &taken, &places, &others);
    if (!error)
        error = set_defaults(call, &taken, &places, &others);
    if (error)
        return error;
    taken.position = desc->position;
    taken.normal = desc->normal;
    taken.other = desc->other;
    return pt_give(NULL, call, &taken, sizeof taken, desc);
}

int patina_cloud_distance(const patina_distance_desc *given, patina_progress *progress, float *distance, float *interval)
{
    static const char call[] = "patina_cloud_distance";
    patina_distance_desc desc;
    struct job job = {.desc = &desc, .progress = progress};
    if (!given)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "%s: desc is NULL", call);
    int error = pt_take(NULL, call, given, &desc, sizeof desc);
    if (!error)
        error = check(call, &desc, &job.places, &job.others);
    if (!error && desc.count && !(distance && interval))
        error = pt_fail(NULL, PATINA_ERROR_ARGUMENT, "%s: distance or interval is NULL", call);
    if (error || !desc.count)
        return error;
    struct pt_pool *pool = NULL;
    const size_t count = (size_t)desc.count;
    float *results = malloc(5 * count * sizeof *results);
    for (size_t i = 0; results && i < 5 * count; i++)
        results[i] = NAN;
    job.distance = results;
    job.interval = results ? results + count : NULL;
    job.normals = results ? results + 2 * count : NULL;
    if (!results)
        error = PATINA_ERROR_MEMORY;
    else if (pt_places_middle(&job.places, job.middle) && desc.other_count) { // else all is NaN
        if (!(error = set_defaults(call, &desc, &job.places, &job.others)) &&
            !(pool = pt_pool_create(pt_pool_threads_for(desc.threads, desc.count + desc.other_count), 0)))
            error = PATINA_ERROR_MEMORY;
        if (!error)
            error = measure(&job, pool);
    }
    if (!error) {
        memcpy(distance, job.distance, count * sizeof *distance);
        memcpy(interval, job.interval, count * sizeof *interval);
        pt_progress_set(progress, 1);
    }
    pt_pool_destroy(pool);
    pt_cells_destroy(&job.own);
    pt_cells_destroy(&job.other);
    pt_cells_destroy(&job.balls);
    free(results);
    return error == PATINA_ERROR_MEMORY || error == PATINA_ERROR_CANCELLED
               ? pt_fail(NULL, error, "%s: %s", call, patina_error_text(error))
               : error;
}
