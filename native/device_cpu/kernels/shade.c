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
//
// Measured neighbours of the same layer, as far as the pixel it was filled from, weighted by 1 / (1 + distance^2); the
// source's own normal where there are none. Most pixels are filled from near by: those take their taps from a ring of
// rows with separate vectors, the others gather (three times dearer a tap).

enum { NEAR = 3, RING = 2 * NEAR + 1, BAND_ROWS = 32, PAD = 16, CHANNELS = 4 }; // z of measured pixels (else +inf), normal

struct shade {
    const struct pt_cpu_call *call;
    const struct shade_args *args;
    float *rows;   // per thread: RING rows x CHANNELS
    size_t stride; // floats of one channel of a row
    float weights[2 * BLEND_REACH * BLEND_REACH + 1]; // by squared distance
};

struct filled { // PT_LANES of them
    uint32_t x[PT_LANES], from[PT_LANES], count;
};

static float *channel(const struct shade *shade, float *rows, uint32_t row, uint32_t index)
{
    return rows + (row * CHANNELS + index) * shade->stride + PAD;
}

// The rectangle's columns and NEAR more on both sides.
static void load_row(const struct shade *shade, float *rows, uint32_t slot, int32_t y)
{
    const struct view_args *view = &shade->args->view;
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z));
    uint32_t first = view->rect[0] > NEAR ? view->rect[0] - NEAR : 0;
    uint32_t last = view->rect[2] + NEAR < view->width ? view->rect[2] + NEAR : view->width;
    int32_t shift = (int32_t)view->rect[0];
    float *out[CHANNELS];
    for (uint32_t k = 0; k < CHANNELS; k++)
        out[k] = channel(shade, rows, slot, k) - shift; // indexed by x
    for (int32_t x = shift - PAD; x < (int32_t)view->rect[2] + PAD; x += PT_LANES)
        vf_store(out[0] + x, empty, vm_first(PT_LANES));
    if (y < 0 || y >= (int32_t)view->height)
        return;
    size_t row = (size_t)y * view->width;
    const uint64_t *keys = (const uint64_t *)pt_cpu_data(shade->call, 0) + row;
    const uint32_t *from = (const uint32_t *)pt_cpu_data(shade->call, 1) + row;
    const float *normals = (const float *)pt_cpu_data(shade->call, 2) + 4 * row;
    for (uint32_t x = first; x < last; x += PT_LANES) {
        vm lanes = vm_first(pt_lanes_left(x, last));
        vi self = vi_add(vi_set((uint32_t)row + x), vi_lanes());
        vm measured = vm_and(lanes, vi_eq(vi_and(vi_load(from + x), vi_set(~PT_FROM_MIXED)), self));
        if (!vm_bits(measured))
            continue;
        vf n[4];
        vf_load4(normals + 4 * (size_t)x, n);
        vf_store(out[0] + x, vf_select(measured, vi_float(vi_load_z(keys + x)), empty), lanes);
        for (uint32_t k = 0; k < 3; k++)
            vf_store(out[1 + k] + x, n[k], lanes);
    }
}

// The blend, or where it is nothing the source's own; then into the shading plane.
static void finish_blend(const struct shade *shade, vf n[4], vi source, vm lanes)
{
    const float *normals = pt_cpu_data(shade->call, 2);
    vf square = (n[0] * n[0] + n[1] * n[1]) + n[2] * n[2];
    vm blended = vf_lt(vf_set(1e-12f), square);
    vf scale = vf_rsqrt(vf_select(blended, square, vf_set(1.0f)));
    for (int k = 0; k < 3; k++)
        n[k] = n[k] * scale;
    if (vm_bits(vm_and(lanes, vm_not(blended))))
        for (uint32_t k = 0; k < 3; k++)
            n[k] = vf_select(blended, n[k], vf_gather(normals, vi_add(vi_mul(source, vi_set(4)), vi_set(k)), lanes));
    n[3] = vf_zero();
}

// How far (Chebyshev) the pixel `source` lies from `self` in a plane of this width; more than NEAR: NEAR + 1.
static vi near_distance(vi source, vi self, uint32_t width)
{
    vi distance = vi_set(NEAR + 1);
    for (int32_t row = -NEAR; row <= NEAR; row++) {
        vi column = vi_sub(vi_sub(source, self), vi_set((uint32_t)(row * (int32_t)width)));
        for (uint32_t d = NEAR; d + 1 > (uint32_t)abs(row); d--) { // the smallest that holds is set last
            vm within = vi_lt_unsigned(vi_add(column, vi_set(d)), vi_set(2 * d + 1));
            distance = vi_select(vm_and(within, vi_lt_unsigned(vi_set(d), distance)), vi_set(d), distance);
        }
    }
    return distance;
}

