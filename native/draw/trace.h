// SPDX-License-Identifier: GPL-3.0-or-later
// Section lines: follows the samples of a slab, a fitted curve at a time. No implicit function and no side of a normal is needed, so that a
// flipped normal opens no line and both faces of a thin wall have lines of their own.
#ifndef PT_DRAW_TRACE_H
#define PT_DRAW_TRACE_H

#include "lines.h"
#include "samples.h"

// Adds a dense polyline for each smooth piece of the section: pieces end at corners and where samples end. Writes normals, qualities and
// owners into the samples. threads: 0 takes one per core; any number gives the same lines. 0 or an error.
int pt_trace_lines(struct pt_cut_samples *samples, uint32_t threads, patina_progress *progress, struct pt_lines *lines);

#endif
