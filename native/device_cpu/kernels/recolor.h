// SPDX-License-Identifier: GPL-3.0-or-later
// Colours of points from a ramp, exposure and contrast: a step of shade (struct recolor_args).
#ifndef PT_RECOLOR_H
#define PT_RECOLOR_H

#include "device_cpu/rows.h"
#include "shared/colors.h"

// Of words of shapes.
static inline vf pt_trust_of_words(vi words)
{
    const vf doubt = vi_convert(vi_sub(vi_set(15u), vi_and(vi_shr(words, PT_SHAPE_TRUST_SHIFT), vi_set(15u))));
    return (vf_set(225.0f) - doubt * doubt) * vf_set(PT_TRUST_STEP);
}

// Where the colours lie on the ramp. scalars: of the points, where they are its source.
static inline vf pt_place_on_ramp(const struct shade_args *args, const vf towards[2], vf z, vf scalars)
{
    const struct recolor_args *recolor = &args->recolor;
    const vf zero = vf_set(recolor->zero), slope = vf_set(recolor->along[0]);
    vf ray[2] = {towards[0], towards[1]};
    if (recolor->source == PT_RAMP_SCALAR || recolor->source == PT_RAMP_TRUST)
        return (scalars - zero) * slope;
    vf depth = z + vf_set(args->eye_z);
    if (recolor->source == PT_RAMP_DISTANCE) {
        vf square = (ray[0] * ray[0] + ray[1] * ray[1]) + vf_set(1.0f);
        if (args->view.perspective)
            depth = z * (square * vf_rsqrt(square));
        return (depth - zero) * slope;
    }
    if (args->view.perspective) {
        ray[0] = z * ray[0];
        ray[1] = z * ray[1];
    }
    vf along = slope * ray[0] + vf_set(recolor->along[1]) * ray[1];
    return (along - vf_set(recolor->along[2]) * depth) + zero;
}

static inline void pt_ramp(const struct recolor_args *recolor, const float *ramps, vf t, vm lanes, vf color[3])
{
    const float *ramp = ramps + 3 * (size_t)recolor->first;
    t = vf_min(vf_max(t, vf_zero()), vf_set(1.0f));
    vf at = t * vf_set((float)(recolor->entries - 1));
    vf low = vf_min(vf_floor(at), vf_set((float)(recolor->entries - 2)));
    vf share = at - low;
    vi index = vi_mul(vf_int(low), vi_set(3));
    for (uint32_t k = 0; k < 3; k++) {
        vf from = vf_gather(ramp + k, index, lanes), to = vf_gather(ramp + 3 + k, index, lanes);
        color[k] = from + share * (to - from);
    }
}

static inline vf pt_grade(const struct recolor_args *recolor, vf c)
{
    const vf least = vf_set(1e-30f);
    c = c * vf_set(recolor->gain);
    if (recolor->contrast != 1.0f) {
        vm some = vf_lt(least, c);
        vf stops = vf_log2(vf_select(some, c, least) * vf_set(1.0f / PT_MID_GREY)) * vf_set(recolor->contrast);
        vf graded = vf_exp2(vf_min(vf_max(stops, vf_set(-126.0f)), vf_set(126.0f))) * vf_set(PT_MID_GREY);
        c = vf_select(some, graded, vf_zero());
    }
    return vf_max(vf_min(c, vf_set(PT_BRIGHTEST)), vf_set(-PT_BRIGHTEST));
}

// In and out: the points' own colours; where scalars are the ramp's source, these in the first. ramps: of the picture.
static inline void pt_recolor_at(const struct shade_args *args, const float *ramps, const vf ray[2], vf z, vm ours, vf color[3])
{
    const struct recolor_args *recolor = &args->recolor;
    if (recolor->source) {
        const vf scalars = recolor->source == PT_RAMP_TRUST ? pt_trust_of_words(vf_bits(color[0])) : color[0];
        const vf t = pt_place_on_ramp(args, ray, z, scalars);
        pt_ramp(recolor, ramps, t, ours, color);
        vm number = vf_le(scalars, scalars);
        for (uint32_t k = 0; k < 3 && recolor->source == PT_RAMP_SCALAR; k++)
            color[k] = vf_select(number, color[k], vf_set(args->instance.color[k]));
    }
    for (uint32_t k = 0; k < 3 && recolor->graded; k++)
        color[k] = pt_grade(recolor, color[k]);
}

// Of PT_LANES pixels from (x, y) on.
static inline void pt_recolor(const struct shade_args *args, const float *ramps, uint32_t x, uint32_t y, vf z, vm ours,
                              vf color[3])
{
    vf ray[2];
    vf_ray(&args->view, x, y, ray);
    pt_recolor_at(args, ramps, ray, z, ours, color);
}

static inline int pt_recolors(const struct shade_args *args) { return args->recolor.source || args->recolor.graded; }

#endif
