// SPDX-License-Identifier: GPL-3.0-or-later
// Finding neighbours: the walk through the trees of neighbours.c. Every rounding here is monotone in the places, so that a
// box is never farther than what lies in it; ties therefore come out as their numbers say.
#include "neighbours.h"

#include <float.h>
#include <math.h>
#include <string.h>

#if (defined(__x86_64__) || defined(__i386__)) && !defined(PT_ONLY_SCALAR)
#define WITH_AVX 1
#include <immintrin.h>
#endif

struct walk {
    _Alignas(64) double place[3][PT_LEAF]; // of the lanes, in the frame that is walked
    _Alignas(64) double worst
        [PT_LEAF]; // square of the distance to the k-th found; negative: a lane that does not look; DBL_MAX: fewer are found, and points at infinity are none
    double bound[PT_LEAF];                   // worst until k are found: DBL_MAX, or what the caller knows
    double middle[3];                        // of them: what is nearest to it is walked first
    const struct pt_neighbours *tree, *from; // that is walked, that the lanes are of
    struct pt_found *found;
    uint32_t leaf, k, frame; // frame: a chunk, or one of these two
};

#define NO_FRAME 0xFFFFFFFFu
#define FRAME_OF_CLOUD 0xFFFFFFFEu

uint32_t pt_leaf_lanes(const struct pt_neighbours *tree, uint32_t leaf)
{
    const uint32_t c = tree->leaf_chunk[leaf];
    const uint32_t before = (leaf - tree->chunk_leaf[c]) * PT_LEAF, left = pt_neighbours_of_chunk(tree, c) - before;
    return left >= PT_LEAF ? 0xFFFFu : (1u << left) - 1u;
}

static double outside(double p, double low, double high)
{
    const double out = p < low ? low - p : p > high ? p - high : 0.0;
    return out * out;
}

// Places of the lanes relative to `origin`.
static void set_frame(struct walk *walk, const double origin[3], uint32_t frame)
{
    const struct pt_neighbours *tree = walk->from;
    const float *xyz = tree->places + (size_t)walk->leaf * 3 * PT_LEAF;
    const double *own = tree->cloud->chunks[tree->leaf_chunk[walk->leaf]].origin;
    uint32_t first = 0, last = (uint32_t)__builtin_popcount(pt_leaf_lanes(tree, walk->leaf)) - 1;
    while (first < last && !isfinite(xyz[first])) // points may be out of the tree: trust.c
        first++;
    while (last > first && !isfinite(xyz[last]))
        last--;
    for (int k = 0; k < 3; k++) {
        const double shift = own[k] - origin[k];
        for (int i = 0; i < PT_LEAF; i++)
            walk->place[k][i] = (double)xyz[k * PT_LEAF + i] + shift;
        walk->middle[k] = 0.5 * (walk->place[k][first] + walk->place[k][last]);
    }
    walk->frame = frame;
}

static void enter(struct walk *walk, uint32_t chunk)
{
    if (walk->frame != chunk)
        set_frame(walk, walk->tree->cloud->chunks[chunk].origin, chunk);
}

static void enter_cloud(struct walk *walk)
{
    if (walk->frame != FRAME_OF_CLOUD)
        set_frame(walk, walk->tree->origin, FRAME_OF_CLOUD);
}

static uint32_t number(const struct walk *walk, uint32_t place)
{
    return pt_number_of(walk->tree->cloud, walk->tree->slots[place]);
}

// ---- a lane's sorted list --------------------------------------------------------------------------------------------------

enum { ROUND = 16 }; // lists are taken so many at a time; what lies behind their end is infinite

static void begin_lane(struct walk *walk, uint32_t lane)
{
    for (uint32_t i = 0; i < (walk->k + ROUND - 1) / ROUND * ROUND; i++)
        walk->found->square[lane][i] = INFINITY;
    walk->found->count[lane] = 0;
    walk->worst[lane] = walk->bound[lane];
}

// A full list's farthest: -1 ends the search of a point that has found enough at its own place.
static inline double worst_of(const struct walk *walk, double square)
{
    return square > 0.0 || !walk->tree->any_twins ? square : -1.0;
}

