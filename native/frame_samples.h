// SPDX-License-Identifier: GPL-3.0-or-later
// Pictures that are the mean of several.
#ifndef PT_FRAME_SAMPLES_H
#define PT_FRAME_SAMPLES_H

#include "frame.h"
#include "plan.h"

// How settings.pixel_samples are taken: pictures of grid x grid finer pixels, as many of them as there are shifts.
struct pt_sampling {
    uint32_t grid, shifts;
    int hard; // without anti-aliasing: a triangle covers a pixel's centre or does not, and the mean is what it covers
};

// plan: of the scene without samples. It says the same of a region as of the whole.
struct pt_sampling pt_choose_sampling(const struct patina_scene *scene, const struct pt_plan *plan);
// Where picture i looks: pixels of its own, each within -0.5 to 0.5; all of them make 0.
void pt_sample_shift(const struct pt_sampling *sampling, uint32_t i, double shift[2]);
// The scene as a picture of `sampling` sees it, of rows [first, end) of the region only. out: a copy of the scene, whose handle
// is not touched.
void pt_finer_scene(const struct patina_scene *scene, const struct pt_sampling *sampling, const double shift[2], uint32_t first,
                    uint32_t end, struct patina_scene *out);

// The picture with its samples: the colour is their mean, all else is that of the picture without. On an error the last good
// one stays.
int pt_frame_sample(struct patina_frame *frame, const struct patina_scene *scene);

#endif
