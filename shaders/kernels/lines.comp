// SPDX-License-Identifier: GPL-3.0-or-later
// lines: what enlarged discs leave uncovered. [X 3], SPEC 7: see struct lines_args; twin of native/device_cpu/kernels/lines.c
//
// STEP 0: steps, and their pixels' own share of a line; STEP 1: discs; STEP 2: lines. There a workgroup takes a tile, and searches it where a disc
// within reach lies before the tile's farthest pixel.
#version 430 core
#include "shared/lines.h"
#include "lib/math.glsl"
#include "lib/planes.glsl"

layout(local_size_x = 16, local_size_y = 16) in;

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { lines_args args; };
layout(std430, binding = BIND_line) buffer line_block { float line[]; };
layout(std430, binding = BIND_nearest) writeonly buffer nearest_block { uint nearest[]; };
layout(std430, binding = BIND_limit) readonly buffer limit_block { float limit[]; };
layout(std430, binding = BIND_through) readonly buffer through_block { float through[]; };
layout(std430, binding = BIND_steps) buffer steps_block { float steps[]; };  // v of pixels with a step beside them, +inf: none
layout(std430, binding = BIND_discs) buffer discs_block { float discs[]; }; // of them those with company

#define NOTHING pt_float(PT_KEY_EMPTY_Z)

bool inside(ivec2 p)
{
    return p.x >= int(args.view.rect[0]) && p.y >= int(args.view.rect[1]) && p.x < int(args.view.rect[2]) &&
           p.y < int(args.view.rect[3]);
}

// +inf: empty, 0: may take no line
float receiving_z(ivec2 p)
{
    if (!inside(p))
        return 0.0;
    uint at = uint(p.y) * args.view.width + uint(p.x);
    float z = read_z(at);
    if (args.behind == 0u || (z < NOTHING && limit[at] < z))
        return z;
    return through[at] < 1.0 && PT_SPENT <= through[at] ? NOTHING : 0.0;
}

// The tangent plane of a pixel's surface: how much it faces the ray, and how it falls away from pixel to pixel.
struct tangent {
    float facing;
    vec2 slope;
    float floor_z; // behind a layer: surfaces that are nearer touch it
};

tangent tangent_at(ivec2 p, bool some)
{
    view_args view = args.view;
    uint at = uint(p.y) * view.width + uint(p.x);
    float floor_z = args.behind != 0u && inside(p) ? limit[at] : 0.0;
    if (!some)
        return tangent(1.0, vec2(0.0), floor_z);
    vec3 n = read_float4(read_from(at)).xyz;
    vec2 ray = pt_ray(view, p.x, p.y);
    precise float leaning = n.z - (n.x * ray.x + n.y * ray.y);
    float facing = view.perspective != 0u ? leaning : n.z;
    precise vec2 slope = vec2(n.x * view.ray_xs, n.y * view.ray_ys);
    bool away = facing < 0.0;
    return tangent(away ? pt_negate(facing) : facing,
                   away ? vec2(pt_negate(slope.x), pt_negate(slope.y)) : slope, floor_z);
}

// Whether a disc at v of a pixel at own_z, d pixels away, shows before a pixel at z.
bool shows(tangent t, float z, float v, float own_z, ivec2 d)
{
    precise float slope = t.slope.x * float(d.x) + t.slope.y * float(d.y);
    precise float perspective_disc = v * (t.facing - slope), plane = z * t.facing;
    precise float disc_z = v * t.facing, sloped = plane + slope;
    bool before = args.view.perspective != 0u ? perspective_disc < plane : disc_z < sloped;
    precise float touching = (own_z + own_z) - v;
    return v < z && before && (args.behind == 0u || t.floor_z < touching);
}

float radius_at(ivec2 p)
{
    if (args.world == 0u)
        return args.most;
    precise float radius = args.width * pt_rcp(pt_footprint(args.view, read_z(uint(p.y) * args.view.width + uint(p.x))));
    return pt_min(radius, args.most);
}

#if STEP == 0

float offset_of(uint source)
{
    precise float given = args.offset * read_float4(source).w;
    return args.offset > 0.0 ? given : read_deff(source);
}

// How many of the 8 pixels around p lie beyond v.
uint count_beyond(ivec2 p, float v)
{
    uint count = 0u;
    for (int dy = -1; dy <= 1; dy++)
        for (int dx = -1; dx <= 1; dx++)
            count += (dx != 0 || dy != 0) && v < receiving_z(p + ivec2(dx, dy)) ? 1u : 0u;
    return count;
}

bool is_edge(ivec2 p, ivec2 d, float z, float v)
{
    float far = receiving_z(p + d);
    if (!(v < far) || count_beyond(p + d, v) < PT_LINE_SUPPORT)
        return false;
    return shows(tangent_at(p + d, far < NOTHING), far, v, z, -d);
}

