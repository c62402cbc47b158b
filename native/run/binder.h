// SPDX-License-Identifier: GPL-3.0-or-later
// What a plan's passes bind, found on a device: planes, and buffers of clouds, meshes, clips, masks and shadows. They are uploaded
// when a pass asks for them first.
#ifndef PT_BINDER_H
#define PT_BINDER_H

#include "plan_buffers.h"
#include "planes.h"
#include "residency.h"
#include "shadows.h"

struct pt_bound_instance {
    struct pt_resident *cloud, *mask, *grade, *field, *scans; // NULL: not asked for yet
    struct pt_buffer chunks, fine[PT_RANGE_FINER];            // fine: from PT_FINE_CHUNKS on
    int placed;                                               // these are there, if only none
    struct chunk_view *sound;                                 // what they lie in, where some pages are left out
};

struct pt_bound_mesh {
    struct pt_resident *mesh, *texture;
};

struct pt_binder {
    struct patina_device *device;
    const struct pt_plan *plan;
    struct pt_residency *residency;
    struct pt_planes *planes, *picture; // of this plan; of the picture that it serves, or the same
    struct pt_plan_buffers *own;
    struct pt_shadows *shadows;
    struct pt_bound_instance *instances, *receivers;
    struct pt_bound_mesh *meshes;
    int in_parts;          // the plan holds damaged pages too: they are not bound
    struct pt_buffer none; // never written: kernels that bind it do not touch it
};

// The first six fields and shadows are set. Uploads what the plan's passes share. Messages are at the device, of this and what follows.
int pt_binder_open(struct pt_binder *binder);
// The buffer of a reference, with room where it is a plane. *out lasts until the binder is closed.
int pt_bind(struct pt_binder *binder, const struct pt_ref *ref, struct pt_buffer **out);
// From now on these chunks of an instance, which must outlive the binder.
int pt_bind_chunks(struct pt_binder *binder, uint32_t instance, const struct chunk_view *chunks, uint32_t count);
void pt_binder_close(struct pt_binder *binder);

#endif
