// SPDX-License-Identifier: GPL-3.0-or-later
// soft: the balls of soft points before each pixel, front to back [S]. SPEC 5, soft; twin of native/device_cpu/kernels/soft.c
//
// STEP 0: how many records fall on each tile. Then, for tiles in batches whose lists fit the bins, 1: their lists, in any order;
// 2: a workgroup sorts a list, by depth and record, so that the order is that of the processor; 3: a workgroup draws a tile, or
// (VEIL, of a light's view) adds up what its rays lose.
// No invocation takes more than about 50,000 steps through its loops, since llvmpipe ends them at 65,535: long lists are sorted a
// round at a time, and drawn in parts, with what pixels have come to in between; a part lists the tiles that it leaves unfinished, and the
// next has a workgroup for each of those.
#version 430 core
#include "shared/balls.h"
#include "lib/math.glsl"

#if STEP < 2
layout(local_size_x = 64) in;
#elif STEP == 2
layout(local_size_x = 256) in;
#else
layout(local_size_x = 16, local_size_y = 16) in; // PT_SOFT_TILE
#endif

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { soft_args args; };
layout(std430, binding = BIND_keys) readonly buffer keys_block { uvec2 keys[]; };
layout(std430, binding = BIND_points) readonly buffer points_block { vec4 records[]; };
layout(std430, binding = BIND_bins) coherent buffer bins_block {
    uint told[16];  // fragments, low and high; records drawn
    uvec2 lists[]; // record, order of its depth
};
layout(std430, binding = BIND_reached) buffer reached_block { float reached[]; };
layout(std430, binding = BIND_target) buffer target_block { vec4 target[]; };
layout(std430, binding = BIND_density) buffer density_block { float density[]; };
layout(std430, binding = BIND_veil) buffer veil_block { float veil[]; };
layout(std430, binding = BIND_counts) buffer counts_block { uint counts[]; };          // of each tile
layout(std430, binding = BIND_begins) readonly buffer begins_block { uint begins[]; }; // of the batch's lists, by tile; and where the last ends

layout(location = 0) uniform uint first_tile; // of the batch
layout(location = 1) uniform uint end_tile;
layout(location = 2) uniform uint columns; // of tiles
layout(location = 3) uniform uint part;    // SORT: the run of this round, 0: all rounds. DRAW: which part of the lists
layout(location = 4) uniform uint apart_of; // SORT: of this round

uint group() { return gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x; }

#if STEP < 2

// Of a light's view all are balls.
bool of_discs() { return PT_SOFT_DISCS(args.model) && args.veils == 0u; }

// Ends of a ball or a disc on screen along one axis: ray of the centre, in units of the axis.
vec2 ends_of(float ray, float ratio, float begin, float step_size)
{
    float scale = pt_rcp(step_size);
    precise float slope = ray * ray + 1.0;
    if (of_discs()) {
        precise float wide = ratio * (slope * pt_rsqrt(slope));
        precise vec2 ends = vec2((ray - wide - begin) * scale, (ray + wide - begin) * scale);
        return ends;
    }
    precise float square = ratio * ratio, inner = slope - square, wide = ratio * (inner * pt_rsqrt(inner));
    float wider = pt_rcp(pt_max(1.0 - square, 1e-6));
    precise vec2 ends = vec2(((ray - wide) * wider - begin) * scale, ((ray + wide) * wider - begin) * scale);
    return ends;
}

