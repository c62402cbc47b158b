// SPDX-License-Identifier: GPL-3.0-or-later
// fill's runner in software: find, decide and apply, then mark and restore, as often as the plan allows. How long its lists are stays in a
// buffer, and a dispatch takes its workgroups from there. On a GPU fill_tiles.c does it.
#include "device_gl.h"
#include "shared/filling.h"

enum {
    CHANGE_SIZE = 16, // struct change, struct saved_pixel
};

enum program { FIND_EMPTY, FIND_OCCLUDED, FIND_COARSE, DECIDE, APPLY, WAKE, MARK, RESTORE, SELECT, COUNT };

// Heads of lists in fill.comp's walks: who walks what.
enum { CHANGES, APPLIES, SAVES, TILES, LOOKS, WALKS };
enum { WALKS_SIZE = WALKS * PT_GL_LIST_HEAD };

// Steps of fill.comp that list something.
enum listing { FOUND = 0, WOKEN = 3, MARKED = 4, SELECTED = 6 };

struct fill {
    struct pt_gl_device *d;
    const struct fill_args *args;
    uint32_t phase; // PT_FILL_*
    enum program find;
    int first; // the first of its steps looks everywhere
};

static int bind_scratch(struct fill *f, uint32_t binding, enum pt_gl_scratch_use use, size_t size)
{
    const int result = pt_gl_scratch(f->d, use, size, 0);
    return result == PATINA_OK ? pt_gl_bind(f->d, binding, f->d->scratch[use].name, 0, size, "fill") : result;
}

static int programs(struct fill *f)
{
    static const char *const definitions[] = {"#define STEP 0\n#define OCCLUDED 0\n",
                                              "#define STEP 0\n#define OCCLUDED 1\n",
                                              "#define STEP 0\n#define OCCLUDED 2\n",
                                              "#define STEP 1\n",
                                              "#define STEP 2\n",
                                              "#define STEP 3\n",
                                              "#define STEP 4\n",
                                              "#define STEP 5\n",
                                              "#define STEP 6\n",
                                              "#define STEP 7\n"};
    int result = pt_gl_kernel_program(f->d, PT_KERNEL_fill, f->find, definitions[f->find]);
    for (uint32_t p = DECIDE; p <= COUNT && result == PATINA_OK; p++)
        if (p == COUNT || f->args->unfills || p <= WAKE)
            result = pt_gl_kernel_program(f->d, PT_KERNEL_fill, p, definitions[p]);
    return result;
}

// How many tiles there are: for who says how many workgroups look at all of them, and for those.
static void tell_tiles(struct fill *f)
{
    const GLuint tiles = f->d->tiles.columns * f->d->tiles.rows;
    f->d->gl.ProgramUniform1ui(f->d->programs[PT_KERNEL_fill][COUNT], 3, tiles);
    f->d->gl.ProgramUniform1ui(f->d->programs[PT_KERNEL_fill][WAKE], 3, tiles);
}

// Room for the lists if every pixel changes.
static int prepare(struct fill *f)
{
    const struct view_args *view = &f->args->view;
    // an empty pixel is filled once, but what was there before says what is a stray
    int refills = f->args->unfills && (f->phase == PT_FILL_OCCLUDED || f->args->alone);
    size_t bits = ((size_t)view->width * view->height + 31) / 32 * 4;
    size_t tiles = (size_t)f->d->tiles.columns * f->d->tiles.rows * 4;
    size_t changes = (size_t)(view->rect[2] - view->rect[0]) * (view->rect[3] - view->rect[1]) * CHANGE_SIZE;
    int result = programs(f);
    if (result == PATINA_OK)
        result = bind_scratch(f, PT_BIND_fill_walks, PT_GL_SCRATCH_COUNTERS, WALKS_SIZE);
    if (result == PATINA_OK)
        result = bind_scratch(f, PT_BIND_fill_changed, PT_GL_SCRATCH_SHADED, changes);
    if (result == PATINA_OK)
        result = bind_scratch(f, PT_BIND_fill_saved, PT_GL_SCRATCH_SHOWN, f->args->unfills ? changes : 16);
    if (result == PATINA_OK)
        result = bind_scratch(f, PT_BIND_fill_filled, PT_GL_SCRATCH_FILLED, refills ? bits : 16);
    if (result == PATINA_OK)
        result = bind_scratch(f, PT_BIND_fill_stamps, PT_GL_SCRATCH_STAMPS, tiles);
    if (result == PATINA_OK)
        result = pt_gl_list_begin(f->d, PT_GL_SCRATCH_WOKEN, PT_BIND_fill_woken, tiles);
    if (result != PATINA_OK)
        return result;
    tell_tiles(f);
    pt_gl_zero(f->d, f->d->scratch[PT_GL_SCRATCH_COUNTERS].name, 0, WALKS_SIZE);
    if (refills)
        result = pt_gl_clear(f->d, f->d->scratch[PT_GL_SCRATCH_FILLED].name, 0, bits, (const uint32_t[4]){0});
    return result == PATINA_OK ? pt_gl_check(f->d, "preparing to fill holes") : result;
}

