// SPDX-License-Identifier: GPL-3.0-or-later
// reopen: pixels that were closed where a station looked through; twin of shaders/kernels/reopen.comp
//
// Which cell a place falls into decides pixels: every sum is written in one order, so that all devices agree.
#include "extract.h"
#include "shared/filling.h"

struct planes { // of a row
    uint64_t *keys, *kept;
    uint32_t *from;
    const float *away, *all_away; // NULL where points are no discs; of the plane
    float *limit;
};

// 3. Whether the station looked through places at q, of those lanes that `some` names.
static inline vm looked_through(const struct station_args *station, const uint32_t *words, const vf q[3], vm some)
{
    const vf one = vf_set(1.0f), size[3] = {vf_abs(q[0]), vf_abs(q[1]), vf_abs(q[2])};
    const vm x = vm_and(vf_le(size[1], size[0]), vf_le(size[2], size[0])), y = vm_and(vm_not(x), vf_le(size[2], size[1]));
    const vf along = vf_select(x, q[0], vf_select(y, q[1], q[2])), most = vf_abs(along);
    some = vm_and(some, vm_and(vf_lt(vf_set(PT_SIGHT_LEAST), most), vf_lt(most, vf_set(PT_SIGHT_FARTHEST))));
    const vf inverse = vf_rcp(vf_select(some, most, one)), half = vf_set(0.5f * (float)station->across);
    const vf across[2] = {vf_select(x, q[1], vf_select(y, q[2], q[0])), vf_select(x, q[2], vf_select(y, q[0], q[1]))};
    vi cell[2];
    for (int k = 0; k < 2; k++) {
        const vf u = vf_select(some, across[k], vf_zero()) * inverse;
        const vf bent = u * (vf_set(PT_SIGHT_BEND) - (vf_set(PT_SIGHT_BEND - 1.0f) * u) * u);
        const vf place = vf_max((bent + one) * half, vf_zero());
        cell[k] = vf_int(vf_min(place, vf_set((float)(station->across - 1))));
    }
    vi face = vi_select(x, vi_set(0), vi_select(y, vi_set(2), vi_set(4)));
    face = vi_add(face, vi_shr(vf_bits(along), 31));
    const vi edge = vi_set(station->across);
    const vi at = vi_add(vi_set(station->first), vi_add(vi_mul(vi_add(vi_mul(face, edge), cell[1]), edge), cell[0]));
    const vi word = vi_gather(words, vi_shr(at, 1), some), low = vi_and(word, vi_set(0xFFFFu)), high = vi_shr(word, 16);
    const vi value = vi_select(vi_eq(vi_and(at, vi_set(1)), vi_set(0)), low, high);
    const vf range = vi_float(vi_add(vi_mul(value, vi_set(1u << PT_SIGHT_SHIFT)), vi_set(station->base)));
    const vf square = (q[0] * q[0] + q[1] * q[1]) + q[2] * q[2];
    some = vm_and(some, vm_not(vi_eq(value, vi_set(0))));
    return vm_and(some, vf_lt(square * vf_set(station->grow), range * range));
}

// 2. Whether some station did, of places at z on the rays of PT_LANES pixels from (x, y) on.
static inline vm seen_through(const struct pt_cpu_call *call, uint32_t x, uint32_t y, vf z, vm some)
{
    const struct reopen_args *args = call->arguments;
    const struct station_args *stations = (const struct station_args *)(args + 1);
    const float *m = args->rows;
    const vf deep = z + vf_set(args->eye_z);
    vf ray[2], way[3], q[3];
    vm seen = vm_first(0);
    vf_ray(&args->view, x, y, ray);
    for (int k = 0; k < 3; k++) {
        const vf beside = vf_set(m[3 * k]) * ray[0] + vf_set(m[3 * k + 1]) * ray[1];
        if (args->view.perspective)
            way[k] = z * (beside - vf_set(m[3 * k + 2]));
        else
            way[k] = beside - vf_set(m[3 * k + 2]) * deep;
    }
    for (uint32_t s = 0; s < args->stations; s++) {
        for (int k = 0; k < 3; k++)
            q[k] = vf_set(stations[s].eye[k]) + way[k];
        seen = vm_or(seen, looked_through(&stations[s], PT_DATA(call, reopen, sights), q, some));
    }
    return seen;
}

// 1. Which of PT_LANES pixels from (x, y) on were closed. source: of their surfaces.
static inline vm closed(const struct reopen_args *args, const struct planes *planes, uint32_t x, uint32_t y, vi source, vm some)
{
    const uint32_t width = args->view.width;
    const vf most = vf_set(PT_REOPEN_AWAY);
    const vm filled = pt_filled(source, (size_t)y * width + x, some), own = vm_and(some, vm_not(filled));
    vm far = vm_first(0);
    if (args->discs && vm_bits(own))
        far = vm_and(own, vf_lt(most, vf_load(planes->away + x)));
    if (vm_bits(filled)) {
        vi column, row;
        pt_place_of(source, width, &column, &row);
        const vf dx = vi_convert(vi_sub(column, vi_add(vi_set(x), vi_lanes()))), dy = vi_convert(vi_sub(row, vi_set(y)));
        vf left = most; // of the way, beyond how far off the point of a disc there fell
        if (args->discs)
            left = vf_max(most - vf_gather(planes->all_away, source, filled), vf_zero());
        far = vm_or(far, vm_and(filled, vf_lt(left * left, dx * dx + dy * dy)));
    }
    return far;
}

