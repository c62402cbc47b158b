// SPDX-License-Identifier: GPL-3.0-or-later
// Light on a point [D 3.1]: steps of shade and gather; twin of native/device_cpu/kernels/shade.h. Include it behind shadows; LIT,
// LIGHTS, PLAIN, CASTING and DIRECTED are as in shade.comp.
#ifndef PT_PHONG_GLSL
#define PT_PHONG_GLSL

#include "shared/colors.h"

struct pixel {
    float z;
    vec2 ray;
    vec3 n, albedo;
};

layout(std140, binding = UNIFORM_lights) uniform lights_block { light_view lights; };
layout(location = 16) uniform float scales[PT_MAX_LIGHTS]; // as in shade_args

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
    float cosine = 0.0 - pt_dot(lights.each[light].axis, l);
    if (type == 4u) { // PATINA_LIGHT_AREA: one side shines, as matt paper
        falloff = falloff * pt_max(cosine, 0.0);
        return l;
    }
    vec2 cone = lights.each[light].cone.xy;
    float edge = pt_min(pt_max((cosine - cone.x) * cone.y, 0.0), 1.0);
    falloff = falloff * ((edge * edge) * (3.0 - 2.0 * edge));
    return l;
#endif
}

void add_light(uint light, uint type, vec3 from, float share, uint shininess, vec3 n, vec3 point, vec3 to_eye,
               inout vec3 diffuse, inout vec3 specular)
{
    vec3 color_of_light = lights.each[light].color;
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
float ambient_of(uint c, vec3 n)
{
    precise float low = (lights.ambient[0][c] + lights.ambient[1][c] * n.x) + (lights.ambient[2][c] * n.y + lights.ambient[3][c] * n.z);
    precise float mixed = (lights.ambient[4][c] * (n.x * n.y) + lights.ambient[5][c] * (n.y * n.z)) + lights.ambient[6][c] * (n.z * n.x);
    precise float square = lights.ambient[7][c] * (n.x * n.x - n.y * n.y) + lights.ambient[8][c] * (3.0 * (n.z * n.z) - 1.0);
    precise float sum = (low + mixed) + square;
    return pt_max(sum, 0.0);
}
#endif

// c = albedo (k_a world + k_d sum m E max(n.l, 0) / pi) + albedo k_s sum m E max(r.v, 0)^shininess / pi, m what arrives of
// the light. word: which is the point's, of those of a light, which lie `stride` apart. shadow: the mean m of lights that cast.
vec3 phong(view_args view, float eye_z, vec3 factors, uint shininess, uint word, uint stride, pixel p, out float shadow)
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
        uint type = lights.each[i].type;
        precise float share = 1.0;
#if PLAIN
        add_light(i, type, lights.each[i].vector, share, shininess, n, point, to_eye, diffuse, specular);
#else
#if CASTING
        uint own = lights.each[i].shadow;
        if (own != 0u) {
            uint lost = shadows[(own - 1u) * stride + word] & PT_SHADOW_SUM;
            share = 1.0 - float(lost) * scales[own - 1u];
            sum = sum + share;
            casting++;
        }
#endif
        if (type != 4u)
            add_light(i, type, lights.each[i].vector, share, shininess, n, point, to_eye, diffuse, specular);
        for (uint j = 0u; type == 4u && j < PT_AREA_POINTS; j++)
            add_light(i, type, lights.each[i].points[j].xyz, share, shininess, n, point, to_eye, diffuse, specular);
#endif
    }
    precise float mean = sum / float(casting);
    shadow = casting != 0u ? mean : 1.0;
#if DIRECTED
    vec3 world = vec3(ambient_of(0u, n), ambient_of(1u, n), ambient_of(2u, n));
#else
    vec3 world = lights.world;
#endif
    precise vec3 light = factors.x * world + factors.y * diffuse;
    precise vec3 total = p.albedo * (light + factors.z * specular);
    return total;
}

#endif
