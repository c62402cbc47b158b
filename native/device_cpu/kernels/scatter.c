// SPDX-License-Identifier: GPL-3.0-or-later
// scatter: points -> least key a pixel. [D 3.1]; twin of shaders/kernels/scatter.comp
//
// A gathered depth test comes before any store: only nearer points go on to the scalar part. Threads share the plane and
// store by compare-and-swap; the minimum commutes, so neither threads nor batches show. Chunks are compact on screen, so
// threads seldom meet: 3.1 ms for 1M points on two cores where private planes, merged afterwards, take 6.1.
#include "device_cpu/cpu.h"
#include "device_cpu/simd.h"

struct scatter {
    const struct pt_cpu_call *call;
    const struct view_args *view;
    const uint32_t *begins; // begins[i]: first chunk of instance i in the list of all chunks
};

struct target {
    uint64_t *keys;
    const float *limit; // only what lies beyond counts; NULL: everything
    const uint32_t *drawn; // bits of sifted chunks
    int shared;         // by several threads
};

static inline void store_least(struct target target, uint32_t pixel, uint64_t key)
{
    uint64_t *at = target.keys + pixel;
    if (!target.shared) {
        if (key < *at)
            *at = key;
        return;
    }
    uint64_t seen = __atomic_load_n(at, __ATOMIC_RELAXED);
    while (key < seen && !__atomic_compare_exchange_n(at, &seen, key, 1, __ATOMIC_RELAXED, __ATOMIC_RELAXED))
        ;
}

// Points of a chunk that wait for their surface words: those lie in file order, so each is a cache miss of its own (40% of
// a frame's scatter before they were fetched ahead).
enum { QUEUE = 64 };

struct queue {
    uint32_t count, slot[QUEUE + PT_LANES], id[QUEUE + PT_LANES], pixel[QUEUE + PT_LANES], z[QUEUE + PT_LANES];
};

// Which of PT_LANES waiting points face away.
static uint32_t faces_away(const struct chunk_view *chunk, const float *positions, const uint32_t *surface,
                           const struct queue *queue, uint32_t at, vm lanes)
{
    vi slot = vi_load(queue->slot + at), word = vi_gather(surface, vi_load(queue->id + at), lanes);
    vf n[3], v[3];
    vf_decode_normal(word, n);
    for (uint32_t k = 0; k < 3; k++)
        v[k] = vf_set(chunk->eye[k]) - vf_set(chunk->eye[3]) * vf_gather(positions + k * chunk->padded, slot, lanes);
    vm away = vf_le((n[0] * v[0] + n[1] * v[1]) + n[2] * v[2], vf_zero());
    return vm_bits(vm_and(away, vm_not(vi_eq(vi_and(word, vi_set(PT_NORMAL_BITS)), vi_set(PT_NORMAL_NONE)))));
}

static void drain(const struct chunk_view *chunk, const float *positions, const uint32_t *surface, struct queue *queue,
                  struct target target)
{
    for (uint32_t at = 0; at < queue->count; at += PT_LANES) {
        uint32_t left = queue->count - at < PT_LANES ? queue->count - at : PT_LANES;
        vm lanes = vm_first(left);
        uint32_t draw = vm_bits(lanes) & ~faces_away(chunk, positions, surface, queue, at, lanes);
        for (; draw; draw &= draw - 1) {
            uint32_t k = at + (uint32_t)__builtin_ctz(draw);
            store_least(target, queue->pixel[k], (uint64_t)queue->z[k] << 32 | (uint32_t)(chunk->id_base + queue->id[k]));
        }
    }
    queue->count = 0;
}

