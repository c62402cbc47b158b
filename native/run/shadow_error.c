// SPDX-License-Identifier: GPL-3.0-or-later
// How far soft shadows are off, told from what more samples changed. The sums are integers, equal on every device, and are
// gone through in one order on the caller's thread: when a light stops is decided alike everywhere.
#include "shadows.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// The estimate takes samples for independent. Ours are spread evenly, which makes the change from one doubling to the next
// uneven: of 35 cases (five lights, 4 to 256 samples) the error was up to 1.40 times the plain estimate.
static const double caution = 1.5;

void pt_shadow_sums_free(struct pt_shadow_sums *sums)
{
    free(sums->words);
    *sums = (struct pt_shadow_sums){0};
}

int pt_shadow_sums_read(struct patina_device *device, const struct pt_shadows *shadows, uint32_t light,
                        struct pt_shadow_sums *sums)
{
    size_t at = 0;
    pt_shadow_sums_free(sums);
    for (uint32_t i = 0; i < shadows->instance_count; i++)
        sums->count += shadows->words[i].size / 4 / shadows->light_count;
    sums->words = malloc((sums->count + 1) * sizeof *sums->words);
    if (!sums->words)
        return pt_fail(&device->handle, PATINA_ERROR_MEMORY, "shadow textures: out of memory");
    for (uint32_t i = 0; i < shadows->instance_count; i++) {
        size_t size = shadows->words[i].size / shadows->light_count;
        int error = size ? device->ops->buffer_read(device, &shadows->words[i], light * size, sums->words + at, size)
                         : PATINA_OK;
        if (error)
            return error;
        at += size / 4;
    }
    sums->samples = shadows->lights[light].samples;
    return PATINA_OK;
}

float pt_shadow_error(const struct pt_shadow_sums *before, const struct pt_shadow_sums *after)
{
    double square = 0.0, few = 1.0 / (255.0 * before->samples), many = 1.0 / (255.0 * after->samples);
    uint64_t between = 0;
    for (size_t i = 0; i < after->count; i++) {
        uint32_t first = before->words[i] & PT_SHADOW_SUM, sum = after->words[i] & PT_SHADOW_SUM;
        if (sum % after->samples == 0) // lit, dark, or as dark as what stands before it: of all samples
            continue;
        double change = sum * many - first * few;
        square += change * change;
        between++;
    }
    // independent samples: the mean of m of n has 1 / m - 1 / n more variance than that of n, which has 1 / n itself
    double share = (double)before->samples / (after->samples - before->samples);
    return between ? (float)(caution * sqrt(square / (double)between * share)) : 0.0f;
}
