// SPDX-License-Identifier: GPL-3.0-or-later
// raster: triangles -> least key a pixel; twin of shaders/kernels/raster.comp
//
// Which centres a row of a triangle covers is solved for, in 64-bit integers; depths along it go in vectors. Threads share the
// plane as in scatter.
#include "mesh.h"
#include "texture.h"
#include "shared/meshes.h"

enum { BATCH = 128 }; // triangles

struct target {
    uint64_t *keys;
    const float *limit;            // only what lies beyond counts; NULL: everything
    const struct pt_cpu_call *cut; // by the opacity of the mesh's image; NULL: nothing is
};

// Which of PT_LANES pixels of a triangle, in the planes from (x, y) on, the image leaves.
static vm left_by_image(const struct pt_cpu_call *call, uint32_t index, uint32_t x, uint32_t y, vm lanes)
{
    const struct raster_args *args = call->arguments;
    struct pt_triangle t;
    struct pt_on_image place;
    vf color[4];
    pt_find_triangle(&args->view, &args->mesh, PT_DATA(call, raster, vertices), PT_DATA(call, raster, indices), vi_set(index),
                     x, y, lanes, &t);
    pt_place_on_image(&t, &args->mesh.texture, PT_DATA(call, raster, vertices), lanes, &place);
    pt_image_at(&args->mesh.texture, PT_DATA(call, raster, texels), &place, lanes, color);
    return vm_and(lanes, vf_le(vf_set(args->mesh.texture.cut), color[3]));
}

static int64_t divide_down(int64_t a, int64_t b) // b > 0; towards -inf
{
    return a >= 0 ? a / b : -((b - 1 - a) / b);
}

// Narrows the columns [*first, *end) to those whose centre, in the row of centre `sy`, lies on the inner side of an edge.
static void narrow(int32_t ax, int32_t ay, int32_t bx, int32_t by, int64_t sy, int64_t *first, int64_t *end)
{
    const int64_t half = 1 << (PT_MESH_BITS - 1), unit = 1 << PT_MESH_BITS;
    int64_t dx = (int64_t)bx - ax, dy = (int64_t)by - ay;
    int owned = dy < 0 || (dy == 0 && dx < 0);
    int64_t room = dx * (sy - ay) - (owned ? 0 : 1); // dy (x - ax) <= room
    if (dy == 0) {
        *end = room < 0 ? *first : *end;
    } else if (dy > 0) {
        int64_t last = divide_down(divide_down(room, dy) + ax - half, unit);
        *end = last + 1 < *end ? last + 1 : *end;
    } else {
        int64_t least = ax - half - divide_down(room, -dy); // the first centre is not before
        int64_t column = -divide_down(-least, unit);
        *first = column > *first ? column : *first;
    }
}

static void store_least(uint64_t *at, uint64_t key)
{
    uint64_t seen = __atomic_load_n(at, __ATOMIC_RELAXED);
    while (key < seen && !__atomic_compare_exchange_n(at, &seen, key, 1, __ATOMIC_RELAXED, __ATOMIC_RELAXED))
        ;
}

