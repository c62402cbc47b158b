// SPDX-License-Identifier: GPL-3.0-or-later
// All that is asked of the operating system: threads, time, memory, files, libraries, the machine. platform_windows.c, or
// platform_posix.c with platform_linux.c or platform_macos.c; platform.c is of all. No other file of native/ includes a system's
// header (build/check_rooms). Paths are UTF-8, of any length that the system can have at all. Errors are numbers of <errno.h>, 0 is
// none. Any function from any thread, unless it says otherwise.
#ifndef PT_PLATFORM_H
#define PT_PLATFORM_H

#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

// ---- threads -----------------------------------------------------------------------------------------------------------

// Room for what the system has; it must not move once made.
struct pt_mutex {
    _Alignas(8) unsigned char room[64];
};
struct pt_condition {
    _Alignas(8) unsigned char room[64];
};
struct pt_thread {
    _Alignas(8) unsigned char room[16];
};

void pt_mutex_init(struct pt_mutex *mutex);
void pt_mutex_destroy(struct pt_mutex *mutex); // that nobody holds
void pt_mutex_lock(struct pt_mutex *mutex);    // not twice by one thread
void pt_mutex_unlock(struct pt_mutex *mutex);  // by the thread that locked it

void pt_condition_init(struct pt_condition *condition);
void pt_condition_destroy(struct pt_condition *condition);                      // that nobody waits for
void pt_condition_wait(struct pt_condition *condition, struct pt_mutex *mutex); // may return without a cause: ask again
void pt_condition_wake_one(struct pt_condition *condition);
void pt_condition_wake_all(struct pt_condition *condition);

void pt_thread_yield(void);
void pt_pause(uint32_t milliseconds); // at least; the thread sleeps

// For what is made at its first use: zero before. The others wait until `make` has returned.
struct pt_once {
    atomic_int state;
};
static inline void pt_once(struct pt_once *once, void (*make)(void))
{
    enum { NOT_YET, BEING_MADE, MADE };
    int seen = NOT_YET;
    if (atomic_load_explicit(&once->state, memory_order_acquire) == MADE)
        return;
    if (atomic_compare_exchange_strong(&once->state, &seen, BEING_MADE)) {
        make();
        atomic_store_explicit(&once->state, MADE, memory_order_release);
    } else {
        while (atomic_load_explicit(&once->state, memory_order_acquire) != MADE)
            pt_thread_yield();
    }
}

// Starts main(context) on a thread that takes no signals: they belong to the host program; those of its own faults it takes.
// stack: bytes, 0: the system's default. Whoever starts it joins it.
int pt_thread_start(struct pt_thread *thread, void (*main)(void *context), void *context, size_t stack);
void pt_thread_join(struct pt_thread *thread);

// From now on calls `interrupted` on a thread of its own each time that somebody asks the program to end (Ctrl-C, SIGTERM).
// Only for programs, before they start any thread.
int pt_watch_interrupts(void (*interrupted)(void));

// ---- the machine -------------------------------------------------------------------------------------------------------

double pt_milliseconds(void); // of a clock that only goes forward
uint32_t pt_core_count(void); // that this process may use, at least 1
// What vector instructions the processor has and the system keeps; each of x86 has those before it.
enum pt_vectors { PT_VECTORS_NONE, PT_VECTORS_SSE42, PT_VECTORS_AVX2, PT_VECTORS_AVX512, PT_VECTORS_NEON };
enum pt_vectors pt_processor_vectors(void);
void pt_processor_name(char *text, size_t size); // as its maker calls it; "processor" where that is not known
uint64_t pt_peak_memory(void);                   // most bytes that this process ever held; 0: not known
uint64_t pt_free_memory(void);                   // bytes that this process may yet take; 0: not known
uint64_t pt_file_memory(void); // bytes of mapped files that this process holds at the moment, or of all; 0: not known
const char *pt_error_text(int error, char *buffer, size_t size); // buffer: where the text may lie

// ---- memory ------------------------------------------------------------------------------------------------------------

// Large arrays come straight from the system: they go back to it when freed, and huge pages halve a scatter's TLB misses.
// Zeroed, page-aligned. NULL when memory lacks. size 0 gives a valid pointer.
void *pt_pages_alloc(size_t size);
// The same for arrays that are filled here and there: no more is taken than what is written to. What is needed is asked for before anything
// reads or writes it: Windows promises memory for that alone, other systems for all there is. Any part of an array, as often as one likes;
// returns ENOMEM where memory lacks. What is forgotten goes back to the system, but for what shares a page with its neighbours, must be
// needed again, and holds anything then.
void *pt_pages_reserve(size_t size);
int pt_pages_need(void *pages, size_t size);
void pt_pages_forget(void *pages, size_t size);
void pt_pages_free(void *pages,
                   size_t size); // of pt_pages_alloc, pt_pages_reserve or pt_disk_map, NULL is fine; size as asked for
