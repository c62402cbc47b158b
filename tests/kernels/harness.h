// SPDX-License-Identifier: GPL-3.0-or-later
// Runs every case of a kernel test on every device, against the reference and against the first device.
//
//     test_NAME [--device cpu|cpu-scalar|cpu-sse42|cpu-avx2|cpu-avx512|cpu-neon|gl-egl|gl-osmesa|gl-wgl|all]   (default: all)
//
// A device that cannot be had is printed ("skip DEVICE: reason") and counted as skipped. cpu-scalar always runs, and
// first: what it computes is the baseline that the others must equal to the bit.
#ifndef PT_HARNESS_H
#define PT_HARNESS_H

#include "device.h"
#include "reference.h"
#include "tolerances.h"

#include <stddef.h>

struct harness; // one case on one device

struct harness_case {
    const char *name;
    void (*run)(struct harness *h);
    int host; // 1: tests the reference itself, needs no device
};

int harness_main(int argc, char **argv, const struct harness_case *cases, size_t count);

// Memory and buffers live until the case ends on this device; failures to get them end the case.
void *harness_alloc(struct harness *h, size_t size); // zeroed
struct pt_buffer *harness_buffer(struct harness *h, const void *data, size_t size);
void *harness_read(struct harness *h, const struct pt_buffer *buffer);
// buffers: as kernels.def lists them; NULL where one may be missing and is.
void harness_run(struct harness *h, enum pt_kernel kernel, const void *arguments, size_t size, struct pt_buffer *const *buffers,
                 uint32_t count);
#define HARNESS_RUN(h, name, arguments, ...)                                                                                   \
    harness_run(h, PT_KERNEL_##name, arguments, sizeof *(arguments), (struct pt_buffer *const[]){__VA_ARGS__},                 \
                sizeof((struct pt_buffer *const[]){__VA_ARGS__}) / sizeof(struct pt_buffer *))

// Prints "DEVICE: case: label pixel (x, y): message"; the case fails at its end. Says so only a few times a case.
void harness_fail(struct harness *h, const char *label, int x, int y, const char *format, ...)
    __attribute__((format(printf, 5, 6)));
void harness_note(struct harness *h, const char *format, ...) __attribute__((format(printf, 2, 3)));
int harness_failures(const struct harness *h);
// A condition that is no pixel's.
#define HARNESS_CHECK(h, condition)                                                                                            \
    do {                                                                                                                       \
        if (!(condition))                                                                                                      \
            harness_fail(h, "check", __LINE__, 0, "%s", #condition);                                                           \
    } while (0)

// Bits must equal what the first device gave under this label. element: 4 or 8 bytes; per_pixel: elements a pixel.
void harness_same(struct harness *h, const char *label, const void *data, size_t count, size_t element, size_t per_pixel,
                  uint32_t width);
// Whether all that was compared so far has the bits of the first device: what the reference says of those then holds here too, and a
// test need not ask it again.
int harness_settled(const struct harness *h);
// What the first device's run of the case handed in here: for what a reference takes long to find, of inputs that were compared. Owned by
// the harness; NULL: not there, to be found and handed in.
const void *harness_kept(struct harness *h);
void harness_keep(struct harness *h, const void *data, size_t size);
// |got - expected| <= error; NaN never is.
int harness_near(double got, double expected, double error);
// At most this share of the pixels (TOL_UNSURE_SHARE, TOL_UNSURE_HARD) may have been left open by the reference.
void harness_unsure(struct harness *h, size_t unsure, size_t pixels, double most);

// ---- random pictures (picture.c) ------------------------------------------------------------------------------------

struct rng {
    uint64_t state;
};
uint64_t rng_next(struct rng *rng);
double rng_unit(struct rng *rng); // [0, 1)
double rng_range(struct rng *rng, double lo, double hi);
uint32_t rng_below(struct rng *rng, uint32_t n);
void rng_direction(struct rng *rng, float out[3]);

// A window of width x height pixels somewhere in a larger picture.
struct view_args picture_view(uint32_t width, uint32_t height, int perspective);

// What fills a picture.
enum picture_kind {
    PICTURE_SURFACES, // a ball before a tilted wall, with noise
    PICTURE_NOISE,    // three depths in disorder, any normals, any d_eff
    PICTURE_FLAT,     // one depth, one normal: keys differ by id alone
    PICTURE_TIGHT,    // two depths d_eff +- 8 ulp apart
    PICTURE_GRAZING,  // normals across the view
    PICTURE_RANGE,    // depths from near to far = 10^7 near
    PICTURE_KINDS
};
extern const char *const picture_kind_names[PICTURE_KINDS];

// Level-0 planes after scatter and surface: a share `density` of the pixels is measured.
struct picture {
    struct view_args view;
    enum picture_kind kind;
    size_t count; // pixels
    uint32_t id_base;
    uint64_t *keys;
    uint32_t *from;
    float *normal, *deff, *span, *color;
};
struct picture picture_random(struct harness *h, struct rng *rng, struct view_args view, enum picture_kind kind,
                              double density);
// The instance's slots; of the first of them the ids are others'.
void picture_slots(struct instance_args *instance, size_t slots);
// Empty pixels take over the surface of a measured one up to `reach` pixels away, with this probability.
void picture_invent(struct picture *picture, struct rng *rng, double share, int reach);
// The pyramid's level above these keys (allocated); view becomes that level's.
void picture_pull(struct harness *h, struct view_args *view, uint64_t **keys, uint32_t **from);
struct ref_planes picture_planes(const struct picture *picture);
float float_step(float value, int ulps); // value > 0

#endif
