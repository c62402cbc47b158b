// SPDX-License-Identifier: GPL-3.0-or-later
// `patina render`: colours of points, hidden classes, clips.
#include "tool.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { CLASSES = 256 };

// NAME[,MIN,MAX]
static int parse_ramp(const char *text, struct tool_color *color)
{
    const char *comma = strchr(text, ',');
    const size_t length = comma ? (size_t)(comma - text) : strlen(text);
    if (!length || length >= sizeof color->attribute)
        return -1;
    memcpy(color->attribute, text, length);
    color->attribute[length] = 0;
    color->source = !strcmp(color->attribute, "height")     ? PATINA_COLOR_HEIGHT
                    : !strcmp(color->attribute, "distance") ? PATINA_COLOR_DISTANCE
                    : !strcmp(color->attribute, "trust")    ? PATINA_COLOR_TRUST
                                                            : PATINA_COLOR_SCALAR;
    color->has_range = comma != NULL;
    return comma && (parse_numbers(comma + 1, color->range, 2, 2) < 0 || color->range[0] == color->range[1]) ? -1 : 0;
}

static int parse_between(const char *text, double least, double most, float *value)
{
    double n;
    if (parse_numbers(text, &n, 1, 1) < 0 || !(n >= least && n <= most))
        return -1;
    *value = (float)n;
    return 0;
}

const char *const tool_kinds[6] = {"unknown", "surface", "border", "line", "volume", "stray"};

static int parse_kinds(const char *text, uint32_t *hidden)
{
    for (;;) {
        const size_t length = strcspn(text, ",");
        uint32_t kind = 0;
        while (kind < PATINA_KIND_STRAY && (strlen(tool_kinds[kind]) != length || memcmp(tool_kinds[kind], text, length)))
            kind++;
        if (kind == PATINA_KIND_STRAY) {
            if (length == strlen(tool_kinds[kind]) && !memcmp(tool_kinds[kind], text, length))
                tool_say("--hide-kinds hides no strays: they are left out for their trust, see --trust");
            return -1;
        }
        *hidden |= 1u << kind;
        if (!text[length])
            return 0;
        text += length + 1;
    }
}

static int parse_classes(const char *text, uint32_t hidden[8])
{
    double n[CLASSES];
    const int count = parse_numbers(text, n, 1, CLASSES);
    for (int i = 0; i < count; i++) {
        if (n[i] < 0 || n[i] > 255 || n[i] != floor(n[i]))
            return -1;
        hidden[(uint32_t)n[i] / 32] |= 1u << (uint32_t)n[i] % 32;
    }
    return count < 0 ? -1 : 0;
}

// A box by two corners, world units.
static int parse_box(const char *text, uint32_t cut, struct tool_color *color)
{
    double n[6];
    if (color->clip_count == TOOL_CLIPS || parse_numbers(text, n, 6, 6) < 0)
        return -1;
    patina_clip *clip = &color->clips[color->clip_count++];
    *clip = (patina_clip){.struct_size = sizeof *clip, .cut = cut};
    for (int k = 0; k < 3; k++) {
        clip->world_from_clip[5 * k] = 0.5 * fabs(n[3 + k] - n[k]);
        clip->world_from_clip[4 * k + 3] = 0.5 * (n[k] + n[3 + k]);
    }
    clip->world_from_clip[15] = 1;
    return 0;
}

static int parse_tint(const char *text, struct tool_color *color)
{
    double n[4];
    if (parse_numbers(text, n, 4, 4) < 0 || n[0] < 0 || n[1] < 0 || n[2] < 0 || n[3] <= 0)
        return -1;
    for (int k = 0; k < 4; k++)
        color->tint[k] = (float)n[k];
    return 0;
}

// 0 draws all points: below 0 in a style, whose 0 is the default.
static int parse_trust(const char *value, struct tool_color *color)
{
    const int bad = parse_between(value, 0, 1, &color->least_trust);
    color->least_trust = color->least_trust > 0 ? color->least_trust : -1;
    return bad;
}

