// SPDX-License-Identifier: GPL-3.0-or-later
// Words that a point has in its cloud, and what scenes and kernels both know of them.
#ifndef PT_SHARED_WORDS_H
#define PT_SHARED_WORDS_H

#include "shared/view.h"

// The surfel of a point: octahedral normal 2 x 13 bits (at most 0.03 degrees off), spacing class 6 bits.
#define PT_NORMAL_NONE 0x03FFFFFFu // these 26 bits all ones: the point has no normal
#define PT_NORMAL_BITS 0x03FFFFFFu
#define PT_SPACING_SHIFT 26
// The shape word of a point, where its cloud was analysed: the footprint, an ellipse on the tangent plane, and what kind of
// point it is. Bits 0-5: class of the major half axis, as of spacings; 0: none, the point is a pixel. 6-9: k, the minor half axis
// is 2^(-k / 4) of it. 10-15: a, the major axis is cos(a pi / 64) t1 + sin(a pi / 64) t2 in the frame of the point's normal n in
// its object: s = n.z >= PT_SHAPE_UP ? 1 : -1, q = -1 / (s + n.z), b = n.x n.y q, t1 = (1 + s n.x^2 q, s b, -s n.x),
// t2 = (b, s + n.y^2 q, -n.y) (Duff et al. 2017); below 0, n.z is -1 / 4095 at most. 16-21: class of the thickness sigma, in
// sixteenths of the spacings' unit; 0: not known. 22-24: kind. 25-28: level of trust: l stands for 1 - ((15 - l) / 15)^2.
#define PT_SHAPE_CLASS_BITS 63u // of each class
#define PT_SHAPE_RATIO_SHIFT 6
#define PT_SHAPE_ANGLE_SHIFT 10
#define PT_SHAPE_SIGMA_SHIFT 16
#define PT_SHAPE_KIND_SHIFT 22
#define PT_SHAPE_KIND(word) (((word) >> PT_SHAPE_KIND_SHIFT) & 7u)
#define PT_SHAPE_TRUST_SHIFT 25
#define PT_SHAPE_TRUST_BITS (15u << PT_SHAPE_TRUST_SHIFT)
#define PT_TRUST_LEVELS 16
#define PT_TRUST_STEP 0.00444444455f // 1 / 225: level l of trust is 225 - (15 - l)^2 of these
#define PT_SHAPE_SIGHT_SHIFT 22     // kind, trust and seen through are a byte: what hides points is a set of such
#define PT_SHAPE_SEEN_THROUGH (1u << 29) // a scanner looked through where it lies
#define PT_SHAPE_UP -1e-4f // n.z of which s is 1
#define PT_KIND_UNKNOWN 0u
#define PT_KIND_SURFACE 1u
#define PT_KIND_BORDER 2u
#define PT_KIND_LINE 3u
#define PT_KIND_VOLUME 4u // foliage
#define PT_KIND_STRAY 5u
// cos(a pi / 64), sin(a pi / 64) for a < 64; 2^(k / 4) for k < 16, as many again that fill a vector.
#define PT_SHAPE_COSINES \
    1.0f, 0.99879545f, 0.99518472f, 0.989176512f, 0.980785251f, 0.970031261f, 0.956940353f, 0.941544056f, \
    0.923879504f, 0.903989315f, 0.881921291f, 0.857728601f, 0.831469595f, 0.803207517f, 0.773010433f, 0.740951121f, \
    0.707106769f, 0.671558976f, 0.634393275f, 0.59569931f, 0.555570245f, 0.514102757f, 0.471396744f, 0.427555084f, \
    0.382683426f, 0.336889863f, 0.290284663f, 0.242980182f, 0.195090324f, 0.146730468f, 0.0980171412f, 0.0490676761f, \
    0.0f, -0.0490676761f, -0.0980171412f, -0.146730468f, -0.195090324f, -0.242980182f, -0.290284663f, -0.336889863f, \
    -0.382683426f, -0.427555084f, -0.471396744f, -0.514102757f, -0.555570245f, -0.59569931f, -0.634393275f, -0.671558976f, \
    -0.707106769f, -0.740951121f, -0.773010433f, -0.803207517f, -0.831469595f, -0.857728601f, -0.881921291f, -0.903989315f, \
    -0.923879504f, -0.941544056f, -0.956940353f, -0.970031261f, -0.980785251f, -0.989176512f, -0.99518472f, -0.99879545f
