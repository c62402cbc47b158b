// SPDX-License-Identifier: GPL-3.0-or-later
// A binary tree of boxes over triangles, split where the surface area heuristic is least (Wald 2007, 16 bins), and walked
// nearest child first. Triangles: Möller and Trumbore 1997, both sides.
#include "rays.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#define BINS 16
#define LEAF 4
#define DEEPEST 64
#define MOST_THREADS 64

typedef struct box {
    double lo[3], hi[3];
} box;

typedef struct node {
    box bounds;
    int32_t first, count; // count > 0: triangles of a leaf; else first is the left child, the right one follows it
} node;

struct rays {
    node *nodes;
    double *triangle; // in the tree's order: corner, two edges
    int32_t *number;  // the caller's
    int32_t used;
};

typedef struct builder {
    rays *r;
    box *bounds;
    double (*middle)[3];
    int32_t *order;
} builder;

static box empty_box(void) { return (box){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}}; }

static void grow(box *b, const box *other)
{
    for (int a = 0; a < 3; a++) {
        b->lo[a] = fmin(b->lo[a], other->lo[a]);
        b->hi[a] = fmax(b->hi[a], other->hi[a]);
    }
}

static double half_area(const box *b)
{
    double x = b->hi[0] - b->lo[0], y = b->hi[1] - b->lo[1], z = b->hi[2] - b->lo[2];
    return x < 0.0 ? 0.0 : x * y + y * z + z * x;
}

// How many of the node's triangles go left; 0: it stays a leaf.
static int32_t split(builder *b, const node *n)
{
    int32_t *order = b->order + n->first;
    double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (int32_t i = 0; i < n->count; i++)
        for (int a = 0; a < 3; a++) {
            lo[a] = fmin(lo[a], b->middle[order[i]][a]);
            hi[a] = fmax(hi[a], b->middle[order[i]][a]);
        }
    double best = half_area(&n->bounds) * n->count;
    int best_axis = -1, best_bin = 0;
    for (int a = 0; a < 3; a++) {
        if (!(hi[a] > lo[a]))
            continue;
        box bins[BINS];
        int32_t counts[BINS] = {0};
        for (int k = 0; k < BINS; k++)
            bins[k] = empty_box();
        double scale = BINS * (1.0 - 1e-9) / (hi[a] - lo[a]);
        for (int32_t i = 0; i < n->count; i++) {
            int k = (int)((b->middle[order[i]][a] - lo[a]) * scale);
            counts[k]++;
            grow(&bins[k], &b->bounds[order[i]]);
        }
        double right[BINS];
        box all = empty_box();
        int32_t sum = 0;
        for (int k = BINS - 1; k > 0; k--) {
            grow(&all, &bins[k]);
            sum += counts[k];
            right[k] = half_area(&all) * sum;
        }
        all = empty_box(), sum = 0;
        for (int k = 0; k < BINS - 1; k++) {
            grow(&all, &bins[k]);
            sum += counts[k];
            double cost = half_area(&all) * sum + right[k + 1] + half_area(&n->bounds);
            if (sum > 0 && sum < n->count && cost < best)
                best = cost, best_axis = a, best_bin = k;
        }
    }
    if (best_axis < 0)
        return n->count > 4 * LEAF ? n->count / 2 : 0;
    double scale = BINS * (1.0 - 1e-9) / (hi[best_axis] - lo[best_axis]);
    int32_t left = 0;
    for (int32_t i = 0; i < n->count; i++)
        if ((int)((b->middle[order[i]][best_axis] - lo[best_axis]) * scale) <= best_bin) {
            int32_t swap = order[i];
            order[i] = order[left];
            order[left++] = swap;
        }
    return left;
}

