// SPDX-License-Identifier: GPL-3.0-or-later
// What base/platform.h promises, whatever the system is.
#include "base/platform.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <errno.h>
#include <locale.h>
#include <pthread.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { THREADS = 8, ROUNDS = 2000 };

static char folder[] = "/tmp/patina-platform-XXXXXX";

static const char *at(const char *name)
{
    static char path[2][128];
    static int turn;
    turn = !turn;
    snprintf(path[turn], sizeof path[turn], "%s/%s", folder, name);
    return path[turn];
}

static void write_text(const char *path, const char *text)
{
    FILE *file = pt_stream_open(path, "wb");
    assert_non_null(file);
    assert_int_equal(fputs(text, file) >= 0, 1);
    assert_int_equal(fclose(file), 0);
}

static void assert_text(const char *path, const char *text)
{
    char data[64];
    size_t got;
    struct pt_disk disk;
    assert_int_equal(pt_disk_open(path, &disk), 0);
    assert_int_equal(pt_disk_read(&disk, 0, data, sizeof data, &got), 0);
    pt_disk_close(&disk);
    assert_int_equal(got, strlen(text));
    assert_memory_equal(data, text, got);
}

// ---- threads -----------------------------------------------------------------------------------------------------------

static struct {
    struct pt_mutex lock;
    struct pt_condition changed;
    int turn, sum;
    atomic_int takes_signals, made_twice;
} shared;

static struct pt_once made_once;
static atomic_int made;

static void make(void)
{
    pt_thread_yield();
    atomic_fetch_add(&made, 1);
}

// Each in its turn, round after round.
static void take_turns(void *context)
{
    const int own = (int)(intptr_t)context;
    sigset_t blocked;
    pthread_sigmask(SIG_SETMASK, NULL, &blocked);
    atomic_fetch_or(&shared.takes_signals, !sigismember(&blocked, SIGINT) || !sigismember(&blocked, SIGCHLD));
    atomic_fetch_or(&shared.takes_signals, sigismember(&blocked, SIGSEGV)); // its own fault: the host's handler tells of it
    pt_once(&made_once, make);
    atomic_fetch_or(&shared.made_twice, atomic_load(&made) != 1);
    for (int i = 0; i < ROUNDS; i++) {
        pt_mutex_lock(&shared.lock);
        while (shared.turn != own)
            pt_condition_wait(&shared.changed, &shared.lock);
        shared.turn = (own + 1) % THREADS;
        shared.sum += own;
        pt_condition_wake_all(&shared.changed);
        pt_mutex_unlock(&shared.lock);
    }
}

static void test_threads(void **state)
{
    (void)state;
    struct pt_thread threads[THREADS];
    pt_mutex_init(&shared.lock);
    pt_condition_init(&shared.changed);
    for (int i = 0; i < THREADS; i++)
        assert_int_equal(pt_thread_start(&threads[i], take_turns, (void *)(intptr_t)i, i % 2 ? 1 << 20 : 0), 0);
    for (int i = 0; i < THREADS; i++)
        pt_thread_join(&threads[i]);
    assert_int_equal(shared.sum, ROUNDS * THREADS * (THREADS - 1) / 2);
    assert_int_equal(atomic_load(&shared.takes_signals), 0);
    assert_int_equal(atomic_load(&shared.made_twice), 0);
    pt_condition_destroy(&shared.changed);
    pt_mutex_destroy(&shared.lock);
}

static void test_machine(void **state)
{
    (void)state;
    char text[128];
    const double before = pt_milliseconds();
    pt_processor_name(text, sizeof text);
    assert_true(text[0] && !strchr(text, '\n'));
    assert_true(pt_core_count() >= 1);
    assert_true(pt_peak_memory() > 1 << 20);
    assert_true(pt_milliseconds() >= before);
    assert_string_equal(pt_error_text(ENOENT, text, sizeof text), strerror(ENOENT));
}

// ---- memory and files --------------------------------------------------------------------------------------------------

static void test_pages(void **state)
{
    (void)state;
    static const size_t sizes[] = {0, 1, 4096, 4097, 2 << 20, (2 << 20) + 1, 7 << 20};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        unsigned char *pages = pt_pages_alloc(sizes[i]);
        assert_non_null(pages);
        assert_int_equal((uintptr_t)pages % 4096, 0);
        for (size_t k = 0; k < sizes[i]; k++)
            if (pages[k])
                fail_msg("byte %zu of %zu is not 0", k, sizes[i]);
        memset(pages, 1, sizes[i]);
        pt_pages_free(pages, sizes[i]);
    }
    assert_null(pt_pages_alloc(SIZE_MAX));
    pt_pages_free(NULL, 0);
}

