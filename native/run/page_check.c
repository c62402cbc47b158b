// SPDX-License-Identifier: GPL-3.0-or-later
#include "page_check.h"

#include "base/pool.h"
#include "scene/page_sums.h"

#include <stdlib.h>

struct page {
    const struct patina_cloud *cloud;
    uint32_t chunk;
    int bad; // and nobody had found it before
};

struct check {
    struct page *pages;
    uint32_t count, room, arrays;
};

// The chunk that begins at a slot.
static uint32_t chunk_at(const struct patina_cloud *cloud, uint32_t first)
{
    uint32_t low = 0, high = cloud->chunk_count - 1;
    while (low < high) {
        const uint32_t middle = low + (high - low) / 2;
        if (cloud->chunks[middle].first < first)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static int add_page(struct check *check, const struct patina_cloud *cloud, uint32_t chunk)
{
    if (!pt_page_unseen(cloud, chunk, check->arrays))
        return PATINA_OK;
    if (check->count == check->room) {
        const uint32_t room = check->room ? 2 * check->room : 256;
        struct page *pages = realloc(check->pages, room * sizeof *pages);
        if (!pages)
            return PATINA_ERROR_MEMORY;
        check->pages = pages;
        check->room = room;
    }
    check->pages[check->count++] = (struct page){cloud, chunk, 0};
    return PATINA_OK;
}

static void look(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct check *check = context;
    (void)thread;
    for (uint32_t i = begin; i < end; i++)
        check->pages[i].bad = pt_page_check(check->pages[i].cloud, check->pages[i].chunk, check->arrays);
}

// Of each cloud one line, whatever there is of it.
static int tell(const struct check *check)
{
    int some = 0;
    for (uint32_t i = 0, end; i < check->count; i = end) {
        const struct patina_cloud *cloud = check->pages[i].cloud;
        uint32_t bad = 0, first = 0;
        uint64_t points = 0;
        for (end = i; end < check->count && check->pages[end].cloud == cloud; end++)
            if (check->pages[end].bad) {
                first = bad++ ? first : check->pages[end].chunk;
                points += cloud->chunks[check->pages[end].chunk].count;
            }
        if (bad)
            pt_page_tell(cloud, first, bad, points);
        some |= bad > 0;
    }
    return some ? PT_AGAIN : PATINA_OK;
}

static int run(struct check *check, int error)
{
    if (!error && check->count) {
        struct pt_pool *pool = check->count > 8 ? pt_pool_create(0, 0) : NULL;
        pt_parallel(pool, check->count, 4, look, check);
        pt_pool_destroy(pool);
        error = tell(check);
    }
    free(check->pages);
    return error;
}

int pt_check_range(const struct pt_chunk_list *lists, const struct pt_chunk_range *range, uint32_t arrays)
{
    struct check check = {.arrays = arrays};
    int error = PATINA_OK;
    for (uint32_t i = range->list; i <= range->end_list && !error; i++) {
        const uint32_t end = i < range->end_list ? lists[i].count : range->end_chunk;
        if (i == range->end_list && !end)
            break; // there may be no such list
        for (uint32_t c = i == range->list ? range->chunk : 0; c < end && !error && lists[i].cloud->page_sums; c++)
            error = add_page(&check, lists[i].cloud, chunk_at(lists[i].cloud, lists[i].chunks[c].first));
    }
    return run(&check, error);
}

int pt_check_cloud(const struct patina_cloud *cloud)
{
    struct check check = {.arrays = UINT32_MAX};
    int error = PATINA_OK;
    for (uint32_t c = 0; c < cloud->chunk_count && !error && cloud->page_sums; c++)
        error = add_page(&check, cloud, c);
    return run(&check, error);
}
