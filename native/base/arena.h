// SPDX-License-Identifier: GPL-3.0-or-later
// Memory of many small things that live equally long, as a plan's do.
#ifndef PT_ARENA_H
#define PT_ARENA_H

#include <stddef.h>
#include <stdint.h>

struct pt_arena; // NULL: an empty one

void *pt_arena_take(struct pt_arena **arena, size_t size); // zeroed; NULL when memory lacks. One thread at a time
// In place of a list that has room for *room things of so many bytes, one for twice as many, or for the first 32, with what it holds. NULL,
// and *room as it was, when memory lacks.
void *pt_arena_grow(struct pt_arena **arena, void *list, uint32_t *room, size_t each);
void pt_arena_free(struct pt_arena *arena); // and all that was taken

#endif