#define PT_SHAPE_SINES \
    0.0f, 0.0490676761f, 0.0980171412f, 0.146730468f, 0.195090324f, 0.242980182f, 0.290284663f, 0.336889863f, \
    0.382683426f, 0.427555084f, 0.471396744f, 0.514102757f, 0.555570245f, 0.59569931f, 0.634393275f, 0.671558976f, \
    0.707106769f, 0.740951121f, 0.773010433f, 0.803207517f, 0.831469595f, 0.857728601f, 0.881921291f, 0.903989315f, \
    0.923879504f, 0.941544056f, 0.956940353f, 0.970031261f, 0.980785251f, 0.989176512f, 0.99518472f, 0.99879545f, \
    1.0f, 0.99879545f, 0.99518472f, 0.989176512f, 0.980785251f, 0.970031261f, 0.956940353f, 0.941544056f, \
    0.923879504f, 0.903989315f, 0.881921291f, 0.857728601f, 0.831469595f, 0.803207517f, 0.773010433f, 0.740951121f, \
    0.707106769f, 0.671558976f, 0.634393275f, 0.59569931f, 0.555570245f, 0.514102757f, 0.471396744f, 0.427555084f, \
    0.382683426f, 0.336889863f, 0.290284663f, 0.242980182f, 0.195090324f, 0.146730468f, 0.0980171412f, 0.0490676761f
#define PT_SHAPE_RATIOS \
    1.0f, 1.18920708f, 1.41421354f, 1.68179286f, 2.0f, 2.37841415f, 2.82842708f, 3.36358571f, \
    4.0f, 4.75682831f, 5.65685415f, 6.72717142f, 8.0f, 9.51365662f, 11.3137083f, 13.4543428f, \
    1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, \
    1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f

#define PT_SCAN_WORDS 32 // of 32 scans each: those that may be hidden

// The shadow word of a point and light: what the samples so far take away, in 1/255 a sample, and above it what the maps
// of the current sample take, 0..255.
#define PT_SHADOW_SUM 0x000FFFFFu
#define PT_SHADOW_SHIFT 24

// Of points that a picture shows, where whole shadow textures are not asked for: for every so many slots of a cloud two words. Bit i of
// the first: slot i is shown. The second is their rank, which of the shown points, of all clouds, the first of them is, from 1 on; 0:
// it has none yet. Those behind it follow: pt_shown_place. Shadow words of shown points lie side by side, those of one point's lights
// together; the first place is nobody's.
#define PT_MARK_SLOTS 32

// What a station saw: see reopen.
#define PT_SIGHT_BEND 1.25f // a tangent u lies at (1.25 - 0.25 u^2) u on its face: cells are 0.75 to 1 of a face's mean angle wide
#define PT_SIGHT_SHIFT 12   // 11 bits of mantissa and 5 of exponent are kept of a range: 0.05 %
#define PT_SIGHT_LEAST 1e-18f // a place nearer to a station than this, or farther than PT_SIGHT_FARTHEST, was not looked through
#define PT_SIGHT_FARTHEST 1e18f

// The field word of a point: F in steps of 1/65535 in the upper half, and in the lower the radius of its ball, object units: 0, or a
// number k above, of the float whose bits are radius_base + k radius_step. Where all points are soft, the word is k, and F is 1.
#define PT_FIELD_SHIFT 16
#define PT_FIELD_RADIUS 0xFFFFu
#define PT_FIELD_MOST 65535.0f

#endif
