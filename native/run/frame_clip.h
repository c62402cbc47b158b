// SPDX-License-Identifier: GPL-3.0-or-later
// A plan's clips and drawn words on the device.
#ifndef PT_FRAME_CLIP_H
#define PT_FRAME_CLIP_H

#include "plan/plan.h"

struct pt_clip_buffers {
    struct pt_buffer clips; // of the plan at hand
    struct pt_buffer drawn; // grows
};

// For a plan, which must outlive their use. The message is at the device.
int pt_clip_buffers_fill(struct patina_device *device, const struct pt_plan *plan, struct pt_clip_buffers *buffers);
struct pt_buffer *pt_clip_buffer(struct pt_clip_buffers *buffers, uint32_t which); // PT_CLIPS or PT_DRAWN
void pt_clip_buffers_release(struct patina_device *device, struct pt_clip_buffers *buffers);

#endif
