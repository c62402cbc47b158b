// SPDX-License-Identifier: GPL-3.0-or-later
// extract: the passes beside the colour, into the crop: z, world-space normal, source, shadow (SPEC 2.2: scholars must see what
// is scan and what is invention); twin of native/device_cpu/kernels/extract.c
#version 430 core
#include "shared/colors.h"
#include "lib/math.glsl"
#include "lib/planes.glsl"

layout(local_size_x = 32, local_size_y = 8) in;

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { extract_args args; };
layout(std430, binding = BIND_depth) writeonly buffer depth_block { float depth[]; };
layout(std430, binding = BIND_normal) writeonly buffer normal_block { float normal[]; }; // 3 a pixel
layout(std430, binding = BIND_source) writeonly buffer source_block { float source[]; };
layout(std430, binding = BIND_arrived) readonly buffer arrived_block { float arrived[]; };
layout(std430, binding = BIND_shadow) writeonly buffer shadow_block { float shadow[]; };
layout(std430, binding = BIND_offset) readonly buffer offset_block { float offset[]; }; // to the middle of a measured pixel
layout(std430, binding = BIND_away) readonly buffer away_block { float away[]; }; // how far off a disc's point fell

float source_value(uint width, uint origin, uint x, uint y)
{
    uvec2 from = pt_pixel(origin, width);
    float dx = float(int(from.x) - int(x)), dy = float(int(from.y) - int(y));
    precise float square = dx * dx + dy * dy;
    precise float distance_to = 1.0 + square * pt_rsqrt(square);
    return square > 0.0 ? distance_to : 1.0;
}

// A dispatch for each plane that is asked for.
void main()
{
    uint width = args.view.width, crop_x = args.crop_x, crop_y = args.crop_y;
    uint crop_width = args.crop_width, crop_height = args.crop_height;
#if PLANE == 1
    vec3 row_x = vec3(args.world_from_view[0], args.world_from_view[1], args.world_from_view[2]);
    vec3 row_y = vec3(args.world_from_view[3], args.world_from_view[4], args.world_from_view[5]);
    vec3 row_z = vec3(args.world_from_view[6], args.world_from_view[7], args.world_from_view[8]);
#endif
    uint x = gl_GlobalInvocationID.x, y = gl_GlobalInvocationID.y;
    if (x >= crop_width || y >= crop_height)
        return;
    uint at = (crop_y + y) * width + crop_x + x, to = y * crop_width + x;
    uint z_bits = read_z_bits(at);
    bool some = z_bits != PT_KEY_EMPTY_Z;
#if PLANE == 0
    precise float z = pt_float(z_bits);
    if (some && read_key(at).x < args.centered)
        z = z + offset[texelFetch(from_plane, int(at)).x & ~PT_FROM_MIXED];
    depth[to] = z;
#elif PLANE == 1
    vec3 v = read_float4(at).xyz;
    vec3 n = some ? vec3(pt_dot(row_x, v), pt_dot(row_y, v), pt_dot(row_z, v)) : vec3(0.0);
    normal[3u * to] = n.x;
    normal[3u * to + 1u] = n.y;
    normal[3u * to + 2u] = n.z;
#elif PLANE == 3
    shadow[to] = some ? arrived[at] : 1.0;
#else
    uint word = texelFetch(from_plane, int(at)).x;
    uint origin = word & ~PT_FROM_MIXED;
    float value = source_value(width, origin, crop_x + x, crop_y + y);
    if (origin == at && read_key(at).x - args.discs_first < args.discs_count)
        value = 1.0 + away[at];
    source[to] = some ? ((word & PT_FROM_MIXED) != 0u ? -value : value) : 0.0;
#endif
}
