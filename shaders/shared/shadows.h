// SPDX-License-Identifier: GPL-3.0-or-later
// Stage shadows: which points a light reaches.
#ifndef PT_SHARED_SHADOWS_H
#define PT_SHARED_SHADOWS_H

#include "shared/view.h"

// shadow_test: a texel is this much wider than it is, so that a plane that crosses it from corner to corner stays within d_eff.
#define PT_TEXEL_SLACK 1.5f
// shadow_test: so many of the 8 texels around must shadow the point as well: one or two texels by themselves are a stray point, whose
// shadow is a speck. A line of texels has them.
#define PT_SHADOW_SUPPORT 2
#define PT_SHADOW_STEEP 20.0f // 1 / C
// shadow_test: a texel this many times its d_eff behind the one beside it shows another surface, under lights that look in perspective.
#define PT_SHADOW_APART 4.0f

// mark: a bit for every point that the picture shows, measured or as the source of filled pixels: PT_MARK_SLOTS.
struct mark_args {
    struct view_args view;
    uint32_t id_base, id_first, id_count; // as in instance_args
};

// rank: of the chunks' slots, marks that have no rank get one, in any order.
struct rank_args {
    struct view_args view; // of the picture; not read
};

// shadow_test: points against the filled map of a light [D 6], SPEC 4. A point is in shadow if z > z_map + d_eff, d_eff of the point in
// this view with a texel PT_TEXEL_SLACK wider. Without a normal, d_eff is at least that of the surface that the map shows there,
// and z_map the greatest of the 3 x 3 texels around, in perspective of those within PT_SHADOW_APART times that surface's d_eff
// behind it: no slope gives acne, and shadows of suns, which see the ground at 2 degrees, end a texel early. Where one of these
// shows nothing, the surface ends within them, and no neighbour tells how far away its last points are: d_eff is then at least
// PT_SHADOW_STEEP times the point's own, that of the steepest slope. z > z_map + d_eff must hold at PT_SHADOW_SUPPORT of the 8
// texels around, too.
// Points outside the window or before z_near are lit. With `faint` the caster's points have opacities of their own: the loss is
// also in proportion to that of the point that the map shows.
struct shadow_test_args {
    struct view_args view;         // of the map
    struct instance_args instance; // of the receiver: d_min, spacing, normals towards the light
    float window[4];  // x0, y0, x1, y1: pixels of the full picture that count
    uint32_t base;    // first of the light's words
    uint32_t step;    // from a point's word to the next one's: 1, or, marked, as many as there are lights
    uint32_t loss;    // 1..255: what the casters of this map take from 255
    uint32_t alone;   // 1: the sample's only map
    uint32_t close;   // 1: the sample's last map: its loss goes into the sum. 0 when alone
    uint32_t samples; // with this one
    uint32_t compare; // 1: differs[0] becomes 1 unless every point's samples lost the same
    uint32_t marked;  // 1: only points with a mark; their words lie by rank, not by slot
    uint32_t faint, caster; // caster: id_base of the only cloud that casts
};

// dim: points behind the soft points of a light's view, SPEC 5. -ln of the light that comes through is that of the veil plane's texels
// around, between their middles, and between the ends of the slab that the point lies in. Points outside the window or before z_near
// take all light.
struct dim_args {
    struct view_args view; // of the map
    float window[4];       // as in shadow_test_args, as are these:
    uint32_t base, step, alone, close, samples, compare, marked;
    uint32_t veils;        // slabs of the plane
    float veil_from, veil_scale; // as in soft_args; 1 / veil_deep
};

// limit: what a map's next layer sees lies beyond z + deff[from]; +inf (nothing does) where the map is empty, or the point that it
// shows takes all light: opacity and loss are 255.
struct limit_args {
    struct view_args view;
    uint32_t caster; // id_base of the only cloud that casts
    uint32_t loss;   // as in shadow_test_args
};

#endif
