// SPDX-License-Identifier: GPL-3.0-or-later
// gather: soft points of an instance -> records, lit: what their balls on screen are made of. SPEC 5, soft; twin of
// shaders/kernels/gather.comp
#include "device_cpu/kernels/shade.h"
#include "device_cpu/points.h"
#include "shared/balls.h"

struct gather {
    const struct pt_cpu_call *call;
    const struct gather_args *args;
};

// PT_LANES points from slot i of the chunk on.
struct points {
    vf x, y, z, radius; // as in a record; before it has a place, the point's own
    vf opacity;
    vi f, id;
    vm some;
};

// What their words hold; which of them are soft.
static inline vm read_words(const struct gather_args *args, vi words, struct points *out)
{
    const vi steps = args->whole ? words : vi_and(words, vi_set(PT_FIELD_RADIUS)), none = vi_set(0);
    const vi bits = vi_add(vi_set(args->radius_base), vi_mul(steps, vi_set(args->radius_step)));
    out->f = args->whole ? vi_set((uint32_t)PT_FIELD_MOST) : vi_shr(words, PT_FIELD_SHIFT);
    out->radius = vi_float(vi_select(vi_eq(steps, none), none, bits));
    return vi_lt_unsigned(vi_set(args->threshold), out->f);
}

// 1. Where they lie, and which of them are soft, drawn and in view.
static inline void place(const struct gather *gather, const struct chunk_view *chunk, uint32_t i, struct points *out)
{
    const struct gather_args *args = gather->args;
    const struct view_args *view = &args->shade.view;
    vf p[3];
    pt_load_points(chunk, pt_chunk_points(PT_DATA(gather->call, gather, positions), chunk), i, p);
    const vf farthest = vf_set(PT_SOFT_FARTHEST), near = vf_set(view->z_near), far = vf_set(view->z_far);
    out->x = vf_transform(chunk, 0, p[0], p[1], p[2]);
    out->y = vf_transform(chunk, 1, p[0], p[1], p[2]);
    out->z = vf_transform(chunk, 2, p[0], p[1], p[2]);
    const vf own = vf_min(out->radius * vf_set(args->radius_scale), vf_set(PT_SOFT_WIDEST));
    const vf least = vf_footprint(view, out->z) * vf_set(PT_SOFT_LEAST);
    out->radius = vf_max(own, least);
    const vf reach = args->within ? out->radius : vf_zero();
    out->some = vm_and(out->some, vm_and(vf_le(near, out->z + reach), vf_le(out->z - reach, far)));
    out->some = vm_and(out->some, vm_and(vf_le(vf_abs(out->x), farthest), vf_le(vf_abs(out->y), farthest)));
    out->some = vm_and(out->some, vf_lt(vf_zero(), out->radius));
    if (chunk->sifted) {
        const uint32_t *drawn = (const uint32_t *)PT_DATA(gather->call, gather, drawn) + chunk->sifted - 1;
        out->some = vm_and(out->some, vm_of_bits(drawn[i / PT_SLOTS_A_WORD] >> i % PT_SLOTS_A_WORD));
    }
    const vf share = own * vf_rcp(vf_select(out->some, out->radius, vf_set(1.0f)));
    out->opacity = vf_set(args->opacity) * (share * share);
}

// 2. Their light.
static inline void light(const struct gather *gather, const struct points *points, vi word, vf color[4])
{
    const struct shade_args *args = &gather->args->shade;
    const vf zero = vf_zero(), one = vf_set(1.0f);
    vf ray[2] = {points->x, points->y}, n[3];
    pt_albedo(&args->instance, PT_DATA(gather->call, gather, colors), points->id, vi_set(0), points->some, color);
    const vm before = vf_lt(vf_set(PT_SOFT_BEFORE), points->z); // the eye may stand in a ball
    const vf r = vf_rcp(vf_select(before, points->z, one));
    for (int k = 0; k < 2 && args->view.perspective; k++)
        ray[k] = ray[k] * r;
    ray[0] = vf_set(args->view.ray_x0) + vf_set(args->view.ray_xs) * ray[0];
    ray[1] = vf_set(args->view.ray_y0) + vf_set(args->view.ray_ys) * ray[1];
    for (int k = 0; k < 2 && args->view.perspective; k++)
        ray[k] = vf_select(before, ray[k], zero);
    if (pt_recolors(args))
        pt_recolor_at(args, PT_DATA(gather->call, gather, ramps), ray, points->z, points->some, color);
    if (!args->instance.lit)
        return;
    vf_view_normal(&args->instance, word, n);
    const vf square = (n[0] * n[0] + n[1] * n[1]) + n[2] * n[2];
    const vm known = vm_and(vm_not(vi_eq(vi_and(word, vi_set(PT_NORMAL_BITS)), vi_set(PT_NORMAL_NONE))),
                            vf_lt(vf_set(1e-20f), square));
    const vf scale = vf_rsqrt(vf_select(known, square, one));
    for (int k = 0; k < 3; k++) // without one: across the view
        n[k] = vf_select(known, n[k] * scale, k == 2 ? one : zero);
    const struct pt_lights lights = pt_lights_of(args, PT_DATA(gather->call, gather, lights),
                                                 PT_DATA(gather->call, gather, shadows), NULL);
    pt_phong(args, 0, &lights, ray, points->id, points->some, points->z, n, color);
}

