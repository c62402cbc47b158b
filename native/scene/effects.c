// SPDX-License-Identifier: GPL-3.0-or-later
// A scene's effects: checked, defaults made explicit.
#include "scene.h"
#include "base/descriptor.h"

static int within(float value, float least, float most)
{
    return value >= least && value <= most;
} // NaN is not

static int refuse(const patina_scene *scene, const char *what)
{
    return pt_fail(&scene->handle, PATINA_ERROR_ARGUMENT, "effects: %s", what);
}

static int colored(const float color[3])
{
    return within(color[0], 0.0f, 65504.0f) && within(color[1], 0.0f, 65504.0f) && within(color[2], 0.0f, 65504.0f);
}

static int check_drawing(const patina_scene *scene, patina_effects *e)
{
    e->hatch_spacing = e->hatch_spacing == 0.0f ? 6.0f : e->hatch_spacing;
    e->hatch_opacity = e->hatch_opacity == 0.0f ? 1.0f : e->hatch_opacity;
    if (e->hatch_levels > 3 || !within(e->hatch_spacing, 3.0f, 1000.0f))
        return refuse(scene, "hatch_levels must be within 0 and 3, hatch_spacing at least 3 pixels, or 0");
    if (!within(e->hatch_opacity, 0.0f, 1.0f) || !within(e->hatch_ground, 0.0f, 1.0f))
        return refuse(scene, "hatch_opacity and hatch_ground must be within 0 and 1");
    if (!within(e->fog_density, 0.0f, 1.0f) || e->fog_fixed > 1)
        return refuse(scene, "fog_density must be within 0 and 1, fog_fixed 0 or 1");
    if (e->fog_density > 0.0f &&
        !(within(e->fog_start, -1e30f, 1e30f) && within(e->fog_end, -1e30f, 1e30f) && e->fog_end > e->fog_start))
        return refuse(scene, "fog_end must be beyond fog_start");
    if (!within(e->focus_aperture, 0.0f, 1e30f) ||
        (e->focus_aperture > 0.0f && !within(e->focus_distance, 1e-30f, 1e30f)))
        return refuse(scene, "focus_aperture must be 0 or more, focus_distance above 0");
    if (e->exact > 1)
        return refuse(scene, "exact is 0 or 1");
    if (!e->exact && e->paper_color[0] == 0.0f && e->paper_color[1] == 0.0f && e->paper_color[2] == 0.0f)
        e->paper_color[0] = e->paper_color[1] = e->paper_color[2] = 1.0f;
    if (!within(e->paper_grain, 0.0f, 1.0f))
        return refuse(scene, "paper_grain must be within 0 and 1");
    if (!colored(e->hatch_color) || !colored(e->fog_color) || !colored(e->paper_color))
        return refuse(scene, "colours must be within 0 and 65504");
    return PATINA_OK;
}

static int check(const patina_scene *scene, patina_effects *e)
{
    if (!within(e->edl_strength, 0.0f, 10.0f))
        return refuse(scene, "edl_strength must be within 0 and 10");
    e->edl_radius = e->edl_radius == 0.0f ? 1.4f : e->edl_radius;
    if (!within(e->edl_radius, 1.0f, 16.0f))
        return refuse(scene, "edl_radius must be within 1 and 16 pixels, or 0");
    if (!within(e->obscurance_strength, 0.0f, 10.0f))
        return refuse(scene, "obscurance_strength must be within 0 and 10");
    if (!within(e->obscurance_radius, 0.0f, 1e30f))
        return refuse(scene, "obscurance_radius must be 0 or more");
    if (e->toon_bands == 1 || e->toon_bands > 16 || !within(e->toon_softness, 0.0f, 1.0f))
        return refuse(scene, "toon_bands must be 0 or within 2 and 16, toon_softness within 0 and 1");
    return check_drawing(scene, e);
}

int patina_scene_set_effects(patina_scene *scene, const patina_effects *effects)
{
    patina_effects checked;
    if (!scene)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_scene_set_effects: scene is NULL");
    int error = pt_take(&scene->handle, "patina_scene_set_effects", effects, &checked, sizeof checked);
    error = error ? error : check(scene, &checked);
    if (!error)
        scene->effects = checked;
    return error;
}
