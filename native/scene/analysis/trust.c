// SPDX-License-Identifier: GPL-3.0-or-later
// A wrong sample (a mixed pixel, a stray) shows by its neighborhood: its neighbors are nearer to each other than to it, it lies off their
// planes, and few of them have it among theirs. The first walk of an analysis stores how far each point's neighbors reach; a second
// compares each with those of its neighbors, and trees of thresholds tell the trust. Every sum has one order, and the elementary
// operations are those that IEEE 754 rounds, so that results are the same for any threads and on every machine.
#include "trust.h"
#include "analysis.h"
#include "trust_features.h"
#include "base/compare.h"
#include "base/progress.h"
#include "base/vector.h"
#include "shared/words.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

_Static_assert(PT_TRUST_INTERVAL + 1 == PT_TRUST_FEATURES, "patina.h counts the features");

enum { K = PT_TRUST_NEIGHBOURS, NEAR = 8 };

struct pt_hidden {
    uint32_t place;
    float at[3];     // relative to the chunk's origin
    uint32_t coarse; // place in the coarse tree, or NOWHERE
};

#define NOWHERE 0xFFFFFFFFu

// ---- how far neighbors reach -----------------------------------------------------------------------------------------------

// A byte for a length: 16 steps an octave, linear within each, rounded up; 1 is half a unit or less, 255 the rest. 0: not known.
static uint8_t byte_of(double length, double unit)
{
    const float part = (float)(2.0 * length / unit);
    uint32_t bits;
    if (!(part > 1.0f))
        return length > 0.0 ? 1 : 0;
    memcpy(&bits, &part, 4);
    const uint32_t steps = (bits - 0x3F800000u + 0x7FFFFu) >> 19;
    return (uint8_t)(steps > 254 ? 255 : steps + 1);
}

// The greatest length of a byte.
static double length_of(uint8_t byte, double unit)
{
    const uint32_t bits = 0x3F800000u + ((uint32_t)(byte - (byte > 0)) << 19);
    float part;
    memcpy(&part, &bits, 4);
    return byte ? 0.5 * unit * (double)part : 0.0;
}

int pt_trust_create(struct pt_trust *trust)
{
    const size_t places = (size_t)trust->tree->leaf_count * PT_LEAF;
    for (uint32_t i = 0; i <= PT_SHAPE_CLASS_BITS; i++)
        trust->classes[i] = pt_spacing_of_class(i);
    trust->reach = pt_store_alloc(trust->tree->store, places);
    trust->used = pt_store_alloc(trust->tree->store, places);
    return trust->reach && trust->used ? PATINA_OK : PATINA_ERROR_MEMORY;
}

void pt_trust_destroy(struct pt_trust *trust)
{
    const size_t places = trust->tree ? (size_t)trust->tree->leaf_count * PT_LEAF : 0;
    if (places) {
        pt_store_free(trust->tree->store, trust->reach, places);
        pt_store_free(trust->tree->store, trust->used, places);
    }
    free(trust->hidden);
    free(trust->hidden_first);
    *trust = (struct pt_trust){0};
}

void pt_trust_note(struct pt_trust *trust, uint32_t place, const struct pt_sample *sample)
{
    const uint32_t count = sample->count;
    trust->reach[place] = count >= K ? byte_of(sqrt(sample->square[K - 1]), trust->base) : 0;
    trust->used[place] = count ? byte_of(sqrt(sample->square[count - 1]), trust->base) : 0;
}

static void measure_leaves(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct pt_trust *trust = context;
    struct pt_found found;
    (void)thread;
    for (uint32_t leaf = begin; leaf < end && !pt_progress_cancelled(trust->progress); leaf++) {
        const uint32_t lanes = pt_leaf_lanes(trust->tree, leaf);
        pt_neighbours_find(trust->tree, trust->tree, leaf, lanes, K, &found);
        for (uint32_t left = lanes; left; left &= left - 1) {
            const uint32_t lane = (uint32_t)__builtin_ctz(left);
            if (found.count[lane] == K)
                trust->reach[leaf * PT_LEAF + lane] = byte_of(sqrt(found.square[lane][K - 1]), trust->base);
        }
    }
}

