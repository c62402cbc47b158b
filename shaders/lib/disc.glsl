// SPDX-License-Identifier: GPL-3.0-or-later
// Points as flat discs: where they lie on screen, and which pixels they cover how deep. SPEC 5, solid; twin of
// native/device_cpu/kernels/disc.h, which says what the numbers are.
//
// LARGE 0: discs of at most DISC_SMALL pixels are drawn by an invocation each, larger ones listed. LARGE 1: those listed, by a
// workgroup or more each. No invocation takes more than 30,000 steps through its loops: llvmpipe ends them at 65,535, and what
// would have followed was not drawn.
#ifndef PT_DISC_GLSL
#define PT_DISC_GLSL

#include "shared/discs.h"
#include "shared/words.h"
#include "lib/planes.glsl"
#include "lib/points.glsl"
#include "lib/positions.glsl"

layout(location = 0) uniform uint first_chunk; // of this dispatch
layout(location = 1) uniform uint first_slot;  // where the bound part of what points have begins
layout(location = 2) uniform uint instance;    // whose points these are

layout(std430, binding = BIND_chunks) readonly buffer chunks_block { chunk_view chunks[]; };
layout(std430, binding = BIND_surfels) readonly buffer surfels_block { uint surfels[]; };
layout(std430, binding = BIND_radii) readonly buffer radii_block { uint radii[]; }; // floats or shape words

#if LARGE == 0
layout(std430, binding = BIND_large) buffer large_block { uint large_groups[3], large_count, large[]; }; // chunk and slot of each
#else
layout(std430, binding = BIND_large) readonly buffer large_block { uint large_groups[3], large_count, large[]; };
layout(location = 5) uniform uint parts; // workgroups that share a disc
#endif

#define DISC_SMALL 256u

struct disc {
    float x, y, z, radius;
    uint shape;
    float ratio;
    vec2 reach; // of the ball around, pixels
    float gx, gy, e, h, m;
    bool gentle;
    float widest;
    ivec4 box; // x0, y0, x1, y1, both ends included
    ivec2 own;
    vec3 n;
    uint id; // in its cloud
};

float pt_clamp_far(float x) { return pt_min(pt_max(x, -PT_DISC_FAR), PT_DISC_FAR); }

const float pt_shape_cosines[64] = float[64](PT_SHAPE_COSINES);
const float pt_shape_sines[64] = float[64](PT_SHAPE_SINES);
const float pt_shape_ratios[32] = float[32](PT_SHAPE_RATIOS);

// Whether discs have the half axes of their points' shapes.
bool disc_shaped() { return discs[instance].has_radii == PT_RADII_SHAPES && !(discs[instance].radius > 0.0); }

// Radius and ratio. Below PT_DISC_LEAST: none.
void disc_size(uint slot, uint word, inout disc d)
{
    precise float radius = discs[instance].radius;
    d.shape = 0u;
    d.ratio = 1.0;
    if (disc_shaped()) {
        d.shape = radii[slot];
        radius = discs[instance].instance.spacing[d.shape & PT_SHAPE_CLASS_BITS];
        if (PT_SHAPE_KIND(d.shape) == PT_KIND_SURFACE)
            radius = radius * discs[instance].surface_scale;
        d.ratio = pt_shape_ratios[(d.shape >> PT_SHAPE_RATIO_SHIFT) & 15u];
    } else if (!(radius > 0.0) && discs[instance].has_radii != 0u) {
        precise float scaled = pt_float(radii[slot]) * discs[instance].radius_scale;
        radius = pt_min(scaled, PT_DISC_MOST);
    } else if (!(radius > 0.0)) {
        radius = discs[instance].instance.spacing[word >> PT_SPACING_SHIFT] * PT_DISC_SPACINGS;
    }
    float most = discs[instance].radius_most;
    if (most > 0.0 && most < radius) {
        precise float ratio = d.ratio * (most * pt_rcp(radius));
        d.ratio = pt_max(ratio, 1.0);
        radius = most;
    }
    d.radius = PT_DISC_LEAST <= radius ? radius : 0.0;
}

