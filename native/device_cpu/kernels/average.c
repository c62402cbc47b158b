// SPDX-License-Identifier: GPL-3.0-or-later
// average: points about the surface -> mean colour and normal of the pixels that show it; twin of shaders/kernels/average.comp
//
// Band of rows by band: its sums stay in the cache, and nobody else adds to them. Points are projected anew, as scatter does; those
// of a chunk that lies across bands more than once, which takes less than sums of the whole picture would. The sums of a pixel lie
// side by side, 32 bits wide, and are emptied into 64 before they could overflow.
#include "device_cpu/kernels/shade.h"
#include "device_cpu/kernels/sums.h"
#include "device_cpu/points.h"
#include "device_cpu/rows.h"
#include "shared/means.h"

enum {
    BLOCK = 256,    // points
    SUMS = PT_SUMS, // colour 3, weight, normal 3, and what none of them is above
    ROOM = SUMS - 1,
    FULL = 1 << 30,        // no term is above, so that a sum of more has to be emptied
    BAND_PIXELS = 1 << 16, // about
    BAND_LEAST = 16,
    BAND_MOST = 64, // rows
};

struct depths { // between which a point counts
    float nearest, farthest;
};

struct average {
    const struct pt_cpu_call *call;
    const struct average_args *args;
    uint32_t rows; // of a band
    size_t stride; // pixels of a row of one
    char *memory;  // per thread
    size_t thread_bytes;
};

struct band {
    uint32_t first, end; // rows of the plane
    int32_t *sums;       // SUMS a pixel
    int64_t *wide;       // the same of what was emptied, once something was
    int emptied;
    struct depths *depths; // of pixels; none where a pixel is not ours
};

struct block { // of a chunk: its points in view that do not face away and may reach the band, packed
    uint32_t count;
    float x[BLOCK + PT_LANES], y[BLOCK + PT_LANES], z[BLOCK + PT_LANES], half[BLOCK + PT_LANES]; // h
    uint32_t id[BLOCK + PT_LANES], word[BLOCK + PT_LANES];
};

struct blocks {
    struct block narrow, middle, wide; // points whose tents cover 2 x 2 pixels, 3 x 3, and more
};

// What points add at weight 1.
struct terms {
    float each[PT_LANES][SUMS];
};

// ---- the band -------------------------------------------------------------------------------------------------------------

// Which depths count where, and sums of nothing. Returns whether a pixel is ours.
static int open_band(const struct average *average, struct band *band)
{
    const struct view_args *view = &average->args->view;
    const uint64_t *keys = PT_DATA(average->call, average, keys);
    const uint32_t *from = PT_DATA(average->call, average, from);
    const float *deff = PT_DATA(average->call, average, deff), *normals = PT_DATA(average->call, average, normal);
    const vf none = vf_set(pt_float(PT_KEY_EMPTY_Z));
    int any = 0;
    for (uint32_t y = band->first; y < band->end; y++) {
        const size_t row = (y - band->first) * average->stride;
        for (uint32_t x = 0; x < view->width; x += PT_LANES) {
            const size_t at = (size_t)y * view->width + x;
            vi id, both[2];
            const vm ours = pt_of_instance(keys + at, &average->args->instance, pt_lanes_left(x, view->width), &id);
            vf near = none, far = vf_zero() - none;
            if (vm_bits(ours)) {
                const vf z = vi_float(vi_load_z(keys + at)), d = pt_own_distance(view, deff, normals, from, at, z, ours);
                near = vf_select(ours, z - d, near);
                far = vf_select(ours, z + d, far);
                memset(band->sums + SUMS * (row + x), 0, PT_LANES * SUMS * sizeof *band->sums);
                any = 1;
            }
            vi_zip(vf_bits(near), vf_bits(far), both);
            vi_store(band->depths + row + x, both[0]);
            vi_store((char *)(band->depths + row + x) + PT_LANES * 4, both[1]);
        }
    }
    return any;
}

// ---- points ---------------------------------------------------------------------------------------------------------------

static inline float size_of(float a) { return a < 0.0f ? -a : a; }
static inline int32_t floor_of(float a) { return (int32_t)a - (a < (float)(int32_t)a); }
static inline int32_t at_least(int32_t a, int32_t least) { return a > least ? a : least; }
static inline int32_t at_most(int32_t a, int32_t most) { return a < most ? a : most; }