static void build(builder *b, int32_t at, int depth)
{
    node *n = &b->r->nodes[at];
    n->bounds = empty_box();
    for (int32_t i = 0; i < n->count; i++)
        grow(&n->bounds, &b->bounds[b->order[n->first + i]]);
    int32_t left = n->count <= LEAF || depth >= DEEPEST - 2 ? 0 : split(b, n);
    if (!left)
        return;
    int32_t child = b->r->used;
    b->r->used += 2;
    b->r->nodes[child] = (node){.first = n->first, .count = left};
    b->r->nodes[child + 1] = (node){.first = n->first + left, .count = n->count - left};
    n->first = child, n->count = 0;
    build(b, child, depth + 1);
    build(b, child + 1, depth + 1);
}

void rays_destroy(rays *r)
{
    if (!r)
        return;
    free(r->nodes);
    free(r->triangle);
    free(r->number);
    free(r);
}

rays *rays_create(const double *corners, int64_t count)
{
    if (count < 1 || count > 1 << 28)
        return NULL;
    rays *r = calloc(1, sizeof *r);
    builder b = {r, malloc((size_t)count * sizeof *b.bounds), malloc((size_t)count * sizeof *b.middle),
                 malloc((size_t)count * sizeof *b.order)};
    if (r) {
        r->nodes = malloc((size_t)(2 * count + 1) * sizeof *r->nodes);
        r->triangle = malloc((size_t)count * 9 * sizeof *r->triangle);
    }
    if (!r || !b.bounds || !b.middle || !b.order || !r->nodes || !r->triangle) {
        rays_destroy(r);
        r = NULL;
    } else {
        for (int64_t i = 0; i < count; i++) {
            b.order[i] = (int32_t)i;
            b.bounds[i] = empty_box();
            for (int a = 0; a < 3; a++) {
                for (int c = 0; c < 3; c++) {
                    double x = corners[9 * i + 3 * c + a];
                    b.bounds[i].lo[a] = fmin(b.bounds[i].lo[a], x);
                    b.bounds[i].hi[a] = fmax(b.bounds[i].hi[a], x);
                }
                b.middle[i][a] = 0.5 * (b.bounds[i].lo[a] + b.bounds[i].hi[a]);
            }
        }
        r->used = 1;
        r->nodes[0] = (node){.first = 0, .count = (int32_t)count};
        build(&b, 0, 0);
        for (int64_t i = 0; i < count; i++) {
            const double *c = corners + 9 * (int64_t)b.order[i];
            for (int a = 0; a < 3; a++) {
                r->triangle[9 * i + a] = c[a];
                r->triangle[9 * i + 3 + a] = c[3 + a] - c[a];
                r->triangle[9 * i + 6 + a] = c[6 + a] - c[a];
            }
        }
        r->number = b.order;
        b.order = NULL;
    }
    free(b.bounds);
    free(b.middle);
    free(b.order);
    return r;
}

// Where the ray enters the box, INFINITY where it misses it or enters behind `most`.
static inline double enter(const box *b, const double *o, const double *inverse, double most)
{
    double near = 0.0, far = most;
    for (int a = 0; a < 3; a++) {
        double t0 = (b->lo[a] - o[a]) * inverse[a], t1 = (b->hi[a] - o[a]) * inverse[a];
        double least = t0 < t1 ? t0 : t1, greatest = t0 < t1 ? t1 : t0;
        near = least > near ? least : near;
        far = greatest < far ? greatest : far;
    }
    return near <= far * (1.0 + 1e-12) ? near : INFINITY;
}

static inline double cross_triangle(const double *v, const double *o, const double *d)
{
    const double *e = v + 3, *f = v + 6;
    double px = d[1] * f[2] - d[2] * f[1], py = d[2] * f[0] - d[0] * f[2], pz = d[0] * f[1] - d[1] * f[0];
    double det = e[0] * px + e[1] * py + e[2] * pz;
    if (det == 0.0)
        return INFINITY;
    double inverse = 1.0 / det, sx = o[0] - v[0], sy = o[1] - v[1], sz = o[2] - v[2];
    double u = (sx * px + sy * py + sz * pz) * inverse;
    if (!(u >= -1e-9 && u <= 1.0 + 1e-9))
        return INFINITY;
    double qx = sy * e[2] - sz * e[1], qy = sz * e[0] - sx * e[2], qz = sx * e[1] - sy * e[0];
    double w = (d[0] * qx + d[1] * qy + d[2] * qz) * inverse;
    if (!(w >= -1e-9 && u + w <= 1.0 + 1e-9))
        return INFINITY;
    double t = (f[0] * qx + f[1] * qy + f[2] * qz) * inverse;
    return t > 1e-9 ? t : INFINITY;
}

