// SPDX-License-Identifier: GPL-3.0-or-later
// fill's runner: pairs of dispatches, decide and apply, then mark and restore, each until nothing changes. Reading the
// count back between them is what lets a phase stop early and lists be no longer than needed.
#include "device_gl.h"

enum {
    TILE_X = 32, // as in fill.comp
    TILE_Y = 8,
    ENTRY_GROUP = 64,
    CHANGE_SIZE = 20, // struct change
    SAVED_SIZE = 24,  // struct saved_pixel
    GROUPS_IN_ROW = 16384,
    LEAST_ENTRIES = 1 << 16,
};

enum step { DECIDE, APPLY, MARK, RESTORE };

struct counters {
    uint32_t changed, saved;
};

struct fill {
    struct pt_gl_device *d;
    const struct fill_args *args;
    const atomic_int *cancel;
    uint32_t tiles_x, tiles_y;
    uint32_t first;
    struct counters counters;
};

static int bind_scratch(struct fill *f, uint32_t binding, enum pt_gl_scratch_use use, size_t size, size_t keep)
{
    int result = pt_gl_scratch(f->d, use, size, keep);
    const struct pt_gl_scratch *scratch = &f->d->scratch[use];
    return result == PATINA_OK ? pt_gl_bind(f->d, binding, scratch->name, 0, scratch->size, "fill") : result;
}

static size_t least(size_t count) { return count > LEAST_ENTRIES ? count : LEAST_ENTRIES; }

static int prepare(struct fill *f)
{
    static const char *const definitions[] = {"#define STEP 0\n", "#define STEP 1\n", "#define STEP 2\n",
                                              "#define STEP 3\n"};
    const struct view_args *view = &f->args->view;
    const GladGLContext *gl = &f->d->gl;
    int result = PATINA_OK;
    for (uint32_t s = 0; s < (f->args->unfills ? 4 : 2) && result == PATINA_OK; s++)
        result = pt_gl_kernel_program(f->d, PT_KERNEL_fill, s, definitions[s]);
    size_t bits = ((size_t)view->width * view->height + 31) / 32 * 4;
    if (result == PATINA_OK)
        result = bind_scratch(f, 5, PT_GL_SCRATCH_COUNTERS, sizeof f->counters, 0);
    if (result == PATINA_OK)
        result = bind_scratch(f, 6, PT_GL_SCRATCH_CHANGED, least(0) * CHANGE_SIZE, 0);
    if (result == PATINA_OK)
        result = bind_scratch(f, 7, PT_GL_SCRATCH_SAVED, f->args->unfills ? least(0) * SAVED_SIZE : 16, 0);
    if (result == PATINA_OK)
        result = bind_scratch(f, 8, PT_GL_SCRATCH_FILLED, f->args->unfills ? bits : 16, 0);
    if (result == PATINA_OK)
        result = bind_scratch(f, 9, PT_GL_SCRATCH_TILES, (size_t)f->tiles_x * f->tiles_y * 4, 0);
    if (result != PATINA_OK || !f->args->unfills)
        return result;
    gl->BindBuffer(GL_COPY_WRITE_BUFFER, f->d->scratch[PT_GL_SCRATCH_FILLED].name);
    gl->ClearBufferSubData(GL_COPY_WRITE_BUFFER, GL_R32UI, 0, (GLsizeiptr)bits, GL_RED_INTEGER, GL_UNSIGNED_INT, NULL);
    return pt_gl_check(f->d, "preparing to fill holes");
}

static int write_counters(struct fill *f)
{
    f->d->gl.BindBuffer(GL_COPY_WRITE_BUFFER, f->d->scratch[PT_GL_SCRATCH_COUNTERS].name);
    f->d->gl.BufferSubData(GL_COPY_WRITE_BUFFER, 0, sizeof f->counters, &f->counters);
    return PATINA_OK;
}

static int read_counters(struct fill *f)
{
    f->d->gl.BindBuffer(GL_COPY_READ_BUFFER, f->d->scratch[PT_GL_SCRATCH_COUNTERS].name);
    f->d->gl.GetBufferSubData(GL_COPY_READ_BUFFER, 0, sizeof f->counters, &f->counters);
    return pt_gl_check(f->d, "counting filled pixels");
}

