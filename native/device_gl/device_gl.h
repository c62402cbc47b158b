// SPDX-License-Identifier: GPL-3.0-or-later
// The OpenGL device: compute shaders in a context of its own, in a thread of its own. Everything below runs in that
// thread; device.c brings the calls there and carries results and messages back.
#ifndef PT_DEVICE_GL_H
#define PT_DEVICE_GL_H

#include "context.h"
#include "device.h"
#include "glad/gl.h"
#include "slots.h"

enum {
    PT_GL_VARIANTS = 128, // programs of one kernel: its passes and special cases
    PT_GL_LIST_HEAD = 16, // bytes before a list's entries: lists.c
    PT_GL_BARRIERS = GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT |
                     GL_COMMAND_BARRIER_BIT, // behind each dispatch
};

// Memory that kernels keep between runs; grows, never shrinks.
struct pt_gl_scratch {
    GLuint name;
    size_t size;
};

enum pt_gl_scratch_use {
    PT_GL_SCRATCH_COUNTERS,
    PT_GL_SCRATCH_PIXELS, // antialias: edges; push: what it takes; lines: steps
    PT_GL_SCRATCH_COLORS, // lines: discs
    PT_GL_SCRATCH_SHADED, // lib/tail.glsl: colours before they are smoothed; fill: this step's changes; antialias: colours of edges
    PT_GL_SCRATCH_SHOWN,  // shade: what pixels give to a wide blend of normals; fill: pixels as they were before the phase
    PT_GL_SCRATCH_FILLED, // fill: a bit for each pixel filled in this phase
    PT_GL_SCRATCH_STAMPS, // fill: the step for which a tile was listed last
    PT_GL_SCRATCH_WOKEN,  // fill: tiles that the next step has to look at
    PT_GL_SCRATCH_SUMS,   // blend, average: of the pixels of a band
    PT_GL_SCRATCH_LARGE,  // discs: how many are large, and which
    PT_GL_SCRATCH_TILES,  // what each tile holds
    PT_GL_SCRATCH_TILE_LISTS,
    PT_GL_SCRATCH_SOFT_COUNTS, // soft: of each tile's list
    PT_GL_SCRATCH_SOFT_BEGINS,
    PT_GL_SCRATCH_SOFT_STATES, // soft: what pixels have come to
    PT_GL_SCRATCH_WINNERS,     // ranges.c: what points have, by the pixels that show them; of two buffers
    PT_GL_SCRATCH_WINNERS_TOO,
    PT_GL_SCRATCH_COUNT
};

enum pt_gl_tile_list {
    PT_GL_TILES_POINTS, // with a point in them
    PT_GL_TILES_RIM,    // with an empty pixel, and a point in them or in a tile beside them
};

// What a binding holds, so that binding the same again takes no call.
struct pt_gl_bound {
    GLuint name; // 0: not known
    size_t offset, size;
};

// Lists of the tiles of one key plane, valid until somebody writes keys.
struct pt_gl_tiles {
    int valid;
    GLuint keys;
    uint32_t width, rect[4];
    uint32_t columns, rows;
    size_t stride; // words from list to list
};

// What was asked of the driver since the device was made: count.c.
struct pt_gl_counter {
    struct pt_counts counts;
    GladGLContext driver;   // the driver's own functions
    int pending;            // work was submitted since the last wait
    GLuint commands;        // buffer of indirect dispatches' sizes; 0: they are not kept
    uint32_t command_count; // in it
};

struct pt_gl_call;

struct pt_gl_device {
    struct patina_device base;
    const struct pt_gl_context_ops *context_ops;

    // The hand-over: one call at a time, the caller waits.
    struct pt_thread thread;
    struct pt_mutex lock;
    struct pt_condition changed;
    struct pt_gl_call *call;
    struct pt_counts counts; // after the last call
    int keeps_commands;

