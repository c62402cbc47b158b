// SPDX-License-Identifier: GPL-3.0-or-later
#include "town.h"

#include "clouds.h"
#include "levels.h"
#include "base/platform.h"
#include "scene/clouds/cloud.h"
#include "support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { HOUSES = 6, TREES = 9 };
#define STOREY 3.0  // metres: a terrace above the one before it
#define NOISE 0.004 // of a scanner
#define TAU 6.283185307179586

struct sampler {
    struct pcg random;
    struct points points;
    uint64_t next;
};

static void put(struct sampler *sampler, const double p[3], const double color[3])
{
    const uint64_t i = sampler->next++;
    for (int k = 0; k < 3; k++) {
        const double tone = color[k] * pcg_between(&sampler->random, 0.85, 1.1);
        sampler->points.position[3 * i + (uint64_t)k] = (float)(p[k] + NOISE * pcg_between(&sampler->random, -1, 1));
        sampler->points.color[3 * i + (uint64_t)k] = (uint8_t)(tone < 255 ? tone : 255);
    }
}

// A parallelogram: corner, two sides. Points by area, `density` a square metre.
static void put_face(struct sampler *sampler, const double face[3][3], double density, const double color[3])
{
    double normal[3], p[3];
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        normal[k] = face[1][i] * face[2][j] - face[1][j] * face[2][i];
    }
    const double area = sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    for (uint64_t left = (uint64_t)(area * density); left && sampler->next < sampler->points.count; left--) {
        const double u = pcg_unit(&sampler->random), v = pcg_unit(&sampler->random);
        for (int k = 0; k < 3; k++)
            p[k] = face[0][k] + u * face[1][k] + v * face[2][k];
        put(sampler, p, color);
    }
}

// Four walls and a roof whose ridge runs along y.
static void put_house(struct sampler *sampler, double x, double y, double wide, double deep, double high, double density)
{
    static const double plaster[3] = {215, 200, 170}, tiles[3] = {165, 80, 55};
    const double rise = 0.35 * wide;
    const double faces[6][3][3] = {
        {{x, y, 0}, {wide, 0, 0}, {0, 0, high}},
        {{x, y + deep, 0}, {wide, 0, 0}, {0, 0, high}},
        {{x, y, 0}, {0, deep, 0}, {0, 0, high}},
        {{x + wide, y, 0}, {0, deep, 0}, {0, 0, high}},
        {{x - 0.3, y - 0.3, high - 0.2}, {wide / 2 + 0.3, 0, rise}, {0, deep + 0.6, 0}},
        {{x + wide + 0.3, y - 0.3, high - 0.2}, {-wide / 2 - 0.3, 0, rise}, {0, deep + 0.6, 0}},
    };
    for (int i = 0; i < 6; i++)
        put_face(sampler, faces[i], density, i < 4 ? plaster : tiles);
}

static void put_tree(struct sampler *sampler, double x, double y, double high, double density)
{
    static const double bark[3] = {95, 75, 55}, leaves[3] = {80, 125, 50};
    const double crown = 0.35 * high;
    for (uint64_t left = (uint64_t)(density * high); left && sampler->next < sampler->points.count; left--) {
        const double turn = pcg_between(&sampler->random, 0, TAU), up = pcg_unit(&sampler->random) * 0.5 * high;
        put(sampler, (double[]){x + 0.2 * cos(turn), y + 0.2 * sin(turn), up}, bark);
    }
    for (uint64_t left = (uint64_t)(3 * density * crown * crown); left && sampler->next < sampler->points.count; left--) {
        const double turn = pcg_between(&sampler->random, 0, TAU), height = pcg_between(&sampler->random, -1, 1);
        const double reach = crown * cbrt(pcg_between(&sampler->random, 0.3, 1)), around = reach * sqrt(1 - height * height);
        put(sampler, (double[]){x + around * cos(turn), y + around * sin(turn), 0.65 * high + reach * height}, leaves);
    }
}

