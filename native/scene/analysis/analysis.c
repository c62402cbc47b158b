// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis.h"
#include "beams.h"
#include "free_space.h"
#include "grids.h"
#include "scene/clouds/clusters.h"
#include "base/compare.h"
#include "base/descriptor.h"
#include "base/platform.h"
#include "orient.h"
#include "trust.h"
#include "scene/clouds/paged.h"
#include "scene/clouds/page_sums.h"
#include "uncolored.h"
#include "scene/clouds/parts.h"
#include "base/progress.h"
#include "shared/words.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// Where 16 neighbours leave doubts, three times as many are asked: rows 1 : 10 apart fill three of them, and noise of half a
// spacing is flat then. What is a volume to them is looked at once more among every eighth point.
enum { NEIGHBOURS = 16, WIDER = 3, FAR_STRATA = 3, FAR_THINNING = 8 };

struct walk {
    const patina_cloud *cloud;
    const patina_analysis_desc *desc;
    struct pt_analysis *out;
    struct pt_store *store;
    struct pt_neighbours tree, coarse;
    struct pt_beams beams;
    struct pt_grids grids;
    struct pt_trust trust;
    patina_progress *progress;
    uint32_t k;
    int rows;  // without stations: the cloud's samples lie in rows, far apart
    int given; // normals that the cloud has know their side
    struct tally {
        uint32_t kinds[6], estimated, unoriented;
    } * tallies; // a chunk
    atomic_uint done;
};

// ---- a leaf ----------------------------------------------------------------------------------------------------------------

static void sample_of(const struct pt_neighbours *tree, const struct pt_neighbours *from, uint32_t place,
                      const struct pt_found *found, struct pt_sample *sample)
{
    const uint32_t lane = place % PT_LEAF;
    sample->count = found->count[lane];
    for (uint32_t i = 0; i < sample->count; i++) {
        pt_neighbours_offset(tree, from, place, found->place[lane][i], sample->offset[i]);
        sample->square[i] = found->square[lane][i];
    }
}

static uint64_t all_of(const struct pt_sample *sample) { return sample->count >= 64 ? ~0ull : (1ull << sample->count) - 1ull; }

static void look_from_afar(const struct pt_neighbours *tree, const struct pt_neighbours *coarse, uint32_t leaf, uint32_t lanes,
                           struct pt_found *found, struct pt_neighbourhood hoods[PT_LEAF])
{
    struct pt_sample sample;
    struct pt_plane plane;
    uint32_t volume = 0;
    for (uint32_t left = lanes; left; left &= left - 1) {
        const uint32_t lane = (uint32_t)__builtin_ctz(left);
        volume |= (uint32_t)(hoods[lane].kind == PT_KIND_VOLUME) << lane;
    }
    if (!volume)
        return;
    pt_neighbours_find(coarse, tree, leaf, volume, PT_NEIGHBOURS_MOST, found);
    for (; volume; volume &= volume - 1) {
        const uint32_t lane = (uint32_t)__builtin_ctz(volume);
        sample_of(coarse, tree, leaf * PT_LEAF + lane, found, &sample);
        pt_plane_fit(&sample, all_of(&sample), &plane);
        if (sample.count == PT_NEIGHBOURS_MOST)
            pt_neighbourhood_from_afar(&sample, &plane, FAR_THINNING, &hoods[lane]);
    }
}

// What else is known of the point in a place of the tree may shrink its footprint.
typedef void limit_work(void *context, uint32_t place, const struct pt_sample *sample, struct pt_neighbourhood *hood);

