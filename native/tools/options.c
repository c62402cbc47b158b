// SPDX-License-Identifier: GPL-3.0-or-later
// The options of `patina render`: one table, one parser by kind of value.
#include "tool.h"
#include "base/words.h"

#include <errno.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_REPEAT = 100000 };

int parse_numbers(const char *text, double *numbers, int least, int most)
{
    int count = 0;
    for (const char *at = text;; at++) {
        char *end;
        if (count == most)
            return -1;
        numbers[count] = strtod(at, &end);
        if (end == at || !isfinite(numbers[count]))
            return -1;
        count++;
        at = end;
        if (!*at)
            break;
        if (*at != ',')
            return -1;
    }
    return count < least ? -1 : count;
}

static int parse_count(const char *text, uint32_t least, uint32_t most, uint32_t *value)
{
    char *end;
    errno = 0;
    const unsigned long number = strtoul(text, &end, 10);
    if (text[0] < '0' || text[0] > '9' || *end || errno || number < least || number > most)
        return -1;
    *value = (uint32_t)number;
    return 0;
}

// Bytes, of at least a megabyte: 500M, 2G, 1.5G.
int tool_parse_memory(const char *text, uint64_t *bytes)
{
    char *end;
    const double number = strtod(text, &end);
    const double unit = !*end || end[1] ? 0.0 : *end == 'M' ? 1e6 : *end == 'G' ? 1e9 : *end == 'T' ? 1e12 : 0.0;
    if (!(number * unit >= 1e6) || !(number * unit < 1e18))
        return -1;
    *bytes = (uint64_t)(number * unit);
    return 0;
}

static int parse_size(const char *text, uint32_t *out_width, uint32_t *out_height)
{
    unsigned width, height;
    char rest;
    if (sscanf(text, "%6ux%6u%c", &width, &height, &rest) != 2)
        return -1;
    if (!width || !height || width > TOOL_MOST_SIZE || height > TOOL_MOST_SIZE)
        return -1;
    *out_width = width;
    *out_height = height;
    return 0;
}

// words: a list separated by |; value: the word's place.
static int parse_word(const char *text, const char *words, uint32_t *value)
{
    const size_t length = strlen(text);
    uint32_t place = 0;
    for (const char *at = words; at; place++) {
        const char *end = strchr(at, '|');
        const size_t size = end ? (size_t)(end - at) : strlen(at);
        if (size == length && !memcmp(at, text, length)) {
            *value = place;
            return 0;
        }
        at = end ? end + 1 : NULL;
    }
    return -1;
}

static int parse_camera(const char *text, struct tool_options *options)
{
    double n[3] = {0};
    if (parse_numbers(text, n, 2, 3) < 0 || n[1] < -90 || n[1] > 90 || n[2] < 0 || n[2] >= 180)
        return -1;
    options->view = VIEW_ANGLES;
    options->azimuth = n[0];
    options->elevation = n[1];
    options->fov = n[2];
    return 0;
}

static int parse_look(const char *text, struct tool_options *options)
{
    double n[7] = {0};
    if (parse_numbers(text, n, 6, 7) < 0 || n[6] < 0 || n[6] >= 180)
        return -1;
    if (n[0] == n[3] && n[1] == n[4] && n[2] == n[5])
        return -1;
    options->view = VIEW_LOOK;
    memcpy(options->eye, n, sizeof options->eye);
    memcpy(options->target, n + 3, sizeof options->target);
    options->fov = n[6];
    return 0;
}

static int parse_region(const char *text, uint32_t region[4])
{
    double n[4];
    if (parse_numbers(text, n, 4, 4) < 0)
        return -1;
    for (int i = 0; i < 4; i++) {
        if (n[i] < 0 || n[i] > TOOL_MOST_SIZE || n[i] != floor(n[i]))
            return -1;
        region[i] = (uint32_t)n[i];
    }
    return region[0] < region[2] && region[1] < region[3] ? 0 : -1;
}

