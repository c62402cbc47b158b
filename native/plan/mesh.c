// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes in a picture or a light's map. They are drawn into keys of their own and laid over the points after filling: so no
// hole is filled from a mesh, none is closed where a mesh stands behind it, and what it hides fills as if it were not there.
#include "lines.h"

#include <string.h>

static uint32_t pixels_of(const struct pt_plan *plan) { return plan->view.width * plan->view.height; }

static int in_view(const struct pt_plan_mesh *mesh) { return mesh->rect[0] < mesh->rect[2]; }

static void plan_raster(struct pt_builder *builder, uint32_t i)
{
    const struct pt_plan *plan = builder->plan;
    struct raster_args args = {.view = plan->view, .mesh = plan->mesh.list[i].args, .behind = builder->layer > 1};
    struct pt_ref refs[2 + PT_KIND_BUFFERS] = {pt_plane_at(PT_PLANE_MESH_KEYS, 0)};
    uint32_t count = 1 + pt_bind_kind(PT_AS_MESH, i, refs + 1);
    refs[count++] = pt_plane_if(args.behind != 0, PT_PLANE_LIMIT, 0);
    struct pt_pass *pass = pt_add(builder, PT_KERNEL_raster, "raster", &args, sizeof args, refs, count);
    PT_REASON(pass, "%u triangles of mesh %u", args.mesh.id_count, i);
}

static void plan_cover(struct pt_builder *builder, uint32_t i, int shown)
{
    const struct pt_plan *plan = builder->plan;
    struct cover_args args = {.view = plan->view,
                              .mesh = plan->mesh.list[i].args,
                              .behind = builder->layer > 1,
                              .shown = (uint32_t)shown,
                              .first = plan->mesh.list[i].instance->mesh_style.unlit ? pixels_of(plan) : 0};
    memcpy(args.view.rect, plan->mesh.list[i].rect, sizeof args.view.rect);
    const struct pt_ref refs[] = {pt_keys_of(builder, 0),
                                  pt_from_of(builder, 0),
                                  pt_plane_at(PT_PLANE_NORMAL, 0),
                                  pt_span_of(plan),
                                  pt_plane_at(PT_PLANE_MESH_KEYS, 0),
                                  pt_mesh_buffer_of(PT_MESH_VERTICES, i),
                                  pt_mesh_buffer_of(PT_MESH_INDICES, i),
                                  pt_plane_if(shown, PT_PLANE_MESH_SHOWN, 0),
                                  pt_plane_if(shown, PT_PLANE_MESH_NORMAL, 0),
                                  pt_plane_if(shown, PT_PLANE_MESH_ALBEDO, 0),
                                  pt_plane_if(args.behind != 0, PT_PLANE_LIMIT, 0)};
    struct pt_pass *pass = pt_add(builder, PT_KERNEL_cover, "cover", &args, sizeof args, refs, sizeof refs / sizeof *refs);
    PT_REASON(pass, "mesh %u over what lies behind it", i);
}

static void plan_paint(struct pt_builder *builder, uint32_t i)
{
    const struct pt_plan *plan = builder->plan;
    struct paint_args args = {.view = plan->view, .mesh = plan->mesh.list[i].args};
    memcpy(args.view.rect, plan->mesh.list[i].rect, sizeof args.view.rect);
    PT_REASON(PT_ADD(builder, paint, args,
                     {pt_plane_at(PT_PLANE_MESH_SHOWN, 0), pt_plane_at(PT_PLANE_MESH_KEYS, 0),
                      pt_mesh_buffer_of(PT_MESH_VERTICES, i), pt_mesh_buffer_of(PT_MESH_INDICES, i),
                      pt_mesh_buffer_of(PT_MESH_TEXELS, i), pt_plane_at(PT_PLANE_MESH_ALBEDO, 0)}),
              "mesh %u has an image of %u x %u texels", i, args.mesh.texture.sizes[0], args.mesh.texture.sizes[1]);
}

static void plan_images(struct pt_builder *builder)
{
    const struct pt_plan *plan = builder->plan;
    int some = 0;
    for (uint32_t i = 0; i < plan->mesh.count; i++)
        if (in_view(&plan->mesh.list[i]) && plan->mesh.list[i].args.texture.levels) {
            plan_paint(builder, i);
            some = 1;
        }
    if (!some)
        pt_skip(builder, "paint", plan->mesh.triangles ? "no mesh in view has an image" : "no mesh is in view");
}

static void plan_locate(struct pt_builder *builder, uint32_t i)
{
    const struct pt_plan *plan = builder->plan;
    struct locate_args args = {.view = plan->view, .mesh = plan->mesh.list[i].args, .eye_z = pt_eye_z(builder->scene)};
    memcpy(args.view.rect, plan->mesh.list[i].rect, sizeof args.view.rect);
    PT_REASON(PT_ADD(builder, locate, args,
                     {pt_plane_at(PT_PLANE_MESH_SHOWN, 0), pt_plane_at(PT_PLANE_MESH_KEYS, 0),
                      pt_mesh_buffer_of(PT_MESH_VERTICES, i), pt_mesh_buffer_of(PT_MESH_INDICES, i),
                      pt_plane_at(PT_PLANE_MESH_PLACES, 0), pt_plane_at(PT_PLANE_MESH_WORDS, 0)}),
              "mesh %u receives shadows", i);
}

