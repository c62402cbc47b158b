// SPDX-License-Identifier: GPL-3.0-or-later
#include "trace.h"
#include "base/compare.h"
#include "fit.h"
#include "base/pool.h"
#include "base/progress.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define STEP 0.5         // of a walk, in scales
#define TURN 0.45        // tangent of the angle by which a line turns at most in a step
#define JUMP 0.6         // scales by which it moves aside at most in a step, and half a sigma
#define OVERLAP 1.5      // scales that a line is cut back where another's samples begin
#define ROUGH 0.5        // rms distance of what is no line any more, in scales, and 1.5 sigmas
#define BESIDE 1.5       // samples that a line takes up lie no farther from it, in bands
#define LEAST_LENGTH 4.0 // of a line, in scales
#define LEAST_SAMPLES 6
#define LEAST_DENSITY 0.2 // of a line's samples, as a share of what a surface has in the slab
#define FULL 20.0         // weight of a fit that is as good as can be: on a wall, all around
#define DOUBTFUL 0.7      // quality below which a sample tries the directions of others,
#define ADOPTED 48        // of at most so many,
#define UNLIKE 0.966      // whose cosine with those that were tried is less (15 degrees)
#define RECENT 16         // steps after which a line that meets its own samples goes around in a circle

struct tracer {
    struct pt_cut_samples *samples;
    struct pt_near tree;
    patina_progress *progress;
    struct pt_fit *fits; // one per thread
    uint32_t line;       // number of the present one, from 1 on
    uint32_t taken;      // samples that it took up, and
    uint32_t *took;      // their numbers
    struct pt_cut_sample *seed;
    struct pt_lines *lines;
};

static int is_rough(const struct pt_curve *curve) { return curve->rms > ROUGH * curve->scale + 1.5 * curve->sigma; }

// ---- the line through each sample ----------------------------------------------------------------------------------------

// Turns the direction by a curve's slope at the place.
static void turn(double direction[2], double slope)
{
    const double x = direction[0] - slope * direction[1], y = direction[1] + slope * direction[0], length = sqrt(x * x + y * y);
    direction[0] = x / length;
    direction[1] = y / length;
}

struct refined {
    double normal[2];
    float quality;
};

struct refining {
    struct tracer *tracer;
    struct refined *out;
};

// Fits a curve at the sample along a direction, and turns the direction to it. Returns how good it is, 0: there is none.
static double quality_along(struct pt_fit *fit, const struct pt_cut_sample *s, double direction[2])
{
    struct pt_curve curve;
    for (int k = 0; k < 2; k++) {
        if (pt_fit_curve(fit, s->place, direction, (double)s->scale, &curve) || is_rough(&curve) || fabs(curve.slope) > 1.0)
            return 0.0;
        turn(direction, curve.slope);
    }
    const double aside = fabs(curve.offset) / fmax(curve.band, 3.0 * curve.sigma);
    return fmin(curve.weight / FULL, 1.0) * fmax(1.0 - aside, 0.0) * fmax(1.0 - fabs(curve.bend) * curve.scale, 0.0);
}

// The direction of the best line nearby that the sample is on, for samples at corners, whose own normals face between both walls.
static double adopt(struct tracer *t, struct pt_fit *fit, const struct pt_cut_sample *s, double direction[2])
{
    enum { TRIES = 6 };
    uint32_t found[ADOPTED], tries = 0;
    uint32_t count = pt_near_find(&t->tree, s->place, 2.5 * (double)s->scale, found, ADOPTED);
    double best = 0.0, tried[TRIES][2];
    count = count < ADOPTED ? count : ADOPTED;
    for (uint32_t i = 0; i < count && tries < TRIES; i++) {
        const struct pt_cut_sample *other = &t->samples->at[found[i]];
        double along[2] = {other->normal[1], -other->normal[0]};
        int known = !(other->quality > 0.0f);
        for (uint32_t k = 0; k < tries && !known; k++)
            known = fabs(along[0] * tried[k][0] + along[1] * tried[k][1]) > UNLIKE;
        if (known)
            continue;
        memcpy(tried[tries++], along, sizeof along);
        const double quality = quality_along(fit, s, along);
        if (quality > best) {
            best = quality;
            memcpy(direction, along, sizeof along);
        }
    }
    return best;
}