void pt_trust_measure(struct pt_trust *trust, struct pt_pool *pool)
{
    pt_parallel(pool, trust->tree->leaf_count, 64, measure_leaves, trust);
}

// ---- features --------------------------------------------------------------------------------------------------------------

struct around { // of a point's nearest K
    double reach[K], far[K], mean, least, most, near_mean;
    uint32_t kind[K];
    double sigma[K];
};

static uint32_t word_at(const struct pt_trust *trust, uint32_t slot)
{
    return atomic_load_explicit(&trust->shapes[slot], memory_order_relaxed);
}

static double sigma_of(const struct pt_trust *trust, uint32_t word)
{
    return trust->base / 16.0 * trust->classes[word >> PT_SHAPE_SIGMA_SHIFT & PT_SHAPE_CLASS_BITS];
}

// 0: a neighbor's reach is not known, or all of them lie at one place.
static int look_around(const struct pt_trust *trust, const struct pt_sample *sample, const uint32_t *places, struct around *out)
{
    out->mean = out->near_mean = out->most = 0.0;
    out->least = INFINITY;
    for (uint32_t i = 0; i < K; i++) {
        const uint32_t word = word_at(trust, trust->tree->slots[places[i]]);
        const double reach = length_of(trust->reach[places[i]], trust->base);
        out->reach[i] = reach;
        out->far[i] = sqrt(sample->square[i]);
        out->kind[i] = PT_SHAPE_KIND(word);
        out->sigma[i] = sigma_of(trust, word);
        out->mean += reach / K;
        out->near_mean += i < NEAR ? reach / NEAR : 0.0;
        out->least = reach < out->least ? reach : out->least;
        out->most = reach > out->most ? reach : out->most;
    }
    return out->least > 0.0 && out->far[K - 1] > 0.0;
}

static double offset_of(const struct pt_sample *sample, uint32_t count)
{
    double mean[3] = {0.0, 0.0, 0.0};
    for (uint32_t i = 0; i < count; i++)
        for (int k = 0; k < 3; k++)
            mean[k] += sample->offset[i][k] / count;
    return sqrt(pt_dot(mean, mean));
}

static void compare_reach(const struct pt_sample *sample, const struct around *around, float f[])
{
    const double d8 = around->far[NEAR - 1], d16 = around->far[K - 1];
    double mutual = 0.0, near = 0.0;
    for (uint32_t i = 0; i < K; i++) {
        mutual += around->far[i] <= around->reach[i];
        near += i < NEAR && around->far[i] <= 0.5 * around->reach[i];
    }
    f[PT_TRUST_REACH_MEAN] = (float)(d16 / around->mean);
    f[PT_TRUST_REACH_LEAST] = (float)(d16 / around->least);
    f[PT_TRUST_REACH_NEAR] = (float)(d8 / around->near_mean);
    f[PT_TRUST_REACH_SPREAD] = (float)(around->most / around->least);
    f[PT_TRUST_D1] = (float)(around->far[0] / d16);
    f[PT_TRUST_D2] = (float)(around->far[1] / d16);
    f[PT_TRUST_D4] = (float)(around->far[3] / d16);
    f[PT_TRUST_D8] = (float)(d8 / d16);
    f[PT_TRUST_MUTUAL] = (float)mutual;
    f[PT_TRUST_MUTUAL_NEAR] = (float)near;
    f[PT_TRUST_OFFSET] = (float)(offset_of(sample, K) / d16);
    f[PT_TRUST_OFFSET_NEAR] = (float)(d8 > 0.0 ? offset_of(sample, NEAR) / d8 : 0.0);
}

static double part(double a, double b) { return b > 0.0 ? a / b : 0.0; }

