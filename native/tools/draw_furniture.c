// SPDX-License-Identifier: GPL-3.0-or-later
// What is around the drawing on a sheet: the frame, the title block with a scale bar and north, and coordinates.
#include "draw.h"

#include <math.h>
#include <stdarg.h>
#include <string.h>

#define THIN 0.18
#define SMALL 1.8 // height of letters, millimeters
#define PLAIN 2.5
#define LARGE 5.0
#define PAD 1.5
#define GRID_LEAST 40.0 // between coordinates
#define BAR_MOST 100.0
enum { BAR_PARTS = 5 };

static void letter(struct page *page, const char *text, double x, double y, double height, double anchor)
{
    page_letter(page, text, &(struct lettering){.x = x, .y = y, .height = height, .anchor = anchor});
}

// 1, 2 or 5 times a power of ten: the least one of at least `least`. decimals: that it is written with.
static double round_up(double least, int *decimals)
{
    double ten = pow(10, floor(log10(least)));
    static const double steps[] = {1, 2, 5, 10};
    int i = 0;
    while (i < 3 && steps[i] * ten < least * (1 - 1e-9))
        i++;
    const double step = steps[i] * ten;
    const double digits = ceil(-log10(step) - 1e-9);
    *decimals = digits > 0 ? (int)digits : 0;
    return step;
}

// ---- the title block ---------------------------------------------------------------------------------------------

// A field: its name small in the upper left corner, its text below. corners: left, bottom, right, top.
static void put_field(struct page *page, const double corners[4], const char *name, const char *text)
{
    const double height = corners[3] - corners[1] > 10 ? LARGE : PLAIN;
    page_box(page, PATINA_DRAWING_TEXT, THIN, 0, corners);
    letter(page, name, corners[0] + PAD, corners[3] - PAD - SMALL + 0.2, SMALL, 0);
    page_letter(page, text,
                &(struct lettering){.x = corners[0] + PAD,
                                    .y = corners[1] + PAD + (height > PLAIN ? 0.8 : 0),
                                    .height = height,
                                    .most = corners[2] - corners[0] - 2 * PAD});
}

static void put_bar(struct page *page, double left, double bottom)
{
    const double meter = 1000 / page->scale; // on paper
    int decimals;
    double step = round_up(BAR_MOST / BAR_PARTS / meter, &decimals);
    if (BAR_PARTS * step * meter > BAR_MOST * (1 + 1e-9)) // the next smaller one
        step = round_up(step / 2.5 * (1 - 1e-6), &decimals);
    char text[40];
    for (int i = 0; i <= BAR_PARTS; i++) {
        const double x = left + i * step * meter;
        snprintf(text, sizeof text, "%.*f%s", decimals, i * step, i == BAR_PARTS ? " m" : "");
        letter(page, text, x, bottom + 3, SMALL, i ? 0.5 : 0.2);
        if (i < BAR_PARTS)
            page_box(page, PATINA_DRAWING_TEXT, THIN, i % 2 == 0, (const double[4]){x, bottom, x + step * meter, bottom + 1.6});
    }
    page_box(page, PATINA_DRAWING_TEXT, THIN, 0,
             (const double[4]){left, bottom, left + BAR_PARTS * step * meter, bottom + 1.6});
}

// north: on paper, of length 1.
static void put_north(struct page *page, double x, double y, const double north[2])
{
    static const double arrow[2][3][2] = {{{0, 6}, {-2, -4}, {0, -2.5}}, {{0, 6}, {2, -4}, {0, -2.5}}}; // filled, then not
    for (int half = 0; half < 2; half++) {
        page_shape(page, PATINA_DRAWING_TEXT, THIN, 1, half == 0);
        for (int i = 0; i < 3; i++) {
            const double *p = arrow[half][i];
            page_point(page, x + north[1] * p[0] + north[0] * p[1], y - north[0] * p[0] + north[1] * p[1]);
        }
    }
    letter(page, "N", x + 6 * north[1] - 1 * north[0], y - 6 * north[0] - 1 * north[1] - 1.25, PLAIN, 0.5);
}

