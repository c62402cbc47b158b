// SPDX-License-Identifier: GPL-3.0-or-later
#include "pool.h"

#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdlib.h>

// A frame is a few dozen short parallel steps: waking a sleeping thread costs 50 us each time, so both sides look for
// work a while (some 30 us) before they sleep. Not where threads outnumber cores.
enum { MAX_THREADS = 256, SPINS = 2000 };

// Every thread has a range of its own, the same in every step of a frame with as many items: what it wrote it reads again,
// from its own caches. A thread that is done takes from the others' ranges.
struct range {
    _Alignas(64) atomic_uint next;
    uint32_t end;
};

struct job {
    pt_work *work;
    void *context;
    uint32_t grain, ranges;
    struct range *range;
};

struct pt_pool {
    pthread_mutex_t lock;
    pthread_mutex_t caller; // one pt_parallel at a time
    pthread_cond_t wake, done;
    struct job *job;
    struct range *ranges; // one a thread
    _Atomic uint64_t generation;
    atomic_uint running; // helpers still in the current job
    uint32_t spins;
    uint32_t threads, batch;
    int quit;
    pthread_t helpers[MAX_THREADS];
    uint32_t started;
};

struct helper_start {
    struct pt_pool *pool;
    uint32_t thread;
};

static void take_part(struct job *job, uint32_t thread)
{
    for (uint32_t k = 0; k < job->ranges; k++) {
        struct range *range = &job->range[(thread + k) % job->ranges];
        for (;;) {
            uint32_t begin = atomic_fetch_add_explicit(&range->next, job->grain, memory_order_relaxed);
            if (begin >= range->end)
                break;
            job->work(job->context, begin, range->end - begin < job->grain ? range->end : begin + job->grain, thread);
        }
    }
}

static void pause_a_moment(void)
{
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#else
    sched_yield();
#endif
}

static void *helper_main(void *argument)
{
    struct helper_start start = *(struct helper_start *)argument;
    free(argument);
    struct pt_pool *pool = start.pool;
    uint64_t seen = 0;
    for (;;) {
        for (uint32_t i = 0; i < pool->spins && atomic_load_explicit(&pool->generation, memory_order_acquire) == seen; i++)
            pause_a_moment();
        pthread_mutex_lock(&pool->lock);
        while (!pool->quit && pool->generation == seen)
            pthread_cond_wait(&pool->wake, &pool->lock);
        if (pool->quit)
            break;
        seen = pool->generation;
        struct job *job = pool->job;
        pthread_mutex_unlock(&pool->lock);
        take_part(job, start.thread);
        pthread_mutex_lock(&pool->lock);
        if (atomic_fetch_sub(&pool->running, 1) == 1)
            pthread_cond_signal(&pool->done);
        pthread_mutex_unlock(&pool->lock);
    }
    pthread_mutex_unlock(&pool->lock);
    return NULL;
}

static uint32_t core_count(void)
{
    cpu_set_t set;
    if (sched_getaffinity(0, sizeof set, &set) == 0)
        return (uint32_t)CPU_COUNT(&set);
    return 1;
}

struct pt_pool *pt_pool_create(uint32_t threads, uint32_t batch)
{
    struct pt_pool *pool = calloc(1, sizeof *pool);
    if (!pool)
        return NULL;
    pool->threads = threads ? threads : core_count();
    if (pool->threads > MAX_THREADS)
        pool->threads = MAX_THREADS;
    pool->batch = batch;
    pool->ranges = aligned_alloc(_Alignof(struct range), pool->threads * sizeof *pool->ranges);
    if (!pool->ranges) {
        free(pool);
        return NULL;
    }
    pool->spins = pool->threads <= core_count() ? SPINS : 0;
    pthread_mutex_init(&pool->lock, NULL);
    pthread_mutex_init(&pool->caller, NULL);
    pthread_cond_init(&pool->wake, NULL);
    pthread_cond_init(&pool->done, NULL);
    for (uint32_t i = 1; i < pool->threads; i++) {
        struct helper_start *start = malloc(sizeof *start);
        if (start)
            *start = (struct helper_start){ pool, i };
        if (!start || pthread_create(&pool->helpers[pool->started], NULL, helper_main, start)) {
            free(start);
            pt_pool_destroy(pool);
            return NULL;
        }
        pool->started++;
    }
    return pool;
}

void pt_pool_destroy(struct pt_pool *pool)
{
    if (!pool)
        return;
    pthread_mutex_lock(&pool->lock);
    pool->quit = 1;
    pthread_cond_broadcast(&pool->wake);
    pthread_mutex_unlock(&pool->lock);
    for (uint32_t i = 0; i < pool->started; i++)
        pthread_join(pool->helpers[i], NULL);
    pthread_cond_destroy(&pool->wake);
    pthread_cond_destroy(&pool->done);
    pthread_mutex_destroy(&pool->caller);
    pthread_mutex_destroy(&pool->lock);
    free(pool->ranges);
    free(pool);
}

uint32_t pt_pool_threads(const struct pt_pool *pool) { return pool ? pool->threads : 1; }

void pt_parallel(struct pt_pool *pool, uint32_t items, uint32_t grain, pt_work *work, void *context)
{
    if (!items)
        return;
    if (!pool || pool->threads == 1) {
        work(context, 0, items, 0);
        return;
    }
    if (pool->batch)
        grain = pool->batch;
    if (!grain)
        grain = items / (4 * pool->threads);
    // next runs past its end by up to threads * grain; keep that from wrapping
    uint32_t most = UINT32_MAX / (2 * pool->threads);
    grain = grain < 1 ? 1 : grain > most ? most : grain;
    struct job job = { work, context, grain, pool->threads, pool->ranges };
    pthread_mutex_lock(&pool->caller);
    for (uint32_t t = 0; t < pool->threads; t++) {
        atomic_init(&pool->ranges[t].next, (uint32_t)((uint64_t)items * t / pool->threads));
        pool->ranges[t].end = (uint32_t)((uint64_t)items * (t + 1) / pool->threads);
    }
    if (items > grain) {
        pthread_mutex_lock(&pool->lock);
        pool->job = &job;
        pool->running = pool->started;
        pool->generation++;
        pthread_cond_broadcast(&pool->wake);
        pthread_mutex_unlock(&pool->lock);
        take_part(&job, 0);
        for (uint32_t i = 0; i < pool->spins && atomic_load_explicit(&pool->running, memory_order_acquire); i++)
            pause_a_moment();
        pthread_mutex_lock(&pool->lock);
        while (pool->running)
            pthread_cond_wait(&pool->done, &pool->lock);
        pthread_mutex_unlock(&pool->lock);
    } else {
        take_part(&job, 0);
    }
    pthread_mutex_unlock(&pool->caller);
}
