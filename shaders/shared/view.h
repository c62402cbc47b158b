// SPDX-License-Identifier: GPL-3.0-or-later
// What kernels of all stages know: the view, chunks and instances; distances that SPEC 1 defines. Read by C and by GLSL, as all
// headers here (std430: every member is 4 bytes wide, so both layouts agree). The arguments of a kernel, and the constants that
// decide its pixels, are in the header of its stage, which includes this one.
#ifndef PT_SHARED_VIEW_H
#define PT_SHARED_VIEW_H

#ifdef GL_core_profile
#define uint32_t uint
#define int32_t int
#define pt_vec3 vec3
#define pt_vec4 vec4
#else
#include <stdint.h>
// Of uniform blocks (std140): each lies at a multiple of 16 bytes, and behind three floats comes one word more.
typedef float pt_vec3[3], pt_vec4[4];
#endif

// Effective layer distance (SPEC 1): d_eff = max(d_min, K spacing, footprint, 4 ulp(z)) / max(|n.v|, C).
#define PT_SPACING_FACTOR 2.0f // K: a hole's rim lies up to two spacings from a neighbour that is on the same layer
#define PT_DENSE 2.4f // K times 1.2 pixels: see push
// Where sigma is known, max(PT_SIGMAS sigma, PT_SPACING_SURE spacing) stands in place of K spacing, as far as it is less, and
// PT_FOOTPRINT_SURE footprint for the footprint. Spheres 1.5 spacings apart show through in 1.4% of pixels at 1 to 1.5 points a
// pixel, with whole footprints in 5 to 7.5%.
#define PT_SIGMAS 4.0f
#define PT_SPACING_SURE 0.7f
#define PT_FOOTPRINT_SURE 0.7f
#define PT_COSINE_FLOOR 0.05f  // C: 87 degrees; beyond it a surface is narrower than a pixel's jitter

#define PT_KEY_EMPTY_Z 0x7F800000u // float bits of +inf
#define PT_KEY_EMPTY_ID 0xFFFFFFFFu
#define PT_FROM_MIXED 0x80000000u // top bit of the from plane: anti-aliasing mixed this pixel's colour
// Peeling: a pixel is finished when less light than this comes through it (half a step of 8 bits).
#define PT_SPENT 0.001953125f // 1 / 512

#define PT_COLOR_OF_SCALAR 4u // color_format: a float a point, for a ramp
#define PT_COLOR_OF_PLANE 3u  // color_format: the colours buffer is a plane, four floats a pixel, opacity last
#define PT_COLOR_OF_PIXEL 5u  // the same, of the pixel itself, not of the one that its surface was measured at

#define PT_SLOTS_A_WORD 16u // of the drawn words: chunks begin at multiples of it
#define PT_SPACINGS 64

// A window of pixels of the full picture, at a level of the pyramid (a pixel of level l is 2^l wide).
// Ray of the pixel (x, y): u = ray_x0 + ray_xs * X with X = (((origin_x >> level) + x) + 0.5) * 2^level, v likewise.
// Perspective: view-space point = z * (u, v, -1). Orthographic: (u, v, -z - near).
struct view_args {
    uint32_t width, height;     // of the planes at this level
    int32_t origin_x, origin_y; // pixel (0,0) of level 0 in the full picture; multiples of 2^levels
    uint32_t perspective;
    uint32_t level;
    float z_near, z_far; // least and greatest z drawn; z_near > 0 in perspective, 0 in orthographic views
    float ray_x0, ray_xs, ray_y0, ray_ys;
    float footprint; // width of a level-0 pixel: at z = 1 (perspective) or anywhere (orthographic), view units
    uint32_t rect[4]; // x0, y0, x1, y1: the kernel need not look outside; in pixels of this level
};

// A chunk as this view sees it: (X, Y, z) = (lo + R p) + hi in this order, R and hi + lo from float64.
// Perspective: screen = (X, Y) * rcp(z), orthographic: screen = (X, Y), both in pixels of the full picture.
struct chunk_view {
    float row[9];   // x row, y row, z row
    float hi[3], lo[3];
    float eye[4];   // back-face test: n . (eye.xyz - eye.w p) <= 0 is culled; object units, relative to the chunk's origin
    uint32_t first; // first slot, and number of its point. Positions at 3 first: x[padded], y[padded], z[padded]; packed: at 2 first
    uint32_t count, padded;
    uint32_t cull;  // 1: test each point's normal
    uint32_t id_base;
    uint32_t sifted; // 1 + its first drawn word; 0: all points are drawn
    uint32_t clip_first, clip_count, clip_keeps; // sift: its clips, and how many of them, the first, are PT_CLIP_KEEP
    uint32_t row_first, row_end; // of pixels that its points may fall into; both 0: not known
    uint32_t column_first, column_end; // likewise
    float z_least;               // no point of it is seen nearer; 0: not known
    uint32_t record;             // gather: where those of its points begin
    float step;                  // of packed positions, a power of two; 0: they are floats
};

// What the per-instance kernels (normals, resolve, shade) know of an instance of a cloud.
struct instance_args {
    uint32_t id_base;            // a slot of the cloud and this, which may wrap, are its id
    uint32_t id_first, id_count; // slots that have ids: [id_first, id_first + id_count). What other ids show is of others
    uint32_t slots;              // of the cloud: words of one light's shadows
    uint32_t has_normals;
    uint32_t color_format;      // 0 style colour, 1 sRGB 8 bit x 3, 2 float x 3, 3 a plane; shade: 4 scalars, 5 a plane
    uint32_t lit;
    uint32_t shininess;
    float ambient, diffuse, specular;
    float color[3];
    float opacity;              // of the instance; times that of the point
    uint32_t has_opacities;     // 1: points have their own, a byte each
    float normal_matrix[9];     // object normal -> view space, not yet unit
    float axis_scale;           // times the matrix: a unit tangent -> view space, a length along it as a share of the stretch
    float d_min;                // world units
    float spacing[PT_SPACINGS]; // local spacing by class, world units
};

#endif
