// SPDX-License-Identifier: GPL-3.0-or-later
// What base/platform.h promises, whatever the system is.
#include "base/platform.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "folder.h" // behind cmocka.h

#include <errno.h>
#include <locale.h>
#include <stdlib.h>
#include <string.h>
#ifdef _WIN32
#include <windows.h>
#undef far
#else
#include <pthread.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>
#endif

enum { THREADS = 8, ROUNDS = 2000 };

static char folder[512];

// ---- what a test asks of the system beyond platform.h -------------------------------------------------------------------

#ifdef _WIN32
static const wchar_t *wide(const char *path)
{
    static wchar_t text[1024];
    wcscpy(text, L"\\\\?\\");
    MultiByteToWideChar(CP_UTF8, 0, path, -1, text + 4, 1000);
    for (wchar_t *at = text; *at; at++)
        *at = *at == '/' ? '\\' : *at;
    return text;
}
static int make_folder(const char *path) { return !CreateDirectoryW(wide(path), NULL); }
static void remove_folder(const char *path) { RemoveDirectoryW(wide(path)); }
static int choose_folder(void)
{
    wchar_t temporary[256];
    GetTempPathW(256, temporary);
    WideCharToMultiByte(CP_UTF8, 0, temporary, -1, folder, 300, NULL, NULL);
    char *name = folder + strlen(folder);
    int taken = 1;
    for (int i = 0; i < 100 && taken; i++) { // a killed process may have left one, whose number comes again
        snprintf(name, 64, "patina-platform-%lu-%d", (unsigned long)GetCurrentProcessId(), i);
        taken = make_folder(folder);
    }
    return taken;
}
static int takes_signals(void) { return 0; }
static const char mathematics[] = "ucrtbase.dll";
#else
static int make_folder(const char *path) { return mkdir(path, 0700); }
static void remove_folder(const char *path) { rmdir(path); }
static int choose_folder(void)
{
    strcpy(folder, "/tmp/patina-platform-XXXXXX");
    return !mkdtemp(folder);
}
static int takes_signals(void)
{
    sigset_t blocked;
    pthread_sigmask(SIG_SETMASK, NULL, &blocked);
    // its own fault it takes: the host's handler tells of it
    return !sigismember(&blocked, SIGINT) || !sigismember(&blocked, SIGCHLD) || sigismember(&blocked, SIGSEGV);
}
static const char mathematics[] = "libm.so.6";
#endif

