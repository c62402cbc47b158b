// SPDX-License-Identifier: GPL-3.0-or-later
// Polylines on a drawing's plane, in meters from the middle of its extent.
#ifndef PT_DRAW_LINES_H
#define PT_DRAW_LINES_H

#include <math.h>
#include <stdint.h>

static inline double pt_distance(const double a[2], const double b[2])
{
    const double x = a[0] - b[0], y = a[1] - b[1];
    return sqrt(x * x + y * y);
}

struct pt_line {
    double (*at)[2];
    double *depth;  // of each vertex, how far before the plane
    uint8_t *fixed; // of each vertex; 1: a corner, which simplification keeps
    uint32_t count, room;
    uint32_t layer; // patina_drawing_layer
    int closed;     // the last vertex is joined to the first; it is not the same
    double spacing; // of the samples that it was traced through; 0: none
};

struct pt_lines {
    struct pt_line *at;
    uint32_t count, room;
};

// All that take memory return 0 or PATINA_ERROR_MEMORY.
int pt_line_add(struct pt_line *line, const double place[2], int fixed); // on the plane: its depth is 0
int pt_line_append(struct pt_line *line, const struct pt_line *other);   // the other's vertices behind the line's own
void pt_line_reverse(struct pt_line *line);
double pt_line_length(const struct pt_line *line);
// Shortens the end by a length, down to two vertices.
void pt_line_trim(struct pt_line *line, double length);
void pt_line_free(struct pt_line *line);
int pt_lines_add(struct pt_lines *lines, struct pt_line *line); // takes the line's memory, and frees it on failure
void pt_lines_free(struct pt_lines *lines);

#endif
