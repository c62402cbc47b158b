// SPDX-License-Identifier: GPL-3.0-or-later
// splat: points -> least key of every pixel that their discs cover. SPEC 5, solid; twin of shaders/kernels/splat.comp
//
// Tile by tile, in memory that the first-level cache holds.
#include "bins.h"
#include "shared/points.h"

enum {
    TILE_PIXELS = PT_DISC_TILE * PT_DISC_TILE,
    LOOK_AGAIN = 160, // discs between two looks at how far away the keys of a tile lie
};

struct tile {
    const struct pt_bins *bins;
    _Alignas(64) uint64_t keys[TILE_PIXELS + PT_PATCH_BEYOND];
    float limit[TILE_PIXELS + PT_PATCH_BEYOND]; // only what lies beyond counts
    int limited;
    struct pt_patches patches;
    uint32_t ids[PT_LANES]; // of the discs at hand
    uint32_t drawn;         // since the keys were looked at
    struct pt_farthest farthest;
};

static void look(struct tile *tile)
{
    for (uint32_t y = 0; y < PT_CELLS; y++)
        for (uint32_t x = 0; x < PT_DISC_TILE; x += PT_LANES) {
            const uint64_t *keys = tile->keys + (y << PT_CELL_SHIFT) * PT_DISC_TILE + x;
            vf most = vi_float(vi_load_z(keys));
            for (uint32_t i = 1; i < 1u << PT_CELL_SHIFT; i++)
                most = vf_max(most, vi_float(vi_load_z(keys + (size_t)i * PT_DISC_TILE)));
            vf_store(tile->farthest.column[y] + x, most);
        }
    pt_farthest_end(&tile->farthest);
    tile->drawn = 0;
}

// Takes the least keys.
static void take_least(void *context, struct pt_patches *list)
{
    struct tile *tile = context;
    for (uint32_t i = 0; i < list->count; i++) {
        const struct pt_shown shown = pt_patch_show(list, i);
        const uint32_t at = pt_patch_pixel(list, i);
        vm covered = shown.covered;
        if (tile->limited)
            covered = vm_and(covered, vf_lt(pt_patch_load(tile->limit + at), shown.z));
        vi_least_keys(tile->keys + at, PT_PATCH_ROWS > 1 ? PT_DISC_TILE : PT_LANES / 2,
                      vi_select(covered, vf_bits(shown.z), vi_set(0x7FFFFFFFu)), vi_set(tile->ids[pt_patch_disc(list, i)]));
    }
}

static inline void draw(void *context, uint32_t instance, const struct pt_discs *discs)
{
    struct tile *tile = context;
    vi_store(tile->ids, vi_add(discs->id, vi_set(tile->bins->discs[instance].instance.id_base)));
    pt_patches_draw(&tile->patches, discs, ~0u, PT_KEYS_AT_ONCE, take_least, tile);
    tile->drawn += (uint32_t)__builtin_popcount(vm_bits(discs->drawn));
    if (tile->drawn >= LOOK_AGAIN)
        look(tile);
}

static void load(struct tile *tile, const uint64_t *keys, const float *limit)
{
    if (tile->patches.tile.width < PT_DISC_TILE || tile->patches.tile.height < PT_DISC_TILE)
        memset(tile->keys, 0, sizeof tile->keys); // no pixel there lies far away
    for (int32_t y = 0; y < tile->patches.tile.height; y++) {
        const size_t from = (size_t)(tile->patches.tile.y + y) * tile->bins->view->width + (size_t)tile->patches.tile.x;
        memcpy(tile->keys + y * PT_DISC_TILE, keys + from, (size_t)tile->patches.tile.width * 8);
        if (limit)
            memcpy(tile->limit + y * PT_DISC_TILE, limit + from, (size_t)tile->patches.tile.width * 4);
    }
    tile->limited = limit != NULL;
}

static void save(const struct tile *tile, uint64_t *keys)
{
    const struct pt_disc_tile *at = &tile->patches.tile;
    for (int32_t y = 0; y < at->height; y++)
        memcpy(keys + (size_t)(at->y + y) * tile->bins->view->width + (size_t)at->x, tile->keys + y * PT_DISC_TILE,
               (size_t)at->width * 8);
}

static void draw_tiles(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct pt_bins *bins = context;
    const struct splat_args *args = bins->call->arguments;
    const float *limit = args->behind ? PT_DATA(bins->call, splat, limit) : NULL;
    const uint32_t large = bins->bins - 1;
    struct tile tile;
    tile.bins = bins;
    for (uint32_t t = begin; t < end && !pt_cpu_cancelled(bins->call); t++) {
        if (pt_bin_empty(bins, t) && pt_bin_empty(bins, large))
            continue;
        pt_patches_turn(&tile.patches, bins->view, pt_bin_tile(bins, t));
        load(&tile, PT_DATA(bins->call, splat, keys), limit);
        look(&tile);
        pt_bin_walk(bins, thread, large, &tile.patches.tile, &tile.farthest, 0, draw, &tile);
        pt_bin_walk(bins, thread, t, &tile.patches.tile, &tile.farthest, 0, draw, &tile);
        save(&tile, PT_DATA(bins->call, splat, keys));
    }
}

int PT_KERNEL_ENTRY(splat)(const struct pt_cpu_call *call)
{
    const struct splat_args *args = call->arguments;
    struct pt_bins bins = {.call = call,
                           .view = &args->view,
                           .discs = (const struct disc_args *)(args + 1),
                           .drawn = args->sifted ? PT_DATA(call, splat, drawn) : NULL,
                           .instances = args->instances,
                           .first = PT_BUF_splat_chunks,
                           .stride = PT_EACH_splat};
    int error = pt_bins_fill(&bins, call->buffers[PT_BUF_splat_bins]);
    if (error)
        return error;
    pt_parallel(call->pool, bins.bins - 1, 1, draw_tiles, &bins);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
