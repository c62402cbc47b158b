// SPDX-License-Identifier: GPL-3.0-or-later
// tint: the surface near a cut takes the cut's colour, as sections are drawn; twin of shaders/kernels/tint.comp
#include "clip.h"
#include "device_cpu/rows.h"

// How far PT_LANES pixels lie from a cut, and how it is tinted.
struct band {
    vf d, strength, width, tint[3];
};

static inline struct band band_of(const struct clip_view *clip, const vf p[3])
{
    struct band band = { .strength = vf_set(clip->strength), .width = vf_set(clip->width) };
    for (int k = 0; k < 3; k++)
        band.tint[k] = vf_set(clip->tint[k]);
    if (clip->shape == PT_CLIP_PLANE) {
        band.d = vf_zero() - pt_clip_row(clip, 2, p);
        return band;
    }
    for (int k = 0; k < 3; k++) {
        vf inside = (vf_set(1.0f) - vf_abs(pt_clip_row(clip, k, p))) * vf_set(clip->half_size[k]);
        band.d = k ? vf_min(inside, band.d) : inside;
    }
    if (clip->shape == PT_CLIP_CUT)
        band.d = vf_zero() - band.d;
    return band;
}

// The deeper of two bands.
static inline void deepen(struct band *band, const struct band *other)
{
    vm deeper = vf_lt(band->d, other->d);
    band->d = vf_select(deeper, other->d, band->d);
    band->strength = vf_select(deeper, other->strength, band->strength);
    band->width = vf_select(deeper, other->width, band->width);
    for (int k = 0; k < 3; k++)
        band->tint[k] = vf_select(deeper, other->tint[k], band->tint[k]);
}

// Takes the band's colour where its weight is greater. per_pixel: 1 / footprint.
static inline void weigh(const struct band *band, vf per_pixel, vf *most, vf tint[3])
{
    vf within = (band->width - band->d) * per_pixel + vf_set(0.5f);
    vf weight = band->strength * vf_min(vf_max(within, vf_zero()), vf_set(1.0f));
    weight = vf_select(vf_lt(vf_zero(), band->width), weight, vf_zero());
    vm stronger = vf_lt(*most, weight);
    *most = vf_select(stronger, weight, *most);
    for (int k = 0; k < 3; k++)
        tint[k] = vf_select(stronger, band->tint[k], tint[k]);
}

static inline vf strongest(const struct tint_args *args, const struct clip_view *clips, const vf p[3], vf z, vf tint[3])
{
    const vf per_pixel = vf_rcp(vf_footprint(&args->view, z));
    vf most = vf_zero();
    struct band kept = { 0 };
    int keeps = 0;
    tint[0] = tint[1] = tint[2] = vf_zero();
    for (uint32_t i = args->clip_first; i < args->clip_first + args->clip_count; i++) {
        const struct band band = band_of(&clips[i], p);
        if (clips[i].shape != PT_CLIP_KEEP)
            weigh(&band, per_pixel, &most, tint);
        else if (keeps++)
            deepen(&kept, &band);
        else
            kept = band;
    }
    if (keeps)
        weigh(&kept, per_pixel, &most, tint);
    return most;
}

static void tint_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct tint_args *args = call->arguments;
    const struct view_args *view = &args->view;
    const struct instance_args instance = { .id_base = args->id_base, .id_count = args->id_count };
    float *colors = pt_cpu_data(call, 2);
    for (uint32_t x = view->rect[0]; x < view->rect[2]; x += PT_LANES) {
        const size_t at = (size_t)y * view->width + x;
        const uint64_t *keys = (const uint64_t *)pt_cpu_data(call, 0) + at;
        vf ray[2], tint[3], color[4], z = vi_float(vi_load_z(keys));
        vi id;
        vm ours = pt_of_instance(keys, &instance, pt_lanes_left(x, view->rect[2]), &id);
        if (!vm_bits(ours))
            continue;
        z = vf_select(ours, z, vf_set(1.0f));
        vf_ray(view, x, y, ray);
        vf p[3] = { ray[0], ray[1], vf_zero() - (z + vf_set(args->eye_z)) };
        for (int k = 0; k < 2 && view->perspective; k++)
            p[k] = z * ray[k];
        vf weight = strongest(args, pt_cpu_data(call, 1), p, z, tint);
        vf_load4(colors + 4 * at, color);
        for (int k = 0; k < 3; k++)
            color[k] = color[k] + weight * (tint[k] * color[3] - color[k]);
        vf_store4(colors + 4 * at, color, vm_bits(ours));
    }
}

int PT_KERNEL_ENTRY(tint)(const struct pt_cpu_call *call)
{
    const struct tint_args *args = call->arguments;
    return pt_rows(call, &args->view, tint_row);
}
