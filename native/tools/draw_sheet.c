// SPDX-License-Identifier: GPL-3.0-or-later
// Sheets of `patina draw`: their sizes, and where a drawing has room on one.
#include "draw.h"
#include "base/words.h"

#include <math.h>
#include <string.h>

#define BINDING 20.0 // left of the frame, millimeters
#define EDGE 10.0    // on the other sides
#define BLOCK_WIDTH 180.0
#define BLOCK_HEIGHT 60.0
#define AROUND 8.0       // a drawing, for its coordinates
#define MOST_PAGE 5080.0 // what readers of PDF take: 14400 points

static const struct sheet {
    const char *name;
    double wide, high; // millimeters, landscape
} sheets[] = {{"Letter", 279.4, 215.9}, {"A4", 297, 210}, {"A3", 420, 297},
              {"A2", 594, 420},         {"A1", 841, 594}, {"A0", 1189, 841}};
enum { SHEETS = sizeof sheets / sizeof *sheets };

static const double scales[] = {1,   2,    5,    10,   20,   25,    50,    100,   200,   250,
                                500, 1000, 2000, 2500, 5000, 10000, 20000, 25000, 50000, 100000};

static const char *const titles[DRAW_TITLES] = {"title", "project", "author", "number", "date"};

static const struct sheet *find(const char *name)
{
    for (int i = 0; i < SHEETS; i++)
        if (pt_same_word(name, sheets[i].name))
            return &sheets[i];
    return NULL;
}

int draw_is_sheet(const char *name) { return find(name) != NULL; }

int draw_is_title(const char *text)
{
    for (int i = 0; i < DRAW_TITLES; i++) {
        const size_t length = strlen(titles[i]);
        if (!strncmp(text, titles[i], length) && text[length] == '=')
            return i;
    }
    return -1;
}

static void set_page(const struct sheet *sheet, int upright, struct draw_layout *layout)
{
    layout->sheet = sheet->name;
    layout->size[0] = upright ? sheet->high : sheet->wide;
    layout->size[1] = upright ? sheet->wide : sheet->high;
    layout->frame[0] = BINDING;
    layout->frame[1] = EDGE;
    layout->frame[2] = layout->size[0] - EDGE;
    layout->frame[3] = layout->size[1] - EDGE;
    layout->block[0] = fmin(BLOCK_WIDTH, layout->frame[2] - layout->frame[0]);
    layout->block[1] = BLOCK_HEIGHT;
}

// Above the title block, or left of it. Whether there is room.
static int fits(const double needed[2], struct draw_layout *layout)
{
    const double *frame = layout->frame;
    const double wide = frame[2] - frame[0], high = frame[3] - frame[1],
                 rest[2] = {wide - layout->block[0], high - layout->block[1]};
    const int above = needed[0] <= wide + 1e-9 && needed[1] <= rest[1] + 1e-9;
    layout->middle[0] = frame[0] + 0.5 * (above ? wide : rest[0]);
    layout->middle[1] = frame[3] - 0.5 * (above ? rest[1] : high);
    return above || (needed[0] <= rest[0] + 1e-9 && needed[1] <= high + 1e-9);
}

// Turns the sheet as the drawing is, or else the other way. Whether there is room.
static int place(const struct sheet *sheet, const double extent[2], double scale, struct draw_layout *layout)
{
    double needed[2];
    for (int k = 0; k < 2; k++)
        needed[k] = 1000 * extent[k] / scale + 2 * AROUND;
    const int upright = needed[1] > needed[0];
    for (int turned = 0; turned < 2; turned++) {
        set_page(sheet, upright != turned, layout);
        if (fits(needed, layout))
            return 1;
    }
    set_page(sheet, upright, layout);
    return 0;
}

// Says what would have room.
static int refuse(const struct draw_options *options, const double extent[2], const struct draw_layout *layout)
{
    const struct sheet *larger = find(options->sheet) + 1;
    struct draw_layout other;
    char sheet[32] = "", scale[64] = "";
    while (larger < sheets + SHEETS && !place(larger, extent, options->scale, &other))
        larger++;
    if (larger < sheets + SHEETS)
        snprintf(sheet, sizeof sheet, "%s or ", larger->name);
    for (size_t i = 0; i < sizeof scales / sizeof *scales && !scale[0]; i++)
        if (scales[i] > options->scale && place(find(options->sheet), extent, scales[i], &other))
            snprintf(scale, sizeof scale, "1:%g", scales[i]);
    tool_say("draw: 1:%g needs %.0f x %.0f mm with its coordinates; %s has %.0f x %.0f, of which the title block takes %.0f x "
             "%.0f: use %s%s",
             options->scale, ceil(1000 * extent[0] / options->scale + 2 * AROUND - 1e-6),
             ceil(1000 * extent[1] / options->scale + 2 * AROUND - 1e-6), layout->sheet, layout->frame[2] - layout->frame[0],
             layout->frame[3] - layout->frame[1], layout->block[0], layout->block[1], sheet,
             scale[0] ? scale : "a smaller scale");
    return TOOL_FAILED;
}

int draw_place(const struct draw_options *options, const double extent[2], struct draw_layout *layout)
{
    *layout = (struct draw_layout){0};
    if (options->sheet)
        return place(find(options->sheet), extent, options->scale, layout) ? TOOL_OK : refuse(options, extent, layout);
    for (int k = 0; k < 2; k++) {
        layout->size[k] = 1000 * extent[k] / options->scale;
        layout->middle[k] = 0.5 * layout->size[k];
    }
    if (!(layout->size[0] <= MOST_PAGE) || !(layout->size[1] <= MOST_PAGE)) {
        tool_say("draw: 1:%g needs %.0f x %.0f mm, and a PDF has at most %.0f x %.0f: make --scale larger, or --extent smaller",
                 options->scale, layout->size[0], layout->size[1], MOST_PAGE, MOST_PAGE);
        return TOOL_FAILED;
    }
    return TOOL_OK;
}
