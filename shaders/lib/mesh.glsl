// SPDX-License-Identifier: GPL-3.0-or-later
// A triangle on the screen, twin of native/device_cpu/kernels/mesh.h. The kernel has declared args with its view and mesh,
// vertices and indices.
#ifndef PT_MESH_GLSL
#define PT_MESH_GLSL

#include "shared/meshes.h"
#include "lib/math.glsl"

struct outline {
    uint count;
    ivec2 at[PT_MESH_CORNERS]; // in 1 / 2^PT_MESH_BITS pixels
    float value[PT_MESH_CORNERS];
};

struct facet {
    ivec2 at[3];
    float first, greatest, a, b, left, below;
};

vec3 read_vertex(uint vertex, uint offset)
{
    uint at = args.mesh.stride * vertex + offset;
    return vec3(vertices[at], vertices[at + 1u], vertices[at + 2u]);
}

float mesh_row(uint row, vec3 p)
{
    precise float at = (((args.mesh.lo[row] + args.mesh.row[3u * row] * p.x) + args.mesh.row[3u * row + 1u] * p.y) +
                        args.mesh.row[3u * row + 2u] * p.z) + args.mesh.hi[row];
    return at;
}

vec3 place_vertex(vec3 p) { return vec3(mesh_row(0u, p), mesh_row(1u, p), mesh_row(2u, p)); }

// NaN fails every comparison.
bool drawable(vec3 c)
{
    return pt_abs(c.x) <= PT_MESH_FARTHEST && pt_abs(c.y) <= PT_MESH_FARTHEST && pt_abs(c.z) <= PT_MESH_FARTHEST;
}

float inside_of(int plane, vec3 c)
{
    precise float reach = args.view.perspective != 0u ? PT_MESH_REACH * c.z : PT_MESH_REACH;
    precise float near = c.z - args.view.z_near;
    precise float side = plane == 1 ? reach + c.x : plane == 2 ? reach - c.x : plane == 3 ? reach + c.y : reach - c.y;
    return plane == 0 ? near : side;
}

// Where an edge meets the plane; always from the corner inside.
vec3 meet(int plane, vec3 from, float d_in, vec3 to, float d_out)
{
    precise float whole = d_in - d_out;
    precise float t = whole >= 1e-30 ? d_in * pt_rcp(whole) : 0.0;
    precise vec3 c = from + t * (to - from);
    if (plane == 0)
        c.z = args.view.z_near;
    return c;
}

uint cut(int plane, uint count, inout vec3 c[PT_MESH_CORNERS])
{
    vec3 kept[2 * PT_MESH_CORNERS];
    uint n = 0u;
    for (uint i = 0u; i < count; i++) {
        vec3 from = c[i], to = c[i + 1u < count ? i + 1u : 0u];
        float d = inside_of(plane, from), e = inside_of(plane, to);
        if (d >= 0.0)
            kept[n++] = from;
        if (d >= 0.0 && !(e >= 0.0))
            kept[n++] = meet(plane, from, d, to, e);
        if (!(d >= 0.0) && e >= 0.0)
            kept[n++] = meet(plane, to, e, from, d);
    }
    n = min(n, uint(PT_MESH_CORNERS));
    for (uint i = 0u; i < n; i++)
        c[i] = kept[i];
    return n;
}

int snap(float x)
{
    precise float y = x * PT_MESH_UNIT + 0.5;
    return int(floor(y));
}

// Where triangle `index` lies; no corners where it cannot be seen.
void outline_of(uint index, out outline o)
{
    vec3 c[PT_MESH_CORNERS];
    uint count = 3u;
    bool perspective = args.view.perspective != 0u;
    o.count = 0u;
    for (uint i = 0u; i < 3u; i++) {
        c[i] = place_vertex(read_vertex(indices[3u * index + i], 0u));
        if (!drawable(c[i]))
            return;
    }
    for (int plane = 0; plane < 5; plane++) {
        bool whole = true;
        for (uint i = 0u; i < count; i++)
            whole = whole && inside_of(plane, c[i]) >= 0.0;
        if (!whole)
            count = cut(plane, count, c);
    }
    for (uint i = 0u; i < count; i++) {
        float r = perspective ? pt_rcp(c[i].z) : 1.0;
        precise vec2 p = c[i].xy * r;
        o.at[i] = ivec2(snap(p.x), snap(p.y));
        o.value[i] = perspective ? r : c[i].z;
    }
    o.count = count;
}

// high and low word of an integer below 2^60, as float in steps that are the same everywhere.
float wide_float(uint high, uint low)
{
    precise float sum = float(high >> 14) * 70368744177664.0 + float(high & 16383u) * 4294967296.0;
    sum = (sum + float(low >> 16) * 65536.0) + float(low & 65535u);
    return sum;
}

float position_float(int x)
{
    precise float sum = float(x >> 12) * 4096.0 + float(x & 4095);
    return sum;
}

// The products p.x q.y and p.y q.x: 1 when the first is greater, -1 when it is less. Exact.
int compare_products(ivec2 p, ivec2 q, out uint high, out uint low)
{
    int h1, l1, h2, l2;
    imulExtended(p.x, q.y, h1, l1);
    imulExtended(p.y, q.x, h2, l2);
    if (h1 == h2 && l1 == l2)
        return 0;
    bool greater = h1 > h2 || (h1 == h2 && uint(l1) > uint(l2));
    uint ah = uint(greater ? h1 : h2), al = uint(greater ? l1 : l2), bh = uint(greater ? h2 : h1), bl = uint(greater ? l2 : l1);
    low = al - bl;
    high = ah - bh - (al < bl ? 1u : 0u);
    return greater ? 1 : -1;
}

// Triangle (0, i, i + 1) of an outline; false when it covers nothing.
bool facet_of(outline o, uint i, out facet f)
{
    uint k[3] = uint[3](0u, i, i + 1u);
    uint high = 0u, low = 0u;
    int side = compare_products(o.at[i] - o.at[0], o.at[i + 1u] - o.at[0], high, low);
    if (side == 0)
        return false;
    if (side < 0) {
        k[1] = i + 1u;
        k[2] = i;
    }
    uint least = o.value[k[1]] < o.value[k[0]] ? 1u : 0u; // perspective: the farthest, where the relative error counts
    least = o.value[k[2]] < o.value[k[least]] ? 2u : least;
    float v[3];
    for (uint j = 0u; j < 3u; j++) {
        uint corner = k[(least + j) % 3u];
        f.at[j] = o.at[corner];
        v[j] = o.value[corner];
    }
    float x1 = position_float(f.at[1].x - f.at[0].x), y1 = position_float(f.at[1].y - f.at[0].y);
    float x2 = position_float(f.at[2].x - f.at[0].x), y2 = position_float(f.at[2].y - f.at[0].y);
    float inverse = pt_rcp(wide_float(high, low));
    precise float a = ((v[1] - v[0]) * y2 - (v[2] - v[0]) * y1) * inverse;
    precise float b = ((v[2] - v[0]) * x1 - (v[1] - v[0]) * x2) * inverse;
    f.first = v[0];
    f.greatest = pt_max(v[0], pt_max(v[1], v[2]));
    f.a = a;
    f.b = b;
    f.left = position_float(f.at[0].x);
    f.below = position_float(f.at[0].y);
    return true;
}

#endif
