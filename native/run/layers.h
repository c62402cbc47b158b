// SPDX-License-Identifier: GPL-3.0-or-later
// What depends on pixels between two layers (DESIGN rule 3): which chunks may still show something behind those taken so far.
#ifndef PT_LAYERS_H
#define PT_LAYERS_H

#include "plan/plan.h"

struct pt_tile {      // as the TILES plane has it
    float least;      // limit; +inf: every pixel is finished
    uint32_t covered; // pixels
};

// Of a frame's layer.
struct pt_layer {
    uint64_t points; // in chunks that were scattered
    uint64_t pixels; // that it covers; 0 where one layer was not peeled
};

// Pixels that the layer covers. tiles: the whole plane.
uint64_t pt_layer_pixels(const struct pt_plan *plan, const struct pt_tile *tiles);

// The chunks of an instance that have a point beyond some limit of the tiles they may fall on; left out are only such whose
// points would all be refused. out: room for all of them. Returns their number, adds to *points.
uint32_t pt_layer_chunks(const struct pt_plan *plan, uint32_t instance, const struct pt_tile *tiles, struct chunk_view *out,
                         uint64_t *points);

#endif
