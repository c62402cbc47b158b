// SPDX-License-Identifier: GPL-3.0-or-later
// Planes of pixels on a device, kept from plan to plan.
#ifndef PT_PLANES_H
#define PT_PLANES_H

#include "plan/plan.h"

enum {
    PT_SLABS = 128,
    PT_PLANES_SPARE = 8 // one part in so many is added to the planes for what kernels need beside them
};

// Those of a frame's pictures, or of its lights' maps. `other`: of the same frame, for the device's memory cap counts both.
struct pt_planes {
    struct pt_buffer at[PT_PLANE_COUNT][PT_SLOTS]; // kept, or views of slabs
    struct pt_buffer slabs[PT_SLABS];
    uint8_t view[PT_PLANE_COUNT][PT_SLOTS]; // 1 + its slab; 0: it has memory of its own
    uint8_t lost[PT_PLANE_COUNT][PT_SLOTS]; // another plane took its slab since
    int apart;                              // no slab is shared
    int poisoned;                           // pt_planes_poison writes: a test of lifetimes
    uint64_t borrowed;                      // bits of the other's slabs that planes may be views of: pt_planes_borrow
    const struct pt_planes *other;
    int varies;    // in size from plan to plan, from the beginning
    uint64_t bins; // bytes that bins of discs came to when they grew
};

uint64_t pt_planes_total(const struct pt_planes *planes); // bytes that both hold
uint64_t pt_planes_own(const struct pt_planes *planes);   // bytes that these hold
// PATINA_ERROR_TOO_LARGE, with a message at the device, unless each plane of the plan fits into the device's buffers, and all of them
// into the memory cap and the memory that is free. After pt_plan_share_planes. planes: those of the previous picture count as free.
// Nothing is allocated. Maps of lights have sizes of their own: pt_maps_check.
int pt_planes_check(const struct patina_device *device, const struct pt_planes *planes, const struct pt_plan *plan);
// The same of one pass, and of so many bytes of which some are held already.
int pt_planes_check_pass(const struct patina_device *device, const struct pt_plan *plan, const struct pt_pass *pass);
int pt_planes_check_memory(const struct patina_device *device, const struct pt_plan *plan, uint64_t held, uint64_t bytes);
// Whether that would be refused, without a message.
int pt_planes_lack(const struct patina_device *device, uint64_t held, uint64_t bytes);
// PATINA_ERROR_TOO_LARGE: the plan's planes take more than the memory cap. The message names the plan's kind and size.
int pt_planes_above_cap(const struct patina_device *device, const struct pt_plan *plan);
// Room for a picture's plan, whose planes share memory as it says; before any of it runs.
int pt_planes_open(struct patina_device *device, struct pt_planes *planes, const struct pt_plan *plan);
// Where planes are poisoned: what holds nothing yet is overwritten before a pass at `when`, what is no longer needed behind it (`ends`),
// so that a picture that depends on it differs.
int pt_planes_poison(struct patina_device *device, struct pt_planes *planes, const struct pt_plan *plan, uint32_t when,
                     int ends);
// The same of slabs: bits.
int pt_planes_poison_slabs(struct patina_device *device, struct pt_planes *planes, uint64_t slabs);
// Until the next call planes may lie in these slabs of the other's.
void pt_planes_borrow(struct pt_planes *planes, uint64_t slabs);
// Room for a plane of the plan; what it holds is anything, or what it held where the size is the same. Messages are at the device.
int pt_planes_ensure(struct patina_device *device, struct pt_planes *planes, const struct pt_plan *plan, enum pt_plane which,
                     uint32_t level);
// More room for a plane of bins that a kernel found too small; what it held is lost.
int pt_planes_grow(struct patina_device *device, struct pt_planes *planes, const struct pt_plan *plan, enum pt_plane which,
                   size_t bytes);
// One word everywhere.
int pt_planes_clear(struct patina_device *device, struct pt_planes *planes, const struct pt_plan *plan,
                    const struct pt_step *clear);
// Room for the whole picture before any of it is written: what cannot be had leaves the last picture as it is.
int pt_planes_ensure_picture(struct patina_device *device, struct pt_planes *planes, const struct pt_plan *plan);
void pt_planes_release(struct patina_device *device, struct pt_planes *planes);

#endif
