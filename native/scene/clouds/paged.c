// SPDX-License-Identifier: GPL-3.0-or-later
// Pages as pictures see them: what arrived becomes part of the cloud, what plans want is remembered.
#include "paged_table.h"

#include "base/compare.h"
#include "base/descriptor.h"
#include "base/platform.h"
#include "fingerprint.h"
#include "parts.h"
#include "shared/view.h"
#include "shared/words.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static uint32_t bytes_of_point(const struct patina_cloud *cloud)
{
    return 20 + (uint32_t)pt_color_size(cloud->color_format) + 4 * cloud->info.has_scalars + cloud->info.has_classes;
}

// ---- what arrived becomes part of the cloud ----------------------------------------------------------------------------

// Whether one of the last two pictures would have had it. What nobody looks at counts as if it were there: a picture for which all has
// arrived that it shows is that of the whole cloud.
static int is_missing(const struct pt_page_mark *mark, uint32_t pictures)
{
    return atomic_load(&mark->state) != PT_PAGE_PRESENT && atomic_load(&mark->used) + 2 >= pictures;
}

// Points as dense as those of a page, of all over it and of all beneath it together, in points per area. A page's points tell how large
// its surface is; what lies beneath it shares that surface.
static void densities(struct pt_paged *paged)
{
    double *beneath = paged->beneath, *over = paged->over;
    const uint32_t pictures = atomic_load(&paged->pictures);
    memset(beneath, 0, paged->page_count * sizeof *beneath);
    for (uint32_t p = paged->page_count;
         p-- > 0;) { // points of its subtree that are missing, leaves first; all are whole numbers
        const struct pt_page_mark *mark = &paged->marks[p];
        beneath[p] += is_missing(mark, pictures) ? mark->count : 0.0;
        if (beneath[p] > 0.0 && mark->parent != PATINA_NO_PAGE)
            beneath[mark->parent] += beneath[p];
    }
    for (uint32_t i = 0; i < paged->present; i++) {
        const uint32_t p = paged->there[i];
        uint32_t above = paged->marks[p].parent;
        while (above != PATINA_NO_PAGE && atomic_load(&paged->marks[above].state) != PT_PAGE_PRESENT)
            above = paged->marks[above].parent;
        const double area = above == PATINA_NO_PAGE ? 0.0 : paged->pages[above].arrived->area;
        over[p] = above == PATINA_NO_PAGE ? 0.0 : over[above] + (area > 0.0 ? paged->marks[above].count / area : 0.0);
        beneath[p] = (paged->totals[p] - beneath[p]) / paged->marks[p].count; // times what its own points come to
    }
}

// The page's chunks: spacings of all that is there, and their classes in the words of the points. Whether any changed.
static int settle_page(struct pt_paged *paged, uint32_t p)
{
    const struct patina_cloud *whole = paged->whole;
    const struct pt_page *page = &paged->pages[p];
    uint32_t *surfels = whole->surfels + page->first_slot;
    int changed = 0;
    for (uint32_t i = 0; i < page->chunk_count; i++) {
        struct pt_chunk *chunk = &whole->chunks[page->first_chunk + i];
        const double own = (double)page->arrived->chunks[i].spacing;
        const float spacing = own > 0.0 ? (float)(1.0 / sqrt(paged->over[p] + paged->beneath[p] / (own * own))) : 0.0f;
        changed |= chunk->spacing != spacing;
        chunk->spacing = chunk->built = spacing;
        const uint32_t class = pt_class_of_spacing((double)spacing, whole->spacing_base) << PT_SPACING_SHIFT;
        const uint32_t normals = (1u << PT_SPACING_SHIFT) - 1u;
        if ((surfels[0] & ~normals) != class)
            for (uint32_t k = 0; k < chunk->padded; k++)
                surfels[k] = (surfels[k] & normals) | class;
        surfels += chunk->padded;
    }
    return changed;
}