static void blend_near(const struct shade *shade, float *const around[RING], uint32_t x, uint32_t y, vi source, vi reach,
                       uint32_t near)
{
    const struct view_args *view = &shade->args->view;
    size_t at = (size_t)y * view->width + x, column = x - view->rect[0];
    vf z = vi_float(vi_load_z((const uint64_t *)pt_cpu_data(shade->call, 0) + at));
    vm lanes = vm_of_bits(near);
    vf limit = vf_gather(pt_cpu_data(shade->call, 3), source, lanes);
    vf n[4] = { vf_zero(), vf_zero(), vf_zero(), vf_zero() };
    int most = 1;
    while (most < NEAR && vm_bits(vm_and(lanes, vi_lt_unsigned(vi_set((uint32_t)most), reach))))
        most++;
    for (int dy = -most; dy <= most; dy++)
        for (int dx = -most; dx <= most; dx++) {
            uint32_t distance = (uint32_t)(abs(dx) > abs(dy) ? abs(dx) : abs(dy));
            const float *tap = around[NEAR + dy] + column + dx;
            vm take = vm_and(lanes, vf_le(vf_abs(vf_load(tap) - z), limit));
            if (distance > 1)
                take = vm_and(take, vm_not(vi_lt_unsigned(reach, vi_set(distance))));
            vf weight = vf_set(shade->weights[dx * dx + dy * dy]);
            for (size_t k = 0; k < 3; k++)
                n[k] = n[k] + vf_select(take, vf_load(tap + (1 + k) * shade->stride), vf_zero()) * weight;
        }
    finish_blend(shade, n, source, lanes);
    vf_store4((float *)pt_cpu_data(shade->call, 6) + 4 * at, n, near);
}

static void blend_far(const struct shade *shade, struct filled *filled, uint32_t y)
{
    const struct view_args *view = &shade->args->view;
    const uint64_t *keys = pt_cpu_data(shade->call, 0);
    const uint32_t *from = pt_cpu_data(shade->call, 1);
    const float *normals = pt_cpu_data(shade->call, 2);
    uint32_t reach[PT_LANES] = { 0 }, most = 1;
    vm ours = vm_first(filled->count);
    for (uint32_t i = 0; i < PT_LANES; i++) {
        if (i >= filled->count) {
            filled->x[i] = filled->from[i] = 0;
            continue;
        }
        uint32_t dx = (uint32_t)abs((int32_t)(filled->from[i] % view->width) - (int32_t)filled->x[i]);
        uint32_t dy = (uint32_t)abs((int32_t)(filled->from[i] / view->width) - (int32_t)y);
        reach[i] = dx > dy ? dx : dy;
        reach[i] = reach[i] > BLEND_REACH ? BLEND_REACH : reach[i];
        most = reach[i] > most ? reach[i] : most;
    }
    vi x = vi_load(filled->x), source = vi_load(filled->from), radius = vi_load(reach);
    vi pixel = vi_add(x, vi_set(y * view->width));
    vf z = vi_float(vi_gather_z(keys, pixel, ours)), limit = vf_gather(pt_cpu_data(shade->call, 3), source, ours);
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
            vf weight = vf_set(shade->weights[dx * dx + dy * dy]);
            for (uint32_t k = 0; k < 3; k++)
                n[k] = n[k] + vf_gather(normals, vi_add(vi_mul(q, vi_set(4)), vi_set(k)), take) * weight;
        }
    finish_blend(shade, n, source, ours);
    float out[4][PT_LANES], *shading = pt_cpu_data(shade->call, 6);
    for (int k = 0; k < 4; k++)
        vf_store(out[k], n[k], vm_first(PT_LANES));
    for (uint32_t i = 0; i < filled->count; i++)
        for (int k = 0; k < 4; k++)
            shading[4 * ((size_t)y * view->width + filled->x[i]) + (size_t)k] = out[k][i];
    filled->count = 0;
}

