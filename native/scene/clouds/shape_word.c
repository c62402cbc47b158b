// SPDX-License-Identifier: GPL-3.0-or-later
// Shape words (shared/words.h).
#include "shape_word.h"
#include "base/elementary.h"

#include <math.h>

#define PI 3.14159265358979323846

static void frame_of(const double n[3], double t1[3], double t2[3])
{
    const double s = n[2] >= (double)PT_SHAPE_UP ? 1.0 : -1.0, q = -1.0 / (s + n[2]), b = n[0] * n[1] * q;
    t1[0] = 1.0 + s * n[0] * n[0] * q;
    t1[1] = s * b;
    t1[2] = -s * n[0];
    t2[0] = b;
    t2[1] = s + n[1] * n[1] * q;
    t2[2] = -n[1];
}

// The nearest of the classes; 0: none.
static uint32_t class_of(double length, double base)
{
    if (!(length > 0.0) || !(base > 0.0) || !isfinite(length / base))
        return 0;
    const double steps = floor(4.0 * pt_log2(length / base) + 0.5);
    return steps < 0.0 ? 1u : steps > 62.0 ? 63u : (uint32_t)steps + 1u;
}

uint32_t pt_level_of_trust(double trust)
{
    return PT_TRUST_LEVELS - 1 - (uint32_t)((PT_TRUST_LEVELS - 1) * sqrt(1.0 - fmin(fmax(trust, 0.0), 1.0)) + 0.5);
}

// A cloud with a smaller share of points below PATINA_TRUST_DEFAULT is clean. Models and single range images have 0 to 0.025 %, virtual scans
// with the errors of real scanners 0.07 to 1.5 %.
#define CLEAN 0.0005

uint32_t pt_default_level(const uint64_t counts[PT_TRUST_LEVELS])
{
    const uint32_t most = pt_level_of_trust((double)PATINA_TRUST_MOST);
    uint32_t level = pt_level_of_trust((double)PATINA_TRUST_DEFAULT);
    double right = 0.0, lost = 0.0, all = 0.0, below = 0.0;
    for (uint32_t l = 0; l < PT_TRUST_LEVELS; l++) {
        all += (double)counts[l];
        below += l < level ? (double)counts[l] : 0.0;
        right += (double)counts[l] * pt_trust_of_level(l);
        lost += l < level ? (double)counts[l] * pt_trust_of_level(l) : 0.0;
    }
    if (below == 0.0 || below < CLEAN * all)
        return level;
    for (; level < most; level++) {
        lost += (double)counts[level] * pt_trust_of_level(level);
        if (lost > 0.01 * right)
            break;
    }
    return level;
}

uint32_t pt_pack_shape(const struct pt_neighbourhood *hood, uint32_t normal_bits, double base)
{
    uint32_t word = class_of(hood->major, base) | class_of(hood->sigma, base / 16.0) << PT_SHAPE_SIGMA_SHIFT;
    word |= hood->kind << PT_SHAPE_KIND_SHIFT | (hood->beside ? PT_SHAPE_BESIDE : 0u);
    word |= pt_level_of_trust(hood->trust) << PT_SHAPE_TRUST_SHIFT;
    if (!(hood->major > 0.0) || !(hood->minor > 0.0))
        return word;
    const double steps = 4.0 * pt_log2(hood->major / hood->minor);
    word |= (steps > 15.0 ? 15u : (uint32_t)(steps + 0.5)) << PT_SHAPE_RATIO_SHIFT;
    if (normal_bits == PT_NORMAL_NONE)
        return word;
    double n[3], t1[3], t2[3], x = 0.0, y = 0.0;
    pt_decode_normal(normal_bits, n);
    frame_of(n, t1, t2);
    for (int k = 0; k < 3; k++) {
        x += hood->axis[k] * t1[k];
        y += hood->axis[k] * t2[k];
    }
    if (x == 0.0 && y == 0.0)
        return word;
    const double turn = floor(pt_atan2(y, x) * 64.0 / PI + 0.5);
    return word | ((uint32_t)(int32_t)turn & 63u) << PT_SHAPE_ANGLE_SHIFT; // an axis is the same half a turn on
}

void pt_unpack_shape(uint32_t shape, uint32_t normal_bits, double base, struct pt_neighbourhood *out)
{
    *out = (struct pt_neighbourhood){.kind = PT_SHAPE_KIND(shape)};
    out->major = base * pt_spacing_of_class(shape & 63u);
    out->minor = out->major * pt_exp2(-(double)(shape >> PT_SHAPE_RATIO_SHIFT & 15u) / 4.0);
    out->sigma = base / 16.0 * pt_spacing_of_class(shape >> PT_SHAPE_SIGMA_SHIFT & 63u);
    out->trust = pt_trust_of_level(shape >> PT_SHAPE_TRUST_SHIFT & 15u);
    out->beside = (shape & PT_SHAPE_BESIDE) != 0;
    if (normal_bits == PT_NORMAL_NONE)
        return;
    double t1[3], t2[3];
    const double angle = (shape >> PT_SHAPE_ANGLE_SHIFT & 63u) * PI / 64.0;
    out->has_normal = 1;
    pt_decode_normal(normal_bits, out->normal);
    frame_of(out->normal, t1, t2);
    for (int k = 0; k < 3; k++)
        out->axis[k] = pt_cos(angle) * t1[k] + pt_sin(angle) * t2[k];
}

int pt_shapes_beside(const struct patina_cloud *cloud)
{
    enum { LOOKED_AT = 512 }; // chunks at least
    const uint32_t step = cloud->chunk_count < 2 * LOOKED_AT ? 1 : cloud->chunk_count / LOOKED_AT;
    uint64_t asked = 0, found = 0;
    for (uint32_t c = 0; c < cloud->chunk_count; c += step) {
        const struct pt_chunk *chunk = &cloud->chunks[c];
        for (uint32_t i = 0; i < chunk->padded; i += 16, asked++)
            found += (cloud->shapes[chunk->first + i] & PT_SHAPE_BESIDE) != 0;
    }
    return 100 * found > asked;
}