static void settle_spacings(struct patina_cloud *cloud)
{
    struct pt_paged *paged = cloud->paged;
    patina_cloud_info *info = &cloud->info;
    double *known = malloc((paged->present_chunks + 1u) * sizeof *known);
    uint32_t count = 0;
    for (uint32_t i = 0; known && i < paged->present; i++) {
        const struct pt_page *page = &paged->pages[paged->there[i]];
        for (uint32_t c = 0; c < page->chunk_count; c++)
            known[count++] = (double)cloud->chunks[page->first_chunk + c].spacing;
    }
    if (count) {
        qsort(known, count, sizeof *known, pt_compare_doubles);
        info->spacing = known[count / 2];
        info->spacing_min = known[0];
        info->spacing_max = known[count - 1];
        info->layer_distance = (double)PT_SPACING_FACTOR * info->spacing;
        cloud->built = info->spacing;
    }
    free(known);
}

static void sum_up(struct patina_cloud *cloud)
{
    struct pt_paged *paged = cloud->paged;
    patina_cloud_info *info = &cloud->info;
    info->drawn = paged->points;
    info->bytes = paged->held + paged->present_chunks * sizeof *cloud->chunks;
    info->invalid_normals = info->invalid_colors = 0;
    memset(info->class_bits, 0, sizeof info->class_bits);
    float least = INFINITY, most = -INFINITY;
    for (uint32_t i = 0; i < paged->present; i++) {
        const patina_cloud_info *own = &paged->pages[paged->there[i]].arrived->info;
        info->invalid_normals += own->invalid_normals;
        info->invalid_colors += own->invalid_colors;
        for (int k = 0; k < 8; k++)
            info->class_bits[k] |= own->class_bits[k];
        least = fminf(least, own->scalar_range[0]);
        most = fmaxf(most, own->scalar_range[1]);
    }
    info->scalar_range[0] = least <= most ? least : 0.0f;
    info->scalar_range[1] = least <= most ? most : 0.0f;
    settle_spacings(cloud);
    const int whole = paged->present == paged->page_count; // as a saved file has it
    cloud->class_hash = !info->has_classes ? 0
                        : whole            ? pt_fingerprint(1, cloud->classes, cloud->slots)
                                           : pt_fingerprint(cloud->class_hash, &paged->points, sizeof paged->points);
    atomic_store(&cloud->alive->fingerprint, 0);
    atomic_fetch_add(&cloud->alive->pages, 1);
    pt_paged_tell_parts(paged);
}

static void count_below(struct pt_paged *paged, uint32_t p, uint32_t by)
{
    const uint32_t parent = paged->marks[p].parent;
    if (parent != PATINA_NO_PAGE)
        paged->marks[parent].below += by;
}

static void arrived_free(struct pt_page *page)
{
    if (page->arrived)
        free(page->arrived->chunks);
    free(page->arrived);
    page->arrived = NULL;
}

static void drop_page(struct patina_cloud *cloud, uint32_t p)
{
    struct pt_paged *paged = cloud->paged;
    struct pt_page *page = &paged->pages[p];
    pt_page_forget(cloud, page);
    arrived_free(page);
    memset(cloud->chunks + page->first_chunk, 0, page->chunk_count * sizeof *cloud->chunks);
    paged->held -= page->slots * bytes_of_point(cloud);
    paged->points -= page->told.count;
    paged->returned++;
    count_below(paged, p, -1u);
    atomic_fetch_sub(&paged->arrived, 1);
    atomic_store(&paged->marks[p].wanted, 0);
    atomic_store(&paged->marks[p].state, PT_PAGE_ABSENT);
}

// ---- pages are given back ----------------------------------------------------------------------------------------------

struct oldest { // a heap
    const struct pt_page_mark *marks;
    uint32_t *pages, count;
};

static int goes_first(const struct oldest *heap, uint32_t a, uint32_t b)
{
    const uint32_t x = atomic_load(&heap->marks[a].used), y = atomic_load(&heap->marks[b].used);
    return x != y ? x < y : a > b;
}

static void put(struct oldest *heap, uint32_t page)
{
    uint32_t at = heap->count++;
    for (; at && goes_first(heap, page, heap->pages[(at - 1) / 2]); at = (at - 1) / 2)
        heap->pages[at] = heap->pages[(at - 1) / 2];
    heap->pages[at] = page;
}