void main()
{
    const ivec2 cross_offsets[4] = ivec2[4](ivec2(1, 0), ivec2(0, 1), ivec2(-1, 0), ivec2(0, -1));
    ivec2 p = ivec2(args.view.rect[0], args.view.rect[1]) + ivec2(gl_GlobalInvocationID.xy);
    if (!inside(p))
        return;
    uint at = uint(p.y) * args.view.width + uint(p.x);
    float z = receiving_z(p), count = 0.0;
    precise float v = NOTHING;
    if (z > 0.0 && z < NOTHING)
        v = z + offset_of(read_from(at));
    for (int i = 0; i < 4 && v < NOTHING; i++)
        count += is_edge(p, cross_offsets[i], z, v) ? 1.0 : 0.0;
    precise float coverage = pt_max(0.833333313465 - count * 0.333333343267, 0.166666671634); // 5/6, 1/3, 1/6
    precise float rest = 1.0 - coverage;
    steps[at] = count > 0.0 ? v : NOTHING;
    line[at] = count > 0.0 && args.antialias != 0u ? pt_min(rest, radius_at(p)) : 0.0;
}

#elif STEP == 1

void main()
{
    ivec2 p = ivec2(args.view.rect[0], args.view.rect[1]) + ivec2(gl_GlobalInvocationID.xy);
    if (!inside(p))
        return;
    uint at = uint(p.y) * args.view.width + uint(p.x), count = 0u;
    for (int dy = -1; dy <= 1; dy++)
        for (int dx = -1; dx <= 1; dx++) {
            ivec2 q = p + ivec2(dx, dy); // itself, too
            count += inside(q) && steps[uint(q.y) * args.view.width + uint(q.x)] < NOTHING ? 1u : 0u;
        }
    bool kept = steps[at] < NOTHING && count > PT_LINE_SUPPORT;
    discs[at] = kept ? steps[at] : NOTHING;
    line[at] = kept ? line[at] : 0.0;
}

#else

shared uint least; // bits of a float >= 0 order as the float does
shared uint most;

float disc(ivec2 p) { return inside(p) ? discs[uint(p.y) * args.view.width + uint(p.x)] : NOTHING; }

// x: how far the edge of the disc taken lies beyond, y: its radius.
vec2 search(ivec2 p, float z, out uint from)
{
    tangent t = tangent_at(p, z < NOTHING);
    precise float beyond = 0.0;
    float taken = args.most;
    from = 0u;
    for (uint i = 0u; i < args.tap_count; i++) {
        uint tap = args.taps[i];
        ivec2 d = ivec2(int(tap & 255u) - 128, int((tap >> 8) & 255u) - 128);
        float square = float(tap >> 16);
        precise float apart = square * pt_rsqrt(square);
        precise float could = (args.most + 0.5) - apart;
        if (!(beyond < could))
            break;
        if (!shows(t, z, disc(p + d), receiving_z(p + d), d))
            continue;
        float radius = radius_at(p + d);
        precise float here = (radius + 0.5) - apart;
        if (!(beyond < here))
            continue;
        beyond = here;
        taken = radius;
        from = uint(p.y + d.y) * args.view.width + uint(p.x + d.x);
    }
    return vec2(beyond, taken);
}

float share_of(vec2 found)
{
    precise float fade = args.soft * (found.y + 0.5);
    precise float whole = found.x + (1.0 - PT_LINE_WITHIN);
    float beyond = args.antialias != 0u ? found.x : PT_LINE_WITHIN <= found.x ? whole : 0.0;
    precise float share = beyond * pt_rcp(pt_max(1.0, fade));
    return pt_min(share, 1.0);
}

// Least disc within reach of the tile, and its farthest pixel.
void survey(ivec2 corner, ivec2 p)
{
    if (gl_LocalInvocationIndex == 0u) {
        least = PT_KEY_EMPTY_Z;
        most = 0u;
    }
    barrier();
    int reach = int(args.reach), side = 16 + 2 * reach;
    uint found = PT_KEY_EMPTY_Z;
    for (int y = int(gl_LocalInvocationID.y); y < side; y += 16)
        for (int x = int(gl_LocalInvocationID.x); x < side; x += 16)
            found = min(found, pt_bits(disc(corner + ivec2(x, y) - reach)));
    atomicMin(least, found);
    atomicMax(most, pt_bits(receiving_z(p)));
    barrier();
}

void main()
{
    ivec2 corner = ivec2(args.view.rect[0], args.view.rect[1]) + ivec2(gl_WorkGroupID.xy) * 16;
    ivec2 p = corner + ivec2(gl_LocalInvocationID.xy);
    survey(corner, p);
    if (!inside(p))
        return;
    uint at = uint(p.y) * args.view.width + uint(p.x), from = at;
    float own = line[at], share = 0.0;
    if (least < most)
        share = share_of(search(p, receiving_z(p), from));
    if (share < own)
        from = at;
    share = pt_max(share, own);
    line[at] = share;
    if (share > 0.0)
        nearest[at] = from;
}

#endif
