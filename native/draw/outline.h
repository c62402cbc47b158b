// SPDX-License-Identifier: GPL-3.0-or-later
// Outlines of a plane of distances: between a pixel and a neighbor that is farther away, or shows nothing.
#ifndef PT_DRAW_OUTLINE_H
#define PT_DRAW_OUTLINE_H

#include "lines.h"

struct pt_depth_plane {
    uint32_t width, height;  // pixels
    double pixel;            // their width; the middle of the plane is 0
    float *depth;            // width * height, rows from the bottom: how far before the plane; NaN: nothing
    const uint8_t *measured; // of each pixel, whether a point is there; NULL: everywhere
};

// Gives pixels whose distance is between those of both neighbors, a step away from each, the distance of the farther one. A surface seen
// edge-on has such pixels. 0 or PATINA_ERROR_MEMORY.
int pt_depth_sharpen(struct pt_depth_plane *plane, double step);

// Takes pixels from the nearer side of outlines that no measured pixel of the same surface supports within the radius, and gives them the
// distance of the farther side: an image extends surfaces beyond their last points. At most `most` pixels deep. 0 or PATINA_ERROR_MEMORY.
int pt_depth_shrink(struct pt_depth_plane *plane, double step, double radius, uint32_t most);

// Adds lines along pixel sides with a step of more than `step`, and more than the surfaces on both sides explain. The nearer surface is on the
// left, and the line has its distance. Lines are within half a pixel of the sides. Those shorter than `least` are left out.
// 0 or PATINA_ERROR_MEMORY.
int pt_depth_outlines(const struct pt_depth_plane *plane, double step, double least, uint32_t layer, struct pt_lines *lines);

#endif