// Of pt_disk_map, shared or never written. What is returned is held no longer, and comes again from the file when it is read (macOS: it
// goes first when memory lacks); others may read and write it meanwhile. What is expected is read soon: the disk may begin. Any part of a mapping.
void pt_pages_return(void *pages, size_t size);
void pt_pages_expect(void *pages, size_t size);

// ---- files -------------------------------------------------------------------------------------------------------------

enum pt_disk_kind { PT_DISK_FILE, PT_DISK_FOLDER, PT_DISK_OTHER };

// A file that is read where it lies.
struct pt_disk {
    intptr_t handle;
    uint64_t size; // bytes, as it was opened
    enum pt_disk_kind kind;
};

int pt_disk_open(const char *path, struct pt_disk *disk); // folders and pipes open too, and never block
void pt_disk_close(struct pt_disk *disk);                 // what is mapped stays
// Less than `size` bytes come at the file's end alone.
int pt_disk_read(const struct pt_disk *disk, uint64_t offset, void *data, size_t size, size_t *got);
// Pages of the file; they go back by pt_pages_free. They can be read alone, so that no system sets memory aside for them, but for
// PT_DISK_SHARED, of a spill. What cannot be read any more, for another process cut the file short or its disk is gone, reads as zeros
// (guard.h). offset: a multiple of 64 KiB; size: not 0.
enum pt_disk_use { PT_DISK_ONCE, PT_DISK_ANYWHERE, PT_DISK_SHARED }; // read once from end to end; here and there; written too
int pt_disk_map(const struct pt_disk *disk, uint64_t offset, size_t size, enum pt_disk_use use, void **data);

// How often pages of mapped files became zeros, in the whole process: while it stays the same nothing was lost.
uint64_t pt_disk_losses(void);
// Whether some of these pages of a mapping of pt_disk_map became zeros.
int pt_pages_lost(const void *pages, size_t size);
// A host may have put a handler of its own before the library's since: takes its place, and hands it what is not the library's. Cheap.
void pt_disk_watch(void);

// A file without a name, for what memory has no room for: it goes with its handle, and with a process that is killed. path: a file that it
// lies on the same disk with. Read by pt_disk_read, by one thread at a time as long as somebody writes.
int pt_disk_spill(const char *path, struct pt_disk *disk);
int pt_disk_reserve(struct pt_disk *disk,
                    uint64_t size); // makes it so long, of zeros, and the disk has room for them: of an empty spill
int pt_disk_write(struct pt_disk *disk, uint64_t offset, const void *data, size_t size);
int pt_disk_room(const char *path, uint64_t *bytes); // that this user may yet write where the file lies, or would

FILE *pt_stream_open(const char *path, const char *mode); // as fopen; programs that are started do not inherit it
int pt_stream_seek(FILE *stream, uint64_t offset);
int pt_stream_resize(FILE *stream, uint64_t size); // cuts it, or adds zeros; what was written is with the system then

int pt_file_remove(const char *path);

// A file that is there whole or not at all: written beside `path`, then put in its place. A file that is mapped must not change.
// Several may write one file at a time, each beside: the last to end has it. What killed processes left beside it goes at the next begin.
// Windows: EBUSY, and the old file stays, while any program has it open or maps it.
struct pt_whole {
    FILE *stream; // what is written goes here
    char *path, *beside;
    intptr_t lock; // of the system's own
};
int pt_whole_begin(const char *path, struct pt_whole *whole); // an error: there is nothing to end
// Endings of further files that whoever writes one may put beside `beside` meanwhile. He deletes them; if he is killed, the next begin does.
enum { PT_WHOLE_STEPS = 3 };
static const char *const pt_whole_steps[PT_WHOLE_STEPS] = {".built", ".analysed", ".smaller"};
// good: all was written, so the file takes its place. By the thread that wrote. Returns the error that kept it from doing so.
int pt_whole_end(struct pt_whole *whole, int good);
// Puts a file in another's place, which is one or the other at any time. Returns an error as above.
int pt_file_replace(const char *path, const char *by);

// ---- libraries ---------------------------------------------------------------------------------------------------------

void *pt_library_open(const char *name); // NULL: there is none. It stays loaded: drivers do not survive being unloaded
void *pt_library_find(void *library, const char *function);
void pt_library_close(void *library); // NULL is fine

// ---- numbers and programs ----------------------------------------------------------------------------------------------

double pt_decimal(const char *text); // strtod with a decimal point, whatever the process's locale is

// First in main(): its arguments as UTF-8, and what it prints as other systems print it. They stay as long as the program runs.
int pt_program_begin(int *count, char ***arguments);

#endif
