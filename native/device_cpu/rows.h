// SPDX-License-Identifier: GPL-3.0-or-later
// Filters walk the rows of view.rect in parallel, PT_LANES pixels at a time.
#ifndef PT_ROWS_H
#define PT_ROWS_H

#include "cpu.h"
#include "vector_math.h"

#include <stdlib.h>

typedef void pt_row_work(void *context, uint32_t y);

struct pt_rows_job {
    const struct pt_cpu_call *call;
    uint32_t first;
    pt_row_work *work;
};

static void pt_rows_range(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct pt_rows_job *job = context;
    (void)thread;
    for (uint32_t y = begin; y < end && !pt_cpu_cancelled(job->call); y++)
        job->work((void *)job->call, job->first + y);
}

// Calls work(call, y) for every row of the rectangle. Eight rows a batch: 32 KiB of keys at 1024 pixels.
static inline int pt_rows(const struct pt_cpu_call *call, const struct view_args *view, pt_row_work *work)
{
    struct pt_rows_job job = {call, view->rect[1], work};
    if (view->rect[3] > view->rect[1] && view->rect[2] > view->rect[0])
        pt_parallel(call->pool, view->rect[3] - view->rect[1], 8, pt_rows_range, &job);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}

// The same for the rows of a crop: y counts from its first.
static inline int pt_crop_rows(const struct pt_cpu_call *call, const struct view_args *view, uint32_t width, uint32_t height,
                               pt_row_work *work)
{
    struct view_args crop = *view;
    crop.rect[0] = crop.rect[1] = 0;
    crop.rect[2] = width;
    crop.rect[3] = height;
    return pt_rows(call, &crop, work);
}

static inline uint32_t pt_lanes_left(uint32_t x, uint32_t end) { return end - x < PT_LANES ? end - x : PT_LANES; }

// Which slots, ids less id_base, are of those that have ids: instance_args.
static inline vm pt_has_ids(vi slot, uint32_t first, uint32_t count)
{
    return vi_lt_unsigned(vi_sub(slot, vi_set(first)), vi_set(count));
}

static inline int pt_is_of(const struct instance_args *instance, uint32_t slot)
{
    return slot - instance->id_first < instance->id_count;
}

// Asks for the attributes, `size` bytes a point, of the next PT_LANES pixels from x on: with large clouds each is a
// cache miss of its own. attribute NULL: it is read from pictures, not from points.
static inline void pt_fetch_ahead(const uint64_t *row, uint32_t x, uint32_t end, const struct instance_args *instance,
                                  const void *attribute, size_t size)
{
    for (uint32_t i = x; attribute && i < x + PT_LANES && i < end; i++) {
        uint32_t id = (uint32_t)row[i] - instance->id_base;
        if (pt_is_of(instance, id))
            __builtin_prefetch((const char *)attribute + size * id);
    }
}

// Writes to a row that no other thread writes to: those of PT_LANES pixels from x on that m names.
static inline void pt_row_put(uint32_t *row, uint32_t width, uint32_t x, vi a, vm m)
{
    if (x + PT_LANES <= width)
        vi_merge(row + x, a, m);
    else
        vi_store_where(row + x, a, m);
}

static inline void pt_row_put_keys(uint64_t *row, uint32_t width, uint32_t x, vi z, vi id, vm m)
{
    if (x + PT_LANES <= width)
        vi_merge_keys(row + x, z, id, m);
    else
        vi_store_keys(row + x, z, id, vm_bits(m));
}

// Which of the next `lanes` pixels show a point of this instance, and its index in the cloud.
static inline vm pt_of_instance(const uint64_t *keys, const struct instance_args *instance, uint32_t lanes, vi *id)
{
    *id = vi_sub(vi_load_id(keys), vi_set(instance->id_base));
    return vm_and(vm_first(lanes), vm_and(pt_has_ids(*id, instance->id_first, instance->id_count),
                                          vm_not(vi_eq(vi_load_z(keys), vi_set(PT_KEY_EMPTY_Z)))));
}

// Those of `some` among PT_LANES pixels from `at` on that show the surface of another pixel.
static inline vm pt_filled(vi source, size_t at, vm some)
{
    return vm_and(some, vm_not(vi_eq(source, vi_add(vi_set((uint32_t)at), vi_lanes()))));
}

// What d_eff is not below at z: most pixels need not know their own. A cosine may be an ulp above 1.
static inline vf pt_least_distance(const struct view_args *view, float least, float share, vf z)
{
    return vf_max(vf_set(least), vf_footprint(view, z) * vf_set(share));
}

// The measured pixels whose surfaces PT_LANES pixels from `at` on show.
static inline vi pt_source_of(const uint32_t *from, size_t at) { return vi_and(vi_load(from + at), vi_set(~PT_FROM_MIXED)); }

// The same of pixels anywhere.
static inline vi pt_source_gather(const uint32_t *from, vi at, vm lanes)
{
    return vi_and(vi_gather(from, at, lanes), vi_set(~PT_FROM_MIXED));
}

// Whether keys are less than others.
static inline vm pt_less(vi z, vi id, vi than_z, vi than_id)
{
    return vm_or(vi_lt_unsigned(z, than_z), vm_and(vi_eq(z, than_z), vi_lt_unsigned(id, than_id)));
}

// d_eff at this view's level of those of PT_LANES pixels from `at` on that `lanes` names; at level 0 most are measured.
static inline vf pt_own_distance(const struct view_args *view, const float *deff, const float *normals, const uint32_t *from,
                                 size_t at, vf z, vm lanes)
{
    vi source = pt_source_of(from, at);
    if (view->level) {
        vf inverse = vf_gather_inverse(normals, source, lanes);
        return vf_level_distance(view, vf_gather(deff, source, lanes), inverse, z);
    }
    vm other = pt_filled(source, at, lanes);
    vf own = vf_load(deff + at);
    if (!vm_bits(other))
        return own;
    return vf_select(other, vf_gather(deff, source, other), own);
}

struct pt_row_z { // z of PT_LANES pixels, and of those to the west and to the east of them
    vf west, own, east;
};

static inline vf pt_z_of(const uint64_t *key) { return vf_set(pt_float((uint32_t)(*key >> 32))); }

// From (x, y) on, +inf beyond the plane. edge: whether there may be columns beyond it.
static inline struct pt_row_z pt_load_row_z(const uint64_t *keys, uint32_t width, uint32_t height, uint32_t x, uint32_t y,
                                            int edge)
{
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z));
    if (y >= height)
        return (struct pt_row_z){empty, empty, empty};
    keys += (size_t)y * width + x;
    vf own = vi_float(vi_load_z(keys));
    if (edge && width - x < PT_LANES)
        own = vf_select(vm_first(width - x), own, empty);
    return (struct pt_row_z){vf_west(edge && !x ? empty : pt_z_of(keys - 1), own), own,
                             vf_east(own, edge && width - x <= PT_LANES ? empty : pt_z_of(keys + PT_LANES))};
}

#endif
