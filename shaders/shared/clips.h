// SPDX-License-Identifier: GPL-3.0-or-later
// Clips, as sift and tint test places against them.
#ifndef PT_SHARED_CLIPS_H
#define PT_SHARED_CLIPS_H

#include "shared/view.h"

// Shapes of clip_view.
#define PT_CLIP_KEEP 0u  // a box: only what lies in it, or in another such box, is drawn
#define PT_CLIP_CUT 1u   // a box: what lies in it is not
#define PT_CLIP_PLANE 2u // what has q.z > 0 is not

// A clip in a chunk's coordinates, or (tint) in view space: q = (lo + R p) + hi in this order. In a box every |q| <= 1.
// Planes: q.z is in world units, the rest is 0.
struct clip_view {
    float row[9];
    float hi[3], lo[3];
    uint32_t shape;
    float half_size[3]; // tint: of a box, world units
    float tint[3], strength, width;
};

#endif
