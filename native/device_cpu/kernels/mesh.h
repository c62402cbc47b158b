// SPDX-License-Identifier: GPL-3.0-or-later
// A triangle on the screen, twin of shaders/lib/mesh.glsl: projected, cut, its corners rounded to parts of a pixel. Float32 in
// one written order up to there; what decides pixels afterwards are integers.
#ifndef PT_MESH_KERNELS_H
#define PT_MESH_KERNELS_H

#include "device_cpu/cpu.h"
#include "device_cpu/vector_math.h"
#include "shared/meshes.h"

#include <math.h>

struct pt_corner {
    float x, y, z; // pixels (perspective: times z), z
};

// A convex polygon on the screen; value: 1 / z (orthographic: z).
struct pt_outline {
    uint32_t count;
    int32_t x[PT_MESH_CORNERS], y[PT_MESH_CORNERS]; // in 1 / 2^PT_MESH_BITS pixels
    float value[PT_MESH_CORNERS];
};

// A triangle of it, anticlockwise; value = first + (a (x - left) + b (y - below)), kept within [first, greatest].
struct pt_facet {
    int32_t x[3], y[3];
    float first, greatest, a, b, left, below;
};

static inline float pt_reciprocal(float x) // twin of vf_rcp
{
    float r = pt_float(0x7EF311C7u - pt_bits(x));
    r = r * (2.0f - x * r);
    r = r * (2.0f - x * r);
    return r * (2.0f - x * r);
}

static inline float pt_mesh_row(const struct mesh_args *mesh, int row, const float p[3])
{
    const float *r = mesh->row + 3 * row;
    return (((mesh->lo[row] + r[0] * p[0]) + r[1] * p[1]) + r[2] * p[2]) + mesh->hi[row];
}

static inline int pt_drawable(const struct pt_corner *c) // NaN fails every comparison
{
    return fabsf(c->x) <= PT_MESH_FARTHEST && fabsf(c->y) <= PT_MESH_FARTHEST && fabsf(c->z) <= PT_MESH_FARTHEST;
}

// How far inside a corner lies: of the near plane, then of four planes PT_MESH_REACH pixels to each side.
static inline float pt_inside(const struct view_args *view, int plane, const struct pt_corner *c)
{
    float reach = view->perspective ? PT_MESH_REACH * c->z : PT_MESH_REACH;
    switch (plane) {
    case 0: return c->z - view->z_near;
    case 1: return reach + c->x;
    case 2: return reach - c->x;
    case 3: return reach + c->y;
    default: return reach - c->y;
    }
}

// Where an edge meets the plane; always from the corner inside, so that two triangles find the same place on their edge.
static inline struct pt_corner pt_meet(const struct view_args *view, int plane, const struct pt_corner *in, float d_in,
                                       const struct pt_corner *out, float d_out)
{
    float whole = d_in - d_out, t = whole >= 1e-30f ? d_in * pt_reciprocal(whole) : 0.0f;
    struct pt_corner c = {in->x + t * (out->x - in->x), in->y + t * (out->y - in->y), in->z + t * (out->z - in->z)};
    if (plane == 0)
        c.z = view->z_near;
    return c;
}

// Keeps what lies inside of a plane. Returns the number of corners.
static inline uint32_t pt_cut(const struct view_args *view, int plane, uint32_t count, struct pt_corner c[PT_MESH_CORNERS])
{
    struct pt_corner kept[2 * PT_MESH_CORNERS]; // where rounding bends the outline it may meet the plane more than twice
    uint32_t n = 0;
    for (uint32_t i = 0; i < count; i++) {
        const struct pt_corner *from = &c[i], *to = &c[i + 1 < count ? i + 1 : 0];
        float d = pt_inside(view, plane, from), e = pt_inside(view, plane, to);
        if (d >= 0.0f)
            kept[n++] = *from;
        if (d >= 0.0f && !(e >= 0.0f))
            kept[n++] = pt_meet(view, plane, from, d, to, e);
        if (!(d >= 0.0f) && e >= 0.0f)
            kept[n++] = pt_meet(view, plane, to, e, from, d);
    }
    n = n < PT_MESH_CORNERS ? n : PT_MESH_CORNERS;
    for (uint32_t i = 0; i < n; i++)
        c[i] = kept[i];
    return n;
}

