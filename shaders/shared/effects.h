// SPDX-License-Identifier: GPL-3.0-or-later
// Stage effects: on the colour of a layer, premultiplied, where it has something.
#ifndef PT_SHARED_EFFECTS_H
#define PT_SHARED_EFFECTS_H

#include "shared/clips.h"

// tint: the colour of pixels whose surface lies near a cut. d: how far inside that box which keeps it most, how far outside a
// box that cuts or before a plane; weight = strength clamp((width - d) / footprint + 1/2), of the clip where it is greatest.
struct tint_args {
    struct view_args view;
    uint32_t id_base, id_first, id_count; // pixels of this instance: as in instance_args
    uint32_t clip_first, clip_count;
    float eye_z; // as in shade_args
};

#define PT_EDL_NEIGHBOURS 8
#define PT_EDL_RADII 3    // the radius, twice and four times it
#define PT_EDL_MOST 64    // largest radius, pixels
#define PT_EDL_GRAZING 0.1f // least |n . v|
// A neighbour's step counts up to this: beyond, an edge is an edge. So much darkens to 1/20 where half of the neighbours have
// it, at strength 1.
#define PT_EDL_STEP 6.0f
#define PT_EDL_EMPTY -3e38f // what empty neighbours have for a depth: nearer than all
#define PT_EDL_BEYOND 3e38f // beyond the plane: farther, so that it says nothing

// edl: eye-dome lighting. A pixel is darker the farther it lies behind its neighbours: with f(z) = log2 z in perspective, with from_eye
// log2 of the distance from the eye, z sqrt(1 + u^2 + v^2), and z in orthographic views, colour times 2^(-fade gain sum min(max(scale (f(z) - f(z_q)), 0), PT_EDL_STEP)). Empty neighbours count
// as nearer: a silhouette darkens within.
// Where points are sparse, neighbours lie farther away, so that no disc or cell has an outline of its own. The width of what a
// pixel shows is d_eff max(|n . v|, PT_EDL_GRAZING) / footprint(z), which is two spacings in pixels, and w the least of
// it and the first radius' neighbours: discs' normals are means, by which rims of what is dense look sparse. The radius is the first with
// w <= wide, or else the last; its gain is smaller as its radius is larger, so that a slope is equally dark with each of them.
// Discs larger than the last radius fade: fade = clamp(2 - w / wide, 0, 1), wide: that of the last.
struct edl_args {
    struct view_args view;
    int32_t offsets[2 * PT_EDL_NEIGHBOURS * PT_EDL_RADII]; // x, y in pixels, of each radius
    uint32_t reach;                                        // the largest of them
    float gain[PT_EDL_RADII], wide[PT_EDL_RADII];
    float scale, narrow; // narrow: 1 / the last of wide
    uint32_t from_eye;   // of perspective views: 0 or 1
};

#define PT_OBSCURE_TAPS 6
#define PT_OBSCURE_TURNS 16  // of the taps, by column and row modulo 4
#define PT_OBSCURE_MOST 32.0f // pixels that the radius may span; where it would span more, it is shortened
#define PT_OBSCURE_BIAS 0.1f // of the cosine: so low above a surface all is its own roughness
#define PT_OBSCURE_GAIN 5.0f  // deep folds are black then
#define PT_OBSCURE_BLUR 2     // pixels: 5 x 5 with half weights at the rim hold every turn equally

// obscure: ambient obscurance. How much of what a surface sees within the radius r is near, by taps on a spiral that is
// turned by the pixel's place in the full picture: mean over the taps of GAIN max(cos - BIAS, 0) (1 - |v|^2 / r^2), v from
// the pixel's point to the tap's, cos between v and the normal shown. Then the mean over 5 x 5 pixels of the same layer
// (|z_q - z| <= 2 d_eff), weights 1 and at the rim 1/2; colour times 1 - strength of that, at least 0.
struct obscure_args {
    struct view_args view;
    float radius, strength;
    float spiral[2 * PT_OBSCURE_TAPS]; // x, y in radii
    float turns[2 * PT_OBSCURE_TURNS]; // cosine, sine
};

#define PT_TOON_DARK 1e-6f // less albedo or brightness than this is none

// toon: bands of light over colours as they are. brightness = luminance of the colour / that of the albedo; its root times `bands`
// (their number less 1/2, so that full light is in the middle of the last) goes in steps of 1, each a smooth step 1 / steepness
// wide; the first band is the darkest there is. Colour times band / brightness.
struct toon_args {
    struct view_args view;
    float bands, inverse; // inverse: 1 / bands
    float steepness;
};

