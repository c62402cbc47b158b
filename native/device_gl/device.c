// SPDX-License-Identifier: GPL-3.0-or-later
#include "base/color.h"
#include "base/pool.h"
#include "device_gl.h"
#include "shared/colors.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// A call on its way to the GL thread; lives on the caller's stack until done.
struct pt_gl_call {
    int (*run)(struct pt_gl_device *d, void *context);
    void *context;
    const atomic_int *cancel;
    int cleanup; // runs on a lost context too
    int result, done;
    char message[512];
};

enum { STACK_SIZE = 16 << 20 }; // drivers compile shaders on our stack

// ---- the thread ------------------------------------------------------------------------------------------------

// Runs in the GL thread and returns its result and message. The caller's thread has no part in it but waiting.
static int marshal(struct patina_device *device, int (*run)(struct pt_gl_device *, void *), void *context,
                   const atomic_int *cancel, int cleanup)
{
    struct pt_gl_device *d = (struct pt_gl_device *)device;
    struct pt_gl_call c = {.run = run, .context = context, .cancel = cancel, .cleanup = cleanup};
    pt_mutex_lock(&d->lock);
    while (d->call) // another thread's
        pt_condition_wait(&d->changed, &d->lock);
    d->call = &c;
    pt_condition_wake_all(&d->changed);
    while (!c.done)
        pt_condition_wait(&d->changed, &d->lock);
    pt_mutex_unlock(&d->lock);
    if (c.result == PATINA_OK)
        return PATINA_OK;
    return pt_fail(&device->handle, c.result, "%s: %s", device->info.name, c.message);
}

static int call(struct patina_device *device, int (*run)(struct pt_gl_device *, void *), void *context)
{
    return marshal(device, run, context, NULL, 0);
}

static int call_until(struct patina_device *device, int (*run)(struct pt_gl_device *, void *), void *context,
                      const atomic_int *cancel)
{
    return marshal(device, run, context, cancel, 0);
}

static int close_context(struct pt_gl_device *d, void *unused)
{
    (void)unused;
    if (!d->context)
        return PATINA_OK;
    if (!d->lost && d->gl.DeleteProgram) {
        for (int k = 0; k < PT_KERNEL_COUNT; k++)
            for (int v = 0; v < PT_GL_VARIANTS; v++)
                d->gl.DeleteProgram(d->programs[k][v]);
        for (int i = 0; i < PT_GL_SCRATCH_COUNT; i++)
            d->gl.DeleteBuffers(1, &d->scratch[i].name);
        d->gl.DeleteBuffers(1, &d->halves[0].name);
        d->gl.DeleteBuffers(1, &d->halves[1].name);
        for (int i = 0; i < 2; i++)
            d->gl.DeleteProgram(d->tile_programs[i]);
        d->gl.DeleteProgram(d->list_program);
        d->gl.DeleteProgram(d->clear_program);
        d->gl.DeleteBuffers(1, &d->staging.name);
        d->gl.DeleteBuffers(1, &d->upload);
        d->gl.DeleteBuffers(1, &d->zeros);
        d->gl.DeleteTextures(PT_UNIT_COUNT, d->textures);
        d->gl.DeleteQueries((GLsizei)d->query_count, d->queries);
        d->gl.DeleteBuffers(1, &d->arguments);
        d->gl.DeleteBuffers(1, &d->srgb);
        d->gl.Finish();
    }
    d->context_ops->destroy(d->context);
    d->context = NULL;
    return PATINA_OK;
}

static void thread_main(void *argument)
{
    struct pt_gl_device *d = argument;
    for (int quit = 0; !quit;) {
        pt_mutex_lock(&d->lock);
        while (!d->call || d->call->done)
            pt_condition_wait(&d->changed, &d->lock);
        struct pt_gl_call *c = d->call;
        pt_mutex_unlock(&d->lock);

        quit = c->run == close_context;
        d->cancel = c->cancel;
        c->result = d->lost && !c->cleanup ? PATINA_ERROR_DEVICE : c->run(d, c->context);
        memcpy(c->message, d->message, sizeof c->message);

        pt_mutex_lock(&d->lock);
        d->counts = d->counter.counts;
        d->keeps_commands = d->counter.commands != 0;
        c->done = 1;
        d->call = NULL;
        pt_condition_wake_all(&d->changed);
        pt_mutex_unlock(&d->lock);
    }
}

