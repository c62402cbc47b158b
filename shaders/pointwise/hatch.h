// SPDX-License-Identifier: GPL-3.0-or-later
// hatch: strokes where planes cut the surface.

#include "shared/effects.h"

struct hatch_point {
    vf ray[3], place[3]; // (u, v, -1), in orthographic views (0, 0, -1); the point, view space
    vf width[2];         // of the pixel at the point
    vf back;             // (n . r) / (n . r)^2
};

// What a stroke of this level covers of the pixel; wide: its width in pixels.
PT_FUNCTION vf hatch_stroke(PT_TAKES(hatch) PT_STRUCT hatch_point p, uint32_t level, vf wide)
{
    vf zero = vf_set(0.0f), one = vf_set(1.0f);
    vf a = vf_set(ARGS.axes[3u * level]), b = vf_set(ARGS.axes[3u * level + 1u]), c = vf_set(ARGS.axes[3u * level + 2u]);
    precise vf along = (a * p.place[0] + b * p.place[1]) + c * p.place[2];
    along = along + ARGS.offsets[level];
    // how much it grows a pixel on: the surface goes on in its tangent plane
    precise vf turn = ((a * p.ray[0] + b * p.ray[1]) + c * p.ray[2]) * p.back;
    precise vf gx = p.width[0] * (a - turn * HERE.normal[0]), gy = p.width[1] * (b - turn * HERE.normal[1]);
    precise vf square = vf_max(gx * gx + gy * gy, vf_set(1e-30f));
    precise vf root = vf_rsqrt(square), rate = square * root;
    precise vf wanted = rate * ARGS.spacing;
    vi exponent = vi_and(vf_bits(wanted), vi_set(0x7F800000u)); // the next power of two below
    vf period = vi_float(exponent), inverse = vi_float(vi_sub(vi_set(254u << 23), exponent));
    precise vf fade = wanted * inverse - 1.0f;
    precise vf at = along * inverse, line = vf_floor(at + 0.5f);
    precise vf off = vf_abs(at - line) * (period * root);   // pixels
    precise vf odd = line - 2.0f * vf_floor(line * 0.5f);   // 0 or 1
    precise vf reach = (0.5f * wide) * (1.0f - odd * fade);
    precise vf edge = vf_min(vf_max((reach - off) + 0.5f, zero), one);
    precise vf covered = edge * vf_min(2.0f * reach, one);
    return covered;
}

PT_BODY(hatch)
{
    vf zero = vf_set(0.0f), one = vf_set(1.0f);
    vf ray[2];
    PT_STRUCT hatch_point p;
    PT_RAY(ray);
    p.ray[0] = p.ray[1] = zero;
    p.ray[2] = vf_set(-1.0f);
    p.place[0] = ray[0];
    p.place[1] = ray[1];
    precise vf beyond = 0.0f - (HERE.z + ARGS.eye_z);
    p.place[2] = beyond;
    p.width[0] = vf_set(ARGS.view.ray_xs);
    p.width[1] = vf_set(ARGS.view.ray_ys);
    if (ARGS.view.perspective != 0u) {
        precise vf x = HERE.z * ray[0], y = HERE.z * ray[1], across = HERE.z * p.width[0], up = HERE.z * p.width[1];
        p.ray[0] = ray[0];
        p.ray[1] = ray[1];
        p.place[0] = x;
        p.place[1] = y;
        p.place[2] = 0.0f - HERE.z;
        p.width[0] = across;
        p.width[1] = up;
    }
    precise vf facing = (HERE.normal[0] * p.ray[0] + HERE.normal[1] * p.ray[1]) + HERE.normal[2] * p.ray[2];
    precise vf back = facing * vf_rcp(vf_max(facing * facing, vf_set(PT_HATCH_GRAZING)));
    p.back = back;
    precise vf brightness = (0.2126f * color[0] + 0.7152f * color[1]) + 0.0722f * color[2];
    brightness = brightness * vf_rcp(vf_max(color[3], vf_set(1e-6f)));
    precise vf tone = brightness * vf_rsqrt(vf_max(brightness, vf_set(1e-6f))); // as the eye has it
    precise vf bare = one;
    for (uint32_t level = 0u; level < ARGS.levels; level++) {
        precise vf dark = vf_min(vf_max(1.0f - tone * ARGS.tones[level], zero), one);
        precise vf wide = ARGS.width * dark;
        bare = bare * (1.0f - hatch_stroke(PT_GIVES p, level, wide));
    }
    precise vf ink = ARGS.opacity * (1.0f - bare);
    for (int k = 0; k < 3; k++) {
        precise vf under = color[k] * (1.0f - ARGS.ground) + color[3] * ARGS.ground;
        precise vf drawn = under * (1.0f - ink) + (ARGS.color[k] * color[3]) * ink;
        color[k] = drawn;
    }
}
