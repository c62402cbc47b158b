// SPDX-License-Identifier: GPL-3.0-or-later
// Files of drawings: which format a path asks for, and that a file is there whole or not at all.
#include "drawing.h"
#include "base/words.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static int check_geojson(const patina_drawing *drawing, const char *path)
{
    if (fabs(drawing->plane.normal[2]) < 1.0 - 1e-9)
        return pt_fail(&drawing->handle, PATINA_ERROR_UNSUPPORTED,
                       "%s: GeoJSON is for plans, and this plane is not horizontal: write .dxf", path);
    if (!drawing->epsg)
        return pt_fail(&drawing->handle, PATINA_ERROR_UNSUPPORTED,
                       "%s: GeoJSON needs the coordinate system, else its places are taken for degrees: set epsg", path);
    return PATINA_OK;
}

int patina_drawing_write(const patina_drawing *drawing, const char *path, uint32_t flat)
{
    if (!drawing || !path || !*path || flat > 1)
        return pt_fail(drawing ? &drawing->handle : NULL, PATINA_ERROR_ARGUMENT,
                       "patina_drawing_write: drawing or path is missing, or flat is neither 0 nor 1");
    const char *dot = strrchr(path, '.');
    const int dxf = dot && pt_same_word(dot, ".dxf"), svg = dot && pt_same_word(dot, ".svg"),
              geojson = dot && pt_same_word(dot, ".geojson");
    if (!dxf && !svg && !geojson)
        return pt_fail(&drawing->handle, PATINA_ERROR_UNSUPPORTED, "%s: drawings are written as .dxf, .svg or .geojson", path);
    struct pt_whole whole;
    char text[128];
    int error = geojson ? check_geojson(drawing, path) : PATINA_OK;
    if (error)
        return error;
    error = pt_whole_begin(path, &whole);
    if (!error) {
        const int good = dxf   ? pt_write_dxf(drawing, (int)flat, whole.stream)
                         : svg ? pt_write_svg(drawing, whole.stream)
                               : pt_write_geojson(drawing, whole.stream);
        error = pt_whole_end(&whole, good && !fflush(whole.stream) && !ferror(whole.stream));
    }
    return error ? pt_fail(&drawing->handle, PATINA_ERROR_FILE, "%s: cannot be written: %s", path,
                           pt_error_text(error, text, sizeof text))
                 : PATINA_OK;
}
