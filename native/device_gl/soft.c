// SPDX-License-Identifier: GPL-3.0-or-later
// Runners of soft points: gather, and soft, whose tiles are drawn in batches as large as their lists fit the bins. For these their lengths are
// read back, once a run. Long lists are drawn in parts, each of the tiles that the part before left unfinished.
#include "device_gl.h"
#include "shared/balls.h"

#include <stdio.h>
#include <stdlib.h>

int pt_gl_gather(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    const struct shade_args *args = &((const struct gather_args *)work->arguments)->shade;
    const struct instance_args *instance = &args->instance;
    const uint32_t opacity = instance->has_opacities != 0, lit = !instance->lit ? 0 : instance->specular > 0.0f ? 2 : 1;
    const uint32_t directed = args->directed && lit, casting = args->casting && lit,
                   variant = instance->color_format % 5 + 5 * (lit + 3 * (opacity + 2 * (directed + 2 * casting)));
    char definitions[128];
    snprintf(definitions, sizeof definitions,
             "#define COLOR_FORMAT %u\n#define LIT %u\n#define OPACITY %u\n#define DIRECTED %u\n#define CASTING %u\n",
             instance->color_format % 5, lit, opacity, directed, casting);
    int result = pt_gl_kernel_program(d, PT_KERNEL_gather, variant, definitions);
    if (result != PATINA_OK)
        return result;
    if (lit)
        pt_gl_set_scales(d, d->programs[PT_KERNEL_gather][variant], args);
    return pt_gl_points_of(d, work, variant);
}

// Variants of soft, drawing last: by model, and so are those of lights' views.
enum { COUNT, FILL, SORT, DRAW, VEIL = DRAW + PT_SOFT_MODELS };
enum { RUN = 256, GROUP = 64 }; // tiles between two looks at cancel; invocations that share out records, as in soft.comp
enum { TOLD = 64, ENTRY = 8, STATE = 32 }; // bytes: what is counted; an entry of a list; a pixel, as in soft.comp
enum { SORTED_AT_ONCE = 1 << 16 };         // entries of a list: 17 * 8 rounds of 128 steps
enum { STEPS = 60000 };                    // through loops, that llvmpipe takes: it ends them beyond 65,535
enum { LIST = PT_GL_LIST_HEAD + 4 * RUN }; // bytes of a list of tiles; there are two, as in soft.comp
enum { LOOK = 16, LOOK_MOST = 64 }; // parts before it is looked whether others follow; then as many again, at most that many

struct soft {
    const struct pt_gl_work *work;
    const struct soft_args *args;
    uint32_t columns, tiles, model;
    uint32_t draw;             // which variant does
    uint32_t *counts, *begins; // of every tile; of the batch's, and the end of the last
};

static int programs(struct pt_gl_device *d, const struct soft *soft)
{
    int result = PATINA_OK;
    for (uint32_t step = COUNT; step <= DRAW && result == PATINA_OK; step++) {
        const uint32_t variant = step < DRAW ? step : soft->draw;
        char definitions[64];
        snprintf(definitions, sizeof definitions, "#define STEP %u\n#define MODEL %u\n#define VEIL %d\n", step, soft->model,
                 soft->args->veils > 0);
        result = pt_gl_kernel_program(d, PT_KERNEL_soft, variant, definitions);
        if (result == PATINA_OK)
            d->gl.ProgramUniform1ui(d->programs[PT_KERNEL_soft][variant], 2, soft->columns);
    }
    return result;
}

static int make_room(struct pt_gl_device *d, const struct soft *soft)
{
    const struct {
        enum pt_gl_scratch_use use;
        uint32_t binding;
        size_t size;
    } rooms[] = {{PT_GL_SCRATCH_SOFT_COUNTS, PT_BIND_soft_counts, ((size_t)soft->tiles + 1) * 4},
                 {PT_GL_SCRATCH_SOFT_BEGINS, PT_BIND_soft_begins, ((size_t)soft->tiles + 1) * 4},
                 {PT_GL_SCRATCH_SOFT_STATES, PT_BIND_soft_states, (size_t)RUN * PT_SOFT_TILE * PT_SOFT_TILE * STATE},
                 {PT_GL_SCRATCH_COUNTERS, PT_BIND_soft_unfinished, 2 * LIST}};
    int result = PATINA_OK;
    for (size_t i = 0; i < sizeof rooms / sizeof rooms[0] && result == PATINA_OK; i++) {
        result = pt_gl_scratch(d, rooms[i].use, rooms[i].size, 0);
        if (result == PATINA_OK)
            result = pt_gl_bind(d, rooms[i].binding, d->scratch[rooms[i].use].name, 0, rooms[i].size, "soft");
    }
    return result;
}

static int clear(struct pt_gl_device *d, GLuint name, size_t offset, size_t size)
{
    return pt_gl_clear(d, name, offset, size, (const uint32_t[4]){0});
}

