// SPDX-License-Identifier: GPL-3.0-or-later
// Stage measured: what the pixels that points fell into show.
#ifndef PT_SHARED_MEASURED_H
#define PT_SHARED_MEASURED_H

#include "shared/discs.h"
#include "shared/words.h"

// Pixels, radius of the window that a normal is estimated from where no less is asked for: at 3, steep planes lose 0.3% of
// their measured pixels.
#define PT_ESTIMATE_LEAST 4.0f
// What blend makes of the discs that count.
#define PT_BLEND_COLORS 0 // #if reads them
#define PT_BLEND_MARKS 1
#define PT_BLEND_LIGHT 2
#define PT_BLEND_LIGHTS 7 // of PT_BLEND_LIGHT, at once
#define PT_STEEP 0.5f // normals
// normals: pixels on each side that are asked what depth changes by. With one, a sparse plate before a floor takes the floor
// between its points for its own slope: 3% of its umbra under a sun was lit, 0 with three.
#define PT_STEP_REACH 3

// normals: least-squares plane of 1/z (orthographic: z) over a window, for points without normals. Its radius is d /
// footprint(z), two spacings there in pixels, rounded up, from PT_ESTIMATE_LEAST to `radius`. Taken are pixels with
// |z_q - (z + step)| <= max(d, 4 footprint(z) max(|dx|, |dy|)), d = d_eff facing the viewer; 4: 76 degrees. step = 0, or with
// `steep` s_x dx + s_y dy, and what is taken may be off by PT_STEEP (|s_x dx| + |s_y dy|) too. s is what z changes by a pixel
// to the next of the row or column that shows something, at most PT_STEP_REACH off and `radius`: of the changes on both sides the
// lesser where they go the same way, else 0; where one side shows nothing, that on the other.
struct normals_args {
    struct view_args view;
    struct instance_args instance;
    uint32_t radius; // of the window at most, 1..16
    uint32_t steep;  // 1: of a light's map, where a low sun sees the ground at a few degrees
};

// resolve: key -> view-space normal, 1 / max(|n.v|, C), d_eff; from = the pixel itself. span: d_eff as if no sigma were known.
struct resolve_args {
    struct view_args view;
    struct instance_args instance;
    float sigma_scale;  // times instance.spacing of its class: sigma, as in assess_args; 0: shapes are not read
    uint32_t with_span; // 1: span is written
};

// blend: what the discs within d_eff behind the nearest surface of a pixel show there, weighted by how near their centres lie:
// w = exp(-2 s^2), s = distance over radius; in its own pixel a disc counts as at least a pixel wide. The sums are integers,
// PT_SUM_SCALE a unit, so that no order shows.
//   normal.xyz: unit mean; of instances without normals as it was. away: how many pixels off the point of the key fell.
//   albedo: mean colour, each disc weighted by its opacity too, and the mean opacity.
//   offset: with `depths`, how far behind the nearest surface the discs within PT_DISC_DEPTHS d_eff lie in the mean, by the same weights.
// Other parts of it, of the same discs:
//   MARKS: a bit for every point whose disc counts anywhere, as mark has it, in place of colours, and for what others a device likes.
//   No plane is written.
//   LIGHT: shadow words in place of colours; albedo: a plane a casting light of the share that does not arrive, in the mean, by the
//   weights that colours have, in 1 / PT_SHADOW_SUM. Instances that receive no shadows lose nothing.
struct blend_args {
    struct view_args view;
    uint32_t instances;
    uint32_t sifted; // as in scatter_args
    uint32_t depths; // 1: the offset plane is written
    uint32_t part;   // PT_BLEND_*
    uint32_t first, lights;        // LIGHT: of so many casting lights from this one on
    float scales[PT_BLEND_LIGHTS]; // of a word's sum, 1 / (255 samples)
    uint32_t marked, step;         // LIGHT: as in shade_args
};

// center: the tangent plane n . (p - q) = 0 of a measured point q, d pixels before the middle of its pixel, met by the ray r there:
// z_middle - z = -z (n.x xs d.x + n.y ys d.y) / (n . r) (orthographic: without z), within -min(d_eff, z / 2) to d_eff; 0 where the
// plane lies along the ray.
struct center_args {
    struct view_args view;
};

#endif
