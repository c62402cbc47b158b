// SPDX-License-Identifier: GPL-3.0-or-later
// Clouds whose points arrive page by page (SPEC 14): plans leave out what is not there, and say that it was wanted. Of a file what is known to
// be damaged (SPEC 13).
#include "pages.h"

#include "scene/clouds/page_sums.h"
#include "scene/clouds/paged.h"

int pt_plan_is_sound(const struct patina_scene *scene, const struct patina_cloud *cloud, uint32_t c)
{
    return scene->in_parts || !pt_page_is_damaged(cloud, c);
}

static int bounds_of(const struct pt_looking *looking, const struct pt_chunk *box, struct pt_extent *extent)
{
    double translation[3];
    pt_chunk_translation(looking->camera, looking->what->object, box, translation);
    return pt_kind_bounds(looking->camera, looking->kind, looking->what, box, looking->rows, translation, extent);
}

// How wide a pixel is at the nearest place of a box, object units.
static double pixel_at(const struct pt_looking *looking, const struct pt_extent *extent)
{
    const struct pt_eye *camera = looking->camera;
    const double before = camera->orthographic ? 1.0 : pt_most(extent->z_before, 0.0);
    return pt_most(camera->xs, camera->ys) * before / looking->what->object->scale;
}

int pt_is_out(const struct pt_looking *looking, const struct pt_chunk *around)
{
    const struct pt_eye *camera = looking->camera;
    struct pt_extent extent;
    if (!bounds_of(looking, around, &extent))
        return camera->orthographic || extent.z_beyond < camera->near_clip || extent.z_before >= camera->near_clip;
    return looking->detail && pt_detail_leaves_out(looking->detail, (double)around->gap, pixel_at(looking, &extent));
}

// Returns chunks that the sieve takes.
static uint32_t look_at_page(const struct pt_looking *looking, const struct patina_cloud *cloud, uint32_t page)
{
    const struct pt_eye *camera = looking->camera;
    const double scale = looking->what->object->scale;
    struct pt_chunk box;
    struct pt_extent extent;
    double thinned;
    pt_page_box(cloud, page, &box);
    if (pt_sieve_page(looking->sieve, &box) == PT_CUT_AWAY)
        return pt_page_chunks(cloud, page);
    if (!bounds_of(looking, &box, &extent) ||
        (looking->detail && !pt_detail_draws(looking->detail, &box, pixel_at(looking, &extent), &thinned)))
        return 0;
    const double pixel = pt_most(camera->xs, camera->ys) *
                         (camera->orthographic ? 1.0 : pt_most(extent.z_before, camera->near_clip));
    pt_page_want(cloud, page, 2.0 * (double)box.gap * scale / pixel);
    return 0;
}

uint64_t pt_plan_absent(const struct pt_looking *looking)
{
    const struct patina_cloud *cloud = looking->what->instance->cloud;
    uint64_t taken = 0;
    for (uint32_t page = pt_page_first(cloud); page != PATINA_NO_PAGE;) {
        int below = pt_page_has_below(cloud, page);
        struct pt_chunk around;
        if (below) {
            pt_page_around(cloud, page, &around);
            below = !pt_is_out(looking, &around);
        }
        if ((below || !pt_page_has_below(cloud, page)) && !pt_page_is_there(cloud, page))
            taken += look_at_page(looking, cloud, page);
        page = pt_page_next(cloud, page, below);
    }
    return taken;
}
