// SPDX-License-Identifier: GPL-3.0-or-later
// Pages of mapped files that cannot be read: the file was cut short, or its disk is gone. A read of such a page would end the process. Here
// it reads zeros instead, and the mapping remembers where (pt_pages_lost in platform.h).
//
// How: the system reports the fault to the thread that reads (POSIX: SIGBUS; Windows: EXCEPTION_IN_PAGE_ERROR). Where the address lies in a
// mapping of this library, the handler puts pages of zeros in its place and the thread goes on with the same instruction. Nothing is
// unwound, so the fault may happen in any thread, in any function, in a driver, and with locks held. Any other fault goes to the handler
// that the host installed before. Reading into owned pages instead would copy every byte, and the memory could not be given back to the
// system's cache of files.
//
// platform_posix.c and platform_windows.c install the handler. macOS was checked by reading alone: its kernel reports a page that it cannot
// read as SIGBUS with the address and a positive si_code, and mmap with MAP_FIXED may replace pages (of 16 KB on Apple's processors).
#ifndef PT_GUARD_H
#define PT_GUARD_H

#include <stddef.h>
#include <stdint.h>

// Watches a mapping. written: others may write it. Returns 0 or ENOMEM.
int pt_guard_add(void *pages, size_t size, int written);
// Before it is unmapped. Pages that nobody watches are fine.
void pt_guard_remove(void *pages);

// By the platform. Both may run in a handler.
struct pt_guard_system {
    // Widens [*first, *end) to what can be replaced of a mapping.
    void (*widen)(uintptr_t mapping, size_t mapping_size, uintptr_t *first, uintptr_t *end);
    // Puts zeros in the place of such a range. Returns 0 where that failed.
    int (*replace)(uintptr_t first, size_t size, int written);
};

// Called by the handler of a thread that could not read or write `address`. Returns 1: zeros are there now. 0: it is no page of ours.
// Allocates nothing, takes no lock that a thread outside of a handler holds.
int pt_guard_fault(uintptr_t address, const struct pt_guard_system *system);

#endif
