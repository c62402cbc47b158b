// SPDX-License-Identifier: GPL-3.0-or-later
#include "places.h"
#include "base/compare.h"
#include "base/error.h"

#include <stdlib.h>

enum { LOOKS = 64, AMONG = 1 << 17, NEAREST = 6, MIDDLE = 1023 };

int pt_places_check(const char *call, const char *what, struct pt_places *places)
{
    if (!places->count)
        return PATINA_OK;
    if (!places->array.data)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "%s: there are no positions of %s", call, what);
    if (places->count > PT_MOST_PLACES)
        return pt_fail(NULL, PATINA_ERROR_TOO_MANY_POINTS, "%s: %llu points of %s are more than 2^31 - 1", call,
                       (unsigned long long)places->count, what);
    for (int k = 0; k < 3; k++)
        if (!isfinite(places->shift[k]))
            return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "%s: the origin of %s is not finite", call, what);
    return pt_check_array(&places->array, what, 1u << PATINA_FLOAT32 | 1u << PATINA_FLOAT64, 3, 3);
}

// Squared distance from p to its sixth nearest among every step-th point, nearest in `least`. Points at the same place do not count.
static void look(const struct pt_places *places, uint64_t step, const double p[3], double least[NEAREST])
{
    for (int i = 0; i < NEAREST; i++)
        least[i] = INFINITY;
    for (uint64_t i = 0; i < places->count; i += step) {
        double q[3], square = 0;
        if (!pt_place(places, i, q))
            continue;
        for (int k = 0; k < 3; k++)
            square += (q[k] - p[k]) * (q[k] - p[k]);
        if (!(square < least[NEAREST - 1]) || !(square > 0))
            continue;
        int at = NEAREST - 1;
        for (; at > 0 && least[at - 1] > square; at--)
            least[at] = least[at - 1];
        least[at] = square;
    }
}

double pt_places_spacing(const struct pt_places *places)
{
    const uint64_t step = (places->count + AMONG - 1) / AMONG, some = step ? (places->count + step - 1) / step : 0;
    double found[LOOKS];
    int count = 0;
    for (uint64_t i = 0; i < LOOKS && i < some; i++) {
        double p[3], least[NEAREST];
        if (!pt_place(places, (some < LOOKS ? i : i * some / LOOKS) * step, p))
            continue;
        look(places, step, p, least);
        int k = NEAREST;
        while (k > 0 && !isfinite(least[k - 1]))
            k--;
        if (k > 0)
            found[count++] = sqrt(least[k - 1] * 3.14159265358979 / k);
    }
    if (!count)
        return 0.0;
    qsort(found, (size_t)count, sizeof *found, pt_compare_doubles);
    return found[count / 2] / sqrt((double)step);
}

int pt_places_middle(const struct pt_places *places, double middle[3])
{
    const uint64_t step = (places->count + MIDDLE - 1) / MIDDLE;
    double *sorted = malloc(3 * sizeof *sorted * MIDDLE), p[3];
    uint32_t count = 0;
    for (uint64_t i = 0; i < places->count && sorted; i += step)
        if (pt_place(places, i, p)) {
            for (int k = 0; k < 3; k++)
                sorted[k * MIDDLE + (int)count] = p[k];
            count++;
        }
    for (uint64_t i = 0; i < places->count && sorted && !count; i++) // none of the sample
        if (pt_place(places, i, p)) {
            for (int k = 0; k < 3; k++)
                sorted[k * MIDDLE] = p[k];
            count = 1;
        }
    for (int k = 0; k < 3 && count; k++) {
        qsort(sorted + k * MIDDLE, count, sizeof *sorted, pt_compare_doubles);
        middle[k] = 0.5 * (sorted[k * MIDDLE + (int)(count / 20)] + sorted[k * MIDDLE + (int)(count - 1 - count / 20)]);
    }
    free(sorted);
    return count > 0;
}

int pt_places_box(const struct pt_places *places, double low[3], double high[3])
{
    int any = 0;
    for (int k = 0; k < 3; k++) {
        low[k] = INFINITY;
        high[k] = -INFINITY;
    }
    for (uint64_t i = 0; i < places->count; i++) {
        double p[3];
        if (!pt_place(places, i, p))
            continue;
        any = 1;
        for (int k = 0; k < 3; k++) {
            low[k] = fmin(low[k], p[k]);
            high[k] = fmax(high[k], p[k]);
        }
    }
    return any;
}
