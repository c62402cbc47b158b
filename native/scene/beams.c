// SPDX-License-Identifier: GPL-3.0-or-later
#include "beams.h"
#include "kernel_args.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

// Directions are counted in bins of equal solid angle: so many of the sine of elevation and of azimuth.
enum { RISES = 90, TURNS = 180, BINS = RISES * TURNS, LEAST_SAMPLES = 1000, LEAST_IN_BIN = 8 };

// ---- the rule of cells: what is tuned, in one place ---------------------------------------------------------------------------

// Half axes of a surface's ellipse, in intervals: 0.71 reaches a cell's corners; registration and dropped samples ask for more.
// tests/truth/scans, scenes for tuning, cameras 0, 3, 5: false surface 13.6 %, lost 4.1 %, 21.0 dB; with all three a tenth
// wider 14.1, 3.5, 21.2; with 1.3, 0.55, 0.6 14.8, 3.2, 21.2.
#define CELL 1.04
#define CELL_CAMERA 1.4  // a depth camera's steps in depth are wider than its cells: no neighbour on the plane is no border yet
#define CELL_BORDER 0.44 // where no neighbour lies beside it on both sides: a bar of a railing, a surface's end
#define CELL_DOT 0.48    // radius of what is no surface
#define CERTAIN 0.3      // least certainty of a plane that may lean: others are dots
#define FLATTEST 0.03    // |n . ray| below counts as this: a grazing beam's cell ends somewhere
#define NEAR 0.4         // of an interval, or 3 sigma: so near the plane are neighbours on it
#define LEAST_BESIDE 0.3 // intervals: neighbours nearer, or farther than MOST_BESIDE, say nothing; nor do those ASIDE of the row
#define MOST_BESIDE 1.6
#define ASIDE 0.8
#define CLEARLY 0.7 // a grid is an even one, as a depth camera's, where directions then lie so much more alike

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

uint32_t pt_beam_of(const patina_analysis_desc *desc, uint32_t number, const double p[3])
{
    if (desc->station.data) {
        const char *at = (const char *)desc->station.data + number * desc->station.stride;
        uint16_t wide;
        uint32_t index = *(const uint8_t *)at;
        if (desc->station.type == PATINA_UINT16) {
            memcpy(&wide, at, sizeof wide);
            index = wide;
        }
        if (index < desc->station_count)
            return index;
    }
    uint32_t nearest = 0;
    double least = INFINITY;
    for (uint32_t s = 0; s < desc->station_count; s++) {
        double square = 0.0;
        for (int k = 0; k < 3; k++)
            square += (desc->stations[3 * s + k] - p[k]) * (desc->stations[3 * s + k] - p[k]);
        nearest = square < least ? s : nearest;
        least = fmin(least, square);
    }
    return nearest;
}

// ---- intervals ---------------------------------------------------------------------------------------------------------------

static int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// On a grid of equal steps d in elevation and azimuth, N samples in the solid angle W at elevation e: d^2 = W / (N cos(e));
// on an even one d^2 = W / N. Bins that hold an edge of what was seen, or dropped samples, tell too wide a step: the lower quartile
// counts. spread: of the squares, from quartile to quartile.
static double step_on(const uint32_t *bins, int even, double *squares, double *spread)
{
    uint32_t count = 0;
    for (uint32_t b = 0; b < BINS; b++) {
        const double sine = (b / TURNS + 0.5) * 2.0 / RISES - 1.0;
        if (bins[b] >= LEAST_IN_BIN)
            squares[count++] = 4.0 * PI / BINS / (bins[b] * (even ? 1.0 : sqrt(1.0 - sine * sine)));
    }
    *spread = 1.0;
    if (!count)
        return 0.0;
    qsort(squares, count, sizeof *squares, compare_doubles);
    *spread = squares[3 * (size_t)count / 4] / squares[count / 4];
    return sqrt(squares[count / 4]);
}