// The tiles that a record's ball may touch, x0, y0, x1, y1, all included; false: none. A pixel wider than exact.
bool box_of(vec4 p, out uvec4 box)
{
    view_args view = args.view;
    bool good = true; // of others the eye may stand in the ball: it is everywhere
    float r = 1.0;
    if (view.perspective != 0u && !of_discs()) {
        precise float wide = 1.001 * p.w;
        good = wide < p.z;
    }
    if (view.perspective != 0u)
        r = pt_rcp(good ? p.z : 1.0);
    float begin[2] = float[2](view.ray_x0, view.ray_y0), step_size[2] = float[2](view.ray_xs, view.ray_ys), center[2] = float[2](p.x * r, p.y * r);
    int origin[2] = int[2](view.origin_x, view.origin_y);
    bool some = view.perspective == 0u || !of_discs() || PT_SOFT_BEFORE < p.z; // else it lies behind the eye
    if (of_discs()) // others belong to another slab as a whole
        some = some && args.z_from < p.z && p.z <= args.z_to;
    for (int k = 0; k < 2; k++) {
        float low = float(origin[k] + int(view.rect[k])), high = float(origin[k] + int(view.rect[2 + k]));
        precise vec2 ends;
        if (view.perspective != 0u) {
            precise float ray = begin[k] + step_size[k] * center[k];
            ends = ends_of(ray, p.w * r, begin[k], step_size[k]);
        } else {
            precise float wide = p.w * pt_rcp(step_size[k]);
            ends = vec2(center[k] - wide, center[k] + wide);
        }
        ends = good ? vec2(ends.x - 1.0, ends.y + 1.0) : vec2(low, high);
        some = some && ends.x < high && low <= ends.y;
        float most = high - low - 1.0;
        box[k] = uint(pt_min(pt_max(ends.x - low, 0.0), most)) / PT_SOFT_TILE;
        box[2 + k] = uint(pt_min(pt_max(ends.y - low, 0.0), most)) / PT_SOFT_TILE;
    }
    return some;
}

// Floats in the order of whole numbers, those below 0 too.
uint order_of(float z)
{
    uint bits = pt_bits(z);
    return bits >> 31 != 0u ? ~bits : bits | 0x80000000u;
}

void main()
{
    uint i = group() * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
    uvec4 box;
    if (i >= args.records)
        return;
    vec4 p = records[2u * i];
    if (!(p.z < pt_float(PT_KEY_EMPTY_Z)) || !box_of(p, box))
        return;
#if STEP == 0
    atomicAdd(told[2], 1u);
#endif
    for (uint y = box.y; y <= box.w; y++)
        for (uint x = box.x; x <= box.z; x++) {
            uint tile = y * columns + x;
#if STEP == 0
            atomicAdd(counts[tile], 1u);
#else
            if (tile >= first_tile && tile < end_tile)
                lists[begins[tile] + atomicAdd(counts[tile], 1u)] = uvec2(i, order_of(p.z));
#endif
        }
}

#elif STEP == 2

// Batcher's network, every comparison upwards: what would lie behind the end is greater than all, and never moves.
void main()
{
    uint tile = first_tile + group();
    bool ours = tile < end_tile;
    uint begin = ours ? begins[tile] : 0u, count = ours ? begins[tile + 1u] - begin : 0u;
    uint first_run = part != 0u ? part : 2u, last_run = part != 0u ? part : 2u * count - 1u;
    for (uint run = first_run; run <= last_run && run < 2u * count; run *= 2u)
        for (uint apart = part != 0u ? apart_of : run / 2u; apart != 0u; apart = part != 0u ? 0u : apart / 2u) {
            for (uint t = gl_LocalInvocationID.x; 2u * (t - t % apart) < count; t += gl_WorkGroupSize.x) {
                uint low = 2u * (t - t % apart) + t % apart, high = low + apart;
                if (apart == run / 2u) // the other half of the run, from behind
                    high = 2u * (t - t % apart) + run - 1u - t % apart;
                if (high >= count)
                    continue;
                uvec2 a = lists[begin + low], b = lists[begin + high];
                if (pt_key_less(b, a)) {
                    lists[begin + low] = b;
                    lists[begin + high] = a;
                }
            }
            memoryBarrierBuffer();
            barrier();
        }
}

#else // STEP == 3

// Two lists, of this part and the one before: three words of an indirect dispatch, their length, and 256 tiles.
layout(std430, binding = BIND_unfinished) buffer unfinished_block { uint unfinished[]; };

#define LIST_WORDS 260u // as in native/device_gl/soft.c

shared uint shared_unfinished; // 1: some pixel of the tile is

// This workgroup's tile.
uint tile_of()
{
    return part == 0u ? first_tile + group() : unfinished[((part + 1u) & 1u) * LIST_WORDS + 4u + group()];
}

// By all invocations, behind a barrier that follows their shared_unfinished.
void list_tile(uint tile)
{
    if (gl_LocalInvocationIndex != 0u || shared_unfinished == 0u)
        return;
    uint list = (part & 1u) * LIST_WORDS;
    unfinished[list + 4u + atomicAdd(unfinished[list + 3u], 1u)] = tile;
}

