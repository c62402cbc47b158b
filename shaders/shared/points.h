// SPDX-License-Identifier: GPL-3.0-or-later
// Stage points: which points are drawn, and which of them is the nearest of a pixel.
#ifndef PT_SHARED_POINTS_H
#define PT_SHARED_POINTS_H

#include "shared/discs.h"
#include "shared/words.h"
#include "shared/clips.h"

// sift: which points are drawn. A hidden class takes them all, a hidden shape and the mask too; of clips: in one that keeps, if there are
// any, in none that cuts. Bit-equal everywhere, as scatter is.
struct sift_args {
    uint32_t by_class;  // 1: classes are there, and some are hidden
    uint32_t hidden[8]; // bit c % 32 of word c / 32: class c
    uint32_t by_shape;  // 1: shapes are there, and some are hidden
    uint32_t hidden_shapes[8]; // likewise, of the byte from PT_SHAPE_SIGHT_SHIFT on
    uint32_t by_mask;   // 1: the mask is there: a word of each PT_SLOTS_A_WORD slots of the cloud, bit i: slot i is hidden
    uint32_t by_field;  // 1: the field is there, and points above ...
    uint32_t threshold; // ... are soft: in steps, as in gather_args
    uint32_t by_scan;   // 1: the scans are there, and some are hidden
    uint32_t hidden_scans[PT_SCAN_WORDS]; // bit s % 32 of word s / 32: scan s; those beyond are drawn
};

// scatter: points -> least key a pixel. [D 3.1]; behind a layer only points with z > limit at their pixel count. [D 5]
struct scatter_args {
    struct view_args view;
    uint32_t instances;
    uint32_t behind; // 1: the limit plane holds
    uint32_t sifted; // 1: the drawn words hold; they follow the limit plane, if there is one
};

// splat: points -> least key of every pixel that their discs cover. SPEC 5, solid; the visibility pass. A disc is flat, has the
// point's normal (without one: faces the picture) and covers the pixels whose centre's ray meets it; and the pixel that the
// point falls into, if with that ray beside the disc then at the point's own depth.
struct splat_args {
    struct view_args view;
    uint32_t instances;
    uint32_t behind; // 1: the limit plane holds
    uint32_t sifted; // as in scatter_args
};

#endif
