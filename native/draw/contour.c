// SPDX-License-Identifier: GPL-3.0-or-later
#include "contour.h"

#include "patina/patina.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// ---- simplification ----------------------------------------------------------------------------------------------------------

static double distance_from(const double p[2], const double a[2], const double b[2])
{
    const double x = b[0] - a[0], y = b[1] - a[1], square = x * x + y * y;
    double t = square > 0.0 ? ((p[0] - a[0]) * x + (p[1] - a[1]) * y) / square : 0.0;
    t = fmin(fmax(t, 0.0), 1.0);
    return pt_distance(p, (const double[2]){a[0] + t * x, a[1] + t * y});
}

struct range {
    uint32_t first, last;
};

// Marks the vertices between two kept ones that must stay. stack: room for as many ranges as there are vertices.
static void keep_between(double (*at)[2], uint32_t first, uint32_t last, double tolerance, uint8_t *kept, struct range *stack)
{
    uint32_t depth = 0;
    stack[depth++] = (struct range){first, last};
    while (depth) {
        const struct range r = stack[--depth];
        double most = tolerance;
        uint32_t farthest = 0;
        for (uint32_t i = r.first + 1; i < r.last; i++) {
            const double d = distance_from(at[i], at[r.first], at[r.last]);
            if (d > most) {
                most = d;
                farthest = i;
            }
        }
        if (!farthest)
            continue;
        kept[farthest] = 1;
        stack[depth++] = (struct range){r.first, farthest};
        stack[depth++] = (struct range){farthest, r.last};
    }
}

struct knot { // a kept vertex of the simplified line, in one coordinate: diagonal, right of it, right side
    double diagonal, next, side[2];
};

// The least-squares polyline with vertices at the kept ones' arc lengths: one tridiagonal system, of which fixed vertices are known.
static void balance(const struct pt_line *line, const uint32_t *kept, uint32_t count, const double *along, struct knot *knots,
                    double (*out)[2])
{
    for (uint32_t k = 0; k < count; k++)
        knots[k] = (struct knot){0};
    for (uint32_t k = 0; k + 1 < count; k++) {
        const double from = along[kept[k]], span = fmax(along[kept[k + 1]] - from, 1e-30);
        for (uint32_t i = kept[k]; i <= kept[k + 1]; i++) {
            const double b = (along[i] - from) / span, a = 1.0 - b;
            const double before = i > kept[k] ? along[i] - along[i - 1] : 0.0;
            const double after = i < kept[k + 1] ? along[i + 1] - along[i] : 0.0, w = 0.5 * (before + after);
            knots[k].diagonal += w * a * a;
            knots[k].next += w * a * b;
            knots[k + 1].diagonal += w * b * b;
            for (int c = 0; c < 2; c++) {
                knots[k].side[c] += w * a * line->at[i][c];
                knots[k + 1].side[c] += w * b * line->at[i][c];
            }
        }
    }
    for (uint32_t k = 0; k < count; k++) {
        const uint32_t i = kept[k];
        if (!line->fixed[i] && !(line->closed && (k == 0 || k + 1 == count)))
            continue;
        for (int c = 0; c < 2; c++) { // known: its equation is x = value, and it moves to the others' right sides
            if (k > 0)
                knots[k - 1].side[c] -= knots[k - 1].next * line->at[i][c];
            if (k + 1 < count)
                knots[k + 1].side[c] -= knots[k].next * line->at[i][c];
            knots[k].side[c] = line->at[i][c];
        }
        if (k > 0)
            knots[k - 1].next = 0.0;
        knots[k].next = 0.0;
        knots[k].diagonal = 1.0;
    }
    for (uint32_t k = 1; k < count; k++) {
        const double share = knots[k - 1].diagonal > 0.0 ? knots[k - 1].next / knots[k - 1].diagonal : 0.0;
        knots[k].diagonal -= share * knots[k - 1].next;
        for (int c = 0; c < 2; c++)
            knots[k].side[c] -= share * knots[k - 1].side[c];
    }
    for (uint32_t k = count; k-- > 0;)
        for (int c = 0; c < 2; c++) {
            const double right = k + 1 < count ? knots[k].next * out[k + 1][c] : 0.0;
            out[k][c] = knots[k].diagonal > 0.0 ? (knots[k].side[c] - right) / knots[k].diagonal : line->at[kept[k]][c];
        }
}

struct simplifying {
    uint8_t *kept;
    struct range *stack;
    uint32_t *number;
    double *along;
    struct knot *knots;
    double (*moved)[2];
};

// Of an open line. room: for its vertices.
static void simplify_open(struct pt_line *line, double tolerance, struct simplifying *s)
{
    const uint32_t last = line->count - 1;
    uint32_t count = 0, from = 0;
    memset(s->kept, 0, line->count);
    s->kept[0] = s->kept[last] = 1;
    for (uint32_t i = 1; i <= last; i++)
        if (line->fixed[i] || i == last) {
            s->kept[i] = 1;
            keep_between(line->at, from, i, tolerance, s->kept, s->stack);
            from = i;
        }
    s->along[0] = 0.0;
    for (uint32_t i = 1; i <= last; i++)
        s->along[i] = s->along[i - 1] + pt_distance(line->at[i], line->at[i - 1]);
    for (uint32_t i = 0; i <= last; i++)
        if (s->kept[i])
            s->number[count++] = i;
    balance(line, s->number, count, s->along, s->knots, s->moved);
    for (uint32_t k = 0; k < count; k++) {
        const uint32_t i = s->number[k];
        const double away = pt_distance(s->moved[k], line->at[i]);
        memcpy(line->at[k], away <= 2.0 * tolerance ? s->moved[k] : line->at[i],
               sizeof *line->at); // k <= i: none is overwritten
        line->depth[k] = line->depth[i];
        line->fixed[k] = line->fixed[i];
    }
    line->count = count;
}