struct pixel {
    float through, density;
    vec3 color;
    float from, to; // z
    uint fragments;
    float place, lost, left_out; // Base, Concentric: along the ray; light lost before it, and Kahan's rest of that
    bool unfinished;
};

layout(std430, binding = BIND_states) buffer states_block { float states[]; }; // STATE of each pixel of these tiles

#define STATE 8u

shared uint shared_fragments;

// (cos(pi sqrt(q)) + 1) / 2, for q in 0..1.
float cosine_of(float q)
{
    precise float f = PT_SOFT_COSINE_5 * q + PT_SOFT_COSINE_4;
    f = f * q + PT_SOFT_COSINE_3;
    f = f * q + PT_SOFT_COSINE_2;
    f = f * q + PT_SOFT_COSINE_1;
    f = f * q + PT_SOFT_COSINE_0;
    f = f * q + 1.0;
    return f;
}

// [S Eq. 22] of that.
float share_of(float weight, float q, float cosine)
{
    precise float share = cosine;
    if (weight < 1.0) {
        float root = q * pt_rsqrt(pt_max(q, 1e-20));
        share = (1.0 - root) * (1.0 - weight) + cosine * weight;
    }
    return share;
}

#if PT_SOFT_DISCS(MODEL) && !VEIL

#define DISCS 256u // of a workgroup's round
shared vec4 places[DISCS]; // x, y, z, opacity
shared vec4 shapes[DISCS]; // q = (a dx + b dy) dx + c dy^2; weight
shared vec4 looks[DISCS];  // colour; density
#if MODEL != PT_SOFT_EXPRESS
shared float radii[DISCS];
#endif
shared uint open;

// 1. A disc: place from the middle of the tile's first pixel.
void set_disc(view_args view, uint k, uint record, ivec2 corner)
{
    vec4 p = records[2u * record], look = records[2u * record + 1u];
    float u = 0.0, v = 0.0, xs = view.ray_xs, ys = view.ray_ys;
    precise float scale = pt_rcp(p.w);
    precise float shared_out = (scale * scale) * PT_SOFT_DISC;
    precise vec2 at = p.xy;
    if (view.perspective != 0u) {
        at = at * pt_rcp(p.z);
        precise vec2 ray = vec2(view.ray_x0 + xs * at.x, view.ray_y0 + ys * at.y);
        u = ray.x;
        v = ray.y;
        scale = scale * p.z;
    }
    precise float n = (u * u + v * v) + 1.0;
    float inverse = pt_rcp(n);
    precise float square = scale * scale;
    precise vec3 shape = vec3((square * (xs * xs)) * (1.0 - (u * u) * inverse), (square * (xs * ys)) * (-2.0 * ((u * v) * inverse)),
                              (square * (ys * ys)) * (1.0 - (v * v) * inverse));
    uint word = pt_bits(look.w);
    precise float opacity = float(word >> PT_SOFT_SHIFT) * (1.0 / PT_SOFT_STEPS), weight = float(word & 255u) * (1.0 / 255.0);
    precise vec2 off = at - vec2(corner) - 0.5;
    places[k] = vec4(off, p.z, opacity);
    shapes[k] = vec4(shape, weight);
    looks[k] = vec4(look.xyz, shared_out);
#if MODEL != PT_SOFT_EXPRESS
    radii[k] = p.w;
#endif
}

#if !VEIL
#if MODEL == PT_SOFT_EXPRESS

bool takes(uint first, pixel own) { return PT_SOFT_SPENT <= own.through || args.density != 0u; }

// 2. What it takes of a pixel's light.
void add_disc(uint k, vec2 here, inout pixel own)
{
    vec4 place = places[k], shape = shapes[k], look = looks[k];
    precise float dx = place.x - here.x, dy = place.y - here.y;
    precise float q = (shape.x * dx + shape.y * dy) * dx + shape.z * (dy * dy);
    q = pt_max(q, 0.0);
    bool open_here = PT_SOFT_SPENT <= own.through;
    if (!(q < 1.0 && (open_here || args.density != 0u) && own.from < place.z && place.z <= own.to))
        return;
    float f = cosine_of(q);
    precise float sum = own.density + look.w * f;
    own.density = sum;
    if (!open_here)
        return;
    float share = share_of(shape.w, q, f);
    precise float part = own.through * (share * place.w), through = own.through - part;
    precise vec3 color = own.color + part * look.xyz;
    own.through = through;
    own.color = color;
    own.fragments++;
}

