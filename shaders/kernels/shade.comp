// SPDX-License-Identifier: GPL-3.0-or-later
// shade: id -> colour and normal, Phong. [D 3.1], deferred: only what the picture shows is lit; twin of
// native/device_cpu/kernels/shade.c
//
// Normals and opacity: BLEND: of filled pixels over 3 x 3 pixels, kept while walking along a line; WIDE: over any window;
// OPACITY 0: the instance's, 1: points have their own, 2: the colours' plane has it.
// Colour, by COLOR_FORMAT and LIT (2: with highlights); LIGHTS: how many; PLAIN: only suns and points, and none casts; CASTING: shadow
// words are read. RECOLOR: by a ramp, exposure, contrast. DIRECTED: ambient light differs by direction.
// SHADING, ARRIVED: whether these planes are written.
#version 430 core
#include "shared/colors.h"
#include "lib/math.glsl"
#include "lib/planes.glsl"
#include "lib/srgb.glsl"
#include "lib/tiles.glsl"
#include "lib/by_pixel.glsl"

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { shade_args args; };
#ifdef PT_SOFTWARE // as in surface
#define POINT_COLOR(i) read_word(i)
#else
layout(std430, binding = BIND_colors) readonly buffer colors_block { uint point_colors[]; };
#define POINT_COLOR(i) point_colors[i]
#endif
layout(std430, binding = BIND_shading) writeonly buffer shading_block { vec4 shading[]; };
layout(std430, binding = BIND_color) writeonly buffer color_block { vec4 color[]; };
layout(std430, binding = BIND_opacities) readonly buffer opacities_block { uint opacities[]; }; // four bytes a word
layout(std430, binding = BIND_shadows) readonly buffer shadows_block { uint shadows[]; };
layout(std430, binding = BIND_marks) readonly buffer marks_block { uint marks[]; };
layout(std430, binding = BIND_arrived) writeonly buffer arrived_block { float arrived[]; };

#include "lib/albedo.glsl"
#include "lib/marks.glsl"
#include "lib/recolor.glsl"

float opacity_of(float instance_opacity, uint id, uint at)
{
#if OPACITY == 2
    return uintBitsToFloat(POINT_COLOR(4u * at + 3u));
#elif OPACITY == 1
    uint byte_value = (opacities[id >> 2] >> (8u * (id & 3u))) & 255u;
    precise float opacity = instance_opacity * (float(byte_value) * 0.00392156885936856); // 1 / 255
    return opacity;
#else
    return instance_opacity;
#endif
}

// The blend, or where it is nothing the source's own normal.
vec3 finish_blend(vec3 sum, vec3 own)
{
    float square = pt_dot(sum, sum);
    precise vec3 unit = sum * pt_rsqrt(square);
    return 1e-12 < square ? unit : own;
}

struct surface_pixel {
    uvec2 key;   // empty beyond the plane
    uint source; // of the surface that it shows, and its normal; 0 of an empty one
    vec3 normal;
};

surface_pixel read_pixel(ivec2 size, int x, int y)
{
    bool inside = x >= 0 && y >= 0 && x < size.x && y < size.y;
    uint at = inside ? uint(y * size.x + x) : 0u;
    uvec2 key = read_key(at);
    key.y = inside ? key.y : PT_KEY_EMPTY_Z;
    uint source = key.y != PT_KEY_EMPTY_Z ? read_from(at) : 0u;
    return surface_pixel(key, source, read_float4(source).xyz);
}

// What a pixel gives to a blend: its normal, and its z.
vec4 tap_of(surface_pixel p, ivec2 size, int x, int y)
{
    precise vec3 normal = p.normal * (p.source == uint(y * size.x + x) ? 1.0 : PT_BLEND_FILLED);
    return vec4(normal, pt_float(p.key.y));
}

vec4 read_tap(ivec2 size, int x, int y) { return tap_of(read_pixel(size, x, y), size, x, y); }

struct tap_row { // across the line
    vec4 low, middle, high;
    surface_pixel pixel; // the middle one
};

tap_row read_row(ivec2 size, ivec2 p)
{
    ivec2 low = p - ivec2(PT_ACROSS), high = p + ivec2(PT_ACROSS);
    surface_pixel pixel = read_pixel(size, p.x, p.y);
    return tap_row(read_tap(size, low.x, low.y), tap_of(pixel, size, p.x, p.y), read_tap(size, high.x, high.y), pixel);
}

// A neighbour of the same layer; of another, nothing.
vec3 same_layer(vec4 tap, float z, float limit)
{
    precise float apart = tap.w - z;
    return pt_abs(apart) <= limit ? tap.xyz : vec3(0.0);
}

vec3 blend_nine(tap_row behind, tap_row row, tap_row ahead, float z, float limit)
{
    vec3 first = same_layer(behind.low, z, limit), last = same_layer(ahead.high, z, limit);
    vec3 higher = same_layer(behind.high, z, limit), further = same_layer(ahead.low, z, limit);
    precise vec3 edges = (same_layer(row.low, z, limit) + same_layer(row.high, z, limit)) +
                         (same_layer(behind.middle, z, limit) + same_layer(ahead.middle, z, limit));
    precise vec3 corners = PT_UPWARDS ? (first + further) + (higher + last) : (first + higher) + (further + last); // of columns
    precise vec3 sum = (same_layer(row.middle, z, limit) * pt_rcp(1.0) + edges * pt_rcp(2.0)) + corners * pt_rcp(3.0);
    return sum;
}

