// SPDX-License-Identifier: GPL-3.0-or-later
// What the walk of tail.c knows, and where it is.
#ifndef PT_TAIL_H
#define PT_TAIL_H

#include "device_cpu/kernels/antialias.h"
#include "device_cpu/kernels/edl.h"
#include "device_cpu/kernels/extract.h"
#include "device_cpu/kernels/obscure.h"
#include "device_cpu/kernels/peel.h"
#include "device_cpu/kernels/shade.h"
#include "device_cpu/kernels/smooth.h"
#include "device_cpu/pointwise/walk.h"

enum { UNIT = PT_TILE, CHANNELS_SEEN = 6, CHANNELS_COLOR = 16 }; // shaded 4, smoothed 4, shown 5, albedo 3
// Row s is shaded when s + reach has been seen, s - lag is darkened by what obscures it then, s - lag - 1 smoothed, s - lag - 2 finished:
// anti-aliasing reads s - lag - 3 too.
enum { RING = 4, RING_MOST = 8, LAG = PT_OBSCURE_BLUR, SEEN_MOST = 2 * PT_BLEND_MOST + 1 };
_Static_assert(RING + LAG <= RING_MOST && PT_BLEND_MOST + LAG + 4 <= SEEN_MOST, "rings hold the rows of a walk");

struct steps { // passes that follow one another
    uint32_t first, count;
};

struct tail {
    const struct pt_cpu_pass *passes;
    uint32_t shade_count;               // of passes, from the first on
    struct steps before, darkened;      // pointwise: before smoothing; of these, behind `obscure`
    struct steps after, last;           // behind smoothing; on the picture
    const struct obscure_args *obscure; // NULL: off
    const struct edl_args *edl;         // NULL: off; a step among the others
    struct pt_edl_planes edl_planes;
    const struct pt_buffer *albedo;         // the plane that one of them asks for; else NULL
    int shows_normals;                      // one of them, or extract, asks for normals
    const float *colors;                    // where nothing is shaded: as they are so far; and, where peeling or extract
    const float *shading, *arrived;         // ask for them, what was shown
    const struct smooth_args *smooth;       // NULL: off
    const struct antialias_args *antialias; // NULL: off
    const struct compose_args *compose;     // NULL: the layer is peeled, or
    float *left;                            // its colours go into this plane
    const struct extract_args *extract;     // NULL: nothing beside the colour
    float *combined, *depth, *normals, *source, *shadow;
    const float *offsets;         // to the middles of measured pixels, where the depth asks for them
    const float *away;            // of discs' points, where the source asks for it
    const struct peel_args *peel; // NULL: the picture is composed
    const float *through;         // of the layers before; NULL before the first
    const float *line;            // lines, which anti-aliasing leaves to ink; NULL: none
    struct pt_peeled peeled;
    struct pt_tile_value *tiles;
    int channels;      // of colours: 3, or 4 with alpha
    int32_t base, end; // rows that are finished
    struct pt_planes planes;
    int32_t reach, lag;
    uint32_t ring_mask; // RING - 1 or, where rows lag, RING_MOST - 1
    int with_normals;
    float weights[2 * PT_BLEND_MOST * PT_BLEND_MOST + 1];
    float *memory; // per thread
    size_t stride, thread_floats;
    uint32_t ring;      // of rows seen
    struct walk *walks; // per thread
};

// Where a thread is: it goes on where it stopped when its next rows follow.
struct walk {
    int32_t first, next; // row of the picture that it began with; that comes next
    struct pt_seen_row seen[SEEN_MOST];
    struct pt_color_row shaded[RING_MOST], smoothed[RING_MOST];
    float *shown[RING_MOST][5];  // normals, opacities, what arrives of the lights
    float *albedo[RING_MOST][4]; // the last of them NULL
    float *obscured[RING_MOST];  // before the mean
    struct pt_edl_ring edl;
    int32_t edl_next;          // row that it takes next
    float *blended[3];         // sums of normals of the row at hand, where all that their windows show is one layer:
    uint8_t *wide;             // by `flat` of the row, or of windows wider than 3 x 3 pixels their radius, else 0
    struct pt_tile_sum *tiles; // of the row of tiles at hand
};

static struct pt_seen_row *seen_row(const struct tail *tail, struct walk *walk, int32_t y)
{
    return &walk->seen[(uint32_t)(y + 4 * SEEN_MOST) % tail->ring];
}

static uint32_t slot(const struct tail *tail, int32_t y) { return (uint32_t)y & tail->ring_mask; }

// Whether a pass shades points with their own colours, for a step that asks for these.
static int shades_albedo(const struct tail *tail, uint32_t i)
{
    return tail->albedo && tail->passes[i].call.buffers[PT_BUF_shade_color] == tail->albedo;
}

#endif
