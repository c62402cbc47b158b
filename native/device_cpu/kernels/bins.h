// SPDX-License-Identifier: GPL-3.0-or-later
// Points binned to the tiles of the picture that their discs may touch. Threads fill bins of their own, then take tiles: no
// pixel has two writers. What is done with the discs of a tile must not depend on their order.
#ifndef PT_BINS_H
#define PT_BINS_H

#include "disc.h"
#include "shade.h"

#include <stdatomic.h>

enum {
    PT_DISC_LARGE = 16,      // a disc over more tiles than this goes to a bin that every tile looks through
    PT_BIN_ENTRIES = 63,
    PT_BIN_CHUNK_SHIFT = 12, // an entry: chunk of the list of all chunks, slot in the chunk
};
#define PT_BIN_NONE 0xFFFFFFFFu

struct pt_bin_block {
    uint32_t before, count, entries[PT_BIN_ENTRIES], words[PT_BIN_ENTRIES]; // and their surface words
};

struct pt_bins {
    const struct pt_cpu_call *call;
    const struct view_args *view;
    const struct disc_args *discs; // an instance each
    const uint32_t *drawn;         // bits of sifted chunks
    uint32_t instances, first, stride; // buffers of instance i start at first + i stride: chunks, positions, surface, radii
    uint32_t columns, rows, bins;      // tiles, and one for the large
    uint32_t *begins;                  // first chunk of each instance in the list of all chunks
    uint32_t *heads;                   // by thread and bin: the block filled last
    struct pt_bin_block *blocks;
    uint32_t room;
    _Atomic uint32_t used;
};

static inline struct pt_disc_source pt_bin_source(const struct pt_bins *bins, uint32_t chunk, uint32_t *instance)
{
    uint32_t i = *instance;
    while (chunk < bins->begins[i])
        i--;
    while (chunk >= bins->begins[i + 1])
        i++;
    *instance = i;
    const uint32_t at = bins->first + i * bins->stride;
    const struct chunk_view *view = (const struct chunk_view *)pt_cpu_data(bins->call, at) + (chunk - bins->begins[i]);
    return (struct pt_disc_source){ bins->view,
                                    &bins->discs[i],
                                    view,
                                    (const float *)pt_cpu_data(bins->call, at + 1) + 3 * (size_t)view->first,
                                    pt_cpu_data(bins->call, at + 2),
                                    pt_cpu_data(bins->call, at + 3) };
}

static inline void pt_bin_put(struct pt_bins *bins, uint32_t *heads, uint32_t bin, uint32_t entry, uint32_t word)
{
    uint32_t head = heads[bin];
    if (head == PT_BIN_NONE || bins->blocks[head].count == PT_BIN_ENTRIES) {
        uint32_t block = atomic_fetch_add_explicit(&bins->used, 1, memory_order_relaxed);
        if (block >= bins->room)
            return; // counted: it will be done again with more room
        bins->blocks[block].before = head;
        bins->blocks[block].count = 0;
        heads[bin] = head = block;
    }
    struct pt_bin_block *block = &bins->blocks[head];
    block->words[block->count] = word;
    block->entries[block->count++] = entry;
}

static inline void pt_bin_disc(struct pt_bins *bins, uint32_t *heads, const int32_t box[4], uint32_t entry, uint32_t word)
{
    uint32_t x0 = (uint32_t)box[0] / PT_DISC_TILE, y0 = (uint32_t)box[1] / PT_DISC_TILE;
    uint32_t x1 = (uint32_t)box[2] / PT_DISC_TILE, y1 = (uint32_t)box[3] / PT_DISC_TILE;
    if ((uint64_t)(x1 - x0 + 1) * (y1 - y0 + 1) > PT_DISC_LARGE) {
        pt_bin_put(bins, heads, bins->bins - 1, entry, word);
        return;
    }
    for (uint32_t y = y0; y <= y1; y++)
        for (uint32_t x = x0; x <= x1; x++)
            pt_bin_put(bins, heads, y * bins->columns + x, entry, word);
}

