// SPDX-License-Identifier: GPL-3.0-or-later
// differ: points of an image buffer's cells -> between which depths the means of single scans lie; twin of shaders/kernels/differ.comp
#include "device_cpu/kernels/cells.h"
#include "shared/ranges.h"

// Of a cell, for each of PT_DIFFER_SCANS scans: points, and how far they lie off the cell's plane.

// How far points lie off the plane through the middle of their cell, at the depth of its nearest point.
static vf off_plane(const struct view_args *view, vf x, vf y, vf z, vf behind, const vf n[4])
{
    const vf half = vf_set(0.5f), column = vf_floor(x), row = vf_floor(y);
    vf across = vf_set(view->ray_xs) * ((x - column) - half), up = vf_set(view->ray_ys) * ((y - row) - half);
    if (view->perspective) {
        const vf u = vf_set(view->ray_x0) + vf_set(view->ray_xs) * (column + half),
                 v = vf_set(view->ray_y0) + vf_set(view->ray_ys) * (row + half);
        across = u * behind + across * z;
        up = v * behind + up * z;
    }
    return (n[0] * across + n[1] * up) - n[2] * behind;
}

static void add(const struct pt_cells *cells, struct pt_cell_band *band, const struct pt_cell_block *block)
{
    const struct differ_args *args = cells->call->arguments;
    const struct view_args *view = cells->view;
    const uint64_t *keys = PT_DATA(cells->call, differ, keys);
    const vf zero = vf_zero(), one = vf_set(1.0f), minus = vf_set(-1.0f);
    for (uint32_t i = 0; i < block->count; i += PT_LANES) {
        const vm lanes = vm_first(pt_lanes_left(i, block->count));
        const vi at = vi_load(block->cell + i), id = vi_load(block->id + i);
        const vf z = vf_load(block->z + i), nearest = vf_select(lanes, vi_float(vi_gather_z(keys, at, lanes)), one);
        const vf gamma = pt_range_gamma(view, args->gamma, args->gamma_cells, nearest), behind = z - nearest;
        const vi word = vi_gather_bytes(PT_DATA(cells->call, differ, scans), vi_add(id, id), lanes);
        const vi scan = vi_sub(vi_and(word, vi_set(PT_DIFFER_MOST - 1)), vi_set(args->first));
        vm some = vm_and(lanes, vm_and(vf_le(zero, behind), vf_le(behind, gamma)));
        some = vm_and(some, vi_lt_unsigned(scan, vi_set(PT_DIFFER_SCANS)));
        if (!vm_bits(some))
            continue;
        vf normal[4];
        float terms[PT_LANES];
        uint32_t scans[PT_LANES];
        vf_gather4(PT_DATA(cells->call, differ, inclined), at, some, normal);
        const vf off = off_plane(view, vf_load(block->x + i), vf_load(block->y + i), z, behind, normal);
        const vf share = off * vf_rcp(pt_cell_reach(view, gamma, nearest));
        vf_store(terms, vf_max(vf_min(share, one), minus) * vf_set(PT_SUM_SCALE));
        vi_store(scans, scan);
        for (uint32_t left = vm_bits(some); left; left &= left - 1) {
            const uint32_t lane = (uint32_t)__builtin_ctz(left);
            int64_t *sums = band->sums + PT_SUMS * (block->cell[i + lane] - (size_t)band->first * view->width) +
                            2 * scans[lane];
            sums[0]++;
            sums[1] += (int32_t)terms[lane];
        }
    }
}

static void save(const struct pt_cells *cells, const struct pt_cell_band *band, size_t at, uint32_t count)
{
    const struct differ_args *args = cells->call->arguments;
    const struct view_args *view = cells->view;
    const vf z = vi_float(vi_load_z((const uint64_t *)PT_DATA(cells->call, differ, keys) + at)), one = vf_set(1.0f);
    const vm lanes = vm_first(count), some = vm_and(lanes, vf_lt(z, vf_set(pt_float(PT_KEY_EMPTY_Z))));
    const int64_t *from = band->sums + PT_SUMS * (at - (size_t)band->first * view->width);
    float *least_of = (float *)PT_DATA(cells->call, differ, least) + at,
          *most_of = (float *)PT_DATA(cells->call, differ, most) + at;
    const vf nearest = vf_select(some, z, one);
    const vf unit = pt_cell_reach(view, pt_range_gamma(view, args->gamma, args->gamma_cells, nearest), nearest) *
                    vf_set(1.0f / PT_SUM_SCALE);
    vf least = vf_set(PT_RANGE_MOST), most = vf_set(-PT_RANGE_MOST);
    if (!args->start) {
        least = vf_load(least_of);
        most = vf_load(most_of);
    }
    for (uint32_t k = 0; k < PT_DIFFER_SCANS; k++) {
        float points[PT_LANES], sums[PT_LANES];
        for (uint32_t i = 0; i < PT_LANES; i++) {
            points[i] = i < count ? pt_wide_sum(from[PT_SUMS * i + 2 * k]) : 0.0f;
            sums[i] = i < count ? pt_wide_sum(from[PT_SUMS * i + 2 * k + 1]) : 0.0f;
        }
        const vf n = vf_load(points);
        const vm known = vf_le(one, n);
        const vf mean = (vf_load(sums) * vf_rcp(vf_max(n, one))) * unit;
        least = vf_select(known, vf_min(mean, least), least);
        most = vf_select(known, vf_max(mean, most), most);
    }
    vf_store_where(least_of, least, lanes);
    vf_store_where(most_of, most, lanes);
}

int PT_KERNEL_ENTRY(differ)(const struct pt_cpu_call *call)
{
    const struct differ_args *args = call->arguments;
    struct pt_cells cells = {.call = call,
                             .view = &args->view,
                             .positions = PT_DATA(call, differ, positions),
                             .surfels = PT_DATA(call, differ, surfels),
                             .drawn = args->sifted ? PT_DATA(call, differ, drawn) : NULL,
                             .chunks = PT_DATA(call, differ, chunks),
                             .chunk_count = (uint32_t)(call->buffers[PT_BUF_differ_chunks]->size / sizeof(struct chunk_view)),
                             .add = add,
                             .save = save};
    return pt_cells_run(&cells);
}
