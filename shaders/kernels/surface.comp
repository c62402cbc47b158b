// SPDX-License-Identifier: GPL-3.0-or-later
// surface: key -> view-space normal, 1 / max(|n.v|, C), d_eff (SPEC 1); twin of native/device_cpu/kernels/surface.c
#version 430 core
#include "lib/math.glsl"

layout(local_size_x = 16, local_size_y = 8) in;

layout(std430, binding = 0) readonly buffer arguments_block { surface_args args; };
layout(std430, binding = 1) readonly buffer keys_block { uvec2 keys[]; };
layout(std430, binding = 2) readonly buffer surface_block { uint surface[]; };
layout(std430, binding = 3) buffer normals_block { vec4 normals[]; };
layout(std430, binding = 4) writeonly buffer deff_block { float deff[]; };
layout(std430, binding = 5) writeonly buffer from_block { uint from[]; };

void main()
{
    view_args view = args.view;
    uint x = view.rect[0] + gl_GlobalInvocationID.x, y = view.rect[1] + gl_GlobalInvocationID.y;
    if (x >= view.rect[2] || y >= view.rect[3])
        return;
    uint at = y * view.width + x;

    // 1. the point
    uvec2 key = keys[at];
    uint id = key.x - args.instance.id_base;
    if (id >= args.instance.id_count || key.y == PT_KEY_EMPTY_Z)
        return;
    float z = pt_float(key.y);
    vec2 ray = pt_ray(view, int(x), int(y));
    uint word = surface[id];
    float spacing = args.instance.spacing[word >> PT_SPACING_SHIFT];
    // 2. its normal, in view space: the cloud's, or the estimate that the normal plane holds
    bool none = false;
    vec3 n;
    if (args.instance.has_normals != 0u) {
        vec3 o = pt_decode_normal(word);
        n = vec3(pt_dot(vec3(args.instance.normal_matrix[0], args.instance.normal_matrix[1],
                             args.instance.normal_matrix[2]), o),
                 pt_dot(vec3(args.instance.normal_matrix[3], args.instance.normal_matrix[4],
                             args.instance.normal_matrix[5]), o),
                 pt_dot(vec3(args.instance.normal_matrix[6], args.instance.normal_matrix[7],
                             args.instance.normal_matrix[8]), o));
        none = (word & PT_NORMAL_BITS) == PT_NORMAL_NONE;
    } else {
        n = normals[at].xyz;
    }
    float square = pt_dot(n, n);
    none = none || !(1e-30 <= square);
    precise vec3 unit = n * pt_rsqrt(square);
    // 3. without one: towards the viewer
    float inverse = 1.0;
    if (none) {
        unit = vec3(0.0, 0.0, 1.0);
        if (view.perspective != 0u) {
            float r = pt_ray_rsqrt(ray);
            unit = vec3(pt_negate(ray.x) * r, pt_negate(ray.y) * r, r);
        }
    } else {
        inverse = pt_rcp(pt_max(pt_cosine(view, unit, ray), PT_COSINE_FLOOR));
    }
    // 4. cosine and layer distance
    normals[at] = vec4(unit, inverse);
    deff[at] = pt_layer_distance(view, args.instance.d_min, spacing, z, inverse);
    from[at] = at;
}