static int run_records(struct pt_gl_device *d, const struct soft *soft, uint32_t step)
{
    uint32_t x, y;
    const int result = clear(d, d->scratch[PT_GL_SCRATCH_SOFT_COUNTS].name, 0, (size_t)soft->tiles * 4);
    pt_gl_grid((soft->args->records + GROUP - 1) / GROUP, &x, &y);
    return result == PATINA_OK ? pt_gl_dispatch(d, PT_KERNEL_soft, step, x, y) : result;
}

static uint32_t longest(const struct soft *soft, uint32_t first, uint32_t end)
{
    uint32_t most = 0;
    for (uint32_t tile = first; tile < end; tile++)
        most = soft->counts[tile] > most ? soft->counts[tile] : most;
    return most;
}

static void set_tiles(struct pt_gl_device *d, uint32_t variant, uint32_t first, uint32_t end, uint32_t part)
{
    const GLuint program = d->programs[PT_KERNEL_soft][variant];
    d->gl.ProgramUniform1ui(program, 0, first);
    d->gl.ProgramUniform1ui(program, 1, end);
    d->gl.ProgramUniform1ui(program, 3, part);
}

// A workgroup for each of these tiles.
static int run_tiles(struct pt_gl_device *d, uint32_t variant, uint32_t first, uint32_t end, uint32_t part)
{
    set_tiles(d, variant, first, end, part);
    return pt_gl_dispatch(d, PT_KERNEL_soft, variant, end - first, 1);
}

static int sort_tiles(struct pt_gl_device *d, const struct soft *soft, uint32_t first, uint32_t end)
{
    const uint32_t most = longest(soft, first, end);
    int result = PATINA_OK;
    if (most < 2)
        return result;
    if (most <= SORTED_AT_ONCE)
        return run_tiles(d, SORT, first, end, 0);
    for (uint64_t run = 2; run < 2 * (uint64_t)most && result == PATINA_OK; run *= 2)
        for (uint64_t apart = run / 2; apart && result == PATINA_OK; apart /= 2) {
            d->gl.ProgramUniform1ui(d->programs[PT_KERNEL_soft][SORT], 4, (GLuint)apart);
            result = run_tiles(d, SORT, first, end, (uint32_t)run);
        }
    return result;
}

// After so many parts no pixel is left unfinished, for each but the last takes PT_SOFT_PART steps at least. Of m balls on a ray there are
// 2 m places where one begins or ends; next_end takes 2 m steps to find the next of them, and once more to find none.
static uint64_t most_parts(const struct soft *soft, uint64_t most)
{
    uint64_t steps = most + (2 * most + 1) * 2 * most;
    if (soft->args->veils) {
        const uint32_t set = soft->args->shells, known = (uint32_t)PT_SOFT_SHELLS, shells = set > known ? set : known;
        steps = most * (1 + ((uint64_t)soft->args->veils + 1) * (1 + (uint64_t)shells));
    } else if (PT_SOFT_DISCS(soft->model)) {
        return most ? (most + PT_SOFT_PART - 1) / PT_SOFT_PART : 1;
    }
    return 1 + steps / PT_SOFT_PART;
}

// Of all these tiles, or of those that the part before left.
static int draw_part(struct pt_gl_device *d, const struct soft *soft, uint32_t first, uint32_t end, uint32_t part)
{
    const GLuint lists = d->scratch[PT_GL_SCRATCH_COUNTERS].name;
    set_tiles(d, soft->draw, first, end, part);
    pt_gl_zero(d, lists, part % 2 * LIST, PT_GL_LIST_HEAD);
    if (!part)
        return pt_gl_dispatch(d, PT_KERNEL_soft, soft->draw, end - first, 1);
    const int result = pt_gl_list_groups(d, PT_BIND_soft_unfinished, 2, LIST, 1, 1);
    return result == PATINA_OK ? pt_gl_list_dispatch(d, PT_KERNEL_soft, soft->draw, lists, (part + 1) % 2 * LIST) : result;
}

static int is_over(struct pt_gl_device *d, uint32_t part, int *over)
{
    uint32_t head[PT_GL_LIST_HEAD / 4] = {0};
    const int result = pt_gl_read(d, d->scratch[PT_GL_SCRATCH_COUNTERS].name, part % 2 * LIST, sizeof head, head);
    *over = !head[3];
    return result;
}

// Parts that find nothing to do cost next to nothing, so on a GPU it is looked for an end only where there may be many; software, which
// has done its work, looks behind each.
static int draw_tiles(struct pt_gl_device *d, const struct soft *soft, uint32_t first, uint32_t end)
{
    const uint64_t most = most_parts(soft, longest(soft, first, end));
    uint64_t look = d->base.info.hardware ? LOOK : 1;
    int result = PATINA_OK, over = 0;
    for (uint64_t part = 0; part < most && !over && result == PATINA_OK; part++) {
        result = draw_part(d, soft, first, end, (uint32_t)part);
        if (result != PATINA_OK || part + 1 < look || part + 1 == most)
            continue;
        result = is_over(d, (uint32_t)part, &over);
        look += !d->base.info.hardware ? 1 : look < LOOK_MOST ? look : LOOK_MOST;
    }
    return result;
}