// The lanes of a leaf described: neighbours, plane, kind; then limited, where limit is not NULL. found is room to work in.
static void describe_leaf(const struct pt_neighbours *tree, const struct pt_neighbours *coarse, uint32_t leaf, uint32_t lanes,
                          uint32_t k, struct pt_found *found, struct pt_neighbourhood hoods[PT_LEAF], limit_work *limit,
                          void *context)
{
    const uint32_t wider = WIDER * k < PT_NEIGHBOURS_MOST ? WIDER * k : PT_NEIGHBOURS_MOST;
    struct pt_plane planes[PT_LEAF], wide;
    struct pt_sample samples[PT_LEAF], narrow;
    uint32_t doubtful = 0;
    pt_neighbours_find(tree, tree, leaf, lanes, k, found);
    for (uint32_t left = lanes; left; left &= left - 1) {
        const uint32_t lane = (uint32_t)__builtin_ctz(left);
        struct pt_sample *sample = &samples[lane];
        sample_of(tree, tree, leaf * PT_LEAF + lane, found, sample);
        pt_plane_fit(sample, all_of(sample), &planes[lane]);
        const int more = wider > k && sample->count == k;
        if (!more || !pt_plane_is_doubtful(&planes[lane]))
            pt_neighbourhood_of(sample, &planes[lane], &hoods[lane]);
        if (more && (pt_plane_is_doubtful(&planes[lane]) || pt_neighbourhood_is_doubtful(&hoods[lane])))
            doubtful |= 1u << lane;
    }
    if (doubtful)
        pt_neighbours_find(tree, tree, leaf, doubtful, wider, found);
    for (; doubtful; doubtful &= doubtful - 1) {
        const uint32_t lane = (uint32_t)__builtin_ctz(doubtful);
        struct pt_sample *sample = &samples[lane];
        sample_of(tree, tree, leaf * PT_LEAF + lane, found, sample);
        pt_plane_fit(sample, all_of(sample), &wide);
        const int flat = !pt_plane_is_doubtful(&planes[lane]); // and came here for its rows, or its border
        if (flat ? !pt_plane_is_doubtful(&wide) : pt_plane_prefers_wide(&planes[lane], &wide)) {
            struct pt_neighbourhood known = hoods[lane];
            pt_neighbourhood_of(sample, &wide, &hoods[lane]);
            if (flat && known.kind == PT_KIND_BORDER && hoods[lane].kind == PT_KIND_BORDER)
                hoods[lane] = known; // a border to both: the nearer neighbours tell its spacing better
        } else {
            narrow = *sample; // the nearest k of them
            narrow.count = k;
            pt_neighbourhood_of(&narrow, &planes[lane], &hoods[lane]);
        }
    }
    look_from_afar(tree, coarse, leaf, lanes, found, hoods);
    for (uint32_t left = lanes; left; left &= left - 1) {
        const uint32_t lane = (uint32_t)__builtin_ctz(left);
        hoods[lane].sampled = hoods[lane].spacing;
        if (limit)
            limit(context, leaf * PT_LEAF + lane, &samples[lane], &hoods[lane]);
    }
}

// ---- a chunk ---------------------------------------------------------------------------------------------------------------

// Turns the normal as what is known says; returns whether anything is.
static int orient(const struct pt_beam *beam, const double p[3], uint32_t given, double n[3])
{
    double towards[3];
    if (given != PT_NORMAL_NONE) {
        pt_decode_normal(given, towards);
    } else if (beam) {
        for (int k = 0; k < 3; k++)
            towards[k] = beam->place[k] - p[k];
    } else {
        return 0;
    }
    const double facing = n[0] * towards[0] + n[1] * towards[1] + n[2] * towards[2];
    for (int k = 0; k < 3 && facing < 0.0; k++)
        n[k] = -n[k];
    return 1;
}

// The beam that took a point, and where that lies; NULL where no station is known.
static const struct pt_beam *beam_of(const struct walk *walk, const struct pt_chunk *chunk, uint32_t slot, double p[3])
{
    pt_point_place(walk->cloud, chunk, slot - chunk->first, p);
    return walk->beams.count ? &walk->beams.each[pt_station_of(walk->desc, pt_number_of(walk->cloud, slot), p)] : NULL;
}

// A dot is no wider than points lie apart anywhere; a surface, whose rows may lie farther apart, four times that.
static void limit_stray(const struct walk *walk, struct pt_neighbourhood *hood)
{
    const int dot = hood->kind == PT_KIND_VOLUME || hood->kind == PT_KIND_STRAY;
    const double most = (dot ? 1.0 : 4.0) * walk->cloud->info.spacing_max;
    if (!(most > 0.0) || !(hood->major > most))
        return;
    hood->major = most;
    hood->minor = fmin(hood->minor, most);
    hood->spacing = fmin(hood->spacing, most);
}

struct limited { // by a chunk's beams
    struct walk *walk;
    uint32_t chunk;
    int again; // without untrusted points
};

