// SPDX-License-Identifier: GPL-3.0-or-later
// What the parts of the PLY reader share: the header as parsed, and where each value goes. The format is Greg Turk's
// (The PLY Polygon File Format, Stanford 1994), with the type names that came later.
#ifndef PT_PLY_H
#define PT_PLY_H

#include "file.h"

#include <stdbool.h>

enum {
    PLY_NAME_SIZE = 64,          // with the final zero; as patina_file_attribute.name
    PLY_MOST_ELEMENTS = 64,      // in a header
    PLY_MOST_PROPERTIES = 1024,  // in a header, all elements together
    PLY_LONGEST_HEADER = 1 << 20 // bytes
};

enum ply_format { PLY_NO_FORMAT, PLY_ASCII, PLY_LITTLE_ENDIAN, PLY_BIG_ENDIAN };

struct ply_property {
    char name[PLY_NAME_SIZE];
    uint32_t type;       // patina_type of the value, or of a list's items
    uint32_t count_type; // of a list's count; PATINA_NONE: not a list
};

struct ply_element {
    char name[PLY_NAME_SIZE];
    uint64_t count;
    uint32_t first, properties; // of ply_header.properties
};

struct ply_header {
    enum ply_format format;
    double origin[3]; // from "comment patina origin X Y Z"
    uint32_t element_count;
    struct ply_element elements[PLY_MOST_ELEMENTS];
    uint32_t property_count;
    struct ply_property properties[PLY_MOST_PROPERTIES];
    uint32_t grid_columns, grid_rows; // from "obj_info num_cols", "num_rows"
    bool crlf;                        // the header's lines end with CR LF
    uint64_t body;                    // offset of the first byte behind the header
    uint64_t body_line;               // its line number
};

// What a fault in the rows is: an error, a line in the log, nothing.
enum ply_tone { PLY_REFUSE, PLY_WARN, PLY_QUIET };

// A place in the rows; elements are read one after the other.
struct ply_cursor {
    const struct pt_input *input;
    const struct ply_header *header;
    uint64_t offset, line; // of the next row
    enum ply_tone tone;
    uint64_t before, all; // of a window: the element's rows that lie before it, and all of them; 0, 0: it is read whole
};

// Where the values of one vertex property go. data NULL: nowhere.
struct ply_target {
    void *data;    // the first point's value
    uint32_t type; // of the column: any patina_type
    uint32_t step; // in elements, from point to point
    double scale;  // values are multiplied by it
    double offset; // and this is added, of 8-bit columns
    bool wrap;     // negative values are bytes that a writer called signed: -1 is 255
};

// The element of the points; NULL: there is none.
const struct ply_element *ply_find_points(const struct ply_header *header);
// Rows of points alone, from the cursor on, which comes behind them: `window` is their element but for its count. origin: that positions are
// taken relative to; of float32 no other than the header's. The input and header are those of the cursor.
int ply_read_window(struct patina_file *file, const struct ply_element *window, struct ply_cursor *at, const double origin[3]);
// Whether float32 may lose something of the positions: those of a window need an origin that was chosen for all.
bool ply_is_fine(const struct ply_header *header, const struct ply_element *points);
// Why the rows of points cannot be told one by one; NULL: they can.
const char *ply_why_whole(const struct pt_input *input, const struct ply_header *header, const struct ply_element *points);
// Whether a header of so many bytes tells of scans.
bool ply_tells_of_scans(const struct pt_input *input, uint64_t header);

// What a header of `header` bytes tells of the file's scans, once its points are read; what is wrong there is told in the log. PATINA_OK or
// PATINA_ERROR_MEMORY, without words.
int ply_read_scans(struct patina_file *file, const struct pt_input *input, uint64_t header);
int ply_read_header(const struct pt_input *input, struct ply_header *header);

// The lists of one property, handed on row by row.
struct ply_lists {
    uint32_t property; // of the element
    void (*take)(void *context, uint64_t row, const double *items, size_t count);
    void *context;
    double *items; // of the row, from malloc; NULL at first
    size_t room;
};

