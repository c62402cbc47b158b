// SPDX-License-Identifier: GPL-3.0-or-later
#include "plan_buffers.h"

static int fill_clips(struct patina_device *device, const struct pt_plan *plan, struct pt_plan_buffers *buffers)
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

static int write(struct patina_device *device, const void *source, size_t size, struct pt_buffer *buffer)
{
    if (!size)
        return PATINA_OK;
    if (size <= buffer->size)
        return device->ops->buffer_write(device, buffer, 0, source, size);
    device->ops->buffer_destroy(device, buffer);
    return device->ops->buffer_create(device, size, source, 0, buffer);
}

int pt_plan_buffers_fill(struct patina_device *device, const struct pt_plan *plan, struct pt_plan_buffers *buffers)
{
    int error = fill_clips(device, plan, buffers);
    if (!error)
        error = write(device, plan->light, plan->light ? sizeof *plan->light : 0, &buffers->shared[PT_PLAN_LIGHTS]);
    return error ? error
                 : write(device, plan->ramps, 3 * (size_t)plan->ramp_entries * sizeof *plan->ramps,
                         &buffers->shared[PT_PLAN_RAMPS]);
}

struct pt_buffer *pt_clip_buffer(struct pt_plan_buffers *buffers, uint32_t which)
{
    return which == PT_CLIPS ? &buffers->clips : &buffers->drawn;
}

void pt_plan_buffers_release(struct patina_device *device, struct pt_plan_buffers *buffers)
{
    device->ops->buffer_destroy(device, &buffers->clips);
    device->ops->buffer_destroy(device, &buffers->drawn);
    for (int k = 0; k < PT_PLAN_BUFFERS; k++)
        device->ops->buffer_destroy(device, &buffers->shared[k]);
}
