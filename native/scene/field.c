// SPDX-License-Identifier: GPL-3.0-or-later
// Fields: numbers that points have, or that are found of them, become steps in chunk order, once; a picture compares these with its
// threshold.
#include "mask.h"

#include "base/compare.h"
#include "base/descriptor.h"
#include "base/error.h"
#include "base/platform.h"
#include "base/pool.h"
#include "scene/clouds/fingerprint.h"
#include "scene/clouds/paged.h"
#include "base/elementary.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLE = 1 << 16, NEIGHBOURS = 16 };

struct fill {
    const struct patina_cloud *cloud;
    const patina_field_desc *desc;
    const float *values;              // in the given order, or NULL
    double linear[9], translation[3]; // the shape's coordinates from the cloud's: rows of unit length
    struct patina_field *field;
    float *numbers;         // in chunk order
    double from, by, start; // F = start + (number - from) by
};

// ---- numbers -------------------------------------------------------------------------------------------------------------

static double luminance(const struct patina_cloud *cloud, size_t slot)
{
    static const double luma[3] = {0.2126, 0.7152, 0.0722};
    double sum = 0.0;
    for (int k = 0; k < 3; k++)
        sum += luma[k] * (cloud->color_format == PT_COLOR_SRGB8 ? ((const uint8_t *)cloud->colors)[3 * slot + (size_t)k] / 255.0
                                                                : (double)((const float *)cloud->colors)[3 * slot + (size_t)k]);
    return cloud->color_format == PT_COLOR_SRGB8 ? sum : pt_pow(fmax(sum, 0.0), 1.0 / 2.2);
}

static double distance(const struct fill *fill, const struct pt_chunk *chunk, size_t slot)
{
    double p[3], q[3];
    pt_point_place(fill->cloud, chunk, (uint32_t)(slot - chunk->first), p);
    pt_apply(fill->linear, p, q);
    for (int k = 0; k < 3; k++)
        q[k] += fill->translation[k];
    return fill->desc->shape == PATINA_FIELD_FROM_PLANE  ? q[2]
           : fill->desc->shape == PATINA_FIELD_FROM_AXIS ? sqrt(q[0] * q[0] + q[1] * q[1])
                                                         : sqrt(pt_dot(q, q));
}

static double density(const struct patina_cloud *cloud, const struct pt_chunk *chunk, size_t slot)
{
    const double own = cloud->spacing_base * pt_spacing_of_class(cloud->surfels[slot] >> PT_SPACING_SHIFT);
    const double spacing = own > 0.0 ? own : (double)chunk->spacing;
    return spacing > 0.0 ? 1.0 / (spacing * spacing) : 0.0;
}

static double number_of(const struct fill *fill, const struct pt_chunk *chunk, size_t slot)
{
    const struct patina_cloud *cloud = fill->cloud;
    switch (fill->desc->source) {
    case PATINA_FIELD_SCALAR: return (double)cloud->scalars[slot];
    case PATINA_FIELD_LUMINANCE: return luminance(cloud, slot);
    case PATINA_FIELD_CLASSES: return fill->desc->classes[cloud->classes[slot] / 32] >> cloud->classes[slot] % 32 & 1u;
    case PATINA_FIELD_DISTANCE: return distance(fill, chunk, slot);
    case PATINA_FIELD_DENSITY: return density(cloud, chunk, slot);
    default: return (double)fill->values[pt_number_of(cloud, slot)];
    }
}

static void find_numbers(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct fill *fill = context;
    (void)thread;
    for (uint32_t c = begin; c < end; c++) {
        const struct pt_chunk *chunk = &fill->cloud->chunks[c];
        for (size_t slot = chunk->first; slot < (size_t)chunk->first + chunk->padded; slot++)
            fill->numbers[slot] = (float)number_of(fill, chunk, slot);
    }
}

// ---- their range ---------------------------------------------------------------------------------------------------------

// 0, or PATINA_ERROR_MEMORY.
static int find_range(struct fill *fill)
{
    const uint64_t slots = fill->cloud->slots, step = slots / SAMPLE + 1;
    double from = fill->desc->range[0], to = fill->desc->range[1];
    int within = 1;
    for (uint64_t i = 0; i < slots && from == to && within; i++)
        within = !isfinite(fill->numbers[i]) || (fill->numbers[i] >= 0.0f && fill->numbers[i] <= 1.0f);
    if (from == to && within) {
        from = 0.0;
        to = 1.0;
    } else if (from == to) {
        float *sample = malloc((slots / step + 1) * sizeof *sample);
        size_t count = 0;
        if (!sample)
            return PATINA_ERROR_MEMORY;
        for (uint64_t i = 0; i < slots; i += step)
            if (isfinite(fill->numbers[i]))
                sample[count++] = fill->numbers[i];
        qsort(sample, count, sizeof *sample, pt_compare_floats);
        from = count ? (double)sample[count / 100] : 0.0;
        to = count ? (double)sample[count - 1 - count / 100] : 0.0;
        free(sample);
    }
    fill->field->range[fill->desc->invert] = from;
    fill->field->range[!fill->desc->invert] = to;
    fill->start = fill->desc->invert ? 1.0 : 0.0;
    fill->from = from;
    fill->by = to != from ? (fill->desc->invert ? -1.0 : 1.0) / (to - from) : 0.0; // all the same: one end
    return PATINA_OK;
}