static void limit_point(void *context, uint32_t place, const struct pt_sample *sample, struct pt_neighbourhood *hood)
{
    struct limited *limited = context;
    const uint32_t slot = limited->walk->tree.slots[place];
    double p[3];
    const struct pt_beam *beam = beam_of(limited->walk, &limited->walk->cloud->chunks[limited->chunk], slot, p);
    if (!limited->again)
        pt_trust_note(&limited->walk->trust, place, sample);
    if (pt_grids_describe(&limited->walk->grids, limited->walk->desc, slot, pt_number_of(limited->walk->cloud, slot), hood))
        return;
    if (beam)
        pt_beam_limit(beam, p, sample, hood);
    else if (!limited->walk->rows)
        pt_neighbourhood_bound(sample, hood);
    if (!beam)
        limit_stray(limited->walk, hood);
}

// Whether the middling surface is uneven: then samples lie in rows wherever one looks. Else what looks like rows is what stands in
// rows: bars, steps, louvres.
static int lies_in_rows(const struct walk *walk)
{
    enum {
        MOST = 1024,
        LEAST = 64,
        SHARE = 8
    }; // leaves that are looked at, and which share: each costs as much as its description
    const uint32_t leaves = walk->tree.leaf_count, share = leaves / SHARE;
    const uint32_t step = leaves / (share > MOST ? MOST : share < LEAST ? LEAST : share) + 1;
    struct pt_found found;
    struct pt_neighbourhood hoods[PT_LEAF];
    uint64_t flat = 0, uneven = 0;
    for (uint32_t leaf = step / 2; leaf < leaves && !pt_progress_cancelled(walk->progress); leaf += step) {
        describe_leaf(&walk->tree, &walk->coarse, leaf, pt_leaf_lanes(&walk->tree, leaf), walk->k, &found, hoods, NULL, NULL);
        for (uint32_t left = pt_leaf_lanes(&walk->tree, leaf); left; left &= left - 1) {
            const struct pt_neighbourhood *hood = &hoods[__builtin_ctz(left)];
            flat += hood->kind == PT_KIND_SURFACE;
            uneven += hood->kind == PT_KIND_SURFACE && hood->uneven > PT_UNEVEN_ROWS;
        }
        pt_store_look(walk->store);
    }
    return 2 * uneven > flat;
}

static void write_point(struct walk *walk, uint32_t chunk_index, uint32_t slot, struct pt_neighbourhood *hood)
{
    const struct pt_chunk *chunk = &walk->cloud->chunks[chunk_index];
    struct tally *tally = &walk->tallies[chunk_index];
    const uint32_t given = walk->given ? walk->cloud->surfels[slot] & PT_NORMAL_BITS : PT_NORMAL_NONE;
    uint32_t bits = given;
    double p[3];
    const struct pt_beam *beam = beam_of(walk, chunk, slot, p);
    tally->kinds[hood->kind]++;
    if (hood->has_normal && !(walk->desc->keep_normals && given != PT_NORMAL_NONE)) {
        tally->unoriented += !orient(beam, p, given, hood->normal) && !hood->sided;
        tally->estimated++;
        bits = pt_encode_normal(hood->normal);
    }
    const double spacing = hood->spacing > 0.0 ? hood->spacing : (double)chunk->spacing;
    walk->out->surfels[slot] = bits | pt_class_of_spacing(spacing, walk->out->spacing_base) << PT_SPACING_SHIFT;
    walk->out->shapes[slot] = pt_pack_shape(hood, bits, walk->out->spacing_base);
}

static void finish_chunk(struct walk *walk, struct pt_chunk *chunk, float *spacings, uint32_t known)
{
    uint32_t *surfels = walk->out->surfels + chunk->first, *shapes = walk->out->shapes + chunk->first;
    uint32_t histogram[64] = {0}, most = 0, below = 0, at = 0;
    for (uint32_t i = 0; i < chunk->count; i++) {
        histogram[shapes[i] & 63u]++;
        most = (shapes[i] & 63u) > most ? shapes[i] & 63u : most;
    }
    for (; at < 63 && (below += histogram[at]) < chunk->count * 9u / 10u; at++)
        ;
    chunk->reach = (float)(walk->out->spacing_base * pt_spacing_of_class(most));
    chunk->footprint = (float)(walk->out->spacing_base * pt_spacing_of_class(at));
    qsort(spacings, known, sizeof *spacings, pt_compare_floats);
    chunk->spacing = known ? spacings[known / 2] : chunk->spacing;
    for (uint32_t i = chunk->count; i < chunk->padded; i++) {
        surfels[i] = surfels[chunk->count - 1];
        shapes[i] = shapes[chunk->count - 1];
    }
}

