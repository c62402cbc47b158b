// SPDX-License-Identifier: GPL-3.0-or-later
// fill's runner on a GPU: lib/fill_tiles.glsl takes several steps a dispatch, from one pair of planes to another. The pass's own planes
// keep what was there before until the last dispatch writes them.
#include "device_gl.h"
#include "shared/filling.h"

#include <stdio.h>

enum { PROGRAMS = PT_GL_VARIANTS - 2 }; // of fill's, the first of lib/fill_tiles.glsl: a phase each
enum { PIXEL = 12, REST = 128 };        // shared bytes of a pixel, and beside all of them
enum { MOST_SIDE = 64 };                // of a square: its 1024 invocations then hold four pixels each

// A pair of planes: where they lie.
struct state {
    GLuint keys, from;
    size_t from_at; // in its buffer; keys begin at 0
};

struct closing {
    struct pt_gl_device *d;
    const struct fill_args *args;
    uint32_t phase; // PT_FILL_*
    uint32_t side;
    struct state whole, kept, now; // the pass's planes, before the phase, before the next dispatch
    struct state spare[2];
};

static int is_same(const struct state *a, const struct state *b) { return a->keys == b->keys; }

static size_t pixels_of(const struct closing *c) { return (size_t)c->args->view.width * c->args->view.height; }

// Side of the square that a workgroup holds: as much as there is shared memory for.
static uint32_t side_of(const struct pt_gl_device *d)
{
    uint32_t side = MOST_SIDE;
    while (side > 16 && side * side * PIXEL + side * side / 8 + REST > d->shared_size)
        side -= 2;
    return side;
}

static int programs(const struct closing *c)
{
    int result = PATINA_OK;
    for (uint32_t phase = PT_FILL_BACKGROUND; phase <= PT_FILL_OCCLUDED && result == PATINA_OK; phase++) {
        GLuint *program = &c->d->programs[PT_KERNEL_fill][PROGRAMS + phase - 1];
        char definitions[64];
        snprintf(definitions, sizeof definitions, "#define PHASE %u\n#define SIDE %uu\n", phase, c->side);
        if (!*program && c->args->phases & phase)
            result = pt_gl_program(c->d, "lib/fill_tiles.glsl", definitions, program);
    }
    return result;
}

static int make_spare(struct closing *c, uint32_t i)
{
    static const enum pt_gl_scratch_use uses[] = {PT_GL_SCRATCH_SHADED, PT_GL_SCRATCH_SHOWN};
    const size_t count = pixels_of(c), align = c->d->alignment, from_at = (8 * count + align - 1) / align * align;
    const int result = pt_gl_scratch(c->d, uses[i], from_at + 4 * count, 0);
    const GLuint name = c->d->scratch[uses[i]].name;
    c->spare[i] = (struct state){name, name, from_at};
    return result;
}

static int bind(const struct closing *c, const struct state *to)
{
    const size_t count = pixels_of(c);
    const struct {
        uint32_t keys, from;
        const struct state *state;
    } blocks[] = {{PT_BIND_fill_tiles_keys, PT_BIND_fill_tiles_from, to},
                  {PT_BIND_fill_tiles_kept_keys, PT_BIND_fill_tiles_kept_from, &c->kept},
                  {PT_BIND_fill_tiles_whole_keys, PT_BIND_fill_tiles_whole_from, &c->whole}};
    int result = PATINA_OK;
    for (int i = 0; i < 3 && result == PATINA_OK; i++) {
        result = pt_gl_bind(c->d, blocks[i].keys, blocks[i].state->keys, 0, 8 * count, "fill");
        if (result == PATINA_OK)
            result = pt_gl_bind(c->d, blocks[i].from, blocks[i].state->from, blocks[i].state->from_at, 4 * count, "fill");
    }
    if (result == PATINA_OK)
        result = pt_gl_bind_texels(c->d, PT_UNIT_key, c->now.keys, 0, 8 * count);
    return result == PATINA_OK ? pt_gl_bind_texels(c->d, PT_UNIT_from, c->now.from, c->now.from_at, 4 * count) : result;
}

