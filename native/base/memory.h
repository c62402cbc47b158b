// SPDX-License-Identifier: GPL-3.0-or-later
// Large arrays come straight from the kernel: they go back to it when freed, and huge pages halve a scatter's TLB misses.
#ifndef PT_MEMORY_H
#define PT_MEMORY_H

#include <stddef.h>

// Zeroed, page-aligned. NULL when memory lacks. size 0 gives a valid pointer.
void *pt_pages_alloc(size_t size);
void pt_pages_free(void *pages, size_t size); // NULL is fine; size as allocated

#endif
