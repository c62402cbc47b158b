// SPDX-License-Identifier: GPL-3.0-or-later
// How far apart the directions are in which a scanner sampled: told by its rows and columns, else found from how dense they are.
#ifndef PT_INTERVAL_H
#define PT_INTERVAL_H

#include "scene/clouds/cloud.h"

struct pt_interval {
    double azimuth, elevation; // radians: between columns at elevation 0, and between rows; 0: not known
    int even;                  // 1: columns lie as far apart anywhere, as of a camera or a scanner that does not stand upright
};

// Of the descriptor's stations, from the drawn points that it gives to each; strides are explicit. out: station_count of them. 0 or
// PATINA_ERROR_MEMORY. Any number of threads gives the same. pool: as pt_parallel takes it.
int pt_intervals_find(const struct patina_cloud *cloud, const patina_analysis_desc *desc, struct pt_pool *pool,
                      struct pt_interval *out);

// The station of a point by its number in the caller's order; without the caller's word the nearest to p.
uint32_t pt_station_of(const patina_analysis_desc *desc, uint32_t number, const double p[3]);
// Its row or column; what is below 0 is far beyond any.
uint32_t pt_line_at(const patina_array *array, uint64_t number);

#endif
