// SPDX-License-Identifier: GPL-3.0-or-later
// shade: id -> colour and normal, Phong. [D 3.1], deferred: only what the picture shows is lit; twin of
// native/device_cpu/kernels/shade.c
//
// STEP 0: normals of pixels as their sources have them; filled ones are listed (refined);
// STEP 1: the listed ones' normals, blended;   STEP 2: colour, by COLOR_FORMAT and LIT
#version 430 core
#include "lib/math.glsl"
#include "lib/srgb.glsl"
#if STEP == 1
layout(local_size_x = 64) in;
#else
#include "lib/tiles.glsl"
#endif

layout(std430, binding = 0) readonly buffer arguments_block { shade_args args; };
layout(std430, binding = 1) readonly buffer keys_block { uvec2 keys[]; };
layout(std430, binding = 2) readonly buffer from_block { uint from[]; };
layout(std430, binding = 4) readonly buffer deff_block { float deff[]; };
layout(std430, binding = 6) readonly buffer colors_block { uint point_colors[]; };
layout(std430, binding = 7) writeonly buffer shading_block { vec4 shading[]; };
layout(std430, binding = 8) writeonly buffer color_block { vec4 color[]; };
layout(std430, binding = 9) buffer counters_block { uint filled_count; };
layout(std430, binding = 10) buffer filled_block { uint filled_pixels[]; };
layout(binding = 0) uniform samplerBuffer normals;
layout(binding = 1) uniform samplerBuffer shading_normals; // the shading plane too

#if STEP == 0

// 1. the point   2. its normal
void source_normal(view_args view, uint id_base, uint id_count, bool refined, uint x, uint y)
{
    uint at = y * view.width + x;
    uvec2 key = keys[at];
    if (key.x - id_base >= id_count || key.y == PT_KEY_EMPTY_Z)
        return;
    uint source = from[at] & ~PT_FROM_MIXED;
    shading[at] = vec4(texelFetch(normals, int(source)).xyz, 0.0);
    if (refined && source != at)
        filled_pixels[atomicAdd(filled_count, 1u)] = at;
}

void main()
{
    view_args view = args.view;
    uint id_base = args.instance.id_base, id_count = args.instance.id_count;
    bool refined = args.refined != 0u;
    uvec2 column = pt_tile_column(view);
    for (uint y = column.y, end = pt_tile_end(view, column); y < end; y++)
        source_normal(view, id_base, id_count, refined, column.x, y);
}

#elif STEP == 1

layout(location = 0) uniform uint entries;

// The normal of a filled pixel, refined: measured neighbours of the same layer, as far as the pixel it was filled from,
// weighted by 1 / (1 + distance^2); the source's own normal where there are none.
vec3 blend_normal(view_args view, int x, int y, float z, uint source)
{
    int width = int(view.width), height = int(view.height);
    int sx = abs(int(source % view.width) - x), sy = abs(int(source / view.width) - y);
    int r = min(max(sx, sy), 8);
    float limit = deff[source];
    precise vec3 n = vec3(0.0);
    for (int dy = -r; dy <= r; dy++)
        for (int dx = -r; dx <= r; dx++) {
            int qx = x + dx, qy = y + dy;
            if (qx < 0 || qy < 0 || qx >= width || qy >= height)
                continue;
            uint q = uint(qy) * view.width + uint(qx);
            precise float apart = pt_float(keys[q].y) - z;
            if (!(pt_abs(apart) <= limit) || (from[q] & ~PT_FROM_MIXED) != q)
                continue;
            n = n + texelFetch(normals, int(q)).xyz * pt_rcp(float(1 + dx * dx + dy * dy));
        }
    return n;
}

void main()
{
    view_args view = args.view;
    uint index = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * gl_WorkGroupSize.x +
                 gl_LocalInvocationID.x;
    if (index >= entries)
        return;
    uint at = filled_pixels[index];
    vec3 blend = blend_normal(view, int(at % view.width), int(at / view.width), pt_float(keys[at].y),
                              from[at] & ~PT_FROM_MIXED);
    float square = pt_dot(blend, blend);
    precise vec3 unit = blend * pt_rsqrt(square);
    if (square > 1e-12)
        shading[at] = vec4(unit, 0.0);
}

#else

struct pixel {
    float z;
    vec2 ray;
    vec3 n, albedo;
};

layout(location = 16) uniform vec4 lights[2 * PT_MAX_LIGHTS]; // colour and type, vector

vec3 gather_albedo(vec3 style, uint id)
{
#if COLOR_FORMAT == 0
    return style;
#elif COLOR_FORMAT == 2
    return vec3(uintBitsToFloat(point_colors[3u * id]), uintBitsToFloat(point_colors[3u * id + 1u]),
                uintBitsToFloat(point_colors[3u * id + 2u]));
#else // three bytes from byte 3 id on: they lie in one word or two
    uint first = 3u * id, shift = 8u * (first & 3u);
    uint low = point_colors[first >> 2], high = point_colors[(first + 2u) >> 2];
    uint bytes = low >> shift | (shift > 8u ? high << (32u - shift) : 0u);
    return vec3(pt_srgb(bytes & 255u), pt_srgb((bytes >> 8) & 255u), pt_srgb((bytes >> 16) & 255u));
#endif
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

void add_light(vec4 light, vec3 vector, float specular_factor, uint shininess, vec3 n, vec3 point, vec3 to_eye,
               inout vec3 diffuse, inout vec3 specular)
{
    precise vec3 l = vector;
    vec3 color_of_light = light.xyz;
    precise float falloff = 0.31830988618; // 1 / pi: radiance of a white Lambert surface under unit irradiance
    if (light.w == 2.0) {                  // PATINA_LIGHT_POINT
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
    precise vec3 point = vec3(p.ray, pt_negate(p.z + eye_z));
    precise vec3 to_eye = vec3(0.0, 0.0, 1.0);
    if (view.perspective != 0u) {
        float r = pt_ray_rsqrt(p.ray);
        point = vec3(p.z * p.ray, pt_negate(p.z));
        to_eye = vec3(0.0 - p.ray * r, r);
    }
    bool away = pt_dot(p.n, to_eye) < 0.0; // both sides are lit
    vec3 n = away ? 0.0 - p.n : p.n;
    vec3 diffuse = vec3(0.0), specular = vec3(0.0);
    for (uint i = 0u; i < light_count; i++)
        add_light(lights[2u * i], lights[2u * i + 1u].xyz, factors.z, shininess, n, point, to_eye, diffuse, specular);
    precise vec3 light = factors.x * world + factors.y * diffuse;
    precise vec3 sum = p.albedo * (light + factors.z * specular);
    return sum;
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
    uvec2 column = pt_tile_column(view);
    for (uint y = column.y, end = pt_tile_end(view, column); y < end; y++) {
        uint at = y * view.width + column.x;
        uvec2 key = keys[at];
        uint id = key.x - id_base;
        if (id >= id_count || key.y == PT_KEY_EMPTY_Z)
            continue;
        pixel p;
        p.z = pt_float(key.y);
        p.ray = pt_ray(view, int(column.x), int(y));
        p.albedo = gather_albedo(style, id);
        p.n = texelFetch(shading_normals, int(at)).xyz;
        // 3. light
#if LIT
        vec3 c = phong(view, eye_z, factors, shininess, world, light_count, p);
#else
        vec3 c = p.albedo;
#endif
        color[at] = vec4(c, 1.0);
    }
}

#endif
