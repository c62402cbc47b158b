// SPDX-License-Identifier: GPL-3.0-or-later
// incline: places of cells -> their normals [K II.C]; twin of shaders/kernels/incline.comp
#include "device_cpu/kernels/ranges.h"
#include "shared/ranges.h"

// The cells around, anticlockwise.
static const int32_t ring[8][2] = {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}};

struct cell {
    vf place[4], ray[2], scale; // 1 / footprint
    vm some;
    vi x, y;
};

// The way to a cell around, in cells; 0 where it is none, or not joined.
// joined: grows by 1 where it is.
static void step_to(const struct incline_args *args, const float *places, const struct cell *cell, int k, vf out[3], vf *joined)
{
    const struct view_args *view = &args->view;
    const vi x = vi_add(cell->x, vi_set((uint32_t)ring[k][0])), y = vi_add(cell->y, vi_set((uint32_t)ring[k][1]));
    const vf zero = vf_zero();
    vm some = vm_and(cell->some, pt_range_inside(view, x, y));
    vf other[4];
    vf_gather4(places, vi_add(vi_mul(y, vi_set(view->width)), x), some, other);
    some = vm_and(some, vf_lt(zero, other[3]));
    const vf deeper = other[2] - cell->place[2], nearer = vf_select(some, vf_min(other[2], cell->place[2]), vf_set(1.0f));
    some = vm_and(some, vf_le(vf_abs(deeper), pt_range_step(view, args->gamma, args->gamma_cells, nearer)));
    *joined = vf_add_where(some, *joined, vf_set(1.0f));
    vf across = (vf_set((float)ring[k][0]) + (other[0] - cell->place[0])) * vf_set(view->ray_xs);
    vf up = (vf_set((float)ring[k][1]) + (other[1] - cell->place[1])) * vf_set(view->ray_ys);
    if (view->perspective) {
        across = across * other[2] + cell->ray[0] * deeper;
        up = up * other[2] + cell->ray[1] * deeper;
    }
    out[0] = vf_select(some, across * cell->scale, zero);
    out[1] = vf_select(some, up * cell->scale, zero);
    out[2] = vf_select(some, (zero - deeper) * cell->scale, zero);
}

static void incline_cells(const struct incline_args *args, const float *places, float *inclined, uint32_t x, uint32_t y)
{
    const struct view_args *view = &args->view;
    const vf zero = vf_zero(), one = vf_set(1.0f);
    const size_t at = (size_t)y * view->width + x;
    struct cell cell = {.x = vi_add(vi_set(x), vi_lanes()), .y = vi_set(y)};
    const vm lanes = vm_first(pt_lanes_left(x, view->rect[2]));
    vf steps[8][3], n[4] = {zero, zero, zero, zero};
    vf_load4(places + 4 * at, cell.place);
    cell.some = vm_and(lanes, vf_lt(zero, cell.place[3]));
    if (!vm_bits(cell.some))
        return;
    cell.place[2] = vf_select(cell.some, cell.place[2], one);
    const vf px = vi_convert(vi_add(cell.x, vi_set((uint32_t)view->origin_x))) + cell.place[0];
    const vf py = vi_convert(vi_add(cell.y, vi_set((uint32_t)view->origin_y))) + cell.place[1];
    cell.ray[0] = vf_set(view->ray_x0) + vf_set(view->ray_xs) * px;
    cell.ray[1] = vf_set(view->ray_y0) + vf_set(view->ray_ys) * py;
    cell.scale = vf_rcp(vf_footprint(view, cell.place[2]));
    for (int k = 0; k < 8; k++)
        step_to(args, places, &cell, k, steps[k], &n[3]);
    // all pairs less than half a turn apart: 24 triangles
    for (int k = 0; k < 8; k++) {
        vf b[3];
        const vf *a = steps[k];
        for (int c = 0; c < 3; c++)
            b[c] = (steps[(k + 1) % 8][c] + steps[(k + 2) % 8][c]) + steps[(k + 3) % 8][c];
        n[0] = n[0] + (a[1] * b[2] - a[2] * b[1]);
        n[1] = n[1] + (a[2] * b[0] - a[0] * b[2]);
        n[2] = n[2] + (a[0] * b[1] - a[1] * b[0]);
    }
    const vf square = (n[0] * n[0] + n[1] * n[1]) + n[2] * n[2];
    const vm good = vf_lt(vf_set(1e-12f), square);
    const vf scale = vf_rsqrt(vf_select(good, square, one));
    vf towards[3] = {zero, zero, one}, facing = n[2];
    if (view->perspective) {
        const vf r = vf_rsqrt((cell.ray[0] * cell.ray[0] + cell.ray[1] * cell.ray[1]) + one);
        towards[0] = (zero - cell.ray[0]) * r;
        towards[1] = (zero - cell.ray[1]) * r;
        towards[2] = r;
        facing = n[2] - (n[0] * cell.ray[0] + n[1] * cell.ray[1]);
    }
    const vm away = vf_lt(facing, zero);
    for (int c = 0; c < 3; c++) {
        const vf unit = n[c] * scale;
        n[c] = vf_select(good, vf_select(away, zero - unit, unit), towards[c]);
    }
    vf_store4(inclined + 4 * at, n, vm_bits(cell.some));
}

static void incline_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct incline_args *args = call->arguments;
    for (uint32_t x = args->view.rect[0]; x < args->view.rect[2]; x += PT_LANES)
        incline_cells(args, PT_DATA(call, incline, place), PT_DATA(call, incline, inclined), x, y);
}

int PT_KERNEL_ENTRY(incline)(const struct pt_cpu_call *call)
{
    const struct incline_args *args = call->arguments;
    return pt_rows(call, &args->view, incline_row);
}
