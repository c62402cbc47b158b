// SPDX-License-Identifier: GPL-3.0-or-later
// ASCII DXF of the version R2018 (AC1032). Tags and tables as Autodesk's DXF reference has them: pairs of lines, a group code and a value.
// Lines on a plane are LWPOLYLINE entities: two coordinates in the plane's own system (OCS), whose axes follow from the plane's normal
// by the reference's arbitrary axis algorithm, and the plane's distance from the origin along its normal. Lines whose vertices are not all as
// far before the drawing's plane are POLYLINE entities with a VERTEX for each.
#include "drawing.h"
#include "base/vector.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define DIGITS 17 // each float64 comes back as it was

// Handles of objects that refer to each other; entities follow.
enum handle {
    VPORTS = 0x8,
    LTYPES = 0x5,
    LAYERS = 0x2,
    STYLES = 0x3,
    VIEWS = 0x6,
    UCSS = 0x7,
    APPIDS = 0x9,
    DIMSTYLES = 0xA,
    BLOCK_RECORDS = 0x1,
    ROOT = 0xC,
    GROUPS = 0xD,
    LAYOUTS = 0x1A,
    MODEL_LAYOUT = 0x22,
    PAPER_LAYOUT = 0x1E,
    MODEL_RECORD = 0x1F,
    PAPER_RECORD = 0x1B,
    MODEL_BLOCK = 0x20,
    PAPER_BLOCK = 0x1C,
    FIRST_FREE = 0x40,
};

struct dxf {
    const struct patina_drawing *drawing;
    FILE *file;
    int flat;
    uint32_t handle;           // the next free one
    uint32_t handles;          // that the entities take
    double ax[3], ay[3], lift; // axes of the OCS; the plane's distance along its normal
    double unit, shift[2];     // flat: millimeters per meter, and where the lower left corner is
    double low[3], high[3];    // of all vertices
};

static void tag(struct dxf *d, int code, const char *text) { fprintf(d->file, "%3d\n%s\n", code, text); }

static void whole(struct dxf *d, int code, long value) { fprintf(d->file, "%3d\n%ld\n", code, value); }

static void handle(struct dxf *d, int code, uint32_t value) { fprintf(d->file, "%3d\n%X\n", code, value); }

static void real(struct dxf *d, int code, double value)
{
    char text[40];
    pt_draw_number(value, DIGITS, text);
    const char *more = strpbrk(text, ".en") ? "" : ".0";
    fprintf(d->file, "%3d\n%s%s\n", code, text, more);
}

static void pair(struct dxf *d, int code, double x, double y)
{
    real(d, code, x);
    real(d, code + 10, y);
}

static void point(struct dxf *d, int code, double x, double y, double z)
{
    real(d, code, x);
    real(d, code + 10, y);
    real(d, code + 20, z);
}

// ---- coordinates -------------------------------------------------------------------------------------------------------------

static void cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
    const double length = sqrt(pt_dot(out, out));
    for (int k = 0; k < 3; k++)
        out[k] /= length;
}

static void place(const struct dxf *d, const double at[2], double out[2])
{
    if (d->flat) {
        for (int k = 0; k < 2; k++)
            out[k] = d->unit * (at[k] + d->shift[k]);
        return;
    }
    double world[3];
    pt_draw_plane_world(&d->drawing->plane, at, 0.0, world);
    out[0] = pt_dot(d->ax, world);
    out[1] = pt_dot(d->ay, world);
}

// A LWPOLYLINE can show it.
static int is_flat(const struct dxf *d, const struct pt_line *line)
{
    for (uint32_t i = 1; i < line->count && !d->flat; i++)
        if (line->depth[i] != line->depth[0])
            return 0;
    return 1;
}

static void begin(struct dxf *d)
{
    const struct pt_draw_plane *plane = &d->drawing->plane;
    const double *n = plane->normal, y[3] = {0.0, 1.0, 0.0}, z[3] = {0.0, 0.0, 1.0};
    cross(fabs(n[0]) < 1.0 / 64.0 && fabs(n[1]) < 1.0 / 64.0 ? y : z, n, d->ax);
    cross(n, d->ax, d->ay);
    d->lift = d->flat ? 0.0 : pt_dot(n, plane->origin);
    d->unit = 1000.0 / d->drawing->scale;
    for (int k = 0; k < 3; k++) {
        d->shift[k % 2] = plane->half[k % 2];
        d->low[k] = INFINITY;
        d->high[k] = -INFINITY;
    }
    for (uint32_t i = 0; i < d->drawing->lines.count; i++) {
        const struct pt_line *line = &d->drawing->lines.at[i];
        d->handles += is_flat(d, line) ? 1 : 2 + line->count;
        for (uint32_t j = 0; j < line->count; j++) {
            double p[3] = {0.0, 0.0, 0.0};
            if (d->flat)
                place(d, line->at[j], p);
            else
                pt_draw_plane_world(plane, line->at[j], line->depth[j], p);
            for (int k = 0; k < 3; k++) {
                d->low[k] = fmin(d->low[k], p[k]);
                d->high[k] = fmax(d->high[k], p[k]);
            }
        }
    }
}