static uint32_t take(struct oldest *heap)
{
    const uint32_t first = heap->pages[0], last = heap->pages[--heap->count];
    uint32_t at = 0;
    for (uint32_t next = 1; next < heap->count; next = 2 * at + 1) {
        next += next + 1 < heap->count && goes_first(heap, heap->pages[next + 1], heap->pages[next]);
        if (!goes_first(heap, heap->pages[next], last))
            break;
        heap->pages[at] = heap->pages[next];
        at = next;
    }
    heap->pages[at] = last;
    return first;
}

static int may_go(const struct pt_paged *paged, uint32_t p)
{
    const struct pt_page_mark *mark = &paged->marks[p];
    return atomic_load(&mark->state) == PT_PAGE_PRESENT && !mark->below &&
           atomic_load(&mark->used) + 1 < atomic_load(&paged->pictures);
}

// Of pages that no later picture wanted, and that no present one lies beneath, those of the earliest picture go first. Where all are
// needed the cap is overshot.
static int give_back(struct patina_cloud *cloud)
{
    struct pt_paged *paged = cloud->paged;
    if (!paged->cap || paged->held <= paged->cap)
        return 0;
    struct oldest heap = {.marks = paged->marks, .pages = malloc((paged->present + 1u) * sizeof *heap.pages)};
    int some = 0;
    for (uint32_t i = 0; heap.pages && i < paged->present; i++)
        if (may_go(paged, paged->there[i]))
            put(&heap, paged->there[i]);
    while (heap.count && paged->held > paged->cap) {
        const uint32_t p = take(&heap), parent = paged->marks[p].parent;
        drop_page(cloud, p);
        if (parent != PATINA_NO_PAGE && may_go(paged, parent))
            put(&heap, parent);
        some = 1;
    }
    free(heap.pages);
    return some;
}

// ---- pages arrive ------------------------------------------------------------------------------------------------------

static void publish(struct patina_cloud *cloud, uint32_t p)
{
    struct pt_paged *paged = cloud->paged;
    struct pt_page *page = &paged->pages[p];
    uint64_t first = page->first_slot - pt_page_part(paged, page)->first_slot;
    double area = 0.0;
    for (uint32_t i = 0; i < page->chunk_count; i++) {
        struct pt_chunk *chunk = &cloud->chunks[page->first_chunk + i];
        *chunk = page->arrived->chunks[i];
        chunk->first = (uint32_t)first;
        chunk->gap = (float)page->told.gap;
        first += chunk->padded;
        area += chunk->count * (double)chunk->spacing * (double)chunk->spacing;
        paged->page_of[page->first_chunk + i] = p;
    }
    page->arrived->area = area;
    page->arrivals++;
    paged->held += page->slots * bytes_of_point(cloud);
    paged->points += page->told.count;
    count_below(paged, p, 1);
    atomic_fetch_sub(&paged->coming, page->told.count);
    atomic_store(&paged->marks[p].used, atomic_load(&paged->pictures));
    atomic_store(&paged->marks[p].state, PT_PAGE_PRESENT);
}

static void gather_present(struct pt_paged *paged)
{
    paged->present = paged->present_chunks = 0;
    for (uint32_t p = 0; p < paged->page_count; p++)
        if (atomic_load(&paged->marks[p].state) == PT_PAGE_PRESENT) {
            paged->there[paged->present++] = p;
            paged->present_chunks += paged->pages[p].chunk_count;
        }
}

// With the lock, and nobody inside.
static void renew_chunks(struct patina_cloud *cloud)
{
    struct pt_paged *paged = cloud->paged;
    int some = paged->waiting > 0;
    for (uint32_t i = 0; i < paged->waiting; i++)
        publish(cloud, paged->staged[i]);
    paged->waiting = 0;
    if (some)
        gather_present(paged);
    if (give_back(cloud)) {
        gather_present(paged);
        some = 1;
    }
    if (!some && (!paged->present || paged->present == paged->page_count))
        return;
    densities(paged);
    for (uint32_t i = 0; i < paged->present; i++)
        some |= settle_page(paged, paged->there[i]);
    if (some)
        sum_up(cloud);
}

