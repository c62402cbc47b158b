// SPDX-License-Identifier: GPL-3.0-or-later
// What the ends of a cloud's ramp stand for: legends write it.
#include "plan/ramp_span.h"

#include <math.h>

int patina_scene_ramp_range(const patina_scene *scene, uint32_t number, double range[2])
{
    uint32_t first;
    if (!scene || !range || !pt_scene_parts(scene, number, &first))
        return pt_fail(scene ? &scene->handle : NULL, PATINA_ERROR_ARGUMENT,
                       "patina_scene_ramp_range: scene or range is NULL, or no such instance");
    const struct pt_instance *instance = &scene->instances[first];
    if (instance->style.color_source == PATINA_COLOR_DISTANCE && !scene->has_camera)
        return pt_fail(&scene->handle, PATINA_ERROR_ARGUMENT, "patina_scene_ramp_range: the scene has no camera");
    const struct span span = pt_ramp_span(scene, instance);
    if (!isfinite(span.least) || !isfinite(span.most))
        return pt_fail(&scene->handle, PATINA_ERROR_EMPTY, "patina_scene_ramp_range: the cloud has no points");
    range[0] = span.least;
    range[1] = span.most;
    return PATINA_OK;
}
