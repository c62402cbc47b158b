// SPDX-License-Identifier: GPL-3.0-or-later
// blend: normal and colour of the discs that lie on the nearest surface of each pixel, or which they are, or the light that arrives at
// them. SPEC 5, solid; twin of shaders/kernels/blend.comp
//
// Tile by tile. The sums of a pixel lie side by side, one vector whatever the instruction set; they are 32 bits wide and emptied into
// 64 before they could overflow.
#include "bins.h"
#include "marks.h"
#include "sums.h"
#include "shared/measured.h"

// Of a pixel: colour 3, opacity, normal 3, weight; or what PT_BLEND_LIGHTS lights lose, and opacity.
enum { TILE_PIXELS = PT_DISC_TILE * PT_DISC_TILE, SUMS = PT_SUMS };

// That sums take before they are emptied: 2^31, less what float32 may count wrong.
#define SUM_ROOM 2147352576.0f

// What a disc adds at weight 1.
struct terms {
    float each[PT_LANES][SUMS];
    float most[PT_LANES]; // of their sizes
};

struct place {
    int32_t column, row;
};

struct tile {
    const struct pt_bins *bins;
    // depth of the nearest disc; how far behind it others count, as a difference of bits: no depth is negative
    float nearest[TILE_PIXELS + PT_PATCH_BEYOND], behind[TILE_PIXELS + PT_PATCH_BEYOND];
    uint32_t id[TILE_PIXELS];
    struct place own[TILE_PIXELS]; // where the nearest disc's point fell
    float left;                    // that the sums can take
    int emptied;
    _Alignas(64) int32_t sums[TILE_PIXELS + PT_PATCH_COLUMNS][SUMS];
    int64_t wide[TILE_PIXELS][SUMS];
    // with depths: how far behind as differences of bits, world units, and 1 over them; sums of weights, and of shares of `reach`
    int deep;
    float deepest[TILE_PIXELS + PT_PATCH_BEYOND], reach[TILE_PIXELS + PT_PATCH_BEYOND], inverse[TILE_PIXELS + PT_PATCH_BEYOND];
    int32_t depth_sums[TILE_PIXELS][2];
    int64_t depth_wide[TILE_PIXELS][2];
    // of the discs at hand
    struct pt_patches patches;
    struct pt_farthest farthest;
    struct terms terms;
    uint32_t ids[PT_LANES];
    struct place places[PT_LANES];
};

// ---- discs ---------------------------------------------------------------------------------------------------------------

static const struct blend_args *arguments_of(const struct pt_bins *bins) { return bins->call->arguments; }

// Their opacity, PT_SUM_SCALE a unit.
static inline vf opaque_of(const struct pt_bins *bins, uint32_t instance, const struct pt_discs *discs)
{
    return pt_opacity(&bins->discs[instance].instance, NULL, PT_DATA_EACH(bins->call, blend, opacities, instance), discs->id,
                      vi_set(0), discs->drawn) *
           vf_set(PT_SUM_SCALE);
}

// first, last: terms 0 to 3 and 4 to 7. most: of their sizes.
static inline void store_terms(vf first[4], vf last[4], vf most, struct terms *out)
{
    float halves[2][PT_LANES][4];
    vf_store4(halves[0][0], first, PT_ALL);
    vf_store4(halves[1][0], last, PT_ALL);
    for (uint32_t i = 0; i < PT_LANES; i++)
        for (uint32_t k = 0; k < 2; k++)
            memcpy(out->each[i] + 4 * k, halves[k][i], sizeof halves[k][i]);
    vf_store(out->most, most);
}

static inline void set_terms(const struct pt_bins *bins, uint32_t instance, const struct pt_discs *discs, struct terms *out)
{
    const struct instance_args *args = &bins->discs[instance].instance;
    const void *colors = PT_DATA_EACH(bins->call, blend, colors, instance);
    const vf scale = vf_set(PT_SUM_SCALE), most = vf_set(PT_SUM_BRIGHTEST);
    vf color[4], normal[4], largest = scale;
    pt_albedo(args, colors, discs->id, vi_set(0), discs->drawn, color);
    color[3] = opaque_of(bins, instance, discs);
    for (int k = 0; k < 3; k++) {
        color[k] = vf_max(vf_min(color[k], most), vf_zero() - most) * color[3];
        largest = vf_max(largest, vf_abs(color[k]));
        normal[k] = discs->n[k] * scale;
    }
    normal[3] = scale;
    store_terms(color, normal, largest, out);
}

