// SPDX-License-Identifier: GPL-3.0-or-later
// A point of a chunk as a view sees it; twin of native/device_cpu/points.h
#ifndef PT_POINTS_GLSL
#define PT_POINTS_GLSL

#include "lib/math.glsl"
#include "shared/words.h"

// Where the view sees it: x and y in pixels, and its depth.
vec3 pt_project(view_args view, chunk_view chunk, vec3 p)
{
    precise float z = (((chunk.lo[2] + chunk.row[6] * p.x) + chunk.row[7] * p.y) + chunk.row[8] * p.z) + chunk.hi[2];
    precise float x = (((chunk.lo[0] + chunk.row[0] * p.x) + chunk.row[1] * p.y) + chunk.row[2] * p.z) + chunk.hi[0];
    precise float y = (((chunk.lo[1] + chunk.row[3] * p.x) + chunk.row[4] * p.y) + chunk.row[5] * p.z) + chunk.hi[1];
    if (view.perspective != 0u) {
        float r = pt_rcp(z);
        x = x * r;
        y = y * r;
    }
    return vec3(x, y, z);
}

bool pt_faces_away(chunk_view chunk, uint word, vec3 p)
{
    if ((word & PT_NORMAL_BITS) == PT_NORMAL_NONE)
        return false;
    precise vec3 v = vec3(chunk.eye[0], chunk.eye[1], chunk.eye[2]) - chunk.eye[3] * p;
    return pt_dot(pt_decode_normal(word), v) <= 0.0;
}

#endif
