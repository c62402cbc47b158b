// SPDX-License-Identifier: GPL-3.0-or-later
// The walk of a pointwise kernel: reads what its body asks for, runs that, writes colours. native/device_gl/pointwise.c defines
//   PT_ARGUMENTS, PT_RUN: struct and function of the body;   KEYS, SHADING, ALBEDO: whether it reads these planes
//   SLOPES: whether it may read those; where ARGS.of_values is 0 none are bound
//   CLIPS, RESULT: whether it has these. A result is a picture of the crop; else the colours are changed in place, and a picture
//   without keys is the crop.
#version 430 core
#include "shared/colors.h" // of the stages that bodies belong to
#include "shared/effects.h"
#include "shared/picture.h"
#include "lib/math.glsl"
#include "lib/planes.glsl"
#if RESULT || !KEYS
#define OF_CROP 1
layout(local_size_x = 32) in;
#else
#define OF_CROP 0
#include "lib/tiles.glsl"
#endif

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { PT_ARGUMENTS pt_given; };
#if CLIPS
layout(std430, binding = BIND_clips) readonly buffer clips_block { clip_view clips[]; };
#include "lib/clip.glsl"
#define CLIP(i) clips[i]
#define PT_CLIP_ROW(i, k, x, y, z) pt_clip_row(i, k, vec3(x, y, z))
#endif
#if RESULT
layout(std430, binding = BIND_combined) writeonly buffer result_block { vec4 result[]; };
#else
layout(std430, binding = BIND_color) buffer color_block { vec4 colors[]; };
#endif
#define ARGS pt_given

#include "lib/bodies.glsl"
#include "BODY"

// at: in the planes that are read; to: in the picture.
void run(uint at, uint to, uint x, uint y)
{
    pt_here here;
    float color[4];
    here.some = true;
    here.x = x;
    here.y = y;
#if KEYS
    uvec2 key = read_key(at);
    here.some = key.y != PT_KEY_EMPTY_Z;
#if !RESULT
    if (!here.some)
        return;
#endif
    here.z = here.some ? pt_float(key.y) : 1.0;
    here.id = key.x;
#endif
#if SHADING || ALBEDO
    vec4 other = read_float4(at);
    for (int k = 0; k < 3; k++) {
#if SHADING
        here.normal[k] = other[k];
#else
        here.albedo[k] = other[k];
#endif
    }
#endif
#if SHADING && ALBEDO
    other = texelFetch(other_float4_plane, int(at));
    for (int k = 0; k < 3; k++)
        here.albedo[k] = other[k];
#endif
#if SLOPES
    vec4 slope = ARGS.of_values != 0u ? texelFetch(other_float4_plane, int(at)) : vec4(0.0);
    for (int k = 0; k < 4; k++)
        here.slope[k] = slope[k];
#endif
#if RESULT
    vec4 before = read_float4(at);
#else
    vec4 before = colors[at];
#endif
    for (int k = 0; k < 4; k++)
        color[k] = before[k];
    PT_RUN(here, color);
    vec4 after = vec4(color[0], color[1], color[2], color[3]);
#if RESULT
    result[to] = after;
#else
    colors[at] = after;
#endif
}

#if OF_CROP
void main()
{
    uint crop_width = ARGS.crop_width;
    uvec2 first = pt_first_of_row();
    uint x = first.x, y = first.y, end = y < ARGS.crop_height ? min(x + 8u * PT_APART, crop_width) : x;
    for (; x < end; x += PT_APART) {
        uint to = y * crop_width + x;
#if RESULT
        run((ARGS.crop_y + y) * ARGS.view.width + ARGS.crop_x + x, to, x, y);
#else
        run(to, to, x, y);
#endif
    }
}
#else
void main()
{
    view_args view = ARGS.view;
    uvec2 here = pt_tile_line(view);
    for (uint left = pt_tile_steps(view, here); left != 0u; left--, here += PT_STEP) {
        uint at = here.y * view.width + here.x;
        run(at, at, here.x, here.y);
    }
}
#endif
