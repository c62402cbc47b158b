// SPDX-License-Identifier: GPL-3.0-or-later
// Pieces of a section line joined to polylines: at corners, over gaps that footprints cover, and dashed over somewhat wider ones.
#ifndef PT_DRAW_JOIN_H
#define PT_DRAW_JOIN_H

#include "lines.h"
#include "samples.h"

// Joins open lines of one layer. Gaps that footprints of samples cover become part of a line; gaps of up to four footprints' half axes
// become lines of the layer `bridged`. Where two lines meet at an angle their corner is the intersection of both. 0 or PATINA_ERROR_MEMORY.
int pt_join_lines(const struct pt_cut_samples *samples, struct pt_lines *lines, uint32_t bridged);

#endif
