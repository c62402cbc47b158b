// SPDX-License-Identifier: GPL-3.0-or-later
// Counts what is asked of OpenGL. The context's functions are replaced by some that count and then call the driver's. They find their
// counter at the thread: a context has a thread of its own.
#include "device_gl.h"

#include <string.h>

enum { MOST_COMMANDS = 4096, COMMAND = 12 }; // indirect dispatches whose sizes are kept; bytes of one

static _Thread_local struct pt_gl_counter *counter;

static void count_dispatch(int empty)
{
    counter->counts.dispatches++;
    counter->counts.empty += (uint64_t)empty;
    counter->pending = 1;
}

// A call that waits until all submitted work is done. Waiting for work that was waited for is none.
static void count_wait(void)
{
    counter->counts.waits += (uint64_t)counter->pending;
    counter->pending = 0;
}

// How many groups an indirect dispatch has is known to the driver alone: its command is copied, and read when counts are.
static void keep_command(GLintptr indirect)
{
    if (!counter->commands || counter->command_count == MOST_COMMANDS)
        return;
    const GladGLContext *gl = &counter->driver; // what counting itself does is not counted
    gl->BindBuffer(GL_ATOMIC_COUNTER_BUFFER, counter->commands);
    gl->MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    gl->CopyBufferSubData(GL_DISPATCH_INDIRECT_BUFFER, GL_ATOMIC_COUNTER_BUFFER, indirect,
                          (GLintptr)COMMAND * counter->command_count++, COMMAND);
    gl->BindBuffer(GL_ATOMIC_COUNTER_BUFFER, 0);
}

// What a call counts as, beside a call: the kinds of calls.def.
#define COUNT_CALL ((void)0)
#define COUNT_DISPATCH count_dispatch(!num_groups_x || !num_groups_y || !num_groups_z)
#define COUNT_INDIRECT (count_dispatch(0), keep_command(indirect))
#define COUNT_BARRIER (counter->counts.barriers++)
#define COUNT_COPY (counter->counts.copies++)
#define COUNT_UPLOAD (counter->counts.uploaded += data ? (uint64_t)size : 0)
#define COUNT_WRITE (COUNT_COPY, counter->counts.uploaded += (uint64_t)size)
#define COUNT_WAIT count_wait()

#define NOTHING(name, parameters, arguments, kind)                                                                             \
    static void GLAD_API_PTR counted_##name parameters                                                                         \
    {                                                                                                                          \
        counter->counts.calls++;                                                                                               \
        COUNT_##kind;                                                                                                          \
        counter->driver.name arguments;                                                                                        \
    }
#define VALUE(type, name, parameters, arguments, kind)                                                                         \
    static type GLAD_API_PTR counted_##name parameters                                                                         \
    {                                                                                                                          \
        counter->counts.calls++;                                                                                               \
        COUNT_##kind;                                                                                                          \
        return counter->driver.name arguments;                                                                                 \
    }
#include "calls.def"
#undef NOTHING
#undef VALUE

void pt_gl_count_begin(struct pt_gl_device *d)
{
    counter = &d->counter;
    counter->driver = d->gl;
#define NOTHING(name, parameters, arguments, kind)                                                                             \
    if (d->gl.name)                                                                                                            \
        d->gl.name = counted_##name;
#define VALUE(type, name, parameters, arguments, kind) NOTHING(name, parameters, arguments, kind)
#include "calls.def"
#undef NOTHING
#undef VALUE
}

uint64_t pt_gl_count_empty(struct pt_gl_device *d, uint32_t first, uint32_t last)
{
    const struct pt_gl_counter *c = &d->counter;
    const GladGLContext *gl = &c->driver;
    uint32_t commands[MOST_COMMANDS][COMMAND / 4];
    uint64_t empty = 0;
    if (!c->commands || last <= first)
        return 0;
    gl->BindBuffer(GL_ATOMIC_COUNTER_BUFFER, c->commands);
    gl->GetBufferSubData(GL_ATOMIC_COUNTER_BUFFER, (GLintptr)COMMAND * first, (GLsizeiptr)COMMAND * (last - first), commands);
    for (uint32_t i = 0; i < last - first; i++)
        empty += !commands[i][0] || !commands[i][1] || !commands[i][2];
    return empty;
}

static void read_commands(struct pt_gl_device *d)
{
    struct pt_gl_counter *c = &d->counter;
    c->counts.empty += pt_gl_count_empty(d, 0, c->command_count);
    c->driver.DeleteBuffers(1, &c->commands);
    c->commands = c->command_count = 0;
}

static void keep_commands(struct pt_gl_counter *c)
{
    const GladGLContext *gl = &c->driver;
    gl->GenBuffers(1, &c->commands);
    gl->BindBuffer(GL_ATOMIC_COUNTER_BUFFER, c->commands);
    gl->BufferData(GL_ATOMIC_COUNTER_BUFFER, (GLsizeiptr)COMMAND * MOST_COMMANDS, NULL, GL_STREAM_READ);
}

int pt_gl_counts(struct pt_gl_device *d, void *counts)
{
    if (d->counter.commands)
        read_commands(d);
    if (d->base.measured)
        keep_commands(&d->counter);
    *(struct pt_counts *)counts = d->counter.counts;
    return pt_gl_check(d, "counting calls");
}
