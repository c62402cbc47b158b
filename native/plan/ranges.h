// SPDX-License-Identifier: GPL-3.0-or-later
// Clouds that are drawn as range images [K], SPEC 6: their image buffers.
#ifndef PT_PLAN_RANGES_H
#define PT_PLAN_RANGES_H

#include "eye.h"
#include "plan.h"

// The image buffer of an instance, whose pixels are cells.
struct pt_range {
    struct view_args cells; // rect: those that its points may fall into
    struct pt_eye eye;      // whose pixels the cells are
    float pixel;            // of a cell: pixels of the picture
    float gamma, gamma_cells;
    float points;              // that a cell holds of a surface seen from the front
    struct pt_range *fine;     // of two passes: the finer cells, and
    struct chunk_view *chunks; // what of the instance's chunks they are to them; NULL: of the instance
};

// Whether the instance is. Not where 32 bits hold no ids for it: it is filled then.
int pt_draws_ranges(const struct patina_scene *scene, const struct pt_instance *instance);
// The side of its cells, from the spacing of its points on screen: pixels.
double pt_range_pixel(const struct patina_scene *scene, const struct pt_instance *instance, double spacing_px);
// How far from a point its faces go, pixels.
uint32_t pt_range_reach(double pixel);
// Once plan->view is chosen. eye: of the padded picture; scale: of the object.
void pt_range_place(const struct patina_scene *scene, struct pt_plan *plan, const struct pt_instance *instance,
                    const struct pt_eye *eye, double scale, double pixel, double spacing_px, struct pt_range *out);
// The cells of what lies in bounds, in pixels of a picture padded by `pad` less.
void pt_range_rect(const struct pt_range *range, const double bounds[4], uint32_t pad, uint32_t rect[4]);

#endif
