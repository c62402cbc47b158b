// SPDX-License-Identifier: GPL-3.0-or-later
// Shading of PT_LANES pixels: colour, blended normal, Phong. [D 3.1]; twin of shaders/kernels/shade.comp
#ifndef PT_SHADE_H
#define PT_SHADE_H

#include "device_cpu/kernels/blend_normals.h"
#include "device_cpu/kernels/marks.h"
#include "device_cpu/kernels/recolor.h"

static const uint32_t pt_color_bytes[] = {0, 3, 12, 0, 4, 0}; // of a point, by color_format

// Colours of three bytes, gathered as words: byte offsets fit a signed index.
static inline int pt_gathers_bytes(const struct instance_args *instance)
{
    return instance->color_format == 1 && instance->slots < 1u << 29;
}

static inline vi pt_gather_rgb(const void *colors, vi id, vm ours)
{
    return vi_gather_bytes(colors, vi_add(id, vi_add(id, id)), ours);
}

static inline void pt_decode_srgb(vi rgb, vf linear[3])
{
    for (int k = 0; k < 3; k++)
        linear[k] = vf_look_up(pt_srgb_table, 256, vi_and(vi_shr(rgb, 8 * k), vi_set(255)));
}

static inline int pt_colors_of_plane(const struct instance_args *instance)
{
    return instance->color_format == PT_COLOR_OF_PLANE || instance->color_format == PT_COLOR_OF_PIXEL;
}

// The pixels in the plane of colours that PT_LANES pixels from `at` on show, given those where their surfaces were measured.
static inline vi pt_color_pixels(const struct instance_args *instance, vi source, size_t at)
{
    return instance->color_format == PT_COLOR_OF_PIXEL ? vi_add(vi_set((uint32_t)at), vi_lanes()) : source;
}

// The points' own colours, before light; source: the pixels in the plane where they were blended.
static inline void pt_albedo(const struct instance_args *instance, const void *colors, vi id, vi source, vm ours, vf albedo[3])
{
    if (pt_colors_of_plane(instance)) {
        vf pixels[4];
        vf_gather4(colors, source, ours, pixels);
        for (int k = 0; k < 3; k++)
            albedo[k] = pixels[k];
        return;
    }
    for (int k = 0; k < 3; k++)
        albedo[k] = vf_set(instance->color[k]);
    if (pt_gathers_bytes(instance)) {
        pt_decode_srgb(pt_gather_rgb(colors, id, ours), albedo);
        return;
    }
    if (instance->color_format == PT_COLOR_OF_SCALAR)
        albedo[0] = vf_gather(colors, id, ours);
    if (!instance->color_format || instance->color_format == PT_COLOR_OF_SCALAR)
        return;
    float rgb[3][PT_LANES];
    uint32_t ids[PT_LANES], lanes = vm_bits(ours);
    memset(rgb, 0, sizeof rgb);
    vi_store(ids, id);
    for (; lanes; lanes &= lanes - 1)
        for (int k = 0, i = __builtin_ctz(lanes); k < 3; k++) {
            size_t channel = 3 * (size_t)ids[i] + (size_t)k;
            rgb[k][i] = instance->color_format == 1 ? pt_srgb_table[((const uint8_t *)colors)[channel]]
                                                    : ((const float *)colors)[channel];
        }
    for (int k = 0; k < 3; k++)
        albedo[k] = vf_load(rgb[k]);
}

// The points' opacity, times the instance's.
static inline vf pt_opacity(const struct instance_args *instance, const void *colors, const uint8_t *opacities, vi id,
                            vi source, vm ours)
{
    vf opacity = vf_set(instance->opacity);
    if (!instance->has_opacities)
        return opacity;
    if (pt_colors_of_plane(instance)) {
        vf pixels[4];
        vf_gather4(colors, source, ours, pixels);
        return pixels[3];
    }
    vi byte = vi_and(vi_gather_bytes(opacities, id, ours), vi_set(255));
    return opacity * (vi_convert(byte) * vf_set(1.0f / 255.0f));
}

// ---- light -------------------------------------------------------------------------------------------------------------

struct pt_surface_point {
    vf n[3], position[3], to_eye[3];
};

static inline vf pt_dot3(const vf a[3], const vf b[3]) { return (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]; }

static inline vf pt_power(vf x, uint32_t exponent)
{
    vf result = vf_set(1.0f);
    for (; exponent; exponent >>= 1) {
        if (exponent & 1u)
            result = result * x;
        x = x * x;
    }
    return result;
}

// The light, what comes from all around alike, and shadow words: those of a light lie `stride` apart from the next one's; of shown points,
// where marks say so.
struct pt_lights {
    const struct light_view *view;
    const uint32_t *words, *marks;
    size_t stride;
    float around[3];
};