static int parse_error(const char *text, float *target)
{
    double n;
    if (parse_numbers(text, &n, 1, 1) < 0 || !(n > 0 && n <= 1))
        return -1;
    *target = (float)n;
    return 0;
}

static int parse_color(const char *text, float color[3])
{
    double n[3];
    if (parse_numbers(text, n, 3, 3) < 0)
        return -1;
    for (int i = 0; i < 3; i++) {
        if (n[i] < 0 || n[i] > 65504)
            return -1;
        color[i] = (float)n[i];
    }
    return 0;
}

static int parse_opacity(const char *text, struct tool_options *options)
{
    options->opacity_count = parse_numbers(text, options->opacity, 1, TOOL_OPACITIES);
    for (int i = 0; i < options->opacity_count; i++)
        if (options->opacity[i] < 0 || options->opacity[i] > 1)
            return -1;
    return options->opacity_count < 0 ? -1 : 0;
}

static int parse_sun(const char *text, struct tool_options *options)
{
    double n[3] = {0};
    if (parse_numbers(text, n, 2, 3) < 0 || n[1] < -90 || n[1] > 90 || n[2] < 0 || n[2] > 180)
        return -1;
    options->sun = 1;
    memcpy(options->sun_at, n, sizeof options->sun_at);
    return 0;
}

static int parse_width(const char *text, double *width) { return parse_numbers(text, width, 1, 1) < 0 || *width <= 0 ? -1 : 0; }

enum outcome { GOOD = 0, BAD_VALUE = -1, UNKNOWN = 1 };

// Switches without a value. Returns 0 when name is one.
static int parse_switch(const char *name, struct tool_options *options)
{
    if (!strcmp(name, "--lit"))
        options->lighting = PATINA_LIGHTING_LIT;
    else if (!strcmp(name, "--unlit"))
        options->lighting = PATINA_LIGHTING_UNLIT;
    else if (!strcmp(name, "--cull"))
        options->cull = 1;
    else if (!strcmp(name, "--transparent"))
        options->transparent = 1;
    else if (!strcmp(name, "--average"))
        options->settings.average = 1;
    else if (!strcmp(name, "--keep-colors"))
        options->color.keep_colors = 1;
    else if (!strcmp(name, "--no-balance"))
        options->color.unbalanced = 1;
    else if (!strcmp(name, "--shadows"))
        options->shadows = 1;
    else if (!strcmp(name, "--headlight"))
        options->headlight = 1;
    else if (!strcmp(name, "--dump-plan"))
        options->dump_plan = 1;
    else if (!strcmp(name, "--verbose"))
        options->verbose = 1;
    else
        return -1;
    return 0;
}

int tool_is_switch(const char *name)
{
    struct tool_options ignored;
    return !strcmp(name, "--grid") || !strcmp(name, "--flat") || !strcmp(name, "--depth-map") || !strcmp(name, "--mask") ||
           !strcmp(name, "--outlines") || !parse_switch(name, &ignored);
}

// Of silhouettes. All but --lines itself shape those that it asks for.
static enum outcome parse_line_option(const char *name, const char *value, struct tool_options *o)
{
    patina_lines *lines = &o->lines;
    double n[3] = {0};
    int count, bad = 0;
    if (!strcmp(name, "--lines")) {
        count = parse_numbers(value, n, 1, 3);
        bad = count < 1 || n[0] <= 0 || n[1] < 0 || n[1] > 1 || n[2] < 0 || n[2] > 1;
        o->has_lines = 1;
        lines->width = (float)n[0];
        lines->soft = (float)n[1];
        lines->transparency = (float)(count > 2 ? 1 - n[2] : 0);
    } else if (!strcmp(name, "--line-units"))
        bad = parse_word(value, "pixels|world", &lines->world);
    else if (!strcmp(name, "--line-color"))
        bad = parse_color(value, lines->color);
    else if (!strcmp(name, "--line-source"))
        bad = parse_word(value, "fixed|point|depth", &lines->source);
    else if (!strcmp(name, "--line-far"))
        bad = parse_color(value, lines->far_color);
    else if (!strcmp(name, "--line-surface"))
        bad = parse_word(value, "shown|paper|none", &lines->surface);
    else if (!strcmp(name, "--line-offset")) {
        bad = parse_numbers(value, n, 1, 1) < 0 || n[0] < 0;
        lines->offset = (float)n[0];
    } else if (!strcmp(name, "--line-range")) {
        bad = parse_numbers(value, n, 2, 2) < 0 || n[0] >= n[1];
        lines->range[0] = (float)n[0];
        lines->range[1] = (float)n[1];
    } else
        return UNKNOWN;
    o->line_options |= strcmp(name, "--lines") != 0;
    return bad ? BAD_VALUE : GOOD;
}

