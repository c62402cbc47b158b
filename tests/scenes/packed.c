// SPDX-License-Identifier: GPL-3.0-or-later
#include "packed.h"

#include "scene/clouds/cloud.h"
#include "support.h"

#include <stdlib.h>
#include <string.h>

void packed_write(const char *from, const char *packed, const char *floats)
{
    const patina_save_desc desc = {.struct_size = sizeof desc, .pack = 1};
    patina_cloud *cloud = NULL;
    CHECK(patina_cloud_open(from, &cloud), NULL);
    CHECK(patina_cloud_save_as(cloud, packed, &desc), cloud);
    patina_cloud_destroy(cloud);
    CHECK(patina_cloud_open(packed, &cloud), NULL);
    if (!cloud->packed)
        support_die("%s is not packed", packed);
    float *positions = malloc(cloud->slots * 12 + 1), *scratch = malloc(3 * PT_CHUNK_POINTS * sizeof *scratch);
    if (!positions || !scratch)
        support_die("out of memory");
    for (uint32_t c = 0; c < cloud->chunk_count; c++) {
        const struct pt_chunk *chunk = &cloud->chunks[c];
        memcpy(positions + 3 * (size_t)chunk->first, pt_chunk_positions(cloud, chunk, scratch), (size_t)chunk->padded * 12);
    }
    struct patina_cloud other = *cloud;
    other.positions = positions;
    other.page_sums = NULL; // of other positions
    other.packed = 0;
    other.mapped = 0; // for nobody may give these pages back
    other.info.packed_error = 0.0;
    CHECK(patina_cloud_save(&other, floats), NULL);
    patina_cloud_destroy(cloud);
    free(positions);
    free(scratch);
}
