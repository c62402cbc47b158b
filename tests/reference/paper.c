// SPDX-License-Identifier: GPL-3.0-or-later
// Paper: a colour and a grain that the picture is multiplied by. The grain is the mean of a number a pixel and of a
// lattice of numbers 8 pixels wide, blended between its nodes.
#include "reference.h"
#include "tolerances.h"
#include "shared/picture.h"

#include <math.h>

static double hash(uint32_t x, uint32_t y)
{
    uint32_t word = x * 0x9E3779B1u + y * 0x85EBCA77u;
    word = (word ^ word >> 15) * 0x2C1B3C6Du;
    word = (word ^ word >> 12) * 0x297A2D39u;
    word ^= word >> 15;
    return (word >> 8) / 16777216.0;
}

static double lattice(uint32_t x, uint32_t y, uint32_t width)
{
    uint32_t cx = x / width, cy = y / width;
    double u = (x % width + 0.5) / width, v = (y % width + 0.5) / width;
    return (1.0 - v) * ((1.0 - u) * hash(cx, cy) + u * hash(cx + 1, cy)) +
           v * ((1.0 - u) * hash(cx, cy + 1) + u * hash(cx + 1, cy + 1));
}

struct ref_color ref_paper(const struct paper_args *args, const float *combined, int x, int y)
{
    uint32_t px = args->x + (uint32_t)x, py = args->y + (uint32_t)y;
    double light = 1.0 - args->grain * (0.5 * hash(px, py) + 0.5 * lattice(px, py, 8));
    const float *own = combined + 4 * ((size_t)y * args->crop_width + (size_t)x);
    struct ref_color out = {0};
    for (int c = 0; c < 4; c++) {
        out.color[c] = own[c] * (c < 3 ? args->color[c] * light : 1.0);
        out.error[c] = c < 3 ? 16.0 * TOL_UNIT * fabs((double)own[c] * args->color[c]) : 0.0;
    }
    return out;
}
