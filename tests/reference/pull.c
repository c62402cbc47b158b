// SPDX-License-Identifier: GPL-3.0-or-later
// SPEC 2.2: a scatter at half the resolution is the least key of 2 x 2 pixels.
#include "reference.h"
#include "shared/filling.h"

void ref_pull(const struct pull_args *args, const uint64_t *fine_keys, const uint32_t *fine_from, int x, int y, uint64_t *key,
              uint32_t *from)
{
    *key = REF_EMPTY_KEY;
    *from = 0;
    for (int fy = 2 * y; fy <= 2 * y + 1 && fy < (int)args->fine_height; fy++) {
        for (int fx = 2 * x; fx <= 2 * x + 1 && fx < (int)args->fine_width; fx++) {
            size_t fine = (size_t)fy * args->fine_width + (size_t)fx;
            if (fine_keys[fine] < *key) {
                *key = fine_keys[fine];
                *from = fine_from[fine];
            }
        }
    }
}