static void trace(const rays *r, const double *o, const double *d, double *out_t, int32_t *out_triangle)
{
    double inverse[3], best = INFINITY;
    for (int a = 0; a < 3; a++)
        inverse[a] = fabs(d[a]) > 1e-200 ? 1.0 / d[a] : 1e200; // finite: 0 × inf would miss a slab
    int32_t found = -1, stack[2 * DEEPEST], top = 0;
    double begins[2 * DEEPEST];
    begins[top] = enter(&r->nodes[0].bounds, o, inverse, best);
    stack[top++] = 0;
    while (top > 0) {
        top--;
        if (!(begins[top] < best))
            continue;
        const node *n = &r->nodes[stack[top]];
        if (n->count > 0) {
            for (int32_t i = n->first; i < n->first + n->count; i++) {
                double t = cross_triangle(r->triangle + 9 * (int64_t)i, o, d);
                if (t < best)
                    best = t, found = r->number[i];
            }
            continue;
        }
        double left = enter(&r->nodes[n->first].bounds, o, inverse, best);
        double right = enter(&r->nodes[n->first + 1].bounds, o, inverse, best);
        int32_t near = left <= right ? 0 : 1;
        double last = near ? left : right, next = near ? right : left;
        if (last < best)
            begins[top] = last, stack[top++] = n->first + 1 - near;
        if (next < best)
            begins[top] = next, stack[top++] = n->first + near;
    }
    *out_t = best;
    *out_triangle = found;
}

static inline double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static double box_gap(const box *b, const double *p)
{
    double sum = 0.0;
    for (int a = 0; a < 3; a++) {
        double d = fmax(fmax(b->lo[a] - p[a], p[a] - b->hi[a]), 0.0);
        sum += d * d;
    }
    return sum;
}

// The squared distance from p of the segment that begins at v and goes along e.
static double segment_gap(const double *v, const double *e, const double *p)
{
    double w[3] = {p[0] - v[0], p[1] - v[1], p[2] - v[2]}, length = dot(e, e);
    double t = length > 0.0 ? fmin(fmax(dot(w, e) / length, 0.0), 1.0) : 0.0;
    double d[3] = {w[0] - t * e[0], w[1] - t * e[1], w[2] - t * e[2]};
    return dot(d, d);
}

// The squared distance from p of a triangle: of its plane where p lies above it, else of its nearest edge.
static double triangle_gap(const double *v, const double *p)
{
    const double *e = v + 3, *f = v + 6;
    double w[3] = {p[0] - v[0], p[1] - v[1], p[2] - v[2]};
    double ee = dot(e, e), ff = dot(f, f), ef = dot(e, f), we = dot(w, e), wf = dot(w, f), det = ee * ff - ef * ef;
    if (det > 0.0) {
        double s = (we * ff - wf * ef) / det, t = (wf * ee - we * ef) / det;
        if (s >= 0.0 && t >= 0.0 && s + t <= 1.0) {
            double d[3] = {w[0] - s * e[0] - t * f[0], w[1] - s * e[1] - t * f[1], w[2] - s * e[2] - t * f[2]};
            return dot(d, d);
        }
    }
    double b[3] = {v[0] + e[0], v[1] + e[1], v[2] + e[2]}, g[3] = {f[0] - e[0], f[1] - e[1], f[2] - e[2]};
    return fmin(fmin(segment_gap(v, e, p), segment_gap(v, f, p)), segment_gap(b, g, p));
}

