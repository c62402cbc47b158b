// SPDX-License-Identifier: GPL-3.0-or-later
// platform.h on Linux and macOS; what they do not share is in platform_linux.c and platform_macos.c.
#include "platform.h"
#include "guard.h"

#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <locale.h>
#ifdef __APPLE__
#include <xlocale.h>
#endif
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <time.h>
#include <unistd.h>

// ---- threads -----------------------------------------------------------------------------------------------------------

_Static_assert(sizeof(pthread_mutex_t) <= sizeof(struct pt_mutex) && _Alignof(pthread_mutex_t) <= 8, "room of a mutex");
_Static_assert(sizeof(pthread_cond_t) <= sizeof(struct pt_condition) && _Alignof(pthread_cond_t) <= 8, "room of a condition");
_Static_assert(sizeof(pthread_t) <= sizeof(struct pt_thread) && _Alignof(pthread_t) <= 8, "room of a thread");

static pthread_mutex_t *mutex_of(struct pt_mutex *mutex) { return (pthread_mutex_t *)(void *)mutex->room; }
static pthread_cond_t *condition_of(struct pt_condition *condition) { return (pthread_cond_t *)(void *)condition->room; }

void pt_mutex_init(struct pt_mutex *mutex) { pthread_mutex_init(mutex_of(mutex), NULL); }
void pt_mutex_destroy(struct pt_mutex *mutex) { pthread_mutex_destroy(mutex_of(mutex)); }
void pt_mutex_lock(struct pt_mutex *mutex) { pthread_mutex_lock(mutex_of(mutex)); }
void pt_mutex_unlock(struct pt_mutex *mutex) { pthread_mutex_unlock(mutex_of(mutex)); }

void pt_condition_init(struct pt_condition *condition) { pthread_cond_init(condition_of(condition), NULL); }
void pt_condition_destroy(struct pt_condition *condition) { pthread_cond_destroy(condition_of(condition)); }
void pt_condition_wait(struct pt_condition *condition, struct pt_mutex *mutex)
{
    pthread_cond_wait(condition_of(condition), mutex_of(mutex));
}
void pt_condition_wake_one(struct pt_condition *condition) { pthread_cond_signal(condition_of(condition)); }
void pt_condition_wake_all(struct pt_condition *condition) { pthread_cond_broadcast(condition_of(condition)); }

struct start {
    void (*main)(void *context);
    void *context;
};

static void *thread_main(void *argument)
{
    struct start start = *(struct start *)argument;
    free(argument);
    start.main(start.context);
    return NULL;
}

int pt_thread_start(struct pt_thread *thread, void (*main)(void *context), void *context, size_t stack)
{
    static const int faults[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP, SIGABRT, SIGSYS};
    struct start *start = malloc(sizeof *start);
    pthread_attr_t attributes;
    sigset_t signals, before;
    if (!start || pthread_attr_init(&attributes)) {
        free(start);
        return ENOMEM;
    }
    *start = (struct start){main, context};
    if (stack)
        pthread_attr_setstacksize(&attributes, stack);
    sigfillset(&signals);
    for (size_t i = 0; i < sizeof faults / sizeof *faults; i++)
        sigdelset(&signals, faults[i]);
    pthread_sigmask(SIG_SETMASK, &signals, &before);
    int error = pthread_create((pthread_t *)(void *)thread->room, &attributes, thread_main, start);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    pthread_attr_destroy(&attributes);
    if (error)
        free(start);
    return error;
}

void pt_thread_join(struct pt_thread *thread) { pthread_join(*(pthread_t *)(void *)thread->room, NULL); }
void pt_thread_yield(void) { sched_yield(); }

void pt_pause(uint32_t milliseconds)
{
    const struct timespec time = {.tv_sec = milliseconds / 1000, .tv_nsec = milliseconds % 1000 * 1000000L};
    nanosleep(&time, NULL);
}

static sigset_t interrupts(void)
{
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGINT);
    sigaddset(&set, SIGTERM);
    return set;
}

// A thread that waits, rather than a handler: what it calls need not be async-signal-safe.
static void *watch(void *context)
{
    void (*interrupted)(void);
    memcpy(&interrupted, context, sizeof interrupted);
    free(context);
    const sigset_t set = interrupts();
    for (int caught;;)
        if (!sigwait(&set, &caught))
            interrupted();
    return NULL;
}