// Ground for what the rest leaves over; the wall to the terrace below stands on the south side.
static patina_cloud *make_quarter(uint32_t points)
{
    static const double stone[3] = {150, 145, 135}, earth[3] = {125, 130, 90};
    struct sampler sampler = {.random = pcg_seed(26), .points = points_create(points, POINTS_COLORS)};
    const double side = TOWN_QUARTER, density = points / 5200.0; // square metres, about
    const double wall[3][3] = {{0, 0, -STOREY}, {side, 0, 0}, {0, 0, STOREY}};
    put_face(&sampler, wall, density, stone);
    for (int i = 0; i < HOUSES; i++)
        put_house(&sampler, 3 + 12.5 * (i % 3), 4 + 19 * (i / 3), 7 + i % 2, 10, 5 + 3 * (i % 3), density);
    for (int i = 0; i < TREES; i++)
        put_tree(&sampler, 4 + 4.2 * i, 17 + 18 * (i % 2), 5 + i % 4, density);
    while (sampler.next < points)
        put(&sampler, (double[]){pcg_unit(&sampler.random) * side, pcg_unit(&sampler.random) * side, 0}, earth);
    patina_cloud *cloud = points_upload(&sampler.points);
    const patina_analysis_desc analysis = {.struct_size = sizeof analysis};
    CHECK(patina_cloud_analyse(cloud, &analysis, NULL), cloud);
    points_free(&sampler.points);
    return cloud;
}

// Quarters near each other lie near each other in the file.
static void place_of(uint32_t number, uint32_t place[2])
{
    place[0] = place[1] = 0;
    for (int bit = 0; bit < 16; bit++)
        for (int k = 0; k < 2; k++)
            place[k] |= (number >> (2 * bit + k) & 1u) << bit;
}

static void offset_of(const uint32_t place[2], double offset[3])
{
    offset[0] = place[0] * (double)TOWN_QUARTER;
    offset[1] = place[1] * (double)TOWN_QUARTER;
    offset[2] = STOREY * place[1];
}

struct town {
    const patina_cloud *quarter;
    struct patina_cloud whole; // its numbers, and chunks
    struct pt_cloud_writer *writer;
    uint8_t *colors; // NULL: none, nor footprints
    uint32_t chunks; // so many are done, and slots
    uint64_t slots;
};

// Chunks of a level, in every quarter; what of them is in the file follows in add_points.
static void add_chunks(struct town *town, const struct level *level, const uint32_t place[2])
{
    const struct patina_cloud *from = town->quarter;
    struct patina_cloud *whole = &town->whole;
    double offset[3];
    offset_of(place, offset);
    for (uint32_t c = level->chunk; c < level->chunk_end; c++) {
        struct pt_chunk *chunk = &whole->chunks[town->chunks++];
        *chunk = from->chunks[c];
        chunk->first += (uint32_t)(town->slots - level->slot);
        for (int k = 0; k < 3; k++)
            chunk->origin[k] += offset[k];
    }
    town->slots += level->slot_end - level->slot;
    for (int k = 0; k < 3; k++) {
        whole->info.box_min[k] = fmin(whole->info.box_min[k], from->info.box_min[k] + offset[k]);
        whole->info.box_max[k] = fmax(whole->info.box_max[k], from->info.box_max[k] + offset[k]);
    }
}

static void add_points(struct town *town, const struct level *level, const uint32_t place[2])
{
    const struct patina_cloud *from = town->quarter;
    const uint64_t first = level->slot, slots = level->slot_end - first;
    for (uint64_t i = 3 * first; i < 3 * level->slot_end && town->colors; i++) // of 256ths, another tone a quarter
        town->colors[i - 3 * first] =
            (uint8_t)(((const uint8_t *)from->colors)[i] * (200 + (place[0] * 7 + place[1] * (5 + i % 3)) % 56) >> 8);
    pt_cloud_writer_add(town->writer, PT_ARRAY_POSITIONS, (const uint32_t *)from->positions + 2 * first, slots * 8);
    pt_cloud_writer_add(town->writer, PT_ARRAY_SURFELS, from->surfels + first, slots * 4);
    if (!town->colors)
        return;
    pt_cloud_writer_add(town->writer, PT_ARRAY_COLORS, town->colors, slots * 3);
    pt_cloud_writer_add(town->writer, PT_ARRAY_SHAPES, from->shapes + first, slots * 4);
}

