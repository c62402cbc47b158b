// SPDX-License-Identifier: GPL-3.0-or-later
// Clouds whose points arrive page by page (SPEC 14): plans leave out what is not there, and say that it was wanted. Of a file what is known to
// be damaged (SPEC 13).
#include "eye.h"

#include "scene/page_sums.h"
#include "scene/paged.h"

int pt_plan_is_sound(const struct patina_scene *scene, const struct patina_cloud *cloud, uint32_t c)
{
    return scene->in_parts || !pt_page_is_damaged(cloud, c);
}

int pt_plan_page(const struct patina_cloud *cloud, uint32_t c, const struct pt_eye *camera, const struct pt_object *object,
                 const struct pt_extent *extent)
{
    if (!cloud->paged)
        return 1;
    const double pixel = pt_most(camera->xs, camera->ys) *
                         (camera->orthographic ? 1.0 : pt_most(extent->z_before, camera->near_clip));
    return pt_paged_look(cloud, c, 2.0 * (double)cloud->chunks[c].gap * object->scale / pixel);
}