// ---- opening ---------------------------------------------------------------------------------------------------

static GLADapiproc load_function(void *user, const char *name)
{
    struct pt_gl_device *d = user;
    return (GLADapiproc)d->context_ops->function(d->context, name);
}

// Software renderers by the names they go by.
static int is_software(const char *renderer)
{
    static const char *const names[] = {"llvmpipe", "softpipe", "swrast", "SWR", "Software Rasterizer", "SwiftShader"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (strstr(renderer, names[i]))
            return 1;
    return 0;
}

// For tests: megabytes that an environment variable names; 0: it names none.
static uint64_t megabytes(const char *variable)
{
    const char *text = getenv(variable);
    const double number = text ? strtod(text, NULL) : 0.0;
    return number > 0.0 && number < 1e9 ? (uint64_t)(1e6 * number) : 0;
}

static int has_extension(const struct pt_gl_device *d, const char *name)
{
    GLint count = 0, i = 0;
    d->gl.GetIntegerv(GL_NUM_EXTENSIONS, &count);
    while (i < count && strcmp((const char *)d->gl.GetStringi(GL_EXTENSIONS, (GLuint)i), name) != 0)
        i++;
    return i < count;
}

// What the driver says that the card's memory has room for. The memory of software is the host's.
static void find_memory(struct pt_gl_device *d)
{
    enum { NVX_AVAILABLE = 0x9049, ATI_FREE = 0x87FB }; // of NVX_gpu_memory_info, ATI_meminfo: of buffers; kilobytes
    GLint free_of_card[4] = {0};
    if (d->base.info.hardware && has_extension(d, "GL_NVX_gpu_memory_info"))
        d->gl.GetIntegerv(NVX_AVAILABLE, free_of_card);
    else if (d->base.info.hardware && has_extension(d, "GL_ATI_meminfo"))
        d->gl.GetIntegerv(ATI_FREE, free_of_card);
    const uint64_t said = megabytes("PATINA_GL_MEMORY"), largest = megabytes("PATINA_GL_LARGEST");
    d->base.own_memory = said ? said : free_of_card[0] > 0 ? (uint64_t)free_of_card[0] << 10 : 0;
    d->largest = largest ? (size_t)largest : SIZE_MAX;
}

// The values that the CPU device uses: float64, cut to float32.
static void make_srgb_table(struct pt_gl_device *d)
{
    float table[256][4] = {{0}}; // uniform blocks keep arrays by 16 bytes
    for (int i = 0; i < 256; i++)
        table[i][0] = (float)pt_linear_of_srgb(i / 255.0);
    d->gl.GenBuffers(1, &d->srgb);
    d->gl.BindBuffer(GL_UNIFORM_BUFFER, d->srgb);
    d->gl.BufferData(GL_UNIFORM_BUFFER, sizeof table, table, GL_STATIC_DRAW);
    d->gl.BindBufferBase(GL_UNIFORM_BUFFER, PT_UNIFORM_srgb, d->srgb);
}

// What memory.c copies from.
static void make_helpers(struct pt_gl_device *d)
{
    static const uint32_t zeros[PT_GL_ZEROS / 4];
    d->gl.GenBuffers(1, &d->upload);
    d->gl.GenBuffers(1, &d->zeros);
    d->gl.BindBuffer(GL_COPY_WRITE_BUFFER, d->zeros);
    d->gl.BufferData(GL_COPY_WRITE_BUFFER, sizeof zeros, zeros, GL_STATIC_COPY);
}

static int open_context(struct pt_gl_device *d, void *unused)
{
    (void)unused;
    patina_device_info *info = &d->base.info;
    char why[256] = "";
    d->context = d->context_ops->create(why, sizeof why);
    if (!d->context)
        return pt_gl_fail(d, PATINA_ERROR_UNSUPPORTED, "%s", why);
    int version = gladLoadGLContextUserPtr(&d->gl, load_function, d);
    if (version < GLAD_MAKE_VERSION(4, 3))
        return pt_gl_fail(d, PATINA_ERROR_UNSUPPORTED, "OpenGL 4.3 is needed, the driver has %d.%d",
                          GLAD_VERSION_MAJOR(version), GLAD_VERSION_MINOR(version));
    pt_gl_count_begin(d);
    const char *renderer = (const char *)d->gl.GetString(GL_RENDERER);
    const char *text = (const char *)d->gl.GetString(GL_VERSION);
    snprintf(info->description, sizeof info->description, "%s, OpenGL %s", renderer ? renderer : "unknown renderer",
             text ? text : "");
    const char *as = getenv("PATINA_GL_AS"); // for tests: what is made for "hardware" or "software", whatever the driver is
    info->hardware = as ? !strcmp(as, "hardware") : !is_software(info->description);

    GLint64 block = 0;
    GLint blocks = 0, bindings = 0, alignment = 0, texel_alignment = 0, texels = 0, shared = 0;
    d->gl.GetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &block);
    d->gl.GetIntegerv(GL_MAX_COMPUTE_SHADER_STORAGE_BLOCKS, &blocks);
    d->gl.GetIntegerv(GL_MAX_SHADER_STORAGE_BUFFER_BINDINGS, &bindings);
    d->gl.GetIntegerv(GL_SHADER_STORAGE_BUFFER_OFFSET_ALIGNMENT, &alignment);
    d->gl.GetIntegerv(GL_TEXTURE_BUFFER_OFFSET_ALIGNMENT, &texel_alignment);
    d->gl.GetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &texels);
    d->gl.GetIntegerv(GL_MAX_COMPUTE_SHARED_MEMORY_SIZE, &shared);
    int result = pt_gl_check(d, "reading the driver's limits");
    if (result != PATINA_OK)
        return result;
    if (bindings < blocks)
        blocks = bindings;
    if (blocks < PT_BINDINGS)
        return pt_gl_fail(d, PATINA_ERROR_UNSUPPORTED, "%s offers %d storage blocks to a shader, %d are needed",
                          info->description, blocks, PT_BINDINGS);
    d->block_size = (uint64_t)block > SIZE_MAX ? SIZE_MAX : (size_t)block;
    alignment = alignment > texel_alignment ? alignment : texel_alignment; // powers of two
    d->alignment = alignment > 4 ? (size_t)alignment : 4;
    d->texels = texels > 0 ? (size_t)texels : 0;
    d->shared_size = shared > 0 ? (size_t)shared : 0;
    d->gl.GenBuffers(1, &d->arguments);
    d->gl.GenTextures(PT_UNIT_COUNT, d->textures);
    make_srgb_table(d);
    make_helpers(d);
    find_memory(d);
    info->key64 = (uint32_t)pt_gl_key64_works(d);
    return pt_gl_check(d, "opening the device");
}