void finish(inout pixel own) {}

#else

// first: record of the nearest disc that may come.
bool takes(uint first, pixel own)
{
    return !(0.0 < own.lost && own.place < records[2u * first].z) || args.density != 0u;
}

// 2. What of it belongs to a pixel's surface, which ends at own.place; lost, left_out: sums of weights and opacities.
void add_disc(uint k, vec2 here, inout pixel own)
{
    vec4 place = places[k], shape = shapes[k], look = looks[k];
    precise float dx = place.x - here.x, dy = place.y - here.y;
    precise float q = (shape.x * dx + shape.y * dy) * dx + shape.z * (dy * dy);
    q = pt_max(q, 0.0);
    if (!(q < 1.0 && own.from < place.z && place.z <= own.to))
        return;
    float f = cosine_of(q);
    precise float weight = f + PT_SOFT_RIM;
    precise float density_sum = own.density + look.w * f;
    own.density = density_sum;
    bool first = !(0.0 < own.lost);
    if (!(first || place.z <= own.place))
        return;
    precise float end = place.z + radii[k], sum = own.lost + weight, opacities = own.left_out + weight * place.w;
    precise vec3 color = own.color + weight * look.xyz;
    own.place = first ? end : own.place;
    own.lost = sum;
    own.left_out = opacities;
    own.color = color;
    own.fragments++;
}

void finish(inout pixel own)
{
    if (!(0.0 < own.lost))
        return;
    precise float share = 1.0 / own.lost;
    precise float opacity = MODEL == PT_SOFT_SPLATS ? 1.0 : own.left_out * share;
    precise float scale = opacity * share, through = 1.0 - opacity;
    precise vec3 color = own.color * scale;
    own.color = color;
    own.through = through;
}

#endif

void draw(view_args view, uint begin, uint count, ivec2 corner, bool inside, inout pixel own)
{
    uint lane = gl_LocalInvocationIndex;
    vec2 here = vec2(gl_LocalInvocationID.xy);
    uint end = min(count, (part + 1u) * PT_SOFT_PART);
    for (uint i = part * PT_SOFT_PART; i < end; i += DISCS) {
        if (lane == 0u)
            open = 0u;
        barrier();
        if (inside && takes(lists[begin + i].x, own) && own.from < own.to)
            atomicOr(open, 1u);
        if (i + lane < end)
            set_disc(view, lane, lists[begin + i + lane].x, corner);
        memoryBarrierShared();
        barrier();
        bool some = open != 0u;
        for (uint k = 0u; some && inside && k < min(DISCS, end - i); k++)
            add_disc(k, here, own);
        barrier();
    }
    own.unfinished = inside && end < count;
    if (inside && end == count)
        finish(own);
}

#endif

#else

#include "lib/soft.glsl"

#if !VEIL

shared uint widest; // radius in the list

float opacity_of(uint word) { precise float a = float(word >> PT_SOFT_SHIFT) * (1.0 / PT_SOFT_STEPS); return a; }
float weight_of(uint word) { precise float w = float(word & 255u) * (1.0 / 255.0); return w; }

// 1. The nearest place beyond `place` where a ball begins or ends; some: whether one is open there. first: in the list; those before
// it are over.
float next_end(view_args view, ray_of ray, uint begin, uint count, float wide, float place, inout uint first,
               inout uint steps, out bool some)
{
    float next = pt_float(PT_KEY_EMPTY_Z);
    some = false;
    bool over = true;
    for (uint i = first; i < count; i++) {
        steps += 2u; // piece takes as many
        vec4 p = records[2u * lists[begin + i].x];
        if ((p.z - wide) * ray.root > next + pt_abs(next) * 1e-4)
            break;
        over = over && (p.z + wide) * ray.root < place - pt_abs(place) * 1e-4;
        first = over ? i + 1u : first;
        hit h;
        if (over || !meet(view, ray, p, h))
            continue;
        float start = pt_max(h.along - h.reach, ray.from), end = pt_max(pt_min(h.along + h.reach, ray.to), start);
        if (place < start)
            next = pt_min(next, start);
        else if (place < end) {
            next = pt_min(next, end);
            some = true;
        }
    }
    return next;
}

