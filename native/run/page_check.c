// SPDX-License-Identifier: GPL-3.0-or-later
#include "page_check.h"

#include "base/pool.h"
#include "scene/clouds/page_sums.h"

#include <stdlib.h>

struct page {
    const struct patina_cloud *cloud;
    uint32_t chunk;
};

struct pages {
    const struct pt_check *how;
    struct page *list;
    uint32_t count, room;
    atomic_int damaged;
};

static int add_page(struct pages *pages, const struct patina_cloud *cloud, uint32_t chunk)
{
    if (!pt_page_unseen(cloud, chunk, pages->how->arrays))
        return PATINA_OK;
    if (pages->count == pages->room) {
        const uint32_t room = pages->room ? 2 * pages->room : 256;
        struct page *list = realloc(pages->list, room * sizeof *list);
        if (!list)
            return pt_fail(NULL, PATINA_ERROR_MEMORY, "looking at pages of a file: out of memory");
        pages->list = list;
        pages->room = room;
    }
    pages->list[pages->count++] = (struct page){cloud, chunk};
    return PATINA_OK;
}

static int is_cancelled(const struct pages *pages) { return pages->how->cancel && atomic_load(pages->how->cancel); }

static void check_pages(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct pages *pages = context;
    const struct pt_check *how = pages->how;
    (void)thread;
    for (uint32_t i = begin; i < end && !is_cancelled(pages); i++) {
        if (pt_page_check(pages->list[i].cloud, pages->list[i].chunk, how->arrays))
            atomic_store(&pages->damaged, 1);
        if (how->look)
            how->look(how->context);
    }
}

static int run(struct pages *pages, int error, uint64_t bytes)
{
    if (!error && pages->count) {
        struct pt_pool *pool = pages->count > 8 ? pt_pool_create(0, 0) : NULL;
        if (pages->how->make_room)
            pages->how->make_room(pages->how->context, bytes);
        pt_parallel(pool, pages->count, 4, check_pages, pages);
        pt_pool_destroy(pool);
        error = is_cancelled(pages) ? PATINA_ERROR_CANCELLED : atomic_load(&pages->damaged) ? PT_AGAIN : PATINA_OK;
    }
    free(pages->list);
    return error;
}

int pt_check_range(const struct pt_check *how, const struct pt_chunk_list *lists, const struct pt_chunk_range *range)
{
    struct pages pages = {.how = how};
    int error = PATINA_OK;
    for (uint32_t i = range->list; i <= range->end_list && !error; i++) {
        const uint32_t end = i < range->end_list ? lists[i].count : range->end_chunk;
        if (i == range->end_list && !end)
            break; // there may be no such list
        for (uint32_t c = i == range->list ? range->chunk : 0; c < end && !error && lists[i].cloud->page_sums; c++)
            error = add_page(&pages, lists[i].cloud, pt_page_at(lists[i].cloud, lists[i].chunks[c].first));
    }
    return run(&pages, error, range->bytes);
}

int pt_check_cloud(const struct pt_check *how, const struct patina_cloud *cloud)
{
    struct pages pages = {.how = how};
    int error = PATINA_OK;
    for (uint32_t c = 0; c < cloud->chunk_count && !error && cloud->page_sums; c++)
        error = add_page(&pages, cloud, c);
    return run(&pages, error, pt_cloud_mapped_bytes(cloud));
}