// Neighbours one after another, whatever level they are of: what they read lies side by side.
static void walk_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct walk *walk = context;
    struct pt_found found;
    struct pt_neighbourhood hoods[PT_LEAF];
    float spacings[PT_CHUNK_POINTS];
    (void)thread;
    for (uint32_t i = begin; i < end; i++) {
        const uint32_t c = walk->tree.chunk_order[i];
        struct limited limited = {walk, c, 0};
        uint32_t known = 0;
        for (uint32_t leaf = walk->tree.chunk_leaf[c]; leaf < walk->tree.chunk_leaf[c + 1]; leaf++) {
            if (pt_progress_cancelled(walk->progress))
                return;
            const uint32_t lanes = pt_leaf_lanes(&walk->tree, leaf);
            describe_leaf(&walk->tree, &walk->coarse, leaf, lanes, walk->k, &found, hoods, limit_point, &limited);
            for (uint32_t left = lanes; left; left &= left - 1) {
                const uint32_t lane = (uint32_t)__builtin_ctz(left);
                hoods[lane].trust = 1.0;
                write_point(walk, c, walk->tree.slots[leaf * PT_LEAF + lane], &hoods[lane]);
                if (hoods[lane].sampled > 0.0)
                    spacings[known++] = (float)hoods[lane].sampled;
            }
            pt_store_look(walk->store);
        }
        finish_chunk(walk, &walk->out->chunks[c], spacings, known);
        uint32_t done = atomic_fetch_add_explicit(&walk->done, 1, memory_order_relaxed) + 1;
        pt_progress_raise(walk->progress, 0.05 + 0.55 * done / walk->cloud->chunk_count);
    }
}

// ---- without untrusted points ------------------------------------------------------------------------------------------------

// The point's share of the tally, before it is described once more.
static void forget_point(struct walk *walk, uint32_t chunk_index, uint32_t slot)
{
    const uint32_t given = walk->given ? walk->cloud->surfels[slot] & PT_NORMAL_BITS : PT_NORMAL_NONE;
    struct tally *tally = &walk->tallies[chunk_index];
    tally->kinds[PT_SHAPE_KIND(walk->out->shapes[slot])]--;
    tally->estimated -= (walk->out->surfels[slot] & PT_NORMAL_BITS) != given;
}

static void walk_touched(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct walk *walk = context;
    struct pt_found found;
    struct pt_neighbourhood hoods[PT_LEAF];
    (void)thread;
    for (uint32_t i = begin; i < end; i++) {
        const uint32_t c = walk->tree.chunk_order[i];
        struct limited limited = {walk, c, 1};
        uint32_t touched = 0;
        for (uint32_t leaf = walk->tree.chunk_leaf[c]; leaf < walk->tree.chunk_leaf[c + 1]; leaf++) {
            if (pt_progress_cancelled(walk->progress))
                return;
            const uint32_t lanes = pt_trust_touched(&walk->trust, leaf);
            touched |= lanes;
            if (lanes)
                describe_leaf(&walk->tree, &walk->coarse, leaf, lanes, walk->k, &found, hoods, limit_point, &limited);
            for (uint32_t left = lanes; left; left &= left - 1) {
                const uint32_t lane = (uint32_t)__builtin_ctz(left), slot = walk->tree.slots[leaf * PT_LEAF + lane];
                hoods[lane].trust = pt_trust_of_level(walk->out->shapes[slot] >> PT_SHAPE_TRUST_SHIFT & 15u);
                forget_point(walk, c, slot);
                write_point(walk, c, slot, &hoods[lane]);
            }
            pt_store_look(walk->store);
        }
        if (touched || walk->trust.hidden_first[c] != walk->trust.hidden_first[c + 1])
            pt_trust_finish_chunk(&walk->trust, &walk->out->chunks[c], walk->out->surfels, walk->out->shapes);
        const uint32_t done = atomic_fetch_add_explicit(&walk->done, 1, memory_order_relaxed) + 1;
        pt_progress_raise(walk->progress, 0.75 + 0.1 * done / walk->cloud->chunk_count);
    }
}

