// SPDX-License-Identifier: GPL-3.0-or-later
// For qsort: numbers in ascending order. Of structures the first member decides.
#ifndef PT_COMPARE_H
#define PT_COMPARE_H

#include <stdint.h>

static inline int pt_compare_floats(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static inline int pt_compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static inline int pt_compare_u64(const void *a, const void *b)
{
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

#endif