// ---- operations ------------------------------------------------------------------------------------------------

struct buffer_call {
    struct pt_buffer *buffer;
    size_t offset, size;
    const void *source;
    void *target;
    uint64_t pattern;
    uint32_t bytes;
};

static int create_buffer(struct pt_gl_device *d, void *context)
{
    const struct buffer_call *b = context;
    pt_gl_tiles_forget(d);
    const GladGLContext *gl = &d->gl;
    size_t padded = (b->size + 15) & ~(size_t)15; // shaders read whole words and vectors
    GLuint name = 0;
    if (padded > d->largest)
        return pt_gl_fail(d, PATINA_ERROR_MEMORY, "OpenGL has no memory for a buffer of %zu bytes", b->size);
    gl->GenBuffers(1, &name);
    gl->BindBuffer(GL_COPY_WRITE_BUFFER, name);
    gl->BufferData(GL_COPY_WRITE_BUFFER, (GLsizeiptr)(padded ? padded : 16), NULL, GL_DYNAMIC_COPY);
    int result = pt_gl_check(d, "making a buffer");
    if (result == PATINA_OK && b->source && b->size) {
        gl->BufferSubData(GL_COPY_WRITE_BUFFER, 0, (GLsizeiptr)b->size, b->source);
        result = pt_gl_check(d, "filling a buffer");
    }
    if (result != PATINA_OK) {
        if (result == PATINA_ERROR_MEMORY)
            pt_gl_fail(d, result, "OpenGL has no memory for a buffer of %zu bytes", b->size);
        gl->DeleteBuffers(1, &name);
        return result;
    }
    *b->buffer = (struct pt_buffer){.size = b->size, .room = b->size, .name = name};
    return PATINA_OK;
}

