// SPDX-License-Identifier: GPL-3.0-or-later
// Normals in 26 bits: the octahedral map, 8191 steps a side.
#include "cloud.h"
#include "shared/words.h"

#include <math.h>

void pt_decode_normal(uint32_t word, double n[3])
{
    double x = ((double)(word & 0x1FFFu) - 4095.0) / 4095.0;
    double y = ((double)(word >> 13 & 0x1FFFu) - 4095.0) / 4095.0;
    double z = 1.0 - fabs(x) - fabs(y), fold = fmax(-z, 0.0);
    n[0] = x >= 0.0 ? x - fold : x + fold;
    n[1] = y >= 0.0 ? y - fold : y + fold;
    n[2] = z;
    double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int i = 0; i < 3; i++)
        n[i] /= length;
}

uint32_t pt_encode_normal(const double n[3])
{
    double largest = fmax(fabs(n[0]), fmax(fabs(n[1]), fabs(n[2])));
    double v[3] = {n[0] / largest, n[1] / largest, n[2] / largest};
    double sum = fabs(v[0]) + fabs(v[1]) + fabs(v[2]);
    double x = v[0] / sum, y = v[1] / sum;
    if (v[2] < 0.0) {
        double folded = (1.0 - fabs(y)) * (x >= 0.0 ? 1.0 : -1.0);
        y = (1.0 - fabs(x)) * (y >= 0.0 ? 1.0 : -1.0);
        x = folded;
    }
    double gx = floor((x + 1.0) * 4095.0), gy = floor((y + 1.0) * 4095.0), best = -2.0;
    uint32_t word = 0;
    for (int k = 0; k < 4; k++) { // the nearest of the four grid directions around
        double cx = fmin(gx + (k & 1), 8190.0), cy = fmin(gy + (k >> 1), 8190.0), c[3];
        uint32_t candidate = (uint32_t)cx | (uint32_t)cy << 13;
        pt_decode_normal(candidate, c);
        double dot = c[0] * v[0] + c[1] * v[1] + c[2] * v[2];
        if (dot > best) {
            best = dot;
            word = candidate;
        }
    }
    return word;
}

void pt_chunk_cone(struct pt_chunk *chunk, const uint32_t *surfels)
{
    double axis[3] = {0.0, 0.0, 0.0}, n[3], cosine = 1.0;
    chunk->cone_cosine = -2.0f;
    for (uint32_t i = 0; i < chunk->count; i++) {
        if ((surfels[i] & PT_NORMAL_BITS) == PT_NORMAL_NONE)
            return;
        pt_decode_normal(surfels[i] & PT_NORMAL_BITS, n);
        for (int k = 0; k < 3; k++)
            axis[k] += n[k];
    }
    double length = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
    if (!(length > 0.0))
        return;
    for (int k = 0; k < 3; k++) {
        axis[k] /= length;
        chunk->cone_axis[k] = (float)axis[k];
    }
    for (uint32_t i = 0; i < chunk->count; i++) {
        pt_decode_normal(surfels[i] & PT_NORMAL_BITS, n);
        cosine = fmin(cosine, n[0] * axis[0] + n[1] * axis[1] + n[2] * axis[2]);
    }
    chunk->cone_cosine = (float)(cosine - 1e-6);
}
