// SPDX-License-Identifier: GPL-3.0-or-later
// A cloud that is built on the disk. builder.c takes points in and lays them on tapes by level and place; builder_parts.c makes chunks of
// what lies near each other, as much at a time as memory holds, by the code that builds clouds in memory, and writes the file.
#ifndef PT_BUILDER_H
#define PT_BUILDER_H

#include "scene/clouds/cloud.h"
#include "spill.h"

// A point is of level f, 0 the finest, with the chance 3/4 * 4^-f: by a hash of its number.
enum { PT_BUILDER_LEVELS = 9, PT_BUILDER_FIELDS = 7, PT_BUILDER_BUCKETS = 600 };

struct pt_bucket {
    struct pt_tape tape; // of records
    uint64_t count;
    double box_min[3], box_max[3];
};

struct patina_builder {
    struct pt_handle handle;
    char *path;
    patina_builder_desc desc;
    patina_cloud_desc shape;                                     // what the pieces have: types and origin
    uint32_t offset[PT_BUILDER_FIELDS], size[PT_BUILDER_FIELDS]; // of each array in a record; size 0: there is none
    uint32_t number, record;                                     // where the point's number lies; all, bytes
    struct pt_pool *pool;
    struct pt_spill spill;
    struct pt_bucket buckets[PT_BUILDER_BUCKETS];
    double cell_min[3], cell; // of the grid of places, 8 a side
    uint16_t level_first[PT_BUILDER_LEVELS];
    int placed;    // the grid is known
    char *waiting; // records that came before it was
    uint64_t waiting_count, waiting_room;
    double box_min[3], box_max[3];
    uint64_t count, drawn, invalid_positions;
    atomic_uint wide_colors; // bits: some is above 255, some has a low byte, some a low byte unlike its high one
    atomic_uint nonzero;     // bits: fields of which some point has a byte that is not zero
    char *records;           // of the batch at hand
    double (*places)[3];
    uint16_t *targets; // buckets
    int failed, ended;
};

// Descriptor of records as arrays.
void pt_builder_view(const struct patina_builder *builder, const char *records, uint64_t count, patina_cloud_desc *desc);
uint32_t pt_builder_level_first(uint32_t level); // of its buckets; of PT_BUILDER_LEVELS: behind the last
uint32_t pt_builder_cell(const double p[3], const double cell_min[3], double cell, uint32_t bits); // Morton code in a cube
void pt_builder_extend(struct pt_bucket *bucket, const double p[3]);
uint64_t pt_builder_slot_bytes(const struct patina_builder *builder); // of a point in the file
int pt_builder_drain(struct patina_builder *builder);                 // places what waits
int pt_builder_fail(struct patina_builder *builder, int error);       // tells what the system said

#endif
