// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes in a picture or a light's map. They are drawn into keys of their own and laid over the points after filling: so no
// hole is filled from a mesh, none is closed where a mesh stands behind it, and what it hides fills as if it were not there.
#include "plan_lines.h"

#include <string.h>

static void plan_raster(struct pt_builder *builder, uint32_t i)
{
    const struct pt_plan *plan = builder->plan;
    struct raster_args args = {.view = plan->view, .mesh = plan->meshes[i].args, .behind = builder->layer > 1};
    const struct pt_ref refs[] = {pt_plane_at(PT_PLANE_MESH_KEYS, 0), pt_mesh_buffer_of(PT_MESH_VERTICES, i),
                                  pt_mesh_buffer_of(PT_MESH_INDICES, i), pt_plane_at(PT_PLANE_LIMIT, 0)};
    struct pt_pass *pass = pt_add(builder, PT_KERNEL_raster, "raster", &args, sizeof args, refs, args.behind ? 4 : 3);
    PT_REASON(pass, "%u triangles of mesh %u", args.mesh.id_count, i);
}

static void plan_cover(struct pt_builder *builder, uint32_t i, int shown)
{
    const struct pt_plan *plan = builder->plan;
    struct cover_args args = {.view = plan->view,
                              .mesh = plan->meshes[i].args,
                              .behind = builder->layer > 1,
                              .shown = (uint32_t)shown};
    memcpy(args.view.rect, plan->meshes[i].rect, sizeof args.view.rect);
    // where nothing is shown the keys stand in and are not touched
    const struct pt_ref refs[] = {pt_keys_of(builder, 0),
                                  pt_from_of(builder, 0),
                                  pt_plane_at(PT_PLANE_NORMAL, 0),
                                  pt_span_of(plan),
                                  pt_plane_at(PT_PLANE_MESH_KEYS, 0),
                                  pt_mesh_buffer_of(PT_MESH_VERTICES, i),
                                  pt_mesh_buffer_of(PT_MESH_INDICES, i),
                                  pt_plane_at(shown ? PT_PLANE_MESH_SHOWN : PT_PLANE_MESH_KEYS, 0),
                                  pt_plane_at(shown ? PT_PLANE_MESH_NORMAL : PT_PLANE_MESH_KEYS, 0),
                                  pt_plane_at(shown ? PT_PLANE_MESH_ALBEDO : PT_PLANE_MESH_KEYS, 0),
                                  pt_plane_at(PT_PLANE_LIMIT, 0)};
    struct pt_pass *pass = pt_add(builder, PT_KERNEL_cover, "cover", &args, sizeof args, refs, args.behind ? 11 : 10);
    PT_REASON(pass, "mesh %u over what lies behind it", i);
}

void pt_plan_meshes(struct pt_builder *builder, int shown)
{
    const struct pt_plan *plan = builder->plan;
    if (!plan->triangles) {
        const char *reason = plan->mesh_count ? "no mesh is in view" : "the scene has no mesh";
        pt_skip(builder, "raster", reason);
        pt_skip(builder, "cover", reason);
    }
    for (uint32_t i = 0; i < plan->mesh_count; i++)
        if (plan->meshes[i].rect[0] < plan->meshes[i].rect[2])
            plan_raster(builder, i);
    for (uint32_t i = 0; i < plan->mesh_count; i++)
        if (plan->meshes[i].rect[0] < plan->meshes[i].rect[2])
            plan_cover(builder, i, shown);
}

void pt_plan_mesh_shade(struct pt_builder *builder, enum pt_plane color)
{
    const struct pt_plan *plan = builder->plan;
    struct shade_args args;
    if (!plan->triangles)
        return;
    pt_shade_lights(builder, 0, &args);
    // a point for each pixel, with its index as id
    args.instance = (struct instance_args){.id_count = plan->view.width * plan->view.height,
                                           .has_normals = 1,
                                           .color_format = PT_COLOR_FLOAT,
                                           .lit = 1,
                                           .shininess = 1,
                                           .ambient = 1.0f,
                                           .diffuse = 1.0f,
                                           .opacity = 1.0f};
    pt_own_colors(color, &args);
    pt_line_surface(builder, &args.instance);
    PT_REASON(PT_ADD(builder, shade, args,
                     {pt_plane_at(PT_PLANE_MESH_SHOWN, 0), pt_from_of(builder, 0), pt_plane_at(PT_PLANE_MESH_NORMAL, 0),
                      pt_span_of(plan), pt_plane_at(PT_PLANE_MESH_ALBEDO, 0), pt_shading_of(builder),
                      pt_plane_at(color, 0), pt_buffer_of(PT_SHADOWS, PT_NO_INSTANCE),
                      pt_buffer_of(PT_SHADOWS, PT_NO_INSTANCE), pt_plane_at(PT_PLANE_ARRIVED, 0)}),
              "meshes, %u lights", args.light_count);
}