static enum outcome parse_valued(const char *name, const char *value, struct tool_options *o)
{
    patina_settings *s = &o->settings;
    uint32_t number = 0;
    double n[1] = {0};
    int bad;
    if (!strcmp(name, "-o") || !strcmp(name, "--output"))
        bad = !*(o->output = value);
    else if (!strcmp(name, "--dump-planes"))
        bad = !*(o->planes = value);
    else if (!strcmp(name, "--device"))
        bad = !*(o->device = value);
    else if (!strcmp(name, "--threads"))
        bad = parse_count(value, 0, 4096, &o->threads);
    else if (!strcmp(name, "--batch"))
        bad = parse_count(value, 0, UINT32_MAX, &o->batch);
    else if (!strcmp(name, "--memory"))
        bad = tool_parse_memory(value, &o->memory);
    else if (!strcmp(name, "--size"))
        bad = parse_size(value, &s->width, &s->height);
    else if (!strcmp(name, "--region"))
        bad = parse_region(value, s->region);
    else if (!strcmp(name, "--camera"))
        bad = parse_camera(value, o);
    else if (!strcmp(name, "--panorama"))
        bad = parse_size(value, &o->panorama[0], &o->panorama[1]);
    else if (!strcmp(name, "--eye"))
        bad = parse_numbers(value, o->eye, 3, 3) < 0;
    else if (!strcmp(name, "--look"))
        bad = parse_look(value, o);
    else if (!strcmp(name, "--sun"))
        bad = parse_sun(value, o);
    else if (!strcmp(name, "--save-shadows"))
        bad = !*(o->save_shadows = value);
    else if (!strcmp(name, "--load-shadows"))
        bad = !*(o->load_shadows = value);
    else if (!strcmp(name, "--samples"))
        bad = parse_count(value, 1, 4096, &s->shadow_samples);
    else if (!strcmp(name, "--pixel-samples"))
        bad = parse_count(value, 1, 4096, &s->pixel_samples);
    else if (!strcmp(name, "--detail")) {
        bad = parse_numbers(value, n, 1, 1) < 0 || n[0] < 0;
        s->detail = (float)n[0];
    } else if (!strcmp(name, "--noise"))
        bad = parse_error(value, &s->pixel_noise);
    else if (!strcmp(name, "--depth"))
        bad = parse_word(value, "point|surface", &s->depth);
    else if (!strcmp(name, "--shadow-error"))
        bad = parse_error(value, &s->shadow_error);
    else if (!strcmp(name, "--ortho"))
        bad = parse_width(value, &o->ortho_width);
    else if (!strcmp(name, "--quality"))
        bad = parse_word(value, "refined|paper", &s->quality);
    else if (!strcmp(name, "--fill"))
        bad = parse_word(value, "closed|paper|off", &s->fill);
    else if (!strcmp(name, "--pass"))
        bad = tool_parse_pass(value, o);
    else if (!strcmp(name, "--surface"))
        bad = parse_word(value, "auto|splats|fill|ranges", &s->surface);
    else if (!strcmp(name, "--analysis"))
        bad = parse_word(value, "auto|on|off|grid", &o->analysis);
    else if (!strcmp(name, "--radius"))
        bad = parse_width(value, &o->radius);
    else if (!strcmp(name, "--range-gamma"))
        bad = parse_width(value, &o->range_gamma);
    else if (!strcmp(name, "--range-sharpness"))
        bad = parse_width(value, &o->range_sharpness);
    else if (!strcmp(name, "--range-pixel"))
        bad = parse_width(value, &o->range_pixel);
    else if (!strcmp(name, "--range-culling"))
        bad = parse_width(value, &o->range_culling) || o->range_culling > 180.0;
    else if (!strcmp(name, "--largest-gap"))
        bad = parse_width(value, &o->largest_gap);
    else if (!strcmp(name, "--layer-distance"))
        bad = parse_width(value, &o->layer_distance);
    else if (!strcmp(name, "--iterations"))
        bad = parse_count(value, 0, 1000, &s->fill_iterations);
    else if (!strcmp(name, "--smooth"))
        bad = parse_word(value, "alleviated|gaussian|box|off", &s->smooth);
    else if (!strcmp(name, "--antialias"))
        bad = parse_word(value, "layers|background|off", &s->antialias);
    else if (!strcmp(name, "--error"))
        bad = parse_error(value, &s->error_target);
    else if (!strcmp(name, "--opacity"))
        bad = parse_opacity(value, o);
    else if (!strcmp(name, "--mesh"))
        bad = !*value || o->mesh_count == TOOL_MESHES || !(o->meshes[o->mesh_count++] = value);
    else if (!strcmp(name, "--layers"))
        bad = parse_count(value, 0, PATINA_MAX_LAYERS, &s->layers);
    else if (!strcmp(name, "--background"))
        bad = parse_color(value, s->world_color);
    else if (!strcmp(name, "--ambient")) {
        bad = parse_color(value, o->ambient);
        s->own_background = 1;
    } else if (!strcmp(name, "--repeat")) {
        bad = parse_count(value, 1, MAX_REPEAT, &number);
        o->repeat = (int)number;
    } else if (!strcmp(name, "--stats")) {
        bad = strcmp(value, "json");
        o->json = 1;
    } else {
        bad = tool_parse_farm(name, value, o);
        if (bad > 0)
            bad = tool_parse_effect(name, value, &o->effects);
        if (bad > 0)
            bad = tool_parse_color(name, value, &o->color);
        if (bad > 0) {
            bad = tool_parse_soft(name, value, &o->soft);
            if (bad > 0)
                return parse_line_option(name, value, o);
        }
    }
    return bad ? BAD_VALUE : GOOD;
}

