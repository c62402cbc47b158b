// SPDX-License-Identifier: GPL-3.0-or-later
// ink: lines get their colour. [X 3.3]; twin of native/device_cpu/kernels/ink.c
#version 430 core
#include "shared/picture.h"
#include "lib/math.glsl"
#include "lib/planes.glsl"
#include "lib/srgb.glsl"
#include "lib/by_pixel.glsl"

layout(local_size_x = 32, local_size_y = 8) in;

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { ink_args args; };
layout(std430, binding = BIND_line) readonly buffer line_block { float line[]; };
layout(std430, binding = BIND_nearest) readonly buffer nearest_block { uint nearest[]; };
layout(std430, binding = BIND_colors) readonly buffer colors_block { uint point_colors[]; };
#define POINT_COLOR(i) point_colors[i]
layout(std430, binding = BIND_color) buffer color_block { vec4 color[]; };
layout(std430, binding = BIND_depth) buffer depth_block { float depth[]; };
layout(std430, binding = BIND_mask) writeonly buffer mask_block { float mask[]; };

#include "lib/albedo.glsl"

vec3 line_color(uint id, float z)
{
    vec3 fixed_color = vec3(args.color[0], args.color[1], args.color[2]);
    vec3 style = vec3(args.instance.color[0], args.instance.color[1], args.instance.color[2]);
    if (args.source == 1u) { // PATINA_LINE_POINT
        precise vec3 tinted = fixed_color * pt_gather_albedo(style, id, 0u);
        return tinted;
    }
    precise float far = pt_min(pt_max((z - args.start) * args.scale, 0.0), 1.0);
    precise vec3 mixed = fixed_color * (1.0 - far) + vec3(args.far_color[0], args.far_color[1], args.far_color[2]) * far;
    return args.source == 2u ? mixed : fixed_color; // PATINA_LINE_DEPTH
}

vec4 blended(vec4 under, vec3 line_rgb, float share)
{
    precise float alpha = share * args.opacity;
    precise float left = 1.0 - alpha, through = 1.0 - under.w;
    precise vec4 premultiplied = vec4(line_rgb, 1.0) * alpha;
    precise vec4 over = premultiplied + left * under, behind = under + through * premultiplied;
    return args.behind != 0u ? behind : over;
}

void main()
{
    uint x = gl_GlobalInvocationID.x, y = gl_GlobalInvocationID.y;
    if (x >= args.crop_width || y >= args.crop_height)
        return;
    uint px = args.crop_x + x, py = args.crop_y + y, at = py * args.view.width + px, to = y * args.crop_width + x;
    bool known = px >= args.view.rect[0] && py >= args.view.rect[1] && px < args.view.rect[2] && py < args.view.rect[3];
    float share = known ? line[at] : 0.0;
    if (args.blank != 0u && read_z_bits(at) != PT_KEY_EMPTY_Z)
        color[to] = vec4(args.background[0], args.background[1], args.background[2], args.background[3]);
    precise float shown = share * args.opacity;
    if (args.mask != 0u)
        mask[to] = shown;
    if (!(share > 0.0))
        return;
    uvec2 key = read_key(nearest[at]);
    uint id = key.x - args.instance.id_base;
    if (id - args.instance.id_first >= args.instance.id_count)
        return;
    float z = pt_float(key.y);
    if (args.color_target != 0u)
        color[to] = blended(color[to], line_color(pt_place_of(id, nearest[at]), z), share);
    if (args.depth != 0u && share >= 0.5)
        depth[to] = z;
}
