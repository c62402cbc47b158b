// SPDX-License-Identifier: GPL-3.0-or-later
// What the files of `patina draw` share.
#ifndef TOOL_DRAW_H
#define TOOL_DRAW_H

#include "page.h"
#include "tiff.h"

enum { DRAW_FILES = 256, DRAW_OUTPUTS = 16 };
enum { DRAW_TITLE, DRAW_PROJECT, DRAW_AUTHOR, DRAW_NUMBER, DRAW_DATE, DRAW_TITLES }; // fields of the title block
enum draw_plane { DRAW_NO_PLANE, DRAW_SECTION, DRAW_ELEVATION, DRAW_PLAN, DRAW_FRAME };

struct draw_style;

struct draw_options {
    char **files; // into the argument vector
    int file_count;
    const char *outputs[DRAW_OUTPUTS];
    int output_count;
    enum draw_plane plane;
    double numbers[9]; // of the plane
    int has_distance;  // an elevation's
    double extent[2];  // 0: that of the clouds
    double depth[2];   // before and behind the plane
    int has_depth;
    double scale, thickness, pixel; // pixel: of an image, world units; 0: automatic
    double contours;                // interval; 0: none
    int flat, outlines;
    int depth_map, mask, deep;       // of a TIFF: two more files, and 16 bits
    uint32_t epsg;                   // of the clouds' coordinates; 0: not known
    const char *sheet;               // its name; NULL: none
    const char *titles[DRAW_TITLES]; // NULL: not given
    const struct draw_style *style;  // of the image; NULL: as scanned
    const char *device;
    const char *batch; // a file of drawings; NULL: these options are one
    uint32_t threads;
};

// Points, once for all drawings.
struct draw_clouds {
    patina_progress *progress;
    patina_cloud *list[DRAW_FILES];
    double spacing;                // the widest of the clouds
    double box_min[3], box_max[3]; // of all points, without strays
};

// Draws and writes one drawing. A tool_exit; says what it did, or what is wrong.
int draw_one(const struct draw_options *options, const struct draw_clouds *clouds);

// ---- batches -------------------------------------------------------------------------------------------------------

struct draw_batch;
// Reads the drawings of options->batch, which begin as these options. NULL after a message for each that is wrong; *result is a tool_exit.
struct draw_batch *draw_read_batch(const struct draw_options *options, int *result);
// Draws all of them. A tool_exit: TOOL_FAILED if one failed, after a message that begins with its place in the list.
int draw_all(const struct draw_batch *batch, const struct draw_clouds *clouds);
void draw_free_batch(struct draw_batch *batch);

// ---- planes and images ---------------------------------------------------------------------------------------------

// The drawing's plane in the world, where the clouds lie in a box. zero: where the plane's own coordinates are 0. A tool_exit; says what is
// wrong.
int draw_describe(const struct draw_options *options, const double box_min[3], const double box_max[3],
                  patina_drawing_desc *desc, double zero[3]);
// Unit vectors: right, up, towards the viewer. -1 if right and up are zero or parallel.
int draw_axes(const patina_drawing_desc *desc, double axes[3][3]);

// What a drawing shows, rendered.
struct draw_image {
    const struct draw_options *options;
    const patina_drawing_desc *desc;
    const double *zero;
    patina_cloud *const *clouds;
    const char *path;
    double pixel; // width of a pixel, world units
    uint32_t width, height;
    uint64_t measured, filled; // pixels so far
};

// Of a whole image, for outlines. Begins as zeros.
struct draw_depths {
    float *depth;       // before the plane; NaN: nothing
    uint8_t *measured;  // 0: filled, or nothing
    size_t width, rows; // rows that are missing, from the bottom
};

// Renders once, and writes PNGs, and GeoTIFFs with what is beside them. picture: the same for a page, to be freed; NULL: not wanted.
// image->path names the first output in messages. A tool_exit.
// depths: those of the image, to be freed; NULL: not wanted.
int draw_write_images(struct draw_image *image, const char *const *paths, int count, struct tool_picture *picture,
                      struct draw_depths *depths);
