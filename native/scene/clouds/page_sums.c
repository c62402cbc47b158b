// SPDX-License-Identifier: GPL-3.0-or-later
#include "page_sums.h"

#include "base/platform.h"
#include "base/progress.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uint32_t fold(uint64_t sum) { return (uint32_t)(sum ^ sum >> 32); }

static uint64_t seed_of(uint32_t chunk, enum pt_array array) { return (uint64_t)chunk << 8 | (uint64_t)array; }

// ---- written -----------------------------------------------------------------------------------------------------------

int pt_page_summing_begin(struct pt_page_summing *summing, uint32_t chunks)
{
    *summing = (struct pt_page_summing){.sums = calloc(1, pt_page_sum_bytes(chunks) + 1)};
    return summing->sums ? PATINA_OK : PATINA_ERROR_MEMORY;
}

void pt_page_summing_add(struct pt_page_summing *summing, const struct patina_cloud *cloud, enum pt_array array,
                         const void *data, size_t size)
{
    if (array < PT_ARRAY_POSITIONS || array > PT_ARRAY_SHAPES)
        return;
    for (const char *from = data; size && summing->chunk[array] < cloud->chunk_count;) {
        const uint32_t c = summing->chunk[array];
        uint64_t *left = &summing->left[array];
        if (!*left) {
            *left = (uint64_t)cloud->chunks[c].padded * pt_cloud_array_bytes(cloud, array);
            pt_sum_begin(&summing->sum[array], seed_of(c, array));
        }
        const size_t some = size < *left ? size : (size_t)*left;
        pt_sum_add(&summing->sum[array], from, some);
        from += some;
        size -= some;
        *left -= some;
        if (!*left) {
            summing->sums[(size_t)c * PT_SUMMED + (size_t)array - 1] = fold(pt_sum_end(&summing->sum[array]));
            summing->chunk[array]++;
        }
    }
}

void pt_page_summing_end(struct pt_page_summing *summing)
{
    free(summing->sums);
    summing->sums = NULL;
}

// ---- read --------------------------------------------------------------------------------------------------------------

struct pt_page_sums *pt_page_sums_create(const struct patina_cloud *cloud, uint32_t *sums, const char *path)
{
    struct pt_page_sums *pages = calloc(1, sizeof *pages);
    const size_t length = strlen(path) + 1;
    if (pages) {
        *pages = (struct pt_page_sums){.sums = sums,
                                       .states = calloc((size_t)cloud->chunk_count + 1, sizeof *pages->states),
                                       .chunk_count = cloud->chunk_count,
                                       .losses = pt_disk_losses(),
                                       .path = malloc(length)};
        if (pages->states && pages->path) {
            memcpy(pages->path, path, length);
            return pages;
        }
    } else {
        free(sums);
    }
    pt_page_sums_destroy(pages);
    return NULL;
}

void pt_page_sums_destroy(struct pt_page_sums *pages)
{
    if (!pages)
        return;
    free(pages->sums);
    free(pages->states);
    free(pages->path);
    free(pages);
}

