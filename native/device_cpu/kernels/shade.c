// SPDX-License-Identifier: GPL-3.0-or-later
// shade: id -> colour and normal, Phong. [D 3.1], deferred: only what the picture shows is lit; twin of
// shaders/kernels/shade.comp
#include "device_cpu/rows.h"
#include "device_cpu/srgb.h"

struct pixels { // PT_LANES of them
    uint32_t x, y, lanes; // lanes: bits of those that are ours
    size_t at;
    vi id, from;
    vf z, ray[2], n[3], albedo[3];
    vm ours;
};

static void gather_albedo(const struct shade_args *args, const void *colors, struct pixels *p)
{
    const struct instance_args *instance = &args->instance;
    float rgb[3][PT_LANES];
    uint32_t ids[PT_LANES];
    if (instance->color_format == 0) {
        for (int k = 0; k < 3; k++)
            p->albedo[k] = vf_set(instance->color[k]);
        return;
    }
    vi_store(ids, p->id, vm_first(PT_LANES));
    for (int i = 0; i < PT_LANES; i++)
        for (int k = 0; k < 3; k++) {
            rgb[k][i] = 0.0f;
            if (!(p->lanes >> i & 1u))
                continue;
            size_t at = 3 * (size_t)ids[i] + (size_t)k;
            rgb[k][i] = instance->color_format == 1 ? pt_srgb_table[((const uint8_t *)colors)[at]]
                                                    : ((const float *)colors)[at];
        }
    for (int k = 0; k < 3; k++)
        p->albedo[k] = vf_load(rgb[k]);
}

// The normal of a filled pixel, refined: measured neighbours of its layer, weighted by 1 / (1 + distance^2), as far as
// the pixel it was filled from. Zero when there is none.
static void blend_normal(const struct view_args *view, const struct pt_cpu_call *call, uint32_t x, uint32_t y,
                         uint32_t source, float n[3])
{
    const uint64_t *keys = pt_cpu_data(call, 0);
    const uint32_t *from = pt_cpu_data(call, 1);
    const float *normals = pt_cpu_data(call, 2), *deff = pt_cpu_data(call, 3);
    int32_t width = (int32_t)view->width, height = (int32_t)view->height;
    int32_t sx = abs((int32_t)(source % view->width) - (int32_t)x), sy = abs((int32_t)(source / view->width) - (int32_t)y);
    int32_t r = (sx > sy ? sx : sy) + 1;
    r = r > 8 ? 8 : r;
    float z = pt_float((uint32_t)(keys[(size_t)y * view->width + x] >> 32)), limit = deff[source];
    n[0] = n[1] = n[2] = 0.0f;
    for (int32_t dy = -r; dy <= r; dy++)
        for (int32_t dx = -r; dx <= r; dx++) {
            int32_t qx = (int32_t)x + dx, qy = (int32_t)y + dy;
            if (qx < 0 || qy < 0 || qx >= width || qy >= height)
                continue;
            uint32_t q = (uint32_t)qy * view->width + (uint32_t)qx;
            float zq = pt_float((uint32_t)(keys[q] >> 32));
            if (!(pt_abs(zq - z) <= limit) || (from[q] & ~PT_FROM_MIXED) != q)
                continue;
            float weight = pt_rcp((float)(1 + dx * dx + dy * dy));
            for (int k = 0; k < 3; k++)
                n[k] = n[k] + normals[4 * (size_t)q + (size_t)k] * weight;
        }
}

static void gather_normals(const struct shade_args *args, const struct pt_cpu_call *call, struct pixels *p)
{
    const struct view_args *view = &args->view;
    const float *normals = pt_cpu_data(call, 2);
    float column[3][PT_LANES];
    uint32_t from[PT_LANES];
    vi_store(from, p->from, vm_first(PT_LANES));
    for (uint32_t i = 0; i < PT_LANES; i++) {
        float n[3] = { 0.0f, 0.0f, 0.0f };
        if (p->lanes >> i & 1u) {
            const float *source = normals + 4 * (size_t)from[i];
            n[0] = source[0], n[1] = source[1], n[2] = source[2];
            if (args->refined && from[i] != p->at + i) {
                float blend[3];
                blend_normal(view, call, p->x + i, p->y, from[i], blend);
                float square = (blend[0] * blend[0] + blend[1] * blend[1]) + blend[2] * blend[2];
                if (square > 1e-12f) {
                    float scale = pt_rsqrt(square);
                    n[0] = blend[0] * scale, n[1] = blend[1] * scale, n[2] = blend[2] * scale;
                }
            }
        }
        for (int k = 0; k < 3; k++)
            column[k][i] = n[k];
    }
    for (int k = 0; k < 3; k++)
        p->n[k] = vf_load(column[k]);
}

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

