// SPDX-License-Identifier: GPL-3.0-or-later
// Clouds whose points arrive page by page (pages.h of include/, SPEC 14). A page is one or more chunks, whose slots are reserved from its
// count; until it arrives a chunk has no points, all classes, and the page's box. Pages are copied into their slots at any time: no
// picture reads slots of chunks without points. The table of chunks changes only where a picture begins and no other is drawn.
#ifndef PT_PAGED_H
#define PT_PAGED_H

#include "cloud.h"

struct pt_paged;

void pt_paged_destroy(struct patina_cloud *cloud);
// Whether points of the cloud are on their way. patina_cloud_pages_begin's clouds alone.
int pt_paged_absent(const struct patina_cloud *cloud);
// PATINA_ERROR_UNSUPPORTED, with a message that names the call, where points are on their way.
int pt_paged_refuse(const struct patina_cloud *cloud, const char *call);

// Around all that reads chunks beside other pictures. enter: takes in the pages that arrived, if `renew` and nobody else is within.
void pt_paged_enter(const struct patina_cloud *cloud, int renew);
void pt_paged_leave(const struct patina_cloud *cloud);

// A plan has chunk c in view; gap: that of the page over it, pixels. Absent pages are remembered as wanted. Any thread. Whether the
// chunk has points.
int pt_paged_look(const struct patina_cloud *cloud, uint32_t c, double gap);

#endif
