// SPDX-License-Identifier: GPL-3.0-or-later
#ifndef PT_FINGERPRINT_H
#define PT_FINGERPRINT_H

#include "patina/patina.h"

#include <stddef.h>
#include <stdint.h>

// 64 bits of `size` bytes, alike on every little-endian machine; seed: what came before. Not against forgery.
uint64_t pt_fingerprint(uint64_t seed, const void *data, size_t size);
// The same of bytes that come in pieces.
struct pt_sum {
    uint64_t ways[4], seed, size;
    uint8_t rest[32]; // bytes that wait for more: size % 32
};
void pt_sum_begin(struct pt_sum *sum, uint64_t seed);
void pt_sum_add(struct pt_sum *sum, const void *data, size_t size);
uint64_t pt_sum_end(const struct pt_sum *sum);
// As patina_task_fingerprint says.
int pt_desc_fingerprint(const patina_cloud_desc *desc, uint64_t values[2]);

#endif
