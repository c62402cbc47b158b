// SPDX-License-Identifier: GPL-3.0-or-later
// Votes of 64 views: parallel projections along 32 axes, both ways, into grids of texels some spacings wide. Who is first in
// its texel, or little behind, is seen, and its normal should face the viewer. Where votes are few (deep in a cavity, out of
// the grid) neighbours with like normals tell. A sheet that is seen from both sides faces up.
#include "orient.h"
#include "analysis.h"
#include "base/compare.h"
#include "base/platform.h"
#include "base/progress.h"
#include "shared/words.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { AXES = 32, GRID = 2048, NEIGHBOURS = 16, ROUNDS = 3 };
#define TEXEL 2.5f    // spacings of the 90th percentile of chunks: one in 500 texels of a random surface is empty
#define STEEPEST 0.3f // |n . axis| below: says little, and lies too deep in its texel
#define BEHIND 0.5f   // texels behind the first: and 1.5 times the tilt
#define VOTE 32.0f    // of a view from straight ahead
#define FEW 96        // of 500 that a convex shape's point gets

struct view {         // along an axis, both ways
    float axis[3][3]; // of its grid: u, v, depth
    double low[3];    // of the grid, along them
    float texel;
    uint32_t width, height;
    _Atomic uint32_t *front, *back; // greatest and least depth of a texel, as float bits
};

struct orient {
    const struct pt_neighbours *tree;
    const struct pt_chunk *chunks;
    const struct patina_progress *progress;
    uint32_t *surfels, *shapes;
    const uint32_t *told;
    int16_t *votes, *next; // of the normal as it is: positive stays
    struct view views[AXES];
    uint32_t first, end;            // of the views that are looked from now: points are read once for all of them
    _Atomic uint32_t *front, *back; // one grid for one view after another; NULL: views have their own
    double box_low[3], box_high[3]; // of nearly all points
    float texel;
};

// ---- the grid --------------------------------------------------------------------------------------------------------------

struct weighed {
    double value;
    uint32_t weight;
};

static double quantile(struct weighed *list, uint32_t count, double share)
{
    double sum = 0.0, below = 0.0;
    qsort(list, count, sizeof *list, pt_compare_doubles);
    for (uint32_t i = 0; i < count; i++)
        sum += list[i].weight;
    for (uint32_t i = 0; i < count; i++)
        if ((below += list[i].weight) >= share * sum)
            return list[i].value;
    return 0.0;
}

// Without the few chunks that strays stretch; texels by the spacing that all but a tenth have.
static int measure(struct orient *orient)
{
    const uint32_t count = orient->tree->chunk_count;
    struct weighed *list = malloc((count + 1) * sizeof *list);
    if (!list)
        return PATINA_ERROR_MEMORY;
    for (int k = 0; k < 3; k++)
        for (int high = 0; high < 2; high++) {
            for (uint32_t c = 0; c < count; c++) {
                const struct pt_chunk *chunk = &orient->chunks[c];
                const double edge = (double)(high ? chunk->box_max[k] : chunk->box_min[k]);
                list[c] = (struct weighed){chunk->origin[k] + edge, chunk->count};
            }
            *(high ? &orient->box_high[k] : &orient->box_low[k]) = quantile(list, count, high ? 0.995 : 0.005);
        }
    for (uint32_t c = 0; c < count; c++)
        list[c] = (struct weighed){(double)orient->chunks[c].spacing, orient->chunks[c].count};
    orient->texel = TEXEL * (float)quantile(list, count, 0.9);
    free(list);
    return PATINA_OK;
}

// The i-th axis of a spiral over the half sphere (golden angle), and two across it.
static void set_axes(struct orient *orient, int i, double turn[2])
{
    struct view *view = &orient->views[i];
    const double z = (i + 0.5) / AXES, r = sqrt(1.0 - z * z), x = turn[0] * r, y = turn[1] * r;
    const double c = -0.7373688780783197, s = 0.6754902942615238, t = turn[0];
    turn[0] = c * turn[0] - s * turn[1];
    turn[1] = s * t + c * turn[1];
    const double q = -1.0 / (1.0 + z), b = x * y * q;
    const double axes[3][3] = {{1.0 + x * x * q, b, -x}, {b, 1.0 + y * y * q, -y}, {x, y, z}};
    double high[3];
    for (int a = 0; a < 3; a++) {
        view->low[a] = high[a] = 0.0;
        for (int k = 0; k < 3; k++) {
            const double one = axes[a][k] * orient->box_low[k], other = axes[a][k] * orient->box_high[k];
            view->axis[a][k] = (float)axes[a][k];
            view->low[a] += fmin(one, other);
            high[a] += fmax(one, other);
        }
    }
    const float least = (float)fmax(high[0] - view->low[0], high[1] - view->low[1]) / (GRID - 1);
    view->texel = orient->texel = fmaxf(orient->texel, least);
    view->width = (uint32_t)((float)(high[0] - view->low[0]) / view->texel) + 1;
    view->height = (uint32_t)((float)(high[1] - view->low[1]) / view->texel) + 1;
    view->width = view->width < GRID ? view->width : GRID;
    view->height = view->height < GRID ? view->height : GRID;
    view->low[2] -= 2.0 * (high[2] - view->low[2]) + (double)view->texel; // depths above 0, for strays too or they are left out
}

