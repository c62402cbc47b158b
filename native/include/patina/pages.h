// SPDX-License-Identifier: GPL-3.0-or-later
// Clouds whose points arrive page by page, a part of patina.h, which includes it. Its conventions and thread rules hold here too.
#ifndef PATINA_PAGES_H
#define PATINA_PAGES_H

#ifndef PATINA_H
#error "include patina/patina.h"
#endif

#ifdef __cplusplus
extern "C" {
#endif

// ---- pages: SPEC 14 ----------------------------------------------------------------------------------------------------

// A cloud of which it is known what pages it has (the nodes of an octree in a file, for one), but whose points arrive by and by. Pictures
// draw what has arrived when they begin. Nothing is called back: after a picture, patina_cloud_wanted says which pages it would have
// needed, the host fetches them and hands each in, and draws again.

#define PATINA_NO_PAGE 4294967295

typedef struct patina_page {
    double box_min[3], box_max[3]; // nothing of the page lies outside
    double gap;      // about how far apart its points and those of all coarser pages over it lie, taken together; above 0
    uint32_t count;  // points, at least 1
    uint32_t parent; // the coarser page over it, of a lesser index, of twice the gap; PATINA_NO_PAGE = none
} patina_page;

typedef struct patina_pages_desc {
    size_t struct_size;
    const patina_page *pages; // copied
    uint32_t page_count;
    uint32_t color_type; // patina_type of every page's colours, as in patina_cloud_desc; PATINA_NONE = without
    uint32_t has_normals, has_scalars, has_classes; // 1 = every page has them
    double box_min[3], box_max[3];                  // of all points; both zero = of the pages' boxes
    uint64_t
        memory_cap; // bytes that arrived points may take; beyond it, pages that no picture wanted for longest are given back,
                    // and absent again. 0 = no limit
} patina_pages_desc;

typedef struct patina_pages_info {
    size_t struct_size;
    uint64_t points, arrived; // of all pages; of those that are there, or will be in the next picture
    uint32_t pages, pages_arrived;
    uint64_t wanted; // of the last patina_cloud_wanted: points of the pages that it would name, however much room it had
    uint32_t pages_wanted;
    uint32_t returned; // how often a page was given back
} patina_pages_info;

// Makes the cloud, of however many points, of which a page has at most 2^31 - 1; memory is taken as they arrive.
// Points' numbers are those of their pages one behind the other, whichever arrives first.
PATINA_API int patina_cloud_pages_begin(const patina_pages_desc *desc, patina_cloud **out);
// Hands a page's points in. Any thread, at any time, several at once, while pictures of the cloud are drawn too: the next picture of it
// that begins while no other is drawn has them. PATINA_ERROR_FORMAT, and the page stays absent, where it is not what was promised: other
// counts, points outside of its box or not finite, other attributes. PATINA_ERROR_EMPTY: it is there already. No opacities, no radii.
PATINA_API int patina_cloud_page_give(patina_cloud *cloud, uint32_t page, const patina_cloud_desc *desc);
// Takes the list of absent pages that plans of pictures, and of light maps, wanted since the last call: in view, and the parent's gap is
// more than least_px pixels there; 0 = however small. First come those whose parent's gap is widest on screen: near and coarse ones.
// pages: room for `room` numbers. *count: how many were written. Any thread, at any time.
PATINA_API int patina_cloud_wanted(patina_cloud *cloud, double least_px, uint32_t *pages, uint32_t room, uint32_t *count);
// Any thread, at any time. PATINA_ERROR_EMPTY for a cloud that has no pages.
PATINA_API int patina_cloud_get_pages(patina_cloud *cloud, patina_pages_info *info);
// A task of patina_cloud_page_give.
PATINA_API int patina_task_give_page(patina_cloud *cloud, uint32_t page, const patina_cloud_desc *desc, patina_task **out);
// What a picture of the scene would want is found without drawing it: by patina_frame_plan_text; shadows want more as they are drawn.
// While pages are absent, colours and scalars are not replaced and nothing is analysed or saved: PATINA_ERROR_UNSUPPORTED; nor ever of more
// than 2^31 - 1 points: PATINA_ERROR_TOO_MANY_POINTS. Once all are
// there patina_cloud_save writes a cloud that patina_cloud_open maps, and that draws the same bytes.

#ifdef __cplusplus
}
#endif
#endif
