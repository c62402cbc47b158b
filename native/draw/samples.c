// SPDX-License-Identifier: GPL-3.0-or-later
// Which points a section line is traced through, and where the surface around each meets the plane.
#include "samples.h"
#include "base/compare.h"
#include "base/progress.h"
#include "base/vector.h"
#include "scene/analysis/analysis.h"
#include "scene/clouds/cloud.h"

#include <math.h>
#include <stdlib.h>

#define HALF_SCALES 1.5     // half of the slab: about six points per spacing of a line, whatever lies in the plane by chance
#define HALF_FOOTPRINTS 1.1 // at least, so that the slab holds a row of a scan whose rows are far apart
#define LEAST_SPACING 0.8   // of a point, in its chunk's: the analysis finds less at creases, where points do not lie closer
#define SLIDE 2.0           // scales at most that the surface around a point is followed to the plane
#define MOST_SIGMA 3.0      // spacings: what the analysis says of thicker surfaces is not told apart from two of them
#define FLATTEST 0.15       // sine of the angle between surface and plane: less has no line
#define MARGIN 8.0          // spacings beside the extent, so that lines reach its border

struct gathering {
    const struct pt_draw_plane *plane;
    const patina_cloud *cloud;
    const uint8_t *shown;
    double thickness, farthest;        // farthest: no point farther from the plane is taken
    double least_trust, least_spacing; // least_spacing: of the present chunk's points
    struct pt_cut_samples *samples;
};

static int grow(struct pt_cut_samples *samples)
{
    if (samples->count < samples->room)
        return PATINA_OK;
    if (samples->room > UINT32_MAX / 4)
        return PATINA_ERROR_TOO_MANY_POINTS;
    const uint32_t room = samples->room ? 2 * samples->room : 4096;
    struct pt_cut_sample *grown = realloc(samples->at, room * sizeof *grown);
    if (!grown)
        return PATINA_ERROR_MEMORY;
    samples->at = grown;
    samples->room = room;
    return PATINA_OK;
}

// Radius of the footprint in a direction, which need not lie on the surface.
static double radius_along(const struct pt_neighbourhood *hood, const double direction[3])
{
    const double *n = hood->normal, *a = hood->axis;
    const double b[3] = {n[1] * a[2] - n[2] * a[1], n[2] * a[0] - n[0] * a[2], n[0] * a[1] - n[1] * a[0]};
    const double x = pt_dot(direction, a), y = pt_dot(direction, b), length = sqrt(x * x + y * y);
    if (!(length > 1e-6) || !(hood->minor > 0.0))
        return 0.0;
    const double c = x / length / hood->major, s = y / length / hood->minor;
    return 1.0 / sqrt(c * c + s * s);
}

static int is_beside(const struct pt_draw_plane *plane, double u, double v, double spacing)
{
    return fabs(u) > plane->half[0] + MARGIN * spacing || fabs(v) > plane->half[1] + MARGIN * spacing;
}

// A point that the analysis took for part of a volume, as it does near corners: it joins lines of surfaces, and is none by itself.
static int rough_sample(const struct gathering *g, double d, double u, double v, double spacing, struct pt_cut_sample *out)
{
    const double half = g->thickness > 0.0 ? 0.5 * g->thickness : HALF_SCALES * spacing;
    if (fabs(d) > half || is_beside(g->plane, u, v, spacing))
        return 0;
    *out = (struct pt_cut_sample){.place = {u, v},
                                  .raw = {u, v},
                                  .out = (float)d,
                                  .slope = NAN,
                                  .spacing = (float)spacing,
                                  .scale = (float)spacing,
                                  .reach = (float)spacing};
    return 1;
}

// place: relative to the plane's origin. Returns 1 if the point belongs to the slab; fills the sample.
static int sample_of(const struct gathering *g, const double place[3], uint32_t surfel, uint32_t shape,
                     struct pt_cut_sample *out)
{
    const struct pt_draw_plane *plane = g->plane;
    struct pt_neighbourhood hood;
    const uint32_t bits = surfel & PT_NORMAL_BITS;
    const double d = pt_dot(place, plane->normal), u = pt_dot(place, plane->right), v = pt_dot(place, plane->up);
    pt_unpack_shape(shape, bits, g->cloud->spacing_base, &hood);
    const double spacing = fmax(g->cloud->spacing_base * pt_spacing_of_class(surfel >> PT_SPACING_SHIFT), g->least_spacing);
    if (!(spacing > 0.0) || hood.kind == PT_KIND_STRAY)
        return 0;
    if (!hood.has_normal || (hood.kind != PT_KIND_SURFACE && hood.kind != PT_KIND_BORDER))
        return rough_sample(g, d, u, v, spacing, out);
    const double nd = pt_dot(hood.normal, plane->normal), nu = pt_dot(hood.normal, plane->right),
                 nv = pt_dot(hood.normal, plane->up), flat = sqrt(nu * nu + nv * nv);
    if (flat < FLATTEST)
        return 0;
    const double sigma = fmin(hood.sigma / flat, MOST_SIGMA * spacing), scale = fmax(spacing, PT_SCALE_SIGMAS * sigma);
    const double half = g->thickness > 0.0 ? 0.5 * g->thickness
                                           : fmax(HALF_SCALES * scale, HALF_FOOTPRINTS * radius_along(&hood, plane->normal));
    if (fabs(d) > half || is_beside(plane, u, v, spacing))
        return 0;
    if (fabs(d * nd) > SLIDE * scale * flat)
        return 0;
    const double n[2] = {nu / flat, nv / flat}, slope = nd / flat;
    double along[3];
    for (int k = 0; k < 3; k++)
        along[k] = -n[1] * plane->right[k] + n[0] * plane->up[k];
    *out = (struct pt_cut_sample){.place = {u + d * slope * n[0], v + d * slope * n[1]},
                                  .raw = {u, v},
                                  .normal = {n[0], n[1]},
                                  .out = (float)d,
                                  .slope = (float)slope,
                                  .spacing = (float)spacing,
                                  .sigma = (float)sigma,
                                  .scale = (float)scale,
                                  .reach = (float)fmax(radius_along(&hood, along), spacing)};
    return 1;
}

