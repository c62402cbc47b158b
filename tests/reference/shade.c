// SPDX-License-Identifier: GPL-3.0-or-later
// [D 3.1], deferred (SPEC 1): colour, normal and Phong light of the points that survived. A filled pixel's normal is its
// source's (paper) or blended from the surfaces around it (refined, SPEC 2.2).
#include "reference.h"
#include "tolerances.h"
#include "shared/colors.h"

#include <math.h>
#include <stdlib.h>

#define PI 3.14159265358979323846

enum { SUN_LIGHT = 1, SPOT_LIGHT = 3, AREA_LIGHT = 4 }; // patina_light_type

// pixel: that is shaded, for colours that lie in a plane.
static void albedo_of(const struct instance_args *instance, const struct ref_planes *planes, uint32_t id, size_t pixel,
                      double albedo[3])
{
    const size_t of_plane = instance->color_format == PT_COLOR_OF_PLANE ? planes->from[pixel] & ~PT_FROM_MIXED : pixel;
    for (size_t c = 0; c < 3; c++) {
        if (instance->color_format == PT_COLOR_OF_PLANE || instance->color_format == PT_COLOR_OF_PIXEL) {
            albedo[c] = ((const float *)planes->colors)[4 * of_plane + c];
            continue;
        }
        albedo[c] = instance->color[c];
        if (instance->color_format == 1)
            albedo[c] = ref_srgb(((const uint8_t *)planes->colors)[3 * (size_t)id + c]);
        if (instance->color_format == 2)
            albedo[c] = ((const float *)planes->colors)[3 * (size_t)id + c];
    }
}

// ---- ramps, exposure, contrast -------------------------------------------------------------------------------------------

// Where the pixel lies on the ramp, and how far off float32 may put it; 0 when it lies nowhere.
static int place_on_ramp(const struct shade_args *args, const struct ref_planes *planes, uint32_t id, struct ref_ray ray,
                         double z, double *t, double *error)
{
    const struct recolor_args *recolor = &args->recolor;
    double slope = recolor->along[0], across = args->view.perspective ? z : 1.0, depth = z + (double)args->eye_z;
    double p[3] = {ray.u * across, ray.v * across, -depth}, rays[3] = {ray.error_u * across, ray.error_v * across, 0.0};
    if (recolor->source == PT_RAMP_TRUST) {
        const double doubt = 15.0 - (((const uint32_t *)planes->colors)[id] >> PT_SHAPE_TRUST_SHIFT & 15u);
        *t = (1.0 - doubt * doubt / 225.0 - recolor->zero) * slope;
        *error = 4.0 * TOL_UNIT * (fabs(*t) + fabs(slope));
        return 1;
    }
    if (recolor->source == PT_RAMP_SCALAR) {
        double scalar = ((const float *)planes->colors)[id];
        *t = (scalar - recolor->zero) * slope;
        *error = 3.0 * TOL_UNIT * fabs(*t);
        return !isnan(scalar);
    }
    if (recolor->source == PT_RAMP_DISTANCE) {
        double distance = args->view.perspective ? sqrt(p[0] * p[0] + p[1] * p[1] + z * z) : depth;
        *t = (distance - recolor->zero) * slope;
        *error = fabs(slope) * (TOL_NORMAL * fabs(distance) + rays[0] + rays[1] + TOL_UNIT * (z + fabs((double)args->eye_z))) +
                 3.0 * TOL_UNIT * fabs(*t);
        return 1;
    }
    double terms = fabs((double)recolor->zero);
    *t = recolor->zero;
    *error = fabs(recolor->along[2]) * TOL_UNIT * (z + fabs((double)args->eye_z));
    for (int k = 0; k < 3; k++) {
        *t += recolor->along[k] * p[k];
        terms += fabs(recolor->along[k] * p[k]);
        *error += fabs(recolor->along[k]) * rays[k];
    }
    *error += TOL_PROJECT * terms;
    return 1;
}

// ramp: the instance's.
static double ramp_value(const struct recolor_args *recolor, const float *ramp, double t, int channel)
{
    double at = fmin(fmax(t, 0.0), 1.0) * (recolor->entries - 1.0);
    int low = (int)fmin(floor(at), recolor->entries - 2.0);
    double from = ramp[3 * low + channel], to = ramp[3 * low + 3 + channel];
    return from + (at - low) * (to - from);
}

