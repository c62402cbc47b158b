// SPDX-License-Identifier: GPL-3.0-or-later
// A file of points, read whole into columns in file order. Every reader fills this one struct.
#ifndef PT_FILE_H
#define PT_FILE_H

#include "base/error.h"

#include <stdbool.h>

// A scalar of every point that is neither position, normal nor colour.
struct pt_column {
    char name[64];
    uint32_t type; // patina_type, as in the file
    void *data;    // count elements of that type, tightly packed
};

// Points that one scanner took from one place, column by column or row by row; attributes "row" and "column" say where
// each lies in its grid.
struct pt_scan {
    char name[64];          // "" where nothing names it
    uint64_t first, count;  // points
    uint32_t columns, rows; // 0: no grid
    double station[3];      // where the scanner stood, in the file's coordinates; `parallel`: the direction towards it
    bool parallel, nowhere; // nowhere: neither place nor direction are known
    double pose[12];        // the file's coordinates from the scan's own: three rows of four
    double direction[3];    // in which the scanner looked, unit; 0: not known, or all around. Of pt_file_measure_scans, as is
    bool told;              // direction and interval, by the file itself: they are not measured
    double interval;        // the median way from a point to those beside it in the grid; 0: there are none
    uint64_t missing, surplus; // cells of the grid that never came, and lines behind it, of pt_file_end_scan
    uint32_t announced[2];     // columns and rows as the file has them
};

// Immutable once opened. All pointers are owned; a column that the file lacks is NULL.
struct patina_file {
    struct pt_handle handle;       // first: patina_message() takes any handle
    char format[48];               // "PLY ascii", ...
    uint64_t count;                // points; index = place in the file
    double origin[3];              // position in the file = position[i] + origin, in float64
    double box_min[3], box_max[3]; // of the finite positions, origin included; min > max when there is none
    uint64_t invalid_positions;    // rows with a NaN or infinite coordinate; they stay in the columns
    uint32_t position_type;        // patina_type as stored in the file
    uint32_t color_type;           // of `color`: UINT8, UINT16 (both sRGB), FLOAT32 (linear), NONE without colour
    float *position;               // 3 a point, relative to origin
    float *normal;                 // 3 a point, any length, as in the file
    void *color;                   // 4 (RGBA) a point; alpha is opaque where the file has none
    struct pt_column *attributes;
    uint32_t attribute_count;
    struct pt_scan *scans; // in the order of the points; attribute "scan" counts them from 0
    uint32_t scan_count;
    bool splats; // the points were Gaussian splats: attributes "opacity" and "radius" are those of their discs
};

// The bytes that a reader is given. name: what messages call the file, short enough for one.
struct pt_input {
    char name[200];
    const uint8_t *data;
    size_t size;
    struct patina_progress *progress; // may be NULL
};

// Opens the file at a path. alone: a file that names others, as a .conf does, is refused.
typedef int pt_file_opener(const char *path, bool alone, struct patina_progress *progress, struct patina_file **out);

// Readers: fill a zeroed file. On failure the caller destroys what was filled.
int pt_ply_read(struct patina_file *file, const struct pt_input *input);
// A PLY's points in windows (ply_windows.c). begin: *why: why they cannot come so, and no rows; else NULL. The input lasts.
struct ply_rows;
int pt_ply_begin(const struct pt_input *input, struct ply_rows **out, const char **why);
uint64_t pt_ply_count(const struct ply_rows *rows);
// The next rows, count at most, into a zeroed file; none where all have come. *behind: where the input was read up to.
int pt_ply_next(struct ply_rows *rows, uint64_t count, struct patina_file *file, uint64_t *behind);
void pt_ply_end(struct ply_rows *rows);
int pt_text_read(struct patina_file *file, const struct pt_input *input); // XYZ, CSV, PTS, PTX
// Stanford's .conf: scans in files beside it (path: its own), each with its place. What cannot be read is told in the log and left
// out; an error where nothing is left.
int pt_conf_read(struct patina_file *file, const struct pt_input *input, const char *path, pt_file_opener *open);
bool pt_conf_is(const struct pt_input *input);
// Whether the first line that is no comment begins with a number, or names x, y and z; or the file is called a text, and is no PLY.
bool pt_text_is(const struct pt_input *input);

// Takes over `staged`, 3 float64 a point from malloc: chooses the origin, narrows to file->position in place.
// file->count must be set, file->origin holds what the file already declared (or 0) and is added to.
void pt_file_place(struct patina_file *file, double *staged);
// The same in two: the origin of all points, of which every (count / PT_ORIGIN_SAMPLES, rounded up)-th from the first on is looked at.
enum { PT_ORIGIN_SAMPLES = 4096 };
void pt_file_choose_origin(const double *staged, uint64_t count, double origin[3]);
void pt_file_place_at(struct patina_file *file, double *staged, const double origin[3]);
// Sets the box and invalid_positions from file->position.
void pt_file_measure(struct patina_file *file);

// Normals of the points of scans with a grid, towards the scanner, from the fit of a plane to the grid's neighbours; points
// in no surface get 0. Nothing where the file has normals, or no scan a grid. file->position must be placed.
int pt_file_grid_normals(struct patina_file *file, const struct pt_input *input);
// Sets direction and interval of all scans. file->position must be placed. PATINA_OK or PATINA_ERROR_MEMORY, without words.
int pt_file_measure_scans(struct patina_file *file);
// Ends a file's last scan. missing: cells of its grid that never came; the grid no longer has them then. surplus: lines that came
// behind the grid.
void pt_file_end_scan(struct patina_file *file, uint64_t missing, uint64_t surplus);
// Logs what is wrong with a file's scans: one warning for each kind of fault, however many scans have it.
void pt_file_tell_scans(const struct patina_file *file, const char *name);
// Whether a grid is too empty to be one: then nothing takes memory for its cells, whose number a file may invent.
bool pt_grid_is_empty(uint64_t columns, uint64_t rows, uint64_t points);
// Whether a matrix, three rows of `stride`, turns: to 1 %, and scaled by whatever is the same along all axes.
bool pt_turns(const double *matrix, int stride);
// Takes over the data of a new last attribute.
int pt_file_add_attribute(struct patina_file *file, const char *name, uint32_t type, void *data);
const struct pt_column *pt_file_find_attribute(const struct patina_file *file, const char *name);
double pt_file_value(const struct pt_column *column, uint64_t i); // of a point

// Bytes of one element of a patina_type; 0 for PATINA_NONE and unknown ones.
size_t pt_type_size(uint32_t type);
// Copies a path into a message-sized buffer; a long one keeps its end, behind three dots.
void pt_clip_name(char *name, size_t size, const char *path);

#endif