static inline int32_t pt_snap(float x) { return (int32_t)floorf(x * PT_MESH_UNIT + 0.5f); }

// Where triangle `index` lies; no corners where it cannot be seen.
static inline void pt_outline_of(const struct view_args *view, const struct mesh_args *mesh, const float *vertices,
                                 const uint32_t *indices, uint32_t index, struct pt_outline *out)
{
    struct pt_corner c[PT_MESH_CORNERS];
    uint32_t count = 3;
    out->count = 0;
    for (uint32_t i = 0; i < 3; i++) {
        const float *p = vertices + (size_t)mesh->stride * indices[3 * (size_t)index + i];
        c[i] = (struct pt_corner){pt_mesh_row(mesh, 0, p), pt_mesh_row(mesh, 1, p), pt_mesh_row(mesh, 2, p)};
        if (!pt_drawable(&c[i]))
            return;
    }
    for (int plane = 0; plane < 5; plane++) {
        int whole = 1;
        for (uint32_t i = 0; i < count; i++)
            whole &= pt_inside(view, plane, &c[i]) >= 0.0f;
        if (!whole)
            count = pt_cut(view, plane, count, c);
    }
    for (uint32_t i = 0; i < count; i++) {
        float r = view->perspective ? pt_reciprocal(c[i].z) : 1.0f;
        out->x[i] = pt_snap(c[i].x * r);
        out->y[i] = pt_snap(c[i].y * r);
        out->value[i] = view->perspective ? r : c[i].z;
    }
    out->count = count;
}

// An integer as float in steps that are the same everywhere: below 2^60, not negative.
static inline float pt_wide_float(int64_t x)
{
    uint32_t high = (uint32_t)(x >> 32), low = (uint32_t)x;
    float sum = (float)(high >> 14) * 0x1p46f + (float)(high & 16383u) * 0x1p32f;
    return (sum + (float)(low >> 16) * 65536.0f) + (float)(low & 65535u);
}

// Of a position: below 2^29.
static inline float pt_position_float(int32_t x) { return (float)(x >> 12) * 4096.0f + (float)(x & 4095); }

// Triangle (0, i, i + 1) of an outline; 0 when it covers nothing.
static inline int pt_facet_of(const struct pt_outline *outline, uint32_t i, struct pt_facet *out)
{
    uint32_t k[3] = {0, i, i + 1};
    const int32_t *x = outline->x, *y = outline->y;
    const float *v = outline->value;
    int64_t area = (int64_t)(x[k[1]] - x[0]) * (y[k[2]] - y[0]) - (int64_t)(x[k[2]] - x[0]) * (y[k[1]] - y[0]);
    if (area == 0)
        return 0;
    if (area < 0) {
        k[1] = i + 1;
        k[2] = i;
        area = -area;
    }
    uint32_t least = v[k[1]] < v[k[0]] ? 1 : 0; // perspective: the farthest, where the relative error counts
    least = v[k[2]] < v[k[least]] ? 2 : least;
    for (uint32_t j = 0; j < 3; j++) {
        out->x[j] = x[k[(least + j) % 3]];
        out->y[j] = y[k[(least + j) % 3]];
    }
    float v0 = v[k[least]], v1 = v[k[(least + 1) % 3]], v2 = v[k[(least + 2) % 3]];
    float x1 = pt_position_float(out->x[1] - out->x[0]), y1 = pt_position_float(out->y[1] - out->y[0]);
    float x2 = pt_position_float(out->x[2] - out->x[0]), y2 = pt_position_float(out->y[2] - out->y[0]);
    float inverse = pt_reciprocal(pt_wide_float(area));
    out->first = v0;
    out->greatest = pt_max(v0, pt_max(v1, v2));
    out->a = ((v1 - v0) * y2 - (v2 - v0) * y1) * inverse;
    out->b = ((v2 - v0) * x1 - (v1 - v0) * x2) * inverse;
    out->left = pt_position_float(out->x[0]);
    out->below = pt_position_float(out->y[0]);
    return 1;
}

#endif