static int destroy_buffer(struct pt_gl_device *d, void *context)
{
    const struct buffer_call *b = context;
    pt_gl_tiles_forget(d);
    pt_gl_bound_forget(d);
    if (!d->lost) // a lost context has taken its buffers along
        d->gl.DeleteBuffers(1, &b->buffer->name);
    return PATINA_OK;
}

static int write_buffer(struct pt_gl_device *d, void *context)
{
    const struct buffer_call *b = context;
    pt_gl_tiles_forget(d);
    return pt_gl_write(d, b->buffer->name, b->offset, b->size, b->source);
}

static int read_buffer(struct pt_gl_device *d, void *context)
{
    const struct buffer_call *b = context;
    return pt_gl_read(d, b->buffer->name, b->offset, b->size, b->target);
}

static int fill_buffer(struct pt_gl_device *d, void *context)
{
    const struct buffer_call *b = context;
    const uint32_t low = (uint32_t)b->pattern, high = b->bytes == 8 ? (uint32_t)(b->pattern >> 32) : low;
    pt_gl_tiles_forget(d);
    return pt_gl_clear(d, b->buffer->name, b->offset, b->size, (const uint32_t[]){low, high, low, high});
}

static int run_kernel(struct pt_gl_device *d, void *context)
{
    const int result = pt_gl_run(d, context);
    return result == PATINA_OK ? pt_gl_check(d, "running a kernel") : result;
}

struct tail_call {
    const struct pt_bound_pass *passes;
    uint32_t count;
};

static int run_tail(struct pt_gl_device *d, void *context)
{
    const struct tail_call *f = context;
    const int result = pt_gl_run_tail(d, f->passes, f->count);
    return result == PATINA_OK ? pt_gl_check(d, "running a kernel") : result;
}

// ---- several at one go ---------------------------------------------------------------------------------------------------

struct groups_call {
    struct pt_group *groups;
    uint32_t count;
    _Atomic float *progress;
};

static int run_group(struct pt_gl_device *d, const struct pt_group *group)
{
    const struct pt_bound_pass *pass = group->passes;
    if (group->count > 1)
        return pt_gl_run_tail(d, pass, group->count);
    return pt_gl_run(d, &(struct pt_gl_work){.kernel = pass->kernel,
                                             .arguments = pass->arguments,
                                             .argument_size = pass->argument_size,
                                             .buffers = pass->buffers});
}

// Names of `count` timer queries; 0: there are none. Software has done its work when a call returns: it needs no timer.
static int take_queries(struct pt_gl_device *d, uint32_t count)
{
    GLint bits = 0;
    if (!d->base.info.hardware || !d->gl.QueryCounter || !d->gl.GetQueryObjectui64v)
        return 0;
    d->gl.GetQueryiv(GL_TIMESTAMP, GL_QUERY_COUNTER_BITS, &bits);
    if (bits < 32)
        return 0;
    if (count > d->query_count) {
        GLuint *grown = realloc(d->queries, count * sizeof *grown);
        if (!grown)
            return 0;
        d->queries = grown;
        d->gl.GenQueries((GLsizei)(count - d->query_count), d->queries + d->query_count);
        d->query_count = count;
    }
    return 1;
}

