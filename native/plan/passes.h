// SPDX-License-Identifier: GPL-3.0-or-later
// Adding passes to a plan: what plan.c and the files that plan one room each (plan_*.c) share.
#ifndef PT_PLAN_PASSES_H
#define PT_PLAN_PASSES_H

#include "plan.h"

#include <stdio.h>

struct pt_builder {
    const struct patina_scene *scene;
    struct pt_plan *plan;
    uint32_t room;
    uint32_t layer;  // that passes are added for; 0: the whole picture
    uint32_t tail;   // first shading pass of the last layer planned
    int behind;      // of a light's map, or where what stations looked through is drawn again: the limit plane holds
    int again;       // passes that were planned before: what is left out was said
    const char *as;  // what statistics add its passes to; NULL: their kernels' names
    uint32_t listed; // passes that steps name already
    uint32_t step_room;
    int failed; // PATINA_ERROR_*: memory lacked, or a pass binds what its kernel does not list: the plan fails as a whole
    struct pt_pass nowhere; // written to then
    struct pt_step no_step;
};

// ---- what a pass binds -----------------------------------------------------------------------------------------------

static inline struct pt_ref pt_plane_at(enum pt_plane which, uint32_t level)
{
    return (struct pt_ref){PT_OF_FRAME, which, level};
}
// In place of what the kernel does without.
static inline struct pt_ref pt_nothing(void) { return (struct pt_ref){PT_OF_NOTHING, 0, 0}; }
static inline struct pt_ref pt_plane_if(int wanted, enum pt_plane which, uint32_t level)
{
    return wanted ? pt_plane_at(which, level) : pt_nothing();
}
// Of the layer at hand: the first has its own.
static inline struct pt_ref pt_keys_of(const struct pt_builder *builder, uint32_t level)
{
    return pt_plane_at(builder->layer > 1 && !level ? PT_PLANE_KEYS_BEHIND : PT_PLANE_KEYS, level);
}
static inline struct pt_ref pt_from_of(const struct pt_builder *builder, uint32_t level)
{
    return pt_plane_at(builder->layer > 1 && !level ? PT_PLANE_FROM_BEHIND : PT_PLANE_FROM, level);
}
static inline struct pt_ref pt_shading_of(const struct pt_builder *builder)
{
    return pt_plane_at(builder->layer > 1 ? PT_PLANE_SHADING_BEHIND : PT_PLANE_SHADING, 0);
}
static inline struct pt_ref pt_buffer_of(enum pt_instance_buffer which, uint32_t instance)
{
    return (struct pt_ref){PT_OF_INSTANCE, which, instance};
}
// Of an instance of the scene, for who reads shadow words: where those of marked points lie.
static inline struct pt_ref pt_marks_of(const struct pt_builder *builder, uint32_t instance)
{
    return pt_plan_lazy(builder->scene, builder->plan) ? pt_buffer_of(PT_MARKS, instance) : pt_nothing();
}
// Where nothing is known but spacings, d_eff is the span.
static inline struct pt_ref pt_span_of(const struct pt_plan *plan)
{
    return pt_plane_at(plan->sigmas ? PT_PLANE_SPAN : PT_PLANE_DEFF, 0);
}
// Whether layer distances of the instance's points go by how thick their surface is.
static inline int pt_has_sigmas(const struct pt_plan *plan, const struct pt_plan_instance *instance)
{
    return plan->sigmas && instance->instance->cloud->shapes != NULL;
}
// Of an analysed cloud: its shape words. They lie where radii would, unless it has its own.
static inline struct pt_ref pt_shapes_of(const struct pt_plan_instance *instance, uint32_t i)
{
    return pt_buffer_of(instance->instance->cloud->radii ? PT_SHAPES : PT_RADII, i);
}
static inline struct pt_ref pt_mesh_buffer_of(enum pt_mesh_buffer which, uint32_t mesh)
{
    return (struct pt_ref){PT_OF_MESH, which, mesh};
}
// What finding the instance's pixels reads of it. Returns how many these are.
static inline uint32_t pt_bind_kind(enum pt_kind kind, uint32_t i, struct pt_ref *refs)
{
    const struct pt_kind_row *row = &pt_kinds[kind];
    for (uint32_t k = 0; k < row->buffer_count; k++)
        refs[k] = (struct pt_ref){row->source == PT_SOURCE_MESH ? PT_OF_MESH : PT_OF_INSTANCE, row->buffers[k], i};
    return row->buffer_count;
}

static inline void pt_without_lights(struct shade_args *args) { args->light_count = args->light_types = args->casting = 0; }
// Shading into UNLIT: as without lights.
static inline void pt_own_colors(enum pt_plane color, struct shade_args *args)
{
    if (color != PT_PLANE_UNLIT)
        return;
    args->instance.lit = args->blend = args->arrived = 0;
    pt_without_lights(args);
}