static uint16_t step_of(double value)
{
    return (uint16_t)(value >= 1.0 ? 65535u : value > 0.0 ? pt_field_steps((float)value) : 0u);
}

static void fill_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct fill *fill = context;
    (void)thread;
    for (uint32_t c = begin; c < end; c++) {
        const struct pt_chunk *chunk = &fill->cloud->chunks[c];
        uint16_t least = UINT16_MAX, most = 0;
        uint32_t counts[PT_FIELD_BINS] = {0};
        for (size_t slot = chunk->first; slot < (size_t)chunk->first + chunk->padded; slot++) {
            const uint16_t step = step_of(fill->start + ((double)fill->numbers[slot] - fill->from) * fill->by);
            fill->field->steps[slot] = step;
            least = step < least ? step : least;
            most = step > most ? step : most;
            counts[step * PT_FIELD_BINS >> 16] += slot - chunk->first < chunk->count;
        }
        for (int bin = 0; bin < PT_FIELD_BINS; bin++)
            atomic_fetch_add_explicit(&fill->field->histogram[bin], counts[bin], memory_order_relaxed);
        fill->field->chunks[c][0] = least;
        fill->field->chunks[c][1] = most;
    }
}

// ---- the handle ----------------------------------------------------------------------------------------------------------

// Distances in world units: the shape's axes are made unit, and z square to x and y. 0 where it has none.
static int place_shape(struct fill *fill)
{
    double object[9], object_at[3], shape[9], shape_at[3], axes[9], from[3];
    pt_split_matrix(fill->desc->world_from_object, object, object_at);
    pt_split_matrix(fill->desc->world_from_shape, shape, shape_at);
    double x[3] = {shape[0], shape[3], shape[6]}, y[3] = {shape[1], shape[4], shape[7]}, z[3] = {shape[2], shape[5], shape[8]};
    double *third = fill->desc->shape == PATINA_FIELD_FROM_AXIS ? z : NULL, across[3];
    if (!third)
        for (int k = 0; k < 3; k++)
            z[k] = x[(k + 1) % 3] * y[(k + 2) % 3] - x[(k + 2) % 3] * y[(k + 1) % 3];
    const double length = sqrt(pt_dot(z, z));
    if (!(length > 0.0))
        return 0;
    const int least = fabs(z[0]) <= fabs(z[1]) && fabs(z[0]) <= fabs(z[2]) ? 0 : fabs(z[1]) <= fabs(z[2]) ? 1 : 2;
    for (int k = 0; k < 3; k++)
        z[k] /= length;
    for (int k = 0; k < 3; k++)
        across[k] = (k == least) - z[least] * z[k];
    const double wide = sqrt(pt_dot(across, across));
    for (int k = 0; k < 3; k++) {
        axes[k] = across[k] / wide;
        axes[6 + k] = z[k];
        from[k] = object_at[k] - shape_at[k];
    }
    for (int k = 0; k < 3; k++)
        axes[3 + k] = z[(k + 1) % 3] * axes[(k + 2) % 3] - z[(k + 2) % 3] * axes[(k + 1) % 3];
    pt_multiply(axes, object, fill->linear);
    pt_apply(axes, from, fill->translation);
    return 1;
}

static int check(const patina_cloud *cloud, patina_field_desc *desc)
{
    const int source = (int)desc->source;
    if (desc->source > PATINA_FIELD_DENSITY || desc->shape > PATINA_FIELD_FROM_AXIS || desc->invert > 1)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_field_create: no such source or shape");
    if (source == PATINA_FIELD_VALUES && (desc->count != cloud->info.count || (desc->count && !desc->values)))
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_field_create: %llu values for %llu points",
                       desc->values ? (unsigned long long)desc->count : 0, (unsigned long long)cloud->info.count);
    if (!isfinite(desc->range[0]) || !isfinite(desc->range[1]) || !pt_take_matrix(desc->world_from_object) ||
        !pt_take_matrix(desc->world_from_shape))
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_field_create: range and matrices must be finite");
    const char *missing = source == PATINA_FIELD_SCALAR && !cloud->scalars     ? "scalars"
                          : source == PATINA_FIELD_LUMINANCE && !cloud->colors ? "colours"
                          : source == PATINA_FIELD_CLASSES && !cloud->classes  ? "classes"
                                                                               : NULL;
    return missing && cloud->slots ? pt_fail(NULL, PATINA_ERROR_EMPTY, "patina_field_create: the cloud has no %s", missing)
                                   : PATINA_OK;
}

