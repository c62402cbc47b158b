// SPDX-License-Identifier: GPL-3.0-or-later
// PDF 1.7 (ISO 32000-1): one page with an image under paths. Layers are optional content, and the scale is a viewport's measure.
#include "page.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#define POINT (25.4 / 72) // millimeters
enum { CATALOG = 1, PAGES, PAGE, CONTENTS, IMAGE, INFO, LAYERS, OBJECTS = LAYERS + PAGE_LAYERS };

struct text {
    char *bytes;
    size_t size, room;
    int failed;
};

static void add(struct text *text, const char *format, ...) __attribute__((format(printf, 2, 3)));

static void add(struct text *text, const char *format, ...)
{
    enum { LINE = 256 }; // longer than any that is added
    if (!text->failed && text->room - text->size < LINE) {
        const size_t room = text->room ? 2 * text->room : 1 << 16;
        char *grown = room > text->room ? realloc(text->bytes, room) : NULL;
        text->failed = !grown;
        text->bytes = grown ? grown : text->bytes;
        text->room = grown ? room : text->room;
    }
    if (text->failed)
        return;
    va_list list;
    va_start(list, format);
    text->size += (size_t)vsnprintf(text->bytes + text->size, LINE, format, list);
    va_end(list);
}

static void add_shape(struct text *text, const struct page *page, const struct page_shape *shape)
{
    add(text, "%.4g w\n", shape->width);
    for (uint32_t i = 0; i < shape->count; i++)
        add(text, "%.4f %.4f %c\n", page->points[shape->first + i][0], page->points[shape->first + i][1], i ? 'l' : 'm');
    add(text, shape->filled ? "f\n" : shape->closed ? "s\n" : "S\n");
}

static void add_contents(struct text *text, const struct page *page)
{
    add(text, "%.10f 0 0 %.10f 0 0 cm\n1 J 1 j\n", 1 / POINT, 1 / POINT);
    if (page->picture)
        add(text, "/OC /L%d BDC\nq %.6f 0 0 %.6f %.6f %.6f cm /Image Do Q\nEMC\n", PAGE_IMAGE, page->image[2], page->image[3],
            page->image[0], page->image[1]);
    for (uint32_t layer = 0; layer < PAGE_IMAGE; layer++) {
        add(text, "/OC /L%u BDC\n%s d\n", layer, page_layers[layer].dashed ? "[2 1] 0" : "[] 0");
        for (size_t i = 0; i < page->shape_count; i++)
            if (page->shapes[i].layer == layer)
                add_shape(text, page, &page->shapes[i]);
        add(text, "EMC\n");
    }
}

struct pdf {
    FILE *file;
    long places[OBJECTS]; // of objects in the file
};

static void begin(struct pdf *pdf, int object)
{
    pdf->places[object] = ftell(pdf->file);
    fprintf(pdf->file, "%d 0 obj\n", object);
}

static void write_stream(struct pdf *pdf, int object, const char *about, const void *bytes, size_t size)
{
    begin(pdf, object);
    fprintf(pdf->file, "<< %s/Filter /FlateDecode /Length %zu >>\nstream\n", about, size);
    fwrite(bytes, 1, size, pdf->file);
    fputs("\nendstream\nendobj\n", pdf->file);
}

static void write_image(struct pdf *pdf, const struct tool_picture *picture)
{
    char about[256];
    snprintf(about, sizeof about,
             "/Type /XObject /Subtype /Image /Width %u /Height %u /ColorSpace /DeviceRGB /BitsPerComponent 8 "
             "/DecodeParms << /Predictor 15 /Colors 3 /Columns %u >> ",
             picture->width, picture->height, picture->width);
    write_stream(pdf, IMAGE, about, picture->packed, picture->size);
}