uint32_t pt_page_at(const struct patina_cloud *cloud, uint32_t first)
{
    uint32_t low = 0, high = cloud->chunk_count - 1;
    while (low < high) {
        const uint32_t middle = low + (high - low) / 2;
        if (cloud->chunks[middle].first < first)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

// A part has the sums of the whole, whose pages they count.
static atomic_uint *state_of(const struct patina_cloud *cloud, uint32_t chunk)
{
    return &cloud->page_sums->states[(size_t)cloud->first_chunk + chunk];
}

int pt_pages_are_damaged(const struct patina_cloud *cloud)
{
    return cloud->page_sums && atomic_load_explicit(&cloud->page_sums->damaged, memory_order_relaxed);
}

int pt_page_is_damaged(const struct patina_cloud *cloud, uint32_t chunk)
{
    return cloud->page_sums && atomic_load_explicit(state_of(cloud, chunk), memory_order_relaxed) & PT_PAGE_DAMAGED;
}

uint32_t pt_page_unseen(const struct patina_cloud *cloud, uint32_t chunk, uint32_t arrays)
{
    const uint32_t summed = (2u << PT_ARRAY_SHAPES) - (1u << PT_ARRAY_POSITIONS);
    if (!cloud->page_sums || !cloud->page_sums->sums)
        return 0;
    const uint32_t state = atomic_load_explicit(state_of(cloud, chunk), memory_order_relaxed);
    return state & PT_PAGE_DAMAGED ? 0 : arrays & cloud->mapped & summed & ~state;
}

// Where an array of a chunk lies.
static const char *bytes_of(const struct patina_cloud *cloud, uint32_t c, enum pt_array array, size_t *size)
{
    struct patina_cloud copy = *cloud;
    struct pt_section sections[PT_ARRAYS];
    const uint64_t each = pt_cloud_array_bytes(cloud, array);
    pt_cloud_sections(&copy, sections);
    *size = (size_t)(cloud->chunks[c].padded * each);
    return (const char *)*sections[array].data + pt_chunk_slot(cloud, &cloud->chunks[c]) * each;
}

static int is_good(const struct patina_cloud *cloud, uint32_t c, enum pt_array array)
{
    const uint32_t page = cloud->first_chunk + c;
    size_t size;
    const char *data = bytes_of(cloud, c, array, &size);
    const uint64_t sum = pt_fingerprint(seed_of(page, array), data, size);
    return fold(sum) == cloud->page_sums->sums[(size_t)page * PT_SUMMED + (size_t)array - 1];
}

enum { PT_LOST_BESIDE = 1 << 16 };

static int is_lost(const struct patina_cloud *cloud, uint32_t c)
{
    int lost = 0;
    for (int i = PT_ARRAY_POSITIONS; i <= PT_ARRAY_SHAPES && !lost; i++)
        if (cloud->mapped >> i & 1u) {
            size_t size;
            const char *data = bytes_of(cloud, c, (enum pt_array)i, &size);
            // the last page of a file that was cut ends in zeros, right before the first that is lost
            lost = pt_pages_lost(data, size + PT_LOST_BESIDE);
        }
    return lost;
}

// Marks a chunk; of several threads one is the first.
static void mark_damaged(const struct patina_cloud *cloud, uint32_t c)
{
    const int lost = pt_disk_losses() && is_lost(cloud, c);
    const uint32_t before = atomic_fetch_or(state_of(cloud, c), PT_PAGE_DAMAGED | (lost ? PT_PAGE_LOST : 0));
    if (lost && !(before & PT_PAGE_LOST))
        atomic_fetch_add(&cloud->page_sums->lost, 1);
    if (!(before & PT_PAGE_DAMAGED)) {
        atomic_fetch_add(&cloud->page_sums->damaged, 1);
        atomic_fetch_add(&cloud->page_sums->untold, (unsigned)!lost);
    }
}

int pt_page_check(const struct patina_cloud *cloud, uint32_t chunk, uint32_t arrays)
{
    const uint32_t unseen = pt_page_unseen(cloud, chunk, arrays);
    uint32_t good = 0, bad = 0;
    for (int i = PT_ARRAY_POSITIONS; i <= PT_ARRAY_SHAPES && !bad; i++)
        if (unseen >> i & 1u) {
            if (is_good(cloud, chunk, (enum pt_array)i))
                good |= 1u << i;
            else
                bad = PT_PAGE_DAMAGED;
        }
    if (!(good | bad))
        return 0;
    atomic_fetch_or(state_of(cloud, chunk), good);
    if (bad)
        mark_damaged(cloud, chunk);
    return bad != 0; // to each that found it, though told once
}

// ---- lost --------------------------------------------------------------------------------------------------------------

uint32_t pt_pages_lose(const struct patina_cloud *cloud)
{
    const uint64_t losses = pt_disk_losses();
    struct pt_page_sums *sums = cloud->page_sums;
    if (!sums || !cloud->mapped || !losses)
        return 0;
    if (atomic_load(&sums->losses) != losses) {
        struct patina_cloud copy = *cloud;
        struct pt_section sections[PT_ARRAYS];
        int lost = 0;
        pt_cloud_sections(&copy, sections);
        for (int i = PT_ARRAY_POSITIONS; i <= PT_ARRAY_SHAPES && !lost; i++)
            lost = cloud->mapped >> i & 1u && pt_pages_lost(*sections[i].data, sections[i].size);
        for (uint32_t c = 0; c < cloud->chunk_count && lost; c++)
            if (!(atomic_load_explicit(state_of(cloud, c), memory_order_relaxed) & PT_PAGE_LOST) && is_lost(cloud, c))
                mark_damaged(cloud, c);
        atomic_store(&sums->losses, losses); // behind the marks: who does not look has them
    }
    return atomic_load(&sums->lost);
}

uint64_t pt_pages_lost_points(const struct patina_cloud *cloud)
{
    const struct pt_page_sums *sums = cloud->page_sums;
    uint64_t points = 0;
    for (uint32_t c = 0; sums && atomic_load(&sums->lost) && c < cloud->chunk_count; c++)
        points += atomic_load_explicit(state_of(cloud, c), memory_order_relaxed) & PT_PAGE_LOST ? cloud->chunks[c].count : 0;
    return points;
}

static const char cannot_be_read[] = "%s: parts of the file cannot be read any more: it was cut short, or its disk is gone.";

void pt_pages_tell_lost(const struct patina_cloud *cloud)
{
    struct pt_page_sums *sums = cloud->page_sums;
    char start[256];
    if (!sums || !atomic_load(&sums->lost) || atomic_exchange(&sums->lost_told, 1))
        return;
    snprintf(start, sizeof start, cannot_be_read, sums->path);
    pt_log(PT_LOG_WARNING, "%s Their points are not drawn. Open the file again once it is back", start);
}

int pt_pages_fail_lost(const struct patina_cloud *cloud)
{
    return pt_pages_lose(cloud) ? pt_fail(&cloud->handle, PATINA_ERROR_FILE, cannot_be_read, cloud->page_sums->path)
                                : PATINA_OK;
}

// ---- told --------------------------------------------------------------------------------------------------------------

void pt_pages_tell(const struct patina_cloud *cloud)
{
    struct pt_page_sums *sums = cloud->page_sums;
    uint32_t pages = 0, first = 0;
    uint64_t points = 0;
    if (!sums || !atomic_exchange(&sums->untold, 0))
        return;
    if (sums->chunk_count == cloud->chunk_count) // no part
        pt_pages_lose(cloud);
    const struct pt_chunk *chunks = cloud->chunks - cloud->first_chunk; // of the whole, of which it may be a part
    for (uint32_t c = 0; c < sums->chunk_count; c++)
        if ((sums->states[c] & (PT_PAGE_DAMAGED | PT_PAGE_LOST)) == PT_PAGE_DAMAGED &&
            !(atomic_fetch_or(&sums->states[c], PT_PAGE_TOLD) & PT_PAGE_TOLD)) {
            first = pages++ ? first : c;
            points += chunks[c].count;
        }
    if (!pages)
        return;
    const struct pt_chunk *at = &chunks[first];
    double middle[3];
    for (int k = 0; k < 3; k++)
        middle[k] = at->origin[k] + 0.5 * ((double)at->box_min[k] + (double)at->box_max[k]);
    if (pages == 1)
        pt_log(PT_LOG_WARNING, "%s: page %u of %u is damaged, and its %llu points about (%.10g, %.10g, %.10g) are left out",
               sums->path, first + 1, sums->chunk_count, (unsigned long long)points, middle[0], middle[1], middle[2]);
    else
        pt_log(PT_LOG_WARNING,
               "%s: %u of %u pages are damaged, and their %llu points are left out; the first is page %u, about (%.10g, %.10g, "
               "%.10g)",
               sums->path, pages, sums->chunk_count, (unsigned long long)points, first + 1, middle[0], middle[1], middle[2]);
}

int pt_pages_refuse(const struct patina_cloud *cloud, uint64_t held, patina_progress *progress)
{
    uint32_t pages = 0, first = 0;
    uint64_t each = 0, read = 0;
    for (int i = PT_ARRAY_POSITIONS; i <= PT_ARRAY_SHAPES; i++)
        each += pt_cloud_point_bytes(cloud, (enum pt_array)i);
    for (uint32_t c = 0; cloud->page_sums && c < cloud->chunk_count; c++) {
        const uint64_t bytes = cloud->chunks[c].padded * each;
        if (pt_progress_cancelled(progress))
            return pt_fail(&cloud->handle, PATINA_ERROR_CANCELLED, "%s: cancelled", cloud->page_sums->path);
        if (read && read + bytes > held) {
            pt_cloud_return(cloud);
            read = 0;
        }
        read += bytes;
        pt_page_check(cloud, c, UINT32_MAX);
        if (pt_page_is_damaged(cloud, c))
            first = pages++ ? first : c;
    }
    if (!pages)
        return PATINA_OK;
    if (pages == 1)
        return pt_fail(&cloud->handle, PATINA_ERROR_FORMAT,
                       "%s: page %u of %u is damaged: nothing is written, for it would pass as good", cloud->page_sums->path,
                       first + 1, cloud->chunk_count);
    return pt_fail(&cloud->handle, PATINA_ERROR_FORMAT,
                   "%s: %u of %u pages are damaged, the first is page %u: nothing is written, for they would pass as good",
                   cloud->page_sums->path, pages, cloud->chunk_count, first + 1);
}
