// SPDX-License-Identifier: GPL-3.0-or-later
#include "planes.h"

uint64_t pt_planes_total(const struct pt_planes *planes)
{
    uint64_t total = 0;
    for (int p = 0; p < PT_PLANE_COUNT; p++)
        for (int level = 0; level < PT_SLOTS; level++)
            total += planes->at[p][level].room + (planes->other ? planes->other->at[p][level].room : 0);
    return total;
}

static size_t size_of(const struct pt_plan *plan, enum pt_plane which, uint32_t level)
{
    uint32_t size[2];
    pt_plan_plane_size(plan, which, level, size);
    return (size_t)size[0] * size[1] * pt_plane_bytes(which);
}

static int check_cap(const struct patina_device *device, const struct pt_plan *plan, uint64_t total)
{
    const uint64_t cap = device->memory_cap;
    if (!cap || total <= cap)
        return PATINA_OK;
    return pt_fail(&device->handle, PATINA_ERROR_MEMORY,
                   "the planes of a %u x %u picture take more than the %llu MB allowed: render it in regions",
                   plan->crop[2], plan->crop[3], (unsigned long long)(cap >> 20));
}

// Frames of a moving camera differ by some pixels of margin, maps of one light by a texel or two: that is not worth new memory
// each time, so who asks again for more gets an eighth above. Near the cap memory counts for more.
static size_t room_for(const struct patina_device *device, const struct pt_planes *planes, size_t bytes)
{
    const uint64_t cap = device->memory_cap, total = pt_planes_total(planes);
    return cap && total + total / 4 > cap ? bytes : bytes + bytes / 8;
}

int pt_planes_ensure(struct patina_device *device, struct pt_planes *planes, const struct pt_plan *plan, enum pt_plane which,
                     uint32_t level)
{
    struct pt_buffer *plane = &planes->at[which][level];
    const size_t bytes = size_of(plan, which, level);
    if (plane->room < bytes || plane->room >= 2 * bytes) {
        const size_t room = planes->varies || plane->room ? room_for(device, planes, bytes) : bytes;
        device->ops->buffer_destroy(device, plane);
        int error = check_cap(device, plan, pt_planes_total(planes) + room);
        if (!error)
            error = device->ops->buffer_create(device, room, NULL, 0, plane);
        if (error)
            return error;
    }
    plane->size = bytes;
    return PATINA_OK;
}

// Of keys all but what is known to be empty still.
static int clear_keys(struct patina_device *device, struct pt_buffer *plane, const struct pt_plan *plan, uint64_t word)
{
    int error = device->ops->buffer_fill(device, plane, plane->clean[0], plane->room - plane->clean[0] - plane->clean[1], word, 8);
    if (error)
        return error;
    plane->clean[0] = 8 * (size_t)plan->view.width * plan->view.rect[1]; // no pass writes beyond the rectangle
    plane->clean[1] = plane->room - 8 * (size_t)plan->view.width * plan->view.rect[3];
    return PATINA_OK;
}

int pt_planes_clear(struct patina_device *device, struct pt_planes *planes, const struct pt_plan *plan, const struct pt_step *clear)
{
    const enum pt_plane which = clear->plane.which;
    struct pt_buffer *plane = &planes->at[which][clear->plane.index];
    int error = pt_planes_ensure(device, planes, plan, which, clear->plane.index);
    if (error)
        return error;
    return clear->bytes == 8 ? clear_keys(device, plane, plan, clear->word)
                             : device->ops->buffer_fill(device, plane, 0, plane->size, clear->word, clear->bytes);
}

int pt_planes_ensure_picture(struct patina_device *device, struct pt_planes *planes, const struct pt_plan *plan)
{
    struct pt_buffer made[PT_PLANE_COUNT] = { 0 };
    uint64_t total = pt_planes_total(planes);
    int error = PATINA_OK;
    for (int p = 0; p < PT_PLANE_COUNT && !error; p++) {
        const size_t bytes = size_of(plan, (enum pt_plane)p, 0);
        if (!pt_of_picture((enum pt_plane)p) || planes->at[p][0].size == bytes || !pt_plan_writes(plan, (enum pt_plane)p))
            continue;
        total += bytes - planes->at[p][0].size;
        error = check_cap(device, plan, total);
        if (!error)
            error = device->ops->buffer_create(device, bytes, NULL, 0, &made[p]);
    }
    for (int p = 0; p < PT_PLANE_COUNT; p++) {
        if (!error && pt_of_picture((enum pt_plane)p) && !pt_plan_writes(plan, (enum pt_plane)p))
            device->ops->buffer_destroy(device, &planes->at[p][0]);
        if (!made[p].size)
            continue;
        device->ops->buffer_destroy(device, error ? &made[p] : &planes->at[p][0]);
        if (!error)
            planes->at[p][0] = made[p];
    }
    return error;
}

void pt_planes_release(struct patina_device *device, struct pt_planes *planes)
{
    for (int p = 0; p < PT_PLANE_COUNT; p++)
        for (int level = 0; level < PT_SLOTS; level++)
            device->ops->buffer_destroy(device, &planes->at[p][level]);
}
