// SPDX-License-Identifier: GPL-3.0-or-later
#include "planes.h"

static uint64_t total_of(const struct pt_planes *planes)
{
    uint64_t total = 0;
    for (int p = 0; p < PT_PLANE_COUNT; p++)
        for (int level = 0; level < PT_SLOTS; level++)
            total += planes->view[p][level] ? 0 : planes->at[p][level].room;
    for (int s = 0; s < PT_SLABS; s++)
        total += planes->slabs[s].room;
    return total;
}

uint64_t pt_planes_own(const struct pt_planes *planes) { return total_of(planes); }

uint64_t pt_planes_total(const struct pt_planes *planes)
{
    return total_of(planes) + (planes->other ? total_of(planes->other) : 0);
}

int pt_planes_above_cap(const struct patina_device *device, const struct pt_plan *plan)
{
    const char *what = plan->map        ? "of a light map of"
                       : plan->panorama ? "of a panorama's face of"
                                        : "of an image of",
               *way = plan->map        ? "lower the shadow resolution"
                      : plan->panorama ? "make the panorama smaller"
                                       : "render it in regions";
    return pt_fail(&device->handle, PATINA_ERROR_TOO_LARGE,
                   "the planes %s %u x %u pixels take more than the %llu MB allowed: %s", what, plan->crop[2], plan->crop[3],
                   (unsigned long long)(device->memory_cap >> 20), way);
}

static int check_cap(const struct patina_device *device, const struct pt_plan *plan, uint64_t total)
{
    const uint64_t cap = device->memory_cap;
    if (!cap || total <= cap)
        return PATINA_OK;
    return pt_planes_above_cap(device, plan);
}

// Frames of a moving camera differ by some pixels of margin, maps of one light by a texel or two: that is not worth new memory
// each time, so who asks again for more gets an eighth above. Near the cap memory counts for more.
static size_t room_for(const struct patina_device *device, const struct pt_planes *planes, size_t bytes)
{
    const uint64_t cap = device->memory_cap, total = pt_planes_total(planes);
    return cap && total + total / 4 > cap ? bytes : bytes + bytes / 8;
}

// Makes room, unless there is, and not much too much.
static int ensure(struct patina_device *device, struct pt_planes *planes, const struct pt_plan *plan, struct pt_buffer *buffer,
                  size_t bytes)
{
    if (buffer->room < bytes || buffer->room >= 2 * bytes) {
        const size_t room = planes->varies || buffer->room ? room_for(device, planes, bytes) : bytes;
        device->ops->buffer_destroy(device, buffer);
        int error = check_cap(device, plan, pt_planes_total(planes) + room);
        if (!error)
            error = device->ops->buffer_create(device, room, NULL, 0, buffer);
        if (error)
            return error;
    }
    buffer->size = bytes;
    return PATINA_OK;
}

// ---- slabs ---------------------------------------------------------------------------------------------------------------

static void set_view(struct pt_planes *planes, enum pt_plane which, uint32_t index, const struct pt_buffer *slab,
                     uint32_t number, size_t bytes)
{
    struct pt_buffer *view = &planes->at[which][index];
    *view = *slab;
    view->size = view->room = bytes;
    view->clean[0] = view->clean[1] = 0;
    planes->view[which][index] = (uint8_t)(1 + number);
    planes->lost[which][index] = 0;
}

static void drop_views(struct pt_planes *planes)
{
    for (int p = 0; p < PT_PLANE_COUNT; p++)
        for (int k = 0; k < PT_SLOTS; k++)
            if (planes->view[p][k]) {
                planes->at[p][k] = (struct pt_buffer){0};
                planes->view[p][k] = 0;
            }
}

// Whether another plane, or a light's map, takes the slab behind the life.
static int is_lost(const struct pt_plan *plan, uint32_t i)
{
    const struct pt_life *life = &plan->lives[i];
    int lost = 0;
    for (uint32_t k = i + 1; k < plan->life_count; k++)
        lost |= plan->lives[k].slab == life->slab;
    for (uint32_t k = 0; k < plan->step_count && life->slab < 64; k++)
        lost |= plan->steps[k].when > life->last && (plan->steps[k].idle >> life->slab & 1u);
    return lost;
}

// Frees what the plan has no use for, so that what it needs finds room below the cap.
static void make_way(struct patina_device *device, struct pt_planes *planes, const struct pt_plan *plan)
{
    drop_views(planes);
    for (int p = 0; p < PT_PLANE_COUNT; p++)
        for (int k = 0; k < PT_SLOTS; k++)
            if (!pt_plane_is_kept((enum pt_plane)p, (uint32_t)k))
                device->ops->buffer_destroy(device, &planes->at[p][k]);
    for (uint32_t s = plan->slab_count; s < PT_SLABS; s++)
        device->ops->buffer_destroy(device, &planes->slabs[s]);
}

int pt_planes_open(struct patina_device *device, struct pt_planes *planes, const struct pt_plan *plan)
{
    if (plan->slab_count > PT_SLABS)
        return pt_fail(&device->handle, PATINA_ERROR_INTERNAL, "the plan has %u slabs, of at most %d", plan->slab_count,
                       PT_SLABS);
    int error = PATINA_OK;
    make_way(device, planes, plan);
    for (int again = 0; again < 2; again++) // those that shrink first
        for (uint32_t s = 0; s < plan->slab_count && !error; s++)
            if (again || planes->slabs[s].room >= plan->slabs[s].bytes)
                error = ensure(device, planes, plan, &planes->slabs[s], plan->slabs[s].bytes);
    for (uint32_t i = 0; i < plan->life_count && !error; i++) {
        const struct pt_life *life = &plan->lives[i];
        set_view(planes, life->plane, life->index, &planes->slabs[life->slab], life->slab, life->bytes);
        planes->lost[life->plane][life->index] = (uint8_t)is_lost(plan, i);
    }
    return error;
}