static const char *base_name(const char *path)
{
    for (const char *at = path; *at; at++)
        if (*at == '/' || *at == '\\')
            path = at + 1;
    return path;
}

static void put_block(const struct draw_image *image, const struct draw_layout *layout, const struct draw_statement *statement,
                      struct page *page)
{
    const struct draw_options *options = image->options;
    char scale[64], source[512], spacing[64], accuracy[128], filled[64], program[64];
    snprintf(scale, sizeof scale, "1:%g", options->scale);
    snprintf(source, sizeof source, options->file_count > 1 ? "%.400s and %d more" : "%.400s", base_name(options->files[0]),
             options->file_count - 1);
    snprintf(spacing, sizeof spacing, "%.2g mm", 1e3 * statement->spacing);
    if (statement->sigma > 0)
        snprintf(accuracy, sizeof accuracy, "noise %.2g mm; 1:%g allows %.2g mm", 1e3 * statement->sigma, options->scale,
                 0.18 * options->scale);
    else
        snprintf(accuracy, sizeof accuracy, "1:%g allows %.2g mm", options->scale, 0.18 * options->scale);
    snprintf(filled, sizeof filled, "%.1f %%", statement->filled);
    snprintf(program, sizeof program, "Patina %s", patina_version());
    const char *const *titles = options->titles;
    // Rows from the top: in a row, fields up to a share of the width.
    const struct field {
        double height, until;
        const char *name, *text;
    } fields[] = {{14, 1, "TITLE", titles[DRAW_TITLE]},
                  {8, 0.7, "PROJECT", titles[DRAW_PROJECT]},
                  {8, 1, "NUMBER", titles[DRAW_NUMBER]},
                  {8, 0.45, "AUTHOR", titles[DRAW_AUTHOR]},
                  {8, 0.7, "DATE", titles[DRAW_DATE]},
                  {8, 1, "SCALE", scale},
                  {8, 0.7, "SOURCE", source},
                  {8, 1, "POINT SPACING", spacing},
                  {8, 0.45, "ACCURACY", accuracy},
                  {8, 0.7, "FILLED SURFACE", filled},
                  {8, 1, "DRAWN BY", program}};
    const double left = layout->frame[2] - layout->block[0], width = layout->block[0];
    double top = layout->frame[1] + layout->block[1], from = 0;
    page_box(page, PATINA_DRAWING_FRAME, 0.35, 0, (const double[4]){left, layout->frame[1], layout->frame[2], top});
    for (size_t i = 0; i < sizeof fields / sizeof *fields; i++) {
        const struct field *f = &fields[i];
        put_field(page, (const double[4]){left + from * width, top - f->height, left + f->until * width, top}, f->name,
                  f->text ? f->text : "");
        from = f->until < 1 ? f->until : 0;
        top -= f->until < 1 ? 0 : f->height;
    }
    double along[2][2], middle[2];
    put_bar(page, left + 8, layout->frame[1] + 4);
    if (draw_coordinates(image, along, middle))
        put_north(page, layout->frame[2] - 16, layout->frame[1] + 0.5 * (top - layout->frame[1]), along[1]);
}

// ---- coordinates -------------------------------------------------------------------------------------------------

struct grid {
    struct page *page;
    const double *corners; // of the drawing on paper: left, bottom, right, top
    double meter;          // on paper
    double along[2][2];    // of coordinates on paper
    double zero[2];        // coordinates in the lower left corner
    double step;
    int decimals;
};

static double coordinate(const struct grid *grid, int axis, double x, double y)
{
    return grid->zero[axis] +
           (grid->along[axis][0] * (x - grid->corners[0]) + grid->along[axis][1] * (y - grid->corners[1])) / grid->meter;
}