static inline struct pt_lights pt_lights_of(const struct shade_args *args, const struct light_view *view, const uint32_t *words,
                                            const uint32_t *marks)
{
    const size_t pixels = (size_t)args->view.width * args->view.height;
    struct pt_lights lights = {.view = view,
                               .words = words,
                               .marks = marks,
                               .stride = args->of_pixels ? pixels
                                         : args->marked  ? 1
                                                         : args->instance.slots};
    for (int k = 0; k < 3 && args->instance.lit; k++)
        lights.around[k] = args->instance.ambient * view->world[k];
    return lights;
}

// The share of a light, the cast-th of those that cast shadows, that arrives at points, by their words [D 6].
static inline vf pt_arrives(const struct shade_args *args, const struct pt_lights *lights, uint32_t cast, vi at, vm ours)
{
    vi sum = vi_and(vi_gather(lights->words + cast * lights->stride, at, ours), vi_set(PT_SHADOW_SUM));
    return vf_set(1.0f) - vi_convert(sum) * vf_set(args->scales[cast]);
}

// Direction to the light at `from`, and its falloff there times what is in falloff; suns have none.
static inline void pt_towards(const struct light_args *light, const float from[3], const struct pt_surface_point *s, vf l[3],
                              vf *falloff)
{
    for (int k = 0; k < 3; k++)
        l[k] = vf_set(from[k]);
    if (light->type == 1) // PATINA_LIGHT_SUN
        return;
    for (int k = 0; k < 3; k++)
        l[k] = l[k] - s->position[k];
    vf scale = vf_rsqrt(vf_max(pt_dot3(l, l), vf_set(1e-20f)));
    for (int k = 0; k < 3; k++)
        l[k] = l[k] * scale;
    *falloff = *falloff * (scale * scale);
    if (light->type == 2) // PATINA_LIGHT_POINT
        return;
    vf axis[3], zero = vf_zero(), one = vf_set(1.0f);
    for (int k = 0; k < 3; k++)
        axis[k] = vf_set(light->axis[k]);
    vf cosine = zero - pt_dot3(axis, l);
    if (light->type == 4) { // PATINA_LIGHT_AREA: one side shines, as matt paper
        *falloff = *falloff * vf_max(cosine, zero);
        return;
    }
    vf edge = vf_min(vf_max((cosine - vf_set(light->cone[0])) * vf_set(light->cone[1]), zero), one);
    *falloff = *falloff * ((edge * edge) * (vf_set(3.0f) - vf_set(2.0f) * edge));
}

// share: of its light that arrives.
static inline void pt_add_light(const struct instance_args *instance, const struct light_args *light, const float from[3],
                                vf share, const struct pt_surface_point *s, vf diffuse[3], vf specular[3])
{
    const vf zero = vf_zero();
    vf l[3], falloff = vf_set(0.31830988618f); // 1 / pi: radiance of a white Lambert surface under unit irradiance
    pt_towards(light, from, s, l, &falloff);
    falloff = falloff * share;
    vf cosine = pt_dot3(s->n, l);
    vf lambert = vf_max(cosine, zero) * falloff;
    for (int k = 0; k < 3; k++)
        diffuse[k] = diffuse[k] + vf_set(light->color[k]) * lambert;
    if (!(instance->specular > 0.0f))
        return;
    vf r[3];
    for (int k = 0; k < 3; k++)
        r[k] = (vf_set(2.0f) * cosine) * s->n[k] - l[k];
    vf shine = pt_power(vf_min(vf_max(pt_dot3(r, s->to_eye), zero), vf_set(1.0f)), instance->shininess) * falloff;
    shine = vf_select(vf_lt(zero, cosine), shine, zero);
    for (int k = 0; k < 3; k++)
        specular[k] = specular[k] + vf_set(light->color[k]) * shine;
}

static inline void pt_place(const struct shade_args *args, const vf ray[2], vf z, const vf n[3], struct pt_surface_point *s)
{
    const vf zero = vf_zero(), one = vf_set(1.0f);
    s->to_eye[0] = s->to_eye[1] = zero;
    s->to_eye[2] = one;
    s->position[0] = ray[0];
    s->position[1] = ray[1];
    s->position[2] = zero - (z + vf_set(args->eye_z));
    if (args->view.perspective) {
        s->position[0] = z * ray[0];
        s->position[1] = z * ray[1];
        s->position[2] = zero - z;
        s->to_eye[0] = zero - ray[0];
        s->to_eye[1] = zero - ray[1];
    }
    vm away = vf_lt(pt_dot3(n, s->to_eye), zero);                   // both sides are lit
    if (args->view.perspective && args->instance.specular > 0.0f) { // only shine needs it as a unit
        vf r = vf_rsqrt((ray[0] * ray[0] + ray[1] * ray[1]) + one);
        for (int k = 0; k < 3; k++)
            s->to_eye[k] = s->to_eye[k] * r;
    }
    for (int k = 0; k < 3; k++)
        s->n[k] = vf_select(away, zero - n[k], n[k]);
}

// Whether all light is of suns without shadows and the same from all around, and nothing shines.
static inline int pt_plain(const struct shade_args *args)
{
    return !(args->instance.specular > 0.0f || args->directed || args->casting || args->light_types > 1u << 1);
}