// Whether a name ends as that of a picture which is no PNG.
static bool is_other_picture(const char *path)
{
    static const char *const endings[] = {"jpg", "jpeg", "tif", "tiff", "exr", "hdr", "bmp", "tga", "webp", "gif", "jp2"};
    const char *dot = strrchr(path, '.');
    for (size_t i = 0; dot && i < sizeof endings / sizeof *endings; i++)
        if (pt_same_word(dot + 1, endings[i]))
            return true;
    return false;
}

int tool_walk_options(const struct tool_syntax *syntax, int count, char **arguments, void *options, int *files)
{
    int only_files = 0;
    *files = 0;
    for (int i = 0; i < count; i++) {
        char *name = arguments[i];
        if (only_files || name[0] != '-' || !name[1]) {
            arguments[(*files)++] = name;
            continue;
        }
        if (!strcmp(name, "--")) {
            only_files = 1;
            continue;
        }
        if (!syntax->take_switch(name, options))
            continue;
        const char *value = i + 1 < count ? arguments[i + 1] : NULL;
        const int outcome = syntax->take_value(name, value ? value : "", options);
        if (outcome > 0)
            return tool_misuse("%sthere is no option '%s'", syntax->prefix, name);
        if (!value)
            return tool_misuse("option '%s' lacks its value", name);
        if (outcome < 0)
            return tool_misuse("'%s' is no value for option '%s': see 'patina help %s'", value, name, name);
        i++;
    }
    return TOOL_OK;
}

