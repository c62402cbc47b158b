// SPDX-License-Identifier: GPL-3.0-or-later
// Arrays of an analysis that memory has no room for (SPEC 13): each a nameless file that is mapped, so that whoever reads and writes them
// needs not know it. What is held of them, and of a cloud whose file is mapped, stays below a cap: whenever more is held all of it is
// given back, and comes again page by page.
#ifndef PT_STORE_H
#define PT_STORE_H

#include "scene/clouds/cloud.h"
#include "base/look.h"

enum { PT_STORE_ARRAYS = 96 }; // an analysis has twelve, and two a view

// NULL in its place: all in memory.
struct pt_store {
    const char *beside;               // the file that they lie on the same disk with
    const struct patina_cloud *cloud; // mapped, or NULL
    uint64_t memory, cap;             // bytes: in all, and of what is mapped
    uint64_t before;                  // held with nothing of it
    struct pt_look look;
    atomic_uint returned; // how often all was given back
    int error;            // of the system, where an array could not be made
    int lost;             // an array that is gone could not be read back: ask pt_store_lost
    struct pt_stored {
        void *pages;
        size_t size;
        struct pt_disk disk;
    } arrays[PT_STORE_ARRAYS];
    uint32_t count;
};

void pt_store_open(struct pt_store *store, const char *beside, const struct patina_cloud *cloud, uint64_t memory);
void pt_store_close(struct pt_store *store); // with all its arrays

// As pt_pages_alloc and pt_pages_free, by one thread at a time.
void *pt_store_alloc(struct pt_store *store, size_t size);
void pt_store_free(struct pt_store *store, void *pages, size_t size);
// Whether something of an array could not be read back from the disk: what was made of it is worth nothing.
int pt_store_lost(const struct pt_store *store); // NULL is fine
// In memory where it is a small part of what may be taken: for what is written to here and there.
int pt_store_is_small(const struct pt_store *store, uint64_t size);

// Gives all back where it is time: between shares of work, from any thread. As pt_pool_watch takes it; NULL is fine.
void pt_store_look(void *store);

#endif
