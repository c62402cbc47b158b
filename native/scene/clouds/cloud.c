// SPDX-License-Identifier: GPL-3.0-or-later
// Building a cloud: box -> Morton order -> chunks (strata, boxes, spacing) -> surfels and cones -> colours.
#include "cloud.h"
#include "base/color.h"
#include "base/descriptor.h"
#include "base/platform.h"
#include "base/progress.h"
#include "base/vector.h"
#include "paged.h"
#include "parts.h"
#include "shared/discs.h"
#include "shared/words.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// ---- reading the caller's arrays ---------------------------------------------------------------------------------

static const uint8_t *element(const patina_array *array, uint64_t index) // stride was made explicit by pt_check_array
{
    return (const uint8_t *)array->data + index * array->stride;
}

// A point's normal; 0 when it has none (zero or not finite).
static int read_normal(const patina_array *array, uint64_t index, double n[3])
{
    pt_read_vector(array, index, n);
    return pt_finite3(n) && (n[0] != 0.0 || n[1] != 0.0 || n[2] != 0.0);
}

// 0 or more and finite.
static float read_radius(const patina_array *array, uint64_t index)
{
    float f;
    double value;
    memcpy(&f, element(array, index), sizeof f);
    if (array->type == PATINA_FLOAT64) {
        memcpy(&value, element(array, index), sizeof value);
        f = (float)value;
    }
    return f > 0.0f ? fminf(f, PT_DISC_MOST) : 0.0f;
}

// In 1/255, rounded; what is not a number is opaque.
static uint8_t read_opacity(const patina_array *array, uint64_t index)
{
    const uint8_t *at = element(array, index);
    double value = 1.0;
    float f;
    uint16_t v;
    switch (array->type) {
    case PATINA_UINT8: return *at;
    case PATINA_UINT16:
        memcpy(&v, at, sizeof v);
        value = v / 65535.0;
        break;
    case PATINA_FLOAT32:
        memcpy(&f, at, sizeof f);
        value = (double)f;
        break;
    default: memcpy(&value, at, sizeof value);
    }
    return isnan(value) ? 255 : (uint8_t)(255.0 * fmin(fmax(value, 0.0), 1.0) + 0.5);
}

// Points of opacity 0 would be layers that show nothing.
int pt_cloud_draws(const patina_cloud_desc *desc, uint64_t index, const double p[3])
{
    return pt_finite3(p) && (!desc->opacity.data || read_opacity(&desc->opacity, index));
}

// ---- the build -----------------------------------------------------------------------------------------------------

struct build {
    patina_cloud_desc desc;
    struct patina_cloud *cloud;
    struct pt_pool *pool;
    struct patina_progress *progress;
    uint64_t *words, *scratch; // Morton code << 32 | id of the drawn points
    uint32_t drawn;
    enum pt_build_kind kind;
    const struct pt_build_part *part; // of a larger cloud, or NULL
    uint32_t cell_bits;               // the grid of cells has 2^cell_bits cells a side
    uint32_t *cells;                  // first word of each cell, and one past the last
    uint32_t *begins;                 // first word of each chunk
    uint32_t chunk_room;              // chunks that the arrays have room for
    double box_min[3], box_max[3];
    struct block {
        uint32_t drawn, offset;
        uint64_t invalid_positions;
        double box_min[3], box_max[3];
    } * blocks;
    uint32_t block_count;
    struct tally { // of the points of a chunk
        uint32_t invalid_normals, invalid_colors, translucent;
        float radius_most;
    } * tallies;
    atomic_uint chunks_done;
    double cell[3], cell_min[3]; // of the Morton grid being coded
};

enum {
    BLOCK_POINTS = 1 << 16,
    LEAST_POINTS = 16,
    SMALL_CLOUD = 1 << 15,
    AHEAD = 16 // points that are asked for before they are read
};

static void position(const struct build *build, uint64_t index, double p[3]) { pt_cloud_position(&build->desc, index, p); }

static int is_drawn(const struct build *build, uint64_t index, const double p[3])
{
    return build->part || pt_cloud_draws(&build->desc, index, p);
}

static void box_reset(double box_min[3], double box_max[3])
{
    for (int i = 0; i < 3; i++) {
        box_min[i] = INFINITY;
        box_max[i] = -INFINITY;
    }
}

static void box_add(double box_min[3], double box_max[3], const double lower[3], const double upper[3])
{
    for (int i = 0; i < 3; i++) {
        box_min[i] = lower[i] < box_min[i] ? lower[i] : box_min[i];
        box_max[i] = upper[i] > box_max[i] ? upper[i] : box_max[i];
    }
}