// What does not arrive of each light.
static inline void set_light_terms(const struct pt_bins *bins, uint32_t instance, const struct pt_discs *discs,
                                   struct terms *out)
{
    const struct blend_args *args = arguments_of(bins);
    const struct disc_args *disc = &bins->discs[instance];
    const uint32_t *words = PT_DATA_EACH(bins->call, blend, colors, instance),
                   *marks = PT_DATA_EACH(bins->call, blend, marks, instance);
    const vf opaque = opaque_of(bins, instance, discs);
    const int shadowed = args->lights && disc->shadowed;
    const vi at = shadowed && args->marked ? pt_shown_words(marks, args->step, discs->id, discs->drawn) : discs->id;
    const size_t stride = args->marked ? 1 : disc->instance.slots;
    vf terms[SUMS];
    for (uint32_t k = 0; k < PT_BLEND_LIGHTS; k++) {
        terms[k] = vf_zero();
        if (k >= args->lights || !shadowed)
            continue;
        const vi word = vi_gather(words + (args->first + k) * stride, at, discs->drawn);
        const vf lost = vi_convert(vi_and(word, vi_set(PT_SHADOW_SUM))) * vf_set(args->scales[k]);
        terms[k] = vf_min(lost, vf_set(1.0f)) * opaque;
    }
    terms[PT_BLEND_LIGHTS] = opaque;
    store_terms(terms, terms + 4, vf_set(PT_SUM_SCALE), out);
}

static void empty_sums(struct tile *tile)
{
    for (int i = 0; i < TILE_PIXELS; i++)
        for (int k = 0; k < SUMS; k++) {
            tile->wide[i][k] = (tile->emptied ? tile->wide[i][k] : 0) + tile->sums[i][k];
            tile->sums[i][k] = 0;
        }
    for (int i = 0; i < TILE_PIXELS && tile->deep; i++)
        for (int k = 0; k < 2; k++) {
            tile->depth_wide[i][k] = (tile->emptied ? tile->depth_wide[i][k] : 0) + tile->depth_sums[i][k];
            tile->depth_sums[i][k] = 0;
        }
    tile->emptied = 1;
    tile->left = SUM_ROOM;
}

// Pixels of patches, packed, so that no branch waits for how many of each count: pixel in the tile | lane of the disc << 16 |
// number among the pixels of all the patches << 20.
struct counted {
    uint32_t count, each[PT_PATCHES * PT_LANES + PT_LANES];
};

static inline void count_pixels(struct counted *out, const struct pt_patches *list, uint32_t i, vm some)
{
    vi pixels = vi_mul(vi_lanes(), vi_set(1u << 20 | 1u));
    if (PT_PATCH_ROWS > 1)
        pixels = vi_add(pixels, vi_mul(vi_shr(vi_lanes(), 3), vi_set(PT_DISC_TILE - PT_PATCH_COLUMNS)));
    vi_pack(out->each + out->count, vi_add(pixels, vi_set(list->at[i] + (PT_LANES * i << 20))), vm_bits(some));
    out->count += (uint32_t)__builtin_popcount(vm_bits(some));
}

static inline uint32_t counted_pixel(uint32_t one) { return one & 0xFFFFu; }
static inline uint32_t counted_disc(uint32_t one) { return one >> 16 & 15u; }

