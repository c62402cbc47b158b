// SPDX-License-Identifier: GPL-3.0-or-later
// Which tiles of a key plane hold points: in software filters visit no others. The lists last as long as the keys do not change. On a GPU
// filters visit all tiles: a dispatch takes longer than those that are empty.
#include "device_gl.h"

#include <string.h>

enum { TILE = 8, GROUP = 32, LISTS = 2 }; // as in lib/tiles.glsl
// Workgroups between two looks at cancel: 1M pixels. Two cores shade as many in 50 ms.
enum { LONG_RUN = 4096 };

void pt_gl_tiles_forget(struct pt_gl_device *d)
{
    d->tiles.valid = 0;
    d->shown = 0;
}

static int programs(struct pt_gl_device *d)
{
    static const char *const definitions[] = {"#define STEP 0\n", "#define STEP 1\n"};
    int result = PATINA_OK;
    for (int i = 0; i < 2 && result == PATINA_OK; i++)
        if (!d->tile_programs[i])
            result = pt_gl_program(d, "lib/tile_lists.glsl", definitions[i], &d->tile_programs[i]);
    return result;
}

static int room(struct pt_gl_device *d, struct pt_gl_tiles *t)
{
    size_t tiles = (size_t)t->columns * t->rows;
    t->stride = (PT_GL_LIST_HEAD / 4 + tiles + 63) & ~(size_t)63; // a list begins where a block may begin
    int result = pt_gl_scratch(d, PT_GL_SCRATCH_TILES, tiles * 4, 0);
    if (result == PATINA_OK)
        result = pt_gl_scratch(d, PT_GL_SCRATCH_TILE_LISTS, LISTS * t->stride * 4, 0);
    return result;
}

static int build(struct pt_gl_device *d, struct pt_gl_tiles *t)
{
    const GladGLContext *gl = &d->gl;
    const struct pt_gl_scratch *s = d->scratch;
    size_t tiles = (size_t)t->columns * t->rows;
    for (int i = 0; i < LISTS; i++)
        pt_gl_zero(d, s[PT_GL_SCRATCH_TILE_LISTS].name, i * t->stride * 4, PT_GL_LIST_HEAD);
    int result = pt_gl_bind(d, PT_BIND_tile_lists_tiles, s[PT_GL_SCRATCH_TILES].name, 0, tiles * 4, "tiles");
    if (result == PATINA_OK)
        result = pt_gl_bind(d, PT_BIND_tile_lists_lists, s[PT_GL_SCRATCH_TILE_LISTS].name, 0, LISTS * t->stride * 4, "tiles");
    if (result != PATINA_OK)
        return result;
    for (int i = 0; i < 2; i++) {
        GLuint program = d->tile_programs[i], x = (t->columns + GROUP - 1) / GROUP, y = t->rows;
        gl->ProgramUniform4ui(program, 0, t->rect[0], t->rect[1], t->rect[2], t->rect[3]);
        gl->ProgramUniform1ui(program, 1, t->width);
        gl->ProgramUniform2ui(program, 2, t->columns, t->rows);
        gl->ProgramUniform1ui(program, 3, (GLuint)t->stride);
        if (i == 1)
            pt_gl_grid((uint32_t)((tiles + GROUP - 1) / GROUP), &x, &y);
        pt_gl_use(d, program);
        gl->DispatchCompute(x, y, 1);
        gl->MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
    }
    return pt_gl_list_groups(d, PT_BIND_tile_lists_lists, LISTS, t->stride * 4, GROUP / TILE, 1);
}

int pt_gl_tiles(struct pt_gl_device *d, const struct pt_buffer *keys, const struct view_args *view)
{
    struct pt_gl_tiles *t = &d->tiles;
    if (t->valid && t->keys == keys->name && t->width == view->width && !memcmp(t->rect, view->rect, sizeof t->rect))
        return PATINA_OK;
    *t = (struct pt_gl_tiles){.keys = keys->name, .width = view->width};
    memcpy(t->rect, view->rect, sizeof t->rect);
    if (t->rect[2] <= t->rect[0] || t->rect[3] <= t->rect[1])
        return PATINA_OK;
    t->columns = (t->rect[2] - t->rect[0] + TILE - 1) / TILE;
    t->rows = (t->rect[3] - t->rect[1] + TILE - 1) / TILE;
    if (d->base.info.hardware)
        return PATINA_OK;
    int result = programs(d);
    if (result == PATINA_OK)
        result = room(d, t);
    if (result == PATINA_OK)
        result = pt_gl_bind_texture(d, PT_UNIT_key, keys);
    if (result == PATINA_OK)
        result = build(d, t);
    t->valid = result == PATINA_OK;
    return result;
}

int pt_gl_dispatch_tiles(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t variant, enum pt_gl_tile_list list)
{
    const struct pt_gl_tiles *t = &d->tiles;
    const size_t tiles = (size_t)t->columns * t->rows, head = list * t->stride * 4;
    if (d->base.info.hardware) {
        uint32_t x, y;
        pt_gl_grid((uint32_t)((tiles + GROUP / TILE - 1) / (GROUP / TILE)), &x, &y);
        return pt_gl_dispatch(d, kernel, variant, x, y);
    }
    return tiles ? pt_gl_dispatch_tile_list(d, kernel, variant, d->scratch[PT_GL_SCRATCH_TILE_LISTS].name, head, tiles)
                 : PATINA_OK;
}

int pt_gl_dispatch_tile_list(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t variant, GLuint name, size_t head,
                             size_t most)
{
    enum { TILES_EACH = GROUP / TILE };
    const GLuint program = d->programs[kernel][variant];
    uint32_t words[PT_GL_LIST_HEAD / 4];
    int result = pt_gl_bind(d, PT_BIND_tile_list, name, head, PT_GL_LIST_HEAD + 4 * most, "tiles");
    d->gl.ProgramUniform1ui(program, 15, d->tiles.columns);
    if (result == PATINA_OK && most <= LONG_RUN * TILES_EACH)
        return pt_gl_list_dispatch(d, kernel, variant, name, head);
    if (result == PATINA_OK)
        result = pt_gl_read(d, name, head, sizeof words, words); // software has done its work: this does not wait
    const uint32_t groups = result == PATINA_OK ? (words[3] + TILES_EACH - 1) / TILES_EACH : 0;
    for (uint32_t first = 0; first < groups && result == PATINA_OK; first += LONG_RUN) {
        d->gl.ProgramUniform1ui(program, 13, first);
        result = pt_gl_dispatch(d, kernel, variant, groups - first < LONG_RUN ? groups - first : LONG_RUN, 1);
    }
    d->gl.ProgramUniform1ui(program, 13, 0);
    return result;
}
