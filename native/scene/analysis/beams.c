// SPDX-License-Identifier: GPL-3.0-or-later
#include "beams.h"
#include "base/elementary.h"
#include "base/vector.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

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
#define LEAST_BESIDE                                                                                                           \
    0.3 // intervals: neighbours nearer, or farther than MOST_BESIDE, say nothing; nor do those ASIDE of the row
#define MOST_BESIDE 1.6
#define ASIDE 0.8

int pt_beams_create(const struct patina_cloud *cloud, const patina_analysis_desc *desc, struct pt_pool *pool,
                    struct pt_beams *out)
{
    *out = (struct pt_beams){.count = desc->station_count};
    if (!desc->station_count)
        return PATINA_OK;
    struct pt_interval *intervals = calloc(desc->station_count, sizeof *intervals);
    out->each = calloc(desc->station_count, sizeof *out->each);
    int error = intervals && out->each ? pt_intervals_find(cloud, desc, pool, intervals) : PATINA_ERROR_MEMORY;
    for (uint32_t s = 0; s < desc->station_count && !error; s++) {
        memcpy(out->each[s].place, desc->stations + 3 * s, sizeof out->each[s].place);
        out->each[s].interval = intervals[s];
    }
    free(intervals);
    if (error)
        pt_beams_destroy(out);
    return error;
}

void pt_beams_destroy(struct pt_beams *beams)
{
    free(beams->each);
    *beams = (struct pt_beams){0};
}

// ---- cells -------------------------------------------------------------------------------------------------------------------

// v as the beam along `ray` carries it onto the plane across n.
static void carry(const double v[3], const double ray[3], const double n[3], double facing, double out[3])
{
    const double along = pt_dot(v, n) / facing;
    for (int k = 0; k < 3; k++)
        out[k] = v[k] - along * ray[k];
}

// Whether neighbours lie beside the point on both sides along the cell's first direction, and along its second: within an
// interval and a half, no farther off the plane than NEAR of one.
static void look_beside(const struct pt_sample *sample, const double ray[3], const double n[3], double facing,
                        const double a[3], const double b[3], double near, int beside[2])
{
    const double aa = pt_dot(a, a), bb = pt_dot(b, b), ab = pt_dot(a, b), determinant = aa * bb - ab * ab;
    int sides = 0;
    for (uint32_t i = 0; i < sample->count && sides != 15; i++) {
        double o[3];
        if (fabs(pt_dot(sample->offset[i], n)) > near)
            continue;
        carry(sample->offset[i], ray, n, facing, o);
        const double oa = pt_dot(o, a), ob = pt_dot(o, b), s = (bb * oa - ab * ob) / determinant,
                     t = (aa * ob - ab * oa) / determinant;
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
    const double range = sqrt(pt_dot(ray, ray)), level = sqrt(ray[0] * ray[0] + ray[1] * ray[1]);
    const struct pt_interval *interval = &beam->interval;
    const double width = range * sqrt(interval->azimuth * interval->elevation);
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
    double facing = pt_dot(ray, hood->normal);
    facing = fabs(facing) < FLATTEST ? (facing < 0.0 ? -FLATTEST : FLATTEST) : facing;
    for (int k = 0; k < 3; k++) {
        across[k] *= range * interval->azimuth * (interval->even ? 1.0 : fmax(level / range, 0.1));
        up[k] *= range * interval->elevation;
    }
    carry(across, ray, hood->normal, facing, a); // whole intervals
    carry(up, ray, hood->normal, facing, b);
    look_beside(sample, ray, hood->normal, facing, a, b, fmax(3.0 * hood->sigma, NEAR * width), beside);
    for (int k = 0; k < 3; k++) {
        a[k] *= interval->even ? CELL_CAMERA : beside[0] ? CELL : CELL_BORDER;
        b[k] *= interval->even ? CELL_CAMERA : beside[1] ? CELL : CELL_BORDER;
    }
    pt_ellipse_of(a, b, axis, &major, &minor);
    if (!(major * minor < hood->major * hood->minor))
        return;
    hood->spacing = fmin(hood->spacing, sqrt(major * minor) / CELL);
    hood->major = major;
    hood->minor = minor;
    memcpy(hood->axis, axis, sizeof axis);
}
