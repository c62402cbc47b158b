// SPDX-License-Identifier: GPL-3.0-or-later
// Levels of trust of an analyzed cloud's points, as patina_cloud_info.trusts counts them.
#ifndef PT_TRUST_LEVEL_H
#define PT_TRUST_LEVEL_H

#include "patina/patina.h"

enum { PT_TRUST_TOP = sizeof(((patina_cloud_info *)0)->trusts) / sizeof(uint64_t) - 1 };

// The trust that a level stands for.
static inline double pt_trust_of_level(uint32_t level)
{
    const double doubt = (PT_TRUST_TOP - level) / (double)PT_TRUST_TOP;
    return 1.0 - doubt * doubt;
}

// The lowest level that stands for at least this trust. least: at most 1; within 1e-4, since float32 cannot hold all levels' trusts.
static inline uint32_t pt_lowest_level(double least)
{
    uint32_t level = 0;
    while (level < PT_TRUST_TOP && pt_trust_of_level(level) < least - 1e-4)
        level++;
    return level;
}

// Points below a level. PT_TRUST_TOP + 1: all points.
static inline uint64_t pt_points_below(const patina_cloud_info *info, uint32_t level)
{
    uint64_t count = 0;
    for (uint32_t i = 0; i < level; i++)
        count += info->trusts[i];
    return count;
}

#endif