#define PT_HATCH_LEVELS 3
#define PT_HATCH_GRAZING 0.01f // least (n . r)^2: 84 degrees; flatter, strokes run together

// hatch: strokes where planes across an axis cut the surface: they follow its form, and lie still in the scene. A level's
// planes are 2^k world units apart, k so that strokes on screen are 1/2 to 1 of the spacing apart; every other one thins out
// before the next k. Wider where the colour's tone (root of its luminance) is darker: width max(1 - tones tone, 0).
struct hatch_args {
    struct view_args view;
    uint32_t levels;
    float eye_z;   // orthographic: near, as in shade
    float spacing; // pixels
    float width;   // of a stroke on black, pixels
    float opacity, ground; // of the ink; share by which colours give way to white beneath
    float color[3];
    float tones[PT_HATCH_LEVELS];
    float offsets[PT_HATCH_LEVELS];  // of the camera along the axis
    float axes[3 * PT_HATCH_LEVELS]; // unit, view space
};

#define PT_VALUE_MOST 1e30f // values beyond it count as it

// value: scalar - offset of the point shown; where it is not finite, NaN.
struct value_args {
    struct view_args view;
    struct instance_args instance;
    float offset;
    uint32_t first; // 1: pixels of other instances become NaN
};

#define PT_SLOPE_LEAST 2.0f // pixels: of 5 x 5 values noise of one counts a tenth
#define PT_SLOPE_MOST 32    // pixels
#define PT_SLOPE_TAPS 8     // on each side; wider windows take every second pixel, or fewer
#define PT_SLOPE_GRAZING 0.1f // least |n . v|
#define PT_SLOPE_RIDGE 0.0078125f // pixels squared: of values that lie in a line, nothing is said across it
#define PT_SLOPE_STEEPEST 1e18f

// slope: of the values around a pixel, the plane v + g . (x, y) that fits them best by weighted least squares, RIDGE added to the
// variance of x and of y. Taken are pixels of the same layer, |z_q - z| <= d_eff, of which something is known, within a radius r of
// d_eff |n . v| / footprint(z), which is two spacings in pixels, rounded, from LEAST to MOST; weight 1 - |q|^2 / (r + 1)^2, above 0. Of a radius above
// TAPS every s-th row and column are taken, s = ceil(r / TAPS), counted from the pixel.
struct slope_args {
    struct view_args view;
};

#define PT_CONTOUR_KINDS 2       // all lines; of every few of them one, bold
#define PT_CONTOUR_GRAZING 1e-3f // least (n . r)^2: 88 degrees
#define PT_CONTOUR_FLAT 1.6e-5f  // sin^2 of 0.23 degrees: a flatter surface is level. Else a floor whose height is that of a line would be
                                 // one blot
#define PT_CONTOUR_RISE 3472.2222f // 1 / (sin^2 of a degree - FLAT): from there on lines are wholly seen
#define PT_CONTOUR_PER_APART 2.44140625e-4f // 1 / 4096: lines of an attribute that lie so many pixels apart and more fade away, till twice that

// contour: lines where the height h = axis . p + offset is a multiple of an interval, as wide on screen at any slope: the surface goes on
// in its tangent plane, so that from pixel to pixel h grows by |g|, g = w (a - (a . r) n / (n . r)) along x and y, w a pixel's width at p.
// With d = |h / interval - round| interval / |g|, pixels, a line covers clamp(width / 2 - d + 1/2, 0, 1) min(width, 1). Where lines are
// less than 2 `even` pixels apart (even = 2 max(width, 1)) that goes over into an even tone, width / apart, which at `even` and less is
// width / even. What kinds of lines cover most counts; times opacity, less on what is nearly level. Of values, h and g are what slope found.
struct contour_args {
    struct view_args view;
    float eye_z;   // orthographic: near, as in shade
    float axis[3]; // unit, view space
    float offset;  // of the camera along the axis, less whole bold intervals
    float opacity;
    float color[3];
    uint32_t kinds;     // 1, 2
    uint32_t of_values; // 1: lines of equal values, by the slopes plane
    float interval[PT_CONTOUR_KINDS], inverse[PT_CONTOUR_KINDS]; // 1 / interval
    float width[PT_CONTOUR_KINDS];                               // pixels
    float even[PT_CONTOUR_KINDS], per_even[PT_CONTOUR_KINDS];    // 1 / even
};

// fog: colour (1 - s) + fog alpha s with s = density clamp((d - start) inverse, 0, 1), d the distance from the eye; in orthographic
// views z.
struct fog_args {
    struct view_args view;
    float start, inverse, density;
    float color[3];
};

#endif
