// SPDX-License-Identifier: GPL-3.0-or-later
// Descriptors as callers have them, built with an older header than ours or with a newer one: patina.h, "Descriptors", says what
// holds. Every call takes its descriptors through pt_take before it reads a field, and hands out structures through pt_give.
#ifndef PT_DESCRIPTOR_H
#define PT_DESCRIPTOR_H

#include "error.h"

// Copies what the caller's descriptor has of ours (size bytes, struct_size first, which becomes size); the rest is zero. given NULL:
// all is. PATINA_ERROR_ARGUMENT where struct_size is not set, PATINA_ERROR_UNSUPPORTED where something beyond ours is not zero: the
// message names the call and the descriptor.
int pt_take(const struct pt_handle *handle, const char *call, const void *given, void *ours, size_t size);

// Copies as much of ours as the caller's structure has room for; its struct_size stays, and what it has beyond ours becomes zero.
// PATINA_ERROR_ARGUMENT where `to` is NULL or its struct_size is not set.
int pt_give(const struct pt_handle *handle, const char *call, const void *ours, size_t size, void *to);

#endif
