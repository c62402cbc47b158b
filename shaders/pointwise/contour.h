// SPDX-License-Identifier: GPL-3.0-or-later
// contour: lines where a height, or another value, is a multiple of an interval.

#include "shared/effects.h"

// What lines of this kind cover of the pixel. along: the height; root: 1 / how much it grows a pixel on.
PT_FUNCTION vf contour_lines(PT_TAKES(contour) vf along, vf root, uint32_t kind)
{
    vf zero = vf_set(0.0f), one = vf_set(1.0f);
    float wide = ARGS.width[kind], even = ARGS.even[kind];
    precise vf at = vf_min(vf_max(along * ARGS.inverse[kind], vf_set(-1e9f)), vf_set(1e9f));
    precise vf apart = ARGS.interval[kind] * root; // of two lines, pixels
    precise vf off = vf_abs(at - vf_floor(at + 0.5f)) * apart;
    precise vf edge = vf_min(vf_max((0.5f * wide - off) + 0.5f, zero), one);
    precise vf line = edge * vf_min(vf_set(wide), one);
    precise vf tone = wide * vf_rcp(vf_max(apart, vf_set(even)));
    precise vf told = vf_min(vf_max(apart * ARGS.per_even[kind] - 1.0f, zero), one);
    precise vf covered = tone + told * (line - tone);
    return covered;
}

PT_BODY(contour)
{
    vf ray[2], view[3], width[2], n[3];
    PT_RAY(ray);
    n[0] = HERE.normal[0];
    n[1] = HERE.normal[1];
    n[2] = HERE.normal[2];
    precise vf x = ray[0], y = ray[1], z = 0.0f - (HERE.z + ARGS.eye_z);
    view[0] = view[1] = vf_set(0.0f);
    view[2] = vf_set(-1.0f);
    width[0] = vf_set(ARGS.view.ray_xs);
    width[1] = vf_set(ARGS.view.ray_ys);
    if (ARGS.view.perspective != 0u) {
        precise vf across = HERE.z * width[0], up = HERE.z * width[1];
        x = HERE.z * ray[0];
        y = HERE.z * ray[1];
        z = 0.0f - HERE.z;
        view[0] = ray[0];
        view[1] = ray[1];
        width[0] = across;
        width[1] = up;
    }
    vf a = vf_set(ARGS.axis[0]), b = vf_set(ARGS.axis[1]), c = vf_set(ARGS.axis[2]);
    precise vf along = ((a * x + b * y) + c * z) + ARGS.offset;
    // how much it grows a pixel on: the surface goes on in its tangent plane
    precise vf facing = (n[0] * view[0] + n[1] * view[1]) + n[2] * view[2];
    precise vf back = facing * vf_rcp(vf_max(facing * facing, vf_set(PT_CONTOUR_GRAZING)));
    precise vf turn = ((a * view[0] + b * view[1]) + c * view[2]) * back;
    precise vf gx = width[0] * (a - turn * n[0]), gy = width[1] * (b - turn * n[1]);
    precise vf square = gx * gx + gy * gy;
    if (ARGS.of_values != 0u) {
        precise vf rate = HERE.slope[1] * HERE.slope[1] + HERE.slope[2] * HERE.slope[2];
        along = HERE.slope[0];
        square = rate;
    }
    vf root = vf_rsqrt(vf_max(square, vf_set(1e-30f)));
    // how steep it is: squares of sines; without a normal, as if it stood
    precise vf sx = b * n[2] - c * n[1], sy = c * n[0] - a * n[2], sz = a * n[1] - b * n[0];
    precise vf steep = (sx * sx + sy * sy) + sz * sz, unit = (n[0] * n[0] + n[1] * n[1]) + n[2] * n[2];
    steep = vf_select(vf_lt(unit, vf_set(0.5f)), vf_set(1.0f), steep);
    precise vf shown = vf_min(vf_max((steep - PT_CONTOUR_FLAT) * PT_CONTOUR_RISE, vf_set(0.0f)), vf_set(1.0f)) * ARGS.opacity;
    if (ARGS.of_values != 0u) {
        precise vf near = vf_min(vf_max(2.0f - (ARGS.interval[0] * root) * PT_CONTOUR_PER_APART, vf_set(0.0f)), vf_set(1.0f));
        precise vf known = near * (HERE.slope[3] * ARGS.opacity);
        shown = known;
    }
    vf covered = contour_lines(PT_GIVES along, root, 0u);
    if (ARGS.kinds > 1u)
        covered = vf_max(covered, contour_lines(PT_GIVES along, root, 1u));
    precise vf ink = shown * covered;
    for (int k = 0; k < 3; k++) {
        precise vf drawn = color[k] * (1.0f - ink) + (ARGS.color[k] * color[3]) * ink;
        color[k] = drawn;
    }
}