static void measure_blocks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct build *build = context;
    (void)thread;
    for (uint32_t b = begin; b < end && !pt_progress_cancelled(build->progress); b++) {
        struct block *block = &build->blocks[b];
        uint64_t first = (uint64_t)b * BLOCK_POINTS;
        uint64_t last = first + BLOCK_POINTS < build->desc.count ? first + BLOCK_POINTS : build->desc.count;
        box_reset(block->box_min, block->box_max);
        for (uint64_t i = first; i < last; i++) {
            double p[3];
            position(build, i, p);
            block->invalid_positions += !pt_finite3(p);
            if (!is_drawn(build, i, p))
                continue;
            box_add(block->box_min, block->box_max, p, p);
            block->drawn++;
        }
    }
}

static uint32_t grid_code(const struct build *build, const double p[3])
{
    uint32_t grid[3];
    for (int i = 0; i < 3; i++) {
        double g = (p[i] - build->cell_min[i]) * build->cell[i];
        grid[i] = g > 0.0 ? g < 1023.0 ? (uint32_t)g : 1023u : 0u;
    }
    return pt_morton_code(grid[0], grid[1], grid[2]);
}

static void set_grid(struct build *build, const double box_min[3], const double box_max[3])
{
    double edge = fmax(box_max[0] - box_min[0], fmax(box_max[1] - box_min[1], box_max[2] - box_min[2]));
    for (int i = 0; i < 3; i++) {
        build->cell_min[i] = box_min[i];
        build->cell[i] = edge > 0.0 && isfinite(1024.0 / edge) ? 1024.0 / edge : 0.0; // cubes keep Morton neighbours near
    }
}

static void code_blocks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct build *build = context;
    (void)thread;
    for (uint32_t b = begin; b < end; b++) {
        uint64_t first = (uint64_t)b * BLOCK_POINTS;
        uint64_t last = first + BLOCK_POINTS < build->desc.count ? first + BLOCK_POINTS : build->desc.count;
        uint64_t *out = build->words + build->blocks[b].offset;
        for (uint64_t i = first; i < last; i++) {
            double p[3];
            position(build, i, p);
            if (is_drawn(build, i, p))
                *out++ = (uint64_t)grid_code(build, p) << 32 | i;
        }
    }
}

static double side(const double box_min[3], const double box_max[3])
{
    return fmax(box_max[0] - box_min[0], fmax(box_max[1] - box_min[1], box_max[2] - box_min[2]));
}

// Does an eighth of these Morton-ordered points lie in a box 32 times smaller than that of all? Told by at most 16 of each, of small
// clouds by all: a single stray, 100 radii away and not looked at, made one chunk of a thousand points that seemed to lie where
// its middle is, and their gaps stayed open.
static int is_uneven(const struct build *build, uint32_t begin, uint32_t count)
{
    double box_min[3], box_max[3], least = INFINITY;
    box_reset(box_min, box_max);
    for (uint32_t part = 0; part < 8; part++) {
        uint32_t first = (uint32_t)((uint64_t)count * part / 8), last = (uint32_t)((uint64_t)count * (part + 1) / 8);
        double low[3], high[3], p[3];
        box_reset(low, high);
        for (uint32_t i = first; i < last; i += build->drawn <= SMALL_CLOUD ? 1 : (last - first + 15) / 16) {
            position(build, (uint32_t)build->words[begin + i], p);
            box_add(low, high, p, p);
        }
        least = fmin(least, side(low, high));
        box_add(box_min, box_max, low, high);
    }
    return 32.0 * least < side(box_min, box_max);
}

// Points that share a grid cell (an outlier stretched the box, say) are ordered by a finer grid of their own.
static int refine_range(struct build *build, uint32_t begin, uint32_t end, int depth)
{
    for (uint32_t i = begin, run; i < end; i = run) {
        for (run = i + 1; run < end && build->words[run] >> 32 == build->words[i] >> 32; run++)
            ;
        int few = run - i <= PT_CHUNK_POINTS / 4;
        if (depth > 8 || (few && (run - i < 2 * LEAST_POINTS || !is_uneven(build, i, run - i))))
            continue;
        double box_min[3], box_max[3], p[3];
        box_reset(box_min, box_max);
        for (uint32_t k = i; k < run; k++) {
            position(build, (uint32_t)build->words[k], p);
            box_add(box_min, box_max, p, p);
        }
        if (!memcmp(box_min, box_max, sizeof box_min))
            continue; // coincident
        set_grid(build, box_min, box_max);
        for (uint32_t k = i; k < run; k++) {
            uint32_t id = (uint32_t)build->words[k];
            position(build, id, p);
            build->words[k] = (uint64_t)grid_code(build, p) << 32 | id;
        }
        int error = pt_morton_sort(build->pool, build->words + i, build->scratch, run - i);
        if (error || (error = refine_range(build, i, run, depth + 1)))
            return error;
    }
    return PATINA_OK;
}