static double nearest(const rays *r, const int32_t *part, const double *p, const int32_t *parts, int32_t each, double most)
{
    double best = most * most, gaps[2 * DEEPEST];
    int32_t stack[2 * DEEPEST], top = 0;
    gaps[top] = box_gap(&r->nodes[0].bounds, p);
    stack[top++] = 0;
    while (top > 0) {
        top--;
        if (!(gaps[top] < best))
            continue;
        const node *n = &r->nodes[stack[top]];
        if (n->count > 0) {
            for (int32_t i = n->first; i < n->first + n->count; i++) {
                int32_t own = part[r->number[i]], k = 0;
                while (k < each && parts[k] != own)
                    k++;
                if (k < each)
                    best = fmin(best, triangle_gap(r->triangle + 9 * (int64_t)i, p));
            }
            continue;
        }
        double left = box_gap(&r->nodes[n->first].bounds, p), right = box_gap(&r->nodes[n->first + 1].bounds, p);
        int32_t near = left <= right ? 0 : 1;
        gaps[top] = near ? left : right, stack[top++] = n->first + 1 - near;
        gaps[top] = near ? right : left, stack[top++] = n->first + near;
    }
    return sqrt(best);
}

typedef struct near_part {
    const rays *r;
    const int32_t *part, *parts;
    const double *place;
    int64_t begin, end;
    const double *most;
    double *distance;
    int32_t each;
} near_part;

static void *near_work(void *argument)
{
    const near_part *p = argument;
    for (int64_t i = p->begin; i < p->end; i++)
        p->distance[i] = nearest(p->r, p->part, p->place + 3 * i, p->parts + p->each * i, p->each, p->most[i]);
    return NULL;
}

int rays_nearest(const rays *r, const int32_t *part, const double *place, const int32_t *parts, int32_t each, int64_t n,
                 const double *most, double *distance, int32_t threads)
{
    pthread_t ids[MOST_THREADS];
    near_part pieces[MOST_THREADS];
    int failed = 0;
    threads = threads < 1 ? 1 : threads > MOST_THREADS ? MOST_THREADS : threads;
    for (int32_t i = 0; i < threads; i++)
        pieces[i] = (near_part){r, part, parts, place, n * i / threads, n * (i + 1) / threads, most, distance, each};
    int32_t started = 0;
    for (; started < threads - 1 && !failed; started += !failed)
        failed = pthread_create(&ids[started], NULL, near_work, &pieces[started]) != 0;
    if (!failed)
        near_work(&pieces[threads - 1]);
    for (int32_t i = 0; i < started; i++)
        pthread_join(ids[i], NULL);
    return failed ? -1 : 0;
}

typedef struct part {
    const rays *r;
    const double *origin, *direction;
    int64_t begin, end;
    int32_t shared;
    double *t;
    int32_t *triangle;
} part;

static void *work(void *argument)
{
    const part *p = argument;
    for (int64_t i = p->begin; i < p->end; i++)
        trace(p->r, p->origin + (p->shared ? 0 : 3 * i), p->direction + 3 * i, p->t + i, p->triangle + i);
    return NULL;
}

int rays_trace(const rays *r, const double *origin, int32_t shared_origin, const double *direction, int64_t n, double *t,
               int32_t *triangle, int32_t threads)
{
    pthread_t ids[MOST_THREADS];
    part parts[MOST_THREADS];
    int failed = 0;
    threads = threads < 1 ? 1 : threads > MOST_THREADS ? MOST_THREADS : threads;
    for (int32_t i = 0; i < threads; i++)
        parts[i] = (part){r, origin, direction, n * i / threads, n * (i + 1) / threads, shared_origin, t, triangle};
    int32_t started = 0;
    for (; started < threads - 1 && !failed; started += !failed)
        failed = pthread_create(&ids[started], NULL, work, &parts[started]) != 0;
    if (!failed)
        work(&parts[threads - 1]);
    for (int32_t i = 0; i < started; i++)
        pthread_join(ids[i], NULL);
    return failed ? -1 : 0;
}
