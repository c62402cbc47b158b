// SPDX-License-Identifier: GPL-3.0-or-later
// What a device is: buffers, run(kernel, arguments), read back. Devices know kernels and no pipeline; arguments were
// checked above (api/, plan/), kernels trust them.
#ifndef PT_DEVICE_H
#define PT_DEVICE_H

#include "base/error.h"
#include "kernels.h"
#include "shared/view.h"

#include <stdatomic.h>

// ---- kernels.def, as build/generate_kernels makes it ------------------------------------------------------------------
// PT_KERNEL_NAME, PT_BUF_KERNEL_NAME: a buffer's place among those that a pass binds; PT_BUFS_KERNEL: how many these are;
// PT_EACH_KERNEL: how many of them, the last, repeat once an instance; PT_BIND_KERNEL_NAME: its storage block in GLSL.

struct pt_buffer_row {
    const char *name;
    uint32_t formats; // bits 1 << pt_format: any of them
    uint16_t places;  // bits PT_AT_*: any of them
    uint8_t read, written, optional;
    uint8_t binding; // of its storage block in GLSL; 0: it has none
    uint8_t unit;    // 1 + pt_unit of its buffer texture there; 0: it is none
    uint8_t soft;    // this texture only in software
    uint8_t uniform; // binding of its uniform block there; 0: it is none
};

struct pt_kernel_row {
    const char *name;
    enum pt_domain domain;
    enum pt_stage stage;
    int reach;                           // pixels; -1: its arguments say
    uint32_t fixed, each;                // buffers: those once, and behind them those once an instance
    const struct pt_buffer_row *buffers; // fixed + each
};

extern const struct pt_kernel_row pt_kernels[PT_KERNEL_COUNT];
extern const char *const pt_format_names[PT_FORMAT_COUNT];
extern const uint8_t pt_format_bytes[PT_FORMAT_COUNT]; // a pixel; 0: no plane has this format

// Device memory. CPU: data points to it. Owned by the device that made it.
struct pt_buffer {
    size_t size;      // bytes
    size_t room;      // bytes there are: at least size
    void *data;       // CPU device: the memory. GL device: NULL
    uint32_t name;    // GL device: buffer object
    uint32_t wrapped; // CPU device: data belongs to somebody else
    size_t clean[2];  // keys: bytes at its beginning and at its end that are empty
    uint32_t each;    // bytes a slot of a cloud's positions; 0: they are floats
    size_t wanted;    // bytes that it lacks to be large enough for a kernel that answered PT_MORE_ROOM
    const void
        *source; // GL device: what was lent for it, as long as that lives; of PT_IN_RANGES all there is of it, and name is 0
};

// What run answers where a buffer of bins is too small: nothing that others read was written. Whoever bound it gives it as much as is
// wanted, or more, and runs the kernel again.
enum { PT_MORE_ROOM = 1 };

// ---- bins of discs: what splat leaves to blend ------------------------------------------------------------------------

enum {
    // Discs are binned to squares of so many pixels. With 32 a million points take 34.1 ms, with 128 33.7: the sums of blend are 128 KiB
    // with 64, where it takes 31.4.
    PT_DISC_TILE_SHIFT = 6,
    PT_DISC_TILE = 1 << PT_DISC_TILE_SHIFT,
    PT_DISC_LARGE = 16, // a disc over more tiles than this goes to a bin that every tile looks through
    PT_BIN_DISCS = 31,  // of a block
    PT_BIN_BLOCK = 640, // bytes
    PT_BIN_SHARE = 32,  // blocks that a thread takes at once
    PT_BIN_HEAD = 256,  // bytes that say where the rest lies
    PT_BIN_THREAD = 64
};

// Bytes of bins with so many blocks, of a device with so many threads that fill them: for each of these one block more, whose discs are
// counted and not kept.
static inline size_t pt_bins_bytes(uint32_t bins, uint32_t threads, uint64_t blocks)
{
    const size_t heads = ((size_t)threads * (bins + threads) * 4 + 63) / 64 * 64;
    return PT_BIN_HEAD + (size_t)threads * PT_BIN_THREAD + heads + (size_t)(blocks + threads) * PT_BIN_BLOCK;
}

// Tiles of a picture, and one for large discs.
static inline uint32_t pt_bins_of(const struct view_args *view)
{
    return ((view->width + PT_DISC_TILE - 1) >> PT_DISC_TILE_SHIFT) *
               ((view->height + PT_DISC_TILE - 1) >> PT_DISC_TILE_SHIFT) +
           1;
}

// ---- devices ----------------------------------------------------------------------------------------------------------

// A kernel with what it runs on: see run.
struct pt_bound_pass {
    enum pt_kernel kernel;
    const void *arguments;
    struct pt_buffer **buffers;
    uint32_t buffer_count;
    size_t argument_size;
};

// What a device was asked to do since it was made: frames report differences.
struct pt_counts {
    // OpenGL. empty: dispatches without a workgroup (direct ones; indirect ones of frames that are measured). copies: of buffers to
    // buffers, and uploads into parts of buffers. waits: calls that block until submitted work is done.
    uint64_t dispatches, empty, barriers, calls, copies, waits;
    uint64_t uploaded; // bytes that the host handed to the driver
    uint64_t steps;    // processor: steps of its threads, each of which ends with a barrier
};

// What was asked between two counts.
static inline struct pt_counts pt_counts_between(const struct pt_counts *before, const struct pt_counts *after)
{
    return (struct pt_counts){.dispatches = after->dispatches - before->dispatches,
                              .empty = after->empty - before->empty,
                              .barriers = after->barriers - before->barriers,
                              .calls = after->calls - before->calls,
                              .copies = after->copies - before->copies,
                              .waits = after->waits - before->waits,
                              .uploaded = after->uploaded - before->uploaded,
                              .steps = after->steps - before->steps};
}