static int is_shown(const struct gathering *g, uint64_t slot)
{
    const uint64_t number = g->shown ? pt_number_of(g->cloud, slot) : 0;
    return !g->shown || g->shown[number / 8] >> number % 8 & 1;
}

static int gather_chunk(struct gathering *g, const struct pt_chunk *chunk)
{
    const patina_cloud *cloud = g->cloud;
    const uint64_t slot = pt_chunk_slot(cloud, chunk);
    double from[3];
    g->least_spacing = LEAST_SPACING * (double)chunk->spacing;
    for (int k = 0; k < 3; k++)
        from[k] = chunk->origin[k] - g->plane->origin[k];
    for (uint32_t i = 0; i < chunk->count; i++) {
        float offset[3];
        pt_point_offset(cloud, chunk, i, offset);
        const double place[3] = {from[0] + (double)offset[0], from[1] + (double)offset[1], from[2] + (double)offset[2]};
        if (fabs(pt_dot(place, g->plane->normal)) > g->farthest || !is_shown(g, slot + i))
            continue;
        const uint32_t shape = cloud->shapes[slot + i];
        const int error = grow(g->samples);
        if (error)
            return error;
        if (!sample_of(g, place, cloud->surfels[slot + i], shape, &g->samples->at[g->samples->count]))
            continue;
        if (pt_trust_of_level(shape >> PT_SHAPE_TRUST_SHIFT & 15u) < g->least_trust)
            g->samples->untrusted++;
        else
            g->samples->count++;
    }
    return PATINA_OK;
}

// Whether points of the chunk may be near the plane; sets how far from it they are taken.
static int may_hold(struct gathering *g, const struct pt_chunk *chunk)
{
    double box_min[3], box_max[3], low[3], high[3];
    const double spacing = (double)chunk->spacing;
    for (int k = 0; k < 3; k++) {
        box_min[k] = chunk->origin[k] + (double)chunk->box_min[k];
        box_max[k] = chunk->origin[k] + (double)chunk->box_max[k];
    }
    // Spacings of points differ from the chunk's: four times of it is room enough, as are footprints up to the greatest.
    g->farthest = g->thickness > 0.0 ? 0.5 * g->thickness
                                     : fmax(4.0 * HALF_SCALES * spacing, HALF_FOOTPRINTS * (double)chunk->reach);
    pt_draw_plane_range(g->plane, box_min, box_max, low, high);
    const double beside = 4.0 * MARGIN * spacing;
    return low[2] <= g->farthest && high[2] >= -g->farthest && low[0] <= g->plane->half[0] + beside &&
           high[0] >= -g->plane->half[0] - beside && low[1] <= g->plane->half[1] + beside &&
           high[1] >= -g->plane->half[1] - beside;
}

static int measure_thickness(struct pt_cut_samples *samples)
{
    float *sorted = malloc((samples->count + 1) * sizeof *sorted);
    if (!sorted)
        return PATINA_ERROR_MEMORY;
    for (uint32_t i = 0; i < samples->count; i++)
        sorted[i] = samples->at[i].scale;
    qsort(sorted, samples->count, sizeof *sorted, pt_compare_floats);
    samples->thickness = samples->count ? 2.0 * HALF_SCALES * (double)sorted[samples->count / 2] : 0.0;
    free(sorted);
    return PATINA_OK;
}

static void scale_sample(struct pt_cut_sample *sample, double by)
{
    for (int k = 0; k < 2; k++) {
        sample->place[k] *= by;
        sample->raw[k] *= by;
    }
    float *const lengths[] = {&sample->out, &sample->spacing, &sample->sigma, &sample->scale, &sample->reach};
    for (int k = 0; k < 5; k++)
        *lengths[k] = (float)(by * (double)*lengths[k]);
}

int pt_cut_gather(const struct pt_draw_plane *plane, double thickness, const struct pt_cut_source *source,
                  patina_progress *progress, struct pt_cut_samples *samples)
{
    const patina_cloud *cloud = source->cloud;
    struct pt_draw_plane inside = *plane;
    double scale = 1.0;
    if (source->place && pt_draw_plane_inside(plane, source->place, &inside, &scale))
        return PATINA_ERROR_ARGUMENT;
    struct gathering g = {
        .plane = &inside, .cloud = cloud, .shown = source->shown, .thickness = thickness / scale, .samples = samples};
    const uint32_t before = samples->count;
    g.least_trust = pt_trust_of_level(pt_default_level(cloud->info.trusts)) - 1e-6;
    int error = PATINA_OK;
    for (uint32_t c = 0; c < cloud->chunk_count && !error; c++) {
        if (may_hold(&g, &cloud->chunks[c]))
            error = gather_chunk(&g, &cloud->chunks[c]);
        if (pt_progress_cancelled(progress))
            error = PATINA_ERROR_CANCELLED;
    }
    for (uint32_t i = before; i < samples->count && scale != 1.0; i++)
        scale_sample(&samples->at[i], scale);
    samples->thickness = thickness;
    return error || thickness > 0.0 ? error : measure_thickness(samples);
}

void pt_cut_free(struct pt_cut_samples *samples)
{
    free(samples->at);
    *samples = (struct pt_cut_samples){0};
}
