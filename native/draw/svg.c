// SPDX-License-Identifier: GPL-3.0-or-later
// SVG 1.1 at true scale: a user unit is a millimeter of the sheet.
#include "drawing.h"

#include <stdio.h>

#define DIGITS 10 // of millimeters: a nanometer on any sheet

static void write_line(const struct patina_drawing *drawing, const struct pt_line *line, FILE *file)
{
    const double mm = 1000.0 / drawing->scale;
    char x[40], y[40];
    fputs("<path d=\"", file);
    for (uint32_t i = 0; i < line->count; i++)
        fprintf(file, "%s%s,%s", i ? " L" : "M", pt_draw_number(mm * (line->at[i][0] + drawing->plane.half[0]), DIGITS, x),
                pt_draw_number(mm * (drawing->plane.half[1] - line->at[i][1]), DIGITS, y));
    fprintf(file, "%s\"/>\n", line->closed ? " Z" : "");
}

int pt_write_svg(const struct patina_drawing *drawing, FILE *file)
{
    char width[40], height[40], number[40];
    pt_draw_number(2000.0 / drawing->scale * drawing->plane.half[0], DIGITS, width);
    pt_draw_number(2000.0 / drawing->scale * drawing->plane.half[1], DIGITS, height);
    fprintf(file,
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
            "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:inkscape=\"http://www.inkscape.org/namespaces/inkscape\" "
            "version=\"1.1\" width=\"%smm\" height=\"%smm\" viewBox=\"0 0 %s %s\">\n",
            width, height, width, height);
    fprintf(file, "<desc>Scale 1:%s. Written by Patina %s.</desc>\n", pt_draw_number(drawing->scale, DIGITS, number),
            patina_version());
    for (uint32_t layer = 0; layer < PATINA_DRAWING_LAYERS; layer++) {
        const struct pt_draw_layer *about = &pt_draw_layers[layer];
        fprintf(file,
                "<g id=\"%s\" inkscape:groupmode=\"layer\" inkscape:label=\"%s\" fill=\"none\" stroke=\"#000000\" "
                "stroke-width=\"%s\" stroke-linecap=\"round\" stroke-linejoin=\"round\"%s>\n",
                about->name, about->name, pt_draw_number(0.01 * about->weight, DIGITS, number),
                about->dashed ? " stroke-dasharray=\"2 1\"" : "");
        for (uint32_t i = 0; i < drawing->lines.count; i++)
            if (drawing->lines.at[i].layer == layer)
                write_line(drawing, &drawing->lines.at[i], file);
        fputs("</g>\n", file);
    }
    fputs("</svg>\n", file);
    return !ferror(file);
}
