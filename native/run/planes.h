// SPDX-License-Identifier: GPL-3.0-or-later
// Planes of pixels on a device, kept from plan to plan.
#ifndef PT_PLANES_H
#define PT_PLANES_H

#include "plan/plan.h"

// Those of a frame's pictures, or of its lights' maps. `other`: of the same frame, for the device's memory cap counts both.
struct pt_planes {
    struct pt_buffer at[PT_PLANE_COUNT][PT_SLOTS];
    const struct pt_planes *other;
    int varies; // in size from plan to plan, from the beginning
};

uint64_t pt_planes_total(const struct pt_planes *planes); // bytes that both hold
// Room for a plane of the plan; what it holds is anything, or what it held where the size is the same. Messages are at the device.
int pt_planes_ensure(struct patina_device *device, struct pt_planes *planes, const struct pt_plan *plan, enum pt_plane which,
                     uint32_t level);
// One word everywhere.
int pt_planes_clear(struct patina_device *device, struct pt_planes *planes, const struct pt_plan *plan, const struct pt_step *clear);
// Room for the whole picture before any of it is written: what cannot be had leaves the last picture as it is.
int pt_planes_ensure_picture(struct patina_device *device, struct pt_planes *planes, const struct pt_plan *plan);
void pt_planes_release(struct patina_device *device, struct pt_planes *planes);

#endif
