// SPDX-License-Identifier: GPL-3.0-or-later
// A point's own colour, before light, by COLOR_FORMAT. Include it behind POINT_COLOR(i), a word of them, four bytes, and
// lib/srgb.glsl. at: the pixel where it was measured; of format 5, the one that shows it.
#ifndef PT_ALBEDO_GLSL
#define PT_ALBEDO_GLSL

vec3 pt_gather_albedo(vec3 style, uint id, uint at)
{
#if COLOR_FORMAT == 0
    return style;
#elif COLOR_FORMAT == 4
    return vec3(uintBitsToFloat(POINT_COLOR(id)));
#elif COLOR_FORMAT == 2
    return vec3(uintBitsToFloat(POINT_COLOR(3u * id)), uintBitsToFloat(POINT_COLOR(3u * id + 1u)),
                uintBitsToFloat(POINT_COLOR(3u * id + 2u)));
#elif COLOR_FORMAT == 3 || COLOR_FORMAT == 5 // blended discs, averaged points
    return vec3(uintBitsToFloat(POINT_COLOR(4u * at)), uintBitsToFloat(POINT_COLOR(4u * at + 1u)),
                uintBitsToFloat(POINT_COLOR(4u * at + 2u)));
#else // three bytes from byte 3 id on: they lie in one word or two
    uint first = 3u * id, shift = 8u * (first & 3u);
    uint low = POINT_COLOR(first >> 2), high = POINT_COLOR((first + 2u) >> 2);
    uint bytes = low >> shift | (shift > 8u ? high << (32u - shift) : 0u);
    return vec3(pt_srgb(bytes & 255u), pt_srgb((bytes >> 8) & 255u), pt_srgb((bytes >> 16) & 255u));
#endif
}

#endif
