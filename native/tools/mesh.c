// SPDX-License-Identifier: GPL-3.0-or-later
// Reads positions and faces of an OBJ file; all else in it is left out.
#include "view.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct growing {
    void *data;
    size_t count, room; // elements
};

static void *next(struct growing *list, size_t size)
{
    if (list->count == list->room) {
        size_t room = list->room ? 2 * list->room : 4096;
        void *grown = realloc(list->data, room * size);
        if (!grown)
            return NULL;
        list->data = grown;
        list->room = room;
    }
    return (char *)list->data + list->count++ * size;
}

#define BLANKS " \t\r\n"

static int take_vertex(const char *text, struct growing *vertices)
{
    double *p = next(vertices, 3 * sizeof *p);
    return !p ? PATINA_ERROR_MEMORY : sscanf(text, "%lf %lf %lf", p, p + 1, p + 2) == 3 ? PATINA_OK : PATINA_ERROR_FORMAT;
}

// A polygon as a fan of triangles. Vertices count from 1, or from the last one backwards with -1.
static int take_face(const char *text, const struct growing *vertices, struct growing *triangles)
{
    uint32_t first = 0, before = 0, corners = 0;
    for (const char *word = text + strspn(text, BLANKS); *word;
         word += strcspn(word, BLANKS), word += strspn(word, BLANKS), corners++) {
        long long number = strtoll(word, NULL, 10), index = number < 0 ? (long long)vertices->count + number : number - 1;
        if (index < 0 || index >= (long long)vertices->count)
            return PATINA_ERROR_FORMAT;
        if (corners >= 2) {
            uint32_t *triangle = next(triangles, 3 * sizeof *triangle);
            if (!triangle)
                return PATINA_ERROR_MEMORY;
            memcpy(triangle, (const uint32_t[3]){first, before, (uint32_t)index}, 3 * sizeof *triangle);
        }
        first = corners ? first : (uint32_t)index;
        before = (uint32_t)index;
    }
    return corners >= 3 ? PATINA_OK : PATINA_ERROR_FORMAT;
}

// The next line, of any length, into *line of *room bytes, which grows. 0 at the end, or without memory.
static int read_line(FILE *file, char **line, size_t *room)
{
    size_t length = 0;
    for (;;) {
        if (*room - length < 2) {
            const size_t wanted = *room ? 2 * *room : 256;
            char *grown = realloc(*line, wanted);
            if (!grown)
                return 0;
            *line = grown;
            *room = wanted;
        }
        const size_t left = *room - length;
        if (!fgets(*line + length, left < 1 << 20 ? (int)left : 1 << 20, file))
            return length > 0;
        length += strlen(*line + length);
        if (length && (*line)[length - 1] == '\n')
            return 1;
    }
}

int tool_load_mesh(const char *path, patina_mesh **out)
{
    struct growing vertices = {0}, triangles = {0};
    FILE *file = pt_stream_open(path, "r");
    char *line = NULL;
    size_t room = 0, number = 0;
    int code = file ? PATINA_OK : PATINA_ERROR_FILE;
    while (!code && read_line(file, &line, &room)) {
        number++;
        if (line[0] == 'v' && line[1] == ' ')
            code = take_vertex(line + 2, &vertices);
        else if (line[0] == 'f' && line[1] == ' ')
            code = take_face(line + 2, &vertices, &triangles);
    }
    if (file)
        fclose(file);
    if (code == PATINA_ERROR_FORMAT)
        fprintf(stderr, "%s: line %zu is no vertex or face of an OBJ file\n", path, number);
    const patina_mesh_desc desc = {.struct_size = sizeof desc,
                                   .vertex_count = vertices.count,
                                   .position = {.data = vertices.data, .type = PATINA_FLOAT64, .components = 3},
                                   .triangle_count = triangles.count,
                                   .indices = triangles.data};
    if (!code)
        code = patina_mesh_create(&desc, out);
    free(line);
    free(vertices.data);
    free(triangles.data);
    return code;
}
