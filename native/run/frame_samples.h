// SPDX-License-Identifier: GPL-3.0-or-later
// Pictures that are the mean of several: how they are chosen (frame_samples.c), drawn and added up (frame_mean.c).
#ifndef PT_FRAME_SAMPLES_H
#define PT_FRAME_SAMPLES_H

#include "frame.h"
#include "plan/plan.h"

enum { PT_NOISE_SHIFTS = 4 }; // from so many pictures on their noise is told well enough to end them

// How settings.pixel_samples are taken: pictures of grid x grid finer pixels, as many of them as there are shifts.
struct pt_sampling {
    uint32_t grid, shifts;
    int hard; // without anti-aliasing: a triangle covers a pixel's centre or does not, and the mean is what it covers
};

// plan: of the scene without samples. It says the same of a region as of the whole.
struct pt_sampling pt_choose_sampling(const struct patina_scene *scene, const struct pt_plan *plan);
// Where picture i looks: pixels of its own, each within -0.5 to 0.5. They come in pairs on either side of the middle, for odd numbers
// after the middle itself: all of them make 0, the first so many pairs too, and lie evenly.
void pt_sample_shift(const struct pt_sampling *sampling, uint32_t i, double shift[2]);
// Which half of the pictures, 0 or 1, picture i counts for: each lies as evenly as both, so that they tell the noise.
uint32_t pt_sample_half(const struct pt_sampling *sampling, uint32_t i);
// The scene as a picture of `sampling` sees it, of rows [first, end) of the region only. out: a copy of the scene, whose handle
// is not touched.
void pt_finer_scene(const struct patina_scene *scene, const struct pt_sampling *sampling, const double shift[2], uint32_t first,
                    uint32_t end, struct patina_scene *out);

// The picture with its samples, or the first of them: the colour is their mean, all else is that of the picture without. On an error
// the last good one stays.
int pt_frame_sample(struct patina_frame *frame, const struct patina_scene *scene);
// A step more of them, and further ones until ms have passed. What is reached stays, on errors too.
int pt_frame_refine(struct patina_frame *frame, const struct patina_scene *scene, double ms);
void pt_mean_destroy(struct patina_frame *frame); // none: fine

#endif
