// SPDX-License-Identifier: GPL-3.0-or-later
// shade: id -> colour and normal, Phong. [D 3.1], deferred: only what the picture shows is lit; twin of
// shaders/kernels/shade.comp
#include "device_cpu/rows.h"
#include "device_cpu/srgb.h"

enum { BLEND_REACH = 8 }; // pixels, of blended normals

struct pixels { // PT_LANES of them
    size_t at;
    vi id, from;
    vf z, ray[2], n[4], albedo[3];
    vm ours;
};

// ---- 1. normals of filled pixels, refined ------------------------------------------------------------------------------

struct filled { // the filled pixels of a row, PT_LANES at a time
    uint32_t x[PT_LANES], from[PT_LANES], count;
};

// Measured neighbours of the same layer, as far as the pixel it was filled from, weighted by 1 / (1 + distance^2); the
// source's own normal where there are none.
static void blend_normals(const struct shade_args *args, const struct pt_cpu_call *call, const struct filled *filled,
                          uint32_t y)
{
    const struct view_args *view = &args->view;
    const uint64_t *keys = pt_cpu_data(call, 0);
    const uint32_t *from = pt_cpu_data(call, 1);
    const float *normals = pt_cpu_data(call, 2);
    uint32_t reach[PT_LANES] = { 0 }, most = 1;
    vm ours = vm_first(filled->count);
    for (uint32_t i = 0; i < filled->count; i++) {
        uint32_t dx = (uint32_t)abs((int32_t)(filled->from[i] % view->width) - (int32_t)filled->x[i]);
        uint32_t dy = (uint32_t)abs((int32_t)(filled->from[i] / view->width) - (int32_t)y);
        reach[i] = dx > dy ? dx : dy;
        reach[i] = reach[i] > BLEND_REACH ? BLEND_REACH : reach[i];
        most = reach[i] > most ? reach[i] : most;
    }
    vi x = vi_load(filled->x), source = vi_load(filled->from), radius = vi_load(reach);
    vi pixel = vi_add(x, vi_set(y * view->width));
    vf z = vi_float(vi_gather_z(keys, pixel, ours)), limit = vf_gather(pt_cpu_data(call, 3), source, ours);
    vf n[4] = { vf_zero(), vf_zero(), vf_zero(), vf_zero() };
    for (int32_t dy = -(int32_t)most; dy <= (int32_t)most; dy++)
        for (int32_t dx = -(int32_t)most; dx <= (int32_t)most; dx++) {
            uint32_t distance = (uint32_t)(abs(dx) > abs(dy) ? abs(dx) : abs(dy));
            vi qx = vi_add(x, vi_set((uint32_t)dx)), q = vi_add(pixel, vi_set((uint32_t)(dy * (int32_t)view->width + dx)));
            if (y + (uint32_t)dy >= view->height)
                continue;
            vm take = vm_and(vm_and(ours, vm_not(vi_lt_unsigned(radius, vi_set(distance)))),
                             vi_lt_unsigned(qx, vi_set(view->width)));
            vf zq = vi_float(vi_gather_z(keys, q, take));
            take = vm_and(take, vf_le(vf_abs(zq - z), limit));
            take = vm_and(take, vi_eq(vi_and(vi_gather(from, q, take), vi_set(~PT_FROM_MIXED)), q));
            if (!vm_bits(take))
                continue;
            vf weight = vf_set(pt_rcp((float)(1 + dx * dx + dy * dy)));
            vi word = vi_mul(q, vi_set(4));
            for (uint32_t k = 0; k < 3; k++)
                n[k] = n[k] + vf_gather(normals, vi_add(word, vi_set(k)), take) * weight;
        }
    vf square = (n[0] * n[0] + n[1] * n[1]) + n[2] * n[2];
    vm blended = vf_lt(vf_set(1e-12f), square);
    vf scale = vf_rsqrt(vf_select(blended, square, vf_set(1.0f)));
    vi word = vi_mul(source, vi_set(4));
    for (uint32_t k = 0; k < 3; k++)
        n[k] = vf_select(blended, n[k] * scale, vf_gather(normals, vi_add(word, vi_set(k)), ours));
    float out[4][PT_LANES], *shading = pt_cpu_data(call, 6);
    for (int k = 0; k < 4; k++)
        vf_store(out[k], n[k], vm_first(PT_LANES));
    for (uint32_t i = 0; i < filled->count; i++)
        for (int k = 0; k < 4; k++)
            shading[4 * ((size_t)y * view->width + filled->x[i]) + (size_t)k] = out[k][i];
}

