// SPDX-License-Identifier: GPL-3.0-or-later
// Progress and cancel of long calls: set and polled from any thread, no callbacks.
#ifndef PT_PROGRESS_H
#define PT_PROGRESS_H

#include "error.h"

#include <stdatomic.h>

struct patina_progress {
    struct pt_handle handle;
    atomic_int cancelled;
    _Atomic float value; // 0..1
    float begin, share;  // of the whole, what the call does that is under way; share 0: all. Set before it begins
};

static inline double pt_progress_of_whole(const struct patina_progress *progress, double value)
{
    return progress->share > 0 ? (double)progress->begin + (double)progress->share * value : value;
}

// All take NULL: no progress wanted.
static inline void pt_progress_set(struct patina_progress *progress, double value)
{
    if (progress)
        atomic_store_explicit(&progress->value, (float)pt_progress_of_whole(progress, value), memory_order_relaxed);
}

// From several threads: never goes back.
static inline void pt_progress_raise(struct patina_progress *progress, double value)
{
    if (!progress)
        return;
    const float whole = (float)pt_progress_of_whole(progress, value);
    float seen = atomic_load_explicit(&progress->value, memory_order_relaxed);
    while (seen < whole && !atomic_compare_exchange_weak(&progress->value, &seen, whole))
        ;
}

static inline int pt_progress_cancelled(const struct patina_progress *progress)
{
    return progress && atomic_load_explicit(&progress->cancelled, memory_order_relaxed);
}

#endif
