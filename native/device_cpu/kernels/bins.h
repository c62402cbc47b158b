// SPDX-License-Identifier: GPL-3.0-or-later
// Points binned to the tiles of the picture that their discs may touch. Threads fill bins of their own, then take tiles: no
// pixel has two writers. What is done with the discs of a tile must not depend on their order. They come about nearest first, and
// those behind all that counts in their part of the tile not at all: of a torus, in 0.80 of the time.
#ifndef PT_BINS_H
#define PT_BINS_H

#include "disc.h"
#include "shade.h"

#include <stdatomic.h>
#include <stdlib.h>

enum { PT_BIN_SHIFT = 5 };
#define PT_BIN_NONE 0xFFFFFFFFu

// Discs: what a walk would else look up again, each number a cache miss.
struct pt_bin_block {
    uint32_t before; // as a head; all that were filled before are full
    uint32_t word[PT_BIN_DISCS];
    float place[PT_BIN_DISCS][4]; // x, y, z, and the bits of the id
    uint32_t order;               // of the chunk that it was opened for: later ones are nearer
    float nearest;                // no pixel of its discs is nearer
    uint32_t nothing[2];
};
_Static_assert(sizeof(struct pt_bin_block) == PT_BIN_BLOCK, "blocks of bins have another size");

struct pt_bin_thread {
    uint32_t next, end; // blocks that it may fill
    uint32_t order;     // of the chunk at hand
    uint32_t nothing[13];
};
_Static_assert(sizeof(struct pt_bin_thread) == PT_BIN_THREAD, "threads of bins take another room");

struct pt_bins {
    const struct pt_cpu_call *call;
    const struct view_args *view;
    const struct disc_args *discs;     // an instance each
    const uint32_t *drawn;             // bits of sifted chunks
    uint32_t instances, first, stride; // buffers of instance i start at first + i stride, as splat's do
    uint32_t columns, rows, bins;      // tiles, and one for the large
    uint32_t *cursors;                 // for each thread, of the heads of all
    uint32_t *heads;                   // by thread and bin: the block filled last << PT_BIN_SHIFT | discs in it
    struct pt_bin_block *blocks;
    uint32_t room; // blocks; behind them one for each thread, whose discs are lost
    _Atomic uint32_t used;
    // while they are filled
    uint32_t *begins; // see pt_chunk_begins
    uint64_t *order;  // of chunks, farthest first: their number below
    struct pt_bin_thread *threads;
};
_Static_assert(sizeof(struct pt_bins) <= PT_BIN_HEAD, "the head of bins is larger");

// Both kernels read the same of an instance, in the same order.
_Static_assert(PT_BUF_splat_positions - PT_BUF_splat_chunks == PT_BUF_blend_positions - PT_BUF_blend_chunks &&
                   PT_BUF_splat_surfels - PT_BUF_splat_chunks == PT_BUF_blend_surfels - PT_BUF_blend_chunks &&
                   PT_BUF_splat_radii - PT_BUF_splat_chunks == PT_BUF_blend_radii - PT_BUF_blend_chunks,
               "blend takes up splat's bins");

// of: PT_BUF_splat_*, of instance i.
static inline void *pt_bin_data(const struct pt_bins *bins, uint32_t of, uint32_t i)
{
    return pt_cpu_data(bins->call, bins->first + i * bins->stride + of - PT_BUF_splat_chunks);
}

// ---- filling -------------------------------------------------------------------------------------------------------------

static inline struct pt_disc_source pt_bin_source(const struct pt_bins *bins, uint32_t chunk, uint32_t *instance)
{
    *instance = pt_chunk_instance(bins->begins, chunk, *instance);
    const struct chunk_view *view = (const struct chunk_view *)pt_bin_data(bins, PT_BUF_splat_chunks, *instance) +
                                    (chunk - bins->begins[*instance]);
    return (struct pt_disc_source){bins->view,
                                   &bins->discs[*instance],
                                   view,
                                   pt_chunk_points(pt_bin_data(bins, PT_BUF_splat_positions, *instance), view),
                                   (const uint32_t *)pt_bin_data(bins, PT_BUF_splat_surfels, *instance) + view->first,
                                   pt_bin_data(bins, PT_BUF_splat_radii, *instance)};
}

// No pixel of a disc lies nearer: see pt_patch_show. In orthographic views slopes that cancel may be off by an eighth.
static inline vf pt_disc_nearest(const struct view_args *view, const struct pt_discs *d)
{
    return (d->z - d->radius * vf_set(view->perspective ? 1.002f : 1.25f)) * vf_set(0.999999f);
}

