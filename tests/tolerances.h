// SPDX-License-Identifier: GPL-3.0-or-later
// The one table of tolerances between devices (float32) and the reference (float64). Each has its reason; none may be
// widened to make a test pass. Between devices nothing here applies to keys, `from`, d_eff and normals: those are
// compared bit by bit.
#ifndef PT_TOLERANCES_H
#define PT_TOLERANCES_H

// Unit roundoff of float32: one correctly rounded operation is off by at most this share of its result.
#define TOL_UNIT 0x1p-24

// ---- what float32 cannot decide (the reference then admits every outcome) ---------------------------------------

// (lo + R p) + hi: three products and four sums round each term at most five times; shares of the terms' absolute sum.
#define TOL_PROJECT (6.0 * TOL_UNIT)
// X * rcp(z): reciprocal within 2 ulp (4 units), product 1; share of the screen position.
#define TOL_SCREEN (6.0 * TOL_UNIT)
// n . (eye - w p): product, difference, product, two sums, and four roundings in the decoded normal; share of the terms.
#define TOL_CULL (10.0 * TOL_UNIT)
// ray_x0 + ray_xs X: one product, one sum; share of the terms.
#define TOL_RAY (2.0 * TOL_UNIT)
// n . r: product and two sums; share of the terms.
#define TOL_DOT (3.0 * TOL_UNIT)
// z dq / dp, d_eff / footprint: product, reciprocal within 2 ulp, product; share of the result.
#define TOL_QUOTIENT (7.0 * TOL_UNIT)
// A sum or difference of two float32: the rounding itself, nothing else.
#define TOL_SUM TOL_UNIT
// d_eff above level 0: 2^l footprint z w, three products; share of the result.
#define TOL_LEVEL (3.0 * TOL_UNIT)
// |n . r| of a unit normal below which a pixel's ray is parallel to the tangent plane: the dot product's own error
// (about 2e-7) times ten, so that the extrapolated depth would be off by a tenth; any depth in the clamp is admitted.
#define TOL_PARALLEL 2e-6
// 4 footprint max(|dx|, |dy|) against |z_q - z_p|: up to three products, one difference; share of the threshold.
#define TOL_WINDOW (6.0 * TOL_UNIT)

// ---- how far values may lie off ---------------------------------------------------------------------------------

// A decoded, transformed, unit normal: decoding 4, matrix 5 (times its conditioning), 1/sqrt within 2 ulp, product.
#define TOL_NORMAL (16.0 * TOL_UNIT)
// 1 / max(|n.v|, C) and d_eff: normalised ray (6), dot (3), reciprocal (4), products (4), beside the normal's own error
// divided by the cosine; share of the value.
#define TOL_LAYER (18.0 * TOL_UNIT)
// Least squares: each 1/z is off by 5 units, the sums of products by a few more; times the exact gain of the fit.
#define TOL_FIT (12.0 * TOL_UNIT)
// Normal equations about the mean: each product of two sums 1, their difference 1, sums of up to 33 x 33 terms a few.
#define TOL_SOLVE (6.0 * TOL_UNIT)
// A fit is compared only where its own error bound is below this (radians): beyond it float32 holds no normal.
#define TOL_FIT_LIMIT 0.05
// Sum of up to 17 x 17 weighted normals: at most 289 roundings of partial sums, in practice their square root (17), with
// the weights' division (5) and the normalisation (8): 32 units, divided by how much the normals cancel.
#define TOL_BLEND (32.0 * TOL_UNIT)
// Lit and filtered colour: 2e-5 of the sum of the absolute terms is a tenth of an 8-bit step at 1/20 grey; about 40
// roundings (sRGB power 8, dot products, 1/pi, sums over lights) use 40 units = 2.4e-6 of it, drivers' pow() the rest.
#define TOL_COLOR 2e-5
// Exposure and contrast, beside TOL_LOG: gain, grey and contrast are a product each, before and behind logarithm and power;
// share of the value, and of its distance in stops from mid grey.
#define TOL_STOPS (4.0 * TOL_UNIT)
// Opacity: byte / 255 and its product with the instance's, two products and the constant's rounding; share of the value.
#define TOL_OPACITY (3.0 * TOL_UNIT)
// r . v before it is raised to the shininess: reflection (6), view vector (7), dot (3).
#define TOL_REFLECT (16.0 * TOL_UNIT)
// exp(-2 s) of a disc by a polynomial of degree 4 on 0..1: off by 2.4e-4 at most.
#define TOL_GAUSSIAN 2.5e-4
// World-space normal pass: three products, two sums; share of the terms.
#define TOL_ROTATE (4.0 * TOL_UNIT)
// v (n.r - slope) and z n.r: ray (its own error beside), product, two sums, slope (4), product; share of the terms.
#define TOL_FRONT (10.0 * TOL_UNIT)
// A line's share: distance of an integer's root (5), radius by a reciprocal (6), sum, fade (3), reciprocal (4), product; share of
// the greatest distance, divided by the fade.
#define TOL_SHARE (20.0 * TOL_UNIT)
// Euclidean distance of the source pass: the root of an exact integer, drivers' sqrt() within 3 ulp; share.
#define TOL_DISTANCE (8.0 * TOL_UNIT)

// Trust: n times the rounded 1 / 15; thickness: one product. Share.
#define TOL_KNOWN (2.0 * TOL_UNIT)

// Where a station looked through: place on a face, as a share of its edge, and squares of ranges, after a sum of four terms that
// cancel to no less than a twentieth (else undecided), a reciprocal and a cubic.
#define TOL_SIGHT (100.0 * TOL_UNIT)

// Our log2: the polynomial 1.5e-7, its last product and the sum; besides, a unit of the result. And our 2^x: 2.3e-7 of the
// polynomial, three roundings; share.
#define TOL_LOG 2.5e-7
#define TOL_POWER 5e-7

// ---- how much may stay undecided --------------------------------------------------------------------------------

// Share of a random picture's pixels that the reference may leave open; more would make the comparison hollow.
#define TOL_UNSURE_SHARE 0.02
// The same for pictures made to be undecidable: depths d_eff +- 8 ulp apart, normals across the view.
#define TOL_UNSURE_HARD 0.25

#endif