static void blend_row(const struct shade_args *args, const struct pt_cpu_call *call, uint32_t y)
{
    const struct view_args *view = &args->view;
    const struct instance_args *instance = &args->instance;
    const uint64_t *keys = (const uint64_t *)pt_cpu_data(call, 0) + (size_t)y * view->width;
    const uint32_t *from = (const uint32_t *)pt_cpu_data(call, 1) + (size_t)y * view->width;
    struct filled filled = { .count = 0 };
    for (uint32_t x = view->rect[0]; x < view->rect[2]; x += PT_LANES) {
        vi z = vi_load_z(keys + x), id = vi_sub(vi_load_id(keys + x), vi_set(instance->id_base));
        vi self = vi_add(vi_set(y * view->width + x), vi_lanes());
        vm ours = vm_and(vm_and(vm_first(pt_lanes_left(x, view->rect[2])), vm_not(vi_eq(z, vi_set(PT_KEY_EMPTY_Z)))),
                         vi_lt_unsigned(id, vi_set(instance->id_count)));
        uint32_t bits = vm_bits(vm_and(ours, vm_not(vi_eq(vi_and(vi_load(from + x), vi_set(~PT_FROM_MIXED)), self))));
        for (; bits; bits &= bits - 1) {
            uint32_t i = x + (uint32_t)__builtin_ctz(bits);
            filled.x[filled.count] = i;
            filled.from[filled.count++] = from[i] & ~PT_FROM_MIXED;
            if (filled.count < PT_LANES)
                continue;
            blend_normals(args, call, &filled, y);
            filled.count = 0;
        }
    }
    for (uint32_t i = filled.count; i < PT_LANES; i++)
        filled.x[i] = filled.from[i] = 0;
    if (filled.count)
        blend_normals(args, call, &filled, y);
}

// ---- 2. colour and normal ----------------------------------------------------------------------------------------------

static void gather_albedo(const struct shade_args *args, const void *colors, struct pixels *p)
{
    const struct instance_args *instance = &args->instance;
    for (int k = 0; k < 3; k++)
        p->albedo[k] = vf_set(instance->color[k]);
    if (instance->color_format == 1 && instance->id_count < 1u << 29) { // byte offsets fit a signed index
        vi rgb = vi_gather_bytes(colors, vi_mul(p->id, vi_set(3)), p->ours);
        for (int k = 0; k < 3; k++)
            p->albedo[k] = vf_gather(pt_srgb_table, vi_and(vi_shr(rgb, 8 * k), vi_set(255)), p->ours);
        return;
    }
    if (!instance->color_format)
        return;
    float rgb[3][PT_LANES];
    uint32_t ids[PT_LANES], lanes = vm_bits(p->ours);
    memset(rgb, 0, sizeof rgb);
    vi_store(ids, p->id, vm_first(PT_LANES));
    for (; lanes; lanes &= lanes - 1)
        for (int k = 0, i = __builtin_ctz(lanes); k < 3; k++) {
            size_t at = 3 * (size_t)ids[i] + (size_t)k;
            rgb[k][i] = instance->color_format == 1 ? pt_srgb_table[((const uint8_t *)colors)[at]]
                                                    : ((const float *)colors)[at];
        }
    for (int k = 0; k < 3; k++)
        p->albedo[k] = vf_load(rgb[k]);
}

static void gather_normals(const struct shade_args *args, const struct pt_cpu_call *call, struct pixels *p)
{
    const float *normals = pt_cpu_data(call, 2);
    vf_load4(normals + 4 * p->at, p->n);
    vm measured = vi_eq(p->from, vi_add(vi_set((uint32_t)p->at), vi_lanes()));
    if (!vm_bits(vm_and(p->ours, vm_not(measured))))
        return;
    vf other[4];
    if (args->refined) { // blended before
        vf_load4((const float *)pt_cpu_data(call, 6) + 4 * p->at, other);
    } else {
        vi word = vi_mul(p->from, vi_set(4));
        for (uint32_t k = 0; k < 3; k++)
            other[k] = vf_gather(normals, vi_add(word, vi_set(k)), p->ours);
    }
    for (int k = 0; k < 3; k++)
        p->n[k] = vf_select(measured, p->n[k], other[k]);
}

// ---- 3. light ----------------------------------------------------------------------------------------------------------

static vf dot(const vf a[3], const vf b[3]) { return (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]; }

static vf power(vf x, uint32_t exponent)
{
    vf result = vf_set(1.0f);
    for (; exponent; exponent >>= 1) {
        if (exponent & 1u)
            result = result * x;
        x = x * x;
    }
    return result;
}

struct surface_point {
    vf n[3], position[3], to_eye[3];
};

