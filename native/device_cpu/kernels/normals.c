// SPDX-License-Identifier: GPL-3.0-or-later
// normals: image-space normals of points that have none; twin of shaders/kernels/normals.comp
//
// A plane is linear in the picture as 1/z (perspective) or z (orthographic). Least squares over the window's pixels that
// can belong to the same surface give w = w_p + a dx + b dy + c, hence the plane n . (u, v, -1) = w, hence n.
// Rows are seen as depths and what is linear in them. Where most pixels of a vector are asked for it takes its neighbours by
// plain loads; of the others those that are asked for are packed, so that sparse clouds fill the lanes too.
#include "device_cpu/picture_rows.h"
#include "shared/measured.h"

enum { BAND_ROWS = 32, ROWS_MOST = 2 * 16 + 1 };

struct depth_row {
    float *z, *w; // by column, from -PT_ROW_PAD on; +inf and anything where nothing is
};

struct center {            // PT_LANES pixels of a row
    uint32_t at[PT_LANES]; // columns, counted from the row's pad on; some of the row where nobody asks
    vf z, w;
    vf distance, slope, step[2]; // what belongs to the same surface: shared/measured.h
    vf reach;                    // radius of the window
    int32_t most;                // of reach
    vm ours;
};

struct sums {
    vf n, x, y, xx, xy, yy, w, xw, yw;
};

static vf linear_depth(const struct view_args *view, vf z)
{
    if (view->perspective)
        return vf_rcp(z);
    return z;
}

static void see_row(const struct view_args *view, const uint64_t *keys, int32_t y, const struct depth_row *row)
{
    if (y < 0 || y >= (int32_t)view->height) {
        pt_empty_row(row->z, view->width);
        return;
    }
    pt_empty_columns(row->z, -PT_ROW_PAD, 0);
    for (uint32_t x = 0; x < view->width; x += PT_LANES) {
        vf z = vi_float(vi_load_z(keys + (size_t)y * view->width + x));
        vf_store(row->z + x, z);
        vf_store(row->w + x, linear_depth(view, z));
    }
    pt_empty_columns(row->z, (int32_t)view->width, (int32_t)view->width + PT_ROW_PAD);
}

// What lies at PT_LANES columns from dx on; packed: the pixels do not follow each other.
static inline void load_columns(const float *row, const struct center *c, int32_t dx, int packed, vf out[PT_LANES])
{
    row += dx - PT_ROW_PAD;
    if (packed)
        vf_columns(row, c->at, out);
    for (uint32_t k = 0; k < PT_LANES && !packed; k++)
        out[k] = vf_load(row + c->at[0] + k);
}

// Depths at the pixels' columns, or beside them.
static vf depths_at(const struct depth_row *row, vi at, vm ours) { return vf_gather(row->z - PT_ROW_PAD, at, ours); }

// What z changes by a pixel to the next one that shows something, in steps of `across` columns and `up` rows; known: there is
// one. around: rows from the radius below on.
static vf change_towards(const struct normals_args *args, const struct depth_row *const *around, const struct center *c, vi at,
                         int across, int up, vm *known)
{
    static const float shares[PT_STEP_REACH] = {1.0f, 0.5f, 0.333333343f};
    const int radius = (int)args->radius, reach = radius < PT_STEP_REACH ? radius : PT_STEP_REACH;
    vf change = vf_zero();
    *known = vm_and(c->ours, vm_not(c->ours));
    for (int k = reach; k > 0; k--) {
        vf z = depths_at(around[radius + k * up], vi_add(at, vi_set((uint32_t)(k * across))), c->ours);
        vm some = vm_and(c->ours, vf_lt(z, vf_set(pt_float(PT_KEY_EMPTY_Z))));
        change = vf_select(some, (z - c->z) * vf_set(shares[k - 1]), change);
        *known = vm_or(*known, some);
    }
    return change;
}

