// SPDX-License-Identifier: GPL-3.0-or-later
// Tiles of one still: `patina render --tiles 4x4 --tile N` draws one of them, a border of the whole picture; `patina merge` puts their
// rows beside each other, a row of pixels at a time.
#include "png_errors.h"
#include "tool.h"

#include <setjmp.h>
#include <stdlib.h>
#include <string.h>

const char tool_tile_name[] = "Patina tile";

// Of columns or rows: from `first` to `end`, from the left or the top.
static void cut(uint32_t size, uint32_t count, uint32_t i, uint32_t *first, uint32_t *end)
{
    *first = (uint32_t)((uint64_t)size * i / count);
    *end = (uint32_t)((uint64_t)size * (i + 1) / count);
}

void tool_tile_region(const uint32_t tiles[2], uint32_t tile, uint32_t width, uint32_t height, uint32_t region[4])
{
    uint32_t top, bottom;
    cut(width, tiles[0], (tile - 1) % tiles[0], &region[0], &region[2]);
    cut(height, tiles[1], (tile - 1) / tiles[0], &top, &bottom);
    region[1] = height - bottom; // regions count from the bottom
    region[3] = height - top;
}

void tool_tile_text(const struct tool_options *options, char *text, size_t size)
{
    snprintf(text, size, "%ux%u %u %ux%u %016llx %s", options->tiles[0], options->tiles[1], options->tile,
             options->settings.width, options->settings.height, (unsigned long long)options->digest, patina_version());
}

// ---- merging ---------------------------------------------------------------------------------------------------------

struct tile {
    const char *path; // NULL: missing
    uint32_t tiles[2], number, size[2];
    unsigned long long digest;
    char engine[32];
    uint32_t width, height;
    int alpha;
    // while its rows are read
    FILE *file;
    png_structp state;
    png_infop info;
    char why[TOOL_PNG_WHY];
};

static void close_tile(struct tile *tile)
{
    if (tile->state)
        png_destroy_read_struct(&tile->state, &tile->info, NULL);
    if (tile->file)
        fclose(tile->file);
    tile->file = NULL;
}

static int no_tile(const struct tile *tile)
{
    tool_say("'%s' is no tile of a picture: patina render --tiles ... --tile ... makes them", tile->path);
    return -1;
}

// What the file says of itself.
static int read_text(struct tile *tile)
{
    png_textp texts;
    int count = 0, end = 0;
    png_get_text(tile->state, tile->info, &texts, &count);
    for (int i = 0; i < count; i++)
        if (!strcmp(texts[i].key, tool_tile_name) &&
            sscanf(texts[i].text, "%6ux%6u %u %6ux%6u %16llx %31s%n", &tile->tiles[0], &tile->tiles[1], &tile->number,
                   &tile->size[0], &tile->size[1], &tile->digest, tile->engine, &end) == 7)
            return 0;
    return no_tile(tile);
}

// Opens it; its first row comes next.
static int open_tile(struct tile *tile)
{
    tile->file = pt_stream_open(tile->path, "rb");
    if (!tile->file) {
        tool_say("'%s' cannot be opened", tile->path);
        return -1;
    }
    tile->state = png_create_read_struct(PNG_LIBPNG_VER_STRING, tile->why, tool_png_error, tool_png_warning);
    tile->info = tile->state ? png_create_info_struct(tile->state) : NULL;
    if (!tile->info) {
        tool_say("out of memory");
        return -1;
    }
    if (setjmp(png_jmpbuf(tile->state))) {
        tool_say("'%s' is damaged: %s", tile->path, tile->why);
        return -1;
    }
    png_init_io(tile->state, tile->file);
    png_read_info(tile->state, tile->info);
    const int type = png_get_color_type(tile->state, tile->info);
    tile->width = png_get_image_width(tile->state, tile->info);
    tile->height = png_get_image_height(tile->state, tile->info);
    tile->alpha = type == PNG_COLOR_TYPE_RGB_ALPHA;
    if (png_get_bit_depth(tile->state, tile->info) != 8 || (type != PNG_COLOR_TYPE_RGB && !tile->alpha) ||
        png_get_interlace_type(tile->state, tile->info) != PNG_INTERLACE_NONE)
        return no_tile(tile);
    return read_text(tile);
}

static int read_row(struct tile *tile, uint8_t *row)
{
    if (setjmp(png_jmpbuf(tile->state))) {
        tool_say("'%s' is damaged: %s", tile->path, tile->why);
        return -1;
    }
    png_read_row(tile->state, row, NULL);
    return 0;
}