// Passes that run as one, or a single one, of several that follow each other.
struct pt_group {
    const struct pt_bound_pass *passes;
    uint32_t count;
    float done;              // the progress, once it is handed to the driver
    uint64_t bytes;          // that it reads and writes, by the plan
    double ms;               // out: that it took, with those that follow it and have `joined`
    int joined;              // out: its time is in that of a group before it
    struct pt_counts counts; // out: what it asked of the device
};

// How a buffer is made of what is given.
enum {
    PT_COPY = 0,
    PT_BORROW = 1, // that lives as long as the buffer, unchanged: a device need not copy it
    PT_IN_RANGES =
        2,         // what a cloud's points have: a device that copies does so a range at a time, whenever a kernel asks for it
    PT_ZEROED = 4, // without a source: it is zero; on the processor pages that nobody touches take no memory
};

// What a device that copies clouds may hold of them, where they are larger.
struct pt_ranges {
    uint64_t most;   // bytes that a kernel reads of points at a time; 0: clouds lie there whole
    uint64_t failed; // bytes of clouds that the driver had no memory for; 0: it never came to that
    uint64_t read;   // out: bytes of points, in ranges
    uint32_t rounds; // out: ranges that the kernel took that took most
};

struct pt_device_ops {
    void (*destroy)(struct patina_device *device);
    // Uninitialised memory, or a copy of source when not NULL. how: bits PT_BORROW, PT_IN_RANGES, PT_ZEROED.
    int (*buffer_create)(struct patina_device *device, size_t size, const void *source, int how, struct pt_buffer *out);
    void (*buffer_destroy)(struct patina_device *device, struct pt_buffer *buffer);
    int (*buffer_write)(struct patina_device *device, struct pt_buffer *buffer, size_t offset, const void *source, size_t size);
    int (*buffer_read)(struct patina_device *device, const struct pt_buffer *buffer, size_t offset, void *target, size_t size);
    // Repeats a pattern of 4 or 8 bytes (low word first) from offset on, `size` bytes; both are multiples of 8, or size reaches
    // the buffer's end.
    int (*buffer_fill)(struct patina_device *device, struct pt_buffer *buffer, size_t offset, size_t size, uint64_t pattern,
                       uint32_t bytes);
    // Runs a kernel; arguments are copied, buffers as kernels.def lists them. When it returns, later calls see its effect.
    // cancel (may be NULL) is polled by long kernels; a cancelled run leaves undefined planes and returns
    // PATINA_ERROR_CANCELLED. PT_MORE_ROOM: see there.
    int (*run)(struct patina_device *device, enum pt_kernel kernel, const void *arguments, size_t argument_size,
               struct pt_buffer *const *buffers, uint32_t buffer_count, const atomic_int *cancel);
    // Runs the tail of a plan, its last passes, as one, without the planes between its passes. NULL where a device gains
    // nothing by it. tail_length: how many of these passes it takes, 0 or from the first on; their buffers are not known yet.
    // NULL: all there are. cancel: as in run.
    uint32_t (*tail_length)(const struct pt_bound_pass *passes, uint32_t count);
    int (*run_tail)(struct patina_device *device, const struct pt_bound_pass *passes, uint32_t count, const atomic_int *cancel);
    // All of these at one go: the device is waited for once. cancel, progress: NULL: nobody asks. Times are the device's own: of each
    // group in a frame that is measured; else only of those over points, and of all others between them. NULL where that is no faster
    // than run, run_tail and wait in turn.
    int (*run_groups)(struct patina_device *device, struct pt_group *groups, uint32_t count, const atomic_int *cancel,
                      _Atomic float *progress);
    // The most bytes that a kernel can bind as this buffer of its list. NULL: any number.
    uint64_t (*most)(const struct patina_device *device, const struct pt_buffer_row *row);
    // Waits for all work (so that a clock means something).
    int (*wait)(struct patina_device *device);
    // Until the next call kernels call look(context) from time to time, from any of their threads; look NULL: no longer.
    void (*watch)(struct patina_device *device, void (*look)(void *context), void *context);
    // While no frame draws.
    int (*counts)(struct patina_device *device, struct pt_counts *out);
};

struct patina_device {
    struct pt_handle handle;
    const struct pt_device_ops *ops;
    patina_device_info info;
    struct pt_pool *pool;    // its threads, which make plans too; NULL: it has none
    uint32_t bin_threads;    // that fill bins of discs; 0: its kernels do without, and planes of such bins have no memory
    uint64_t memory_cap;     // bytes of planes a frame may hold; 0: no limit
    uint64_t mapped_cap;     // bytes that a picture holds of clouds in mapped files; 0: as run/pager.h chooses
    int copies;              // what it is given to borrow, into memory of its own
    uint64_t own_memory;     // bytes that this has for all, as its driver said at the start; 0: not known
    struct pt_ranges ranges; // run/pager.h sets it for a picture
    int measured;            // the frame whose turn it is wants the time of each pass, and counts of empty dispatches
    // Frames of one device take turns, for its scratch is one. `changed` is told when a turn ends, or a frame is cancelled.
    struct pt_mutex turns;
    struct pt_condition changed;
    int taken;
};

// Constructors; each returns PATINA_ERROR_UNSUPPORTED with the reason at the thread when it cannot be had.
int pt_device_cpu_create(const patina_device_desc *desc, const char *isa, struct patina_device **out);
int pt_device_gl_create(const patina_device_desc *desc, const char *context, struct patina_device **out);

#endif
