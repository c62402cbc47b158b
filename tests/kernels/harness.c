// SPDX-License-Identifier: GPL-3.0-or-later
#include "harness.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { MOST_BUFFERS = 4096, MOST_BLOCKS = 8192, MOST_SAVED = 1024, MOST_PRINTED = 6 };

// The devices of `all`. Threads, batches and lack of memory must not show: the CPU devices differ in all of them.
static const struct device_choice {
    const char *name;
    uint32_t threads, batch;
    uint64_t memory_cap; // 1 byte: threads share one key plane
} choices[] = {
    {"cpu-scalar", 1, 0, 0},
    {"cpu", 3, 1, 0},
#if defined(__aarch64__)
    {"cpu-neon", 7, 3, 1},
#else
    {"cpu-sse42", 2, 0, 0},  {"cpu-avx2", 7, 3, 1},  {"cpu-avx512", 1, 0, 0},
#endif
#if defined(_WIN32)
    {"gl-wgl", 0, 0, 0},
#else
    {"gl-egl", 0, 0, 0},     {"gl-osmesa", 0, 0, 0},
#endif
};
enum { CHOICES = sizeof choices / sizeof choices[0] };

static struct slot {
    patina_device *device;
    char reason[256];
    int wanted;
} slots[CHOICES];

// What the first device gave, by order of the calls in a case.
struct saved {
    void *data;
    size_t size;
};
struct baseline {
    struct saved saved[MOST_SAVED];
    int count;
};

struct harness {
    const struct harness_case *test;
    const char *label;
    patina_device *device;
    struct baseline *baseline;
    int first, compared;
    int differed; // something compared has not the first device's bits
    int failures;
    size_t open, pixels; // left open by the reference, of so many
    void *blocks[MOST_BLOCKS];
    int block_count;
    struct pt_buffer buffers[MOST_BUFFERS];
    int buffer_count;
};

struct entry {
    const struct harness_case *test;
    int choice; // -1: no device
    struct baseline *baseline;
};

void harness_fail(struct harness *h, const char *label, int x, int y, const char *format, ...)
{
    if (h->failures++ >= MOST_PRINTED)
        return;
    char text[512];
    va_list list;
    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    printf("  %s: %s: %s (%d, %d): %s\n", h->label, h->test->name, label, x, y, text);
}

void harness_note(struct harness *h, const char *format, ...)
{
    if (!h->first) // the same on every device
        return;
    va_list list;
    va_start(list, format);
    printf("  %s: ", h->test->name);
    vprintf(format, list);
    printf("\n");
    va_end(list);
}

int harness_failures(const struct harness *h) { return h->failures; }

static void must(struct harness *h, int ok, const char *what)
{
    if (ok)
        return;
    char message[512] = "";
    if (h->device)
        patina_message(h->device, message, sizeof message);
    printf("  %s: %s: %s failed: %s\n", h->label, h->test->name, what, message);
    fail();
}

void *harness_alloc(struct harness *h, size_t size)
{
    void *block = calloc(1, size ? size : 1);
    must(h, block && h->block_count < MOST_BLOCKS, "memory");
    h->blocks[h->block_count++] = block;
    return block;
}

struct pt_buffer *harness_buffer(struct harness *h, const void *data, size_t size)
{
    must(h, h->buffer_count < MOST_BUFFERS, "one more buffer");
    struct pt_buffer *buffer = &h->buffers[h->buffer_count];
    must(h, h->device->ops->buffer_create(h->device, size, data, 0, buffer) == PATINA_OK, "buffer_create");
    h->buffer_count++;
    return buffer;
}

void *harness_read(struct harness *h, const struct pt_buffer *buffer)
{
    void *data = harness_alloc(h, buffer->size);
    must(h, h->device->ops->buffer_read(h->device, buffer, 0, data, buffer->size) == PATINA_OK, "buffer_read");
    return data;
}

// As the executor does: what bins hold is lost.
static void give_room(struct harness *h, struct pt_buffer **bound, uint32_t count)
{
    int some = 0;
    for (uint32_t i = 0; i < count; i++) {
        const size_t wanted = bound[i]->wanted;
        if (wanted <= bound[i]->size)
            continue;
        some = 1;
        h->device->ops->buffer_destroy(h->device, bound[i]);
        must(h, h->device->ops->buffer_create(h->device, wanted, NULL, 0, bound[i]) == PATINA_OK, "buffer_create");
    }
    must(h, some, "a buffer that wants more room");
}

