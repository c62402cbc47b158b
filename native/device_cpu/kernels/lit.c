// SPDX-License-Identifier: GPL-3.0-or-later
// lit: points against the filled map of a light. [D 6], SPEC 4; twin of shaders/kernels/lit.comp
//
// Words of a cloud's points belong to one chunk each, so threads never meet. Surface words lie in file order, a cache miss
// each: only points well behind the map are asked for theirs, and lit points are not written at all.
#include "device_cpu/rows.h"

struct lit {
    const struct pt_cpu_call *call;
    struct lit_args args; // with the wider texel
};

// 1. project: pixel and z; which lanes the map says something about.
static vm project(const struct view_args *view, const float window[4], const struct chunk_view *chunk,
                  const float *positions, uint32_t i, vf at[2], vf *z)
{
    vf px = vf_load(positions + i), py = vf_load(positions + chunk->padded + i);
    vf pz = vf_load(positions + 2 * (size_t)chunk->padded + i);
    *z = vf_transform(chunk, 2, px, py, pz);
    at[0] = vf_transform(chunk, 0, px, py, pz);
    at[1] = vf_transform(chunk, 1, px, py, pz);
    if (view->perspective) {
        vf r = vf_rcp(*z);
        at[0] = at[0] * r;
        at[1] = at[1] * r;
    }
    vm inside = vm_and(vm_and(vf_le(vf_set(window[0]), at[0]), vf_lt(at[0], vf_set(window[2]))),
                       vm_and(vf_le(vf_set(window[1]), at[1]), vf_lt(at[1], vf_set(window[3]))));
    return vm_and(inside, vf_le(vf_set(view->z_near), *z));
}

// Depths of the map around those of PT_LANES texels, or 0 beyond its edge.
struct around {
    vf z[8];
    vm known[8]; // on the map
};

static void look_around(const struct view_args *view, const uint64_t *keys, vi column, vi row, vm lanes, struct around *around)
{
    static const int32_t ring[8][2] = { { -1, -1 }, { 0, -1 }, { 1, -1 }, { -1, 0 }, { 1, 0 }, { -1, 1 }, { 0, 1 }, { 1, 1 } };
    for (uint32_t i = 0; i < 8; i++) {
        vi x = vi_add(column, vi_set((uint32_t)ring[i][0])), y = vi_add(row, vi_set((uint32_t)ring[i][1]));
        around->known[i] =
            vm_and(lanes, vm_and(vi_lt_unsigned(x, vi_set(view->width)), vi_lt_unsigned(y, vi_set(view->height))));
        around->z[i] = vi_float(vi_gather_z(keys, vi_add(vi_mul(y, vi_set(view->width)), x), around->known[i]));
    }
}

// The greatest depth of the 3 x 3 texels: a surface of unknown slope may be as far as its neighbours.
static vf farthest(const struct around *around, vf map)
{
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z));
    vf z = map;
    for (uint32_t i = 0; i < 8; i++)
        z = vf_select(vm_and(around->known[i], vf_lt(around->z[i], empty)), vf_max(z, around->z[i]), z);
    return z;
}

// Those of `dark` that enough of the texels around shadow, too.
static vm supported(const struct around *around, vf d, vf z, vm dark)
{
    vi count = vi_set(0);
    for (uint32_t i = 0; i < 8; i++)
        count = vi_add(count, vi_select(vm_and(around->known[i], vf_lt(around->z[i] + d, z)), vi_set(1), vi_set(0)));
    return vm_and(dark, vm_not(vi_lt_unsigned(count, vi_set(PT_SHADOW_SUPPORT))));
}

// 2. d_eff of those of PT_LANES points in this view. *none: those without a normal.
static vf layer_distance(const struct lit *lit, const vf at[2], vf z, vi id, vm lanes, vm *none)
{
    const struct view_args *view = &lit->args.view;
    const struct instance_args *instance = &lit->args.instance;
    vi word = vi_gather(pt_cpu_data(lit->call, 6), id, lanes);
    vf spacing = vf_look_up(instance->spacing, PT_SPACINGS, vi_shr(word, PT_SPACING_SHIFT)), n[3];
    *none = vi_eq(vi_and(word, vi_set(PT_NORMAL_BITS)), vi_set(PT_NORMAL_NONE));
    if (!instance->has_normals)
        *none = lanes;
    vf_view_normal(instance, word, n);
    vf square = (n[0] * n[0] + n[1] * n[1]) + n[2] * n[2];
    *none = vm_and(lanes, vm_or(*none, vm_not(vf_le(vf_set(1e-30f), square))));
    vf scale = vf_rsqrt(square), ray[2];
    for (int k = 0; k < 3; k++)
        n[k] = n[k] * scale;
    ray[0] = vf_set(view->ray_x0) + vf_set(view->ray_xs) * at[0];
    ray[1] = vf_set(view->ray_y0) + vf_set(view->ray_ys) * at[1];
    vf inverse = vf_rcp(vf_max(vf_cosine(view, n, ray), vf_set(PT_COSINE_FLOOR)));
    return vf_layer_distance(view, instance->d_min, spacing, z, vf_select(*none, vf_set(1.0f), inverse));
}