static void set_step(const uint32_t *bins, double *squares, struct pt_beam *beam)
{
    double spread, spread_even;
    const double step = step_on(bins, 0, squares, &spread), step_even = step_on(bins, 1, squares, &spread_even);
    beam->even = spread_even < CLEARLY * spread;
    beam->step = beam->even ? step_even : step;
}

static void count_directions(const struct patina_cloud *cloud, const patina_analysis_desc *desc, uint32_t *bins)
{
    for (uint32_t c = 0; c < cloud->chunk_count; c++) {
        const struct pt_chunk *chunk = &cloud->chunks[c];
        for (uint32_t i = 0; i < chunk->count; i++) {
            double p[3], d[3];
            for (uint32_t k = 0; k < 3; k++)
                p[k] = chunk->origin[k] + (double)cloud->positions[3 * (size_t)chunk->first + k * chunk->padded + i];
            const uint32_t s = pt_beam_of(desc, cloud->order[chunk->first + i], p);
            for (int k = 0; k < 3; k++)
                d[k] = p[k] - desc->stations[3 * s + k];
            const double length = sqrt(dot(d, d));
            if (!(length > 0.0))
                continue;
            const double rise = 0.5 * RISES * (d[2] / length + 1.0), turn = TURNS * (0.5 + atan2(d[1], d[0]) / (2.0 * PI));
            const uint32_t row = (uint32_t)fmin(rise, RISES - 1.0), column = (uint32_t)fmin(turn, TURNS - 1.0);
            bins[(size_t)s * BINS + row * TURNS + column]++;
        }
    }
}

int pt_beams_create(const struct patina_cloud *cloud, const patina_analysis_desc *desc, struct pt_beams *out)
{
    *out = (struct pt_beams){ .count = desc->station_count };
    if (!desc->station_count)
        return PATINA_OK;
    uint32_t *bins = calloc((size_t)desc->station_count * BINS, sizeof *bins);
    double *squares = malloc(BINS * sizeof *squares);
    out->each = calloc(desc->station_count, sizeof *out->each);
    int error = bins && squares && out->each ? PATINA_OK : PATINA_ERROR_MEMORY;
    if (!error)
        count_directions(cloud, desc, bins);
    for (uint32_t s = 0; s < desc->station_count && !error; s++) {
        uint64_t samples = 0;
        for (uint32_t b = 0; b < BINS; b++)
            samples += bins[(size_t)s * BINS + b];
        memcpy(out->each[s].place, desc->stations + 3 * s, sizeof out->each[s].place);
        if (samples >= LEAST_SAMPLES)
            set_step(bins + (size_t)s * BINS, squares, &out->each[s]);
    }
    free(bins);
    free(squares);
    if (error)
        pt_beams_destroy(out);
    return error;
}

void pt_beams_destroy(struct pt_beams *beams)
{
    free(beams->each);
    *beams = (struct pt_beams){ 0 };
}

// ---- cells -------------------------------------------------------------------------------------------------------------------

// v as the beam along `ray` carries it onto the plane across n.
static void carry(const double v[3], const double ray[3], const double n[3], double facing, double out[3])
{
    const double along = dot(v, n) / facing;
    for (int k = 0; k < 3; k++)
        out[k] = v[k] - along * ray[k];
}

// The axes of the ellipse that has a and b for conjugate half diameters; returns the greater's direction in `axis`.
static void ellipse_of(const double a[3], const double b[3], double axis[3], double *major, double *minor)
{
    const double aa = dot(a, a), bb = dot(b, b), ab = dot(a, b), half = 0.5 * (aa - bb), root = sqrt(half * half + ab * ab);
    const double turn = 0.5 * atan2(ab, half), c = cos(turn), s = sin(turn);
    for (int k = 0; k < 3; k++)
        axis[k] = c * a[k] + s * b[k];
    *major = sqrt(0.5 * (aa + bb) + root);
    *minor = sqrt(fmax(0.5 * (aa + bb) - root, 0.0));
    const double length = sqrt(dot(axis, axis));
    for (int k = 0; k < 3; k++)
        axis[k] = length > 0.0 ? axis[k] / length : a[k];
}

