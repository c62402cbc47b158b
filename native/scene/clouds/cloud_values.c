// SPDX-License-Identifier: GPL-3.0-or-later
// Callers' arrays are checked here; and values of points beside their surface and colour: scalars, which ramps colour, and
// classes, which can be hidden.
#include "cloud.h"
#include "fingerprint.h"
#include "paged.h"
#include "parts.h"
#include "io/file.h"
#include "base/compare.h"
#include "base/platform.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

int pt_check_array(patina_array *array, const char *what, uint32_t types, uint32_t least_components, uint32_t most_components)
{
    if (!array->data)
        return PATINA_OK;
    if (array->type > PATINA_INT32 || !(types >> array->type & 1u))
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "%s: element type %u is not supported", what, array->type);
    if (array->components < least_components || array->components > most_components)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "%s: %u components; %u%s needed", what, array->components, least_components,
                       most_components > 3   ? " or 4 are"
                       : most_components > 1 ? " are"
                                             : " is");
    if (!array->stride)
        array->stride = array->components * pt_type_size(array->type);
    return PATINA_OK;
}

enum { NUMBERS = (1 << (PATINA_INT32 + 1)) - 2 }; // every patina_type

int pt_check_values(patina_array *scalar, patina_array *classes)
{
    int error = pt_check_array(scalar, "scalar", NUMBERS, 1, 1);
    return error ? error : pt_check_array(classes, "classes", 1u << PATINA_UINT8, 1, 1);
}

// As the type of `value` lies there.
#define READ(value) (memcpy(&(value), at, sizeof(value)), (float)(value))

static float read_value(const patina_array *array, uint64_t index)
{
    const char *at = (const char *)array->data + index * array->stride;
    union {
        float f;
        double d;
        uint8_t u8;
        uint16_t u16;
        uint32_t u32;
        int8_t i8;
        int16_t i16;
        int32_t i32;
    } v;
    switch (array->type) {
    case PATINA_FLOAT32: return READ(v.f);
    case PATINA_FLOAT64: return READ(v.d);
    case PATINA_UINT8: return READ(v.u8);
    case PATINA_UINT16: return READ(v.u16);
    case PATINA_UINT32: return READ(v.u32);
    case PATINA_INT8: return READ(v.i8);
    case PATINA_INT16: return READ(v.i16);
    default: return READ(v.i32);
    }
}

// ---- scalars -------------------------------------------------------------------------------------------------------------

size_t pt_scalar_bytes(const struct patina_cloud *cloud) { return cloud->slots * sizeof *cloud->scalars; }

static void measure_scalars(struct patina_cloud *cloud, const float *values)
{
    float least = INFINITY, most = -INFINITY;
    for (uint64_t i = 0; values && i < cloud->slots; i++)
        if (isfinite(values[i])) {
            least = values[i] < least ? values[i] : least;
            most = values[i] > most ? values[i] : most;
        }
    cloud->info.scalar_range[0] = least <= most ? least : 0.0f;
    cloud->info.scalar_range[1] = least <= most ? most : 0.0f;
}

static int take_scalars(struct patina_cloud *cloud, const patina_array *scalar)
{
    size_t size = pt_scalar_bytes(cloud);
    float *values = scalar->data && size ? pt_pages_alloc(size) : NULL;
    if (scalar->data && size && !values)
        return PATINA_ERROR_MEMORY;
    for (uint64_t i = 0; values && i < cloud->slots; i++)
        values[i] = read_value(scalar, pt_number_of(cloud, i));
    measure_scalars(cloud, values);
    cloud->info.bytes += values ? size : 0;
    cloud->info.bytes -= cloud->scalars ? pt_cloud_own_bytes(cloud, PT_ARRAY_SCALARS, size) : 0;
    cloud->mapped &= ~(1u << PT_ARRAY_SCALARS);
    pt_pages_free(cloud->scalars, size);
    cloud->scalars = values;
    cloud->info.has_scalars = scalar->data != NULL;
    pt_parts_follow(cloud);
    return PATINA_OK;
}