// No chunk reaches over a cell: what a chunk's points have in common (float32 offsets, spacing, normals) stays local where
// a scan is sparse or has strays. 8 x 8 x 8 cells when they hold 256 points each on average, fewer for small clouds.
static int find_cells(struct build *build)
{
    while (build->kind != PT_BUILD_EVENLY && build->cell_bits < 3 && build->drawn >> (3 * build->cell_bits + 3) >= 256)
        build->cell_bits++;
    uint32_t count = 1u << 3 * build->cell_bits, shift = 62 - 3 * build->cell_bits;
    build->cells = malloc((count + 1) * sizeof *build->cells);
    if (!build->cells)
        return PATINA_ERROR_MEMORY;
    for (uint32_t cell = 0; cell <= count; cell++) {
        uint32_t low = 0, high = build->drawn;
        while (low < high) {
            uint32_t middle = low + (high - low) / 2;
            if (build->words[middle] >> shift < cell)
                low = middle + 1;
            else
                high = middle;
        }
        build->cells[cell] = low;
    }
    return PATINA_OK;
}

static int cancelled(const struct build *build)
{
    return pt_progress_cancelled(build->progress) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}

static int sort_points(struct build *build)
{
    size_t bytes = (size_t)build->drawn * sizeof *build->words;
    build->words = build->part ? build->part->words : pt_pages_alloc(bytes);
    build->scratch = build->part ? build->part->scratch : pt_pages_alloc(bytes);
    if (!build->words || !build->scratch)
        return PATINA_ERROR_MEMORY;
    set_grid(build, build->box_min, build->box_max);
    pt_parallel(build->pool, build->block_count, 1, code_blocks, build);
    pt_progress_set(build->progress, 0.2);
    int error = cancelled(build);
    if (!error)
        error = pt_morton_sort(build->pool, build->words, build->scratch, build->drawn);
    if (!error)
        error = cancelled(build);
    if (!error)
        error = find_cells(build);
    if (!error)
        error = refine_range(build, 0, build->drawn, 0);
    if (!build->part)
        pt_pages_free(build->scratch, bytes);
    build->scratch = NULL;
    pt_progress_set(build->progress, 0.5);
    return error;
}

// ---- chunks --------------------------------------------------------------------------------------------------------

uint32_t pt_chunk_prefix(const struct pt_chunk *chunk, uint32_t strata)
{
    uint32_t stride = 1u << (PT_STRATA - strata);
    return (chunk->count + stride - 1) / stride;
}

// Slot order of `count` Morton-ordered points: every 32nd, then the rest of every 16th, ... Each stratum is in Morton order.
static void stratify(const uint64_t *words, uint32_t count, uint32_t *order)
{
    uint32_t slot = 0;
    for (uint32_t stratum = 1; stratum <= PT_STRATA; stratum++) {
        uint32_t stride = 1u << (PT_STRATA - stratum);
        for (uint32_t i = stratum == 1 ? 0 : stride; i < count; i += stratum == 1 ? stride : 2 * stride)
            order[slot++] = (uint32_t)words[i];
    }
}

