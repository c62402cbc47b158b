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
};

// All take NULL: no progress wanted.
static inline void pt_progress_set(struct patina_progress *progress, double value)
{
    if (progress)
        atomic_store_explicit(&progress->value, (float)value, memory_order_relaxed);
}

// From several threads: never goes back.
static inline void pt_progress_raise(struct patina_progress *progress, double value)
{
    float seen = progress ? atomic_load_explicit(&progress->value, memory_order_relaxed) : 1.0f;
    while (seen < (float)value && !atomic_compare_exchange_weak(&progress->value, &seen, (float)value))
        ;
}

static inline int pt_progress_cancelled(const struct patina_progress *progress)
{
    return progress && atomic_load_explicit(&progress->cancelled, memory_order_relaxed);
}

#endif