// Waits for the device's work.
static void read_queries(struct pt_gl_device *d, struct pt_group *groups, uint32_t count)
{
    GLuint64 before = 0, now = 0;
    uint32_t timer = 0;
    d->gl.GetQueryObjectui64v(d->queries[timer++], GL_QUERY_RESULT, &before);
    for (uint32_t i = 0; i < count; i++) {
        groups[i].ms = 0.0;
        if (groups[i].joined)
            continue;
        d->gl.GetQueryObjectui64v(d->queries[timer++], GL_QUERY_RESULT, &now);
        groups[i].ms = now > before ? (double)(now - before) * 1e-6 : 0.0;
        before = now;
    }
}

// Groups that a frame times by themselves: all where it is measured, or else those over points.
static int is_timed(const struct pt_gl_device *d, const struct pt_group *group)
{
    const enum pt_domain domain = pt_kernels[group->passes->kernel].domain;
    return d->base.measured || domain == PT_DOMAIN_points || domain == PT_DOMAIN_bins;
}

// Says which groups are timed with those before them. Returns how many are left.
static uint32_t join_groups(const struct pt_gl_device *d, struct pt_group *groups, uint32_t count)
{
    uint32_t left = 0;
    for (uint32_t i = 0; i < count; i++) {
        groups[i].joined = i > 0 && d->base.info.hardware && !is_timed(d, &groups[i]) && !is_timed(d, &groups[i - 1]);
        left += !groups[i].joined;
    }
    return left;
}

// Empty dispatches of each group; begins: its first command, of all and behind them.
static void count_empty(struct pt_gl_device *d, struct pt_group *groups, uint32_t count, const uint32_t *begins)
{
    for (uint32_t i = 0; i < count; i++)
        groups[i].counts.empty += pt_gl_count_empty(d, begins[i], begins[i + 1]);
}

// begins: NULL: nobody wants to know.
static int submit_groups(struct pt_gl_device *d, const struct groups_call *c, int timed, uint32_t *begins)
{
    double before = pt_milliseconds();
    int result = PATINA_OK;
    for (uint32_t i = 0, timer = 0; i < c->count && result == PATINA_OK; i++) {
        struct pt_group *group = &c->groups[i];
        const struct pt_counts counts = d->counter.counts;
        if ((result = pt_gl_poll(d)) != PATINA_OK)
            return result;
        if (timed && !group->joined)
            d->gl.QueryCounter(d->queries[timer++], GL_TIMESTAMP);
        if (begins)
            begins[i] = d->counter.command_count;
        result = run_group(d, group);
        if (!timed && d->base.info.hardware && (i + 1 == c->count || !group[1].joined))
            d->gl.Finish();
        const double now = pt_milliseconds();
        group->ms = now - before;
        before = now;
        group->counts = pt_counts_between(&counts, &d->counter.counts);
        if (c->progress)
            atomic_store(c->progress, group->done);
        if (timed && i + 1 == c->count)
            d->gl.QueryCounter(d->queries[timer], GL_TIMESTAMP);
    }
    if (begins)
        begins[c->count] = d->counter.command_count;
    return result;
}

static int run_groups(struct pt_gl_device *d, void *context)
{
    const struct groups_call *c = context;
    const int timed = take_queries(d, join_groups(d, c->groups, c->count) + 1);
    uint32_t *begins = d->counter.commands ? calloc((size_t)c->count + 1, sizeof *begins) : NULL;
    int result = submit_groups(d, c, timed, begins);
    if (result == PATINA_OK) {
        if (timed)
            read_queries(d, c->groups, c->count);
        else
            d->gl.Finish();
        if (begins)
            count_empty(d, c->groups, c->count, begins);
        result = pt_gl_check(d, "waiting for the device");
    }
    free(begins);
    return result;
}

static int op_run_groups(struct patina_device *device, struct pt_group *groups, uint32_t count, const atomic_int *cancel,
                         _Atomic float *progress)
{
    return call_until(device, run_groups, &(struct groups_call){.groups = groups, .count = count, .progress = progress},
                      cancel);
}

// ---- operations, called --------------------------------------------------------------------------------------------------

