// SPDX-License-Identifier: GPL-3.0-or-later
// Pages as pictures see them: what arrived becomes part of the cloud, what plans want is remembered.
#include "paged_table.h"

#include "base/compare.h"
#include "base/descriptor.h"
#include "fingerprint.h"
#include "shared/view.h"
#include "shared/words.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static uint32_t bytes_of_point(const struct patina_cloud *cloud)
{
    return 20 + (uint32_t)pt_color_size(cloud->color_format) + 4 * cloud->info.has_scalars + cloud->info.has_classes;
}

void pt_page_empty(const struct patina_cloud *cloud, const struct pt_page *page, uint32_t i)
{
    struct pt_chunk *chunk = &cloud->chunks[page->first_chunk + i];
    const uint32_t first = chunk->first, slots = chunk->padded;
    *chunk = (struct pt_chunk){.first = first, .padded = slots, .cone_cosine = -2.0f, .gap = (float)page->told.gap};
    memset(chunk->classes, 0xFF, sizeof chunk->classes);
    memset(chunk->shapes, 0xFF, sizeof chunk->shapes);
    for (int k = 0; k < 3; k++) {
        const double low = page->told.box_min[k], high = page->told.box_max[k];
        chunk->origin[k] = low + 0.5 * (high - low);
        chunk->box_min[k] = nextafterf((float)(low - chunk->origin[k]), -INFINITY);
        chunk->box_max[k] = nextafterf((float)(high - chunk->origin[k]), INFINITY);
    }
}

// ---- what arrived becomes part of the cloud ----------------------------------------------------------------------------

// Whether one of the last two pictures would have had it. What nobody looks at counts as if it were there: a picture for which all has
// arrived that it shows is that of the whole cloud.
static int is_missing(const struct pt_paged *paged, const struct pt_page *page)
{
    return atomic_load(&page->state) != PT_PAGE_PRESENT && atomic_load(&page->used) + 2 >= atomic_load(&paged->pictures);
}

// Points as dense as those of a page, of all over it and of all beneath it together, in points per area. A page's points tell how large
// its surface is; what lies beneath it shares that surface.
static int densities(const struct pt_paged *paged, double *over, double *beneath)
{
    double *own = calloc(paged->page_count + 1u, sizeof *own);
    if (!own)
        return PATINA_ERROR_MEMORY;
    for (uint32_t p = paged->page_count; p-- > 0;) { // points of its subtree, leaves first
        const struct pt_page *page = &paged->pages[p];
        own[p] += is_missing(paged, page) ? 0.0 : page->told.count;
        if (page->told.parent != PATINA_NO_PAGE)
            own[page->told.parent] += own[p];
    }
    for (uint32_t p = 0; p < paged->page_count; p++) {
        const struct pt_page *page = &paged->pages[p], *parent = &paged->pages[page->told.parent];
        const int has = page->told.parent != PATINA_NO_PAGE;
        over[p] = has ? over[page->told.parent] : 0.0;
        if (has && atomic_load(&parent->state) == PT_PAGE_PRESENT && parent->area > 0.0)
            over[p] += parent->told.count / parent->area;
        beneath[p] = own[p] / page->told.count; // times what its own points come to
    }
    free(own);
    return PATINA_OK;
}

// The page's chunks: spacings of all that is there, and their classes in the words of the points. Whether any changed.
static int settle_page(struct patina_cloud *cloud, const struct pt_page *page, double over, double beneath)
{
    int changed = 0;
    for (uint32_t i = 0; i < page->chunk_count; i++) {
        struct pt_chunk *chunk = &cloud->chunks[page->first_chunk + i];
        const double own = (double)page->chunks[i].spacing;
        const float spacing = own > 0.0 ? (float)(1.0 / sqrt(over + beneath / (own * own))) : 0.0f;
        changed |= chunk->spacing != spacing;
        chunk->spacing = chunk->built = spacing;
        uint32_t *surfels = cloud->surfels + chunk->first;
        const uint32_t class = pt_class_of_spacing((double)spacing, cloud->spacing_base) << PT_SPACING_SHIFT;
        const uint32_t normals = (1u << PT_SPACING_SHIFT) - 1u;
        if ((surfels[0] & ~normals) != class)
            for (uint32_t k = 0; k < chunk->padded; k++)
                surfels[k] = (surfels[k] & normals) | class;
    }
    return changed;
}