#if WIDE
// Of lib/shown.glsl.
vec4 read_shown(ivec2 size, int x, int y)
{
    bool inside = x >= 0 && y >= 0 && x < size.x && y < size.y;
    vec4 tap = texelFetch(other_float4_plane, inside ? y * size.x + x : 0);
    return vec4(tap.xyz, inside ? tap.w : pt_float(PT_KEY_EMPTY_Z));
}

// Radius of a pixel's window: shared/colors.h.
int reach_of(view_args view, float z, float limit)
{
    precise float spacings = limit * pt_rcp(pt_footprint(view, z));
    precise float reach = floor(spacings * (1.0 / PT_SPACING_FACTOR) + 0.5);
    return int(pt_max(pt_min(reach, float(args.blend)), 1.0));
}

vec3 column(ivec2 size, int x, int y, int dy, float z, float limit)
{
    vec3 below = same_layer(read_shown(size, x, y - dy), z, limit);
    if (dy == 0)
        return below;
    precise vec3 both = below + same_layer(read_shown(size, x, y + dy), z, limit);
    return both;
}

// The four pixels at (+-dx, +-dy) are summed first, columns before rows.
vec3 blend_wide(view_args view, ivec2 size, int x, int y, float z, float limit)
{
    precise vec3 sum = vec3(0.0);
    int reach = reach_of(view, z, limit);
    for (int dy = 0; dy <= reach; dy++)
        for (int dx = 0; dx <= reach; dx++) {
            precise vec3 four = column(size, x - dx, y, dy, z, limit);
            if (dx != 0)
                four = four + column(size, x + dx, y, dy, z, limit);
            sum = sum + four * pt_rcp(float(1 + dx * dx + dy * dy));
        }
    return sum;
}
#endif

#include "lib/phong.glsl"

void main()
{
    view_args view = args.view;
    uint id_base = args.instance.id_base, id_first = args.instance.id_first, id_count = args.instance.id_count;
    uint shininess = args.instance.shininess;
    float instance_opacity = args.instance.opacity, eye_z = args.eye_z;
    vec3 factors = vec3(args.instance.ambient, args.instance.diffuse, args.instance.specular);
    vec3 style = vec3(args.instance.color[0], args.instance.color[1], args.instance.color[2]);
    ivec2 size = ivec2(view.width, view.height);
    uvec2 here = pt_tile_line(view);
    uint left = pt_tile_steps(view, here);
    if (left == 0u)
        return;
#if BLEND
    tap_row behind = read_row(size, ivec2(here - PT_STEP)), row = read_row(size, ivec2(here));
#endif
    do {
        uint at = here.y * view.width + here.x;
        int x = int(here.x), y = int(here.y);
        // 1. the normal
#if BLEND
        tap_row ahead = read_row(size, ivec2(here + PT_STEP));
        surface_pixel own = row.pixel;
#else
        surface_pixel own = read_pixel(size, x, y);
#endif
        uint id = own.key.x - id_base;
        pixel p;
        p.z = pt_float(own.key.y);
        p.n = own.normal;
#if BLEND
        vec3 sum = blend_nine(behind, row, ahead, p.z, read_deff(own.source));
        p.n = own.source == at ? p.n : finish_blend(sum, p.n);
        behind = row;
        row = ahead;
#elif WIDE
        if (own.source != at)
            p.n = finish_blend(blend_wide(view, size, x, y, p.z, read_deff(own.source)), p.n);
#endif
        if (id - id_first < id_count && own.key.y != PT_KEY_EMPTY_Z) {
            // 2. colour and opacity
            uint place = pt_place_of(id, at), of_color = COLOR_FORMAT == 5 ? at : own.source;
            float opacity = opacity_of(instance_opacity, place, of_color);
            p.ray = pt_ray(view, x, y);
            p.albedo = pt_gather_albedo(style, place, of_color);
#if RECOLOR
            p.albedo = recolor(view, eye_z, p.ray, p.z, style, p.albedo);
#endif
            // 3. light
            float shadow = 1.0;
#if LIT
            bool of_pixels = args.of_pixels != 0u;
            uint word = of_pixels ? own.source : id, stride = of_pixels ? view.width * view.height : args.instance.slots;
#if CASTING
            if (args.marked != 0u) {
                word = args.step * pt_shown_place(id);
                stride = 1u;
            }
#endif
            vec3 c = phong(view, eye_z, factors, shininess, word, stride, p, shadow);
#else
            vec3 c = p.albedo;
#endif
            precise vec3 premultiplied = c * opacity;
            color[at] = vec4(premultiplied, opacity);
#if SHADING
            shading[at] = vec4(p.n, opacity);
#endif
#if ARRIVED
            arrived[at] = shadow;
#endif
        }
        here += PT_STEP;
    } while (--left != 0u);
}
