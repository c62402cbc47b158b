// SPDX-License-Identifier: GPL-3.0-or-later
// Cameras and lights of `patina render`.
#ifndef TOOL_VIEW_H
#define TOOL_VIEW_H

#include "tool.h"

struct tool_box {
    double min[3], max[3]; // of all that is drawn, as patina_scene_extent has it
};

// The camera that the options ask for, turned by `turn` degrees around the vertical axis. Returns a patina_error.
int tool_camera(const struct tool_options *options, const patina_scene *scene, const struct tool_box *box, double turn,
                patina_camera *camera);
// A sun over the left shoulder of that camera and a weak one from the right. Returns a patina_error.
int tool_lights(patina_scene *scene, const struct tool_options *options, const patina_camera *camera);

// The panorama that the options ask for.
void tool_panorama(const struct tool_options *options, const struct tool_box *box, patina_panorama *panorama);
// Whether its faces fit into the memory that is free; says why not.
int tool_panorama_fits(const patina_panorama *panorama);
// Draws it: gives its pixels, which the caller frees, and of the stats points, width and height. Returns a patina_error.
int tool_draw_panorama(const struct tool_options *options, const patina_panorama *panorama, patina_scene *scene,
                       patina_frame *frame, float **pixels, patina_frame_stats *stats);

// Positions and faces of an OBJ file. A PATINA_ERROR code; says where a line is wrong.
int tool_load_mesh(const char *path, patina_mesh **out);

#endif