// 3. W of [S Eq. 22] in the lowest byte, and opacity above it.
static inline vi amount(const struct gather_args *args, const struct points *points, vf opacity)
{
    const vf zero = vf_zero(), one = vf_set(1.0f), half = vf_set(0.5f);
    vf weight = one;
    if (args->weight > 0.0f) {
        const vf above = vi_convert(vi_sub(points->f, vi_set(args->threshold)));
        weight = vf_min(vf_max(above * vf_set(args->weight), zero), one);
    }
    const vi low = vf_int(weight * vf_set(255.0f) + half);
    const vf steps = vf_min(vf_max(opacity, zero), one) * vf_set(PT_SOFT_STEPS) + half; // which may round up
    const vi high = vf_int(vf_min(steps, vf_set(PT_SOFT_STEPS)));
    return vi_or(vi_mul(high, vi_set(1u << PT_SOFT_SHIFT)), low);
}

static void write_records(float *records, const vf first[4], const vf second[4])
{
    float halves[2][PT_LANES][4];
    vf_store4(halves[0][0], first, PT_ALL);
    vf_store4(halves[1][0], second, PT_ALL);
    for (uint32_t i = 0; i < PT_LANES; i++)
        for (uint32_t k = 0; k < 2; k++)
            memcpy(records + PT_SOFT_WORDS * i + 4 * k, halves[k][i], sizeof halves[k][i]);
}

static void gather_chunk(const struct gather *gather, const struct chunk_view *chunk)
{
    const struct gather_args *args = gather->args;
    const struct instance_args *instance = &args->shade.instance;
    const uint32_t *field = (const uint32_t *)PT_DATA(gather->call, gather, field) + chunk->first;
    const uint32_t *surfels = (const uint32_t *)PT_DATA(gather->call, gather, surfels) + chunk->first;
    float *records = (float *)PT_DATA(gather->call, gather, points) + (size_t)PT_SOFT_WORDS * chunk->record;
    const vf none = vf_set(pt_float(PT_KEY_EMPTY_Z));
    for (uint32_t i = 0; i < chunk->padded; i += PT_LANES) {
        struct points points = {.id = vi_add(vi_set(chunk->first + i), vi_lanes())};
        vf first[4] = {none, none, none, none}, color[4] = {none, none, none, none};
        points.some = vm_first(i < chunk->count ? pt_lanes_left(i, chunk->count) : 0);
        points.some = vm_and(points.some, read_words(args, vi_load(field + i), &points));
        if (vm_bits(points.some))
            place(gather, chunk, i, &points);
        if (vm_bits(points.some)) {
            light(gather, &points, vi_load(surfels + i), color);
            const vf own = pt_opacity(instance, PT_DATA(gather->call, gather, colors), PT_DATA(gather->call, gather, opacities),
                                      points.id, vi_set(0), points.some);
            const vi word = amount(args, &points, points.opacity * own);
            points.some = vm_and(points.some, vi_lt_unsigned(vi_set((1u << PT_SOFT_SHIFT) - 1), word));
            const vf wide[4] = {points.x, points.y, points.z, points.radius};
            color[3] = vi_float(word);
            for (int k = 0; k < 4; k++) {
                first[k] = vf_select(points.some, wide[k], none);
                color[k] = vf_select(points.some, color[k], none);
            }
        }
        write_records(records + (size_t)PT_SOFT_WORDS * i, first, color);
    }
}

static void gather_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct gather *gather = context;
    const struct chunk_view *chunks = PT_DATA(gather->call, gather, chunks);
    (void)thread;
    for (uint32_t c = begin; c < end && !pt_cpu_cancelled(gather->call); c++)
        gather_chunk(gather, &chunks[c]);
}

int PT_KERNEL_ENTRY(gather)(const struct pt_cpu_call *call)
{
    struct gather gather = {.call = call, .args = call->arguments};
    pt_parallel(call->pool, (uint32_t)(call->buffers[PT_BUF_gather_chunks]->size / sizeof(struct chunk_view)), 4, gather_chunks,
                &gather);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
