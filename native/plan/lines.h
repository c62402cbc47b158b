// SPDX-License-Identifier: GPL-3.0-or-later
// Silhouettes [X]: where their passes stand in the plan. Without lines all of these add nothing.
#ifndef PT_PLAN_LINES_H
#define PT_PLAN_LINES_H

#include "passes.h"
#include "shared/lines.h"

// Radius of the widest disc in pixels, wherever in the scene; 0: no lines.
float pt_line_radius(const struct patina_scene *scene);
// Pixels by which lines, and what decides them, reach beyond the surface that they belong to.
uint32_t pt_line_reach(const struct pt_plan *plan);

// Sets reach and taps, from `most`.
void pt_line_taps(struct lines_args *args);

// The plane that says where the lines of the layer at hand are.
struct pt_ref pt_line_of(const struct pt_builder *builder);
// Of the layer at hand, before it is shaded. Where layers are peeled, its lines are inked into their sum here.
void pt_plan_lines(struct pt_builder *builder);
// As what the instance's surface is shown: 1: itself, 0: paper, or nothing.
int pt_line_surface(const struct pt_builder *builder, struct instance_args *instance);
// Lines over the colour and z of a layer's passes; PT_PLANE_COUNT: not asked for.
void pt_plan_ink_layer(struct pt_builder *builder, enum pt_plane color, enum pt_plane depth);
// Lines over the picture, or where layers are peeled into its passes alone.
void pt_plan_ink(struct pt_builder *builder, const float background[4]);

#endif
