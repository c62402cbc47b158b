// SPDX-License-Identifier: GPL-3.0-or-later
// fill's runner: find, decide and apply, then mark and restore, each until nothing changes. Reading the counts back
// between them is what lets a phase stop early, and keeps lists and dispatches no longer than needed.
#include "device_gl.h"
#include "shared/filling.h"

enum {
    ENTRY_GROUP = 64, // as in fill.comp
    CHANGE_SIZE = 16, // struct change
    SAVED_SIZE = 20,  // struct saved_pixel
    LEAST_ENTRIES = 1 << 16,
};

enum program { FIND_EMPTY, FIND_OCCLUDED, FIND_COARSE, DECIDE, APPLY, WAKE, MARK, RESTORE, SELECT };

struct counters {
    uint32_t changed, saved, woken;
};

struct fill {
    struct pt_gl_device *d;
    const struct fill_args *args;
    const atomic_int *cancel;
    uint32_t phase; // PT_FILL_*
    enum program find;
    int first; // the first of its steps looks everywhere
    struct counters counters;
};

static int bind_scratch(struct fill *f, uint32_t binding, enum pt_gl_scratch_use use, size_t size, size_t keep)
{
    int result = pt_gl_scratch(f->d, use, size, keep);
    const struct pt_gl_scratch *scratch = &f->d->scratch[use];
    size_t bound = scratch->size < f->d->block_size ? scratch->size : f->d->block_size & ~(size_t)15;
    return result == PATINA_OK ? pt_gl_bind(f->d, binding, scratch->name, 0, size > bound ? size : bound, "fill") : result;
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
                                              "#define STEP 6\n"};
    int result = pt_gl_kernel_program(f->d, PT_KERNEL_fill, f->find, definitions[f->find]);
    for (uint32_t p = DECIDE; p <= (f->args->unfills ? SELECT : WAKE) && result == PATINA_OK; p++)
        result = pt_gl_kernel_program(f->d, PT_KERNEL_fill, p, definitions[p]);
    return result;
}

static int prepare(struct fill *f)
{
    const struct view_args *view = &f->args->view;
    const GladGLContext *gl = &f->d->gl;
    // an empty pixel is filled once, but what was there before says what is a stray
    int refills = f->args->unfills && (f->phase == PT_FILL_OCCLUDED || f->args->alone);
    size_t bits = ((size_t)view->width * view->height + 31) / 32 * 4;
    size_t tiles = (size_t)f->d->tiles.columns * f->d->tiles.rows * 4;
    int result = programs(f);
    if (result == PATINA_OK)
        result = bind_scratch(f, PT_BIND_fill_counters, PT_GL_SCRATCH_COUNTERS, sizeof f->counters, 0);
    if (result == PATINA_OK)
        result = bind_scratch(f, PT_BIND_fill_changed, PT_GL_SCRATCH_PIXELS, LEAST_ENTRIES * CHANGE_SIZE, 0);
    if (result == PATINA_OK)
        result = bind_scratch(f, PT_BIND_fill_saved, PT_GL_SCRATCH_SAVED, f->args->unfills ? LEAST_ENTRIES * SAVED_SIZE : 16,
                              0);
    if (result == PATINA_OK)
        result = bind_scratch(f, PT_BIND_fill_filled, PT_GL_SCRATCH_FILLED, refills ? bits : 16, 0);
    if (result == PATINA_OK)
        result = bind_scratch(f, PT_BIND_fill_stamps, PT_GL_SCRATCH_STAMPS, tiles, 0);
    if (result == PATINA_OK)
        result = bind_scratch(f, PT_BIND_fill_woken, PT_GL_SCRATCH_WOKEN, tiles, 0);
    if (result != PATINA_OK || !refills)
        return result;
    gl->BindBuffer(GL_COPY_WRITE_BUFFER, f->d->scratch[PT_GL_SCRATCH_FILLED].name);
    gl->ClearBufferSubData(GL_COPY_WRITE_BUFFER, GL_R32UI, 0, (GLsizeiptr)bits, GL_RED_INTEGER, GL_UNSIGNED_INT, NULL);
    return pt_gl_check(f->d, "preparing to fill holes");
}

