// SPDX-License-Identifier: GPL-3.0-or-later
// slope: values around a pixel -> the plane that fits them best; twin of shaders/kernels/slope.comp
#include "device_cpu/rows.h"
#include "shared/effects.h"

struct slope {
    const struct slope_args *args;
    const uint64_t *keys;
    const float *values;
};

struct here { // PT_LANES pixels
    uint32_t x, y;
    vm some;
    vf z, limit, value;
    vf step, wide, inverse; // of the taps; (radius + 1)^2, and 1 over it
    int one;                // all steps are 1
};

struct sums { // weights; of places, their squares and values, weighted
    vf w, x, y, xx, xy, yy, v, xv, yv;
};

static inline __attribute__((always_inline)) void add(const struct slope *slope, const struct here *here, int i, int j,
                                                      struct sums *sums)
{
    const struct view_args *view = &slope->args->view;
    const vf dx = here->step * vf_set((float)i), dy = here->step * vf_set((float)j);
    const vf square = dx * dx + dy * dy, w = vf_set(1.0f) - square * here->inverse;
    const vi x = vi_add(vi_add(vi_set(here->x), vi_lanes()), vf_int(dx)), y = vi_add(vi_set(here->y), vf_int(dy));
    const vi column = vi_sub(x, vi_set(view->rect[0])), row = vi_sub(y, vi_set(view->rect[1]));
    vm taken = vm_and(here->some, vf_lt(square, here->wide));
    taken = vm_and(taken, vi_lt_unsigned(column, vi_set(view->rect[2] - view->rect[0])));
    taken = vm_and(taken, vi_lt_unsigned(row, vi_set(view->rect[3] - view->rect[1])));
    if (!vm_bits(taken))
        return;
    vf z, value;
    const int64_t first = ((int64_t)here->y + j) * view->width + (int64_t)here->x + i;
    if (here->one && first >= 0 && first + PT_LANES <= (int64_t)view->width * view->height) {
        z = vi_float(vi_load_z(slope->keys + first));
        value = vf_load(slope->values + first);
    } else {
        const vi at = vi_add(vi_mul(y, vi_set(view->width)), x);
        z = vi_float(vi_gather_z(slope->keys, at, taken));
        value = vf_gather(slope->values, at, taken);
    }
    taken = vm_and(taken, vf_le(vf_abs(z - here->z), here->limit));
    taken = vm_and(taken, vi_lt_unsigned(vi_and(vf_bits(value), vi_set(0x7FFFFFFFu)), vi_set(0x7F800000u)));
    const vf v = vf_select(taken, value - here->value, vf_zero()), wx = w * dx, wy = w * dy;
    sums->w = vf_add_where(taken, sums->w, w);
    sums->x = vf_add_where(taken, sums->x, wx);
    sums->y = vf_add_where(taken, sums->y, wy);
    sums->xx = vf_add_where(taken, sums->xx, wx * dx);
    sums->xy = vf_add_where(taken, sums->xy, wx * dy);
    sums->yy = vf_add_where(taken, sums->yy, wy * dy);
    sums->v = vf_add_where(taken, sums->v, w * v);
    sums->xv = vf_add_where(taken, sums->xv, wx * v);
    sums->yv = vf_add_where(taken, sums->yv, wy * v);
}

static void fit(const struct here *here, const struct sums *sums, vf out[4])
{
    const vf steepest = vf_set(PT_SLOPE_STEEPEST), zero = vf_zero();
    const vf per = vf_rcp(sums->w), x = sums->x * per, y = sums->y * per, v = sums->v * per;
    const vf xx = (sums->xx * per - x * x) + vf_set(PT_SLOPE_RIDGE), yy = (sums->yy * per - y * y) + vf_set(PT_SLOPE_RIDGE);
    const vf xy = sums->xy * per - x * y, xv = sums->xv * per - x * v, yv = sums->yv * per - y * v;
    const vf solved = vf_rcp(vf_max(xx * yy - xy * xy, vf_set(PT_SLOPE_RIDGE * PT_SLOPE_RIDGE)));
    const vf gx = (yy * xv - xy * yv) * solved, gy = (xx * yv - xy * xv) * solved;
    out[0] = here->value + (v - (gx * x + gy * y));
    out[1] = vf_min(vf_max(gx, zero - steepest), steepest);
    out[2] = vf_min(vf_max(gy, zero - steepest), steepest);
    out[3] = vf_set(1.0f);
}

