// SPDX-License-Identifier: GPL-3.0-or-later
// shade: id -> colour and normal, Phong. [D 3.1], deferred: only what the picture shows is lit; twin of
// native/device_cpu/kernels/shade.c
#version 430 core
#include "lib/math.glsl"
#include "lib/srgb.glsl"

layout(local_size_x = 32, local_size_y = 8) in;

layout(std430, binding = 0) readonly buffer arguments_block { shade_args args; };
layout(std430, binding = 1) readonly buffer keys_block { uvec2 keys[]; };
layout(std430, binding = 2) readonly buffer from_block { uint from[]; };
layout(std430, binding = 3) readonly buffer normals_block { vec4 normals[]; };
layout(std430, binding = 4) readonly buffer deff_block { float deff[]; };
layout(std430, binding = 5) readonly buffer surface_block { uint surface[]; };
layout(std430, binding = 6) readonly buffer colors_block { uint point_colors[]; };
layout(std430, binding = 7) writeonly buffer shading_block { vec4 shading[]; };
layout(std430, binding = 8) writeonly buffer color_block { vec4 color[]; };

struct pixel {
    uint x, y, at;
    uint id, from;
    float z;
    vec2 ray;
    vec3 n, albedo;
};

vec3 gather_albedo(uint color_format, vec3 style, uint id)
{
    if (color_format == 0u)
        return style;
    if (color_format == 2u)
        return vec3(uintBitsToFloat(point_colors[3u * id]), uintBitsToFloat(point_colors[3u * id + 1u]),
                    uintBitsToFloat(point_colors[3u * id + 2u]));
    // three bytes from byte 3 id on: they lie in one word or two
    uint first = 3u * id, shift = 8u * (first & 3u);
    uint bytes = point_colors[first >> 2] >> shift;
    if (shift > 8u)
        bytes |= point_colors[(first >> 2) + 1u] << (32u - shift);
    return vec3(pt_srgb(bytes & 255u), pt_srgb((bytes >> 8) & 255u), pt_srgb((bytes >> 16) & 255u));
}

// The normal of a filled pixel, refined: measured neighbours of its layer, weighted by 1 / (1 + distance^2), as far as
// the pixel it was filled from. Zero when there is none.
vec3 blend_normal(view_args view, pixel p)
{
    int width = int(view.width), height = int(view.height), x = int(p.x), y = int(p.y);
    int sx = abs(int(p.from % view.width) - x), sy = abs(int(p.from / view.width) - y);
    int r = min(max(sx, sy) + 1, 8);
    float limit = deff[p.from];
    precise vec3 n = vec3(0.0);
    for (int dy = -r; dy <= r; dy++)
        for (int dx = -r; dx <= r; dx++) {
            int qx = x + dx, qy = y + dy;
            if (qx < 0 || qy < 0 || qx >= width || qy >= height)
                continue;
            uint q = uint(qy) * view.width + uint(qx);
            precise float apart = pt_float(keys[q].y) - p.z;
            if (!(pt_abs(apart) <= limit) || (from[q] & ~PT_FROM_MIXED) != q)
                continue;
            n = n + normals[q].xyz * pt_rcp(float(1 + dx * dx + dy * dy));
        }
    return n;
}

vec3 gather_normal(view_args view, bool refined, pixel p)
{
    vec3 n = normals[p.from].xyz;
    if (refined && p.from != p.at) {
        vec3 blend = blend_normal(view, p);
        float square = pt_dot(blend, blend);
        precise vec3 unit = blend * pt_rsqrt(square);
        if (square > 1e-12)
            n = unit;
    }
    return n;
}

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

