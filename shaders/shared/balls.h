// SPDX-License-Identifier: GPL-3.0-or-later
// Stage balls: soft points, SPEC 5 [S].
#ifndef PT_SHARED_BALLS_H
#define PT_SHARED_BALLS_H

#include "shared/colors.h"
#include "shared/words.h"

// A record of 8 words: X, Y, z of the centre, not divided by z, as in chunk_view; radius; colour, lit; and opacity at the centre
// in steps of 2^-24 << PT_SOFT_SHIFT | W of [S Eq. 22] in steps of 1/255. z = +inf: there is none.
#define PT_SOFT_WORDS 8u
#define PT_SOFT_SHIFT 8
#define PT_SOFT_STEPS 16777215.0f
// Balls are at least so many pixels in radius, and as much fainter: narrower ones would fall between pixels.
#define PT_SOFT_LEAST 1.0f
#define PT_SOFT_FULLEST 0.9999847f // 1 - 2^-16: more opacity than this has no density
#define PT_SOFT_SPENT 0.000244140625f // 2^-12: what lies behind is not looked at; a quarter of a step of 10 bits
#define PT_SOFT_TILE 16u
#define PT_SOFT_PART 16384u // OpenGL: steps through a list from one dispatch to the next
#define PT_SOFT_VEILS 32u     // slabs of depth of a light's view, at most
#define PT_SOFT_FARTHEST 1e30f // a place beyond is none
#define PT_SOFT_WIDEST 1e18f   // no radius is more
#define PT_SOFT_BEFORE 1e-30f  // z of what is before the eye; what is not is lit as if it lay on the view's axis
#define PT_SOFT_EXPRESS 0 // models; without u, which strict preprocessors refuse in #if
#define PT_SOFT_CONCENTRIC 1
#define PT_SOFT_BASE 2
#define PT_SOFT_SPLATS 3
#define PT_SOFT_ONE_LAYER 4
#define PT_SOFT_MODELS 5
#define PT_SOFT_DISCS(model) ((model) == PT_SOFT_EXPRESS || (model) >= PT_SOFT_SPLATS)
#define PT_SOFT_EVEN 0u // weights of shells: r / N, which come to the Base model's density
#define PT_SOFT_EQ13 1u
#define PT_SOFT_EQ15 2u
#define PT_SOFT_RING 4.0f    // Concentric: a shell every so many pixels of the radius,
#define PT_SOFT_SHELLS 64.0f // at most
// (cos(pi sqrt(q)) + 1) / 2 - 1 over q, for q in 0..1, within 2e-7
#define PT_SOFT_COSINE_0 -2.46740103f
#define PT_SOFT_COSINE_1 2.02935433f
#define PT_SOFT_COSINE_2 -0.667612433f
#define PT_SOFT_COSINE_3 0.117583841f
#define PT_SOFT_COSINE_4 -0.0127442228f
#define PT_SOFT_COSINE_5 0.000819474808f
#define PT_SOFT_RIM 1e-2f // Splats, One Layer: more weight than the cosine, so that where all are at their rims rounding decides nothing
#define PT_SOFT_DISC 1.0704707f      // 1 / the integral of (cos(pi r) + 1) / 2 over the unit disc, pi / 2 - 2 / pi
#define PT_SOFT_BALL 0.95492965855f  // 3 / pi: 1 / the integral of 1 - r over the unit ball

// soft: the balls of soft points along each pixel's ray, front to back, as far as the nearest solid surface. n = 1 + u^2 + v^2
// with (u, v, -1) the pixel's ray; orthographic n = 1, and X, Y are not times z. e: from the ray at the centre's z to the centre.
//   d^2 = |e|^2 - (e . (u, v))^2 / n     how far the centre lies from the ray
//   s = (z n + e . (u, v)) / sqrt(n)     where along the ray it lies nearest; along is sqrt(n) z
// Base [S 3.1]: between two places along the ray where balls begin or end, colour is the mean of those that are open with the
//   weights (1 - d/r) a, light lost 1 - exp(-sum m lambda I), I the integral of 1 - distance / r over the part within each ball, in
//   radii, lambda = -ln(1 - a), a opacity at the centre.
//   m: with F between the threshold and l_m [S Eq. 22] the opacity P of the whole ball becomes a (1 - d/r)(1 - W) + P W: m of its
//   density. Else 1.
// Concentric [S 3.2]: I is a sum over N shells of radii r (1 - i/N), of the length within each times its mu, in radii; lambda the
//   same divided by the sum of mu 2 r_i / r at the centre.
// Express [S 3.3]: one piece a ball, at its centre's z: an ellipse on screen, that of a disc across the ray to the centre: with
//   n, u, v of that ray q = ((dx^2 + dy^2) - (dx u + dy v)^2 / n) (z/r)^2, dx, dy in units of u, v; opacity a (cos(pi sqrt(q)) + 1) / 2.
// Splats, One Layer: the same discs, for comparison. Of a pixel those up to a radius of the nearest one's behind that one are its
//   surface, and no other counts: colour and opacity are means with the weights (cos(pi sqrt(q)) + 1) / 2 + PT_SOFT_RIM; Splats: opacity 1.
// Equal z go by record. A pixel whose light falls below PT_SOFT_SPENT takes no more.
// density: points per square of the world's unit across the ray, each shared out over its ball (Express: over its disc).
// veils: of a light's view, and nothing is drawn: what -ln of the light that comes through grows by in each of so many slabs of
//   depth, veil_from + k veil_deep on, the first and the last without end; added to what is there. Base and Concentric: sum m lambda I
//   within the slab; Express, and what stands for it: -ln(1 - a (cos(pi d) + 1) / 2), evenly over the ray's 2 r about where it is
//   nearest to the centre. With `last` and no records slabs become sums of all up to their ends.
struct soft_args {
    struct view_args view;  // rect: the pixels that are written
    uint32_t records;       // how many there may be, drawn or not
    uint32_t model, mu;     // PT_SOFT_*
    uint32_t shells;        // of every ball; 0: as PT_SOFT_RING says
    float z_from, z_to;     // only what lies beyond z_from, and not beyond z_to
    uint32_t layered;       // 1: only what lies beyond the reached plane, too; and it goes behind what target holds, of the plane's
                            // size. 2: the same, whatever the keys' z. 0: it goes before what target holds, of the crop's size
    uint32_t last;          // layered: the keys' z becomes the reached one, where it lies beyond that
    uint32_t crop_x, crop_y, crop_width; // of density, and of target unless layered
    uint32_t density;       // 0: none; 1: written; 2: added to
    uint32_t veils;         // 0, or 1..PT_SOFT_VEILS
    float veil_from, veil_deep; // z; veil_deep > 0
};

// gather: the soft points of an instance become records, lit as shade lights them.
struct gather_args {
    struct shade_args shade; // view: of the planes
    uint32_t threshold;      // of F, in its steps: points above are soft
    float weight;            // 1 / (l_m - t), in steps; 0: every W is 1
    float radius_scale;      // object units -> world, times what strata leave out
    float opacity;           // at the centre, times the instance's and the point's
    uint32_t within;         // 1: balls whose centre is nearer than z_near, or beyond z_far, may show
    uint32_t sifted;         // as in scatter_args
    uint32_t whole;          // 1: words are radii alone
    uint32_t radius_base, radius_step; // how they are read (shared/words.h)
};

#endif
