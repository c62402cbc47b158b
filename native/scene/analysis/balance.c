// SPDX-License-Identifier: GPL-3.0-or-later
// Exposure and white balance of scans (SPEC 11, Colors): gains that bring the light of scans to each other where they overlap. Sampled
// points look for their nearest neighbors of other scans; each two give the logarithm of the ratio of their light. The ratios of each two
// scans have a robust mean, and least squares over all of these give a gain for each scan and channel. All sums run in one order, and the
// elementary functions are our own, so that the gains have the same bits for any number of threads and on every machine.
#include "analysis.h"
#include "base/color.h"
#include "base/compare.h"
#include "base/elementary.h"
#include "base/progress.h"
#include "scene/clouds/page_sums.h"
#include "scene/clouds/paged.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    MOST_SCANS = 65535,
    NEIGHBOURS = 16,
    MOST_IN_TREE = 1 << 21, // points about; of larger clouds the first strata of each chunk
    MOST_ASKED = 1 << 18,   // points that look for neighbors
    OTHERS = 4,             // scans beside a point's own that it is compared with
    LEAST_PAIRS = 8,        // of two scans that count
    ROUNDS = 8              // of reweighting
};

#define DARK 0.002   // light: below there is noise
#define BRIGHT 0.98  // from here to 1 it was cut off
#define STEPS 4096.0 // of a natural logarithm
#define LEAST_GAIN 0.25
#define MOST_GAIN 4.0
#define SPREAD 0.3       // of the logarithms of two neighbors' ratio, before anything is measured, ...
#define SPREAD_PAIRS 8.0 // ... as if so many pairs said so
#define SYSTEMATIC 0.03  // what two scans differ by, however many pairs they have: gloss, shadows
#define TURN 1.5         // standard deviations from where on residuals count less [Huber 1964]
#define LOOSE 1.0        // standard deviation of a gain's logarithm, before anything is measured: the regularization

struct pair {
    uint16_t scans[2]; // the lower first
    int16_t ways[3];   // of the channels: ln(light of the first / light of the second), in STEPS
};

struct edge { // all pairs of two scans
    uint32_t scans[2];
    double mean[3], variance[3]; // of x[first] - x[second], x being the logarithm of a gain
};

struct balance {
    const struct patina_cloud *cloud;
    const uint16_t *scans;
    uint32_t count;
    struct pt_neighbours tree;
    uint32_t step, asked; // leaves: every so-manieth, and how many in all
    uint32_t least_level; // of trust
    float logs[256];      // of sRGB; NAN: does not count
    struct pair *pairs;   // room for PT_LEAF * OTHERS of each leaf
    uint8_t *pair_counts; // of each leaf
    patina_progress *progress;
};

// ---- pairs of neighbors ----------------------------------------------------------------------------------------------------

static double log_of(double light) { return light > DARK && !(light >= BRIGHT && light <= 1.0) ? pt_ln(light) : NAN; }

// Logarithms of a point's light. 0: it does not count.
static int look_at(const struct balance *balance, uint32_t slot, double logs[3])
{
    const struct patina_cloud *cloud = balance->cloud;
    if (cloud->shapes && (cloud->shapes[slot] >> PT_SHAPE_TRUST_SHIFT & 15u) < balance->least_level)
        return 0;
    for (uint32_t k = 0; k < 3; k++) {
        const size_t at = 3 * (size_t)slot + k;
        if (cloud->color_format == PT_COLOR_SRGB8) {
            logs[k] = (double)balance->logs[((const uint8_t *)cloud->colors)[at]];
        } else {
            const double light = (double)((const float *)cloud->colors)[at];
            logs[k] = isfinite(light) ? log_of(light) : NAN;
        }
        if (!isfinite(logs[k]))
            return 0;
    }
    return 1;
}

static uint32_t scan_of(const struct balance *balance, uint32_t slot)
{
    return balance->scans[pt_number_of(balance->cloud, slot)];
}

// The point in a lane beside its nearest neighbor of each of OTHERS other scans.
static uint32_t compare_point(const struct balance *balance, uint32_t place, const struct pt_found *found, struct pair *out)
{
    const uint32_t lane = place % PT_LEAF, slot = balance->tree.slots[place], own = scan_of(balance, slot);
    uint32_t seen[OTHERS], count = 0;
    double mine[3], other[3];
    if (own >= balance->count || !look_at(balance, slot, mine))
        return 0;
    for (uint32_t i = 0; i < found->count[lane] && count < OTHERS; i++) {
        const uint32_t beside = balance->tree.slots[found->place[lane][i]], scan = scan_of(balance, beside);
        int known = scan == own || scan >= balance->count;
        for (uint32_t j = 0; j < count; j++)
            known |= seen[j] == scan;
        if (known || !look_at(balance, beside, other))
            continue;
        const int turned = scan < own;
        struct pair *pair = &out[count];
        pair->scans[turned] = (uint16_t)own;
        pair->scans[!turned] = (uint16_t)scan;
        for (int k = 0; k < 3; k++) {
            const double way = turned ? other[k] - mine[k] : mine[k] - other[k];
            pair->ways[k] = (int16_t)floor(fmax(-32767.0, fmin(32767.0, way * STEPS)) + 0.5);
        }
        seen[count++] = scan;
    }
    return count;
}

