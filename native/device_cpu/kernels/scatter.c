// SPDX-License-Identifier: GPL-3.0-or-later
// scatter: points -> least key a pixel. [D 3.1]; twin of shaders/kernels/scatter.comp
//
// What faces away leaves first: the words of a chunk's points lie side by side. Threads share the plane, and a chunk's points
// fall into few of its rows: every thread has a stripe of rows, and first takes the chunks within, whose keys nobody else
// stores. What is left when one has done that, chunks across stripes too, is stored by compare-and-swap (9 cycles), after a
// gathered depth test. 1M points on two cores: 1.2 ms in place of 1.5. The minimum commutes, so neither threads nor batches
// show.
#include "device_cpu/cpu.h"
#include "device_cpu/points.h"
#include "hidden.h"
#include "shared/points.h"

enum { BINS = 256 }; // of rows
// Steps of z from which on, eight times as far, chunks are put in order: less deep, what lies beside each other stays so.
enum { DEEP = 7 };

struct stripe { // its chunks, of scatter.order
    uint32_t next, end;
};

struct scatter {
    const struct pt_cpu_call *call;
    const struct scatter_args *args;
    uint32_t *begins;       // see pt_chunk_begins
    struct stripe *stripes; // one a thread, and one of those last
    uint32_t *order;        // chunks by stripes, from near to far; last those across several
    uint32_t *by_depth;     // all of them
    struct pt_tiles tiles;  // of keys
    atomic_int over;        // a stripe is done
};

struct target {
    uint64_t *keys;
    const float *limit;    // only what lies beyond counts; NULL: everything
    const uint32_t *drawn; // bits of sifted chunks
    int shared;            // by several threads
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
    struct pt_window window;
    vi origin_x, origin_y, width;
};

static struct window window_of(const struct view_args *view)
{
    return (struct window){
        .window = pt_window_rows(view, (float)view->origin_y, (float)(view->origin_y + (int32_t)view->height)),
        .origin_x = vi_set((uint32_t)view->origin_x),
        .origin_y = vi_set((uint32_t)view->origin_y),
        .width = vi_set(view->width)};
}