// ---- header and tables -------------------------------------------------------------------------------------------------------

static void section(struct dxf *d, const char *name)
{
    tag(d, 0, "SECTION");
    tag(d, 2, name);
}

static void variable(struct dxf *d, const char *name, int code, const char *value)
{
    tag(d, 9, name);
    tag(d, code, value);
}

static void write_header(struct dxf *d)
{
    char seed[16];
    const int some = d->low[0] <= d->high[0];
    snprintf(seed, sizeof seed, "%X", (unsigned)(FIRST_FREE + 0x40u + d->handles));
    section(d, "HEADER");
    variable(d, "$ACADVER", 1, "AC1032");
    variable(d, "$HANDSEED", 5, seed);
    variable(d, "$DWGCODEPAGE", 3, "ANSI_1252");
    variable(d, "$INSUNITS", 70, d->flat ? "4" : "6"); // millimeters, meters
    variable(d, "$MEASUREMENT", 70, "1");
    variable(d, "$LWDISPLAY", 290, "1");
    variable(d, "$LTSCALE", 40, "1.0");
    tag(d, 9, "$EXTMIN");
    point(d, 10, some ? d->low[0] : 0.0, some ? d->low[1] : 0.0, some ? d->low[2] : 0.0);
    tag(d, 9, "$EXTMAX");
    point(d, 10, some ? d->high[0] : 0.0, some ? d->high[1] : 0.0, some ? d->high[2] : 0.0);
    tag(d, 0, "ENDSEC");
}

static void begin_table(struct dxf *d, const char *name, enum handle own, int count)
{
    tag(d, 0, "TABLE");
    tag(d, 2, name);
    handle(d, 5, own);
    handle(d, 330, 0);
    tag(d, 100, "AcDbSymbolTable");
    whole(d, 70, count);
}

static void begin_record(struct dxf *d, const char *kind, enum handle table, const char *subclass, const char *name)
{
    tag(d, 0, kind);
    handle(d, strcmp(kind, "DIMSTYLE") ? 5 : 105, d->handle++);
    handle(d, 330, table);
    tag(d, 100, "AcDbSymbolTableRecord");
    tag(d, 100, subclass);
    tag(d, 2, name);
    whole(d, 70, 0);
}

static void write_view(struct dxf *d) // the first one: shows all that there is
{
    const double width = d->low[0] <= d->high[0] ? d->high[0] - d->low[0] : 1.0;
    const double height = d->low[1] <= d->high[1] ? d->high[1] - d->low[1] : 1.0;
    begin_table(d, "VPORT", VPORTS, 1);
    begin_record(d, "VPORT", VPORTS, "AcDbViewportTableRecord", "*Active");
    pair(d, 10, 0.0, 0.0);
    pair(d, 11, 1.0, 1.0);
    real(d, 12, width > 0.0 ? 0.5 * (d->low[0] + d->high[0]) : 0.0);
    real(d, 22, height > 0.0 ? 0.5 * (d->low[1] + d->high[1]) : 0.0);
    point(d, 16, 0.0, 0.0, 1.0);
    point(d, 17, 0.0, 0.0, 0.0);
    real(d, 40, 1.1 * fmax(fmax(width, height), 1e-3));
    real(d, 41, 1.5);
    tag(d, 0, "ENDTAB");
}

static void write_linetype(struct dxf *d, const char *name, const char *about, double dash, double gap)
{
    begin_record(d, "LTYPE", LTYPES, "AcDbLinetypeTableRecord", name);
    tag(d, 3, about);
    whole(d, 72, 65);
    whole(d, 73, dash > 0.0 ? 2 : 0);
    real(d, 40, dash + gap);
    if (dash > 0.0) {
        real(d, 49, dash);
        whole(d, 74, 0);
        real(d, 49, -gap);
        whole(d, 74, 0);
    }
}

static void write_layer(struct dxf *d, const char *name, int color, const char *linetype, int weight)
{
    begin_record(d, "LAYER", LAYERS, "AcDbLayerTableRecord", name);
    whole(d, 62, color);
    tag(d, 6, linetype);
    whole(d, 370, weight);
}

