// SPDX-License-Identifier: GPL-3.0-or-later
#include "pool.h"
#include "platform.h"

#include <stdatomic.h>
#include <stdlib.h>

// A frame is a few dozen short parallel steps: waking a sleeping thread costs 50 us each time, so both sides look for
// work a while (some 100 us: longer than a plan takes) before they sleep. Not where threads outnumber cores.
enum { MAX_THREADS = 256, SPINS = 6000 };

// Every thread has a range of its own, the same in every step of a frame with as many items: what it wrote it reads again,
// from its own caches. A thread that is done takes the latter half of what another has left, so that both go on in one piece:
// rows that follow each other cost less than rows here and there.
struct range {
    _Alignas(64) _Atomic uint64_t span; // next | end << 32; an item that has left it never comes back
};

static uint64_t span_of(uint32_t next, uint32_t end) { return (uint64_t)end << 32 | next; }
static uint32_t span_next(uint64_t span) { return (uint32_t)span; }
static uint32_t span_end(uint64_t span) { return (uint32_t)(span >> 32); }
static uint32_t span_left(uint64_t span) { return span_next(span) < span_end(span) ? span_end(span) - span_next(span) : 0; }

struct job { // on the caller's stack, on a line that the caller's own variables do not lie on
    _Alignas(64) pt_work *work;
    void *context;
    uint32_t grain, ranges;
    struct range *range;
    struct pt_pool *pool;
};

// Who is awake joins and leaves a job without the lock, which sixteen threads would queue for at each of a hundred steps. It is for those
// who sleep: who is about to says so first and then looks once more, and who has news tells it first and then looks for sleepers.
struct pt_pool {
    struct pt_mutex lock;
    struct pt_mutex caller; // one pt_parallel at a time
    struct pt_condition wake, done;
    struct job *job;                          // the latest
    struct range *ranges;                     // one a thread
    _Alignas(64) _Atomic uint64_t generation; // of the job
    _Alignas(64) atomic_uint inside;          // OPEN: helpers may join the job; and how many have and are not done
    _Alignas(64) atomic_uint asleep;          // helpers
    atomic_int waits;                         // the caller sleeps until nobody is inside
    atomic_int quit;
    uint32_t spins;
    uint32_t threads, batch;
    uint64_t steps;              // of work on several threads: under `caller`
    void (*look)(void *context); // NULL: nobody watches
    void *watched;
    struct pt_thread helpers[MAX_THREADS];
    uint32_t started;
};

enum { OPEN = 1 << 30 }; // of inside

struct helper_start {
    struct pt_pool *pool;
    uint32_t thread;
};

// Up to a grain from the front of the thread's own range; 0 when it is empty.
static int take(struct job *job, uint32_t thread, uint32_t *begin, uint32_t *end)
{
    _Atomic uint64_t *own = &job->range[thread].span;
    uint64_t span = atomic_load_explicit(own, memory_order_relaxed);
    do {
        if (!span_left(span))
            return 0;
        *begin = span_next(span);
        *end = *begin + (span_left(span) < job->grain ? span_left(span) : job->grain);
    } while (!atomic_compare_exchange_weak_explicit(own, &span, span_of(*end, span_end(span)), memory_order_relaxed,
                                                    memory_order_relaxed));
    return 1;
}

// Fills the thread's own range, which is empty, from the longest; 0 when all are empty.
static int steal(struct job *job, uint32_t thread)
{
    for (;;) {
        uint64_t most = 0;
        uint32_t victim = thread;
        for (uint32_t t = 0; t < job->ranges; t++) {
            uint64_t span = atomic_load_explicit(&job->range[t].span, memory_order_relaxed);
            victim = span_left(span) > span_left(most) ? t : victim;
            most = span_left(span) > span_left(most) ? span : most;
        }
        if (!span_left(most))
            return 0;
        uint32_t left = span_left(most), middle = span_end(most) - (left <= job->grain ? left : left / 2);
        uint64_t expected = most;
        if (!atomic_compare_exchange_strong_explicit(&job->range[victim].span, &expected, span_of(span_next(most), middle),
                                                     memory_order_relaxed, memory_order_relaxed))
            continue;
        atomic_store_explicit(&job->range[thread].span, span_of(middle, span_end(most)), memory_order_relaxed);
        return 1;
    }
}

static void take_part(struct job *job, uint32_t thread)
{
    uint32_t begin, end;
    do {
        while (take(job, thread, &begin, &end)) {
            job->work(job->context, begin, end, thread);
            pt_pool_look(job->pool);
        }
    } while (steal(job, thread));
}

static void pause_a_moment(void)
{
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#else
    pt_thread_yield();
#endif
}

// Until there is a job behind the one seen.
static void await_job(struct pt_pool *pool, uint64_t seen)
{
    for (uint32_t i = 0; i < pool->spins; i++) {
        if (atomic_load_explicit(&pool->generation, memory_order_acquire) != seen)
            return;
        pause_a_moment();
    }
    pt_mutex_lock(&pool->lock);
    atomic_fetch_add(&pool->asleep, 1);
    while (!atomic_load(&pool->quit) && atomic_load(&pool->generation) == seen)
        pt_condition_wait(&pool->wake, &pool->lock);
    atomic_fetch_sub(&pool->asleep, 1);
    pt_mutex_unlock(&pool->lock);
}

