// SPDX-License-Identifier: GPL-3.0-or-later
// Points of a chunk in the cells of an image buffer, in whole numbers: band of rows by band, so that a band's sums stay in the cache, and
// nobody else adds to them. Of merge and differ; twin of shaders/lib/cells.glsl
#ifndef PT_CELLS_H
#define PT_CELLS_H

#include "device_cpu/kernels/ranges.h"
#include "device_cpu/kernels/shade.h"
#include "device_cpu/kernels/sums.h"
#include "device_cpu/points.h"

enum {
    PT_CELL_BLOCK = 256, // points
    PT_BAND_CELLS =
        1 << 15,       // at most: a megabyte of narrow sums. Of 1 << 13 a picture of 1.3 million points takes a seventh longer
    PT_BAND_LEAST = 8, // rows
    PT_BANDS_EACH = 2, // a thread, at least
};

typedef int64_t pt_vl_eight __attribute__((vector_size(64), aligned(8), may_alias));

struct pt_cell_band {
    uint32_t first, end; // rows of the plane
    int wide;            // 0: sums are of 32 bits, in the front half of their memory
    int64_t *sums;       // PT_SUMS a cell
};

struct pt_cell_block { // of a chunk: its points in view that do not face away and fall into the band, packed
    uint32_t count;
    uint32_t cell[PT_CELL_BLOCK + PT_LANES], id[PT_CELL_BLOCK + PT_LANES]; // cell: in the plane
    // x, y: cells from the picture's corner
    float x[PT_CELL_BLOCK + PT_LANES], y[PT_CELL_BLOCK + PT_LANES], z[PT_CELL_BLOCK + PT_LANES];
};

struct pt_cells {
    const struct pt_cpu_call *call;
    const struct view_args *view;
    const void *positions;
    const uint32_t *surfels, *drawn; // drawn NULL: nothing is sifted
    const struct chunk_view *chunks;
    uint32_t chunk_count;
    // A block goes into its band's sums; means of PT_LANES cells from the one at `at` on, `count` of which there are, come out of them.
    void (*add)(const struct pt_cells *cells, struct pt_cell_band *band, const struct pt_cell_block *block);
    void (*save)(const struct pt_cells *cells, const struct pt_cell_band *band, size_t at, uint32_t count);
    int narrow;    // 1: bands begin with 32 bits, and `add` widens them before they are too few
    uint32_t rows; // of a band
    char *memory;  // per thread
    size_t thread_bytes;
};

// As pt_project has it, but for the columns.
static inline void pt_project_rows(const struct view_args *view, const struct chunk_view *chunk, const vf p[3], vf at[3])
{
    for (int k = 1; k < 3; k++)
        at[k] = vf_transform(chunk, k, p[0], p[1], p[2]);
    if (view->perspective)
        at[1] = at[1] * vf_rcp(at[2]);
}

// Where points [first, last) lie.
static inline void pt_cells_project(const struct pt_cells *cells, const struct pt_cell_band *band,
                                    const struct chunk_view *chunk, uint32_t first, uint32_t last, struct pt_cell_block *block)
{
    const struct view_args *view = cells->view;
    const uint32_t *points = pt_chunk_points(cells->positions, chunk);
    const uint32_t *surfels = cells->surfels + chunk->first, *drawn = cells->drawn;
    const struct pt_window window = pt_window_rows(view, (float)(view->origin_y + (int32_t)band->first),
                                                   (float)(view->origin_y + (int32_t)band->end));
    uint32_t count = 0;
    for (uint32_t i = first; i < last; i += PT_LANES) {
        vf p[3], at[3];
        pt_load_points(chunk, points, i, p);
        pt_project_rows(view, chunk, p, at);
        const vm own = vm_and(vf_le(window.bottom, at[1]), vf_lt(at[1], window.top));
        if (!vm_bits(own)) // most chunks lie in several bands, whose points lie side by side
            continue;
        pt_project(view, chunk, p, at);
        vm some = vm_and(pt_within(&window, at), vm_first(pt_lanes_left(i, last)));
        some = pt_keep_drawn(chunk, drawn, i, some);
        if (!vm_bits(some))
            continue;
        if (chunk->cull)
            some = vm_and(some, vm_not(pt_faces_away(chunk, vi_load(surfels + i), p)));
        const vf column = vf_floor(at[0]), row = vf_floor(at[1]);
        const vi cell = vi_add(vi_mul(vi_sub(vf_int(row), vi_set((uint32_t)view->origin_y)), vi_set(view->width)),
                               vi_sub(vf_int(column), vi_set((uint32_t)view->origin_x)));
        const uint32_t lanes = vm_bits(some);
        vi_pack(block->cell + count, cell, lanes);
        vi_pack(block->id + count, vi_add(vi_set(chunk->first + i), vi_lanes()), lanes);
        vi_pack((uint32_t *)(void *)(block->x + count), vf_bits(at[0]), lanes);
        vi_pack((uint32_t *)(void *)(block->y + count), vf_bits(at[1]), lanes);
        vi_pack((uint32_t *)(void *)(block->z + count), vi_and(vf_bits(at[2]), vi_set(0x7FFFFFFFu)), lanes);
        count += (uint32_t)__builtin_popcount(lanes);
    }
    block->count = count;
}

