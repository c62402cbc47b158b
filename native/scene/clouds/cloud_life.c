// SPDX-License-Identifier: GPL-3.0-or-later
// How a cloud's handle begins and ends, and what it tells.
#include "cloud.h"
#include "shape_word.h"
#include "base/descriptor.h"
#include "base/platform.h"
#include "page_sums.h"
#include "paged.h"
#include "parts.h"

#include <stdlib.h>

struct patina_cloud *pt_cloud_new(void)
{
    struct patina_cloud *cloud = calloc(1, sizeof *cloud);
    struct pt_alive *alive = pt_alive_create();
    if (!cloud || !alive) {
        free(cloud);
        free(alive);
        return NULL;
    }
    pt_handle_init(&cloud->handle);
    cloud->alive = alive;
    return cloud;
}

void patina_cloud_destroy(patina_cloud *cloud)
{
    if (!cloud)
        return;
    struct pt_section sections[PT_ARRAYS];
    pt_parts_destroy(cloud);
    pt_cloud_sections(cloud, sections);
    for (int i = PT_ARRAY_POSITIONS; i < PT_ARRAY_SIGHTS; i++)
        pt_pages_free(*sections[i].data, sections[i].size);
    pt_sights_free(&cloud->sights);
    pt_chunks_free(cloud);
    pt_paged_destroy(cloud);
    pt_page_sums_destroy(cloud->page_sums);
    free(cloud->begins);
    free(cloud->clusters);
    pt_alive_end(cloud->alive);
    pt_handle_destroy(&cloud->handle);
    free(cloud);
}

int patina_cloud_get_info(const patina_cloud *cloud, patina_cloud_info *info)
{
    if (!cloud)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_get_info: cloud is NULL");
    patina_cloud_info own = cloud->info;
    own.trust_default = own.has_shapes ? pt_trust_of_level(pt_default_level(own.trusts)) : 0.0;
    return pt_give(&cloud->handle, "patina_cloud_get_info", &own, sizeof own, info);
}
