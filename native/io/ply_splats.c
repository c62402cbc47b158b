// SPDX-License-Identifier: GPL-3.0-or-later
// Gaussian splats as discs (Kerbl et al., 3D Gaussian Splatting, 2023, section 5 and their PLY): scale_* are the natural logarithms of
// an ellipsoid's standard deviations along its axes, rot_* a quaternion, real part first, opacity a logit.
//
// A disc lies in the plane of the two greater axes, the least is its normal, whose side nobody knows. Its area is the integral of the
// Gaussian there, 2 pi s t, so that what a splat covers in all is kept: its radius is sqrt(2 s t). Two scales are a flat splat
// (Huang et al., 2D Gaussian Splatting, 2024), whose normal is the third axis.
#include "base/elementary.h"
#include "ply.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_SCALES = 3, TURNS = 4 };

static const char *const scale_names[MOST_SCALES] = {"scale_0", "scale_1", "scale_2"};
static const char *const turn_names[TURNS] = {"rot_0", "rot_1", "rot_2", "rot_3"};

static bool has(const struct ply_property properties[], uint32_t count, const char *name)
{
    for (uint32_t k = 0; k < count; k++)
        if (!strcmp(properties[k].name, name) && properties[k].count_type == PATINA_NONE)
            return true;
    return false;
}

bool ply_are_splats(const struct ply_property properties[], uint32_t count)
{
    bool all = has(properties, count, "f_dc_0") && has(properties, count, "opacity") &&
               has(properties, count, scale_names[0]) && has(properties, count, scale_names[1]);
    for (int k = 0; k < TURNS; k++)
        all = all && has(properties, count, turn_names[k]);
    return all;
}

bool ply_is_splat_rest(const char *name) { return !strncmp(name, "f_rest_", 7); }

// Column `axis` of the matrix of a quaternion; 0 0 0 where it is none.
static void axis_of(const double q[TURNS], int axis, float out[3])
{
    const double square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    const double w = q[0], x = q[1], y = q[2], z = q[3];
    const double columns[3][3] = {{w * w + x * x - y * y - z * z, 2 * (x * y + w * z), 2 * (x * z - w * y)},
                                  {2 * (x * y - w * z), w * w - x * x + y * y - z * z, 2 * (y * z + w * x)},
                                  {2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z}};
    const bool turns = square > 0 && isfinite(square);
    for (int k = 0; k < 3; k++)
        out[k] = turns ? (float)(columns[axis][k] / square) : 0;
}

// Radius and normal of one: the logarithms of its scales, and its turn.
static float disc_of(const double scales[MOST_SCALES], int count, const double turn[TURNS], float normal[3])
{
    int least = count < MOST_SCALES ? MOST_SCALES - 1 : 0;
    for (int k = 1; k < count && count == MOST_SCALES; k++)
        least = scales[k] < scales[least] ? k : least;
    double sum = 0;
    for (int k = 0; k < count; k++)
        sum += k == least ? 0 : scales[k];
    axis_of(turn, least, normal);
    const float radius = (float)sqrt(2 * pt_exp(sum));
    return isfinite(radius) ? radius : 0;
}

static float opacity_of(double logit) { return isnan(logit) ? 1 : (float)(1 / (1 + pt_exp(-logit))); }

static void drop(struct patina_file *file, const char *const names[], int count)
{
    uint32_t kept = 0;
    for (uint32_t i = 0; i < file->attribute_count; i++) {
        bool dropped = false;
        for (int k = 0; k < count; k++)
            dropped |= !strcmp(file->attributes[i].name, names[k]);
        if (dropped)
            free(file->attributes[i].data);
        else
            file->attributes[kept++] = file->attributes[i];
    }
    file->attribute_count = kept;
}

int ply_make_discs(struct patina_file *file, const char *name)
{
    static const char *const replaced[] = {"opacity", "radius"};
    const struct pt_column *scales[MOST_SCALES], *turns[TURNS], *logit = pt_file_find_attribute(file, "opacity");
    const size_t count = (size_t)file->count;
    float *radius = malloc(count * sizeof *radius + 1), *opacity = malloc(count * sizeof *opacity + 1);
    float *normal = malloc(3 * count * sizeof *normal + 1);
    if (!radius || !opacity || !normal) {
        free(radius);
        free(opacity);
        free(normal);
        return PATINA_ERROR_MEMORY;
    }
    for (int k = 0; k < MOST_SCALES; k++)
        scales[k] = pt_file_find_attribute(file, scale_names[k]);
    for (int k = 0; k < TURNS; k++)
        turns[k] = pt_file_find_attribute(file, turn_names[k]);
    const int axes = scales[2] ? 3 : 2;
    for (size_t i = 0; i < count; i++) {
        double logs[MOST_SCALES], turn[TURNS];
        for (int k = 0; k < axes; k++)
            logs[k] = pt_file_value(scales[k], i);
        for (int k = 0; k < TURNS; k++)
            turn[k] = pt_file_value(turns[k], i);
        radius[i] = disc_of(logs, axes, turn, normal + 3 * i);
        opacity[i] = opacity_of(pt_file_value(logit, i));
    }
    free(file->normal); // those of splats are zero
    file->normal = normal;
    drop(file, scale_names, MOST_SCALES);
    drop(file, turn_names, TURNS);
    drop(file, replaced, 2);
    file->splats = true;
    const int code = pt_file_add_attribute(file, "opacity", PATINA_FLOAT32, opacity);
    if (code) {
        free(radius);
        return code;
    }
    if (name)
        pt_log(
            PT_LOG_WARNING,
            "%s: Gaussian splats, taken as discs of even colour: what their colour does by direction, and their soft rims, are "
            "left out",
            name);
    return pt_file_add_attribute(file, "radius", PATINA_FLOAT32, radius);
}
