// SPDX-License-Identifier: GPL-3.0-or-later
// Balls along a ray [S], in double: density by its closed form, pieces between two places where balls begin or end, front to back.
#include "reference.h"
#include "shared/balls.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

// From 0 to t of 1 - sqrt(t^2 + d^2).
static double primitive(double d, double t)
{
    const double q = sqrt(t * t + d * d);
    return t - 0.5 * (t * q + (d > 0.0 ? d * d * asinh(t / d) : 0.0));
}

double ref_soft_integral(double d, double from, double to) { return primitive(d, to) - primitive(d, from); }

static double shell_mu(uint32_t mu, double d, double radius, uint32_t shells)
{
    const double even = 1.0 / shells;
    return mu == PT_SOFT_EVEN ? even : mu == PT_SOFT_EQ13 ? even / radius : even / radius * (1.0 - d / radius);
}

double ref_soft_shells(uint32_t mu, uint32_t shells, double d, double from, double to)
{
    double sum = 0.0;
    for (uint32_t i = 0; i < shells; i++) {
        const double radius = 1.0 - (double)i / shells, half = sqrt(fmax(radius * radius - d * d, 0.0));
        if (d < radius)
            sum += shell_mu(mu, d, radius, shells) * fmax(fmin(to, half) - fmax(from, -half), 0.0);
    }
    return sum;
}

// Of a part of a ball in radii, at -ln(1 - a) = 1.
static double depth_of(const struct ref_ball *ball, const struct ref_soft_model *model, double from, double to)
{
    return model->model == PT_SOFT_BASE ? ref_soft_integral(ball->d, from, to)
                                        : ref_soft_shells(model->mu, ball->shells, ball->d, from, to) /
                                              ref_soft_shells(model->mu, ball->shells, 0.0, -1.0, 1.0);
}

static double ball_lambda(const struct ref_ball *ball) { return -log1p(-fmin(ball->a, (double)PT_SOFT_FULLEST)); }

double ref_soft_factor(const struct ref_ball *ball, const struct ref_soft_model *model)
{
    const double half = sqrt(fmax(1.0 - ball->d * ball->d, 0.0)),
                 whole = ball_lambda(ball) * depth_of(ball, model, -half, half);
    if (ball->w >= 1.0 || !(whole > 0.0))
        return 1.0;
    const double opacity = fmin(ball->a, (double)PT_SOFT_FULLEST) * (1.0 - ball->d) * (1.0 - ball->w) - expm1(-whole) * ball->w;
    return -log1p(-opacity) / whole;
}