int tool_parse_color(const char *name, const char *value, struct tool_color *color)
{
    double n[3];
    if (!strcmp(name, "--ramp"))
        return parse_ramp(value, color) ? -1 : 0;
    if (!strcmp(name, "--ramp-colors"))
        return *(color->ramp = value) ? 0 : -1;
    if (!strcmp(name, "--attribute"))
        return *(color->scalar = value) ? 0 : -1;
    if (!strcmp(name, "--color")) {
        color->source = PATINA_COLOR_FIXED;
        const int count = parse_numbers(value, n, 3, 3);
        for (int k = 0; k < count; k++)
            color->fixed[k] = n[k] > 0 ? (float)n[k] : 0.0f;
        return count < 0 ? -1 : 0;
    }
    if (!strcmp(name, "--exposure"))
        return parse_between(value, -32, 32, &color->exposure);
    if (!strcmp(name, "--contrast"))
        return parse_between(value, 0.01, 16, &color->contrast);
    if (!strcmp(name, "--hide-classes"))
        return parse_classes(value, color->hidden);
    if (!strcmp(name, "--hide-kinds"))
        return parse_kinds(value, &color->hidden_kinds);
    if (!strcmp(name, "--trust"))
        return parse_trust(value, color);
    if (!strcmp(name, "--free-space")) {
        static const char *const words[] = {"off", "show", "use"};
        for (color->free_space = 0; color->free_space < 3; color->free_space++)
            if (!strcmp(value, words[color->free_space]))
                return 0;
        return -1;
    }
    if (!strcmp(name, "--clip-box"))
        return parse_box(value, 0, color);
    if (!strcmp(name, "--cut-box"))
        return parse_box(value, 1, color);
    if (!strcmp(name, "--clip-tint"))
        return parse_tint(value, color);
    return 1;
}

// ---- what they do --------------------------------------------------------------------------------------------------

int tool_find_attribute(const patina_file *file, const char *name, uint64_t *count, uint32_t *index)
{
    patina_file_info info = {.struct_size = sizeof info};
    patina_file_attribute attribute = {.struct_size = sizeof attribute};
    int code = patina_file_get_info(file, &info);
    *count = info.count;
    for (*index = 0; *index < info.attributes && !code; ++*index) {
        code = patina_file_get_attribute(file, *index, &attribute);
        if (!code && !strcmp(attribute.name, name))
            return PATINA_OK;
    }
    *index = UINT32_MAX;
    return code;
}

// Numbers of the attribute by this name; what they are for.
static int read_numbers(const patina_file *file, const char *name, const char *what, uint64_t *count, float **out)
{
    uint32_t index;
    if (tool_find_attribute(file, name, count, &index) || index == UINT32_MAX) {
        tool_say("there is no attribute '%s' to %s", name, what);
        return PATINA_ERROR_ARGUMENT;
    }
    *out = malloc(*count * sizeof **out + 1);
    return *out ? patina_file_read_attribute(file, index, *out, *count * sizeof **out) : PATINA_ERROR_MEMORY;
}

// A cloud has one: the ramp's, or that which lines follow.
static int take_scalars(const patina_file *file, const struct tool_color *color, patina_cloud *cloud)
{
    const int ramp = color->source == PATINA_COLOR_SCALAR;
    float *values = NULL;
    uint64_t count;
    if (ramp && color->scalar && strcmp(color->attribute, color->scalar) != 0) {
        tool_say("lines along '%s' and a ramp over '%s': both are of one attribute", color->scalar, color->attribute);
        return PATINA_ERROR_ARGUMENT;
    }
    int code = read_numbers(file, ramp ? color->attribute : color->scalar, ramp ? "make a ramp of" : "draw lines along", &count,
                            &values);
    const patina_array scalars = {.data = values, .type = PATINA_FLOAT32, .components = 1};
    if (!code)
        code = patina_cloud_set_scalars(cloud, &scalars);
    free(values);
    return code;
}

