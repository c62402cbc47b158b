// SPDX-License-Identifier: GPL-3.0-or-later
// A cloud's arrays, and what of them lies in a mapped file: it need not be held to be read.
#include "cloud.h"
#include "base/platform.h"

#include <string.h>

void pt_cloud_sections(struct patina_cloud *cloud, struct pt_section sections[PT_ARRAYS])
{
    const uint64_t slots = cloud->slots;
    const struct pt_section list[PT_ARRAYS] = {
        [PT_ARRAY_CHUNKS] = {(void **)&cloud->chunks, cloud->chunk_count * sizeof *cloud->chunks},
        [PT_ARRAY_POSITIONS] = {&cloud->positions, slots * 4 * pt_position_words(cloud)},
        [PT_ARRAY_ORDER] = {(void **)&cloud->order, cloud->unordered ? 0 : slots * 4},
        [PT_ARRAY_SURFELS] = {(void **)&cloud->surfels, slots * 4},
        [PT_ARRAY_COLORS] = {&cloud->colors, cloud->color_format ? slots * pt_color_size(cloud->color_format) + 4 : 0},
        [PT_ARRAY_OPACITIES] = {(void **)&cloud->opacities, cloud->info.has_opacities ? slots + 4 : 0},
        [PT_ARRAY_RADII] = {(void **)&cloud->radii, cloud->info.has_radii ? slots * 4 : 0},
        [PT_ARRAY_SCALARS] = {(void **)&cloud->scalars, cloud->info.has_scalars ? slots * 4 : 0},
        [PT_ARRAY_CLASSES] = {(void **)&cloud->classes, cloud->info.has_classes ? slots + 4 : 0},
        [PT_ARRAY_SHAPES] = {(void **)&cloud->shapes, cloud->info.has_shapes ? slots * 4 : 0},
        [PT_ARRAY_SIGHTS] = {(void **)&cloud->sights.each, cloud->sights.room * sizeof *cloud->sights.each},
        [PT_ARRAY_SIGHT_WORDS] = {(void **)&cloud->sights.words, cloud->sights.bytes},
    };
    memcpy(sections, list, sizeof list);
}

// Those of a cloud that nobody changes.
static void sections_of(const struct patina_cloud *cloud, struct patina_cloud *copy, struct pt_section sections[PT_ARRAYS])
{
    *copy = *cloud;
    pt_cloud_sections(copy, sections);
}

uint64_t pt_cloud_mapped_bytes(const struct patina_cloud *cloud)
{
    struct patina_cloud copy;
    struct pt_section sections[PT_ARRAYS];
    uint64_t bytes = 0;
    sections_of(cloud, &copy, sections);
    for (int i = 0; i < PT_ARRAYS; i++)
        bytes += cloud->mapped >> i & 1u ? sections[i].size : 0;
    return bytes;
}

uint64_t pt_cloud_copied_bytes(const struct patina_cloud *cloud)
{
    struct patina_cloud copy;
    struct pt_section sections[PT_ARRAYS];
    uint64_t bytes = 0;
    sections_of(cloud, &copy, sections);
    for (int i = PT_ARRAY_POSITIONS; i <= PT_ARRAY_SHAPES; i++)
        bytes += i != PT_ARRAY_ORDER && *sections[i].data ? sections[i].size : 0;
    return bytes;
}

uint32_t pt_cloud_largest_chunk(const struct patina_cloud *cloud)
{
    uint32_t most = 0;
    for (uint32_t i = 0; i < cloud->chunk_count; i++)
        most = cloud->chunks[i].padded > most ? cloud->chunks[i].padded : most;
    return most;
}

uint32_t pt_cloud_array_bytes(const struct patina_cloud *cloud, enum pt_array array)
{
    static const uint8_t bytes[PT_ARRAYS] = {
        [PT_ARRAY_ORDER] = 4,   [PT_ARRAY_SURFELS] = 4, [PT_ARRAY_OPACITIES] = 1, [PT_ARRAY_RADII] = 4,
        [PT_ARRAY_SCALARS] = 4, [PT_ARRAY_CLASSES] = 1, [PT_ARRAY_SHAPES] = 4};
    return array == PT_ARRAY_COLORS      ? (uint32_t)pt_color_size(cloud->color_format)
           : array == PT_ARRAY_POSITIONS ? 4 * pt_position_words(cloud)
                                         : bytes[array];
}

uint32_t pt_cloud_point_bytes(const struct patina_cloud *cloud, enum pt_array array)
{
    return cloud->mapped >> array & 1u ? pt_cloud_array_bytes(cloud, array) : 0;
}

void pt_cloud_return(const struct patina_cloud *cloud)
{
    struct patina_cloud copy;
    struct pt_section sections[PT_ARRAYS];
    sections_of(cloud, &copy, sections);
    for (int i = 0; i < PT_ARRAYS; i++)
        if (cloud->mapped >> i & 1u)
            pt_pages_return(*sections[i].data, sections[i].size);
}

void pt_cloud_expect(const struct patina_cloud *cloud, uint32_t arrays, uint64_t first, uint64_t end)
{
    struct patina_cloud copy;
    struct pt_section sections[PT_ARRAYS];
    sections_of(cloud, &copy, sections);
    for (int i = 0; i < PT_ARRAYS; i++)
        if (cloud->mapped >> i & arrays >> i & 1u) {
            const uint64_t each = pt_cloud_point_bytes(cloud, (enum pt_array)i);
            pt_pages_expect((char *)*sections[i].data + first * each, (end - first) * each);
        }
}
