// SPDX-License-Identifier: GPL-3.0-or-later
// The colour of the surface near a cut (shared/effects.h, tint_args): of the clip where it is strongest.
#include "reference.h"
#include "tolerances.h"
#include "shared/effects.h"

#include <math.h>

// How far the place lies from the cut.
static double distance_to(const struct clip_view *clip, const double p[3], double loose, double *error)
{
    double least = INFINITY, off;
    *error = 0.0;
    if (clip->shape == PT_CLIP_PLANE) {
        double d = -ref_clip_row(clip, 2, p, error);
        *error += loose * (fabs((double)clip->row[6]) + fabs((double)clip->row[7]) + fabs((double)clip->row[8]));
        return d;
    }
    for (int k = 0; k < 3; k++) {
        const float *r = clip->row + 3 * k;
        double inside = (1.0 - fabs(ref_clip_row(clip, k, p, &off))) * clip->half_size[k];
        off += loose * (fabs((double)r[0]) + fabs((double)r[1]) + fabs((double)r[2])) + TOL_UNIT;
        *error = fmax(*error, off * clip->half_size[k] + 2.0 * TOL_UNIT * fabs(inside));
        least = fmin(least, inside);
    }
    return clip->shape == PT_CLIP_CUT ? -least : least;
}

static double weight_of(const struct clip_view *clip, double d, double footprint)
{
    if (!(clip->width > 0.0f))
        return 0.0;
    return clip->strength * fmin(fmax((clip->width - d) / footprint + 0.5, 0.0), 1.0);
}

struct band {
    const struct clip_view *clip;
    double d, error;
};

static struct ref_range range_of(const struct band *band, double footprint)
{
    double error = band->error + TOL_LAYER * ((double)band->clip->width + fabs(band->d) + footprint);
    return (struct ref_range){weight_of(band->clip, band->d + error, footprint) * (1.0 - TOL_LAYER),
                              weight_of(band->clip, band->d - error, footprint) * (1.0 + TOL_LAYER)};
}

// Of the boxes that keep, the one that keeps the place most; *unsure: another may be it, and tints otherwise.
static struct band deepest_of(const struct band *bands, uint32_t count, double footprint, int *unsure)
{
    struct band deepest = {NULL, -INFINITY, 0.0};
    for (uint32_t i = 0; i < count; i++)
        if (bands[i].clip->shape == PT_CLIP_KEEP && bands[i].d > deepest.d)
            deepest = bands[i];
    for (uint32_t i = 0; i < count; i++) {
        int rival = bands[i].clip->shape == PT_CLIP_KEEP && bands[i].clip != deepest.clip &&
                    bands[i].d + bands[i].error >= deepest.d - deepest.error;
        *unsure |= rival && (range_of(&bands[i], footprint).hi > 0.0 || range_of(&deepest, footprint).hi > 0.0);
    }
    return deepest;
}

struct ref_color ref_tint(const struct tint_args *args, const struct ref_planes *planes, const struct clip_view *clips, int x,
                          int y)
{
    const struct view_args *view = &args->view;
    const size_t pixel = (size_t)y * view->width + (size_t)x;
    const float *color = planes->color + 4 * pixel;
    struct ref_color out = {{color[0], color[1], color[2], color[3]}, {0}, 0, 0};
    const struct instance_args instance = {.id_base = args->id_base, .id_first = args->id_first, .id_count = args->id_count};
    if (!ref_is_of(&instance, planes->keys[pixel]))
        return out;
    double z = ref_key_z(planes->keys[pixel]), footprint = ref_footprint(view, z);
    struct ref_ray ray = ref_ray(view, x, y);
    double across = view->perspective ? z : 1.0, p[3] = {ray.u * across, ray.v * across, -(z + (double)args->eye_z)};
    double loose = fmax(ray.error_u, ray.error_v) * across +
                   TOL_UNIT * (fabs(p[0]) + fabs(p[1]) + fabs(p[2]) + fabs((double)args->eye_z));
    struct band bands[64], strongest = {NULL, 0.0, 0.0};
    uint32_t count = 0;
    for (; count < args->clip_count; count++) {
        bands[count].clip = &clips[args->clip_first + count];
        bands[count].d = distance_to(bands[count].clip, p, loose, &bands[count].error);
    }
    bands[count] = deepest_of(bands, count, footprint, &out.unsure); // those that keep count as one
    count += bands[count].clip != NULL;
    struct ref_range most = {0.0, 0.0};
    for (uint32_t i = 0; i < count; i++) {
        if (bands[i].clip->shape == PT_CLIP_KEEP && i < args->clip_count)
            continue;
        struct ref_range weight = range_of(&bands[i], footprint);
        out.unsure |= weight.hi > 0.0 && most.hi > 0.0 && weight.hi >= most.lo && weight.lo <= most.hi;
        strongest = weight.hi > most.hi ? bands[i] : strongest;
        most = weight.hi > most.hi ? weight : most;
    }
    double weight = strongest.clip ? weight_of(strongest.clip, strongest.d, footprint) : 0.0;
    for (int c = 0; c < 3; c++) {
        double goal = strongest.clip ? strongest.clip->tint[c] * (double)color[3] : 0.0;
        out.color[c] = color[c] + weight * (goal - color[c]);
        out.error[c] = (most.hi - most.lo) * fabs(goal - color[c]) + 4.0 * TOL_UNIT * (fabs(goal) + fabs((double)color[c]));
    }
    return out;
}