static void fill_chunk(struct build *build, struct pt_chunk *chunk, const uint64_t *words)
{
    struct patina_cloud *cloud = build->cloud;
    uint32_t *order = cloud->order + chunk->first;
    float *axis[3];
    for (int k = 0; k < 3; k++)
        axis[k] = (float *)cloud->positions + 3 * (size_t)chunk->first + (size_t)k * chunk->padded;
    stratify(words, chunk->count, order);

    double box_min[3], box_max[3], p[3];
    box_reset(box_min, box_max);
    for (uint32_t i = 0; i < chunk->count; i++) {
        __builtin_prefetch(element(&build->desc.position, order[i + AHEAD < chunk->count ? i + AHEAD : i]));
        position(build, order[i], p);
        box_add(box_min, box_max, p, p);
    }
    for (int k = 0; k < 3; k++) { // exact where the coordinates' spread leaves a bit free: see the 5e6 m case
        chunk->origin[k] = box_min[k] + 0.5 * (box_max[k] - box_min[k]);
        chunk->box_min[k] = (float)(box_min[k] - chunk->origin[k]); // roundings keep the order: no offset lies beyond
        chunk->box_max[k] = (float)(box_max[k] - chunk->origin[k]);
    }
    for (uint32_t i = 0; i < chunk->padded; i++) {
        if (i >= chunk->count)
            order[i] = order[chunk->count - 1];
        position(build, order[i], p);
        for (int k = 0; k < 3; k++) {
            float offset = (float)(p[k] - chunk->origin[k]);
            axis[k][i] = offset;
        }
    }
    chunk->spacing = pt_spacing_estimate(axis[0], axis[1], axis[2], chunk->count);
}

// ---- normals -------------------------------------------------------------------------------------------------------

// Rounds every valid normal of the chunk's points into surfels; the cone is that of the rounded normals.
static void surfel_chunk(struct build *build, uint32_t index)
{
    struct patina_cloud *cloud = build->cloud;
    struct pt_chunk *chunk = &cloud->chunks[index];
    const uint32_t *order = cloud->order + chunk->first;
    uint32_t *surfels = cloud->surfels + chunk->first;
    uint32_t class = pt_class_of_spacing((double)chunk->spacing, cloud->spacing_base) << PT_SPACING_SHIFT;
    double n[3];
    for (uint32_t i = 0; i < chunk->count; i++) {
        uint32_t bits = PT_NORMAL_NONE;
        if (build->desc.normal.data && read_normal(&build->desc.normal, order[i], n))
            bits = pt_encode_normal(n);
        else
            build->tallies[index].invalid_normals++;
        surfels[i] = bits | class;
    }
    for (uint32_t i = chunk->count; i < chunk->padded; i++)
        surfels[i] = surfels[chunk->count - 1];
    pt_chunk_cone(chunk, surfels);
}

// ---- other attributes ----------------------------------------------------------------------------------------------------

#define MOST_COLOR 65504.0f

static void read_color(const patina_array *array, uint64_t index, float rgb[3])
{
    const uint8_t *at = element(array, index);
    for (int k = 0; k < 3; k++) {
        if (array->type == PATINA_FLOAT32) {
            memcpy(&rgb[k], at + 4 * k, 4);
        } else if (array->type == PATINA_UINT16) {
            uint16_t v;
            memcpy(&v, at + 2 * k, 2);
            rgb[k] = (float)pt_linear_of_srgb(v / 65535.0);
        }
    }
}

size_t pt_color_bytes(const struct patina_cloud *cloud)
{
    return cloud->slots * pt_color_size(cloud->color_format) + 4; // kernels read bytes as words
}

// Returns whether the colour is one.
static int take_color(struct patina_cloud *cloud, const patina_array *color, uint32_t slot)
{
    if (cloud->color_format == PT_COLOR_SRGB8) {
        memcpy((uint8_t *)cloud->colors + 3 * (size_t)slot, element(color, pt_number_of(cloud, slot)), 3);
        return 1;
    }
    float *rgb = (float *)cloud->colors + 3 * (size_t)slot;
    int valid = 1;
    read_color(color, pt_number_of(cloud, slot), rgb);
    for (int k = 0; k < 3; k++)
        if (!isfinite(rgb[k])) {
            valid = 0;
        } else { // sums of lit neighbours must stay finite, and Blender's half floats too
            rgb[k] = fmaxf(fminf(rgb[k], MOST_COLOR), -MOST_COLOR);
        }
    if (!valid) // as what has no color
        memset(rgb, 0, 3 * sizeof *rgb);
    return valid;
}

static void attribute_chunk(struct build *build, uint32_t index)
{
    struct patina_cloud *cloud = build->cloud;
    const struct pt_chunk *chunk = &cloud->chunks[index];
    struct tally *tally = &build->tallies[index];
    for (uint32_t i = 0; i < chunk->padded; i++) {
        const uint32_t slot = chunk->first + i;
        const uint64_t from = pt_number_of(cloud, slot);
        if (build->desc.opacity.data && cloud->opacities) {
            cloud->opacities[slot] = read_opacity(&build->desc.opacity, from);
            tally->translucent |= cloud->opacities[slot] < 255;
        }
        if (build->desc.radius.data && cloud->radii) {
            cloud->radii[slot] = read_radius(&build->desc.radius, from);
            tally->radius_most = fmaxf(tally->radius_most, cloud->radii[slot]);
        }
        if (cloud->color_format)
            tally->invalid_colors += !take_color(cloud, &build->desc.color, slot) && i < chunk->count;
    }
}