// Opens a block after the full one that ends at `head`. When there is no room it is the thread's own, and counted: all will be done
// again.
static inline struct pt_bin_block *pt_bin_open(struct pt_bins *bins, struct pt_bin_thread *thread, uint32_t *head)
{
    if (thread->next == thread->end) {
        thread->next = atomic_fetch_add_explicit(&bins->used, PT_BIN_SHARE, memory_order_relaxed);
        thread->end = thread->next + PT_BIN_SHARE;
    }
    uint32_t next = thread->next++;
    if (next >= bins->room)
        next = bins->room + (uint32_t)(thread - bins->threads);
    bins->blocks[next].before = *head;
    bins->blocks[next].order = thread->order;
    bins->blocks[next].nearest = pt_float(PT_KEY_EMPTY_Z);
    *head = next << PT_BIN_SHIFT;
    return bins->blocks + next;
}

static inline void pt_bin_put(struct pt_bins *bins, struct pt_bin_thread *thread, uint32_t *head, const float place[4],
                              uint32_t word, float nearest)
{
    struct pt_bin_block *block = bins->blocks + (*head >> PT_BIN_SHIFT);
    if (*head % (1u << PT_BIN_SHIFT) == PT_BIN_DISCS) // full, or none yet
        block = pt_bin_open(bins, thread, head);
    const uint32_t at = (*head)++ % (1u << PT_BIN_SHIFT);
    memcpy(block->place[at], place, 16);
    block->word[at] = word;
    block->nearest = pt_min(nearest, block->nearest);
}

// Points that are looked at before the first of their discs is put into its bin: no branch waits for their arithmetic.
enum { PT_BIN_BATCH = 256 };

// Some discs, and the tiles that their boxes touch.
struct pt_bin_batch {
    float places[PT_BIN_BATCH][4], nearest[PT_BIN_BATCH];
    uint32_t words[PT_BIN_BATCH], bins[PT_BIN_BATCH];                       // bins: the first
    uint32_t columns[PT_BIN_BATCH], rows[PT_BIN_BATCH];                     // of tiles, less one
    uint32_t drawn[PT_BIN_BATCH / PT_LANES], wide[PT_BIN_BATCH / PT_LANES]; // wide: over several tiles
};

static inline void pt_bin_list(const struct pt_bins *bins, struct pt_bin_batch *batch, uint32_t at,
                               const struct pt_discs *discs, vi id, vi word, uint32_t drawn)
{
    const vf place[4] = {discs->x, discs->y, discs->z, vi_float(id)};
    vi tiles[4];
    for (int k = 0; k < 4; k++)
        tiles[k] = vi_shr(discs->box[k], PT_DISC_TILE_SHIFT);
    const vi columns = vi_sub(tiles[2], tiles[0]), rows = vi_sub(tiles[3], tiles[1]);
    vf_store4(batch->places[at], place, PT_ALL);
    vi_store(batch->words + at, word);
    vf_store(batch->nearest + at, pt_disc_nearest(bins->view, discs));
    vi_store(batch->bins + at, vi_add(vi_mul(tiles[1], vi_set(bins->columns)), tiles[0]));
    vi_store(batch->columns + at, columns);
    vi_store(batch->rows + at, rows);
    batch->wide[at / PT_LANES] = drawn & ~vm_bits(vi_eq(vi_or(columns, rows), vi_set(0)));
    batch->drawn[at / PT_LANES] = drawn;
}

static void pt_bin_batch(struct pt_bins *bins, uint32_t thread, const struct pt_bin_batch *batch, uint32_t count)
{
    struct pt_bin_thread *own = bins->threads + thread;
    uint32_t *heads = bins->heads + (size_t)thread * bins->bins;
    for (uint32_t at = 0; at < count; at += PT_LANES) {
        for (uint32_t drawn = batch->drawn[at / PT_LANES] & ~batch->wide[at / PT_LANES]; drawn; drawn &= drawn - 1) {
            const uint32_t i = at + (uint32_t)__builtin_ctz(drawn);
            pt_bin_put(bins, own, heads + batch->bins[i], batch->places[i], batch->words[i], batch->nearest[i]);
        }
        for (uint32_t drawn = batch->wide[at / PT_LANES]; drawn; drawn &= drawn - 1) {
            const uint32_t i = at + (uint32_t)__builtin_ctz(drawn);
            if ((batch->columns[i] + 1) * (uint64_t)(batch->rows[i] + 1) > PT_DISC_LARGE) {
                pt_bin_put(bins, own, heads + bins->bins - 1, batch->places[i], batch->words[i], batch->nearest[i]);
                continue;
            }
            for (uint32_t y = 0; y <= batch->rows[i]; y++)
                for (uint32_t x = 0; x <= batch->columns[i]; x++)
                    pt_bin_put(bins, own, heads + batch->bins[i] + y * bins->columns + x, batch->places[i], batch->words[i],
                               batch->nearest[i]);
        }
    }
}

