// SPDX-License-Identifier: GPL-3.0-or-later
// Where what a cloud in pages has lies: room for all there is, and memory for what came.
#include "paged_table.h"

#include "base/platform.h"
#include "parts.h"

enum {
    BEHIND = 64,   // bytes behind a page that are there with it: kernels read bytes as words
    FIRST = BEHIND // of each part, with or without its page: read where a pixel shows none of its points (simd/unmasked.h)
};

void *pt_paged_table(size_t size)
{
    void *pages = pt_pages_reserve(size);
    if (!pages || !pt_pages_need(pages, size))
        return pages;
    pt_pages_free(pages, size);
    return NULL;
}

int pt_paged_arrays(struct patina_cloud *cloud)
{
    struct pt_section sections[PT_ARRAYS];
    pt_cloud_sections(cloud, sections);
    for (int i = PT_ARRAY_POSITIONS; i < PT_ARRAY_SIGHTS; i++)
        if (sections[i].size && !(*sections[i].data = pt_pages_reserve(sections[i].size)))
            return PATINA_ERROR_MEMORY;
    return PATINA_OK;
}

static int need_first(const struct patina_cloud *part)
{
    struct patina_cloud copy = *part;
    struct pt_section sections[PT_ARRAYS];
    pt_cloud_sections(&copy, sections);
    for (int i = PT_ARRAY_POSITIONS; i <= PT_ARRAY_CLASSES; i++)
        if (sections[i].size && pt_pages_need(*sections[i].data, sections[i].size < FIRST ? sections[i].size : FIRST))
            return PATINA_ERROR_MEMORY;
    return PATINA_OK;
}

int pt_paged_firsts(const struct patina_cloud *cloud)
{
    int error = PATINA_OK;
    for (uint32_t i = 0; i < pt_part_count(cloud) && !error; i++)
        error = need_first(pt_part(cloud, i));
    return error;
}

int pt_page_need(struct patina_cloud *cloud, uint32_t index)
{
    const struct pt_page *page = &cloud->paged->pages[index];
    struct pt_section sections[PT_ARRAYS];
    pt_cloud_sections(cloud, sections);
    for (int i = PT_ARRAY_POSITIONS; i <= PT_ARRAY_CLASSES; i++) {
        const uint64_t each = pt_cloud_array_bytes(cloud, (enum pt_array)i), first = page->first_slot * each;
        const uint64_t wanted = page->slots * each + BEHIND, left = sections[i].size - first;
        if (sections[i].size && pt_pages_need((char *)*sections[i].data + first, wanted < left ? wanted : left)) {
            pt_page_forget(cloud, page);
            return pt_fail(&cloud->handle, PATINA_ERROR_MEMORY, "page %u: out of memory", index);
        }
    }
    return PATINA_OK;
}

// But for what the page before it has behind it, and what is first in a part.
void pt_page_forget(struct patina_cloud *cloud, const struct pt_page *page)
{
    struct pt_section sections[PT_ARRAYS];
    pt_cloud_sections(cloud, sections);
    for (int i = PT_ARRAY_POSITIONS; i <= PT_ARRAY_CLASSES; i++) {
        const uint64_t each = pt_cloud_array_bytes(cloud, (enum pt_array)i), size = page->slots * each;
        if (sections[i].size && size > BEHIND)
            pt_pages_forget((char *)*sections[i].data + page->first_slot * each + BEHIND, size - BEHIND);
    }
}
