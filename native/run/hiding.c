// SPDX-License-Identifier: GPL-3.0-or-later
#include "hiding.h"

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

int pt_hiding_begin(struct pt_hiding *hiding, const struct pt_chunk_list *lists, uint32_t count, const uint64_t *keys,
                    uint32_t width, uint32_t height)
{
    size_t chunks = 0;
    for (uint32_t i = 0; i < count; i++)
        chunks += lists[i].count;
    *hiding = (struct pt_hiding){.count = count};
    hiding->lists = malloc((3 * (size_t)count + 1) * sizeof *lists);
    hiding->chunks = malloc((chunks + 1) * sizeof *hiding->chunks);
    hiding->next = calloc(count + pt_tile_count(width, height) + 1, sizeof *hiding->next);
    if (!hiding->lists || !hiding->chunks || !hiding->next) {
        pt_hiding_end(hiding);
        return 0;
    }
    hiding->rounds[0] = hiding->lists + count;
    hiding->rounds[1] = hiding->rounds[0] + count;
    pt_tiles_begin(keys, width, height, hiding->next + count, &hiding->tiles);
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
    free(hiding->next);
    *hiding = (struct pt_hiding){0};
}

// Takes list i's next chunks of the step at hand into a round, where they lie side by side. 0: one found no room.
static int take(struct pt_hiding *hiding, uint32_t i, uint64_t most, struct pt_chunk_list *round, uint64_t *bytes, int *some)
{
    const struct pt_chunk_list *list = &hiding->lists[i];
    struct chunk_view *chunks = hiding->chunks + (round->chunks - hiding->chunks);
    for (uint32_t c = hiding->next[i]; c < list->count && pt_depth_step(&list->chunks[c]) == hiding->depth; c++) {
        const struct chunk_view *chunk = &list->chunks[c];
        const uint64_t own = pt_chunk_bytes(list, chunk);
        if (!pt_is_hidden(chunk, &hiding->tiles)) {
            if (*some && *bytes + own > most)
                return 0;
            chunks[round->count++] = *chunk;
            *bytes += own;
            *some = 1;
        }
        hiding->next[i] = c + 1;
    }
    return 1;
}

const struct pt_chunk_list *pt_hiding_next(struct pt_hiding *hiding, uint64_t most, uint64_t *bytes)
{
    struct pt_chunk_list *round = hiding->rounds[hiding->turn ^= 1];
    int some = 0, room = 1;
    *bytes = 0;
    for (uint32_t i = 0; i < hiding->count; i++) {
        round[i] = hiding->lists[i];
        round[i].chunks += hiding->next[i];
        round[i].count = 0;
    }
    while (hiding->depth < PT_DEPTHS) {
        for (; hiding->list < hiding->count && room; hiding->list += (uint32_t)room)
            room = take(hiding, hiding->list, most, &round[hiding->list], bytes, &some);
        if (!room)
            break;
        hiding->list = 0;
        hiding->depth++;
    }
    return some ? round : NULL;
}
