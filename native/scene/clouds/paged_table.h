// SPDX-License-Identifier: GPL-3.0-or-later
// What a cloud knows of its pages: for paged.c, which tells pictures, paged_give.c, which takes pages in, and paged_tree.c, which walks over
// them. A file has hundreds of thousands, of which some thousand are there: what a picture goes over is little for a page, what an absent
// page has of it nothing.
#ifndef PT_PAGED_TABLE_H
#define PT_PAGED_TABLE_H

#include "paged.h"

enum pt_page_state { PT_PAGE_ABSENT, PT_PAGE_COMING, PT_PAGE_STAGED, PT_PAGE_PRESENT };

struct pt_page {
    patina_page told;
    uint32_t first_chunk, chunk_count; // of the whole cloud's
    uint64_t first_number, first_slot, slots;
    struct pt_arrived *arrived; // of a staged or present page
    uint32_t arrivals;          // how often it has become present
};

struct pt_arrived {
    struct pt_chunk *chunks; // as its points alone have them
    patina_cloud_info info;  // likewise
    double area;             // of its surface, by its own points; 0: not known
};

// What pictures go over, of all pages.
struct pt_page_mark {
    atomic_int state;
    atomic_uint wanted; // bits of a float: the widest gap that a plan saw since somebody asked; 0: none
    atomic_uint used;   // pictures that had begun when a plan last saw it
    uint32_t count, parent;
    uint32_t below; // present pages whose parent it is
};

struct pt_page_way { // over the tree
    uint32_t child, next;
};

struct pt_page_reach {
    double box_min[3], box_max[3], gap; // around a page and all beneath it
};

struct pt_paged {
    struct pt_mutex lock; // of what follows, but for atomics
    struct patina_cloud *whole;
    struct pt_page *pages;
    struct pt_page_mark *marks;
    struct pt_page_way *ways;
    struct pt_page_reach *reaches; // NULL: no page reaches beyond its parent, as in every octree
    uint32_t root;                 // the first; others are next to it
    uint32_t *page_of;             // chunk of the whole, where it is there
    uint32_t page_count;
    size_t table;              // bytes of the chunks that are reserved; 0: they are no longer
    double finest, coarsest;   // gaps
    double *totals;            // of each page: points of it and of all beneath it
    double *beneath, *over;    // of each page that is there: densities()
    uint32_t *there, *staged;  // pages: present ones, rising
    uint32_t present, waiting; // how many these are
    uint32_t present_chunks;
    uint32_t inside; // readers of the chunks
    uint64_t points; // present
    uint64_t held, cap;
    uint32_t returned;
    uint64_t wanted; // as patina_cloud_wanted found last
    uint32_t pages_wanted;
    atomic_uint pictures;
    atomic_uint arrived;     // pages, staged ones too
    _Atomic uint64_t coming; // points of staged pages
};

// Parts, once pages and arrays stand; where all fit, there are none. 0 or PATINA_ERROR_MEMORY.
int pt_paged_parts(struct patina_cloud *cloud);
// The one that a page is of, or the whole.
struct patina_cloud *pt_page_part(const struct pt_paged *paged, const struct pt_page *page);
uint32_t pt_page_number(const struct pt_paged *paged, const struct pt_page *page); // of its first point, as order has it
void pt_paged_tell_parts(struct pt_paged *paged); // what the whole knows, whenever that changed

// The ways over the tree, once pages stand. 0 or PATINA_ERROR_MEMORY.
int pt_paged_tree(struct pt_paged *paged);

// A table that pictures read here and there: of zeros, all of it there. NULL without memory.
void *pt_paged_table(size_t size);
// Room for the arrays; memory for what is first in each part, once these stand. 0 or PATINA_ERROR_MEMORY.
int pt_paged_arrays(struct patina_cloud *cloud);
int pt_paged_firsts(const struct patina_cloud *cloud);
// Memory for a page's slots in the cloud's arrays, and for what kernels read behind them. 0 or PATINA_ERROR_MEMORY, with its message.
int pt_page_need(struct patina_cloud *cloud, uint32_t index);
void pt_page_forget(struct patina_cloud *cloud, const struct pt_page *page);

// Slots of the i-th chunk of a page: as patina_cloud_create cuts so many points evenly.
uint32_t pt_page_padded(const struct pt_page *page, uint32_t i);

#endif
