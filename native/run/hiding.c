// SPDX-License-Identifier: GPL-3.0-or-later
#include "hiding.h"

#include <stdlib.h>

static void sort_from_near(const struct pt_chunk_list *list, uint32_t *order)
{
    uint32_t next[PT_DEPTHS + 1] = {0};
    for (uint32_t c = 0; c < list->count; c++)
        next[pt_depth_step(&list->chunks[c]) + 1]++;
    for (uint32_t depth = 0; depth < PT_DEPTHS; depth++)
        next[depth + 1] += next[depth];
    for (uint32_t c = 0; c < list->count; c++)
        order[next[pt_depth_step(&list->chunks[c])]++] = c;
}

int pt_hiding_begin(struct pt_hiding *hiding, const struct pt_chunk_list *lists, uint32_t count, const uint64_t *keys,
                    uint32_t width, uint32_t height)
{
    size_t chunks = 0;
    for (uint32_t i = 0; i < count; i++)
        chunks += lists[i].count;
    const size_t tiles = pt_tile_count(width, height);
    struct chunk_view *room; // of which what is hidden touches nothing
    *hiding = (struct pt_hiding){.lists = lists, .count = count};
    hiding->memory = malloc(chunks * sizeof *room + 2 * (size_t)count * sizeof *lists + count * sizeof *hiding->of +
                            (chunks + tiles) * sizeof(uint32_t) + 1);
    if (!hiding->memory) {
        pt_hiding_end(hiding);
        return 0;
    }
    hiding->rounds[0] = hiding->memory;
    hiding->rounds[1] = hiding->rounds[0] + count;
    hiding->of = (struct pt_hiding_list *)(hiding->rounds[1] + count);
    room = (struct chunk_view *)(hiding->of + count);
    uint32_t *order = (uint32_t *)(room + chunks);
    pt_tiles_begin(keys, width, height, order + chunks, &hiding->tiles);
    for (uint32_t i = 0; i < count; i++) {
        hiding->of[i] = (struct pt_hiding_list){.order = order, .chunks = room};
        sort_from_near(&lists[i], order);
        order += lists[i].count;
        room += lists[i].count;
    }
    return 1;
}

void pt_hiding_end(struct pt_hiding *hiding)
{
    free(hiding->memory);
    *hiding = (struct pt_hiding){0};
}

// Takes list i's next chunks of the step at hand into a round. 0: one found no room.
static int take(struct pt_hiding *hiding, uint32_t i, uint64_t most, struct pt_chunk_list *round, uint64_t *bytes, int *some)
{
    const struct pt_chunk_list *list = &hiding->lists[i];
    struct pt_hiding_list *of = &hiding->of[i];
    for (; of->next < list->count; of->next++) {
        const struct chunk_view *chunk = &list->chunks[of->order[of->next]];
        if (pt_depth_step(chunk) != hiding->depth)
            break;
        if (pt_is_hidden(chunk, &hiding->tiles))
            continue;
        const uint64_t own = pt_chunk_bytes(list, chunk);
        if (*some && *bytes + own > most)
            return 0;
        of->chunks[of->taken++] = *chunk;
        round->count++;
        *bytes += own;
        *some = 1;
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
        round[i].chunks = hiding->of[i].chunks + hiding->of[i].taken;
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