// Adds discs to the means of depth.
static void add_depths(struct tile *tile, const struct pt_patches *list)
{
    struct counted taken;
    _Alignas(64) float weights[PT_PATCHES * PT_LANES], shares[PT_PATCHES * PT_LANES];
    taken.count = 0;
    for (uint32_t i = 0; i < list->count; i++) {
        const struct pt_shown shown = pt_patch_show(list, i);
        const uint32_t at = pt_patch_pixel(list, i);
        const vf nearest = pt_patch_load(tile->nearest + at), weight = pt_shown_weight(&shown);
        const vm beyond = vi_lt_unsigned(vf_bits(pt_patch_load(tile->deepest + at)),
                                         vi_sub(vf_bits(shown.z), vf_bits(nearest)));
        vf_store(weights + i * PT_LANES, weight);
        vf_store(shares + i * PT_LANES, ((shown.z - nearest) * pt_patch_load(tile->inverse + at)) * weight);
        count_pixels(&taken, list, i, vm_and(shown.covered, vm_not(beyond)));
    }
    for (uint32_t i = 0; i < taken.count; i++) {
        int32_t *sums = tile->depth_sums[counted_pixel(taken.each[i])];
        sums[0] += (int32_t)(weights[taken.each[i] >> 20] * PT_SUM_SCALE);
        sums[1] += (int32_t)(shares[taken.each[i] >> 20] * PT_SUM_SCALE);
    }
}

// Adds a disc to the sums of its pixels; where nothing lies before it, it may be the one that the key names.
static void add_up(void *context, struct pt_patches *list)
{
    struct tile *tile = context;
    struct counted taken, nearest;
    _Alignas(64) float weights[PT_PATCHES * PT_LANES];
    taken.count = nearest.count = 0;
    for (uint32_t i = 0; i < list->count; i++) {
        const struct pt_shown shown = pt_patch_show(list, i);
        const uint32_t at = pt_patch_pixel(list, i);
        const vi behind = vi_sub(vf_bits(shown.z), vf_bits(pt_patch_load(tile->nearest + at)));
        const vi most = vf_bits(pt_patch_load(tile->behind + at));
        const vm some = vm_and(shown.covered, vm_not(vi_lt_unsigned(most, behind)));
        vf_store(weights + i * PT_LANES, pt_shown_weight(&shown));
        count_pixels(&taken, list, i, some);
        count_pixels(&nearest, list, i, vm_and(some, vi_eq(behind, vi_set(0))));
    }
    for (uint32_t i = 0; i < taken.count; i++) {
        const uint32_t one = taken.each[i];
        vi_eight *sums = (vi_eight *)(void *)tile->sums[counted_pixel(one)];
        const vf_eight *terms = (const vf_eight *)(const void *)tile->terms.each[counted_disc(one)];
        *sums += __builtin_convertvector(*terms * weights[one >> 20], vi_eight);
    }
    for (uint32_t i = 0; i < nearest.count; i++) {
        const uint32_t pixel = counted_pixel(nearest.each[i]), disc = counted_disc(nearest.each[i]);
        if (tile->id[pixel] == tile->ids[disc])
            tile->own[pixel] = tile->places[disc];
    }
    if (tile->deep)
        add_depths(tile, list);
}

// Sees to it that the sums have room for `size` more.
static inline void take_room(struct tile *tile, float size)
{
    if (tile->left < size)
        empty_sums(tile);
    tile->left -= size;
}

// Those that are left lie before something that counts near them: to look at their pixels would take longer than to light some more.
static inline void draw_marks(void *context, uint32_t instance, const struct pt_discs *discs)
{
    const struct tile *tile = context;
    uint32_t *marks = PT_DATA_EACH(tile->bins->call, blend, colors, instance);
    uint32_t ids[PT_LANES];
    vi_store(ids, discs->id);
    for (uint32_t some = tile->bins->discs[instance].shadowed ? vm_bits(discs->drawn) : 0; some; some &= some - 1)
        pt_mark(marks, ids[__builtin_ctz(some)]);
}

static inline void draw(void *context, uint32_t instance, const struct pt_discs *discs)
{
    struct tile *tile = context;
    vi places[2];
    float size = 0.0f;
    if (arguments_of(tile->bins)->part == PT_BLEND_LIGHT)
        set_light_terms(tile->bins, instance, discs, &tile->terms);
    else
        set_terms(tile->bins, instance, discs, &tile->terms);
    for (uint32_t i = 0; i < PT_LANES; i++)
        size += tile->terms.most[i] + 1.0f;
    vi_store(tile->ids, vi_add(discs->id, vi_set(tile->bins->discs[instance].instance.id_base)));
    vi_zip(discs->column, discs->row, places);
    vi_store(tile->places, places[0]);
    vi_store((uint32_t *)(void *)tile->places + PT_LANES, places[1]);
    const uint32_t each = size <= SUM_ROOM ? PT_LANES : 1; // so bright that they have room one by one only
    for (uint32_t i = 0; i < PT_LANES; i += each) {
        take_room(tile, each > 1 ? size : tile->terms.most[i] + 1.0f);
        pt_patches_draw(&tile->patches, discs, ((1u << each) - 1) << i, 1, add_up, tile);
    }
}