// Reads the rows of the element that begins at the cursor, which comes behind them; property i goes to targets[i].
// targets NULL: values go nowhere; without lists, too, the rows of a text are passed over without a look at what they hold.
int ply_read_rows(struct ply_cursor *at, const struct ply_element *element, const struct ply_target *targets,
                  struct ply_lists *lists);
int ply_read_binary(struct ply_cursor *at, const struct ply_element *element, const struct ply_target *targets,
                    struct ply_lists *lists);
int ply_read_ascii(struct ply_cursor *at, const struct ply_element *element, const struct ply_target *targets,
                   struct ply_lists *lists);
// Room for the items of a row. PATINA_ERROR_MEMORY.
int ply_make_room(const struct ply_cursor *at, struct ply_lists *lists, size_t count);
// Tells what is behind the last element, where the cursor is.
void ply_warn_of_rest(struct ply_cursor at);

// Refuses a binary body in which each line feed became carriage return and line feed, as copying it as text makes it.
int ply_check_line_ends(const struct pt_input *input, const struct ply_header *header);

// Normals from faces: each corner's face normal by the corner's angle (Thuermer and Wuethrich, Computing Vertex Normals
// from Polygonal Facets, 1998), so that they do not depend on how a polygon was cut into triangles.
struct ply_faces {
    const float *position; // 3 a point
    uint64_t points;
    float *normal;      // 3 a point, zeros at first
    bool strips;        // a row is a strip of triangles; -1 begins the next one (Stanford's tristrips)
    uint64_t used, bad; // faces
    uint64_t bad_row;   // of the first bad one
    double bad_point;   // that it names
};

// The list of the element that names points; -1 without one.
int64_t ply_find_corners(const struct ply_header *header, const struct ply_element *element);
void ply_take_face(void *faces, uint64_t row, const double *corners, size_t count); // ply_lists.take
void ply_finish_faces(struct ply_faces *faces); // unit lengths; points without a face keep 0

// Which point lies in which cell of a scanner's grid, row by row of at most one point.
struct ply_grid {
    uint32_t columns;
    uint64_t points;
    uint16_t *row, *column; // a point; PLY_NO_CELL
    uint64_t bad, twice;    // cells that name a point that is not there, or one that another cell named
};
enum { PLY_NO_CELL = UINT16_MAX };

void ply_take_cell(void *grid, uint64_t cell, const double *points, size_t count); // ply_lists.take

// Puts n values at points first, first + 1, ... of a column; integers are clamped to what their type holds.
void ply_store(const struct ply_target *target, uint64_t first, size_t n, const double *values);
// Error when the file, from the cursor on, cannot hold the rows that the element declares.
int ply_check_count(const struct ply_cursor *at, const struct ply_element *element);
// Says what is wrong in the cursor's tone. Returns PATINA_ERROR_FORMAT.
int ply_fault(const struct ply_cursor *at, const char *format, ...) __attribute__((format(printf, 2, 3)));
// Copies bytes of a file into a message: at most 40 of them, what is not printable ASCII as '?'.
const char *ply_quote(char quoted[44], const void *bytes, size_t size);
// Sets the progress to offset / size. PATINA_ERROR_CANCELLED when the caller wants no more.
int ply_poll(const struct pt_input *input, uint64_t offset);
// The name of a patina_type in a PLY header.
const char *ply_type_name(uint32_t type);

// Gaussian splats, told by their properties (ply_splats.c).
bool ply_are_splats(const struct ply_property properties[], uint32_t count);
// How a splat's colour differs by direction: nothing of it is read.
bool ply_is_splat_rest(const char *name);
// Scales and turns become discs: attributes "radius" and "opacity", and normals. name: for the log, NULL: it is told already. PATINA_OK, or
// PATINA_ERROR_MEMORY without words.
int ply_make_discs(struct patina_file *file, const char *name);

static inline bool pt_is_float(uint32_t type) { return type == PATINA_FLOAT32 || type == PATINA_FLOAT64; }

#endif