void harness_run(struct harness *h, enum pt_kernel kernel, const void *arguments, size_t size, struct pt_buffer *const *buffers,
                 uint32_t count)
{
    static struct pt_buffer none;
    const struct pt_kernel_row *row = &pt_kernels[kernel];
    struct pt_buffer *bound[64];
    must(h, count >= row->fixed && (row->each ? (count - row->fixed) % row->each == 0 : count == row->fixed) && count <= 64,
         "as many buffers as kernels.def lists");
    for (uint32_t i = 0; i < count; i++) {
        const struct pt_buffer_row *of = &row->buffers[i < row->fixed ? i : row->fixed + (i - row->fixed) % row->each];
        must(h, buffers[i] || of->optional, of->name);
        bound[i] = buffers[i] ? buffers[i] : &none;
    }
    int result = h->device->ops->run(h->device, kernel, arguments, size, bound, count, NULL);
    for (int again = 0; result == PT_MORE_ROOM && again < 3; again++) {
        give_room(h, bound, count);
        result = h->device->ops->run(h->device, kernel, arguments, size, bound, count, NULL);
    }
    must(h, result == PATINA_OK, pt_kernels[kernel].name);
}

// What the first device handed in at this place of the case; NULL: it failed before it came here.
static const struct saved *next_saved(struct harness *h)
{
    const int at = h->compared++;
    return at < h->baseline->count ? &h->baseline->saved[at] : NULL;
}

void harness_keep(struct harness *h, const void *data, size_t size)
{
    if (!h->first)
        return;
    const int at = h->compared++;
    must(h, at < MOST_SAVED, "one more comparison");
    struct saved *saved = &h->baseline->saved[at];
    *saved = (struct saved){malloc(size ? size : 1), size};
    must(h, saved->data != NULL, "memory");
    memcpy(saved->data, data, size);
    h->baseline->count = at + 1;
}

const void *harness_kept(struct harness *h)
{
    if (h->first)
        return NULL;
    const struct saved *saved = next_saved(h);
    return saved && !h->differed ? saved->data : NULL;
}

int harness_settled(const struct harness *h) { return !h->first && !h->differed && h->compared > 0; }

void harness_same(struct harness *h, const char *label, const void *data, size_t count, size_t element, size_t per_pixel,
                  uint32_t width)
{
    size_t size = count * element;
    if (h->first) {
        harness_keep(h, data, size);
        return;
    }
    const struct saved *saved = next_saved(h);
    if (!saved) {
        h->differed = 1;
        return;
    }
    must(h, saved->size == size, "same size on every device");
    if (!memcmp(saved->data, data, size))
        return;
    h->differed = 1;
    size_t different = 0;
    for (size_t i = 0; i < count; i++) {
        const char *got = (const char *)data + i * element, *expected = (const char *)saved->data + i * element;
        if (!memcmp(got, expected, element))
            continue;
        if (different++ > 3)
            continue;
        size_t pixel = i / per_pixel;
        uint64_t g = 0, e = 0;
        memcpy(&g, got, element);
        memcpy(&e, expected, element);
        harness_fail(h, label, (int)(pixel % width), (int)(pixel / width), "element %zu: bits %016llx, %s has %016llx",
                     i % per_pixel, (unsigned long long)g, choices[0].name, (unsigned long long)e);
    }
    harness_fail(h, label, 0, 0, "%zu of %zu elements are not bit-equal to %s", different, count, choices[0].name);
}

int harness_near(double got, double expected, double error)
{
    return isfinite(expected) ? fabs(got - expected) <= error : got == expected;
}

void harness_unsure(struct harness *h, size_t unsure, size_t pixels, double most)
{
    h->open += unsure;
    h->pixels += pixels;
    if ((double)unsure > 2.0 + most * (double)pixels)
        harness_fail(h, "reference", 0, 0, "leaves %zu of %zu pixels open", unsure, pixels);
}

