// SPDX-License-Identifier: GPL-3.0-or-later
// rank: every marked point has a place of its own, and no place is left over.
#include "marks.h"
#include "shared/shadows.h"

#include <string.h>

enum { CHUNKS_MOST = 40, SLOTS_MOST = CHUNKS_MOST * 4096 };

// Chunks of random lengths, of which every third is not in the list; `share` of the points is marked. before: how many have ranks already.
static void check(struct harness *h, uint64_t seed, double share, uint32_t most, uint32_t before)
{
    struct rng rng = {seed};
    struct chunk_view chunks[CHUNKS_MOST] = {0};
    uint8_t *listed = harness_alloc(h, SLOTS_MOST), *taken;
    uint32_t count = 0, slots = 0;
    for (uint32_t c = 0; c < CHUNKS_MOST; c++) {
        const uint32_t points = 1 + rng_below(&rng, most), padded = (points + 15) / 16 * 16;
        if (c % 3 != 1 || most > 4000)
            chunks[count++] = (struct chunk_view){.first = slots, .count = points, .padded = padded};
        memset(listed + slots, count && chunks[count - 1].first == slots, padded);
        slots += padded;
    }
    uint32_t *marks = harness_alloc(h, marks_size(slots) + 8), marked = before;
    for (uint32_t i = 0; i < slots; i++)
        if (listed[i] && rng_unit(&rng) < share)
            marks[2 * (size_t)(i / PT_MARK_SLOTS)] |= 1u << i % PT_MARK_SLOTS;
    struct rank_args args = {0};
    struct pt_buffer *list = harness_buffer(h, chunks, count * sizeof *chunks),
                     *bits = harness_buffer(h, marks, marks_size(slots));
    struct pt_buffer *flag = harness_buffer(h, &marked, 4);
    HARNESS_RUN(h, rank, &args, list, bits, flag);
    HARNESS_RUN(h, rank, &args, list, bits, flag); // all have one by now
    const uint32_t *got = harness_read(h, bits), *total = harness_read(h, flag);
    uint32_t shown = 0;
    taken = harness_alloc(h, SLOTS_MOST + 1);
    for (uint32_t i = 0; i < slots; i++)
        shown += (uint32_t)ref_shown(marks, i);
    HARNESS_CHECK(h, *total == before + shown);
    for (uint32_t i = 0; i < slots; i++) {
        if (ref_shown(got, i) != ref_shown(marks, i))
            harness_fail(h, "marks", (int)i, 0, "changed");
        if (!ref_shown(marks, i))
            continue;
        const uint32_t place = ref_shown_place(got, i) - before;
        if (place < 1 || place > shown || taken[place - 1]++)
            harness_fail(h, "place", (int)i, 0, "got %u of %u", place, shown);
    }
}

static void shares(struct harness *h)
{
    static const double each[] = {0.0, 0.001, 0.1, 0.9, 1.0};
    for (uint64_t i = 0; i < 5; i++) {
        check(h, i, each[i], 4096, 0);
        check(h, 10 + i, each[i], 100, 7); // behind those of another instance
    }
}

// Many short chunks whose marks lie in the words of their neighbours'.
static void neighbours(struct harness *h)
{
    for (uint64_t i = 20; i < 40; i++)
        check(h, i, i % 2 ? 0.5 : 1.0, 16, 0);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"shares", shares, 0},
        {"neighbours", neighbours, 0},
    };
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
