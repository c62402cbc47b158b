// SPDX-License-Identifier: GPL-3.0-or-later
// sRGB byte -> linear, IEC 61966-2-1; twin of native/device_cpu/srgb.h. The device fills the table in float64.
#ifndef PT_SRGB_GLSL
#define PT_SRGB_GLSL

layout(std140, binding = 0) uniform srgb_block { vec4 srgb_table[64]; };

float pt_srgb(uint value)
{
    vec4 four = srgb_table[value >> 2];
    vec2 two = (value & 2u) != 0u ? four.zw : four.xy;
    return (value & 1u) != 0u ? two.y : two.x;
}

#endif