// The door of pictures is const, for what they see does not change; what arrived is no part of any picture yet. Of parts the first opens it.
void pt_paged_enter(const struct patina_cloud *cloud, int renew)
{
    if (!cloud->paged)
        return;
    pt_mutex_lock(&cloud->paged->lock);
    if (renew && !cloud->first_chunk)
        atomic_fetch_add(&cloud->paged->pictures, 1);
    if (renew && !cloud->first_chunk && !cloud->paged->inside)
        renew_chunks(cloud->paged->whole);
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

int pt_paged_whole(const struct patina_cloud *cloud)
{
    return !cloud->paged || cloud->paged->present == cloud->paged->page_count;
}

int pt_paged_refuse(const struct patina_cloud *cloud, const char *call)
{
    if (cloud->paged && cloud->part_count)
        return pt_fail(&cloud->handle, PATINA_ERROR_TOO_MANY_POINTS,
                       "%s: does not take a cloud in pages of more than 2147483647 points yet, and these are %llu", call,
                       (unsigned long long)cloud->info.count);
    if (!cloud->paged)
        return PATINA_OK;
    pt_mutex_lock(&cloud->paged->lock);
    if (!cloud->paged->inside) // what arrived has no chunks yet
        renew_chunks((struct patina_cloud *)(uintptr_t)cloud);
    const int whole = pt_paged_whole(cloud);
    pt_mutex_unlock(&cloud->paged->lock);
    if (whole)
        return PATINA_OK;
    return pt_fail(&cloud->handle, PATINA_ERROR_UNSUPPORTED, "%s: points of the cloud are still on their way", call);
}

int pt_whole_enter(const struct patina_cloud *cloud, const char *call)
{
    const int refused = pt_paged_refuse(cloud, call);
    if (refused)
        return refused;
    pt_paged_enter(cloud, 0); // no picture: what pictures show is no older for it
    if (pt_paged_whole(cloud))
        return PATINA_OK;
    pt_paged_leave(cloud); // pages were given back in between
    return pt_fail(&cloud->handle, PATINA_ERROR_UNSUPPORTED, "%s: points of the cloud are not all there", call);
}

int pt_undivided_enter(const struct patina_cloud *cloud, const char *call)
{
    const int refused = pt_parts_refuse(cloud, call);
    return refused ? refused : pt_whole_enter(cloud, call);
}

// ---- what plans want ---------------------------------------------------------------------------------------------------

static float float_of(uint32_t bits)
{
    float f;
    memcpy(&f, &bits, sizeof f);
    return f;
}

static void use(const struct pt_paged *paged, struct pt_page_mark *mark)
{
    atomic_store_explicit(&mark->used, atomic_load_explicit(&paged->pictures, memory_order_relaxed), memory_order_relaxed);
}

void pt_paged_look(const struct patina_cloud *cloud, uint32_t c)
{
    if (cloud->paged)
        use(cloud->paged, &cloud->paged->marks[cloud->paged->page_of[cloud->first_chunk + c]]);
}

void pt_page_want(const struct patina_cloud *cloud, uint32_t page, double gap)
{
    struct pt_page_mark *mark = &cloud->paged->marks[page];
    const float wide = gap > 1e-30 ? (float)fmin(gap, 1e30) : 1e-30f;
    uint32_t bits;
    use(cloud->paged, mark);
    memcpy(&bits, &wide, sizeof bits); // of positive floats the greater has the greater bits
    unsigned known = atomic_load(&mark->wanted);
    while (bits > known && !atomic_compare_exchange_weak(&mark->wanted, &known, bits))
        ;
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
        struct pt_page_mark *mark = &paged->marks[p];
        const float gap = atomic_load(&mark->wanted) ? float_of(atomic_exchange(&mark->wanted, 0)) : 0.0f;
        if (!(gap > 0.0f) || !((double)gap > least_px) || atomic_load(&mark->state) != PT_PAGE_ABSENT)
            continue;
        list[found++] = (struct wish){gap, p};
        points += mark->count;
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
        arrived_free(&paged->pages[p]);
    pt_pages_free(paged->page_of, (size_t)cloud->chunk_count * sizeof *paged->page_of);
    free(paged->pages);
    free(paged->marks);
    free(paged->ways);
    free(paged->reaches);
    free(paged->totals);
    free(paged->beneath);
    free(paged->over);
    free(paged->there);
    free(paged->staged);
    pt_mutex_destroy(&paged->lock);
    free(paged);
}
