// SPDX-License-Identifier: GPL-3.0-or-later
// A cloud of pages begins, and pages are handed in: each is built as a cloud of its own, and copied into the slots that its count
// reserved.
#include "paged_table.h"

#include "base/descriptor.h"
#include "base/platform.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static uint32_t chunks_of(uint32_t count) { return count / PT_CHUNK_POINTS + (count % PT_CHUNK_POINTS != 0); }

// ---- a page arrives ----------------------------------------------------------------------------------------------------

static int bad_page(const struct patina_cloud *cloud, uint32_t index, const char *what)
{
    return pt_fail(&cloud->handle, PATINA_ERROR_FORMAT, "page %u is damaged: %s", index, what);
}

// What its points are beside what was promised of them. A rounding of float32 beyond the box is none.
static int check_page(const struct patina_cloud *cloud, uint32_t index, const struct patina_cloud *made)
{
    const struct pt_page *page = &cloud->paged->pages[index];
    if (made->info.drawn != page->told.count)
        return bad_page(cloud, index, "points without a finite position");
    for (int k = 0; k < 3; k++) {
        const double low = page->told.box_min[k], high = page->told.box_max[k];
        const double slack = 1e-6 * (high - low) + 1e-7 * fmax(fabs(low), fabs(high));
        if (made->info.box_min[k] < low - slack || made->info.box_max[k] > high + slack)
            return bad_page(cloud, index, "points outside of its box");
    }
    int same = made->chunk_count == page->chunk_count && made->slots == page->slots;
    for (uint32_t i = 0; i < page->chunk_count && same; i++)
        same = made->chunks[i].padded == pt_page_padded(page, i);
    return same ? PATINA_OK : pt_fail(&cloud->handle, PATINA_ERROR_INTERNAL, "page %u was cut otherwise than promised", index);
}

static void copy_page(struct patina_cloud *cloud, struct pt_page *page, const struct patina_cloud *made)
{
    const uint64_t at = page->first_slot, slots = page->slots, color = pt_color_size(cloud->color_format);
    memcpy((float *)cloud->positions + 3 * at, made->positions, 12 * slots);
    memcpy(cloud->surfels + at, made->surfels, 4 * slots);
    const uint32_t number = pt_page_number(cloud->paged, page);
    for (uint64_t i = 0; i < slots; i++)
        cloud->order[at + i] = number + made->order[i];
    if (color)
        memcpy((char *)cloud->colors + color * at, made->colors, color * slots);
    if (cloud->scalars)
        memcpy(cloud->scalars + at, made->scalars, 4 * slots);
    if (cloud->classes)
        memcpy(cloud->classes + at, made->classes, slots);
}

static int check_promise(const struct patina_cloud *cloud, uint32_t index, const patina_cloud_desc *desc)
{
    const struct pt_page *page = &cloud->paged->pages[index];
    if (desc->count != page->told.count)
        return pt_fail(&cloud->handle, PATINA_ERROR_FORMAT, "page %u is damaged: %llu points in place of %u", index,
                       (unsigned long long)desc->count, page->told.count);
    const uint32_t color = desc->color.data ? desc->color.type : PATINA_NONE;
    if (pt_color_format_of(color) != cloud->color_format || (desc->normal.data != NULL) != cloud->info.has_normals ||
        (desc->scalar.data != NULL) != cloud->info.has_scalars || (desc->classes.data != NULL) != cloud->info.has_classes)
        return bad_page(cloud, index, "other attributes than the cloud's");
    if (desc->opacity.data || desc->radius.data)
        return bad_page(cloud, index, "opacities and radii do not come in pages");
    return PATINA_OK;
}

