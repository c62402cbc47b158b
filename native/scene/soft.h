// SPDX-License-Identifier: GPL-3.0-or-later
// Soft points: what each is a ball of.
#ifndef PT_SOFT_H
#define PT_SOFT_H

#include "cloud.h"

// Of a slot of a chunk, object units: its own radius where the cloud has them, else [S Eq. 20] of even points, 2 / sqrt(pi) spacings.
// 0: nothing is known.
float pt_soft_radius(const struct patina_cloud *cloud, const struct pt_chunk *chunk, uint32_t slot);
// What no radius of the chunk is above.
double pt_soft_reach(const struct patina_cloud *cloud, const struct pt_chunk *chunk);
// The field's word (shared/words.h) of a point; radius, 0 and above, is rounded to 1 / 512 of it.
uint32_t pt_soft_word(uint32_t step, float radius);

#endif
