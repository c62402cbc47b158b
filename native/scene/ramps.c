// SPDX-License-Identifier: GPL-3.0-or-later
// Ramps by name: a few stops in sRGB, evenly spaced, straight between in sRGB; and the colours of LAS classes.
#include "base/color.h"
#include "base/error.h"
#include "base/elementary.h"

#include <math.h>
#include <string.h>

enum { MOST_STOPS = 12, CLASSES = 19 };

static const struct {
    const char *name;
    uint32_t count, stops[MOST_STOPS]; // 0xRRGGBB
} ramps[] = {
    {"grey", 2, {0x000000, 0xFFFFFF}},
    {"viridis", 9, {0x440154, 0x472D7B, 0x3B528B, 0x2C728E, 0x21918C, 0x28AE80, 0x5EC962, 0xADDC30, 0xFDE725}},
    {"heat", 6, {0x08030C, 0x5A1235, 0xB3303A, 0xEE6A24, 0xFBC04A, 0xFFFBE8}},
    {"spectrum", 7, {0x30307C, 0x2D6FD2, 0x22B4B8, 0x4CC45A, 0xC8D23C, 0xF0902C, 0xA81E1E}},
    {"relief", 7, {0x1E4E5C, 0x3F8F5F, 0x8DBB62, 0xE3D68A, 0xBE8E56, 0x8A6A58, 0xF4F2F0}},
    {"diverging", 5, {0x2C4C9C, 0x8FB0DC, 0xEFEDEA, 0xE29A7C, 0x9C2430}},
};

// By LAS class, from 0 on: never classified, unassigned, ground, low, medium and high vegetation, building, low point, key
// point, water, rail, road, overlap, wire guard and conductor, tower, connector, bridge, high noise.
static const uint32_t classes[CLASSES] = {0x8C8C8C, 0xB4B4B4, 0xA9794A, 0xB5D77C, 0x6DB24C, 0x2C7A36, 0xD9663B,
                                          0xD23CC8, 0xE8C890, 0x3C78D2, 0x6E5A78, 0x5A5F66, 0x9C9CC8, 0xE6C83C,
                                          0xF0A01E, 0x96503C, 0xC8A03C, 0xA08C78, 0xFF3C96};

static float linear(double srgb) { return (float)pt_linear_of_srgb(srgb); }

static void put_color(uint32_t from, uint32_t to, double share, float out[3])
{
    for (int k = 0; k < 3; k++) {
        double a = from >> (16 - 8 * k) & 255u, b = to >> (16 - 8 * k) & 255u;
        out[k] = linear((a + share * (b - a)) / 255.0);
    }
}

// Classes beyond the table: hues far from each other.
static uint32_t color_of_class(uint32_t class)
{
    uint32_t color = 0;
    double turn = class * 0.61803398874989485;
    for (int k = 0; k < 3; k++) {
        double wave = 0.5 + 0.5 * pt_cos(6.283185307179586 * (turn - floor(turn) + k / 3.0));
        color = color << 8 | (uint32_t)(60.0 + 180.0 * wave);
    }
    return class < CLASSES ? classes[class] : color;
}

int patina_ramp(const char *name, float colors[PATINA_MAX_RAMP][3])
{
    if (!name || !colors)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_ramp: bad arguments");
    for (uint32_t i = 0; i < PATINA_MAX_RAMP && !strcmp(name, "classes"); i++)
        put_color(color_of_class(i), 0, 0.0, colors[i]);
    if (!strcmp(name, "classes"))
        return PATINA_OK;
    for (size_t r = 0; r < sizeof ramps / sizeof *ramps; r++) {
        if (strcmp(name, ramps[r].name) != 0)
            continue;
        for (uint32_t i = 0; i < PATINA_MAX_RAMP; i++) {
            double at = i * (ramps[r].count - 1.0) / (PATINA_MAX_RAMP - 1.0);
            uint32_t stop = (uint32_t)fmin(floor(at), ramps[r].count - 2.0);
            put_color(ramps[r].stops[stop], ramps[r].stops[stop + 1], at - stop, colors[i]);
        }
        return PATINA_OK;
    }
    return pt_fail(NULL, PATINA_ERROR_ARGUMENT,
                   "there is no ramp '%s'; there are grey, viridis, heat, spectrum, relief, diverging, classes", name);
}
