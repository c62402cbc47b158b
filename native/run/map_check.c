// SPDX-License-Identifier: GPL-3.0-or-later
// Refuses light maps that are too large before work on the picture begins.
#include "shadows.h"

enum {
    AROUND = 256,     // texels around a map, at the most
    PLANE_BYTES = 16, // of a texel in the widest plane of a map
    TEXEL_BYTES = 128 // of a texel in all of them
};

// What a map is checked with.
struct maps {
    const struct patina_device *device;
    const struct pt_planes *planes, *own; // of the picture; of its maps
    const struct patina_scene *scene;
    const struct pt_plan *plan;
    struct pt_instance *instances; // room for those that a light sees
    uint64_t most;                 // bytes of a buffer that every kernel takes; 0: any number
};

// The least of what the device's kernels can bind. 0: any number.
static uint64_t least_most(const struct patina_device *device)
{
    uint64_t least = 0;
    for (int k = 0; k < PT_KERNEL_COUNT && device->ops->most; k++)
        for (uint32_t i = 0; i < pt_kernels[k].fixed + pt_kernels[k].each; i++) {
            const uint64_t most = device->ops->most(device, &pt_kernels[k].buffers[i]);
            least = !least || most < least ? most : least;
        }
    return least;
}

// Whether a map of this size fits whatever its planes are, so that it need not be planned.
static int surely_fits(const struct maps *maps, const patina_settings *map)
{
    const uint64_t texels = ((uint64_t)map->width + AROUND) * ((uint64_t)map->height + AROUND);
    if (maps->most && texels * PLANE_BYTES > maps->most)
        return 0;
    return !pt_planes_lack(maps->device, pt_planes_own(maps->planes) + pt_planes_own(maps->own),
                           maps->plan->peak + texels * TEXEL_BYTES);
}

// Bytes of all planes that a map's passes use.
static uint64_t bytes_of(const struct pt_plan *map)
{
    uint64_t seen[PT_PLANE_COUNT] = {0}, bytes = 0;
    for (uint32_t i = 0; i < map->pass_count; i++)
        for (uint32_t k = 0; k < map->passes[i].ref_count; k++) {
            const struct pt_ref *ref = &map->passes[i].refs[k];
            if (ref->of != PT_OF_FRAME || seen[ref->which] >> ref->index & 1u)
                continue;
            seen[ref->which] |= (uint64_t)1 << ref->index;
            bytes += pt_plan_plane_bytes(map, ref->which, ref->index);
        }
    return bytes;
}

// Bytes of the picture's slabs that the light's maps may use.
static uint64_t lent_to(const struct pt_plan *plan, uint32_t light)
{
    uint64_t most = 0;
    for (uint32_t i = 0; i < plan->step_count; i++) {
        uint64_t bytes = 0;
        for (uint32_t s = 0; s < plan->slab_count && s < 64; s++)
            bytes += plan->steps[i].idle >> s & 1u ? plan->slabs[s].bytes : 0;
        if (plan->steps[i].of == PT_STEP_LIGHT && plan->steps[i].light == light && bytes > most)
            most = bytes;
    }
    return most;
}

static int check_map(const struct maps *maps, const struct pt_round *round)
{
    const struct pt_plan *plan = maps->plan;
    struct patina_scene view = {0};
    struct pt_plan map;
    double window[4];
    if (!pt_plan_tested(maps->scene, plan, round, round->group) ||
        !pt_light_scene(maps->scene, &plan->lights[round->light], &plan->groups[round->group], 0, round->face, maps->instances,
                        &view, window) ||
        surely_fits(maps, &view.settings))
        return PATINA_OK;
    int error = pt_plan_map(maps->scene, plan, round, &map);
    if (error)
        return error;
    const uint64_t needed = bytes_of(&map), lent = lent_to(plan, round->light);
    for (uint32_t i = 0; i < map.pass_count && !error; i++)
        error = pt_planes_check_pass(maps->device, &map, &map.passes[i]);
    if (!error)
        error = pt_planes_check_memory(maps->device, &map, pt_planes_own(maps->planes) + pt_planes_own(maps->own),
                                       plan->peak + (needed > lent ? needed - lent : 0));
    pt_plan_destroy(&map);
    return error;
}

int pt_maps_check(const struct patina_device *device, const struct pt_planes *planes, const struct pt_shadows *shadows, int all,
                  const struct patina_scene *scene, struct pt_plan *plan)
{
    struct maps maps = {.device = device, .planes = planes, .own = &shadows->planes, .scene = scene, .plan = plan};
    int error = PATINA_OK;
    if (!plan->light_count)
        return PATINA_OK;
    maps.most = least_most(device);
    maps.instances = pt_arena_take(&plan->arena, ((size_t)scene->cloud_count + scene->mesh_count + 1) * sizeof *maps.instances);
    if (!maps.instances)
        return pt_fail(&device->handle, PATINA_ERROR_MEMORY, "light maps: out of memory");
    for (uint32_t i = 0; i < plan->light_count && !error; i++) {
        struct pt_round round = {.light = i, .points = 1, .pixels = plan->mesh.shadows};
        if (!all && !plan->mesh.shadows && shadows->lights[i].samples == pt_samples_wanted(shadows, scene, plan, i))
            continue;
        error = pt_plan_light_map(scene, plan, i);
        for (round.face = 0; round.face < pt_light_faces(plan, i) && !error; round.face++)
            for (round.group = 0; round.group < plan->group_count && !error; round.group++)
                error = check_map(&maps, &round);
    }
    return error;
}