static void compare_leaves(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct balance *balance = context;
    struct pt_found found;
    (void)thread;
    for (uint32_t i = begin; i < end && !pt_progress_cancelled(balance->progress); i++) {
        const uint32_t leaf = i * balance->step, lanes = pt_leaf_lanes(&balance->tree, leaf);
        struct pair *to = balance->pairs + (size_t)i * PT_LEAF * OTHERS;
        uint32_t count = 0;
        pt_neighbours_find(&balance->tree, &balance->tree, leaf, lanes, NEIGHBOURS, &found);
        for (uint32_t left = lanes; left; left &= left - 1)
            count += compare_point(balance, leaf * PT_LEAF + (uint32_t)__builtin_ctz(left), &found, to + count);
        balance->pair_counts[i] = (uint8_t)count;
    }
}

static int compare_pairs(const void *a, const void *b)
{
    const struct pair *x = a, *y = b;
    for (int i = 0; i < 2; i++)
        if (x->scans[i] != y->scans[i])
            return x->scans[i] < y->scans[i] ? -1 : 1;
    for (int k = 0; k < 3; k++)
        if (x->ways[k] != y->ways[k])
            return x->ways[k] < y->ways[k] ? -1 : 1;
    return 0;
}

// ---- two scans -------------------------------------------------------------------------------------------------------------

// The robust mean and its variance of one channel. room: for as many numbers as there are pairs.
static void measure(const struct pair *pairs, uint32_t count, int channel, double *room, double *mean, double *variance)
{
    for (uint32_t i = 0; i < count; i++)
        room[i] = pairs[i].ways[channel] / STEPS;
    qsort(room, count, sizeof *room, pt_compare_doubles);
    double at = room[count / 2];
    for (uint32_t i = 0; i < count; i++)
        room[i] = fabs(pairs[i].ways[channel] / STEPS - at);
    qsort(room, count, sizeof *room, pt_compare_doubles);
    const double around = 1.4826 * room[count / 2],
                 square = (around * around * count + SPREAD * SPREAD * SPREAD_PAIRS) / (count + SPREAD_PAIRS);
    const double turn = TURN * sqrt(fmax(around * around, 1e-4));
    for (int round = 0; round < ROUNDS; round++) {
        double sum = 0.0, weights = 0.0;
        for (uint32_t i = 0; i < count; i++) {
            const double way = pairs[i].ways[channel] / STEPS, off = fabs(way - at), weight = off > turn ? turn / off : 1.0;
            sum += weight * way;
            weights += weight;
        }
        at = sum / weights;
    }
    *mean = -at;
    *variance = square / count + SYSTEMATIC * SYSTEMATIC;
}

// Returns how many edges there are; pairs are sorted.
static uint32_t make_edges(const struct pair *pairs, uint32_t count, double *room, struct edge *out)
{
    uint32_t edges = 0;
    for (uint32_t first = 0, end; first < count; first = end) {
        for (end = first + 1; end < count && !memcmp(pairs[end].scans, pairs[first].scans, sizeof pairs->scans); end++)
            ;
        if (end - first < LEAST_PAIRS)
            continue;
        struct edge *edge = &out[edges++];
        for (int i = 0; i < 2; i++)
            edge->scans[i] = pairs[first].scans[i];
        for (int k = 0; k < 3; k++)
            measure(pairs + first, end - first, k, room, &edge->mean[k], &edge->variance[k]);
    }
    return edges;
}

// ---- all scans -------------------------------------------------------------------------------------------------------------

struct system { // of one channel: sum over edges of weight (x[a] - x[b] - mean)^2 + sum over scans of (x / LOOSE)^2
    const struct edge *edges;
    uint32_t edge_count, scans;
    double *weights;                                         // edges
    double *x, *right, *diagonal, *residual, *way, *product; // scans
};

