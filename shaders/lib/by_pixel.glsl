// SPDX-License-Identifier: GPL-3.0-or-later
// Where kernels that walk pixels find what the point has that a pixel shows: in its slot, or, of clouds whose points pass by in ranges
// (native/device_gl/ranges.c), in the place of the pixel.
#ifndef PT_BY_PIXEL_GLSL
#define PT_BY_PIXEL_GLSL

layout(location = 14) uniform uint by_pixel;

uint pt_place_of(uint slot, uint pixel) { return by_pixel != 0u ? pixel : slot; }

#endif
