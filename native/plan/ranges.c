// SPDX-License-Identifier: GPL-3.0-or-later
// Range images [K], SPEC 6: which clouds are drawn as such, the image buffer of each, and its passes.
#include "ranges.h"

#include "passes.h"
#include "scene/scans.h"
#include "shared/picture.h"
#include "shared/points.h"
#include "shared/ranges.h"

#include <math.h>
#include <string.h>

// The side of a cell in spacings of the points on screen: of random points one cell in fifty stays empty.
#define CELL_SPACINGS 2.0
#define WIDEST_CELL 32.0 // pixels, automatic: points that lie farther apart are no surface
#define NESTED 3.0       // cells in the next wider one: of so much wider spacings the narrow ones leave one cell in fifty empty
#define GAMMA_SAMPLES 2.0 // automatic gamma, in intervals of the samples [K II.B]: 1 to 3
#define GAMMA_CELLS 2.0f  // and at least so many cells

// Of two passes the first is not sharp where more points share a cell than of a surface that is seen from the front, times this, and where
// one is seen at less than this cosine, 66 degrees.
#define CROWDED 2.5f
#define GRAZED 0.4f

int pt_draws_ranges(const struct patina_scene *scene, const struct pt_plan *plan, const struct pt_instance *instance)
{
    return (instance->style.surface == PATINA_SURFACE_RANGES || scene->settings.surface == PATINA_SURFACE_RANGES) &&
           !pt_all_soft(instance) && !plan->ids.filled;
}

// Whether cells follow how far points lie apart, from wide ones to narrow ones.
static int nests(const struct pt_instance *instance)
{
    return !(instance->style.range_pixel > 0.0f) && !(instance->style.range_sharpness > 0.0f);
}

uint32_t pt_range_pixels(const struct patina_scene *scene, const struct pt_instance *instance, const struct pt_spread *spread,
                         double pixels[PT_RANGE_FINER + 1])
{
    const double set = (double)instance->style.range_pixel, finer = (double)pt_finer(scene),
                 sharpness = (double)instance->style.range_sharpness;
    uint32_t count = 1;
    pixels[0] = set > 0.0 ? set * finer : fmin(fmax(CELL_SPACINGS * spread->most, 1.0), WIDEST_CELL * finer);
    if (sharpness > 0.0 && pixels[0] * sharpness >= 1.0) // else pixels are as fine
        pixels[count++] = pixels[0] * sharpness;
    const double least = fmax(CELL_SPACINGS * spread->least, 1.0);
    while (nests(instance) && count <= PT_RANGE_FINER && pixels[count - 1] >= NESTED * least) {
        pixels[count] = pixels[count - 1] / NESTED;
        count++;
    }
    return count;
}

uint32_t pt_range_reach(double pixel) { return (uint32_t)ceil(2.0 * pixel) + 1; }

static void set_gamma(const struct patina_scene *scene, const struct pt_instance *instance, double scale, struct pt_range *out)
{
    const struct patina_scans *scans = instance->style.scans;
    const double thinned = pt_thinning(scene), set = (double)instance->style.range_gamma;
    const double interval = scans && scans->interval > 0.0 ? scans->interval : instance->cloud->built;
    const double gamma = (set > 0.0 ? set : GAMMA_SAMPLES * thinned * interval) * scale;
    out->gamma = (float)fmin(fmax(gamma, (double)PT_RANGE_LEAST), (double)PT_RANGE_MOST); // NaN: nothing of a scale of 0
    out->gamma_cells = set > 0.0 ? 0.0f : GAMMA_CELLS;
}

