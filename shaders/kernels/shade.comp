// SPDX-License-Identifier: GPL-3.0-or-later
// shade: id -> colour and normal, Phong. [D 3.1], deferred: only what the picture shows is lit; twin of
// native/device_cpu/kernels/shade.c
//
// Normals and opacity: BLEND: of filled pixels over 3 x 3 pixels, kept while walking along a line; WIDE: over any window;
// OPACITY 0: the instance's, 1: points have their own, 2: the colours' plane has it.
// Colour, by COLOR_FORMAT and LIT (2: with highlights); LIGHTS: how many; PLAIN: only suns and points, and none casts;
// RECOLOR: by a ramp, exposure, contrast. DIRECTED: ambient light differs by direction.
// SHADING, ARRIVED: whether these planes are written.
#version 430 core
#include "lib/math.glsl"
#include "lib/planes.glsl"
#include "lib/srgb.glsl"
#include "lib/tiles.glsl"

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
layout(std430, binding = BIND_arrived) writeonly buffer arrived_block { float arrived[]; };

#include "lib/albedo.glsl"
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

// Radius of a pixel's window: kernel_args.h.
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

struct pixel {
    float z;
    vec2 ray;
    vec3 n, albedo;
};

layout(location = 16) uniform vec4 lights[3 * PT_MAX_LIGHTS]; // colour and type; vector; cone, shadow and its scale

float power(float x, uint exponent)
{
    precise float result = 1.0, square = x;
    for (; exponent != 0u; exponent >>= 1) {
        if ((exponent & 1u) != 0u)
            result = result * square;
        square = square * square;
    }
    return result;
}

// Direction to the light at `from` and its falloff there, times what is in falloff; suns have neither.
vec3 towards(uint light, uint type, vec3 from, vec3 point, inout float falloff)
{
    if (type == 1u) // PATINA_LIGHT_SUN
        return from;
    precise vec3 l = from - point;
    float scale = pt_rsqrt(pt_max(pt_dot(l, l), 1e-20));
    l = l * scale;
    precise float less = falloff * (scale * scale);
    falloff = less;
#if PLAIN
    return l;
#else
    if (type == 2u) // PATINA_LIGHT_POINT
        return l;
    vec3 axis = vec3(args.lights[light].axis[0], args.lights[light].axis[1], args.lights[light].axis[2]);
    float cosine = 0.0 - pt_dot(axis, l);
    if (type == 4u) { // PATINA_LIGHT_AREA: one side shines, as matt paper
        falloff = falloff * pt_max(cosine, 0.0);
        return l;
    }
    vec4 cone = lights[3u * light + 2u];
    float edge = pt_min(pt_max((cosine - cone.x) * cone.y, 0.0), 1.0);
    falloff = falloff * ((edge * edge) * (3.0 - 2.0 * edge));
    return l;
#endif
}

void add_light(uint light, uint type, vec3 from, float share, uint shininess, vec3 n, vec3 point, vec3 to_eye,
               inout vec3 diffuse, inout vec3 specular)
{
    vec3 color_of_light = lights[3u * light].xyz;
    precise float falloff = 0.31830988618; // 1 / pi: radiance of a white Lambert surface under unit irradiance
    precise vec3 l = towards(light, type, from, point, falloff);
    falloff = falloff * share;
    precise float cosine = pt_dot(n, l);
    precise float lambert = pt_max(cosine, 0.0) * falloff;
    precise vec3 lit = diffuse + color_of_light * lambert;
    diffuse = lit;
#if LIT == 2
    precise vec3 r = (2.0 * cosine) * n - l;
    precise float shine = power(pt_min(pt_max(pt_dot(r, to_eye), 0.0), 1.0), shininess) * falloff;
    shine = 0.0 < cosine ? shine : 0.0;
    precise vec3 glossy = specular + color_of_light * shine;
    specular = glossy;
#endif
}

