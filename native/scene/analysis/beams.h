// SPDX-License-Identifier: GPL-3.0-or-later
// What a scanner's own sampling says of footprints: between a station's neighbouring samples lies one interval of its grid, so
// that no sample stands for more of the scene than its cell (SPEC 11).
#ifndef PT_BEAMS_H
#define PT_BEAMS_H

#include "interval.h"
#include "neighbourhood.h"

struct pt_beams {
    uint32_t count;
    struct pt_beam {
        double place[3]; // object units
        struct pt_interval interval;
    } * each;
};

// Of the descriptor's stations and the drawn points that it gives to each. 0 or PATINA_ERROR_MEMORY.
int pt_beams_create(const struct patina_cloud *cloud, const patina_analysis_desc *desc, struct pt_pool *pool,
                    struct pt_beams *out);
void pt_beams_destroy(struct pt_beams *beams);

// Shrinks the footprint at p to the beam's cell where that is smaller; what is not a surface becomes a dot of its width.
void pt_beam_limit(const struct pt_beam *beam, const double p[3], const struct pt_sample *sample,
                   struct pt_neighbourhood *hood);

#endif