// What depths of a cell's points are told in parts of.
static inline vf pt_cell_reach(const struct view_args *view, vf gamma, vf z)
{
    return vf_min(gamma, vf_max(vf_set(PT_RANGE_DEEPEST) * vf_footprint(view, z), vf_set(PT_RANGE_LEAST)));
}

static inline int pt_cells_may_reach(const struct view_args *view, const struct chunk_view *chunk,
                                     const struct pt_cell_band *band)
{
    const uint32_t end = chunk->row_end ? chunk->row_end : view->height;
    return chunk->row_first < band->end && band->first < end;
}

// From 32 bits to 64, in their own memory.
static inline void pt_cells_widen(const struct pt_cells *cells, struct pt_cell_band *band)
{
    const int32_t *narrow = (const int32_t *)(const void *)band->sums;
    for (size_t i = (size_t)(band->end - band->first) * cells->view->width * PT_SUMS; i--;) {
        int32_t sum;
        memcpy(&sum, narrow + i, sizeof sum);
        const int64_t whole = sum;
        memcpy(band->sums + i, &whole, sizeof whole);
    }
    band->wide = 1;
}

static void pt_cells_bands(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct pt_cells *cells = context;
    const struct view_args *view = cells->view;
    const uint32_t *rect = view->rect;
    struct pt_cell_block block;
    struct pt_cell_band band = {.sums = (int64_t *)(void *)(cells->memory + thread * cells->thread_bytes)};
    for (uint32_t b = begin; b < end && !pt_cpu_cancelled(cells->call); b++) {
        band.first = rect[1] + b * cells->rows;
        band.end = band.first + cells->rows < rect[3] ? band.first + cells->rows : rect[3];
        band.wide = !cells->narrow;
        memset(band.sums, 0,
               (size_t)(band.end - band.first) * view->width * PT_SUMS * (band.wide ? sizeof(int64_t) : sizeof(int32_t)));
        for (uint32_t c = 0; c < cells->chunk_count; c++) {
            const struct chunk_view *chunk = &cells->chunks[c];
            for (uint32_t first = 0; pt_cells_may_reach(view, chunk, &band) && first < chunk->count; first += PT_CELL_BLOCK) {
                pt_cells_project(cells, &band, chunk, first,
                                 chunk->count - first < PT_CELL_BLOCK ? chunk->count : first + PT_CELL_BLOCK, &block);
                cells->add(cells, &band, &block);
            }
            pt_pool_look(cells->call->pool);
        }
        for (uint32_t y = band.first; y < band.end; y++)
            for (uint32_t x = rect[0]; x < rect[2]; x += PT_LANES)
                cells->save(cells, &band, (size_t)y * view->width + x, pt_lanes_left(x, rect[2]));
    }
}

static int pt_cells_run(struct pt_cells *cells)
{
    const struct view_args *view = cells->view;
    if (view->rect[0] >= view->rect[2] || view->rect[1] >= view->rect[3])
        return PATINA_OK;
    const uint32_t fit = PT_BAND_CELLS / view->width, bands = PT_BANDS_EACH * pt_pool_threads(cells->call->pool);
    const uint32_t even = (view->rect[3] - view->rect[1] + bands - 1) / bands, rows = fit < even ? fit : even;
    cells->rows = rows < PT_BAND_LEAST ? PT_BAND_LEAST
                                       : rows; // points near an edge are projected twice: as few bands as may be
    cells->thread_bytes = (((size_t)cells->rows * view->width + PT_LANES) * PT_SUMS * sizeof(int64_t) + 63) / 64 * 64;
    cells->memory = pt_cpu_scratch(cells->call, 0, pt_pool_threads(cells->call->pool) * cells->thread_bytes);
    if (!cells->memory)
        return PATINA_ERROR_MEMORY;
    pt_parallel(cells->call->pool, (view->rect[3] - view->rect[1] + cells->rows - 1) / cells->rows, 1, pt_cells_bands, cells);
    return pt_cpu_cancelled(cells->call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}

#endif
