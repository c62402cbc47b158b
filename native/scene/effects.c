// SPDX-License-Identifier: GPL-3.0-or-later
// A scene's effects: checked, defaults made explicit.
#include "scene.h"

static int within(float value, float least, float most) { return value >= least && value <= most; } // NaN is not

static int refuse(const patina_scene *scene, const char *what)
{
    return pt_fail(&scene->handle, PATINA_ERROR_ARGUMENT, "effects: %s", what);
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
    return PATINA_OK;
}

int patina_scene_set_effects(patina_scene *scene, const patina_effects *effects)
{
    if (!scene || (effects && effects->struct_size != sizeof *effects))
        return pt_fail(scene ? &scene->handle : NULL, PATINA_ERROR_ARGUMENT,
                       "patina_scene_set_effects: scene is NULL or effects->struct_size is wrong");
    patina_effects checked = {.struct_size = sizeof checked};
    if (effects)
        checked = *effects;
    int error = check(scene, &checked);
    if (!error)
        scene->effects = checked;
    return error;
}
