// SPDX-License-Identifier: GPL-3.0-or-later
// How far from its place a point may show: the radius of its disc or soft ball, world units. What frames, clips or culls adds it to the
// points' boxes.
#ifndef PT_REACH_H
#define PT_REACH_H

#include "scene.h"

// The largest stretch of an object's matrix.
double pt_stretch(const double world_from_object[16]);
// scale: the object's stretch. most: of the widest disc of the chunk; else what nine of ten of its discs stay below.
double pt_disc_reach(const struct patina_scene *scene, const struct pt_instance *instance, const struct pt_chunk *chunk,
                     double scale, int most);
// How many times wider than its footprint a point of a surface is drawn.
float pt_surface_scale(const struct patina_scene *scene);
// Of the chunk's widest ball.
double pt_ball_reach(const struct patina_scene *scene, const struct pt_instance *instance, const struct pt_chunk *chunk,
                     double scale);
// World units of a ball whose radius is 1 in the cloud.
double pt_ball_scale(const struct patina_scene *scene, const struct pt_instance *instance, double scale);
// Of whatever the scene's settings and the instance's style may draw of the chunk. most: at least as much as any plan takes; else, of discs,
// what nine of ten stay below, which frames a picture.
double pt_chunk_reach(const struct patina_scene *scene, const struct pt_instance *instance, const struct pt_chunk *chunk,
                      double scale, int most);
// The most of all chunks that are there, and of all pages on their way.
double pt_instance_reach(const struct patina_scene *scene, const struct pt_instance *instance);

#endif
