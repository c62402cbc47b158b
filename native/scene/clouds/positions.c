// SPDX-License-Identifier: GPL-3.0-or-later
// Where a cloud's points are, packed or not, and their numbers where no order is kept (SPEC 13).
#include "cloud.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LEAST_STEP = -126 }; // 2^-126: no product with a whole number is a subnormal one, which GPUs may take for zero

float pt_chunk_step(const struct pt_chunk *chunk)
{
    float most = 0.0f;
    int power;
    for (int k = 0; k < 3; k++)
        most = fmaxf(most, fmaxf(fabsf(chunk->box_min[k]), fabsf(chunk->box_max[k])));
    const float part = frexpf(most, &power); // 2^20 - 1 steps reach over 1 - 2^-20 of 2^power, and these are floats
    power -= part <= 1.0f - 0x1p-20f ? 20 : 19;
    return ldexpf(1.0f, most > 0.0f && power > LEAST_STEP ? power : LEAST_STEP);
}

uint64_t pt_chunk_slot(const struct patina_cloud *cloud, const struct pt_chunk *chunk)
{
    uint32_t i = cloud->part_count;
    while (i > 1 && chunk < cloud->parts[i - 1].chunks)
        i--;
    return (i ? cloud->parts[i - 1].first_slot : 0) + chunk->first;
}

static const uint32_t *words_of(const struct patina_cloud *cloud, const struct pt_chunk *chunk)
{
    return (const uint32_t *)cloud->positions + pt_position_words(cloud) * pt_chunk_slot(cloud, chunk);
}

const float *pt_chunk_positions(const struct patina_cloud *cloud, const struct pt_chunk *chunk, float *scratch)
{
    const uint32_t *words = words_of(cloud, chunk);
    if (!cloud->packed)
        return (const float *)(const void *)words;
    const float step = pt_chunk_step(chunk);
    const size_t padded = chunk->padded;
    for (size_t i = 0; i < padded; i++) {
        float p[3];
        pt_packed_point(words[i], words[padded + i], step, p);
        for (size_t k = 0; k < 3; k++)
            scratch[k * padded + i] = p[k];
    }
    return scratch;
}

void pt_point_offset(const struct patina_cloud *cloud, const struct pt_chunk *chunk, uint32_t i, float p[3])
{
    const uint32_t *words = words_of(cloud, chunk) + i;
    if (cloud->packed)
        pt_packed_point(words[0], words[chunk->padded], pt_chunk_step(chunk), p);
    else
        for (size_t k = 0; k < 3; k++)
            memcpy(&p[k], words + k * chunk->padded, sizeof p[k]);
}

void pt_point_place(const struct patina_cloud *cloud, const struct pt_chunk *chunk, uint32_t i, double p[3])
{
    float offset[3];
    pt_point_offset(cloud, chunk, i, offset);
    for (int k = 0; k < 3; k++)
        p[k] = chunk->origin[k] + (double)offset[k];
}

double pt_chunk_pack(struct pt_chunk *chunk, const float *positions, uint32_t *words)
{
    const float step = pt_chunk_step(chunk);
    const size_t padded = chunk->padded;
    double most = 0.0;
    for (size_t i = 0; i < padded; i++) {
        const float p[3] = {positions[i], positions[padded + i], positions[2 * padded + i]};
        uint32_t pair[2];
        float now[3];
        pt_packed_words(p, step, pair);
        pt_packed_point(pair[0], pair[1], step, now);
        double square = 0.0;
        for (int k = 0; k < 3; k++)
            square += ((double)now[k] - (double)p[k]) * ((double)now[k] - (double)p[k]);
        words[i] = pair[0];
        words[padded + i] = pair[1];
        most = square > most ? square : most;
    }
    for (int k = 0; k < 3; k++) {
        chunk->box_min[k] = ((float)pt_packed_part(chunk->box_min[k], step) - (float)PT_PACKED_MIDDLE) * step;
        chunk->box_max[k] = ((float)pt_packed_part(chunk->box_max[k], step) - (float)PT_PACKED_MIDDLE) * step;
    }
    return sqrt(most);
}

// ---- numbers ---------------------------------------------------------------------------------------------------------------

int pt_cloud_count_places(struct patina_cloud *cloud)
{
    uint32_t before = 0;
    cloud->begins = malloc(((size_t)cloud->chunk_count + 1) * sizeof *cloud->begins);
    if (!cloud->begins)
        return PATINA_ERROR_MEMORY;
    for (uint32_t c = 0; c < cloud->chunk_count; c++) {
        cloud->begins[c] = before;
        before += cloud->chunks[c].count;
    }
    cloud->begins[cloud->chunk_count] = before;
    return PATINA_OK;
}

uint64_t pt_place_of(const struct patina_cloud *cloud, uint64_t slot)
{
    if (cloud->part_count) {
        uint32_t k = cloud->part_count - 1;
        while (k && slot < cloud->parts[k].first_slot)
            k--;
        return pt_place_of(&cloud->parts[k], slot - cloud->parts[k].first_slot);
    }
    uint32_t low = 0, high = cloud->chunk_count;
    while (high - low > 1) {
        const uint32_t middle = low + (high - low) / 2;
        if (cloud->chunks[middle].first <= slot)
            low = middle;
        else
            high = middle;
    }
    const struct pt_chunk *chunk = &cloud->chunks[low];
    const uint32_t i = (uint32_t)slot - chunk->first;
    return cloud->first_number + cloud->begins[low] + (i < chunk->count ? i : chunk->count - 1);
}

int pt_is_as_it_lies(const struct patina_cloud *cloud)
{
    uint64_t next = 0, slot = 0;
    for (uint32_t c = 0; c < cloud->chunk_count && cloud->order; slot += cloud->chunks[c++].padded)
        for (uint32_t i = 0; i < cloud->chunks[c].count; i++)
            if (cloud->order[slot + i] != next++)
                return 0;
    return 1;
}
