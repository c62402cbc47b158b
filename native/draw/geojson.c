// SPDX-License-Identifier: GPL-3.0-or-later
// GeoJSON of plans: RFC 7946, but that coordinates are the world's, and the member "crs" of GeoJSON 2008 names their system: the RFC
// knows degrees alone. GDAL, and with it QGIS, reads that member.
#include "drawing.h"

#include <stdio.h>

#define DIGITS 14 // a micrometer at coordinates of 5,000,000

static void write_vertex(const struct pt_draw_plane *plane, const struct pt_line *line, uint32_t i, FILE *file)
{
    double world[3];
    char text[3][40];
    pt_draw_plane_world(plane, line->at[i], line->depth[i], world);
    for (int k = 0; k < 3; k++)
        pt_draw_number(world[k], DIGITS, text[k]);
    fprintf(file, "[%s,%s,%s]", text[0], text[1], text[2]);
}

static void write_line(const struct pt_draw_plane *plane, const struct pt_line *line, FILE *file)
{
    fprintf(file,
            "{\"type\":\"Feature\",\"properties\":{\"layer\":\"%s\"},\"geometry\":{\"type\":\"LineString\",\"coordinates\":[",
            pt_draw_layers[line->layer].name);
    for (uint32_t i = 0; i < line->count + (line->closed ? 1u : 0u); i++) {
        fputs(i ? "," : "", file);
        write_vertex(plane, line, i % line->count, file);
    }
    fputs("]}}", file);
}

int pt_write_geojson(const struct patina_drawing *drawing, FILE *file)
{
    fprintf(file,
            "{\"type\":\"FeatureCollection\",\n"
            "\"crs\":{\"type\":\"name\",\"properties\":{\"name\":\"urn:ogc:def:crs:EPSG::%u\"}},\n"
            "\"features\":[",
            drawing->epsg);
    for (uint32_t i = 0; i < drawing->lines.count; i++) {
        fputs(i ? ",\n" : "\n", file);
        write_line(&drawing->plane, &drawing->lines.at[i], file);
    }
    fputs("\n]}\n", file);
    return !ferror(file);
}