static void multiply(const struct system *s, const double *x, double *out)
{
    for (uint32_t i = 0; i < s->scans; i++)
        out[i] = x[i] / (LOOSE * LOOSE);
    for (uint32_t e = 0; e < s->edge_count; e++) {
        const uint32_t a = s->edges[e].scans[0], b = s->edges[e].scans[1];
        const double flow = s->weights[e] * (x[a] - x[b]);
        out[a] += flow;
        out[b] -= flow;
    }
}

static double product_of(const double *a, const double *b, const double *over, uint32_t count)
{
    double sum = 0.0;
    for (uint32_t i = 0; i < count; i++)
        sum += over ? a[i] * b[i] / over[i] : a[i] * b[i];
    return sum;
}

// Conjugate gradients, from x on [Hestenes and Stiefel 1952].
static void solve(struct system *s, int channel)
{
    enum { MOST_STEPS = 4000 };
    for (uint32_t i = 0; i < s->scans; i++) {
        s->right[i] = 0.0;
        s->diagonal[i] = 1.0 / (LOOSE * LOOSE);
    }
    for (uint32_t e = 0; e < s->edge_count; e++) {
        const double flow = s->weights[e] * s->edges[e].mean[channel];
        for (int side = 0; side < 2; side++) {
            s->right[s->edges[e].scans[side]] += side ? -flow : flow;
            s->diagonal[s->edges[e].scans[side]] += s->weights[e];
        }
    }
    multiply(s, s->x, s->product);
    for (uint32_t i = 0; i < s->scans; i++) {
        s->residual[i] = s->right[i] - s->product[i];
        s->way[i] = s->residual[i] / s->diagonal[i];
    }
    double square = product_of(s->residual, s->residual, s->diagonal, s->scans);
    const double enough = 1e-16 * product_of(s->right, s->right, s->diagonal, s->scans);
    for (int step = 0; step < MOST_STEPS && square > enough; step++) {
        multiply(s, s->way, s->product);
        const double length = square / product_of(s->way, s->product, NULL, s->scans), before = square;
        for (uint32_t i = 0; i < s->scans; i++) {
            s->x[i] += length * s->way[i];
            s->residual[i] -= length * s->product[i];
        }
        square = product_of(s->residual, s->residual, s->diagonal, s->scans);
        for (uint32_t i = 0; i < s->scans; i++)
            s->way[i] = s->residual[i] / s->diagonal[i] + square / before * s->way[i];
    }
}

static uint32_t root_of(uint32_t *parent, uint32_t scan)
{
    for (; parent[scan] != scan; scan = parent[scan])
        parent[scan] = parent[parent[scan]];
    return scan;
}

// Gains of one channel: those of scans that overlap, directly or by others, have the mean 1.
static void take_gains(const struct system *s, uint32_t *parent, float *gains)
{
    for (uint32_t i = 0; i < s->scans; i++)
        s->product[i] = s->way[i] = 0.0;
    for (uint32_t i = 0; i < s->scans; i++) {
        s->product[root_of(parent, i)] += pt_exp(s->x[i]);
        s->way[root_of(parent, i)] += 1.0;
    }
    for (uint32_t i = 0; i < s->scans; i++) {
        const uint32_t root = root_of(parent, i);
        const double gain = pt_exp(s->x[i]) * s->way[root] / s->product[root];
        gains[3 * (size_t)i] = s->way[root] > 1.0 ? (float)fmax(LEAST_GAIN, fmin(MOST_GAIN, gain)) : 1.0f;
    }
}

static int find_gains(const struct edge *edges, uint32_t edge_count, uint32_t scans, float *gains)
{
    double *room = calloc(6 * (size_t)scans + edge_count + 1, sizeof *room);
    uint32_t *parent = malloc(((size_t)scans + 1) * sizeof *parent);
    struct system s = {.edges = edges, .edge_count = edge_count, .scans = scans};
    if (!room || !parent) {
        free(room);
        free(parent);
        return PATINA_ERROR_MEMORY;
    }
    double **const rows[] = {&s.x, &s.right, &s.diagonal, &s.residual, &s.way, &s.product, &s.weights};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        *rows[i] = room + i * scans;
    for (uint32_t i = 0; i < scans; i++)
        parent[i] = i;
    for (uint32_t e = 0; e < edge_count; e++)
        parent[root_of(parent, edges[e].scans[0])] = root_of(parent, edges[e].scans[1]);
    for (int k = 0; k < 3; k++) {
        memset(s.x, 0, scans * sizeof *s.x);
        for (int round = 0; round < ROUNDS; round++) {
            for (uint32_t e = 0; e < edge_count; e++) {
                const struct edge *edge = &edges[e];
                const double off = fabs(s.x[edge->scans[0]] - s.x[edge->scans[1]] - edge->mean[k]);
                const double turn = TURN * sqrt(edge->variance[k]);
                s.weights[e] = (round && off > turn ? turn / off : 1.0) / edge->variance[k];
            }
            solve(&s, k);
        }
        take_gains(&s, parent, gains + k);
    }
    free(room);
    free(parent);
    return PATINA_OK;
}