// Takes what a head says.
static int walk(struct fill *f, enum program p, uint32_t head)
{
    const GLuint program = f->d->programs[PT_KERNEL_fill][p];
    if (p == APPLY || p == WAKE || p == RESTORE || p == SELECT)
        f->d->gl.ProgramUniform1ui(program, 1, f->d->stamp);
    if (p == APPLY || p == RESTORE || p == SELECT)
        f->d->gl.ProgramUniform1ui(program, 2, f->d->tiles.columns);
    if (p == DECIDE || p == APPLY || p == MARK)
        f->d->gl.ProgramUniform1ui(program, 5, f->phase);
    return pt_gl_list_dispatch(f->d, PT_KERNEL_fill, p, f->d->scratch[PT_GL_SCRATCH_COUNTERS].name, head * PT_GL_LIST_HEAD);
}

static int count(struct fill *f, enum listing listed)
{
    f->d->gl.ProgramUniform1ui(f->d->programs[PT_KERNEL_fill][COUNT], 0, (GLuint)listed);
    return pt_gl_dispatch(f->d, PT_KERNEL_fill, COUNT, 1, 1);
}

static int find(struct fill *f)
{
    const size_t tiles = (size_t)f->d->tiles.columns * f->d->tiles.rows;
    if (f->first)
        return pt_gl_dispatch_tiles(f->d, PT_KERNEL_fill, f->find,
                                    f->find == FIND_EMPTY ? PT_GL_TILES_RIM : PT_GL_TILES_POINTS);
    return pt_gl_dispatch_tile_list(f->d, PT_KERNEL_fill, f->find, f->d->scratch[PT_GL_SCRATCH_WOKEN].name, 0, tiles);
}

static int fill_step(struct fill *f)
{
    int result = find(f);
    f->d->stamp++;
    if (result == PATINA_OK)
        result = count(f, FOUND);
    if (result == PATINA_OK)
        result = walk(f, DECIDE, CHANGES);
    if (result == PATINA_OK)
        result = walk(f, APPLY, APPLIES);
    if (result == PATINA_OK)
        result = walk(f, WAKE, TILES);
    return result == PATINA_OK ? count(f, WOKEN) : result;
}

// Whether the list of a head is empty. Software has done its work: looking has nobody wait.
static int is_over(struct fill *f, enum pt_gl_scratch_use use, uint32_t head)
{
    uint32_t walk[PT_GL_LIST_HEAD / 4] = {0};
    pt_gl_read(f->d, f->d->scratch[use].name, head * PT_GL_LIST_HEAD, sizeof walk, walk);
    return !walk[3];
}

static int unfill_step(struct fill *f)
{
    f->d->stamp++;
    f->d->gl.ProgramUniform1ui(f->d->programs[PT_KERNEL_fill][MARK], 4, (GLuint)f->first);
    int result = walk(f, MARK, f->first ? SAVES : LOOKS);
    if (result == PATINA_OK)
        result = count(f, MARKED);
    if (result == PATINA_OK)
        result = walk(f, RESTORE, CHANGES);
    if (result == PATINA_OK)
        result = walk(f, SELECT, SAVES);
    return result == PATINA_OK ? count(f, SELECTED) : result;
}

static int repeat(struct fill *f, int (*step)(struct fill *), uint32_t most)
{
    int result = PATINA_OK;
    f->first = 1;
    for (uint32_t i = 0; i < most && result == PATINA_OK; i++) {
        result = step(f);
        f->first = 0;
        if (result == PATINA_OK &&
            (step == fill_step ? is_over(f, PT_GL_SCRATCH_WOKEN, 0) : is_over(f, PT_GL_SCRATCH_COUNTERS, LOOKS)))
            break;
    }
    return result;
}

static int run_phase(struct pt_gl_device *d, const struct fill_args *args, uint32_t phase)
{
    struct fill f = {.d = d, .args = args, .phase = phase, .find = FIND_EMPTY};
    if (phase == PT_FILL_OCCLUDED)
        f.find = args->view.level ? FIND_COARSE : FIND_OCCLUDED;
    int result = prepare(&f);
    if (result == PATINA_OK)
        result = repeat(&f, fill_step, args->iterations);
    if (phase == PT_FILL_BACKGROUND) // the other phase touches no empty pixel
        pt_gl_tiles_forget(d);
    return result == PATINA_OK ? repeat(&f, unfill_step, args->unfills) : result;
}

int pt_gl_fill(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    const struct fill_args *args = work->arguments;
    int result = PATINA_OK;
    if (d->base.info.hardware)
        return pt_gl_fill_tiles(d, work);
    for (uint32_t phase = PT_FILL_BACKGROUND; phase <= PT_FILL_OCCLUDED && result == PATINA_OK; phase++) {
        if (!(args->phases & phase))
            continue;
        result = pt_gl_tiles(d, work->buffers[PT_BUF_fill_keys], &args->view); // anew where the phase before wrote keys
        if (result == PATINA_OK)
            result = pt_gl_bind_buffers(d, work);
        if (result == PATINA_OK)
            result = run_phase(d, args, phase);
    }
    return result;
}