// Which of PT_LANES points are in shadow; *texel: of the map, where they are.
static uint32_t in_shadow(const struct lit *lit, const struct chunk_view *chunk, const float *positions, uint32_t i, vi id,
                          vm lanes, vi *texel)
{
    const struct view_args *view = &lit->args.view;
    const uint64_t *keys = pt_cpu_data(lit->call, 0);
    const vi origin_x = vi_set((uint32_t)view->origin_x), origin_y = vi_set((uint32_t)view->origin_y);
    struct around around;
    vf at[2], z;
    vm inside = vm_and(lanes, project(view, lit->args.window, chunk, positions, i, at, &z)), none;
    if (!vm_bits(inside))
        return 0;
    vi column = vi_sub(vf_int(vf_floor(at[0])), origin_x), row = vi_sub(vf_int(vf_floor(at[1])), origin_y);
    vi pixel = *texel = vi_add(vi_mul(row, vi_set(view->width)), column);
    vf map = vi_float(vi_gather_z(keys, pixel, inside));
    // no d_eff is less than that of a surface without spacing that faces the light; a thousandth off for rounding
    vf least = vf_set(0.999f) * vf_layer_distance(view, lit->args.instance.d_min, vf_zero(), z, vf_set(1.0f));
    vm behind = vm_and(inside, vf_lt(map + least, z));
    if (!vm_bits(behind))
        return 0;
    vf d = layer_distance(lit, at, z, id, behind, &none);
    vm dark = vm_and(behind, vf_lt(map + d, z));
    if (!vm_bits(dark))
        return 0;
    look_around(view, keys, column, row, dark, &around);
    none = vm_and(none, dark);
    if (vm_bits(none)) {
        vi source = vi_and(vi_gather(pt_cpu_data(lit->call, 1), pixel, none), vi_set(~PT_FROM_MIXED));
        d = vf_select(none, vf_max(d, vf_gather(pt_cpu_data(lit->call, 2), source, none)), d);
        dark = vm_and(dark, vf_lt(vf_select(none, farthest(&around, map), map) + d, z));
    }
    return vm_bits(supported(&around, d, z, dark));
}

// a b / 255 of a, b up to 255, rounded: exact.
static inline uint32_t share(uint32_t a, uint32_t b)
{
    uint32_t product = a * b + 128;
    return (product + (product >> 8)) >> 8;
}

// 3. what the map takes of 255 from a point in the shadow of a texel.
static inline uint32_t loss_at(const struct lit *lit, uint32_t texel)
{
    if (!lit->args.faint)
        return lit->args.loss;
    const uint32_t *keys = pt_cpu_data(lit->call, 0); // low words: ids
    const uint8_t *opacities = pt_cpu_data(lit->call, 10);
    return share(lit->args.loss, opacities[keys[2 * (size_t)texel] - lit->args.caster]);
}

// 4. what the sample takes goes into the word. Returns whether the samples so far differ.
static inline uint32_t note(const struct lit_args *args, uint32_t *word, uint32_t loss)
{
    uint32_t sum = *word & PT_SHADOW_SUM, lost = *word >> PT_SHADOW_SHIFT;
    lost += share(255 - lost, loss); // of the light that is left
    if (args->alone || args->close) {
        *word = sum + lost;
        return (sum + lost) != args->samples * lost;
    }
    *word = sum | lost << PT_SHADOW_SHIFT;
    return 0;
}

static uint32_t lit_chunk(const struct lit *lit, const struct chunk_view *chunk)
{
    const struct lit_args *args = &lit->args;
    const float *positions = (const float *)pt_cpu_data(lit->call, 4) + 3 * (size_t)chunk->first;
    const uint32_t *ids = (const uint32_t *)pt_cpu_data(lit->call, 5) + chunk->first;
    const uint8_t *marks = pt_cpu_data(lit->call, 7);
    uint32_t *words = (uint32_t *)pt_cpu_data(lit->call, 8) + args->base, differs = 0;
    int all = args->close || args->compare; // lit points have to be looked at too
    for (uint32_t i = 0; i < chunk->count; i += PT_LANES) {
        vm lanes = vm_first(pt_lanes_left(i, chunk->count));
        vi id = vi_load(ids + i);
        if (args->marked) {
            vi mark = vi_and(vi_gather_bytes(marks, id, lanes), vi_set(255));
            lanes = vm_and(lanes, vm_not(vi_eq(mark, vi_set(0))));
            if (!vm_bits(lanes))
                continue;
        }
        vi texel = vi_set(0);
        uint32_t shadowed = in_shadow(lit, chunk, positions, i, id, lanes, &texel), texels[PT_LANES];
        vi_store(texels, texel, vm_first(PT_LANES));
        for (uint32_t left = all ? vm_bits(lanes) : shadowed; left; left &= left - 1) {
            uint32_t k = (uint32_t)__builtin_ctz(left);
            differs |= note(args, words + ids[i + k], shadowed >> k & 1u ? loss_at(lit, texels[k]) : 0);
        }
    }
    return differs;
}

static void lit_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct lit *lit = context;
    const struct chunk_view *chunks = pt_cpu_data(lit->call, 3);
    uint32_t differs = 0;
    (void)thread;
    for (uint32_t c = begin; c < end && !pt_cpu_cancelled(lit->call); c++)
        differs |= lit_chunk(lit, &chunks[c]);
    if (differs && lit->args.compare)
        __atomic_store_n((uint32_t *)pt_cpu_data(lit->call, 9), 1, __ATOMIC_RELAXED);
}

int PT_KERNEL_ENTRY(lit)(const struct pt_cpu_call *call)
{
    struct lit lit = { call, *(const struct lit_args *)call->arguments };
    lit.args.view.footprint = lit.args.view.footprint * PT_TEXEL_SLACK;
    pt_parallel(call->pool, (uint32_t)(call->buffers[3]->size / sizeof(struct chunk_view)), 4, lit_chunks, &lit);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
