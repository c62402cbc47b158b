// SPDX-License-Identifier: GPL-3.0-or-later
#include "join.h"
#include "near.h"

#include "patina/patina.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define TANGENT 8.0 // the last so many spacings of a line tell where it goes on,
#define TIP 1.0     // but for the very last, whose fits have samples on one side alone
#define BENT 0.25   // spacings: rms distance of these vertices from a straight line, above which half of them tell more
#define WALL 20.0   // the last so many spacings of a straight wall tell where its corner is,
#define TURNS 0.13  // unless both halves of them, without the last HALVES, have directions that differ by so much, radians
#define HALVES 4.0
#define ROUNDS 4  // of robust weights
#define OFF 3.5   // rms distances from the tangent at which a vertex has no weight, or is a hook,
#define HOOK 0.35 // but at least so many spacings
#define LONGEST_HOOK 4.0
#define AROUND 10.0   // spacings around an end whose samples tell its spacing
#define STRAIGHT 0.87 // cosine up to which two ends continue each other (30 degrees)
#define CLOSED 1.2    // half axis of a footprint, in spacings: a gap of two is closed
#define FARTHEST 4.8  // spacings: a gap of two more is bridged
#define COVERED 8.0   // spacings: a gap of straight walls that other samples cover is closed up to here
#define BACK 2.0      // spacings that a line is cut back at most
#define ASIDE 1.0     // spacings between two lines that continue each other

struct end {
    double place[2], out[2]; // out: unit, away from the line
    double spacing, rms;     // rms: distance of the line's vertices from the end's tangent
    uint32_t line;
    int tail; // 1: the end of the line's last vertex
    uint32_t match;
    int wall; // of corners: the line is straight there
};

struct match {
    uint32_t end[2];
    double cost, meeting[2];
    int corner, bridged;
};

struct joining {
    struct pt_lines *lines;
    struct end *ends, *corners; // corners: the same ends, as straight walls lead to a corner
    uint32_t end_count;
    struct match *matches;
    uint32_t match_count, match_room;
    uint32_t bridged;
    const struct pt_cut_samples *samples;
    struct pt_near tree; // of samples
    struct pt_lines out;
};

// The nth vertex from an end.
static const double *vertex(const struct pt_line *line, const struct end *end, uint32_t n)
{
    return line->at[end->tail ? line->count - 1 - n : n];
}

static double aside_of(const double at[2], const double on[2], const double along[2])
{
    return fabs((at[0] - on[0]) * along[1] - (at[1] - on[1]) * along[0]);
}

// Tukey's weight of a vertex, by its distance from a straight line. rms: infinite at first.
static double weight_of(const double at[2], const double on[2], const double along[2], double rms)
{
    if (!(rms > 0.0) || !isfinite(rms))
        return 1.0;
    const double t = aside_of(at, on, along) / (OFF * rms), left = 1.0 - t * t;
    return left > 0.0 ? left * left : 0.0;
}

// ---- ends --------------------------------------------------------------------------------------------------------------------

// The straight line through vertices at the end, by least squares; with more rounds, with robust weights: vertices that lead around a
// corner then have none. skipped and length: of the line, from its end. Returns the rms distance.
static double fit_end(const struct pt_line *line, double skipped, double length, int rounds, struct end *end)
{
    double mean[2] = {0.0, 0.0}, way = 0.0, rms = INFINITY;
    uint32_t count = 0, first = 0, n = 0;
    const uint32_t last = line->count - 1;
    for (; n <= last && (count < 2 || way < length); n++) {
        if (n)
            way += pt_distance(vertex(line, end, n), vertex(line, end, n - 1));
        if (way < skipped && last - n >= 3)
            continue;
        first = count ? first : n;
        count++;
    }
    for (int round = 0; round < rounds; round++) {
        double xx = 0.0, xy = 0.0, yy = 0.0, weight = 0.0, middle[2] = {0.0, 0.0}, weights;
        for (uint32_t i = first; i < n; i++) {
            weights = weight_of(vertex(line, end, i), mean, end->out, rms);
            weight += weights;
            for (int k = 0; k < 2; k++)
                middle[k] += weights * vertex(line, end, i)[k];
        }
        for (int k = 0; k < 2; k++)
            middle[k] /= weight;
        for (uint32_t i = first; i < n; i++) {
            const double *at = vertex(line, end, i), x = at[0] - middle[0], y = at[1] - middle[1];
            weights = weight_of(at, mean, end->out, rms);
            xx += weights * x * x;
            xy += weights * x * y;
            yy += weights * y * y;
        }
        const double half = 0.5 * (xx - yy), root = sqrt(half * half + xy * xy);
        const double d[2] = {half >= 0.0 ? half + root : xy, half >= 0.0 ? xy : root - half},
                     size = sqrt(d[0] * d[0] + d[1] * d[1]);
        for (int k = 0; k < 2; k++) {
            mean[k] = middle[k];
            end->out[k] = size > 0.0 ? d[k] / size : k == 0;
        }
        rms = sqrt(fmax(0.5 * (xx + yy) - root, 0.0) / weight);
    }
    double along = 0.0;
    for (int k = 0; k < 2; k++)
        along += end->out[k] * (vertex(line, end, 0)[k] - mean[k]);
    for (int k = 0; k < 2; k++) {
        end->place[k] = mean[k] + along * end->out[k];
        end->out[k] *= along < 0.0 ? -1.0 : 1.0;
    }
    return end->rms = rms;
}