static void add_light(const struct shade_args *args, const struct light_args *light, const struct pixels *p,
                      const vf n[3], const vf point[3], const vf to_eye[3], vf diffuse[3], vf specular[3])
{
    const vf zero = vf_zero();
    vf l[3], falloff = vf_set(0.31830988618f); // 1 / pi: radiance of a white Lambert surface under unit irradiance
    (void)p;
    for (int k = 0; k < 3; k++)
        l[k] = vf_set(light->vector[k]);
    if (light->type == 2) { // PATINA_LIGHT_POINT
        for (int k = 0; k < 3; k++)
            l[k] = l[k] - point[k];
        vf square = vf_max(dot(l, l), vf_set(1e-20f)), scale = vf_rsqrt(square);
        for (int k = 0; k < 3; k++)
            l[k] = l[k] * scale;
        falloff = falloff * (scale * scale);
    }
    vf cosine = dot(n, l);
    vf lambert = vf_max(cosine, zero) * falloff;
    for (int k = 0; k < 3; k++)
        diffuse[k] = diffuse[k] + vf_set(light->color[k]) * lambert;
    if (!(args->instance.specular > 0.0f))
        return;
    vf r[3];
    for (int k = 0; k < 3; k++)
        r[k] = (vf_set(2.0f) * cosine) * n[k] - l[k];
    vf shine = power(vf_min(vf_max(dot(r, to_eye), zero), vf_set(1.0f)), args->instance.shininess) * falloff;
    shine = vf_select(vf_lt(zero, cosine), shine, zero);
    for (int k = 0; k < 3; k++)
        specular[k] = specular[k] + vf_set(light->color[k]) * shine;
}

// c = albedo (k_a world + k_d sum E max(n.l, 0) / pi) + albedo k_s sum E max(r.v, 0)^shininess / pi
static void phong(const struct shade_args *args, const struct pixels *p, vf color[3])
{
    const struct view_args *view = &args->view;
    const struct instance_args *instance = &args->instance;
    vf n[3], point[3], to_eye[3] = { vf_zero(), vf_zero(), vf_set(1.0f) };
    point[0] = p->ray[0], point[1] = p->ray[1], point[2] = vf_zero() - (p->z + vf_set(args->eye_z));
    if (view->perspective) {
        vf r = vf_rsqrt((p->ray[0] * p->ray[0] + p->ray[1] * p->ray[1]) + vf_set(1.0f));
        point[0] = p->z * p->ray[0], point[1] = p->z * p->ray[1], point[2] = vf_zero() - p->z;
        to_eye[0] = vf_zero() - p->ray[0] * r, to_eye[1] = vf_zero() - p->ray[1] * r, to_eye[2] = r;
    }
    vm away = vf_lt(dot(p->n, to_eye), vf_zero()); // both sides are lit
    for (int k = 0; k < 3; k++)
        n[k] = vf_select(away, vf_zero() - p->n[k], p->n[k]);
    vf diffuse[3], specular[3];
    for (int k = 0; k < 3; k++)
        diffuse[k] = specular[k] = vf_zero();
    for (uint32_t i = 0; i < args->light_count; i++)
        add_light(args, &args->lights[i], p, n, point, to_eye, diffuse, specular);
    for (int k = 0; k < 3; k++) {
        vf light = vf_set(instance->ambient * args->world[k]) + vf_set(instance->diffuse) * diffuse[k];
        color[k] = p->albedo[k] * (light + vf_set(instance->specular) * specular[k]);
    }
}

static void shade_pixels(const struct shade_args *args, const struct pt_cpu_call *call, uint32_t x, uint32_t y,
                         uint32_t lanes)
{
    const struct instance_args *instance = &args->instance;
    const uint64_t *keys = pt_cpu_data(call, 0);
    float *shading = pt_cpu_data(call, 6), *colors = pt_cpu_data(call, 7);
    struct pixels p = { .x = x, .y = y, .at = (size_t)y * args->view.width + x };
    // 1. the point
    vi z_bits = vi_load_z(keys + p.at);
    p.id = vi_sub(vi_load_id(keys + p.at), vi_set(instance->id_base));
    p.ours = vm_and(vm_first(lanes), vm_and(vi_lt_unsigned(p.id, vi_set(instance->id_count)),
                                            vm_not(vi_eq(z_bits, vi_set(PT_KEY_EMPTY_Z)))));
    p.lanes = vm_bits(p.ours);
    if (!p.lanes)
        return;
    p.z = vi_float(z_bits);
    p.from = vi_and(vi_load((const uint32_t *)pt_cpu_data(call, 1) + p.at), vi_set(~PT_FROM_MIXED));
    vf_ray(&args->view, x, y, p.ray);
    // 2. its colour and normal
    gather_albedo(args, pt_cpu_data(call, 5), &p);
    gather_normals(args, call, &p);
    vf_store4(shading + 4 * p.at, p.n[0], p.n[1], p.n[2], vf_zero(), p.lanes);
    // 3. light
    vf color[3] = { p.albedo[0], p.albedo[1], p.albedo[2] };
    if (instance->lit)
        phong(args, &p, color);
    vf_store4(colors + 4 * p.at, color[0], color[1], color[2], vf_set(1.0f), p.lanes);
}

static void shade_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct shade_args *args = call->arguments;
    for (uint32_t x = args->view.rect[0]; x < args->view.rect[2]; x += PT_LANES)
        shade_pixels(args, call, x, y, pt_lanes_left(x, args->view.rect[2]));
}

int PT_KERNEL_ENTRY(shade)(const struct pt_cpu_call *call)
{
    const struct shade_args *args = call->arguments;
    return pt_rows(call, &args->view, shade_row);
}
