// SPDX-License-Identifier: GPL-3.0-or-later
#include "hiding.h"

#include "hidden.h"

#include <stdlib.h>

static void sort_from_near(const struct pt_chunk_list *list, struct chunk_view *out)
{
    uint32_t next[PT_DEPTHS + 1] = {0};
    for (uint32_t c = 0; c < list->count; c++)
        next[pt_depth_step(&list->chunks[c]) + 1]++;
    for (uint32_t depth = 0; depth < PT_DEPTHS; depth++)
        next[depth + 1] += next[depth];
    for (uint32_t c = 0; c < list->count; c++)
        out[next[pt_depth_step(&list->chunks[c])]++] = list->chunks[c];
}

int pt_hiding_begin(struct pt_hiding *hiding, const struct pt_chunk_list *lists, uint32_t count)
{
    size_t chunks = 0;
    for (uint32_t i = 0; i < count; i++)
        chunks += lists[i].count;
    hiding->count = count;
    hiding->lists = malloc((count + (size_t)1) * sizeof *lists);
    hiding->chunks = malloc((chunks + 1) * sizeof *hiding->chunks);
    if (!hiding->lists || !hiding->chunks) {
        pt_hiding_end(hiding);
        return 0;
    }
    struct chunk_view *out = hiding->chunks;
    for (uint32_t i = 0; i < count; i++) {
        hiding->lists[i] = lists[i];
        hiding->lists[i].chunks = out;
        sort_from_near(&lists[i], out);
        out += lists[i].count;
    }
    return 1;
}

void pt_hiding_end(struct pt_hiding *hiding)
{
    free(hiding->lists);
    free(hiding->chunks);
    hiding->lists = NULL;
    hiding->chunks = NULL;
}

// What is hidden of list i from one chunk up to another. Returns how many.
static uint32_t hide(const struct pt_hiding *hiding, uint32_t i, uint32_t first, uint32_t end)
{
    struct chunk_view *chunks = hiding->chunks + (hiding->lists[i].chunks - hiding->chunks);
    uint32_t hidden = 0;
    for (uint32_t c = first; c < end; c++)
        if (pt_is_hidden(&chunks[c], hiding->keys, hiding->width)) {
            chunks[c].count = chunks[c].padded = 0;
            hidden++;
        }
    return hidden;
}

int pt_hiding_next(const struct pt_hiding *hiding, uint64_t most, struct pt_chunk_range *range)
{
    uint32_t list = range->end_list, chunk = range->end_chunk, hidden;
    for (;;) { // what is hidden has no bytes, and makes room for what follows
        struct pt_chunk_range found = *range;
        const int some = pt_next_range(hiding->lists, hiding->count, most, &found);
        for (hidden = 0; some && list < found.end_list; list++, chunk = 0)
            hidden += hide(hiding, list, chunk, hiding->lists[list].count);
        if (some && list < hiding->count) {
            hidden += hide(hiding, list, chunk, found.end_chunk);
            chunk = found.end_chunk;
        }
        if (!hidden) {
            *range = found;
            return some;
        }
    }
}
