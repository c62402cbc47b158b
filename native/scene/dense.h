// SPDX-License-Identifier: GPL-3.0-or-later
// Where a cloud's points are dense, chunk by chunk: strays far outside of it must not decide how it is framed.
#ifndef PT_DENSE_H
#define PT_DENSE_H

#include "scene/clouds/cloud.h"

struct pt_dense { // object units; of a chunk of strays lower > upper
    double lower[3], upper[3];
};

// One for every chunk of a cloud that is not in pages; its own box where it has no strays. 0 or PATINA_ERROR_MEMORY.
int pt_dense_chunks(const struct patina_cloud *cloud, struct pt_dense *boxes);

#endif