    // Of the GL thread alone.
    GladGLContext gl; // counts calls: count.c
    struct pt_gl_counter counter;
    void *context;
    const atomic_int *cancel; // of the call at hand; NULL: nobody asks
    int lost;
    char message[512];
    size_t block_size;  // greatest storage block
    size_t largest;     // buffer that there is memory for, as tests have it
    size_t alignment;   // of a block's or a texture's offset in its buffer
    size_t texels;      // in a buffer texture
    size_t shared_size; // bytes that the invocations of a workgroup share
    GLuint arguments;
    GLuint srgb;    // uniform block: linear values of the 256 sRGB bytes
    uint32_t stamp; // fill: of the current step
    GLuint programs[PT_KERNEL_COUNT][PT_GL_VARIANTS];
    char shade_definitions[PT_GL_VARIANTS][256];     // of shade's programs, shade_count of them
    uint64_t shade_used[PT_GL_VARIANTS], shade_uses; // number of the use that was its last, and of all
    uint32_t shade_count;
    GLuint tile_programs[2], list_program, clear_program;
    GLuint shown; // the key plane that PT_GL_SCRATCH_SHOWN is of, as long as no kernel writes planes; else 0
    GLuint textures[PT_UNIT_COUNT];
    struct pt_gl_bound blocks[PT_BINDINGS], texels_of[PT_UNIT_COUNT];
    GLuint program;  // in use
    GLuint *queries; // timers, query_count of them
    uint32_t query_count;
    // Of clouds that do not lie here whole: ranges.c
    struct pt_gl_scratch halves[2];
    uint32_t turn;   // the one at hand
    size_t used;     // bytes of it
    uint32_t rounds; // ranges that the kernel at hand took
    uint32_t *host;  // keys, read back
    size_t host_size;
    uint32_t by_pixel; // 1: what the kernel at hand reads of points lies by pixel
    uint8_t told_by_pixel[PT_KERNEL_COUNT][PT_GL_VARIANTS];
    void (*look)(void *context);
    void *watched;
    struct pt_gl_tiles tiles;
    struct pt_gl_scratch scratch[PT_GL_SCRATCH_COUNT];
    struct pt_gl_scratch staging; // what is read back passes through
    GLuint upload, zeros;         // what is written does; heads of empty lists
};

// fail.c
// Keeps the sentence for the handle of the device; returns code.
int pt_gl_fail(struct pt_gl_device *d, int code, const char *format, ...) __attribute__((format(printf, 3, 4)));
// Turns whatever GL has to complain about into a code and a sentence: "OpenGL ran out of memory while ...".
int pt_gl_check(struct pt_gl_device *d, const char *doing);

// count.c
// Replaces the functions of d->gl by counting ones. In the GL thread, once the functions are loaded.
void pt_gl_count_begin(struct pt_gl_device *d);
// counts (out, struct pt_counts): since the device was made. Empty indirect dispatches count between two calls of it, if the frame was
// measured at the first: that takes a small copy for each dispatch, which does not count itself.
int pt_gl_counts(struct pt_gl_device *d, void *counts);
// Empty ones among the indirect dispatches from `first` to `last`, numbered since the last pt_gl_counts. Waits; 0 where they are not kept.
uint64_t pt_gl_count_empty(struct pt_gl_device *d, uint32_t first, uint32_t last);

struct pt_gl_unit {
    GLenum format;
    uint8_t bytes; // a texel
};
extern const struct pt_gl_unit pt_gl_units[PT_UNIT_COUNT]; // of buffer textures: kernels.def

// program.c
// Compiles shaders/NAME with a line of definitions ("#define PASS 1\n") into a program.
int pt_gl_program(struct pt_gl_device *d, const char *name, const char *definitions, GLuint *program);
// The same with the file that `#include "BODY"` stands for.
int pt_gl_program_of_body(struct pt_gl_device *d, const char *name, const char *definitions, const char *body, GLuint *program);

// A kernel with what it runs on.
struct pt_gl_work {
    enum pt_kernel kernel;
    const void *arguments;
    size_t argument_size;
    struct pt_buffer *const *buffers; // as kernels.def lists them
};

