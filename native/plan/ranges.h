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
    float most;            // points of a cell, beyond which finer ones take its place
    struct pt_range *fine; // the next finer cells, or NULL
    // Of finer cells: those of the instance's chunks whose points lie no farther apart on screen than `widest`, as they see them.
    double widest;
    struct chunk_view *chunks;
    uint32_t chunk_count;
};

// Of the covered area so much has points that lie closer on screen.
struct pt_spread {
    double least, middle, most; // pixels at 1, 50 and 95 %
};

// Of an instance that is drawn as them: 0: all its chunks; from 1 on finer and finer cells.
const struct pt_range *pt_range_of(const struct pt_plan_instance *instance, uint32_t level);
// Whether the instance is. Not where 32 bits hold no ids for it: it is filled then.
int pt_draws_ranges(const struct patina_scene *scene, const struct pt_plan *plan, const struct pt_instance *instance);
// The side of its cells, from the spacing of its points on screen, and of finer ones that take their place: pixels. Returns how many
// there are, 1 to PT_RANGE_FINER + 1.
uint32_t pt_range_pixels(const struct patina_scene *scene, const struct pt_instance *instance, const struct pt_spread *spread,
                         double pixels[PT_RANGE_FINER + 1]);
// How far from a point its faces go, pixels.
uint32_t pt_range_reach(double pixel);
// Once plan->view is chosen: `count` image buffers, each finer than the one before. eye: of the padded picture; scale: of the object.
void pt_range_place(const struct patina_scene *scene, struct pt_plan *plan, const struct pt_instance *instance,
                    const struct pt_eye *eye, double scale, const double *pixels, uint32_t count,
                    const struct pt_spread *spread, struct pt_range *out);
// The cells of what lies in bounds, in pixels of a picture padded by `pad` less.
void pt_range_rect(const struct pt_range *range, const double bounds[4], uint32_t pad, uint32_t rect[4]);

#endif
