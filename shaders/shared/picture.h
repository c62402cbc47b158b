// SPDX-License-Identifier: GPL-3.0-or-later
// Stage picture: on the composed picture, and beside it.
#ifndef PT_SHARED_PICTURE_H
#define PT_SHARED_PICTURE_H

#include "shared/words.h"

#define PT_FOCUS_MOST 32            // largest circle of confusion, radius in pixels
#define PT_FOCUS_SHARP 0.56418958f  // a circle of a pixel's area
#define PT_FOCUS_DENSITY 0.31830989f // 1 / pi: light of a circle of radius 1, a pixel

// focus: depth of field of a thin lens, over the background, into the crop. A pixel's circle of confusion has the radius
// c = min(scale |1 - distance / z|, most), in orthographic views min(scale |z - distance|, most); empty pixels lie
// infinitely far. Of a pixel p, every q within reach at r pixels gives its colour with the weight clamp(c - r + 1/2, 0, 1) /
// max(pi c^2, 1). Those before p (z_q < z_p) cover it by their weights' sum N, at most wholly; the others, p too, with
// min(c_q, c_p) for c, are what is seen between: their mean times 1 - min(N, 1).
struct focus_args {
    struct view_args view;
    uint32_t crop_x, crop_y, crop_width, crop_height; // in the planes
    float background[4]; // premultiplied
    float distance, scale, most;
    uint32_t reach; // pixels, at most PT_FOCUS_MOST
};

// paper: the picture times color (1 - grain noise), the noise of the pixel's place in the full picture.
struct paper_args {
    struct view_args view;
    uint32_t crop_x, crop_y, crop_width, crop_height;
    uint32_t x, y; // of the crop in the full picture
    float color[3];
    float grain;
};


// assess: what is known of the point whose surface a pixel shows: its trust, 0..1, and its thickness, world units. 0 where
// nothing is known, or nothing is. Visits view.rect, which lies within the crop.
struct assess_args {
    struct view_args view;
    struct instance_args instance;
    uint32_t crop_x, crop_y, crop_width;
    uint32_t first;                // 1: pixels that the instance does not show become 0; else they stay
    uint32_t trust, thickness; // either may be left out
    float sigma_scale;             // times instance.spacing of its class: a thickness
};

// reveal: what the apart plane says of the instance's pixels, or of the pixel whose surface they show; 0 elsewhere.
struct reveal_args {
    struct view_args view;
    struct instance_args instance;
    uint32_t crop_x, crop_y, crop_width;
    uint32_t first; // as in assess_args
};

// ink: lines get their colour, over a picture or behind what a sum of layers holds; where a line covers half a pixel or more, z
// becomes that of its surface.
struct ink_args {
    struct view_args view; // rect: of the line plane
    struct instance_args instance; // whose points' lines; with a colour of the points' own, its colours
    uint32_t crop_x, crop_y, crop_width, crop_height; // of the pictures in the planes
    uint32_t source;       // patina_line_source
    float color[3];        // POINT: times the point's own
    float far_color[3];    // DEPTH: at start + 1 / scale and beyond
    float start, scale;    // DEPTH
    float opacity;
    uint32_t behind;       // 1: colours go behind what the target holds
    uint32_t blank;        // 1: surfaces are not shown: the background takes their place first
    uint32_t color_target, depth, mask; // which of the three are written
    float background[4];   // premultiplied
};

#endif
