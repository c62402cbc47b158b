// SPDX-License-Identifier: GPL-3.0-or-later
// differ: points of an image buffer's cells -> between which depths the means of single scans lie; twin of
// native/device_cpu/kernels/differ.c
#version 430 core
#include "shared/ranges.h"
#include "shared/words.h"
#include "lib/math.glsl"

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { differ_args args; };
layout(std430, binding = BIND_scans) readonly buffer scans_block { uint scans[]; }; // two a word
layout(std430, binding = BIND_least) buffer least_block { float least_of[]; };
layout(std430, binding = BIND_most) buffer most_block { float most_of[]; };

#include "lib/cells.glsl"

// Of a cell, for each of PT_DIFFER_SCANS scans: points, and how far they lie off the cell's plane.
#if STEP == 0

// How far a point lies off the plane through the middle of its cell, at the depth of its nearest point.
float off_plane(view_args view, pt_cell_point point, vec3 n)
{
    float column = floor(point.x), row = floor(point.y);
    precise float across = view.ray_xs * ((point.x - column) - 0.5), up = view.ray_ys * ((point.y - row) - 0.5);
    if (view.perspective != 0u) {
        precise float u = view.ray_x0 + view.ray_xs * (column + 0.5), v = view.ray_y0 + view.ray_ys * (row + 0.5);
        across = u * point.behind + across * point.z;
        up = v * point.behind + up * point.z;
    }
    precise float off = (n.x * across + n.y * up) - n.z * point.behind;
    return off;
}

void main()
{
    chunk_view chunk = chunks[first_chunk + gl_WorkGroupID.x];
    uint stride = gl_WorkGroupSize.x * gl_NumWorkGroups.y;
    pt_cell_point point;

    for (uint i = gl_WorkGroupID.y * gl_WorkGroupSize.x + gl_LocalInvocationID.x; i < chunk.count; i += stride) {
        if (!pt_point_of(chunk, i, point))
            continue;
        uint scan = (scans[point.slot >> 1] >> (16u * (point.slot & 1u)) & (PT_DIFFER_MOST - 1u)) - args.first;
        if (scan >= PT_DIFFER_SCANS)
            continue;
        float off = off_plane(args.view, point, read_float4(point.cell).xyz);
        precise float share = off * pt_rcp(reach_of(args.view, point.gamma, point.nearest));
        precise float term = pt_max(pt_min(share, 1.0), -1.0) * PT_SUM_SCALE;
        add(point.at + 4u * scan, 1.0);
        add(point.at + 4u * scan + 2u, term);
    }
}

#else

void main()
{
    view_args view = args.view;
    uint x = view.rect[0] + gl_GlobalInvocationID.x;
    int y = int(gl_GlobalInvocationID.y) + band_first;
    if (x >= view.rect[2] || y >= band_end)
        return;
    uint cell = uint(y) * view.width + x, at = 2u * SUMS * (cell - uint(band_first) * view.width);
    uint bits = read_z_bits(cell);
    float nearest = bits < PT_KEY_EMPTY_Z ? pt_float(bits) : 1.0;
    precise float unit = reach_of(view, gamma_of(view, nearest), nearest) * (1.0 / PT_SUM_SCALE);
    float least = PT_RANGE_MOST, most = -PT_RANGE_MOST;
    if (args.start == 0u) {
        least = least_of[cell];
        most = most_of[cell];
    }
    for (uint k = 0u; k < PT_DIFFER_SCANS; k++) {
        float n = sum_of(at + 4u * k);
        if (!(1.0 <= n))
            continue;
        precise float mean = (sum_of(at + 4u * k + 2u) * pt_rcp(n)) * unit;
        least = pt_min(mean, least);
        most = pt_max(mean, most);
    }
    least_of[cell] = least;
    most_of[cell] = most;
}

#endif