// The mean scale of the line's samples around an end. A line's own is that of the place where it was begun, which may be denser.
static double spacing_at(const struct joining *j, const struct pt_line *line, const struct end *end)
{
    enum { MOST = 256 };
    uint32_t found[MOST], count = pt_near_find(&j->tree, vertex(line, end, 0), AROUND * line->spacing, found, MOST), own = 0;
    double sum = 0.0;
    count = count < MOST ? count : MOST;
    for (uint32_t i = 0; i < count; i++)
        if (j->samples->at[found[i]].owner == end->line + 1) {
            sum += (double)j->samples->at[found[i]].scale;
            own++;
        }
    return own ? sum / own : line->spacing;
}

// Cuts off the tip where it leads around a corner: its fits mistook samples of the other wall for their own.
static void cut_hook(struct pt_line *line, const struct end *end)
{
    const double band = fmax(OFF * end->rms, HOOK * end->spacing), longest = LONGEST_HOOK * end->spacing;
    uint32_t cut = 0;
    double way = 0.0;
    for (uint32_t n = 1; n + 3 < line->count && way < longest; n++) {
        way += pt_distance(vertex(line, end, n), vertex(line, end, n - 1));
        if (aside_of(vertex(line, end, n - 1), end->place, end->out) > band)
            cut = n;
    }
    if (!end->tail)
        pt_line_reverse(line);
    line->count -= cut;
    if (!end->tail)
        pt_line_reverse(line);
}

static void end_of(struct joining *j, uint32_t number, int tail, struct end *end)
{
    const struct pt_line *line = &j->lines->at[number];
    *end = (struct end){.line = number, .tail = tail, .match = UINT32_MAX};
    end->spacing = fmax(spacing_at(j, line, end), line->spacing);
    if (fit_end(line, TIP * end->spacing, TANGENT * end->spacing, 1, end) > BENT * end->spacing)
        fit_end(line, 0.0, 0.5 * TANGENT * end->spacing, 1, end);
}

// The same end as a straight wall leads to its corner, if it is one: a longer stretch tells that better.
static void corner_of(const struct pt_line *line, const struct end *end, struct end *corner)
{
    const double spacing = end->spacing, length = fmin(pt_line_length(line), WALL * spacing),
                 middle = 0.5 * (HALVES * spacing + length);
    struct end wall = *end, near = *end, far = *end;
    wall.wall = 1;
    *corner = *end;
    if (length < 0.5 * WALL * spacing)
        return;
    fit_end(line, HALVES * spacing, middle, 1, &near);
    fit_end(line, middle, length, 1, &far);
    if (fabs(near.out[0] * far.out[1] - near.out[1] * far.out[0]) < TURNS &&
        fit_end(line, TIP * spacing, length, ROUNDS, &wall) <= BENT * spacing)
        *corner = wall;
}

