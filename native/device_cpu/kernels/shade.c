// SPDX-License-Identifier: GPL-3.0-or-later
// shade: id -> colour and normal, Phong. [D 3.1], deferred: only what the picture shows is lit; twin of
// shaders/kernels/shade.comp
#include "device_cpu/rows.h"
#include "device_cpu/srgb.h"

struct pixels { // PT_LANES of them
    size_t at;
    vi id;
    vf z, ray[2], n[4], albedo[3];
    vm ours;
};

// ---- 1. normals of filled pixels, refined ------------------------------------------------------------------------------
//
// A ring of rows holds z and the shown surface's normal as separate vectors, so that every tap is a plain load.

enum { REACH = 8, BAND_ROWS = 32 }; // the ring's channels: z, normal

struct shade {
    const struct pt_cpu_call *call;
    const struct shade_args *args;
    float *rows;   // per thread: a ring of `ring` rows
    size_t stride; // floats of one channel of a row
    uint32_t ring; // 2 blend + 1
    float weights[2 * REACH * REACH + 1]; // by squared distance
};

static vi load_from(const struct shade *shade, size_t at)
{
    return vi_and(vi_load((const uint32_t *)pt_cpu_data(shade->call, 1) + at), vi_set(~PT_FROM_MIXED));
}

// Normals of the surfaces that PT_LANES pixels from `at` on show, those of filled pixels times `share`.
static void shown_normals(const struct shade *shade, size_t at, vm some, float share, vf n[4])
{
    const float *normals = pt_cpu_data(shade->call, 2);
    vi source = load_from(shade, at);
    vm filled = vm_and(some, vm_not(vi_eq(source, vi_add(vi_set((uint32_t)at), vi_lanes()))));
    vf_load4(normals + 4 * at, n);
    if (!vm_bits(filled))
        return;
    vi word = vi_mul(source, vi_set(4));
    for (uint32_t k = 0; k < 3; k++)
        n[k] = vf_select(filled, vf_gather(normals, vi_add(word, vi_set(k)), filled) * vf_set(share), n[k]);
}

// The rectangle's columns and `blend` more on both sides; what lies beyond the plane is empty.
static void load_row(const struct shade *shade, float *rows, int32_t y)
{
    const struct view_args *view = &shade->args->view;
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z));
    uint32_t reach = shade->args->blend, slot = (uint32_t)(y + REACH) % shade->ring;
    uint32_t first = view->rect[0] > reach ? view->rect[0] - reach : 0;
    uint32_t last = view->rect[2] + reach < view->width ? view->rect[2] + reach : view->width;
    int32_t shift = (int32_t)view->rect[0];
    float *out[PT_RING_CHANNELS];
    for (uint32_t k = 0; k < PT_RING_CHANNELS; k++)
        out[k] = pt_ring_channel(rows, shade->stride, slot, k) - shift; // indexed by x
    for (int32_t x = shift - PT_RING_PAD; x < (int32_t)view->rect[2] + PT_RING_PAD; x += PT_LANES)
        vf_store(out[0] + x, empty, vm_first(PT_LANES));
    if (y < 0 || y >= (int32_t)view->height)
        return;
    const uint64_t *keys = (const uint64_t *)pt_cpu_data(shade->call, 0) + (size_t)y * view->width;
    for (uint32_t x = first; x < last; x += PT_LANES) {
        vm lanes = vm_first(pt_lanes_left(x, last));
        vf z = vi_float(vi_load_z(keys + x)), n[4];
        vm some = vm_and(lanes, vf_lt(z, empty));
        if (!vm_bits(some))
            continue;
        shown_normals(shade, (size_t)y * view->width + x, some, PT_BLEND_FILLED, n);
        vf_store(out[0] + x, z, lanes);
        for (uint32_t k = 0; k < 3; k++)
            vf_store(out[1 + k] + x, n[k], lanes);
    }
}

// Blended normals of those of PT_LANES pixels that `filled` names, into the shading plane.
static void blend_pixels(const struct shade *shade, float *const *around, uint32_t x, uint32_t y, vm filled)
{
    const struct view_args *view = &shade->args->view;
    const int reach = (int)shade->args->blend;
    size_t at = (size_t)y * view->width + x, column = x - view->rect[0];
    const float *own = around[reach] + column;
    vf z = vf_load(own), limit = vf_gather(pt_cpu_data(shade->call, 3), load_from(shade, at), filled);
    vf n[4] = { vf_zero(), vf_zero(), vf_zero(), vf_zero() };
    for (int dy = -reach; dy <= reach; dy++)
        for (int dx = -reach; dx <= reach; dx++) {
            const float *tap = around[reach + dy] + column + dx;
            vm take = vm_and(filled, vf_le(vf_abs(vf_load(tap) - z), limit));
            vf weight = vf_set(shade->weights[dx * dx + dy * dy]);
            for (size_t k = 0; k < 3; k++)
                n[k] = n[k] + vf_select(take, vf_load(tap + (1 + k) * shade->stride), vf_zero()) * weight;
        }
    vf square = (n[0] * n[0] + n[1] * n[1]) + n[2] * n[2];
    vm blended = vf_lt(vf_set(1e-12f), square);
    vf scale = vf_rsqrt(vf_select(blended, square, vf_set(1.0f)));
    for (size_t k = 0; k < 3; k++)
        n[k] = vf_select(blended, n[k] * scale, vf_load(own + (1 + k) * shade->stride) * vf_set(1.0f / PT_BLEND_FILLED));
    vf_store4((float *)pt_cpu_data(shade->call, 5) + 4 * at, n, vm_bits(filled));
}

