// SPDX-License-Identifier: GPL-3.0-or-later
// What a mesh's image shows at a pixel: see struct texture_args; twin of native/device_cpu/kernels/texture.h. The kernel has
// declared args with its view and mesh, vertices, indices and texels (words).
#ifndef PT_TEXTURE_GLSL
#define PT_TEXTURE_GLSL

#include "lib/srgb.glsl"
#include "lib/triangle.glsl"

const float side_most = 1e15; // of the image, to the next pixel

// Of a pixel: where on the image it lies, and how far the next ones to the right and above do from there, in widths and heights.
struct on_image {
    vec2 at, side[2];
};

// Where the weights f of the three corners, whose sum is positive, lie on the image, from `at`.
vec2 image_side(float f[3], vec2 corner[3], vec2 at)
{
    precise float sum = (f[0] + f[1]) + f[2];
    bool good = 1e-30 <= sum && sum <= 1e30;
    float scale = pt_rcp(good ? sum : 1.0);
    precise float a = f[0] * scale, b = f[1] * scale, c = f[2] * scale;
    precise vec2 there = (a * corner[0] + b * corner[1]) + c * corner[2];
    precise vec2 side = there - at;
    return vec2(good && pt_abs(side.x) <= side_most ? side.x : side_most, good && pt_abs(side.y) <= side_most ? side.y : side_most);
}

// 1. of the triangle t.
on_image place_on_image(triangle t)
{
    on_image place;
    vec2 corner[3];
    for (uint i = 0u; i < 3u; i++) {
        uint at = args.mesh.stride * t.corner[i] + args.mesh.texture.uv;
        corner[i] = vec2(vertices[at], vertices[at + 1u]);
    }
    precise vec2 here = (t.share[0] * corner[0] + t.share[1] * corner[1]) + t.share[2] * corner[2];
    place.at = here;
    for (int next = 0; next < 2; next++) {
        vec2 away[3];
        float f[3];
        for (int i = 0; i < 3; i++) {
            precise float moved = (next == 0 ? t.away[i].x : t.away[i].y) - t.depth[i];
            away[i] = next == 0 ? vec2(moved, t.away[i].y) : vec2(t.away[i].x, moved);
        }
        for (int i = 0; i < 3; i++) {
            float c = cross_of(away[(i + 1) % 3], away[(i + 2) % 3]);
            f[i] = t.turned ? pt_negate(c) : c;
        }
        place.side[next] = image_side(f, corner, here);
    }
    return place;
}

// Adds a texel, colour by opacity, times a weight.
void add_texel(uint index, float weight, inout vec4 sum)
{
    vec4 c;
    if (args.mesh.texture.format == PT_TEXELS_FLOAT) {
        for (uint k = 0u; k < 4u; k++)
            c[k] = pt_float(texels[4u * index + k]);
    } else {
        uint word = texels[index];
        for (uint k = 0u; k < 4u; k++) {
            uint byte = word >> 8u * k & 255u;
            precise float linear = float(byte) * (1.0 / 255.0);
            c[k] = k < 3u && args.mesh.texture.format == PT_TEXELS_SRGB ? pt_srgb(byte) : linear;
        }
    }
    precise float share = c.w * weight;
    precise vec3 added = sum.xyz + c.xyz * share;
    precise float opacity = sum.w + share;
    sum = vec4(added, opacity);
}

// A column or row of the image next to another: into the image.
uint wrap_texel(int x, uint size)
{
    bool repeats = args.mesh.texture.wrap == PT_WRAP_REPEAT;
    return uint(x) < size ? uint(x) : x == -1 ? (repeats ? size - 1u : 0u) : (repeats ? 0u : size - 1u);
}