static int take_switch(const char *name, void *options) { return parse_switch(name, options); }

static int take_value(const char *name, const char *value, void *options) { return parse_valued(name, value, options); }

int tool_parse_render(int count, char **arguments, struct tool_options *options)
{
    *options = (struct tool_options){
        .files = arguments,
        .effects = PATINA_EFFECTS_INIT,
        .azimuth = 30, // three-quarter view
        .elevation = 40,
        .lines = {.struct_size = sizeof options->lines},
        .settings = {.struct_size = sizeof options->settings,
                     .width = 1024,
                     .height = 1024,
                     .world_color = {0.05f, 0.05f, 0.05f}}, // dark enough behind a statue, bright enough in its folds
    };
    static const struct tool_syntax syntax = {"", take_switch, take_value};
    const int misused = tool_walk_options(&syntax, count, arguments, options, &options->file_count);
    if (misused)
        return misused;
    options->settings.film_transparent = options->transparent ? 1 : 0;
    if (!options->planes)
        options->settings.passes = 1u << PATINA_PASS_COMBINED; // a PNG shows no other, but for
    if (options->pass != PATINA_PASS_COMBINED)
        options->settings.passes |= 1u << options->pass | 1u << PATINA_PASS_DEPTH;
    if (options->settings.own_background) {
        memcpy(options->settings.background, options->settings.world_color, sizeof options->ambient);
        memcpy(options->settings.world_color, options->ambient, sizeof options->ambient);
    }
    if (!options->settings.shadow_samples && !(options->settings.shadow_error > 0.0f))
        options->settings.shadow_samples = 16;
    options->settings.shadow_lazy = 1; // a picture has no use for whole textures, and measured frames are to compute theirs
    if ((options->save_shadows || options->load_shadows) && !options->shadows)
        return tool_misuse("--save-shadows and --load-shadows need --shadows");
    if (options->headlight && (options->shadows || options->sun || options->panorama[0]))
        return tool_misuse("--headlight is one light from the camera: without --sun, --shadows and --panorama");
    if (options->line_options && !options->has_lines)
        return tool_misuse("--line-... options need --lines");
    if (tool_check_soft(&options->soft, options->file_count))
        return TOOL_USAGE;
    if (options->analysis == TOOL_UNANALYSED && (options->color.free_space || options->color.hidden_kinds ||
                                                 options->color.least_trust > 0 || options->color.source == PATINA_COLOR_TRUST))
        return tool_misuse("--free-space, --hide-kinds, --trust and --ramp trust need the analysis");
    if (options->settings.surface != PATINA_SURFACE_RANGES && (options->range_gamma > 0.0 || options->range_pixel > 0.0 ||
                                                               options->range_sharpness > 0.0 || options->range_culling > 0.0))
        return tool_misuse("--range-... options need --surface ranges");
    if (!options->file_count && !options->mesh_count)
        return tool_misuse("render: no file given");
    if (!options->output && !options->planes && !options->save_shadows && !options->json && !options->dump_plan &&
        !options->repeat)
        return tool_misuse("render: nothing to do; name the picture with -o OUT.png");
    if (options->output && is_other_picture(options->output))
        return tool_misuse("-o %s: pictures are written as PNG; name it .png", options->output);
    if (options->pass != PATINA_PASS_COMBINED && (options->panorama[0] || !options->output))
        return tool_misuse("--pass makes a picture, without --panorama: -o OUT.png");
    if (options->pass == PATINA_PASS_TRUST || options->pass == PATINA_PASS_THICKNESS) {
        if (options->analysis == TOOL_UNANALYSED)
            return tool_misuse("--pass trust and thickness need the analysis");
    }
    if (options->panorama[0] && (options->repeat || options->json || options->planes || options->load_shadows ||
                                 options->save_shadows || options->ortho_width > 0))
        return tool_misuse("--panorama makes a picture, without --repeat, --stats, --dump-planes, --ortho or kept shadows");
    if (options->json && !options->repeat)
        options->repeat = 1;
    return TOOL_OK;
}