static void pt_bin_chunk(struct pt_bins *bins, uint32_t thread, const struct pt_disc_source *source)
{
    const struct chunk_view *chunk = source->chunk;
    struct pt_bin_batch batch;
    for (uint32_t i = 0; i < chunk->count; i += PT_LANES) {
        struct pt_discs discs;
        vf p[3];
        pt_load_points(chunk, source->points, i, p);
        pt_disc_project(source, p, vm_first(pt_lanes_left(i, chunk->count)), &discs);
        discs.id = vi_add(vi_set(chunk->first + i), vi_lanes());
        vi word = vi_load(source->surfels + i);
        pt_disc_cull(source, p, word, &discs);
        pt_disc_size(source->args, source->radii, discs.id, word, discs.drawn, &discs);
        pt_disc_reach(source->view, &discs);
        pt_disc_box(source->view, discs.low, discs.high, &discs);
        uint32_t drawn = vm_bits(discs.drawn);
        if (chunk->sifted)
            drawn &= bins->drawn[chunk->sifted - 1 + i / PT_SLOTS_A_WORD] >> i % PT_SLOTS_A_WORD;
        pt_bin_list(bins, &batch, i % PT_BIN_BATCH, &discs, vi_add(discs.id, vi_set(chunk->id_base)), word, drawn);
        if ((i + PT_LANES) % PT_BIN_BATCH == 0 || i + PT_LANES >= chunk->count)
            pt_bin_batch(bins, thread, &batch, i % PT_BIN_BATCH + PT_LANES);
    }
}

static void pt_bin_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct pt_bins *bins = context;
    uint32_t instance = 0;
    for (uint32_t c = begin; c < end && !pt_cpu_cancelled(bins->call); c++) {
        const struct pt_disc_source source = pt_bin_source(bins, (uint32_t)bins->order[c], &instance);
        bins->threads[thread].order = c;
        pt_bin_chunk(bins, thread, &source);
    }
}

static int pt_bin_farther(const void *a, const void *b)
{
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return x < y ? 1 : x > y ? -1 : 0;
}

// Orders chunks by the depth of their first points, which stands for all.
static inline void pt_bin_sort(struct pt_bins *bins)
{
    const uint32_t count = bins->begins[bins->instances];
    uint32_t instance = 0;
    for (uint32_t c = 0; c < count; c++) {
        const struct pt_disc_source source = pt_bin_source(bins, c, &instance);
        const struct chunk_view *chunk = source.chunk;
        const float *r = chunk->row + 6;
        float p[3], z = 0.0f;
        if (chunk->count) {
            pt_load_point(chunk, source.points, 0, p);
            z = r[0] * p[0] + r[1] * p[1] + r[2] * p[2] + chunk->hi[2];
        }
        bins->order[c] = (uint64_t)(z > 0.0f ? pt_bits(z) : 0) << 32 | c;
        if (c % 16 == 0)
            pt_pool_look(bins->call->pool);
    }
    qsort(bins->order, count, sizeof *bins->order, pt_bin_farther);
}

// Whether the buffer has room for so many blocks. If not, that is what it wants, and an eighth more: who takes which block, and so
// leaves some of it empty, is another thread each time.
static inline int pt_bins_have(const struct pt_bins *bins, struct pt_buffer *buffer, uint64_t blocks)
{
    const uint32_t threads = pt_pool_threads(bins->call->pool);
    const int enough = buffer->size >= pt_bins_bytes(bins->bins, threads, blocks);
    buffer->wanted = enough ? 0 : pt_bins_bytes(bins->bins, threads, blocks + blocks / 8 + (uint64_t)threads * PT_BIN_SHARE);
    return enough;
}