static void run_entry(void **state)
{
    const struct entry *entry = *state;
    const struct slot *slot = entry->choice >= 0 ? &slots[entry->choice] : NULL;
    if (slot && !slot->device) {
        printf("skip %s: %s\n", choices[entry->choice].name, slot->reason);
        skip();
    }
    // Static: cmocka leaves a failed test by longjmp, and the next entry frees what it left.
    static struct harness h;
    for (int i = 0; i < h.block_count; i++)
        free(h.blocks[i]);
    for (int i = 0; i < h.buffer_count; i++)
        h.device->ops->buffer_destroy(h.device, &h.buffers[i]);
    memset(&h, 0, sizeof h);
    if (!entry->test)
        return;
    h.test = entry->test;
    h.baseline = entry->baseline;
    h.label = slot ? choices[entry->choice].name : "reference";
    h.device = slot ? slot->device : NULL;
    h.first = entry->choice <= 0;
    entry->test->run(&h);
    if (h.open)
        harness_note(&h, "%zu of %zu pixels left open by float32", h.open, h.pixels);
    if (h.failures)
        fail_msg("%s: %s: %d failures", h.label, h.test->name, h.failures);
}

// Named once or several times; the first, which the others are held against, is always among them.
static void want(const char *name)
{
    int known = !strcmp(name, "all");
    slots[0].wanted = 1;
    for (int i = 0; i < CHOICES; i++) {
        slots[i].wanted |= !strcmp(name, "all") || !strcmp(name, choices[i].name);
        known |= !strcmp(name, choices[i].name);
    }
    if (!known) {
        fprintf(stderr, "no such device: %s\n", name);
        exit(2);
    }
}

// key64: OpenGL without 64-bit atomics is an error, for a run that is there to try them.
static void open_devices(int key64)
{
    for (int i = 0; i < CHOICES; i++) {
        if (!slots[i].wanted)
            continue;
        patina_device_desc desc = {.struct_size = sizeof desc,
                                   .name = choices[i].name,
                                   .threads = choices[i].threads,
                                   .batch = choices[i].batch,
                                   .memory_cap = choices[i].memory_cap};
        if (patina_device_create(&desc, &slots[i].device) != PATINA_OK) {
            slots[i].device = NULL;
            patina_message(NULL, slots[i].reason, sizeof slots[i].reason);
        } else if (key64 && !strncmp(choices[i].name, "gl", 2) && !slots[i].device->info.key64) {
            fprintf(stderr, "%s has no 64-bit atomics\n", slots[i].device->info.description);
            exit(2);
        }
    }
}

int harness_main(int argc, char **argv, const struct harness_case *cases, size_t count)
{
    int key64 = 0;
    for (int i = 1; i < argc; i++) {
        if (!strcmp(argv[i], "--device") && i + 1 < argc) {
            want(argv[++i]);
        } else if (!strcmp(argv[i], "--key64")) {
            key64 = 1;
        } else {
            fprintf(stderr, "usage: %s [--device NAME|all]... [--key64]\n", argv[0]);
            return 2;
        }
    }
    if (!slots[0].wanted)
        want("all");
    setvbuf(stdout, NULL, _IOLBF, 0);
    open_devices(key64);
    size_t most = count * CHOICES, used = 0;
    struct CMUnitTest *tests = calloc(most + 1, sizeof *tests);
    struct entry *entries = calloc(most + 1, sizeof *entries);
    struct baseline *baselines = calloc(count + 1, sizeof *baselines);
    if (!tests || !entries || !baselines)
        return 2;
    for (size_t c = 0; c < count; c++) {
        for (int i = cases[c].host ? -1 : 0; i < (cases[c].host ? 0 : CHOICES); i++) {
            if (i >= 0 && !slots[i].wanted)
                continue;
            char name[160];
            snprintf(name, sizeof name, "%s [%s]", cases[c].name, i < 0 ? "reference" : choices[i].name);
            entries[used] = (struct entry){&cases[c], i, &baselines[c]};
            tests[used] = (struct CMUnitTest){strdup(name), run_entry, NULL, NULL, &entries[used]};
            used++;
        }
    }
    const char *program = strrchr(argv[0], '/') ? strrchr(argv[0], '/') + 1 : argv[0];
    int failed = _cmocka_run_group_tests(program, tests, used, NULL, NULL);
    struct entry last = {NULL, -1, NULL};
    void *state = &last;
    run_entry(&state); // frees what the last case left
    for (size_t i = 0; i < used; i++)
        free((void *)tests[i].name);
    for (size_t c = 0; c < count; c++)
        for (int i = 0; i < baselines[c].count; i++)
            free(baselines[c].saved[i].data);
    for (int i = 0; i < CHOICES; i++)
        patina_device_destroy(slots[i].device);
    free(tests);
    free(entries);
    free(baselines);
    return failed;
}