// Judges all points; those whose neighborhoods held untrusted ones are described again without these.
static int judge(struct walk *walk, struct pt_pool *pool)
{
    if (walk->k < PT_TRUST_NEIGHBOURS)
        pt_trust_measure(&walk->trust, pool);
    pt_trust_judge(&walk->trust, pool);
    if (pt_progress_cancelled(walk->progress))
        return PATINA_ERROR_CANCELLED;
    const int error = pt_trust_hide(&walk->trust);
    if (!error && walk->trust.hidden_count && walk->trust.hidden_count < walk->cloud->info.drawn) {
        atomic_store(&walk->done, 0);
        pt_parallel(pool, walk->cloud->chunk_count, 1, walk_touched, walk);
    }
    pt_trust_show(&walk->trust);
    return error ? error : pt_progress_cancelled(walk->progress) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}

// ---- the cloud -------------------------------------------------------------------------------------------------------------

// Classes span 15 octaves and three quarters: two below the finest chunk, unless the coarsest needs them above.
static double base_of(const patina_cloud *cloud)
{
    double least = INFINITY, most = 0.0, box = 0.0;
    if (cloud->shapes) // a second time: the same words
        return cloud->spacing_base;
    for (uint32_t c = 0; c < cloud->chunk_count; c++) {
        const double spacing = (double)cloud->chunks[c].spacing;
        least = spacing > 0.0 ? fmin(least, spacing) : least;
        most = fmax(most, spacing);
    }
    for (int k = 0; k < 3 && cloud->chunk_count; k++)
        box = fmax(box, cloud->info.box_max[k] - cloud->info.box_min[k]);
    return most > 0.0 ? fmax(least / 4.0, most / 4096.0) : box / 32768.0;
}

// Makes strides explicit.
static int check_arrays(patina_analysis_desc *desc)
{
    const uint32_t lines = 1u << PATINA_UINT16 | 1u << PATINA_UINT32 | 1u << PATINA_INT32;
    int error = pt_check_array(&desc->station, "station", 1u << PATINA_UINT8 | 1u << PATINA_UINT16, 1, 1);
    error = error ? error : pt_check_array(&desc->row, "row", lines, 1, 1);
    error = error ? error : pt_check_array(&desc->scan, "scan", 1u << PATINA_UINT8 | 1u << PATINA_UINT16, 1, 1);
    return error ? error : pt_check_array(&desc->column, "column", lines, 1, 1);
}

int pt_analysis_check(const patina_cloud *cloud, const patina_analysis_desc *desc)
{
    if (!cloud)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_analyse: cloud is NULL");
    if (desc->neighbours > PT_NEIGHBOURS_MOST || (desc->neighbours && desc->neighbours < 3))
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_analyse: neighbours: 3 to %d, not %u", PT_NEIGHBOURS_MOST,
                       desc->neighbours);
    if (desc->station_count && !desc->stations)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_analyse: no places of %u stations", desc->station_count);
    for (uint32_t i = 0; i < 3 * desc->station_count; i++)
        if (!isfinite(desc->stations[i]))
            return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_analyse: station %u is nowhere", i / 3);
    if (desc->direction_count && !desc->directions)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_analyse: no directions of %u scans", desc->direction_count);
    for (uint32_t i = 0; i < 3 * desc->direction_count; i++)
        if (!isfinite(desc->directions[i]))
            return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_analyse: the direction of scan %u is not finite", i / 3);
    if (desc->grid && !(desc->row.data && desc->column.data))
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_analyse: grid needs row and column of each point");
    if (desc->grid && !desc->station_count && !desc->direction_count)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_analyse: grid needs stations, or directions of scans");
    patina_analysis_desc checked = *desc;
    const int error = check_arrays(&checked);
    return error ? error : pt_free_space_check(desc);
}

static void gather_shapes(struct pt_chunk *chunk, const uint32_t *shapes)
{
    memset(chunk->shapes, 0, sizeof chunk->shapes);
    for (uint32_t i = 0; i < chunk->count; i++) {
        const uint32_t sight = shapes[i] >> PT_SHAPE_SIGHT_SHIFT & 255u;
        chunk->shapes[sight / 32] |= 1u << sight % 32;
    }
}