static struct patina_field *field_begin(const patina_cloud *cloud)
{
    struct patina_field *field = calloc(1, sizeof *field);
    if (!field)
        return NULL;
    pt_handle_init(&field->handle);
    field->of = pt_alive_share(cloud);
    field->alive = pt_alive_create();
    field->slots = cloud->slots;
    field->steps = pt_pages_alloc((field->slots + 1) * sizeof *field->steps);
    field->chunks = calloc(cloud->chunk_count + 1, sizeof *field->chunks);
    if (field->alive && field->steps && field->chunks)
        return field;
    patina_field_destroy(field);
    return NULL;
}

static void range_radii(const struct patina_cloud *cloud, float range[2])
{
    for (uint64_t slot = 0; cloud->radii && slot < cloud->slots; slot++) {
        const float own = fminf(cloud->radii[slot], FLT_MAX); // a damaged file may hold any
        if (!(own > 0.0f))
            continue;
        range[0] = range[1] > 0.0f ? fminf(range[0], own) : own;
        range[1] = fmaxf(range[1], own);
    }
}

static int fill_field(struct fill *fill, patina_progress *progress)
{
    const struct patina_cloud *cloud = fill->cloud;
    struct pt_pool *pool = pt_pool_create(pt_pool_threads_for(0, cloud->slots), 0);
    float *walked = NULL;
    int error = pool && fill->numbers && fill->field ? PATINA_OK : PATINA_ERROR_MEMORY;
    if (!error && fill->desc->source == PATINA_FIELD_UNCERTAINTY) {
        walked = malloc((cloud->info.count + 1) * sizeof *walked);
        const patina_neighbourhoods wanted = {.struct_size = sizeof wanted, .neighbours = NEIGHBOURS, .uncertainty = walked};
        error = walked ? patina_cloud_neighbourhoods(cloud, &wanted, progress) : PATINA_ERROR_MEMORY;
        fill->values = walked;
    }
    if (!error) {
        pt_parallel(pool, cloud->chunk_count, 4, find_numbers, fill);
        error = find_range(fill);
    }
    if (!error) {
        pt_parallel(pool, cloud->chunk_count, 4, fill_chunks, fill);
        range_radii(cloud, fill->field->radii);
        fill->field->hash = pt_fingerprint(1, fill->field->steps, fill->field->slots * sizeof *fill->field->steps);
    }
    pt_pool_destroy(pool);
    free(walked);
    return error;
}

static int make_field(const patina_cloud *cloud, patina_field_desc *desc, patina_progress *progress, patina_field **out)
{
    int error = check(cloud, desc);
    if (error)
        return error;
    struct fill fill = {.cloud = cloud,
                        .desc = desc,
                        .values = desc->values,
                        .field = field_begin(cloud),
                        .numbers = calloc(cloud->slots + 1, sizeof *fill.numbers)};
    if (desc->source == PATINA_FIELD_DISTANCE && !place_shape(&fill))
        error = pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_field_create: the shape is flat");
    else if ((error = fill_field(&fill, progress)) == PATINA_ERROR_MEMORY)
        pt_fail(NULL, error, "a field of %llu points: out of memory", (unsigned long long)cloud->info.count);
    free(fill.numbers);
    if (error)
        patina_field_destroy(fill.field);
    else
        *out = fill.field;
    return error;
}

int patina_field_create(const patina_cloud *cloud, const patina_field_desc *desc, patina_progress *progress, patina_field **out)
{
    patina_field_desc checked;
    if (!cloud || !out || cloud->handle.magic != PT_MAGIC)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_field_create: cloud or out is NULL, or the cloud destroyed");
    *out = NULL;
    int error = pt_take(NULL, "patina_field_create", desc, &checked, sizeof checked);
    if (error || (error = pt_undivided_enter(cloud, "patina_field_create")))
        return error;
    error = make_field(cloud, &checked, progress, out);
    pt_paged_leave(cloud);
    return error;
}

int patina_field_get_info(const patina_field *field, patina_field_info *info)
{
    if (!field || field->handle.magic != PT_MAGIC)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_field_get_info: field is NULL, or destroyed");
    patina_field_info found = {.struct_size = sizeof found, .range = {field->range[0], field->range[1]}};
    for (int bin = 0; bin < PT_FIELD_BINS; bin++)
        found.histogram[bin] = atomic_load_explicit(&field->histogram[bin], memory_order_relaxed);
    return pt_give(&field->handle, "patina_field_get_info", &found, sizeof found, info);
}

void patina_field_destroy(patina_field *field)
{
    if (!field)
        return;
    pt_pages_free(field->steps, (field->slots + 1) * sizeof *field->steps);
    free(field->chunks);
    pt_alive_end(field->alive);
    pt_alive_release(field->of);
    pt_handle_destroy(&field->handle);
    free(field);
}