// Some steps, from `now` to `to`.
static int dispatch(struct closing *c, const struct state *to, uint32_t fills, uint32_t unfills, uint32_t guard)
{
    const uint32_t *rect = c->args->view.rect, inner = c->side - 2 * guard;
    const uint32_t variant = PROGRAMS + c->phase - 1;
    int result = bind(c, to);
    c->d->gl.ProgramUniform4ui(c->d->programs[PT_KERNEL_fill][variant], 0, fills, unfills, guard, 0);
    if (result == PATINA_OK)
        result = pt_gl_dispatch(c->d, PT_KERNEL_fill, variant, (rect[2] - rect[0] + inner - 1) / inner,
                                (rect[3] - rect[1] + inner - 1) / inner);
    c->now = *to;
    return result;
}

// How many steps a dispatch takes, of those that are left: as many as leave two fifths of a square's side in its middle. Returns the
// pixels by which what is wrong beside the square may move inwards.
static uint32_t next_steps(const struct closing *c, uint32_t fills_left, uint32_t unfills_left, uint32_t *fills,
                           uint32_t *unfills)
{
    const uint32_t most = c->side * 3 / 10, each = c->phase == PT_FILL_BACKGROUND && c->args->alone ? 2 : 1;
    const int far = c->phase == PT_FILL_OCCLUDED && c->args->refined; // a fill reads pixels that may lie anywhere
    *fills = fills_left < most / each ? fills_left : most / each;
    if (far && *fills > 1)
        *fills = 1;
    const uint32_t room = most - *fills * each;
    *unfills = *fills < fills_left ? 0 : unfills_left < room ? unfills_left : room;
    return *fills * each + *unfills;
}

static uint32_t count_dispatches(const struct closing *c)
{
    uint32_t count = 0, fills_left = c->args->iterations, unfills_left = c->args->unfills, fills, unfills;
    while (fills_left || unfills_left) {
        next_steps(c, fills_left, unfills_left, &fills, &unfills);
        fills_left -= fills;
        unfills_left -= unfills;
        count++;
    }
    return count;
}

// Where a dispatch writes to when so many follow: to the pass's planes last, as far as they do not hold what the phase needs.
static const struct state *target_of(const struct closing *c, uint32_t follow)
{
    const struct state *all[] = {&c->whole, &c->spare[0], &c->spare[1]}, *free_ones[2] = {NULL, NULL};
    for (int i = 0, n = 0; i < 3 && n < 2; i++)
        if (!is_same(all[i], &c->kept))
            free_ones[n++] = all[i];
    return free_ones[follow & 1];
}

static int run_phase(struct closing *c)
{
    uint32_t left = count_dispatches(c), fills_left = c->args->iterations, unfills_left = c->args->unfills;
    int result = PATINA_OK;
    c->kept = c->now;
    while (left && result == PATINA_OK) {
        uint32_t fills, unfills;
        const uint32_t guard = next_steps(c, fills_left, unfills_left, &fills, &unfills);
        const struct state to = *target_of(c, --left);
        result = dispatch(c, &to, fills, unfills, guard);
        fills_left -= fills;
        unfills_left -= unfills;
    }
    return result;
}

int pt_gl_fill_tiles(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    const struct pt_buffer *keys = work->buffers[PT_BUF_fill_keys], *from = work->buffers[PT_BUF_fill_from];
    struct closing c = {.d = d, .args = work->arguments, .side = side_of(d)};
    c.whole = c.now = (struct state){keys->name, from->name, 0};
    int result = programs(&c);
    for (uint32_t i = 0; i < 2 && result == PATINA_OK; i++)
        result = make_spare(&c, i);
    for (c.phase = PT_FILL_BACKGROUND; c.phase <= PT_FILL_OCCLUDED && result == PATINA_OK; c.phase++)
        if (c.args->phases & c.phase)
            result = run_phase(&c);
    pt_gl_tiles_forget(d);
    if (result != PATINA_OK || is_same(&c.now, &c.whole))
        return result;
    c.phase = c.args->phases & PT_FILL_OCCLUDED ? PT_FILL_OCCLUDED : PT_FILL_BACKGROUND;
    return dispatch(&c, &c.whole, 0, 0, 0); // copies the rectangle
}
