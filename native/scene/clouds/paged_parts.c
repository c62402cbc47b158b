// SPDX-License-Identifier: GPL-3.0-or-later
// Parts of a cloud in pages (parts.h): known from the pages' counts, before any point is there, and divided between pages.
#include "paged_table.h"

#include "parts.h"

#include <stdlib.h>

enum { PAGED_PART = 1 << 26 }; // slots at most

// The pages from `first` on that fit; one at least.
static uint32_t fitting(const struct pt_paged *paged, uint32_t first, uint64_t most)
{
    uint64_t slots = paged->pages[first].slots;
    uint32_t p = first + 1;
    while (p < paged->page_count && slots + paged->pages[p].slots <= most)
        slots += paged->pages[p++].slots;
    return p - first;
}

static int make_part(const struct patina_cloud *whole, const struct pt_page *first, const struct pt_page *last,
                     struct patina_cloud *part)
{
    const uint32_t chunks = last->first_chunk + last->chunk_count - first->first_chunk;
    const int error = pt_part_begin(whole, first->first_chunk, chunks, first->first_slot, first->first_number, part);
    part->slots = last->first_slot + last->slots - first->first_slot;
    return error;
}

int pt_paged_parts(struct patina_cloud *cloud)
{
    const struct pt_paged *paged = cloud->paged;
    const uint64_t each = pt_part_slots() < PAGED_PART ? pt_part_slots() : PAGED_PART;
    uint32_t count = 0;
    if (cloud->slots <= pt_part_slots())
        return PATINA_OK;
    for (uint32_t p = 0; p < paged->page_count; p += fitting(paged, p, each))
        count++;
    cloud->parts = calloc(count, sizeof *cloud->parts);
    if (!cloud->parts)
        return PATINA_ERROR_MEMORY;
    for (uint32_t p = 0; p < paged->page_count;) {
        const uint32_t pages = fitting(paged, p, each);
        struct patina_cloud *part = &cloud->parts[cloud->part_count];
        const int error = make_part(cloud, &paged->pages[p], &paged->pages[p + pages - 1], part);
        cloud->part_count++;
        if (error)
            return error;
        p += pages;
    }
    return PATINA_OK;
}

struct patina_cloud *pt_page_part(const struct pt_paged *paged, const struct pt_page *page)
{
    struct patina_cloud *whole = paged->whole;
    uint32_t low = 0, high = whole->part_count;
    while (high - low > 1) {
        const uint32_t middle = low + (high - low) / 2;
        if (whole->parts[middle].first_chunk <= page->first_chunk)
            low = middle;
        else
            high = middle;
    }
    return whole->part_count ? &whole->parts[low] : whole;
}

// Of more points than order has numbers for, it tells those in the part.
uint32_t pt_page_number(const struct pt_paged *paged, const struct pt_page *page)
{
    const uint64_t before = paged->whole->info.count > UINT32_MAX ? pt_page_part(paged, page)->first_number : 0;
    return (uint32_t)(page->first_number - before);
}

void pt_paged_tell_parts(struct pt_paged *paged)
{
    struct patina_cloud *whole = paged->whole;
    for (uint32_t i = 0; i < whole->part_count; i++) {
        struct patina_cloud *part = &whole->parts[i];
        part->info = whole->info;
        part->info.chunks = part->chunk_count;
        part->info.drawn = 0;
        part->built = whole->built;
        part->class_hash = whole->class_hash;
        atomic_store(&part->alive->fingerprint, 0);
        atomic_fetch_add(&part->alive->pages, 1);
    }
    for (uint32_t i = 0; i < paged->present && whole->part_count; i++) {
        const struct pt_page *page = &paged->pages[paged->there[i]];
        pt_page_part(paged, page)->info.drawn += page->told.count;
    }
}