// 3. of one level.
void add_level(uint level, vec2 at, float weight, inout vec4 sum)
{
    uint width = args.mesh.texture.sizes[3u * level], height = args.mesh.texture.sizes[3u * level + 1u];
    uint first = args.mesh.texture.sizes[3u * level + 2u];
    precise vec2 x = at * vec2(float(width), float(height)) - 0.5;
    vec2 whole = floor(x);
    precise vec2 toward = x - whole;
    uint left = wrap_texel(int(whole.x), width), right = wrap_texel(int(whole.x) + 1, width);
    uint low = first + wrap_texel(int(whole.y), height) * width, high = first + wrap_texel(int(whole.y) + 1, height) * width;
    precise float below = (1.0 - toward.y) * weight, above = toward.y * weight;
    precise float a = (1.0 - toward.x) * below, b = toward.x * below, c = (1.0 - toward.x) * above, d = toward.x * above;
    bvec4 ends = bvec4(true); // left, right, low, high: whether they are on the image
    if (args.mesh.texture.wrap == PT_WRAP_CLIP)
        ends = bvec4(uint(int(whole.x)) < width, uint(int(whole.x) + 1) < width, uint(int(whole.y)) < height,
                     uint(int(whole.y) + 1) < height);
    if (ends.x && ends.z)
        add_texel(low + left, a, sum);
    if (ends.y && ends.z)
        add_texel(low + right, b, sum);
    if (ends.x && ends.w)
        add_texel(high + left, c, sum);
    if (ends.y && ends.w)
        add_texel(high + right, d, sum);
}

// The texel of the finest level that a place lies in.
void add_nearest(vec2 at, inout vec4 sum)
{
    uint width = args.mesh.texture.sizes[0];
    precise vec2 size = vec2(float(width), float(args.mesh.texture.sizes[1]));
    precise vec2 x = at * size, last = size - 1.0;
    add_texel(uint(pt_min(floor(x.y), last.y)) * width + uint(pt_min(floor(x.x), last.x)), 1.0, sum);
}

// Into 0..1; of a clipped image into -1..2, where its border fades out over half a texel.
vec2 wrap_place(vec2 at)
{
    bool clips = args.mesh.texture.wrap == PT_WRAP_CLIP;
    float low = clips ? -1.0 : 0.0, high = clips ? 2.0 : 1.0;
    for (int k = 0; k < 2; k++) {
        precise float turn = at[k] - floor(at[k]);
        float x = args.mesh.texture.wrap == PT_WRAP_REPEAT ? turn : at[k];
        at[k] = low < x ? (x < high ? x : high) : low;
    }
    return at;
}

// 2. and 3.: colour and opacity.
vec4 image_at(on_image place)
{
    float square[2];
    vec4 sum = vec4(0.0);
    float most = float(args.mesh.texture.levels - 1u);
    for (int next = 0; next < 2; next++) {
        precise float x = place.side[next].x * float(args.mesh.texture.sizes[0]);
        precise float y = place.side[next].y * float(args.mesh.texture.sizes[1]);
        precise float s = x * x + y * y;
        square[next] = s;
    }
    bool upright = square[0] < square[1];
    float major = pt_max(square[0], square[1]), minor = pt_min(square[0], square[1]), count = 1.0;
    float apart = pt_max(minor, 1.0);
    for (uint k = 1u; k < PT_PROBES; k++) {
        precise float least = float(k * k) * apart;
        count = least < major ? float(k + 1u) : count;
    }
    precise float narrow = major * (1.0 / float(PT_PROBES * PT_PROBES));
    float share = pt_rcp(count), wide = pt_max(minor, narrow);
    precise float deep = 0.5 * pt_log2(pt_max(wide, 1.0));
    float level = pt_min(1.0 < wide ? deep : 0.0, most), whole = floor(level);
    precise float beyond = level - whole;
    precise float finer_share = (1.0 - beyond) * share, coarser_share = beyond * share;
    bool sharp = args.mesh.texture.nearest != 0u && major <= 1.0;
    for (uint i = 0u; i < PT_PROBES && float(i) < count; i++) {
        precise float along = (float(i) + 0.5) * share - 0.5;
        precise vec2 aside = along * (upright ? place.side[1] : place.side[0]);
        precise vec2 at = place.at + (sharp ? vec2(0.0) : aside);
        vec2 within = wrap_place(at);
        if (sharp) {
            if (i == 0u && 0.0 <= within.x && within.x <= 1.0 && 0.0 <= within.y && within.y <= 1.0)
                add_nearest(within, sum);
            continue;
        }
        add_level(uint(whole), within, finer_share, sum);
        if (0.0 < beyond)
            add_level(uint(pt_min(whole + 1.0, most)), within, coarser_share, sum);
    }
    bool straight = args.mesh.texture.blend != 0u || args.mesh.texture.cut > 0.0;
    bool some = (straight ? 1e-6 : 0.0) <= sum.w;
    float scale = straight ? pt_rcp(some ? sum.w : 1.0) : 1.0;
    precise vec3 color = sum.xyz * scale;
    return vec4(some ? color : vec3(0.0), pt_min(sum.w, 1.0));
}

#endif
