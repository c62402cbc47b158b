// SPDX-License-Identifier: GPL-3.0-or-later
// Options of what several machines draw: tiles, strips and parts, and what goes with them.
#include "tool.h"

#include <stdio.h>
#include <string.h>

// Two counts with a character between them. 0, or -1.
static int parse_pair(const char *text, char between, uint32_t most, uint32_t out[2])
{
    char middle, rest;
    if (text[0] < '0' || text[0] > '9' || sscanf(text, "%6u%c%6u%c", &out[0], &middle, &out[1], &rest) != 3)
        return -1;
    return middle == between && out[0] && out[1] && out[0] <= most && out[1] <= most ? 0 : -1;
}

static int parse_number(const char *text, uint32_t *out)
{
    char rest;
    return text[0] < '0' || text[0] > '9' || sscanf(text, "%9u%c", out, &rest) != 1 || !*out ? -1 : 0;
}

int tool_parse_farm(const char *name, const char *value, struct tool_options *options)
{
    if (!strcmp(name, "--tiles"))
        return parse_pair(value, 'x', 4096, options->tiles) || (uint64_t)options->tiles[0] * options->tiles[1] > TOOL_TILES ? -1
                                                                                                                            : 0;
    if (!strcmp(name, "--tile"))
        return parse_number(value, &options->tile);
    if (!strcmp(name, "--strip"))
        return parse_number(value, &options->strip);
    if (!strcmp(name, "--part"))
        return parse_pair(value, '/', 65536, options->part) || options->part[0] > options->part[1] ? -1 : 0;
    if (!strcmp(name, "--behind"))
        return *(options->behind = value) ? 0 : -1;
    return 1;
}

// What is found of a whole picture, and would be another of each tile's.
static const char *of_the_whole(const struct tool_options *options)
{
    return options->panorama[0]                ? "--panorama"
           : options->settings.pixel_noise > 0 ? "--noise"
           : options->pass != PATINA_PASS_COMBINED && !options->has_pass_range && options->pass != PATINA_PASS_NORMAL &&
                   options->pass != PATINA_PASS_TRUST && options->pass != PATINA_PASS_SHADOW &&
                   options->pass != PATINA_PASS_LINE
               ? "--pass without its range"
           : options->repeat || options->json ? "--repeat and --stats"
           : options->planes                  ? "--dump-planes"
                                              : NULL;
}

int tool_may_strip(const struct tool_options *options) { return options->output && !of_the_whole(options); }

static int check_scatter(const struct tool_options *options)
{
    const char *other = of_the_whole(options);
    if (!options->part[0])
        return tool_misuse("scatter: which part? --part 1/4");
    if (!options->output)
        return tool_misuse("scatter: name the file of keys with -o K.keys");
    if (options->tile || options->strip)
        return tool_misuse("scatter: parts are of a whole picture, without --tile and --strip");
    if (other && strcmp(other, "--pass without its range") != 0)
        return tool_misuse("scatter: parts are of one picture, without %s", other);
    if (options->save_shadows || options->load_shadows)
        return tool_misuse("scatter: parts exchange light maps, without kept shadows");
    return TOOL_OK;
}

int tool_check_farm(struct tool_options *options, int scatters)
{
    patina_settings *settings = &options->settings;
    if (scatters)
        return check_scatter(options);
    if (options->part[0] || options->behind)
        return tool_misuse("--part and --behind are of `patina scatter`");
    if (!options->tile != !options->tiles[0])
        return tool_misuse("--tiles says how many there are, --tile which: both, please");
    if (!options->tile && !options->strip)
        return TOOL_OK;
    if (!options->output)
        return tool_misuse("tiles and strips are pictures: -o OUT.png");
    if (of_the_whole(options))
        return tool_misuse("tiles and strips know nothing of the whole: without %s", of_the_whole(options));
    if (!options->tile)
        return TOOL_OK;
    if (settings->region[2])
        return tool_misuse("a tile is a region: without --region");
    if (options->tile > options->tiles[0] * options->tiles[1])
        return tool_misuse("there is no tile %u of %ux%u", options->tile, options->tiles[0], options->tiles[1]);
    if (options->tiles[0] > settings->width || options->tiles[1] > settings->height)
        return tool_misuse("a picture of %ux%u has no %ux%u tiles", settings->width, settings->height, options->tiles[0],
                           options->tiles[1]);
    tool_tile_region(options->tiles, options->tile, settings->width, settings->height, settings->region);
    return TOOL_OK;
}