// Lays them out in their buffer: themselves first, for blend.
static inline void pt_bins_lay_out(struct pt_bins *bins, const struct pt_buffer *buffer)
{
    const uint32_t threads = pt_pool_threads(bins->call->pool), most = (PT_BIN_NONE >> PT_BIN_SHIFT) - threads;
    const size_t fixed = pt_bins_bytes(bins->bins, threads, 0), room = (buffer->size - fixed) / PT_BIN_BLOCK;
    char *memory = (char *)buffer->data + PT_BIN_HEAD;
    bins->room = room < most ? (uint32_t)room : most;
    bins->threads = (struct pt_bin_thread *)(void *)memory;
    bins->heads = (uint32_t *)(void *)(bins->threads + threads);
    bins->cursors = bins->heads + (size_t)threads * bins->bins;
    bins->blocks = (struct pt_bin_block *)(void *)((char *)buffer->data + fixed - (size_t)threads * PT_BIN_BLOCK);
    memset(bins->threads, 0, (size_t)((char *)bins->blocks - memory));
    memset(bins->heads, 0xFF, (size_t)((char *)bins->blocks - (char *)bins->heads));
    atomic_store(&bins->used, 0);
}

// Fills the bins. PATINA_OK, PATINA_ERROR_MEMORY, PATINA_ERROR_CANCELLED, or PT_MORE_ROOM where their buffer lacks some.
static inline int pt_bins_fill(struct pt_bins *bins, struct pt_buffer *buffer)
{
    bins->columns = (bins->view->width + PT_DISC_TILE - 1) / PT_DISC_TILE;
    bins->rows = (bins->view->height + PT_DISC_TILE - 1) / PT_DISC_TILE;
    bins->bins = pt_bins_of(bins->view);
    if (!pt_bins_have(bins, buffer, 0))
        return PT_MORE_ROOM;
    pt_bins_lay_out(bins, buffer);
    uint64_t chunks = 0;
    for (uint32_t i = 0; i < bins->instances; i++)
        chunks += bins->call->buffers[bins->first + i * bins->stride]->size / sizeof(struct chunk_view);
    bins->order = pt_cpu_scratch(bins->call, 0,
                                 chunks * sizeof *bins->order + ((size_t)bins->instances + 1) * sizeof *bins->begins);
    if (!bins->order)
        return PATINA_ERROR_MEMORY;
    bins->begins = (uint32_t *)(void *)(bins->order + chunks);
    pt_chunk_begins(bins->call, bins->first, bins->stride, bins->instances, bins->begins);
    pt_bin_sort(bins);
    pt_parallel(bins->call->pool, bins->begins[bins->instances], 4, pt_bin_chunks, bins);
    if (pt_cpu_cancelled(bins->call))
        return PATINA_ERROR_CANCELLED;
    const uint32_t used = atomic_load(&bins->used);
    if (used > (PT_BIN_NONE >> PT_BIN_SHIFT) - pt_pool_threads(bins->call->pool))
        return PATINA_ERROR_MEMORY; // blocks have no more numbers
    if (!pt_bins_have(bins, buffer, used))
        return PT_MORE_ROOM;
    memcpy(buffer->data, bins, sizeof *bins);
    return PATINA_OK;
}

// Takes up the bins that splat filled with the same discs.
static inline void pt_bins_again(struct pt_bins *bins, const struct pt_buffer *buffer)
{
    const struct pt_bins *filled = buffer->data;
    bins->columns = filled->columns;
    bins->rows = filled->rows;
    bins->bins = filled->bins;
    bins->heads = filled->heads;
    bins->cursors = filled->cursors;
    bins->blocks = filled->blocks;
}

// ---- tiles ---------------------------------------------------------------------------------------------------------------

// How far away discs may lie and still count, by cells of 8 x 8 pixels.
enum { PT_CELL_SHIFT = 3, PT_CELLS = PT_DISC_TILE >> PT_CELL_SHIFT };
struct pt_farthest {
    float all;
    float cell[PT_CELLS * PT_CELLS];      // with those right of it and above
    float column[PT_CELLS][PT_DISC_TILE]; // by rows of cells: while they are filled
};

