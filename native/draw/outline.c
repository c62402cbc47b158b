// SPDX-License-Identifier: GPL-3.0-or-later
#include "outline.h"

#include "patina/patina.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define STEEPNESS 6.0      // a step is larger than what the surface beside it changes in so many pixels
enum { SLOPE_PIXELS = 4 }; // over which that slope is taken. Points seen at a low angle make stairs of fewer pixels than that
enum { SMOOTH = 2 };       // neighbors on each side whose mean a vertex becomes

// ---- sides of pixels -----------------------------------------------------------------------------------------------------------

// The four neighbors of a pixel, counterclockwise from the right. The side towards neighbor k leads from the pixel's corner FROM[k] to the
// corner TO[k], so that the pixel is on its left.
static const int NEIGHBOR[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
static const int FROM[4][2] = {{1, 0}, {1, 1}, {0, 1}, {0, 0}};

// NaN beyond the border.
static double depth_at(const struct pt_depth_plane *plane, int64_t x, int64_t y)
{
    const int inside = x >= 0 && y >= 0 && x < plane->width && y < plane->height;
    return inside ? (double)plane->depth[(size_t)y * plane->width + (size_t)x] : (double)NAN;
}

// How much nearer the surface of a pixel becomes per pixel in a direction. NaN if nothing is there.
static double slope_at(const struct pt_depth_plane *plane, int64_t x, int64_t y, int dx, int dy)
{
    return (depth_at(plane, x + SLOPE_PIXELS * dx, y + SLOPE_PIXELS * dy) - depth_at(plane, x, y)) / SLOPE_PIXELS;
}

static int is_outline(const struct pt_depth_plane *plane, int64_t x, int64_t y, int k, double step)
{
    const int dx = NEIGHBOR[k][0], dy = NEIGHBOR[k][1];
    const int64_t fx = x + dx, fy = y + dy;
    const double own = depth_at(plane, x, y), other = depth_at(plane, fx, fy);
    if (!isfinite(own) || fx < 0 || fy < 0 || fx >= plane->width || fy >= plane->height)
        return 0;
    if (!isfinite(other))
        return 1;
    if (!(own - other > step))
        return 0;
    const double slope = fmin(slope_at(plane, x, y, -dx, -dy), -slope_at(plane, fx, fy, dx, dy)); // NaN if both are
    return !(own - other <= STEEPNESS * slope);
}

static double between(double value, double one, double other, double step) // the farther of both, or the value
{
    const double far = fmin(one, other), near = fmax(one, other);
    return value - far > step && near - value > step ? far : value;
}

int pt_depth_sharpen(struct pt_depth_plane *plane, double step)
{
    const size_t row = (size_t)plane->width * sizeof(float);
    float *above = malloc(row), *own = malloc(row); // as they were; rows from the top
    if (!above || !own) {
        free(above);
        free(own);
        return PATINA_ERROR_MEMORY;
    }
    for (uint32_t y = plane->height; y-- > 0;) {
        float *to = plane->depth + (size_t)y * plane->width;
        const float *below = y > 0 ? to - plane->width : to;
        memcpy(own, to, row);
        for (uint32_t x = 0; x < plane->width; x++) {
            const double value = (double)own[x];
            double better = value;
            if (x > 0 && x + 1 < plane->width)
                better = between(value, (double)own[x - 1], (double)own[x + 1], step);
            if (better == value && y > 0 && y + 1 < plane->height)
                better = between(value, (double)above[x], (double)below[x], step);
            to[x] = (float)better;
        }
        float *kept = above;
        above = own;
        own = kept;
    }
    free(above);
    free(own);
    return PATINA_OK;
}

// A measured pixel of the same surface is within the radius, in pixels.
static int is_supported(const struct pt_depth_plane *plane, int64_t x, int64_t y, double step, double radius)
{
    const int64_t reach = (int64_t)radius;
    const double own = depth_at(plane, x, y);
    for (int64_t dy = -reach; dy <= reach; dy++)
        for (int64_t dx = -reach; dx <= reach; dx++)
            if ((double)(dx * dx + dy * dy) <= radius * radius && fabs(depth_at(plane, x + dx, y + dy) - own) <= step &&
                plane->measured[(size_t)(y + dy) * plane->width + (size_t)(x + dx)])
                return 1;
    return 0;
}

// The distance behind the farthest outline around a pixel; its own if there is none.
static double depth_behind(const struct pt_depth_plane *plane, int64_t x, int64_t y, double step)
{
    double found = depth_at(plane, x, y);
    for (int k = 0; k < 4; k++)
        if (is_outline(plane, x, y, k, step)) {
            const double other = depth_at(plane, x + NEIGHBOR[k][0], y + NEIGHBOR[k][1]);
            found = isfinite(other) && isfinite(found) ? fmin(found, other) : (double)NAN;
        }
    return found;
}

int pt_depth_shrink(struct pt_depth_plane *plane, double step, double radius, uint32_t most)
{
    const size_t pixels = (size_t)plane->width * plane->height;
    float *next = plane->measured && most ? malloc(pixels * sizeof *next) : NULL;
    if (!next)
        return plane->measured && most ? PATINA_ERROR_MEMORY : PATINA_OK;
    for (uint32_t round = 0; round < most; round++) {
        for (size_t i = 0; i < pixels; i++) {
            const int64_t x = (int64_t)(i % plane->width), y = (int64_t)(i / plane->width);
            const double behind = depth_behind(plane, x, y, step);
            const int kept = behind == (double)plane->depth[i] || !isfinite(plane->depth[i]);
            next[i] = kept || is_supported(plane, x, y, step, radius / plane->pixel) ? plane->depth[i] : (float)behind;
        }
        memcpy(plane->depth, next, pixels * sizeof *next);
    }
    free(next);
    return PATINA_OK;
}

// ---- chains of sides -----------------------------------------------------------------------------------------------------------

struct tracing {
    const struct pt_depth_plane *plane;
    uint8_t *sides; // of each pixel, the lowest four bits: outlines that are not traced yet
    double *places; // of a chain: x, y and depth of the middle of each side
    size_t count, room;
};

static int add_side(struct tracing *t, int64_t x, int64_t y, int k)
{
    if (t->count == t->room) {
        const size_t room = t->room ? 2 * t->room : 1024;
        double *grown = realloc(t->places, 3 * room * sizeof *grown);
        if (!grown)
            return PATINA_ERROR_MEMORY;
        t->places = grown;
        t->room = room;
    }
    double *to = t->places + 3 * t->count++;
    to[0] = (double)x + 0.5 + 0.5 * NEIGHBOR[k][0];
    to[1] = (double)y + 0.5 + 0.5 * NEIGHBOR[k][1];
    to[2] = depth_at(t->plane, x, y);
    return PATINA_OK;
}

// Of the sides that begin at a corner (or end there), that whose pixel is about as near as `depth`. 0: there is none.
static int next_side(const struct tracing *t, int64_t cx, int64_t cy, int forward, double depth, int64_t *x, int64_t *y, int *k)
{
    double best = INFINITY;
    for (int i = 0; i < 4; i++) {
        const int *corner = forward ? FROM[i] : FROM[(i + 1) % 4];
        const int64_t px = cx - corner[0], py = cy - corner[1];
        if (px < 0 || py < 0 || px >= t->plane->width || py >= t->plane->height)
            continue;
        if (!(t->sides[(size_t)py * t->plane->width + (size_t)px] >> i & 1u))
            continue;
        const double off = fabs(depth_at(t->plane, px, py) - depth);
        if (off < best) {
            best = off;
            *x = px;
            *y = py;
            *k = i;
        }
    }
    return best < INFINITY;
}

// Follows sides from one on, forward or backward, until there is no next within a step.
static int follow(struct tracing *t, int64_t x, int64_t y, int k, int forward, double step)
{
    for (;;) {
        const int *corner = forward ? FROM[(k + 1) % 4] : FROM[k];
        const int64_t cx = x + corner[0], cy = y + corner[1];
        const double depth = depth_at(t->plane, x, y);
        if (!next_side(t, cx, cy, forward, depth, &x, &y, &k) || !(fabs(depth_at(t->plane, x, y) - depth) <= step))
            return PATINA_OK;
        t->sides[(size_t)y * t->plane->width + (size_t)x] &= (uint8_t) ~(1u << k);
        if (add_side(t, x, y, k))
            return PATINA_ERROR_MEMORY;
    }
}

static void reverse(struct tracing *t)
{
    for (size_t i = 0, j = t->count; i + 1 < j; i++) {
        double kept[3];
        j--;
        memcpy(kept, t->places + 3 * i, sizeof kept);
        memcpy(t->places + 3 * i, t->places + 3 * j, sizeof kept);
        memcpy(t->places + 3 * j, kept, sizeof kept);
    }
}

// Smooths a chain, and adds it as a line. A vertex moves by half a pixel at most.
static int add_line(const struct tracing *t, int closed, uint32_t layer, struct pt_lines *lines)
{
    const struct pt_depth_plane *plane = t->plane;
    struct pt_line line = {.layer = layer, .closed = closed, .spacing = plane->pixel};
    const int64_t count = (int64_t)t->count;
    for (int64_t i = 0; i < count; i++) {
        const double *own = t->places + 3 * i;
        const int64_t most = closed ? SMOOTH : i < count - 1 - i ? i : count - 1 - i; // ends stay
        const int64_t reach = most < SMOOTH ? most : SMOOTH;
        double mean[3] = {0.0, 0.0, 0.0};
        for (int64_t j = i - reach; j <= i + reach; j++)
            for (int c = 0; c < 3; c++)
                mean[c] += t->places[3 * ((j + count) % count) + c] / (double)(2 * reach + 1);
        const double away = pt_distance(mean, own), share = away > 0.5 ? 0.5 / away : 1.0;
        const double place[2] = {plane->pixel * (own[0] + share * (mean[0] - own[0]) - 0.5 * plane->width),
                                 plane->pixel * (own[1] + share * (mean[1] - own[1]) - 0.5 * plane->height)};
        if (pt_line_add(&line, place, 0)) {
            pt_line_free(&line);
            return PATINA_ERROR_MEMORY;
        }
        line.depth[i] = mean[2];
    }
    return pt_lines_add(lines, &line);
}

static int trace(struct tracing *t, double step, double least, uint32_t layer, struct pt_lines *lines)
{
    const struct pt_depth_plane *plane = t->plane;
    const size_t pixels = (size_t)plane->width * plane->height;
    for (size_t i = 0; i < pixels; i++)
        for (int k = 0; k < 4; k++) {
            if (!(t->sides[i] >> k & 1u))
                continue;
            const int64_t x = (int64_t)(i % plane->width), y = (int64_t)(i / plane->width);
            t->sides[i] &= (uint8_t) ~(1u << k);
            t->count = 0;
            if (add_side(t, x, y, k) || follow(t, x, y, k, 0, step))
                return PATINA_ERROR_MEMORY;
            reverse(t);
            if (follow(t, x, y, k, 1, step))
                return PATINA_ERROR_MEMORY;
            const double *last = t->places + 3 * (t->count - 1);
            const int closed = t->count > 3 && pt_distance(t->places, last) <= 1.0;
            if (plane->pixel * (double)t->count >= least && t->count > 2 * SMOOTH && add_line(t, closed, layer, lines))
                return PATINA_ERROR_MEMORY;
        }
    return PATINA_OK;
}

int pt_depth_outlines(const struct pt_depth_plane *plane, double step, double least, uint32_t layer, struct pt_lines *lines)
{
    struct tracing t = {.plane = plane};
    const size_t pixels = (size_t)plane->width * plane->height;
    t.sides = calloc(pixels, 1);
    if (!t.sides)
        return PATINA_ERROR_MEMORY;
    for (size_t i = 0; i < pixels; i++)
        for (int k = 0; k < 4; k++)
            if (is_outline(plane, (int64_t)(i % plane->width), (int64_t)(i / plane->width), k, step))
                t.sides[i] |= (uint8_t)(1u << k);
    const int error = trace(&t, step, least, layer, lines);
    free(t.sides);
    free(t.places);
    return error;
}
