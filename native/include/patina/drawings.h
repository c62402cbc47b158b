// SPDX-License-Identifier: GPL-3.0-or-later
// Survey drawings, a part of patina.h, which includes it. Its conventions and thread rules hold here too.
#ifndef PATINA_DRAWINGS_H
#define PATINA_DRAWINGS_H

#ifndef PATINA_H
#error "include patina/patina.h"
#endif

#ifdef __cplusplus
extern "C" {
#endif

// ---- drawings: lines on a plane, to scale --------------------------------------------------------------------------------

// A drawing has a plane in any direction, an extent and a scale. The library traces lines of clouds on it, and writes them as DXF, SVG or
// GeoJSON.
// Units: the clouds' unit is taken for a meter. Positions on the plane are two float64, right and up, from the middle of the extent.

typedef struct patina_drawing patina_drawing;

// Layers of a drawing's lines. DXF and SVG name them "cut", "cut-bridged", "outline" and so on. Line weights are in hundredths of
// a millimeter, from the list of the DXF format.
enum patina_drawing_layer {
    PATINA_DRAWING_CUT = 0,           // where a surface meets the plane; 35
    PATINA_DRAWING_CUT_BRIDGED = 1,   // dashed: over a gap in the samples; 35
    PATINA_DRAWING_OUTLINE = 2,       // 25
    PATINA_DRAWING_CREASE = 3,        // 9
    PATINA_DRAWING_CONTOUR = 4,       // 13
    PATINA_DRAWING_CONTOUR_INDEX = 5, // every fifth contour; 25
    PATINA_DRAWING_PROFILE = 6,       // 25
    PATINA_DRAWING_FRAME = 7,         // 70
    PATINA_DRAWING_TEXT = 8,          // 13
};
#define PATINA_DRAWING_LAYERS 9

typedef struct patina_drawing_desc {
    size_t struct_size;
    double origin[3]; // middle of the extent, world
    double right[3];  // of the drawing, any length; its direction is kept
    double up[3];     // any length; turned at right angles to `right`. The viewer looks against right x up
    double extent[2]; // width and height, above 0
    double front;     // how far before the plane the drawing reaches, at least 0
    double back;      // how far behind it, at least 0
    double scale;     // N of 1:N; 0 = 50
    uint32_t epsg;    // code of the projected coordinate system that the world's x and y are of, for GeoJSON; 0 = not known
    uint32_t unused;  // says nothing
} patina_drawing_desc;

// PATINA_ERROR_ARGUMENT, with a message that names the field, if a number is not finite or out of range, or if the two directions
// are parallel.
PATINA_API int patina_drawing_create(const patina_drawing_desc *desc, patina_drawing **out);
PATINA_API void patina_drawing_destroy(patina_drawing *drawing);

typedef struct patina_cut_desc {
    size_t struct_size;
    double thickness; // of the slab around the plane whose points are used; 0 = three spacings around each point
    uint32_t threads; // 0 = one per core. Any number gives the same lines
    uint32_t unused;  // says nothing
    // 16 float64 for each cloud, row-major: the place of its points in the drawing's world. They turn, move, mirror and scale, by the same
    // factor along all axes. NULL = where they are. Read during the call only, as is `shown`.
    const double *places;
    // For each cloud (count + 7) / 8 bytes as patina_scene_pick sets them: only points with a set bit are used. NULL, or NULL for a cloud =
    // all of its points.
    const uint8_t *const *shown;
} patina_cut_desc;

// Replaces the lines of the layers CUT and CUT_BRIDGED by the section of the clouds' surfaces. Points of low trust, of volumes and of
// wires are left out. Lines are simplified to 0.05 mm on paper. Each cloud must be analyzed (patina_cloud_analyse), else PATINA_ERROR_EMPTY.
// PATINA_ERROR_EMPTY too if the plane meets no points within the extent. PATINA_ERROR_ARGUMENT if a place is not as patina_cut_desc says.
// desc: NULL takes defaults. progress: may be NULL.
//
// Each line follows a curve that is fitted to the points around it (moving least squares with robust weights). Points whose surface faces
// elsewhere have no weight, so that lines end at corners; a corner is the intersection of two lines. Gaps that the footprints of the points
// cover are closed. Gaps up to twice as wide are bridged by dashed lines of their own.
PATINA_API int patina_drawing_cut(patina_drawing *drawing, const patina_cloud *const *clouds, uint32_t count,
                                  const patina_cut_desc *desc, patina_progress *progress);

typedef struct patina_contour_desc {
    size_t struct_size;
    double interval;  // between contours, above 0
    double cell;      // of the grid of heights; 0 = two spacings of the points, and a quarter of a millimeter on paper at least
    uint32_t index;   // every so many contours one is of CONTOUR_INDEX; 0 = 5
    uint32_t threads; // 0 = one per core. Any number gives the same lines
} patina_contour_desc;

// Replaces the lines of the layers CONTOUR and CONTOUR_INDEX by contours of the lowest surface over the plane, within the drawing's extent
// and depth. Heights are along the plane's normal: those of the world if the plane is horizontal, else distances from the plane. Contours are
// at multiples of the interval. Surfaces steeper than 75 degrees are left out, as are the points that patina_drawing_cut leaves out.
// PATINA_ERROR_EMPTY if a cloud is not analyzed, or if there is no ground.
PATINA_API int patina_drawing_contour(patina_drawing *drawing, const patina_cloud *const *clouds, uint32_t count,
                                      const patina_contour_desc *desc, patina_progress *progress);

#define PATINA_OUTLINE_SIZE 65536 // most pixels of a plane of distances on a side

typedef struct patina_outline_desc {
    size_t struct_size;
    const float *
        depth; // width * height, rows from the bottom: how far before the drawing's plane, world units. NaN = nothing. Not kept
    uint32_t width, height; // 1 to PATINA_OUTLINE_SIZE
    double pixel;           // width of a pixel, world units, above 0. The image's middle is that of the extent
    double spacing;         // of the points, world units, above 0. An outline is a step of more than three
    const uint8_t
        *measured; // width * height: 1 where a point is, as PATINA_PASS_SOURCE says, else 0. NULL = 1 everywhere. Not kept
} patina_outline_desc;

// Replaces the lines of the layer OUTLINE by those of an orthographic image of distances, such as PATINA_PASS_DEPTH. An outline is where a
// surface ends before one that is farther away by more than three spacings, or before nothing. It has the nearer one's distance, and is
// less than a spacing beyond its last measured pixels. Steps that the surfaces
// on both sides explain by their slope are left out, and so are lines shorter than 1 mm on paper. Lines are simplified to 0.05 mm on paper, or
// half a pixel if that is more. Takes another 8 bytes a pixel meanwhile. PATINA_ERROR_ARGUMENT for bad numbers, PATINA_ERROR_MEMORY.
PATINA_API int patina_drawing_outline(patina_drawing *drawing, const patina_outline_desc *desc);

typedef struct patina_drawing_info {
    size_t struct_size;
    uint32_t lines; // of all layers
    uint32_t layer_lines[9];
    double layer_lengths[9]; // on the plane, world units
    uint64_t samples;        // points that the cut lines were traced through
    uint64_t untrusted;      // points that were left out for their trust
    double spacing, sigma;   // medians of these samples; 0 without any
    double thickness;        // of the slab; by default the median
} patina_drawing_info;

PATINA_API int patina_drawing_get_info(const patina_drawing *drawing, patina_drawing_info *info);

typedef struct patina_drawing_line {
    size_t struct_size;
    uint32_t layer;    // patina_drawing_layer
    uint32_t closed;   // 1: the last vertex is joined to the first
    uint32_t vertices; // at least 2
    uint32_t unused;   // says nothing
} patina_drawing_line;

// index: below patina_drawing_info.lines.
PATINA_API int patina_drawing_get_line(const patina_drawing *drawing, uint32_t index, patina_drawing_line *line);
// Two float64 of each vertex: right and up from the middle of the extent. size: bytes, exactly.
PATINA_API int patina_drawing_read_line(const patina_drawing *drawing, uint32_t index, double *places, size_t size);
// One float64 of each vertex: how far before the plane it is: 0 on lines of a cut. size: bytes, exactly.
PATINA_API int patina_drawing_read_depths(const patina_drawing *drawing, uint32_t index, double *depths, size_t size);

// Writes all lines to a file, whole or not at all: path ends in .dxf, .svg or .geojson, else PATINA_ERROR_UNSUPPORTED.
// DXF: R2018, LWPOLYLINE entities in meters at the true place in the world, and POLYLINE entities for lines whose vertices differ in depth;
// flat 1: LWPOLYLINE entities in millimeters of the sheet, from the lower left corner of the extent. SVG: always millimeters of the sheet; layers are groups.
// GeoJSON: of a horizontal plane alone, and with desc.epsg, else PATINA_ERROR_UNSUPPORTED. A LineString for each line, with the
// property "layer"; x, y and z of the world.
PATINA_API int patina_drawing_write(const patina_drawing *drawing, const char *path, uint32_t flat);

#ifdef __cplusplus
}
#endif
#endif