static int join(struct pt_pool *pool)
{
    uint32_t inside = atomic_load(&pool->inside);
    while (inside & OPEN)
        if (atomic_compare_exchange_weak(&pool->inside, &inside, inside + 1))
            return 1;
    return 0;
}

static void leave(struct pt_pool *pool)
{
    if (atomic_fetch_sub(&pool->inside, 1) != 1 || !atomic_load(&pool->waits))
        return;
    pt_mutex_lock(&pool->lock);
    pt_condition_wake_one(&pool->done);
    pt_mutex_unlock(&pool->lock);
}

static void helper_main(void *argument)
{
    struct helper_start start = *(struct helper_start *)argument;
    free(argument);
    struct pt_pool *pool = start.pool;
    for (uint64_t seen = 0; !atomic_load(&pool->quit);) {
        await_job(pool, seen);
        seen = atomic_load(&pool->generation);
        if (!join(pool))
            continue;
        take_part(pool->job, start.thread);
        leave(pool);
    }
}

struct pt_pool *pt_pool_create(uint32_t threads, uint32_t batch)
{
    struct pt_pool *pool = pt_pages_alloc(sizeof *pool); // aligned, and zeros
    if (!pool)
        return NULL;
    pool->threads = threads ? threads : pt_core_count();
    if (pool->threads > MAX_THREADS)
        pool->threads = MAX_THREADS;
    pool->batch = batch;
    pool->ranges = pt_pages_alloc(pool->threads * sizeof *pool->ranges);
    if (!pool->ranges) {
        pt_pages_free(pool, sizeof *pool);
        return NULL;
    }
    pool->spins = pool->threads <= pt_core_count() ? SPINS : 0;
    pt_mutex_init(&pool->lock);
    pt_mutex_init(&pool->caller);
    pt_condition_init(&pool->wake);
    pt_condition_init(&pool->done);
    for (uint32_t i = 1; i < pool->threads; i++) {
        struct helper_start *start = malloc(sizeof *start);
        if (start)
            *start = (struct helper_start){pool, i};
        if (!start || pt_thread_start(&pool->helpers[pool->started], helper_main, start, 0)) {
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
    pt_mutex_lock(&pool->lock);
    atomic_store(&pool->quit, 1);
    pt_condition_wake_all(&pool->wake);
    pt_mutex_unlock(&pool->lock);
    for (uint32_t i = 0; i < pool->started; i++)
        pt_thread_join(&pool->helpers[i]);
    pt_condition_destroy(&pool->wake);
    pt_condition_destroy(&pool->done);
    pt_mutex_destroy(&pool->caller);
    pt_mutex_destroy(&pool->lock);
    pt_pages_free(pool->ranges, pool->threads * sizeof *pool->ranges);
    pt_pages_free(pool, sizeof *pool);
}

void pt_pool_watch(struct pt_pool *pool, void (*look)(void *context), void *context)
{
    pool->watched = context;
    pool->look = look;
}

void pt_pool_look(struct pt_pool *pool)
{
    if (pool && pool->look)
        pool->look(pool->watched);
}

uint32_t pt_pool_threads(const struct pt_pool *pool) { return pool ? pool->threads : 1; }

static void open_job(struct pt_pool *pool, struct job *job)
{
    pool->job = job;
    atomic_store(&pool->inside, OPEN);
    atomic_fetch_add(&pool->generation, 1);
    if (!atomic_load(&pool->asleep))
        return;
    pt_mutex_lock(&pool->lock);
    pt_condition_wake_all(&pool->wake);
    pt_mutex_unlock(&pool->lock);
}

// Who still sleeps is not waited for: nothing is left to do.
static void close_job(struct pt_pool *pool)
{
    atomic_fetch_and(&pool->inside, ~(uint32_t)OPEN);
    for (uint32_t i = 0; i < pool->spins; i++) {
        if (!atomic_load_explicit(&pool->inside, memory_order_acquire))
            return;
        pause_a_moment();
    }
    pt_mutex_lock(&pool->lock);
    // An exchange: who leaves must not miss it, and emulators of ARM let a load behind a plain store go first.
    atomic_exchange(&pool->waits, 1);
    while (atomic_load(&pool->inside))
        pt_condition_wait(&pool->done, &pool->lock);
    atomic_store(&pool->waits, 0);
    pt_mutex_unlock(&pool->lock);
}

uint64_t pt_pool_steps(const struct pt_pool *pool) { return pool ? pool->steps : 0; }

void pt_parallel(struct pt_pool *pool, uint32_t items, uint32_t grain, pt_work *work, void *context)
{
    if (!items)
        return;
    if (!pool || (pool->threads == 1 && !pool->look)) {
        work(context, 0, items, 0);
        return;
    }
    if (pool->batch)
        grain = pool->batch;
    if (!grain)
        grain = items / (4 * pool->threads);
    grain = grain < 1 ? 1 : grain;
    struct job job = {work, context, grain, pool->threads, pool->ranges, pool};
    pt_mutex_lock(&pool->caller);
    for (uint32_t t = 0; t < pool->threads; t++)
        atomic_store_explicit(
            &pool->ranges[t].span,
            span_of((uint32_t)((uint64_t)items * t / pool->threads), (uint32_t)((uint64_t)items * (t + 1) / pool->threads)),
            memory_order_relaxed);
    if (items > grain) {
        pool->steps++;
        open_job(pool, &job);
        take_part(&job, 0);
        close_job(pool);
    } else {
        take_part(&job, 0);
    }
    pt_mutex_unlock(&pool->caller);
}