// ---- the cloud -------------------------------------------------------------------------------------------------------------

static uint32_t strata_of(const struct patina_cloud *cloud)
{
    uint32_t strata = PT_STRATA;
    for (uint64_t points = cloud->info.drawn; points > MOST_IN_TREE && strata > 1; points /= 2)
        strata--;
    return strata;
}

static int look_for_pairs(struct balance *balance, struct pt_pool *pool, uint32_t *count)
{
    int error = pt_neighbours_create(&balance->tree, balance->cloud, strata_of(balance->cloud), NULL, pool, balance->progress,
                                     0.0, 0.5);
    if (error)
        return error;
    balance->tree.any_twins = 1;
    balance->step = balance->tree.leaf_count / (MOST_ASKED / PT_LEAF) + 1;
    balance->asked = (balance->tree.leaf_count + balance->step - 1) / balance->step;
    balance->pairs = malloc(((size_t)balance->asked * PT_LEAF * OTHERS + 1) * sizeof *balance->pairs);
    balance->pair_counts = calloc((size_t)balance->asked + 1, 1);
    if (balance->pairs && balance->pair_counts)
        pt_parallel(pool, balance->asked, 16, compare_leaves, balance);
    else
        error = PATINA_ERROR_MEMORY;
    pt_neighbours_destroy(&balance->tree);
    *count = 0;
    for (uint32_t i = 0; i < balance->asked && !error; i++) {
        memmove(balance->pairs + *count, balance->pairs + (size_t)i * PT_LEAF * OTHERS,
                balance->pair_counts[i] * sizeof *balance->pairs);
        *count += balance->pair_counts[i];
    }
    return error ? error : pt_progress_cancelled(balance->progress) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}

static int find(struct balance *balance, struct pt_pool *pool, float *gains)
{
    uint32_t count = 0;
    int error = look_for_pairs(balance, pool, &count);
    if (error || !count)
        return error;
    qsort(balance->pairs, count, sizeof *balance->pairs, compare_pairs);
    struct edge *edges = malloc((count / LEAST_PAIRS + 1) * sizeof *edges);
    double *room = malloc(count * sizeof *room);
    error = edges && room ? PATINA_OK : PATINA_ERROR_MEMORY;
    const uint32_t edge_count = error ? 0 : make_edges(balance->pairs, count, room, edges);
    if (edge_count)
        error = find_gains(edges, edge_count, balance->count, gains);
    free(edges);
    free(room);
    return error;
}

int patina_cloud_balance(const patina_cloud *cloud, const uint16_t *scans, uint32_t count, patina_progress *progress,
                         float *gains)
{
    if (!cloud || cloud->handle.magic != PT_MAGIC || !scans || !count || count > MOST_SCANS || !gains)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT,
                       "patina_cloud_balance: a cloud that was destroyed, no array, or not 1 to %d scans", MOST_SCANS);
    if (!cloud->colors)
        return pt_fail(NULL, PATINA_ERROR_EMPTY, "patina_cloud_balance: the cloud has no colors");
    int error = pt_undivided_enter(cloud, "patina_cloud_balance");
    if (error)
        return error;
    struct balance balance = {.cloud = cloud, .scans = scans, .count = count, .progress = progress};
    struct pt_pool *pool = pt_pool_create(pt_pool_threads_for(cloud->threads, cloud->info.drawn), 0);
    for (size_t i = 0; i < 3 * (size_t)count; i++)
        gains[i] = 1.0f;
    for (int i = 0; i < 256; i++)
        balance.logs[i] = (float)log_of(pt_linear_of_srgb(i / 255.0));
    balance.least_level = cloud->shapes ? pt_default_level(cloud->info.trusts) : 0;
    if (!pool)
        error = PATINA_ERROR_MEMORY;
    else if (count > 1 && cloud->info.drawn)
        error = find(&balance, pool, gains);
    pt_pool_destroy(pool);
    free(balance.pairs);
    free(balance.pair_counts);
    pt_paged_leave(cloud);
    error = error ? error : pt_pages_fail_lost(cloud);
    if (error == PATINA_ERROR_CANCELLED)
        return pt_fail(NULL, error, "balancing the scans was cancelled");
    if (error == PATINA_ERROR_MEMORY)
        return pt_fail(NULL, error, "balancing %u scans of %llu points: out of memory", count,
                       (unsigned long long)cloud->info.drawn);
    pt_progress_set(progress, 1.0);
    return error;
}
