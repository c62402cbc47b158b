// SPDX-License-Identifier: GPL-3.0-or-later
// [D 3.1], deferred (SPEC 1): colour, normal and Phong light of the points that survived. A filled pixel's normal is its
// source's (paper) or blended from the surfaces around it (refined, SPEC 2.2).
#include "reference.h"
#include "tolerances.h"

#include <math.h>
#include <stdlib.h>

#define PI 3.14159265358979323846

enum { POINT_LIGHT = 2 }; // patina_light_type

static void albedo_of(const struct instance_args *instance, const struct ref_planes *planes, uint32_t id,
                      double albedo[3])
{
    for (size_t c = 0; c < 3; c++) {
        albedo[c] = instance->color[c];
        if (instance->color_format == 1)
            albedo[c] = ref_srgb(((const uint8_t *)planes->colors)[3 * (size_t)id + c]);
        if (instance->color_format == 2)
            albedo[c] = ((const float *)planes->colors)[3 * (size_t)id + c];
    }
}

// Blends the normals of the surfaces that the pixels of the same layer around a filled one show.
static void blend(const struct view_args *view, const struct ref_planes *planes, int radius, int x, int y,
                  struct ref_shade *out)
{
    size_t pixel = (size_t)y * view->width + (size_t)x;
    uint32_t from = planes->from[pixel];
    double z = ref_key_z(planes->keys[pixel]), weights = 0.0;
    struct ref_range d = ref_level_distance(view, planes->normal, planes->deff, from, ref_exactly(z));
    struct ref_vec sum = {0.0, 0.0, 0.0};
    for (int qy = y - radius; qy <= y + radius; qy++) {
        for (int qx = x - radius; qx <= x + radius; qx++) {
            if (qx < 0 || qy < 0 || qx >= (int)view->width || qy >= (int)view->height)
                continue;
            size_t q = (size_t)qy * view->width + (size_t)qx;
            if (planes->keys[q] == REF_EMPTY_KEY)
                continue;
            double step = fabs(ref_key_z(planes->keys[q]) - z);
            enum ref_truth same = ref_less_equal(ref_rounded(ref_exactly(step)), d);
            out->unsure |= same == REF_UNSURE;
            if (same != REF_YES)
                continue;
            double weight = 1.0 / (1.0 + (qx - x) * (qx - x) + (qy - y) * (qy - y));
            if (planes->from[q] != q)
                weight *= (double)PT_BLEND_FILLED;
            struct ref_vec shown = ref_vec_of(planes->normal + 4 * (size_t)(planes->from[q] & ~PT_FROM_MIXED));
            sum = ref_add(sum, ref_scale(shown, weight));
            weights += weight;
        }
    }
    double length = ref_length(sum);
    if (weights > 0.0 && length <= 1e-4 * weights) // cancelled out but for rounding
        out->unsure = length > 0.0;
    if (length <= 1e-4 * weights || weights == 0.0)
        return;
    out->n = ref_scale(sum, 1.0 / length);
    out->normal_error = TOL_BLEND * weights / length;
}

// Clouds without normals have their estimates in the normal plane, like any other.
static void normal_of(const struct shade_args *args, const struct ref_planes *planes, int x, int y,
                      struct ref_shade *out)
{
    size_t pixel = (size_t)y * args->view.width + (size_t)x, from = planes->from[pixel];
    out->n = ref_vec_of(planes->normal + 4 * from);
    if (args->blend && from != pixel)
        blend(&args->view, planes, (int)args->blend, x, y, out);
}

// What a light sends to the pixel, and from where. 0 when the light is too near for float32.
static int incoming(const struct light_args *light, struct ref_vec position, double position_error, struct ref_vec *l,
                    double strength[3], double *error)
{
    struct ref_vec vector = ref_vec_of(light->vector);
    double gain = 1.0;
    *l = vector;
    *error = TOL_NORMAL;
    if (light->type == POINT_LIGHT) {
        struct ref_vec way = ref_add(vector, ref_scale(position, -1.0));
        double d = ref_length(way), lost = position_error + TOL_SUM * ref_length(vector);
        if (!(d > 200.0 * lost))
            return 0;
        *l = ref_scale(way, 1.0 / d);
        *error += 2.0 * lost / d;
        gain = 1.0 / (d * d);
    }
    for (int c = 0; c < 3; c++)
        strength[c] = light->color[c] * gain;
    return 1;
}