int patina_cloud_set_scalars(patina_cloud *cloud, const patina_array *scalar)
{
    if (!cloud || !scalar)
        return pt_fail(cloud ? &cloud->handle : NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_set_scalars: bad arguments");
    patina_array checked = *scalar;
    int error = pt_paged_refuse(cloud, "patina_cloud_set_scalars");
    if (error || (error = pt_check_array(&checked, "scalar", NUMBERS, 1, 1)))
        return pt_fail_again(&cloud->handle, error);
    if (take_scalars(cloud, &checked))
        return pt_fail(&cloud->handle, PATINA_ERROR_MEMORY, "scalars of %llu points: out of memory",
                       (unsigned long long)cloud->info.count);
    atomic_fetch_add(&cloud->alive->colors, 1);
    return PATINA_OK;
}

// Takes every step-th finite scalar of what is there, or none; how many finite ones there are. Those that repeat a chunk's last are too few
// to show.
static size_t pick_scalars(const patina_cloud *cloud, size_t step, float *values)
{
    size_t seen = 0, taken = 0;
    for (uint32_t c = 0; cloud->scalars && (c = pt_chunk_from(cloud, c)) < cloud->chunk_count; c++) {
        const float *scalars = cloud->scalars + pt_chunk_slot(cloud, &cloud->chunks[c]);
        for (uint32_t i = 0; i < cloud->chunks[c].padded; i++)
            if (isfinite(scalars[i]) && seen++ % step == 0 && values)
                values[taken++] = scalars[i];
    }
    return seen;
}

static int range_of(const patina_cloud *cloud, double share, float range[2])
{
    const size_t count = pick_scalars(cloud, 1, NULL);
    if (!count)
        return pt_fail(&cloud->handle, PATINA_ERROR_EMPTY, "patina_cloud_scalar_range: no point has a finite scalar");
    memcpy(range, cloud->info.scalar_range, sizeof cloud->info.scalar_range);
    if (share == 0.0)
        return PATINA_OK;
    enum { MOST = 1 << 20 }; // looked at: their order statistics are those of all within a thousandth of the points
    const size_t step = (count + MOST - 1) / MOST, taken = (count + step - 1) / step;
    float *values = malloc(taken * sizeof *values);
    if (!values)
        return pt_fail(&cloud->handle, PATINA_ERROR_MEMORY, "patina_cloud_scalar_range: out of memory");
    pick_scalars(cloud, step, values);
    qsort(values, taken, sizeof *values, pt_compare_floats);
    size_t below = (size_t)(share * (double)(taken - 1));
    range[0] = values[below];
    range[1] = values[taken - 1 - below];
    free(values);
    return PATINA_OK;
}

int patina_cloud_scalar_range(const patina_cloud *cloud, double share, float range[2])
{
    if (!cloud || !range || !(share >= 0.0 && share < 0.5))
        return pt_fail(cloud ? &cloud->handle : NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_scalar_range: bad arguments");
    pt_paged_enter(cloud, 0);
    const int error = range_of(cloud, share, range);
    pt_paged_leave(cloud);
    return error;
}

// ---- classes -------------------------------------------------------------------------------------------------------------

static size_t class_bytes(const struct patina_cloud *cloud) { return cloud->slots + 4; } // kernels read bytes as words

static void classes_of(struct patina_cloud *cloud, const patina_array *classes, struct pt_chunk *chunk)
{
    for (uint32_t i = 0; i < chunk->padded; i++) {
        const uint32_t slot = chunk->first + i;
        const uint8_t class = *((const uint8_t *)classes->data + pt_number_of(cloud, slot) * classes->stride);
        cloud->classes[slot] = class;
        chunk->classes[class / 32] |= 1u << class % 32;
    }
}

// ---- both, of a cloud that is being built ----------------------------------------------------------------------------------

int pt_cloud_values_begin(struct patina_cloud *cloud, const patina_cloud_desc *desc)
{
    cloud->info.has_scalars = desc->scalar.data != NULL;
    cloud->info.has_classes = desc->classes.data != NULL;
    if (desc->scalar.data && cloud->slots) {
        if (!(cloud->scalars = pt_pages_alloc(pt_scalar_bytes(cloud))))
            return PATINA_ERROR_MEMORY;
        cloud->info.bytes += pt_scalar_bytes(cloud);
    }
    if (desc->classes.data) {
        if (!(cloud->classes = pt_pages_alloc(class_bytes(cloud))))
            return PATINA_ERROR_MEMORY;
        cloud->info.bytes += class_bytes(cloud);
    }
    return PATINA_OK;
}

void pt_cloud_values_of(struct patina_cloud *cloud, const patina_cloud_desc *desc, uint32_t c)
{
    struct pt_chunk *chunk = &cloud->chunks[c];
    for (uint64_t i = chunk->first; cloud->scalars && i < chunk->first + chunk->padded; i++)
        cloud->scalars[i] = read_value(&desc->scalar, pt_number_of(cloud, i));
    if (cloud->classes)
        classes_of(cloud, &desc->classes, chunk);
}

void pt_cloud_values_end(struct patina_cloud *cloud)
{
    measure_scalars(cloud, cloud->scalars);
    for (uint32_t c = 0; c < cloud->chunk_count; c++)
        for (int k = 0; k < 8; k++)
            cloud->info.class_bits[k] |= cloud->chunks[c].classes[k];
    if (cloud->classes)
        cloud->class_hash = pt_fingerprint(1, cloud->classes, cloud->slots);
}
