// SPDX-License-Identifier: GPL-3.0-or-later
#include "times.h"

#include <string.h>

// NULL: there are too many names.
static struct pt_timing *find(struct pt_times *times, const char *name)
{
    uint32_t i = 0;
    while (i < times->count && strcmp(times->each[i].name, name) != 0)
        i++;
    if (i == PT_TIMINGS)
        return NULL;
    if (i == times->count)
        times->each[times->count++] = (struct pt_timing){.name = name};
    return &times->each[i];
}

void pt_note_time(struct pt_times *times, const char *name, double ms)
{
    struct pt_timing *timing = find(times, name);
    if (timing)
        timing->ms += ms;
}

void pt_note_work(struct pt_times *times, const char *name, uint64_t bytes, const struct pt_counts *counts)
{
    struct pt_timing *timing = find(times, name);
    if (!timing)
        return;
    timing->bytes += bytes;
    timing->counts.dispatches += counts->dispatches;
    timing->counts.empty += counts->empty;
    timing->counts.barriers += counts->barriers;
    timing->counts.calls += counts->calls;
    timing->counts.copies += counts->copies;
    timing->counts.waits += counts->waits;
    timing->counts.uploaded += counts->uploaded;
    timing->counts.steps += counts->steps;
}