static void write_styles(struct dxf *d)
{
    const double mm = d->flat ? 1.0 : 0.001 * d->drawing->scale; // a millimeter of the sheet
    begin_table(d, "LTYPE", LTYPES, 4);
    write_linetype(d, "ByBlock", "", 0.0, 0.0);
    write_linetype(d, "ByLayer", "", 0.0, 0.0);
    write_linetype(d, "Continuous", "Solid line", 0.0, 0.0);
    write_linetype(d, "DASHED", "Dashed __ __ __ __", 2.0 * mm, mm);
    tag(d, 0, "ENDTAB");
    begin_table(d, "LAYER", LAYERS, 1 + PATINA_DRAWING_LAYERS);
    write_layer(d, "0", 7, "Continuous", -3);
    for (int i = 0; i < PATINA_DRAWING_LAYERS; i++) {
        const struct pt_draw_layer *layer = &pt_draw_layers[i];
        write_layer(d, layer->name, layer->color, layer->dashed ? "DASHED" : "Continuous", layer->weight);
    }
    tag(d, 0, "ENDTAB");
    begin_table(d, "STYLE", STYLES, 1);
    begin_record(d, "STYLE", STYLES, "AcDbTextStyleTableRecord", "Standard");
    real(d, 40, 0.0);
    real(d, 41, 1.0);
    real(d, 50, 0.0);
    whole(d, 71, 0);
    real(d, 42, 2.5);
    tag(d, 3, "arial.ttf");
    tag(d, 4, "");
    tag(d, 0, "ENDTAB");
}

static void write_block_record(struct dxf *d, const char *name, enum handle own, enum handle layout)
{
    tag(d, 0, "BLOCK_RECORD");
    handle(d, 5, own);
    handle(d, 330, BLOCK_RECORDS);
    tag(d, 100, "AcDbSymbolTableRecord");
    tag(d, 100, "AcDbBlockTableRecord");
    tag(d, 2, name);
    handle(d, 340, layout);
    whole(d, 70, 0);
    whole(d, 280, 1);
    whole(d, 281, 0);
}

static void write_tables(struct dxf *d)
{
    section(d, "TABLES");
    write_view(d);
    write_styles(d);
    begin_table(d, "VIEW", VIEWS, 0);
    tag(d, 0, "ENDTAB");
    begin_table(d, "UCS", UCSS, 0);
    tag(d, 0, "ENDTAB");
    begin_table(d, "APPID", APPIDS, 1);
    begin_record(d, "APPID", APPIDS, "AcDbRegAppTableRecord", "ACAD");
    tag(d, 0, "ENDTAB");
    begin_table(d, "DIMSTYLE", DIMSTYLES, 1);
    tag(d, 100, "AcDbDimStyleTable");
    whole(d, 71, 1);
    begin_record(d, "DIMSTYLE", DIMSTYLES, "AcDbDimStyleTableRecord", "Standard");
    tag(d, 0, "ENDTAB");
    begin_table(d, "BLOCK_RECORD", BLOCK_RECORDS, 2);
    write_block_record(d, "*Model_Space", MODEL_RECORD, MODEL_LAYOUT);
    write_block_record(d, "*Paper_Space", PAPER_RECORD, PAPER_LAYOUT);
    tag(d, 0, "ENDTAB");
    tag(d, 0, "ENDSEC");
}

// ---- blocks, entities, objects -----------------------------------------------------------------------------------------------

static void write_block(struct dxf *d, const char *name, enum handle own, enum handle record, int paper)
{
    for (int end = 0; end < 2; end++) {
        tag(d, 0, end ? "ENDBLK" : "BLOCK");
        handle(d, 5, (uint32_t)own + (uint32_t)end);
        handle(d, 330, record);
        tag(d, 100, "AcDbEntity");
        if (paper)
            whole(d, 67, 1);
        tag(d, 8, "0");
        tag(d, 100, end ? "AcDbBlockEnd" : "AcDbBlockBegin");
        if (end)
            continue;
        tag(d, 2, name);
        whole(d, 70, 0);
        point(d, 10, 0.0, 0.0, 0.0);
        tag(d, 3, name);
        tag(d, 1, "");
    }
}

static void begin_entity(struct dxf *d, const char *name, uint32_t owner, uint32_t layer, const char *kind)
{
    tag(d, 0, name);
    handle(d, 5, d->handle++);
    handle(d, 330, owner);
    tag(d, 100, "AcDbEntity");
    tag(d, 8, pt_draw_layers[layer].name);
    if (kind)
        tag(d, 100, kind);
}

