// SPDX-License-Identifier: GPL-3.0-or-later
// Positions finer than float32: the origin that keeps them, and the box.
#include "file.h"
#include "base/compare.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLES = PT_ORIGIN_SAMPLES };

// float32 may move a coordinate by this part of the cloud's size. A half step of float32 is 6e-8 of the number, so a
// cloud around zero never needs an origin; 1 km at 5,000,000 m (half a step: 0.25 m) does.
static const double allowed_loss = 1e-7;
// Beyond this an origin in whole units is itself not exact.
static const double largest_origin = 1e15;

// Up to SAMPLES finite positions, evenly spread over the file, one array an axis, each sorted.
static uint32_t sample(const double *staged, uint64_t count, double axes[3][SAMPLES])
{
    uint64_t step = (count + SAMPLES - 1) / SAMPLES;
    uint32_t n = 0;
    for (uint64_t i = 0; i < count && n < SAMPLES; i += step) {
        const double *p = staged + 3 * i;
        if (!isfinite(p[0]) || !isfinite(p[1]) || !isfinite(p[2]))
            continue;
        for (int axis = 0; axis < 3; axis++)
            axes[axis][n] = p[axis];
        n++;
    }
    for (int axis = 0; axis < 3; axis++)
        qsort(axes[axis], n, sizeof(double), pt_compare_doubles);
    return n;
}

// The rule: take the middle half of the sample on each axis (a survey often holds stray points at zero, which say
// nothing about where it lies). Where float32 would move one of these coordinates by more than allowed_loss of their
// box's diagonal, the origin is the median, rounded down to whole units; else it is zero.
void pt_file_choose_origin(const double *staged, uint64_t count, double origin[3])
{
    memset(origin, 0, 3 * sizeof(double));
    double(*axes)[SAMPLES] = malloc(3 * sizeof *axes);
    if (!axes)
        return; // float32 as it is: worse, but no reason to give up the file
    uint32_t n = sample(staged, count, axes);
    uint32_t first = n / 4, last = n - 1 - n / 4;
    double loss = 0, square = 0;
    for (int axis = 0; n && axis < 3; axis++) {
        double width = axes[axis][last] - axes[axis][first];
        square += width * width;
        for (uint32_t i = first; i <= last; i++)
            loss = fmax(loss, fabs((double)(float)axes[axis][i] - axes[axis][i]));
    }
    if (n && loss > allowed_loss * sqrt(square)) {
        for (int axis = 0; axis < 3; axis++) {
            double middle = floor(axes[axis][n / 2]);
            origin[axis] = fabs(middle) <= largest_origin ? middle : 0;
        }
    }
    free(axes);
}

void pt_file_place(struct patina_file *file, double *staged)
{
    double origin[3];
    pt_file_choose_origin(staged, file->count, origin);
    pt_file_place_at(file, staged, origin);
}

void pt_file_place_at(struct patina_file *file, double *staged, const double origin[3])
{
    // In place: float i is written where double i / 2 was, which has been read. Bytes, so that no compiler may reorder.
    unsigned char *bytes = (unsigned char *)staged;
    for (uint64_t i = 0; i < 3 * file->count; i++) {
        double wide;
        memcpy(&wide, bytes + sizeof wide * i, sizeof wide);
        float narrow = (float)(wide - origin[i % 3]);
        memcpy(bytes + sizeof narrow * i, &narrow, sizeof narrow);
    }
    for (int axis = 0; axis < 3; axis++)
        file->origin[axis] += origin[axis];
    float *shrunk = realloc(staged, file->count ? 3 * sizeof(float) * file->count : 1);
    file->position = shrunk ? shrunk : (float *)(void *)staged;
}

void pt_file_measure(struct patina_file *file)
{
    float low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    uint64_t invalid = 0;
    for (uint64_t i = 0; i < file->count; i++) {
        const float *p = file->position + 3 * i;
        if (!(fabsf(p[0]) <= FLT_MAX && fabsf(p[1]) <= FLT_MAX && fabsf(p[2]) <= FLT_MAX)) {
            invalid++;
            continue;
        }
        for (int axis = 0; axis < 3; axis++) {
            low[axis] = p[axis] < low[axis] ? p[axis] : low[axis];
            high[axis] = p[axis] > high[axis] ? p[axis] : high[axis];
        }
    }
    file->invalid_positions = invalid;
    for (int axis = 0; axis < 3; axis++) {
        file->box_min[axis] = file->origin[axis] + (double)low[axis];
        file->box_max[axis] = file->origin[axis] + (double)high[axis];
    }
}
