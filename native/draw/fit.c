// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit.h"
#include "base/elementary.h"

#include <math.h>
#include <string.h>

#define KERNEL 2.0     // standard deviation of the weights along the curve, in scales
#define KERNEL_END 2.5 // where they end, in standard deviations
#define AGREES 0.906   // cosine of the angle up to which a sample's surface counts fully (25 degrees),
#define DIFFERS 0.707  // and from which it does not count at all (45 degrees)
#define UNKNOWN 0.25   // weight of a sample whose normal is not known
#define BAND 0.75      // first band, in scales; at least
#define BAND_SIGMAS 4.0
#define ROUNDS 5
#define FEWEST 4
#define FEWEST_BEND 10 // samples that tell how a curve bends
#define ONE_SIDED 0.5  // mean of u, in kernels, from which on a curve is not bent: it would be extrapolated
#define TILT 0.5       // samples that lie nearer to the plane do not tell how steep a surface is; their normals do

static double smooth(double low, double high, double x)
{
    const double t = fmin(fmax((x - low) / (high - low), 0.0), 1.0);
    return t * t * (3.0 - 2.0 * t);
}

// Collects the samples that face as the curve does, with weights by distance along it.
static int collect(struct pt_fit *fit, const double place[2], const double direction[2], double scale)
{
    const double kernel = KERNEL * scale;
    double radius = KERNEL_END * kernel;
    uint32_t found = pt_near_find(fit->tree, place, radius, fit->number, PT_FIT_MOST);
    for (int i = 0; found > PT_FIT_MOST && i < 8; i++)
        found = pt_near_find(fit->tree, place, radius *= 0.7, fit->number, PT_FIT_MOST);
    found = found < PT_FIT_MOST ? found : PT_FIT_MOST;
    fit->count = 0;
    for (uint32_t i = 0; i < found; i++) {
        const struct pt_cut_sample *s = &fit->samples->at[fit->number[i]];
        const double across = s->normal[1] * direction[0] - s->normal[0] * direction[1]; // cosine between normals, signed
        const int known = s->normal[0] != 0.0 || s->normal[1] != 0.0;
        const double agrees = known ? smooth(DIFFERS, AGREES, fabs(across)) : UNKNOWN;
        if (!(agrees > 0.0))
            continue;
        const double x = s->place[0] - place[0], y = s->place[1] - place[1], rx = s->raw[0] - place[0],
                     ry = s->raw[1] - place[1];
        const double u = x * direction[0] + y * direction[1], t = u / kernel;
        const uint32_t at = fit->count++;
        fit->number[at] = fit->number[i];
        fit->u[at] = u;
        fit->residual[at] = y * direction[0] - x * direction[1];
        fit->v[at] = ry * direction[0] - rx * direction[1];
        fit->out[at] = (double)s->out;
        fit->given[at] = (double)s->slope * across;
        fit->weight[at] = agrees * pt_exp(-0.5 * t * t);
    }
    return fit->count >= FEWEST ? 0 : -1;
}

static double tukey(double residual, double band)
{
    const double t = residual / band, left = 1.0 - t * t;
    return left > 0.0 ? left * left : 0.0;
}

// Solves the symmetric system of n <= 4 unknowns by Cholesky's method. 0, or -1 if it is singular.
static int solve(double m[4][4], double x[4], int n)
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++) {
            double sum = m[i][j];
            for (int k = 0; k < j; k++)
                sum -= m[i][k] * m[j][k];
            if (i == j && !(sum > 1e-9 * (1e-30 + m[i][i])))
                return -1;
            m[i][j] = i == j ? sqrt(sum) : sum / m[j][j];
        }
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < i; k++)
            x[i] -= m[i][k] * x[k];
        x[i] /= m[i][i];
    }
    for (int i = n; i-- > 0;) {
        for (int k = i + 1; k < n; k++)
            x[i] -= m[k][i] * x[k];
        x[i] /= m[i][i];
    }
    return 0;
}

struct sums {
    double weight, u, known, scale, sigma, given; // known: weight of samples that tell the other three
    uint32_t count;
};

static struct sums sum_up(const struct pt_fit *fit, double band)
{
    struct sums s = {0};
    for (uint32_t i = 0; i < fit->count; i++) {
        const double w = fit->weight[i] * tukey(fit->residual[i], band);
        const struct pt_cut_sample *sample = &fit->samples->at[fit->number[i]];
        if (!(w > 0.0))
            continue;
        s.weight += w;
        s.u += w * fit->u[i];
        s.count++;
        if (!(sample->slope == sample->slope))
            continue;
        s.known += w;
        s.given += w * fit->given[i];
        s.scale += w * (double)sample->scale;
        s.sigma += w * (double)sample->sigma;
    }
    return s;
}

// One round of weighted least squares: unknowns are the offset, how the surface moves with the distance from the plane (beyond what the
// normals say), the slope and the bend. unit: a length that scales them. terms: 2, 3 or 4.
static int fit_round(struct pt_fit *fit, double band, double unit, double given, int terms, struct pt_curve *curve)
{
    double m[4][4] = {{0}}, x[4] = {0}, weight = 0.0;
    for (uint32_t i = 0; i < fit->count; i++) {
        const double w = fit->weight[i] * tukey(fit->residual[i], band), u = fit->u[i] / unit;
        const double row[4] = {1.0, fit->out[i] / unit, u, u * u}, v = (fit->v[i] + given * fit->out[i]) / unit;
        for (int j = 0; j < terms; j++) {
            for (int k = 0; k <= j; k++)
                m[j][k] += w * row[j] * row[k];
            x[j] += w * row[j] * v;
        }
        weight += w;
    }
    m[1][1] += weight * TILT * TILT / KERNEL / KERNEL;
    if (solve(m, x, terms))
        return -1;
    double square = 0.0;
    for (uint32_t i = 0; i < fit->count; i++) {
        const double w = fit->weight[i] * tukey(fit->residual[i], band), u = fit->u[i] / unit, o = fit->out[i] / unit;
        const double r = fit->v[i] + given * fit->out[i] - unit * (x[0] + x[1] * o + x[2] * u + x[3] * u * u);
        square += w * r * r;
        fit->residual[i] = r;
    }
    curve->offset = unit * x[0];
    curve->slope = x[2];
    curve->bend = x[3] / unit;
    curve->rms = sqrt(square / weight);
    curve->weight = weight;
    return 0;
}

int pt_fit_curve(struct pt_fit *fit, const double place[2], const double direction[2], double scale, struct pt_curve *curve)
{
    const double kernel = KERNEL * scale;
    if (collect(fit, place, direction, scale))
        return -1;
    double band = INFINITY;
    for (int i = 0; i < ROUNDS; i++) {
        const double wide = i ? band : BAND * scale;
        struct sums s = sum_up(fit, wide);
        if (s.count < FEWEST || !(s.known > 0.5))
            return -1;
        curve->sigma = s.sigma / s.known;
        curve->scale = s.scale / s.known;
        if (!i) { // as wide as noise asks for
            band = fmax(wide, BAND_SIGMAS * curve->sigma);
            s = sum_up(fit, band);
        }
        const int bends = i > 0 && s.count >= FEWEST_BEND && fabs(s.u / s.weight) < ONE_SIDED * kernel;
        if (fit_round(fit, band, kernel, s.given / s.known, bends ? 4 : 3, curve))
            return -1;
        band = fmin(band, fmax(BAND_SIGMAS * 1.15 * curve->rms, 0.1 * scale));
    }
    curve->band = band;
    return 0;
}
