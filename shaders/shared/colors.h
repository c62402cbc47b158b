// SPDX-License-Identifier: GPL-3.0-or-later
// Stage colors: measured and filled pixels become a picture.
#ifndef PT_SHARED_COLORS_H
#define PT_SHARED_COLORS_H

#include "shared/words.h"

// A filled neighbour repeats a surface that was measured elsewhere: 0.33 degrees mean error at weight 1 on a sphere of 1
// point a pixel, 0.25 at 1/8.
#define PT_BLEND_FILLED 0.125f
#define PT_MESH_COVERAGE 0.75f // of a pixel at a mesh's edge: 1/2 to 1 along the axes (mean 3/4) and across (mean 5/6)
// The limit plane's least values are kept for tiles of 2^PT_TILE_LEVEL pixels: a chunk that lies before them is not scattered
// again. Chunks of 4096 points are 30 to 70 pixels wide at a point a pixel.
#define PT_TILE_LEVEL 4

#define PT_RAMP_MOST 256    // PATINA_MAX_RAMP
#define PT_RAMP_SCALAR 1u   // sources of a ramp
#define PT_RAMP_PLACE 2u
#define PT_RAMP_DISTANCE 3u
#define PT_RAMP_TRUST 4u
#define PT_MID_GREY 0.18f   // contrast turns around it
#define PT_BRIGHTEST 65504.0f // half floats end there
#define PT_MAX_LIGHTS 32
#define PT_AREA_POINTS 16 // of an area light, where shading gathers its light

// A light in view space.
struct light_args {
    pt_vec3 color;     // sun: irradiance; point, spot: radiant intensity (W/sr); area: the same of one of its points, head-on
    uint32_t type;     // patina_light_type
    pt_vec3 vector;    // sun: unit, towards the light; others: position
    uint32_t shadow;   // 1 + its place among the lights that cast shadows, as their words lie; 0: casts none
    pt_vec3 axis;      // spot, area: unit, the way the light travels
    float unused;
    pt_vec4 cone;      // spot: cosine of the half angle; 1 / how far above it the cosine is when the edge has faded
    pt_vec4 points[PT_AREA_POINTS]; // area: positions
};

// The light of a picture, one for all its instances: that of the world and those of the lights, as the view sees them.
struct light_view {
    pt_vec3 world;      // ambient radiance; with `directed` for nothing
    uint32_t unused;
    pt_vec4 ambient[9]; // directed: [k][c]: c = 0..2, k = 0..8: 1, x, y, z, xy, yz, zx, x^2 - y^2, 3 z^2 - 1
    struct light_args each[PT_MAX_LIGHTS];
};

// shade: a ramp's colour in place of the point's, then exposure and contrast.
//   scalar: t = (scalar - zero) along.x; where it is NaN, the style colour
//   place: t = ((along.x x + along.y y) + along.z z) + zero, in view space
//   distance: t = (distance - zero) along.x, to the eye or (orthographic) to its plane
//   trust: t = (trust - zero) along.x. The colours are words of shapes: color_format PT_COLOR_OF_SCALAR. No such word is NaN, for a
//     kind is at most 5; where a driver takes one for 0, its level of trust is 0
//   colour: entries evenly over t = 0..1, straight between
//   graded: c = grey (gain c / grey)^contrast, at most PT_BRIGHTEST
struct recolor_args {
    uint32_t source; // PT_RAMP_*; 0: no ramp
    uint32_t graded;
    float along[3], zero;
    float gain, contrast;
    uint32_t first, entries; // in the table of the picture's ramps; 2..PT_RAMP_MOST of them
};

// shade: id -> colour, normal, Phong. [D 3.1], deferred. A filled pixel's normal (SPEC 2.2, refined) is the blend, over the
// (2 r + 1)^2 window, of the surfaces of the same layer that its pixels show: normal[from], |z_q - z| <= deff[from of this
// pixel], weight 1 / (1 + distance^2), an eighth of it where q is filled itself; with blend = 0 (paper), and where the blend is
// nothing, its own source's. r = deff / (K footprint(z)), one spacing there in pixels, rounded, from 1 to blend.
struct shade_args {
    struct view_args view;
    struct instance_args instance;
    uint32_t directed;  // 1: ambient radiance is max(sum of ambient[k][c] b_k(n), 0), n in view space, turned to the eye
    float eye_z;        // orthographic: near, so that view z = -(z + near); perspective: 0
    uint32_t blend;     // the window's radius at most, 0..8
    uint32_t arrived;   // 1: written
    uint32_t of_pixels; // 1: shadow words are those that discs blended to, of the pixel where the surface was measured
    uint32_t light_count, light_types; // of light_view; bits 1 << those that are among them
    uint32_t casting;             // so many of them have shadow words that are read; 0: the instance receives no shadows
    uint32_t marked, step;        // 1: words are those of shown points, `step` a point; 0: of a light those of all slots. Not of pixels
    float scales[PT_MAX_LIGHTS];  // of the sums of these words, as light_args.shadow counts: 1 / (255 samples)
    struct recolor_args recolor;
};

// smooth: 3 x 3 low-pass over non-background neighbours of the same layer. [D 3.4]
struct smooth_args {
    struct view_args view;
    float center, edge, corner; // weights, renormalised over the neighbours taken
    uint32_t translucent;       // 0: alpha is 1 wherever there is something
};

// antialias: Laplace on depth as steps. [D 3.5]. Behind a layer, a neighbour through which no light comes any more is no edge:
// what this surface borders on there lies before it, and took its share of the pixel already.
struct antialias_args {
    struct view_args view;
    uint32_t layers; // 1: edges between layers too, 0: background edges only
    uint32_t behind; // 1: the through plane holds
    uint32_t mesh_base, mesh_count; // ids of triangles: an edge pixel's centre lies on them, so they cover more of it
    uint32_t inked;  // 1: the line plane holds; pixels with a line stay as they are, ink mixes them
};

// peel: a finished layer is blended behind those before it, and says what may show behind it. [D 4, 5], SPEC 3
//   1. A pixel whose depth is not beyond its limit was filled across a layer already taken: it is emptied, its limit stays.
//   2. color behind what was blended before: over + (1 - over.a) color.
//   3. through = through (1 - opacity) of the pixel's own point, limit = z + deff[from]; +inf (finished) where the layer is
//      empty or, with `stop`, through < PT_SPENT.
//   4. tiles: of each 2^PT_TILE_LEVEL x 2^PT_TILE_LEVEL pixels, as far as they lie in the rectangle, the least limit (+inf:
//      all finished) and how many the layer covers.
struct peel_args {
    struct view_args view;
    uint32_t first; // 1: the first layer: through is 1, nothing is limited, nothing was blended
    uint32_t stop;  // 0: what lies behind an opaque pixel is wanted too (passes of the layers)
    uint32_t inked; // 1: the over plane holds this layer's lines already, on the first layer too
};

// compose: over the background, into the crop.
struct compose_args {
    struct view_args view;
    uint32_t crop_x, crop_y, crop_width, crop_height; // in the planes
    float background[4]; // premultiplied
    uint32_t everywhere; // 1: the colour holds where the key is empty, too
};

// extract: depth, world-space normal, source, shadow. Any may be left out.
struct extract_args {
    struct view_args view;
    uint32_t crop_x, crop_y, crop_width, crop_height;
    uint32_t depth, normal, source, shadow;
    uint32_t discs_first, discs_count; // of ids: how far a measured pixel lies from such a point is in the away plane
    uint32_t centered; // ids below it: their depth has the offset of the measured pixel that it comes from added
    float world_from_view[9];
};

#endif