static void compare_planes(const struct pt_trust *trust, const struct pt_sample *sample, const struct around *around,
                           const uint32_t *places, const struct pt_plane *plane, float f[])
{
    const double d16 = around->far[K - 1], residual = fabs(pt_dot(plane->axis[0], plane->mean));
    double least = INFINITY, mean = 0.0, in_sigmas = INFINITY, sigmas = 0.0, cosine = 0.0, worst = 1.0;
    uint32_t count = 0;
    for (uint32_t i = 0; i < NEAR; i++) {
        const uint32_t bits = trust->surfels[trust->tree->slots[places[i]]] & PT_NORMAL_BITS;
        double n[3];
        if (bits == PT_NORMAL_NONE)
            continue;
        pt_decode_normal(bits, n);
        const double off = fabs(pt_dot(n, sample->offset[i])), parts = off / (around->sigma[i] + 0.02 * around->reach[i]);
        const double facing = fabs(pt_dot(n, plane->axis[0]));
        least = off < least ? off : least;
        in_sigmas = parts < in_sigmas ? parts : in_sigmas;
        worst = facing < worst ? facing : worst;
        mean += off;
        sigmas += parts;
        cosine += facing;
        count++;
    }
    f[PT_TRUST_FLATNESS] = (float)part(plane->value[0], plane->value[1]);
    f[PT_TRUST_LINEARITY] = (float)part(plane->value[1], plane->value[2]);
    f[PT_TRUST_RESIDUAL] = (float)(residual / d16);
    f[PT_TRUST_RESIDUAL_SIGMA] = (float)part(residual, sqrt(plane->value[0]));
    f[PT_TRUST_PLANES_LEAST] = count ? (float)(least / d16) : 1.0f;
    f[PT_TRUST_PLANES_MEAN] = count ? (float)(mean / count / d16) : 1.0f;
    f[PT_TRUST_PLANES_SIGMA] = count ? (float)in_sigmas : 99.0f;
    f[PT_TRUST_PLANES_SIGMA_MEAN] = count ? (float)(sigmas / count) : 99.0f;
    f[PT_TRUST_NORMALS_MEAN] = count ? (float)(cosine / count) : -1.0f;
    f[PT_TRUST_NORMALS_LEAST] = count ? (float)worst : -1.0f;
    f[PT_TRUST_NORMALS] = (float)count;
}

static void compare_words(const struct pt_trust *trust, const struct around *around, uint32_t slot, double sparse, float f[])
{
    const uint32_t word = word_at(trust, slot);
    const double d16 = around->far[K - 1];
    double surfaces = 0.0, lines = 0.0, sigmas = 0.0;
    for (uint32_t i = 0; i < K; i++) {
        surfaces += around->kind[i] == PT_KIND_SURFACE || around->kind[i] == PT_KIND_BORDER;
        lines += around->kind[i] == PT_KIND_LINE;
        sigmas += around->sigma[i] / K;
    }
    f[PT_TRUST_KIND] = (float)PT_SHAPE_KIND(word);
    f[PT_TRUST_SURFACES] = (float)surfaces;
    f[PT_TRUST_LINES] = (float)lines;
    f[PT_TRUST_SIGMA] = (float)(sigma_of(trust, word) / d16);
    f[PT_TRUST_SIGMAS] = (float)(sigmas / d16);
    f[PT_TRUST_MAJOR] = (float)(16.0 * sigma_of(trust, (word & PT_SHAPE_CLASS_BITS) << PT_SHAPE_SIGMA_SHIFT) / d16);
    f[PT_TRUST_SPARSE] = (float)part(d16, sparse);
}