// What the arguments of kernels of the crop begin with, except of those that have a runner of their own.
struct pt_gl_crop_args {
    struct view_args view;
    uint32_t crop_x, crop_y, crop_width, crop_height;
};

// bind.c: what runners share
// Calls who watches, then polls cancel: PATINA_ERROR_CANCELLED where it is set. Each dispatch does so first.
int pt_gl_poll(struct pt_gl_device *d);
void pt_gl_arguments(struct pt_gl_device *d, const void *arguments, size_t size); // bound at 0
int pt_gl_kernel_program(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t variant, const char *definitions);
int pt_gl_bind(struct pt_gl_device *d, uint32_t binding, GLuint name, size_t offset, size_t size, const char *what);
// The kernel's buffers, but for those that repeat and for parts.
int pt_gl_bind_buffers(struct pt_gl_device *d, const struct pt_gl_work *work);
// Of the list's rows from `first` on those `count` that are no parts. buffers: from that of the first on.
int pt_gl_bind_rows(struct pt_gl_device *d, const struct pt_gl_work *work, uint32_t first, uint32_t count,
                    struct pt_buffer *const *buffers);
// The most bytes that a kernel may bind there as a whole.
size_t pt_gl_most(const struct pt_gl_device *d, const struct pt_buffer_row *row);
// Whether it is bound in parts, since clouds are larger than blocks and textures: what points have, of a kernel that walks them.
int pt_gl_is_part(const struct pt_gl_work *work, const struct pt_buffer_row *row);
int pt_gl_bind_texture(struct pt_gl_device *d, enum pt_unit unit, const struct pt_buffer *plane);
int pt_gl_bind_texels(struct pt_gl_device *d, enum pt_unit unit, GLuint name, size_t offset, size_t size); // a part of a buffer
// Uses a program, unless it is in use.
void pt_gl_use(struct pt_gl_device *d, GLuint program);
// After buffers were deleted: their names may come again.
void pt_gl_bound_forget(struct pt_gl_device *d);
// pt_gl_check behind a dispatch, in software. On a GPU the end of a call checks for all dispatches: a check waits for the driver's thread.
int pt_gl_check_dispatch(struct pt_gl_device *d, const char *doing);
// Before a program runs: whether it finds what points have by pixel (ranges.c).
void pt_gl_tell_by_pixel(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t variant);
// A grid of at least `count` workgroups, within every driver's limits.
void pt_gl_grid(uint32_t count, uint32_t *x, uint32_t *y);
int pt_gl_dispatch(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t variant, uint32_t x, uint32_t y);
// Workgroups for every pixel, of programs whose invocations take several of a row each (lib/planes.glsl).
int pt_gl_dispatch_rows(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t variant, uint32_t width, uint32_t height);

// memory.c
// At least `size` bytes; keeps the first `keep` bytes when it has to grow.
int pt_gl_scratch(struct pt_gl_device *d, enum pt_gl_scratch_use use, size_t size, size_t keep);
// words: 16 bytes; a shorter pattern repeats in them. Offset is a multiple of 8, and so is what is cleared: size is rounded up.
int pt_gl_clear(struct pt_gl_device *d, GLuint name, size_t offset, size_t size, const uint32_t words[4]);
int pt_gl_write(struct pt_gl_device *d, GLuint name, size_t offset, size_t size, const void *source);
enum { PT_GL_ZEROS = 128 };
void pt_gl_zero(struct pt_gl_device *d, GLuint name, size_t offset, size_t size); // at most PT_GL_ZEROS bytes: heads of lists
// Waits for all that was asked for before.
int pt_gl_read(struct pt_gl_device *d, GLuint name, size_t offset, size_t size, void *target);