static void add_light(const struct instance_args *instance, const struct light_args *light, const struct surface_point *s,
                      vf diffuse[3], vf specular[3])
{
    const vf zero = vf_zero();
    vf l[3], falloff = vf_set(0.31830988618f); // 1 / pi: radiance of a white Lambert surface under unit irradiance
    for (int k = 0; k < 3; k++)
        l[k] = vf_set(light->vector[k]);
    if (light->type == 2) { // PATINA_LIGHT_POINT
        for (int k = 0; k < 3; k++)
            l[k] = l[k] - s->position[k];
        vf scale = vf_rsqrt(vf_max(dot(l, l), vf_set(1e-20f)));
        for (int k = 0; k < 3; k++)
            l[k] = l[k] * scale;
        falloff = falloff * (scale * scale);
    }
    vf cosine = dot(s->n, l);
    vf lambert = vf_max(cosine, zero) * falloff;
    for (int k = 0; k < 3; k++)
        diffuse[k] = diffuse[k] + vf_set(light->color[k]) * lambert;
    if (!(instance->specular > 0.0f))
        return;
    vf r[3];
    for (int k = 0; k < 3; k++)
        r[k] = (vf_set(2.0f) * cosine) * s->n[k] - l[k];
    vf shine = power(vf_min(vf_max(dot(r, s->to_eye), zero), vf_set(1.0f)), instance->shininess) * falloff;
    shine = vf_select(vf_lt(zero, cosine), shine, zero);
    for (int k = 0; k < 3; k++)
        specular[k] = specular[k] + vf_set(light->color[k]) * shine;
}

static void place(const struct shade_args *args, const struct pixels *p, struct surface_point *s)
{
    const vf zero = vf_zero();
    s->to_eye[0] = s->to_eye[1] = zero;
    s->to_eye[2] = vf_set(1.0f);
    s->position[0] = p->ray[0];
    s->position[1] = p->ray[1];
    s->position[2] = zero - (p->z + vf_set(args->eye_z));
    if (args->view.perspective) {
        vf r = vf_rsqrt((p->ray[0] * p->ray[0] + p->ray[1] * p->ray[1]) + vf_set(1.0f));
        s->position[0] = p->z * p->ray[0];
        s->position[1] = p->z * p->ray[1];
        s->position[2] = zero - p->z;
        s->to_eye[0] = zero - p->ray[0] * r;
        s->to_eye[1] = zero - p->ray[1] * r;
        s->to_eye[2] = r;
    }
    vm away = vf_lt(dot(p->n, s->to_eye), zero); // both sides are lit
    for (int k = 0; k < 3; k++)
        s->n[k] = vf_select(away, zero - p->n[k], p->n[k]);
}

// c = albedo (k_a world + k_d sum E max(n.l, 0) / pi) + albedo k_s sum E max(r.v, 0)^shininess / pi
static void phong(const struct shade_args *args, const struct pixels *p, vf color[3])
{
    const struct instance_args *instance = &args->instance;
    struct surface_point point;
    vf diffuse[3], specular[3];
    place(args, p, &point);
    for (int k = 0; k < 3; k++)
        diffuse[k] = specular[k] = vf_zero();
    for (uint32_t i = 0; i < args->light_count; i++)
        add_light(instance, &args->lights[i], &point, diffuse, specular);
    for (int k = 0; k < 3; k++) {
        vf light = vf_set(instance->ambient * args->world[k]) + vf_set(instance->diffuse) * diffuse[k];
        color[k] = p->albedo[k] * (light + vf_set(instance->specular) * specular[k]);
    }
}

// ---- the kernel --------------------------------------------------------------------------------------------------------

static void shade_pixels(const struct shade_args *args, const struct pt_cpu_call *call, uint32_t x, uint32_t y,
                         uint32_t lanes)
{
    const struct instance_args *instance = &args->instance;
    const uint64_t *keys = pt_cpu_data(call, 0);
    struct pixels p = { .at = (size_t)y * args->view.width + x };
    vi z_bits = vi_load_z(keys + p.at);
    p.id = vi_sub(vi_load_id(keys + p.at), vi_set(instance->id_base));
    p.ours = vm_and(vm_first(lanes), vm_and(vi_lt_unsigned(p.id, vi_set(instance->id_count)),
                                            vm_not(vi_eq(z_bits, vi_set(PT_KEY_EMPTY_Z)))));
    if (!vm_bits(p.ours))
        return;
    p.z = vi_float(z_bits);
    p.from = vi_and(vi_load((const uint32_t *)pt_cpu_data(call, 1) + p.at), vi_set(~PT_FROM_MIXED));
    vf_ray(&args->view, x, y, p.ray);
    gather_albedo(args, pt_cpu_data(call, 5), &p);
    gather_normals(args, call, &p);
    p.n[3] = vf_zero();
    vf_store4((float *)pt_cpu_data(call, 6) + 4 * p.at, p.n, vm_bits(p.ours));
    vf color[4] = { p.albedo[0], p.albedo[1], p.albedo[2], vf_set(1.0f) };
    if (instance->lit)
        phong(args, &p, color);
    vf_store4((float *)pt_cpu_data(call, 7) + 4 * p.at, color, vm_bits(p.ours));
}

static void shade_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct shade_args *args = call->arguments;
    if (args->refined)
        blend_row(args, call, y);
    for (uint32_t x = args->view.rect[0]; x < args->view.rect[2]; x += PT_LANES)
        shade_pixels(args, call, x, y, pt_lanes_left(x, args->view.rect[2]));
}

int PT_KERNEL_ENTRY(shade)(const struct pt_cpu_call *call)
{
    const struct shade_args *args = call->arguments;
    return pt_rows(call, &args->view, shade_row);
}
