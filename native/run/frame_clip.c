// SPDX-License-Identifier: GPL-3.0-or-later
#include "frame_clip.h"

int pt_clip_buffers_fill(struct patina_device *device, const struct pt_plan *plan, struct pt_clip_buffers *buffers)
{
    size_t clips = plan->clip_count * sizeof *plan->clips, drawn = plan->drawn_words * sizeof(uint32_t);
    int error = PATINA_OK;
    device->ops->buffer_destroy(device, &buffers->clips);
    if (clips)
        error = device->ops->buffer_create(device, clips, plan->clips, 1, &buffers->clips);
    if (error || drawn <= buffers->drawn.size)
        return error;
    device->ops->buffer_destroy(device, &buffers->drawn);
    return device->ops->buffer_create(device, drawn + drawn / 4, NULL, 0, &buffers->drawn);
}

struct pt_buffer *pt_clip_buffer(struct pt_clip_buffers *buffers, uint32_t which)
{
    return which == PT_CLIPS ? &buffers->clips : &buffers->drawn;
}

void pt_clip_buffers_release(struct patina_device *device, struct pt_clip_buffers *buffers)
{
    device->ops->buffer_destroy(device, &buffers->clips);
    device->ops->buffer_destroy(device, &buffers->drawn);
}