static int dispatch(struct fill *f, enum step step, uint32_t entries, uint32_t groups_x, uint32_t groups_y)
{
    const GladGLContext *gl = &f->d->gl;
    GLuint program = f->d->programs[PT_KERNEL_fill][step];
    if (step == DECIDE || step == APPLY) {
        gl->ProgramUniform1ui(program, 0, f->d->stamp);
        gl->ProgramUniform1ui(program, 3, f->tiles_x);
    }
    if (step == DECIDE)
        gl->ProgramUniform1ui(program, 1, f->first);
    gl->ProgramUniform1ui(program, 2, entries);
    return pt_gl_dispatch(f->d, PT_KERNEL_fill, step, groups_x, groups_y);
}

static int dispatch_entries(struct fill *f, enum step step, uint32_t entries)
{
    uint32_t groups = (entries + ENTRY_GROUP - 1) / ENTRY_GROUP;
    uint32_t x = groups < GROUPS_IN_ROW ? groups : GROUPS_IN_ROW;
    return dispatch(f, step, entries, x, x ? (groups + x - 1) / x : 0);
}

// Decides until the list holds all that is to change; counters.changed says how many.
static int decide(struct fill *f)
{
    for (;;) {
        uint32_t room = (uint32_t)(f->d->scratch[PT_GL_SCRATCH_CHANGED].size / CHANGE_SIZE);
        f->counters.changed = 0;
        write_counters(f);
        int result = dispatch(f, DECIDE, room, f->tiles_x, f->tiles_y);
        if (result == PATINA_OK)
            result = read_counters(f);
        if (result != PATINA_OK || f->counters.changed <= room)
            return result;
        result = bind_scratch(f, 6, PT_GL_SCRATCH_CHANGED, (size_t)f->counters.changed * CHANGE_SIZE, 0);
        if (result != PATINA_OK)
            return result;
    }
}

static int fill_step(struct fill *f)
{
    int result = decide(f);
    f->first = 0;
    f->d->stamp++;
    if (result != PATINA_OK || !f->counters.changed)
        return result;
    if (f->args->unfills)
        result = bind_scratch(f, 7, PT_GL_SCRATCH_SAVED,
                              ((size_t)f->counters.saved + f->counters.changed) * SAVED_SIZE,
                              (size_t)f->counters.saved * SAVED_SIZE);
    if (result == PATINA_OK)
        result = dispatch_entries(f, APPLY, f->counters.changed);
    uint32_t changed = f->counters.changed;
    if (result == PATINA_OK && f->args->unfills)
        result = read_counters(f);
    f->counters.changed = changed;
    return result;
}

static int unfill_step(struct fill *f)
{
    f->counters.changed = 0;
    write_counters(f);
    int result = dispatch_entries(f, MARK, f->counters.saved);
    if (result == PATINA_OK)
        result = dispatch_entries(f, RESTORE, f->counters.saved);
    return result == PATINA_OK ? read_counters(f) : result;
}

// Repeats a step until nothing changes, `most` times at the most.
static int repeat(struct fill *f, int (*step)(struct fill *), uint32_t most)
{
    for (uint32_t i = 0; i < most; i++) {
        if (f->cancel && atomic_load(f->cancel))
            return pt_gl_fail(f->d, PATINA_ERROR_CANCELLED, "cancelled");
        int result = step(f);
        if (result != PATINA_OK || !f->counters.changed)
            return result;
    }
    return PATINA_OK;
}

int pt_gl_fill(struct pt_gl_device *d, const struct fill_args *args, const atomic_int *cancel)
{
    const uint32_t *rect = args->view.rect;
    if (rect[2] <= rect[0] || rect[3] <= rect[1])
        return PATINA_OK;
    struct fill f = {.d = d, .args = args, .cancel = cancel, .first = 1};
    f.tiles_x = (rect[2] - rect[0] + TILE_X - 1) / TILE_X;
    f.tiles_y = (rect[3] - rect[1] + TILE_Y - 1) / TILE_Y;
    d->stamp++;
    int result = prepare(&f);
    if (result == PATINA_OK)
        result = repeat(&f, fill_step, args->iterations);
    if (result == PATINA_OK && f.counters.saved)
        result = repeat(&f, unfill_step, args->unfills);
    return result;
}
