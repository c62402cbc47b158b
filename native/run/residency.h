// SPDX-License-Identifier: GPL-3.0-or-later
// Which clouds and meshes lie on a device. A CPU device borrows the cloud's memory, a GL device holds a copy until the cloud dies, or,
// where it has no room for that, asks for ranges of points whenever it needs them (device->ranges).
#ifndef PT_RESIDENCY_H
#define PT_RESIDENCY_H

#include "plan/plan.h"

enum { PT_RANGE_LEAST = 32 << 20 }; // bytes of a range, where a driver did not say how much memory there is

struct pt_resident;

// The clouds whose buffers a device holds for a frame.
struct pt_residency {
    struct pt_resident *first;
};

struct pt_resident {
    struct pt_resident *next;
    struct pt_alive *alive;
    uint32_t pages;                        // the state of alive->pages
    uint64_t *given;                       // of a cloud in pages: what of each chunk the buffers hold; NULL: not known
    uint32_t colors, shapes;               // the states of alive->colors and alive->shapes that the buffers hold
    struct pt_buffer marked;               // colours with what stations saw through in magenta; made when first asked for
    uint32_t marked_colors, marked_shapes; // the states that it holds
    struct pt_buffer fields[2];            // PT_FIELD, PT_FIELD_ONE; made when first asked for
    uint32_t field_shapes;                 // the state of shapes that the first holds
    struct pt_buffer
        buffers[PT_INSTANCE_BUFFERS]; // by pt_instance_buffer, of a mesh or texture by pt_mesh_buffer; PT_CHUNKS is unused
};

// The cloud's buffers on the device, uploaded at the first call; forgets dead clouds on the way.
int pt_residency_take(struct pt_residency *residency, struct patina_device *device, const struct patina_cloud *cloud,
                      struct pt_resident **out);
// Makes resident->marked what it should be: in the cloud's format of colours, PT_COLOR_FLOAT where it has none.
int pt_residency_mark(struct patina_device *device, const struct patina_cloud *cloud, struct pt_resident *resident);
// Makes resident->buffers[PT_SIGHTS] what the cloud's stations saw.
int pt_residency_see(struct patina_device *device, const struct patina_cloud *cloud, struct pt_resident *resident);
// Makes resident->fields[one] what the cloud's points are as soft ones: by a field, or all of them (NULL).
int pt_residency_field(struct patina_device *device, const struct patina_cloud *cloud, const struct patina_field *by,
                       struct pt_resident *resident, int one);
// Likewise of what a mask holds: `size` bytes that live as long as `alive` says, in buffers[0], or none.
int pt_residency_take_bytes(struct pt_residency *residency, struct patina_device *device, struct pt_alive *alive,
                            const void *data, size_t size, struct pt_resident **out);
// Likewise of what a grade or a list of scans holds of each point: a device may have it in ranges.
int pt_residency_take_points(struct pt_residency *residency, struct patina_device *device, struct pt_alive *alive,
                             const void *data, size_t size, struct pt_resident **out);
// Likewise of a mesh.
int pt_residency_take_mesh(struct pt_residency *residency, struct patina_device *device, const struct patina_mesh *mesh,
                           struct pt_resident **out);
int pt_residency_take_texture(struct pt_residency *residency, struct patina_device *device,
                              const struct patina_texture *texture, struct pt_resident **out);
void pt_residency_release(struct pt_residency *residency, struct patina_device *device);

#endif