// The tiles from `first` on whose lists fit; *end: behind the last of them.
static int run_batch(struct pt_gl_device *d, struct soft *soft, uint32_t first, uint32_t *end)
{
    const size_t room = (soft->work->buffers[PT_BUF_soft_bins]->size - TOLD) / ENTRY;
    size_t used = 0;
    for (*end = first; *end < soft->tiles && used + soft->counts[*end] <= room; ++*end) {
        soft->begins[*end] = (uint32_t)used;
        used += soft->counts[*end];
    }
    soft->begins[*end] = (uint32_t)used;
    if (*end == first)
        return pt_gl_fail(d, PATINA_ERROR_MEMORY, "soft: the bins have no room for a tile's %u points", soft->counts[first]);
    d->gl.BindBuffer(GL_COPY_WRITE_BUFFER, d->scratch[PT_GL_SCRATCH_SOFT_BEGINS].name);
    d->gl.BufferSubData(GL_COPY_WRITE_BUFFER, 0, (GLsizeiptr)(((size_t)soft->tiles + 1) * 4), soft->begins);
    d->gl.ProgramUniform1ui(d->programs[PT_KERNEL_soft][FILL], 0, first);
    d->gl.ProgramUniform1ui(d->programs[PT_KERNEL_soft][FILL], 1, *end);
    int result = used ? run_records(d, soft, FILL) : PATINA_OK;
    for (uint32_t tile = first; tile < *end && result == PATINA_OK; tile += RUN) {
        const uint32_t last = *end - tile < RUN ? *end : tile + RUN;
        result = sort_tiles(d, soft, tile, last);
        if (result == PATINA_OK)
            result = draw_tiles(d, soft, tile, last);
    }
    return result;
}

// Software ends loops that take too many steps, without a word: of a box over tiles; of a piece of a ray through a list, twice, and
// of counting before it.
static int can_loop(struct pt_gl_device *d, const struct soft *soft)
{
    const uint32_t most = longest(soft, 0, soft->tiles);
    if (d->base.info.hardware)
        return PATINA_OK;
    if (soft->tiles > STEPS)
        return pt_gl_fail(d, PATINA_ERROR_UNSUPPORTED, "soft points: a picture of %u tiles; OpenGL in software takes %d",
                          soft->tiles, STEPS);
    if (!PT_SOFT_DISCS(soft->model) && !soft->args->veils && most > (STEPS - PT_SOFT_PART) / 2)
        return pt_gl_fail(d, PATINA_ERROR_UNSUPPORTED,
                          "soft points: %u balls on a tile; OpenGL in software takes %u, but for the Express model", most,
                          (STEPS - PT_SOFT_PART) / 2);
    return PATINA_OK;
}

int pt_gl_soft(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    const struct soft_args *args = work->arguments;
    const uint32_t *rect = args->view.rect;
    struct soft soft = {.work = work, .args = args, .model = args->model};
    if (rect[0] >= rect[2] || rect[1] >= rect[3])
        return PATINA_OK;
    soft.draw = (args->veils ? VEIL : DRAW) + soft.model;
    soft.columns = (rect[2] - rect[0] + PT_SOFT_TILE - 1) / PT_SOFT_TILE;
    soft.tiles = soft.columns * ((rect[3] - rect[1] + PT_SOFT_TILE - 1) / PT_SOFT_TILE);
    soft.counts = calloc(2 * ((size_t)soft.tiles + 1), sizeof *soft.counts);
    if (!soft.counts)
        return pt_gl_fail(d, PATINA_ERROR_MEMORY, "out of memory");
    soft.begins = soft.counts + soft.tiles + 1;
    int result = programs(d, &soft);
    if (result == PATINA_OK)
        result = make_room(d, &soft);
    if (result == PATINA_OK)
        result = clear(d, work->buffers[PT_BUF_soft_bins]->name, 0, TOLD);
    if (result == PATINA_OK)
        result = run_records(d, &soft, COUNT);
    if (result == PATINA_OK)
        result = pt_gl_read(d, d->scratch[PT_GL_SCRATCH_SOFT_COUNTS].name, 0, (size_t)soft.tiles * 4, soft.counts);
    if (result == PATINA_OK)
        result = can_loop(d, &soft);
    for (uint32_t tile = 0; tile < soft.tiles && result == PATINA_OK;)
        result = run_batch(d, &soft, tile, &tile);
    free(soft.counts);
    return result;
}