static inline void keep(struct block *block, const struct chunk_view *chunk, uint32_t i, const vf place[3], vf half, vi word,
                        uint32_t lanes)
{
    const uint32_t count = block->count;
    vi_pack((uint32_t *)(void *)(block->x + count), vf_bits(place[0]), lanes);
    vi_pack((uint32_t *)(void *)(block->y + count), vf_bits(place[1]), lanes);
    vi_pack((uint32_t *)(void *)(block->z + count), vf_bits(place[2]), lanes);
    vi_pack((uint32_t *)(void *)(block->half + count), vf_bits(half), lanes);
    vi_pack(block->id + count, vi_add(vi_set(chunk->first + i), vi_lanes()), lanes);
    vi_pack(block->word + count, word, lanes);
    block->count += (uint32_t)__builtin_popcount(lanes);
}

// 1. Where points [first, last) lie, and how far their tents reach.
static void project(const struct average *average, const struct band *band, const struct chunk_view *chunk, uint32_t first,
                    uint32_t last, struct blocks *out)
{
    const struct view_args *view = &average->args->view;
    const uint32_t *points = pt_chunk_points(PT_DATA(average->call, average, positions), chunk);
    const uint32_t *surfels = (const uint32_t *)PT_DATA(average->call, average, surfels) + chunk->first;
    const uint32_t *drawn = average->args->sifted ? PT_DATA(average->call, average, drawn) : NULL;
    const float below = (float)(view->origin_y + (int32_t)band->first) - PT_AVERAGE_WIDEST - 1.0f;
    const float above = (float)(view->origin_y + (int32_t)band->end) + PT_AVERAGE_WIDEST + 1.0f;
    const vf one = vf_set(1.0f);
    const float bottom = (float)view->origin_y, top = (float)(view->origin_y + (int32_t)view->height);
    const struct pt_window window = pt_window_rows(view, below > bottom ? below : bottom, above < top ? above : top);
    out->narrow.count = out->middle.count = out->wide.count = 0;
    for (uint32_t i = first; i < last; i += PT_LANES) {
        vf p[3], at[3];
        pt_load_points(chunk, points, i, p);
        pt_project(view, chunk, p, at);
        vm some = vm_and(pt_within(&window, at), vm_first(pt_lanes_left(i, last)));
        if (!vm_bits(some))
            continue;
        some = pt_keep_drawn(chunk, drawn, i, some);
        const vi word = vi_load(surfels + i);
        if (chunk->cull)
            some = vm_and(some, vm_not(pt_faces_away(chunk, word, p)));
        if (!vm_bits(some))
            continue;
        const vf spacing = vf_gather(average->args->instance.spacing, vi_shr(word, PT_SPACING_SHIFT), some);
        const vf footprint = vf_select(some, vf_footprint(view, at[2]), one);
        const vf h = vf_max(vf_min((vf_set(PT_AVERAGE_TENT) * spacing) * vf_rcp(footprint), vf_set(PT_AVERAGE_WIDEST)), one);
        const vm narrow = vm_and(some, vf_le(h, one)), wide = vm_and(some, vf_lt(vf_set(1.5f), h));
        const vm middle = vm_and(some, vm_not(vm_or(narrow, wide)));
        if (vm_bits(narrow))
            keep(&out->narrow, chunk, i, at, h, word, vm_bits(narrow));
        if (vm_bits(middle))
            keep(&out->middle, chunk, i, at, h, word, vm_bits(middle));
        if (vm_bits(wide))
            keep(&out->wide, chunk, i, at, h, word, vm_bits(wide));
    }
}

// Unit normals of PT_LANES points, towards the viewer; 0 where a point has none.
static inline void turn_normals(const struct average *average, const struct block *block, uint32_t i, vf unit[3])
{
    const struct view_args *view = &average->args->view;
    const vf zero = vf_zero(), one = vf_set(1.0f);
    const vi word = vi_load(block->word + i);
    const vm known = vm_not(vi_eq(vi_and(word, vi_set(PT_NORMAL_BITS)), vi_set(PT_NORMAL_NONE)));
    vf n[3];
    vf_view_normal(&average->args->instance, word, n);
    const vf square = (n[0] * n[0] + n[1] * n[1]) + n[2] * n[2];
    const vm good = vm_and(known, vf_lt(vf_set(1e-20f), square));
    const vf scale = vf_rsqrt(vf_select(good, square, one));
    vf facing = zero - n[2];
    if (view->perspective) {
        const vf u = vf_set(view->ray_x0) + vf_set(view->ray_xs) * vf_load(block->x + i);
        const vf v = vf_set(view->ray_y0) + vf_set(view->ray_ys) * vf_load(block->y + i);
        facing = (n[0] * u + n[1] * v) - n[2];
    }
    const vm away = vf_lt(zero, facing);
    for (int k = 0; k < 3; k++) {
        const vf towards = n[k] * scale;
        unit[k] = vf_select(good, vf_select(away, zero - towards, towards), zero);
    }
}