// Puts a tile where it belongs among those that there shall be.
static int place(const struct tile *tile, struct tile *all, const struct tile *first)
{
    uint32_t region[4];
    if (strcmp(tile->engine, patina_version()) != 0) {
        tool_say("'%s' was drawn by Patina %s; this is %s: draw it anew", tile->path, tile->engine, patina_version());
        return -1;
    }
    if (tile->tiles[0] != first->tiles[0] || tile->tiles[1] != first->tiles[1] || tile->size[0] != first->size[0] ||
        tile->size[1] != first->size[1] || tile->digest != first->digest || tile->alpha != first->alpha) {
        tool_say("'%s' and '%s' are of different pictures", tile->path, first->path);
        return -1;
    }
    if (!tile->number || tile->number > tile->tiles[0] * tile->tiles[1])
        return no_tile(tile);
    tool_tile_region(tile->tiles, tile->number, tile->size[0], tile->size[1], region);
    if (tile->width != region[2] - region[0] || tile->height != region[3] - region[1])
        return no_tile(tile);
    if (all[tile->number - 1].path) {
        tool_say("'%s' and '%s' are both tile %u", all[tile->number - 1].path, tile->path, tile->number);
        return -1;
    }
    all[tile->number - 1] = *tile;
    return 0;
}

// Looks at every file's head. Returns the tiles in order, or NULL after a message.
static struct tile *list_tiles(int count, char **paths)
{
    struct tile *all = NULL, first = {0};
    int bad = 0;
    for (int i = 0; i < count && !bad; i++) {
        struct tile tile = {.path = paths[i]};
        bad = open_tile(&tile);
        close_tile(&tile);
        tile.state = NULL;
        tile.info = NULL;
        if (bad)
            break;
        if (!i) {
            first = tile;
            const uint64_t most = (uint64_t)tile.tiles[0] * tile.tiles[1];
            bad = !most || most > TOOL_TILES ? no_tile(&tile) : 0;
            all = bad ? NULL : calloc(most, sizeof *all);
            if (!bad && !all)
                tool_say("out of memory");
            bad |= !all;
        }
        bad = bad || place(&tile, all, &first);
    }
    for (uint32_t i = 0; !bad && i < first.tiles[0] * first.tiles[1]; i++)
        if (!all[i].path) {
            tool_say("tile %u of %ux%u is missing", i + 1, first.tiles[0], first.tiles[1]);
            bad = 1;
        }
    if (bad) {
        free(all);
        return NULL;
    }
    return all;
}

// The tiles beside each other, row by row.
static int write_band(struct tool_png *png, struct tile *band, uint32_t columns, uint8_t *row)
{
    int bad = 0;
    for (uint32_t i = 0; i < columns && !bad; i++)
        bad = open_tile(&band[i]);
    for (uint32_t y = 0; y < band[0].height && !bad && !(bad = tool_cancelled()); y++) {
        uint8_t *at = row;
        for (uint32_t i = 0; i < columns && !bad; i++) {
            bad = read_row(&band[i], at);
            at += (size_t)band[i].width * (band[i].alpha ? 4 : 3);
        }
        bad = bad || tool_png_bytes(png, row);
    }
    for (uint32_t i = 0; i < columns; i++)
        close_tile(&band[i]);
    return bad;
}

int tool_merge_tiles(int count, char **paths, const char *output)
{
    struct tile *tiles = list_tiles(count, paths);
    if (!tiles)
        return TOOL_FAILED;
    const uint32_t columns = tiles->tiles[0], rows = tiles->tiles[1], width = tiles->size[0], height = tiles->size[1];
    uint8_t *row = malloc(4 * (size_t)width);
    struct tool_png *png = row ? tool_png_open(output, width, height, tiles->alpha, NULL, NULL) : NULL;
    int bad = !png;
    for (uint32_t y = 0; y < rows && !bad; y++)
        bad = write_band(png, tiles + (size_t)y * columns, columns, row);
    if (png && (tool_png_close(png, !bad)))
        bad = 1;
    free(row);
    free(tiles);
    if (!bad)
        tool_say("%s: %ux%u of %ux%u tiles", output, width, height, columns, rows);
    return !bad ? TOOL_OK : tool_cancelled() ? TOOL_CANCELLED : TOOL_FAILED;
}