struct projected {
    float u[PT_CHUNK_POINTS], v[PT_CHUNK_POINTS], depth[PT_CHUNK_POINTS];
    float facing[PT_CHUNK_POINTS], length[PT_CHUNK_POINTS]; // n . axis of normals this long
    float unpacked[3 * PT_CHUNK_POINTS];
};

static void project(const struct orient *orient, const struct view *view, const struct pt_chunk *chunk, struct projected *out)
{
    const float *x = pt_chunk_positions(orient->tree->cloud, chunk, out->unpacked), *y = x + chunk->padded,
                *z = y + chunk->padded;
    float *const to[3] = {out->u, out->v, out->depth};
    for (int a = 0; a < 3; a++) {
        const float ax = view->axis[a][0], ay = view->axis[a][1], az = view->axis[a][2];
        double place = -view->low[a];
        for (int k = 0; k < 3; k++)
            place += (double)view->axis[a][k] * chunk->origin[k];
        const float scale = a < 2 ? 1.0f / view->texel : 1.0f, shift = (float)(place * (double)scale);
        float *restrict line = to[a];
        for (uint32_t i = 0; i < chunk->count; i++)
            line[i] = (ax * x[i] + ay * y[i] + az * z[i]) * scale + shift;
    }
}

// As pt_decode_normal, but for their length, and many at a time.
static void face(const struct orient *orient, const struct view *view, const struct pt_chunk *chunk, struct projected *out)
{
    const uint32_t *surfels = orient->surfels + chunk->first;
    const float ax = view->axis[2][0], ay = view->axis[2][1], az = view->axis[2][2];
    for (uint32_t i = 0; i < chunk->count; i++) {
        float x = (float)((int32_t)(surfels[i] & 0x1FFFu) - 4095), y = (float)((int32_t)(surfels[i] >> 13 & 0x1FFFu) - 4095);
        const float z = 4095.0f - fabsf(x) - fabsf(y), fold = z < 0.0f ? -z : 0.0f;
        x = x >= 0.0f ? x - fold : x + fold;
        y = y >= 0.0f ? y - fold : y + fold;
        out->facing[i] = ax * x + ay * y + az * z;
        out->length[i] = sqrtf(x * x + y * y + z * z);
    }
}

// The point's texel; 0 when it has none.
static int texel_of(const struct view *view, const struct projected *p, uint32_t i, size_t *texel)
{
    if (!(p->u[i] >= 0.0f && p->v[i] >= 0.0f && p->u[i] < (float)view->width && p->v[i] < (float)view->height &&
          p->depth[i] > 0.0f))
        return 0;
    *texel = (size_t)(uint32_t)p->v[i] * GRID + (uint32_t)p->u[i];
    return 1;
}

static void scatter_chunk(const struct orient *orient, const struct view *view, const struct pt_chunk *chunk,
                          struct projected *p)
{
    project(orient, view, chunk, p);
    for (uint32_t i = 0; i < chunk->count; i++) {
        uint32_t depth, seen;
        size_t at;
        if (!texel_of(view, p, i, &at))
            continue;
        memcpy(&depth, &p->depth[i], 4); // positive: bits go as values
        seen = atomic_load_explicit(&view->front[at], memory_order_relaxed);
        while (depth > seen && !atomic_compare_exchange_weak_explicit(&view->front[at], &seen, depth, memory_order_relaxed,
                                                                      memory_order_relaxed))
            ;
        seen = atomic_load_explicit(&view->back[at], memory_order_relaxed);
        while (depth < seen && !atomic_compare_exchange_weak_explicit(&view->back[at], &seen, depth, memory_order_relaxed,
                                                                      memory_order_relaxed))
            ;
    }
}

static void scatter(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct orient *orient = context;
    struct projected p;
    (void)thread;
    for (uint32_t c = begin; c < end && !pt_progress_cancelled(orient->progress); c++)
        for (uint32_t i = orient->first; i < orient->end; i++)
            scatter_chunk(orient, &orient->views[i], &orient->chunks[c], &p);
}

// ---- votes -----------------------------------------------------------------------------------------------------------------