static double steepest(const struct recolor_args *recolor, const float *ramp, int channel)
{
    double most = 0.0;
    for (uint32_t i = 0; i + 1 < recolor->entries; i++)
        most = fmax(most, fabs((double)ramp[3 * i + 3 + (uint32_t)channel] - ramp[3 * i + (uint32_t)channel]));
    return most;
}

static double graded(const struct recolor_args *recolor, double c)
{
    c *= recolor->gain;
    if (recolor->contrast != 1.0f)
        c = c > 0.0 ? (double)PT_MID_GREY * pow(c / (double)PT_MID_GREY, recolor->contrast) : 0.0;
    return fmax(fmin(c, (double)PT_BRIGHTEST), -(double)PT_BRIGHTEST);
}

// In and out: the point's colour.
static void recolor(const struct shade_args *args, const struct ref_planes *planes, uint32_t id, struct ref_ray ray, double z,
                    double albedo[3], double errors[3])
{
    const struct recolor_args *recolor = &args->recolor;
    const float *ramp = recolor->source ? planes->ramps + 3 * (size_t)recolor->first : NULL;
    double t, off;
    int placed = recolor->source && place_on_ramp(args, planes, id, ray, z, &t, &off);
    for (int c = 0; c < 3; c++) {
        errors[c] = TOL_UNIT * fabs(albedo[c]);
        if (recolor->source)
            albedo[c] = placed ? ramp_value(recolor, ramp, t, c) : args->instance.color[c];
        if (placed) // entries more or less, and what between two of them is rounded
            errors[c] = (off + 4.0 * TOL_UNIT) * (recolor->entries - 1.0) * steepest(recolor, ramp, c) + 4.0 * TOL_UNIT;
        if (!recolor->graded)
            continue;
        double value = graded(recolor, albedo[c]), more = graded(recolor, albedo[c] + errors[c]);
        double less = graded(recolor, albedo[c] - errors[c]);
        double stops = albedo[c] > 0.0 ? fabs(log2(recolor->gain * albedo[c] / (double)PT_MID_GREY)) : 0.0;
        errors[c] = fmax(more - value, value - less) +
                    fabs(value) * (TOL_POWER + TOL_LOG * recolor->contrast + TOL_STOPS * (1.0 + recolor->contrast * stops));
        albedo[c] = value;
    }
}

static int window_radius(double spacings, int most) { return (int)fmax(fmin(floor(spacings + 0.5), most), 1.0); }

// Of the window over which a pixel's normal is blended.
static int blend_radius(const struct view_args *view, double z, double deff, int most, int *unsure)
{
    double spacings = deff / ((double)PT_SPACING_FACTOR * ref_footprint(view, z)), off = TOL_QUOTIENT * (spacings + 0.5);
    *unsure |= window_radius(spacings - off, most) != window_radius(spacings + off, most);
    return window_radius(spacings, most);
}

