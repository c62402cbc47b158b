// SPDX-License-Identifier: GPL-3.0-or-later
// fog: colours fade with distance.

#include "shared/effects.h"

PT_BODY(fog)
{
    precise vf away = HERE.z;
    if (ARGS.view.perspective != 0u) {
        vf ray[2];
        PT_RAY(ray);
        precise vf square = (ray[0] * ray[0] + ray[1] * ray[1]) + 1.0f;
        away = HERE.z * (square * vf_rsqrt(square));
    }
    precise vf share = vf_min(vf_max((away - ARGS.start) * ARGS.inverse, vf_set(0.0f)), vf_set(1.0f)) * ARGS.density;
    precise vf veil = share * color[3];
    for (int k = 0; k < 3; k++) {
        precise vf faded = color[k] * (1.0f - share) + ARGS.color[k] * veil;
        color[k] = faded;
    }
}
