// SPDX-License-Identifier: GPL-3.0-or-later
// Clouds of more slots than kernels count (they gather by signed 32-bit indices) are made of parts: runs of its chunks, each a cloud to all
// that draws, with slots of its own. Arrays and the table of chunks are the whole's; a chunk's `first` counts from its part's first slot, so
// that of a cloud in parts nobody reads it but by its part. An ordinary cloud is its own only part.
#ifndef PT_PARTS_H
#define PT_PARTS_H

#include "cloud.h"

// Slots of a cloud that is no part and has none: 2^31 - 1 at most, or fewer where PATINA_PART_SLOTS says so, for tests; one chunk at least.
uint64_t pt_part_slots(void);
// Those that each part has at most of a cloud that has more than `most`. A picture's ids reach over all slots of a part between the first and
// the last that it sees (plan/ids.c): of smaller parts it sees fewer, and each has passes of its own. Pages, of which few are there, have parts
// of a quarter.
static inline uint64_t pt_part_share(uint64_t most) { return most < 1u << 28 ? most : 1u << 28; }

static inline uint32_t pt_part_count(const struct patina_cloud *cloud) { return cloud->part_count ? cloud->part_count : 1; }
static inline const struct patina_cloud *pt_part(const struct patina_cloud *cloud, uint32_t i)
{
    return cloud->part_count ? &cloud->parts[i] : cloud;
}

// Divides a cloud whose chunks and arrays stand into parts of at most so many slots, and counts their chunks' `first` anew. One that fits
// stays as it is. 0 or PATINA_ERROR_MEMORY (then it has no parts).
int pt_parts_make(struct patina_cloud *cloud, uint64_t most);
void pt_parts_destroy(struct patina_cloud *cloud);
// A part of so many of the whole's chunks, from there on, with the whole's arrays and a life of its own; its slots are the caller's to say.
// 0 or PATINA_ERROR_MEMORY.
int pt_part_begin(const struct patina_cloud *whole, uint32_t first_chunk, uint32_t chunks, uint64_t first_slot,
                  uint64_t first_number, struct patina_cloud *part);
// Parts take over what the whole has for arrays of points and says of them, which are others now.
void pt_parts_follow(struct patina_cloud *cloud);
// PATINA_ERROR_TOO_MANY_POINTS, with a message that names the call, of a cloud in parts: for calls that take none yet.
int pt_parts_refuse(const struct patina_cloud *cloud, const char *call);

#endif
