// SPDX-License-Identifier: GPL-3.0-or-later
#include "trees.h"

void trees_sums(const uint8_t *bins, int64_t wide, const int64_t *some, int64_t count, const int32_t *columns,
                int32_t column_count, const int32_t *node, int32_t node_count, int32_t bin_count, const int64_t *gradient,
                const int64_t *second, int64_t *out)
{
    for (int64_t i = 0; i < count; i++) {
        const uint8_t *row = bins + some[i] * wide;
        for (int32_t c = 0; c < column_count; c++) {
            int64_t *cell = out + 2 * (((int64_t)c * node_count + node[i]) * bin_count + row[columns[c]]);
            cell[0] += gradient[i];
            cell[1] += second[i];
        }
    }
}

void trees_leaves(const uint8_t *bins, int64_t wide, int64_t n, const uint8_t *feature, const uint8_t *bin, int32_t depth,
                  int32_t *out)
{
    for (int64_t i = 0; i < n; i++) {
        int32_t at = 0;
        for (int32_t level = 0; level < depth; level++)
            at = 2 * at + 1 + (bins[i * wide + feature[at]] >= bin[at]);
        out[i] = at - ((1 << depth) - 1);
    }
}
