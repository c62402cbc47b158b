// SPDX-License-Identifier: GPL-3.0-or-later
// Stage ranges: range images [K], SPEC 6.
#ifndef PT_SHARED_RANGES_H
#define PT_SHARED_RANGES_H

#include "shared/discs.h"

// Range images. A cell of the image buffer is `pixel` pixels of the picture wide: that of a place (X, Y) is (floor(X / pixel),
// floor(Y / pixel)), in whose view's pixels a chunk's points are projected. Its footprint is that of its view.
// What lies no farther than gamma behind another is one surface with it: max(gamma, gamma_cells footprint(z)), z of the nearer.
// Neighbouring cells are joined where z differs by at most max(that, PT_RANGE_STEEP footprint(z)): slopes to 76 degrees.
#define PT_RANGE_STEEP 4.0f
#define PT_RANGE_DEEPEST 1024.0f // cells behind the nearest point from which on depths of merged points count as that
#define PT_RANGE_ALONE 0u  // passes of magnify: the only one
#define PT_RANGE_COARSE 1u // bit: finer cells follow
#define PT_RANGE_FINE 2u   // bit: wider ones went before
#define PT_DIFFER_SCANS 4u  // at a time
#define PT_DIFFER_MOST 1024u // scans beyond share these numbers
#define PT_RANGE_LEAST 1e-30f // of gamma, and the most
#define PT_RANGE_MOST 1e30f

// coarsen: empties the cells. beyond: the least limit that is finite of those pixels that the cell has a part of; none: +inf.
struct coarsen_args {
    struct view_args view; // of the cells
    uint32_t width, height; // of the picture's planes ...
    int32_t origin_x, origin_y; // ... as in view_args
    float pixel;
    uint32_t behind; // 1: the limit plane holds
};

// merge: the mean of the points up to gamma behind the nearest of their cell, each weighted by w = 1 - (z - z_near) / gamma.
// [K Eq. 2] has the complement of it, by which the nearest counts nothing. Colours are weighted by opacity too. The sums are integers,
// PT_SUM_SCALE a unit; of z the share (z - z_near) / min(gamma, PT_RANGE_DEEPEST footprint).
struct merge_args {
    struct view_args view; // of the cells
    struct instance_args instance;
    float gamma, gamma_cells;
    uint32_t sifted; // as in scatter_args
};

// differ: how far scans lie apart: of each cell the means, scan by scan, of how far those points lie off its plane that merge takes. The
// plane goes through the middle of the cell where its nearest point is in depth, and has the cell's normal, so that a slope within a cell
// is no difference. PT_DIFFER_SCANS scans a pass; least and most hold what those before found, PT_RANGE_MOST and its negative: nothing.
// Sums are integers, of the share off / min(gamma, PT_RANGE_DEEPEST footprint), from -1 to 1, PT_SUM_SCALE a unit.
struct differ_args {
    struct view_args view; // of the cells
    float gamma, gamma_cells;
    uint32_t sifted; // as in scatter_args
    uint32_t first;  // scan % PT_DIFFER_MOST of those that this pass counts: from here on
    uint32_t start;  // 1: least and most hold nothing yet
};

// incline: a cell's normal: the sum of those of the 24 triangles [K Fig. 4] of which it is a corner and two of the cells around are the
// others, each as long as twice its area, so that slivers, which noise turns, say little. Without one: towards the viewer.
struct incline_args {
    struct view_args view; // of the cells
    float gamma, gamma_cells;
};

// magnify: faces between 2 x 2 cells, the corners at their places [K Fig. 7, 8]: of four within the greatest step two triangles, divided
// where z changes less; else each three that are. A pixel takes the nearest that its centre lies in; where there is none, the nearest
// cell whose place lies in the pixel; else, so that an outline borders on what lies behind it, the nearest triangle of three cells with a
// greater step, as far as its farthest corners: nearer ones weigh nothing. normal, albedo: between the corners, in perspective. z likewise. id: of the corner that weighs most.
// d_eff: of a surface whose points are as thick as max(gamma, 2 cells). away: pixels from that corner; 0 where it lies in the pixel.
// Of two [K II.E], or of several, all but the last mark what is not sharp, by away = -1 - away: where that corner has more points than `most`, is seen at less
// than `cosine`, lies at an outline, which is where not all cells around are joined to it, or where no face was. All but the first take marks
// away, and put their faces where nothing of the instance is, where they are a step nearer, and where they are not a step behind a mark.
struct magnify_args {
    struct view_args view; // of the picture
    struct view_args cells;
    float gamma, gamma_cells;
    float pixel, inverse; // 1 / pixel
    float d_min; // as in instance_args
    uint32_t behind; // 1: the limit plane holds
    uint32_t with_span; // as in resolve_args
    uint32_t pass;      // bits PT_RANGE_*
    uint32_t id_base, id_first, id_count; // as in instance_args
    float most;         // where finer ones follow: cells of more points are not sharp
    float cosine;       // nor are those that are seen at less of it
    uint32_t with_apart; // 1: the apart plane takes max(most - least, 0) of the corner that weighs most: differ
};

#endif