// 2. What the balls that are open from `place` to `next` lose, and the mean of their colours.
float piece(view_args view, ray_of ray, uint begin, uint count, float wide, float place, float next, uint first, out vec3 color)
{
    precise float lost = 0.0, weights = 0.0;
    precise vec3 sum = vec3(0.0);
    for (uint i = first; i < count; i++) {
        uint record = lists[begin + i].x;
        vec4 p = records[2u * record];
        if ((p.z - wide) * ray.root > next + pt_abs(next) * 1e-4)
            break;
        hit h;
        if (!meet(view, ray, p, h))
            continue;
        float start = pt_max(h.along - h.reach, ray.from), end = pt_max(pt_min(h.along + h.reach, ray.to), start);
        if (!(start <= place && place < end))
            continue;
        vec4 look = records[2u * record + 1u];
        float a = opacity_of(pt_bits(look.w));
        precise float low = pt_max((place - h.along) * h.inverse, 0.0 - h.half_chord);
        precise float high = pt_max(pt_min((next - h.along) * h.inverse, h.half_chord), low);
        precise float weight = (1.0 - h.d) * a;
        lost = lost + density_of(h, a, weight_of(pt_bits(look.w))) * depth_of(h.shells, h.d, low, high);
        weights = weights + weight;
        sum = sum + weight * look.xyz;
    }
    color = weights > 0.0 ? sum / weights : vec3(0.0);
    return lost;
}

// 3. Density along the whole ray.
void count_balls(view_args view, ray_of ray, uint begin, uint count, inout pixel own)
{
    precise float sum = 0.0;
    for (uint i = 0u; i < count; i++) {
        hit h;
        if (!meet(view, ray, records[2u * lists[begin + i].x], h))
            continue;
        own.fragments++;
        if (args.density == 0u)
            continue;
        precise float low = pt_max((ray.from - h.along) * h.inverse, 0.0 - h.half_chord), high = pt_min((ray.to - h.along) * h.inverse, h.half_chord);
        sum = sum + ((h.inverse * h.inverse) * PT_SOFT_BALL) * integral(h.d, low, pt_max(low, high));
    }
    own.density = sum;
}

void draw(view_args view, uint begin, uint count, ivec2 corner, bool inside, inout pixel own)
{
    if (gl_LocalInvocationIndex == 0u)
        widest = 0u;
    barrier();
    for (uint i = gl_LocalInvocationIndex; i < count; i += PT_SOFT_TILE * PT_SOFT_TILE)
        atomicMax(widest, pt_bits(records[2u * lists[begin + i].x].w));
    barrier();
    float wide = pt_float(widest) * 1.0001;
    ray_of ray = ray_of(float(corner.x + int(gl_LocalInvocationID.x)) + 0.5, float(corner.y + int(gl_LocalInvocationID.y)) + 0.5, 0.0, 0.0,
                                1.0, 1.0, 0.0, 0.0);
    if (view.perspective != 0u) {
        ray.u = view.ray_x0 + view.ray_xs * ray.x;
        ray.v = view.ray_y0 + view.ray_ys * ray.y;
        ray.n = (ray.u * ray.u + ray.v * ray.v) + 1.0;
        ray.root = sqrt(ray.n);
    }
    ray.from = pt_max(own.from, view.z_near) * ray.root;
    ray.to = own.to * ray.root;
    if (!inside || !(ray.from < ray.to))
        return;
    uint steps = 0u, first = 0u;
    float last = pt_float(PT_KEY_EMPTY_Z);
    if (part == 0u) {
        count_balls(view, ray, begin, count, own);
        own.place = ray.from;
        steps = count;
    }
    own.unfinished = false;
    while (own.through >= PT_SOFT_SPENT) {
        if (steps >= PT_SOFT_PART) {
            own.unfinished = true;
            break;
        }
        bool some;
        vec3 color;
        float next = next_end(view, ray, begin, count, wide, own.place, first, steps, some);
        if (!(next < last))
            break;
        if (some) {
            precise float more = piece(view, ray, begin, count, wide, own.place, next, first, color) - own.left_out, sum = own.lost + more;
            precise float rest = (sum - own.lost) - more;
            own.left_out = rest;
            own.lost = sum;
            float left = sum > 0.0 ? pt_min(pt_exp2(pt_max(sum * -1.44269504, -126.0)), own.through) : own.through;
            precise vec3 shown = own.color + (own.through - left) * color;
            own.color = shown;
            own.through = left;
        }
        own.place = next;
    }
}

