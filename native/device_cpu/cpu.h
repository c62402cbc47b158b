// SPDX-License-Identifier: GPL-3.0-or-later
// What a CPU kernel gets: its arguments, its buffers as pointers, the pool, scratch.
#ifndef PT_CPU_H
#define PT_CPU_H

#include "device.h"
#include "base/pool.h"

// Planes may be read this many bytes past their end (never written): vector loads at a row's end need no tail case.
enum { PT_SLACK = 256 };

struct pt_cpu_scratch {
    void *memory; // pages
    size_t size;
};

struct pt_cpu_call {
    const void *arguments;
    struct pt_buffer *const *buffers;
    uint32_t buffer_count;
    struct pt_pool *pool;
    const atomic_int *cancel;       // may be NULL
    struct pt_cpu_scratch *scratch; // [PT_CPU_SCRATCHES], kept between calls
};

// SPARSE: of which a call writes here and there a little: it comes in small pages.
enum { PT_CPU_SPARSE = 2, PT_CPU_SCRATCHES };

// Scratch memory of at least `size` bytes, contents undefined, grown if need be. NULL when memory lacks.
void *pt_cpu_scratch(const struct pt_cpu_call *call, uint32_t index, size_t size);

static inline int pt_cpu_cancelled(const struct pt_cpu_call *call)
{
    return call->cancel && atomic_load_explicit(call->cancel, memory_order_relaxed);
}

// The memory of the n-th buffer that is bound; NULL: it is missing.
static inline void *pt_cpu_data(const struct pt_cpu_call *call, uint32_t n) { return call->buffers[n]->data; }
// The same by its name in kernels.def; each: of instance i.
#define PT_DATA(call, kernel, name) pt_cpu_data(call, PT_BUF_##kernel##_##name)
#define PT_DATA_EACH(call, kernel, name, i) pt_cpu_data(call, PT_BUF_##kernel##_##name + PT_EACH_##kernel * (i))

// Where the chunks of each instance begin in the list of all chunks; begins[instances]: how many there are. Those of instance
// i are the buffer first + i stride.
static inline void pt_chunk_begins(const struct pt_cpu_call *call, uint32_t first, uint32_t stride, uint32_t instances,
                                   uint32_t *begins)
{
    begins[0] = 0;
    for (uint32_t i = 0; i < instances; i++)
        begins[i + 1] = begins[i] + (uint32_t)(call->buffers[first + i * stride]->size / sizeof(struct chunk_view));
}

// The instance that a chunk of the list is of, sought from instance `near` on: threads walk the list nearly in order.
static inline uint32_t pt_chunk_instance(const uint32_t *begins, uint32_t chunk, uint32_t near)
{
    while (chunk < begins[near])
        near--;
    while (chunk >= begins[near + 1])
        near++;
    return near;
}

// A kernel returns PATINA_OK, PATINA_ERROR_MEMORY, PATINA_ERROR_CANCELLED or PT_MORE_ROOM; from one run to the next it keeps nothing.
typedef int pt_cpu_kernel(const struct pt_cpu_call *call);

// Kernels that run as one: see device.h, run_tail.
struct pt_cpu_pass {
    enum pt_kernel kernel;
    struct pt_cpu_call call;
};
typedef int pt_cpu_tail(const struct pt_cpu_pass *passes, uint32_t count);

// The instruction sets that this build has, the best first: X(name, whether the processor knows it). Kernels are compiled once for each
// (build/CMakeLists.txt), as PT_ISA.
#if defined(PT_ONLY_SCALAR)
#define PT_EACH_ISA(X) X(scalar, 1)
#elif defined(__aarch64__)
#define PT_EACH_ISA(X) X(neon, 1) X(scalar, 1)
#else
#define PT_EACH_ISA(X)                                                                                                         \
    X(avx512, pt_processor_vectors() >= PT_VECTORS_AVX512)                                                                     \
    X(avx2, pt_processor_vectors() >= PT_VECTORS_AVX2)                                                                         \
    X(sse42, pt_processor_vectors() >= PT_VECTORS_SSE42)                                                                       \
    X(scalar, 1)
#endif

// What an instruction set gives the device: isa.c.
struct pt_cpu_isa {
    const char *name;
    pt_cpu_kernel *kernels[PT_KERNEL_COUNT];
    pt_cpu_tail *tail;
};
#define PT_X(isa, known) extern const struct pt_cpu_isa pt_cpu_isa_##isa;
PT_EACH_ISA(PT_X)
#undef PT_X

#ifdef PT_ISA // within one
#define PT_CONCAT_(a, b) a##b
#define PT_CONCAT(a, b) PT_CONCAT_(a, b)
// The name of this one's variant of a kernel's entry: pt_kernel_scatter_avx2.
#define PT_KERNEL_ENTRY(name) PT_CONCAT(pt_kernel_##name##_, PT_ISA)
#define PT_X(name) pt_cpu_kernel PT_KERNEL_ENTRY(name);
PT_EACH_KERNEL(PT_X)
#undef PT_X
pt_cpu_tail PT_KERNEL_ENTRY(tail);
#endif

#endif
