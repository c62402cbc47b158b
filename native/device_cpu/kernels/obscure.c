// SPDX-License-Identifier: GPL-3.0-or-later
// obscure: ambient obscurance within a view-space radius; twin of shaders/kernels/obscure.comp
//   1. every pixel's taps   2. the mean over 5 x 5 of them, and the colour
#include "device_cpu/picture_rows.h"
#include "shared/effects.h"

enum { BAND_ROWS = 32, REACH = PT_OBSCURE_BLUR, RING = 2 * REACH + 1 };

struct obscure {
    const struct pt_cpu_call *call;
    const struct obscure_args *args;
    struct pt_planes planes;
    float *rows; // per thread: a ring of rows of z and of what is obscured
    size_t stride;
};

struct row {
    float *z, *obscured;
};

// ---- 1. taps -----------------------------------------------------------------------------------------------------------

struct point {
    vf z, ray[2], n[3];
    vf radius, pixels, inverse; // of the taps: in the scene, on screen; 1 / radius
    vf turn[2];                 // cosine, sine
};

static void place(const struct obscure *obscure, uint32_t x, uint32_t y, vm some, struct point *p)
{
    const struct obscure_args *args = obscure->args;
    const struct view_args *view = &args->view;
    const vf zero = vf_zero();
    vf shown[4], width = vf_footprint(view, p->z), toward;
    vf_ray(view, x, y, p->ray);
    vf_load4((const float *)PT_DATA(obscure->call, obscure, shading) + 4 * ((size_t)y * view->width + x), shown);
    toward = zero - shown[2]; // n . r: a surface that faces away from the viewer is seen from behind
    if (view->perspective)
        toward = (shown[0] * p->ray[0] + shown[1] * p->ray[1]) - shown[2];
    for (int k = 0; k < 3; k++)
        p->n[k] = vf_select(vf_lt(zero, toward), zero - shown[k], shown[k]);
    p->pixels = vf_min(vf_set(args->radius) * vf_rcp(vf_select(some, width, vf_set(1.0f))), vf_set(PT_OBSCURE_MOST));
    p->radius = p->pixels * width;
    p->inverse = vf_rcp(vf_select(some, p->radius, vf_set(1.0f)));
    vi column = vi_add(vi_set((uint32_t)view->origin_x + x), vi_lanes());
    vi turn = vi_add(vi_and(column, vi_set(3)), vi_set(4 * (((uint32_t)view->origin_y + y) & 3u)));
    for (uint32_t k = 0; k < 2; k++)
        p->turn[k] = vf_gather(args->turns, vi_add(vi_mul(turn, vi_set(2)), vi_set(k)), some);
}

// What the tap adds.
static vf tap(const struct obscure *obscure, const struct point *p, int i, uint32_t x, uint32_t y, vm some)
{
    const struct view_args *view = &obscure->args->view;
    const vf half = vf_set(0.5f), one = vf_set(1.0f), xs = vf_set(view->ray_xs), ys = vf_set(view->ray_ys);
    const vf sx = vf_set(obscure->args->spiral[2 * i]), sy = vf_set(obscure->args->spiral[2 * i + 1]);
    vf dx = vf_floor((p->turn[0] * sx - p->turn[1] * sy) * p->pixels + half);
    vf dy = vf_floor((p->turn[1] * sx + p->turn[0] * sy) * p->pixels + half);
    vi qx = vi_add(vi_add(vi_set(x), vi_lanes()), vf_int(dx)), qy = vi_add(vi_set(y), vf_int(dy));
    vm inside = vm_and(some, vm_and(vi_lt_unsigned(qx, vi_set(view->width)), vi_lt_unsigned(qy, vi_set(view->height))));
    vf z = vi_float(vi_gather_z(obscure->planes.keys, vi_add(vi_mul(qy, vi_set(view->width)), qx), inside)), v[3];
    v[0] = xs * dx;
    v[1] = ys * dy;
    if (view->perspective) {
        v[0] = z * (p->ray[0] + v[0]) - p->z * p->ray[0];
        v[1] = z * (p->ray[1] + v[1]) - p->z * p->ray[1];
    }
    v[2] = p->z - z;
    for (int k = 0; k < 3; k++)
        v[k] = v[k] * p->inverse;
    vf square = (v[0] * v[0] + v[1] * v[1]) + v[2] * v[2];
    vm near = vm_and(inside, vf_lt(square, one)); // not where the tap is empty: its z is +inf
    square = vf_select(near, square, one);
    vf cosine = ((p->n[0] * v[0] + p->n[1] * v[1]) + p->n[2] * v[2]) * vf_rsqrt(square + vf_set(1e-4f));
    vf above = vf_max(vf_select(near, cosine, vf_zero()) - vf_set(PT_OBSCURE_BIAS), vf_zero());
    return vf_mul_where(near, above, one - square);
}

static void gather_row(void *context, uint32_t y)
{
    const struct obscure *obscure = context;
    const struct view_args *view = &obscure->args->view;
    float *out = PT_DATA(obscure->call, obscure, obscured);
    for (uint32_t x = view->rect[0]; x < view->rect[2]; x += PT_LANES) {
        size_t at = (size_t)y * view->width + x;
        struct point p = {.z = vi_float(vi_load_z(obscure->planes.keys + at))};
        vm some = vm_and(vm_first(pt_lanes_left(x, view->rect[2])), vf_lt(p.z, vf_set(pt_float(PT_KEY_EMPTY_Z))));
        vf sum = vf_zero();
        if (!vm_bits(some))
            continue;
        place(obscure, x, y, some, &p);
        for (int i = 0; i < PT_OBSCURE_TAPS; i++)
            sum = sum + tap(obscure, &p, i, x, y, some);
        vf_store_where(out + at, vf_min(sum * vf_set(PT_OBSCURE_GAIN / PT_OBSCURE_TAPS), vf_set(1.0f)), some);
    }
}