static void blend_row(const struct shade *shade, float *const *around, uint32_t y)
{
    const struct view_args *view = &shade->args->view;
    const struct instance_args *instance = &shade->args->instance;
    const uint64_t *keys = (const uint64_t *)pt_cpu_data(shade->call, 0) + (size_t)y * view->width;
    for (uint32_t x = view->rect[0]; x < view->rect[2]; x += PT_LANES) {
        vi id;
        vm ours = pt_of_instance(keys + x, instance, pt_lanes_left(x, view->rect[2]), &id);
        if (!vm_bits(ours))
            continue;
        size_t at = (size_t)y * view->width + x;
        vm filled = vm_and(ours, vm_not(vi_eq(load_from(shade, at), vi_add(vi_set((uint32_t)at), vi_lanes()))));
        if (vm_bits(filled))
            blend_pixels(shade, around, x, y, filled);
    }
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

static void gather_normals(const struct shade *shade, struct pixels *p)
{
    if (!shade->args->blend) {
        shown_normals(shade, p->at, p->ours, 1.0f, p->n);
        return;
    }
    vf blended[4];
    vf_load4((const float *)pt_cpu_data(shade->call, 2) + 4 * p->at, p->n);
    vm filled = vm_not(vi_eq(load_from(shade, p->at), vi_add(vi_set((uint32_t)p->at), vi_lanes())));
    if (!vm_bits(vm_and(p->ours, filled)))
        return;
    vf_load4((const float *)pt_cpu_data(shade->call, 5) + 4 * p->at, blended);
    for (int k = 0; k < 3; k++)
        p->n[k] = vf_select(filled, blended[k], p->n[k]);
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

static void shade_pixels(const struct shade *shade, uint32_t x, uint32_t y, uint32_t lanes)
{
    const struct shade_args *args = shade->args;
    const struct instance_args *instance = &args->instance;
    const uint64_t *keys = pt_cpu_data(shade->call, 0);
    struct pixels p = { .at = (size_t)y * args->view.width + x };
    p.ours = pt_of_instance(keys + p.at, instance, lanes, &p.id);
    if (!vm_bits(p.ours))
        return;
    p.z = vi_float(vi_load_z(keys + p.at));
    vf_ray(&args->view, x, y, p.ray);
    gather_albedo(args, pt_cpu_data(shade->call, 4), &p);
    gather_normals(shade, &p);
    p.n[3] = vf_zero();
    vf_store4((float *)pt_cpu_data(shade->call, 5) + 4 * p.at, p.n, vm_bits(p.ours));
    vf color[4] = { p.albedo[0], p.albedo[1], p.albedo[2], vf_set(1.0f) };
    if (instance->lit)
        phong(args, &p, color);
    vf_store4((float *)pt_cpu_data(shade->call, 6) + 4 * p.at, color, vm_bits(p.ours));
}

static void shade_row(const struct shade *shade, float *rows, uint32_t y)
{
    static const uint32_t color_bytes[] = { 0, 3, 12 };
    const struct shade_args *args = shade->args;
    const uint32_t *rect = args->view.rect, reach = args->blend;
    const uint64_t *keys = (const uint64_t *)pt_cpu_data(shade->call, 0) + (size_t)y * args->view.width;
    if (reach) {
        float *around[2 * REACH + 1];
        for (uint32_t k = 0; k < shade->ring; k++)
            around[k] = pt_ring_channel(rows, shade->stride, (y + k + REACH - reach) % shade->ring, 0);
        load_row(shade, rows, (int32_t)(y + reach));
        blend_row(shade, around, y);
    }
    for (uint32_t x = rect[0]; x < rect[2]; x += PT_LANES) {
        if (args->instance.color_format)
            pt_fetch_ahead(keys, x + 4 * PT_LANES, rect[2], &args->instance, pt_cpu_data(shade->call, 4),
                           color_bytes[args->instance.color_format]);
        shade_pixels(shade, x, y, pt_lanes_left(x, rect[2]));
    }
}

static void shade_bands(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct shade *shade = context;
    const uint32_t *rect = shade->args->view.rect;
    float *rows = shade->rows + thread * shade->ring * PT_RING_CHANNELS * shade->stride;
    for (uint32_t band = begin; band < end && !pt_cpu_cancelled(shade->call); band++) {
        uint32_t first = rect[1] + band * BAND_ROWS, last = first + BAND_ROWS < rect[3] ? first + BAND_ROWS : rect[3];
        for (uint32_t k = 0; k + 1 < shade->ring; k++)
            load_row(shade, rows, (int32_t)(first + k) - (int32_t)shade->args->blend);
        for (uint32_t y = first; y < last; y++)
            shade_row(shade, rows, y);
    }
}

int PT_KERNEL_ENTRY(shade)(const struct pt_cpu_call *call)
{
    const struct shade_args *args = call->arguments;
    const uint32_t *rect = args->view.rect;
    struct shade shade = { .call = call, .args = args, .stride = pt_ring_stride(rect), .ring = 2 * args->blend + 1 };
    if (rect[0] >= rect[2] || rect[1] >= rect[3])
        return PATINA_OK;
    for (int i = 0; i <= 2 * REACH * REACH; i++)
        shade.weights[i] = pt_rcp((float)(1 + i));
    size_t floats = pt_pool_threads(call->pool) * shade.ring * PT_RING_CHANNELS * shade.stride;
    shade.rows = pt_cpu_scratch(call, 0, floats * sizeof(float));
    if (!shade.rows)
        return PATINA_ERROR_MEMORY;
    pt_parallel(call->pool, (rect[3] - rect[1] + BAND_ROWS - 1) / BAND_ROWS, 1, shade_bands, &shade);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
