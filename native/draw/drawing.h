// SPDX-License-Identifier: GPL-3.0-or-later
// What a drawing holds.
#ifndef PT_DRAW_DRAWING_H
#define PT_DRAW_DRAWING_H

#include "lines.h"
#include "plane.h"
#include "base/error.h"

struct patina_drawing {
    struct pt_handle handle;
    struct pt_draw_plane plane;
    double scale;  // N of 1:N
    uint32_t epsg; // see patina_drawing_desc
    struct pt_lines lines;
    patina_drawing_info info; // of the last cut; not of its lines
};

struct pt_draw_layer {
    const char *name;
    int weight; // hundredths of a millimeter
    int color;  // of AutoCAD's index
    int dashed;
};

extern const struct pt_draw_layer pt_draw_layers[PATINA_DRAWING_LAYERS];

#define PT_DRAW_TOLERANCE 0.05e-3 // of simplified lines, meters on paper

// Replaces the lines of these layers. Takes the given lines. 0 or PATINA_ERROR_MEMORY.
int pt_draw_replace(patina_drawing *drawing, uint32_t first, uint32_t last, struct pt_lines *by);
// Refuses missing clouds, and such as are not analyzed. 0, or an error with its message.
int pt_draw_check_clouds(const patina_drawing *drawing, const char *call, const patina_cloud *const *clouds, uint32_t count);

// Writes to an open stream; false if the stream failed. flat: see patina_drawing_write.
int pt_write_dxf(const struct patina_drawing *drawing, int flat, FILE *file);
int pt_write_svg(const struct patina_drawing *drawing, FILE *file);
int pt_write_geojson(const struct patina_drawing *drawing, FILE *file); // of a horizontal plane, in a known system

// A number for a file, with a decimal point in every locale: `digits` significant ones. Returns text.
char *pt_draw_number(double value, int digits, char text[40]);

#endif