#endif // VEIL
#endif // MODEL

#if VEIL
#include "lib/veil.glsl"
#else

void save(view_args view, uvec2 here, pixel own)
{
    uint at = here.y * view.width + here.x, crop = (here.y - args.crop_y) * args.crop_width + (here.x - args.crop_x);
    uint to = args.layered != 0u ? at : crop;
    vec4 old = target[to], mine = vec4(own.color, 1.0 - own.through);
    precise vec4 mixed = args.layered != 0u ? old + (1.0 - old.w) * mine : mine + own.through * old;
    target[to] = mixed;
    if (args.density == 1u)
        density[crop] = own.density;
    else if (args.density != 0u)
        density[crop] += own.density;
    if (args.layered != 0u && args.last != 0u)
        reached[at] = pt_max(reached[at], pt_float(keys[at].y));
}

// What a pixel has come to, from part to part.
pixel restored(uint at, pixel own)
{
    own.through = states[at];
    own.color = vec3(states[at + 1u], states[at + 2u], states[at + 3u]);
    own.density = states[at + 4u];
    own.place = states[at + 5u];
    own.lost = states[at + 6u];
    own.unfinished = pt_bits(states[at + 7u]) != PT_KEY_EMPTY_Z;
    own.left_out = own.unfinished ? states[at + 7u] : 0.0;
    return own;
}

void keep(uint at, pixel own)
{
    states[at] = own.through;
    states[at + 1u] = own.color.x;
    states[at + 2u] = own.color.y;
    states[at + 3u] = own.color.z;
    states[at + 4u] = own.density;
    states[at + 5u] = own.place;
    states[at + 6u] = own.lost;
    states[at + 7u] = own.unfinished ? own.left_out : pt_float(PT_KEY_EMPTY_Z);
}

void main()
{
    view_args view = args.view;
    uint tile = tile_of();
    if (gl_LocalInvocationIndex == 0u)
        shared_fragments = shared_unfinished = 0u;
    barrier();
    bool ours = tile < end_tile;
    uint begin = ours ? begins[tile] : 0u, count = ours ? begins[tile + 1u] - begin : 0u;
    uvec2 corner = uvec2(view.rect[0], view.rect[1]) + PT_SOFT_TILE * uvec2(tile % columns, tile / columns);
    uvec2 here = corner + gl_LocalInvocationID.xy;
    bool inside = ours && here.x < view.rect[2] && here.y < view.rect[3];
    uint state = STATE * ((tile - first_tile) * PT_SOFT_TILE * PT_SOFT_TILE + gl_LocalInvocationIndex);
    pixel own = pixel(1.0, 0.0, vec3(0.0), 0.0, 0.0, 0u, 0.0, 0.0, 0.0, false);
    if (inside) {
        uint at = here.y * view.width + here.x;
        own.from = args.z_from;
        if (args.layered != 0u)
            own.from = pt_max(reached[at], args.z_from);
        own.to = args.layered == 2u ? args.z_to : pt_min(pt_float(keys[at].y), args.z_to);
    }
    if (part != 0u)
        own = restored(state, own);
    bool ended = part != 0u && !own.unfinished; // saved already
    if (count != 0u)
        draw(view, begin, count, ivec2(view.origin_x, view.origin_y) + ivec2(corner), inside && !ended, own);
    keep(state, own);
    if (own.unfinished)
        atomicOr(shared_unfinished, 1u);
    else if (inside && !ended)
        save(view, here, own);
    atomicAdd(shared_fragments, own.fragments);
    memoryBarrierShared();
    barrier();
    list_tile(tile);
    if (gl_LocalInvocationIndex == 0u && shared_fragments != 0u) {
        uint before = atomicAdd(told[0], shared_fragments);
        if (before + shared_fragments < before)
            atomicAdd(told[1], 1u);
    }
}

#endif // VEIL
#endif