// Blends the normals of the surfaces that the pixels of the same layer around a filled one show.
static void blend(const struct view_args *view, const struct ref_planes *planes, int most, int x, int y, struct ref_shade *out)
{
    size_t pixel = (size_t)y * view->width + (size_t)x;
    uint32_t from = planes->from[pixel];
    double z = ref_key_z(planes->keys[pixel]), weights = 0.0;
    struct ref_range d = ref_level_distance(view, planes->normal, planes->deff, from, ref_exactly(z));
    struct ref_vec sum = {0.0, 0.0, 0.0};
    int radius = blend_radius(view, z, (double)planes->deff[from & ~PT_FROM_MIXED], most, &out->unsure);
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
static void normal_of(const struct shade_args *args, const struct ref_planes *planes, int x, int y, struct ref_shade *out)
{
    size_t pixel = (size_t)y * args->view.width + (size_t)x, from = planes->from[pixel];
    out->n = ref_vec_of(planes->normal + 4 * from);
    if (args->blend && from != pixel)
        blend(&args->view, planes, (int)args->blend, x, y, out);
}

// What a light at `from` sends to the pixel, and from where. 0 when the light is too near for float32.
static int incoming(const struct light_args *light, struct ref_vec from, struct ref_vec position, double position_error,
                    struct ref_vec *l, double strength[3], double *error)
{
    double gain = 1.0;
    *l = from;
    *error = TOL_NORMAL;
    if (light->type != SUN_LIGHT) {
        struct ref_vec way = ref_add(from, ref_scale(position, -1.0));
        double d = ref_length(way), lost = position_error + TOL_SUM * ref_length(from);
        if (!(d > 200.0 * lost))
            return 0;
        *l = ref_scale(way, 1.0 / d);
        *error += 2.0 * lost / d;
        gain = 1.0 / (d * d);
    }
    double along = -ref_dot(ref_vec_of(light->axis), *l);
    if (light->type == AREA_LIGHT)
        gain *= fmax(along, 0.0);
    if (light->type == SPOT_LIGHT) { // smoothstep from the cone's edge inwards
        double edge = fmin(fmax((along - light->cone[0]) * light->cone[1], 0.0), 1.0);
        gain *= edge * edge * (3.0 - 2.0 * edge);
    }
    for (int c = 0; c < 3; c++)
        strength[c] = light->color[c] * gain;
    return 1;
}

// How far the strength may be off because the direction is: absolute, of the light's unfaded strength.
static double edge_error(const struct light_args *light, double error)
{
    return light->type == AREA_LIGHT ? error : light->type == SPOT_LIGHT ? fmin(1.5 * light->cone[1] * error, 1.0) : 0.0;
}

struct lighting {
    const struct instance_args *instance;
    struct ref_vec n, viewer, position;
    double position_error, light[3], loose[3];
};

static void add_light(struct lighting *s, const struct light_args *light, struct ref_vec from, double share,
                      struct ref_shade *out)
{
    const struct instance_args *instance = s->instance;
    struct ref_vec l;
    double strength[3], error;
    if (!incoming(light, from, s->position, s->position_error, &l, strength, &error)) {
        out->singular = 1;
        return;
    }
    double distance = light->type == SUN_LIGHT ? 1.0 : ref_length(ref_add(from, ref_scale(s->position, -1.0)));
    double fading = edge_error(light, error) / (distance * distance);
    error += out->normal_error;
    double cosine = ref_dot(s->n, l);
    struct ref_vec reflected = ref_add(ref_scale(s->n, 2.0 * cosine), ref_scale(l, -1.0));
    double shine = fmax(ref_dot(reflected, s->viewer), 0.0), off = TOL_REFLECT + 3.0 * error;
    double highlight = cosine > 0.0 ? instance->specular * pow(shine, instance->shininess) : 0.0;
    double steep = instance->specular * instance->shininess * pow(fmin(shine + off, 1.0), instance->shininess - 1.0);
    // At the terminator the highlight is switched on or off by the last bit.
    if (fabs(cosine) <= error + TOL_NORMAL && instance->specular * pow(shine + off, instance->shininess) > 1e-7)
        out->unsure = 1;
    for (int c = 0; c < 3; c++) {
        double e = share * strength[c] / PI, gathered = instance->diffuse * fmax(cosine, 0.0) + highlight;
        s->light[c] += e * gathered;
        s->loose[c] += fabs(e) * (TOL_COLOR * gathered + (instance->diffuse + 1e-30) * (error + TOL_NORMAL) + steep * off +
                                  2.0 * error * gathered) +
                       fabs(light->color[c]) / PI * fading * gathered;
    }
}

// off: by the normal's error, and by roundings, a few of each term.
static double ambient_of(const pt_vec4 k[9], int c, struct ref_vec n, double normal_error, double *off)
{
    const double basis[9] = {1.0, n.x, n.y, n.z, n.x * n.y, n.y * n.z, n.z * n.x, n.x * n.x - n.y * n.y, 3.0 * n.z * n.z - 1.0};
    const double slopes[9] = {0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 2.0, 6.0}; // at most, of a unit normal
    double sum = 0.0;
    for (int i = 0; i < 9; i++) {
        sum += k[i][c] * basis[i];
        *off += fabs((double)k[i][c]) * (slopes[i] * (normal_error + TOL_NORMAL) + 12.0 * TOL_UNIT);
    }
    return fmax(sum, 0.0);
}

struct ref_shade ref_shade(const struct shade_args *args, const struct ref_planes *planes, int x, int y)
{
    const struct view_args *view = &args->view;
    const struct instance_args *instance = &args->instance;
    size_t pixel = (size_t)y * view->width + (size_t)x;
    uint64_t key = planes->keys[pixel];
    struct ref_shade out = {.shadow = 1.0, .written = ref_is_of(instance, key)};
    if (!out.written)
        return out;
    struct ref_ray ray = ref_ray(view, x, y);
    struct ref_vec viewer = ref_viewer(view, ray);
    double albedo[3], recolored[3], z = ref_key_z(key);
    albedo_of(instance, planes, ref_key_id(key) - instance->id_base, pixel, albedo);
    recolor(args, planes, ref_key_id(key) - instance->id_base, ray, z, albedo, recolored);
    normal_of(args, planes, x, y, &out);
    out.opacity = instance->opacity;
    if (instance->has_opacities)
        out.opacity *= planes->opacities[ref_key_id(key) - instance->id_base] / 255.0;
    out.color[3] = out.opacity;
    out.color_error[3] = TOL_OPACITY * out.opacity;
    for (int c = 0; c < 3; c++) {
        out.color[c] = out.opacity * albedo[c];
        out.color_error[c] = TOL_COLOR * fabs(out.color[c]) + out.opacity * recolored[c];
    }
    if (!instance->lit)
        return out;

    struct ref_vec n = out.n; // turned towards the viewer
    double facing = ref_dot(n, viewer);
    if (facing < 0.0)
        n = ref_scale(n, -1.0);
    out.unsure |= fabs(facing) <= out.normal_error + TOL_NORMAL && (args->light_count > 0 || args->directed);
    struct ref_vec position = view->perspective ? ref_vec(ray.u * z, ray.v * z, -z) : ref_vec(ray.u, ray.v, -z - args->eye_z);
    double position_error = 4.0 * TOL_UNIT *
                                (fabs(position.x) + fabs(position.y) + fabs(position.z) + fabs((double)args->eye_z)) +
                            (ray.error_u + ray.error_v) * (view->perspective ? z : 1.0);
    struct lighting s = {
        .instance = instance, .n = n, .viewer = viewer, .position = position, .position_error = position_error};
    for (int c = 0; c < 3; c++) {
        double off = 0.0, ambient = args->directed ? ambient_of(planes->lights->ambient, c, n, out.normal_error, &off)
                                                   : planes->lights->world[c];
        s.light[c] = instance->ambient * ambient;
        s.loose[c] = TOL_COLOR * fabs(s.light[c]) + instance->ambient * off;
    }
    uint32_t casting = 0;
    double arrived = 0.0;
    for (uint32_t i = 0; i < args->light_count; i++) {
        const struct light_args *light = &planes->lights->each[i];
        double share = 1.0;
        if (args->casting && light->shadow) {
            size_t word = args->of_pixels ? (light->shadow - 1) * (size_t)view->width * view->height +
                                                (planes->from[pixel] & ~PT_FROM_MIXED)
                          : args->marked
                              ? args->step * (size_t)ref_shown_place(planes->marks, ref_key_id(key) - instance->id_base) +
                                    (light->shadow - 1)
                              : (light->shadow - 1) * (size_t)instance->slots + (ref_key_id(key) - instance->id_base);
            share -= (planes->shadows[word] & PT_SHADOW_SUM) * (double)args->scales[light->shadow - 1];
            arrived += share;
            casting++;
        }
        if (light->type != AREA_LIGHT)
            add_light(&s, light, ref_vec_of(light->vector), share, &out);
        for (int j = 0; light->type == AREA_LIGHT && j < PT_AREA_POINTS; j++)
            add_light(&s, light, ref_vec_of(light->points[j]), share, &out);
    }
    out.shadow = casting ? arrived / casting : 1.0;
    for (int c = 0; c < 3; c++) {
        out.color[c] = out.opacity * albedo[c] * s.light[c];
        out.color_error[c] = out.opacity * fabs(albedo[c]) * s.loose[c] + TOL_COLOR * fabs(out.color[c]) +
                             out.opacity * recolored[c] * (fabs(s.light[c]) + s.loose[c]);
    }
    return out;
}
