// SPDX-License-Identifier: GPL-3.0-or-later
// Polylines as arrays: simplification, clipping to a rectangle, and contours of a grid.
#ifndef PT_DRAW_CONTOUR_H
#define PT_DRAW_CONTOUR_H

#include "lines.h"

// Takes vertices out of a line while it stays within the tolerance (Douglas and Peucker 1973), then moves the rest so that the line's mean
// distance from what it was is zero: chords of a curve would else all lie on its inner side. Fixed vertices stay.
// 0 or PATINA_ERROR_MEMORY.
int pt_line_simplify(struct pt_line *line, double tolerance);

// Replaces lines by their parts within |x| <= half[0], |y| <= half[1]. 0 or PATINA_ERROR_MEMORY.
int pt_lines_clip(struct pt_lines *lines, const double half[2]);

#endif
