// SPDX-License-Identifier: GPL-3.0-or-later
// Planes and quadrics through neighbours, in float64: covariance about the mean, least squares.
#include "neighbourhood.h"
#include "base/symmetric.h"
#include "base/vector.h"

#include <math.h>

// Thickness over width, squared. A plane's neighbours at a noise of a quarter of the spacing have 0.05 among 16, a crease of
// 90 degrees 0.28 among any number.
#define FLAT 0.03
#define FLAT_BEST 0.6 // more neighbours are better when they bring it below this part: noise falls to a third, creases stay
#define BENT 7e-4     // a quadric may explain it: at less, sigma is below a thirtieth of the spacing
#define TIGHT 0.4     // RMS in parts of a slab's half thickness; of points spread over it, 0.58
#define TIGHTER 0.1   // nobody's noise: two in five are enough then
#define APART                                                                                                                  \
    1.1 // of the neighbours' mean spacing: sheets of one surface lie nearer; from about 0.9 of their own on they are two
#define SHEET 0.3  // spread of their distances from the plane in parts of the mean: at a crease 0.58
#define LINEAR 0.1 // narrowness squared: 16 neighbours on one row of a scan

void pt_plane_fit(const struct pt_sample *sample, uint64_t inside, struct pt_plane *plane)
{
    double sum[3] = {0.0, 0.0, 0.0}, a[3][3] = {{0.0}};
    *plane = (struct pt_plane){.inside = inside, .count = 1};
    const double scale = sample->count && sample->square[sample->count - 1] > 0.0
                             ? 1.0 / sqrt(sample->square[sample->count - 1])
                             : 1.0;
    for (uint32_t i = 0; i < sample->count; i++) {
        if (!(inside >> i & 1u))
            continue;
        const double *o = sample->offset[i], x = o[0] * scale, y = o[1] * scale, z = o[2] * scale;
        plane->count++;
        sum[0] += x;
        sum[1] += y;
        sum[2] += z;
        a[0][0] += x * x;
        a[0][1] += x * y;
        a[0][2] += x * z;
        a[1][1] += y * y;
        a[1][2] += y * z;
        a[2][2] += z * z;
    }
    const double part = 1.0 / plane->count;
    for (int i = 0; i < 3; i++)
        for (int k = i; k < 3; k++)
            a[k][i] = a[i][k] = (a[i][k] - sum[i] * sum[k] * part) * part;
    pt_solve_symmetric(a, plane->value, plane->axis);
    for (int k = 0; k < 3; k++) {
        plane->mean[k] = sum[k] * part / scale;
        plane->value[k] /= scale * scale;
    }
}

int pt_plane_is_doubtful(const struct pt_plane *plane)
{
    return plane->value[0] > FLAT * plane->value[1] || plane->value[1] <= LINEAR * plane->value[2];
}

int pt_plane_prefers_wide(const struct pt_plane *narrow, const struct pt_plane *wide)
{
    if (narrow->value[1] <= LINEAR * narrow->value[2])
        return 1;
    return wide->value[0] * narrow->value[1] < FLAT_BEST * narrow->value[0] * wide->value[1];
}

// ---- most of them ----------------------------------------------------------------------------------------------------------

static uint64_t within_of(const struct pt_sample *sample, const double normal[3], double place, double within)
{
    uint64_t inside = 0;
    for (uint32_t i = 0; i < sample->count; i++)
        inside |= (uint64_t)(fabs(pt_dot(normal, sample->offset[i]) - place) <= within) << i;
    return inside;
}