int pt_watch_interrupts(void (*interrupted)(void))
{
    const sigset_t set = interrupts();
    pthread_t thread;
    void *context = malloc(sizeof interrupted);
    if (!context)
        return ENOMEM;
    memcpy(context, &interrupted, sizeof interrupted);
    int error = pthread_sigmask(SIG_BLOCK, &set, NULL); // threads to come inherit it: the one that waits is told
    error = error ? error : pthread_create(&thread, NULL, watch, context);
    if (error) {
        free(context);
        return error;
    }
    return pthread_detach(thread);
}

// ---- time --------------------------------------------------------------------------------------------------------------

double pt_milliseconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return 1e3 * (double)now.tv_sec + 1e-6 * (double)now.tv_nsec;
}

// ---- memory ------------------------------------------------------------------------------------------------------------

enum { HUGE_PAGE = 2 << 20 };

// As the system has them: 4, 16 or 64 KiB on ARM. Rounded up any further, what is given back of a mapped file would be its neighbours'.
static size_t whole_pages(size_t size)
{
    const size_t page = (size_t)sysconf(_SC_PAGESIZE);
    return size ? (size + page - 1) / page * page : page;
}

// Whole huge pages inside are asked for as such; what is left over at the end stays small, so that none is wasted.
void *pt_pages_alloc(size_t size)
{
    size_t wanted = whole_pages(size), room = wanted < HUGE_PAGE ? wanted : wanted + HUGE_PAGE;
    if (size > SIZE_MAX / 2)
        return NULL;
    char *memory = mmap(NULL, room, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (memory == MAP_FAILED)
        return NULL;
    if (room == wanted)
        return memory;
    size_t before = (HUGE_PAGE - (uintptr_t)memory % HUGE_PAGE) % HUGE_PAGE, after = HUGE_PAGE - before;
    if (before)
        munmap(memory, before);
    if (after)
        munmap(memory + before + wanted, after);
#ifdef MADV_HUGEPAGE
    madvise(memory + before, wanted / HUGE_PAGE * HUGE_PAGE, MADV_HUGEPAGE); // a wish: ignored where the kernel has none
#endif
    return memory + before;
}

void *pt_pages_reserve(size_t size)
{
    void *memory = size > SIZE_MAX / 2 ? MAP_FAILED
                                       : mmap(NULL, whole_pages(size), PROT_READ | PROT_WRITE,
                                              MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (memory == MAP_FAILED)
        return NULL;
#ifdef MADV_NOHUGEPAGE
    madvise(memory, whole_pages(size), MADV_NOHUGEPAGE); // where they are huge unasked
#endif
    return memory;
}

int pt_pages_need(void *pages, size_t size) // all of it is there to be written to
{
    (void)pages;
    (void)size;
    return 0;
}

void pt_pages_forget(void *pages, size_t size)
{
    const uintptr_t page = (uintptr_t)sysconf(_SC_PAGESIZE), first = ((uintptr_t)pages + page - 1) / page * page,
                    end = ((uintptr_t)pages + size) / page * page;
#ifdef __APPLE__
    const int advice = MADV_FREE; // its own MADV_DONTNEED keeps them
#else
    const int advice = MADV_DONTNEED;
#endif
    if (end > first)
        madvise((void *)first, end - first, advice);
}

void pt_pages_free(void *pages, size_t size)
{
    if (!pages)
        return;
    pt_guard_remove(pages);
    munmap(pages, whole_pages(size));
}

// Whole pages around what is meant.
static void advise(void *pages, size_t size, int advice)
{
    const size_t page = (size_t)sysconf(_SC_PAGESIZE), before = (uintptr_t)pages % page;
    if (size)
        madvise((char *)pages - before, whole_pages(before + size), advice);
}

void pt_pages_return(void *pages, size_t size) { advise(pages, size, MADV_DONTNEED); }
void pt_pages_expect(void *pages, size_t size) { advise(pages, size, MADV_WILLNEED); }

// ---- files -------------------------------------------------------------------------------------------------------------

int pt_disk_open(const char *path, struct pt_disk *disk)
{
    struct stat status;
    int descriptor = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK); // a named pipe must not block
    if (descriptor < 0)
        return errno;
    if (fstat(descriptor, &status)) {
        int error = errno;
        close(descriptor);
        return error;
    }
    disk->handle = descriptor;
    disk->size = (uint64_t)status.st_size;
    disk->kind = S_ISREG(status.st_mode) ? PT_DISK_FILE : S_ISDIR(status.st_mode) ? PT_DISK_FOLDER : PT_DISK_OTHER;
    return 0;
}

void pt_disk_close(struct pt_disk *disk) { close((int)disk->handle); }

int pt_disk_read(const struct pt_disk *disk, uint64_t offset, void *data, size_t size, size_t *got)
{
    for (*got = 0; *got < size;) {
        const ssize_t now = pread((int)disk->handle, (char *)data + *got, size - *got, (off_t)(offset + *got));
        if (now < 0 && errno == EINTR)
            continue;
        if (now < 0)
            return errno;
        if (!now)
            break;
        *got += (size_t)now;
    }
    return 0;
}

// ---- pages that cannot be read -------------------------------------------------------------------------------------------

static struct sigaction former; // the host's

static void widen(uintptr_t mapping, size_t mapping_size, uintptr_t *first, uintptr_t *end)
{
    (void)mapping, (void)mapping_size, (void)first, (void)end; // they are whole pages
}

// mmap is a system call and nothing more on these systems, so a handler may use it.
static int replace(uintptr_t first, size_t size, int written)
{
    return mmap((void *)first, whole_pages(size), PROT_READ | (written ? PROT_WRITE : 0),
                MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE | MAP_FIXED, -1, 0) != MAP_FAILED;
}

static const struct pt_guard_system guarding = {widen, replace};

enum { PASSED_ON = 0x50a7 }; // si_errno of a fault that we handed on; the system leaves it 0

// What is not ours is the former handler's, with the signals blocked that it asked for; without one it ends the process as it would without
// us, by the same instruction once more. So does a fault that the host hands back to us.
static void pass_on(int signal, siginfo_t *info, void *context)
{
    const int comes_back = info->si_errno == PASSED_ON, simple = !(former.sa_flags & SA_SIGINFO);
    if (comes_back || (simple && (former.sa_handler == SIG_DFL || former.sa_handler == SIG_IGN))) {
        sigaction(signal, &(struct sigaction){.sa_handler = SIG_DFL}, NULL);
        return;
    }
    sigset_t blocked = ((const ucontext_t *)context)->uc_sigmask;
    for (int other = 1; other < NSIG; other++)
        if (sigismember(&former.sa_mask, other) == 1)
            sigaddset(&blocked, other);
    if (!(former.sa_flags & SA_NODEFER))
        sigaddset(&blocked, signal);
    pthread_sigmask(SIG_SETMASK, &blocked, NULL);
    info->si_errno = PASSED_ON;
    if (simple)
        former.sa_handler(signal);
    else
        former.sa_sigaction(signal, info, context);
}

static void on_fault(int signal, siginfo_t *info, void *context)
{
    const int error = errno;
    if (info->si_code <= 0 || !pt_guard_fault((uintptr_t)info->si_addr, &guarding)) // 0 and below: another process sent it
        pass_on(signal, info, context);
    errno = error;
}

void pt_disk_watch(void)
{
    struct sigaction now, ours = {.sa_flags = SA_SIGINFO | SA_ONSTACK};
    if (sigaction(SIGBUS, NULL, &now) || (now.sa_flags & SA_SIGINFO && now.sa_sigaction == on_fault))
        return;
    former = now;
    ours.sa_sigaction = on_fault;
    sigfillset(&ours.sa_mask); // nothing interrupts the handler
    sigaction(SIGBUS, &ours, NULL);
}

// The library goes: so does its handler, where it is still the first.
__attribute__((destructor)) static void end_watch(void)
{
    struct sigaction now;
    if (!sigaction(SIGBUS, NULL, &now) && now.sa_flags & SA_SIGINFO && now.sa_sigaction == on_fault)
        sigaction(SIGBUS, &former, NULL);
}

int pt_disk_map(const struct pt_disk *disk, uint64_t offset, size_t size, enum pt_disk_use use, void **data)
{
    const int written = use == PT_DISK_SHARED;
    pt_disk_watch();
    *data = mmap(NULL, size, PROT_READ | (written ? PROT_WRITE : 0), written ? MAP_SHARED : MAP_PRIVATE, (int)disk->handle,
                 (off_t)offset);
    if (*data == MAP_FAILED) {
        *data = NULL;
        return errno;
    }
    const int error = pt_guard_add(*data, size, written);
    if (error) {
        munmap(*data, whole_pages(size));
        *data = NULL;
    } else if (use == PT_DISK_ONCE) {
        madvise(*data, size, MADV_SEQUENTIAL);
    }
    return error;
}

int pt_disk_spill(const char *path, struct pt_disk *disk)
{
    static const char ending[] = ".spill";
    const size_t length = strlen(path);
    char *name = malloc(length + sizeof ending);
    if (!name)
        return ENOMEM;
    memcpy(name, path, length);
    memcpy(name + length, ending, sizeof ending);
    int descriptor, error = 0;
    for (int i = 0; i < 100; i++) { // another process may be between its opening and its removing of the name
        descriptor = open(name, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
        error = descriptor < 0 ? errno : 0;
        if (error == EEXIST)
            unlink(name);
        else
            break;
    }
    if (!error)
        unlink(name);
    free(name);
    *disk = (struct pt_disk){.handle = descriptor, .kind = PT_DISK_FILE};
    return error;
}

int pt_disk_reserve(struct pt_disk *disk, uint64_t size)
{
#ifdef __APPLE__
    fstore_t wanted = {.fst_flags = F_ALLOCATEALL, .fst_posmode = F_PEOFPOSMODE, .fst_length = (off_t)size};
    int error = fcntl((int)disk->handle, F_PREALLOCATE, &wanted) < 0 ? errno : 0;
    if (!error && ftruncate((int)disk->handle, (off_t)size))
        error = errno;
#else
    int error;
    do
        error = posix_fallocate((int)disk->handle, 0, (off_t)size);
    while (error == EINTR);
#endif
    disk->size = error ? disk->size : size;
    return error;
}

int pt_disk_write(struct pt_disk *disk, uint64_t offset, const void *data, size_t size)
{
    for (size_t done = 0; done < size;) {
        const ssize_t now = pwrite((int)disk->handle, (const char *)data + done, size - done, (off_t)(offset + done));
        if (now < 0 && errno == EINTR)
            continue;
        if (now <= 0)
            return now < 0 ? errno : ENOSPC;
        done += (size_t)now;
    }
    disk->size = disk->size > offset + size ? disk->size : offset + size;
    return 0;
}

int pt_disk_room(const char *path, uint64_t *bytes)
{
    const char *slash = strrchr(path, '/');
    const size_t length = slash ? (size_t)(slash - path) + 1 : 0;
    char *folder = malloc(length + 2);
    struct statvfs status;
    if (!folder)
        return ENOMEM;
    memcpy(folder, length ? path : ".", length ? length : 1);
    folder[length ? length : 1] = 0;
    const int error = statvfs(folder, &status) ? errno : 0;
    free(folder);
    *bytes = error ? 0 : (uint64_t)status.f_bavail * status.f_frsize;
    return error;
}

FILE *pt_stream_open(const char *path, const char *mode)
{
#ifdef __APPLE__ // which knows no "e" before 13
    FILE *stream = fopen(path, mode);
    if (stream)
        fcntl(fileno(stream), F_SETFD, FD_CLOEXEC);
    return stream;
#else
    char closed[8]; // with "e": close it where another program is started
    snprintf(closed, sizeof closed, "%se", mode);
    return fopen(path, closed);
#endif
}

int pt_stream_seek(FILE *stream, uint64_t offset) { return fseeko(stream, (off_t)offset, SEEK_SET) ? errno : 0; }

int pt_stream_resize(FILE *stream, uint64_t size)
{
    return fflush(stream) || ftruncate(fileno(stream), (off_t)size) ? errno : 0;
}

int pt_file_remove(const char *path) { return unlink(path) ? errno : 0; }

// ---- files that are there whole or not at all -----------------------------------------------------------------------------

// Names beside the file, so that several may write it at a time.
enum { SLOTS = 9 };

static void name_slot(const struct pt_whole *whole, int slot)
{
    const size_t length = strlen(whole->path);
    memcpy(whole->beside, whole->path, length);
    memcpy(whole->beside + length, slot ? ".part0" : ".part", slot ? 7 : 6);
    if (slot)
        whole->beside[length + 5] = (char)('1' + slot);
}

// Opens and locks what lies beside; EWOULDBLOCK where another process, or thread, writes it.
static int take_slot(const struct pt_whole *whole, int flags, int *descriptor)
{
    struct stat held, named;
    for (;;) {
        *descriptor = open(whole->beside, O_RDWR | O_CLOEXEC | flags, 0666);
        if (*descriptor < 0)
            return errno;
        const int taken = flock(*descriptor, LOCK_EX | LOCK_NB) ? errno : 0;
        if (taken != EWOULDBLOCK && !fstat(*descriptor, &held) && !stat(whole->beside, &named) && held.st_dev == named.st_dev &&
            held.st_ino == named.st_ino)
            return 0; // disks that know no locks: one builds at a time, as everywhere before
        close(*descriptor);
        if (taken == EWOULDBLOCK)
            return taken;
    }
}

// Deletes the files that pt_whole_steps names for the slot in whole->beside.
static void remove_steps(const struct pt_whole *whole)
{
    static const char *const endings[] = {"", ".part"};
    const size_t length = strlen(whole->beside), room = length + 32;
    char *name = malloc(room);
    for (int i = 0; name && i < PT_WHOLE_STEPS; i++)
        for (int k = 0; k < 2; k++) {
            snprintf(name, room, "%s%s%s", whole->beside, pt_whole_steps[i], endings[k]);
            unlink(name);
        }
    free(name);
}

// Deletes what processes left beside the file that no longer write it.
static void remove_left(const struct pt_whole *whole, int own)
{
    int descriptor;
    for (int slot = 0; slot < SLOTS; slot++) {
        name_slot(whole, slot);
        if (slot != own && !take_slot(whole, 0, &descriptor)) {
            remove_steps(whole);
            unlink(whole->beside);
            close(descriptor);
        }
    }
    name_slot(whole, own);
    remove_steps(whole);
}

int pt_whole_begin(const char *path, struct pt_whole *whole)
{
    const size_t length = strlen(path);
    struct stat status;
    *whole = (struct pt_whole){0};
    if (!stat(path, &status) && !S_ISREG(status.st_mode)) // never in the place of a folder or a device
        return S_ISDIR(status.st_mode) ? EISDIR : EINVAL;
    char *names = malloc(2 * length + 1 + sizeof ".part0");
    if (!names)
        return ENOMEM;
    whole->path = memcpy(names, path, length + 1);
    whole->beside = names + length + 1;
    int descriptor = -1, error = EWOULDBLOCK, slot = 0;
    for (; slot < SLOTS && error == EWOULDBLOCK; slot++) {
        name_slot(whole, slot);
        error = take_slot(whole, O_CREAT, &descriptor);
    }
    if (!error) {
        remove_left(whole, slot - 1);
        whole->lock = fcntl(descriptor, F_DUPFD_CLOEXEC, 0);
        error = whole->lock < 0 || ftruncate(descriptor, 0) ? errno : 0;
        whole->stream = error ? NULL : fdopen(descriptor, "wb");
        if (whole->stream) {
            errno = 0; // of what is written from now on
            return 0;
        }
        error = error ? error : errno;
        close(descriptor);
    }
    free(names);
    return error == EWOULDBLOCK ? EBUSY : error;
}

int pt_file_replace(const char *path, const char *by) { return rename(by, path) ? errno : 0; }

int pt_whole_end(struct pt_whole *whole, int good)
{
    int error = good ? 0 : errno ? errno : EIO;
    if (fclose(whole->stream) && !error)
        error = errno;
    if (!error)
        error = pt_file_replace(whole->path, whole->beside);
    if (error)
        pt_file_remove(whole->beside);
    close((int)whole->lock); // nobody else took the name before
    free(whole->path);
    return error;
}

// ---- libraries ---------------------------------------------------------------------------------------------------------

void *pt_library_open(const char *name) { return dlopen(name, RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE); }
void *pt_library_find(void *library, const char *function) { return dlsym(library, function); }
void pt_library_close(void *library)
{
    if (library)
        dlclose(library);
}

// ---- numbers and programs ----------------------------------------------------------------------------------------------

static struct pt_once c_locale_made;
static locale_t c_locale;

static void make_c_locale(void) { c_locale = newlocale(LC_ALL_MASK, "C", (locale_t)0); } // the system's own: it cannot fail

double pt_decimal(const char *text)
{
    pt_once(&c_locale_made, make_c_locale);
    return strtod_l(text, NULL, c_locale);
}

int pt_program_begin(int *count, char ***arguments)
{
    (void)count, (void)arguments;
    return 0;
}