// A closed line begins at a fixed vertex, or else anywhere; its first vertex is repeated at its end meanwhile.
static int open_up(struct pt_line *line)
{
    uint32_t first = 0;
    while (first < line->count && !line->fixed[first])
        first++;
    struct pt_line turned = {.layer = line->layer, .closed = 1, .spacing = line->spacing};
    const uint32_t from = first < line->count ? first : 0;
    for (uint32_t i = 0; i <= line->count; i++) {
        const uint32_t k = (from + i) % line->count;
        if (pt_line_add(&turned, line->at[k], line->fixed[k])) {
            pt_line_free(&turned);
            return PATINA_ERROR_MEMORY;
        }
        turned.depth[i] = line->depth[k];
    }
    pt_line_free(line);
    *line = turned;
    return PATINA_OK;
}

int pt_line_simplify(struct pt_line *line, double tolerance)
{
    if (line->count < 3 || !(tolerance > 0.0))
        return PATINA_OK;
    const int closed = line->closed;
    if (closed && open_up(line))
        return PATINA_ERROR_MEMORY;
    const size_t count = line->count;
    struct simplifying s = {malloc(count),
                            malloc((count + 1) * sizeof *s.stack),
                            malloc(count * sizeof *s.number),
                            malloc(count * sizeof *s.along),
                            malloc(count * sizeof *s.knots),
                            malloc(count * sizeof *s.moved)};
    const int good = s.kept && s.stack && s.number && s.along && s.knots && s.moved;
    if (good) {
        simplify_open(line, tolerance, &s);
        line->count -= closed != 0; // the first vertex again
    }
    free(s.kept);
    free(s.stack);
    free(s.number);
    free(s.along);
    free(s.knots);
    free(s.moved);
    return good ? PATINA_OK : PATINA_ERROR_MEMORY;
}

// ---- clipping ----------------------------------------------------------------------------------------------------------------

// The part [t0, t1] of a step within the rectangle (Liang and Barsky 1984). 0: there is none.
static int clip_step(const double a[2], const double b[2], const double half[2], double *t0, double *t1)
{
    *t0 = 0.0;
    *t1 = 1.0;
    for (int k = 0; k < 2; k++) {
        const double d = b[k] - a[k];
        if (d == 0.0) {
            if (fabs(a[k]) > half[k])
                return 0;
            continue;
        }
        const double enter = ((d > 0.0 ? -half[k] : half[k]) - a[k]) / d, leave = ((d > 0.0 ? half[k] : -half[k]) - a[k]) / d;
        *t0 = fmax(*t0, enter);
        *t1 = fmin(*t1, leave);
    }
    return *t0 < *t1;
}

static int is_inside(const struct pt_line *line, const double half[2])
{
    for (uint32_t i = 0; i < line->count; i++)
        if (fabs(line->at[i][0]) > half[0] || fabs(line->at[i][1]) > half[1])
            return 0;
    return 1;
}

static double between(double a, double b, double t) { return t <= 0.0 ? a : t >= 1.0 ? b : a + t * (b - a); }

// Adds the place at t between two vertices to a part of their line.
static int add_between(const struct pt_line *line, uint32_t i, uint32_t j, double t, int fixed, struct pt_line *part)
{
    const double *a = line->at[i], *b = line->at[j];
    const double place[2] = {between(a[0], b[0], t), between(a[1], b[1], t)};
    if (pt_line_add(part, place, fixed))
        return PATINA_ERROR_MEMORY;
    part->depth[part->count - 1] = between(line->depth[i], line->depth[j], t);
    return PATINA_OK;
}

static int finish(struct pt_lines *out, struct pt_line *part)
{
    if (part->count > 1)
        return pt_lines_add(out, part);
    pt_line_free(part);
    return PATINA_OK;
}

static int clip_line(const struct pt_line *line, const double half[2], struct pt_lines *out)
{
    struct pt_line part = {.layer = line->layer, .spacing = line->spacing};
    const struct pt_line blank = part;
    const uint32_t steps = line->closed ? line->count : line->count - 1;
    int error = PATINA_OK;
    for (uint32_t i = 0; i < steps && !error; i++) {
        const uint32_t j = (i + 1) % line->count;
        double t0, t1;
        if (!clip_step(line->at[i], line->at[j], half, &t0, &t1)) {
            error = finish(out, &part);
            part = blank;
            continue;
        }
        if (!part.count)
            error = add_between(line, i, j, t0, 1, &part);
        if (!error)
            error = add_between(line, i, j, t1, t1 < 1.0 || line->fixed[j], &part);
        if (!error && t1 < 1.0) {
            error = finish(out, &part);
            part = blank;
        }
    }
    if (!error)
        return finish(out, &part);
    pt_line_free(&part);
    return error;
}

int pt_lines_clip(struct pt_lines *lines, const double half[2])
{
    struct pt_lines out = {0};
    int error = PATINA_OK;
    for (uint32_t i = 0; i < lines->count && !error; i++) {
        struct pt_line *line = &lines->at[i];
        if (line->count < 2)
            continue;
        error = is_inside(line, half) ? pt_lines_add(&out, line) : clip_line(line, half, &out);
    }
    pt_lines_free(error ? &out : lines);
    if (!error)
        *lines = out;
    return error;
}
