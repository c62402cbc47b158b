// SPDX-License-Identifier: GPL-3.0-or-later
// What the analysis tells of a point (SPEC 11), and the shape word that packs it into 32 bits of a slot (shared/words.h).
#ifndef PT_SHAPE_WORD_H
#define PT_SHAPE_WORD_H

#include "cloud.h"
#include "base/trust.h"
#include "shared/words.h"

#define PT_COVER_DOT 0.2 // half axes of volume and strays, in distances to the nearest neighbor

struct pt_neighbourhood {
    uint32_t kind;             // PT_KIND_*
    int has_normal, sided;     // sided: the normal is known to be on its side
    double normal[3], axis[3]; // axis: of the greater half axis, on the plane
    double major, minor;       // half axes of the footprint; 0: none
    double spacing, sigma;     // 0: unknown
    double sampled;            // the spacing before bounds: what a picture's levels are counted with
    double certainty;          // 0..1, of the kind; shape words do not hold it
    double trust;              // 0..1, see trust.h; not found here
    int beside;                // another surface lies that near
    int afar;                  // flat from afar alone: its nearest neighbors are a volume
    double uneven;             // spacing along the greater axis in those across, as measured; 1: not told
};

// Bit of shape words that no kernel reads: another surface lies beside the point's own, not farther than its neighbours reach.
#define PT_SHAPE_BESIDE (1u << 30)

// Bit of shape words that no kernel reads: the point's color is the mean of its neighbors'.
#define PT_SHAPE_UNCOLORED (1u << 31)

// Whether some of a cloud's points, one in a hundred, have another surface beside theirs. One slot in 16 is asked, of large clouds in
// some 512 chunks that lie evenly among all.
int pt_shapes_beside(const struct patina_cloud *cloud);

// The level whose trust is nearest (base/trust.h).
uint32_t pt_level_of_trust(double trust);
// The least level that is drawn by default, of a cloud with so many points of each level: from PATINA_TRUST_DEFAULT to PATINA_TRUST_MOST, as
// high as it can be while at most 1 % of the points that are probably right are below. Trust is calibrated, so a level's points are right
// in that share. PATINA_TRUST_DEFAULT of a clean cloud: less than 0.05 % of its points are below that.
uint32_t pt_default_level(const uint64_t counts[PT_TRUST_LEVELS]);

// Shape words. base: the cloud's spacing_base.
uint32_t pt_pack_shape(const struct pt_neighbourhood *hood, uint32_t normal_bits, double base);
// Half axes, sigma and trust of a word; out->axis where normal_bits are a normal.
void pt_unpack_shape(uint32_t shape, uint32_t normal_bits, double base, struct pt_neighbourhood *out);

#endif