static void attribute_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct build *build = context;
    (void)thread;
    for (uint32_t c = begin; c < end && !pt_progress_cancelled(build->progress); c++)
        attribute_chunk(build, c);
}

// All but positions.
static void finish_chunk(struct build *build, uint32_t index)
{
    struct patina_cloud *cloud = build->cloud;
    surfel_chunk(build, index);
    attribute_chunk(build, index);
    pt_cloud_values_of(cloud, &build->desc, index);
    uint32_t *order = cloud->order + cloud->chunks[index].first;
    for (uint32_t i = 0; build->part && i < cloud->chunks[index].padded; i++)
        memcpy(&order[i], element(&build->part->numbers, order[i]), sizeof *order);
}

static void finish_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct build *build = context;
    (void)thread;
    for (uint32_t c = begin; c < end && !pt_progress_cancelled(build->progress); c++)
        finish_chunk(build, c);
}

static void fill_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct build *build = context;
    (void)thread;
    for (uint32_t c = begin; c < end && !pt_progress_cancelled(build->progress); c++) {
        fill_chunk(build, &build->cloud->chunks[c], build->words + build->begins[c]);
        if (build->part) // its records are at hand now
            finish_chunk(build, c);
        uint32_t done = atomic_fetch_add_explicit(&build->chunks_done, 1, memory_order_relaxed);
        pt_progress_raise(build->progress, 0.5 + 0.3 * done / build->cloud->chunk_count);
    }
}

// ---- create --------------------------------------------------------------------------------------------------------

static int add_chunk(struct build *build, uint32_t begin, uint32_t count)
{
    struct patina_cloud *cloud = build->cloud;
    if (cloud->chunk_count == build->chunk_room) {
        uint32_t room = build->chunk_room ? 2 * build->chunk_room : 64;
        struct pt_chunk *chunks = realloc(cloud->chunks, room * sizeof *chunks);
        cloud->chunks = chunks ? chunks : cloud->chunks;
        uint32_t *begins = realloc(build->begins, room * sizeof *begins);
        build->begins = begins ? begins : build->begins;
        if (!chunks || !begins)
            return PATINA_ERROR_MEMORY;
        build->chunk_room = room;
    }
    build->begins[cloud->chunk_count] = begin;
    struct pt_chunk *chunk = &cloud->chunks[cloud->chunk_count++];
    *chunk = (struct pt_chunk){.count = count, .first = (uint32_t)cloud->slots};
    chunk->padded = (count + PT_CHUNK_ALIGN - 1) / PT_CHUNK_ALIGN * PT_CHUNK_ALIGN;
    cloud->slots += chunk->padded;
    return PATINA_OK;
}

// Offsets are as fine as their chunk is small: an uneven one is cut, and its parts again. Surfaces never are; where distances
// span decades, the points at the densest place keep their digits.
static int cut_uneven(struct build *build, uint32_t begin, uint32_t count)
{
    uint32_t half = count / 2;
    if (half < LEAST_POINTS || !is_uneven(build, begin, count))
        return add_chunk(build, begin, count);
    int error = cut_uneven(build, begin, half);
    return error ? error : cut_uneven(build, begin + half, count - half);
}

static size_t opacity_bytes(const struct patina_cloud *cloud) { return cloud->slots + 4; } // kernels read words

// An array of ones says nothing.
static void drop_opaque(struct patina_cloud *cloud, const struct build *build)
{
    for (uint32_t c = 0; c < cloud->chunk_count; c++)
        if (build->tallies[c].translucent)
            return;
    if (cloud->opacities)
        cloud->info.bytes -= opacity_bytes(cloud);
    pt_pages_free(cloud->opacities, opacity_bytes(cloud));
    cloud->opacities = NULL;
    cloud->info.has_opacities = 0;
}

