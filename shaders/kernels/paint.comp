// SPDX-License-Identifier: GPL-3.0-or-later
// paint: pixels that show a mesh take its image's colour; twin of native/device_cpu/kernels/paint.c
#version 430 core

#include "shared/meshes.h"

layout(local_size_x = 32, local_size_y = 8) in;

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { paint_args args; };
layout(std430, binding = BIND_shown) readonly buffer shown_block { uvec2 shown[]; };
layout(std430, binding = BIND_mesh_keys) readonly buffer mesh_keys_block { uvec2 mesh_keys[]; };
layout(std430, binding = BIND_vertices) readonly buffer vertices_block { float vertices[]; };
layout(std430, binding = BIND_indices) readonly buffer indices_block { uint indices[]; };
layout(std430, binding = BIND_texels) readonly buffer texels_block { uint texels[]; };
layout(std430, binding = BIND_albedo) writeonly buffer albedo_block { vec4 albedo[]; };

#include "lib/texture.glsl"

void main()
{
    view_args view = args.view;
    uint x = view.rect[0] + gl_GlobalInvocationID.x, y = view.rect[1] + gl_GlobalInvocationID.y;
    if (x >= view.rect[2] || y >= view.rect[3])
        return;
    uint at = y * view.width + x, index = mesh_keys[at].x - args.mesh.id_base;
    if (index >= args.mesh.id_count || shown[at].y == PT_KEY_EMPTY_Z)
        return;
    vec4 color = image_at(place_on_image(find_triangle(index, x, y)));
    albedo[at] = vec4(color.xyz, args.mesh.texture.blend != 0u ? color.w : 1.0);
}