static void vote_chunk(struct orient *orient, const struct view *view, const struct pt_chunk *chunk, struct projected *p)
{
    project(orient, view, chunk, p);
    face(orient, view, chunk, p);
    for (uint32_t i = 0; i < chunk->count; i++) {
        const uint32_t slot = chunk->first + i;
        size_t at;
        if (fabsf(p->facing[i]) < STEEPEST * p->length[i] || (orient->surfels[slot] & PT_NORMAL_BITS) == PT_NORMAL_NONE ||
            !texel_of(view, p, i, &at))
            continue;
        const float facing = p->facing[i] / p->length[i];
        const uint32_t front = atomic_load_explicit(&view->front[at], memory_order_relaxed);
        const uint32_t back = atomic_load_explicit(&view->back[at], memory_order_relaxed);
        const float reach = view->texel * (BEHIND + 1.5f * sqrtf(fmaxf(1.0f - facing * facing, 0.0f)) / fabsf(facing));
        float first, last;
        memcpy(&first, &front, 4);
        memcpy(&last, &back, 4);
        const int16_t weight = (int16_t)(fabsf(facing) * VOTE), side = facing > 0.0f ? 1 : -1;
        if (p->depth[i] >= first - reach)
            orient->votes[slot] += (int16_t)(side * (weight + 1)); // from above: a sheet faces up
        if (p->depth[i] <= last + reach)
            orient->votes[slot] -= (int16_t)(side * weight);
    }
}

static void vote(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct orient *orient = context;
    struct projected p;
    (void)thread;
    for (uint32_t c = begin; c < end && !pt_progress_cancelled(orient->progress); c++)
        for (uint32_t i = orient->first; i < orient->end; i++)
            vote_chunk(orient, &orient->views[i], &orient->chunks[c], &p);
}

// Who has few votes takes those of its neighbours, as far as their normals lie along its own.
static void share_votes_of(struct orient *orient, uint32_t chunk)
{
    const struct pt_neighbours *tree = orient->tree;
    struct pt_found found;
    for (uint32_t leaf = tree->chunk_leaf[chunk]; leaf < tree->chunk_leaf[chunk + 1]; leaf++) {
        uint32_t few = 0;
        for (uint32_t left = pt_leaf_lanes(tree, leaf); left; left &= left - 1) {
            const uint32_t lane = (uint32_t)__builtin_ctz(left), slot = tree->slots[leaf * PT_LEAF + lane];
            orient->next[slot] = orient->votes[slot];
            few |= (uint32_t)(abs(orient->votes[slot]) < FEW && (orient->surfels[slot] & PT_NORMAL_BITS) != PT_NORMAL_NONE)
                   << lane;
        }
        if (few)
            pt_neighbours_find(tree, tree, leaf, few, NEIGHBOURS, &found);
        for (; few; few &= few - 1) {
            const uint32_t lane = (uint32_t)__builtin_ctz(few), slot = tree->slots[leaf * PT_LEAF + lane];
            double n[3], m[3], sum = orient->votes[slot];
            pt_decode_normal(orient->surfels[slot] & PT_NORMAL_BITS, n);
            for (uint32_t i = 0; i < found.count[lane]; i++) {
                const uint32_t other = tree->slots[found.place[lane][i]], bits = orient->surfels[other] & PT_NORMAL_BITS;
                if (bits == PT_NORMAL_NONE)
                    continue;
                pt_decode_normal(bits, m);
                sum += orient->votes[other] * (n[0] * m[0] + n[1] * m[1] + n[2] * m[2]);
            }
            sum /= NEIGHBOURS / 2;
            orient->next[slot] = (int16_t)(sum > 2000.0 ? 2000.0 : sum < -2000.0 ? -2000.0 : sum);
        }
        pt_store_look(tree->store);
    }
}

// Neighbours one after another, whatever level they are of: what they read lies side by side.
static void share_votes(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct orient *orient = context;
    (void)thread;
    for (uint32_t i = begin; i < end && !pt_progress_cancelled(orient->progress); i++)
        share_votes_of(orient, orient->tree->chunk_order[i]);
}

static void turn(struct orient *orient, uint32_t slot)
{
    struct pt_neighbourhood hood;
    const uint32_t bits = orient->surfels[slot] & PT_NORMAL_BITS;
    pt_unpack_shape(orient->shapes[slot], bits, 1.0, &hood); // for its axis
    for (int k = 0; k < 3; k++)
        hood.normal[k] = -hood.normal[k];
    const uint32_t turned = pt_encode_normal(hood.normal), angle = 63u << PT_SHAPE_ANGLE_SHIFT;
    orient->surfels[slot] = (orient->surfels[slot] & ~PT_NORMAL_BITS) | turned;
    orient->shapes[slot] = (orient->shapes[slot] & ~angle) | (pt_pack_shape(&hood, turned, 1.0) & angle);
}