int pt_plane_through_most(const struct pt_sample *sample, const struct pt_plane *plane, double within, struct pt_plane *out)
{
    enum { TRIED = 10 }; // 45 planes through the point and two of its nearest
    uint64_t best = 0;
    const int known = __builtin_popcountll(within_of(sample, plane->axis[0], pt_dot(plane->axis[0], plane->mean), within));
    for (uint32_t i = 0; i < TRIED && i < sample->count; i++)
        for (uint32_t j = 0; j < i; j++) {
            const double *a = sample->offset[i], *b = sample->offset[j];
            double n[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
            const double square = pt_dot(n, n);
            if (!(square > 0.1 * sample->square[i] * sample->square[j]))
                continue; // too slim a triangle
            const double length = sqrt(square);
            for (int k = 0; k < 3; k++)
                n[k] /= length;
            const uint64_t inside = within_of(sample, n, 0.0, within);
            if (__builtin_popcountll(inside) > __builtin_popcountll(best))
                best = inside;
        }
    const int found = __builtin_popcountll(best);
    if (5 * found < 2 * (int)sample->count || found < 5)
        return 0;
    pt_plane_fit(sample, best, out);
    const double rms = sqrt(out->value[0]);
    if (rms > TIGHT * within) // they fill the slab, as any would: no plane
        return 0;
    if (rms > TIGHTER * within && (2 * found < (int)sample->count || 5 * found < 7 * known))
        return 0;
    const double place = pt_dot(out->axis[0], out->mean);
    const uint64_t again = within_of(sample, out->axis[0], place, within);
    if (__builtin_popcountll(again) >= found)
        pt_plane_fit(sample, again, out);
    return 1;
}

// ---- thickness -------------------------------------------------------------------------------------------------------------

// z = a + b x + c y + d x^2 + e x y + f y^2 by least squares over the plane's points, lengths over `scale`. The sum of the
// squares of what is left, or a negative number where they do not determine it.
static double quadric_residual(const struct pt_sample *sample, const struct pt_plane *plane, double scale)
{
    double m[6][7] = {{0.0}}, squares = 0.0;
    for (uint32_t i = 0; i <= sample->count; i++) {
        static const double none[3];
        const double *o = i < sample->count ? sample->offset[i] : none; // the point itself last
        if (i < sample->count && !(plane->inside >> i & 1u))
            continue;
        const double x = pt_dot(plane->axis[2], o) * scale, y = pt_dot(plane->axis[1], o) * scale;
        const double z = pt_dot(plane->axis[0], o) * scale, basis[7] = {1.0, x, y, x * x, x * y, y * y, z};
        for (int r = 0; r < 6; r++)
            for (int c = r; c < 7; c++)
                m[r][c] += basis[r] * basis[c];
        squares += z * z;
    }
    for (int r = 0; r < 6; r++) { // Cholesky, the right side taken along: each step takes its share of the squares
        const double pivot = m[r][r];
        if (!(pivot > 1e-9))
            return -1.0;
        for (int i = r + 1; i < 6; i++) {
            const double part = m[r][i] / pivot;
            for (int c = i; c < 7; c++)
                m[i][c] -= part * m[r][c];
        }
        squares -= m[r][6] * m[r][6] / pivot;
    }
    return squares > 0.0 ? squares : 0.0;
}

// Neighbours off the plane that lie on sheets beside it, as another scan's do: the variance of all of them. Those of a crease
// spread from the plane on. 0 where there are none, or they are
// too far to be of the same surface: beside.
static double sheet_variance(const struct pt_sample *sample, const struct pt_plane *plane, int *beside)
{
    double off = 0.0, off_squares = 0.0, sum = 0.0, squares = 0.0;
    uint32_t outside = 0;
    for (uint32_t i = 0; i < sample->count; i++) {
        const double z = pt_dot(plane->axis[0], sample->offset[i]);
        sum += z;
        squares += z * z;
        if (plane->inside >> i & 1u)
            continue;
        outside++;
        off += fabs(z);
        off_squares += z * z;
    }
    if (8 * outside < sample->count)
        return 0.0;
    off /= outside;
    const double pi = 3.14159265358979323846, apart = APART * sqrt(pi * sample->square[sample->count - 1] / sample->count);
    if (off_squares / outside - off * off > SHEET * SHEET * off * off)
        return 0.0;
    *beside = off > apart;
    if (*beside)
        return 0.0;
    return fmax(squares - sum * sum / (sample->count + 1.0), 0.0) / sample->count;
}

double pt_plane_sigma(const struct pt_sample *sample, const struct pt_plane *plane, int *beside)
{
    *beside = 0;
    const double sheets = sheet_variance(sample, plane, beside);
    if (sheets > 0.0)
        return sqrt(sheets);
    const double n = plane->count;
    double variance = plane->count > 3 ? plane->value[0] * n / (n - 3.0) : plane->value[0];
    if (plane->count < 10 || !(variance > BENT * plane->value[1]))
        return sqrt(variance);
    const double scale = 1.0 / sqrt(plane->value[1]), left = quadric_residual(sample, plane, scale);
    if (left >= 0.0)
        variance = fmin(variance, left / (n - 6.0) / (scale * scale));
    return sqrt(variance);
}
