// SPDX-License-Identifier: GPL-3.0-or-later
#include "rounds.h"

#include "slots.h"

#include "shared/points.h"
#include "shared/shadows.h"

int pt_pass_divides(const struct pt_pass *pass)
{
    switch (pass->kernel) {
    case PT_KERNEL_scatter: // least keys
    case PT_KERNEL_sift:    // bits, words and records of the chunks themselves
    case PT_KERNEL_shadow_test:
    case PT_KERNEL_dim:
    case PT_KERNEL_gather: return 1;
    default: return 0; // sums that end in a mean, or bins that the next pass takes up
    }
}

enum pt_pass_role pt_pass_role(const struct pt_pass *pass)
{
    switch (pass->kernel) {
    case PT_KERNEL_sift: return PT_ROLE_SIEVE;
    case PT_KERNEL_scatter: return PT_ROLE_KEYS;
    case PT_KERNEL_splat: return PT_ROLE_SURFACE;
    default: return PT_ROLE_NONE;
    }
}

uint32_t pt_pass_keys(const struct pt_pass *pass, uint32_t *width, uint32_t *height)
{
    const struct scatter_args *args = pass->arguments;
    *width = args->view.width;
    *height = args->view.height;
    return PT_BUF_scatter_keys;
}

int pt_pass_marks(const struct pt_pass *pass)
{
    switch (pass->kernel) {
    case PT_KERNEL_shadow_test:
        return ((const struct shadow_test_args *)pass->arguments)->marked ? PT_BUF_shadow_test_marks : -1;
    case PT_KERNEL_dim: return ((const struct dim_args *)pass->arguments)->marked ? PT_BUF_dim_marks : -1;
    default: return -1;
    }
}

static uint32_t array_bit(enum pt_instance_buffer which, const struct patina_cloud *cloud)
{
    switch (which) {
    case PT_POSITIONS: return 1u << PT_ARRAY_POSITIONS;
    case PT_SURFELS: return 1u << PT_ARRAY_SURFELS;
    case PT_COLORS: return 1u << PT_ARRAY_COLORS;
    case PT_OPACITIES: return 1u << PT_ARRAY_OPACITIES;
    case PT_RADII: return 1u << (cloud->radii ? PT_ARRAY_RADII : PT_ARRAY_SHAPES);
    case PT_SCALARS: return 1u << PT_ARRAY_SCALARS;
    case PT_CLASSES: return 1u << PT_ARRAY_CLASSES;
    case PT_SHAPES: return 1u << PT_ARRAY_SHAPES;
    default: return 0;
    }
}

// Bytes a slot of what a device copies that copies clouds.
static uint32_t copied_of(uint32_t which, const struct patina_cloud *cloud)
{
    switch (which) {
    case PT_POSITIONS: return 4 * pt_position_words(cloud);
    case PT_SURFELS:
    case PT_FIELD:
    case PT_FIELD_ONE: return 4;
    case PT_SCANS: return 2;
    case PT_COLORS: return cloud->color_format ? (uint32_t)pt_color_size(cloud->color_format) : 0;
    case PT_OPACITIES: return cloud->opacities ? 1 : 0;
    case PT_RADII: return cloud->radii || cloud->shapes ? 4 : 0;
    case PT_SCALARS: return cloud->scalars ? 4 : 0;
    case PT_CLASSES: return cloud->classes ? 1 : 0;
    case PT_SHAPES: return cloud->shapes ? 4 : 0;
    default: return 0; // what lies there whole
    }
}

static uint32_t bytes_of(const struct pt_chunk_list *list, uint32_t arrays)
{
    uint32_t bytes = 0;
    for (int i = 0; i < PT_ARRAYS; i++)
        bytes += arrays >> i & 1u ? pt_cloud_point_bytes(list->cloud, (enum pt_array)i) : 0;
    return bytes;
}

