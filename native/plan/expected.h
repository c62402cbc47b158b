// SPDX-License-Identifier: GPL-3.0-or-later
// The error that a picture is expected to have, from measured curves (expected_curves.def; build/curves makes it anew).
#ifndef PT_EXPECTED_H
#define PT_EXPECTED_H

#include "patina/patina.h"

// How a surface is closed: the ways of filling, cheapest first, then discs.
enum pt_means {
    PT_MEANS_UNFILLED,
    PT_MEANS_PAPER,
    PT_MEANS_CLOSED,
    PT_MEANS_REFINED,
    PT_MEANS_COUNT,
    PT_MEANS_SPLATS = PT_MEANS_COUNT,
    PT_MEANS_RANGES // no curve is known
};

// What settings ask for of filling, and the other way round.
enum pt_means pt_means_of(uint32_t quality, uint32_t fill);
void pt_means_settings(enum pt_means means, uint32_t *quality, uint32_t *fill);
const char *pt_means_name(enum pt_means means);

// At a spacing on screen as struct pt_plan has it, pixels. Between measured spacings on straight lines over its logarithm; below
// them as at the first; beyond them by the power of the last two, at least the root. Infinite beyond PT_SPACING_KNOWN and where the
// spacing is not above 0.
#define PT_SPACING_KNOWN 64.0
patina_expected_error pt_expected_error(enum pt_means means, double spacing_px);

// The cheapest means whose colour error is not above the target, else those with the least.
enum pt_means pt_means_for(double target, double spacing_px);

#endif
