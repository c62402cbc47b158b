// SPDX-License-Identifier: GPL-3.0-or-later
// What may be drawn of an instance: the one list. A cloud may be of several kinds at once: its fine chunks points, its wide ones discs,
// and some of its points soft.
#ifndef PT_KINDS_H
#define PT_KINDS_H

#include "device.h"
#include "scene/scene.h"

// X(kind, source, sees, shows, in_planes, see, show, join, cover, front, buffers...)
//   source     what an instance must be of: enum pt_source
//   sees       kernel that runs first to find which of it each pixel shows; shows: what finds what is shown there
//   in_planes  1: planes hold what pixels show, its colour, its opacity and how far off it lies, and filling leaves it alone; 0: the
//              instance's own buffers do
//   see, ...   what adds its passes, or says why none are needed, in the order of a layer (NULL: nothing):
//              see: all in view; show: one that is in view; join: all, behind the others' show; cover: over what was filled; front:
//              before all that is shaded
//   buffers    what `sees`, or the scatter behind it, binds of each instance, beside each other
#define PT_KINDS(X)                                                                                                            \
    X(POINTS, CLOUD, scatter, resolve, 0, pt_plan_points, pt_plan_resolve, pt_plan_resolved, NULL, NULL, PT_CHUNKS,            \
      PT_POSITIONS, PT_SURFELS)                                                                                                \
    X(DISCS, CLOUD, splat, resolve, 1, pt_plan_splat, pt_plan_resolve, pt_plan_blend, NULL, NULL, PT_CHUNKS, PT_POSITIONS,     \
      PT_SURFELS, PT_RADII)                                                                                                    \
    X(RANGES, CLOUD, coarsen, magnify, 1, pt_plan_ranges, NULL, NULL, NULL, NULL, PT_CHUNKS, PT_POSITIONS, PT_SURFELS)         \
    X(SOFT, CLOUD, gather, soft, 0, NULL, NULL, NULL, NULL, pt_plan_soft_layer, PT_CHUNKS, PT_POSITIONS, PT_SURFELS)           \
    X(MESH, MESH, raster, cover, 0, NULL, NULL, NULL, pt_plan_meshes, NULL, PT_MESH_VERTICES, PT_MESH_INDICES, PT_MESH_TEXELS)

enum pt_kind {
#define PT_X(kind, ...) PT_AS_##kind,
    PT_KINDS(PT_X)
#undef PT_X
        PT_AS_COUNT
};

enum { PT_KIND_BUFFERS = 4 }; // at most

struct pt_kind_row {
    enum pt_source source;
    enum pt_kernel sees, shows;
    int in_planes;
    uint32_t buffer_count;
    uint8_t buffers[PT_KIND_BUFFERS]; // enum pt_instance_buffer, of meshes pt_mesh_buffer
};
extern const struct pt_kind_row pt_kinds[PT_AS_COUNT];

#endif