static void place(const struct patina_scene *scene, struct pt_plan *plan, const struct pt_instance *instance,
                  const struct pt_eye *eye, double scale, double pixel, double spacing_px, struct pt_range *out)
{
    struct view_args *cells = &out->cells;
    const double origin[2] = {plan->view.origin_x, plan->view.origin_y}, size[2] = {plan->view.width, plan->view.height};
    uint32_t across[2];
    *cells = plan->view;
    out->pixel = (float)pixel;
    pixel = (double)out->pixel; // kernels divide by the same
    out->widest = nests(instance) ? pixel : INFINITY;
    out->most = nests(instance)
                    ? (float)(CELL_SPACINGS * CELL_SPACINGS * NESTED * NESTED)
                    : CROWDED * (spacing_px > 0.0 ? (float)fmax(pixel * pixel / (spacing_px * spacing_px), 1.0) : 1.0f);
    out->eye = *eye;
    out->eye.xs *= pixel;
    out->eye.ys *= pixel;
    for (int k = 0; k < 2; k++) { // and one around
        const double first = floor(origin[k] / pixel) - 1.0;
        *(k ? &cells->origin_y : &cells->origin_x) = (int32_t)first;
        across[k] = (uint32_t)(floor((origin[k] + size[k]) / pixel) + 2.0 - first);
    }
    cells->width = across[0];
    cells->height = across[1];
    cells->ray_xs = (float)out->eye.xs;
    cells->ray_ys = (float)out->eye.ys;
    cells->footprint = (float)fmax(out->eye.xs, out->eye.ys);
    memset(cells->rect, 0, sizeof cells->rect);
    set_gamma(scene, instance, scale, out);
    if ((uint64_t)across[0] * across[1] > plan->ranges.cells)
        plan->ranges.cells = across[0] * across[1];
}

void pt_range_place(const struct patina_scene *scene, struct pt_plan *plan, const struct pt_instance *instance,
                    const struct pt_eye *eye, double scale, const double *pixels, uint32_t count,
                    const struct pt_spread *spread, struct pt_range *out)
{
    for (uint32_t k = 0; k < count; k++) {
        place(scene, plan, instance, eye, scale, pixels[k], spread->middle, &out[k]);
        out[k].fine = k + 1 < count ? &out[k + 1] : NULL;
    }
}

void pt_range_rect(const struct pt_range *range, const double bounds[4], uint32_t pad, uint32_t rect[4])
{
    const double origin[2] = {range->cells.origin_x, range->cells.origin_y},
                 size[2] = {range->cells.width, range->cells.height};
    for (int k = 0; k < 2; k++) {
        const double first = floor((bounds[k] + pad) / (double)range->pixel) - 1.0 - origin[k];
        const double last = floor((bounds[2 + k] + pad) / (double)range->pixel) + 2.0 - origin[k];
        rect[k] = (uint32_t)fmin(fmax(first, 0.0), size[k]);
        rect[2 + k] = (uint32_t)fmin(fmax(last, 0.0), size[k]);
    }
}

// ---- passes ------------------------------------------------------------------------------------------------------------

static void add_cells(struct pt_builder *builder, uint32_t i, const struct pt_range *range, struct pt_ref chunks, int behind)
{
    const struct pt_plan *plan = builder->plan;
    const struct pt_plan_instance *instance = &plan->instances[i];
    const struct pt_ref keys = pt_plane_at(PT_PLANE_CELLS, 0), beyond = pt_plane_if(behind, PT_PLANE_CELL_BEYOND, 0);
    const struct pt_ref drawn = plan->drawn_words ? pt_buffer_of(PT_DRAWN, 0) : pt_nothing();
    const struct coarsen_args coarsen = {.view = range->cells,
                                         .width = plan->view.width,
                                         .height = plan->view.height,
                                         .origin_x = plan->view.origin_x,
                                         .origin_y = plan->view.origin_y,
                                         .pixel = range->pixel,
                                         .behind = (uint32_t)behind};
    PT_REASON(PT_ADD(builder, coarsen, coarsen, {keys, pt_plane_if(behind, PT_PLANE_LIMIT, 0), beyond}),
              "instance %u is range images, in %u x %u cells of %.2f pixels", i, range->cells.width, range->cells.height,
              (double)range->pixel);
    const struct scatter_args scatter = {
        .view = range->cells, .instances = 1, .behind = (uint32_t)behind, .sifted = plan->drawn_words > 0};
    struct pt_ref of_points[3 + PT_KIND_BUFFERS] = {keys, beyond, drawn};
    const uint32_t count = 3 + pt_bind_kind(PT_AS_RANGES, i, of_points + 3);
    of_points[3] = chunks; // of the cells at hand
    PT_REASON(pt_add(builder, PT_KERNEL_scatter, "scatter", &scatter, sizeof scatter, of_points, count),
              "%llu points in %u chunks of instance %u, into cells", (unsigned long long)instance->points,
              instance->chunk_count, i);
    const struct merge_args merge = {.view = range->cells,
                                     .instance = instance->args,
                                     .gamma = range->gamma,
                                     .gamma_cells = range->gamma_cells,
                                     .sifted = plan->drawn_words > 0};
    PT_REASON(PT_ADD(builder, merge, merge,
                     {keys, pt_plane_at(PT_PLANE_CELL_PLACE, 0), pt_plane_at(PT_PLANE_CELL_MERGED, 0), chunks,
                      pt_buffer_of(PT_POSITIONS, i), pt_buffer_of(PT_SURFELS, i), pt_buffer_of(PT_COLORS, i),
                      pt_buffer_of(PT_OPACITIES, i), drawn}),
              "means of points up to gamma %.3g behind the nearest", (double)range->gamma);
}

