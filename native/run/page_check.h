// SPDX-License-Identifier: GPL-3.0-or-later
// Looks at what passes read of files for the first time (SPEC 13): pages whose sums are not those that were written are left out of the
// picture, which is planned anew then.
#ifndef PT_PAGE_CHECK_H
#define PT_PAGE_CHECK_H

#include "plan/rounds.h"

// No error of patina.h: damaged pages were found, and the picture is to be planned anew, which leaves them out.
enum { PT_AGAIN = 2 }; // and no error, nor what kernels answer: PT_MORE_ROOM is 1

// The chunks of a range of lists, these arrays of them (bits 1 << pt_array). PATINA_OK, PT_AGAIN, PATINA_ERROR_MEMORY.
int pt_check_range(const struct pt_chunk_list *lists, const struct pt_chunk_range *range, uint32_t arrays);
// All of a cloud.
int pt_check_cloud(const struct patina_cloud *cloud);

#endif
