// SPDX-License-Identifier: GPL-3.0-or-later
// The tree of a cloud's pages, and which chunks are there.
#include "paged_table.h"

#include "base/platform.h"
#include "clusters.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// A page's box lies within its parent's where it reaches beyond it by less: cubes are rounded each by itself.
#define NESTS 1e-9
// Of a page's gap: its own points without those of the pages over it lie no farther apart. Discs and balls without radii are as wide.
#define WIDEST_SPACING 2.0f

// Points of the i-th chunk of a page.
static uint32_t page_share(const struct pt_page *page, uint32_t i)
{
    const uint64_t count = page->told.count;
    return (uint32_t)(count * (i + 1) / page->chunk_count - count * i / page->chunk_count);
}

uint32_t pt_page_padded(const struct pt_page *page, uint32_t i)
{
    return (page_share(page, i) + PT_CHUNK_ALIGN - 1) / PT_CHUNK_ALIGN * PT_CHUNK_ALIGN;
}

// ---- the ways over it --------------------------------------------------------------------------------------------------

static int nests(const patina_page *page, const patina_page *parent)
{
    int within = page->gap <= parent->gap;
    for (int k = 0; k < 3; k++) {
        const double slack = NESTS * (parent->box_max[k] - parent->box_min[k]);
        within &= page->box_min[k] >= parent->box_min[k] - slack && page->box_max[k] <= parent->box_max[k] + slack;
    }
    return within;
}

static int take_reaches(struct pt_paged *paged)
{
    struct pt_page_reach *reaches = paged->reaches = malloc((size_t)paged->page_count * sizeof *reaches);
    if (!reaches)
        return PATINA_ERROR_MEMORY;
    for (uint32_t p = 0; p < paged->page_count; p++) {
        const patina_page *told = &paged->pages[p].told;
        memcpy(reaches[p].box_min, told->box_min, sizeof told->box_min);
        memcpy(reaches[p].box_max, told->box_max, sizeof told->box_max);
        reaches[p].gap = told->gap;
    }
    for (uint32_t p = paged->page_count; p-- > 0;) {
        const uint32_t parent = paged->pages[p].told.parent;
        for (int k = 0; k < 3 && parent != PATINA_NO_PAGE; k++) {
            reaches[parent].box_min[k] = fmin(reaches[parent].box_min[k], reaches[p].box_min[k]);
            reaches[parent].box_max[k] = fmax(reaches[parent].box_max[k], reaches[p].box_max[k]);
            reaches[parent].gap = fmax(reaches[parent].gap, reaches[p].gap);
        }
    }
    return PATINA_OK;
}

int pt_paged_tree(struct pt_paged *paged)
{
    int all = 1;
    paged->root = PATINA_NO_PAGE;
    paged->finest = INFINITY;
    for (uint32_t p = 0; p < paged->page_count; p++) {
        paged->ways[p].child = PATINA_NO_PAGE;
        paged->totals[p] = paged->pages[p].told.count;
    }
    for (uint32_t p = paged->page_count; p-- > 0;) { // the last first, so that lists rise
        const patina_page *told = &paged->pages[p].told;
        uint32_t *first = told->parent == PATINA_NO_PAGE ? &paged->root : &paged->ways[told->parent].child;
        paged->ways[p].next = *first;
        *first = p;
        if (told->parent != PATINA_NO_PAGE)
            paged->totals[told->parent] += paged->totals[p];
        all &= told->parent == PATINA_NO_PAGE || nests(told, &paged->pages[told->parent].told);
        const double gap = (double)(float)told->gap; // as chunks have it
        paged->finest = gap < paged->finest ? gap : paged->finest;
        paged->coarsest = gap > paged->coarsest ? gap : paged->coarsest;
    }
    return all ? PATINA_OK : take_reaches(paged);
}

uint32_t pt_page_first(const struct patina_cloud *cloud)
{
    return cloud->paged && !cloud->first_chunk && cloud->paged->present < cloud->paged->page_count ? cloud->paged->root
                                                                                                   : PATINA_NO_PAGE;
}