static void compare_sight(const struct pt_trust *trust, const struct pt_chunk *chunk, uint32_t slot, double d16,
                          const struct pt_plane *plane, float f[])
{
    f[PT_TRUST_ALONG] = f[PT_TRUST_FACING] = -1.0f;
    f[PT_TRUST_INTERVAL] = 0.0f;
    if (!trust->beams->count)
        return;
    double p[3], way[3];
    pt_point_place(trust->cloud, chunk, slot - chunk->first, p);
    const struct pt_beam *beam = &trust->beams->each[pt_station_of(trust->desc, pt_number_of(trust->cloud, slot), p)];
    for (int k = 0; k < 3; k++)
        way[k] = p[k] - beam->place[k];
    const double range = sqrt(pt_dot(way, way));
    if (!(range > 0.0))
        return;
    f[PT_TRUST_ALONG] = (float)fabs(pt_dot(way, plane->axis[2]) / range);
    f[PT_TRUST_FACING] = (float)fabs(pt_dot(way, plane->axis[0]) / range);
    f[PT_TRUST_INTERVAL] = (float)part(d16, range * beam->interval.elevation);
}

// ---- the judgement -----------------------------------------------------------------------------------------------------------

static void write_features(const struct pt_trust *trust, uint32_t slot, const float features[PT_TRUST_FEATURES])
{
    if (trust->desc->trust_features)
        memcpy(trust->desc->trust_features + (size_t)pt_number_of(trust->cloud, slot) * PT_TRUST_FEATURES, features,
               PT_TRUST_FEATURES * sizeof *features);
}

// Where the cloud has fewer points, or all neighbors lie at one place, nothing speaks against the point.
static uint32_t level_of(const struct pt_trust *trust, const struct pt_chunk *chunk, uint32_t place,
                         const struct pt_found *found)
{
    const uint32_t lane = place % PT_LEAF, slot = trust->tree->slots[place];
    const uint32_t *places = found->place[lane];
    struct pt_sample sample = {.count = found->count[lane]};
    struct around around;
    struct pt_plane plane;
    float features[PT_TRUST_FEATURES] = {0.0f};
    for (uint32_t i = 0; i < sample.count; i++) {
        pt_neighbours_offset(trust->tree, trust->tree, place, places[i], sample.offset[i]);
        sample.square[i] = found->square[lane][i];
    }
    if (sample.count < K || !look_around(trust, &sample, places, &around))
        return PT_TRUST_LEVELS - 1;
    pt_plane_fit(&sample, (1u << K) - 1u, &plane);
    compare_reach(&sample, &around, features);
    compare_planes(trust, &sample, &around, places, &plane, features);
    compare_words(trust, &around, slot, (double)chunk->spacing, features);
    compare_sight(trust, chunk, slot, around.far[K - 1], &plane, features);
    write_features(trust, slot, features);
    return pt_trust_level(features);
}

// Squares of distances within which the points of a leaf have K neighbors, as the first walk noted. A float holds the length to 6e-8.
static void bounds_of(const struct pt_trust *trust, uint32_t leaf, double squares[PT_LEAF])
{
    for (uint32_t lane = 0; lane < PT_LEAF; lane++) {
        const uint8_t byte = trust->reach[leaf * PT_LEAF + lane];
        const double length = (1.0 + 1e-6) * length_of(byte, trust->base);
        squares[lane] = byte == 0 || byte == 255 ? INFINITY : length * length;
    }
}

static void judge_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct pt_trust *trust = context;
    const struct pt_neighbours *tree = trust->tree;
    struct pt_found found;
    double squares[PT_LEAF];
    (void)thread;
    for (uint32_t i = begin; i < end; i++) {
        const uint32_t c = tree->chunk_order[i];
        const struct pt_chunk *chunk = &trust->chunks[c];
        for (uint32_t leaf = tree->chunk_leaf[c]; leaf < tree->chunk_leaf[c + 1]; leaf++) {
            if (pt_progress_cancelled(trust->progress))
                return;
            const uint32_t lanes = pt_leaf_lanes(tree, leaf);
            bounds_of(trust, leaf, squares);
            pt_neighbours_find_within(tree, tree, leaf, lanes, K, squares, &found);
            for (uint32_t left = lanes; left; left &= left - 1) {
                const uint32_t place = leaf * PT_LEAF + (uint32_t)__builtin_ctz(left), slot = tree->slots[place];
                const uint32_t level = level_of(trust, chunk, place, &found);
                atomic_fetch_and_explicit(&trust->shapes[slot], ~(PT_SHAPE_TRUST_BITS & ~(level << PT_SHAPE_TRUST_SHIFT)),
                                          memory_order_relaxed);
            }
            pt_store_look(tree->store);
        }
        const uint32_t done = atomic_fetch_add_explicit(&trust->done, 1, memory_order_relaxed) + 1;
        pt_progress_raise(trust->progress, 0.6 + 0.15 * done / tree->chunk_count);
    }
}