static void pt_bin_chunk(struct pt_bins *bins, uint32_t *heads, const struct pt_disc_source *source, uint32_t c)
{
    const uint32_t count = source->chunk->count;
    for (uint32_t i = 0; i < count; i += PT_LANES) {
        struct pt_discs discs;
        int32_t box[4][PT_LANES];
        uint32_t words[PT_LANES];
        vf p[3];
        for (uint32_t k = 0; k < 3; k++)
            p[k] = vf_load(source->positions + (size_t)k * source->chunk->padded + i);
        pt_disc_project(source, p, vm_first(pt_lanes_left(i, count)), &discs);
        discs.id = vi_add(vi_set(source->chunk->first + i), vi_lanes());
        vi word = vi_load(source->surface + source->chunk->first + i);
        pt_disc_cull(source, p, word, &discs);
        pt_disc_size(source, word, &discs);
        uint32_t drawn = vm_bits(discs.drawn);
        if (source->chunk->sifted)
            drawn &= bins->drawn[source->chunk->sifted - 1 + i / PT_SLOTS_A_WORD] >> i % PT_SLOTS_A_WORD;
        if (!drawn)
            continue;
        for (int k = 0; k < 4; k++)
            vi_store(box[k], discs.box[k], vm_first(PT_LANES));
        vi_store(words, word, vm_first(PT_LANES));
        for (; drawn; drawn &= drawn - 1) {
            uint32_t k = (uint32_t)__builtin_ctz(drawn);
            const int32_t one[4] = { box[0][k], box[1][k], box[2][k], box[3][k] };
            pt_bin_disc(bins, heads, one, c << PT_BIN_CHUNK_SHIFT | (i + k), words[k]);
        }
    }
}

static void pt_bin_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct pt_bins *bins = context;
    uint32_t *heads = bins->heads + (size_t)thread * bins->bins, instance = 0;
    for (uint32_t c = begin; c < end && !pt_cpu_cancelled(bins->call); c++) {
        const struct pt_disc_source source = pt_bin_source(bins, c, &instance);
        pt_bin_chunk(bins, heads, &source, c);
    }
}

// Fills the bins; scratch 0 holds them. PATINA_OK, PATINA_ERROR_MEMORY or PATINA_ERROR_CANCELLED.
static inline int pt_bins_fill(struct pt_bins *bins)
{
    const uint32_t threads = pt_pool_threads(bins->call->pool);
    bins->columns = (bins->view->width + PT_DISC_TILE - 1) / PT_DISC_TILE;
    bins->rows = (bins->view->height + PT_DISC_TILE - 1) / PT_DISC_TILE;
    bins->bins = bins->columns * bins->rows + 1;
    const size_t begin_bytes = ((size_t)bins->instances + 1) * 4, head_bytes = (size_t)threads * bins->bins * 4;
    for (uint32_t needed = 1024;;) {
        char *memory = pt_cpu_scratch(bins->call, 0, begin_bytes + head_bytes + (size_t)needed * sizeof *bins->blocks);
        if (!memory)
            return PATINA_ERROR_MEMORY;
        size_t size = bins->call->scratch[0].size - begin_bytes - head_bytes; // what an earlier picture needed is there still
        bins->room = (uint32_t)(size / sizeof *bins->blocks < PT_BIN_NONE ? size / sizeof *bins->blocks : PT_BIN_NONE);
        bins->blocks = (struct pt_bin_block *)(void *)memory;
        bins->begins = (uint32_t *)(void *)(memory + (size_t)bins->room * sizeof *bins->blocks);
        bins->heads = bins->begins + bins->instances + 1;
        bins->begins[0] = 0;
        for (uint32_t i = 0; i < bins->instances; i++)
            bins->begins[i + 1] = bins->begins[i] + (uint32_t)(bins->call->buffers[bins->first + i * bins->stride]->size /
                                                               sizeof(struct chunk_view));
        memset(bins->heads, 0xFF, head_bytes);
        atomic_store(&bins->used, 0);
        pt_parallel(bins->call->pool, bins->begins[bins->instances], 4, pt_bin_chunks, bins);
        if (pt_cpu_cancelled(bins->call))
            return PATINA_ERROR_CANCELLED;
        needed = atomic_load(&bins->used);
        if (needed <= bins->room)
            return PATINA_OK;
        needed += needed / 4;
    }
}