// What z changes by a pixel along an axis, as far as both sides agree.
static vf step_along(const struct normals_args *args, const struct depth_row *const *around, const struct center *c, vi at,
                     int across, int up)
{
    vm known_before, known_after;
    vf a = vf_zero() - change_towards(args, around, c, at, -across, -up, &known_before);
    vf b = change_towards(args, around, c, at, across, up, &known_after);
    a = vf_select(known_before, a, b);
    b = vf_select(known_after, b, a);
    vm alike = vm_or(vm_and(vf_lt(vf_zero(), a), vf_lt(vf_zero(), b)), vm_and(vf_lt(a, vf_zero()), vf_lt(b, vf_zero())));
    return vf_select(vm_and(vm_or(known_before, known_after), alike), vf_select(vf_lt(vf_abs(a), vf_abs(b)), a, b), vf_zero());
}

static uint32_t larger(int32_t a, int32_t b)
{
    uint32_t p = (uint32_t)abs(a), q = (uint32_t)abs(b);
    return p > q ? p : q;
}

// Radius of the pixels' windows: shared/measured.h.
static void find_reach(const struct normals_args *args, struct center *c)
{
    const vf zero = vf_zero();
    vf wanted = zero - vf_floor(zero - c->distance * vf_rcp(vf_footprint(&args->view, c->z)));
    c->reach = vf_min(vf_max(wanted, vf_set(PT_ESTIMATE_LEAST)), vf_set((float)args->radius));
    c->most = vf_greatest(c->reach, c->ours, (int)args->radius);
}

// 1. Sums over the window, of rows first. Pixel counts and offsets are small integers: exact in float32. around: rows from
// `radius` below on.
static inline __attribute__((always_inline)) struct sums sum_window(const struct normals_args *args,
                                                                    const struct depth_row *const *around,
                                                                    const struct center *c, int packed, int steep)
{
    const vf zero = vf_zero(), one = vf_set(1.0f);
    struct sums s = {zero, zero, zero, zero, zero, zero, zero, zero, zero};
    for (int32_t dy = -c->most; dy <= c->most; dy++) {
        const struct depth_row *row = around[(int32_t)args->radius + dy];
        vf n = zero, x = zero, xx = zero, w = zero, xw = zero, up = c->step[1] * vf_set((float)dy);
        for (int32_t first = -c->most; first <= c->most; first += PT_LANES) {
            vf zs[PT_LANES], ws[PT_LANES];
            load_columns(row->z, c, first, packed, zs);
            load_columns(row->w, c, first, packed, ws);
            for (int32_t k = 0; k < PT_LANES && first + k <= c->most; k++) {
                const int32_t dx = first + k, far = (int32_t)larger(dx, dy);
                const vf fx = vf_set((float)dx);
                vf apart = zs[k] - c->z, tolerance = vf_max(c->distance, c->slope * vf_set((float)far));
                if (steep) {
                    const vf along = c->step[0] * fx;
                    apart = apart - (along + up);
                    tolerance = vf_max(tolerance, vf_set(PT_STEEP) * (vf_abs(along) + vf_abs(up)));
                }
                vm same = vm_and(vm_and(c->ours, vf_le(vf_set((float)far), c->reach)), vf_le(vf_abs(apart), tolerance));
                // no branch: whether a few pixels hold any of the surface is as good as random
                vf dw = vf_select(same, ws[k] - c->w, zero);
                n = vf_add_where(same, n, one);
                x = vf_add_where(same, x, fx);
                xx = vf_add_where(same, xx, fx * fx);
                w = w + dw;
                xw = xw + fx * dw;
            }
        }
        const vf fy = vf_set((float)dy);
        s.n = s.n + n;
        s.x = s.x + x;
        s.y = s.y + n * fy;
        s.xx = s.xx + xx;
        s.xy = s.xy + x * fy;
        s.yy = s.yy + n * (fy * fy);
        s.w = s.w + w;
        s.xw = s.xw + xw;
        s.yw = s.yw + fy * w;
    }
    return s;
}

// 2. Normal equations about the mean, all times n: slopes a, b of w and its value at the pixel. det is an exact integer (in
// float32 up to a rounding): 0 when the pixels lie on a line.
static vm solve(const struct center *center, const struct sums *s, vf *a, vf *b, vf *c)
{
    vf xx = s->n * s->xx - s->x * s->x, xy = s->n * s->xy - s->x * s->y, yy = s->n * s->yy - s->y * s->y;
    vf xw = s->n * s->xw - s->x * s->w, yw = s->n * s->yw - s->y * s->w;
    vf det = xx * yy - xy * xy;
    vf inverse = vf_rcp(vf_max(det, vf_set(0.5f)));
    *a = (yy * xw - xy * yw) * inverse;
    *b = (xx * yw - xy * xw) * inverse;
    *c = center->w + (s->w - (*a * s->x + *b * s->y)) * vf_rcp(vf_max(s->n, vf_set(1.0f)));
    return vf_lt(vf_set(0.5f), det);
}