// Cuts the cells into chunks, as even as PT_CHUNK_POINTS allows.
static int cut_chunks(struct build *build)
{
    for (uint32_t cell = 0; cell < 1u << 3 * build->cell_bits; cell++) {
        uint32_t begin = build->cells[cell], count = build->cells[cell + 1] - begin;
        uint32_t parts = (count + PT_CHUNK_POINTS - 1) / PT_CHUNK_POINTS;
        for (uint32_t part = 0; part < parts; part++) {
            uint32_t first = (uint32_t)((uint64_t)count * part / parts);
            uint32_t last = (uint32_t)((uint64_t)count * (part + 1) / parts);
            int error = build->kind == PT_BUILD_EVENLY ? add_chunk(build, begin + first, last - first)
                                                       : cut_uneven(build, begin + first, last - first);
            if (error)
                return error;
        }
    }
    return PATINA_OK;
}

static int allocate(struct build *build)
{
    struct patina_cloud *cloud = build->cloud;
    if (cloud->slots > 0x7FFFFFFF) // gathers take signed indices
        return PATINA_ERROR_TOO_MANY_POINTS;
    build->tallies = calloc(cloud->chunk_count + 1, sizeof *build->tallies);
    cloud->positions = pt_pages_alloc(cloud->slots * 12);
    cloud->order = pt_pages_alloc(cloud->slots * 4);
    cloud->surfels = pt_pages_alloc(cloud->slots * 4);
    cloud->colors = cloud->color_format ? pt_pages_alloc(pt_color_bytes(cloud)) : NULL;
    cloud->opacities = cloud->info.has_opacities ? pt_pages_alloc(opacity_bytes(cloud)) : NULL;
    cloud->radii = cloud->info.has_radii ? pt_pages_alloc(cloud->slots * 4) : NULL;
    if (!build->tallies || !cloud->positions || !cloud->order || !cloud->surfels || (cloud->color_format && !cloud->colors) ||
        (cloud->info.has_opacities && !cloud->opacities) || (cloud->info.has_radii && !cloud->radii))
        return PATINA_ERROR_MEMORY;
    cloud->info.bytes = cloud->slots * (cloud->radii ? 24 : 20) + (cloud->colors ? pt_color_bytes(cloud) : 0) +
                        (cloud->opacities ? opacity_bytes(cloud) : 0) + cloud->chunk_count * sizeof *cloud->chunks;
    return pt_cloud_values_begin(cloud, &build->desc);
}

// How many points are drawn, of each block too, and their box.
static int measure(struct build *build)
{
    build->block_count = (uint32_t)((build->desc.count + BLOCK_POINTS - 1) / BLOCK_POINTS);
    build->blocks = calloc(build->block_count ? build->block_count : 1, sizeof *build->blocks);
    if (!build->blocks)
        return PATINA_ERROR_MEMORY;
    if (!build->part)
        pt_parallel(build->pool, build->block_count, 1, measure_blocks, build);
    box_reset(build->box_min, build->box_max);
    for (uint32_t b = 0; b < build->block_count; b++) {
        if (build->part) {
            const uint64_t left = build->desc.count - (uint64_t)b * BLOCK_POINTS;
            build->blocks[b].drawn = (uint32_t)(left < BLOCK_POINTS ? left : BLOCK_POINTS);
            memcpy(build->blocks[b].box_min, build->part->box_min, sizeof build->part->box_min);
            memcpy(build->blocks[b].box_max, build->part->box_max, sizeof build->part->box_max);
        }
        build->blocks[b].offset = build->drawn;
        build->drawn += build->blocks[b].drawn;
        box_add(build->box_min, build->box_max, build->blocks[b].box_min, build->blocks[b].box_max);
    }
    pt_progress_set(build->progress, 0.1);
    return cancelled(build);
}

static int build_cloud(struct build *build)
{
    struct patina_cloud *cloud = build->cloud;
    int error = measure(build);
    if (error || (error = sort_points(build)) || (error = cut_chunks(build)) || (error = allocate(build)))
        return error;
    pt_parallel(build->pool, cloud->chunk_count, 1, fill_chunks, build);
    if ((error = cancelled(build)))
        return error;
    if (!build->part && (error = pt_cloud_settle_built(cloud)))
        return error;
    if (!build->part)
        pt_parallel(build->pool, cloud->chunk_count, 1, finish_chunks, build);
    pt_progress_set(build->progress, 0.9);
    if ((error = cancelled(build)))
        return error;
    if (!build->part) {
        drop_opaque(cloud, build);
        pt_cloud_values_end(cloud);
    }
    for (uint32_t b = 0; b < build->block_count; b++)
        cloud->info.invalid_positions += build->blocks[b].invalid_positions;
    for (uint32_t c = 0; c < cloud->chunk_count; c++) {
        cloud->info.invalid_normals += cloud->info.has_normals ? build->tallies[c].invalid_normals : 0;
        cloud->info.radius_most = fmaxf(cloud->info.radius_most, build->tallies[c].radius_most);
        cloud->info.invalid_colors += build->tallies[c].invalid_colors;
    }
    memcpy(cloud->info.box_min, build->box_min, sizeof build->box_min);
    memcpy(cloud->info.box_max, build->box_max, sizeof build->box_max);
    cloud->info.drawn = build->drawn;
    cloud->info.chunks = cloud->chunk_count;
    pt_progress_set(build->progress, 1.0);
    return PATINA_OK;
}

