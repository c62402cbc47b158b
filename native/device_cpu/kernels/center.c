// SPDX-License-Identifier: GPL-3.0-or-later
// center: measured pixel -> how far behind its point the tangent plane lies in its middle; twin of shaders/kernels/center.comp
//
// Pixel by pixel, for there may be many more points: each is looked up by its number, and projected as scatter does it. Of 16
// points a pixel in a fourth of the time that all of them take.
#include "device_cpu/cpu.h"
#include "device_cpu/points.h"
#include "device_cpu/rows.h"
#include "shared/measured.h"

enum { BLOCK = 256 }; // pixels of a row

struct start { // of a chunk
    uint32_t id, chunk;
};

struct center {
    const struct pt_cpu_call *call;
    const struct center_args *args;
    const struct start *starts;  // by id
    uint32_t count, first, span; // of ids: all lie in [first, first + span)
};

struct measured { // pixels of a row, packed, and where their points lie on screen (perspective: times z)
    uint32_t count, column[BLOCK + PT_LANES], z[BLOCK + PT_LANES], id[BLOCK + PT_LANES];
    float x[BLOCK + PT_LANES], y[BLOCK + PT_LANES];
};

static int by_id(const void *a, const void *b)
{
    const struct start *x = a, *y = b;
    return (x->id > y->id) - (x->id < y->id);
}

// The last that starts at the id or before it.
static uint32_t find_start(const struct center *center, uint32_t id, uint32_t near)
{
    const struct start *starts = center->starts;
    if (starts[near].id <= id && (near + 1 == center->count || id < starts[near + 1].id))
        return near; // neighbours show points of a chunk
    uint32_t low = 0, high = center->count;
    while (high - low > 1) {
        const uint32_t middle = low + (high - low) / 2;
        if (starts[middle].id <= id)
            low = middle;
        else
            high = middle;
    }
    return low;
}

static inline float transform(const struct chunk_view *chunk, int row, float x, float y, float z)
{
    const float *r = chunk->row + 3 * row;
    return (((chunk->lo[row] + r[0] * x) + r[1] * y) + r[2] * z) + chunk->hi[row];
}

// Projects the points; those of no chunk leave.
static void project(const struct center *center, struct measured *measured)
{
    const struct chunk_view *chunks = PT_DATA(center->call, center, chunks);
    const void *positions = PT_DATA(center->call, center, positions);
    uint32_t near = 0, kept = 0;
    for (uint32_t i = 0; i < measured->count; i++) {
        near = find_start(center, measured->id[i], near);
        const struct chunk_view *chunk = &chunks[center->starts[near].chunk];
        const uint32_t slot = measured->id[i] - center->starts[near].id;
        if (slot >= chunk->count)
            continue;
        float p[3];
        pt_load_point(chunk, pt_chunk_points(positions, chunk), slot, p);
        measured->column[kept] = measured->column[i];
        measured->z[kept] = measured->z[i];
        measured->x[kept] = transform(chunk, 0, p[0], p[1], p[2]);
        measured->y[kept++] = transform(chunk, 1, p[0], p[1], p[2]);
    }
    measured->count = kept;
}

