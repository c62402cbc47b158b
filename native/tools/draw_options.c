// SPDX-License-Identifier: GPL-3.0-or-later
// The options of `patina draw`.
#include "draw.h"
#include "base/words.h"

#include <math.h>
#include <string.h>

static int parse_plane(const char *text, struct draw_options *options)
{
    static const struct {
        const char *name;
        enum draw_plane plane;
        int least, most;
    } kinds[] = {{"section:", DRAW_SECTION, 4, 4},
                 {"elevation:", DRAW_ELEVATION, 1, 2},
                 {"plan:", DRAW_PLAN, 1, 1},
                 {"frame:", DRAW_FRAME, 9, 9}};
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        const size_t length = strlen(kinds[i].name);
        if (strncmp(text, kinds[i].name, length) != 0)
            continue;
        const int count = parse_numbers(text + length, options->numbers, kinds[i].least, kinds[i].most);
        options->plane = kinds[i].plane;
        options->has_distance = count == 2;
        const double *n = options->numbers;
        return count < 0 || (options->plane == DRAW_SECTION && n[0] == n[2] && n[1] == n[3]) ? -1 : 0;
    }
    return -1;
}

static int parse_positive(const char *text, double *value)
{
    return parse_numbers(text, value, 1, 1) < 0 || !(*value > 0) ? -1 : 0;
}

static const char *ending_of(const char *path)
{
    static const char *const known[] = {".dxf", ".svg", ".geojson", ".pdf", ".png", ".tif", ".tiff"};
    const char *dot = strrchr(path, '.');
    for (size_t i = 0; dot && i < sizeof known / sizeof *known; i++)
        if (pt_same_word(dot, known[i]))
            return known[i];
    return NULL;
}

int draw_is_image(const char *path) { return !strcmp(ending_of(path), ".png") || draw_is_tiff(path); }

int draw_is_page(const struct draw_options *options, const char *path)
{
    return !strcmp(ending_of(path), ".pdf") || (options->sheet && !strcmp(ending_of(path), ".svg"));
}

// EPSG:N, with a code that GeoTIFF takes for a projected system. The usual ones that count degrees are refused.
static int parse_crs(const char *text, uint32_t *epsg)
{
    static const uint32_t degrees[] = {4258, 4267, 4269, 4326, 4979};
    double number;
    if (strncmp(text, "EPSG:", 5) != 0 || parse_numbers(text + 5, &number, 1, 1) < 0 || number != floor(number) ||
        number < 1024 || number > 32766)
        return -1;
    *epsg = (uint32_t)number;
    for (size_t i = 0; i < sizeof degrees / sizeof *degrees; i++)
        if (*epsg == degrees[i])
            return -1;
    return 0;
}

int draw_take_value(const char *name, const char *value, struct draw_options *o)
{
    double number = 0;
    if (!strcmp(name, "-o") || !strcmp(name, "--output")) {
        if (o->output_count == DRAW_OUTPUTS || !*value)
            return -1;
        o->outputs[o->output_count++] = value;
        return 0;
    }
    if (!strcmp(name, "--plane"))
        return parse_plane(value, o);
    if (!strcmp(name, "--extent"))
        return parse_numbers(value, o->extent, 2, 2) < 0 || !(o->extent[0] > 0) || !(o->extent[1] > 0) ? -1 : 0;
    if (!strcmp(name, "--depth")) {
        o->has_depth = 1;
        return parse_numbers(value, o->depth, 2, 2) < 0 || o->depth[0] < 0 || o->depth[1] < 0 ? -1 : 0;
    }
    if (!strcmp(name, "--scale"))
        return parse_positive(value, &o->scale);
    if (!strcmp(name, "--thickness"))
        return parse_positive(value, &o->thickness);
    if (!strcmp(name, "--contours"))
        return parse_positive(value, &o->contours);
    if (!strcmp(name, "--pixel"))
        return parse_positive(value, &o->pixel);
    if (!strcmp(name, "--crs"))
        return parse_crs(value, &o->epsg);
    if (!strcmp(name, "--bits")) {
        o->deep = !strcmp(value, "16");
        return o->deep || !strcmp(value, "8") ? 0 : -1;
    }
    if (!strcmp(name, "--style"))
        return draw_find_style(value, &o->style);
    if (!strcmp(name, "--batch")) {
        o->batch = value;
        return *value ? 0 : -1;
    }
    if (!strcmp(name, "--sheet")) {
        o->sheet = value;
        return 0;
    }
    if (!strcmp(name, "--title")) {
        const int field = draw_is_title(value);
        if (field < 0)
            return -1;
        o->titles[field] = strchr(value, '=') + 1;
        return 0;
    }
    if (!strcmp(name, "--device")) {
        o->device = value;
        return *value ? 0 : -1;
    }
    if (!strcmp(name, "--threads")) {
        const int bad = parse_numbers(value, &number, 1, 1) < 0 || number < 0 || number > 4096 || number != floor(number);
        o->threads = bad ? 0 : (uint32_t)number;
        return bad ? -1 : 0;
    }
    return 1;
}