static void write_spatial(struct dxf *d, const struct pt_line *line)
{
    const uint32_t own = d->handle;
    begin_entity(d, "POLYLINE", MODEL_RECORD, line->layer, "AcDb3dPolyline");
    whole(d, 66, 1);
    point(d, 10, 0.0, 0.0, 0.0);
    whole(d, 70, line->closed ? 9 : 8);
    for (uint32_t i = 0; i < line->count; i++) {
        double p[3];
        pt_draw_plane_world(&d->drawing->plane, line->at[i], line->depth[i], p);
        begin_entity(d, "VERTEX", own, line->layer, "AcDbVertex");
        tag(d, 100, "AcDb3dPolylineVertex");
        point(d, 10, p[0], p[1], p[2]);
        whole(d, 70, 32);
    }
    begin_entity(d, "SEQEND", own, line->layer, NULL);
}

static void write_polyline(struct dxf *d, const struct pt_line *line)
{
    const double *n = d->drawing->plane.normal;
    if (!is_flat(d, line)) {
        write_spatial(d, line);
        return;
    }
    begin_entity(d, "LWPOLYLINE", MODEL_RECORD, line->layer, "AcDbPolyline");
    whole(d, 90, (long)line->count);
    whole(d, 70, line->closed ? 1 : 128); // 128: dashes run on over vertices
    real(d, 38, d->flat ? 0.0 : d->lift + line->depth[0]);
    for (uint32_t i = 0; i < line->count; i++) {
        double p[2];
        place(d, line->at[i], p);
        pair(d, 10, p[0], p[1]);
    }
    if (!d->flat)
        point(d, 210, n[0], n[1], n[2]);
}

static void write_dictionary(struct dxf *d, enum handle own, enum handle owner)
{
    tag(d, 0, "DICTIONARY");
    handle(d, 5, own);
    handle(d, 330, owner);
    tag(d, 100, "AcDbDictionary");
    whole(d, 281, 1);
}

static void write_layout(struct dxf *d, const char *name, enum handle own, enum handle record, int order)
{
    tag(d, 0, "LAYOUT");
    handle(d, 5, own);
    handle(d, 330, LAYOUTS);
    tag(d, 100, "AcDbPlotSettings");
    tag(d, 1, "");
    tag(d, 2, "none_device");
    tag(d, 4, "");
    tag(d, 6, "");
    whole(d, 70, order ? 688 : 1712);
    tag(d, 100, "AcDbLayout");
    tag(d, 1, name);
    whole(d, 70, 1);
    whole(d, 71, order);
    pair(d, 10, 0.0, 0.0);
    pair(d, 11, 420.0, 297.0);
    point(d, 12, 0.0, 0.0, 0.0);
    point(d, 14, 0.0, 0.0, 0.0);
    point(d, 15, 0.0, 0.0, 0.0);
    real(d, 146, 0.0);
    point(d, 13, 0.0, 0.0, 0.0);
    point(d, 16, 1.0, 0.0, 0.0);
    point(d, 17, 0.0, 1.0, 0.0);
    whole(d, 76, 0);
    handle(d, 330, record);
}

static void write_objects(struct dxf *d)
{
    section(d, "OBJECTS");
    write_dictionary(d, ROOT, (enum handle)0);
    tag(d, 3, "ACAD_GROUP");
    handle(d, 350, GROUPS);
    tag(d, 3, "ACAD_LAYOUT");
    handle(d, 350, LAYOUTS);
    write_dictionary(d, GROUPS, ROOT);
    write_dictionary(d, LAYOUTS, ROOT);
    tag(d, 3, "Layout1");
    handle(d, 350, PAPER_LAYOUT);
    tag(d, 3, "Model");
    handle(d, 350, MODEL_LAYOUT);
    write_layout(d, "Layout1", PAPER_LAYOUT, PAPER_RECORD, 1);
    write_layout(d, "Model", MODEL_LAYOUT, MODEL_RECORD, 0);
    tag(d, 0, "ENDSEC");
}

int pt_write_dxf(const struct patina_drawing *drawing, int flat, FILE *file)
{
    struct dxf d = {.drawing = drawing, .file = file, .flat = flat, .handle = FIRST_FREE};
    begin(&d);
    fprintf(file, "999\nWritten by Patina %s, scale 1:", patina_version());
    char number[40];
    fprintf(file, "%s\n", pt_draw_number(drawing->scale, 10, number));
    write_header(&d);
    section(&d, "CLASSES");
    tag(&d, 0, "ENDSEC");
    write_tables(&d);
    section(&d, "BLOCKS");
    write_block(&d, "*Model_Space", MODEL_BLOCK, MODEL_RECORD, 0);
    write_block(&d, "*Paper_Space", PAPER_BLOCK, PAPER_RECORD, 1);
    tag(&d, 0, "ENDSEC");
    section(&d, "ENTITIES");
    for (uint32_t i = 0; i < drawing->lines.count && !ferror(file); i++)
        write_polyline(&d, &drawing->lines.at[i]);
    tag(&d, 0, "ENDSEC");
    write_objects(&d);
    tag(&d, 0, "EOF");
    return !ferror(file);
}