static void write_counters(struct fill *f)
{
    f->d->gl.BindBuffer(GL_COPY_WRITE_BUFFER, f->d->scratch[PT_GL_SCRATCH_COUNTERS].name);
    f->d->gl.BufferSubData(GL_COPY_WRITE_BUFFER, 0, sizeof f->counters, &f->counters);
}

static int read_counters(struct fill *f)
{
    f->d->gl.BindBuffer(GL_COPY_READ_BUFFER, f->d->scratch[PT_GL_SCRATCH_COUNTERS].name);
    f->d->gl.GetBufferSubData(GL_COPY_READ_BUFFER, 0, sizeof f->counters, &f->counters);
    return pt_gl_check(f->d, "counting filled pixels");
}

static int dispatch_entries(struct fill *f, enum program p, uint32_t entries)
{
    GLuint program = f->d->programs[PT_KERNEL_fill][p];
    uint32_t x, y;
    pt_gl_grid((entries + ENTRY_GROUP - 1) / ENTRY_GROUP, &x, &y);
    f->d->gl.ProgramUniform1ui(program, 0, entries);
    if (p == APPLY || p == WAKE || p == RESTORE || p == SELECT)
        f->d->gl.ProgramUniform1ui(program, 1, f->d->stamp);
    if (p == APPLY || p == RESTORE || p == SELECT)
        f->d->gl.ProgramUniform1ui(program, 2, f->d->tiles.columns);
    if (p == DECIDE || p == APPLY || p == MARK)
        f->d->gl.ProgramUniform1ui(program, 5, f->phase);
    return pt_gl_dispatch(f->d, PT_KERNEL_fill, p, x, y);
}

static int find_once(struct fill *f, uint32_t woken)
{
    if (f->first)
        return pt_gl_dispatch_tiles(f->d, PT_KERNEL_fill, f->find,
                                    f->find == FIND_EMPTY ? PT_GL_TILES_RIM : PT_GL_TILES_POINTS);
    int result = bind_scratch(f, PT_BIND_tile_list, PT_GL_SCRATCH_WOKEN, woken * (size_t)4, 0);
    return result == PATINA_OK ? pt_gl_dispatch_list(f->d, PT_KERNEL_fill, f->find, woken) : result;
}

// Until the list holds all that is to change; counters.changed says how many.
static int find(struct fill *f)
{
    uint32_t woken = f->counters.woken;
    for (;;) {
        size_t size = f->d->scratch[PT_GL_SCRATCH_PIXELS].size;
        uint32_t room = (uint32_t)((size < f->d->block_size ? size : f->d->block_size) / CHANGE_SIZE);
        f->counters.changed = f->counters.woken = 0;
        write_counters(f);
        f->d->gl.ProgramUniform1ui(f->d->programs[PT_KERNEL_fill][f->find], 0, room);
        int result = find_once(f, woken);
        if (result == PATINA_OK)
            result = read_counters(f);
        if (result != PATINA_OK || f->counters.changed <= room)
            return result;
        result = bind_scratch(f, PT_BIND_fill_changed, PT_GL_SCRATCH_PIXELS, (size_t)f->counters.changed * CHANGE_SIZE, 0);
        if (result != PATINA_OK)
            return result;
    }
}