// The page. A reader's tool for measuring takes the scale from its viewport.
static void write_page(struct pdf *pdf, const struct page *page)
{
    const double meters = page->scale * POINT / 1000; // of a point
    begin(pdf, PAGE);
    fprintf(pdf->file, "<< /Type /Page /Parent %d 0 R /MediaBox [0 0 %.6f %.6f] /Contents %d 0 R\n/Resources <<", PAGES,
            page->size[0] / POINT, page->size[1] / POINT, CONTENTS);
    if (page->picture)
        fprintf(pdf->file, " /XObject << /Image %d 0 R >>", IMAGE);
    fputs(" /Properties <<", pdf->file);
    for (int layer = 0; layer < PAGE_LAYERS; layer++)
        fprintf(pdf->file, " /L%d %d 0 R", layer, LAYERS + layer);
    fprintf(pdf->file,
            " >> >>\n/VP [ << /Type /Viewport /BBox [%.6f %.6f %.6f %.6f] /Measure << /Type /Measure /Subtype /RL /R (1:%g)\n"
            "/X [ << /U (m) /C %.9g /D 1000 >> ] /D [ << /U (m) /C 1 /D 1000 >> ] /A [ << /U (sq m) /C 1 /D 1000 >> ] >> >> ] "
            ">>\nendobj\n",
            page->drawn[0] / POINT, page->drawn[1] / POINT, page->drawn[2] / POINT, page->drawn[3] / POINT, page->scale,
            meters);
}

static void write_info(struct pdf *pdf, const struct page *page)
{
    begin(pdf, INFO);
    fprintf(pdf->file, "<< /Producer (Patina %s) /Title <FEFF", patina_version());
    for (const char *at = page->title; at && *at;) { // UTF-16
        const uint32_t code = page_code_point(&at);
        if (code < 0x10000)
            fprintf(pdf->file, "%04X", code);
        else
            fprintf(pdf->file, "%04X%04X", 0xD800 + ((code - 0x10000) >> 10), 0xDC00 + ((code - 0x10000) & 0x3FF));
    }
    fputs("> >>\nendobj\n", pdf->file);
}

static void write_layers(struct pdf *pdf)
{
    for (int layer = 0; layer < PAGE_LAYERS; layer++) {
        begin(pdf, LAYERS + layer);
        fprintf(pdf->file, "<< /Type /OCG /Name (%s) >>\nendobj\n", page_layers[layer].name);
    }
    begin(pdf, CATALOG);
    fprintf(pdf->file, "<< /Type /Catalog /Pages %d 0 R /OCProperties <<", PAGES);
    for (int list = 0; list < 2; list++) {
        fputs(list ? "] /D << /Order [" : " /OCGs [", pdf->file);
        for (int layer = 0; layer < PAGE_LAYERS; layer++)
            fprintf(pdf->file, " %d 0 R", LAYERS + layer);
    }
    fputs(" ] >> >>\n/ViewerPreferences << /PrintScaling /None >> >>\nendobj\n", pdf->file);
}

static void write_table(struct pdf *pdf, int count, const int objects[])
{
    const long place = ftell(pdf->file);
    fprintf(pdf->file, "xref\n0 1\n0000000000 65535 f \n");
    for (int i = 0; i < count; i++)
        fprintf(pdf->file, "%d 1\n%010ld 00000 n \n", objects[i], pdf->places[objects[i]]);
    fprintf(pdf->file, "trailer\n<< /Size %d /Root %d 0 R /Info %d 0 R >>\nstartxref\n%ld\n%%%%EOF\n", OBJECTS, CATALOG, INFO,
            place);
}

int page_write_pdf(const struct page *page, FILE *file)
{
    struct pdf pdf = {.file = file};
    struct text text = {0};
    add_contents(&text, page);
    uLongf size = compressBound((uLong)text.size);
    uint8_t *packed = text.failed ? NULL : malloc(size);
    const int good = packed && compress2(packed, &size, (const uint8_t *)text.bytes, (uLong)text.size, 9) == Z_OK;
    if (good) {
        int objects[OBJECTS], count = 0;
        fputs("%PDF-1.7\n%\xC3\xA9\xC3\xA9\n", file); // bytes above 127: the file is binary
        write_layers(&pdf);
        begin(&pdf, PAGES);
        fprintf(file, "<< /Type /Pages /Kids [%d 0 R] /Count 1 >>\nendobj\n", PAGE);
        write_page(&pdf, page);
        write_stream(&pdf, CONTENTS, "", packed, size);
        if (page->picture)
            write_image(&pdf, page->picture);
        write_info(&pdf, page);
        for (int i = 1; i < OBJECTS; i++)
            if (pdf.places[i])
                objects[count++] = i;
        write_table(&pdf, count, objects);
    }
    free(packed);
    free(text.bytes);
    return good ? 0 : -1;
}
