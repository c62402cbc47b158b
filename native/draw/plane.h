// SPDX-License-Identifier: GPL-3.0-or-later
// The plane of a drawing: where it is in the world, and how much of it is drawn.
#ifndef PT_DRAW_PLANE_H
#define PT_DRAW_PLANE_H

struct pt_draw_plane {
    double origin[3];                  // the middle of the extent
    double right[3], up[3], normal[3]; // unit, orthogonal, right-handed; the viewer looks against the normal
    double half[2];                    // half of the extent's width and height
    double front, back;                // how far before and behind the plane the drawing reaches
};

// Makes the frame orthonormal: right keeps its direction, up is turned in their plane. 0, or -1 if a number is not finite or the two
// directions are parallel or zero.
int pt_draw_plane_frame(struct pt_draw_plane *plane, const double origin[3], const double right[3], const double up[3]);
// The range of a box along the plane's three axes, relative to its origin.
void pt_draw_plane_range(const struct pt_draw_plane *plane, const double box_min[3], const double box_max[3], double low[3],
                         double high[3]);
// The plane in the space of points that a row-major matrix places in the plane's world: lengths there times *scale are those of the world. -1
// if a number is not finite, or if the matrix does more than turn, move, mirror and scale by one factor.
int pt_draw_plane_inside(const struct pt_draw_plane *plane, const double place[16], struct pt_draw_plane *inside,
                         double *scale);
// World coordinates of a place so far before the plane.
void pt_draw_plane_world(const struct pt_draw_plane *plane, const double place[2], double depth, double world[3]);

#endif
