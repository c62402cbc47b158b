// SPDX-License-Identifier: GPL-3.0-or-later
// The bodies of pointwise kernels, shaders/pointwise/NAME.h, as GLSL: the words of native/device_cpu/pointwise/bodies.h and of
// simd.h that they are written in. Before it: where ARGS are, and CLIP(i).
#ifndef PT_BODIES_GLSL
#define PT_BODIES_GLSL

#include "lib/math.glsl"

#define vf float
#define vi uint
#define vm bool

struct pt_here { // the pixel, as a body sees it
    bool some;       // not empty
    float z;         // 1 where empty
    uint id;         // of the point shown
    uint x, y;       // in the plane, or in the crop
    float normal[3]; // the one shown
    float albedo[3];
    float slope[4];
};

#define PT_STRUCT
#define PT_FUNCTION
#define PT_TAKES(name) pt_here pt_at,
#define PT_GIVES pt_at,
#define PT_BODY(name) void pt_##name(pt_here pt_at, inout float color[4])
#define HERE pt_at
#define PT_RAY(ray) pt_ray_into(ARGS.view, pt_at.x, pt_at.y, ray)
#define PT_FOOTPRINT(z) pt_footprint(ARGS.view, z)

void pt_ray_into(view_args view, uint x, uint y, out float ray[2])
{
    vec2 both = pt_ray(view, int(x), int(y));
    ray[0] = both.x;
    ray[1] = both.y;
}

#define vf_set(x) (x)
#define vf_min pt_min
#define vf_max pt_max
#define vf_abs pt_abs
#define vf_floor floor
#define vf_rcp pt_rcp
#define vf_rsqrt pt_rsqrt
#define vf_log2 pt_log2
#define vf_exp2 pt_exp2
#define vf_bits pt_bits
#define vf_lt(a, b) ((a) < (b))
#define vf_le(a, b) ((a) <= (b))
#define vf_select(m, a, b) ((m) ? (a) : (b))
#define vf_int(a) uint(int(a))
#define vi_set(x) (x)
#define vi_float pt_float
#define vi_convert(a) float(int(a))
#define vi_add(a, b) ((a) + (b))
#define vi_sub(a, b) ((a) - (b))
#define vi_mul(a, b) ((a) * (b))
#define vi_and(a, b) ((a) & (b))
#define vi_or(a, b) ((a) | (b))
#define vi_shr(a, n) ((a) >> (n))
#define vi_eq(a, b) ((a) == (b))
#define vi_lt_unsigned(a, b) ((a) < (b))
#define vi_select(m, a, b) ((m) ? (a) : (b))
#define vm_and(a, b) ((a) && (b))
#define vm_or(a, b) ((a) || (b))
#define vm_not(a) (!(a))
#define vm_if(yes) (yes)
#define vm_any(a) (a)

#endif
