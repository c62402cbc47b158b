// SPDX-License-Identifier: GPL-3.0-or-later
// The pool: every item once, whatever the number of threads, grains and callers; a thread has one item at a time.
#include "base/pool.h"

#include <pthread.h>
#include <sched.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

enum { ITEMS = 997, MOST_THREADS = 5, ROUNDS = 400 };

struct count {
    uint32_t times[ITEMS];
    atomic_uint inside[MOST_THREADS], wrong; // calls of the thread that are under way
};

static void count_items(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct count *count = context;
    if (thread >= MOST_THREADS) {
        count->wrong++;
        return;
    }
    count->wrong += atomic_fetch_add(&count->inside[thread], 1) != 0;
    for (uint32_t i = begin; i < end; i++)
        count->times[i]++;
    if (begin % 7 == 0)
        sched_yield(); // a thread that stays behind
    atomic_fetch_sub(&count->inside[thread], 1);
}

static void *count_rounds(void *pool)
{
    static _Thread_local struct count count;
    memset(&count, 0, sizeof count);
    for (uint32_t round = 1; round <= ROUNDS; round++) {
        uint32_t items = 1 + round * 31 % ITEMS;
        memset(count.times, 0, sizeof count.times);
        pt_parallel(pool, items, round % 40, count_items, &count);
        for (uint32_t i = 0; i < ITEMS; i++)
            count.wrong += count.times[i] != (i < items);
    }
    return count.wrong ? "wrong" : NULL;
}

static void test_each_item_once(void **state)
{
    (void)state;
    for (uint32_t threads = 1; threads <= MOST_THREADS; threads++)
        for (uint32_t batch = 0; batch < 4; batch += 3) {
            struct pt_pool *pool = pt_pool_create(threads, batch);
            assert_non_null(pool);
            assert_int_equal(pt_pool_threads(pool), threads);
            assert_null(count_rounds(pool));
            pt_pool_destroy(pool);
        }
    assert_null(count_rounds(NULL)); // all in the calling thread
}

static void test_two_callers(void **state)
{
    (void)state;
    struct pt_pool *pool = pt_pool_create(3, 0);
    pthread_t other;
    void *wrong;
    assert_non_null(pool);
    assert_int_equal(pthread_create(&other, NULL, count_rounds, pool), 0);
    assert_null(count_rounds(pool));
    pthread_join(other, &wrong);
    assert_null(wrong);
    pt_pool_destroy(pool);
}

// A helper that sleeps while the caller does all the work finds nothing and harms nothing.
static void test_late_helpers(void **state)
{
    (void)state;
    struct pt_pool *pool = pt_pool_create(MOST_THREADS, 0);
    assert_non_null(pool);
    for (uint32_t round = 0; round < 20 * ROUNDS; round++) {
        struct count count = {.wrong = 0}; // gone when the next round begins
        pt_parallel(pool, 8, 1, count_items, &count);
        for (uint32_t i = 0; i < 8; i++)
            assert_int_equal(count.times[i], 1);
        assert_int_equal(count.wrong, 0);
    }
    pt_pool_destroy(pool);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_each_item_once),
        cmocka_unit_test(test_two_callers),
        cmocka_unit_test(test_late_helpers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