// ---- tiles ---------------------------------------------------------------------------------------------------------------

// How far behind z depths are averaged.
static inline vf set_reach(struct tile *tile, uint32_t at, vf z, vf deff)
{
    const vf reach = vf_max(vf_min(deff * vf_set(PT_DISC_DEPTHS), vf_set(PT_DISC_MOST)), vf_set(PT_DISC_LEAST));
    vi_store(tile->deepest + at, vi_sub(vf_bits(z + reach), vf_bits(z)));
    vf_store(tile->reach + at, reach);
    vf_store(tile->inverse + at, vf_rcp(reach));
    return reach;
}

static int load(struct tile *tile, const uint64_t *keys, const float *deff)
{
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z));
    int any = 0;
    memset(tile->farthest.column, 0, sizeof tile->farthest.column);
    for (int32_t y = 0; y < tile->patches.tile.height; y++) {
        const size_t from = (size_t)(tile->patches.tile.y + y) * tile->bins->view->width + (size_t)tile->patches.tile.x;
        const uint32_t to = (uint32_t)y * PT_DISC_TILE;
        for (uint32_t x = 0; x < (uint32_t)tile->patches.tile.width; x += PT_LANES) { // tiles are whole vectors wide
            vf z = vi_float(vi_load_z(keys + from + x));
            vm some = vm_and(vf_lt(z, empty), vm_first(pt_lanes_left(x, (uint32_t)tile->patches.tile.width)));
            float *farthest = tile->farthest.column[y >> PT_CELL_SHIFT] + x;
            any |= vm_bits(some) != 0;
            vf limit = z + vf_load(deff + from + x);
            if (tile->deep)
                limit = vf_max(limit, z + set_reach(tile, to + x, z, vf_load(deff + from + x)));
            vf_store(farthest, vf_select(some, vf_max(limit, vf_load(farthest)), vf_load(farthest)));
            vf_store(tile->nearest + to + x, z);
            vi_store(tile->behind + to + x, vi_sub(vf_bits(z + vf_load(deff + from + x)), vf_bits(z)));
            vi_store(tile->id + to + x, vi_load_id(keys + from + x));
        }
    }
    pt_farthest_end(&tile->farthest);
    return any;
}

// Those of `some` whose points are discs; or discs of instances with normals.
static vm of_discs(const struct pt_bins *bins, vi id, vm some, int normals)
{
    vm with = vm_of_bits(0);
    for (uint32_t i = 0; i < bins->instances; i++) {
        const struct instance_args *args = &bins->discs[i].instance;
        if (args->has_normals || !normals)
            with = vm_or(with, pt_has_ids(vi_sub(id, vi_set(args->id_base)), args->id_first, args->id_count));
    }
    return vm_and(with, some);
}

// Mean normals, on the side that the nearest disc's lies on.
static void mean_normal(const struct view_args *view, const vf sums[SUMS], uint32_t x, uint32_t y, vm with, vf n[4])
{
    const vf zero = vf_zero();
    vf ray[2], square = (sums[4] * sums[4] + sums[5] * sums[5]) + sums[6] * sums[6], facing = zero - n[2];
    vm good = vm_and(with, vf_le(vf_set(1.0f), square));
    vf scale = vf_rsqrt(vf_select(good, square, vf_set(1.0f)));
    if (view->perspective) {
        vf_ray(view, x, y, ray);
        facing = (n[0] * ray[0] + n[1] * ray[1]) - n[2];
    }
    vm away = vf_lt(zero, facing);
    for (int k = 0; k < 3; k++) {
        vf mean = sums[4 + k] * scale;
        n[k] = vf_select(good, vf_select(away, zero - mean, mean), n[k]);
    }
}