int pt_cloud_check_desc(patina_cloud_desc *desc)
{
    const uint32_t floats = 1u << PATINA_FLOAT32 | 1u << PATINA_FLOAT64;
    int error;
    if (desc->count && !desc->position.data)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "position: no data for %llu points", (unsigned long long)desc->count);
    if (desc->count > 0x7FFFFFFFull) // gathers take signed indices
        return pt_fail(NULL, PATINA_ERROR_TOO_MANY_POINTS,
                       "%llu points at once: at most 2147483647; a cloud of more is built on the disk, piece by piece "
                       "(patina_builder_*, or patina convert FILE X.cloud)",
                       (unsigned long long)desc->count);
    if (!pt_finite3(desc->origin))
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "origin: not finite");
    if ((error = pt_check_array(&desc->position, "position", floats, 3, 3)) ||
        (error = pt_check_array(&desc->normal, "normal", floats, 3, 3)) ||
        (error = pt_check_array(&desc->opacity, "opacity", floats | 1u << PATINA_UINT8 | 1u << PATINA_UINT16, 1, 1)) ||
        (error = pt_check_array(&desc->radius, "radius", floats, 1, 1)) ||
        (error = pt_check_values(&desc->scalar, &desc->classes)))
        return error;
    return pt_check_array(&desc->color, "color", 1u << PATINA_UINT8 | 1u << PATINA_UINT16 | 1u << PATINA_FLOAT32, 3, 4);
}

enum pt_color_format pt_color_format_of(uint32_t type)
{
    return type == PATINA_NONE ? PT_COLOR_NONE : type == PATINA_UINT8 ? PT_COLOR_SRGB8 : PT_COLOR_FLOAT;
}

static enum pt_color_format color_format(const patina_array *color)
{
    return pt_color_format_of(color->data ? color->type : (uint32_t)PATINA_NONE);
}

void pt_cloud_begin_info(struct patina_cloud *cloud, const patina_cloud_desc *desc)
{
    cloud->threads = desc->threads;
    cloud->info = (patina_cloud_info){.struct_size = sizeof cloud->info,
                                      .count = desc->count,
                                      .has_normals = desc->normal.data != NULL,
                                      .normals_oriented = desc->normal.data != NULL,
                                      .has_colors = desc->color.data != NULL,
                                      .has_opacities = desc->opacity.data != NULL,
                                      .has_radii = desc->radius.data != NULL};
    memcpy(cloud->info.origin, desc->origin, sizeof desc->origin);
    cloud->color_format = color_format(&desc->color);
}

int pt_cloud_build(const patina_cloud_desc *desc, enum pt_build_kind kind, const struct pt_build_part *part,
                   struct pt_pool *pool, struct patina_progress *progress, struct patina_cloud **out)
{
    struct build build = {.kind = kind, .part = part, .desc = *desc, .pool = pool, .progress = progress};
    int error = PATINA_ERROR_MEMORY;
    *out = build.cloud = pool ? pt_cloud_new() : NULL;
    if (build.cloud) {
        pt_cloud_begin_info(build.cloud, desc);
        error = build_cloud(&build);
    }
    if (!part) {
        pt_pages_free(build.words, (size_t)build.drawn * sizeof *build.words);
        pt_pages_free(build.scratch, (size_t)build.drawn * sizeof *build.scratch);
    }
    free(build.blocks);
    free(build.tallies);
    free(build.cells);
    free(build.begins);
    if (error) {
        patina_cloud_destroy(*out);
        *out = NULL;
    }
    return error;
}

int pt_cloud_tell(int error, uint64_t points)
{
    const unsigned long long count = points;
    return !error                            ? PATINA_OK
           : error == PATINA_ERROR_CANCELLED ? pt_fail(NULL, error, "building the cloud was cancelled")
           : error == PATINA_ERROR_TOO_MANY_POINTS
               ? pt_fail(NULL, error,
                         "a cloud of %llu points: too many for memory; it can be built on the disk (patina_builder_*)", count)
               : pt_fail(NULL, error, "building a cloud of %llu points: out of memory", count);
}