// Of every quarter, in the order of the file.
static void add_level(struct town *town, const struct level *level, uint32_t across)
{
    uint32_t place[2];
    for (uint32_t i = 0, done = 0; done < across * across; i++) {
        place_of(i, place);
        if (place[0] >= across || place[1] >= across)
            continue;
        add_chunks(town, level, place);
        add_points(town, level, place);
        done++;
    }
}

// Its positions, as its file has them.
static void pack(struct patina_cloud *quarter)
{
    uint32_t *words = pt_pages_alloc(quarter->slots * 8);
    if (!words)
        support_die("a town: out of memory");
    for (int k = 0; k < 3; k++) {
        quarter->info.box_min[k] = INFINITY;
        quarter->info.box_max[k] = -INFINITY;
    }
    for (uint32_t c = 0; c < quarter->chunk_count; c++) {
        struct pt_chunk *chunk = &quarter->chunks[c];
        const float *positions = (const float *)quarter->positions + 3 * (uint64_t)chunk->first;
        const double moved = pt_chunk_pack(chunk, positions, words + 2 * (uint64_t)chunk->first);
        quarter->info.packed_error = fmax(quarter->info.packed_error, moved);
        for (int k = 0; k < 3; k++) {
            quarter->info.box_min[k] = fmin(quarter->info.box_min[k], chunk->origin[k] + (double)chunk->box_min[k]);
            quarter->info.box_max[k] = fmax(quarter->info.box_max[k], chunk->origin[k] + (double)chunk->box_max[k]);
        }
    }
    pt_pages_free(quarter->positions, quarter->slots * 12);
    quarter->positions = words;
    quarter->packed = 1;
}

static void set_numbers(struct patina_cloud *whole, const patina_cloud *quarter, uint32_t quarters, int plain)
{
    *whole = *quarter;
    whole->unordered = 1;
    whole->slots *= quarters;
    whole->chunk_count *= quarters;
    whole->info.count *= quarters;
    whole->info.drawn *= quarters;
    whole->info.chunks *= quarters;
    whole->info.estimated_normals *= quarters;
    for (int kind = 0; kind < 6; kind++)
        whole->info.kinds[kind] *= quarters;
    whole->chunks = calloc(whole->chunk_count, sizeof *whole->chunks);
    if (plain) {
        whole->color_format = PT_COLOR_NONE;
        whole->info.has_colors = whole->info.has_shapes = 0;
    }
}

uint64_t town_write(const char *path, uint32_t across, uint32_t points, uint32_t levels, int plain)
{
    patina_cloud *quarter = make_quarter(points);
    struct level level[LEVELS_MOST] = {{0, quarter->chunk_count, 0, quarter->slots}};
    if (levels > 1)
        levels_make(quarter, levels, level);
    pack(quarter);
    struct town town = {.quarter = quarter, .colors = plain ? NULL : malloc(quarter->slots * 3)};
    set_numbers(&town.whole, quarter, across * across, plain);
    if ((!plain && !town.colors) || !town.whole.chunks)
        support_die("a town: out of memory");
    CHECK(pt_cloud_writer_begin(path, &town.whole, &town.writer), NULL);
    for (uint32_t k = 0; k < (levels > 1 ? levels : 1); k++)
        add_level(&town, &level[k], across);
    const char end[4] = {0};
    if (!plain)
        pt_cloud_writer_add(town.writer, PT_ARRAY_COLORS, end, sizeof end);
    pt_cloud_writer_add(town.writer, PT_ARRAY_CHUNKS, town.whole.chunks, town.whole.chunk_count * sizeof *town.whole.chunks);
    CHECK(pt_cloud_writer_end(town.writer, &town.whole), NULL);
    const uint64_t slots = town.whole.slots;
    free(town.whole.chunks);
    free(town.colors);
    patina_cloud_destroy(quarter);
    return slots * (plain ? 12 : 19);
}