// Balls wider than a 32nd of their depth: where exactly they are seen.
void disc_near(view_args view, disc d, inout vec2 low, inout vec2 high)
{
    precise float k = (d.radius * 1.001) * pt_rcp(d.z);
    precise float left = 1.0 - k * k;
    bool before = 0.015625 <= left;
    float inverse = pt_rcp(before ? left : 1.0);
    for (int i = 0; i < 2; i++) {
        float at = i == 0 ? d.x : d.y, start = i == 0 ? view.ray_x0 : view.ray_y0, size = i == 0 ? view.ray_xs : view.ray_ys;
        precise float slope = start + size * at;
        float u = pt_abs(slope);
        precise float square = u * u + 1.0;
        precise float room = square - k * k;
        precise float least = square * 0.0009765625;
        bool outside = least <= room;
        float safe = outside ? room : 1.0;
        precise float root = safe * pt_rsqrt(safe);
        precise float pixels = 1.001 * pt_rcp(size);
        precise float over = u + k * root;
        precise float towards = ((k * (u * root + k)) * pt_rcp(over)) * pixels;
        precise float beyond = ((k * (root + u * k)) * inverse) * pixels;
        float inner = outside ? towards : PT_DISC_FAR, outer = outside && before ? beyond : PT_DISC_FAR;
        bool right = 0.0 <= slope;
        precise float first = at - (right ? inner : outer), last = at + (right ? outer : inner);
        low[i] = pt_max(first, low[i]);
        high[i] = pt_min(last, high[i]);
    }
}

// 2. box; false: outside the window.
bool disc_window(view_args view, vec2 low, vec2 high, inout disc d)
{
    bool drawn = true;
    for (int k = 0; k < 2; k++) {
        float at = k == 0 ? d.x : d.y;
        int origin = k == 0 ? view.origin_x : view.origin_y;
        float lower = float(origin), upper = float(origin + int(k == 0 ? view.width : view.height) - 1);
        precise float begin = low[k] + 0.5, end = high[k] - 0.5;
        float own = floor(at), first = floor(pt_clamp_far(begin)), last = floor(pt_clamp_far(end));
        first = pt_max(pt_min(first, own), lower);
        last = pt_min(pt_max(last, own), upper);
        drawn = drawn && first <= last;
        d.box[k] = int(first) - origin;
        d.box[2 + k] = int(last) - origin;
        d.own[k] = int(own) - origin;
    }
    return drawn;
}

// of the ball around the disc
bool disc_box(view_args view, inout disc d, out vec2 low, out vec2 high)
{
    float before = 1.0;
    bool around = false;
    precise float part = d.z * 0.03125;
    d.widest = 1.0;
    if (view.perspective != 0u) {
        precise float nearest = d.z - d.radius;
        around = !(part < nearest);
        before = pt_rcp(around ? 1.0 : nearest);
        precise float widest = (d.z * before) * 1.05;
        d.widest = around ? PT_DISC_FAR : widest;
    }
    for (int k = 0; k < 2; k++) {
        float at = k == 0 ? d.x : d.y, start = k == 0 ? view.ray_x0 : view.ray_y0, size = k == 0 ? view.ray_xs : view.ray_ys;
        precise float reach = d.radius;
        if (view.perspective != 0u) {
            precise float slope = start + size * at;
            precise float square = slope * slope + 1.0;
            reach = (reach * (square * pt_rsqrt(square))) * before;
        }
        precise float pixels = 1.001 * pt_rcp(size);
        reach = reach * pixels;
        reach = around ? PT_DISC_FAR : reach;
        d.reach[k] = reach;
        precise float begin = at - reach, end = at + reach;
        low[k] = begin;
        high[k] = end;
    }
    if (view.perspective != 0u && part < d.radius)
        disc_near(view, d, low, high);
    return disc_window(view, low, high, d);
}

// 4. The ellipse's own box, which is smaller. It leaves out no pixel that is covered.
bool disc_tight_box(view_args view, vec2 low, vec2 high, inout disc d)
{
    if (!(PT_DISC_LEAST <= d.e && PT_DISC_LEAST <= d.m))
        return true;
    float most = 1.0;
    if (view.perspective != 0u)
        most = pt_min((1.0 + pt_abs(d.gx) * (d.reach.x + 1.0)) + pt_abs(d.gy) * (d.reach.y + 1.0), d.widest);
    float up = pt_rsqrt(d.m), beside = d.h * up, square = pt_max(beside * beside + pt_rcp(d.e), 1e-12);
    vec2 reach = vec2(square * pt_rsqrt(square), up) * (most * 1.001) + 0.02;
    return disc_window(view, max(vec2(d.x, d.y) - reach, low), min(vec2(d.x, d.y) + reach, high), d);
}