int patina_cloud_create(const patina_cloud_desc *given, patina_progress *progress, patina_cloud **out)
{
    patina_cloud_desc desc;
    if (!out)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_create: out is NULL");
    *out = NULL;
    if (!given)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_create: desc is NULL");
    int error = pt_take(NULL, "patina_cloud_create", given, &desc, sizeof desc);
    error = error ? error : pt_cloud_check_desc(&desc);
    if (error)
        return error;
    struct pt_pool *pool = pt_pool_create(pt_pool_threads_for(desc.threads, desc.count), 0);
    error = pt_cloud_build(&desc, PT_BUILD_FREELY, NULL, pool, progress, out);
    pt_pool_destroy(pool);
    return pt_cloud_tell(error, desc.count);
}

// Into the whole's new array. Returns how many colours are none.
static uint64_t color_part(struct build *build, const struct patina_cloud *part)
{
    struct build own = *build;
    struct patina_cloud view = *part;
    uint64_t invalid = 0;
    own.cloud = &view;
    view.color_format = build->cloud->color_format;
    view.colors = build->cloud->colors;
    if (view.colors)
        view.colors = (char *)view.colors + view.first_slot * pt_color_size(view.color_format);
    memset(own.tallies, 0, view.chunk_count * sizeof *own.tallies);
    pt_parallel(own.pool, view.chunk_count, 1, attribute_chunks, &own);
    for (uint32_t c = 0; c < view.chunk_count; c++)
        invalid += own.tallies[c].invalid_colors;
    return invalid;
}

// Puts new colours in the place of the old ones; these go only when nothing can fail any more.
static int replace_colors(struct build *build)
{
    struct patina_cloud *cloud = build->cloud;
    size_t old_bytes = pt_color_bytes(cloud);
    enum pt_color_format old_format = cloud->color_format;
    void *old = cloud->colors;
    build->tallies = calloc(cloud->chunk_count + 1, sizeof *build->tallies);
    build->pool = pt_pool_create(cloud->threads, 0);
    cloud->color_format = color_format(&build->desc.color);
    cloud->colors = cloud->color_format ? pt_pages_alloc(pt_color_bytes(cloud)) : NULL;
    if (!build->tallies || !build->pool || (cloud->color_format && !cloud->colors)) {
        pt_pages_free(cloud->colors, pt_color_bytes(cloud));
        cloud->color_format = old_format;
        cloud->colors = old;
        return PATINA_ERROR_MEMORY;
    }
    cloud->info.invalid_colors = cloud->info.uncolored = 0;
    for (uint32_t i = 0; i < pt_part_count(cloud); i++)
        cloud->info.invalid_colors += color_part(build, pt_part(cloud, i));
    cloud->info.bytes += cloud->colors ? pt_color_bytes(cloud) : 0;
    cloud->info.bytes -= old ? pt_cloud_own_bytes(cloud, PT_ARRAY_COLORS, old_bytes) : 0;
    cloud->info.has_colors = cloud->color_format != PT_COLOR_NONE;
    cloud->mapped &= ~(1u << PT_ARRAY_COLORS);
    pt_parts_follow(cloud);
    atomic_fetch_add(&cloud->alive->colors, 1);
    pt_pages_free(old, old_bytes);
    return PATINA_OK;
}

int pt_cloud_set_colors(patina_cloud *cloud, const patina_array *color)
{
    if (!cloud || !color)
        return pt_fail(cloud ? &cloud->handle : NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_set_colors: bad arguments");
    struct build build = {.cloud = cloud, .desc = {.count = cloud->info.count, .color = *color}};
    const uint32_t types = 1u << PATINA_UINT8 | 1u << PATINA_UINT16 | 1u << PATINA_FLOAT32;
    int error = pt_paged_refuse(cloud, "patina_cloud_set_colors");
    if (error || (error = pt_check_array(&build.desc.color, "color", types, 3, 4)))
        return pt_fail_again(&cloud->handle, error);
    error = replace_colors(&build);
    pt_pool_destroy(build.pool);
    free(build.tallies);
    return error ? pt_fail(&cloud->handle, error, "new colours of %llu points: out of memory",
                           (unsigned long long)cloud->info.count)
                 : PATINA_OK;
}