void pt_trust_judge(struct pt_trust *trust, struct pt_pool *pool)
{
    pt_parallel(pool, trust->tree->chunk_count, 1, judge_chunks, trust);
}

// ---- without untrusted points ------------------------------------------------------------------------------------------------

static int is_untrusted(const struct pt_trust *trust, uint32_t slot)
{
    const uint32_t level = word_at(trust, slot) >> PT_SHAPE_TRUST_SHIFT & 15u;
    return level < trust->least;
}

static void move_place(struct pt_neighbours *tree, uint32_t place, const float at[3])
{
    float *xyz = tree->places + (size_t)(place / PT_LEAF) * 3 * PT_LEAF + place % PT_LEAF;
    for (int k = 0; k < 3; k++)
        xyz[k * PT_LEAF] = at[k];
}

// Finds the least level of trusted points, and returns how many points are below it.
static uint64_t count_hidden(struct pt_trust *trust)
{
    uint64_t *counts = trust->counts, below = 0;
    for (uint32_t c = 0; c < trust->cloud->chunk_count; c++) {
        const struct pt_chunk *chunk = &trust->cloud->chunks[c];
        for (uint32_t i = 0; i < chunk->count; i++)
            counts[word_at(trust, chunk->first + i) >> PT_SHAPE_TRUST_SHIFT & 15u]++;
        pt_store_look(trust->tree->store);
    }
    trust->least = pt_default_level(counts);
    for (uint32_t level = 0; level < trust->least; level++)
        below += counts[level];
    return below;
}

// The coarse tree's places of a chunk's untrusted points, into its `hidden` from `first` on.
static void find_coarse(struct pt_trust *trust, uint32_t c, uint64_t first, uint64_t *pairs)
{
    const uint64_t count = trust->hidden_count - first;
    const struct pt_neighbours *coarse = trust->coarse;
    for (uint64_t i = 0; i < count; i++)
        pairs[i] = (uint64_t)trust->tree->slots[trust->hidden[first + i].place] << 32 | i;
    qsort(pairs, count, sizeof *pairs, pt_compare_u64);
    for (uint32_t leaf = coarse->chunk_leaf[c]; leaf < coarse->chunk_leaf[c + 1] && count; leaf++)
        for (uint32_t left = pt_leaf_lanes(coarse, leaf); left; left &= left - 1) {
            const uint32_t place = leaf * PT_LEAF + (uint32_t)__builtin_ctz(left);
            uint64_t low = 0, high = count;
            while (low < high) {
                const uint64_t middle = (low + high) / 2;
                if (pairs[middle] >> 32 < coarse->slots[place])
                    low = middle + 1;
                else
                    high = middle;
            }
            if (low < count && pairs[low] >> 32 == coarse->slots[place])
                trust->hidden[first + (pairs[low] & 0xFFFFFFFFu)].coarse = place;
        }
}

