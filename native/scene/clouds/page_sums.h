// SPDX-License-Identifier: GPL-3.0-or-later
// A page is a chunk: what each of its arrays in the file must sum up to, so that a picture finds damage where it reads (SPEC 13). A file that
// is mapped may also lose pages afterwards: it was cut short, or its disk is gone (base/guard.h).
#ifndef PT_PAGE_SUMS_H
#define PT_PAGE_SUMS_H

#include "cloud.h"
#include "fingerprint.h"

// Of the arrays that lie point by point: from positions to shapes.
enum { PT_SUMMED = PT_ARRAY_SHAPES };

// As they lie in a file: of chunk c and array a the sum [c * PT_SUMMED + a - 1]; 0 where there is no such array.
static inline size_t pt_page_sum_bytes(uint64_t chunks) { return (size_t)chunks * PT_SUMMED * sizeof(uint32_t); }

// Of a whole file; its parts (parts.h) point to the same, so that damage that one finds all know, and pages count in the whole.
struct pt_page_sums {
    uint32_t *sums;      // NULL: the file has none
    atomic_uint *states; // a chunk: bits 1 << array: is as it was written; PT_PAGE_DAMAGED: is not, and is left out
    atomic_uint damaged; // how many
    atomic_uint untold;  // since the log was told of some
    atomic_uint lost;    // of the damaged ones: those that cannot be read any more
    atomic_int lost_told;
    _Atomic uint64_t losses; // pt_disk_losses when pages were last looked through for them
    uint32_t chunk_count, arrays;
    char *path; // of the file
};
enum { PT_PAGE_DAMAGED = 1, PT_PAGE_LOST = 1 << 29, PT_PAGE_TOLD = 1 << 30 };

// Makes those of a file that is written: arrays come in pieces, each from chunk to chunk.
struct pt_page_summing {
    uint32_t *sums;
    struct pt_sum sum[PT_ARRAYS]; // of the chunk at hand
    uint32_t chunk[PT_ARRAYS];
    uint64_t left[PT_ARRAYS]; // bytes that the chunk has yet
};
int pt_page_summing_begin(struct pt_page_summing *summing, uint32_t chunks);
void pt_page_summing_add(struct pt_page_summing *summing, const struct patina_cloud *cloud, enum pt_array array,
                         const void *data, size_t size);
void pt_page_summing_end(struct pt_page_summing *summing);

// Takes over `sums`. NULL without memory.
struct pt_page_sums *pt_page_sums_create(const struct patina_cloud *cloud, uint32_t *sums, const char *path);
void pt_page_sums_destroy(struct pt_page_sums *pages); // NULL is fine

// The chunk that begins at a slot.
uint32_t pt_page_at(const struct patina_cloud *cloud, uint32_t first);
// Whether some chunk, of a part's whole too, or this one, was found to be damaged.
int pt_pages_are_damaged(const struct patina_cloud *cloud);
int pt_page_is_damaged(const struct patina_cloud *cloud, uint32_t chunk);
// Whether these arrays (bits 1 << pt_array) of the chunk need a look yet: those that lie in the file. Any thread.
uint32_t pt_page_unseen(const struct patina_cloud *cloud, uint32_t chunk, uint32_t arrays);
// Looks at them. 1: it is damaged, and was not known to be before this look; of several threads at once each is told. Any thread.
int pt_page_check(const struct patina_cloud *cloud, uint32_t chunk, uint32_t arrays);
// One line of the log on all pages that were found since it was told last; none where there are none. Any thread.
void pt_pages_tell(const struct patina_cloud *cloud);
// Of a cloud that is no part. Looks for pages that cannot be read any more, which are damaged from now on. Returns how many there are. Costs
// nothing while no mapped file lost any. Any thread.
uint32_t pt_pages_lose(const struct patina_cloud *cloud);
// Points of such pages that are known.
uint64_t pt_pages_lost_points(const struct patina_cloud *cloud);
// One line of the log, once for each cloud that lost some. Any thread.
void pt_pages_tell_lost(const struct patina_cloud *cloud);
// PATINA_ERROR_FILE, with a message at the cloud and the thread, where pages of it are lost: what was made of its points is worth nothing.
int pt_pages_fail_lost(const struct patina_cloud *cloud);
// Looks at all that lies in the file: nothing of a damaged page may be written as if it were good. PATINA_ERROR_FORMAT, which names file
// and page; PATINA_ERROR_CANCELLED. held: bytes after which what was read is given back.
int pt_pages_refuse(const struct patina_cloud *cloud, uint64_t held, patina_progress *progress);

#endif