static int wait_for_work(struct pt_gl_device *d, void *unused)
{
    (void)unused;
    d->gl.Finish();
    return pt_gl_check(d, "waiting for the device");
}

// It stays where it is, or as a copy in the host's memory.
static int keep_in_ranges(struct patina_device *device, size_t size, const void *source, int how, struct pt_buffer *out)
{
    *out = (struct pt_buffer){.size = size, .room = size, .source = source};
    if (how & PT_BORROW)
        return PATINA_OK;
    out->source = out->data = malloc(size);
    if (!out->data)
        return pt_fail(&device->handle, PATINA_ERROR_MEMORY, "%s: out of memory for %zu bytes of points", device->info.name,
                       size);
    memcpy(out->data, source, size);
    return PATINA_OK;
}

static int op_buffer_create(struct patina_device *device, size_t size, const void *source, int how, struct pt_buffer *out)
{
    memset(out, 0, sizeof *out);
    if (how & PT_IN_RANGES && size && source)
        return keep_in_ranges(device, size, source, how, out);
    int result = call(device, create_buffer, &(struct buffer_call){.buffer = out, .size = size, .source = source});
    if (result == PATINA_OK && how & PT_ZEROED)
        result = call(device, fill_buffer, &(struct buffer_call){.buffer = out, .size = size, .bytes = 4});
    out->source = result == PATINA_OK && how & PT_BORROW ? source : NULL;
    return result;
}

static void op_buffer_destroy(struct patina_device *device, struct pt_buffer *buffer)
{
    if (buffer->name)
        marshal(device, destroy_buffer, &(struct buffer_call){.buffer = buffer}, NULL, 1);
    free(buffer->data);
    memset(buffer, 0, sizeof *buffer);
}

static int op_buffer_write(struct patina_device *device, struct pt_buffer *buffer, size_t offset, const void *source,
                           size_t size)
{
    return call(device, write_buffer,
                &(struct buffer_call){.buffer = buffer, .offset = offset, .size = size, .source = source});
}

static int op_buffer_read(struct patina_device *device, const struct pt_buffer *buffer, size_t offset, void *target,
                          size_t size)
{
    struct pt_buffer copy = *buffer;
    return call(device, read_buffer, &(struct buffer_call){.buffer = &copy, .offset = offset, .size = size, .target = target});
}

static int op_buffer_fill(struct patina_device *device, struct pt_buffer *buffer, size_t offset, size_t size, uint64_t pattern,
                          uint32_t bytes)
{
    return call(device, fill_buffer,
                &(struct buffer_call){.buffer = buffer, .offset = offset, .size = size, .pattern = pattern, .bytes = bytes});
}

static int op_run(struct patina_device *device, enum pt_kernel kernel, const void *arguments, size_t argument_size,
                  struct pt_buffer *const *buffers, uint32_t count, const atomic_int *cancel)
{
    (void)count; // as kernels.def lists them
    return call_until(
        device, run_kernel,
        &(struct pt_gl_work){.kernel = kernel, .arguments = arguments, .argument_size = argument_size, .buffers = buffers},
        cancel);
}

// What pt_gl_run_tail is made for; z comes from the keys, what else is extracted from planes that it does not make.
static uint32_t op_tail_length(const struct pt_bound_pass *passes, uint32_t count)
{
    static const enum pt_kernel tail[] = {PT_KERNEL_smooth, PT_KERNEL_antialias, PT_KERNEL_compose};
    enum { TAIL = sizeof tail / sizeof *tail };
    uint32_t shades = 0, follow = 0;
    while (shades < count && passes[shades].kernel == PT_KERNEL_shade)
        shades++;
    while (follow < TAIL && shades + follow < count && passes[shades + follow].kernel == tail[follow])
        follow++;
    if (!shades || follow < TAIL)
        return 0;
    for (uint32_t i = shades + TAIL; i < count; i++) {
        const struct extract_args *extract = passes[i].arguments;
        if (passes[i].kernel != PT_KERNEL_extract || extract->normal || extract->source || extract->shadow || extract->centered)
            return 0;
    }
    return shades + TAIL;
}

