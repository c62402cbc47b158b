// SPDX-License-Identifier: GPL-3.0-or-later
// Random image buffers, for the tests of kernels that make pictures of them.
#ifndef PT_CELLS_H
#define PT_CELLS_H

#include "harness.h"

enum cells_kind {
    CELLS_SURFACES, // a tilted wall behind a nearer one
    CELLS_NOISE,    // any depth, any place
    CELLS_FLAT,     // one depth
    CELLS_SPARSE,   // as surfaces, most cells empty
    CELLS_KINDS
};
extern const char *const cells_kind_names[CELLS_KINDS];

// Float4 a cell; as merge makes them. What lies in empty cells is not a number.
float *cells_random(struct harness *h, struct rng *rng, const struct view_args *view, enum cells_kind kind);

#endif