void pt_list_count_bytes(struct pt_chunk_list *list)
{
    list->each[0] = bytes_of(list, list->arrays & ~list->culled);
    list->each[1] = bytes_of(list, list->arrays);
}

uint32_t pt_pass_lists(const struct pt_plan *plan, const struct pt_pass *pass, struct pt_chunk_list *lists)
{
    uint32_t count = 0;
    for (uint32_t k = 0; k < pass->ref_count; k++) {
        const struct pt_ref *ref = &pass->refs[k];
        if (ref->which != PT_CHUNKS || (ref->of != PT_OF_INSTANCE && ref->of != PT_OF_RECEIVER))
            continue;
        const int own = ref->of == PT_OF_INSTANCE;
        const struct patina_cloud *cloud = own ? plan->instances[ref->index].instance->cloud
                                               : plan->receivers[ref->index].cloud;
        if (!cloud) // pixels that show meshes
            continue;
        struct pt_chunk_list *list = &lists[count++];
        *list = (struct pt_chunk_list){.cloud = cloud,
                                       .chunks = own ? plan->instances[ref->index].chunks : plan->receivers[ref->index].chunks,
                                       .count = own ? plan->instances[ref->index].chunk_count
                                                    : plan->receivers[ref->index].chunk_count,
                                       .ref = k,
                                       .culled = pass->kernel == PT_KERNEL_scatter ? 1u << PT_ARRAY_SURFELS : 0};
        for (uint32_t i = 0; i < pass->ref_count; i++)
            if (pass->refs[i].of == ref->of && pass->refs[i].index == ref->index) {
                list->arrays |= array_bit((enum pt_instance_buffer)pass->refs[i].which, cloud);
                list->copied += copied_of(pass->refs[i].which, cloud);
            }
        if (!list->arrays && !list->copied) { // nothing of its points is read
            count--;
            continue;
        }
        pt_list_count_bytes(list);
    }
    return count;
}

int pt_next_range(const struct pt_chunk_list *lists, uint32_t count, uint64_t most, struct pt_chunk_range *range)
{
    uint32_t list = range->end_list, chunk = range->end_chunk, some = 0;
    *range = (struct pt_chunk_range){.list = list, .chunk = chunk};
    for (; list < count; list++, chunk = 0) {
        const struct pt_chunk_list *at = &lists[list];
        for (; chunk < at->count; chunk++, some = 1) {
            const uint64_t bytes = pt_chunk_bytes(at, &at->chunks[chunk]);
            if (some && range->bytes + bytes > most)
                goto full;
            range->bytes += bytes;
        }
    }
full:
    range->end_list = list;
    range->end_chunk = chunk;
    return some != 0;
}

uint32_t pt_count_ranges(const struct pt_chunk_list *lists, uint32_t count, uint64_t most, uint64_t *bytes)
{
    struct pt_chunk_range range = {0};
    uint32_t ranges = 0;
    for (*bytes = 0; pt_next_range(lists, count, most, &range); ranges++)
        *bytes += range.bytes;
    return *bytes ? ranges : 0;
}

uint32_t pt_count_copies(const struct pt_chunk_list *lists, uint32_t count, uint64_t most, uint64_t *bytes)
{
    uint32_t ranges = 0;
    *bytes = 0;
    for (uint32_t i = 0; i < count; i++) {
        const struct pt_chunk_list *const list = &lists[i];
        const uint64_t facing = list->copied - (list->culled ? 4 : 0); // without surfels
        for (uint32_t c = 0; c < list->count; c++)
            *bytes += list->chunks[c].padded * (list->chunks[c].cull ? list->copied : facing);
        for (struct pt_slots at = {0}; at.first_chunk < list->count; at.first_chunk += at.chunk_count, ranges++)
            at = pt_next_slots(list->chunks, list->count, at.first_chunk, most / list->copied, PT_SLOTS_A_WORD);
    }
    return ranges;
}