struct job {
    const struct pt_cpu_call *call;
    const struct normals_args *args;
    float *memory; // per thread: a ring of rows; PT_ROW_PAD floats more before the first and behind the last
    size_t stride; // floats of a row's z, and of its w
};

// Normals of PT_LANES pixels of row y, `ours` of them: columns, as in center, and the numbers of their points in the instance.
static inline __attribute__((always_inline)) void normal_pixels(const struct job *job, const struct depth_row *const *around,
                                                                uint32_t y, vi at, vi id, vm ours, int packed)
{
    const struct normals_args *args = job->args;
    const struct view_args *view = &args->view;
    const struct instance_args *instance = &args->instance;
    const struct depth_row *own = around[args->radius];
    struct center c = {.ours = ours};
    vi_store(c.at, vi_select(ours, at, packed ? vi_set(PT_ROW_PAD) : at));
    c.z = vf_select(c.ours, depths_at(own, at, ours), vf_set(1.0f));
    c.w = linear_depth(view, c.z);
    vi word = vi_gather(PT_DATA(job->call, normals, surfels), id, c.ours);
    vf spacing = vf_look_up(instance->spacing, PT_SPACINGS, vi_shr(word, PT_SPACING_SHIFT));
    c.distance = vf_layer_distance(view, instance->d_min, spacing, c.z, vf_set(1.0f));
    c.slope = vf_set(4.0f) * vf_footprint(view, c.z); // 76 degrees
    find_reach(args, &c);
    struct sums sums;
    if (args->steep) {
        c.step[0] = step_along(args, around, &c, at, 1, 0);
        c.step[1] = step_along(args, around, &c, at, 0, 1);
        sums = sum_window(args, around, &c, packed, 1);
    } else {
        sums = sum_window(args, around, &c, packed, 0);
    }
    vf a, b, w, n[3], ray[2] = {vf_zero(), vf_zero()};
    vm found = vm_and(c.ours, solve(&c, &sums, &a, &b, &w));
    // 3. the plane's normal from dw/dx = a, dw/dy = b a pixel
    n[0] = a * vf_set(view->ray_ys);
    n[1] = b * vf_set(view->ray_xs);
    n[2] = vf_set(view->ray_xs * view->ray_ys);
    if (view->perspective) {
        vf_ray_of(view, vi_sub(at, vi_set(PT_ROW_PAD)), vi_set(y), ray);
        n[2] = (n[0] * ray[0] + n[1] * ray[1]) - w * n[2];
    }
    // 4. unit, towards the viewer: n . (u, v, -1) < 0. Largest component first, so that no square over- or underflows.
    vf largest = vf_max(vf_max(vf_abs(n[0]), vf_abs(n[1])), vf_abs(n[2]));
    found = vm_and(found, vm_and(vf_lt(vf_set(1e-30f), largest), vf_lt(largest, vf_set(1e30f))));
    vf scale = vf_rcp(vf_select(found, largest, vf_set(1.0f)));
    for (int k = 0; k < 3; k++)
        n[k] = n[k] * scale;
    scale = vf_rsqrt((n[0] * n[0] + n[1] * n[1]) + n[2] * n[2]);
    vm away = vf_lt(vf_zero(), (n[0] * ray[0] + n[1] * ray[1]) - n[2]);
    scale = vf_select(away, vf_zero() - scale, scale);
    float out[3][PT_LANES], *normals = (float *)PT_DATA(job->call, normals, normal) + 4 * (size_t)y * view->width;
    for (int k = 0; k < 3; k++)
        vf_store(out[k], vf_select(found, n[k] * scale, vf_zero()));
    for (uint32_t lanes = vm_bits(c.ours); lanes; lanes &= lanes - 1) {
        const int i = __builtin_ctz(lanes);
        float *normal = normals + 4 * (size_t)(c.at[i] - PT_ROW_PAD);
        normal[0] = out[0][i], normal[1] = out[1][i], normal[2] = out[2][i], normal[3] = 0.0f;
    }
}