// Orthographic views see z = 0 so far before the camera's plane; view z = -(z + this).
static inline float pt_eye_z(const struct patina_scene *scene)
{
    return scene->camera.orthographic ? (float)scene->camera.near_clip : 0.0f;
}

// What lies behind the points.
static inline const float *pt_background(const patina_settings *settings)
{
    return settings->own_background ? settings->background : settings->world_color;
}

// ---- passes ------------------------------------------------------------------------------------------------------------

// bindings.c: whether refs are what the kernel lists. PATINA_OK, or PATINA_ERROR_INTERNAL with a message at the thread.
int pt_check_bindings(enum pt_kernel kernel, const void *arguments, const struct pt_ref *refs, uint32_t count);

// Adds a pass for the layer at hand; arguments and refs are copied into the plan. Never NULL. Refs that the kernel does not list
// fail the plan.
struct pt_pass *pt_add(struct pt_builder *builder, enum pt_kernel kernel, const char *name, const void *arguments,
                       size_t argument_size, const struct pt_ref *refs, uint32_t ref_count);

#define PT_ADD(builder, kernel, args, ...)                                                                                     \
    pt_add(builder, PT_KERNEL_##kernel, #kernel, &(args), sizeof(args), (struct pt_ref[])__VA_ARGS__,                          \
           sizeof((struct pt_ref[])__VA_ARGS__) / sizeof(struct pt_ref))
#define PT_REASON(pass, ...) snprintf((pass)->reason, sizeof(pass)->reason, __VA_ARGS__)

// Says why a pass is left out; once, with the first layer.
void pt_skip(struct pt_builder *builder, const char *name, const char *reason);

// ---- steps: steps.c --------------------------------------------------------------------------------------------------

// Never NULL; what is added next moves it.
struct pt_step *pt_add_step(struct pt_builder *builder, enum pt_step_of of);
// A step whose own follow, and its place; then its own end here.
uint32_t pt_open_step(struct pt_builder *builder, enum pt_step_of of);
struct pt_step *pt_step_at(struct pt_builder *builder, uint32_t at);
void pt_close_step(struct pt_builder *builder, uint32_t at);
// The passes added since the last; none: no step.
void pt_add_passes_step(struct pt_builder *builder, enum pt_step_of of);
// What is cleared before the layer at hand; shown: what pixels show of meshes too.
void pt_plan_clears(struct pt_builder *builder, int shown);
void pt_plan_no_density(struct pt_builder *builder); // before soft points are counted in the pass
void pt_plan_no_veil(struct pt_builder *builder);    // before those of a light's map are
void pt_plan_peeling(struct pt_builder *builder);    // and before the first of several
void pt_plan_light_steps(struct pt_builder *builder);

// plan.c: the passes of a depth map with its holes filled, and no more: scatter to fill. builder->behind: only of what lies behind the
// limit plane.
int pt_plan_depth(struct pt_builder *builder);

// ---- effects: effects.c --------------------------------------------------------------------------------------------

int pt_effects_want_normals(const struct patina_scene *scene);
int pt_effects_want_albedo(const struct patina_scene *scene);
// Before shading: what drawn effects know of the points that pixels show.
void pt_plan_values(struct pt_builder *builder);
// On what shading gave, in place: before smoothing.
void pt_plan_shaded_effects(struct pt_builder *builder, enum pt_plane color);
// On the smoothed colour, in place.
void pt_plan_drawn_effects(struct pt_builder *builder, enum pt_plane color);
// Whether the picture has depth of field; and it, in place of composing.
int pt_effects_focus(const struct patina_scene *scene);
void pt_plan_focus(struct pt_builder *builder, enum pt_plane color, const struct compose_args *compose);
// On the composed image, in place: of the crop alone, with lines and soft points.
void pt_plan_picture_effects(struct pt_builder *builder);

// ---- meshes: mesh.c -----------------------------------------------------------------------------------------------

// Draws the meshes in view over the layer's filled points; shown: they are shaded, too.
void pt_plan_meshes(struct pt_builder *builder, int shown);
// Whether some mesh in view receives shadows.
int pt_mesh_pixels_shadowed(const struct pt_plan *plan);
// Lights and colours what they show, into COLOR_A, or UNLIT for their own colours.
void pt_plan_mesh_shade(struct pt_builder *builder, enum pt_plane color);
// shading.c: what shading asks of the view, the world and the lights; receives: whether there are shadow words to be read.
void pt_shade_lights(const struct pt_builder *builder, int receives, struct shade_args *args);
struct pt_ref pt_light_of(struct pt_builder *builder, const struct shade_args *args); // what a lit pass reads of them
// Adds a pass of kernel shade into `color`. own: what it reads of the instance, or of the meshes' pixels. words: when shadow words are read.
struct pt_shade_refs {
    struct pt_ref keys, normal, albedo, opacities, shadows, marks;
};
struct pt_pass *pt_add_shade(struct pt_builder *builder, enum pt_plane color, const struct shade_args *args,
                             const struct pt_shade_refs *own, enum pt_late words);
