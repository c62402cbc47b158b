// SPDX-License-Identifier: GPL-3.0-or-later
// What a cloud knows of its pages: for paged.c, which tells pictures, and paged_give.c, which takes pages in.
#ifndef PT_PAGED_TABLE_H
#define PT_PAGED_TABLE_H

#include "paged.h"

enum pt_page_state { PT_PAGE_ABSENT, PT_PAGE_COMING, PT_PAGE_STAGED, PT_PAGE_PRESENT };

struct pt_page {
    patina_page told;
    uint32_t first_chunk, chunk_count, first_number;
    uint64_t first_slot, slots;
    atomic_int state;
    atomic_uint wanted;      // bits of a float: the widest gap that a plan saw since somebody asked; 0: none
    atomic_uint used;        // pictures that had begun when a plan last saw it
    struct pt_chunk *chunks; // of a staged page
    patina_cloud_info info;  // likewise
    double area;             // of its surface, by its own points; 0: not known
};

struct pt_paged {
    struct pt_mutex lock; // of what follows, but for atomics
    struct pt_page *pages;
    uint32_t *page_of; // chunk
    uint32_t page_count;
    uint32_t inside;  // readers of the chunks
    uint32_t present; // pages
    uint64_t points;  // present
    uint64_t held, cap;
    uint32_t returned;
    uint64_t wanted; // as patina_cloud_wanted found last
    uint32_t pages_wanted;
    atomic_uint pictures;
    atomic_uint arrived;     // pages, staged ones too
    _Atomic uint64_t coming; // points of staged pages
};

// The i-th chunk of a page as it is until the page arrives.
void pt_page_empty(const struct patina_cloud *cloud, const struct pt_page *page, uint32_t i);

#endif
