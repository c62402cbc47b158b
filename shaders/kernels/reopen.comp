// SPDX-License-Identifier: GPL-3.0-or-later
// reopen: pixels that were closed where a station looked through; twin of native/device_cpu/kernels/reopen.c
//
// Which cell a place falls into decides pixels: every sum is written in one order, so that all devices agree.
#version 430 core
#include "shared/filling.h"
#include "lib/math.glsl"
#include "lib/planes.glsl"

layout(local_size_x = 32, local_size_y = 8) in;

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { reopen_args args; station_args stations[]; };
layout(std430, binding = BIND_keys) writeonly buffer keys_block { uvec2 keys[]; }; // id, z bits
layout(std430, binding = BIND_from) writeonly buffer from_block { uint from[]; };
layout(std430, binding = BIND_away) readonly buffer away_block { float away[]; };
layout(std430, binding = BIND_sights) readonly buffer sights_block { uint sights[]; };
layout(std430, binding = BIND_limit) writeonly buffer limit_block { float limit[]; };
layout(std430, binding = BIND_kept) buffer kept_block { uvec2 kept[]; };
layout(std430, binding = BIND_color) buffer color_block { vec4 color[]; };

// Of a place over the face, in cells.
uint cell_of(float across, float inverse, float half_edge, uint edge)
{
    precise float u = across * inverse;
    precise float bent = u * (PT_SIGHT_BEND - ((PT_SIGHT_BEND - 1.0) * u) * u);
    precise float place = (bent + 1.0) * half_edge;
    return uint(int(pt_min(pt_max(place, 0.0), float(edge - 1u))));
}

// 3. Whether the station looked through a place at q.
bool looked_through(station_args station, vec3 q)
{
    vec3 size = vec3(pt_abs(q.x), pt_abs(q.y), pt_abs(q.z));
    bool x = size.y <= size.x && size.z <= size.x, y = !x && size.z <= size.y;
    float along = x ? q.x : y ? q.y : q.z, most = pt_abs(along);
    if (!(PT_SIGHT_LEAST < most && most < PT_SIGHT_FARTHEST))
        return false;
    uint edge = station.across;
    precise float half_edge = 0.5 * float(edge);
    float inverse = pt_rcp(most);
    uint column = cell_of(x ? q.y : y ? q.z : q.x, inverse, half_edge, edge);
    uint row = cell_of(x ? q.z : y ? q.x : q.y, inverse, half_edge, edge);
    uint face = (x ? 0u : y ? 2u : 4u) + (pt_bits(along) >> 31);
    uint at = station.first + ((face * edge + row) * edge + column);
    uint value = sights[at >> 1] >> (16u * (at & 1u)) & 0xFFFFu;
    float range = pt_float((value << PT_SIGHT_SHIFT) + station.base);
    precise float square = pt_dot(q, q) * station.grow;
    precise float seen = range * range;
    return value != 0u && square < seen;
}

// 2. Whether some station did, of the place at z on the pixel's ray.
bool seen_through(uvec2 pixel, float z)
{
    vec2 ray = pt_ray(args.view, int(pixel.x), int(pixel.y));
    bool perspective = args.view.perspective != 0u;
    precise float deep = z + args.eye_z;
    vec3 way;
    for (int k = 0; k < 3; k++) {
        float across = args.rows[3 * k + 2];
        precise float beside = args.rows[3 * k] * ray.x + args.rows[3 * k + 1] * ray.y;
        precise float seen_from_one = z * (beside - across);
        precise float seen_from_afar = beside - across * deep;
        way[k] = perspective ? seen_from_one : seen_from_afar;
    }
    bool seen = false;
    for (uint s = 0u; s < args.stations && !seen; s++) {
        precise vec3 q = vec3(stations[s].eye[0] + way.x, stations[s].eye[1] + way.y, stations[s].eye[2] + way.z);
        seen = looked_through(stations[s], q);
    }
    return seen;
}

// 1.
bool closed(uvec2 pixel, uint at, uint source)
{
    if (source == at)
        return args.discs != 0u && PT_REOPEN_AWAY < away[at];
    uvec2 place = pt_pixel(source, args.view.width);
    float dx = float(int(place.x) - int(pixel.x)), dy = float(int(place.y) - int(pixel.y));
    precise float square = dx * dx + dy * dy;
    precise float beyond = PT_REOPEN_AWAY - away[args.discs != 0u ? source : 0u]; // how far off the point of a disc there fell
    precise float left = args.discs != 0u ? pt_max(beyond, 0.0) : PT_REOPEN_AWAY;
    precise float most = left * left;
    return most < square;
}

bool is_ours(uvec2 key) { return key.y != PT_KEY_EMPTY_Z && (key.x - args.id_base) - args.id_first < args.id_count; }

void take(uvec2 pixel, uint at, uint source)
{
    uvec2 key = uvec2(PT_KEY_EMPTY_ID, PT_KEY_EMPTY_Z);
    if (source != at) { // else a disc: nothing is kept beneath
        uvec2 before = kept[at];
        bool disc = args.discs != 0u && is_ours(before) && PT_REOPEN_AWAY < away[at];
        if (!disc || !seen_through(pixel, pt_float(before.y)))
            key = before;
    }
    keys[at] = key;
    from[at] = at;
}

void main()
{
    uvec2 pixel = uvec2(args.view.rect[0], args.view.rect[1]) + gl_GlobalInvocationID.xy;
    if (pixel.x >= args.view.rect[2] || pixel.y >= args.view.rect[3])
        return;
    uint at = pixel.y * args.view.width + pixel.x;
    uvec2 key = read_key(at);
    if (args.phase == PT_REOPEN_KEEP) {
        kept[at] = key;
        return;
    }
    bool ours = is_ours(key);
    uint source = ours ? read_from(at) : at;
    bool seen = ours && closed(pixel, at, source) && seen_through(pixel, pt_float(key.y));
    if (args.phase == PT_REOPEN_FIND) {
        precise float beyond = pt_float(key.y) + read_deff(source);
        if (seen || args.first != 0u)
            limit[at] = seen ? beyond : -1.0;
        if (args.last != 0u)
            keys[at] = uvec2(PT_KEY_EMPTY_ID, PT_KEY_EMPTY_Z);
    } else if (seen && args.phase == PT_REOPEN_TAKE) {
        take(pixel, at, source);
    } else if (seen) {
        float alpha = color[at].w; // premultiplied
        color[at] = vec4(alpha, 0.0, alpha, alpha);
    }
}