// ---- 2. mean and colour ------------------------------------------------------------------------------------------------

static struct row ring_row(const struct obscure *obscure, uint32_t thread, int32_t y)
{
    const uint32_t slot = (uint32_t)(y + RING) % RING;
    float *row = obscure->rows + ((size_t)thread * RING + slot) * 2 * obscure->stride + PT_ROW_PAD;
    return (struct row){row, row + obscure->stride};
}

static void load_row(const struct obscure *obscure, int32_t y, const struct row *row)
{
    const uint32_t width = obscure->args->view.width;
    pt_empty_row(row->z, width);
    if (y < 0 || y >= (int32_t)obscure->args->view.height)
        return;
    const float *from = (const float *)PT_DATA(obscure->call, obscure, obscured) + (size_t)y * width;
    for (uint32_t x = 0; x < width; x += PT_LANES) {
        vm lanes = vm_first(pt_lanes_left(x, width));
        vf_store_where(row->z + x, vi_float(vi_load_z(obscure->planes.keys + (size_t)y * width + x)), lanes);
        vf_store_where(row->obscured + x, vf_load(from + x), lanes);
    }
}

static void blur_row(const struct obscure *obscure, const struct row rows[RING], uint32_t y)
{
    static const float weights[RING] = {0.5f, 1.0f, 1.0f, 1.0f, 0.5f};
    const struct view_args *view = &obscure->args->view;
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z)), one = vf_set(1.0f);
    float *colors = PT_DATA(obscure->call, obscure, color);
    for (uint32_t x = view->rect[0]; x < view->rect[2]; x += PT_LANES) {
        size_t at = (size_t)y * view->width + x;
        vf z = vf_load(rows[REACH].z + x), sum = vf_zero(), total = vf_zero(), color[4];
        vm some = vm_and(vm_first(pt_lanes_left(x, view->rect[2])), vf_lt(z, empty));
        if (!vm_bits(some))
            continue;
        vf limit = vf_set(2.0f) * vf_gather(obscure->planes.deff, pt_source(&obscure->planes, at), some);
        for (int dy = 0; dy < RING; dy++)
            for (int dx = 0; dx < RING; dx++) {
                const vf weight = vf_set(weights[dx] * weights[dy]);
                const float *near = rows[dy].z + x + dx - REACH;
                vm same = vm_and(some, vf_le(vf_abs(vf_load(near) - z), limit));
                sum = sum + vf_mul_where(same, weight, vf_load(rows[dy].obscured + x + dx - REACH));
                total = vf_add_where(same, total, weight);
            }
        vf mean = sum * vf_rcp(vf_select(some, total, one));
        vf light = vf_max(one - vf_set(obscure->args->strength) * mean, vf_zero());
        vf_load4(colors + 4 * at, color);
        for (int k = 0; k < 3; k++)
            color[k] = color[k] * light;
        vf_store4(colors + 4 * at, color, vm_bits(some));
    }
}

static void blur_bands(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct obscure *obscure = context;
    const uint32_t *rect = obscure->args->view.rect;
    for (uint32_t band = begin; band < end && !pt_cpu_cancelled(obscure->call); band++) {
        int32_t first = (int32_t)(rect[1] + band * BAND_ROWS);
        int32_t last = first + BAND_ROWS < (int32_t)rect[3] ? first + BAND_ROWS : (int32_t)rect[3];
        for (int32_t y = first - 2 * REACH; y < last; y++) {
            struct row row = ring_row(obscure, thread, y + REACH), rows[RING];
            load_row(obscure, y + REACH, &row);
            if (y < first)
                continue;
            for (int32_t k = 0; k < RING; k++)
                rows[k] = ring_row(obscure, thread, y + k - REACH);
            blur_row(obscure, rows, (uint32_t)y);
        }
    }
}

static void gather_rows(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct obscure *obscure = context;
    (void)thread;
    for (uint32_t y = begin; y < end && !pt_cpu_cancelled(obscure->call); y++)
        gather_row(context, obscure->args->view.rect[1] + y);
}

int PT_KERNEL_ENTRY(obscure)(const struct pt_cpu_call *call)
{
    const struct obscure_args *args = call->arguments;
    const uint32_t *rect = args->view.rect;
    struct obscure obscure = {.call = call,
                              .args = args,
                              .planes = {.view = &args->view,
                                         .keys = PT_DATA(call, obscure, keys),
                                         .from = PT_DATA(call, obscure, from),
                                         .deff = PT_DATA(call, obscure, deff)},
                              .stride = pt_row_stride(args->view.width)};
    if (rect[0] >= rect[2] || rect[1] >= rect[3])
        return PATINA_OK;
    obscure.rows = pt_cpu_scratch(call, 0, pt_pool_threads(call->pool) * RING * 2 * obscure.stride * sizeof(float));
    if (!obscure.rows)
        return PATINA_ERROR_MEMORY;
    pt_parallel(call->pool, rect[3] - rect[1], 8, gather_rows, &obscure);
    if (!pt_cpu_cancelled(call))
        pt_parallel(call->pool, (rect[3] - rect[1] + BAND_ROWS - 1) / BAND_ROWS, 1, blur_bands, &obscure);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