static void sum_up(struct patina_cloud *cloud)
{
    struct pt_paged *paged = cloud->paged;
    patina_cloud_info *info = &cloud->info;
    double *known = malloc((cloud->chunk_count + 1u) * sizeof *known);
    uint32_t count = 0;
    info->drawn = paged->points;
    info->bytes = paged->held + cloud->chunk_count * sizeof *cloud->chunks;
    info->invalid_normals = info->invalid_colors = 0;
    memset(info->class_bits, 0, sizeof info->class_bits);
    float least = INFINITY, most = -INFINITY;
    for (uint32_t p = 0; p < paged->page_count; p++) {
        const struct pt_page *page = &paged->pages[p];
        if (atomic_load(&page->state) != PT_PAGE_PRESENT)
            continue;
        info->invalid_normals += page->info.invalid_normals;
        info->invalid_colors += page->info.invalid_colors;
        for (int k = 0; k < 8; k++)
            info->class_bits[k] |= page->info.class_bits[k];
        least = fminf(least, page->info.scalar_range[0]);
        most = fmaxf(most, page->info.scalar_range[1]);
        for (uint32_t i = 0; known && i < page->chunk_count; i++)
            known[count++] = (double)cloud->chunks[page->first_chunk + i].spacing;
    }
    info->scalar_range[0] = least <= most ? least : 0.0f;
    info->scalar_range[1] = least <= most ? most : 0.0f;
    if (count) {
        qsort(known, count, sizeof *known, pt_compare_doubles);
        info->spacing = known[count / 2];
        info->spacing_min = known[0];
        info->spacing_max = known[count - 1];
        info->layer_distance = (double)PT_SPACING_FACTOR * info->spacing;
        cloud->built = info->spacing;
    }
    free(known);
    const int whole = paged->present == paged->page_count; // as a saved file has it
    cloud->class_hash = !info->has_classes ? 0
                        : whole            ? pt_fingerprint(1, cloud->classes, cloud->slots)
                                           : pt_fingerprint(cloud->class_hash, &paged->points, sizeof paged->points);
}

static void drop_page(struct patina_cloud *cloud, struct pt_page *page)
{
    struct pt_section sections[PT_ARRAYS];
    pt_cloud_sections(cloud, sections);
    static const enum pt_array points[] = {PT_ARRAY_POSITIONS, PT_ARRAY_ORDER,   PT_ARRAY_SURFELS,
                                           PT_ARRAY_COLORS,    PT_ARRAY_SCALARS, PT_ARRAY_CLASSES};
    const uint32_t bytes[] = {12, 4, 4, (uint32_t)pt_color_size(cloud->color_format), 4, 1};
    for (size_t i = 0; i < sizeof points / sizeof *points; i++)
        if (sections[points[i]].size)
            pt_pages_forget((char *)*sections[points[i]].data + page->first_slot * bytes[i], page->slots * bytes[i]);
    free(page->chunks);
    page->chunks = NULL;
    for (uint32_t i = 0; i < page->chunk_count; i++)
        pt_page_empty(cloud, page, i);
    cloud->paged->held -= page->slots * bytes_of_point(cloud);
    cloud->paged->points -= page->told.count;
    cloud->paged->present--;
    cloud->paged->returned++;
    atomic_fetch_sub(&cloud->paged->arrived, 1);
    atomic_store(&page->wanted, 0);
    atomic_store(&page->state, PT_PAGE_ABSENT);
}