int pt_trust_hide(struct pt_trust *trust)
{
    static const float nowhere[3] = {INFINITY, INFINITY, INFINITY};
    const struct pt_neighbours *tree = trust->tree;
    const uint64_t count = count_hidden(trust);
    trust->hidden = malloc((count + 1) * sizeof *trust->hidden);
    trust->hidden_first = malloc((tree->chunk_count + 1) * sizeof *trust->hidden_first);
    uint64_t *pairs = malloc(PT_CHUNK_POINTS * sizeof *pairs);
    const int good = trust->hidden && trust->hidden_first && pairs;
    for (uint32_t c = 0; c < tree->chunk_count && good; c++) {
        const uint64_t first = trust->hidden_count;
        trust->hidden_first[c] = (uint32_t)first;
        for (uint32_t leaf = tree->chunk_leaf[c]; leaf < tree->chunk_leaf[c + 1]; leaf++)
            for (uint32_t left = pt_leaf_lanes(tree, leaf); left; left &= left - 1) {
                const uint32_t place = leaf * PT_LEAF + (uint32_t)__builtin_ctz(left);
                const float *xyz = tree->places + (size_t)leaf * 3 * PT_LEAF + place % PT_LEAF;
                if (is_untrusted(trust, tree->slots[place]))
                    trust->hidden[trust->hidden_count++] = (struct pt_hidden){
                        place, {xyz[0], xyz[PT_LEAF], xyz[2 * PT_LEAF]}, NOWHERE};
            }
        find_coarse(trust, c, first, pairs);
        pt_store_look(tree->store);
    }
    free(pairs);
    if (!good)
        return PATINA_ERROR_MEMORY;
    trust->hidden_first[tree->chunk_count] = (uint32_t)trust->hidden_count;
    for (uint64_t i = 0; i < trust->hidden_count; i++) {
        move_place(trust->tree, trust->hidden[i].place, nowhere);
        if (trust->hidden[i].coarse != NOWHERE)
            move_place(trust->coarse, trust->hidden[i].coarse, nowhere);
    }
    return PATINA_OK;
}

void pt_trust_show(struct pt_trust *trust)
{
    for (uint64_t i = 0; i < trust->hidden_count; i++) {
        move_place(trust->tree, trust->hidden[i].place, trust->hidden[i].at);
        if (trust->hidden[i].coarse != NOWHERE)
            move_place(trust->coarse, trust->hidden[i].coarse, trust->hidden[i].at);
    }
    trust->hidden_count = 0;
}

// Lanes whose neighbors reach as far as p, which is relative to the chunk's origin.
static uint32_t reaching(const struct pt_trust *trust, uint32_t leaf, uint32_t lanes, const double p[3])
{
    const float *xyz = trust->tree->places + (size_t)leaf * 3 * PT_LEAF;
    uint32_t near = 0;
    for (uint32_t left = lanes; left; left &= left - 1) {
        const uint32_t lane = (uint32_t)__builtin_ctz(left);
        const double x = (double)xyz[lane] - p[0], y = (double)xyz[PT_LEAF + lane] - p[1],
                     z = (double)xyz[2 * PT_LEAF + lane] - p[2];
        const uint8_t used = trust->used[leaf * PT_LEAF + lane];
        const double reach = length_of(used, trust->base);
        near |= (uint32_t)(used == 255 || x * x + y * y + z * z <= reach * reach) << lane;
    }
    return near;
}

struct touch {
    const struct pt_trust *trust;
    uint32_t leaf, chunk, lanes, touched;
    double low[3], high[3]; // of the leaf's lanes and what they reach, in the cloud's frame
};

static void touch_chunk(struct touch *touch, uint32_t c)
{
    const struct pt_trust *trust = touch->trust;
    const struct pt_chunk *chunks = trust->cloud->chunks;
    for (uint32_t i = trust->hidden_first[c]; i < trust->hidden_first[c + 1]; i++) {
        double p[3];
        int inside = 1;
        for (int k = 0; k < 3; k++) {
            p[k] = (double)trust->hidden[i].at[k] + (chunks[c].origin[k] - chunks[touch->chunk].origin[k]);
            inside = inside && p[k] >= touch->low[k] && p[k] <= touch->high[k];
        }
        if (inside)
            touch->touched |= reaching(trust, touch->leaf, touch->lanes & ~touch->touched, p);
    }
}