static void blend_row(const struct shade *shade, float *const around[RING], uint32_t y)
{
    const struct view_args *view = &shade->args->view;
    const struct instance_args *instance = &shade->args->instance;
    const uint64_t *keys = (const uint64_t *)pt_cpu_data(shade->call, 0) + (size_t)y * view->width;
    const uint32_t *from = (const uint32_t *)pt_cpu_data(shade->call, 1) + (size_t)y * view->width;
    struct filled filled = { .count = 0 };
    for (uint32_t x = view->rect[0]; x < view->rect[2]; x += PT_LANES) {
        vi z = vi_load_z(keys + x), id = vi_sub(vi_load_id(keys + x), vi_set(instance->id_base));
        vi self = vi_add(vi_set(y * view->width + x), vi_lanes()), source = vi_and(vi_load(from + x), vi_set(~PT_FROM_MIXED));
        vm ours = vm_and(vm_and(vm_first(pt_lanes_left(x, view->rect[2])), vm_not(vi_eq(z, vi_set(PT_KEY_EMPTY_Z)))),
                         vi_lt_unsigned(id, vi_set(instance->id_count)));
        vm other = vm_and(ours, vm_not(vi_eq(source, self)));
        if (!vm_bits(other))
            continue;
        vi reach = near_distance(source, self, view->width);
        vm near = vi_lt_unsigned(reach, vi_set(NEAR + 1));
        uint32_t bits = vm_bits(vm_and(other, near)), rest = vm_bits(vm_and(other, vm_not(near)));
        if (bits)
            blend_near(shade, around, x, y, source, reach, bits);
        for (; rest; rest &= rest - 1) {
            uint32_t i = x + (uint32_t)__builtin_ctz(rest);
            filled.x[filled.count] = i;
            filled.from[filled.count++] = from[i] & ~PT_FROM_MIXED;
            if (filled.count == PT_LANES)
                blend_far(shade, &filled, y);
        }
    }
    if (filled.count)
        blend_far(shade, &filled, y);
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

static void shade_bands(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct shade *shade = context;
    const struct shade_args *args = shade->args;
    const uint32_t *rect = args->view.rect;
    static const uint32_t color_bytes[] = { 0, 3, 12 };
    float *rows = shade->rows + thread * RING * CHANNELS * shade->stride;
    for (uint32_t band = begin; band < end && !pt_cpu_cancelled(shade->call); band++) {
        uint32_t first = rect[1] + band * BAND_ROWS, last = first + BAND_ROWS < rect[3] ? first + BAND_ROWS : rect[3];
        for (uint32_t k = 0; args->refined && k < RING - 1; k++)
            load_row(shade, rows, k, (int32_t)(first + k) - NEAR);
        for (uint32_t y = first; y < last; y++) {
            const uint64_t *keys = (const uint64_t *)pt_cpu_data(shade->call, 0) + (size_t)y * args->view.width;
            float *around[RING];
            for (uint32_t k = 0; k < RING; k++)
                around[k] = channel(shade, rows, (y - first + k) % RING, 0);
            if (args->refined) {
                load_row(shade, rows, (y - first + RING - 1) % RING, (int32_t)y + NEAR);
                blend_row(shade, around, y);
            }
            for (uint32_t x = rect[0]; x < rect[2]; x += PT_LANES) {
                if (args->instance.color_format)
                    pt_fetch_ahead(keys, x + 4 * PT_LANES, rect[2], &args->instance, pt_cpu_data(shade->call, 5),
                                   color_bytes[args->instance.color_format]);
                shade_pixels(args, shade->call, x, y, pt_lanes_left(x, rect[2]));
            }
        }
    }
}

int PT_KERNEL_ENTRY(shade)(const struct pt_cpu_call *call)
{
    const struct shade_args *args = call->arguments;
    const uint32_t *rect = args->view.rect;
    struct shade shade = { .call = call, .args = args };
    if (rect[0] >= rect[2] || rect[1] >= rect[3])
        return PATINA_OK;
    for (int i = 0; i <= 2 * BLEND_REACH * BLEND_REACH; i++)
        shade.weights[i] = pt_rcp((float)(1 + i));
    shade.stride = rect[2] - rect[0] + 4 * PAD;
    shade.rows = pt_cpu_scratch(call, 0, pt_pool_threads(call->pool) * RING * CHANNELS * shade.stride * sizeof(float));
    if (!shade.rows)
        return PATINA_ERROR_MEMORY;
    pt_parallel(call->pool, (rect[3] - rect[1] + BAND_ROWS - 1) / BAND_ROWS, 1, shade_bands, &shade);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
