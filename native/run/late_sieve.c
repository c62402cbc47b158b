// SPDX-License-Identifier: GPL-3.0-or-later
#include "late_sieve.h"

#include <stdlib.h>
#include <string.h>

static int reads(const struct pt_pass *pass, enum pt_instance_buffer which, uint32_t instance)
{
    for (uint32_t k = 0; k < pass->ref_count; k++)
        if (pass->refs[k].of == PT_OF_INSTANCE && pass->refs[k].which == (uint32_t)which && pass->refs[k].index == instance)
            return 1;
    return 0;
}

int pt_sieve_waits(const struct pt_plan *plan, const struct pt_pass *pass)
{
    if (pt_pass_role(pass) != PT_ROLE_SIEVE)
        return 0;
    const uint32_t instance = pass->refs[PT_BUF_sift_chunks].index;
    uint32_t readers = 0, keys = 0;
    for (uint32_t i = 0; i < plan->pass_count; i++) {
        const struct pt_pass *other = &plan->passes[i];
        if (other == pass || !reads(other, PT_DRAWN, 0) || !reads(other, PT_CHUNKS, instance))
            continue;
        readers++;
        keys += pt_pass_role(other) == PT_ROLE_KEYS;
    }
    return readers == 1 && keys == 1;
}

int pt_sieve_keep(struct pt_late_sieve **list, const struct pt_plan *plan, const struct pt_pass *pass,
                  struct pt_buffer *const *bound, pt_run_bound *run, const void *context, size_t context_size)
{
    struct pt_late_sieve *sieve = malloc(sizeof *sieve);
    struct pt_buffer **buffers = malloc(pass->ref_count * sizeof *buffers);
    void *copy = malloc(context_size);
    if (!sieve || !buffers || !copy) {
        free(sieve);
        free(buffers);
        free(copy);
        return PATINA_ERROR_MEMORY;
    }
    memcpy(buffers, bound, pass->ref_count * sizeof *buffers);
    memcpy(copy, context, context_size);
    *sieve = (struct pt_late_sieve){.next = *list, .plan = plan, .pass = pass, .run = run, .context = copy, .bound = buffers};
    *list = sieve;
    return PATINA_OK;
}

struct pt_late_sieve *pt_sieve_of(struct pt_late_sieve *list, const struct pt_plan *plan, const struct pt_pass *pass,
                                  uint32_t ref)
{
    for (; list; list = list->next)
        if (list->plan == plan && reads(pass, PT_DRAWN, 0) && pass->refs[ref].of == PT_OF_INSTANCE &&
            list->pass->refs[PT_BUF_sift_chunks].index == pass->refs[ref].index)
            return list;
    return NULL;
}

void pt_sieve_join(const struct pt_late_sieve *sieve, struct pt_chunk_list *list)
{
    struct pt_chunk_list own[2]; // a sieve has one list, of its instance
    if (pt_pass_lists(sieve->plan, sieve->pass, own) != 1)
        return;
    list->arrays |= own[0].arrays;
    pt_list_count_bytes(list);
}

int pt_sieve_run(const struct pt_late_sieve *sieve, struct pt_buffer *chunks)
{
    struct pt_buffer *const whole = sieve->bound[PT_BUF_sift_chunks];
    sieve->bound[PT_BUF_sift_chunks] = chunks;
    const int error = sieve->run(sieve->context, sieve->bound);
    sieve->bound[PT_BUF_sift_chunks] = whole;
    return error;
}

void pt_sieve_drop(struct pt_late_sieve **list, struct pt_late_sieve *sieve)
{
    while (*list != sieve)
        list = &(*list)->next;
    *list = sieve->next;
    free(sieve->bound);
    free(sieve->context);
    free(sieve);
}

void pt_sieves_free(struct pt_late_sieve **list)
{
    while (*list)
        pt_sieve_drop(list, *list);
}