uint32_t pt_page_next(const struct patina_cloud *cloud, uint32_t page, int below)
{
    const struct pt_page_way *ways = cloud->paged->ways;
    if (below && ways[page].child != PATINA_NO_PAGE)
        return ways[page].child;
    while (page != PATINA_NO_PAGE && ways[page].next == PATINA_NO_PAGE)
        page = cloud->paged->marks[page].parent;
    return page == PATINA_NO_PAGE ? page : ways[page].next;
}

int pt_page_is_there(const struct patina_cloud *cloud, uint32_t page)
{
    return atomic_load_explicit(&cloud->paged->marks[page].state, memory_order_relaxed) == PT_PAGE_PRESENT;
}

int pt_page_has_below(const struct patina_cloud *cloud, uint32_t page)
{
    return cloud->paged->ways[page].child != PATINA_NO_PAGE;
}

int pt_page_nests(const struct patina_cloud *cloud) { return !cloud->paged->reaches; }

uint32_t pt_page_chunks(const struct patina_cloud *cloud, uint32_t page) { return cloud->paged->pages[page].chunk_count; }

void pt_page_gaps(const struct patina_cloud *cloud, double *finest, double *coarsest)
{
    *finest = cloud->paged->finest;
    *coarsest = cloud->paged->coarsest;
}

void pt_page_box(const struct patina_cloud *cloud, uint32_t page, struct pt_chunk *box)
{
    const patina_page *told = &cloud->paged->pages[page].told;
    *box = (struct pt_chunk){.cone_cosine = -2.0f, .gap = (float)told->gap, .spacing = WIDEST_SPACING * (float)told->gap};
    memset(box->classes, 0xFF, sizeof box->classes);
    memset(box->shapes, 0xFF, sizeof box->shapes);
    for (int k = 0; k < 3; k++) {
        const double low = told->box_min[k], high = told->box_max[k];
        box->origin[k] = low + 0.5 * (high - low);
        box->box_min[k] = nextafterf((float)(low - box->origin[k]), -INFINITY);
        box->box_max[k] = nextafterf((float)(high - box->origin[k]), INFINITY);
    }
}

void pt_page_around(const struct patina_cloud *cloud, uint32_t page, struct pt_chunk *around)
{
    const struct pt_page_reach *reach = cloud->paged->reaches ? &cloud->paged->reaches[page] : NULL;
    const patina_page *told = &cloud->paged->pages[page].told;
    memset(around, 0, sizeof *around);
    around->gap = (float)(reach ? reach->gap : told->gap);
    around->spacing = WIDEST_SPACING * around->gap;
    pt_cluster_box(reach ? reach->box_min : told->box_min, reach ? reach->box_max : told->box_max, around);
}

// ---- chunks that are there ---------------------------------------------------------------------------------------------

uint32_t pt_paged_arrivals(const struct patina_cloud *cloud, uint32_t c)
{
    const struct pt_paged *paged = cloud->paged;
    return paged->pages[paged->page_of[cloud->first_chunk + c]].arrivals;
}

uint32_t pt_paged_chunk_from(const struct patina_cloud *cloud, uint32_t c)
{
    if (cloud->chunks[c].count)
        return c;
    const struct pt_paged *paged = cloud->paged;
    const uint32_t from = cloud->first_chunk + c, end = cloud->first_chunk + cloud->chunk_count;
    uint32_t low = 0, high = paged->present; // the first present page from there on
    while (low < high) {
        const uint32_t middle = low + (high - low) / 2;
        if (paged->pages[paged->there[middle]].first_chunk < from)
            low = middle + 1;
        else
            high = middle;
    }
    const uint32_t found = low < paged->present ? paged->pages[paged->there[low]].first_chunk : end;
    return (found < end ? found : end) - cloud->first_chunk;
}

int pt_paged_absent(const struct patina_cloud *cloud)
{
    return cloud->paged && atomic_load(&cloud->paged->arrived) < cloud->paged->page_count;
}

uint32_t pt_chunks_there(const struct patina_cloud *cloud)
{
    return cloud->paged && cloud->paged->present_chunks < cloud->chunk_count ? cloud->paged->present_chunks
                                                                             : cloud->chunk_count;
}

void pt_chunks_free(struct patina_cloud *cloud)
{
    if (cloud->paged && cloud->paged->table) {
        pt_pages_free(cloud->chunks, cloud->paged->table);
        cloud->paged->table = 0;
    } else {
        free(cloud->chunks);
    }
    cloud->chunks = NULL;
}