struct ref_shade ref_shade(const struct shade_args *args, const struct ref_planes *planes, int x, int y)
{
    const struct view_args *view = &args->view;
    const struct instance_args *instance = &args->instance;
    size_t pixel = (size_t)y * view->width + (size_t)x;
    uint64_t key = planes->keys[pixel];
    struct ref_shade out = {.written = ref_is_of(instance, key)};
    if (!out.written)
        return out;
    struct ref_ray ray = ref_ray(view, x, y);
    struct ref_vec viewer = ref_viewer(view, ray);
    double albedo[3], z = ref_key_z(key);
    albedo_of(instance, planes, ref_key_id(key) - instance->id_base, albedo);
    normal_of(args, planes, x, y, &out);
    out.opacity = instance->opacity;
    if (instance->has_opacities)
        out.opacity *= planes->opacities[ref_key_id(key) - instance->id_base] / 255.0;
    out.color[3] = out.opacity;
    out.color_error[3] = TOL_OPACITY * out.opacity;
    for (int c = 0; c < 3; c++) {
        out.color[c] = out.opacity * albedo[c];
        out.color_error[c] = TOL_COLOR * fabs(out.color[c]);
    }
    if (!instance->lit)
        return out;

    struct ref_vec n = out.n; // turned towards the viewer
    double facing = ref_dot(n, viewer);
    if (facing < 0.0)
        n = ref_scale(n, -1.0);
    out.unsure |= fabs(facing) <= out.normal_error + TOL_NORMAL && args->light_count > 0;
    struct ref_vec position = view->perspective ? ref_vec(ray.u * z, ray.v * z, -z)
                                                : ref_vec(ray.u, ray.v, -z - args->eye_z);
    double position_error = 4.0 * TOL_UNIT *
                                (fabs(position.x) + fabs(position.y) + fabs(position.z) + fabs((double)args->eye_z)) +
                            (ray.error_u + ray.error_v) * (view->perspective ? z : 1.0);
    double light[3], loose[3];
    for (int c = 0; c < 3; c++) {
        light[c] = (double)instance->ambient * args->world[c];
        loose[c] = TOL_COLOR * fabs(light[c]);
    }
    for (uint32_t i = 0; i < args->light_count; i++) {
        struct ref_vec l;
        double strength[3], error;
        if (!incoming(&args->lights[i], position, position_error, &l, strength, &error)) {
            out.singular = 1;
            continue;
        }
        error += out.normal_error;
        double cosine = ref_dot(n, l);
        struct ref_vec reflected = ref_add(ref_scale(n, 2.0 * cosine), ref_scale(l, -1.0));
        double shine = fmax(ref_dot(reflected, viewer), 0.0), off = TOL_REFLECT + 3.0 * error;
        double highlight = cosine > 0.0 ? instance->specular * pow(shine, instance->shininess) : 0.0;
        double steep = instance->specular * instance->shininess *
                       pow(fmin(shine + off, 1.0), instance->shininess - 1.0);
        // At the terminator the highlight is switched on or off by the last bit.
        if (fabs(cosine) <= error + TOL_NORMAL && instance->specular * pow(shine + off, instance->shininess) > 1e-7)
            out.unsure = 1;
        for (int c = 0; c < 3; c++) {
            double e = strength[c] / PI;
            light[c] += e * (instance->diffuse * fmax(cosine, 0.0) + highlight);
            loose[c] += fabs(e) * (TOL_COLOR * (instance->diffuse * fmax(cosine, 0.0) + highlight) +
                                   (instance->diffuse + 1e-30) * (error + TOL_NORMAL) + steep * off +
                                   2.0 * error * (instance->diffuse * fmax(cosine, 0.0) + highlight));
        }
    }
    for (int c = 0; c < 3; c++) {
        out.color[c] = out.opacity * albedo[c] * light[c];
        out.color_error[c] = out.opacity * fabs(albedo[c]) * loose[c] + TOL_COLOR * fabs(out.color[c]);
    }
    return out;
}