// Those of a leaf's points that `near` marks, which were near enough when it was made; the leaf's first place.
static inline void take_each(struct walk *walk, uint32_t lane, const double square[PT_LEAF], uint32_t near, uint32_t first)
{
    double *squares = walk->found->square[lane];
    uint32_t *places = walk->found->place[lane], count = walk->found->count[lane];
    for (; near; near &= near - 1) {
        const uint32_t other = (uint32_t)__builtin_ctz(near), place = first + other;
        const double x = square[other];
        if (count == walk->k &&
            (x > squares[count - 1] || (x == squares[count - 1] && number(walk, place) > number(walk, places[count - 1]))))
            continue;
        uint32_t at = count < walk->k ? count++ : count - 1;
        while (at > 0 &&
               (squares[at - 1] > x || (squares[at - 1] == x && number(walk, places[at - 1]) > number(walk, place)))) {
            squares[at] = squares[at - 1];
            places[at] = places[at - 1];
            at--;
        }
        squares[at] = x;
        places[at] = place;
    }
    walk->found->count[lane] = count;
    walk->worst[lane] = count == walk->k ? worst_of(walk, squares[count - 1]) : walk->bound[lane];
}

// ---- plain -----------------------------------------------------------------------------------------------------------------

#define TARGET
#define LEVEL(name) name##_plain
#include "neighbours_walk.h"

static inline uint32_t near_box_plain(const struct walk *walk, const double low[3], const double high[3])
{
    uint32_t lanes = 0;
    for (int i = 0; i < PT_LEAF; i++) {
        double square = 0.0;
        for (int k = 0; k < 3; k++) {
            const double below = low[k] - walk->place[k][i], above = walk->place[k][i] - high[k];
            const double most = below > above ? below : above, out = most > 0.0 ? most : 0.0;
            square += out * out;
        }
        lanes |= (uint32_t)(square <= walk->worst[i]) << i;
    }
    return lanes;
}

static inline uint32_t near_points_plain(const float *xyz, const double place[3], double worst, double square[PT_LEAF])
{
    uint32_t lanes = 0;
    for (int i = 0; i < PT_LEAF; i++) {
        const double x = (double)xyz[i] - place[0], y = (double)xyz[PT_LEAF + i] - place[1],
                     z = (double)xyz[2 * PT_LEAF + i] - place[2];
        square[i] = x * x + y * y + z * z;
    }
    for (int i = 0; i < PT_LEAF; i++)
        lanes |= (uint32_t)(square[i] <= worst) << i;
    return lanes;
}

static inline void take_plain(struct walk *walk, uint32_t lane, const double square[PT_LEAF], uint32_t near, uint32_t first)
{
    take_each(walk, lane, square, near, first);
}
#undef TARGET
#undef LEVEL

#ifdef WITH_AVX
// ---- AVX2 ------------------------------------------------------------------------------------------------------------------

#define TARGET __attribute__((target("avx2,popcnt")))
#define LEVEL(name) name##_avx2
#include "neighbours_walk.h"

TARGET static inline uint32_t near_box_avx2(const struct walk *walk, const double low[3], const double high[3])
{
    uint32_t lanes = 0;
    for (int i = 0; i < PT_LEAF; i += 4) {
        __m256d square = _mm256_setzero_pd();
        for (int k = 0; k < 3; k++) {
            const __m256d p = _mm256_load_pd(&walk->place[k][i]);
            const __m256d most = _mm256_max_pd(_mm256_sub_pd(_mm256_set1_pd(low[k]), p),
                                               _mm256_sub_pd(p, _mm256_set1_pd(high[k])));
            const __m256d out = _mm256_max_pd(most, _mm256_setzero_pd());
            square = _mm256_add_pd(square, _mm256_mul_pd(out, out));
        }
        lanes |= (uint32_t)_mm256_movemask_pd(_mm256_cmp_pd(square, _mm256_load_pd(&walk->worst[i]), _CMP_LE_OQ)) << i;
    }
    return lanes;
}

TARGET static inline uint32_t near_points_avx2(const float *xyz, const double place[3], double worst, double square[PT_LEAF])
{
    uint32_t lanes = 0;
    for (int i = 0; i < PT_LEAF; i += 4) {
        const __m256d x = _mm256_sub_pd(_mm256_cvtps_pd(_mm_loadu_ps(xyz + i)), _mm256_set1_pd(place[0]));
        const __m256d y = _mm256_sub_pd(_mm256_cvtps_pd(_mm_loadu_ps(xyz + PT_LEAF + i)), _mm256_set1_pd(place[1]));
        const __m256d z = _mm256_sub_pd(_mm256_cvtps_pd(_mm_loadu_ps(xyz + 2 * PT_LEAF + i)), _mm256_set1_pd(place[2]));
        const __m256d sum = _mm256_add_pd(_mm256_add_pd(_mm256_mul_pd(x, x), _mm256_mul_pd(y, y)), _mm256_mul_pd(z, z));
        _mm256_store_pd(square + i, sum);
        lanes |= (uint32_t)_mm256_movemask_pd(_mm256_cmp_pd(sum, _mm256_set1_pd(worst), _CMP_LE_OQ)) << i;
    }
    return lanes;
}