static int op_run_tail(struct patina_device *device, const struct pt_bound_pass *passes, uint32_t count,
                       const atomic_int *cancel)
{
    return call_until(device, run_tail, &(struct tail_call){.passes = passes, .count = count}, cancel);
}

// The limits were read when the device was opened: the GL thread is not asked.
static uint64_t op_most(const struct patina_device *device, const struct pt_buffer_row *row)
{
    return pt_gl_most((const struct pt_gl_device *)device, row);
}

static void op_watch(struct patina_device *device, void (*look)(void *context), void *context)
{
    struct pt_gl_device *d = (struct pt_gl_device *)device;
    d->look = look;
    d->watched = context;
}

static int op_wait(struct patina_device *device) { return call(device, wait_for_work, NULL); }

// Twice a frame: the GL thread is asked for empty dispatches alone.
static int op_counts(struct patina_device *device, struct pt_counts *out)
{
    struct pt_gl_device *d = (struct pt_gl_device *)device;
    pt_mutex_lock(&d->lock);
    const int ask = d->keeps_commands || device->measured;
    *out = d->counts;
    pt_mutex_unlock(&d->lock);
    return ask ? call(device, pt_gl_counts, out) : PATINA_OK;
}

static void op_destroy(struct patina_device *device)
{
    struct pt_gl_device *d = (struct pt_gl_device *)device;
    marshal(device, close_context, NULL, NULL, 1);
    pt_thread_join(&d->thread);
    pt_condition_destroy(&d->changed);
    pt_mutex_destroy(&d->lock);
    pt_handle_destroy(&device->handle);
    pt_pool_destroy(device->pool);
    free(d->queries);
    free(d->host);
    free(d);
}

static const struct pt_device_ops ops = {
    .destroy = op_destroy,
    .buffer_create = op_buffer_create,
    .buffer_destroy = op_buffer_destroy,
    .buffer_write = op_buffer_write,
    .buffer_read = op_buffer_read,
    .buffer_fill = op_buffer_fill,
    .run = op_run,
    .tail_length = op_tail_length,
    .run_tail = op_run_tail,
    .run_groups = op_run_groups,
    .most = op_most,
    .wait = op_wait,
    .watch = op_watch,
    .counts = op_counts,
};

int pt_device_gl_create(const patina_device_desc *desc, const char *context, struct patina_device **out)
{
    static const struct pt_gl_context_ops *const kinds[] = {&pt_gl_context_egl, &pt_gl_context_osmesa, &pt_gl_context_wgl};
    *out = NULL;
    const struct pt_gl_context_ops *kind = NULL;
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (context && (!strcmp(context, kinds[i]->name) || !strcmp(context, kinds[i]->name + 3)))
            kind = kinds[i];
    if (!kind)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "there is no OpenGL context called \"%s\"", context ? context : "");

    struct pt_gl_device *d = calloc(1, sizeof *d);
    if (!d)
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "out of memory");
    pt_handle_init(&d->base.handle);
    pt_mutex_init(&d->lock);
    pt_condition_init(&d->changed);
    d->base.ops = &ops;
    d->context_ops = kind;
    d->base.info.struct_size = sizeof d->base.info;
    d->base.info.threads = 1;
    d->base.copies = 1;
    d->base.pool = pt_pool_create(desc ? desc->threads : 0,
                                  desc ? desc->batch : 0); // for plans; NULL: the caller makes them alone
    snprintf(d->base.info.name, sizeof d->base.info.name, "%s", kind->name);
    if (pt_thread_start(&d->thread, thread_main, d, STACK_SIZE)) {
        pt_condition_destroy(&d->changed);
        pt_mutex_destroy(&d->lock);
        pt_handle_destroy(&d->base.handle);
        pt_pool_destroy(d->base.pool);
        free(d);
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "the thread for OpenGL cannot be started");
    }
    int result = call(&d->base, open_context, NULL); // its sentence stays at this thread
    if (result != PATINA_OK) {
        op_destroy(&d->base);
        return result;
    }
    *out = &d->base;
    return PATINA_OK;
}
