// SPDX-License-Identifier: GPL-3.0-or-later
// tint: the surface near a cut takes the cut's colour, as sections are drawn.

#include "shared/effects.h"

struct tint_band { // how far pixels lie from a cut, and how it is tinted
    vf d, strength, width, tint[3];
};

PT_FUNCTION PT_STRUCT tint_band tint_band_of(PT_TAKES(tint) uint32_t i, vf x, vf y, vf z)
{
    PT_STRUCT tint_band band;
    band.d = vf_set(0.0f);
    band.strength = vf_set(CLIP(i).strength);
    band.width = vf_set(CLIP(i).width);
    for (int k = 0; k < 3; k++)
        band.tint[k] = vf_set(CLIP(i).tint[k]);
    if (CLIP(i).shape == PT_CLIP_PLANE) {
        band.d = 0.0f - PT_CLIP_ROW(i, 2u, x, y, z);
        return band;
    }
    for (uint32_t k = 0u; k < 3u; k++) {
        precise vf inside = (1.0f - vf_abs(PT_CLIP_ROW(i, k, x, y, z))) * CLIP(i).half_size[k];
        if (k == 0u)
            band.d = inside;
        else
            band.d = vf_min(inside, band.d);
    }
    if (CLIP(i).shape == PT_CLIP_CUT)
        band.d = 0.0f - band.d;
    return band;
}

// per_pixel: 1 / footprint.
PT_FUNCTION vf tint_weight(PT_STRUCT tint_band band, vf per_pixel)
{
    precise vf within = (band.width - band.d) * per_pixel + 0.5f;
    precise vf weight = band.strength * vf_min(vf_max(within, vf_set(0.0f)), vf_set(1.0f));
    return vf_select(vf_lt(vf_set(0.0f), band.width), weight, vf_set(0.0f));
}

PT_FUNCTION PT_STRUCT tint_band tint_select(vm m, PT_STRUCT tint_band a, PT_STRUCT tint_band b)
{
    b.d = vf_select(m, a.d, b.d);
    b.strength = vf_select(m, a.strength, b.strength);
    b.width = vf_select(m, a.width, b.width);
    for (int k = 0; k < 3; k++)
        b.tint[k] = vf_select(m, a.tint[k], b.tint[k]);
    return b;
}

PT_BODY(tint)
{
    vm ours = vm_and(HERE.some, vi_lt_unsigned(vi_sub(vi_sub(HERE.id, vi_set(ARGS.id_base)), vi_set(ARGS.id_first)), vi_set(ARGS.id_count)));
    if (!vm_any(ours))
        return;
    vf ray[2];
    PT_RAY(ray);
    precise vf x = ray[0], y = ray[1], z = 0.0f - (HERE.z + ARGS.eye_z);
    if (ARGS.view.perspective != 0u) {
        x = HERE.z * ray[0];
        y = HERE.z * ray[1];
    }
    vf per_pixel = vf_rcp(PT_FOOTPRINT(HERE.z)), most = vf_set(0.0f);
    PT_STRUCT tint_band kept, strongest; // of clips that keep the deepest; of all
    bool keeps = false;
    strongest.d = vf_set(0.0f);
    strongest.strength = strongest.d; // not one chain of assignments: glslangValidator takes endless memory for such
    strongest.width = strongest.d;
    for (int k = 0; k < 3; k++)
        strongest.tint[k] = strongest.d;
    kept = strongest;
    for (uint32_t i = ARGS.clip_first; i < ARGS.clip_first + ARGS.clip_count; i++) {
        PT_STRUCT tint_band band = tint_band_of(PT_GIVES i, x, y, z);
        if (CLIP(i).shape != PT_CLIP_KEEP) {
            vf weight = tint_weight(band, per_pixel);
            vm stronger = vf_lt(most, weight);
            strongest = tint_select(stronger, band, strongest);
            most = vf_select(stronger, weight, most);
        } else if (keeps) {
            kept = tint_select(vf_lt(kept.d, band.d), band, kept);
        } else {
            kept = band;
            keeps = true;
        }
    }
    if (keeps) {
        vf weight = tint_weight(kept, per_pixel);
        vm stronger = vf_lt(most, weight);
        strongest = tint_select(stronger, kept, strongest);
        most = vf_select(stronger, weight, most);
    }
    for (int k = 0; k < 3; k++) {
        precise vf mixed = color[k] + most * (strongest.tint[k] * color[3] - color[k]);
        color[k] = vf_select(ours, mixed, color[k]);
    }
}