double draw_filled(const struct draw_image *image); // percent of the surface
// Room for an image. A tool_exit; says what is too large.
int draw_begin_depths(const struct draw_image *image, struct draw_depths *depths);
void draw_take_depths(struct draw_depths *depths, const float *depth, const float *source, uint32_t rows);
// Adds the outlines of what the image shows to a drawing. A tool_exit.
int draw_outlines(const struct draw_image *image, const struct draw_depths *depths, patina_drawing *drawing);
void draw_free_depths(struct draw_depths *depths);
// Renders in strips, the top first. Each strip is given to `take`: rows from the bottom, premultiplied linear RGBA, the distance before the
// plane (NaN: nothing), and PATINA_PASS_SOURCE. take returns a tool_exit.
int draw_render(struct draw_image *image, void *to,
                int (*take)(void *to, const float *color, const float *depth, const float *source, uint32_t rows));
// Coordinates are x and y of the world on a horizontal plane (returns 1), else on the plane itself. along: how each grows, in meters per
// meter to the drawing's right and up. middle: of the extent.
int draw_coordinates(const struct draw_image *image, double along[2][2], double middle[2]);
// Where the pixels are, by these coordinates. name: static.
void draw_raster(const struct draw_image *image, struct tool_raster *raster);
// The files beside a GeoTIFF: its world file, .prj and .json. A tool_exit.
int draw_write_beside(const struct draw_image *image, const struct tool_raster *raster);
int draw_is_tiff(const char *path);
// The path with another ending, to be freed. NULL after a message.
char *draw_path_with(const char *path, const char *ending);

// ---- styles --------------------------------------------------------------------------------------------------------

// NULL in *style: as scanned. -1: there is none of this name. Others take such a NULL, and return a patina_error.
int draw_find_style(const char *name, const struct draw_style **style);
void draw_style_settings(const struct draw_style *style, patina_settings *settings); // background and ambient light
int draw_style_cloud(const struct draw_style *style, const patina_cloud *cloud, patina_scene *scene);
int draw_style_effects(const struct draw_style *style, patina_scene *scene);
int draw_style_lights(const struct draw_style *style, const double right[3], patina_scene *scene); // not of NULL
int draw_style_lines(const struct draw_style *style, patina_scene *scene);                         // NULL: none
// Whether its lines or transparency change the passes of depth and source.
int draw_style_moves_surface(const struct draw_style *style);

// ---- sheets --------------------------------------------------------------------------------------------------------

// Where things are on a page, in millimeters from its lower left corner.
struct draw_layout {
    const char *sheet; // its name; NULL: the page is the drawing
    double size[2];    // of the page
    double frame[4];   // left, bottom, right and top of what is inside of it
    double block[2];   // width and height of the title block, in the frame's lower right corner
    double middle[2];  // of the drawing
};

// Fills options, whose files point into the arguments. A tool_exit.
int draw_parse(int count, char **arguments, struct draw_options *options);
// An option with a value: 0; -1: a bad value; 1: no such option. Paths and names point to the value.
int draw_take_value(const char *name, const char *value, struct draw_options *options);
int *draw_switch(const char *name, struct draw_options *options); // where an option without a value is; NULL: there is none
// Whether the options of one drawing go together. shared: of its batch, NULL: it is alone. A tool_exit.
int draw_check(struct draw_options *options, const struct draw_options *shared);
int draw_is_image(const char *path); // by its ending: .png or a TIFF
// A PDF, or an SVG of a sheet: of lines over the image. Other SVGs have lines alone.
int draw_is_page(const struct draw_options *options, const char *path);

int draw_is_sheet(const char *name);
int draw_is_title(const char *text); // FIELD=TEXT: which field, or -1
// Places a drawing of this size, in meters. A tool_exit; says what is wrong.
int draw_place(const struct draw_options *options, const double extent[2], struct draw_layout *layout);

// What a title block states, beside the options.
struct draw_statement {
    double spacing, sigma; // meters; sigma 0: not known
    double filled;         // percent
};
// The frame, the title block, and coordinates around the drawing.
void draw_furnish(const struct draw_image *image, const struct draw_layout *layout, const struct draw_statement *statement,
                  struct page *page);

struct draw_content {
    const struct draw_image *image;
    const struct draw_layout *layout;
    const struct tool_picture *picture;
    const patina_drawing *drawing;
    double spacing; // of points, where the drawing has no cut
};
// The page reads the picture; page_free it in any case. A tool_exit.
int draw_make_page(const struct draw_content *content, struct page *page);

#endif