// What is done with PT_LANES discs of an instance.
typedef void pt_bin_work(void *context, uint32_t instance, const struct pt_discs *discs);

// Asks for what the discs of a block are looked up by: each colour is a cache miss of its own.
static inline void pt_bin_ask(const struct pt_bins *bins, const struct pt_bin_block *block, uint32_t instance, int colors)
{
    for (uint32_t i = 0; i < block->count && colors; i++) {
        const struct pt_disc_source source = pt_bin_source(bins, block->entries[i] >> PT_BIN_CHUNK_SHIFT, &instance);
        const char *color = pt_cpu_data(bins->call, bins->first + instance * bins->stride + 4);
        const uint32_t slot = block->entries[i] & ((1u << PT_BIN_CHUNK_SHIFT) - 1);
        __builtin_prefetch(color + (size_t)pt_color_bytes[source.args->instance.color_format] * (source.chunk->first + slot));
    }
}

// Calls work for the discs of a bin, up to PT_LANES of one chunk at a time. colors: 1 where it looks those up.
static inline __attribute__((always_inline)) void pt_bin_walk(const struct pt_bins *bins, uint32_t bin, int colors,
                                                              pt_bin_work *work, void *context)
{
    uint32_t instance = 0;
    for (uint32_t thread = 0; thread < pt_pool_threads(bins->call->pool); thread++)
        for (uint32_t b = bins->heads[(size_t)thread * bins->bins + bin]; b != PT_BIN_NONE; b = bins->blocks[b].before) {
            const struct pt_bin_block *block = &bins->blocks[b];
            const uint32_t *entries = block->entries;
            if (block->before != PT_BIN_NONE)
                pt_bin_ask(bins, &bins->blocks[block->before], instance, colors);
            for (uint32_t i = 0, next; i < block->count; i = next) {
                const uint32_t chunk = entries[i] >> PT_BIN_CHUNK_SHIFT;
                for (next = i + 1; next < block->count && next - i < PT_LANES && entries[next] >> PT_BIN_CHUNK_SHIFT == chunk;)
                    next++;
                const struct pt_disc_source source = pt_bin_source(bins, chunk, &instance);
                const vi slot = vi_and(vi_load(entries + i), vi_set((1u << PT_BIN_CHUNK_SHIFT) - 1));
                const vi word = vi_load(block->words + i);
                struct pt_discs discs;
                vf p[3];
                for (uint32_t k = 0; k < 3; k++)
                    p[k] = vf_gather(source.positions + (size_t)k * source.chunk->padded, slot, vm_first(next - i));
                pt_disc_project(&source, p, vm_first(next - i), &discs);
                discs.id = vi_add(slot, vi_set(source.chunk->first));
                pt_disc_size(&source, word, &discs);
                pt_disc_shape(&source, word, &discs);
                pt_disc_tighten(bins->view, &discs);
                work(context, instance, &discs);
            }
        }
}

// A tile's pixels in the window.
static inline struct pt_disc_tile pt_bin_tile(const struct pt_bins *bins, uint32_t tile)
{
    const uint32_t x = tile % bins->columns * PT_DISC_TILE, y = tile / bins->columns * PT_DISC_TILE;
    const uint32_t width = bins->view->width - x, height = bins->view->height - y;
    return (struct pt_disc_tile){ (int32_t)x, (int32_t)y, (int32_t)(width < PT_DISC_TILE ? width : PT_DISC_TILE),
                                  (int32_t)(height < PT_DISC_TILE ? height : PT_DISC_TILE) };
}

static inline int pt_bin_empty(const struct pt_bins *bins, uint32_t bin)
{
    for (uint32_t thread = 0; thread < pt_pool_threads(bins->call->pool); thread++)
        if (bins->heads[(size_t)thread * bins->bins + bin] != PT_BIN_NONE)
            return 0;
    return 1;
}

#endif