static inline vm is_ours(const struct reopen_args *args, vi z, vi id, vm some)
{
    const vm shown = vm_and(some, vm_not(vi_eq(z, vi_set(PT_KEY_EMPTY_Z))));
    return vm_and(shown, pt_has_ids(vi_sub(id, vi_set(args->id_base)), args->id_first, args->id_count));
}

static void take(const struct pt_cpu_call *call, const struct planes *planes, uint32_t x, uint32_t y, vi source, vm taken)
{
    const struct reopen_args *args = call->arguments;
    const vi self = vi_add(vi_set(y * args->view.width + x), vi_lanes());
    const vm filled = pt_filled(source, (size_t)y * args->view.width + x, taken);
    const vi kept_z = vi_load_z(planes->kept + x), kept_id = vi_load_id(planes->kept + x);
    vm empty = vm_and(taken, vm_not(filled)); // a disc: nothing is kept beneath
    const vm ours = args->discs ? is_ours(args, kept_z, kept_id, filled) : vm_first(0);
    if (vm_bits(ours)) {
        const vm far = vm_and(ours, vf_lt(vf_set(PT_REOPEN_AWAY), vf_load(planes->away + x)));
        empty = vm_or(empty, seen_through(call, x, y, vi_float(kept_z), far));
    }
    vi_store_keys(planes->keys + x, vi_select(empty, vi_set(PT_KEY_EMPTY_Z), kept_z),
                  vi_select(empty, vi_set(PT_KEY_EMPTY_ID), kept_id), vm_bits(taken));
    vi_store_where(planes->from + x, self, taken);
}

static void show(const struct reopen_args *args, float *color, uint32_t x, uint32_t y, uint32_t lanes)
{
    for (; lanes; lanes &= lanes - 1) {
        float *pixel = color + 4 * ((size_t)y * args->view.width + x + (uint32_t)__builtin_ctz(lanes));
        pixel[0] = pixel[2] = pixel[3]; // premultiplied
        pixel[1] = 0.0f;
    }
}

static void find(const struct pt_cpu_call *call, const struct planes *planes, uint32_t x, vf z, vi source, vm some, vm seen)
{
    const struct reopen_args *args = call->arguments;
    const vf distance = vf_gather(PT_DATA(call, reopen, deff), source, seen);
    const vm written = args->first ? some : seen;
    vf_store_where(planes->limit + x, vf_select(seen, z + distance, vf_set(-1.0f)), written);
    if (args->last)
        vi_store_keys(planes->keys + x, vi_set(PT_KEY_EMPTY_Z), vi_set(PT_KEY_EMPTY_ID), vm_bits(some));
}

static void reopen_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct reopen_args *args = call->arguments;
    const uint32_t *rect = args->view.rect;
    const size_t row = (size_t)y * args->view.width;
    struct planes planes = {.keys = (uint64_t *)PT_DATA(call, reopen, keys) + row,
                            .from = (uint32_t *)PT_DATA(call, reopen, from) + row};
    planes.all_away = args->discs ? PT_DATA(call, reopen, away) : NULL;
    planes.away = args->discs ? planes.all_away + row : NULL;
    planes.limit = args->phase == PT_REOPEN_FIND ? (float *)PT_DATA(call, reopen, limit) + row : NULL;
    planes.kept = args->phase == PT_REOPEN_KEEP || args->phase == PT_REOPEN_TAKE ? (uint64_t *)PT_DATA(call, reopen, kept) + row
                                                                                 : NULL;
    if (args->phase == PT_REOPEN_KEEP) {
        memcpy(planes.kept + rect[0], planes.keys + rect[0], (rect[2] - rect[0]) * sizeof *planes.kept);
        return;
    }
    for (uint32_t x = rect[0]; x < rect[2]; x += PT_LANES) {
        const vm some = vm_first(pt_lanes_left(x, rect[2]));
        const vi z = vi_load_z(planes.keys + x), source = pt_source_of(planes.from, x);
        vm seen = is_ours(args, z, vi_load_id(planes.keys + x), some);
        if (vm_bits(seen))
            seen = closed(args, &planes, x, y, source, seen);
        if (vm_bits(seen))
            seen = seen_through(call, x, y, vi_float(z), seen);
        if (args->phase == PT_REOPEN_FIND)
            find(call, &planes, x, vi_float(z), source, some, seen);
        else if (vm_bits(seen) && args->phase == PT_REOPEN_TAKE)
            take(call, &planes, x, y, source, seen);
        else if (vm_bits(seen))
            show(args, PT_DATA(call, reopen, color), x, y, vm_bits(seen));
    }
}

int PT_KERNEL_ENTRY(reopen)(const struct pt_cpu_call *call)
{
    const struct reopen_args *args = call->arguments;
    return pt_rows(call, &args->view, reopen_row);
}
