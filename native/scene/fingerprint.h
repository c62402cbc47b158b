// SPDX-License-Identifier: GPL-3.0-or-later
#ifndef PT_FINGERPRINT_H
#define PT_FINGERPRINT_H

#include "patina/patina.h"

#include <stddef.h>
#include <stdint.h>

// 64 bits of `size` bytes, alike on every little-endian machine; seed: what came before. Not against forgery.
uint64_t pt_fingerprint(uint64_t seed, const void *data, size_t size);
// As patina_task_fingerprint says.
int pt_desc_fingerprint(const patina_cloud_desc *desc, uint64_t values[2]);

#endif