// 2. What `some` of PT_LANES points have to add.
static inline void set_terms(const struct average *average, const struct block *block, uint32_t i, vm some, struct terms *out)
{
    const struct instance_args *instance = &average->args->instance;
    const vf scale = vf_set(PT_SUM_SCALE), most = vf_set(PT_SUM_BRIGHTEST), one = vf_set(1.0f);
    vf color[4], normal[4] = {vf_zero(), vf_zero(), vf_zero(), one};
    float halves[2][PT_LANES][4];
    pt_albedo(instance, PT_DATA(average->call, average, colors), vi_load(block->id + i), vi_set(0), some, color);
    for (int k = 0; k < 3 && instance->color_format != 1; k++) {
        color[k] = vf_max(vf_min(color[k], most), vf_zero() - most);
        normal[3] = vf_max(normal[3], vf_abs(color[k]));
    }
    color[3] = one;
    if (average->args->normals)
        turn_normals(average, block, i, normal);
    for (int k = 0; k < 4; k++) {
        color[k] = color[k] * scale;
        normal[k] = normal[k] * scale;
    }
    vf_store4(halves[0][0], color, PT_ALL);
    vf_store4(halves[1][0], normal, PT_ALL);
    for (uint32_t lane = 0; lane < PT_LANES; lane++)
        for (uint32_t k = 0; k < 2; k++)
            memcpy(out->each[lane] + 4 * k, halves[k][lane], sizeof halves[k][lane]);
}

static void empty_pixel(const struct average *average, struct band *band, size_t at)
{
    if (!band->emptied)
        memset(band->wide, 0, average->rows * average->stride * SUMS * sizeof *band->wide);
    band->emptied = 1;
    for (int k = 0; k < SUMS; k++) {
        band->wide[SUMS * at + (size_t)k] += band->sums[SUMS * at + (size_t)k];
        band->sums[SUMS * at + (size_t)k] = 0;
    }
}

static inline void add_pixel(const struct average *average, struct band *band, size_t at, const float terms[SUMS], float weight)
{
    vi_eight *sums = (vi_eight *)(void *)(band->sums + SUMS * at);
    const vi_eight sum = *sums + __builtin_convertvector(*(const vf_eight *)(const void *)terms * weight, vi_eight);
    *sums = sum;
    if (__builtin_expect(sum[ROOM] >= FULL, 0))
        empty_pixel(average, band, at);
}

// One side of a tent, at pixels whose middles lie so far from the point.
static inline vf tent(vf beside, vf share) { return vf_max(vf_set(1.0f) - vf_abs(beside) * share, vf_zero()); }

// Pixels and weights, packed, so that no branch waits for how many of each point count.
struct counted {
    uint32_t count, pixel[10 * PT_LANES], lane[10 * PT_LANES];
    float weight[10 * PT_LANES];
};

// 3. To those of `side` x `side` pixels around whose surface is as deep.
static inline __attribute__((always_inline)) void add_few(const struct average *average, struct band *band,
                                                          const struct block *block, uint32_t side)
{
    const struct view_args *view = &average->args->view;
    const vi width = vi_set(view->width), rows = vi_set(band->end - band->first), stride = vi_set((uint32_t)average->stride);
    const vf half = vf_set(0.5f), one = vf_set(1.0f);
    const float *depths = (const float *)(const void *)band->depths;
    struct counted counted;
    struct terms terms;
    for (uint32_t i = 0; i < block->count; i += PT_LANES) {
        const vm lanes = vm_first(pt_lanes_left(i, block->count));
        const vf x = vf_load(block->x + i), y = vf_load(block->y + i), z = vf_load(block->z + i);
        const vf h = side == 2 ? one : vf_load(block->half + i), share = side == 2 ? one : vf_rcp(vf_select(lanes, h, one));
        const vi left = vi_add(vf_int(vf_floor((x - half) - h)), vi_set(1)),
                 low = vi_add(vf_int(vf_floor((y - half) - h)), vi_set(1));
        vm any = vm_of_bits(0);
        counted.count = 0;
        for (uint32_t k = 0; k < side * side; k++) {
            const vi px = vi_add(left, vi_set(k % side)), py = vi_add(low, vi_set(k / side));
            const vi column = vi_sub(px, vi_set((uint32_t)view->origin_x));
            const vi row = vi_sub(py, vi_set((uint32_t)view->origin_y + band->first));
            vm some = vm_and(lanes, vm_and(vi_lt_unsigned(column, width), vi_lt_unsigned(row, rows)));
            const vi at = vi_add(vi_mul(row, stride), column), twice = vi_add(at, at);
            some = vm_and(some, vm_and(vf_le(vf_gather(depths, twice, some), z), vf_le(z, vf_gather(depths + 1, twice, some))));
            const vf weight = tent((vi_convert(py) + half) - y, share) * tent((vi_convert(px) + half) - x, share);
            some = vm_and(some, vf_lt(vf_zero(), weight));
            const uint32_t bits = vm_bits(some);
            vi_pack(counted.pixel + counted.count, at, bits);
            vi_pack(counted.lane + counted.count, vi_lanes(), bits);
            vi_pack((uint32_t *)(void *)(counted.weight + counted.count), vf_bits(weight), bits);
            counted.count += (uint32_t)__builtin_popcount(bits);
            any = vm_or(any, some);
        }
        if (!counted.count)
            continue;
        set_terms(average, block, i, any, &terms);
        for (uint32_t k = 0; k < counted.count; k++)
            add_pixel(average, band, counted.pixel[k], terms.each[counted.lane[k]], counted.weight[k]);
    }
}

