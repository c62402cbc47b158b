// SPDX-License-Identifier: GPL-3.0-or-later
#include "spill.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

int pt_spill_open(struct pt_spill *spill, const char *beside, uint32_t block)
{
    *spill = (struct pt_spill){.block = block};
    const int error = pt_disk_spill(beside, &spill->disk);
    spill->open = !error;
    return error;
}

void pt_spill_close(struct pt_spill *spill)
{
    if (spill->open)
        pt_disk_close(&spill->disk);
    free(spill->idle);
    *spill = (struct pt_spill){0};
}

static int grow(uint32_t **list, uint32_t *room)
{
    const uint32_t more = *room ? 2 * *room : 16;
    uint32_t *longer = realloc(*list, more * sizeof *longer);
    if (!longer)
        return ENOMEM;
    *list = longer;
    *room = more;
    return 0;
}

// Writes the buffer, which is the tape's last block.
static int flush(struct pt_spill *spill, struct pt_tape *tape)
{
    const uint64_t last = (uint64_t)(tape->count - 1) * spill->block;
    if (!spill->error)
        spill->error = pt_disk_write(&spill->disk, (uint64_t)tape->blocks[tape->count - 1] * spill->block, tape->buffer,
                                     (size_t)(tape->size - last));
    return spill->error;
}

static int add_block(struct pt_spill *spill, struct pt_tape *tape)
{
    if (tape->count == tape->room && grow(&tape->blocks, &tape->room))
        return spill->error = ENOMEM;
    if (!tape->buffer && !(tape->buffer = malloc(spill->block)))
        return spill->error = ENOMEM;
    tape->blocks[tape->count++] = spill->idle_count ? spill->idle[--spill->idle_count] : spill->blocks++;
    return 0;
}

int pt_tape_write(struct pt_spill *spill, struct pt_tape *tape, const void *data, uint64_t size)
{
    for (const char *from = data; size && !spill->error;) {
        const uint64_t full = (uint64_t)tape->count * spill->block;
        if (tape->size == full && ((tape->count && flush(spill, tape)) || add_block(spill, tape)))
            break;
        const uint64_t left = (uint64_t)tape->count * spill->block - tape->size, some = size < left ? size : left;
        memcpy(tape->buffer + (spill->block - left), from, some);
        tape->size += some;
        from += some;
        size -= some;
    }
    return spill->error;
}

int pt_tape_rest(struct pt_spill *spill, struct pt_tape *tape)
{
    const int error = tape->buffer ? flush(spill, tape) : 0;
    free(tape->buffer);
    tape->buffer = NULL;
    return error;
}

int pt_tape_read(const struct pt_spill *spill, const struct pt_tape *tape, uint64_t offset, void *data, uint64_t size)
{
    for (char *to = data; size;) {
        const uint64_t index = offset / spill->block, within = offset % spill->block;
        const uint64_t some = size < spill->block - within ? size : spill->block - within;
        size_t got = (size_t)some;
        int error = 0;
        if (tape->buffer && index == tape->count - 1)
            memcpy(to, tape->buffer + within, (size_t)some);
        else
            error = pt_disk_read(&spill->disk, (uint64_t)tape->blocks[index] * spill->block + within, to, (size_t)some, &got);
        if (error || got != some)
            return error ? error : EIO;
        to += some;
        offset += some;
        size -= some;
    }
    return 0;
}

void pt_tape_drop(struct pt_spill *spill, struct pt_tape *tape)
{
    for (uint32_t i = 0; i < tape->count; i++) {
        if (spill->idle_count == spill->idle_room && grow(&spill->idle, &spill->idle_room))
            break; // lost room, no more
        spill->idle[spill->idle_count++] = tape->blocks[i];
    }
    free(tape->blocks);
    free(tape->buffer);
    *tape = (struct pt_tape){0};
}
