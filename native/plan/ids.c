// SPDX-License-Identifier: GPL-3.0-or-later
// Ids of points, SPEC 1: of what a picture may show, not of what the scene holds. Each cloud has a window of its slots, and the windows
// follow each other as the instances do: ids are in the order of slots and instances, whatever else there is.
#include "plan.h"

#define MOST_IDS 0xFFFFFFFEull // 0xFFFFFFFF is that of an empty key

// Those of triangles end here: of all up to the last that is there, for a light's scene leaves some out.
static uint64_t triangles_of(const struct patina_scene *scene)
{
    const struct pt_instance *last = scene->mesh_count ? pt_mesh_at(scene, scene->mesh_count - 1) : NULL;
    return last ? last->id_base + (uint64_t)last->mesh->info.triangle_count : 0;
}

int pt_plan_number(const struct patina_scene *scene, struct pt_plan *plan)
{
    struct pt_plan_ids *ids = &plan->ids;
    ids->points = 0;
    for (uint32_t i = 0; i < scene->cloud_count; i++) {
        ids->windows[i].id = (uint32_t)ids->points;
        ids->points += ids->windows[i].count;
    }
    const uint64_t first = ids->points + triangles_of(scene), end = first + (ids->filled ? 0 : ids->points);
    ids->discs = ids->filled || end > MOST_IDS ? 0 : (uint32_t)first;
    return end <= MOST_IDS;
}

int pt_plan_too_many(const struct patina_scene *scene, const struct pt_plan *plan)
{
    return pt_fail(&scene->handle, PATINA_ERROR_TOO_MANY_POINTS,
                   "%s would look through %llu points and triangles, and no more than 4294967294 can be told apart: %s",
                   plan->map ? "a light's map" : "the picture", (unsigned long long)(plan->ids.points + triangles_of(scene)),
                   plan->map ? "let fewer clouds cast shadows"
                             : "let it see a smaller part, or clouds in levels no finer than it needs (settings.detail)");
}

void pt_set_ids(const struct pt_plan *plan, uint32_t instance, uint32_t discs, struct instance_args *args)
{
    const struct pt_window *window = &plan->ids.windows[instance];
    args->id_base = window->id - window->first + discs;
    args->id_first = window->first;
    args->id_count = window->count;
}
