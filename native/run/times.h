// SPDX-License-Identifier: GPL-3.0-or-later
// What passes of a render took, by the names that statistics know them by.
#ifndef PT_TIMES_H
#define PT_TIMES_H

#include "device.h"

enum { PT_TIMINGS = PT_KERNEL_COUNT + 5 };

struct pt_timing {
    const char *name;
    double ms;
    uint64_t bytes;          // that its passes read and write, by the plan
    struct pt_counts counts; // what they asked of the device
};

struct pt_times {
    struct pt_timing each[PT_TIMINGS];
    uint32_t count;
    uint64_t bytes; // that passes read and write, by the plan: each of their buffers whole
};

void pt_note_time(struct pt_times *times, const char *name, double ms);
void pt_note_work(struct pt_times *times, const char *name, uint64_t bytes, const struct pt_counts *counts);

#endif