static int fill_step(struct fill *f)
{
    int result = find(f), all_new = f->first || f->phase == PT_FILL_BACKGROUND;
    uint32_t changed = f->counters.changed, kept = f->counters.saved, tiles = f->d->tiles.columns * f->d->tiles.rows;
    f->first = 0;
    f->d->stamp++;
    if (result != PATINA_OK || !changed)
        return result;
    if (f->phase == PT_FILL_BACKGROUND) // the other phase touches no empty pixel
        pt_gl_tiles_forget(f->d);
    if (f->args->unfills)
        result = bind_scratch(f, PT_BIND_fill_saved, PT_GL_SCRATCH_SAVED, ((size_t)kept + changed) * SAVED_SIZE,
                              (size_t)kept * SAVED_SIZE);
    f->d->gl.ProgramUniform1ui(f->d->programs[PT_KERNEL_fill][DECIDE], 3, (GLuint)all_new);
    f->d->gl.ProgramUniform1ui(f->d->programs[PT_KERNEL_fill][DECIDE], 4, kept);
    if (result == PATINA_OK)
        result = dispatch_entries(f, DECIDE, changed);
    if (result == PATINA_OK)
        result = dispatch_entries(f, APPLY, changed);
    if (result == PATINA_OK)
        result = dispatch_entries(f, WAKE, tiles);
    if (result == PATINA_OK)
        result = read_counters(f);
    if (all_new && f->args->unfills)
        f->counters.saved = kept + changed;
    if (!f->counters.woken) // nothing reached any of them
        f->counters.changed = 0;
    return result;
}

static int unfill_step(struct fill *f)
{
    uint32_t look = f->first ? f->counters.saved : f->counters.woken;
    int result = bind_scratch(f, PT_BIND_fill_changed, PT_GL_SCRATCH_PIXELS, (size_t)f->counters.saved * CHANGE_SIZE, 0);
    f->counters.changed = f->counters.woken = 0;
    write_counters(f);
    f->d->gl.ProgramUniform1ui(f->d->programs[PT_KERNEL_fill][MARK], 3, (GLuint)f->first);
    f->first = 0;
    if (result == PATINA_OK)
        result = dispatch_entries(f, MARK, look);
    if (result == PATINA_OK)
        result = read_counters(f);
    if (result != PATINA_OK || !f->counters.changed)
        return result;
    f->d->stamp++;
    result = dispatch_entries(f, RESTORE, f->counters.changed);
    if (result == PATINA_OK)
        result = dispatch_entries(f, SELECT, f->counters.saved);
    return result == PATINA_OK ? read_counters(f) : result;
}

// Repeats a step until nothing changes, `most` times at the most.
static int repeat(struct fill *f, int (*step)(struct fill *), uint32_t most)
{
    f->first = 1;
    for (uint32_t i = 0; i < most; i++) {
        if (f->cancel && atomic_load(f->cancel))
            return pt_gl_fail(f->d, PATINA_ERROR_CANCELLED, "cancelled");
        int result = step(f);
        if (result != PATINA_OK || !f->counters.changed)
            return result;
    }
    return PATINA_OK;
}

static int run_phase(struct pt_gl_device *d, const struct fill_args *args, uint32_t phase, const atomic_int *cancel)
{
    struct fill f = {.d = d, .args = args, .phase = phase, .cancel = cancel, .find = FIND_EMPTY};
    if (phase == PT_FILL_OCCLUDED)
        f.find = args->view.level ? FIND_COARSE : FIND_OCCLUDED;
    if (!d->tiles.count[PT_GL_TILES_POINTS] && !d->tiles.count[PT_GL_TILES_RIM])
        return PATINA_OK;
    int result = prepare(&f);
    if (result == PATINA_OK)
        result = repeat(&f, fill_step, args->iterations);
    if (result == PATINA_OK && f.counters.saved)
        result = repeat(&f, unfill_step, args->unfills);
    return result;
}

int pt_gl_fill(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    const struct fill_args *args = work->arguments;
    int result = PATINA_OK;
    for (uint32_t phase = PT_FILL_BACKGROUND; phase <= PT_FILL_OCCLUDED && result == PATINA_OK; phase++) {
        if (!(args->phases & phase))
            continue;
        result = pt_gl_tiles(d, work->buffers[PT_BUF_fill_keys], &args->view); // anew where the phase before wrote keys
        if (result == PATINA_OK)
            result = pt_gl_bind_buffers(d, work);
        if (result == PATINA_OK)
            result = run_phase(d, args, phase, work->cancel);
    }
    return result;
}
