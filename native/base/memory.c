// SPDX-License-Identifier: GPL-3.0-or-later
#include "memory.h"

#include <stdint.h>
#include <sys/mman.h>

enum { PAGE = 4096, HUGE_PAGE = 2 << 20 };

static size_t whole_pages(size_t size) { return size ? (size + PAGE - 1) / PAGE * PAGE : PAGE; }

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
    madvise(memory + before, wanted / HUGE_PAGE * HUGE_PAGE, MADV_HUGEPAGE); // a wish: ignored where the kernel has none
    return memory + before;
}

void pt_pages_free(void *pages, size_t size)
{
    if (pages)
        munmap(pages, whole_pages(size));
}
