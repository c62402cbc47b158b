// SPDX-License-Identifier: GPL-3.0-or-later
#include "cloud.h"

#include <stdlib.h>

struct pt_alive *pt_alive_create(void)
{
    static _Atomic uint64_t last;
    struct pt_alive *alive = calloc(1, sizeof *alive);
    if (alive) {
        alive->serial = 1 + atomic_fetch_add(&last, 1);
        atomic_init(&alive->references, 1);
        atomic_init(&alive->alive, 1);
    }
    return alive;
}

void pt_alive_release(struct pt_alive *alive)
{
    if (atomic_fetch_sub(&alive->references, 1) == 1)
        free(alive);
}

void pt_alive_end(struct pt_alive *alive)
{
    if (!alive)
        return;
    atomic_store(&alive->alive, 0);
    pt_alive_release(alive);
}