static void save(const struct center *center, uint32_t row, const struct measured *measured, uint32_t i, uint32_t count)
{
    const struct view_args *view = &center->args->view;
    const size_t at = (size_t)row * view->width;
    const vf zero = vf_zero(), half = vf_set(0.5f), z = vi_float(vi_load(measured->z + i));
    const vi column = vi_load(measured->column + i), place_y = vi_set((uint32_t)view->origin_y + row);
    const vm some = vm_first(count);
    vf x = vf_load(measured->x + i), y = vf_load(measured->y + i), n[4], ray[2];
    if (view->perspective) {
        const vf r = vf_rcp(z);
        x = x * r;
        y = y * r;
    }
    vf_gather4((const float *)PT_DATA(center->call, center, normal) + 4 * at, column, some, n);
    vf_ray_of(view, column, vi_set(row), ray);
    // 1. to the middle of the pixel, in the view's units (perspective: at z = 1), and how n leans that way
    const vf dx = (vi_convert(vi_add(vi_set((uint32_t)view->origin_x), column)) + half) - x;
    const vf dy = (vi_convert(place_y) + half) - y;
    vf rise = n[0] * (vf_set(view->ray_xs) * dx) + n[1] * (vf_set(view->ray_ys) * dy), facing = zero - n[2];
    if (view->perspective) {
        rise = rise * z;
        facing = (n[0] * ray[0] + n[1] * ray[1]) - n[2];
    }
    // 2. the plane's step, no farther than the surface is known to go on
    const vf size = vf_abs(facing);
    const vm good = vf_lt(vf_set(1e-6f), size);
    const vf step = rise * vf_rcp(vf_select(good, size, vf_set(1.0f)));
    const vf most = vf_gather((const float *)PT_DATA(center->call, center, deff) + at, column, some);
    vf offset = vf_select(vf_lt(facing, zero), step, zero - step);
    offset = vf_min(vf_max(offset, zero - vf_min(most, half * z)), most);
    float offsets[PT_LANES], *out = (float *)PT_DATA(center->call, center, offset) + at;
    vf_store(offsets, vf_select(good, offset, zero));
    for (uint32_t k = 0; k < count; k++)
        out[measured->column[i + k]] = offsets[k];
}

static void center_row(const struct center *center, uint32_t y)
{
    const struct view_args *view = &center->args->view;
    const uint64_t *keys = (const uint64_t *)PT_DATA(center->call, center, keys) + (size_t)y * view->width;
    struct measured measured;
    for (uint32_t first = view->rect[0]; first < view->rect[2]; first += BLOCK) {
        const uint32_t end = view->rect[2] - first < BLOCK ? view->rect[2] : first + BLOCK;
        measured.count = 0;
        for (uint32_t x = first; x < end; x += PT_LANES) {
            const vi z = vi_load_z(keys + x), id = vi_load_id(keys + x);
            const vm some = vm_and(vm_first(pt_lanes_left(x, end)), vm_not(vi_eq(z, vi_set(PT_KEY_EMPTY_Z))));
            const uint32_t lanes = vm_bits(
                vm_and(some, vi_lt_unsigned(vi_sub(id, vi_set(center->first)), vi_set(center->span))));
            vi_pack(measured.column + measured.count, vi_add(vi_set(x), vi_lanes()), lanes);
            vi_pack(measured.z + measured.count, z, lanes);
            vi_pack(measured.id + measured.count, id, lanes);
            measured.count += (uint32_t)__builtin_popcount(lanes);
        }
        project(center, &measured);
        for (uint32_t i = 0; i < measured.count; i += PT_LANES)
            save(center, y, &measured, i, pt_lanes_left(i, measured.count));
    }
}

static void center_rows(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct center *center = context;
    (void)thread;
    for (uint32_t y = begin; y < end && !pt_cpu_cancelled(center->call); y++)
        center_row(center, center->args->view.rect[1] + y);
}

int PT_KERNEL_ENTRY(center)(const struct pt_cpu_call *call)
{
    const struct chunk_view *chunks = PT_DATA(call, center, chunks);
    struct center center = {.call = call, .args = call->arguments};
    const uint32_t *rect = center.args->view.rect;
    center.count = (uint32_t)(call->buffers[PT_BUF_center_chunks]->size / sizeof *chunks);
    struct start *starts = pt_cpu_scratch(call, 0, (center.count + 1) * sizeof *starts);
    if (!starts)
        return PATINA_ERROR_MEMORY;
    int sorted = 1;
    for (uint32_t c = 0; c < center.count; c++) {
        starts[c] = (struct start){chunks[c].id_base + chunks[c].first, c};
        sorted &= !c || starts[c - 1].id < starts[c].id;
    }
    if (!sorted)
        qsort(starts, center.count, sizeof *starts, by_id);
    if (!center.count || rect[0] >= rect[2] || rect[1] >= rect[3])
        return PATINA_OK;
    center.starts = starts;
    center.first = starts[0].id;
    center.span = starts[center.count - 1].id + chunks[starts[center.count - 1].chunk].count - center.first;
    pt_parallel(call->pool, rect[3] - rect[1], 8, center_rows, &center);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