// off: how many pixels away the points of the keys fell.
static void save(const struct tile *tile, const uint64_t *keys, float *normals, float *albedo, float *off)
{
    const struct pt_bins *bins = tile->bins;
    const vf zero = vf_zero(), one = vf_set(1.0f);
    for (int32_t y = 0; y < tile->patches.tile.height; y++)
        for (uint32_t x = 0; x < (uint32_t)tile->patches.tile.width; x += PT_LANES) {
            const uint32_t px = (uint32_t)tile->patches.tile.x + x, py = (uint32_t)(tile->patches.tile.y + y);
            const size_t at = (size_t)py * bins->view->width + px;
            const uint32_t pixel = (uint32_t)y * PT_DISC_TILE + x;
            const uint32_t count = pt_lanes_left(x, (uint32_t)tile->patches.tile.width);
            vm some = vm_and(vm_first(count), vf_lt(vf_load(tile->nearest + pixel), vf_set(pt_float(PT_KEY_EMPTY_Z))));
            some = of_discs(bins, vi_load_id(keys + at), some, 0);
            if (!vm_bits(some))
                continue;
            vf sums[SUMS], color[4], n[4];
            pt_take_sums(tile->sums[pixel], tile->emptied ? tile->wide[pixel] : NULL, some, sums);
            vm colored = vm_and(some, vf_le(one, sums[3]));
            vf share = vf_rcp(vf_select(colored, sums[3], one));
            for (int k = 0; k < 3; k++)
                color[k] = vf_select(colored, sums[k] * share, zero);
            const vf weight = vf_max(sums[7], one);
            color[3] = vf_select(vf_lt(sums[3], weight), vf_min(sums[3] * vf_rcp(weight), one), one); // opaque: 1 exactly
            vf_load4(normals + 4 * at, n);
            mean_normal(bins->view, sums, px, py, of_discs(bins, vi_load_id(keys + at), some, 1), n);
            const uint32_t *own = (const uint32_t *)(const void *)(tile->own + pixel);
            const vi pair = vi_load(own), other = vi_load(own + PT_LANES);
            vf dx = vi_convert(vi_sub(vi_add(vi_set(px), vi_lanes()), vi_evens(pair, other)));
            vf dy = vi_convert(vi_sub(vi_set(py), vi_odds(pair, other))), away = dx * dx + dy * dy;
            vf_store_where(off + at, away * vf_rsqrt(vf_max(away, one)), some);
            vf_store4(normals + 4 * at, n, vm_bits(some));
            vf_store4(albedo + 4 * at, color, vm_bits(some));
        }
}

static void save_depths(const struct tile *tile, float *offsets)
{
    for (int32_t y = 0; y < tile->patches.tile.height; y++)
        for (int32_t x = 0; x < tile->patches.tile.width; x++) {
            const int32_t pixel = y * PT_DISC_TILE + x;
            float sums[2];
            for (int k = 0; k < 2; k++)
                sums[k] = pt_wide_sum((tile->emptied ? tile->depth_wide[pixel][k] : 0) + tile->depth_sums[pixel][k]);
            const float share = sums[1] * pt_rcp(sums[0] < 1.0f ? 1.0f : sums[0]);
            offsets[(size_t)(tile->patches.tile.y + y) * tile->bins->view->width + (size_t)(tile->patches.tile.x + x)] =
                sums[0] < 1.0f ? 0.0f : share * tile->reach[pixel];
        }
}

