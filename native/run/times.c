// SPDX-License-Identifier: GPL-3.0-or-later
#include "times.h"

#include <string.h>
#include <time.h>

double pt_milliseconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return 1e3 * (double)now.tv_sec + 1e-6 * (double)now.tv_nsec;
}

void pt_note_time(struct pt_times *times, const char *name, double ms)
{
    uint32_t i = 0;
    while (i < times->count && strcmp(times->each[i].name, name) != 0)
        i++;
    if (i == PT_TIMINGS)
        return;
    if (i == times->count)
        times->each[times->count++] = (struct pt_timing){ .name = name };
    times->each[i].ms += ms;
}
