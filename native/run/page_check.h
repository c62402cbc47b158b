// SPDX-License-Identifier: GPL-3.0-or-later
// Looks at what passes read of files for the first time (SPEC 13): pages whose sums are not those that were written are left out of the
// picture, which is planned anew then.
#ifndef PT_PAGE_CHECK_H
#define PT_PAGE_CHECK_H

#include "plan/rounds.h"

#include <stdatomic.h>

// No error of patina.h: damaged pages were found, and the picture is to be planned anew, which leaves them out.
enum { PT_AGAIN = 2 }; // and no error, nor what kernels answer: PT_MORE_ROOM is 1

struct pt_check {
    uint32_t arrays;                                 // bits 1 << pt_array
    const atomic_int *cancel;                        // NULL: nothing stops it
    void (*make_room)(void *context, uint64_t more); // before so many bytes are read; NULL: there is some
    void (*look)(void *context);                     // after each page, from any thread; NULL: none
    void *context;
};

// The chunks of a range of lists, or all of a cloud, as far as nobody has looked at them: PATINA_OK, PT_AGAIN, PATINA_ERROR_CANCELLED,
// PATINA_ERROR_MEMORY with its message. The log is not told yet (pt_pages_tell).
int pt_check_range(const struct pt_check *how, const struct pt_chunk_list *lists, const struct pt_chunk_range *range);
int pt_check_cloud(const struct pt_check *how, const struct patina_cloud *cloud);

#endif