// Ticks along an edge of the drawing, inwards, where a coordinate is a multiple of the step. side: 0 to 3, as corners are.
static void put_ticks(const struct grid *grid, int side, int axis, int labelled)
{
    enum { TICK = 3 };
    const double *c = grid->corners;
    const int upright = side % 2 == 0, other = 1 - axis;
    const double begin[2] = {upright ? c[side] : c[0], upright ? c[1] : c[side]};
    const double end[2] = {upright ? c[side] : c[2], upright ? c[3] : c[side]};
    const double from = coordinate(grid, axis, begin[0], begin[1]), to = coordinate(grid, axis, end[0], end[1]);
    const double low = fmin(from, to), high = fmax(from, to);
    double line[2] = {grid->along[other][0], grid->along[other][1]}; // along which the coordinate stays
    const double inwards = (side < 2 ? 1 : -1) * line[upright ? 0 : 1];
    if (!(high > low) || !(fabs(inwards) > 0.1))
        return;
    for (double n = ceil(low / grid->step - 1e-9); n * grid->step <= high + 1e-9 * grid->step; n++) {
        const double t = (n * grid->step - from) / (to - from);
        const double x = begin[0] + t * (end[0] - begin[0]), y = begin[1] + t * (end[1] - begin[1]);
        const double length = TICK / inwards;
        char text[40];
        page_line(grid->page, PATINA_DRAWING_TEXT, THIN, x, y, x + length * line[0], y + length * line[1]);
        snprintf(text, sizeof text, "%.*f", grid->decimals, n * grid->step + 0.0); // no -0
        if (labelled)
            page_letter(grid->page, text,
                        &(struct lettering){.x = upright ? x - 2 : x,
                                            .y = upright ? y : y - 2 - SMALL,
                                            .height = SMALL,
                                            .anchor = 0.5,
                                            .turned = upright});
    }
}

// A small cross where two multiples meet.
static void put_crosses(const struct grid *grid)
{
    const double *c = grid->corners;
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 2; k++) {
            const double value = coordinate(grid, k, c[i & 1 ? 2 : 0], c[i & 2 ? 3 : 1]);
            low[k] = fmin(low[k], value);
            high[k] = fmax(high[k], value);
        }
    for (double i = ceil(low[0] / grid->step); i * grid->step <= high[0]; i++)
        for (double j = ceil(low[1] / grid->step); j * grid->step <= high[1]; j++) {
            const double u = (i * grid->step - grid->zero[0]) * grid->meter, v = (j * grid->step - grid->zero[1]) * grid->meter;
            const double x = c[0] + grid->along[0][0] * u + grid->along[1][0] * v,
                         y = c[1] + grid->along[0][1] * u + grid->along[1][1] * v;
            if (x < c[0] + 5 || x > c[2] - 5 || y < c[1] + 5 || y > c[3] - 5)
                continue;
            for (int k = 0; k < 2; k++) {
                const double dx = 1.5 * grid->along[k][0], dy = 1.5 * grid->along[k][1];
                page_line(grid->page, PATINA_DRAWING_TEXT, THIN, x - dx, y - dy, x + dx, y + dy);
            }
        }
}

void draw_furnish(const struct draw_image *image, const struct draw_layout *layout, const struct draw_statement *statement,
                  struct page *page)
{
    struct grid grid = {.page = page, .corners = page->drawn, .meter = 1000 / page->scale};
    page_box(page, PATINA_DRAWING_FRAME, 0, 0, layout->frame);
    page_box(page, PATINA_DRAWING_TEXT, THIN, 0, page->drawn);
    draw_coordinates(image, grid.along, grid.zero);
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 2; k++)
            grid.zero[i] -= 0.5 * grid.along[i][k] * image->desc->extent[k];
    grid.step = round_up(GRID_LEAST / grid.meter, &grid.decimals);
    const int across = fabs(grid.along[0][0]) < fabs(grid.along[1][0]); // the coordinate that grows along the lower edge
    for (int side = 0; side < 4; side++)
        put_ticks(&grid, side, side % 2 ? across : 1 - across, side < 2);
    put_crosses(&grid);
    put_block(image, layout, statement, page);
}
