// SPDX-License-Identifier: GPL-3.0-or-later
// Sieves that wait for the one pass that reads their words. Of clouds in files larger than the cap, scatter leaves out chunks that nearer
// points hide. A sieve that ran before it would read what it looks at of all chunks in view. So it runs on each round's chunks alone.
#ifndef PT_LATE_SIEVE_H
#define PT_LATE_SIEVE_H

#include "plan/rounds.h"

typedef int pt_run_bound(void *context, struct pt_buffer *const *buffers);

struct pt_late_sieve {
    struct pt_late_sieve *next;
    const struct pt_plan *plan;
    const struct pt_pass *pass;
    pt_run_bound *run;
    void *context;            // its own copy
    struct pt_buffer **bound; // its own copy
};

// Returns whether a pass is a sieve whose words one pass alone reads, which writes least keys of points and runs in rounds.
int pt_sieve_waits(const struct pt_plan *plan, const struct pt_pass *pass);
// Adds a sieve to the list; copies the context and what is bound. 0 or PATINA_ERROR_MEMORY.
int pt_sieve_keep(struct pt_late_sieve **list, const struct pt_plan *plan, const struct pt_pass *pass,
                  struct pt_buffer *const *bound, pt_run_bound *run, const void *context, size_t context_size);
// The sieve of the instance whose chunks reference `ref` of a pass is; NULL: there is none.
struct pt_late_sieve *pt_sieve_of(struct pt_late_sieve *list, const struct pt_plan *plan, const struct pt_pass *pass,
                                  uint32_t ref);
// Adds the arrays of files that a sieve reads to the list of chunks that it runs on.
void pt_sieve_join(const struct pt_late_sieve *sieve, struct pt_chunk_list *list);
// Runs a sieve on these chunks.
int pt_sieve_run(const struct pt_late_sieve *sieve, struct pt_buffer *chunks);
void pt_sieve_drop(struct pt_late_sieve **list, struct pt_late_sieve *sieve);
void pt_sieves_free(struct pt_late_sieve **list);

#endif
