// SPDX-License-Identifier: GPL-3.0-or-later
// What stations looked through (shared/filling.h, reopen_args), in float64: open where the cells, faces or ranges that float32 may take
// disagree.
#include "reference.h"
#include "tolerances.h"
#include "shared/filling.h"

#include <math.h>
#include <string.h>

static enum ref_truth agreed(enum ref_truth a, enum ref_truth b) { return a == b ? a : REF_UNSURE; }

static enum ref_truth either(enum ref_truth a, enum ref_truth b)
{
    return a == REF_YES || b == REF_YES ? REF_YES : a == REF_UNSURE || b == REF_UNSURE ? REF_UNSURE : REF_NO;
}

// Range up to which a cell says that the station looked; 0: it says nothing.
static double range_of(const struct station_args *station, const uint32_t *words, uint32_t face, double x, double y)
{
    const double last = station->across - 1.0;
    const uint32_t column = (uint32_t)fmin(fmax(x, 0.0), last), row = (uint32_t)fmin(fmax(y, 0.0), last);
    const uint32_t at = station->first + (face * station->across + row) * station->across + column;
    const uint32_t value = words[at / 2] / (at % 2 ? 65536 : 1) % 65536, bits = value * 4096 + station->base;
    float range;
    memcpy(&range, &bits, sizeof range);
    return value ? (double)range : 0.0;
}

static enum ref_truth on_face(const struct station_args *station, const uint32_t *words, const double q[3], int axis)
{
    const double along = fabs(q[axis]), length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]);
    const double u = q[(axis + 1) % 3] / along, v = q[(axis + 2) % 3] / along, half = 0.5 * station->across;
    const double slack = TOL_SIGHT * station->across;
    enum ref_truth found = REF_UNSURE;
    for (int k = 0; k < 4; k++) {
        const double x = (1.25 * u - 0.25 * u * u * u + 1.0) * half + (k % 2 ? slack : -slack);
        const double y = (1.25 * v - 0.25 * v * v * v + 1.0) * half + (k / 2 ? slack : -slack);
        const double range = range_of(station, words, (uint32_t)(2 * axis + (q[axis] < 0.0)), x, y);
        const double most = length * sqrt((double)station->grow);
        const enum ref_truth here = isinf(range) && length < 1e18       ? REF_YES
                                    : !(range > most * (1 - TOL_SIGHT)) ? REF_NO
                                    : range > most * (1 + TOL_SIGHT)    ? REF_YES
                                                                        : REF_UNSURE;
        found = k ? agreed(found, here) : here;
    }
    return found;
}

static enum ref_truth by_station(const struct station_args *station, const uint32_t *words, const double q[3])
{
    const double most = fmax(fmax(fabs(q[0]), fabs(q[1])), fabs(q[2]));
    enum ref_truth found = REF_NO;
    int faces = 0;
    if (!(most > PT_SIGHT_LEAST && most < PT_SIGHT_FARTHEST) || isnan(q[0] + q[1] + q[2]))
        return REF_NO;
    for (int axis = 0; axis < 3; axis++) {
        if (fabs(q[axis]) < most * (1 - 2 * TOL_SIGHT))
            continue;
        const enum ref_truth here = on_face(station, words, q, axis);
        found = faces++ ? agreed(found, here) : here;
    }
    return found;
}

enum ref_truth ref_seen_through(const struct reopen_args *args, const struct station_args *stations, const uint32_t *words,
                                int x, int y, double z)
{
    const struct ref_ray ray = ref_ray(&args->view, x, y);
    const double depth = args->view.perspective ? z : 1.0, back = args->view.perspective ? z : z + (double)args->eye_z;
    enum ref_truth found = REF_NO;
    for (uint32_t s = 0; s < args->stations; s++) {
        double q[3], cancelled = 0.0, size = 0.0;
        for (int k = 0; k < 3; k++) {
            const double terms[4] = {stations[s].eye[k], args->rows[3 * k] * ray.u * depth,
                                     args->rows[3 * k + 1] * ray.v * depth, -args->rows[3 * k + 2] * back};
            q[k] = terms[0] + terms[1] + terms[2] + terms[3];
            for (int i = 0; i < 4; i++)
                cancelled = fmax(cancelled, fabs(terms[i]));
            size = fmax(size, fabs(q[k]));
        }
        enum ref_truth here = by_station(&stations[s], words, q);
        if (size < 0.05 * cancelled) // so near to the station that rounding turns the direction
            here = REF_UNSURE;
        found = either(found, here);
    }
    return found;
}

int ref_closed(const struct reopen_args *args, const struct ref_planes *planes, int x, int y)
{
    const size_t width = args->view.width, at = (size_t)y * width + (size_t)x;
    const uint32_t id = ref_key_id(planes->keys[at]), from = planes->from[at] & ~PT_FROM_MIXED;
    if (isinf(ref_key_z(planes->keys[at])) || id - args->id_base - args->id_first >= args->id_count)
        return 0;
    if (from == at)
        return args->discs && planes->away[at] > 4.0f;
    const double dx = (double)(from % width) - x, dy = (double)(from / width) - y;
    const float left = args->discs ? 4.0f - planes->away[from] : 4.0f; // as float32 has it
    return left <= 0.0f || dx * dx + dy * dy > (double)(left * left);
}