static int compare(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

struct ref_soft ref_soft_ray(const struct ref_ball *balls, uint32_t count, const struct ref_soft_model *model, double from,
                             double to)
{
    struct ref_soft out = {.through = 1.0};
    double *ends = malloc((2 * (size_t)count + 1) * sizeof *ends);
    uint32_t places = 0;
    for (uint32_t i = 0; i < count && ends; i++) {
        const double half = balls[i].r * sqrt(fmax(1.0 - balls[i].d * balls[i].d, 0.0));
        const double begin = fmax(balls[i].along - half, from), end = fmin(balls[i].along + half, to);
        if (!(balls[i].d < 1.0) || !(begin < end))
            continue;
        ends[places++] = begin;
        ends[places++] = end;
        out.fragments++;
        out.density += (double)PT_SOFT_BALL / (balls[i].r * balls[i].r) *
                       ref_soft_integral(balls[i].d, (begin - balls[i].along) / balls[i].r,
                                         (end - balls[i].along) / balls[i].r);
    }
    qsort(ends, places, sizeof *ends, compare);
    for (uint32_t k = 0; k + 1 < places; k++) {
        double lost = 0.0, weights = 0.0, color[3] = {0.0};
        for (uint32_t i = 0; i < count; i++) {
            const struct ref_ball *b = &balls[i];
            const double half = sqrt(fmax(1.0 - b->d * b->d, 0.0));
            const double begin = fmax((ends[k] - b->along) / b->r, -half), end = fmin((ends[k + 1] - b->along) / b->r, half);
            const double middle = (0.5 * (ends[k] + ends[k + 1]) - b->along) / b->r;
            if (!(b->d < 1.0) || !(fabs(middle) < half) || !(begin < end))
                continue;
            const double weight = (1.0 - b->d) * b->a;
            lost += ref_soft_factor(b, model) * ball_lambda(b) * depth_of(b, model, begin, end);
            weights += weight;
            for (int c = 0; c < 3; c++)
                color[c] += weight * b->color[c];
        }
        const double part = out.through * -expm1(-lost);
        for (int c = 0; c < 3 && weights > 0.0; c++)
            out.color[c] += part * color[c] / weights;
        out.through *= exp(-lost);
    }
    free(ends);
    return out;
}

double ref_soft_disc(double square, double a, double w)
{
    const double q = fmin(square, 1.0), pi = 3.14159265358979323846;
    return a * ((1.0 - sqrt(q)) * (1.0 - w) + 0.5 * (cos(pi * sqrt(q)) + 1.0) * w);
}

static int nearer(const void *a, const void *b)
{
    const struct ref_ball *x = a, *y = b;
    return x->z != y->z ? (x->z > y->z) - (x->z < y->z) : (x->record > y->record) - (x->record < y->record);
}

struct ref_soft ref_soft_discs(struct ref_ball *balls, uint32_t count, double from, double to)
{
    struct ref_soft out = {.through = 1.0};
    qsort(balls, count, sizeof *balls, nearer);
    for (uint32_t i = 0; i < count; i++) {
        const struct ref_ball *b = &balls[i];
        if (!(b->square < 1.0) || !(from < b->z && b->z <= to))
            continue;
        const double opacity = ref_soft_disc(b->square, b->a, b->w);
        for (int c = 0; c < 3; c++)
            out.color[c] += out.through * opacity * b->color[c];
        out.through *= 1.0 - opacity;
        out.density += (double)PT_SOFT_DISC / (b->r * b->r) * ref_soft_disc(b->square, 1.0, 1.0);
        out.fragments++;
    }
    return out;
}

struct ref_soft ref_soft_splats(struct ref_ball *balls, uint32_t count, int one_layer, double from, double to)
{
    struct ref_soft out = {.through = 1.0};
    double end = 0.0, weights = 0.0, opacity = 0.0;
    qsort(balls, count, sizeof *balls, nearer);
    for (uint32_t i = 0; i < count; i++) {
        const struct ref_ball *b = &balls[i];
        if (!(b->square < 1.0) || !(from < b->z && b->z <= to))
            continue;
        const double weight = ref_soft_disc(b->square, 1.0, 1.0) + (double)PT_SOFT_RIM;
        out.density += (double)PT_SOFT_DISC / (b->r * b->r) * ref_soft_disc(b->square, 1.0, 1.0);
        end = weights > 0.0 ? end : b->z + b->r;
        if (b->z > end)
            continue;
        weights += weight;
        opacity += weight * b->a;
        for (int c = 0; c < 3; c++)
            out.color[c] += weight * b->color[c];
        out.fragments++;
    }
    const double alpha = !(weights > 0.0) ? 0.0 : one_layer ? opacity / weights : 1.0;
    for (int c = 0; c < 3 && weights > 0.0; c++)
        out.color[c] *= alpha / weights;
    out.through = 1.0 - alpha;
    return out;
}

struct ref_ball ref_ball_at(const struct soft_args *args, const uint32_t *records, uint32_t index, int x, int y)
{
    const struct view_args *view = &args->view;
    union {
        uint32_t word;
        float number;
    } words[PT_SOFT_WORDS];
    for (uint32_t k = 0; k < PT_SOFT_WORDS; k++)
        words[k].word = records[PT_SOFT_WORDS * index + k];
    struct ref_ball ball = {
        .record = index, .z = (double)words[2].number, .r = (double)words[3].number, .d = 2.0, .square = 2.0};
    if (!(ball.z <= FLT_MAX))
        return ball;
    for (int k = 0; k < 3; k++)
        ball.color[k] = (double)words[4 + k].number;
    ball.a = (double)(words[7].word >> PT_SOFT_SHIFT) / (double)PT_SOFT_STEPS;
    ball.w = (double)(words[7].word & 255u) / 255.0;
    const double px = view->origin_x + x + 0.5, py = view->origin_y + y + 0.5, xs = (double)view->ray_xs,
                 ys = (double)view->ray_ys;
    double u = 0.0, v = 0.0, scale = 1.0;
    if (view->perspective) {
        u = (double)view->ray_x0 + xs * px;
        v = (double)view->ray_y0 + ys * py;
        scale = ball.z;
    }
    // 1. the ball along the ray
    const double n = 1.0 + u * u + v * v, root = sqrt(n);
    const double ex = ((double)words[0].number - px * scale) * xs, ey = ((double)words[1].number - py * scale) * ys;
    const double across = ex * u + ey * v;
    ball.d = sqrt(fmax(ex * ex + ey * ey - across * across / n, 0.0)) / ball.r;
    ball.along = (ball.z * n + across) / root;
    // 2. the disc
    if (ball.z > 0.0 || !view->perspective) {
        const double X = (double)words[0].number / scale, Y = (double)words[1].number / scale;
        const double cu = view->perspective ? (double)view->ray_x0 + xs * X : 0.0,
                     cv = view->perspective ? (double)view->ray_y0 + ys * Y : 0.0;
        const double dx = (X - px) * xs, dy = (Y - py) * ys, slant = dx * cu + dy * cv;
        ball.square = (dx * dx + dy * dy - slant * slant / (1.0 + cu * cu + cv * cv)) * (scale / ball.r) * (scale / ball.r);
    }
    const double pixels = ball.z > 0.0 ? ball.r / ref_footprint(view, ball.z) : 1e9;
    ball.shells = args->shells ? args->shells
                               : (uint32_t)fmax(fmin(ceil(pixels / (double)PT_SOFT_RING), (double)PT_SOFT_SHELLS), 1.0);
    return ball;
}

struct ref_soft ref_soft(const struct soft_args *args, const uint32_t *records, int x, int y, double reached, double z)
{
    const struct view_args *view = &args->view;
    const struct ref_soft_model model = {args->model, args->mu};
    const double px = view->origin_x + x + 0.5, py = view->origin_y + y + 0.5;
    const double u = (double)view->ray_x0 + (double)view->ray_xs * px, v = (double)view->ray_y0 + (double)view->ray_ys * py;
    const double root = view->perspective ? sqrt(1.0 + u * u + v * v) : 1.0;
    double from = (double)args->z_from, to = args->layered == 2 ? (double)args->z_to : fmin((double)args->z_to, z);
    if (args->layered)
        from = fmax(from, reached);
    struct ref_ball *balls = calloc(args->records + 1, sizeof *balls);
    struct ref_soft out = {.through = 1.0};
    uint32_t count = 0;
    for (uint32_t i = 0; i < args->records && balls; i++) {
        balls[count] = ref_ball_at(args, records, i, x, y);
        count += balls[count].d < 1.5 || balls[count].square < 1.5;
    }
    if (balls && args->model >= PT_SOFT_SPLATS)
        out = ref_soft_splats(balls, count, args->model == PT_SOFT_ONE_LAYER, from, to);
    else if (balls && args->model == PT_SOFT_EXPRESS)
        out = ref_soft_discs(balls, count, from, to);
    else if (balls)
        out = ref_soft_ray(balls, count, &model, root * fmax(from, (double)view->z_near), root * to);
    free(balls);
    return out;
}

double ref_soft_veil(const struct soft_args *args, const uint32_t *records, int x, int y, double z)
{
    const struct view_args *view = &args->view;
    const struct ref_soft_model model = {args->model, args->mu};
    const double px = view->origin_x + x + 0.5, py = view->origin_y + y + 0.5;
    const double u = (double)view->ray_x0 + (double)view->ray_xs * px, v = (double)view->ray_y0 + (double)view->ray_ys * py;
    const double root = view->perspective ? sqrt(1.0 + u * u + v * v) : 1.0;
    const double from = fmax((double)args->z_from, (double)view->z_near), to = fmin((double)args->z_to, z);
    double sum = 0.0;
    for (uint32_t i = 0; i < args->records; i++) {
        const struct ref_ball ball = ref_ball_at(args, records, i, x, y);
        if (args->model == PT_SOFT_EXPRESS) {
            const double low = fmin(fmax((root * from - ball.along + ball.r) / (2.0 * ball.r), 0.0), 1.0),
                         high = fmin(fmax((root * to - ball.along + ball.r) / (2.0 * ball.r), 0.0), 1.0);
            if (ball.d < 1.0)
                sum -= log1p(-fmin(ref_soft_disc(ball.d * ball.d, ball.a, ball.w), (double)PT_SOFT_FULLEST)) *
                       fmax(high - low, 0.0);
        } else if (ball.d < 1.0 && from < to) {
            sum -= log(ref_soft_ray(&ball, 1, &model, root * from, root * to).through);
        }
    }
    return sum;
}
