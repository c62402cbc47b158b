// SPDX-License-Identifier: GPL-3.0-or-later
// bandwidth [DEVICE [MEGABYTES]]: how many GB/s a device (gl-egl) writes where it fills a buffer (1024) and does nothing else, as JSON. The
// floor of a frame's time is what it moves at this rate.
#include "base/error.h"
#include "base/platform.h"
#include "device.h"

#include <stdio.h>
#include <stdlib.h>

enum { RUNS = 5, FILLS = 8 };

// Seconds of some fills; less than 0: the device failed.
static double seconds(patina_device *device, struct pt_buffer *buffer)
{
    const double start = pt_milliseconds();
    int error = 0;
    for (int i = 0; i < FILLS && !error; i++)
        error = device->ops->buffer_fill(device, buffer, 0, buffer->size, 0x3F800000u + (uint32_t)i, 4);
    error = error ? error : device->ops->wait(device);
    return error ? -1.0 : (pt_milliseconds() - start) / 1e3;
}

int main(int count, char **arguments)
{
    const patina_device_desc desc = {.struct_size = sizeof desc, .name = count > 1 ? arguments[1] : "gl-egl"};
    const size_t bytes = (size_t)(count > 2 ? strtoul(arguments[2], NULL, 10) : 1024) << 20;
    patina_device *device = NULL;
    struct pt_buffer buffer = {0};
    double best = 0.0;
    int error = patina_device_create(&desc, &device);
    if (!error)
        error = device->ops->buffer_create(device, bytes, NULL, 0, &buffer);
    for (int i = 0; i <= RUNS && !error; i++) { // the first touches the memory
        const double time = seconds(device, &buffer), rate = time > 0.0 ? FILLS * (double)bytes / time / 1e9 : 0.0;
        error = time < 0.0;
        best = i && rate > best ? rate : best;
    }
    if (error) {
        char message[256] = "";
        patina_message(device, message, sizeof message);
        fprintf(stderr, "%s\n", message);
    } else {
        printf("{\"device\": \"%s\", \"write_gbs\": %.1f}\n", device->info.name, best);
    }
    if (buffer.size)
        device->ops->buffer_destroy(device, &buffer);
    patina_device_destroy(device);
    return error != 0;
}
