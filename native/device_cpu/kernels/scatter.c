// SPDX-License-Identifier: GPL-3.0-or-later
// scatter: points -> least key a pixel. [D 3.1]; twin of shaders/kernels/scatter.comp
//
// What faces away leaves first: the words of a chunk's points lie side by side. Several threads share the plane and store by
// compare-and-swap (9 cycles), after a gathered depth test; one takes the minimum without asking. The minimum commutes, so
// neither threads nor batches show. Chunks are compact on screen, so threads seldom meet: 3.1 ms for 1M points on two cores
// where private planes, merged afterwards, take 6.1.
#include "device_cpu/cpu.h"
#include "device_cpu/vector_math.h"

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
        *at = key < *at ? key : *at;
        return;
    }
    uint64_t seen = __atomic_load_n(at, __ATOMIC_RELAXED);
    while (key < seen && !__atomic_compare_exchange_n(at, &seen, key, 1, __ATOMIC_RELAXED, __ATOMIC_RELAXED))
        ;
}

// A block takes its steps one after another, none with a branch on what memory answers: the depths are asked for at random,
// and a processor that need not wait for one answer has many under way.
enum { BLOCK = 256, ASKED = 512 }; // points; those of a chunk whose pixels are asked for

struct block { // of a chunk: its points in view that do not face away, packed
    uint32_t count;
    _Alignas(64) uint32_t pixel[BLOCK + PT_LANES];
    uint32_t z[BLOCK + PT_LANES], id[BLOCK + PT_LANES];
};

struct window { // the view's, as vectors
    vf z_near, z_far, left, right, bottom, top;
    vi origin_x, origin_y, width;
};

static struct window window_of(const struct view_args *view)
{
    return (struct window){ .z_near = vf_set(view->z_near),
                            .z_far = vf_set(view->z_far),
                            .left = vf_set((float)view->origin_x),
                            .right = vf_set((float)(view->origin_x + (int32_t)view->width)),
                            .bottom = vf_set((float)view->origin_y),
                            .top = vf_set((float)(view->origin_y + (int32_t)view->height)),
                            .origin_x = vi_set((uint32_t)view->origin_x),
                            .origin_y = vi_set((uint32_t)view->origin_y),
                            .width = vi_set(view->width) };
}

// Which of PT_LANES points face away.
static inline vm faces_away(const struct chunk_view *chunk, vi word, const vf p[3])
{
    vf n[3], v[3];
    vf_decode_normal(word, n);
    for (uint32_t k = 0; k < 3; k++)
        v[k] = vf_set(chunk->eye[k]) - vf_set(chunk->eye[3]) * p[k];
    vm away = vf_le((n[0] * v[0] + n[1] * v[1]) + n[2] * v[2], vf_zero());
    return vm_and(away, vm_not(vi_eq(vi_and(word, vi_set(PT_NORMAL_BITS)), vi_set(PT_NORMAL_NONE))));
}

// 1. Pixels and depths of points [first, last). What their pixels hold is asked for: a chunk's first points find it in memory.
static inline void project(const struct view_args *view, const struct window *w, struct target target,
                           const struct chunk_view *chunk, const float *positions, const uint32_t *surface, uint32_t first,
                           uint32_t last, struct block *block)
{
    uint32_t count = 0;
    for (uint32_t i = first; i < last; i += PT_LANES) {
        const vf p[3] = { vf_load(positions + i), vf_load(positions + chunk->padded + i),
                          vf_load(positions + 2 * (size_t)chunk->padded + i) };
        vf z = vf_transform(chunk, 2, p[0], p[1], p[2]);
        vf x = vf_transform(chunk, 0, p[0], p[1], p[2]), y = vf_transform(chunk, 1, p[0], p[1], p[2]);
        if (view->perspective) {
            vf r = vf_rcp(z);
            x = x * r;
            y = y * r;
        }
        // clip: NaN fails every comparison; what was sifted out is not drawn
        vm inside = vm_and(vm_and(vf_le(w->z_near, z), vf_le(z, w->z_far)),
                           vm_and(vm_and(vf_le(w->left, x), vf_lt(x, w->right)), vm_and(vf_le(w->bottom, y), vf_lt(y, w->top))));
        if (chunk->sifted)
            inside = vm_and(inside, vm_of_bits(target.drawn[chunk->sifted - 1 + i / PT_SLOTS_A_WORD] >> i % PT_SLOTS_A_WORD));
        if (chunk->cull)
            inside = vm_and(inside, vm_not(faces_away(chunk, vi_load(surface + i), p)));
        vi column = vi_sub(vf_int(vf_floor(x)), w->origin_x), row = vi_sub(vf_int(vf_floor(y)), w->origin_y);
        uint32_t lanes = vm_bits(inside);
        vi_pack(block->pixel + count, vi_add(vi_mul(row, w->width), column), lanes);
        vi_pack(block->z + count, vi_and(vf_bits(z), vi_set(0x7FFFFFFFu)), lanes); // no sign of -0
        vi_pack(block->id + count, vi_add(vi_set(chunk->id_base + chunk->first + i), vi_lanes()), lanes);
        count += (uint32_t)__builtin_popcount(lanes);
    }
    block->count = count;
    for (uint32_t i = 0; i < count && first < ASKED; i++)
        __builtin_prefetch(target.keys + block->pixel[i], 1);
}