// Whether the picture is to tell how far scans lie apart, and the instance knows its own.
static int differs(const struct pt_builder *builder, const struct pt_plan_instance *instance)
{
    return builder->layer <= 1 && !builder->behind && !builder->plan->map &&
           builder->scene->settings.passes >> PATINA_PASS_DISAGREEMENT & 1u && instance->instance->style.scans;
}

static void add_differences(struct pt_builder *builder, uint32_t i, const struct pt_range *range, struct pt_ref chunks)
{
    const struct pt_plan *plan = builder->plan;
    const struct patina_scans *scans = plan->instances[i].instance->style.scans;
    struct differ_args args = {.view = range->cells,
                               .gamma = range->gamma,
                               .gamma_cells = range->gamma_cells,
                               .sifted = plan->drawn_words > 0,
                               .start = 1};
    for (; args.first < PT_DIFFER_MOST && args.first <= scans->greatest; args.first += PT_DIFFER_SCANS, args.start = 0)
        PT_REASON(
            PT_ADD(builder, differ, args,
                   {pt_plane_at(PT_PLANE_CELLS, 0), pt_plane_at(PT_PLANE_CELL_INCLINED, 0), pt_plane_at(PT_PLANE_CELL_LEAST, 0),
                    pt_plane_at(PT_PLANE_CELL_MOST, 0), chunks, pt_buffer_of(PT_POSITIONS, i), pt_buffer_of(PT_SURFELS, i),
                    pt_buffer_of(PT_SCANS, i), plan->drawn_words ? pt_buffer_of(PT_DRAWN, 0) : pt_nothing()}),
            "how far scans of instance %u lie apart: %u to %u", i, args.first, args.first + PT_DIFFER_SCANS - 1);
}

// pass: PT_RANGE_*.
static void add_faces(struct pt_builder *builder, uint32_t i, const struct pt_range *range, struct pt_ref chunks, uint32_t pass,
                      int behind)
{
    static const char *const told[] = {"", ", marked where they are not sharp", ", where those before were not sharp",
                                       ", where those before were not sharp, marked too"};
    const struct pt_plan *plan = builder->plan;
    const struct pt_plan_instance *instance = &plan->instances[i];
    const struct incline_args incline = {.view = range->cells, .gamma = range->gamma, .gamma_cells = range->gamma_cells};
    PT_REASON(PT_ADD(builder, incline, incline, {pt_plane_at(PT_PLANE_CELL_PLACE, 0), pt_plane_at(PT_PLANE_CELL_INCLINED, 0)}),
              "normals of instance %u's cells, from those around", i);
    const int apart = differs(builder, instance);
    if (apart)
        add_differences(builder, i, range, chunks);
    const struct magnify_args magnify = {.view = pt_view_of(plan, instance, 0),
                                         .cells = range->cells,
                                         .gamma = range->gamma,
                                         .gamma_cells = range->gamma_cells,
                                         .pixel = range->pixel,
                                         .inverse = 1.0f / range->pixel,
                                         .d_min = instance->args.d_min,
                                         .behind = (uint32_t)behind,
                                         .with_span = plan->sigmas != 0,
                                         .pass = pass,
                                         .id_base = instance->args.id_base,
                                         .id_first = instance->args.id_first,
                                         .id_count = instance->args.id_count,
                                         .most = range->most,
                                         .cosine = GRAZED,
                                         .with_apart = (uint32_t)apart};
    PT_REASON(PT_ADD(builder, magnify, magnify,
                     {pt_plane_at(PT_PLANE_CELLS, 0), pt_plane_at(PT_PLANE_CELL_PLACE, 0), pt_plane_at(PT_PLANE_CELL_MERGED, 0),
                      pt_plane_at(PT_PLANE_CELL_INCLINED, 0), pt_keys_of(builder, 0), pt_from_of(builder, 0),
                      pt_plane_at(PT_PLANE_NORMAL, 0), pt_plane_at(PT_PLANE_DEFF, 0), pt_plane_at(PT_PLANE_ALBEDO, 0),
                      pt_plane_at(PT_PLANE_AWAY, 0), pt_plane_if(plan->sigmas, PT_PLANE_SPAN, 0),
                      pt_plane_if(behind, PT_PLANE_LIMIT, 0), pt_plane_if(apart, PT_PLANE_CELL_LEAST, 0),
                      pt_plane_if(apart, PT_PLANE_CELL_MOST, 0), pt_plane_if(apart, PT_PLANE_APART, 0)}),
              "faces between instance %u's cells%s%s", i, told[pass], behind ? ", behind what is drawn already" : "");
}