// The half axes of shapes in view space, see device_cpu/kernels/disc.h. normal: in the object, not yet unit.
void disc_axes(disc d, vec3 normal, out vec3 along_axis, out vec3 across_axis)
{
    precise vec3 n = normal * pt_rsqrt(pt_dot(normal, normal));
    bool up = PT_SHAPE_UP <= n.z;
    precise float over = 1.0 + pt_abs(n.z);
    precise float a = pt_rcp(over);
    precise float b = (n.x * n.y) * a;
    precise float c = 1.0 - (n.y * n.y) * a;
    precise float c1 = 1.0 - (n.x * n.x) * a;
    vec3 t1 = vec3(c1, pt_negate(b), up ? pt_negate(n.x) : n.x);
    vec3 t2 = vec3(up ? pt_negate(b) : b, up ? c : pt_negate(c), pt_negate(n.y));
    uint angle = (d.shape >> PT_SHAPE_ANGLE_SHIFT) & 63u;
    float cosine = pt_shape_cosines[angle], sine = pt_shape_sines[angle];
    float long_scale = discs[instance].instance.axis_scale;
    precise float short_scale = d.ratio * long_scale;
    precise vec3 along = cosine * t1 + sine * t2;
    precise vec3 across = cosine * t2 - sine * t1;
    for (int k = 0; k < 3; k++) {
        vec3 row = vec3(discs[instance].instance.normal_matrix[3 * k], discs[instance].instance.normal_matrix[3 * k + 1],
                        discs[instance].instance.normal_matrix[3 * k + 2]);
        precise float first = pt_dot(row, along) * long_scale, second = pt_dot(row, across) * short_scale;
        along_axis[k] = first;
        across_axis[k] = second;
    }
}

// 3. plane and ellipse
void disc_shape(view_args view, uint word, inout disc d)
{
    float xs = view.ray_xs, ys = view.ray_ys;
    precise float u = 0.0, v = 0.0;
    vec3 n = vec3(0.0, 0.0, 1.0), object;
    bool none = true;
    if (view.perspective != 0u) {
        u = view.ray_x0 + xs * d.x;
        v = view.ray_y0 + ys * d.y;
    }
    if (discs[instance].instance.has_normals != 0u && (word & PT_NORMAL_BITS) != PT_NORMAL_NONE) {
        object = pt_decode_normal(word);
        precise vec3 own;
        for (int k = 0; k < 3; k++) {
            precise float sum = (discs[instance].instance.normal_matrix[3 * k] * object.x +
                                 discs[instance].instance.normal_matrix[3 * k + 1] * object.y) +
                                discs[instance].instance.normal_matrix[3 * k + 2] * object.z;
            own[k] = sum;
        }
        float square = pt_dot(own, own);
        none = !(1e-30 <= square);
        precise vec3 unit = own * pt_rsqrt(square);
        n = none ? n : unit;
    }
    precise float facing = (n.x * u + n.y * v) - n.z;
    float size = pt_abs(facing);
    bool flat_disc = PT_DISC_LEAST <= d.radius && PT_DISC_TILT <= size;
    float inverse = pt_rcp(flat_disc ? size : 1.0);
    if (0.0 < facing)
        n = vec3(pt_negate(n.x), pt_negate(n.y), pt_negate(n.z));
    precise float gx = (n.x * xs) * inverse, gy = (n.y * ys) * inverse;
    d.n = none ? vec3(0.0) : n;
    precise float fine = pt_rcp(flat_disc ? d.radius : 1.0);
    if (view.perspective != 0u) {
        gx = pt_negate(gx);
        gy = pt_negate(gy);
        fine = d.z * fine;
    }
    flat_disc = flat_disc && fine <= PT_DISC_FINE;
    float sign_of = view.perspective != 0u ? 1.0 : -1.0;
    precise vec3 a = vec3((xs - gx * u) * fine, (gx * v) * fine, (sign_of * gx) * fine);
    precise vec3 b = vec3((gy * u) * fine, (ys - gy * v) * fine, (sign_of * gy) * fine);
    precise float e = (a.x * a.x + a.y * a.y) + a.z * a.z;
    precise float f = (a.z * b.z - a.x * b.x) - a.y * b.y;
    precise float area = ((xs * fine) * (ys * fine)) * inverse;
    if (!none && disc_shaped()) {
        vec3 along, across;
        disc_axes(d, object, along, across);
        precise vec2 p = vec2((a.x * along.x - a.y * along.y) + a.z * along.z, (a.x * across.x - a.y * across.y) + a.z * across.z);
        precise vec2 q = vec2((b.y * along.y - b.x * along.x) + b.z * along.z, (b.y * across.y - b.x * across.x) + b.z * across.z);
        precise float turn = (n.x * (along.y * across.z - along.z * across.y) + n.y * (along.z * across.x - along.x * across.z)) +
                             n.z * (along.x * across.y - along.y * across.x);
        e = p.x * p.x + p.y * p.y;
        f = p.x * q.x + p.y * q.y;
        area = area * pt_abs(turn);
    }
    float part = pt_rcp(pt_max(e, PT_DISC_LEAST));
    precise float h = f * part, m = area * (area * part);
    d.gx = flat_disc ? gx : 0.0;
    d.gy = flat_disc ? gy : 0.0;
    d.e = flat_disc ? e : 1e20;
    d.h = flat_disc ? h : 0.0;
    d.m = flat_disc ? m : 1e20;
    precise float steep = pt_abs(d.gx) * (d.reach.x + 1.0) + pt_abs(d.gy) * (d.reach.y + 1.0);
    d.gentle = steep <= PT_DISC_GENTLE;
}

