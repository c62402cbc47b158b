// SPDX-License-Identifier: GPL-3.0-or-later
// GeoTIFF files, written row by row from the top.
#ifndef TOOL_TIFF_H
#define TOOL_TIFF_H

#include "tool.h"

enum tool_tiff_kind {
    TIFF_BYTE,   // uint8
    TIFF_FLOAT,  // float32; NaN: nothing is there
    TIFF_RGBA,   // uint8, not premultiplied
    TIFF_RGBA16, // uint16, not premultiplied
};

// Where the pixels of an image are. A place has two coordinates, x and y.
struct tool_raster {
    double corner[2];             // of the upper left pixel: its upper left corner
    double along_row[2], down[2]; // from a pixel to the next one on its right, and to the one below
    uint32_t epsg;                // projected coordinate system; 0: a local one
    const char *name;             // of the local one
};

// 0 or NULL and -1 after a message. Rows have the kind's numbers, in the machine's order. Closing frees it in any case; not good: no file is
// written. A file has at most 4 GiB.
struct tool_tiff;
struct tool_tiff *tool_tiff_open(const char *path, uint32_t width, uint32_t height, enum tool_tiff_kind kind,
                                 const struct tool_raster *raster);
int tool_tiff_row(struct tool_tiff *tiff, const void *row);
int tool_tiff_close(struct tool_tiff *tiff, int good);

#endif
