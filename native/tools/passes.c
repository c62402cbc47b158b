// SPDX-License-Identifier: GPL-3.0-or-later
// --pass: a pass in place of the colours. Numbers go through a ramp, normals turn to colours as is usual, (n + 1) / 2.
#include "tool.h"
#include "base/color.h"
#include "base/compare.h"
#include "base/words.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const struct {
    const char *name;
    uint32_t channels;
} passes[PATINA_PASS_COUNT] = {
#define PATINA_X(name, channels, text) {#name, channels},
    PATINA_PASSES(PATINA_X)
#undef PATINA_X
};

int tool_parse_pass(const char *value, struct tool_options *options)
{
    const size_t length = strcspn(value, ",");
    int found = -1;
    for (int i = 0; i < PATINA_PASS_COUNT; i++)
        if (strlen(passes[i].name) == length && pt_same_start(value, passes[i].name, length))
            found = i;
    if (found < 0)
        return -1;
    options->pass = (uint32_t)found;
    options->has_pass_range = value[length] == ',';
    if (!options->has_pass_range)
        return 0;
    const double *range = options->pass_range;
    return passes[found].channels > 1 || parse_numbers(value + length + 1, options->pass_range, 2, 2) < 0 ||
                   !(range[0] < range[1])
               ? -1
               : 0;
}

// Zero says that nothing is known.
static int is_known(uint32_t pass, float value) { return pass != PATINA_PASS_THICKNESS || value > 0.0f; }

// Soft points have no depth.
static int shows(uint32_t pass, float value, float depth)
{
    return pass == PATINA_PASS_DENSITY ? value > 0.0f : isfinite(depth);
}

static int from_zero(uint32_t pass)
{
    return pass == PATINA_PASS_THICKNESS || pass == PATINA_PASS_DENSITY || pass == PATINA_PASS_DISAGREEMENT;
}

// Shares go from 0 to 1; others from the least to the greatest but a hundredth of the pixels, some from 0.
static int find_range(uint32_t pass, const float *values, const float *depth, size_t count, double range[2])
{
    range[0] = 0.0;
    range[1] = 1.0;
    if (pass == PATINA_PASS_TRUST || pass == PATINA_PASS_SHADOW || pass == PATINA_PASS_LINE)
        return PATINA_OK;
    float *sorted = malloc(count * sizeof *sorted + 1);
    size_t known = 0;
    if (!sorted)
        return PATINA_ERROR_MEMORY;
    for (size_t i = 0; i < count; i++)
        if (shows(pass, values[i], depth[i]) && is_known(pass, values[i]))
            sorted[known++] = fabsf(values[i]);
    qsort(sorted, known, sizeof *sorted, pt_compare_floats);
    if (known) {
        range[0] = from_zero(pass) ? 0.0 : (double)sorted[known / 100];
        range[1] = (double)sorted[known - 1 - known / 100];
    }
    free(sorted);
    return PATINA_OK;
}

static void color_number(float value, const double range[2], float table[PATINA_MAX_RAMP][3], float out[4])
{
    const double share = range[1] > range[0] ? (fabs((double)value) - range[0]) / (range[1] - range[0]) : 0.0;
    const int entry = (int)(fmin(fmax(share, 0.0), 1.0) * (PATINA_MAX_RAMP - 1) + 0.5);
    memcpy(out, table[entry], 3 * sizeof *out);
    out[3] = 1.0f;
}

// A colour of a PNG, from 0 to 1, linear.
static float linear(double encoded) { return (float)pt_linear_of_srgb(encoded); }

static void color_pixels(uint32_t pass, const float *values, const float *depth, size_t count, const double range[2],
                         float table[PATINA_MAX_RAMP][3], float *pixels)
{
    static const float unknown[4] = {0.05f, 0.05f, 0.05f, 1.0f};
    for (size_t i = 0; i < count; i++) {
        float *out = pixels + 4 * i;
        if (!shows(pass, values[i], depth[i]))
            continue; // the background stays
        if (pass == PATINA_PASS_NORMAL) {
            for (size_t k = 0; k < 3; k++)
                out[k] = linear(0.5 * (double)values[3 * i + k] + 0.5);
            out[3] = 1.0f;
        } else if (is_known(pass, values[i])) {
            color_number(values[i], range, table, out);
        } else {
            memcpy(out, unknown, sizeof unknown);
        }
    }
}

static void say_range(const char *path, const char *name, const double range[2])
{
    char lower[16] = {0};
    for (size_t i = 0; name[i] && i + 1 < sizeof lower; i++)
        lower[i] = (char)tolower((unsigned char)name[i]);
    tool_say("%s: %s from %g to %g", path, lower, range[0], range[1]);
}

int tool_color_pass(const struct tool_options *options, const patina_frame *frame, size_t count, float *pixels)
{
    const uint32_t pass = options->pass;
    const size_t size = count * passes[pass].channels * sizeof(float);
    float table[PATINA_MAX_RAMP][3], *values = malloc(size + 1), *depth = malloc(count * sizeof *depth + 1);
    double range[2] = {options->pass_range[0], options->pass_range[1]};
    int code = values && depth ? PATINA_OK : PATINA_ERROR_MEMORY;
    if (!code)
        code = patina_ramp(options->color.ramp ? options->color.ramp : "viridis", table);
    if (!code)
        code = patina_frame_read(frame, pass, values, size);
    if (!code)
        code = patina_frame_read(frame, PATINA_PASS_DEPTH, depth, count * sizeof *depth);
    if (!code && passes[pass].channels == 1 && !options->has_pass_range)
        code = find_range(pass, values, depth, count, range);
    if (!code && passes[pass].channels == 1)
        say_range(options->output, passes[pass].name, range);
    if (!code)
        color_pixels(pass, values, depth, count, range, table, pixels);
    free(depth);
    free(values);
    return code;
}
