// SPDX-License-Identifier: GPL-3.0-or-later
// What surfaces of the virtual scans look like: patterns in space with detail of centimetres, laid on by the axis that the
// surface faces most.
#include "rays.h"

#include <math.h>

static double hashed(int64_t x, int64_t y, int64_t z)
{
    uint64_t h = (uint64_t)x * 0x9E3779B97F4A7C15u ^ (uint64_t)y * 0xC2B2AE3D27D4EB4Fu ^ (uint64_t)z * 0x165667B19E3779F9u;
    h ^= h >> 32;
    h *= 0xD6E8FEB86659FD93u;
    h ^= h >> 32;
    h *= 0xD6E8FEB86659FD93u;
    h ^= h >> 32;
    return (double)(h >> 11) * 0x1p-53;
}

// Smooth noise, 0..1, of wave length 1.
static double noise(double x, double y, double z)
{
    double fx = floor(x), fy = floor(y), fz = floor(z), sum = 0.0;
    double u = x - fx, v = y - fy, w = z - fz;
    u *= u * (3.0 - 2.0 * u), v *= v * (3.0 - 2.0 * v), w *= w * (3.0 - 2.0 * w);
    for (int k = 0; k < 8; k++) {
        double weight = (k & 1 ? u : 1.0 - u) * (k & 2 ? v : 1.0 - v) * (k & 4 ? w : 1.0 - w);
        sum += weight * hashed((int64_t)fx + (k & 1), (int64_t)fy + (k >> 1 & 1), (int64_t)fz + (k >> 2));
    }
    return sum;
}

// The mixture's share of the second colour, and a factor of light and dark.
static double share_of(const material *m, const double *p, const double *n, double *tone)
{
    double ax = fabs(n[0]), ay = fabs(n[1]), az = fabs(n[2]);
    int flat = az >= ax && az >= ay;
    double u = flat ? p[0] : ax > ay ? p[1] : p[0], v = flat ? p[1] : p[2];
    double l = m->length;
    switch (m->pattern) {
    case PATTERN_BRICKS: { // of length : height = 3 : 1, joints of 4 %
        double row = floor(v / (l / 3.0)), x = u / l + 0.5 * (row - 2.0 * floor(0.5 * row));
        double s = x - floor(x), t = v / (l / 3.0) - row;
        if (s < 0.04 || t < 0.12)
            return 1.0;
        *tone = 0.85 + 0.3 * hashed((int64_t)floor(x), (int64_t)row, 7);
        return 0.0;
    }
    case PATTERN_TILES: {
        double x = u / l, y = v / l;
        if (x - floor(x) < 0.04 || y - floor(y) < 0.04)
            return 1.0;
        *tone = 0.9 + 0.2 * hashed((int64_t)floor(x), (int64_t)floor(y), 11);
        return 0.0;
    }
    case PATTERN_WOOD: return noise(p[0] / (0.25 * l), p[1] / (0.25 * l), p[2] / (4.0 * l));
    case PATTERN_CLOUDS:
        return 0.7 * noise(p[0] / l, p[1] / l, p[2] / l) + 0.3 * noise(4.0 * p[0] / l, 4.0 * p[1] / l, 4.0 * p[2] / l);
    case PATTERN_CHECKS: return hashed((int64_t)floor(u / l), (int64_t)floor(v / l), 13) < 0.5 ? 0.0 : 1.0;
    default: return 0.0;
    }
}

void rays_albedo(const material *materials, const int32_t *which, const double *place, const double *normal, int64_t n,
                 float *rgb)
{
    for (int64_t i = 0; i < n; i++) {
        const material *m = &materials[which[i]];
        const double *p = place + 3 * i;
        double tone = 1.0, share = share_of(m, p, normal + 3 * i, &tone);
        double fine = 0.3 * noise(40.0 * p[0], 40.0 * p[1], 40.0 * p[2]) + 0.7 * noise(9.0 * p[0], 9.0 * p[1], 9.0 * p[2]) -
                      0.5;
        tone *= 1.0 + m->grain * fine;
        for (int c = 0; c < 3; c++)
            rgb[3 * i + c] = (float)fmin(fmax(tone * (m->first[c] + share * (m->second[c] - m->first[c])), 0.0), 1.0);
    }
}
