// SPDX-License-Identifier: GPL-3.0-or-later
// Where lights are: their axes, and the points that samples of them and shading are gathered from.
#ifndef PT_LIGHT_POINTS_H
#define PT_LIGHT_POINTS_H

#include "plan.h"

// Rows x, y, z with z against `direction` (unit) and x along `side` as far as it goes.
void pt_light_frame(const double direction[3], const double side[3], double axes[9]);
// Two numbers in [0, 1): even in every prefix; the first is the middle.
void pt_light_sample(uint32_t sample, double p[2]);
// The square [0, 1)^2 onto the disc of radius 1, areas kept, the middle onto the middle; p in and out.
void pt_light_disc(double p[2]);
// The same square onto the lamp, around its middle, world units along its x and y.
void pt_area_point(const patina_light_desc *light, double p[2]);
// Where shading gathers an area light's light: PT_AREA_POINTS positions, world.
void pt_area_points(const patina_light_desc *light, double points[3 * PT_AREA_POINTS]);

#endif