// The tree over chunks in preorder, as neighbours.c has it.
static void touch_chunks(struct touch *touch, const struct pt_chunk_node *node, uint32_t at, uint32_t count)
{
    const struct pt_neighbours *tree = touch->trust->tree;
    for (int k = 0; k < 3; k++) {
        const double origin = tree->cloud->chunks[touch->chunk].origin[k] - tree->origin[k];
        if (node->low[k] > origin + touch->high[k] || node->high[k] < origin + touch->low[k])
            return;
    }
    if (count == 1) {
        touch_chunk(touch, tree->chunk_order[at]);
        return;
    }
    const uint32_t left = (count + 1) / 2;
    touch_chunks(touch, node + 1, at, left);
    touch_chunks(touch, node + 2 * left, at + left, count - left);
}

uint32_t pt_trust_touched(const struct pt_trust *trust, uint32_t leaf)
{
    const struct pt_neighbours *tree = trust->tree;
    const float *xyz = tree->places + (size_t)leaf * 3 * PT_LEAF;
    struct touch touch = {.trust = trust,
                          .leaf = leaf,
                          .chunk = tree->leaf_chunk[leaf],
                          .low = {INFINITY, INFINITY, INFINITY},
                          .high = {-INFINITY, -INFINITY, -INFINITY}};
    for (uint32_t left = pt_leaf_lanes(tree, leaf); left; left &= left - 1) {
        const uint32_t lane = (uint32_t)__builtin_ctz(left);
        const uint8_t used = trust->used[leaf * PT_LEAF + lane];
        const double reach = used == 255 ? INFINITY : length_of(used, trust->base);
        if (!isfinite(xyz[lane]))
            continue;
        touch.lanes |= 1u << lane;
        for (uint32_t k = 0; k < 3; k++) {
            touch.low[k] = fmin(touch.low[k], (double)xyz[k * PT_LEAF + lane] - reach);
            touch.high[k] = fmax(touch.high[k], (double)xyz[k * PT_LEAF + lane] + reach);
        }
    }
    if (touch.lanes && trust->hidden_count)
        touch_chunks(&touch, tree->chunk_nodes, 0, tree->chunk_count);
    return touch.touched;
}

void pt_trust_finish_chunk(const struct pt_trust *trust, struct pt_chunk *chunk, uint32_t *surfels, uint32_t *shapes)
{
    uint32_t footprints[64] = {0}, spacings[64] = {0}, most = 0, below = 0, trusted = 0, at = 0;
    surfels += chunk->first;
    shapes += chunk->first;
    for (uint32_t i = 0; i < chunk->count; i++) {
        most = (shapes[i] & PT_SHAPE_CLASS_BITS) > most ? shapes[i] & PT_SHAPE_CLASS_BITS : most;
        if (is_untrusted(trust, chunk->first + i))
            continue;
        footprints[shapes[i] & PT_SHAPE_CLASS_BITS]++;
        spacings[surfels[i] >> PT_SPACING_SHIFT]++;
        trusted++;
    }
    chunk->reach = (float)(trust->base * pt_spacing_of_class(most)); // of all points: a style may draw them
    for (uint32_t i = chunk->count; i < chunk->padded; i++) {
        surfels[i] = surfels[chunk->count - 1];
        shapes[i] = shapes[chunk->count - 1];
    }
    if (!trusted)
        return;
    for (; at < 63 && (below += footprints[at]) < trusted * 9u / 10u; at++)
        ;
    chunk->footprint = (float)(trust->base * pt_spacing_of_class(at));
    if (10u * trusted > 9u * chunk->count)
        return; // the median hardly moves
    for (at = 0, below = 0; at < 63 && (below += spacings[at]) <= trusted / 2; at++)
        ;
    chunk->spacing = at ? (float)(trust->base * pt_spacing_of_class(at)) : chunk->spacing;
}