// Of pages that no later picture wanted, and that no present one lies beneath, those of the earliest picture go first.
static int give_back(struct patina_cloud *cloud)
{
    struct pt_paged *paged = cloud->paged;
    const uint32_t now = atomic_load(&paged->pictures);
    int some = 0;
    while (paged->cap && paged->held > paged->cap) {
        uint8_t *parents = calloc(paged->page_count + 1u, 1);
        struct pt_page *oldest = NULL;
        if (!parents)
            break;
        for (uint32_t p = 0; p < paged->page_count; p++)
            if (atomic_load(&paged->pages[p].state) == PT_PAGE_PRESENT && paged->pages[p].told.parent != PATINA_NO_PAGE)
                parents[paged->pages[p].told.parent] = 1;
        for (uint32_t p = 0; p < paged->page_count; p++) {
            struct pt_page *page = &paged->pages[p];
            if (atomic_load(&page->state) != PT_PAGE_PRESENT || parents[p] || atomic_load(&page->used) + 1 >= now)
                continue;
            if (!oldest || atomic_load(&page->used) <= atomic_load(&oldest->used))
                oldest = page;
        }
        free(parents);
        if (!oldest) // all are needed: the cap is overshot
            break;
        drop_page(cloud, oldest);
        some = 1;
    }
    return some;
}

static int publish(struct patina_cloud *cloud, struct pt_page *page)
{
    double area = 0.0;
    for (uint32_t i = 0; i < page->chunk_count; i++) {
        struct pt_chunk *chunk = &cloud->chunks[page->first_chunk + i];
        const uint32_t first = chunk->first;
        *chunk = page->chunks[i];
        chunk->first = first;
        chunk->gap = (float)page->told.gap;
        area += chunk->count * (double)chunk->spacing * (double)chunk->spacing;
    }
    page->area = area;
    cloud->paged->held += page->slots * bytes_of_point(cloud);
    cloud->paged->points += page->told.count;
    cloud->paged->present++;
    atomic_fetch_sub(&cloud->paged->coming, page->told.count);
    atomic_store(&page->used, atomic_load(&cloud->paged->pictures));
    atomic_store(&page->state, PT_PAGE_PRESENT);
    return 1;
}

// With the lock, and nobody inside.
static void renew_chunks(struct patina_cloud *cloud)
{
    struct pt_paged *paged = cloud->paged;
    int some = 0;
    for (uint32_t p = 0; p < paged->page_count && atomic_load(&paged->coming); p++)
        if (atomic_load(&paged->pages[p].state) == PT_PAGE_STAGED)
            some |= publish(cloud, &paged->pages[p]);
    some |= give_back(cloud);
    if (!some && paged->present == paged->page_count)
        return;
    double *over = malloc(2 * ((size_t)paged->page_count + 1) * sizeof *over);
    if (over && !densities(paged, over, over + paged->page_count)) // without memory spacings stay as they are
        for (uint32_t p = 0; p < paged->page_count; p++)
            if (atomic_load(&paged->pages[p].state) == PT_PAGE_PRESENT)
                some |= settle_page(cloud, &paged->pages[p], over[p], over[paged->page_count + p]);
    free(over);
    if (!some)
        return;
    sum_up(cloud);
    atomic_store(&cloud->alive->fingerprint, 0);
    atomic_fetch_add(&cloud->alive->pages, 1);
}

// The door of pictures is const, for what they see does not change; what arrived is no part of any picture yet.
void pt_paged_enter(const struct patina_cloud *cloud, int renew)
{
    if (!cloud->paged)
        return;
    pt_mutex_lock(&cloud->paged->lock);
    if (renew)
        atomic_fetch_add(&cloud->paged->pictures, 1);
    if (renew && !cloud->paged->inside)
        renew_chunks((struct patina_cloud *)(uintptr_t)cloud);
    cloud->paged->inside++;
    pt_mutex_unlock(&cloud->paged->lock);
}

void pt_paged_leave(const struct patina_cloud *cloud)
{
    if (!cloud->paged)
        return;
    pt_mutex_lock(&cloud->paged->lock);
    cloud->paged->inside--;
    pt_mutex_unlock(&cloud->paged->lock);
}

int pt_paged_absent(const struct patina_cloud *cloud)
{
    return cloud->paged && atomic_load(&cloud->paged->arrived) < cloud->paged->page_count;
}

int pt_paged_refuse(const struct patina_cloud *cloud, const char *call)
{
    if (!pt_paged_absent(cloud))
        return PATINA_OK;
    return pt_fail(&cloud->handle, PATINA_ERROR_UNSUPPORTED, "%s: points of the cloud are still on their way", call);
}

// ---- what plans want ---------------------------------------------------------------------------------------------------