static int mark_free_space(struct walk *walk, struct pt_pool *pool)
{
    struct pt_free_space job = {.cloud = walk->cloud,
                                .desc = walk->desc,
                                .beams = &walk->beams,
                                .spacing_base = walk->out->spacing_base,
                                .progress = walk->progress,
                                .begin = 0.8,
                                .end = 1.0,
                                .store = walk->store,
                                .shapes = walk->out->shapes,
                                .sights = &walk->out->sights};
    const int error = pt_free_space_mark(&job, pool);
    walk->out->seen_through = job.marked;
    return error;
}

// Sides that neither the caller nor a station told.
static int vote_sides(struct walk *walk, struct pt_pool *pool)
{
    const patina_cloud *cloud = walk->cloud;
    uint64_t unoriented = 0;
    for (uint32_t c = 0; c < cloud->chunk_count; c++)
        unoriented += walk->tallies[c].unoriented;
    walk->out->oriented = 1;
    if (!unoriented)
        return PATINA_OK;
    const size_t size = (cloud->slots / 32 + 1) * sizeof(uint32_t);
    uint32_t *told = walk->given ? pt_store_alloc(walk->store, size) : NULL;
    if (walk->given && !told)
        return PATINA_ERROR_MEMORY;
    for (uint32_t slot = 0; told && slot < cloud->slots; slot++) {
        told[slot / 32] |= (uint32_t)((cloud->surfels[slot] & PT_NORMAL_BITS) != PT_NORMAL_NONE) << slot % 32;
        if (slot % PT_CHUNK_POINTS == 0)
            pt_store_look(walk->store);
    }
    walk->out->oriented = PATINA_SIDES_VOTED;
    const int error = pt_orient(&walk->tree, walk->out->chunks, told, walk->out->surfels, walk->out->shapes, pool,
                                walk->progress, 0.85, 1.0);
    pt_store_free(walk->store, told, size);
    return error;
}

static int lend_colors(struct walk *walk, struct pt_pool *pool)
{
    struct pt_uncolored job = {.cloud = walk->cloud,
                               .tree = &walk->tree,
                               .shapes = walk->out->shapes,
                               .least_level = pt_default_level(walk->out->trusts),
                               .keep = walk->desc->keep_colors != 0,
                               .store = walk->store,
                               .progress = walk->progress};
    const int error = pt_uncolored_find(&job, pool);
    walk->out->colors = job.colors;
    walk->out->uncolored = job.count;
    return error;
}

static int compute(struct walk *walk, struct pt_pool *pool)
{
    const patina_cloud *cloud = walk->cloud;
    struct pt_analysis *out = walk->out;
    walk->tallies = calloc(cloud->chunk_count + 1, sizeof *walk->tallies);
    out->chunks = malloc((cloud->chunk_count + 1) * sizeof *out->chunks);
    out->surfels = pt_store_alloc(walk->store, out->slots * 4);
    out->shapes = pt_store_alloc(walk->store, out->slots * 4);
    if (!walk->tallies || !out->chunks || !out->surfels || !out->shapes)
        return PATINA_ERROR_MEMORY;
    if (cloud->chunk_count)
        memcpy(out->chunks, cloud->chunks, cloud->chunk_count * sizeof *out->chunks);
    out->spacing_base = base_of(cloud);
    int error = pt_beams_create(cloud, walk->desc, pool, &walk->beams);
    if (!error)
        error = pt_grids_create(cloud, walk->desc, walk->store, pool, walk->progress, &walk->grids);
    if (!error)
        error = pt_neighbours_create(&walk->tree, cloud, PT_STRATA, walk->store, pool, walk->progress, 0.0, 0.04);
    if (!error)
        error = pt_neighbours_create(&walk->coarse, cloud, FAR_STRATA, walk->store, pool, walk->progress, 0.04, 0.05);
    if (!error) {
        walk->trust = (struct pt_trust){.cloud = cloud,
                                        .tree = &walk->tree,
                                        .coarse = &walk->coarse,
                                        .desc = walk->desc,
                                        .beams = &walk->beams,
                                        .chunks = out->chunks,
                                        .surfels = out->surfels,
                                        .shapes = (_Atomic uint32_t *)out->shapes,
                                        .base = out->spacing_base,
                                        .progress = walk->progress};
        error = pt_trust_create(&walk->trust);
    }
    if (error) {
        pt_trust_destroy(&walk->trust);
        pt_neighbours_destroy(&walk->coarse);
        pt_neighbours_destroy(&walk->tree);
        return error;
    }
    walk->tree.any_twins = walk->coarse.any_twins = 1;     // a million points at one place take no longer than others
    walk->rows = !walk->beams.count && lies_in_rows(walk); // a station's cells tell better
    pt_parallel(pool, cloud->chunk_count, 1, walk_chunks, walk);
    error = pt_progress_cancelled(walk->progress) ? PATINA_ERROR_CANCELLED : judge(walk, pool);
    memcpy(out->trusts, walk->trust.counts, sizeof out->trusts);
    pt_trust_destroy(&walk->trust);
    pt_neighbours_destroy(&walk->coarse);
    error = error ? error : vote_sides(walk, pool);
    error = error ? error : lend_colors(walk, pool);
    pt_neighbours_destroy(&walk->tree);
    if (error)
        return error;
    if (walk->desc->free_space && (error = mark_free_space(walk, pool)))
        return error;
    for (uint32_t c = 0; c < cloud->chunk_count; c++) {
        for (int kind = 0; kind < 6; kind++)
            out->kinds[kind] += walk->tallies[c].kinds[kind];
        out->estimated += walk->tallies[c].estimated;
    }
    for (uint32_t c = 0; c < cloud->chunk_count; c++) {
        pt_store_look(walk->store);
        gather_shapes(&out->chunks[c], out->shapes + out->chunks[c].first);
        out->chunks[c].cone_cosine = -2.0f;
        if (out->oriented)
            pt_chunk_cone(&out->chunks[c], out->surfels + out->chunks[c].first);
    }
    pt_progress_set(walk->progress, 1.0);
    return PATINA_OK;
}