struct packed { // pixels of a row that wait for others
    uint32_t at[2 * PT_LANES], id[2 * PT_LANES], count;
};

static void normal_packed(const struct job *job, const struct depth_row *const *around, uint32_t y, struct packed *packed)
{
    const uint32_t count = packed->count < PT_LANES ? packed->count : PT_LANES;
    if (count)
        normal_pixels(job, around, y, vi_load(packed->at), vi_load(packed->id), vm_first(count), 1);
    packed->count -= count;
    vi_store(packed->at, vi_load(packed->at + PT_LANES));
    vi_store(packed->id, vi_load(packed->id + PT_LANES));
}

static void normals_row(const struct job *job, const struct depth_row *const *around, uint32_t y)
{
    const struct view_args *view = &job->args->view;
    const uint64_t *keys = (const uint64_t *)PT_DATA(job->call, normals, keys) + (size_t)y * view->width;
    struct packed packed = {.count = 0};
    for (uint32_t x = view->rect[0]; x < view->rect[2]; x += PT_LANES) {
        vi id, at = vi_add(vi_set(x + PT_ROW_PAD), vi_lanes());
        vm ours = pt_of_instance(keys + x, &job->args->instance, pt_lanes_left(x, view->rect[2]), &id);
        const uint32_t lanes = vm_bits(ours), count = (uint32_t)__builtin_popcount(lanes);
        if (2 * count > PT_LANES) {
            normal_pixels(job, around, y, at, id, ours, 0);
            continue;
        }
        vi_pack(packed.at + packed.count, at, lanes);
        vi_pack(packed.id + packed.count, id, lanes);
        packed.count += count;
        if (packed.count >= PT_LANES)
            normal_packed(job, around, y, &packed);
    }
    normal_packed(job, around, y, &packed);
}

static void normals_bands(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct job *job = context;
    const struct view_args *view = &job->args->view;
    const int32_t reach = (int32_t)job->args->radius, ring = 2 * reach + 1;
    struct depth_row rows[ROWS_MOST];
    for (int32_t k = 0; k < ring; k++) {
        float *row = job->memory + ((size_t)thread * (uint32_t)ring + (uint32_t)k) * 2 * job->stride + 2 * PT_ROW_PAD;
        rows[k] = (struct depth_row){row, row + job->stride};
    }
    for (uint32_t band = begin; band < end && !pt_cpu_cancelled(job->call); band++) {
        const int32_t first = (int32_t)(view->rect[1] + band * BAND_ROWS);
        const int32_t last = first + BAND_ROWS < (int32_t)view->rect[3] ? first + BAND_ROWS : (int32_t)view->rect[3];
        for (int32_t y = first - 2 * reach; y < last; y++) { // the last row seen is y + reach
            const struct depth_row *around[ROWS_MOST];
            see_row(view, PT_DATA(job->call, normals, keys), y + reach, &rows[(y + reach + ring) % ring]);
            for (int32_t k = -reach; k <= reach && y >= first; k++)
                around[reach + k] = &rows[(y + k + ring) % ring];
            if (y >= first)
                normals_row(job, around, (uint32_t)y);
        }
    }
}

int PT_KERNEL_ENTRY(normals)(const struct pt_cpu_call *call)
{
    const struct normals_args *args = call->arguments;
    const uint32_t *rect = args->view.rect, threads = pt_pool_threads(call->pool);
    struct job job = {.call = call, .args = args, .stride = pt_row_stride(args->view.width)};
    if (rect[0] >= rect[2] || rect[1] >= rect[3])
        return PATINA_OK;
    const size_t rows = (size_t)threads * (2 * args->radius + 1);
    job.memory = pt_cpu_scratch(call, 0, (2 * rows * job.stride + 2 * PT_ROW_PAD) * sizeof(float));
    if (!job.memory)
        return PATINA_ERROR_MEMORY;
    pt_parallel(call->pool, (rect[3] - rect[1] + BAND_ROWS - 1) / BAND_ROWS, 1, normals_bands, &job);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