// Of `column`, the greatest of each column of a row of cells, makes the rest.
static inline void pt_farthest_end(struct pt_farthest *out)
{
    float cells[PT_CELLS][PT_CELLS];
    out->all = 0.0f;
    for (int y = 0; y < PT_CELLS; y++)
        for (int x = 0; x < PT_CELLS; x++) {
            const float *from = out->column[y] + (x << PT_CELL_SHIFT);
            float most = from[0];
            for (int i = 1; i < 1 << PT_CELL_SHIFT; i++)
                most = pt_max(from[i], most);
            cells[y][x] = most;
            out->all = pt_max(most, out->all);
        }
    for (int y = 0; y < PT_CELLS; y++)
        for (int x = 0; x < PT_CELLS; x++) {
            const int up = y + 1 < PT_CELLS ? y + 1 : y, right = x + 1 < PT_CELLS ? x + 1 : x;
            out->cell[y * PT_CELLS + x] = pt_max(pt_max(cells[y][x], cells[y][right]), pt_max(cells[up][x], cells[up][right]));
        }
}

// Takes out of drawn what lies beside the tile, or behind all that counts there.
static inline void pt_farthest_cull(const struct pt_farthest *farthest, const struct view_args *view, struct pt_disc_tile tile,
                                    struct pt_discs *d)
{
    const vi tile_x = vi_set((uint32_t)tile.x), tile_y = vi_set((uint32_t)tile.y);
    const vi x0 = vi_sub(vi_select(vi_lt_unsigned(d->box[0], tile_x), tile_x, d->box[0]), tile_x);
    const vi y0 = vi_sub(vi_select(vi_lt_unsigned(d->box[1], tile_y), tile_y, d->box[1]), tile_y);
    const vi x1 = vi_sub(d->box[2], tile_x), y1 = vi_sub(d->box[3], tile_y); // beyond the tile, or before it and so far below 0
    const vm beside = vm_or(
        vm_or(vi_lt_unsigned(x1, x0), vi_lt_unsigned(y1, y0)),
        vm_or(vi_lt_unsigned(vi_set((uint32_t)tile.width - 1), x0), vi_lt_unsigned(vi_set((uint32_t)tile.height - 1), y0)));
    const vi column = vi_shr(x0, PT_CELL_SHIFT), row = vi_shr(y0, PT_CELL_SHIFT), two = vi_set(2);
    const vm small = vm_and(vi_lt_unsigned(vi_sub(vi_shr(x1, PT_CELL_SHIFT), column), two),
                            vi_lt_unsigned(vi_sub(vi_shr(y1, PT_CELL_SHIFT), row), two));
    d->drawn = vm_and(d->drawn, vm_not(beside));
    const vi cell = vi_add(vi_mul(row, vi_set(PT_CELLS)), column);
    const vf far = vf_select(small, vf_gather(farthest->cell, cell, vm_and(d->drawn, small)), vf_set(farthest->all));
    d->drawn = vm_and(d->drawn, vm_not(vf_lt(far, pt_disc_nearest(view, d))));
}

// What is done with PT_LANES discs of an instance.
typedef void pt_bin_work(void *context, uint32_t instance, const struct pt_discs *discs);

// The instance that an id belongs to.
static inline uint32_t pt_bin_instance(const struct pt_bins *bins, uint32_t id, uint32_t instance)
{
    while (!pt_is_of(&bins->discs[instance].instance, id - bins->discs[instance].instance.id_base))
        instance = instance + 1 < bins->instances ? instance + 1 : 0;
    return instance;
}

static inline uint32_t pt_bin_id(const struct pt_bin_block *block, uint32_t i) { return pt_bits(block->place[i][3]); }

// Asks for the block before one that was asked for, and for the colours of this one's discs.
static inline void pt_bin_ask(const struct pt_bins *bins, const struct pt_bin_block *block, int colors)
{
    const char *before = (const char *)(bins->blocks + (block->before == PT_BIN_NONE ? 0 : block->before >> PT_BIN_SHIFT));
    for (size_t i = 0; i < sizeof *block; i += 64)
        __builtin_prefetch(before + i);
    for (uint32_t i = 0, instance = 0; i < PT_BIN_DISCS && colors; i++) {
        instance = pt_bin_instance(bins, pt_bin_id(block, i), instance);
        const struct instance_args *args = &bins->discs[instance].instance;
        const char *of = PT_DATA_EACH(bins->call, blend, colors, instance);
        if (of) // a cloud without colours
            __builtin_prefetch(of + pt_color_bytes[args->color_format] * (pt_bin_id(block, i) - args->id_base));
    }
}