// Of each light, the mean share that does not arrive.
static void save_light(const struct tile *tile, const uint64_t *keys, uint32_t *planes)
{
    const struct pt_bins *bins = tile->bins;
    const struct blend_args *args = arguments_of(bins);
    const vf one = vf_set(1.0f), scale = vf_set((float)PT_SHADOW_SUM), half = vf_set(0.5f);
    const size_t plane = (size_t)args->view.width * args->view.height;
    for (int32_t y = 0; y < tile->patches.tile.height; y++)
        for (uint32_t x = 0; x < (uint32_t)tile->patches.tile.width; x += PT_LANES) {
            const size_t at = (size_t)(tile->patches.tile.y + y) * args->view.width + (uint32_t)tile->patches.tile.x + x;
            const uint32_t pixel = (uint32_t)y * PT_DISC_TILE + x;
            const uint32_t count = pt_lanes_left(x, (uint32_t)tile->patches.tile.width);
            vm some = vm_and(vm_first(count), vf_lt(vf_load(tile->nearest + pixel), vf_set(pt_float(PT_KEY_EMPTY_Z))));
            some = of_discs(bins, vi_load_id(keys + at), some, 0);
            if (!vm_bits(some))
                continue;
            vf sums[SUMS];
            pt_take_sums(tile->sums[pixel], tile->emptied ? tile->wide[pixel] : NULL, some, sums);
            const vf opaque = vf_select(some, vf_max(sums[PT_BLEND_LIGHTS], one), one), share = vf_rcp(opaque);
            for (uint32_t k = 0; k < args->lights; k++) {
                const vf lost = vf_min(sums[k] * share, one) * scale + half;
                vi_store_where(planes + (args->first + k) * plane + at, vf_int(vf_select(some, lost, half)), some);
            }
        }
}

// The discs of a tile, its own and the large ones.
static inline __attribute__((always_inline)) void walk(const struct pt_bins *bins, uint32_t thread, uint32_t t,
                                                       struct tile *tile, int colors, pt_bin_work *work)
{
    pt_bin_walk(bins, thread, t, &tile->patches.tile, &tile->farthest, colors, work, tile);
    pt_bin_walk(bins, thread, bins->bins - 1, &tile->patches.tile, &tile->farthest, colors, work, tile);
}

static void blend_tile(const struct pt_bins *bins, uint32_t thread, uint32_t t, struct tile *tile)
{
    const struct pt_cpu_call *call = bins->call;
    const uint32_t part = arguments_of(bins)->part;
    memset(tile->sums, 0, sizeof tile->sums);
    if (tile->deep)
        memset(tile->depth_sums, 0, sizeof tile->depth_sums);
    tile->left = SUM_ROOM;
    tile->emptied = 0;
    walk(bins, thread, t, tile, part == PT_BLEND_COLORS, draw);
    if (part == PT_BLEND_LIGHT)
        save_light(tile, PT_DATA(call, blend, keys), PT_DATA(call, blend, albedo));
    else
        save(tile, PT_DATA(call, blend, keys), PT_DATA(call, blend, normal), PT_DATA(call, blend, albedo),
             PT_DATA(call, blend, away));
    if (tile->deep)
        save_depths(tile, PT_DATA(call, blend, offset));
}

static void blend_tiles(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct pt_bins *bins = context;
    struct tile *tile = (struct tile *)bins->call->scratch[1].memory + thread;
    tile->bins = bins;
    for (uint32_t t = begin; t < end && !pt_cpu_cancelled(bins->call); t++) {
        pt_patches_turn(&tile->patches, bins->view, pt_bin_tile(bins, t));
        tile->deep = arguments_of(bins)->depths != 0;
        if (!load(tile, PT_DATA(bins->call, blend, keys), PT_DATA(bins->call, blend, deff)))
            continue;
        if (arguments_of(bins)->part == PT_BLEND_MARKS)
            walk(bins, thread, t, tile, 0, draw_marks);
        else
            blend_tile(bins, thread, t, tile);
    }
}

int PT_KERNEL_ENTRY(blend)(const struct pt_cpu_call *call)
{
    const struct blend_args *args = call->arguments;
    struct pt_bins bins = {.call = call,
                           .view = &args->view,
                           .discs = (const struct disc_args *)(args + 1),
                           .instances = args->instances,
                           .first = PT_BUF_blend_chunks,
                           .stride = PT_EACH_blend};
    pt_bins_again(&bins, call->buffers[PT_BUF_blend_bins]);
    if (!pt_cpu_scratch(call, 1, pt_pool_threads(call->pool) * sizeof(struct tile)))
        return PATINA_ERROR_MEMORY;
    pt_parallel(call->pool, bins.bins - 1, 1, blend_tiles, &bins);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