static void slope_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct slope slope = {call->arguments, PT_DATA(call, slope, keys), PT_DATA(call, slope, values)};
    const struct view_args *view = &slope.args->view;
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z)), one = vf_set(1.0f), zero = vf_zero();
    float *out = (float *)PT_DATA(call, slope, slopes) + 4 * (size_t)y * view->width;
    for (uint32_t x = view->rect[0]; x < view->rect[2]; x += PT_LANES) {
        const size_t at = (size_t)y * view->width + x;
        const vf z = vi_float(vi_load_z(slope.keys + at)), value = vf_load(slope.values + at);
        const vm shown = vm_and(vm_first(pt_lanes_left(x, view->rect[2])), vf_lt(z, empty));
        const vm known = vi_lt_unsigned(vi_and(vf_bits(value), vi_set(0x7FFFFFFFu)), vi_set(0x7F800000u));
        struct here here = {.x = x, .y = y, .some = vm_and(shown, known)};
        vf n[4], ray[2], fitted[4] = {zero, zero, zero, zero};
        if (!vm_bits(shown))
            continue;
        if (vm_bits(here.some)) {
            // 1. two spacings across the view, in pixels
            const vi source = pt_source_of((const uint32_t *)PT_DATA(call, slope, from), at);
            here.z = vf_select(here.some, z, one);
            here.value = vf_select(here.some, value, zero);
            here.limit = vf_select(here.some, vf_gather(PT_DATA(call, slope, deff), source, here.some), one);
            vf_gather4(PT_DATA(call, slope, normal), source, here.some, n);
            for (int k = 0; k < 3; k++)
                n[k] = vf_select(here.some, n[k], zero);
            vf_ray(view, x, y, ray);
            const vf across = here.limit * vf_max(vf_abs(vf_cosine(view, n, ray)), vf_set(PT_SLOPE_GRAZING));
            vf radius = vf_floor(across * vf_rcp(vf_footprint(view, here.z)) + vf_set(0.5f));
            radius = vf_min(vf_max(radius, vf_set(PT_SLOPE_LEAST)), vf_set((float)PT_SLOPE_MOST));
            radius = vf_select(here.some, radius, vf_set(PT_SLOPE_LEAST));
            here.step = vf_floor((radius + vf_set((float)PT_SLOPE_TAPS - 1.0f)) * vf_set(1.0f / (float)PT_SLOPE_TAPS));
            here.wide = (radius + one) * (radius + one);
            here.inverse = vf_rcp(here.wide);
            here.one = !vm_bits(vf_lt(one, here.step));
            // 2. sums of what is around
            struct sums sums = {zero, zero, zero, zero, zero, zero, zero, zero, zero};
            const int reach = here.one ? vf_greatest(radius, here.some, PT_SLOPE_TAPS) : PT_SLOPE_TAPS;
            for (int j = -reach; j <= reach; j++)
                for (int i = -reach; i <= reach; i++)
                    add(&slope, &here, i, j, &sums);
            // 3. the plane
            sums.w = vf_select(here.some, sums.w, one);
            fit(&here, &sums, fitted);
            for (int k = 0; k < 4; k++)
                fitted[k] = vf_select(here.some, fitted[k], zero);
        }
        vf_store4(out + 4 * (size_t)x, fitted, vm_bits(shown));
    }
}

int PT_KERNEL_ENTRY(slope)(const struct pt_cpu_call *call)
{
    const struct slope_args *args = call->arguments;
    return pt_rows(call, &args->view, slope_row);
}
