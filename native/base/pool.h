// SPDX-License-Identifier: GPL-3.0-or-later
// A thread pool of our own (no OpenMP runtime on farm nodes). Results never depend on the number of threads or the
// batch: items write disjoint outputs or commute.
#ifndef PT_POOL_H
#define PT_POOL_H

#include <stdint.h>

struct pt_pool;

// threads = 0: one per core available to the process; batch = 0: automatic. NULL when memory or threads lack.
struct pt_pool *pt_pool_create(uint32_t threads, uint32_t batch);

// What to ask pt_pool_create for when work over so many points is not told how many threads to take: one where starting more
// takes longer than they save, so that callers with many small clouds can work on several at once.
static inline uint32_t pt_pool_threads_for(uint32_t threads, uint64_t points)
{
    return threads || points >= 1 << 14 ? threads : 1;
}
void pt_pool_destroy(struct pt_pool *pool);
uint32_t pt_pool_threads(const struct pt_pool *pool); // the caller counts as one

uint64_t pt_pool_steps(const struct pt_pool *pool); // of work on several threads so far; while no work runs

// After each share of the work, and where the work says so, threads call look(context), several at once; NULL: nothing. While no work
// runs.
void pt_pool_watch(struct pt_pool *pool, void (*look)(void *context), void *context);
void pt_pool_look(struct pt_pool *pool); // for work that takes long; pool NULL is fine

// Calls work(context, begin, end, thread) until [0, items) is covered; thread < pt_pool_threads. Blocks. The calling
// thread takes part. grain: items a worker takes at once when the pool's batch is automatic (0 = items / (4 threads)).
// pool NULL: all in the calling thread.
typedef void pt_work(void *context, uint32_t begin, uint32_t end, uint32_t thread);
void pt_parallel(struct pt_pool *pool, uint32_t items, uint32_t grain, pt_work *work, void *context);

#endif
