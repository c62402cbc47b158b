// SPDX-License-Identifier: GPL-3.0-or-later
#include "guard.h"
#include "platform.h"

#include <errno.h>
#include <stdatomic.h>
#include <stdlib.h>

// The first faults of a mapping replace a block each: a bad sector loses no more. Further ones replace twice as much each time, so that a
// file that went away costs some thirty faults and not one a page.
enum { BLOCK = 1 << 16, SINGLE = 4, MOST_DOUBLINGS = 24, RANGES = 40, ENTRIES = 128 };

struct lost {
    _Atomic uintptr_t first, end;
};

// A mapping; begin 0: the entry is free. Handlers read it without the lock, so it never goes.
struct entry {
    _Atomic uintptr_t begin;
    _Atomic size_t size;
    atomic_int written;
    atomic_flag busy; // a handler replaces pages
    atomic_uint faults, count;
    struct lost lost[RANGES];
};

struct block {
    struct block *_Atomic next;
    struct entry entries[ENTRIES];
};

static struct {
    atomic_flag adding; // one at a time, for a moment
    struct block first;
    _Atomic uint64_t losses;
} guard;

static struct entry *entry_of(uintptr_t address)
{
    for (struct block *block = &guard.first; block; block = atomic_load(&block->next))
        for (int i = 0; i < ENTRIES; i++) {
            const uintptr_t begin = atomic_load(&block->entries[i].begin);
            if (begin && address >= begin && address - begin < atomic_load(&block->entries[i].size))
                return &block->entries[i];
        }
    return NULL;
}

static struct entry *free_entry(void)
{
    struct block *block = &guard.first;
    for (;;) {
        for (int i = 0; i < ENTRIES; i++)
            if (!atomic_load(&block->entries[i].begin))
                return &block->entries[i];
        struct block *next = atomic_load(&block->next);
        if (!next) {
            if (!(next = calloc(1, sizeof *next)))
                return NULL;
            atomic_store(&block->next, next);
        }
        block = next;
    }
}

int pt_guard_add(void *pages, size_t size, int written)
{
    while (atomic_flag_test_and_set(&guard.adding))
        ;
    struct entry *entry = free_entry();
    if (entry) {
        atomic_store(&entry->count, 0);
        atomic_store(&entry->faults, 0);
        atomic_store(&entry->written, written);
        atomic_store(&entry->size, size);
        atomic_store(&entry->begin, (uintptr_t)pages);
    }
    atomic_flag_clear(&guard.adding);
    return entry ? 0 : ENOMEM;
}

void pt_guard_remove(void *pages)
{
    struct entry *entry = pages ? entry_of((uintptr_t)pages) : NULL;
    if (entry && atomic_load(&entry->begin) == (uintptr_t)pages)
        atomic_store(&entry->begin, 0);
}

static int lies_in(const struct entry *entry, uintptr_t first, uintptr_t end)
{
    const uint32_t count = atomic_load(&entry->count);
    for (uint32_t i = 0; i < count; i++)
        if (atomic_load(&entry->lost[i].first) < end && atomic_load(&entry->lost[i].end) > first)
            return 1;
    return 0;
}

// Where there are too many ranges, the last one grows over what lies between: more is lost than need be.
static int replace(struct entry *entry, uintptr_t address, const struct pt_guard_system *system)
{
    const uintptr_t begin = atomic_load(&entry->begin);
    const size_t size = atomic_load(&entry->size);
    const uint32_t faults = atomic_load(&entry->faults), doublings = faults < SINGLE ? 0 : faults - SINGLE + 1,
                   count = atomic_load(&entry->count), place = count < RANGES ? count : RANGES - 1;
    const size_t wanted = (size_t)BLOCK << (doublings < MOST_DOUBLINGS ? doublings : MOST_DOUBLINGS);
    struct lost *lost = &entry->lost[place];
    uintptr_t first = begin + (address - begin) / BLOCK * BLOCK,
              end = wanted < begin + size - first ? first + wanted : begin + size;
    // The block before, too: where a file was cut, the rest of its last page reads as zeros without a fault.
    first -= first > begin ? BLOCK : 0;
    if (count == RANGES) {
        const uintptr_t before = atomic_load(&lost->first), behind = atomic_load(&lost->end);
        first = before < first ? before : first;
        end = behind > end ? behind : end;
    }
    system->widen(begin, size, &first, &end);
    atomic_store(&lost->first, first); // before zeros are there: who has read some finds that they are
    atomic_store(&lost->end, end);
    atomic_store(&entry->count, place + 1);
    atomic_store(&entry->faults, faults + 1);
    atomic_fetch_add(&guard.losses, 1);
    return system->replace(first, end - first, atomic_load(&entry->written));
}

int pt_guard_fault(uintptr_t address, const struct pt_guard_system *system)
{
    struct entry *entry = entry_of(address);
    if (!entry)
        return 0;
    while (atomic_flag_test_and_set(&entry->busy)) // another handler, which calls nothing that could wait
        ;
    const int done = lies_in(entry, address, address + 1) ||
                     replace(entry, address, system); // another thread may have met it as well
    atomic_flag_clear(&entry->busy);
    return done;
}

uint64_t pt_disk_losses(void) { return atomic_load(&guard.losses); }

int pt_pages_lost(const void *pages, size_t size)
{
    if (!pages || !size || !pt_disk_losses())
        return 0;
    const struct entry *entry = entry_of((uintptr_t)pages);
    return entry && lies_in(entry, (uintptr_t)pages, (uintptr_t)pages + size);
}