// The normal of the curve around each sample, which is less noisy than the sample's own and is on one side of a corner.
static void refine(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct refining *refining = context;
    struct tracer *t = refining->tracer;
    for (uint32_t i = begin; i < end && !pt_progress_cancelled(t->progress); i++) {
        const struct pt_cut_sample *s = &t->samples->at[i];
        double direction[2] = {s->normal[1], -s->normal[0]}, other[2] = {0.0, 0.0};
        const int known = direction[0] != 0.0 || direction[1] != 0.0;
        double quality = known ? quality_along(&t->fits[thread], s, direction) : 0.0;
        if (quality < DOUBTFUL && s->quality >= 0.0f) { // the second time: others' are known
            const double adopted = adopt(t, &t->fits[thread], s, other);
            if (adopted > 1.2 * quality) {
                quality = adopted;
                memcpy(direction, other, sizeof other);
            }
        }
        const int found = quality > 0.0;
        refining->out[i].normal[0] = found ? -direction[1] : s->normal[0];
        refining->out[i].normal[1] = found ? direction[0] : s->normal[1];
        refining->out[i].quality = (float)quality;
    }
}

// The noise around a sample, from the narrowest band that holds a quarter of its neighbors. The analysis takes both faces of a thin board
// for one noisy surface; its sigma is returned where neighbors are few or it is less.
static double noise_of(const struct tracer *t, const struct pt_cut_sample *s)
{
    enum { MOST = 256 };
    const double direction[2] = {s->normal[1], -s->normal[0]}, reach = 2.5 * (double)s->spacing + (double)s->sigma;
    uint32_t found[MOST], count = 0;
    double aside[MOST], narrowest = INFINITY;
    uint32_t all = pt_near_find(&t->tree, s->place, reach, found, MOST);
    all = all < MOST ? all : MOST;
    for (uint32_t i = 0; i < all; i++) {
        const struct pt_cut_sample *other = &t->samples->at[found[i]];
        const double x = other->place[0] - s->place[0], y = other->place[1] - s->place[1];
        if (fabs(other->normal[0] * s->normal[0] + other->normal[1] * s->normal[1]) > 0.7)
            aside[count++] = y * direction[0] - x * direction[1];
    }
    if (count < 16)
        return (double)s->sigma;
    qsort(aside, count, sizeof *aside, pt_compare_doubles);
    for (uint32_t i = 0; i + count / 4 < count; i++)
        narrowest = fmin(narrowest, aside[i + count / 4] - aside[i]);
    return fmin((double)s->sigma, 2.7 * narrowest); // 0.637 sigmas of a normal distribution, and less of few samples
}

static void measure_noise(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct refining *refining = context;
    (void)thread;
    for (uint32_t i = begin; i < end; i++) {
        const struct pt_cut_sample *s = &refining->tracer->samples->at[i];
        refining->out[i].quality = 2.0f * s->sigma > s->spacing ? (float)noise_of(refining->tracer, s) : s->sigma;
    }
}

static void correct_noise(struct refining *refining, struct pt_pool *pool)
{
    const struct pt_cut_samples *samples = refining->tracer->samples;
    pt_parallel(pool, samples->count, 64, measure_noise, refining);
    for (uint32_t i = 0; i < samples->count; i++) {
        struct pt_cut_sample *s = &samples->at[i];
        s->sigma = refining->out[i].quality;
        s->scale = (float)fmax((double)s->spacing, PT_SCALE_SIGMAS * (double)s->sigma);
    }
}

static int refine_all(struct tracer *t, struct pt_pool *pool)
{
    const uint32_t count = t->samples->count;
    struct refining refining = {t, malloc((count + 1) * sizeof *refining.out)};
    if (!refining.out)
        return PATINA_ERROR_MEMORY;
    for (uint32_t i = 0; i < count; i++)
        t->samples->at[i].quality = -1.0f;
    correct_noise(&refining, pool);
    for (int round = 0; round < 2 && !pt_progress_cancelled(t->progress); round++) {
        pt_parallel(pool, count, 64, refine, &refining);
        for (uint32_t i = 0; i < count; i++) {
            struct pt_cut_sample *s = &t->samples->at[i];
            const double *n = refining.out[i].normal, side = n[0] * s->normal[0] + n[1] * s->normal[1] < 0.0 ? -1.0 : 1.0;
            s->normal[0] = side * n[0]; // on the side that its slope is meant for
            s->normal[1] = side * n[1];
            s->quality = refining.out[i].quality;
        }
    }
    free(refining.out);
    return pt_progress_cancelled(t->progress) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}

// ---- walking -----------------------------------------------------------------------------------------------------------------

struct walk {
    double place[2], direction[2], scale;
    int forward;    // 1, or -1: against the seed's direction
    uint32_t steps; // so far
    struct pt_curve curve;
    double ahead; // how far samples of the line reach beyond the place
};

enum standing { SUPPORTED, UNSUPPORTED, TAKEN };