static int tell(const struct patina_cloud *cloud, const struct pt_store *store, int error)
{
    char text[128];
    if (error == PATINA_ERROR_CANCELLED)
        return pt_fail(NULL, error, "analysing the cloud was cancelled");
    if (store && store->error)
        return pt_fail(NULL, PATINA_ERROR_FILE, "%s: analysing %llu points beside it: %s", store->beside,
                       (unsigned long long)cloud->info.drawn, pt_error_text(store->error, text, sizeof text));
    return pt_fail(NULL, error, "analysing %llu points: out of memory", (unsigned long long)cloud->info.drawn);
}

// Words, trees of all points and of an eighth, votes twice, and who was told.
uint64_t pt_analysis_memory(const patina_cloud *cloud) { return cloud->slots * 36; }

int pt_analysis_compute(const patina_cloud *cloud, const patina_analysis_desc *desc, struct pt_store *store,
                        patina_progress *progress, struct pt_analysis *out)
{
    *out = (struct pt_analysis){0};
    int refused = pt_paged_refuse(cloud, "patina_cloud_analyse");
    if (refused || (refused = pt_parts_refuse(cloud, "patina_cloud_analyse")))
        return refused;
    patina_analysis_desc checked = *desc;
    check_arrays(&checked); // checked already
    struct walk walk = {.cloud = cloud,
                        .desc = &checked,
                        .out = out,
                        .store = store,
                        .progress = progress,
                        .k = desc->neighbours ? desc->neighbours : NEIGHBOURS,
                        .given = cloud->info.has_normals && cloud->info.normals_oriented != PATINA_SIDES_VOTED};
    *out = (struct pt_analysis){
        .store = store, .slots = cloud->slots, .color_bytes = pt_color_bytes(cloud), .keeps_colors = desc->keep_colors != 0};
    struct pt_pool *pool = pt_pool_create(pt_pool_threads_for(desc->threads, cloud->info.count), 0);
    if (pool && store)
        pt_pool_watch(pool, pt_store_look, store);
    int error = pool ? compute(&walk, pool) : PATINA_ERROR_MEMORY;
    pt_pool_destroy(pool);
    pt_beams_destroy(&walk.beams);
    pt_grids_destroy(&walk.grids);
    free(walk.tallies);
    const int lost = error ? PATINA_OK : pt_pages_fail_lost(cloud);
    if (error || lost)
        pt_analysis_free(out);
    return error ? tell(cloud, store, error) : lost;
}

