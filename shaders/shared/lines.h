// SPDX-License-Identifier: GPL-3.0-or-later
// Stage lines: SPEC 7.
#ifndef PT_SHARED_LINES_H
#define PT_SHARED_LINES_H

#include "shared/view.h"

// Lines are at most so many pixels wide; pixels nearer than that and a half.
#define PT_LINE_MOST 16
#define PT_LINE_TAPS 864
#define PT_LINE_SUPPORT 2
#define PT_LINE_WITHIN 0.484375f // without anti-aliasing: a pixel whose middle lies within r + 1/64 takes a line

// lines: what enlarged discs would leave uncovered. [X 3], SPEC 7: dilated depth + offset < own depth.
//   1. A pixel's disc has the radius r = width (world: min(width / footprint(z), most)) and lies the offset behind its pixel,
//      along the ray: at v = z + (offset / max(|n.v|, C), or d_eff where offset is 0).
//   2. It shows at the pixel p, d pixels from its middle, where v < z_p and v lies before the tangent plane of p's surface.
//      Only pixels whose discs show at k > 0 of their own four cross neighbours have one: a step in depth, and not a slope that
//      a wide disc crosses. So a smooth surface shows no lines, however oblique or bent. Strays do not count: of the 8 pixels
//      around the far neighbour PT_LINE_SUPPORT lie beyond v as well, and of those around the pixel as many have steps, too.
//   3. A pixel takes the disc whose edge is farthest beyond it, r + 1/2 - d at the greatest; of equal ones the first in `taps`.
//      Its share: r + 1/2 - d over max(1, soft (r + 1/2)), at most 1. Without anti-aliasing, before that, r + 1/2 - d
//      >= PT_LINE_WITHIN gives as much as makes that 1, and others nothing.
//   4. With anti-aliasing, a pixel with a disc is covered by its own surface as far as antialias says of k; the rest of it, at most
//      r, is the line's, unless 3. gives more.
// Behind a layer, what lies before its limit is nothing, and empty pixels take lines only where the layers before cover them
// and let light through: else the first layer's line is there already, or nobody sees it. And lines belong to surfaces farther than
// the offset behind the limit of the pixel, z - (v - z) > limit: nearer ones end there because they touch the layer before.
struct lines_args {
    struct view_args view; // rect: the points', wider by the line's reach. Beyond it nothing is known: no discs, no edges
    float width;           // pixels, or world units
    uint32_t world;        // 1: width is in world units
    float most;            // radius of the widest disc, pixels
    float offset;          // world units; 0: d_eff
    float soft;            // share of the width over which a line fades, 0..1
    uint32_t antialias;
    uint32_t behind;       // 1: the limit and through planes hold
    uint32_t reach;        // of the taps, whole pixels
    uint32_t tap_count;
    uint32_t taps[PT_LINE_TAPS]; // pixels with d < most + 1/2, by d, then y, then x: x + 128 | y + 128 << 8 | d^2 << 16
};

#endif