static int make_ends(struct joining *j)
{
    j->ends = malloc((2 * (size_t)j->lines->count + 1) * sizeof *j->ends);
    j->corners = malloc((2 * (size_t)j->lines->count + 1) * sizeof *j->corners);
    if (!j->ends || !j->corners)
        return PATINA_ERROR_MEMORY;
    for (uint32_t i = 0; i < j->lines->count; i++)
        for (int tail = 0; tail < 2 && !j->lines->at[i].closed; tail++) {
            end_of(j, i, tail, &j->ends[j->end_count]);
            corner_of(&j->lines->at[i], &j->ends[j->end_count], &j->corners[j->end_count]);
            j->end_count++;
        }
    return PATINA_OK;
}

// ---- matches -----------------------------------------------------------------------------------------------------------------

// Whether footprints cover all of the way between two places.
static int is_covered(const struct joining *j, const double a[2], const double b[2], double spacing)
{
    enum { MOST = 64 };
    uint32_t found[MOST];
    const uint32_t steps = (uint32_t)(pt_distance(a, b) / (0.5 * spacing)) + 1;
    for (uint32_t i = 0; i <= steps; i++) {
        const double t = (double)i / steps, at[2] = {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])};
        uint32_t count = pt_near_find(&j->tree, at, 2.0 * spacing, found, MOST);
        int covered = 0;
        count = count < MOST ? count : MOST;
        for (uint32_t k = 0; k < count && !covered; k++)
            covered = pt_distance(at, j->samples->at[found[k]].place) <=
                      fmax((double)j->samples->at[found[k]].reach, CLOSED * spacing);
        if (!covered)
            return 0;
    }
    return 1;
}

// Whether two ends continue each other. 1: fills the match.
static int continues(const struct joining *j, const struct end *a, const struct end *b, double farthest, struct match *m)
{
    const double spacing = 0.5 * (a->spacing + b->spacing), x = b->place[0] - a->place[0], y = b->place[1] - a->place[1];
    const double t[2] = {a->out[0] - b->out[0], a->out[1] - b->out[1]}, length = sqrt(t[0] * t[0] + t[1] * t[1]);
    const double gap = (x * t[0] + y * t[1]) / length, aside = fabs(x * t[1] - y * t[0]) / length;
    if (!(aside <= ASIDE * spacing) || gap < -1.75 * BACK * spacing || gap > farthest * spacing)
        return 0;
    *m = (struct match){.cost = fabs(gap) / spacing, .corner = 0};
    m->bridged = gap > 2.0 * CLOSED * spacing && !is_covered(j, a->place, b->place, spacing);
    return !m->bridged || gap <= FARTHEST * spacing;
}

// Whether two ends continue each other, or meet at a corner. 1: fills the match.
static int meet(const struct joining *j, uint32_t first, uint32_t second, struct match *m)
{
    const struct end *a = &j->corners[first], *b = &j->corners[second];
    const double farthest = a->wall && b->wall ? COVERED : FARTHEST;
    if (-(a->out[0] * b->out[0] + a->out[1] * b->out[1]) > STRAIGHT)
        return continues(j, &j->ends[first], &j->ends[second], farthest, m) || continues(j, a, b, farthest, m);
    const double spacing = 0.5 * (a->spacing + b->spacing), x = b->place[0] - a->place[0], y = b->place[1] - a->place[1];
    const double turned = a->out[0] * b->out[1] - a->out[1] * b->out[0];
    if (fabs(turned) < 0.2) // both lead the same way
        return 0;
    const double p = (x * b->out[1] - y * b->out[0]) / turned, q = (x * a->out[1] - y * a->out[0]) / turned;
    if (p < -BACK * a->spacing || q < -BACK * b->spacing || p > farthest * a->spacing || q > farthest * b->spacing)
        return 0;
    *m = (struct match){.cost = (fabs(p) + fabs(q)) / spacing,
                        .meeting = {a->place[0] + p * a->out[0], a->place[1] + p * a->out[1]},
                        .corner = 1};
    m->bridged = (p > CLOSED * a->spacing && !is_covered(j, a->place, m->meeting, spacing)) ||
                 (q > CLOSED * b->spacing && !is_covered(j, b->place, m->meeting, spacing));
    return !m->bridged || (p <= FARTHEST * a->spacing && q <= FARTHEST * b->spacing);
}