int patina_cloud_page_give(patina_cloud *cloud, uint32_t index, const patina_cloud_desc *desc)
{
    patina_cloud_desc checked;
    struct patina_cloud *made = NULL;
    if (!cloud || !desc || !cloud->paged || index >= cloud->paged->page_count)
        return pt_fail(cloud ? &cloud->handle : NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_page_give: there is no such page");
    int error = pt_take(&cloud->handle, "patina_cloud_page_give", desc, &checked, sizeof checked);
    if (error || (error = check_promise(cloud, index, &checked)))
        return error;
    if ((error = pt_cloud_check_desc(&checked)))
        return pt_fail_again(&cloud->handle, error);
    struct pt_paged *paged = cloud->paged;
    struct pt_page *page = &paged->pages[index];
    int absent = PT_PAGE_ABSENT;
    if (!atomic_compare_exchange_strong(&paged->marks[index].state, &absent, PT_PAGE_COMING))
        return pt_fail(&cloud->handle, PATINA_ERROR_EMPTY, "page %u is there already", index);
    checked.threads = 1; // pages come side by side
    struct pt_pool *pool = pt_pool_create(checked.threads, 0);
    error = pt_cloud_tell(pt_cloud_build(&checked, PT_BUILD_EVENLY, NULL, pool, NULL, &made), checked.count);
    pt_pool_destroy(pool);
    struct pt_arrived *arrived = error ? NULL : malloc(sizeof *arrived);
    error = error      ? pt_fail_again(&cloud->handle, error)
            : !arrived ? pt_fail(&cloud->handle, PATINA_ERROR_MEMORY, "page %u: out of memory", index)
                       : check_page(cloud, index, made);
    if (!error && !(error = pt_page_need(cloud, index))) {
        copy_page(cloud, page, made);
        *arrived = (struct pt_arrived){.chunks = made->chunks, .info = made->info};
        page->arrived = arrived;
        made->chunks = NULL;
        pt_mutex_lock(&paged->lock);
        paged->staged[paged->waiting++] = index;
        atomic_fetch_add(&paged->arrived, 1);
        atomic_fetch_add(&paged->coming, page->told.count);
        atomic_store(&paged->marks[index].state, PT_PAGE_STAGED);
        pt_mutex_unlock(&paged->lock);
    } else {
        free(arrived);
        atomic_store(&paged->marks[index].state, PT_PAGE_ABSENT);
    }
    patina_cloud_destroy(made);
    return error;
}

// ---- begin and end -----------------------------------------------------------------------------------------------------

static int check_pages(const patina_pages_desc *desc)
{
    uint64_t chunks = 0;
    if (!desc->page_count || !desc->pages)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_pages_begin: no pages");
    const uint32_t colors = 1u << PATINA_NONE | 1u << PATINA_UINT8 | 1u << PATINA_UINT16 | 1u << PATINA_FLOAT32;
    if (desc->color_type > PATINA_INT32 || !(colors >> desc->color_type & 1u))
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "color: element type %u is not supported", desc->color_type);
    for (uint32_t p = 0; p < desc->page_count; p++) {
        const patina_page *page = &desc->pages[p];
        int good = page->count && page->gap > 0.0 && isfinite(page->gap) &&
                   (page->parent == PATINA_NO_PAGE || page->parent < p);
        for (int k = 0; k < 3; k++)
            good &= isfinite(page->box_min[k]) && isfinite(page->box_max[k]) && page->box_min[k] <= page->box_max[k];
        if (!good)
            return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "page %u: no points, no box, no gap, or a parent behind it", p);
        if (page->count + (uint64_t)(PT_CHUNK_ALIGN - 1) * chunks_of(page->count) >
            0x7FFFFFFF) // of a part: gathers take signed indices
            return pt_fail(NULL, PATINA_ERROR_TOO_MANY_POINTS, "page %u has %u points: at most 2147483647 fit into one", p,
                           page->count);
        chunks += chunks_of(page->count);
    }
    return chunks < UINT32_MAX ? PATINA_OK
                               : pt_fail(NULL, PATINA_ERROR_TOO_MANY_POINTS, "%llu chunks of points: at most 4294967294 fit",
                                         (unsigned long long)chunks);
}