TARGET static inline void take_avx2(struct walk *walk, uint32_t lane, const double square[PT_LEAF], uint32_t near,
                                    uint32_t first)
{
    take_each(walk, lane, square, near, first);
}
#undef TARGET
#undef LEVEL

// ---- AVX-512 ---------------------------------------------------------------------------------------------------------------

#define TARGET __attribute__((target("avx512f,avx512vl,avx512dq,popcnt")))
#define LEVEL(name) name##_avx512
#include "neighbours_walk.h"

TARGET static inline uint32_t near_box_avx512(const struct walk *walk, const double low[3], const double high[3])
{
    uint32_t lanes = 0;
    for (int i = 0; i < PT_LEAF; i += 8) {
        __m512d square = _mm512_setzero_pd();
        for (int k = 0; k < 3; k++) {
            const __m512d p = _mm512_load_pd(&walk->place[k][i]);
            const __m512d most = _mm512_max_pd(_mm512_sub_pd(_mm512_set1_pd(low[k]), p),
                                               _mm512_sub_pd(p, _mm512_set1_pd(high[k])));
            const __m512d out = _mm512_max_pd(most, _mm512_setzero_pd());
            square = _mm512_add_pd(square, _mm512_mul_pd(out, out));
        }
        lanes |= (uint32_t)_mm512_cmp_pd_mask(square, _mm512_load_pd(&walk->worst[i]), _CMP_LE_OQ) << i;
    }
    return lanes;
}

TARGET static inline uint32_t near_points_avx512(const float *xyz, const double place[3], double worst, double square[PT_LEAF])
{
    uint32_t lanes = 0;
    for (int i = 0; i < PT_LEAF; i += 8) {
        const __m512d x = _mm512_sub_pd(_mm512_cvtps_pd(_mm256_loadu_ps(xyz + i)), _mm512_set1_pd(place[0]));
        const __m512d y = _mm512_sub_pd(_mm512_cvtps_pd(_mm256_loadu_ps(xyz + PT_LEAF + i)), _mm512_set1_pd(place[1]));
        const __m512d z = _mm512_sub_pd(_mm512_cvtps_pd(_mm256_loadu_ps(xyz + 2 * PT_LEAF + i)), _mm512_set1_pd(place[2]));
        const __m512d sum = _mm512_add_pd(_mm512_add_pd(_mm512_mul_pd(x, x), _mm512_mul_pd(y, y)), _mm512_mul_pd(z, z));
        _mm512_store_pd(square + i, sum);
        lanes |= (uint32_t)_mm512_cmp_pd_mask(sum, _mm512_set1_pd(worst), _CMP_LE_OQ) << i;
    }
    return lanes;
}

