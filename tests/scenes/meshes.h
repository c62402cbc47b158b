// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes for whole-frame tests.
#ifndef TEST_MESHES_H
#define TEST_MESHES_H

#include <patina/patina.h>

patina_mesh *mesh_box(const double middle[3], const double half[3]); // flat
patina_mesh *mesh_sphere(const double middle[3], double radius, uint32_t rings, int normals);
void mesh_add(patina_scene *scene, const patina_mesh *mesh, float red, float green, float blue);

#endif