// 1. The disc of a chunk's point; false: it is not drawn.
bool disc_of(view_args view, chunk_view chunk, uint slot, out disc d)
{
    uint base = chunk.first - first_slot;
    if (chunk.sifted != 0u &&
        (read_word(chunk.sifted - 1u + slot / PT_SLOTS_A_WORD) >> slot % PT_SLOTS_A_WORD & 1u) == 0u)
        return false;
    vec3 p = pt_position(base, chunk.padded, chunk.step, slot);
    vec3 seen = pt_project(view, chunk, p);
    float x = seen.x, y = seen.y, z = seen.z;
    // NaN fails every comparison
    if (!(view.z_near <= z && z <= view.z_far && pt_abs(x) < PT_DISC_FAR && pt_abs(y) < PT_DISC_FAR))
        return false;
    d.x = x;
    d.y = y;
    d.z = z;
    d.id = chunk.first + slot;
    uint word = surfels[base + slot];
    if (chunk.cull != 0u && pt_faces_away(chunk, word, p))
        return false;
    disc_size(base + slot, word, d);
    vec2 low, high;
    if (!disc_box(view, d, low, high))
        return false;
    disc_shape(view, word, d);
    return disc_tight_box(view, low, high, d);
}

#if LARGE == 0

// Lists a disc whose part in a box (empty where it ends before it begins) is too large; true: it is done with.
bool disc_listed(ivec4 box, uint chunk, uint slot)
{
    if (box.x > box.z || box.y > box.w)
        return true;
    if (uint(box.z - box.x + 1) * uint(box.w - box.y + 1) <= DISC_SMALL)
        return false;
    uint at = 2u * atomicAdd(large_count, 1u);
    if (at < uint(large.length())) {
        large[at] = chunk;
        large[at + 1u] = slot;
    }
    return true;
}

#else

// The disc that this workgroup takes part in: its place in the list, and which part. False: none.
bool disc_large(out uint at, out uint part)
{
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    at = group / parts;
    part = group - at * parts;
    return at < large_count;
}

#endif

// Does the disc cover the pixel? square: distance over radius squared; beside: covered by the point alone.
bool disc_pixel(view_args view, disc d, int x, int y, out float depth, out float square, out bool beside)
{
    precise float dx = (float(view.origin_x + x) + 0.5) - d.x, dy = (float(view.origin_y + y) + 0.5) - d.y;
    precise float slope = d.gx * dx + d.gy * dy;
    precise float w = dx + d.h * dy;
    precise float ellipse = (d.e * w) * w + (d.m * dy) * dy, z = d.z + slope;
    bool covered = true;
    if (view.perspective != 0u) {
        precise float q = 1.0 + slope, inverse = (1.0 - slope) * (1.0 + slope * slope);
        covered = d.gentle || PT_DISC_LEAST <= q;
        if (!d.gentle)
            inverse = pt_rcp(q);
        z = d.z * inverse;
        if (!d.gentle) {
            precise float deep = d.radius * 1.001, off = z - d.z;
            covered = covered && pt_abs(off) <= deep;
        }
        ellipse = ellipse * (inverse * inverse);
    }
    covered = covered && ellipse <= 1.0;
    bool own = ivec2(x, y) == d.own;
    beside = own && !covered;
    depth = beside ? d.z : z;
    square = ellipse;
    return (covered || own) && view.z_near <= depth && depth <= view.z_far;
}

// exp(-2 square) within 2.4e-4; in its own pixel the disc is a pixel wide at least.
float disc_weight(view_args view, disc d, int x, int y, float square, bool beside)
{
    if (ivec2(x, y) == d.own) {
        precise float dx = (float(view.origin_x + x) + 0.5) - d.x, dy = (float(view.origin_y + y) + 0.5) - d.y;
        precise float pixel = (dx * dx + dy * dy) * 2.0;
        square = beside ? pixel : pt_min(pixel, square);
    }
    precise float two = square * square;
    precise float high = 0.25565624 * two + (1.90144324 - 1.03321445 * square);
    precise float w = high * two + (0.99976468 - 1.98814547 * square);
    return w;
}

#endif
