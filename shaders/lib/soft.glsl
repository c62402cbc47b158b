// SPDX-License-Identifier: GPL-3.0-or-later
// Balls of soft points [S]: their density along rays, for soft.comp; twin of native/device_cpu/kernels/soft_balls.h. Include it
// behind args, a struct soft_args. MODEL: PT_SOFT_CONCENTRIC or PT_SOFT_BASE.
#ifndef PT_SOFT_GLSL
#define PT_SOFT_GLSL

#include "shared/balls.h"

struct ray_of {
    float x, y, u, v, n, root; // x, y: pixel's centre
    float from, to;            // along it
};

struct hit { // d, half of the chord: in radii; inverse: 1 / radius; along, reach: world units
    float d, along, inverse, half_chord, reach;
    float shells;
};

// log(1 + x) for x > -1.
float log1p(float x)
{
    precise float u = 1.0 + x, moved = u - 1.0;
    float size = pt_abs(moved);
    if (!(0.0 < size))
        return x;
    precise float log = pt_abs(pt_log2(u)) * 0.69314718056;
    precise float own = pt_abs(x) * (log * pt_rcp(size));
    return x < 0.0 ? -own : own;
}

// From low to high, 0 <= low <= high, of 1 - sqrt(t^2 + d^2): SPEC 5.
float side(float square, float low, float high)
{
    precise float a = low * low + square, b = high * high + square;
    precise float root_a = a * pt_rsqrt(pt_max(a, 1e-36)), root_b = b * pt_rsqrt(pt_max(b, 1e-36));
    precise float length = high - low, roots = root_a + root_b, sum = low + high, share = sum * pt_rcp(pt_max(roots, 1e-18));
    precise float log = log1p((length * (1.0 + share)) * pt_rcp(pt_max(low + root_a, 1e-18)));
    precise float own = length * (1.0 - 0.5 * (0.5 * roots + 0.5 * (sum * share))) - 0.5 * (square * log);
    return own;
}

float integral(float d, float from, float to)
{
    precise float square = d * d;
    precise float both = side(square, pt_max(from, 0.0), pt_max(to, 0.0)) + side(square, pt_max(0.0 - to, 0.0), pt_max(0.0 - from, 0.0));
    return both;
}

#if MODEL == PT_SOFT_CONCENTRIC
float depth_of(float shells, float d, float from, float to)
{
    float even = pt_rcp(shells);
    precise float sum = 0.0;
    for (uint i = 0u; float(i) < shells; i++) {
        precise float radius = 1.0 - float(i) * even, square = radius * radius - d * d;
        if (!(0.0 < square))
            break;
        precise float chord = square * pt_rsqrt(square), weight = even;
        if (args.mu != PT_SOFT_EVEN)
            weight = even * pt_rcp(radius);
        if (args.mu == PT_SOFT_EQ15)
            weight = weight * (1.0 - d * pt_rcp(radius));
        sum = sum + weight * pt_max(pt_min(to, chord) - pt_max(from, 0.0 - chord), 0.0);
    }
    precise float center = args.mu == PT_SOFT_EVEN ? 1.0 + even : 2.0; // of whole balls at d = 0
    precise float share = sum * pt_rcp(center);
    return share;
}
#else
float depth_of(float shells, float d, float from, float to) { return integral(d, from, to); }
#endif

// Whether the ray meets the ball of a record.
bool meet(view_args view, ray_of ray, vec4 p, out hit h)
{
    float scale = view.perspective != 0u ? p.z : 1.0;
    precise float ex = (p.x - ray.x * scale) * view.ray_xs, ey = (p.y - ray.y * scale) * view.ray_ys;
    precise float across = ex * ray.u + ey * ray.v;
    float inverse = pt_rcp(p.w);
    precise float square = ((ex * ex + ey * ey) - (across * across) * (1.0 / ray.n)) * (inverse * inverse);
    square = pt_max(square, 0.0);
    precise float along = (p.z * ray.n + across) * (1.0 / ray.root), left = 1.0 - square;
    if (!(0.0 < left))
        return false;
    precise float chord = left * pt_rsqrt(left), reach = chord * p.w;
    h.along = along;
    h.half_chord = chord;
    h.reach = reach;
    h.inverse = inverse;
    precise float d = square * pt_rsqrt(pt_max(square, 1e-30));
    h.d = d;
    h.shells = 1.0;
#if MODEL == PT_SOFT_CONCENTRIC
    precise float wanted = (p.w * pt_rcp(pt_max(pt_footprint(view, p.z), 1e-30))) * (1.0 / PT_SOFT_RING);
    h.shells = args.shells != 0u ? float(args.shells) : p.z <= 0.0 ? PT_SOFT_SHELLS : pt_max(ceil(pt_min(wanted, PT_SOFT_SHELLS)), 1.0);
#endif
    return ray.from < along + reach && along - reach < ray.to;
}

// m lambda of a ball: what its depth is multiplied by.
float density_of(hit h, float a, float w)
{
    float full = pt_min(a, PT_SOFT_FULLEST), lambda = -log1p(-full);
    if (w >= 1.0)
        return lambda;
    precise float whole = lambda * depth_of(h.shells, h.d, -h.half_chord, h.half_chord); // [S Eq. 22]
    precise float own = 1.0 - pt_exp2(pt_max(whole * -1.44269504, -126.0));
    precise float opacity = (full * (1.0 - h.d)) * (1.0 - w) + own * w;
    if (!(1e-9 < whole))
        return lambda;
    precise float scaled = (-log1p(-pt_min(opacity, PT_SOFT_FULLEST))) * pt_rcp(whole) * lambda;
    return scaled;
}

#endif
