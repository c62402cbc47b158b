// SPDX-License-Identifier: GPL-3.0-or-later
// What a picture holds of clouds whose files are mapped (SPEC 13): no more than a cap. Where they are larger, passes over points run in
// rounds, and whenever more is held than there should be, all of it is given back.
#ifndef PT_PAGER_H
#define PT_PAGER_H

#include "base/look.h"
#include "late_sieve.h"

struct pt_pager {
    struct patina_device *device;
    const struct patina_scene *scene;
    uint64_t cap;    // 0: all of it fits
    uint64_t round;  // bytes that a round reads at most
    uint64_t before; // pt_file_memory with nothing held
    struct pt_look look;
    _Atomic uint64_t held; // most
    atomic_uint returned;
    uint64_t mapped, read;
    uint32_t rounds;
    uint64_t losses;              // of mapped files, as far as was looked
    uint32_t lost;                // pages of the scene's clouds that were known to be lost then
    int merged;                   // parts' keys stand for those of passes that write least keys, which do not run
    const atomic_int *cancel;     // NULL: nothing stops it
    struct pt_late_sieve *sieves; // of the plan at hand, for the pass that reads their words
};

// Pages that are read for the first time are looked at: what begins, opens and runs may return PT_AGAIN (page_check.h).
// Before anything is planned: notes which pages are lost.
void pt_pager_prepare(struct pt_pager *pager, const struct patina_scene *scene);
// Finds the cap: the device's, or of the memory that is free. PATINA_ERROR_MEMORY, with its message at the device, where this copies
// clouds and they exceed a cap that was given. What was counted goes on.
int pt_pager_open(struct pt_pager *pager, struct patina_device *device, const struct patina_scene *scene);
void pt_pager_close(struct pt_pager *pager);
// After something was read of clouds: PT_AGAIN where pages that cannot be read any more were found since the last look, for they were read
// as zeros, and the picture is to be planned anew, without them; else PATINA_OK.
int pt_pager_lose(struct pt_pager *pager);
// Before the plan runs: a device that copies clouds in ranges reads what its passes walk, which is looked at here.
int pt_pager_begin(struct pt_pager *pager, const struct pt_plan *plan);
// The same of one of its passes; part: of its share of the chunks, NULL: of all.
int pt_pager_begin_pass(struct pt_pager *pager, const struct pt_plan *plan, const struct pt_pass *pass,
                        const patina_part *part);
// The cap that a picture of the scene would have, and how much a round of it reads; 0: all of it fits.
uint64_t pt_pager_cap(const struct patina_device *device, const struct patina_scene *scene, uint64_t *round);

// Runs a pass whose buffers are bound, in rounds where it takes any. *lists: what the caller bound, where it is not what was planned.
// The context may be copied: a sieve that one pass alone reads runs with that pass.
int pt_pager_run(struct pt_pager *pager, const struct pt_plan *plan, const struct pt_pass *pass,
                 struct pt_buffer *const *buffers, pt_run_bound *run, void *context, size_t context_size);

#endif