// Columns [first, end) of the full picture's row y.
static void draw_row(const struct view_args *view, const struct pt_facet *facet, uint32_t id, int32_t y, int32_t first,
                     int32_t end, struct target target)
{
    const float dy = (float)(y * (1 << PT_MESH_BITS) + (1 << (PT_MESH_BITS - 1))) - facet->below;
    const vf up = vf_set(facet->b * dy), z_near = vf_set(view->z_near), z_far = vf_set(view->z_far);
    size_t row = (size_t)(y - view->origin_y) * view->width;
    for (int32_t x = first; x < end; x += PT_LANES) {
        size_t at = row + (size_t)(x - view->origin_x);
        vm lanes = vm_first(end - x < PT_LANES ? (uint32_t)(end - x) : PT_LANES);
        vi column = vi_add(vi_set((uint32_t)x), vi_lanes());
        vf dx = vi_convert(vi_add(vi_mul(column, vi_set(1 << PT_MESH_BITS)), vi_set(1 << (PT_MESH_BITS - 1)))) -
                vf_set(facet->left);
        vf value = vf_set(facet->first) + (vf_set(facet->a) * dx + up);
        value = vf_min(vf_max(value, vf_set(facet->first)), vf_set(facet->greatest));
        vf z = view->perspective ? vf_rcp(value) : value;
        vm draw = vm_and(lanes, vm_and(vf_le(z_near, z), vf_le(z, z_far)));
        if (target.limit)
            draw = vm_and(draw, vf_lt(vf_load(target.limit + at), z));
        vi bits = vi_and(vf_bits(z), vi_set(0x7FFFFFFFu));
        uint32_t nearer = vm_bits(vm_and(draw, vm_not(vi_lt_unsigned(vi_load_z(target.keys + at), bits))));
        if (nearer && target.cut) {
            const struct raster_args *args = target.cut->arguments;
            nearer &= vm_bits(left_by_image(target.cut, id - args->mesh.id_base, (uint32_t)(x - view->origin_x),
                                            (uint32_t)(y - view->origin_y), draw));
        }
        if (!nearer)
            continue;
        uint32_t zs[PT_LANES];
        vi_store(zs, bits);
        for (; nearer; nearer &= nearer - 1) {
            uint32_t k = (uint32_t)__builtin_ctz(nearer);
            store_least(target.keys + at + k, (uint64_t)zs[k] << 32 | id);
        }
    }
}

static void draw_facet(const struct view_args *view, const struct pt_facet *facet, uint32_t id, struct target target)
{
    const int32_t half = 1 << (PT_MESH_BITS - 1), unit = 1 << PT_MESH_BITS;
    const int32_t *x = facet->x, *y = facet->y;
    int32_t low[2] = {x[0], y[0]}, high[2] = {x[0], y[0]};
    for (int k = 1; k < 3; k++) {
        low[0] = x[k] < low[0] ? x[k] : low[0];
        low[1] = y[k] < low[1] ? y[k] : low[1];
        high[0] = x[k] > high[0] ? x[k] : high[0];
        high[1] = y[k] > high[1] ? y[k] : high[1];
    }
    int32_t begin[2] = {view->origin_x, view->origin_y};
    int32_t end[2] = {view->origin_x + (int32_t)view->width, view->origin_y + (int32_t)view->height};
    for (int k = 0; k < 2; k++) { // the centres between them
        int32_t first = (int32_t)-divide_down(half - low[k], unit), last = (int32_t)divide_down(high[k] - half, unit);
        begin[k] = first > begin[k] ? first : begin[k];
        end[k] = last + 1 < end[k] ? last + 1 : end[k];
    }
    for (int32_t row = begin[1]; row < end[1]; row++) {
        int64_t first = begin[0], last = end[0];
        for (int k = 0; k < 3; k++)
            narrow(x[k], y[k], x[k < 2 ? k + 1 : 0], y[k < 2 ? k + 1 : 0], (int64_t)row * unit + half, &first, &last);
        if (first < last)
            draw_row(view, facet, id, row, (int32_t)first, (int32_t)last, target);
    }
}

static void raster_range(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct pt_cpu_call *call = context;
    const struct raster_args *args = call->arguments;
    const struct target target = {PT_DATA(call, raster, keys), args->behind ? PT_DATA(call, raster, limit) : NULL,
                                  args->mesh.texture.cut > 0.0f ? call : NULL};
    (void)thread;
    for (uint32_t batch = begin; batch < end && !pt_cpu_cancelled(call); batch++) {
        uint32_t first = batch * BATCH, left = args->mesh.id_count - first;
        for (uint32_t i = first; i < first + (left < BATCH ? left : BATCH); i++) {
            struct pt_outline outline;
            struct pt_facet facet;
            pt_outline_of(&args->view, &args->mesh, PT_DATA(call, raster, vertices), PT_DATA(call, raster, indices), i,
                          &outline);
            for (uint32_t k = 1; k + 1 < outline.count; k++)
                if (pt_facet_of(&outline, k, &facet))
                    draw_facet(&args->view, &facet, args->mesh.id_base + i, target);
        }
    }
}

int PT_KERNEL_ENTRY(raster)(const struct pt_cpu_call *call)
{
    const struct raster_args *args = call->arguments;
    pt_parallel(call->pool, (args->mesh.id_count + BATCH - 1) / BATCH, 1, raster_range, (void *)call);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
