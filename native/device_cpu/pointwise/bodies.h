// SPDX-License-Identifier: GPL-3.0-or-later
// The bodies of pointwise kernels, shaders/pointwise/NAME.h, as C: what they are written in is the vocabulary of simd.h and the
// few words below (shaders/README.md); lib/bodies.glsl has the same words for GLSL.
// What the body of NAME becomes: void pt_NAME(const struct NAME_args *, const struct pt_here *, vf color[4]).
#ifndef PT_BODIES_H
#define PT_BODIES_H

#include "device_cpu/kernels/clip.h"
#include "device_cpu/rows.h"

#include <stdbool.h>

// PT_LANES pixels, as a body sees them. What its kernel does not list among its buffers is not there.
struct pt_here {
    vm some;                       // that are not empty
    vf z;                          // 1 where empty
    vi id;                         // of the point shown
    vi x, y;                       // in the plane, or in the crop
    vf normal[3];                  // the one shown; buffer `shading`
    vf albedo[3];                  // buffer `albedo`
    vf slope[4];                   // buffer `slopes`
    const struct clip_view *clips; // buffer `clips`
};

static inline vm vm_if(int yes) { return vm_of_bits(yes ? PT_ALL : 0); }
static inline int vm_any(vm m) { return vm_bits(m) != 0; }

#define precise
#define PT_FUNCTION static inline __attribute__((always_inline))
#define PT_STRUCT struct
#define PT_UNUSED __attribute__((unused))
#define PT_TAKES(name) PT_UNUSED const struct name##_args *pt_given, PT_UNUSED const struct pt_here *pt_at,
#define PT_GIVES pt_given, pt_at,
#define PT_BODY(name)                                                                                                          \
    PT_FUNCTION void pt_##name(PT_UNUSED const struct name##_args *pt_given, PT_UNUSED const struct pt_here *pt_at, vf color[4])
#define ARGS (*pt_given)
#define HERE (*pt_at)
#define CLIP(i) pt_at->clips[i]
#define PT_CLIP_ROW(i, k, x, y, z) pt_clip_row(&pt_at->clips[i], (int)(k), (const vf[3]){x, y, z})
#define PT_RAY(ray) vf_ray_of(&pt_given->view, pt_at->x, pt_at->y, ray)
#define PT_FOOTPRINT(z) vf_footprint(&pt_given->view, z)
#include "pointwise_bodies.h" // made of the list: all of them
#undef precise
#undef PT_STRUCT
#undef PT_FUNCTION
#undef PT_UNUSED
#undef PT_TAKES
#undef PT_GIVES
#undef PT_BODY
#undef ARGS
#undef HERE
#undef CLIP
#undef PT_CLIP_ROW
#undef PT_RAY
#undef PT_FOOTPRINT

#endif
