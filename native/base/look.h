// SPDX-License-Identifier: GPL-3.0-or-later
// When to look at what the process holds of mapped files: while threads read on, one of them looks, and not oftener than it tells anything.
#ifndef PT_LOOK_H
#define PT_LOOK_H

#include "platform.h"

#include <stdatomic.h>
#include <stdint.h>

struct pt_look {
    uint64_t pause;         // microseconds between two looks
    _Atomic uint64_t again; // when the next is due
};

// cap: bytes that may be held; rate: that threads take a microsecond. No more than an eighth of the cap between two looks, but where it is
// so small that they would do nothing else: to look takes 2 to 5 microseconds.
static inline void pt_look_begin(struct pt_look *look, uint64_t cap, uint64_t rate)
{
    enum { LEAST = 20, MOST = 500 };
    const uint64_t pause = cap / (8 * rate);
    look->pause = pause < LEAST ? LEAST : pause < MOST ? pause : MOST;
    atomic_store(&look->again, 0);
}

// From any thread: whether it is this one's turn.
static inline int pt_look_is_due(struct pt_look *look)
{
    const uint64_t now = (uint64_t)(1e3 * pt_milliseconds());
    uint64_t again = atomic_load_explicit(&look->again, memory_order_relaxed);
    return now >= again && atomic_compare_exchange_strong(&look->again, &again, now + look->pause);
}

#endif