static const char *at(const char *name)
{
    static char path[2][1024];
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
    atomic_fetch_or(&shared.takes_signals, takes_signals());
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

// Of more than memory has room for, what is needed is there; what is forgotten, but for its first and last page, can be needed again.
static void test_reserve(void **state)
{
    (void)state;
    const size_t size = (size_t)1 << 38, far = size / 3 + 5, some = 100000;
    unsigned char *pages = pt_pages_reserve(size);
    assert_non_null(pages);
    for (int turn = 0; turn < 3; turn++) {
        assert_int_equal(pt_pages_need(pages + far, some), 0);
        assert_int_equal(pt_pages_need(pages + size - 1, 1), 0);
        for (size_t i = 0; i < some && !turn; i++)
            if (pages[far + i])
                fail_msg("byte %zu is not 0", i);
        memset(pages + far, 1, some);
        pages[size - 1] = 2;
        assert_int_equal(pt_pages_need(pages + far + some / 2, some), 0); // again, and more
        pages[far + some + some / 2 - 1] = 3;
        assert_int_equal(pages[far] + pages[far + some - 1], 2);
        pt_pages_forget(pages + far + 7, some - 14);
        assert_int_equal(pages[far + 6] + pages[far + some - 7] + pages[size - 1], 4);
        assert_int_equal(pages[far + some + some / 2 - 1], 3);
    }
    assert_int_equal(pt_pages_need(pages, 0), 0);
    pt_pages_free(pages, size);
    assert_null(pt_pages_reserve(SIZE_MAX));
    unsigned char *none = pt_pages_reserve(0);
    assert_non_null(none);
    pt_pages_free(none, 0);
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
#ifdef _WIN32
    assert_int_equal(pt_disk_open("NUL", &disk), 0);
#else
    assert_int_equal(mkfifo(at("pipe"), 0600), 0);
    assert_int_equal(pt_disk_open(at("pipe"), &disk), 0); // nobody writes to it
#endif
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
    pt_disk_close(&disk); // what is mapped stays
    assert_memory_equal(mapped, "0123456789", 10);
    pt_pages_free(mapped, 10);
}

// What is given back of a mapped file is no page of those beside it, however large the system's pages are.
static void test_map_among_pages(void **state)
{
    (void)state;
    enum { COUNT = 8, SIZE = 70000 };
    struct pt_disk disk;
    unsigned char *pages[COUNT];
    void *maps[COUNT];
    write_text(at("small"), "0123456789");
    assert_int_equal(pt_disk_open(at("small"), &disk), 0);
    for (int i = 0; i < COUNT; i++) {
        assert_int_equal(pt_disk_map(&disk, 0, 10, i % 2 ? PT_DISK_ANYWHERE : PT_DISK_ONCE, &maps[i]), 0);
        pages[i] = pt_pages_alloc(SIZE);
        assert_non_null(pages[i]);
        memset(pages[i], i + 1, SIZE);
    }
    pt_disk_close(&disk);
    for (int i = 0; i < COUNT; i++)
        pt_pages_free(maps[i], 10);
    for (int i = 0; i < COUNT; i++) {
        for (int k = 0; k < SIZE; k++)
            assert_int_equal(pages[i][k], i + 1);
        pt_pages_free(pages[i], SIZE);
    }
}

// What is given back of a mapped file is held no longer, and is there again when it is read; so is what was expected. Its neighbours in
// the same file stay.
static void test_returned(void **state)
{
    (void)state;
    enum { SIZE = 32 << 20, PART = 1 << 20 };
    unsigned char *bytes = pt_pages_alloc(SIZE);
    struct pt_disk disk;
    void *mapped;
    uint64_t sum = 0, again = 0;
    for (int i = 0; i < SIZE; i++)
        bytes[i] = (unsigned char)(i >> 8 ^ i >> 16);
    FILE *stream = pt_stream_open(at("returned"), "wb");
    assert_int_equal(fwrite(bytes, SIZE, 1, stream), 1);
    assert_int_equal(fclose(stream), 0);
    assert_int_equal(pt_disk_open(at("returned"), &disk), 0);
    assert_int_equal(pt_disk_map(&disk, 0, SIZE, PT_DISK_ANYWHERE, &mapped), 0);
    pt_disk_close(&disk);
    const volatile unsigned char *read = mapped;
    pt_pages_expect(mapped, SIZE);
    pt_pages_expect((char *)mapped + 5, 3 * PART);
    const uint64_t before = pt_file_memory();
    for (int i = 0; i < SIZE; i += 64)
        sum += read[i];
    const uint64_t held = pt_file_memory();
    pt_pages_return((char *)mapped + 7, 0);
    pt_pages_return((char *)mapped + 7, SIZE - PART);
    const uint64_t after = pt_file_memory();
    printf("  %.1f MB before, %.1f held, %.1f after; %.1f free\n", 1e-6 * (double)before, 1e-6 * (double)held,
           1e-6 * (double)after, 1e-6 * (double)pt_free_memory());
    if (before) { // where the system tells
        assert_true(held >= before + SIZE - 2 * PART);
        if (returned_goes_at_once())
            assert_true(after <= held - (SIZE - 4 * PART));
    }
    assert_true(pt_free_memory() == 0 || pt_free_memory() > SIZE);
    for (int i = 0; i < SIZE; i += 64)
        again += read[i];
    assert_true(sum == again && sum > 0);
    assert_memory_equal(mapped, bytes, SIZE);
    pt_pages_free(mapped, SIZE);
    pt_pages_free(bytes, SIZE);
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
    struct pt_disk disk;
    assert_int_equal(pt_whole_begin(folder, &whole), EISDIR);
    assert_int_equal(pt_whole_begin(at("no folder/file"), &whole), ENOENT);
    write_text(at("kept"), "old");
    assert_int_equal(pt_whole_begin(at("kept"), &whole), 0);
    fputs("ne", whole.stream);
    assert_text(at("kept"), "old");
    assert_int_not_equal(pt_whole_end(&whole, 0), 0); // it was not written whole
    assert_text(at("kept"), "old");
    assert_int_equal(pt_disk_open(at("kept.part"), &disk), ENOENT);
    assert_int_equal(pt_whole_begin(at("kept"), &whole), 0);
    fputs("new", whole.stream);
    assert_int_equal(pt_whole_end(&whole, 1), 0);
    assert_text(at("kept"), "new");
    assert_int_equal(pt_disk_open(at("kept.part"), &disk), ENOENT);
}

static void write_whole(const char *path, const char *text, int expected)
{
    struct pt_whole whole;
    assert_int_equal(pt_whole_begin(path, &whole), 0);
    fputs(text, whole.stream);
    assert_int_equal(pt_whole_end(&whole, 1), expected);
}

// The file that is to be replaced is mapped, as a linked cloud's is while it is shown.
static void test_mapped(void **state)
{
    (void)state;
    struct pt_disk disk;
    void *mapped;
    write_text(at("mapped"), "old");
    assert_int_equal(pt_disk_open(at("mapped"), &disk), 0);
    assert_int_equal(pt_disk_map(&disk, 0, 3, PT_DISK_ANYWHERE, &mapped), 0);
    pt_disk_close(&disk);
#ifdef _WIN32 // which says so, and nothing is lost
    char text[128];
    write_whole(at("mapped"), "new", EBUSY);
    assert_text(at("mapped"), "old");
    assert_string_equal(pt_error_text(EBUSY, text, sizeof text), "another program holds the file open");
#else
    write_whole(at("mapped"), "new", 0);
    assert_text(at("mapped"), "new");
#endif
    assert_memory_equal(mapped, "old", 3);
    assert_int_equal(pt_disk_open(at("mapped.part"), &disk), ENOENT);
    pt_pages_free(mapped, 3);
    write_whole(at("mapped"), "newer", 0);
    assert_text(at("mapped"), "newer");
    assert_int_equal(pt_file_remove(at("mapped")), 0);
    assert_int_equal(pt_file_remove(at("mapped")), ENOENT);
}

#ifdef _WIN32
static void test_held(void **state)
{
    (void)state;
    struct pt_disk disk;
    write_text(at("held"), "old");
    const HANDLE holder = CreateFileW(wide(at("held")), GENERIC_READ, FILE_SHARE_READ, NULL, OPEN_EXISTING, 0, NULL);
    assert_true(holder != INVALID_HANDLE_VALUE);
    write_whole(at("held"), "new", EBUSY);
    assert_text(at("held"), "old");
    assert_int_equal(pt_disk_open(at("held.part"), &disk), ENOENT);
    assert_int_equal(pt_file_remove(at("held")), EBUSY);
    CloseHandle(holder);
    const HANDLE lone = CreateFileW(wide(at("held")), GENERIC_READ, 0, NULL, OPEN_EXISTING, 0, NULL);
    assert_int_equal(pt_disk_open(at("held"), &disk), EBUSY);
    CloseHandle(lone);
    assert_int_equal(pt_file_remove(at("held")), 0);
}
#endif

// Letters of many scripts, blanks, and 300 of them: more than Windows takes unasked.
static void test_paths(void **state)
{
    (void)state;
    char deep[1024], part[3][1024], name[151];
    struct pt_disk disk;
    memset(name, 'n', sizeof name - 1);
    name[sizeof name - 1] = 0;
    strcat(strcpy(part[0], folder), "/Scans été");
    for (int i = 1; i < 3; i++)
        strcat(strcat(strcpy(part[i], part[i - 1]), "/"), name);
    strcat(strcpy(deep, part[2]), "/测试.ply");
    assert_true(strlen(deep) > 310);
    for (int i = 0; i < 3; i++)
        assert_int_equal(make_folder(part[i]), 0);
    write_text(deep, "text");
    write_whole(deep, "whole", 0);
    assert_text(deep, "whole");
    assert_int_equal(pt_disk_open(part[2], &disk), 0);
    assert_int_equal(disk.kind, PT_DISK_FOLDER);
    pt_disk_close(&disk);
    assert_int_equal(pt_file_remove(deep), 0);
    assert_int_equal(pt_disk_open(deep, &disk), ENOENT);
    for (int i = 2; i >= 0; i--)
        remove_folder(part[i]);
#ifdef _WIN32
    assert_int_equal(pt_disk_open("\xff\xfe", &disk), EINVAL); // no UTF-8
    assert_int_equal(pt_disk_open("", &disk), ENOENT);
#endif
}

static void test_decimal(void **state)
{
    (void)state;
    static const char *const commas[] = {"de_DE.UTF-8", "fr_FR.UTF-8", "de_DE.utf8", "de-DE", "German"};
    size_t i = 0;
    while (i < sizeof commas / sizeof *commas && !setlocale(LC_NUMERIC, commas[i]))
        i++;
    if (i == sizeof commas / sizeof *commas)
        print_message("no locale with decimal commas here: numbers are read in C's\n");
    else
        assert_true(strtod("0.5", NULL) == 0.0); // or else it would show nothing
    assert_true(pt_decimal("1234.5e-1") == 123.45);
    setlocale(LC_NUMERIC, "C");
}

static void test_library(void **state)
{
    (void)state;
    assert_null(pt_library_open("libthere-is-none.so"));
    void *library = pt_library_open(mathematics);
    assert_non_null(library);
    assert_non_null(pt_library_find(library, "cos"));
    assert_null(pt_library_find(library, "there_is_no_such_function"));
    pt_library_close(library);
    pt_library_close(NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_threads),      cmocka_unit_test(test_machine), cmocka_unit_test(test_pages),
        cmocka_unit_test(test_reserve),      cmocka_unit_test(test_disk),    cmocka_unit_test(test_map_among_pages),
        cmocka_unit_test(test_large_stream), cmocka_unit_test(test_whole),   cmocka_unit_test(test_decimal),
        cmocka_unit_test(test_library),      cmocka_unit_test(test_mapped),  cmocka_unit_test(test_paths),
        cmocka_unit_test(test_returned),
#ifdef _WIN32
        cmocka_unit_test(test_held),
#endif
    };
    if (choose_folder())
        return 1;
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    for (const char *const *name = (const char *const[]){"pipe", "été 测试", "small", "large", "kept", "returned", NULL}; *name;
         name++)
        pt_file_remove(at(*name));
    remove_folder(folder);
    return failed;
}