int *draw_switch(const char *name, struct draw_options *options)
{
    return !strcmp(name, "--flat")        ? &options->flat
           : !strcmp(name, "--outlines")  ? &options->outlines
           : !strcmp(name, "--depth-map") ? &options->depth_map
           : !strcmp(name, "--mask")      ? &options->mask
                                          : NULL;
}

static int take_switch(const char *name, void *options)
{
    int *const on = draw_switch(name, options);
    if (on)
        *on = 1;
    return !on;
}

static int take_value(const char *name, const char *value, void *options) { return draw_take_value(name, value, options); }

static int check_sheet(const struct draw_options *options, int pages)
{
    if (options->sheet && !draw_is_sheet(options->sheet))
        return tool_misuse("--sheet %s: sheets are A0, A1, A2, A3, A4 and Letter", options->sheet);
    if (options->sheet && !pages)
        return tool_misuse("draw: sheets are written as .pdf or .svg: add -o OUT.pdf");
    for (int i = 0; i < DRAW_TITLES; i++) {
        if (options->titles[i] && !options->sheet)
            return tool_misuse("draw: --title is of a sheet: add --sheet A1");
        if (options->titles[i] && !page_can_letter(options->titles[i]))
            tool_say("warning: the letters of sheets are Latin: boxes stand for others in '%s'", options->titles[i]);
    }
    return TOOL_OK;
}

// Leaves out what is shared by all drawings of a batch and means nothing for the outputs of this one.
static void leave_out(const struct draw_options *shared, int tiffs, int pages, struct draw_options *options)
{
    if (!pages && options->sheet == shared->sheet)
        options->sheet = NULL;
    for (int i = 0; i < DRAW_TITLES; i++)
        if (!options->sheet && options->titles[i] == shared->titles[i])
            options->titles[i] = NULL;
    if (!tiffs) {
        options->depth_map &= !shared->depth_map;
        options->mask &= !shared->mask;
        options->deep &= !shared->deep;
    }
}

int draw_check(struct draw_options *options, const struct draw_options *shared)
{
    if (options->plane == DRAW_NO_PLANE)
        return tool_misuse(
            "draw: no plane given; name it with --plane section:X0,Y0,X1,Y1, elevation:AZIMUTH, plan:Z or frame:...");
    if (!options->output_count)
        return tool_misuse(
            "draw: nothing to do; name the drawing with -o OUT.dxf, OUT.svg, OUT.geojson, OUT.pdf, OUT.png or OUT.tif");
    int tiffs = 0, pages = 0, maps = 0;
    for (int i = 0; i < options->output_count; i++) {
        const char *path = options->outputs[i];
        if (!ending_of(path))
            return tool_misuse("-o %s: drawings are written as .dxf, .svg, .geojson, .pdf, .png or .tif", path);
        tiffs += draw_is_tiff(path);
        pages += draw_is_page(options, path);
        maps += !strcmp(ending_of(path), ".geojson");
    }
    if (shared)
        leave_out(shared, tiffs, pages, options);
    if (maps && options->plane != DRAW_PLAN && options->plane != DRAW_FRAME)
        return tool_misuse("draw: GeoJSON is for plans: use --plane plan:Z, or write .dxf");
    if (maps && !options->epsg)
        return tool_misuse(
            "draw: GeoJSON needs the clouds' coordinate system, else its places are taken for degrees: add --crs EPSG:N");
    if (!tiffs && (options->depth_map || options->mask || options->deep))
        return tool_misuse("draw: --depth-map, --mask and --bits 16 are of a GeoTIFF: add -o OUT.tif");
    return check_sheet(options, pages);
}

int draw_parse(int count, char **arguments, struct draw_options *options)
{
    *options = (struct draw_options){.files = arguments, .scale = 50};
    static const struct tool_syntax syntax = {"draw: ", take_switch, take_value};
    const int misused = tool_walk_options(&syntax, count, arguments, options, &options->file_count);
    if (misused)
        return misused;
    if (!options->file_count)
        return tool_misuse("draw: no file given");
    if (options->file_count > DRAW_FILES)
        return tool_misuse("draw: at most %d files", DRAW_FILES);
    if (options->batch && options->output_count)
        return tool_misuse("draw: -o is of one drawing: without --batch, or as \"outputs\" in its file");
    return options->batch ? TOOL_OK : draw_check(options, NULL);
}