// The same to all pixels under wider tents: such points are few to a pixel.
static void add_wide(const struct average *average, struct band *band, const struct block *block)
{
    const struct view_args *view = &average->args->view;
    const int32_t first = view->origin_y + (int32_t)band->first, end = view->origin_y + (int32_t)band->end;
    const int32_t begin = view->origin_x, stop = view->origin_x + (int32_t)view->width;
    struct terms terms;
    for (uint32_t i = 0; i < block->count; i++) {
        const float x = block->x[i], y = block->y[i], z = block->z[i];
        const float h = block->half[i], share = pt_rcp(h);
        const int32_t left = at_least(floor_of((x - 0.5f) - h) + 1, begin), right = at_most(floor_of((x - 0.5f) + h), stop - 1);
        const int32_t low = at_least(floor_of((y - 0.5f) - h) + 1, first), high = at_most(floor_of((y - 0.5f) + h), end - 1);
        if (i % PT_LANES == 0)
            set_terms(average, block, i, vm_first(pt_lanes_left(i, block->count)), &terms);
        for (int32_t py = low; py <= high; py++) {
            const float tall = 1.0f - size_of(((float)py + 0.5f) - y) * share;
            const size_t row = (size_t)(py - first) * average->stride;
            for (int32_t px = left; px <= right; px++) {
                const size_t at = row + (size_t)(px - begin);
                const float across = 1.0f - size_of(((float)px + 0.5f) - x) * share;
                if (band->depths[at].nearest <= z && z <= band->depths[at].farthest)
                    add_pixel(average, band, at, terms.each[i % PT_LANES], pt_max(tall, 0.0f) * pt_max(across, 0.0f));
            }
        }
    }
}

// ---- means ----------------------------------------------------------------------------------------------------------------

// On the side that the pixel's own normal lies on.
static void mean_normal(const struct view_args *view, const vf sum[3], uint32_t x, uint32_t y, vm with, vf n[4])
{
    const vf zero = vf_zero(), one = vf_set(1.0f);
    const vf square = (sum[0] * sum[0] + sum[1] * sum[1]) + sum[2] * sum[2];
    const vm good = vm_and(with, vf_le(one, square));
    const vf scale = vf_rsqrt(vf_select(good, square, one));
    vf ray[2], facing = zero - n[2];
    if (view->perspective) {
        vf_ray(view, x, y, ray);
        facing = (n[0] * ray[0] + n[1] * ray[1]) - n[2];
    }
    const vm away = vf_lt(zero, facing);
    for (int k = 0; k < 3; k++) {
        const vf mean = sum[k] * scale;
        n[k] = vf_select(good, vf_select(away, zero - mean, mean), n[k]);
    }
}