// Calls work for some discs of a block, PT_LANES from i on of those before `end` that belong to the same instance; returns
// where the next begin.
static inline __attribute__((always_inline)) uint32_t
pt_bin_some(const struct pt_bins *bins, const struct pt_bin_block *block, uint32_t i, uint32_t end, uint32_t *instance,
            const struct pt_disc_tile *tile, const struct pt_farthest *farthest, pt_bin_work *work, void *context)
{
    *instance = pt_bin_instance(bins, pt_bin_id(block, i), *instance);
    const struct disc_args *args = &bins->discs[*instance];
    const void *radii = pt_bin_data(bins, PT_BUF_splat_radii, *instance);
    const uint32_t count = pt_lanes_left(i, end);
    const vi word = vi_load(block->word + i);
    struct pt_discs discs;
    vf place[4];
    vf_load4(block->place[i], place);
    discs.x = place[0];
    discs.y = place[1];
    discs.z = place[2];
    discs.id = vi_sub(vf_bits(place[3]), vi_set(args->instance.id_base));
    const uint32_t others = vm_bits(
        vm_and(vm_first(count), vm_not(pt_has_ids(discs.id, args->instance.id_first, args->instance.id_count))));
    const uint32_t taken = others ? (uint32_t)__builtin_ctz(others) : count;
    discs.drawn = vm_first(taken);
    pt_disc_size(args, radii, discs.id, word, discs.drawn, &discs);
    pt_disc_reach(bins->view, &discs);
    pt_disc_box(bins->view, discs.low, discs.high, &discs);
    pt_farthest_cull(farthest, bins->view, *tile, &discs);
    if (!vm_bits(discs.drawn))
        return i + taken;
    pt_disc_shape(bins->view, args, word, &discs);
    pt_disc_tight_box(bins->view, &discs);
    work(context, *instance, &discs);
    return i + taken;
}

// The nearest block of those that the cursors of all threads stand at; NULL: there is none.
static inline uint32_t *pt_bin_next(const struct pt_bins *bins, uint32_t *cursors, uint32_t threads)
{
    uint32_t *next = NULL;
    for (uint32_t k = 0; k < threads; k++)
        if (cursors[k] != PT_BIN_NONE &&
            (!next || bins->blocks[cursors[k] >> PT_BIN_SHIFT].order > bins->blocks[*next >> PT_BIN_SHIFT].order))
            next = cursors + k;
    return next;
}

// Calls work for the discs of a bin that may lie on the tile and no farther than what counts, up to PT_LANES at a time, about
// nearest first. colors: 1 where it looks those up.
static inline __attribute__((always_inline)) void pt_bin_walk(const struct pt_bins *bins, uint32_t thread, uint32_t bin,
                                                              const struct pt_disc_tile *tile,
                                                              const struct pt_farthest *farthest, int colors, pt_bin_work *work,
                                                              void *context)
{
    const uint32_t threads = pt_pool_threads(bins->call->pool);
    uint32_t instance = 0, *cursors = bins->cursors + (size_t)thread * threads, *next;
    for (uint32_t k = 0; k < threads; k++)
        cursors[k] = bins->heads[(size_t)k * bins->bins + bin];
    while ((next = pt_bin_next(bins, cursors, threads))) {
        const struct pt_bin_block *block = bins->blocks + (*next >> PT_BIN_SHIFT);
        const uint32_t end = *next % (1u << PT_BIN_SHIFT);
        const struct pt_bin_block *before = bins->blocks + (block->before >> PT_BIN_SHIFT);
        if (block->before != PT_BIN_NONE && !(farthest->all < before->nearest))
            pt_bin_ask(bins, before, colors);
        for (uint32_t i = 0; i < end && !(farthest->all < block->nearest);)
            i = pt_bin_some(bins, block, i, end, &instance, tile, farthest, work, context);
        *next = block->before;
    }
}

// A tile's pixels in the window.
static inline struct pt_disc_tile pt_bin_tile(const struct pt_bins *bins, uint32_t tile)
{
    const uint32_t x = tile % bins->columns * PT_DISC_TILE, y = tile / bins->columns * PT_DISC_TILE;
    const uint32_t width = bins->view->width - x, height = bins->view->height - y;
    return (struct pt_disc_tile){(int32_t)x, (int32_t)y, (int32_t)(width < PT_DISC_TILE ? width : PT_DISC_TILE),
                                 (int32_t)(height < PT_DISC_TILE ? height : PT_DISC_TILE)};
}

static inline int pt_bin_empty(const struct pt_bins *bins, uint32_t bin)
{
    for (uint32_t thread = 0; thread < pt_pool_threads(bins->call->pool); thread++)
        if (bins->heads[(size_t)thread * bins->bins + bin] != PT_BIN_NONE)
            return 0;
    return 1;
}

#endif
