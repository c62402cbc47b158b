// SPDX-License-Identifier: GPL-3.0-or-later
#include "numbering.h"

#include <stdlib.h>

void pt_numbering_release(struct pt_numbering *numbering)
{
    for (uint32_t i = 0; i < numbering->count; i++)
        pt_alive_release(numbering->clouds[i].alive);
    free(numbering->clouds);
    *numbering = (struct pt_numbering){0};
}

int pt_numbering_take(struct pt_numbering *numbering, const struct patina_scene *scene)
{
    struct pt_numbering taken = {.clouds = calloc(scene->cloud_count + 1u, sizeof *taken.clouds)};
    if (!taken.clouds)
        return PATINA_ERROR_MEMORY;
    for (; taken.count < scene->cloud_count; taken.count++) {
        const struct pt_instance *instance = &scene->instances[taken.count];
        const struct patina_cloud *cloud = instance->cloud;
        taken.clouds[taken.count] = (struct pt_numbered){cloud, cloud->alive, instance->id_base, (uint32_t)cloud->slots,
                                                         taken.points};
        atomic_fetch_add(&cloud->alive->references, 1);
        taken.slots += (uint32_t)cloud->slots;
        taken.points += (uint32_t)cloud->info.count;
    }
    taken.discs = taken.slots + scene->triangles;
    pt_numbering_release(numbering);
    *numbering = taken;
    return PATINA_OK;
}

const struct patina_cloud *pt_numbering_cloud(const struct pt_numbering *numbering, uint32_t instance)
{
    const struct pt_numbered *of = instance < numbering->count ? &numbering->clouds[instance] : NULL;
    return of && atomic_load(&of->alive->alive) ? of->cloud : NULL;
}

// The instance whose points hold `id`; they lie one behind another.
static uint32_t find(const struct pt_numbering *numbering, uint32_t id)
{
    uint32_t low = 0, high = numbering->count;
    while (high - low > 1) {
        uint32_t middle = low + (high - low) / 2;
        if (numbering->clouds[middle].first_slot <= id)
            low = middle;
        else
            high = middle;
    }
    return low;
}

int pt_numbering_keys(const struct pt_numbering *numbering, uint64_t *keys, size_t count)
{
    const struct patina_cloud *cloud = NULL;
    const struct pt_numbered *of = NULL;
    for (size_t i = 0; i < count; i++) {
        uint32_t id = (uint32_t)keys[i];
        if (keys[i] >> 32 == PT_KEY_EMPTY_Z)
            continue;
        if (id >= numbering->discs) // where there are none, no id is as great
            id -= (uint32_t)numbering->discs;
        if (id >= numbering->slots) { // a triangle's
            keys[i] = (keys[i] >> 32 << 32) | (id - numbering->slots + numbering->points);
            continue;
        }
        if (!of || id - of->first_slot >= of->slots) {
            uint32_t instance = find(numbering, id);
            of = &numbering->clouds[instance];
            cloud = pt_numbering_cloud(numbering, instance);
            if (!cloud)
                return PATINA_ERROR_EMPTY;
        }
        keys[i] = (keys[i] >> 32 << 32) | (of->first_point + pt_number_of(cloud, id - of->first_slot));
    }
    return PATINA_OK;
}