// 2. Those stay that are nearer than what their pixel holds.
static inline void test_depths(struct target target, struct block *block)
{
    uint32_t count = 0;
    for (uint32_t at = 0; at < block->count; at += PT_LANES) {
        vm lanes = vm_first(block->count - at < PT_LANES ? block->count - at : PT_LANES);
        vi pixel = vi_load(block->pixel + at), z = vi_load(block->z + at), id = vi_load(block->id + at);
        if (target.limit)
            lanes = vm_and(lanes, vf_lt(vf_gather(target.limit, pixel, lanes), vi_float(z)));
        uint32_t nearer = vm_bits(vm_and(lanes, vm_not(vi_lt_unsigned(vi_gather_z(target.keys, pixel, lanes), z))));
        vi_pack(block->pixel + count, pixel, nearer);
        vi_pack(block->z + count, z, nearer);
        vi_pack(block->id + count, id, nearer);
        count += (uint32_t)__builtin_popcount(nearer);
    }
    block->count = count;
}

static void put(struct target target, struct block *block)
{
    if (target.shared || target.limit)
        test_depths(target, block);
    for (uint32_t i = 0, count = block->count; i < count; i++)
        store_least(target, block->pixel[i], (uint64_t)block->z[i] << 32 | block->id[i]);
}

static void scatter_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct scatter *scatter = context;
    const struct pt_cpu_call *call = scatter->call;
    const struct scatter_args *args = call->arguments;
    const struct target target = { .keys = pt_cpu_data(call, 0),
                                   .limit = args->behind ? pt_cpu_data(call, 1 + 3 * args->instances) : NULL,
                                   .drawn = args->sifted ? pt_cpu_data(call, 1 + 3 * args->instances + args->behind) : NULL,
                                   .shared = pt_pool_threads(call->pool) > 1 };
    const struct window window = window_of(scatter->view);
    struct block blocks[2]; // one is projected, then the one before it is put
    uint32_t instance = 0, count = 0;
    (void)thread;
    for (uint32_t c = begin; c < end && !pt_cpu_cancelled(call); c++) {
        while (c >= scatter->begins[instance + 1])
            instance++;
        const struct chunk_view *chunk = (const struct chunk_view *)pt_cpu_data(call, 1 + 3 * instance) + c - scatter->begins[instance];
        const float *positions = (const float *)pt_cpu_data(call, 2 + 3 * instance) + 3 * (size_t)chunk->first;
        const uint32_t *surface = (const uint32_t *)pt_cpu_data(call, 3 + 3 * instance) + chunk->first;
        for (uint32_t first = 0; first < chunk->count; first += BLOCK, count++) {
            const uint32_t last = chunk->count - first < BLOCK ? chunk->count : first + BLOCK;
            project(scatter->view, &window, target, chunk, positions, surface, first, last, &blocks[count % 2]);
            if (count)
                put(target, &blocks[(count - 1) % 2]);
        }
    }
    if (count)
        put(target, &blocks[(count - 1) % 2]);
}

int PT_KERNEL_ENTRY(scatter)(const struct pt_cpu_call *call)
{
    const struct scatter_args *args = call->arguments;
    uint32_t *begins = pt_cpu_scratch(call, 0, (args->instances + 1) * sizeof *begins);
    if (!begins)
        return PATINA_ERROR_MEMORY;
    begins[0] = 0;
    for (uint32_t i = 0; i < args->instances; i++)
        begins[i + 1] = begins[i] + (uint32_t)(call->buffers[1 + 3 * i]->size / sizeof(struct chunk_view));
    struct scatter scatter = { call, &args->view, begins };
    pt_parallel(call->pool, begins[args->instances], 4, scatter_chunks, &scatter);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