// Channel c of ambient light by the direction of the normal.
static inline vf pt_ambient(const pt_vec4 k[9], int c, const vf n[3])
{
    vf low = (vf_set(k[0][c]) + vf_set(k[1][c]) * n[0]) + (vf_set(k[2][c]) * n[1] + vf_set(k[3][c]) * n[2]);
    vf mixed = (vf_set(k[4][c]) * (n[0] * n[1]) + vf_set(k[5][c]) * (n[1] * n[2])) + vf_set(k[6][c]) * (n[2] * n[0]);
    vf square = vf_set(k[7][c]) * (n[0] * n[0] - n[1] * n[1]) + vf_set(k[8][c]) * (vf_set(3.0f) * (n[2] * n[2]) - vf_set(1.0f));
    return vf_max((low + mixed) + square, vf_zero());
}

// c = albedo (k_a world + k_d sum m E max(n.l, 0) / pi) + albedo k_s sum m E max(r.v, 0)^shininess / pi, m what arrives of
// the light. at: which of their words are those of the points. In and out: albedo. Returns the mean m of the lights that cast; 1 where
// none does.
// plain: what pt_plain says, as a constant: the compiler leaves out all else, and spills nothing. Shading takes a tenth less.
static inline __attribute__((always_inline)) vf pt_phong(const struct shade_args *args, int plain,
                                                         const struct pt_lights *lights, const vf ray[2], vi at, vm ours, vf z,
                                                         const vf n[3], vf color[3])
{
    const struct instance_args *instance = &args->instance;
    struct pt_surface_point point;
    vf diffuse[3], specular[3], arrived = vf_zero();
    uint32_t casting = 0;
    if (plain && (instance->specular > 0.0f || args->directed || args->casting))
        __builtin_unreachable();
    pt_place(args, ray, z, n, &point);
    for (int k = 0; k < 3; k++)
        diffuse[k] = specular[k] = vf_zero();
    for (uint32_t i = 0; i < args->light_count; i++) {
        const struct light_args *light = &lights->view->each[i];
        vf share = vf_set(1.0f);
        if (plain && light->type != 1)
            __builtin_unreachable();
        if (!plain && args->casting && light->shadow) {
            share = pt_arrives(args, lights, light->shadow - 1, at, ours);
            arrived = arrived + share;
            casting++;
        }
        if (light->type != 4) // PATINA_LIGHT_AREA
            pt_add_light(instance, light, light->vector, share, &point, diffuse, specular);
        for (uint32_t j = 0; light->type == 4 && j < PT_AREA_POINTS; j++)
            pt_add_light(instance, light, light->points[j], share, &point, diffuse, specular);
    }
    for (int k = 0; k < 3; k++) {
        vf light = vf_set(lights->around[k]);
        if (args->directed)
            light = vf_set(instance->ambient) * pt_ambient(lights->view->ambient, k, point.n);
        light = light + vf_set(instance->diffuse) * diffuse[k];
        if (instance->specular > 0.0f)
            light = light + vf_set(instance->specular) * specular[k];
        color[k] = color[k] * light;
    }
    if (!casting)
        return vf_set(1.0f);
    return arrived * vf_set(1.0f / (float)casting);
}

// Light on, and shown normals of, PT_LANES pixels of the instance from (x, y) on. color: in albedo. around: rows
// y - blend ... y + blend. blended: sums of normals at x, where all are one layer; NULL: not known. Returns the mean share of
// the casting lights that arrives.
static inline __attribute__((always_inline)) vf pt_shade_pixels(const struct shade_args *args, const struct pt_planes *planes,
                                                                const struct pt_seen_row *const *around, const float *weights,
                                                                float *const *blended, const struct pt_lights *lights,
                                                                uint32_t x, uint32_t y, vi id, vm ours, int plain, vf color[3],
                                                                vf normal[3])
{
    size_t at = (size_t)y * args->view.width + x;
    const struct pt_seen_row *own = around[args->blend];
    // of two rows above those seen, since filled pixels show the next row's, too: while light is computed, memory has time
    pt_ask_for_normals(planes, at + (args->blend + 2) * args->view.width);
    for (int k = 0; k < 3; k++)
        normal[k] = vf_load(own->normal[k] + x);
    if (args->blend) {
        vm filled = pt_filled(pt_source(planes, at), at, ours);
        if (vm_bits(filled)) {
            vf sum[3];
            for (int k = 0; k < 3 && blended; k++)
                sum[k] = vf_load(blended[k] + x);
            if (!blended)
                pt_blend_sum(&(struct pt_blend){planes->view, (int)args->blend, weights, around}, x, filled, sum);
            pt_blend_normals(sum, filled, normal);
        }
    }
    if (!args->instance.lit)
        return vf_set(1.0f);
    vf ray[2];
    vf_ray(&args->view, x, y, ray);
    vi word = args->of_pixels ? pt_source(planes, at) : id;
    if (!plain && args->marked)
        word = pt_shown_words(lights->marks, args->step, id, ours);
    return pt_phong(args, plain, lights, ray, word, ours, vf_load(own->z + x), normal, color);
}

#endif