// 1. Pixels and depths of points [first, last). What their pixels hold is asked for: a chunk's first points find it in memory.
// Written once for packed ones and once for others: of these it takes as many instructions as if there were no packed ones, not 4 % more.
static inline __attribute__((always_inline)) void project(int packed, const struct view_args *view, const struct window *w,
                                                          struct target target, const struct chunk_view *chunk,
                                                          const uint32_t *points, const uint32_t *surfels, uint32_t first,
                                                          uint32_t last, struct block *block)
{
    uint32_t count = 0;
    for (uint32_t i = first; i < last; i += PT_LANES) {
        vf p[3], at[3];
        pt_load_points_as(packed, chunk, points, i, p);
        pt_project(view, chunk, p, at);
        vm inside = pt_keep_drawn(chunk, target.drawn, i, pt_within(&w->window, at));
        if (chunk->cull)
            inside = vm_and(inside, vm_not(pt_faces_away(chunk, vi_load(surfels + i), p)));
        vi column = vi_sub(vf_int(vf_floor(at[0])), w->origin_x), row = vi_sub(vf_int(vf_floor(at[1])), w->origin_y);
        uint32_t lanes = vm_bits(inside);
        vi_pack(block->pixel + count, vi_add(vi_mul(row, w->width), column), lanes);
        vi_pack(block->z + count, vi_and(vf_bits(at[2]), vi_set(0x7FFFFFFFu)), lanes); // no sign of -0
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

struct walk { // over chunks
    struct target target;
    struct window window;
    uint32_t instance, count;
    struct block blocks[2]; // one is projected, then the one before it is put
};

static void begin_walk(const struct scatter *scatter, int shared, struct walk *walk)
{
    const struct pt_cpu_call *call = scatter->call;
    walk->target = (struct target){.keys = PT_DATA(call, scatter, keys),
                                   .limit = scatter->args->behind ? PT_DATA(call, scatter, limit) : NULL,
                                   .drawn = scatter->args->sifted ? PT_DATA(call, scatter, drawn) : NULL,
                                   .shared = shared};
    walk->window = window_of(&scatter->args->view);
    walk->instance = walk->count = 0;
}

static const struct chunk_view *chunk_at(const struct scatter *scatter, uint32_t c, uint32_t *instance)
{
    *instance = pt_chunk_instance(scatter->begins, c, *instance);
    return (const struct chunk_view *)PT_DATA_EACH(scatter->call, scatter, chunks, *instance) + c - scatter->begins[*instance];
}

static void walk_chunk(const struct scatter *scatter, uint32_t c, struct walk *walk)
{
    const struct chunk_view *chunk = chunk_at(scatter, c, &walk->instance);
    if (pt_is_hidden(chunk, &scatter->tiles))
        return;
    const struct view_args *view = &scatter->args->view;
    const uint32_t *points = pt_chunk_points(PT_DATA_EACH(scatter->call, scatter, positions, walk->instance), chunk);
    const uint32_t *surfels = (const uint32_t *)PT_DATA_EACH(scatter->call, scatter, surfels, walk->instance) + chunk->first;
    for (uint32_t first = 0; first < chunk->count; first += BLOCK, walk->count++) {
        const uint32_t last = chunk->count - first < BLOCK ? chunk->count : first + BLOCK;
        struct block *block = &walk->blocks[walk->count % 2];
        if (chunk->step > 0.0f)
            project(1, view, &walk->window, walk->target, chunk, points, surfels, first, last, block);
        else
            project(0, view, &walk->window, walk->target, chunk, points, surfels, first, last, block);
        if (walk->count)
            put(walk->target, &walk->blocks[(walk->count - 1) % 2]);
    }
}

static void end_walk(struct walk *walk)
{
    if (walk->count)
        put(walk->target, &walk->blocks[(walk->count - 1) % 2]);
}

static void scatter_stripes(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct scatter *scatter = context;
    struct walk walk;
    (void)thread;
    for (uint32_t s = begin; s < end; s++) {
        uint32_t i = scatter->stripes[s].next;
        begin_walk(scatter, 0, &walk);
        for (; i < scatter->stripes[s].end && !atomic_load_explicit(&scatter->over, memory_order_relaxed) &&
               !pt_cpu_cancelled(scatter->call);
             i++)
            walk_chunk(scatter, scatter->order[i], &walk);
        end_walk(&walk);
        scatter->stripes[s].next = i;
        atomic_store_explicit(&scatter->over, 1, memory_order_relaxed);
    }
}

static void scatter_rest(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct scatter *scatter = context;
    struct walk walk;
    (void)thread;
    begin_walk(scatter, 1, &walk);
    for (uint32_t i = begin; i < end && !pt_cpu_cancelled(scatter->call); i++)
        walk_chunk(scatter, scatter->order[i], &walk);
    end_walk(&walk);
}

// ---- who takes which chunks --------------------------------------------------------------------------------------------

static uint32_t bin_of(const struct view_args *view, uint32_t row) { return (uint32_t)((uint64_t)row * BINS / view->height); }

// The stripes of bins: as many points in each.
static void divide_rows(const struct scatter *scatter, uint32_t chunks, uint32_t stripes, uint16_t stripe_of[BINS])
{
    uint64_t points[BINS] = {0}, all = 1, before = 0;
    for (uint32_t c = 0, instance = 0; c < chunks; c++) {
        const struct chunk_view *chunk = chunk_at(scatter, c, &instance);
        points[bin_of(&scatter->args->view, (chunk->row_first + chunk->row_end) / 2)] += chunk->count;
        all += chunk->count;
    }
    for (uint32_t bin = 0; bin < BINS; before += points[bin++])
        stripe_of[bin] = (uint16_t)((before + points[bin] / 2) * stripes / all);
}

// Of those of a chunk; `stripes` for one across several.
static uint32_t stripe_of_chunk(const struct scatter *scatter, const struct chunk_view *chunk, uint32_t stripes,
                                const uint16_t stripe_of[BINS])
{
    const struct view_args *view = &scatter->args->view;
    uint32_t end = chunk->row_end ? chunk->row_end : view->height;
    uint32_t first = stripe_of[bin_of(view, chunk->row_first)], last = stripe_of[bin_of(view, end - 1)];
    return first == last ? first : stripes;
}

// From near to far, so that what lies behind finds the keys of what hides it; within a step those beside each other stay so.
static void order_chunks(const struct scatter *scatter, uint32_t chunks)
{
    uint32_t next[PT_DEPTHS + 1] = {0};
    for (uint32_t c = 0, instance = 0; c < chunks; c++)
        next[pt_depth_step(chunk_at(scatter, c, &instance)) + 1]++;
    uint32_t first = 1, last = PT_DEPTHS - 1; // of those that are known
    while (first < last && !next[first + 1])
        first++;
    while (last > first && !next[last + 1])
        last--;
    if (last - first < DEEP) {
        for (uint32_t c = 0; c < chunks; c++)
            scatter->by_depth[c] = c;
        return;
    }
    for (uint32_t depth = 0; depth < PT_DEPTHS; depth++)
        next[depth + 1] += next[depth];
    for (uint32_t c = 0, instance = 0; c < chunks; c++)
        scatter->by_depth[next[pt_depth_step(chunk_at(scatter, c, &instance))]++] = c;
}

static void sort_chunks(struct scatter *scatter, uint32_t chunks, uint32_t stripes)
{
    uint16_t stripe_of[BINS];
    divide_rows(scatter, chunks, stripes, stripe_of);
    memset(scatter->stripes, 0, (stripes + 1) * sizeof *scatter->stripes);
    for (uint32_t c = 0, instance = 0; c < chunks; c++)
        scatter->stripes[stripe_of_chunk(scatter, chunk_at(scatter, c, &instance), stripes, stripe_of)].end++;
    for (uint32_t s = 0, first = 0; s <= stripes; s++) {
        scatter->stripes[s].next = first;
        first += scatter->stripes[s].end;
        scatter->stripes[s].end = scatter->stripes[s].next;
    }
    order_chunks(scatter, chunks);
    for (uint32_t i = 0, instance = 0; i < chunks; i++) {
        const uint32_t c = scatter->by_depth[i];
        struct stripe *stripe =
            &scatter->stripes[stripe_of_chunk(scatter, chunk_at(scatter, c, &instance), stripes, stripe_of)];
        scatter->order[stripe->end++] = c;
    }
}

int PT_KERNEL_ENTRY(scatter)(const struct pt_cpu_call *call)
{
    const struct scatter_args *args = call->arguments;
    const uint32_t stripes = pt_pool_threads(call->pool);
    struct scatter scatter = {.call = call, .args = args};
    uint32_t left = 0;
    scatter.begins = pt_cpu_scratch(call, 0, ((size_t)args->instances + 1) * sizeof *scatter.begins);
    if (!scatter.begins)
        return PATINA_ERROR_MEMORY;
    pt_chunk_begins(call, PT_BUF_scatter_chunks, PT_EACH_scatter, args->instances, scatter.begins);
    const uint32_t chunks = scatter.begins[args->instances];
    const size_t tiles = pt_tile_count(args->view.width, args->view.height);
    scatter.stripes = pt_cpu_scratch(
        call, 1, (stripes + 1) * sizeof *scatter.stripes + (2 * (size_t)chunks + tiles) * sizeof *scatter.order);
    if (!scatter.stripes)
        return PATINA_ERROR_MEMORY;
    scatter.order = (uint32_t *)(void *)(scatter.stripes + stripes + 1);
    scatter.by_depth = scatter.order + chunks;
    pt_tiles_begin(PT_DATA(call, scatter, keys), args->view.width, args->view.height, scatter.by_depth + chunks,
                   &scatter.tiles);
    sort_chunks(&scatter, chunks, stripes);
    pt_parallel(call->pool, stripes, 1, scatter_stripes, &scatter);
    for (uint32_t s = 0; s <= stripes; s++)
        for (uint32_t i = scatter.stripes[s].next; i < scatter.stripes[s].end; i++)
            scatter.order[left++] = scatter.order[i];
    pt_parallel(call->pool, left, 4, scatter_rest, &scatter);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