static void scatter_chunk(const struct view_args *view, const struct chunk_view *chunk, const float *all_positions,
                          const uint32_t *all_ids, const uint32_t *surface, struct target target)
{
    const float *positions = all_positions + 3 * (size_t)chunk->first;
    const uint32_t *ids = all_ids + chunk->first;
    const vf z_near = vf_set(view->z_near), z_far = vf_set(view->z_far);
    const vf left = vf_set((float)view->origin_x), right = vf_set((float)(view->origin_x + (int32_t)view->width));
    const vf bottom = vf_set((float)view->origin_y), top = vf_set((float)(view->origin_y + (int32_t)view->height));
    const vi origin_x = vi_set((uint32_t)view->origin_x), origin_y = vi_set((uint32_t)view->origin_y);
    const vi width = vi_set(view->width);
    struct queue queue = { .count = 0 };

    for (uint32_t i = 0; i < chunk->count; i += PT_LANES) {
        // 1. project
        vf px = vf_load(positions + i), py = vf_load(positions + chunk->padded + i);
        vf pz = vf_load(positions + 2 * (size_t)chunk->padded + i);
        vf z = vf_transform(chunk, 2, px, py, pz);
        vf x = vf_transform(chunk, 0, px, py, pz), y = vf_transform(chunk, 1, px, py, pz);
        if (view->perspective) {
            vf r = vf_rcp(z);
            x = x * r;
            y = y * r;
        }
        // 2. clip: NaN fails every comparison; what was sifted out is not drawn
        vm inside = vm_and(vm_and(vf_le(z_near, z), vf_le(z, z_far)),
                           vm_and(vm_and(vf_le(left, x), vf_lt(x, right)), vm_and(vf_le(bottom, y), vf_lt(y, top))));
        if (chunk->sifted)
            inside = vm_and(inside, vm_of_bits(target.drawn[chunk->sifted - 1 + i / PT_SLOTS_A_WORD] >> i % PT_SLOTS_A_WORD));
        if (!vm_bits(inside))
            continue;
        // 3. limit and early depth test; the sign bit of -0 is dropped
        vi column = vi_sub(vf_int(vf_floor(x)), origin_x), row = vi_sub(vf_int(vf_floor(y)), origin_y);
        vi pixel = vi_add(vi_mul(row, width), column);
        vi z_bits = vi_and(vf_bits(z), vi_set(0x7FFFFFFFu));
        if (target.limit) {
            inside = vm_and(inside, vf_lt(vf_gather(target.limit, pixel, inside), z));
            if (!vm_bits(inside))
                continue;
        }
        vi stored = vi_gather_z(target.keys, pixel, inside);
        uint32_t nearer = vm_bits(vm_and(inside, vm_not(vi_lt_unsigned(stored, z_bits))));
        if (!nearer)
            continue;
        // 4. the least key, back faces first
        uint32_t pixels[PT_LANES], zs[PT_LANES];
        vi_store(pixels, pixel, vm_first(PT_LANES));
        vi_store(zs, z_bits, vm_first(PT_LANES));
        if (!chunk->cull) {
            for (; nearer; nearer &= nearer - 1) {
                uint32_t k = (uint32_t)__builtin_ctz(nearer);
                store_least(target, pixels[k], (uint64_t)zs[k] << 32 | (uint32_t)(chunk->id_base + ids[i + k]));
            }
            continue;
        }
        for (; nearer; nearer &= nearer - 1, queue.count++) {
            uint32_t k = (uint32_t)__builtin_ctz(nearer);
            queue.slot[queue.count] = i + k;
            queue.id[queue.count] = ids[i + k];
            queue.pixel[queue.count] = pixels[k];
            queue.z[queue.count] = zs[k];
            __builtin_prefetch(surface + ids[i + k]);
        }
        if (queue.count >= QUEUE - PT_LANES)
            drain(chunk, positions, surface, &queue, target);
    }
    drain(chunk, positions, surface, &queue, target);
}

static void scatter_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct scatter *scatter = context;
    const struct pt_cpu_call *call = scatter->call;
    const struct scatter_args *args = call->arguments;
    const struct target target = { .keys = pt_cpu_data(call, 0),
                                   .limit = args->behind ? pt_cpu_data(call, 1 + 4 * args->instances) : NULL,
                                   .drawn = args->sifted ? pt_cpu_data(call, 1 + 4 * args->instances + args->behind) : NULL,
                                   .shared = pt_pool_threads(call->pool) > 1 };
    uint32_t instance = 0;
    (void)thread;
    for (uint32_t c = begin; c < end && !pt_cpu_cancelled(call); c++) {
        while (c >= scatter->begins[instance + 1])
            instance++;
        const struct chunk_view *chunks = pt_cpu_data(call, 1 + 4 * instance);
        scatter_chunk(scatter->view, &chunks[c - scatter->begins[instance]], pt_cpu_data(call, 2 + 4 * instance),
                      pt_cpu_data(call, 3 + 4 * instance), pt_cpu_data(call, 4 + 4 * instance), target);
    }
}

int PT_KERNEL_ENTRY(scatter)(const struct pt_cpu_call *call)
{
    const struct scatter_args *args = call->arguments;
    uint32_t *begins = pt_cpu_scratch(call, 0, (args->instances + 1) * sizeof *begins);
    if (!begins)
        return PATINA_ERROR_MEMORY;
    begins[0] = 0;
    for (uint32_t i = 0; i < args->instances; i++)
        begins[i + 1] = begins[i] + (uint32_t)(call->buffers[1 + 4 * i]->size / sizeof(struct chunk_view));
    struct scatter scatter = { call, &args->view, begins };
    pt_parallel(call->pool, begins[args->instances], 4, scatter_chunks, &scatter);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
