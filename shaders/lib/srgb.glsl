// SPDX-License-Identifier: GPL-3.0-or-later
// sRGB byte -> linear, IEC 61966-2-1; twin of native/device_cpu/srgb.h. The device fills the table in float64.
#ifndef PT_SRGB_GLSL
#define PT_SRGB_GLSL

layout(std140, binding = UNIFORM_srgb) uniform srgb_block { vec4 srgb_table[256]; }; // in x

float pt_srgb(uint value) { return srgb_table[value].x; }

#endif
