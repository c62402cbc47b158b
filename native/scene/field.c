// SPDX-License-Identifier: GPL-3.0-or-later
// Fields: a number of each point becomes a step of it in chunk order, once; a picture compares them with its threshold.
#include "mask.h"

#include "base/platform.h"
#include "base/pool.h"
#include "fingerprint.h"

#include <stdlib.h>

struct fill {
    const struct patina_cloud *cloud;
    const float *values;
    struct patina_field *field;
};

static uint16_t step_of(float value)
{
    return (uint16_t)(value >= 1.0f ? 65535u : value > 0.0f ? pt_field_steps(value) : 0u);
}

static void fill_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct fill *fill = context;
    (void)thread;
    for (uint32_t c = begin; c < end; c++) {
        const struct pt_chunk *chunk = &fill->cloud->chunks[c];
        uint16_t least = UINT16_MAX, most = 0;
        for (size_t slot = chunk->first; slot < (size_t)chunk->first + chunk->padded; slot++) {
            const uint16_t step = step_of(fill->values[fill->cloud->order[slot]]);
            fill->field->steps[slot] = step;
            least = step < least ? step : least;
            most = step > most ? step : most;
        }
        fill->field->chunks[c][0] = least;
        fill->field->chunks[c][1] = most;
    }
}

int patina_field_create(const patina_cloud *cloud, const float *values, uint64_t count, patina_field **out)
{
    if (!cloud || !out || cloud->handle.magic != PT_MAGIC)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_field_create: cloud or out is NULL, or the cloud destroyed");
    *out = NULL;
    if (count != cloud->info.count || (count && !values))
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_field_create: %llu values for %llu points", values ? (unsigned long long)count : 0,
                       (unsigned long long)cloud->info.count);
    struct patina_field *field = calloc(1, sizeof *field);
    struct pt_pool *pool = pt_pool_create(pt_pool_threads_for(0, cloud->slots), 0);
    if (field) {
        pt_handle_init(&field->handle);
        field->of = pt_alive_share(cloud);
        field->alive = pt_alive_create();
        field->slots = cloud->slots;
        field->steps = pt_pages_alloc((field->slots + 1) * sizeof *field->steps);
        field->chunks = calloc(cloud->chunk_count + 1, sizeof *field->chunks);
    }
    const int good = field && pool && field->alive && field->steps && field->chunks;
    if (good) {
        struct fill fill = { cloud, values, field };
        pt_parallel(pool, cloud->chunk_count, 4, fill_chunks, &fill);
        field->hash = pt_fingerprint(1, field->steps, field->slots * sizeof *field->steps);
        *out = field;
    } else {
        patina_field_destroy(field);
    }
    pt_pool_destroy(pool);
    return good ? PATINA_OK
                : pt_fail(NULL, PATINA_ERROR_MEMORY, "a field of %llu points: out of memory", (unsigned long long)cloud->info.count);
}

void patina_field_destroy(patina_field *field)
{
    if (!field)
        return;
    pt_pages_free(field->steps, (field->slots + 1) * sizeof *field->steps);
    free(field->chunks);
    if (field->alive) {
        atomic_store(&field->alive->alive, 0);
        pt_alive_release(field->alive);
    }
    pt_alive_release(field->of);
    pt_handle_destroy(&field->handle);
    free(field);
}
