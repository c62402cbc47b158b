// SPDX-License-Identifier: GPL-3.0-or-later
#include "memory.h"

#include <sys/mman.h>

void *pt_pages_alloc(size_t size)
{
    size = size ? size : 1;
    void *pages = mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (pages == MAP_FAILED)
        return NULL;
    if (size >= (size_t)4 << 20)
        madvise(pages, size, MADV_HUGEPAGE); // a wish: ignored where the kernel has none
    return pages;
}

void pt_pages_free(void *pages, size_t size)
{
    if (pages)
        munmap(pages, size ? size : 1);
}
