// SPDX-License-Identifier: GPL-3.0-or-later
// The values at the ends of a ramp, which pictures take.
#ifndef PT_RAMP_SPAN_H
#define PT_RAMP_SPAN_H

#include "scene/scene.h"

struct span {
    double least, most;
};

// Of the style's ramp_range, or what stands for it where it is automatic; least > most: of a cloud without points. The camera decides on
// automatic distances.
struct span pt_ramp_span(const struct patina_scene *scene, const struct pt_instance *instance);

#endif
