// SPDX-License-Identifier: GPL-3.0-or-later
// The two loops of boost.py that take time, in whole numbers.
#ifndef PT_TRUTH_TREES_H
#define PT_TRUTH_TREES_H

#include <stdint.h>

#define TREES_API __attribute__((visibility("default")))

// Adds the gradients and second derivatives of samples to out[column][node][bin][2]. bins: `wide` bytes a sample; some: `count`
// numbers of samples; node, gradient and second: one of each. columns: features to look at.
TREES_API void trees_sums(const uint8_t *bins, int64_t wide, const int64_t *some, int64_t count, const int32_t *columns,
                          int32_t column_count, const int32_t *node, int32_t node_count, int32_t bin_count,
                          const int64_t *gradient, const int64_t *second, int64_t *out);
// Writes the leaf, 0 to 2^depth - 1, that each of n samples reaches. feature and bin: of a complete tree, breadth first.
TREES_API void trees_leaves(const uint8_t *bins, int64_t wide, int64_t n, const uint8_t *feature, const uint8_t *bin,
                            int32_t depth, int32_t *out);

#endif
