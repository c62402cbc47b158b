// SPDX-License-Identifier: GPL-3.0-or-later
// Levels, iterations, layers, and the window of pixels that the planes hold: from the spacings on screen and the settings.
#include "plan.h"

#include "expected.h"
#include "lines.h"
#include "ranges.h"
#include "shared/filling.h"
#include "shared/means.h"
#include "shared/measured.h"

#include <math.h>

enum { DEFAULT_LAYERS = 8 };
// Coarse levels at most where points that lie wide apart are discs: these have closed what is wider. On four virtual scans more
// fill sky (34.6 % in place of 22.2) and show nothing truer; one loses 0.5 dB.
enum { LEVELS_BESIDE_DISCS = 2 }; // of the caller's pixels

// Spacing on screen, pixels, from which on coarser levels help to fill. In maps of lights in perspective, which take two
// iterations, 1.6% of an umbra stays lit at 1.65, where nothing does at 1.2; a sun at 2 degrees gets acne at 1.2.
static const double WIDEST = 1.65, WIDEST_OF_LAMPS = 1.2;

// Whether holes are closed by what an analysis found. Not where points are filled as in the papers, nor with an error target, whose
// curves are those of spacings alone.
static int closes_by_analysis(const patina_settings *settings)
{
    return settings->surface == PATINA_SURFACE_AUTO && settings->fill == PATINA_FILL_CLOSED && !(settings->error_target > 0.0f);
}

int pt_knows_discs(const struct patina_scene *scene, const struct pt_plan *plan, const struct pt_instance *instance)
{
    if (pt_draws_ranges(scene, plan, instance))
        return 0;
    return scene->settings.surface == PATINA_SURFACE_SPLATS ||
           (instance->cloud->shapes && closes_by_analysis(&scene->settings) && !plan->ids.filled);
}

int pt_knows_reach(const struct patina_scene *scene, const struct pt_plan *plan)
{
    int known = scene->settings.surface == PATINA_SURFACE_AUTO;
    for (uint32_t i = 0; i < scene->cloud_count; i++)
        known = known && (pt_all_soft(&scene->instances[i]) || pt_knows_discs(scene, plan, &scene->instances[i]));
    return known;
}

int pt_knows_sigmas(const struct patina_scene *scene)
{
    int known = 0;
    for (uint32_t i = 0; i < scene->cloud_count; i++)
        known |= !pt_all_soft(&scene->instances[i]) && scene->instances[i].cloud->shapes && scene->instances[i].cloud->beside;
    return known && (scene->settings.surface == PATINA_SURFACE_SPLATS || closes_by_analysis(&scene->settings));
}

// How many levels and iterations the spacing asks for. With s = spacing in pixels a pixel stays empty with probability
// exp(-1/s^2); n iterations close holes n wide from all sides. Above 1.65 (0.37 points a pixel) n alone leaves holes open
// (2.7% of a disc at 0.3 points a pixel), so coarser levels halve s down to 1 first: 0.14% open. Starting them earlier,
// at 1.35, lets steep planes grow by up to 0.5% at 1 point a pixel. From 1.5 on n is 6: 4 leave 0.13% of a sphere open, and
// 0.32% of a disc of 0.5 points a pixel. Below it stays at 4: at 6 the fourth layer of three tori loses 0.14% of its pixels in
// place of 0.06%.
void pt_choose_filling(const struct patina_scene *scene, struct pt_plan *plan)
{
    const patina_settings *settings = &scene->settings;
    const int most = plan->discs.count ? LEVELS_BESIDE_DISCS + ilogb((double)pt_finer(scene)) : PT_LEVELS - 1;
    uint32_t asked = settings->error_target > 0.0f ? 0 : settings->fill_iterations;
    double s = plan->spacing_px;
    plan->quality = settings->quality;
    plan->fill = settings->fill;
    plan->levels = plan->iterations = 0;
    if (settings->surface == PATINA_SURFACE_SPLATS || (plan->ranges.reach && !plan->filled && !plan->discs.count)) {
        plan->means = settings->surface == PATINA_SURFACE_SPLATS ? PT_MEANS_SPLATS : PT_MEANS_RANGES;
        plan->expected = pt_expected_error(plan->means, s);
        return;
    }
    if (settings->error_target > 0.0f)
        pt_means_settings(pt_means_for((double)settings->error_target, s), &plan->quality, &plan->fill);
    plan->means = pt_means_of(plan->quality, plan->fill);
    plan->expected = pt_expected_error(plan->means, s);
    if (plan->fill == PATINA_FILL_PAPER)
        plan->iterations = asked ? asked : 1;
    if (plan->fill != PATINA_FILL_CLOSED)
        return;
    const double widest = plan->map && !scene->camera.orthographic ? WIDEST_OF_LAMPS : WIDEST;
    for (; s > widest || (plan->levels && s > 1.0); s *= 0.5)
        if (++plan->levels >= (uint32_t)(most < PT_LEVELS ? most : PT_LEVELS - 1))
            break;
    plan->iterations = asked ? asked : s < 0.4 ? 1 : s < 0.65 ? 2 : s < 0.8 ? 3 : plan->levels || s < 1.5 ? 4 : 6;
}

// An opaque scene has one layer, unless all are asked for as passes.
void pt_choose_layers(const patina_settings *settings, struct pt_plan *plan)
{
    uint32_t wanted = settings->layers ? settings->layers : DEFAULT_LAYERS;
    plan->layers = plan->transparent || settings->layer_passes ? wanted : 1;
}

// How far, in pixels, anything can carry influence: fills and un-fills of both phases, of background twice as far (is
// what lies beside alone?), and the push at every level, the
// window of estimated normals, the blend of normals, smoothing, anti-aliasing and lines. Every layer starts from the filled
// depth of the one before, and so does what is drawn again. Behind the last, averages take from points in the pixels around.
static uint32_t reach_of(const struct pt_plan *plan, const patina_settings *settings)
{
    uint32_t layer = PT_REACH_normals;
    for (uint32_t level = 0; level <= plan->levels; level++)
        layer += (5 * plan->iterations * PT_REACH_fill + PT_REACH_push) << level;
    layer += 2 * plan->ranges.reach; // a face's corners have their normals from cells around
    return (plan->reopens ? plan->reopens : plan->layers) * layer + (settings->average ? PT_REACH_average : 0) +
           PT_REACH_shade + PT_REACH_smooth + PT_REACH_antialias + pt_line_reach(plan);
}

void pt_choose_window(const struct patina_scene *scene, struct pt_plan *plan, uint32_t guard)
{
    const uint32_t *region = scene->settings.region, cell = 1u << plan->levels;
    const uint32_t full[2] = {scene->settings.width + 2 * guard, scene->settings.height + 2 * guard};
    uint32_t reach = reach_of(plan, &scene->settings) + pt_effects_reach(scene), origin[2], size[2];
    for (int k = 0; k < 2; k++) {
        uint32_t first = region[k] + guard, last = region[2 + k] + guard;
        int whole = region[k] == 0 && last + guard == full[k];
        origin[k] = whole || first < reach ? 0 : (first - reach) / cell * cell;
        uint32_t end = pt_round_up(last + reach, cell);
        size[k] = (whole || end > full[k] ? full[k] : end) - origin[k];
        plan->crop[k] = first - origin[k];
        plan->crop[2 + k] = last - first;
        plan->pixel_offset[k] = region[k];
    }
    plan->view.origin_x = (int32_t)origin[0];
    plan->view.origin_y = (int32_t)origin[1];
    plan->view.width = size[0];
    plan->view.height = size[1];
}