void add_light(light_args light, float specular_factor, uint shininess, vec3 n, vec3 point, vec3 to_eye,
               inout vec3 diffuse, inout vec3 specular)
{
    precise vec3 l = vec3(light.vector[0], light.vector[1], light.vector[2]);
    vec3 color_of_light = vec3(light.color[0], light.color[1], light.color[2]);
    precise float falloff = 0.31830988618; // 1 / pi: radiance of a white Lambert surface under unit irradiance
    if (light.type == 2u) {                // PATINA_LIGHT_POINT
        l = l - point;
        float scale = pt_rsqrt(pt_max(pt_dot(l, l), 1e-20));
        l = l * scale;
        falloff = falloff * (scale * scale);
    }
    precise float cosine = pt_dot(n, l);
    precise float lambert = pt_max(cosine, 0.0) * falloff;
    precise vec3 lit = diffuse + color_of_light * lambert;
    diffuse = lit;
    if (!(specular_factor > 0.0))
        return;
    precise vec3 r = (2.0 * cosine) * n - l;
    precise float shine = power(pt_min(pt_max(pt_dot(r, to_eye), 0.0), 1.0), shininess) * falloff;
    shine = 0.0 < cosine ? shine : 0.0;
    precise vec3 glossy = specular + color_of_light * shine;
    specular = glossy;
}

// c = albedo (k_a world + k_d sum E max(n.l, 0) / pi) + albedo k_s sum E max(r.v, 0)^shininess / pi
vec3 phong(view_args view, float eye_z, vec3 factors, uint shininess, vec3 world, uint light_count, pixel p)
{
    precise vec3 point = vec3(p.ray, 0.0 - (p.z + eye_z));
    precise vec3 to_eye = vec3(0.0, 0.0, 1.0);
    if (view.perspective != 0u) {
        float r = pt_ray_rsqrt(p.ray);
        point = vec3(p.z * p.ray, 0.0 - p.z);
        to_eye = vec3(0.0 - p.ray * r, r);
    }
    bool away = pt_dot(p.n, to_eye) < 0.0; // both sides are lit
    vec3 n = away ? 0.0 - p.n : p.n;
    vec3 diffuse = vec3(0.0), specular = vec3(0.0);
    for (uint i = 0u; i < light_count; i++)
        add_light(args.lights[i], factors.z, shininess, n, point, to_eye, diffuse, specular);
    precise vec3 light = factors.x * world + factors.y * diffuse;
    precise vec3 sum = p.albedo * (light + factors.z * specular);
    return sum;
}

void main()
{
    view_args view = args.view;
    uint id_base = args.instance.id_base, id_count = args.instance.id_count, format = args.instance.color_format;
    uint shininess = args.instance.shininess, light_count = args.light_count;
    bool lit = args.instance.lit != 0u, refined = args.refined != 0u;
    vec3 factors = vec3(args.instance.ambient, args.instance.diffuse, args.instance.specular);
    vec3 style = vec3(args.instance.color[0], args.instance.color[1], args.instance.color[2]);
    vec3 world = vec3(args.world[0], args.world[1], args.world[2]);
    float eye_z = args.eye_z;
    pixel p;
    p.x = view.rect[0] + gl_GlobalInvocationID.x;
    p.y = view.rect[1] + gl_GlobalInvocationID.y;
    if (p.x >= view.rect[2] || p.y >= view.rect[3])
        return;
    p.at = p.y * view.width + p.x;

    // 1. the point
    uvec2 key = keys[p.at];
    p.id = key.x - id_base;
    if (p.id >= id_count || key.y == PT_KEY_EMPTY_Z)
        return;
    p.z = pt_float(key.y);
    p.from = from[p.at] & ~PT_FROM_MIXED;
    p.ray = pt_ray(view, int(p.x), int(p.y));
    // 2. its colour and normal
    p.albedo = gather_albedo(format, style, p.id);
    p.n = gather_normal(view, refined, p);
    shading[p.at] = vec4(p.n, 0.0);
    // 3. light
    vec3 c = p.albedo;
    if (lit)
        c = phong(view, eye_z, factors, shininess, world, light_count, p);
    color[p.at] = vec4(c, 1.0);
}
