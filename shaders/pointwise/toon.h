// SPDX-License-Identifier: GPL-3.0-or-later
// toon: bands of light over colours as they are.

#include "shared/effects.h"

PT_FUNCTION vf toon_luminance(vf r, vf g, vf b)
{
    precise vf sum = (0.2126f * r + 0.7152f * g) + 0.0722f * b;
    return sum;
}

// How bright a band is, given how bright the pixel is.
PT_FUNCTION vf toon_band(PT_TAKES(toon) vf brightness)
{
    precise vf root = brightness * vf_rsqrt(vf_max(brightness, vf_set(PT_TOON_DARK))); // as the eye has it
    precise vf at = root * ARGS.bands + 0.5f;
    vf whole = vf_floor(at);
    precise vf edge = vf_min(vf_max((at - whole - 0.5f) * ARGS.steepness + 0.5f, vf_set(0.0f)), vf_set(1.0f));
    edge = (edge * edge) * (3.0f - 2.0f * edge);
    precise vf level = vf_max((whole - 0.5f) + edge, vf_set(0.5f)) * ARGS.inverse;
    precise vf square = level * level;
    return square;
}

PT_BODY(toon)
{
    vf dark = vf_set(PT_TOON_DARK), one = vf_set(1.0f);
    vf own = toon_luminance(HERE.albedo[0], HERE.albedo[1], HERE.albedo[2]);
    vm some = vf_lt(dark, own); // black has no light to be seen by
    precise vf brightness = toon_luminance(color[0], color[1], color[2]) * vf_rcp(vf_select(some, own, one));
    vm bright_enough = vf_lt(dark, brightness);
    brightness = vf_select(some, brightness, one);
    precise vf band = toon_band(PT_GIVES brightness), ratio = band * vf_rcp(vf_select(bright_enough, brightness, one));
    for (int k = 0; k < 3; k++) {
        precise vf bright = color[k] * ratio, dim = HERE.albedo[k] * band;
        color[k] = vf_select(some, vf_select(bright_enough, bright, dim), color[k]);
    }
}
