// SPDX-License-Identifier: GPL-3.0-or-later
// dim: points behind the soft points of a light's view. SPEC 5; twin of shaders/kernels/dim.comp
//
// Words of a cloud's points belong to one chunk each, so threads never meet.
#include "device_cpu/points.h"
#include "shadow_words.h"
#include "shared/shadows.h"

struct dim {
    const struct pt_cpu_call *call;
    const struct dim_args *args;
};

// 2. What the rays of PT_LANES texels have lost where the points are: `slab`, and how far into it.
static inline vf texel_at(const struct dim *dim, vi column, vi row, vi slab, vf into, vm some)
{
    const struct view_args *view = &dim->args->view;
    const float *veil = PT_DATA(dim->call, dim, veil);
    const vi at = vi_add(vi_mul(vi_add(vi_mul(row, vi_set(view->width)), column), vi_set(dim->args->veils)), slab);
    const vm behind = vm_and(some, vm_not(vi_eq(slab, vi_set(0))));
    const vf last = vf_select(some, vf_gather(veil, at, some), vf_zero()),
             before = vf_select(behind, vf_gather(veil, vi_sub(at, vi_set(1)), behind), vf_zero());
    return before + into * (last - before);
}

// Between 0 and `most`.
static inline vf clamped(vf x, uint32_t most) { return vf_min(vf_max(x, vf_zero()), vf_set((float)most)); }

// What is taken of 255 from PT_LANES points from slot i on.
static inline vi loss_of(const struct dim *dim, const struct chunk_view *chunk, const uint32_t *points, uint32_t i, vm lanes)
{
    const struct dim_args *args = dim->args;
    const struct view_args *view = &args->view;
    const vf one = vf_set(1.0f), half = vf_set(0.5f);
    vf p[3], at[3];
    pt_load_points(chunk, points, i, p);
    // 1. project
    pt_project(view, chunk, p, at);
    const vm inside = pt_in_window(view, args->window, at, lanes);
    if (!vm_bits(inside))
        return vi_set(0);
    const vf deep = vf_select(inside, clamped((at[2] - vf_set(args->veil_from)) * vf_set(args->veil_scale), args->veils),
                              vf_zero());
    const vf slab = vf_min(vf_floor(deep), vf_set((float)(args->veils - 1)));
    const vi in = vf_int(slab);
    const vf x = vf_select(inside, (at[0] - half) - vf_set((float)view->origin_x), vf_zero()),
             y = vf_select(inside, (at[1] - half) - vf_set((float)view->origin_y), vf_zero());
    const vf left = vf_floor(x), below = vf_floor(y), across = x - left, up = y - below;
    const vi columns[2] = {vf_int(clamped(left, view->width - 1)), vf_int(clamped(left + one, view->width - 1))};
    const vi rows[2] = {vf_int(clamped(below, view->height - 1)), vf_int(clamped(below + one, view->height - 1))};
    // 3. between their middles
    vf lost[2];
    for (int k = 0; k < 2; k++) {
        const vf first = texel_at(dim, columns[0], rows[k], in, deep - slab, inside),
                 then = texel_at(dim, columns[1], rows[k], in, deep - slab, inside);
        lost[k] = first + across * (then - first);
    }
    const vf sum = lost[0] + up * (lost[1] - lost[0]);
    const vf taken = one - vf_exp2(vf_max(sum * vf_set(-1.44269504f), vf_set(-126.0f)));
    return vf_int(vf_select(inside, clamped(taken, 1) * vf_set(255.0f) + half, vf_zero()));
}

static uint32_t dim_chunk(const struct dim *dim, const struct chunk_view *chunk)
{
    const struct dim_args *args = dim->args;
    const uint32_t *points = pt_chunk_points(PT_DATA(dim->call, dim, positions), chunk);
    const uint32_t *marks = PT_DATA(dim->call, dim, marks); // none where none are asked for
    uint32_t *words = (uint32_t *)PT_DATA(dim->call, dim, shadows) + args->base, differs = 0;
    const int whole = args->alone || args->close, all = args->close || args->compare;
    for (uint32_t i = 0; i < chunk->count; i += PT_LANES) {
        vm lanes = vm_first(pt_lanes_left(i, chunk->count));
        if (args->marked)
            lanes = pt_are_shown(marks, chunk->first + i, lanes);
        if (!vm_bits(lanes))
            continue;
        uint32_t losses[PT_LANES];
        vi_store(losses, loss_of(dim, chunk, points, i, lanes));
        for (uint32_t left = vm_bits(lanes); left; left &= left - 1) {
            const uint32_t k = (uint32_t)__builtin_ctz(left);
            if (all || losses[k])
                differs |= pt_shadow_note(words + pt_word_at(marks, args->marked, args->step, chunk->first + i + k), losses[k],
                                          whole, args->samples);
        }
    }
    return differs;
}

static void dim_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct dim *dim = context;
    const struct chunk_view *chunks = PT_DATA(dim->call, dim, chunks);
    uint32_t differs = 0;
    (void)thread;
    for (uint32_t c = begin; c < end && !pt_cpu_cancelled(dim->call); c++)
        differs |= dim_chunk(dim, &chunks[c]);
    if (differs && dim->args->compare)
        __atomic_store_n((uint32_t *)PT_DATA(dim->call, dim, differs), 1, __ATOMIC_RELAXED);
}

int PT_KERNEL_ENTRY(dim)(const struct pt_cpu_call *call)
{
    struct dim dim = {call, call->arguments};
    pt_parallel(call->pool, (uint32_t)(call->buffers[PT_BUF_dim_chunks]->size / sizeof(struct chunk_view)), 4, dim_chunks,
                &dim);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
