// SPDX-License-Identifier: GPL-3.0-or-later
// Pages: what they hold, and their image.
#include "page.h"
#include "base/words.h"

#include <stdlib.h>
#include <string.h>
#include <zlib.h>

enum { LEVEL = 4, FILTER_SUB = 1, LEAST_ROOM = 1 << 16 };

const struct page_layer page_layers[PAGE_LAYERS] = {
    // the weights of patina/drawings.h
    {"cut", 0.35, 0},           {"cut-bridged", 0.35, 1}, {"outline", 0.25, 0}, {"crease", 0.09, 0}, {"contour", 0.13, 0},
    {"contour-index", 0.25, 0}, {"profile", 0.25, 0},     {"frame", 0.7, 0},    {"text", 0.13, 0},   {"image", 0, 0},
};

// ---- shapes ------------------------------------------------------------------------------------------------------

// Makes room for one more. 0, or -1.
static int grow(void **list, size_t count, size_t *room, size_t each)
{
    if (count < *room)
        return 0;
    const size_t wanted = *room ? 2 * *room : 256;
    void *grown = wanted < SIZE_MAX / each ? realloc(*list, wanted * each) : NULL;
    if (!grown)
        return -1;
    *list = grown;
    *room = wanted;
    return 0;
}

void page_shape(struct page *page, uint32_t layer, double width, int closed, int filled)
{
    if (page->point_count > UINT32_MAX ||
        grow((void **)&page->shapes, page->shape_count, &page->shape_room, sizeof *page->shapes))
        page->failed = 1;
    if (page->failed)
        return;
    page->shapes[page->shape_count++] = (struct page_shape){.layer = layer,
                                                            .first = (uint32_t)page->point_count,
                                                            .closed = closed,
                                                            .filled = filled,
                                                            .width = width > 0 ? width : page_layers[layer].weight};
}

void page_point(struct page *page, double x, double y)
{
    if (grow((void **)&page->points, page->point_count, &page->point_room, sizeof *page->points))
        page->failed = 1;
    if (page->failed)
        return;
    double *point = page->points[page->point_count++];
    point[0] = x;
    point[1] = y;
    page->shapes[page->shape_count - 1].count++;
}

void page_line(struct page *page, uint32_t layer, double width, double x0, double y0, double x1, double y1)
{
    page_shape(page, layer, width, 0, 0);
    page_point(page, x0, y0);
    page_point(page, x1, y1);
}

void page_box(struct page *page, uint32_t layer, double width, int filled, const double corners[4])
{
    page_shape(page, layer, width, 1, filled);
    for (int i = 0; i < 4; i++)
        page_point(page, corners[i == 1 || i == 2 ? 2 : 0], corners[i < 2 ? 1 : 3]);
}

void page_free(struct page *page)
{
    free(page->shapes);
    free(page->points);
    *page = (struct page){0};
}

int page_write(const struct page *page, const char *path)
{
    const char *dot = strrchr(path, '.');
    struct pt_whole whole;
    char why[128];
    if (page->failed) {
        tool_say("'%s' cannot be written: out of memory", path);
        return -1;
    }
    int error = pt_whole_begin(path, &whole), lacks = 0;
    if (!error) {
        const int pdf = dot && pt_same_word(dot, ".pdf");
        lacks = pdf ? page_write_pdf(page, whole.stream) : page_write_svg(page, whole.stream);
        error = pt_whole_end(&whole, !lacks && !fflush(whole.stream) && !ferror(whole.stream));
    }
    if (lacks)
        tool_say("'%s' cannot be written: out of memory", path);
    else if (error)
        tool_say("'%s' cannot be written: %s", path, pt_error_text(error, why, sizeof why));
    return lacks || error ? -1 : 0;
}

// ---- the image ---------------------------------------------------------------------------------------------------

static int no_memory(void)
{
    tool_say("out of memory for the image of a page: make --pixel larger");
    return -1;
}

int tool_picture_begin(struct tool_picture *picture, uint32_t width, uint32_t height)
{
    *picture = (struct tool_picture){.width = width, .height = height, .room = LEAST_ROOM};
    picture->state = calloc(1, sizeof(z_stream));
    picture->row = malloc(6 * (size_t)width + 1); // as encoded, then filtered behind it
    picture->packed = malloc(picture->room);
    if (picture->state && picture->row && picture->packed && deflateInit(picture->state, LEVEL) == Z_OK)
        return 0;
    free(picture->state);
    picture->state = NULL;
    return no_memory();
}

// Packs bytes; ends the stream if there are none.
static int pack(struct tool_picture *picture, uint8_t *bytes, size_t size)
{
    z_stream *z = picture->state;
    int code;
    z->next_in = bytes;
    z->avail_in = (uInt)size;
    do {
        if (picture->size == picture->room) {
            uint8_t *grown = picture->room < SIZE_MAX / 2 ? realloc(picture->packed, 2 * picture->room) : NULL;
            if (!grown)
                return no_memory();
            picture->packed = grown;
            picture->room *= 2;
        }
        const size_t left = picture->room - picture->size;
        const uInt room = left < LEAST_ROOM ? (uInt)left : LEAST_ROOM;
        z->next_out = picture->packed + picture->size;
        z->avail_out = room;
        code = deflate(z, size ? Z_NO_FLUSH : Z_FINISH);
        picture->size += room - z->avail_out;
    } while (z->avail_in || (!size && code != Z_STREAM_END));
    return 0;
}

int tool_picture_rows(struct tool_picture *picture, const float *pixels, uint32_t rows)
{
    const size_t width = picture->width;
    int bad = 0;
    for (size_t y = rows; y-- > 0 && !bad;) {
        uint8_t *plain = picture->row, *filtered = plain + 3 * width;
        for (size_t x = 0; x < width; x++) {
            const float *pixel = pixels + 4 * (y * width + x), under = 1.0f - pixel[3];
            const float over[4] = {pixel[0] + under, pixel[1] + under, pixel[2] + under, 1.0f};
            tool_encode_row(plain + 3 * x, over, 1, 0);
        }
        filtered[0] = FILTER_SUB;
        for (size_t i = 0; i < 3 * width; i++)
            filtered[1 + i] = (uint8_t)(plain[i] - (i < 3 ? 0 : plain[i - 3]));
        bad = pack(picture, filtered, 3 * width + 1);
    }
    return bad;
}

int tool_picture_end(struct tool_picture *picture) { return pack(picture, picture->row, 0); }

void tool_picture_free(struct tool_picture *picture)
{
    if (picture->state)
        deflateEnd(picture->state);
    free(picture->state);
    free(picture->row);
    free(picture->packed);
    *picture = (struct tool_picture){0};
}
