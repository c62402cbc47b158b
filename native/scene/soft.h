// SPDX-License-Identifier: GPL-3.0-or-later
// Soft points: what each is a ball of.
#ifndef PT_SOFT_H
#define PT_SOFT_H

#include "scene/clouds/cloud.h"

struct patina_field;

// Of a slot of a chunk, object units: its own radius where the cloud has them, else [S Eq. 20] of even points, 2 / sqrt(pi) spacings.
// 0: nothing is known.
float pt_soft_radius(const struct patina_cloud *cloud, const struct pt_chunk *chunk, uint32_t slot);
// What no radius of the chunk is above.
double pt_soft_reach(const struct patina_cloud *cloud, const struct pt_chunk *chunk);
// How the words of a cloud's points are read (shared/words.h). Points' own radii are held as they are, beside a field in 65535 steps
// from the least to the greatest; what stands for them, and `one` for all, is rounded to 1 / 512 of it.
struct pt_soft_code {
    uint32_t whole, base, step;
};

struct pt_soft_code pt_soft_code(const struct patina_cloud *cloud, const struct patina_field *field, int one);
// A point's word: of F in its steps, and a radius of 0 and above.
uint32_t pt_soft_word(struct pt_soft_code code, uint32_t f, float radius);

#endif
