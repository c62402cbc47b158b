// SPDX-License-Identifier: GPL-3.0-or-later
// Files of points, a part of patina.h, which includes it. Its conventions and thread rules hold here too.
#ifndef PATINA_FILES_H
#define PATINA_FILES_H

#ifndef PATINA_H
#error "include patina/patina.h"
#endif

#ifdef __cplusplus
extern "C" {
#endif

// ---- files -----------------------------------------------------------------------------------------------------

typedef struct patina_file_info {
    size_t struct_size;
    char format[48];        // "PLY binary_little_endian", ...
    uint64_t count;         // points
    uint32_t attributes;    // scalar attributes beside position, normal, colour
    uint32_t position_type; // patina_type as stored in the file
    uint32_t color_type;    // PATINA_NONE without colour
    uint32_t has_normals;
    double origin[3];              // float64 origin that positions are relative to; 0 unless float32 would lose detail
    double box_min[3], box_max[3]; // of all finite positions, origin included
    uint64_t invalid_positions;
    uint32_t stations; // places of scanners, one a scan; a point's attribute "scan" says which is its own, if any; 0: not known
    uint32_t scans;    // that the file tells of: patina_file_get_scan; 0: none
    uint32_t splats;   // 1: Gaussian splats, taken as discs: attributes "opacity", 0..1, and "radius", of patina_cloud_desc
    uint32_t unused;   // says nothing
} patina_file_info;

typedef struct patina_file_attribute {
    size_t struct_size;
    char name[64];
    uint32_t type; // as in the file
} patina_file_attribute;

// A scan of a file. The file's coordinates, origin included, and its unit.
typedef struct patina_file_scan {
    size_t struct_size;
    char name[64];          // of its own file, where a .conf names that; else ""
    uint64_t first, count;  // its points follow each other; attribute "scan" says its index
    uint32_t columns, rows; // of the scanner's grid; 0: none
    double pose[12];        // the file's coordinates from the scan's own: three rows of four
    double station[3];      // where the scanner stood, if has_station
    double direction[3];    // in which it looked, unit; 0 0 0 = not known, or all around: points more than 60 degrees beside it
    double interval;        // between neighbouring samples: the median way in the grid; 0 = not known
    uint32_t has_station;
    uint32_t unused;
} patina_file_scan;

// Reads a PLY (ascii, both byte orders), XYZ, CSV, PTS, PTX or conf file whole; formats are told apart by content. Errors name
// the byte offset (binary) or line (text). Points of a scanner's grid (PTX, range_grid of a PLY) have the attributes "row" and
// "column", those of a PTX and a conf "scan" too; PLYs that the add-on writes say what is known of their scans. A PLY's faces, and a
// scanner's grid, give normals where there are no others.
// A conf (Stanford's: lines "bmesh NAME tx ty tz qx qy qz qw") is the files that it names, each in its place, p' = R(conjugate of q) p
// + t. Scans that cannot be read or placed are left out, and a line of the log names them: of a conf and of a PTX.
PATINA_API int patina_file_open(const char *path, patina_progress *progress, patina_file **out);
PATINA_API int patina_file_open_memory(const void *data, size_t size, patina_file **out); // data is not kept
PATINA_API void patina_file_destroy(patina_file *file);
PATINA_API int patina_file_get_info(const patina_file *file, patina_file_info *info);
PATINA_API int patina_file_get_attribute(const patina_file *file, uint32_t index, patina_file_attribute *attribute);
PATINA_API int patina_file_get_scan(const patina_file *file, uint32_t index, patina_file_scan *scan);
// Copies one column as float32 (uint8 for colour) into the caller's buffer of `size` bytes.
PATINA_API int patina_file_read_positions(const patina_file *file, float *xyz, size_t size); // relative to origin
PATINA_API int patina_file_read_normals(const patina_file *file, float *xyz, size_t size);
PATINA_API int patina_file_read_colors_u8(const patina_file *file, uint8_t *rgba, size_t size); // sRGB
PATINA_API int patina_file_read_colors_f32(const patina_file *file, float *rgba, size_t size);  // linear
PATINA_API int patina_file_read_stations(const patina_file *file, double *xyz,
                                         size_t size); // file coordinates: origin included
PATINA_API int patina_file_read_attribute(const patina_file *file, uint32_t index, float *values, size_t size);
// A scanner's grid, of one scan: which column and row each point lies in, and where the scanner stood, in the positions'
// coordinates.
typedef struct patina_grid_desc {
    size_t struct_size;
    uint64_t count;
    const float *position; // 3 a point
    const uint32_t *column, *row;
    double station[3];
} patina_grid_desc;
// Normals as patina_file_open finds them in grids, towards the scanner, 3 a point into `normals`; 0 0 0 where a point lies in no
// surface, and everywhere where the grid is nearly empty.
PATINA_API int patina_grid_normals(const patina_grid_desc *grid, patina_progress *progress, float *normals);
// A file whose points come in windows, so that it need not be in memory: those of a PLY of any size, but for one whose faces or
// range_grid give its points their normals, or whose header tells of scans. All windows together are what patina_file_open gives of it,
// relative to the same origin. Every other file is read whole, and is one window.
typedef struct patina_rows patina_rows;
typedef struct patina_rows_info {
    size_t struct_size;
    uint64_t count; // points, as its header says; 0 where the file is read whole: not known yet
    char whole[80]; // why it is read whole; "": it comes in windows
} patina_rows_info;
// Errors as patina_file_open has them: what is seen at once is told here, the rest with its window. Points that are not there are
// an error, once those before them were given. progress: of all windows; may be NULL. next: NULL behind the last, else the caller's.
PATINA_API int patina_rows_open(const char *path, patina_progress *progress, patina_rows **out);
PATINA_API int patina_rows_get_info(const patina_rows *rows, patina_rows_info *info);
PATINA_API int patina_rows_next(patina_rows *rows, uint64_t most, patina_file **out);
PATINA_API void patina_rows_destroy(patina_rows *rows);

// Builds a cloud from an opened file. An attribute called class or classification, in any case, behind "scalar_" or not,
// gives it classes. One of splats has their opacities and radii.
PATINA_API int patina_file_cloud(const patina_file *file, uint32_t threads, patina_progress *progress, patina_cloud **out);
// Open + build in one call.
PATINA_API int patina_cloud_load(const char *path, patina_progress *progress, patina_cloud **out);
// Writes a binary little-endian PLY; columns as in the descriptor (positions are written as float64 when the
// descriptor has an origin, else in their own type).
PATINA_API int patina_write_ply(const char *path, const patina_cloud_desc *desc);

#ifdef __cplusplus
}
#endif
#endif
