// SPDX-License-Identifier: GPL-3.0-or-later
// A scene's effects: checked by the table of effects, defaults made explicit.
#include "scene.h"
#include "base/descriptor.h"

#include <stdio.h>

static int within(float value, float least, float most) { return value >= least && value <= most; } // NaN is not

static int refuse(const patina_scene *scene, const char *what)
{
    return pt_fail(&scene->handle, PATINA_ERROR_ARGUMENT, "effects: %s", what);
}

static int out_of_range(const patina_scene *scene, const char *field, double least, double most, double zero)
{
    char what[160], or_zero[32] = "";
    if (least > 0.0)
        snprintf(or_zero, sizeof or_zero, zero != 0.0 ? ", or 0 for %g" : ", or 0", zero);
    snprintf(what, sizeof what, "%s must be within %g and %g%s", field, least, most, or_zero);
    return refuse(scene, what);
}

static int all_within(const float v[3], float least, float most)
{
    return within(v[0], least, most) && within(v[1], least, most) && within(v[2], least, most);
}

// A table row each, in the order of the struct.
static int check(const patina_scene *scene, patina_effects *e)
{
#define PATINA_EFFECT_NUMBER(field, when, least, most, zero, ...)                                                              \
    if (e->field == 0.0f)                                                                                                      \
        e->field = zero;                                                                                                       \
    else if (!within(e->field, least, most))                                                                                   \
        return out_of_range(scene, #field, (double)(least), (double)(most), (double)(zero));
#define PATINA_EFFECT_COUNT(field, when, least, most, zero, ...)                                                               \
    if (e->field == 0)                                                                                                         \
        e->field = zero;                                                                                                       \
    else if (e->field < least || e->field > most)                                                                              \
        return out_of_range(scene, #field, least, most, zero);
#define PATINA_EFFECT_COLOR(field, when, zero, ...)                                                                            \
    if (!all_within(e->field, 0.0f, 65504.0f))                                                                                 \
        return out_of_range(scene, #field, 0.0, 65504.0, zero);                                                                \
    if (!e->exact && pt_is_zero(e->field))                                                                                     \
        e->field[0] = e->field[1] = e->field[2] = zero;
#define PATINA_EFFECT_AXIS(field, ...)                                                                                         \
    if (!all_within(e->field, -1e15f, 1e15f))                                                                                  \
        return out_of_range(scene, #field, -1e15, 1e15, 0.0);                                                                  \
    if (pt_is_zero(e->field))                                                                                                  \
        e->field[2] = 1.0f;
#define PATINA_EFFECT_SWITCH(field, ...)                                                                                       \
    if (e->field > 1)                                                                                                          \
        return refuse(scene, #field " must be 0 or 1");
#define PATINA_EFFECT_CHOICE(field, when, count, ...)                                                                          \
    if (e->field >= count)                                                                                                     \
        return refuse(scene, #field " is none of its choices");
#define PATINA_EFFECT_RULE(while_, holds, message)                                                                             \
    if ((while_) && !(holds))                                                                                                  \
        return refuse(scene, message);
#include "patina/effects.def"
    return e->exact > 1 ? refuse(scene, "exact must be 0 or 1") : PATINA_OK;
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

uint32_t pt_effects_grid(const patina_effects *e, uint32_t most)
{
#define PATINA_EFFECT_GRID(while_, most_)                                                                                      \
    if (while_)                                                                                                                \
        most = most < (uint32_t)(most_) ? most : (uint32_t)(most_);
#include "patina/effects.def"
    return most;
}

void pt_effects_scale(patina_effects *e, float factor)
{
#define PT_SCALE_NONE(field)
#define PT_SCALE_SHARE(field)
#define PT_SCALE_LENGTH(field)
#define PT_SCALE_HEIGHT(field)
#define PT_SCALE_PIXELS(field) e->field *= factor;
#define PATINA_EFFECT_NUMBER(field, when, least, most, zero, unit, ...) PT_SCALE_##unit(field)
#include "patina/effects.def"
}
