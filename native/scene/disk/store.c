// SPDX-License-Identifier: GPL-3.0-or-later
#include "store.h"

#include <errno.h>
#include <string.h>

enum {
    CAP_EIGHTHS = 5,   // of the memory, for what is mapped: from here on all is given back, while threads read on
    SMALL_EIGHTHS = 2, // of it, for what lies in memory all the same
    WRITTEN = 4000,    // bytes a microsecond, that threads write into fresh pages at most
};

void pt_store_open(struct pt_store *store, const char *beside, const struct patina_cloud *cloud, uint64_t memory)
{
    *store = (struct pt_store){.beside = beside, .cloud = cloud, .memory = memory, .cap = memory / 8 * CAP_EIGHTHS};
    pt_look_begin(&store->look, store->cap, WRITTEN);
    if (cloud && cloud->mapped)
        pt_cloud_return(cloud); // what was read of it before counts below the cap
    store->before = pt_file_memory();
}

void pt_store_close(struct pt_store *store)
{
    while (store->count)
        pt_store_free(store, store->arrays[0].pages, store->arrays[0].size);
}

void *pt_store_alloc(struct pt_store *store, size_t size)
{
    if (!store)
        return pt_pages_alloc(size);
    struct pt_stored *array = &store->arrays[store->count];
    if (store->count == PT_STORE_ARRAYS) {
        store->error = EMFILE;
        return NULL;
    }
    int error = pt_disk_spill(store->beside, &array->disk);
    if (!error) {
        size = size ? size : 1;
        if (!(error = pt_disk_reserve(&array->disk, size)))
            error = pt_disk_map(&array->disk, 0, size, PT_DISK_SHARED, &array->pages);
        if (error)
            pt_disk_close(&array->disk);
    }
    if (error) {
        store->error = error;
        return NULL;
    }
    array->size = size;
    store->count++;
    return array->pages;
}

void pt_store_free(struct pt_store *store, void *pages, size_t size)
{
    uint32_t i = 0;
    while (store && i < store->count && store->arrays[i].pages != pages)
        i++;
    if (!store || i == store->count) {
        pt_pages_free(pages, size);
        return;
    }
    store->lost |= pt_pages_lost(pages, store->arrays[i].size);
    pt_pages_free(pages, store->arrays[i].size);
    pt_disk_close(&store->arrays[i].disk);
    store->arrays[i] = store->arrays[--store->count];
}

int pt_store_lost(const struct pt_store *store)
{
    int lost = store && store->lost;
    for (uint32_t i = 0; store && i < store->count; i++)
        lost |= pt_pages_lost(store->arrays[i].pages, store->arrays[i].size);
    return lost;
}

int pt_store_is_small(const struct pt_store *store, uint64_t size)
{
    return !store || size <= store->memory / 8 * SMALL_EIGHTHS;
}

void pt_store_look(void *context)
{
    struct pt_store *store = context;
    if (!store || !pt_look_is_due(&store->look))
        return;
    const uint64_t held = pt_file_memory();
    if (store->before && held <= store->before + store->cap) // where nobody knows, all there may be
        return;
    for (uint32_t i = 0; i < store->count; i++)
        pt_pages_return(store->arrays[i].pages, store->arrays[i].size);
    if (store->cloud && store->cloud->mapped)
        pt_cloud_return(store->cloud);
    atomic_fetch_add(&store->returned, 1);
}
