// SPDX-License-Identifier: GPL-3.0-or-later
// normals: image-space normals of points that have none; twin of shaders/kernels/normals.comp
//
// A plane is linear in the picture as 1/z (perspective) or z (orthographic). Least squares over the window's pixels that
// can belong to the same surface give w = w_p + a dx + b dy + c, hence the plane n . (u, v, -1) = w, hence n.
// The pixels of a row that are asked for are gathered, so that sparse clouds fill the lanes too.
#include "device_cpu/rows.h"

struct center { // PT_LANES pixels
    vi x, y, pixel;
    vf z, w;
    vf distance, slope, step[2]; // what belongs to the same surface: kernel_args.h
    vf reach;                    // radius of the window
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

// Depths 1 and 2 pixels on along (dx, dy), those before the pixel with -dx, -dy; and which of them show something.
static vf depth_at(const struct view_args *view, const uint64_t *keys, const struct center *c, int32_t dx, int32_t dy, vm *known)
{
    vi x = vi_add(c->x, vi_set((uint32_t)dx)), y = vi_add(c->y, vi_set((uint32_t)dy));
    vm inside = vm_and(c->ours, vm_and(vi_lt_unsigned(x, vi_set(view->width)), vi_lt_unsigned(y, vi_set(view->height))));
    vf z = vi_float(vi_gather_z(keys, vi_add(c->pixel, vi_set((uint32_t)(dy * (int32_t)view->width + dx))), inside));
    *known = vm_and(inside, vf_lt(z, vf_set(pt_float(PT_KEY_EMPTY_Z))));
    return z;
}

// What z changes by from pixel to pixel along (dx, dy), as far as both sides agree.
static vf step_along(const struct view_args *view, const uint64_t *keys, const struct center *c, int32_t dx, int32_t dy)
{
    vm known_before, known_after;
    vf before = depth_at(view, keys, c, -dx, -dy, &known_before), after = depth_at(view, keys, c, dx, dy, &known_after);
    vf a = c->z - before, b = after - c->z;
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

// Radius of the pixels' windows: kernel_args.h.
static vf reach_of(const struct normals_args *args, vf distance, vf z)
{
    const vf zero = vf_zero();
    vf wanted = zero - vf_floor(zero - distance * vf_rcp(vf_footprint(&args->view, z)));
    return vf_min(vf_max(wanted, vf_set(PT_ESTIMATE_LEAST)), vf_set((float)args->radius));
}

// 1. Sums over the window. Pixel counts and offsets are small integers: exact in float32.
static struct sums gather(const struct normals_args *args, const uint64_t *keys, const struct center *c)
{
    const struct view_args *view = &args->view;
    int32_t r = (int32_t)args->radius;
    while (r && !vm_bits(vm_and(c->ours, vf_le(vf_set((float)r), c->reach))))
        r--;
    const vf zero = vf_zero(), one = vf_set(1.0f);
    struct sums s = { zero, zero, zero, zero, zero, zero, zero, zero, zero };
    for (int32_t dy = -r; dy <= r; dy++)
        for (int32_t dx = -r; dx <= r; dx++) {
            vi qx = vi_add(c->x, vi_set((uint32_t)dx)), qy = vi_add(c->y, vi_set((uint32_t)dy));
            const vf far = vf_set((float)larger(dx, dy));
            vm inside = vm_and(vm_and(c->ours, vf_le(far, c->reach)),
                               vm_and(vi_lt_unsigned(qx, vi_set(view->width)), vi_lt_unsigned(qy, vi_set(view->height))));
            vi q = vi_add(c->pixel, vi_set((uint32_t)(dy * (int32_t)view->width + dx)));
            vf zq = vi_float(vi_gather_z(keys, q, inside));
            const vf along = c->step[0] * vf_set((float)dx), up = c->step[1] * vf_set((float)dy);
            vf tolerance = vf_max(c->distance, c->slope * far);
            tolerance = vf_max(tolerance, vf_set(PT_STEEP) * (vf_abs(along) + vf_abs(up)));
            vm same = vm_and(inside, vf_le(vf_abs((zq - c->z) - (along + up)), tolerance));
            if (!vm_bits(same))
                continue; // other surfaces, or nothing
            const vf fx = vf_set((float)dx), fy = vf_set((float)dy);
            vf dw = vf_select(same, linear_depth(view, zq) - c->w, zero), some = vf_select(same, one, zero);
            s.n = s.n + some;
            s.x = s.x + some * fx;
            s.y = s.y + some * fy;
            s.xx = s.xx + some * (fx * fx);
            s.xy = s.xy + some * (fx * fy);
            s.yy = s.yy + some * (fy * fy);
            s.w = s.w + dw;
            s.xw = s.xw + fx * dw;
            s.yw = s.yw + fy * dw;
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

static void normal_pixels(const struct normals_args *args, const struct pt_cpu_call *call, const uint32_t *x, uint32_t y,
                          uint32_t lanes)
{
    const struct view_args *view = &args->view;
    const struct instance_args *instance = &args->instance;
    const uint64_t *keys = pt_cpu_data(call, 0);
    float *normals = pt_cpu_data(call, 2);
    uint32_t ids[PT_LANES], pixels[PT_LANES];
    struct center center = { .x = vi_load(x), .y = vi_set(y), .ours = vm_first(lanes) };
    for (uint32_t i = 0; i < PT_LANES; i++) {
        pixels[i] = i < lanes ? y * view->width + x[i] : 0;
        ids[i] = i < lanes ? (uint32_t)keys[pixels[i]] - instance->id_base : 0;
    }
    center.pixel = vi_load(pixels);
    center.z = vi_float(vi_gather_z(keys, center.pixel, center.ours));
    center.z = vf_select(center.ours, center.z, vf_set(1.0f));
    center.w = linear_depth(view, center.z);
    vi word = vi_gather(pt_cpu_data(call, 1), vi_load(ids), center.ours);
    vf spacing = vf_look_up(instance->spacing, PT_SPACINGS, vi_shr(word, PT_SPACING_SHIFT));
    center.distance = vf_layer_distance(view, instance->d_min, spacing, center.z, vf_set(1.0f));
    center.reach = reach_of(args, center.distance, center.z);
    center.slope = vf_set(4.0f) * vf_footprint(view, center.z); // 76 degrees
    for (int k = 0; k < 2; k++)
        center.step[k] = args->steep ? step_along(view, keys, &center, 1 - k, k) : vf_zero();

    struct sums sums = gather(args, keys, &center);
    vf a, b, c, n[3], ray[2] = { vf_zero(), vf_zero() };
    vm found = vm_and(center.ours, solve(&center, &sums, &a, &b, &c));
    // 3. the plane's normal from dw/dx = a, dw/dy = b a pixel
    n[0] = a * vf_set(view->ray_ys);
    n[1] = b * vf_set(view->ray_xs);
    n[2] = vf_set(view->ray_xs * view->ray_ys);
    if (view->perspective) {
        vf_ray_of(view, center.x, center.y, ray);
        n[2] = (n[0] * ray[0] + n[1] * ray[1]) - c * n[2];
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
    float out[3][PT_LANES];
    for (int k = 0; k < 3; k++)
        vf_store(out[k], vf_select(found, n[k] * scale, vf_zero()));
    for (uint32_t i = 0; i < lanes; i++) {
        float *normal = normals + 4 * (size_t)pixels[i];
        normal[0] = out[0][i], normal[1] = out[1][i], normal[2] = out[2][i], normal[3] = 0.0f;
    }
}

static void normals_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct normals_args *args = call->arguments;
    const uint64_t *row = (const uint64_t *)pt_cpu_data(call, 0) + (size_t)y * args->view.width;
    uint32_t x[PT_LANES] = { 0 }, lanes = 0;
    for (uint32_t i = args->view.rect[0]; i < args->view.rect[2]; i++) {
        uint32_t id = (uint32_t)row[i] - args->instance.id_base;
        if ((uint32_t)(row[i] >> 32) == PT_KEY_EMPTY_Z || id >= args->instance.id_count)
            continue;
        x[lanes++] = i;
        if (lanes == PT_LANES) {
            normal_pixels(args, call, x, y, lanes);
            lanes = 0;
        }
    }
    if (lanes)
        normal_pixels(args, call, x, y, lanes);
}

int PT_KERNEL_ENTRY(normals)(const struct pt_cpu_call *call)
{
    const struct normals_args *args = call->arguments;
    return pt_rows(call, &args->view, normals_row);
}
