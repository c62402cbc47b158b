// SPDX-License-Identifier: GPL-3.0-or-later
// shade: id -> colour and normal, Phong. [D 3.1], deferred: only what the picture shows is lit; twin of
// native/device_cpu/kernels/shade.c
//
// STEP 0: normals and opacity (BLEND: of filled pixels over 3 x 3 pixels, kept while walking up a column; WIDE: over any
// window; OPACITY 0: the instance's, 1: points have their own, 2: the colours' plane has it)
// STEP 1: colour, by COLOR_FORMAT and LIT (2: with highlights); PLAIN: only suns and points, and none casts; RECOLOR: by a
// ramp, exposure, contrast
#version 430 core
#include "lib/math.glsl"
#include "lib/planes.glsl"
#include "lib/srgb.glsl"
#include "lib/tiles.glsl"

layout(std430, binding = 0) readonly buffer arguments_block { shade_args args; };
layout(std430, binding = 5) readonly buffer colors_block { uint point_colors[]; };
layout(std430, binding = 6) writeonly buffer shading_block { vec4 shading[]; };
layout(std430, binding = 7) writeonly buffer color_block { vec4 color[]; };
layout(std430, binding = 8) readonly buffer opacities_block { uint opacities[]; }; // four bytes a word
layout(std430, binding = 9) readonly buffer shadows_block { uint shadows[]; };
layout(std430, binding = 10) writeonly buffer arrived_block { float arrived[]; };

#if STEP == 0

float opacity_of(float instance_opacity, uint id, uint at)
{
#if OPACITY == 2
    return uintBitsToFloat(point_colors[4u * at + 3u]);
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

struct tap_row {
    vec4 west, middle, east;
    surface_pixel pixel; // the middle one
};

tap_row read_row(ivec2 size, int x, int y)
{
    surface_pixel pixel = read_pixel(size, x, y);
    return tap_row(read_tap(size, x - 1, y), tap_of(pixel, size, x, y), read_tap(size, x + 1, y), pixel);
}

void add_tap(vec4 tap, float z, float limit, float weight, inout vec3 sum)
{
    precise float apart = tap.w - z;
    precise vec3 more = sum + tap.xyz * weight;
    sum = pt_abs(apart) <= limit ? more : sum;
}

void add_row(tap_row row, float z, float limit, float side, float middle, inout vec3 sum)
{
    add_tap(row.west, z, limit, side, sum);
    add_tap(row.middle, z, limit, middle, sum);
    add_tap(row.east, z, limit, side, sum);
}

#if WIDE
vec3 blend_wide(view_args view, ivec2 size, int x, int y, float z, float limit)
{
    vec3 sum = vec3(0.0);
    int reach = int(args.blend);
    for (int dy = -reach; dy <= reach; dy++)
        for (int dx = -reach; dx <= reach; dx++)
            add_tap(read_tap(size, x + dx, y + dy), z, limit, pt_rcp(float(1 + dx * dx + dy * dy)), sum);
    return sum;
}
#endif

void main()
{
    view_args view = args.view;
    uint id_base = args.instance.id_base, id_count = args.instance.id_count;
    float instance_opacity = args.instance.opacity;
    ivec2 size = ivec2(view.width, view.height);
    uvec2 column = pt_tile_column(view);
    uint end = pt_tile_end(view, column);
    int x = int(column.x);
#if BLEND
    float edge = pt_rcp(2.0), corner = pt_rcp(3.0);
    tap_row below = read_row(size, x, int(column.y) - 1), row = read_row(size, x, int(column.y));
#endif
    for (uint y = column.y; y < end; y++) {
        uint at = y * view.width + column.x;
#if BLEND
        tap_row above = read_row(size, x, int(y) + 1);
        surface_pixel p = row.pixel;
#else
        surface_pixel p = read_pixel(size, x, int(y));
#endif
        uint id = p.key.x - id_base;
        vec3 normal = p.normal;
#if BLEND
        float z = pt_float(p.key.y), limit = read_deff(p.source);
        vec3 sum = vec3(0.0);
        add_row(below, z, limit, corner, edge, sum);
        add_row(row, z, limit, edge, pt_rcp(1.0), sum);
        add_row(above, z, limit, corner, edge, sum);
        normal = p.source == at ? normal : finish_blend(sum, normal);
        below = row;
        row = above;
#elif WIDE
        if (p.source != at)
            normal = finish_blend(blend_wide(view, size, x, int(y), pt_float(p.key.y), read_deff(p.source)), normal);
#endif
        if (id < id_count && p.key.y != PT_KEY_EMPTY_Z)
            shading[at] = vec4(normal, opacity_of(instance_opacity, id, at));
    }
}

#else

#include "lib/recolor.glsl"

struct pixel {
    float z;
    vec2 ray;
    vec3 n, albedo;
};

layout(location = 16) uniform vec4 lights[3 * PT_MAX_LIGHTS]; // colour and type; vector; cone, shadow and its scale

#include "lib/albedo.glsl"

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

// c = albedo (k_a world + k_d sum m E max(n.l, 0) / pi) + albedo k_s sum m E max(r.v, 0)^shininess / pi, m what arrives of
// the light. shadow: the mean m of lights that cast.
vec3 phong(view_args view, float eye_z, vec3 factors, uint shininess, vec3 world, uint light_count, uint id, uint id_count,
           pixel p, out float shadow)
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
    for (uint i = 0u; i < light_count; i++) {
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
    precise vec3 light = factors.x * world + factors.y * diffuse;
    precise vec3 total = p.albedo * (light + factors.z * specular);
    return total;
}

void main()
{
    view_args view = args.view;
    uint id_base = args.instance.id_base, id_count = args.instance.id_count, light_count = args.light_count;
    uint shininess = args.instance.shininess;
    vec3 factors = vec3(args.instance.ambient, args.instance.diffuse, args.instance.specular);
    vec3 style = vec3(args.instance.color[0], args.instance.color[1], args.instance.color[2]);
    vec3 world = vec3(args.world[0], args.world[1], args.world[2]);
    float eye_z = args.eye_z;
    bool write_arrived = args.arrived != 0u;
    uvec2 column = pt_tile_column(view);
    for (uint y = column.y, end = pt_tile_end(view, column); y < end; y++) {
        uint at = y * view.width + column.x;
        uvec2 key = read_key(at);
        uint id = key.x - id_base;
        if (id >= id_count || key.y == PT_KEY_EMPTY_Z)
            continue;
        pixel p;
        p.z = pt_float(key.y);
        p.ray = pt_ray(view, int(column.x), int(y));
        p.albedo = pt_gather_albedo(style, id, at);
#if RECOLOR
        p.albedo = recolor(view, eye_z, p.ray, p.z, style, p.albedo);
#endif
        vec4 shaded = texelFetch(other_float4_plane, int(at));
        p.n = shaded.xyz;
        // 3. light
        float shadow = 1.0;
#if LIT
        vec3 c = phong(view, eye_z, factors, shininess, world, light_count, id, id_count, p, shadow);
#else
        vec3 c = p.albedo;
#endif
        precise vec3 premultiplied = c * shaded.w;
        color[at] = vec4(premultiplied, shaded.w);
        if (write_arrived)
            arrived[at] = shadow;
    }
}

#endif