static int add_match(struct joining *j, const struct match *match)
{
    if (j->match_count == j->match_room) {
        const uint32_t room = j->match_room ? 2 * j->match_room : 64;
        struct match *grown = j->match_room < UINT32_MAX / 4 ? realloc(j->matches, room * sizeof *grown) : NULL;
        if (!grown)
            return PATINA_ERROR_MEMORY;
        j->matches = grown;
        j->match_room = room;
    }
    j->matches[j->match_count++] = *match;
    return PATINA_OK;
}

static int compare_matches(const void *a, const void *b)
{
    const struct match *x = a, *y = b;
    if (x->bridged != y->bridged)
        return x->bridged - y->bridged;
    if (x->cost != y->cost)
        return (x->cost > y->cost) - (x->cost < y->cost);
    if (x->end[0] != y->end[0])
        return x->end[0] > y->end[0] ? 1 : -1;
    return (x->end[1] > y->end[1]) - (x->end[1] < y->end[1]);
}

// Each end takes the cheapest of its matches whose other end is free, too.
static int match_ends(struct joining *j)
{
    enum { MOST = 64 };
    struct pt_near tree;
    uint32_t found[MOST];
    int error = pt_near_create(&tree, j->ends, sizeof *j->ends, j->end_count);
    for (uint32_t i = 0; i < j->end_count && !error; i++) {
        const double radius = 1.5 * COVERED * j->ends[i].spacing;
        uint32_t count = pt_near_find(&tree, j->ends[i].place, radius, found, MOST);
        count = count < MOST ? count : MOST;
        for (uint32_t k = 0; k < count && !error; k++) {
            struct match match;
            if (found[k] == i || !meet(j, i, found[k], &match))
                continue;
            match.end[0] = i;
            match.end[1] = found[k];
            error = add_match(j, &match);
        }
    }
    pt_near_destroy(&tree);
    if (j->match_count)
        qsort(j->matches, j->match_count, sizeof *j->matches, compare_matches);
    for (uint32_t i = 0; i < j->match_count; i++) {
        struct end *a = &j->ends[j->matches[i].end[0]], *b = &j->ends[j->matches[i].end[1]];
        if (a->match == UINT32_MAX && b->match == UINT32_MAX)
            a->match = b->match = i;
    }
    return error;
}

// ---- joining -----------------------------------------------------------------------------------------------------------------

// Ends the line at a corner: cuts off what is beyond it, and the tip, which fits bend towards the other wall.
static int lead_to(struct pt_line *line, const struct end *end, const double corner[2])
{
    cut_hook(line, end);
    if (!end->tail)
        pt_line_reverse(line);
    if (pt_line_length(line) > 2.0 * TANGENT * line->spacing)
        pt_line_trim(line, TIP * line->spacing);
    while (line->count > 1) {
        const double *tip = line->at[line->count - 1];
        if ((tip[0] - corner[0]) * end->out[0] + (tip[1] - corner[1]) * end->out[1] <= 0.0)
            break;
        line->count--;
    }
    const int error = pt_line_add(line, corner, 1);
    if (!end->tail)
        pt_line_reverse(line);
    return error;
}

static void fix_end(struct joining *j, const struct end *end)
{
    struct pt_line *line = &j->lines->at[end->line];
    const uint32_t tip = end->tail ? line->count - 1 : 0;
    memcpy(line->at[tip], end->place, sizeof *line->at);
    line->fixed[tip] = 1;
}

static int add_bridge(struct joining *j, const struct match *m)
{
    const struct end *a = &j->ends[m->end[0]], *b = &j->ends[m->end[1]];
    fix_end(j, a);
    fix_end(j, b);
    struct pt_line line = {.layer = j->bridged, .spacing = a->spacing};
    int error = pt_line_add(&line, a->place, 1);
    if (!error && m->corner)
        error = pt_line_add(&line, m->meeting, 1);
    if (!error)
        error = pt_line_add(&line, b->place, 1);
    if (!error)
        return pt_lines_add(&j->out, &line);
    pt_line_free(&line);
    return error;
}

static void shorten(struct joining *j, const struct end *end, double length)
{
    struct pt_line *line = &j->lines->at[end->line];
    if (!end->tail)
        pt_line_reverse(line);
    pt_line_trim(line, length);
    if (!end->tail)
        pt_line_reverse(line);
}