static const uint64_t poison = 0x7FA5A5A5; // not a number; as an index, beyond every plane

int pt_planes_poison(struct patina_device *device, struct pt_planes *planes, const struct pt_plan *plan, uint32_t when,
                     int ends)
{
    int error = PATINA_OK;
    for (uint32_t i = 0; i < plan->life_count && planes->poisoned && !error; i++) {
        const struct pt_life *life = &plan->lives[i];
        struct pt_buffer *view = &planes->at[life->plane][life->index];
        if (when == (ends ? life->last : life->first) && planes->view[life->plane][life->index])
            error = device->ops->buffer_fill(device, view, 0, view->size, poison, 4);
    }
    return error;
}

int pt_planes_poison_slabs(struct patina_device *device, struct pt_planes *planes, uint64_t slabs)
{
    int error = PATINA_OK;
    for (uint32_t s = 0; s < 64 && planes->poisoned && !error; s++)
        if (slabs >> s & 1u)
            error = device->ops->buffer_fill(device, &planes->slabs[s], 0, planes->slabs[s].size, poison, 4);
    return error;
}

void pt_planes_borrow(struct pt_planes *planes, uint64_t slabs)
{
    drop_views(planes);
    planes->borrowed = slabs;
}

// A plane in the least slab that is lent, large enough, and not taken. 0: there is none.
static int borrow(struct pt_planes *planes, enum pt_plane which, uint32_t index, size_t bytes)
{
    uint64_t free = planes->borrowed;
    uint32_t best = 64;
    for (int p = 0; p < PT_PLANE_COUNT; p++)
        for (int k = 0; k < PT_SLOTS; k++)
            if (planes->view[p][k])
                free &= ~((uint64_t)1 << (planes->view[p][k] - 1));
    for (uint32_t s = 0; s < 64 && planes->other; s++)
        if ((free >> s & 1u) && planes->other->slabs[s].room >= bytes &&
            (best == 64 || planes->other->slabs[s].room < planes->other->slabs[best].room))
            best = s;
    if (best < 64)
        set_view(planes, which, index, &planes->other->slabs[best], best, bytes);
    return best < 64;
}

int pt_planes_ensure(struct patina_device *device, struct pt_planes *planes, const struct pt_plan *plan, enum pt_plane which,
                     uint32_t level)
{
    struct pt_buffer *plane = &planes->at[which][level];
    const size_t bytes = pt_plan_plane_bytes(plan, which, level);
    if (which == PT_PLANE_DISC_BINS && bytes && plane->size > bytes)
        return PATINA_OK; // they have grown
    if (!bytes && !plane->room)
        return PATINA_OK; // nobody looks at it
    if (planes->view[which][level]) {
        if (plane->size == bytes)
            return PATINA_OK;
        *plane = (struct pt_buffer){0};
        planes->view[which][level] = 0;
    }
    if (planes->borrowed && plane->room < bytes) {
        device->ops->buffer_destroy(device, plane);
        if (borrow(planes, which, level, bytes))
            return PATINA_OK;
    }
    return ensure(device, planes, plan, plane, bytes);
}

int pt_planes_grow(struct patina_device *device, struct pt_planes *planes, const struct pt_plan *plan, enum pt_plane which,
                   size_t bytes)
{
    const uint32_t slab = planes->view[which][0];
    struct pt_buffer *buffer = slab ? &planes->slabs[slab - 1] : &planes->at[which][0];
    int error = ensure(device, planes, plan, buffer, bytes);
    planes->bins = bytes;
    for (int p = 0; p < PT_PLANE_COUNT && slab; p++)
        for (int k = 0; k < PT_SLOTS; k++)
            if (planes->view[p][k] == slab) { // those that come behind lie in it, too
                const int lost = planes->lost[p][k];
                set_view(planes, (enum pt_plane)p, (uint32_t)k, buffer, slab - 1,
                         p == (int)which ? bytes : planes->at[p][k].size);
                planes->lost[p][k] = (uint8_t)lost;
            }
    return error;
}

// Of keys all but what is known to be empty still.
static int clear_keys(struct patina_device *device, struct pt_buffer *plane, const struct pt_plan *plan, uint64_t word)
{
    int error = device->ops->buffer_fill(device, plane, plane->clean[0], plane->room - plane->clean[0] - plane->clean[1], word,
                                         8);
    if (error)
        return error;
    plane->clean[0] = 8 * (size_t)plan->view.width * plan->view.rect[1]; // no pass writes beyond the rectangle
    plane->clean[1] = plane->room - 8 * (size_t)plan->view.width * plan->view.rect[3];
    return PATINA_OK;
}

int pt_planes_clear(struct patina_device *device, struct pt_planes *planes, const struct pt_plan *plan,
                    const struct pt_step *clear)
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
    struct pt_buffer made[PT_PLANE_COUNT] = {0};
    uint64_t total = pt_planes_total(planes);
    int error = PATINA_OK;
    for (int p = 0; p < PT_PLANE_COUNT && !error; p++) {
        const size_t bytes = pt_plan_plane_bytes(plan, (enum pt_plane)p, 0);
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
            if (!planes->view[p][level])
                device->ops->buffer_destroy(device, &planes->at[p][level]);
    drop_views(planes);
    for (int s = 0; s < PT_SLABS; s++)
        device->ops->buffer_destroy(device, &planes->slabs[s]);
}
