// SPDX-License-Identifier: GPL-3.0-or-later
// Rounds: a pass over points on ranges of their chunks, one after another (SPEC 13).
#ifndef PT_ROUNDS_H
#define PT_ROUNDS_H

#include "plan.h"

// A list of chunks that a pass walks, in whole or in part, and of which arrays of their cloud.
struct pt_chunk_list {
    const struct patina_cloud *cloud;
    const struct chunk_view *chunks;
    uint32_t count;
    uint32_t arrays;  // bits 1 << pt_array
    uint32_t ref;     // of the pass: the chunks'
    uint32_t copied;  // bytes a slot that a device takes which copies clouds
    uint32_t culled;  // of the arrays those that only chunks with a cone to be tested are read of
    uint32_t each[2]; // bytes of files a slot: of other chunks, and of those
};

// From a chunk of a list up to another: `end` is not of it.
struct pt_chunk_range {
    uint32_t list, chunk, end_list, end_chunk;
    uint64_t bytes; // of files
};

// How many of `all` the shares of parts up to this one hold.
static inline uint64_t pt_share_before(const patina_part *part, uint64_t to, uint64_t all) { return all * to / part->of; }

// Whether the pass comes to the same by ranges of chunks in turn: it takes a minimum, or writes what belongs to its chunks alone.
int pt_pass_divides(const struct pt_pass *pass);
// What a pass is to those that divide a picture's points, over rounds or machines, and know no kernel.
enum pt_pass_role {
    PT_ROLE_NONE,    // pixels, or points that no other machine knows of
    PT_ROLE_SIEVE,   // which points of the chunks at hand are drawn
    PT_ROLE_KEYS,    // least keys of points, and nothing else
    PT_ROLE_SURFACE, // least keys of points, and what they show
};
enum pt_pass_role pt_pass_role(const struct pt_pass *pass);
// Of a pass whose role is PT_ROLE_KEYS: which of its references the keys are, and how many of them a row has.
uint32_t pt_pass_keys(const struct pt_pass *pass, uint32_t *width, uint32_t *height);
// Which of its references are the marks of the points that it looks at, of its one list; -1: it looks at all.
int pt_pass_marks(const struct pt_pass *pass);
// Whether it writes least keys of points.
static inline int pt_is_of_parts(const struct pt_pass *pass) { return pt_pass_role(pass) >= PT_ROLE_KEYS; }
// The lists of a pass, all their chunks; lists: room for as many as the pass has references. Returns how many.
uint32_t pt_pass_lists(const struct pt_plan *plan, const struct pt_pass *pass, struct pt_chunk_list *lists);
void pt_list_count_bytes(struct pt_chunk_list *list); // computes `each` from the arrays
static inline uint64_t pt_chunk_bytes(const struct pt_chunk_list *list, const struct chunk_view *chunk)
{
    return (uint64_t)chunk->padded * list->each[chunk->cull != 0];
}
// The next range, of no more bytes than `most` but of one chunk at least; 0: there is none. *range: the last one, or zero.
int pt_next_range(const struct pt_chunk_list *lists, uint32_t count, uint64_t most, struct pt_chunk_range *range);
// In how many of them a pass runs; *bytes: of all. 0 where it reads no file.
uint32_t pt_count_ranges(const struct pt_chunk_list *lists, uint32_t count, uint64_t most, uint64_t *bytes);
// The same on a device that copies clouds (slots.h): each list by itself, whatever kernel it is.
uint32_t pt_count_copies(const struct pt_chunk_list *lists, uint32_t count, uint64_t most, uint64_t *bytes);

#endif