static void test_disk(void **state)
{
    (void)state;
    struct pt_disk disk;
    char data[8];
    size_t got;
    assert_int_equal(pt_disk_open(at("nothing"), &disk), ENOENT);
    assert_int_equal(pt_disk_open(folder, &disk), 0);
    assert_int_equal(disk.kind, PT_DISK_FOLDER);
    pt_disk_close(&disk);
    assert_int_equal(mkfifo(at("pipe"), 0600), 0);
    assert_int_equal(pt_disk_open(at("pipe"), &disk), 0); // nobody writes to it
    assert_int_equal(disk.kind, PT_DISK_OTHER);
    pt_disk_close(&disk);

    write_text(at("été 测试"), "0123456789");
    assert_int_equal(pt_disk_open(at("été 测试"), &disk), 0);
    assert_int_equal(disk.kind, PT_DISK_FILE);
    assert_int_equal(disk.size, 10);
    assert_int_equal(pt_disk_read(&disk, 4, data, sizeof data, &got), 0);
    assert_int_equal(got, 6);
    assert_memory_equal(data, "456789", 6);
    assert_int_equal(pt_disk_read(&disk, 10, data, sizeof data, &got), 0);
    assert_int_equal(got, 0);
    void *mapped;
    assert_int_equal(pt_disk_map(&disk, 0, 10, PT_DISK_ANYWHERE, &mapped), 0);
    pt_disk_close(&disk);
    memset(mapped, 'x', 10); // our copy
    assert_text(at("été 测试"), "0123456789");
    pt_pages_free(mapped, 10);
}

static void test_large_stream(void **state)
{
    (void)state;
    const uint64_t far = (5ull << 30) + 7; // with a hole before it
    char data[4];
    size_t got;
    struct pt_disk disk;
    FILE *stream = pt_stream_open(at("large"), "wb");
    assert_non_null(stream);
    assert_int_equal(pt_stream_seek(stream, far), 0);
    assert_int_equal(fwrite("far", 1, 3, stream), 3);
    assert_int_equal(pt_stream_resize(stream, far + 4), 0);
    assert_int_equal(fclose(stream), 0);
    assert_int_equal(pt_disk_open(at("large"), &disk), 0);
    assert_int_equal(disk.size, far + 4);
    assert_int_equal(pt_disk_read(&disk, far, data, sizeof data, &got), 0);
    assert_int_equal(got, 4);
    assert_memory_equal(data, "far", 4);
    pt_disk_close(&disk);
}

static void test_whole(void **state)
{
    (void)state;
    struct pt_whole whole;
    struct stat status;
    assert_int_equal(pt_whole_begin(folder, &whole), EISDIR);
    assert_int_equal(pt_whole_begin(at("no folder/file"), &whole), ENOENT);
    write_text(at("kept"), "old");
    assert_int_equal(pt_whole_begin(at("kept"), &whole), 0);
    fputs("ne", whole.stream);
    assert_text(at("kept"), "old");
    assert_int_not_equal(pt_whole_end(&whole, 0), 0); // it was not written whole
    assert_text(at("kept"), "old");
    assert_int_not_equal(stat(at("kept.part"), &status), 0);
    assert_int_equal(pt_whole_begin(at("kept"), &whole), 0);
    fputs("new", whole.stream);
    assert_int_equal(pt_whole_end(&whole, 1), 0);
    assert_text(at("kept"), "new");
    assert_int_not_equal(stat(at("kept.part"), &status), 0);
}

static void test_decimal(void **state)
{
    (void)state;
    static const char *const commas[] = {"de_DE.UTF-8", "fr_FR.UTF-8", "de_DE.utf8", "C"};
    for (size_t i = 0; i < sizeof commas / sizeof *commas && !setlocale(LC_NUMERIC, commas[i]); i++)
        ;
    assert_true(pt_decimal("1234.5e-1") == 123.45);
    setlocale(LC_NUMERIC, "C");
}

static void test_library(void **state)
{
    (void)state;
    assert_null(pt_library_open("libthere-is-none.so"));
    void *library = pt_library_open("libm.so.6");
    assert_non_null(library);
    assert_non_null(pt_library_find(library, "cos"));
    assert_null(pt_library_find(library, "there_is_no_such_function"));
    pt_library_close(library);
    pt_library_close(NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_threads), cmocka_unit_test(test_machine),      cmocka_unit_test(test_pages),
        cmocka_unit_test(test_disk),    cmocka_unit_test(test_large_stream), cmocka_unit_test(test_whole),
        cmocka_unit_test(test_decimal), cmocka_unit_test(test_library),
    };
    if (!mkdtemp(folder))
        return 1;
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    for (const char *const *name = (const char *const[]){"pipe", "été 测试", "large", "kept", NULL}; *name; name++)
        remove(at(*name));
    rmdir(folder);
    return failed;
}