static float float_of(uint32_t bits)
{
    float f;
    memcpy(&f, &bits, sizeof f);
    return f;
}

int pt_paged_look(const struct patina_cloud *cloud, uint32_t c, double gap)
{
    struct pt_paged *paged = cloud->paged;
    if (!paged)
        return 1;
    struct pt_page *page = &paged->pages[paged->page_of[c]];
    atomic_store_explicit(&page->used, atomic_load_explicit(&paged->pictures, memory_order_relaxed), memory_order_relaxed);
    if (cloud->chunks[c].count)
        return 1;
    const float wide = gap > 1e-30 ? (float)fmin(gap, 1e30) : 1e-30f;
    uint32_t bits;
    memcpy(&bits, &wide, sizeof bits); // of positive floats the greater has the greater bits
    unsigned known = atomic_load(&page->wanted);
    while (bits > known && !atomic_compare_exchange_weak(&page->wanted, &known, bits))
        ;
    return 0;
}

struct wish {
    float gap;
    uint32_t page;
};

static int by_gap(const void *a, const void *b)
{
    const struct wish *x = a, *y = b;
    return x->gap != y->gap ? (x->gap < y->gap) - (x->gap > y->gap) : (x->page > y->page) - (x->page < y->page);
}

int patina_cloud_wanted(patina_cloud *cloud, double least_px, uint32_t *pages, uint32_t room, uint32_t *count)
{
    if (!cloud || !count || (room && !pages) || isnan(least_px))
        return pt_fail(cloud ? &cloud->handle : NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_wanted: bad arguments");
    *count = 0;
    struct pt_paged *paged = cloud->paged;
    if (!paged)
        return PATINA_OK;
    struct wish *list = malloc((paged->page_count + 1u) * sizeof *list);
    if (!list)
        return pt_fail(&cloud->handle, PATINA_ERROR_MEMORY, "patina_cloud_wanted: out of memory");
    uint32_t found = 0;
    uint64_t points = 0;
    for (uint32_t p = 0; p < paged->page_count; p++) {
        struct pt_page *page = &paged->pages[p];
        const float gap = float_of(atomic_exchange(&page->wanted, 0));
        if (!(gap > 0.0f) || !((double)gap > least_px) || atomic_load(&page->state) != PT_PAGE_ABSENT)
            continue;
        list[found++] = (struct wish){gap, p};
        points += page->told.count;
    }
    qsort(list, found, sizeof *list, by_gap);
    for (; *count < found && *count < room; ++*count)
        pages[*count] = list[*count].page;
    free(list);
    pt_mutex_lock(&paged->lock);
    paged->wanted = points;
    paged->pages_wanted = found;
    pt_mutex_unlock(&paged->lock);
    return PATINA_OK;
}

int patina_cloud_get_pages(patina_cloud *cloud, patina_pages_info *info)
{
    if (!cloud)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_get_pages: cloud is NULL");
    struct pt_paged *paged = cloud->paged;
    if (!paged)
        return pt_fail(&cloud->handle, PATINA_ERROR_EMPTY, "patina_cloud_get_pages: the cloud has no pages");
    pt_mutex_lock(&paged->lock);
    const patina_pages_info told = {.struct_size = sizeof told,
                                    .points = cloud->info.count,
                                    .arrived = paged->points + atomic_load(&paged->coming),
                                    .pages = paged->page_count,
                                    .pages_arrived = atomic_load(&paged->arrived),
                                    .wanted = paged->wanted,
                                    .pages_wanted = paged->pages_wanted,
                                    .returned = paged->returned};
    pt_mutex_unlock(&paged->lock);
    return pt_give(&cloud->handle, "patina_cloud_get_pages", &told, sizeof told, info);
}

// ---- the end -------------------------------------------------------------------------------------------------------

void pt_paged_destroy(struct patina_cloud *cloud)
{
    struct pt_paged *paged = cloud->paged;
    if (!paged)
        return;
    for (uint32_t p = 0; p < paged->page_count && paged->pages; p++)
        free(paged->pages[p].chunks);
    free(paged->pages);
    free(paged->page_of);
    pt_mutex_destroy(&paged->lock);
    free(paged);
}
