// SPDX-License-Identifier: GPL-3.0-or-later
#include "arena.h"

#include <stdlib.h>
#include <string.h>

enum { BLOCK_SIZE = 64 << 10 };

struct pt_arena {
    struct pt_arena *next;
    size_t used, size;
    _Alignas(max_align_t) unsigned char memory[];
};

void *pt_arena_take(struct pt_arena **arena, size_t size)
{
    size = (size + 63) / 64 * 64;
    struct pt_arena *block = *arena;
    if (!block || block->size - block->used < size) {
        size_t room = size > BLOCK_SIZE ? size : BLOCK_SIZE;
        block = calloc(1, sizeof *block + room);
        if (!block)
            return NULL;
        block->size = room;
        block->next = *arena;
        *arena = block;
    }
    void *memory = block->memory + block->used;
    block->used += size;
    return memory;
}

void *pt_arena_grow(struct pt_arena **arena, void *list, uint32_t *room, size_t each)
{
    const uint32_t grown = *room ? 2 * *room : 32;
    void *memory = pt_arena_take(arena, grown * each);
    if (memory && list)
        memcpy(memory, list, *room * each);
    *room = memory ? grown : *room;
    return memory;
}

void pt_arena_free(struct pt_arena *arena)
{
    while (arena) {
        struct pt_arena *next = arena->next;
        free(arena);
        arena = next;
    }
}