static void lay_out(struct patina_cloud *cloud, const patina_pages_desc *desc)
{
    struct pt_paged *paged = cloud->paged;
    double finest = INFINITY;
    uint32_t chunk = 0;
    for (uint32_t p = 0; p < desc->page_count; p++) {
        struct pt_page *page = &paged->pages[p];
        *page = (struct pt_page){.told = desc->pages[p],
                                 .first_chunk = chunk,
                                 .chunk_count = chunks_of(desc->pages[p].count),
                                 .first_number = cloud->info.count,
                                 .first_slot = cloud->slots};
        for (uint32_t i = 0; i < page->chunk_count; i++)
            page->slots += pt_page_padded(page, i);
        paged->marks[p].count = page->told.count;
        paged->marks[p].parent = page->told.parent;
        chunk += page->chunk_count;
        cloud->slots += page->slots;
        cloud->info.count += page->told.count;
        finest = fmin(finest, page->told.gap);
    }
    // Known before any point is: sixteen octaves of classes from here on. Leaves may be denser than their gap says.
    cloud->spacing_base = finest / 64.0;
    const int given = memcmp(desc->box_min, desc->box_max, sizeof desc->box_min) != 0;
    for (int k = 0; k < 3; k++) {
        cloud->info.box_min[k] = given ? desc->box_min[k] : INFINITY;
        cloud->info.box_max[k] = given ? desc->box_max[k] : -INFINITY;
        for (uint32_t p = 0; p < desc->page_count && !given; p++) {
            cloud->info.box_min[k] = fmin(cloud->info.box_min[k], desc->pages[p].box_min[k]);
            cloud->info.box_max[k] = fmax(cloud->info.box_max[k], desc->pages[p].box_max[k]);
        }
    }
}

static int begin(struct patina_cloud *cloud, const patina_pages_desc *desc)
{
    struct pt_paged *paged = cloud->paged = calloc(1, sizeof *paged);
    if (!paged)
        return PATINA_ERROR_MEMORY;
    pt_mutex_init(&paged->lock);
    for (uint32_t p = 0; p < desc->page_count; p++)
        cloud->chunk_count += chunks_of(desc->pages[p].count);
    paged->whole = cloud;
    paged->page_count = desc->page_count;
    paged->cap = desc->memory_cap;
    paged->pages = calloc(desc->page_count, sizeof *paged->pages);
    paged->marks = calloc(desc->page_count, sizeof *paged->marks);
    paged->ways = malloc(desc->page_count * sizeof *paged->ways);
    paged->there = calloc(desc->page_count, sizeof *paged->there);
    paged->staged = malloc(desc->page_count * sizeof *paged->staged);
    paged->totals = malloc(desc->page_count * sizeof *paged->totals);
    paged->beneath = malloc(desc->page_count * sizeof *paged->beneath);
    paged->over = malloc(desc->page_count * sizeof *paged->over);
    paged->page_of = pt_paged_table(cloud->chunk_count * sizeof *paged->page_of);
    cloud->chunks = pt_paged_table(cloud->chunk_count * sizeof *cloud->chunks);
    paged->table = cloud->chunks ? cloud->chunk_count * sizeof *cloud->chunks : 0;
    if (!paged->pages || !paged->marks || !paged->ways || !paged->there || !paged->staged || !paged->totals ||
        !paged->beneath || !paged->over || !paged->page_of || !cloud->chunks)
        return PATINA_ERROR_MEMORY;
    lay_out(cloud, desc);
    cloud->info.chunks = cloud->chunk_count;
    return pt_paged_tree(paged) || pt_paged_arrays(cloud) || pt_paged_parts(cloud) ? PATINA_ERROR_MEMORY
                                                                                   : pt_paged_firsts(cloud);
}

int patina_cloud_pages_begin(const patina_pages_desc *given, patina_cloud **out)
{
    patina_pages_desc desc;
    if (!given || !out)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_pages_begin: bad arguments");
    *out = NULL;
    int error = pt_take(NULL, "patina_cloud_pages_begin", given, &desc, sizeof desc);
    if (error || (error = check_pages(&desc)))
        return error;
    struct patina_cloud *cloud = pt_cloud_new();
    if (!cloud)
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "a cloud of %u pages: out of memory", desc.page_count);
    cloud->color_format = pt_color_format_of(desc.color_type);
    cloud->info = (patina_cloud_info){.struct_size = sizeof cloud->info,
                                      .has_normals = desc.has_normals != 0,
                                      .normals_oriented = desc.has_normals != 0,
                                      .has_colors = cloud->color_format != PT_COLOR_NONE,
                                      .has_scalars = desc.has_scalars != 0,
                                      .has_classes = desc.has_classes != 0};
    error = begin(cloud, &desc);
    if (error) {
        patina_cloud_destroy(cloud);
        return pt_fail(NULL, error, "a cloud of %u pages: out of memory", desc.page_count);
    }
    *out = cloud;
    return PATINA_OK;
}
