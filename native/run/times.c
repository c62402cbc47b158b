// SPDX-License-Identifier: GPL-3.0-or-later
#include "times.h"

#include <string.h>

void pt_note_time(struct pt_times *times, const char *name, double ms)
{
    uint32_t i = 0;
    while (i < times->count && strcmp(times->each[i].name, name) != 0)
        i++;
    if (i == PT_TIMINGS)
        return;
    if (i == times->count)
        times->each[times->count++] = (struct pt_timing){.name = name};
    times->each[i].ms += ms;
}