// ranges.c: clouds that are larger than what the device may hold of them
enum { PT_GL_BUFFERS = 24, PT_GL_WINNERS = 2 };
struct pt_gl_winners {
    struct pt_buffer *buffers[PT_GL_BUFFERS], gathered[PT_GL_WINNERS];
};
int pt_gl_in_ranges(const struct pt_buffer *buffer); // what points have, and it is not here
// A range: room for all of it, as pt_gl_range_room says of each buffer; then these, `each` bytes a slot, and where they lie.
int pt_gl_range_begin(struct pt_gl_device *d, size_t size);
size_t pt_gl_range_room(const struct pt_gl_device *d, size_t size);
int pt_gl_range_add(struct pt_gl_device *d, const struct pt_buffer *buffer, size_t each, const struct pt_slots *slots,
                    const struct chunk_view *chunks, int culled, GLuint *name, size_t *offset);
// Makes the points' buffers of a kernel that asks for single points planes of what its pixels show; winners lasts as long as work.
int pt_gl_take_winners(struct pt_gl_device *d, struct pt_gl_work *work, struct pt_gl_winners *winners);
int pt_gl_gather_winners(struct pt_gl_device *d, const struct pt_gl_work *work, const struct pt_buffer *buffer, uint32_t place,
                         struct pt_buffer *out);

// tiles.c
// Lists the tiles of a key plane, unless the lists at hand are still good.
int pt_gl_tiles(struct pt_gl_device *d, const struct pt_buffer *keys, const struct view_args *view);
void pt_gl_tiles_forget(struct pt_gl_device *d); // keys changed
int pt_gl_dispatch_tiles(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t variant, enum pt_gl_tile_list list);
// Walks the list of tiles that begins there in a buffer, at most `most` of them.
int pt_gl_dispatch_tile_list(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t variant, GLuint name, size_t head,
                             size_t most);

// lists.c
// An empty list with room for `size` bytes of entries in this memory, bound.
int pt_gl_list_begin(struct pt_gl_device *d, enum pt_gl_scratch_use use, uint32_t binding, size_t size);
// Writes into the heads of `count` lists that are bound there, `stride` bytes apart, how many workgroups walk them: `parts` for each
// so many `entries`.
int pt_gl_list_groups(struct pt_gl_device *d, uint32_t binding, uint32_t count, size_t stride, uint32_t entries,
                      uint32_t parts);
// As many workgroups as a head in a buffer says.
int pt_gl_list_dispatch(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t variant, GLuint name, size_t head);

// The scales of shadow words of a program with lib/phong.glsl.
void pt_gl_set_scales(struct pt_gl_device *d, GLuint program, const struct shade_args *args);

// raster.c, scatter.c, fill.c, pixels.c, soft.c: kernels of several dispatches. They find their buffers bound, and tiles listed where
// that is their domain. pt_gl_points: one dispatch over the points of an instance; pt_gl_points_of: of this program.
typedef int pt_gl_runner(struct pt_gl_device *d, const struct pt_gl_work *work);
int pt_gl_is_pointwise(enum pt_kernel kernel); // pointwise.c runs it
pt_gl_runner pt_gl_pointwise;
pt_gl_runner pt_gl_raster, pt_gl_scatter, pt_gl_splat, pt_gl_blend, pt_gl_average, pt_gl_merge, pt_gl_differ, pt_gl_points,
    pt_gl_fill, pt_gl_fill_tiles, pt_gl_shade, pt_gl_antialias, pt_gl_push, pt_gl_lines, pt_gl_gather, pt_gl_soft;
int pt_gl_points_of(struct pt_gl_device *d, const struct pt_gl_work *work, uint32_t variant);
// The picture from what is shaded: smooth, antialias and compose at once, whose passes these are.
int pt_gl_tail(struct pt_gl_device *d, const struct pt_bound_pass *passes, const struct pt_buffer *shaded);
// The coarse cells over the rectangle of a push.
struct view_args pt_gl_coarse_view(const struct push_args *args);

// kernels.c
int pt_gl_run(struct pt_gl_device *d, const struct pt_gl_work *work);
// shade, of any number of instances, smooth, antialias and compose, without the planes between them.
int pt_gl_run_tail(struct pt_gl_device *d, const struct pt_bound_pass *passes, uint32_t count);

// selftest.c
// Whether 64-bit atomics of this driver give what the CPU says; 0 too where the driver has none.
int pt_gl_key64_works(struct pt_gl_device *d);

#endif
