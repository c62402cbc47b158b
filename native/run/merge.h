// SPDX-License-Identifier: GPL-3.0-or-later
// A picture whose points others have scattered (SPEC 12): the executor walks the plan as ever, and what its passes of points would
// write comes from the parts' files.
#ifndef PT_MERGE_H
#define PT_MERGE_H

#include "binder.h"
#include "key_file.h"

#include "plan/rounds.h"

struct pt_merge {
    const struct pt_handle *handle; // messages are there
    struct pt_key_file *files;      // by round, and in a round by part
    uint32_t count, of, rounds;
    uint64_t chain; // of all files: what the next round must have been told
    const char *next;
    uint32_t wanted;          // a round that is lacking: the execution ends with PATINA_ERROR_CANCELLED, and `next` is written
    struct pt_keys_name last; // that a pass took
};

// What of the scene no part can scatter, or NULL.
const char *pt_parts_refused(const struct patina_scene *scene, const struct pt_plan *plan);
// What a picture's keys follow from, in 64 bits: of a plan as it was made. Points count by their chunks.
uint64_t pt_parts_digest(const struct patina_scene *scene, const struct pt_plan *plan);
// Ids that keys of the plan's points may have lie below.
static inline uint64_t pt_parts_ids(const struct patina_scene *scene, const struct pt_plan *plan)
{
    return 2 * plan->ids.points + scene->triangles;
}
// Whose keys the pass's are; round: of the loops around a map.
struct pt_keys_name pt_parts_name(const struct pt_plan *plan, const struct pt_pass *pass, const struct pt_round *round);

// Opens the files and puts them in order; whether all of every round are there. chain and rounds are known then.
int pt_merge_open(struct pt_merge *merge, const struct pt_handle *handle, const char *const *paths, uint32_t count);
void pt_merge_close(struct pt_merge *merge);
// Whether the files are of this picture.
int pt_merge_begin(struct pt_merge *merge, const struct patina_scene *scene, const struct pt_plan *plan);
// In place of running the pass.
int pt_merge_take(struct pt_merge *merge, struct pt_binder *binder, const struct patina_scene *scene,
                  const struct pt_pass *pass, const struct pt_round *round);

#endif
