// SPDX-License-Identifier: GPL-3.0-or-later
// A page of paper: lines and fills in millimeters from its lower left corner, over one image. Written as PDF or SVG.
#ifndef TOOL_PAGE_H
#define TOOL_PAGE_H

#include "tool.h"

// Rows of 8-bit sRGB from the top, each behind a byte that names its PNG filter, deflated. PDF and PNG both store these bytes.
struct tool_picture {
    uint32_t width, height;
    uint8_t *packed;
    size_t size, room;
    void *state; // of zlib
    uint8_t *row;
};

// 0, or -1 after a message.
int tool_picture_begin(struct tool_picture *picture, uint32_t width, uint32_t height);
// Premultiplied linear RGBA, row 0 at the bottom, over white.
int tool_picture_rows(struct tool_picture *picture, const float *pixels, uint32_t rows);
int tool_picture_end(struct tool_picture *picture);
void tool_picture_free(struct tool_picture *picture);

enum { PAGE_IMAGE = PATINA_DRAWING_LAYERS, PAGE_LAYERS };

extern const struct page_layer {
    const char *name;
    double weight; // millimeters
    int dashed;
} page_layers[PAGE_LAYERS];

struct page_shape {
    uint32_t layer; // patina_drawing_layer
    uint32_t first, count;
    int closed, filled;
    double width; // of the line, millimeters
};

struct page {
    double size[2];
    double scale;    // N of 1:N
    double drawn[4]; // left, bottom, right and top of what is at this scale
    const char *title;
    const struct tool_picture *picture; // NULL: none
    double image[4];                    // left, bottom, width and height
    struct page_shape *shapes;
    double (*points)[2];
    size_t shape_count, shape_room, point_count, point_room;
    int failed; // for lack of memory; page_write says so
};

// Begins a line or a fill, of which page_point adds points. width 0: the layer's.
void page_shape(struct page *page, uint32_t layer, double width, int closed, int filled);
void page_point(struct page *page, double x, double y);
void page_line(struct page *page, uint32_t layer, double width, double x0, double y0, double x1, double y1);
void page_box(struct page *page, uint32_t layer, double width, int filled, const double corners[4]); // left, bottom, right, top
void page_free(struct page *page);
// A .pdf or .svg, whole or not at all. 0, or -1 after a message.
int page_write(const struct page *page, const char *path);
// To an open stream. 0, or -1 if there is no memory.
int page_write_pdf(const struct page *page, FILE *file);
int page_write_svg(const struct page *page, FILE *file);
// The code point that a text begins with; *text moves behind it. Bytes that are not UTF-8 are U+FFFD.
uint32_t page_code_point(const char **text);

// Text of single strokes, as drafting has it, on the layer of texts.
struct lettering {
    double x, y;   // of its baseline
    double height; // of capitals, millimeters
    double anchor; // 0: begins at x, 0.5: its middle is there, 1: ends there
    double most;   // millimeters; longer text is drawn narrower, then smaller. 0: any
    int turned;    // upwards
};
void page_letter(struct page *page, const char *text, const struct lettering *at);
// Whether there is a letter for each character. Others are drawn as a box.
int page_can_letter(const char *text);

#endif
