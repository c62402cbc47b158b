// SPDX-License-Identifier: GPL-3.0-or-later
// What a pixel that fill closes becomes: a part of fill.comp and of lib/fill_tiles.glsl. SPEC 2.2. Include it behind `args`, the
// fill_args, and what reads the state before the step:
//   float z_at(ivec2 size, int x, int y);   +inf outside the plane
//   uvec2 key_at(ivec2 size, ivec2 place), uint from_at(ivec2 size, ivec2 place);   inside the plane
//   float farthest_of(uint cell, uint source, float z_q);   pt_farthest of that state
#ifndef PT_CLOSING_GLSL
#define PT_CLOSING_GLSL

// The ring, anticlockwise from east.
const ivec2 ring[8] = ivec2[8](ivec2(1, 0), ivec2(1, 1), ivec2(0, 1), ivec2(-1, 1), ivec2(-1, 0), ivec2(-1, -1),
                               ivec2(0, -1), ivec2(1, -1));

// Whether the surface that a neighbour shows reaches the pixel.
bool reaches(view_args view, ivec2 place, uvec2 key, uint source)
{
    float scale = float(1u << view.level), z = pt_float(key.y);
    precise float width = view.perspective != 0u ? view.footprint * z : view.footprint;
    float share = key.x >= args.discs_first ? args.disc_reach : args.reach;
    vec2 ray = abs(pt_ray(view, place.x, place.y)); // how much wider than in the middle the picture shows what faces the eye
    float stretch = view.perspective != 0u ? pt_max(pt_max(ray.x, ray.y), 1.0) : 1.0;
    precise float way = (read_span(source) * share) * pt_rcp(width * read_float4(source).w);
    precise float most = way * stretch + PT_FILL_SLACK * scale;
    uvec2 at = pt_pixel(source, args.from_width);
    precise float dx = (float(place.x) + 0.5) * scale - (float(at.x) + 0.5);
    precise float dy = (float(place.y) + 0.5) * scale - (float(at.y) + 0.5);
    precise float square = dx * dx + dy * dy, bound = most * most;
    return square <= bound;
}

// The neighbour with the least key; with `reach` of those that reach the pixel and are nearer than `threshold`.
uvec2 least_key(view_args view, ivec2 place, bool reach, float threshold, inout ivec2 best)
{
    ivec2 size = ivec2(view.width, view.height);
    uvec2 key = uvec2(0xFFFFFFFFu);
    for (int d = 0; d < 8; d++) {
        ivec2 at = place + ring[d];
        bool inside = at.x >= 0 && at.y >= 0 && at.x < size.x && at.y < size.y;
        at = inside ? at : place;
        uvec2 other = key_at(size, at);
        bool less = inside && pt_key_less(other, key);
        if (reach && less)
            less = pt_float(other.y) < threshold && reaches(view, place, other, from_at(size, at));
        key = less ? other : key;
        best = less ? at : best;
    }
    return key;
}

// z at a pixel of the surface that its neighbour `best` shows at z_q: of its tangent plane, within the cloud.
float refined_z(view_args view, ivec2 place, ivec2 best, uint source, float z_q)
{
    ivec2 size = ivec2(view.width, view.height);
    vec4 normal = read_float4(source);
    float z = pt_plane_depth(view, normal.xyz, pt_ray(view, best.x, best.y), z_q, pt_ray(view, place.x, place.y),
                             pt_level_distance(view, read_span(source), normal.w, z_q));
    float farthest = farthest_of(pt_cell_of(source, args.from_width, view.level, view.width), source, z_q);
    if (farthest < z)
        for (int d = 0; d < 8; d++)
            farthest = pt_farther(farthest, z_at(size, place.x + ring[d].x, place.y + ring[d].y), z_q, z);
    return pt_max(pt_min(z, farthest), z_q);
}

// The least key among the neighbours of a pixel; refined: its surface's tangent plane there. False: none reaches the pixel.
bool close_pixel(view_args view, ivec2 place, float threshold, out uvec2 key, out uint source)
{
    ivec2 size = ivec2(view.width, view.height), best = place;
    key = least_key(view, place, false, threshold, best);
    source = from_at(size, best);
    bool taken = args.reach == 0.0 || reaches(view, place, key, source);
    if (!taken) {
        key = least_key(view, place, true, threshold, best);
        source = from_at(size, best);
        taken = key != uvec2(0xFFFFFFFFu);
    }
    if (args.refined != 0u && taken)
        key.y = pt_bits(refined_z(view, place, best, source, pt_float(key.y)));
    return taken;
}

#endif
