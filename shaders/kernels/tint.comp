// SPDX-License-Identifier: GPL-3.0-or-later
// tint: the surface near a cut takes the cut's colour, as sections are drawn; twin of native/device_cpu/kernels/tint.c
#version 430 core
#include "lib/math.glsl"
#include "lib/planes.glsl"
#include "lib/tiles.glsl"

layout(std430, binding = 0) readonly buffer arguments_block { tint_args args; };
layout(std430, binding = 2) readonly buffer clips_block { clip_view clips[]; };
layout(std430, binding = 3) buffer color_block { vec4 color[]; };

#include "lib/clip.glsl"

// How far from the cut.
float distance_to(uint clip, vec3 p)
{
    if (clips[clip].shape == PT_CLIP_PLANE)
        return pt_negate(pt_clip_row(clip, 2u, p));
    float d = 0.0;
    for (uint k = 0u; k < 3u; k++) {
        precise float inside = (1.0 - pt_abs(pt_clip_row(clip, k, p))) * clips[clip].half_size[k];
        d = k == 0u ? inside : pt_min(inside, d);
    }
    return clips[clip].shape == PT_CLIP_CUT ? pt_negate(d) : d;
}

float weight_of(uint clip, float d, float per_pixel)
{
    precise float within = (clips[clip].width - d) * per_pixel + 0.5;
    precise float weight = clips[clip].strength * pt_min(pt_max(within, 0.0), 1.0);
    return 0.0 < clips[clip].width ? weight : 0.0;
}

void main()
{
    view_args view = args.view;
    uint id_base = args.id_base, id_count = args.id_count, first = args.clip_first, last = first + args.clip_count;
    uvec2 here = pt_tile_line(view);
    for (uint left = pt_tile_steps(view, here); left != 0u; left--, here += PT_STEP) {
        uint at = here.y * view.width + here.x;
        uvec2 key = read_key(at);
        if (key.x - id_base >= id_count || key.y == PT_KEY_EMPTY_Z)
            continue;
        float z = pt_float(key.y), per_pixel = pt_rcp(pt_footprint(view, z)), most = 0.0, deepest = 0.0;
        vec2 ray = pt_ray(view, int(here.x), int(here.y));
        precise vec3 p = vec3(ray, pt_negate(z + args.eye_z));
        if (view.perspective != 0u)
            p.xy = z * ray;
        uint strongest = first, kept = last;
        for (uint i = first; i < last; i++) {
            float d = distance_to(i, p), weight = weight_of(i, d, per_pixel);
            bool keeps = clips[i].shape == PT_CLIP_KEEP;
            if (keeps && (kept == last || deepest < d)) {
                kept = i;
                deepest = d;
            }
            if (!keeps && most < weight) {
                strongest = i;
                most = weight;
            }
        }
        if (kept != last && most < weight_of(kept, deepest, per_pixel)) {
            strongest = kept;
            most = weight_of(kept, deepest, per_pixel);
        }
        vec4 c = color[at];
        vec3 tint = vec3(clips[strongest].tint[0], clips[strongest].tint[1], clips[strongest].tint[2]);
        precise vec3 mixed = c.rgb + most * (tint * c.a - c.rgb);
        color[at] = vec4(mixed, c.a);
    }
}