const struct pt_range *pt_range_of(const struct pt_plan_instance *instance, uint32_t level)
{
    const struct pt_range *range = instance->as.range;
    for (; level; level--)
        range = range->fine;
    return range;
}

static void add_range(struct pt_builder *builder, uint32_t i, int behind)
{
    const struct pt_range *range = builder->plan->instances[i].as.range;
    struct pt_ref chunks = pt_buffer_of(PT_CHUNKS, i);
    uint32_t pass = PT_RANGE_ALONE;
    for (enum pt_instance_buffer next = PT_FINE_CHUNKS; range; range = range->fine, chunks = pt_buffer_of(next++, i)) {
        const int finer = range->fine && range->fine->chunk_count;
        add_cells(builder, i, range, chunks, behind);
        add_faces(builder, i, range, chunks, pass | (finer ? PT_RANGE_COARSE : 0), behind);
        if (!finer)
            return;
        pass = PT_RANGE_FINE;
    }
}

void pt_plan_reveal(struct pt_builder *builder)
{
    struct pt_plan *plan = builder->plan;
    struct reveal_args args = {
        .view = plan->view, .crop_x = plan->crop[0], .crop_y = plan->crop[1], .crop_width = plan->crop[2], .first = 1};
    args.view.rect[0] = plan->crop[0];
    args.view.rect[1] = plan->crop[1];
    args.view.rect[2] = plan->crop[0] + plan->crop[2];
    args.view.rect[3] = plan->crop[1] + plan->crop[3];
    for (uint32_t i = 0; i < plan->instance_count; i++) {
        const struct pt_plan_instance *instance = &plan->instances[i];
        if (!pt_draws(instance, PT_AS_RANGES) || !differs(builder, instance))
            continue;
        args.instance = instance->args;
        PT_REASON(PT_ADD(builder, reveal, args,
                         {pt_plane_at(PT_PLANE_KEYS, 0), pt_plane_at(PT_PLANE_FROM, 0), pt_plane_at(PT_PLANE_APART, 0),
                          pt_plane_at(PT_PLANE_DISAGREEMENT, 0)}),
                  "how far scans of instance %u lie apart is asked for", i);
        args.first = 0;
        plan->assessed |= 1u << PATINA_PASS_DISAGREEMENT;
    }
    if (args.first)
        pt_skip(builder, "reveal", "no pass asks how far scans lie apart, or no cloud in view knows its scans");
}

void pt_plan_ranges(struct pt_builder *builder)
{
    const struct pt_plan *plan = builder->plan;
    if (!plan->ranges.cells) {
        static const char *const names[] = {"coarsen", "merge", "incline", "magnify"};
        for (int k = 0; k < 4; k++)
            pt_skip(builder, names[k], "no cloud in view is drawn as range images");
    }
    int apart = 0;
    for (uint32_t i = 0; i < plan->instance_count; i++)
        apart |= pt_draws(&plan->instances[i], PT_AS_RANGES) && differs(builder, &plan->instances[i]);
    if (!apart)
        pt_skip(builder, "differ", "no pass asks how far scans lie apart, or no cloud in view knows its scans");
    for (uint32_t i = 0; i < plan->instance_count; i++)
        if (pt_draws(&plan->instances[i], PT_AS_RANGES))
            add_range(builder, i, builder->layer > 1 || builder->behind);
}