static void turn_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct orient *orient = context;
    (void)thread;
    for (uint32_t c = begin; c < end; c++) {
        const struct pt_chunk *chunk = &orient->chunks[c];
        for (uint32_t i = 0; i < chunk->padded; i++) {
            const uint32_t slot = chunk->first + i;
            if (i >= chunk->count) { // repeats the last
                orient->surfels[slot] = orient->surfels[slot - 1];
                orient->shapes[slot] = orient->shapes[slot - 1];
            } else if ((orient->surfels[slot] & PT_NORMAL_BITS) != PT_NORMAL_NONE && orient->votes[slot] < 0 &&
                       !(orient->told && orient->told[slot / 32] >> slot % 32 & 1u)) {
                turn(orient, slot);
            }
        }
    }
}

static size_t grid_bytes(const struct view *view) { return (size_t)GRID * view->height * 4; }

// Grids of the views from `first` on: of as many as are a small part of what memory may be taken where points are read from a disk, else
// of one, and all take the same.
static int make_grids(struct orient *orient)
{
    struct pt_store *store = orient->tree->store;
    uint64_t bytes = 0;
    orient->end = orient->first;
    do
        bytes += 2 * grid_bytes(&orient->views[orient->end++]);
    while (store && orient->end < AXES && pt_store_is_small(store, bytes + 2 * grid_bytes(&orient->views[orient->end])));
    int good = 1;
    for (uint32_t i = orient->first; i < orient->end; i++) {
        struct view *view = &orient->views[i];
        struct pt_store *where = pt_store_is_small(store, bytes) ? NULL : store;
        view->front = orient->front ? orient->front : pt_store_alloc(where, grid_bytes(view));
        view->back = orient->back ? orient->back : pt_store_alloc(where, grid_bytes(view));
        good = good && view->front && view->back;
        if (orient->front)
            memset(view->front, 0, grid_bytes(view));
        if (view->back)
            memset(view->back, 0x7F, grid_bytes(view));
    }
    return good ? PATINA_OK : PATINA_ERROR_MEMORY;
}

static void drop_grids(struct orient *orient)
{
    for (uint32_t i = orient->first; i < orient->end && !orient->front; i++) {
        pt_store_free(orient->tree->store, orient->views[i].front, grid_bytes(&orient->views[i]));
        pt_store_free(orient->tree->store, orient->views[i].back, grid_bytes(&orient->views[i]));
    }
}

static int run(struct orient *orient, struct pt_pool *pool, struct patina_progress *progress, double begin, double end)
{
    const uint32_t count = orient->tree->chunk_count;
    double at[2] = {1.0, 0.0};
    int error = measure(orient);
    for (int i = 0; i < AXES && !error; i++)
        set_axes(orient, i, at);
    for (; orient->first < AXES && !error; orient->first = orient->end) {
        error = make_grids(orient);
        if (!error) {
            pt_parallel(pool, count, 1, scatter, orient);
            pt_parallel(pool, count, 1, vote, orient);
            pt_progress_raise(progress, begin + (end - begin) * orient->end / (AXES + 2));
            error = pt_progress_cancelled(progress) ? PATINA_ERROR_CANCELLED : PATINA_OK;
        }
        drop_grids(orient);
    }
    for (int round = 0; round < ROUNDS && !error; round++) {
        pt_parallel(pool, count, 1, share_votes, orient);
        int16_t *swap = orient->votes;
        orient->votes = orient->next;
        orient->next = swap;
        error = pt_progress_cancelled(progress) ? PATINA_ERROR_CANCELLED : PATINA_OK;
    }
    if (!error)
        pt_parallel(pool, count, 1, turn_chunks, orient);
    return error;
}

int pt_orient(const struct pt_neighbours *tree, const struct pt_chunk *chunks, const uint32_t *told, uint32_t *surfels,
              uint32_t *shapes, struct pt_pool *pool, struct patina_progress *progress, double begin, double end)
{
    const size_t votes = tree->cloud->slots * sizeof(int16_t), grid = (size_t)GRID * GRID * 4;
    struct orient orient = {
        .tree = tree, .chunks = chunks, .progress = progress, .told = told, .surfels = surfels, .shapes = shapes};
    orient.votes = pt_store_alloc(tree->store, votes);
    orient.next = pt_store_alloc(tree->store, votes);
    orient.front = tree->store ? NULL : pt_pages_alloc(grid);
    orient.back = tree->store ? NULL : pt_pages_alloc(grid);
    int16_t *const both[2] = {orient.votes, orient.next};
    int error = PATINA_ERROR_MEMORY;
    if (orient.votes && orient.next && (tree->store || (orient.front && orient.back)))
        error = run(&orient, pool, progress, begin, end);
    pt_store_free(tree->store, both[0], votes);
    pt_store_free(tree->store, both[1], votes);
    pt_pages_free(orient.front, grid);
    pt_pages_free(orient.back, grid);
    return error;
}
