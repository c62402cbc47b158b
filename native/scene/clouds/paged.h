// SPDX-License-Identifier: GPL-3.0-or-later
// Clouds whose points arrive page by page (pages.h of include/, SPEC 14). A page is one or more chunks, whose slots are reserved from its
// count. Pages are copied into their slots at any time: nobody reads slots of chunks that are not there, but for a part's first, and there need
// be no memory for them. The table of chunks is reserved, too, and changes only where a picture begins and no other is drawn: an absent page has
// no entries in it, whoever goes over chunks goes by pt_chunk_from, and sees absent pages as boxes (pt_page_first).
#ifndef PT_PAGED_H
#define PT_PAGED_H

#include "cloud.h"

struct pt_paged;

void pt_paged_destroy(struct patina_cloud *cloud);
// Frees the table of chunks of any cloud.
void pt_chunks_free(struct patina_cloud *cloud);
// Whether all points are part of the cloud, as pictures see it; of others than such a cloud too. Within pt_paged_enter.
int pt_paged_whole(const struct patina_cloud *cloud);
// PATINA_ERROR_UNSUPPORTED, with a message that names the call, where points are on their way.
int pt_paged_refuse(const struct patina_cloud *cloud, const char *call);
// Around calls that go over all points of a cloud: refuses clouds whose points are on their way. pt_paged_leave ends it, where it gave 0.
int pt_whole_enter(const struct patina_cloud *cloud, const char *call);
// The same around calls that take no cloud in parts (parts.h) yet.
int pt_undivided_enter(const struct patina_cloud *cloud, const char *call);

// Around all that reads chunks beside other pictures. enter: takes in the pages that arrived, if `renew` and nobody else is within.
void pt_paged_enter(const struct patina_cloud *cloud, int renew);
void pt_paged_leave(const struct patina_cloud *cloud);

// A plan has chunk c, which is there, in view.
void pt_paged_look(const struct patina_cloud *cloud, uint32_t c);

// ---- what there is to see: paged_tree.c --------------------------------------------------------------------------------

uint32_t pt_paged_chunk_from(const struct patina_cloud *cloud, uint32_t c);
// The first chunk from c on that is there, or chunk_count: of clouds that are not in pages, c.
static inline uint32_t pt_chunk_from(const struct patina_cloud *cloud, uint32_t c)
{
    return cloud->paged && c < cloud->chunk_count ? pt_paged_chunk_from(cloud, c) : c;
}
// Whether points of the cloud are on their way. patina_cloud_pages_begin's clouds alone.
int pt_paged_absent(const struct patina_cloud *cloud);
// How often the page of chunk c, which is there, has arrived: its points are others each time. At least 1.
uint32_t pt_paged_arrivals(const struct patina_cloud *cloud, uint32_t c);
// How many chunks are there, at most.
uint32_t pt_chunks_there(const struct patina_cloud *cloud);

// A walk over the tree of a cloud's pages, parents before their children: of a cloud in parts, over those of all, by the first part alone.
// PATINA_NO_PAGE: the end, and of clouds that are not in pages. below: with the pages beneath this one.
uint32_t pt_page_first(const struct patina_cloud *cloud);
uint32_t pt_page_next(const struct patina_cloud *cloud, uint32_t page, int below);
int pt_page_is_there(const struct patina_cloud *cloud, uint32_t page);
int pt_page_has_below(const struct patina_cloud *cloud, uint32_t page);
int pt_page_nests(const struct patina_cloud *cloud); // no page reaches beyond its parent
// What stands in for its chunks until it arrives: without points, with all classes and shapes. Its box, and its gap.
void pt_page_box(const struct patina_cloud *cloud, uint32_t page, struct pt_chunk *box);
// Around it and all beneath it; of any gap there, the greatest.
void pt_page_around(const struct patina_cloud *cloud, uint32_t page, struct pt_chunk *around);
uint32_t pt_page_chunks(const struct patina_cloud *cloud, uint32_t page);
void pt_page_gaps(const struct patina_cloud *cloud, double *finest, double *coarsest); // of all pages
// A plan has an absent page in view; gap: that of the page over it, pixels. It is remembered as wanted. Any thread.
void pt_page_want(const struct patina_cloud *cloud, uint32_t page, double gap);

#endif
