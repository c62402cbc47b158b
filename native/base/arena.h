// SPDX-License-Identifier: GPL-3.0-or-later
// Memory of many small things that live equally long, as a plan's do.
#ifndef PT_ARENA_H
#define PT_ARENA_H

#include <stddef.h>

struct pt_arena; // NULL: an empty one

void *pt_arena_take(struct pt_arena **arena, size_t size); // zeroed; NULL when memory lacks. One thread at a time
void pt_arena_free(struct pt_arena *arena);                // and all that was taken

#endif