void pt_analysis_free(struct pt_analysis *analysis)
{
    pt_store_free(analysis->store, analysis->surfels, analysis->slots * 4);
    pt_store_free(analysis->store, analysis->shapes, analysis->slots * 4);
    free(analysis->chunks);
    pt_store_free(analysis->store, analysis->colors, analysis->color_bytes);
    pt_sights_free(&analysis->sights);
    *analysis = (struct pt_analysis){0};
}

// What cannot fail comes last: a cloud is analysed or as it was.
int pt_analysis_apply(patina_cloud *cloud, struct pt_analysis *analysis)
{
    const uint64_t words = cloud->slots * 4;
    struct patina_cloud next = *cloud;
    next.chunks = analysis->chunks;
    next.spacing_base = analysis->spacing_base;
    if (pt_cloud_settle_spacing(&next))
        return pt_fail(&cloud->handle, PATINA_ERROR_MEMORY, "taking an analysis: out of memory");
    cloud->info.bytes += 2 * words + (analysis->colors ? analysis->color_bytes : 0);
    cloud->info.bytes -= pt_cloud_own_bytes(cloud, PT_ARRAY_SURFELS, words);
    cloud->info.bytes -= cloud->shapes ? pt_cloud_own_bytes(cloud, PT_ARRAY_SHAPES, words) : 0;
    cloud->info.bytes -= analysis->colors ? pt_cloud_own_bytes(cloud, PT_ARRAY_COLORS, analysis->color_bytes) : 0;
    cloud->info.bytes += cloud->sights.bytes ? 0 : analysis->sights.bytes;
    cloud->info.spacing = next.info.spacing;
    cloud->info.spacing_min = next.info.spacing_min;
    cloud->info.spacing_max = next.info.spacing_max;
    cloud->info.layer_distance = next.info.layer_distance;
    cloud->info.has_shapes = 1;
    cloud->info.has_normals |= analysis->estimated > 0;
    cloud->info.normals_oriented = cloud->info.has_normals ? (uint32_t)analysis->oriented : 0;
    cloud->info.estimated_normals = analysis->estimated;
    for (int kind = 0; kind < 6; kind++)
        cloud->info.kinds[kind] = analysis->kinds[kind];
    memcpy(cloud->info.trusts, analysis->trusts, sizeof cloud->info.trusts);
    cloud->info.seen_through = analysis->seen_through;
    pt_pages_free(cloud->surfels, cloud->slots * 4);
    pt_pages_free(cloud->shapes, cloud->slots * 4);
    pt_sights_free(&cloud->sights);
    pt_chunks_free(cloud);
    cloud->sights = analysis->sights;
    cloud->surfels = analysis->surfels;
    cloud->shapes = analysis->shapes;
    cloud->mapped &= ~(1u << PT_ARRAY_SURFELS | 1u << PT_ARRAY_SHAPES);
    cloud->chunks = analysis->chunks;
    if (cloud->clusters)
        pt_clusters_make(cloud);
    cloud->beside = pt_shapes_beside(cloud);
    if (analysis->colors) {
        pt_pages_free(cloud->colors, pt_color_bytes(cloud));
        cloud->colors = analysis->colors;
        cloud->mapped &= ~(1u << PT_ARRAY_COLORS);
        atomic_fetch_add(&cloud->alive->colors, 1);
    }
    cloud->info.uncolored = analysis->uncolored;
    cloud->keeps_colors = analysis->keeps_colors;
    cloud->spacing_base = analysis->spacing_base;
    *analysis = (struct pt_analysis){0};
    atomic_store(&cloud->alive->fingerprint, 0);
    atomic_fetch_add(&cloud->alive->shapes, 1);
    return PATINA_OK;
}

int patina_cloud_analyse(patina_cloud *cloud, const patina_analysis_desc *desc, patina_progress *progress)
{
    patina_analysis_desc checked;
    struct pt_analysis analysis;
    int error = pt_take(NULL, "patina_cloud_analyse", desc, &checked, sizeof checked);
    error = error ? error : pt_analysis_check(cloud, &checked);
    if (!error)
        error = pt_analysis_compute(cloud, &checked, NULL, progress, &analysis);
    if (!error) {
        error = pt_analysis_apply(cloud, &analysis);
        pt_analysis_free(&analysis);
        return error;
    }
    return cloud ? pt_fail_again(&cloud->handle, error) : error;
}