// What the inliers around the fitted place say: whether a footprint covers it, and whether the line is another's already.
static enum standing stand(const struct tracer *t, struct walk *walk)
{
    const struct pt_fit *fit = &t->fits[0];
    uint32_t fresh = 0, others = 0;
    int covered = 0;
    walk->ahead = -INFINITY;
    for (uint32_t i = 0; i < fit->count; i++) {
        const struct pt_cut_sample *s = &t->samples->at[fit->number[i]];
        if (fabs(fit->residual[i]) > walk->curve.band)
            continue;
        const double u = fit->u[i];
        covered |= fabs(u) <= (double)s->reach;
        if (u < 2.0 * (double)s->reach)
            walk->ahead = fmax(walk->ahead, u);
        if (fabs(u) > walk->scale)
            continue;
        const int32_t now = walk->forward * (int32_t)walk->steps, age = abs(now - (int32_t)s->stamp);
        const int old = s->owner && (s->owner != t->line || age > RECENT);
        others += old != 0;
        fresh += !old;
    }
    return others > 2 * fresh ? TAKEN : covered ? SUPPORTED : UNSUPPORTED;
}

// The line takes up the samples around its present place.
static void take(struct tracer *t, const struct walk *walk)
{
    const struct pt_fit *fit = &t->fits[0];
    const double band = fmax(BESIDE * walk->curve.band, 0.4 * walk->scale);
    for (uint32_t i = 0; i < fit->count; i++) {
        struct pt_cut_sample *s = &t->samples->at[fit->number[i]];
        if (fabs(fit->u[i]) > STEP * 1.2 * walk->scale || fabs(fit->residual[i]) > band || s->owner)
            continue;
        s->owner = t->line;
        s->stamp = (uint32_t)(walk->forward * (int32_t)walk->steps);
        t->took[t->taken++] = fit->number[i];
    }
}

// Fits the curve at the place and moves onto it. 0, or -1 if there is none.
static int settle(struct tracer *t, struct walk *walk)
{
    struct pt_curve *curve = &walk->curve;
    if (pt_fit_curve(&t->fits[0], walk->place, walk->direction, walk->scale, curve) || is_rough(curve) ||
        fabs(curve->slope) > TURN || fabs(curve->offset) > JUMP * walk->scale + 0.5 * curve->sigma)
        return -1;
    return 0;
}

static void move_onto(struct walk *walk)
{
    const double offset = walk->curve.offset;
    walk->place[0] -= offset * walk->direction[1];
    walk->place[1] += offset * walk->direction[0];
    turn(walk->direction, walk->curve.slope);
}

// Whether a walk is at its start again. back: the way from there; begun: the direction there.
static int is_back(const double back[2], const double begun[2], double step, const struct walk *walk)
{
    const double along = back[0] * begun[0] + back[1] * begun[1], aside = back[1] * begun[0] - back[0] * begun[1];
    return fabs(along) <= 0.5 * step && fabs(aside) <= 0.5 * walk->scale + walk->curve.sigma &&
           walk->direction[0] * begun[0] + walk->direction[1] * begun[1] > 0.8;
}

// Walks until samples end, or back to the seed: returns 1 then. -1: out of memory.
static int walk_on(struct tracer *t, struct walk *walk, struct pt_line *line)
{
    const double start[2] = {walk->place[0], walk->place[1]}, begun[2] = {walk->direction[0], walk->direction[1]};
    double way = 0.0;
    for (walk->steps = 1; walk->steps < 1u << 30; walk->steps++) {
        struct walk next = *walk;
        const double step = STEP * walk->scale;
        for (int k = 0; k < 2; k++)
            next.place[k] += step * next.direction[k];
        if (settle(t, &next))
            break;
        const enum standing standing = stand(t, &next);
        if (standing != SUPPORTED) {
            walk->ahead = standing == TAKEN ? -OVERLAP * walk->scale : walk->ahead;
            break;
        }
        take(t, &next);
        move_onto(&next);
        next.scale = next.curve.scale;
        *walk = next;
        way += step;
        const double back[2] = {walk->place[0] - start[0], walk->place[1] - start[1]};
        if (walk->forward > 0 && way > 4.0 * walk->scale && is_back(back, begun, step, walk))
            return 1;
        if (pt_line_add(line, walk->place, 0))
            return -1;
        if (pt_progress_cancelled(t->progress))
            break;
    }
    return 0;
}

// The line ends where its samples do, and half of a gap behind the last of them.
static int finish_end(const struct walk *walk, struct pt_line *line)
{
    if (line->count < 2 || !isfinite(walk->ahead))
        return PATINA_OK;
    const double more = fmin(walk->ahead + 0.2 * walk->scale, walk->scale);
    if (more < 0.0)
        pt_line_trim(line, -more);
    if (more <= 0.0)
        return PATINA_OK;
    return pt_line_add(
        line, (const double[2]){walk->place[0] + more * walk->direction[0], walk->place[1] + more * walk->direction[1]}, 0);
}

