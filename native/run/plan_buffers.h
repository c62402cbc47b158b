// SPDX-License-Identifier: GPL-3.0-or-later
// What all of a plan's passes share, on the device: its clips and drawn words, its light, its ramps.
#ifndef PT_PLAN_BUFFERS_H
#define PT_PLAN_BUFFERS_H

#include "plan/plan.h"

struct pt_plan_buffers {
    struct pt_buffer clips;                   // of the plan at hand
    struct pt_buffer drawn;                   // grows
    struct pt_buffer shared[PT_PLAN_BUFFERS]; // written once a plan; grow
};

// For a plan, which must outlive their use. The message is at the device.
int pt_plan_buffers_fill(struct patina_device *device, const struct pt_plan *plan, struct pt_plan_buffers *buffers);
struct pt_buffer *pt_clip_buffer(struct pt_plan_buffers *buffers, uint32_t which); // PT_CLIPS or PT_DRAWN
void pt_plan_buffers_release(struct patina_device *device, struct pt_plan_buffers *buffers);

#endif
