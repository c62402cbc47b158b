// SPDX-License-Identifier: GPL-3.0-or-later
// What may be drawn of an instance: the one list. A cloud may be of several kinds at once: its fine chunks points, its wide ones discs,
// and some of its points soft.
#ifndef PT_KINDS_H
#define PT_KINDS_H

#include "device.h"
#include "scene/scene.h"

// What is drawn of an instance, before it is known where.
struct pt_object;
struct pt_to_place {
    const struct patina_scene *scene;
    const struct pt_instance *instance;
    const struct pt_object *object;
};
// How far from its place a point of the chunk may show, world units.
typedef double pt_reach_of(const struct pt_to_place *what, const struct pt_chunk *chunk);
pt_reach_of pt_reach_of_none, pt_reach_of_discs, pt_reach_of_balls;

// X(kind, source, sees, shows, in_planes, reach, pixels, beyond, see, show, join, cover, front, buffers...)
//   source     what an instance must be of: enum pt_source
//   sees       kernel that runs first to find which of it each pixel shows; shows: what finds what is shown there
//   in_planes  1: planes hold what pixels show, its colour, its opacity and how far off it lies, and filling leaves it alone; 0: the
//              instance's own buffers do
//   reach      pt_reach_of: bounds of a chunk, or of a mesh, are those of its box, so much wider (pt_kind_bounds);
//   pixels     and so many pixels wider on screen; beyond: 1: what lies within reach of a point beyond the near or far plane may show, too
//   see, ...   what adds its passes, or says why none are needed, in the order of a layer (NULL: nothing):
//              see: all in view; show: one that is in view; join: all, behind the others' show; cover: over what was filled; front:
//              before all that is shaded
//   buffers    what `sees`, or the scatter behind it, binds of each instance, beside each other
#define PT_KINDS(X)                                                                                                            \
    X(POINTS, CLOUD, scatter, resolve, 0, pt_reach_of_none, 0.0f, 0, pt_plan_points, pt_plan_resolve, pt_plan_resolved, NULL,  \
      NULL, PT_CHUNKS, PT_POSITIONS, PT_SURFELS)                                                                               \
    X(DISCS, CLOUD, splat, resolve, 1, pt_reach_of_discs, 0.0f, 0, pt_plan_splat, pt_plan_resolve, pt_plan_blend, NULL, NULL,  \
      PT_CHUNKS, PT_POSITIONS, PT_SURFELS, PT_RADII)                                                                           \
    X(RANGES, CLOUD, coarsen, magnify, 1, pt_reach_of_none, 0.0f, 0, pt_plan_ranges, NULL, NULL, NULL, NULL, PT_CHUNKS,        \
      PT_POSITIONS, PT_SURFELS)                                                                                                \
    X(SOFT, CLOUD, gather, soft, 0, pt_reach_of_balls, 2.0f * PT_SOFT_LEAST, 1, NULL, NULL, NULL, NULL, pt_plan_soft_layer,    \
      PT_CHUNKS, PT_POSITIONS, PT_SURFELS)                                                                                     \
    X(MESH, MESH, raster, cover, 0, pt_reach_of_none, 0.0f, 0, NULL, NULL, NULL, pt_plan_meshes, NULL, PT_MESH_VERTICES,       \
      PT_MESH_INDICES, PT_MESH_TEXELS)

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
    pt_reach_of *reach;
    double pixels;
    int beyond;
    uint32_t buffer_count;
    uint8_t buffers[PT_KIND_BUFFERS]; // enum pt_instance_buffer, of meshes pt_mesh_buffer
};
extern const struct pt_kind_row pt_kinds[PT_AS_COUNT];

#endif