static int is_good(const struct tracer *t, const struct pt_line *line)
{
    const double length = pt_line_length(line), spacing = line->spacing;
    const double thickness = fmin(t->samples->thickness, 3.0 * spacing);
    const double expected = length * thickness / (spacing * spacing);
    return line->count > 2 && length >= LEAST_LENGTH * spacing && t->taken >= LEAST_SAMPLES &&
           t->taken >= LEAST_DENSITY * expected;
}

// Traces the line through a sample, both ways.
static int trace(struct tracer *t, struct pt_cut_sample *seed)
{
    struct pt_line line = {0}, behind = {0};
    struct walk walk = {.place = {seed->place[0], seed->place[1]},
                        .direction = {seed->normal[1], -seed->normal[0]},
                        .scale = (double)seed->scale,
                        .forward = 1};
    t->taken = 0;
    t->line = t->lines->count + 1;
    for (int i = 0; i < 3; i++) {
        if (settle(t, &walk))
            return PATINA_OK;
        if (i < 2)
            move_onto(&walk);
    }
    if (stand(t, &walk) != SUPPORTED)
        return PATINA_OK;
    take(t, &walk);
    struct walk back = walk;
    int error = pt_line_add(&line, walk.place, 0);
    line.spacing = walk.curve.scale;
    const int closed = error ? 0 : walk_on(t, &walk, &line);
    if (closed == 0 && !error) {
        error = finish_end(&walk, &line);
        back.forward = -1;
        back.direction[0] = -back.direction[0];
        back.direction[1] = -back.direction[1];
        if (!error)
            error = pt_line_add(&behind, back.place, 0);
        if (!error && walk_on(t, &back, &behind) < 0)
            error = PATINA_ERROR_MEMORY;
        if (!error)
            error = finish_end(&back, &behind);
        pt_line_reverse(&line); // the seed is its last vertex, and the first of the other half
        line.count--;
        if (!error)
            error = pt_line_append(&line, &behind);
    }
    line.closed = closed > 0;
    pt_line_free(&behind);
    if (closed < 0)
        error = PATINA_ERROR_MEMORY;
    if (!error && is_good(t, &line))
        return pt_lines_add(t->lines, &line);
    for (uint32_t i = 0; i < t->taken; i++)
        t->samples->at[t->took[i]].owner = 0;
    pt_line_free(&line);
    return error;
}

// ---- seeds -------------------------------------------------------------------------------------------------------------------

struct seed {
    float quality;
    uint32_t number;
};

static int compare_seeds(const void *a, const void *b)
{
    const struct seed *x = a, *y = b;
    return x->quality != y->quality ? (x->quality < y->quality) - (x->quality > y->quality)
                                    : (x->number > y->number) - (x->number < y->number);
}

static int trace_all(struct tracer *t)
{
    const uint32_t count = t->samples->count;
    struct seed *seeds = malloc((count + 1) * sizeof *seeds);
    int error = seeds ? PATINA_OK : PATINA_ERROR_MEMORY;
    for (uint32_t i = 0; i < count && seeds; i++)
        seeds[i] = (struct seed){t->samples->at[i].quality, i};
    if (seeds)
        qsort(seeds, count, sizeof *seeds, compare_seeds);
    for (uint32_t i = 0; i < count && !error && seeds[i].quality > 0.0f; i++) {
        struct pt_cut_sample *seed = &t->samples->at[seeds[i].number];
        if (!seed->owner)
            error = trace(t, seed);
        if (pt_progress_cancelled(t->progress))
            error = PATINA_ERROR_CANCELLED;
    }
    free(seeds);
    return error;
}

int pt_trace_lines(struct pt_cut_samples *samples, uint32_t threads, patina_progress *progress, struct pt_lines *lines)
{
    struct tracer t = {.samples = samples, .progress = progress, .lines = lines};
    if (!samples->count)
        return PATINA_OK;
    struct pt_pool *pool = pt_pool_create(pt_pool_threads_for(threads, samples->count), 0);
    int error = pool ? pt_near_create(&t.tree, samples->at, sizeof *samples->at, samples->count) : PATINA_ERROR_MEMORY;
    const uint32_t workers = pool ? pt_pool_threads(pool) : 0;
    t.fits = calloc(workers + 1, sizeof *t.fits);
    t.took = malloc((samples->count + 1) * sizeof *t.took);
    if (!error && (!t.fits || !t.took))
        error = PATINA_ERROR_MEMORY;
    for (uint32_t i = 0; i < workers && !error; i++) {
        t.fits[i].samples = samples;
        t.fits[i].tree = &t.tree;
    }
    if (!error)
        error = refine_all(&t, pool);
    if (!error)
        error = trace_all(&t);
    free(t.fits);
    free(t.took);
    pt_near_destroy(&t.tree);
    pt_pool_destroy(pool);
    return error;
}
