// SPDX-License-Identifier: GPL-3.0-or-later
// resolve: key -> view-space normal, 1 / max(|n.v|, C), d_eff (SPEC 1); twin of native/device_cpu/kernels/resolve.c
//   NORMALS: whether the cloud has normals; SIGMAS: whether it was analysed; SPAN: whether that plane is written
#version 430 core
#include "shared/measured.h"
#include "lib/math.glsl"
#include "lib/planes.glsl"
#include "lib/tiles.glsl"
#include "lib/by_pixel.glsl"

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { resolve_args args; };
layout(location = 16) uniform float spacings[PT_SPACINGS]; // args.instance.spacing
#ifdef PT_SOFTWARE // a texel takes half the time of a block's word; elsewhere blocks hold more
#define WORD(i) read_word(i)
#else
layout(std430, binding = BIND_surfels) readonly buffer surfels_block { uint surfels[]; };
#define WORD(i) surfels[i]
#endif
layout(std430, binding = BIND_normal) writeonly buffer normals_block { vec4 normals[]; };
layout(std430, binding = BIND_deff) writeonly buffer deff_block { float deff[]; };
layout(std430, binding = BIND_from) writeonly buffer from_block { uint from[]; };
#if SIGMAS
layout(std430, binding = BIND_shapes) readonly buffer shapes_block { uint shapes[]; };
#endif
#if SPAN
layout(std430, binding = BIND_span) writeonly buffer span_block { float span[]; };
#endif

struct instance_part {
    uint id_base, id_first, id_count;
    float d_min, sigma_scale;
    vec3 rows[3]; // of the normal matrix
};

void resolve_pixel(view_args view, instance_part instance, uint x, uint y)
{
    uint at = y * view.width + x;
    // 1. the point
    uvec2 key = read_key(at);
    uint id = key.x - instance.id_base;
    if (id - instance.id_first >= instance.id_count || key.y == PT_KEY_EMPTY_Z)
        return;
    float z = pt_float(key.y);
    vec2 ray = pt_ray(view, int(x), int(y));
    uint place = pt_place_of(id, at);
    uint word = WORD(place);
    float spacing = spacings[word >> PT_SPACING_SHIFT];
    // 2. its normal, in view space: the cloud's, or the estimate that the normal plane holds
    vec3 object = pt_decode_normal(word);
    vec3 n = vec3(pt_dot(instance.rows[0], object), pt_dot(instance.rows[1], object), pt_dot(instance.rows[2], object));
    bool none = (word & PT_NORMAL_BITS) == PT_NORMAL_NONE;
#if !NORMALS
    n = read_float4(at).xyz;
    none = false;
#endif
    float square = pt_dot(n, n);
    none = none || !(1e-30 <= square);
    precise vec3 unit = n * pt_rsqrt(square);
    // 3. without one: towards the viewer
    float r = pt_ray_rsqrt(ray);
    precise vec3 towards = vec3(pt_negate(ray.x) * r, pt_negate(ray.y) * r, r);
    if (view.perspective == 0u)
        towards = vec3(0.0, 0.0, 1.0);
    unit = none ? towards : unit;
    // 4. cosine and layer distance
    float inverse = pt_rcp(pt_max(pt_cosine(view, unit, ray), PT_COSINE_FLOOR));
    inverse = none ? 1.0 : inverse;
    normals[at] = vec4(unit, inverse);
    float by_spacing = pt_layer_distance(view, instance.d_min, spacing, z, inverse), distance_of = by_spacing;
#if SIGMAS
    uint sigma_class = (shapes[place] >> PT_SHAPE_SIGMA_SHIFT) & PT_SHAPE_CLASS_BITS;
    precise float sigma = spacings[sigma_class] * instance.sigma_scale;
    if (sigma_class != 0u)
        distance_of = pt_sure_distance(view, instance.d_min, sigma, spacing, z, inverse);
#endif
    deff[at] = distance_of;
#if SPAN
    span[at] = by_spacing;
#endif
    from[at] = at;
}

void main()
{
    view_args view = args.view;
    instance_part instance;
    instance.id_base = args.instance.id_base;
    instance.id_first = args.instance.id_first;
    instance.id_count = args.instance.id_count;
    instance.d_min = args.instance.d_min;
    instance.sigma_scale = args.sigma_scale;
    for (int i = 0; i < 3; i++)
        instance.rows[i] = vec3(args.instance.normal_matrix[3 * i], args.instance.normal_matrix[3 * i + 1],
                                args.instance.normal_matrix[3 * i + 2]);
    uvec2 here = pt_tile_line(view);
    uint left = pt_tile_steps(view, here);
    if (left == 0u)
        return;
    do {
        resolve_pixel(view, instance, here.x, here.y);
        here += PT_STEP;
    } while (--left != 0u);
}