// The list in registers, `rounds` of 8: what is nearer stays, the rest moves up by one, and the greatest of what moved there
// and the new one is right for every place. Equal distances go the slow way.
TARGET static inline __attribute__((always_inline)) void take_rounds(struct walk *walk, uint32_t lane,
                                                                     const double square[PT_LEAF], uint32_t near,
                                                                     uint32_t first, const uint32_t rounds)
{
    double *squares = walk->found->square[lane];
    uint32_t *places = walk->found->place[lane], count = walk->found->count[lane];
    const uint32_t last = walk->k - 1;
    __m512d d[8];
    __m256i p[8];
    for (uint32_t i = 0; i < rounds; i++) {
        d[i] = _mm512_loadu_pd(squares + 8 * i);
        p[i] = _mm256_loadu_si256((const __m256i *)(places + 8 * i));
    }
    for (; near; near &= near - 1) {
        const uint32_t other = (uint32_t)__builtin_ctz(near);
        const __m512d x = _mm512_set1_pd(square[other]);
        __mmask8 nearer[8], equal = 0;
        for (uint32_t i = 0; i < rounds; i++) {
            nearer[i] = _mm512_cmp_pd_mask(d[i], x, _CMP_LE_OQ);
            equal |= _mm512_cmp_pd_mask(d[i], x, _CMP_EQ_OQ);
        }
        if (equal) {
            for (uint32_t i = 0; i < rounds; i++) {
                _mm512_storeu_pd(squares + 8 * i, d[i]);
                _mm256_storeu_si256((__m256i *)(places + 8 * i), p[i]);
            }
            walk->found->count[lane] = count;
            walk->worst[lane] = count == walk->k ? worst_of(walk, squares[last]) : walk->bound[lane];
            take_each(walk, lane, square, near, first);
            return;
        }
        const __m256i place = _mm256_set1_epi32((int)(first + other));
        for (uint32_t i = rounds; i-- > 0;) {
            const __m512d below = i ? d[i - 1] : x;
            const __m512d moved = _mm512_castsi512_pd(
                _mm512_alignr_epi64(_mm512_castpd_si512(d[i]), _mm512_castpd_si512(below), 7));
            const __m256i moved_place = _mm256_alignr_epi32(p[i], i ? p[i - 1] : place, 7);
            const __mmask8 carried = i ? nearer[i - 1] >> 7 : 1, at = (__mmask8)((nearer[i] << 1 | carried) & ~nearer[i]);
            d[i] = _mm512_mask_blend_pd(nearer[i], _mm512_max_pd(moved, x), d[i]);
            p[i] = _mm256_mask_blend_epi32(at, _mm256_mask_blend_epi32(nearer[i], moved_place, p[i]), place);
        }
        count += count <= last;
    }
    for (uint32_t i = 0; i < rounds; i++) {
        _mm512_storeu_pd(squares + 8 * i, d[i]);
        _mm256_storeu_si256((__m256i *)(places + 8 * i), p[i]);
    }
    walk->found->count[lane] = count;
    walk->worst[lane] = count > last ? worst_of(walk, squares[last]) : walk->bound[lane];
}

TARGET static inline void take_avx512(struct walk *walk, uint32_t lane, const double square[PT_LEAF], uint32_t near,
                                      uint32_t first)
{
    if (walk->k <= 8)
        take_rounds(walk, lane, square, near, first, 1);
    else if (walk->k <= 16)
        take_rounds(walk, lane, square, near, first, 2);
    else if (walk->k <= 48)
        take_rounds(walk, lane, square, near, first, 6);
    else
        take_rounds(walk, lane, square, near, first, 8);
}
#undef TARGET
#undef LEVEL
#endif

// ----------------------------------------------------------------------------------------------------------------------------

void pt_neighbours_find_within(const struct pt_neighbours *tree, const struct pt_neighbours *from, uint32_t leaf,
                               uint32_t lanes, uint32_t k, const double squares[PT_LEAF], struct pt_found *found)
{
    struct walk walk = {.tree = tree, .from = from, .found = found, .leaf = leaf, .k = k, .frame = NO_FRAME};
    for (int i = 0; i < PT_LEAF; i++) {
        walk.worst[i] = -1.0;
        walk.bound[i] = squares ? fmin(squares[i], DBL_MAX) : DBL_MAX;
    }
    for (uint32_t left = lanes; left; left &= left - 1)
        begin_lane(&walk, (uint32_t)__builtin_ctz(left));
    if (!lanes)
        return;
#ifdef WITH_AVX
    if (tree->level == 2) {
        walk_cloud_avx512(&walk);
        return;
    }
    if (tree->level == 1) {
        walk_cloud_avx2(&walk);
        return;
    }
#endif
    walk_cloud_plain(&walk);
}

void pt_neighbours_find(const struct pt_neighbours *tree, const struct pt_neighbours *from, uint32_t leaf, uint32_t lanes,
                        uint32_t k, struct pt_found *found)
{
    pt_neighbours_find_within(tree, from, leaf, lanes, k, NULL, found);
}

void pt_neighbours_offset(const struct pt_neighbours *tree, const struct pt_neighbours *from, uint32_t at, uint32_t to,
                          double offset[3])
{
    const float *a = from->places + (size_t)(at / PT_LEAF) * 3 * PT_LEAF + at % PT_LEAF;
    const float *b = tree->places + (size_t)(to / PT_LEAF) * 3 * PT_LEAF + to % PT_LEAF;
    const uint32_t chunk_a = from->leaf_chunk[at / PT_LEAF], chunk_b = tree->leaf_chunk[to / PT_LEAF];
    const double *origin_a = tree->cloud->chunks[chunk_a].origin, *origin_b = tree->cloud->chunks[chunk_b].origin;
    for (int k = 0; k < 3; k++) // the shift first, as the walk has it
        offset[k] = (double)b[k * PT_LEAF] - ((double)a[k * PT_LEAF] + (origin_a[k] - origin_b[k]));
}
