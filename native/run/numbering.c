// SPDX-License-Identifier: GPL-3.0-or-later
#include "numbering.h"

#include "base/platform.h"
#include "scene/mask.h"

#include <stdlib.h>

void pt_numbering_release(struct pt_numbering *numbering)
{
    for (uint32_t i = 0; i < numbering->count; i++)
        pt_alive_release(numbering->clouds[i].alive);
    free(numbering->clouds);
    *numbering = (struct pt_numbering){0};
}

int pt_numbering_take(struct pt_numbering *numbering, const struct patina_scene *scene, const struct pt_plan *plan)
{
    struct pt_numbering taken = {.clouds = calloc(scene->cloud_count + 1u, sizeof *taken.clouds)};
    if (!taken.clouds)
        return PATINA_ERROR_MEMORY;
    for (; taken.count < scene->cloud_count; taken.count++) {
        const struct patina_cloud *cloud = scene->instances[taken.count].cloud;
        const patina_grade *grade = scene->instances[taken.count].style.grade;
        const int first = pt_is_first_part(scene, taken.count); // the others' numbers are the whole's, too
        taken.clouds[taken.count] = (struct pt_numbered){.cloud = cloud,
                                                         .alive = cloud->alive,
                                                         .number = scene->instances[taken.count].number,
                                                         .first_point = first ? taken.points
                                                                              : taken.clouds[taken.count - 1].first_point,
                                                         .keeps_black = grade && grade->keeps_black};
        if (plan)
            taken.clouds[taken.count].window = plan->ids.windows[taken.count];
        atomic_fetch_add(&cloud->alive->references, 1);
        taken.points += first ? cloud->info.count : 0;
    }
    taken.triangles = scene->triangles;
    taken.ids = plan ? plan->ids.points : 0;
    taken.discs = taken.ids + scene->triangles;
    pt_numbering_release(numbering);
    *numbering = taken;
    return PATINA_OK;
}

int pt_numbering_is_of(const struct pt_numbering *numbering, const struct patina_scene *scene)
{
    int same = numbering->count == scene->cloud_count;
    for (uint32_t i = 0; same && i < scene->cloud_count; i++)
        same = numbering->clouds[i].alive == scene->instances[i].cloud->alive;
    return same;
}

uint32_t pt_numbering_parts(const struct pt_numbering *numbering, uint32_t number, uint32_t *first)
{
    uint32_t count = 0;
    for (*first = 0; *first < numbering->count && numbering->clouds[*first].number != number; ++*first)
        ;
    while (*first + count < numbering->count && numbering->clouds[*first + count].number == number)
        count++;
    return count;
}

const struct patina_cloud *pt_numbering_cloud(const struct pt_numbering *numbering, uint32_t instance)
{
    const struct pt_numbered *of = instance < numbering->count ? &numbering->clouds[instance] : NULL;
    return of && atomic_load(&of->alive->alive) ? of->cloud : NULL;
}

// The instance whose points hold `id`; they lie one behind another, and those without ids before the next that has some or at the end.
static uint32_t search(const struct pt_numbering *numbering, uint32_t id)
{
    uint32_t low = 0, high = numbering->count;
    while (high - low > 1) {
        uint32_t middle = low + (high - low) / 2;
        if (numbering->clouds[middle].window.id <= id)
            low = middle;
        else
            high = middle;
    }
    return low;
}

static uint32_t without_disc(const struct pt_numbering *numbering, uint32_t id)
{
    return id >= numbering->discs ? id - (uint32_t)numbering->discs : id; // where there are none, no id is as great
}

int pt_numbering_find(const struct pt_numbering *numbering, uint32_t id, uint32_t *instance, uint32_t *slot)
{
    id = without_disc(numbering, id);
    if (id >= numbering->ids)
        return 0;
    const struct pt_window *window = &numbering->clouds[*instance].window;
    if (id - window->id >= window->count) {
        *instance = search(numbering, id);
        window = &numbering->clouds[*instance].window;
    }
    *slot = id - window->id + window->first;
    return 1;
}

// The caller's numbers of what keys show.
static int number(const struct pt_numbering *numbering, uint64_t *keys, size_t count, int with_z)
{
    const struct patina_cloud *cloud = NULL;
    uint32_t of = 0, last = 0;
    for (size_t i = 0; i < count; i++) {
        const uint32_t id = (uint32_t)keys[i];
        const uint64_t z = keys[i] >> 32;
        uint32_t slot = 0;
        if (z == PT_KEY_EMPTY_Z) {
            keys[i] = with_z ? keys[i] : UINT64_MAX;
            continue;
        }
        uint64_t found = without_disc(numbering, id) - numbering->ids + numbering->points; // a triangle's
        if (pt_numbering_find(numbering, id, &of, &slot)) {
            cloud = cloud && of == last ? cloud : pt_numbering_cloud(numbering, of);
            if (!cloud)
                return PATINA_ERROR_EMPTY;
            last = of;
            found = numbering->clouds[of].first_point + pt_number_of(cloud, slot);
            if (pt_disk_losses() && cloud->mapped >> PT_ARRAY_ORDER & 1u && pt_pages_lost(cloud->order + slot, 4))
                return PATINA_ERROR_FILE; // it was cut short since the picture was drawn
        }
        keys[i] = with_z ? z << 32 | found : found;
    }
    return PATINA_OK;
}

int pt_numbering_keys(const struct pt_numbering *numbering, uint64_t *keys, size_t count)
{
    if (numbering->points + numbering->triangles > PT_KEY_EMPTY_ID - 1ull)
        return PATINA_ERROR_TOO_MANY_POINTS;
    return number(numbering, keys, count, 1);
}

int pt_numbering_numbers(const struct pt_numbering *numbering, uint64_t *keys, size_t count)
{
    return number(numbering, keys, count, 0);
}