// Whether neighbours lie beside the point on both sides along the cell's first direction, and along its second: within an
// interval and a half, no farther off the plane than NEAR of one.
static void look_beside(const struct pt_sample *sample, const double ray[3], const double n[3], double facing, const double a[3],
                        const double b[3], double near, int beside[2])
{
    const double aa = dot(a, a), bb = dot(b, b), ab = dot(a, b), determinant = aa * bb - ab * ab;
    int sides = 0;
    for (uint32_t i = 0; i < sample->count && sides != 15; i++) {
        double o[3];
        if (fabs(dot(sample->offset[i], n)) > near)
            continue;
        carry(sample->offset[i], ray, n, facing, o);
        const double oa = dot(o, a), ob = dot(o, b), s = (bb * oa - ab * ob) / determinant, t = (aa * ob - ab * oa) / determinant;
        if (fabs(s) > LEAST_BESIDE && fabs(s) < MOST_BESIDE && fabs(t) < ASIDE)
            sides |= s > 0.0 ? 1 : 2;
        if (fabs(t) > LEAST_BESIDE && fabs(t) < MOST_BESIDE && fabs(s) < ASIDE)
            sides |= t > 0.0 ? 4 : 8;
    }
    beside[0] = (sides & 3) == 3;
    beside[1] = (sides & 12) == 12;
}

void pt_beam_limit(const struct pt_beam *beam, const double p[3], const struct pt_sample *sample, struct pt_neighbourhood *hood)
{
    double ray[3], across[3], up[3], a[3], b[3], axis[3], major, minor;
    int beside[2];
    for (int k = 0; k < 3; k++)
        ray[k] = p[k] - beam->place[k];
    const double range = sqrt(dot(ray, ray)), level = sqrt(ray[0] * ray[0] + ray[1] * ray[1]), width = range * beam->step;
    if (!(width > 0.0))
        return;
    if (!hood->has_normal || hood->certainty < CERTAIN) {
        hood->has_normal = 0;
        hood->major = hood->minor = CELL_DOT * width;
        hood->spacing = fmin(hood->spacing, hood->major);
        return;
    }
    for (int k = 0; k < 3; k++)
        ray[k] /= range;
    across[0] = level > 0.0 ? -ray[1] * range / level : 1.0; // along a row
    across[1] = level > 0.0 ? ray[0] * range / level : 0.0;
    across[2] = 0.0;
    up[0] = across[1] * ray[2] - across[2] * ray[1];
    up[1] = across[2] * ray[0] - across[0] * ray[2];
    up[2] = across[0] * ray[1] - across[1] * ray[0];
    double facing = dot(ray, hood->normal);
    facing = fabs(facing) < FLATTEST ? (facing < 0.0 ? -FLATTEST : FLATTEST) : facing;
    for (int k = 0; k < 3; k++) {
        across[k] *= width * (beam->even ? 1.0 : fmax(level / range, 0.1));
        up[k] *= width;
    }
    carry(across, ray, hood->normal, facing, a); // whole intervals
    carry(up, ray, hood->normal, facing, b);
    look_beside(sample, ray, hood->normal, facing, a, b, fmax(3.0 * hood->sigma, NEAR * width), beside);
    for (int k = 0; k < 3; k++) {
        a[k] *= beam->even ? CELL_CAMERA : beside[0] ? CELL : CELL_BORDER;
        b[k] *= beam->even ? CELL_CAMERA : beside[1] ? CELL : CELL_BORDER;
    }
    ellipse_of(a, b, axis, &major, &minor);
    if (!(major * minor < hood->major * hood->minor))
        return;
    hood->spacing = fmin(hood->spacing, sqrt(major * minor) / CELL);
    hood->major = major;
    hood->minor = minor;
    memcpy(hood->axis, axis, sizeof axis);
}