int pt_mesh_pixels_shadowed(const struct pt_plan *plan)
{
    int some = 0;
    for (uint32_t i = 0; i < plan->mesh.count && plan->light_count; i++)
        some |= in_view(&plan->mesh.list[i]) && pt_mesh_receives(plan->mesh.list[i].instance);
    return some;
}

// Before pixels are tested: where they lie.
static void plan_places(struct pt_builder *builder)
{
    struct pt_plan *plan = builder->plan;
    plan->mesh.shadows = pt_mesh_pixels_shadowed(plan);
    for (uint32_t i = 0; i < plan->mesh.count && plan->light_count; i++)
        if (in_view(&plan->mesh.list[i]) && pt_mesh_receives(plan->mesh.list[i].instance))
            plan_locate(builder, i);
    if (!plan->mesh.shadows)
        pt_skip(builder, "locate",
                !plan->mesh.triangles ? "no mesh is in view"
                : plan->light_count   ? "no mesh in view receives shadows"
                                      : "no light shadows anything");
}

void pt_plan_meshes(struct pt_builder *builder, int shown)
{
    const struct pt_plan *plan = builder->plan;
    if (!plan->mesh.triangles) {
        const char *reason = plan->mesh.count ? "no mesh is in view" : "the scene has no mesh";
        pt_skip(builder, "raster", reason);
        pt_skip(builder, "cover", reason);
    }
    for (uint32_t i = 0; i < plan->mesh.count; i++)
        if (in_view(&plan->mesh.list[i]))
            plan_raster(builder, i);
    for (uint32_t i = 0; i < plan->mesh.count; i++)
        if (in_view(&plan->mesh.list[i]))
            plan_cover(builder, i, shown);
    if (shown) {
        plan_images(builder);
        plan_places(builder);
    }
}

// One colour in place of images', whose opacity stays: of pixels, beside their colours, which a ramp of nothing else takes the place of.
static void paper_with_holes(struct pt_builder *builder, struct shade_args *args)
{
    const float *color = args->instance.color, twice[6] = {color[0], color[1], color[2], color[0], color[1], color[2]};
    args->instance.color_format = PT_COLOR_OF_PLANE;
    args->recolor = (struct recolor_args){.source = PT_RAMP_PLACE};
    pt_plan_ramp(builder, twice, 2, &args->recolor);
}

// unlit: those that light does not change.
static void plan_shade(struct pt_builder *builder, enum pt_plane color, int unlit)
{
    const struct pt_plan *plan = builder->plan;
    struct shade_args args;
    int blended = 0;
    for (uint32_t i = 0; i < plan->mesh.count; i++)
        blended |= in_view(&plan->mesh.list[i]) && plan->mesh.list[i].args.texture.blend;
    pt_shade_lights(builder, plan->mesh.shadows && !unlit, &args);
    if (unlit)
        pt_without_lights(&args);
    // a point for each pixel, with its index as id
    args.instance = (struct instance_args){.id_base = unlit ? pixels_of(plan) : 0,
                                           .id_count = pixels_of(plan),
                                           .slots = pixels_of(plan),
                                           .has_normals = 1,
                                           .color_format = PT_COLOR_OF_PLANE,
                                           .has_opacities = (uint32_t)blended,
                                           .lit = !unlit,
                                           .shininess = 1,
                                           .ambient = 1.0f,
                                           .diffuse = 1.0f,
                                           .opacity = 1.0f};
    pt_own_colors(color, &args);
    if (!pt_line_surface(builder, &args.instance) && args.instance.has_opacities)
        paper_with_holes(builder, &args);
    const struct pt_shade_refs own = {.keys = pt_plane_at(PT_PLANE_MESH_SHOWN, 0),
                                      .normal = pt_plane_at(PT_PLANE_MESH_NORMAL, 0),
                                      .albedo = pt_plane_at(PT_PLANE_MESH_ALBEDO, 0),
                                      .opacities = pt_nothing(),
                                      .shadows = unlit ? pt_nothing() : pt_buffer_of(PT_SHADOWS, PT_PIXELS),
                                      .marks = pt_nothing()};
    PT_REASON(pt_add_shade(builder, color, &args, &own, PT_LATE_PIXELS), "meshes%s, %u lights", unlit ? " that shine" : "",
              args.light_count);
}

void pt_plan_mesh_shade(struct pt_builder *builder, enum pt_plane color)
{
    const struct pt_plan *plan = builder->plan;
    int some[2] = {0, 0};
    for (uint32_t i = 0; i < plan->mesh.count; i++)
        if (in_view(&plan->mesh.list[i]))
            some[plan->mesh.list[i].instance->mesh_style.unlit] = 1;
    for (int unlit = 0; unlit < 2; unlit++)
        if (some[unlit])
            plan_shade(builder, color, unlit);
}