// Moves ends to where they meet.
static int move_ends(struct joining *j)
{
    int error = PATINA_OK;
    for (uint32_t i = 0; i < j->match_count && !error; i++) {
        const struct match *m = &j->matches[i];
        struct end *a = &j->ends[m->end[0]], *b = &j->ends[m->end[1]];
        if (a->match != i || b->match != i)
            continue;
        if (m->bridged) {
            error = add_bridge(j, m);
            a->match = b->match = UINT32_MAX;
        } else if (m->corner) {
            error = lead_to(&j->lines->at[a->line], &j->corners[m->end[0]], m->meeting);
            if (!error)
                error = lead_to(&j->lines->at[b->line], &j->corners[m->end[1]], m->meeting);
        } else {
            const double x = b->place[0] - a->place[0], y = b->place[1] - a->place[1];
            const double overlap = -(x * a->out[0] + y * a->out[1]);
            if (overlap > 0.0) {
                shorten(j, a, 0.5 * overlap);
                shorten(j, b, 0.5 * overlap);
            }
        }
    }
    return error;
}

// Follows matches from one end of a line to the last line. first: the end that the walk enters a line at.
static int chain(struct joining *j, const uint32_t (*end_of_line)[2], uint8_t *done, uint32_t first)
{
    struct pt_line joined = {.spacing = j->lines->at[j->ends[first].line].spacing,
                             .layer = j->lines->at[j->ends[first].line].layer};
    uint32_t entry = first;
    int error = PATINA_OK;
    for (;;) {
        const struct end *in = &j->ends[entry];
        struct pt_line *line = &j->lines->at[in->line];
        done[in->line] = 1;
        if (in->tail)
            pt_line_reverse(line);
        const double *last = joined.count ? joined.at[joined.count - 1] : NULL;
        if (last && line->count && !memcmp(last, line->at[0], sizeof *line->at))
            joined.count--; // the corner of both
        error = pt_line_append(&joined, line);
        const struct end *out = &j->ends[end_of_line[in->line][!in->tail]];
        if (error || out->match == UINT32_MAX)
            break;
        const struct match *m = &j->matches[out->match];
        entry = &j->ends[m->end[0]] == out ? m->end[1] : m->end[0];
        if (done[j->ends[entry].line]) {
            joined.closed = 1;
            if (joined.count > 2 && !memcmp(joined.at[0], joined.at[joined.count - 1], sizeof *joined.at))
                joined.count--;
            break;
        }
    }
    if (!error)
        return pt_lines_add(&j->out, &joined);
    pt_line_free(&joined);
    return error;
}

static int chain_all(struct joining *j)
{
    const uint32_t count = j->lines->count;
    uint8_t *done = calloc(count + 1, 1);
    uint32_t(*end_of_line)[2] = malloc((count + 1) * sizeof *end_of_line);
    int error = done && end_of_line ? PATINA_OK : PATINA_ERROR_MEMORY;
    for (uint32_t i = 0; i < j->end_count && !error; i++)
        end_of_line[j->ends[i].line][j->ends[i].tail] = i;
    for (uint32_t i = 0; i < count && !error; i++)
        if (j->lines->at[i].closed) {
            done[i] = 1;
            error = pt_lines_add(&j->out, &j->lines->at[i]);
        }
    for (int loops = 0; loops < 2 && !error; loops++) // first those that begin at a free end
        for (uint32_t i = 0; i < j->end_count && !error; i++)
            if (!done[j->ends[i].line] && (loops || j->ends[i].match == UINT32_MAX))
                error = chain(j, (const uint32_t(*)[2])end_of_line, done, i);
    free(done);
    free(end_of_line);
    return error;
}

int pt_join_lines(const struct pt_cut_samples *samples, struct pt_lines *lines, uint32_t bridged)
{
    struct joining j = {.lines = lines, .bridged = bridged, .samples = samples};
    int error = pt_near_create(&j.tree, samples->at, sizeof *samples->at, samples->count);
    if (!error)
        error = make_ends(&j);
    if (!error)
        error = match_ends(&j);
    if (!error)
        error = move_ends(&j);
    if (!error)
        error = chain_all(&j);
    pt_near_destroy(&j.tree);
    free(j.ends);
    free(j.corners);
    free(j.matches);
    if (error) {
        pt_lines_free(&j.out);
        return error;
    }
    pt_lines_free(lines);
    *lines = j.out;
    return PATINA_OK;
}