static void close_band(const struct average *average, const struct band *band)
{
    const struct average_args *args = average->args;
    const uint64_t *keys = PT_DATA(average->call, average, keys);
    const uint32_t *from = PT_DATA(average->call, average, from);
    float *normals = PT_DATA(average->call, average, normal), *albedo = PT_DATA(average->call, average, albedo);
    const vf one = vf_set(1.0f);
    for (uint32_t y = band->first; y < band->end; y++)
        for (uint32_t x = 0; x < args->view.width; x += PT_LANES) {
            const size_t at = (size_t)y * args->view.width + x;
            vf sums[SUMS], color[4], own[3], n[4];
            vi id;
            const vm ours = pt_of_instance(keys + at, &args->instance, pt_lanes_left(x, args->view.width), &id);
            if (!vm_bits(ours))
                continue;
            const size_t first = SUMS * ((y - band->first) * average->stride + x);
            pt_take_sums(band->sums + first, band->emptied ? band->wide + first : NULL, ours, sums);
            const vm reached = vm_and(ours, vf_le(one, sums[3]));
            const vf share = vf_rcp(vf_select(reached, sums[3], one));
            for (int k = 0; k < 3; k++)
                color[k] = sums[k] * share;
            color[3] = one;
            if (vm_bits(ours) != vm_bits(reached)) {
                pt_albedo(&args->instance, PT_DATA(average->call, average, colors), id, id, ours, own);
                for (int k = 0; k < 3; k++)
                    color[k] = vf_select(reached, color[k], own[k]);
            }
            vf_store4(albedo + 4 * at, color, vm_bits(ours));
            const vm measured = vm_and(reached, vm_not(pt_filled(pt_source_of(from, at), at, ours)));
            if (!args->normals || !vm_bits(measured))
                continue;
            vf_load4(normals + 4 * at, n);
            mean_normal(&args->view, sums + 4, x, y, measured, n);
            vf_store4(normals + 4 * at, n, vm_bits(measured));
        }
}

// ---- the walk -------------------------------------------------------------------------------------------------------------

static int may_reach(const struct view_args *view, const struct chunk_view *chunk, const struct band *band)
{
    const uint32_t reach = (uint32_t)PT_AVERAGE_WIDEST + 1, end = chunk->row_end ? chunk->row_end : view->height;
    return chunk->row_first < band->end + reach && band->first < end + reach;
}

static void average_bands(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct average *average = context;
    const struct chunk_view *chunks = PT_DATA(average->call, average, chunks);
    const uint32_t *rect = average->args->view.rect;
    const uint32_t count = (uint32_t)(average->call->buffers[PT_BUF_average_chunks]->size / sizeof *chunks);
    const size_t pixels = average->rows * average->stride;
    struct blocks blocks;
    char *memory = average->memory + thread * average->thread_bytes;
    for (uint32_t b = begin; b < end && !pt_cpu_cancelled(average->call); b++) {
        struct band band = {.first = rect[1] + b * average->rows, .wide = (int64_t *)(void *)memory};
        band.end = band.first + average->rows < rect[3] ? band.first + average->rows : rect[3];
        band.sums = (int32_t *)(void *)(band.wide + SUMS * pixels);
        band.depths = (struct depths *)(void *)(band.sums + SUMS * pixels);
        if (!open_band(average, &band))
            continue;
        for (uint32_t c = 0; c < count; c++) {
            const struct chunk_view *chunk = &chunks[c];
            if (!may_reach(&average->args->view, chunk, &band))
                continue;
            pt_pool_look(average->call->pool);
            for (uint32_t first = 0; first < chunk->count; first += BLOCK) {
                project(average, &band, chunk, first, chunk->count - first < BLOCK ? chunk->count : first + BLOCK, &blocks);
                add_few(average, &band, &blocks.narrow, 2);
                add_few(average, &band, &blocks.middle, 3);
                add_wide(average, &band, &blocks.wide);
            }
        }
        close_band(average, &band);
    }
}

int PT_KERNEL_ENTRY(average)(const struct pt_cpu_call *call)
{
    struct average average = {.call = call, .args = call->arguments};
    const struct view_args *view = &average.args->view;
    if (view->rect[0] >= view->rect[2] || view->rect[1] >= view->rect[3] || !call->buffers[PT_BUF_average_chunks]->size)
        return PATINA_OK;
    const uint32_t fit = BAND_PIXELS / view->width;
    average.rows = fit < BAND_LEAST ? BAND_LEAST : fit < BAND_MOST ? fit : BAND_MOST;
    average.stride = ((size_t)view->width + PT_LANES - 1) / PT_LANES * PT_LANES + PT_LANES;
    average.thread_bytes = average.rows * average.stride * (SUMS * (sizeof(int64_t) + sizeof(int32_t)) + sizeof(struct depths));
    average.thread_bytes = (average.thread_bytes + 63) / 64 * 64;
    average.memory = pt_cpu_scratch(call, 0, pt_pool_threads(call->pool) * average.thread_bytes);
    if (!average.memory)
        return PATINA_ERROR_MEMORY;
    pt_parallel(call->pool, (view->rect[3] - view->rect[1] + average.rows - 1) / average.rows, 1, average_bands, &average);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