static inline struct pt_ref pt_ramps_of(const struct shade_args *args)
{
    return args->recolor.source ? (struct pt_ref){PT_OF_PLAN, PT_PLAN_RAMPS, 0} : pt_nothing();
}
// `words`, where some light's are read.
static inline enum pt_late pt_shade_late(const struct shade_args *args, enum pt_late words)
{
    return args->casting ? words : PT_LATE_NOTHING;
}
// splats.c: discs in place of points and filling. Says of the passes of filling why they are left out.
void pt_plan_splat(struct pt_builder *builder);
int pt_tells_surfaces(const struct pt_builder *builder); // the depth asked for is that of the surface
void pt_plan_blend(struct pt_builder *builder);          // after pt_plan_resolve of every instance; nothing where no discs are
int pt_blends_light(const struct pt_builder *builder);   // light arrives at all discs of a pixel: at the mean of their words
void pt_plan_blend_marks(struct pt_builder *builder);    // in place of mark
void pt_plan_blend_light(struct pt_builder *builder);    // once shadow words are known
void pt_join_discs(const struct pt_plan_instance *instance, struct resolve_args *args); // to one surface a layer

// ranges.c: instances that are drawn as range images, over the keys of the others.
void pt_plan_ranges(struct pt_builder *builder);
void pt_plan_reveal(struct pt_builder *builder); // beside pt_plan_assess: how far their scans lie apart

// filling.c: levels and what closes holes at each.
void pt_plan_filling(struct pt_builder *builder);
// average.c: colours and normals of instances that are filled, once they are. Whether this is one whose are means.
void pt_plan_average(struct pt_builder *builder);
int pt_averages(const struct pt_builder *builder, const struct pt_plan_instance *instance);

// The instance's field, as all its passes bind it: with one radius where the style has one.
static inline struct pt_ref pt_field_of(const struct pt_plan_instance *instance, uint32_t i)
{
    return pt_buffer_of(instance->instance->style.soft_radius > 0.0f ? PT_FIELD_ONE : PT_FIELD, i);
}
// soft.c: soft points over the picture.
void pt_plan_soft(struct pt_builder *builder);
static inline int pt_counts_soft(const struct pt_builder *builder) // for the pass of their density, which is cleared before
{
    return builder->plan->soft.part_count && builder->scene->settings.passes >> PATINA_PASS_DENSITY & 1u;
}
// Of several layers, before one is shaded: those between it and the layer before; and behind the last.
void pt_plan_soft_layer(struct pt_builder *builder);
void pt_plan_soft_beyond(struct pt_builder *builder);
// Of a light's map with soft points in it: what its rays lose in each of plan->soft.veils slabs.
void pt_plan_veil(struct pt_builder *builder);
static inline float pt_veil_deep(const struct pt_plan *plan)
{
    const float deep = (plan->soft.depths[1] - plan->soft.depths[0]) / (float)plan->soft.veils;
    return deep > 1e-30f ? deep : 1e-30f;
}

// assess.c: trust and thickness of what the picture shows.
void pt_plan_assess(struct pt_builder *builder);

// reopen.c: what was closed where stations looked through. Of pictures of one layer, not of light maps.
int pt_plan_reopen_find(
    struct pt_builder *builder); // after filling. 0: nothing asks for it; else the layer is planned again, behind
void pt_plan_reopen_keep(struct pt_builder *builder);                      // before filling, the last time
void pt_plan_reopen_take(struct pt_builder *builder);                      // after it
void pt_plan_reopen_show(struct pt_builder *builder, enum pt_plane color); // after shading

// points.c: points as pixels; normal and layer distance of an instance's pixels; and why some of that was not needed.
void pt_plan_points(struct pt_builder *builder);
void pt_plan_resolve(struct pt_builder *builder, uint32_t instance);
void pt_plan_resolved(struct pt_builder *builder);
// passes.c: whether the plan has a pass of the kernel so far.
int pt_has_pass(const struct pt_plan *plan, enum pt_kernel kernel);

// ---- views -------------------------------------------------------------------------------------------------------------

// Of a pixel of the full picture: at distance 1 in perspective, or anywhere; world units.
double pt_pixel_width(const struct patina_scene *scene);
struct view_args pt_view_at(const struct pt_plan *plan, uint32_t level);
// The instance's rectangle, wider by what filling may carry its points.
struct view_args pt_view_of(const struct pt_plan *plan, const struct pt_plan_instance *instance, uint32_t margin);
// Where the instance may show once holes are filled: nothing is filled beyond the plan's rectangle.
struct view_args pt_view_filled(const struct pt_plan *plan, const struct pt_plan_instance *instance);

#endif