#if DIRECTED
float ambient_of(uint k, vec3 n)
{
    precise float low = (args.ambient[k] + args.ambient[k + 1u] * n.x) + (args.ambient[k + 2u] * n.y + args.ambient[k + 3u] * n.z);
    precise float mixed = (args.ambient[k + 4u] * (n.x * n.y) + args.ambient[k + 5u] * (n.y * n.z)) +
                          args.ambient[k + 6u] * (n.z * n.x);
    precise float square = args.ambient[k + 7u] * (n.x * n.x - n.y * n.y) + args.ambient[k + 8u] * (3.0 * (n.z * n.z) - 1.0);
    precise float sum = (low + mixed) + square;
    return pt_max(sum, 0.0);
}
#endif

// c = albedo (k_a world + k_d sum m E max(n.l, 0) / pi) + albedo k_s sum m E max(r.v, 0)^shininess / pi, m what arrives of
// the light. shadow: the mean m of lights that cast.
vec3 phong(view_args view, float eye_z, vec3 factors, uint shininess, vec3 world, uint id, uint id_count, pixel p,
           out float shadow)
{
    precise vec3 point = vec3(p.ray, pt_negate(p.z + eye_z));
    precise vec3 to_eye = vec3(0.0, 0.0, 1.0);
    if (view.perspective != 0u) {
        point = vec3(p.z * p.ray, pt_negate(p.z));
        to_eye = vec3(0.0 - p.ray, 1.0);
    }
    bool away = pt_dot(p.n, to_eye) < 0.0; // both sides are lit
    if (view.perspective != 0u && factors.z > 0.0) // only shine needs it as a unit
        to_eye = to_eye * pt_ray_rsqrt(p.ray);
    vec3 n = away ? 0.0 - p.n : p.n;
    vec3 diffuse = vec3(0.0), specular = vec3(0.0);
    precise float sum = 0.0;
    uint casting = 0u;
    for (uint i = 0u; i < LIGHTS; i++) {
        uint type = uint(lights[3u * i].w);
        precise float share = 1.0;
#if PLAIN
        add_light(i, type, lights[3u * i + 1u].xyz, share, shininess, n, point, to_eye, diffuse, specular);
#else
        vec4 extra = lights[3u * i + 2u];
        if (extra.z != 0.0) {
            uint lost = shadows[(uint(extra.z) - 1u) * id_count + id] & PT_SHADOW_SUM;
            share = 1.0 - float(lost) * extra.w;
            sum = sum + share;
            casting++;
        }
        if (type != 4u)
            add_light(i, type, lights[3u * i + 1u].xyz, share, shininess, n, point, to_eye, diffuse, specular);
        for (uint j = 0u; type == 4u && j < PT_AREA_POINTS; j++)
            add_light(i, type, vec3(args.lights[i].points[3u * j], args.lights[i].points[3u * j + 1u],
                                    args.lights[i].points[3u * j + 2u]),
                      share, shininess, n, point, to_eye, diffuse, specular);
#endif
    }
    precise float mean = sum / float(casting);
    shadow = casting != 0u ? mean : 1.0;
#if DIRECTED
    world = vec3(ambient_of(0u, n), ambient_of(9u, n), ambient_of(18u, n));
#endif
    precise vec3 light = factors.x * world + factors.y * diffuse;
    precise vec3 total = p.albedo * (light + factors.z * specular);
    return total;
}

void main()
{
    view_args view = args.view;
    uint id_base = args.instance.id_base, id_count = args.instance.id_count;
    uint shininess = args.instance.shininess;
    float instance_opacity = args.instance.opacity, eye_z = args.eye_z;
    vec3 factors = vec3(args.instance.ambient, args.instance.diffuse, args.instance.specular);
    vec3 style = vec3(args.instance.color[0], args.instance.color[1], args.instance.color[2]);
    vec3 world = vec3(args.world[0], args.world[1], args.world[2]);
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
        if (id < id_count && own.key.y != PT_KEY_EMPTY_Z) {
            // 2. colour and opacity
            uint of_color = COLOR_FORMAT == 5 ? at : own.source;
            float opacity = opacity_of(instance_opacity, id, of_color);
            p.ray = pt_ray(view, x, y);
            p.albedo = pt_gather_albedo(style, id, of_color);
#if RECOLOR
            p.albedo = recolor(view, eye_z, p.ray, p.z, style, p.albedo);
#endif
            // 3. light
            float shadow = 1.0;
#if LIT
            vec3 c = phong(view, eye_z, factors, shininess, world, id, id_count, p, shadow);
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
