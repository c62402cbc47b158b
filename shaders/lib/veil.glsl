// SPDX-License-Identifier: GPL-3.0-or-later
// A light's view of soft points, for soft.comp; twin of native/device_cpu/kernels/soft_veil.h. Include it behind lib/soft.glsl
// and the shares of discs.
#ifndef PT_VEIL_GLSL
#define PT_VEIL_GLSL

// Where slab k ends, or (k = 0) the first begins; what lies before it counts in the first, what lies behind the last in that.
float border(view_args view, uint k)
{
    precise float place = args.veil_from + float(k) * args.veil_deep;
    float end = k == 0u ? view.z_near : k == args.veils ? pt_float(PT_KEY_EMPTY_Z) : place;
    return pt_min(pt_max(end, args.z_from), args.z_to);
}

// The slabs that what reaches from z - r to z + r may lie in: both included.
uvec2 slabs_of(float z, float r)
{
    float scale = 1.0 / args.veil_deep, reach = 1.001 * r, most = float(args.veils - 1u);
    vec2 ends = vec2((z - reach - args.veil_from) * scale - 0.01, (z + reach - args.veil_from) * scale + 0.01);
    return uvec2(uint(pt_min(pt_max(ends.x, 0.0), most)), uint(pt_min(pt_max(ends.y, 0.0), most)));
}

// What the ball loses from `low` to `high` in radii from where the ray is nearest to its centre; Express: evenly over 2.
float lost_of(hit h, float low, float high)
{
#if MODEL == PT_SOFT_EXPRESS
    precise float lost = (high - low) * 0.5;
#else
    float lost = depth_of(h.shells, h.d, low, high);
#endif
    return lost;
}

// Returns how many steps it took.
uint veil_ball(view_args view, ray_of ray, uint record, uint at)
{
    vec4 p = records[2u * record];
    hit h;
    if (!meet(view, ray, p, h))
        return 1u;
    uint word = pt_bits(records[2u * record + 1u].w);
    precise float a = float(word >> PT_SOFT_SHIFT) * (1.0 / PT_SOFT_STEPS), w = float(word & 255u) * (1.0 / 255.0);
#if MODEL == PT_SOFT_EXPRESS
    precise float q = h.d * h.d;
    precise float opacity = share_of(w, q, cosine_of(q)) * a;
    float density_here = 0.0 - log1p(0.0 - pt_min(opacity, PT_SOFT_FULLEST));
    h.half_chord = 1.0;
#else
    float density_here = density_of(h, a, w);
#endif
    uvec2 slabs = slabs_of(p.z, 2.0 * p.w); // a slanting ray is nearest to the centre up to r before it
    for (uint s = slabs.x; s <= slabs.y; s++) {
        precise float low = pt_max((border(view, s) * ray.root - h.along) * h.inverse, 0.0 - h.half_chord);
        precise float high = pt_max(pt_min((border(view, s + 1u) * ray.root - h.along) * h.inverse, h.half_chord), low);
        if (!(low < high))
            continue;
        precise float sum = veil[at + s] + density_here * lost_of(h, low, high);
        veil[at + s] = sum;
    }
    return 1u + (slabs.y - slabs.x + 2u) * (1u + uint(h.shells));
}

// Returns whether the list goes on.
bool add(view_args view, uint begin, uint count, uvec2 corner, bool inside, uint at, uint state)
{
    ray_of ray = ray_of(float(view.origin_x + int(corner.x + gl_LocalInvocationID.x)) + 0.5,
                        float(view.origin_y + int(corner.y + gl_LocalInvocationID.y)) + 0.5, 0.0, 0.0, 1.0, 1.0,
                        0.0 - pt_float(PT_KEY_EMPTY_Z), pt_float(PT_KEY_EMPTY_Z));
    if (view.perspective != 0u) {
        ray.u = view.ray_x0 + view.ray_xs * ray.x;
        ray.v = view.ray_y0 + view.ray_ys * ray.y;
        ray.n = (ray.u * ray.u + ray.v * ray.v) + 1.0;
        ray.root = sqrt(ray.n);
    }
    uint i = part == 0u ? 0u : uint(states[state]), steps = 0u;
    for (; inside && i < count && steps < PT_SOFT_PART; i++)
        steps += veil_ball(view, ray, lists[begin + i].x, at);
    states[state] = float(i);
    return i < count;
}

void main()
{
    view_args view = args.view;
    uint tile = tile_of();
    if (gl_LocalInvocationIndex == 0u)
        shared_unfinished = 0u;
    barrier();
    bool ours = tile < end_tile;
    uint begin = ours ? begins[tile] : 0u, count = ours ? begins[tile + 1u] - begin : 0u;
    uvec2 corner = uvec2(view.rect[0], view.rect[1]) + PT_SOFT_TILE * uvec2(tile % columns, tile / columns);
    uvec2 here = corner + gl_LocalInvocationID.xy;
    bool inside = ours && here.x < view.rect[2] && here.y < view.rect[3];
    uint at = (here.y * view.width + here.x) * args.veils;
    uint state = STATE * ((tile - first_tile) * PT_SOFT_TILE * PT_SOFT_TILE + gl_LocalInvocationIndex);
    if (add(view, begin, count, corner, inside, at, state) && inside)
        atomicOr(shared_unfinished, 1u);
    memoryBarrierShared();
    barrier();
    list_tile(tile);
    precise float sum = 0.0;
    for (uint k = 0u; inside && args.last != 0u && k < args.veils; k++) {
        sum = sum + veil[at + k];
        veil[at + k] = sum;
    }
}

#endif