int tool_begins(const char *path, const char *bytes, size_t size)
{
    char start[16];
    struct pt_disk disk; // opening a named pipe as a stream would wait for who writes into it
    size_t got = 0;
    if (size > sizeof start || pt_disk_open(path, &disk))
        return 0;
    const int read = disk.kind == PT_DISK_FILE && !pt_disk_read(&disk, 0, start, size, &got) && got == size;
    pt_disk_close(&disk);
    return read && !memcmp(start, bytes, size);
}

static int open_saved(const char *path, const struct tool_color *color, const char *attribute, patina_cloud **out)
{
    patina_cloud_info info = {.struct_size = sizeof info};
    int code = patina_cloud_open(path, out);
    if (!code && attribute[0]) {
        tool_say("there is no attribute '%s' in '%s' to divide soft points by: a built cloud keeps none", attribute, path);
        code = PATINA_ERROR_ARGUMENT;
    }
    if (!code)
        code = patina_cloud_get_info(*out, &info);
    const int ramp = color->source == PATINA_COLOR_SCALAR;
    if (!code && (ramp || color->scalar) && !info.has_scalars) {
        tool_say("there is no attribute in '%s' to %s: convert it with --attribute %s", path,
                 ramp ? "make a ramp of" : "draw lines along", ramp ? color->attribute : color->scalar);
        code = PATINA_ERROR_ARGUMENT;
    }
    return code;
}

int tool_load_cloud(const char *path, const struct tool_color *color, const char *attribute, patina_progress *progress,
                    patina_cloud **out, float **numbers, struct tool_stations *stations, struct tool_scans *scans)
{
    patina_file *file = NULL;
    uint64_t count;
    if (tool_begins(path, "patina\n\x1a", 8)) // patina_cloud_save wrote it
        return open_saved(path, color, attribute, out);
    int code = patina_file_open(path, progress, &file);
    if (!code)
        code = patina_file_cloud(file, 0, progress, out);
    if (!code && (color->source == PATINA_COLOR_SCALAR || color->scalar))
        code = take_scalars(file, color, *out);
    if (!code && attribute[0])
        code = read_numbers(file, attribute, "divide soft points by", &count, numbers);
    if (!code)
        code = tool_take_stations(file, stations);
    if (!code && scans)
        code = tool_take_scans(file, stations, *out, scans);
    patina_file_destroy(file);
    return code;
}

int tool_set_color(const struct tool_color *color, const patina_cloud *cloud, float table[PATINA_MAX_RAMP][3],
                   patina_cloud_style *style)
{
    const int classes = color->ramp && !strcmp(color->ramp, "classes");
    style->color_source = color->source;
    if (color->source == PATINA_COLOR_FIXED)
        memcpy(style->color, color->fixed, sizeof style->color);
    style->exposure = color->exposure;
    style->contrast = color->contrast;
    memcpy(style->hidden_classes, color->hidden, sizeof style->hidden_classes);
    style->free_space = color->free_space;
    style->hidden_kinds = color->hidden_kinds;
    style->least_trust = color->least_trust;
    for (int k = 0; k < 2; k++)
        style->ramp_range[k] = color->has_range ? (float)color->range[k] : classes ? 255.0f * (float)k : 0.0f;
    if (color->source == PATINA_COLOR_SCALAR && !color->has_range && !classes)
        patina_cloud_scalar_range(cloud, 0.01, style->ramp_range); // strays would leave the rest one colour
    style->ramp = &table[0][0];
    style->ramp_count = PATINA_MAX_RAMP;
    return patina_ramp(color->ramp ? color->ramp : "viridis", table);
}

int tool_add_clips(const struct tool_color *color, patina_scene *scene)
{
    int code = PATINA_OK;
    for (int i = 0; i < color->clip_count && !code; i++) {
        patina_clip clip = color->clips[i];
        memcpy(clip.tint, color->tint, sizeof clip.tint);
        clip.tint_width = color->tint[3];
        clip.tint_strength = color->tint[3] > 0 ? 1 : 0;
        code = patina_scene_add_clip(scene, &clip);
    }
    return code;
}
